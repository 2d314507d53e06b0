//! One piece of the path over t in [0, 1] as polynomials, from its control points and weights: the numerator g of the
//! tangents, the weight ω, the square D of the tool's speed, and how far rounding may have moved g.

use crate::bang_bang::tolerance::{MAX_NOISE, NO_TANGENT, OFF_ITSELF, OFF_LINE, POINT_NOISE, TANGENT_NOISE};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::{dot, norm};

/// The tangents C' = g/ω² and D. With the state π = p/ω⁴, rational pieces lead to polynomials only: axis k has the
/// velocity g_k √π and the acceleration ω² (g_k π'/2 + c_k π).
#[derive(Clone, Copy, Debug)]
pub struct Piece<const M: usize, const C: usize> {
    pub g: [Polynomial<C>; M],
    pub weight: Polynomial<C>,
    /// D: v² of the tool is D π.
    pub speed: Polynomial<C>,
    /// Rounding error of g for each axis, from the rounded control points and from the computation.
    pub noise: [f64; M],
    /// Degree of the curve.
    pub degree: usize,
    /// Whether all tangents have one direction.
    pub straight: bool,
    /// Whether D = |g|²: the axes are those of the tool.
    pub own_speed: bool,
    /// The factor of each axis's velocity in the speed that the feed limits; None if that speed is the tool's.
    pub share: Option<[f64; M]>,
}

impl<const M: usize, const C: usize> Piece<M, C> {
    /// From control points, weights (empty: polynomial) and, for joints, the Bernstein coefficients of |C'|² of the tip and a
    /// factor for them.
    pub fn new(control: &[[f64; M]], weights: &[f64], speed_sq: Option<(&[f64], f64)>) -> Self {
        let degree = control.len() - 1;
        let rational = weights.iter().any(|&weight| weight != weights[0]);
        let (g, weight) = if rational {
            let weight = Polynomial::from_bernstein(weights.iter().map(|&weight| weight / weights[0]));
            let g = std::array::from_fn(|k| {
                // Relative to the first point, to keep digits.
                let numerator = Polynomial::from_bernstein(
                    control
                        .iter()
                        .zip(weights)
                        .map(|(point, &w)| (point[k] - control[0][k]) * (w / weights[0])),
                );
                numerator.wronskian(&weight)
            });
            (g, weight)
        } else {
            let scale = degree as f64;
            let g = std::array::from_fn(|k| {
                Polynomial::from_bernstein(control.windows(2).map(|pair| scale * (pair[1][k] - pair[0][k])))
            });
            (g, Polynomial::constant(1.0))
        };
        let along = straight_line(&g);
        let g = along.unwrap_or(g);
        let noise = std::array::from_fn(|k| {
            let (low, high) = g[k].range();
            let farthest = control.iter().fold(0.0_f64, |most, point| most.max(point[k].abs()));
            let size = high.max(-low);
            (POINT_NOISE * degree as f64 * farthest).clamp(TANGENT_NOISE * size, MAX_NOISE * size)
        });
        let speed = match speed_sq {
            Some((values, factor)) => Polynomial::from_bernstein(values.iter().map(|value| factor * value)),
            None => Polynomial::sum_of_squares(&g),
        };
        let own_speed = speed_sq.is_none();
        Self { g, weight, speed, noise, degree, straight: along.is_some(), own_speed, share: None }
    }

    /// The square of the speed that the feed limits, divided by π; None if that is D.
    pub fn feed_rate(&self) -> Option<Polynomial<C>> {
        self.share.map(|share| weighted_speed_sq(&self.g, &share))
    }

    /// The radius of curvature [mm] at t; infinite where the path is straight.
    pub fn radius(&self, t: f64) -> f64 {
        let g: [f64; M] = std::array::from_fn(|k| self.g[k].value(t));
        let c: [f64; M] = std::array::from_fn(|k| self.g[k].derivative().value(t));
        let weight = self.weight.value(t);
        let mut cross = 0.0_f64;
        for j in 0..M {
            for k in 0..j {
                cross = cross.hypot(g[j] * c[k] - g[k] * c[j]);
            }
        }
        let square = dot(&g, &g);
        square * square.sqrt() / (cross * weight * weight)
    }

    /// A proven lower bound on the radius of curvature [mm] between two t.
    pub fn least_radius(&self, [from, to]: [f64; 2]) -> f64 {
        let g: [Polynomial<C>; M] = std::array::from_fn(|k| self.g[k].part(from, to));
        let mut cross = 0.0_f64;
        for j in 0..M {
            for k in 0..j {
                let (low, high) = g[j].wronskian(&g[k]).range();
                cross = cross.hypot(high.max(-low));
            }
        }
        let square = Polynomial::sum_of_squares(&g).range().0.max(0.0);
        let weight = self.weight.part(from, to).range().1;
        square * square.sqrt() * (to - from) / (cross * weight * weight)
    }
}

/// The sum of the squares (share_k g_k)².
pub fn weighted_speed_sq<const M: usize, const C: usize>(
    g: &[Polynomial<C>; M],
    share: &[f64; M],
) -> Polynomial<C> {
    Polynomial::sum_of_squares(&std::array::from_fn::<_, M, _>(|k| g[k].scale(share[k])))
}

/// If all tangents have the same direction within rounding: the tangents with exactly that direction. Otherwise None.
fn straight_line<const M: usize, const C: usize>(g: &[Polynomial<C>; M]) -> Option<[Polynomial<C>; M]> {
    let tangent = |i: usize| -> [f64; M] { std::array::from_fn(|k| g[k].bernstein(i)) };
    let tangents = || (0..g[0].degree() + 1).map(tangent);
    let longest = tangents().max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))?;
    let length = norm(&longest);
    let direction = longest.map(|x| x / length);
    let on_line = tangents().all(|tangent| {
        let along = dot(&tangent, &direction);
        let off = norm(&std::array::from_fn::<f64, M, _>(|k| tangent[k] - along * direction[k]));
        if off > OFF_LINE * length {
            return false;
        }
        let own = norm(&tangent);
        off <= OFF_ITSELF * own || own <= NO_TANGENT * length
    });
    if !on_line {
        return None;
    }
    let rate = Polynomial::from_bernstein(tangents().map(|tangent| dot(&tangent, &direction)));
    Some(direction.map(|x| rate.scale(x)))
}
