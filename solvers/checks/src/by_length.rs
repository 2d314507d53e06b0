//! Curves along their arc length, for tests of the jerk-limited planner.

use feedplan_geometry::arc_length::{W, X};
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::extract::extract;
use feedplan_geometry::spline::knots::Spline;
use feedplan_geometry::spline::CompositeCurve;
use feedplan_jerk::jerk_limited::{Geometry, PathPoint};

/// A curve C(t) in M axes with its first three derivatives.
pub trait Curve<const M: usize>: Sync {
    fn at(&self, t: f64) -> [[f64; M]; 4];
}

/// A curve by arc length, with an optional feed.
pub struct ByLength<C, const M: usize> {
    curve: C,
    /// Parameters and lengths of a fine table.
    t: Vec<f64>,
    s: Vec<f64>,
    /// The first entry of each piece.
    first: Vec<usize>,
    knots: Vec<f64>,
    pub feed: f64,
}

impl<C: Curve<M>, const M: usize> ByLength<C, M> {
    /// Pieces between parameters, each of `panels` panels of the table.
    pub fn new(curve: C, parameters: &[f64], panels: usize) -> Self {
        let mut out = Self {
            curve,
            t: vec![parameters[0]],
            s: vec![0.0],
            first: vec![],
            knots: vec![0.0],
            feed: f64::INFINITY,
        };
        for pair in parameters.windows(2) {
            out.first.push(out.t.len() - 1);
            for i in 1..=panels {
                let a = out.t[out.t.len() - 1];
                let b = pair[0] + (pair[1] - pair[0]) * i as f64 / panels as f64;
                let s = out.s[out.s.len() - 1] + out.length(a, b);
                out.t.push(b);
                out.s.push(s);
            }
            out.knots.push(out.s[out.s.len() - 1]);
        }
        out
    }

    fn length(&self, a: f64, b: f64) -> f64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let speed = |t: f64| norm(&self.curve.at(t)[1]);
        half * (0..4).map(|i| W[i] * (speed(middle - half * X[i]) + speed(middle + half * X[i]))).sum::<f64>()
    }

    /// The parameter at s inside a piece.
    fn parameter(&self, piece: usize, s: f64) -> f64 {
        let (low, high) = (self.first[piece], self.first.get(piece + 1).copied().unwrap_or(self.t.len() - 1));
        let i = low + self.s[low..=high].partition_point(|&known| known <= s).clamp(1, high - low) - 1;
        let (a, b) = (self.t[i], self.t[i + 1]);
        let mut t = a + (b - a) * (s - self.s[i]) / (self.s[i + 1] - self.s[i]);
        for _ in 0..20 {
            let step = (s - self.s[i] - self.length(a, t)) / norm(&self.curve.at(t)[1]);
            t = (t + step).clamp(a, b);
            // Newton's method squares the error: the next step would be below rounding.
            if step.abs() < 1e-8 * (b - a) {
                break;
            }
        }
        t
    }
}

impl<C: Curve<M>, const M: usize> Geometry<M> for ByLength<C, M> {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, piece: usize, s: f64) -> PathPoint<M> {
        let (start, end) = (self.knots[piece], self.knots[piece + 1]);
        // At a knot, the derivatives are those of the given piece.
        let inside = 1e-9 * (end - start);
        let t = self.parameter(piece, s.clamp(start + inside, end - inside));
        let [_, d1, d2, d3] = self.curve.at(t);
        let speed = dot(&d1, &d1).sqrt();
        let rate = dot(&d1, &d2) / speed;
        let change = (dot(&d2, &d2) + dot(&d1, &d3) - rate * rate) / speed;
        let u1 = 1.0 / speed;
        // u' and u'' = du'/du u' of the parameter along the length.
        let (slope, bend) =
            (-rate / (speed * speed), -change / speed.powi(2) + 2.0 * rate * rate / speed.powi(3));
        let u2 = slope * u1;
        let u3 = (bend * u1 + slope * slope) * u1;
        let of = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
        PathPoint {
            first: of(&|k| d1[k] * u1),
            second: of(&|k| d2[k] * u1 * u1 + d1[k] * u2),
            third: of(&|k| d3[k] * u1.powi(3) + 3.0 * d2[k] * u1 * u2 + d1[k] * u3),
            speed_cap: self.feed,
        }
    }
}

/// x = a cos t, y = a sin t cos t.
pub struct Lemniscate(pub f64);

impl Curve<2> for Lemniscate {
    fn at(&self, t: f64) -> [[f64; 2]; 4] {
        let (a, (s, c), (s2, c2)) = (self.0, t.sin_cos(), (2.0 * t).sin_cos());
        [[a * c, 0.5 * a * s2], [-a * s, a * c2], [-a * c, -2.0 * a * s2], [a * s, -4.0 * a * c2]]
    }
}

pub struct Trefoil(pub f64);

impl Curve<3> for Trefoil {
    fn at(&self, t: f64) -> [[f64; 3]; 4] {
        let quarter = std::f64::consts::FRAC_PI_2;
        std::array::from_fn(|k| {
            let turn = k as f64 * quarter;
            let sin = |n: f64| n.powi(k as i32) * (n * t + turn).sin();
            let cos = |n: f64| n.powi(k as i32) * (n * t + turn).cos();
            [sin(1.0) + 2.0 * sin(2.0), cos(1.0) - 2.0 * cos(2.0), -sin(3.0)].map(|x| self.0 * x)
        })
    }
}

/// A NURBS curve in the plane, by its pieces and the parameters at their ends.
pub struct Nurbs {
    pieces: CompositeCurve<2>,
    pub parameters: Vec<f64>,
}

impl Nurbs {
    /// The curve of `benchmarks/curves/butterfly.json`.
    pub fn butterfly() -> Self {
        let text = include_str!("../../../benchmarks/curves/butterfly.json");
        let numbers = |key: &str| -> Vec<f64> {
            let at = text.find(&format!("\"{key}\"")).expect("the key is there") + key.len() + 3;
            let end = at + text[at..].find('"').unwrap_or(text.len() - at);
            text[at..end]
                .split(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | 'e' | 'E' | '+')))
                .filter_map(|word| word.parse().ok())
                .collect()
        };
        let (degree, knots, weights) = (numbers("degree")[0] as usize, numbers("knots"), numbers("weights"));
        let points = numbers("control_points");
        let control = points.chunks(points.len() / weights.len()).map(|point| [point[0], point[1]]).collect();
        let mut parameters = knots[degree..knots.len() - degree].to_vec();
        parameters.dedup();
        let spline = Spline::new(degree, knots, control, weights).expect("a spline");
        Self { pieces: extract(&spline).expect("one curve"), parameters }
    }
}

impl Curve<2> for Nurbs {
    fn at(&self, t: f64) -> [[f64; 2]; 4] {
        let inner = &self.parameters[1..self.parameters.len() - 1];
        let i = inner.partition_point(|&knot| knot <= t);
        derivatives(&self.pieces.piece(i), t - self.parameters[i])
    }
}
