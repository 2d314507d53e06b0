//! Evaluates a speed profile at the places of setpoints: its time, velocity and acceleration there. `at_once` does so for eight
//! places at once.

mod at_once;

use super::columns::Columns;
use super::motion::{Motion, Passage};
use super::nearest::Place;
use super::number::Lanes;
use super::phases::SPEED_CUBIC;
use super::profile_clock::ProfileClock;
use super::station::Rounded;
use super::together::Together;
use super::vectors::{length, vector_of};
use super::{Limits, EPS, PLACE_TOLERANCE, ROUNDINGS};

/// A recorded acceleration may differ from the profile's by this share of its limit.
pub const ACCELERATION_SHARE: f64 = 1e-2;

/// A switch of the acceleration within this share of a period counts as simultaneous with the setpoint.
const SWITCH_SHARE: f64 = 1e-4;

/// Limit of the switches examined on each side; a correct profile has only a few in so short a time.
const MOST_SWITCHES: usize = 64;

/// Number of phases that are tried one after the other for a place ahead, before a binary search.
const NEXT: usize = 4;

/// Evaluates a profile at one setpoint after the other. Remembers the current phase, since the next place is mostly on it too.
pub struct Reader<'a, const M: usize> {
    clock: ProfileClock<'a>,
    phase: usize,
    run: usize,
    pub columns: Columns<'a, M>,
    /// The motion on one phase, with the number of the phase, which may differ from the current one.
    motion: (usize, Motion<M>),
    /// The last place, and the profile there.
    last: Option<(Place, Passage<M>)>,
    /// Places expected next, the last one first; with the phase of each and the profile there.
    ahead: Vec<(Place, usize, Passage<M>)>,
    /// Among the places expected next, the u of those on other kinds of phases than `SPEED_CUBIC`.
    others: Vec<f64>,
    room: Vec<Lanes>,
}

impl<'a, const M: usize> Reader<'a, M> {
    /// Starts on the first phase; there must be one, and a run of the path for it.
    pub fn new(clock: &ProfileClock<'a>, mut columns: Columns<'a, M>) -> Self {
        let motion = (0, Motion::new(&clock.phases, 0, &mut columns));
        let room = columns.room();
        let mut reader = Self {
            clock: *clock,
            phase: 0,
            run: 0,
            columns,
            motion,
            last: None,
            ahead: vec![],
            others: vec![],
            room,
        };
        reader.enter(0);
        reader
    }

    fn enter(&mut self, phase: usize) {
        self.phase = phase;
        if !self.clock.phases_of(self.run).contains(&phase) {
            self.run = self.clock.phases.runs.partition_point(|&first| first <= phase as i64) - 1;
        }
    }

    /// The motion on the current phase.
    fn motion(&mut self) -> (&Motion<M>, &mut Columns<'a, M>) {
        if self.motion.0 != self.phase {
            self.motion = (self.phase, self.motion_of(self.phase));
        }
        (&self.motion.1, &mut self.columns)
    }

    fn motion_of(&mut self, phase: usize) -> Motion<M> {
        Motion::new(&self.clock.phases, phase, &mut self.columns)
    }

    fn ends(&self, phase: usize) -> [f64; 2] {
        [self.clock.phases.u0[phase], self.clock.phases.u1[phase]]
    }

    /// Goes to the phase that holds a place, the earlier one of two that meet there, and evaluates the profile at the place. A
    /// place on a motionless piece counts as the start of the next phase.
    pub fn go_to(&mut self, place: Place) -> Passage<M> {
        if let Some((_, passage)) = self.last.filter(|(last, _)| *last == place) {
            return passage;
        }
        while self.ahead.pop_if(|(ahead, ..)| *ahead < place).is_some() {}
        let known = self.ahead.pop_if(|(ahead, ..)| *ahead == place);
        self.enter(known.map_or_else(|| self.phase_from(self.phase, place), |(_, phase, _)| phase));
        let (phases, phase) = (&self.clock.phases, self.phase);
        let u = if phases.piece[phase] as usize == place.piece { place.u } else { phases.u0[phase] };
        let passage = known.map_or_else(
            || {
                let (motion, columns) = self.motion();
                motion.passage(u, columns)
            },
            |(.., passage)| passage,
        );
        self.last = Some((place, passage));
        passage
    }

    /// Evaluates the profile at once at places of one piece that `go_to` will be called with in this order.
    pub fn look_ahead(&mut self, on: &Together<M>, piece: usize, places: &[f64]) {
        self.ahead.clear();
        self.others.clear();
        let (phases, mut phase) = (self.clock.phases, self.phase);
        for &u in places {
            let place = Place { piece, u };
            phase = self.phase_from(phase, place);
            if phases.kind[phase] != SPEED_CUBIC {
                self.others.push(u);
            } else if phases.piece[phase] as usize == piece {
                self.ahead.push((place, phase, Passage::unknown(u)));
            }
        }
        at_once::read(on, &phases, &mut self.ahead, &mut self.room);
        self.ahead.reverse();
        self.columns.look_ahead(on, &self.others, &mut self.room);
    }

