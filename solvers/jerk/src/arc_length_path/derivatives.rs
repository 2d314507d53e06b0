//! Computes the axes' derivatives by the arc length s [mm], the speed cap and the curvature at a parameter of a piece, from the
//! derivatives of the piece by the chain rule.
//!
//! With D(u) = |C'(u)|², or the given square of the speed where the axes are joints, s' = √D and
//!
//!   u' = D^(−1/2),   u'' = −D_u / (2 D²),   u''' = D^(−1/2) (D_u² / D³ − D_uu / (2 D²))

use fearless_simd::Simd;

use crate::path_limits::chord_speed;
use crate::path_problem::{PathPoint, PathPoints};
use feedplan_geometry::dispatch_four;
use feedplan_geometry::lanes::four::{Lanes, Register};
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::bezier::{self, derivatives, derivatives_at_four};
use feedplan_geometry::spline::rational::Hodograph;
use feedplan_geometry::spline::Piece;
use feedplan_planner::problem::Problem;

/// Tangents of a straight piece deviate from its direction by at most this fraction of their length and this many rounding
/// errors.
pub const OFF_LINE: f64 = 1e-12;
const ROUNDINGS: f64 = 16.0;
/// Greatest number of Bernstein coefficients of D.
pub const MAX_RATE: usize = 40;

/// Piece `i` of the path; with equal weights it is polynomial.
#[inline]
pub fn piece<'a, const M: usize>(problem: &Problem<'a, M>, i: usize) -> Piece<'a, M> {
    plain(problem.control, problem.weight, problem.offset, problem.width, i)
}

/// Piece `i` of the tool's path; None if the axes are those of the tool.
pub fn tip_piece<'a, const M: usize>(problem: &Problem<'a, M>, i: usize) -> Option<Piece<'a, 3>> {
    problem.tip.map(|tip| plain(tip.control, tip.weight, tip.offset, problem.width, i))
}

#[inline]
fn plain<'a, const M: usize>(
    control: &'a [[f64; M]],
    weight: &'a [f64],
    offset: &[usize],
    width: &[f64],
    i: usize,
) -> Piece<'a, M> {
    let range = offset[i]..offset[i + 1];
    let weights = if weight.is_empty() { &[] } else { &weight[range.clone()] };
    Piece::new(&control[range], weights, width[i])
}

/// The direction of a straight piece at u; None for other pieces. A tangent much shorter than the longest one may deviate from
/// the line by a small fraction of the longest one and still turn sharply, so that it is compared with its own length.
pub fn straight<const M: usize>(piece: &Piece<M>, u: f64) -> Option<[f64; M]> {
    let hodograph = Hodograph::new(piece);
    let tangents = hodograph.coefficients();
    let longest = tangents.iter().max_by(|a, b| norm(a).total_cmp(&norm(b)))?;
    let length = norm(longest);
    let mut direction = longest.map(|x| x / length);
    let edge = |pair: &[[f64; M]]| norm::<M>(&std::array::from_fn(|k| pair[1][k] - pair[0][k]));
    let edge = piece.control.windows(2).map(edge).fold(0.0, f64::max);
    let coordinate = piece.control.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let rounding = ROUNDINGS * f64::EPSILON * coordinate / edge * length;
    let on_line = tangents.iter().all(|tangent| {
        let along = dot(tangent, &direction);
        let off: [f64; M] = std::array::from_fn(|k| tangent[k] - along * direction[k]);
        norm(&off) <= (OFF_LINE * length).min(OFF_LINE * along.abs() + rounding)
    });
    if dot(&derivatives(piece, u)[1], &direction) < 0.0 {
        direction = direction.map(|x| -x);
    }
    on_line.then_some(direction)
}

/// D, D_u and D_uu at u of piece `i`, from the derivatives of its axes.
#[inline]
pub fn rate<const M: usize>(
    problem: &Problem<M>,
    i: usize,
    u: f64,
    [_, c1, c2, c3]: &[[f64; M]; 4],
) -> [f64; 3] {
    match problem.way {
        Some(way) => polynomial(way.of(i), problem.width[i], u),
        None => [dot(c1, c1), 2.0 * dot(c1, c2), 2.0 * (dot(c2, c2) + dot(c1, c3))],
    }
}

