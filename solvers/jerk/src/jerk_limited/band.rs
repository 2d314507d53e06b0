//! LDLᵀ factor of the Newton matrix, a symmetric banded matrix: two unknowns (w, w') per station, coupled with those of
//! the neighbouring stations.
//!
//! The matrix is scaled to a unit diagonal. The two unknowns of an end are tied to each other (w' = k w, where a ramp leads to
//! rest), have given steps (where w and w' are given), or are free.
//!
//! The elimination of a station needs the result of the one eliminated before it. Elimination therefore runs from both ends to
//! the station in the middle, and back substitution from there to both ends: two independent chains that the processor overlaps.

use fearless_simd::Simd;

use super::columns::{store, Columns};
use super::forms::Local;
use feedplan_geometry::lanes::eight::{Register, LANES};

/// How the unknowns of an end may change.
#[derive(Clone, Copy, Debug)]
pub enum EndCondition {
    /// dw' = k dw.
    Slope(f64),
    /// dw and dw' are given with each right-hand side.
    Given,
    Free,
}

/// Added to the unit diagonal, because rounding errors may reduce it by this much.
const REGULAR: f64 = 1e-13;

/// The block [a b; b c] of each station, in columns.
type Diagonal = [Vec<f64>; 3];

/// The matrix and, after `factor`, its factor.
#[derive(Default)]
pub struct Band {
    intervals: usize,
    /// The terms of each interval in the blocks of the stations where it starts and where it ends.
    start: Diagonal,
    end: Diagonal,
    /// Rows of the block that couples station i with station i + 1: 00 01 10 11; scaled by `factor`.
    coupling: [Vec<f64>; 4],
    conditions: Option<[EndCondition; 2]>,
    /// Couplings of the given ends with their neighbours.
    given: [[f64; 4]; 2],
    scale: Columns,
    /// b of each block, scaled.
    inner: Vec<f64>,
    pivots: Vec<Pivot>,
    work: Vec<[f64; 2]>,
}

/// The factor at a station.
#[derive(Clone, Copy, Default)]
struct Pivot {
    per_d0: f64,
    l: f64,
    per_d1: f64,
    /// The rows of L that couple the station eliminated next with this one: 00 01 10 11.
    rows: [f64; 4],
}

impl Pivot {
    /// Eliminates the station with the block [1 inner; inner 1] − `less`, where `less` (00 01 11) comes from the stations
    /// eliminated before. `o` couples it with the station eliminated next. Returns its factor and the `less` of that next
    /// station, or None if the matrix is not positive definite.
    #[inline(always)]
    fn new(inner: f64, less: [f64; 3], o: [f64; 4]) -> Option<(Self, [f64; 3])> {
        let d0 = 1.0 + REGULAR - less[0];
        let b = inner - less[1];
        let per_d0 = 1.0 / d0;
        let l = b * per_d0;
        let d1 = 1.0 + REGULAR - less[2] - b * l;
        let per_d1 = 1.0 / d1;
        let (y00, y10) = (o[0], o[1]);
        let (y01, y11) = (o[2] - l * y00, o[3] - l * y10);
        let rows = [y00 * per_d0, y01 * per_d1, y10 * per_d0, y11 * per_d1];
        let less =
            [y00 * rows[0] + y01 * rows[1], y00 * rows[2] + y01 * rows[3], y10 * rows[2] + y11 * rows[3]];
        (d0 > 0.0 && d1 > 0.0).then_some((Self { per_d0, l, per_d1, rows }, less))
    }

    /// Forward substitution: what this station, with the values z, subtracts from the right-hand side of the next station.
    #[inline(always)]
    fn takes(&self, z: [f64; 2]) -> [f64; 2] {
        let m = &self.rows;
        [m[0] * z[0] + m[1] * z[1], m[2] * z[0] + m[3] * z[1]]
    }

    /// Forward substitution: the values of this station, from its right-hand side z and what the stations before it subtract.
    #[inline(always)]
    fn forward(&self, z: [f64; 2], less: [f64; 2]) -> [f64; 2] {
        let a = z[0] - less[0];
        [a, z[1] - less[1] - self.l * a]
    }

