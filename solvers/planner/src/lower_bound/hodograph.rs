//! Computes the hodograph of a piece with proven error bounds, from the control points and weights: tangents, their slopes and
//! the distances of the axes.

use feedplan_geometry::polynomial::{binomial, Polynomial};

/// The numerator of C' of a rational piece has degree 2 d − 2, d ≤ 9.
type Numerator = Polynomial<20>;

/// C' = g/ω² over t in [0, 1]; ω = 1 on polynomial pieces. `C` and `R` are the capacities for the Bernstein coefficients of g
/// and ω; R = 0 for polynomial pieces only.
#[derive(Clone)]
pub struct Hodograph<const M: usize, const C: usize, const R: usize> {
    /// Degree of g.
    pub degree: usize,
    g: [[f64; M]; C],
    /// The greatest |coefficient| of g_k.
    pub size: [f64; M],
    /// Error bound of every computed g_k.
    pub noise: [f64; M],
    /// Coefficients of ω, and of ω (C − C(0)); count = 0 for a polynomial piece.
    count: usize,
    weight: [f64; R],
    point: [[f64; M]; R],
    /// Error bound of every computed q_k.
    point_noise: [f64; M],
    /// The least and the greatest weight.
    weights: [f64; 2],
}

/// A point of a piece.
#[derive(Clone, Copy)]
pub struct Station<const M: usize> {
    pub t: f64,
    pub g: [f64; M],
    /// c = g'.
    pub c: [f64; M],
    /// v_k² = `rate[k]`² x. Usually x is π and the rate g. At an exact cusp at an end of the piece, x is π d^(2 order), where
    /// d is the distance in t from the cusp, and the rate is the leading coefficient of g.
    pub rate: [f64; M],
    pub order: usize,
    /// ω², rounded down.
    pub weight_sq: f64,
    /// q − q(0); only for rational pieces.
    q: [f64; M],
}

/// Distances [mm] of each axis between two stations: `least` is a lower bound of the distance between its positions there, `most`
/// an upper bound of the distance that it travels back and forth.
pub struct Distances<const M: usize> {
    pub least: [f64; M],
    pub most: [f64; M],
    /// 0 if the axis moves forward from one to the other, 1 if backward.
    pub side: [usize; M],
}

impl<const M: usize, const C: usize, const R: usize> Hodograph<M, C, R> {
    /// From control points and weights (all equal, or empty: polynomial).
    #[inline]
    pub fn new(control: &[[f64; M]], weights: &[f64]) -> Self {
        let d = control.len() - 1;
        let mut this = Self {
            degree: d - 1,
            g: [[0.0; M]; C],
            size: [0.0; M],
            noise: [0.0; M],
            count: 0,
            weight: [0.0; R],
            point: [[0.0; M]; R],
            point_noise: [0.0; M],
            weights: [1.0; 2],
        };
        if R > 0 && weights.iter().any(|&weight| weight != weights[0]) {
            this.rational(control, weights);
            return this;
        }
        for i in 0..d {
            for k in 0..M {
                this.g[i][k] = d as f64 * (control[i + 1][k] - control[i][k]);
                this.size[k] = this.size[k].max(this.g[i][k].abs());
            }
        }
        let share = (8 * this.degree + 4) as f64 * f64::EPSILON;
        this.noise = this.size.map(|size| share * size);
        this
    }

    fn rational(&mut self, control: &[[f64; M]], weights: &[f64]) {
        let d = control.len() - 1;
        (self.degree, self.count) = (2 * d - 2, d + 1);
        for i in 0..=d {
            self.weight[i] = weights[i] / weights[0];
            self.point[i] = std::array::from_fn(|k| (control[i][k] - control[0][k]) * self.weight[i]);
        }
        let own = &self.weight[..=d];
        let least = own.iter().fold(f64::INFINITY, |least: f64, &w| least.min(w));
        self.weights = [least, own.iter().fold(0.0, |most: f64, &w| most.max(w))];
        let weight = Numerator::from_bernstein(own.iter().copied());
        for k in 0..M {
            let numerator = Numerator::from_bernstein(self.point[..=d].iter().map(|point| point[k]));
            let (g, terms) = (numerator.wronskian(&weight), numerator.wronskian_magnitude(&weight));
            for i in 0..=self.degree {
                self.g[i][k] = g.bernstein(i);
                self.size[k] = self.size[k].max(terms.bernstein(i));
            }
            self.noise[k] = (8 * self.degree + d + 12) as f64 * f64::EPSILON * self.size[k];
            let greatest = self.point[..=d].iter().fold(0.0, |most: f64, point| most.max(point[k].abs()));
            self.point_noise[k] = (8 * d + 16) as f64 * f64::EPSILON * greatest / least;
        }
    }

