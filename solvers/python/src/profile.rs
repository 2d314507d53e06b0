//! `Profile`: the columns of a speed profile.

use std::ops::Deref;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::Column;
use super::views::view;
use feedplan_jerk::jerk_profile::JerkProfile;
use feedplan_planner::phases::Phases;
use feedplan_planner::profile;

pyo3::import_exception!(feedplan.errors, InputError);

macro_rules! profile {
    (phases: $($column:ident: $type:ty),+; others: $($other:ident: $of:ty),+) => {
        /// The columns of `feedplan.profile.SpeedProfile`.
        #[pyclass(frozen, module = "feedplan._solvers")]
        pub struct Profile {
            /// Shared with all readers.
            pub phases: Arc<Phases>,
            $(pub $other: Vec<$of>,)+
        }

        #[derive(FromPyObject)]
        struct Columns<'py> {
            $($column: Column<'py, $type>,)+
            $($other: Column<'py, $of>,)+
        }

        #[pymethods]
        impl Profile {
            /// From the arrays of a `SpeedProfile`. Raises InputError if the columns of its phases differ in length.
            #[new]
            fn new(columns: Columns<'_>) -> PyResult<Self> {
                let phases = Phases { $($column: columns.$column.as_slice()?.to_vec(),)+ };
                let profile = Self {
                    phases: phases.into(),
                    $($other: columns.$other.as_slice()?.to_vec(),)+
                };
                let count = profile.piece.len();
                $(if profile.$column.len() != count {
                    let (name, length) = (stringify!($column), profile.$column.len());
                    return Err(InputError::new_err(format!(
                        "the profile has {count} phases, and `{name}` has {length} entries: give one for each phase"
                    )));
                })+
                Ok(profile)
            }

            /// Views of the columns by name.
            fn fields<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
                let fields = PyDict::new(slf.py());
                $(fields.set_item(stringify!($column), view(slf, |profile| profile.$column[..].into())?)?;)+
                $(fields.set_item(stringify!($other), view(slf, |profile| profile.$other[..].into())?)?;)+
                Ok(fields)
            }
        }
    };
}

profile! {
    phases: piece: u32, kind: u8, axis: u8, value: f64, u0: f64, u1: f64, p0: f64, p1: f64, duration: f64, a0: f64, a1: f64;
    others: runs: i64, slowed: u32, kinked: u32
}

impl Deref for Profile {
    type Target = Phases;

    fn deref(&self) -> &Phases {
        &self.phases
    }
}

impl From<profile::Profile> for Profile {
    fn from(planned: profile::Profile) -> Self {
        let still = || vec![0.0; planned.phases.len()];
        let phases = Phases { a0: still(), a1: still(), ..planned.phases };
        Self { phases: phases.into(), runs: planned.runs, slowed: planned.slowed, kinked: vec![] }
    }
}

impl From<JerkProfile> for Profile {
    fn from(planned: JerkProfile) -> Self {
        Self { phases: planned.phases.into(), runs: planned.runs, slowed: vec![], kinked: planned.kinks }
    }
}
