//! One pass over one sub-piece, in the sense of travel: the greatest π that stays under a bound.
//!
//! As on quadratic pieces: for every λ in [0, 1] a feasible profile scaled by λ stays feasible, so that backward under
//! the velocity cap and the limit curve, then forward under what that left, are exact. Every event is the first root
//! of a polynomial; with N, W, M of axes j, l and w = ω v_j²
//!
//! and A the limit of accelerations, A⁻ that of decelerations (an axis that moves backward on the path has them the other
//! way round; the backward pass swaps them)
//!
//! | while | holds |
//! |---|---|
//! | on a phase of axis j, axis l stays below +A_l | A_l g_j³ − A_j g_l g_j² − ω w (g_l' g_j − g_l g_j') ≥ 0 |
//! | and above −A_l⁻ (backward) | A_l⁻ g_j³ + A_j g_l g_j² + ω w (g_l' g_j − g_l g_j') ≥ 0 |
//! | under a bound π ≤ n/d | n ω g_j² − w d ≥ 0 |
//! | on the limit curve π = N/(ω² W), N = A_j g_l + A_l⁻ g_j, W = g_j' g_l − g_j g_l' | ω (N W' − 3 N' W) + 2 ω' N W ≥ 0 |
//! | and axis i from −A_i⁻ to A_i | A_i W − (g_i' N − g_i N') ≥ 0, A_i⁻ W + (g_i' N − g_i N') ≥ 0 |
//! | along v² = f | A_l D² − ω² ((g_l' D − g_l D'/2) f + g_l D f'/2) ≥ 0 |
//! | along v_k = V | A_l g_k³ − V² ω² (g_l' g_k − g_l g_k') ≥ 0 |

mod bang;
mod limit_curve;
mod slide;

use super::part::SubPiece;
use super::window::{Bound, Window};
use crate::bang_bang::tolerance::{NO_STEP, ON_BOUND, ON_LIMIT_CURVE, WEAK_TIE};
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

const START: f64 = 1e-6;
/// So many events may follow one another without a step.
const MAX_HOPS: u32 = 10;
const MAX_EVENTS: u32 = 2000;

/// What stays constant on a phase, in the sense of the pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Axis at +A.
    Accelerating(usize),
    /// Forward, on a phase of the backward pass: axis at −A.
    Braking(usize),
    /// The velocity cap of the sub-piece.
    Cap,
    /// The limit curve; backward only.
    LimitCurve,
}

/// A phase from x0 to x1 of the sub-piece as the pass travels it.
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    pub x0: f64,
    pub x1: f64,
    pub kind: Kind,
    /// π at its ends, of the whole sub-piece; infinite where the tool passes a place without a tangent.
    pub pi: [f64; 2],
    /// The velocity squared of the axis where the phase is slowest: of an accelerating phase at x0, of a braking one at x1.
    pub slow_sq: f64,
}

/// A pass made no headway at x.
#[derive(Clone, Copy, Debug)]
pub struct Stuck(pub f64);

/// The state where a pass enters or leaves a sub-piece.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// The sum of the axes' velocities squared; v² where the axes are those of the tool.
    pub speed_sq: f64,
}

