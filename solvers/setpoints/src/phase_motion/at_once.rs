//! Computes the motion at up to eight times on phases of one piece at once in SIMD vectors.
//!
//! It is the motion of `PhaseMotion` up to rounding, where v² is a cubic polynomial of a length, of the axes or of the tool tip,
//! on a piece without weights. The slower cases are left to `PhaseMotion`: next to rest; phases that need several series or are
//! longer than a panel of the table of lengths; and places not found within `MOST_STEPS` Newton steps. So the result at one time
//! does not depend on the others.

use fearless_simd::{dispatch, f64x8, Level, Select, Simd, SimdBase, SimdFloat, SimdMask};

use super::clock::cubic::{LAST_STEP, OVER, PER_TERM};
use super::lengths::{PiecePath, PolynomialLengths, Square, ERROR, SLOW};
use super::rate::MAX_TIP;
use super::{Rates, JERK_STEP_ERROR};
use feedplan_geometry::arc_length::{W, X};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::spline::{Piece, MAX_DEGREE};
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;

/// Number of times evaluated at once.
pub const TIMES: usize = 8;

/// One number for each of these times.
type Lanes = [f64; TIMES];

/// Numbers per time: seven of its phase, and the time since the start of the phase.
const NUMBERS: usize = 8;

/// Terms of a series of the length in time.
const TERMS: usize = 14;

/// Limit of the Newton steps to a place.
const MOST_STEPS: u32 = 3;

/// Evaluates an expression with the number of control points as a constant if it is 6, that of most pieces, so that loops are
/// unrolled.
macro_rules! with_count {
    ($count:expr, $n:ident, $call:expr) => {
        match $count {
            6 => {
                let $n = 6_usize;
                $call
            }
            $n => $call,
        }
    };
}

/// The motion at some times; u is NaN where the motion is left to `PhaseMotion`.
pub struct Moments<const M: usize> {
    u: Lanes,
    /// Error bound of the place, as a share of the length of the phase.
    error: Lanes,
    iterations: Lanes,
    /// q and its derivatives by time.
    rates: [[Lanes; M]; 4],
}

/// The motion at one time: the place with its error bound, and the number of iterations.
pub struct Moment<const M: usize> {
    pub u: f64,
    pub error: f64,
    pub iterations: u32,
    pub position: [f64; M],
    pub rates: Rates<M>,
}

impl<const M: usize> Moments<M> {
    /// The motion at one to eight times, each since the start of its phase, all on this piece. Tolerances are shares of the step
    /// in one `period`. None if all times are left to `PhaseMotion`.
    pub fn new(path: &PiecePath<M>, times: &[(Phase, f64)], period: f64) -> Option<Self> {
        let lengths = path.polynomial_lengths(PhaseLaw::SpeedCubic)?;
        let mut numbers = [[f64::NAN; TIMES]; NUMBERS];
        let mut is_any = false;
        for (lane, (phase, t)) in times.iter().enumerate() {
            let Phase { u0, u1, p0, p1, a0, a1, duration, .. } = *phase;
            let is_inside = *t > 0.0 && *t < duration;
            if phase.law == PhaseLaw::SpeedCubic && is_inside && lengths.is_rule_good(u0, u1) {
                is_any = true;
                for (row, number) in numbers.iter_mut().zip([u0, u1, p0, p1, a0, a1, duration, *t]) {
                    row[lane] = number;
                }
            }
        }
        is_any
            .then(|| dispatch!(Level::new(), simd => look(simd, (path.piece(), &lengths), &numbers, period)))
    }

    /// The motion at a time; None where it is left to `PhaseMotion`.
    pub fn get(&self, lane: usize) -> Option<Moment<M>> {
        let u = self.u[lane];
        let [position, velocity, acceleration, jerk] =
            self.rates.each_ref().map(|row| std::array::from_fn(|k| row[k][lane]));
        (!u.is_nan()).then_some(Moment {
            u,
            error: self.error[lane],
            iterations: self.iterations[lane] as u32,
            position,
            rates: Rates { velocity, acceleration, jerk },
        })
    }
}

