//! Evaluates the recorded formula of a kinematics: values and derivatives by the chain rule, each with a bound of its rounding
//! error.
//!
//! A recorded formula is a list of operations on the results of earlier ones. A jet holds f, f', f'', f''' by the path's
//! parameter, as many as are asked for; products follow Leibniz's rule, functions Faà di Bruno's. Each derivative has a bound of
//! its error in units of `EPS`: the errors of the operands carried over, and the rounding of each term (Higham, Accuracy and
//! Stability of Numerical Algorithms, 2002, section 3.3). Bounds take longer than the values, so a jet has them only if they are
//! asked for. A formula is evaluated at one place or at eight at once, with the same bits.

use std::f64::consts::PI;

use fearless_simd::{dispatch, f64x8, Level, Simd, SimdBase};

use crate::elementary::Elementary;
use crate::number::Lanes;

/// Error of an elementary function, in roundings of its value.
const ELEMENTARY: f64 = 4.0;

/// The first N of f, f', f'', f''', and bounds of their errors in units of `EPS`: E is N, or 0 without bounds.
#[derive(Clone, Copy, Debug)]
pub struct Jet<const N: usize, const E: usize, T = f64> {
    pub value: [T; N],
    pub error: [T; E],
}

/// Most numbers of a jet: four values and four errors.
pub const JET: usize = 8;

/// What a formula is evaluated on: a number, or eight at once.
pub trait Argument: Elementary {
    /// Evaluates all operations into the table of results, which begins with the inputs; each result has N values and E errors.
    fn evaluate<const N: usize, const E: usize>(formula: &Formula, table: &mut [Self::Kept]);
}

impl Argument for f64 {
    fn evaluate<const N: usize, const E: usize>(formula: &Formula, table: &mut [f64]) {
        formula.fill::<N, E, f64>(0.0, table);
    }
}

impl<S: Simd> Argument for f64x8<S> {
    // The loop over the operations is compiled once, not inlined into every caller.
    #[inline(always)]
    fn evaluate<const N: usize, const E: usize>(formula: &Formula, table: &mut [Lanes]) {
        formula.evaluate_at_once::<N, E>(table);
    }
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
            // Operands that an operation does not have are 0; a constant, code 0, has none and may come first.
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

    /// Fills the table of results at eight places, in SIMD vectors.
    pub fn evaluate_at_once<const N: usize, const E: usize>(&self, table: &mut [Lanes]) {
        dispatch!(Level::new(), simd => self.fill::<N, E, _>(f64x8::splat(simd, 0.0), table));
    }

    /// Fills the table of results, in which the inputs are given; `nothing` is 0 in all lanes.
    #[inline(always)]
    fn fill<const N: usize, const E: usize, T: Elementary>(&self, nothing: T, table: &mut [T::Kept]) {
        // The cosine of an angle comes right after its sine.
        let mut wave = [nothing; 2];
        for (i, step) in self.steps.iter().enumerate() {
            let (known, rest) = table.split_at_mut((self.inputs + i) * (N + E));
            let [a, b] = step.operands;
            let a = Jet::<N, E, T>::taken(nothing, known, a);
            let c = step.constant;
            let found = match step.code {
                0 => Jet::constant(nothing.filled(c)),
                1 => a.scaled(-1.0),
                2 => a.plus(&Jet::taken(nothing, known, b), 1.0),
                3 => a.plus(&Jet::taken(nothing, known, b), -1.0),
                4 => a.times(&Jet::taken(nothing, known, b)),
                5 => a.times(&Jet::taken(nothing, known, b).reciprocal()),
                6 => a.shifted(c),
                7 => a.scaled(c),
                8 => a.times(&a),
                9 => a.root(),
                SINE => {
                    wave = a.value[0].wave();
                    let [s, c] = wave;
                    a.composed([s, c, s * -1.0, c * -1.0, s], ELEMENTARY)
                }
                COSINE => {
                    let [s, c] = wave;
                    a.composed([c, s * -1.0, c * -1.0, s, c], ELEMENTARY)
                }
                12 => a.angle(&Jet::taken(nothing, known, b)),
                13 => a.scaled(PI / 180.0),
                _ => a.scaled(180.0 / PI),
            };
            found.keep(rest, 0);
        }
    }
}

