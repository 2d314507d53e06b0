//! Computes the length of a part by Gauss's rule of eight points, and its parameter u as a function of the length s as a table:
//! between two rows u(s) is the quintic with the u, u' and u'' of both. Panels are halved until quadrature and quintics are
//! accurate.

use super::derivatives::{piece, rate, speed_sq, speeds_sq};
use feedplan_geometry::arc_length::{W, X};
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_planner::problem::Problem;

/// Accuracy of the quadrature of a panel, as a fraction of its length …
const QUADRATURE: f64 = 1e-12;
/// … and of the quintic half-way; the halves that are kept are 64 times as accurate. Near a sharp turn panels are as short as the
/// turn, and the third derivatives need this accuracy relative to such a length.
const QUINTIC: f64 = 1e-7;
/// The greatest error of a quintic that is exact half-way, divided by the error of its rate half-way: for the error (t − ½)(t(1 −
/// t))³.
const ODD: f64 = 0.12;
/// Panels shorter than this fraction of their part are not halved.
const SHORTEST: f64 = 1e-14;
/// Relative rounding error of tangents and parameters.
const ROUNDING: f64 = 4e-15;
/// Greatest number of rows of a table, approximately; beside a turn of 1e-10 of its piece some 700 are used.
const MOST_ROWS: usize = 20_000;
/// Panels are halved at most this often.
const DEPTH: u32 = 48;
/// Number of steps between the samples of the speed |C'| on a part.
const SAMPLES: usize = 8;

/// The part of a piece between two parameters, without a cusp inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    pub piece: usize,
    pub u: [f64; 2],
}

/// One row of a table: u, u' and u'' at a length s from the start of the part.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub s: f64,
    pub u: f64,
    rate: f64,
    bend: f64,
    /// The length to the next row, not computed as a difference of s.
    pub length: f64,
}

/// The length between two parameters of piece `i`, by one Gauss rule of eight points.
pub fn panel<const M: usize>(problem: &Problem<M>, i: usize, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let below = speeds_sq(problem, i, X.map(|x| middle - x * half));
    let above = speeds_sq(problem, i, X.map(|x| middle + x * half));
    let [f0, f1, f2, f3] = std::array::from_fn(|lane| W[lane] * (below[lane].sqrt() + above[lane].sqrt()));
    half * ((f0 + f2) + (f1 + f3))
}

/// The two rows of a table around a length.
pub fn around(rows: &[Row], s: f64) -> [&Row; 2] {
    let i = panel_of(rows, s);
    [&rows[i], &rows[i + 1]]
}

/// The index of the row before a length; never that of the last row.
pub fn panel_of(rows: &[Row], s: f64) -> usize {
    rows[1..rows.len() - 1].partition_point(|row| row.s <= s)
}

impl Row {
    fn new<const M: usize>(problem: &Problem<M>, i: usize, u: f64, s: f64) -> Self {
        let [d, d1, _] = rate(problem, i, u, &derivatives(&piece(problem, i), u));
        Self { s, u, rate: 1.0 / d.sqrt(), bend: -0.5 * d1 / (d * d), length: 0.0 }
    }

    /// du/ds of the quintic at s.
    fn rate_between(&self, next: &Self, s: f64) -> f64 {
        let h = next.s - self.s;
        let t = (s - self.s) / h;
        let r = 1.0 - t;
        30.0 * t * t * r * r * (next.u - self.u) / h
            + self.rate * r * r * (1.0 + 2.0 * t - 15.0 * t * t)
            + next.rate * t * t * (1.0 + 2.0 * r - 15.0 * r * r)
            + 0.5
                * h
                * (self.bend * t * r * r * (2.0 * r - 3.0 * t) + next.bend * t * t * r * (3.0 * r - 2.0 * t))
    }

    /// u of the quintic at s between two rows.
    #[inline]
    pub fn parameter_at(&self, next: &Self, s: f64) -> f64 {
        let h = next.s - self.s;
        let t = if h > 0.0 { (s - self.s) / h } else { 0.0 };
        let (r, t2) = (1.0 - t, t * t);
        let r2 = r * r;
        let left = self.u * (1.0 + 3.0 * t + 6.0 * t2)
            + self.rate * h * t * (1.0 + 3.0 * t)
            + 0.5 * self.bend * h * h * t2;
        let right = next.u * (1.0 + 3.0 * r + 6.0 * r2) - next.rate * h * r * (1.0 + 3.0 * r)
            + 0.5 * next.bend * h * h * r2;
        let u = left * r2 * r + right * t2 * t;
        // Next to a cusp the quintic may leave its range.
        if u >= self.u && u <= next.u {
            u
        } else {
            self.u + t * (next.u - self.u)
        }
    }
}

