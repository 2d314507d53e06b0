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

pub(crate) use profile::Row;
pub use profile::{Profile, NO_AXIS};

use std::cell::RefCell;

use crate::planning::{ChordLimit, Limits};
use feedplan_geometry::quadratic::{norm, Quadratic};
use feedplan_geometry::watch::Watch;
use piece::Piece;
pub(crate) use run::Workspace;
use subpiece::Axes;

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
    /// Who waits for the answer.
    pub watch: Watch<'a>,
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
    /// Counts pieces.
    watch: Watch<'a>,
}

thread_local! {
    static SPACE: RefCell<Workspace> = RefCell::default();
}

/// The fastest profile.
pub fn plan<const M: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    let limits = Limits {
        runs: problem.runs,
        feed: problem.feed,
        junction_speed: problem.junction_speed,
        max_velocity: [problem.max_velocity; 2],
        max_acceleration: [problem.max_acceleration; 2],
        chord_tolerance: problem.chord_tolerance,
        period: problem.period,
        start_speed: problem.start_speed,
        end_speed: problem.end_speed,
        watch: problem.watch,
    };
    limits.check(problem.pieces.len())?;
    check_pieces(problem.pieces)?;
    let task = Task::new(problem.pieces, &limits);
    limits.over_runs(&SPACE, |pieces, speeds_sq, space, profile| {
        task.plan_run(pieces, speeds_sq, space, profile)
    })
}

impl<'a, const M: usize> Task<'a, M> {
    /// For pieces and limits that have been checked; those of both directions are the same.
    pub(crate) fn new(pieces: &'a [Quadratic<M>], limits: &Limits<'a, M>) -> Self {
        let [acceleration, _] = limits.max_acceleration;
        Self {
            pieces,
            feed: limits.feed,
            junction_speed: limits.junction_speed,
            axes: Axes {
                acceleration,
                inverse: acceleration.map(|a| 1.0 / a),
                least: acceleration.iter().fold(f64::INFINITY, |least, &a| least.min(a)),
                velocity_sq: limits.max_velocity[0].map(|v| v * v),
            },
            chord: ChordLimit::new(limits.chord_tolerance, limits.period, norm(&acceleration)),
            watch: limits.watch.each(limits.feed.len()),
        }
    }

    /// Backward over one piece: v² at its start from v² at its end. `space` holds what `forward_over` takes.
    pub(crate) fn backward_over(&self, i: usize, speed_sq: f64, space: &mut Workspace) -> Result<f64, Fault> {
        run::backward(self, i, &Piece::new(&self.pieces[i]), speed_sq, space)
    }

    /// Forward over the last piece that `backward_over` has left in `space`: v² at its end; appends the arcs.
    pub(crate) fn forward_over(
        &self,
        i: usize,
        speed_sq: f64,
        space: &mut Workspace,
        out: &mut Profile,
    ) -> Result<f64, Fault> {
        run::forward(self, i, &Piece::new(&self.pieces[i]), speed_sq, space, out)
    }

    /// Whether the piece has a cusp at its start and at its end, and its direction there.
    pub(crate) fn ends(&self, i: usize) -> [(bool, [f64; M]); 2] {
        let piece = Piece::new(&self.pieces[i]);
        [(piece.speed[0] == 0.0, piece.direction(false)), (piece.speed[2] == 0.0, piece.direction(true))]
    }

    /// Plans the pieces from the first up to the last from one speed squared to another; appends the arcs.
    pub(crate) fn plan_run(
        &self,
        pieces: (usize, usize),
        speeds_sq: (f64, f64),
        space: &mut Workspace,
        out: &mut Profile,
    ) -> Result<(), Fault> {
        run::plan_run(self, pieces, speeds_sq, space, out)
    }
}

/// Every piece: finite, of some length and width.
fn check_pieces<const M: usize>(pieces: &[Quadratic<M>]) -> Result<(), Fault> {
    for (i, piece) in pieces.iter().enumerate() {
        let wrong = |what: String| Err(Fault::Input { piece: Some(i), what });
        if !piece.control.iter().flatten().all(|value| value.is_finite()) {
            return wrong("a control point is not a finite number".into());
        }
        if piece.control[0] == piece.control[1] && piece.control[1] == piece.control[2] {
            return wrong("the piece has no length: leave it out".into());
        }
        if !(piece.width > 0.0 && piece.width.is_finite()) {
            return wrong(format!("the parameter width is {}: give a positive number", piece.width));
        }
    }
    Ok(())
}
