//! Finds the place of each setpoint on the path of its plan, and when the profile is there.
//!
//! The place of a setpoint is searched along the path from the place of the one before, never backwards. Where
//! the speed profile is known, the audit integrates when the profile reaches that place. The error along the path of a setpoint
//! that is early or late is the way that the profile moves in that time.

use std::sync::Arc;

use rayon::prelude::*;

use super::columns::{Axes, Columns};
use super::curve::{Curve, Followed};
use super::moves::Programmed;
use super::nearest::{Found, Place, Search};
use super::profile_clock::ProfileClock;
use super::profile_reader::Reader;
use super::rows::{Nearest, Row};
use super::vectors::{distance, from_to, inner, length};
use super::{tell, Limits, Seen, EPS, PLACE_TOLERANCE, ROUNDINGS};

/// Setpoints a thread takes at a time.
const BLOCK: usize = 4096;

/// After so many consecutive setpoints off the path the others of their block get the place of the last one: the verdict is
/// clear, and a search for each would take very long.
const MOST_ASTRAY: u32 = 64;

/// Steps of Newton's method from a guess, and the length of the last one, in mm: the error after it is about the square of
/// that over a radius of curvature.
const MOST_GUESSES: usize = 6;
const SETTLED: f64 = 1e-7;

/// A setpoint may lie this share of its step from its place on the path: what sampling promises.
pub const STEP_SHARE: f64 = 1e-6;

/// What the setpoints of a plan follow.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// At least one piece.
    pub path: Followed<'a>,
    pub profile: Option<ProfileClock<'a>>,
    pub program: Option<Programmed<'a>>,
}

impl Plan<'_> {
    /// The first point of the path.
    pub fn start<const M: usize>(&self) -> [f64; M] {
        self.path.start(0)
    }

    /// The last point of the path.
    pub fn end<const M: usize>(&self) -> [f64; M] {
        self.path.end(self.path.len() - 1)
    }

    /// The same plan with the starts of the runs on the clock of the setpoints.
    pub fn with_clock<'b>(&'b self, run_starts: &'b [f64]) -> Plan<'b> {
        Plan { profile: self.profile.map(|profile| ProfileClock { run_starts, ..profile }), ..*self }
    }

    /// Adds to the clock the starts of the runs that the rows reach.
    pub fn extend_clock<const M: usize>(&self, limits: &Limits<M>, rows: &[Row<M>], clock: &mut Vec<f64>) {
        let Some(profile) = &self.profile else { return };
        let away = |run: usize, row: &Row<M>| {
            let stop = match run {
                0 => self.start::<M>(),
                _ => self.path.end::<M>((self.path.runs[run] as usize).max(1) - 1),
            };
            let magnitude = stop.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
            distance(&row.q, &stop) - ROUNDINGS * EPS * magnitude
        };
        profile.extend(&self.path, limits.period, rows, away, false, clock);
    }

    /// Finds the places of the rows from `old` on.
    pub fn find_nearest<const M: usize>(
        &self,
        limits: &Limits<M>,
        rows: &mut [Row<M>],
        old: usize,
        seen: Seen,
    ) {
        let (known, fresh) = rows.split_at_mut(old);
        // Without a profile every search starts from the place before; with one its time says where to start.
        let block = if self.profile.is_some() { BLOCK } else { fresh.len().max(1) };
        fresh.par_chunks_mut(block).enumerate().for_each(|(number, rows)| {
            let mut finder = Finder::new(self, limits);
            let mut astray = 0;
            for i in 0..rows.len() {
                tell(seen, i);
                let (before, rest) = rows.split_at_mut(i);
                let first = if number == 0 { known.last() } else { None };
                let (previous, row) = (before.last().or(first), &mut rest[0]);
                row.nearest = match previous {
                    Some(last) if astray > MOST_ASTRAY => last.nearest,
                    _ => finder.find(previous, row),
                };
                astray = if row.nearest.is_good() { 0 } else { astray + 1 };
                row.line = self.path.line[row.nearest.place.piece];
            }
        });
    }
}

/// Finds the places of setpoints one after the other.
struct Finder<'a, const M: usize> {
    plan: &'a Plan<'a>,
    limits: &'a Limits<M>,
    profile: Option<Reader<'a, M>>,
    /// The pieces, where there is no profile that has them.
    columns: Axes<'a, M>,
    /// Greatest distance that the velocity limits allow in two periods, in mm.
    reach: f64,
}

