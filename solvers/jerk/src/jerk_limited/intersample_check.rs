//! Computes the use of the limits by a spline w between the collocation points: with the path's true derivatives at 16 samples of
//! each interval, and with the peaks of polynomials through these samples.

use fearless_simd::{dispatch, Level, Simd};

use super::columns::Columns;
use super::constraints::{Constraints, RowLayout};
use super::hermite::{self, combine, Basis, LAST, VALUE};
use super::sides::Sides;
use crate::path_problem::{Geometry, Limits};
use feedplan_geometry::lanes::eight::{Lanes, Register, LANES};

/// Sample steps from one collocation point to the next, and the number of samples of an interval, its ends included.
const STEPS: usize = 5;
const SAMPLES: usize = STEPS * LAST + 1;
/// Peaks between samples are computed only where a sample uses more than this fraction of a limit.
const NEAR: f64 = 0.97;

/// The error of an interval's length when a plan is stored as phases, in units of the machine epsilon times the path's length.
const ROUNDINGS: f64 = 4.0;

/// w, w'/2, w''/2 and √w at each sample of a block.
type Motions<S> = [[Register<S>; 4]; SAMPLES];

/// The Hermite basis and its first two derivatives at each sample.
const BASES: [[Basis; 3]; SAMPLES] = bases();

const fn bases() -> [[Basis; 3]; SAMPLES] {
    let mut out = [[[0.0; 4]; 3]; SAMPLES];
    let mut i = 0;
    while i < SAMPLES {
        out[i] = hermite::at(i as f64 / (SAMPLES - 1) as f64);
        i += 1;
    }
    out
}

/// Weights of the samples in the mean over the interval (trapezoidal rule).
const MEAN: [f64; SAMPLES] = {
    let mut out = [1.0 / (SAMPLES - 1) as f64; SAMPLES];
    (out[0], out[SAMPLES - 1]) = (0.5 * out[0], 0.5 * out[0]);
    out
};

/// The limits on eight neighbouring intervals.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// 1/w_max by the speed cap at each sample.
    caps: [Lanes; SAMPLES],
    /// 1/w_max at the stations at both ends of each interval.
    at_stations: [Lanes; 2],
    /// Factor by which the limits of jerk are tighter than the machine's.
    jerk_factor: Lanes,
    /// The relative error of the length of each interval.
    rounding: Lanes,
}

/// The limits of a window at all samples.
#[derive(Clone, Debug)]
pub struct IntersampleCheck {
    axes: Vec<Axis>,
    blocks: Vec<Block>,
    /// q', q'', q''' of each axis at all samples of each block.
    q: Vec<[[Lanes; 3]; SAMPLES]>,
}

/// The limits of an axis.
#[derive(Clone, Copy, Debug)]
struct Axis {
    velocity: Sides,
    acceleration: Sides,
    per_jerk: f64,
}

impl IntersampleCheck {
    /// A check without samples, for the limits of the axes that move.
    pub fn new<const M: usize>(limits: &Limits<M>, moves: &[bool; M]) -> Self {
        let [velocity, acceleration] = [&limits.velocity, &limits.acceleration].map(Sides::of);
        let axis = |k: usize| Axis {
            velocity: velocity[k],
            acceleration: acceleration[k],
            per_jerk: 1.0 / limits.jerk[k],
        };
        Self { axes: (0..M).filter(|&k| moves[k]).map(axis).collect(), blocks: vec![], q: vec![] }
    }

