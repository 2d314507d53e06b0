//! The limits of a stretch at its collocation points, as slacks of w = v².
//!
//! With q', q'', q''' of an axis along the path and its limits, of which the acceleration has A⁺ and A⁻, A their mean,
//!
//!   acceleration   A^±/A ∓ (q'' w + q' w'/2)/A ≥ 0
//!   jerk           w^(−1/2) ∓ (q''' w + 3/2 q'' w' + 1/2 q' w'')/J ≥ 0
//!   speed          1 − w/w_max ≥ 0,   w ≥ 0
//!
//! At the ends of an interval it is not w that is held above 0 but the inner Bernstein coefficients of the cubic, of which
//! those on both sides of a node have w between them: so w is above 0 everywhere, however little its time matters.
//!
//! The slack of the jerk is convex in w: its tangent at a valid plan is a safe inner constraint.

use fearless_simd::{dispatch, Level, Simd};

use super::hermite::{self, combine, local, BEND, SLOPE, VALUE};
use super::interior_point::Bound;
use super::model::Form;
use super::sides::Sides;
use super::{Geometry, Limits, Place};
use crate::lanes::{Lanes, Register};

const INWARDS: Lanes = Lanes::new([1.0 / 3.0, 0.0, 0.0, -1.0 / 3.0]);

/// One interval between two nodes.
#[derive(Clone, Copy, Debug)]
pub struct Interval<const M: usize> {
    /// Its length.
    pub h: f64,
    /// q', q'', q''' of each axis at the collocation points.
    pub q: [[Lanes; 3]; M],
    /// 1/w_max.
    pub speed: Lanes,
    /// How much tighter than the machine's the acceleration limit is: 1 or more, 0 where it is not asked.
    pub acceleration: Lanes,
    /// How much tighter the jerk limit is: 1 or more.
    pub jerk: f64,
}

/// Limits of a stretch of intervals.
#[derive(Clone, Debug)]
pub struct Rows<const M: usize> {
    pub intervals: Vec<Interval<M>>,
    pub acceleration: Sides<M>,
    /// 1/J of each axis.
    pub per_jerk: [f64; M],
}

/// Where the rows of an interval stand in a set of them: towards the upper and the lower limit of each axis's
/// acceleration and jerk, then speed, then w ≥ 0.
pub struct Order<const M: usize>;

impl<const M: usize> Order<M> {
    pub const SPEED: usize = 4 * M;
    pub const POSITIVE: usize = 4 * M + 1;
    /// Rows of an interval.
    pub const COUNT: usize = 4 * M + 2;

    #[inline(always)]
    pub const fn acceleration(axis: usize) -> usize {
        4 * axis
    }

    #[inline(always)]
    pub const fn jerk(axis: usize) -> usize {
        4 * axis + 2
    }

    /// The rows of interval n among those of all.
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
    /// The greatest r = w^(3/4) of an envelope that rises by k at most.
    pub fn envelope_cap(&self, limits: &Limits<M>, k: f64) -> f64 {
        let cap = |lane: usize| {
            let of = |order: usize| std::array::from_fn(|axis| self.q[axis][order].values()[lane]);
            let speed_cap = 1.0 / self.speed.values()[lane].sqrt();
            limits.envelope_cap(&Place { first: of(0), second: of(1), third: of(2), speed_cap }, k)
        };
        cap(0).min(cap(1)).min(cap(2)).min(cap(3))
    }

    /// Makes the limits of speed, acceleration and jerk tighter by these factors.
    pub fn tighten(&mut self, [speed, acceleration, jerk]: [f64; 3]) {
        self.speed = self.speed.map(|per_w| per_w * (speed * speed));
        self.acceleration = self.acceleration.map(|tight| tight * acceleration);
        self.jerk *= jerk;
    }

    /// The steps from the ends of the interval to where the tangents of w are its inner Bernstein coefficients: with those
    /// and w at the nodes above 0 so is w everywhere between.
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

impl<const M: usize> Rows<M> {
    /// The limits between `nodes`; interval n lies on `pieces[n]`, its limits of jerk are `calm[n]` times as tight;
    /// `node_cap` is a greatest speed at a node, infinite where there is none.
    pub fn sample(
        geometry: &impl Geometry<M>,
        limits: &Limits<M>,
        nodes: &[f64],
        pieces: &[u32],
        calm: &[f64],
        node_cap: impl Fn(usize) -> f64,
    ) -> Self {
        let mut intervals = Vec::with_capacity(pieces.len());
        let mut last: Option<Place<M>> = None;
        for n in 0..pieces.len() {
            let (start, h) = (nodes[n], nodes[n + 1] - nodes[n]);
            let piece = pieces[n] as usize;
            let at = |part: f64| geometry.at(piece, start + part * h);
            let first = match last {
                Some(place) if n > 0 && pieces[n - 1] == pieces[n] => place,
                _ => geometry.at(piece, start),
            };
            let end = geometry.at(piece, nodes[n + 1]);
            let places = [first, at(hermite::POINTS[1]), at(hermite::POINTS[2]), end];
            let mut speed = Lanes::new(places.map(|place| limits.per_speed_sq(&place)));
            for (lane, node) in [(0, n), (3, n + 1)] {
                let cap = node_cap(node);
                speed.values_mut()[lane] = speed.values()[lane].max(1.0 / (cap * cap));
            }
            let q = std::array::from_fn(|k| {
                [
                    Lanes::new(places.map(|place| place.first[k])),
                    Lanes::new(places.map(|place| place.second[k])),
                    Lanes::new(places.map(|place| place.third[k])),
                ]
            });
            intervals.push(Interval { h, q, speed, acceleration: Lanes::ONE, jerk: calm[n] });
            last = Some(end);
        }
        Self {
            intervals,
            acceleration: Sides::new(&limits.acceleration),
            per_jerk: limits.jerk.map(|j| 1.0 / j),
        }
    }

