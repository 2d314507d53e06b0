//! The tolerances of this crate, each with its unit and the reason of its size. Those of the smooth fit stand in `smooth_fit`.
//!
//! Three sources of error are behind them (ε = 2.2e-16):
//!
//! * *Coordinates*: a coordinate x is rounded, in the program and in sums of offsets, to some ε |x|. An edge of length e
//!   between two points has a direction that is known to some ε |x|/e.
//! * *Program*: a CAM system writes three to six decimals. A line that touches an arc meets it in the file with a turn of
//!   up to a degree; both ends of an arc differ in radius by as much as was rounded away.
//! * *Sums*: the bound of a deviation is a sum of a few terms, each rounded to ε of itself.

/// Errors of a coordinate, of an edge between two of them and of a sum of some: this many times ε of the coordinate.
pub const COORDINATE: f64 = 16.0 * f64::EPSILON;

// Directions, in rad.

/// Two edges that turn by less are one line. [the exact planner gives away as much: planner's OFF_ITSELF]
pub const SAME_DIRECTION: f64 = 1e-9;
/// Angles nearer than this to a quarter turn are one. [4 roundings]
pub const SAME_ANGLE: f64 = 4.0 * f64::EPSILON;
/// An exact path is smoothed where an arc or a spline meets its neighbour with a turn below this. [program: 1°]
pub const ROUNDED_TANGENT: f64 = 0.0175;
/// A smooth path stops where the program turns by more: no curve passes both sides of the corner at any speed. [135°]
pub const REVERSAL: f64 = 2.356;
/// Two edges are opposite that turn by half a circle but for less. [program: a planner that goes on there checks it itself]
pub const OPPOSITE: f64 = 1e-6;
/// The same of a smooth path that is fitted to a speed: only what is next to a reversal stops. [177.6°]
pub const FITTED_REVERSAL: f64 = 3.1;
/// Corners that turn back are not rounded where cos(turn/2) is below this, for they are passed near rest anyway. [177.7°]
pub const REVERSAL_COSINE: f64 = 0.02;
/// The sweep of an arc is corrected by up to this to the end point that the program gives. [program, on a small radius]
pub const SWEEP: f64 = 0.1;

// Lengths, in mm.

/// A position this far beyond the travel is within. [coordinates, as sums of offsets]
pub const TRAVEL: f64 = 1e-6;

// Fractions of a speed.

/// A feed below this fraction of the greatest speed is next to rest: a stop where it meets a rapid costs milliseconds, and
/// the speeds of one run differ by no more than planners have digits for.
pub const CRAWL: f64 = 1e-4;

// Fractions of the allowed deviation.

/// A deviation may exceed the allowed one by this fraction. [sums]
pub const EXCESS: f64 = 1e-9;
/// A corner that exceeds the tolerance is made shorter by this fraction more than in proportion. [so that it ends]
pub const SHORTER: f64 = 1e-5;
/// No blend is shorter than this times the tolerance: shorter pieces would gain no time.
pub const SHORTEST_BLEND: f64 = 0.01;
/// Chords of arcs and splines may use this fraction of the tolerance of a smooth path.
pub const CHORD: f64 = 0.02;
/// Points closer than this fraction of the tolerance are the same point of a smooth path.
pub const SAME_POINT: f64 = 1e-3;
/// This fraction of the tolerance is left to the smooth fit, whatever its chords use.
pub const LEFT_TO_FIT: f64 = 1e-2;
/// Points off a line by less than this fraction (and by `COLINEAR_ROUNDING`) are colinear …
pub const COLINEAR: f64 = 1e-6;
/// … and a sequence of them is a line if all are within this fraction of it: small deviations have not added up.
pub const STRAIGHT: f64 = 1e-3;
/// Where the fit passes a point at an offset, it is at most this fraction of the tolerance.
pub const OFFSET: f64 = 0.75;
/// An offset makes a bulge of up to twice the tolerance fit; a bulge beyond this many tolerances fits at no offset.
pub const HOPELESS: f64 = 2.25;

// Fractions of a length.

/// Points off a line by this fraction of the greatest coordinate are on it. [coordinates: 8 ε]
pub const COLINEAR_ROUNDING: f64 = 8.0 * f64::EPSILON;
/// What two blends leave of the pieces between them is dropped below this fraction: the blends touch.
pub const TOUCHING: f64 = 1e-6;
/// A blend that begins or ends within this fraction of a piece from its end begins or ends there, so that no sliver is
/// left …
pub const AT_PIECE_END: f64 = 1e-6;
/// … if that moves it by less than this fraction of the way to the next corner.
pub const MOVED_CUT: f64 = 1e-3;
/// A piece is not cut at a change of feed within this fraction of its width from an end.
pub const SLIVER: f64 = 1e-6;
/// A circle whose centre is off the programmed one by more than this fraction of the radius is another arc.
pub const CENTRE: f64 = 0.1;
