//! Tells whether a phase can change what was found: from eight places of it at once, in the vectors of the processor.
//!
//! The places are the nodes of Lobatto's rule of eight points (Abramowitz and Stegun 25.4.32), both ends among them. |C'| there gives
//! the lengths up to all of them by the polynomial through them, v² by the length gives speed, acceleration and jerk along the path,
//! the derivatives of C those of all axes. Where no place uses more of a limit than was found before, nor a parabola between two of
//! them and the polynomial half-way, nothing needs to be looked at closer. As in `by_length`, of which these are fewer places,
//! `bulge` bounds what lies between two: where that is much above both, both halves are looked at instead. Where more of a limit is
//! used, `by_length` looks.

use fearless_simd::{dispatch, Level};

use crate::bulge::{bulge, Known};
use crate::chord::chord_error;
use crate::columns::{Columns, RATES};
use crate::curve::Curve;
use crate::speed_by_length::{is_same_speed, Pace, SpeedByLength};
use crate::{Check, Limits, Tally, FEEDS};

use super::by_length::WIDE;

/// Places of a phase.
pub const PLACES: usize = 8;

/// A number at each place.
type Lanes = [f64; PLACES];

/// Where the places are: from −1 at the start of the phase to 1 at its end; and in parts of the phase.
const NODES: Lanes = {
    let [a, b, c] = [0.209_299_217_902_478_88, 0.591_700_181_433_142_3, 0.871_740_148_509_606_6];
    [-1.0, -c, -b, -a, a, b, c, 1.0]
};
const SHARES: Lanes = {
    let (mut shares, mut i) = (NODES, 0);
    while i < PLACES {
        shares[i] = 0.5 * (1.0 + NODES[i]);
        i += 1;
    }
    shares
};

/// What the values at the places make of a function, by the polynomials that are 1 at one of some places and 0 at the others.
struct Weights {
    /// Of the integrals from the start up to each place, a row for each value. The last column is Lobatto's rule, good to degree 13.
    up_to: [Lanes; PLACES],
    /// Of the values half-way to the next place; at the last place of its own.
    between: [Lanes; PLACES],
    /// Of the integral over the first half, less half of the whole one: of what is odd about the middle.
    odd: Lanes,
    /// Of the greatest change that a value makes half-way between two places, against the polynomial through the others.
    last: Lanes,
}

const fn weights<const N: usize>(places: [usize; N]) -> Weights {
    let none = [[0.0; PLACES]; PLACES];
    let mut weights = Weights { up_to: none, between: none, odd: [0.0; PLACES], last: [0.0; PLACES] };
    let mut row = 0;
    while row < N {
        // By powers of the node.
        let (own, mut c, mut count) = (NODES[places[row]], [0.0; PLACES], 0);
        c[0] = 1.0;
        while count < N {
            let root = NODES[places[count]];
            if count != row {
                let (per, mut power) = (1.0 / (own - root), PLACES - 1);
                while power > 0 {
                    c[power] = (c[power - 1] - root * c[power]) * per;
                    power -= 1;
                }
                c[0] *= -root * per;
            }
            count += 1;
        }
        let (j, mut i) = (places[row], 0);
        while i < PLACES {
            let next = NODES[if i + 1 < PLACES { i + 1 } else { i }];
            let middle = 0.5 * (NODES[i] + next);
            weights.up_to[j][i] = 0.5 * (primitive(&c, NODES[i]) - primitive(&c, -1.0));
            let (mut change, mut factor) = (c[N - 1], 0);
            weights.between[j][i] = 1.0;
            while factor < N {
                let root = NODES[places[factor]];
                if factor != row {
                    weights.between[j][i] *= (middle - root) / (own - root);
                }
                if factor + 1 < N {
                    change *= middle - root;
                }
                factor += 1;
            }
            if i + 1 < PLACES && change.abs() > weights.last[j].abs() {
                weights.last[j] = change;
            }
            i += 1;
        }
        weights.odd[j] = 0.5 * (primitive(&c, 0.0) - 0.5 * (primitive(&c, -1.0) + primitive(&c, 1.0)));
        row += 1;
    }
    weights
}

/// Σ c_i x^(i + 1) / (i + 1).
const fn primitive(c: &Lanes, x: f64) -> f64 {
    let (mut sum, mut i) = (0.0, PLACES);
    while i > 0 {
        i -= 1;
        sum = (sum + c[i] / (i + 1) as f64) * x;
    }
    sum
}

