//! The limits on a window at its collocation points, as slacks of w = v², from the axes' derivatives by arc length.
//!
//! With q', q'', q''' of an axis, its limits A⁺ and A⁻ of acceleration, their mean A, and its limit J of jerk,
//!
//!   acceleration   A^±/A ∓ (q'' w + q' w'/2)/A ≥ 0
//!   jerk           w^(−1/2) ∓ (q''' w + 3/2 q'' w' + 1/2 q' w'')/J ≥ 0
//!   speed          1 − w/w_max ≥ 0,   w ≥ 0
//!
//! At the ends of an interval the last row holds the inner Bernstein coefficients of the cubic above 0 instead of w. w
//! at a station lies between the coefficients on both sides of it, so that w is above 0 everywhere.
//!
//! The slack of the jerk is convex in w: its tangent at a valid plan is a safe inner constraint.
//!
//! A block holds the limits of eight neighbouring intervals in the lanes of vectors. Lanes beyond the last interval have no
//! limits, and weigh nothing.

use std::ops::Range;

use fearless_simd::{dispatch, Level, Simd};

use super::columns::Columns;
use super::forms::{self, Form};
use super::hermite::{COUNT, POINTS};
use super::sides::Sides;
use super::window_end::WindowEnd;
use crate::path_problem::{Geometry, Limits, PathPoint};
use feedplan_geometry::lanes::eight::{Lanes, Register, LANES};

/// Steps from a collocation point along the tangent of w to an inner Bernstein coefficient, as parts of the interval.
const INWARDS: [f64; COUNT] = [1.0 / 3.0, 0.0, 0.0, -1.0 / 3.0];

/// The limits on the interval between two stations, at each collocation point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval<const M: usize> {
    /// Its length, in mm.
    pub h: f64,
    /// q', q'', q''' of each axis.
    pub q: [[[f64; 3]; M]; COUNT],
    /// 1/w_max.
    pub speed: [f64; COUNT],
    /// Factor by which the acceleration limit is tighter than the machine's: 1 or more, 0 where it does not apply.
    pub acceleration: [f64; COUNT],
    /// Factor by which the jerk limit is tighter: 1 or more.
    pub jerk: f64,
}

/// The same of neighbouring intervals.
#[derive(Clone, Copy, Debug)]
pub struct Block<const M: usize> {
    pub h: Lanes,
    pub jerk: Lanes,
    pub points: [Point<M>; COUNT],
    /// 1 for each interval, 0 for each lane beyond the last one.
    pub live: Lanes,
}

/// The same at one collocation point of each.
#[derive(Clone, Copy, Debug)]
pub struct Point<const M: usize> {
    pub q: [[Lanes; 3]; M],
    pub speed: Lanes,
    pub acceleration: Lanes,
}

/// The constraints on the intervals of a window.
#[derive(Clone, Debug)]
pub struct Constraints<const M: usize> {
    count: usize,
    pub blocks: Vec<Block<M>>,
    pub acceleration: Sides<M>,
    /// 1/J of each axis.
    pub per_jerk: [f64; M],
}

/// Indices of the rows at one collocation point: for each axis the upper and the lower limit of its acceleration, then of
/// its jerk; then speed, then w ≥ 0.
pub struct RowLayout<const M: usize>;

impl<const M: usize> RowLayout<M> {
    pub const SPEED: usize = 4 * M;
    pub const POSITIVE: usize = 4 * M + 1;
    pub const COUNT: usize = 4 * M + 2;
    /// Rows of a block.
    pub const BLOCK: usize = COUNT * Self::COUNT;

    #[inline(always)]
    pub const fn acceleration(axis: usize) -> usize {
        4 * axis
    }

    #[inline(always)]
    pub const fn jerk(axis: usize) -> usize {
        4 * axis + 2
    }

    /// The rows of a block at collocation point p.
    #[inline(always)]
    pub fn of(all: &[Lanes], block: usize, p: usize) -> &[Lanes] {
        &all[block * Self::BLOCK + p * Self::COUNT..][..Self::COUNT]
    }

    #[inline(always)]
    pub fn of_mut(all: &mut [Lanes], block: usize, p: usize) -> &mut [Lanes] {
        &mut all[block * Self::BLOCK + p * Self::COUNT..][..Self::COUNT]
    }
}

impl<const M: usize> Interval<M> {
    /// The greatest r = w^(3/4) if the slope of r is at most k.
    pub fn envelope_cap(&self, limits: &Limits<M>, k: f64) -> f64 {
        let cap = |p: usize| {
            let of = |order: usize| std::array::from_fn(|axis| self.q[p][axis][order]);
            let speed_cap = 1.0 / self.speed[p].sqrt();
            limits.envelope_cap(&PathPoint { first: of(0), second: of(1), third: of(2), speed_cap }, k)
        };
        cap(0).min(cap(1)).min(cap(2)).min(cap(3))
    }
}

