//! Audits setpoints of joints against the plan: their distances from the path, and when the profile is at their places.
//!
//! A setpoint is compared with the joints at u, for the u that is nearest to it on the phase that the profile is on at its time.
//! Its distance from there is one error; how far the profile moves between the time of the setpoint and its own time at u is the
//! other. The clock starts every run anew: setpoints may wait at a stop for their next period.

use std::rc::Rc;

use rayon::prelude::*;

use super::columns::JointColumns;
use super::path::Piece;
use super::plan::JointAudit;
use crate::against_plan::VELOCITY_SHARE;
use crate::columns::{Columns, Place};
use crate::motion::Motion;
use crate::phase_motion::ROUNDING;
use crate::profile_clock::ProfileClock;
use crate::rows::Row;
use crate::setpoints::Chunk;
use crate::station::Rounded;
use crate::tracking::STEP_SHARE;
use crate::vectors::{length, Segment};
use crate::{Check, Tally, EPS, PASS_EXCESS, PLACE_TOLERANCE, ROUNDINGS};

/// Steps towards the nearest place.
const MOST_STEPS: usize = 12;

/// Setpoints that one thread looks at in a row.
const BLOCK: usize = 256;

/// Where a setpoint is on the path.
#[derive(Clone, Copy)]
struct Nearest<'r, const M: usize> {
    row: &'r Row<M>,
    is_finite: bool,
    piece: usize,
    u: f64,
    tip: [f64; M],
    /// The position, or 0 where that is not finite.
    target: [f64; M],
    /// Distance from the place, and distance of the profile from there at the time of the setpoint.
    off: f64,
    late: f64,
    /// Velocity of the profile there.
    velocity: Rounded<M>,
}

/// The chord error of a step, and the length of its chord.
#[derive(Clone, Copy)]
struct Chord {
    error: f64,
    length: f64,
    time: f64,
    line: i32,
}

/// Takes setpoints chunk by chunk; only what two chunks share is kept.
pub struct JointSetpoints<const M: usize> {
    tally: Tally<M>,
    is_usable: bool,
    /// When the runs began, as far as the setpoints have shown.
    clock: Vec<f64>,
    /// The last setpoint, which waits, and the one before it.
    held: Option<Row<M>>,
    last: Option<Row<M>>,
    /// The last chord, which waits for the length of the next one, and the length of the one before it.
    chord: Option<(Chord, f64)>,
    begun: bool,
}

impl<const M: usize> JointSetpoints<M> {
    pub(crate) fn new(audit: &JointAudit<M>) -> Self {
        let (phases, path) = (&audit.phases, &audit.path.path);
        let is_usable = phases.fits(path, audit.path.joints)
            && phases.runs.windows(2).all(|pair| pair[0] < pair[1])
            && (0..phases.len()).all(|phase| phases.u1[phase] > phases.u0[phase])
            && phases.piece.windows(2).all(|pair| pair[0] <= pair[1]);
        let mut tally = Tally::default();
        if !is_usable {
            tally.offer(Check::Place, 0, f64::INFINITY, PLACE_TOLERANCE, 0.0, 0);
        }
        Self { tally, is_usable, clock: Vec::new(), held: None, last: None, chord: None, begun: false }
    }

    /// The next setpoints; the last of them waits for the next chunk.
    pub(crate) fn push(&mut self, audit: &JointAudit<M>, chunk: &Chunk) {
        if !self.is_usable || chunk.t.is_empty() {
            return;
        }
        let own = (0..chunk.t.len()).map(|i| chunk.row(i));
        let rows: Vec<Row<M>> = self.held.take().into_iter().chain(own).collect();
        self.take(audit, &rows, rows.len() - 1, false);
        self.held = rows.last().copied();
    }

