//! The followed path: pieces by their control polygons, their positions and derivatives at a parameter u in mm.
//!
//! The kernels take `M` axes; where the machine has fewer, the last ones rest at 0 and cannot break a limit.

use std::rc::Rc;

use super::hodographs::Hodographs;
use super::number::{inner, scaled, Number};
use super::polygon::Polygon;
use super::vectors::{curvature, length, vector, vector_of};

use super::FEEDS;

/// Pieces joined end to end; see `feedplan.curves.composite.CompositeCurve`.
#[derive(Clone, Copy)]
pub struct Pieces<'a> {
    /// At most `M`.
    pub axes: usize,
    /// Numbers per control point in `control`: the coordinates of the axes, then zeros.
    pub stride: usize,
    /// Control points in mm.
    pub control: &'a [f64],
    /// One of each control point; empty where all pieces are polynomial.
    pub weights: &'a [f64],
    /// First control point of each piece, and the number of control points; a piece has 2 to 10.
    pub offsets: &'a [usize],
    /// Lengths of the parameter intervals, in mm.
    pub width: &'a [f64],
}

/// The arrays of the path, one entry for each piece; see `feedplan.Path`.
#[derive(Clone, Copy)]
pub struct Followed<'a> {
    pub pieces: Pieces<'a>,
    /// The greatest speed of each kind of feed, in mm/s and degrees/s, `FEEDS` numbers for each piece; infinite where it is not
    /// limited.
    pub feed: &'a [f64],
    /// Source line.
    pub line: &'a [i32],
    /// First and last program move that the piece follows, two numbers for each piece.
    pub moves: &'a [i64],
    /// Allowed distance from the programmed path, in mm.
    pub tolerance: &'a [f64],
    /// First piece of each run, and the number of pieces.
    pub runs: &'a [i64],
    /// For each run: whether its axes have another meaning than in the run before, so that its first piece may start at another
    /// point.
    pub new_words: &'a [bool],
    /// Pause before the first run, in s.
    pub start_dwell: f64,
    /// Pause after each run, in s.
    pub dwell: &'a [f64],
}

#[cfg(test)]
impl<'a> Followed<'a> {
    /// A path of one piece, without a limit of the feed.
    pub fn of_one(pieces: Pieces<'a>) -> Self {
        Self {
            pieces,
            feed: &[f64::INFINITY; super::FEEDS],
            line: &[1],
            moves: &[0, 0],
            tolerance: &[0.0],
            runs: &[0, 1],
            new_words: &[false],
            start_dwell: 0.0,
            dwell: &[0.0],
        }
    }
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

    /// Whether piece `i` begins a run whose axes have another meaning than in the run before.
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

    /// The rows of piece `i` in the table of control points.
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

    /// Whether all control points of piece `i` are the same.
    pub fn is_motionless(&self, i: usize) -> bool {
        let rows = self.rows(i);
        let row = |row: usize| &self.control[row * self.stride..(row + 1) * self.stride];
        rows.clone().all(|other| row(other) == row(rows.start))
    }

    /// The control polygon of piece `i`.
    #[inline]
    fn polygon<const M: usize>(&self, i: usize) -> Polygon<M> {
        let rows = self.rows(i);
        let weights = if self.weights.is_empty() { &[][..] } else { &self.weights[rows.clone()] };
        Polygon::new(rows.map(|row| self.point(row)), weights)
    }

    /// Piece `i`, ready to be evaluated.
    pub fn curve<const M: usize>(&self, i: usize) -> Curve<M> {
        Curve::new(self.polygon(i), self.width[i])
    }

    /// Lower bound of the distance of `q` from piece `i`, in mm: its distance from the bounding box of the control points.
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

/// Number of consecutive pieces that are kept.
pub const KEPT: usize = 8;

/// A cache of the last few pieces, prepared for evaluation.
pub struct Curves<'a, const M: usize> {
    pub pieces: Pieces<'a>,
    kept: [(usize, Rc<Curve<M>>); KEPT],
}

