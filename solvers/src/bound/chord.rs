//! The chord-error limit v² ≤ α ρ − 4 δ²/T² at a node and over a cell; see `ChordLimit`.

use super::hodograph::{Hodograph, Node};
use super::{DOWN, UP};
use crate::planning::ChordLimit;
use crate::polynomial::Polynomial;

/// g' and g of degree 16 give a polynomial of degree 30.
type Twist = Polynomial<40>;

/// A part of a cell is halved while the limit varies by more than this part on it, so often at most.
const VARIES: f64 = 3e-3;
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
    pub fn chord_time(
        &self,
        chord: &ChordLimit,
        feed_sq: f64,
        a: &Node<M>,
        b: &Node<M>,
        halvings: u32,
    ) -> f64 {
        let ends = [self.chord_speed_sq(chord, a), self.chord_speed_sq(chord, b)];
        // Where g is linear |g × g'| is constant and |g| greatest at an end.
        let greatest = if self.degree == 1 && !self.is_rational() {
            ends[0].max(ends[1])
        } else {
            self.greatest_chord_speed_sq(chord, a, b)
        };
        let ends = ends[0].min(ends[1]);
        if halvings < MOST_HALVINGS && ends < feed_sq && greatest.min(feed_sq) > (1.0 + VARIES) * ends {
            let middle = self.node(0.5 * (a.t + b.t));
            return self.chord_time(chord, feed_sq, a, &middle, halvings + 1)
                + self.chord_time(chord, feed_sq, &middle, b, halvings + 1);
        }
        let way: f64 = self.ways(a, b).least.iter().map(|way| way * way).sum();
        (way / greatest.min(feed_sq)).sqrt() * DOWN
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
