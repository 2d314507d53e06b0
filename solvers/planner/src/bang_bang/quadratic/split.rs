//! Cuts a quadratic piece into parts: where an axis turns, where the line of the chord-error limit changes, and where
//! another cap becomes the lowest. Makes sub-pieces of the parts.

use super::piece::Piece;
use super::quotient::bernstein;
use super::subpiece::{Axes, Cap, Orientation, SubPiece};
use super::turns::{Mark, MonotonePart, EDGE};
use crate::bang_bang::speed_line::SpeedLine;
use crate::bang_bang::tolerance::{AT_KINK, SAME_CUT};
use crate::problem::ChordLimit;
use crate::AxisBits;
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::quadratic::dot;

/// Spacing of the tangents to the chord-error limit; see `ChordLimit::lines_below`.
const STEP: f64 = 0.03;

impl ChordLimit {
    /// Whether the limit may be lower than the feed and the acceleration limits somewhere on the piece.
    fn binds<const M: usize>(&self, piece: &Piece<M>, feed_sq: f64) -> bool {
        let least = piece.least_speed_sq();
        let least_cube = least * least.sqrt();
        let least_limit = self.alpha * least_cube - self.slow_sq * piece.cross;
        least_limit < feed_sq * piece.cross && least_limit < self.acceleration * least_cube
    }

    /// Appends the lines of the chord-error limit on a monotone part, at most `feed_sq`, each beginning at the speed
    /// at which the last one ends.
    ///
    /// C' is linear and |C' × C''| constant, so ρ = |C'|³/|C' × C''| is proportional to (1 + τ²)^1.5 with τ = (t −
    /// t₀)/w and the least ρ at t₀. That is convex, and so is the limit max(α ρ − 4 δ²/T², 4 δ²/T²): its tangents lie
    /// below it. Where the tangents at τ = sinh(i `STEP`) cross, they give away less than 0.75 `STEP`² of α ρ.
    #[cold]
    fn lines_below<const M: usize>(
        &self,
        monotone: &MonotonePart<M>,
        feed_sq: f64,
        out: &mut Vec<SpeedLine>,
    ) {
        let piece = &monotone.piece;
        let c: [f64; M] = std::array::from_fn(|k| piece.right[k] - piece.left[k]);
        let c_sq = dot(&c, &c);
        let (least, width) = (-dot(&piece.left, &c) / c_sq, piece.cross * monotone.length / c_sq);
        let tangent = |t: f64| {
            let g = piece.tangent(t);
            let d = dot(&g, &g);
            let radius = d * d.sqrt() / piece.cross;
            if radius < self.tolerance * (1.0 - AT_KINK) {
                return Tangent { t, value: self.slow_sq, slope: 0.0 };
            }
            let share = self.alpha * radius;
            Tangent { t, value: share - self.slow_sq, slope: share * 3.0 * dot(&g, &c) / d }
        };
        let step = |t: f64| ((t - least) / width).asinh() / STEP;
        let even =
            (step(0.0).ceil() as i64..=step(1.0).floor() as i64).map(|i| (i as f64 * STEP).hyperbolic_sine());
        // The limit has a kink where ρ = δ.
        let least_radius = c_sq * width * width * (c_sq * width * width).sqrt() / piece.cross;
        let kink = ((self.tolerance / least_radius).power(2.0 / 3.0) - 1.0).max(0.0).sqrt();
        let mut contacts: Vec<f64> = even.chain([-kink, kink]).map(|tau| least + width * tau).collect();
        contacts.retain(|t| (SAME_CUT..1.0 - SAME_CUT).contains(t));
        contacts.sort_by(f64::total_cmp);
        let (mut from, mut last) = (0.0, tangent(0.0));
        for next in contacts.into_iter().chain([1.0]).map(tangent) {
            if next.slope == last.slope {
                continue;
            }
            let crossing = last.t + (next.at(last.t) - last.value) / (last.slope - next.slope);
            let to = crossing.clamp(last.t, next.t);
            last.push(from, to, feed_sq, out);
            (from, last) = (to, next);
        }
        last.push(from, 1.0, feed_sq, out);
    }
}

/// A tangent of the limit of v², a line in t.
struct Tangent {
    t: f64,
    value: f64,
    slope: f64,
}

impl Tangent {
    fn at(&self, t: f64) -> f64 {
        self.value + self.slope * (t - self.t)
    }

