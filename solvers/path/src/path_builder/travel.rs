//! Finds the first place of a program and its path that is outside the travel of an axis.

use super::chunk::Chunk;
use crate::moves::Moves;
use crate::path_piece::Shape;
use crate::tolerance::TRAVEL;
use feedplan_geometry::parallel::find_first;
use feedplan_geometry::spline::{bezier, CompositeCurve, Piece};

/// The greatest number of halvings of a spline piece; each one brings the control polygon four times nearer to the curve.
const DEPTH: u32 = 26;
/// The number of moves that a thread checks at a time.
const TASK: usize = 1024;

/// A position outside the travel: the move, the axis and the position in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    pub index: usize,
    pub axis: usize,
    pub position: f64,
}

/// The first position outside the travel, on the moves as programmed and on the path. A piece of an arc may be outside by its
/// deviation, because the arc itself is checked.
pub fn outside<const M: usize>(
    chunks: &[Chunk<M>],
    moves: &Moves<M>,
    travel: &[[f64; 2]; M],
) -> Option<Outside> {
    if travel.iter().flatten().all(|limit| limit.is_infinite()) {
        return None;
    }
    // Only joints have a travel.
    let limits = |index: usize, axis: usize, slack: f64| match moves.joints[index] {
        true => [travel[axis][0] - slack, travel[axis][1] + slack],
        false => [f64::NEG_INFINITY, f64::INFINITY],
    };
    let beyond = |index: usize, axis: usize, (least, greatest): (f64, f64), bulge: f64| {
        let [low, high] = limits(index, axis, TRAVEL + bulge);
        let position = if least < low { least } else { greatest };
        (position < low || position > high).then_some(Outside { index, axis, position })
    };
    let targets = find_first(moves.target.len(), TASK, |index| {
        let target = &moves.target[index];
        (0..M).find_map(|axis| beyond(index, axis, (target[axis], target[axis]), 0.0))
    });
    let arcs = find_first(moves.arcs.len(), TASK, |arc| {
        let (index, shape) = moves.arcs[arc];
        shape.plane.iter().find_map(|&axis| beyond(index, axis, moves.arc_extent(index, axis)?, 0.0))
    });
    let curves = find_first(chunks.len(), 1, |chunk| {
        let chunk = &chunks[chunk];
        chunk.pieces.iter().find_map(|piece| {
            let index = piece.first as usize;
            let bulge = if piece.arc { piece.deviation } else { 0.0 };
            (0..M).find_map(|axis| match &piece.shape {
                Shape::Conic(conic) => beyond(index, axis, conic.extent(axis), bulge),
                Shape::Spline(spline) => {
                    let piece = chunk.spline(spline, moves.splines);
                    let position = position_outside(&piece, axis, limits(index, axis, TRAVEL), DEPTH)?;
                    Some(Outside { index, axis, position })
                }
            })
        })
    });
    [targets, arcs, curves].into_iter().flatten().min_by_key(|place| place.index)
}

/// A position of an axis on a piece outside two limits; None if there is none. The control points enclose the piece. If some of
/// them are outside and both ends are not, the halves are examined, `depth` times at most.
fn position_outside<const M: usize>(
    piece: &Piece<M>,
    axis: usize,
    [low, high]: [f64; 2],
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
    (0..2).find_map(|i| position_outside(&halves.piece(i), axis, [low, high], depth - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_beyond_the_limit_is_halved_until_the_curve_is_known() {
        // The control polygons reach 2; of that the parabola reaches 1 and the conic w/(1 + w).
        let mut curve = CompositeCurve::<1>::default();
        curve.push(&[[0.0], [2.0], [0.0]], &[], 1.0);
        let parabola = curve.clone();
        bezier::elevate(&parabola.piece(0), 1, &mut curve);
        curve.push(&[[0.0], [2.0], [0.0]], &[1.0, 3.0, 1.0], 1.0);
        for (piece, apex) in curve.pieces().zip([1.0, 1.0, 1.5]) {
            assert_eq!(position_outside(&piece, 0, [-0.1, apex + 1e-9], DEPTH), None);
            let found = position_outside(&piece, 0, [-0.1, apex - 1e-9], DEPTH).unwrap();
            assert!(found > apex - 1e-9 && found <= apex);
            assert_eq!(position_outside(&piece, 0, [0.1, 2.0], DEPTH), Some(0.0));
        }
    }
}
