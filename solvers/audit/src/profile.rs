//! Audits a speed profile against all limits: every phase at as many places as its motion needs, the switches from phase to
//! phase, and the ends of runs.
//!
//! A column is an axis of the path or a joint. On a phase whose p is known by the parameter the velocities of all columns are
//! evaluated at about ten places, closer together where p changes fast and very close at both ends, where the accelerations have
//! their extremes. Between two places the acceleration is the difference of the velocities over the time, less what the errors of
//! both can add. `at_once` and `by_length` audit the phases whose speed is known by the length of the path.

mod at_once;
mod by_length;

use std::ops::Range;

use super::chord::chord_error;
use super::columns::{Columns, CHORD};
use super::curve::KEPT;
use super::parallel;
use super::phase_jerk::Jerks;
use super::phase_motion::{self, PhaseMotion, State};
use super::phase_order::PhaseOrder;
use super::phases::{Phases, FEED, PATH_JERK};
use super::speed_by_length::is_same_speed;
use super::station::{Place, Station};
use super::vectors::vector_of;
use super::{tell, Check, Limits, Seen, Tally, EPS, FEEDS, GAP_TOLERANCE, PASS_EXCESS, ROUNDINGS};
use at_once::{Judge, Looks, OnPiece, PLACES};
use by_length::{Look, Looker};

/// Even intervals of a phase.
const INTERVALS: usize = 8;

/// Number of intervals of a slide (see `PhaseMotion::is_slide`) on which some acceleration comes near its limit.
const SLIDE_INTERVALS: usize = 64;

/// Use of an acceleration limit from which a slide is divided into `SLIDE_INTERVALS`.
const NEAR: f64 = 0.9;

/// The two end intervals of a phase are as short as rounding allows: it adds `HIDDEN` of the acceleration limit there. They have
/// at least `SHORTEST` of the width of the phase; the time of a shorter one would have no correct digits.
const HIDDEN: f64 = 1e-7;
const SHORTEST: f64 = 1e-7;

/// An interval is halved where its time differs by more than this part from that at constant ü; at most `MOST_HALVINGS` times on
/// a phase.
const UNEVEN: f64 = 0.05;
const MOST_HALVINGS: u32 = 200;

/// Phases that a thread takes at a time.
const BLOCK: usize = 4096;

/// Greatest number of phases in a group, and of pieces that they are on.
const GROUP: [usize; 2] = [16, KEPT];

/// Every `FIRST`-th group of phases is audited in a first pass. The greatest uses of the limits found there show that most phases
/// of the second pass need no closer look. A sparser first pass finds smaller uses; and where the use of a limit grows from phase
/// to phase, each phase exceeds all that was found before.
const FIRST: usize = 8;

/// A profile, and the limits that it is audited against.
pub struct Audited<'a, const M: usize> {
    /// Greatest speed at the start of each piece, and at the end of the last one, in mm/s.
    pub junction_speed: &'a [f64],
    pub phases: &'a Phases<'a>,
    pub limits: &'a Limits<M>,
    /// Start time of each phase, and end time of the last one, in s.
    pub starts: &'a [f64],
    /// Whether the numbers of each phase can be used; see `Phases::have_good_numbers`.
    pub are_good: &'a [bool],
}