impl<const M: usize> Block<M> {
    /// No limits, on intervals that are so short that w and its slope at their start cannot make it negative in them.
    const NONE: Self = Self {
        h: Lanes::all(1e-12),
        jerk: Lanes::ONE,
        points: [Point { q: [[Lanes::ZERO; 3]; M], speed: Lanes::ZERO, acceleration: Lanes::ZERO }; COUNT],
        live: Lanes::ZERO,
    };

    /// Steps from collocation point p along the tangent of w to the inner Bernstein coefficients: if these and w at the
    /// stations are above 0, w is above 0 everywhere.
    #[inline(always)]
    pub fn inwards<S: Simd>(&self, simd: S, p: usize) -> Register<S> {
        self.h.load(simd) * INWARDS[p]
    }
}

impl<const M: usize> Constraints<M> {
    /// Without intervals.
    pub fn new(limits: &Limits<M>) -> Self {
        Self {
            count: 0,
            blocks: vec![],
            acceleration: Sides::new(&limits.acceleration),
            per_jerk: limits.jerk.map(|j| 1.0 / j),
        }
    }

    /// The number of intervals.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The length of an interval, in mm.
    pub fn h(&self, n: usize) -> f64 {
        self.blocks[n / LANES].h.values()[n % LANES]
    }

    pub fn interval(&self, n: usize) -> Interval<M> {
        let (block, lane) = (&self.blocks[n / LANES], n % LANES);
        let at = |lanes: &Lanes| lanes.values()[lane];
        Interval {
            h: at(&block.h),
            q: std::array::from_fn(|p| block.points[p].q.map(|q| q.map(|q| at(&q)))),
            speed: std::array::from_fn(|p| at(&block.points[p].speed)),
            acceleration: std::array::from_fn(|p| at(&block.points[p].acceleration)),
            jerk: at(&block.jerk),
        }
    }

