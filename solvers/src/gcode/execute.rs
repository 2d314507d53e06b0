//! One block after another, in LinuxCNC's order of execution:
//!
//! feed mode, F, S, M6, spindle, coolant, overrides, user codes, G4, plane, units, tool length, work offset, path
//! control, distance modes, retract mode, G10 G28 G30 G52 G92, motion, M0 M1 M2 M30 M60.
//!
//! One difference: F counts in the units of its own block (`G20 F10` is 10 inch/min), as most controls and all posts
//! have it; LinuxCNC reads it before the units change.

use super::block::{bit, bits, g_name, rotary, Block, Group, MGroup, AXES, AXIS_OF_LETTER, AXIS_WORDS};
use super::fault::{fault, Outcome};
use super::modal::{Feed, FeedMode, State};
use super::moves::{Control, Kind, Mode, Moves, Point};
use super::words::count;
use super::Options;

/// Farther than this from the machine's zero is a mistake, in mm;
const FARTHEST: f64 = 1e6;

/// rotary axes may wind up, in degrees.
const FARTHEST_TURN: f64 = 1e8;

/// Feeds and spindle speeds of the program beyond these are mistakes.
pub(super) const RATES: std::ops::RangeInclusive<f64> = 1e-6..=1e9;

/// Longer dwells are probably milliseconds taken for seconds.
const LONG_DWELL: f64 = 100.0;

/// Words that need no G code in their block. D names a cutter radius, which only G41 and G42 would use.
const FREE_WORDS: u32 = bits(b"FSTD");

/// Words of G2 and G3 beside the axes.
const ARC_WORDS: u32 = bits(b"IJKRP");

/// Codes that name no motion but take the axis words of their block.
const TAKES_AXES: [u16; 5] = [100, 280, 300, 520, 920];

/// Runs blocks.
pub struct Interpreter<'a> {
    pub(super) state: State,
    pub(super) moves: Moves,
    pub(super) line: u32,
    options: &'a Options,
    /// Letters of the axes that the program has named.
    known: u32,
    warnings: Vec<String>,
    warned_codes: Vec<u16>,
    warned_tool: bool,
    warned_dwell: bool,
}

impl<'a> Interpreter<'a> {
    pub fn new(options: &'a Options, expected: usize) -> Self {
        Self {
            state: State::new(options.offsets),
            moves: Moves::new(expected, options.max_moves),
            line: 0,
            options,
            known: 0,
            warnings: Vec::new(),
            warned_codes: Vec::new(),
            warned_tool: false,
            warned_dwell: false,
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
        if !block.only_motion() {
            return self.run_all(block);
        }
        // Nearly all blocks are a straight move or an arc and nothing else.
        let axes = block.words & AXIS_WORDS;
        let rest = block.words & !(AXIS_WORDS | FREE_WORDS);
        match self.motion_of(block, axes)? {
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
        let axes = self.axis_words(block);
        let motion = self.motion_of(block, axes)?;
        self.check_use(block, axes, motion)?;

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
                800 => {}
                _ => self.cycle(block, motion)?,
            }
            self.state.motion = motion;
        }
        match block.m_code(MGroup::Stop) {
            Some(code) => {
                self.moves.stop();
                Ok(matches!(code, 2 | 30))
            }
            None => Ok(false),
        }
    }

    /// The axis words of the block that are places; with G4 a lone X is a time.
    fn axis_words(&self, block: &Block) -> u32 {
        let axes = block.words & AXIS_WORDS;
        let timed = axes == bit(b'X') && block.code(Group::Once) == Some(40) && !block.has(b'P');
        if timed && block.code(Group::Motion).is_none() {
            0
        } else {
            axes
        }
    }

    /// The motion that the block asks for, by its code or by its words.
    #[inline(always)]
    fn motion_of(&self, block: &Block, axes: u32) -> Outcome<Option<u16>> {
        match block.code(Group::Motion) {
            Some(code @ (0 | 10 | 20 | 30)) if block.only_motion() => Ok(Some(code)),
            None if axes != 0 && block.only_motion() && self.state.motion != 800 => {
                Ok(Some(self.state.motion))
            }
            code => self.motion_beside_others(block, axes, code),
        }
    }

