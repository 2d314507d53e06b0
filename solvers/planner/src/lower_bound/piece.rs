//! A piece with its limits: computes the greatest x at a station, its greatest rise over an interval, and the least time of an
//! interval.

use super::hodograph::{Distances, Hodograph, Station};
use super::length::root_integral;
use super::time::least_time;
use super::{Task, DOWN, UP};
use feedplan_geometry::polynomial::binomial;

/// The limit of x at a turn is used at stations within this distance in t of the turn.
const NEAR_TURN: f64 = 1e-7;
/// A rational piece is divided into chords that each turn by less than `CHORD_TURN` [rad], but into at most `MOST_CHORDS`.
const CHORD_TURN: f64 = 0.05;
const MOST_CHORDS: f64 = 64.0;

/// The chord-error limit is used on an interval if v² at an end exceeds this fraction of it.
const NEAR_CHORD: f64 = 0.5;

/// The polynomial D, where the axes are joints: v² of the tip is D x.
struct TipSpeed<'a> {
    coefficients: &'a [f64],
    factor: f64,
    noise: f64,
}

/// A piece with its limits.
pub struct Piece<'a, const M: usize, const C: usize, const R: usize> {
    task: &'a Task<'a, M>,
    pub curve: Hodograph<M, C, R>,
    tip_speed: Option<TipSpeed<'a>>,
    feed_sq: f64,
    /// The factor of each axis's velocity in the speed that the feed limits; None if that speed is the tool's.
    share: Option<&'a [f64; M]>,
}

impl<'a, const M: usize, const C: usize, const R: usize> Piece<'a, M, C, R> {
    #[inline]
    pub fn new(task: &'a Task<'a, M>, i: usize) -> Self {
        let problem = task.problem;
        let tip_speed = problem.tip.map(|tip| {
            let coefficients = tip.speed.of(i);
            let factor = problem.width[i].powi(2);
            let greatest = coefficients.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            let noise = (8 * coefficients.len() + 4) as f64 * f64::EPSILON * factor * greatest;
            TipSpeed { coefficients, factor, noise }
        });
        Self {
            task,
            curve: Hodograph::new(problem.points(i), problem.weights(i)),
            tip_speed,
            feed_sq: problem.feed[i].powi(2) * task.speed_share,
            share: problem.share(i),
        }
    }

    /// Lower and upper bound of v²/x of the tool at a station.
    #[inline]
    pub fn speed(&self, station: &Station<M>) -> (f64, f64) {
        if let Some(tip) = &self.tip_speed {
            let (value, noise) = tip.at(station.t, station.order);
            return ((value - noise).max(0.0) * DOWN, (value + noise).max(0.0) * UP);
        }
        self.axes_speed(station)
    }

    /// Lower and upper bound of the sum of the squared axis velocities, divided by x, at a station.
    #[inline]
    pub fn axes_speed(&self, station: &Station<M>) -> (f64, f64) {
        let (mut least, mut most) = (0.0, 0.0);
        for k in 0..M {
            let (size, noise) = (station.rate[k].abs(), self.curve.noise[k]);
            least += (size - noise).max(0.0).powi(2);
            most += (size + noise).powi(2);
        }
        (least * DOWN, most * UP)
    }

    /// An upper bound of x at a station from those of the sum of the squared axis velocities and of v² of the tool. `speed` is
    /// the lower bound by `self.speed`.
    #[inline]
    pub fn x_on_entry(&self, station: &Station<M>, axes_sq: f64, tool_sq: f64, speed: f64) -> f64 {
        if axes_sq == 0.0 || tool_sq == 0.0 {
            return 0.0;
        }
        let axes = if self.tip_speed.is_some() { self.axes_speed(station).0 } else { speed };
        (axes_sq / axes).min(tool_sq / speed) * UP
    }

    /// A lower bound of the square of the speed that the feed limits, divided by x, at a station. `speed` is the lower bound by
    /// `self.speed`.
    #[inline]
    fn feed_rate(&self, station: &Station<M>, speed: f64) -> f64 {
        let Some(share) = self.share else { return speed };
        let least = |k: usize| share[k] * (station.rate[k].abs() - self.curve.noise[k]).max(0.0);
        (0..M).map(|k| least(k).powi(2)).sum::<f64>() * DOWN
    }

