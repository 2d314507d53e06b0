//! What axis words mean: joint positions, the tool's tip (G43.4), or the tip and a direction (G43.5); and what a
//! change of the coordinate mode does. It moves nothing: the same joint positions are written in the new words.

use super::block::{bits, g_name, Block, Group};
use super::execute::Interpreter;
use super::fault::{fault, Outcome};
use super::intent::is_cycle;
use super::moves::{Direction, Point};

/// Of axis words; as `CoordinateMode` in the Python package.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum CoordinateMode {
    Joints = 0,
    Tip = 1,
    Vector = 2,
}

/// A place in words of a mode: X to W, then the tool's direction.
pub type Place = (Point, Direction);

/// What a machine's kinematics says about words.
pub trait TipControl {
    /// Whether the machine has that mode; a sentence why not.
    fn check(&self, coordinate_mode: CoordinateMode) -> Result<(), String>;

    /// The joint positions after places in words of one mode, which begin at the joints `entry`;
    /// `tool_length` in mm, NaN for the machine file's.
    fn joints(
        &self,
        coordinate_mode: CoordinateMode,
        tool_length: f64,
        entry: &Point,
        places: &[Place],
    ) -> Result<Point, String>;

    /// The place in words of a mode where the joints are.
    fn place(
        &self,
        coordinate_mode: CoordinateMode,
        tool_length: f64,
        joints: &Point,
    ) -> Result<Place, String>;
}

/// Directions [unit vectors] whose sum is shorter than this are opposite.
const OPPOSITE: f64 = 1e-6;

impl Interpreter<'_> {
    /// G43.4 and G43.5, and the codes that cancel them; `length` is the tool's in mm, NaN where it is not known.
    pub(super) fn set_coordinate_mode(
        &mut self,
        coordinate_mode: CoordinateMode,
        length: f64,
    ) -> Outcome<()> {
        let same = length.to_bits() == self.state.tool_length.to_bits() || length == self.state.tool_length;
        if coordinate_mode == self.state.coordinate_mode
            && (same || coordinate_mode == CoordinateMode::Joints)
        {
            return Ok(());
        }
        let Some(control) = self.options.tip_control.as_deref() else {
            return fault(
                "G43.4 and G43.5 program the tool's tip, which takes a machine with rotary axes: name the \
                 machine, or post joint positions",
            );
        };
        let entry = &self.state.entry;
        let converted = control.check(coordinate_mode).and_then(|()| {
            let joints = match self.state.coordinate_mode {
                CoordinateMode::Joints => self.moves.position,
                CoordinateMode::Tip => {
                    let here = (self.moves.position, self.moves.direction);
                    control.joints(CoordinateMode::Tip, self.state.tool_length, entry, &[here])?
                }
                CoordinateMode::Vector => {
                    let stretch = self.moves.since_change();
                    control.joints(CoordinateMode::Vector, self.state.tool_length, entry, &stretch)?
                }
            };
            Ok((joints, control.place(coordinate_mode, length, &joints)?))
        });
        let (joints, (start, direction)) = converted.or_else(fault)?;
        self.check_reach(&start)?;
        self.moves.change(coordinate_mode, length, start, direction);
        self.state.coordinate_mode = coordinate_mode;
        self.state.tool_length = length;
        self.state.entry = joints;
        Ok(())
    }

    /// Refuses what goes to joint positions or along the spindle while words are the tip.
    pub(super) fn check_coordinate_mode(&self, block: &Block, motion: Option<u16>) -> Outcome<()> {
        let code = match block.code(Group::ToolLength) {
            Some(434) => 434,
            Some(435) => 435,
            Some(_) => return Ok(()),
            None => match self.state.coordinate_mode {
                CoordinateMode::Joints => return Ok(()),
                CoordinateMode::Tip => 434,
                CoordinateMode::Vector => 435,
            },
        };
        let name = g_name(code);
        if let Some(other) = block.code(Group::Once).filter(|code| matches!(code, 280 | 300 | 530)) {
            return fault(format!(
                "{} goes to machine positions and {name} is in force: cancel it by G49 before",
                g_name(other)
            ));
        }
        let Some(motion) = motion else { return Ok(()) };
        if is_cycle(motion) {
            return fault(format!(
                "{} goes along Z and {name} is in force: cancel it by G49 before, or post single moves",
                g_name(motion)
            ));
        }
        if code == 434 {
            return Ok(());
        }
        if matches!(motion, 50..=62) {
            return fault(format!(
                "{} is not read under G43.5: post rotary words (G43.4) or lines",
                g_name(motion)
            ));
        }
        if matches!(motion, 20 | 30) && block.words & bits(b"IJK") != 0 {
            return fault(
                "under G43.5 I, J, K are the tool's direction and no centre: give R, or post lines",
            );
        }
        match (b'A'..=b'C').find(|&letter| block.has(letter)) {
            Some(letter) => fault(format!(
                "word {} is an angle and G43.5 takes the tool's direction: give I, J, K, or use G43.4",
                block.word(letter)
            )),
            None => Ok(()),
        }
    }

    /// The tool's direction that the block asks for: I, J, K, of which missing ones are 0, or as before.
    pub(super) fn direction(&self, block: &Block) -> Outcome<Direction> {
        if block.words & bits(b"IJK") == 0 {
            return Ok(self.moves.direction);
        }
        let words = [b'I', b'J', b'K'].map(|letter| block.get(letter).unwrap_or(0.0));
        let size = words.iter().fold(0.0, |size: f64, word| size.hypot(*word));
        if !(1e-9..=1e9).contains(&size) {
            return fault("I, J, K give the tool no direction: give a vector such as K1");
        }
        let direction = words.map(|word| word / size);
        let between = std::array::from_fn::<f64, 3, _>(|k| direction[k] + self.moves.direction[k]);
        if between.iter().all(|value| value.abs() < OPPOSITE) {
            return fault("the tool turns over by 180 degrees, and I, J, K do not say which way: give a direction between");
        }
        Ok(direction)
    }
}

/// The angle between two directions in degrees.
pub fn turn(a: &Direction, b: &Direction) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let sine = cross.iter().fold(0.0, |size: f64, value| size.hypot(*value));
    sine.atan2(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).to_degrees()
}

/// True where G43.5 gives the I, J, K of a block the tool's direction.
pub fn takes_direction(block: &Block, coordinate_mode: CoordinateMode, motion: Option<u16>) -> bool {
    let vector = match block.code(Group::ToolLength) {
        Some(code) => code == 435,
        None => coordinate_mode == CoordinateMode::Vector,
    };
    vector && matches!(motion, Some(0 | 10))
}