    pub fn is_rational(&self) -> bool {
        self.count > 0
    }

    #[inline]
    pub fn station(&self, t: f64) -> Station<M> {
        let n = self.degree;
        let (g, c) = if n == 0 {
            (self.g[0], [0.0; M])
        } else {
            let mut b = self.g;
            for level in 1..n {
                for i in 0..=n - level {
                    b[i] = lerp(&b[i], &b[i + 1], t);
                }
            }
            (lerp(&b[0], &b[1], t), std::array::from_fn(|k| n as f64 * (b[1][k] - b[0][k])))
        };
        let (rate, order) = self.leading(t, &g);
        let mut station = Station { t, g, c, rate, order, weight_sq: 1.0, q: [0.0; M] };
        if R > 0 && self.count > 0 {
            let (q, weight) = self.position(t);
            station.q = q;
            station.weight_sq = weight * weight * (1.0 - (8 * self.count) as f64 * f64::EPSILON);
        }
        station
    }

    /// q − q(0) and ω of a rational piece.
    fn position(&self, t: f64) -> ([f64; M], f64) {
        let (mut point, mut weight) = (self.point, self.weight);
        for level in 1..self.count {
            for i in 0..self.count - level {
                point[i] = lerp(&point[i], &point[i + 1], t);
                weight[i] = (1.0 - t) * weight[i] + t * weight[i + 1];
            }
        }
        (point[0].map(|value| value / weight[0]), weight[0])
    }

    /// The rate at t and the order of the common zero of all g_k, up to 2.
    #[inline]
    fn leading(&self, t: f64, g: &[f64; M]) -> ([f64; M], usize) {
        let is_zero = |row: &[f64; M]| row.iter().all(|&value| value == 0.0);
        if !is_zero(g) || (t != 0.0 && t != 1.0) {
            return (*g, 0);
        }
        let n = self.degree;
        for order in 1..=n.min(2) {
            let row = &self.g[if t == 0.0 { order } else { n - order }];
            if !is_zero(row) {
                return (row.map(|value| binomial(n, order) * value), order);
            }
        }
        (*g, 0)
    }

    /// Whether axis k moves in opposite directions at `a` and `b`.
    #[inline]
    pub fn turns(&self, k: usize, a: &Station<M>, b: &Station<M>) -> bool {
        a.g[k] * b.g[k] < 0.0 && a.g[k].abs() > self.noise[k] && b.g[k].abs() > self.noise[k]
    }

    /// A t inside [from, to] next to which axis k turns, by the secant method with a bracket; None if it does not turn.
    pub fn find_turn(&self, k: usize, (from, to): (f64, f64)) -> Option<f64> {
        let (mut a, mut b) = (self.station(from), self.station(to));
        if k >= M || !self.turns(k, &a, &b) {
            return None;
        }
        for step in 0..80 {
            let (ga, gb) = (a.g[k], b.g[k]);
            let secant = a.t + (b.t - a.t) * (ga / (ga - gb));
            let t = if step % 3 == 2 { 0.5 * (a.t + b.t) } else { secant };
            let station = self.station(t);
            if station.g[k].abs() <= self.noise[k] || t <= a.t || t >= b.t {
                return Some(t);
            }
            *(if station.g[k] * ga > 0.0 { &mut a } else { &mut b }) = station;
        }
        Some(a.t)
    }

