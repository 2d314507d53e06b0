//! Builds the quadratic pieces of a spline from knot to knot, half a step at a time.

use super::chain::Chain;
use feedplan_geometry::quadratic::{Quadratic, Segment};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedPiece<const M: usize> {
    pub piece: Quadratic<M>,
    /// First and last chord that the piece follows; chord i goes from point i to point i + 1.
    pub first: usize,
    pub last: usize,
    /// Certified bound of the distance between the piece and its chords, both ways, in mm.
    pub deviation: f64,
    /// Number of the B-spline (or line) that the piece belongs to.
    pub spline: u32,
}

/// The line from point `a` to point `b`, with the greatest distance of the points between from it.
pub fn line<const M: usize>(chain: &Chain<M>, a: usize, b: usize, spline: u32) -> FittedPiece<M> {
    let points = chain.points;
    let segment = Segment::new(&points[a], &points[b]);
    let deviation =
        points[a + 1..b].iter().fold(0.0_f64, |worst, p| worst.max(segment.distance_sq(p))).sqrt();
    FittedPiece { piece: Quadratic::line(points[a], points[b]), first: a, last: b - 1, deviation, spline }
}

/// The place that the pieces of one spline have reached, and width and deviation of the piece that begins there.
pub struct PieceBuilder<const M: usize> {
    pub point: [f64; M],
    pub tangent: [f64; M],
    /// The chord on which the next piece starts.
    pub chord: usize,
    pub spline: u32,
    /// Width since the last knot, and the greatest deviation since then, in mm.
    pub width: f64,
    pub deviation: f64,
}

impl<const M: usize> PieceBuilder<M> {
    /// Adds half a step to the next piece.
    pub fn pass(&mut self, width: f64, deviation: f64) {
        self.width += width;
        self.deviation = self.deviation.max(deviation);
    }

    /// The piece that ends at `point`, on chord `last`; the next one starts on chord `next`.
    pub fn piece(&mut self, point: [f64; M], tangent: [f64; M], last: usize, next: usize) -> FittedPiece<M> {
        let quarter = 0.25 * self.width;
        // The mean of both ends, so that a reversed chain gives the same piece.
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
