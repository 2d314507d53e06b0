//! The parameters of a program: #1 to #30 of each call, #31 to #5602 and #7001 to #8980 of all calls, and names.
//!
//! Numbers from 5001 on belong to the machine, as in LinuxCNC. Those that hold offsets and home positions are stored here;
//! those that report the machine's position and modes are in `readings`.

use std::cell::Cell;
use std::collections::HashMap;

use super::fault::Outcome;
use super::tolerance::MAX_CALLS;

/// The number of numbered parameters that are local to each call.
pub const LOCALS: usize = 30;

/// The number after that of the last parameter; the last number of LinuxCNC; the first number of the further work offsets.
const NUMBERS: usize = FIRST_FURTHER + SYSTEM_STEP * MOST_FURTHER as usize;
const LAST: usize = 5602;
const FIRST_FURTHER: usize = 7001;

/// The number of further work offsets, G54.1 P1 to P99.
pub const MOST_FURTHER: u32 = 99;

/// The first numbers of stored offsets and positions; each has nine, X to W.
pub const HOME: usize = 5161;
pub const SECOND_HOME: usize = 5181;
pub const SHIFT_IN_FORCE: usize = 5210;
pub const SHIFT: usize = 5211;
pub const SYSTEM: usize = 5220;
const FIRST_SYSTEM: usize = 5221;

/// Numbers from one work offset to the next; the tenth of each is its rotation in degrees.
const SYSTEM_STEP: usize = 20;
pub const ROTATION: usize = 9;

/// The first number of a work offset: 0 to 8 for G54 to G59.3, from 9 on for G54.1 P1 on, with Fanuc's numbers.
pub fn first_of_system(system: usize) -> usize {
    match system.checked_sub(9) {
        None => FIRST_SYSTEM + SYSTEM_STEP * system,
        Some(further) => FIRST_FURTHER + SYSTEM_STEP * further,
    }
}

/// True where a parameter has that number.
pub fn is_number(number: i64) -> bool {
    (1..=LAST as i64).contains(&number) || (FIRST_FURTHER as i64..NUMBERS as i64).contains(&number)
}

/// The numbers that the machine reports and a program cannot set.
pub const READINGS: std::ops::RangeInclusive<usize> = 5400..=5439;

/// The name of a parameter: a number, or a text in lower case without blanks.
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

/// Which parameters are local to a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Numbers and names, as in LinuxCNC; missing arguments are 0.
    Own,
    /// Only names; the numbers are those of the caller, as in Fanuc's subprograms.
    Shared,
    /// Numbers and names, as in Fanuc's macros; missing arguments have no value.
    Macro,
}

/// The parameters of the caller while a call is open.
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
    /// True while lines of a macro are run.
    in_macro: bool,
    /// The first number that was read before it was set; 0 where there is none.
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
    /// The value of a number below `NUMBERS`; 0 where it is not set, as in LinuxCNC.
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

    /// True where a number has a value.
    pub fn is_set(&self, number: usize) -> bool {
        !self.numbers[number].is_nan()
    }

    pub fn in_macro(&self) -> bool {
        self.in_macro
    }

    pub fn set_number(&mut self, number: usize, value: f64) {
        self.numbers[number] = value;
    }

    /// The nine values of an offset or a position from its first number on.
    pub fn row(&self, first: usize) -> [f64; 9] {
        std::array::from_fn(|k| self.number(first + k))
    }

    pub fn set_row(&mut self, first: usize, row: &[f64; 9]) {
        self.numbers[first..first + 9].copy_from_slice(row);
    }

    /// The value of a name; names with `_` in front belong to all calls.
    pub fn named(&self, name: &[u8]) -> Option<f64> {
        let names = if name.starts_with(b"_") { &self.global } else { &self.names };
        names.get(name).copied()
    }

    pub fn set_named(&mut self, name: &[u8], value: f64) {
        let names = if name.starts_with(b"_") { &mut self.global } else { &mut self.names };
        names.insert(name.to_vec(), value);
    }

    pub fn set(&mut self, name: &Name, value: f64) {
        match name {
            Name::Number(number) => self.set_number(*number, value),
            Name::Text(text) => self.set_named(text, value),
        }
    }

    /// The number of open calls.
    pub fn depth(&self) -> usize {
        self.callers.len()
    }

    /// Opens a call with its arguments.
    pub fn enter(&mut self, arguments: &[f64], scope: Scope) -> Outcome<()> {
        if self.callers.len() >= MAX_CALLS {
            return fault!(
                "subroutines call each other more than {MAX_CALLS} deep: end the recursion, or write it as a loop"
            );
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

    /// Sets #1 to #30 to the arguments of a call.
    pub fn take(&mut self, arguments: &[f64]) {
        let missing = if self.in_macro { f64::NAN } else { 0.0 };
        for k in 0..LOCALS {
            self.numbers[1 + k] = arguments.get(k).copied().unwrap_or(missing);
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
        let number = Some(self.unset.get()).filter(|&number| number > 0)?;
        Some(format!("parameter #{number} is used before the program sets it: 0 is taken, as LinuxCNC does"))
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