    /// The last setpoint must be the end of the path.
    pub(crate) fn finish(mut self, audit: &JointAudit<M>) -> Tally<M> {
        let Some(row) = self.held.take() else {
            if self.is_usable {
                self.tally.offer(Check::Place, 0, f64::INFINITY, PLACE_TOLERANCE, 0.0, 0);
            }
            return self.tally;
        };
        self.take(audit, &[row], 1, true);
        let piece = audit.path.piece::<M>(audit.path.path.len() - 1);
        let end = piece.at(piece.width, &mut audit.path.work());
        let away = off(&piece, &row.q, &end);
        self.tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, row.t, piece.line);
        self.settle_chord(audit, None);
        self.tally
    }

    fn take(&mut self, audit: &JointAudit<M>, rows: &[Row<M>], count: usize, last: bool) {
        let mut work = audit.path.work();
        if !self.begun {
            self.begun = true;
            let piece = audit.path.piece::<M>(0);
            let away = off(&piece, &rows[0].q, &piece.at(0.0, &mut work));
            let t = rows[0].t;
            self.tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, t, piece.line);
            self.tally.offer(Check::Grid, 0, t.abs(), PASS_EXCESS * audit.limits.period, t, piece.line);
        }
        let path = &audit.path.path;
        let away = |run: usize, row: &Row<M>| {
            let piece = audit.path.piece::<M>(path.runs[run] as usize);
            off(&piece, &row.q, &piece.at(0.0, &mut work))
        };
        audit.clock(&[]).extend(path, audit.limits.period, rows, away, last, &mut self.clock);
        let (clock, last) = (audit.clock(&self.clock), self.last.as_ref());
        let judged: Vec<(Tally<M>, Vec<Chord>)> = (0..count.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let start = block * BLOCK;
                let before = start.checked_sub(1).map_or(last, |before| Some(&rows[before]));
                Judge::new(audit, clock).judge(before, &rows[start..count.min(start + BLOCK)])
            })
            .collect();
        for (tally, chords) in judged {
            self.tally = std::mem::take(&mut self.tally).merge(tally);
            for chord in chords {
                let before = self.settle_chord(audit, Some(chord.length)).unwrap_or(chord.length);
                self.chord = Some((chord, before));
            }
        }
        self.last = rows[..count].last().copied().or(self.last);
    }

    /// Judges the chord error that waits, now that the length of the step after it is known or that there is none; the
    /// length of its own step.
    fn settle_chord(&mut self, audit: &JointAudit<M>, after: Option<f64>) -> Option<f64> {
        let (chord, before) = self.chord.take()?;
        let length = chord.length;
        // The tolerance holds for a circle at constant speed: where the tip gains speed the error is greater on one side.
        let gain = (length - before).abs().max((after.unwrap_or(length) - length).abs()) / length;
        let gain = if gain.is_nan() { 0.0 } else { gain.clamp(0.0, 1.0) };
        let limit = audit.limits.chord_tolerance * (1.0 + 0.5 * gain);
        self.tally.offer(Check::Chord, 0, chord.error, limit, chord.time, chord.line);
        Some(length)
    }
}

/// The phase of the last setpoint, its piece, and its motion.
struct Known<'a, const M: usize> {
    phase: usize,
    piece: Rc<Piece<'a, M>>,
    motion: Motion<M>,
}

/// Judges setpoints that follow each other.
struct Judge<'a, const M: usize> {
    audit: &'a JointAudit<'a, M>,
    clock: ProfileClock<'a>,
    columns: JointColumns<'a, M>,
    known: Option<Known<'a, M>>,
    tally: Tally<M>,
    chords: Vec<Chord>,
}

impl<'a, const M: usize> Judge<'a, M> {
    fn new(audit: &'a JointAudit<'a, M>, clock: ProfileClock<'a>) -> Self {
        let columns = JointColumns::new(audit);
        Self { audit, clock, columns, known: None, tally: Tally::default(), chords: Vec::new() }
    }

    /// Judges rows by themselves and against those before them, the first one against `before`.
    fn judge(mut self, before: Option<&Row<M>>, rows: &[Row<M>]) -> (Tally<M>, Vec<Chord>) {
        let mut last = before.map(|row| self.nearest(row));
        for row in rows {
            let nearest = self.nearest(row);
            self.place(last.as_ref(), &nearest);
            if let Some(before) = &last {
                self.step(before, &nearest);
            }
            self.tally.samples += 1;
            last = Some(nearest);
        }
        (self.tally, self.chords)
    }

