//! The followed geometry as the audit sees it: pieces of degree 2 by a start point and two differences, all others
//! by their polygon.
//!
//! The kernels take `M` axes; where there are fewer, the last ones rest at 0 and have nothing to break.

use std::sync::Arc;

use super::hodographs::Hodographs;
use super::polygon::Polygon;
use super::vectors::{length, vector, vector_of};

use super::FEEDS;

/// Pieces joined end to end; see `feedplan.curves.composite.CompositeCurve`.
#[derive(Clone, Copy)]
pub struct Pieces<'a> {
    /// At most as many as the kernels take.
    pub axes: usize,
    /// Coordinates of each control point in `control`: those of the axes, then zeros.
    pub stride: usize,
    /// Control points in mm.
    pub control: &'a [f64],
    /// Of every control point; empty where all pieces are polynomial.
    pub weights: &'a [f64],
    /// Of the pieces in the control points, one more than pieces; they grow by 2 to 10.
    pub offsets: &'a [usize],
    /// Parameter intervals, in mm.
    pub width: &'a [f64],
}

/// The path's arrays, one entry a piece; see `feedplan.Path`.
#[derive(Clone, Copy)]
pub struct Followed<'a> {
    pub pieces: Pieces<'a>,
    /// The greatest of each speed that a feed is about, in mm/s and degrees/s, `FEEDS` numbers a piece; infinite where
    /// it is not limited.
    pub feed: &'a [f64],
    /// Source line.
    pub line: &'a [i32],
    /// First and last program move that the piece follows, two numbers a piece.
    pub moves: &'a [i64],
    /// Allowed distance from the programmed path, in mm.
    pub tolerance: &'a [f64],
    /// Piece offsets of the runs.
    pub runs: &'a [i64],
    /// Of each run: whether its axes mean something else than those of the run before, so that it begins elsewhere.
    pub new_words: &'a [bool],
    /// Pause before the first run, in s.
    pub start_dwell: f64,
    /// Pause after each run, in s.
    pub dwell: &'a [f64],
}

impl<'a> std::ops::Deref for Followed<'a> {
    type Target = Pieces<'a>;

    fn deref(&self) -> &Pieces<'a> {
        &self.pieces
    }
}

impl Followed<'_> {
    /// The feeds of piece `i`.
    pub fn feeds(&self, i: usize) -> [f64; FEEDS] {
        std::array::from_fn(|feed| self.feed[FEEDS * i + feed])
    }

    /// The source line of piece `i`; 0 where there is no such piece.
    pub fn line_of(&self, i: usize) -> i32 {
        self.line.get(i).copied().unwrap_or(0)
    }

    /// Whether piece `i` begins a run whose axes mean something else than before.
    pub fn begins_elsewhere(&self, i: usize) -> bool {
        self.runs.binary_search(&(i as i64)).is_ok_and(|run| self.new_words.get(run) == Some(&true))
    }
}

