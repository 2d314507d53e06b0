//! The profile of the exact planner: its phases, run by run.

use crate::phase_law::PhaseLaw;
use crate::phases::{Phase, Phases};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    pub phases: Phases,
    /// Index of the first phase of each run, and the number of phases.
    pub runs: Vec<i64>,
    /// Pieces where a remedy against rounding slowed the plan, one entry per remedy.
    pub slowed: Vec<u32>,
    left_out: f64,
}

pub(crate) struct Row {
    pub law: PhaseLaw,
    pub axis: u8,
    pub value: f64,
    /// t at the end; the row before gives t at the start.
    pub t: f64,
    pub p: [f64; 2],
    pub duration: f64,
    /// The phase continues the one before it if that has the same law, axis and value.
    pub joins: bool,
}

impl Profile {
    /// No phases, with memory for this many.
    pub(crate) fn with_capacity(phases: usize) -> Self {
        let phases = Phases { a0: vec![], a1: vec![], ..Phases::with_capacity(phases) };
        Self { phases, ..Self::default() }
    }

    /// Joins profiles in the order of the path.
    pub(crate) fn join(parts: Vec<Self>) -> Self {
        let (mut all, mut phases, mut count) = (Self::default(), vec![], 0);
        for part in parts {
            all.runs.extend(part.runs.iter().map(|start| start + count));
            all.slowed.extend(part.slowed);
            count += part.phases.len() as i64;
            phases.push(part.phases);
        }
        all.runs.push(count);
        Self { phases: Phases::joined(phases), ..all }
    }

    /// Ends a run; its last phase gets the time of the phases after it that were too short to be kept.
    pub(crate) fn end_run(&mut self) {
        let left_out = std::mem::take(&mut self.left_out);
        if let Some(last) = self.phases.duration.last_mut() {
            *last += left_out;
        }
    }

    /// Keeps the first phases only.
    pub(crate) fn truncate(&mut self, phases: usize) {
        self.phases.truncate(phases);
        self.left_out = 0.0;
    }

    /// Appends a phase of piece `piece`; t and p refer to the parameter t = u/width. A phase too short to change u is left out,
    /// and the next phase gets its time.
    #[inline(always)]
    pub(crate) fn push(&mut self, piece: u32, width: f64, row: Row) {
        let phases = &mut self.phases;
        let last = phases.len().wrapping_sub(1);
        let goes_on = last < phases.len() && phases.piece[last] == piece;
        let (u0, u1) = (if goes_on { phases.u1[last] } else { 0.0 }, row.t * width);
        let duration = row.duration + std::mem::take(&mut self.left_out);
        let scale = width * width;
        let (p0, p1) = (row.p[0] * scale, row.p[1] * scale);
        let Row { law, axis, value, .. } = row;
        if u1 <= u0 {
            self.left_out = duration;
            if goes_on {
                phases.p1[last] = p1;
            }
            return;
        }
        if row.joins
            && goes_on
            && phases.kind[last] == law as u8
            && phases.axis[last] == axis
            && phases.value[last] == value
        {
            phases.u1[last] = u1;
            phases.p1[last] = p1;
            phases.duration[last] += duration;
            return;
        }
        let phase = Phase { piece, law, axis, value, u0, u1, p0, p1, duration, a0: 0.0, a1: 0.0 };
        phases.push_without_acceleration(&phase);
    }
}
