//! The audit of joints for 3, 6 and 9 axes, compiled here: those beyond the machine's own rest and change nothing.

use super::profile::{audit_joint_profile, JointAudit};
use super::setpoints::JointSetpoints;
use crate::setpoints::Chunk;
use crate::{Seen, Tally};

/// What can be asked of a plan of joints.
pub trait Kernels<const M: usize> {
    /// What its profile shows.
    fn profile(&self, seen: Seen) -> Tally<M>;
    /// Before its first setpoint.
    fn begin(&self) -> JointSetpoints<M>;
    /// Looks at its next setpoints.
    fn push(&self, stream: &mut JointSetpoints<M>, chunk: &Chunk);
    /// What its setpoints have shown.
    fn finish(&self, stream: JointSetpoints<M>) -> Tally<M>;
}

macro_rules! kernels {
    ($($count:literal)+) => {
        $(impl Kernels<$count> for JointAudit<'_, $count> {
            fn profile(&self, seen: Seen) -> Tally<$count> {
                audit_joint_profile(self, seen)
            }

            fn begin(&self) -> JointSetpoints<$count> {
                JointSetpoints::new(self)
            }

            fn push(&self, stream: &mut JointSetpoints<$count>, chunk: &Chunk) {
                stream.push(self, chunk);
            }

            fn finish(&self, stream: JointSetpoints<$count>) -> Tally<$count> {
                stream.finish(self)
            }
        })+
    };
}

kernels!(3 6 9);