/// The square of a speed and its first two derivatives at u, from its Bernstein coefficients.
#[inline]
fn polynomial(coefficients: &[f64], width: f64, u: f64) -> [f64; 3] {
    let n = coefficients.len() - 1;
    let t = u / width;
    let mut b = [0.0; MAX_RATE];
    b[..=n].copy_from_slice(coefficients);
    let mut out = [0.0; 3];
    // De Casteljau's triangle: its last three rows hold the value and the derivatives.
    for left in (0..=n).rev() {
        let degree = n as f64;
        match left {
            2 => out[2] = degree * (degree - 1.0) * ((b[2] - b[1]) - (b[1] - b[0])) / (width * width),
            1 => out[1] = degree * (b[1] - b[0]) / width,
            0 => out[0] = b[0],
            _ => {}
        }
        for j in 0..left {
            b[j] = (1.0 - t) * b[j] + t * b[j + 1];
        }
    }
    // Where D touches 0, rounding may give a value below 0.
    out[0] = out[0].max(0.0);
    out
}

/// `polynomial` at four parameters.
fn polynomial_at_four(coefficients: &[f64], width: f64, u: [f64; 4]) -> [Lanes; 3] {
    dispatch_four!(simd => polynomial_on(simd, coefficients, width, u))
}

#[inline(always)]
fn polynomial_on<S: Simd>(simd: S, coefficients: &[f64], width: f64, u: [f64; 4]) -> [Lanes; 3] {
    let n = coefficients.len() - 1;
    let t = Lanes::new(u.map(|u| u / width)).load(simd);
    let rest = Register::all(simd, 1.0) - t;
    let mut b = [Register::all(simd, 0.0); MAX_RATE];
    for j in 0..=n {
        b[j] = Register::all(simd, coefficients[j]);
    }
    let degree = n as f64;
    let mut out = [Lanes::ZERO; 3];
    for left in (0..=n).rev() {
        match left {
            2 => {
                let bend = (b[2] - b[1]) - (b[1] - b[0]);
                out[2] = (bend * (degree * (degree - 1.0)) / Register::all(simd, width * width)).into();
            }
            1 => out[1] = ((b[1] - b[0]) * degree / Register::all(simd, width)).into(),
            0 => out[0] = b[0].max(Register::all(simd, 0.0)).into(),
            _ => {}
        }
        for j in 0..left {
            b[j] = rest * b[j] + t * b[j + 1];
        }
    }
    out
}

/// The speed along s divided by the speed that the feed limits, at u of piece `i` with this D; infinite where the feed limits
/// nothing.
pub fn per_feed<const M: usize>(problem: &Problem<M>, i: usize, u: f64, d: f64) -> f64 {
    let square = match (problem.tip, problem.share(i)) {
        (Some(tip), _) => polynomial(tip.speed.of(i), problem.width[i], u)[0],
        (None, None) => return 1.0,
        (None, Some(share)) => {
            let tangent = derivatives(&piece(problem, i), u)[1];
            (0..M).map(|k| (share[k] * tangent[k]).powi(2)).sum()
        }
    };
    (d / square).sqrt()
}

/// D at u of piece `i`.
pub fn speed_sq<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> f64 {
    match problem.way {
        Some(way) => polynomial(way.of(i), problem.width[i], u)[0],
        None => {
            let tangent = derivatives(&piece(problem, i), u)[1];
            dot(&tangent, &tangent)
        }
    }
}

/// D at four u of piece `i`.
pub fn speeds_sq<const M: usize>(problem: &Problem<M>, i: usize, u: [f64; 4]) -> [f64; 4] {
    if problem.way.is_some() {
        u.map(|u| speed_sq(problem, i, u))
    } else {
        bezier::speeds_sq(&piece(problem, i), u)
    }
}

