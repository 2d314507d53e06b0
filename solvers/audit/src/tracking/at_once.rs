//! The places of several setpoints on one piece, eight at once, in the vectors of the processor, by Newton's method. Each is found as it
//! would be alone.

use fearless_simd::{dispatch, f64x8, Level, Select, Simd, SimdBase, SimdFloat, SimdMask};

use super::{beyond_last, MOST_GUESSES};
use crate::curve::Curve;
use crate::number::inner;

/// Setpoints that are looked for at once.
pub const COUNT: usize = 8;

/// A number of each of them.
type Lanes = [f64; COUNT];

/// The place nearest to each setpoint, not a number where that is not found; the setpoint's distance from it; and |C'| there.
pub struct Nearest {
    pub u: Lanes,
    pub distance: Lanes,
    pub slope: Lanes,
}

/// From these places of a piece without weights, for setpoints at these positions.
pub fn nearest<const M: usize>(curve: &Curve<M>, u: &Lanes, q: &[Lanes; M]) -> Nearest {
    dispatch!(Level::new(), simd => look(simd, curve, u, q))
}

#[inline(always)]
fn look<const M: usize, S: Simd>(simd: S, curve: &Curve<M>, u: &Lanes, q: &[Lanes; M]) -> Nearest {
    let all = |x: f64| f64x8::splat(simd, x);
    let (nothing, width, bend) = (all(0.0), all(curve.width()), curve.bounds()[0]);
    let mut u = f64x8::from_slice(simd, u).max(nothing).min(width);
    let (mut place, mut distance_sq, mut slope) = (all(f64::NAN), nothing, nothing);
    let mut is_found = nothing.simd_gt(nothing);
    for _ in 0..MOST_GUESSES {
        let [point, tangent] = curve.polynomial_place(u);
        let mut away = point;
        for k in 0..M {
            away[k] = f64x8::from_slice(simd, &q[k]) - point[k];
        }
        let size_sq = inner(&tangent, &tangent);
        let (du, size) = (inner(&away, &tangent) / size_sq, size_sq.sqrt());
        let [by_length, by_error] = beyond_last(du, size, bend);
        let is_new = (by_length.simd_le(nothing) | by_error.simd_le(nothing)) & !is_found;
        place = is_new.select(u + du, place);
        distance_sq = is_new.select(inner(&away, &away) - du * size * (du * size), distance_sq);
        slope = is_new.select(size, slope);
        is_found |= is_new;
        if is_found.to_bitmask() == (1 << COUNT) - 1 {
            break;
        }
        u = (u + du).max(nothing).min(width);
    }
    Nearest { u: place.into(), distance: distance_sq.max(nothing).sqrt().into(), slope: slope.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::Polygon;
    use crate::vectors::distance;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_place_of_a_point_beside_a_curve_is_found_from_one_near_by(
            bends in prop::array::uniform6(-0.3..0.3_f64), first in 0.5..3.0_f64, step in 0.01..0.2_f64, off in -1e-7..1e-7_f64,
        ) {
            let points = (0..6).map(|i| [i as f64, bends[i]]);
            let curve = Curve::new(Polygon::new(points, &[]), 5.0);
            let places: Lanes = std::array::from_fn(|i| first + step * i as f64);
            // Beside the curve, and from places that are off by up to a tenth.
            let beside = |u: f64| {
                let ([x, y], [dx, dy]) = (curve.at(u), curve.derivative(u));
                let size = dx.hypot(dy);
                [x - off * dy / size, y + off * dx / size]
            };
            let points = places.map(beside);
            let q = [0, 1].map(|k| points.map(|point| point[k]));
            let from: Lanes = std::array::from_fn(|i| places[i] + 0.1 * bends[i % 6]);
            let found = nearest(&curve, &from, &q);
            for i in 0..COUNT {
                prop_assert!((found.u[i] - places[i]).abs() < 1e-9, "{} {}", found.u[i], places[i]);
                prop_assert!((found.distance[i] - off.abs()).abs() < 1e-9);
                prop_assert!(distance(&curve.at(found.u[i]), &points[i]) <= found.distance[i] + 1e-9);
            }
        }
    }

    #[test]
    fn a_place_beyond_the_end_is_told_as_such_and_none_is_found_where_the_curve_stands_still() {
        let line = Curve::new(Polygon::new([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]].into_iter(), &[]), 2.0);
        let q = [[0.5, 1.5, 2.5, 1.0, 1.0, 1.0, 1.0, 1.0], [0.0; COUNT]];
        assert_eq!(nearest(&line, &[1.9; COUNT], &q).u[..3], [0.5, 1.5, 2.5]);
        let point = Curve::new(Polygon::new([[1.0, 0.0], [1.0, 0.0]].into_iter(), &[]), 1.0);
        assert!(nearest(&point, &[0.5; COUNT], &q).u.iter().all(|u| u.is_nan()));
    }
}
