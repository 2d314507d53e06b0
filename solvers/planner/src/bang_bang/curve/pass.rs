//! One pass over one sub-piece: the greatest π(x) under a ceiling, from the state at the start. Backward the ceiling
//! is the cap, and the limit curve is followed where needed; forward the ceiling is K.
//!
//! Every switch is the first root of a polynomial, with w = ω v_j² on a phase of axis j, W as in `bang_bang`, A⁻ the
//! limits of decelerations (the backward pass swaps A and A⁻), and ' = d/dx:
//!
//! | while | holds |
//! |---|---|
//! | on a phase of axis j, axis l stays below +A_l | A_l g_j³ − A_j g_l g_j² − ω w W_lj ≥ 0 |
//! | on a phase of axis j, axis l stays above −A_l⁻ (backward only) | A_l⁻ g_j³ + A_j g_l g_j² + ω w W_lj ≥ 0 |
//! | a phase of axis j stays under a ceiling π ≤ n/d | n ω g_j² − w d ≥ 0 |
//! | the pass stays on the limit curve π = N/(ω² W), N = A_j g_l + A_l⁻ g_j, W = W_jl | ω (N W' − 3 N' W) + 2 ω' N W ≥ 0 |
//! | on it, axis i stays between −A_i⁻ and A_i | A_i W − (c_i N − g_i N') ≥ 0, A_i⁻ W + (c_i N − g_i N') ≥ 0 |
//! | along a cap v² = f, axis l stays below +A_l | A_l D² − ω² ((c_l D − g_l D'/2) f + g_l D f'/2) ≥ 0 |
//! | along a cap v_k = V, axis l stays below +A_l | A_l g_k³ − V² ω² W_lk ≥ 0 |

mod bang;
mod limit_curve;
mod slide;

use super::part::SubPiece;
use super::window::{Ceiling, Window};
use crate::bang_bang::tolerance::{AT_END, NO_STEP, ON_CEILING, ON_LIMIT_CURVE, WEAK_TIE};
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// A step from x counts if it is longer than `NO_STEP` times x, or times `START` where x is smaller.
const START: f64 = 1e-6;
/// Greatest number of switches in succession without a step.
const MAX_HOPS: u32 = 10;
const MAX_SWITCHES: u32 = 2000;

/// What is constant on a phase; accelerations are in the direction of the pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// This axis is at +A.
    Accelerating(usize),
    /// This axis is at −A⁻. Only in the forward pass, along a phase of K.
    Braking(usize),
    /// The speed of the cap.
    Cap,
    /// The limit curve. Only in the backward pass.
    LimitCurve,
}

/// A phase on [x0, x1] of the sub-piece.
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    pub x0: f64,
    pub x1: f64,
    pub law: Law,
    /// π at both ends, with respect to x of the whole sub-piece; it may be infinite at a cusp.
    pub pi: [f64; 2],
    /// The square of the control axis's velocity where the phase is slowest: at x0 of an accelerating phase, at x1 of
    /// a braking one.
    pub slow_sq: f64,
}

/// The pass makes no headway at this x.
#[derive(Clone, Copy, Debug)]
pub struct Stuck(pub f64);

/// One pass over the sub-piece, from the sum `speed_sq` of the squared axis velocities at its start [mm²/s²]. Without
/// `controllable` it is the backward pass under the cap of the sub-piece, otherwise the forward pass under these phases of K,
/// from the last to the first. Appends the phases and returns the sum of the squared axis velocities at the end.
pub fn travel<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    speed_sq: f64,
    controllable: Option<&[Phase]>,
    out: &mut Vec<Phase>,
) -> Result<f64, Stuck> {
    // In a cusp all axes rest, and π has no finite value.
    let order = sub.cusp_order(false);
    let pi = if order == 0 { speed_sq / sub.rate_sq(false) } else { f64::INFINITY };
    let first = out.len();
    let mut pass = Pass {
        sub,
        back: controllable.is_none(),
        window: Window::new(sub),
        pi,
        order,
        straight: sub.straight,
        out,
        control: None,
        tied: 0,
        low: None,
        tangent: false,
        leaving: false,
        hops: 0,
        limit_curve: None,
        entering: true,
    };
    match controllable {
        None => pass.over_window()?,
        Some(controllable) => pass.under_controllable(controllable)?,
    }
    let pi = pass.pi;
    let sound = |phase: &Phase| {
        (phase.pi[0] >= 0.0) & (phase.pi[1] >= 0.0) & (phase.slow_sq >= 0.0) & phase.slow_sq.is_finite()
    };
    if let Some(phase) = out[first..].iter().find(|phase| !sound(phase)) {
        return Err(Stuck(phase.x0));
    }
    let speed_sq = if sub.cusp_order(true) == 0 { pi * sub.rate_sq(true) } else { 0.0 };
    Ok(speed_sq.max(0.0))
}

