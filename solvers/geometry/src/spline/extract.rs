//! The Bézier pieces of a B-spline or NURBS, one per span, in linear time.
//!
//! With the blossom f of a span [a, b] the Bézier points are f(aᵈ⁻ʳ, bʳ). Two triangles of corner cutting compute them from the
//! d + 1 control points of the span: de Boor's triangle at a gives f(aᵈ⁻ʲ, t_{k+1}, …, t_{k+j}), and the second triangle replaces
//! the later knots by b.

use super::knots::Spline;
use super::rational::cut_corners;
use super::{CompositeCurve, MAX_DEGREE};
use crate::quadratic::{norm, sub};
use crate::tolerance::COINCIDENT;

/// The pieces of a spline, one for each span that is not empty, with the width of the span. If the curve has a gap, the error is
/// a sentence about it.
pub fn extract<const M: usize>(spline: &Spline<M>) -> Result<CompositeCurve<M>, String> {
    let (d, t) = (spline.degree, &spline.knots);
    let mut curve = CompositeCurve::default();
    let mut previous: Option<usize> = None;
    for k in d..spline.control.len() {
        if t[k] == t[k + 1] {
            continue;
        }
        let mut points = [[0.0; M]; MAX_DEGREE + 1];
        let mut weights = [0.0; MAX_DEGREE + 1];
        let rational = !spline.weights.is_empty();
        points[..=d].copy_from_slice(&spline.control[k - d..=k]);
        if rational {
            weights[..=d].copy_from_slice(&spline.weights[k - d..=k]);
        }
        let weights = if rational { &mut weights[..=d] } else { &mut [] };
        bezier_points(&t[k + 1 - d..=k + d], &mut points[..=d], weights);

        if let Some(before) = previous {
            let last = curve.control[curve.control.len() - 1];
            let size = last.iter().chain(&points[0]).fold(0.0, |size: f64, x| size.max(x.abs()));
            let gap = norm(&sub(&points[0], &last));
            if k - before == d + 1 && gap > COINCIDENT * size {
                return Err(format!(
                    "the curve has a gap of {gap} mm at the knot {} (knot {}), which stands {} times: at most {d} times \
                     keep it together; give it as two curves",
                    t[k],
                    before + 1,
                    d + 1
                ));
            }
            // Both spans give the point where they meet, up to rounding: the point of the first one is used.
            points[0] = last;
        }
        curve.push(&points[..=d], weights, t[k + 1] - t[k]);
        previous = Some(k);
    }
    Ok(curve)
}

