//! Least time along a path under limits of velocity, acceleration and jerk of every axis.
//!
//! With s along the path and w(s) = v² = ṡ², an axis q(s) moves with
//!
//!   velocity q' √w,   acceleration q'' w + q' w'/2,   jerk √w (q''' w + 3/2 q'' w' + 1/2 q' w'')
//!
//! and the time is ∫ ds/√w. w is a C¹ cubic spline on nodes about equal in travel time. `survey` and `grid` place
//! the nodes, `rest` is the ramp from rest, `baseline` a first plan, `interior_point` improves one stretch,
//! `stretch` holds the limits between the points, and `windows` does so for paths of any length. `bound`
//! proves how near to the least time on its grid a plan is.
//!
//! Limits hold to 5e-7 of themselves at all places between the nodes, as far as twelve samples of each interval of
//! the path's true derivatives tell. All of it keeps a valid plan at all times: whoever stops it gets the best one so far.

mod band;
mod baseline;
mod between;
mod bound;
mod exact;
mod grid;
mod hermite;
mod interior_point;
#[cfg(test)]
mod levels;
mod model;
mod newton;
mod prepare;
mod profile;
mod relaxed;
mod rest;
mod rows;
mod sides;
mod stretch;
mod survey;
mod windows;

use std::time::Instant;

use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::Both;

pub use bound::{certify, Certificate};
pub use profile::Profile;

/// Derivatives of the axes along the path at a place, and the greatest speed there.
#[derive(Clone, Copy, Debug)]
pub struct Place<const M: usize> {
    /// q' in mm (or degrees) per mm.
    pub first: [f64; M],
    pub second: [f64; M],
    pub third: [f64; M],
    /// The greatest speed along the path by feed and chord error, in mm/s; infinite where there is none.
    pub speed_cap: f64,
}

/// A path: pieces between knots, each with smooth derivatives.
pub trait Geometry<const M: usize>: Sync {
    /// The ends of the pieces along the path in mm, rising from 0. q' is continuous over all of them; q'' may jump
    /// where the problem caps the speed, q''' anywhere.
    fn knots(&self) -> &[f64];

    /// Derivatives at s on a piece, its ends included.
    fn at(&self, piece: usize, s: f64) -> Place<M>;
}

/// Greatest magnitudes for each axis, in mm/s, mm/s² and mm/s³: of what is positive and of what is negative, but for jerk.
#[derive(Clone, Copy, Debug)]
pub struct Limits<const M: usize> {
    pub velocity: Both<M>,
    pub acceleration: Both<M>,
    pub jerk: [f64; M],
}

/// A greatest speed at one place, and a lower limit of jerk around it: where q'' jumps the acceleration does, and setpoints
/// show that as a jerk.
#[derive(Clone, Copy, Debug)]
pub struct SpeedCap {
    /// Along the path, in mm.
    pub s: f64,
    /// In mm/s; infinite for none.
    pub speed: f64,
    /// As far as this to both sides, in mm, …
    pub reach: f64,
    /// … the limits of jerk are lower by this part, less than 1.
    pub share: f64,
}

impl SpeedCap {
    /// A greatest speed alone.
    pub fn new(s: f64, speed: f64) -> Self {
        Self { s, speed, reach: 0.0, share: 0.0 }
    }
}

/// How a path begins or ends.
#[derive(Clone, Copy, Debug)]
pub enum End {
    Rest,
    /// With a speed in mm/s above 0 and an acceleration along the path in mm/s². A first plan does not meet it: only
    /// after some iterations there is a plan.
    Moving {
        speed: f64,
        acceleration: f64,
    },
}

/// A path with its limits.
pub struct Problem<'a, G, const M: usize> {
    pub geometry: &'a G,
    pub limits: Limits<M>,
    /// Rising in s, speeds above 0.
    pub caps: &'a [SpeedCap],
    pub ends: [End; 2],
}

/// How well, and how long, to plan.
#[derive(Clone, Copy, Debug)]
pub struct Effort<'a> {
    /// Intervals per time in which the speed can change to its like: 16 leave less than 1e-4 of the time.
    pub resolution: f64,
    /// The gap of complementarity at which to stop, in parts of the time.
    pub tolerance: f64,
    /// Iterations for each stretch.
    pub max_iterations: usize,
    /// A plan is due by then, whatever its quality.
    pub deadline: Option<Instant>,
    /// Paths of more intervals than this are solved in overlapping windows of about so many.
    pub window: usize,
    /// Who waits for the plan.
    pub watch: Watch<'a>,
}

impl Default for Effort<'_> {
    fn default() -> Self {
        Self {
            resolution: 16.0,
            tolerance: 1e-7,
            max_iterations: 400,
            deadline: None,
            window: 4000,
            watch: Watch::default(),
        }
    }
}

impl Effort<'_> {
    /// Whether the deadline has passed.
    pub fn expired(&self) -> bool {
        self.deadline.is_some_and(|end| Instant::now() >= end)
    }
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// The problem is ill-posed; the sentence says how.
    Input(String),
    /// No valid plan was found near this place, in mm along the path: no speed is possible there, or a moving end is
    /// not reached from the path.
    NoPlan { s: f64 },
}

/// A plan.
#[derive(Clone, Debug)]
pub struct Plan {
    pub profile: Profile,
    /// In s.
    pub time: f64,
    /// Whether every stretch came to its optimum.
    pub converged: bool,
    /// How far it may be above the least time on its grid, in s, by the complementarity that the multipliers leave; an
    /// estimate and no bound, and of no meaning where the deadline came first.
    pub excess: f64,
    /// Newton steps, summed over the intervals they were taken on, in parts of all intervals.
    pub iterations: f64,
}

/// The plan of least time.
pub fn plan<G: Geometry<M>, const M: usize>(problem: &Problem<G, M>, effort: &Effort) -> Result<Plan, Fault> {
    windows::solve(problem, effort, |_| {})
}

/// The same, handing out each stretch of the profile as soon as it is final, from start to end.
pub fn stream<G: Geometry<M>, const M: usize>(
    problem: &Problem<G, M>,
    effort: &Effort,
    finished: impl FnMut(&Profile),
) -> Result<Plan, Fault> {
    windows::solve(problem, effort, finished)
}
