//! Audits one phase whose speed is known by the length of the path, at as many places as its motion needs.
//!
//! The uses of all limits are evaluated at both ends. `PhaseByLength::bulge` bounds what they can be between two places:
//! * if none of them can be above the greatest use found so far, nothing else is evaluated;
//! * if they may be much above those of the two places, the interval is halved;
//! * otherwise the vertex of a parabola through three places tells where a use is greatest, and it is evaluated there.

use crate::chord::chord_error;
use crate::columns::{Columns, RATES};
use crate::curve::Curve;
use crate::peak::{are_far_below, peak, Peak};
use crate::phase_by_length::{PhaseByLength, Place};
use crate::phase_motion::ROUNDING;
use crate::station::{Rounded, Roundings, Station};
use crate::vectors::{times, vector_of};
use crate::{Check, Limits, Tally, FEEDS, PASS_EXCESS};

/// A vertex is refined by two places beside it, at this part of the distance to the places that are known; at most `MOST_REFINED`
/// times.
const CLOSER: f64 = 0.5;
const MOST_REFINED: u32 = 3;

/// A parabola is trusted only where no use can be off the straight line between both ends by more than this part of the limit.
/// Otherwise the interval is halved, at most `MOST_HALVINGS` times.
pub const WIDE: f64 = 0.03;
const MOST_HALVINGS: u32 = 6;

/// Uses of the limits at a place: velocity, acceleration and jerk of each axis with their signs, then feeds and chord error. The
/// rounding of a rate is subtracted only if its use is greater than any found so far.
#[derive(Clone, Copy)]
struct Use<const M: usize> {
    rates: [[f64; M]; 3],
    tip: [f64; FEEDS + 1],
}

/// A place that has been evaluated, with its uses of the limits.
#[derive(Clone, Copy)]
pub struct Look<const M: usize> {
    pub place: Place,
    pub station: Station<M>,
    /// Rounding error bound of the speed along the path, in mm/s.
    speed_rounding: f64,
    used: Use<M>,
}

impl<const M: usize> Look<M> {
    /// Rounding error bounds of the column velocities, on this piece.
    pub fn velocity_rounding(&self, piece: usize, columns: &mut Columns<M>) -> [f64; M] {
        let of_station = columns.roundings(piece, &self.station).velocity(self.place.pace.v);
        vector_of(|k| of_station[k] + self.speed_rounding * self.station.first[k].abs())
    }
}

/// What a bound tells of all places between two.
enum Between {
    /// None of them can have a greater use of any limit than was found so far.
    Certain,
    /// None of them can have a use that is much above those of the two places.
    Narrow,
    Wide,
    Unbounded,
}

/// A phase, and the limits that hold on it.
pub struct Looker<'a, 'b, const M: usize> {
    pub columns: &'a mut Columns<'b, M>,
    pub piece: usize,
    pub motion: &'a PhaseByLength<M>,
    pub curve: &'a Curve<M>,
    pub limits: &'a Limits<M>,
    pub feeds: [f64; FEEDS],
    pub feeds_along: [bool; FEEDS],
    /// The part of its piece that the phase covers, times `Curve::turns`.
    pub covered: f64,
    pub start: f64,
    pub line: i32,
}

impl<const M: usize> Looker<'_, '_, M> {
    /// Audits the phase between the two parameters `u`; `ends` have been evaluated already.
    pub fn phase(&mut self, u: [f64; 2], ends: [Option<&Look<M>>; 2], tally: &mut Tally<M>) {
        // For positive speeds this is at most 1, but a wrong profile may have any speeds.
        let change = match ends {
            [Some(from), Some(to)] => {
                let [from, to] = [from.place.pace.v, to.place.pace.v];
                ((to - from).abs() / from.max(to)).min(1.0)
            }
            _ => 1.0,
        };
        let intervals = self.columns.intervals(self.covered, change);
        self.between(ends, u, (0, intervals), tally);
    }

