//! Finds the place of each setpoint on the path of its plan, and the time at which the profile is there.
//!
//! The place of a setpoint is searched along the path from the place of the setpoint before, never backwards. Where the speed
//! profile is known, the audit computes by integration when the profile reaches that place; the error along the path of a
//! setpoint that is early or late is the distance that the profile moves in the time between.

mod at_once;

use super::columns::Columns;
use super::curve::Followed;
use super::joints::path::JointPath;
use super::moves::Programmed;
use super::nearest::{step_towards, Found, Place, Search};
use super::number::{inner, Lanes, Number};
use super::parallel;
use super::phase_motion::ROUNDING;
use super::phases::SPEED_CUBIC;
use super::profile_clock::ProfileClock;
use super::profile_reader::Reader;
use super::rows::{Nearest, Row};
use super::vectors::length;
use super::{tell, Limits, Seen, PLACE_TOLERANCE};

/// Setpoints that a thread takes at a time.
pub const BLOCK: usize = 2048;

/// After this many consecutive setpoints off the path, the rest of their block get the place of the last one: the verdict is
/// clear, and a search for each would take very long.
const MOST_ASTRAY: u32 = 64;

/// Limit of the Newton steps from a guess. The last step is at most `SETTLED` mm long or, where |C''| is bounded, leaves an error
/// of at most `MOST_ERROR` mm: after a step of du it is at most 3/2 |C''| du².
const MOST_GUESSES: usize = 6;
const SETTLED: f64 = 1e-7;
const MOST_ERROR: f64 = 1e-3 * PLACE_TOLERANCE;

/// Limit of the steps towards the nearest place of a phase.
const MOST_STEPS: usize = 12;

/// A setpoint may be this share of its step off its place along the path: the accuracy that sampling promises.
pub const STEP_SHARE: f64 = 1e-6;

/// The plan that setpoints follow.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// At least one piece.
    pub path: Followed<'a>,
    pub profile: Option<ProfileClock<'a>>,
    pub program: Option<Programmed<'a>>,
    /// The greatest distance of the path from the program that was found, as a share of the tolerance.
    pub deviation: f64,
    /// The joints on the same path, where the setpoints are positions of joints instead of axes.
    pub joints: Option<&'a JointPath<'a>>,
}

impl<'a> Plan<'a> {
    /// The axes or joints whose positions the setpoints are.
    pub fn columns<const M: usize>(&self, limits: &'a Limits<M>) -> Columns<'a, M> {
        Columns::new(&self.path, limits, self.joints)
    }

    /// Distance of a setpoint from the start or the end of a piece, less rounding, in mm.
    pub fn distance_from_end<const M: usize>(
        &self,
        columns: &mut Columns<M>,
        (piece, at_end): (usize, bool),
        q: &[f64; M],
    ) -> f64 {
        let [away, _] = columns.toward(piece, if at_end { self.path.width[piece] } else { 0.0 }, q);
        length(&away) - rounding(columns.count(), columns.magnitude(piece), q)
    }

    /// This plan with the starts of the runs on the clock of the setpoints.
    pub fn with_clock<'b>(&self, run_starts: &'b [f64]) -> Plan<'b>
    where
        'a: 'b,
    {
        Plan { profile: self.profile.map(|profile| ProfileClock { run_starts, ..profile }), ..*self }
    }

    /// Adds to `clock` the starts of the runs that the rows reach.
    pub fn extend_clock<const M: usize>(&self, limits: &Limits<M>, rows: &[Row<M>], clock: &mut Vec<f64>) {
        let Some(profile) = &self.profile else { return };
        let mut columns = self.columns(limits);
        let away = |run: usize, row: &Row<M>| {
            let end = (self.path.runs[run] as usize).checked_sub(1);
            self.distance_from_end(&mut columns, end.map_or((0, false), |piece| (piece, true)), &row.q)
        };
        profile.extend(&self.path, limits.period, rows, away, clock);
    }

    /// Finds the places of the rows from index `old` on; `continues` tells whether the first search starts from the place of the
    /// row before.
    pub fn find_nearest<const M: usize>(
        &self,
        limits: &Limits<M>,
        rows: &mut [Row<M>],
        (old, continues): (usize, bool),
        seen: Seen,
    ) {
        let (known, fresh) = rows.split_at_mut(old);
        // Without a profile every search starts from the place before; with one, the time of a setpoint gives the start.
        let continues = continues || self.profile.is_none();
        let block = if self.profile.is_some() { BLOCK } else { fresh.len().max(1) };
        parallel::each_part(fresh, block, &|number, rows| {
            let mut finder = Finder::new(self, limits);
            let mut astray = 0;
            for i in 0..rows.len() {
                tell(seen, i);
                let first = if number == 0 && continues { known.last() } else { None };
                let previous = rows[..i].last().or(first);
                let nearest = match previous {
                    Some(last) if astray > MOST_ASTRAY => last.nearest,
                    _ => finder.find(previous, &rows[i..]),
                };
                astray = if nearest.is_good() { 0 } else { astray + 1 };
                rows[i].nearest = nearest;
                rows[i].line = self.path.line[nearest.place.piece];
            }
        });
    }
}

