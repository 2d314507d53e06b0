//! Plane paths of smooth bends, for which the jerk-limited planner needs only closed forms: the curvature is a sum of sech²
//! bumps.

use feedplan_jerk::jerk_limited::{Geometry, PathPoint};

/// A bend by an angle within about twice its width.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    pub s: f64,
    pub angle: f64,
    pub width: f64,
}

/// A straight path with bends; a piece ends in the middle of each bend.
#[derive(Clone, Debug)]
pub struct Bends {
    knots: Vec<f64>,
    bends: Vec<Bend>,
    /// The direction at the start.
    theta: f64,
    pub feed: f64,
}

impl Bends {
    /// From bends in rising order of s inside (0, length).
    pub fn new(length: f64, bends: Vec<Bend>) -> Self {
        let knots = std::iter::once(0.0).chain(bends.iter().map(|bend| bend.s)).chain([length]).collect();
        Self { knots, bends, theta: 0.3, feed: f64::INFINITY }
    }

    /// From bends as for `new`, with the direction `theta` [rad] at the start.
    pub fn turned(length: f64, bends: Vec<Bend>, theta: f64) -> Self {
        Self { theta, ..Self::new(length, bends) }
    }

    pub fn bends(&self) -> &[Bend] {
        &self.bends
    }
}

impl Geometry<2> for Bends {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, _: usize, s: f64) -> PathPoint<2> {
        // κ = angle/(2 width) sech²((s − s₀)/width)
        let (mut theta, mut kappa, mut change) = (self.theta, 0.0, 0.0);
        for bend in &self.bends {
            let t = ((s - bend.s) / bend.width).tanh();
            let hump = 0.5 * bend.angle / bend.width * (1.0 - t * t);
            theta += 0.5 * bend.angle * (1.0 + t);
            kappa += hump;
            change -= 2.0 * hump * t / bend.width;
        }
        let (y, x) = theta.sin_cos();
        PathPoint {
            first: [x, y],
            second: [-kappa * y, kappa * x],
            third: [-change * y - kappa * kappa * x, change * x - kappa * kappa * y],
            speed_cap: self.feed,
        }
    }
}
