//! Acceleration and jerk of joints that are not the path's axes, on phases whose speed is known by the length of the way.

use super::path::{Piece, Work};
use super::plan::JointAudit;
use crate::peak::peak;
use crate::phase_by_length::PhaseByLength;
use crate::station::Station;
use crate::{Check, Tally};

/// Shares of the limits of acceleration and jerk that a place uses.
type Use<const M: usize> = [[f64; M]; 2];

impl<const M: usize> JointAudit<'_, M> {
    /// Acceleration and jerk at even places of a phase, and where parabolas have their peaks.
    pub fn jerks(
        &self,
        piece: &Piece<M>,
        motion: &PhaseByLength<M>,
        stations: &[Station<M>],
        start: f64,
        work: &mut Work,
        tally: &mut Tally<M>,
    ) {
        let used: Vec<Use<M>> =
            stations.iter().map(|at| self.look(piece, motion, at, start, tally)).collect();
        for i in 1..used.len() - 1 {
            for (row, check) in [Check::Acceleration, Check::Jerk].into_iter().enumerate() {
                for k in 0..self.path.joints {
                    let uses = [i - 1, i, i + 1].map(|i| used[i][row][k]);
                    if let Some(x) = peak(uses, tally.get(check, k).ratio) {
                        let u = stations[i].u + 0.5 * x * (stations[i + 1].u - stations[i - 1].u);
                        let (_, station) = piece.station(u, work);
                        self.look(piece, motion, &station, start, tally);
                    }
                }
            }
        }
    }

    /// Offers acceleration and jerk at a place; the shares of the limits that they use.
    fn look(
        &self,
        piece: &Piece<M>,
        motion: &PhaseByLength<M>,
        station: &Station<M>,
        start: f64,
        tally: &mut Tally<M>,
    ) -> Use<M> {
        let (limits, place) = (&self.limits, motion.place(station.u));
        let time = || start + motion.since(&place);
        let (acceleration, jerk) = (station.acceleration(place.pace), station.jerk(place.pace));
        tally.samples += 1;
        let mut used = [[0.0; M]; 2];
        for k in 0..self.path.joints {
            let strongest = limits.acceleration.of(k, acceleration.value[k]);
            let of = [(Check::Acceleration, &acceleration, strongest), (Check::Jerk, &jerk, limits.jerk[k])];
            for (row, (check, rate, limit)) in of.into_iter().enumerate() {
                let value = rate.value[k].abs() - rate.rounding[k];
                used[row][k] = value.max(0.0).copysign(rate.value[k]) / limit;
                tally.offer_at(check, k, value, limit, piece.line, time);
            }
        }
        used
    }
}
