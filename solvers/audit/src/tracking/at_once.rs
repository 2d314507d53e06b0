//! Finds the places of eight setpoints on one piece at once in SIMD vectors, by Newton's method. The results are those of a
//! search for each setpoint alone.

use fearless_simd::{f64x8, Select, Simd, SimdBase, SimdFloat, SimdMask};

use super::{beyond_last, MOST_GUESSES};
use crate::number::{in_wide_vectors, inner, Lanes};
use crate::together::Together;

/// Number of setpoints searched for at once.
pub const COUNT: usize = 8;

/// The place nearest to each setpoint, NaN where it is not found; the distance of the setpoint from it in mm; and |C'| there.
pub struct Nearest {
    pub u: Lanes,
    pub distance: Lanes,
    pub slope: Lanes,
}

/// The places nearest to setpoints at the positions `q`; the steps start from the places `u` of the piece.
pub fn nearest<const M: usize>(on: &Together<M>, u: &Lanes, q: &[Lanes; M], room: &mut [Lanes]) -> Nearest {
    in_wide_vectors!(simd => look(simd, on, (u, q), room))
}

#[inline(always)]
fn look<const M: usize, S: Simd>(
    simd: S,
    on: &Together<M>,
    (u, q): (&Lanes, &[Lanes; M]),
    room: &mut [Lanes],
) -> Nearest {
    let all = |x: f64| f64x8::splat(simd, x);
    let (nothing, width) = (all(0.0), all(on.curve.width()));
    let mut u = f64x8::from_slice(simd, u).max(nothing).min(width);
    let (mut place, mut distance_sq, mut slope) = (all(f64::NAN), nothing, nothing);
    let (mut is_found, mut positions) = (nothing.simd_gt(nothing), [nothing; M]);
    for k in 0..M {
        positions[k] = f64x8::from_slice(simd, &q[k]);
    }
    for _ in 0..MOST_GUESSES {
        let [away, tangent] = on.toward(u, &positions, room);
        let size_sq = inner(&tangent, &tangent);
        let (du, size) = (inner(&away, &tangent) / size_sq, size_sq.sqrt());
        let [by_length, by_error] = beyond_last(du, size, on.bend);
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
    use crate::columns::Columns;
    use crate::curve::{Curve, Followed, Pieces};
    use crate::joints::path::{JointPath, Words};
    use crate::polygon::Polygon;
    use crate::vectors::distance;
    use crate::Limits;
    use proptest::prelude::*;

    /// The result of `nearest` on one piece of axes, or of joints.
    fn found(control: &[f64], u: &Lanes, q: &[Lanes; 2], has_joints: bool) -> Nearest {
        let (degree, words, limits) = (control.len() / 2 - 1, Words::polar(), Limits::none());
        let (offsets, width) = ([0, degree + 1], [degree as f64]);
        let pieces = Pieces { axes: 2, stride: 2, control, weights: &[], offsets: &offsets, width: &width };
        let path = Followed::of_one(pieces);
        let joints = JointPath::of_one(path, &words, &[1.0]);
        let mut columns = Columns::new(&path, &limits, has_joints.then_some(&joints));
        let on = columns.together(0).expect("a piece without weights, in wide vectors");
        nearest(&on, u, q, &mut columns.room())
    }

    proptest! {
        #[test]
        fn the_place_of_a_point_beside_a_curve_is_found_from_one_near_by(
            bends in prop::array::uniform6(-0.3..0.3_f64), first in 0.5..3.0_f64, step in 0.01..0.2_f64, off in -1e-7..1e-7_f64,
        ) {
            let control: Vec<f64> = (0..6).flat_map(|i| [i as f64, bends[i]]).collect();
            let curve = Curve::new(Polygon::new((0..6).map(|i| [i as f64, bends[i]]), &[]), 5.0);
            let places: Lanes = std::array::from_fn(|i| first + step * i as f64);
            // Beside the curve; the search starts up to a tenth of a millimetre off.
            let beside = |u: f64| {
                let ([x, y], [dx, dy]) = (curve.at(u), curve.derivative(u));
                let size = dx.hypot(dy);
                [x - off * dy / size, y + off * dx / size]
            };
            let points = places.map(beside);
            let q = [0, 1].map(|k| points.map(|point| point[k]));
            let from: Lanes = std::array::from_fn(|i| places[i] + 0.1 * bends[i % 6]);
            let found = found(&control, &from, &q, false);
            for i in 0..COUNT {
                prop_assert!((found.u[i] - places[i]).abs() < 1e-9, "{} {}", found.u[i], places[i]);
                prop_assert!((found.distance[i] - off.abs()).abs() < 1e-9);
                prop_assert!(distance(&curve.at(found.u[i]), &points[i]) <= found.distance[i] + 1e-9);
            }
        }

        /// Around the origin, so that the angle passes 180 degrees; setpoints may have it plus any number of whole turns.
        #[test]
        fn the_place_of_joints_is_found_from_one_near_by(
            bends in prop::array::uniform6(-0.3..0.3_f64), first in 0.5..3.0_f64, step in 0.01..0.2_f64, turns in -3..4_i32,
        ) {
            let point = |i: usize| [-3.0, 2.5 - i as f64 + bends[i]];
            let control: Vec<f64> = (0..6).flat_map(point).collect();
            let curve = Curve::new(Polygon::new((0..6).map(point), &[]), 5.0);
            let places: Lanes = std::array::from_fn(|i| first + step * i as f64);
            let joints = places.map(|u| {
                let [x, y] = curve.at(u);
                [x.hypot(y), y.atan2(x).to_degrees() + 360.0 * f64::from(turns)]
            });
            let q = [0, 1].map(|k| joints.map(|joint| joint[k]));
            let from: Lanes = std::array::from_fn(|i| places[i] + 0.1 * bends[i % 6]);
            let found = found(&control, &from, &q, true);
            for i in 0..COUNT {
                prop_assert!((found.u[i] - places[i]).abs() < 1e-9, "{} {}", found.u[i], places[i]);
                prop_assert!(found.distance[i] < 1e-9);
            }
        }
    }

    #[test]
    fn a_place_beyond_the_end_is_told_as_such_and_none_is_found_where_the_curve_stands_still() {
        let q = [[0.5, 1.5, 2.5, 1.0, 1.0, 1.0, 1.0, 1.0], [0.0; COUNT]];
        let line = [0.0, 0.0, 1.0, 0.0, 2.0, 0.0];
        assert_eq!(found(&line, &[1.9; COUNT], &q, false).u[..3], [0.5, 1.5, 2.5]);
        let point = [1.0, 0.0, 1.0, 0.0];
        assert!(found(&point, &[0.5; COUNT], &q, false).u.iter().all(|u| u.is_nan()));
    }
}
