//! A piece under its limits: what x can be at a node, how far it can rise to the next, the least time between two.

use super::hodograph::{binomial, Hodograph, Node, Ways};
use super::length::root_integral;
use super::time::least_time;
use super::{Task, DOWN, UP};
use crate::problem::TIP_AXES;

/// The zero of an axis's tangent is sought within this part of a piece.
const NEAR_TURN: f64 = 1e-7;
/// Chords of a rational piece turn by less than this, in rad, but for this many of them at most.
const CHORD_TURN: f64 = 0.05;
const MOST_CHORDS: f64 = 64.0;

/// The chord-error limit counts on a cell where at an end v² is this near it.
const NEAR_CHORD: f64 = 0.5;

/// The tool's own piece, of any kind.
type TipCurve = Hodograph<TIP_AXES, 17, 10>;

/// D, the square of the tool's speed over x, where it is not |g|².
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
    /// Where the chord error limits the speed and the tool has a curve of its own.
    tip_curve: Option<TipCurve>,
    feed_sq: f64,
    /// What the axes count in the feed, where that is not the tool's speed.
    share: Option<&'a [f64; M]>,
}

impl<'a, const M: usize, const C: usize, const R: usize> Piece<'a, M, C, R> {
    /// Piece number `i`.
    #[inline(always)]
    pub fn new(task: &'a Task<'a, M>, i: usize) -> Self {
        let problem = task.problem;
        let tip_speed = problem.tip.map(|tip| {
            let coefficients = tip.speed.of(i);
            let factor = problem.width[i].powi(2);
            let greatest = coefficients.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            let noise = (8 * coefficients.len() + 4) as f64 * f64::EPSILON * factor * greatest;
            TipSpeed { coefficients, factor, noise }
        });
        let tip_curve = problem.tip.filter(|_| task.chord.is_some()).map(|tip| {
            let range = tip.offset[i]..tip.offset[i + 1];
            Hodograph::new(&tip.control[range.clone()], tip.weight.get(range).unwrap_or(&[]))
        });
        Self {
            task,
            curve: task.hodograph(i),
            tip_speed,
            tip_curve,
            feed_sq: problem.feed[i].powi(2) * task.speed_share,
            share: problem.share(i),
        }
    }

    /// The tool's speed squared over x at a node: between these.
    #[inline(always)]
    pub fn speed(&self, node: &Node<M>) -> (f64, f64) {
        if let Some(tip) = &self.tip_speed {
            let (value, noise) = tip.at(node.t, node.order);
            return ((value - noise).max(0.0) * DOWN, (value + noise).max(0.0) * UP);
        }
        self.axes_speed(node)
    }

    /// The speed of all axes squared over x at a node: between these.
    #[inline(always)]
    pub fn axes_speed(&self, node: &Node<M>) -> (f64, f64) {
        let (mut least, mut most) = (0.0, 0.0);
        for k in 0..M {
            let (size, noise) = (node.rate[k].abs(), self.curve.noise[k]);
            least += (size - noise).max(0.0).powi(2);
            most += (size + noise).powi(2);
        }
        (least * DOWN, most * UP)
    }

    /// Not below x at a node where the squares of the speeds of the axes and of the tool are at most these; `speed` is
    /// the least of `self.speed`.
    #[inline(always)]
    pub fn entered(&self, node: &Node<M>, axes_sq: f64, tool_sq: f64, speed: f64) -> f64 {
        if axes_sq == 0.0 || tool_sq == 0.0 {
            return 0.0;
        }
        let axes = if self.tip_speed.is_some() { self.axes_speed(node).0 } else { speed };
        (axes_sq / axes).min(tool_sq / speed) * UP
    }

    /// The square of the speed that the feed limits over x at a node, at least; `speed` is the least of `self.speed`.
    #[inline(always)]
    fn feed_rate(&self, node: &Node<M>, speed: f64) -> f64 {
        let Some(share) = self.share else { return speed };
        let least = |k: usize| share[k] * (node.rate[k].abs() - self.curve.noise[k]).max(0.0);
        (0..M).map(|k| least(k).powi(2)).sum::<f64>() * DOWN
    }

