//! The exact time-optimal speed along quadratic pieces under limits of speed, axis velocity, axis acceleration and
//! chord error.
//!
//! State p = (du/dt)², s = p'/2; axis k accelerates with a_k = q'_k s + q''_k p. A backward pass finds the greatest
//! controllable p, a forward pass the greatest p under it; every arc, event and duration has a closed form or is
//! a root of a polynomial of low degree found by the signs of its Bernstein coefficients.
//! After Zhang et al. 2010 and Timar et al. 2005, with the limits of speed taken into the plan.
//!
//! | file | idea |
//! |---|---|
//! | `piece` | straight or curved |
//! | `turns`, `split` | cut where an axis turns round, and where another velocity cap is the lowest |
//! | `subpiece` | a part as a pass travels it |
//! | `arc`, `curve` | p(x) of an arc, and where one rises above another |
//! | `bang` | the arc of greatest acceleration and the event that ends it |
//! | `slide` | how far a velocity cap can be followed |
//! | `pass`, `straight` | both passes over a sub-piece, over a straight piece |
//! | `run`, `profile`, `duration` | over a run, into columns, in seconds |

mod arc;
mod bang;
mod curve;
mod duration;
mod pass;
mod piece;
mod profile;
mod run;
mod slide;
mod split;
mod straight;
mod subpiece;
mod turns;

use rayon::prelude::*;

pub(crate) use profile::Row;
pub use profile::{ArcKind, Profile, NO_AXIS};

use crate::quadratic::{norm, Quadratic};
use run::Workspace;
use split::ChordLimit;
use subpiece::Axes;

/// Runs are planned in parallel in groups of about this many pieces.
const GROUP: usize = 8192;

/// A path with its limits.
#[derive(Clone, Copy)]
pub struct Problem<'a, const M: usize> {
    pub pieces: &'a [Quadratic<M>],
    /// Run i is the pieces runs[i]..runs[i + 1]. Every run starts and ends at rest, but for the two ends of the path.
    pub runs: &'a [usize],
    /// Greatest speed of each piece, in mm/s.
    pub feed: &'a [f64],
    /// Greatest speed at the ends of the pieces, in mm/s, one more than pieces; infinite for no limit. Not looked
    /// at where a run starts or ends.
    pub junction_speed: &'a [f64],
    /// In mm/s and mm/s².
    pub max_velocity: [f64; M],
    pub max_acceleration: [f64; M],
    /// In mm, infinite for no limit, and the servo period in s.
    pub chord_tolerance: f64,
    pub period: f64,
    /// At the ends of the path, in mm/s.
    pub start_speed: f64,
    pub end_speed: f64,
}

/// Why there is no profile.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// The start speed is too high; `reachable` is the greatest possible, in mm/s.
    Start { piece: usize, reachable: f64 },
    /// The end speed cannot be reached.
    End { piece: usize, reachable: f64 },
    /// An argument cannot be used; `piece` where it belongs to one.
    Input { piece: Option<usize>, what: String },
    /// A pass makes no headway at u on the piece: a fault of this planner.
    Stuck { piece: usize, u: f64 },
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Start { reachable, .. } => {
                write!(f, "the start speed is too high: at most {reachable} mm/s is possible")
            }
            Self::End { reachable, .. } => {
                write!(f, "the end speed is too high: at most {reachable} mm/s can be reached")
            }
            Self::Input { what, .. } => write!(f, "{what}"),
            Self::Stuck { u, .. } => write!(f, "the planner makes no headway at u = {u}"),
        }
    }
}

impl std::error::Error for Fault {}

/// The problem as the runs see it.
pub(crate) struct Task<'a, const M: usize> {
    pieces: &'a [Quadratic<M>],
    feed: &'a [f64],
    junction_speed: &'a [f64],
    axes: Axes<M>,
    chord: Option<ChordLimit>,
}

