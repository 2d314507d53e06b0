//! Audits one phase whose speed is known by the length of the path, at as many places as its motion needs.
//!
//! Velocity, acceleration and jerk of every axis are taken at both ends. `PhaseByLength::change_at_most` bounds how much each of
//! them can differ between two places:
//! * where all that it leaves possible is below what was found elsewhere, nothing else is measured;
//! * where the bound is wide the interval is halved;
//! * elsewhere a parabola through three places tells where a rate is greatest, and it is measured there.

use crate::chord::chord_error;
use crate::peak::peaks;
use crate::phase_by_length::{PhaseByLength, Place, Rates};
use crate::vectors::length;
use crate::{Check, Limits, Tally, FEEDS, PASS_EXCESS};

/// The next places are this part of the distance beside a vertex, and are taken so often at most.
const CLOSER: f64 = 0.5;
const MOST_REFINED: u32 = 3;

/// A parabola follows the rates on so many intervals of a phase that covers its whole piece, for each degree, and of one from
/// rest; and at least where the bound is wide.
const PLACES: f64 = 5.0;
const SPEEDS: f64 = 10.0;
const LEAST: f64 = 4.0;

/// Bounds wider than this share of a limit are not trusted to a parabola; an interval is halved so often at most.
const WIDE: f64 = 0.1;
const MOST_HALVINGS: u32 = 6;

/// Shares of the limits that a place uses: velocity, acceleration and jerk of each axis with their signs, then feeds and chord
/// error.
#[derive(Clone, Copy)]
struct Use<const M: usize> {
    rates: [[f64; M]; 3],
    tip: [f64; FEEDS + 1],
}

impl<const M: usize> Use<M> {
    fn all(&self) -> impl Iterator<Item = f64> + '_ {
        self.rates.iter().flatten().chain(&self.tip).copied()
    }
}

/// What a place shows.
#[derive(Clone, Copy)]
pub struct Look<const M: usize> {
    pub place: Place,
    pub rates: Rates<M>,
    used: Use<M>,
}

/// What a bound says of all places between two.
struct Between {
    /// Whether none of them can use more of a limit than is known.
    is_certain: bool,
    /// Whether all of them use about as much as the two.
    is_narrow: bool,
    is_unbounded: bool,
}

/// Where and when a phase is, and the limits that hold there.
pub struct Looker<'a, const M: usize> {
    pub motion: &'a PhaseByLength<M>,
    pub limits: &'a Limits<M>,
    pub feeds: [f64; FEEDS],
    /// The part of its piece that the phase covers, in degrees of it.
    pub covered: f64,
    pub start: f64,
    pub line: i32,
}

