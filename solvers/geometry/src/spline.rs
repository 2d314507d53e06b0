//! Curves of any degree: Bézier pieces of degree 1 to 9, polynomial or rational, in M axes, joined end to end.
//!
//! A piece is C(u) on u in [0, width]. It is given by its Bernstein control points in mm and, where it is
//! rational, one positive weight each. `knots` and `extract` make pieces of B-splines and NURBS, `circle` of
//! arcs and helices; `bezier` and `rational` evaluate and transform them; `joints` and `cusps` say where they
//! are not smooth, `regular` leaves no such place inside a piece; `speed` and `length` measure them.

pub mod bezier;
pub mod circle;
pub mod cusps;
pub mod error;
pub mod extract;
pub mod joints;
pub mod knots;
pub mod length;
pub mod rational;
pub mod regular;
pub mod speed;

/// The greatest degree of a piece.
pub const MAX_DEGREE: usize = 9;
/// Coefficients of the greatest hodograph: that of a rational piece has degree 2d − 2.
pub const MAX_HODOGRAPH: usize = 2 * MAX_DEGREE - 1;
/// Coefficients of its square.
pub(crate) const MAX_SQUARE: usize = 2 * MAX_HODOGRAPH - 1;

const BINOMIALS: [[f64; MAX_SQUARE]; MAX_SQUARE] = {
    let mut rows = [[0.0; MAX_SQUARE]; MAX_SQUARE];
    let mut n = 0;
    while n < MAX_SQUARE {
        rows[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            rows[n][k] = rows[n - 1][k - 1] + rows[n - 1][k];
            k += 1;
        }
        n += 1;
    }
    rows
};

/// n over k, exact for every degree that occurs.
#[inline(always)]
pub(crate) fn binomial(n: usize, k: usize) -> f64 {
    BINOMIALS[n][k]
}

/// One piece: degree + 1 control points in mm, as many weights (none where it is polynomial), and the width of
/// its parameter interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<'a, const M: usize> {
    pub control: &'a [[f64; M]],
    pub weights: &'a [f64],
    pub width: f64,
}

impl<'a, const M: usize> Piece<'a, M> {
    /// A piece of as many weights as control points, or none; equal weights make it no rational one.
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

    /// The greatest distance of a control point from the first one, and the greatest coordinate, in mm.
    pub fn extent(&self) -> (f64, f64) {
        let mut extent = (0.0_f64, 0.0_f64);
        for point in self.control {
            let (mut sum, first) = (0.0, &self.control[0]);
            for k in 0..M {
                let difference = point[k] - first[k];
                sum += difference * difference;
                extent.1 = extent.1.max(point[k].abs());
            }
            extent.0 = extent.0.max(sum.sqrt());
        }
        extent
    }
}

/// Pieces one after the other, each of its own degree: piece i owns the control points from `offsets[i]` to
/// `offsets[i + 1]`. `weights` is empty where no piece is rational.
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

    /// Piece i; equal weights make no piece rational.
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

    /// Appends a piece; empty `weights` are ones.
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

    /// Removes all pieces, and keeps the memory.
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
