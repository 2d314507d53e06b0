//! From a speed profile to the motion at any time: setpoints, and their text.

pub mod motion;
pub mod sampling;
pub mod text;
