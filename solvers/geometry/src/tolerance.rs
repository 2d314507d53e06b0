//! The tolerances of this crate, each with its unit and the reason of its size (ε = 2.2e-16, n: degree).
//!
//! Two sources of error are behind them:
//!
//! * *Coordinates*: a control point is known to some ε of its coordinates, an edge of length e in its direction to
//!   ε |C|/e.
//! * *Sums*: a coefficient of a product of two polynomials has an error of some n ε of the sum of its terms' magnitudes.

/// A distance below this fraction of the greatest coordinate is rounding. [coordinates: of control points, of the spline
/// that they were extracted from, and of a few sums]
pub const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Directions that differ by less, and by the rounding of an edge, are equal, in rad. [half of what the path allows where
/// pieces meet]
pub const SAME_DIRECTION: f64 = 5e-10;
/// An edge of a control polygon below this fraction of the piece has no direction.
pub const NO_DIRECTION: f64 = 1e-12;
/// |C'| below this fraction of its greatest value is a cusp. [far above rounding; a machine passes such a place as slowly
/// as it passes a cusp]
pub const CUSP: f64 = 1e-9;
/// A coefficient of |C'|² below this fraction of the greatest one is rounding. [sums]
pub const SQUARE_ROUNDING: f64 = 1e-14;
/// A cusp nearer to an end than this fraction of the piece is at the end.
pub const AT_END: f64 = 1e-9;
/// Control points that should coincide may differ by this fraction of their coordinates. [their rounding in files]
pub const COINCIDENT: f64 = 1e-9;
/// Knots nearer than this fraction of the greatest one are refused. [they have three digits left that tell them apart]
pub const KNOT_SPAN: f64 = 1e-13;
/// A Newton step below this fraction of the root is the last one: the next is its square, below rounding.
pub const LAST_STEP: f64 = 3e-9;
/// Error of length tables as a fraction of their length. [so that steps down to 1e-7 of a table are right to 1e-6]
pub const TABLE: f64 = 1e-13;
/// C'' that changes |C'|² by less than this fraction along a piece counts as 0. [below rounding of |C'|]
pub const NO_CURVATURE: f64 = 1e-40;
/// The least number that covers one rounding of any product that underflows: 2⁻¹⁰⁷².
pub const UNDERFLOW: f64 = f64::from_bits(4);
