//! A convex relaxation on a window: in the rows of jerk and in the time, the pace w^(−1/2) becomes a variable y at each
//! collocation point,
//!
//!   minimise Σ c y   subject to   y ≥ w^(−1/2),   y ∓ L(w)/J ≥ 0   and the other rows as they are,
//!
//! with L(w) = q''' w + 3/2 q'' w' + 1/2 q' w'' and the weights c of the 3/8 rule. Its minimum is at most that of the
//! true problem. y is eliminated at each point, so that Newton's matrix keeps its bandwidth.

use fearless_simd::Simd;

use super::constraints::{Constraints, RowLayout};
use super::forms::{expand, fall, pace, project, Local};
use super::hermite::{local, MASS};
use super::model::Model;
use feedplan_geometry::lanes::{Lanes, Register};

/// The variables y of the relaxation, four lanes for each interval.
pub struct Relaxed {
    pub y: Vec<Lanes>,
    /// y starts above its least possible value by this part of it.
    pub above: f64,
    step: Vec<Lanes>,
    trial: Vec<Lanes>,
    /// w^(−1/2), as the slacks were last evaluated.
    pace: Vec<Lanes>,
    /// Second derivatives by y and y, and by y and (w, w', w''); then the pulls of the rows on y.
    cross: Vec<[Lanes; 4]>,
    pulls: Vec<[Lanes; 2]>,
}

impl Default for Relaxed {
    fn default() -> Self {
        let [y, step, trial, pace] = std::array::from_fn(|_| vec![]);
        Self { y, above: 0.1, step, trial, pace, cross: vec![], pulls: vec![] }
    }
}

impl<const M: usize> Model<M> for Relaxed {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, simd: S, rows: &Constraints<M>, x: &[f64]) {
        let count = rows.intervals.len();
        for lanes in [&mut self.y, &mut self.step, &mut self.trial, &mut self.pace] {
            lanes.resize(count, Lanes::ONE);
        }
        self.pulls.resize(count, [Lanes::ZERO; 2]);
        self.cross.resize(count, [Lanes::ONE; 4]);
        for (n, interval) in rows.intervals.iter().enumerate() {
            let motion = interval.motion(simd, &local(x, n, interval.h));
            let mut least = pace(motion[0]);
            for [_, jerk] in rows.axes(interval, motion) {
                least = least.max(jerk.abs());
            }
            self.y[n] = (least * (1.0 + self.above)).into();
        }
    }

    #[inline(always)]
    fn slack<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        u: &[f64; 4],
        trial: bool,
        out: &mut [Lanes],
    ) {
        let pace = pace(rows.intervals[n].motion(simd, u)[0]);
        let y = if trial { self.trial[n] } else { self.y[n] }.load(simd);
        rows.slack(n, u, y, y - pace, out);
        self.pace[n] = pace.into();
    }

    #[inline(always)]
    fn slack_step<S: Simd>(&self, simd: S, rows: &Constraints<M>, n: usize, d: &[f64; 4], out: &mut [Lanes]) {
        let w = rows.intervals[n].motion(simd, d)[0];
        let step = self.step[n].load(simd);
        rows.slack_step(n, d, step, step + fall(self.pace[n].load(simd)) * w, out);
    }

    #[inline(always)]
    fn local<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        _: &[f64; 4],
        weight: &[Lanes],
        dual: &[Lanes],
    ) -> Local {
        let interval = &rows.intervals[n];
        let zero = Register::all(simd, 0.0);
        let mut form = rows.curvature(simd, n, weight);
        let (last, pace) = (weight[RowLayout::<M>::POSITIVE].load(simd), self.pace[n].load(simd));
        let fall = fall(pace);
        let mut cross = [last, last * fall, zero, zero];
        form[0] += last * fall * fall + dual[RowLayout::<M>::POSITIVE] * fall * pace * pace * 1.5;
        for k in 0..M {
            let at = RowLayout::<M>::jerk(k);
            let [up, down] = [weight[at].load(simd), weight[at + 1].load(simd)];
            let (both, turn) = (up + down, down - up);
            let turn = turn * (rows.per_jerk[k] * interval.jerk);
            let [q1, q2, q3] = interval.q[k];
            cross[0] += both;
            cross[1] += turn * q3;
            cross[2] += turn * q2 * 1.5;
            cross[3] += turn * q1 * 0.5;
        }
        self.cross[n] = cross.map(Lanes::from);
        let per = cross[0].inverse();
        let [p0, p1, p2] = [cross[1] * per, cross[2] * per, cross[3] * per];
        form[0] += -(p0 * cross[1]);
        form[1] += -(p0 * cross[2]);
        form[2] += -(p0 * cross[3]);
        form[3] += -(p1 * cross[2]);
        form[4] += -(p1 * cross[3]);
        form[5] += -(p2 * cross[3]);
        let cost = MASS.load(simd) * interval.h;
        let linear = [-(p0 * cost), -(p1 * cost), -(p2 * cost)];
        Local { matrix: expand(interval.h, &form, zero), gradient: project(interval.h, &linear) }
    }

    #[inline(always)]
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        aim: &[Lanes],
        which: usize,
    ) -> [Register<S>; 3] {
        let (mut pull, jerk) = rows.pull(simd, n, aim);
        let last = aim[RowLayout::<M>::POSITIVE].load(simd);
        pull[0] += last * fall(self.pace[n].load(simd));
        self.pulls[n][which] = (jerk + last).into();
        let cross = &self.cross[n];
        let part = (jerk + last) * cross[0].load(simd).inverse();
        for k in 0..3 {
            pull[k] += -(part * cross[k + 1]);
        }
        pull
    }

    #[inline(always)]
    fn solved<S: Simd>(&mut self, simd: S, rows: &Constraints<M>, step: &[f64], pulls: [f64; 2]) {
        for (n, interval) in rows.intervals.iter().enumerate() {
            let [w, w1, w2] = interval.motion(simd, &local(step, n, interval.h));
            let [own, c0, c1, c2] = self.cross[n];
            let [centre, product] = self.pulls[n];
            let aim = centre.load(simd) * pulls[0] + product.load(simd) * pulls[1];
            let free = aim - MASS.load(simd) * interval.h - c0 * w - c1 * w1 - c2 * w2;
            self.step[n] = (free * own.load(simd).inverse()).into();
        }
    }

    #[inline(always)]
    fn attempt<S: Simd>(&mut self, simd: S, part: f64) {
        for ((trial, y), step) in self.trial.iter_mut().zip(&self.y).zip(&self.step) {
            *trial = (*y + step.load(simd) * part).into();
        }
    }

    fn accept(&mut self) {
        std::mem::swap(&mut self.y, &mut self.trial);
    }

    #[inline(always)]
    fn time<S: Simd>(&self, simd: S, rows: &Constraints<M>, x: &[f64], trial: bool) -> f64 {
        let y = if trial { &self.trial } else { &self.y };
        let mut time = 0.0;
        for (n, interval) in rows.intervals.iter().enumerate() {
            if interval.motion(simd, &local(x, n, interval.h))[0].least() <= 0.0 {
                return f64::INFINITY;
            }
            time += (MASS * y[n].load(simd)).sum() * interval.h;
        }
        time
    }
}
