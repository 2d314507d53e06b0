//! The plan of a path by those axes alone that move on it: an axis at rest has no rows in the solver. Most pieces of most
//! programs move two axes of three, or three of five.

use super::profile::Plan;
use super::windows;
use crate::path_problem::{Effort, Fault, Geometry, Limits, PathPoint, PathPoints, Problem};

/// A path by K of its axes.
struct MovingAxes<'a, const K: usize> {
    knots: &'a [f64],
    at: &'a (dyn Fn(usize, f64) -> PathPoint<K> + Sync),
    at_four: &'a (dyn Fn(usize, [f64; 4]) -> PathPoints<K> + Sync),
}

impl<const K: usize> Geometry<K> for MovingAxes<'_, K> {
    fn knots(&self) -> &[f64] {
        self.knots
    }

    fn at(&self, piece: usize, s: f64) -> PathPoint<K> {
        (self.at)(piece, s)
    }

    fn at_four(&self, piece: usize, s: [f64; 4]) -> PathPoints<K> {
        (self.at_four)(piece, s)
    }
}

/// The plan of least time. The axes that do not move by `moves` are at rest on the whole path.
pub fn plan<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    moves: &[bool; M],
    effort: &Effort,
) -> Result<Plan, Fault> {
    match moves.iter().filter(|&&moves| moves).count() {
        0..=2 => plan_by::<G, M, 2>(problem, moves, effort),
        3 => plan_by::<G, M, 3>(problem, moves, effort),
        4 => plan_by::<G, M, 4>(problem, moves, effort),
        5 => plan_by::<G, M, 5>(problem, moves, effort),
        6 => plan_by::<G, M, 6>(problem, moves, effort),
        _ => plan_by::<G, M, M>(problem, moves, effort),
    }
}

/// The plan by K axes, all that move among them.
fn plan_by<G: Geometry<M>, const M: usize, const K: usize>(
    problem: &Problem<G, M>,
    moves: &[bool; M],
    effort: &Effort,
) -> Result<Plan, Fault> {
    let mut order: [usize; M] = std::array::from_fn(|axis| axis);
    order.sort_by_key(|&axis| !moves[axis]);
    let by = |all: &[f64; M]| -> [f64; K] { std::array::from_fn(|i| all[order[i]]) };
    let at = |piece: usize, s: f64| {
        let point = problem.geometry.at(piece, s);
        PathPoint {
            first: by(&point.first),
            second: by(&point.second),
            third: by(&point.third),
            speed_cap: point.speed_cap,
        }
    };
    let at_four = |piece: usize, s: [f64; 4]| {
        let points = problem.geometry.at_four(piece, s);
        PathPoints { q: std::array::from_fn(|i| points.q[order[i]]), speed_cap: points.speed_cap }
    };
    let Limits { velocity, acceleration, jerk } = &problem.limits;
    let own = Problem {
        geometry: &MovingAxes { knots: problem.geometry.knots(), at: &at, at_four: &at_four },
        limits: Limits {
            velocity: [0, 1].map(|sign| by(&velocity[sign])),
            acceleration: [0, 1].map(|sign| by(&acceleration[sign])),
            jerk: by(jerk),
        },
        caps: problem.caps,
        ends: problem.ends,
    };
    windows::plan(&own, effort)
}
