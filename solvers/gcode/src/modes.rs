//! Sets modes by their codes, and saves and restores them by M70 to M73.

use super::block::{Block, Group, AXIS_WORDS};
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::modal::State;
use super::moves::{Control, Mode};
use super::tolerance::FARTHEST;

impl Interpreter<'_> {
    /// Plane, units, path control, distance modes and retract mode.
    pub(super) fn set_modes(&mut self, block: &Block) -> Outcome<()> {
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
                            return fault!("word {} is no tolerance: give one from 0", block.word(letter));
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
        if let Some(code) = block.code(Group::Lathe) {
            state.diameters = code == 70;
        }
        if let Some(code) = block.code(Group::Polar) {
            state.polar = code == 160;
        }
        if block.code(Group::Once) == Some(600) && block.words & AXIS_WORDS == 0 {
            state.control = Control::new(Mode::ExactStop);
        }
        if let Some(code) = block.code(Group::Retract) {
            state.retract_to_initial = code == 980;
            state.retract_given = true;
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

    /// M70 to M73.
    pub(super) fn save_modes(&mut self, code: u16) {
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
