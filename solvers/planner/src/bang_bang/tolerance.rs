//! The tolerances of the exact planner, each with what it is a part of and where it comes from.
//!
//! Two sources of error stand behind all of them, with ε = 2.2e-16:
//!
//! * *Input*: control points are rounded, so that tangents are known to about n ε of the coordinates. Where a tangent is
//!   short, its direction is not known.
//! * *Sums*: a coefficient of a product or of a sum of some ten terms is off by some 10 ε of the sum of their sizes: 2e-15.
//!   A test is a sum of such products: some 100 ε, 2e-14.
//!
//! A tolerance above its error takes what differs a little for equal, and gives away less than itself of p; one below the
//! error lets rounding decide, and a pass may make no headway. So each is at least five times its error.

/// A coefficient or a value of a polynomial below this part of its terms is zero; so is a tangent's component below this
/// part of the tangent. [sums: 10 ε]
pub const ZERO: f64 = 1e-14;
/// A test (the table in `curve::pass`) that misses by this part of its terms is kept. [sums of products: 100 ε]
pub const TEST: f64 = 1e-13;
/// p this close below its bound is on it. [the end of a phase: 100 ε]
pub const ON_BOUND: f64 = 1e-13;
/// Where a phase crosses its bound, by a root, the two agree to this part. [p at x of a root: 1000 ε]
pub const CROSSES: f64 = 1e-12;
/// The same where a phase from there meets the bound at once: the two were computed in different ways.
pub const NEARLY_ON_BOUND: f64 = 1e-10;
/// Backward, p this close below the limit curve is on it. [the limit curve is a quotient of differences]
pub const ON_LIMIT_CURVE: f64 = 1e-10;
/// Accelerations this close to each other, in parts of the limit, are equal. [A − c p may have lost 4 digits]
pub const TIE: f64 = 1e-10;
/// The same where s is a quotient of small differences: next to a turn of an axis, and on the limit curve.
pub const WEAK_TIE: f64 = 1e-9;
/// The same where p grows to A_k/|c_k| without a step.
pub const NEARLY_FLAT: f64 = 1e-4;
/// On quadratics, whose W is exact: A_k − c_k p is zero below this part of A_k. [4 operations]
pub const FLAT: f64 = 8.0 * f64::EPSILON;
/// A step shorter than this part of a sub-piece is none: it is not seen from the other end. [4 roundings of x]
pub const NO_STEP: f64 = 4.0 * f64::EPSILON;
/// A shorter part of a line's length, or of v², than this is rounding. [4 operations]
pub const NO_PART: f64 = 4.0 * f64::EPSILON;
/// A switch this close to the end of the window is at its end. [x of a root: TEST over the slope of the test]
pub const AT_END: f64 = 1e-11;
/// Cuts closer than this part of a piece are one. [x of a root: 10 ε over the slope]
pub const SAME_CUT: f64 = 1e-13;
/// Turns closer than this part of a piece are one. [x where a tangent is zero: input and sums over its slope]
pub const SAME_TURN: f64 = 1e-12;
/// A part shorter than this part of a piece is not cut once more: its ends become one cut. [10 times SAME_TURN]
pub const NARROW: f64 = 1e-11;
/// A remedy this close to the end of a part, in parts of it, is asked for in its middle: at its end there is a cut.
pub const NEAR_END: f64 = 1e-6;
/// Tangents are known to this part of the longest one, …
pub const TANGENT_NOISE: f64 = 1e-14;
/// … coordinates to this part of their size, times the degree, …
pub const POINT_NOISE: f64 = 1e-15;
/// … which counts up to this part of the longest tangent: a piece may be as short as the rounding of its coordinates.
pub const MOST_NOISE: f64 = 1e-9;
/// All tangents of a straight piece are off its line by no more than this part of the longest one [10 ε], …
pub const OFF_LINE: f64 = 2e-15;
/// … and by no more than this part of themselves [rad; the path takes such directions for one], …
pub const OFF_ITSELF: f64 = 1e-9;
/// … unless they are shorter than this part of the longest one, which is rounding.
pub const NO_TANGENT: f64 = 1e-13;
/// Where |C'|² is below this part of its greatest value, a cusp may be near: |C'| has five digits less.
pub const SLOW_SQ: f64 = 1e-10;
/// Closer than this to a turn that is so slow, no velocity cap counts.
pub const NEAR_CUSP: f64 = 1e-5;
/// Next to a place with tangents below this part of the longest one the limits are checked closely.
pub const SLOW: f64 = 1e-4;
/// A check of the phases lets limits be exceeded by this part, …
pub const EXCESS: f64 = 1e-9;
/// … and by this next to a slow end. The audit allows as much.
pub const EXCESS_NEAR: f64 = 1e-6;
/// An axis whose tangent is below this part of the others', each measured by its acceleration limit, is as good as
/// turning round. Between s and p ≤ A_k/|c_k| a part ε/NEAR_TURN of the digits is lost.
pub const NEAR_TURN: f64 = 1e-6;
/// A difference of products below this part of its terms is computed with their rounding errors. [keeps 11 digits]
pub const CANCELLED: f64 = 1e-5;
/// Where a tangential contact is lost in rounding, a cap is followed with an acceleration too high by a part that grows
/// from the first to the last of these until the contact is clear.
pub const SLACK: [f64; 5] = [1e-14, 1e-13, 1e-12, 1e-11, 1e-10];
/// A radius of curvature this close to the chord tolerance is equal to it; the limit has a kink there.
pub const AT_KINK: f64 = 1e-9;
/// A speed asked for at an end of the path may exceed what can be had by this part.
pub const REACHED: f64 = 1e-12;
/// Backward passes from rest and from any speed that agree to this part have met. [their last phase is the same]
pub const MET: f64 = 1e-15;
/// The time along a cap is integrated to this part.
pub const TIME: f64 = 1e-14;
