//! Evaluates the recorded formula of a kinematics: values and derivatives by the chain rule, each with a bound of its rounding.
//!
//! A recorded formula is a list of operations on the results of earlier ones. A jet holds f, f', f'', f''' by the path's
//! parameter, as many as are asked for; products go by Leibniz's rule, functions by Faà di Bruno's. Each derivative
//! has a bound of its error in units of the rounding of 1: the errors of the operands carried over, and the rounding of each term
//! (Higham, Accuracy and Stability of Numerical Algorithms, 2002, section 3.3). Bounds take longer than the values, so a
//! jet has them only if they are asked for.

use std::f64::consts::PI;

use crate::vectors::vector_of;

/// Error of an elementary function, in roundings of its value.
const ELEMENTARY: f64 = 4.0;

/// The first N of f, f', f'', f''' and, if `ROUNDED`, their errors in units of `EPS`; else these are 0.
#[derive(Clone, Copy, Debug)]
pub struct Jet<const N: usize, const ROUNDED: bool> {
    pub value: [f64; N],
    pub error: [f64; N],
}

/// One operation; see `feedplan.machine.expression.Op` for the codes.
#[derive(Clone, Copy, Debug)]
struct Step {
    code: i32,
    operands: [usize; 2],
    constant: f64,
}

/// The joints as functions of the coordinates of the tip.
#[derive(Clone, Debug)]
pub struct Formula {
    pub inputs: usize,
    steps: Vec<Step>,
    pub outputs: Vec<usize>,
}

const CODES: i32 = 15;
const SINE: i32 = 10;
const COSINE: i32 = 11;

impl Formula {
    /// None where an operand is not an earlier result, or a code is unknown.
    pub fn new(inputs: usize, rows: &[[i32; 3]], constants: &[f64], outputs: &[i32]) -> Option<Self> {
        let place = |number: i32, end: usize| usize::try_from(number).ok().filter(|&place| place < end);
        let mut steps: Vec<Step> = Vec::with_capacity(rows.len());
        for (&[code, a, b], &constant) in rows.iter().zip(constants) {
            let end = inputs + steps.len();
            // Operands that an operation does not have are 0; the first has none at all.
            let operands = if code == 0 { [0, 0] } else { [place(a, end)?, place(b, end)?] };
            let follows = steps.last().is_some_and(|step| step.code == SINE && step.operands == operands);
            if !(0..CODES).contains(&code) || (code == COSINE && !follows) {
                return None;
            }
            steps.push(Step { code, operands, constant });
        }
        let end = inputs + steps.len();
        let outputs: Option<Vec<usize>> = outputs.iter().map(|&number| place(number, end)).collect();
        let good = rows.len() == constants.len();
        outputs.filter(|_| good).map(|outputs| Self { inputs, steps, outputs })
    }

    /// Number of results, inputs first.
    pub fn places(&self) -> usize {
        self.inputs + self.steps.len()
    }

    /// Fills the table of results, in which the inputs are given.
    pub fn evaluate<const N: usize, const ROUNDED: bool>(&self, table: &mut [Jet<N, ROUNDED>]) {
        // The cosine of an angle comes right after its sine.
        let mut wave = (0.0, 1.0);
        for (i, step) in self.steps.iter().enumerate() {
            let (known, rest) = table.split_at_mut(self.inputs + i);
            let [a, b] = step.operands.map(|place| &known[place]);
            let c = step.constant;
            rest[0] = match step.code {
                0 => Jet::constant(c),
                1 => a.scaled(-1.0),
                2 => a.plus(b, 1.0),
                3 => a.plus(b, -1.0),
                4 => a.times(b),
                5 => a.times(&b.reciprocal()),
                6 => a.shifted(c),
                7 => a.scaled(c),
                8 => a.times(a),
                9 => a.root(),
                SINE => {
                    wave = a.value[0].sin_cos();
                    let (s, c) = wave;
                    a.composed([s, c, -s, -c, s], ELEMENTARY)
                }
                COSINE => {
                    let (s, c) = wave;
                    a.composed([c, -s, -c, s, c], ELEMENTARY)
                }
                12 => a.angle(b),
                13 => a.scaled(PI / 180.0),
                _ => a.scaled(180.0 / PI),
            };
        }
    }
}

/// n over k.
const BINOMIAL: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

impl<const N: usize, const ROUNDED: bool> Jet<N, ROUNDED> {
    pub fn constant(value: f64) -> Self {
        let mut jet = Self { value: [0.0; N], error: [0.0; N] };
        jet.value[0] = value;
        jet
    }

    /// From the values, and the errors if there are any.
    #[inline(always)]
    fn by(value: [f64; N], error: impl Fn(usize) -> f64) -> Self {
        Self { value, error: if ROUNDED { vector_of(error) } else { [0.0; N] } }
    }