/// The distance [mm] that axis k travels from x0 to x1.
pub fn axis_distance<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    k: usize,
    x0: f64,
    x1: f64,
) -> f64 {
    let g = sub.g[k].part(x0, x1);
    if sub.weight.degree() == 0 {
        return (x1 - x0) * g.mean();
    }
    let weight = sub.weight.part(x0, x1);
    (x1 - x0) * g.antiderivative(&weight, sub.degree).last() / weight.last()
}

/// Tangents g and their slopes c at the start of the window.
struct Start<const M: usize> {
    g: [f64; M],
    c: [f64; M],
    /// A_k/ω², its slope, and A_k⁻/ω².
    limit: [f64; M],
    limit_slope: [f64; M],
    low_limit: [f64; M],
}

struct Pass<'a, const M: usize, const C: usize> {
    sub: &'a SubPiece<M, C>,
    /// The pass goes backward.
    back: bool,
    window: Window<M, C>,
    /// π with respect to x of the window.
    pi: f64,
    /// At the start of the window all tangents have a zero of this order; where it is positive, the axes rest.
    order: usize,
    straight: bool,
    out: &'a mut Vec<Phase>,
    /// The axis that has just reached its limit and becomes the control axis; the bits of the axes that are at their limits as
    /// well.
    control: Option<usize>,
    tied: AxisBits,
    /// The axis at −A⁻ on the limit curve that has just been left.
    low: Option<usize>,
    /// `tangent`: the pass leaves the ceiling or the limit curve along its tangent. `leaving`: the pass leaves the ceiling.
    tangent: bool,
    leaving: bool,
    hops: u32,
    /// The axes at +A and −A⁻ on the limit curve.
    limit_curve: Option<(usize, usize)>,
    entering: bool,
}

