//! The parameters of a program: #1 to #30 of each call, #31 to #5602 and #7001 to #8980 of all, and names.
//!
//! Numbers from 5001 on are the machine's: what is stored here holds its offsets and positions, as in LinuxCNC; what
//! the machine only tells (where it is, its modes) is in `readings`.

use std::cell::Cell;
use std::collections::HashMap;

use super::fault::{fault, Outcome};

/// Numbers of one call alone.
pub const LOCALS: usize = 30;

/// Parameters have numbers below this; LinuxCNC's end at `LAST`, those of further work offsets begin at `FIRST_FURTHER`.
const NUMBERS: usize = FIRST_FURTHER + SYSTEM_STEP * MOST_FURTHER as usize;
const LAST: usize = 5602;
const FIRST_FURTHER: usize = 7001;

/// Work offsets G54.1 P1 to P99.
pub const MOST_FURTHER: u32 = 99;

/// Where offsets and positions are stored: each has nine numbers, X to W, from its first on.
pub const HOME: usize = 5161;
pub const SECOND_HOME: usize = 5181;
pub const SHIFT_IN_FORCE: usize = 5210;
pub const SHIFT: usize = 5211;
pub const SYSTEM: usize = 5220;
const FIRST_SYSTEM: usize = 5221;

/// Numbers from one work offset to the next; the tenth of each is its rotation in degrees.
const SYSTEM_STEP: usize = 20;
pub const ROTATION: usize = 9;

/// The first number of a work offset: from 0 G54 to G59.3, from 9 G54.1 P1 on, where Fanuc has it.
pub fn first_of_system(system: usize) -> usize {
    match system.checked_sub(9) {
        None => FIRST_SYSTEM + SYSTEM_STEP * system,
        Some(further) => FIRST_FURTHER + SYSTEM_STEP * further,
    }
}

/// Whether there is a parameter of that number.
pub fn is_number(number: i64) -> bool {
    (1..=LAST as i64).contains(&number) || (FIRST_FURTHER as i64..NUMBERS as i64).contains(&number)
}

/// What the machine tells and a program cannot set.
pub const READINGS: std::ops::RangeInclusive<usize> = 5400..=5439;

/// Calls may be nested so deep.
pub const MAX_CALLS: usize = 100;

/// What `#` names; text is in lower case, without blanks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Name {
    Number(usize),
    Text(Vec<u8>),
}

impl std::fmt::Display for Name {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Name::Number(number) => write!(out, "#{number}"),
            Name::Text(text) => write!(out, "#<{}>", String::from_utf8_lossy(text)),
        }
    }
}

/// What a call has of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Numbers and names, as in LinuxCNC; arguments that are not given are 0.
    Own,
    /// Fanuc's subprograms have the numbers of their caller.
    Shared,
    /// Fanuc's macros have numbers; arguments that are not given have no value.
    Macro,
}

/// What the caller has while a call is open.
#[derive(Clone)]
struct Level {
    numbers: [f64; LOCALS],
    names: HashMap<Vec<u8>, f64>,
    opened: Scope,
    in_macro: bool,
}

/// Values by number and by name; NaN where the program has set none.
pub struct Parameters {
    numbers: Vec<f64>,
    global: HashMap<Vec<u8>, f64>,
    names: HashMap<Vec<u8>, f64>,
    callers: Vec<Level>,
    /// The lines that are run are those of a macro.
    in_macro: bool,
    /// The first number that was read before it was set; 0 for none.
    unset: Cell<usize>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            numbers: vec![f64::NAN; NUMBERS],
            global: HashMap::new(),
            names: HashMap::new(),
            callers: Vec::new(),
            in_macro: false,
            unset: Cell::new(0),
        }
    }
}

impl Parameters {
    /// The value of a number below `NUMBERS`; 0 where none is set, as in LinuxCNC.
    pub fn number(&self, number: usize) -> f64 {
        let value = self.numbers[number];
        if !value.is_nan() {
            return value;
        }
        if number <= 5000 && self.unset.get() == 0 {
            self.unset.set(number);
        }
        0.0
    }

    /// Whether a number has a value.
    pub fn is_set(&self, number: usize) -> bool {
        !self.numbers[number].is_nan()
    }

    pub fn in_macro(&self) -> bool {
        self.in_macro
    }

    pub fn set_number(&mut self, number: usize, value: f64) {
        self.numbers[number] = value;
    }

    /// Nine numbers from one on: an offset or a position, as it stands there.
    pub fn row(&self, first: usize) -> [f64; 9] {
        std::array::from_fn(|k| self.number(first + k))
    }

    pub fn set_row(&mut self, first: usize, row: &[f64; 9]) {
        self.numbers[first..first + 9].copy_from_slice(row);
    }

