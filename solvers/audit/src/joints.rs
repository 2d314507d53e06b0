//! The audit of plans whose limits belong to joints that are not the path's axes: by the recorded formula of the kinematics.

pub mod formula;
pub mod path;
mod phase_jerk;
mod phase_motion;
pub mod plan;
pub(crate) mod profile;
pub mod setpoints;
