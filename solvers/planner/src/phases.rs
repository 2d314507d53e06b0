//! The phases of a profile as columns, in the order of the path, and one of them.

use std::mem::take;

use crate::phase_law::PhaseLaw;

/// The axis of a phase without one.
pub const NO_AXIS: u8 = 255;

/// One phase of a profile: `value` is the constant of its law, u0 < u1 local parameters, p at both ends, and where the jerk
/// is limited the acceleration along the path.
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    pub piece: u32,
    pub law: PhaseLaw,
    pub axis: u8,
    pub value: f64,
    pub u0: f64,
    pub u1: f64,
    pub p0: f64,
    pub p1: f64,
    pub duration: f64,
    pub a0: f64,
    pub a1: f64,
}

impl Phase {
    /// The speeds that p makes of the squares of a length per u at both ends.
    pub fn end_speeds(&self, squares: [f64; 2]) -> [f64; 2] {
        [(squares[0] * self.p0).sqrt(), (squares[1] * self.p1).sqrt()]
    }
}

macro_rules! columns {
    ($($(#[$about:meta])* $column:ident: $type:ty),+ $(,)?) => {
        /// All phases of a profile, a column for each quantity; see `feedplan.profile.SpeedProfile`.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Phases {
            $($(#[$about])* pub $column: Vec<$type>,)+
        }

        impl Phases {
            /// Without phases, with memory for this many.
            pub fn with_capacity(phases: usize) -> Self {
                Self { $($column: Vec::with_capacity(phases),)+ }
            }

            /// Keeps the first phases only.
            pub fn truncate(&mut self, phases: usize) {
                $(self.$column.truncate(phases);)+
            }

            /// Takes out one phase.
            pub fn remove(&mut self, at: usize) {
                $(self.$column.remove(at);)+
            }

            /// Gives back the memory that columns have reserved for more phases.
            pub fn shrink_to_fit(&mut self) {
                $(self.$column.shrink_to_fit();)+
            }

            /// The phases of all parts in this order. Column after column is copied and its parts are freed; one part alone
            /// is not copied.
            pub fn joined(mut parts: Vec<Self>) -> Self {
                if parts.len() == 1 {
                    return parts.remove(0);
                }
                Self { $($column: parts.iter_mut().map(|part| take(&mut part.$column)).collect::<Vec<_>>().concat(),)+ }
            }
        }
    };
}

columns! {
    piece: u32,
    /// The number of the law.
    kind: u8,
    axis: u8,
    value: f64,
    u0: f64,
    u1: f64,
    p0: f64,
    p1: f64,
    duration: f64,
    /// These two are empty in a profile without a limit of jerk.
    a0: f64,
    a1: f64,
}

impl Phases {
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// The time of all phases [s].
    pub fn time(&self) -> f64 {
        self.duration.iter().sum()
    }

    /// Appends a phase.
    pub fn push(&mut self, phase: &Phase) {
        self.push_without_acceleration(phase);
        self.a0.push(phase.a0);
        self.a1.push(phase.a1);
    }

    /// Appends a phase to all columns but `a0` and `a1`.
    #[inline(always)]
    pub fn push_without_acceleration(&mut self, phase: &Phase) {
        self.piece.push(phase.piece);
        self.kind.push(phase.law as u8);
        self.axis.push(phase.axis);
        self.value.push(phase.value);
        self.u0.push(phase.u0);
        self.u1.push(phase.u1);
        self.p0.push(phase.p0);
        self.p1.push(phase.p1);
        self.duration.push(phase.duration);
    }

    /// Phase i, if the number of its law is known.
    pub fn get(&self, i: usize) -> Option<Phase> {
        Some(Phase {
            piece: self.piece[i],
            law: PhaseLaw::from_number(self.kind[i])?,
            axis: self.axis[i],
            value: self.value[i],
            u0: self.u0[i],
            u1: self.u1[i],
            p0: self.p0[i],
            p1: self.p1[i],
            duration: self.duration[i],
            a0: self.a0[i],
            a1: self.a1[i],
        })
    }

    /// The first phase that ends at or behind u of a piece; their number if none does.
    pub fn up_to(&self, piece: u32, u: f64) -> usize {
        let first = self.piece.partition_point(|&own| own < piece);
        let own = self.piece[first..].partition_point(|&own| own == piece);
        first + self.u1[first..first + own].partition_point(|&end| end < u)
    }
}

impl FromIterator<Phase> for Phases {
    fn from_iter<I: IntoIterator<Item = Phase>>(phases: I) -> Self {
        let mut all = Self::default();
        phases.into_iter().for_each(|phase| all.push(&phase));
        all
    }
}