    /// An upper bound of x at a station from the limits there. `speed` is the lower bound by `self.speed`.
    #[inline]
    pub fn greatest_x(&self, station: &Station<M>, speed: f64) -> f64 {
        let (task, noise) = (self.task, &self.curve.noise);
        let mut most = self.feed_sq / self.feed_rate(station, speed);
        for k in 0..M {
            let least = (station.rate[k].abs() - noise[k]).max(0.0);
            // At a cusp the rate may have the sign of the motion before it.
            let v_sq = match station.order {
                0 => task.velocity_sq[usize::from(station.rate[k] < 0.0)][k],
                _ => task.velocity_sq[0][k].max(task.velocity_sq[1][k]),
            };
            most = most.min(v_sq / (least * least));
        }
        if station.order == 0 {
            for j in 0..M {
                for k in j + 1..M {
                    // With s eliminated from ω² (g_j s + c_j π) = a_j and the same equation of axis k: ω² W π = a_j g_k −
                    // a_k g_j, where a_j and a_k are within their limits.
                    let wronskian = self.curve.wronskian(station, j, k);
                    if wronskian != 0.0 {
                        let sign = 1.0_f64.copysign(wronskian);
                        let both = self.greatest_product(j, sign * station.g[k], noise[k])
                            + self.greatest_product(k, -sign * station.g[j], noise[j]);
                        most = most.min(both / (wronskian.abs() * station.weight_sq));
                    }
                }
            }
            for k in 0..M {
                most = most.min(self.at_turn(station, k));
            }
            if let Some(limit) = self.chord_speed_sq(station) {
                most = most.min(limit / speed);
            }
        }
        most * UP
    }

    /// An upper bound of the acceleration of axis k times `factor`, which has an error of at most `noise`.
    #[inline]
    fn greatest_product(&self, k: usize, factor: f64, noise: f64) -> f64 {
        let [forward, backward] = self.task.acceleration.each_ref().map(|side| side[k]);
        let (size, own) = (factor.abs(), if factor < 0.0 { backward } else { forward });
        (if size > noise { own } else { forward.max(backward) }) * (size + noise)
    }

    /// An upper bound of v² by the chord error at a station; None if the chord error is not limited.
    fn chord_speed_sq(&self, station: &Station<M>) -> Option<f64> {
        let chord = self.task.chord.as_ref()?;
        Some(self.curve.chord_speed_sq(chord, station) * self.task.speed_share)
    }

    /// A lower bound of the time [s] between two stations under the chord-error limit; 0 if v² is far below it at
    /// both.
    fn chord_time(&self, a: &Station<M>, b: &Station<M>, x: [f64; 2]) -> f64 {
        let Some(chord) = &self.task.chord else { return 0.0 };
        let is_near = |station: &Station<M>, x: f64| {
            station.order == 0
                && self
                    .chord_speed_sq(station)
                    .is_some_and(|limit| x * self.speed(station).1 > NEAR_CHORD * limit)
        };
        if !(is_near(a, x[0]) || is_near(b, x[1])) {
            return 0.0;
        }
        let feed_sq = if self.share.is_some() { f64::INFINITY } else { self.feed_sq * UP };
        self.curve.chord_time(chord, feed_sq, a, b) / self.task.speed_share
    }

    /// An upper bound of π at a station next to which axis k turns. After the turn, v_k² is at most 2 A_k times the distance;
    /// with c_k between two slopes on the way, π ≤ A_k |c_k|max/(|c_k|min² ω²).
    #[inline]
    fn at_turn(&self, station: &Station<M>, k: usize) -> f64 {
        let curve = &self.curve;
        let (g, c) = (station.g[k].abs() + curve.noise[k], station.c[k].abs());
        if g >= NEAR_TURN * c {
            return f64::INFINITY;
        }
        let n = curve.degree as f64;
        let d = 2.0 * g / c;
        let change = n * curve.noise[k] + 4.0 * n * n * curve.size[k] * d;
        if !(change < 0.25 * c && station.t - d >= 0.0 && station.t + d <= 1.0) {
            return f64::INFINITY;
        }
        let weight = (station.weight_sq.sqrt() - curve.weight_change(d)) * DOWN;
        self.task.acceleration[usize::from(station.c[k] < 0.0)][k] * (c + change)
            / ((c - change).powi(2) * weight * weight)
    }

    /// An upper bound of the growth of v_k²/2 between two stations, in the direction of time or against it. The axis travels at
    /// most `most` in its main direction and at most (most − least)/2 in the other one.
    #[inline]
    fn gain(&self, k: usize, in_time: bool, distances: &Distances<M>) -> f64 {
        let side = if in_time { distances.side[k] } else { 1 - distances.side[k] };
        let (on, back) = (self.task.acceleration[side][k], self.task.acceleration[1 - side][k]);
        let (least, most) = (distances.least[k], distances.most[k]);
        if least > 0.0 {
            on * most + (back - on).max(0.0) * 0.5 * (most - least)
        } else {
            on.max(back) * most
        }
    }

