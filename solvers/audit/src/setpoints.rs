//! Audits a stream of setpoints: difference quotients against the limits, and each setpoint against its plan.
//!
//! Between chunks only the last few setpoints are kept. Most setpoints cannot raise the use of any limit: `at_once` finds these
//! quickly.

pub mod at_once;

use std::ops::Range;

use super::against_plan::Comparison;
use super::deviation::offer_travel;
use super::differences::{Differences, Quotient};
use super::parallel;
use super::rows::{Nearest, Row};
use super::tracking::{self, Plan};
use super::vectors::{length, vector};
use super::{Check, Limits, Seen, Tally, PLACE_TOLERANCE};

/// Setpoints before and after the one at which an acceleration is judged.
const AROUND: usize = 3;

/// Number of setpoints that a new one may be compared with.
const KEPT: usize = 2 * AROUND + 1;

/// Setpoints that a thread takes at a time.
const BLOCK: usize = 2048;

/// Consecutive setpoints: times in s, positions of all axes in mm, and what else is recorded.
#[derive(Clone, Copy)]
pub struct Chunk<'a> {
    /// At most `M`.
    pub axes: usize,
    pub t: &'a [f64],
    pub position: &'a [f64],
    pub velocity: Option<&'a [f64]>,
    pub acceleration: Option<&'a [f64]>,
    pub line: Option<&'a [i32]>,
}

impl<'a> Chunk<'a> {
    fn part(&self, rows: Range<usize>) -> Self {
        let of_axes = |table: &'a [f64]| &table[self.axes * rows.start..self.axes * rows.end];
        Self {
            axes: self.axes,
            t: &self.t[rows.clone()],
            position: of_axes(self.position),
            velocity: self.velocity.map(of_axes),
            acceleration: self.acceleration.map(of_axes),
            line: self.line.map(|line| &line[rows.clone()]),
        }
    }

    /// Setpoint `i`; its place on the path is not set yet.
    pub(crate) fn row<const M: usize>(&self, i: usize) -> Row<M> {
        let of = |table| vector(table, self.axes, i);
        Row {
            t: self.t[i],
            q: of(self.position),
            velocity: self.velocity.map(of),
            acceleration: self.acceleration.map(of),
            line: self.line.map_or(0, |line| line[i]),
            nearest: Nearest::default(),
        }
    }
}

/// The audit of a stream; its state between chunks.
pub struct Stream<const M: usize> {
    limits: Limits<M>,
    /// Last digit of positions that were written as text, in mm.
    resolution: f64,
    kept: Vec<Row<M>>,
    count: u64,
    /// Starts of the runs of the plan on the clock of the setpoints, in s.
    clock: Vec<f64>,
    tally: Tally<M>,
}

impl<const M: usize> Stream<M> {
    pub fn new(limits: Limits<M>, resolution: f64) -> Self {
        Self { limits, resolution, kept: Vec::new(), count: 0, clock: Vec::new(), tally: Tally::default() }
    }

    pub fn axes(&self) -> usize {
        self.limits.axes
    }

    /// Audits the next setpoints; `plan` must be the same in every call. After a panic of `seen` the stream must not be used
    /// further.
    pub(crate) fn push(&mut self, plan: Option<&Plan>, chunk: &Chunk, seen: Seen) {
        // One block for each thread at a time: the rows are read twice and stay in the caches.
        let (count, most) = (chunk.t.len(), tracking::BLOCK * parallel::threads());
        for start in (0..count).step_by(most) {
            self.push_part(plan, &chunk.part(start..count.min(start + most)), start == 0, seen);
        }
    }

    /// Only in the first part of a chunk the search for places continues from the row before. Every other part begins like any
    /// block of setpoints, so that the result does not depend on the number of threads.
    fn push_part(&mut self, plan: Option<&Plan>, chunk: &Chunk, is_first: bool, seen: Seen) {
        let old = self.kept.len();
        let mut rows = std::mem::take(&mut self.kept);
        rows.extend((0..chunk.t.len()).map(|i| chunk.row(i)));
        if let Some(plan) = plan {
            plan.extend_clock(&self.limits, &rows, &mut self.clock);
        }
        let plan = plan.map(|plan| plan.with_clock(&self.clock));
        let plan = plan.as_ref();
        if let Some(plan) = plan {
            plan.find_nearest(&self.limits, &mut rows, (old, is_first), seen);
        }
        let view = View { differences: self.differences(&rows), plan };
        let found = parallel::tally(&self.tally, chunk.t.len(), BLOCK, &|block, tally| {
            seen(block.len());
            view.block(old + block.start..old + block.end, tally);
        });
        let mut first = Tally::default();
        if self.count == 0 && !rows.is_empty() {
            view.first(&mut first);
        }
        self.tally = std::mem::take(&mut self.tally).merge(first).merge(found);
        self.count += chunk.t.len() as u64;
        rows.drain(..rows.len().saturating_sub(KEPT));
        self.kept = rows;
    }