/// Audits the whole profile: phases, switches, ends of runs. `columns` makes new columns for every block of phases, since threads
/// cannot share them.
pub fn audit_profile<'a, const M: usize>(
    of: &Audited<M>,
    columns: &(dyn Fn() -> Columns<'a, M> + Sync),
    seen: Seen,
) -> Tally<M> {
    let phases = of.phases;
    let known = parallel::tally(&Tally::default(), phases.len(), BLOCK, &|block, tally| {
        let mut columns = columns();
        let mut looks = Looks::new(columns.room());
        for group in phases.groups(block, GROUP).iter().step_by(FIRST) {
            of.at_once(group, &mut columns, &mut looks, tally);
            of.look_ahead(group, &mut columns, &mut looks);
            for (i, time) in group.clone().zip(&looks.times) {
                of.phase((i, *time), &mut columns, &mut None, tally);
            }
        }
    });
    let inside = parallel::tally(&known, phases.len(), BLOCK, &|block, tally| {
        let mut columns = columns();
        let mut looks = Looks::new(columns.room());
        let first = block.start;
        let groups = phases.groups(block, GROUP);
        let (mut is_good, mut last) = (first > 0 && of.are_good[first - 1], None);
        let begun = phases.runs.partition_point(|&begin| begin < first as i64);
        let mut runs = phases.runs[begun..].iter().peekable();
        for (number, group) in groups.into_iter().enumerate() {
            let is_known = number.is_multiple_of(FIRST);
            if is_known {
                looks.times.clear();
                looks.times.resize(group.len(), Some(0.0));
            } else {
                of.at_once(&group, &mut columns, &mut looks, tally);
            }
            of.look_ahead(&group, &mut columns, &mut looks);
            for (member, i) in group.enumerate() {
                tell(seen, i);
                let found = match is_known {
                    true => of.are_good[i],
                    false => of.phase((i, looks.times[member]), &mut columns, &mut last, tally),
                };
                let was_good = std::mem::replace(&mut is_good, found);
                // Several runs begin at once if some have no phase.
                let mut begins = false;
                while runs.next_if_eq(&&(i as i64)).is_some() {
                    begins = true;
                }
                // Phases with unusable numbers are reported by `phase`.
                if i > 0 && was_good && is_good && !begins {
                    of.joint([i - 1, i], &mut columns, tally);
                }
            }
        }
    });
    let mut order = Tally::default();
    of.order(&mut columns(), &mut order);
    known.merge(inside).merge(order)
}

