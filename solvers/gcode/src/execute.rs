//! Runs one block after another, in LinuxCNC's order of execution:
//!
//! feed mode, F, S, M6, spindle, coolant, overrides, user codes, G4, plane, units, tool length, work offset, path
//! control, distance modes, retract mode, G10 G28 G30 G52 G92, motion, M0 M1 M2 M30 M60.
//!
//! There is one difference: F has the units of its own block (`G20 F10` is 10 inch/min), as on most controls and in all
//! posts. LinuxCNC reads F before the units change.

use super::block::{bit, bits, g_name, Block, Group, MGroup, AXIS_WORDS};
use super::coordinates::{CoordinateMode, Point};
use super::fault::Outcome;
use super::intent::{axis_words, check_use, is_cycle, motion_of, ARC_WORDS, FREE_WORDS};
use super::interpreter::{Interpreter, Topic};
use super::modal::{Feed, FeedMode};
use super::moves::{Control, Kind, Mode, Stop};
use super::tip::takes_direction;
use super::tolerance::{LONG_DWELL, MM_PER_INCH, MOST_DWELL, RATES};

/// What the spindle does within a cycle.
pub enum Spindle {
    Off,
    Reversed,
    AsBefore,
}

impl Interpreter<'_> {
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
        let left_out = check_use(block, axes, motion, self.state.absolute, directed)?;
        self.check_coordinate_mode(block, motion)?;
        let motion = motion.filter(|_| !self.switches_look_ahead(block, motion));

        if block.corner.is_some() && motion != Some(10) {
            return fault!("a corner ,C or ,R stands behind no straight move: give G1 and its place");
        }
        self.set_feed_and_speed(block)?;
        self.warn_of(left_out);
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
                self.moves.event(self.line, b'M', f64::from(code), [None; 2]);
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
            self.moves.event(self.line, b'S', speed, [None; 2]);
            self.state.spindle_speed = (!self.state.constant_surface_speed).then_some(speed);
        }
        if block.words & bits(b"SHTD") != 0 {
            // A negative diameter stands for a tool smaller than the one which the path is made for.
            let diameter = matches!(block.code(Group::Compensation), Some(411 | 421));
            for letter in *b"SHTD" {
                if !(diameter && letter == b'D') && block.get(letter).is_some_and(|value| value < 0.0) {
                    return fault!("word {} is negative: give a number from 0", block.word(letter));
                }
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn set_feed(&mut self, block: &Block, feed: f64) -> Outcome<()> {
        if feed < 0.0 {
            return fault!("word {} is a negative feed: give a positive one", block.word(b'F'));
        }
        if feed != 0.0 && !RATES.contains(&feed) {
            return fault!("word {} is a feed that no machine has: check the number", block.word(b'F'));
        }
        let inches = block.code(Group::Units).map_or(self.state.inches, |code| code == 200);
        let unit = if inches { MM_PER_INCH } else { 1.0 };
        let per = if self.state.feed_mode == FeedMode::PerTurn { 1.0 } else { 60.0 };
        self.state.feed = Some(Feed { linear: feed * unit / per, angular: feed / per });
        Ok(())
    }

    /// Warns of the words that no code of their block uses and that are left out.
    #[inline]
    fn warn_of(&mut self, left_out: u32) {
        if left_out & bit(b'E') != 0 {
            self.warn_once(Topic::Extruder, || {
                "the words E are left out: they move an extruder, which is not planned".into()
            });
        }
        if left_out & bit(b'D') != 0 {
            self.warn_once(Topic::Diameter, || {
                "the words D that stand alone are left out: give D in the block of its G41 or G42".into()
            });
        }
    }

    /// T, and M codes that switch something, with a stop of the tool where they need one.
    fn switch(&mut self, block: &Block) -> Outcome<()> {
        let change = block.m_code(MGroup::ToolChange);
        if change.is_some() || block.has(b'T') {
            self.set_tool(block, change)?;
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
            let words = [tool.or(block.get(b'P')).or(output), block.get(b'Q')];
            self.moves.event(self.line, b'M', f64::from(code), words);
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

    /// Adds a stop at which a cycle changes the motion of the spindle and, if the spindle is on, an event M3, M4 or M5.
    pub fn turn_spindle(&mut self, spindle: Spindle) {
        self.moves.stop(Stop::Switch);
        if self.state.spindle_on {
            let code = match spindle {
                Spindle::Off => 5,
                Spindle::Reversed => 4 - u8::from(self.state.spindle_back),
                Spindle::AsBefore => 3 + u8::from(self.state.spindle_back),
            };
            self.moves.event(self.line, b'M', f64::from(code), [None; 2]);
        }
    }

    /// G4: P or X seconds.
    fn pause(&mut self, block: &Block, axes: u32) -> Outcome<()> {
        let letter = if block.has(b'P') { b'P' } else { b'X' };
        let Some(seconds) = block.get(letter).filter(|_| axes & bit(letter) == 0) else {
            return fault!("G4 has no time: give it seconds as P or X");
        };
        self.dwell(block, letter, seconds)
    }

    /// Adds a pause of `seconds`; `letter` is the word that gives them.
    pub fn dwell(&mut self, block: &Block, letter: u8, seconds: f64) -> Outcome<()> {
        if !(0.0..=MOST_DWELL).contains(&seconds) {
            let word =
                if block.has(letter) { block.word(letter) } else { format!("{}{seconds}", letter as char) };
            return fault!("word {word} is no dwell time: give seconds from 0 to {MOST_DWELL}");
        }
        if seconds > LONG_DWELL {
            self.warn_once(Topic::LongDwell, || {
                format!("a dwell takes {seconds} s: dwells are read in seconds, not in milliseconds")
            });
        }
        self.moves.event(self.line, b'G', 4.0, [Some(seconds), None]);
        self.moves.dwell(seconds);
        Ok(())
    }

    /// The end of a move to the axis words of a block.
    #[inline(always)]
    pub fn target(&mut self, block: &Block, machine: bool) -> Outcome<Point> {
        if self.state.offsets.rotation != 0.0 || self.state.polar || block.is_polar() {
            return self.turned_target(block, machine, &self.position());
        }
        let zero = if machine { [0.0; 9] } else { *self.state.offsets.sum() };
        self.place(block, self.position(), &zero)
    }

    /// The position that the axis words of a block give; with G91 they are relative to `place`.
    #[inline(always)]
    pub fn place(&mut self, block: &Block, mut place: Point, zero: &Point) -> Outcome<Point> {
        let absolute = self.state.absolute;
        self.axis_values(block, |axis, value| {
            place[axis] = value + if absolute { zero[axis] } else { place[axis] };
        })?;
        self.check_reach(&place)?;
        Ok(place)
    }

    pub fn rapid(&mut self, target: &Point) -> Outcome<()> {
        self.go(Kind::Rapid, target, f64::INFINITY)
    }

    /// A straight move to a point of the programmed path.
    #[inline(always)]
    pub fn go(&mut self, kind: Kind, target: &Point, feed: f64) -> Outcome<()> {
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
}
