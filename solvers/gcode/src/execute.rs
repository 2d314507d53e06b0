//! Runs one block after another, in LinuxCNC's order of execution:
//!
//! feed mode, F, S, M6, spindle, coolant, overrides, user codes, G4, plane, units, tool length, work offset, path
//! control, distance modes, retract mode, G10 G28 G30 G52 G92, motion, M0 M1 M2 M30 M60.
//!
//! There is one difference: F has the units of its own block (`G20 F10` is 10 inch/min), as on most controls and in all
//! posts. LinuxCNC reads F before the units change.

use super::block::{bit, bits, g_name, rotary, Block, Group, MGroup, AXES, AXIS_OF_LETTER, AXIS_WORDS};
use super::compensate::Compensation;
use super::corner::Corner;
use super::fault::{fault, Outcome};
use super::intent::{axis_words, check_use, is_cycle, motion_of, ARC_WORDS, FREE_WORDS};
use super::modal::{Feed, FeedMode, State};
use super::moves::{Control, Kind, Mode, Moves, Point, Stop};
use super::parameters::{first_of_system, Parameters, HOME, SECOND_HOME, SYSTEM};
use super::spline::Nurbs;
use super::tip::{takes_direction, CoordinateMode};
use super::tolerance::{FARTHEST, FARTHEST_TURN, LONG_DWELL, MM_PER_INCH, MOST_DWELL, RATES};
use super::tools::Tool;
use super::Options;

/// The state of the program between two blocks.
pub struct Interpreter<'a> {
    pub(super) state: State,
    pub(super) moves: Moves,
    pub(super) line: u32,
    pub(super) options: &'a Options,
    /// Letters of the axes that the program has named.
    pub(super) known: u32,
    warnings: Vec<String>,
    warned: Vec<Topic>,
    /// The NURBS that is being read.
    pub(super) open: Option<Box<Nurbs>>,
    /// The row in which a G5 may follow without I and J, and the I and J that it has then, in mm.
    pub(super) mirror: Option<(usize, [f64; 2])>,
    pub parameters: Parameters,
    pub(super) tools: Option<Vec<Tool>>,
    /// The table's row of the tool in the spindle, the number of that tool, and the number that T has called.
    pub(super) tool: Option<Tool>,
    pub(super) loaded: Option<u32>,
    pub(super) selected: Option<u32>,
    /// The corner that waits for the next straight move.
    pub(super) corner: Option<Corner>,
    /// The compensation, while G41 or G42 is on.
    pub(super) compensation: Option<Box<Compensation>>,
    /// Modes that M70 and M73 have saved, with the depth of calls, and true where the end of the call restores them.
    pub(super) saved: Vec<(usize, bool, State)>,
}

/// What a program is warned of once.
#[derive(PartialEq)]
pub(super) enum Topic {
    UnknownCode(u16),
    NoToolTable,
    NoToolLength,
    LongDwell,
    Extruder,
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

    /// The point of the programmed path; the tool is beside it while G41 or G42 is on.
    #[inline(always)]
    pub(super) fn position(&self) -> Point {
        match &self.compensation {
            None => self.moves.position,
            Some(compensation) => compensation.programmed,
        }
    }

    /// The feed in force, as a value of F.
    pub(super) fn feed_word(&self) -> f64 {
        let per = if self.state.feed_mode == FeedMode::PerTurn { 1.0 } else { 60.0 };
        self.state.feed.map_or(0.0, |feed| feed.angular * per)
    }

    /// A message to the operator, or a comment.
    pub fn remark(&mut self, line: u32, letter: u8, text: String) {
        self.moves.remark(line, letter, text);
    }

