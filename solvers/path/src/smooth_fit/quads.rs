//! The rows of four neighbouring intervals, a quad, side by side in the lanes of the processor's vectors.
//!
//! The n-th coefficients that the four intervals see are neighbours, so that they are read and written as one vector.

use std::ops::Range;

use fearless_simd::Simd;
use feedplan_geometry::lanes::four::{Lanes, Register, LANES};

use super::band::Band;
use super::problem::Problem;
use super::rows::Row;
use super::spline::ORDER;

/// Numbers for the coefficients that the intervals of a quad see, by axis.
pub type Around<S, const D: usize> = [[Register<S>; D]; ORDER];

/// A number for each coefficient and axis, in the order of the coefficients; beyond the last there are zeros.
#[derive(Clone)]
pub struct Columns<const D: usize>([Vec<f64>; D]);

impl<const D: usize> Columns<D> {
    /// Zeros for so many quads.
    pub fn zeros(quads: usize) -> Self {
        Self(std::array::from_fn(|_| vec![0.0; quads * LANES + ORDER]))
    }

    pub fn set(&mut self, points: &[[f64; D]]) {
        for (i, point) in points.iter().enumerate() {
            for k in 0..D {
                self.0[k][i] = point[k];
            }
        }
    }

    /// Coefficients, those beyond the last included.
    pub fn len(&self) -> usize {
        self.0[0].len()
    }

    /// Adds to each coefficient a part of that of the other.
    pub fn add_parts(&mut self, other: &Self, part: impl Fn(usize) -> f64) {
        for i in 0..self.len() {
            let part = part(i);
            for (column, other) in self.0.iter_mut().zip(&other.0) {
                column[i] += part * other[i];
            }
        }
    }

    pub fn fill(&mut self, value: f64) {
        for column in &mut self.0 {
            column.fill(value);
        }
    }

    #[inline(always)]
    pub fn point(&self, i: usize) -> [f64; D] {
        std::array::from_fn(|k| self.0[k][i])
    }

    /// The coefficients that the intervals of a quad see.
    #[inline(always)]
    pub fn around<S: Simd>(&self, simd: S, quad: usize) -> Around<S, D> {
        let mut out = [[Register::all(simd, 0.0); D]; ORDER];
        for a in 0..ORDER {
            for k in 0..D {
                out[a][k] = four(&self.0[k], quad * LANES + a).load(simd);
            }
        }
        out
    }

    /// Adds to the coefficients that the intervals of a quad see.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, quad: usize, terms: &Around<S, D>) {
        for a in 0..ORDER {
            for k in 0..D {
                add_four(&mut self.0[k], quad * LANES + a, terms[a][k]);
            }
        }
    }
}

#[inline(always)]
fn four(column: &[f64], at: usize) -> Lanes {
    Lanes::new(column[at..at + LANES].try_into().expect("four numbers"))
}

#[inline(always)]
fn add_four<S: Simd>(column: &mut [f64], at: usize, terms: Register<S>) {
    let sum = terms + four(column, at);
    column[at..at + LANES].copy_from_slice(&sum.values());
}

/// A row of each interval of a quad. Where one has fewer rows than the others, its lane holds a row of no weight.
#[derive(Clone, Copy)]
pub struct QuadRow<const D: usize> {
    pub basis: [Lanes; ORDER],
    pub direction: [[Lanes; D]; D],
    /// Where the target lies in each direction.
    pub target: [Lanes; D],
    pub half: [Lanes; D],
    pub pull: Lanes,
    /// The unit of complementarity in the interval, and 1/unit; both 0 for a row of no weight.
    pub unit: Lanes,
    pub per_unit: Lanes,
}

impl<const D: usize> QuadRow<D> {
    /// All of no weight.
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

    /// The place of Σ B x in the directions of the row.
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

    /// Adds a force in the directions of the row to the coefficients.
    #[inline(always)]
    pub fn push<S: Simd>(&self, simd: S, force: &[Register<S>; D], sums: &mut Around<S, D>) {
        let mut push = [Register::all(simd, 0.0); D];
        for r in 0..D {
            for k in 0..D {
                push[k] += self.direction[r][k] * force[r];
            }
        }
        for a in 0..ORDER {
            for k in 0..D {
                sums[a][k] += self.basis[a] * push[k];
            }
        }
    }
}

/// The matrices of the intervals of a quad: blocks (a, b) with a ≤ b, of which each is symmetric: entries k ≤ m.
pub struct LocalMatrix<const D: usize>([[[[Lanes; D]; D]; ORDER]; ORDER]);

impl<const D: usize> LocalMatrix<D> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self([[[[Lanes::ZERO; D]; D]; ORDER]; ORDER])
    }

    /// Adds Σ weight n nᵀ B Bᵀ of a row with directions n.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, row: &QuadRow<D>, weight: &[Register<S>; D]) {
        let mut form = [[Register::all(simd, 0.0); D]; D];
        for r in 0..D {
            for k in 0..D {
                let share = row.direction[r][k] * weight[r];
                for m in k..D {
                    form[k][m] += row.direction[r][m] * share;
                }
            }
        }
        for a in 0..ORDER {
            for k in 0..D {
                for m in k..D {
                    let part = row.basis[a] * form[k][m];
                    for b in a..ORDER {
                        let entry = &mut self.0[a][b][k][m];
                        *entry = (row.basis[b] * part + *entry).into();
                    }
                }
            }
        }
    }
}

/// The energy and the rows of all intervals, four intervals side by side.
pub struct Quads<const D: usize> {
    pub rows: Vec<QuadRow<D>>,
    /// The number of rows before each quad, and all of them.
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

    /// The rows of a quad.
    pub fn range(&self, quad: usize) -> Range<usize> {
        self.start[quad]..self.start[quad + 1]
    }

    /// Adds the energy of a quad and the matrix of its rows to that of all.
    #[inline(always)]
    pub fn add_to<S: Simd>(&self, simd: S, quad: usize, local: &LocalMatrix<D>, band: &mut Band<D>) {
        for a in 0..ORDER {
            for b in a..ORDER {
                for k in 0..D {
                    for m in if a == b { k } else { 0 }..D {
                        let mut entry = local.0[a][b][k.min(m)][k.max(m)].load(simd);
                        if k == m {
                            entry += self.energy[quad][k][a][b];
                        }
                        add_four(band.block(b - a, k, m), quad * LANES + a, entry);
                    }
                }
            }
        }
    }

    /// Qx − p, and the energy ½ xᵀQx.
    #[inline(always)]
    pub fn energy_gradient<S: Simd>(&self, simd: S, x: &Columns<D>, out: &mut Columns<D>) -> f64 {
        out.fill(0.0);
        let zero = Register::all(simd, 0.0);
        let mut twice = zero;
        for (quad, (forms, pull)) in self.energy.iter().zip(&self.pull).enumerate() {
            let x = x.around(simd, quad);
            let mut terms = [[zero; D]; ORDER];
            for a in 0..ORDER {
                for b in 0..ORDER {
                    for k in 0..D {
                        terms[a][k] += forms[k][a][b] * x[b][k];
                    }
                }
                for k in 0..D {
                    twice += terms[a][k] * x[a][k];
                    terms[a][k] = terms[a][k] - pull[k][a].load(simd);
                }
            }
            out.add(quad, &terms);
        }
        0.5 * twice.sum()
    }
}
