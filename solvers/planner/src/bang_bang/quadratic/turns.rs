//! Where the axes of a curved piece turn round, and the tangents there to the last digits.
//!
//! Next to a cusp several axes turn within a tiny stretch, where differences of places and of tangents keep no
//! digits. All that is needed follows from W_jk = c_j q'_k − c_k q'_j, c = q'', constant along the piece: where
//! axis a turns, q'_k = W_ak/c_a, and axis b turns −W_ab/(c_a c_b) after it.

use super::piece::Piece;
use crate::bang_bang::tolerance::CANCELLED;
use feedplan_geometry::quadratic::dot;

/// The start or end of a stretch: an axis that turns there, or the edge of the piece.
pub type Mark = u8;
pub const EDGE: Mark = 255;

/// A part of a piece on which no axis turns.
pub struct Stretch<const M: usize> {
    pub begin: f64,
    pub end: f64,
    pub length: f64,
    /// Its tangents as those of a piece; a tangent is exactly 0 where its axis turns.
    pub piece: Piece<M>,
}

/// a b − c d without cancellation.
#[inline(always)]
pub fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let (ab, cd) = (a * b, c * d);
    let difference = ab - cd;
    if difference.abs() >= CANCELLED * (ab.abs() + cd.abs()) {
        difference
    } else {
        difference + (rounding_error(a, b, ab) - rounding_error(c, d, cd))
    }
}

/// a b − (its rounded value), exactly (Dekker).
#[inline(never)]
fn rounding_error(a: f64, b: f64, rounded: f64) -> f64 {
    let halves = |x: f64| {
        let big = 134_217_729.0 * x;
        let high = big - (big - x);
        (high, x - high)
    };
    let ((a1, a0), (b1, b0)) = (halves(a), halves(b));
    ((a1 * b1 - rounded) + a1 * b0 + a0 * b1) + a0 * b0
}

impl<const M: usize> Piece<M> {
    /// The axes that turn inside the piece, in order along it, and their number.
    pub fn turns(&self) -> ([Mark; M], usize) {
        let mut order = [EDGE; M];
        let mut count = 0;
        for k in 0..M {
            if self.left[k] * self.right[k] >= 0.0 {
                continue;
            }
            let mut place = count;
            while place > 0 && self.distance(order[place - 1] as usize, k) < 0.0 {
                order[place] = order[place - 1];
                place -= 1;
            }
            order[place] = k as Mark;
            count += 1;
        }
        (order, count)
    }

    /// From the turn of axis a to the turn of axis b.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let bend = |k: usize| self.right[k] - self.left[k];
        -self.minors[a][b] / (bend(a) * bend(b))
    }

    /// The tangent where axis a turns.
    fn tangent_at_turn(&self, a: usize) -> [f64; M] {
        let bend = self.right[a] - self.left[a];
        std::array::from_fn(|k| if k == a { 0.0 } else { self.minors[a][k] / bend })
    }

    /// The part between two marks that follow one another.
    pub fn stretch(&self, from: Mark, to: Mark) -> Stretch<M> {
        let place = |k: usize| self.left[k] / (self.left[k] - self.right[k]);
        let place_from_right = |k: usize| self.right[k] / (self.right[k] - self.left[k]);
        let (a, b) = (from as usize, to as usize);
        let length = match (from, to) {
            (EDGE, EDGE) => 1.0,
            (EDGE, _) => place(b),
            (_, EDGE) => place_from_right(a),
            _ => self.distance(a, b),
        };
        let left = if from == EDGE { self.left } else { self.tangent_at_turn(a) };
        let right = if to == EDGE { self.right } else { self.tangent_at_turn(b) };
        let speed = [dot(&left, &left), dot(&left, &right), dot(&right, &right)];
        Stretch {
            begin: if from == EDGE { 0.0 } else { place(a) },
            end: if to == EDGE { 1.0 } else { place(b) },
            length,
            piece: Piece { left, right, speed, ..*self },
        }
    }
}
