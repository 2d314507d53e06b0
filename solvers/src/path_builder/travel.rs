//! The first place of a path that an axis cannot reach.

use rayon::prelude::*;

use crate::follow::{Followed, Moves};
use crate::quadratic::Quadratic;

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
    parts: &[Vec<Followed<M>>],
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
    let targets = moves.target.par_iter().enumerate().find_map_first(|(index, target)| {
        (0..M).find_map(|axis| beyond(index, axis, (target[axis], target[axis]), 0.0))
    });
    let arcs = moves.arcs.par_iter().find_map_first(|&(index, shape)| {
        shape.plane.iter().find_map(|&axis| beyond(index, axis, moves.arc_extent(index, axis)?, 0.0))
    });
    let curves = parts.par_iter().find_map_first(|part| {
        part.iter().find_map(|followed| {
            let bulge = if followed.arc { followed.deviation } else { 0.0 };
            let index = followed.first as usize;
            (0..M).find_map(|axis| beyond(index, axis, extent(&followed.piece, axis), bulge))
        })
    });
    [targets, arcs, curves].into_iter().flatten().min_by_key(|place| place.index)
}

/// Least and greatest value of an axis on a piece.
fn extent<const M: usize>(piece: &Quadratic<M>, axis: usize) -> (f64, f64) {
    let [a, b, c] = piece.control.map(|point| point[axis]);
    let (mut least, mut greatest) = (a.min(c), a.max(c));
    if b < least || b > greatest {
        let t = (a - b) / (a - 2.0 * b + c);
        let turn = a + t * (b - a);
        least = least.min(turn);
        greatest = greatest.max(turn);
    }
    (least, greatest)
}