    /// Evaluates places between two if the bound does not rule out a greater use there.
    fn between(
        &mut self,
        ends: [Option<&Look<M>>; 2],
        u: [f64; 2],
        (halvings, intervals): (u32, f64),
        tally: &mut Tally<M>,
    ) {
        let bound = match ends {
            [Some(from), Some(to)] => self.bound(from, to, tally),
            _ => Between::Unbounded,
        };
        let enough = f64::from(2 << halvings) >= intervals;
        let is_followed = match bound {
            Between::Certain => return,
            Between::Narrow => true,
            Between::Wide => enough && !self.motion.is_steady(),
            Between::Unbounded => enough,
        };
        let middle = 0.5 * (u[0] + u[1]);
        let here = self.look(middle, tally);
        if halvings < MOST_HALVINGS && !is_followed {
            self.between([ends[0], here.as_ref()], [u[0], middle], (halvings + 1, intervals), tally);
            self.between([here.as_ref(), ends[1]], [middle, u[1]], (halvings + 1, intervals), tally);
        }
        // Also if both halves have been audited: a peak next to the middle may be outside of either by its parabola.
        if let ([Some(from), Some(to)], Some(here)) = (ends, &here) {
            self.refine([from, here, to], 0, tally);
        }
    }

    /// Evaluates, for one use after the other, the vertex of the parabola through three equally spaced places if that may be
    /// above the greatest use so far, and places beside it where the parabola is not accurate enough.
    fn refine(&mut self, places: [&Look<M>; 3], depth: u32, tally: &mut Tally<M>) {
        for (row, check) in RATES.into_iter().enumerate() {
            if are_far_below(places.map(|look| &look.used.rates[row]), &tally.ratios(check)) {
                continue;
            }
            for k in 0..self.columns.count() {
                let (rate, worst) = (|used: &Use<M>| used.rates[row][k], tally.get(check, k).ratio);
                if let Some(peak) = peak(places.map(|look| rate(&look.used)), worst) {
                    self.climb(places, (peak, worst), depth, &rate, tally);
                }
            }
        }
        for i in 0..=FEEDS {
            let check = if i == FEEDS { Check::Chord } else { Check::Feed };
            let (rate, worst) = (|used: &Use<M>| used.tip[i], tally.get(check, 0).ratio);
            if let Some(peak) = peak(places.map(|look| rate(&look.used)), worst) {
                self.climb(places, (peak, worst), depth, &rate, tally);
            }
        }
    }

    /// Evaluates a peak of one use that may be above the `worst` so far, and places beside it.
    fn climb(
        &mut self,
        places: [&Look<M>; 3],
        (peak, worst): (Peak, f64),
        depth: u32,
        rate: &dyn Fn(&Use<M>) -> f64,
        tally: &mut Tally<M>,
    ) {
        let [first, middle, last] = places.map(|look| look.place.u);
        let half = 0.5 * (last - first);
        let centre = middle + peak.at * half;
        let Some(top) = self.look(centre, tally) else { return };
        if depth == MOST_REFINED || !peak.may_pass(rate(&top.used), worst) {
            return;
        }
        let side = CLOSER * half.min(centre - first).min(last - centre);
        let beside = [centre - side, centre + side].map(|u| self.look(u, tally));
        if let [Some(before), Some(after)] = &beside {
            self.refine([before, &top, after], depth + 1, tally);
        }
    }

    /// Evaluates the place u; None where the path has no direction.
    fn look(&mut self, u: f64, tally: &mut Tally<M>) -> Option<Look<M>> {
        let station = self.columns.station(self.piece, u)?;
        Some(self.look_at(&station, tally))
    }

    /// Evaluates an end of the phase; None where the path has no direction.
    pub fn look_at_end(&mut self, u: f64, tally: &mut Tally<M>) -> Option<Look<M>> {
        let station = self.columns.station_at_end(self.piece, u)?;
        Some(self.look_at(&station, tally))
    }

