//! Finds the place of each setpoint on the path of its plan, and when the profile is there.
//!
//! The place of a setpoint is searched along the path from the place of the one before, never backwards. Where
//! the speed profile is known, the audit integrates when the profile reaches that place. The error along the path of a setpoint
//! that is early or late is the way that the profile moves in that time.

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

/// Setpoints a thread takes at a time.
pub const BLOCK: usize = 2048;

/// After so many consecutive setpoints off the path the others of their block get the place of the last one: the verdict is
/// clear, and a search for each would take very long.
const MOST_ASTRAY: u32 = 64;

/// Steps of Newton's method from a guess, and the length of the last one, in mm, where nothing is known of C''. Where that is
/// bounded the error of the place after a step of du is no more than 3/2 |C''| du², which may be so much, in mm.
const MOST_GUESSES: usize = 6;
const SETTLED: f64 = 1e-7;
const MOST_ERROR: f64 = 1e-3 * PLACE_TOLERANCE;

/// Steps towards the nearest place of a phase.
const MOST_STEPS: usize = 12;

/// A setpoint may lie this share of its step from its place on the path: what sampling promises.
pub const STEP_SHARE: f64 = 1e-6;

/// What the setpoints of a plan follow.
#[derive(Clone, Copy)]
pub struct Plan<'a> {
    /// At least one piece.
    pub path: Followed<'a>,
    pub profile: Option<ProfileClock<'a>>,
    pub program: Option<Programmed<'a>>,
    /// The greatest share of its tolerance that the path has been found off the program.
    pub deviation: f64,
    /// On the same path, where the setpoints are those of joints that are not its axes.
    pub joints: Option<&'a JointPath<'a>>,
}

impl<'a> Plan<'a> {
    /// What the setpoints are of.
    pub fn columns<const M: usize>(&self, limits: &'a Limits<M>) -> Columns<'a, M> {
        Columns::new(&self.path, limits, self.joints)
    }

    /// Distance of a setpoint from the start or the end of a piece, less rounding.
    pub fn distance_from_end<const M: usize>(
        &self,
        columns: &mut Columns<M>,
        (piece, at_end): (usize, bool),
        q: &[f64; M],
    ) -> f64 {
        let [away, _] = columns.toward(piece, if at_end { self.path.width[piece] } else { 0.0 }, q);
        length(&away) - rounding(columns.count(), columns.magnitude(piece), q)
    }

    /// The same plan with the starts of the runs on the clock of the setpoints.
    pub fn with_clock<'b>(&self, run_starts: &'b [f64]) -> Plan<'b>
    where
        'a: 'b,
    {
        Plan { profile: self.profile.map(|profile| ProfileClock { run_starts, ..profile }), ..*self }
    }

    /// Adds to the clock the starts of the runs that the rows reach.
    pub fn extend_clock<const M: usize>(&self, limits: &Limits<M>, rows: &[Row<M>], clock: &mut Vec<f64>) {
        let Some(profile) = &self.profile else { return };
        let mut columns = self.columns(limits);
        let away = |run: usize, row: &Row<M>| {
            let end = (self.path.runs[run] as usize).checked_sub(1);
            self.distance_from_end(&mut columns, end.map_or((0, false), |piece| (piece, true)), &row.q)
        };
        profile.extend(&self.path, limits.period, rows, away, clock);
    }

