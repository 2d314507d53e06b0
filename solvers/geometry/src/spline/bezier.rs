//! The value and the first three derivatives of a Bézier piece, its parts, and the same piece of higher degree or reversed; all
//! by corner cutting.
//!
//! Control points are first taken relative to the nearer end of the piece. So the derivatives of a small piece far from the
//! origin keep their digits, and both ends are exact.

use fearless_simd::Simd;

use super::rational::{cut_corners, quotient};
use super::{CompositeCurve, Piece, MAX_DEGREE};
use crate::dispatch_four;
use crate::lanes::four::{Lanes, Register};

/// Evaluates an expression with the number of control points as a constant, so that its loops are unrolled.
macro_rules! with_count {
    ($count:expr, $n:ident, $call:expr) => {
        with_count!($count, $n, $call, 2 3 4 5 6 7 8 9)
    };
    ($count:expr, $n:ident, $call:expr, $($known:literal)+) => {
        match $count {
            $($known => {
                const $n: usize = $known;
                $call
            })+
            _ => {
                const $n: usize = MAX_DEGREE + 1;
                $call
            }
        }
    };
}

/// C, C', C'' and C''' with respect to u, at u.
#[inline]
pub fn derivatives<const M: usize>(piece: &Piece<M>, u: f64) -> [[f64; M]; 4] {
    with_count!(piece.control.len(), N, derivatives_of::<M, N>(piece, u))
}

fn derivatives_of<const M: usize, const N: usize>(piece: &Piece<M>, u: f64) -> [[f64; M]; 4] {
    let (t, scale) = (u / piece.width, 1.0 / piece.width);
    let control = &piece.control[..N];
    let anchor = if t <= 0.5 { control[0] } else { control[N - 1] };
    let mut local = [[0.0; M]; N];
    for i in 0..N {
        for k in 0..M {
            local[i][k] = control[i][k] - anchor[k];
        }
    }
    let mut c = if piece.is_rational() {
        let mut weights = [[0.0]; N];
        for (i, &weight) in piece.weights[..N].iter().enumerate() {
            weights[i] = [weight];
            for k in 0..M {
                local[i][k] *= weight;
            }
        }
        quotient(&triangle(local, t), &triangle(weights, t))
    } else {
        triangle(local, t)
    };
    let mut power = 1.0;
    for order in 1..4 {
        power *= scale;
        for k in 0..M {
            c[order][k] *= power;
        }
    }
    for k in 0..M {
        c[0][k] += anchor[k];
    }
    c
}

/// De Casteljau's triangle, whose last four rows give the value and the derivatives with respect to t.
#[inline(always)]
fn triangle<const M: usize, const N: usize>(mut b: [[f64; M]; N], t: f64) -> [[f64; M]; 4] {
    // This form of the mean has no differences, so that weights of different magnitudes keep their digits.
    let (d, s) = ((N - 1) as f64, 1.0 - t);
    let cut = |b: &mut [[f64; M]; N], left: usize| {
        for i in 0..left {
            for k in 0..M {
                b[i][k] = s * b[i][k] + t * b[i + 1][k];
            }
        }
    };
    let mut out = [[0.0; M]; 4];
    for left in (4..N).rev() {
        cut(&mut b, left);
    }
    if N > 3 {
        for k in 0..M {
            let steps = [b[1][k] - b[0][k], b[2][k] - b[1][k], b[3][k] - b[2][k]];
            out[3][k] = d * (d - 1.0) * (d - 2.0) * ((steps[2] - steps[1]) - (steps[1] - steps[0]));
        }
        cut(&mut b, 3);
    }
    if N > 2 {
        for k in 0..M {
            out[2][k] = d * (d - 1.0) * ((b[2][k] - b[1][k]) - (b[1][k] - b[0][k]));
        }
        cut(&mut b, 2);
    }
    for k in 0..M {
        out[1][k] = d * (b[1][k] - b[0][k]);
    }
    cut(&mut b, 1);
    out[0] = b[0];
    out
}

