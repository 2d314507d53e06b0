//! Cholesky factor L D Lᵀ of the matrix of the fit. The matrix is symmetric and positive definite, in blocks of D unknowns (one
//! coefficient); each block is coupled to five neighbours on either side.
//!
//! Four rows, a tile, are factored together, so that each row below them is read and written once for all four. All rows of a
//! tile are stored from its first column on, so that equal vectors of its rows hold the same columns; the entries before the
//! diagonal are not used.

use fearless_simd::Simd;
use feedplan_geometry::dispatch_four;
use feedplan_geometry::lanes::four::{Lanes, Register, LANES};

use super::spline::ORDER;

/// Added to the diagonal, in parts of it, against the loss by rounding.
const REGULAR: f64 = 1e-13;
/// An unknown whose pivot is below this part of its diagonal entry does not move.
const LEAST_PIVOT: f64 = 1e-15;

/// The entries of a row from the first column of its tile on: 8 D columns are enough for all rows of a tile if D ≥ 2.
type Row<const D: usize> = [[Lanes; D]; 2];

#[derive(Default)]
pub struct Band<const D: usize> {
    /// Entries (k, m), k ≤ m, of the symmetric blocks (i, i + b), by i / 4, b, k and m; the lanes hold four consecutive i, so
    /// that the sums of four consecutive intervals are added as vectors.
    pub blocks: Vec<[[[Lanes; D]; D]; ORDER]>,
    /// The rows of the matrix; after factoring, those of Lᵀ without its diagonal. Rows of zeros follow the last.
    rows: Vec<Row<D>>,
    /// 1/pivot of each row, by tile.
    inverse: Vec<Lanes>,
}

impl<const D: usize> Band<D> {
    const WIDTH: usize = ORDER * D;
    /// The number of vectors of a row.
    const VECTORS: usize = 2 * D;

    /// Sets the matrix to zeros: `vectors` × four rows of blocks.
    pub fn clear(&mut self, vectors: usize) {
        self.blocks.clear();
        self.blocks.resize(vectors, [[[Lanes::ZERO; D]; D]; ORDER]);
    }

    /// Writes the rows. The rows and columns of `fixed` unknowns become those of the unit matrix. `inverse` gets the pivot below
    /// which an unknown does not move.
    fn write(&mut self, fixed: &[bool]) {
        let count = fixed.len();
        let tiles = (count * D).div_ceil(LANES);
        self.inverse.clear();
        self.inverse.resize(tiles, Lanes::ZERO);
        self.rows.clear();
        self.rows.resize((tiles + Self::VECTORS) * LANES, [[Lanes::ZERO; D]; 2]);
        for i in 0..count {
            let blocks = &self.blocks[i / LANES];
            let reach = ORDER.min(count - i);
            let any = fixed[i..i + reach].contains(&true);
            for k in 0..D {
                let (tile, lane) = ((i * D + k) / LANES, (i * D + k) % LANES);
                let row = self.rows[i * D + k].as_flattened_mut();
                if fixed[i] {
                    row[0].values_mut()[lane] = 1.0;
                } else {
                    for b in 0..reach {
                        if any && fixed[i + b] {
                            continue;
                        }
                        for m in if b == 0 { k } else { 0 }..D {
                            let column = lane + b * D + m - k;
                            let entry = blocks[b][k.min(m)][k.max(m)].values()[i % LANES];
                            row[column / LANES].values_mut()[column % LANES] = entry;
                        }
                    }
                }
                let diagonal = &mut row[0].values_mut()[lane];
                self.inverse[tile].values_mut()[lane] = LEAST_PIVOT * *diagonal;
                *diagonal += REGULAR * *diagonal;
            }
        }
    }

    /// Factors the matrix, in which `fixed` unknowns do not move.
    pub fn factor(&mut self, fixed: &[bool]) {
        self.write(fixed);
        dispatch_four!(simd => self.factor_on(simd));
    }

