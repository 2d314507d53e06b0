//! A feasible plan in one pass: the envelope r = w^(3/4), averaged in logarithm over local time.
//!
//! The envelope rises by K at most, so ln r rises by 1 at most per local time τ = ∫ K ds/r (see `Slopes::length`); its
//! mean over τ ± δ less δ nowhere exceeds it, and is smooth enough for the jerk.

use super::interior_point::Bound;
use super::rows::Rows;
use super::survey::Slopes;

/// Half the length of the mean, in local time.
const MEAN: f64 = 0.7;
/// w at a rest end, in parts of the greatest.
const END: f64 = 0.8;
/// The inner Bernstein coefficients of w, which are to be above 0, are within this part of w from it.
const STEEPEST: f64 = 0.9;
/// The limits may be used so far, so that no place between the collocation points breaks them.
pub const USE: f64 = 0.9;
/// A place that uses more is lowered to this.
const LOWERED: f64 = 0.8;

/// x = (w_0, w'_0, …) at the nodes under the caps of r on each interval.
pub fn smooth(nodes: &[f64], caps: &[f64], slopes: Slopes, bounds: &[Bound; 2]) -> Vec<f64> {
    let last = nodes.len() - 1;
    let mut r: Vec<f64> = (0..=last).map(|i| caps[i.saturating_sub(1)].min(caps[i.min(last - 1)])).collect();
    slopes.end(&mut r, bounds);
    slopes.limit(nodes, &mut r);
    let mean = Mean::new(nodes, &r, slopes, bounds);
    let mut x = Vec::with_capacity(2 * nodes.len());
    let mut at = [0, 0];
    for i in 0..=last {
        let tau = mean.tau[i + 1];
        let (low, high) = (mean.at(tau - MEAN, &mut at[0]), mean.at(tau + MEAN, &mut at[1]));
        let rho = (high.1 - low.1) / (2.0 * MEAN) - MEAN;
        let slope = (high.0 - low.0) / (2.0 * MEAN);
        let w = (rho * 4.0 / 3.0).exp();
        // On intervals that are long beside the ways to other speeds.
        let steepest = |h: f64| 3.0 * STEEPEST * w / h;
        let falls = if i < last { steepest(nodes[i + 1] - nodes[i]) } else { f64::INFINITY };
        let rises = if i > 0 { steepest(nodes[i] - nodes[i - 1]) } else { f64::INFINITY };
        x.extend([w, (4.0 / 3.0 * w * slope / slopes.length(r[i])).max(-falls).min(rises)]);
    }
    for (end, bound) in bounds.iter().enumerate() {
        if let Bound::Rest { ramp, greatest } = *bound {
            let (at, sign) = if end == 0 { (0, 1.0) } else { (2 * last, -1.0) };
            x[at] = x[at].min(END * greatest);
            x[at + 1] = sign * 4.0 / 3.0 * x[at] / ramp;
        }
    }
    x
}

/// ln r over local time, its integral, and both beyond the ends.
struct Mean {
    tau: Vec<f64>,
    rho: Vec<f64>,
    sum: Vec<f64>,
}

impl Mean {
    fn new(nodes: &[f64], r: &[f64], slopes: Slopes, bounds: &[Bound; 2]) -> Self {
        let last = nodes.len() - 1;
        let beyond = bounds.map(|bound| match bound {
            Bound::Rest { .. } => 2.0 * MEAN,
            Bound::Fixed { .. } => 0.0,
        });
        let (mut tau, mut rho) = (vec![-2.0 * MEAN, 0.0], vec![r[0].ln() - beyond[0], r[0].ln()]);
        let mut t = 0.0;
        for i in 1..=last {
            t += (nodes[i] - nodes[i - 1]) / slopes.length(0.5 * (r[i - 1] + r[i]));
            tau.push(t);
            rho.push(r[i].ln());
        }
        tau.push(t + 2.0 * MEAN);
        rho.push(r[last].ln() - beyond[1]);
        let mut sum = vec![0.0];
        for i in 1..tau.len() {
            sum.push(sum[i - 1] + 0.5 * (tau[i] - tau[i - 1]) * (rho[i] + rho[i - 1]));
        }
        Self { tau, rho, sum }
    }

    /// ln r and its integral at a time; `near` moves forward with the calls.
    fn at(&self, tau: f64, near: &mut usize) -> (f64, f64) {
        while *near + 2 < self.tau.len() && self.tau[*near + 1] <= tau {
            *near += 1;
        }
        let i = *near;
        let (d, width) = (tau - self.tau[i], self.tau[i + 1] - self.tau[i]);
        let slope = (self.rho[i + 1] - self.rho[i]) / width;
        (self.rho[i] + slope * d, self.sum[i] + (self.rho[i] + 0.5 * slope * d) * d)
    }
}

/// The part of its limits in w that x uses on interval n: w divided by it meets them.
pub fn used<const M: usize>(rows: &Rows<M>, x: &[f64], n: usize) -> f64 {
    let [v, a, j] = rows.utilisation(x, n);
    (v * v).max(a).max(j.cbrt().powi(2))
}

/// The factor on r that brings a place with this use down to what is allowed.
pub fn factor(used: f64) -> f64 {
    (LOWERED / used).powf(0.75)
}