impl<const M: usize, const C: usize> Pass<'_, M, C> {
    /// Whether the interval from the start of the window to t is long enough for a step.
    fn is_step(&self, t: f64) -> bool {
        t * self.window.length() >= NO_STEP * self.window.x0.max(START)
    }

    fn stuck(&self) -> Stuck {
        Stuck(self.window.x0)
    }

    fn moving(&self) -> impl Iterator<Item = usize> {
        let moving = self.sub.moving;
        (0..M).filter(move |k| moving >> k & 1 == 1)
    }

    /// Forward: over one window after the other, each under one phase of K.
    fn under_controllable(&mut self, controllable: &[Phase]) -> Result<(), Stuck> {
        let mut x0 = 0.0;
        for (i, phase) in controllable.iter().rev().enumerate() {
            let x1 = if i + 1 < controllable.len() { 1.0 - phase.x0 } else { 1.0 };
            let pi = [phase.pi[1], phase.pi[0]];
            match phase.law {
                // Any other motion under a phase of K meets it again later.
                Law::Accelerating(k) if self.is_on_phase(pi[0]) => {
                    self.out.push(Phase { x0, x1, law: Law::Braking(k), pi, slow_sq: phase.slow_sq });
                    self.pi = pi[1];
                    self.after_step();
                }
                _ => {
                    if controllable.len() > 1 {
                        self.window = Window::new(self.sub).part(x0, x1);
                    }
                    self.set_ceiling(phase);
                    // From π with respect to x of the sub-piece to π with respect to x of the window.
                    self.pi /= self.window.length().powi(2);
                    self.over_window()?;
                }
            }
            x0 = x1;
        }
        Ok(())
    }

    /// Whether the state is on a phase of K that begins with this π, with respect to x of the sub-piece.
    fn is_on_phase(&self, pi: f64) -> bool {
        self.order == 0 && !self.leaving && pi.is_finite() && self.pi >= pi * (1.0 - ON_CEILING)
    }

    /// Makes a phase of K the ceiling of the window.
    fn set_ceiling(&mut self, phase: &Phase) {
        let window = &mut self.window;
        match phase.law {
            Law::Accelerating(k) | Law::Braking(k) => {
                let (g, weight) = (window.g[k].reverse(), window.weight.reverse());
                let gain = g.antiderivative(&weight, self.sub.degree);
                // In the direction of the forward pass the axis brakes.
                let w = weight.combine(phase.slow_sq, &gain, 2.0 * self.sub.limits.down[k]);
                window.ceiling = Ceiling::Phase(k, w.reverse());
            }
            Law::Cap => {}
            Law::LimitCurve => window.ceiling = Ceiling::LimitCurve,
        }
        if phase.law != Law::LimitCurve {
            window.known = [Some(phase.pi[1]), Some(phase.pi[0])];
        }
    }

    /// Travels to the end of the window. After it, `pi` is with respect to x of the whole sub-piece.
    fn over_window(&mut self) -> Result<(), Stuck> {
        self.entering = true;
        for _ in 0..MAX_SWITCHES {
            if self.window.x0 >= self.window.x1 {
                return Ok(());
            }
            let start = self.start();
            if std::mem::take(&mut self.entering) {
                self.enter(&start);
            }
            // The forward pass needs no test against the limit curve.
            if let Some(pair) = self.limit_curve.take().filter(|_| self.back) {
                if !self.follow_limit_curve(pair) && self.hops > MAX_HOPS {
                    return Err(self.stuck());
                }
                continue;
            }
            let on_ceiling = self.is_on_ceiling();
            if on_ceiling {
                self.pi = self.window.ceiling_at_start();
                if !self.leaving && self.follow_ceiling() {
                    continue;
                }
            }
            self.accelerate(&start, on_ceiling)?;
        }
        Err(self.stuck())
    }

    fn is_on_ceiling(&self) -> bool {
        self.order == 0 && self.pi >= self.window.ceiling_at_start() * (1.0 - ON_CEILING)
    }

    fn start(&self) -> Start<M> {
        let (w, slope) = (self.window.weight.first(), self.window.weight.first_slope());
        let g = &self.window.g;
        let limit = self.sub.limits.up.map(|a| a / (w * w));
        Start {
            g: std::array::from_fn(|k| g[k].first()),
            c: std::array::from_fn(|k| g[k].first_slope()),
            limit,
            low_limit: self.sub.limits.down.map(|a| a / (w * w)),
            limit_slope: if slope == 0.0 { [0.0; M] } else { limit.map(|limit| -2.0 * limit * slope / w) },
        }
    }

    /// Lowers π to the ceiling, to the limits of the axes that turn here and, in the backward pass, to the limit curve.
    fn enter(&mut self, start: &Start<M>) {
        if self.order > 0 {
            return;
        }
        self.pi = self.pi.min(self.window.ceiling_at_start());
        for k in 0..M {
            if start.g[k] == 0.0 && start.c[k] != 0.0 {
                let limit = if start.c[k] > 0.0 { start.limit[k] } else { start.low_limit[k] };
                self.pi = self.pi.min(limit / start.c[k].abs());
            }
        }
        if !self.back || self.straight {
            return;
        }
        let mut lowest = f64::INFINITY;
        for j in 0..M {
            for l in 0..j {
                let w = start.c[j] * start.g[l] - start.c[l] * start.g[j];
                if start.g[j] > 0.0 && start.g[l] > 0.0 && w != 0.0 {
                    let (high, low) = if w > 0.0 { (j, l) } else { (l, j) };
                    let n = start.limit[high] * start.g[low] + start.low_limit[low] * start.g[high];
                    lowest = lowest.min(n / w.abs());
                }
            }
        }
        if self.pi < lowest * (1.0 - ON_LIMIT_CURVE) {
            return;
        }
        self.pi = self.pi.min(lowest);
        let Some((j, s)) = self.control_axis(start).map(|(j, s, ..)| (j, s)) else { return };
        let mut low: Option<(usize, f64)> = None;
        for l in self.moving().filter(|&l| l != j && start.g[l] > 0.0) {
            let needed = (-start.low_limit[l] - start.c[l] * self.pi) / start.g[l];
            if low.is_none_or(|(_, most)| needed > most) {
                low = Some((l, needed));
            }
        }
        if let Some((l, needed)) = low {
            if needed >= s - WEAK_TIE * (s.abs() + needed.abs()) {
                self.limit_curve = Some((j, l));
            }
        }
    }

    /// Appends the phase from the start of the window to t and moves the start of the window to t. With w = ω v_j², π at the
    /// end is that of the phase, otherwise that of the ceiling.
    fn push(&mut self, t: f64, law: Law, w: Option<&Polynomial<C>>, slow_sq: f64) {
        let length = self.window.length();
        let scale = length * length;
        let x0 = self.window.x0;
        let mut pi_start = self.pi * scale;
        if self.order > 0 {
            // The limit of π at a cusp.
            pi_start = match law {
                Law::Accelerating(j) if self.order == 1 => {
                    let lead = self.window.g[j].coefficients()[1];
                    self.sub.limits.up[j] / (lead * self.window.weight.first().powi(2)) * scale
                }
                _ => f64::INFINITY,
            };
        }
        // π at the end with respect to x of the sub-piece.
        let of_phase = w.and_then(|w| match law {
            Law::Accelerating(j) => {
                let at = |p: &Polynomial<C>| if t == 1.0 { p.last() } else { p.value(t) };
                let (w, g, weight) = (at(w), at(&self.window.g[j]), at(&self.window.weight));
                let pi = if g > 0.0 { w / (weight * g * g) } else { f64::INFINITY };
                let turn = if g > 0.0 { None } else { self.at_turn(j) };
                Some(turn.unwrap_or(pi) * scale)
            }
            _ => None,
        });
        let pi_end;
        if t < 1.0 {
            self.window.leave_before(t);
            let scale = self.window.length().powi(2);
            pi_end = of_phase.unwrap_or_else(|| self.window.ceiling_at_start() * scale);
            self.pi = pi_end / scale;
        } else {
            pi_end = of_phase.unwrap_or_else(|| self.window.ceiling_at_end());
            self.window.x0 = self.window.x1;
            self.pi = pi_end;
        }
        self.out.push(Phase { x0, x1: self.window.x0, law, pi: [pi_start, pi_end], slow_sq });
        self.order = 0;
    }

    /// π at the end of the window if axis j turns there: the greatest one that its deceleration limit allows, A_j⁻/(|c_j|
    /// ω²).
    fn at_turn(&self, j: usize) -> Option<f64> {
        let slope = self.window.g[j].reverse().first_slope();
        (slope != 0.0).then(|| self.sub.limits.down[j] / (slope.abs() * self.window.weight.last().powi(2)))
    }
}

