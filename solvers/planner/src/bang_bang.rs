//! The exact time-optimal speed along a path under limits of speed, axis velocity, axis acceleration and chord error.
//!
//! State p = (du/dt)², s = p'/2 = d²u/dt². Axis k has the velocity q'_k √p and the acceleration a_k = q'_k s + q''_k p.
//! For every λ in [0, 1] a feasible profile p scaled to λ p stays feasible. So the values of p from which the end of a
//! run can be reached are an interval [0, K(u)], and two greedy passes over a run are exact: backward, under the velocity
//! caps and the limit curve, a pass finds K; forward under K, a pass finds the fastest profile. Neither searches for
//! switches: each phase of greatest acceleration ends at the first root of a polynomial.
//! After Zhang et al. 2010 and Timar et al. 2005, with the limits of speed taken into the plan.
//!
//! A piece is planned by one of three kernels:
//!
//! | kernel | pieces | phases and switches |
//! |---|---|---|
//! | `line` | straight ones | v² is linear in the length: the trapezoid |
//! | `quadratic` | polynomials of degree 2 in the tool's own axes | closed forms, and roots of quartics |
//! | `curve` | all others: any degree, rational, joints with a tool elsewhere | roots of Bernstein polynomials |
//!
//! | file | content |
//! |---|---|
//! | `run` | both passes over a run, from piece to piece |
//! | `chord` | the chord-error limit as speeds whose squares are linear in the parameter |
//! | `time` | the time along a cap of the tool's speed |
//! | `tolerance` | every tolerance, with its reason |

mod chord;
mod curve;
mod line;
mod quadratic;
mod run;
mod time;
mod tolerance;

use std::cell::RefCell;

use crate::problem::{greater, ChordLimit, Fault, Problem};
use crate::profile::Profile;
use crate::runs::over_runs;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::watch::Watch;

/// The problem as the runs see it.
struct Task<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    /// Limits of the axes for the kernel of curves, and for the others.
    axes: curve::Axes<M>,
    plain_axes: quadratic::Axes<M>,
    chord: Option<ChordLimit>,
    /// Lines and quadratics have kernels of their own: the axes are the tool's, and their limits are the same in both
    /// directions.
    plain: bool,
    /// Counts pieces.
    watch: Watch<'a>,
}

thread_local! {
    static SPACE: RefCell<run::Workspace> = RefCell::default();
}

/// The fastest profile.
pub fn plan<const M: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    problem.check()?;
    let (velocity, acceleration) = (&problem.max_velocity, &problem.max_acceleration);
    // What the joints' limits let the tool have is not known.
    let most = if problem.tip.is_some() { f64::INFINITY } else { norm(&greater(acceleration)) };
    let task = Task {
        problem,
        axes: curve::Axes {
            acceleration: *acceleration,
            velocity_sq: velocity.map(|side| side.map(|v| v * v)),
        },
        plain_axes: quadratic::Axes::new(acceleration[0], velocity[0]),
        chord: ChordLimit::new(problem.chord_tolerance, problem.period, most),
        plain: problem.tip.is_none() && velocity[0] == velocity[1] && acceleration[0] == acceleration[1],
        watch: problem.watch.each(problem.len()),
    };
    over_runs(problem, &SPACE, |pieces, speeds_sq, space, profile| {
        run::plan_run(&task, pieces, speeds_sq, space, profile)
    })
}
