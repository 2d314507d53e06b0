//! The hodograph of a piece with proven errors: tangents, their slopes and the ways of the axes.

use feedplan_geometry::polynomial::Polynomial;

/// Of rational pieces the numerator of C' has degree 2 d − 2, d ≤ 9.
type Numerator = Polynomial<20>;

/// C'(t) = g(t)/ω(t)² by axis over t in [0, 1], from the control points alone; ω = 1 on polynomial pieces.
///
/// `C` bounds the Bernstein coefficients of g, `R` those of ω: 0 where only polynomial pieces are meant.
#[derive(Clone)]
pub struct Hodograph<const M: usize, const C: usize, const R: usize> {
    /// Degree of g.
    pub degree: usize,
    g: [[f64; M]; C],
    /// The greatest coefficient of g_k.
    pub size: [f64; M],
    /// No g_k computed here is farther off than this.
    pub noise: [f64; M],
    /// Coefficients of ω, and of ω (C − C(0)); none of a polynomial piece.
    count: usize,
    weight: [f64; R],
    point: [[f64; M]; R],
    /// No q_k computed here is farther off than this.
    point_noise: [f64; M],
    /// The least and the greatest weight.
    weights: [f64; 2],
}

/// A place on a piece.
#[derive(Clone, Copy)]
pub struct Node<const M: usize> {
    pub t: f64,
    pub g: [f64; M],
    /// g'
    pub c: [f64; M],
    /// The velocity of axis k squared is `rate[k]`² x: x is π and the rate g, but at an exact cusp at an end of the
    /// piece x is π s^(2 order), s the distance from it, and the rate the leading coefficient of g.
    pub rate: [f64; M],
    pub order: usize,
    /// Not above ω².
    pub weight_sq: f64,
    /// q − q(0) of a rational piece.
    q: [f64; M],
}

/// How far each axis moves between two nodes: at least from one to the other, at most to and fro.
pub struct Ways<const M: usize> {
    pub least: [f64; M],
    pub most: [f64; M],
    /// 0 of an axis that gets forward from one to the other, 1 of one that gets backward, where it moves at least.
    pub side: [usize; M],
}

impl<const M: usize, const C: usize, const R: usize> Hodograph<M, C, R> {
    /// With these control points and weights (all equal or none: polynomial).
    #[inline(always)]
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

    /// Whether the tangents are quotients.
    pub fn is_rational(&self) -> bool {
        self.count > 0
    }

    /// The place t.
    #[inline(always)]
    pub fn node(&self, t: f64) -> Node<M> {
        let n = self.degree;
        let (g, c) = if n == 0 {
            (self.g[0], [0.0; M])
        } else {
            let mut b = self.g;
            for level in 1..n {
                for i in 0..=n - level {
                    b[i] = between(&b[i], &b[i + 1], t);
                }
            }
            (between(&b[0], &b[1], t), std::array::from_fn(|k| n as f64 * (b[1][k] - b[0][k])))
        };
        let (rate, order) = self.leading(t, &g);
        let mut node = Node { t, g, c, rate, order, weight_sq: 1.0, q: [0.0; M] };
        if R > 0 && self.count > 0 {
            let (q, weight) = self.place(t);
            node.q = q;
            node.weight_sq = weight * weight * (1.0 - (8 * self.count) as f64 * f64::EPSILON);
        }
        node
    }

    /// q − q(0) and ω of a rational piece.
    fn place(&self, t: f64) -> ([f64; M], f64) {
        let (mut point, mut weight) = (self.point, self.weight);
        for level in 1..self.count {
            for i in 0..self.count - level {
                point[i] = between(&point[i], &point[i + 1], t);
                weight[i] = (1.0 - t) * weight[i] + t * weight[i + 1];
            }
        }
        (point[0].map(|value| value / weight[0]), weight[0])
    }

    /// The rate at t and the order of its zero, up to 2.
    #[inline(always)]
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

    /// Whether axis k moves one way at `a` and the other way at `b`.
    #[inline(always)]
    pub fn turns(&self, k: usize, a: &Node<M>, b: &Node<M>) -> bool {
        a.g[k] * b.g[k] < 0.0 && a.g[k].abs() > self.noise[k] && b.g[k].abs() > self.noise[k]
    }

