//! The limits on a window at its collocation points, as slacks of w = v², from the axes' derivatives by arc length.
//!
//! With q', q'', q''' of an axis, its limits A⁺ and A⁻ of acceleration, their mean A, and its limit J of jerk,
//!
//!   acceleration   A^±/A ∓ (q'' w + q' w'/2)/A ≥ 0
//!   jerk           w^(−1/2) ∓ (q''' w + 3/2 q'' w' + 1/2 q' w'')/J ≥ 0
//!   speed          1 − w/w_max ≥ 0,   w ≥ 0
//!
//! At the two ends of an interval the last row keeps the inner Bernstein coefficient of the cubic next to that end above 0,
//! instead of w. w at a station lies between the coefficients on both sides of it, so that w is above 0 everywhere.
//!
//! The slack of the jerk is convex in w: a constraint on its tangent at a valid plan is a safe inner constraint.
//!
//! A block holds the limits of eight neighbouring intervals in the lanes of SIMD vectors. Lanes beyond the last interval have no
//! limits and contribute nothing to sums.

use std::ops::Range;

use fearless_simd::{dispatch, Level, Simd};

use super::columns::Columns;
use super::forms::{self, Form};
use super::hermite::{COUNT, LAST, POINTS};
use super::sides::Sides;
use super::window_end::WindowEnd;
use crate::path_problem::{Geometry, Limits, PathPoint};
use feedplan_geometry::lanes::eight::{Lanes, Register, LANES};

/// Step from a collocation point along the tangent of w that leads to an inner Bernstein coefficient, as a fraction of the
/// interval; 0 where w itself is used.
const INWARDS: [f64; COUNT] = [1.0 / 3.0, 0.0, 0.0, -1.0 / 3.0];

/// The limits on eight neighbouring intervals. The derivatives of the axes are in `Constraints`.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// The lengths of the intervals, in mm.
    pub h: Lanes,
    /// Factor by which the jerk limit is tighter than the machine's: 1 or more.
    pub jerk: Lanes,
    pub points: [Point; COUNT],
    /// 1 for each interval, 0 for each lane beyond the last one.
    pub live: Lanes,
}

/// The limits at one collocation point of each of the eight intervals.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// 1/w_max by all limits on the speed, in s²/mm².
    pub speed: Lanes,
    /// 1/w_max by the speed cap of the path alone, in s²/mm².
    pub cap: Lanes,
    /// Factor by which the acceleration limit is tighter than the machine's: 1 or more, 0 where it does not apply.
    pub acceleration: Lanes,
}

/// The constraints on the intervals of a window.
#[derive(Clone, Debug)]
pub struct Constraints {
    count: usize,
    pub blocks: Vec<Block>,
    /// The axes that move, by their numbers in the problem. All other lists of axes follow this one.
    pub axes: Vec<usize>,
    /// q', q'', q''' of each axis at each collocation point of each block.
    q: Vec<[Lanes; 3]>,
    pub acceleration: Vec<Sides>,
    /// 1/J of each axis.
    pub per_jerk: Vec<f64>,
    /// Whether the acceleration limits have rows. On most windows the acceleration stays far below its limits, and the rows are
    /// left out.
    pub accelerates: bool,
}

/// Indices of the rows at one collocation point: for each axis the upper and the lower limit of its jerk, then speed, then
/// w ≥ 0, then for each axis the upper and the lower limit of its acceleration, if it has rows.
#[derive(Clone, Copy, Debug)]
pub struct RowLayout {
    axes: usize,
    accelerates: bool,
}

impl RowLayout {
    /// Rows per axis: one for its upper limit, one for its lower limit.
    pub const PAIR: usize = 2;

    #[inline(always)]
    pub const fn speed(self) -> usize {
        Self::PAIR * self.axes
    }

    #[inline(always)]
    pub const fn positive(self) -> usize {
        self.speed() + 1
    }

    /// The first row of acceleration.
    #[inline(always)]
    pub const fn acceleration(self) -> usize {
        self.speed() + 2
    }

    #[inline(always)]
    pub const fn count(self) -> usize {
        self.acceleration() + if self.accelerates { Self::PAIR * self.axes } else { 0 }
    }

    /// Rows of an interval at all collocation points; also the number of row vectors of a block.
    #[inline(always)]
    pub const fn all(self) -> usize {
        COUNT * self.count()
    }

    /// The rows of a block at collocation point p.
    #[inline(always)]
    pub fn of(self, all: &[Lanes], block: usize, p: usize) -> &[Lanes] {
        &all[(block * COUNT + p) * self.count()..][..self.count()]
    }

