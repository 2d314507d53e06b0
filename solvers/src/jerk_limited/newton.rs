//! The passes of one Newton iteration over the intervals of a stretch; see `interior_point`.

use super::hermite::{combine, local, AT_NODES, BEND, SLOPE, VALUE, WEIGHTS};
use super::interior_point::{Bound, InteriorPoint};
use super::lanes::Lanes;
use super::rows::{Interval, RowSet, Rows};

/// An interval's part of the iterate.
#[derive(Clone, Copy)]
pub struct State<const M: usize> {
    pub slack: RowSet<M>,
    pub dual: RowSet<M>,
    /// 1/slack.
    pub inverse: RowSet<M>,
    /// Of the predictor: the relative change of the slack; of the corrector: the aim; then the step of λ.
    pub aim: RowSet<M>,
    pub trial: RowSet<M>,
    /// w^(−1/2), and at the trial.
    pub pace: Lanes,
    pub trial_pace: Lanes,
}

impl<const M: usize> Default for State<M> {
    fn default() -> Self {
        let one = RowSet::ONE;
        Self {
            slack: one,
            dual: one,
            inverse: one,
            aim: one,
            trial: one,
            pace: Lanes::ONE,
            trial_pace: Lanes::ONE,
        }
    }
}

/// The symmetric form of (w, w', w'') at each collocation point: 00 01 02 11 12 22.
type Form = [Lanes; 6];

impl<const M: usize> InteriorPoint<M> {
    /// Matrix and gradient at x; the sum of λ s. Multipliers are held above `least_dual`/s.
    pub(super) fn assemble(&mut self, rows: &Rows<M>, x: &[f64], least_dual: f64) -> f64 {
        let count = rows.intervals.len();
        self.band.clear(count + 1);
        self.gradient.fill(0.0);
        let mut work = Lanes::ZERO;
        let floor = Lanes::all(least_dual);
        for (n, (state, interval)) in self.states.iter_mut().zip(&rows.intervals).enumerate() {
            state.inverse = state.slack.map(Lanes::inverse);
            state.dual = state.dual.zip(&state.inverse, |dual, inverse| dual.max(floor * inverse));
            let weight = state.dual.zip3(&state.inverse, &state.slack, |dual, inverse, slack| {
                work += dual * slack;
                dual * inverse
            });
            let form = curvature(rows, interval, &weight, state.pace);
            let (matrix, gradient) = project(interval.h, &form, &local(x, n, interval.h));
            self.band.add(n, interval.h, &matrix);
            for (k, scale) in [1.0, interval.h, 1.0, interval.h].into_iter().enumerate() {
                self.gradient[2 * n + k] += gradient[k] * scale;
            }
        }
        let mut work = work.sum();
        for row in self.ends.iter_mut().flatten() {
            row.dual = row.dual.max(least_dual / row.slack);
            work += row.dual * row.slack;
            let w = x[2 * row.node];
            let fall = row.ramp / (w * w.sqrt());
            self.gradient[2 * row.node] -= 1.5 * fall;
            self.band.diagonal[row.node][0] +=
                2.25 * fall / w + row.dual / row.slack / (row.greatest * row.greatest);
        }
        work
    }