/// Replaces d + 1 control points by the Bézier points of the span in the middle of their 2d inner knots.
fn bezier_points<const M: usize>(knots: &[f64], points: &mut [[f64; M]], weights: &mut [f64]) {
    let d = points.len() - 1;
    let (a, b) = (knots[d - 1], knots[d]);
    // Each level has one point fewer and leaves the last one unchanged: f(aᵈ⁻ʲ, t_{k+1}, …, t_{k+j}) at j.
    for r in 1..=d {
        cut_corners(points, weights, d + 1 - r, |p| {
            (a - knots[p + r - 1]) / (knots[p + d] - knots[p + r - 1])
        });
    }
    // From the other end, so that each level leaves the first one unchanged: f(aᵈ⁻ʳ, bʳ).
    points.reverse();
    weights.reverse();
    for r in 1..=d {
        cut_corners(points, weights, d + 1 - r, |p| {
            let later = knots[2 * d - r - p];
            (later - b) / (later - a)
        });
    }
    points.reverse();
    weights.reverse();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::bezier::point;
    use proptest::prelude::*;

    /// De Boor's recurrence, directly from the definition of the basis functions.
    fn basis(t: &[f64], i: usize, d: usize, x: f64) -> f64 {
        if d == 0 {
            return f64::from(u8::from(t[i] <= x && x < t[i + 1]));
        }
        let part = |width: f64, value: f64| if width > 0.0 { value / width } else { 0.0 };
        part(t[i + d] - t[i], (x - t[i]) * basis(t, i, d - 1, x))
            + part(t[i + d + 1] - t[i + 1], (t[i + d + 1] - x) * basis(t, i + 1, d - 1, x))
    }

    #[test]
    fn the_pieces_of_a_uniform_quadratic_by_hand() {
        let control = vec![[0.0], [2.0], [4.0], [0.0]];
        let spline = Spline::new(2, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], control, vec![]).unwrap();
        let curve = extract(&spline).unwrap();
        assert_eq!(curve.control, [[1.0], [2.0], [3.0], [3.0], [4.0], [2.0]]);
        assert_eq!((curve.offsets, curve.width), (vec![0, 3, 6], vec![1.0, 1.0]));
    }

    #[test]
    fn a_bezier_curve_is_its_own_piece() {
        let control = vec![[3000.1, 0.3], [3000.2, 0.7], [3000.4, 0.1], [3000.3, -0.2]];
        let spline = Spline::new(3, [[0.0; 4], [0.7; 4]].concat(), control.clone(), vec![1.0, 0.3, 7.0, 2.0]);
        let curve = extract(&spline.unwrap()).unwrap();
        assert_eq!((curve.control, curve.weights), (control, vec![1.0, 0.3, 7.0, 2.0]));
    }

    #[test]
    fn a_curve_that_falls_apart_is_refused() {
        let knots = vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0];
        let apart = vec![[0.0], [1.0], [4.0], [5.0]];
        let error = extract(&Spline::new(1, knots.clone(), apart, vec![]).unwrap()).unwrap_err();
        assert_eq!(
            error,
            "the curve has a gap of 3 mm at the knot 1 (knot 2), which stands 2 times: at most 1 times keep it \
             together; give it as two curves"
        );
        let together = vec![[0.0], [1.0], [1.0], [5.0]];
        let curve = extract(&Spline::new(1, knots, together, vec![]).unwrap()).unwrap();
        assert_eq!(curve.control, [[0.0], [1.0], [1.0], [5.0]]);
    }

    fn splines() -> impl Strategy<Value = Spline<2>> {
        (1..=9usize, 1..12usize, any::<bool>()).prop_flat_map(|(d, more, rational)| {
            let n = d + more;
            (
                prop::collection::vec(prop_oneof![Just(0.0), 0.1..2.0f64], n + d + 1),
                prop::collection::vec(prop::array::uniform2(-10.0..10.0f64), n),
                prop::collection::vec(0.1..10.0f64, if rational { n } else { 0 }),
            )
                .prop_filter_map(
                    "a spline that holds together",
                    move |(steps, control, weights)| {
                        let mut sum = 0.0;
                        let knots = steps
                            .iter()
                            .map(|step| {
                                sum += step;
                                sum
                            })
                            .collect();
                        Spline::new(d, knots, control, weights).ok().filter(|spline| extract(spline).is_ok())
                    },
                )
        })
    }

    proptest! {
        #[test]
        fn pieces_have_the_values_of_the_spline(spline in splines(), at in 0.0..1.0f64) {
            let curve = extract(&spline).unwrap();
            let mut start = spline.knots[spline.degree];
            for piece in curve.pieces() {
                let x = start + at * piece.width;
                let mut expected = [0.0; 3];
                for (i, point) in spline.control.iter().enumerate() {
                    let share = basis(&spline.knots, i, spline.degree, x)
                        * spline.weights.get(i).copied().unwrap_or(1.0);
                    for (sum, value) in expected.iter_mut().zip([point[0], point[1], 1.0]) {
                        *sum += share * value;
                    }
                }
                let found = point(&piece, at * piece.width);
                for axis in 0..2 {
                    prop_assert!((found[axis] - expected[axis] / expected[2]).abs() < 1e-11);
                }
                start += piece.width;
            }
            let end = spline.knots[spline.control.len()];
            prop_assert!((start - end).abs() < 1e-12 * start.abs().max(1.0));
        }
    }
}