/// Over the sub-piece as travelled, from a state, under its cap (backward) or under the phases of the backward pass
/// (forward: from its last to its first); appends the phases and returns the state at the end.
pub fn run<const M: usize, const C: usize, const BACK: bool>(
    sub: &SubPiece<M, C>,
    state: State,
    bounds: &[Phase],
    out: &mut Vec<Phase>,
) -> Result<State, Stuck> {
    // A curve stops in its cusps.
    let order = sub.cusp_order(false);
    let pi = if order == 0 { state.speed_sq / sub.rate_sq(false) } else { f64::INFINITY };
    let first = out.len();
    let mut pass = Pass::<M, C, BACK> {
        sub,
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
    if BACK {
        pass.over_window()?;
    } else {
        pass.under(bounds)?;
    }
    let pi = pass.pi;
    let sound = |phase: &Phase| {
        (phase.pi[0] >= 0.0) & (phase.pi[1] >= 0.0) & (phase.slow_sq >= 0.0) & phase.slow_sq.is_finite()
    };
    if let Some(phase) = out[first..].iter().find(|phase| !sound(phase)) {
        return Err(Stuck(phase.x0));
    }
    let speed_sq = if sub.cusp_order(true) == 0 { pi * sub.rate_sq(true) } else { 0.0 };
    Ok(State { speed_sq: speed_sq.max(0.0) })
}

/// The way of axis k from x0 to x1 of a sub-piece.
pub fn distance<const M: usize, const C: usize>(sub: &SubPiece<M, C>, k: usize, x0: f64, x1: f64) -> f64 {
    let g = sub.g[k].part(x0, x1);
    if sub.weight.degree() == 0 {
        return (x1 - x0) * g.mean();
    }
    let weight = sub.weight.part(x0, x1);
    (x1 - x0) * g.antiderivative(&weight, sub.degree).last() / weight.last()
}

/// Tangents and their slopes at the start of the window.
struct Start<const M: usize> {
    g: [f64; M],
    c: [f64; M],
    /// A_k/ω² and its slope, and the same of decelerations.
    limit: [f64; M],
    limit_slope: [f64; M],
    low_limit: [f64; M],
}

struct Pass<'a, const M: usize, const C: usize, const BACK: bool> {
    sub: &'a SubPiece<M, C>,
    window: Window<M, C>,
    /// π of the window.
    pi: f64,
    /// All tangents have a zero of this order at the start of the window, and the axes are at rest.
    order: usize,
    straight: bool,
    out: &'a mut Vec<Phase>,
    /// The axis that has just saturated, and bits of those that share its acceleration.
    control: Option<usize>,
    tied: AxisBits,
    /// The axis at −A, where the limit curve has just been left.
    low: Option<usize>,
    /// The bound or the limit curve has just been left along its tangent.
    tangent: bool,
    leaving: bool,
    hops: u32,
    /// The axes at +A and −A on the limit curve.
    limit_curve: Option<(usize, usize)>,
    entering: bool,
}