impl<const M: usize> Audited<'_, M> {
    /// Audits phase `i`; returns whether its numbers can be used. `known` is its time in s if `at_once` has found that the phase
    /// cannot raise any use in the tally. `last` is the station at the end of the phase before, with its piece.
    fn phase(
        &self,
        (i, known): (usize, Option<f64>),
        columns: &mut Columns<M>,
        last: &mut Option<(usize, Station<M>)>,
        tally: &mut Tally<M>,
    ) -> bool {
        let (phases, time) = (self.phases, self.starts[i]);
        let piece = phases.piece[i] as usize;
        let line = columns.path.line_of(piece);
        if !self.are_good[i] {
            tally.offer(Check::Numbers, 0, f64::INFINITY, 0.0, time, line);
            return false;
        }
        let width = columns.path.width[piece];
        let u = [phases.u0[i], phases.u1[i]];
        if !is_order(u, width) {
            tally.offer(Check::Order, 0, f64::INFINITY, GAP_TOLERANCE, time, line);
            return true;
        }
        let width_rounding = EPS * width / (u[1] - u[0]);
        if let Some(elapsed) = known {
            tally.samples += PLACES as u64;
            *last = None;
            self.duration(i, [elapsed, 0.0], width_rounding, line, tally);
            return true;
        }
        let by_length = phases.by_length(i, columns);
        if self.limits.judges_jerk {
            self.jerks(columns).alone(i, width_rounding, by_length.is_some(), line, tally);
        }
        let feeds = columns.feeds(piece);
        let elapsed = if let Some(motion) = by_length {
            let curve = columns.curve(piece).clone();
            let covered = curve.turns() as f64 * ((u[1] - u[0]) / width);
            let (limits, start, motion) = (self.limits, time, &motion);
            let feeds_along = columns.feeds_along(piece);
            let mut looker = Looker {
                columns: &mut *columns,
                piece,
                motion,
                curve: &curve,
                limits,
                feeds,
                feeds_along,
                covered,
                start,
                line,
            };
            let from = match last.filter(|(number, station)| *number == piece && station.u == u[0]) {
                Some((_, station)) => Some(looker.look_at(&station, tally)),
                None => looker.look_at_end(u[0], tally),
            };
            let to = looker.look_at_end(u[1], tally);
            *last = to.as_ref().map(|look| (piece, look.station));
            let ends = [from.as_ref(), to.as_ref()];
            looker.phase(u, ends, tally);
            self.ends_by_length(i, ends, columns, line, tally);
            [motion.time(), 0.0]
        } else {
            let motion = PhaseMotion::new(phases, i, columns);
            let (start, duration, limits) = (time, phases.duration[i], self.limits);
            let mut probe = Probe {
                motion: &motion,
                columns: &mut *columns,
                limits,
                tally: &mut *tally,
                feeds,
                start,
                duration,
                line,
                elapsed: [0.0; 2],
                nearest_limit: 0.0,
                halvings: MOST_HALVINGS,
            };
            let ends = probe.run();
            let elapsed = probe.elapsed;
            if probe.nearest_limit >= NEAR && motion.is_slide() {
                probe.elapsed = [0.0; 2];
                probe.run_evenly(SLIDE_INTERVALS);
            }
            self.recorded_ends(i, &motion, &ends, columns, line, tally);
            elapsed
        };
        self.duration(i, elapsed, width_rounding, line, tally);
        true
    }

    /// Finds the times of those phases of a group that cannot raise any use in the tally, from eight places of each and a bound
    /// of what lies between them. They are in `looks.times`, with None for the other phases.
    fn at_once<'a>(
        &self,
        group: &Range<usize>,
        columns: &mut Columns<'a, M>,
        looks: &mut Looks<'a, M>,
        tally: &Tally<M>,
    ) {
        let phases = self.phases;
        looks.pieces.clear();
        looks.phases.clear();
        let (mut last, mut is_known) = (None, false);
        for i in group.clone() {
            let piece = phases.piece[i] as usize;
            if last != Some(piece) {
                let on = (piece < phases.pieces).then(|| OnPiece::new(piece, columns)).flatten();
                (last, is_known) = (Some(piece), on.is_some());
                looks.pieces.extend(on);
            }
            let on = looks.pieces.last().filter(|_| is_known);
            let u = [phases.u0[i], phases.u1[i]];
            let is_cubic = phases.kind[i] != PATH_JERK && phases.is_by_length(i, columns);
            let is_good = |on: &&OnPiece<M>| is_cubic && self.are_good[i] && is_order(u, on.width());
            looks.phases.push(on.filter(is_good).map(|_| at_once::Phase {
                piece: looks.pieces.len() - 1,
                u,
                p: [phases.p0[i], phases.p1[i]],
                a: [phases.a0[i], phases.a1[i]],
                held_sq: (phases.kind[i] == FEED).then(|| phases.value[i]),
            }));
        }
        let Columns { rates, per_least, .. } = &*columns;
        Judge { rates, per_least, limits: self.limits }.look_at(looks, tally);
    }

    /// Computes ahead, several at once, the stations at the ends of those phases of a group that need a closer look, and where
    /// two pieces meet. Only stations of joints are computed so.
    fn look_ahead(&self, group: &Range<usize>, columns: &mut Columns<M>, looks: &mut Looks<M>) {
        let phases = self.phases;
        if columns.are_axes() {
            return;
        }
        looks.ends.clear();
        let meets_other = |i: usize| i > 0 && phases.piece[i - 1] != phases.piece[i];
        let mut add = |i: usize, u: f64| {
            if self.are_good[i] {
                looks.ends.push((phases.piece[i] as usize, u));
            }
        };
        for (i, time) in group.clone().zip(&looks.times) {
            // Where pieces meet, `joint` asks for the end of one phase together with the start of the next one.
            if meets_other(i) {
                add(i - 1, phases.u1[i - 1]);
                add(i, phases.u0[i]);
            }
            if time.is_none() {
                add(i, phases.u0[i]);
                add(i, phases.u1[i]);
            }
        }
        looks.ends.dedup();
        columns.look_ahead_on_each(&looks.ends, &mut looks.room);
    }

    /// Compares the recorded duration of phase `i` with the audit's own time `elapsed`, which has the error `doubt`, both in s. A
    /// rounding of u0 or u1 changes the width by the share `width_rounding`, and the time by at least this share; at a slow end
    /// it changes the time by what the motion takes over that rounding.
    fn duration(
        &self,
        i: usize,
        [elapsed, doubt]: [f64; 2],
        width_rounding: f64,
        line: i32,
        tally: &mut Tally<M>,
    ) {
        let phases = self.phases;
        let off = (phases.duration[i] - elapsed).abs();
        // Most phases differ by no more than the rounding of their width.
        if off < ROUNDINGS * width_rounding * elapsed && tally.is_measured(Check::Duration, 0) {
            return;
        }
        let slowest = phases.p0[i].min(phases.p1[i]).sqrt();
        let rounding = width_rounding * (phases.u1[i] - phases.u0[i]);
        let at_end = if slowest > 0.0 { rounding / (slowest * elapsed) } else { 0.0 };
        let known = (ROUNDINGS * width_rounding.max(at_end)).max(doubt / elapsed);
        let error = off / elapsed - known;
        tally.offer(Check::Duration, 0, error, PASS_EXCESS, self.starts[i], line);
    }

    /// Compares the recorded p at both ends with the speed by the length there; the difference is offered as a jump of velocity.
    fn ends_by_length(
        &self,
        i: usize,
        ends: [Option<&Look<M>>; 2],
        columns: &mut Columns<M>,
        line: i32,
        tally: &mut Tally<M>,
    ) {
        let known = [self.phases.p0[i], self.phases.p1[i]];
        for (side, (look, p)) in ends.into_iter().zip(known).enumerate() {
            let Some(look) = look else { continue };
            let (v, slope) = (look.place.pace.v, look.station.slope);
            let speeds = [v, slope * p.sqrt()];
            let rounding = match is_same_speed(v, speeds[1]) {
                true => [f64::INFINITY; M],
                false => look.velocity_rounding(self.phases.piece[i] as usize, columns),
            };
            self.recorded_end(
                [i, side],
                (speeds, &look.station.first, &rounding),
                slope,
                columns,
                line,
                tally,
            );
        }
    }

    /// Compares the recorded p at both ends with what the law of the phase gives there; the difference is offered as a jump of
    /// velocity.
    fn recorded_ends(
        &self,
        i: usize,
        motion: &PhaseMotion<M>,
        ends: &[State<M>; 2],
        columns: &mut Columns<M>,
        line: i32,
        tally: &mut Tally<M>,
    ) {
        for (y, state) in ends.iter().enumerate() {
            let side = usize::from((y == 1) != motion.anchored_at_end);
            let speeds = [state.root_p, [self.phases.p0[i], self.phases.p1[i]][side].sqrt()];
            let (rates, rounding) = (&state.place.slope.value, &state.velocity.rounding);
            self.recorded_end([i, side], (speeds, rates, rounding), 1.0, columns, line, tally);
        }
    }

    /// Offers the difference of two speeds at an end of phase `i` as a jump of velocity; `rates` times a speed is the velocity of
    /// each column. A place is known up to its rounding in u, which is a length of `slope` times that: what a column may gain by
    /// accelerating over this length is no jump.
    fn recorded_end(
        &self,
        [i, side]: [usize; 2],
        (speeds, rates, rounding): ([f64; 2], &[f64; M], &[f64; M]),
        slope: f64,
        columns: &mut Columns<M>,
        line: i32,
        tally: &mut Tally<M>,
    ) {
        let phases = self.phases;
        let way = ROUNDINGS * EPS * columns.path.width[phases.piece[i] as usize] * slope;
        let time = self.starts[i] + side as f64 * phases.duration[i];
        for k in 0..columns.count() {
            let rate = rates[k].abs();
            let [slow, fast] = [speeds[0].min(speeds[1]), speeds[0].max(speeds[1])].map(|speed| rate * speed);
            let (most, negligible) = (fast - slow - rounding[k], self.negligible(i, k, columns));
            if most > 0.0 && !tally.is_passed(Check::Jump, k, most, negligible) {
                let gained = 2.0 * self.limits.acceleration.greatest(k) * way * rate;
                let reached = (slow * slow + gained).sqrt().max(slow);
                tally.offer(Check::Jump, k, fast - reached - rounding[k], negligible, time, line);
            } else {
                tally.offer(Check::Jump, k, most, negligible, time, line);
            }
        }
    }

    /// The greatest jump of the velocity of a column that is negligible on phase `i`, in mm/s.
    fn negligible(&self, i: usize, k: usize, columns: &Columns<M>) -> f64 {
        self.limits.negligible_jump(k, columns.settling(self.phases.duration[i]))
    }

    fn jerks(&self, columns: &Columns<M>) -> Jerks<'_, M> {
        let Self { phases, limits, starts, .. } = *self;
        Jerks { phases, limits, starts, smooth: columns.smooth() }
    }

    /// Checks that the phases of a run cover all its pieces without gap, and that runs begin and end at rest, the first and the
    /// last one at the end speeds of the path.
    fn order(&self, columns: &mut Columns<M>, tally: &mut Tally<M>) {
        let Self { phases, starts, are_good, .. } = *self;
        let order = PhaseOrder { path: &columns.path, phases, starts, are_good };
        if !order.audit(tally) {
            return;
        }
        let [start_speed, end_speed] = self.limits.end_speeds;
        let runs = phases.runs.windows(2).enumerate();
        for (run, ends) in runs.filter(|(_, ends)| ends[0] < ends[1]) {
            let (first, last) = (ends[0] as usize, ends[1] as usize - 1);
            let wanted = if run == 0 { start_speed } else { 0.0 };
            self.run_end([first, 0], wanted, columns, tally);
            let wanted = if run + 2 == phases.runs.len() { end_speed } else { 0.0 };
            self.run_end([last, 1], wanted, columns, tally);
        }
    }

    /// The place at an end of phase `i`, and √p there.
    fn end(&self, [i, side]: [usize; 2], columns: &mut Columns<M>) -> (Place<M>, f64) {
        let phases = self.phases;
        let (u, p) = if side == 0 { (phases.u0[i], phases.p0[i]) } else { (phases.u1[i], phases.p1[i]) };
        (columns.place(phases.piece[i] as usize, u), p.sqrt())
    }

    /// Checks the switch from phase `i` to phase `j`: the speed may not jump, and axis velocities only where two pieces meet.
    fn joint(&self, [i, j]: [usize; 2], columns: &mut Columns<M>, tally: &mut Tally<M>) {
        let phases = self.phases;
        let pieces = [i, j].map(|phase| phases.piece[phase] as usize);
        let [before, after] = pieces;
        let (time, line) = (self.starts[j], columns.path.line_of(after));
        if self.limits.judges_jerk && [i, j].iter().all(|&phase| phases.is_by_length(phase, columns)) {
            self.jerks(columns).joint([i, j], columns, line, tally);
        }
        if before == after && phases.u1[i] == phases.u0[j] && phases.p1[i] == phases.p0[j] {
            // It is one place, with one speed.
            for k in 0..columns.count() {
                if !tally.is_measured(Check::Jump, k) {
                    tally.offer(Check::Jump, k, 0.0, self.negligible(j, k, columns), time, line);
                }
            }
            return;
        }
        let states = [[i, 1], [j, 0]].map(|end| {
            let (mut place, root_p) = self.end(end, columns);
            // Where two pieces meet, the rounding of their control points turns the tangents.
            let turned = if before == after { 0.0 } else { columns.turned(place.piece) };
            place.slope.rounding = vector_of(|k| place.slope.rounding[k] + turned);
            State::new(place, root_p, 0.0)
        });
        let [from, to] = states.each_ref().map(|state| &state.velocity);
        let at_corner = if before == after { 0.0 } else { 1.0 };
        for k in 0..columns.count() {
            let jump = (to.value[k] - from.value[k]).abs() - from.rounding[k] - to.rounding[k];
            let limit = at_corner * self.limits.jump[k] + self.negligible(j, k, columns);
            tally.offer(Check::Jump, k, jump, limit, time, line);
        }
        if before == after {
            return;
        }
        let slack = columns.negligible_speed(&states[1].place, columns.settling(phases.duration[j]));
        let speeds = states.each_ref().map(|state| columns.speed(CHORD, &state.velocity, state.tip()));
        // The two speeds can be compared only if both feeds limit the same axes.
        if columns.comparable(pieces) {
            let jump = (speeds[1][0] - speeds[0][0]).abs() - speeds[0][1] - speeds[1][1];
            tally.offer(Check::Continuity, 0, jump, slack, time, line);
        }
        let fastest = speeds[0][0].max(speeds[1][0]);
        // Motionless pieces in between have junctions of their own.
        for junction in before + 1..=after {
            let allowed = self.junction_speed[junction] + slack;
            tally.offer(Check::Junction, 0, fastest, allowed, time, line);
            if !columns.path.is_motionless(junction) {
                break;
            }
        }
    }

    /// Checks the speed at the start or the end of a run against the `wanted` one in mm/s.
    fn run_end(&self, [i, side]: [usize; 2], wanted: f64, columns: &mut Columns<M>, tally: &mut Tally<M>) {
        let (place, root_p) = self.end([i, side], columns);
        let line = columns.path.line_of(place.piece);
        let (state, duration) = (State::new(place, root_p, 0.0), self.phases.duration[i]);
        let [speed, _] = columns.speed(CHORD, &state.velocity, state.tip());
        let off = (speed - wanted).abs() - ROUNDINGS * EPS * (speed + wanted);
        let slack = columns.negligible_speed(&state.place, columns.settling(duration));
        let time = self.starts[i] + side as f64 * duration;
        tally.offer(Check::Junction, 0, off, slack, time, line);
        if self.limits.judges_jerk && wanted == 0.0 {
            self.jerks(columns).rest(i, side == 1, line, tally);
        }
    }
}