const ALL: Weights = weights([0, 1, 2, 3, 4, 5, 6, 7]);

/// Without the middle pair, good to degree 5, and by the first and the third pair, good to degree 3.
const LOWER: Weights = weights([0, 1, 2, 5, 6, 7]);
const LOWEST: Weights = weights([0, 2, 5, 7]);

/// The lowest rule counts by this share, as the others can agree by chance, and an integral is good where none is off by more than this
/// part.
const CHANCE: f64 = 3e-3;
const RULES_AGREE: f64 = 3e-8;

/// The longest interval between two places, in parts of the phase.
const LONGEST: f64 = SHARES[4] - SHARES[3];

/// Next to rest, where v² at one end is below this part of that at the other one, the length leaves too few digits of it.
const SLOW_SQ: f64 = 1e-4;

/// Where |C'| is below this share of its size the piece has no direction to speak of.
const STILL: f64 = 1e-6;

/// A part of a phase is halved so often at most: all places of one look cost as much as some five of `by_length`.
const MOST_HALVINGS: u32 = 4;

/// A phase on which v² is a cubic polynomial of the length: u, p and the acceleration along the path at both ends; and where v² is
/// constant, its value, of which p is another record.
#[derive(Clone, Copy)]
pub struct Phase {
    pub u: [f64; 2],
    pub p: [f64; 2],
    pub a: [f64; 2],
    pub held_sq: Option<f64>,
}

/// The speed on a phase, and its length.
type Law = (SpeedByLength, f64);

/// What eight places of a part show: that it changes nothing, with its time and its length; that fewer of it may show that, with the
/// law if the length is known; or that it has to be looked at closer.
enum Found {
    Nothing([f64; 2]),
    Open(Option<Law>),
    More,
}

impl Phase {
    /// The speed where the squares of |C'| at both ends and the length are known; nothing next to rest, and where both records of
    /// a speed that is held differ by more than rounding.
    fn speed(&self, square: [f64; 2], length: f64) -> Option<SpeedByLength> {
        let recorded = [square[0] * self.p[0], square[1] * self.p[1]];
        let is_held = |sq: f64| recorded.iter().all(|recorded| is_same_speed(sq.sqrt(), recorded.sqrt()));
        let [from, to] = match self.held_sq {
            Some(sq) if !is_held(sq) => return None,
            Some(sq) => [sq; 2],
            None => recorded,
        };
        (from.min(to) > SLOW_SQ * from.max(to)).then(|| SpeedByLength::cubic([from, to], self.a, length))
    }
}

/// What holds on the piece of a phase.
pub struct Places<'a, 'b, const M: usize> {
    pub curve: &'a Curve<M>,
    pub columns: &'a Columns<'b, M>,
    pub limits: &'a Limits<M>,
    pub feeds: [f64; FEEDS],
    pub feeds_along: [bool; FEEDS],
}

impl<const M: usize> Places<'_, '_, M> {
    /// The time of a phase that cannot change the tally, by its law.
    pub fn time(&self, phase: &Phase, tally: &Tally<M>) -> Option<f64> {
        self.part(phase, (phase.u, 0.0), (None, MOST_HALVINGS), tally).map(|[time, _]| time)
    }

    /// The time and the length of a part of a phase, so far from the start of that, where it cannot change the tally.
    fn part(
        &self,
        phase: &Phase,
        (u, before): ([f64; 2], f64),
        (law, halvings): (Option<Law>, u32),
        tally: &Tally<M>,
    ) -> Option<[f64; 2]> {
        let (law, halvings) = match dispatch!(Level::new(), _simd => self.in_vectors(phase, (u, before), law, tally))
        {
            Found::Nothing(found) => return Some(found),
            Found::Open(law) => (law, halvings.checked_sub(1)?),
            Found::More => return None,
        };
        let law = match law {
            Some(law) => law,
            None => {
                let length = self.length(phase.u, MOST_HALVINGS)?;
                let [from, to] = self.curve.speeds(phase.u, &[1.0; M]);
                (phase.speed([from * from, to * to], length)?, length)
            }
        };
        let middle = 0.5 * (u[0] + u[1]);
        let [time, length] = self.part(phase, ([u[0], middle], before), (Some(law), halvings), tally)?;
        let rest = ([middle, u[1]], before + length);
        let [more_time, more_length] = self.part(phase, rest, (Some(law), halvings), tally)?;
        Some([time + more_time, length + more_length])
    }

