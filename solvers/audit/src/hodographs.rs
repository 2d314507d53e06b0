//! Evaluates a piece of any degree and its derivatives at many places, from the Bernstein coefficients of all derivatives.
//!
//! C = P_0 + N/ω, polynomial where ω = 1. The coefficients of the derivatives of N and ω are differences of those of N and ω;
//! their sums with positive weights lose no digits (scheme of Schumaker and Volk 1986). The quotient rule gives the derivatives
//! of C.

use fearless_simd::{dispatch, Level};

use super::number::{inner, Number};
use super::polygon::{Polygon, MOST};
use super::vectors::{from_to, length, vector_of};

/// Bernstein coefficients times binomial coefficients.
type Rows<const M: usize> = [[f64; M]; MOST + 1];

/// Binomial coefficients: row n, column i.
const BINOMIALS: [[f64; MOST + 1]; MOST + 1] = {
    let mut rows = [[0.0; MOST + 1]; MOST + 1];
    let mut n = 0;
    while n <= MOST {
        rows[n][0] = 1.0;
        let mut i = 1;
        while i <= n {
            rows[n][i] = rows[n - 1][i - 1] + rows[n - 1][i];
            i += 1;
        }
        n += 1;
    }
    rows
};

/// Steps are even if the longest one is at most this multiple of the shortest one.
const EVEN: f64 = 16.0;

/// Evaluates an expression with the degree of a piece as a constant if it is 5, the degree of most pieces, so that loops are
/// unrolled.
macro_rules! with_degree {
    ($degree:expr, $n:ident, $call:expr) => {
        match $degree {
            5 => {
                let $n = 5_usize;
                $call
            }
            $n => $call,
        }
    };
}

#[derive(Clone, Debug)]
pub struct Hodographs<const M: usize> {
    start: [f64; M],
    degree: usize,
    /// Coefficients of N and its first three derivatives by t; and, on rational pieces, those of ω.
    rows: [Rows<M>; 4],
    weights: Option<Box<[Rows<1>; 4]>>,
    /// See `sizes`.
    sizes: [[f64; M]; 3],
    /// Whether the steps of the polygon have similar lengths, see `EVEN`.
    is_even: bool,
    /// Upper bounds of the lengths of the second to the fifth derivative; infinite on rational pieces.
    bounds: [f64; 4],
}

impl<const M: usize> Hodographs<M> {
    /// A point at the origin.
    pub fn none() -> Self {
        let (rows, bounds) = ([[[0.0; M]; MOST + 1]; 4], [0.0; 4]);
        let (start, sizes) = ([0.0; M], [[0.0; M]; 3]);
        Self { start, degree: 0, rows, weights: None, sizes, is_even: true, bounds }
    }

    /// Takes the coefficients of another polygon.
    #[inline]
    pub fn set(&mut self, polygon: &Polygon<M>) {
        let (steps, weights) = (polygon.steps(), polygon.weights());
        let degree = steps.len();
        let (mut ways, mut longest) = ([[0.0; M]; MOST + 1], [0.0_f64; M]);
        let (mut least_sq, mut most_sq) = (f64::INFINITY, 0.0_f64);
        for (i, step) in steps.iter().enumerate() {
            let square = inner(step, step);
            (least_sq, most_sq) = (least_sq.min(square), most_sq.max(square));
            for k in 0..M {
                ways[i + 1][k] = ways[i][k] + step[k];
                longest[k] = longest[k].max(step[k].abs());
            }
        }
        (self.start, self.degree) = (polygon.start, degree);
        self.is_even = most_sq <= EVEN * EVEN * least_sq;
        let mut ratio = 1.0;
        if polygon.is_rational() {
            let (mut of_weights, mut found) = ([[0.0]; MOST + 1], Box::new([[[0.0]; MOST + 1]; 4]));
            for i in 0..=degree {
                ways[i] = vector_of(|k| weights[i] * ways[i][k]);
                of_weights[i] = [weights[i]];
            }
            derive(&mut ways, 1.0, degree, 4, &mut self.rows);
            derive(&mut of_weights, 1.0, degree, 4, &mut found[..]);
            (self.weights, self.bounds) = (Some(found), [f64::INFINITY; 4]);
            let least = weights.iter().fold(f64::INFINITY, |least, w| least.min(*w));
            ratio = degree as f64 * weights.iter().fold(0.0_f64, |most, w| most.max(*w)) / least;
        } else {
            with_degree!(degree, n, derive(&mut ways, 1.0, n, 1, &mut self.rows[..1]));
            // From the steps themselves: differences of their sums lose digits.
            ways[..degree].copy_from_slice(steps);
            self.bounds = with_degree!(degree, n, {
                derive(&mut ways, n as f64, n.saturating_sub(1), 5, &mut self.rows[1..])
            });
            self.weights = None;
        }
        let mut scale = 0.5;
        for order in 0..3 {
            scale *= 2.0 * ratio * degree.saturating_sub(order) as f64;
            self.sizes[order] = vector_of(|k| scale * longest[k]);
        }
    }

