//! How far a velocity cap can be followed before an axis would need more than its acceleration.
//!
//! Along a cap every acceleration is a function of the place alone:
//!
//! | cap | acceleration of axis k | stays below A_k while |
//! |---|---|---|
//! | speed v | v² L_k/D², L_k = Σ g_l W_kl (linear) | A_k D² − v² L_k ≥ 0, a quartic |
//! | axis j at V | V² W_kj/g_j³ | g_j³ ≥ V² W_kj/A_k, a pure cubic |
//! | chord error, p = f √D | N_k/√D, N_k = f (g_k E/2 + c_k D), E = g·c | A_k² D − N_k² ≥ 0 where N_k > 0 |

use super::subpiece::{Axes, Cap, SubPiece};
use crate::bernstein::{first_root, multiply, raise, sign_changes};
use feedplan_geometry::quadratic::dot;

/// The part of a cap that can be followed.
pub struct Slide {
    pub end: f64,
    /// The axis that saturates at the end, where one does.
    pub saturated: Option<usize>,
    /// Somewhere an axis would need less than −A: the limit curve may lie below the cap there.
    pub low: bool,
}

/// The part of the cap that can be followed from a towards b. An acceleration may exceed its limit by the part
/// `slack`, which is rounding.
#[inline(always)]
pub fn slide<const M: usize>(sub: &SubPiece<M>, axes: &Axes<M>, a: f64, b: f64, slack: f64) -> Slide {
    match sub.cap {
        Cap::SpeedSq(speed_sq) => at_speed(sub, axes, a, b, speed_sq, slack),
        Cap::AxisSq(j, speed_sq) => at_axis_speed(sub, axes, a, b, (j as usize, speed_sq), slack),
        Cap::Chord(factor) => at_chord_limit(sub, axes, a, b, factor, slack),
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
    // The whole acceleration is v²/ρ, ρ = D^1.5/|C' × C''|.
    if speed_sq * sub.twist <= axes.least * least * least.sqrt() {
        return found;
    }
    let (ga, gb) = (sub.tangent(a), sub.tangent(b));
    for k in 0..M {
        let twist = sub.twists(k);
        let (need_a, need_b) = (speed_sq * dot(&ga, &twist), speed_sq * dot(&gb, &twist));
        if need_a.abs().max(need_b.abs()) <= axes.acceleration[k] * least * least {
            continue;
        }
        let d_sq = multiply(&d, &d);
        let limit = axes.acceleration[k] * (1.0 + slack);
        let need: [f64; 5] = std::array::from_fn(|i| need_a + (need_b - need_a) * (0.25 * i as f64));
        let above: [f64; 5] = std::array::from_fn(|i| limit * d_sq[i] - need[i]);
        found.low |= (0..5).any(|i| limit * d_sq[i] + need[i] < 0.0);
        if let Some(t) = first_root(&above) {
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
    let twist = sub.twists(j);
    let mut found = Slide { end: b, saturated: None, low: false };
    for k in 0..M {
        // W_kj = −W_jk.
        let needed_cube = -twist[k] * speed_sq * axes.inverse[k] / (1.0 + slack);
        let least = ga.min(gb);
        if needed_cube.abs() <= least * least * least {
            continue;
        }
        if needed_cube < 0.0 {
            found.low = true;
        } else if needed_cube > ga * ga * ga {
            stop_at(&mut found, a, k);
        } else {
            // g_j falls: the place where it is the cube root, from the nearer end.
            let g = needed_cube.cbrt();
            stop_at(&mut found, (a + (b - a) * ((ga - g) / (ga - gb))).clamp(a, b), k);
        }
    }
    found
}

#[cold]
fn at_chord_limit<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    a: f64,
    b: f64,
    factor: f64,
    slack: f64,
) -> Slide {
    let c = &sub.bend;
    let mut found = Slide { end: b, saturated: None, low: false };
    for k in 0..M {
        let limit = axes.acceleration[k] * (1.0 + slack);
        let need = |from: f64, to: f64| -> [f64; 3] {
            let (ga, gb, d) = (sub.tangent(from), sub.tangent(to), sub.speed_form(from, to));
            let (ea, eb) = (dot(&ga, c), dot(&gb, c));
            let g_e = [ga[k] * ea, 0.5 * (ga[k] * eb + gb[k] * ea), gb[k] * eb];
            std::array::from_fn(|i| factor * (0.5 * g_e[i] + c[k] * d[i]))
        };
        // Squares lose the sign: each part has one sign of N_k.
        let mut cuts = vec![a];
        sign_changes(&need(a, b), &mut |t| cuts.push(a + (b - a) * t));
        cuts.push(b);
        for part in cuts.windows(2) {
            let (from, to) = (part[0], part[1]);
            let n = need(from, to);
            let n_sq = multiply(&n, &n);
            let d = raise(&sub.speed_form(from, to));
            let inside: [f64; 5] = std::array::from_fn(|i| limit * limit * d[i] - n_sq[i]);
            if let Some(t) = first_root(&inside) {
                if n[0] + n[1] + n[2] > 0.0 {
                    stop_at(&mut found, from + (to - from) * t, k);
                    break;
                }
                found.low = true;
            }
        }
    }
    found
}

/// Keeps the earliest end.
#[inline(always)]
fn stop_at(found: &mut Slide, x: f64, axis: usize) {
    if x < found.end || (x == found.end && found.saturated.is_none()) {
        found.end = x;
        found.saturated = Some(axis);
    }
}