/// Halves the panels of a part until the quadrature is accurate (for the part's length) and, for its table, until the quintics
/// are accurate as well.
pub struct Halving<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    part: &'a Part,
    /// The length of the part by one panel, and the greatest |C'| of some samples.
    whole: f64,
    fastest: f64,
}

impl<'a, const M: usize> Halving<'a, M> {
    pub fn new(problem: &'a Problem<'a, M>, part: &'a Part) -> Self {
        let ([a, b], i) = (part.u, part.piece);
        let at = |n: usize| a + (b - a) * n as f64 / SAMPLES as f64;
        let inside = [[1, 2, 3, 4], [5, 6, 7, 8]].map(|some| speeds_sq(problem, i, some.map(at)));
        let fastest = inside.into_iter().flatten().fold(speed_sq(problem, i, a), f64::max).sqrt();
        Self { problem, part, whole: panel(problem, i, a, b), fastest }
    }

    /// The rounding error of the length of a panel from a to b: by tangents, relative to the longest tangent, and by b, relative
    /// to b.
    fn noise(&self, [a, b]: [f64; 2], rate: f64) -> f64 {
        ROUNDING * ((b - a) * self.fastest + b / rate)
    }

    /// Whether the length of a panel by its halves agrees with that by the whole panel, or is too short to tell.
    fn is_met(&self, length: f64, whole: f64, noise: f64) -> bool {
        (length - whole).abs() <= QUADRATURE * length + noise || length <= SHORTEST * self.whole
    }

    /// The length of the part.
    pub fn total(&self) -> f64 {
        self.length(self.part.u, self.whole, 0)
    }

    /// The length between two parameters; `whole` is its value by one panel.
    fn length(&self, [a, b]: [f64; 2], whole: f64, depth: u32) -> f64 {
        let middle = 0.5 * (a + b);
        let halves = [[a, middle], [middle, b]];
        let [left, right] = halves.map(|[a, b]| panel(self.problem, self.part.piece, a, b));
        let length = left + right;
        if depth == DEPTH || self.is_met(length, whole, self.noise([a, b], (b - a) / length)) {
            return length;
        }
        self.length(halves[0], left, depth + 1) + self.length(halves[1], right, depth + 1)
    }

    /// The rows of the part's table; the s of the last row is the part's length.
    pub fn table(&self) -> Vec<Row> {
        let [first, last] = self.part.u.map(|u| Row::new(self.problem, self.part.piece, u, 0.0));
        let mut rows = vec![first];
        self.halve(&mut rows, last, self.whole, 0);
        rows
    }

    /// Appends rows for the panel from the last row to the row `to`, whose s is not known yet.
    fn halve(&self, rows: &mut Vec<Row>, to: Row, whole: f64, depth: u32) {
        let (from, b) = (rows[rows.len() - 1], to.u);
        let middle = 0.5 * (from.u + b);
        let [left, right] =
            [(from.u, middle), (middle, b)].map(|(a, b)| panel(self.problem, self.part.piece, a, b));
        let half = Row::new(self.problem, self.part.piece, middle, from.s + left);
        let end = Row { s: from.s + left + right, ..to };
        // On a symmetric part the quintic is exact half-way but wrong on both sides; only its rate shows this.
        let odd = ODD * (end.s - from.s) * (from.rate_between(&end, half.s) - half.rate);
        let mut miss = (from.parameter_at(&end, half.s) - middle).abs().max(odd.abs()) / half.rate;
        let length = left + right;
        if !(from.rate.is_finite() && end.rate.is_finite() && miss.is_finite()) {
            miss = length;
        }
        let noise = self.noise([from.u, b], half.rate) + f64::EPSILON * end.s;
        let met = self.is_met(length, whole, noise)
            && (miss <= QUINTIC * length + noise || length <= SHORTEST * self.whole);
        if met || rows.len() > MOST_ROWS || depth == DEPTH {
            let last = rows.len() - 1;
            rows[last].length = left;
            rows.extend([Row { length: right, ..half }, end]);
        } else {
            self.halve(rows, half, left, depth + 1);
            self.halve(rows, end, right, depth + 1);
        }
    }
}
