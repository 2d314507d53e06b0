//! The true problem on a window: the time ∫ ds/√w under the constraints as they are.

use fearless_simd::Simd;

use super::constraints::{Constraints, RowLayout};
use super::forms::{expand, fall, pace, Local};
use super::hermite::{combine, duration_on, AT_NODES, WEIGHTS};
use super::model::Model;
use feedplan_geometry::lanes::{Lanes, Register};

/// w^(−1/2) at the collocation points of each interval, as the slacks were last evaluated.
#[derive(Default)]
pub struct Exact {
    pace: Vec<Lanes>,
}

impl<const M: usize> Model<M> for Exact {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, _: S, rows: &Constraints<M>, _: &[f64]) {
        self.pace.resize(rows.intervals.len(), Lanes::ONE);
    }

    #[inline(always)]
    fn slack<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        u: &[f64; 4],
        _: bool,
        out: &mut [Lanes],
    ) {
        let [w, w1, _] = rows.intervals[n].motion(simd, u);
        let pace = pace(w);
        rows.slack(n, u, pace, w + w1 * rows.intervals[n].inwards(simd), out);
        self.pace[n] = pace.into();
    }

    #[inline(always)]
    fn slack_step<S: Simd>(&self, simd: S, rows: &Constraints<M>, n: usize, d: &[f64; 4], out: &mut [Lanes]) {
        let [w, w1, _] = rows.intervals[n].motion(simd, d);
        let last = w + w1 * rows.intervals[n].inwards(simd);
        rows.slack_step(n, d, -(fall(self.pace[n].load(simd)) * w), last, out);
    }

    #[inline(always)]
    fn local<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        u: &[f64; 4],
        weight: &[Lanes],
        _: &[Lanes],
    ) -> Local {
        let mut form = rows.curvature(simd, n, weight);
        let fall = fall(self.pace[n].load(simd));
        let interval = &rows.intervals[n];
        let (last, inwards) = (weight[RowLayout::<M>::POSITIVE].load(simd), interval.inwards(simd));
        form[0] += last;
        form[1] += last * inwards;
        form[3] += last * inwards * inwards;
        for k in 0..M {
            // The slope of w^(−1/2) adds to the two rows of an axis's jerk.
            let at = RowLayout::<M>::jerk(k);
            let [up, down] = [weight[at].load(simd), weight[at + 1].load(simd)];
            let (both, turn) = (up + down, (up - down) * fall);
            let [q1, q2, q3] = interval.q[k];
            let turn = turn * (rows.per_jerk[k] * interval.jerk);
            form[0] += both * fall * fall + turn * q3 * 2.0;
            form[1] += turn * q2 * 1.5;
            form[2] += turn * q1 * 0.5;
        }
        let pace = combine(simd, &AT_NODES, u).sqrt().inverse();
        let pace_sq = pace * pace;
        let slope = WEIGHTS * pace * pace_sq * (-0.5 * interval.h);
        let mut gradient = [0.0; 4];
        for k in 0..4 {
            gradient[k] = (AT_NODES[k] * slope).sum();
        }
        Local { matrix: expand(interval.h, &form, slope * pace_sq * -1.5), gradient }
    }

    #[inline(always)]
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints<M>,
        n: usize,
        aim: &[Lanes],
        _: usize,
    ) -> [Register<S>; 3] {
        let (mut pull, jerk) = rows.pull(simd, n, aim);
        let last = aim[RowLayout::<M>::POSITIVE].load(simd);
        pull[0] += last - fall(self.pace[n].load(simd)) * jerk;
        pull[1] += last * rows.intervals[n].inwards(simd);
        pull
    }

    #[inline(always)]
    fn solved<S: Simd>(&mut self, _: S, _: &Constraints<M>, _: &[f64], _: [f64; 2]) {}

    #[inline(always)]
    fn attempt<S: Simd>(&mut self, _: S, _: f64) {}

    fn accept(&mut self) {}

    #[inline(always)]
    fn time<S: Simd>(&self, simd: S, rows: &Constraints<M>, x: &[f64], _: bool) -> f64 {
        let mut time = 0.0;
        for (n, interval) in rows.intervals.iter().enumerate() {
            time += duration_on(simd, x, n, interval.h);
        }
        time
    }
}
