//! The window of a pass: the rest of a sub-piece ahead of the pass, under one ceiling. Tangents, weight, D and the ceiling are
//! polynomials over x in [0, 1] of the window; the state of the pass is at x = 0.

use super::part::{Cap, SubPiece};
use feedplan_geometry::polynomial::Polynomial;

/// The ceiling of π.
#[derive(Clone, Copy, Debug)]
pub enum Ceiling<const C: usize> {
    /// v² is at most this [mm²/s²].
    Speed(Polynomial<C>),
    /// The velocity of this axis squared is at most this [mm²/s²].
    Axis(usize, f64),
    /// Forward: a phase of K on which this axis k brakes, with the polynomial ω v_k².
    Phase(usize, Polynomial<C>),
    /// Forward: the backward pass followed the limit curve, which no forward phase reaches.
    LimitCurve,
}

/// The window [x0, x1] of a sub-piece.
#[derive(Clone, Copy)]
pub struct Window<const M: usize, const C: usize> {
    pub g: [Polynomial<C>; M],
    pub weight: Polynomial<C>,
    pub speed: Polynomial<C>,
    pub ceiling: Ceiling<C>,
    /// π of the ceiling at both ends, with respect to x of the sub-piece, where the backward pass has computed it.
    pub known: [Option<f64>; 2],
    pub x0: f64,
    pub x1: f64,
}

impl<const M: usize, const C: usize> Window<M, C> {
    /// The whole sub-piece under its cap.
    pub fn new(sub: &SubPiece<M, C>) -> Self {
        let ceiling = match sub.cap {
            Cap::Speed([f0, f1]) if f0 == f1 => Ceiling::Speed(Polynomial::constant(f0)),
            Cap::Speed(ends) => Ceiling::Speed(Polynomial::from_bernstein(ends.into_iter())),
            Cap::Feed(f) => Ceiling::Speed(Polynomial::constant(f)),
            Cap::Axis(k, v_sq) => Ceiling::Axis(k, v_sq),
        };
        Self { g: sub.g, weight: sub.weight, speed: sub.speed, ceiling, known: [None; 2], x0: 0.0, x1: 1.0 }
    }

    /// The length of the window in x of the sub-piece.
    #[inline]
    pub fn length(&self) -> f64 {
        self.x1 - self.x0
    }

    /// The part [x0, x1] of this window, which must be a whole sub-piece under its cap.
    pub fn part(&self, x0: f64, x1: f64) -> Self {
        let length = x1 - x0;
        let ceiling = match &self.ceiling {
            Ceiling::Speed(f) => Ceiling::Speed(f.part(x0, x1)),
            ceiling => *ceiling,
        };
        Self {
            g: std::array::from_fn(|k| self.g[k].part(x0, x1).scale(length)),
            weight: self.weight.part(x0, x1),
            speed: self.speed.part(x0, x1).scale(length * length),
            ceiling,
            known: [None; 2],
            x0,
            x1,
        }
    }

    /// Moves the start of the window to t.
    pub fn leave_before(&mut self, t: f64) {
        let rest = 1.0 - t;
        for g in &mut self.g {
            *g = g.right(t).scale(rest);
        }
        self.weight = self.weight.right(t);
        self.speed = self.speed.right(t).scale(rest * rest);
        match &mut self.ceiling {
            Ceiling::Speed(p) | Ceiling::Phase(_, p) => *p = p.right(t),
            Ceiling::Axis(..) | Ceiling::LimitCurve => {}
        }
        self.known[0] = None;
        self.x0 += t * self.length();
    }

    /// π of the ceiling at the start, with respect to x of the window; infinite where there is no limit.
    pub fn ceiling_at_start(&self) -> f64 {
        if let Some(pi) = self.known[0] {
            return pi / self.length().powi(2);
        }
        let (n, d) = match &self.ceiling {
            Ceiling::Speed(f) => (f.first(), self.speed.first()),
            Ceiling::Axis(k, v_sq) => (*v_sq, self.g[*k].first().powi(2)),
            Ceiling::Phase(k, w) => (w.first(), self.weight.first() * self.g[*k].first().powi(2)),
            Ceiling::LimitCurve => return f64::INFINITY,
        };
        if d > 0.0 {
            n / d
        } else {
            f64::INFINITY
        }
    }

    /// π of the ceiling at the end, with respect to x of the sub-piece; infinite where there is no limit.
    pub fn ceiling_at_end(&self) -> f64 {
        self.known[1].unwrap_or_else(|| match self.quotient() {
            Some((n, d)) if d.last() > 0.0 => n.last() / d.last() * self.length().powi(2),
            _ => f64::INFINITY,
        })
    }

    /// Numerator n and denominator d of the ceiling π ≤ n/d; None along the limit curve.
    pub fn quotient(&self) -> Option<(Polynomial<C>, Polynomial<C>)> {
        match &self.ceiling {
            Ceiling::Speed(f) => Some((*f, self.speed)),
            Ceiling::Axis(k, v_sq) => Some((Polynomial::constant(*v_sq), self.g[*k].multiply(&self.g[*k]))),
            Ceiling::Phase(k, w) => Some((*w, self.weight.multiply(&self.g[*k].multiply(&self.g[*k])))),
            Ceiling::LimitCurve => None,
        }
    }
}