    /// Appends the tangent, cut off at the feed.
    fn push(&self, from: f64, to: f64, feed_sq: f64, out: &mut Vec<SpeedLine>) {
        let meets = self.t + (feed_sq - self.value) / self.slope;
        let middle = if from < meets && meets < to { meets } else { to };
        for (from, to) in [(from, middle), (middle, to)] {
            if to - from <= SAME_CUT {
                continue;
            }
            let speed_sq = [from, to].map(|t| self.at(t).min(feed_sq));
            match out.last_mut() {
                Some(last) if last.speed_sq == [feed_sq; 2] && speed_sq == last.speed_sq => last.to = to,
                _ => out.push(SpeedLine { from, to, speed_sq }),
            }
        }
    }
}

/// A part of a piece.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// The ends of the monotone part that contains it, and its own ends as fractions of that.
    marks: [Mark; 2],
    from: f64,
    to: f64,
    pub cap: Cap,
    /// Bit k: axis k moves backward.
    pub negative: AxisBits,
}

/// A part with its ends on the piece.
pub struct Located<'a, const M: usize> {
    pub sub: SubPiece<'a, M>,
    /// t at both ends.
    pub from: f64,
    pub to: f64,
}

impl Part {
    /// The part as a sub-piece, travelled forward or backward.
    #[inline(always)]
    pub fn locate<'a, const M: usize>(
        &self,
        piece: &'a Piece<M>,
        axes: &Axes<M>,
        backward: bool,
    ) -> Located<'a, M> {
        let sign: [f64; M] = std::array::from_fn(|k| if self.negative >> k & 1 == 1 { -1.0 } else { 1.0 });
        let reflect = |tangent: &[f64; M]| -> [f64; M] { std::array::from_fn(|k| sign[k] * tangent[k]) };
        let (length, from, to, ends);
        if self.marks == [EDGE, EDGE] && self.from == 0.0 && self.to == 1.0 {
            (length, from, to, ends) = (1.0, 0.0, 1.0, [reflect(&piece.left), reflect(&piece.right)]);
        } else {
            let monotone = piece.monotone_part(self.marks[0], self.marks[1]);
            length = (self.to - self.from) * monotone.length;
            let t_at = |share: f64| match share {
                0.0 => monotone.begin,
                1.0 => monotone.end,
                _ => monotone.begin + share * monotone.length,
            };
            (from, to) = (t_at(self.from), t_at(self.to));
            // Rounding may give the tangent of an axis that does not turn the wrong sign.
            let tangent = |share: f64| reflect(&monotone.piece.tangent(share)).map(|value| value.max(0.0));
            ends = [tangent(self.from), tangent(self.to)];
        }
        let [left, right] = ends;
        let (ends, travel) = if backward { ([right, left], -1.0) } else { ([left, right], 1.0) };
        let c = std::array::from_fn(|k| travel * sign[k] * (piece.right[k] - piece.left[k]));
        let orientation = Orientation { sign, travel };
        let cap = if backward { self.cap.reversed() } else { self.cap };
        Located { sub: SubPiece::new(length, ends, c, piece, orientation, cap, axes), from, to }
    }
}

/// Cuts pieces into parts; holds the working memory for it.
#[derive(Default)]
pub struct Splitter {
    lines: Vec<SpeedLine>,
    cuts: Vec<f64>,
    pub parts: Vec<Part>,
}