/// The earliest end of a phase that tests have found, and what ends it there; t = 1 is the end of the window.
struct Earliest<S> {
    t: f64,
    switch: Option<S>,
}

impl<S> Earliest<S> {
    /// Replaces the end if `t` is earlier.
    #[inline]
    fn offer(&mut self, t: Option<f64>, switch: S) {
        if let Some(t) = t.filter(|&t| t < self.t) {
            *self = Self { t, switch: Some(switch) };
        }
    }

    /// The end and its switch. An end within `AT_END` of the end of the window counts as the end of the window, without a switch.
    fn found(self) -> (f64, Option<S>) {
        if self.t > 1.0 - AT_END && self.t < 1.0 {
            return (1.0, None);
        }
        (self.t, self.switch)
    }
}

/// The first t at which the polynomial `test` falls below 0 by more than rounding; None if it does not. `size` gives the rounding
/// errors of its coefficients. `known` roots at t = 0 are divided out first; then a value at t = 0 between −`slack` and 0
/// counts as 0.
#[inline]
fn first_failure<const C: usize>(
    test: &Polynomial<C>,
    size: impl FnOnce() -> Polynomial<C>,
    known: usize,
    slack: f64,
) -> Option<f64> {
    if test.is_positive()
        || test.coefficients().iter().skip(known.min(test.degree())).all(|&value| value >= 0.0)
    {
        return None;
    }
    let mut inflated = test.combine(1.0, &size(), 1.0);
    if known > 0 {
        inflated = inflated.deflate(known);
    }
    if inflated.first() < 0.0 && inflated.first() > -slack {
        inflated.set_first(0.0);
    }
    inflated.first_root()
}