    #[inline(always)]
    pub fn of_mut(self, all: &mut [Lanes], block: usize, p: usize) -> &mut [Lanes] {
        &mut all[(block * COUNT + p) * self.count()..][..self.count()]
    }

    /// The rows of jerk and the rows of acceleration at a collocation point, each in pairs of upper and lower limit.
    #[inline(always)]
    pub fn pairs(self, rows: &[Lanes]) -> [std::slice::ChunksExact<'_, Lanes>; 2] {
        [&rows[..self.speed()], &rows[self.acceleration()..]].map(|rows| rows.chunks_exact(Self::PAIR))
    }

    #[inline(always)]
    pub fn pairs_mut(self, rows: &mut [Lanes]) -> [std::slice::ChunksExactMut<'_, Lanes>; 2] {
        let (jerk, rest) = rows.split_at_mut(self.speed());
        let acceleration = &mut rest[self.acceleration() - self.speed()..];
        [jerk, acceleration].map(|rows| rows.chunks_exact_mut(Self::PAIR))
    }
}

impl Block {
    /// A block without intervals: lanes of length 1 mm, without limits.
    const NONE: Self = Self {
        h: Lanes::ONE,
        jerk: Lanes::ONE,
        points: [Point { speed: Lanes::ZERO, cap: Lanes::ZERO, acceleration: Lanes::ZERO }; COUNT],
        live: Lanes::ZERO,
    };

    /// Steps in mm from collocation point p along the tangent of w to the inner Bernstein coefficients: if these and w at the
    /// stations are above 0, w is above 0 everywhere.
    #[inline(always)]
    pub fn inwards<S: Simd>(&self, simd: S, p: usize) -> Register<S> {
        self.h.load(simd) * INWARDS[p]
    }
}

impl Constraints {
    /// Constraints for the limits of the axes that move, without intervals.
    pub fn new<const M: usize>(limits: &Limits<M>, moves: &[bool; M]) -> Self {
        let axes: Vec<usize> = (0..M).filter(|&k| moves[k]).collect();
        let sides = Sides::of(&limits.acceleration);
        Self {
            count: 0,
            blocks: vec![],
            q: vec![],
            acceleration: axes.iter().map(|&k| sides[k]).collect(),
            per_jerk: axes.iter().map(|&k| 1.0 / limits.jerk[k]).collect(),
            axes,
            accelerates: true,
        }
    }

    /// The number of axes that move.
    #[inline(always)]
    pub fn axes(&self) -> usize {
        self.axes.len()
    }

    #[inline(always)]
    pub fn layout(&self) -> RowLayout {
        RowLayout { axes: self.axes(), accelerates: self.accelerates }
    }

    /// q', q'', q''' of each axis at collocation point p of a block.
    #[inline(always)]
    pub fn q(&self, block: usize, p: usize) -> &[[Lanes; 3]] {
        &self.q[(block * COUNT + p) * self.axes()..][..self.axes()]
    }

    /// The number of intervals.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The length of an interval, in mm.
    pub fn h(&self, n: usize) -> f64 {
        self.blocks[n / LANES].h.values()[n % LANES]
    }

    /// The factor by which the jerk limit of an interval is tighter than the machine's.
    pub fn jerk(&self, n: usize) -> f64 {
        self.blocks[n / LANES].jerk.values()[n % LANES]
    }

    /// 1/w_max at a collocation point of an interval.
    pub fn speed(&self, n: usize, p: usize) -> f64 {
        self.blocks[n / LANES].points[p].speed.values()[n % LANES]
    }

    /// q', q'', q''' of an axis at a collocation point of an interval.
    pub fn derivatives(&self, n: usize, p: usize, axis: usize) -> [f64; 3] {
        self.q(n / LANES, p)[axis].map(|lanes| lanes.values()[n % LANES])
    }

