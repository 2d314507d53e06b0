//! Estimates the speed along a path roughly, from the axes' derivatives, their limits and the speed caps: the lower envelope of
//! the variable r = w^(3/4), at samples dense enough to place the stations of the grid. r is linear in s under constant jerk from
//! rest.

use super::window_end::WindowEnd;
use crate::path_problem::{Fault, Geometry, Limits, PathPoint, SpeedCap, SHORTEST};
use feedplan_geometry::elementary::Elementary;
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{greater, lesser, Both};

/// Fractions of the limits of acceleration and jerk that the caps of r use.
const ACCELERATION: f64 = 0.4;
const JERK: f64 = 0.25;
/// K: the greatest slope of r, in units of √(J/|q'|). Constant jerk J has √4.5 = 2.12; the smoothing of `initial_plan` needs the
/// difference.
const SLOPE: f64 = 0.447;
/// The greatest slope by acceleration, in units of A r^(−1/3): it is 1.5 at the limit A, of which the envelope uses 0.6 · 0.79.
const RISE: f64 = 1.5 * 0.6 * 0.79;
/// Intervals between samples of a piece are halved while the second difference of ln r of the caps, or the relative deviation of
/// `turning` from its linear interpolation, exceeds this …
const CHANGE: f64 = 0.2;
/// … to depths in this range.
const DEPTH: std::ops::Range<u32> = 2..30;
/// Relative rounding of r.
pub const ROUNDING: f64 = 1e-9;
/// Where the envelope meets the caps, samples are at most this fraction of r/K apart.
const SPACING: f64 = 0.25;

/// The greatest slope of the envelope: |r'| ≤ min(k, acceleration · r^(−1/3), r/shortest).
#[derive(Clone, Copy, Debug)]
pub struct Slopes {
    pub k: f64,
    /// The factor of r^(−1/3) for rising r and for falling r.
    acceleration: [f64; 2],
    /// The shortest length over which r may double, in mm: arc lengths along the path cannot resolve less.
    shortest: f64,
}

/// Whether r rises or falls along the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    Rise,
    Fall,
}

/// The envelope's input at an arc length.
#[derive(Clone, Copy, Debug)]
pub struct EnvelopeSample {
    pub s: f64,
    pub piece: u32,
    /// The greatest r at this point alone.
    pub cap: f64,
    /// 1/length over which the path turns or its curvature changes, in 1/mm.
    pub turning: f64,
    /// Whether feed and chord error alone set the greatest r.
    pub fed: bool,
}

impl<const M: usize> Limits<M> {
    /// 1/w_max at a point, by the speed cap and the axes' velocities.
    pub(super) fn per_speed_sq(&self, point: &PathPoint<M>) -> f64 {
        let mut worst = 1.0 / (point.speed_cap * point.speed_cap);
        for k in 0..M {
            let first = point.first[k];
            worst = worst.max((first / self.velocity[usize::from(first < 0.0)][k]).powi(2));
        }
        worst
    }

    /// The greatest r that the limits allow at a point if |dr/ds| is at most k.
    pub(super) fn envelope_cap(&self, point: &PathPoint<M>, k: f64) -> f64 {
        let tiny = f64::MIN_POSITIVE;
        // The lowest limits found so far for r^(4/3) = w, for r² and for r.
        let (mut speed_sq, mut square, mut cap) =
            (1.0 / self.per_speed_sq(point).max(tiny), f64::INFINITY, f64::INFINITY);
        for axis in 0..M {
            let (second, third) = (point.second[axis].abs().max(tiny), point.third[axis].abs().max(tiny));
            let jerk = JERK * self.jerk[axis];
            let acceleration = self.acceleration[usize::from(point.second[axis] < 0.0)][axis];
            speed_sq = speed_sq.min(ACCELERATION * acceleration / second);
            square = square.min(jerk / third);
            cap = cap.min(jerk / (2.0 * second * k));
        }
        cap.min(square.sqrt()).min(speed_sq.power(0.75))
    }
}

impl Slopes {
    /// The slopes for the greatest q' and −q' of each axis and the length of the path in mm.
    pub fn new<const M: usize>(limits: &Limits<M>, greatest: &Both<M>, path: f64) -> Self {
        let least = |limit: &[f64; M], greatest: &[f64; M]| {
            (0..M).map(|k| limit[k] / greatest[k].max(f64::MIN_POSITIVE)).fold(f64::INFINITY, f64::min)
        };
        let [up, down] = &limits.acceleration;
        let [ahead, back] = greatest;
        Self {
            k: SLOPE * least(&limits.jerk, &greater(greatest)).sqrt(),
            acceleration: [
                RISE * least(up, ahead).min(least(down, back)),
                RISE * least(up, back).min(least(down, ahead)),
            ],
            shortest: SHORTEST * path,
        }
    }

    /// An upper bound of the slope `k` on every path on which only the axes in `moves` move.
    pub fn steepest<const M: usize>(limits: &Limits<M>, moves: &[bool; M]) -> f64 {
        // The tangent has length 1, so that some |q'| is at least 1/√M.
        let most = (0..M).filter(|&k| moves[k]).map(|k| limits.jerk[k]).fold(0.0, f64::max);
        SLOPE * (most * (M as f64).sqrt()).sqrt()
    }

