//! Cuts a curved piece where an axis turns round and where the lowest velocity cap changes.
//!
//! The chord-error limit v² ≤ α ρ − 4 δ²/T², α = 8 δ/T², ρ = D^1.5/|W|, is taken as p ≤ f √D with
//! f = (α/|W|)(1 − δ/(2 ρ_min)), ρ_min on the sub-piece: on the safe side, and too low by at most δ/(4 ρ_min) of v²
//! where ρ doubles within the sub-piece. So the piece is cut where ρ doubles, as far as that part matters. Where
//! ρ < δ no part of the path shorter than 2 δ leaves its chord by δ: the limit is the constant speed 2 δ/T.

use super::piece::Piece;
use super::subpiece::{Axes, Cap, Orientation, SubPiece};
use super::turns::{Mark, EDGE};
use crate::bernstein::{multiply, parabola_sign_changes, product, sign_changes};
use crate::planning::ChordLimit;
use crate::AxisBits;
use feedplan_geometry::quadratic::dot;

/// Cuts closer than this part of a stretch are one.
const SAME_CUT: f64 = 1e-14;
/// Beyond this many δ the radius varies without a difference to the chord-error limit.
const LAST_DOUBLING: f64 = 512.0;

impl ChordLimit {
    /// Whether the limit can bind on the piece.
    fn binds<const M: usize>(&self, piece: &Piece<M>, feed_sq: f64) -> bool {
        let least = piece.least_speed_sq();
        let least_cube = least * least.sqrt();
        let least_limit = self.alpha * least_cube - self.slow_sq * piece.twist;
        least_limit < feed_sq * piece.twist && least_limit < self.acceleration * least_cube
    }
}

/// A part of a curved piece under one velocity cap, and what the passes need to know of it.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// The marks of its stretch, and where it begins and ends on that, from 0 to 1.
    marks: [Mark; 2],
    from: f64,
    to: f64,
    pub cap: Cap,
    /// Bit k: axis k moves backward.
    pub negative: AxisBits,
}

/// A part with its place on the piece.
pub struct Placed<'a, const M: usize> {
    pub sub: SubPiece<'a, M>,
    /// t at both ends
    pub from: f64,
    pub to: f64,
}

impl Part {
    /// The part as a sub-piece travelled forward, or backward.
    #[inline(always)]
    pub fn place<'a, const M: usize>(
        &self,
        piece: &'a Piece<M>,
        axes: &Axes<M>,
        backward: bool,
    ) -> Placed<'a, M> {
        let sign: [f64; M] = std::array::from_fn(|k| if self.negative >> k & 1 == 1 { -1.0 } else { 1.0 });
        let reflect = |tangent: &[f64; M]| -> [f64; M] { std::array::from_fn(|k| sign[k] * tangent[k]) };
        let (length, from, to, ends);
        if self.marks == [EDGE, EDGE] && self.from == 0.0 && self.to == 1.0 {
            (length, from, to, ends) = (1.0, 0.0, 1.0, [reflect(&piece.left), reflect(&piece.right)]);
        } else {
            let stretch = piece.stretch(self.marks[0], self.marks[1]);
            length = (self.to - self.from) * stretch.length;
            let place = |part: f64| match part {
                0.0 => stretch.begin,
                1.0 => stretch.end,
                _ => stretch.begin + part * stretch.length,
            };
            (from, to) = (place(self.from), place(self.to));
            // An axis that does not turn may come out on the wrong side of zero by rounding.
            let tangent = |part: f64| reflect(&stretch.piece.tangent(part)).map(|value| value.max(0.0));
            ends = [tangent(self.from), tangent(self.to)];
        }
        let [left, right] = ends;
        let (ends, travel) = if backward { ([right, left], -1.0) } else { ([left, right], 1.0) };
        let bend = std::array::from_fn(|k| travel * sign[k] * (piece.right[k] - piece.left[k]));
        let orientation = Orientation { sign, travel };
        Placed { sub: SubPiece::new(length, ends, bend, piece, orientation, self.cap, axes), from, to }
    }
}

/// Cuts pieces; holds the space for it.
#[derive(Default)]
pub struct Splitter {
    cuts: Vec<f64>,
    pub parts: Vec<Part>,
}

