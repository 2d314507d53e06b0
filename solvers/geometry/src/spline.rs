//! Curves of any degree: Bézier pieces of degree 1 to 9, polynomial or rational, in M axes, joined end to end.
//!
//! A piece is C(u) on u in [0, width], given by its Bernstein control points in mm and, if it is rational, one positive
//! weight for each. A *place* on a curve is a piece and its parameter u.
//!
//! | file | computes |
//! |---|---|
//! | `knots`, `extract` | a checked B-spline or NURBS; its pieces |
//! | `bezier`, `rational` | values and derivatives of a piece, parts of it, the same piece of higher degree |
//! | `cusps` | the places where C' is 0 |
//! | `regular` | the same curve as pieces without a cusp inside |
//! | `speed`, `length` | \|C'\| with bounds of its derivatives; the length and its inverse |

pub mod bezier;
pub mod cusps;
pub mod extract;
pub mod knots;
pub mod length;
pub mod rational;
pub mod regular;
pub mod speed;

use crate::quadratic::{lerp, norm, sub, Quadratic};
use crate::tolerance::NO_DIRECTION;

/// The greatest degree of a piece.
pub const MAX_DEGREE: usize = 9;
/// The greatest number of coefficients of a hodograph: that of a rational piece has degree 2d − 2.
pub const MAX_HODOGRAPH: usize = 2 * MAX_DEGREE - 1;
/// The greatest number of coefficients of the square of a hodograph.
pub(crate) const MAX_SQUARE: usize = 2 * MAX_HODOGRAPH - 1;

/// One piece: degree + 1 control points in mm, as many weights (none if it is polynomial), and the width of its parameter
/// interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<'a, const M: usize> {
    pub control: &'a [[f64; M]],
    pub weights: &'a [f64],
    pub width: f64,
}

impl<'a, const M: usize> Piece<'a, M> {
    /// A piece with as many weights as control points, or none; with equal weights it is treated as polynomial.
    #[inline]
    pub fn new(control: &'a [[f64; M]], weights: &'a [f64], width: f64) -> Self {
        let equal = weights.windows(2).all(|pair| pair[0] == pair[1]);
        Self { control, weights: if equal { &[] } else { weights }, width }
    }

    #[inline(always)]
    pub fn degree(&self) -> usize {
        self.control.len() - 1
    }

    #[inline(always)]
    pub fn is_rational(&self) -> bool {
        !self.weights.is_empty()
    }

    /// The same piece as a quadratic; None if its degree is above 2 or it is rational.
    #[inline]
    pub fn quadratic(&self) -> Option<Quadratic<M>> {
        let control = match *self.control {
            [a, b] => [a, lerp(&a, &b, 0.5), b],
            [a, b, c] => [a, b, c],
            _ => return None,
        };
        (!self.is_rational()).then_some(Quadratic { control, width: self.width })
    }

    /// The first edge of the control polygon that has a direction, or with `at_end` the last one: the direction of motion at that
    /// end. None if the piece has no length.
    pub fn edge(&self, at_end: bool) -> Option<[f64; M]> {
        let extent = self.extent();
        let mut edges = self.control.windows(2).map(|pair| sub(&pair[1], &pair[0]));
        let has_direction = |edge: &[f64; M]| norm(edge) > NO_DIRECTION * extent;
        if at_end {
            edges.rfind(has_direction)
        } else {
            edges.find(has_direction)
        }
    }

    /// The greatest distance of a control point from the first one, in mm.
    pub fn extent(&self) -> f64 {
        self.control.iter().fold(0.0, |most: f64, point| most.max(norm(&sub(point, &self.control[0]))))
    }
}

/// Pieces in order, each of its own degree: piece i has the control points `offsets[i]..offsets[i + 1]`. `weights` is empty if no
/// piece is rational.
#[derive(Clone, Debug, PartialEq)]
pub struct CompositeCurve<const M: usize> {
    pub control: Vec<[f64; M]>,
    pub weights: Vec<f64>,
    pub offsets: Vec<usize>,
    pub width: Vec<f64>,
}

impl<const M: usize> Default for CompositeCurve<M> {
    fn default() -> Self {
        Self { control: vec![], weights: vec![], offsets: vec![0], width: vec![] }
    }
}

impl<const M: usize> CompositeCurve<M> {
    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.width.len()
    }

    pub fn is_empty(&self) -> bool {
        self.width.is_empty()
    }

    /// Piece i; with equal weights it is treated as polynomial.
    #[inline]
    pub fn piece(&self, i: usize) -> Piece<'_, M> {
        let range = self.offsets[i]..self.offsets[i + 1];
        let weights = if self.weights.is_empty() { &[][..] } else { &self.weights[range.clone()] };
        Piece::new(&self.control[range], weights, self.width[i])
    }

    /// The control points of piece i.
    pub fn control_mut(&mut self, i: usize) -> &mut [[f64; M]] {
        &mut self.control[self.offsets[i]..self.offsets[i + 1]]
    }

    pub fn pieces(&self) -> impl Iterator<Item = Piece<'_, M>> {
        (0..self.len()).map(|i| self.piece(i))
    }

    /// Appends a piece; empty `weights` stand for ones.
    pub fn push(&mut self, control: &[[f64; M]], weights: &[f64], width: f64) {
        if !weights.is_empty() && self.weights.is_empty() {
            self.weights.resize(self.control.len(), 1.0);
        }
        self.control.extend_from_slice(control);
        if !weights.is_empty() {
            self.weights.extend_from_slice(weights);
        } else if !self.weights.is_empty() {
            self.weights.resize(self.control.len(), 1.0);
        }
        self.offsets.push(self.control.len());
        self.width.push(width);
    }

    /// Removes all pieces, but keeps the memory.
    pub fn clear(&mut self) {
        self.control.clear();
        self.weights.clear();
        self.offsets.truncate(1);
        self.width.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomial_and_rational_pieces_stand_in_one_curve() {
        let mut curve = CompositeCurve::default();
        curve.push(&[[0.0], [1.0]], &[], 1.0);
        curve.push(&[[1.0], [2.0], [4.0]], &[1.0, 0.5, 1.0], 2.0);
        curve.push(&[[4.0], [5.0]], &[], 1.0);
        assert_eq!(curve.weights, [1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 1.0]);
        assert_eq!(curve.offsets, [0, 2, 5, 7]);
        let rational: Vec<bool> = curve.pieces().map(|piece| piece.is_rational()).collect();
        assert_eq!(rational, [false, true, false]);
        assert_eq!(curve.piece(1).degree(), 2);
    }
}
