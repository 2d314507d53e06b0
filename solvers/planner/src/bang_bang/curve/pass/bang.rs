//! The phase of greatest acceleration: its control axis, and the event that ends it.

use super::{kept_until, Kind, Pass, Start, Stuck, MAX_HOPS};
use crate::bang_bang::curve::window::Bound;
use crate::bang_bang::tolerance::{AT_END, NEARLY_FLAT, NEARLY_ON_BOUND, TEST, TIE, WEAK_TIE};
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// What ends a phase.
enum Event {
    Transition(usize),
    Low(usize),
    Bound,
}

impl<const M: usize, const C: usize, const BACK: bool> Pass<'_, M, C, BACK> {
    /// The control axis of greatest acceleration: the axis, s = π'/2, bits of the axes tied with it, and whether it
    /// turns here.
    pub(super) fn least(&self, start: &Start<M>) -> Option<(usize, f64, AxisBits, bool)> {
        let (mut s, mut rests) = ([f64::INFINITY; M], [0.0; M]);
        let mut turns = 0;
        for k in 0..M {
            let rest = start.limit[k] - start.c[k] * self.pi;
            rests[k] = rest;
            if start.g[k] > 0.0 {
                s[k] = rest / start.g[k];
            } else if start.c[k] > 0.0 && rest <= WEAK_TIE * start.limit[k] {
                s[k] = (start.limit_slope[k] - self.window.g[k].first_bend() * self.pi) / (3.0 * start.c[k]);
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
        for k in (0..M).filter(|&k| s[k].is_finite()) {
            let same = if turning(k) {
                (s[k] - least).abs() <= WEAK_TIE * (least.abs() + s[k].abs())
            } else {
                rests[k] - start.g[k] * least <= TIE * start.limit[k]
            };
            if !same {
                continue;
            }
            tied |= 1 << k;
            // The tie goes to the axis whose acceleration would grow the most.
            let slope = if turning(k) {
                f64::INFINITY
            } else {
                (start.limit_slope[k] - 3.0 * start.c[k] * s[k] - self.window.g[k].first_bend() * self.pi)
                    / start.g[k]
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
    fn least_from_cusp(&self) -> Option<(usize, AxisBits)> {
        let lead = |k: usize| self.window.g[k].coefficients()[self.order];
        let ratio = |k: usize| self.sub.limits.up[k] / lead(k);
        let least = self.moving().filter(|&k| lead(k) > 0.0).map(ratio).fold(f64::INFINITY, f64::min);
        let tied = |k: usize| lead(k) > 0.0 && ratio(k) <= least * (1.0 + TIE);
        let bits = self.moving().filter(|&k| tied(k)).fold(0, |bits, k| bits | 1 << k);
        // Among tied axes an event at once tells which it is.
        let j = self.control.filter(|&k| tied(k)).or_else(|| self.moving().find(|&k| tied(k)))?;
        Some((j, bits))
    }

    /// Along a phase of greatest acceleration to the event that ends it.
    pub(super) fn accelerate(&mut self, start: &Start<M>, on_bound: bool) -> Result<(), Stuck> {
        let order = self.order;
        let (j, mut tied, turns) = if order > 0 {
            let (j, tied) = self.least_from_cusp().ok_or(self.stuck())?;
            (j, tied, false)
        } else {
            let (j, _, tied, turns) = self.least(start).ok_or(self.stuck())?;
            (j, tied, turns)
        };
        tied = (tied | self.tied) & !(1 << j);
        let window = &self.window;
        let (a, low) = (&self.sub.limits.up, &self.sub.limits.down);
        let g = &window.g[j];
        let slow_sq = match (order, turns) {
            (0, false) => self.pi * g.first() * g.first(),
            _ => 0.0,
        };
        let gain = g.antiderivative(&window.weight, self.sub.degree);
        // w = ω v_j²
        let w = window.weight.combine(slow_sq, &gain, 2.0 * a[j]);
        let known = if order > 0 {
            3 * order
        } else if turns {
            3
        } else {
            0
        };
        let mut first = 1.0;
        let mut event = None;
        let mut found = |t: Option<f64>, what: Event| {
            if let Some(t) = t.filter(|&t| t < first) {
                (first, event) = (t, Some(what));
            }
        };
        if !self.straight {
            for l in self.moving().filter(|&l| l != j) {
                let [below_limit, above_limit] = self.has_to_spare(l, j, &w);
                if below_limit && above_limit {
                    continue;
                }
                let twist = window.g[l].wronskian(g);
                let square = g.multiply(g);
                let (cube, weighted) = (square.multiply(g), window.weight.multiply(&w));
                let twist = weighted.multiply(&twist);
                let along = window.g[l].multiply(&square);
                let need = along.combine(a[j], &twist, 1.0);
                let size = |most: f64| {
                    let twist = weighted.magnitude().multiply(&window.g[l].wronskian_magnitude(g));
                    cube.combine(most, &along, a[j]).combine(TEST, &twist, TEST)
                };
                let roots = known + usize::from(tied >> l & 1 == 1);
                if !below_limit {
                    let above = cube.combine(a[l], &need, -1.0);
                    let slack = WEAK_TIE * a[l] * cube.first();
                    found(kept_until(&above, || size(a[l]), roots, slack), Event::Transition(l));
                }
                if !above_limit {
                    let below = cube.combine(low[l], &need, 1.0);
                    let contact = if self.low != Some(l) {
                        0
                    } else if self.tangent {
                        2
                    } else {
                        1
                    };
                    found(kept_until(&below, || size(low[l]), known + contact, 0.0), Event::Low(l));
                }
            }
        }
        if on_bound || !self.stays_under(j, &w) {
            found(self.gap(j, &w, turns, on_bound), Event::Bound);
        }
        if first > 1.0 - AT_END && first < 1.0 {
            (first, event) = (1.0, None);
        }
        let Some(event) = event else {
            self.push(1.0, Kind::Accelerating(j), Some(&w), slow_sq);
            self.arrived();
            return Ok(());
        };
        if !self.is_step(first) {
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

    /// Whether axis l stays below +A and above −A⁻ while axis j is at +A with w = v_j², told without a polynomial of its
    /// own; forward nothing goes below −A⁻.
    ///
    /// Axis l has the acceleration (A_j g_l + π W)/g_j with W = g_l' g_j − g_l g_j', and its slope is
    /// 3 W (A_j g_j² − w g_j')/g_j⁴ + w W'/g_j³. On a quadratic W and the bracket are constant: the ends tell. On other
    /// polynomial pieces the Bernstein coefficients enclose the terms, with the greatest π that w allows.
    fn has_to_spare(&self, l: usize, j: usize, w: &Polynomial<C>) -> [bool; 2] {
        let (a, low, window) = (&self.sub.limits.up, &self.sub.limits.down, &self.window);
        let (g, other) = (&window.g[j], &window.g[l]);
        if window.weight.degree() > 0 {
            return [false, !BACK];
        }
        if g.degree() == 1 {
            let twist = other.last() * g.first() - other.first() * g.last();
            let keeps = |g: f64, other: f64, w: f64| {
                let (cube, turn) = (g * g * g, w * twist);
                let need = a[j] * other * g * g + turn;
                [a[l] * cube >= need, !BACK || low[l] * cube >= -need]
            };
            let start = keeps(g.first(), other.first(), w.first());
            let end = keeps(g.last(), other.last(), w.last());
            return [start[0] && end[0], start[1] && end[1]];
        }
        let highest = w.last() / g.range().0.powi(2);
        if self.order > 0 || !highest.is_finite() {
            return [false, !BACK];
        }
        let (least, greatest) = other.wronskian(g).range();
        let (up, down) = (highest * greatest.max(0.0), -highest * least.min(0.0));
        [g.combine(a[l], other, -a[j]).is_above(up), !BACK || g.combine(low[l], other, a[j]).is_above(down)]
    }

    /// Whether no motion within the limits of the axes can reach the velocity cap: each axis gains no more speed on
    /// its way than its acceleration limit allows.
    pub(super) fn cap_is_far(&self) -> bool {
        let window = &self.window;
        let gain = |k: usize| 2.0 * self.sub.limits.up[k] * window.g[k].mean();
        if self.order > 0 || window.weight.degree() > 0 {
            return false;
        }
        match &window.bound {
            Bound::Speed(f) if self.sub.own_speed => {
                let most = self.pi * window.speed.first() + (0..M).map(gain).sum::<f64>();
                most < f.range().0
            }
            Bound::Axis(k, v_sq) => self.pi * window.g[*k].first().powi(2) + gain(*k) < *v_sq,
            _ => false,
        }
    }

    /// Whether the phase of axis j with w = ω v_j² stays under the bound for sure, as long as all axes keep their limits.
    fn stays_under(&self, j: usize, w: &Polynomial<C>) -> bool {
        let g = &self.window.g;
        match &self.window.bound {
            Bound::Speed(_) | Bound::Axis(..) => self.cap_is_far(),
            // No motion that keeps the limits leaves this phase downward once it has met it: the ends tell.
            Bound::Phase(k, bound) => w.last() * g[*k].last().powi(2) < bound.last() * g[j].last().powi(2),
            Bound::LimitCurve => true,
        }
    }

    /// An event at the very start of a phase.
    fn hop(&mut self, event: Event, j: usize, on_bound: bool) -> Result<(), Stuck> {
        self.hops += 1;
        if self.hops > MAX_HOPS {
            return Err(self.stuck());
        }
        match event {
            // Whether the two are tied shows in their accelerations.
            Event::Transition(l) => {
                (self.control, self.tied) = (Some(l), 0);
                // An axis that turns here cannot show it while π grows to what it allows at once.
                let g = &self.window.g[l];
                let weight = self.window.weight.first();
                let flat = self.sub.limits.up[l] / (g.first_slope() * weight * weight);
                if self.order == 0 && g.first() == 0.0 && (1.0 - NEARLY_FLAT..1.0).contains(&(self.pi / flat))
                {
                    self.pi = flat;
                }
            }
            Event::Low(l) => {
                self.limit_curve = Some((j, l));
                self.low = None;
            }
            Event::Bound => {
                if !on_bound {
                    // So near that the phase meets it at once.
                    let bound = self.window.bound_at_start();
                    if self.order > 0 || self.pi < bound * (1.0 - NEARLY_ON_BOUND) {
                        return Err(self.stuck());
                    }
                    self.pi = bound;
                }
                self.leaving = false;
                self.control = None;
                if self.hops > 4 {
                    return Err(self.stuck());
                }
            }
        }
        Ok(())
    }

    /// After a step along a phase.
    pub(super) fn arrived(&mut self) {
        (self.hops, self.control, self.tied, self.low) = (0, None, 0, None);
        (self.tangent, self.leaving) = (false, false);
    }

    /// Where the phase of axis j with w = ω v_j² rises above the bound.
    fn gap(&self, j: usize, w: &Polynomial<C>, turns: bool, on_bound: bool) -> Option<f64> {
        let window = &self.window;
        let square = || window.g[j].multiply(&window.g[j]);
        let weight = &window.weight;
        let (limit, used, mut known) = match &window.bound {
            Bound::Axis(k, v_sq) if *k == j => (weight.scale(*v_sq), *w, 0),
            Bound::Phase(k, bound) if *k == j => (*bound, *w, 0),
            Bound::Phase(k, bound) => {
                (bound.multiply(&square()), w.multiply(&window.g[*k].multiply(&window.g[*k])), 2)
            }
            _ => {
                let (n, d) = window.quotient()?;
                if !n.first().is_finite() {
                    return None;
                }
                (n.multiply(&weight.multiply(&square())), w.multiply(&d), 2)
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
        let size = || limit.combine(0.1 * TEST, &used, 0.1 * TEST);
        let slack = if on_bound && self.leaving { f64::INFINITY } else { 0.0 };
        kept_until(&gap, size, known, slack)
    }
}
