//! What moves the program's zero: work offsets, G52 and G92, tool lengths; and the way home.

use super::block::{bit, g_name, Block, Group, AXES, AXIS_WORDS};
use super::execute::Interpreter;
use super::fault::{fault, Outcome};
use super::tip::Meaning;
use super::words::count;

impl Interpreter<'_> {
    /// Work offset of G10 L2 and L20.
    pub(super) fn set_work_offset(&mut self, block: &Block) -> Outcome<()> {
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
    pub(super) fn shift(&mut self, block: &Block, code: u16) -> Outcome<()> {
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
    pub(super) fn reset_shift(&mut self, code: u16) {
        let offsets = &mut self.state.offsets;
        offsets.shift = if code == 923 { offsets.saved_shift } else { [0.0; 9] };
        if code == 921 {
            offsets.saved_shift = [0.0; 9];
        }
        offsets.update();
    }

    /// Tool length and work offset.
    pub(super) fn set_offsets(&mut self, block: &Block) -> Outcome<()> {
        match block.code(Group::ToolLength) {
            Some(code @ (434 | 435)) => return self.program_tip(block, code),
            Some(432) if self.state.meaning != Meaning::Joints => {
                return fault("G43.2 adds to a tool length and G43.4 is in force: cancel it by G49 before");
            }
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
        if block.code(Group::ToolLength).is_some() {
            self.set_meaning(Meaning::Joints, f64::NAN)?;
        }
        self.set_system(block);
        Ok(())
    }

    /// G43.4 and G43.5: words are the tip, so the tool's length is in none of them. It is the one in force, unless H
    /// calls for another.
    fn program_tip(&mut self, block: &Block, code: u16) -> Outcome<()> {
        let meaning = if code == 434 { Meaning::Tip } else { Meaning::Vector };
        let tool = &mut self.state.offsets.tool;
        let length = match (block.has(b'H'), self.state.meaning) {
            (true, _) => f64::NAN,
            (false, Meaning::Joints) if tool[2] != 0.0 => tool[2],
            (false, Meaning::Joints) => f64::NAN,
            (false, _) => self.state.tool_length,
        };
        if let Some(axis) = [0, 1].into_iter().chain(3..9).find(|&axis| tool[axis] != 0.0) {
            return fault(format!(
                "{} works with a tool length in Z and {} has one too: give G43.1 Z alone before",
                g_name(code),
                AXES[axis] as char
            ));
        }
        *tool = [0.0; 9];
        if length.is_nan() && !self.warned_length {
            self.warned_length = true;
            self.warn(format!(
                "the tool length that {} calls for is not known: the machine file's tool_length is taken (G43.1 Z \
                 before it gives one)",
                g_name(code)
            ));
        }
        let machine = self.options.machine_axes.iter().fold(0, |sum, &letter| sum | bit(letter));
        self.set_meaning(meaning, length)?;
        // The joints of a tool direction are axes of the program from here on.
        self.meet(machine)?;
        self.set_system(block);
        Ok(())
    }

    fn set_system(&mut self, block: &Block) {
        match block.code(Group::System) {
            Some(code @ 591..=593) => self.state.offsets.system = usize::from(code - 591) + 6,
            Some(code) => self.state.offsets.system = usize::from(code - 540) / 10,
            None => {}
        }
        self.state.offsets.update();
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
    pub(super) fn go_home(&mut self, block: &Block) -> Outcome<()> {
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
}
