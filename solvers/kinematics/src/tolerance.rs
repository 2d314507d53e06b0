//! The tolerances of joint motion, each with its unit and the reason of its size.

/// The stand-ins of q'' may be off by this fraction of the acceleration limit. [far below the 1e-6 of the audit]
pub const ACCELERATION: f64 = 1e-9;
/// Positions may be off by this, in mm or degrees. [far below the resolution of any scale]
pub const POSITION: f64 = 1e-9;
/// The rounding error of q'', as a fraction of it. [some 100 operations of a series: 500 ε]
pub const ROUNDING: f64 = 1e-13;
/// The rounding error of the square of a speed, as a fraction of its greatest value on the piece. [near a cusp, where
/// digits cancel]
pub const SPEED_NOISE: f64 = 1e-12;
/// The greatest u̇² is estimated at these places of a part, and may be this many times greater between them.
pub const SAMPLES: [f64; 3] = [0.0, 0.5, 1.0];
pub const MARGIN: f64 = 4.0;

/// A travel end may be exceeded by this, in mm or degrees. [the rounding of programs to four or more decimals]
pub const TRAVEL: f64 = 1e-6;
/// A piece is halved at most this many times: what is then not known to be smooth is a singular place.
pub const DEEPEST: usize = 30;
/// From this depth on, a piece with more open parts than this is singular on an interval, not at points.
pub const INTERVAL_DEPTH: usize = 10;
pub const INTERVAL_PARTS: usize = 64;

/// Units in the last place that cover the error of sine, cosine and arc tangent. [libraries promise less than 4]
pub const ELEMENTARY_ULPS: f64 = 8.0;
/// An angle between two corners of a box beyond this may be the other way round, in radians. [the rounding of a difference
/// of angles is 1e-15]
pub const STRAIGHT: f64 = std::f64::consts::PI - 1e-9;
