//! Changes the meaning of axis words: joint positions, the tool's tip (G43.4), or the tip and a tool direction (G43.5). A change
//! moves nothing: the machine's kinematics converts the position to the new coordinates.

use super::block::{bits, g_name, Block, Group};
use super::coordinates::{CoordinateMode, Direction, Place};
use super::fault::Outcome;
use super::intent::is_cycle;
use super::interpreter::Interpreter;
use super::modal::State;
use super::tolerance::{DIRECTION_LENGTH, OPPOSITE};

impl Interpreter<'_> {
    /// G43.4 and G43.5, and the codes that cancel them; `length` is the tool's in mm, NaN where it is not known.
    pub fn set_coordinate_mode(&mut self, mode: CoordinateMode, length: f64) -> Outcome<()> {
        let same = length.to_bits() == self.state.tool_length.to_bits() || length == self.state.tool_length;
        if mode == self.state.coordinate_mode && (same || mode == CoordinateMode::Joints) {
            return Ok(());
        }
        let Some(control) = self.options.tip_control.as_deref() else {
            return fault!(
                "G43.4 and G43.5 program the tool's tip, which takes a machine with rotary axes: name the \
                 machine, or post joint positions",
            );
        };
        let State { coordinate_mode: before, tool_length, entry, .. } = &self.state;
        let converted = control.check(mode).and_then(|()| {
            let joints_after = |path: &[Place]| control.joints(*before, *tool_length, entry, path);
            let joints = match before {
                CoordinateMode::Joints => self.moves.position,
                CoordinateMode::Tip => joints_after(&[(self.moves.position, self.moves.direction)])?,
                CoordinateMode::Vector => joints_after(&self.moves.since_change())?,
            };
            Ok((joints, control.place(mode, length, &joints)?))
        });
        let (joints, (start, direction)) = converted.or_else(|message| fault!("{message}"))?;
        self.check_reach(&start)?;
        self.moves.change(mode, length, start, direction);
        (self.state.coordinate_mode, self.state.tool_length, self.state.entry) = (mode, length, joints);
        Ok(())
    }

    /// Refuses moves to joint positions or along the spindle while axis words give the tip.
    pub fn check_coordinate_mode(&self, block: &Block, motion: Option<u16>) -> Outcome<()> {
        let code = match (block.code(Group::ToolLength), self.state.coordinate_mode) {
            (Some(code @ (434 | 435)), _) => code,
            (Some(_), _) | (None, CoordinateMode::Joints) => return Ok(()),
            (None, CoordinateMode::Tip) => 434,
            (None, CoordinateMode::Vector) => 435,
        };
        let name = g_name(code);
        if let Some(other) = block.code(Group::Once).filter(|code| matches!(code, 280 | 300 | 530)) {
            return fault!(
                "{} goes to machine positions and {name} is in force: cancel it by G49 before",
                g_name(other)
            );
        }
        let Some(motion) = motion else { return Ok(()) };
        if is_cycle(motion) {
            return fault!(
                "{} goes along Z and {name} is in force: cancel it by G49 before, or post single moves",
                g_name(motion)
            );
        }
        if code == 434 {
            return Ok(());
        }
        if matches!(motion, 50..=62) {
            return fault!("{} is not read under G43.5: post rotary words (G43.4) or lines", g_name(motion));
        }
        if matches!(motion, 20 | 30) && block.words & bits(b"IJK") != 0 {
            return fault!(
                "under G43.5 I, J, K are the tool's direction and no centre: give R, or post lines",
            );
        }
        match (b'A'..=b'C').find(|&letter| block.has(letter)) {
            Some(letter) => fault!(
                "word {} is an angle and G43.5 takes the tool's direction: give I, J, K, or use G43.4",
                block.word(letter)
            ),
            None => Ok(()),
        }
    }

    /// The tool direction of a block: I, J, K, where a missing one is 0, or the direction before.
    pub fn direction(&self, block: &Block) -> Outcome<Direction> {
        if block.words & bits(b"IJK") == 0 {
            return Ok(self.moves.direction);
        }
        let words = [b'I', b'J', b'K'].map(|letter| block.get(letter).unwrap_or(0.0));
        let size = words.iter().fold(0.0, |size: f64, word| size.hypot(*word));
        if !DIRECTION_LENGTH.contains(&size) {
            return fault!("I, J, K give the tool no direction: give a vector such as K1");
        }
        let direction = words.map(|word| word / size);
        let between = std::array::from_fn::<f64, 3, _>(|k| direction[k] + self.moves.direction[k]);
        if between.iter().all(|value| value.abs() < OPPOSITE) {
            return fault!("the tool turns over by 180 degrees, and I, J, K do not say which way: give a direction between");
        }
        Ok(direction)
    }
}

/// The angle between two directions in degrees.
pub fn angle_between(a: &Direction, b: &Direction) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let sine = cross.iter().fold(0.0, |size: f64, value| size.hypot(*value));
    sine.atan2(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).to_degrees()
}

/// True where I, J, K of a block are a tool direction.
pub fn takes_direction(block: &Block, mode: CoordinateMode, motion: Option<u16>) -> bool {
    let vector = match block.code(Group::ToolLength) {
        Some(code) => code == 435,
        None => mode == CoordinateMode::Vector,
    };
    vector && matches!(motion, Some(0 | 10))
}
