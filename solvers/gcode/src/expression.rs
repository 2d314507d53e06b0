//! The arithmetic of RS-274/NGC: `[1 + acos[0] - [#3 ** [4.0/2]]]`, parameters and their assignment.
//!
//! Operators from the one that binds least: AND OR XOR; EQ NE GT GE LT LE; + -; * / MOD; **. Operators of equal precedence are
//! applied from left to right, including powers.

use super::arithmetic::{finite, function_at, operator_at, Function};
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::number::{behind_word, decimal, integer, spaces};
use super::parameters::{is_number, Name, READINGS};
use super::tolerance::MAX_DEPTH;

/// Reads `#1 = value` from its `#` on: the parameter, its value (NaN for `#1 = #0`), and the place after it.
///
/// The value may be a sum without brackets, as Fanuc writes it.
pub fn assignment(source: &[u8], at: usize, values: &Interpreter) -> Outcome<(Name, f64, usize)> {
    let mut formula = Formula { source, at, values, depth: 0 };
    let name = formula.name()?;
    if formula.peek() != b'=' {
        return foreign!("{name} stands alone: write {name} = value, or a letter before it");
    }
    formula.at += 1;
    let value = if formula.nothing() { f64::NAN } else { formula.chain(1)? };
    if matches!(name, Name::Number(number) if READINGS.contains(&number)) {
        return fault!("{name} is reported by the machine and cannot be set: use another parameter");
    }
    Ok((name, value, formula.at))
}

/// The value at `at` that is not a plain number (brackets, a parameter or a function, with or without a sign), and the
/// place after it. None where none of these begins; NaN for a parameter without value in a macro.
pub fn expression(source: &[u8], at: usize, values: &Interpreter) -> Outcome<Option<(f64, usize)>> {
    let mut formula = Formula { source, at, values, depth: 0 };
    let after_sign = match formula.peek() {
        b'+' | b'-' => spaces(source, formula.at + 1),
        _ => formula.at,
    };
    let starts = match source.get(after_sign) {
        Some(b'[' | b'#') => true,
        Some(letter) if letter.is_ascii_alphabetic() => function_at(source, after_sign).is_some(),
        _ => false,
    };
    if !starts {
        return Ok(None);
    }
    if values.parameters.in_macro() && formula.peek() == b'#' {
        let start = formula.at;
        let has_value = !formula.nothing()
            && match formula.name()? {
                Name::Number(number) => values.has_value(number)?,
                Name::Text(_) => true,
            };
        if !has_value {
            return Ok(Some((f64::NAN, formula.at)));
        }
        formula.at = start;
    }
    let value = formula.value()?;
    Ok(Some((value, formula.at)))
}

/// The number at `at`, plain or computed, and the place after it; None where there is none, or where it has no value.
#[cold]
pub fn number(source: &[u8], at: usize, values: &Interpreter) -> Outcome<Option<(f64, usize)>> {
    let found = match decimal(source, at) {
        None => expression(source, at, values)?,
        plain => plain,
    };
    Ok(found.filter(|(value, _)| !value.is_nan()))
}

/// The value of the bracket at `at`, and the place after it; None where no bracket begins there.
pub fn bracket(source: &[u8], at: usize, values: &Interpreter) -> Outcome<Option<(f64, usize)>> {
    let mut formula = Formula { source, at, values, depth: 0 };
    if formula.peek() != b'[' {
        return Ok(None);
    }
    let value = formula.bracket()?;
    Ok(Some((value, formula.at)))
}

/// The name from `<` at `at` to `>`, in lower case and without blanks, and the place after it.
pub fn name_in_brackets(source: &[u8], at: usize) -> Outcome<(Vec<u8>, usize)> {
    let first = at + 1;
    let end = (first..source.len()).find(|&at| matches!(source[at], b'>' | b'\n' | b'\r'));
    let Some(end) = end.filter(|&end| source[end] == b'>') else {
        return foreign!("the name {} has no closing >", excerpt(source, at));
    };
    let letters = source[first..end].iter().filter(|byte| !matches!(byte, b' ' | b'\t'));
    Ok((letters.map(u8::to_ascii_lowercase).collect(), end + 1))
}

