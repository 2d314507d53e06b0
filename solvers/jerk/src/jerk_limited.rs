//! The speed profile of least time along a path, under limits of velocity, acceleration and jerk of every axis.
//!
//! Input: derivatives of the axes by the arc length s [mm] (`Geometry`), limits of each axis, speed caps. Output: the
//! square of the speed w(s) = v² [mm²/s²] as a C¹ cubic spline (`Profile`). An axis q(s) moves with
//!
//!   velocity q' √w,   acceleration q'' w + q' w'/2,   jerk √w (q''' w + 3/2 q'' w' + 1/2 q' w'')
//!
//! and the time is T = ∫ ds/√w. Only the limit of jerk is not convex in w; its slack J w^(−1/2) ∓ (q''' w + …) is
//! convex, so that its tangent at a feasible w is a safe constraint.
//!
//! | module | what it computes |
//! |---|---|
//! | `speed_envelope`, `grid` | the stations of the spline, about equal in travel time |
//! | `rest_ramp` | the start from rest and the stop: constant jerk, w ∝ s^(4/3), or constant acceleration, w ∝ s |
//! | `initial_plan`, `prepare` | a first plan within all limits |
//! | `constraints`, `exact`, `relaxed` | the limits as slacks; the true problem and its convex relaxation |
//! | `interior_point`, `newton`, `working_space`, `columns`, `band` | the primal-dual interior-point method on one window |
//! | `intersample_check`, `window` | the limits between the collocation points |
//! | `refinement` | the rough plan on a coarse grid, and where shorter intervals pay |
//! | `windows` | paths of any length |
//! | `held` | where the feed is held, and the stretches between such places |
//! | `speed_limit`, `lower_bound` | speeds that no motion exceeds; a lower bound on the time on the same grid |
//! | `cases` | a closer lower bound where the relaxation leaves a wide gap |
//! | `on_path` | the planner on the package's own paths |
//! | `turns` | the accelerations with which lines turn back |
//!
//! The limits hold to a relative error of 5e-7, as checked at 16 samples of each interval with the path's true derivatives. Every
//! iterate is a valid plan, so that a planner that is stopped returns the best plan so far. The method is our own; the predictor
//! and corrector are those of Mehrotra (SIAM J. Optim. 2, 1992).

mod band;
mod cases;
mod coarse;
mod columns;
mod constraints;
mod exact;
mod forms;
mod grid;
mod held;
mod hermite;
mod initial_plan;
mod interior_point;
mod intersample_check;
#[cfg(test)]
mod levels;
mod lower_bound;
mod model;
mod newton;
pub mod on_path;
mod prepare;
pub(crate) mod profile;
#[cfg(test)]
mod profiles;
mod refinement;
mod relaxed;
pub(crate) mod rest_ramp;
mod sides;
mod speed_envelope;
mod speed_limit;
mod turns;
mod window;
mod window_end;
mod windows;
mod working_space;

pub use crate::path_problem::{Effort, End, Fault, Geometry, Limits, PathPoint, Problem, SpeedCap};
pub use profile::{Plan, Profile};
pub use windows::plan;
