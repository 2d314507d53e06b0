//! The functions and operators of RS-274/NGC, on numbers. Angles are in degrees.

use super::fault::Outcome;
use super::number::{behind_word, spaces};
use super::tolerance::EQUAL;

/// A function, by its kind of argument.
#[derive(Clone, Copy)]
pub enum Function {
    /// A function of one number.
    Of(fn(f64) -> f64),
    Atan,
    Exists,
}

const FUNCTIONS: [(&str, Function); 14] = [
    ("ABS", Function::Of(f64::abs)),
    ("ACOS", Function::Of(|x| x.acos().to_degrees())),
    ("ASIN", Function::Of(|x| x.asin().to_degrees())),
    ("ATAN", Function::Atan),
    ("COS", Function::Of(|x| x.to_radians().cos())),
    ("EXISTS", Function::Exists),
    ("EXP", Function::Of(f64::exp)),
    ("FIX", Function::Of(f64::floor)),
    ("FUP", Function::Of(f64::ceil)),
    ("LN", Function::Of(f64::ln)),
    ("ROUND", Function::Of(f64::round)),
    ("SIN", Function::Of(|x| x.to_radians().sin())),
    ("SQRT", Function::Of(f64::sqrt)),
    ("TAN", Function::Of(|x| x.to_radians().tan())),
];

/// The function whose name and bracket start at `at`, its name, and the place of the bracket.
pub fn function_at(source: &[u8], at: usize) -> Option<(Function, &'static str, usize)> {
    FUNCTIONS.iter().find_map(|&(name, function)| {
        let bracket = spaces(source, behind_word(source, at, name)?);
        (source.get(bracket) == Some(&b'[')).then_some((function, name, bracket))
    })
}

/// An operator: its name, its precedence (a greater one binds more tightly), and its result for two numbers.
pub struct Operator {
    pub name: &'static str,
    pub binding: u8,
    result: fn(f64, f64) -> f64,
}

const fn operator(name: &'static str, binding: u8, result: fn(f64, f64) -> f64) -> Operator {
    Operator { name, binding, result }
}

/// In this order, the first name that matches the start of a text is the right one: `**` comes before `*`.
static OPERATORS: [Operator; 15] = [
    operator("**", 5, f64::powf),
    operator("*", 4, |a, b| a * b),
    operator("/", 4, |a, b| a / b),
    operator("MOD", 4, modulo),
    operator("+", 3, |a, b| a + b),
    operator("-", 3, |a, b| a - b),
    operator("EQ", 2, |a, b| truth(equal(a, b))),
    operator("NE", 2, |a, b| truth(!equal(a, b))),
    operator("GT", 2, |a, b| truth(a > b)),
    operator("GE", 2, |a, b| truth(a >= b || equal(a, b))),
    operator("LT", 2, |a, b| truth(a < b)),
    operator("LE", 2, |a, b| truth(a <= b || equal(a, b))),
    operator("AND", 1, |a, b| truth(a != 0.0 && b != 0.0)),
    operator("OR", 1, |a, b| truth(a != 0.0 || b != 0.0)),
    operator("XOR", 1, |a, b| truth((a != 0.0) != (b != 0.0))),
];

/// The operator at `at`.
pub fn operator_at(source: &[u8], at: usize) -> Option<&'static Operator> {
    OPERATORS.iter().find(|operator| behind_word(source, at, operator.name).is_some())
}

impl Operator {
    /// The result for two numbers; a fault where it is not a finite number.
    pub fn apply(&self, left: f64, right: f64) -> Outcome<f64> {
        finite((self.result)(left, right), || format!("{left} {} {right}", self.name))
    }
}

/// Returns the value; a fault that names its formula if it is not finite.
pub fn finite(value: f64, formula: impl Fn() -> String) -> Outcome<f64> {
    if value.is_finite() {
        return Ok(value);
    }
    fault!("{} has no finite value: check the parameters", formula())
}

fn truth(value: bool) -> f64 {
    f64::from(value)
}

fn equal(a: f64, b: f64) -> bool {
    (a - b).abs() < EQUAL
}

/// The remainder of a/b, at least 0 and less than |b| whatever the signs.
fn modulo(a: f64, b: f64) -> f64 {
    let rest = a % b;
    if rest < 0.0 {
        rest + b.abs()
    } else {
        rest
    }
}