    /// Evaluates a station and offers its uses of the limits to the tally.
    pub fn look_at(&mut self, station: &Station<M>, tally: &mut Tally<M>) -> Look<M> {
        let (limits, line) = (self.limits, self.line);
        let place = self.motion.place(station.u);
        let pace = place.pace;
        let speed_rounding = self.motion.speed_rounding(pace, station.slope);
        // Computed only if a use is greater than any found so far, which is seldom.
        let time = || self.start + self.motion.since(&place);
        let mut roundings: Option<Roundings<M>> = None;
        tally.samples += 1;
        let mut used = Use { rates: [[0.0; M]; 3], tip: [0.0; FEEDS + 1] };
        let velocity = station.velocity(pace.v);
        let rates = [velocity, station.acceleration(pace), station.jerk(pace)];
        for row in 0..if limits.judges_jerk { 3 } else { 2 } {
            let (check, value, [most, per]) = (RATES[row], &rates[row], &self.columns.rates[row]);
            let (known, mut are_passed) = (tally.ratios(check), true);
            used.rates[row] = times(value, &per.of_each(value));
            for k in 0..M {
                are_passed &= used.rates[row][k].abs() <= known[k];
            }
            // Most places use less of all limits than was found before.
            if are_passed {
                continue;
            }
            let limit = most.of_each(value);
            for k in 0..M {
                if tally.is_passed(check, k, value[k].abs(), limit[k]) {
                    continue;
                }
                let of = roundings.get_or_insert_with(|| self.columns.roundings(self.piece, station));
                let rounding = match check {
                    Check::Velocity => of.velocity(pace.v)[k] + speed_rounding * station.first[k].abs(),
                    Check::Acceleration => of.acceleration(pace)[k],
                    _ => of.jerk(pace)[k],
                };
                let certain = value[k].abs() - rounding;
                let ratio = if certain <= 0.0 { 0.0 } else { certain / limit[k] };
                used.rates[row][k] = ratio.copysign(value[k]);
                tally.offer_share(check, k, (certain, limit[k], ratio), line, time);
            }
        }
        // In a wrong profile v may be negative.
        let speed = pace.v.abs();
        let tip = [speed, speed_rounding + ROUNDING * speed].map(|v| station.tip * v);
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let [speed, rounding] = match self.feeds_along[feed] {
                true => tip,
                false => {
                    let of = roundings.get_or_insert_with(|| self.columns.roundings(self.piece, station));
                    let rounding = of.velocity(pace.v);
                    let rounding = vector_of(|k| rounding[k] + speed_rounding * station.first[k].abs());
                    self.columns.speed(feed, &Rounded { value: velocity, rounding }, tip)
                }
            };
            let speed = speed - rounding;
            used.tip[feed] = speed / limit;
            tally.offer_at(Check::Feed, 0, speed, limit, line, time);
        }
        if limits.chord_tolerance.is_finite() {
            let error = chord_error((tip[0] - tip[1]) * limits.period, station.curvature);
            used.tip[FEEDS] = error / limits.chord_tolerance;
            tally.offer_at(Check::Chord, 0, error, limits.chord_tolerance, line, time);
        }
        Look { place, station: *station, speed_rounding, used }
    }

    /// What the bound tells of the places between two, compared with the greatest uses so far.
    fn bound(&self, from: &Look<M>, to: &Look<M>, tally: &Tally<M>) -> Between {
        let (limits, ends) = (self.limits, [&from.used, &to.used]);
        if !self.columns.are_axes() {
            return Between::Unbounded;
        }
        let Some(bulge) = self.motion.bulge([&from.place, &to.place], [&from.station, &to.station]) else {
            return Between::Unbounded;
        };
        let (mut is_certain, mut is_narrow) = (true, true);
        // `beyond`: by how much a use may be above those of both ends; `off`: how far off the straight line between them; in
        // parts of the limit.
        let mut weigh = |worst: f64, known: f64, beyond: f64, off: f64| {
            is_certain &= beyond <= worst + PASS_EXCESS - known;
            is_narrow &= off <= WIDE;
        };
        let worst = |check: Check| tally.get(check, 0).ratio;
        let judged = if limits.judges_jerk { 3 } else { 2 };
        let moves = self.curve.derivative_size();
        for (row, check) in RATES.into_iter().enumerate().take(judged) {
            let (worst, per_least) = (tally.ratios(check), &self.columns.per_least[row]);
            for k in 0..M {
                let [near, far] = ends.map(|used| used.rates[row][k].abs());
                let off = if moves[k] > 0.0 { bulge.rates[row] * per_least[k] } else { 0.0 };
                weigh(worst[k], near.max(far), beyond([near, far], off), off);
            }
        }
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let [near, far] = ends.map(|used| used.tip[feed]);
            let known = near.max(far);
            // The speed that a feed limits is at most that along the path.
            let [off, faster] = [bulge.rates[0] / limit, bulge.most_speed / limit - known];
            weigh(worst(Check::Feed), known, beyond([near, far], off).min(faster), off.min(faster));
        }
        if limits.chord_tolerance.is_finite() {
            let curvature = from.station.curvature.max(to.station.curvature) + bulge.curvature;
            let most = chord_error(bulge.most_speed * limits.period, curvature);
            let ([near, far], limit) = (ends.map(|used| used.tip[FEEDS]), limits.chord_tolerance);
            let known = near.max(far);
            let more = most / limit - known;
            weigh(worst(Check::Chord), known, more, more);
        }
        match () {
            () if is_certain => Between::Certain,
            () if is_narrow => Between::Narrow,
            () => Between::Wide,
        }
    }
}