#[inline(always)]
fn look<const M: usize, S: Simd>(
    simd: S,
    (piece, lengths): (&Piece<M>, &PolynomialLengths<M>),
    numbers: &[Lanes; NUMBERS],
    period: f64,
) -> Moments<M> {
    let (nothing, one) = (f64x8::splat(simd, 0.0), f64x8::splat(simd, 1.0));
    let mut of = [nothing; NUMBERS];
    for row in 0..NUMBERS {
        of[row] = f64x8::from_slice(simd, &numbers[row]);
    }
    let [u0, u1, p0, p1, a0, a1, duration, t] = of;
    // The length of the phase, and v² as a cubic of it, as in `Cubic`.
    let ([slope0, slope1], width) = ([speed(lengths, u0), speed(lengths, u1)], u1 - u0);
    let length = way(lengths, u0, u1);
    let [square0, square1] = [slope0 * slope0, slope1 * slope1];
    let middle = length / width;
    let slow = middle * middle * SLOW;
    let is_moving = square0.simd_gt(slow) & square1.simd_gt(slow);
    let (v0, v1) = ((square0 * p0).sqrt(), (square1 * p1).sqrt());
    let is_forward = v0.simd_le(v1);
    let forth = cubic([v0, v1], [a0, a1], length);
    let back = cubic([v1, v0], [a1 * -1.0, a0 * -1.0], length);
    let mut own = forth;
    for i in 0..4 {
        own[i] = is_forward.select(forth[i], back[i]);
    }
    let Series { terms, error: series_error } = series(&own, duration / length);
    let [end, end_slope] = values(&terms, one);
    let total = one - (end - 1.0) / end_slope;
    let is_one_series = series_error.simd_le(one * ERROR)
        & end_slope.simd_gt(nothing)
        & end.simd_le(one * (1.0 + OVER))
        & end.simd_ge(one * (1.0 - OVER))
        & (total - 1.0).abs().simd_le(one * LAST_STEP);
    // The share of the length at the time, and the motion along the path there.
    let (done, left) = (t / duration, (duration - t) / duration);
    let [share, _] = values(&terms, total * is_forward.select(done, left));
    let share = share.max(nothing).min(one);
    let x = is_forward.select(share, one - share);
    let [c0, c1, c2, c3] = forth;
    let v = (c0 + x * (c1 + x * (c2 + x * c3))).sqrt();
    let a = (c1 + x * (c2 * 2.0 + x * 3.0 * c3)) * 0.5 / length;
    let j = v * 0.5 * (c2 * 2.0 + x * 6.0 * c3) / (length * length);
    // The place at that length: by the formula of `inverse_length::predict` first, then by Newton's method.
    let sought = length * x;
    let mixed = x * (one - x);
    let all = slope0 * slope1 * width;
    let below = all + ((slope0 + slope1) * length - all * 3.0) * mixed;
    let mut u = u0 + width * (slope1 * length * mixed + all * x * x * x) / below;
    let tolerance = (length * (one * period / duration) * JERK_STEP_ERROR).max(one * lengths.rounding);
    let (mut is_found, mut miss, mut iterations) = (t.simd_ne(t), nothing, nothing);
    for _ in 0..MOST_STEPS {
        if is_found.to_bitmask() == (1 << TIMES) - 1 {
            break;
        }
        iterations += is_found.select(nothing, one);
        let step = (sought - way(lengths, u0, u)) / speed(lengths, u);
        let after = step * step * (0.5 * lengths.steepest);
        let next = u + step;
        u = is_found.select(u, next);
        miss = is_found.select(miss, after);
        is_found |= after.simd_le(tolerance) & next.simd_ge(u0) & next.simd_le(u1);
    }
    // Velocity, acceleration and jerk of the axes, as in `PhaseMotion::sample`.
    let q = with_count!(piece.control.len(), n, derivatives(piece, n, u));
    let [square, slope, bend] = match lengths.square {
        Square::Axes(_) => {
            let bend = (inner(&q[2], &q[2]) + inner(&q[1], &q[3])) * 2.0;
            [inner(&q[1], &q[1]), inner(&q[1], &q[2]) * 2.0, bend]
        }
        Square::Tip(tip) => {
            let ([square, slope, bend], t) = (&*tip.derivatives, u * lengths.per_width);
            [value(square, t).max(nothing), value(slope, t), value(bend, t)]
        }
    };
    let g = square.sqrt();
    let dg = slope * 0.5 / g;
    let ddg = (bend * 0.5 - dg * dg) / g;
    let du = v / g;
    let p = du * du;
    let ddu = (a - dg * p) / g;
    let dddu = (j - du * (dg * 3.0 * ddu + ddg * p)) / g;
    let mut rates = [[[0.0; TIMES]; M]; 4];
    for k in 0..M {
        rates[0][k] = q[0][k].into();
        rates[1][k] = (q[1][k] * du).into();
        rates[2][k] = (q[1][k] * ddu + q[2][k] * p).into();
        rates[3][k] = (q[1][k] * dddu + du * (q[2][k] * 3.0 * ddu + q[3][k] * p)).into();
    }
    let is_known = is_moving & is_one_series & is_found;
    Moments {
        u: is_known.select(u, f64x8::splat(simd, f64::NAN)).into(),
        error: ((miss + lengths.error) / length + series_error).into(),
        iterations: iterations.into(),
        rates,
    }
}

