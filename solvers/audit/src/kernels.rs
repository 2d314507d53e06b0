//! The audits for 3, 6 and 9 axes, compiled here, so that crates that call them compile nothing. Axes beyond the machine's own
//! rest and change nothing.

use crate::columns::Axes;
use crate::curve::Followed;
use crate::deviation::{audit_deviation, audit_path};
use crate::joints::columns::JointColumns;
use crate::joints::plan::JointAudit;
use crate::joints::setpoints::JointSetpoints;
use crate::joints::travel::audit_travel;
use crate::moves::Programmed;
use crate::phases::Phases;
use crate::profile::{audit_profile, Audited};
use crate::setpoints::{Chunk, Stream};
use crate::tracking::Plan;
use crate::{Limits, Seen, Tally};

/// What can be asked of limits in M axes, where the joints are the path's axes.
pub trait PlanKernels<const M: usize> {
    /// What the path shows.
    fn path(&self, path: &Followed, phases: Option<&Phases>, seen: Seen) -> Tally<M>;
    /// What the profile shows.
    fn profile(&self, path: &Followed, junction_speed: &[f64], phases: &Phases, seen: Seen) -> Tally<M>;
    /// What path and program show.
    fn deviation(
        &self,
        path: &Followed,
        program: &Programmed,
        phases: Option<&Phases>,
        seen: Seen,
    ) -> Tally<M>;
}

/// What can be asked of setpoints.
pub trait SetpointKernels<const M: usize> {
    /// Looks at the next ones.
    fn take(&mut self, plan: Option<&Plan>, chunk: &Chunk, seen: Seen);
    /// What they have shown.
    fn verdict(self, plan: Option<&Plan>) -> Tally<M>;
}

/// What can be asked of a plan of joints that are not the path's axes.
pub trait JointKernels<const M: usize> {
    /// What its profile shows.
    fn profile(&self, seen: Seen) -> Tally<M>;
    /// Before its first setpoint.
    fn begin(&self) -> JointSetpoints<M>;
    /// Looks at its next setpoints.
    fn take(&self, stream: &mut JointSetpoints<M>, chunk: &Chunk);
    /// What its setpoints have shown.
    fn verdict(&self, stream: JointSetpoints<M>) -> Tally<M>;
}

macro_rules! kernels {
    ($($count:literal)+) => {
        $(impl PlanKernels<$count> for Limits<$count> {
            fn path(&self, path: &Followed, phases: Option<&Phases>, seen: Seen) -> Tally<$count> {
                audit_path(path, phases, self, seen)
            }

            fn profile(
                &self,
                path: &Followed,
                junction_speed: &[f64],
                phases: &Phases,
                seen: Seen,
            ) -> Tally<$count> {
                let of = Audited { junction_speed, phases, limits: self, starts: &phases.starts(path) };
                audit_profile(&of, &|| Box::new(Axes::new(path, self)), seen)
            }

            fn deviation(
                &self,
                path: &Followed,
                program: &Programmed,
                phases: Option<&Phases>,
                seen: Seen,
            ) -> Tally<$count> {
                audit_deviation(path, program, phases, seen)
            }
        }

        impl SetpointKernels<$count> for Stream<$count> {
            fn take(&mut self, plan: Option<&Plan>, chunk: &Chunk, seen: Seen) {
                self.push(plan, chunk, seen);
            }

            fn verdict(self, plan: Option<&Plan>) -> Tally<$count> {
                self.finish(plan)
            }
        }

        impl JointKernels<$count> for JointAudit<'_, $count> {
            fn profile(&self, seen: Seen) -> Tally<$count> {
                let Self { phases, limits, starts, .. } = self;
                let of = Audited { junction_speed: self.path.junction_speed, phases, limits, starts };
                let found = audit_profile(&of, &|| Box::new(JointColumns::new(self)), seen);
                found.merge(audit_travel(self))
            }

            fn begin(&self) -> JointSetpoints<$count> {
                JointSetpoints::new(self)
            }

            fn take(&self, stream: &mut JointSetpoints<$count>, chunk: &Chunk) {
                stream.push(self, chunk);
            }

            fn verdict(&self, stream: JointSetpoints<$count>) -> Tally<$count> {
                stream.finish(self)
            }
        })+
    };
}

#[cfg(not(test))]
kernels!(3 6 9);

// Tests call the kernels directly; one instance shows that all are in use.
#[cfg(test)]
kernels!(3);
