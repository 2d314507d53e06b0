//! The true problem on a window, without relaxation: least time ∫ ds/√w under `Constraints`.

use fearless_simd::Simd;

use super::columns::Columns;
use super::constraints::Constraints;
use super::forms::{fall, pace, Local};
use super::hermite::{combine, AT_NODES, COUNT, WEIGHTS};
use super::model::Model;
use feedplan_geometry::lanes::eight::{Lanes, Register};

/// w^(−1/2) at the collocation points of each block, from the last evaluation of the slacks.
#[derive(Default)]
pub struct Exact {
    pace: Vec<[Lanes; COUNT]>,
}

impl Model for Exact {
    #[inline(always)]
    fn begin<S: Simd>(&mut self, _: S, rows: &Constraints, _: &Columns) {
        self.pace.resize(rows.blocks.len(), [Lanes::ONE; COUNT]);
    }

    #[inline(always)]
    fn slack<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        _: bool,
        out: &mut [Lanes],
    ) {
        let [w, w1, _] = motion;
        let own = &rows.blocks[block];
        let pace = pace(w);
        rows.slack(block, p, motion, pace, w + w1 * own.inwards(w.simd(), p), out);
        self.pace[block][p] = pace.into();
    }

    #[inline(always)]
    fn slack_step<S: Simd>(
        &self,
        rows: &Constraints,
        block: usize,
        p: usize,
        motion: [Register<S>; 3],
        out: &mut [Lanes],
    ) {
        let [w, w1, _] = motion;
        let own = &rows.blocks[block];
        let last = w + w1 * own.inwards(w.simd(), p);
        rows.slack_step(block, p, motion, -(fall(self.pace[block][p].load(w.simd())) * w), last, out);
    }

    #[inline(always)]
    fn local<S: Simd>(
        &mut self,
        rows: &Constraints,
        block: usize,
        u: &[Register<S>; 4],
        weight: &[Lanes],
        _: &[Lanes],
    ) -> Local<S> {
        let simd = u[0].simd();
        let (own, layout) = (&rows.blocks[block], rows.layout());
        let h = own.h.load(simd);
        let per_h = h.inverse();
        let mut local = Local::zero(simd);
        for p in 0..COUNT {
            let weight = layout.of(weight, 0, p);
            let mut form = rows.curvature(simd, block, p, weight);
            let fall = fall(self.pace[block][p].load(simd));
            let (last, inwards) = (weight[layout.positive()].load(simd), own.inwards(simd, p));
            form[0] += last;
            form[1] += last * inwards;
            form[3] += last * inwards * inwards;
            let [jerks, _] = layout.pairs(weight);
            for ((weight, &[q1, q2, q3]), per_jerk) in jerks.zip(rows.q(block, p)).zip(&rows.per_jerk) {
                // The two jerk rows of an axis also contain w^(−1/2), whose derivative by w is −`fall`.
                let [up, down] = [weight[0].load(simd), weight[1].load(simd)];
                let (both, turn) = (up + down, (up - down) * fall);
                let turn = turn * own.jerk * *per_jerk;
                form[0] += both * fall * fall + turn * q3 * 2.0;
                form[1] += turn * q2 * 1.5;
                form[2] += turn * q1 * 0.5;
            }
            local.add(p, per_h, &form);
        }
        for (basis, weight) in AT_NODES.iter().zip(WEIGHTS) {
            let pace = combine(basis, u).sqrt().inverse();
            let pace_sq = pace * pace;
            let slope = pace * pace_sq * h * (-0.5 * weight);
            let bend = slope * pace_sq * -1.5;
            for j in 0..4 {
                local.gradient[j] += slope * basis[j];
                let part = bend * basis[j];
                for i in 0..=j {
                    local.matrix[i][j] += part * basis[i];
                }
            }
        }
        local
    }

    #[inline(always)]
    fn pull<S: Simd>(
        &mut self,
        simd: S,
        rows: &Constraints,
        block: usize,
        p: usize,
        aim: &[Lanes],
        _: usize,
    ) -> [Register<S>; 3] {
        let own = &rows.blocks[block];
        let (mut pull, jerk) = rows.pull(simd, block, p, aim);
        let last = aim[rows.layout().positive()].load(simd);
        pull[0] += last - fall(self.pace[block][p].load(simd)) * jerk;
        pull[1] += last * own.inwards(simd, p);
        pull
    }

    #[inline(always)]
    fn solved<S: Simd>(&mut self, _: S, _: &Constraints, _: &Columns, _: [f64; 2]) {}

    #[inline(always)]
    fn attempt<S: Simd>(&mut self, _: S, _: f64) {}

    fn accept(&mut self) {}

    #[inline(always)]
    fn time<S: Simd>(&self, simd: S, rows: &Constraints, x: &Columns, _: bool) -> f64 {
        let mut time = Register::all(simd, 0.0);
        let mut least = Register::all(simd, f64::INFINITY);
        for (b, block) in rows.blocks.iter().enumerate() {
            let h = block.h.load(simd);
            let u = x.local(b, h, block.live);
            let mut pace = Register::all(simd, 0.0);
            for (basis, weight) in AT_NODES.iter().zip(WEIGHTS) {
                let w = combine(basis, &u);
                least = w.min(least);
                pace += w.sqrt().inverse() * weight;
            }
            time += pace * h * block.live;
        }
        if least.least() > 0.0 {
            time.sum()
        } else {
            f64::INFINITY
        }
    }
}
