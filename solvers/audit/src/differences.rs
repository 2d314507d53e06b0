//! Differences of setpoints over their times, and what rounding may have added to them.
//!
//! A first difference over its time is a mean velocity, a second difference a mean acceleration: where one
//! exceeds a limit the motion does. A position is known to `EPS` of its magnitude and a time to `EPS` of its own.

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

/// Mean accelerations, and what of them may be rounding, in mm/s².
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
    /// How much a time step may differ from the period, in s.
    pub fn uneven(&self) -> f64 {
        PASS_EXCESS * self.limits.period
    }

    /// Least and greatest position of one axis that changes nothing where this share of half its travel was found; none where that is
    /// not known, or where one end alone is.
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

    /// Time from row `n` − 1 to row `n`: the period itself where the times round to it. Row 0 has none.
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

    /// Bound of the error of the position of each axis at row `n`, in mm: its rounding, and the way in the rounding of its time.
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

    /// Mean accelerations over the two steps around row `c`, and what of them may be rounding.
    pub fn acceleration(&self, c: usize) -> Quotient<M> {
        self.acceleration_by(c, self.step(c), self.step(c + 1), &self.rounding(c + 1))
    }

    /// The same where the steps to and from row `c` and the rounding of the row after it are known.
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

    /// Mean jerk of each axis over three steps that take `span`, from the accelerations around the two rows inside them.
    ///
    /// Each mean acceleration is weighted by a triangle over two steps; the centres of the two are a third of `span` apart.
    #[inline]
    pub fn jerk(&self, early: &Quotient<M>, late: &Quotient<M>, span: f64) -> [f64; M] {
        let per_third = 3.0 / span;
        let change = |k: usize| (late.value[k] - early.value[k]).abs() - late.rounding[k] - early.rounding[k];
        vector_of(|k| change(k) * per_third)
    }

    /// Whether an acceleration above its limit at row `c` can be a corner, where no path is known: at most two neighbouring
    /// accelerations are above their limits, their excess makes no more than the allowed jump, and the velocities before and after
    /// differ by no more than a turn at one speed and the acceleration limits explain.
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
        // Steps wholly before and wholly after the corner.
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

    /// By how much each acceleration around row `i` is above its limit.
    fn excess(&self, i: usize) -> [f64; M] {
        let acceleration = self.acceleration(i);
        std::array::from_fn(|k| {
            let value = acceleration.value[k];
            value.abs() - acceleration.rounding[k] - self.limits.acceleration.of(k, value)
        })
    }
}
