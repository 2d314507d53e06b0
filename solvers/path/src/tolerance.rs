//! The tolerances of this crate, each with its unit and the reason for its size. Those of the smooth fit are in `smooth_fit`.
//!
//! Three sources of error are behind them (ε = 2.2e-16):
//!
//! * *Coordinates*: a coordinate x is rounded, in the program and in sums of offsets, to a few ε |x|. The direction of an edge of
//!   length e between two points is therefore known to a few ε |x|/e.
//! * *Program*: a CAM system writes three to six decimals. In the file, a line that touches an arc meets it with a turn of up to
//!   a degree, and the radii at both ends of an arc differ by the rounding of the coordinates.
//! * *Sums*: the bound of a deviation is a sum of a few terms, each rounded to its relative precision ε.

/// The error of a coordinate, of an edge between two points or of a sum of a few coordinates is at most this times the
/// coordinate.
pub const COORDINATE: f64 = 16.0 * f64::EPSILON;

// Directions, in rad.

/// Two edges are one line if they turn by less than this. [the exact planner accepts the same error: its OFF_ITSELF]
pub const SAME_DIRECTION: f64 = 1e-9;
/// An angle is a quarter turn if it differs from it by less than this. [4 roundings]
pub const SAME_ANGLE: f64 = 4.0 * f64::EPSILON;
/// An exact path is smoothed where an arc or a spline meets its neighbour with a smaller turn than this. [program: 1°]
pub const ROUNDED_TANGENT: f64 = 0.0175;
/// A smooth path stops where the program turns by more than this: no curve passes both sides of the corner at any speed. [135°]
pub const REVERSAL: f64 = 2.356;
/// Two edges are opposite if their turn differs from half a circle by less than this. [program: a planner that does not stop
/// there checks it itself]
pub const OPPOSITE: f64 = 1e-6;
/// The same as REVERSAL for a smooth path that is fitted to a speed: it stops only close to a full reversal. [177.6°]
pub const FITTED_REVERSAL: f64 = 3.1;
/// Corners that turn back are not rounded if cos(turn/2) is below this, because they are passed near rest anyway. [177.7°]
pub const REVERSAL_COSINE: f64 = 0.02;
/// The sweep of an arc is corrected by at most this so that it ends at the programmed end point. [program, on a small radius]
pub const SWEEP: f64 = 0.1;

// Lengths, in mm.

/// A position counts as within the travel if it exceeds it by at most this. [coordinates, as sums of offsets]
pub const TRAVEL: f64 = 1e-6;

// Fractions of a speed.

/// A feed below this fraction of the greatest speed counts as rest: a stop where it meets a rapid costs milliseconds, and the
/// speeds within one run then stay within the range that planners can resolve.
pub const CRAWL: f64 = 1e-4;

// Fractions of the allowed deviation.

/// A deviation may exceed the allowed one by this fraction. [sums]
pub const EXCESS: f64 = 1e-9;
/// A blend that exceeds the tolerance is shortened in proportion and by this fraction more. [so that the iteration ends]
pub const SHORTER: f64 = 1e-5;
/// No blend is shorter than this times the tolerance: shorter ones would gain no time.
pub const SHORTEST_BLEND: f64 = 0.01;
/// Chords of arcs and splines may use this fraction of the tolerance of a smooth path.
pub const CHORD: f64 = 0.02;
/// Points closer to each other than this fraction of the tolerance are one point of a smooth path.
pub const SAME_POINT: f64 = 1e-3;
/// At least this fraction of the tolerance is left to the smooth fit, whatever its chords use.
pub const LEFT_TO_FIT: f64 = 1e-2;
/// Points off a line by less than this fraction (and by `COLINEAR_ROUNDING`) are collinear …
pub const COLINEAR: f64 = 1e-6;
/// … and a sequence of them is a line if all are within this fraction of it, so that small deviations have not added up.
pub const STRAIGHT: f64 = 1e-3;
/// Where the fit passes a point at an offset, the offset is at most this fraction of the tolerance.
pub const OFFSET: f64 = 0.75;
/// With an offset, bulges of up to twice the tolerance can be fitted; bulges beyond this many tolerances are not tried.
pub const HOPELESS: f64 = 2.25;

// Fractions of a length.

/// Points that are off a line by at most this fraction of the greatest coordinate are on it. [coordinates: 8 ε]
pub const COLINEAR_ROUNDING: f64 = 8.0 * f64::EPSILON;
/// If two blends leave less than this fraction of the span between them, the rest is dropped: the blends touch.
pub const TOUCHING: f64 = 1e-6;
/// A blend that begins or ends within this fraction of a piece from the piece's end begins or ends exactly there, so that no
/// sliver is left …
pub const AT_PIECE_END: f64 = 1e-6;
/// … if that moves it by less than this fraction of its distance from the nearer corner.
pub const MOVED_CUT: f64 = 1e-3;
/// A piece is not cut at a change of feed within this fraction of its width from an end.
pub const SLIVER: f64 = 1e-6;
/// An arc is not replaced by a circle whose centre is off the programmed one by more than this fraction of the radius.
pub const CENTRE: f64 = 0.1;
