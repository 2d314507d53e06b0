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
//! | `cusp` | where all axes rest at once, as far as rounding can tell |
//! | `split` | cut where an axis turns round or another velocity cap is the lowest |
//! | `store` | sub-pieces from the backward pass to the forward one |
//! | `time` | the time along the tool's speed cap |
//! | `window` | what is left of a sub-piece ahead of a pass, with the bound on it |
//! | `pass` | one pass over one sub-piece: arcs (`bang`), along the cap (`slide`), along the `limit_curve` |
//! | `check` | whether the arcs keep the limits at some places, for all that rounding did |
//! | `run` | both passes over a run, into columns, in seconds |

mod check;
mod chord;
mod cusp;
mod part;
mod pass;
mod piece;
mod run;
mod split;
mod store;
mod time;
mod window;

use std::cell::RefCell;

use crate::bang_bang_quadratic::{Fault, Profile, Task as QuadraticTask};
use crate::planning::{greater, Both, ChordLimit, Limits};
use feedplan_geometry::quadratic::{norm, Quadratic};
use feedplan_geometry::spline::Piece;
use feedplan_geometry::watch::Watch;
use split::Axes;

/// Axes that the tool itself moves in.
pub const TIP_AXES: usize = 3;

/// Squares of a speed per (du/dt)², a polynomial on each piece.
#[derive(Clone, Copy)]
pub struct SpeedSquare<'a> {
    /// Bernstein coefficients; those of piece i from offset[i] to offset[i + 1].
    pub coefficients: &'a [f64],
    pub offset: &'a [usize],
}

impl<'a> SpeedSquare<'a> {
    /// The coefficients of piece `i`.
    pub fn of(&self, i: usize) -> &'a [f64] {
        &self.coefficients[self.offset[i]..self.offset[i + 1]]
    }

    /// Finite numbers for each of `count` pieces.
    fn fits(&self, count: usize) -> bool {
        is_rising(self.offset, count, self.coefficients.len(), 1)
            && self.coefficients.iter().all(|value| value.is_finite())
    }
}

/// Whether offsets give each of `count` pieces at least so many of `total` rows.
fn is_rising(offset: &[usize], count: usize, total: usize, least: usize) -> bool {
    offset.len() == count + 1
        && offset[0] == 0
        && offset[count] == total
        && offset.windows(2).all(|pair| pair[1] >= pair[0] + least)
}

/// The tool's path beside that of the joints, piece by piece over the same parameter.
#[derive(Clone, Copy)]
pub struct Tip<'a> {
    /// The speed that the feed is about, |C'(u)|².
    pub speed: SpeedSquare<'a>,
    /// Its pieces as those of the joints, for the chord error.
    pub control: &'a [[f64; TIP_AXES]],
    pub weight: &'a [f64],
    pub offset: &'a [usize],
}

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
    /// Where the axes are not those of the tool.
    pub tip: Option<Tip<'a>>,
    /// The speed along the path that laws of jerk are about, where it is not that of the axes: it vanishes only where
    /// all axes rest.
    pub way: Option<SpeedSquare<'a>>,
    /// Of each piece: what the velocity of each axis counts in the speed that the feed limits, |(share_k q_k')| u̇;
    /// empty where all axes count as they are, as where the tool is another one.
    pub feed_share: &'a [[f64; M]],
    /// The rest as of the quadratic planner.
    pub runs: &'a [usize],
    pub feed: &'a [f64],
    pub junction_speed: &'a [f64],
    pub max_velocity: Both<M>,
    pub max_acceleration: Both<M>,
    pub chord_tolerance: f64,
    pub period: f64,
    pub start_speed: f64,
    pub end_speed: f64,
    pub watch: Watch<'a>,
}

impl<'a, const M: usize> Problem<'a, M> {
    /// What the axes count in the feed on piece `i`, where that is not all of them as they are.
    pub fn share(&self, i: usize) -> Option<&'a [f64; M]> {
        self.feed_share.get(i).filter(|share| **share != [1.0; M])
    }
}

/// The problem as the runs see it.
struct Task<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    axes: Axes<M>,
    chord: Option<ChordLimit>,
    /// The planner of lines and polynomial quadratics, for those that are.
    quadratic: Option<QuadraticTask<'a, M>>,
    /// Counts pieces.
    watch: Watch<'a>,
}

impl<const M: usize> Task<'_, M> {
    /// That planner, if piece `i` is for it.
    fn quadratic(&self, i: usize) -> Option<&QuadraticTask<'_, M>> {
        let range = self.problem.offset[i]..self.problem.offset[i + 1];
        let weights = self.problem.weight.get(range.clone()).unwrap_or(&[]);
        let is_one = range.len() <= 3
            && weights.windows(2).all(|pair| pair[0] == pair[1])
            && self.problem.share(i).is_none();
        self.quadratic.as_ref().filter(|_| is_one)
    }
}

