//! Finds the parameter u at a given length S from a table of lengths. A monotone rational cubic on the panel predicts u, and is
//! applied again on shrinking brackets. Where a bound of |S''| is known, the last Newton step needs no further integral: S
//! differs from its tangent by at most half of that bound times the square of the step.
//!
//! Source: Cheatham 2007, sections 3.2.3 and 3.2.4 (equations 3.11–3.14), after Sarfraz. S may be the integral of any
//! `Table`, S' its integrand; d = 1/S' is the slope of u(S).

use crate::arc_length::{quadrature, quadrature_of_part, Integrand, Node, Table, SEVEN_NODES};

/// The greatest number of rounds. Each round makes the error of S four times smaller, or the next one halves the bracket, so
/// fewer are needed to get from the width of a panel to the last digit of u.
pub const MAX_ITERATIONS: u32 = 200;

/// A parameter and how it was found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Located {
    pub u: f64,
    /// The remaining error |S(u) − S|, in the unit of S.
    pub miss: f64,
    /// The number of evaluations of S(u): 1 when the prediction was good enough, 0 at the ends.
    pub iterations: u32,
}

/// The value of Sarfraz's curve u(S) between two rows; NaN or the u of a row if S' is 0 at a row.
///
/// Over the common denominator the terms of (3.12) are d₀ΔS θ(1−θ) + Δu θ³. Written with S' instead of d = 1/S' it takes one
/// division. All terms are positive, so no digits cancel.
#[inline]
pub fn predict(from: &Node, to: &Node, s: f64) -> f64 {
    let (width, rise) = (to.u - from.u, to.sum - from.sum);
    let theta = (s - from.sum) / rise;
    let mixed = theta * (1.0 - theta);
    let all = from.rate * to.rate * width;
    // θ³ + (1−θ)³ = 1 − 3 θ(1−θ).
    let below = all + ((from.rate + to.rate) * rise - 3.0 * all) * mixed;
    from.u + width * (to.rate * rise * mixed + all * theta * theta * theta) / below
}