/// Rounding error bound of the distance of a setpoint from a place, in mm, from the greatest coordinate of both.
fn rounding<const M: usize>(count: usize, magnitude: f64, q: &[f64; M]) -> f64 {
    let most = q.iter().fold(magnitude, |most, q| q.abs().max(most));
    ROUNDING * most * (count as f64).sqrt()
}

/// The place found for a setpoint, and its distance from it, if it is close and not before `from`, else None; `distance` is in
/// mm, `slope` is |C'| there.
fn good_guess(
    path: &Followed,
    from: Place,
    Place { piece, u }: Place,
    [distance, slope]: [f64; 2],
    rounding: f64,
) -> Option<(Place, f64)> {
    let width = path.width[piece];
    let least = if piece == from.piece { from.u } else { 0.0 };
    let u = settled(u, [0.0, width], rounding / slope);
    let good = from.piece <= piece && least <= u && u <= width && distance <= PLACE_TOLERANCE + rounding;
    good.then_some((Place { piece, u }, distance))
}

/// How much a Newton step du exceeds the criteria of a last step, in mm: by its length, where |C'| is `size`, and by the error
/// that it leaves, where |C''| is at most `bend`. A step that meets one of both (not positive) is the last one.
#[inline(always)]
fn beyond_last<T: Number>(du: T, size: T, bend: f64) -> [T; 2] {
    [du.size() * size + -SETTLED, du * du * (1.5 * bend) + -MOST_ERROR]
}

/// The place u of a piece, or an end of the piece within rounding of u: the profile may pause at ends.
fn settled(u: f64, ends: [f64; 2], rounding: f64) -> f64 {
    ends.into_iter().find(|end| (end - u).abs() <= rounding).unwrap_or(u)
}

/// Finds the places of setpoints, one after the other.
struct Finder<'a, const M: usize> {
    plan: &'a Plan<'a>,
    limits: &'a Limits<M>,
    profile: Option<Reader<'a, M>>,
    /// The columns, where no profile holds them.
    columns: Option<Columns<'a, M>>,
    /// Greatest distance that the velocity limits allow in two periods, in mm.
    reach: f64,
    /// Whether the places of several setpoints are guessed at once: on phases where v² is a cubic of the length, and, with
    /// joints, on all phases. On other phases the places of axes are spaced so evenly that each one predicts the next.
    guesses_cubics: bool,
    guesses_all: bool,
    /// Guesses of the places of the next setpoints, the last one first; and the phase of the last guess.
    guesses: Vec<Guess>,
    phase: usize,
    room: Vec<Lanes>,
}

/// The guessed place of a setpoint, the distance of the setpoint from it in mm, and |C'| there; `left` is the number of setpoints
/// of the block from this one on.
struct Guess {
    left: usize,
    place: Place,
    distance: f64,
    slope: f64,
}

impl<'a, const M: usize> Finder<'a, M> {
    fn new(plan: &'a Plan<'a>, limits: &'a Limits<M>) -> Self {
        let (mut profile, mut columns, new) = (None, None, plan.columns(limits));
        let (room, guesses_all) = (new.room(), !new.are_axes());
        match &plan.profile {
            Some(clock) => profile = Some(Reader::new(clock, new)),
            None => columns = Some(new),
        }
        let guesses_cubics = plan.profile.is_some_and(|clock| clock.phases.kind.contains(&SPEED_CUBIC));
        let reach = 2.0 * limits.period * length(&limits.velocity.greater());
        let guesses = vec![];
        Self { plan, limits, profile, columns, reach, guesses_cubics, guesses_all, guesses, phase: 0, room }
    }