    fn motion_beside_others(&self, block: &Block, axes: u32, motion: Option<u16>) -> Outcome<Option<u16>> {
        let once = block.code(Group::Once).filter(|code| TAKES_AXES.contains(code));
        let tool = block.code(Group::ToolLength).filter(|code| matches!(code, 431 | 432));
        match (motion, once.or(tool)) {
            // `G0 G28 Z0` is common: G28 has the axis words, G0 stays in force.
            (Some(code @ (0 | 800)), Some(280 | 300)) | (Some(code @ 800), Some(_)) => Ok(Some(code)),
            (Some(code), Some(other)) => fault(format!(
                "words {} and {} both take axis words: put them in two blocks",
                g_name(other),
                g_name(code)
            )),
            (Some(800), None) if axes != 0 => {
                fault("axis words stand beside G80, which ends motion: give G0 or G1 instead")
            }
            (Some(code), None) if is_cycle(code) && axes == 0 => {
                fault(format!("word {} has no axis words: give the place of the hole", g_name(code)))
            }
            (Some(code), None) => Ok(Some(code)),
            (None, Some(_)) if once.is_some() || axes != 0 => Ok(None),
            (None, _) if axes != 0 && self.state.motion == 800 => {
                let letter = AXES.into_iter().find(|&letter| axes & bit(letter) != 0).unwrap_or(b'X');
                fault(format!(
                    "word {} has no motion code in force: give G0 or G1 before it",
                    block.word(letter)
                ))
            }
            (None, _) if axes != 0 => Ok(Some(self.state.motion)),
            (None, _) if block.words & bits(b"IJK") != 0 && matches!(self.state.motion, 20 | 30) => {
                Ok(Some(self.state.motion))
            }
            (None, _) => Ok(None),
        }
    }

    /// Every word must mean something: one that nothing uses is a misunderstanding.
    fn check_use(&self, block: &Block, axes: u32, motion: Option<u16>) -> Outcome<()> {
        let mut used = FREE_WORDS | axes;
        used |= match motion {
            Some(20 | 30) => ARC_WORDS,
            Some(730 | 830) => bits(b"RLQ"),
            Some(820 | 740 | 840 | 860 | 890) => bits(b"RLP"),
            Some(810 | 850) => bits(b"RL"),
            _ => 0,
        };
        used |= match block.code(Group::Once) {
            Some(40) => bits(b"PX"),
            Some(100) => bits(b"PLR"),
            _ => 0,
        };
        if block.code(Group::Control) == Some(640) {
            used |= bits(b"PQ");
        }
        if matches!(block.code(Group::ToolLength), Some(430 | 432 | 490)) {
            used |= bit(b'H');
        }
        if block.m_code(MGroup::User).is_some() || block.m_code(MGroup::Spindle) == Some(19) {
            used |= bits(b"PQR");
        }
        let unused = block.words & !used;
        if unused == 0 {
            return self.check_once(block, motion);
        }
        let letter = b'A' + unused.trailing_zeros() as u8;
        let remedy = match (letter, motion) {
            (b'P', Some(730 | 830)) => "this cycle has no dwell: remove it, or use G82",
            (b'H', _) => "put it beside G43",
            (b'K', Some(motion)) if is_cycle(motion) => "repetitions are counted by L",
            _ => "no code of the block uses it; remove it",
        };
        fault(format!("word {} has no meaning here: {remedy}", block.word(letter)))
    }