    /// The length in mm over which r doubles at its greatest slope.
    #[inline]
    pub fn length(&self, r: f64) -> f64 {
        (r / self.k).max(self.shortest)
    }

    /// The greatest r at a short distance h in mm from a place with this r: the greatest slope is that of this r all along h.
    #[inline]
    pub fn reach(&self, r: f64, h: f64, change: Change) -> f64 {
        let (k, a) = (self.k, self.acceleration[change as usize]);
        // Below (a/k)³ no cube root is needed.
        let steepest = if k * k * k * r <= a * a * a { k } else { a / r.cbrt() };
        r + h * steepest.min(r / self.shortest)
    }

    /// The distance in mm over which r can change between the first and the second, greater value, at the greatest slopes.
    pub fn distance(&self, [from, to]: [f64; 2], change: Change) -> f64 {
        self.place(to, change) - self.place(from, change)
    }

    /// The greatest r at any distance h in mm from a place with this r: the greatest slopes are integrated over h.
    pub fn far(&self, r: f64, h: f64, change: Change) -> f64 {
        let (a, turn) = (self.acceleration[change as usize], self.turn(change));
        let place = self.place(r, change) + h;
        if place * self.k <= turn {
            place * self.k
        } else {
            (turn.power(4.0 / 3.0) + 4.0 / 3.0 * a * (place - turn / self.k)).power(0.75)
        }
    }

    /// The r above which the acceleration limits the slope.
    fn turn(&self, change: Change) -> f64 {
        (self.acceleration[change as usize] / self.k).powi(3)
    }

    /// The distance in mm from rest to this r, at the greatest slopes.
    fn place(&self, r: f64, change: Change) -> f64 {
        let (a, turn) = (self.acceleration[change as usize], self.turn(change));
        if r <= turn {
            r / self.k
        } else {
            turn / self.k + 0.75 * (r.power(4.0 / 3.0) - turn.power(4.0 / 3.0)) / a
        }
    }

    /// The time in s from rest to a speed in mm/s, or from that speed to rest if this takes longer.
    pub fn stop_time(&self, speed: f64) -> f64 {
        let [rise, fall] = self.acceleration;
        let (a, j) = (rise.min(fall) / RISE, (self.k / SLOPE).powi(2));
        if speed * j > a * a {
            speed / a + a / j
        } else {
            2.0 * (speed / j).sqrt()
        }
    }

    /// The envelope r at the samples: the caps, lowered to the ends and to the greatest slopes.
    pub fn envelope(&self, samples: &[EnvelopeSample], ends: &[WindowEnd; 2]) -> Vec<f64> {
        let s: Vec<f64> = samples.iter().map(|sample| sample.s).collect();
        let mut r: Vec<f64> = samples.iter().map(|sample| sample.cap).collect();
        self.end(&mut r, ends);
        self.limit(&s, &mut r);
        r
    }

    /// Lowers r at the first and the last station to what the known ends allow.
    pub fn end(&self, r: &mut [f64], ends: &[WindowEnd; 2]) {
        for (kind, station) in ends.iter().zip([0, r.len() - 1]) {
            r[station] = r[station].min(match *kind {
                WindowEnd::Rest { ramp, .. } => self.k * ramp.length,
                WindowEnd::Fixed { w, .. } => w.power(0.75),
                WindowEnd::Free => f64::INFINITY,
            });
        }
    }

    /// Lowers r at arc lengths s in mm until no slope is too great.
    pub fn limit(&self, s: &[f64], r: &mut [f64]) {
        // Forward, then backward: no value is greater than what its neighbour can reach.
        for i in 1..s.len() {
            r[i] = r[i].min(self.reach(r[i - 1], s[i] - s[i - 1], Change::Rise));
        }
        for i in (1..s.len()).rev() {
            r[i - 1] = r[i - 1].min(self.reach(r[i], s[i] - s[i - 1], Change::Fall));
        }
    }
}

