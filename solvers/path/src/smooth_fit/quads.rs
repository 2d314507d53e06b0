//! The rows and the energy of four neighbouring intervals, a quad, in the four lanes of SIMD vectors.
//!
//! The intervals j to j + 3 have as their n-th coefficients j + n to j + n + 3. These are neighbours, so they are read and
//! written as one vector.

use std::ops::Range;

use fearless_simd::Simd;
use feedplan_geometry::lanes::four::{Lanes, Register, LANES};

use super::band::Band;
use super::problem::Problem;
use super::rows::Row;
use super::spline::ORDER;

/// Numbers for the six coefficients of each interval of a quad, by axis.
pub type Around<S, const D: usize> = [[Register<S>; D]; ORDER];

/// A number for each coefficient and axis, in the order of the coefficients; beyond the last there are zeros.
#[derive(Clone)]
pub struct Columns<const D: usize>([Vec<Lanes>; D]);

impl<const D: usize> Columns<D> {
    /// Zeros for a number of quads.
    pub fn zeros(quads: usize) -> Self {
        Self(std::array::from_fn(|_| vec![Lanes::ZERO; quads + BEYOND]))
    }

    /// The number of coefficients, with the padding after the last.
    pub fn len(&self) -> usize {
        self.0[0].len() * LANES
    }

    /// Adds to each coefficient i `part(i)` times that of `other`.
    pub fn add_parts(&mut self, other: &Self, part: impl Fn(usize) -> f64) {
        for i in 0..self.len() {
            let part = part(i);
            for k in 0..D {
                self.0[k][i / LANES].values_mut()[i % LANES] +=
                    part * other.0[k][i / LANES].values()[i % LANES];
            }
        }
    }

    pub fn fill(&mut self, value: f64) {
        for column in &mut self.0 {
            column.fill(Lanes::all(value));
        }
    }

    #[inline(always)]
    pub fn set(&mut self, i: usize, k: usize, value: f64) {
        self.0[k][i / LANES].values_mut()[i % LANES] = value;
    }

    #[inline(always)]
    pub fn at(&self, i: usize, k: usize) -> f64 {
        self.0[k][i / LANES].values()[i % LANES]
    }

    #[inline(always)]
    pub fn point(&self, i: usize) -> [f64; D] {
        std::array::from_fn(|k| self.at(i, k))
    }

    /// The six coefficients of each interval of a quad.
    #[inline(always)]
    pub fn around<S: Simd>(&self, simd: S, quad: usize) -> Around<S, D> {
        let mut out = [[Register::all(simd, 0.0); D]; ORDER];
        for k in 0..D {
            let column = &self.0[k][quad..quad + BEYOND + 1];
            let (a, b, c) = (column[0].load(simd), column[1].load(simd), column[2].load(simd));
            out[0][k] = a;
            out[1][k] = a.slide::<1>(b);
            out[2][k] = a.slide::<2>(b);
            out[3][k] = a.slide::<3>(b);
            out[4][k] = b;
            out[5][k] = b.slide::<1>(c);
        }
        out
    }

    /// Adds sums to axis k of the six coefficients of each interval of a quad.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, quad: usize, k: usize, sums: &[Register<S>; ORDER]) {
        let column = &mut self.0[k][quad..quad + BEYOND + 1];
        let given = [column[0].load(simd), column[1].load(simd), column[2].load(simd)];
        let [a, b, c] = plus(simd, given, sums, ORDER);
        (column[0], column[1], column[2]) = (a.into(), b.into(), c.into());
    }
}

/// A quad reads its own vector of a column, which begins with its first coefficients, and this many vectors after it.
pub const BEYOND: usize = 2;

/// Adds the first `count` of the sums to three vectors of a column; the n-th sum belongs to the n-th coefficients of a quad's
/// intervals. The three vectors are read in the same parts in which they were written: a read across two recent writes would have
/// to wait for them.
#[inline(always)]
fn plus<S: Simd>(
    simd: S,
    [mut a, mut b, mut c]: [Register<S>; 3],
    sums: &[Register<S>; ORDER],
    count: usize,
) -> [Register<S>; 3] {
    let zero = Register::all(simd, 0.0);
    a += sums[0];
    if count > 1 {
        a += zero.slide::<3>(sums[1]);
        b += sums[1].slide::<3>(zero);
    }
    if count > 2 {
        a += zero.slide::<2>(sums[2]);
        b += sums[2].slide::<2>(zero);
    }
    if count > 3 {
        a += zero.slide::<1>(sums[3]);
        b += sums[3].slide::<1>(zero);
    }
    if count > 4 {
        b += sums[4];
    }
    if count > 5 {
        b += zero.slide::<3>(sums[5]);
        c += sums[5].slide::<3>(zero);
    }
    [a, b, c]
}

