//! The exact time-optimal plan under velocity, acceleration, feed and chord error, its lower bound, and the plans of
//! controllers. Lengths are millimetres, times seconds.

pub mod arc_kind;
pub mod bang_bang;
pub mod bang_bang_quadratic;
pub mod bernstein;
pub mod bound;
pub mod limit_curve;
pub mod look_ahead;
pub mod planning;

use feedplan_geometry::instances;

use bang_bang_quadratic::{Fault, Profile};
use bound::Hint;

/// Bit k is about axis k; an instance has at most as many axes.
type AxisBits = u16;

instances! {
    /// What the exact planner says of a problem.
    pub trait Exact for [3, 6, 9] bang_bang::Problem<'_, M> = {
        /// The fastest profile; lines and polynomial quadratics go to the planner made for them.
        fn fastest(&self) -> Result<Profile, Fault> = bang_bang::plan_each;
        /// The same by the planner for pieces of any degree alone.
        fn fastest_as_curves(&self) -> Result<Profile, Fault> = bang_bang::plan;
        /// A time [s] that no profile of the problem is below.
        fn lower_bound(&self, hint: &Hint) -> Result<f64, Fault> = bound::lower_bound;
    }
}

instances! {
    /// The same of a path of polynomial quadratics.
    pub trait ExactQuadratic for [3, 6, 9] bang_bang_quadratic::Problem<'_, M> = {
        /// The fastest profile.
        fn fastest(&self) -> Result<Profile, Fault> = bang_bang_quadratic::plan;
    }
}