/// The length per u.
#[inline(always)]
fn speed<const M: usize, S: Simd>(lengths: &PolynomialLengths<M>, u: f64x8<S>) -> f64x8<S> {
    let t = u * lengths.per_width;
    match lengths.square {
        Square::Axes(rows) => {
            let (rest, mut sum) = (f64x8::splat(u.simd, 1.0) - t, t);
            with_count!(rows.len() + 1, n, {
                let rows = &rows[..n - 1];
                for k in 0..M {
                    let (mut h, mut power) = (f64x8::splat(u.simd, rows[0][k]), t);
                    for row in &rows[1..] {
                        h = h * rest + power * row[k];
                        power *= t;
                    }
                    sum = if k == 0 { h * h } else { sum + h * h };
                }
            });
            sum.sqrt() * lengths.per_width
        }
        // A square that touches 0 may be negative by rounding.
        Square::Tip(tip) => value(&tip.derivatives[0], t).max(f64x8::splat(u.simd, 0.0)).sqrt(),
    }
}

/// A polynomial at t.
#[inline(always)]
fn value<S: Simd>(polynomial: &Polynomial<MAX_TIP>, t: f64x8<S>) -> f64x8<S> {
    let (coefficients, rest) = (polynomial.coefficients(), f64x8::splat(t.simd, 1.0) - t);
    let (mut sum, mut power) = (f64x8::splat(t.simd, coefficients[0]), t);
    for c in &coefficients[1..] {
        sum = sum * rest + power * *c;
        power *= t;
    }
    sum
}

/// The length between two places, by one panel of the quadrature rule of the table.
#[inline(always)]
fn way<const M: usize, S: Simd>(lengths: &PolynomialLengths<M>, from: f64x8<S>, to: f64x8<S>) -> f64x8<S> {
    let (middle, half) = ((from + to) * 0.5, (to - from) * 0.5);
    let mut sum = f64x8::splat(from.simd, 0.0);
    for i in 0..X.len() {
        let off = half * X[i];
        sum += (speed(lengths, middle - off) + speed(lengths, middle + off)) * W[i];
    }
    half * sum
}

/// v² as a polynomial of the share of the length, as in `SpeedSq`.
#[inline(always)]
fn cubic<S: Simd>(speeds: [f64x8<S>; 2], a: [f64x8<S>; 2], length: f64x8<S>) -> [f64x8<S>; 4] {
    let (from, to) = (speeds[0] * speeds[0], speeds[1] * speeds[1]);
    let (rise, slope, end_slope) = (to - from, a[0] * 2.0 * length, a[1] * 2.0 * length);
    [from, slope, rise * 3.0 - slope * 2.0 - end_slope, slope + end_slope - rise * 2.0]
}