/// The limits that determine the cuts.
struct Limits<'a, const M: usize> {
    axes: &'a Axes<M>,
    feed_sq: f64,
    chord: Option<&'a ChordLimit>,
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
        chord: Option<&ChordLimit>,
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
            let cap = Cap::Speed([feed_sq; 2]);
            self.parts.push(Part { marks: [EDGE, EDGE], from: 0.0, to: 1.0, cap, negative });
        } else {
            self.cut(piece, &Limits { axes, feed_sq, chord, fast });
        }
    }

    /// Cuts at the turns, then at the ends of the chord-error lines, then where another cap becomes the lowest.
    fn cut<const M: usize>(&mut self, piece: &Piece<M>, limits: &Limits<M>) {
        let (turns, count) = piece.turns();
        let mut from = EDGE;
        for i in 0..=count {
            let to = if i == count { EDGE } else { turns[i] };
            let monotone = piece.monotone_part(from, to);
            if monotone.length > 0.0 {
                let first = self.parts.len();
                let mut lines = std::mem::take(&mut self.lines);
                lines.clear();
                match limits.chord {
                    Some(chord) => chord.lines_below(&monotone, limits.feed_sq, &mut lines),
                    None => lines.push(SpeedLine { from: 0.0, to: 1.0, speed_sq: [limits.feed_sq; 2] }),
                }
                for line in &lines {
                    self.cut_by_cap(&monotone.piece, limits, line);
                }
                self.lines = lines;
                let (left, right) = (&monotone.piece.left, &monotone.piece.right);
                let negative = (0..M).fold(0, |bits, k| bits | AxisBits::from(left[k] + right[k] < 0.0) << k);
                for part in &mut self.parts[first..] {
                    part.marks = [from, to];
                    part.negative = negative;
                }
            }
            from = to;
        }
    }

    /// Cuts a monotone part, on the interval of a speed line, where another cap becomes the lowest, and sets the lowest cap of
    /// each part.
    fn cut_by_cap<const M: usize>(&mut self, monotone: &Piece<M>, limits: &Limits<M>, line: &SpeedLine) {
        let (axes, fast) = (limits.axes, limits.fast);
        let cuts = &mut self.cuts;
        cuts.clear();
        let mut cut = |t: f64| {
            if t > line.from + SAME_CUT && t < line.to - SAME_CUT {
                cuts.push(t);
            }
        };
        let is_fast = |k: usize| fast >> k & 1 == 1;
        let speed_sq = if line.speed_sq[0] == line.speed_sq[1] {
            bernstein([line.speed_sq[0]])
        } else {
            bernstein([line.at(0.0), line.at(1.0)])
        };
        for j in (0..M).filter(|&j| is_fast(j)) {
            let v_sq = axes.velocity_sq[j];
            // Against the tool's speed: v² g_j² = V_j² D.
            let used = bernstein(axis_sq(monotone, j)).multiply(&speed_sq);
            used.combine(1.0, &bernstein(monotone.speed), -v_sq).sign_changes(&mut cut);
            // Against another axis: V_j |g_k| = V_k |g_j|.
            for k in (j + 1..M).filter(|&k| is_fast(k)) {
                let (v_j, v_k) = (v_sq.sqrt(), axes.velocity_sq[k].sqrt());
                for sign in [1.0, -1.0] {
                    let at = |g: &[f64; M]| v_j * g[k] - sign * v_k * g[j];
                    bernstein([at(&monotone.left), at(&monotone.right)]).sign_changes(&mut cut);
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.push(line.to);
        let mut from = line.from;
        for &to in cuts.iter() {
            if to - from <= SAME_CUT {
                continue;
            }
            let middle = 0.5 * (from + to);
            let g = monotone.tangent(middle);
            let mut lowest = line.at(middle) / dot(&g, &g);
            let mut cap = None;
            for k in (0..M).filter(|&k| is_fast(k)) {
                if g[k] * g[k] * lowest > axes.velocity_sq[k] {
                    lowest = axes.velocity_sq[k] / (g[k] * g[k]);
                    cap = Some(Cap::Axis(k, axes.velocity_sq[k]));
                }
            }
            let speed = |from: f64| Cap::Speed([line.at(from), line.at(to)]);
            match self.parts.last_mut() {
                // The part before has the same cap and is extended.
                Some(part) if part.to == from && part.from >= line.from && part.cap.goes_on(cap) => {
                    part.to = to;
                    part.cap = cap.unwrap_or(speed(part.from));
                }
                _ => {
                    let cap = cap.unwrap_or(speed(from));
                    self.parts.push(Part { marks: [EDGE, EDGE], from, to, cap, negative: 0 });
                }
            }
            from = to;
        }
    }
}

/// g_k² in Bernstein form.
#[inline(always)]
fn axis_sq<const M: usize>(piece: &Piece<M>, k: usize) -> [f64; 3] {
    let (a, b) = (piece.left[k], piece.right[k]);
    [a * a, a * b, b * b]
}

/// v² g_k² − V² D: positive where axis k would be faster than V at the speed v.
#[inline(always)]
fn excess<const M: usize>(piece: &Piece<M>, k: usize, velocity_sq: f64, speed_sq: f64) -> [f64; 3] {
    let g_sq = axis_sq(piece, k);
    std::array::from_fn(|i| speed_sq * g_sq[i] - velocity_sq * piece.speed[i])
}

/// Whether axis k could be faster than V somewhere on the piece at the speed v.
#[inline(always)]
fn too_fast<const M: usize>(piece: &Piece<M>, k: usize, velocity_sq: f64, speed_sq: f64) -> bool {
    excess(piece, k, velocity_sq, speed_sq).iter().any(|&value| value > 0.0)
}