impl<const M: usize, const C: usize, const BACK: bool> Pass<'_, M, C, BACK> {
    /// Whether there is a way from the start of the window to t.
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

    /// Forward: over one window after the other, each under one phase of the backward pass.
    fn under(&mut self, bounds: &[Phase]) -> Result<(), Stuck> {
        let mut x0 = 0.0;
        for (i, phase) in bounds.iter().rev().enumerate() {
            let x1 = if i + 1 < bounds.len() { 1.0 - phase.x0 } else { 1.0 };
            let pi = [phase.pi[1], phase.pi[0]];
            match phase.kind {
                // Any other motion under a phase of the backward pass meets it again later.
                Kind::Accelerating(k) if self.joins(pi[0]) => {
                    self.out.push(Phase { x0, x1, kind: Kind::Braking(k), pi, slow_sq: phase.slow_sq });
                    self.pi = pi[1];
                    self.arrived();
                }
                _ => {
                    if bounds.len() > 1 {
                        self.window = Window::new(self.sub).part(x0, x1);
                    }
                    self.bound_by(phase);
                    // From π of the sub-piece to that of the window.
                    self.pi /= self.window.length().powi(2);
                    self.over_window()?;
                }
            }
            x0 = x1;
        }
        Ok(())
    }

    /// Whether π of the sub-piece is on a phase of the backward pass that begins with this one.
    fn joins(&self, pi: f64) -> bool {
        self.order == 0 && !self.leaving && pi.is_finite() && self.pi >= pi * (1.0 - ON_BOUND)
    }

    /// Puts the window under a phase of the backward pass.
    fn bound_by(&mut self, phase: &Phase) {
        let window = &mut self.window;
        match phase.kind {
            Kind::Accelerating(k) | Kind::Braking(k) => {
                let (g, weight) = (window.g[k].reverse(), window.weight.reverse());
                let gain = g.antiderivative(&weight, self.sub.degree);
                // In the sense of this pass the axis brakes.
                let w = weight.combine(phase.slow_sq, &gain, 2.0 * self.sub.limits.down[k]);
                window.bound = Bound::Phase(k, w.reverse());
            }
            Kind::Cap => {}
            Kind::LimitCurve => window.bound = Bound::LimitCurve,
        }
        if phase.kind != Kind::LimitCurve {
            window.known = [Some(phase.pi[1]), Some(phase.pi[0])];
        }
    }

    /// To the end of the window; leaves π there, of the whole sub-piece.
    fn over_window(&mut self) -> Result<(), Stuck> {
        self.entering = true;
        for _ in 0..MAX_EVENTS {
            if self.window.x0 >= self.window.x1 {
                return Ok(());
            }
            let start = self.start();
            if std::mem::take(&mut self.entering) {
                self.enter(&start);
            }
            // The constant comes first: nothing of the limit curve is compiled for the forward pass.
            if BACK {
                if let Some(pair) = self.limit_curve.take() {
                    if !self.follow_limit_curve(pair) && self.hops > MAX_HOPS {
                        return Err(self.stuck());
                    }
                    continue;
                }
            }
            let on_bound = self.is_on_bound();
            if on_bound {
                self.pi = self.window.bound_at_start();
                if !self.leaving && self.follow_bound() {
                    continue;
                }
            }
            self.accelerate(&start, on_bound)?;
        }
        Err(self.stuck())
    }

    /// Whether the state is on the bound.
    fn is_on_bound(&self) -> bool {
        self.order == 0 && self.pi >= self.window.bound_at_start() * (1.0 - ON_BOUND)
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

    /// Puts π under the bound, under the limits of axes that turn here, and backward on or under the limit curve.
    fn enter(&mut self, start: &Start<M>) {
        if self.order > 0 {
            return;
        }
        self.pi = self.pi.min(self.window.bound_at_start());
        for k in 0..M {
            if start.g[k] == 0.0 && start.c[k] != 0.0 {
                let limit = if start.c[k] > 0.0 { start.limit[k] } else { start.low_limit[k] };
                self.pi = self.pi.min(limit / start.c[k].abs());
            }
        }
        if !BACK || self.straight {
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
        let Some((j, s)) = self.least(start).map(|(j, s, ..)| (j, s)) else { return };
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

    /// Appends a phase to t of the window and leaves the rest; without w, π at the end is that of the bound.
    fn push(&mut self, t: f64, kind: Kind, w: Option<&Polynomial<C>>, slow_sq: f64) {
        let length = self.window.length();
        let scale = length * length;
        let x0 = self.window.x0;
        let mut pi_start = self.pi * scale;
        if self.order > 0 {
            // The limit at a cusp.
            pi_start = match kind {
                Kind::Accelerating(j) if self.order == 1 => {
                    let lead = self.window.g[j].coefficients()[1];
                    self.sub.limits.up[j] / (lead * self.window.weight.first().powi(2)) * scale
                }
                _ => f64::INFINITY,
            };
        }
        // π at the end, of the sub-piece.
        let of_phase = w.and_then(|w| match kind {
            Kind::Accelerating(j) => {
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
            pi_end = of_phase.unwrap_or_else(|| self.window.bound_at_start() * scale);
            self.pi = pi_end / scale;
        } else {
            pi_end = of_phase.unwrap_or_else(|| self.window.bound_at_end());
            self.window.x0 = self.window.x1;
            self.pi = pi_end;
        }
        self.out.push(Phase { x0, x1: self.window.x0, kind, pi: [pi_start, pi_end], slow_sq });
        self.order = 0;
    }

    /// π at the end of the window where axis j turns round: all others hold it there.
    fn at_turn(&self, j: usize) -> Option<f64> {
        let slope = self.window.g[j].reverse().first_slope();
        (slope != 0.0).then(|| self.sub.limits.down[j] / (slope.abs() * self.window.weight.last().powi(2)))
    }
}

/// Where a test first fails by more than rounding. `size` gives how much rounding it can hold; `known` roots at 0 are
/// divided out; without any, a start that misses by less than `slack` is kept.
#[inline(always)]
fn kept_until<const C: usize>(
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
