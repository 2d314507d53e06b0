//! What is left of a sub-piece ahead of a pass, with the bound on it: both over x in [0, 1], the state at x = 0.

use super::part::{Cap, SubPiece};
use feedplan_geometry::polynomial::Polynomial;

/// What π stays under.
#[derive(Clone, Copy, Debug)]
pub enum Bound<const C: usize> {
    /// v² is at most this.
    Speed(Polynomial<C>),
    /// The velocity squared of an axis is at most this.
    Axis(usize, f64),
    /// Forward: a phase of the backward pass, on which axis k brakes; its velocity squared times ω.
    Phase(usize, Polynomial<C>),
    /// Forward: the backward pass follows the limit curve, which a forward phase does not reach.
    LimitCurve,
}

/// The part of a sub-piece from x0 on.
#[derive(Clone, Copy)]
pub struct Window<const M: usize, const C: usize> {
    pub g: [Polynomial<C>; M],
    pub weight: Polynomial<C>,
    pub speed: Polynomial<C>,
    pub bound: Bound<C>,
    /// π of the sub-piece on the bound at the ends of the window, where the backward pass has left it.
    pub known: [Option<f64>; 2],
    /// Its ends on the sub-piece.
    pub x0: f64,
    pub x1: f64,
}

impl<const M: usize, const C: usize> Window<M, C> {
    /// The whole sub-piece under its velocity cap.
    pub fn new(sub: &SubPiece<M, C>) -> Self {
        let bound = match sub.cap {
            Cap::Speed([f0, f1]) if f0 == f1 => Bound::Speed(Polynomial::constant(f0)),
            Cap::Speed(ends) => Bound::Speed(Polynomial::from_bernstein(ends.into_iter())),
            Cap::Feed(f) => Bound::Speed(Polynomial::constant(f)),
            Cap::Axis(k, v_sq) => Bound::Axis(k, v_sq),
        };
        Self { g: sub.g, weight: sub.weight, speed: sub.speed, bound, known: [None; 2], x0: 0.0, x1: 1.0 }
    }

    /// The length in x of the sub-piece.
    #[inline(always)]
    pub fn length(&self) -> f64 {
        self.x1 - self.x0
    }

    /// What lies between two places, of the window of a whole sub-piece under its cap.
    pub fn part(&self, x0: f64, x1: f64) -> Self {
        let length = x1 - x0;
        let bound = match &self.bound {
            Bound::Speed(f) => Bound::Speed(f.part(x0, x1)),
            bound => *bound,
        };
        Self {
            g: std::array::from_fn(|k| self.g[k].part(x0, x1).scale(length)),
            weight: self.weight.part(x0, x1),
            speed: self.speed.part(x0, x1).scale(length * length),
            bound,
            known: [None; 2],
            x0,
            x1,
        }
    }

    /// Leaves out what lies before t.
    pub fn leave_before(&mut self, t: f64) {
        let rest = 1.0 - t;
        for g in &mut self.g {
            *g = g.right(t).scale(rest);
        }
        self.weight = self.weight.right(t);
        self.speed = self.speed.right(t).scale(rest * rest);
        match &mut self.bound {
            Bound::Speed(p) | Bound::Phase(_, p) => *p = p.right(t),
            Bound::Axis(..) | Bound::LimitCurve => {}
        }
        self.known[0] = None;
        self.x0 += t * self.length();
    }

    /// The greatest π at the start, infinite for no limit.
    pub fn bound_at_start(&self) -> f64 {
        if let Some(pi) = self.known[0] {
            return pi / self.length().powi(2);
        }
        let (n, d) = match &self.bound {
            Bound::Speed(f) => (f.first(), self.speed.first()),
            Bound::Axis(k, v_sq) => (*v_sq, self.g[*k].first().powi(2)),
            Bound::Phase(k, w) => (w.first(), self.weight.first() * self.g[*k].first().powi(2)),
            Bound::LimitCurve => return f64::INFINITY,
        };
        if d > 0.0 {
            n / d
        } else {
            f64::INFINITY
        }
    }

    /// The greatest π at the end, of the sub-piece.
    pub fn bound_at_end(&self) -> f64 {
        self.known[1].unwrap_or_else(|| match self.quotient() {
            Some((n, d)) if d.last() > 0.0 => n.last() / d.last() * self.length().powi(2),
            _ => f64::INFINITY,
        })
    }

    /// The bound as a quotient of polynomials, π ≤ n/d.
    pub fn quotient(&self) -> Option<(Polynomial<C>, Polynomial<C>)> {
        match &self.bound {
            Bound::Speed(f) => Some((*f, self.speed)),
            Bound::Axis(k, v_sq) => Some((Polynomial::constant(*v_sq), self.g[*k].multiply(&self.g[*k]))),
            Bound::Phase(k, w) => Some((*w, self.weight.multiply(&self.g[*k].multiply(&self.g[*k])))),
            Bound::LimitCurve => None,
        }
    }
}
