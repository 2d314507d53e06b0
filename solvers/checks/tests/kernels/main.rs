//! Tests of kernels from outside of their crates, in one binary: what they instantiate is compiled once.

mod fit;
mod gcode_fuzz;
mod jerk_limited;
mod kinematics;
mod path_dynamics;
mod planning;
mod s_curve;
mod sampling;
mod smooth_fit;
