//! Audits a stream of setpoints: difference quotients against the limits, and each setpoint's place on the path.
//!
//! A first difference over its time is a mean velocity, a second difference a mean acceleration: where one
//! exceeds a limit the motion does. A position is known to `EPS` of its magnitude and a time to `EPS` of its own;
//! what these add to a quotient is subtracted. Between chunks the last few setpoints are kept, nothing else.

use rayon::prelude::*;

use super::curve::{distance, from_to, inner, length};
use super::deviation::offer_travel;
use super::follow::{Plan, Spot};
use super::{Check, Limits, Tally, EPS, PASS_EXCESS, PASS_MARK, PLACE_TOLERANCE, ROUNDINGS};

/// Setpoints before and after the one at which an acceleration is judged.
const AROUND: usize = 3;

/// Setpoints that a new one may be compared with.
const KEPT: usize = 2 * AROUND + 1;

/// Setpoints a thread takes at a time.
const BLOCK: usize = 4096;

/// Setpoints in order: times, positions of all axes, and what else is recorded.
#[derive(Clone, Copy)]
pub struct Chunk<'a> {
    pub t: &'a [f64],
    pub position: &'a [f64],
    pub velocity: Option<&'a [f64]>,
    pub acceleration: Option<&'a [f64]>,
    pub line: Option<&'a [i32]>,
}

/// One setpoint.
#[derive(Clone, Copy, Debug)]
pub struct Row<const M: usize> {
    pub t: f64,
    pub q: [f64; M],
    pub velocity: Option<[f64; M]>,
    pub acceleration: Option<[f64; M]>,
    pub line: i32,
    /// Its place on the path, where there is a path.
    pub spot: Spot,
}

/// The audit of a stream.
pub struct Stream<const M: usize> {
    limits: Limits<M>,
    /// What writing a position to a file may have changed, in mm.
    resolution: f64,
    kept: Vec<Row<M>>,
    count: u64,
    /// When the runs of the plan began.
    clock: Vec<f64>,
    tally: Tally<M>,
}

impl<const M: usize> Stream<M> {
    pub fn new(limits: Limits<M>, resolution: f64) -> Self {
        Self { limits, resolution, kept: Vec::new(), count: 0, clock: Vec::new(), tally: Tally::default() }
    }

    /// The next setpoints; `plan` must be the same every time.
    pub fn push(&mut self, plan: Option<&Plan>, chunk: &Chunk) {
        let old = self.kept.len();
        let mut rows = std::mem::take(&mut self.kept);
        rows.extend((0..chunk.t.len()).map(|i| Row {
            t: chunk.t[i],
            q: vector(chunk.position, i),
            velocity: chunk.velocity.map(|flat| vector(flat, i)),
            acceleration: chunk.acceleration.map(|flat| vector(flat, i)),
            line: chunk.line.map_or(0, |line| line[i]),
            spot: Spot::default(),
        }));
        let numbers = |row: &Row<M>| {
            let recorded = row.velocity.iter().chain(&row.acceleration).flatten();
            row.t.is_finite() && row.q.iter().chain(recorded).all(|number| number.is_finite())
        };
        for row in &rows[old..] {
            let bad = if numbers(row) { 0.0 } else { f64::INFINITY };
            self.tally.offer(Check::Numbers, 0, bad, 0.0, row.t, row.line);
        }
        if let Some(plan) = plan {
            plan.extend_clock(&self.limits, &rows, &mut self.clock);
        }
        let plan = plan.map(|plan| plan.with_clock(&self.clock));
        let plan = plan.as_ref();
        if let Some(plan) = plan {
            plan.find_spots(&self.limits, &mut rows, old);
        }
        let view = View { limits: &self.limits, resolution: self.resolution, plan, rows: &rows };
        let found = (old..rows.len())
            .into_par_iter()
            .with_min_len(BLOCK)
            .fold(Tally::default, |mut tally, n| {
                view.arrival(n, &mut tally);
                if n > AROUND {
                    view.centre(n - AROUND, &mut tally);
                }
                tally
            })
            .reduce(Tally::default, Tally::merge);
        if self.count == 0 && !rows.is_empty() {
            view.first(&mut self.tally);
        }
        self.tally = std::mem::take(&mut self.tally).merge(found);
        self.count += chunk.t.len() as u64;
        self.kept = rows.split_off(rows.len().saturating_sub(KEPT));
    }

