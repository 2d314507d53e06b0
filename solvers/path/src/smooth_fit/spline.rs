//! A C4 quintic B-spline over strictly increasing knots, its ends clamped.
//!
//! Interval j lies between knots j and j + 1. The basis functions of the coefficients j to j + 5 are not zero on it: these are
//! called the coefficients of the interval.

use feedplan_geometry::quadratic::{lerp, sub};

pub const DEGREE: usize = 5;
/// The number of basis functions, and of coefficients, of an interval.
pub const ORDER: usize = DEGREE + 1;
/// The number of knots on which the basis in an interval depends: five on each side; at the ends the end knot is repeated.
const LOCAL: usize = 2 * DEGREE;

#[derive(Clone, Debug, Default)]
pub struct Spline<const D: usize> {
    pub knots: Vec<f64>,
    pub coefficient: Vec<[f64; D]>,
}

/// The knots around an interval; the interval itself is [t₄, t₅].
pub type Around = [f64; LOCAL];

/// The knots around interval j.
pub fn around(knots: &[f64], j: usize) -> Around {
    let last = knots.len() - 1;
    std::array::from_fn(|k| knots[(j + k).clamp(DEGREE - 1, last + DEGREE - 1) - (DEGREE - 1)])
}

/// The mean of the five inner knots of coefficient i (Greville abscissa): the coefficients of a linear function are its values
/// there.
pub fn greville(knots: &[f64], i: usize) -> f64 {
    let last = knots.len() - 1;
    (i + 1..=i + DEGREE).map(|k| knots[k.clamp(DEGREE, last + DEGREE) - DEGREE]).sum::<f64>() / DEGREE as f64
}

/// The values at u of the six B-splines that are not zero in an interval (de Boor, Cox).
pub fn basis(t: &Around, u: f64) -> [f64; ORDER] {
    let mut out = [0.0; ORDER];
    basis_of_degree(t, u, DEGREE, &mut out);
    out
}

fn basis_of_degree(t: &Around, u: f64, degree: usize, out: &mut [f64]) {
    out[0] = 1.0;
    for r in 1..=degree {
        let mut saved = 0.0;
        for q in 0..r {
            let (low, high) = (t[DEGREE - r + q], t[DEGREE + q]);
            let share = out[q] / (high - low);
            out[q] = saved + (high - u) * share;
            saved = (u - low) * share;
        }
        out[r] = saved;
    }
}

/// A quadratic form in the six coefficients of an interval.
pub type Form = [[f64; ORDER]; ORDER];

/// A linear form in the six coefficients of an interval.
pub type Pull = [f64; ORDER];

