//! One pass over one sub-piece, in the sense of travel: the greatest π that stays under a bound.
//!
//! As on quadratic pieces: for every λ in [0, 1] a feasible profile scaled by λ stays feasible, so that backward under
//! the velocity cap and the limit curve, then forward under what that left, are exact. Every event is the first root
//! of a polynomial; with N, W, M of axes j, l and w = ω v_j²
//!
//! | while | holds |
//! |---|---|
//! | on an arc of axis j, axis l stays below +A_l | A_l g_j³ − A_j g_l g_j² − ω w (g_l' g_j − g_l g_j') ≥ 0 |
//! | and above −A_l (backward) | A_l g_j³ + A_j g_l g_j² + ω w (g_l' g_j − g_l g_j') ≥ 0 |
//! | under a bound π ≤ n/d | n ω g_j² − w d ≥ 0 |
//! | on the limit curve π = N/(ω² W), N = A_j g_l + A_l g_j, W = g_j' g_l − g_j g_l' | ω (N W' − 3 N' W) + 2 ω' N W ≥ 0 |
//! | and axis i within ±A_i | A_i W ± (g_i' N − g_i N') ≥ 0 |
//! | along v² = f | A_l D² − ω² ((g_l' D − g_l D'/2) f + g_l D f'/2) ≥ 0 |
//! | along v_k = V | A_l g_k³ − V² ω² (g_l' g_k − g_l g_k') ≥ 0 |

use super::split::{Axes, SubPiece};
use super::window::{Bound, Window};
use crate::polynomial::Polynomial;

/// Tests are taken for kept while they miss by less than this part of their own terms.
const NOISE: f64 = 1e-13;
/// π this close below a bound is on it.
const ON_BOUND: f64 = 1e-12;
/// Backward, π this close below the limit curve is on it.
const ON_LIMIT_CURVE: f64 = 1e-11;
/// Accelerations this close to each other are equal.
const TIE: f64 = 1e-10;
/// A zero of g_k and π this close to A_k/|g_k'|: the axis holds π.
const FLAT: f64 = 1e-9;
/// An event this close to the end of the window is at the end.
const AT_END: f64 = 1e-11;
/// A step shorter than this part of the sub-piece is none.
const NO_STEP: f64 = 1e-15;
/// So many events may follow one another without a step.
const MAX_HOPS: u32 = 10;
const MAX_EVENTS: u32 = 2000;

/// What stays constant on an arc, in the sense of the pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Axis at +A.
    Accelerating(usize),
    /// Forward, on an arc of the backward pass: axis at −A.
    Braking(usize),
    /// The velocity cap of the sub-piece.
    Cap,
    /// The limit curve; backward only.
    LimitCurve,
    /// p, in place of a sub-piece that rounding makes too hard.
    Hold,
}

/// An arc from x0 to x1 of the sub-piece as the pass travels it.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    pub x0: f64,
    pub x1: f64,
    pub kind: Kind,
    /// π at its ends, of the whole sub-piece; infinite where the tool passes a place without a tangent.
    pub pi: [f64; 2],
    /// The velocity squared of the axis where the arc is slowest: of an accelerating arc at x0, of a braking one at x1.
    /// Where p is held: (dx/dτ)².
    pub slow_sq: f64,
}

/// A pass made no headway.
#[derive(Clone, Copy, Debug)]
pub struct Stuck;

/// The state where a pass enters or leaves a sub-piece.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// v², in mm²/s²
    pub speed_sq: f64,
}

/// The order of the zero that every tangent component has at an end, and the limit direction there.
pub fn cusp<const M: usize, const C: usize>(sub: &SubPiece<M, C>, at_end: bool) -> (usize, [f64; M]) {
    let degree = sub.g[0].degree();
    let coefficient = |k: usize, r: usize| sub.g[k].coefficients()[if at_end { degree - r } else { r }];
    let mut r = 0;
    while r < degree && (0..M).all(|k| coefficient(k, r) == 0.0) {
        r += 1;
    }
    let lead: [f64; M] = std::array::from_fn(|k| coefficient(k, r));
    let length = lead.iter().map(|x| x * x).sum::<f64>().sqrt();
    (r, lead.map(|x| x / length))
}

