//! Speed profiles under limits of jerk [mm/s³] of every axis, along a path of the package: the jerk-limited optimum
//! (`jerk_limited`) and the two-pass S-curve heuristic (`s_curve`).
//!
//! Both plan along the arc length s [mm] of the axes' path (`arc_length_path`), between two places of rest (`subruns`),
//! and return columns of phases (`jerk_profile`).

pub mod arc_length_path;
pub mod curvature_jumps;
pub mod feed;
pub mod jerk_limited;
pub mod jerk_profile;
#[cfg(test)]
mod one_piece;
pub mod path_limits;
mod path_problem;
mod planners;
pub mod s_curve;
pub mod subruns;

pub use planners::JerkLimited;