    /// C relative to the start of the piece, and its first R − 1 derivatives by t; `rest` is 1 − t.
    #[inline(always)]
    fn local<const R: usize>(&self, t: f64, rest: f64) -> [[f64; M]; R] {
        let mut c = [[0.0; M]; R];
        with_degree!(self.degree, n, {
            for order in 0..R.min(n + 1) {
                c[order] = sum(&self.rows[order][..=n - order], t, rest);
            }
        });
        if let Some(weights) = &self.weights {
            let mut w = [0.0; R];
            for order in 0..R.min(self.degree + 1) {
                [w[order]] = sum(&weights[order][..=self.degree - order], t, rest);
            }
            for order in 0..R {
                let mut binomial = 1.0;
                for i in 1..=order {
                    binomial *= (order + 1 - i) as f64 / i as f64;
                    for k in 0..M {
                        c[order][k] -= binomial * w[i] * c[order - i][k];
                    }
                }
                for k in 0..M {
                    c[order][k] /= w[0];
                }
            }
        }
        c
    }

    /// C at t.
    #[inline]
    pub fn at(&self, t: f64, rest: f64) -> [f64; M] {
        let [way] = self.local::<1>(t, rest);
        vector_of(|k| self.start[k] + way[k])
    }

    /// dC/dt.
    #[inline]
    pub fn slope(&self, t: f64, rest: f64) -> [f64; M] {
        if self.weights.is_some() {
            self.local::<2>(t, rest)[1]
        } else {
            self.polynomial_slope(t, rest)
        }
    }

    /// |dC/du| for u = t/`per` at several t, with each axis multiplied by its `scale`.
    pub fn speeds<const K: usize>(
        &self,
        t: [f64; K],
        rest: [f64; K],
        (per, scale): (f64, &[f64; M]),
    ) -> [f64; K] {
        let factors = (per, scale);
        if self.weights.is_some() {
            return std::array::from_fn(|i| {
                let slope = self.slope(t[i], rest[i]);
                length(&vector_of::<M>(|k| slope[k] * per * scale[k]))
            });
        }
        dispatch!(Level::new(), _simd => {
            with_degree!(self.degree, n, lengths(&self.rows[1][..n], t, rest, factors))
        })
    }

    /// dC/dt of a piece without weights, at one t or at several.
    #[inline(always)]
    pub fn polynomial_slope<T: Number>(&self, t: T, rest: T) -> [T; M] {
        with_degree!(self.degree, n, sum(&self.rows[1][..n], t, rest))
    }

    /// C and dC/dt of a piece without weights.
    #[inline(always)]
    pub fn polynomial_place<T: Number>(&self, t: T, rest: T) -> [[T; M]; 2] {
        [self.polynomial_point(t, rest), self.polynomial_slope(t, rest)]
    }

    /// C of a piece without weights.
    #[inline(always)]
    pub fn polynomial_point<T: Number>(&self, t: T, rest: T) -> [T; M] {
        let mut point = with_degree!(self.degree, n, sum(&self.rows[0][..=n], t, rest));
        for k in 0..M {
            point[k] = point[k] + self.start[k];
        }
        point
    }

    /// The first three derivatives by t.
    #[inline]
    pub fn rates(&self, t: f64, rest: f64) -> [[f64; M]; 3] {
        if self.weights.is_some() {
            let [_, rates @ ..] = self.local::<4>(t, rest);
            return rates;
        }
        self.polynomial_rates(t, rest)
    }