/// n over k.
const BINOMIAL: [[f64; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];

impl<const N: usize, const E: usize, T: Elementary> Jet<N, E, T> {
    /// A constant without error; its derivatives are 0.
    #[inline(always)]
    pub fn constant(value: T) -> Self {
        let nothing = value.filled(0.0);
        let mut jet = Self { value: [nothing; N], error: [nothing; E] };
        jet.value[0] = value;
        jet
    }

    /// Reads result `place` of a table; `like` only gives the type of number.
    #[inline(always)]
    pub fn taken(like: T, table: &[T::Kept], place: usize) -> Self {
        let row = &table[place * (N + E)..][..N + E];
        let mut jet = Self { value: [like; N], error: [like; E] };
        for k in 0..N {
            jet.value[k] = like.taken(&row[k]);
        }
        for k in 0..E {
            jet.error[k] = like.taken(&row[N + k]);
        }
        jet
    }

    /// Writes the jet into row `place` of a table.
    #[inline(always)]
    pub fn keep(&self, table: &mut [T::Kept], place: usize) {
        let row = &mut table[place * (N + E)..][..N + E];
        for k in 0..N {
            row[k] = self.value[k].kept();
        }
        for k in 0..E {
            row[N + k] = self.error[k].kept();
        }
    }

    #[inline(always)]
    fn plus(&self, other: &Self, sign: f64) -> Self {
        let mut jet = *self;
        for k in 0..N {
            jet.value[k] = self.value[k] + other.value[k] * sign;
        }
        for k in 0..E {
            jet.error[k] = self.error[k] + other.error[k] + jet.value[k].size();
        }
        jet
    }

    #[inline(always)]
    fn shifted(&self, constant: f64) -> Self {
        let mut jet = *self;
        jet.value[0] = jet.value[0] + constant;
        if E > 0 {
            jet.error[0] = jet.error[0] + jet.value[0].size();
        }
        jet
    }

    #[inline(always)]
    fn scaled(&self, constant: f64) -> Self {
        let mut jet = *self;
        for k in 0..N {
            jet.value[k] = self.value[k] * constant;
        }
        for k in 0..E {
            jet.error[k] = self.error[k] * constant.abs() + jet.value[k].size();
        }
        jet
    }

    #[inline(always)]
    pub fn times(&self, other: &Self) -> Self {
        self.times_to(other, N)
    }

    /// The first `terms` numbers of a product; the others are 0.
    #[inline(always)]
    fn times_to(&self, other: &Self, terms: usize) -> Self {
        let nothing = self.value[0].filled(0.0);
        let mut jet = Self { value: [nothing; N], error: [nothing; E] };
        for k in 0..terms {
            for j in 0..=k {
                let product = self.value[j] * other.value[k - j] * BINOMIAL[k][j];
                jet.value[k] = if j == 0 { product } else { jet.value[k] + product };
            }
        }
        if E == 0 {
            return jet;
        }
        // The rounding of a product and of its addition counts as an error of the second factor.
        let (mut size, mut other_size, mut other_error) = (self.value, other.value, other.error);
        for k in 0..N {
            (size[k], other_size[k]) = (size[k].size(), other_size[k].size());
            other_error[k] = other_error[k] + other_size[k] * 2.0;
        }
        for k in 0..terms {
            for j in 0..=k {
                let wrong = size[j] * other_error[k - j] + self.error[j] * other_size[k - j];
                jet.error[k] = jet.error[k] + wrong * BINOMIAL[k][j];
            }
        }
        jet
    }

    /// f of the jet, from the value and the first four derivatives of f, which have errors of `roundings` times `EPS` relative to
    /// their size.
    #[inline(always)]
    fn composed(&self, f: [T; 5], roundings: f64) -> Self {
        let (x, e) = (&self.value, &self.error);
        let mut jet = Self::constant(f[0]);
        // Errors of f and of its derivatives.
        let mut wrong = f;
        if E > 0 {
            for k in 0..4 {
                wrong[k] = f[k + 1].size() * e[0] + f[k].size() * roundings;
            }
            jet.error[0] = wrong[0];
        }
        if N > 1 {
            jet.value[1] = f[1] * x[1];
        }
        if N > 1 && E > 0 {
            jet.error[1] = wrong[1] * x[1].size() + f[1].size() * e[1] + jet.value[1].size();
        }
        if N > 2 {
            let (bent, straight) = (f[2] * x[1] * x[1], f[1] * x[2]);
            jet.value[2] = bent + straight;
            if E > 0 {
                jet.error[2] = wrong[2] * x[1] * x[1]
                    + (f[2] * x[1]).size() * 2.0 * e[1]
                    + wrong[1] * x[2].size()
                    + f[1].size() * e[2]
                    + (bent.size() + straight.size()) * 3.0;
            }
        }
        if N > 3 {
            let terms = [f[3] * (x[1] * x[1] * x[1]), f[2] * 3.0 * x[1] * x[2], f[1] * x[3]];
            jet.value[3] = terms[0] + terms[1] + terms[2];
            if E > 0 {
                let [slope, bend] = [x[1].size(), x[2].size()];
                let mixed = wrong[2] * (x[1] * x[2]).size() + f[2].size() * (e[1] * bend + slope * e[2]);
                jet.error[3] = wrong[3] * (slope * slope * slope)
                    + f[3].size() * 3.0 * x[1] * x[1] * e[1]
                    + mixed * 3.0
                    + wrong[1] * x[3].size()
                    + f[1].size() * e[3]
                    + (terms[0].size() + terms[1].size() + terms[2].size()) * 5.0;
            }
        }
        jet
    }

    #[inline(always)]
    fn reciprocal(&self) -> Self {
        let r = self.value[0].filled(1.0) / self.value[0];
        let r2 = r * r;
        self.composed([r, r2 * -1.0, r2 * 2.0 * r, r2 * -6.0 * r2, r2 * 24.0 * r2 * r], 1.0)
    }

    #[inline(always)]
    pub fn root(&self) -> Self {
        let (x, r) = (self.value[0], self.value[0].root());
        let first = x.filled(0.5) / r;
        let second = first * -0.5 / x;
        let third = second * -1.5 / x;
        self.composed([r, first, second, third, third * -2.5 / x], 2.0)
    }

    /// The angle of the vector (x, self): its slope is (x y' − y x') / (x² + y²).
    #[inline(always)]
    fn angle(&self, x: &Self) -> Self {
        let y = self;
        let square = x.value[0] * x.value[0] + y.value[0] * y.value[0];
        let mut jet = Self::constant(y.value[0].angle(x.value[0]));
        if E > 0 {
            let across = x.value[0].size() * y.error[0] + y.value[0].size() * x.error[0];
            jet.error[0] = across / square + jet.value[0].size() * ELEMENTARY;
        }
        if N > 1 {
            let turn = x.times_to(&y.slope(), N - 1).plus(&y.times_to(&x.slope(), N - 1), -1.0);
            let square = x.times_to(x, N - 1).plus(&y.times_to(y, N - 1), 1.0);
            let slope = turn.times_to(&square.reciprocal(), N - 1);
            for k in 1..N {
                jet.value[k] = slope.value[k - 1];
            }
            for k in 1..E {
                jet.error[k] = slope.error[k - 1];
            }
        }
        jet
    }

    /// The derivative of the jet; its last number is not known and set to 0.
    #[inline(always)]
    fn slope(&self) -> Self {
        let mut slope = Self::constant(self.value[0].filled(0.0));
        for k in 1..N {
            slope.value[k - 1] = self.value[k];
        }
        for k in 1..E {
            slope.error[k - 1] = self.error[k];
        }
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f, f', f'', f''' of a formula of x = u and y = 1 at u, with their errors.
    fn jet(u: f64, rows: &[[i32; 3]], constant: f64) -> Jet<4, 4> {
        let last = 2 + rows.len() as i32 - 1;
        let constants = vec![constant; rows.len()];
        let formula = Formula::new(2, rows, &constants, &[last]).expect("a list in order");
        let found = jet_of::<4>(u, &formula);
        assert_eq!(jet_of::<0>(u, &formula).value, found.value);
        found
    }

    fn jet_of<const E: usize>(u: f64, formula: &Formula) -> Jet<4, E> {
        let mut table = vec![0.0; JET * formula.places()];
        let (mut x, errors) = (Jet::<4, E>::constant(u), [u.abs(), 0.0, 0.0, 0.0]);
        x.value[1] = 1.0;
        x.error.copy_from_slice(&errors[..E]);
        x.keep(&mut table, 0);
        Jet::<4, E>::constant(1.0).keep(&mut table, 1);
        f64::evaluate::<4, E>(formula, &mut table);
        Jet::taken(0.0, &table, formula.outputs[0])
    }

    fn assert_near(found: Jet<4, 4>, exact: [f64; 4]) {
        for k in 0..4 {
            let away = (found.value[k] - exact[k]).abs();
            assert!(
                away <= EPS * found.error[k].max(exact[k].abs()),
                "{k}: {} for {}",
                found.value[k],
                exact[k]
            );
            // The worst-case bounds add up over the operations, but stay far below a part in 1e12.
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