    /// Ends the stream: checks what only the last setpoints can show.
    pub(crate) fn finish(self, plan: Option<&Plan>) -> Tally<M> {
        let plan = plan.map(|plan| plan.with_clock(&self.clock));
        let plan = plan.as_ref();
        let rows = &self.kept;
        let view = View { differences: self.differences(rows), plan };
        let mut comparison = plan.map(|plan| Comparison::new(plan, &self.limits));
        let mut tally = Tally::default();
        for centre in rows.len().saturating_sub(AROUND).max(1)..rows.len().saturating_sub(1) {
            view.centre(centre, &view.differences.acceleration(centre), comparison.as_mut(), &mut tally);
        }
        view.last(&mut tally);
        self.tally.merge(tally)
    }

    fn differences<'a>(&'a self, rows: &'a [Row<M>]) -> Differences<'a, M> {
        Differences { limits: &self.limits, resolution: self.resolution, rows }
    }
}

/// Rows that are compared with each other and with the plan.
struct View<'a, const M: usize> {
    differences: Differences<'a, M>,
    plan: Option<&'a Plan<'a>>,
}

/// What is known after the check of row `n` and used for the next row.
struct Recent<const M: usize> {
    /// The steps to rows `n` − 2, `n` − 1 and `n`.
    steps: [f64; 3],
    /// The accelerations around rows `n` − 3, `n` − 2 and `n` − 1.
    accelerations: [Quotient<M>; 3],
}

