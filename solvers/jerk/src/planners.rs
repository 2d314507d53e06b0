//! The functions of this crate's planners for a problem of the package, compiled for several numbers of axes.

use feedplan_geometry::instances;
use feedplan_planner::problem::Fault;

use crate::jerk_profile::JerkProfile;
use crate::path_problem::Effort;
use crate::s_curve::on_path::Cutting;
use crate::s_curve::{Section, Segment};

instances! {
    /// Plans of a problem within `jerk` [mm/s³] of every axis.
    pub trait JerkLimited for [3, 9] feedplan_planner::problem::Problem<'_, M> = {
        /// The fastest profile that the effort finds.
        fn jerk_limited(&self, jerk: &[f64; M], effort: &Effort) -> Result<JerkProfile, Fault>
            = crate::jerk_limited::on_path::plan;
        /// The two-pass profile; each subrun takes the cutting that gives the least time.
        fn s_curve(&self, jerk: &[f64; M], cuttings: &[Cutting], look_ahead: usize, effort: &Effort)
            -> Result<JerkProfile, Fault> = crate::s_curve::on_path::plan;
        /// The segments of each subrun that `s_curve` plans on.
        fn segments(&self, jerk: &[f64; M], cuttings: &[Cutting], look_ahead: usize)
            -> Result<Vec<Vec<Segment>>, Fault> = crate::s_curve::on_path::cut;
        /// The profile of sections of constant jerk; subrun i has those from `offsets[i]` to `offsets[i + 1]`.
        fn of_sections(&self, jerk: &[f64; M], offsets: &[usize], sections: &[Section]) -> Result<JerkProfile, Fault>
            = crate::s_curve::on_path::of_sections;
        /// The greatest speed [mm/s] along the axes' path at which the tool keeps the feed on a part of a piece.
        fn feed_between(&self, piece: usize, part: [f64; 2]) -> f64 = crate::feed::between;
    }
}
