//! Cuts a curved piece where an axis turns round and where the lowest velocity cap changes.
//!
//! The chord-error limit v² ≤ α ρ − 4 δ²/T², α = 8 δ/T², ρ = D^1.5/|W|, is taken as p ≤ f √D with
//! f = (α/|W|)(1 − δ/(2 ρ_min)), ρ_min on the sub-piece: on the safe side, and too low by at most δ/(4 ρ_min) of v²
//! where ρ doubles within the sub-piece. So the piece is cut where ρ doubles, as far as that part matters. Where
//! ρ < δ no part of the path shorter than 2 δ leaves its chord by δ: the limit is the constant speed 2 δ/T.

use super::piece::Piece;
use super::subpiece::{Axes, Cap, SubPiece};
use crate::bernstein::{multiply, parabola_sign_changes, product, sign_changes};
use crate::quadratic::dot;

/// Cuts closer than this part of the piece are one.
const SAME_CUT: f64 = 1e-14;
/// A tangent component this small beside the one at the other end is zero.
const ZERO: f64 = 1e-14;
/// Beyond this many δ the radius varies without a difference to the chord-error limit.
const LAST_DOUBLING: f64 = 512.0;

/// The chord-error limit where it can be lower than what the accelerations allow.
#[derive(Clone, Copy)]
pub struct ChordLimit {
    /// α = 8 δ/T²
    alpha: f64,
    /// 4 δ²/T²
    slow_sq: f64,
    /// δ
    tolerance: f64,
    /// The greatest acceleration that all axes have together.
    acceleration: f64,
}

impl ChordLimit {
    /// None if the limit never binds: v²/ρ is at most `acceleration` on any curve, and the limit nowhere below
    /// ρ α/2.
    pub fn new(tolerance: f64, period: f64, acceleration: f64) -> Option<Self> {
        let alpha = 8.0 * tolerance / (period * period);
        let slow_sq = 0.5 * alpha * tolerance;
        let binds = tolerance.is_finite() && alpha < 2.0 * acceleration;
        binds.then_some(Self { alpha, slow_sq, tolerance, acceleration })
    }

    /// Whether the limit can bind on the piece.
    fn binds<const M: usize>(&self, piece: &Piece<M>, feed_sq: f64) -> bool {
        let least = piece.least_speed_sq();
        let least_cube = least * least.sqrt();
        let least_limit = self.alpha * least_cube - self.slow_sq * piece.twist;
        least_limit < feed_sq * piece.twist && least_limit < self.acceleration * least_cube
    }
}

/// A part [from, to] of a curved piece with what the passes need to know of it.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from: f64,
    pub to: f64,
    pub cap: Cap,
    /// Bit k: axis k turns round at the left or right end; moves backward in between.
    pub zero_left: u8,
    pub zero_right: u8,
    pub negative: u8,
}

impl Part {
    /// The part as a sub-piece travelled forward, or backward.
    #[inline(always)]
    pub fn sub_piece<const M: usize>(&self, piece: &Piece<M>, axes: &Axes<M>, backward: bool) -> SubPiece<M> {
        let (left, right) = (piece.tangent(self.from), piece.tangent(self.to));
        let (mut start, mut end, mut bend) = ([0.0; M], [0.0; M], [0.0; M]);
        for k in 0..M {
            let sign = if self.negative >> k & 1 == 1 { -1.0 } else { 1.0 };
            start[k] = if self.zero_left >> k & 1 == 1 { 0.0 } else { (sign * left[k]).max(0.0) };
            end[k] = if self.zero_right >> k & 1 == 1 { 0.0 } else { (sign * right[k]).max(0.0) };
            bend[k] = sign * (piece.right[k] - piece.left[k]);
        }
        let length = self.to - self.from;
        if backward {
            SubPiece::new(length, end, start, bend.map(|value| -value), piece.twist, self.cap, axes)
        } else {
            SubPiece::new(length, start, end, bend, piece.twist, self.cap, axes)
        }
    }
}

