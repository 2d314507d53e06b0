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

use std::ops::Range;

use fearless_simd::{dispatch, Level, Simd};

use super::forms::Form;
use super::hermite::{self, combine, local, BEND, SLOPE, VALUE};
use super::sides::Sides;
use super::window_end::WindowEnd;
use crate::path_problem::{Geometry, Limits, PathPoint};
use feedplan_geometry::lanes::{Lanes, Register};

const INWARDS: Lanes = Lanes::new([1.0 / 3.0, 0.0, 0.0, -1.0 / 3.0]);

/// The limits on the interval between two stations.
#[derive(Clone, Copy, Debug)]
pub struct Interval<const M: usize> {
    /// Its length, in mm.
    pub h: f64,
    /// q', q'', q''' of each axis at the collocation points.
    pub q: [[Lanes; 3]; M],
    /// 1/w_max.
    pub speed: Lanes,
    /// Factor by which the acceleration limit is tighter than the machine's: 1 or more, 0 where it does not apply.
    pub acceleration: Lanes,
    /// Factor by which the jerk limit is tighter: 1 or more.
    pub jerk: f64,
}

/// The constraints on the intervals of a window.
#[derive(Clone, Debug)]
pub struct Constraints<const M: usize> {
    pub intervals: Vec<Interval<M>>,
    pub acceleration: Sides<M>,
    /// 1/J of each axis.
    pub per_jerk: [f64; M],
}

/// Indices of the rows of one interval: for each axis the upper and the lower limit of its acceleration, then of its
/// jerk; then speed, then w ≥ 0.
pub struct RowLayout<const M: usize>;

impl<const M: usize> RowLayout<M> {
    pub const SPEED: usize = 4 * M;
    pub const POSITIVE: usize = 4 * M + 1;
    pub const COUNT: usize = 4 * M + 2;

    #[inline(always)]
    pub const fn acceleration(axis: usize) -> usize {
        4 * axis
    }

    #[inline(always)]
    pub const fn jerk(axis: usize) -> usize {
        4 * axis + 2
    }

    #[inline(always)]
    pub fn of(all: &[Lanes], n: usize) -> &[Lanes] {
        &all[n * Self::COUNT..][..Self::COUNT]
    }

    #[inline(always)]
    pub fn of_mut(all: &mut [Lanes], n: usize) -> &mut [Lanes] {
        &mut all[n * Self::COUNT..][..Self::COUNT]
    }
}

impl<const M: usize> Interval<M> {
    /// The greatest r = w^(3/4) if the slope of r is at most k.
    pub fn envelope_cap(&self, limits: &Limits<M>, k: f64) -> f64 {
        let cap = |lane: usize| {
            let of = |order: usize| std::array::from_fn(|axis| self.q[axis][order].values()[lane]);
            let speed_cap = 1.0 / self.speed.values()[lane].sqrt();
            limits.envelope_cap(&PathPoint { first: of(0), second: of(1), third: of(2), speed_cap }, k)
        };
        cap(0).min(cap(1)).min(cap(2)).min(cap(3))
    }

    /// Tightens the limits of speed, acceleration and jerk by these factors.
    pub fn tighten(&mut self, [speed, acceleration, jerk]: [f64; 3]) {
        self.speed = self.speed.map(|per_w| per_w * (speed * speed));
        self.acceleration = self.acceleration.map(|tight| tight * acceleration);
        self.jerk *= jerk;
    }

    /// Steps from the ends of the interval along the tangents of w to the inner Bernstein coefficients: if these and w
    /// at the stations are above 0, w is above 0 everywhere.
    #[inline(always)]
    pub fn inwards<S: Simd>(&self, simd: S) -> Register<S> {
        INWARDS.load(simd) * self.h
    }

    /// q', q'', q''' of an axis.
    #[inline(always)]
    fn loaded<S: Simd>(&self, simd: S, axis: usize) -> [Register<S>; 3] {
        let [q1, q2, q3] = self.q[axis];
        [q1.load(simd), q2.load(simd), q3.load(simd)]
    }

    /// w, w', w'' at the collocation points.
    #[inline(always)]
    pub fn motion<S: Simd>(&self, simd: S, u: &[f64; 4]) -> [Register<S>; 3] {
        let per_h = 1.0 / self.h;
        let [value, slope, bend] = [&VALUE, &SLOPE, &BEND];
        [combine(simd, value, u), combine(simd, slope, u) * per_h, combine(simd, bend, u) * (per_h * per_h)]
    }
}

