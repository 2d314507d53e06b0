//! Tests of kernels from outside of their crates, in one binary, so that each kernel is compiled for them once.

mod fit;
mod gcode_fuzz;
mod jerk_limited;
mod kinematics;
mod path_dynamics;
mod planning;
mod s_curve;
mod sampling;
mod smooth_fit;
