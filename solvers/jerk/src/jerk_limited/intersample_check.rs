//! The use of the limits between the collocation points of a spline w: by the path's true derivatives at 12 samples of
//! each interval, and by the peaks of polynomials through these samples.

use fearless_simd::{dispatch, Level, Simd};

use super::constraints::{Constraints, Interval};
use super::hermite::{self, combine, local, Basis};
use super::sides::Sides;
use crate::path_problem::{Geometry, Limits};
use feedplan_geometry::lanes::{Lanes, Register};

/// Samples of an interval, its ends included, in groups of four lanes.
const GROUPS: usize = 3;
const SAMPLES: usize = 4 * GROUPS;
/// Peaks are only sought where a sample uses more than this part of a limit.
const NEAR: f64 = 0.97;

const BASES: [[Basis; 3]; GROUPS] = bases();

const fn bases() -> [[Basis; 3]; GROUPS] {
    let mut out = [[[Lanes::ZERO; 4]; 3]; GROUPS];
    let mut i = 0;
    while i < SAMPLES {
        let at = hermite::at(i as f64 / (SAMPLES - 1) as f64);
        let mut d = 0;
        while d < 3 {
            let mut k = 0;
            while k < 4 {
                out[i / 4][d][k].values_mut()[i % 4] = at[d][k];
                k += 1;
            }
            d += 1;
        }
        i += 1;
    }
    out
}

/// q', q'', q''' of each axis, and 1/w_max by the speed cap, at four samples.
#[derive(Clone, Copy, Debug)]
struct Sample<const M: usize> {
    q: [[Lanes; 3]; M],
    cap: Lanes,
}

/// The limits of a window at all samples.
#[derive(Clone, Debug)]
pub struct IntersampleCheck<const M: usize> {
    velocity: Sides<M>,
    acceleration: Sides<M>,
    jerk: [f64; M],
    samples: Vec<[Sample<M>; GROUPS]>,
    /// 1/w_max at the stations on both sides of each interval.
    at_stations: Vec<[f64; 2]>,
    /// Factor by which the limits of jerk are tighter on each interval.
    jerk_factor: Vec<f64>,
}

impl<const M: usize> IntersampleCheck<M> {
    /// Without samples.
    pub fn new(limits: &Limits<M>) -> Self {
        let [velocity, acceleration] = [&limits.velocity, &limits.acceleration].map(Sides::new);
        let jerk = limits.jerk;
        Self { velocity, acceleration, jerk, samples: vec![], at_stations: vec![], jerk_factor: vec![] }
    }

    /// Samples between `stations`; speed caps at stations and factors of jerk are those of `rows`.
    pub fn sample(
        &mut self,
        geometry: &impl Geometry<M>,
        stations: &[f64],
        pieces: &[u32],
        rows: &Constraints<M>,
    ) {
        self.samples.clear();
        self.samples.reserve(pieces.len());
        for (n, interval) in rows.intervals.iter().enumerate() {
            let mut groups = [Sample { q: [[Lanes::ZERO; 3]; M], cap: Lanes::ZERO }; GROUPS];
            for i in 0..SAMPLES {
                let (sample, lane) = (&mut groups[i / 4], i % 4);
                let s = stations[n] + interval.h * (i as f64 / (SAMPLES - 1) as f64);
                let point = geometry.at(pieces[n] as usize, s);
                for k in 0..M {
                    sample.q[k][0].values_mut()[lane] = point.first[k];
                    sample.q[k][1].values_mut()[lane] = point.second[k];
                    sample.q[k][2].values_mut()[lane] = point.third[k];
                }
                sample.cap.values_mut()[lane] = 1.0 / (point.speed_cap * point.speed_cap);
            }
            self.samples.push(groups);
        }
        let at_stations = |interval: &Interval<M>| [0, 3].map(|lane| interval.speed.values()[lane]);
        self.at_stations.clear();
        self.at_stations.extend(rows.intervals.iter().map(at_stations));
        self.jerk_factor.clear();
        self.jerk_factor.extend(rows.intervals.iter().map(|interval| interval.jerk));
    }

    /// The greatest use of the limits of speed, acceleration and jerk on interval n by the spline x.
    ///
    /// Peaks are sought for each axis alone: the maximum over several axes is not smooth.
    pub fn utilisation(&self, x: &[f64], n: usize, h: f64) -> [f64; 3] {
        dispatch!(Level::new(), simd => self.utilisation_on(simd, x, n, h))
    }