/// The u with S(u) = s within `tolerance`; beyond an end of the table that end. `known` has further rows, which may narrow the
/// bracket on both sides. `steepest` is an upper bound of |S''|; infinite if none is known.
pub fn locate<F: Integrand>(
    table: &Table<F>,
    s: f64,
    tolerance: f64,
    known: &[Node],
    steepest: f64,
) -> Located {
    let first = table.panel(|node| node.sum <= s);
    let start = table.nodes[first];
    let (mut low, mut high) = (start, table.nodes[first + 1]);
    let panel = high.u - low.u;
    for row in known {
        if low.sum < row.sum && row.sum <= s {
            low = *row;
        } else if s <= row.sum && row.sum < high.sum {
            high = *row;
        }
    }
    if s <= low.sum {
        return Located { u: low.u, ..Located::default() };
    }
    if s >= high.sum {
        return Located { u: high.u, ..Located::default() };
    }
    let (mut best, mut halve, mut last_miss) = (Located::default(), false, f64::INFINITY);
    for iterations in 1..=MAX_ITERATIONS {
        let middle = 0.5 * (low.u + high.u);
        let mut u = if halve { middle } else { predict(&low, &high, s) };
        // Next to a cusp, and in a bracket of a few roundings, the prediction may be outside.
        if !(low.u < u && u < high.u) {
            u = middle;
        }
        // The integral from the nearer end of the bracket if that is near, otherwise from the start of the panel.
        let near = if u - low.u < high.u - u { low } else { high };
        let (sum, rate) = if (u - near.u).abs() <= SEVEN_NODES * panel {
            let [way, rate] = quadrature_of_part(&table.f, near.u, u, panel);
            (near.sum + way, Some(rate))
        } else {
            (start.sum + quadrature(&table.f, start.u, u), None)
        };
        let miss = (sum - s).abs();
        best = if miss < last_miss || iterations == 1 { Located { u, miss, iterations } } else { best };
        best.iterations = iterations;
        if miss <= tolerance || !(low.u < middle && middle < high.u) {
            break;
        }
        let before = high.u - low.u;
        let row = Node { u, sum, rate: rate.unwrap_or_else(|| table.f.at(u)) };
        let step = (s - sum) / row.rate;
        let (next, after) = (u + step, 0.5 * steepest * step * step);
        if after <= tolerance && low.u <= next && next <= high.u {
            return Located { u: next, miss: after, iterations };
        }
        if sum > s {
            high = row;
        } else {
            low = row;
        }
        halve = miss > 0.25 * last_miss && high.u - low.u > 0.5 * before;
        last_miss = miss.min(last_miss);
    }
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::arc_length::{tabulate, QuadraticSpeed};
    use crate::quadratic::{norm, Quadratic};

    fn row(u: f64, sum: f64, rate: f64) -> Node {
        Node { u, sum, rate }
    }

    #[test]
    fn equal_slopes_give_the_straight_line() {
        let (from, to) = (row(1.0, 0.0, 2.0), row(3.0, 4.0, 2.0));
        for s in [0.0, 1.0, 2.5, 4.0] {
            assert!((predict(&from, &to, s) - (1.0 + s / 2.0)).abs() < 1e-15);
        }
    }

    #[test]
    fn the_curve_has_the_given_ends_and_slopes() {
        let (from, to) = (row(0.0, 0.0, 0.5), row(1.0, 2.0, 4.0));
        let step = 1e-7;
        assert_eq!((predict(&from, &to, 0.0), predict(&from, &to, 2.0)), (0.0, 1.0));
        assert!((predict(&from, &to, step) / step - 2.0).abs() < 1e-5);
        assert!(((1.0 - predict(&from, &to, 2.0 - step)) / step - 0.25).abs() < 1e-5);
    }

    #[test]
    fn one_prediction_is_enough_on_a_line() {
        let line = Quadratic::line([0.0, 0.0], [3.0, 4.0]);
        let mut nodes = Vec::new();
        let f = QuadraticSpeed::new(&line);
        tabulate(f, 0.0, 5.0, 1e-12, &mut nodes);
        let located = locate(&Table { f, nodes: &nodes }, 1.25, 1e-12, &[], 0.0);
        assert_eq!(located.iterations, 1);
        assert!((located.u - 1.25).abs() < 1e-14);
    }

    #[test]
    fn rows_beside_those_of_the_table_lead_to_the_same_place_sooner() {
        let piece = Quadratic::<2> { control: [[0.0, 0.0], [0.5, 0.0], [1.0, 0.5]], width: 1.0 };
        let (f, mut nodes) = (QuadraticSpeed::new(&piece), Vec::new());
        tabulate(f, 0.0, 1.0, 1e-13, &mut nodes);
        let table = Table { f, nodes: &nodes };
        let known = [0.3, 0.32].map(|u| row(u, table.integral(u), f.at(u)));
        for u in [0.305, 0.31, 0.319] {
            let [alone, beside] =
                [&[][..], &known].map(|known| locate(&table, table.integral(u), 1e-9, known, f64::INFINITY));
            assert!((beside.u - u).abs() < 1e-9, "{beside:?}");
            assert!(beside.iterations < alone.iterations, "{alone:?} {beside:?}");
        }
        // A row that does not lie between them.
        assert!((locate(&table, table.integral(0.6), 1e-13, &known, f64::INFINITY).u - 0.6).abs() < 1e-12);
    }

    #[test]
    fn a_last_step_of_newtons_method_needs_no_further_integral() {
        let piece = Quadratic::<2> { control: [[0.0, 0.0], [0.5, 0.0], [1.0, 0.5]], width: 1.0 };
        let (f, mut nodes) = (QuadraticSpeed::new(&piece), Vec::new());
        tabulate(f, 0.0, 1.0, 1e-13, &mut nodes);
        let table = Table { f, nodes: &nodes };
        let known = [0.3, 0.32].map(|u| row(u, table.integral(u), f.at(u)));
        let [slow, fast] =
            [f64::INFINITY, 1.0].map(|most| locate(&table, table.integral(0.307), 1e-15, &known, most));
        assert!((slow.u - 0.307).abs() < 2e-15 && (fast.u - 0.307).abs() < 2e-15, "{slow:?} {fast:?}");
        assert!(fast.iterations < slow.iterations, "{slow:?} {fast:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn the_prediction_never_turns_back(
            rates in prop::array::uniform2(-6.0..6.0f64), width in 0.01..10.0f64, rise in 0.01..10.0f64
        ) {
            let from = row(0.0, 0.0, 10f64.powf(rates[0]));
            let to = row(width, rise, 10f64.powf(rates[1]));
            let mut last = 0.0;
            for i in 1..=200 {
                let u = predict(&from, &to, rise * (i as f64 / 200.0));
                prop_assert!(u >= last * (1.0 - 1e-15) && u <= width * (1.0 + 1e-15));
                last = u;
            }
        }

        #[test]
        fn every_length_is_found_in_few_rounds_near_cusps_too(
            a in prop::array::uniform2(-5.0..5.0), b in prop::array::uniform2(-5.0..5.0),
            c in prop::array::uniform2(-5.0..5.0), along in -1.0..2.0f64, exponent in -14.0..0.0f64,
            at in 0.0..1.0f64,
        ) {
            let off = 10f64.powf(exponent);
            let middle = std::array::from_fn(|k| a[k] + along * (c[k] - a[k]) + off * b[k]);
            let piece = Quadratic::<2> { control: [a, middle, c], width: 3.0 };
            let f = QuadraticSpeed::new(&piece);
            let mut nodes = Vec::new();
            tabulate(f, 0.0, 3.0, 1e-13 * quadrature(&f, 0.0, 3.0), &mut nodes);
            let table = Table { f, nodes: &nodes };
            let (s, tolerance) = (at * table.total(), 1e-13 * table.total());
            let bend: [f64; 2] = std::array::from_fn(|k| a[k] - 2.0 * middle[k] + c[k]);
            let steepest = 2.0 / 9.0 * norm(&bend);
            for steepest in [steepest, f64::INFINITY] {
                let located = locate(&table, s, tolerance, &[], steepest);
                prop_assert!(located.miss <= tolerance, "{located:?}");
                prop_assert!((table.integral(located.u) - s).abs() <= 2.0 * tolerance);
                prop_assert!(located.iterations <= 30, "{located:?}");
            }
        }
    }
}
