//! The exact time-optimal speed along polynomial pieces of any degree and rational ones, under limits of speed, axis
//! velocity, axis acceleration and chord error.
//!
//! The passes are those of `bang_bang_quadratic`; here the limit curve is not convex, and every event is the first root
//! of a Bernstein polynomial whose coefficients' signs prove that none is missed.
//!
//! | file | idea |
//! |---|---|
//! | `piece` | the hodograph of a piece, weights multiplied out |
//! | `chord` | the chord-error limit as speeds linear in the parameter |
//! | `split` | cut where an axis turns round or another velocity cap is the lowest |
//! | `window` | what is left of a sub-piece ahead of a pass, with the bound on it |
//! | `pass` | one pass over one sub-piece |
//! | `run` | both passes over a run, into columns, in seconds |

mod chord;
mod pass;
mod piece;
mod run;
mod split;
mod window;

use rayon::prelude::*;

use crate::bang_bang_quadratic::{group, join, Fault, Profile};
use crate::quadratic::norm;
use chord::ChordLimit;
use split::Axes;

/// A path of pieces of any degree with its limits.
#[derive(Clone, Copy)]
pub struct Problem<'a, const M: usize> {
    /// Control points of all pieces; piece i has control[offset[i]..offset[i + 1]].
    pub control: &'a [[f64; M]],
    /// Their weights; empty where all pieces are polynomial.
    pub weight: &'a [f64],
    pub offset: &'a [usize],
    /// Parameter intervals.
    pub width: &'a [f64],
    /// Where the axes are not those of the tool tip: Bernstein coefficients of the tip's |dC/dt|² over each piece, and
    /// their offsets.
    pub tip_speed: Option<(&'a [f64], &'a [usize])>,
    /// The rest as of the quadratic planner.
    pub runs: &'a [usize],
    pub feed: &'a [f64],
    pub junction_speed: &'a [f64],
    pub max_velocity: [f64; M],
    pub max_acceleration: [f64; M],
    pub chord_tolerance: f64,
    pub period: f64,
    pub start_speed: f64,
    pub end_speed: f64,
}

/// The problem as the runs see it.
struct Task<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    axes: Axes<M>,
    chord: Option<ChordLimit>,
}

/// The fastest profile. `C` coefficients suffice for polynomial pieces
/// of a degree up to (C + 2)/4 and rational ones of a degree up to (C + 6)/8.
pub fn plan<const M: usize, const C: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    let task = Task {
        problem,
        axes: Axes {
            acceleration: problem.max_acceleration,
            velocity_sq: problem.max_velocity.map(|v| v * v),
        },
        chord: match problem.tip_speed {
            None => ChordLimit::new(problem.chord_tolerance, problem.period, norm(&problem.max_acceleration)),
            Some(_) => None,
        },
    };
    let groups = group(problem.runs);
    let last_run = problem.runs.len() - 2;
    let plans: Result<Vec<Profile>, Fault> = groups
        .par_iter()
        .map(|group| {
            let mut space = run::Workspace::default();
            let mut profile = Profile::default();
            for run in group.clone() {
                let ends = (problem.runs[run], problem.runs[run + 1]);
                let start = if run == 0 { problem.start_speed } else { 0.0 };
                let end = if run == last_run { problem.end_speed } else { 0.0 };
                profile.runs.push(profile.len() as i64);
                run::plan_run::<M, C>(&task, ends, (start * start, end * end), &mut space, &mut profile)?;
            }
            Ok(profile)
        })
        .collect();
    Ok(join(plans?))
}