    fn columns(&mut self) -> &mut Columns<'a, M> {
        match (&mut self.profile, &mut self.columns) {
            (Some(profile), _) => &mut profile.columns,
            (_, Some(columns)) => columns,
            _ => unreachable!("one of both has them"),
        }
    }

    /// The place of the first one of `rows`, which follow `previous`.
    fn find(&mut self, previous: Option<&Row<M>>, rows: &[Row<M>]) -> Nearest<M> {
        let (path, limits, row) = (&self.plan.path, self.limits, &rows[0]);
        // Starts from the place of the setpoint before or, where that is not good, from the place of the profile one period
        // earlier.
        let known = previous.filter(|before| {
            self.profile.is_none()
                || (before.nearest.is_good() && (row.t - before.t).abs() <= 2.0 * limits.period)
        });
        let from = match (known, &self.plan.profile) {
            (Some(row), _) => row.nearest.place,
            (None, Some(profile)) => profile.place_before(path, row.t - limits.period),
            (None, None) => Place { piece: 0, u: 0.0 },
        };
        if !(Self::is_finite(row) && self.reach.is_finite()) {
            return Nearest { place: from, off: f64::INFINITY, ..Nearest::default() };
        }
        let columns = self.columns();
        let (are_axes, magnitude) = (columns.are_axes(), columns.magnitude(from.piece));
        let pieces = [previous.map_or(from.piece, |before| before.nearest.place.piece), from.piece];
        let step = previous.map_or(0.0, |before| length(&columns.difference(pieces, &before.q, &row.q)));
        let rounding = rounding(columns.count(), magnitude, &row.q);
        let allowed = PLACE_TOLERANCE.max(STEP_SHARE * step);
        let close = PLACE_TOLERANCE + rounding;
        let guess = known
            .filter(|_| self.profile.is_some())
            .and_then(|before| self.next_guess(from, before.nearest.next_step, rows, rounding));
        let mut judge = |place: Place| {
            let late = self.profile.as_mut().map_or(0.0, |profile| profile.late(place, row.t, limits));
            (late - rounding).max(0.0)
        };
        let guess = guess.map(|(place, distance)| Found { place, distance, error: judge(place) });
        let found = match guess.filter(|guess| guess.error <= allowed) {
            Some(found) => found,
            None if are_axes => {
                Search { path, reach: self.reach, close, judge, allowed }.next_place(from, &row.q)
            }
            None => self.by_time(from, row, rounding),
        };
        let place = found.place;
        let [step, next_step] = self.steps(from, place, known.map_or(0.0, |before| before.nearest.step));
        // The time error of a place off the path is unknown; only its distance is judged.
        let late = if found.distance > close && found.error.is_infinite() { 0.0 } else { found.error };
        let (off, bend) = (found.distance - rounding, self.columns().curve(place.piece).bounds()[0]);
        let mut nearest =
            Nearest { place, step, next_step, magnitude, bend, off, late, allowed, ..Nearest::default() };
        if let Some(profile) = &mut self.profile {
            let here = profile.go_to(place);
            nearest.velocity = here.velocity;
            // Accelerations of joints would take as long as all the rest: they are used only if they are known.
            let is_known = (are_axes || here.acceleration.is_some()) && nearest.is_good();
            if let Some(recorded) = row.acceleration.filter(|_| is_known) {
                nearest.acceleration_off = profile.acceleration_off(&here, row.t, &recorded, limits);
            }
        }
        nearest
    }

    /// The step of u from one place to the next, and the expected next step: the change of the steps is extrapolated.
    fn steps(&self, from: Place, place: Place, before: f64) -> [f64; 2] {
        // The parameter of every piece is in mm.
        let passed = if place.piece == from.piece { 0.0 } else { self.plan.path.width[from.piece] };
        let step = passed + place.u - from.u;
        [step, if before > 0.0 { (2.0 * step - before).max(0.0) } else { step }]
    }

    /// The place of the first one of `rows` and the distance from it in mm, by Newton's method from the approximate place of the
    /// profile at its time or, if that fails, from the place `step` ahead of `from`.
    fn next_guess(&mut self, from: Place, step: f64, rows: &[Row<M>], rounding: f64) -> Option<(Place, f64)> {
        if self.guesses.last().is_none_or(|guess| guess.left != rows.len()) {
            self.guess_at_once(rows);
        }
        let path = &self.plan.path;
        let known = self.guesses.pop_if(|guess| guess.left == rows.len());
        known
            .and_then(|guess| good_guess(path, from, guess.place, [guess.distance, guess.slope], rounding))
            .or_else(|| self.guess(from, step, &rows[0].q, rounding))
    }

    /// Guesses the places of those of `rows` that are on the same piece as the first one, and evaluates the profile there. Each
    /// guess is independent of the others.
    fn guess_at_once(&mut self, rows: &[Row<M>]) {
        self.guesses.clear();
        let guesses = self.guesses_cubics || self.guesses_all;
        let Some(clock) = self.plan.profile.as_ref().filter(|_| guesses) else { return };
        let (mut starts, mut q) = ([0.0; at_once::COUNT], [[0.0; at_once::COUNT]; M]);
        let (mut first, mut count) = (None, 0);
        for row in rows.iter().take(at_once::COUNT).take_while(|row| Self::is_finite(row)) {
            let Some(phase) = clock.phase_from(self.phase, row.t) else { break };
            self.phase = phase;
            let piece = clock.phases.piece[phase] as usize;
            let is_guessed = self.guesses_all || clock.phases.kind[phase] == SPEED_CUBIC;
            if !is_guessed || *first.get_or_insert(piece) != piece {
                break;
            }
            starts[count] = clock.place_about(phase, row.t).u;
            // The start of a piece is also the end of the one before.
            if starts[count] <= 0.0 {
                break;
            }
            for k in 0..M {
                q[k][count] = row.q[k];
            }
            count += 1;
        }
        let Some(piece) = first else { return };
        let Some(on) = self.columns().together(piece) else { return };
        let found = at_once::nearest(&on, &starts, &q, &mut self.room);
        self.guesses.extend((0..count).rev().map(|i| Guess {
            left: rows.len() - i,
            place: Place { piece, u: found.u[i] },
            distance: found.distance[i],
            slope: found.slope[i],
        }));
        if let Some(profile) = &mut self.profile {
            let (mut places, mut known, width) = ([0.0; at_once::COUNT], 0, self.plan.path.width[piece]);
            for &u in found.u[..count].iter().filter(|u| (0.0..=width).contains(*u)) {
                (places[known], known) = (u, known + 1);
            }
            profile.look_ahead(&on, piece, &places[..known]);
        }
    }

    fn is_finite(row: &Row<M>) -> bool {
        row.t.is_finite() && row.q.iter().all(|q| q.is_finite())
    }

    /// The place of a setpoint and its distance in mm, by Newton's method from the place `step` ahead of `from`; None where that
    /// does not converge, or leads to a place before `from` or not close.
    fn guess(&mut self, from: Place, step: f64, q: &[f64; M], rounding: f64) -> Option<(Place, f64)> {
        let (path, columns) = (&self.plan.path, self.columns());
        let pieces = [from.piece, path.len() - 1];
        let mut place = from.moved(step, path.width, pieces);
        for _ in 0..MOST_GUESSES {
            let Place { piece, u } = place;
            let ([away, slope], bend) = (columns.toward(piece, u, q), columns.bend(piece));
            let (du, size) = (step_towards(&away, &slope), length(&slope));
            if beyond_last(du, size, bend).iter().any(|more| *more <= 0.0) {
                let distance = (inner(&away, &away) - (du * size).powi(2)).max(0.0).sqrt();
                let guess = good_guess(path, from, Place { piece, u: u + du }, [distance, size], rounding);
                if guess.is_some() {
                    return guess;
                }
            }
            let next = place.moved(du, path.width, pieces);
            if next == place {
                break;
            }
            place = next;
        }
        None
    }

    /// The place nearest to a setpoint on the phase of the profile at its time: used for joints where no guess succeeds.
    fn by_time(&mut self, from: Place, row: &Row<M>, rounding: f64) -> Found {
        let Some(profile) = &mut self.profile else {
            return Found { place: from, distance: f64::INFINITY, error: f64::INFINITY };
        };
        let (piece, ends, mut u) = profile.phase_at(row.t);
        let columns = &mut profile.columns;
        let [mut away, mut slope] = columns.toward(piece, u, &row.q);
        for _ in 0..MOST_STEPS {
            let step = step_towards(&away, &slope);
            let next = (u + if step.is_nan() { 0.0 } else { step }).clamp(ends[0], ends[1]);
            // Steps below the rounding error of the place would change the time considerably near rest.
            if step.abs() * length(&slope) <= rounding || next == u {
                break;
            }
            let there = columns.toward(piece, next, &row.q);
            let is_nearer = length(&there[0]) + rounding < length(&away);
            if !is_nearer {
                break;
            }
            (u, [away, slope]) = (next, there);
        }
        u = settled(u, [0.0, self.plan.path.width[piece]], rounding / length(&slope));
        let (place, distance) = (Place { piece, u }, length(&away));
        let error = (profile.late(place, row.t, self.limits) - rounding).max(0.0);
        Found { place, distance, error }
    }
}

/// Whether two setpoints are one time step apart, at most two periods. For others only the times are checked.
pub fn is_step(from: f64, to: f64, period: f64) -> bool {
    to > from && to - from <= 2.0 * period
}
