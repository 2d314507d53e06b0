//! Sets modes by their codes, and saves and restores them by M70 to M73.

use super::block::{Block, Group, AXIS_WORDS};
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::modal::State;
use super::moves::{Control, Mode};
use super::tolerance::FARTHEST;

impl Interpreter<'_> {
    /// Plane, units, path control, distance modes and retract mode.
    pub fn set_modes(&mut self, block: &Block) -> Outcome<()> {
        let state = &mut self.state;
        if let Some(code) = block.code(Group::Plane) {
            state.normal = usize::from((190 - code) / 10);
        }
        let switches = [
            (Group::Units, 200, &mut state.inches),
            (Group::Distance, 900, &mut state.absolute),
            (Group::ArcDistance, 901, &mut state.absolute_centres),
            (Group::Lathe, 70, &mut state.diameters),
            (Group::Polar, 160, &mut state.polar),
            (Group::Retract, 980, &mut state.retract_to_initial),
        ];
        for (group, on, switch) in switches {
            *switch = block.code(group).map_or(*switch, |code| code == on);
        }
        state.units_given |= block.code(Group::Units).is_some();
        state.retract_given |= block.code(Group::Retract).is_some();
        match block.code(Group::Control) {
            Some(610) => state.control = Control::new(Mode::ExactPath),
            Some(611) => state.control = Control::new(Mode::ExactStop),
            Some(640) => {
                let mut control = Control::new(Mode::Tolerance);
                for (letter, place) in [(b'P', &mut control.blend), (b'Q', &mut control.fit)] {
                    if let Some(value) = block.get(letter) {
                        if !(0.0..=FARTHEST).contains(&value) {
                            return fault!("word {} is no tolerance: give one from 0", block.word(letter));
                        }
                        *place = value * state.unit();
                    }
                }
                state.control = control;
            }
            _ => {}
        }
        if block.code(Group::Once) == Some(600) && block.words & AXIS_WORDS == 0 {
            state.control = Control::new(Mode::ExactStop);
        }
        Ok(())
    }

    /// Ends a call: removes its parameters and restores the modes that M73 saved in it.
    pub fn leave_call(&mut self) {
        let depth = self.parameters.depth();
        if self.saved.last().is_some_and(|(at, restores, _)| *at == depth && *restores) {
            self.restore_modes();
        }
        self.saved.retain(|(at, ..)| *at < depth);
        self.parameters.leave();
    }

    /// Executes M70 to M73: saves modes, deletes saved ones or restores them.
    pub fn save_modes(&mut self, code: u16) {
        let depth = self.parameters.depth();
        match code {
            72 => self.restore_modes(),
            71 => self.saved.retain(|(at, ..)| *at != depth),
            _ => {
                self.saved.retain(|(at, ..)| *at != depth);
                self.saved.push((depth, code == 73, self.state.clone()));
            }
        }
    }

    /// Restores the modes that were saved last in this call, except offsets, motion code and coordinate mode.
    fn restore_modes(&mut self) {
        let depth = self.parameters.depth();
        let Some((_, _, saved)) = self.saved.last().filter(|(at, ..)| *at == depth) else { return };
        let now = &self.state;
        let state = State {
            offsets: now.offsets.clone(),
            motion: now.motion,
            sticky: now.sticky,
            coordinate_mode: now.coordinate_mode,
            tool_length: now.tool_length,
            entry: now.entry,
            ..saved.clone()
        };
        let system = saved.offsets.system;
        self.state = state;
        if system != self.state.offsets.system {
            self.select_system(system);
        }
    }
}
