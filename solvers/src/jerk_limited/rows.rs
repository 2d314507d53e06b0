//! The limits of a stretch at its collocation points, as slacks of w = v².
//!
//! With q', q'', q''' of an axis along the path, in parts of its limits,
//!
//!   acceleration   1 ∓ (q'' w + q' w'/2)/A ≥ 0
//!   jerk           w^(−1/2) ∓ (q''' w + 3/2 q'' w' + 1/2 q' w'')/J ≥ 0
//!   speed          1 − w/w_max ≥ 0,   w ≥ 0
//!
//! The slack of the jerk is convex in w: its tangent at a valid plan is a safe inner constraint.

use super::hermite::{self, combine, local, BEND, SLOPE, VALUE};
use super::lanes::Lanes;
use super::{Geometry, Limits, Place};

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
    /// 1/A and 1/J of each axis.
    pub per_acceleration: [f64; M],
    pub per_jerk: [f64; M],
}

/// One value for each row of an interval: slacks, multipliers or steps of them.
#[derive(Clone, Copy, Debug)]
pub struct RowSet<const M: usize> {
    /// Towards the upper and towards the lower limit.
    pub acceleration: [[Lanes; 2]; M],
    pub jerk: [[Lanes; 2]; M],
    pub speed: Lanes,
    pub positive: Lanes,
}

impl<const M: usize> RowSet<M> {
    pub const ONE: Self = Self {
        acceleration: [[Lanes::ONE; 2]; M],
        jerk: [[Lanes::ONE; 2]; M],
        speed: Lanes::ONE,
        positive: Lanes::ONE,
    };

    /// Rows of one collocation point of an interval, all axes.
    pub const COUNT: usize = 4 * M + 2;

    /// f of each row.
    #[inline(always)]
    pub fn map(&self, f: impl Fn(Lanes) -> Lanes) -> Self {
        let mut out = *self;
        for k in 0..M {
            for side in 0..2 {
                out.acceleration[k][side] = f(self.acceleration[k][side]);
                out.jerk[k][side] = f(self.jerk[k][side]);
            }
        }
        out.speed = f(self.speed);
        out.positive = f(self.positive);
        out
    }

    /// f of each row of two sets.
    #[inline(always)]
    pub fn zip(&self, other: &Self, mut f: impl FnMut(Lanes, Lanes) -> Lanes) -> Self {
        let mut out = *self;
        for k in 0..M {
            for side in 0..2 {
                out.acceleration[k][side] = f(self.acceleration[k][side], other.acceleration[k][side]);
                out.jerk[k][side] = f(self.jerk[k][side], other.jerk[k][side]);
            }
        }
        out.speed = f(self.speed, other.speed);
        out.positive = f(self.positive, other.positive);
        out
    }

    /// f of each row of three sets.
    #[inline(always)]
    pub fn zip3(&self, b: &Self, c: &Self, mut f: impl FnMut(Lanes, Lanes, Lanes) -> Lanes) -> Self {
        let mut out = *self;
        for k in 0..M {
            for side in 0..2 {
                out.acceleration[k][side] =
                    f(self.acceleration[k][side], b.acceleration[k][side], c.acceleration[k][side]);
                out.jerk[k][side] = f(self.jerk[k][side], b.jerk[k][side], c.jerk[k][side]);
            }
        }
        out.speed = f(self.speed, b.speed, c.speed);
        out.positive = f(self.positive, b.positive, c.positive);
        out
    }
}

impl<const M: usize> Interval<M> {
    /// The greatest r = w^(3/4) of an envelope that rises by k at most.
    pub fn envelope_cap(&self, limits: &Limits<M>, k: f64) -> f64 {
        let cap = |lane: usize| {
            let of = |order: usize| std::array::from_fn(|axis| self.q[axis][order].0[lane]);
            let speed_cap = 1.0 / self.speed.0[lane].sqrt();
            limits.envelope_cap(&Place { first: of(0), second: of(1), third: of(2), speed_cap }, k)
        };
        cap(0).min(cap(1)).min(cap(2)).min(cap(3))
    }

    /// Makes the limits of speed, acceleration and jerk tighter by these factors.
    pub fn tighten(&mut self, [speed, acceleration, jerk]: [f64; 3]) {
        self.speed = self.speed * (speed * speed);
        self.acceleration = self.acceleration * acceleration;
        self.jerk *= jerk;
    }