struct Formula<'a> {
    source: &'a [u8],
    at: usize,
    values: &'a Interpreter<'a>,
    depth: usize,
}

impl Formula<'_> {
    /// The next byte that is not blank; a line end at the end of the text.
    fn peek(&mut self) -> u8 {
        self.at = spaces(self.source, self.at);
        self.source.get(self.at).copied().unwrap_or(b'\n')
    }

    fn value(&mut self) -> Outcome<f64> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return fault!(
                "brackets and parameters are nested more than {MAX_DEPTH} deep: write the formula in steps"
            );
        }
        let value = match self.peek() {
            b'[' => self.bracket()?,
            b'#' => {
                let name = self.name()?;
                match self.beside_nothing(&name)? {
                    Some(truth) => truth,
                    None => self.look_up(&name)?,
                }
            }
            letter if letter.is_ascii_alphabetic() => self.function()?,
            sign => match (decimal(self.source, self.at), sign) {
                (Some((number, end)), _) => {
                    self.at = end;
                    number
                }
                (None, b'+') => {
                    self.at += 1;
                    self.value()?
                }
                (None, b'-') => {
                    self.at += 1;
                    -self.value()?
                }
                _ => return foreign!("a number is missing before {}", self.rest()),
            },
        };
        self.depth -= 1;
        Ok(value)
    }

    fn look_up(&self, name: &Name) -> Outcome<f64> {
        let text = match name {
            Name::Number(number) => return self.values.parameter(*number),
            Name::Text(text) => text,
        };
        match self.values.named(text)? {
            Some(value) => Ok(value),
            None => fault!(
                "parameter {name} is used and the program has not set it: set it before, such as {name} = 1"
            ),
        }
    }

    /// From `[` to its `]`.
    fn bracket(&mut self) -> Outcome<f64> {
        if self.peek() != b'[' {
            return foreign!("a bracket [ is missing before {}", self.rest());
        }
        self.at += 1;
        let value = self.chain(1)?;
        if self.peek() != b']' {
            return foreign!("an operator or a bracket ] is missing before {}", self.rest());
        }
        self.at += 1;
        Ok(value)
    }

    /// Values joined by operators that bind at least as tightly as `least`.
    fn chain(&mut self, least: u8) -> Outcome<f64> {
        let mut left = self.value()?;
        loop {
            self.peek();
            match operator_at(self.source, self.at).filter(|operator| operator.binding >= least) {
                Some(operator) => {
                    self.at += operator.name.len();
                    let right = self.chain(operator.binding + 1)?;
                    left = operator.apply(left, right)?;
                }
                None => return Ok(left),
            }
        }
    }

    fn function(&mut self) -> Outcome<f64> {
        let Some((function, name, bracket)) = function_at(self.source, self.at) else {
            return foreign!("{} is neither a number nor a function", self.rest());
        };
        self.at = bracket;
        match function {
            Function::Exists => self.exists(),
            Function::Of(function) => {
                let x = self.bracket()?;
                finite(function(x), || format!("{name}[{x}]"))
            }
            Function::Atan => {
                let y = self.bracket()?;
                if self.peek() != b'/' {
                    return foreign!("ATAN takes two brackets: write ATAN[y]/[x]");
                }
                self.at += 1;
                Ok(y.atan2(self.bracket()?).to_degrees())
            }
        }
    }

    /// `EXISTS[#<name>]`.
    fn exists(&mut self) -> Outcome<f64> {
        self.at += 1;
        if self.peek() != b'#' {
            return foreign!("EXISTS takes a parameter: write EXISTS[#<name>]");
        }
        let name = self.name()?;
        if self.peek() != b']' {
            return foreign!("EXISTS takes one parameter: write EXISTS[#<name>]");
        }
        self.at += 1;
        Ok(match name {
            Name::Number(_) => 1.0,
            Name::Text(text) => f64::from(self.values.named(&text)?.is_some()),
        })
    }

    /// The result of `EQ #0` or `NE #0` after a parameter, where #0 stands for a parameter without value; None where another text
    /// follows.
    fn beside_nothing(&mut self, name: &Name) -> Outcome<Option<f64>> {
        let Name::Number(number) = name else { return Ok(None) };
        self.peek();
        let start = self.at;
        let equal = behind_word(self.source, start, "EQ");
        if let Some(end) = equal.or_else(|| behind_word(self.source, start, "NE")) {
            self.at = end;
            if self.nothing() {
                return Ok(Some(f64::from(self.values.has_value(*number)? == equal.is_none())));
            }
        }
        self.at = start;
        Ok(None)
    }

    /// Skips `#0` if it comes next; returns whether it did.
    fn nothing(&mut self) -> bool {
        if self.peek() == b'#' {
            if let Some((0.0, end)) = decimal(self.source, self.at + 1) {
                self.at = end;
                return true;
            }
        }
        false
    }

    /// `#5`, `##2`, `#[1 + 2]` or `#<name>`, from the `#` on.
    fn name(&mut self) -> Outcome<Name> {
        self.peek();
        self.at += 1;
        if self.peek() == b'<' {
            let (text, end) = name_in_brackets(self.source, self.at)?;
            self.at = end;
            return Ok(Name::Text(text));
        }
        let number = self.value()?;
        match integer(number) {
            Some(index) if is_number(index) => Ok(Name::Number(index as usize)),
            _ => fault!("#{number} is no parameter: parameters are #1 to #5602, #7001 to #8980 or #<name>"),
        }
    }

    /// The start of the rest of the line, for a message.
    fn rest(&self) -> String {
        excerpt(self.source, self.at)
    }
}