impl Pieces<'_> {
    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.width.len()
    }

    /// Whether there is nothing to follow.
    pub fn is_empty(&self) -> bool {
        self.width.is_empty()
    }

    /// Where the control points of piece `i` are in the table.
    #[inline]
    pub fn rows(&self, i: usize) -> std::ops::Range<usize> {
        self.offsets[i]..self.offsets[i + 1]
    }

    /// A control point by its row in the table.
    #[inline]
    pub fn point<const M: usize>(&self, row: usize) -> [f64; M] {
        vector(self.control, self.stride, row)
    }

    /// The first control point of piece `i`.
    pub fn start<const M: usize>(&self, i: usize) -> [f64; M] {
        self.point(self.rows(i).start)
    }

    /// The last control point of piece `i`.
    pub fn end<const M: usize>(&self, i: usize) -> [f64; M] {
        self.point(self.rows(i).end - 1)
    }

    /// Whether piece `i` goes nowhere.
    pub fn is_motionless(&self, i: usize) -> bool {
        let rows = self.rows(i);
        let row = |row: usize| &self.control[row * self.stride..(row + 1) * self.stride];
        rows.clone().all(|other| row(other) == row(rows.start))
    }

    /// Piece `i`, ready to be evaluated.
    #[inline]
    pub fn curve<const M: usize>(&self, i: usize) -> Curve<M> {
        let rows = self.rows(i);
        if rows.len() == 3 && self.weights.is_empty() {
            let points = std::array::from_fn(|j| self.point(rows.start + j));
            Curve::Quadratic(Quadratic::new(&points, self.width[i]))
        } else {
            self.general(i)
        }
    }

    #[inline(never)]
    fn general<const M: usize>(&self, i: usize) -> Curve<M> {
        let rows = self.rows(i);
        let weights = if self.weights.is_empty() { &[][..] } else { &self.weights[rows.clone()] };
        let points = rows.map(|row| self.point(row));
        Curve::general(Polygon::new(points, weights), self.width[i])
    }

    /// At least how far `q` is from piece `i`: from the box around its control points.
    pub fn distance_at_least<const M: usize>(&self, i: usize, q: &[f64; M]) -> f64 {
        let (mut least, mut most) = ([f64::INFINITY; M], [f64::NEG_INFINITY; M]);
        for row in self.rows(i) {
            let point = self.point::<M>(row);
            for k in 0..M {
                (least[k], most[k]) = (least[k].min(point[k]), most[k].max(point[k]));
            }
        }
        length::<M>(&std::array::from_fn(|k| (least[k] - q[k]).max(q[k] - most[k]).max(0.0)))
    }
}

/// Pieces made ready one after the other: the last two are kept.
pub struct Curves<'a, const M: usize> {
    pieces: Pieces<'a>,
    kept: [Option<(usize, Arc<Curve<M>>)>; 2],
}

impl<'a, const M: usize> Curves<'a, M> {
    pub fn new(pieces: Pieces<'a>) -> Self {
        Self { pieces, kept: [None, None] }
    }

    pub fn get(&mut self, i: usize) -> &Arc<Curve<M>> {
        let is_kept =
            |kept: &Option<(usize, Arc<Curve<M>>)>| matches!(kept, Some((number, _)) if *number == i);
        let place = self.kept.iter().position(is_kept).unwrap_or_else(|| {
            self.kept.swap(0, 1);
            self.kept[0] = None;
            0
        });
        let (_, curve) = self.kept[place].get_or_insert_with(|| (i, Arc::new(self.pieces.curve(i))));
        curve
    }
}

/// A piece, over u in [0, width].
#[derive(Clone, Debug)]
pub enum Curve<const M: usize> {
    Quadratic(Quadratic<M>),
    General(Box<General<M>>),
}

/// A piece of another degree, or with weights.
#[derive(Clone, Debug)]
pub struct General<const M: usize> {
    pub polygon: Polygon<M>,
    hodographs: Hodographs<M>,
    width: f64,
    per_width: f64,
}

impl<const M: usize> General<M> {
    /// u as parts of the width from both ends.
    fn parts(&self, u: f64) -> (f64, f64) {
        (u * self.per_width, (self.width - u) * self.per_width)
    }
}

impl<const M: usize> Curve<M> {
    pub fn general(polygon: Polygon<M>, width: f64) -> Self {
        let hodographs = Hodographs::new(&polygon);
        Curve::General(Box::new(General { polygon, hodographs, width, per_width: 1.0 / width }))
    }

    /// Length of the parameter interval, in mm.
    #[inline]
    pub fn width(&self) -> f64 {
        match self {
            Curve::Quadratic(curve) => curve.width,
            Curve::General(general) => general.width,
        }
    }

    /// C(u).
    #[inline]
    pub fn at(&self, u: f64) -> [f64; M] {
        match self {
            Curve::Quadratic(curve) => curve.at(u),
            Curve::General(general) => {
                let (t, rest) = general.parts(u);
                general.hodographs.at(t, rest)
            }
        }
    }

    /// The length between two parameters, or somewhat more: that of the control polygon of this part.
    pub fn way_at_most(&self, from: f64, to: f64) -> f64 {
        match self {
            Curve::Quadratic(curve) => {
                0.5 * (to - from) * (length(&curve.derivative(from)) + length(&curve.derivative(to)))
            }
            Curve::General(general) => {
                general.polygon.part(from / general.width, (to - from) / general.width).way()
            }
        }
    }