    /// The greatest r = w^(3/4) that the limits allow on an interval if |dr/ds| is at most k.
    pub fn envelope_cap<const M: usize>(&self, n: usize, limits: &Limits<M>, k: f64) -> f64 {
        let cap = |p: usize| {
            let [mut first, mut second, mut third] = [[0.0; M]; 3];
            for (i, &axis) in self.axes.iter().enumerate() {
                [first[axis], second[axis], third[axis]] = self.derivatives(n, p, i);
            }
            let speed_cap = 1.0 / self.speed(n, p).sqrt();
            limits.envelope_cap(&PathPoint { first, second, third, speed_cap }, k)
        };
        cap(0).min(cap(1)).min(cap(2)).min(cap(3))
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

    /// Lowers w_max at a collocation point of an interval to w, if w is less. A limit that was dropped (1/w_max = 0) stays
    /// dropped.
    pub fn lower(&mut self, n: usize, p: usize, w: f64) {
        let per_w = &mut self.blocks[n / LANES].points[p].speed.values_mut()[n % LANES];
        if *per_w > 0.0 {
            *per_w = per_w.max(1.0 / w);
        }
    }

    /// Removes all intervals and reserves memory for `room` intervals.
    pub fn clear(&mut self, room: usize) {
        let blocks = room.div_ceil(LANES);
        self.count = 0;
        self.blocks.clear();
        self.blocks.reserve(blocks);
        self.q.clear();
        self.q.reserve(blocks * COUNT * self.axes());
    }

    /// Constraints with the same limits of the axes but without intervals; memory for `room` intervals is reserved.
    pub fn emptied(&self, room: usize) -> Self {
        let (axes, acceleration, per_jerk) =
            (self.axes.clone(), self.acceleration.clone(), self.per_jerk.clone());
        let mut empty = Self { blocks: vec![], q: vec![], axes, acceleration, per_jerk, ..*self };
        empty.clear(room);
        empty
    }

    /// Appends an interval of length h in mm, with its factor of the jerk limit and without other limits.
    pub fn push(&mut self, h: f64, jerk: f64) {
        let (b, lane) = (self.count / LANES, self.count % LANES);
        if lane == 0 {
            self.blocks.push(Block::NONE);
            self.q.resize((b + 1) * COUNT * self.axes(), [Lanes::ZERO; 3]);
        }
        let block = &mut self.blocks[b];
        for (lanes, value) in [(&mut block.h, h), (&mut block.jerk, jerk), (&mut block.live, 1.0)] {
            lanes.values_mut()[lane] = value;
        }
        self.count += 1;
    }

    /// Sets the limits at collocation point p of the last interval: 1/w_max by all limits and by the speed cap of the path alone,
    /// the factor of the acceleration limit, and q', q'', q''' of each axis.
    pub fn set(
        &mut self,
        p: usize,
        [speed, cap]: [f64; 2],
        acceleration: f64,
        q: impl Fn(usize) -> [f64; 3],
    ) {
        let (b, lane, axes) = ((self.count - 1) / LANES, (self.count - 1) % LANES, self.axes());
        let own = &mut self.blocks[b].points[p];
        let values = [(&mut own.speed, speed), (&mut own.cap, cap), (&mut own.acceleration, acceleration)];
        for (lanes, value) in values {
            lanes.values_mut()[lane] = value;
        }
        for (axis, of_axis) in self.q[(b * COUNT + p) * axes..][..axes].iter_mut().enumerate() {
            for (lanes, value) in of_axis.iter_mut().zip(q(axis)) {
                lanes.values_mut()[lane] = value;
            }
        }
    }

    /// Appends an interval of length h in mm. Its limits at collocation point p are those of `others` at `from[p]`, a pair of
    /// interval and collocation point.
    pub fn push_from(&mut self, others: &Self, h: f64, jerk: f64, from: [(usize, usize); COUNT]) {
        self.push(h, jerk);
        for (p, (n, at)) in from.into_iter().enumerate() {
            let Point { speed, cap, acceleration } = &others.blocks[n / LANES].points[at];
            let [speed, cap, acceleration] =
                [speed, cap, acceleration].map(|lanes| lanes.values()[n % LANES]);
            self.set(p, [speed, cap], acceleration, |axis| others.derivatives(n, at, axis));
        }
    }

    /// Replaces all intervals by those between `stations` (arc lengths in mm). Interval n lies on `pieces[n]`, and its jerk limit
    /// is tightened by `jerk_factor[n]`. `station_cap` is the additional speed cap at a station in mm/s, infinite if it has none.
    pub fn sample<const M: usize>(
        &mut self,
        geometry: &dyn Geometry<M>,
        limits: &Limits<M>,
        stations: &[f64],
        pieces: &[u32],
        jerk_factor: &[f64],
        station_cap: impl Fn(usize) -> f64,
    ) {
        self.clear(pieces.len());
        self.accelerates = true;
        let axes = self.axes.clone();
        for (n, &piece) in pieces.iter().enumerate() {
            let (start, end) = (stations[n], stations[n + 1]);
            let h = end - start;
            let lengths = [start, start + POINTS[1] * h, start + POINTS[2] * h, end];
            let points = geometry.at_four(piece as usize, lengths);
            self.push(h, jerk_factor[n]);
            for p in 0..COUNT {
                let point = points.point(p);
                let cap = match p {
                    0 => station_cap(n),
                    LAST => station_cap(n + 1),
                    _ => f64::INFINITY,
                };
                let speed = limits.per_speed_sq(&point).max(1.0 / (cap * cap));
                let of_path = 1.0 / (point.speed_cap * point.speed_cap);
                let derivatives = |k: usize| [point.first[k], point.second[k], point.third[k]];
                self.set(p, [speed, of_path], 1.0, |i| derivatives(axes[i]));
            }
        }
    }

    /// Replaces all intervals by a range of the intervals of `others`.
    pub fn copy(&mut self, others: &Self, range: Range<usize>) {
        // If the range starts at a block boundary of `others`, its full blocks are copied as they are.
        let whole = if range.start.is_multiple_of(LANES) { range.len() / LANES } else { 0 };
        let (first, q) = (range.start / LANES, COUNT * self.axes());
        self.clear(range.len());
        self.accelerates = others.accelerates;
        self.blocks.extend_from_slice(&others.blocks[first..][..whole]);
        self.q.extend_from_slice(&others.q[first * q..][..whole * q]);
        self.count = whole * LANES;
        for n in range.start + self.count..range.end {
            self.push_from(others, others.h(n), others.jerk(n), [0, 1, 2, 3].map(|p| (n, p)));
        }
    }

    /// The acceleration of an axis at collocation point p of a block, divided by its (tightened) mean limit A.
    #[inline(always)]
    fn acceleration<S: Simd>(
        &self,
        block: usize,
        p: usize,
        k: usize,
        [w, w1, _]: [Register<S>; 3],
    ) -> Register<S> {
        let [q1, q2, _] = self.q(block, p)[k];
        let tight = self.blocks[block].points[p].acceleration;
        (q2 * w + q1 * (w1 * 0.5)) * self.acceleration[k].per_mean * tight
    }

    /// The jerk/√w of an axis at collocation point p of a block, divided by its (tightened) limit J.
    #[inline(always)]
    pub fn jerk_of<S: Simd>(
        &self,
        block: usize,
        p: usize,
        k: usize,
        [w, w1, w2]: [Register<S>; 3],
    ) -> Register<S> {
        let [q1, q2, q3] = self.q(block, p)[k];
        (q3 * w + q2 * (w1 * 1.5) + q1 * (w2 * 0.5)) * self.per_jerk[k] * self.blocks[block].jerk
    }

    /// The slacks at collocation point p of a block. `pace` is w^(−1/2) (or the variable in its place), `last` the slack of the
    /// row w ≥ 0.
    #[inline(always)]
    pub fn slack<S: Simd>(
        &self,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        pace: Register<S>,
        last: Register<S>,
        out: &mut [Lanes],
    ) {
        let (simd, layout) = (pace.simd(), self.layout());
        let [jerk, acceleration] = layout.pairs_mut(out);
        for (k, rows) in jerk.enumerate() {
            let j = self.jerk_of(block, p, k, motion);
            (rows[0], rows[1]) = ((pace - j).into(), (pace + j).into());
        }
        for (k, rows) in acceleration.enumerate() {
            let a = self.acceleration(block, p, k, motion);
            let [up, down] = self.acceleration[k].most;
            rows[0] = (Register::all(simd, up) - a).into();
            rows[1] = (Register::all(simd, down) + a).into();
        }
        out[layout.speed()] = (Lanes::ONE - motion[0] * self.blocks[block].points[p].speed).into();
        out[layout.positive()] = last.into();
    }

    /// The change of the slacks for a step of (w, w', w'') by `motion`, of w^(−1/2) by `pace` and of the row w ≥ 0 by `last`.
    #[inline(always)]
    pub fn slack_step<S: Simd>(
        &self,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        pace: Register<S>,
        last: Register<S>,
        out: &mut [Lanes],
    ) {
        let layout = self.layout();
        let [jerk, acceleration] = layout.pairs_mut(out);
        for (k, rows) in jerk.enumerate() {
            let j = self.jerk_of(block, p, k, motion);
            (rows[0], rows[1]) = ((pace - j).into(), (pace + j).into());
        }
        for (k, rows) in acceleration.enumerate() {
            let a = self.acceleration(block, p, k, motion);
            (rows[0], rows[1]) = ((-a).into(), a.into());
        }
        out[layout.speed()] = (-(motion[0] * self.blocks[block].points[p].speed)).into();
        out[layout.positive()] = last.into();
    }

    /// Σ weight ∇s ∇sᵀ at collocation point p of a block, over the parts of the rows of jerk, speed and acceleration that are
    /// linear in (w, w', w'').
    #[inline(always)]
    pub fn curvature<S: Simd>(&self, simd: S, block: usize, p: usize, weight: &[Lanes]) -> Form<S> {
        let (own, layout) = (&self.blocks[block], self.layout());
        let point = &own.points[p];
        let acceleration = point.acceleration.load(simd);
        let tight = acceleration * acceleration;
        let jerk = own.jerk.load(simd);
        let tight_jerk = jerk * jerk;
        let mut m = [Register::all(simd, 0.0); 6];
        m[0] = weight[layout.speed()].load(simd) * point.speed * point.speed;
        let [jerks, accelerations] = layout.pairs(weight);
        for ((weight, q), per) in jerks.zip(self.q(block, p)).zip(&self.per_jerk) {
            let [q1, q2, q3] = q.map(|q| q.load(simd));
            let (half, more) = (q1 * 0.5, q2 * 1.5);
            let both = (weight[0].load(simd) + weight[1]) * tight_jerk * (per * per);
            let (b0, b1) = (both * q3, both * more);
            m[0] += b0 * q3;
            m[1] += b0 * more;
            m[2] += b0 * half;
            m[3] += b1 * more;
            m[4] += b1 * half;
            m[5] += both * half * half;
        }
        for ((weight, q), Sides { per_mean: per, .. }) in
            accelerations.zip(self.q(block, p)).zip(&self.acceleration)
        {
            let [q1, q2, _] = q.map(|q| q.load(simd));
            let half = q1 * 0.5;
            let both = (weight[0].load(simd) + weight[1]) * tight * (per * per);
            let (b2, b1) = (both * q2, both * half);
            m[0] += b2 * q2;
            m[1] += b2 * half;
            m[3] += b1 * half;
        }
        m
    }

    /// Σ aim ∇s at collocation point p of a block, over the parts of the rows of jerk, speed and acceleration that are linear in
    /// (w, w', w''), as coefficients of these; and Σ aim of the rows of jerk.
    #[inline(always)]
    pub fn pull<S: Simd>(
        &self,
        simd: S,
        block: usize,
        p: usize,
        aim: &[Lanes],
    ) -> ([Register<S>; 3], Register<S>) {
        let (own, layout) = (&self.blocks[block], self.layout());
        let point = &own.points[p];
        let zero = Register::all(simd, 0.0);
        let mut g = [-(aim[layout.speed()].load(simd) * point.speed), zero, zero];
        let mut jerk = zero;
        let [jerks, accelerations] = layout.pairs(aim);
        for ((aim, &[q1, q2, q3]), per_jerk) in jerks.zip(self.q(block, p)).zip(&self.per_jerk) {
            let j = (aim[1].load(simd) - aim[0]) * own.jerk * *per_jerk;
            g[0] += j * q3;
            g[1] += j * q2 * 1.5;
            g[2] += j * q1 * 0.5;
            jerk += aim[0].load(simd) + aim[1];
        }
        for ((aim, &[q1, q2, _]), limit) in accelerations.zip(self.q(block, p)).zip(&self.acceleration) {
            let a = (aim[1].load(simd) - aim[0]) * point.acceleration * limit.per_mean;
            g[0] += a * q2;
            g[1] += a * q1 * 0.5;
        }
        (g, jerk)
    }

    /// The greatest use of the limits of speed, acceleration and jerk by the spline x on each interval; 1 is at a limit.
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
            let (u, per_h) = (x.local(b, h, block.live), h.inverse());
            let mut worst = [zero; 3];
            for p in 0..COUNT {
                let motion = forms::motion(p, per_h, &u);
                let v = motion[0].max(zero).sqrt();
                worst[0] = (motion[0] * block.points[p].speed).max(worst[0]);
                for (k, limit) in self.acceleration.iter().enumerate() {
                    let (a, j) = (self.acceleration(b, p, k, motion), self.jerk_of(b, p, k, motion));
                    let [per_up, per_down] = limit.per_most;
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

    /// Drops the limits of speed and acceleration at the ends whose state (w, w') is given.
    pub fn drop_at_ends(&mut self, ends: &[WindowEnd; 2]) {
        let last = self.count - 1;
        for (kind, (n, p)) in ends.iter().zip([(0, 0), (last, LAST)]) {
            if let WindowEnd::Fixed { .. } = kind {
                let point = &mut self.blocks[n / LANES].points[p];
                point.speed.values_mut()[n % LANES] = 0.0;
                point.acceleration.values_mut()[n % LANES] = 0.0;
            }
        }
    }
}
