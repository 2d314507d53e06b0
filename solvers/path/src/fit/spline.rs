//! The C1 quadratic B-spline through feature points, from one tridiagonal system (Zhang et al. 2010, section 3.3).
//!
//! The features F_j have the parameters t_j with steps h_j = |F_{j+1} − F_j|, so that |C'| is near 1. A knot is in the middle of
//! each step. The unknowns are the slopes s_j = C'(knot j). C' is linear between knots, so the tangent at a feature is
//! m_j = (h_j s_{j−1} + h_{j−1} s_j)/(h_{j−1} + h_j), and the integral of C' over step j gives
//!
//! ```text
//! m_j + 2 s_j + m_{j+1} = 4 (F_{j+1} − F_j)/h_j
//! ```
//!
//! This system is tridiagonal in s with the diagonal 2 + (1 − a) + (1 − c) and off-diagonals a, c in [0, 1]. It is diagonally
//! dominant for any spacing, which the system in control points is not. At a free end the knot next to it is left out: its slope
//! is that of the chord. So three features with two free ends give the Bézier curve of Algorithm 1.

use feedplan_geometry::quadratic::{norm, sub};

/// The tangent of the spline at one of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EndCondition<const M: usize> {
    /// No tangent is given.
    Free,
    /// The given C'.
    Tangent([f64; M]),
}

/// C' at the features (`tangent`) and at the knots between them (`slope`); `step[j]` is the parameter interval from feature
/// j to feature j + 1.
pub struct Spline<const M: usize> {
    pub step: Vec<f64>,
    pub slope: Vec<[f64; M]>,
    pub tangent: Vec<[f64; M]>,
}

/// The spline through `features`, at least two.
pub fn interpolate<const M: usize>(
    features: &[[f64; M]],
    start: EndCondition<M>,
    finish: EndCondition<M>,
) -> Spline<M> {
    let count = features.len() - 1;
    let h: Vec<f64> = features
        .windows(2)
        // Features at the same place need a positive step too; the certificate asks for points between them later.
        .map(|f| norm(&sub(&f[1], &f[0])).max(f64::MIN_POSITIVE * 1e10))
        .collect();
    let chord: Vec<[f64; M]> =
        features.windows(2).zip(&h).map(|(f, h)| std::array::from_fn(|k| (f[1][k] - f[0][k]) / h)).collect();
    let before = |j: usize| h[j] / (h[j - 1] + h[j]);
    let after = |j: usize| h[j] / (h[j] + h[j + 1]);

    // Elimination: row j becomes s_j + upper_j s_{j+1} = slope_j.
    let mut upper = vec![0.0; count];
    let mut slope = chord.clone();
    for j in 0..count {
        let free =
            (j == 0 && start == EndCondition::Free) || (j + 1 == count && finish == EndCondition::Free);
        if free {
            continue;
        }
        let mut diagonal = 2.0;
        let mut right: [f64; M] = std::array::from_fn(|k| 4.0 * chord[j][k]);
        if j > 0 {
            let lower = before(j);
            diagonal += 1.0 - lower - lower * upper[j - 1];
            right = std::array::from_fn(|k| right[k] - lower * slope[j - 1][k]);
        } else if let EndCondition::Tangent(tangent) = start {
            right = std::array::from_fn(|k| right[k] - tangent[k]);
        }
        if j + 1 < count {
            upper[j] = after(j);
            diagonal += 1.0 - upper[j];
        } else if let EndCondition::Tangent(tangent) = finish {
            right = std::array::from_fn(|k| right[k] - tangent[k]);
        }
        upper[j] /= diagonal;
        slope[j] = std::array::from_fn(|k| right[k] / diagonal);
    }
    // Back substitution.
    for j in (0..count.saturating_sub(1)).rev() {
        slope[j] = std::array::from_fn(|k| slope[j][k] - upper[j] * slope[j + 1][k]);
    }

    let mut tangent = Vec::with_capacity(count + 1);
    tangent.push(match (start, finish) {
        (EndCondition::Tangent(tangent), _) => tangent,
        (EndCondition::Free, _) if count > 1 => extrapolate(&slope[0], &slope[1], after(0)),
        (EndCondition::Free, EndCondition::Tangent(other)) => extrapolate(&slope[0], &other, 1.0),
        (EndCondition::Free, EndCondition::Free) => slope[0],
    });
    tangent.extend((1..count).map(|j| {
        std::array::from_fn(|k| (h[j] * slope[j - 1][k] + h[j - 1] * slope[j][k]) / (h[j - 1] + h[j]))
    }));
    tangent.push(match (start, finish) {
        (_, EndCondition::Tangent(tangent)) => tangent,
        (_, EndCondition::Free) if count > 1 => {
            extrapolate(&slope[count - 1], &slope[count - 2], before(count - 1))
        }
        (EndCondition::Tangent(other), EndCondition::Free) => extrapolate(&slope[0], &other, 1.0),
        (EndCondition::Free, EndCondition::Free) => slope[0],
    });
    Spline { step: h, slope, tangent }
}

