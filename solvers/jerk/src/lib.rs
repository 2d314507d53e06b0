//! Plans under limits of jerk: the jerk-limited optimum and the heuristic S-curve, by the length of the path.

pub mod by_length;
pub mod curvature_jumps;
pub mod feed;
pub mod jerk_arcs;
pub mod jerk_limited;
pub mod jerk_limited_path;
mod lanes;
pub mod path_dynamics;
pub mod s_curve;
pub mod s_curve_path;
pub mod stretches;

use feedplan_geometry::instances;
use feedplan_planner::problem::Fault;

use jerk_arcs::Arcs;
use jerk_limited::Effort;
use s_curve::Section;
use s_curve_path::{Cutting, Segmented};

instances! {
    /// Plans of a problem within `jerk` [mm/s³] of every axis.
    pub trait JerkLimited for [3, 6, 9] feedplan_planner::problem::Problem<'_, M> = {
        /// The fastest profile that the effort finds.
        fn jerk_limited(&self, jerk: &[f64; M], effort: &Effort) -> Result<Arcs, Fault>
            = jerk_limited_path::plan;
        /// A time [s] that no profile is below, of each stretch, on the grid of a profile.
        fn jerk_limited_bound(&self, jerk: &[f64; M], columns: &jerk_limited_path::Columns, effort: &Effort)
            -> Result<Vec<f64>, Fault> = jerk_limited_path::certified;
        /// The two-pass profile of segments by the quickest cutting.
        fn s_curve(&self, jerk: &[f64; M], cuttings: &[Cutting], look_ahead: usize, effort: &Effort)
            -> Result<Arcs, Fault> = s_curve_path::plan;
        /// The segments of that.
        fn segments(&self, jerk: &[f64; M], cuttings: &[Cutting], look_ahead: usize)
            -> Result<Segmented, Fault> = s_curve_path::cut;
        /// The profile of sections of constant jerk; those of stretch i from `offsets[i]` on.
        fn of_sections(&self, jerk: &[f64; M], offsets: &[usize], sections: &[Section]) -> Result<Arcs, Fault>
            = s_curve_path::follow;
        /// The greatest speed [mm/s] along a part of a piece that keeps the feed everywhere on it.
        fn feed_between(&self, piece: usize, part: [f64; 2]) -> f64 = feed::between;
    }
}