    /// The end of the stream: what the last setpoints alone can show.
    pub fn finish(mut self, plan: Option<&Plan>) -> Tally<M> {
        let rows = std::mem::take(&mut self.kept);
        let plan = plan.map(|plan| plan.with_clock(&self.clock));
        let plan = plan.as_ref();
        let view = View { limits: &self.limits, resolution: self.resolution, plan, rows: &rows };
        for centre in rows.len().saturating_sub(AROUND).max(1)..rows.len().saturating_sub(1) {
            view.centre(centre, &mut self.tally);
        }
        view.last(&mut self.tally);
        self.tally
    }
}

/// Rows that can be compared with each other.
struct View<'a, const M: usize> {
    limits: &'a Limits<M>,
    resolution: f64,
    plan: Option<&'a Plan<'a>>,
    rows: &'a [Row<M>],
}

impl<const M: usize> View<'_, M> {
    fn first(&self, tally: &mut Tally<M>) {
        let (Some(plan), row) = (self.plan, &self.rows[0]) else { return };
        let away = distance(&row.q, &plan.start()) - length(&self.rounding(0));
        tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, row.t, row.line);
        tally.offer(Check::Grid, 0, row.t.abs(), self.uneven(), row.t, row.line);
    }

    fn last(&self, tally: &mut Tally<M>) {
        let Some(plan) = self.plan else { return };
        match self.rows.last() {
            Some(row) => {
                let away = distance(&row.q, &plan.end()) - length(&self.rounding(self.rows.len() - 1));
                tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, row.t, row.line);
            }
            None => tally.offer(Check::Place, 0, f64::INFINITY, PLACE_TOLERANCE, 0.0, 0),
        }
    }

    /// What a time step may differ from the period, in s.
    fn uneven(&self) -> f64 {
        PASS_EXCESS * self.limits.period
    }

    /// Time from row `n` − 1 to row `n`: the period itself where the times round to it.
    fn step(&self, n: usize) -> f64 {
        let step = self.rows[n].t - self.rows[n - 1].t;
        if self.is_even(step, self.rows[n].t) {
            self.limits.period
        } else {
            step
        }
    }

    fn is_even(&self, step: f64, t: f64) -> bool {
        (step - self.limits.period).abs() <= self.uneven() + ROUNDINGS * EPS * t.abs()
    }

    /// What is not known of the position of each axis at row `n`, in mm.
    fn rounding(&self, n: usize) -> [f64; M] {
        let row = &self.rows[n];
        let before = &self.rows[n.saturating_sub(1)];
        std::array::from_fn(|k| {
            let magnitude = row.q[k].abs().max(row.spot.magnitude);
            let way = (row.q[k] - before.q[k]).abs() / self.limits.period * row.t.abs();
            0.5 * self.resolution + ROUNDINGS * EPS * (magnitude + way)
        })
    }

    /// What row `n` shows together with the rows before it.
    fn arrival(&self, n: usize, tally: &mut Tally<M>) {
        let row = &self.rows[n];
        let (time, line) = (row.t, row.line);
        tally.samples += 1;
        for k in 0..M {
            offer_travel(tally, self.limits, k, row.q[k], time, line);
        }
        if let Some(plan) = self.plan {
            plan.spot(self.limits, row, length(&self.rounding(n)), tally);
        }
        if n == 0 {
            return;
        }
        self.grid(n, tally);
        let (before, step) = (&self.rows[n - 1], self.step(n));
        let rounding = self.rounding(n);
        for k in 0..M {
            let velocity = ((row.q[k] - before.q[k]).abs() - 2.0 * rounding[k]) / step;
            tally.offer(Check::Velocity, k, velocity, self.limits.velocity[k], time, line);
        }
        if let Some(plan) = self.plan {
            plan.step(self.limits, before, row, step, length(&rounding), tally);
        }
        self.recorded(n, tally);
        if n >= 3 {
            self.jerk(n, tally);
        }
    }

    /// Every step is one period long; only the very last may be shorter.
    fn grid(&self, n: usize, tally: &mut Tally<M>) {
        let (row, before) = (&self.rows[n], &self.rows[n - 1]);
        let step = row.t - before.t;
        let off = if self.is_even(step, row.t) || (step > 0.0 && step < self.limits.period) {
            0.0
        } else {
            (step - self.limits.period).abs()
        };
        tally.offer(Check::Grid, 0, off, self.uneven(), row.t, row.line);
        if n >= 2 {
            let step_before = before.t - self.rows[n - 2].t;
            if !self.is_even(step_before, before.t) {
                let off = (step_before - self.limits.period).abs();
                tally.offer(Check::Grid, 0, off, self.uneven(), before.t, before.line);
            }
        }
    }

    /// Recorded velocities: their mean over a step differs from the mean velocity by at most a quarter of what
    /// the acceleration can change in it. Recorded accelerations: within the limit.
    fn recorded(&self, n: usize, tally: &mut Tally<M>) {
        let (row, before, step) = (&self.rows[n], &self.rows[n - 1], self.step(n));
        if let (Some(new), Some(old)) = (row.velocity, before.velocity) {
            let rounding = self.rounding(n);
            for k in 0..M {
                let mean = (row.q[k] - before.q[k]) / step;
                let off = (mean - 0.5 * (new[k] + old[k])).abs() - 2.0 * rounding[k] / step;
                let limit = 0.25 * self.limits.acceleration[k] * step + 0.5 * self.limits.jump[k];
                tally.offer(Check::RecordedVelocity, k, off, limit, row.t, row.line);
            }
        }
        if let Some(acceleration) = row.acceleration {
            for k in 0..M {
                let (value, limit) = (acceleration[k].abs(), self.limits.acceleration[k]);
                tally.offer(Check::RecordedAcceleration, k, value, limit, row.t, row.line);
            }
        }
    }

    /// Mean jerk over three steps.
    fn jerk(&self, n: usize, tally: &mut Tally<M>) {
        let span: f64 = (n - 2..=n).map(|i| self.step(i)).sum();
        let (early, late) = (self.acceleration(n - 2), self.acceleration(n - 1));
        let row = &self.rows[n];
        for k in 0..M {
            // The means hold for triangles whose centres lie a third of all three steps apart.
            let change = (late.0[k] - early.0[k]).abs() - late.1[k] - early.1[k];
            tally.offer(Check::Jerk, k, 3.0 * change / span, self.limits.jerk[k], row.t, row.line);
        }
    }

    /// Mean accelerations over the two steps around row `c`, and what of them may be rounding.
    fn acceleration(&self, c: usize) -> ([f64; M], [f64; M]) {
        let (h0, h1) = (self.step(c), self.step(c + 1));
        let [q0, q1, q2] = [c - 1, c, c + 1].map(|n| &self.rows[n].q);
        let rounding = self.rounding(c + 1);
        (
            std::array::from_fn(|k| 2.0 * ((q2[k] - q1[k]) / h1 - (q1[k] - q0[k]) / h0) / (h0 + h1)),
            std::array::from_fn(|k| 4.0 * rounding[k] / (h0 * h1)),
        )
    }

    /// The accelerations around row `c` against their limits, the jumps of velocity at corners allowed for.
    fn centre(&self, c: usize, tally: &mut Tally<M>) {
        let (acceleration, rounding) = self.acceleration(c);
        let row = &self.rows[c];
        let weight = 2.0 / (self.step(c) + self.step(c + 1));
        let mut corners = None;
        for k in 0..M {
            let value = acceleration[k].abs() - rounding[k];
            let mut limit = self.limits.acceleration[k];
            if value > limit && self.limits.jump[k] > 0.0 {
                let corners = *corners.get_or_insert_with(|| self.corners(c));
                limit += corners * self.limits.jump[k] * weight;
            }
            tally.offer(Check::Acceleration, k, value, limit, row.t, row.line);
        }
    }

    /// Corners passed in the two steps around row `c`.
    fn corners(&self, c: usize) -> f64 {
        match self.plan {
            Some(plan) => plan.corners::<M>(&self.rows[c - 1].spot, &self.rows[c + 1].spot),
            None if self.looks_like_a_corner(c) => 1.0,
            None => 0.0,
        }
    }

    /// Without a path: a corner shows in at most two neighbouring accelerations, whose excess adds up to the jump,
    /// and the velocities before and after differ by no more than a turn at the same speed explains.
    fn looks_like_a_corner(&self, c: usize) -> bool {
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
        if (0..M).any(|k| total[k] > self.limits.jump[k] * PASS_MARK) {
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
        let explained = length(&self.limits.acceleration) * steps * self.limits.period;
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
        let (acceleration, rounding) = self.acceleration(i);
        std::array::from_fn(|k| acceleration[k].abs() - rounding[k] - self.limits.acceleration[k])
    }
}

fn vector<const M: usize>(flat: &[f64], i: usize) -> [f64; M] {
    std::array::from_fn(|k| flat[i * M + k])
}
