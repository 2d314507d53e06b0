//! The chord-error limit v² ≤ α ρ − 4 δ²/T², α = 8 δ/T², as bounds linear in t on short enough parts of a piece.
//!
//! ρ = |g|³/(|g × g'| ω²) is no polynomial. A part is halved until a straight line below the limit gives away less than
//! a set part of it; how far the line must lie below is four times what is seen at places between its ends.

use crate::problem::ChordLimit;

/// Part of the limit that may be given away.
const GIVEN_AWAY: f64 = 2e-4;
/// Parts are not halved further than this.
const MAX_DEPTH: u32 = 14;
/// Places looked at on a part, its ends among them.
const PLACES: usize = 9;

/// The greatest v² on [from, to] of a piece, linear in t from one end to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLine {
    pub from: f64,
    pub to: f64,
    pub speed_sq: [f64; 2],
}

impl SpeedLine {
    /// v² at t, also beyond the ends.
    pub fn at(&self, t: f64) -> f64 {
        let [f0, f1] = self.speed_sq;
        if f0 == f1 {
            return f0;
        }
        f0 + (f1 - f0) * ((t - self.from) / (self.to - self.from))
    }
}

impl ChordLimit {
    /// Appends the greatest v² over a piece, at most `feed_sq`; `radius` is ρ at t, infinite where the path is straight.
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
        let place = |i: usize| from + (to - from) * (i as f64 / (PLACES - 1) as f64);
        let radius: [f64; PLACES] = std::array::from_fn(|i| radius_at(place(i)));
        let limit = radius.map(|radius| self.speed_sq(radius));
        let binds = |i: usize| limit[i] < 1.01 * feed_sq && limit[i] < 1.01 * self.acceleration * radius[i];
        if depth >= 2 && !(0..PLACES).any(binds) {
            out.push(SpeedLine { from, to, speed_sq: [feed_sq; 2] });
            return;
        }
        let (first, last) = (limit[0], limit[PLACES - 1]);
        let (mut below, mut above) = (0.0_f64, 0.0_f64);
        for (i, &limit) in limit.iter().enumerate() {
            let line = first + (last - first) * (i as f64 / (PLACES - 1) as f64);
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

    /// The greatest v² where the radius of curvature is ρ.
    fn speed_sq(&self, radius: f64) -> f64 {
        // Where ρ < δ no part of the path shorter than 2 δ leaves its chord by δ.
        if radius > self.tolerance {
            self.alpha * radius.min(1e300) - self.slow_sq
        } else {
            self.slow_sq
        }
    }
}
