//! The state of a program between two blocks, and functions on it that all kinds of blocks use: positions, axes and warnings.

use super::block::{bit, rotary, Block, AXES, AXIS_OF_LETTER, AXIS_WORDS};
use super::compensation::Compensation;
use super::coordinates::Point;
use super::fault::Outcome;
use super::modal::{Feed, FeedMode, State};
use super::moves::Moves;
use super::nurbs::Nurbs;
use super::options::{Options, Tool};
use super::parameters::{first_of_system, Parameters, HOME, SECOND_HOME, SYSTEM};
use super::tolerance::{FARTHEST, FARTHEST_TURN};

/// A corner that waits for the next move: its word, and the row, line, start and feed of the move before.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    pub letter: u8,
    pub size: f64,
    pub row: usize,
    pub line: u32,
    pub start: Point,
    pub feed: f64,
}

/// The state of the program between two blocks.
pub struct Interpreter<'a> {
    pub state: State,
    pub moves: Moves,
    pub line: u32,
    pub options: &'a Options,
    /// Bits of the letters of the axes that the program has named.
    pub known: u32,
    warnings: Vec<String>,
    warned: Vec<Topic>,
    /// The NURBS that is being read.
    pub open: Option<Box<Nurbs>>,
    /// The row in which a G5 may follow without I and J, and the I and J that it has then, in mm.
    pub mirror: Option<(usize, [f64; 2])>,
    pub parameters: Parameters,
    pub tools: Option<Vec<Tool>>,
    /// The table's row of the tool in the spindle, the number of that tool, and the number that T has called.
    pub tool: Option<Tool>,
    pub loaded: Option<u32>,
    pub selected: Option<u32>,
    /// The corner that waits for the next straight move.
    pub corner: Option<Corner>,
    /// The compensation, from G41 or G42 until the move after G40.
    pub compensation: Option<Box<Compensation>>,
    /// Modes that M70 and M73 have saved, with the depth of calls, and true where the end of the call restores them.
    pub saved: Vec<(usize, bool, State)>,
}

/// The topics of which a program is warned only once.
#[derive(PartialEq)]
pub enum Topic {
    UnknownCode(u16),
    NoToolTable,
    NoToolLength,
    LongDwell,
    Extruder,
    Diameter,
    CycleDwell,
    Retract,
    LookAhead,
}

impl<'a> Interpreter<'a> {
    pub fn new(options: &'a Options, expected: usize) -> Self {
        let mut parameters = Parameters::default();
        for (system, offset) in options.offsets.iter().enumerate() {
            parameters.set_row(first_of_system(system), offset);
        }
        parameters.set_number(SYSTEM, 1.0);
        parameters.set_row(HOME, &options.home);
        parameters.set_row(SECOND_HOME, &options.home);
        let mut state = State::new(options.offsets.first().copied().unwrap_or_default());
        state.feed = options.feed.map(|feed| Feed { linear: feed, angular: feed });
        Self {
            state,
            moves: Moves::new(expected, options.max_moves, options.start),
            line: 0,
            options,
            known: 0,
            warnings: Vec::new(),
            warned: Vec::new(),
            open: None,
            mirror: None,
            parameters,
            tools: options.tools.clone(),
            tool: None,
            loaded: None,
            selected: None,
            corner: None,
            compensation: None,
            saved: Vec::new(),
        }
    }

    pub fn into_parts(mut self) -> (Moves, Vec<String>) {
        if !self.state.units_given {
            self.warnings.push("the program gives no units (G20 or G21): millimetres are assumed".into());
        }
        self.warnings.extend(self.parameters.warning());
        (self.moves, self.warnings)
    }

    /// The current point of the programmed path; with cutter compensation, the tool's centre is beside it.
    #[inline(always)]
    pub fn position(&self) -> Point {
        match &self.compensation {
            None => self.moves.position,
            Some(compensation) => compensation.programmed,
        }
    }

    /// The feed in force, as a value of F.
    pub fn feed_word(&self) -> f64 {
        let per = if self.state.feed_mode == FeedMode::PerTurn { 1.0 } else { 60.0 };
        self.state.feed.map_or(0.0, |feed| feed.angular * per)
    }

    /// Calls `each` for each axis that the block names, with its value in mm or degrees. An axis that is named for the
    /// first time gets a column.
    #[inline(always)]
    pub fn axis_values(&mut self, block: &Block, mut each: impl FnMut(usize, f64)) -> Outcome<()> {
        let mut words = block.words & AXIS_WORDS;
        if words & !self.known != 0 {
            self.add_axes(words)?;
        }
        let unit = self.state.unit();
        let diameters = self.state.diameters;
        while words != 0 {
            let letter = words.trailing_zeros() as usize;
            words &= words - 1;
            let axis = AXIS_OF_LETTER[letter] as usize;
            let mut value = block.value(b'A' + letter as u8);
            if !rotary(axis) {
                value *= unit;
            }
            if diameters && axis == 0 {
                value *= 0.5;
            }
            each(axis, value);
        }
        Ok(())
    }

    /// Adds columns for axes that are named for the first time; fails if the machine does not have them.
    #[cold]
    pub fn add_axes(&mut self, words: u32) -> Outcome<()> {
        for (axis, &letter) in AXES.iter().enumerate().filter(|(_, &letter)| words & bit(letter) != 0) {
            if !self.options.machine_axes.is_empty() && !self.options.machine_axes.contains(&letter) {
                let letter = letter as char;
                let others =
                    self.options.machines_with.as_ref().map(|names| names(letter)).unwrap_or_default();
                return fault!(
                    "word {letter} moves an axis that the machine does not have: use a machine with {letter}{others}, \
                     or post without it"
                );
            }
            self.moves.add_axis(axis);
        }
        self.known |= words;
        Ok(())
    }

    /// Refuses positions that no machine reaches, or that are not numbers.
    #[inline(always)]
    pub fn check_reach(&self, target: &Point) -> Outcome<()> {
        let reached = |axis: usize| target[axis].abs() <= if rotary(axis) { FARTHEST_TURN } else { FARTHEST };
        // All nine are tested without a branch, and the faulty one is looked up afterwards.
        let mut all = true;
        for axis in 0..9 {
            all &= reached(axis);
        }
        if all {
            return Ok(());
        }
        let axis = (0..9).find(|&axis| !reached(axis)).unwrap_or(0);
        too_far(axis, target[axis])
    }

    pub fn warn(&mut self, text: String) {
        self.warnings.push(format!("line {}: {text}", self.line));
    }

    /// Warns, unless there has been a warning of this topic.
    pub fn warn_once(&mut self, topic: Topic, text: impl FnOnce() -> String) {
        if !self.warned.contains(&topic) {
            self.warned.push(topic);
            self.warn(text());
        }
    }
}

#[cold]
fn too_far<T>(axis: usize, value: f64) -> Outcome<T> {
    let (unit, farthest) = if rotary(axis) { ("degrees", FARTHEST_TURN) } else { ("mm", FARTHEST) };
    fault!(
        "{} would go to {value} {unit}, more than {farthest} {unit} from the machine's zero: check the number, the units \
         and the offsets",
        AXES[axis] as char,
    )
}