/// What the cuts depend on.
struct Limits<'a, const M: usize> {
    axes: &'a Axes<M>,
    feed_sq: f64,
    chord: Option<ChordLimit>,
    /// Bit k: axis k can be faster than its limit at the feed.
    fast: AxisBits,
}

impl Splitter {
    /// Fills `parts` from left to right.
    #[inline(always)]
    pub fn split<const M: usize>(
        &mut self,
        piece: &Piece<M>,
        axes: &Axes<M>,
        feed_sq: f64,
        chord: Option<ChordLimit>,
    ) {
        let (left, right) = (&piece.left, &piece.right);
        self.parts.clear();
        let (mut fast, mut negative) = (0, 0);
        let mut turns = false;
        for k in 0..M {
            if left[k] + right[k] < 0.0 {
                negative |= 1 << k;
            }
            turns |= left[k] * right[k] < 0.0;
            if axes.velocity_sq[k] < feed_sq && too_fast(piece, k, axes.velocity_sq[k], feed_sq) {
                fast |= 1 << k;
            }
        }
        let chord = chord.filter(|chord| chord.binds(piece, feed_sq));
        if fast == 0 && !turns && chord.is_none() {
            let cap = Cap::SpeedSq(feed_sq);
            self.parts.push(Part { marks: [EDGE, EDGE], from: 0.0, to: 1.0, cap, negative });
        } else {
            self.cut(piece, &Limits { axes, feed_sq, chord, fast });
        }
    }

    /// Cuts between two turns, then between two doublings of the radius, then between two changes of the cap.
    fn cut<const M: usize>(&mut self, piece: &Piece<M>, limits: &Limits<M>) {
        let (turns, count) = piece.turns();
        let mut from = EDGE;
        for i in 0..=count {
            let to = if i == count { EDGE } else { turns[i] };
            let stretch = piece.stretch(from, to);
            if stretch.length > 0.0 {
                let first = self.parts.len();
                match limits.chord {
                    Some(chord) => self.cut_by_radius(&stretch.piece, limits, chord, piece.twist),
                    None => self.cut_by_cap(&stretch.piece, limits, limits.feed_sq, None, (0.0, 1.0)),
                }
                let (left, right) = (&stretch.piece.left, &stretch.piece.right);
                let negative = (0..M).fold(0, |bits, k| bits | AxisBits::from(left[k] + right[k] < 0.0) << k);
                for part in &mut self.parts[first..] {
                    part.marks = [from, to];
                    part.negative = negative;
                }
            }
            from = to;
        }
    }

