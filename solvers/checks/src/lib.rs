//! The parts that tests of kernels have in common: random problems, curves and polylines, curves by their length, and an audit of
//! profiles that shares no formula with the planner.

mod audit;
mod axes;
pub mod bends;
pub mod by_length;
pub mod campaign;
mod cases;
pub mod curves;
mod elevated;
pub mod jerk;
pub mod polylines;
mod random;
mod regular_path;
pub mod wave;

pub use audit::{audit, Audit};
pub use axes::{padded, AXES, FEW_AXES, PADDED};
pub use campaign::{assert_none, seeds};
pub use cases::{milder_case, random_case, Case};
pub use elevated::{problem, Elevated};
pub use random::Random;