    /// Evaluates the path at the samples between `stations` (in mm). The values at collocation points, w_max at stations and the
    /// factors of jerk are copied from `rows`.
    pub fn sample<const M: usize>(
        &mut self,
        geometry: &dyn Geometry<M>,
        stations: &[f64],
        pieces: &[u32],
        rows: &Constraints,
    ) {
        self.blocks.clear();
        self.blocks.reserve(rows.blocks.len());
        // Only the last block needs clearing: all lanes of all others are set below.
        let axes = self.axes.len();
        self.q.truncate(rows.blocks.len().saturating_sub(1) * axes);
        self.q.resize(rows.blocks.len() * axes, [[Lanes::ZERO; 3]; SAMPLES]);
        let knots = geometry.knots();
        let error = ROUNDINGS * f64::EPSILON * (knots[knots.len() - 1] - knots[0]);
        for (b, own) in rows.blocks.iter().enumerate() {
            let first = b * LANES;
            let mut caps = [Lanes::ZERO; SAMPLES];
            let samples = &mut self.q[b * axes..(b + 1) * axes];
            for (p, point) in own.points.iter().enumerate() {
                caps[STEPS * p] = point.cap;
                for (samples, q) in samples.iter_mut().zip(rows.q(b, p)) {
                    samples[STEPS * p] = *q;
                }
            }
            for (lane, &piece) in pieces[first..].iter().take(LANES).enumerate() {
                let (start, h) = (stations[first + lane], own.h.values()[lane]);
                let s = |i: usize| start + h * (i as f64 / (SAMPLES - 1) as f64);
                for first in (1..SAMPLES).step_by(STEPS) {
                    let points = geometry.at_four(piece as usize, std::array::from_fn(|i| s(first + i)));
                    for (samples, &axis) in samples.iter_mut().zip(&rows.axes) {
                        for (order, values) in points.q[axis].iter().enumerate() {
                            for (i, value) in values.values().iter().enumerate() {
                                samples[first + i][order].values_mut()[lane] = *value;
                            }
                        }
                    }
                    for (i, speed) in points.speed_cap.values().iter().enumerate() {
                        caps[first + i].values_mut()[lane] = 1.0 / (speed * speed);
                    }
                }
            }
            let at_stations = [0, LAST].map(|p| own.points[p].speed);
            let rounding = own.h.map(|h| error / h);
            self.blocks.push(Block { caps, at_stations, jerk_factor: own.jerk, rounding });
        }
    }

    /// The greatest use of the limits of speed, acceleration and jerk on each interval by the spline x. The use of jerk includes
    /// the effect of the rounding error of the interval's length, which matters on short intervals of long paths.
    ///
    /// Peaks are computed for each axis alone: the maximum over several axes is not smooth.
    pub fn utilisation(&self, rows: &Constraints, x: &[f64]) -> Vec<[f64; 3]> {
        dispatch!(Level::new(), simd => self.utilisation_on(simd, rows, x))
    }

    #[inline(always)]
    pub(super) fn utilisation_on<S: Simd>(&self, simd: S, rows: &Constraints, x: &[f64]) -> Vec<[f64; 3]> {
        let x = Columns::new(x);
        let mut out = vec![[0.0; 3]; rows.count()];
        let zero = Register::all(simd, 0.0);
        // Work arrays for one block; each block overwrites all of them.
        let (mut motion, mut uses) = ([[zero; 4]; SAMPLES], [zero; SAMPLES]);
        for (b, (block, out)) in self.blocks.iter().zip(out.chunks_mut(LANES)).enumerate() {
            let h = rows.blocks[b].h.load(simd);
            let (u, per_h) = (x.local(b, h, rows.blocks[b].live), h.inverse());
            set_motion(&mut motion, &u, per_h);
            for (uses, (motion, cap)) in uses.iter_mut().zip(motion.iter().zip(&block.caps)) {
                *uses = motion[0] * *cap;
            }
            let [from, to] = block.at_stations;
            let at_stations = (u[0] * from).max(u[2] * to);
            let mut worst = [peak(&uses, [1.0; 2]).max(at_stations).max(zero).sqrt(), zero, zero];
            let axes = self.axes.iter().zip(&self.q[b * self.axes.len()..]);
            for (Axis { velocity, acceleration, per_jerk }, q) in axes {
                for i in 0..SAMPLES {
                    uses[i] = motion[i][3] * q[i][0] * velocity.per_mean;
                }
                worst[0] = peak(&uses, velocity.per_most).max(worst[0]);
                for i in 0..SAMPLES {
                    let ([w, half, ..], [q1, q2, _]) = (motion[i], q[i]);
                    uses[i] = (q2 * w + q1 * half) * acceleration.per_mean;
                }
                worst[1] = peak(&uses, acceleration.per_most).max(worst[1]);
                let jerk = block.jerk_factor.load(simd) * *per_jerk;
                for i in 0..SAMPLES {
                    let ([w, half, bend, v], [q1, q2, q3]) = (motion[i], q[i]);
                    uses[i] = (q3 * w + q2 * half * 3.0 + q1 * bend) * v * jerk;
                }
                // A relative error e of the length changes w' by e w', and w'' by 2 e w''.
                let mut terms = zero;
                for i in [0, SAMPLES - 1] {
                    let ([_, half, bend, v], [q1, q2, _]) = (motion[i], q[i]);
                    terms = terms.max(((q2 * half).abs() * 3.0 + (q1 * bend).abs() * 2.0) * v);
                }
                let rounding = terms * jerk * block.rounding;
                worst[2] = (peak(&uses, [1.0; 2]) + rounding).max(worst[2]);
            }
            let worst = worst.map(Register::values);
            for (lane, out) in out.iter_mut().enumerate() {
                *out = worst.map(|worst| worst[lane]);
            }
        }
        out
    }

