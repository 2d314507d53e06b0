//! Computes how far a cap can be followed before an axis would need more than its acceleration limit.
//!
//! Along a cap every acceleration is a function of x alone:
//!
//! | cap | acceleration of axis k | stays below A_k while |
//! |---|---|---|
//! | speed v | v² L_k/D², L_k = Σ g_l W_kl (linear) | A_k D² − v² L_k ≥ 0, a quartic |
//! | axis j at V | V² W_kj/g_j³ | g_j³ ≥ V² W_kj/A_k, a pure cubic |
//! | speed with v² = f linear | (f L_k + g_k D f'/2)/D² | A_k D² − f L_k − g_k D f'/2 ≥ 0, a quartic |

use super::quotient::bernstein;
use super::subpiece::{Axes, Cap, SubPiece};
use feedplan_geometry::quadratic::dot;

/// The interval on which a cap can be followed.
pub struct Slide {
    pub end: f64,
    /// The axis that reaches its limit at the end, if any.
    pub saturated: Option<usize>,
    /// Some axis would need less than −A: the limit curve may lie below the cap.
    pub low: bool,
}

/// The interval from `a` towards `b` on which the cap can be followed. Accelerations may exceed their limits by the
/// fraction `slack`, which is rounding.
#[inline(always)]
pub fn slide<const M: usize>(sub: &SubPiece<M>, axes: &Axes<M>, a: f64, b: f64, slack: f64) -> Slide {
    match sub.cap {
        Cap::Speed([f0, f1]) if f0 == f1 => at_speed(sub, axes, a, b, f0, slack),
        Cap::Speed(_) => at_sloped_speed(sub, axes, a, b, slack),
        Cap::Axis(j, speed_sq) => at_axis_speed(sub, axes, a, b, (j, speed_sq), slack),
    }
}

#[inline(always)]
fn at_speed<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    a: f64,
    b: f64,
    speed_sq: f64,
    slack: f64,
) -> Slide {
    let d = sub.speed_form(a, b);
    let least = d[0].min(d[1]).min(d[2]).max(0.0);
    let mut found = Slide { end: b, saturated: None, low: false };
    // The magnitude of the acceleration is v²/ρ with ρ = D^1.5/|C' × C''|.
    if speed_sq * sub.cross <= axes.least * least * least.sqrt() {
        return found;
    }
    let (ga, gb) = (sub.tangent(a), sub.tangent(b));
    for k in 0..M {
        let wronskian = sub.wronskians(k);
        let (need_a, need_b) = (speed_sq * dot(&ga, &wronskian), speed_sq * dot(&gb, &wronskian));
        if need_a.abs().max(need_b.abs()) <= axes.acceleration[k] * least * least {
            continue;
        }
        let limit = axes.acceleration[k] * (1.0 + slack);
        let d_sq = bernstein(d).multiply(&bernstein(d));
        let need = bernstein([need_a, need_b]);
        found.low |= d_sq.combine(limit, &need, 1.0).coefficients().iter().any(|&value| value < 0.0);
        if let Some(t) = d_sq.combine(limit, &need, -1.0).first_root() {
            stop_at(&mut found, a + (b - a) * t, k);
        }
    }
    found
}

#[inline(always)]
fn at_axis_speed<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    a: f64,
    b: f64,
    (j, speed_sq): (usize, f64),
    slack: f64,
) -> Slide {
    let (ga, gb) = (sub.axis_tangent(j, a), sub.axis_tangent(j, b));
    let wronskian = sub.wronskians(j);
    let mut found = Slide { end: b, saturated: None, low: false };
    for k in 0..M {
        // W_kj = −W_jk.
        let needed_cube = -wronskian[k] * speed_sq * axes.inverse[k] / (1.0 + slack);
        let least = ga.min(gb);
        if needed_cube.abs() <= least * least * least {
            continue;
        }
        if needed_cube < 0.0 {
            found.low = true;
        } else if needed_cube > ga * ga * ga {
            stop_at(&mut found, a, k);
        } else {
            // g_j falls: x where it equals the cube root.
            let g = needed_cube.cbrt();
            stop_at(&mut found, (a + (b - a) * ((ga - g) / (ga - gb))).clamp(a, b), k);
        }
    }
    found
}

#[cold]
fn at_sloped_speed<const M: usize>(sub: &SubPiece<M>, axes: &Axes<M>, a: f64, b: f64, slack: f64) -> Slide {
    let (ga, gb) = (sub.tangent(a), sub.tangent(b));
    let (fa, fb) = (sub.speed_sq_of_cap(a), sub.speed_sq_of_cap(b));
    let half_slope = 0.5 * (fb - fa) / (b - a);
    let d = bernstein(sub.speed_form(a, b));
    let d_sq = d.multiply(&d);
    let mut found = Slide { end: b, saturated: None, low: false };
    for k in 0..M {
        let wronskian = sub.wronskians(k);
        let turn = bernstein([dot(&ga, &wronskian), dot(&gb, &wronskian)]).multiply(&bernstein([fa, fb]));
        let need = turn.combine(1.0, &d.multiply(&bernstein([ga[k], gb[k]])), half_slope);
        let limit = axes.acceleration[k] * (1.0 + slack);
        found.low |= d_sq.combine(limit, &need, 1.0).coefficients().iter().any(|&value| value < 0.0);
        if let Some(t) = d_sq.combine(limit, &need, -1.0).first_root() {
            stop_at(&mut found, a + (b - a) * t, k);
        }
    }
    found
}

/// Replaces the end if x is earlier.
#[inline(always)]
fn stop_at(found: &mut Slide, x: f64, axis: usize) {
    if x < found.end || (x == found.end && found.saturated.is_none()) {
        found.end = x;
        found.saturated = Some(axis);
    }
}
