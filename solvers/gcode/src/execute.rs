//! One block after another, in LinuxCNC's order of execution:
//!
//! feed mode, F, S, M6, spindle, coolant, overrides, user codes, G4, plane, units, tool length, work offset, path
//! control, distance modes, retract mode, G10 G28 G30 G52 G92, motion, M0 M1 M2 M30 M60.
//!
//! One difference: F counts in the units of its own block (`G20 F10` is 10 inch/min), as most controls and all posts
//! have it; LinuxCNC reads it before the units change.

use super::block::{bit, bits, rotary, Block, Group, MGroup, AXES, AXIS_OF_LETTER, AXIS_WORDS};
use super::fault::{fault, Outcome};
use super::intent::{axis_words, check_use, is_cycle, motion_of, ARC_WORDS, FREE_WORDS};
use super::modal::{Feed, FeedMode, State};
use super::moves::{Control, Kind, Mode, Moves, Point, Stop};
use super::spline::Nurbs;
use super::tip::{takes_direction, Meaning};
use super::Options;

/// Farther than this from the machine's zero is a mistake, in mm;
const FARTHEST: f64 = 1e6;

/// rotary axes may wind up, in degrees.
const FARTHEST_TURN: f64 = 1e8;

/// Feeds and spindle speeds of the program beyond these are mistakes.
pub(super) const RATES: std::ops::RangeInclusive<f64> = 1e-6..=1e9;

/// Longer dwells are probably milliseconds taken for seconds.
const LONG_DWELL: f64 = 100.0;

/// Runs blocks.
pub struct Interpreter<'a> {
    pub(super) state: State,
    pub(super) moves: Moves,
    pub(super) line: u32,
    pub(super) options: &'a Options,
    /// Letters of the axes that the program has named.
    pub(super) known: u32,
    warnings: Vec<String>,
    warned_codes: Vec<u16>,
    pub(super) warned_tool: bool,
    pub(super) warned_length: bool,
    warned_dwell: bool,
    pub(super) warned_look_ahead: bool,
    /// The NURBS that is being read.
    pub(super) open: Option<Box<Nurbs>>,
    /// Where a G5 may go on without I and J: the row after the G5 before, and the offset in mm.
    pub(super) mirror: Option<(usize, [f64; 2])>,
}

impl<'a> Interpreter<'a> {
    pub fn new(options: &'a Options, expected: usize) -> Self {
        Self {
            state: State::new(options.offsets),
            moves: Moves::new(expected, options.max_moves, options.start),
            line: 0,
            options,
            known: 0,
            warnings: Vec::new(),
            warned_codes: Vec::new(),
            warned_tool: false,
            warned_length: false,
            warned_dwell: false,
            warned_look_ahead: false,
            open: None,
            mirror: None,
        }
    }

    pub fn into_parts(mut self) -> (Moves, Vec<String>) {
        if !self.state.units_given {
            self.warnings.push("the program gives no units (G20 or G21): millimetres are assumed".into());
        }
        (self.moves, self.warnings)
    }

    /// Runs a block of the given line; true where it ends the program.
    #[inline]
    pub fn run(&mut self, block: &Block, line: u32) -> Outcome<bool> {
        self.line = line;
        if !block.only_motion() || self.open.is_some() || self.state.meaning == Meaning::Vector {
            return self.run_all(block);
        }
        // Nearly all blocks are a straight move or an arc and nothing else.
        let axes = block.words & AXIS_WORDS;
        let rest = block.words & !(AXIS_WORDS | FREE_WORDS);
        match motion_of(block, axes, self.state.motion, false)? {
            Some(motion @ (0 | 10)) if rest == 0 => {
                self.set_feed_and_speed(block)?;
                self.state.motion = motion;
                self.state.sticky.initial = None;
                self.straight(block, motion == 0, false)?;
                Ok(false)
            }
            Some(motion @ (20 | 30)) if rest & !ARC_WORDS == 0 => {
                self.set_feed_and_speed(block)?;
                self.state.motion = motion;
                self.state.sticky.initial = None;
                self.arc(block, motion == 20)?;
                Ok(false)
            }
            None if block.is_empty() => Ok(false),
            _ => self.run_all(block),
        }
    }