/// Whether the ends of a phase are in order on a piece of this width.
fn is_order([from, to]: [f64; 2], width: f64) -> bool {
    from < to && 0.0 <= from && to <= width * (1.0 + ROUNDINGS * EPS)
}

/// Walks over one phase, from its anchor on, and offers what it uses of the limits to the tally.
struct Probe<'a, 'b, const M: usize> {
    motion: &'a PhaseMotion<M>,
    columns: &'a mut Columns<'b, M>,
    limits: &'a Limits<M>,
    tally: &'a mut Tally<M>,
    feeds: [f64; FEEDS],
    start: f64,
    duration: f64,
    line: i32,
    /// Time from the anchor, and its error, in s.
    elapsed: [f64; 2],
    /// Greatest use of an acceleration limit so far, except by the column that the law holds.
    nearest_limit: f64,
    halvings: u32,
}

impl<const M: usize> Probe<'_, '_, M> {
    fn state(&mut self, y: f64) -> State<M> {
        self.motion.at(self.motion.parameter(y), self.columns)
    }

    /// Walks over equal intervals of y (see `PhaseMotion::parameter`) with a short one at each end; returns the states at both
    /// ends.
    fn run(&mut self) -> [State<M>; 2] {
        let ends = [0.0, 1.0].map(|y| self.state(y));
        self.place(&ends[0]);
        let (step, mut state) = (1.0 / INTERVALS as f64, ends[0]);
        let shortest = [self.motion.variable(SHORTEST), 1.0 - self.motion.variable(1.0 - SHORTEST)];
        let short = |end: usize| {
            let y = self.short_interval(&ends[end]).max(shortest[end]);
            Some(y).filter(|y| *y < step)
        };
        let [head, tail] = [short(0), short(1)];
        let inner = (1..INTERVALS).map(|i| i as f64 * step);
        for y in head.into_iter().chain(inner).chain(tail.map(|y| 1.0 - y)) {
            let next = self.state(y);
            // Next to an end where the column of the law is at rest, rounding may hide the speed by the law: such a place is left
            // out.
            if (y < step || y > 1.0 - step) && (next.doubt.is_nan() || next.doubt > phase_motion::HIDDEN) {
                continue;
            }
            self.advance(&state, &next);
            state = next;
        }
        self.advance(&state, &ends[1]);
        ends
    }

