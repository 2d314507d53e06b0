//! Sets the program's zero, by work offsets, G52, G92 and tool lengths; and moves home.

use super::block::{bits, g_name, Block, Group, AXES, AXIS_WORDS};
use super::coordinates::{CoordinateMode, Point};
use super::fault::Outcome;
use super::interpreter::{Interpreter, Topic};
use super::modal::turn;
use super::options::Tool;
use super::parameters::{
    first_of_system, HOME, MOST_FURTHER, ROTATION, SECOND_HOME, SHIFT, SHIFT_IN_FORCE, SYSTEM,
};

impl Interpreter<'_> {
    /// G10: L1, L10 and L11 set a tool of the table, L2 and L20 a work offset.
    pub fn set_data(&mut self, block: &Block) -> Outcome<()> {
        match block.get(b'L') {
            Some(level) if [1.0, 10.0, 11.0].contains(&level) => self.set_tool_data(block, level),
            Some(level) if [2.0, 20.0].contains(&level) => self.set_work_offset(block, level == 20.0),
            Some(_) => fault!(
                "G10 {} is not read: G10 sets work offsets by L2 and L20 and tools by L1, L10 and L11",
                block.word(b'L')
            ),
            None => fault!(
                "G10 does not say what it sets: give L2 or L20 for work offsets, L1, L10 or L11 for tools",
            ),
        }
    }

    fn set_work_offset(&mut self, block: &Block, from_here: bool) -> Outcome<()> {
        let system = match block.count(b'P', 0, "work offset")? {
            Some(0) => self.state.offsets.system,
            Some(number @ 1..=9) => number as usize - 1,
            _ => return fault!("G10 needs P0 to P9: P0 is the offset in force, P1 is G54, P9 is G59.3"),
        };
        let first = first_of_system(system);
        let mut work = self.parameters.row(first);
        let rotation = block.get(b'R').unwrap_or_else(|| self.parameters.number(first + ROTATION));
        // The coordinates of this position if the work offset were 0.
        let (position, tool) = (self.position(), self.state.offsets.tool);
        let reading: Point = std::array::from_fn(|axis| position[axis] - tool[axis]);
        let shift = self.state.offsets.shift;
        let mut wanted = shift;
        let mut named = [false; 9];
        self.axis_values(block, |axis, value| {
            named[axis] = true;
            wanted[axis] += value;
            if !from_here {
                work[axis] = value;
            }
        })?;
        if from_here {
            if rotation != 0.0 && named[0] != named[1] {
                // The axis that is not named keeps its coordinate.
                let mut offsets = self.state.offsets.clone();
                (offsets.work, offsets.rotation) = (work, rotation);
                let now = offsets.to_program(&self.position());
                for axis in [0, 1] {
                    if !named[axis] {
                        wanted[axis] = now[axis] + shift[axis];
                        named[axis] = true;
                    }
                }
            }
            turn(&mut wanted, rotation);
            for axis in (0..9).filter(|&axis| named[axis]) {
                work[axis] = reading[axis] - wanted[axis];
            }
        }
        self.parameters.set_row(first, &work);
        self.parameters.set_number(first + ROTATION, rotation);
        if system == self.state.offsets.system {
            self.select_system(system);
        }
        Ok(())
    }

    fn set_tool_data(&mut self, block: &Block, level: f64) -> Outcome<()> {
        let Some(number) = block.count(b'P', 1, "tool number")? else {
            return fault!("G10 sets no tool: give its number as P");
        };
        let mut tool = self.tool_of(number).unwrap_or(Tool {
            number,
            pocket: number,
            offset: [0.0; 9],
            diameter: 0.0,
            orientation: 0,
        });
        let position = self.position();
        // L10: this position has the coordinates of the words, with the offsets in force. L11: with G59.3 and no shift.
        let zero = if level == 10.0 {
            let offsets = &self.state.offsets;
            std::array::from_fn(|k| offsets.sum()[k] - offsets.tool[k])
        } else {
            self.parameters.row(first_of_system(8))
        };
        self.axis_values(block, |axis, value| {
            tool.offset[axis] = if level == 1.0 { value } else { position[axis] - zero[axis] - value };
        })?;
        if let Some(radius) = block.get(b'R') {
            tool.diameter = 2.0 * radius * self.state.unit();
        }
        if let Some(orientation) = block.count(b'Q', 0, "orientation of a tool")? {
            tool.orientation = orientation;
        }
        let tools = self.tools.get_or_insert_with(Vec::new);
        match tools.iter_mut().find(|known| known.number == number) {
            Some(place) => *place = tool,
            None => tools.push(tool),
        }
        if self.loaded == Some(number) {
            self.tool = Some(tool);
        }
        Ok(())
    }

    /// G52 sets the shift; G92 sets it so that the axes named have the values given. Both use the same offset.
    pub fn shift(&mut self, block: &Block, code: u16) -> Outcome<()> {
        let reading = self.state.offsets.to_program(&self.position());
        let mut shift = self.state.offsets.shift;
        self.axis_values(block, |axis, value| {
            shift[axis] = if code == 520 { value } else { shift[axis] + reading[axis] - value };
        })?;
        self.state.offsets.shift = shift;
        self.parameters.set_number(SHIFT_IN_FORCE, 1.0);
        self.parameters.set_row(SHIFT, &shift);
        self.state.offsets.update();
        Ok(())
    }

    /// G92.1 deletes the shift, G92.2 suspends it, G92.3 restores it.
    pub fn reset_shift(&mut self, code: u16) {
        self.state.offsets.shift = if code == 923 { self.parameters.row(SHIFT) } else { [0.0; 9] };
        self.parameters.set_number(SHIFT_IN_FORCE, f64::from(code == 923));
        if code == 921 {
            self.parameters.set_row(SHIFT, &[0.0; 9]);
        }
        self.state.offsets.update();
    }

    /// Selects a work offset, 0 for G54, with the values in its parameters.
    pub fn select_system(&mut self, system: usize) {
        let first = first_of_system(system);
        self.end_turn();
        let offsets = &mut self.state.offsets;
        offsets.system = system;
        self.parameters.set_number(SYSTEM, system as f64 + 1.0);
        offsets.work = self.parameters.row(first);
        offsets.rotation = self.parameters.number(first + ROTATION);
        offsets.update();
    }

    /// Sets tool length and work offset.
    pub fn set_offsets(&mut self, block: &Block) -> Outcome<()> {
        match block.code(Group::ToolLength) {
            Some(code @ (434 | 435)) => return self.program_tip(block, code),
            Some(432) if self.state.coordinate_mode != CoordinateMode::Joints => {
                return fault!("G43.2 adds to a tool length and G43.4 is in force: cancel it by G49 before");
            }
            Some(code @ (430 | 432)) if block.words & AXIS_WORDS == 0 || code == 430 => {
                if code == 432 && !block.has(b'H') {
                    return fault!("G43.2 adds nothing: give it H or axis words");
                }
                let length = self.length_of_tool(block)?;
                for axis in 0..9 {
                    let before = if code == 432 { self.state.offsets.tool[axis] } else { 0.0 };
                    self.state.offsets.tool[axis] = before + length[axis];
                }
            }
            Some(code @ (431 | 432)) => {
                if block.has(b'H') {
                    return fault!("{} has both H and axis words: give one of them", g_name(code));
                }
                if block.words & AXIS_WORDS == 0 {
                    return fault!("G43.1 sets nothing: give it axis words");
                }
                let mut tool = self.state.offsets.tool;
                self.axis_values(block, |axis, value| {
                    tool[axis] = value + if code == 432 { tool[axis] } else { 0.0 }
                })?;
                self.state.offsets.tool = tool;
            }
            Some(490) => self.state.offsets.tool = [0.0; 9],
            _ => {}
        }
        if block.code(Group::ToolLength).is_some() {
            self.set_coordinate_mode(CoordinateMode::Joints, f64::NAN)?;
        }
        self.set_system(block)
    }

    /// G43.4 and G43.5: from now on axis words give the position of the tip, without the tool length. The length is the one in
    /// force, or that of the tool which H names.
    fn program_tip(&mut self, block: &Block, code: u16) -> Outcome<()> {
        let mode = if code == 434 { CoordinateMode::Tip } else { CoordinateMode::Vector };
        let named = block.has(b'H');
        let in_table = named && self.tools.is_some();
        let tool = if in_table { self.length_of_tool(block)? } else { self.state.offsets.tool };
        let length = match self.state.coordinate_mode {
            _ if in_table => tool[2],
            _ if named => f64::NAN,
            CoordinateMode::Joints if tool[2] != 0.0 => tool[2],
            CoordinateMode::Joints => f64::NAN,
            _ => self.state.tool_length,
        };
        if let Some(axis) = [0, 1].into_iter().chain(3..9).find(|&axis| tool[axis] != 0.0) {
            return fault!(
                "{} works with a tool length in Z and {} has one too: give G43.1 Z alone before",
                g_name(code),
                AXES[axis] as char
            );
        }
        self.state.offsets.tool = [0.0; 9];
        if length.is_nan() {
            self.warn_once(Topic::NoToolLength, || {
                format!(
                    "the tool length that {} calls for is not known: the machine file's tool_length is taken (G43.1 Z \
                     before it gives one)",
                    g_name(code)
                )
            });
        }
        self.set_coordinate_mode(mode, length)?;
        // From here on all joints are axes of the program: a tool direction may move any of them.
        self.add_axes(bits(&self.options.machine_axes))?;
        self.set_system(block)
    }

    fn set_system(&mut self, block: &Block) -> Outcome<()> {
        let wanted = match block.code(Group::System) {
            Some(code @ (541 | 1540)) => match block.count(b'P', 1, "further work offset")? {
                Some(number) if number <= MOST_FURTHER => Some(number as usize + 8),
                _ => {
                    return fault!(
                        "{} does not name its work offset: give P1 to P{MOST_FURTHER}",
                        g_name(code)
                    )
                }
            },
            Some(code @ 591..=593) => Some(usize::from(code - 591) + 6),
            Some(code) => Some(usize::from(code - 540) / 10),
            None => None,
        };
        match wanted.filter(|system| *system != self.state.offsets.system) {
            Some(system) => self.select_system(system),
            None => self.state.offsets.update(),
        }
        Ok(())
    }

    /// The offset of the tool that H names, or of the tool in the spindle; 0 where no table has it.
    fn length_of_tool(&mut self, block: &Block) -> Outcome<Point> {
        let number = block.count(b'H', 0, "tool number")?;
        let tool = match number {
            Some(0) => None,
            Some(number) => self.needed_tool(number)?,
            None => self.tool,
        };
        if self.tools.is_none() && number != Some(0) {
            self.warn_once(Topic::NoToolTable, || {
                "the tool lengths that G43 calls for are not known: 0 is taken for each (a tool table, or G43.1 Z, \
                 gives them)"
                    .into()
            });
        }
        Ok(tool.map_or([0.0; 9], |tool| tool.offset))
    }

    /// G28 and G30: a rapid to the axis words, then a rapid of the named axes, or of all axes if none is named, to the home
    /// position. G28.1 and G30.1 set the home position to the current position. G28.2 to G28.4 home the axes and set nothing.
    pub fn go_home(&mut self, block: &Block, code: u16) -> Outcome<()> {
        let first = if code < 300 { HOME } else { SECOND_HOME };
        if matches!(code, 281 | 301) {
            let position = self.position();
            self.parameters.set_row(first, &position);
            return Ok(());
        }
        let via = if matches!(code, 280 | 300) { self.target(block, false)? } else { self.position() };
        self.rapid(&via)?;
        let mut target = via;
        let home = self.parameters.row(first);
        if block.words & AXIS_WORDS != 0 {
            self.axis_values(block, |axis, _| target[axis] = home[axis])?;
        } else {
            self.add_axes(bits(&self.options.machine_axes))?;
            for &axis in self.moves.axes() {
                target[axis] = home[axis];
            }
        }
        self.check_reach(&target)?;
        self.rapid(&target)
    }
}