impl<'a, const M: usize> Curves<'a, M> {
    pub fn new(pieces: Pieces<'a>) -> Self {
        Self { pieces, kept: [0; KEPT].map(|_| (usize::MAX, Rc::new(Curve::none()))) }
    }

    pub fn get(&mut self, i: usize) -> &Rc<Curve<M>> {
        let (number, curve) = &mut self.kept[i % KEPT];
        if *number != i {
            *number = i;
            // Reuses the memory of the replaced piece, unless somebody still holds it.
            Rc::make_mut(curve).set(self.pieces.polygon(i), self.pieces.width[i]);
        }
        curve
    }
}

/// On a part shorter than this share of the piece, the trapezoid rule is as accurate as the slopes.
const SHORT: f64 = 1e-8;

/// A piece, over u in [0, width].
#[derive(Clone, Debug)]
pub struct Curve<const M: usize> {
    pub polygon: Polygon<M>,
    hodographs: Hodographs<M>,
    width: f64,
    per_width: f64,
    /// See `derivative_sizes` and `size_length`.
    sizes: [[f64; M]; 3],
    size_length: f64,
}

impl<const M: usize> Curve<M> {
    /// A point at the origin.
    fn none() -> Self {
        let (polygon, sizes) = (Polygon::new([[0.0; M]].into_iter(), &[]), [[0.0; M]; 3]);
        Self { polygon, hodographs: Hodographs::none(), width: 0.0, per_width: 0.0, sizes, size_length: 0.0 }
    }

    pub fn new(polygon: Polygon<M>, width: f64) -> Self {
        let mut curve = Self::none();
        curve.set(polygon, width);
        curve
    }

    /// Replaces the piece by another one.
    fn set(&mut self, polygon: Polygon<M>, width: f64) {
        (self.polygon, self.width, self.per_width) = (polygon, width, 1.0 / width);
        self.hodographs.set(&self.polygon);
        self.sizes = by_width(*self.hodographs.sizes(), self.per_width);
        self.size_length = length(&self.sizes[0]);
    }

    /// Length of the parameter interval, in mm.
    #[inline]
    pub fn width(&self) -> f64 {
        self.width
    }

    /// u from the start and from the end, both as parts of the width.
    #[inline(always)]
    fn parts<T: Number>(&self, u: T) -> (T, T) {
        (u * self.per_width, (u.filled(self.width) - u) * self.per_width)
    }

    /// C(u).
    #[inline]
    pub fn at(&self, u: f64) -> [f64; M] {
        let (t, rest) = self.parts(u);
        self.hodographs.at(t, rest)
    }

    /// The part between two parameters.
    fn part(&self, from: f64, to: f64) -> Polygon<M> {
        self.polygon.part(from * self.per_width, (to - from) * self.per_width)
    }

    /// Upper bound of the length between two parameters, in mm: the length of the control polygon of this part.
    pub fn way_at_most(&self, from: f64, to: f64) -> f64 {
        self.part(from, to).way()
    }

    /// The displacement from one parameter to another, where C' at both is known; accurate to all digits also for short parts.
    pub fn way(&self, [from, to]: [f64; 2], slopes: [&[f64; M]; 2]) -> [f64; M] {
        if self.has_linear_slope() || (to - from).abs() <= SHORT * self.width {
            return vector_of(|k| 0.5 * (to - from) * (slopes[0][k] + slopes[1][k]));
        }
        let way = self.part(from.min(to), from.max(to)).chord();
        vector_of(|k| way[k] * (to - from).signum())
    }

    /// C'(u).
    #[inline]
    pub fn derivative(&self, u: f64) -> [f64; M] {
        let (t, rest) = self.parts(u);
        let slope = self.hodographs.slope(t, rest);
        vector_of(|k| slope[k] * self.per_width)
    }

    /// |C'| at several u, with each axis multiplied by its scale.
    #[inline]
    pub fn speeds<const K: usize>(&self, u: [f64; K], scale: &[f64; M]) -> [f64; K] {
        let (mut t, mut rest) = ([0.0; K], [0.0; K]);
        for i in 0..K {
            (t[i], rest[i]) = self.parts(u[i]);
        }
        self.hodographs.speeds(t, rest, (self.per_width, scale))
    }

