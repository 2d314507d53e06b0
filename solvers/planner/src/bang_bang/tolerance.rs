//! The tolerances of the exact planner, each with the quantity that it is a fraction of and the reason of its size.
//!
//! Two sources of error are behind all of them (ε = 2.2e-16, n: degree):
//!
//! * *Input*: control points are rounded, so tangents are known to about n ε of the coordinates. The direction of a
//!   short tangent is not known.
//! * *Sums*: a coefficient of a product, or of a sum of some ten terms, has an error of some 10 ε of the sum of the
//!   terms' magnitudes: 2e-15. A test is a sum of such products: some 100 ε, 2e-14.
//!
//! A tolerance greater than its error treats slightly different values as equal, which lowers p by a smaller fraction than the
//! tolerance. With a tolerance smaller than its error, rounding decides, and a pass may make no headway. So each is at least five
//! times its error.

/// A coefficient or value of a polynomial below this fraction of its terms is zero; so is a component below this
/// fraction of the tangent. [sums: 10 ε]
pub const ZERO: f64 = 1e-14;
/// A test (table in `curve::pass`) that fails by less than this fraction of its terms holds. [products: 100 ε]
pub const TEST: f64 = 1e-13;
/// p counts as on its ceiling if it is below it by at most this fraction. [p at the end of a phase: 100 ε]
pub const ON_CEILING: f64 = 1e-13;
/// Where a root says that a phase crosses its ceiling, p of the phase and of the ceiling must agree to this fraction. [p at a
/// root: 1000 ε]
pub const CROSSES: f64 = 1e-12;
/// Like `ON_CEILING`, where a phase meets the ceiling at its start and both values of p are computed in different ways.
pub const NEARLY_ON_CEILING: f64 = 1e-10;
/// In the backward pass, p counts as on the limit curve if it is below it by at most this fraction. [the limit curve is a
/// quotient of differences]
pub const ON_LIMIT_CURVE: f64 = 1e-10;
/// Accelerations that differ by less than this fraction of the limit are equal. [A − c p may have lost 4 digits]
pub const TIE: f64 = 1e-10;
/// Like `TIE`, where s is a quotient of small differences: next to a turn, and on the limit curve.
pub const WEAK_TIE: f64 = 1e-9;
/// Next to a turn of axis k, p that is below A_k/|c_k| by less than this fraction reaches it within a step too short to count.
pub const NEARLY_FLAT: f64 = 1e-4;
/// On quadratics, whose W is exact: A_k − c_k p is zero below this fraction of A_k. [4 operations]
pub const FLAT: f64 = 8.0 * f64::EPSILON;
/// A step shorter than this fraction of a sub-piece does not count: the other pass cannot see it. [4 roundings of x]
pub const NO_STEP: f64 = 4.0 * f64::EPSILON;
/// A length that is a smaller fraction of the line's length is rounding, and so is such a change of v². [4 operations]
pub const NEGLIGIBLE: f64 = 4.0 * f64::EPSILON;
/// A switch this close to the end of the window is at its end. [x of a root: TEST over the slope of the test]
pub const AT_END: f64 = 1e-11;
/// Cuts closer than this fraction of a piece are the same. [x of a root: 10 ε over the slope]
pub const SAME_CUT: f64 = 1e-13;
/// Turns closer than this fraction of a piece are the same. [zero of a tangent: input and sums over its slope]
pub const SAME_TURN: f64 = 1e-12;
/// A part shorter than this fraction of a piece is not cut again: its ends become one cut. [10 times SAME_TURN]
pub const NARROW: f64 = 1e-11;
/// A remedy that is closer to an end of the part than this fraction of the part cuts it in the middle instead: the end is a cut
/// already.
pub const NEAR_END: f64 = 1e-6;
/// Error of tangents, as a fraction of the longest one.
pub const TANGENT_NOISE: f64 = 1e-14;
/// Error of coordinates, as a fraction of their magnitude, times the degree.
pub const POINT_NOISE: f64 = 1e-15;
/// The error of tangents from `POINT_NOISE` is taken to be at most this fraction of the longest tangent, since a piece may be as
/// short as the rounding of its coordinates.
pub const MAX_NOISE: f64 = 1e-9;
/// A piece is straight if all tangents are off its line by at most this fraction of the longest one [10 ε] …
pub const OFF_LINE: f64 = 2e-15;
/// … and by at most this fraction of their own length [rad; the path treats such directions as equal] …
pub const OFF_ITSELF: f64 = 1e-9;
/// … unless they are shorter than this fraction of the longest one, which is rounding.
pub const NO_TANGENT: f64 = 1e-13;
/// Where |C'|² is below this fraction of its greatest value, a cusp may be near: |C'| has lost five digits.
pub const SLOW_SQ: f64 = 1e-10;
/// Velocity caps are ignored within this distance in t of a turn where |C'|² is below `SLOW_SQ`.
pub const NEAR_CUSP: f64 = 1e-5;
/// Where tangents are below this fraction of the longest one, the check of the limits takes more samples.
pub const SLOW: f64 = 1e-4;
/// The check of the phases lets limits be exceeded by this fraction …
pub const EXCESS: f64 = 1e-9;
/// … and by this one next to a slow end. The audit allows the same.
pub const EXCESS_NEAR_REST: f64 = 1e-6;
/// An axis whose g_k/A_k is below this fraction of the greatest one counts as turning. At this size of g_k, the rounding error of
/// s_k = (A_k − c_k p)/g_k is about ε/NEAR_TURN of the s of the other axes.
pub const NEAR_TURN: f64 = 1e-6;
/// Differences of products below this fraction of their terms get their rounding errors added. [keeps 11 digits]
pub const CANCELLED: f64 = 1e-5;
/// Where rounding hides a tangential contact, a cap is followed with an acceleration too high by this fraction: the
/// first value, then the next ones until the contact is clear.
pub const SLACK: [f64; 5] = [1e-14, 1e-13, 1e-12, 1e-11, 1e-10];
/// A radius of curvature within this fraction of the chord tolerance is equal to it; the limit has a kink there.
pub const AT_KINK: f64 = 1e-9;
/// A requested speed at an end of the path may exceed the reachable one by this fraction.
pub const REACHED: f64 = 1e-12;
/// Backward passes from rest and from any speed that agree to this fraction have met. [their last phase is the same]
pub const MET: f64 = 1e-15;
/// Accuracy of the time along a cap, as a fraction of it.
pub const TIME: f64 = 1e-14;
