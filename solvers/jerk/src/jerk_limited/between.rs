//! The limits between the collocation points: the truth at 12 places of each interval, and the peaks of what
//! interpolates them.

use fearless_simd::{dispatch, Level, Simd};

use super::hermite::{self, combine, local, Basis};
use super::rows::Rows;
use super::sides::Sides;
use super::{Geometry, Limits};
use crate::lanes::{Lanes, Register};

/// Places of an interval, both ends among them, in groups of four.
const GROUPS: usize = 3;
const PLACES: usize = 4 * GROUPS;
/// Values below this part of a limit are no peaks that matter.
const NEAR: f64 = 0.97;

const BASES: [[Basis; 3]; GROUPS] = bases();

const fn bases() -> [[Basis; 3]; GROUPS] {
    let mut out = [[[Lanes::ZERO; 4]; 3]; GROUPS];
    let mut i = 0;
    while i < PLACES {
        let at = hermite::at(i as f64 / (PLACES - 1) as f64);
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

/// q', q'', q''' of each axis, and one over the square of the greatest speed along the path.
#[derive(Clone, Copy, Debug)]
struct Sample<const M: usize> {
    q: [[Lanes; 3]; M],
    cap: Lanes,
}

/// The limits of a stretch at all places.
#[derive(Clone, Debug)]
pub struct Between<const M: usize> {
    velocity: Sides<M>,
    acceleration: Sides<M>,
    jerk: [f64; M],
    samples: Vec<[Sample<M>; GROUPS]>,
    /// 1/w_max at the nodes on both sides of each interval.
    at_nodes: Vec<[f64; 2]>,
    /// How much tighter the limits of jerk are on each interval.
    calm: Vec<f64>,
}

impl<const M: usize> Between<M> {
    /// Samples between `nodes`, where the greatest speeds and how tight the limits of jerk are is as in `rows`.
    pub fn sample(
        geometry: &impl Geometry<M>,
        limits: &Limits<M>,
        nodes: &[f64],
        pieces: &[u32],
        rows: &Rows<M>,
    ) -> Self {
        let mut samples = Vec::with_capacity(pieces.len());
        let mut at_nodes = Vec::with_capacity(pieces.len());
        for (n, interval) in rows.intervals.iter().enumerate() {
            let mut groups = [Sample { q: [[Lanes::ZERO; 3]; M], cap: Lanes::ZERO }; GROUPS];
            for i in 0..PLACES {
                let (sample, lane) = (&mut groups[i / 4], i % 4);
                let s = nodes[n] + interval.h * (i as f64 / (PLACES - 1) as f64);
                let place = geometry.at(pieces[n] as usize, s);
                for k in 0..M {
                    sample.q[k][0].values_mut()[lane] = place.first[k];
                    sample.q[k][1].values_mut()[lane] = place.second[k];
                    sample.q[k][2].values_mut()[lane] = place.third[k];
                }
                sample.cap.values_mut()[lane] = 1.0 / (place.speed_cap * place.speed_cap);
            }
            samples.push(groups);
            at_nodes.push([0, 3].map(|lane| interval.speed.values()[lane]));
        }
        let calm = rows.intervals.iter().map(|interval| interval.jerk).collect();
        let [velocity, acceleration] = [&limits.velocity, &limits.acceleration].map(Sides::new);
        Self { velocity, acceleration, jerk: limits.jerk, samples, at_nodes, calm }
    }

    /// The greatest uses of speed, acceleration and jerk on interval n by the spline x.
    ///
    /// Peaks are sought of each axis for itself: of several together they are no peaks of a smooth function.
    pub fn utilisation(&self, x: &[f64], n: usize, h: f64) -> [f64; 3] {
        dispatch!(Level::new(), simd => self.utilisation_on(simd, x, n, h))
    }

    #[inline(always)]
    pub(super) fn utilisation_on<S: Simd>(&self, simd: S, x: &[f64], n: usize, h: f64) -> [f64; 3] {
        let u = local(x, n, h);
        let per_h = 1.0 / h;
        let mut cap = [0.0; PLACES];
        let mut axes = [[[0.0; PLACES]; 3]; M];
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
                axes[k][2][at.clone()].copy_from_slice(&(j * (self.calm[n] / jerk[k])).values());
            }
        }
        let [from, to] = self.at_nodes[n];
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

/// Points of the polynomials that interpolate half-way between the places.
const STENCIL: usize = 6;
/// Their weights, and where they begin.
const HALFWAY: [([f64; STENCIL], usize); PLACES - 1] = halfway();

const fn halfway() -> [([f64; STENCIL], usize); PLACES - 1] {
    let mut out = [([0.0; STENCIL], 0); PLACES - 1];
    let mut i = 0;
    while i < PLACES - 1 {
        let centred = if i < STENCIL / 2 - 1 { 0 } else { i + 1 - STENCIL / 2 };
        let first = if centred + STENCIL > PLACES { PLACES - STENCIL } else { centred };
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

/// The greatest part of its limits that a smooth function with these values at the places uses, with one over the limits
/// of what is positive and of what is negative: of the values, of those interpolated half-way between, and of the
/// parabolas through each three.
fn peak(f: &[f64; PLACES], [per_high, per_low]: [f64; 2]) -> f64 {
    let (low, high) =
        f.iter().fold((0.0f64, 0.0f64), |(low, high), &value| (low.min(value), high.max(value)));
    let greatest = (high * per_high).max(-low * per_low);
    if greatest <= NEAR {
        return greatest;
    }
    let mut fine = [0.0; 2 * PLACES - 1];
    for i in 0..PLACES {
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

    fn values(f: impl Fn(f64) -> f64) -> [f64; PLACES] {
        std::array::from_fn(|i| f(i as f64 / (PLACES - 1) as f64))
    }

    #[test]
    fn peaks_of_polynomials_between_places_are_found() {
        // 1 − (t − c)²/2 + (t − c)³/10 peaks at c with 1, wherever that lies.
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
