//! The state that stays in force from block to block: modes, offsets, feed.

use super::coordinates::{CoordinateMode, Point};
use super::moves::Control;
use super::tolerance::MM_PER_INCH;

/// The unit of an F word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FeedMode {
    /// G94: units of length per minute.
    #[default]
    PerMinute,
    /// G93: moves per minute.
    Inverse,
    /// G95: units of length per turn of the spindle.
    PerTurn,
}

/// The feed in force, by the last F, for linear and for rotary moves.
#[derive(Clone, Copy, Debug)]
pub struct Feed {
    /// mm/s, or mm per turn with G95.
    pub linear: f64,
    /// Degrees/s, or degrees per turn with G95.
    pub angular: f64,
}

/// The words that stay in force while a canned cycle is repeated, in the coordinates and units of the program.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sticky {
    pub retract: f64,
    pub bottom: f64,
    pub dwell: Option<f64>,
    pub peck: Option<f64>,
    /// Height along the tool axis, in machine coordinates, before the first of a series of cycles.
    pub initial: Option<f64>,
}

/// The transformation from coordinates of the program to those of the machine.
#[derive(Clone, Debug, Default)]
pub struct Offsets {
    /// The work offset in force, from 0 for G54, with its vector and its rotation about Z in degrees.
    pub system: usize,
    pub work: Point,
    pub rotation: f64,
    /// The shift by G92 and G52.
    pub shift: Point,
    /// The shift and the rotation before G68, while that is on.
    pub unturned: Option<(Point, f64)>,
    /// The tool length, G43.
    pub tool: Point,
    /// The sum of the three vectors.
    sum: Point,
}

impl Offsets {
    pub fn new(work: Point) -> Self {
        let mut offsets = Self { work, ..Self::default() };
        offsets.update();
        offsets
    }

    /// Machine coordinates of the program's zero, if the rotation is 0.
    #[inline(always)]
    pub fn sum(&self) -> &Point {
        &self.sum
    }

    /// Computes the sum again; must be called after each change of a vector.
    pub fn update(&mut self) {
        self.sum = std::array::from_fn(|k| self.work[k] + self.shift[k] + self.tool[k]);
    }

    /// Converts a point from the coordinates of the program to those of the machine.
    pub fn to_machine(&self, point: &Point) -> Point {
        if self.rotation == 0.0 {
            return std::array::from_fn(|k| point[k] + self.sum[k]);
        }
        let mut shifted: Point = std::array::from_fn(|k| point[k] + self.shift[k]);
        turn(&mut shifted, self.rotation);
        std::array::from_fn(|k| shifted[k] + self.work[k] + self.tool[k])
    }

    /// Converts a point from the coordinates of the machine to those of the program, in mm and degrees.
    pub fn to_program(&self, point: &Point) -> Point {
        if self.rotation == 0.0 {
            return std::array::from_fn(|k| point[k] - self.sum[k]);
        }
        let mut shifted: Point = std::array::from_fn(|k| point[k] - self.work[k] - self.tool[k]);
        turn(&mut shifted, -self.rotation);
        std::array::from_fn(|k| shifted[k] - self.shift[k])
    }
}

/// Rotates a point about Z by an angle in degrees.
pub fn turn(point: &mut Point, angle: f64) {
    let (sin, cos) = angle.to_radians().sin_cos();
    (point[0], point[1]) = (point[0] * cos - point[1] * sin, point[0] * sin + point[1] * cos);
}

/// All modes, with the offsets and the feed.
#[derive(Clone, Debug, Default)]
pub struct State {
    pub offsets: Offsets,
    /// The motion code in tenths; 800 (G80) for no motion.
    pub motion: u16,
    /// The axis that arcs turn about and cycles move along: 2 for G17, 1 for G18, 0 for G19.
    pub normal: usize,
    pub absolute: bool,
    pub absolute_centres: bool,
    pub inches: bool,
    /// G7: X words are diameters.
    pub diameters: bool,
    /// G16: the words of the plane are a radius and an angle.
    pub polar: bool,
    /// True after G20 or G21.
    pub units_given: bool,
    pub feed_mode: FeedMode,
    pub feed: Option<Feed>,
    pub control: Control,
    /// G98: cycles end at the height where the series began, if that is above R.
    pub retract_to_initial: bool,
    /// True after G98 or G99.
    pub retract_given: bool,
    pub spindle_on: bool,
    /// M4: the spindle turns counter-clockwise.
    pub spindle_back: bool,
    pub mist: bool,
    pub flood: bool,
    /// Turns per minute; None where they are not known (with G96, and before the first S).
    pub spindle_speed: Option<f64>,
    pub constant_surface_speed: bool,
    pub sticky: Sticky,
    pub coordinate_mode: CoordinateMode,
    /// With the mode `Tip` or `Vector`, the tool's length in mm (NaN for that of the machine file) and the joints where the mode
    /// began.
    pub tool_length: f64,
    pub entry: Point,
}

impl State {
    /// The state in which LinuxCNC starts: no motion code, G17 G21 G90 G91.1 G94 G54 G64 G99.
    pub fn new(work: Point) -> Self {
        Self {
            offsets: Offsets::new(work),
            motion: 800,
            normal: 2,
            absolute: true,
            tool_length: f64::NAN,
            ..Self::default()
        }
    }

    /// mm of one unit of the program.
    #[inline(always)]
    pub fn unit(&self) -> f64 {
        if self.inches {
            MM_PER_INCH
        } else {
            1.0
        }
    }

    /// The two axes of the plane, in the order that makes it right-handed with `normal`.
    pub fn plane(&self) -> (usize, usize) {
        ((self.normal + 1) % 3, (self.normal + 2) % 3)
    }
}
