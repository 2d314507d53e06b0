//! The jump of the unit tangent at a corner, and the length of the blend that suits it, from the pieces on both sides.

use crate::path_piece::Shape;
use crate::tolerance;
use feedplan_geometry::quadratic::norm;

/// A blend gets this many times the length at which it takes the full acceleration of an axis at the feed, so that the curvature
/// of the sides has some acceleration left.
const EASE: f64 = 8.0;
/// The shortest blend, in multiples of the rounding error of a coordinate.
const SHORTEST: f64 = 16.0;

/// What a corner between two lines becomes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rounding {
    /// See "Why a parabola" in `corner`.
    Parabola,
    /// The circle that touches both lines, as used by many controllers. With the turn θ and the radius r it takes l = r tan(θ/2)
    /// of each line, and its distance from the corner is r (1/cos(θ/2) − 1) = l sin(θ/2)/(1 + cos(θ/2)).
    Circle,
}

/// The jump of the unit tangent where two pieces meet.
#[derive(Clone, Copy, Debug)]
pub struct TangentJump<const M: usize> {
    /// t₊ − t₋.
    pub change: [f64; M],
    /// |t₊ − t₋| = 2 sin(turn/2).
    pub size: f64,
    /// The rounding error of lengths here, from the coordinates, in mm.
    pub rounding: f64,
}

impl<const M: usize> TangentJump<M> {
    /// The jump between two pieces; None where a piece has no tangent at its end.
    pub fn new(before: &Shape<M>, after: &Shape<M>) -> Option<Self> {
        let (out, into) = (before.end_edge(), after.start_edge());
        let (edge_out, edge_into) = (norm(&out), norm(&into));
        if !(edge_out > 0.0 && edge_into > 0.0) {
            return None;
        }
        let change = std::array::from_fn(|k| into[k] / edge_into - out[k] / edge_out);
        let coordinate = after.start().iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        Some(Self { change, size: norm(&change), rounding: tolerance::COORDINATE * coordinate })
    }

    /// Whether the pieces meet smoothly, up to the rounding of their coordinates.
    pub fn is_smooth(&self, before: &Shape<M>, after: &Shape<M>) -> bool {
        let (out, into) = (before.end_edge(), after.start_edge());
        self.size <= tolerance::SAME_DIRECTION + self.rounding / norm(&out).min(norm(&into))
    }

    /// Whether the path turns back on itself.
    pub fn reverses(&self) -> bool {
        self.size * self.size >= 4.0 * (1.0 - tolerance::REVERSAL_COSINE.powi(2))
    }

    /// The length in mm above which a longer blend gives no higher speed at `feed`.
    pub fn length_for(
        &self,
        sides: [&Shape<M>; 2],
        feed: f64,
        max_velocity: &[f64; M],
        max_acceleration: &[f64; M],
    ) -> f64 {
        let (out, into) = (sides[0].end_edge(), sides[1].start_edge());
        let (edge_out, edge_into) = (norm(&out), norm(&into));
        let (mut speed, mut share) = (feed, 0.0f64);
        for k in 0..M {
            speed = speed.min(max_velocity[k] / (out[k].abs() / edge_out).max(into[k].abs() / edge_into));
            share = share.max(self.change[k].abs() / max_acceleration[k]);
        }
        EASE * 0.5 * share * speed * speed
    }

    /// cos(turn/2).
    pub fn half_cosine(&self) -> f64 {
        (1.0 - 0.25 * self.size * self.size).max(0.0).sqrt()
    }

    /// The length of the blend whose deviation is `deviation`, both in mm.
    pub fn length_within(&self, deviation: f64, rounding: Rounding) -> f64 {
        match rounding {
            Rounding::Parabola => 4.0 * deviation / self.size,
            Rounding::Circle => 2.0 * deviation * (1.0 + self.half_cosine()) / self.size,
        }
    }

    /// Whether a length is so short that it may be rounding.
    pub fn vanishes(&self, length: f64) -> bool {
        length <= SHORTEST * self.rounding || length <= 0.0
    }

    /// The displacement D of the corner for sides of these lengths, in mm.
    pub fn displacement(&self, before: f64, after: f64) -> [f64; M] {
        self.change.map(|x| x / (2.0 / before + 2.0 / after))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use feedplan_geometry::conic::Conic;

    #[test]
    fn what_rounding_does_is_no_corner_and_a_small_turn_is() {
        let smooth = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
            let (before, after) = (Shape::Conic(Conic::line(a, b)), Shape::Conic(Conic::line(b, c)));
            TangentJump::new(&before, &after).unwrap().is_smooth(&before, &after)
        };
        assert!(smooth([0.1, 0.1], [0.2, 0.2], [0.7, 0.7]));
        assert!(smooth([1e5, 1e5], [1e5 + 1e-6, 1e5 + 1e-6], [1e5 + 3e-6, 1e5 + 3e-6]));
        assert!(!smooth([0.0, 0.0], [1.0, 0.0], [2.0, 1e-8]));
        let (there, back) = (Conic::line([0.0], [1.0]), Conic::line([1.0], [0.0]));
        assert!(TangentJump::new(&Shape::Conic(there), &Shape::Conic(back)).unwrap().reverses());
    }
}