    /// The length between two parameters.
    fn length(&self, [from, to]: [f64; 2], halvings: u32) -> Option<f64> {
        let width = to - from;
        let (length, is_good) = integral(&self.curve.speeds(each(|i| from + SHARES[i] * width), &[1.0; M]));
        if is_good {
            return Some(length * width);
        }
        let (middle, halvings) = (0.5 * (from + to), halvings.checked_sub(1)?);
        Some(self.length([from, middle], halvings)? + self.length([middle, to], halvings)?)
    }

    #[inline(always)]
    fn in_vectors(
        &self,
        phase: &Phase,
        (u, before): ([f64; 2], f64),
        law: Option<Law>,
        tally: &Tally<M>,
    ) -> Found {
        let width = u[1] - u[0];
        let [c1, c2, c3] = self.curve.derivatives_at_each(&each(|i| u[0] + SHARES[i] * width));
        let square = inner(&c1, &c1);
        let slope = each(|i| square[i].sqrt());
        let slopes = [least(&slope), greatest(&slope)];
        let (whole, is_good) = integral(&slope);
        if slopes[0] <= STILL * self.curve.size_lengths()[0] {
            return Found::More;
        }
        if !is_good {
            return Found::Open(law);
        }
        // The motion along the path.
        let mut way = [0.0; PLACES];
        for (row, slope) in ALL.up_to.iter().zip(slope) {
            for i in 0..PLACES {
                way[i] += row[i] * slope;
            }
        }
        let length = whole * width;
        let law = law.or_else(|| Some((phase.speed([square[0], square[PLACES - 1]], length)?, length)));
        let Some((speed @ SpeedByLength::Cubic { c, .. }, total)) = law else { return Found::More };
        let per_total = 1.0 / total;
        let x = each(|i| (before + way[i] * width) * per_total);
        let v = each(|i| (c[0] + x[i] * (c[1] + x[i] * (c[2] + x[i] * c[3]))).sqrt());
        let (per_slope, per_bend) = (0.5 * per_total, 0.5 * per_total * per_total);
        let a = each(|i| per_slope * (c[1] + x[i] * (2.0 * c[2] + x[i] * (3.0 * c[3]))));
        let j = each(|i| per_bend * v[i] * (2.0 * c[2] + 6.0 * c[3] * x[i]));
        let time = match integral(&each(|i| slope[i] / v[i])) {
            (time, true) => time * width,
            // The time of a speed that changes fast takes more places than anything else.
            _ => speed.time(before + length) - speed.time(before),
        };
        if !time.is_finite() {
            return Found::More;
        }
        // The derivatives by the length; see `Station`.
        let per = each(|i| 1.0 / slope[i]);
        let first: [Lanes; M] = axes(|k| each(|i| c1[k][i] * per[i]));
        let (along2, along3) = (inner(&first, &c2), inner(&first, &c3));
        let across: [Lanes; M] = axes(|k| each(|i| c2[k][i] - along2[i] * first[k][i]));
        let across_sq = inner(&across, &across);
        let turned = each(|i| across_sq[i] * per[i]);
        let bent = each(|i| 3.0 * along2[i] * per[i]);
        let (per2, per3) = (each(|i| per[i] * per[i]), each(|i| per[i] * per[i] * per[i]));
        let second: [Lanes; M] = axes(|k| each(|i| across[k][i] * per2[i]));
        let mut third = [[0.0; PLACES]; M];
        for k in 0..M {
            for i in 0..PLACES {
                let along = (along3[i] + turned[i]) * first[k][i];
                third[k][i] = (c3[k][i] - bent[i] * across[k][i] - along) * per3[i];
            }
        }
        let (second_sq, third_sq) = (inner(&second, &second), inner(&third, &third));
        let curvatures = each(|i| second_sq[i].sqrt());
        let curvature = greatest(&curvatures);
        let pace = |i: usize| Pace { v: v[i], a: a[i], j: j[i] };
        let known = Known {
            interval: LONGEST * width,
            slopes,
            second: curvature,
            third: greatest(&third_sq).sqrt(),
            paces: [&pace(0), &pace(PLACES - 1)],
            way: length,
        };
        let Some(bulge) = bulge(self.curve.bounds(), &speed, &known) else { return Found::Open(law) };
        // The rates of the axes.
        let (moves, judged) = (self.curve.derivative_size(), if self.limits.judges_jerk { 3 } else { 2 });
        let (square, mixed) = (each(|i| v[i] * v[i]), each(|i| 3.0 * v[i] * a[i]));
        let cube = each(|i| square[i] * v[i]);
        for row in (0..judged).rev() {
            let worst = tally.ratios(RATES[row]);
            let (per, per_least) = (&self.columns.rates[row][1], &self.columns.per_least[row]);
            for k in (0..M).filter(|&k| moves[k] > 0.0) {
                // No axis is faster than the tool.
                if row == 0 && bulge.most_speed * per_least[k] <= worst[k] {
                    continue;
                }
                let (q1, q2, q3) = (&first[k], &second[k], &third[k]);
                let rate = match row {
                    0 => each(|i| q1[i] * v[i]),
                    1 => each(|i| q1[i] * a[i] + q2[i] * square[i]),
                    _ => each(|i| q1[i] * j[i] + q2[i] * mixed[i] + q3[i] * cube[i]),
                };
                let off = bulge.rates[row] * per_least[k];
                match is_below(&rate, |rate| rate * per.of(k, rate), off, worst[k]) {
                    Some(true) => {}
                    Some(false) => return Found::More,
                    None => return Found::Open(law),
                }
            }
        }
        let worst = |check: Check| tally.get(check, 0).ratio;
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let (per, worst) = (1.0 / limit, worst(Check::Feed));
            // No share of the speed along the path is greater than that speed.
            if bulge.most_speed * per <= worst {
                continue;
            }
            let mut speed = v;
            if !self.feeds_along[feed] {
                let counted = axes(|k| each(|i| self.limits.feed_axes[feed][k] * first[k][i]));
                let square = inner::<M>(&counted, &counted);
                speed = each(|i| square[i].sqrt() * v[i]);
            }
            match is_below(&speed, |v| v * per, bulge.rates[0] * per, worst) {
                Some(true) => {}
                Some(false) => return Found::More,
                None => return Found::Open(law),
            }
        }
        if self.limits.chord_tolerance.is_finite() {
            let known = worst(Check::Chord) * self.limits.chord_tolerance;
            let most = |fastest: f64, curvature: f64| {
                let fastest = (fastest + bulge.rates[0]).min(bulge.most_speed);
                chord_error(fastest * self.limits.period, curvature + bulge.curvature)
            };
            // From each place to the next one neither speed nor curvature is beyond both by more than the bound of what lies between.
            let greater = |of: &Lanes, i: usize| of[i].max(of[i + 1]);
            let is_low = |i: usize| most(greater(&v, i), greater(&curvatures, i)) <= known;
            let is_all_low = most(bulge.most_speed, curvature) <= known;
            if !is_all_low && !(0..PLACES - 1).all(is_low) {
                return Found::Open(law);
            }
        }
        Found::Nothing([time, length])
    }
}