    /// Not below x at a node; `speed` is the least of `self.speed`.
    #[inline(always)]
    pub fn greatest(&self, node: &Node<M>, speed: f64) -> f64 {
        let (task, noise) = (self.task, &self.curve.noise);
        let mut most = self.feed_sq / self.feed_rate(node, speed);
        for k in 0..M {
            let least = (node.rate[k].abs() - noise[k]).max(0.0);
            // At a cusp the rate may have the sign of what comes before.
            let v_sq = match node.order {
                0 => task.velocity_sq[usize::from(node.rate[k] < 0.0)][k],
                _ => task.velocity_sq[0][k].max(task.velocity_sq[1][k]),
            };
            most = most.min(v_sq / (least * least));
        }
        if node.order == 0 {
            for j in 0..M {
                for k in j + 1..M {
                    // ω² (g_j s + g_j' π) = a_j within its limits, the same of k, without s: ω² W π = a_j g_k − a_k g_j.
                    let twist = self.curve.twist(node, j, k);
                    if twist != 0.0 {
                        let sign = 1.0_f64.copysign(twist);
                        let both = self.most_times(j, sign * node.g[k], noise[k])
                            + self.most_times(k, -sign * node.g[j], noise[j]);
                        most = most.min(both / (twist.abs() * node.weight_sq));
                    }
                }
            }
            for k in 0..M {
                most = most.min(self.at_turn(node, k));
            }
            if let Some(limit) = self.chord_speed_sq(node) {
                most = most.min(limit / speed);
            }
        }
        most * UP
    }

    /// Not below the acceleration of axis k times `factor`, which may be off by `noise`.
    #[inline(always)]
    fn most_times(&self, k: usize, factor: f64, noise: f64) -> f64 {
        let [forward, backward] = self.task.acceleration.each_ref().map(|side| side[k]);
        let (size, own) = (factor.abs(), if factor < 0.0 { backward } else { forward });
        (if size > noise { own } else { forward.max(backward) }) * (size + noise)
    }

    /// Not below the greatest v² that the chord error allows at a node.
    fn chord_speed_sq(&self, node: &Node<M>) -> Option<f64> {
        let chord = self.task.chord.as_ref()?;
        let limit = match &self.tip_curve {
            Some(tip) => tip.chord_speed_sq(chord, &tip.node(node.t)),
            None => self.curve.chord_speed_sq(chord, node),
        };
        Some(limit * self.task.speed_share)
    }

    /// Not above the time between two nodes under the chord-error limit; 0 where neither speed is near it.
    fn chord_time(&self, a: &Node<M>, b: &Node<M>, x: [f64; 2]) -> f64 {
        let Some(chord) = &self.task.chord else { return 0.0 };
        let is_near = |node: &Node<M>, x: f64| {
            node.order == 0
                && self.chord_speed_sq(node).is_some_and(|limit| x * self.speed(node).1 > NEAR_CHORD * limit)
        };
        if !(is_near(a, x[0]) || is_near(b, x[1])) {
            return 0.0;
        }
        let feed_sq = if self.share.is_some() { f64::INFINITY } else { self.feed_sq * UP };
        let time = match &self.tip_curve {
            Some(tip) => tip.chord_time(chord, feed_sq, &tip.node(a.t), &tip.node(b.t)),
            None => self.curve.chord_time(chord, feed_sq, a, b),
        };
        time / self.task.speed_share
    }

    /// Not below π at a node next to which axis k turns: its velocity is 0 there, and v_k² at most 2 A_k times the way
    /// from there, so that with g_k' between two slopes up to there π ≤ A_k |g_k'|max/(|g_k'|min² ω²).
    #[inline(always)]
    fn at_turn(&self, node: &Node<M>, k: usize) -> f64 {
        let curve = &self.curve;
        let (g, c) = (node.g[k].abs() + curve.noise[k], node.c[k].abs());
        if g >= NEAR_TURN * c {
            return f64::INFINITY;
        }
        let n = curve.degree as f64;
        let d = 2.0 * g / c;
        let change = n * curve.noise[k] + 4.0 * n * n * curve.size[k] * d;
        if !(change < 0.25 * c && node.t - d >= 0.0 && node.t + d <= 1.0) {
            return f64::INFINITY;
        }
        let weight = (node.weight_sq.sqrt() - curve.weight_change(d)) * DOWN;
        self.task.acceleration[usize::from(node.c[k] < 0.0)][k] * (c + change)
            / ((c - change).powi(2) * weight * weight)
    }