    #[inline]
    fn plus(&self, other: &Self, sign: f64) -> Self {
        let value: [f64; N] = std::array::from_fn(|k| self.value[k] + sign * other.value[k]);
        Self::by(value, |k| self.error[k] + other.error[k] + value[k].abs())
    }

    #[inline]
    fn shifted(&self, constant: f64) -> Self {
        let mut jet = *self;
        jet.value[0] += constant;
        if ROUNDED {
            jet.error[0] += jet.value[0].abs();
        }
        jet
    }

    #[inline]
    fn scaled(&self, constant: f64) -> Self {
        let value = self.value.map(|x| constant * x);
        Self::by(value, |k| constant.abs() * self.error[k] + value[k].abs())
    }

    #[inline]
    pub fn times(&self, other: &Self) -> Self {
        self.times_to(other, N)
    }

    /// The first terms of a product, the others 0.
    #[inline(always)]
    fn times_to(&self, other: &Self, terms: usize) -> Self {
        let mut jet = Self { value: [0.0; N], error: [0.0; N] };
        let [size, other_size] = [self, other].map(|jet| jet.value.map(f64::abs));
        // The rounding of a product and of its addition counts as an error of the second factor.
        let other_error: [f64; N] = vector_of(|k| other.error[k] + 2.0 * other_size[k]);
        for k in 0..terms {
            for j in 0..=k {
                let many = BINOMIAL[k][j];
                jet.value[k] += many * (self.value[j] * other.value[k - j]);
                if ROUNDED {
                    jet.error[k] += many * (size[j] * other_error[k - j] + self.error[j] * other_size[k - j]);
                }
            }
        }
        jet
    }

    /// A function of the jet, from the value and the first four derivatives of the function, each with an error of `roundings`.
    #[inline]
    fn composed(&self, f: [f64; 5], roundings: f64) -> Self {
        let (x, e) = (&self.value, &self.error);
        let wrong = |k: usize| f[k + 1].abs() * e[0] + roundings * f[k].abs();
        let mut jet = Self::constant(f[0]);
        if ROUNDED {
            jet.error[0] = wrong(0);
        }
        if N > 1 {
            jet.value[1] = f[1] * x[1];
        }
        if N > 1 && ROUNDED {
            jet.error[1] = wrong(1) * x[1].abs() + f[1].abs() * e[1] + jet.value[1].abs();
        }
        let (bent, straight) = if N > 2 { (f[2] * x[1] * x[1], f[1] * x[2]) } else { (0.0, 0.0) };
        if N > 2 {
            jet.value[2] = bent + straight;
        }
        if N > 2 && ROUNDED {
            jet.error[2] = wrong(2) * x[1] * x[1]
                + 2.0 * (f[2] * x[1]).abs() * e[1]
                + wrong(1) * x[2].abs()
                + f[1].abs() * e[2]
                + 3.0 * (bent.abs() + straight.abs());
        }
        if N > 3 {
            let terms = [f[3] * x[1].powi(3), 3.0 * f[2] * x[1] * x[2], f[1] * x[3]];
            jet.value[3] = terms.iter().sum();
            if !ROUNDED {
                return jet;
            }
            let mixed = wrong(2) * (x[1] * x[2]).abs() + f[2].abs() * (e[1] * x[2].abs() + x[1].abs() * e[2]);
            jet.error[3] = wrong(3) * x[1].abs().powi(3)
                + 3.0 * f[3].abs() * x[1] * x[1] * e[1]
                + 3.0 * mixed
                + wrong(1) * x[3].abs()
                + f[1].abs() * e[3]
                + 5.0 * terms.iter().map(|term| term.abs()).sum::<f64>();
        }
        jet
    }

    fn reciprocal(&self) -> Self {
        let r = 1.0 / self.value[0];
        let r2 = r * r;
        self.composed([r, -r2, 2.0 * r2 * r, -6.0 * r2 * r2, 24.0 * r2 * r2 * r], 1.0)
    }

    pub fn root(&self) -> Self {
        let (x, r) = (self.value[0], self.value[0].sqrt());
        let first = 0.5 / r;
        let second = -0.5 * first / x;
        let third = -1.5 * second / x;
        self.composed([r, first, second, third, -2.5 * third / x], 2.0)
    }