impl<const M: usize> View<'_, M> {
    /// The first setpoint must be the start of the path, at time 0.
    fn first(&self, tally: &mut Tally<M>) {
        let (Some(plan), row) = (self.plan, &self.differences.rows[0]) else { return };
        let columns = &mut plan.columns(self.differences.limits);
        let away = plan.distance_from_end(columns, (0, false), &row.q);
        tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, row.t, row.line);
        tally.offer(Check::Grid, 0, row.t.abs(), self.differences.uneven(), row.t, row.line);
    }

    /// The last setpoint must be the end of the path.
    fn last(&self, tally: &mut Tally<M>) {
        let (Some(plan), rows) = (self.plan, self.differences.rows) else { return };
        match rows.last() {
            Some(row) => {
                let columns = &mut plan.columns(self.differences.limits);
                let away = plan.distance_from_end(columns, (plan.path.len() - 1, true), &row.q);
                tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, row.t, row.line);
            }
            None => tally.offer(Check::Place, 0, f64::INFINITY, PLACE_TOLERANCE, 0.0, 0),
        }
    }

    /// Checks a range of rows, together with the rows before them.
    fn block(&self, rows: Range<usize>, tally: &mut Tally<M>) {
        let mut comparison = self.plan.map(|plan| Comparison::new(plan, self.differences.limits));
        for start in rows.clone().step_by(at_once::COUNT) {
            self.rows(start..rows.end.min(start + at_once::COUNT), comparison.as_mut(), tally);
        }
    }

    /// Checks at most `at_once::COUNT` rows.
    fn rows(&self, rows: Range<usize>, mut comparison: Option<&mut Comparison<M>>, tally: &mut Tally<M>) {
        let unsure = match rows.start >= at_once::BEFORE {
            true => at_once::settled(&self.differences, &rows, tally),
            false => [f64::NAN; at_once::COUNT],
        };
        let window = &self.differences.rows[rows.start.saturating_sub(at_once::BEFORE)..rows.end];
        let settled = match &mut comparison {
            Some(comparison) if rows.start >= at_once::BEFORE => comparison.settled(window, &unsure, tally),
            _ => [false; at_once::COUNT],
        };
        let (mut recent, period) = (None, self.differences.limits.period);
        for (n, (unsure, settled)) in rows.zip(unsure.into_iter().zip(settled)) {
            if !unsure.is_nan() {
                recent = None;
                tally.samples += 1;
                match &mut comparison {
                    Some(comparison) if settled => {
                        comparison.deviation(&self.differences.rows[n], unsure, tally);
                    }
                    comparison => self.compare(n, (period, unsure), comparison.as_deref_mut(), tally),
                }
                continue;
            }
            let recent = recent.get_or_insert_with(|| self.recent(n));
            self.row(n, recent, comparison.as_deref_mut(), tally);
        }
    }

    /// Fully checks row `n`, together with the rows before it.
    fn row(
        &self,
        n: usize,
        recent: &mut Recent<M>,
        mut comparison: Option<&mut Comparison<M>>,
        tally: &mut Tally<M>,
    ) {
        recent.steps = [recent.steps[1], recent.steps[2], self.differences.step(n)];
        let rounding = self.differences.rounding(n);
        if n >= 2 {
            let newest = self.differences.acceleration_by(n - 1, recent.steps[1], recent.steps[2], &rounding);
            let [_, early, late] = recent.accelerations;
            recent.accelerations = [early, late, newest];
        }
        self.arrival(n, recent, &rounding, tally);
        self.compare(n, (recent.steps[2], length(&rounding)), comparison.as_deref_mut(), tally);
        if n > AROUND {
            self.centre(n - AROUND, &recent.accelerations[0], comparison, tally);
        }
    }

    /// The state before the check of row `n`.
    fn recent(&self, n: usize) -> Recent<M> {
        let step = |back: usize| n.checked_sub(back).map_or(0.0, |row| self.differences.step(row));
        let around = |back: usize| match n.checked_sub(back) {
            Some(centre) if centre >= 1 => self.differences.acceleration(centre),
            _ => Quotient::default(),
        };
        Recent { steps: [step(3), step(2), step(1)], accelerations: [around(4), around(3), around(2)] }
    }

    /// Checks row `n` against the plan; `step` is the time to it in s, `rounding` the error bound of its position in mm.
    fn compare(
        &self,
        n: usize,
        (step, rounding): (f64, f64),
        comparison: Option<&mut Comparison<M>>,
        tally: &mut Tally<M>,
    ) {
        let (Some(comparison), rows) = (comparison, self.differences.rows) else { return };
        comparison.nearest(&rows[n], rounding, tally);
        comparison.deviation(&rows[n], rounding, tally);
        if n > 0 {
            let earlier = n.checked_sub(2).map(|n| &rows[n]);
            comparison.step(earlier, [&rows[n - 1], &rows[n]], step, rounding, tally);
        }
    }

    /// Checks the difference quotients of row `n` and the rows before it.
    fn arrival(&self, n: usize, recent: &Recent<M>, rounding: &[f64; M], tally: &mut Tally<M>) {
        let (limits, rows) = (self.differences.limits, self.differences.rows);
        let row = &rows[n];
        let (time, line) = (row.t, row.line);
        tally.samples += 1;
        let bad = if row.is_finite() { 0.0 } else { f64::INFINITY };
        tally.offer(Check::Numbers, 0, bad, 0.0, time, line);
        for k in 0..M {
            offer_travel(tally, limits, k, row.q[k], time, line);
        }
        if n > 0 {
            let (before, step) = (&rows[n - 1], recent.steps[2]);
            self.grid(n, tally);
            let per_step = 1.0 / step;
            for k in 0..M {
                let way = row.q[k] - before.q[k];
                let velocity = (way.abs() - 2.0 * rounding[k]) * per_step;
                tally.offer(Check::Velocity, k, velocity, limits.velocity.of(k, way), time, line);
            }
            self.recorded(n, [step, per_step], rounding, tally);
        }
        if n >= 3 {
            self.jerk(n, recent, tally);
        }
    }

    /// Every step must be one period long; only the very last one may be shorter.
    fn grid(&self, n: usize, tally: &mut Tally<M>) {
        let (differences, rows) = (&self.differences, self.differences.rows);
        let (row, before, period) = (&rows[n], &rows[n - 1], differences.limits.period);
        let step = row.t - before.t;
        let off = if differences.is_even(step, row.t) || (step > 0.0 && step < period) {
            0.0
        } else {
            (step - period).abs()
        };
        tally.offer(Check::Grid, 0, off, differences.uneven(), row.t, row.line);
        if n >= 2 {
            let step_before = before.t - rows[n - 2].t;
            if !differences.is_even(step_before, before.t) {
                let off = (step_before - period).abs();
                tally.offer(Check::Grid, 0, off, differences.uneven(), before.t, before.line);
            }
        }
    }

    /// Recorded velocities: their mean over a step may differ from the mean velocity by what the acceleration limits and a jump
    /// explain (`mean_velocity_off`). Recorded accelerations must be within the limit.
    fn recorded(&self, n: usize, [step, per_step]: [f64; 2], rounding: &[f64; M], tally: &mut Tally<M>) {
        let (limits, rows) = (self.differences.limits, self.differences.rows);
        let (row, before) = (&rows[n], &rows[n - 1]);
        if let (Some(new), Some(old)) = (row.velocity, before.velocity) {
            for k in 0..M {
                let mean = (row.q[k] - before.q[k]) * per_step;
                let off = (mean - 0.5 * (new[k] + old[k])).abs() - 2.0 * rounding[k] * per_step;
                let limit = limits.mean_velocity_off(k, step);
                tally.offer(Check::RecordedVelocity, k, off, limit, row.t, row.line);
            }
        }
        if let Some(acceleration) = row.acceleration {
            for k in 0..M {
                let (value, limit) = (acceleration[k].abs(), limits.acceleration.of(k, acceleration[k]));
                tally.offer(Check::RecordedAcceleration, k, value, limit, row.t, row.line);
            }
        }
    }

    /// Mean jerk over three steps against its limit.
    fn jerk(&self, n: usize, recent: &Recent<M>, tally: &mut Tally<M>) {
        let (row, limits) = (&self.differences.rows[n], self.differences.limits);
        let span: f64 = recent.steps.iter().sum();
        let [_, early, late] = &recent.accelerations;
        let jerk = self.differences.jerk(early, late, span);
        for k in 0..M {
            tally.offer(Check::Jerk, k, jerk[k], limits.jerk[k], row.t, row.line);
        }
    }

    /// The mean accelerations around row `c` against their limits, plus the allowed jumps of velocity at corners.
    fn centre(
        &self,
        c: usize,
        acceleration: &Quotient<M>,
        comparison: Option<&mut Comparison<M>>,
        tally: &mut Tally<M>,
    ) {
        let (limits, rows) = (self.differences.limits, self.differences.rows);
        let (mut corners, mut comparison) = (None, comparison);
        for k in 0..M {
            let value = acceleration.value[k].abs() - acceleration.rounding[k];
            let mut limit = limits.acceleration.of(k, acceleration.value[k]);
            if value > limit && limits.jump_beyond[k] > 0.0 {
                let corners = *corners.get_or_insert_with(|| match &mut comparison {
                    Some(comparison) => comparison.corners([&rows[c - 1], &rows[c], &rows[c + 1]]),
                    None if self.differences.looks_like_a_corner(c) => 1.0,
                    None => 0.0,
                });
                let time = 0.5 * (self.differences.step(c) + self.differences.step(c + 1));
                limit += corners * limits.jump_beyond[k] / time;
            }
            tally.offer(Check::Acceleration, k, value, limit, rows[c].t, rows[c].line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Followed, Pieces};
    use crate::joints::path::{JointPath, Words};
    use crate::nearest::Place;
    use crate::phases::{Phases, FEED};
    use crate::profile_clock::ProfileClock;
    use crate::station::Rounded;
    use crate::Sided;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn rows_that_are_looked_at_at_once_show_what_they_show_one_after_the_other(
            broken in 0..600_usize, what in 0..14_u8, by in -1.0..1.0_f64,
            travels: bool, records: bool, has_plan: bool, has_joints: bool, has_chord: bool,
        ) {
            // Two axes that oscillate; one row may be changed in some way. From row 300 on, the rows are on the next piece.
            let mut rows: Vec<Row<3>> = (0..600)
                .map(|i| {
                    let t = 1e-3 * f64::from(i);
                    let (x, y) = ((9.0 * t).sin_cos(), (13.0 * t).sin_cos());
                    let velocity = [9.0 * x.1, 13.0 * y.1, 0.0];
                    let nearest = Nearest {
                        place: Place { piece: usize::from(i >= 300), u: 10.0 * (t - if i < 300 { 0.0 } else { 0.3 }) },
                        bend: 0.1 + 0.05 * x.0,
                        off: 1e-9 * y.0,
                        late: 1e-9 * x.0,
                        velocity: Rounded { value: velocity.map(|v| v + 1e-9), rounding: [1e-12; 3] },
                        acceleration_off: [0.01 * x.0, 0.02 * y.0, 0.0],
                        ..Nearest::default()
                    };
                    Row {
                        t,
                        q: [x.0, y.0, 0.0],
                        velocity: records.then_some(velocity),
                        acceleration: records.then_some([-81.0 * x.0, -169.0 * y.0, 0.0]),
                        line: i,
                        nearest,
                    }
                })
                .collect();
            let row = &mut rows[broken];
            match what {
                0 => row.q[1] += 1e-3 * by,
                1 => row.t += 1e-5 * by,
                2 => row.velocity = row.velocity.map(|[x, y, z]| [x, y + by, z]),
                3 => row.acceleration = row.acceleration.map(|[x, y, z]| [x + 200.0 * by, y, z]),
                4 => row.q[0] = if by < 0.0 { f64::NAN } else { f64::INFINITY },
                5 => row.velocity = None,
                6 => row.nearest.off = 2e-6 * by,
                7 => row.nearest.late = 2e-6 * by,
                8 => row.nearest.velocity.value[0] += by,
                9 => row.nearest.acceleration_off[1] = by,
                10 => row.nearest.bend = 2.0 * by.abs(),
                11 => row.nearest.place.u += 1e-2 * by,
                12 => row.nearest.place.piece = 1,
                _ => {}
            }
            let sided = |limit: f64| Sided { positive: [limit; 3], negative: [0.9 * limit; 3] };
            let mut limits = Limits { axes: 2, velocity: sided(12.0), acceleration: sided(150.0), ..Limits::none() };
            limits.jerk = [1000.0, f64::INFINITY, 0.0];
            if has_chord {
                limits.chord_tolerance = 1e-5;
            }
            if travels {
                limits.travel[0] = [-1.0, 2.0];
            }
            let pieces = Pieces {
                axes: 2,
                stride: 2,
                control: &[0.0, 0.0, 3.0, 0.0, 3.0, 0.0, 6.0, 0.0],
                weights: &[],
                offsets: &[0, 2, 4],
                width: &[3.0, 3.0],
            };
            let any = f64::INFINITY;
            let feed = [10.0, any, any, any, 12.0, 15.0, any, any];
            let path = Followed { feed: &feed, line: &[1, 2], tolerance: &[0.0; 2], runs: &[0, 2], ..Followed::of_one(pieces) };
            let (kind, axis, value, u, p) = ([FEED], [255], [100.0], [0.0, 3.0], [100.0; 2]);
            let phases = Phases::of_one(&kind, &axis, &value, &u, &p);
            let profile = Some(ProfileClock { phases, starts: &[0.0, 0.3], run_starts: &[0.0] });
            let (words, feed) = (Words::polar(), [10.0, 12.0]);
            let joints = JointPath::of_one(path, &words, &feed);
            let joints = has_joints.then_some(&joints);
            let plan = Plan { path, profile, program: None, deviation: 0.0, joints };
            let stream = Stream::new(limits, 1e-9);
            let view = View { differences: stream.differences(&rows), plan: has_plan.then_some(&plan) };
            let (mut found, mut wanted) = (Tally::default(), Tally::default());
            view.block(0..rows.len(), &mut found);
            let mut comparison = view.plan.map(|plan| Comparison::new(plan, &stream.limits));
            for n in 0..rows.len() {
                view.row(n, &mut view.recent(n), comparison.as_mut(), &mut wanted);
            }
            prop_assert_eq!(found.samples, wanted.samples);
            for (check, k) in Check::ALL.into_iter().flat_map(|check| [(check, 0), (check, 1)]) {
                let [found, wanted] = [&found, &wanted].map(|tally| {
                    let worst = tally.get(check, k);
                    (worst.ratio, worst.time, worst.line)
                });
                prop_assert_eq!(found, wanted, "{:?} {}", check, k);
            }
        }
    }
}
