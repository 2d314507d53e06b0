//! The functions and operators of RS-274/NGC, on numbers. Angles are degrees.

use super::fault::{fault, Outcome};
use super::number::spaces;

/// Closer numbers are equal to EQ, NE, GE and LE.
const EQUAL: f64 = 1e-6;

#[derive(Clone, Copy)]
pub enum Function {
    Abs,
    Acos,
    Asin,
    Atan,
    Cos,
    Exists,
    Exp,
    Fix,
    Fup,
    Ln,
    Round,
    Sin,
    Sqrt,
    Tan,
}

const FUNCTIONS: [(&str, Function); 14] = [
    ("ABS", Function::Abs),
    ("ACOS", Function::Acos),
    ("ASIN", Function::Asin),
    ("ATAN", Function::Atan),
    ("COS", Function::Cos),
    ("EXISTS", Function::Exists),
    ("EXP", Function::Exp),
    ("FIX", Function::Fix),
    ("FUP", Function::Fup),
    ("LN", Function::Ln),
    ("ROUND", Function::Round),
    ("SIN", Function::Sin),
    ("SQRT", Function::Sqrt),
    ("TAN", Function::Tan),
];

impl Function {
    /// The function whose name and bracket start at `at`, its name, and the place of the bracket.
    pub fn at(source: &[u8], at: usize) -> Option<(Function, &'static str, usize)> {
        FUNCTIONS.iter().find_map(|&(name, function)| {
            let text = source.get(at..at + name.len())?;
            let bracket = spaces(source, at + name.len());
            (text.eq_ignore_ascii_case(name.as_bytes()) && source.get(bracket) == Some(&b'['))
                .then_some((function, name, bracket))
        })
    }
}

#[derive(Clone, Copy)]
pub enum Operator {
    And,
    Or,
    Xor,
    Eq,
    Ne,
    Gt,
    Ge,
    Lt,
    Le,
    Plus,
    Minus,
    Times,
    Over,
    Mod,
    Power,
}

/// The operator that a text starts with, by name, with how tightly it binds.
pub fn operator(text: &[u8]) -> Option<(&'static str, Operator, u8)> {
    let letter = |place: usize| text.get(place).map_or(0, u8::to_ascii_uppercase);
    Some(match [letter(0), letter(1), letter(2)] {
        [b'*', b'*', _] => ("**", Operator::Power, 5),
        [b'*', ..] => ("*", Operator::Times, 4),
        [b'/', ..] => ("/", Operator::Over, 4),
        [b'M', b'O', b'D'] => ("MOD", Operator::Mod, 4),
        [b'+', ..] => ("+", Operator::Plus, 3),
        [b'-', ..] => ("-", Operator::Minus, 3),
        [b'E', b'Q', _] => ("EQ", Operator::Eq, 2),
        [b'N', b'E', _] => ("NE", Operator::Ne, 2),
        [b'G', b'T', _] => ("GT", Operator::Gt, 2),
        [b'G', b'E', _] => ("GE", Operator::Ge, 2),
        [b'L', b'T', _] => ("LT", Operator::Lt, 2),
        [b'L', b'E', _] => ("LE", Operator::Le, 2),
        [b'A', b'N', b'D'] => ("AND", Operator::And, 1),
        [b'O', b'R', _] => ("OR", Operator::Or, 1),
        [b'X', b'O', b'R'] => ("XOR", Operator::Xor, 1),
        _ => return None,
    })
}

/// The function of that name at x; ATAN also takes what x stands over.
pub fn call(function: Function, name: &str, x: f64, over: f64) -> Outcome<f64> {
    if !domain(function, x) {
        return fault(format!("{name}[{x}] has no value: check the parameters"));
    }
    let value = match function {
        Function::Abs => x.abs(),
        Function::Acos => x.acos().to_degrees(),
        Function::Asin => x.asin().to_degrees(),
        Function::Atan => x.atan2(over).to_degrees(),
        Function::Cos => x.to_radians().cos(),
        Function::Exists => x,
        Function::Exp => x.exp(),
        Function::Fix => x.floor(),
        Function::Fup => x.ceil(),
        Function::Ln => x.ln(),
        Function::Round => x.round(),
        Function::Sin => x.to_radians().sin(),
        Function::Sqrt => x.sqrt(),
        Function::Tan => x.to_radians().tan(),
    };
    finite(value, name)
}

fn domain(function: Function, x: f64) -> bool {
    match function {
        Function::Acos | Function::Asin => x.abs() <= 1.0,
        Function::Ln => x > 0.0,
        Function::Sqrt => x >= 0.0,
        _ => true,
    }
}

/// `left` and `right` joined by the operator of that name.
pub fn apply(operator: Operator, name: &str, left: f64, right: f64) -> Outcome<f64> {
    let truth = |value: bool| f64::from(value);
    let equal = (left - right).abs() < EQUAL;
    let value = match operator {
        Operator::And => truth(left != 0.0 && right != 0.0),
        Operator::Or => truth(left != 0.0 || right != 0.0),
        Operator::Xor => truth((left != 0.0) != (right != 0.0)),
        Operator::Eq => truth(equal),
        Operator::Ne => truth(!equal),
        Operator::Gt => truth(left > right),
        Operator::Ge => truth(left >= right || equal),
        Operator::Lt => truth(left < right),
        Operator::Le => truth(left <= right || equal),
        Operator::Plus => left + right,
        Operator::Minus => left - right,
        Operator::Times => left * right,
        Operator::Over | Operator::Mod if right == 0.0 => {
            return fault(format!("{left} is divided by 0: check the parameters"));
        }
        Operator::Over => left / right,
        // Of the divisor's size and never negative, whatever the signs.
        Operator::Mod => {
            let rest = left % right;
            if rest < 0.0 {
                rest + right.abs()
            } else {
                rest
            }
        }
        Operator::Power if left < 0.0 && right != right.floor() => {
            return fault(format!("{left} ** {right} has no value: check the parameters"));
        }
        Operator::Power => left.powf(right),
    };
    finite(value, name)
}

fn finite(value: f64, what: &str) -> Outcome<f64> {
    if value.is_finite() {
        return Ok(value);
    }
    fault(format!("the result of {what} is not a finite number: check the parameters"))
}