/// The share of the length as a power series of the share of the time, as `Series` in `Cubic`.
struct Series<S: Simd> {
    terms: [f64x8<S>; TERMS],
    error: f64x8<S>,
}

/// The series for this v²; `scale` is the duration over the length.
#[inline(always)]
fn series<S: Simd>(&[w, slope, bend, c3]: &[f64x8<S>; 4], scale: f64x8<S>) -> Series<S> {
    let half = scale * scale * 0.5;
    let (p0, p1, p2) = (half * slope, half * (bend * 2.0), half * 3.0 * c3);
    let nothing = f64x8::splat(scale.simd, 0.0);
    let mut terms = [nothing; TERMS];
    (terms[1], terms[2]) = (scale * w.sqrt(), p0 * 0.5);
    for count in 3..TERMS {
        let (k, mut pairs) = (count - 2, nothing);
        for i in 1..k.div_ceil(2) {
            pairs += terms[i] * terms[k - i];
        }
        let mut square = pairs * 2.0;
        if k % 2 == 0 {
            square += terms[k / 2] * terms[k / 2];
        }
        terms[count] = (p1 * terms[k] + p2 * square) * PER_TERM[k];
    }
    // Bound of the sum of the omitted terms.
    let mut rest = [nothing; TERMS + 1];
    for k in (0..TERMS).rev() {
        rest[k] = rest[k + 1] + terms[k].abs();
    }
    let mut square = nothing;
    for i in 1..TERMS {
        square += terms[i].abs() * rest[(TERMS - 2).saturating_sub(i)];
    }
    let missed = p1.abs() * rest[TERMS - 2] + p2.abs() * square;
    let is_gentle = (p1.abs() + p2.abs() * 2.0 * rest[0]).simd_le(nothing + 1.0);
    Series { terms, error: is_gentle.select(missed, nothing + f64::INFINITY) }
}

/// The share of the length at the share s of the time, and its derivative by s.
#[inline(always)]
fn values<S: Simd>(terms: &[f64x8<S>; TERMS], s: f64x8<S>) -> [f64x8<S>; 2] {
    let (mut value, mut slope) = (terms[TERMS - 1], f64x8::splat(s.simd, 0.0));
    for k in (0..TERMS - 1).rev() {
        slope = slope * s + value;
        value = value * s + terms[k];
    }
    [value, slope]
}

/// C, C', C'' and C''' by u, by de Casteljau's algorithm; see `feedplan_geometry::spline::bezier`.
#[inline(always)]
fn derivatives<const M: usize, S: Simd>(piece: &Piece<M>, count: usize, u: f64x8<S>) -> [[f64x8<S>; M]; 4] {
    let control = &piece.control[..count];
    let (scale, one) = (1.0 / piece.width, f64x8::splat(u.simd, 1.0));
    let t = u / piece.width;
    let s = one - t;
    let is_early = t.simd_le(one * 0.5);
    let (d, nothing) = ((count - 1) as f64, one * 0.0);
    let mut out = [[nothing; M]; 4];
    for k in 0..M {
        let [first, last] = [control[0][k], control[count - 1][k]];
        let anchor = is_early.select(nothing + first, nothing + last);
        let mut b = [nothing; MAX_DEGREE + 1];
        for i in 0..count {
            b[i] = nothing + control[i][k] - anchor;
        }
        for left in (1..count).rev() {
            if left == 3 {
                let steps = [b[1] - b[0], b[2] - b[1], b[3] - b[2]];
                let third = (steps[2] - steps[1]) - (steps[1] - steps[0]);
                out[3][k] = third * (d * (d - 1.0) * (d - 2.0)) * (scale * scale * scale);
            }
            if left == 2 {
                out[2][k] = ((b[2] - b[1]) - (b[1] - b[0])) * (d * (d - 1.0)) * (scale * scale);
            }
            if left == 1 {
                out[1][k] = (b[1] - b[0]) * d * scale;
            }
            for i in 0..left {
                b[i] = s * b[i] + t * b[i + 1];
            }
        }
        out[0][k] = b[0] + anchor;
    }
    out
}