    /// First-order estimate of the time in s that each interval loses because the spline x uses its limits unevenly: Σ λ
    /// (greatest − mean use) over all limits, where λ is the sum of a limit's multipliers at the collocation points. `used` is
    /// the result of `utilisation`.
    pub fn losses(&self, rows: &Constraints, x: &[f64], dual: &[Lanes], used: &[[f64; 3]]) -> Vec<f64> {
        dispatch!(Level::new(), simd => self.losses_on(simd, rows, x, dual, used))
    }

    #[inline(always)]
    fn losses_on<S: Simd>(
        &self,
        simd: S,
        rows: &Constraints,
        x: &[f64],
        dual: &[Lanes],
        used: &[[f64; 3]],
    ) -> Vec<f64> {
        let (x, layout) = (Columns::new(x), rows.layout());
        let zero = Register::all(simd, 0.0);
        let mut multipliers = vec![zero; layout.count()];
        let mut motion = [[zero; 4]; SAMPLES];
        let mut out = Vec::with_capacity(rows.blocks.len() * LANES);
        for (b, (block, used)) in self.blocks.iter().zip(used.chunks(LANES)).enumerate() {
            let h = rows.blocks[b].h.load(simd);
            let (u, per_h) = (x.local(b, h, rows.blocks[b].live), h.inverse());
            set_motion(&mut motion, &u, per_h);
            let greatest = |limit: usize| {
                Lanes::new(std::array::from_fn(|lane| {
                    used.get(lane).map_or(1.0, |used| used[limit].max(1.0))
                }))
            };
            let [speed, acceleration, jerk] = [0, 1, 2].map(greatest);
            let (speed, acceleration, jerk) = (speed.load(simd), acceleration.load(simd), jerk.load(simd));
            let jerk_factor = block.jerk_factor.load(simd);
            let mut caps = [zero; SAMPLES];
            for (cap, own) in caps.iter_mut().zip(&block.caps) {
                *cap = own.load(simd);
            }
            multipliers.fill(zero);
            for (p, value) in VALUE.iter().enumerate() {
                let pace = combine(value, &u).sqrt().inverse();
                for (k, (sum, own)) in multipliers.iter_mut().zip(layout.of(dual, b, p)).enumerate() {
                    let own = own.load(simd);
                    // The rows of jerk limit jerk/√w: times w^(−1/2), their multipliers are those of the jerk.
                    *sum += if k < layout.speed() { own * pace } else { own };
                }
            }
            let axes = self.axes.iter().zip(&self.q[b * self.axes.len()..]);
            let mut loss = zero;
            for (k, (axis, q)) in axes.enumerate() {
                let Axis { velocity, acceleration: most, per_jerk } = axis;
                let [mut a, mut j] = [zero; 2];
                for i in 0..SAMPLES {
                    let ([w, half, bend, v], [q1, q2, q3]) = (motion[i], q[i]);
                    a += (q2 * w + q1 * half) * MEAN[i];
                    j += (q3 * w + q2 * half * 3.0 + q1 * bend) * v * MEAN[i];
                    let first = q1.load(simd) * velocity.per_mean;
                    let first = (first * velocity.per_most[0]).max(-first * velocity.per_most[1]);
                    caps[i] = caps[i].max(first * first);
                }
                let (a, j) = (a * most.per_mean, j * jerk_factor * *per_jerk);
                let pair = |first: usize| &multipliers[first + RowLayout::PAIR * k..][..RowLayout::PAIR];
                let own = pair(0);
                loss += (jerk - j).max(zero) * own[0] + (jerk + j).max(zero) * own[1];
                if rows.accelerates {
                    let own = pair(layout.acceleration());
                    loss += (acceleration * most.most[0] - a).max(zero) * own[0];
                    loss += (acceleration * most.most[1] + a).max(zero) * own[1];
                }
            }
            let mut mean = zero;
            for (i, cap) in caps.iter().enumerate() {
                mean += motion[i][0] * *cap * MEAN[i];
            }
            loss += (speed * speed - mean).max(zero) * multipliers[layout.speed()];
            out.extend_from_slice(&loss.values());
        }
        out.truncate(rows.count());
        out
    }
}