    /// The first three derivatives by t of a piece without weights, at one t or at several.
    #[inline(always)]
    pub fn polynomial_rates<T: Number>(&self, t: T, rest: T) -> [[T; M]; 3] {
        // Three variables: an array indexed by a loop counter would stay in memory.
        let (mut first, mut second, mut third) = ([t.filled(0.0); M], [t.filled(0.0); M], [t.filled(0.0); M]);
        with_degree!(self.degree, n, {
            if n >= 1 {
                first = sum(&self.rows[1][..n], t, rest);
            }
            if n >= 2 {
                second = sum(&self.rows[2][..n - 1], t, rest);
            }
            if n >= 3 {
                third = sum(&self.rows[3][..n - 2], t, rest);
            }
        });
        [first, second, third]
    }

    /// C and its first R − 1 derivatives by t.
    #[inline]
    pub fn derivatives<const R: usize>(&self, t: f64, rest: f64) -> [[f64; M]; R] {
        let mut c = self.local::<R>(t, rest);
        for k in 0..M {
            c[0][k] += self.start[k];
        }
        c
    }

    /// For each axis the magnitudes that the rounding errors of the first three derivatives at t are relative to: the derivatives
    /// are sums of the polygon's steps, and the magnitudes are these sums with absolute values. Where the steps are even, and on
    /// rational pieces, they are those of the whole piece.
    #[inline(always)]
    pub fn sizes_at<T: Number>(&self, steps: &[[f64; M]], t: T, rest: T) -> [[T; M]; 3] {
        let mut sizes = self.sizes.map(|of| of.map(|size| t.filled(size)));
        if self.is_even || self.weights.is_some() {
            return sizes;
        }
        let mut rows = [[0.0; M]; MOST];
        for (row, step) in rows.iter_mut().zip(steps) {
            *row = step.map(f64::abs);
        }
        let mut factor = 1.0;
        for order in 0..self.degree.min(3) {
            let last = self.degree - order - 1;
            factor *= (last + 1) as f64;
            let mut terms = rows;
            for i in 0..=last {
                terms[i] = vector_of(|k| factor * BINOMIALS[last][i] * rows[i][k]);
            }
            sizes[order] = sum(&terms[..=last], t, rest);
            for i in 0..last {
                rows[i] = vector_of(|k| rows[i][k] + rows[i + 1][k]);
            }
        }
        sizes
    }

    /// Upper bounds of `sizes_at` on the piece.
    pub fn sizes(&self) -> &[[f64; M]; 3] {
        &self.sizes
    }

    /// Upper bounds of the lengths of the second to the fifth derivative; infinite on rational pieces.
    pub fn bounds(&self) -> [f64; 4] {
        self.bounds
    }
}

/// Σ rows_i t^i rest^(n − i).
#[inline(always)]
fn sum<const M: usize, T: Number>(rows: &[[f64; M]], t: T, rest: T) -> [T; M] {
    let (mut value, mut power) = ([t; M], t.filled(1.0));
    for k in 0..M {
        value[k] = t.filled(rows[0][k]);
    }
    for row in &rows[1..] {
        power = power * t;
        for k in 0..M {
            value[k] = value[k] * rest + power * row[k];
        }
    }
    value
}

/// Σ rows_i t^i rest^(n − i) of each axis at several t.
#[inline(always)]
fn sum_at_each<const M: usize, const K: usize>(
    rows: &[[f64; M]],
    t: &[f64; K],
    rest: &[f64; K],
) -> [[f64; K]; M] {
    let mut values = [[0.0; K]; M];
    // One axis after the other: with all axes at once the compiler would make SIMD vectors of axes instead of places.
    for k in 0..M {
        let (mut value, mut power) = ([rows[0][k]; K], [1.0; K]);
        for row in &rows[1..] {
            for i in 0..K {
                power[i] *= t[i];
                value[i] = value[i] * rest[i] + power[i] * row[k];
            }
        }
        values[k] = value;
    }
    values
}

