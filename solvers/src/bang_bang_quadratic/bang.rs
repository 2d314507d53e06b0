//! The arc of greatest acceleration from a point, up to the event that ends it.
//!
//! The axis j with the least s_k = (A_k − c_k p)/g_k is the control axis. While it accelerates at A_j, the
//! acceleration of every other axis is linear in Y = (1 − (g_j0/g_j)³)/c_j, which grows along the arc:
//! a_l = a_l0 − W_jl s₀ Y. So each axis meets +A_l (a transition: it takes over control) or −A_l (the limit
//! curve) at one Y, the earliest Y ends the arc, and one cube root gives its place.
//!
//! With s > 0 control only passes to axes of greater c/g, with s < 0 of smaller; W orders the axes for the whole
//! sub-piece, so that at most M − 1 transitions follow one another and ties cannot loop.

use super::arc::{along, Kind};
use super::subpiece::{Axes, SubPiece};

/// A_k − c_k p is zero below this part of A_k: the axis holds p where it is.
const FLAT: f64 = 8.0 * f64::EPSILON;
/// The same where the axis turns round. An arc begun closer below A_k/|c_k| would have no digits left in s; it
/// would gain less than this part of p.
const FLAT_AT_TURN: f64 = 1e-9;

/// How an arc ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    EndOfSubPiece,
    /// This axis takes over.
    Transition(usize),
    /// Another axis reaches −A: the velocity limit curve.
    LimitCurve,
}

/// An arc of greatest acceleration.
pub struct Bang {
    pub kind: Kind,
    pub x1: f64,
    pub p1: f64,
    pub event: Event,
}

/// The arc from (x, p). `control` is the axis that has just saturated, where one has; `limit_curve` says whether
/// the arc ends there (forward, the bound below the limit curve is met before it).
#[inline(always)]
pub fn bang<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    x: f64,
    p: f64,
    control: Option<usize>,
    limit_curve: bool,
) -> Bang {
    let (g, c) = (sub.tangent(x), &sub.bend);
    let s: [f64; M] = std::array::from_fn(|k| {
        let rest = axes.acceleration[k] - c[k] * p;
        if g[k] == 0.0 {
            if rest > FLAT_AT_TURN * axes.acceleration[k] {
                f64::INFINITY
            } else {
                0.0
            }
        } else if rest.abs() > FLAT * axes.acceleration[k] {
            rest / g[k]
        } else {
            0.0
        }
    });
    let mut j = 0;
    for k in 1..M {
        if s[k] < s[j] {
            j = k;
        }
    }
    if let Some(axis) = control {
        if g[axis] > 0.0 {
            j = axis;
        }
    }
    // A tie passes control on without moving, at most M − 1 times; then the arc is taken as it is.
    let mut ties = 0;
    loop {
        if s[j] == 0.0 {
            let kind = Kind::Flat(j as u8);
            return Bang { kind, x1: sub.length, p1: p, event: Event::EndOfSubPiece };
        }
        let kind = Kind::Accelerating(j as u8);
        let twist = sub.twists(j);
        let mut first_y = f64::INFINITY;
        let mut event = Event::EndOfSubPiece;
        for l in 0..M {
            let fall = twist[l] * s[j];
            if fall == 0.0 || (fall > 0.0 && !limit_curve) {
                continue;
            }
            let start = g[l] * s[j] + c[l] * p;
            let (y, what) = if fall < 0.0 {
                ((start - axes.acceleration[l]) / fall, Event::Transition(l))
            } else {
                ((start + axes.acceleration[l]) / fall, Event::LimitCurve)
            };
            if y < first_y {
                first_y = y;
                event = what;
            }
        }
        let (g0, g1, rest) = (g[j], sub.end[j], sub.length - x);
        // Y at the end of the sub-piece, times g1³.
        if first_y * (g1 * g1 * g1) < rest * (g0 * g0 + g0 * g1 + g1 * g1) {
            let y = first_y.max(0.0);
            let cube = 1.0 - c[j] * y;
            if cube > 0.0 {
                let root = cube.cbrt();
                let x1 = x + g0 * y / (root * (1.0 + root + root * root));
                if x1 > x && x1 < sub.length {
                    return Bang { kind, x1, p1: along(sub, j, axes.acceleration[j], x, p, x1), event };
                }
                match event {
                    Event::Transition(l) if x1 <= x && ties < M && s[l].is_finite() => {
                        j = l;
                        ties += 1;
                        continue;
                    }
                    Event::LimitCurve if x1 <= x => return Bang { kind, x1: x, p1: p, event },
                    _ => {}
                }
            }
        }
        let p1 = along(sub, j, axes.acceleration[j], x, p, sub.length);
        return Bang { kind, x1: sub.length, p1, event: Event::EndOfSubPiece };
    }
}