/// C', C'' and C''' with respect to u at four places: the same numbers as from `derivatives`.
#[inline]
pub fn derivatives_at_four<const M: usize>(piece: &Piece<M>, u: [f64; 4]) -> [[Lanes; 3]; M] {
    if piece.is_rational() {
        let c = u.map(|u| derivatives(piece, u));
        std::array::from_fn(|k| [1, 2, 3].map(|order| Lanes::new(c.map(|c| c[order][k]))))
    } else {
        let mut c = [[Lanes::ZERO; 3]; M];
        axes_at_four(piece.control.as_flattened(), u.map(|u| u / piece.width), 1.0 / piece.width, &mut c);
        c
    }
}

/// Derivatives of each axis at four places; not generic, so that it is compiled once, for any number of axes.
fn axes_at_four(control: &[f64], t: [f64; 4], scale: f64, c: &mut [[Lanes; 3]]) {
    let axes = c.len();
    with_count!(control.len() / axes, N, {
        dispatch_four!(simd => {
            for (k, c) in c.iter_mut().enumerate() {
                *c = triangle_at_four(simd, &axis::<N>(control, axes, k), t, scale);
            }
        })
    });
}

/// The coordinates of N control points on axis k of `axes`.
#[inline(always)]
fn axis<const N: usize>(control: &[f64], axes: usize, k: usize) -> [f64; N] {
    let mut numbers = [0.0; N];
    for (number, point) in numbers.iter_mut().zip(control.chunks_exact(axes)) {
        *number = point[k];
    }
    numbers
}

/// The derivatives of `triangle` for one axis at four places, with respect to u.
#[inline(always)]
fn triangle_at_four<S: Simd, const N: usize>(
    simd: S,
    numbers: &[f64; N],
    t: [f64; 4],
    scale: f64,
) -> [Lanes; 3] {
    let anchor = t.map(|t| if t <= 0.5 { numbers[0] } else { numbers[N - 1] });
    let (anchor, t) = (Lanes::new(anchor).load(simd), Lanes::new(t).load(simd));
    let (d, s) = ((N - 1) as f64, Register::all(simd, 1.0) - t);
    let mut b = [anchor; N];
    for i in 0..N {
        b[i] = Register::all(simd, numbers[i]) - anchor;
    }
    let mut out = [Lanes::ZERO; 3];
    for left in (4..N).rev() {
        cut(&mut b[..=left], s, t);
    }
    if N > 3 {
        let steps = [b[1] - b[0], b[2] - b[1], b[3] - b[2]];
        let third = (steps[2] - steps[1]) - (steps[1] - steps[0]);
        out[2] = (third * (d * (d - 1.0) * (d - 2.0)) * (scale * scale * scale)).into();
        cut(&mut b[..4], s, t);
    }
    if N > 2 {
        let second = (b[2] - b[1]) - (b[1] - b[0]);
        out[1] = (second * (d * (d - 1.0)) * (scale * scale)).into();
        cut(&mut b[..3], s, t);
    }
    out[0] = ((b[1] - b[0]) * d * scale).into();
    out
}

/// One step of de Casteljau's algorithm at t = 1 − s; it leaves one number fewer.
#[inline(always)]
fn cut<S: Simd>(b: &mut [Register<S>], s: Register<S>, t: Register<S>) {
    for i in 0..b.len() - 1 {
        b[i] = s * b[i] + t * b[i + 1];
    }
}

/// |C'|² with respect to u, at four places.
#[inline]
pub fn speeds_sq<const M: usize>(piece: &Piece<M>, u: [f64; 4]) -> [f64; 4] {
    let scale = 1.0 / piece.width;
    let t = u.map(|u| u * scale);
    let control = piece.control.as_flattened();
    let sum = if piece.is_rational() {
        rational_speeds_sq(control, M, piece.weights, t)
    } else {
        axes_speeds_sq(control, M, t)
    };
    sum.map(|sum| sum * (scale * scale))
}

