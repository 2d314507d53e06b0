//! From a speed profile to the motion at any time: setpoints, and their text.

pub mod csv;
pub mod phase_motion;
pub mod sampling;