    #[inline(always)]
    pub(super) fn utilisation_on<S: Simd>(&self, simd: S, x: &[f64], n: usize, h: f64) -> [f64; 3] {
        let u = local(x, n, h);
        let per_h = 1.0 / h;
        let mut cap = [0.0; SAMPLES];
        let mut axes = [[[0.0; SAMPLES]; 3]; M];
        let Self { velocity, acceleration, jerk, .. } = self;
        for (group, (sample, basis)) in self.samples[n].iter().zip(&BASES).enumerate() {
            let w = combine(simd, &basis[0], &u);
            let w1 = combine(simd, &basis[1], &u) * per_h;
            let w2 = combine(simd, &basis[2], &u) * (per_h * per_h);
            let v = w.max(Register::all(simd, 0.0)).sqrt();
            let at = 4 * group..4 * group + 4;
            cap[at.clone()].copy_from_slice(&(w * sample.cap).values());
            for k in 0..M {
                let [q1, q2, q3] = sample.q[k];
                let a = q2 * w + q1 * w1 * 0.5;
                let j = (q3 * w + q2 * w1 * 1.5 + q1 * w2 * 0.5) * v;
                axes[k][0][at.clone()].copy_from_slice(&(q1 * v * velocity.per_mean[k]).values());
                axes[k][1][at.clone()].copy_from_slice(&(a * acceleration.per_mean[k]).values());
                axes[k][2][at.clone()].copy_from_slice(&(j * (self.jerk_factor[n] / jerk[k])).values());
            }
        }
        let [from, to] = self.at_stations[n];
        let speed_sq = peak(&cap, [1.0; 2]).max(x[2 * n] * from).max(x[2 * n + 2] * to);
        let mut worst = [speed_sq.max(0.0).sqrt(), 0.0, 0.0];
        for (k, uses) in axes.iter().enumerate() {
            let per_most = [velocity.per_most[k], acceleration.per_most[k], [1.0; 2]];
            for ((worst, values), per_most) in worst.iter_mut().zip(uses).zip(per_most) {
                *worst = f64::max(*worst, peak(values, per_most));
            }
        }
        worst
    }
}

/// Number of samples in each polynomial that interpolates half-way between samples.
const STENCIL: usize = 6;
/// Weights of these samples, and the index of the first.
const HALFWAY: [([f64; STENCIL], usize); SAMPLES - 1] = halfway();

const fn halfway() -> [([f64; STENCIL], usize); SAMPLES - 1] {
    let mut out = [([0.0; STENCIL], 0); SAMPLES - 1];
    let mut i = 0;
    while i < SAMPLES - 1 {
        let centred = if i < STENCIL / 2 - 1 { 0 } else { i + 1 - STENCIL / 2 };
        let first = if centred + STENCIL > SAMPLES { SAMPLES - STENCIL } else { centred };
        let t = i as f64 + 0.5 - first as f64;
        let mut k = 0;
        while k < STENCIL {
            let (mut weight, mut other) = (1.0, 0);
            while other < STENCIL {
                if other != k {
                    weight *= (t - other as f64) / (k as f64 - other as f64);
                }
                other += 1;
            }
            out[i].0[k] = weight;
            k += 1;
        }
        out[i].1 = first;
        i += 1;
    }
    out
}

/// The greatest use of the limits by a smooth function with these values at the samples; `per_high` and `per_low` are 1
/// over the limits of positive and of negative values. Takes the values, those interpolated half-way between, and the
/// peaks of the parabolas through each three.
fn peak(f: &[f64; SAMPLES], [per_high, per_low]: [f64; 2]) -> f64 {
    let (low, high) =
        f.iter().fold((0.0f64, 0.0f64), |(low, high), &value| (low.min(value), high.max(value)));
    let greatest = (high * per_high).max(-low * per_low);
    if greatest <= NEAR {
        return greatest;
    }
    let mut fine = [0.0; 2 * SAMPLES - 1];
    for i in 0..SAMPLES {
        fine[2 * i] = f[i];
    }
    for (i, (weights, first)) in HALFWAY.iter().enumerate() {
        fine[2 * i + 1] = weights.iter().zip(&f[*first..]).map(|(weight, value)| weight * value).sum();
    }
    let mut worst = greatest;
    for i in 1..fine.len() - 1 {
        let sign = fine[i].signum();
        let bend = sign * (2.0 * fine[i] - fine[i - 1] - fine[i + 1]);
        let rise = fine[i + 1] - fine[i - 1];
        if rise.abs() < 2.0 * bend {
            let per_limit = if sign > 0.0 { per_high } else { per_low };
            worst = worst.max((fine[i].abs() + rise * rise / (8.0 * bend)) * per_limit);
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(f: impl Fn(f64) -> f64) -> [f64; SAMPLES] {
        std::array::from_fn(|i| f(i as f64 / (SAMPLES - 1) as f64))
    }

    #[test]
    fn peaks_of_polynomials_between_samples_are_found() {
        // 1 − (t − c)²/2 + (t − c)³/10 has its peak 1 at c.
        for i in 0..100 {
            let c = 0.01 * i as f64;
            let bump = values(|t| 1.0 - 0.5 * (t - c).powi(2) + 0.1 * (t - c).powi(3));
            let found = peak(&bump, [1.0; 2]);
            assert!((found - 1.0).abs() < 5e-6, "{found} for a peak at {c}");
            assert_eq!(peak(&bump.map(|value| -value), [1.0; 2]), found);
            assert_eq!(peak(&bump, [2.0, 0.5]), 2.0 * found);
            assert_eq!(
                peak(&bump.map(|value| -value), [2.0, 0.5]),
                bump.iter().fold(0.0, |a, b| b.max(a)) * 0.5
            );
        }
    }

    #[test]
    fn values_far_from_a_limit_are_taken_as_they_are() {
        assert_eq!(peak(&values(|t| 0.5 * t), [1.0; 2]), 0.5);
    }
}