/// |C'|² with respect to t of a polynomial piece; not generic, so that it is compiled once, for any number of axes.
fn axes_speeds_sq(control: &[f64], axes: usize, t: [f64; 4]) -> [f64; 4] {
    with_count!(control.len() / axes, N, {
        dispatch_four!(simd => {
            let t = Lanes::new(t).load(simd);
            let mut sum = Register::all(simd, 0.0);
            for k in 0..axes {
                let numbers = axis::<N>(control, axes, k);
                let mut b = [t; N];
                for i in 0..N {
                    b[i] = Register::all(simd, numbers[i] - numbers[0]);
                }
                let [_, tangent] = value_and_slope(b, t);
                sum += tangent * tangent;
            }
            sum.values()
        })
    })
}

/// |C'|² with respect to t of a rational piece.
fn rational_speeds_sq(control: &[f64], axes: usize, weights: &[f64], t: [f64; 4]) -> [f64; 4] {
    with_count!(weights.len(), N, {
        let of = |numbers: [f64; N]| {
            dispatch_four!(simd => {
                let numbers = numbers.map(|number| Register::all(simd, number));
                value_and_slope(numbers, Lanes::new(t).load(simd)).map(Register::values)
            })
        };
        let weights: [f64; N] = weights.try_into().expect("a weight for each point");
        let [w0, w1] = of(weights);
        let inverse = w0.map(|w| 1.0 / w);
        let mut sum = [0.0; 4];
        for k in 0..axes {
            let numbers = axis::<N>(control, axes, k);
            let [m0, m1] = of(std::array::from_fn(|i| (numbers[i] - numbers[0]) * weights[i]));
            for lane in 0..4 {
                let tangent = (m1[lane] - w1[lane] * inverse[lane] * m0[lane]) * inverse[lane];
                sum[lane] += tangent * tangent;
            }
        }
        sum
    })
}

/// Value and derivative with respect to t of a polynomial in Bernstein form, at four places.
#[inline(always)]
fn value_and_slope<S: Simd, const N: usize>(mut b: [Register<S>; N], t: Register<S>) -> [Register<S>; 2] {
    let s = Register::all(t.simd(), 1.0) - t;
    for left in (2..N).rev() {
        cut(&mut b[..=left], s, t);
    }
    [s * b[0] + t * b[1], (b[1] - b[0]) * (N - 1) as f64]
}

/// C(u).
#[inline]
pub fn point<const M: usize>(piece: &Piece<M>, u: f64) -> [f64; M] {
    derivatives(piece, u)[0]
}

/// Control points and weights, worked on in place.
struct Polygon<const M: usize> {
    points: [[f64; M]; MAX_DEGREE + 1],
    weights: [f64; MAX_DEGREE + 1],
    count: usize,
    rational: bool,
}

impl<const M: usize> Polygon<M> {
    fn new(piece: &Piece<M>) -> Self {
        let mut polygon = Self {
            points: [[0.0; M]; MAX_DEGREE + 1],
            weights: [1.0; MAX_DEGREE + 1],
            count: piece.control.len(),
            rational: piece.is_rational(),
        };
        polygon.points[..polygon.count].copy_from_slice(piece.control);
        if polygon.rational {
            polygon.weights[..polygon.count].copy_from_slice(piece.weights);
        }
        polygon
    }

    fn cut(&mut self, count: usize, alpha: impl Fn(usize) -> f64) {
        let weights = if self.rational { &mut self.weights[..] } else { &mut [] };
        cut_corners(&mut self.points, weights, count, alpha);
    }

    fn append_to(&self, curve: &mut CompositeCurve<M>, width: f64) {
        let weights = if self.rational { &self.weights[..self.count] } else { &[] };
        curve.push(&self.points[..self.count], weights, width);
    }
}