    /// Acceleration and jerk/√w of each axis in parts of A and J.
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

    /// The slacks on interval n for local coefficients u: the jerk's below `pace`, the last one `last`.
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
        let out = &mut out[..Order::<M>::COUNT];
        for k in 0..M {
            let [a, j] = axes[k];
            let (at, to) = (Order::<M>::acceleration(k), Order::<M>::jerk(k));
            let [up, down] = self.acceleration.most[k];
            out[at] = (Register::all(simd, up) - a).into();
            out[at + 1] = (Register::all(simd, down) + a).into();
            (out[to], out[to + 1]) = ((pace - j).into(), (pace + j).into());
        }
        out[Order::<M>::SPEED] = (Lanes::ONE - motion[0] * interval.speed).into();
        out[Order::<M>::POSITIVE] = last.into();
    }

    /// Their change for a step with local coefficients d.
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
        let out = &mut out[..Order::<M>::COUNT];
        for k in 0..M {
            let [a, j] = axes[k];
            let (at, to) = (Order::<M>::acceleration(k), Order::<M>::jerk(k));
            (out[at], out[at + 1]) = ((-a).into(), a.into());
            (out[to], out[to + 1]) = ((pace - j).into(), (pace + j).into());
        }
        out[Order::<M>::SPEED] = (-(motion[0] * interval.speed)).into();
        out[Order::<M>::POSITIVE] = last.into();
    }

    /// Σ weight ∇s ∇sᵀ over what is linear in the rows of interval n.
    #[inline(always)]
    pub fn curvature<S: Simd>(&self, simd: S, n: usize, weight: &[Lanes]) -> Form<S> {
        let interval = &self.intervals[n];
        let weight = &weight[..Order::<M>::COUNT];
        let acceleration = interval.acceleration.load(simd);
        let tight = acceleration * acceleration;
        let mut m = [Register::all(simd, 0.0); 6];
        m[0] = weight[Order::<M>::SPEED].load(simd) * interval.speed * interval.speed;
        for k in 0..M {
            let [q1, q2, q3] = interval.loaded(simd, k);
            let (half, more) = (q1 * 0.5, q2 * 1.5);
            let at = Order::<M>::acceleration(k);
            let both =
                (weight[at].load(simd) + weight[at + 1]) * tight * self.acceleration.per_mean[k].powi(2);
            let (b2, b1) = (both * q2, both * half);
            m[0] += b2 * q2;
            m[1] += b2 * half;
            m[3] += b1 * half;
            let at = Order::<M>::jerk(k);
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

    /// Σ aim ∇s over what is linear in the rows of interval n, as a form of (w, w', w''); Σ aim of the jerks' rows.
    #[inline(always)]
    pub fn pull<S: Simd>(&self, simd: S, n: usize, aim: &[Lanes]) -> ([Register<S>; 3], Register<S>) {
        let interval = &self.intervals[n];
        let aim = &aim[..Order::<M>::COUNT];
        let zero = Register::all(simd, 0.0);
        let mut g = [-(aim[Order::<M>::SPEED].load(simd) * interval.speed), zero, zero];
        let mut jerk = zero;
        for k in 0..M {
            let [q1, q2, q3] = interval.loaded(simd, k);
            let at = Order::<M>::acceleration(k);
            let a =
                (aim[at + 1].load(simd) - aim[at]) * interval.acceleration * self.acceleration.per_mean[k];
            let at = Order::<M>::jerk(k);
            let j = (aim[at + 1].load(simd) - aim[at]) * (self.per_jerk[k] * interval.jerk);
            g[0] += a * q2 + j * q3;
            g[1] += a * q1 * 0.5 + j * q2 * 1.5;
            g[2] += j * q1 * 0.5;
            jerk += aim[at].load(simd) + aim[at + 1];
        }
        (g, jerk)
    }

    /// The greatest uses of the limits on interval n: of speed, acceleration and jerk, 1 at a limit.
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

    /// Speed and acceleration at given ends are what they are.
    pub fn waive(&mut self, bounds: &[Bound; 2]) {
        let last = self.intervals.len() - 1;
        for (bound, (n, lane)) in bounds.iter().zip([(0, 0), (last, 3)]) {
            if let Bound::Fixed { .. } = bound {
                self.intervals[n].speed.values_mut()[lane] = 0.0;
                self.intervals[n].acceleration.values_mut()[lane] = 0.0;
            }
        }
    }
}
