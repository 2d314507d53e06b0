//! A part of a piece, on which no axis turns and one cap is the lowest; and the sub-piece, the part as a pass travels
//! it.

use super::piece::{weighted_speed_sq, Piece};
use crate::bang_bang::tolerance::{NARROW, NEAR_END, SAME_TURN};
use crate::problem::Both;
use crate::AxisBits;
use feedplan_geometry::polynomial::Polynomial;

/// Limits of the axes in both directions, [mm/s²] and [mm²/s²].
pub struct Axes<const M: usize> {
    pub acceleration: Both<M>,
    pub velocity_sq: Both<M>,
}

impl<const M: usize> Axes<M> {
    /// The squares of the velocity limits of axis k [mm²/s²]; only one if both are equal.
    pub fn velocities_sq(&self, k: usize) -> impl Iterator<Item = f64> + Clone + '_ {
        let count = if self.velocity_sq[0][k] == self.velocity_sq[1][k] { 1 } else { 2 };
        self.velocity_sq[..count].iter().map(move |side| side[k])
    }
}

/// The lowest cap of a sub-piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cap {
    /// v² [mm²/s²], linear in t between the ends: the feed, or a line of the chord-error limit.
    Speed([f64; 2]),
    /// The square of the feed [mm²/s²], where the axes count towards the feed with factors (`Piece::share`).
    Feed(f64),
    /// An axis, and the square of its velocity limit [mm²/s²].
    Axis(usize, f64),
}

/// A part [from, to] of a piece.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from: f64,
    pub to: f64,
    pub cap: Cap,
    pub left: End,
    pub right: End,
    /// Bit k of `negative`: axis k moves backward. Bit k of `moving`: axis k moves.
    pub negative: AxisBits,
    pub moving: AxisBits,
}

/// An end of a part.
#[derive(Clone, Copy, Debug, Default)]
pub struct End {
    /// Bit k: axis k turns there.
    pub turns: AxisBits,
    /// The tangents of all axes have a zero of this order; 0: no cusp.
    pub order: u8,
    /// Rounding may have moved the zeros this far from the end.
    pub reach: f64,
    /// The plan stops there.
    pub stops: bool,
}

impl End {
    /// Whether the tangent of axis k is 0 there.
    fn is_cut_for(&self, k: usize) -> bool {
        self.order > 0 || self.turns >> k & 1 == 1
    }
}

/// One more cut, or a stop, where a pass made no headway.
#[derive(Clone, Copy, Debug)]
pub struct Remedy {
    pub piece: usize,
    pub t: f64,
    /// All cuts within this distance become one.
    pub reach: f64,
    /// The plan stops there.
    pub stops: bool,
}

/// Limits of the axes on a sub-piece, in the direction of their motion.
#[derive(Clone, Copy, Debug)]
pub struct TravelLimits<const M: usize> {
    /// The greatest acceleration and the greatest deceleration [mm/s²].
    pub up: [f64; M],
    pub down: [f64; M],
    pub velocity_sq: [f64; M],
}

impl<const M: usize> TravelLimits<M> {
    /// The limits on a part where the axes whose bits are set in `negative` move backward.
    #[inline]
    fn new(axes: &Axes<M>, negative: AxisBits) -> Self {
        let side = |k: usize| usize::from(negative >> k & 1);
        Self {
            up: std::array::from_fn(|k| axes.acceleration[side(k)][k]),
            down: std::array::from_fn(|k| axes.acceleration[1 - side(k)][k]),
            velocity_sq: std::array::from_fn(|k| axes.velocity_sq[side(k)][k]),
        }
    }
}

/// A part as a pass travels it: polynomials over x in [0, 1], with every axis moving forward.
#[derive(Clone, Copy, Debug)]
pub struct SubPiece<const M: usize, const C: usize> {
    pub g: [Polynomial<C>; M],
    pub weight: Polynomial<C>,
    pub speed: Polynomial<C>,
    pub cap: Cap,
    pub limits: TravelLimits<M>,
    /// Bit k: axis k moves.
    pub moving: AxisBits,
    /// Degree of the curve.
    pub degree: usize,
    pub straight: bool,
    pub own_speed: bool,
    /// The order of the common zero of all tangents at the start and at the end.
    pub cusp_orders: [u8; 2],
}

impl Part {
    /// The remedy where a pass made no headway at x: a cut there, or in the middle if x is near an end, which is a
    /// cut already. The ends of a part as short as rounding become one cut.
    pub fn remedy(&self, piece: usize, x: f64) -> Remedy {
        let length = self.to - self.from;
        let narrow = length <= NARROW;
        let inside = NEAR_END < x && x < 1.0 - NEAR_END && !narrow;
        let t = self.from + length * if inside { x } else { 0.5 };
        Remedy { piece, t, reach: if narrow { length } else { 0.0 }, stops: false }
    }

    /// Limits of the axes for the forward pass.
    #[inline]
    pub fn limits<const M: usize>(&self, axes: &Axes<M>) -> TravelLimits<M> {
        TravelLimits::new(axes, self.negative)
    }