    /// An upper bound of x at the station `to`, which is before or after `from`, where x is at most `x`.
    #[inline]
    pub fn rise(&self, from: &Station<M>, x: f64, to: &Station<M>, distances: &Distances<M>) -> f64 {
        let mut most = f64::INFINITY;
        for k in 0..M {
            let noise = self.curve.noise[k];
            let rate = from.rate[k].abs() + noise;
            let kept = if self.curve.turns(k, from, to) { 0.0 } else { rate * rate * x };
            let reached = kept + 2.0 * self.gain(k, from.t < to.t, distances);
            let rate = (to.rate[k].abs() - noise).max(0.0);
            most = most.min(reached / (rate * rate));
        }
        most * UP
    }

    /// A lower bound of the time [s] from `a` to `b`, where x is at most `x`. Tries first `axis`, then the length, then the other
    /// axes and the chord error, until the bound reaches `wanted`.
    #[inline]
    pub fn time(
        &self,
        (a, b): (&Station<M>, &Station<M>),
        x: [f64; 2],
        distances: &Distances<M>,
        axis: usize,
        wanted: f64,
    ) -> f64 {
        let of_axis = |k: usize| {
            let noise = self.curve.noise[k];
            let (first, last) = (a.rate[k].abs() + noise, b.rate[k].abs() + noise);
            let (first_sq, last_sq) = (first * first * x[0] * UP, last * last * x[1] * UP);
            let (task, side) = (self.task, distances.side[k]);
            let ramps = [task.acceleration[side][k], task.acceleration[1 - side][k]];
            least_time(distances.least[k], first_sq, last_sq, ramps, task.velocity_sq[side][k])
        };
        let mut time = if axis < M { of_axis(axis) } else { 0.0 };
        if time < wanted {
            time = time.max(self.length(a, b, distances) / self.feed_sq.sqrt() * DOWN);
        }
        if time < wanted {
            time = (0..M).map(of_axis).fold(time, f64::max).max(self.chord_time(a, b, x));
        }
        time
    }

    /// A lower bound of the length [mm] from `a` to `b` to which the feed refers.
    fn length(&self, a: &Station<M>, b: &Station<M>, distances: &Distances<M>) -> f64 {
        if let Some(tip) = &self.tip_speed {
            let d = |t: f64| tip.at(t, 0).0;
            return root_integral(&d, tip.coefficients.len() - 1, tip.noise, (a.t, b.t)) * DOWN;
        }
        let share = self.share.unwrap_or(&[1.0; M]);
        let chord = (0..M).map(|k| (share[k] * distances.least[k]).powi(2)).sum::<f64>().sqrt() * DOWN;
        if self.curve.degree == 0 || (self.share.is_some() && self.curve.is_rational()) {
            return chord;
        }
        if self.curve.is_rational() {
            let size = |g: &[f64; M]| g.iter().map(|value| value * value).sum::<f64>().sqrt();
            let cosine = (0..M).map(|k| a.g[k] * b.g[k]).sum::<f64>() / (size(&a.g) * size(&b.g));
            let parts = (cosine.clamp(-1.0, 1.0).acos() / CHORD_TURN).ceil().clamp(2.0, MOST_CHORDS);
            return chord.max(self.curve.chords(a, b, parts as usize));
        }
        let noise: f64 = (0..M).map(|k| share[k] * self.curve.noise[k]).sum();
        let greatest: f64 = (0..M).map(|k| share[k] * self.curve.size[k]).sum();
        let d = |t: f64| {
            let g = self.curve.station(t).g;
            (0..M).map(|k| (share[k] * g[k]).powi(2)).sum()
        };
        let bound = root_integral(&d, 2 * self.curve.degree, 2.0 * greatest * noise, (a.t, b.t));
        chord.max(bound * DOWN)
    }
}

impl TipSpeed<'_> {
    /// D at t and its error; at a cusp of this order at an end, its leading coefficient.
    #[inline]
    fn at(&self, t: f64, order: usize) -> (f64, f64) {
        let n = self.coefficients.len() - 1;
        if order > 0 {
            let Some(last) = n.checked_sub(2 * order) else { return (0.0, 0.0) };
            let value = self.coefficients[if t == 0.0 { 2 * order } else { last }];
            let share = binomial(n, 2 * order) * self.factor;
            return (share * value, binomial(n, 2 * order) * self.noise);
        }
        let mut b = [0.0; 24];
        b[..=n].copy_from_slice(self.coefficients);
        for level in 1..=n {
            for i in 0..=n - level {
                b[i] = (1.0 - t) * b[i] + t * b[i + 1];
            }
        }
        (self.factor * b[0], self.noise)
    }
}