    /// The phase that holds a place; mostly `phase` itself or one of the next few.
    fn phase_from(&self, phase: usize, place: Place) -> usize {
        let mut next = phase..self.clock.phases.len().min(phase + NEXT);
        next.find(|&phase| self.holds(phase, place)).unwrap_or_else(|| self.find(place))
    }

    /// When the profile is at a place, on the clock of the profile with pauses of runs included, in s.
    pub fn time_of(&mut self, place: Place) -> f64 {
        let here = self.go_to(place);
        self.clock.starts[self.phase] + here.since
    }

    /// Where the profile is at a time on the clock of the setpoints: piece, parameters of both ends of the phase, u.
    pub fn phase_at(&mut self, time: f64) -> (usize, [f64; 2], f64) {
        let found = self.clock.phase_of(self.clock.run_of(time), time);
        let (phase, since) = found.unwrap_or((self.phase, 0.0));
        self.enter(phase);
        let ends = self.ends(phase);
        let (motion, columns) = self.motion();
        let u = motion.place_at(since, columns).clamp(ends[0], ends[1]);
        (self.clock.phases.piece[phase] as usize, ends, u)
    }

    fn holds(&self, phase: usize, place: Place) -> bool {
        let phases = &self.clock.phases;
        phases.piece[phase] as usize == place.piece
            && phases.u0[phase] < place.u
            && place.u <= phases.u1[phase]
    }

    fn find(&self, place: Place) -> usize {
        let phases = &self.clock.phases;
        let first =
            phases.piece.partition_point(|&piece| (piece as usize) < place.piece).min(phases.len() - 1);
        let count = phases.piece[first..].partition_point(|&piece| piece as usize == place.piece);
        let passed = phases.u1[first..first + count].partition_point(|&end| end < place.u);
        first + passed.min(count.saturating_sub(1))
    }

    /// When the profile arrives at a place of the current phase and when it leaves it, on the clock of the setpoints, in s. Both
    /// differ only at stops, where the profile pauses and setpoints may wait for their next period.
    fn times(&self, here: &Passage<M>, period: f64) -> [f64; 2] {
        let (clock, phase, run) = (&self.clock, self.phase, self.run);
        let phases = &clock.phases;
        let start = clock.starts[phase] + clock.shift(run);
        let (time, end) = (start + here.since, start + phases.duration[phase]);
        let (mut from, mut until) = (time, time);
        if here.u <= phases.u0[phase] && phase == clock.phases_of(run).start {
            from = match run {
                0 => 0.0,
                _ => clock.run_starts.get(run - 1).map_or(time, |start| start + clock.motion_time(run - 1)),
            };
        }
        if here.u >= phases.u1[phase] && phase + 1 == clock.phases_of(run).end {
            until =
                clock.run_starts.get(run + 1).copied().unwrap_or(end + self.columns.path.dwell[run] + period);
        }
        [from, until]
    }

    /// Upper bound of the distance that the profile moves between `time` and the time it is at `place`, in mm, less its rounding
    /// error bound.
    pub fn late(&mut self, place: Place, time: f64, limits: &Limits<M>) -> f64 {
        let here = self.go_to(place);
        let [from, until] = self.times(&here, limits.period);
        let wait = (from - time).max(time - until).max(0.0);
        // The start time of a phase is a sum of durations, with one rounding for each phase before.
        let doubt = if here.doubt.is_nan() { 0.0 } else { here.doubt };
        let rounding = EPS * time.abs() * (self.phase as f64 + ROUNDINGS) + doubt;
        if wait <= rounding {
            return 0.0;
        }
        let speed = length(&here.velocity.value);
        let reach = |wait: f64| wait * (speed + 0.5 * wait * length(&limits.acceleration.greater()));
        let most = reach(wait) - reach(rounding);
        // Where the profile turns slowly, the length of the path in between is a much smaller bound.
        if most > PLACE_TOLERANCE && self.columns.are_axes() {
            most.min(self.way_from(place, time).unwrap_or(most))
        } else {
            most
        }
    }