/// Sets the motion at all samples from the local coefficients u on intervals of length 1/`per_h`.
#[inline(always)]
fn set_motion<S: Simd>(motions: &mut Motions<S>, u: &[Register<S>; 4], per_h: Register<S>) {
    let zero = Register::all(per_h.simd(), 0.0);
    for (motion, basis) in motions.iter_mut().zip(&BASES) {
        let w = combine(&basis[0], u);
        let half = combine(&basis[1], u) * per_h * 0.5;
        let bend = combine(&basis[2], u) * (per_h * per_h) * 0.5;
        *motion = [w, half, bend, w.max(zero).sqrt()];
    }
}

/// Number of samples in each polynomial that interpolates half-way between samples.
const STENCIL: usize = 6;
/// Weights of these samples, and the index of the first of them.
const HALFWAY: [([f64; STENCIL], usize); SAMPLES - 1] = halfway();

const fn halfway() -> [([f64; STENCIL], usize); SAMPLES - 1] {
    let mut out = [([0.0; STENCIL], 0); SAMPLES - 1];
    let mut i = 0;
    while i < SAMPLES - 1 {
        let centred = if i < STENCIL / 2 - 1 { 0 } else { i + 1 - STENCIL / 2 };
        let first = if centred + STENCIL > SAMPLES { SAMPLES - STENCIL } else { centred };
        let t = i as f64 + 0.5 - first as f64;
        let mut k = 0;
        while k < STENCIL {
            let (mut weight, mut other) = (1.0, 0);
            while other < STENCIL {
                if other != k {
                    weight *= (t - other as f64) / (k as f64 - other as f64);
                }
                other += 1;
            }
            out[i].0[k] = weight;
            k += 1;
        }
        out[i].1 = first;
        i += 1;
    }
    out
}

/// The greatest use of the limits by smooth functions with these values at the samples; `per_high` and `per_low` are 1 over the
/// limits of positive and of negative values. It is the greatest of the sample values and of the peaks of parabolas, each through
/// three neighbours among the samples and the interpolated values half-way between them.
#[inline(always)]
fn peak<S: Simd>(f: &[Register<S>; SAMPLES], [per_high, per_low]: [f64; 2]) -> Register<S> {
    let zero = Register::all(f[0].simd(), 0.0);
    let (low, high) = f.iter().fold((zero, zero), |(low, high), &value| (value.min(low), value.max(high)));
    let mut worst = (high * per_high).max(-low * per_low);
    if worst.greatest() <= NEAR {
        return worst;
    }
    let mut last = zero;
    for (i, (weights, first)) in HALFWAY.iter().enumerate() {
        let mut middle = zero;
        for (weight, value) in weights.iter().zip(&f[*first..]) {
            middle += *value * *weight;
        }
        if i > 0 {
            let top = top([last, f[i], middle]);
            worst = (top * per_high).max(-top * per_low).max(worst);
        }
        let top = top([f[i], middle, f[i + 1]]);
        worst = (top * per_high).max(-top * per_low).max(worst);
        last = middle;
    }
    worst
}

