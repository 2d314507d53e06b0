//! One phase of a profile, and parts of it.

use feedplan_planner::phase_law::PhaseLaw;

/// C' vanishes at an end where |C'|² is below this part of that in the middle of the phase.
pub const SLOW: f64 = 1e-8;

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

/// A share of the whole measure of a phase, counted from its start or from its end.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from_start: bool,
    pub share: f64,
}

impl Part {
    /// The same from the end that is nearer.
    pub fn nearer_end(self) -> Self {
        if self.share <= 0.5 {
            self
        } else {
            Self { from_start: !self.from_start, share: 1.0 - self.share }
        }
    }
}