/// Appends the parts of a piece between 0, the increasing places `cuts` inside it, and its end.
pub fn split<const M: usize>(piece: &Piece<M>, cuts: &[f64], curve: &mut CompositeCurve<M>) {
    let mut right = Polygon::new(piece);
    let last = right.count - 1;
    let mut start = 0.0;
    for &cut in cuts {
        let t = (cut - start) / (piece.width - start);
        let mut left = Polygon::new(piece);
        for row in 0..=last {
            left.points[row] = right.points[0];
            left.weights[row] = right.weights[0];
            right.cut(last - row, |_| t);
        }
        left.append_to(curve, cut - start);
        start = cut;
    }
    right.append_to(curve, piece.width - start);
}

/// Appends the piece with its degree raised by `by`; the sum must stay within `MAX_DEGREE`.
pub fn elevate<const M: usize>(piece: &Piece<M>, by: usize, curve: &mut CompositeCurve<M>) {
    let mut polygon = Polygon::new(piece);
    for _ in 0..by {
        let n = polygon.count;
        // The new point i is a mean of the old points i − 1 and i; the last one keeps its value at the next index.
        let (first, weight) = (polygon.points[0], polygon.weights[0]);
        let (last, last_weight) = (polygon.points[n - 1], polygon.weights[n - 1]);
        polygon.cut(n - 1, |i| (n - 1 - i) as f64 / n as f64);
        polygon.points.copy_within(0..n - 1, 1);
        polygon.weights.copy_within(0..n - 1, 1);
        (polygon.points[0], polygon.weights[0]) = (first, weight);
        (polygon.points[n], polygon.weights[n]) = (last, last_weight);
        polygon.count += 1;
    }
    polygon.append_to(curve, piece.width);
}

