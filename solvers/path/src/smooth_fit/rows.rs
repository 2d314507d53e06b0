//! The tolerance tube as linear rows: they keep samples of the curve within the tolerance of their places on the polyline.
//!
//! ```text
//! |n · (C(u) − R)| ≤ FILL ε/√(D − 1)     for each of the D − 1 normals n
//! |t · (C(u) − R)| ≤ ALONG ε
//! ```
//!
//! R is the place on the polyline at station u, t the direction of the polyline. At a vertex t is the mean direction of both
//! chords. Vertices that are held pull the curve as well (see `bends`).
//!
//! Without a motion the limit along t is ε, and SHARP_ALONG ε at a vertex that turns by more than SHARP, so that a station of the
//! curve stays within the tolerance of the same station of the polyline. A curve that is fitted to a motion may slip along the
//! polyline at corners by FITTED_ALONG ε. With this, at a tolerance of 0.01 mm, its derivatives get as small as the tube allows,
//! and a corner of 90° is passed 9 % sooner. On bends, slip would only change the speed of the parameter.

use super::polyline::{Hold, Polyline};
use super::spline::{around, basis, ORDER};
use feedplan_geometry::quadratic::{dot, norm, sub};

/// The number of samples of an interval, in addition to the vertices in it.
const SAMPLES: usize = 4;
/// Samples may use this part of the tolerance, since the curve is farther away between them.
const FILL: f64 = 0.97;
/// A vertex that turns by more than this, in rad, has the limits below, in tolerances.
const SHARP: f64 = 0.436;
const SHARP_ACROSS: f64 = 0.95;
const SHARP_ALONG: f64 = 0.25;
/// The limit along the polyline at corners of a curve that is fitted to a motion, in tolerances.
const FITTED_ALONG: f64 = 10.0;

/// A sample of the curve with its limits in D orthogonal directions, the last of them along the polyline.
#[derive(Clone, Copy, Debug)]
pub struct Row<const D: usize> {
    pub basis: [f64; ORDER],
    pub target: [f64; D],
    pub direction: [[f64; D]; D],
    pub half: [f64; D],
    /// The weight in the energy of half the squared distance from the target.
    pub pull: f64,
}

impl<const D: usize> Row<D> {
    /// Widens the limits so that the point with coefficients x keeps them with a margin of at least `room` times its distance.
    pub fn admit(&mut self, x: &[[f64; D]], room: f64) {
        let place: [f64; D] =
            std::array::from_fn(|k| self.basis.iter().zip(x).map(|(basis, x)| basis * x[k]).sum());
        let away = sub(&place, &self.target);
        for (half, direction) in self.half.iter_mut().zip(&self.direction) {
            *half = half.max((1.0 + room) * dot(direction, &away).abs());
        }
    }
}

/// The rows of the intervals from `first` on, one interval for each `density` of energy, and the number of rows before each
/// interval. Targets are relative to `origin`.
pub fn rows<const D: usize>(
    line: &Polyline<D>,
    knots: &[f64],
    first: usize,
    density: &[f64],
    origin: &[f64; D],
) -> (Vec<Row<D>>, Vec<usize>) {
    let (mut rows, mut start) = (Vec::with_capacity(2 * SAMPLES * density.len()), vec![0]);
    let mut chord = line.chord_at(knots[first]);
    let limits_in = |chord: usize, vertex: Option<usize>| {
        let (along, limits) = limits(line, chord, vertex);
        (frame(&along), std::array::from_fn(|r| if r + 1 == D { limits[1] } else { limits[0] }))
    };
    // Most samples are inside the same chord as the sample before, so its frame and limits are kept.
    let mut inside = (chord, limits_in(chord, None));
    for (j, density) in (first..).zip(density) {
        let (t, low, high) = (around(knots, j), knots[j], knots[j + 1]);
        let mut push = |u: f64, chord: usize, vertex: Option<usize>| {
            if vertex.is_none() && inside.0 != chord {
                inside = (chord, limits_in(chord, None));
            }
            let (direction, half) = if vertex.is_none() { inside.1 } else { limits_in(chord, vertex) };
            let point = line.point(chord, u);
            rows.push(Row {
                basis: basis(&t, u),
                target: std::array::from_fn(|k| point[k] - origin[k]),
                direction,
                half,
                pull: vertex.map_or(0.0, |i| density * pull(line, i, high - low)),
            });
        };
        for sample in 0..SAMPLES {
            let u = low + (high - low) * (sample as f64 + 0.5) / SAMPLES as f64;
            while chord + 1 < line.chords() && line.station[chord + 1] <= u {
                chord += 1;
                push(line.station[chord].max(low), chord, Some(chord));
            }
            push(u, chord, None);
        }
        while chord + 1 < line.chords() && line.station[chord + 1] < high {
            chord += 1;
            push(line.station[chord], chord, Some(chord));
        }
        start.push(rows.len());
    }
    (rows, start)
}

