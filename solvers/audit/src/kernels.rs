//! The audits for 3, 6 and 9 axes, compiled here so that the crates that call them need not compile them. Axes beyond those of
//! the machine rest and do not affect the result.

use crate::columns::Columns;
use crate::curve::Followed;
use crate::deviation::{audit_deviation, audit_path};
use crate::joints::path::JointPath;
use crate::joints::travel::audit_travel;
use crate::moves::Programmed;
use crate::phases::Phases;
use crate::profile::{audit_profile, Audited};
use crate::setpoints::{Chunk, Stream};
use crate::tracking::Plan;
use crate::{Limits, Seen, Tally};

/// Audits against limits of M axes or joints.
pub trait PlanKernels<const M: usize> {
    /// Audits the path on its own.
    fn path(&self, path: &Followed, phases: Option<&Phases>, seen: Seen) -> Tally<M>;
    /// Audits the profile of axes.
    fn profile(&self, path: &Followed, junction_speed: &[f64], phases: &Phases, seen: Seen) -> Tally<M>;
    /// Audits the profile of joints that are not the axes of the path.
    fn joint_profile(
        &self,
        joints: &JointPath,
        junction_speed: &[f64],
        phases: &Phases,
        seen: Seen,
    ) -> Tally<M>;
    /// Audits the distance between path and program.
    fn deviation(
        &self,
        path: &Followed,
        program: &Programmed,
        phases: Option<&Phases>,
        seen: Seen,
    ) -> Tally<M>;
}

/// The audit of a stream of setpoints.
pub trait SetpointKernels<const M: usize> {
    /// Audits the next setpoints.
    fn take(&mut self, plan: Option<&Plan>, chunk: &Chunk, seen: Seen);
    /// Ends the stream and returns what the audit found.
    fn verdict(self, plan: Option<&Plan>) -> Tally<M>;
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
                let (starts, are_good) = (&phases.starts(path), &phases.have_good_numbers(self.axes));
                let of = Audited { junction_speed, phases, limits: self, starts, are_good };
                audit_profile(&of, &|| Columns::new(path, self, None), seen)
            }

            fn joint_profile(
                &self,
                joints: &JointPath,
                junction_speed: &[f64],
                phases: &Phases,
                seen: Seen,
            ) -> Tally<$count> {
                let starts = &phases.starts(&joints.path);
                let are_good = &phases.have_good_numbers(self.axes);
                let of = Audited { junction_speed, phases, limits: self, starts, are_good };
                audit_profile(&of, &|| Columns::new(&joints.path, self, Some(joints)), seen)
                    .merge(audit_travel(joints, *phases, starts, self))
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
        })+
    };
}

#[cfg(not(test))]
kernels!(3 6 9);

// Tests call the kernels directly; one instance keeps them from being reported as unused.
#[cfg(test)]
kernels!(2);