/// By how much a function may be above its values at both ends, if it is off the straight line between them by at most
/// 4·`off`·x·(1 − x) at the share x of the interval. If the two values differ by 4·`off` or more, the greater one is the
/// maximum.
#[inline(always)]
fn beyond([near, far]: [f64; 2], off: f64) -> f64 {
    let steep = 4.0 * off - (far - near).abs();
    if steep <= 0.0 {
        0.0
    } else {
        steep * steep / (16.0 * off)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Followed, Pieces};
    use crate::phases::{Phases, FEED, SPEED_CUBIC};
    use crate::vectors::length;
    use crate::Sided;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// The limit is a thousandth below the greatest use at constant speed, and a hundredth below it where the jerk along the
        /// path changes its sign. The phases cover up to a fifth of a piece and change the speed by up to a tenth: most phases of
        /// plans with limited jerk have less of both.
        #[test]
        fn a_limit_a_little_below_the_greatest_use_is_broken_wherever_that_is(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 2..=9_usize,
            cut in prop::array::uniform2(0.0..1.0_f64),
            speeds in prop::array::uniform2(1.0..1.1_f64),
            flat: bool,
        ) {
            let control: Vec<f64> = (0..=degree).flat_map(|i| [i as f64, bends[i]]).collect();
            let (offsets, width) = ([0, degree + 1], [degree as f64]);
            let pieces = Pieces { axes: 2, stride: 2, control: &control, weights: &[], offsets: &offsets, width: &width };
            let path = Followed::of_one(pieces);
            let [width] = width;
            let from = 0.8 * width * cut[0];
            let u = [from, from + 0.2 * width * (0.1 + 0.9 * cut[1])];
            let (kind, speeds) = if flat { (FEED, [speeds[0]; 2]) } else { (SPEED_CUBIC, speeds) };
            let (mut limits, free) = (Limits::none(), Limits::none());
            let mut columns = Columns::new(&path, &free, None);
            let curve = columns.curve(0).clone();
            let p = [0, 1].map(|i| (speeds[i] / length(&curve.derivative(u[i]))).powi(2));
            let (kind, value) = ([kind], [speeds[0] * speeds[0]]);
            let phases = Phases::of_one(&kind, &[255], &value, &u, &p);
            let motion = phases.by_length(0, &mut columns).unwrap();
            let mut most = [[0.0_f64; 2]; 3];
            for i in 0..=2000 {
                let at = u[0] + (u[1] - u[0]) * f64::from(i) / 2000.0;
                let (Place { pace, .. }, station) = (motion.place(at), Station::new(&curve, at).unwrap());
                let rates = [station.velocity(pace.v), station.acceleration(pace), station.jerk(pace)];
                for (row, rate) in rates.iter().enumerate() {
                    for k in 0..2 {
                        most[row][k] = most[row][k].max(rate[k].abs());
                    }
                }
            }
            let below = if flat { 1.001 } else { 1.01 };
            let [velocity, acceleration, jerk] = most.map(|row| row.map(|most| most / below));
            let of = |limit: [f64; 2]| Sided { positive: limit, negative: limit };
            (limits.velocity, limits.acceleration) = (of(velocity), of(acceleration));
            (limits.jerk, limits.judges_jerk) = (jerk, true);
            let (mut tally, mut columns) = (Tally::default(), Columns::new(&path, &limits, None));
            let (feeds, covered) = ([f64::INFINITY; FEEDS], curve.turns() as f64 * (u[1] - u[0]) / width);
            let (columns, motion, curve, limits) = (&mut columns, &motion, &*curve, &limits);
            let feeds_along = [true; FEEDS];
            let mut looker =
                Looker { columns, piece: 0, motion, curve, limits, feeds, feeds_along, covered, start: 0.0, line: 1 };
            let ends = u.map(|u| looker.look(u, &mut tally));
            looker.phase(u, ends.each_ref().map(Option::as_ref), &mut tally);
            for (row, check) in [Check::Velocity, Check::Acceleration, Check::Jerk].into_iter().enumerate() {
                for k in (0..2).filter(|&k| most[row][k] > 1e-6) {
                    prop_assert!(tally.get(check, k).ratio > 1.0, "{check:?} {k}: {}", tally.get(check, k).ratio);
                }
            }
        }
    }
}
