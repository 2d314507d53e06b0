//! A quintic Bézier piece: its points, its parts, and bounds of its distance from a chord and of its speed by convex hulls.

use super::polyline::Polyline;
use super::spline::{DEGREE, ORDER};
use feedplan_geometry::quadratic::{dot, lerp, norm, sub};

pub type Control<const D: usize> = [[f64; D]; ORDER];

/// The greatest number of halvings for a bound.
pub const DEPTH: u32 = 5;

/// The parts before and after t in [0, 1].
pub fn split<const D: usize>(control: &Control<D>, t: f64) -> (Control<D>, Control<D>) {
    let (mut left, mut right) = (*control, *control);
    for level in 1..ORDER {
        for i in 0..ORDER - level {
            right[i] = lerp(&right[i], &right[i + 1], t);
        }
        left[level] = right[0];
    }
    (left, right)
}

/// The point and the first derivative with respect to t.
pub fn point_and_slope<const D: usize>(control: &Control<D>, t: f64) -> ([f64; D], [f64; D]) {
    let mut c = *control;
    for level in 1..DEGREE {
        for i in 0..ORDER - level {
            c[i] = lerp(&c[i], &c[i + 1], t);
        }
    }
    let slope = sub(&c[1], &c[0]);
    (lerp(&c[0], &c[1], t), slope.map(|x| DEGREE as f64 * x))
}

/// The point and the first two derivatives with respect to t.
pub fn derivatives<const D: usize>(control: &Control<D>, t: f64) -> [[f64; D]; 3] {
    let mut c = *control;
    for level in 1..DEGREE - 1 {
        for i in 0..ORDER - level {
            c[i] = lerp(&c[i], &c[i + 1], t);
        }
    }
    let edges = [sub(&c[1], &c[0]), sub(&c[2], &c[1])];
    let second = sub(&edges[1], &edges[0]).map(|x| (DEGREE * (DEGREE - 1)) as f64 * x);
    let slope = lerp(&edges[0], &edges[1], t).map(|x| DEGREE as f64 * x);
    [lerp(&lerp(&c[0], &c[1], t), &lerp(&c[1], &c[2], t), t), slope, second]
}

/// An upper bound of the distance of the piece from a chord, in mm. The piece is halved up to `depth` times while the bound is
/// above `enough`. The distance from a segment is a convex function, so no point of a piece is farther away than its farthest
/// control point.
pub fn distance_bound<const D: usize>(
    control: &Control<D>,
    line: &Polyline<D>,
    chord: usize,
    enough: f64,
    depth: u32,
) -> f64 {
    let bound = control.iter().fold(0.0, |most: f64, point| most.max(line.distance(chord, point)));
    if bound <= enough || depth == 0 {
        return bound;
    }
    let (left, right) = split(control, 0.5);
    [left, right]
        .iter()
        .fold(0.0, |most, half| most.max(distance_bound(half, line, chord, enough, depth - 1)))
}

/// Whether the piece is within the bounds of the axes; if its control points are not, its halves are tested, `depth` times at
/// most.
pub fn is_inside<const D: usize>(control: &Control<D>, bounds: &[[f64; 2]; D], depth: u32) -> bool {
    let inside = |point: &[f64; D]| (0..D).all(|k| point[k] >= bounds[k][0] && point[k] <= bounds[k][1]);
    if control.iter().all(inside) {
        return true;
    }
    if depth == 0 || !inside(&control[0]) || !inside(&control[DEGREE]) {
        return false;
    }
    let (left, right) = split(control, 0.5);
    is_inside(&left, bounds, depth - 1) && is_inside(&right, bounds, depth - 1)
}

/// A lower bound of |C'|, by halving until it is at least `enough`: the least component of the derivative's control points along
/// the line from the start of a part to its end.
pub fn speed_bound<const D: usize>(control: &Control<D>, width: f64, enough: f64, depth: u32) -> f64 {
    let way = sub(&control[DEGREE], &control[0]);
    let along = |pair: &[[f64; D]]| dot(&sub(&pair[1], &pair[0]), &way);
    let least = control.windows(2).map(along).fold(f64::INFINITY, f64::min);
    let length = norm(&way);
    let bound = if length > 0.0 { DEGREE as f64 * least / (length * width) } else { 0.0 };
    if bound >= enough || depth == 0 {
        return bound;
    }
    let (left, right) = split(control, 0.5);
    let half = |part: &Control<D>| speed_bound(part, 0.5 * width, enough, depth - 1);
    half(&left).min(half(&right))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quintic along y = x² for x from 0 to 1, with x as its parameter.
    const PARABOLA: Control<2> = [[0.0, 0.0], [0.2, 0.0], [0.4, 0.1], [0.6, 0.3], [0.8, 0.6], [1.0, 1.0]];

    #[test]
    fn parts_and_slopes_of_a_parabola() {
        let (left, right) = split(&PARABOLA, 0.25);
        assert_eq!(left[DEGREE], right[0]);
        assert!(norm(&sub(&left[DEGREE], &[0.25, 0.0625])) < 1e-15);
        let (point, slope) = point_and_slope(&PARABOLA, 0.5);
        assert!(norm(&sub(&point, &[0.5, 0.25])) < 1e-15 && norm(&sub(&slope, &[1.0, 1.0])) < 1e-14);
        let [point, slope, second] = derivatives(&PARABOLA, 0.5);
        assert!(norm(&sub(&point, &[0.5, 0.25])) < 1e-15 && norm(&sub(&slope, &[1.0, 1.0])) < 1e-14);
        assert!(norm(&sub(&second, &[0.0, 2.0])) < 1e-13);
    }

    #[test]
    fn bounds_are_valid_and_close_where_they_must_tell() {
        // The point at 1/2 is farthest from the chord y = x, at 0.25/√2; the start is the slowest place.
        let line = Polyline::new(vec![[0.0, 0.0], [1.0, 1.0]], vec![1.0]);
        let exact = 0.25 / 2f64.sqrt();
        let close = distance_bound(&PARABOLA, &line, 0, 0.0, DEPTH);
        assert!(close >= exact && close < 1.001 * exact, "{close}");
        assert!(distance_bound(&PARABOLA, &line, 0, 0.3, DEPTH) <= 0.3);
        let slow = speed_bound(&PARABOLA, 1.0, 10.0, DEPTH);
        assert!(slow <= 1.0 && slow > 0.99, "{slow}");
        let cusp = PARABOLA.map(|[x, y]| [(x - 0.5) * (x - 0.5), y * 0.0]);
        assert!(speed_bound(&cusp, 1.0, 0.01, DEPTH) <= 0.0);
    }
}
