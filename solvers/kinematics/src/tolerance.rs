//! The tolerances of joint motion, each with its unit and the reason of its size.

/// Allowed error of q'' u̇² by the interpolants, as a fraction of the acceleration limit. [far below the 1e-6 of the audit]
pub const ACCELERATION: f64 = 1e-9;
/// Allowed error of positions, in mm or degrees. [far below the resolution of any scale]
pub const POSITION: f64 = 1e-9;
/// The rounding error of q'', as a fraction of q''. [some 100 operations of a series: 500 ε]
pub const ROUNDING: f64 = 1e-13;
/// The rounding error of the square of a speed, as a fraction of its greatest value on the piece. [near a cusp, where digits
/// cancel]
pub const SPEED_NOISE: f64 = 1e-12;
/// The greatest u̇² on a part is estimated from these fractions of it, and may be `MARGIN` times greater between them.
pub const SAMPLES: [f64; 3] = [0.0, 0.5, 1.0];
pub const MARGIN: f64 = 4.0;

/// A joint may be this far outside its travel, in mm or degrees. [the rounding of programs to four or more decimals]
pub const TRAVEL: f64 = 1e-6;
/// Greatest number of times that a piece is halved: a part that is then not proven to be smooth is a singular place.
pub const DEEPEST: usize = 30;
/// From this depth on, a piece with more open parts than `INTERVAL_PARTS` counts as singular on an interval, not at points.
pub const INTERVAL_DEPTH: usize = 10;
pub const INTERVAL_PARTS: usize = 64;

/// Units in the last place that cover the error of sine, cosine and arc tangent. [libraries promise less than 4]
pub const ELEMENTARY_ULPS: f64 = 8.0;
/// From the middle of a box to a corner, the sense of an angle greater than this, in rad, is unknown. [the rounding of a
/// difference of angles is 1e-15]
pub const STRAIGHT: f64 = std::f64::consts::PI - 1e-9;