impl<const M: usize> Constraints<M> {
    /// Without intervals.
    pub fn new(limits: &Limits<M>) -> Self {
        Self {
            intervals: vec![],
            acceleration: Sides::new(&limits.acceleration),
            per_jerk: limits.jerk.map(|j| 1.0 / j),
        }
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
        self.intervals.clear();
        self.intervals.reserve(pieces.len());
        let mut last: Option<PathPoint<M>> = None;
        for n in 0..pieces.len() {
            let (start, h) = (stations[n], stations[n + 1] - stations[n]);
            let piece = pieces[n] as usize;
            let at = |part: f64| geometry.at(piece, start + part * h);
            let first = match last {
                Some(point) if n > 0 && pieces[n - 1] == pieces[n] => point,
                _ => geometry.at(piece, start),
            };
            let end = geometry.at(piece, stations[n + 1]);
            let points = [first, at(hermite::POINTS[1]), at(hermite::POINTS[2]), end];
            let mut speed = Lanes::new(points.map(|point| limits.per_speed_sq(&point)));
            for (lane, station) in [(0, n), (3, n + 1)] {
                let cap = station_cap(station);
                speed.values_mut()[lane] = speed.values()[lane].max(1.0 / (cap * cap));
            }
            let q = std::array::from_fn(|k| {
                [
                    Lanes::new(points.map(|point| point.first[k])),
                    Lanes::new(points.map(|point| point.second[k])),
                    Lanes::new(points.map(|point| point.third[k])),
                ]
            });
            self.intervals.push(Interval { h, q, speed, acceleration: Lanes::ONE, jerk: jerk_factor[n] });
            last = Some(end);
        }
    }

    /// Takes a range of the intervals of others.
    pub fn copy(&mut self, others: &Self, range: Range<usize>) {
        self.intervals.clear();
        self.intervals.extend_from_slice(&others.intervals[range]);
    }

    /// Acceleration and jerk/√w of each axis, over A and J.
    #[inline(always)]
    pub fn axes<S: Simd>(
        &self,
        interval: &Interval<M>,
        [w, w1, w2]: [Register<S>; 3],
    ) -> [[Register<S>; 2]; M] {
        let (half, bend, more) = (w1 * 0.5, w2 * 0.5, w1 * 1.5);
        let mut out = [[Register::all(w.simd(), 0.0); 2]; M];
        for k in 0..M {
            let [q1, q2, q3] = interval.q[k];
            out[k] = [
                (q2 * w + q1 * half) * self.acceleration.per_mean[k] * interval.acceleration,
                (q3 * w + q2 * more + q1 * bend) * (self.per_jerk[k] * interval.jerk),
            ];
        }
        out
    }

    /// The slacks on interval n for local coefficients u, with w^(−1/2) = `pace` and the last row as given.
    #[inline(always)]
    pub fn slack<S: Simd>(
        &self,
        n: usize,
        u: &[f64; 4],
        pace: Register<S>,
        last: Register<S>,
        out: &mut [Lanes],
    ) {
        let simd = pace.simd();
        let interval = &self.intervals[n];
        let motion = interval.motion(simd, u);
        let axes = self.axes(interval, motion);
        let out = &mut out[..RowLayout::<M>::COUNT];
        for k in 0..M {
            let [a, j] = axes[k];
            let (at, to) = (RowLayout::<M>::acceleration(k), RowLayout::<M>::jerk(k));
            let [up, down] = self.acceleration.most[k];
            out[at] = (Register::all(simd, up) - a).into();
            out[at + 1] = (Register::all(simd, down) + a).into();
            (out[to], out[to + 1]) = ((pace - j).into(), (pace + j).into());
        }
        out[RowLayout::<M>::SPEED] = (Lanes::ONE - motion[0] * interval.speed).into();
        out[RowLayout::<M>::POSITIVE] = last.into();
    }

    /// The change of the slacks for a step with local coefficients d.
    #[inline(always)]
    pub fn slack_step<S: Simd>(
        &self,
        n: usize,
        d: &[f64; 4],
        pace: Register<S>,
        last: Register<S>,
        out: &mut [Lanes],
    ) {
        let interval = &self.intervals[n];
        let motion = interval.motion(pace.simd(), d);
        let axes = self.axes(interval, motion);
        let out = &mut out[..RowLayout::<M>::COUNT];
        for k in 0..M {
            let [a, j] = axes[k];
            let (at, to) = (RowLayout::<M>::acceleration(k), RowLayout::<M>::jerk(k));
            (out[at], out[at + 1]) = ((-a).into(), a.into());
            (out[to], out[to + 1]) = ((pace - j).into(), (pace + j).into());
        }
        out[RowLayout::<M>::SPEED] = (-(motion[0] * interval.speed)).into();
        out[RowLayout::<M>::POSITIVE] = last.into();
    }