    /// From one place to another, where the first derivatives are known; short ways lose no digits.
    pub fn way(&self, [from, to]: [f64; 2], slopes: [&[f64; M]; 2]) -> [f64; M] {
        match self {
            Curve::Quadratic(_) => vector_of(|k| 0.5 * (to - from) * (slopes[0][k] + slopes[1][k])),
            Curve::General(_) if from == to => [0.0; M],
            Curve::General(general) => {
                let (least, step) = (from.min(to) / general.width, (to - from) / general.width);
                let way = general.polygon.part(least, step.abs()).chord();
                vector_of(|k| way[k] * step.signum())
            }
        }
    }

    /// C'(u).
    #[inline]
    pub fn derivative(&self, u: f64) -> [f64; M] {
        match self {
            Curve::Quadratic(curve) => curve.derivative(u),
            Curve::General(general) => {
                let (t, rest) = general.parts(u);
                let slope = general.hodographs.slope(t, rest);
                vector_of(|k| slope[k] * general.per_width)
            }
        }
    }

    /// C(u) and C'(u).
    #[inline]
    pub fn place(&self, u: f64) -> [[f64; M]; 2] {
        match self {
            Curve::Quadratic(curve) => [curve.at(u), curve.derivative(u)],
            Curve::General(general) => {
                let (t, rest) = general.parts(u);
                let [point, slope] = general.hodographs.derivatives(t, rest);
                [point, vector_of(|k| slope[k] * general.per_width)]
            }
        }
    }

    /// The first three derivatives at u.
    #[inline]
    pub fn derivatives(&self, u: f64) -> [[f64; M]; 3] {
        match self {
            Curve::Quadratic(curve) => [curve.derivative(u), curve.second_derivative(), [0.0; M]],
            Curve::General(general) => {
                let (t, rest) = general.parts(u);
                let [_, first, second, third] = general.hodographs.derivatives(t, rest);
                by_width([first, second, third], general.per_width)
            }
        }
    }

    /// What the rounding of the first three derivatives is relative to.
    #[inline]
    pub fn derivative_sizes(&self) -> [[f64; M]; 3] {
        match self {
            Curve::Quadratic(curve) => {
                let size = self.derivative_size();
                [size, size.map(|size| size / curve.width), [0.0; M]]
            }
            Curve::General(general) => by_width(*general.hodographs.sizes(), general.per_width),
        }
    }

    /// The greatest lengths of the second to the fifth derivative; infinite on pieces with weights.
    pub fn bounds(&self) -> [f64; 4] {
        match self {
            Curve::Quadratic(curve) => [length(&curve.second_derivative()), 0.0, 0.0, 0.0],
            Curve::General(general) => {
                let mut scale = 1.0 / general.width;
                general.hodographs.bounds().map(|bound| {
                    scale /= general.width;
                    bound * scale
                })
            }
        }
    }

    /// For each axis what the rounding of C' is relative to.
    pub fn derivative_size(&self) -> [f64; M] {
        match self {
            Curve::Quadratic(curve) => {
                let scale = 2.0 / curve.width;
                vector_of(|k| scale * (curve.first[k].abs() + curve.second[k].abs()))
            }
            Curve::General(general) => {
                let [size, ..] = general.hodographs.sizes();
                vector_of(|k| size[k] * general.per_width)
            }
        }
    }

    /// How much the rounding of the control points turns C' against that of a neighbour, per 1 mm/mm.
    pub fn derivative_scale(&self) -> f64 {
        match self {
            Curve::Quadratic(curve) => 2.0 / curve.width,
            Curve::General(general) => general.polygon.slope_scale() / general.width,
        }
    }

    /// Greatest coordinate: what rounding is relative to.
    #[inline]
    pub fn magnitude(&self) -> f64 {
        match self {
            Curve::Quadratic(curve) => curve.magnitude(),
            Curve::General(general) => general.polygon.magnitude(),
        }
    }

    /// How much more shape the piece can have than one of degree 2.
    pub fn turns(&self) -> usize {
        match self {
            Curve::Quadratic(_) => 1,
            Curve::General(general) => general.polygon.degree(),
        }
    }

