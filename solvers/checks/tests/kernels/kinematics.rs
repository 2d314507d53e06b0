//! Recorded formulas: the Taylor series and the intervals of the planner agree with the jets of the audit.

use feedplan_audit::joints::formula::{Argument, Formula, Jet, JET};
use feedplan_audit::EPS;
use feedplan_geometry::interval::Interval;
use feedplan_kinematics::expression::Expression;
use proptest::prelude::*;

/// Codes of operations with one operand, and with two.
const UNARY: [i32; 8] = [1, 6, 7, 8, 9, 10, 13, 14];
const BINARY: [i32; 5] = [2, 3, 4, 5, 12];
const INPUTS: usize = 2;

/// A formula of random operations on earlier results.
fn formula(choices: &[(bool, usize, usize, usize, f64)]) -> (Vec<[i32; 3]>, Vec<f64>) {
    let (mut rows, mut constants) = (Vec::new(), Vec::new());
    for &(unary, op, a, b, constant) in choices {
        let places = INPUTS + rows.len();
        let code = if unary { UNARY[op % UNARY.len()] } else { BINARY[op % BINARY.len()] };
        let second = if unary { 0 } else { b % places };
        rows.push([code, (a % places) as i32, second as i32]);
        constants.push(constant);
        if code == 10 {
            rows.push([11, (a % places) as i32, 0]);
            constants.push(0.0);
        }
    }
    (rows, constants)
}

proptest! {
    #[test]
    fn the_audit_s_derivatives_are_the_planner_s_within_their_errors(
        choices in proptest::collection::vec(
            (any::<bool>(), 0usize..8, 0usize..40, 0usize..40, -3.0f64..3.0), 1..12),
        x in proptest::array::uniform4(-2.0f64..2.0),
        y in proptest::array::uniform4(-2.0f64..2.0),
    ) {
        let (rows, constants) = formula(&choices);
        let last = [(INPUTS + rows.len() - 1) as i32];
        let theirs = Expression::new(INPUTS, &rows, &constants, &last).expect("a list in order");
        let ours = Formula::new(INPUTS, &rows, &constants, &last).expect("a list in order");
        let mut table = theirs.table::<f64>(3);
        let mut bounds = theirs.table::<Interval>(3);
        let mut jets = vec![0.0; JET * ours.places()];
        let factorial = [1.0, 1.0, 2.0, 6.0];
        for (i, terms) in [x, y].into_iter().enumerate() {
            table.input(i).copy_from_slice(&terms);
            bounds.input(i).copy_from_slice(&terms.map(Interval::exactly));
            let value: [f64; 4] = std::array::from_fn(|k| terms[k] * factorial[k]);
            Jet { value, error: value.map(f64::abs) }.keep(&mut jets, i);
        }
        theirs.evaluate(&mut table);
        theirs.evaluate(&mut bounds);
        f64::evaluate::<4, 4>(&ours, &mut jets);
        let jet = Jet::<4, 4>::taken(0.0, &jets, ours.outputs[0]);
        for k in 0..4 {
            let (value, error) = (jet.value[k], EPS * jet.error[k]);
            let bound = theirs.output(&bounds, 0)[k];
            // The products with the factorials are rounded as well.
            let slack = 4.0 * EPS * bound.magnitude() * factorial[k];
            let near = Interval { lo: bound.lo * factorial[k] - slack, hi: bound.hi * factorial[k] + slack };
            // Values (k = 0) are not compared: angles may differ by full turns.
            if near.is_bounded() && value.is_finite() && error.is_finite() && k > 0 {
                let series = theirs.output(&table, 0)[k] * factorial[k];
                prop_assert!(near.lo <= series && series <= near.hi);
                // The exact derivative is within the bounds and within the error of the audit's derivative.
                prop_assert!(value + error >= near.lo && value - error <= near.hi, "{k}: {value} ± {error}, {near:?}");
            }
        }
    }

    #[test]
    fn a_formula_has_the_same_bits_at_one_place_and_at_eight_at_once(
        choices in proptest::collection::vec(
            (any::<bool>(), 0usize..8, 0usize..40, 0usize..40, -3.0f64..3.0), 1..12),
        inputs in proptest::array::uniform8(proptest::array::uniform16(-2.0f64..2.0)),
    ) {
        let (rows, constants) = formula(&choices);
        let last = [(INPUTS + rows.len() - 1) as i32];
        let ours = Formula::new(INPUTS, &rows, &constants, &last).expect("a list in order");
        let mut at_once = vec![[0.0; 8]; JET * ours.places()];
        for (lane, numbers) in inputs.iter().enumerate() {
            for (row, number) in at_once.iter_mut().zip(numbers) {
                row[lane] = *number;
            }
        }
        ours.evaluate_at_once::<4, 4>(&mut at_once);
        for (lane, numbers) in inputs.iter().enumerate() {
            let mut alone = vec![0.0; JET * ours.places()];
            alone[..numbers.len()].copy_from_slice(numbers);
            f64::evaluate::<4, 4>(&ours, &mut alone);
            for (row, number) in at_once.iter().zip(&alone) {
                // NaN may have either sign.
                prop_assert!(row[lane].to_bits() == number.to_bits() || row[lane].is_nan() && number.is_nan());
            }
        }
    }
}

#[test]
fn what_is_no_list_in_order_is_none() {
    for (rows, outputs) in [
        (vec![[2, 0, 2]], vec![2]),  // an operand that comes later
        (vec![[2, -1, 0]], vec![2]), // an operand with a negative index
        (vec![[99, 0, 0]], vec![2]), // an unknown code
        (vec![[11, 0, 0]], vec![2]), // a cosine without its sine
        (vec![[1, 0, 0]], vec![3]),  // an output beyond the list
    ] {
        let constants = vec![0.0; rows.len()];
        assert!(Expression::new(INPUTS, &rows, &constants, &outputs).is_none());
        assert!(Formula::new(INPUTS, &rows, &constants, &outputs).is_none());
    }
    assert!(Expression::new(INPUTS, &[[10, 0, 0]], &[0.0], &[2]).is_none(), "a sine without its cosine");
}
