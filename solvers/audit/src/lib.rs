//! The independent audit: samples what a plan claims and measures every limit by differences of its own.
//!
//! Nothing here comes from a planner, a fit or a sampler: positions are evaluated from the control points, times follow from
//! the law of each phase or are integrated numerically, accelerations are difference quotients. By the mean value theorem a
//! quotient exceeds a limit only where the motion does, so a broken limit found here is truly broken.
//!
//! | module | what it computes |
//! |---|---|
//! | `limits`, `tally` | the limits of a machine; the greatest use of each that an audit found |
//! | `curve`, `polygon`, `hodographs`, `nearest` | the followed path: its pieces, their derivatives, the place nearest to a point |
//! | `moves`, `arc_slope`, `neighbours`, `close_places`, `deviation` | the programmed path, and its distance from the followed one |
//! | `columns`, `joints`, `station`, `together` | the axes, or joints with a kinematics, at a place or at eight places of a piece |
//! | `phases`, `phase_order`, `phase_motion`, `phase_by_length`, `speed_by_length`, `motion` | the phases of a speed profile and the motion on them |
//! | `profile`, `bulge`, `peak`, `phase_jerk`, `chord` | the audit of a profile: every limit on every phase |
//! | `rows`, `differences`, `setpoints` | the audit of setpoints by their differences |
//! | `tracking`, `profile_clock`, `profile_reader`, `against_plan` | the audit of setpoints against their plan |
//! | `number`, `vectors`, `elementary`, `quadrature`, `parallel` | arithmetic for one place or eight, integrals, loops on all cores |
//! | `tolerance` | the pass mark, and the rounding errors that are allowed for |
//!
//! Other crates call `kernels`.

mod against_plan;
mod arc_slope;
mod bulge;
mod chord;
mod close_places;
mod columns;
pub mod curve;
mod deviation;
mod differences;
mod elementary;
mod hodographs;
pub mod joints;
pub mod kernels;
mod limits;
mod motion;
pub mod moves;
mod nearest;
mod neighbours;
mod number;
mod parallel;
mod peak;
mod phase_by_length;
mod phase_jerk;
mod phase_motion;
mod phase_order;
pub mod phases;
mod polygon;
mod profile;
pub mod profile_clock;
mod profile_reader;
mod quadrature;
mod rows;
pub mod setpoints;
mod speed_by_length;
mod station;
mod tally;
mod together;
mod tolerance;
pub mod tracking;
mod vectors;

pub use limits::{Limits, Sided, FEEDS};
use parallel::tell;
pub use parallel::Seen;
pub use tally::{Check, Tally, Worst, CHECKS};
pub use tolerance::{EPS, GAP_TOLERANCE, PASS_EXCESS, PASS_MARK, PLACE_TOLERANCE, ROUNDINGS};