    fn run_all(&mut self, block: &Block) -> Outcome<bool> {
        if let Some(nurbs) = self.open.take() {
            return self.continue_spline(block, nurbs).map(|()| false);
        }
        let axes = axis_words(block);
        let vector = self.state.meaning == Meaning::Vector;
        let motion = motion_of(block, axes, self.state.motion, vector)?;
        let directed = takes_direction(block, self.state.meaning, motion);
        check_use(block, axes, motion, self.state.absolute, directed)?;
        self.check_meaning(block, motion)?;
        let motion = motion.filter(|_| !self.switches_look_ahead(block, motion));

        self.set_feed_and_speed(block)?;
        self.switch(block)?;
        if block.code(Group::Once) == Some(40) {
            self.pause(block, axes)?;
        }
        self.set_modes(block)?;
        self.set_offsets(block)?;
        match block.code(Group::Once) {
            Some(280 | 300) => self.go_home(block)?,
            Some(100) => self.set_work_offset(block)?,
            Some(code @ (520 | 920)) => self.shift(block, code)?,
            _ => {}
        }
        if let Some(code) = block.code(Group::Shift) {
            self.reset_shift(code);
        }
        if let Some(motion) = motion {
            if !is_cycle(motion) {
                self.state.sticky.initial = None;
            }
            match motion {
                _ if matches!(block.code(Group::Once), Some(280 | 300)) => {}
                0 | 10 => self.straight(block, motion == 0, block.code(Group::Once) == Some(530))?,
                20 | 30 => self.arc(block, motion == 20)?,
                50..=62 => self.spline(block, motion)?,
                800 => {}
                _ => self.cycle(block, motion)?,
            }
            self.state.motion = motion;
        }
        match block.m_code(MGroup::Stop) {
            Some(code) => {
                let ends = matches!(code, 2 | 30);
                self.moves.stop(if ends { Stop::End } else { Stop::Pause });
                Ok(ends)
            }
            None => Ok(false),
        }
    }