/// Appends the piece traversed backwards.
pub fn reverse<const M: usize>(piece: &Piece<M>, curve: &mut CompositeCurve<M>) {
    let mut polygon = Polygon::new(piece);
    polygon.points[..polygon.count].reverse();
    polygon.weights[..polygon.count].reverse();
    polygon.append_to(curve, piece.width);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadratic::{dot, norm, sub};
    use proptest::prelude::*;

    #[test]
    fn derivatives_of_a_cubic_by_hand() {
        // x = t³, y = t² on [0, 2], t = u/2.
        let piece = Piece {
            control: &[[0.0, 0.0], [0.0, 0.0], [0.0, 1.0 / 3.0], [1.0, 1.0]],
            weights: &[],
            width: 2.0,
        };
        let c = derivatives(&piece, 1.0);
        let expected = [[0.125, 0.25], [0.375, 0.5], [0.75, 0.5], [0.75, 0.0]];
        for order in 0..4 {
            assert!(norm(&sub(&c[order], &expected[order])) < 1e-15, "{order}: {:?}", c[order]);
        }
    }

    #[test]
    fn a_quarter_circle_keeps_its_radius_and_its_ends() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let quarter =
            Piece { control: &[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], weights: &[1.0, half, 1.0], width: 1.0 };
        for i in 0..=20 {
            let c = derivatives(&quarter, i as f64 / 20.0);
            let radial = c[0][0] * c[1][0] + c[0][1] * c[1][1];
            // |C|² = 1 differentiated three times.
            let second = c[0][0] * c[2][0] + c[0][1] * c[2][1] + c[1][0] * c[1][0] + c[1][1] * c[1][1];
            let third = c[0][0] * c[3][0] + c[0][1] * c[3][1] + 3.0 * (c[1][0] * c[2][0] + c[1][1] * c[2][1]);
            assert!((norm(&c[0]) - 1.0).abs() < 4e-16);
            assert!(radial.abs() < 2e-15 && second.abs() < 1e-14 && third.abs() < 4e-14);
        }
        assert_eq!(point(&quarter, 0.0), [1.0, 0.0]);
        assert_eq!(point(&quarter, 1.0), [0.0, 1.0]);
    }

    #[test]
    fn a_small_piece_far_away_keeps_the_digits_of_its_derivatives() {
        let near = [[0.0], [0.25], [0.125], [0.5]];
        let far = near.map(|[x]| [x + (1u64 << 40) as f64]);
        let piece = |control| Piece { control, weights: &[], width: 1.0 };
        for u in [0.1, 0.37, 0.8] {
            let (a, b) = (derivatives(&piece(&near), u), derivatives(&piece(&far), u));
            assert_eq!(a[1..], b[1..]);
        }
    }

    fn pieces() -> impl Strategy<Value = (Vec<[f64; 3]>, Vec<f64>)> {
        (1..=7usize, any::<bool>()).prop_flat_map(|(degree, rational)| {
            let weights = if rational { degree + 1 } else { 0 };
            (
                prop::collection::vec(prop::array::uniform3(-10.0..10.0f64), degree + 1),
                prop::collection::vec(0.1..10.0f64, weights),
            )
        })
    }

    fn close(a: &[[f64; 3]; 4], b: &[[f64; 3]; 4]) -> bool {
        (0..4).all(|order| {
            norm(&sub(&a[order], &b[order])) <= 1e-11 * (1.0 + norm(&b[order])) * 100f64.powi(order as i32)
        })
    }

    proptest! {
        #[test]
        fn parts_lie_on_the_whole((control, weights) in pieces(), cut in 0.1..0.8f64, at in 0.0..1.0f64) {
            let whole = Piece { control: &control, weights: &weights, width: 2.0 };
            let mut parts = CompositeCurve::default();
            split(&whole, &[cut, 1.0 + 0.5 * cut], &mut parts);
            prop_assert_eq!(parts.len(), 3);
            let starts = [0.0, cut, 1.0 + 0.5 * cut];
            for (i, part) in parts.pieces().enumerate() {
                let u = at * part.width;
                prop_assert!(close(&derivatives(&part, u), &derivatives(&whole, (starts[i] + u).min(2.0))));
            }
        }

        #[test]
        fn elevation_changes_no_value((control, weights) in pieces(), by in 0..3usize, u in 0.0..1.0f64) {
            let piece = Piece { control: &control, weights: &weights, width: 1.0 };
            let mut raised = CompositeCurve::default();
            elevate(&piece, by, &mut raised);
            prop_assert_eq!(raised.piece(0).degree(), piece.degree() + by);
            prop_assert!(close(&derivatives(&raised.piece(0), u), &derivatives(&piece, u)));
        }

        #[test]
        fn speeds_are_those_of_the_derivative(
            (control, weights) in pieces(),
            u in prop::array::uniform4(0.0..2.0f64),
        ) {
            let piece = Piece { control: &control, weights: &weights, width: 2.0 };
            let size = control.iter().map(norm).fold(0.0, f64::max);
            for (u, found) in u.into_iter().zip(speeds_sq(&piece, u)) {
                let tangent = derivatives(&piece, u)[1];
                prop_assert!((found - dot(&tangent, &tangent)).abs() <= 1e-10 * size * size);
            }
        }

        #[test]
        fn derivatives_at_four_places_are_those_at_each(
            (control, weights) in pieces(),
            u in prop::array::uniform4(0.0..2.0f64),
        ) {
            let piece = Piece { control: &control, weights: &weights, width: 2.0 };
            let found = derivatives_at_four(&piece, u);
            for (lane, u) in u.into_iter().enumerate() {
                let truth = derivatives(&piece, u);
                for (k, of_axis) in found.iter().enumerate() {
                    for (order, number) in of_axis.iter().enumerate() {
                        prop_assert_eq!(number.values()[lane], truth[order + 1][k]);
                    }
                }
            }
        }

        #[test]
        fn backwards_the_odd_derivatives_change_sign((control, weights) in pieces(), u in 0.0..1.0f64) {
            let piece = Piece { control: &control, weights: &weights, width: 1.0 };
            let mut reversed = CompositeCurve::default();
            reverse(&piece, &mut reversed);
            let mut back = derivatives(&reversed.piece(0), 1.0 - u);
            for order in [1, 3] {
                back[order] = back[order].map(|value| -value);
            }
            prop_assert!(close(&back, &derivatives(&piece, u)));
        }
    }
}
