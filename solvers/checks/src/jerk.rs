//! The jerk-limited planner on paths of any kind in up to three axes, compiled once for all tests.

use crate::axes::{padded, PADDED};
use feedplan_jerk::jerk_limited::{self, Effort, Fault, Geometry, Limits, PathPoint, Plan, Problem};

/// A path of any kind in `PADDED` axes; those that it does not have rest.
struct Path<'a>(Box<dyn Fn(usize, f64) -> PathPoint<PADDED> + Sync + 'a>, &'a [f64]);

impl Geometry<PADDED> for Path<'_> {
    fn knots(&self) -> &[f64] {
        self.1
    }

    fn at(&self, piece: usize, s: f64) -> PathPoint<PADDED> {
        self.0(piece, s)
    }
}

/// Calls `jerk_limited::plan` with the problem in `PADDED` axes.
pub fn plan<const M: usize>(problem: &Problem<M>, effort: &Effort) -> Result<Plan, Fault> {
    let at = |piece, s| {
        let PathPoint { first, second, third, speed_cap } = problem.geometry.at(piece, s);
        let [first, second, third] = [first, second, third].map(|values| padded(&values, 0.0));
        PathPoint { first, second, third, speed_cap }
    };
    let Limits { velocity, acceleration, jerk } = &problem.limits;
    let limits = Limits {
        velocity: velocity.map(|side| padded(&side, 1.0)),
        acceleration: acceleration.map(|side| padded(&side, 1.0)),
        jerk: padded(jerk, 1.0),
    };
    let geometry = Path(Box::new(at), problem.geometry.knots());
    let moves = std::array::from_fn(|k| k < M && problem.moves[k]);
    let padded = Problem { geometry: &geometry, limits, moves, caps: problem.caps, ends: problem.ends };
    jerk_limited::plan(&padded, effort)
}