/// The line through `far` and `near`, extended beyond `near` by `by` times their distance.
fn extrapolate<const M: usize>(near: &[f64; M], far: &[f64; M], by: f64) -> [f64; M] {
    std::array::from_fn(|k| near[k] + by * (near[k] - far[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close<const M: usize>(a: &[f64; M], b: &[f64; M]) -> bool {
        norm(&sub(a, b)) < 1e-12
    }

    #[test]
    fn two_points_give_a_line() {
        let spline = interpolate(&[[1.0, 1.0], [4.0, 5.0]], EndCondition::Free, EndCondition::Free);
        assert_eq!(spline.step, [5.0]);
        assert_eq!(spline.slope, [[0.6, 0.8]]);
        assert_eq!(spline.tangent, [[0.6, 0.8]; 2]);
    }

    #[test]
    fn three_points_give_the_bezier_curve_of_algorithm_1() {
        // Through (0, 0), (3, 4), (8, 4): u1 = 1/2, so Q1 = 2 (3, 4) − ((0, 0) + (8, 4))/2 = (2, 6), on [0,
        // 10].
        let spline =
            interpolate(&[[0.0, 0.0], [3.0, 4.0], [8.0, 4.0]], EndCondition::Free, EndCondition::Free);
        assert!(close(&spline.tangent[0], &[2.0 * 2.0 / 10.0, 2.0 * 6.0 / 10.0]));
        assert!(close(&spline.tangent[2], &[2.0 * 6.0 / 10.0, -2.0 * 2.0 / 10.0]));
    }

    #[test]
    fn one_step_takes_one_free_tangent_from_the_other() {
        let spline =
            interpolate(&[[0.0, 0.0], [2.0, 0.0]], EndCondition::Tangent([1.0, 0.5]), EndCondition::Free);
        assert!(close(&spline.slope[0], &[1.0, 0.0]));
        assert!(close(&spline.tangent[1], &[1.0, -0.5]));
        let spline =
            interpolate(&[[0.0, 0.0], [2.0, 0.0]], EndCondition::Free, EndCondition::Tangent([1.0, -0.5]));
        assert!(close(&spline.tangent[0], &[1.0, 0.5]));
    }

    #[test]
    fn tangents_of_a_circle_are_found_to_third_order() {
        let error = |count: usize| {
            let turn = |i: usize| std::f64::consts::PI * i as f64 / count as f64;
            let points: Vec<[f64; 2]> = (0..=count).map(|i| [turn(i).cos(), turn(i).sin()]).collect();
            let spline =
                interpolate(&points, EndCondition::Tangent([0.0, 1.0]), EndCondition::Tangent([0.0, -1.0]));
            let middle = count / 2;
            let [x, y] = spline.tangent[middle];
            // By symmetry the direction of the tangent at the top is (−1, 0); its length shows the error.
            assert!(y.abs() < 1e-12);
            (x + 1.0).abs()
        };
        assert!(error(16) < 0.01 && error(32) < error(16) / 3.5, "{} {}", error(16), error(32));
    }

    proptest! {
        #[test]
        fn the_spline_meets_every_point_at_any_spacing(
            steps in proptest::collection::vec((-6.0..2.0_f64, -3.0..3.0_f64), 1..30),
            ends in (any::<bool>(), any::<bool>()),
        ) {
            let mut points = vec![[0.0, 0.0]];
            for (size, angle) in steps {
                let [x, y] = points[points.len() - 1];
                let size = 10.0_f64.powf(size);
                points.push([x + size * angle.cos(), y + size * angle.sin()]);
            }
            let end = |given: bool, tangent| if given { EndCondition::Tangent(tangent) } else { EndCondition::Free };
            let Spline { step, slope, tangent } =
                interpolate(&points, end(ends.0, [1.0, 0.0]), end(ends.1, [0.0, 1.0]));
            for j in 0..step.len() {
                let [m0, s, m1] = [tangent[j], slope[j], tangent[j + 1]];
                let travel: [f64; 2] = std::array::from_fn(|k| (m0[k] + 2.0 * s[k] + m1[k]) * step[j] / 4.0);
                let size = norm(&m0) + norm(&s) + norm(&m1);
                let gap = norm(&sub(&travel, &sub(&points[j + 1], &points[j])));
                prop_assert!(gap <= 1e-12 * size * step[j].max(1e-3), "step {}: {}", j, gap);
            }
        }
    }
}