    /// Finds the places of the rows from `old` on; `continues`: from the place of the row before them.
    pub fn find_nearest<const M: usize>(
        &self,
        limits: &Limits<M>,
        rows: &mut [Row<M>],
        (old, continues): (usize, bool),
        seen: Seen,
    ) {
        let (known, fresh) = rows.split_at_mut(old);
        // Without a profile every search starts from the place before; with one its time says where to start.
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

/// Rounding of the distance of a setpoint from a place, by the greatest coordinate of both.
fn rounding<const M: usize>(count: usize, magnitude: f64, q: &[f64; M]) -> f64 {
    let most = q.iter().fold(magnitude, |most, q| q.abs().max(most));
    ROUNDING * most * (count as f64).sqrt()
}

/// A place on a path, at such a distance from a setpoint and with such a slope, where it is not before `from`, and close.
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

/// By how much a step du of Newton's method is too great to be the last one, in mm: its length, where |C'| is `size`, and the error that
/// it leaves, where |C''| is at most `bend`. The step is the last one where one of both is not positive.
#[inline(always)]
fn beyond_last<T: Number>(du: T, size: T, bend: f64) -> [T; 2] {
    [du.size() * size + -SETTLED, du * du * (1.5 * bend) + -MOST_ERROR]
}

/// The place u of a piece, or its end where rounding does not tell it from there: the profile may pause at ends.
fn settled(u: f64, ends: [f64; 2], rounding: f64) -> f64 {
    ends.into_iter().find(|end| (end - u).abs() <= rounding).unwrap_or(u)
}

/// Finds the places of setpoints one after the other.
struct Finder<'a, const M: usize> {
    plan: &'a Plan<'a>,
    limits: &'a Limits<M>,
    profile: Option<Reader<'a, M>>,
    /// Where there is no profile that has them.
    columns: Option<Columns<'a, M>>,
    /// Greatest distance that the velocity limits allow in two periods, in mm.
    reach: f64,
    /// Whether places are guessed at once: on phases on which v² is a cubic of the length, of joints on all. On others the places of axes
    /// follow each other so evenly that each leads to the next one.
    guesses_cubics: bool,
    guesses_all: bool,
    /// Guesses of the places of the next setpoints, the last one first, and the phase of the last one.
    guesses: Vec<Guess>,
    phase: usize,
    room: Vec<Lanes>,
}

/// The place of the first one of so many setpoints that are `left`, its distance from there, and |C'| there.
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

    /// The place of the first one of some setpoints, which follow `previous`.
    fn find(&mut self, previous: Option<&Row<M>>, rows: &[Row<M>]) -> Nearest<M> {
        let (path, limits, row) = (&self.plan.path, self.limits, &rows[0]);
        // From the place of the setpoint before; where that is not good, from the profile's place one period earlier.
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
        let late = if found.error.is_finite() { found.error } else { 0.0 };
        let (off, bend) = (found.distance - rounding, self.columns().curve(place.piece).bounds()[0]);
        let mut nearest =
            Nearest { place, step, next_step, magnitude, bend, off, late, allowed, ..Nearest::default() };
        if let Some(profile) = &mut self.profile {
            let here = profile.go_to(place);
            nearest.velocity = here.velocity;
            // Quotients of joints take as long as all else.
            let is_known = (are_axes || here.acceleration.is_some()) && nearest.is_good();
            if let Some(recorded) = row.acceleration.filter(|_| is_known) {
                nearest.acceleration_off = profile.acceleration_off(&here, row.t, &recorded, limits);
            }
        }
        nearest
    }

    /// The step of u from one place to the next, and how far it goes on from there if that step changes as this one did from the step
    /// before.
    fn steps(&self, from: Place, place: Place, before: f64) -> [f64; 2] {
        // The parameter of every piece is in mm.
        let passed = if place.piece == from.piece { 0.0 } else { self.plan.path.width[from.piece] };
        let step = passed + place.u - from.u;
        [step, if before > 0.0 { (2.0 * step - before).max(0.0) } else { step }]
    }

    /// The place of the first one of some setpoints and its distance: from about where the profile is at its time or, where that leads
    /// nowhere, from the place one more step ahead.
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

    /// Guesses the places of those of some setpoints that are on one piece with the first one, and reads the profile there. What is
    /// guessed of one does not depend on the others.
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

    /// The place of a setpoint and its distance, by Newton's method from the place one more step ahead; none where that does not
    /// converge ahead of `from` or is not close.
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

    /// The place nearest to a setpoint on the phase that the profile is on at its time, where nothing else leads to one.
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
            // Steps below the rounding of the place would change the time next to rest.
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

/// Whether two setpoints are one time step apart. Others are judged by their times alone.
pub fn is_step(from: f64, to: f64, period: f64) -> bool {
    to > from && to - from <= 2.0 * period
}
