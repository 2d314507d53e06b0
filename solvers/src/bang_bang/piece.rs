//! One piece of the path as the planner sees it: the hodograph over its parameter t in [0, 1].

use crate::polynomial::Polynomial;

/// C'(t) = g(t)/ω(t)² by axis, with ω = 1 on polynomial pieces, and the square of the tool's speed over π.
///
/// The state of the planner is π = (dt/dτ)²/ω⁴, τ the time, so that rational pieces keep polynomials everywhere:
/// axis k has the velocity g_k √π and the acceleration ω² (g_k π'/2 + g_k' π).
#[derive(Clone, Copy, Debug)]
pub struct Piece<const M: usize, const C: usize> {
    pub g: [Polynomial<C>; M],
    pub weight: Polynomial<C>,
    /// D: the speed squared is D π.
    pub speed: Polynomial<C>,
    /// Degree of the curve itself.
    pub degree: usize,
}

impl<const M: usize, const C: usize> Piece<M, C> {
    /// The piece with these control points, their weights (none: polynomial) and, where the path is one of joints,
    /// the Bernstein coefficients of the tool's speed squared |dC/dt|².
    pub fn new(control: &[[f64; M]], weights: &[f64], speed_sq: Option<&[f64]>) -> Self {
        let degree = control.len() - 1;
        let rational = weights.iter().any(|&weight| weight != weights[0]);
        let (g, weight) = if rational {
            let weight = Polynomial::from_bernstein(weights.iter().map(|&weight| weight / weights[0]));
            let g = std::array::from_fn(|k| {
                // About the first point, for the digits.
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
        let speed = match speed_sq {
            Some(values) => Polynomial::from_bernstein(values.iter().copied()),
            None => sum_of_squares(&g),
        };
        Self { g, weight, speed, degree }
    }

    /// Whether ω varies.
    #[inline(always)]
    pub fn is_rational(&self) -> bool {
        self.weight.degree() > 0
    }
}

fn sum_of_squares<const M: usize, const C: usize>(g: &[Polynomial<C>; M]) -> Polynomial<C> {
    g.iter().fold(Polynomial::constant(0.0), |sum, g| sum.combine(1.0, &g.multiply(g), 1.0))
}
