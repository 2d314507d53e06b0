//! A plan whose limits belong to joints that are not the path's axes, as its audits take it.

use super::path::JointPath;
use crate::phases::Phases;
use crate::Limits;

/// What an audit of joints knows.
pub struct JointAudit<'a, const M: usize> {
    pub path: JointPath<'a>,
    pub phases: Phases<'a>,
    pub limits: Limits<M>,
    /// When each phase begins, and the last one ends.
    pub starts: &'a [f64],
}

impl<const M: usize> JointAudit<'_, M> {
    /// Whether a phase is the first of a run.
    pub fn is_first(&self, phase: usize) -> bool {
        self.phases.runs.binary_search(&(phase as i64)).is_ok()
    }
}
