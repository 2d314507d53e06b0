//! The phase of greatest acceleration in a window: its control axis, and the switch that ends it (tests: table of
//! `pass`).

use super::{first_failure, Earliest, Law, Pass, Start, Stuck, MAX_HOPS};
use crate::bang_bang::curve::window::Ceiling;
use crate::bang_bang::tolerance::{NEARLY_FLAT, NEARLY_ON_CEILING, TEST, TIE, WEAK_TIE};
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// What ends a phase: an axis at +A, an axis at −A⁻, the ceiling.
enum Switch {
    Transition(usize),
    Low(usize),
    Ceiling,
}

impl<const M: usize, const C: usize> Pass<'_, M, C> {
    /// The control axis, s = π'/2, the bits of the axes tied with it, and whether it turns here; None if no axis limits s.
    pub(super) fn control_axis(&self, start: &Start<M>) -> Option<(usize, f64, AxisBits, bool)> {
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
            // Of tied axes, the one whose s_k falls fastest becomes the control axis.
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

    /// The control axis at a cusp, from the leading coefficients of the tangents, since s is infinite.
    fn control_axis_at_cusp(&self) -> Option<(usize, AxisBits)> {
        let lead = |k: usize| self.window.g[k].coefficients()[self.order];
        let ratio = |k: usize| self.sub.limits.up[k] / lead(k);
        let least = self.moving().filter(|&k| lead(k) > 0.0).map(ratio).fold(f64::INFINITY, f64::min);
        let tied = |k: usize| lead(k) > 0.0 && ratio(k) <= least * (1.0 + TIE);
        let bits = self.moving().filter(|&k| tied(k)).fold(0, |bits, k| bits | 1 << k);
        // If this is the wrong one of the tied axes, the next switch comes without a step and passes control to the right one.
        let j = self.control.filter(|&k| tied(k)).or_else(|| self.moving().find(|&k| tied(k)))?;
        Some((j, bits))
    }

    /// Travels a phase of greatest acceleration up to the switch that ends it.
    pub(super) fn accelerate(&mut self, start: &Start<M>, on_ceiling: bool) -> Result<(), Stuck> {
        let order = self.order;
        let (j, mut tied, turns) = if order > 0 {
            let (j, tied) = self.control_axis_at_cusp().ok_or(self.stuck())?;
            (j, tied, false)
        } else {
            let (j, _, tied, turns) = self.control_axis(start).ok_or(self.stuck())?;
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
        let mut earliest = Earliest { t: 1.0, switch: None };
        if !self.straight {
            for l in self.moving().filter(|&l| l != j) {
                let [below_limit, above_limit] = self.surely_within_limits(l, j, &w);
                if below_limit && above_limit {
                    continue;
                }
                let wronskian = window.g[l].wronskian(g);
                let square = g.multiply(g);
                let (cube, weighted) = (square.multiply(g), window.weight.multiply(&w));
                let wronskian = weighted.multiply(&wronskian);
                let along = window.g[l].multiply(&square);
                let need = along.combine(a[j], &wronskian, 1.0);
                let size = |most: f64| {
                    let wronskian = weighted.magnitude().multiply(&window.g[l].wronskian_magnitude(g));
                    cube.combine(most, &along, a[j]).combine(TEST, &wronskian, TEST)
                };
                let roots = known + usize::from(tied >> l & 1 == 1);
                if !below_limit {
                    let above = cube.combine(a[l], &need, -1.0);
                    let slack = WEAK_TIE * a[l] * cube.first();
                    earliest.offer(first_failure(&above, || size(a[l]), roots, slack), Switch::Transition(l));
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
                    earliest
                        .offer(first_failure(&below, || size(low[l]), known + contact, 0.0), Switch::Low(l));
                }
            }
        }
        if on_ceiling || !self.stays_below_ceiling(j, &w) {
            earliest.offer(self.first_crossing(j, &w, turns, on_ceiling), Switch::Ceiling);
        }
        let (first, switch) = earliest.found();
        let Some(switch) = switch else {
            self.push(1.0, Law::Accelerating(j), Some(&w), slow_sq);
            self.after_step();
            return Ok(());
        };
        if !self.is_step(first) {
            return self.hop(switch, j, on_ceiling);
        }
        let law = match switch {
            Switch::Ceiling => None,
            _ => Some(&w),
        };
        self.push(first, Law::Accelerating(j), law, slow_sq);
        self.after_step();
        match switch {
            Switch::Transition(l) => (self.control, self.tied) = (Some(l), 1 << j),
            Switch::Low(l) => self.limit_curve = Some((j, l)),
            Switch::Ceiling => {}
        }
        Ok(())
    }

    /// Whether axis l certainly stays below +A_l, and whether it certainly stays above −A_l⁻, while axis j is at +A_j with w
    /// = v_j². Saves the polynomials of the tests. In the forward pass no axis falls below −A_l⁻.
    ///
    /// Axis l has the acceleration (A_j g_l + π W)/g_j with W = W_lj; its slope is 3 W (A_j g_j² − w c_j)/g_j⁴ + w
    /// W'/g_j³. On a quadratic, W and the bracket are constant, so the ends decide. On other polynomial pieces the
    /// Bernstein coefficients enclose the terms, with the greatest π that w allows.
    fn surely_within_limits(&self, l: usize, j: usize, w: &Polynomial<C>) -> [bool; 2] {
        let (a, low, window) = (&self.sub.limits.up, &self.sub.limits.down, &self.window);
        let (g, other) = (&window.g[j], &window.g[l]);
        if window.weight.degree() > 0 {
            return [false, !self.back];
        }
        if g.degree() == 1 {
            let wronskian = other.last() * g.first() - other.first() * g.last();
            let keeps = |g: f64, other: f64, w: f64| {
                let (cube, turn) = (g * g * g, w * wronskian);
                let need = a[j] * other * g * g + turn;
                [a[l] * cube >= need, !self.back || low[l] * cube >= -need]
            };
            let start = keeps(g.first(), other.first(), w.first());
            let end = keeps(g.last(), other.last(), w.last());
            return [start[0] && end[0], start[1] && end[1]];
        }
        let highest = w.last() / g.range().0.powi(2);
        if self.order > 0 || !highest.is_finite() {
            return [false, !self.back];
        }
        let (least, greatest) = other.wronskian(g).range();
        let (up, down) = (highest * greatest.max(0.0), -highest * least.min(0.0));
        [
            g.combine(a[l], other, -a[j]).is_above(up),
            !self.back || g.combine(low[l], other, a[j]).is_above(down),
        ]
    }

    /// Whether no motion within the limits can reach the cap in this window: v_k² grows by at most 2 A_k times the distance of
    /// axis k.
    pub(super) fn cap_is_unreachable(&self) -> bool {
        let window = &self.window;
        let gain = |k: usize| 2.0 * self.sub.limits.up[k] * window.g[k].mean();
        if self.order > 0 || window.weight.degree() > 0 {
            return false;
        }
        match &window.ceiling {
            Ceiling::Speed(f) if self.sub.own_speed => {
                let most = self.pi * window.speed.first() + (0..M).map(gain).sum::<f64>();
                most < f.range().0
            }
            Ceiling::Axis(k, v_sq) => self.pi * window.g[*k].first().powi(2) + gain(*k) < *v_sq,
            _ => false,
        }
    }

    /// Whether the phase of axis j with w = ω v_j² certainly stays below the ceiling while all axes keep their
    /// limits.
    fn stays_below_ceiling(&self, j: usize, w: &Polynomial<C>) -> bool {
        let g = &self.window.g;
        match &self.window.ceiling {
            Ceiling::Speed(_) | Ceiling::Axis(..) => self.cap_is_unreachable(),
            // No motion within the limits leaves a phase of K downward after meeting it, so the ends decide.
            Ceiling::Phase(k, ceiling) => {
                w.last() * g[*k].last().powi(2) < ceiling.last() * g[j].last().powi(2)
            }
            Ceiling::LimitCurve => true,
        }
    }

    /// Handles a switch at the start of a phase, without a step.
    fn hop(&mut self, switch: Switch, j: usize, on_ceiling: bool) -> Result<(), Stuck> {
        self.hops += 1;
        if self.hops > MAX_HOPS {
            return Err(self.stuck());
        }
        match switch {
            // The next phase finds out from the accelerations whether both axes are tied.
            Switch::Transition(l) => {
                (self.control, self.tied) = (Some(l), 0);
                // If axis l turns here and π would reach its limit A_l/(c_l ω²) within a step too short to count, π is set to
                // that limit.
                let g = &self.window.g[l];
                let weight = self.window.weight.first();
                let flat = self.sub.limits.up[l] / (g.first_slope() * weight * weight);
                if self.order == 0 && g.first() == 0.0 && (1.0 - NEARLY_FLAT..1.0).contains(&(self.pi / flat))
                {
                    self.pi = flat;
                }
            }
            Switch::Low(l) => {
                self.limit_curve = Some((j, l));
                self.low = None;
            }
            Switch::Ceiling => {
                if !on_ceiling {
                    // The phase meets the ceiling at its start.
                    let ceiling = self.window.ceiling_at_start();
                    if self.order > 0 || self.pi < ceiling * (1.0 - NEARLY_ON_CEILING) {
                        return Err(self.stuck());
                    }
                    self.pi = ceiling;
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

    /// Resets what the pass has stored about contacts at its current state; called after each step.
    pub(super) fn after_step(&mut self) {
        (self.hops, self.control, self.tied, self.low) = (0, None, 0, None);
        (self.tangent, self.leaving) = (false, false);
    }

    /// The first t of the window at which the phase of axis j with w = ω v_j² rises above the ceiling.
    fn first_crossing(&self, j: usize, w: &Polynomial<C>, turns: bool, on_ceiling: bool) -> Option<f64> {
        let window = &self.window;
        let square = || window.g[j].multiply(&window.g[j]);
        let weight = &window.weight;
        let (limit, used, mut known) = match &window.ceiling {
            Ceiling::Axis(k, v_sq) if *k == j => (weight.scale(*v_sq), *w, 0),
            Ceiling::Phase(k, ceiling) if *k == j => (*ceiling, *w, 0),
            Ceiling::Phase(k, ceiling) => {
                (ceiling.multiply(&square()), w.multiply(&window.g[*k].multiply(&window.g[*k])), 2)
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
        if on_ceiling {
            known += if self.tangent && self.leaving && !same { 2 } else { 1 };
        }
        let margin = limit.combine(1.0, &used, -1.0);
        let size = || limit.combine(0.1 * TEST, &used, 0.1 * TEST);
        let slack = if on_ceiling && self.leaving { f64::INFINITY } else { 0.0 };
        first_failure(&margin, size, known, slack)
    }
}