    /// The part as the forward pass travels it.
    pub fn sub_piece<const M: usize, const C: usize>(
        &self,
        piece: &Piece<M, C>,
        axes: &Axes<M>,
    ) -> SubPiece<M, C> {
        let length = self.to - self.from;
        let mut whole = length == 1.0;
        let g: [Polynomial<C>; M] = std::array::from_fn(|k| {
            if self.moving >> k & 1 == 0 {
                return Polynomial::constant(0.0).elevate(piece.g[k].degree());
            }
            let sign = if self.negative >> k & 1 == 1 { -length } else { length };
            let mut g = piece.g[k].part(self.from, self.to).scale(sign);
            let degree = g.degree();
            if !self.left.is_cut_for(k) && !self.right.is_cut_for(k) {
                return g;
            }
            for (end, at_end) in [(&self.left, false), (&self.right, true)] {
                if !end.is_cut_for(k) {
                    continue;
                }
                let turns = end.turns >> k & 1 == 1;
                let (low, high) = piece.g[k].range();
                let noise = length * piece.noise[k].max(SAME_TURN * degree as f64 * high.max(-low));
                let known = usize::from(end.order).max(usize::from(turns));
                let reach = (end.reach / length).min(1.0);
                for i in 0..=degree {
                    let index = if at_end { degree - i } else { i };
                    // A small negative coefficient comes from rounding or a neighbouring turn, and the axis would move backward:
                    // it is set to 0.
                    let back = -g.coefficients()[index] * reach.powi(i as i32);
                    if i >= known && !(turns && back > 0.0 && back <= 64.0 * noise) {
                        break;
                    }
                    g.clear(index);
                    whole = false;
                }
            }
            g
        });
        let speed = match (self.cap, &piece.share) {
            (Cap::Feed(_), Some(share)) => weighted_speed_sq(&g, share),
            // Next to a cusp, |C'|² of the whole piece has lost its digits.
            _ if piece.own_speed && !whole => Polynomial::sum_of_squares(&g),
            _ => piece.speed.part(self.from, self.to).scale(length * length),
        };
        SubPiece {
            cusp_orders: [false, true].map(|at_end| cusp_order(&g, at_end)),
            g,
            weight: piece.weight.part(self.from, self.to),
            speed,
            cap: self.cap,
            limits: self.limits(axes),
            moving: self.moving,
            degree: piece.degree,
            straight: piece.straight,
            own_speed: piece.own_speed && !matches!(self.cap, Cap::Feed(_)),
        }
    }
}

impl<const M: usize, const C: usize> SubPiece<M, C> {
    /// The order of the common zero of all tangents at an end.
    #[inline]
    pub fn cusp_order(&self, at_end: bool) -> usize {
        usize::from(self.cusp_orders[usize::from(at_end)])
    }

    /// The sum of the squared axis velocities, divided by π, at an end.
    pub fn rate_sq(&self, at_end: bool) -> f64 {
        let end = |p: &Polynomial<C>| if at_end { p.last() } else { p.first() };
        if self.own_speed {
            end(&self.speed)
        } else {
            self.g.iter().map(|g| end(g) * end(g)).sum()
        }
    }

    /// v² of the tip divided by the sum of the squared axis velocities at an end; the limit of this quotient where both are 0.
    pub fn tip_share(&self, at_end: bool) -> f64 {
        if self.own_speed || matches!(self.cap, Cap::Feed(_)) {
            return 1.0;
        }
        let lead = |p: &Polynomial<C>, r: usize| {
            let c = p.coefficients();
            c.get(if at_end { c.len().wrapping_sub(1 + r) } else { r }).copied().unwrap_or(0.0)
        };
        let order = self.cusp_order(at_end);
        let axes: f64 = self.g.iter().map(|g| lead(g, order).powi(2)).sum();
        (lead(&self.speed, 2 * order) / axes).max(0.0)
    }

    /// The sub-piece as the backward pass travels it.
    pub fn reversed(&self) -> Self {
        let cap = match self.cap {
            Cap::Speed([f0, f1]) => Cap::Speed([f1, f0]),
            cap => cap,
        };
        Self {
            g: std::array::from_fn(|k| self.g[k].reverse()),
            weight: self.weight.reverse(),
            speed: self.speed.reverse(),
            cap,
            limits: TravelLimits { up: self.limits.down, down: self.limits.up, ..self.limits },
            cusp_orders: [self.cusp_orders[1], self.cusp_orders[0]],
            ..*self
        }
    }
}

/// The order of the common zero of these polynomials at an end.
fn cusp_order<const M: usize, const C: usize>(g: &[Polynomial<C>; M], at_end: bool) -> u8 {
    let degree = g[0].degree();
    let rests = |r: usize| g.iter().all(|g| g.coefficients()[if at_end { degree - r } else { r }] == 0.0);
    (0..degree).take_while(|&r| rests(r)).count() as u8
}