    /// The piece of the last setpoint.
    fn piece(&self) -> Rc<Piece<'a, M>> {
        let Some(Known { piece, .. }) = &self.known else { unreachable!("a setpoint has been found") };
        piece.clone()
    }

    /// Offers what a setpoint shows.
    fn place(&mut self, last: Option<&Nearest<M>>, nearest: &Nearest<M>) {
        let Some(Known { piece, .. }) = &self.known else { unreachable!("a setpoint has been found") };
        let (t, line, tally) = (nearest.row.t, piece.line, &mut self.tally);
        let wrong = if nearest.is_finite { 0.0 } else { f64::INFINITY };
        tally.offer(Check::Numbers, 0, wrong, 0.0, t, line);
        let away = if nearest.is_finite { nearest.off } else { f64::INFINITY };
        tally.offer(Check::Place, 0, away, PLACE_TOLERANCE, t, line);
        let earlier = last.map_or(nearest.row.q, |last| last.row.q);
        let step = length(&piece.between(&earlier, &nearest.target, None));
        let allowed = if step.is_nan() { step } else { PLACE_TOLERANCE.max(STEP_SHARE * step) };
        tally.offer(Check::Place, 0, nearest.late, allowed, t, line);
        // A recorded velocity against the profile's, where the setpoint is on its place.
        let Some(recorded) = nearest.row.velocity else { return };
        let limits = &self.audit.limits;
        let at_joint = nearest.u.min(piece.width - nearest.u) <= PLACE_TOLERANCE;
        let size = nearest.row.q.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let away = nearest.off.max(0.0) + nearest.late + ROUNDING * size;
        let good = nearest.off <= PLACE_TOLERANCE
            && nearest.velocity.value.iter().all(|velocity| velocity.is_finite());
        for k in 0..self.audit.path.joints {
            // From rest over a way of `away` the velocity reaches this.
            let unknown =
                (2.0 * limits.acceleration.greatest(k) * away).sqrt() + nearest.velocity.rounding[k];
            let value = if good { (recorded[k] - nearest.velocity.value[k]).abs() - unknown } else { 0.0 };
            let jump = if at_joint { limits.jump[k] } else { 0.0 };
            let limit = VELOCITY_SHARE * limits.acceleration.least(k) * limits.period + jump;
            tally.offer(Check::RecordedVelocity, k, value, limit, t, line);
        }
    }

    /// Speed and chord error of the tip from one setpoint to the next.
    fn step(&mut self, before: &Nearest<M>, nearest: &Nearest<M>) {
        let (audit, piece) = (self.audit, self.piece());
        let (limits, t, line) = (&audit.limits, nearest.row.t, piece.line);
        let time = t - before.row.t;
        let follows = before.piece <= nearest.piece && nearest.piece - before.piece <= 1;
        let is_step = time > 0.0 && time <= 2.0 * limits.period && follows;
        let crosses = before.piece != nearest.piece;
        let first = if crosses { self.columns.piece(before.piece) } else { piece.clone() };
        // To the end of the piece before, and from the start of this one: their words may have different meanings.
        let until = if crosses { first.width } else { nearest.u };
        let since = if crosses { 0.0 } else { nearest.u };
        let [there, here] =
            if crosses { [first.curve.at(until), piece.curve.at(since)] } else { [nearest.tip; 2] };
        let size = before.tip.iter().chain(&nearest.tip).fold(0.0, |most: f64, x| most.max(x.abs()));
        let rounding = ROUNDING * size;
        let (mut way, mut least) = (0.0, 0.0);
        for (piece, from, to) in [(&first, &before.tip, &there), (&piece, &here, &nearest.tip)] {
            let step = (piece.feed_way(from, to) - 2.0 * rounding).max(0.0);
            way += step;
            least += step / audit.path.feed[piece.number];
        }
        let speed = if is_step { way / time } else { 0.0 };
        let feed = if way > 0.0 { way / least } else { audit.path.feed[piece.number] };
        let mut chord = None;
        if limits.chord_tolerance.is_finite() {
            // From one run to the next the tool stands still: each side has a chord of its own.
            let stops = first.run != piece.run;
            let far = if stops { &there } else { &nearest.tip };
            let near = if stops { &here } else { &before.tip };
            let mut error = 0.0;
            if crosses {
                error = chord_error(&first, before.u, until, &before.tip, far);
            }
            let start = if crosses { 0.0 } else { before.u };
            error = chord_error(&piece, start, nearest.u, near, &nearest.tip).max(error);
            let error = if is_step { error - rounding - nearest.off.max(0.0) } else { 0.0 };
            let linear = piece.linear();
            let length = length::<M>(&std::array::from_fn(|k| linear[k] * (nearest.tip[k] - near[k])));
            chord = Some(Chord { error, length, time: t, line });
        }
        self.tally.offer(Check::Feed, 0, speed, feed, t, line);
        self.chords.extend(chord);
    }

    fn nearest<'r>(&mut self, row: &'r Row<M>) -> Nearest<'r, M> {
        let (audit, phases) = (self.audit, &self.audit.phases);
        let t = if row.t.is_finite() { row.t } else { 0.0 };
        let found = self.clock.phase_of(self.clock.run_of(t), t);
        let (phase, since) = found.expect("every run has phases");
        let since = since.clamp(0.0, phases.duration[phase]);
        if self.known.as_ref().is_none_or(|known| known.phase != phase) {
            let piece = self.columns.piece(phases.piece[phase] as usize);
            let motion = Motion::new(phases, phase, &mut self.columns);
            self.known = Some(Known { phase, piece, motion });
        }
        let Some(Known { piece, motion, .. }) = &self.known else { unreachable!("the phase is known") };
        let is_finite = row.t.is_finite() && row.q.iter().all(|x| x.is_finite());
        let target = if is_finite { row.q } else { [0.0; M] };
        let place = nearest(piece, phases, phase, since, &target, &mut self.columns);
        let here = motion.passage(place.u, &mut self.columns);
        let doubt = if here.doubt.is_nan() { 0.0 } else { here.doubt };
        let wait = (here.since - since).abs() - doubt - EPS * row.t.abs() * (phase as f64 + 2.0 * ROUNDINGS);
        let wait = if wait.is_nan() { wait } else { wait.max(0.0) };
        let pull = length(&audit.limits.acceleration.greater());
        Nearest {
            row,
            is_finite,
            piece: piece.number,
            u: place.u,
            tip: place.tip,
            target,
            off: off(piece, &target, &place.position.value),
            late: wait * (length(&here.velocity.value) + 0.5 * wait * pull),
            velocity: here.velocity,
        }
    }
}

