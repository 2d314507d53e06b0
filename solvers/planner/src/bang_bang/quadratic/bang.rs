//! The phase of greatest acceleration from a state (x, p), up to the switch that ends it.
//!
//! The axis j with the least s_k = (A_k − c_k p)/g_k is the control axis. While it accelerates at A_j, the
//! acceleration of every other axis is linear in Y = (1 − (g_j0/g_j)³)/c_j, which grows along the phase: a_l = a_l0 −
//! W_jl s₀ Y (index 0: at the start). So each axis reaches +A_l (a transition: it becomes the control axis) or −A_l
//! (the limit curve) at one Y. The smallest Y ends the phase, and one cube root gives its x.
//!
//! With s > 0, control only passes to axes of greater c/g; with s < 0, to axes of smaller c/g. W orders the axes for
//! the whole sub-piece, so at most M − 1 transitions follow one another and ties cannot loop.

use super::phase::{along, Law};
use super::subpiece::{Axes, SubPiece};
use crate::bang_bang::tolerance::{FLAT, NEAR_TURN, NO_STEP};

/// How a phase ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Switch {
    EndOfPhase,
    /// This axis becomes the control axis.
    Transition(usize),
    /// Another axis reaches −A.
    LimitCurve,
}

/// A phase of greatest acceleration.
pub struct Bang {
    pub law: Law,
    pub x1: f64,
    pub p1: f64,
    pub switch: Switch,
}

/// The phase of greatest acceleration from (x, p). `control` is the axis that has just reached its limit, if any. `limit_curve`
/// tells whether the limit curve ends the phase; in the forward pass it does not, since K lies below it.
#[inline(always)]
pub fn bang<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    x: f64,
    p: f64,
    control: Option<usize>,
    limit_curve: bool,
) -> Bang {
    let (g, c) = (sub.tangent(x), &sub.c);
    let s: [f64; M] = std::array::from_fn(|k| {
        let rest = axes.acceleration[k] - c[k] * p;
        if rest.abs() > FLAT * axes.acceleration[k] {
            // With g_k = 0, s_k is infinite whatever the sign of `rest`: the axis is not the control axis.
            rest / g[k].abs()
        } else {
            0.0
        }
    });
    if p > sub.flat * (1.0 - NEAR_TURN) {
        if let Some(phase) = hold(sub, axes, x, p) {
            return phase;
        }
    }
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
    // Between tied axes, control passes on without a step, at most M times.
    let mut ties = 0;
    loop {
        if s[j] == 0.0 {
            let law = Law::Flat(j as u8);
            return Bang { law, x1: sub.length, p1: p, switch: Switch::EndOfPhase };
        }
        let law = Law::Accelerating(j as u8);
        let wronskian = sub.wronskians(j);
        let mut first_y = f64::INFINITY;
        let mut switch = Switch::EndOfPhase;
        for l in 0..M {
            let fall = wronskian[l] * s[j];
            if fall == 0.0 || (fall > 0.0 && !limit_curve) {
                continue;
            }
            let start = g[l] * s[j] + c[l] * p;
            let (y, what) = if fall < 0.0 {
                ((start - axes.acceleration[l]) / fall, Switch::Transition(l))
            } else {
                ((start + axes.acceleration[l]) / fall, Switch::LimitCurve)
            };
            if y < first_y {
                first_y = y;
                switch = what;
            }
        }
        let (g0, g1, rest) = (g[j], sub.end[j], sub.length - x);
        // Y at the end of the sub-piece, times g1³.
        if first_y * (g1 * g1 * g1) < rest * (g0 * g0 + g0 * g1 + g1 * g1) {
            let y = first_y.max(0.0);
            let cube = 1.0 - c[j] * y;
            if cube > 0.0 {
                let root = cube.cbrt();
                let step = g0 * y / (root * (1.0 + root + root * root));
                let x1 = x + step;
                let moves = step > NO_STEP * sub.length && x1 > x;
                match switch {
                    _ if moves && x1 < sub.length => {
                        return Bang { law, x1, p1: along(sub, j, axes.acceleration[j], x, p, x1), switch };
                    }
                    Switch::Transition(l) if !moves && ties < M && s[l].is_finite() => {
                        j = l;
                        ties += 1;
                        continue;
                    }
                    Switch::LimitCurve if !moves => return Bang { law, x1: x, p1: p, switch },
                    _ => {}
                }
            }
        }
        let p1 = along(sub, j, axes.acceleration[j], x, p, sub.length);
        return Bang { law, x1: sub.length, p1, switch: Switch::EndOfPhase };
    }
}

/// Keeps p constant where axis k has just turned and p is a little below A_k/|c_k|: there s would be a difference without correct
/// digits. The phase of greatest acceleration begins when g_k is great enough. Until then p is too low by less than the fraction
/// `NEAR_TURN`.
#[cold]
fn hold<const M: usize>(sub: &SubPiece<M>, axes: &Axes<M>, x: f64, p: f64) -> Option<Bang> {
    if p > sub.flat {
        return None;
    }
    let g = sub.tangent(x);
    let most = axes.greatest_scaled_tangent(&g);
    (0..M).find_map(|k| {
        let (a, c) = (axes.acceleration[k], sub.c[k]);
        let enough = 2.0 * NEAR_TURN * most * a;
        let rest = a - c * p;
        let near = g[k] < 0.5 * enough && rest > FLAT * a && rest < NEAR_TURN * a;
        near.then(|| {
            let x1 = x + (enough - g[k]) / c;
            let x1 = if x1 < sub.length { x1 } else { sub.length };
            Bang { law: Law::Flat(k as u8), x1, p1: p, switch: Switch::EndOfPhase }
        })
    })
}