/// Over the sub-piece as travelled, from a state, under its cap (backward) or under the arcs of the backward pass
/// (forward: from its last to its first); appends the arcs and returns the state at the end.
pub fn run<const M: usize, const C: usize, const BACK: bool>(
    sub: &SubPiece<M, C>,
    axes: &Axes<M>,
    state: State,
    bounds: &[Arc],
    out: &mut Vec<Arc>,
) -> Result<State, Stuck> {
    let (order, direction) = cusp(sub, false);
    let straight = sub.straight;
    let pi = if order == 0 { state.speed_sq / sub.speed.first() } else { f64::INFINITY };
    let first = out.len();
    let mut pass = Pass::<M, C, BACK> {
        sub,
        axes,
        window: Window::new(sub),
        pi,
        order,
        // A curve stops in its cusps, a straight line need not.
        cusp_sq: if straight { direction.map(|x| x * x * state.speed_sq) } else { [0.0; M] },
        straight,
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
    let sound =
        |arc: &Arc| arc.pi.iter().all(|&pi| pi >= 0.0) && arc.slow_sq >= 0.0 && arc.slow_sq.is_finite();
    if !out[first..].iter().all(sound) {
        return Err(Stuck);
    }
    let (end_order, end_direction) = cusp(sub, true);
    let speed_sq = if end_order == 0 {
        pi * sub.speed.last()
    } else if straight {
        let last = out[first..].last();
        last.map_or(0.0, |arc| end_speed_sq(sub, axes, arc, &end_direction))
    } else {
        0.0
    };
    Ok(State { speed_sq: speed_sq.max(0.0) })
}

/// v² at the end of the last arc, where the sub-piece has no tangent.
fn end_speed_sq<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    axes: &Axes<M>,
    arc: &Arc,
    direction: &[f64; M],
) -> f64 {
    match arc.kind {
        Kind::Accelerating(k) => {
            let way = distance(sub, k, arc.x0, arc.x1);
            (arc.slow_sq + 2.0 * axes.acceleration[k] * way) / direction[k].powi(2)
        }
        Kind::Braking(k) => arc.slow_sq / direction[k].powi(2),
        Kind::Cap => match sub.cap {
            super::split::Cap::Speed([_, f1]) => f1,
            super::split::Cap::Axis(k, v_sq) => v_sq / direction[k].powi(2),
        },
        Kind::LimitCurve | Kind::Hold => 0.0,
    }
}

/// The way of axis k from x0 to x1 of a sub-piece.
pub fn distance<const M: usize, const C: usize>(sub: &SubPiece<M, C>, k: usize, x0: f64, x1: f64) -> f64 {
    let (g, weight) = (sub.g[k].part(x0, x1), sub.weight.part(x0, x1));
    (x1 - x0) * g.antiderivative(&weight, sub.degree).last() / weight.last()
}

/// Tangents, their slopes and bends at the start of the window.
struct Start<const M: usize> {
    g: [f64; M],
    c: [f64; M],
    e: [f64; M],
    /// A_k/ω² and its slope.
    limit: [f64; M],
    limit_slope: [f64; M],
}

enum Event {
    Transition(usize),
    Low(usize),
    Bound,
}