    /// Cuts a stretch where the radius doubles.
    #[cold]
    fn cut_by_radius<const M: usize>(
        &mut self,
        stretch: &Piece<M>,
        limits: &Limits<M>,
        chord: ChordLimit,
        twist: f64,
    ) {
        let mut levels = vec![0.0, 1.0];
        let mut radius = chord.tolerance;
        let no_limit = (limits.feed_sq + chord.slow_sq) / chord.alpha;
        while radius <= (chord.tolerance * LAST_DOUBLING).min(2.0 * no_limit) {
            // D where ρ = D^1.5/|W| has this value.
            let d = (radius * twist).powf(2.0 / 3.0);
            parabola_sign_changes(&stretch.speed.map(|value| value - d), &mut |t| levels.push(t));
            radius *= 2.0;
        }
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|b, a| *b - *a <= SAME_CUT);
        if let Some(last) = levels.last_mut() {
            *last = 1.0;
        }
        let bend: [f64; M] = std::array::from_fn(|k| stretch.right[k] - stretch.left[k]);
        let lowest = -dot(&stretch.left, &bend) / dot(&bend, &bend);
        for level in levels.windows(2) {
            let (a, b) = (level[0], level[1]);
            let radius_at = |t: f64| {
                let g = stretch.tangent(t);
                let d = dot(&g, &g);
                d * d.sqrt() / twist
            };
            if radius_at(0.5 * (a + b)) < chord.tolerance {
                self.cut_by_cap(stretch, limits, limits.feed_sq.min(chord.slow_sq), None, (a, b));
                continue;
            }
            let least =
                radius_at(a).min(radius_at(b)).min(radius_at(lowest.clamp(a, b))).max(chord.tolerance);
            let factor = chord.alpha / twist * (1.0 - chord.tolerance / (2.0 * least));
            self.cut_by_cap(stretch, limits, limits.feed_sq, Some(factor), (a, b));
        }
    }

    /// Cuts [from, to] of a stretch where the lowest cap changes, and names it on each part.
    fn cut_by_cap<const M: usize>(
        &mut self,
        stretch: &Piece<M>,
        limits: &Limits<M>,
        speed_sq: f64,
        chord: Option<f64>,
        (from, to): (f64, f64),
    ) {
        let (axes, fast) = (limits.axes, limits.fast);
        let cuts = &mut self.cuts;
        cuts.clear();
        let mut cut = |t: f64| {
            if t > from + SAME_CUT && t < to - SAME_CUT {
                cuts.push(t);
            }
        };
        let is_fast = |k: usize| fast >> k & 1 == 1;
        for j in (0..M).filter(|&j| is_fast(j)) {
            let v_sq = axes.velocity_sq[j];
            // Against the speed: v² q'_j² = V_j² D.
            parabola_sign_changes(&excess(stretch, j, v_sq, speed_sq), &mut cut);
            // Against another axis: V_j |q'_k| = V_k |q'_j|.
            for k in (j + 1..M).filter(|&k| is_fast(k)) {
                let (v_j, v_k) = (v_sq.sqrt(), axes.velocity_sq[k].sqrt());
                for sign in [1.0, -1.0] {
                    let at = |g: &[f64; M]| v_j * g[k] - sign * v_k * g[j];
                    sign_changes(&[at(&stretch.left), at(&stretch.right)], &mut cut);
                }
            }
            // Against the chord error: V_j⁴ = f² D q'_j⁴.
            if let Some(factor) = chord {
                let g_sq = axis_sq(stretch, j);
                let six: [f64; 7] = product(&multiply(&g_sq, &g_sq), &stretch.speed);
                sign_changes(&six.map(|value| factor * factor * value - v_sq * v_sq), &mut cut);
            }
        }
        if let Some(factor) = chord {
            let d = (speed_sq / factor).powf(2.0 / 3.0);
            parabola_sign_changes(&stretch.speed.map(|value| value - d), &mut cut);
        }
        cuts.sort_by(f64::total_cmp);
        cuts.push(to);
        let (start, mut from) = (from, from);
        for &to in cuts.iter() {
            if to - from <= SAME_CUT {
                continue;
            }
            let g = stretch.tangent(0.5 * (from + to));
            let d = dot(&g, &g);
            let mut lowest = speed_sq / d;
            let mut cap = Cap::SpeedSq(speed_sq);
            for k in (0..M).filter(|&k| is_fast(k)) {
                if g[k] * g[k] * lowest > axes.velocity_sq[k] {
                    lowest = axes.velocity_sq[k] / (g[k] * g[k]);
                    cap = Cap::AxisSq(k as u8, axes.velocity_sq[k]);
                }
            }
            if let Some(factor) = chord {
                if factor * d.sqrt() < lowest {
                    cap = Cap::Chord(factor);
                }
            }
            match self.parts.last_mut() {
                Some(part) if part.to == from && part.from >= start && part.cap == cap => part.to = to,
                _ => self.parts.push(Part { marks: [EDGE, EDGE], from, to, cap, negative: 0 }),
            }
            from = to;
        }
    }
}

/// q'_k² in Bernstein form.
#[inline(always)]
fn axis_sq<const M: usize>(piece: &Piece<M>, k: usize) -> [f64; 3] {
    let (a, b) = (piece.left[k], piece.right[k]);
    [a * a, a * b, b * b]
}

/// v² q'_k² − V² D: positive where axis k at the speed v would be faster than V.
#[inline(always)]
fn excess<const M: usize>(piece: &Piece<M>, k: usize, velocity_sq: f64, speed_sq: f64) -> [f64; 3] {
    let g_sq = axis_sq(piece, k);
    std::array::from_fn(|i| speed_sq * g_sq[i] - velocity_sq * piece.speed[i])
}

/// Whether axis k could be faster than V anywhere at this speed.
#[inline(always)]
fn too_fast<const M: usize>(piece: &Piece<M>, k: usize, velocity_sq: f64, speed_sq: f64) -> bool {
    excess(piece, k, velocity_sq, speed_sq).iter().any(|&value| value > 0.0)
}
