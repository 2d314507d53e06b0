//! The programmed polyline of a run: vertices, stations, directions and tolerances.

use super::pace::Pace;
use feedplan_geometry::quadratic::{dot, norm, sub};

/// How a vertex acts on the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hold {
    /// The curve may be anywhere within the tolerance.
    Free,
    /// A point of a program, which may have noise.
    Point,
    /// A point of an arc or a spline, without noise.
    Exact,
}

/// A polyline: chords between vertices, each of them longer than 0.
#[derive(Clone, Debug, Default)]
pub struct Polyline<const D: usize> {
    pub vertex: Vec<[f64; D]>,
    /// Length of the chords before each vertex, in mm; it is the parameter u of the curve.
    pub station: Vec<f64>,
    /// Unit vector along each chord.
    pub direction: Vec<[f64; D]>,
    /// The greatest distance of the curve from each chord, in mm.
    pub tolerance: Vec<f64>,
    /// How each vertex acts on the curve.
    pub hold: Vec<Hold>,
    /// Whether bends keep their size: vertices that are held then pull the curve to them.
    pub sized: bool,
    /// The speed at which the curve is followed.
    pub pace: Pace<D>,
}

impl<const D: usize> Polyline<D> {
    /// The polyline through `vertex`, with a tolerance for each chord. All vertices are free, bends need not keep their size, and
    /// the pace is constant.
    pub fn new(vertex: Vec<[f64; D]>, tolerance: Vec<f64>) -> Self {
        let mut station = Vec::with_capacity(vertex.len());
        let mut direction = Vec::with_capacity(tolerance.len());
        let mut sum = 0.0;
        station.push(sum);
        for pair in vertex.windows(2) {
            let chord = sub(&pair[1], &pair[0]);
            let length = norm(&chord);
            sum += length;
            station.push(sum);
            direction.push(chord.map(|x| x / length));
        }
        let hold = vec![Hold::Free; vertex.len()];
        Self { vertex, station, direction, tolerance, hold, sized: false, pace: Pace::default() }
    }

    /// The part between two vertices, with stations from 0.
    pub fn part(&self, first: usize, last: usize) -> Self {
        let part = Self::new(self.vertex[first..=last].to_vec(), self.tolerance[first..last].to_vec());
        let pace = self.pace.from(self.station[first]);
        Self { hold: self.hold[first..=last].to_vec(), sized: self.sized, pace, ..part }
    }

    /// Number of chords.
    pub fn chords(&self) -> usize {
        self.tolerance.len()
    }

    pub fn length(&self) -> f64 {
        self.station[self.chords()]
    }

    pub fn chord_length(&self, i: usize) -> f64 {
        self.station[i + 1] - self.station[i]
    }

    /// The mean length of the chords at inner vertex i.
    pub fn mean_chord(&self, i: usize) -> f64 {
        0.5 * (self.station[i + 1] - self.station[i - 1])
    }

    /// The chord that contains station u.
    pub fn chord_at(&self, u: f64) -> usize {
        self.station[1..self.chords()].partition_point(|&station| station <= u)
    }

    /// The point at station u of chord i, or of the line through that chord.
    pub fn point(&self, i: usize, u: f64) -> [f64; D] {
        let (s, t) = (u - self.station[i], &self.direction[i]);
        std::array::from_fn(|k| self.vertex[i][k] + s * t[k])
    }

    /// The angle by which the polyline turns at inner vertex i, in rad.
    pub fn turn(&self, i: usize) -> f64 {
        angle(&self.direction[i - 1], &self.direction[i])
    }

    /// The smaller tolerance of the chords at vertex i.
    pub fn tolerance_at(&self, i: usize) -> f64 {
        let (before, after) = (i.max(1) - 1, i.min(self.chords() - 1));
        self.tolerance[before].min(self.tolerance[after])
    }

    /// The distance of a point from chord i, in mm.
    pub fn distance(&self, i: usize, point: &[f64; D]) -> f64 {
        let away = sub(point, &self.vertex[i]);
        let along = dot(&away, &self.direction[i]).clamp(0.0, self.chord_length(i));
        norm(&std::array::from_fn::<f64, D, _>(|k| away[k] - along * self.direction[i][k]))
    }
}

/// The angle between two vectors, in rad; 0 if one of them has length 0.
pub fn angle<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    2.0 * half_tangent(a, b).atan()
}

/// Whether the angle between two vectors is at most `most`, in rad; mostly without computing an arc tangent.
pub fn is_within<const D: usize>(a: &[f64; D], b: &[f64; D], most: f64) -> bool {
    let (half, tangent) = (0.5 * most, half_tangent(a, b));
    // t − t³/3 ≤ atan t ≤ t.
    tangent <= half || (tangent * (1.0 - tangent * tangent / 3.0) <= half && tangent.atan() <= half)
}

/// The tangent of half the angle between two vectors, accurate also for small angles; 0 if one of them has length 0.
fn half_tangent<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    let (p, q) = (norm(a), norm(b));
    if !(p > 0.0 && q > 0.0) {
        return 0.0;
    }
    let (x, y): ([f64; D], [f64; D]) =
        (std::array::from_fn(|k| a[k] / p - b[k] / q), std::array::from_fn(|k| a[k] / p + b[k] / q));
    (dot(&x, &x) / dot(&y, &y)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stations_turns_and_distances_of_an_elbow() {
        let elbow = Polyline::new(vec![[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]], vec![0.1, 0.2]);
        assert_eq!(elbow.station, [0.0, 3.0, 7.0]);
        assert!((elbow.turn(1) - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert_eq!((elbow.chord_at(2.9), elbow.chord_at(3.0), elbow.chord_at(7.0)), (0, 1, 1));
        assert_eq!((elbow.distance(0, &[4.0, 0.0]), elbow.distance(1, &[2.0, 1.0])), (1.0, 1.0));
        assert_eq!((elbow.tolerance_at(0), elbow.tolerance_at(1), elbow.tolerance_at(2)), (0.1, 0.1, 0.2));
        assert_eq!(elbow.point(1, 5.0), [3.0, 2.0]);
    }

    #[test]
    fn a_turn_is_within_what_is_more_than_it() {
        for turn in [0.0, 1e-9, 0.01, 1.0, 2.0, 3.0, std::f64::consts::PI] {
            let b = [2.0 * turn.cos(), 2.0 * turn.sin()];
            assert!((angle(&[3.0, 0.0], &b) - turn).abs() < 1e-15);
            assert!(is_within(&[3.0, 0.0], &b, turn * (1.0 + 1e-14)), "{turn}");
            assert!(turn == 0.0 || !is_within(&[3.0, 0.0], &b, turn * (1.0 - 1e-14)), "{turn}");
        }
    }
}
