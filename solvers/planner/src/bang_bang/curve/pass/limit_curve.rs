//! Follows the limit curve, only in the backward pass: one axis is at +A, another one at −A⁻ (tests: table of `pass`).

use super::{first_failure, Earliest, Law, Pass};
use crate::bang_bang::tolerance::{ON_CEILING, TEST};
use feedplan_geometry::polynomial::Polynomial;

/// Why the limit curve is left: a tangency, another pair of axes, the ceiling.
#[derive(Clone, Copy)]
enum Leave {
    Tangent,
    Pair(usize, usize),
    Ceiling,
}

impl<const M: usize, const C: usize> Pass<'_, M, C> {
    /// N and W of the limit curve π = N/(ω² W) with axis j at +A and axis l at −A⁻.
    pub(super) fn limit_quotient(&self, j: usize, l: usize) -> (Polynomial<C>, Polynomial<C>) {
        let (g, limits) = (&self.window.g, &self.sub.limits);
        (g[l].combine(limits.up[j], &g[j], limits.down[l]), g[j].wronskian(&g[l]))
    }

    /// Follows the limit curve until a phase leaves it downward, another pair of axes limits it, or it meets the ceiling. Returns
    /// whether the pass has moved by a step.
    pub(super) fn follow_limit_curve(&mut self, (j, l): (usize, usize)) -> bool {
        let window = &self.window;
        let (up, down) = (&self.sub.limits.up, &self.sub.limits.down);
        let (n, w) = self.limit_quotient(j, l);
        let (n_slope, w_slope) = (n.derivative(), w.derivative());
        let size = window.g[j].wronskian_magnitude(&window.g[l]);
        let weight = &window.weight;
        let mut leave = weight.multiply(&n.multiply(&w_slope).combine(1.0, &n_slope.multiply(&w), -3.0));
        if weight.degree() > 0 {
            leave = leave.combine(1.0, &weight.derivative().multiply(&n).multiply(&w), 2.0);
        }
        let terms = || {
            let terms = n.magnitude().multiply(&w_slope.magnitude()).combine(
                100.0 * TEST,
                &n_slope.magnitude().multiply(&size),
                300.0 * TEST,
            );
            weight.multiply(&terms)
        };
        let tangent = first_failure(&leave, terms, 0, 0.0);
        let mut earliest = Earliest { t: tangent.unwrap_or(1.0), switch: tangent.map(|_| Leave::Tangent) };
        for i in self.moving().filter(|&i| i != j && i != l) {
            let g = &window.g[i];
            let need = g.derivative().multiply(&n).combine(1.0, &g.multiply(&n_slope), -1.0);
            let terms = |most: f64| {
                let parts = g.derivative().magnitude().multiply(&n.magnitude());
                size.combine(
                    TEST * most,
                    &parts.combine(1.0, &g.magnitude().multiply(&n_slope.magnitude()), 1.0),
                    TEST,
                )
            };
            for (most, sign, what) in [(up[i], -1.0, Leave::Pair(i, l)), (down[i], 1.0, Leave::Pair(j, i))] {
                let inside = w.combine(most, &need, sign);
                earliest.offer(first_failure(&inside, || terms(most), 0, 0.0), what);
            }
        }
        if let Some((ceiling, d)) = window.quotient().filter(|_| !self.cap_is_unreachable()) {
            if ceiling.first().is_finite() {
                let used = n.multiply(&d);
                let limit = ceiling.multiply(&weight.multiply(weight)).multiply(&w);
                let margin = limit.combine(1.0, &used, -1.0);
                let on = self.pi >= window.ceiling_at_start() * (1.0 - ON_CEILING);
                let slack = if on { f64::INFINITY } else { 0.0 };
                let size = || used.magnitude().scale(0.1 * TEST);
                earliest.offer(first_failure(&margin, size, 0, slack), Leave::Ceiling);
            }
        }
        let (first, switch) = earliest.found();
        let moved = self.is_step(first);
        if moved {
            let scale = self.window.length().powi(2);
            let (n1, w1, weight1) = (n.value(first), w.value(first), weight.value(first));
            let mut end = if w1 > 0.0 { n1 / (weight1 * weight1 * w1) } else { f64::INFINITY } * scale;
            if first == 1.0 {
                for k in self.moving() {
                    let (g, slope) = (self.window.g[k].last(), -self.window.g[k].reverse().first_slope());
                    if g == 0.0 && slope != 0.0 {
                        end = end.min(down[k] / (slope.abs() * weight1 * weight1) * scale);
                    }
                }
            }
            self.push(first, Law::LimitCurve, None, 0.0);
            // π at the end is that of the limit curve, or that of the ceiling if the pass meets it there.
            if let Some(phase) = self.out.last_mut() {
                if !matches!(switch, Some(Leave::Ceiling)) {
                    end = end.min(phase.pi[1]);
                    phase.pi[1] = end;
                    self.pi = if first == 1.0 { end } else { end / self.window.length().powi(2) };
                }
            }
            self.hops = 0;
        } else {
            self.hops += 1;
        }
        match switch {
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
            Some(Leave::Ceiling) => self.pi = self.window.ceiling_at_start(),
        }
        moved
    }
}