    /// C(u) and C'(u).
    #[inline]
    pub fn place(&self, u: f64) -> [[f64; M]; 2] {
        let (t, rest) = self.parts(u);
        let [point, slope] = self.hodographs.derivatives(t, rest);
        [point, vector_of(|k| slope[k] * self.per_width)]
    }

    /// The first three derivatives at u.
    #[inline]
    pub fn derivatives(&self, u: f64) -> [[f64; M]; 3] {
        let (t, rest) = self.parts(u);
        by_width(self.hodographs.rates(t, rest), self.per_width)
    }

    /// C and its first three derivatives at u.
    pub fn jet(&self, u: f64) -> [[f64; M]; 4] {
        let [first, second, third] = self.derivatives(u);
        [self.at(u), first, second, third]
    }

    /// The first three derivatives on a piece without weights, at one u or at several.
    #[inline(always)]
    pub fn polynomial_derivatives<T: Number>(&self, u: T) -> [[T; M]; 3] {
        let (t, rest) = self.parts(u);
        by_width(self.hodographs.polynomial_rates(t, rest), self.per_width)
    }

    /// C and its first three derivatives on a piece without weights, at one u or at several.
    #[inline(always)]
    pub fn polynomial_jet<T: Number>(&self, u: T) -> [[T; M]; 4] {
        let [first, second, third] = self.polynomial_derivatives(u);
        [self.polynomial_point(u), first, second, third]
    }

    /// C on a piece without weights, at one u or at several.
    #[inline(always)]
    pub fn polynomial_point<T: Number>(&self, u: T) -> [T; M] {
        let (t, rest) = self.parts(u);
        self.hodographs.polynomial_point(t, rest)
    }

    /// C and C' on a piece without weights, at one u or at several.
    #[inline(always)]
    pub fn polynomial_place<T: Number>(&self, u: T) -> [[T; M]; 2] {
        let (t, rest) = self.parts(u);
        let [point, slope] = self.hodographs.polynomial_place(t, rest);
        [point, scaled(slope, self.per_width)]
    }

    /// |C'| on a piece without weights, at one u or at several, with each axis multiplied by its scale if there is one.
    #[inline(always)]
    pub fn polynomial_speed<T: Number>(&self, u: T, scale: Option<&[f64; M]>) -> T {
        let (t, rest) = self.parts(u);
        let mut slope = scaled(self.hodographs.polynomial_slope(t, rest), self.per_width);
        if let Some(scale) = scale {
            for k in 0..M {
                slope[k] = slope[k] * scale[k];
            }
        }
        inner(&slope, &slope).root()
    }

    /// For each axis the magnitudes that the rounding errors of the first three derivatives at u are relative to.
    #[inline(always)]
    pub fn derivative_sizes_at<T: Number>(&self, u: T) -> [[T; M]; 3] {
        let (t, rest) = self.parts(u);
        by_width(self.hodographs.sizes_at(self.polygon.steps(), t, rest), self.per_width)
    }

    /// Upper bounds of `derivative_sizes_at` on the piece.
    #[inline]
    pub fn derivative_sizes(&self) -> &[[f64; M]; 3] {
        &self.sizes
    }

    /// The length of the first vector of `derivative_sizes`.
    #[inline]
    pub fn size_length(&self) -> f64 {
        self.size_length
    }

    /// Upper bounds of the lengths of the second to the fifth derivative; infinite on pieces with weights.
    pub fn bounds(&self) -> [f64; 4] {
        let mut scale = self.per_width;
        self.hodographs.bounds().map(|bound| {
            scale *= self.per_width;
            bound * scale
        })
    }

    /// Upper bound of the distance of any part of the piece of parameter length `step` from its chord, in mm.
    pub fn sagitta(&self, step: f64) -> f64 {
        sagitta(self.bounds()[0], step)
    }

    /// For each axis the magnitude that the rounding error of C' is relative to.
    #[inline]
    pub fn derivative_size(&self) -> [f64; M] {
        self.sizes[0]
    }