/// The text from `at` to the end of the line in quotes, at most 24 printable characters of it; if its first character that is not
/// a blank is a control character, the number of that character.
pub fn excerpt(source: &[u8], at: usize) -> String {
    let rest = source.get(at..).unwrap_or_default();
    let line = rest.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default();
    let text = String::from_utf8_lossy(&line[..line.len().min(96)]);
    let text: String = text.trim_end().chars().filter(|letter| !letter.is_control()).take(24).collect();
    match line.iter().find(|byte| !matches!(byte, b' ' | b'\t')) {
        Some(byte) if byte.is_ascii_control() => format!("the control character 0x{byte:02X}"),
        _ if text.is_empty() => "the end of the line".into(),
        _ => format!("'{text}'"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::options::Options;

    fn value(text: &str) -> Result<f64, String> {
        value_with(&Interpreter::new(&Options::default(), 0), text)
    }

    fn value_with(values: &Interpreter, text: &str) -> Result<f64, String> {
        match expression(text.as_bytes(), 0, values) {
            Ok(Some((value, end))) if end == text.len() => Ok(value),
            Ok(found) => Err(format!("{found:?}")),
            Err(fault) => Err(fault.message),
        }
    }

    #[test]
    fn operators_bind_as_the_standard_says() {
        for (text, expected) in [
            ("[150 * 60]", 9000.0),
            ("[2.0 / 3 * 1.5 - 5.5 / 11.0]", 0.5),
            ("[1 + 2 * 3]", 7.0),
            ("[2 ** 3 ** 2]", 64.0),
            ("[2 * 3 ** 2]", 18.0),
            ("[7 mod 4]", 3.0),
            ("[-7 MOD 4]", 1.0),
            ("[1 + 1 EQ 2 AND 3 GT 2]", 1.0),
            ("[1 XOR 1]", 0.0),
            ("[0 OR 2]", 1.0),
            ("[1 LE 0.9999999]", 1.0),
            ("[3 - -2]", 5.0),
            ("-[1 + 2]", -3.0),
            ("[[1 + 2] * [3 + 4]]", 21.0),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn functions_work_in_degrees() {
        for (text, expected) in [
            ("[1 + acos[0] - [2 ** [4.0/2]]]", 87.0),
            ("sin[30]", 0.5),
            ("COS [60]", 0.5),
            ("tan[45]", 1.0),
            ("atan[1]/[-1]", 135.0),
            ("asin[1]", 90.0),
            ("fix[-2.8]", -3.0),
            ("fup[2.2]", 3.0),
            ("round[2.5]", 3.0),
            ("abs[-4]", 4.0),
            ("sqrt[16]", 4.0),
            ("ln[exp[2]]", 2.0),
        ] {
            let found = value(text).unwrap();
            assert!((found - expected).abs() < 1e-12, "{text} = {found}");
        }
    }

    #[test]
    fn parameters_have_numbers_and_names() {
        let options = Options::default();
        let mut values = Interpreter::new(&options, 0);
        for text in ["#1=2.5", "#<Tool Width> = [#1 * 2]", "#2=#1", "#3=2"] {
            let (name, value, end) = assignment(text.as_bytes(), 0, &values).unwrap();
            assert_eq!(end, text.len());
            values.parameters.set(&name, value);
        }
        assert_eq!(value_with(&values, "#<toolwidth>"), Ok(5.0));
        assert_eq!(value_with(&values, "##3"), Ok(2.5));
        assert_eq!(value_with(&values, "#[1 + 1]"), Ok(2.5));
        assert_eq!(value_with(&values, "exists[#<toolwidth>]"), Ok(1.0));
        assert_eq!(value_with(&values, "exists[#<other>]"), Ok(0.0));
        assert_eq!(value_with(&values, "#7"), Ok(0.0));
    }

    #[test]
    fn parameters_without_value_are_nothing() {
        let options = Options::default();
        let mut values = Interpreter::new(&options, 0);
        for text in ["#1=0", "#2=#1+2*3", "#3=4", "#3=#0"] {
            let (name, value, end) = assignment(text.as_bytes(), 0, &values).unwrap();
            assert_eq!(end, text.len());
            values.parameters.set(&name, value);
        }
        for (text, expected) in [
            ("[#1 EQ #0]", 0.0),
            ("[#1NE#0]", 1.0),
            ("[#3 eq #0]", 1.0),
            ("[#9 NE #0 OR #2 EQ 6]", 1.0),
            ("[#1 EQ #4]", 1.0),
        ] {
            assert_eq!(value_with(&values, text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn what_has_no_value_says_why() {
        for (text, word) in [
            ("#<depth>", "#<depth>"),
            ("[1 / 0]", "1 / 0 has no finite value"),
            ("[1 mod 0]", "1 MOD 0 has"),
            ("sqrt[-1]", "SQRT[-1]"),
            ("ln[0]", "LN[0]"),
            ("acos[1.5]", "ACOS[1.5]"),
            ("[[0 - 8] ** 0.5]", "-8 ** 0.5"),
            ("[10 ** 400]", "finite"),
            ("[1 + ]", "missing"),
            ("[1 2]", "missing"),
            ("[1 + 2", "missing"),
            ("[sine[3]]", "sine[3]"),
            ("atan[1]", "ATAN[y]/[x]"),
            ("#0", "#0"),
            ("#1.5", "#1.5"),
            ("#<open", "closing"),
        ] {
            let message = value(text).unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
        let deep = "[".repeat(100_000);
        assert!(value(&deep).unwrap_err().contains("nested"));
        let deep = "#".repeat(100_000);
        assert!(value(&deep).unwrap_err().contains("nested"));
    }

    #[test]
    fn what_the_machine_tells_is_not_set() {
        let fault = assignment(b"#5420=10", 0, &Interpreter::new(&Options::default(), 0)).unwrap_err();
        assert!(fault.message.contains("#5420"), "{}", fault.message);
    }
}
