//! The audit of plans whose limits belong to joints that are not the path's axes: by the recorded formula of the kinematics.

mod along;
pub mod formula;
mod jerk;
pub mod kernels;
mod motion;
pub mod path;
pub mod profile;
pub mod setpoints;