impl<const M: usize> Looker<'_, M> {
    /// Looks at a phase between two parameters; what both ends show, where the piece has a direction.
    pub fn phase(&self, [u0, u1]: [f64; 2], tally: &mut Tally<M>) -> [Option<Look<M>>; 2] {
        let ends = [u0, u1].map(|u| self.look(u, tally));
        // At most 1, as speeds are positive; a profile of rubbish has any numbers.
        let change = match &ends {
            [Some(from), Some(to)] => {
                let [from, to] = [from.place.pace.v, to.place.pace.v];
                ((to - from).abs() / from.max(to)).min(1.0)
            }
            _ => 1.0,
        };
        let intervals = PLACES * self.covered + SPEEDS * change;
        self.between(ends.each_ref().map(Option::as_ref), [u0, u1], (0, intervals), tally);
        ends
    }

    /// Looks between two places where a bound leaves open what lies there.
    fn between(
        &self,
        ends: [Option<&Look<M>>; 2],
        u: [f64; 2],
        (halvings, intervals): (u32, f64),
        tally: &mut Tally<M>,
    ) {
        let bound = match ends {
            [Some(from), Some(to)] => self.bound(from, to, tally),
            _ => Between { is_certain: false, is_narrow: false, is_unbounded: true },
        };
        if bound.is_certain {
            return;
        }
        let middle = 0.5 * (u[0] + u[1]);
        let here = self.look(middle, tally);
        let least = if bound.is_narrow { 0.0 } else { LEAST };
        let enough = f64::from(2 << halvings) >= intervals.max(least);
        let is_followed = bound.is_narrow || bound.is_unbounded || !self.motion.is_steady();
        if halvings == MOST_HALVINGS || enough && is_followed {
            if let ([Some(from), Some(to)], Some(here)) = (ends, &here) {
                self.refine([from, here, to], 0, tally);
            }
            return;
        }
        self.between([ends[0], here.as_ref()], [u[0], middle], (halvings + 1, intervals), tally);
        self.between([here.as_ref(), ends[1]], [middle, u[1]], (halvings + 1, intervals), tally);
    }

    /// Looks where parabolas through three even places say that a rate is greater than any so far, and beside it: one rate
    /// after the other.
    fn refine(&self, places: [&Look<M>; 3], depth: u32, tally: &mut Tally<M>) {
        let [first, middle, last] = places.map(|look| look.place.u);
        for x in peaks(places.map(|look| look.used.all()), worst(tally)) {
            let half = 0.5 * (last - first);
            let centre = middle + x * half;
            let side = CLOSER * half.min(centre - first).min(last - centre);
            let around = [centre - side, centre, centre + side].map(|u| self.look(u, tally));
            if let ([Some(a), Some(b), Some(c)], true) = (around, depth < MOST_REFINED) {
                self.refine([&a, &b, &c], depth + 1, tally);
            }
        }
    }

    /// Offers what a place shows.
    fn look(&self, u: f64, tally: &mut Tally<M>) -> Option<Look<M>> {
        let (limits, line) = (self.limits, self.line);
        let place = self.motion.place(u);
        let rates = self.motion.rates(&place)?;
        // Asked for where a limit is used more than before, which is seldom.
        let time = || self.start + self.motion.since(&place);
        tally.samples += 1;
        let mut used = Use { rates: [[0.0; M]; 3], tip: [0.0; FEEDS + 1] };
        let judged = if limits.judges_jerk { 3 } else { 2 };
        for k in 0..M {
            let of = [
                (Check::Velocity, &rates.velocity, limits.velocity.of(k, rates.velocity.value[k])),
                (
                    Check::Acceleration,
                    &rates.acceleration,
                    limits.acceleration.of(k, rates.acceleration.value[k]),
                ),
                (Check::Jerk, &rates.jerk, limits.jerk[k]),
            ];
            for (row, (check, rate, limit)) in of.into_iter().enumerate().take(judged) {
                let value = rate.value[k].abs() - rate.rounding[k];
                used.rates[row][k] = value.max(0.0).copysign(rate.value[k]) / limit;
                tally.offer_at(check, k, value, limit, line, time);
            }
        }
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let speed = length(&limits.counted(feed, &rates.velocity.value))
                - length(&limits.counted(feed, &rates.velocity.rounding));
            used.tip[feed] = speed / limit;
            tally.offer_at(Check::Feed, 0, speed, limit, line, time);
        }
        if limits.chord_tolerance.is_finite() {
            let speed = length(&rates.velocity.value) - length(&rates.velocity.rounding);
            let error = chord_error(speed * limits.period, rates.curvature);
            used.tip[FEEDS] = error / limits.chord_tolerance;
            tally.offer_at(Check::Chord, 0, error, limits.chord_tolerance, line, time);
        }
        Some(Look { place, rates, used })
    }

    /// What the bound between two places says beside what has been found so far.
    fn bound(&self, from: &Look<M>, to: &Look<M>, tally: &Tally<M>) -> Between {
        let limits = self.limits;
        let change = self.motion.change_at_most([&from.place, &to.place], [&from.rates, &to.rates]);
        let (mut is_certain, mut widest) = (true, 0.0_f64);
        let mut weigh = |check: Check, axis: usize, most: f64, change: f64| {
            is_certain &= most <= tally.get(check, axis).ratio + PASS_EXCESS;
            widest = widest.max(change);
        };
        let checks = [
            (Check::Velocity, change.velocity),
            (Check::Acceleration, change.acceleration),
            (Check::Jerk, change.jerk),
        ];
        let judged = if limits.judges_jerk { 3 } else { 2 };
        for k in (0..limits.axes).filter(|&k| self.motion.moves(k)) {
            let least = [limits.velocity.least(k), limits.acceleration.least(k), limits.jerk[k]];
            for (row, (check, change)) in checks.into_iter().enumerate().take(judged) {
                let change = change / least[row];
                let most = from.used.rates[row][k].abs().max(to.used.rates[row][k].abs());
                weigh(check, k, most + change, change);
            }
        }
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let known = from.used.tip[feed].max(to.used.tip[feed]);
            // No share of the speed along the path is greater than that speed.
            let most = (known + change.velocity / limit).min(change.most_speed / limit);
            weigh(Check::Feed, 0, most, most - known);
        }
        if limits.chord_tolerance.is_finite() {
            let curved = from.rates.curvature.max(to.rates.curvature) + change.curvature;
            let most = chord_error(change.most_speed * limits.period, curved) / limits.chord_tolerance;
            weigh(Check::Chord, 0, most, most - from.used.tip[FEEDS].max(to.used.tip[FEEDS]));
        }
        let is_unbounded = change.velocity == f64::INFINITY;
        Between { is_certain: is_certain && !is_unbounded, is_narrow: widest <= WIDE, is_unbounded }
    }
}
/// The worst shares so far, in the order of `Use::all`; all feeds are one check.
fn worst<const M: usize>(tally: &Tally<M>) -> impl Iterator<Item = f64> + '_ {
    let of_axes = [Check::Velocity, Check::Acceleration, Check::Jerk].into_iter();
    let of_tip = std::iter::repeat_n(Check::Feed, FEEDS).chain([Check::Chord]);
    of_axes
        .flat_map(|check| (0..M).map(move |k| (check, k)))
        .chain(of_tip.map(|check| (check, 0)))
        .map(|(check, k)| tally.get(check, k).ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Curve;
    use crate::phases::Phases;
    use crate::polygon::Polygon;
    use crate::Sided;
    use proptest::prelude::*;
    use std::sync::Arc;

    /// A phase on part of a curve, with the speeds and the accelerations along the path at its ends.
    fn phase(
        curve: &Arc<Curve<2>>,
        kind: u8,
        [u0, u1]: [f64; 2],
        speeds: [f64; 2],
        pulls: [f64; 2],
    ) -> PhaseByLength<2> {
        let p: Vec<f64> =
            (0..2).map(|i| (speeds[i] / length(&curve.derivative([u0, u1][i]))).powi(2)).collect();
        Phases {
            piece: &[0],
            kind: &[kind],
            axis: &[255],
            value: &[speeds[0] * speeds[0]],
            u0: &[u0],
            u1: &[u1],
            p0: &p[..1],
            p1: &p[1..],
            duration: &[1.0],
            a0: &pulls[..1],
            a1: &pulls[1..],
            share: &[],
            pieces: 1,
            runs: &[0, 1],
        }
        .by_length(0, curve, &[1.0; 2])
        .unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// A thousandth at constant speed, a hundredth where the jerk along the path swings from one sign to the other. On up to a
        /// fifth of a piece, at speeds up to a tenth apart: most phases of limited jerk have less of both.
        #[test]
        fn a_limit_a_little_below_the_greatest_use_is_broken_wherever_that_is(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 2..=9_usize,
            cut in prop::array::uniform2(0.0..1.0_f64),
            speeds in prop::array::uniform2(1.0..1.1_f64),
            flat: bool,
        ) {
            let points: Vec<[f64; 2]> = (0..=degree).map(|i| [i as f64, bends[i]]).collect();
            let curve = Arc::new(Curve::general(Polygon::new(points.into_iter(), &[]), degree as f64));
            let width = curve.width();
            let from = 0.8 * width * cut[0];
            let u = [from, from + 0.2 * width * (0.1 + 0.9 * cut[1])];
            let (kind, speeds) = if flat { (crate::phases::FEED, [speeds[0]; 2]) } else { (crate::phases::SPEED_CUBIC, speeds) };
            let motion = phase(&curve, kind, u, speeds, [0.0; 2]);
            let mut most = [[0.0_f64; 2]; 3];
            for i in 0..=2000 {
                let at = u[0] + (u[1] - u[0]) * f64::from(i) / 2000.0;
                let rates = motion.rates(&motion.place(at)).unwrap();
                for (row, rate) in [rates.velocity, rates.acceleration, rates.jerk].iter().enumerate() {
                    for k in 0..2 {
                        most[row][k] = most[row][k].max(rate.value[k].abs());
                    }
                }
            }
            let below = if flat { 1.001 } else { 1.01 };
            let [velocity, acceleration, jerk] = most.map(|row| row.map(|most| most / below));
            let of = |limit: [f64; 2]| Sided { positive: limit, negative: limit };
            let limits = Limits {
                axes: 2,
                velocity: of(velocity),
                acceleration: of(acceleration),
                jerk,
                judges_jerk: true,
                jump: [0.0; 2],
                jump_beyond: [0.0; 2],
                travel: [[f64::NEG_INFINITY, f64::INFINITY]; 2],
                feed_axes: [[1.0; 2]; FEEDS],
                chord_tolerance: f64::INFINITY,
                period: 1e-3,
                end_speeds: [0.0; 2],
            };
            let mut tally = Tally::default();
            let (feeds, covered) = ([f64::INFINITY; FEEDS], curve.turns() as f64 * (u[1] - u[0]) / width);
            let looker = Looker { motion: &motion, limits: &limits, feeds, covered, start: 0.0, line: 1 };
            looker.phase(u, &mut tally);
            for (row, check) in [Check::Velocity, Check::Acceleration, Check::Jerk].into_iter().enumerate() {
                for k in (0..2).filter(|&k| most[row][k] > 1e-6) {
                    prop_assert!(tally.get(check, k).ratio > 1.0, "{check:?} {k}: {}", tally.get(check, k).ratio);
                }
            }
        }
    }
}