    /// Not below what the square of the velocity of axis k over 2 grows by between two nodes, in the order of time or
    /// against it.
    ///
    /// In the sense in which the axis gets on it goes `most` at most, and back (most − least)/2.
    #[inline(always)]
    fn gain(&self, k: usize, in_time: bool, ways: &Ways<M>) -> f64 {
        let side = if in_time { ways.side[k] } else { 1 - ways.side[k] };
        let (on, back) = (self.task.acceleration[side][k], self.task.acceleration[1 - side][k]);
        let (least, most) = (ways.least[k], ways.most[k]);
        if least > 0.0 {
            on * most + (back - on).max(0.0) * 0.5 * (most - least)
        } else {
            on.max(back) * most
        }
    }

    /// Not below x at `to` where it is at most `x` at `from`, on either side of it.
    #[inline(always)]
    pub fn rise(&self, from: &Node<M>, x: f64, to: &Node<M>, ways: &Ways<M>) -> f64 {
        let mut most = f64::INFINITY;
        for k in 0..M {
            let noise = self.curve.noise[k];
            let rate = from.rate[k].abs() + noise;
            let kept = if self.curve.turns(k, from, to) { 0.0 } else { rate * rate * x };
            let reached = kept + 2.0 * self.gain(k, from.t < to.t, ways);
            let rate = (to.rate[k].abs() - noise).max(0.0);
            most = most.min(reached / (rate * rate));
        }
        most * UP
    }

    /// Not above the time from `a` to `b` with at most these x; `axis` is looked at first, then the length, then all
    /// else, until the time is `wanted`.
    #[inline(always)]
    pub fn time(
        &self,
        (a, b): (&Node<M>, &Node<M>),
        x: [f64; 2],
        ways: &Ways<M>,
        axis: usize,
        wanted: f64,
    ) -> f64 {
        let of_axis = |k: usize| {
            let noise = self.curve.noise[k];
            let (first, last) = (a.rate[k].abs() + noise, b.rate[k].abs() + noise);
            let (first_sq, last_sq) = (first * first * x[0] * UP, last * last * x[1] * UP);
            let (task, side) = (self.task, ways.side[k]);
            let ramps = [task.acceleration[side][k], task.acceleration[1 - side][k]];
            least_time(ways.least[k], first_sq, last_sq, ramps, task.velocity_sq[side][k])
        };
        let mut time = if axis < M { of_axis(axis) } else { 0.0 };
        if time < wanted {
            time = time.max(self.length(a, b, ways) / self.feed_sq.sqrt() * DOWN);
        }
        if time < wanted {
            time = (0..M).map(of_axis).fold(time, f64::max).max(self.chord_time(a, b, x));
        }
        time
    }

    /// Not above the way from `a` to `b` along which the feed counts.
    fn length(&self, a: &Node<M>, b: &Node<M>, ways: &Ways<M>) -> f64 {
        if let Some(tip) = &self.tip_speed {
            let d = |t: f64| tip.at(t, 0).0;
            return root_integral(&d, tip.coefficients.len() - 1, tip.noise, (a.t, b.t)) * DOWN;
        }
        let share = self.share.unwrap_or(&[1.0; M]);
        let chord = (0..M).map(|k| (share[k] * ways.least[k]).powi(2)).sum::<f64>().sqrt() * DOWN;
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
            let g = self.curve.node(t).g;
            (0..M).map(|k| (share[k] * g[k]).powi(2)).sum()
        };
        let bound = root_integral(&d, 2 * self.curve.degree, 2.0 * greatest * noise, (a.t, b.t));
        chord.max(bound * DOWN)
    }
}

impl TipSpeed<'_> {
    /// D at t, for a cusp of some order at an end its leading coefficient, and how far it may be off.
    #[inline(always)]
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
