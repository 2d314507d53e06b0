//! Cuts a curved piece where an axis turns round and where the lowest velocity cap changes.

use super::piece::Piece;
use super::quotient::bernstein;
use super::subpiece::{Axes, Cap, Orientation, SubPiece};
use super::turns::{Mark, Stretch, EDGE};
use crate::bang_bang::chord::SpeedLine;
use crate::bang_bang::tolerance::{AT_KINK, SAME_CUT};
use crate::problem::ChordLimit;
use crate::AxisBits;
use feedplan_geometry::quadratic::dot;

/// Tangents of the chord-error limit are so far apart; see `ChordLimit::lines_below`.
const STEP: f64 = 0.03;

impl ChordLimit {
    /// Whether the limit can bind on the piece.
    fn binds<const M: usize>(&self, piece: &Piece<M>, feed_sq: f64) -> bool {
        let least = piece.least_speed_sq();
        let least_cube = least * least.sqrt();
        let least_limit = self.alpha * least_cube - self.slow_sq * piece.twist;
        least_limit < feed_sq * piece.twist && least_limit < self.acceleration * least_cube
    }

    /// Appends the greatest v² over a stretch, at most `feed_sq`: lines that follow one another without a jump.
    ///
    /// ρ = |C'|³/|C' × C''| is proportional to (1 + τ²)^1.5, τ = (t − t₀)/w counted from the place t₀ of the least ρ, for C'
    /// is linear and the cross product constant. That is convex, and so is the limit max(α ρ − 4 δ²/T², 4 δ²/T²): its
    /// tangents lie below it. Tangents at τ = sinh(i `STEP`) cross at places where they give away less than 0.75 `STEP`²
    /// of α ρ.
    #[cold]
    fn lines_below<const M: usize>(&self, stretch: &Stretch<M>, feed_sq: f64, out: &mut Vec<SpeedLine>) {
        let piece = &stretch.piece;
        let bend: [f64; M] = std::array::from_fn(|k| piece.right[k] - piece.left[k]);
        let bend_sq = dot(&bend, &bend);
        let (least, width) = (-dot(&piece.left, &bend) / bend_sq, piece.twist * stretch.length / bend_sq);
        let tangent = |t: f64| {
            let g = piece.tangent(t);
            let d = dot(&g, &g);
            let radius = d * d.sqrt() / piece.twist;
            if radius < self.tolerance * (1.0 - AT_KINK) {
                return Tangent { t, value: self.slow_sq, slope: 0.0 };
            }
            let share = self.alpha * radius;
            Tangent { t, value: share - self.slow_sq, slope: share * 3.0 * dot(&g, &bend) / d }
        };
        let step = |t: f64| ((t - least) / width).asinh() / STEP;
        let even = (step(0.0).ceil() as i64..=step(1.0).floor() as i64).map(|i| (i as f64 * STEP).sinh());
        // Where ρ = δ the limit has a kink.
        let least_radius = bend_sq * width * width * (bend_sq * width * width).sqrt() / piece.twist;
        let kink = ((self.tolerance / least_radius).powf(2.0 / 3.0) - 1.0).max(0.0).sqrt();
        let mut places: Vec<f64> = even.chain([-kink, kink]).map(|tau| least + width * tau).collect();
        places.retain(|t| (SAME_CUT..1.0 - SAME_CUT).contains(t));
        places.sort_by(f64::total_cmp);
        let (mut from, mut last) = (0.0, tangent(0.0));
        for next in places.into_iter().chain([1.0]).map(tangent) {
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

/// A straight line in t.
struct Tangent {
    t: f64,
    value: f64,
    slope: f64,
}

impl Tangent {
    fn at(&self, t: f64) -> f64 {
        self.value + self.slope * (t - self.t)
    }

    /// Appends its part below the feed, and the feed where that is lower.
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
        let cap = if backward { self.cap.reversed() } else { self.cap };
        Placed { sub: SubPiece::new(length, ends, bend, piece, orientation, cap, axes), from, to }
    }
}

/// Cuts pieces; holds the space for it.
#[derive(Default)]
pub struct Splitter {
    lines: Vec<SpeedLine>,
    cuts: Vec<f64>,
    pub parts: Vec<Part>,
}

/// What the cuts depend on.
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

    /// Cuts between two turns, then where the line below the chord-error limit changes, then between two changes of the
    /// cap.
    fn cut<const M: usize>(&mut self, piece: &Piece<M>, limits: &Limits<M>) {
        let (turns, count) = piece.turns();
        let mut from = EDGE;
        for i in 0..=count {
            let to = if i == count { EDGE } else { turns[i] };
            let stretch = piece.stretch(from, to);
            if stretch.length > 0.0 {
                let first = self.parts.len();
                let mut lines = std::mem::take(&mut self.lines);
                lines.clear();
                match limits.chord {
                    Some(chord) => chord.lines_below(&stretch, limits.feed_sq, &mut lines),
                    None => lines.push(SpeedLine { from: 0.0, to: 1.0, speed_sq: [limits.feed_sq; 2] }),
                }
                for line in &lines {
                    self.cut_by_cap(&stretch.piece, limits, line);
                }
                self.lines = lines;
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

    /// Cuts a stretch where the lowest cap changes on a line, and names it on each part.
    fn cut_by_cap<const M: usize>(&mut self, stretch: &Piece<M>, limits: &Limits<M>, line: &SpeedLine) {
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
            // Against the speed: v² q'_j² = V_j² D.
            let used = bernstein(axis_sq(stretch, j)).multiply(&speed_sq);
            used.combine(1.0, &bernstein(stretch.speed), -v_sq).sign_changes(&mut cut);
            // Against another axis: V_j |q'_k| = V_k |q'_j|.
            for k in (j + 1..M).filter(|&k| is_fast(k)) {
                let (v_j, v_k) = (v_sq.sqrt(), axes.velocity_sq[k].sqrt());
                for sign in [1.0, -1.0] {
                    let at = |g: &[f64; M]| v_j * g[k] - sign * v_k * g[j];
                    bernstein([at(&stretch.left), at(&stretch.right)]).sign_changes(&mut cut);
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
            let g = stretch.tangent(middle);
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
                // Goes on under the same cap.
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
