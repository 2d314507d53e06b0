//! A plan whose limits belong to joints that are not the path's axes, as its audits take it.

use super::path::JointPath;
use crate::phases::Phases;
use crate::profile_clock::ProfileClock;
use crate::Limits;

/// What an audit of joints knows.
pub struct JointAudit<'a, const M: usize> {
    pub path: JointPath<'a>,
    pub phases: Phases<'a>,
    pub limits: Limits<M>,
    /// When each phase begins, and the last one ends.
    pub starts: &'a [f64],
}

impl<'a, const M: usize> JointAudit<'a, M> {
    /// The profile on the clock of setpoints whose runs have begun at these times.
    pub fn clock<'b>(&self, run_starts: &'b [f64]) -> ProfileClock<'b>
    where
        'a: 'b,
    {
        ProfileClock { phases: self.phases, starts: self.starts, run_starts }
    }

    /// Whether a phase is the first of a run.
    pub fn is_first(&self, phase: usize) -> bool {
        self.phases.runs.binary_search(&(phase as i64)).is_ok()
    }
}
