//! The parameters that report the machine's position, tool and modes; and the assignment of parameters.

use super::block::{rotary, AXES};
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::modal::{FeedMode, State};
use super::parameters::{Name, READINGS};

/// The numbers of the tool in the spindle, its offset, its diameter, and the position.
const TOOL: usize = 5400;
const TOOL_OFFSET: std::ops::RangeInclusive<usize> = 5401..=5409;
const TOOL_DIAMETER: usize = 5410;
const POSITION: std::ops::RangeInclusive<usize> = 5420..=5428;

/// Fanuc's number that raises an alarm, and the numbers that report the state of its control.
const ALARM: usize = 3000;
const CONTROL: std::ops::Range<usize> = 1000..5161;

impl Interpreter<'_> {
    /// The value of a number; 0 where it has none, as in LinuxCNC. A number whose value only a certain control knows is a fault.
    pub fn parameter(&self, number: usize) -> Outcome<f64> {
        if !READINGS.contains(&number) {
            self.check_known(number)?;
            return Ok(self.parameters.number(number));
        }
        Ok(match number {
            TOOL => self.tool_number(),
            TOOL_DIAMETER => self.tool.map_or(0.0, |tool| tool.diameter),
            _ if TOOL_OFFSET.contains(&number) => self.state.offsets.tool[number - TOOL_OFFSET.start()],
            _ if POSITION.contains(&number) => self.reading_of_axis(number - POSITION.start()),
            _ => 0.0,
        })
    }

    /// True where a number has a value.
    pub fn has_value(&self, number: usize) -> Outcome<bool> {
        self.check_known(number)?;
        Ok(READINGS.contains(&number) || self.parameters.is_set(number))
    }

    /// The value of a name; None where there is no such name.
    pub fn named(&self, name: &[u8]) -> Outcome<Option<f64>> {
        if let Some(value) = self.parameters.named(name) {
            return Ok(Some(value));
        }
        if name.starts_with(b"_ini[") || name.starts_with(b"_hal[") {
            return fault!(
                "#<{}> is a value of one machine's configuration, which is not known here: set a parameter instead",
                String::from_utf8_lossy(name)
            );
        }
        Ok(name.strip_prefix(b"_").and_then(|name| self.reading(name)))
    }

    /// Refuses a number by which a macro reads the state of its control, unless the program has set it.
    #[inline(always)]
    fn check_known(&self, number: usize) -> Outcome<()> {
        if self.parameters.in_macro() && CONTROL.contains(&number) && !self.parameters.is_set(number) {
            return fault!(
                "#{number} is a value of one control, which is not known here: set it before, or post the moves"
            );
        }
        Ok(())
    }

    /// The coordinate of the program along an axis, in its units.
    fn reading_of_axis(&self, axis: usize) -> f64 {
        self.in_program_units(axis, self.state.offsets.to_program(&self.position())[axis])
    }

    /// A length in mm, or an angle in degrees, in the units of the program.
    fn in_program_units(&self, axis: usize, value: f64) -> f64 {
        if rotary(axis) {
            value
        } else {
            value / self.state.unit()
        }
    }

    /// The value of a name that the machine reports, without its `_`.
    fn reading(&self, name: &[u8]) -> Option<f64> {
        if let Some(value) = self.reading_of_position(name) {
            return Some(value);
        }
        let state = &self.state;
        let is = |held: bool| f64::from(held);
        Some(match name {
            b"vmajor" => 2.9,
            b"vminor" => 0.0,
            b"line" => f64::from(self.line),
            b"motion_mode" => f64::from(state.motion),
            b"plane" => [190.0, 180.0, 170.0][state.normal],
            b"ccomp" => f64::from(self.compensation_code()),
            b"metric" => is(!state.inches),
            b"imperial" => is(state.inches),
            b"absolute" => is(state.absolute),
            b"incremental" => is(!state.absolute),
            b"inverse_time" => is(state.feed_mode == FeedMode::Inverse),
            b"units_per_minute" => is(state.feed_mode == FeedMode::PerMinute),
            b"units_per_rev" => is(state.feed_mode == FeedMode::PerTurn),
            b"coord_system" => system_code(state),
            b"tool_offset" => is(state.offsets.tool.iter().any(|value| *value != 0.0)),
            b"retract_r_plane" => is(!state.retract_to_initial),
            b"retract_old_z" => is(state.retract_to_initial),
            b"spindle_rpm_mode" => is(!state.constant_surface_speed),
            b"spindle_css_mode" => is(state.constant_surface_speed),
            b"ijk_absolute_mode" => is(state.absolute_centres),
            b"lathe_diameter_mode" => is(state.diameters),
            b"lathe_radius_mode" => is(!state.diameters),
            b"spindle_on" => is(state.spindle_on),
            b"spindle_cw" => is(state.spindle_on && !state.spindle_back),
            b"mist" => is(state.mist),
            b"flood" => is(state.flood),
            b"speed_override" | b"feed_override" => 1.0,
            b"adaptive_feed" | b"feed_hold" | b"remap_level" | b"task" => 0.0,
            b"feed" => self.feed_word(),
            b"rpm" => state.spindle_speed.unwrap_or(0.0),
            b"current_tool" => self.tool_number(),
            b"current_pocket" => self.tool.map_or(0.0, |tool| f64::from(tool.pocket)),
            b"selected_tool" => f64::from(self.selected.unwrap_or(0)),
            b"selected_pocket" => self
                .selected
                .and_then(|number| self.tool_of(number))
                .map_or(-1.0, |tool| f64::from(tool.pocket)),
            b"value" | b"value_returned" => 0.0,
            b"call_level" => self.parameters.depth() as f64,
            _ => return None,
        })
    }

    /// The value of `_x` to `_w`, and of `_abs_x` to `_abs_w`.
    fn reading_of_position(&self, name: &[u8]) -> Option<f64> {
        let (absolute, letter) = match name {
            [letter] => (false, letter),
            [b'a', b'b', b's', b'_', letter] => (true, letter),
            _ => return None,
        };
        let axis = AXES.iter().position(|known| known.eq_ignore_ascii_case(letter))?;
        Some(match absolute {
            true => self.in_program_units(axis, self.position()[axis]),
            false => self.reading_of_axis(axis),
        })
    }

    /// Sets the parameters that a block assigns.
    pub fn assign(&mut self, assigned: &mut Vec<(Name, f64)>) -> Outcome<()> {
        for (name, value) in assigned.drain(..) {
            if name == Name::Number(ALARM) && self.parameters.in_macro() {
                return fault!("the macro raises the alarm {value}: check the arguments of its G65");
            }
            self.parameters.set(&name, value);
        }
        Ok(())
    }
}

/// The code of the work offset in force, in tenths.
fn system_code(state: &State) -> f64 {
    match state.offsets.system {
        system @ 0..=5 => 540.0 + 10.0 * system as f64,
        system @ 6..=8 => 585.0 + system as f64,
        _ => 541.0,
    }
}