    /// The value of a name: `_` begins those of all calls.
    pub fn named(&self, name: &[u8]) -> Option<f64> {
        let names = if name.starts_with(b"_") { &self.global } else { &self.names };
        names.get(name).copied()
    }

    pub fn set_named(&mut self, name: &[u8], value: f64) {
        let names = if name.starts_with(b"_") { &mut self.global } else { &mut self.names };
        match names.get_mut(name) {
            Some(place) => *place = value,
            None => {
                names.insert(name.to_vec(), value);
            }
        }
    }

    pub fn set(&mut self, name: &Name, value: f64) {
        match name {
            Name::Number(number) => self.set_number(*number, value),
            Name::Text(text) => self.set_named(text, value),
        }
    }

    /// How many calls are open.
    pub fn depth(&self) -> usize {
        self.callers.len()
    }

    /// Opens a call with its arguments.
    pub fn enter(&mut self, arguments: &[f64], scope: Scope) -> Outcome<()> {
        if self.callers.len() >= MAX_CALLS {
            return fault(format!(
                "subroutines call each other more than {MAX_CALLS} deep: end the recursion, or write it as a loop"
            ));
        }
        let numbers = std::array::from_fn(|k| self.numbers[1 + k]);
        let names = std::mem::take(&mut self.names);
        self.callers.push(Level { numbers, names, opened: scope, in_macro: self.in_macro });
        if scope != Scope::Shared {
            self.in_macro = scope == Scope::Macro;
            self.take(arguments);
        }
        Ok(())
    }

    /// The arguments of a call as its numbers.
    pub fn take(&mut self, arguments: &[f64]) {
        let none = if self.in_macro { f64::NAN } else { 0.0 };
        for k in 0..LOCALS {
            self.numbers[1 + k] = arguments.get(k).copied().unwrap_or(none);
        }
    }

    /// Ends the last call.
    pub fn leave(&mut self) {
        if let Some(level) = self.callers.pop() {
            self.in_macro = level.in_macro;
            if level.opened != Scope::Shared {
                self.numbers[1..=LOCALS].copy_from_slice(&level.numbers);
            }
            self.names = level.names;
        }
    }

    /// A sentence about the first number that was read before it was set.
    pub fn warning(&self) -> Option<String> {
        match self.unset.get() {
            0 => None,
            number => Some(format!(
                "parameter #{number} is used before the program sets it: 0 is taken, as LinuxCNC does"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_call_has_its_own_numbers_and_names() {
        let mut parameters = Parameters::default();
        parameters.set_number(1, 7.0);
        parameters.set_number(31, 8.0);
        parameters.set_named(b"a", 1.0);
        parameters.set_named(b"_a", 2.0);
        parameters.enter(&[5.0], Scope::Own).unwrap();
        assert_eq!((parameters.number(1), parameters.number(2), parameters.number(31)), (5.0, 0.0, 8.0));
        assert_eq!((parameters.named(b"a"), parameters.named(b"_a")), (None, Some(2.0)));
        parameters.set_named(b"a", 3.0);
        parameters.set_number(2, 9.0);
        parameters.leave();
        assert_eq!((parameters.number(1), parameters.named(b"a")), (7.0, Some(1.0)));
        assert_eq!(parameters.warning(), None);
        assert_eq!(parameters.number(2), 0.0);
        assert!(parameters.warning().unwrap().contains("#2"));
    }

    #[test]
    fn a_shared_call_keeps_the_numbers() {
        let mut parameters = Parameters::default();
        parameters.set_number(1, 7.0);
        parameters.enter(&[], Scope::Shared).unwrap();
        parameters.set_number(1, 8.0);
        parameters.leave();
        assert_eq!(parameters.number(1), 8.0);
    }

    #[test]
    fn arguments_of_a_macro_that_are_not_given_have_no_value() {
        let mut parameters = Parameters::default();
        parameters.enter(&[5.0, f64::NAN], Scope::Macro).unwrap();
        assert_eq!((parameters.is_set(1), parameters.is_set(2), parameters.is_set(3)), (true, false, false));
        parameters.enter(&[], Scope::Shared).unwrap();
        assert!(parameters.in_macro() && parameters.is_set(1));
        parameters.leave();
        parameters.leave();
        assert!(!parameters.in_macro());
    }

    #[test]
    fn calls_are_bounded() {
        let mut parameters = Parameters::default();
        for _ in 0..MAX_CALLS {
            parameters.enter(&[], Scope::Own).unwrap();
        }
        assert!(parameters.enter(&[], Scope::Own).unwrap_err().message.contains("100 deep"));
    }
}