/// Curvature of the tool's path at u of piece `i`, in 1/mm.
pub fn tool_curvature<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> f64 {
    match tip_piece(problem, i) {
        Some(tip) => curvature(&tip, u).0,
        None => curvature(&piece(problem, i), u).0,
    }
}

/// Derivatives and speed cap at u of piece `i`.
pub fn path_point<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> PathPoint<M> {
    let c = derivatives(&piece(problem, i), u);
    let [d, d1, d2] = rate(problem, i, u, &c);
    let [_, c1, c2, c3] = c;
    let (u1, per_d_sq) = (1.0 / d.sqrt(), 1.0 / (d * d));
    let u2 = -0.5 * d1 * per_d_sq;
    let u3 = u1 * per_d_sq * (d1 * d1 / d - 0.5 * d2);
    let (mut first, mut second, mut third) = ([0.0; M], [0.0; M], [0.0; M]);
    for k in 0..M {
        first[k] = c1[k] * u1;
        second[k] = c2[k] * u1 * u1 + c1[k] * u2;
        third[k] = c3[k] * u1 * u1 * u1 + 3.0 * c2[k] * u1 * u2 + c1[k] * u3;
    }
    let fed = problem.feed[i] * per_feed(problem, i, u, d);
    let speed_cap = fed.min(chord_cap(problem, i, u, d, || norm(&second)));
    PathPoint { first, second, third, speed_cap }
}

/// `path_point` at four parameters of piece `i`.
pub fn path_points<const M: usize>(problem: &Problem<M>, i: usize, u: [f64; 4]) -> PathPoints<M> {
    let c = derivatives_at_four(&piece(problem, i), u);
    let rate = problem.way.map(|way| polynomial_at_four(way.of(i), problem.width[i], u));
    let (q, [d, bend]) = dispatch_four!(simd => by_length(simd, &c, rate));
    let square = match (problem.tip, problem.share(i)) {
        (Some(tip), _) => Some(polynomial_at_four(tip.speed.of(i), problem.width[i], u)[0]),
        (None, None) => None,
        (None, Some(share)) => Some(Lanes::new(std::array::from_fn(|lane| {
            (0..M).map(|k| (share[k] * c[k][0].values()[lane]).powi(2)).sum()
        }))),
    };
    let d = d.values();
    let speed_cap = std::array::from_fn(|lane| {
        let per_feed = square.map_or(1.0, |square| (d[lane] / square.values()[lane]).sqrt());
        (problem.feed[i] * per_feed).min(chord_cap(problem, i, u[lane], d[lane], || bend.values()[lane]))
    });
    PathPoints { q, speed_cap: Lanes::new(speed_cap) }
}

/// The derivatives by the arc length at four places, D, and the curvature. `rate` is D with its derivatives; without it D is that
/// of the axes.
#[inline(always)]
fn by_length<S: Simd, const M: usize>(
    simd: S,
    c: &[[Lanes; 3]; M],
    rate: Option<[Lanes; 3]>,
) -> ([[Lanes; 3]; M], [Lanes; 2]) {
    let one = Register::all(simd, 1.0);
    let [d, d1, d2] = match rate {
        Some(rate) => rate.map(|rate| rate.load(simd)),
        None => {
            let mut sums = [Register::all(simd, 0.0); 4];
            for [c1, c2, c3] in c {
                let [c1, c2, c3] = [c1, c2, c3].map(|c| c.load(simd));
                sums[0] += c1 * c1;
                sums[1] += c1 * c2;
                sums[2] += c2 * c2;
                sums[3] += c1 * c3;
            }
            [sums[0], sums[1] * 2.0, (sums[2] + sums[3]) * 2.0]
        }
    };
    let (u1, per_d_sq) = (one / d.sqrt(), one / (d * d));
    let u2 = d1 * -0.5 * per_d_sq;
    let u3 = u1 * per_d_sq * (d1 * d1 / d - d2 * 0.5);
    let mut q = [[Lanes::ZERO; 3]; M];
    let mut bend = Register::all(simd, 0.0);
    for k in 0..M {
        let [c1, c2, c3] = c[k].map(|c| c.load(simd));
        let second = c2 * u1 * u1 + c1 * u2;
        q[k] = [(c1 * u1).into(), second.into(), (c3 * u1 * u1 * u1 + c2 * 3.0 * u1 * u2 + c1 * u3).into()];
        bend += second * second;
    }
    (q, [d, bend.sqrt()].map(Lanes::from))
}

