//! Speed plans without a limit of jerk: the exact time-optimal plan under axis velocity, axis acceleration, feed and
//! chord error, its lower bound, and the speeds of controllers. Lengths are millimetres, angles degrees, times
//! seconds.

pub mod bang_bang;
pub mod lower_bound;
pub mod phase_law;
pub mod phases;
pub mod problem;
pub mod profile;
mod runs;
pub mod trapezoid;

use feedplan_geometry::instances;

use phases::Phases;
use problem::Fault;
use profile::Profile;

/// Bit k stands for axis k; M is at most 16.
type AxisBits = u16;

instances! {
    /// The exact planner and its lower bound.
    pub trait Exact for [3, 6, 9] problem::Problem<'_, M> = {
        fn fastest(&self) -> Result<Profile, Fault> = bang_bang::plan;
        /// A time [s] below that of every feasible profile.
        fn lower_bound(&self, hint: &Phases) -> Result<f64, Fault> = lower_bound::lower_bound;
    }
}