    fn run_evenly(&mut self, intervals: usize) {
        let mut state = self.state(0.0);
        for i in 1..=intervals {
            let next = self.state(i as f64 / intervals as f64);
            self.advance(&state, &next);
            state = next;
        }
    }

    /// Length in y of an end interval in which rounding adds no more than `HIDDEN` of any acceleration limit.
    fn short_interval(&self, end: &State<M>) -> f64 {
        let mut time = 0.0_f64;
        for k in 0..M {
            time = time.max(2.0 * end.velocity.rounding[k] / (HIDDEN * self.limits.acceleration.least(k)));
        }
        time / self.duration
    }

    /// Goes on from one place to the next one; the interval is halved where p changes fast.
    fn advance(&mut self, from: &State<M>, to: &State<M>) {
        let [time, doubt] = self.motion.time([from, to], self.columns);
        let (a, b) = (from.place.u, to.place.u);
        let (even, middle) = (2.0 * (b - a).abs() / (from.root_p + to.root_p), 0.5 * (a + b));
        let is_uneven = doubt < UNEVEN && (time - even).abs() > UNEVEN * even;
        if !is_uneven || self.halvings == 0 || middle <= a.min(b) || middle >= a.max(b) {
            return self.interval([from, to], time, doubt);
        }
        self.halvings -= 1;
        let middle = self.motion.at(middle, self.columns);
        self.advance(from, &middle);
        self.advance(&middle, to);
    }