/// Whether the uses of a limit at the places are no more than the `worst`, and those between, which are off the straight line from
/// place to place by no more than `off`: by that bound, or by a parabola through two places and the polynomial half-way between
/// those; see `peak`. None where only that of the places is known.
#[inline(always)]
fn is_below(rate: &Lanes, use_of: impl Fn(f64) -> f64, off: f64, worst: f64) -> Option<bool> {
    let used = each(|i| use_of(rate[i]));
    let (mut are_certain, mut are_below) = (true, true);
    for i in 0..PLACES {
        are_certain &= used[i].abs() + off <= worst;
        are_below &= used[i].abs() <= worst;
    }
    let is_narrow = off <= WIDE;
    if are_certain || !are_below || !is_narrow {
        return if are_below && !are_certain { None } else { Some(are_below) };
    }
    let (mut middle, mut last) = ([0.0; PLACES], 0.0);
    for j in 0..PLACES {
        last += ALL.last[j] * rate[j];
        for i in 0..PLACES {
            middle[i] += ALL.between[j][i] * rate[j];
        }
    }
    let (between, doubt) = (each(|i| use_of(middle[i])), use_of(last).abs());
    let next = each(|i| used[(i + 1).min(PLACES - 1)]);
    let bend = each(|i| 2.0 * between[i] - used[i] - next[i]);
    let mut are_far_below = true;
    for i in 0..PLACES {
        are_far_below &= between[i].abs() + 1.5 * bend[i].abs() + doubt <= worst;
    }
    if are_far_below {
        return Some(true);
    }
    let (most, per_worst) = (worst - doubt, 1.0 / worst);
    for i in 0..PLACES {
        let slope = next[i] - used[i];
        let top = (between[i] + slope * slope / (8.0 * bend[i])).abs() + bend[i] * bend[i] * per_worst;
        are_below &= (top <= most) | (slope.abs() >= 2.0 * bend[i].abs());
    }
    are_below.then_some(true)
}

