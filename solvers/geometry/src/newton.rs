//! Finds the parameter that is one step of given length ahead, from a table of lengths: a first-order start and Newton–Raphson.
//!
//! Source: Zhang et al. 2010, section 4.2, which bounds neither the number of rounds nor the iterates. Here each iterate stays
//! between the start of the step and the end of the curve. If Newton–Raphson leaves that bracket, as happens next to a cusp, or
//! does not converge, bisection continues. A step may be negative.

use crate::arc_length::{Integrand, Table};
use crate::inverse_length::Located;

/// The number of rounds of Newton–Raphson before bisection takes over.
const NEWTON_ROUNDS: u32 = 20;
/// Bisection of a bracket of doubles ends in fewer rounds.
const MAX_ROUNDS: u32 = NEWTON_ROUNDS + 1100;

/// The u with S(u) = S(from) + step within `tolerance`, and that S(u); beyond an end of the table that end. `from` is a parameter
/// and its S.
pub fn advance<F: Integrand>(
    table: &Table<F>,
    from: (f64, f64),
    step: f64,
    tolerance: f64,
) -> (Located, f64) {
    let (start, start_sum) = from;
    let (first, last) = (table.nodes[0], table.nodes[table.nodes.len() - 1]);
    let target = start_sum + step;
    if step == 0.0 {
        return (Located { u: start, ..Located::default() }, start_sum);
    }
    if target <= first.sum || target >= last.sum {
        let end = if step > 0.0 { last } else { first };
        return (Located { u: end.u, ..Located::default() }, end.sum);
    }
    let (mut low, mut high) = if step > 0.0 { (start, last.u) } else { (first.u, start) };
    let mut u = start + step / table.f.at(start);
    for iterations in 1..=MAX_ROUNDS {
        if !(low < u && u < high) || iterations > NEWTON_ROUNDS {
            u = 0.5 * (low + high);
        }
        let sum = table.integral(u);
        let miss = (sum - target).abs();
        let settled = miss <= tolerance || !(low < u && u < high);
        if settled || iterations == MAX_ROUNDS {
            return (Located { u, miss, iterations }, sum);
        }
        if sum > target {
            high = u;
        } else {
            low = u;
        }
        u -= (sum - target) / table.f.at(u);
    }
    unreachable!("the last round returns")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::arc_length::{quadrature, tabulate, QuadraticSpeed};
    use crate::quadratic::Quadratic;

    /// One step along a line of 5 mm, from 1 mm.
    fn on_a_line(step: f64) -> (Located, f64) {
        let f = QuadraticSpeed::new(&Quadratic::line([0.0, 0.0], [3.0, 4.0]));
        let mut nodes = Vec::new();
        tabulate(f, 0.0, 5.0, 1e-12, &mut nodes);
        advance(&Table { f, nodes: &nodes }, (1.0, 1.0), step, 1e-12)
    }

    #[test]
    fn a_step_on_a_line_needs_no_correction() {
        let (located, sum) = on_a_line(2.5);
        assert_eq!((located.u, sum, located.iterations), (3.5, 3.5, 1));
    }

    #[test]
    fn a_step_past_the_end_stops_there() {
        assert_eq!(on_a_line(9.0).0.u, 5.0);
        assert_eq!(on_a_line(0.0).0.u, 1.0);
    }

    proptest! {
        #[test]
        fn every_step_is_found_within_bounds_near_cusps_too(
            a in prop::array::uniform2(-5.0..5.0), b in prop::array::uniform2(-5.0..5.0),
            c in prop::array::uniform2(-5.0..5.0), along in -1.0..2.0f64, exponent in -14.0..0.0f64,
            at in 0.0..1.0f64, share in 0.0..1.0f64, back in any::<bool>(),
        ) {
            let off = 10f64.powf(exponent);
            let middle = std::array::from_fn(|k| a[k] + along * (c[k] - a[k]) + off * b[k]);
            let piece = Quadratic::<2> { control: [a, middle, c], width: 3.0 };
            let f = QuadraticSpeed::new(&piece);
            let mut nodes = Vec::new();
            tabulate(f, 0.0, 3.0, 1e-13 * quadrature(&f, 0.0, 3.0), &mut nodes);
            let table = Table { f, nodes: &nodes };
            let from = (3.0 * at, table.integral(3.0 * at));
            let step = if back { -share * from.1 } else { share * (table.total() - from.1) };
            let tolerance = 1e-13 * table.total();
            let (located, sum) = advance(&table, from, step, tolerance);
            prop_assert!((sum - from.1 - step).abs() <= tolerance, "{located:?}");
            prop_assert!((located.u - from.0) * step >= 0.0 && (0.0..=3.0).contains(&located.u) && located.iterations <= 80, "{located:?}");
        }
    }
}
