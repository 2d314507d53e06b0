//! A formula as a list of operations on earlier results, and its evaluation on series of numbers or of intervals.

use super::number::Number;
use super::series::{self, MOST_ORDER};

/// One operation. An operand is the index of an earlier result; the inputs are the first results.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    Constant(f64),
    Negative(usize),
    Sum(usize, usize),
    Difference(usize, usize),
    Product(usize, usize),
    Quotient(usize, usize),
    /// A result plus a constant.
    Shift(usize, f64),
    /// A result times a constant.
    Scale(usize, f64),
    Square(usize),
    Root(usize),
    /// The sine of an angle in radians; the next operation is the cosine of the same angle.
    Sine(usize),
    /// Follows a sine, which computes both.
    Cosine,
    /// The angle in radians of a vector, from its y and its x.
    Angle(usize, usize),
    Radians(usize),
    Degrees(usize),
}

/// A formula with several outputs.
#[derive(Clone, Debug)]
pub struct Expression {
    inputs: usize,
    operations: Vec<Operation>,
    outputs: Vec<usize>,
}

impl Expression {
    /// From one row (code, first operand, second operand) and one constant for each operation. None where an operand is not an
    /// earlier result or a code is unknown.
    pub fn new(inputs: usize, rows: &[[i32; 3]], constants: &[f64], outputs: &[i32]) -> Option<Self> {
        let mut operations = Vec::with_capacity(rows.len());
        for (i, (row, &constant)) in rows.iter().zip(constants).enumerate() {
            let earlier = |operand: i32| usize::try_from(operand).ok().filter(|&index| index < inputs + i);
            let (a, b) = (row[1], row[2]);
            operations.push(match row[0] {
                0 => Operation::Constant(constant),
                1 => Operation::Negative(earlier(a)?),
                2 => Operation::Sum(earlier(a)?, earlier(b)?),
                3 => Operation::Difference(earlier(a)?, earlier(b)?),
                4 => Operation::Product(earlier(a)?, earlier(b)?),
                5 => Operation::Quotient(earlier(a)?, earlier(b)?),
                6 => Operation::Shift(earlier(a)?, constant),
                7 => Operation::Scale(earlier(a)?, constant),
                8 => Operation::Square(earlier(a)?),
                9 => Operation::Root(earlier(a)?),
                10 => Operation::Sine(earlier(a)?),
                11 if matches!(operations.last(), Some(Operation::Sine(_))) => Operation::Cosine,
                12 => Operation::Angle(earlier(a)?, earlier(b)?),
                13 => Operation::Radians(earlier(a)?),
                14 => Operation::Degrees(earlier(a)?),
                _ => return None,
            });
        }
        let count = inputs + operations.len();
        let followed = |i: usize| operations.get(i + 1) == Some(&Operation::Cosine);
        let paired =
            (0..operations.len()).all(|i| !matches!(operations[i], Operation::Sine(_)) || followed(i));
        let outputs: Option<Vec<usize>> =
            outputs.iter().map(|&index| usize::try_from(index).ok().filter(|&index| index < count)).collect();
        let good = paired && rows.len() == constants.len();
        outputs.filter(|_| good).map(|outputs| Self { inputs, operations, outputs })
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.outputs.len()
    }

    /// A table for the series of all results up to an order.
    pub fn table<T: Number>(&self, order: usize) -> Table<T> {
        Table::new(self.inputs + self.operations.len(), order)
    }

    /// Evaluates all operations on the inputs in the table.
    pub fn evaluate<T: Number>(&self, table: &mut Table<T>) {
        let n = table.terms;
        for (i, &operation) in self.operations.iter().enumerate() {
            let (earlier, later) = table.values.split_at_mut((self.inputs + i) * n);
            let out = &mut later[..n];
            let of = |index: usize| &earlier[index * n..][..n];
            match operation {
                Operation::Constant(value) => {
                    out.fill(T::exactly(0.0));
                    out[0] = T::exactly(value);
                }
                Operation::Negative(a) => each(out, of(a), |x| -x),
                Operation::Sum(a, b) => pairs(out, of(a), of(b), |x, y| x + y),
                Operation::Difference(a, b) => pairs(out, of(a), of(b), |x, y| x - y),
                Operation::Product(a, b) => series::product(of(a), of(b), out),
                Operation::Quotient(a, b) => series::quotient(of(a), of(b), out),
                Operation::Shift(a, value) => {
                    out.copy_from_slice(of(a));
                    out[0] = out[0] + T::exactly(value);
                }
                Operation::Scale(a, value) => each(out, of(a), |x| x * T::exactly(value)),
                Operation::Square(a) => series::square(of(a), out),
                Operation::Root(a) => series::sqrt(of(a), out),
                Operation::Sine(a) => {
                    let (sine, cosine) = later[..2 * n].split_at_mut(n);
                    series::sin_cos(of(a), sine, cosine);
                }
                Operation::Cosine => {}
                Operation::Angle(y, x) => series::atan2(of(y), of(x), out),
                Operation::Radians(a) => each(out, of(a), T::radians),
                Operation::Degrees(a) => each(out, of(a), T::degrees),
            }
        }
    }

    /// The series of an output.
    pub fn output<'a, T: Number>(&self, table: &'a Table<T>, number: usize) -> &'a [T] {
        &table.values[self.outputs[number] * table.terms..][..table.terms]
    }
}

/// The series of the inputs and of all results, one after another.
pub struct Table<T> {
    /// Number of terms of each series.
    pub terms: usize,
    values: Vec<T>,
}

impl<T: Number> Table<T> {
    pub fn new(results: usize, order: usize) -> Self {
        assert!(order <= MOST_ORDER, "order {order} of a series");
        Self { terms: order + 1, values: vec![T::exactly(0.0); results * (order + 1)] }
    }

    /// The series of an input.
    pub fn input(&mut self, number: usize) -> &mut [T] {
        &mut self.values[number * self.terms..][..self.terms]
    }
}

#[inline]
fn each<T: Number>(out: &mut [T], a: &[T], result: impl Fn(T) -> T) {
    for (out, &a) in out.iter_mut().zip(a) {
        *out = result(a);
    }
}

#[inline]
fn pairs<T: Number>(out: &mut [T], a: &[T], b: &[T], result: impl Fn(T, T) -> T) {
    for ((out, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *out = result(a, b);
    }
}