/// The greatest speed along s by the chord error at u of piece `i`, in mm/s, with this D and curvature of the axes' path.
#[inline]
fn chord_cap<const M: usize>(
    problem: &Problem<M>,
    i: usize,
    u: f64,
    d: f64,
    bend: impl FnOnce() -> f64,
) -> f64 {
    if problem.chord_tolerance.is_infinite() {
        return f64::INFINITY;
    }
    match tip_piece(problem, i) {
        None => chord_limit(problem, bend()),
        Some(tip) => {
            let (curvature, square) = curvature(&tip, u);
            chord_limit(problem, curvature) * (d / square).sqrt()
        }
    }
}

/// The greatest speed by the chord error at a curvature in 1/mm, in mm/s; infinite without a chord tolerance.
pub fn chord_limit<const M: usize>(problem: &Problem<M>, curvature: f64) -> f64 {
    if problem.chord_tolerance.is_finite() {
        chord_speed(curvature, problem.chord_tolerance, problem.period)
    } else {
        f64::INFINITY
    }
}

/// The curvature of a piece at u in 1/mm, 0 where C' = 0, and |C'(u)|².
fn curvature<const M: usize>(piece: &Piece<M>, u: f64) -> (f64, f64) {
    let [_, c1, c2, _] = derivatives(piece, u);
    let square = dot(&c1, &c1);
    let along = dot(&c1, &c2) / square;
    let off: [f64; M] = std::array::from_fn(|k| c2[k] - along * c1[k]);
    (if square > 0.0 { norm(&off) / square } else { 0.0 }, square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::one_piece::one_piece;
    use feedplan_planner::problem::{SpeedSquare, Tip};

    #[test]
    fn four_places_have_the_numbers_of_each() {
        let control = [[0.0, 0.0, 1.0], [1.0, 0.5, 0.0], [2.0, 3.0, -1.0], [2.5, 1.0, 0.0], [4.0, 0.0, 2.0]];
        let square = [9.0, 7.0, 2.0, 5.0, 6.0, 8.0];
        let offset = [0, 5];
        let speed = SpeedSquare { coefficients: &square, offset: &[0, 6] };
        let free = one_piece(&control, &offset, &[2.0]);
        let plain = Problem { chord_tolerance: 1e-4, ..free };
        let tip = Some(Tip { speed, control: &control, weight: &[], offset: &offset });
        let u = [0.0, 0.3, 1.2, 2.0];
        for problem in [
            free,
            plain,
            Problem { weight: &[1.0, 2.0, 1.0, 3.0, 1.0], ..plain },
            Problem { feed_share: &[[1.0, 0.0, 0.5]], ..plain },
            Problem { way: Some(speed), tip, ..plain },
        ] {
            let each = u.map(|u| path_point(&problem, 0, u));
            assert_eq!(path_points(&problem, 0, u), PathPoints::new(each));
        }
    }

    #[test]
    fn a_short_tangent_beside_a_long_one_turns_by_its_own_angle() {
        // 1e-11 mm off a line turns an edge of 1e-5 mm by 1e-6 rad, but practically does not turn an edge of half a metre.
        let direction = |first: f64, off: f64| {
            let control = [[0.0, 0.0], [first, off], [1e3, 0.0]];
            straight(&Piece { control: &control, weights: &[], width: 1.0 }, 0.5)
        };
        assert_eq!(direction(1e-5, 0.0), Some([1.0, 0.0]));
        assert!(direction(500.0, 1e-11).is_some() && direction(500.0, 1e-8).is_none());
        assert!(direction(1e-5, 1e-13).is_some() && direction(1e-5, 1e-11).is_none());
    }
}
