//! Evaluates joints that are not the path's axes, by the recorded formula of the kinematics.

pub(crate) mod columns;
pub mod formula;
pub mod path;
pub(crate) mod travel;
