//! Plans a path with only those axes that move on it: an axis at rest gets no rows in the solver. Most pieces of most programs
//! move two axes of three, or three of five.

use super::profile::Plan;
use super::windows::Rough;
use crate::path_problem::{Effort, Fault, Geometry, Limits, PathPoint, PathPoints, Problem};

/// A path with K of its axes.
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

/// Work on a problem that is reduced to K of its axes.
trait Work {
    type Done;

    fn on<G: Geometry<K>, const K: usize>(self, problem: &Problem<G, K>) -> Self::Done;
}

struct Roughly<'a>(&'a Effort<'a>);

impl Work for Roughly<'_> {
    type Done = Result<Rough, Fault>;

    fn on<G: Geometry<K>, const K: usize>(self, problem: &Problem<G, K>) -> Self::Done {
        Rough::new(problem, self.0)
    }
}

struct Finely<'a>(Rough, f64, &'a Effort<'a>);

impl Work for Finely<'_> {
    type Done = Result<Plan, Fault>;

    fn on<G: Geometry<K>, const K: usize>(self, problem: &Problem<G, K>) -> Self::Done {
        self.0.plan(problem, self.1, self.2)
    }
}

/// The rough plan of a path. Axes with `moves` false are at rest on the whole path.
pub fn rough<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    moves: &[bool; M],
    effort: &Effort,
) -> Result<Rough, Fault> {
    work(problem, moves, Roughly(effort))
}

/// The plan of least time from a rough plan, on the grid that results from this price of an interval, in s.
pub fn plan<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    moves: &[bool; M],
    rough: Rough,
    price: f64,
    effort: &Effort,
) -> Result<Plan, Fault> {
    work(problem, moves, Finely(rough, price, effort))
}

fn work<G: Geometry<M>, W: Work, const M: usize>(
    problem: &Problem<G, M>,
    moves: &[bool; M],
    work: W,
) -> W::Done {
    let Problem { geometry, limits, caps, ends } = *problem;
    let problem: Problem<dyn Geometry<M>, M> = Problem { geometry, limits, caps, ends };
    match moves.iter().filter(|&&moves| moves).count() {
        0..=2 => by::<W, M, 2>(&problem, moves, work),
        3 if const { M > 3 } => by::<W, M, 3>(&problem, moves, work),
        4 if const { M > 4 } => by::<W, M, 4>(&problem, moves, work),
        5 if const { M > 5 } => by::<W, M, 5>(&problem, moves, work),
        6 if const { M > 6 } => by::<W, M, 6>(&problem, moves, work),
        _ => by::<W, M, M>(&problem, moves, work),
    }
}

/// Does the work with K axes, which include all axes that move.
fn by<W: Work, const M: usize, const K: usize>(
    problem: &Problem<dyn Geometry<M> + '_, M>,
    moves: &[bool; M],
    work: W,
) -> W::Done {
    let (mut order, at_rest): (Vec<usize>, Vec<usize>) = (0..M).partition(|&axis| moves[axis]);
    order.extend(at_rest);
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
    work.on(&own)
}
