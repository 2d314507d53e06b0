//! Finds the turns of the axes of a quadratic piece, and the tangents there to full precision.
//!
//! Next to a cusp several axes turn so close together that differences of t and of tangents have no correct digits. The constants
//! W_jk give all that is needed: where axis a turns, g_k = W_ak/c_a, and axis b turns −W_ab/(c_a c_b) after it.

use super::piece::Piece;
use feedplan_geometry::quadratic::dot;

/// An end of a monotone part: the axis that turns there, or the edge of the piece.
pub type Mark = u8;
pub const EDGE: Mark = 255;

/// The part of a piece between two neighbouring turns, or a turn and an edge.
pub struct MonotonePart<const M: usize> {
    pub begin: f64,
    pub end: f64,
    pub length: f64,
    /// The part as a piece over [0, 1]; the tangent of an axis that turns at an end is exactly 0 there.
    pub piece: Piece<M>,
}

impl<const M: usize> Piece<M> {
    /// The axes that turn inside the piece, in order of t, and their number.
    pub fn turns(&self) -> ([Mark; M], usize) {
        let mut order = [EDGE; M];
        let mut count = 0;
        for k in 0..M {
            if self.left[k] * self.right[k] >= 0.0 {
                continue;
            }
            let mut index = count;
            while index > 0 && self.distance(order[index - 1] as usize, k) < 0.0 {
                order[index] = order[index - 1];
                index -= 1;
            }
            order[index] = k as Mark;
            count += 1;
        }
        (order, count)
    }

    /// Distance in t from the turn of axis a to the turn of axis b; negative if b turns first.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let c = |k: usize| self.right[k] - self.left[k];
        -self.wronskian[a][b] / (c(a) * c(b))
    }

    /// The tangent where axis a turns.
    fn tangent_at_turn(&self, a: usize) -> [f64; M] {
        let c = self.right[a] - self.left[a];
        std::array::from_fn(|k| if k == a { 0.0 } else { self.wronskian[a][k] / c })
    }

    /// The monotone part between two neighbouring marks.
    pub fn monotone_part(&self, from: Mark, to: Mark) -> MonotonePart<M> {
        let turn_from_left = |k: usize| self.left[k] / (self.left[k] - self.right[k]);
        let turn_from_right = |k: usize| self.right[k] / (self.right[k] - self.left[k]);
        let (a, b) = (from as usize, to as usize);
        let length = match (from, to) {
            (EDGE, EDGE) => 1.0,
            (EDGE, _) => turn_from_left(b),
            (_, EDGE) => turn_from_right(a),
            _ => self.distance(a, b),
        };
        let left = if from == EDGE { self.left } else { self.tangent_at_turn(a) };
        let right = if to == EDGE { self.right } else { self.tangent_at_turn(b) };
        let speed = [dot(&left, &left), dot(&left, &right), dot(&right, &right)];
        MonotonePart {
            begin: if from == EDGE { 0.0 } else { turn_from_left(a) },
            end: if to == EDGE { 1.0 } else { turn_from_left(b) },
            length,
            piece: Piece { left, right, speed, ..*self },
        }
    }
}