    /// Relative changes of the slacks along the predictor's step; the sum of λ s at the end of its longest step.
    pub(super) fn predict(&mut self, rows: &Rows<M>) -> f64 {
        let (mut primal, mut dual) = (Lanes::ZERO, Lanes::ZERO);
        // Sums of λ s, λ ds and λ ds²/s: with dλ = −λ (1 + ds/s) they give λ s after any step.
        let mut sums = [Lanes::ZERO; 3];
        for (n, (state, interval)) in self.states.iter_mut().zip(&rows.intervals).enumerate() {
            let step = rows.slack_step(n, &local(&self.step, n, interval.h), fall(state.pace));
            state.aim = step.zip3(&state.inverse, &state.slack, |step, inverse, _| {
                let change = step * inverse;
                primal = primal.max(-change);
                dual = dual.max(Lanes::ONE + change);
                change
            });
            state.aim.zip3(&state.dual, &state.slack, |change, dual, slack| {
                let work = dual * slack;
                sums[0] += work;
                sums[1] += work * change;
                sums[2] += work * change * change;
                change
            });
        }
        let mut sums = sums.map(Lanes::sum);
        let (mut primal, mut dual) = (primal.greatest(), dual.greatest());
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step[2 * row.node] / row.greatest / row.slack;
            primal = primal.max(-change);
            dual = dual.max(1.0 + change);
            let work = row.dual * row.slack;
            sums[0] += work;
            sums[1] += work * change;
            sums[2] += work * change * change;
            row.aim = change;
        }
        let (p, d) = ((1.0 / primal).min(1.0), (1.0 / dual).min(1.0));
        sums[0] + p * sums[1] - d * (sums[0] + sums[1]) - p * d * (sums[1] + sums[2])
    }

    /// The right-hand side of the corrector: λ s of every row towards `target`, less `second` times the predictor's
    /// product, itself at most `most`.
    pub(super) fn correct(&mut self, rows: &Rows<M>, target: f64, second: f64, most: f64) {
        for (r, g) in self.rhs.iter_mut().zip(&self.gradient) {
            *r = -g;
        }
        let most = Lanes::all(most);
        let target_lanes = Lanes::all(target);
        for (n, (state, interval)) in self.states.iter_mut().zip(&rows.intervals).enumerate() {
            let product = state.aim.zip3(&state.dual, &state.slack, |change, dual, slack| {
                let product = -(change * slack * dual * (Lanes::ONE + change));
                (target_lanes - product.max(-most).min(most) * second)
            });
            state.aim = product.zip(&state.inverse, |aim, inverse| aim * inverse);
            let pull = pull(rows, interval, &state.aim, fall(state.pace));
            let h = interval.h;
            let at = &mut self.rhs[2 * n..2 * n + 4];
            for (k, scale) in [1.0, h, 1.0, h].into_iter().enumerate() {
                at[k] += (pull[0] * VALUE[k] + pull[1] * SLOPE[k] + pull[2] * BEND[k]).sum() * scale;
            }
        }
        for row in self.ends.iter_mut().flatten() {
            let product = -row.aim * row.slack * row.dual * (1.0 + row.aim);
            row.aim = (target - second * product.clamp(-most.0[0], most.0[0])) / row.slack;
            self.rhs[2 * row.node] -= row.aim / row.greatest;
        }
    }

    /// The steps of the multipliers; the longest steps that keep slacks and multipliers positive.
    pub(super) fn direction(&mut self, rows: &Rows<M>) -> (f64, f64) {
        let (mut primal, mut dual) = (Lanes::all(1e-12), Lanes::all(1e-12));
        for (n, (state, interval)) in self.states.iter_mut().zip(&rows.intervals).enumerate() {
            let step = rows.slack_step(n, &local(&self.step, n, interval.h), fall(state.pace));
            let change = step.zip(&state.inverse, |step, inverse| {
                let change = step * inverse;
                primal = primal.max(-change);
                change
            });
            state.aim = change.zip3(&state.aim, &state.dual, |change, aim, now| {
                let step = aim - now * (Lanes::ONE + change);
                dual = dual.max(-(step * now.inverse()));
                step
            });
        }
        let (mut primal, mut dual) = (primal.greatest(), dual.greatest());
        for row in self.ends.iter_mut().flatten() {
            let change = -self.step[2 * row.node] / row.greatest / row.slack;
            primal = primal.max(-change);
            row.aim -= row.dual * (1.0 + change);
            dual = dual.max(-row.aim / row.dual);
        }
        (1.0 / primal, 1.0 / dual)
    }

    /// Time and gain of Σ ln s a part of the step further; the time is infinite where a limit is broken.
    pub(super) fn attempt(&mut self, rows: &Rows<M>, bounds: [Bound; 2], x: &[f64], part: f64) -> (f64, f64) {
        for ((to, from), step) in self.trial.iter_mut().zip(x).zip(&self.step) {
            *to = from + part * step;
        }
        let mut gain = 0.0;
        for (n, (state, interval)) in self.states.iter_mut().zip(&rows.intervals).enumerate() {
            let (slack, pace) = rows.slack(n, &local(&self.trial, n, interval.h));
            let (mut least, mut product) = (Lanes::ONE, Lanes::ONE);
            slack.zip(&state.inverse, |slack, inverse| {
                let ratio = slack * inverse;
                least = ratio.min(least);
                product *= ratio;
                ratio
            });
            (state.trial, state.trial_pace) = (slack, pace);
            if !(least.least() > 0.0) {
                return (f64::INFINITY, 0.0);
            }
            gain += product.product().ln();
        }
        for row in self.ends.iter().flatten() {
            let slack = 1.0 - self.trial[2 * row.node] / row.greatest;
            if !(slack > 0.0) {
                return (f64::INFINITY, 0.0);
            }
            gain += (slack / row.slack).ln();
        }
        (self.time(rows, bounds, &self.trial), gain)
    }

    /// Takes the trial and a part of the multipliers' step; the sum of λ s there.
    pub(super) fn accept(&mut self, x: &mut [f64], part: f64) -> f64 {
        x.copy_from_slice(&self.trial);
        let mut work = Lanes::ZERO;
        for state in &mut self.states {
            (state.slack, state.pace) = (state.trial, state.trial_pace);
            state.dual = state.dual.zip3(&state.aim, &state.slack, |dual, step, slack| {
                let dual = dual + step * part;
                work += dual * slack;
                dual
            });
        }
        let mut work = work.sum();
        for row in self.ends.iter_mut().flatten() {
            row.slack = 1.0 - x[2 * row.node] / row.greatest;
            row.dual += part * row.aim;
            work += row.dual * row.slack;
        }
        work
    }
}