/// The fastest profile.
pub fn plan<const M: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    check(problem)?;
    let task = Task {
        pieces: problem.pieces,
        feed: problem.feed,
        junction_speed: problem.junction_speed,
        axes: Axes {
            acceleration: problem.max_acceleration,
            inverse: problem.max_acceleration.map(|a| 1.0 / a),
            least: problem.max_acceleration.iter().fold(f64::INFINITY, |least, &a| least.min(a)),
            velocity_sq: problem.max_velocity.map(|v| v * v),
        },
        chord: ChordLimit::new(problem.chord_tolerance, problem.period, norm(&problem.max_acceleration)),
    };
    let groups = group(problem.runs);
    let last_run = problem.runs.len() - 2;
    let plans: Result<Vec<Profile>, Fault> = groups
        .par_iter()
        .map(|group| {
            let pieces = problem.runs[group.end] - problem.runs[group.start];
            let mut space = Workspace::default();
            let mut profile = Profile::with_capacity(2 * pieces);
            for run in group.clone() {
                let ends = (problem.runs[run], problem.runs[run + 1]);
                let start = if run == 0 { problem.start_speed } else { 0.0 };
                let end = if run == last_run { problem.end_speed } else { 0.0 };
                profile.runs.push(profile.len() as i64);
                run::plan_run(&task, ends, (start * start, end * end), &mut space, &mut profile)?;
            }
            Ok(profile)
        })
        .collect();
    Ok(join(plans?))
}

/// Groups of neighbouring runs with about `GROUP` pieces each.
pub(crate) fn group(runs: &[usize]) -> Vec<std::ops::Range<usize>> {
    let mut groups = vec![];
    let mut first = 0;
    for run in 0..runs.len() - 1 {
        if runs[run + 1] - runs[first] >= GROUP || run + 2 == runs.len() {
            groups.push(first..run + 1);
            first = run + 1;
        }
    }
    groups
}

/// One profile of all groups.
pub(crate) fn join(plans: Vec<Profile>) -> Profile {
    let mut plans = plans.into_iter();
    let mut all = plans.next().unwrap_or_default();
    for plan in plans {
        let offset = all.len() as i64;
        all.runs.extend(plan.runs.iter().map(|start| start + offset));
        all.append(plan);
    }
    all.runs.push(all.len() as i64);
    all
}

/// Every argument once: lengths, ranges, finite numbers, pieces of some length.
fn check<const M: usize>(problem: &Problem<M>) -> Result<(), Fault> {
    let count = problem.pieces.len();
    let wrong = |what: String| Err(Fault::Input { piece: None, what });
    let positive = |value: f64| value > 0.0 && value.is_finite();
    for (name, length, expected) in
        [("feeds", problem.feed.len(), count), ("junction speeds", problem.junction_speed.len(), count + 1)]
    {
        if length != expected {
            return wrong(format!("{length} {name} for {count} pieces: {expected} are needed"));
        }
    }
    let runs = problem.runs;
    if runs.len() < 2
        || runs[0] != 0
        || runs[runs.len() - 1] != count
        || runs.windows(2).any(|run| run[0] >= run[1])
    {
        return wrong(format!(
            "the runs do not divide the {count} pieces: give rising offsets from 0 to {count}"
        ));
    }
    for k in 0..M {
        let (v, a) = (problem.max_velocity[k], problem.max_acceleration[k]);
        if !positive(v) {
            return wrong(format!("the velocity limit of axis {k} is {v} mm/s: give a positive number"));
        }
        if !positive(a) {
            return wrong(format!("the acceleration limit of axis {k} is {a} mm/s²: give a positive number"));
        }
    }
    for (name, speed) in [("start", problem.start_speed), ("end", problem.end_speed)] {
        if !(speed >= 0.0 && speed.is_finite()) {
            return wrong(format!("the {name} speed is {speed} mm/s: give a finite number, 0 or more"));
        }
    }
    if problem.chord_tolerance.is_nan() || problem.chord_tolerance <= 0.0 {
        return wrong(format!(
            "the chord tolerance is {} mm: give a positive number",
            problem.chord_tolerance
        ));
    }
    if problem.chord_tolerance.is_finite() && !positive(problem.period) {
        return wrong(format!("the servo period is {} s: give a positive number", problem.period));
    }
    for (i, piece) in problem.pieces.iter().enumerate() {
        let wrong = |what: String| Err(Fault::Input { piece: Some(i), what });
        if !piece.control.iter().flatten().all(|value| value.is_finite()) {
            return wrong("a control point is not a finite number".into());
        }
        if piece.control[0] == piece.control[1] && piece.control[1] == piece.control[2] {
            return wrong("the piece has no length: leave it out".into());
        }
        if !positive(piece.width) {
            return wrong(format!("the parameter width is {}: give a positive number", piece.width));
        }
        if !positive(problem.feed[i]) {
            return wrong(format!("the feed is {} mm/s: give a positive finite number", problem.feed[i]));
        }
    }
    for (i, &speed) in problem.junction_speed.iter().enumerate() {
        if speed.is_nan() || speed < 0.0 {
            return Err(Fault::Input {
                piece: Some(i.min(count - 1)),
                what: format!("the junction speed is {speed} mm/s: give 0 or more"),
            });
        }
    }
    Ok(())
}
