//! Difference quotients of setpoints and their rounding error bounds.
//!
//! A first difference quotient is a mean velocity, a second one a mean acceleration: where one exceeds a limit, the motion does.
//! The relative error of stored positions and times is `EPS`.

use super::number::inner;
use super::rows::Row;
use super::vectors::{from_to, length, vector_of};
use super::{Limits, EPS, PASS_EXCESS, PASS_MARK, ROUNDINGS};

/// Consecutive setpoints.
pub struct Differences<'a, const M: usize> {
    pub limits: &'a Limits<M>,
    /// Last digit of positions that were written as text, in mm.
    pub resolution: f64,
    pub rows: &'a [Row<M>],
}

/// Mean accelerations and their rounding error bounds, in mm/s².
#[derive(Clone, Copy, Debug)]
pub struct Quotient<const M: usize> {
    pub value: [f64; M],
    pub rounding: [f64; M],
}

impl<const M: usize> Default for Quotient<M> {
    fn default() -> Self {
        Self { value: [0.0; M], rounding: [0.0; M] }
    }
}

impl<const M: usize> Differences<'_, M> {
    /// Allowed deviation of a time step from the period, in s.
    pub fn uneven(&self) -> f64 {
        PASS_EXCESS * self.limits.period
    }

    /// Least and greatest position of one axis that do not raise the used share of its travel above `known`; NaN where nothing is
    /// known yet (`known` < 0) or where the travel is limited on one side only.
    pub fn travel_of(&self, axis: usize, known: f64) -> [f64; 2] {
        let [least, most] = self.limits.travel[axis];
        let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
        match () {
            () if known < 0.0 => [f64::NAN; 2],
            () if half.is_finite() => [middle - known * half, middle + known * half],
            () if middle.is_nan() => [least, most],
            () => [f64::NAN; 2],
        }
    }

    /// Time from row `n` − 1 to row `n` in s: exactly the period where the difference of the times is within rounding of it. 0
    /// for row 0.
    pub fn step(&self, n: usize) -> f64 {
        if n == 0 {
            return 0.0;
        }
        let step = self.rows[n].t - self.rows[n - 1].t;
        if self.is_even(step, self.rows[n].t) {
            self.limits.period
        } else {
            step
        }
    }

    /// Whether a step that ends at `t` is one period long.
    pub fn is_even(&self, step: f64, t: f64) -> bool {
        (step - self.limits.period).abs() <= self.uneven() + ROUNDINGS * EPS * t.abs()
    }

    /// Bound of the position error of each axis at row `n`, in mm: rounding of the position, and velocity times the rounding of
    /// the time.
    pub fn rounding(&self, n: usize) -> [f64; M] {
        let row = &self.rows[n];
        let before = &self.rows[n.saturating_sub(1)];
        let periods = row.t.abs() / self.limits.period;
        let mut rounding = vector_of(|k| {
            let magnitude = row.q[k].abs().max(row.nearest.magnitude);
            let way = (row.q[k] - before.q[k]).abs() * periods;
            0.5 * self.resolution + ROUNDINGS * EPS * (magnitude + way)
        });
        rounding[self.limits.axes..].fill(0.0);
        rounding
    }

    /// Mean accelerations over the two steps around row `c`, and their rounding error bounds.
    pub fn acceleration(&self, c: usize) -> Quotient<M> {
        self.acceleration_by(c, self.step(c), self.step(c + 1), &self.rounding(c + 1))
    }

    /// The mean accelerations around row `c`, from the durations of the steps to and from it and the position error bound of the
    /// row after it.
    #[inline]
    pub fn acceleration_by(&self, c: usize, h0: f64, h1: f64, rounding: &[f64; M]) -> Quotient<M> {
        let [q0, q1, q2] = [c - 1, c, c + 1].map(|n| &self.rows[n].q);
        let (per0, per1, per_mean) = (1.0 / h0, 1.0 / h1, 2.0 / (h0 + h1));
        let per_both = 4.0 * per0 * per1;
        Quotient {
            value: vector_of(|k| ((q2[k] - q1[k]) * per1 - (q1[k] - q0[k]) * per0) * per_mean),
            rounding: vector_of(|k| rounding[k] * per_both),
        }
    }

    /// Mean jerk of each axis over three steps that take `span`, less its rounding error bound, in mm/s³; from the mean
    /// accelerations around the two inner rows.
    ///
    /// Each mean acceleration has a triangular weight over two steps; the centres of the two triangles are `span`/3 apart.
    #[inline]
    pub fn jerk(&self, early: &Quotient<M>, late: &Quotient<M>, span: f64) -> [f64; M] {
        let per_third = 3.0 / span;
        let change = |k: usize| (late.value[k] - early.value[k]).abs() - late.rounding[k] - early.rounding[k];
        vector_of(|k| change(k) * per_third)
    }

    /// Whether an acceleration above its limit at row `c` can be a corner, where no path is known. This is so if at most two
    /// consecutive accelerations are above their limits, their total excess is at most the allowed jump, and the change of
    /// velocity across them is explained by a turn at constant speed plus the acceleration limits.
    pub fn looks_like_a_corner(&self, c: usize) -> bool {
        let last = self.rows.len() - 1;
        let exceeds = |i: usize| i >= 1 && i < last && self.excess(i).iter().any(|&excess| excess > 0.0);
        let mut first = c;
        while first > c.saturating_sub(2) && exceeds(first - 1) {
            first -= 1;
        }
        let mut end = c + 1;
        while end < c + 3 && exceeds(end) {
            end += 1;
        }
        if end - first > 2 {
            return false;
        }
        let mut total = [0.0; M];
        for i in first..end {
            let excess = self.excess(i);
            for k in 0..M {
                total[k] += excess[k].max(0.0) * self.limits.period;
            }
        }
        if (0..M).any(|k| total[k] > self.limits.jump_beyond[k] * PASS_MARK) {
            return false;
        }
        // The last step wholly before the corner, and the first one wholly after it.
        let (into, out) = (first.saturating_sub(1).max(1), (end + 1).min(last));
        let [before, after] = [into, out].map(|n| {
            let step = self.step(n);
            from_to(&self.rows[n - 1].q, &self.rows[n].q).map(|way| way / step)
        });
        let speeds = [length(&before), length(&after)];
        let steps = (out - into) as f64;
        let explained = length(&self.limits.acceleration.greater()) * steps * self.limits.period;
        let turn = if speeds[0] * speeds[1] > 0.0 {
            (1.0 - inner(&before, &after) / (speeds[0] * speeds[1])).max(0.0)
        } else {
            0.0
        };
        let turned = speeds[0].max(speeds[1]) * (2.0 * turn).sqrt();
        (speeds[1] - speeds[0]).abs() <= explained && length(&total) <= turned + explained
    }

    /// By how much the mean acceleration of each axis around row `i` is above its limit, in mm/s²; negative if it is below.
    fn excess(&self, i: usize) -> [f64; M] {
        let acceleration = self.acceleration(i);
        std::array::from_fn(|k| {
            let value = acceleration.value[k];
            value.abs() - acceleration.rounding[k] - self.limits.acceleration.of(k, value)
        })
    }
}