    /// Least and greatest position of an axis between the ends.
    pub fn extremes(&self, axis: usize) -> [f64; 2] {
        match self {
            Curve::Quadratic(curve) => [curve.turn(axis); 2],
            Curve::General(general) => general.polygon.extremes(axis),
        }
    }
}

/// Derivatives by t to those by u.
#[inline(always)]
fn by_width<const M: usize>(mut derivatives: [[f64; M]; 3], per_width: f64) -> [[f64; M]; 3] {
    let mut scale = 1.0;
    for derivative in &mut derivatives {
        scale *= per_width;
        for x in derivative {
            *x *= scale;
        }
    }
    derivatives
}

/// C(t) = start + t (2 first + t (second − first)) with t = u / width.
#[derive(Clone, Copy, Debug)]
pub struct Quadratic<const M: usize> {
    pub start: [f64; M],
    /// From the first control point to the second, and from the second to the third.
    pub first: [f64; M],
    pub second: [f64; M],
    pub width: f64,
}

impl<const M: usize> Quadratic<M> {
    pub fn new(points: &[[f64; M]; 3], width: f64) -> Self {
        Self {
            start: points[0],
            first: std::array::from_fn(|k| points[1][k] - points[0][k]),
            second: std::array::from_fn(|k| points[2][k] - points[1][k]),
            width,
        }
    }

    /// C(u).
    #[inline]
    pub fn at(&self, u: f64) -> [f64; M] {
        let t = u / self.width;
        std::array::from_fn(|k| {
            self.start[k] + t * (2.0 * self.first[k] + t * (self.second[k] - self.first[k]))
        })
    }

    /// C'(u), counted from the nearer end so that both ends are exact.
    #[inline]
    pub fn derivative(&self, u: f64) -> [f64; M] {
        let t = u / self.width;
        let scale = 2.0 / self.width;
        if t <= 0.5 {
            std::array::from_fn(|k| scale * (self.first[k] + t * (self.second[k] - self.first[k])))
        } else {
            let rest = (self.width - u) / self.width;
            std::array::from_fn(|k| scale * (self.second[k] + rest * (self.first[k] - self.second[k])))
        }
    }

    /// C'', the same everywhere on the piece.
    #[inline]
    pub fn second_derivative(&self) -> [f64; M] {
        let scale = 2.0 / (self.width * self.width);
        std::array::from_fn(|k| scale * (self.second[k] - self.first[k]))
    }

    /// Greatest coordinate: what rounding is relative to.
    #[inline]
    pub fn magnitude(&self) -> f64 {
        let mut most = 0.0_f64;
        for k in 0..M {
            most = most.max(self.start[k].abs()).max((self.start[k] + self.first[k] + self.second[k]).abs());
        }
        most
    }

    /// Where an axis turns; its start where it does not.
    fn turn(&self, k: usize) -> f64 {
        let turn = self.first[k] / (self.first[k] - self.second[k]);
        self.start[k] + if turn > 0.0 && turn < 1.0 { turn * self.first[k] } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parabola() -> Quadratic<2> {
        Quadratic::new(&[[0.0, 0.0], [1.0, 2.0], [3.0, 0.0]], 4.0)
    }

    #[test]
    fn the_middle_is_the_mean_of_the_polygon_middles() {
        assert_eq!(parabola().at(2.0), [1.25, 1.0]);
        assert_eq!(parabola().at(4.0), [3.0, 0.0]);
    }

    #[test]
    fn derivatives_agree_with_difference_quotients() {
        let curve = parabola();
        for u in [0.5, 1.9, 2.1, 3.5] {
            let (before, after) = (curve.at(u - 1e-5), curve.at(u + 1e-5));
            let (left, right) = (curve.derivative(u - 1e-5), curve.derivative(u + 1e-5));
            for k in 0..2 {
                assert!((curve.derivative(u)[k] - (after[k] - before[k]) / 2e-5).abs() < 1e-9);
                assert!((curve.second_derivative()[k] - (right[k] - left[k]) / 2e-5).abs() < 1e-9);
            }
        }
    }
}
