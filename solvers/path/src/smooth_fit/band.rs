//! Cholesky factor L D Lᵀ of a symmetric positive definite banded matrix, scaled to a unit diagonal.

/// Added to the unit diagonal: what rounding may take from it.
const REGULAR: f64 = 1e-13;
/// A pivot below this is none: its unknown stays where it is.
const LEAST_PIVOT: f64 = 1e-15;

/// Row i holds the entries (i, i) to (i, i + width − 1).
#[derive(Default)]
pub struct Band {
    entry: Vec<f64>,
    width: usize,
    count: usize,
    scale: Vec<f64>,
    /// 1/D.
    inverse: Vec<f64>,
}

impl Band {
    /// An empty matrix of so many unknowns.
    pub fn clear(&mut self, count: usize, width: usize) {
        (self.count, self.width) = (count, width);
        self.entry.clear();
        self.entry.resize(count * width, 0.0);
        self.scale.resize(count, 0.0);
        self.inverse.resize(count, 0.0);
    }

    /// The row of unknown i.
    #[inline(always)]
    pub fn row(&mut self, i: usize) -> &mut [f64] {
        &mut self.entry[i * self.width..(i + 1) * self.width]
    }

    /// Takes unknown i out: its row and column become those of the unit matrix.
    pub fn fix(&mut self, i: usize) {
        let width = self.width;
        self.row(i).fill(0.0);
        self.entry[i * width] = 1.0;
        for back in 1..width.min(i + 1) {
            self.entry[(i - back) * width + back] = 0.0;
        }
    }

    /// Factors the matrix in place.
    pub fn factor(&mut self) {
        let width = self.width;
        for (scale, row) in self.scale.iter_mut().zip(self.entry.chunks_exact(width)) {
            *scale = if row[0] > 0.0 { 1.0 / row[0].sqrt() } else { 0.0 };
        }
        for (i, row) in self.entry.chunks_exact_mut(width).enumerate() {
            let own = self.scale[i];
            for (x, scale) in row.iter_mut().zip(&self.scale[i..]) {
                *x *= own * scale;
            }
            row[0] += REGULAR;
        }
        for i in 0..self.count {
            let (done, rest) = self.entry[i * width..].split_at_mut(width);
            let pivot = done[0];
            let inverse = if pivot > LEAST_PIVOT { 1.0 / pivot } else { 0.0 };
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
    pub fn solve(&self, x: &mut [f64]) {
        let width = self.width;
        for (x, scale) in x.iter_mut().zip(&self.scale) {
            *x *= scale;
        }
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
        for (x, scale) in x.iter_mut().zip(&self.scale) {
            *x *= scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_banded_system_is_solved_with_one_unknown_fixed() {
        let (count, width) = (7, 3);
        let full = |i: usize, j: usize| match i.abs_diff(j) {
            0 => 4.0 + i as f64,
            1 => -1.0,
            2 => 0.5,
            _ => 0.0,
        };
        let mut band = Band::default();
        band.clear(count, width);
        for i in 0..count {
            for k in 0..width.min(count - i) {
                band.row(i)[k] = full(i, i + k);
            }
        }
        band.fix(3);
        band.factor();
        let mut x: Vec<f64> = (0..count).map(|i| if i == 3 { 0.0 } else { i as f64 - 2.0 }).collect();
        let given = x.clone();
        band.solve(&mut x);
        assert_eq!(x[3], 0.0);
        for i in (0..count).filter(|&i| i != 3) {
            let sum: f64 = (0..count).map(|j| full(i, j) * x[j]).sum();
            assert!((sum - given[i]).abs() < 1e-11, "{i}");
        }
    }
}
