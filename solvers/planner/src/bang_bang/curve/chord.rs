//! The chord-error limit v² ≤ α ρ − 4 δ²/T², α = 8 δ/T², as lines: v² linear in t on short parts of a piece, from the
//! radius of curvature ρ [mm], the tolerance δ [mm] and the servo period T [s].
//!
//! ρ = |g|³/(|g × c| ω²) is not a polynomial. A part is halved until a line below the limit is lower than the limit by less
//! than a fixed fraction. The line is the secant, lowered by four times its greatest relative excess over samples of the limit,
//! or, if that is more, by a quarter of its greatest relative distance below them. A lower bound of ρ, proven from Bernstein
//! coefficients, shows where no line is needed, and that the samples miss no narrow turn.

use super::piece::Piece;
use crate::bang_bang::speed_line::SpeedLine;
use crate::problem::ChordLimit;

/// Greatest fraction of the limit by which a line may lie below it.
const GIVEN_AWAY: f64 = 2e-4;
/// Greatest number of halvings.
const MAX_DEPTH: u32 = 14;
/// Number of samples on a part, both ends included.
const SAMPLES: usize = 9;
/// The samples on a part are trusted if the proven lower bound of the limit is at least this fraction of the least sample.
const SHOWN: f64 = 0.5;

impl ChordLimit {
    /// Appends lines that cover the piece; none is above the limit or above `feed_sq` [mm²/s²].
    pub fn lines<const M: usize, const C: usize>(
        &self,
        piece: &Piece<M, C>,
        feed_sq: f64,
        out: &mut Vec<SpeedLine>,
    ) {
        self.halve(piece, feed_sq, [0.0, 1.0], 0, out);
    }

    fn halve<const M: usize, const C: usize>(
        &self,
        piece: &Piece<M, C>,
        feed_sq: f64,
        [from, to]: [f64; 2],
        depth: u32,
        out: &mut Vec<SpeedLine>,
    ) {
        let least_radius = piece.least_radius([from, to]);
        let least = self.speed_sq(least_radius);
        if least >= feed_sq || self.is_free(least_radius) {
            out.push(SpeedLine { from, to, speed_sq: [feed_sq; 2] });
            return;
        }
        let sample = |i: usize| from + (to - from) * (i as f64 / (SAMPLES - 1) as f64);
        let limit: [f64; SAMPLES] = std::array::from_fn(|i| self.speed_sq(piece.radius(sample(i))));
        let (first, last) = (limit[0], limit[SAMPLES - 1]);
        let (mut below, mut above) = (0.0_f64, 0.0_f64);
        for (i, &limit) in limit.iter().enumerate() {
            let line = first + (last - first) * (i as f64 / (SAMPLES - 1) as f64);
            below = below.max((line - limit) / limit);
            above = above.max((limit - line) / limit);
        }
        let seen = 4.0 * below.max(above / 16.0);
        let shown = least >= SHOWN * limit.into_iter().fold(f64::INFINITY, f64::min);
        if depth == MAX_DEPTH || (depth >= 2 && shown && seen + above < GIVEN_AWAY) {
            let speed_sq = [first, last].map(|limit| ((1.0 - seen.min(0.5)) * limit).min(feed_sq));
            out.push(SpeedLine { from, to, speed_sq });
            return;
        }
        let middle = 0.5 * (from + to);
        self.halve(piece, feed_sq, [from, middle], depth + 1, out);
        self.halve(piece, feed_sq, [middle, to], depth + 1, out);
    }

    /// Whether at this radius of curvature [mm] and at all greater ones the acceleration limits allow less speed than this limit.
    fn is_free(&self, radius: f64) -> bool {
        radius > self.tolerance
            && self.alpha > self.acceleration
            && self.speed_sq(radius) >= self.acceleration * radius
    }

    /// The greatest v² [mm²/s²] at a radius of curvature [mm].
    fn speed_sq(&self, radius: f64) -> f64 {
        // Where ρ < δ, no part of the path shorter than 2 δ is farther than δ from its chord, so v = 2 δ/T is allowed.
        if radius > self.tolerance {
            self.alpha * radius.min(1e300) - self.slow_sq
        } else {
            self.slow_sq
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_narrower_than_the_distance_of_samples_has_its_limit() {
        // A spline G5 that almost stops near its end: over 3 % of t the radius falls from 0.1 to 0.003 mm.
        let control = [[0.0, 0.0], [0.50544, -5.36786], [-3.034, -1.79], [-2.97309, -1.99609]];
        let piece = Piece::<2, 8>::new(&control, &[], None);
        let Some(chord) = ChordLimit::new(0.01, 0.004, 6000.0) else { panic!("a limit") };
        let feed_sq = 5.858_f64.powi(2);
        let mut lines = vec![];
        chord.lines(&piece, feed_sq, &mut lines);
        let ends = lines.windows(2).map(|pair| (pair[0].to, pair[1].from));
        assert!(ends.into_iter().all(|(to, from)| to == from));
        let mut slowest = f64::INFINITY;
        for line in &lines {
            for i in 0..=200 {
                let t = line.from + (line.to - line.from) * f64::from(i) / 200.0;
                let most = chord.speed_sq(piece.radius(t)).min(feed_sq);
                assert!(line.at(t) <= most * (1.0 + 1e-12), "{} for {most} at {t}", line.at(t));
                slowest = slowest.min(line.at(t));
            }
        }
        assert!(slowest > 0.98 * chord.slow_sq, "{slowest}");
        assert!(lines.len() < 100, "{}", lines.len());
    }
}