    pub fn intervals(&self) -> impl Iterator<Item = Interval<M>> + '_ {
        (0..self.count).map(|n| self.interval(n))
    }

    /// Tightens the limits of speed, acceleration and jerk of an interval by these factors.
    pub fn tighten(&mut self, n: usize, [speed, acceleration, jerk]: [f64; 3]) {
        let (block, lane) = (&mut self.blocks[n / LANES], n % LANES);
        for point in &mut block.points {
            point.speed.values_mut()[lane] *= speed * speed;
            point.acceleration.values_mut()[lane] *= acceleration;
        }
        block.jerk.values_mut()[lane] *= jerk;
    }

    /// Lowers the greatest w at a collocation point of an interval. A limit that does not apply stays so.
    pub fn lower(&mut self, n: usize, p: usize, w: f64) {
        let per_w = &mut self.blocks[n / LANES].points[p].speed.values_mut()[n % LANES];
        if *per_w > 0.0 {
            *per_w = per_w.max(1.0 / w);
        }
    }

    /// Takes these intervals instead.
    pub fn replace(&mut self, intervals: impl Iterator<Item = Interval<M>>) {
        self.count = 0;
        self.blocks.clear();
        for interval in intervals {
            self.push(&interval);
        }
    }

    fn push(&mut self, interval: &Interval<M>) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.blocks.push(Block::NONE);
        }
        let block = &mut self.blocks[self.count / LANES];
        let put = |to: &mut Lanes, value: f64| to.values_mut()[lane] = value;
        put(&mut block.h, interval.h);
        put(&mut block.jerk, interval.jerk);
        put(&mut block.live, 1.0);
        for (p, point) in block.points.iter_mut().enumerate() {
            for (to, q) in point.q.as_flattened_mut().iter_mut().zip(interval.q[p].as_flattened()) {
                put(to, *q);
            }
            put(&mut point.speed, interval.speed[p]);
            put(&mut point.acceleration, interval.acceleration[p]);
        }
        self.count += 1;
    }

    /// Takes the intervals between `stations`. Interval n lies on `pieces[n]`, with limits of jerk tightened by
    /// `jerk_factor[n]`; `station_cap` is the speed cap at a station, infinite without one.
    pub fn sample(
        &mut self,
        geometry: &impl Geometry<M>,
        limits: &Limits<M>,
        stations: &[f64],
        pieces: &[u32],
        jerk_factor: &[f64],
        station_cap: impl Fn(usize) -> f64,
    ) {
        let mut last: Option<PathPoint<M>> = None;
        self.replace((0..pieces.len()).map(|n| {
            let (start, h) = (stations[n], stations[n + 1] - stations[n]);
            let piece = pieces[n] as usize;
            let at = |part: f64| geometry.at(piece, start + part * h);
            let first = match last {
                Some(point) if n > 0 && pieces[n - 1] == pieces[n] => point,
                _ => geometry.at(piece, start),
            };
            let end = geometry.at(piece, stations[n + 1]);
            last = Some(end);
            let points = [first, at(POINTS[1]), at(POINTS[2]), end];
            let mut speed = points.map(|point| limits.per_speed_sq(&point));
            for (p, station) in [(0, n), (3, n + 1)] {
                let cap = station_cap(station);
                speed[p] = speed[p].max(1.0 / (cap * cap));
            }
            let q = points.map(|PathPoint { first, second, third, .. }| {
                std::array::from_fn(|k| [first[k], second[k], third[k]])
            });
            Interval { h, q, speed, acceleration: [1.0; COUNT], jerk: jerk_factor[n] }
        }));
    }

    /// Takes a range of the intervals of others.
    pub fn copy(&mut self, others: &Self, range: Range<usize>) {
        // Blocks that are the same in both are copied whole.
        let whole = if range.start % LANES == 0 { range.len() / LANES } else { 0 };
        self.blocks.clear();
        self.blocks.extend_from_slice(&others.blocks[range.start / LANES..][..whole]);
        self.count = whole * LANES;
        for n in range.start + self.count..range.end {
            self.push(&others.interval(n));
        }
    }

    /// Acceleration and jerk/√w of each axis at collocation point p of a block, over A and J.
    #[inline(always)]
    pub fn axes<S: Simd>(
        &self,
        block: &Block<M>,
        p: usize,
        [w, w1, w2]: [Register<S>; 3],
    ) -> [[Register<S>; 2]; M] {
        let point = &block.points[p];
        let (half, bend, more) = (w1 * 0.5, w2 * 0.5, w1 * 1.5);
        let mut out = [[Register::all(w.simd(), 0.0); 2]; M];
        for k in 0..M {
            let [q1, q2, q3] = point.q[k];
            out[k] = [
                (q2 * w + q1 * half) * self.acceleration.per_mean[k] * point.acceleration,
                (q3 * w + q2 * more + q1 * bend) * self.per_jerk[k] * block.jerk,
            ];
        }
        out
    }

    /// The slacks at collocation point p of a block, with w^(−1/2) = `pace` and the last row as given.
    #[inline(always)]
    pub fn slack<S: Simd>(
        &self,
        block: &Block<M>,
        p: usize,
        motion: [Register<S>; 3],
        pace: Register<S>,
        last: Register<S>,
        out: &mut [Lanes],
    ) {
        let simd = pace.simd();
        let axes = self.axes(block, p, motion);
        let out = &mut out[..RowLayout::<M>::COUNT];
        for k in 0..M {
            let [a, j] = axes[k];
            let (at, to) = (RowLayout::<M>::acceleration(k), RowLayout::<M>::jerk(k));
            let [up, down] = self.acceleration.most[k];
            out[at] = (Register::all(simd, up) - a).into();
            out[at + 1] = (Register::all(simd, down) + a).into();
            (out[to], out[to + 1]) = ((pace - j).into(), (pace + j).into());
        }
        out[RowLayout::<M>::SPEED] = (Lanes::ONE - motion[0] * block.points[p].speed).into();
        out[RowLayout::<M>::POSITIVE] = last.into();
    }

    /// The change of the slacks for a step with this motion.
    #[inline(always)]
    pub fn slack_step<S: Simd>(
        &self,
        block: &Block<M>,
        p: usize,
        motion: [Register<S>; 3],
        pace: Register<S>,
        last: Register<S>,
        out: &mut [Lanes],
    ) {
        let axes = self.axes(block, p, motion);
        let out = &mut out[..RowLayout::<M>::COUNT];
        for k in 0..M {
            let [a, j] = axes[k];
            let (at, to) = (RowLayout::<M>::acceleration(k), RowLayout::<M>::jerk(k));
            (out[at], out[at + 1]) = ((-a).into(), a.into());
            (out[to], out[to + 1]) = ((pace - j).into(), (pace + j).into());
        }
        out[RowLayout::<M>::SPEED] = (-(motion[0] * block.points[p].speed)).into();
        out[RowLayout::<M>::POSITIVE] = last.into();
    }

    /// Σ weight ∇s ∇sᵀ over the linear parts of the rows at collocation point p of a block.
    #[inline(always)]
    pub fn curvature<S: Simd>(&self, simd: S, block: &Block<M>, p: usize, weight: &[Lanes]) -> Form<S> {
        let point = &block.points[p];
        let weight = &weight[..RowLayout::<M>::COUNT];
        let acceleration = point.acceleration.load(simd);
        let tight = acceleration * acceleration;
        let jerk = block.jerk.load(simd);
        let tight_jerk = jerk * jerk;
        let mut m = [Register::all(simd, 0.0); 6];
        m[0] = weight[RowLayout::<M>::SPEED].load(simd) * point.speed * point.speed;
        for k in 0..M {
            let [q1, q2, q3] = point.q[k].map(|q| q.load(simd));
            let (half, more) = (q1 * 0.5, q2 * 1.5);
            let at = RowLayout::<M>::acceleration(k);
            let both =
                (weight[at].load(simd) + weight[at + 1]) * tight * self.acceleration.per_mean[k].powi(2);
            let (b2, b1) = (both * q2, both * half);
            m[0] += b2 * q2;
            m[1] += b2 * half;
            m[3] += b1 * half;
            let at = RowLayout::<M>::jerk(k);
            let both = (weight[at].load(simd) + weight[at + 1]) * tight_jerk * self.per_jerk[k].powi(2);
            let (b0, b1) = (both * q3, both * more);
            m[0] += b0 * q3;
            m[1] += b0 * more;
            m[2] += b0 * half;
            m[3] += b1 * more;
            m[4] += b1 * half;
            m[5] += both * half * half;
        }
        m
    }

    /// Σ aim ∇s over the linear parts of the rows at collocation point p of a block, as a form of (w, w', w''), and Σ aim
    /// of the jerk's rows.
    #[inline(always)]
    pub fn pull<S: Simd>(
        &self,
        simd: S,
        block: &Block<M>,
        p: usize,
        aim: &[Lanes],
    ) -> ([Register<S>; 3], Register<S>) {
        let point = &block.points[p];
        let aim = &aim[..RowLayout::<M>::COUNT];
        let zero = Register::all(simd, 0.0);
        let mut g = [-(aim[RowLayout::<M>::SPEED].load(simd) * point.speed), zero, zero];
        let mut jerk = zero;
        for k in 0..M {
            let [q1, q2, q3] = point.q[k];
            let at = RowLayout::<M>::acceleration(k);
            let a = (aim[at + 1].load(simd) - aim[at]) * point.acceleration * self.acceleration.per_mean[k];
            let at = RowLayout::<M>::jerk(k);
            let j = (aim[at + 1].load(simd) - aim[at]) * block.jerk * self.per_jerk[k];
            g[0] += a * q2 + j * q3;
            g[1] += a * q1 * 0.5 + j * q2 * 1.5;
            g[2] += j * q1 * 0.5;
            jerk += aim[at].load(simd) + aim[at + 1];
        }
        (g, jerk)
    }

    /// The greatest use of the limits of speed, acceleration and jerk on each interval by a spline; 1 is at a limit.
    pub fn utilisation(&self, x: &[f64]) -> Vec<[f64; 3]> {
        dispatch!(Level::new(), simd => self.utilisation_on(simd, x))
    }

    #[inline(always)]
    pub(super) fn utilisation_on<S: Simd>(&self, simd: S, x: &[f64]) -> Vec<[f64; 3]> {
        let x = Columns::new(x);
        let mut out = vec![[0.0; 3]; self.count];
        let zero = Register::all(simd, 0.0);
        for (b, (block, out)) in self.blocks.iter().zip(out.chunks_mut(LANES)).enumerate() {
            let h = block.h.load(simd);
            let (u, per_h) = (x.local(b, h), h.inverse());
            let mut worst = [zero; 3];
            for p in 0..COUNT {
                let motion = forms::motion(p, per_h, &u);
                let v = motion[0].max(zero).sqrt();
                worst[0] = (motion[0] * block.points[p].speed).max(worst[0]);
                for (k, [a, j]) in self.axes(block, p, motion).into_iter().enumerate() {
                    let [per_up, per_down] = self.acceleration.per_most[k];
                    worst[1] = (a * per_up).max(-a * per_down).max(worst[1]);
                    worst[2] = (j * v).abs().max(worst[2]);
                }
            }
            let worst = [worst[0].sqrt(), worst[1], worst[2]].map(Register::values);
            for (lane, out) in out.iter_mut().enumerate() {
                *out = worst.map(|worst| worst[lane]);
            }
        }
        out
    }

    /// Drops the limits of speed and acceleration at ends that are given.
    pub fn drop_at_ends(&mut self, ends: &[WindowEnd; 2]) {
        let last = self.count - 1;
        for (kind, (n, p)) in ends.iter().zip([(0, 0), (last, COUNT - 1)]) {
            if let WindowEnd::Fixed { .. } = kind {
                let point = &mut self.blocks[n / LANES].points[p];
                point.speed.values_mut()[n % LANES] = 0.0;
                point.acceleration.values_mut()[n % LANES] = 0.0;
            }
        }
    }
}