/// The integral over the phase, its width being 1, and whether the rules agree.
#[inline(always)]
fn integral(f: &Lanes) -> (f64, bool) {
    let by = |weights: Lanes| joined(each(|i| weights[i] * f[i]), |a, b| a + b);
    let rule = |of: &Weights| each(|i| of.up_to[i][PLACES - 1]);
    let whole = by(rule(&ALL));
    let [lower, lowest] = [&LOWER, &LOWEST].map(|of| (by(rule(of)) - whole).abs());
    let (odd, most) = (by(each(|i| ALL.odd[i] - LOWER.odd[i])).abs(), RULES_AGREE * whole);
    (whole, lower <= most && odd <= most && CHANCE * lowest <= most)
}

#[inline(always)]
fn each(number: impl Fn(usize) -> f64) -> Lanes {
    let mut lanes = [0.0; PLACES];
    for i in 0..PLACES {
        lanes[i] = number(i);
    }
    lanes
}

#[inline(always)]
fn axes<const M: usize>(lanes: impl Fn(usize) -> Lanes) -> [Lanes; M] {
    let mut of_axes = [[0.0; PLACES]; M];
    for k in 0..M {
        of_axes[k] = lanes(k);
    }
    of_axes
}

#[inline(always)]
fn inner<const M: usize>(a: &[Lanes; M], b: &[Lanes; M]) -> Lanes {
    let mut sum = [0.0; PLACES];
    for k in 0..M {
        for i in 0..PLACES {
            sum[i] += a[k][i] * b[k][i];
        }
    }
    sum
}

#[inline(always)]
fn least(lanes: &Lanes) -> f64 {
    joined(*lanes, |a, b| if b < a { b } else { a })
}

#[inline(always)]
fn greatest(lanes: &Lanes) -> f64 {
    joined(*lanes, |a, b| if b > a { b } else { a })
}