    /// A place inside [from, to] next to which axis k turns: Newton's method by secants, in a bracket.
    pub fn turn(&self, k: usize, (from, to): (f64, f64)) -> Option<f64> {
        let (mut a, mut b) = (self.node(from), self.node(to));
        if k >= M || !self.turns(k, &a, &b) {
            return None;
        }
        for step in 0..80 {
            let (ga, gb) = (a.g[k], b.g[k]);
            let secant = a.t + (b.t - a.t) * (ga / (ga - gb));
            let t = if step % 3 == 2 { 0.5 * (a.t + b.t) } else { secant };
            let node = self.node(t);
            if node.g[k].abs() <= self.noise[k] || t <= a.t || t >= b.t {
                return Some(t);
            }
            *(if node.g[k] * ga > 0.0 { &mut a } else { &mut b }) = node;
        }
        Some(a.t)
    }

    /// The ways between two nodes, `a` before `b`.
    #[inline(always)]
    pub fn ways(&self, a: &Node<M>, b: &Node<M>) -> Ways<M> {
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
        let mut ways = Ways { least: [0.0; M], most: [0.0; M], side: [0; M] };
        for k in 0..M {
            let noise = self.noise[k];
            if R > 0 && self.count > 0 {
                let way = (b.q[k] - a.q[k]).abs();
                ways.side[k] = usize::from(b.q[k] < a.q[k]);
                // No more to and fro than the smaller of what is positive and what is negative, twice.
                let back = h * (share * (sizes[k] - sum[k].abs()) + 2.0 * noise) / self.weights[0].powi(2);
                ways.least[k] = (way - 2.0 * self.point_noise[k]).max(0.0) * super::DOWN;
                ways.most[k] = (way + 2.0 * self.point_noise[k] + back) * super::UP;
            } else {
                ways.side[k] = usize::from(sum[k] < 0.0);
                ways.least[k] = h * (share * sum[k].abs() - noise).max(0.0) * super::DOWN;
                ways.most[k] = h * (share * sizes[k] + noise) * super::UP;
            }
        }
        ways
    }

    /// The Bernstein coefficients of g on [from, to].
    #[inline(always)]
    pub fn part(&self, from: f64, to: f64) -> [[f64; M]; C] {
        let n = self.degree;
        let mut b = self.g;
        if from > 0.0 {
            for level in 1..=n {
                for i in 0..=n - level {
                    b[i] = between(&b[i], &b[i + 1], from);
                }
            }
        }
        if to < 1.0 {
            let t = (to - from) / (1.0 - from);
            for level in 1..=n {
                for i in (level..=n).rev() {
                    b[i] = between(&b[i - 1], &b[i], t);
                }
            }
        }
        b
    }

    /// Not above the length of the chords of equal parts of a rational piece between two nodes.
    pub fn chords(&self, a: &Node<M>, b: &Node<M>, parts: usize) -> f64 {
        let step = (b.t - a.t) / parts as f64;
        let mut last = a.q;
        let mut length = 0.0;
        for i in 1..=parts {
            let next = if i == parts { b.q } else { self.place(a.t + i as f64 * step).0 };
            length += (0..M).map(|k| (next[k] - last[k]).powi(2)).sum::<f64>().sqrt();
            last = next;
        }
        let noise: f64 = self.point_noise.iter().sum();
        (length * (1.0 - (parts + M + 8) as f64 * f64::EPSILON) - 2.0 * parts as f64 * noise).max(0.0)
    }

    /// Not above |g_j' g_k − g_k' g_j| at a node.
    #[inline(always)]
    pub fn twist(&self, node: &Node<M>, j: usize, k: usize) -> f64 {
        let (gj, gk, cj, ck) = (node.g[j], node.g[k], node.c[j], node.c[k]);
        let (nj, nk, n) = (self.noise[j], self.noise[k], self.degree as f64);
        let error = (cj.abs() + n * nj) * nk
            + (ck.abs() + n * nk) * nj
            + n * (gk.abs() * nj + gj.abs() * nk)
            + 2.0 * f64::EPSILON * ((cj * gk).abs() + (ck * gj).abs());
        let twist = cj * gk - ck * gj;
        (twist.abs() - error * super::UP).max(0.0).copysign(twist)
    }

    pub fn least_weight(&self) -> f64 {
        self.weights[0]
    }

    /// How far ω can be from its value at a node after a step of `d`.
    pub fn weight_change(&self, d: f64) -> f64 {
        self.count as f64 * (self.weights[1] - self.weights[0]) * d
    }
}

#[inline(always)]
fn between<const M: usize>(a: &[f64; M], b: &[f64; M], t: f64) -> [f64; M] {
    let rest = 1.0 - t;
    std::array::from_fn(|k| rest * a[k] + t * b[k])
}

/// n over k, k ≤ 4.
pub fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
}
