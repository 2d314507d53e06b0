//! The exact time-optimal plan under velocity, acceleration, feed and chord error, its lower bound, and the plans of
//! controllers. Lengths are millimetres, times seconds.

pub mod arc_kind;
pub mod bang_bang;
pub mod bound;
pub mod look_ahead;
pub mod problem;
pub mod profile;
mod runs;

use feedplan_geometry::instances;

use bound::Hint;
use problem::Fault;
use profile::Profile;

/// Bit k is about axis k; an instance has at most as many axes.
type AxisBits = u16;

instances! {
    /// What the exact planner says of a problem.
    pub trait Exact for [3, 6, 9] problem::Problem<'_, M> = {
        /// The fastest profile.
        fn fastest(&self) -> Result<Profile, Fault> = bang_bang::plan;
        /// A time [s] that no profile of the problem is below.
        fn lower_bound(&self, hint: &Hint) -> Result<f64, Fault> = bound::lower_bound;
    }
}