/// The lengths of Σ rows_i t^i rest^(n − i) at several t in SIMD vectors, with each axis multiplied by `per` and its `scale`.
#[inline(always)]
fn lengths<const M: usize, const K: usize>(
    rows: &[[f64; M]],
    t: [f64; K],
    rest: [f64; K],
    (per, scale): (f64, &[f64; M]),
) -> [f64; K] {
    let value = sum_at_each(rows, &t, &rest);
    let mut sum = [0.0; K];
    for k in 0..M {
        for i in 0..K {
            let value = value[k][i] * per * scale[k];
            sum[i] += value * value;
        }
    }
    for i in 0..K {
        sum[i] = sum[i].sqrt();
    }
    sum
}

/// Writes to `found` the coefficients, times binomial coefficients and `factor`, of a function and of its derivatives, `orders`
/// functions in all, from its Bernstein coefficients in `rows`, which are overwritten by their differences. Returns upper bounds
/// of the lengths of the derivatives, times `factor`.
#[inline(always)]
fn derive<const M: usize>(
    rows: &mut Rows<M>,
    mut factor: f64,
    degree: usize,
    orders: usize,
    found: &mut [Rows<M>],
) -> [f64; 4] {
    let (mut factors, mut squares, mut lengths) = ([0.0; 4], [0.0; 4], [0.0; 4]);
    for order in 0..5.min(orders).min(degree + 1) {
        let count = degree - order;
        if order > 0 {
            factors[order - 1] = factor;
            squares[order - 1] = rows[..=count].iter().fold(0.0_f64, |most, row| most.max(inner(row, row)));
        }
        if let Some(found) = found.get_mut(order) {
            for i in 0..=count {
                let coefficient = factor * BINOMIALS[count][i];
                found[i] = vector_of(|k| coefficient * rows[i][k]);
            }
        }
        for i in 0..count {
            rows[i] = from_to(&rows[i], &rows[i + 1]);
        }
        factor *= count as f64;
    }
    // All roots together: they take as long as one.
    for i in 0..4 {
        lengths[i] = factors[i] * f64::sqrt(squares[i]);
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::distance;

    #[test]
    fn places_are_those_of_the_polygon_and_each_derivative_is_that_of_the_one_before() {
        let points = [[1000.0, 1.0], [1002.0, 3.0], [1005.0, -1.0], [1006.0, 2.0], [1009.0, 9.0]];
        for weights in [&[][..], &[1.0, 0.5, 3.0, 2.0, 0.7]] {
            let polygon = Polygon::new(points.into_iter(), weights);
            let mut hodographs = Hodographs::none();
            hodographs.set(&polygon);
            for t in [0.0, 0.1, 0.4, 0.6, 0.9, 1.0] {
                assert!(distance(&hodographs.at(t, 1.0 - t), &polygon.at(t)) < 1e-12, "{t}");
            }
            for t in [0.1, 0.4, 0.6, 0.9] {
                let h = 1e-5;
                let [before, here, after] =
                    [t - h, t, t + h].map(|t| hodographs.derivatives::<4>(t, 1.0 - t));
                for order in 0..3 {
                    for k in 0..2 {
                        let slope = (after[order][k] - before[order][k]) / (2.0 * h);
                        let scale = 1000.0 + here[order + 1].map(f64::abs).iter().sum::<f64>();
                        assert!((slope - here[order + 1][k]).abs() < 1e-7 * scale, "{order} at {t}");
                    }
                }
                assert!(!weights.is_empty() || crate::vectors::length(&here[2]) <= hodographs.bounds()[0]);
            }
        }
    }

    #[test]
    fn a_rational_quarter_of_a_circle_has_its_curvature_everywhere() {
        let points = [[1010.0, 0.0], [1010.0, 10.0], [1000.0, 10.0]];
        let mut quarter = Hodographs::none();
        quarter.set(&Polygon::new(points.into_iter(), &[1.0, 0.5_f64.sqrt(), 1.0]));
        for i in 0..=20 {
            let t = f64::from(i) / 20.0;
            let [_, tangent, bend] = quarter.derivatives::<3>(t, 1.0 - t);
            assert!((crate::vectors::curvature(&tangent, &bend) - 0.1).abs() < 1e-14, "{t}");
        }
    }
}
