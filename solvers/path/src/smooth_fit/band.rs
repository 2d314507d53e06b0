//! Cholesky factor L D Lᵀ of the matrix of the fit: symmetric, positive definite, in blocks of D unknowns, of which each
//! meets its five neighbours on either side.

use super::spline::{DEGREE, ORDER};

/// Added to the diagonal, in parts of it: what rounding may take from it.
const REGULAR: f64 = 1e-13;
/// An unknown whose pivot is below this part of its diagonal stays where it is.
const LEAST_PIVOT: f64 = 1e-15;

/// Row i holds the entries (i, i) to (i, i + WIDTH − 1).
pub struct Band<const D: usize> {
    /// Entries of the blocks (i, i + b) by b and place in the block, those of all i side by side: sums over intervals side
    /// by side go to places side by side.
    blocks: [[[Vec<f64>; D]; D]; ORDER],
    entry: Vec<f64>,
    /// 1/D.
    inverse: Vec<f64>,
}

impl<const D: usize> Default for Band<D> {
    fn default() -> Self {
        let blocks = std::array::from_fn(|_| std::array::from_fn(|_| std::array::from_fn(|_| vec![])));
        Self { blocks, entry: vec![], inverse: vec![] }
    }
}

impl<const D: usize> Band<D> {
    const WIDTH: usize = ORDER * D;

    /// A matrix of zeros for so many blocks.
    pub fn clear(&mut self, count: usize) {
        for column in self.blocks.as_flattened_mut().as_flattened_mut() {
            column.clear();
            column.resize(count, 0.0);
        }
    }

    /// The entries (k, m) of blocks (i, i + b), by i; of b = 0 those with k ≤ m count.
    #[inline(always)]
    pub fn block(&mut self, b: usize, k: usize, m: usize) -> &mut [f64] {
        &mut self.blocks[b][k][m]
    }

    /// Factors the matrix, `fixed` unknowns taken out: their rows and columns become those of the unit matrix.
    #[inline(always)]
    pub fn factor(&mut self, fixed: &[bool]) {
        let width = Self::WIDTH;
        let count = fixed.len();
        self.entry.clear();
        self.entry.resize(count * D * width, 0.0);
        self.inverse.resize(count * D, 0.0);
        for (i, rows) in self.entry.chunks_exact_mut(D * width).enumerate() {
            for k in 0..D {
                let row = &mut rows[k * width..(k + 1) * width];
                if fixed[i] {
                    row[0] = 1.0;
                    continue;
                }
                for b in (0..=DEGREE.min(count - 1 - i)).filter(|b| !fixed[i + b]) {
                    for m in if b == 0 { k } else { 0 }..D {
                        row[b * D + m - k] = self.blocks[b][k][m][i];
                    }
                }
            }
        }
        // What the diagonal was before the rows above took from it is needed once the row is reached.
        for (inverse, row) in self.inverse.iter_mut().zip(self.entry.chunks_exact_mut(width)) {
            *inverse = LEAST_PIVOT * row[0];
            row[0] += REGULAR * row[0];
        }
        for i in 0..count * D {
            let (done, rest) = self.entry[i * width..].split_at_mut(width);
            let pivot = done[0];
            let inverse = if pivot > self.inverse[i] { 1.0 / pivot } else { 0.0 };
            self.inverse[i] = inverse;
            for (k, below) in (1..width).zip(rest.chunks_exact_mut(width)) {
                let factor = done[k] * inverse;
                for (x, y) in below.iter_mut().zip(&done[k..]) {
                    *x -= factor * y;
                }
            }
            // Row i of Lᵀ.
            for x in &mut done[1..] {
                *x *= inverse;
            }
        }
    }

    /// Solves in place.
    #[inline(always)]
    pub fn solve(&self, x: &mut [f64]) {
        let width = Self::WIDTH;
        for (i, row) in self.entry.chunks_exact(width).enumerate() {
            let (own, rest) = x[i..].split_at_mut(1);
            for (y, l) in rest.iter_mut().zip(&row[1..]) {
                *y -= l * own[0];
            }
        }
        for (i, row) in self.entry.chunks_exact(width).enumerate().rev() {
            let (own, rest) = x[i..].split_at_mut(1);
            let sum: f64 = rest.iter().zip(&row[1..]).map(|(y, l)| y * l).sum();
            own[0] = own[0] * self.inverse[i] - sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_banded_system_is_solved_with_one_block_fixed() {
        let count = 7;
        let full = |i: usize, j: usize| match i.abs_diff(j) {
            _ if (i / 2).abs_diff(j / 2) >= ORDER => 0.0,
            0 => 4.0 + i as f64,
            1 => -1.0,
            2 => 0.5,
            11 => 0.25,
            _ => 0.0,
        };
        let mut band = Band::<2>::default();
        band.clear(count);
        for b in 0..ORDER {
            for (k, m) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                for (i, entry) in band.block(b, k, m).iter_mut().enumerate() {
                    *entry = full(2 * i + k, 2 * (i + b) + m);
                }
            }
        }
        let mut fixed = [false; 7];
        fixed[3] = true;
        band.factor(&fixed);
        let is_fixed = |i: usize| fixed[i / 2];
        let mut x: Vec<f64> = (0..14).map(|i| if is_fixed(i) { 0.0 } else { i as f64 - 2.0 }).collect();
        let given = x.clone();
        band.solve(&mut x);
        assert_eq!(x[6..8], [0.0; 2]);
        for i in (0..14).filter(|&i| !is_fixed(i)) {
            let sum: f64 = (0..14).map(|j| full(i, j) * x[j]).sum();
            assert!((sum - given[i]).abs() < 1e-11, "{i}");
        }
    }
}