/// Samples on the pieces from s = `from` to `to`, and the greatest slopes of their envelope. Fails if no speed above 0 is
/// possible at a sample.
pub fn sample_envelope<const M: usize>(
    geometry: &dyn Geometry<M>,
    limits: &Limits<M>,
    caps: &[SpeedCap],
    [from, to]: [f64; 2],
    ends: &[WindowEnd; 2],
    watch: Watch,
) -> Result<(Vec<EnvelopeSample>, Slopes), Fault> {
    let knots = geometry.knots();
    let pieces: Vec<(u32, f64, f64)> = (0..knots.len() - 1)
        .map(|piece| (piece as u32, knots[piece].max(from), knots[piece + 1].min(to)))
        .filter(|(_, start, end)| end > start)
        .collect();
    let mut greatest = [[0.0f64; M]; 2];
    for &(piece, start, end) in &pieces {
        watch.check_at(piece as usize);
        let inside = [0.0, 0.25, 0.5, 0.75].map(|part| start + part * (end - start));
        let points = geometry.at_four(piece as usize, inside);
        let last = geometry.at(piece as usize, end);
        for k in 0..M {
            let all = points.q[k][0].values().iter().chain([&last.first[k]]);
            for first in all {
                greatest[0][k] = greatest[0][k].max(*first);
                greatest[1][k] = greatest[1][k].max(-first);
            }
        }
    }
    let slopes = Slopes::new(limits, &greatest, knots[knots.len() - 1]);
    let sample = |piece: u32, s: f64| {
        let point = geometry.at(piece as usize, s);
        let cap = limits.envelope_cap(&point, slopes.k);
        let fed = cap >= (1.0 - ROUNDING) * point.speed_cap * point.speed_cap.sqrt();
        EnvelopeSample { s, piece, cap, turning: turning(limits, &point), fed }
    };
    let mut samples = vec![];
    let mut next_cap = caps.partition_point(|cap| cap.s <= from);
    let each = watch.each(pieces.len());
    for &(piece, start, end) in &pieces {
        each.count(piece as usize);
        let mut last = sample(piece, start);
        samples.push(last);
        while last.s < end {
            // Places with a speed cap are samples.
            let cap = caps.get(next_cap).filter(|cap| cap.s <= end);
            let mut there = sample(piece, cap.map_or(end, |cap| cap.s));
            if let Some(cap) = cap {
                there.cap = there.cap.min(cap.speed.power(1.5));
                next_cap += 1;
            }
            halve(&sample, last, there, 0, &mut samples);
            samples.push(there);
            last = there;
        }
    }
    // A NaN is not a speed either. No grid resolves a turn that is shorter than the rounding of s.
    let is_bad = |sample: &&EnvelopeSample| {
        let (cap, turns) = (sample.cap, sample.turning * slopes.shortest);
        cap.is_nan() || cap <= 0.0 || turns.is_nan() || turns > 1.0
    };
    if let Some(sample) = samples.iter().find(is_bad) {
        return Err(Fault::NoPlan { s: sample.s });
    }
    Ok((densify(&samples, slopes, ends, watch), slopes))
}

/// Appends the samples between two samples of a piece, by halving.
fn halve(
    sample: &impl Fn(u32, f64) -> EnvelopeSample,
    a: EnvelopeSample,
    b: EnvelopeSample,
    depth: u32,
    samples: &mut Vec<EnvelopeSample>,
) {
    let middle = sample(a.piece, 0.5 * (a.s + b.s));
    let turning = (middle.turning - 0.5 * (a.turning + b.turning)).abs();
    let changes = (middle.cap * middle.cap / (a.cap * b.cap)).natural_log().abs() > CHANGE
        || turning > CHANGE * a.turning.max(b.turning);
    let deeper = depth < DEPTH.start || (changes && depth < DEPTH.end && b.s - a.s > 1e-9 * b.s);
    if deeper {
        halve(sample, a, middle, depth + 1, samples);
    }
    samples.push(middle);
    if deeper {
        halve(sample, middle, b, depth + 1, samples);
    }
}

/// Adds samples with interpolated caps: densely where the envelope meets the caps, more sparsely with the distance from there.
fn densify(
    samples: &[EnvelopeSample],
    slopes: Slopes,
    ends: &[WindowEnd; 2],
    watch: Watch,
) -> Vec<EnvelopeSample> {
    let r = slopes.envelope(samples, ends);
    let last = r.len() - 1;
    let mut out = Vec::with_capacity(2 * samples.len());
    for (i, pair) in samples.windows(2).enumerate() {
        watch.check_at(i);
        let [a, b] = [pair[0], pair[1]];
        out.push(a);
        let mut at = a.s;
        loop {
            let top = a.cap.max(b.cap);
            let near = |r: f64| if r < 2.0 * top { r.min(top) } else { r - top };
            let [rise, fall] = [r[i] + slopes.k * (at - a.s), r[i + 1] + slopes.k * (b.s - at)];
            let step = SPACING * slopes.length(near(rise).min(near(fall)));
            if at + 1.5 * step >= b.s {
                break;
            }
            at += step;
            let part = (at - a.s) / (b.s - a.s);
            out.push(EnvelopeSample {
                s: at,
                piece: a.piece,
                cap: a.cap + part * (b.cap - a.cap),
                turning: a.turning + part * (b.turning - a.turning),
                fed: a.fed && b.fed,
            });
        }
    }
    out.push(samples[last]);
    out
}

/// 0.3 |q''|/|q'| + 0.2 √(|q'''|/|q'|), each axis over its velocity limit, in 1/mm.
fn turning<const M: usize>(limits: &Limits<M>, point: &PathPoint<M>) -> f64 {
    let velocity = lesser(&limits.velocity);
    let norm = |q: &[f64; M]| (0..M).map(|k| (q[k] / velocity[k]).powi(2)).sum::<f64>().sqrt();
    let first = norm(&point.first).max(f64::MIN_POSITIVE);
    0.3 * norm(&point.second) / first + 0.2 * (norm(&point.third) / first).sqrt()
}
