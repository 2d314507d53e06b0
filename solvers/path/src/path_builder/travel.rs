//! The first place of a path that an axis cannot reach.

use rayon::prelude::*;

use super::Part;
use crate::follow::{Moves, Shape};
use feedplan_geometry::spline::{bezier, CompositeCurve, Piece};

/// Halvings of a piece of a spline; the hull comes nearer to the curve by a factor of four each time.
const DEPTH: u32 = 26;

/// A position that an axis cannot reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    pub index: usize,
    pub axis: usize,
    pub position: f64,
}

/// The first position outside the travel: of the moves as programmed, and of the path, whose arcs may be as far
/// beyond as they deviate.
pub fn outside<const M: usize>(
    parts: &[Part<M>],
    moves: &Moves<M>,
    travel: &[[f64; 2]; M],
) -> Option<Outside> {
    // Positions come from sums of offsets; a nanometre more is no fault.
    const SLACK: f64 = 1e-6;
    if travel.iter().flatten().all(|limit| limit.is_infinite()) {
        return None;
    }
    let beyond = |index: usize, axis: usize, (least, greatest): (f64, f64), bulge: f64| {
        let [low, high] = travel[axis];
        let slack = SLACK + bulge;
        if least < low - slack {
            Some(Outside { index, axis, position: least })
        } else if greatest > high + slack {
            Some(Outside { index, axis, position: greatest })
        } else {
            None
        }
    };
    // Only joints have a travel.
    let judged = |index: usize| moves.joints[index];
    let targets = moves.target.par_iter().enumerate().find_map_first(|(index, target)| {
        if !judged(index) {
            return None;
        }
        (0..M).find_map(|axis| beyond(index, axis, (target[axis], target[axis]), 0.0))
    });
    let arcs = moves.arcs.par_iter().find_map_first(|&(index, shape)| {
        if !judged(index) {
            return None;
        }
        shape.plane.iter().find_map(|&axis| beyond(index, axis, moves.arc_extent(index, axis)?, 0.0))
    });
    let curves = parts.par_iter().find_map_first(|part| {
        part.pieces.iter().find_map(|followed| {
            let bulge = if followed.arc { followed.deviation } else { 0.0 };
            let index = followed.first as usize;
            if !judged(index) {
                return None;
            }
            (0..M).find_map(|axis| match &followed.piece {
                Shape::Conic(conic) => beyond(index, axis, conic.extent(axis), bulge),
                Shape::Spline(spline) => {
                    let [low, high] = travel[axis];
                    let piece = part.spline(spline, moves.splines);
                    let position = beyond_hull(&piece, axis, low - SLACK, high + SLACK, DEPTH)?;
                    Some(Outside { index, axis, position })
                }
            })
        })
    });
    [targets, arcs, curves].into_iter().flatten().min_by_key(|place| place.index)
}

/// A value of an axis on a piece below `low` or above `high`. The control points enclose the piece; where they are
/// beyond and its ends are not, its halves are looked at.
fn beyond_hull<const M: usize>(
    piece: &Piece<M>,
    axis: usize,
    low: f64,
    high: f64,
    depth: u32,
) -> Option<f64> {
    let outside = |value: f64| value < low || value > high;
    if !piece.control.iter().any(|point| outside(point[axis])) {
        return None;
    }
    let ends = [piece.control[0][axis], piece.control[piece.degree()][axis]];
    if let Some(end) = ends.into_iter().find(|&end| outside(end)) {
        return Some(end);
    }
    if depth == 0 {
        return None;
    }
    let mut halves = CompositeCurve::default();
    bezier::split(piece, &[0.5 * piece.width], &mut halves);
    (0..2).find_map(|i| beyond_hull(&halves.piece(i), axis, low, high, depth - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_beyond_the_limit_is_halved_until_the_curve_says() {
        // The polygons reach 2, the parabola 1 of it and the conic w/(1 + w) of it.
        let mut curve = CompositeCurve::<1>::default();
        curve.push(&[[0.0], [2.0], [0.0]], &[], 1.0);
        let parabola = curve.clone();
        bezier::elevate(&parabola.piece(0), 1, &mut curve);
        curve.push(&[[0.0], [2.0], [0.0]], &[1.0, 3.0, 1.0], 1.0);
        for (piece, apex) in curve.pieces().zip([1.0, 1.0, 1.5]) {
            assert_eq!(beyond_hull(&piece, 0, -0.1, apex + 1e-9, DEPTH), None);
            let found = beyond_hull(&piece, 0, -0.1, apex - 1e-9, DEPTH).unwrap();
            assert!(found > apex - 1e-9 && found <= apex);
            assert_eq!(beyond_hull(&piece, 0, 0.1, 2.0, DEPTH), Some(0.0));
        }
    }
}