    /// G93 G94 G95, F and S.
    #[inline(always)]
    fn set_feed_and_speed(&mut self, block: &Block) -> Outcome<()> {
        if let Some(code) = block.code(Group::FeedMode) {
            let mode = match code {
                930 => FeedMode::Inverse,
                940 => FeedMode::PerMinute,
                _ => FeedMode::PerTurn,
            };
            if mode != self.state.feed_mode {
                self.state.feed_mode = mode;
                self.state.feed = None;
            }
        }
        if let Some(feed) = block.get(b'F') {
            self.set_feed(block, feed)?;
        }
        if let Some(code) = block.code(Group::SpindleMode) {
            self.state.constant_surface_speed = code == 960;
            self.state.spindle_speed = None;
        }
        if let Some(speed) = block.get(b'S') {
            self.state.spindle_speed = (!self.state.constant_surface_speed).then_some(speed);
        }
        if block.words & bits(b"SHTD") != 0 {
            for letter in *b"SHTD" {
                if block.get(letter).is_some_and(|value| value < 0.0) {
                    return fault(format!("word {} is negative: give a number from 0", block.word(letter)));
                }
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn set_feed(&mut self, block: &Block, feed: f64) -> Outcome<()> {
        if feed < 0.0 {
            return fault(format!("word {} is a negative feed: give a positive one", block.word(b'F')));
        }
        if feed != 0.0 && !RATES.contains(&feed) {
            return fault(format!(
                "word {} is a feed that no machine has: check the number",
                block.word(b'F')
            ));
        }
        let inches = block.code(Group::Units).map_or(self.state.inches, |code| code == 200);
        let unit = if inches { super::modal::MM_PER_INCH } else { 1.0 };
        let per = if self.state.feed_mode == FeedMode::PerTurn { 1.0 } else { 60.0 };
        self.state.feed = Some(Feed { linear: feed * unit / per, angular: feed / per });
        Ok(())
    }

    /// M codes that switch something: the tool stands still for them.
    fn switch(&mut self, block: &Block) -> Outcome<()> {
        let codes = [MGroup::ToolChange, MGroup::Spindle, MGroup::Coolant, MGroup::User];
        for code in codes.into_iter().filter_map(|group| block.m_code(group)) {
            self.moves.stop(if code == 6 { Stop::Tool } else { Stop::Switch });
            match code {
                3 | 4 => self.state.spindle_on = true,
                5 => self.state.spindle_on = false,
                19 | 100.. if !self.warned_codes.contains(&code) => {
                    self.warned_codes.push(code);
                    self.warn(format!(
                        "what M{code} does is not known: a stop is planned for it, of no duration"
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// G4: P or X seconds.
    fn pause(&mut self, block: &Block, axes: u32) -> Outcome<()> {
        let letter = if block.has(b'P') { b'P' } else { b'X' };
        let Some(seconds) = block.get(letter).filter(|_| axes & bit(letter) == 0) else {
            return fault("G4 has no time: give it seconds as P or X");
        };
        self.dwell(block, letter, seconds)
    }

    /// A pause of a word's seconds.
    pub(super) fn dwell(&mut self, block: &Block, letter: u8, seconds: f64) -> Outcome<()> {
        if !(0.0..=1e6).contains(&seconds) {
            let word =
                if block.has(letter) { block.word(letter) } else { format!("{}{seconds}", letter as char) };
            return fault(format!("word {word} is no dwell time: give seconds from 0 to 1000000"));
        }
        if seconds > LONG_DWELL && !self.warned_dwell {
            self.warned_dwell = true;
            self.warn(format!("a dwell takes {seconds} s: dwells are read in seconds, not in milliseconds"));
        }
        self.moves.dwell(seconds);
        Ok(())
    }

    /// Plane, units, path control, distance modes and retract mode.
    fn set_modes(&mut self, block: &Block) -> Outcome<()> {
        let state = &mut self.state;
        match block.code(Group::Plane) {
            Some(170) => state.normal = 2,
            Some(180) => state.normal = 1,
            Some(190) => state.normal = 0,
            _ => {}
        }
        if let Some(code) = block.code(Group::Units) {
            state.inches = code == 200;
            state.units_given = true;
        }
        match block.code(Group::Control) {
            Some(610) => state.control = Control::new(Mode::ExactPath),
            Some(611) => state.control = Control::new(Mode::ExactStop),
            Some(640) => {
                let mut control = Control::new(Mode::Tolerance);
                for (letter, place) in [(b'P', &mut control.blend), (b'Q', &mut control.fit)] {
                    if let Some(value) = block.get(letter) {
                        if !(0.0..=FARTHEST).contains(&value) {
                            return fault(format!(
                                "word {} is no tolerance: give one from 0",
                                block.word(letter)
                            ));
                        }
                        *place = value * state.unit();
                    }
                }
                state.control = control;
            }
            _ => {}
        }
        if let Some(code) = block.code(Group::Distance) {
            state.absolute = code == 900;
        }
        if let Some(code) = block.code(Group::ArcDistance) {
            state.absolute_centres = code == 901;
        }
        if let Some(code) = block.code(Group::Retract) {
            state.retract_to_initial = code == 980;
        }
        Ok(())
    }

    /// The axes that the block names, with their values in mm and degrees; axes named the first time get a column.
    #[inline(always)]
    pub(super) fn places(&mut self, block: &Block, mut each: impl FnMut(usize, f64)) -> Outcome<()> {
        let mut words = block.words & AXIS_WORDS;
        if words & !self.known != 0 {
            self.meet(words)?;
        }
        let unit = self.state.unit();
        while words != 0 {
            let place = words.trailing_zeros() as usize;
            words &= words - 1;
            let axis = AXIS_OF_LETTER[place] as usize;
            let value = block.value(b'A' + place as u8);
            each(axis, if rotary(axis) { value } else { value * unit });
        }
        Ok(())
    }

    /// Axes named for the first time: the machine must have them.
    #[cold]
    pub(super) fn meet(&mut self, words: u32) -> Outcome<()> {
        for (axis, &letter) in AXES.iter().enumerate().filter(|(_, &letter)| words & bit(letter) != 0) {
            if !self.options.machine_axes.is_empty() && !self.options.machine_axes.contains(&letter) {
                let letter = letter as char;
                return fault(format!(
                    "word {letter} moves an axis that the machine does not have: use a machine with {letter}, or post \
                     without it"
                ));
            }
            self.moves.add_axis(axis);
        }
        self.known |= words;
        Ok(())
    }

    /// The end of a move to the block's axis words.
    #[inline(always)]
    pub(super) fn target(&mut self, block: &Block, machine: bool) -> Outcome<Point> {
        let mut target = self.moves.position;
        let zero = if machine { [0.0; 9] } else { *self.state.offsets.sum() };
        let absolute = self.state.absolute;
        self.places(block, |axis, value| {
            target[axis] = value + if absolute { zero[axis] } else { target[axis] };
        })?;
        self.check_reach(&target)?;
        Ok(target)
    }

    /// Refuses places that no machine reaches, and what is not a number.
    #[inline(always)]
    pub(super) fn check_reach(&self, target: &Point) -> Outcome<()> {
        let reached = |axis: usize| target[axis].abs() <= if rotary(axis) { FARTHEST_TURN } else { FARTHEST };
        match (0..9).find(|&axis| !reached(axis)) {
            None => Ok(()),
            Some(axis) => too_far(axis, target[axis]),
        }
    }

    pub(super) fn rapid(&mut self, target: &Point) -> Outcome<()> {
        self.moves.straight(Kind::Rapid, target, f64::INFINITY, &self.state.control, self.line)
    }

    pub(super) fn warn(&mut self, text: String) {
        self.warnings.push(format!("line {}: {text}", self.line));
    }
}

#[cold]
fn too_far<T>(axis: usize, value: f64) -> Outcome<T> {
    let (unit, farthest) = if rotary(axis) { ("degrees", FARTHEST_TURN) } else { ("mm", FARTHEST) };
    fault(format!(
        "{} would go to {value} {unit}, more than {farthest} {unit} from the machine's zero: check the number, the units \
         and the offsets",
        AXES[axis] as char,
    ))
}