/// The value at the vertex of the parabola through three equally spaced values. If the vertex lies outside them, the result is
/// less than the greatest of the three in size.
#[inline(always)]
fn top<S: Simd>([before, here, after]: [Register<S>; 3]) -> Register<S> {
    let bend = here + here - before - after;
    let rise = (after - before).abs().min(bend.abs() * 2.0);
    here + rise * rise * ((bend + Register::all(here.simd(), f64::MIN_POSITIVE)) * 8.0).inverse()
}

#[cfg(test)]
mod tests {
    use super::super::prepare::Prepared;
    use super::super::profiles::{problem, random, Winding};
    use super::super::window::Window;
    use super::*;
    use crate::path_problem::{Effort, PathPoint};

    /// A line between two arc lengths, in mm.
    struct Line([f64; 2]);

    impl Geometry<1> for Line {
        fn knots(&self) -> &[f64] {
            &self.0
        }

        fn at(&self, _: usize, _: f64) -> PathPoint<1> {
            PathPoint { first: [1.0], second: [0.0], third: [0.0], speed_cap: f64::INFINITY }
        }
    }

    #[test]
    fn the_jerk_of_a_short_interval_on_a_long_path_has_the_rounding_of_its_length() {
        // w = 1 + s² over 1 mm: the jerk √w w''/2 is √2 at the end, and changes by twice the error of the length.
        let limits = Limits { velocity: [[1e9]; 2], acceleration: [[1e9]; 2], jerk: [1.0] };
        let used = |length: f64| {
            let (line, stations) = (Line([0.0, length]), [0.0, 1.0]);
            let mut window = Window::new(&limits, &[true; 1]);
            window.rows.sample(&line, &limits, &stations, &[0], &[1.0], |_| f64::INFINITY);
            window.check.sample(&line, &stations, &[0], &window.rows);
            window.check.utilisation(&window.rows, &[1.0, 0.0, 2.0, 2.0])[0][2]
        };
        for length in [1.0, 1e6, 1e9] {
            let known = 2f64.sqrt() * (1.0 + 2.0 * ROUNDINGS * f64::EPSILON * length);
            assert!((used(length) / known - 1.0).abs() < 1e-14, "{} of {known}", used(length));
        }
    }

    /// The greatest use by each of eight functions, computed in the lanes of one vector.
    fn peaks(functions: [&dyn Fn(f64) -> f64; LANES], per_most: [f64; 2]) -> [f64; LANES] {
        let at = |i: usize| Lanes::new(functions.map(|f| f(i as f64 / (SAMPLES - 1) as f64)));
        dispatch!(Level::new(), simd => peak(&std::array::from_fn(|i| at(i).load(simd)), per_most).values())
    }

    #[test]
    fn peaks_of_polynomials_between_samples_are_found() {
        // 1 − (t − c)²/2 + (t − c)³/10 has its peak 1 at c.
        for i in 0..100 {
            let c = 0.01 * f64::from(i);
            let bump = |t: f64| 1.0 - 0.5 * (t - c).powi(2) + 0.1 * (t - c).powi(3);
            let (down, half) = (|t: f64| -bump(t), |t: f64| 0.5 * bump(t));
            let (line, none) = (|t: f64| 0.98 * t, |_| 0.0);
            let all: [&dyn Fn(f64) -> f64; LANES] = [&bump, &down, &half, &line, &none, &none, &none, &bump];
            let [one, other, low, straight, still, .., last] = peaks(all, [1.0; 2]);
            assert!((one - 1.0).abs() < 5e-6, "{one} for a peak at {c}");
            assert_eq!((one, one, 0.0), (other, last, still));
            assert!((low - 0.5).abs() < 3e-6 && (straight - 0.98).abs() < 1e-15, "{low} and {straight}");
            let [twice, half, ..] = peaks(all, [2.0, 0.5]);
            assert_eq!((twice, half), (2.0 * one, 0.5 * one));
        }
    }