    /// Runs a block of a line; true where it ends the program.
    #[inline]
    pub fn run(&mut self, block: &Block, line: u32) -> Outcome<bool> {
        self.line = line;
        if !block.only_motion() || self.open.is_some() || self.state.coordinate_mode == CoordinateMode::Vector
        {
            return self.run_all(block);
        }
        // Nearly all blocks contain a straight move or an arc and nothing else.
        let axes = block.words & AXIS_WORDS;
        let rest = block.words & !(AXIS_WORDS | FREE_WORDS) | block.words & bit(b'T');
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
        // The words of a G65 block are arguments of the macro.
        if block.code(Group::Macro).is_some() {
            return Ok(false);
        }
        let axes = axis_words(block);
        let vector = self.state.coordinate_mode == CoordinateMode::Vector;
        let motion = motion_of(block, axes, self.state.motion, vector)?;
        let directed = takes_direction(block, self.state.coordinate_mode, motion);
        check_use(block, axes, motion, self.state.absolute, directed)?;
        self.check_coordinate_mode(block, motion)?;
        let motion = motion.filter(|_| !self.switches_look_ahead(block, motion));

        if block.corner.is_some() && motion != Some(10) {
            return fault("a corner ,C or ,R stands behind no straight move: give G1 and its place");
        }
        self.set_feed_and_speed(block)?;
        self.switch(block)?;
        if block.code(Group::Once) == Some(40) {
            self.pause(block, axes)?;
        }
        self.set_modes(block)?;
        if let Some(code) = block.code(Group::Compensation) {
            self.set_compensation(block, code)?;
        }
        if block.code(Group::Turn) == Some(690) {
            self.end_turn();
        }
        self.check_turned(block)?;
        self.set_offsets(block)?;
        if block.code(Group::Turn) == Some(680) {
            self.begin_turn(block)?;
        }
        if let Some(code) = block.code(Group::Once).filter(|code| !matches!(code, 40 | 600)) {
            self.check_beside(&g_name(code))?;
        }
        match block.code(Group::Once) {
            Some(code @ (280..=284 | 300 | 301)) => self.go_home(block, code)?,
            Some(100) => self.set_data(block)?,
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
                _ if matches!(block.code(Group::Once), Some(280..=301)) => {}
                0 | 10 if block.code(Group::Once) == Some(600) => self.approach(block, motion)?,
                0 | 10 => self.straight(block, motion == 0, block.code(Group::Once) == Some(530))?,
                20 | 30 => self.arc(block, motion == 20)?,
                50..=62 => self.spline(block, motion)?,
                330 | 331 => self.thread_once(block, motion)?,
                760 => self.thread(block)?,
                800 => {}
                _ => self.cycle(block, motion)?,
            }
            self.state.motion = motion;
        }
        if let Some(code) = block.m_code(MGroup::Saved) {
            self.save_modes(code);
        }
        match block.m_code(MGroup::Stop) {
            Some(code) => {
                let ends = matches!(code, 2 | 30);
                self.moves.event(self.line, b'M', f64::from(code), None, None);
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
            self.moves.event(self.line, b'S', speed, None, None);
            self.state.spindle_speed = (!self.state.constant_surface_speed).then_some(speed);
        }
        if block.words & bits(b"SHTD") != 0 {
            // A negative diameter stands for a tool smaller than the one which the path is made for.
            let diameter = matches!(block.code(Group::Compensation), Some(411 | 421));
            for letter in *b"SHTD" {
                if !(diameter && letter == b'D') && block.get(letter).is_some_and(|value| value < 0.0) {
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
        let unit = if inches { MM_PER_INCH } else { 1.0 };
        let per = if self.state.feed_mode == FeedMode::PerTurn { 1.0 } else { 60.0 };
        self.state.feed = Some(Feed { linear: feed * unit / per, angular: feed / per });
        Ok(())
    }

    /// T, and M codes that switch something, with a stop of the tool where they need one.
    fn switch(&mut self, block: &Block) -> Outcome<()> {
        let change = block.m_code(MGroup::ToolChange);
        if change.is_some() || block.has(b'T') {
            self.set_tool(block, change)?;
        }
        if block.has(b'E') && block.m_code(MGroup::Output).is_none() {
            self.warn_once(Topic::Extruder, || {
                "the words E are left out: they move an extruder, which is not planned".into()
            });
        }
        let known = [MGroup::ToolChange, MGroup::Spindle, MGroup::Coolant, MGroup::Output, MGroup::User];
        let codes = known.into_iter().filter_map(|group| block.m_code(group));
        for code in codes.chain(block.others().iter().copied()) {
            // M62, M63, M67 switch while the tool moves.
            if !matches!(code, 61..=63 | 67) {
                self.moves.stop(if code == 6 { Stop::Tool } else { Stop::Switch });
            }
            let output = block.get(b'E').filter(|_| matches!(code, 66..=68));
            let tool = (code == 6).then(|| self.tool_number());
            self.moves.event(
                self.line,
                b'M',
                f64::from(code),
                tool.or(block.get(b'P')).or(output),
                block.get(b'Q'),
            );
            match code {
                3 | 4 => (self.state.spindle_on, self.state.spindle_back) = (true, code == 4),
                5 => self.state.spindle_on = false,
                7 => self.state.mist = true,
                8 => self.state.flood = true,
                9 => (self.state.mist, self.state.flood) = (false, false),
                6 | 61..=68 => {}
                _ => self.warn_once(Topic::UnknownCode(code), || {
                    format!("what M{code} does is not known: a stop is planned for it, of no duration")
                }),
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

    /// A pause of the seconds that a word gives.
    pub(super) fn dwell(&mut self, block: &Block, letter: u8, seconds: f64) -> Outcome<()> {
        if !(0.0..=MOST_DWELL).contains(&seconds) {
            let word =
                if block.has(letter) { block.word(letter) } else { format!("{}{seconds}", letter as char) };
            return fault(format!("word {word} is no dwell time: give seconds from 0 to {MOST_DWELL}"));
        }
        if seconds > LONG_DWELL {
            self.warn_once(Topic::LongDwell, || {
                format!("a dwell takes {seconds} s: dwells are read in seconds, not in milliseconds")
            });
        }
        self.moves.event(self.line, b'G', 4.0, Some(seconds), None);
        self.moves.dwell(seconds);
        Ok(())
    }

    /// Calls `each` for each axis that the block names, with its value in mm or degrees. An axis that is named for the
    /// first time gets a column.
    #[inline(always)]
    pub(super) fn axis_values(&mut self, block: &Block, mut each: impl FnMut(usize, f64)) -> Outcome<()> {
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

    /// Gives columns to axes that are named for the first time; the machine must have them.
    #[cold]
    pub(super) fn add_axes(&mut self, words: u32) -> Outcome<()> {
        for (axis, &letter) in AXES.iter().enumerate().filter(|(_, &letter)| words & bit(letter) != 0) {
            if !self.options.machine_axes.is_empty() && !self.options.machine_axes.contains(&letter) {
                let letter = letter as char;
                let others =
                    self.options.machines_with.as_ref().map(|names| names(letter)).unwrap_or_default();
                return fault(format!(
                    "word {letter} moves an axis that the machine does not have: use a machine with {letter}{others}, \
                     or post without it"
                ));
            }
            self.moves.add_axis(axis);
        }
        self.known |= words;
        Ok(())
    }

    /// The end of a move to the axis words of a block.
    #[inline(always)]
    pub(super) fn target(&mut self, block: &Block, machine: bool) -> Outcome<Point> {
        if self.state.offsets.rotation != 0.0 || self.state.polar || block.is_polar() {
            return self.turned_target(block, machine, &self.position());
        }
        let mut target = self.position();
        let zero = if machine { [0.0; 9] } else { *self.state.offsets.sum() };
        let absolute = self.state.absolute;
        self.axis_values(block, |axis, value| {
            target[axis] = value + if absolute { zero[axis] } else { target[axis] };
        })?;
        self.check_reach(&target)?;
        Ok(target)
    }

    /// Refuses positions that no machine reaches, or that are not numbers.
    #[inline(always)]
    pub(super) fn check_reach(&self, target: &Point) -> Outcome<()> {
        let reached = |axis: usize| target[axis].abs() <= if rotary(axis) { FARTHEST_TURN } else { FARTHEST };
        // All nine are tested without a branch, and the faulty one is looked up afterwards.
        if (0..9).fold(true, |all, axis| all & reached(axis)) {
            return Ok(());
        }
        let axis = (0..9).find(|&axis| !reached(axis)).unwrap_or(0);
        too_far(axis, target[axis])
    }

    pub(super) fn rapid(&mut self, target: &Point) -> Outcome<()> {
        self.go(Kind::Rapid, target, f64::INFINITY)
    }

    /// A straight move to a point of the programmed path.
    #[inline(always)]
    pub(super) fn go(&mut self, kind: Kind, target: &Point, feed: f64) -> Outcome<()> {
        if self.compensation.is_some() {
            return self.go_beside(kind, target, feed);
        }
        if self.corner.is_some() {
            self.cut_corner(kind, target)?;
        }
        self.moves.straight(kind, target, feed, &self.state.control, self.line)
    }

    /// G60: a rapid that ends with an exact stop.
    fn approach(&mut self, block: &Block, motion: u16) -> Outcome<()> {
        let before = self.state.control;
        self.state.control = Control::new(Mode::ExactStop);
        let done = self.straight(block, motion == 0, false);
        self.state.control = before;
        done
    }

    pub(super) fn warn(&mut self, text: String) {
        self.warnings.push(format!("line {}: {text}", self.line));
    }

    /// Warns of a topic for the first time.
    pub(super) fn warn_once(&mut self, topic: Topic, text: impl FnOnce() -> String) {
        if !self.warned.contains(&topic) {
            self.warned.push(topic);
            self.warn(text());
        }
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
