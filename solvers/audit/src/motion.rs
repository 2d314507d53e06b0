//! The motion on a phase of a profile, given by the length of the path or by the parameter.

use super::columns::Columns;
use super::phase_by_length::PhaseByLength;
use super::phase_motion::{PhaseMotion, State, ROUNDING};
use super::phases::Phases;
use super::speed_by_length::Pace;
use super::station::Rounded;
use super::vectors::vector_of;

/// Bisection steps after which a place is known to all its bits.
const MOST_STEPS: u32 = 53;

/// A phase ready to be evaluated at any u of it.
pub struct Motion<const M: usize> {
    piece: usize,
    u: [f64; 2],
    duration: f64,
    law: Law<M>,
}

enum Law<const M: usize> {
    ByLength(PhaseByLength<M>),
    ByParameter(PhaseMotion<M>),
}

/// The motion at a place of a phase.
#[derive(Clone, Copy, Debug)]
pub struct Passage<const M: usize> {
    pub u: f64,
    /// Time since the start of the phase, and its error, in s.
    pub since: f64,
    pub doubt: f64,
    pub velocity: Rounded<M>,
    /// Accelerations, if they follow from the place directly: on phases by length. Where the path has no direction their error is
    /// infinite.
    pub acceleration: Option<Rounded<M>>,
}

impl<const M: usize> Passage<M> {
    /// A passage at u, whose time and motion are not known.
    pub fn unknown(u: f64) -> Self {
        let velocity = Rounded { value: [f64::NAN; M], rounding: [0.0; M] };
        Self { u, since: f64::NAN, doubt: f64::NAN, velocity, acceleration: None }
    }
}

impl<const M: usize> Motion<M> {
    /// The motion on phase `i`, whose numbers must be usable (`Phases::have_good_numbers`).
    pub fn new(phases: &Phases, i: usize, columns: &mut Columns<M>) -> Self {
        let law = match phases.by_length(i, columns) {
            Some(motion) => Law::ByLength(motion),
            None => Law::ByParameter(PhaseMotion::new(phases, i, columns)),
        };
        let u = [phases.u0[i], phases.u1[i]];
        Self { piece: phases.piece[i] as usize, u, duration: phases.duration[i], law }
    }

    pub fn passage(&self, u: f64, columns: &mut Columns<M>) -> Passage<M> {
        match &self.law {
            Law::ByLength(motion) => {
                let here = motion.place(u);
                let (since, Pace { v, .. }) = (motion.since(&here), here.pace);
                let (velocity, acceleration) = match columns.rounded_station(self.piece, u) {
                    Some((station, roundings)) => {
                        let (value, rounding) = (station.velocity(v), roundings.velocity(v));
                        let rounding = vector_of(|k| rounding[k] + ROUNDING * value[k].abs());
                        let acceleration = Rounded {
                            value: station.acceleration(here.pace),
                            rounding: roundings.acceleration(here.pace),
                        };
                        (Rounded { value, rounding }, acceleration)
                    }
                    None => {
                        let place = columns.place(self.piece, u);
                        let root_p = if place.way_slope > 0.0 { v / place.way_slope } else { 0.0 };
                        let any = Rounded { value: [0.0; M], rounding: [f64::INFINITY; M] };
                        (State::new(place, root_p, ROUNDING).velocity, any)
                    }
                };
                Passage {
                    u,
                    since,
                    doubt: ROUNDING * since.abs(),
                    velocity,
                    acceleration: Some(acceleration),
                }
            }
            Law::ByParameter(motion) => {
                let here = motion.at(u, columns);
                let [since, doubt] = motion.since(&here, self.duration, columns);
                Passage { u, since, doubt, velocity: here.velocity, acceleration: None }
            }
        }
    }

    /// Accelerations at a place of this phase.
    pub fn acceleration(&self, here: &Passage<M>, columns: &mut Columns<M>) -> Rounded<M> {
        match (&self.law, here.acceleration) {
            (Law::ByParameter(motion), _) => motion.acceleration_near(here.u, columns),
            (_, known) => known.unwrap_or(Rounded { value: [f64::NAN; M], rounding: [0.0; M] }),
        }
    }

    /// u at a time in s since the start of the phase, by bisection.
    pub fn place_at(&self, time: f64, columns: &mut Columns<M>) -> f64 {
        let [mut low, mut high] = self.u;
        for _ in 0..MOST_STEPS {
            let middle = 0.5 * (low + high);
            let since = match &self.law {
                Law::ByLength(motion) => motion.since(&motion.place(middle)),
                Law::ByParameter(motion) => {
                    let here = motion.at(middle, columns);
                    motion.since(&here, self.duration, columns)[0]
                }
            };
            if since < time {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}
