//! One setpoint of a stream, and where it is on the path of its plan.

use super::nearest::Place;
use super::station::Rounded;
use super::PLACE_TOLERANCE;

/// One setpoint: time in s, positions in mm, and what is recorded with it.
#[derive(Clone, Copy, Debug)]
pub struct Row<const M: usize> {
    pub t: f64,
    pub q: [f64; M],
    pub velocity: Option<[f64; M]>,
    pub acceleration: Option<[f64; M]>,
    pub line: i32,
    /// Its place on the path, where a path is known.
    pub nearest: Nearest<M>,
}

impl<const M: usize> Row<M> {
    pub fn is_finite(&self) -> bool {
        // 0 times a number that is not finite is NaN.
        let nothing = |of: &[f64; M]| of.iter().fold(0.0, |sum, number| sum + 0.0 * number);
        let recorded = |of: &Option<[f64; M]>| of.as_ref().map_or(0.0, nothing);
        0.0 * self.t + nothing(&self.q) + recorded(&self.velocity) + recorded(&self.acceleration) == 0.0
    }
}

/// The place of a setpoint on the path, and the profile there.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<const M: usize> {
    pub place: Place,
    /// Step of u to this place from that of the setpoint before, and the expected step to the next one (linear extrapolation of
    /// the steps).
    pub step: f64,
    pub next_step: f64,
    /// Greatest coordinate of the piece on which the search began, in mm; and an upper bound of |C''| of the tool's path on the
    /// piece of the place, in 1/mm.
    pub magnitude: f64,
    pub bend: f64,
    /// Distance of the setpoint from the path, and how far along the path the profile is from the place at that time, in mm.
    pub off: f64,
    pub late: f64,
    /// Allowed value of `late`, in mm.
    pub allowed: f64,
    /// Velocity of the profile at the place; NaN where it is not known.
    pub velocity: Rounded<M>,
    /// Difference of the recorded acceleration from that of the profile.
    pub acceleration_off: [f64; M],
}

impl<const M: usize> Default for Nearest<M> {
    fn default() -> Self {
        Self {
            place: Place { piece: 0, u: 0.0 },
            step: 0.0,
            next_step: 0.0,
            magnitude: 0.0,
            bend: f64::INFINITY,
            off: 0.0,
            late: 0.0,
            allowed: PLACE_TOLERANCE,
            velocity: Rounded { value: [f64::NAN; M], rounding: [0.0; M] },
            acceleration_off: [0.0; M],
        }
    }
}

impl<const M: usize> Nearest<M> {
    /// Whether the setpoint is on the path, at the place where the profile is at its time.
    pub fn is_good(&self) -> bool {
        self.off <= PLACE_TOLERANCE && self.late <= self.allowed
    }
}