    fn interval(&mut self, [from, to]: [&State<M>; 2], time: f64, doubt: f64) {
        // Two places may be the same after rounding.
        if from.place.u == to.place.u {
            return;
        }
        let middle = self.clock(self.elapsed[0] + 0.5 * time);
        self.elapsed = [self.elapsed[0] + time, self.elapsed[1] + time * doubt];
        let held = self.motion.held_column();
        // On a phase that is anchored at its end, the walk goes back in time.
        let [early, late] = if self.motion.anchored_at_end { [to, from] } else { [from, to] };
        let way = self.columns.way(&early.place, &late.place);
        let certain = |rate: f64| rate - rate.abs() * doubt;
        for k in 0..self.columns.count() {
            let rounding = (from.velocity.rounding[k] + to.velocity.rounding[k]) / time;
            let change = late.velocity.value[k] - early.velocity.value[k];
            let acceleration = certain(change.abs() / time) - rounding;
            let limit = self.limits.acceleration.of(k, change);
            self.tally.offer(Check::Acceleration, k, acceleration, limit, middle, self.line);
            if held != Some(k) {
                self.nearest_limit = self.nearest_limit.max(acceleration / limit);
            }
            let mean = certain((way.value[k].abs() - way.rounding[k]) / time);
            let limit = self.limits.velocity.of(k, way.value[k]);
            self.tally.offer(Check::Velocity, k, mean, limit, middle, self.line);
        }
        self.place(to);
    }