/// The weight of a vertex in an interval of length h, divided by the density of energy; 0 if bends need not keep their size.
fn pull<const D: usize>(line: &Polyline<D>, vertex: usize, h: f64) -> f64 {
    if !line.sized {
        return 0.0;
    }
    let chords = [vertex - 1, vertex].map(|chord| line.chord_length(chord));
    line.hold[vertex].weight(chords, h, line.tolerance_at(vertex))
}

/// The direction of the polyline at a place, and the limits across and along it, in mm.
fn limits<const D: usize>(line: &Polyline<D>, chord: usize, vertex: Option<usize>) -> ([f64; D], [f64; 2]) {
    let across = 1.0 / (D.max(2) as f64 - 1.0).sqrt();
    let after = line.direction[chord];
    let Some(vertex) = vertex else {
        let epsilon = line.tolerance[chord];
        return (after, [FILL * across * epsilon, slip(line, chord) * epsilon]);
    };
    let epsilon = line.tolerance_at(vertex);
    let before = line.direction[vertex - 1];
    let sum: [f64; D] = std::array::from_fn(|k| before[k] + after[k]);
    let length = norm(&sum);
    let along = if length > 1e-3 { sum.map(|x| x / length) } else { after };
    let slip = slip(line, vertex - 1).min(slip(line, vertex));
    if line.turn(vertex) > SHARP {
        let slip = if line.pace.fitted { slip } else { SHARP_ALONG };
        (along, [SHARP_ACROSS * across * epsilon, slip * epsilon])
    } else {
        (along, [FILL * across * epsilon, slip * epsilon])
    }
}

/// The limit along a chord, in tolerances.
fn slip<const D: usize>(line: &Polyline<D>, chord: usize) -> f64 {
    let at_corners = line.hold[chord] == Hold::Free && line.hold[chord + 1] == Hold::Free;
    if at_corners && line.pace.fitted {
        FITTED_ALONG
    } else {
        1.0
    }
}

/// An orthonormal frame whose last direction is the given one: Gram–Schmidt, each time with the axis that leaves the longest
/// remainder.
fn frame<const D: usize>(along: &[f64; D]) -> [[f64; D]; D] {
    let mut out = [[0.0; D]; D];
    out[D - 1] = *along;
    let mut used = [false; D];
    for r in 0..D.saturating_sub(1) {
        let mut best = ([0.0; D], 0.0, 0);
        for axis in (0..D).filter(|&axis| !used[axis]) {
            let mut e = [0.0; D];
            e[axis] = 1.0;
            for known in out[..r].iter().chain(std::iter::once(along)) {
                let part = dot(&e, known);
                for k in 0..D {
                    e[k] -= part * known[k];
                }
            }
            let length = norm(&e);
            if length > best.1 {
                best = (e, length, axis);
            }
        }
        used[best.2] = true;
        out[r] = best.0.map(|x| x / best.1);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::pace::{Moment, Pace};
    use super::*;

    #[test]
    fn frames_are_orthonormal() {
        for along in [[1.0, 0.0, 0.0, 0.0], [0.5, -0.5, 0.5, 0.5], [1e-9, 0.6, 0.0, 0.8]] {
            let frame = frame(&along);
            for a in 0..4 {
                for b in 0..4 {
                    let expected = if a == b { 1.0 } else { 0.0 };
                    assert!((dot(&frame[a], &frame[b]) - expected).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn every_vertex_is_a_sample_and_the_sharp_one_is_held_along_its_bisector() {
        let mut line = Polyline::new(vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.1], [2.0, 2.0]], vec![0.1; 3]);
        let knots: Vec<f64> = (0..=4).map(|i| line.length() * i as f64 / 4.0).collect();
        let (rows, start) = rows(&line, &knots, 0, &[1.0; 4], &[0.0; 2]);
        assert_eq!((rows.len(), start[4]), (18, 18));
        let sharp: Vec<&Row<2>> = rows.iter().filter(|row| row.half[1] < 0.03).collect();
        let [corner] = sharp[..] else { panic!("one sharp vertex") };
        assert!(norm(&[corner.target[0] - 2.0, corner.target[1] - 0.1]) < 1e-15);
        assert!((corner.half[0] - 0.095).abs() < 1e-15);
        assert!((dot(&corner.direction[1], &[1.0, 1.0])).abs() > 1.3);
        // A curve that is fitted to a motion may slip along the polyline, but not where a vertex is held.
        let even = Moment { station: 0.0, speed_sq: 1.0, aim: [[0.0; 2]; 2] };
        line.pace = Pace::new(vec![even], [1.0; 2], [1.0; 2]);
        let along = |line: &Polyline<2>| {
            let (rows, _) = super::rows(line, &knots, 0, &[1.0; 4], &[0.0; 2]);
            rows.iter().map(|row| row.half[1]).fold(0.0, f64::max)
        };
        assert!((along(&line) - 1.0).abs() < 1e-15);
        (line.hold[1], line.hold[2]) = (Hold::Point, Hold::Point);
        assert!((along(&line) - 0.1).abs() < 1e-15);
    }
}
