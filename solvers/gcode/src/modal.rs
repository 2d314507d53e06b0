//! What stays in force from block to block: modes, offsets, feed.

use super::moves::{Control, Mode, Point};
use super::tip::CoordinateMode;

pub const MM_PER_INCH: f64 = 25.4;

/// What an F word means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedMode {
    /// G94: units a minute.
    PerMinute,
    /// G93: moves a minute.
    Inverse,
    /// G95: units a turn of the spindle.
    PerTurn,
}

/// The feed in force: what the last F said, for linear and for rotary moves.
#[derive(Clone, Copy, Debug)]
pub struct Feed {
    /// mm/s, or mm a turn with G95.
    pub linear: f64,
    /// Degrees/s, or degrees a turn with G95.
    pub angular: f64,
}

/// The words that a canned cycle keeps while it is repeated, as they were written.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sticky {
    pub retract: f64,
    pub bottom: f64,
    pub dwell: Option<f64>,
    pub peck: Option<f64>,
    /// Height along the tool axis, in machine coordinates, before the first of a series of cycles.
    pub initial: Option<f64>,
}

/// Where the numbers of the program are, in machine coordinates.
#[derive(Clone, Debug)]
pub struct Offsets {
    /// Which of G54 to G59.3 and of the further ones is in force, from 0, its offset and its turn about Z in degrees.
    pub system: usize,
    pub work: Point,
    pub rotation: f64,
    /// G92 and G52.
    pub shift: Point,
    /// The shift and the turn of before, while G68 turns about a place of its own.
    pub unturned: Option<(Point, f64)>,
    /// Tool length, G43.
    pub tool: Point,
    /// Their sum.
    sum: Point,
}

impl Offsets {
    pub fn new(work: Point) -> Self {
        let zero = [0.0; 9];
        let mut offsets =
            Self { system: 0, work, rotation: 0.0, shift: zero, unturned: None, tool: zero, sum: zero };
        offsets.update();
        offsets
    }

    /// Machine coordinates of the program's zero, where nothing is turned.
    #[inline(always)]
    pub fn sum(&self) -> &Point {
        &self.sum
    }

    /// To be called after a change.
    pub fn update(&mut self) {
        self.sum = std::array::from_fn(|k| self.work[k] + self.shift[k] + self.tool[k]);
    }

    /// A place of the program in machine coordinates.
    pub fn to_machine(&self, place: &Point) -> Point {
        if self.rotation == 0.0 {
            return std::array::from_fn(|k| place[k] + self.sum[k]);
        }
        let mut shifted: Point = std::array::from_fn(|k| place[k] + self.shift[k]);
        turn(&mut shifted, self.rotation);
        std::array::from_fn(|k| shifted[k] + self.work[k] + self.tool[k])
    }

    /// A place in machine coordinates as the program writes it, in mm and degrees.
    pub fn to_program(&self, place: &Point) -> Point {
        if self.rotation == 0.0 {
            return std::array::from_fn(|k| place[k] - self.sum[k]);
        }
        let mut shifted: Point = std::array::from_fn(|k| place[k] - self.work[k] - self.tool[k]);
        turn(&mut shifted, -self.rotation);
        std::array::from_fn(|k| shifted[k] - self.shift[k])
    }
}

/// Turns X and Y about 0 by an angle in degrees.
pub fn turn(place: &mut Point, angle: f64) {
    let (sin, cos) = angle.to_radians().sin_cos();
    (place[0], place[1]) = (place[0] * cos - place[1] * sin, place[0] * sin + place[1] * cos);
}

/// Everything modal.
#[derive(Clone, Debug)]
pub struct State {
    pub offsets: Offsets,
    /// The motion code in tenths; 800 (G80) where there is none.
    pub motion: u16,
    /// The axis that arcs turn about and cycles go along: 2 for G17, 1 for G18, 0 for G19.
    pub normal: usize,
    pub absolute: bool,
    pub absolute_centres: bool,
    pub inches: bool,
    /// G7: X words are diameters.
    pub diameters: bool,
    /// G16: the words of the plane are a radius and an angle.
    pub polar: bool,
    /// G20 or G21 was given.
    pub units_given: bool,
    pub feed_mode: FeedMode,
    pub feed: Option<Feed>,
    pub control: Control,
    /// G98: cycles go back to where they came from, not only to R.
    pub retract_to_initial: bool,
    /// G98 or G99 was given.
    pub retract_given: bool,
    pub spindle_on: bool,
    /// M4.
    pub spindle_back: bool,
    pub mist: bool,
    pub flood: bool,
    /// Turns a minute; None where they are not known (G96, or no S yet).
    pub spindle_speed: Option<f64>,
    pub constant_surface_speed: bool,
    pub sticky: Sticky,
    /// What axis words are; the tool's length in mm then, NaN for the machine file's; the joints where this began.
    pub coordinate_mode: CoordinateMode,
    pub tool_length: f64,
    pub entry: Point,
}

impl State {
    /// As LinuxCNC starts: no motion code, G17 G21 G90 G91.1 G94 G54 G64 G99.
    pub fn new(work: Point) -> Self {
        Self {
            offsets: Offsets::new(work),
            motion: 800,
            normal: 2,
            absolute: true,
            absolute_centres: false,
            inches: false,
            diameters: false,
            polar: false,
            units_given: false,
            feed_mode: FeedMode::PerMinute,
            feed: None,
            control: Control::new(Mode::Tolerance),
            retract_to_initial: false,
            retract_given: false,
            spindle_on: false,
            spindle_back: false,
            mist: false,
            flood: false,
            spindle_speed: None,
            constant_surface_speed: false,
            sticky: Sticky::default(),
            coordinate_mode: CoordinateMode::Joints,
            tool_length: f64::NAN,
            entry: [0.0; 9],
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