    /// The distances between two stations, `a` before `b`.
    #[inline]
    pub fn distances(&self, a: &Station<M>, b: &Station<M>) -> Distances<M> {
        let h = b.t - a.t;
        let (mut sum, mut sizes) = ([0.0; M], [0.0; M]);
        let mut add = |row: &[f64; M]| {
            for k in 0..M {
                sum[k] += row[k];
                sizes[k] += row[k].abs();
            }
        };
        match self.degree {
            0 => add(&self.g[0]),
            1 => {
                add(&a.g);
                add(&b.g);
            }
            n => self.part(a.t, b.t)[..=n].iter().for_each(add),
        }
        let share = 1.0 / (self.degree + 1) as f64;
        let mut distances = Distances { least: [0.0; M], most: [0.0; M], side: [0; M] };
        for k in 0..M {
            let noise = self.noise[k];
            if R > 0 && self.count > 0 {
                let distance = (b.q[k] - a.q[k]).abs();
                distances.side[k] = usize::from(b.q[k] < a.q[k]);
                // Back-and-forth motion adds at most twice the smaller one of the sums of positive and of negative coefficients.
                let back = h * (share * (sizes[k] - sum[k].abs()) + 2.0 * noise) / self.weights[0].powi(2);
                distances.least[k] = (distance - 2.0 * self.point_noise[k]).max(0.0) * super::DOWN;
                distances.most[k] = (distance + 2.0 * self.point_noise[k] + back) * super::UP;
            } else {
                distances.side[k] = usize::from(sum[k] < 0.0);
                distances.least[k] = h * (share * sum[k].abs() - noise).max(0.0) * super::DOWN;
                distances.most[k] = h * (share * sizes[k] + noise) * super::UP;
            }
        }
        distances
    }

    /// Bernstein coefficients of g on [from, to].
    #[inline]
    pub fn part(&self, from: f64, to: f64) -> [[f64; M]; C] {
        let n = self.degree;
        let mut b = self.g;
        if from > 0.0 {
            for level in 1..=n {
                for i in 0..=n - level {
                    b[i] = lerp(&b[i], &b[i + 1], from);
                }
            }
        }
        if to < 1.0 {
            let t = (to - from) / (1.0 - from);
            for level in 1..=n {
                for i in (level..=n).rev() {
                    b[i] = lerp(&b[i - 1], &b[i], t);
                }
            }
        }
        b
    }

    /// A lower bound of the total length [mm] of `parts` chords of a rational piece between two stations.
    pub fn chords(&self, a: &Station<M>, b: &Station<M>, parts: usize) -> f64 {
        let step = (b.t - a.t) / parts as f64;
        let mut last = a.q;
        let mut length = 0.0;
        for i in 1..=parts {
            let next = if i == parts { b.q } else { self.position(a.t + i as f64 * step).0 };
            length += (0..M).map(|k| (next[k] - last[k]).powi(2)).sum::<f64>().sqrt();
            last = next;
        }
        let noise: f64 = self.point_noise.iter().sum();
        (length * (1.0 - (parts + M + 8) as f64 * f64::EPSILON) - 2.0 * parts as f64 * noise).max(0.0)
    }

    /// W_jk at a station, reduced in magnitude by its error.
    #[inline]
    pub fn wronskian(&self, station: &Station<M>, j: usize, k: usize) -> f64 {
        let (gj, gk, cj, ck) = (station.g[j], station.g[k], station.c[j], station.c[k]);
        let (nj, nk, n) = (self.noise[j], self.noise[k], self.degree as f64);
        let error = (cj.abs() + n * nj) * nk
            + (ck.abs() + n * nk) * nj
            + n * (gk.abs() * nj + gj.abs() * nk)
            + 2.0 * f64::EPSILON * ((cj * gk).abs() + (ck * gj).abs());
        let wronskian = cj * gk - ck * gj;
        (wronskian.abs() - error * super::UP).max(0.0).copysign(wronskian)
    }

    pub fn least_weight(&self) -> f64 {
        self.weights[0]
    }

    /// Greatest change of ω over a step of `d` in t.
    pub fn weight_change(&self, d: f64) -> f64 {
        self.count as f64 * (self.weights[1] - self.weights[0]) * d
    }
}

#[inline]
fn lerp<const M: usize>(a: &[f64; M], b: &[f64; M], t: f64) -> [f64; M] {
    let rest = 1.0 - t;
    std::array::from_fn(|k| rest * a[k] + t * b[k])
}
