//! Taylor series of a tip path, at a point or as bounds over a part, from its pieces in Bernstein form.

use super::expression::Table;
use super::number::Number;
use super::series::quotient;
use feedplan_geometry::interval::Interval;

/// The most control points of a piece.
pub const MOST_POINTS: usize = 16;

/// The pieces of a path, all with the same number of control points.
#[derive(Clone, Copy)]
pub struct Tips<'a> {
    /// Coordinates of each point.
    pub axes: usize,
    /// Control points of each piece.
    pub points: usize,
    /// Piece by piece, point by point.
    pub control: &'a [f64],
    /// One of every control point; empty where all pieces are polynomial.
    pub weights: &'a [f64],
    /// Lengths of the parameter intervals.
    pub width: &'a [f64],
}

/// The control polygons of one piece, axis by axis, and one more row for the weights.
pub struct Polygons<T> {
    values: Vec<T>,
    origin: Vec<T>,
    series: Vec<T>,
}

impl<T: Number> Polygons<T> {
    /// Memory for pieces like these and series up to an order.
    pub fn new(tips: &Tips, order: usize) -> Self {
        let zero = T::exactly(0.0);
        Self {
            values: vec![zero; (tips.axes + 1) * tips.points],
            origin: vec![zero; tips.axes],
            series: vec![zero; 2 * (order + 1)],
        }
    }

    /// Writes the series of all axes; `value` evaluates the control polygon of a derivative.
    fn write(&mut self, tips: &Tips, width: T, value: impl Fn(&[T]) -> T, out: &mut Table<T>) {
        let (own, weights) = self.values.split_at_mut(tips.axes * tips.points);
        if tips.weights.is_empty() {
            for (axis, polygon) in own.chunks_exact_mut(tips.points).enumerate() {
                polygon_series(polygon, width, &value, out.input(axis));
            }
            return;
        }
        let half = self.series.len() / 2;
        let (above, below) = self.series.split_at_mut(half);
        polygon_series(weights, width, &value, below);
        for (axis, polygon) in own.chunks_exact_mut(tips.points).enumerate() {
            polygon_series(polygon, width, &value, above);
            let out = out.input(axis);
            quotient(above, below, out);
            out[0] = out[0] + self.origin[axis];
        }
    }
}

/// Taylor coefficients of a Bézier polygon over its width: C(d, k) Δ^k / width^k.
fn polygon_series<T: Number>(polygon: &mut [T], width: T, value: impl Fn(&[T]) -> T, out: &mut [T]) {
    let degree = polygon.len() - 1;
    let mut scale = T::exactly(1.0);
    out.fill(T::exactly(0.0));
    for k in 0..out.len().min(degree + 1) {
        let live = degree + 1 - k;
        out[k] = value(&polygon[..live]) * T::exactly(binomial(degree, k)) * scale;
        for i in 0..live - 1 {
            polygon[i] = polygon[i + 1] - polygon[i];
        }
        scale = scale / width;
    }
}

/// Binomial coefficient n over k.
pub fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |value, i| value * (n - i) as f64 / (i + 1) as f64).round()
}

/// The value of a Bézier polygon at a fraction of its width, by de Casteljau's algorithm.
fn at<T: Number>(polygon: &[T], fraction: T) -> T {
    let mut level = [T::exactly(0.0); MOST_POINTS];
    level[..polygon.len()].copy_from_slice(polygon);
    let rest = T::exactly(1.0) - fraction;
    for live in (1..polygon.len()).rev() {
        for i in 0..live {
            level[i] = rest * level[i] + fraction * level[i + 1];
        }
    }
    level[0]
}

impl Tips<'_> {
    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.width.len()
    }

    /// Whether there are no pieces.
    pub fn is_empty(&self) -> bool {
        self.width.is_empty()
    }

    fn coordinate(&self, piece: usize, point: usize, axis: usize) -> f64 {
        self.control[(piece * self.points + point) * self.axes + axis]
    }

    /// Writes the series at a fraction of a piece into the inputs of a table.
    ///
    /// With weights, points are taken relative to the nearer end: near a cusp derivatives are so small that they would lose their
    /// digits beside the position of the end.
    pub fn at_point(&self, piece: usize, fraction: f64, work: &mut Polygons<f64>, out: &mut Table<f64>) {
        let rational = !self.weights.is_empty();
        let near = if fraction < 0.5 { 0 } else { self.points - 1 };
        for axis in 0..self.axes {
            let origin = if rational { self.coordinate(piece, near, axis) } else { 0.0 };
            work.origin[axis] = origin;
            for point in 0..self.points {
                let weight = if rational { self.weights[piece * self.points + point] } else { 1.0 };
                work.values[axis * self.points + point] =
                    (self.coordinate(piece, point, axis) - origin) * weight;
            }
        }
        if rational {
            work.values[self.axes * self.points..]
                .copy_from_slice(&self.weights[piece * self.points..][..self.points]);
        }
        work.write(self, self.width[piece], |polygon| at(polygon, fraction), out);
    }

    /// Writes bounds of the series over a part of a piece, from the hull of its Bézier points, into the inputs of a table; or, if
    /// `middle`, the series at the middle of the part.
    pub fn over_part(
        &self,
        piece: usize,
        part: [f64; 2],
        middle: bool,
        work: &mut Polygons<Interval>,
        out: &mut Table<Interval>,
    ) {
        let exactly = Interval::exactly;
        let rational = !self.weights.is_empty();
        for axis in 0..self.axes + usize::from(rational) {
            let row = &mut work.values[axis * self.points..][..self.points];
            for (point, value) in row.iter_mut().enumerate() {
                let weight = if rational { self.weights[piece * self.points + point] } else { 1.0 };
                *value = match (axis < self.axes, rational) {
                    (true, true) => exactly(self.coordinate(piece, point, axis)) * exactly(weight),
                    (true, false) => exactly(self.coordinate(piece, point, axis)),
                    (false, _) => exactly(weight),
                };
            }
            restrict(row, part);
        }
        let width = (exactly(part[1]) - exactly(part[0])) * exactly(self.width[piece]);
        if middle {
            work.write(self, width, |polygon| at(polygon, exactly(0.5)), out);
        } else {
            work.write(self, width, |polygon| polygon[1..].iter().fold(polygon[0], |a, &b| a.hull(b)), out);
        }
    }
}

/// Replaces a Bézier polygon by that of a part [a, b] of it, by the blossom b_i = B(a^(d−i), b^i).
fn restrict(polygon: &mut [Interval], part: [f64; 2]) {
    if part == [0.0, 1.0] {
        return;
    }
    let degree = polygon.len() - 1;
    let mut result = [Interval::exactly(0.0); MOST_POINTS];
    let ends = part.map(|end| (Interval::exactly(1.0) - Interval::exactly(end), Interval::exactly(end)));
    for i in 0..=degree {
        let mut level = [Interval::exactly(0.0); MOST_POINTS];
        level[..=degree].copy_from_slice(polygon);
        for step in 0..degree {
            let (rest, share) = ends[usize::from(step < i)];
            for j in 0..degree - step {
                level[j] = level[j] * rest + level[j + 1] * share;
            }
        }
        result[i] = level[0];
    }
    polygon.copy_from_slice(&result[..=degree]);
}