/// The fastest profile.
pub fn plan<const M: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    plan_with(problem, None)
}

/// The same; lines and polynomial quadratics go to the planner made for them.
pub fn plan_each<const M: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    // That planner's limits are the same in both directions.
    let sided = |limits: &Both<M>| limits[0] != limits[1];
    if problem.tip.is_some() || sided(&problem.max_velocity) || sided(&problem.max_acceleration) {
        return plan(problem);
    }
    // Pieces of other kinds have no quadratic: what stands in their places is never looked at.
    let nothing = Quadratic { control: [[0.0; M]; 3], width: 0.0 };
    let quadratic = |i: usize| {
        let control = problem.control.get(*problem.offset.get(i)?..*problem.offset.get(i + 1)?)?;
        Quadratic::from_piece(&Piece { control, weights: &[], width: problem.width[i] })
    };
    let pieces: Vec<_> = (0..problem.width.len()).map(|i| quadratic(i).unwrap_or(nothing)).collect();
    plan_with(problem, Some(&pieces))
}

thread_local! {
    static SPACE: RefCell<run::Workspace> = RefCell::default();
}

fn plan_with<const M: usize>(
    problem: &Problem<M>,
    quadratics: Option<&[Quadratic<M>]>,
) -> Result<Profile, Fault> {
    let limits = Limits::of(problem);
    limits.check(problem.width.len())?;
    check_pieces(problem)?;
    let task = Task {
        problem,
        axes: Axes {
            acceleration: problem.max_acceleration,
            velocity_sq: problem.max_velocity.map(|side| side.map(|v| v * v)),
        },
        chord: ChordLimit::new(
            problem.chord_tolerance,
            problem.period,
            // What the joints' limits let the tool have is not known.
            if problem.tip.is_some() { f64::INFINITY } else { norm(&greater(&problem.max_acceleration)) },
        ),
        quadratic: quadratics.map(|pieces| QuadraticTask::new(pieces, &limits)),
        watch: problem.watch.each(problem.width.len()),
    };
    limits.over_runs(&SPACE, |pieces, speeds_sq, space, profile| {
        let (first, last) = pieces;
        match task.quadratic.as_ref().filter(|_| (first..last).all(|i| task.quadratic(i).is_some())) {
            Some(quadratic) => quadratic.plan_run(pieces, speeds_sq, &mut space.quadratic, profile),
            None => run::plan_run(&task, pieces, speeds_sq, space, profile),
        }
    })
}

/// Every piece: finite, of some length and width, its weights positive.
pub fn check_pieces<const M: usize>(problem: &Problem<M>) -> Result<(), Fault> {
    let (offset, count) = (problem.offset, problem.width.len());
    if offset.len() != count + 1
        || offset[0] != 0
        || offset[count] != problem.control.len()
        || offset.windows(2).any(|pair| pair[1] < pair[0] + 2)
        || !(problem.weight.is_empty() || problem.weight.len() == problem.control.len())
    {
        let what = format!(
            "offsets and weights do not fit {count} pieces: give two control points or more for each"
        );
        return Err(Fault::Input { piece: None, what });
    }
    for i in 0..count {
        let wrong = |what: &str| Err(Fault::Input { piece: Some(i), what: what.into() });
        let points = &problem.control[offset[i]..offset[i + 1]];
        if !points.iter().flatten().all(|value| value.is_finite()) {
            return wrong("a control point is not a finite number");
        }
        if points.iter().all(|point| *point == points[0]) {
            return wrong("the piece has no length: leave it out");
        }
        if !(problem.width[i] > 0.0 && problem.width[i].is_finite()) {
            return wrong("the parameter width is not a positive number");
        }
        let weights = problem.weight.get(offset[i]..offset[i + 1]).unwrap_or(&[]);
        if !weights.iter().all(|weight| *weight > 0.0 && weight.is_finite()) {
            return wrong("a weight is not a positive number");
        }
    }
    let shares = problem.feed_share;
    if !(shares.is_empty() || shares.len() == count)
        || !shares.iter().flatten().all(|share| share.is_finite() && *share >= 0.0)
    {
        let what = format!("the shares of the axes in the feed do not fit {count} pieces");
        return Err(Fault::Input { piece: None, what });
    }
    let tip_fits = problem.tip.is_none_or(|tip| {
        is_rising(tip.offset, count, tip.control.len(), 2)
            && tip.speed.fits(count)
            && (tip.weight.is_empty() || tip.weight.len() == tip.control.len())
            && tip.control.iter().flatten().chain(tip.weight).all(|value| value.is_finite())
    });
    if !(tip_fits && problem.way.is_none_or(|way| way.fits(count))) {
        let what = format!("the tool's path does not fit the {count} pieces of the joints");
        return Err(Fault::Input { piece: None, what });
    }
    Ok(())
}
