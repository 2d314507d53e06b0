//! Follows the ceiling: a phase of K to its end, or the cap while no axis needs more than its acceleration limit (tests: table of
//! `pass`).

use super::{first_failure, Law, Pass};
use crate::bang_bang::curve::part::Cap;
use crate::bang_bang::curve::window::Ceiling;
use crate::bang_bang::tolerance::TEST;
use feedplan_geometry::polynomial::Polynomial;

impl<const M: usize, const C: usize> Pass<'_, M, C> {
    /// Follows the ceiling as far as possible; returns whether the pass has moved by a step or meets the limit curve.
    pub(super) fn follow_ceiling(&mut self) -> bool {
        let (end, saturated, pair) = match &self.window.ceiling {
            // Any other motion under a phase of K meets it again later.
            Ceiling::Phase(k, w) => {
                let k = *k;
                let slow_sq = (w.last() / self.window.weight.last()).max(0.0);
                self.push(1.0, Law::Braking(k), None, slow_sq);
                self.after_step();
                return true;
            }
            Ceiling::LimitCurve => return false,
            Ceiling::Speed(f) => self.slide_at_speed(f),
            Ceiling::Axis(k, v_sq) => self.slide_at_axis_speed(*k, *v_sq),
        };
        let moved = self.is_step(end);
        if moved {
            self.push(end, Law::Cap, None, 0.0);
            self.hops = 0;
            self.control = None;
            self.tied = 0;
        }
        if let Some(pair) = pair {
            self.hops += 1;
            if self.hops < 5 {
                self.limit_curve = Some(pair);
                return true;
            }
        }
        if end == 1.0 && saturated.is_none() {
            return true;
        }
        self.leaving = true;
        self.control = saturated;
        self.tangent = saturated.is_some() && moved;
        // Without a step the state is still on the ceiling; the phase that leaves it follows.
        moved
    }

    fn slide_at_speed(&self, f: &Polynomial<C>) -> (f64, Option<usize>, Option<(usize, usize)>) {
        let even = self.sub.own_speed || matches!(self.sub.cap, Cap::Feed(_));
        if self.straight && even && f.degree() == 0 {
            return (1.0, None, None);
        }
        let window = &self.window;
        let d = &window.speed;
        let constant = f.degree() == 0 && window.weight.degree() == 0 && self.sub.own_speed;
        if constant && self.curvature_is_low(f.first()) {
            return (1.0, None, None);
        }
        let (d_slope, d_sq) = (d.derivative(), d.multiply(d));
        let f_slope = f.derivative();
        let weight_sq = window.weight.multiply(&window.weight);
        let need = |l: usize| {
            let g = &window.g[l];
            let mut need = g.derivative().multiply(d).combine(1.0, &g.multiply(&d_slope), -0.5).multiply(f);
            if f.degree() > 0 {
                need = need.combine(1.0, &g.multiply(d).multiply(&f_slope), 0.5);
            }
            weight_sq.multiply(&need)
        };
        let size = |l: usize| {
            let g = &window.g[l];
            let slope = g.derivative().magnitude();
            let mut size = slope.multiply(d).combine(1.0, &g.multiply(&d_slope.magnitude()), 0.5);
            size = size.multiply(&f.magnitude());
            if f.degree() > 0 {
                size = size.combine(1.0, &g.multiply(d).multiply(&f_slope.magnitude()), 0.5);
            }
            weight_sq.multiply(&size)
        };
        self.slide(&d_sq, &need, &size)
    }

    /// Whether v²/ρ = v² |g × c|/D^1.5, the greatest acceleration along the cap, is certainly below the least acceleration
    /// limit.
    fn curvature_is_low(&self, speed_sq: f64) -> bool {
        let g = &self.window.g;
        let mut cross_sq = 0.0;
        for j in 0..M {
            for k in 0..j {
                let w = g[j].wronskian(&g[k]);
                let most = (0..=w.degree()).fold(0.0_f64, |most, i| most.max(w.bernstein(i).abs()));
                cross_sq += most * most;
            }
        }
        let least = self.window.speed.range().0.max(0.0);
        let limits = &self.sub.limits;
        let limit = limits.up.iter().chain(&limits.down).fold(f64::INFINITY, |least, &a| least.min(a));
        speed_sq * cross_sq.sqrt() <= limit * least * least.sqrt()
    }

    fn slide_at_axis_speed(&self, k: usize, v_sq: f64) -> (f64, Option<usize>, Option<(usize, usize)>) {
        let window = &self.window;
        let g = &window.g[k];
        let cube = g.multiply(g).multiply(g);
        let weight_sq = window.weight.multiply(&window.weight).scale(v_sq);
        self.slide(&cube, &|l| weight_sq.multiply(&window.g[l].wronskian(g)), &|l| {
            weight_sq.multiply(&window.g[l].wronskian_magnitude(g))
        })
    }

    /// The t of the window up to which the cap can be followed, where axis l has the acceleration `need`(l)/x with terms of
    /// magnitude `size`(l). Also returns the axis that reaches its limit there, or the two axes of the limit curve if that falls
    /// below the cap there.
    fn slide(
        &self,
        x: &Polynomial<C>,
        need: &dyn Fn(usize) -> Polynomial<C>,
        size: &dyn Fn(usize) -> Polynomial<C>,
    ) -> (f64, Option<usize>, Option<(usize, usize)>) {
        let mut end = 1.0;
        let mut saturated = None;
        let mut low = false;
        if self.straight && matches!(self.window.ceiling, Ceiling::Axis(..)) {
            return (end, None, None);
        }
        for l in self.moving() {
            let y = need(l);
            let (a, low_limit) = (self.sub.limits.up[l], self.sub.limits.down[l]);
            let inside = x.combine(a, &y, -1.0);
            if let Some(t) = first_failure(&inside, || x.combine(TEST * a, &size(l), TEST), 0, 0.0) {
                if t < end {
                    (end, saturated) = (t, Some(l));
                }
            }
            low |= self.back && !x.combine(low_limit, &y, 1.0).is_positive();
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
                    if let Some(t) = first_failure(&above, || over.magnitude().scale(TEST), 0, 0.0) {
                        if t < end {
                            (end, saturated, pair) = (t, None, Some((j, l)));
                        }
                    }
                }
            }
        }
        (end, saturated, pair)
    }
}
