//! |C'| of a piece of any degree, with the bound of its derivatives that a length table needs.
//!
//! |C'| = |h|/ω², where h is the numerator of the hodograph. The bound is Cauchy's on a disc about the middle m of a panel. With
//! S = h·h = s₀ + s₁z + … about m and Σ_{k>0} |s_k| ρᵏ ≤ s₀, S has no zero in |z| < ρ, so √S is analytic there and at most
//! √(2 s₀). In the same way |ω| is at least ω(m)/2.

use fearless_simd::{dispatch, Level};

use super::rational::Hodograph;
use super::{Piece, MAX_DEGREE, MAX_HODOGRAPH, MAX_SQUARE};
use crate::arc_length::{Disc, Integrand};
use crate::polynomial::binomial;
use crate::quadratic::dot;

/// The greatest radius of a disc, in half panels: the error of one panel is then below rounding.
const MAX_RATIO: f64 = 64.0;
/// The number of bisections of the radius, at geometric means: it is then known to 4 %.
const BISECTIONS: u32 = 7;

/// |C'(u)| of one piece.
#[derive(Clone, Copy, Debug)]
pub struct Speed<'a, const M: usize> {
    /// Bernstein coefficients of h in t = u / width, times binomials.
    h: &'a [[f64; M]],
    /// The same of ω; empty for polynomial pieces.
    omega: &'a [f64],
    width: f64,
    /// The cusp in this part of the piece, or NaN if there is none.
    foot: f64,
    /// |C'| is at most `at_foot + slope |u − foot|`.
    at_foot: f64,
    slope: f64,
}

/// The coefficients of one piece that `Speed` refers to.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients<const M: usize> {
    h: [[f64; M]; MAX_HODOGRAPH],
    omega: [f64; MAX_DEGREE + 1],
    counts: [usize; 2],
}

impl<const M: usize> Coefficients<M> {
    pub fn new(piece: &Piece<M>) -> Self {
        let hodograph = Hodograph::new(piece);
        let rows = hodograph.coefficients();
        let counts = [rows.len(), piece.weights.len()];
        let mut coefficients = Self { h: [[0.0; M]; MAX_HODOGRAPH], omega: [0.0; MAX_DEGREE + 1], counts };
        for (i, row) in rows.iter().enumerate() {
            coefficients.h[i] = row.map(|value| value * binomial(rows.len() - 1, i));
        }
        for (i, weight) in piece.weights.iter().enumerate() {
            coefficients.omega[i] = weight * binomial(piece.degree(), i);
        }
        coefficients
    }

    /// The coefficients of the piece with each axis multiplied by a factor.
    pub fn scaled(mut self, factor: &[f64; M]) -> Self {
        for row in &mut self.h {
            *row = std::array::from_fn(|k| factor[k] * row[k]);
        }
        self
    }

    /// Bernstein coefficients of the hodograph times binomials.
    pub fn hodograph(&self) -> &[[f64; M]] {
        &self.h[..self.counts[0]]
    }

    /// Bernstein coefficients of the denominator ω times binomials; none if the piece is polynomial.
    pub fn denominator(&self) -> &[f64] {
        &self.omega[..self.counts[1]]
    }
}

impl<'a, const M: usize> Speed<'a, M> {
    pub fn new(h: &'a [[f64; M]], omega: &'a [f64], width: f64) -> Self {
        Self { h, omega, width, foot: f64::NAN, at_foot: 0.0, slope: 0.0 }
    }

    /// For tables of parts without a cusp: the bound of |C'| is its greatest value.
    pub fn without_foot(mut self) -> Self {
        self.at_foot = self.greatest(|i| self.plain(i)) * self.inverse_square();
        self
    }

    /// Whether C' vanishes everywhere.
    pub fn is_zero(&self) -> bool {
        self.h.iter().all(|row| *row == [0.0; M])
    }

    /// For tables of parts with a cusp at u: |C'| is bounded by its value at u and its greatest slope.
    pub fn with_foot(mut self, u: f64) -> Self {
        let value = self.numerator(u / self.width).0;
        self.foot = u;
        self.at_foot = dot(&value, &value).sqrt() * self.inverse_square();
        self.slope = self.growth() * self.inverse_square() / self.width;
        self
    }

    /// An upper bound of the slope of |C'|, which is at most |C''|; infinite on rational pieces.
    pub fn steepest(&self) -> f64 {
        match self.omega {
            [] => self.growth() / (self.width * self.width),
            _ => f64::INFINITY,
        }
    }

    /// An upper bound of |dh/dt|.
    fn growth(&self) -> f64 {
        let n = self.h.len() - 1;
        self.greatest(|i| {
            let (low, high) = (self.plain(i), self.plain((i + 1).min(n)));
            std::array::from_fn(|k| n as f64 * (high[k] - low[k]))
        })
    }

    fn plain(&self, i: usize) -> [f64; M] {
        self.h[i].map(|value| value / binomial(self.h.len() - 1, i))
    }

    fn greatest(&self, vector: impl Fn(usize) -> [f64; M]) -> f64 {
        (0..self.h.len()).fold(0.0, |most: f64, i| most.max(dot(&vector(i), &vector(i)))).sqrt()
    }

    /// An upper bound of 1/(ω² width).
    fn inverse_square(&self) -> f64 {
        let degree = self.omega.len().saturating_sub(1);
        let least = (0..self.omega.len())
            .fold(f64::INFINITY, |least, i| least.min(self.omega[i] / binomial(degree, i)));
        if self.omega.is_empty() {
            1.0 / self.width
        } else {
            1.0 / (least * least * self.width)
        }
    }