    /// w, w', w'' at the collocation points.
    #[inline(always)]
    pub fn motion(&self, u: &[f64; 4]) -> [Lanes; 3] {
        let per_h = 1.0 / self.h;
        [combine(&VALUE, u), combine(&SLOPE, u) * per_h, combine(&BEND, u) * (per_h * per_h)]
    }
}

impl<const M: usize> Rows<M> {
    /// The limits between `nodes`; interval n lies on `pieces[n]`, `node_cap` is a greatest speed at a node, infinite
    /// where there is none.
    pub fn sample(
        geometry: &impl Geometry<M>,
        limits: &Limits<M>,
        nodes: &[f64],
        pieces: &[u32],
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
            let mut speed = Lanes(places.map(|place| limits.per_speed_sq(&place)));
            for (lane, node) in [(0, n), (3, n + 1)] {
                let cap = node_cap(node);
                speed.0[lane] = speed.0[lane].max(1.0 / (cap * cap));
            }
            let q = std::array::from_fn(|k| {
                [
                    Lanes(places.map(|place| place.first[k])),
                    Lanes(places.map(|place| place.second[k])),
                    Lanes(places.map(|place| place.third[k])),
                ]
            });
            intervals.push(Interval { h, q, speed, acceleration: Lanes::ONE, jerk: 1.0 });
            last = Some(end);
        }
        Self {
            intervals,
            per_acceleration: limits.acceleration.map(|a| 1.0 / a),
            per_jerk: limits.jerk.map(|j| 1.0 / j),
        }
    }

    /// Acceleration and jerk/√w of each axis in parts of the limits.
    #[inline(always)]
    pub fn axes(&self, interval: &Interval<M>, [w, w1, w2]: [Lanes; 3]) -> [[Lanes; 2]; M] {
        let (half, bend, more) = (w1 * 0.5, w2 * 0.5, w1 * 1.5);
        let mut out = [[Lanes::ZERO; 2]; M];
        for k in 0..M {
            let [q1, q2, q3] = interval.q[k];
            out[k] = [
                (q2 * w + q1 * half) * self.per_acceleration[k] * interval.acceleration,
                (q3 * w + q2 * more + q1 * bend) * (self.per_jerk[k] * interval.jerk),
            ];
        }
        out
    }

    /// The slacks on interval n for local coefficients u, and w^(−1/2).
    #[inline(always)]
    pub fn slack(&self, n: usize, u: &[f64; 4]) -> (RowSet<M>, Lanes) {
        let interval = &self.intervals[n];
        let motion = interval.motion(u);
        let axes = self.axes(interval, motion);
        let w = motion[0];
        let pace = w.max(Lanes::all(f64::MIN_POSITIVE)).sqrt().inverse();
        let mut out = RowSet::ONE;
        for k in 0..M {
            let [a, j] = axes[k];
            out.acceleration[k] = [Lanes::ONE - a, Lanes::ONE + a];
            out.jerk[k] = [pace - j, pace + j];
        }
        out.speed = Lanes::ONE - w * interval.speed;
        out.positive = w;
        (out, pace)
    }

    /// The change of the slacks for a step with local coefficients d, the jerk's along its tangent; `fall` is
    /// w^(−3/2)/2.
    #[inline(always)]
    pub fn slack_step(&self, n: usize, d: &[f64; 4], fall: Lanes) -> RowSet<M> {
        let interval = &self.intervals[n];
        let motion = interval.motion(d);
        let axes = self.axes(interval, motion);
        let w = motion[0];
        let pace = -(fall * w);
        let mut out = RowSet::ONE;
        for k in 0..M {
            let [a, j] = axes[k];
            out.acceleration[k] = [-a, a];
            out.jerk[k] = [pace - j, pace + j];
        }
        out.speed = -(w * interval.speed);
        out.positive = w;
        out
    }

    /// The greatest uses of the limits on interval n: of speed, acceleration and jerk, 1 at a limit.
    pub fn utilisation(&self, x: &[f64], n: usize) -> [f64; 3] {
        let interval = &self.intervals[n];
        let motion = interval.motion(&local(x, n, interval.h));
        let v = motion[0].max(Lanes::ZERO).sqrt();
        let mut worst = [(motion[0] * interval.speed).greatest().max(0.0).sqrt(), 0.0, 0.0];
        for [a, j] in self.axes(interval, motion) {
            worst[1] = f64::max(worst[1], a.abs().greatest());
            worst[2] = f64::max(worst[2], (j * v).abs().greatest());
        }
        worst
    }
}
