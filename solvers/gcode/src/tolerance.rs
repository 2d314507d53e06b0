//! The tolerances of the reader, and the greatest numbers that it accepts; greater ones are taken for mistakes.
//!
//! Posts round coordinates to 2 to 6 decimals, so exact geometry is given with errors of 1e-2 to 1e-6 mm or inches. Where
//! LinuxCNC has a tolerance the reader has the same one: a program that runs there is read here.

use std::f64::consts::SQRT_2;

/// mm in an inch.
pub const MM_PER_INCH: f64 = 25.4;

// Arithmetic.

/// Numbers closer than this are equal to EQ, NE, GE and LE. [LinuxCNC]
pub const EQUAL: f64 = 1e-6;
/// A number this close to an integer stands for it. [LinuxCNC]
pub const NEAR_INTEGER: f64 = 1e-4;

// Arcs. [LinuxCNC]

/// The radii at the start and the end of an arc may differ by this fraction of the radius …
pub const SPIRAL_RELATIVE: f64 = 1e-3;
/// … or by this, in mm: the effect of rounding all coordinates to 2 decimals of a mm, or 3 of an inch …
pub const SPIRAL_MM: f64 = 2.0 * 0.01 * SQRT_2;
pub const SPIRAL_INCH: f64 = 2.0 * 0.001 * SQRT_2 * MM_PER_INCH;
/// … but by no more than this many times the difference in mm, whatever the radius.
pub const SPIRAL_MOST: f64 = 100.0;
/// An arc needs a radius above this, and an R word may be this much too short for its chord: 0.00005 inch, in mm.
pub const RADIUS_SLACK: f64 = 0.00127;
/// An arc whose start and end are this close in angle [rad] and in distance [mm] is a full turn.
pub const SAME_ANGLE: f64 = 1e-6;
pub const SAME_POINT: f64 = 1e-4;
/// Within this fraction of their rounding, half the chord of an arc is its radius. [rounding of a difference: 4 ε]
pub const HALF_CHORD: f64 = 8.0 * f64::EPSILON;
/// A sweep is a whole number of turns within this fraction of a turn. [rounding of an angle: 1e-16 of up to 1e4 turns]
pub const WHOLE_TURNS: f64 = 1e-9;

// Moves.

/// A step up to this long, in mm or degrees, is the rounding of offsets and makes no move.
pub const NO_MOTION: f64 = 1e-9;
/// The first control point of G6.2 may be this far from the tool, in mm or degrees: rounding to 2 decimals.
pub const SAME_PLACE: f64 = 0.005;
/// Two moves whose directions have a cross product below this lie on one line: a corner needs an angle.
pub const ON_ONE_LINE: f64 = 1e-9;
/// Two directions (unit vectors) whose sum is shorter than this are opposite, and the turn between them has no axis.
pub const OPPOSITE: f64 = 1e-6;
/// The least and the greatest length of a vector that gives the tool a direction.
pub const DIRECTION_LENGTH: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

// Cutter compensation. [LinuxCNC]

/// A corner that turns by less than this, in radians, does not count, and a turn this close to π is a half turn.
pub const NO_CORNER: f64 = 0.05;
/// The chord of an entry arc must leave its tangent by this fraction of its length.
pub const ENTRY_BEND: f64 = 1e-4;

// The greatest numbers: a program that has more is mistaken, or would not end.

/// Distance of a position from the machine's zero, in mm, and angle of a rotary axis, which may wind up, in degrees.
pub const FARTHEST: f64 = 1e6;
pub const FARTHEST_TURN: f64 = 1e8;
/// Distance of the centre of an arc, in mm: with a centre farther away, rounding leaves no correct digit of the arc.
pub const FARTHEST_CENTRE: f64 = 1e9;
/// Feeds and spindle speeds, in the units of the program.
pub const RATES: std::ops::RangeInclusive<f64> = 1e-6..=1e9;
/// Duration of a dwell in seconds, and the duration from which on milliseconds may have been meant.
pub const MOST_DWELL: f64 = 1e6;
pub const LONG_DWELL: f64 = 100.0;
/// Turns of one arc, repetitions and pecks of one cycle, passes of one thread.
pub const MOST_TURNS: u32 = 10_000;
pub const MOST_REPEATS: u32 = 1_000_000;
pub const MOST_PASSES: u32 = 10_000;
/// Depth of nested brackets and parameters, and of calls.
pub const MAX_DEPTH: usize = 64;
pub const MAX_CALLS: usize = 100;
/// A program may run this many lines beyond those of its text, and this many for each move that it may have.
pub const SPARE_LINES: u64 = 1_000_000;
pub const LINES_PER_MOVE: u64 = 4;