    /// Backward substitution, where `next` is the solution at the station eliminated next.
    #[inline(always)]
    fn backward(&self, z: [f64; 2], next: [f64; 2]) -> [f64; 2] {
        let m = &self.rows;
        let b = z[1] * self.per_d1 - (m[1] * next[0] + m[3] * next[1]);
        [z[0] * self.per_d0 - (m[0] * next[0] + m[2] * next[1]) - self.l * b, b]
    }
}

impl Band {
    /// Sizes the matrix for a window of `intervals` intervals.
    pub fn resize(&mut self, intervals: usize) {
        self.intervals = intervals;
        let length = (intervals.div_ceil(LANES) + 1) * LANES;
        for column in self.start.iter_mut().chain(&mut self.end).chain(&mut self.coupling) {
            column.resize(length, 0.0);
        }
        for column in &mut self.end {
            column[0] = 0.0;
        }
        self.scale.resize(intervals, 1.0);
        self.inner.resize(intervals + 1, 0.0);
        self.pivots.resize(intervals + 1, Pivot::default());
        self.work.resize(intervals + 1, [0.0; 2]);
    }

    pub fn intervals(&self) -> usize {
        self.intervals
    }

    /// Sets the terms of a block of intervals of length h, in its local coefficients (w, h w') at both ends.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, block: usize, h: Register<S>, Local { matrix: m, .. }: &Local<S>) {
        let at = block * LANES;
        let h2 = h * h;
        store(&mut self.start[0], at, m[0][0]);
        store(&mut self.start[1], at, m[0][1] * h);
        store(&mut self.start[2], at, m[1][1] * h2);
        store(&mut self.end[0], at + 1, m[2][2]);
        store(&mut self.end[1], at + 1, m[2][3] * h);
        store(&mut self.end[2], at + 1, m[3][3] * h2);
        store(&mut self.coupling[0], at, m[0][2]);
        store(&mut self.coupling[1], at, m[0][3] * h);
        store(&mut self.coupling[2], at, m[1][2] * h);
        store(&mut self.coupling[3], at, m[1][3] * h2);
    }

    /// Sets the terms of lanes beyond the last interval to 0.
    #[inline(always)]
    pub fn close(&mut self) {
        for column in &mut self.start {
            column[self.intervals..].fill(0.0);
        }
    }

    /// Adds to the diagonal element of w at a station.
    pub fn add(&mut self, station: usize, term: f64) {
        self.start[0][station] += term;
    }

    /// Factors the matrix under both end conditions; false if it is not positive definite.
    #[inline(always)]
    pub fn factor(&mut self, conditions: [EndCondition; 2]) -> bool {
        self.conditions = Some(conditions);
        self.apply(conditions);
        self.rescale();
        let (last, middle) = (self.intervals, self.intervals / 2);
        let o = &self.coupling;
        let (mut up, mut down) = ([0.0; 3], [0.0; 3]);
        // Station j is as far from the last station as station i is from the first.
        for i in 0..last - middle {
            let j = last - i;
            let back = [o[0][j - 1], o[2][j - 1], o[1][j - 1], o[3][j - 1]];
            let Some((pivot, less)) = Pivot::new(self.inner[j], down, back) else { return false };
            (self.pivots[j], down) = (pivot, less);
            if i < middle {
                let on = [o[0][i], o[1][i], o[2][i], o[3][i]];
                let Some((pivot, less)) = Pivot::new(self.inner[i], up, on) else { return false };
                (self.pivots[i], up) = (pivot, less);
            }
        }
        let less = [up[0] + down[0], up[1] + down[1], up[2] + down[2]];
        let Some((pivot, _)) = Pivot::new(self.inner[middle], less, [0.0; 4]) else { return false };
        self.pivots[middle] = pivot;
        true
    }

    /// Scales the matrix to a unit diagonal. A diagonal element that is not positive leads to NaN, which `Pivot::new` refuses.
    #[inline(always)]
    fn rescale(&mut self) {
        let count = self.intervals + 1;
        for (scale, k) in [(&mut self.scale.w, 0), (&mut self.scale.slope, 2)] {
            for ((scale, start), end) in scale[..count].iter_mut().zip(&self.start[k]).zip(&self.end[k]) {
                *scale = 1.0 / (start + end).sqrt();
            }
        }
        let (s0, s1) = (&self.scale.w[..count], &self.scale.slope[..count]);
        let inner = self.inner.iter_mut().zip(self.start[1].iter().zip(&self.end[1]));
        for ((inner, (start, end)), (s0, s1)) in inner.zip(s0.iter().zip(s1)) {
            *inner = (start + end) * s0 * s1;
        }
        for (column, (from, to)) in self.coupling.iter_mut().zip([(s0, s0), (s0, s1), (s1, s0), (s1, s1)]) {
            for (o, (from, to)) in column.iter_mut().zip(from.iter().zip(&to[1..])) {
                *o *= from * to;
            }
        }
    }

    #[inline(always)]
    fn apply(&mut self, conditions: [EndCondition; 2]) {
        let last = self.intervals;
        for (end, condition) in conditions.into_iter().enumerate() {
            let (station, link) = if end == 0 { (0, 0) } else { (last, last - 1) };
            let [a, b, c] = [0, 1, 2].map(|k| self.start[k][station] + self.end[k][station]);
            let o = [0, 1, 2, 3].map(|k| self.coupling[k][link]);
            let (block, coupling) = match condition {
                EndCondition::Slope(k) => (
                    [a + 2.0 * k * b + k * k * c, 0.0, 1.0],
                    if end == 0 {
                        [o[0] + k * o[2], o[1] + k * o[3], 0.0, 0.0]
                    } else {
                        [o[0] + k * o[1], 0.0, o[2] + k * o[3], 0.0]
                    },
                ),
                EndCondition::Given => {
                    self.given[end] = o;
                    ([1.0, 0.0, 1.0], [0.0; 4])
                }
                EndCondition::Free => ([a, b, c], o),
            };
            for k in 0..3 {
                (self.start[k][station], self.end[k][station]) = (block[k], 0.0);
            }
            for k in 0..4 {
                self.coupling[k][link] = coupling[k];
            }
        }
    }

    /// Solves for the step `out` with right-hand side `rhs`; `ends` holds the given steps.
    pub fn solve(&mut self, rhs: &Columns, ends: [[f64; 2]; 2], out: &mut Columns) {
        let conditions = self.conditions.expect("the matrix is factored first");
        let last = self.intervals;
        for (z, (w, slope)) in self.work.iter_mut().zip(rhs.w.iter().zip(&rhs.slope)) {
            *z = [*w, *slope];
        }
        for (end, condition) in conditions.into_iter().enumerate() {
            let (station, next) = if end == 0 { (0, 1) } else { (last, last - 1) };
            match condition {
                EndCondition::Slope(k) => {
                    let [a, b] = self.work[station];
                    self.work[station] = [a + k * b, 0.0];
                }
                EndCondition::Given => {
                    let (o, d) = (self.given[end], ends[end]);
                    let pull = if end == 0 {
                        [o[0] * d[0] + o[2] * d[1], o[1] * d[0] + o[3] * d[1]]
                    } else {
                        [o[0] * d[0] + o[1] * d[1], o[2] * d[0] + o[3] * d[1]]
                    };
                    self.work[next][0] -= pull[0];
                    self.work[next][1] -= pull[1];
                    self.work[station] = d;
                }
                EndCondition::Free => {}
            }
        }
        self.substitute();
        for (i, z) in self.work.iter().enumerate() {
            (out.w[i], out.slope[i]) = (z[0] * self.scale.w[i], z[1] * self.scale.slope[i]);
        }
        for (end, condition) in conditions.into_iter().enumerate() {
            let station = if end == 0 { 0 } else { last };
            match condition {
                EndCondition::Slope(k) => out.slope[station] = k * out.w[station],
                EndCondition::Given => [out.w[station], out.slope[station]] = ends[end],
                EndCondition::Free => {}
            }
        }
    }

    /// Forward and backward substitution in scaled unknowns.
    fn substitute(&mut self) {
        let (last, middle) = (self.intervals, self.intervals / 2);
        let (work, pivots) = (&mut self.work[..=last], &self.pivots[..=last]);
        let scaled = |z: [f64; 2], i: usize| [z[0] * self.scale.w[i], z[1] * self.scale.slope[i]];
        let (mut up, mut down) = ([0.0; 2], [0.0; 2]);
        for i in 0..last - middle {
            let j = last - i;
            work[j] = pivots[j].forward(scaled(work[j], j), down);
            down = pivots[j].takes(work[j]);
            if i < middle {
                work[i] = pivots[i].forward(scaled(work[i], i), up);
                up = pivots[i].takes(work[i]);
            }
        }
        let less = [up[0] + down[0], up[1] + down[1]];
        let own = pivots[middle].forward(scaled(work[middle], middle), less);
        work[middle] = pivots[middle].backward(own, [0.0; 2]);
        (up, down) = (work[middle], work[middle]);
        for i in 1..=last - middle {
            let j = middle + i;
            down = pivots[j].backward(work[j], down);
            work[j] = down;
            if i <= middle {
                let i = middle - i;
                up = pivots[i].backward(work[i], up);
                work[i] = up;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix of five stations, and its product with a step.
    fn example() -> (Band, impl Fn(&[f64]) -> Vec<f64>) {
        let diagonal: Vec<[f64; 3]> = (0..5).map(|i| [4.0 + i as f64, 0.5, 3.0]).collect();
        let coupling: Vec<[f64; 4]> = (0..4).map(|i| [0.7, -0.2 * i as f64, 0.4, -0.3]).collect();
        let mut band = Band::default();
        band.resize(4);
        for k in 0..3 {
            for (i, block) in diagonal.iter().enumerate() {
                // Any split of the block between the two neighbouring intervals.
                band.start[k][i] = block[k] - 0.1;
                band.end[k][i] = 0.1;
            }
        }
        for k in 0..4 {
            for (i, block) in coupling.iter().enumerate() {
                band.coupling[k][i] = block[k];
            }
        }
        let product = move |d: &[f64]| {
            let mut out = vec![0.0; d.len()];
            for (i, [a, b, c]) in diagonal.iter().enumerate() {
                out[2 * i] += a * d[2 * i] + b * d[2 * i + 1];
                out[2 * i + 1] += b * d[2 * i] + c * d[2 * i + 1];
            }
            for (i, o) in coupling.iter().enumerate() {
                for (row, column, value) in [(0, 2, o[0]), (0, 3, o[1]), (1, 2, o[2]), (1, 3, o[3])] {
                    out[2 * i + row] += value * d[2 * i + column];
                    out[2 * i + column] += value * d[2 * i + row];
                }
            }
            out
        };
        (band, product)
    }

    fn solved(conditions: [EndCondition; 2], ends: [[f64; 2]; 2]) -> (Vec<f64>, Vec<f64>) {
        let (mut band, product) = example();
        assert!(band.factor(conditions));
        let rhs: Vec<f64> = (0..10).map(|i| (i as f64).sin()).collect();
        let (mut d, mut out) = (vec![0.0; 10], Columns::default());
        out.resize(4, 0.0);
        band.solve(&Columns::new(&rhs), ends, &mut out);
        out.give(&mut d);
        let left = product(&d).iter().zip(&rhs).map(|(a, b)| a - b).collect();
        (d, left)
    }

    #[test]
    fn given_ends_keep_their_steps_and_all_others_solve_their_equations() {
        let ends = [[0.3, -0.1], [0.2, 0.5]];
        let (d, left) = solved([EndCondition::Given, EndCondition::Given], ends);
        assert_eq!((d[0], d[1], d[8], d[9]), (0.3, -0.1, 0.2, 0.5));
        assert!(left[2..8].iter().all(|left| left.abs() < 1e-11), "{left:?}");
    }

    #[test]
    fn tied_ends_keep_their_slope() {
        let (d, left) = solved([EndCondition::Slope(2.0), EndCondition::Slope(-3.0)], [[0.0; 2]; 2]);
        assert_eq!((d[1], d[9]), (2.0 * d[0], -3.0 * d[8]));
        assert!(left[2..8].iter().all(|left| left.abs() < 1e-11), "{left:?}");
        // The two equations of an end add up along its slope.
        assert!((left[0] + 2.0 * left[1]).abs() < 1e-11 && (left[8] - 3.0 * left[9]).abs() < 1e-11);
    }

    #[test]
    fn free_ends_solve_their_equations() {
        let (_, left) = solved([EndCondition::Free; 2], [[0.0; 2]; 2]);
        assert!(left.iter().all(|left| left.abs() < 1e-11), "{left:?}");
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut band = Band::default();
        band.resize(1);
        for (column, value) in band.start.iter_mut().zip([1.0, 2.0, 1.0]) {
            column[..2].fill(value);
        }
        assert!(!band.factor([EndCondition::Slope(-1.0), EndCondition::Slope(-1.0)]));
    }
}
