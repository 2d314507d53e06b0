//! Computes a first plan within all limits, in O(n), from the speed envelope r = w^(3/4): ln r, smoothed over local time.
//!
//! ln r rises by at most 1 per unit of the local time τ = ∫ K ds/r (see `Slopes::length`). The least value of ln r over τ ± δ
//! rises no faster. The mean of these least values over τ ± δ never exceeds ln r, equals it where ln r is constant over τ ± 2 δ,
//! and is smooth enough for the limits of jerk.

use feedplan_geometry::elementary::Elementary;
use std::collections::VecDeque;

use super::speed_envelope::Slopes;
use super::window_end::WindowEnd;

/// δ: half the width of the smoothing, in local time.
const MEAN: f64 = 0.7;
/// w at the end of a ramp, as a fraction of the greatest w allowed there.
const END: f64 = 0.8;
/// The inner Bernstein coefficients of w differ from w by at most this fraction of w, so that they stay above 0.
const STEEPEST: f64 = 0.9;
/// The greatest use of the limits of acceleration and jerk at the collocation points; it leaves room for the points between them.
/// The limit of speed is used fully, except for rounding.
pub const USE: f64 = 0.9;
const FULL: f64 = 1.0 + 1e-9;
/// The greatest use of the limits of acceleration and jerk on a refined grid, for a plan that was made with `USE` on the coarse
/// grid.
const KEPT: f64 = 0.96;
/// Relative rounding of w.
const ROUNDING: f64 = 1e-12;
/// An interval that uses more than `USE` is lowered to this use.
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
        let rho = (high.1 - low.1) / (2.0 * MEAN);
        let slope = (high.0 - low.0) / (2.0 * MEAN);
        let w = (rho * 4.0 / 3.0).exponential();
        // On long intervals the Bernstein coefficients limit the slope.
        let steepest = |h: f64| 3.0 * STEEPEST * w / h;
        let falls = if i < last { steepest(stations[i + 1] - stations[i]) } else { f64::INFINITY };
        let rises = if i > 0 { steepest(stations[i] - stations[i - 1]) } else { f64::INFINITY };
        x.extend([w, (4.0 / 3.0 * w * slope / slopes.length(r[i])).max(-falls).min(rises)]);
    }
    for (end, kind) in ends.iter().enumerate() {
        let (at, sign) = if end == 0 { (0, 1.0) } else { (2 * last, -1.0) };
        match *kind {
            WindowEnd::Rest { ramp, greatest } => {
                x[at] = x[at].min(END * greatest);
                x[at + 1] = sign * ramp.slope() * x[at];
            }
            // If the plan has the given w except for rounding, it gets exactly the given values.
            WindowEnd::Fixed { w, slope } => {
                if (x[at] / w - 1.0).abs() < ROUNDING {
                    (x[at], x[at + 1]) = (w, slope);
                }
            }
            WindowEnd::Free => {}
        }
    }
    x
}

/// The least ln r over local times up to `MEAN` away, and the integral of this least value over local time. Both are continued
/// beyond both ends.
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
            WindowEnd::Fixed { .. } | WindowEnd::Free => 0.0,
        });
        let (mut tau, mut rho) =
            (vec![-2.0 * MEAN, 0.0], vec![r[0].natural_log() - beyond[0], r[0].natural_log()]);
        let mut t = 0.0;
        for i in 1..=last {
            t += (stations[i] - stations[i - 1]) / slopes.length(0.5 * (r[i - 1] + r[i]));
            tau.push(t);
            rho.push(r[i].natural_log());
        }
        tau.push(t + 2.0 * MEAN);
        rho.push(r[last].natural_log() - beyond[1]);
        let rho = least(&tau, &rho);
        let mut sum = vec![0.0];
        for i in 1..tau.len() {
            sum.push(sum[i - 1] + 0.5 * (tau[i] - tau[i - 1]) * (rho[i] + rho[i - 1]));
        }
        Self { tau, rho, sum }
    }

    /// The least ln r and its integral at a local time; `near` is an index that moves forward from call to call.
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

/// At each point of a piecewise linear function, its least value up to `MEAN` to both sides.
fn least(tau: &[f64], rho: &[f64]) -> Vec<f64> {
    let between = |i: usize, at: f64| {
        let part = (at - tau[i]) / (tau[i + 1] - tau[i]);
        rho[i] + part * (rho[i + 1] - rho[i])
    };
    let last = tau.len() - 1;
    // Points within reach that have no lower point after them.
    let mut low: VecDeque<usize> = VecDeque::new();
    let (mut from, mut to) = (0, 0);
    (0..=last)
        .map(|i| {
            let [start, end] = [tau[i] - MEAN, tau[i] + MEAN];
            while to <= last && tau[to] <= end {
                while low.back().is_some_and(|&back| rho[back] >= rho[to]) {
                    low.pop_back();
                }
                low.push_back(to);
                to += 1;
            }
            while tau[from] < start {
                from += 1;
            }
            while low.front().is_some_and(|&front| front < from) {
                low.pop_front();
            }
            let mut value = low.front().map_or(rho[i], |&front| rho[front]);
            if from > 0 {
                value = value.min(between(from - 1, start));
            }
            if to <= last {
                value = value.min(between(to - 1, end));
            }
            value
        })
        .collect()
}

/// From the uses of the limits of speed, acceleration and jerk on an interval: w divided by this factor is within what a first
/// plan may use of them.
pub fn used([v, a, j]: [f64; 3]) -> f64 {
    (v * v / FULL).max(a.max(j.cbrt().powi(2)) / USE)
}

/// From the uses of the limits by a first plan that was made on a coarser grid: w divided by this factor uses at most `KEPT` of
/// the limits of acceleration and jerk. Infinite if the plan exceeds the limit of speed.
pub fn kept([v, a, j]: [f64; 3]) -> f64 {
    if v * v > FULL {
        f64::INFINITY
    } else {
        a.max(j.cbrt().powi(2)) / KEPT
    }
}

/// The factor on r that lowers an interval with this use to `LOWERED`.
pub fn factor(used: f64) -> f64 {
    (LOWERED / (USE * used)).power(0.75)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_value_nearby_is_that_of_a_scan() {
        // Points at uneven distances, some further apart than the smoothing reaches.
        let tau: Vec<f64> =
            (0..60).map(|i| 0.3 * i as f64 + 0.25 * (i as f64).sin() + (i / 20) as f64).collect();
        let rho: Vec<f64> = (0..60).map(|i| (1.7 * i as f64).sin()).collect();
        let value = |at: f64| {
            let i = tau.partition_point(|&tau| tau <= at).clamp(1, 59);
            rho[i - 1] + (at - tau[i - 1]) / (tau[i] - tau[i - 1]) * (rho[i] - rho[i - 1])
        };
        for (i, found) in least(&tau, &rho).into_iter().enumerate() {
            let scanned = (-2000..=2000)
                .map(|n| tau[i] + MEAN * f64::from(n) / 2000.0)
                .filter(|at| (tau[0]..=tau[59]).contains(at))
                .map(value)
                .fold(f64::INFINITY, f64::min);
            assert!(found <= scanned + 1e-12 && found > scanned - 5e-3, "{found} for {scanned} at {i}");
        }
    }
}
