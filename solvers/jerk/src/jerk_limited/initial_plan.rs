//! A first plan within all limits, in O(n), from the speed envelope r = w^(3/4): ln r, averaged over local time.
//!
//! ln r rises by at most 1 per unit of the local time τ = ∫ K ds/r (see `Slopes::length`). So its mean over τ ± δ, less
//! δ, exceeds ln r nowhere, and is smooth enough for the limits of jerk.

use super::constraints::Constraints;
use super::interior_point::WindowEnd;
use super::speed_envelope::Slopes;

/// δ: half the width of the mean, in local time.
const MEAN: f64 = 0.7;
/// w at the end of a ramp, as a part of the greatest.
const END: f64 = 0.8;
/// The inner Bernstein coefficients of w differ from w by at most this part, so that they stay above 0.
const STEEPEST: f64 = 0.9;
/// The greatest use of the limits at the collocation points: it leaves room for the points between.
pub const USE: f64 = 0.9;
/// An interval that uses more is lowered to this use.
const LOWERED: f64 = 0.8;

/// x = (w_0, w'_0, …) at the stations, from the caps of r on each interval.
pub fn smooth(stations: &[f64], caps: &[f64], slopes: Slopes, ends: &[WindowEnd; 2]) -> Vec<f64> {
    let last = stations.len() - 1;
    let mut r: Vec<f64> = (0..=last).map(|i| caps[i.saturating_sub(1)].min(caps[i.min(last - 1)])).collect();
    slopes.end(&mut r, ends);
    slopes.limit(stations, &mut r);
    let mean = Mean::new(stations, &r, slopes, ends);
    let mut x = Vec::with_capacity(2 * stations.len());
    let mut at = [0, 0];
    for i in 0..=last {
        let tau = mean.tau[i + 1];
        let (low, high) = (mean.at(tau - MEAN, &mut at[0]), mean.at(tau + MEAN, &mut at[1]));
        let rho = (high.1 - low.1) / (2.0 * MEAN) - MEAN;
        let slope = (high.0 - low.0) / (2.0 * MEAN);
        let w = (rho * 4.0 / 3.0).exp();
        // Long intervals limit the slope.
        let steepest = |h: f64| 3.0 * STEEPEST * w / h;
        let falls = if i < last { steepest(stations[i + 1] - stations[i]) } else { f64::INFINITY };
        let rises = if i > 0 { steepest(stations[i] - stations[i - 1]) } else { f64::INFINITY };
        x.extend([w, (4.0 / 3.0 * w * slope / slopes.length(r[i])).max(-falls).min(rises)]);
    }
    for (end, kind) in ends.iter().enumerate() {
        if let WindowEnd::Rest { ramp, greatest } = *kind {
            let (at, sign) = if end == 0 { (0, 1.0) } else { (2 * last, -1.0) };
            x[at] = x[at].min(END * greatest);
            x[at + 1] = sign * ramp.slope() * x[at];
        }
    }
    x
}

/// ln r and its integral over local time, continued beyond both ends.
struct Mean {
    tau: Vec<f64>,
    rho: Vec<f64>,
    sum: Vec<f64>,
}

impl Mean {
    fn new(stations: &[f64], r: &[f64], slopes: Slopes, ends: &[WindowEnd; 2]) -> Self {
        let last = stations.len() - 1;
        let beyond = ends.map(|kind| match kind {
            WindowEnd::Rest { .. } => 2.0 * MEAN,
            WindowEnd::Fixed { .. } => 0.0,
        });
        let (mut tau, mut rho) = (vec![-2.0 * MEAN, 0.0], vec![r[0].ln() - beyond[0], r[0].ln()]);
        let mut t = 0.0;
        for i in 1..=last {
            t += (stations[i] - stations[i - 1]) / slopes.length(0.5 * (r[i - 1] + r[i]));
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

    /// ln r and its integral at a time; `near` is an index that moves forward with the calls.
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

/// The use of the limits by x on interval n, in terms of w: w divided by it meets the limits.
pub fn used<const M: usize>(rows: &Constraints<M>, x: &[f64], n: usize) -> f64 {
    let [v, a, j] = rows.utilisation(x, n);
    (v * v).max(a).max(j.cbrt().powi(2))
}

/// The factor on r that lowers an interval with this use to `LOWERED`.
pub fn factor(used: f64) -> f64 {
    (LOWERED / used).powf(0.75)
}
