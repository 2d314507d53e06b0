//! The quadratics from knot to knot, written down half a step at a time.

use super::certificate::Segment;
use super::{Chain, FittedPiece};
use feedplan_geometry::quadratic::Quadratic;

/// The line from point `a` to point `b`, all between being on it.
pub fn line<const M: usize>(chain: &Chain<M>, a: usize, b: usize, spline: u32) -> FittedPiece<M> {
    let points = chain.points;
    let segment = Segment::new(&points[a], &points[b]);
    let deviation =
        points[a + 1..b].iter().fold(0.0_f64, |worst, p| worst.max(segment.distance_sq(p))).sqrt();
    FittedPiece { piece: Quadratic::line(points[a], points[b]), first: a, last: b - 1, deviation, spline }
}

/// Position and direction on the way along one spline.
pub struct Pen<const M: usize> {
    pub point: [f64; M],
    pub tangent: [f64; M],
    /// The chord that the next piece starts on.
    pub chord: usize,
    pub spline: u32,
    /// Since the last knot.
    pub width: f64,
    pub deviation: f64,
}

impl<const M: usize> Pen<M> {
    /// Passes one half of a step.
    pub fn pass(&mut self, width: f64, deviation: f64) {
        self.width += width;
        self.deviation = self.deviation.max(deviation);
    }

    /// The piece that ends here, on chord `last`; the next one starts on chord `next`.
    pub fn piece(&mut self, point: [f64; M], tangent: [f64; M], last: usize, next: usize) -> FittedPiece<M> {
        let quarter = 0.25 * self.width;
        // From both ends alike, so that a reversed chain gives the same piece.
        let middle = std::array::from_fn(|k| {
            0.5 * (self.point[k] + point[k]) + quarter * (self.tangent[k] - tangent[k])
        });
        let piece = FittedPiece {
            piece: Quadratic { control: [self.point, middle, point], width: self.width },
            first: self.chord,
            last,
            deviation: self.deviation,
            spline: self.spline,
        };
        *self = Self { point, tangent, chord: next, spline: self.spline, width: 0.0, deviation: 0.0 };
        piece
    }
}