struct Pass<'a, const M: usize, const C: usize, const BACK: bool> {
    sub: &'a SubPiece<M, C>,
    axes: &'a Axes<M>,
    window: Window<M, C>,
    /// π of the window.
    pi: f64,
    /// All tangents have a zero of this order at the start of the window; then `cusp_sq` holds the squares of the axes'
    /// velocities.
    order: usize,
    cusp_sq: [f64; M],
    straight: bool,
    out: &'a mut Vec<Arc>,
    /// The axis that has just saturated, and bits of those that share its acceleration.
    control: Option<usize>,
    tied: u8,
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
    fn moving(&self) -> impl Iterator<Item = usize> {
        let moving = self.sub.moving;
        (0..M).filter(move |k| moving >> k & 1 == 1)
    }

    /// Forward: over one window after the other, each under one arc of the backward pass.
    fn under(&mut self, bounds: &[Arc]) -> Result<(), Stuck> {
        let mut rest = self.window;
        let velocity_cap = rest.bound;
        for (i, arc) in bounds.iter().rev().enumerate() {
            let x1 = 1.0 - arc.x0;
            let mut window = rest;
            if i + 1 < bounds.len() {
                let t = (x1 - rest.x0) / rest.length();
                (window, rest) = (rest.before(t), rest.after(t));
                // Not rounded: π of the next window starts where this one ends.
                window.x1 = x1;
                rest.x0 = x1;
            }
            window.bound = match arc.kind {
                Kind::Accelerating(k) | Kind::Braking(k) => {
                    let (g, weight) = (window.g[k].reverse(), window.weight.reverse());
                    let gain = g.antiderivative(&weight, self.sub.degree);
                    let w = weight.combine(arc.slow_sq, &gain, 2.0 * self.axes.acceleration[k]);
                    Bound::Arc(k, w.reverse())
                }
                Kind::Cap => {
                    debug_assert!(matches!(velocity_cap, Bound::Speed(_) | Bound::Axis(..)));
                    window.bound
                }
                Kind::LimitCurve => Bound::LimitCurve,
                Kind::Hold => Bound::Hold(arc.slow_sq / window.length().powi(2)),
            };
            if arc.kind != Kind::LimitCurve {
                window.known = [Some(arc.pi[1]), Some(arc.pi[0])];
            }
            // From π of the sub-piece to that of the window.
            self.pi /= window.length().powi(2);
            self.window = window;
            self.over_window()?;
        }
        Ok(())
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
            if let Some(pair) = self.limit_curve.take() {
                if self.follow_limit_curve(pair) {
                    continue;
                }
                if self.hops > MAX_HOPS {
                    return Err(Stuck);
                }
                continue;
            }
            let on_bound = self.is_on_bound();
            if on_bound {
                self.pi = self.window.bound_at_start();
                if !self.leaving && self.follow_bound()? {
                    continue;
                }
            }
            self.accelerate(on_bound)?;
        }
        Err(Stuck)
    }

    /// Whether the state is on the bound; in the cusp of a straight line its velocities say so.
    fn is_on_bound(&self) -> bool {
        if self.order == 0 {
            return self.pi >= self.window.bound_at_start() * (1.0 - ON_BOUND);
        }
        let near = |value: f64, limit: f64| self.straight && value >= limit * (1.0 - ON_BOUND);
        match &self.window.bound {
            Bound::Speed(f) => near(self.cusp_sq.iter().sum(), f.first()),
            Bound::Axis(k, v_sq) => near(self.cusp_sq[*k], *v_sq),
            Bound::Arc(k, w) => near(self.cusp_sq[*k], w.first() / self.window.weight.first()),
            // At rest p is free.
            Bound::Hold(_) => true,
            Bound::LimitCurve => false,
        }
    }

    fn start(&self) -> Start<M> {
        let (w, slope) = (self.window.weight.first(), self.window.weight.first_slope());
        let g = &self.window.g;
        let a = &self.axes.acceleration;
        Start {
            g: std::array::from_fn(|k| g[k].first()),
            c: std::array::from_fn(|k| g[k].first_slope()),
            e: std::array::from_fn(|k| g[k].first_bend()),
            limit: std::array::from_fn(|k| a[k] / (w * w)),
            limit_slope: std::array::from_fn(|k| -2.0 * a[k] * slope / (w * w * w)),
        }
    }

    /// Puts π under the bound, under the limits of axes that turn here, and backward on or under the limit curve.
    fn enter(&mut self, start: &Start<M>) {
        if self.order > 0 {
            return;
        }
        self.pi = self.pi.min(self.window.bound_at_start());
        for k in self.moving() {
            if start.g[k] == 0.0 && start.c[k] != 0.0 {
                self.pi = self.pi.min(start.limit[k] / start.c[k].abs());
            }
        }
        if !BACK || self.straight {
            return;
        }
        let mut lowest = f64::INFINITY;
        for j in self.moving() {
            for l in self.moving().filter(|&l| l != j) {
                let w = start.c[j] * start.g[l] - start.c[l] * start.g[j];
                if start.g[j] > 0.0 && start.g[l] > 0.0 && w > 0.0 {
                    lowest = lowest.min((start.limit[j] * start.g[l] + start.limit[l] * start.g[j]) / w);
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
            let needed = (-start.limit[l] - start.c[l] * self.pi) / start.g[l];
            if low.is_none_or(|(_, most)| needed > most) {
                low = Some((l, needed));
            }
        }
        if let Some((l, needed)) = low {
            if needed >= s - 1e-9 * (s.abs() + needed.abs()) {
                self.limit_curve = Some((j, l));
            }
        }
    }

    /// The control axis of greatest acceleration: the axis, s = π'/2, bits of the axes tied with it, and whether it
    /// turns here.
    fn least(&self, start: &Start<M>) -> Option<(usize, f64, u8, bool)> {
        let mut s = [f64::INFINITY; M];
        let mut turns = 0u8;
        for k in self.moving() {
            let rest = start.limit[k] - start.c[k] * self.pi;
            if start.g[k] > 0.0 {
                s[k] = rest / start.g[k];
            } else if start.c[k] > 0.0 && rest <= FLAT * start.limit[k] {
                s[k] = (start.limit_slope[k] - start.e[k] * self.pi) / (3.0 * start.c[k]);
                turns |= 1 << k;
            }
        }
        let turning = |k: usize| turns >> k & 1 == 1;
        let mut j = 0;
        for k in 1..M {
            if s[k] < s[j] {
                j = k;
            }
        }
        if !s[j].is_finite() {
            return None;
        }
        let least = s[j];
        let mut tied = turns;
        let mut steepest = f64::INFINITY;
        for k in self.moving().filter(|&k| s[k].is_finite()) {
            let same = if turning(k) {
                (s[k] - least).abs() <= 1e-9 * (least.abs() + s[k].abs())
            } else {
                start.limit[k] - (start.g[k] * least + start.c[k] * self.pi) <= TIE * start.limit[k]
            };
            if !same {
                continue;
            }
            tied |= 1 << k;
            // The tie goes to the axis whose acceleration would grow the most.
            let slope = if turning(k) {
                f64::INFINITY
            } else {
                (start.limit_slope[k] - 3.0 * start.c[k] * s[k] - start.e[k] * self.pi) / start.g[k]
            };
            if slope < steepest {
                (steepest, j) = (slope, k);
            }
        }
        if let Some(axis) = self.control {
            if tied >> axis & 1 == 1 || s[axis].is_finite() {
                j = axis;
            }
        }
        Some((j, s[j], tied, turning(j)))
    }

    /// The control axis from a cusp: s is infinite, the tangents' leading coefficients decide.
    fn least_from_cusp(&self) -> Option<(usize, u8)> {
        let lead = |k: usize| self.window.g[k].coefficients()[self.order];
        let ratio = |k: usize| self.axes.acceleration[k] / lead(k);
        let j = self.moving().filter(|&k| lead(k) > 0.0).min_by(|&a, &b| ratio(a).total_cmp(&ratio(b)))?;
        let tied = self
            .moving()
            .filter(|&k| k != j && lead(k) > 0.0 && ratio(k) <= ratio(j) * (1.0 + TIE))
            .fold(0u8, |bits, k| bits | 1 << k);
        Some((j, tied))
    }

    /// Along an arc of greatest acceleration to the event that ends it.
    fn accelerate(&mut self, on_bound: bool) -> Result<(), Stuck> {
        let order = self.order;
        let (j, mut tied, turns) = if order > 0 {
            let (j, tied) = self.least_from_cusp().ok_or(Stuck)?;
            (j, tied, false)
        } else {
            let (j, _, tied, turns) = self.least(&self.start()).ok_or(Stuck)?;
            (j, tied, turns)
        };
        tied = (tied | self.tied) & !(1 << j);
        let window = &self.window;
        let a = &self.axes.acceleration;
        let g = &window.g[j];
        let slow_sq = match (order, turns) {
            (0, false) => self.pi * g.first() * g.first(),
            (0, true) => 0.0,
            _ => self.cusp_sq[j],
        };
        let gain = g.antiderivative(&window.weight, self.sub.degree);
        // w = ω v_j²
        let w = window.weight.combine(slow_sq, &gain, 2.0 * a[j]);
        let (square, known) = (
            g.multiply(g),
            if order > 0 {
                3 * order
            } else if turns {
                3
            } else {
                0
            },
        );
        let mut first = 1.0;
        let mut event = None;
        let mut found = |t: Option<f64>, what: Event| {
            if let Some(t) = t.filter(|&t| t < first) {
                (first, event) = (t, Some(what));
            }
        };
        if !self.straight {
            let cube = square.multiply(g);
            let weighted = window.weight.multiply(&w);
            for l in self.moving().filter(|&l| l != j) {
                let twist = weighted.multiply(&window.g[l].wronskian(g));
                let need = window.g[l].multiply(&square).combine(a[j], &twist, 1.0);
                let size = || {
                    let twist = weighted.magnitude().multiply(&window.g[l].wronskian_magnitude(g));
                    cube.combine(a[l], &window.g[l].multiply(&square), a[j]).combine(NOISE, &twist, NOISE)
                };
                let roots = known + usize::from(tied >> l & 1 == 1);
                let above = cube.combine(a[l], &need, -1.0);
                found(kept_until(&above, size, roots, 1e-9 * a[l] * cube.first()), Event::Transition(l));
                if BACK {
                    let below = cube.combine(a[l], &need, 1.0);
                    let contact = if self.low != Some(l) {
                        0
                    } else if self.tangent {
                        2
                    } else {
                        1
                    };
                    found(kept_until(&below, size, known + contact, 0.0), Event::Low(l));
                }
            }
        }
        found(self.gap(j, &w, &square, turns, on_bound), Event::Bound);
        if first > 1.0 - AT_END && first < 1.0 {
            (first, event) = (1.0, None);
        }
        let Some(event) = event else {
            self.push(1.0, Kind::Accelerating(j), Some(&w), slow_sq);
            self.arrived();
            return Ok(());
        };
        if first * self.window.length() < NO_STEP {
            return self.hop(event, j, on_bound);
        }
        let kind = match event {
            Event::Bound => None,
            _ => Some(&w),
        };
        self.push(first, Kind::Accelerating(j), kind, slow_sq);
        self.arrived();
        match event {
            Event::Transition(l) => (self.control, self.tied) = (Some(l), 1 << j),
            Event::Low(l) => self.limit_curve = Some((j, l)),
            Event::Bound => {}
        }
        Ok(())
    }

    /// An event at the very start of an arc.
    fn hop(&mut self, event: Event, j: usize, on_bound: bool) -> Result<(), Stuck> {
        self.hops += 1;
        if self.hops > MAX_HOPS {
            return Err(Stuck);
        }
        match event {
            // Whether the two are tied shows in their accelerations.
            Event::Transition(l) => (self.control, self.tied) = (Some(l), 0),
            Event::Low(l) => {
                self.limit_curve = Some((j, l));
                self.low = None;
            }
            Event::Bound => {
                if !on_bound {
                    return Err(Stuck);
                }
                self.leaving = false;
                self.control = None;
                if self.hops > 4 {
                    return Err(Stuck);
                }
            }
        }
        Ok(())
    }

    /// After a step along an arc.
    fn arrived(&mut self) {
        (self.hops, self.control, self.tied, self.low) = (0, None, 0, None);
        (self.tangent, self.leaving) = (false, false);
    }

    /// Where the arc of axis j with w = ω v_j² rises above the bound.
    fn gap(
        &self,
        j: usize,
        w: &Polynomial<C>,
        square: &Polynomial<C>,
        turns: bool,
        on_bound: bool,
    ) -> Option<f64> {
        let window = &self.window;
        let weight = &window.weight;
        let (limit, used, mut known) = match &window.bound {
            Bound::Axis(k, v_sq) if *k == j => (weight.scale(*v_sq), *w, 0),
            Bound::Arc(k, bound) if *k == j => (*bound, *w, 0),
            Bound::Arc(k, bound) => {
                (bound.multiply(square), w.multiply(&window.g[*k].multiply(&window.g[*k])), 2)
            }
            _ => {
                let (n, d) = window.quotient()?;
                if !n.first().is_finite() {
                    return None;
                }
                let known = if matches!(window.bound, Bound::Hold(_)) { 0 } else { 2 };
                (n.multiply(&weight.multiply(square)), w.multiply(&d), known)
            }
        };
        let same = known == 0;
        known = if self.order > 0 {
            known * self.order
        } else if turns {
            known
        } else {
            0
        };
        if on_bound {
            known += if self.tangent && self.leaving && !same { 2 } else { 1 };
        }
        let gap = limit.combine(1.0, &used, -1.0);
        let size = || limit.combine(0.1 * NOISE, &used, 0.1 * NOISE);
        let slack = if on_bound && self.leaving { f64::INFINITY } else { 0.0 };
        kept_until(&gap, size, known, slack)
    }

    /// Appends an arc to t of the window and leaves the rest; without w, π at the end is that of the bound.
    fn push(&mut self, t: f64, kind: Kind, w: Option<&Polynomial<C>>, slow_sq: f64) {
        let length = self.window.length();
        let scale = length * length;
        let after = (t < 1.0).then(|| self.window.after(t));
        let x1 = after.as_ref().map_or(self.window.x1, |after| after.x0);
        // π at the end, of the sub-piece.
        let pi_end = match (w, kind) {
            (Some(w), Kind::Accelerating(j)) => {
                let (w, g, weight) = (w.value(t), self.window.g[j].value(t), self.window.weight.value(t));
                let pi = if g > 0.0 { w / (weight * g * g) } else { f64::INFINITY };
                let turn = if g > 0.0 { None } else { self.at_turn(j) };
                turn.unwrap_or(pi) * scale
            }
            _ => match &after {
                Some(after) => after.bound_at_start() * after.length().powi(2),
                None => self.window.bound_at_end(),
            },
        };
        let mut pi_start = self.pi * scale;
        if self.order > 0 {
            // The limit at a cusp.
            pi_start = match kind {
                Kind::Accelerating(j) if self.order == 1 && slow_sq == 0.0 => {
                    let lead = self.window.g[j].coefficients()[1];
                    self.axes.acceleration[j] / (lead * self.window.weight.first().powi(2)) * scale
                }
                Kind::Hold => slow_sq / self.window.weight.first().powi(4),
                _ => f64::INFINITY,
            };
        }
        self.out.push(Arc { x0: self.window.x0, x1, kind, pi: [pi_start, pi_end], slow_sq });
        self.order = 0;
        if let Some(after) = after {
            self.pi = pi_end / after.length().powi(2);
            self.window = after;
        } else {
            self.window.x0 = self.window.x1;
            self.pi = pi_end;
        }
    }

    /// π at the end of the window where axis j turns round: all others hold it there.
    fn at_turn(&self, j: usize) -> Option<f64> {
        let slope = self.window.g[j].reverse().first_slope();
        (slope != 0.0).then(|| self.axes.acceleration[j] / (slope.abs() * self.window.weight.last().powi(2)))
    }

    /// From a place on the bound: along it as far as possible; says whether that moved or led to the limit curve.
    fn follow_bound(&mut self) -> Result<bool, Stuck> {
        let (end, saturated, pair) = match &self.window.bound {
            // Any other motion under an arc of the backward pass meets it again later.
            Bound::Arc(k, w) => {
                let k = *k;
                let slow_sq = (w.last() / self.window.weight.last()).max(0.0);
                self.push(1.0, Kind::Braking(k), None, slow_sq);
                self.arrived();
                return Ok(true);
            }
            Bound::Hold(p) => {
                let p = p * self.window.length().powi(2);
                self.push(1.0, Kind::Hold, None, p);
                self.arrived();
                return Ok(true);
            }
            Bound::LimitCurve => return Ok(false),
            Bound::Speed(f) => self.slide_at_speed(f),
            Bound::Axis(k, v_sq) => self.slide_at_axis_speed(*k, *v_sq),
        };
        let moved = end * self.window.length() >= NO_STEP;
        if moved {
            self.push(end, Kind::Cap, None, 0.0);
            self.hops = 0;
            self.control = None;
            self.tied = 0;
        }
        if let Some(pair) = pair {
            self.hops += 1;
            if self.hops < 5 {
                self.limit_curve = Some(pair);
                return Ok(true);
            }
        }
        if end == 1.0 && saturated.is_none() {
            return Ok(true);
        }
        self.leaving = true;
        self.control = saturated;
        self.tangent = saturated.is_some() && moved;
        // The state is on the bound still: the arc that leaves it follows at once.
        Ok(moved && self.window.x0 >= self.window.x1)
    }

    fn slide_at_speed(&self, f: &Polynomial<C>) -> (f64, Option<usize>, Option<(usize, usize)>) {
        if self.straight && self.sub.own_speed && f.degree() == 0 {
            return (1.0, None, None);
        }
        let window = &self.window;
        let d = &window.speed;
        let constant = f.degree() == 0 && window.weight.degree() == 0 && self.sub.own_speed;
        if constant && self.bends_little(f.first()) {
            return (1.0, None, None);
        }
        let (d_slope, d_sq) = (d.derivative(), d.multiply(d));
        let f_slope = f.derivative();
        let weight_sq = window.weight.multiply(&window.weight);
        self.slide(&|l: usize| {
            let g = &window.g[l];
            let along = g.derivative().multiply(d).combine(1.0, &g.multiply(&d_slope), -0.5);
            let mut need = along.multiply(f);
            let mut size = g
                .derivative()
                .magnitude()
                .multiply(d)
                .combine(1.0, &g.multiply(&d_slope.magnitude()), 0.5)
                .multiply(&f.magnitude());
            if f.degree() > 0 {
                need = need.combine(1.0, &g.multiply(d).multiply(&f_slope), 0.5);
                size = size.combine(1.0, &g.multiply(d).multiply(&f_slope.magnitude()), 0.5);
            }
            (d_sq, weight_sq.multiply(&need), weight_sq.multiply(&size))
        })
    }

    /// Whether v²/ρ = v² |g × g'|/D^1.5 stays below the least acceleration limit.
    fn bends_little(&self, speed_sq: f64) -> bool {
        let g = &self.window.g;
        let mut twist_sq = 0.0;
        for j in 0..M {
            for k in 0..j {
                let w = g[j].wronskian(&g[k]);
                let most = (0..=w.degree()).fold(0.0_f64, |most, i| most.max(w.bernstein(i).abs()));
                twist_sq += most * most;
            }
        }
        let least = self.window.speed.range().0.max(0.0);
        let limit = self.axes.acceleration.iter().fold(f64::INFINITY, |least, &a| least.min(a));
        speed_sq * twist_sq.sqrt() <= limit * least * least.sqrt()
    }

    fn slide_at_axis_speed(&self, k: usize, v_sq: f64) -> (f64, Option<usize>, Option<(usize, usize)>) {
        let window = &self.window;
        let g = &window.g[k];
        let cube = g.multiply(g).multiply(g);
        let weight_sq = window.weight.multiply(&window.weight).scale(v_sq);
        self.slide(&|l: usize| {
            let (twist, size) = (window.g[l].wronskian(g), window.g[l].wronskian_magnitude(g));
            (cube, weight_sq.multiply(&twist), weight_sq.multiply(&size))
        })
    }

    /// How far the velocity cap can be followed: `terms` gives x, y and the size of y for each axis, whose
    /// acceleration is y/x; the axis that saturates, and the axes of the limit curve where that falls below the cap.
    fn slide(
        &self,
        terms: &dyn Fn(usize) -> (Polynomial<C>, Polynomial<C>, Polynomial<C>),
    ) -> (f64, Option<usize>, Option<(usize, usize)>) {
        let mut end = 1.0;
        let mut saturated = None;
        let mut low = false;
        if self.straight && matches!(self.window.bound, Bound::Axis(..)) {
            return (end, None, None);
        }
        for l in self.moving() {
            let (x, y, size) = terms(l);
            let a = self.axes.acceleration[l];
            let inside = x.combine(a, &y, -1.0);
            if let Some(t) = kept_until(&inside, || x.combine(NOISE * a, &size, NOISE), 0, 0.0) {
                if t < end {
                    (end, saturated) = (t, Some(l));
                }
            }
            low |= BACK && !x.combine(a, &y, 1.0).is_positive();
        }
        let mut pair = None;
        if low && !self.straight {
            let Some((n, d)) = self.window.quotient() else { return (end, saturated, pair) };
            let weight_sq = self.window.weight.multiply(&self.window.weight);
            for j in self.moving() {
                for l in self.moving().filter(|&l| l != j) {
                    let (over, under) = self.limit_quotient(j, l);
                    if under.coefficients().iter().all(|&value| value <= 0.0) {
                        continue;
                    }
                    let over = over.multiply(&d);
                    let above = over.combine(1.0, &n.multiply(&weight_sq).multiply(&under), -1.0);
                    if let Some(t) = kept_until(&above, || over.magnitude().scale(NOISE), 0, 0.0) {
                        if t < end {
                            (end, saturated, pair) = (t, None, Some((j, l)));
                        }
                    }
                }
            }
        }
        (end, saturated, pair)
    }

    /// N and W of the limit curve π = N/(ω² W) with axis j at +A and axis l at −A.
    fn limit_quotient(&self, j: usize, l: usize) -> (Polynomial<C>, Polynomial<C>) {
        let (g, a) = (&self.window.g, &self.axes.acceleration);
        (g[l].combine(a[j], &g[j], a[l]), g[j].wronskian(&g[l]))
    }

    /// Along the limit curve while no arc would leave it downward; says whether it moved.
    fn follow_limit_curve(&mut self, (j, l): (usize, usize)) -> bool {
        let window = &self.window;
        let a = &self.axes.acceleration;
        let (n, w) = self.limit_quotient(j, l);
        let (n_slope, w_slope) = (n.derivative(), w.derivative());
        let size = window.g[j].wronskian_magnitude(&window.g[l]);
        let weight = &window.weight;
        let mut first = 1.0;
        let mut event = None;
        {
            let mut leave = weight.multiply(&n.multiply(&w_slope).combine(1.0, &n_slope.multiply(&w), -3.0));
            if weight.degree() > 0 {
                leave = leave.combine(1.0, &weight.derivative().multiply(&n).multiply(&w), 2.0);
            }
            let terms = || {
                let terms = n.magnitude().multiply(&w_slope.magnitude()).combine(
                    100.0 * NOISE,
                    &n_slope.magnitude().multiply(&size),
                    300.0 * NOISE,
                );
                weight.multiply(&terms)
            };
            if let Some(t) = kept_until(&leave, terms, 0, 0.0) {
                (first, event) = (t, Some(Leave::Tangent));
            }
        }
        for i in self.moving().filter(|&i| i != j && i != l) {
            let g = &window.g[i];
            let need = g.derivative().multiply(&n).combine(1.0, &g.multiply(&n_slope), -1.0);
            let terms = || {
                let parts = g.derivative().magnitude().multiply(&n.magnitude());
                size.combine(
                    NOISE * a[i],
                    &parts.combine(1.0, &g.magnitude().multiply(&n_slope.magnitude()), 1.0),
                    NOISE,
                )
            };
            for (sign, what) in [(-1.0, Leave::Pair(i, l)), (1.0, Leave::Pair(j, i))] {
                if let Some(t) = kept_until(&w.combine(a[i], &need, sign), terms, 0, 0.0) {
                    if t < first {
                        (first, event) = (t, Some(what));
                    }
                }
            }
        }
        if let Some((bound, d)) = window.quotient() {
            if bound.first().is_finite() {
                let used = n.multiply(&d);
                let limit = bound.multiply(&weight.multiply(weight)).multiply(&w);
                let gap = limit.combine(1.0, &used, -1.0);
                let on = self.pi >= window.bound_at_start() * (1.0 - ON_BOUND);
                let slack = if on { f64::INFINITY } else { 0.0 };
                if let Some(t) = kept_until(&gap, || used.magnitude().scale(0.1 * NOISE), 0, slack) {
                    if t < first {
                        (first, event) = (t, Some(Leave::Bound));
                    }
                }
            }
        }
        if first > 1.0 - AT_END && first < 1.0 {
            (first, event) = (1.0, None);
        }
        let moved = first * self.window.length() >= NO_STEP;
        if moved {
            let scale = self.window.length().powi(2);
            let (n1, w1, weight1) = (n.value(first), w.value(first), weight.value(first));
            let mut end = if w1 > 0.0 { n1 / (weight1 * weight1 * w1) } else { f64::INFINITY } * scale;
            if first == 1.0 {
                for k in self.moving() {
                    let (g, slope) = (self.window.g[k].last(), -self.window.g[k].reverse().first_slope());
                    if g == 0.0 && slope != 0.0 {
                        end = end.min(a[k] / (slope.abs() * weight1 * weight1) * scale);
                    }
                }
            }
            self.push(first, Kind::LimitCurve, None, 0.0);
            // π at the end is that of the limit curve, or of the bound where that is met.
            if let Some(arc) = self.out.last_mut() {
                if !matches!(event, Some(Leave::Bound)) {
                    end = end.min(arc.pi[1]);
                    arc.pi[1] = end;
                    self.pi = if first == 1.0 { end } else { end / self.window.length().powi(2) };
                }
            }
            self.hops = 0;
        } else {
            self.hops += 1;
        }
        match event {
            None => {}
            Some(Leave::Tangent) => {
                (self.control, self.low) = (Some(j), Some(l));
                self.tangent = moved;
                self.leaving = false;
            }
            Some(Leave::Pair(up, low)) => {
                if self.hops <= 6 {
                    self.limit_curve = Some((up, low));
                } else {
                    (self.control, self.low) = (Some(j), Some(l));
                }
            }
            Some(Leave::Bound) => self.pi = self.window.bound_at_start(),
        }
        moved
    }
}

/// Why the limit curve is left.
#[derive(Clone, Copy)]
enum Leave {
    Tangent,
    Pair(usize, usize),
    Bound,
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
    let deflated = if known > 0 { test.deflate(known) } else { *test };
    if deflated.is_positive() {
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

/// The greatest constant p of the whole sub-piece at which no axis exceeds its acceleration or velocity: p of x, so
/// (dx/dτ)².
pub fn hold<const M: usize, const C: usize>(sub: &SubPiece<M, C>, axes: &Axes<M>) -> f64 {
    let least_weight = sub.weight.range().0;
    let mut p = f64::INFINITY;
    for k in 0..M {
        let g = &sub.g[k];
        // q'' = (g' ω − 2 g ω')/ω³
        let bend =
            g.derivative().multiply(&sub.weight).combine(1.0, &g.multiply(&sub.weight.derivative()), -2.0);
        let (low, high) = bend.range();
        let most = low.abs().max(high.abs()) / least_weight.powi(3);
        p = p.min(axes.acceleration[k] / most);
        p = p.min(axes.velocity_sq[k] / (g.range().1 / least_weight.powi(2)).powi(2));
    }
    let speed_sq = match sub.cap {
        super::split::Cap::Speed([f0, f1]) => f0.min(f1),
        super::split::Cap::Axis(..) => f64::INFINITY,
    };
    p.min(speed_sq / (sub.speed.range().1 / least_weight.powi(4)))
}