#[inline(always)]
fn inner<const M: usize, S: Simd>(a: &[f64x8<S>; M], b: &[f64x8<S>; M]) -> f64x8<S> {
    let mut sum = a[0] * b[0];
    for k in 1..M {
        sum += a[k] * b[k];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phase_motion::{Counts, PhaseMotion, TipSpeed};
    use feedplan_geometry::quadratic::norm;
    use proptest::prelude::*;
    use std::rc::Rc;

    const PERIOD: f64 = 1e-3;

    fn path<'a>(control: &'a [[f64; 2]], weights: &'a [f64]) -> PiecePath<'a, 2> {
        let piece = Piece { control, weights, width: (control.len() - 1) as f64 };
        PiecePath::new(piece, Counts::Axes, Counts::Axes)
    }

    /// This path, with laws that refer to the length of a tip, which moves half as far in Y and farther with X.
    fn path_of_tip(control: &[[f64; 2]]) -> PiecePath<'_, 2> {
        let (piece, degree) =
            (Piece { control, weights: &[], width: (control.len() - 1) as f64 }, control.len() - 1);
        let slopes = [[1.0, 0.0], [0.1, 0.5]].map(|row| {
            let steps = control.windows(2).map(|pair| [pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]]);
            let along = steps.map(|step| (row[0] * step[0] + row[1] * step[1]) * degree as f64 / piece.width);
            Polynomial::<MAX_TIP>::from_bernstein(along)
        });
        let square = Polynomial::sum_of_squares(&slopes);
        let coefficients: Vec<f64> = (0..=square.degree()).map(|i| square.bernstein(i)).collect();
        PiecePath::new(piece, Counts::Axes, Counts::Tip(TipSpeed::new(&coefficients, piece.width)))
    }

    /// A phase with these speeds and accelerations at its ends, and with the duration that follows from them.
    fn phase(path: &PiecePath<2>, u: [f64; 2], speeds: [f64; 2], a: [f64; 2]) -> Phase {
        let (law, [u0, u1], [a0, a1]) = (PhaseLaw::SpeedCubic, u, a);
        let mut made =
            Phase { piece: 0, law, axis: 255, value: 0.0, u0, u1, p0: 0.0, p1: 0.0, duration: 0.0, a0, a1 };
        let squares = path.end_squares(&made);
        (made.p0, made.p1) = (speeds[0].powi(2) / squares[0], speeds[1].powi(2) / squares[1]);
        let length = path.rough_length(&made);
        let rise = speeds[1].powi(2) - speeds[0].powi(2);
        let [slope, end_slope] = a.map(|a| 2.0 * a * length);
        let slowness = |x: f64| {
            let bend = 3.0 * rise - 2.0 * slope - end_slope + x * (slope + end_slope - 2.0 * rise);
            length / (speeds[0].powi(2) + x * (slope + x * bend)).sqrt()
        };
        // Simpson's rule.
        let n = 1000;
        let at = |i: i32| slowness(f64::from(i) / f64::from(2 * n));
        let inner: f64 = (0..n).map(|i| 4.0 * at(2 * i + 1) + 2.0 * at(2 * i)).sum();
        made.duration = (inner + at(2 * n) - at(0)) / f64::from(6 * n);
        made
    }

    fn bits(moment: &Moment<2>) -> Vec<u64> {
        let Rates { velocity, acceleration, jerk } = moment.rates;
        let vectors = [moment.position, velocity, acceleration, jerk];
        [moment.u, moment.error].into_iter().chain(vectors.into_iter().flatten()).map(f64::to_bits).collect()
    }

    fn known(path: &PiecePath<2>, times: &[(Phase, f64)]) -> Vec<bool> {
        let moments = Moments::new(path, times, PERIOD);
        (0..times.len()).map(|lane| moments.as_ref().is_some_and(|of| of.get(lane).is_some())).collect()
    }

    #[test]
    fn what_takes_longer_is_left_out() {
        let control = [[0.0, 0.0], [1.0, 0.3], [2.0, 0.1], [3.0, 0.2]];
        let curve = path(&control, &[]);
        let whole = phase(&curve, [1.0, 1.2], [10.0, 10.1], [5.0, 5.1]);
        let of_line = Phase { law: PhaseLaw::SpeedLine, ..whole };
        let crawling = phase(&curve, [1.0, 1.2], [1e-2, 10.0], [200.0, 300.0]);
        let half = |phase: Phase| (phase, 0.5 * phase.duration);
        let times = [half(whole), (whole, 0.0), (whole, whole.duration), half(of_line), half(crawling)];
        assert_eq!(known(&curve, &times), [true, false, false, false, false]);
        assert_eq!(known(&curve, &times[1..4]), [false; 3]);
        let rational = path(&control, &[1.0, 2.0, 2.0, 1.0]);
        assert_eq!(known(&rational, &[half(whole)]), [false]);
        // Near a sharp turn the table of lengths has many rows.
        let turn = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.3], [0.0, 0.3]];
        let curve = path(&turn, &[]);
        let [short, long] =
            [[0.2, 0.3], [0.2, 2.9]].map(|u| half(phase(&curve, u, [10.0, 10.0], [0.0, 0.0])));
        assert_eq!(known(&curve, &[short, long]), [true, false]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_time_beside_others_has_the_motion_that_it_has_alone(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 1..=9_usize,
            cut in 0.0..0.8_f64,
            part in -4.0..-1.0_f64,
            speed in 9.0..11.0_f64,
            a in prop::array::uniform2(-20.0..20.0_f64),
            is_of_tip: bool,
        ) {
            let control: Vec<[f64; 2]> = (0..=degree).map(|i| [i as f64, 0.3 * bends[i]]).collect();
            let path_of = || if is_of_tip { path_of_tip(&control) } else { path(&control, &[]) };
            let (curve, degree, part) = (path_of(), degree as f64, 10.0_f64.powf(part));
            let u = [degree * cut, degree * (cut + part)];
            let end = (speed * speed + (a[0] + a[1]) * (u[1] - u[0])).sqrt();
            let phase = phase(&curve, u, [speed, end], a);
            let motion = PhaseMotion::new(Rc::new(path_of()), &phase);
            let shares = [1e-9, 0.1, 0.4, 0.5, 0.6, 0.8, 0.99, 1.0 - 1e-9];
            let times = shares.map(|share| (phase, share * phase.duration));
            let lengths = curve.polynomial_lengths(phase.law).expect("the piece has no weights");
            let is_easy = part < 0.01 && lengths.is_rule_good(u[0], u[1]);
            let moments = Moments::new(&curve, &times, PERIOD);
            for (lane, time) in times.iter().enumerate() {
                let Some(moment) = moments.as_ref().and_then(|of| of.get(lane)) else {
                    prop_assert!(!is_easy, "{} at {part}", shares[lane]);
                    continue;
                };
                let alone = Moments::new(&curve, &[*time], PERIOD).and_then(|of| of.get(0));
                prop_assert_eq!(alone.map(|alone| bits(&alone)), Some(bits(&moment)));
                let state = motion.at_time(time.1, PERIOD);
                let (position, rates) = motion.sample(&state);
                prop_assert!((state.u - moment.u).abs() <= 1e-14 * degree, "{} {}", state.u, moment.u);
                let pairs = [
                    (position, moment.position, 1e-14 * degree),
                    (rates.velocity, moment.rates.velocity, 1e-12),
                    (rates.acceleration, moment.rates.acceleration, 1e-10),
                    (rates.jerk, moment.rates.jerk, 1e-8),
                ];
                for (alone, beside, most) in pairs {
                    let off = [0, 1].map(|k| beside[k] - alone[k]);
                    prop_assert!(norm(&off) <= most * (1.0 + norm(&alone)), "{alone:?} {beside:?}");
                }
                prop_assert!(moment.error * norm(&rates.velocity) * phase.duration <= 1e-12);
            }
        }
    }
}