    /// Factor from a rounding error of the control points, in mm, to the error of C' that it causes; in 1/mm.
    pub fn derivative_scale(&self) -> f64 {
        self.polygon.slope_scale() * self.per_width
    }

    /// Curvature in 1/mm at u; 0 where the piece has no direction.
    pub fn curvature(&self, u: f64) -> f64 {
        let [tangent, bend, _] = self.derivatives(u);
        curvature(&tangent, &bend)
    }

    /// Greatest coordinate, in mm: rounding errors of positions are relative to it.
    #[inline]
    pub fn magnitude(&self) -> f64 {
        self.polygon.magnitude()
    }

    /// Whether C' is linear in u.
    fn has_linear_slope(&self) -> bool {
        self.polygon.degree() <= 2 && !self.polygon.is_rational()
    }

    /// Factor of the number of places that show the shape of the piece: 1 where C' is linear in u, else the degree.
    pub fn turns(&self) -> usize {
        if self.has_linear_slope() {
            1
        } else {
            self.polygon.degree()
        }
    }

    /// Least and greatest position of an axis between the ends.
    pub fn extremes(&self, axis: usize) -> [f64; 2] {
        self.polygon.extremes(axis)
    }
}

/// Upper bound of the distance of a part of parameter length `step` from its chord, in mm, where |C''| is at most `bend`.
#[inline(always)]
pub fn sagitta(bend: f64, step: f64) -> f64 {
    0.125 * bend * step * step
}

/// Converts derivatives by t = u/width to derivatives by u.
#[inline(always)]
fn by_width<const M: usize, T: Number>([first, second, third]: [[T; M]; 3], per_width: f64) -> [[T; M]; 3] {
    let per_width_sq = per_width * per_width;
    [scaled(first, per_width), scaled(second, per_width_sq), scaled(third, per_width_sq * per_width)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parabola() -> Curve<2> {
        Curve::new(Polygon::new([[0.0, 0.0], [1.0, 2.0], [3.0, 0.0]].into_iter(), &[]), 4.0)
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
            let [first, second, _] = curve.derivatives(u);
            for k in 0..2 {
                assert!((first[k] - (after[k] - before[k]) / 2e-5).abs() < 1e-9);
                assert!((second[k] - (right[k] - left[k]) / 2e-5).abs() < 1e-9);
            }
            let way = curve.way([u, 0.3], [&curve.derivative(u), &curve.derivative(0.3)]);
            assert!((way[0] - curve.at(0.3)[0] + curve.at(u)[0]).abs() < 1e-15);
        }
    }

    #[test]
    fn a_parabola_is_most_curved_at_its_tip() {
        // y = x²/2 has curvature 1 at x = 0 and 1/√8 at x = 1.
        let curve = Curve::new(Polygon::new([[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]].into_iter(), &[]), 2.0);
        assert!((curve.curvature(1.0) - 1.0).abs() < 1e-15);
        assert!((curve.curvature(2.0) - 8.0_f64.sqrt().recip()).abs() < 1e-15);
        assert_eq!(curvature(&[0.0, 0.0], &[1.0, 0.0]), 0.0);
    }

    #[test]
    fn a_way_of_one_rounding_at_the_end_of_a_piece_is_one() {
        let cubic = [[0.0, 0.0], [1.0, 2.0], [3.0, 0.0], [4.0, 1.0]];
        let curve = Curve::new(Polygon::new(cubic.into_iter(), &[]), 7.1638);
        let (from, to) = (7.1638_f64.next_down(), 7.1638);
        let way = curve.way([to, from], [&curve.derivative(to), &curve.derivative(from)]);
        assert!(way[0] < 0.0 && (way[0] / (from - to) / curve.derivative(to)[0] - 1.0).abs() < 1e-12);
        let short = [1.0, 1.0 + 1e-7];
        let way = curve.way(short, [&curve.derivative(short[0]), &curve.derivative(short[1])]);
        assert!((way[1] / (short[1] - short[0]) / curve.derivative(1.0)[1] - 1.0).abs() < 1e-6);
    }
}