/// One row of each interval of a quad. Where an interval has fewer rows than the others, its lane holds a padding row of weight
/// 0.
#[derive(Clone, Copy)]
pub struct QuadRow<const D: usize> {
    pub basis: [Lanes; ORDER],
    pub direction: [[Lanes; D]; D],
    /// The component of the target along each direction.
    pub target: [Lanes; D],
    pub half: [Lanes; D],
    pub pull: Lanes,
    /// The unit of complementarity of the interval, and 1/unit; both are 0 in a padding row.
    pub unit: Lanes,
    pub per_unit: Lanes,
}

impl<const D: usize> QuadRow<D> {
    /// Padding rows in all lanes.
    const NONE: Self = Self {
        basis: [Lanes::ZERO; ORDER],
        direction: [[Lanes::ZERO; D]; D],
        target: [Lanes::ZERO; D],
        half: [Lanes::ONE; D],
        pull: Lanes::ZERO,
        unit: Lanes::ZERO,
        per_unit: Lanes::ZERO,
    };

    fn set(&mut self, lane: usize, row: &Row<D>, unit: f64) {
        let put = |to: &mut Lanes, value: f64| to.values_mut()[lane] = value;
        for a in 0..ORDER {
            put(&mut self.basis[a], row.basis[a]);
        }
        for r in 0..D {
            for k in 0..D {
                put(&mut self.direction[r][k], row.direction[r][k]);
            }
            put(&mut self.target[r], (0..D).map(|k| row.direction[r][k] * row.target[k]).sum());
            put(&mut self.half[r], row.half[r]);
        }
        put(&mut self.pull, row.pull);
        put(&mut self.unit, unit);
        put(&mut self.per_unit, 1.0 / unit);
    }

    /// The point Σ B x of the curve: its components along the directions of the row.
    #[inline(always)]
    pub fn place<S: Simd>(&self, simd: S, x: &Around<S, D>) -> [Register<S>; D] {
        let mut point = [Register::all(simd, 0.0); D];
        for a in 0..ORDER {
            for k in 0..D {
                point[k] += self.basis[a] * x[a][k];
            }
        }
        let mut place = [Register::all(simd, 0.0); D];
        for r in 0..D {
            for k in 0..D {
                place[r] += self.direction[r][k] * point[k];
            }
        }
        place
    }

    /// Turns a force given along the directions of the row into its components along the axes.
    #[inline(always)]
    pub fn along_axes<S: Simd>(&self, simd: S, force: &[Register<S>; D]) -> [Lanes; D] {
        let mut out = [Lanes::ZERO; D];
        for k in 0..D {
            let mut sum = Register::all(simd, 0.0);
            for r in 0..D {
                sum += self.direction[r][k] * force[r];
            }
            out[k] = sum.into();
        }
        out
    }

    /// Σ weight n nᵀ over the directions n of the row: the entries k ≤ m.
    #[inline(always)]
    pub fn form<S: Simd>(&self, simd: S, weight: &[Register<S>; D]) -> [[Lanes; D]; D] {
        let mut out = [[Lanes::ZERO; D]; D];
        for k in 0..D {
            for m in k..D {
                let mut sum = Register::all(simd, 0.0);
                for r in 0..D {
                    sum += self.direction[r][m] * (self.direction[r][k] * weight[r]);
                }
                out[k][m] = sum.into();
            }
        }
        out
    }
}

/// What a row adds to the matrix and to the gradients, before the factors of the basis functions B.
#[derive(Clone, Copy)]
pub struct Share<const D: usize> {
    /// The matrix gets B Bᵀ times this form: entries k ≤ m.
    pub form: [[Lanes; D]; D],
    /// B times these forces is added to the gradient, its scale, and the terms of the predictor.
    pub forces: [[Lanes; D]; 3],
}

/// The energy and the rows of all intervals, by quads.
pub struct Quads<const D: usize> {
    pub rows: Vec<QuadRow<D>>,
    /// The number of rows before each quad; the last entry is the number of all rows.
    start: Vec<usize>,
    energy: Vec<[[[Lanes; ORDER]; ORDER]; D]>,
    pull: Vec<[[Lanes; ORDER]; D]>,
}

impl<const D: usize> Quads<D> {
    /// The energy and the rows of a problem.
    pub fn new(problem: &Problem<D>) -> Self {
        let Problem { rows, start, energy, pull, unit, .. } = problem;
        let intervals: Vec<usize> = (0..energy.len()).collect();
        let rows_of_quads = Vec::with_capacity(rows.len() / 2);
        let mut out = Self { rows: rows_of_quads, start: vec![0], energy: vec![], pull: vec![] };
        for quad in intervals.chunks(LANES) {
            let own = |j: usize| &rows[start[j]..start[j + 1]];
            let most = quad.iter().map(|&j| own(j).len()).max().unwrap_or(0);
            let first = out.rows.len();
            out.rows.resize(first + most, QuadRow::NONE);
            let mut forms = [[[Lanes::ZERO; ORDER]; ORDER]; D];
            let mut pulls = [[Lanes::ZERO; ORDER]; D];
            for (lane, &j) in quad.iter().enumerate() {
                for (i, row) in own(j).iter().enumerate() {
                    out.rows[first + i].set(lane, row, unit[j]);
                }
                let own = energy[j].as_flattened().as_flattened();
                for (form, own) in forms.as_flattened_mut().as_flattened_mut().iter_mut().zip(own) {
                    form.values_mut()[lane] = *own;
                }
                for (to, own) in pulls.as_flattened_mut().iter_mut().zip(pull[j].as_flattened()) {
                    to.values_mut()[lane] = *own;
                }
            }
            out.start.push(out.rows.len());
            out.energy.push(forms);
            out.pull.push(pulls);
        }
        out
    }