/// The greatest distance of four places of a piece from a chord, in X, Y, Z.
fn chord_error<const M: usize>(
    piece: &Piece<M>,
    start: f64,
    end: f64,
    from: &[f64; M],
    to: &[f64; M],
) -> f64 {
    let linear = piece.linear();
    let counted = |point: &[f64; M]| -> [f64; M] { std::array::from_fn(|k| linear[k] * point[k]) };
    let chord = Segment::new(&counted(from), &counted(to));
    let away =
        |share: f64| chord.distance_sq(&counted(&piece.curve.at(start + share * (end - start)))).sqrt();
    [0.25, 0.5, 0.75, 1.0].map(away).into_iter().fold(0.0, f64::max)
}

/// The place of a phase that a position is nearest to.
fn nearest<const M: usize>(
    piece: &Piece<M>,
    phases: &crate::phases::Phases,
    phase: usize,
    since: f64,
    target: &[f64; M],
    columns: &mut JointColumns<M>,
) -> Place<M> {
    let (low, high) = (phases.u0[phase], phases.u1[phase]);
    let (near, far) = (phases.p0[phase].sqrt(), phases.p1[phase].sqrt());
    let x = (since / phases.duration[phase]).clamp(0.0, 1.0);
    let share = x * (2.0 * near + (far - near) * x) / (near + far);
    let share = if share.is_nan() { 0.5 } else { share };
    let mut place = columns.place(piece.number, (low + (high - low) * share).clamp(low, high));
    let mut to = piece.between(&place.position.value, target, None);
    // Steps below the rounding of the place stop: next to rest they would change its time.
    let known = rounding(piece, target);
    for _ in 0..MOST_STEPS {
        let (mut along, mut slope_sq) = (0.0, 0.0);
        for k in 0..piece.joints() {
            along += to[k] * place.slope.value[k];
            slope_sq += place.slope.value[k] * place.slope.value[k];
        }
        if along.abs() <= known * slope_sq.sqrt() {
            break;
        }
        let step = along / slope_sq;
        let u = (place.u + if step.is_nan() { 0.0 } else { step }).clamp(low, high);
        if u == place.u {
            break;
        }
        let there = columns.place(piece.number, u);
        let onward = piece.between(&there.position.value, target, None);
        let is_nearer = length(&onward) + known < length(&to);
        if !is_nearer {
            break;
        }
        (place, to) = (there, onward);
    }
    place
}

/// Distance of a position from a place, less rounding; angles known up to whole turns by the smaller angle.
fn off<const M: usize>(piece: &Piece<M>, position: &[f64; M], place: &[f64; M]) -> f64 {
    let away = length(&piece.between(place, position, None));
    away - rounding(piece, position).max(rounding(piece, place))
}

/// Rounding of a distance, by the greatest coordinate of joints and tip.
fn rounding<const M: usize>(piece: &Piece<M>, position: &[f64; M]) -> f64 {
    let size = position.iter().fold(piece.start_size(), |most: f64, x| most.max(x.abs()));
    ROUNDING * (piece.joints() as f64).sqrt() * size
}