    /// h(t) and ω(t) by the scheme of Volk and Schumaker: sums of terms with positive factors, without a division.
    #[inline(always)]
    fn numerator(&self, t: f64) -> ([f64; M], f64) {
        let s = 1.0 - t;
        let mut h = self.h[0];
        let mut power = 1.0;
        for row in &self.h[1..] {
            power *= t;
            for k in 0..M {
                h[k] = h[k] * s + power * row[k];
            }
        }
        let mut omega = 1.0;
        if let Some((first, rest)) = self.omega.split_first() {
            (omega, power) = (*first, 1.0);
            for value in rest {
                power *= t;
                omega = omega * s + power * value;
            }
        }
        (h, omega)
    }
}

impl<const M: usize> Integrand for Speed<'_, M> {
    #[inline(always)]
    fn at(&self, u: f64) -> f64 {
        let (h, omega) = self.numerator(u / self.width);
        dot(&h, &h).sqrt() / (omega * omega * self.width)
    }

    #[inline]
    fn at_each<const K: usize>(&self, u: [f64; K]) -> [f64; K] {
        match self.omega {
            [] => dispatch!(Level::new(), _simd => lengths(self.h, self.width, u)),
            _ => u.map(|u| self.at(u)),
        }
    }

    fn disc(&self, a: f64, b: f64) -> Disc {
        let (middle, half) = (0.5 * (a + b) / self.width, 0.5 * (b - a) / self.width);
        let n = self.h.len() - 1;
        let mut taylor = [[0.0; M]; MAX_HODOGRAPH];
        for i in 0..=n {
            taylor[i] = self.plain(i);
        }
        to_taylor(&mut taylor[..=n], middle, half);
        let mut square = [0.0; MAX_SQUARE];
        for i in 0..=n {
            for j in 0..=n {
                square[i + j] += dot(&taylor[i], &taylor[j]);
            }
        }
        let square = &square[..2 * n + 1];

        let mut omega = [[0.0]; MAX_DEGREE + 1];
        let degree = self.omega.len().saturating_sub(1);
        for i in 0..self.omega.len() {
            omega[i] = [self.omega[i] / binomial(degree, i)];
        }
        if !self.omega.is_empty() {
            to_taylor(&mut omega[..=degree], middle, half);
        }
        let ratio = greatest_ratio(|rho| {
            let tail = square[1..].iter().rev().fold(0.0, |sum, s| (sum + s.abs()) * rho);
            let omega_tail = omega[1..].iter().rev().fold(0.0, |sum, w| (sum + w[0].abs()) * rho);
            tail <= square[0] && omega_tail <= 0.5 * omega[0][0]
        });
        let denominator = if self.omega.is_empty() { 1.0 } else { 0.25 * omega[0][0] * omega[0][0] };
        Disc {
            radius: (ratio - 1.0) * half * self.width,
            bound: (2.0 * square[0]).sqrt() / (denominator * self.width),
        }
    }

    fn foot(&self) -> f64 {
        self.foot
    }

    // The integral over such a panel and its quadrature are both between 0 and the width times the bound of |C'|.
    fn foot_error(&self, width: f64) -> f64 {
        width * (self.at_foot + self.slope * width)
    }
}

/// |h|/width of a polynomial piece at several u, written so that the compiler uses SIMD vectors over the places.
#[inline(always)]
fn lengths<const M: usize, const K: usize>(rows: &[[f64; M]], width: f64, mut u: [f64; K]) -> [f64; K] {
    let (mut rest, mut sum, per_width) = ([1.0; K], [0.0; K], 1.0 / width);
    for l in 0..K {
        u[l] *= per_width;
        rest[l] -= u[l];
    }
    // One axis after the other; otherwise the compiler would build vectors of axes.
    for k in 0..M {
        let (mut h, mut power) = ([rows[0][k]; K], [1.0; K]);
        for row in &rows[1..] {
            for l in 0..K {
                power[l] *= u[l];
                h[l] = h[l] * rest[l] + power[l] * row[k];
            }
        }
        for l in 0..K {
            sum[l] += h[l] * h[l];
        }
    }
    for l in 0..K {
        sum[l] = sum[l].sqrt() * per_width;
    }
    sum
}

/// The greatest radius of a disc that is `clear` of singularities, in half panels; 1 if no greater one is.
pub fn greatest_ratio(clear: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (1.0, MAX_RATIO);
    if clear(high) {
        low = high;
    } else if clear(low) {
        for _ in 0..BISECTIONS {
            let rho = (low * high).sqrt();
            if clear(rho) {
                low = rho;
            } else {
                high = rho;
            }
        }
    }
    low
}

/// Turns Bernstein coefficients on [0, 1] into coefficients of powers of z = (t − middle)/half, up to the sign of z, by forward
/// differences of the part from the middle to the farther end.
pub fn to_taylor<const M: usize>(b: &mut [[f64; M]], middle: f64, half: f64) {
    let n = b.len() - 1;
    let t = if middle > 0.5 {
        b.reverse();
        1.0 - middle
    } else {
        middle
    };
    for row in 1..=n {
        for i in 0..=n - row {
            for k in 0..M {
                b[i][k] += t * (b[i + 1][k] - b[i][k]);
            }
        }
    }
    for row in 1..=n {
        for i in (row..=n).rev() {
            for k in 0..M {
                b[i][k] -= b[i - 1][k];
            }
        }
    }
    let (ratio, mut power) = (half / (1.0 - t), 1.0);
    for k in 0..=n {
        b[k] = b[k].map(|value| value * (binomial(n, k) * power));
        power *= ratio;
    }
}
