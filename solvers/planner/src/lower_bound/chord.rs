//! The chord-error limit v² ≤ α ρ − 4 δ²/T² (see `ChordLimit`): its greatest v² at a station, and the least time of
//! an interval under it.

use super::hodograph::{Hodograph, Station};
use super::{DOWN, UP};
use crate::problem::ChordLimit;
use feedplan_geometry::polynomial::Polynomial;

/// The Wronskian of polynomials of degree 16 has degree 30.
type Wronskian = Polynomial<40>;

/// A part of an interval is halved while the greatest limit on it exceeds the lower one at its ends by more than this fraction.
const VARIES: f64 = 3e-3;
/// A part with a convex limit is halved while the limit in the middle is below the secant by more than this fraction.
const SAGS: f64 = 4e-3;
const MOST_HALVINGS: u32 = 9;

impl<const M: usize, const C: usize, const R: usize> Hodograph<M, C, R> {
    /// An upper bound of v² [mm²/s²] that the chord error allows at a station.
    pub fn chord_speed_sq(&self, chord: &ChordLimit, station: &Station<M>) -> f64 {
        let (mut square, mut cross_sq) = (0.0, 0.0);
        for j in 0..M {
            square += (station.g[j].abs() + self.noise[j]).powi(2);
            for k in j + 1..M {
                cross_sq += self.wronskian(station, j, k).powi(2);
            }
        }
        speed_sq(chord, square, cross_sq, station.weight_sq)
    }

    /// A lower bound of the time [s] from `a` to `b` under the chord-error limit and the feed, given squared.
    pub fn chord_time(&self, chord: &ChordLimit, feed_sq: f64, a: &Station<M>, b: &Station<M>) -> f64 {
        let ends = [a, b].map(|station| self.chord_speed_sq(chord, station));
        if self.degree == 1 && !self.is_rational() {
            self.convex_time(chord, feed_sq, [a, b], ends, 0)
        } else {
            self.halved_time(chord, feed_sq, [a, b], ends, 0)
        }
    }

    /// A lower bound of the time [s] for linear g. There |g × c| is constant, and |g|³ as a function of the length l, dl = |g|
    /// dt, has the second derivative 3 |c|²/|g|. So the limit of v² is a convex function of the length and lies below its
    /// secants.
    fn convex_time(
        &self,
        chord: &ChordLimit,
        feed_sq: f64,
        [a, b]: [&Station<M>; 2],
        [x, y]: [f64; 2],
        halvings: u32,
    ) -> f64 {
        let middle = &self.station(0.5 * (a.t + b.t));
        let z = self.chord_speed_sq(chord, middle);
        if halvings < MOST_HALVINGS && (0.5 * (x + y)).min(feed_sq) > (1.0 + SAGS) * z.min(feed_sq) {
            return self.convex_time(chord, feed_sq, [a, middle], [x, z], halvings + 1)
                + self.convex_time(chord, feed_sq, [middle, b], [z, y], halvings + 1);
        }
        secant_time(self.chord(a, middle), feed_sq, x, z) + secant_time(self.chord(middle, b), feed_sq, z, y)
    }

    /// A lower bound of the time [s] from the greatest speed on each part; parts are halved until it is nearly that at their
    /// ends.
    fn halved_time(
        &self,
        chord: &ChordLimit,
        feed_sq: f64,
        [a, b]: [&Station<M>; 2],
        [x, y]: [f64; 2],
        halvings: u32,
    ) -> f64 {
        let greatest = self.greatest_chord_speed_sq(chord, a, b).min(feed_sq);
        if halvings < MOST_HALVINGS && x.min(y) < feed_sq && greatest > (1.0 + VARIES) * x.min(y) {
            let middle = &self.station(0.5 * (a.t + b.t));
            let z = self.chord_speed_sq(chord, middle);
            return self.halved_time(chord, feed_sq, [a, middle], [x, z], halvings + 1)
                + self.halved_time(chord, feed_sq, [middle, b], [z, y], halvings + 1);
        }
        self.chord(a, b) / greatest.sqrt() * DOWN
    }

    /// A lower bound of the length [mm] between two stations.
    fn chord(&self, a: &Station<M>, b: &Station<M>) -> f64 {
        self.distances(a, b).least.iter().map(|distance| distance * distance).sum::<f64>().sqrt() * DOWN
    }

    /// An upper bound of v² between two stations: |g| is at most its longest coefficient, and each component of g × c at least
    /// its smallest coefficient.
    fn greatest_chord_speed_sq(&self, chord: &ChordLimit, a: &Station<M>, b: &Station<M>) -> f64 {
        let n = self.degree;
        let part = self.part(a.t, b.t);
        let h = b.t - a.t;
        let length_sq = |row: &[f64; M]| (0..M).map(|k| (row[k].abs() + self.noise[k]).powi(2)).sum();
        let square = part[..=n].iter().map(length_sq).fold(0.0, f64::max);
        let mut cross_sq = 0.0;
        for j in 0..M {
            for k in j + 1..M {
                let axis = |k: usize| Wronskian::from_bernstein(part[..=n].iter().map(|row| row[k]));
                let (low, high) = axis(j).wronskian(&axis(k)).range();
                let error = 8.0 * (n as f64) * (self.size[j] * self.noise[k] + self.size[k] * self.noise[j]);
                let least = (low.max(-high) - error).max(0.0) / h;
                cross_sq += least * least;
            }
        }
        let weight = (a.weight_sq.sqrt() - self.weight_change(h)).max(self.least_weight()) * DOWN;
        speed_sq(chord, square, cross_sq, weight * weight)
    }
}

/// An upper bound of v² where the radius of curvature is at most |g|³/(|g × c| ω²).
fn speed_sq(chord: &ChordLimit, square: f64, cross_sq: f64, weight_sq: f64) -> f64 {
    let radius = square * square.sqrt() / (cross_sq.sqrt() * weight_sq) * UP;
    chord.slow_sq.max(chord.alpha * radius - chord.slow_sq) * UP
}

/// A lower bound of the time [s] over a length on which v² is at most a linear function from x to y, and at most `feed_sq`.
fn secant_time(length: f64, feed_sq: f64, x: f64, y: f64) -> f64 {
    let (low, high) = (x.min(y), x.max(y));
    let feed = feed_sq.sqrt();
    let share = if high <= feed_sq { 1.0 } else { ((feed_sq - low) / (high - low)).max(0.0) };
    length
        * (2.0 * share / (low.min(feed_sq).sqrt() + high.min(feed_sq).sqrt()) + (1.0 - share) / feed)
        * DOWN
}
