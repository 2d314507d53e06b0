//! The tolerances of the audit, and the rounding errors that it allows for.

/// A use of a limit (value over limit) passes up to here: a millionth covers the planner's own rounding over 100 000 pieces (some
/// 1e-10) and does not matter to a machine.
pub const PASS_MARK: f64 = 1.0 + PASS_EXCESS;

/// The part of a limit by which the pass mark is above it.
pub const PASS_EXCESS: f64 = 1e-6;

/// Spacing of the floating-point numbers at 1.
pub const EPS: f64 = f64::EPSILON;

/// Rounding error bound of an evaluated position or velocity, in units of `EPS` of the magnitude: it takes some sixteen
/// operations of half a unit each from the stored numbers.
pub const ROUNDINGS: f64 = 8.0;

/// How far, in mm, a setpoint may lie from its place on the path, beyond rounding: a nanometre.
pub const PLACE_TOLERANCE: f64 = 1e-6;

/// How far, in mm, the end of one piece may lie from the start of the next, beyond rounding.
pub const GAP_TOLERANCE: f64 = 1e-9;