    /// Offers the velocities, the feeds and the chord error at one place.
    fn place(&mut self, state: &State<M>) {
        let time = self.clock(self.elapsed[0]);
        self.tally.samples += 1;
        for k in 0..self.columns.count() {
            let velocity = state.velocity.value[k].abs() - state.velocity.rounding[k];
            let limit = self.limits.velocity.of(k, state.velocity.value[k]);
            self.tally.offer(Check::Velocity, k, velocity, limit, time, self.line);
        }
        let tip = state.tip();
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let [speed, rounding] = self.columns.speed(feed, &state.velocity, tip);
            self.tally.offer(Check::Feed, 0, speed - rounding, limit, time, self.line);
        }
        if self.limits.chord_tolerance.is_finite() {
            let [speed, rounding] = self.columns.speed(CHORD, &state.velocity, tip);
            let curvature = self.columns.curvature(state.place.piece, state.place.u);
            let error = chord_error((speed - rounding) * self.limits.period, curvature);
            self.tally.offer(Check::Chord, 0, error, self.limits.chord_tolerance, time, self.line);
        }
    }

    /// Time in the program, in s, at `elapsed` from the anchor.
    fn clock(&self, elapsed: f64) -> f64 {
        self.start + if self.motion.anchored_at_end { self.duration - elapsed } else { elapsed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Followed, Pieces};
    use crate::phases::PATH_JERK;

    #[test]
    fn a_speed_that_goes_back_is_as_great_as_one_that_goes_on() {
        // From rest at the end back to the start at a jerk of −6 for 1 s: −3 mm/s there.
        let pieces = Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 1.0, 0.0],
            weights: &[],
            offsets: &[0, 2],
            width: &[1.0],
        };
        let feed = [2.0, f64::INFINITY, f64::INFINITY, f64::INFINITY];
        let (path, limits) = (Followed { feed: &feed, ..Followed::of_one(pieces) }, Limits::<2>::none());
        let phases = Phases::of_one(&[PATH_JERK], &[255], &[-6.0], &[0.0, 1.0], &[1.0, 0.0]);
        let (starts, are_good) = (&[0.0, 1.0], &[true]);
        let of = Audited { junction_speed: &[0.0; 2], phases: &phases, limits: &limits, starts, are_good };
        let tally = audit_profile(&of, &|| Columns::new(&path, &limits, None), &|_| ());
        assert!(tally.get(Check::Feed, 0).ratio > 1.4, "{:?}", tally.get(Check::Feed, 0));
    }
}
