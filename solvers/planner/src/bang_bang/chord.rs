//! The chord-error limit v² ≤ α ρ − 4 δ²/T², α = 8 δ/T², as lines: v² linear in t on short parts of a piece, from the
//! radius of curvature ρ [mm], the tolerance δ [mm] and the servo period T [s].
//!
//! ρ = |g|³/(|g × c| ω²) is no polynomial. A part is halved until a line below the limit gives away less than a fixed
//! fraction of it. The line is the secant, lowered by four times its greatest excess over samples of the limit.

use crate::problem::ChordLimit;

/// Fraction of the limit that a line may give away.
const GIVEN_AWAY: f64 = 2e-4;
/// Greatest number of halvings.
const MAX_DEPTH: u32 = 14;
/// Number of samples on a part, both ends included.
const SAMPLES: usize = 9;

/// An upper limit of v² [mm²/s²] on [from, to] of a piece, linear in t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLine {
    pub from: f64,
    pub to: f64,
    pub speed_sq: [f64; 2],
}

impl SpeedLine {
    /// v² at t, extrapolated beyond the ends.
    pub fn at(&self, t: f64) -> f64 {
        let [f0, f1] = self.speed_sq;
        if f0 == f1 {
            return f0;
        }
        f0 + (f1 - f0) * ((t - self.from) / (self.to - self.from))
    }
}

impl ChordLimit {
    /// Appends the lines of a piece, at most `feed_sq`. `radius` is ρ at t, infinite where the path is straight.
    pub fn lines(&self, radius: &impl Fn(f64) -> f64, feed_sq: f64, out: &mut Vec<SpeedLine>) {
        self.halve(radius, feed_sq, (0.0, 1.0), 0, out);
    }

    fn halve(
        &self,
        radius_at: &impl Fn(f64) -> f64,
        feed_sq: f64,
        (from, to): (f64, f64),
        depth: u32,
        out: &mut Vec<SpeedLine>,
    ) {
        let sample = |i: usize| from + (to - from) * (i as f64 / (SAMPLES - 1) as f64);
        let radius: [f64; SAMPLES] = std::array::from_fn(|i| radius_at(sample(i)));
        let limit = radius.map(|radius| self.speed_sq(radius));
        let binds = |i: usize| limit[i] < 1.01 * feed_sq && limit[i] < 1.01 * self.acceleration * radius[i];
        if depth >= 2 && !(0..SAMPLES).any(binds) {
            out.push(SpeedLine { from, to, speed_sq: [feed_sq; 2] });
            return;
        }
        let (first, last) = (limit[0], limit[SAMPLES - 1]);
        let (mut below, mut above) = (0.0_f64, 0.0_f64);
        for (i, &limit) in limit.iter().enumerate() {
            let line = first + (last - first) * (i as f64 / (SAMPLES - 1) as f64);
            below = below.max((line - limit) / limit);
            above = above.max((limit - line) / limit);
        }
        let seen = 4.0 * below.max(above / 16.0);
        if depth == MAX_DEPTH || (depth >= 2 && seen + above < GIVEN_AWAY) {
            let speed_sq = [first, last].map(|limit| ((1.0 - seen.min(0.5)) * limit).min(feed_sq));
            out.push(SpeedLine { from, to, speed_sq });
            return;
        }
        let middle = 0.5 * (from + to);
        self.halve(radius_at, feed_sq, (from, middle), depth + 1, out);
        self.halve(radius_at, feed_sq, (middle, to), depth + 1, out);
    }

    /// The greatest v² at the radius of curvature ρ.
    fn speed_sq(&self, radius: f64) -> f64 {
        // Where ρ < δ, no part of the path shorter than 2 δ is farther than δ from its chord.
        if radius > self.tolerance {
            self.alpha * radius.min(1e300) - self.slow_sq
        } else {
            self.slow_sq
        }
    }
}