    /// Σ weight ∇s ∇sᵀ over the linear parts of the rows of interval n.
    #[inline(always)]
    pub fn curvature<S: Simd>(&self, simd: S, n: usize, weight: &[Lanes]) -> Form<S> {
        let interval = &self.intervals[n];
        let weight = &weight[..RowLayout::<M>::COUNT];
        let acceleration = interval.acceleration.load(simd);
        let tight = acceleration * acceleration;
        let mut m = [Register::all(simd, 0.0); 6];
        m[0] = weight[RowLayout::<M>::SPEED].load(simd) * interval.speed * interval.speed;
        for k in 0..M {
            let [q1, q2, q3] = interval.loaded(simd, k);
            let (half, more) = (q1 * 0.5, q2 * 1.5);
            let at = RowLayout::<M>::acceleration(k);
            let both =
                (weight[at].load(simd) + weight[at + 1]) * tight * self.acceleration.per_mean[k].powi(2);
            let (b2, b1) = (both * q2, both * half);
            m[0] += b2 * q2;
            m[1] += b2 * half;
            m[3] += b1 * half;
            let at = RowLayout::<M>::jerk(k);
            let both = (weight[at].load(simd) + weight[at + 1]) * (self.per_jerk[k] * interval.jerk).powi(2);
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

    /// Σ aim ∇s over the linear parts of the rows of interval n, as a form of (w, w', w''), and Σ aim of the jerk's
    /// rows.
    #[inline(always)]
    pub fn pull<S: Simd>(&self, simd: S, n: usize, aim: &[Lanes]) -> ([Register<S>; 3], Register<S>) {
        let interval = &self.intervals[n];
        let aim = &aim[..RowLayout::<M>::COUNT];
        let zero = Register::all(simd, 0.0);
        let mut g = [-(aim[RowLayout::<M>::SPEED].load(simd) * interval.speed), zero, zero];
        let mut jerk = zero;
        for k in 0..M {
            let [q1, q2, q3] = interval.loaded(simd, k);
            let at = RowLayout::<M>::acceleration(k);
            let a =
                (aim[at + 1].load(simd) - aim[at]) * interval.acceleration * self.acceleration.per_mean[k];
            let at = RowLayout::<M>::jerk(k);
            let j = (aim[at + 1].load(simd) - aim[at]) * (self.per_jerk[k] * interval.jerk);
            g[0] += a * q2 + j * q3;
            g[1] += a * q1 * 0.5 + j * q2 * 1.5;
            g[2] += j * q1 * 0.5;
            jerk += aim[at].load(simd) + aim[at + 1];
        }
        (g, jerk)
    }

    /// The greatest use of the limits of speed, acceleration and jerk on interval n; 1 is at a limit.
    pub fn utilisation(&self, x: &[f64], n: usize) -> [f64; 3] {
        dispatch!(Level::new(), simd => self.utilisation_on(simd, x, n))
    }

    #[inline(always)]
    pub(super) fn utilisation_on<S: Simd>(&self, simd: S, x: &[f64], n: usize) -> [f64; 3] {
        let interval = &self.intervals[n];
        let motion = interval.motion(simd, &local(x, n, interval.h));
        let v = motion[0].max(Register::all(simd, 0.0)).sqrt();
        let mut worst = [(motion[0] * interval.speed).greatest().max(0.0).sqrt(), 0.0, 0.0];
        for (k, [a, j]) in self.axes(interval, motion).into_iter().enumerate() {
            let [per_up, per_down] = self.acceleration.per_most[k];
            worst[1] = worst[1].max(a.greatest() * per_up).max(-a.least() * per_down);
            worst[2] = f64::max(worst[2], (j * v).abs().greatest());
        }
        worst
    }

    /// Drops the limits of speed and acceleration at ends that are given.
    pub fn drop_at_ends(&mut self, ends: &[WindowEnd; 2]) {
        let last = self.intervals.len() - 1;
        for (kind, (n, lane)) in ends.iter().zip([(0, 0), (last, 3)]) {
            if let WindowEnd::Fixed { .. } = kind {
                self.intervals[n].speed.values_mut()[lane] = 0.0;
                self.intervals[n].acceleration.values_mut()[lane] = 0.0;
            }
        }
    }
}
