//! On which side of the polyline the curve lies and how far: outside (away from the centre of its curvature) or inside.
//!
//! With N the unit normal of the curve towards its centre of curvature and away = C − R from the polyline to the curve,
//! the offset is −N · away, positive outside. The mean offset of bends is weighted by the angle by which they turn, since
//! straight parts have no inside:
//!
//! ```text
//! Σ −N · (C(u*_i) − V_i) θ_i / Σ θ_i
//! ```
//!
//! The sum is over the vertices V_i of bends; u*_i is the place of the curve near V_i. θ_i is the curvature of the curve there
//! times the mean length of the two chords, but at most the angle by which the polyline turns: where an arc meets a long line,
//! the mean chord would be too long. The greatest offsets are taken over all vertices, also those of corners, and places between
//! them.

use super::bezier::{derivatives, Control};
use super::polyline::{Hold, Polyline};
use feedplan_geometry::quadratic::{dot, norm, sub};
use feedplan_geometry::watch::Watch;

/// The number of places in an interval where the offset is measured.
const PLACES: usize = 4;
/// A curve that turns by less than this over the length of a chord, in rad, is straight.
const STRAIGHT: f64 = 1e-9;

/// The mean and the greatest offsets, in mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offsets {
    /// Σ θ, and the weighted sum of the offsets, Σ (−N · away) θ.
    turned: f64,
    moment: f64,
    /// The greatest distances inside and outside, in mm, both at least 0.
    pub inside: f64,
    pub outside: f64,
}

impl Offsets {
    /// The mean offset in bends, in mm, positive outside; 0 without bends.
    pub fn mean(&self) -> f64 {
        if self.turned > 0.0 {
            self.moment / self.turned
        } else {
            0.0
        }
    }

    pub fn merge(&mut self, other: &Self) {
        self.turned += other.turned;
        self.moment += other.moment;
        self.offer(-other.inside);
        self.offer(other.outside);
    }

    /// Updates the greatest distances by an offset; a NaN changes nothing.
    pub fn offer(&mut self, distance: f64) {
        self.inside = self.inside.max(-distance);
        self.outside = self.outside.max(distance);
    }

    /// The offsets of a curve from a polyline; `foot` has a place of the curve near each vertex.
    pub fn of<const D: usize>(
        line: &Polyline<D>,
        knots: &[f64],
        pieces: &[Control<D>],
        foot: &[f64],
        watch: Watch,
    ) -> Self {
        let mut offsets = Self::default();
        let place = |j: usize, u: f64| {
            let width = knots[j + 1] - knots[j];
            Place::new(&derivatives(&pieces[j], ((u - knots[j]) / width).clamp(0.0, 1.0)), width)
        };
        let mut j = 0;
        for i in 1..line.chords() {
            watch.check_at(i);
            while j + 1 < pieces.len() && knots[j + 1] <= foot[i] {
                j += 1;
            }
            let length = line.mean_chord(i);
            let (distance, curvature) = place(j, foot[i]).distance(&line.vertex[i], length);
            offsets.offer(distance);
            if line.hold[i] != Hold::Free {
                let angle = (curvature * length).min(line.turn(i));
                offsets.turned += angle;
                offsets.moment += angle * distance;
            }
        }
        let mut i = 0;
        for j in 0..pieces.len() {
            watch.check_at(j);
            for k in 1..=PLACES {
                let u = knots[j] + (knots[j + 1] - knots[j]) * k as f64 / PLACES as f64;
                while i + 1 < line.chords() && foot[i + 1] <= u {
                    i += 1;
                }
                let (place, length) = (place(j, u), line.chord_length(i));
                let along = dot(&sub(&place.point, &line.vertex[i]), &line.direction[i]);
                if (0.0..=length).contains(&along) {
                    offsets.offer(place.distance(&line.point(i, line.station[i] + along), length).0);
                }
            }
        }
        offsets
    }
}

/// A place of the curve.
struct Place<const D: usize> {
    point: [f64; D],
    /// The curvature times the normal towards its centre, in 1/mm.
    bend: [f64; D],
}

impl<const D: usize> Place<D> {
    /// From point and derivatives with respect to the fraction of an interval of this width.
    fn new([point, first, second]: &[[f64; D]; 3], width: f64) -> Self {
        let velocity = first.map(|x| x / width);
        let acceleration = second.map(|x| x / (width * width));
        let square = dot(&velocity, &velocity);
        let along = dot(&acceleration, &velocity) / square;
        Self {
            point: *point,
            bend: std::array::from_fn(|k| (acceleration[k] - along * velocity[k]) / square),
        }
    }

    /// The offset from a point of the polyline, and the curvature; both 0 where the curve turns by less than STRAIGHT over
    /// `length`.
    fn distance(&self, from: &[f64; D], length: f64) -> (f64, f64) {
        let curvature = norm(&self.bend);
        if !(curvature * length > STRAIGHT && curvature.is_finite()) {
            return (0.0, 0.0);
        }
        (-dot(&self.bend, &sub(&self.point, from)) / curvature, curvature)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter of a circle of radius r from (0, r) as one quintic with the derivatives at both ends to the second.
    fn quarter(r: f64) -> Control<2> {
        let h = std::f64::consts::FRAC_PI_2 / 5.0;
        [
            [0.0, r],
            [h * r, r],
            [2.0 * h * r, r - 1.25 * h * h * r],
            [r - 1.25 * h * h * r, 2.0 * h * r],
            [r, h * r],
            [r, 0.0],
        ]
    }

    #[test]
    fn a_circle_through_the_points_of_a_greater_one_is_inside_by_the_difference() {
        // A quarter of radius 0.9, to 1e-5, beside points of radius 1, seen at the same angles.
        let points: Vec<[f64; 2]> = (0..=90).map(|i| (i as f64).to_radians().sin_cos().into()).collect();
        let mut line = Polyline::new(points, vec![0.2; 90]);
        line.hold_bends(5.0, |_| true, Watch::default());
        let foot: Vec<f64> = (0..=90).map(|i| line.length() * i as f64 / 90.0).collect();
        let offsets = Offsets::of(&line, &[0.0, line.length()], &[quarter(0.9)], &foot, Watch::default());
        assert!((offsets.mean() + 0.1).abs() < 1e-3, "{offsets:?}");
        assert!((offsets.inside - 0.1).abs() < 1e-3 && offsets.outside == 0.0, "{offsets:?}");
    }

    #[test]
    fn a_long_line_before_a_bend_adds_no_weight_to_its_first_vertex() {
        // A spiral from radius 0.9 to 1.1 after a line of 50 mm; the curve has radius 0.9.
        let spiral = |i: usize| (0.9 + 0.2 * i as f64 / 90.0, (i as f64).to_radians().sin_cos());
        let mut points = vec![[-50.0, 0.9]];
        points.extend((0..=90).map(spiral).map(|(r, (sin, cos))| [r * sin, r * cos]));
        let mut line = Polyline::new(points, vec![0.01; 91]);
        line.hold_bends(5.0, |_| true, Watch::default());
        let foot: Vec<f64> = (0..=91).map(|i: usize| i.saturating_sub(1) as f64 / 90.0).collect();
        let mean = Offsets::of(&line, &[0.0, 1.0], &[quarter(0.9)], &foot, Watch::default()).mean();
        assert!((mean + 0.1).abs() < 0.015, "{mean}");
    }
}