/// w^(−3/2)/2.
#[inline(always)]
fn fall(pace: Lanes) -> Lanes {
    pace * pace * pace * 0.5
}

/// Σ weight ∇s ∇sᵀ over the rows of an interval, at its collocation points.
#[inline(always)]
fn curvature<const M: usize>(
    rows: &Rows<M>,
    interval: &Interval<M>,
    weight: &RowSet<M>,
    pace: Lanes,
) -> Form {
    let fall = fall(pace);
    let tight = interval.acceleration * interval.acceleration;
    let mut m = [Lanes::ZERO; 6];
    m[0] = weight.positive + weight.speed * interval.speed * interval.speed;
    for k in 0..M {
        let [q1, q2, q3] = interval.q[k];
        let half = q1 * 0.5;
        let [up, down] = weight.acceleration[k];
        let both = (up + down) * tight * (rows.per_acceleration[k] * rows.per_acceleration[k]);
        let (b2, b1) = (both * q2, both * half);
        m[0] += b2 * q2;
        m[1] += b2 * half;
        m[3] += b1 * half;
        let per_jerk = rows.per_jerk[k] * interval.jerk;
        let [up, down] = weight.jerk[k];
        let (both, turn) = (up + down, (up - down) * fall);
        let (r0, r1, r2) = (q3 * per_jerk, q2 * (1.5 * per_jerk), half * per_jerk);
        let (b0, b1) = (both * r0 + turn, both * r1);
        m[0] += b0 * r0 + (turn * r0 + both * fall * fall);
        m[1] += b0 * r1;
        m[2] += b0 * r2;
        m[3] += b1 * r1;
        m[4] += b1 * r2;
        m[5] += both * r2 * r2;
    }
    m
}

/// Σ aim ∇s over the rows of an interval, as a linear form of (w, h w', h² w'').
#[inline(always)]
fn pull<const M: usize>(rows: &Rows<M>, interval: &Interval<M>, aim: &RowSet<M>, fall: Lanes) -> [Lanes; 3] {
    let mut g = [aim.positive - aim.speed * interval.speed, Lanes::ZERO, Lanes::ZERO];
    for k in 0..M {
        let [q1, q2, q3] = interval.q[k];
        let [up, down] = aim.acceleration[k];
        let a = (down - up) * interval.acceleration * rows.per_acceleration[k];
        let [up, down] = aim.jerk[k];
        let j = (down - up) * (rows.per_jerk[k] * interval.jerk);
        g[0] += a * q2 + j * q3 - fall * (up + down);
        g[1] += a * q1 * 0.5 + j * q2 * 1.5;
        g[2] += j * q1 * 0.5;
    }
    let per_h = 1.0 / interval.h;
    [g[0], g[1] * per_h, g[2] * (per_h * per_h)]
}

/// Matrix and gradient in local coefficients: the form and the curvature of the time.
#[inline(always)]
fn project(h: f64, form: &Form, u: &[f64; 4]) -> ([[f64; 4]; 4], [f64; 4]) {
    let per_h = 1.0 / h;
    let per_h2 = per_h * per_h;
    let m = [
        form[0],
        form[1] * per_h,
        form[2] * per_h2,
        form[3] * per_h2,
        form[4] * (per_h * per_h2),
        form[5] * (per_h2 * per_h2),
    ];
    let pace = combine(&AT_NODES, u).sqrt().inverse();
    let pace_sq = pace * pace;
    let slope = WEIGHTS * pace * pace_sq * (-0.5 * h);
    let bend = slope * pace_sq * -1.5;
    let mut matrix = [[0.0; 4]; 4];
    let mut gradient = [0.0; 4];
    for j in 0..4 {
        let (v, s, b) = (VALUE[j], SLOPE[j], BEND[j]);
        let p0 = m[0] * v + m[1] * s + m[2] * b;
        let p1 = m[1] * v + m[3] * s + m[4] * b;
        let p2 = m[2] * v + m[4] * s + m[5] * b;
        let g = bend * AT_NODES[j];
        for i in 0..=j {
            matrix[i][j] = (VALUE[i] * p0 + SLOPE[i] * p1 + BEND[i] * p2 + AT_NODES[i] * g).sum();
        }
        gradient[j] = (slope * AT_NODES[j]).sum();
    }
    (matrix, gradient)
}