    pub fn count(&self) -> usize {
        self.energy.len()
    }

    /// Storage for the shares of the rows of any one quad.
    pub fn shares(&self) -> Vec<Share<D>> {
        let most = self.start.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        vec![Share { form: [[Lanes::ZERO; D]; D], forces: [[Lanes::ZERO; D]; 3] }; most]
    }

    /// The indices of the rows of a quad.
    pub fn range(&self, quad: usize) -> Range<usize> {
        self.start[quad]..self.start[quad + 1]
    }

    /// Adds the energy of a quad, and the forms of its rows, to the matrix.
    #[inline(always)]
    pub fn add_forms<S: Simd>(&self, simd: S, quad: usize, shares: &[Share<D>], band: &mut Band<D>) {
        for k in 0..D {
            for m in k..D {
                // In two parts, so that the sums fit the registers of the processor.
                self.add_blocks::<S, 0, 2>(simd, quad, shares, [k, m], band);
                self.add_blocks::<S, 2, 4>(simd, quad, shares, [k, m], band);
            }
        }
    }

    /// Adds to the entries (k, m) of the COUNT blocks (i, i + FROM), (i, i + FROM + 1), …
    #[inline(always)]
    fn add_blocks<S: Simd, const FROM: usize, const COUNT: usize>(
        &self,
        simd: S,
        quad: usize,
        shares: &[Share<D>],
        [k, m]: [usize; 2],
        band: &mut Band<D>,
    ) {
        let mut sums = [[Register::all(simd, 0.0); ORDER]; COUNT];
        for (row, share) in self.rows[self.range(quad)].iter().zip(shares) {
            let form = share.form[k][m].load(simd);
            for a in 0..ORDER - FROM {
                let part = row.basis[a] * form;
                for b in FROM..(FROM + COUNT).min(ORDER - a) {
                    sums[b - FROM][a] += row.basis[a + b] * part;
                }
            }
        }
        for b in FROM..FROM + COUNT {
            let sums = &mut sums[b - FROM];
            if k == m {
                for a in 0..ORDER - b {
                    sums[a] += self.energy[quad][k][a][a + b];
                }
            }
            let blocks = &mut band.blocks[quad..quad + BEYOND + 1];
            let given =
                [blocks[0][b][k][m].load(simd), blocks[1][b][k][m].load(simd), blocks[2][b][k][m].load(simd)];
            let [x, y, z] = plus(simd, given, sums, ORDER - b);
            (blocks[0][b][k][m], blocks[1][b][k][m], blocks[2][b][k][m]) = (x.into(), y.into(), z.into());
        }
    }

    /// Adds to `to` the forces of the rows of a quad with this number, of the three in `Share`.
    #[inline(always)]
    pub fn add_forces<S: Simd>(
        &self,
        simd: S,
        quad: usize,
        shares: &[Share<D>],
        number: usize,
        to: &mut Columns<D>,
    ) {
        for k in 0..D {
            let mut sums = [Register::all(simd, 0.0); ORDER];
            for (row, share) in self.rows[self.range(quad)].iter().zip(shares) {
                for a in 0..ORDER {
                    sums[a] += row.basis[a] * share.forces[number][k].load(simd);
                }
            }
            to.add(simd, quad, k, &sums);
        }
    }

    /// Writes Qx − p to `out`; returns ½ xᵀQx.
    #[inline(always)]
    pub fn energy_gradient<S: Simd>(&self, simd: S, x: &Columns<D>, out: &mut Columns<D>) -> f64 {
        out.fill(0.0);
        let zero = Register::all(simd, 0.0);
        let mut twice = zero;
        for (quad, (forms, pull)) in self.energy.iter().zip(&self.pull).enumerate() {
            let x = x.around(simd, quad);
            let mut terms = [[zero; ORDER]; D];
            for a in 0..ORDER {
                for b in 0..ORDER {
                    for k in 0..D {
                        terms[k][a] += forms[k][a][b] * x[b][k];
                    }
                }
                for k in 0..D {
                    twice += terms[k][a] * x[a][k];
                    terms[k][a] = terms[k][a] - pull[k][a].load(simd);
                }
            }
            for k in 0..D {
                out.add(simd, quad, k, &terms[k]);
            }
        }
        0.5 * twice.sum()
    }
}