    /// The loss of interval n by its definition, without SIMD vectors.
    fn loss(window: &Window, x: &[f64], dual: &[Lanes], used: &[f64; 3], n: usize) -> f64 {
        let Window { rows, check } = window;
        let (b, lane, layout, h) = (n / LANES, n % LANES, rows.layout(), rows.h(n));
        let u = hermite::local(x, n, h);
        let most = used.map(|used| used.max(1.0));
        let multiplier = |k: usize, p: usize| layout.of(dual, b, p)[k].values()[lane];
        let over = |k: usize, of: &dyn Fn(f64) -> f64| -> f64 {
            (0..4).map(|p| multiplier(k, p) * of(combine(&VALUE[p], &u))).sum()
        };
        let mut caps = std::array::from_fn::<_, SAMPLES, _>(|i| check.blocks[b].caps[i].values()[lane]);
        let mut sum = 0.0;
        for (k, axis) in check.axes.iter().enumerate() {
            let (mut a, mut j) = (0.0, 0.0);
            for i in 0..SAMPLES {
                let [w, slope, bend]: [f64; 3] = BASES[i].map(|basis| combine(&basis, &u));
                let (slope, bend) = (slope / h, bend / (h * h));
                let q = check.q[b * check.axes.len() + k][i].map(|q| q.values()[lane]);
                a += MEAN[i] * (q[1] * w + 0.5 * q[0] * slope) * axis.acceleration.per_mean;
                let jerk = q[2] * w + 1.5 * q[1] * slope + 0.5 * q[0] * bend;
                j += MEAN[i] * jerk * w.sqrt() * axis.per_jerk * rows.jerk(n);
                let sign = usize::from(q[0] < 0.0);
                caps[i] = caps[i].max((q[0] * axis.velocity.per_mean * axis.velocity.per_most[sign]).powi(2));
            }
            let [up, down] = axis.acceleration.most;
            let one = |_: f64| 1.0;
            sum += over(layout.acceleration() + 2 * k, &one) * (up * most[1] - a).max(0.0);
            sum += over(layout.acceleration() + 2 * k + 1, &one) * (down * most[1] + a).max(0.0);
            let pace = |w: f64| 1.0 / w.sqrt();
            sum += over(2 * k, &pace) * (most[2] - j).max(0.0);
            sum += over(2 * k + 1, &pace) * (most[2] + j).max(0.0);
        }
        let speed: f64 = (0..SAMPLES).map(|i| MEAN[i] * caps[i] * combine(&BASES[i][0], &u)).sum();
        sum + over(layout.speed(), &|_| 1.0) * (most[0].powi(2) - speed).max(0.0)
    }

    #[test]
    fn losses_are_those_of_their_definition() {
        let (up, down) = ([250.0, 300.0], [250.0, 200.0]);
        let limits = Limits {
            velocity: [up, down],
            acceleration: [[3000.0, 2000.0], [2500.0; 2]],
            jerk: [50_000.0; 2],
        };
        let path = Winding::new(1.0);
        let problem = problem(&path, limits);
        let prepared = Prepared::new(&problem, &Effort::default()).expect("a first plan");
        let mut window = Window::new(&limits, &[true; 2]);
        // One interval alone is in the last block.
        prepared.fill(0..LANES * 6 + 1, &mut window);
        let (rows, check) = (&window.rows, &window.check);
        let x: Vec<f64> = prepared.x[..2 * rows.count() + 2].iter().map(|x| 1.9 * x).collect();
        let mut random = random();
        let mut some = || Lanes::new(std::array::from_fn(|_| 1.0 + random()));
        let dual: Vec<Lanes> = (0..rows.blocks.len() * rows.layout().all()).map(|_| some()).collect();
        let used = check.utilisation(rows, &x);
        let losses = check.losses(rows, &x, &dual, &used);
        assert_eq!(losses.len(), rows.count());
        for (n, (found, used)) in losses.into_iter().zip(&used).enumerate() {
            let known = loss(&window, &x, &dual, used, n);
            assert!((found / known - 1.0).abs() < 1e-12, "{found} and {known} on {n}");
        }
    }

    #[test]
    fn values_far_from_a_limit_are_taken_as_they_are() {
        assert_eq!(peaks([&|t| 0.5 * t; LANES], [1.0; 2]), [0.5; LANES]);
    }
}
