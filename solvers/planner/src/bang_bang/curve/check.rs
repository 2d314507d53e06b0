//! A guard against rounding: whether the phases of a forward pass keep the limits of all axes at some places.

use super::part::SubPiece;
use super::pass::{distance, Kind, Phase, Stuck};
use crate::bang_bang::tolerance::{EXCESS, EXCESS_NEAR, SLOW};
use feedplan_geometry::polynomial::Polynomial;

/// Places that are looked at on each phase.
const PLACES: [f64; 4] = [0.02, 0.35, 0.7, 0.98];
const DECADES: [f64; 9] = [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Whether every axis keeps its limits at some places of the phases, else where it does not: a guard against rounding.
pub fn keeps_limits<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    phases: &[Phase],
) -> Result<(), Stuck> {
    // A test of the coefficients spares most sub-pieces that of places.
    let ranges = sub.g.each_ref().map(Polynomial::range);
    let fastest = ranges.iter().fold(0.0_f64, |most, range| most.max(range.1));
    let slow_somewhere = ranges.iter().all(|range| range.0 <= SLOW * fastest);
    let slow = |x: f64| slow_somewhere && sub.g.iter().all(|g| g.value(x) <= SLOW * fastest);
    let kept = |phase: &Phase| {
        let (j, braking) = match phase.kind {
            Kind::Accelerating(j) => (j, false),
            Kind::Braking(j) => (j, true),
            _ => return true,
        };
        let signed = if braking { -sub.limits.down[j] } else { sub.limits.up[j] };
        let at = Places { sub, phase, j, signed, braking, slow_somewhere };
        let (slowest, other) = if braking { (phase.x1, phase.x0) } else { (phase.x0, phase.x1) };
        at.keep_limits(PLACES, 1.0 + EXCESS)
            && (!slow(slowest) || at.keep_limits(DECADES, 1.0 + EXCESS_NEAR))
            && (!slow(other) || at.keep_limits(DECADES.map(|part| 1.0 - part), 1.0 + EXCESS_NEAR))
    };
    phases.iter().find(|phase| !kept(phase)).map_or(Ok(()), |phase| Err(Stuck(0.5 * (phase.x0 + phase.x1))))
}

/// What the places of a phase share; they are counted from where it is slowest.
struct Places<'a, const M: usize, const C: usize> {
    sub: &'a SubPiece<M, C>,
    phase: &'a Phase,
    /// The axis at its limit, which the phase has with this sign.
    j: usize,
    signed: f64,
    braking: bool,
    slow_somewhere: bool,
}

impl<const M: usize, const C: usize> Places<'_, M, C> {
    /// Whether each axis keeps its limits, but for a factor.
    fn keep_limits<const K: usize>(&self, places: [f64; K], factor: f64) -> bool {
        let Self { sub, phase, j, .. } = *self;
        let limits = &sub.limits;
        let span = phase.x1 - phase.x0;
        let x =
            places.map(|place| if self.braking { phase.x1 - place * span } else { phase.x0 + place * span });
        let (weight, g) = (sub.weight.values(x), sub.g[j].values(x));
        let way = self.ways(x, &g);
        let pi: [f64; K] =
            std::array::from_fn(|i| (phase.slow_sq + 2.0 * self.signed.abs() * way[i]) / (g[i] * g[i]));
        let bend: [f64; K] = std::array::from_fn(|i| weight[i] * weight[i] * pi[i]);
        (0..M).all(|l| {
            let other = sub.g[l].values(x);
            // ω² (g_l s + g_l' π) with s from axis j, without the difference of large terms.
            let twist =
                if sub.straight || l == j { [0.0; K] } else { sub.g[l].wronskian(&sub.g[j]).values(x) };
            let [up, down, most_sq] =
                [limits.up[l], limits.down[l], limits.velocity_sq[l]].map(|limit| limit * factor);
            (0..K).fold(true, |kept, i| {
                let need = self.signed * other[i] + bend[i] * twist[i];
                kept & (need <= up * g[i]) & (-need <= down * g[i]) & (other[i] * other[i] * pi[i] <= most_sq)
            })
        })
    }

    /// How far axis j goes between the slowest place of the phase and each of these, where its tangents are `g`.
    fn ways<const K: usize>(&self, x: [f64; K], g: &[f64; K]) -> [f64; K] {
        let Self { sub, phase, j, .. } = *self;
        let slowest = if self.braking { phase.x1 } else { phase.x0 };
        if sub.weight.degree() == 0 && sub.g[j].degree() <= 1 {
            let start = sub.g[j].value(slowest);
            return std::array::from_fn(|i| (x[i] - slowest).abs() * 0.5 * (start + g[i]));
        }
        if self.slow_somewhere {
            // With all the digits that coefficients of a short part keep.
            return x.map(|x| distance(sub, j, x.min(slowest), x.max(slowest)));
        }
        let along = |p: &Polynomial<C>| {
            let p = p.part(phase.x0, phase.x1);
            if self.braking {
                p.reverse()
            } else {
                p
            }
        };
        let span = phase.x1 - phase.x0;
        let weight = along(&sub.weight);
        let way = along(&sub.g[j]).scale(span).antiderivative(&weight, sub.degree);
        // Where rounding has moved x to, lest way and tangent belong to two places.
        let places = x.map(|x| (x - slowest).abs() / span);
        let (way, weight) = (way.values(places), weight.values(places));
        std::array::from_fn(|i| way[i] / weight[i])
    }
}