    #[inline(always)]
    fn factor_on<S: Simd>(&mut self, simd: S) {
        for (tile, inverse) in self.inverse.iter_mut().enumerate() {
            let (own, below) =
                self.rows[tile * LANES..].split_first_chunk_mut::<LANES>().expect("zeros after the last");
            // The rows of the tile before the division by their pivots.
            let mut whole = [[[Register::all(simd, 0.0); D]; 2]; LANES];
            for p in 0..LANES {
                let first = *own[p][0][0].values();
                let pivot = first[p];
                let one = if pivot > inverse.values()[p] { 1.0 / pivot } else { 0.0 };
                inverse.values_mut()[p] = one;
                for v in 0..Self::VECTORS {
                    let (half, k) = (v / D, v % D);
                    let x = own[p][half][k].load(simd);
                    whole[p][half][k] = x;
                    own[p][half][k] = (x * one).into();
                    for q in p + 1..LANES {
                        let y = &mut own[q][half][k];
                        *y = (y.load(simd) - x * (first[q] * one)).into();
                    }
                }
                for lane in 0..=p {
                    own[p][0][0].values_mut()[lane] = 0.0;
                }
            }
            // The first vector of a row that lies `from` tiles below holds the same columns as vector `from` of these rows.
            for (i, row) in (LANES..Self::WIDTH + LANES - 1).zip(below) {
                let (from, lane) = (i / LANES, i % LANES);
                let mut parts = [0.0; LANES];
                for p in 0..LANES {
                    parts[p] = own[p].as_flattened()[from].values()[lane];
                }
                for (x, v) in row.as_flattened_mut().iter_mut().zip(from..Self::VECTORS) {
                    let mut rest = x.load(simd);
                    for p in 0..LANES {
                        rest = rest - whole[p].as_flattened()[v] * parts[p];
                    }
                    *x = rest.into();
                }
            }
        }
    }

    /// Solves in place; x is extended by zeros.
    pub fn solve(&self, x: &mut Vec<Lanes>) {
        dispatch_four!(simd => self.solve_on(simd, x));
    }

    #[inline(always)]
    fn solve_on<S: Simd>(&self, simd: S, x: &mut Vec<Lanes>) {
        let tiles = self.inverse.len();
        x.resize(tiles + Self::VECTORS, Lanes::ZERO);
        for tile in 0..tiles {
            let rows = &self.rows[tile * LANES..(tile + 1) * LANES];
            let x = &mut x[tile..tile + Self::VECTORS];
            for p in 0..LANES {
                let own = x[0].values()[p];
                for (x, l) in x.iter_mut().zip(rows[p].as_flattened()) {
                    *x = (x.load(simd) - l.load(simd) * own).into();
                }
            }
        }
        for tile in (0..tiles).rev() {
            let rows = &self.rows[tile * LANES..(tile + 1) * LANES];
            let (own, rest) = x[tile..tile + Self::VECTORS].split_at_mut(1);
            let own = own[0].values_mut();
            // First the contribution of the unknowns of later tiles to all rows of this one.
            let mut sums = [0.0; LANES];
            for p in 0..LANES {
                let mut sum = Register::all(simd, 0.0);
                for (x, l) in rest.iter().zip(&rows[p].as_flattened()[1..]) {
                    sum += x.load(simd) * *l;
                }
                sums[p] = sum.sum();
            }
            for p in (0..LANES).rev() {
                for q in p + 1..LANES {
                    sums[p] += rows[p][0][0].values()[q] * own[q];
                }
                own[p] = own[p] * self.inverse[tile].values()[p] - sums[p];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_banded_system_is_solved_with_one_block_fixed() {
        let full = |i: usize, j: usize| match i.abs_diff(j) {
            _ if (i / 2).abs_diff(j / 2) >= ORDER => 0.0,
            0 => 4.0 + i as f64,
            1 if i / 2 == j / 2 => -1.0,
            2 => 0.5,
            10 => 0.25,
            _ => 0.0,
        };
        let count = 9;
        let mut fixed = [false; 9];
        fixed[3] = true;
        let given = |i: usize| if fixed[i / 2] { 0.0 } else { i as f64 - 2.0 };
        let mut band = Band::<2>::default();
        let mut x: Vec<Lanes> = vec![Lanes::ZERO; 5];
        for i in 0..2 * count {
            x[i / LANES].values_mut()[i % LANES] = given(i);
        }
        // The factor of a greater matrix leaves nothing behind.
        for count in [20, count] {
            band.clear(count.div_ceil(LANES));
            for b in 0..ORDER {
                for (k, m) in [(0, 0), (0, 1), (1, 1)] {
                    for i in 0..count {
                        band.blocks[i / LANES][b][k][m].values_mut()[i % LANES] =
                            full(2 * i + k, 2 * (i + b) + m);
                    }
                }
            }
            let fixed = if count == 9 { &fixed[..] } else { &[false; 20] };
            band.factor(fixed);
        }
        band.solve(&mut x);
        let x: Vec<f64> = x.iter().flat_map(|x| *x.values()).collect();
        assert_eq!(x[6..8], [0.0; 2]);
        for i in (0..2 * count).filter(|&i| !fixed[i / 2]) {
            let sum: f64 = (0..2 * count).map(|j| full(i, j) * x[j]).sum();
            assert!((sum - given(i)).abs() < 1e-11, "{i}");
        }
    }
}
