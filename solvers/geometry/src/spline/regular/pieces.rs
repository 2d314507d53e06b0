//! The regular pieces of a curve, and when two points or two directions count as equal.

use std::ops::Range;

use crate::quadratic::{norm, sub};
use crate::spline::{CompositeCurve, Piece};
use crate::tolerance::SAME_DIRECTION;

/// The regular pieces of a curve.
pub struct Regular<const M: usize> {
    pub curve: CompositeCurve<M>,
    /// For each piece, the first and the last of the given pieces that it follows.
    pub source: Vec<[usize; 2]>,
    /// Whether a piece begins, and whether it ends, in a cusp, where the tool rests.
    pub rests: Vec<[bool; 2]>,
    /// For each given range of pieces, the regular pieces made from it.
    pub ranges: Vec<Range<usize>>,
}

impl<const M: usize> Regular<M> {
    pub fn push(&mut self, source: [usize; 2], piece: &Piece<M>, rounding: f64) {
        self.curve.push(piece.control, piece.weights, piece.width);
        let last = self.curve.len() - 1;
        // A piece without length before this one may have been left out: close the gap.
        if last > 0 {
            let end = self.curve.control[self.curve.offsets[last] - 1];
            let start = &mut self.curve.control_mut(last)[0];
            if near(&end, start, rounding) {
                *start = end;
            }
        }
        self.source.push(source);
    }
}

/// Whether two edges have the same direction, up to the rounding of their ends.
pub fn is_smooth<const M: usize>(before: &[f64; M], after: &[f64; M], rounding: f64) -> bool {
    let (own, others) = (norm(before), norm(after));
    let turn = norm(&std::array::from_fn::<f64, M, _>(|k| after[k] / others - before[k] / own));
    turn <= SAME_DIRECTION + rounding / own.min(others)
}

/// Whether two points are equal up to rounding.
pub fn near<const M: usize>(a: &[f64; M], b: &[f64; M], rounding: f64) -> bool {
    norm(&sub(a, b)) <= rounding
}