impl<'a, const M: usize> Finder<'a, M> {
    fn new(plan: &'a Plan<'a>, limits: &'a Limits<M>) -> Self {
        let profile = plan
            .profile
            .as_ref()
            .map(|profile| Reader::new(profile, Box::new(Axes::new(&plan.path, limits))));
        let columns = Axes::new(&plan.path, limits);
        let reach = 2.0 * limits.period * length(&limits.velocity.greater());
        Self { plan, limits, profile, columns, reach }
    }

    fn curve(&mut self, piece: usize) -> Arc<Curve<M>> {
        match &mut self.profile {
            Some(profile) => profile.columns.curve(piece),
            None => self.columns.curve(piece),
        }
    }

    fn find(&mut self, previous: Option<&Row<M>>, row: &Row<M>) -> Nearest<M> {
        let (path, limits) = (&self.plan.path, self.limits);
        // From the place of the setpoint before; where that is not good, from the profile's place one period earlier.
        let known = previous.filter(|before| {
            let near = (row.t - before.t).abs() <= 2.0 * limits.period;
            self.profile.is_none() || (before.nearest.is_good() && near)
        });
        let from = match (known, &self.plan.profile) {
            (Some(row), _) => row.nearest.place,
            (None, Some(profile)) => profile.place_before(path, row.t - limits.period),
            (None, None) => Place { piece: 0, u: 0.0 },
        };
        if !(row.t.is_finite() && row.q.iter().all(|q| q.is_finite()) && self.reach.is_finite()) {
            return Nearest { place: from, off: f64::INFINITY, ..Nearest::default() };
        }
        let step = previous.map_or(0.0, |before| distance(&before.q, &row.q));
        let most = self.curve(from.piece).magnitude();
        let magnitude = row.q.iter().fold(most, |most, q| q.abs().max(most));
        let rounding = ROUNDINGS * EPS * magnitude * (path.axes as f64).sqrt();
        let allowed = PLACE_TOLERANCE.max(STEP_SHARE * step);
        let close = PLACE_TOLERANCE + rounding;
        let guess = known
            .filter(|_| self.profile.is_some())
            .and_then(|before| self.guess(from, before.nearest.step, &row.q, close));
        let mut judge = |place: Place| {
            let late = self.profile.as_mut().map_or(0.0, |profile| profile.late(place, row.t, limits));
            (late - rounding).max(0.0)
        };
        let guess = guess.map(|(place, distance)| Found { place, distance, error: judge(place) });
        let found = match guess.filter(|guess| guess.error <= allowed) {
            Some(found) => found,
            None => Search { path, reach: self.reach, close, judge, allowed }.next_place(from, &row.q),
        };
        let place = found.place;
        let step = if place.piece == from.piece { place.u - from.u } else { 0.0 };
        let late = if found.error.is_finite() { found.error } else { 0.0 };
        let off = found.distance - rounding;
        let mut nearest = Nearest { place, step, magnitude, off, late, allowed, ..Nearest::default() };
        if let Some(profile) = &mut self.profile {
            let here = profile.go_to(place);
            nearest.velocity = here.velocity.value;
            if let Some(recorded) = row.acceleration.filter(|_| nearest.is_good()) {
                nearest.acceleration_off = profile.acceleration_off(&here, row.t, &recorded, limits);
            }
        }
        nearest
    }

    /// The place of a setpoint and its distance, by Newton's method from the place one more step ahead, on the same piece or the
    /// next one; none where that does not converge ahead of `from` or is not close.
    fn guess(&mut self, from: Place, step: f64, q: &[f64; M], close: f64) -> Option<(Place, f64)> {
        let (mut piece, mut u) = (from.piece, from.u + step);
        let pieces = self.plan.path.len();
        let mut curve = self.curve(piece);
        for _ in 0..MOST_GUESSES {
            if u > curve.width() {
                piece += 1;
                if piece > from.piece + 1 || piece == pieces {
                    return None;
                }
                (curve, u) = (self.curve(piece), 0.0);
            }
            let [point, tangent] = curve.place(u);
            let (away, square) = (from_to(&point, q), inner(&tangent, &tangent));
            let along = inner(&away, &tangent);
            let (du, beside_sq) = (along / square, inner(&away, &away) - along * along / square);
            u += du;
            if du.abs() * square.sqrt() <= SETTLED {
                let least = if piece == from.piece { from.u } else { 0.0 };
                let distance = beside_sq.max(0.0).sqrt();
                let good = least <= u && u <= curve.width() && distance <= close;
                return good.then_some((Place { piece, u }, distance));
            }
        }
        None
    }
}

/// Whether two setpoints are one time step apart. Others are judged by their times alone.
pub fn is_step(from: f64, to: f64, period: f64) -> bool {
    to > from && to - from <= 2.0 * period
}
