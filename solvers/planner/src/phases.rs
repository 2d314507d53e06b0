//! The phases of a profile in the order of the path: as columns, and as a record of one phase.

use std::mem::take;

use crate::phase_law::PhaseLaw;

/// The axis number of a phase whose law refers to no axis.
pub const NO_AXIS: u8 = 255;

/// One phase of a profile: `value` is the constant of its law; u0 < u1 are local parameters of the piece; p0 and p1 are p =
/// (du/dτ)² at both ends, with the time τ; a0 and a1 are the accelerations along the path there, if the jerk is limited.
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
    /// The speeds [mm/s] at both ends; `squares` are the squares of the length per u there.
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
            /// No phases, with memory for this many.
            pub fn with_capacity(phases: usize) -> Self {
                Self { $($column: Vec::with_capacity(phases),)+ }
            }

            /// Keeps the first phases only.
            pub fn truncate(&mut self, phases: usize) {
                $(self.$column.truncate(phases);)+
            }

            /// Removes one phase.
            pub fn remove(&mut self, at: usize) {
                $(self.$column.remove(at);)+
            }

            /// Frees the memory that the columns have reserved for more phases.
            pub fn shrink_to_fit(&mut self) {
                $(self.$column.shrink_to_fit();)+
            }

            /// The phases of all parts in this order. Copies one column after the other and frees its parts, to save memory; a
            /// single part is not copied.
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
    /// `a0` and `a1` are empty in a profile without a jerk limit.
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

    /// Phase i; None if the number of its law is unknown. All columns must be filled, including `a0` and `a1`.
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

    /// Index of the first phase of the piece that ends at u or later; if none does, the index after the piece's last phase.
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
