//! Speed plans without a jerk limit: the exact time-optimal profile under axis velocity, axis acceleration, feed and chord error
//! (`bang_bang`), a proven lower bound of its time (`lower_bound`), and the trapezoidal plan of machine controllers
//! (`trapezoid`). Lengths are millimetres, angles degrees, times seconds.

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

/// A set of axes: bit k stands for axis k. There are at most 16 axes.
type AxisBits = u16;

instances! {
    /// The exact planner and its lower bound.
    pub trait Exact for [3, 9] problem::Problem<'_, M> = {
        fn fastest(&self) -> Result<Profile, Fault> = bang_bang::plan;
        /// A proven lower bound [s] of the time of every feasible profile.
        fn lower_bound(&self, hint: &Phases) -> Result<f64, Fault> = lower_bound::lower_bound;
    }
}
