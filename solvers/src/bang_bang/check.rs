//! A guard against rounding: whether the arcs of a forward pass keep the limits of all axes at some places.

use super::pass::{distance, Arc, Kind, Stuck};
use super::split::{Axes, SubPiece};
use crate::polynomial::Polynomial;

/// An arc may exceed a limit by this part …
const EXCESS: f64 = 1e-9;
/// … and by this next to a slow end, where more digits are lost.
const EXCESS_NEAR: f64 = 1e-6;
/// Next to a place where all tangents are shorter than this part of the longest one limits are looked at closely:
/// in these parts of the arc from there.
const SLOW: f64 = 1e-4;
const DECADES: [f64; 9] = [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Whether every axis keeps its limits at some places of the arcs, else where it does not: a guard against rounding.
pub fn keeps_limits<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    axes: &Axes<M>,
    arcs: &[Arc],
) -> Result<(), Stuck> {
    let fastest = sub.g.iter().fold(0.0_f64, |most, g| most.max(g.range().1));
    let slow = |x: f64| (0..M).all(|k| sub.g[k].value(x) <= SLOW * fastest);
    let kept = |arc: &Arc| {
        let decades = |x: f64| if slow(x) { &DECADES[..] } else { &[] };
        let (j, slow_at, signed) = match arc.kind {
            Kind::Accelerating(j) => (j, arc.x0, axes.acceleration[j]),
            Kind::Braking(j) => (j, arc.x1, -axes.acceleration[j]),
            _ => return true,
        };
        let twist: [Polynomial<C>; M] = std::array::from_fn(|l| {
            if sub.straight || l == j {
                Polynomial::constant(0.0)
            } else {
                sub.g[l].wronskian(&sub.g[j])
            }
        });
        let span = arc.x1 - arc.x0;
        let inside = [0.02, 0.35, 0.7, 0.98].into_iter().map(|part| arc.x0 + part * span);
        let from_start = decades(arc.x0).iter().map(|part| arc.x0 + part * span);
        let to_end = decades(arc.x1).iter().map(|part| arc.x1 - part * span);
        let near = from_start.chain(to_end).map(|x| (x, 1.0 + EXCESS_NEAR));
        inside.map(|x| (x, 1.0 + EXCESS)).chain(near).all(|(x, most)| {
            let weight = sub.weight.value(x);
            let way = if x > slow_at { distance(sub, j, slow_at, x) } else { distance(sub, j, x, slow_at) };
            let g = sub.g[j].value(x);
            let pi = (arc.slow_sq + 2.0 * axes.acceleration[j] * way) / (g * g);
            (0..M).all(|l| {
                let other = sub.g[l].value(x);
                // ω² (g_l s + g_l' π) with s from axis j, without the difference of large terms.
                let acceleration = (signed * other + weight * weight * pi * twist[l].value(x)) / g;
                acceleration.abs() <= axes.acceleration[l] * most
                    && other * other * pi <= axes.velocity_sq[l] * most
            })
        })
    };
    arcs.iter().find(|arc| !kept(arc)).map_or(Ok(()), |arc| Err(Stuck(0.5 * (arc.x0 + arc.x1))))
}
