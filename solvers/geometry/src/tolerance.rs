//! The tolerances of this crate, each with its unit and the reason for its size (ε = 2.2e-16, n: degree).
//!
//! Two sources of error are behind them:
//!
//! * *Coordinates*: a control point is known to a few ε of its coordinates, the direction of an edge of length e to a few
//!   ε |C|/e.
//! * *Sums*: a coefficient of a product of two polynomials has an error of about n ε times the sum of the magnitudes of its
//!   terms.

/// A distance below this fraction of the greatest coordinate is rounding. [coordinates: of control points, of the spline from
/// which they were extracted, and of a few sums]
pub const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Directions are equal if they differ by less than this, in rad, plus the rounding of an edge. [half of the turn that the path
/// accepts where pieces meet]
pub const SAME_DIRECTION: f64 = 5e-10;
/// An edge of a control polygon below this fraction of the piece has no direction.
pub const NO_DIRECTION: f64 = 1e-12;
/// A place is a cusp if |C'| is below this fraction of its greatest value. [far above rounding; a machine passes such a place as
/// slowly as a cusp]
pub const CUSP: f64 = 1e-9;
/// A coefficient of |C'|² below this fraction of the greatest one is rounding. [sums]
pub const SQUARE_ROUNDING: f64 = 1e-14;
/// A cusp nearer to an end than this fraction of the piece is at the end.
pub const AT_END: f64 = 1e-9;
/// Control points that should coincide may differ by this fraction of their coordinates. [rounding in files]
pub const COINCIDENT: f64 = 1e-9;
/// Different knots closer to each other than this fraction of the greatest one are refused. [their difference has only three
/// digits]
pub const KNOT_SPAN: f64 = 1e-13;
/// A Newton step below this fraction of the root is the last one: the next one would be about its square, below rounding.
pub const LAST_STEP: f64 = 3e-9;
/// The error of length tables as a fraction of their length. [so that steps down to 1e-7 of a table are accurate to 1e-6]
pub const TABLE: f64 = 1e-13;
/// C'' counts as 0 if it changes |C'|² by less than this fraction along a piece. [below rounding of |C'|]
pub const NO_CURVATURE: f64 = 1e-40;
/// The rounding error of a product that underflows is at most this: 2⁻¹⁰⁷².
pub const UNDERFLOW: f64 = f64::from_bits(4);