/// Four Gauss nodes in an interval with their weights: exact for the square of a cubic.
pub fn gauss(t: &Around) -> [(f64, f64); 4] {
    // Abscissae and weights on [−1, 1].
    const NODES: [(f64, f64); 4] = [
        (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
        (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
        (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    ];
    let (middle, half) = (0.5 * (t[4] + t[5]), 0.5 * (t[5] - t[4]));
    NODES.map(|(x, weight)| (middle + half * x, half * weight))
}

/// C'' and C''' at u as linear forms in the coefficients of the interval, for one axis.
pub fn derivative_rows(t: &Around) -> impl Fn(f64) -> [Pull; 2] + '_ {
    let differences = [derivative_coefficients::<2>(t), derivative_coefficients::<3>(t)];
    move |u| {
        std::array::from_fn(|which| {
            let (degree, rows) = (DEGREE - 2 - which, &differences[which]);
            let mut values = [0.0; ORDER];
            basis_of_degree(t, u, degree, &mut values);
            std::array::from_fn(|a| (0..=degree).map(|q| values[q] * rows[q][a]).sum())
        })
    }
}

/// The matrix from the coefficients of C to those of its R-th derivative, a spline of degree DEGREE − R; rows after its first
/// DEGREE − R + 1 are not used.
fn derivative_coefficients<const R: usize>(t: &Around) -> [[f64; ORDER]; ORDER] {
    let mut rows = [[0.0; ORDER]; ORDER];
    for (a, row) in rows.iter_mut().enumerate() {
        row[a] = 1.0;
    }
    for level in 1..=R {
        for a in 0..ORDER - level {
            let scale = (DEGREE + 1 - level) as f64 / (t[a + DEGREE] - t[a + level - 1]);
            for b in 0..ORDER {
                rows[a][b] = scale * (rows[a + 1][b] - rows[a][b]);
            }
        }
    }
    rows
}

impl<const D: usize> Spline<D> {
    pub fn intervals(&self) -> usize {
        self.knots.len() - 1
    }

    /// The Bézier control points of every interval; each begins exactly where the one before ends.
    pub fn pieces(&self) -> Vec<[[f64; D]; ORDER]> {
        let mut pieces: Vec<[[f64; D]; ORDER]> = Vec::with_capacity(self.intervals());
        for j in 0..self.intervals() {
            let mut piece = self.piece(j);
            if let Some(before) = pieces.last() {
                piece[0] = before[DEGREE];
            }
            pieces.push(piece);
        }
        // The spline begins and ends at its first and last coefficient.
        let last = pieces.len() - 1;
        (pieces[0][0], pieces[last][DEGREE]) = (self.coefficient[0], self.coefficient[last + DEGREE]);
        pieces
    }

    /// The Bézier control points of interval j: the values of the blossom at its ends.
    fn piece(&self, j: usize) -> [[f64; D]; ORDER] {
        let t = around(&self.knots, j);
        let (a, b) = (t[4], t[5]);
        // Distances from a point near the interval keep their digits far from the origin.
        let anchor = self.coefficient[j + 2];
        let local: [[f64; D]; ORDER] = std::array::from_fn(|k| sub(&self.coefficient[j + k], &anchor));
        std::array::from_fn(|k| {
            let mut c = local;
            for level in 1..=DEGREE {
                let u = if level <= k { b } else { a };
                for i in 0..ORDER - level {
                    let (low, high) = (t[i + level - 1], t[i + DEGREE]);
                    c[i] = lerp(&c[i], &c[i + 1], (u - low) / (high - low));
                }
            }
            std::array::from_fn(|axis| c[0][axis] + anchor[axis])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: [f64; 6] = [0.0, 1.0, 1.5, 3.0, 4.0, 7.0];

    #[test]
    fn the_basis_is_a_partition_of_one_and_reproduces_lines() {
        for j in 0..5 {
            let t = around(&KNOTS, j);
            for part in [0.0, 0.3, 1.0] {
                let u = KNOTS[j] + part * (KNOTS[j + 1] - KNOTS[j]);
                let values = basis(&t, u);
                assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                let line: f64 = (0..ORDER).map(|k| values[k] * greville(&KNOTS, j + k)).sum();
                assert!((line - u).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn the_energy_of_a_cube_is_36_times_the_length() {
        // C = u³ has C''' = 6; its coefficients are the blossom at the five inner knots.
        let padded: Vec<f64> = [0.0; 5].iter().chain(&KNOTS).chain(&[7.0; 5]).copied().collect();
        let coefficient: Vec<f64> = (0..10)
            .map(|i| {
                let t = &padded[i + 1..=i + DEGREE];
                let mut sum = 0.0;
                for a in 0..5 {
                    for b in a + 1..5 {
                        for c in b + 1..5 {
                            sum += t[a] * t[b] * t[c];
                        }
                    }
                }
                sum / 10.0
            })
            .collect();
        for j in 0..5 {
            let t = around(&KNOTS, j);
            let rows = derivative_rows(&t);
            let third = |u: f64| -> f64 { (0..ORDER).map(|a| rows(u)[1][a] * coefficient[j + a]).sum() };
            let sum: f64 = gauss(&t).iter().map(|(u, weight)| weight * third(*u).powi(2)).sum();
            let expected = 36.0 * (KNOTS[j + 1] - KNOTS[j]);
            assert!((sum / expected - 1.0).abs() < 1e-11, "{j}: {sum} {expected}");
        }
        let spline =
            Spline { knots: KNOTS.to_vec(), coefficient: coefficient.iter().map(|&c| [c]).collect() };
        let ends: Vec<f64> = spline.pieces().iter().map(|piece| piece[DEGREE][0]).collect();
        for (end, knot) in ends.iter().zip(&KNOTS[1..]) {
            assert!((end - knot.powi(3)).abs() < 1e-12);
        }
    }
}
