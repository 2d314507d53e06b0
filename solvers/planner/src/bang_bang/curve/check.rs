//! Protects against rounding: checks at some samples that the phases of a forward pass keep the limits of all axes.

use super::part::SubPiece;
use super::pass::{axis_distance, Law, Phase, Stuck};
use crate::bang_bang::tolerance::{EXCESS, EXCESS_NEAR_REST, SLOW};
use feedplan_geometry::polynomial::Polynomial;

/// Samples of each phase, as fractions of it.
const SAMPLES: [f64; 4] = [0.02, 0.35, 0.7, 0.98];
const DECADES: [f64; 9] = [0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9];

/// Fails if a phase exceeds a limit; the error gives the middle of the first such phase.
pub fn keeps_limits<const M: usize, const C: usize>(
    sub: &SubPiece<M, C>,
    phases: &[Phase],
) -> Result<(), Stuck> {
    // The ranges of the coefficients prove for most sub-pieces that the tangents are short nowhere, so the closer samples are not
    // needed.
    let ranges = sub.g.each_ref().map(Polynomial::range);
    let fastest = ranges.iter().fold(0.0_f64, |most, range| most.max(range.1));
    let slow_somewhere = ranges.iter().all(|range| range.0 <= SLOW * fastest);
    let slow = |x: f64| slow_somewhere && sub.g.iter().all(|g| g.value(x) <= SLOW * fastest);
    let kept = |phase: &Phase| {
        let (j, braking) = match phase.law {
            Law::Accelerating(j) => (j, false),
            Law::Braking(j) => (j, true),
            _ => return true,
        };
        let signed = if braking { -sub.limits.down[j] } else { sub.limits.up[j] };
        let at = Samples { sub, phase, j, signed, braking, slow_somewhere };
        let (slowest, other) = if braking { (phase.x1, phase.x0) } else { (phase.x0, phase.x1) };
        at.keep_limits(SAMPLES, 1.0 + EXCESS)
            && (!slow(slowest) || at.keep_limits(DECADES, 1.0 + EXCESS_NEAR_REST))
            && (!slow(other) || at.keep_limits(DECADES.map(|part| 1.0 - part), 1.0 + EXCESS_NEAR_REST))
    };
    phases.iter().find(|phase| !kept(phase)).map_or(Ok(()), |phase| Err(Stuck(0.5 * (phase.x0 + phase.x1))))
}

/// The data that all samples of a phase have in common. A sample is a fraction of the phase, counted from its slowest end.
struct Samples<'a, const M: usize, const C: usize> {
    sub: &'a SubPiece<M, C>,
    phase: &'a Phase,
    /// The control axis, and its acceleration with its sign.
    j: usize,
    signed: f64,
    braking: bool,
    slow_somewhere: bool,
}

impl<const M: usize, const C: usize> Samples<'_, M, C> {
    /// Whether every axis stays within `factor` times its limits at all samples.
    fn keep_limits<const K: usize>(&self, samples: [f64; K], factor: f64) -> bool {
        let Self { sub, phase, j, .. } = *self;
        let limits = &sub.limits;
        let span = phase.x1 - phase.x0;
        let x = samples
            .map(|sample| if self.braking { phase.x1 - sample * span } else { phase.x0 + sample * span });
        let (weight, g) = (sub.weight.values(x), sub.g[j].values(x));
        let distance = self.distances(x, &g);
        let pi: [f64; K] =
            std::array::from_fn(|i| (phase.slow_sq + 2.0 * self.signed.abs() * distance[i]) / (g[i] * g[i]));
        let scaled_pi: [f64; K] = std::array::from_fn(|i| weight[i] * weight[i] * pi[i]);
        (0..M).all(|l| {
            let other = sub.g[l].values(x);
            // `need` below is g_j times the acceleration ω² (g_l s + c_l π) of axis l, with s from the acceleration of axis j,
            // written without a difference of large terms.
            let wronskian =
                if sub.straight || l == j { [0.0; K] } else { sub.g[l].wronskian(&sub.g[j]).values(x) };
            let [up, down, most_sq] =
                [limits.up[l], limits.down[l], limits.velocity_sq[l]].map(|limit| limit * factor);
            (0..K).fold(true, |kept, i| {
                let need = self.signed * other[i] + scaled_pi[i] * wronskian[i];
                kept & (need <= up * g[i]) & (-need <= down * g[i]) & (other[i] * other[i] * pi[i] <= most_sq)
            })
        })
    }

    /// The distance [mm] that axis j travels from the slowest end of the phase to each x; `g` are its tangents there.
    fn distances<const K: usize>(&self, x: [f64; K], g: &[f64; K]) -> [f64; K] {
        let Self { sub, phase, j, .. } = *self;
        let slowest = if self.braking { phase.x1 } else { phase.x0 };
        if sub.weight.degree() == 0 && sub.g[j].degree() <= 1 {
            let start = sub.g[j].value(slowest);
            return std::array::from_fn(|i| (x[i] - slowest).abs() * 0.5 * (start + g[i]));
        }
        if self.slow_somewhere {
            // Coefficients computed for a short part keep more digits.
            return x.map(|x| axis_distance(sub, j, x.min(slowest), x.max(slowest)));
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
        let distance = along(&sub.g[j]).scale(span).antiderivative(&weight, sub.degree);
        // Computed from the rounded x, so that distance and tangent belong to the same point.
        let samples = x.map(|x| (x - slowest).abs() / span);
        let (distance, weight) = (distance.values(samples), weight.values(samples));
        std::array::from_fn(|i| distance[i] / weight[i])
    }
}
