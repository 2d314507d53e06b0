//! A space path of any length: the two angles of its direction are sums of sines.

use feedplan_jerk::jerk_limited::{Geometry, PathPoint};

/// Pieces of 5 mm.
pub struct Wave {
    knots: Vec<f64>,
}

impl Wave {
    pub fn new(pieces: usize) -> Self {
        Self { knots: (0..=pieces).map(|i| 5.0 * i as f64).collect() }
    }
}

/// Σ amplitude sin(s/length + phase) with its first two derivatives.
fn waves(s: f64, terms: &[[f64; 3]]) -> [f64; 3] {
    let mut out = [0.0; 3];
    for [amplitude, length, phase] in terms {
        let (sin, cos) = (s / length + phase).sin_cos();
        out[0] += amplitude * sin;
        out[1] += amplitude / length * cos;
        out[2] -= amplitude / (length * length) * sin;
    }
    out
}

/// A product with its first two derivatives.
fn product(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[0] * b[2] + 2.0 * a[1] * b[1] + a[2] * b[0]]
}

impl Geometry<3> for Wave {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, _: usize, s: f64) -> PathPoint<3> {
        let turn = waves(s, &[[0.9, 3.1, 0.0], [0.3, 1.7, 0.0], [1.5, 7.3, 0.0]]);
        let rise = waves(s, &[[0.3, 1.7, 0.0], [0.5, 7.3, std::f64::consts::FRAC_PI_2]]);
        let [sin, cos] = [0, 1].map(|part| {
            move |[t, t1, t2]: [f64; 3]| {
                let (sin, cos) = t.sin_cos();
                let [f, f1] = [[sin, cos], [cos, -sin]][part];
                [f, f1 * t1, f1 * t2 - f * t1 * t1]
            }
        });
        let level = cos(rise);
        let axes = [product(level, cos(turn)), product(level, sin(turn)), sin(rise)];
        let [first, second, third] = std::array::from_fn(|order| axes.map(|axis| axis[order]));
        PathPoint { first, second, third, speed_cap: f64::INFINITY }
    }
}
