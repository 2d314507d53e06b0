//! The true problem on a stretch: the time ∫ ds/√w under the rows as they are.

use super::hermite::{combine, duration, AT_NODES, WEIGHTS};
use super::model::{expand, Local, Model};
use super::rows::{Order, Rows};
use feedplan_geometry::lanes::Lanes;

/// w^(−1/2) at the collocation points of each interval, where the slacks are.
#[derive(Default)]
pub struct Exact {
    pace: Vec<Lanes>,
}

impl<const M: usize> Model<M> for Exact {
    fn begin(&mut self, rows: &Rows<M>, _: &[f64]) {
        self.pace.resize(rows.intervals.len(), Lanes::ONE);
    }

    #[inline(always)]
    fn slack(&mut self, rows: &Rows<M>, n: usize, u: &[f64; 4], _: bool, out: &mut [Lanes]) {
        let [w, w1, _] = rows.intervals[n].motion(u);
        let pace = w.max(Lanes::all(f64::MIN_POSITIVE)).sqrt().inverse();
        rows.slack(n, u, pace, w + w1 * rows.intervals[n].inwards(), out);
        self.pace[n] = pace;
    }

    #[inline(always)]
    fn slack_step(&self, rows: &Rows<M>, n: usize, d: &[f64; 4], out: &mut [Lanes]) {
        let [w, w1, _] = rows.intervals[n].motion(d);
        let last = w + w1 * rows.intervals[n].inwards();
        rows.slack_step(n, d, -(fall(self.pace[n]) * w), last, out);
    }

    #[inline(always)]
    fn local(&mut self, rows: &Rows<M>, n: usize, u: &[f64; 4], weight: &[Lanes], _: &[Lanes]) -> Local {
        let mut form = rows.curvature(n, weight);
        let fall = fall(self.pace[n]);
        let interval = &rows.intervals[n];
        let (last, inwards) = (weight[Order::<M>::POSITIVE], interval.inwards());
        form[0] += last;
        form[1] += last * inwards;
        form[3] += last * inwards * inwards;
        for k in 0..M {
            // What the slope of w^(−1/2) adds to the two rows of an axis's jerk.
            let at = Order::<M>::jerk(k);
            let (both, turn) = (weight[at] + weight[at + 1], (weight[at] - weight[at + 1]) * fall);
            let [q1, q2, q3] = interval.q[k];
            let turn = turn * (rows.per_jerk[k] * interval.jerk);
            form[0] += both * fall * fall + turn * q3 * 2.0;
            form[1] += turn * q2 * 1.5;
            form[2] += turn * q1 * 0.5;
        }
        let pace = combine(&AT_NODES, u).sqrt().inverse();
        let pace_sq = pace * pace;
        let slope = WEIGHTS * pace * pace_sq * (-0.5 * interval.h);
        Local {
            matrix: expand(interval.h, &form, slope * pace_sq * -1.5),
            gradient: AT_NODES.map(|basis| (basis * slope).sum()),
        }
    }

    #[inline(always)]
    fn pull(&mut self, rows: &Rows<M>, n: usize, aim: &[Lanes], _: usize) -> [Lanes; 3] {
        let (mut pull, jerk) = rows.pull(n, aim);
        let last = aim[Order::<M>::POSITIVE];
        pull[0] += last - fall(self.pace[n]) * jerk;
        pull[1] += last * rows.intervals[n].inwards();
        pull
    }

    fn solved(&mut self, _: &Rows<M>, _: &[f64], _: [f64; 2]) {}

    fn attempt(&mut self, _: f64) {}

    fn accept(&mut self) {}

    fn time(&self, rows: &Rows<M>, x: &[f64], _: bool) -> f64 {
        rows.intervals.iter().enumerate().map(|(n, interval)| duration(x, n, interval.h)).sum()
    }
}

/// w^(−3/2)/2.
#[inline(always)]
fn fall(pace: Lanes) -> Lanes {
    pace * pace * pace * 0.5
}
