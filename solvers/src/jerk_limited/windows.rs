//! Paths of any length, in overlapping windows.

use super::interior_point::{self, InteriorPoint};
use super::prepare::Prepared;
use super::stretch::ramps;
use super::{hermite, Effort, Fault, Geometry, Plan, Problem, Profile};

pub fn solve<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    effort: &Effort,
    mut finished: impl FnMut(&Profile),
) -> Result<Plan, Fault> {
    let mut prepared = Prepared::new(problem, effort.resolution)?;
    let count = prepared.grid.pieces.len();
    let own = interior_point::Effort {
        tolerance: effort.tolerance,
        max_iterations: effort.max_iterations,
        deadline: effort.deadline,
        barrier: 1.0,
    };
    let mut stretch = prepared.stretch(0..count);
    let mut x = std::mem::take(&mut prepared.x);
    let verdict =
        stretch.improve(&problem.limits, prepared.bounds, &mut x, false, &own, &mut InteriorPoint::default());
    let nodes = &prepared.grid.nodes;
    let time: f64 = (0..count).map(|n| hermite::duration(&x, n, nodes[n + 1] - nodes[n])).sum();
    let knots = problem.geometry.knots();
    let profile = Profile {
        s: nodes.clone(),
        speed_sq: x.iter().step_by(2).copied().collect(),
        slope: x.iter().skip(1).step_by(2).copied().collect(),
        ends: [0.0, knots[knots.len() - 1]],
    };
    finished(&profile);
    Ok(Plan {
        profile,
        time: time + ramps(&prepared.bounds, &x),
        converged: verdict.converged,
        iterations: verdict.iterations as f64,
    })
}