/// Cuts pieces; holds the space for it.
#[derive(Default)]
pub struct Splitter {
    turns: Vec<(f64, u8)>,
    cuts: Vec<f64>,
    pub parts: Vec<Part>,
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
        let mut fast = 0u8;
        let mut turning = 0u8;
        let mut negative = 0u8;
        let (mut zero_left, mut zero_right) = (0u8, 0u8);
        for k in 0..M {
            let bit = 1 << k;
            if left[k] + right[k] < 0.0 {
                negative |= bit;
            }
            if left[k].abs() <= ZERO * right[k].abs() {
                zero_left |= bit;
            }
            if right[k].abs() <= ZERO * left[k].abs() {
                zero_right |= bit;
            }
            if left[k] * right[k] < 0.0 && (zero_left | zero_right) & bit == 0 {
                turning |= bit;
            }
            if axes.velocity_sq[k] < feed_sq && too_fast(piece, k, axes.velocity_sq[k], feed_sq) {
                fast |= bit;
            }
        }
        let chord = chord.filter(|chord| chord.binds(piece, feed_sq));
        if fast | turning == 0 && chord.is_none() {
            let cap = Cap::SpeedSq(feed_sq);
            self.parts.push(Part { from: 0.0, to: 1.0, cap, zero_left, zero_right, negative });
            return;
        }
        self.turns.clear();
        for k in (0..M).filter(|k| turning >> k & 1 == 1) {
            let t = left[k] / (left[k] - right[k]);
            let bit = 1 << k;
            if t <= SAME_CUT {
                zero_left |= bit;
            } else if t >= 1.0 - SAME_CUT {
                zero_right |= bit;
            } else {
                self.turns.push((t, bit));
            }
        }
        self.turns.push((1.0, zero_right));
        self.turns.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.turns.dedup_by(|b, a| {
            let same = b.0 - a.0 <= SAME_CUT;
            a.1 |= if same { b.1 } else { 0 };
            same
        });
        // Between two turns, then between two doublings of the radius, then between two changes of the cap.
        let (mut from, mut zero) = (0.0, zero_left);
        for i in 0..self.turns.len() {
            let (to, zero_to) = self.turns[i];
            let middle = piece.tangent(0.5 * (from + to));
            let negative = (0..M).fold(0, |bits, k| bits | u8::from(middle[k] < 0.0) << k);
            let first = self.parts.len();
            match chord {
                Some(chord) => self.cut_by_radius(piece, axes, feed_sq, chord, fast, (from, to)),
                None => self.cut_by_cap(piece, axes, feed_sq, None, fast, (from, to)),
            }
            for part in &mut self.parts[first..] {
                part.negative = negative;
                part.zero_left = if part.from == from { zero } else { 0 };
                part.zero_right = if part.to == to { zero_to } else { 0 };
            }
            (from, zero) = (to, zero_to);
        }
    }

    /// Cuts [from, to] where the radius doubles.
    #[cold]
    fn cut_by_radius<const M: usize>(
        &mut self,
        piece: &Piece<M>,
        axes: &Axes<M>,
        feed_sq: f64,
        chord: ChordLimit,
        fast: u8,
        (from, to): (f64, f64),
    ) {
        let mut levels = vec![from, to];
        let mut radius = chord.tolerance;
        let no_limit = (feed_sq + chord.slow_sq) / chord.alpha;
        while radius <= (chord.tolerance * LAST_DOUBLING).min(2.0 * no_limit) {
            // D where ρ = D^1.5/|W| has this value.
            let d = (radius * piece.twist).powf(2.0 / 3.0);
            parabola_sign_changes(&piece.speed.map(|value| value - d), &mut |t| levels.push(t));
            radius *= 2.0;
        }
        levels.retain(|&t| t >= from && t <= to);
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|b, a| *b - *a <= SAME_CUT);
        if let Some(last) = levels.last_mut() {
            *last = to;
        }
        for level in levels.windows(2) {
            let (a, b) = (level[0], level[1]);
            let radius_at = |t: f64| {
                let g = piece.tangent(t);
                let d = dot(&g, &g);
                d * d.sqrt() / piece.twist
            };
            let middle = radius_at(0.5 * (a + b));
            if middle < chord.tolerance {
                self.cut_by_cap(piece, axes, feed_sq.min(chord.slow_sq), None, fast, (a, b));
                continue;
            }
            let bend: [f64; M] = std::array::from_fn(|k| piece.right[k] - piece.left[k]);
            let lowest = (-dot(&piece.left, &bend) / dot(&bend, &bend)).clamp(a, b);
            let least_radius = radius_at(a).min(radius_at(b)).min(radius_at(lowest)).max(chord.tolerance);
            let factor = chord.alpha / piece.twist * (1.0 - chord.tolerance / (2.0 * least_radius));
            self.cut_by_cap(piece, axes, feed_sq, Some(factor), fast, (a, b));
        }
    }

    /// Cuts [from, to] where the lowest cap changes, and names it on each part.
    fn cut_by_cap<const M: usize>(
        &mut self,
        piece: &Piece<M>,
        axes: &Axes<M>,
        speed_sq: f64,
        chord: Option<f64>,
        fast: u8,
        (from, to): (f64, f64),
    ) {
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
            parabola_sign_changes(&excess(piece, j, v_sq, speed_sq), &mut cut);
            // Against another axis: V_j |q'_k| = V_k |q'_j|.
            for k in (j + 1..M).filter(|&k| is_fast(k)) {
                let (v_j, v_k) = (v_sq.sqrt(), axes.velocity_sq[k].sqrt());
                for sign in [1.0, -1.0] {
                    let at = |g: &[f64; M]| v_j * g[k] - sign * v_k * g[j];
                    sign_changes(&[at(&piece.left), at(&piece.right)], &mut cut);
                }
            }
            // Against the chord error: V_j⁴ = f² D q'_j⁴.
            if let Some(factor) = chord {
                let g_sq = axis_sq(piece, j);
                let six: [f64; 7] = product(&multiply(&g_sq, &g_sq), &piece.speed);
                sign_changes(&six.map(|value| factor * factor * value - v_sq * v_sq), &mut cut);
            }
        }
        if let Some(factor) = chord {
            let d = (speed_sq / factor).powf(2.0 / 3.0);
            parabola_sign_changes(&piece.speed.map(|value| value - d), &mut cut);
        }
        cuts.sort_by(f64::total_cmp);
        cuts.push(to);
        let (start, mut from) = (from, from);
        for &to in cuts.iter() {
            if to - from <= SAME_CUT {
                continue;
            }
            let g = piece.tangent(0.5 * (from + to));
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
                _ => self.parts.push(Part { from, to, cap, zero_left: 0, zero_right: 0, negative: 0 }),
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