    /// Upper bound of the length of the path between a place and the place of the profile at `time`, in mm; None unless both are
    /// on the same piece or on consecutive ones.
    fn way_from(&mut self, place: Place, time: f64) -> Option<f64> {
        let (_, here, phase) = self.motion_at(self.run, time)?;
        let there = Place { piece: self.clock.phases.piece[phase] as usize, u: here.u };
        let (first, last) =
            if (there.piece, there.u) < (place.piece, place.u) { (there, place) } else { (place, there) };
        let curve = self.columns.curve(first.piece).clone();
        match last.piece - first.piece {
            0 => Some(curve.way_at_most(first.u, last.u)),
            1 => {
                let next = self.columns.curve(last.piece);
                Some(curve.way_at_most(first.u, curve.width()) + next.way_at_most(0.0, last.u))
            }
            _ => None,
        }
    }

    /// The motion on the phase of a run that `time` falls into, the profile at that time, and the phase. None outside the phase.
    fn motion_at(&mut self, run: usize, time: f64) -> Option<(Motion<M>, Passage<M>, usize)> {
        let (phase, since) = self.clock.phase_of(run, time)?;
        let (duration, ends) = (self.clock.phases.duration[phase], self.ends(phase));
        // Nothing is known of a profile whose numbers are wrong.
        if !(0.0 <= since && since <= duration && ends[0] < ends[1]) {
            return None;
        }
        let motion = self.motion_of(phase);
        let u = motion.place_at(since, &mut self.columns);
        let here = motion.passage(u, &mut self.columns);
        Some((motion, here, phase))
    }

    /// The acceleration of each axis at `time` in a run; None outside the phases of the run.
    fn acceleration_at(&mut self, run: usize, time: f64) -> Option<[f64; M]> {
        let (motion, here, _) = self.motion_at(run, time)?;
        Some(motion.acceleration(&here, &mut self.columns).value)
    }

    /// How far recorded accelerations are from those of the profile, for each axis; not positive within their range. They are
    /// compared at a place of the current phase and, where that does not explain them, also at their time: where the tool creeps
    /// back from a turn, the place does not tell whether it is before or after the turn. If the tool stops there, these are in
    /// two runs.
    pub fn acceleration_off(
        &mut self,
        here: &Passage<M>,
        time: f64,
        recorded: &[f64; M],
        limits: &Limits<M>,
    ) -> [f64; M] {
        let range = self.accelerations(here, time, limits.period);
        let off: [f64; M] = vector_of(|k| (range[k][0] - recorded[k]).max(recorded[k] - range[k][1]));
        let is_off = (0..M).any(|k| off[k] > ACCELERATION_SHARE * limits.acceleration.least(k));
        if !is_off {
            return off;
        }
        [self.run, self.clock.run_of(time)].into_iter().fold(off, |off, run| {
            match self.acceleration_at(run, time) {
                Some(then) => vector_of(|k| off[k].min((recorded[k] - then[k]).abs())),
                None => off,
            }
        })
    }

    /// Least and greatest acceleration of each axis just before and just after `time`, at a place of the current phase.
    fn accelerations(&mut self, here: &Passage<M>, time: f64, period: f64) -> [[f64; 2]; M] {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; M];
        let mut include = |Rounded { value, rounding }: Rounded<M>| {
            for k in 0..M {
                range[k] = [range[k][0].min(value[k] - rounding[k]), range[k][1].max(value[k] + rounding[k])];
            }
        };
        include(here.acceleration.unwrap_or_else(|| {
            let (motion, columns) = self.motion();
            motion.acceleration(here, columns)
        }));
        let switch = SWITCH_SHARE * period;
        let ProfileClock { phases, starts, .. } = self.clock;
        let time = time - self.clock.shift(self.run);
        let run = self.clock.phases_of(self.run);
        let mut neighbour = |phase: usize, at_end: bool| {
            let ends = [phases.u0[phase], phases.u1[phase]];
            let motion = Motion::new(&phases, phase, &mut self.columns);
            let there = motion.passage(ends[usize::from(at_end)], &mut self.columns);
            include(motion.acceleration(&there, &mut self.columns));
        };
        let mut first = self.phase;
        while first > run.start.max(self.phase.saturating_sub(MOST_SWITCHES)) && time - starts[first] < switch
        {
            first -= 1;
            neighbour(first, true);
        }
        let mut last = self.phase;
        while last + 1 < run.end.min(self.phase + MOST_SWITCHES) && starts[last + 1] - time < switch {
            last += 1;
            neighbour(last, false);
        }
        // At a stop the tool may be at rest, or may already start the next run.
        let at_start = time - starts[run.start] < switch;
        let at_end = starts[run.end - 1] + phases.duration[run.end - 1] - time < switch;
        if at_start && run.start > 0 {
            neighbour(run.start - 1, true);
        }
        if at_end && run.end < phases.len() {
            neighbour(run.end, false);
        }
        if at_start || at_end {
            include(Rounded { value: [0.0; M], rounding: [0.0; M] });
        }
        range
    }
}
