//! Measures the times of kernels: `cargo run --release -p feedplan-benches -- --bench NAME`, where NAME is the name of a group or
//! a part of it.

mod bang_bang;
mod fit;
mod gcode;
mod jerk_limited;
mod s_curve;
mod sampling;
mod spline;

criterion::criterion_main!(
    bang_bang::benches,
    fit::benches,
    gcode::benches,
    jerk_limited::benches,
    s_curve::benches,
    sampling::benches,
    spline::benches
);