    /// Combinations that controls refuse.
    fn check_once(&self, block: &Block, motion: Option<u16>) -> Outcome<()> {
        match (block.code(Group::Once), motion) {
            (Some(40), Some(20 | 30)) => fault("G4 and an arc both use P: put them in two blocks"),
            (Some(530), Some(0 | 10)) => {
                let absolute = block.code(Group::Distance).map_or(self.state.absolute, |code| code == 900);
                if absolute {
                    return Ok(());
                }
                fault("G53 takes machine coordinates and G91 is in force: give G90 in its block")
            }
            (Some(530), _) => {
                fault("G53 goes with straight moves only: give G0 or G1 and axis words in its block")
            }
            (Some(520 | 920), _) if block.words & AXIS_WORDS == 0 => {
                fault("G52 and G92 need the axes they set: give axis words")
            }
            _ => Ok(()),
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
            self.moves.stop();
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
    fn meet(&mut self, words: u32) -> Outcome<()> {
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

    /// Work offset of G10 L2 and L20.
    fn set_work_offset(&mut self, block: &Block) -> Outcome<()> {
        let from_here = match block.get(b'L') {
            Some(2.0) => false,
            Some(20.0) => true,
            _ => return fault("G10 sets something else than work offsets: only G10 L2 and G10 L20 are read"),
        };
        if block.get(b'R').is_some_and(|angle| angle != 0.0) {
            return fault(format!(
                "word {} turns the work coordinates, which is not read: post the coordinates as they are cut",
                block.word(b'R')
            ));
        }
        let system = match count(block, b'P', 0, "work offset")? {
            Some(0) => self.state.offsets.system,
            Some(number @ 1..=9) => number as usize - 1,
            _ => return fault("G10 needs P0 to P9: P0 is the offset in force, P1 is G54, P9 is G59.3"),
        };
        let position = self.moves.position;
        let (shift, tool) = (self.state.offsets.shift, self.state.offsets.tool);
        let mut work = self.state.offsets.work[system];
        self.places(block, |axis, value| {
            work[axis] = if from_here { position[axis] - shift[axis] - tool[axis] - value } else { value };
        })?;
        self.state.offsets.work[system] = work;
        self.state.offsets.update();
        Ok(())
    }

    /// G52 sets the shift, G92 lets the axes named stand at the values given; both share one offset.
    fn shift(&mut self, block: &Block, code: u16) -> Outcome<()> {
        let position = self.moves.position;
        let sum = *self.state.offsets.sum();
        let mut shift = self.state.offsets.shift;
        self.places(block, |axis, value| {
            shift[axis] =
                if code == 520 { value } else { position[axis] - (sum[axis] - shift[axis]) - value };
        })?;
        self.state.offsets.shift = shift;
        self.state.offsets.saved_shift = shift;
        self.state.offsets.update();
        Ok(())
    }

    /// G92.1 forgets the shift, G92.2 suspends it, G92.3 brings it back.
    fn reset_shift(&mut self, code: u16) {
        let offsets = &mut self.state.offsets;
        offsets.shift = if code == 923 { offsets.saved_shift } else { [0.0; 9] };
        if code == 921 {
            offsets.saved_shift = [0.0; 9];
        }
        offsets.update();
    }

    /// Tool length and work offset.
    fn set_offsets(&mut self, block: &Block) -> Outcome<()> {
        match block.code(Group::ToolLength) {
            Some(code @ (430 | 432)) if block.words & AXIS_WORDS == 0 || code == 430 => {
                if code == 432 && !block.has(b'H') {
                    return fault("G43.2 adds nothing: give it H or axis words");
                }
                if code == 430 {
                    self.state.offsets.tool = [0.0; 9];
                }
                self.warn_of_tool();
            }
            Some(code @ (431 | 432)) => {
                if block.has(b'H') {
                    return fault(format!("{} has both H and axis words: give one of them", g_name(code)));
                }
                if block.words & AXIS_WORDS == 0 {
                    return fault("G43.1 sets nothing: give it axis words");
                }
                let mut tool = self.state.offsets.tool;
                self.places(block, |axis, value| {
                    tool[axis] = value + if code == 432 { tool[axis] } else { 0.0 }
                })?;
                self.state.offsets.tool = tool;
            }
            Some(490) => self.state.offsets.tool = [0.0; 9],
            _ => {}
        }
        match block.code(Group::System) {
            Some(code @ 591..=593) => self.state.offsets.system = usize::from(code - 591) + 6,
            Some(code) => self.state.offsets.system = usize::from(code - 540) / 10,
            None => {}
        }
        self.state.offsets.update();
        Ok(())
    }

    fn warn_of_tool(&mut self) {
        if !self.warned_tool {
            self.warned_tool = true;
            self.warn(
                "the tool lengths that G43 calls for are not known: 0 is taken for each (G43.1 Z gives one)"
                    .into(),
            );
        }
    }

    /// G28 and G30: rapid to the place that the block names, then the axes named to the machine's home; all axes
    /// where none is named.
    fn go_home(&mut self, block: &Block) -> Outcome<()> {
        let via = self.target(block, false)?;
        self.rapid(&via)?;
        let mut target = via;
        let home = &self.options.home;
        if block.words & AXIS_WORDS != 0 {
            self.places(block, |axis, _| target[axis] = home[axis])?;
        } else {
            let machine = self.options.machine_axes.iter().fold(0, |sum, &letter| sum | bit(letter));
            if machine & !self.known != 0 {
                self.meet(machine)?;
            }
            for &axis in self.moves.axes() {
                target[axis] = home[axis];
            }
        }
        self.check_reach(&target)?;
        self.rapid(&target)
    }

    pub(super) fn rapid(&mut self, target: &Point) -> Outcome<()> {
        self.moves.straight(Kind::Rapid, target, f64::INFINITY, &self.state.control, self.line)
    }

    pub(super) fn warn(&mut self, text: String) {
        self.warnings.push(format!("line {}: {text}", self.line));
    }
}

/// Canned cycles are 730, 740 and 810 to 890.
pub(super) fn is_cycle(motion: u16) -> bool {
    matches!(motion, 730 | 740 | 810..=890)
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
