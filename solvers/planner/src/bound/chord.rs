//! The chord-error limit v² ≤ α ρ − 4 δ²/T² at a node and over a cell; see `ChordLimit`.

use super::hodograph::{Hodograph, Node};
use super::{DOWN, UP};
use crate::problem::ChordLimit;
use feedplan_geometry::polynomial::Polynomial;

/// g' and g of degree 16 give a polynomial of degree 30.
type Twist = Polynomial<40>;

/// A part of a cell is halved while the limit varies by more than this part on it, so often at most.
const VARIES: f64 = 3e-3;
/// The same for what it is below the secant in the middle.
const SAGS: f64 = 4e-3;
const MOST_HALVINGS: u32 = 9;

impl<const M: usize, const C: usize, const R: usize> Hodograph<M, C, R> {
    /// Not below the greatest v² at a node.
    pub fn chord_speed_sq(&self, chord: &ChordLimit, node: &Node<M>) -> f64 {
        let (mut square, mut twist_sq) = (0.0, 0.0);
        for j in 0..M {
            square += (node.g[j].abs() + self.noise[j]).powi(2);
            for k in j + 1..M {
                twist_sq += self.twist(node, j, k).powi(2);
            }
        }
        speed_sq(chord, square, twist_sq, node.weight_sq)
    }

    /// Not above the time from `a` to `b` at no more than this limit and `feed_sq`.
    pub fn chord_time(&self, chord: &ChordLimit, feed_sq: f64, a: &Node<M>, b: &Node<M>) -> f64 {
        let ends = [a, b].map(|node| self.chord_speed_sq(chord, node));
        if self.degree == 1 && !self.is_rational() {
            self.convex_time(chord, feed_sq, [a, b], ends, 0)
        } else {
            self.halved_time(chord, feed_sq, [a, b], ends, 0)
        }
    }

    /// Where g is linear, |g × g'| is constant, and so |g|³, in the length s with ds = |g| dτ, has the second derivative
    /// 3 |g'|²/|g|: the limit of v² is convex in the length, and below its secant.
    fn convex_time(
        &self,
        chord: &ChordLimit,
        feed_sq: f64,
        [a, b]: [&Node<M>; 2],
        [x, y]: [f64; 2],
        halvings: u32,
    ) -> f64 {
        let middle = &self.node(0.5 * (a.t + b.t));
        let z = self.chord_speed_sq(chord, middle);
        if halvings < MOST_HALVINGS && (0.5 * (x + y)).min(feed_sq) > (1.0 + SAGS) * z.min(feed_sq) {
            return self.convex_time(chord, feed_sq, [a, middle], [x, z], halvings + 1)
                + self.convex_time(chord, feed_sq, [middle, b], [z, y], halvings + 1);
        }
        secant_time(self.chord(a, middle), feed_sq, x, z) + secant_time(self.chord(middle, b), feed_sq, z, y)
    }

    /// By the greatest speed on parts, halved until it is nearly that at their ends.
    fn halved_time(
        &self,
        chord: &ChordLimit,
        feed_sq: f64,
        [a, b]: [&Node<M>; 2],
        [x, y]: [f64; 2],
        halvings: u32,
    ) -> f64 {
        let greatest = self.greatest_chord_speed_sq(chord, a, b).min(feed_sq);
        if halvings < MOST_HALVINGS && x.min(y) < feed_sq && greatest > (1.0 + VARIES) * x.min(y) {
            let middle = &self.node(0.5 * (a.t + b.t));
            let z = self.chord_speed_sq(chord, middle);
            return self.halved_time(chord, feed_sq, [a, middle], [x, z], halvings + 1)
                + self.halved_time(chord, feed_sq, [middle, b], [z, y], halvings + 1);
        }
        self.chord(a, b) / greatest.sqrt() * DOWN
    }

    /// Not above the length between two nodes.
    fn chord(&self, a: &Node<M>, b: &Node<M>) -> f64 {
        self.ways(a, b).least.iter().map(|way| way * way).sum::<f64>().sqrt() * DOWN
    }

    /// Not below the greatest v² between two nodes: |g| is at most its longest coefficient, each component of g × g'
    /// at least the smallest of its own.
    fn greatest_chord_speed_sq(&self, chord: &ChordLimit, a: &Node<M>, b: &Node<M>) -> f64 {
        let n = self.degree;
        let part = self.part(a.t, b.t);
        let h = b.t - a.t;
        let length_sq = |row: &[f64; M]| (0..M).map(|k| (row[k].abs() + self.noise[k]).powi(2)).sum();
        let square = part[..=n].iter().map(length_sq).fold(0.0, f64::max);
        let mut twist_sq = 0.0;
        for j in 0..M {
            for k in j + 1..M {
                let axis = |k: usize| Twist::from_bernstein(part[..=n].iter().map(|row| row[k]));
                let (low, high) = axis(j).wronskian(&axis(k)).range();
                let error = 8.0 * (n as f64) * (self.size[j] * self.noise[k] + self.size[k] * self.noise[j]);
                let least = (low.max(-high) - error).max(0.0) / h;
                twist_sq += least * least;
            }
        }
        let weight = (a.weight_sq.sqrt() - self.weight_change(h)).max(self.least_weight()) * DOWN;
        speed_sq(chord, square, twist_sq, weight * weight)
    }
}

/// Not below the limit of v² where the radius is |g|³/(|g × g'| ω²) or less.
fn speed_sq(chord: &ChordLimit, square: f64, twist_sq: f64, weight_sq: f64) -> f64 {
    let radius = square * square.sqrt() / (twist_sq.sqrt() * weight_sq) * UP;
    chord.slow_sq.max(chord.alpha * radius - chord.slow_sq) * UP
}

/// Not above the time over a length on which v² changes evenly from x to y, or in that order back, up to a feed.
fn secant_time(length: f64, feed_sq: f64, x: f64, y: f64) -> f64 {
    let (low, high) = (x.min(y), x.max(y));
    let feed = feed_sq.sqrt();
    let share = if high <= feed_sq { 1.0 } else { ((feed_sq - low) / (high - low)).max(0.0) };
    length
        * (2.0 * share / (low.min(feed_sq).sqrt() + high.min(feed_sq).sqrt()) + (1.0 - share) / feed)
        * DOWN
}