/// All numbers as one, by halves: in their order each would wait for the one before.
#[inline(always)]
fn joined(mut lanes: Lanes, join: impl Fn(f64, f64) -> f64) -> f64 {
    let mut count = PLACES;
    while count > 1 {
        count /= 2;
        for i in 0..count {
            lanes[i] = join(lanes[i], lanes[i + count]);
        }
    }
    lanes[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Followed, Pieces};
    use crate::phases::{Phases, SPEED_CUBIC};
    use crate::station::Station;
    use crate::vectors::length;
    use crate::Sided;
    use proptest::prelude::*;

    fn sum(weights: &Lanes, degree: i32) -> f64 {
        (0..PLACES).map(|i| weights[i] * SHARES[i].powi(degree)).sum()
    }

    #[test]
    fn the_polynomial_through_all_places_is_exact_to_degree_seven_and_each_rule_to_its_own() {
        let near = |found: f64, exact: f64| (found - exact).abs() < 1e-14;
        for degree in 0..=13 {
            let exact = |x: f64| x.powi(degree + 1) / f64::from(degree + 1);
            let column = |rows: &[Lanes; PLACES], i: usize| sum(&each(|j| rows[j][i]), degree);
            let whole = |of: &Weights| column(&of.up_to, PLACES - 1);
            assert!(near(whole(&ALL), exact(1.0)), "{degree}");
            assert!(degree > 5 || near(whole(&LOWER), exact(1.0)), "{degree}");
            assert!(degree > 3 || near(whole(&LOWEST), exact(1.0)), "{degree}");
            assert!(degree > 5 || near(sum(&LOWER.odd, degree), exact(0.5) - 0.5 * exact(1.0)), "{degree}");
            assert!(degree > 7 || near(sum(&ALL.odd, degree), exact(0.5) - 0.5 * exact(1.0)), "{degree}");
            assert_eq!(degree <= 6, near(sum(&ALL.last, degree), 0.0), "{degree}");
            for i in (0..PLACES).filter(|_| degree <= 7) {
                let (next, own) = (SHARES[(i + 1).min(PLACES - 1)], SHARES[i]);
                assert!(near(column(&ALL.up_to, i), exact(own)), "{degree} {i}");
                assert!(near(column(&ALL.between, i), (0.5 * (own + next)).powi(degree)), "{degree} {i}");
            }
        }
    }

    /// The answer where `worst` of each rate, of the feed and of the chord error have been found before, in parts of what the phase
    /// uses; the time by the law; and what it uses of each rate.
    fn look(
        control: &[f64],
        [u, speeds, a]: [[f64; 2]; 3],
        worst: &dyn Fn(Check, usize) -> f64,
    ) -> (Option<f64>, f64, [[f64; 2]; 3]) {
        let degree = control.len() / 2 - 1;
        let (offsets, width) = ([0, degree + 1], [degree as f64]);
        let pieces = Pieces { axes: 2, stride: 2, control, weights: &[], offsets: &offsets, width: &width };
        let (path, free) = (Followed::of_one(pieces), Limits::none());
        let mut columns = Columns::new(&path, &free, None);
        let curve = columns.curve(0).clone();
        let p = [0, 1].map(|i| (speeds[i] / length(&curve.derivative(u[i]))).powi(2));
        let phases =
            Phases { a0: &a[..1], a1: &a[1..], ..Phases::of_one(&[SPEED_CUBIC], &[255], &[0.0], &u, &p) };
        let motion = phases.by_length(0, &mut columns).unwrap();
        let (mut most, mut fastest, mut farthest) = ([[0.0_f64; 2]; 3], 0.0_f64, 0.0_f64);
        for i in 0..=2000 {
            let at = u[0] + (u[1] - u[0]) * f64::from(i) / 2000.0;
            let (pace, station) = (motion.place(at).pace, Station::new(&curve, at).unwrap());
            let rates = [station.velocity(pace.v), station.acceleration(pace), station.jerk(pace)];
            fastest = fastest.max(pace.v);
            farthest = farthest.max(chord_error(pace.v * free.period, station.curvature));
            for (row, rate) in rates.iter().enumerate() {
                for k in 0..2 {
                    most[row][k] = most[row][k].max(rate[k].abs());
                }
            }
        }
        // One limit for both axes; the worst of each axis is what it uses of that, but for the part that is asked for.
        let limit = most.map(|row| [row[0].max(row[1]); 2]);
        let of = |limit: [f64; 2]| Sided { positive: limit, negative: limit };
        let mut limits = Limits { judges_jerk: true, jerk: limit[2], chord_tolerance: farthest, ..free };
        (limits.velocity, limits.acceleration) = (of(limit[0]), of(limit[1]));
        let mut tally = Tally::default();
        for (row, check) in RATES.into_iter().enumerate() {
            for k in 0..2 {
                tally.offer(check, k, worst(check, k) * most[row][k], limit[row][k], 0.0, 1);
            }
        }
        tally.offer(Check::Feed, 0, worst(Check::Feed, 0), 1.0, 0.0, 1);
        tally.offer(Check::Chord, 0, worst(Check::Chord, 0) * farthest, farthest, 0.0, 1);
        let (feeds, feeds_along) = ([fastest, f64::INFINITY, f64::INFINITY, f64::INFINITY], [true; FEEDS]);
        let columns = Columns::new(&path, &limits, None);
        let places = Places { curve: &curve, columns: &columns, limits: &limits, feeds, feeds_along };
        (places.time(&Phase { u, p, a, held_sq: None }, &tally), motion.time(), most)
    }

    #[test]
    fn a_gentle_phase_that_uses_no_more_than_was_found_has_its_time() {
        let control = [0.0, 0.0, 1.0, 0.1, 2.0, 0.1, 3.0, 0.0];
        // Speed and curvature are greatest at different ends of it.
        let worst = |check, _| if check == Check::Chord { 1.0 + 1e-3 } else { 1.0 + 1e-6 };
        let (found, time, _) = look(&control, [[0.5, 0.55], [1.0, 1.0012], [0.02, 0.028]], &worst);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_phase_whose_speed_changes_fast_has_its_time() {
        let control = [0.0, 0.0, 1.0, 0.1, 2.0, 0.1, 3.0, 0.0];
        let (found, time, _) = look(&control, [[0.5, 0.6], [0.3, 1.0], [4.5, 4.5]], &|_, _| 10.0);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_phase_that_eight_places_leave_open_is_looked_at_by_halves() {
        let control = [0.0, 0.0, 1.0, 1.0, 2.0, -1.0, 3.0, 0.0];
        let (found, time, _) = look(&control, [[0.1, 2.9], [1.0, 1.2], [0.1, 0.05]], &|_, _| 3.0);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-8);
        for broken in [Check::Velocity, Check::Acceleration, Check::Jerk, Check::Feed, Check::Chord] {
            let worst = |check, _| if check == broken { 0.999 } else { 3.0 };
            assert_eq!(look(&control, [[0.1, 2.9], [1.0, 1.2], [0.1, 0.05]], &worst).0, None, "{broken:?}");
        }
    }

    #[test]
    fn a_speed_that_is_held_has_both_records_of_it() {
        let phase = |p: f64| Phase { u: [0.0, 1.0], p: [4.0, p], a: [0.0; 2], held_sq: Some(16.0) };
        assert!(phase(1.0).speed([4.0, 16.0], 3.0).is_some());
        assert!(phase(1.0 + 1e-13).speed([4.0, 16.0], 3.0).is_none());
    }

    #[test]
    fn a_phase_that_is_fastest_where_it_is_bent_least_has_its_time() {
        let control = [0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.3];
        let worst = |check, _| if check == Check::Chord { 1.2 } else { 10.0 };
        // From 1.4 mm/s to 1 mm/s, where the curvature is 1.4 times as great.
        let (found, time, _) = look(&control, [[1.0, 1.4], [1.4, 1.0], [-1.2, -1.2]], &worst);
        assert!((found.unwrap() / time - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_phase_from_rest_or_of_rubbish_is_looked_at_closer() {
        let control = [0.0, 0.0, 1.0, 0.1, 2.0, 0.1, 3.0, 0.0];
        for speeds in [[0.0, 1.0], [1.0, 1e-3], [f64::NAN, 1.0]] {
            assert_eq!(look(&control, [[0.5, 0.8], speeds, [0.1, 0.05]], &|_, _| 10.0).0, None);
        }
        assert_eq!(look(&control, [[0.5, 0.8], [1.0; 2], [f64::NAN, 0.0]], &|_, _| 10.0).0, None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn a_phase_that_uses_more_than_was_found_is_looked_at_closer_wherever_that_is(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 2..=9_usize,
            cut in 0.0..0.8_f64,
            part in -3.0..-0.7_f64,
            speed in 0.9..1.1_f64,
            a in prop::array::uniform2(-0.1..0.1_f64),
        ) {
            let control: Vec<f64> = (0..=degree).flat_map(|i| [i as f64, bends[i]]).collect();
            let (degree, part) = (degree as f64, 10.0_f64.powf(part));
            let (u, gained) = ([degree * cut, degree * (cut + part)], 0.5 * (a[0] + a[1]) * degree * part);
            let speeds = [speed, speed + gained / speed];
            let (found, time, most) = look(&control, [u, speeds, a], &|_, _| 1.001);
            prop_assert!(found.is_none_or(|found| (found / time - 1.0).abs() < 1e-9), "{found:?} {time}");
            let rates = RATES.into_iter().enumerate().flat_map(|(row, check)| [(row, check, 0), (row, check, 1)]);
            let rates = rates.filter(|&(row, _, k)| most[row][k] > 1e-6).map(|(_, check, k)| (check, k));
            for broken in rates.chain([(Check::Feed, 0), (Check::Chord, 0)]) {
                let worst = |check, k| if (check, k) == broken { 0.9999 } else { 1.001 };
                prop_assert_eq!(look(&control, [u, speeds, a], &worst).0, None, "{:?}", broken);
            }
        }
    }
}