    /// The angle of the vector (x, self): its slope is (x y' − y x') / (x² + y²).
    fn angle(&self, x: &Self) -> Self {
        let y = self;
        let square = x.value[0] * x.value[0] + y.value[0] * y.value[0];
        let mut jet = Self::constant(y.value[0].atan2(x.value[0]));
        if ROUNDED {
            let across = x.value[0].abs() * y.error[0] + y.value[0].abs() * x.error[0];
            jet.error[0] = across / square + ELEMENTARY * jet.value[0].abs();
        }
        if N > 1 {
            let turn = x.times_to(&y.slope(), N - 1).plus(&y.times_to(&x.slope(), N - 1), -1.0);
            let square = x.times_to(x, N - 1).plus(&y.times_to(y, N - 1), 1.0);
            let slope = turn.times_to(&square.reciprocal(), N - 1);
            for k in 1..N {
                (jet.value[k], jet.error[k]) = (slope.value[k - 1], slope.error[k - 1]);
            }
        }
        jet
    }

    /// The derivative; its last term is not known, and 0.
    fn slope(&self) -> Self {
        let later = |terms: &[f64; N]| std::array::from_fn(|k| if k + 1 < N { terms[k + 1] } else { 0.0 });
        Self { value: later(&self.value), error: later(&self.error) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f, f', f'', f''' of a formula of x = u and y = 1 at u, with their errors.
    fn jet(u: f64, rows: &[[i32; 3]], constant: f64) -> Jet<4, true> {
        let last = 2 + rows.len() as i32 - 1;
        let constants = vec![constant; rows.len()];
        let formula = Formula::new(2, rows, &constants, &[last]).expect("a list in order");
        let found = jet_of::<true>(u, &formula);
        assert_eq!(jet_of::<false>(u, &formula).value, found.value);
        found
    }

    fn jet_of<const ROUNDED: bool>(u: f64, formula: &Formula) -> Jet<4, ROUNDED> {
        let mut table = vec![Jet::constant(0.0); formula.places()];
        table[0] = Jet { value: [u, 1.0, 0.0, 0.0], error: [u.abs(), 0.0, 0.0, 0.0] };
        table[1] = Jet::constant(1.0);
        formula.evaluate(&mut table);
        table[formula.outputs[0]]
    }

    fn assert_near(found: Jet<4, true>, exact: [f64; 4]) {
        for k in 0..4 {
            let away = (found.value[k] - exact[k]).abs();
            assert!(
                away <= EPS * found.error[k].max(exact[k].abs()),
                "{k}: {} for {}",
                found.value[k],
                exact[k]
            );
            // Bounds of the worst case add up over the operations, and stay far below a part in 1e12.
            let most = 2000.0 * exact.iter().fold(1.0, |most: f64, x| most.max(x.abs()));
            assert!(found.error[k] <= most, "{k}: {} roundings", found.error[k]);
        }
    }

    const EPS: f64 = crate::EPS;

    #[test]
    fn derivatives_are_those_of_closed_forms() {
        let u: f64 = 0.7;
        let (s, c) = u.sin_cos();
        assert_near(jet(u, &[[10, 0, 0], [11, 0, 0]], 0.0), [c, -s, -c, s]);
        assert_near(jet(u, &[[9, 0, 0]], 0.0), {
            let r = u.sqrt();
            [r, 0.5 / r, -0.25 / (u * r), 0.375 / (u * u * r)]
        });
        assert_near(jet(u, &[[5, 1, 0]], 0.0), [1.0 / u, -1.0 / (u * u), 2.0 / u.powi(3), -6.0 / u.powi(4)]);
        // The angle of (1, u): its slope is 1 / (1 + u²).
        let d = 1.0 + u * u;
        let exact = [u.atan(), 1.0 / d, -2.0 * u / (d * d), (6.0 * u * u - 2.0) / d.powi(3)];
        assert_near(jet(u, &[[12, 0, 1]], 0.0), exact);
        // The angle of (cos u, sin u) is u, and √(u³) a power.
        assert_near(jet(u, &[[10, 0, 0], [11, 0, 0], [12, 2, 3]], 0.0), [u, 1.0, 0.0, 0.0]);
        let power = [u.powf(1.5), 1.5 * u.sqrt(), 0.75 / u.sqrt(), -0.375 / u.powf(1.5)];
        assert_near(jet(u, &[[8, 0, 0], [4, 2, 0], [9, 3, 0]], 0.0), power);
        // 3 u³ + 3.
        let rows = [[8, 0, 0], [4, 2, 0], [7, 3, 0], [6, 4, 0]];
        assert_near(jet(u, &rows, 3.0), [3.0 * u.powi(3) + 3.0, 9.0 * u * u, 18.0 * u, 18.0]);
    }

    #[test]
    fn what_cancels_is_not_known() {
        // (1e9 + u) − 1e9 with u = 1e-3: the error is that of 1e9.
        let rows = [[6, 0, 0], [13, 0, 0]];
        let shifted = jet(1e-3, &rows[..1], 1e9);
        assert!(EPS * shifted.error[0] >= 1e-7);
        let found = shifted.shifted(-1e9);
        assert!((found.value[0] - 1e-3).abs() <= EPS * found.error[0]);
    }
}
