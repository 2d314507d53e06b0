//! Audits a profile whose limits belong to joints that are not the path's axes.
//!
//! Every phase is sampled at some ten places, or where its speed is known by the length at as many as its piece needs. Between
//! two of them the mean acceleration of a joint is the difference of its velocities over the time, less what their errors can add.

use rayon::prelude::*;

use super::path::{Piece, Place, Work, TURN};
use super::phase_motion::{motion, motion_by_length, State, ROUNDING};
use super::plan::JointAudit;
use crate::chord::chord_error;
use crate::curve::Curves;
use crate::phase_jerk::Jerks;
use crate::phase_order::PhaseOrder;
use crate::phases::{self, Phases};
use crate::station::Station;
use crate::vectors::length;
use crate::{Check, Seen, Tally, Worst, EPS, GAP_TOLERANCE, PASS_EXCESS, ROUNDINGS};

/// Places of a phase, as shares of the variable in which √p is linear where p is linear in u: closer at the ends, where
/// accelerations have their extremes.
const PLACES: [f64; 11] = [0.0, 1.0 / 64.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 63.0 / 64.0, 1.0];

/// Where the speed is known by the length: steps for each degree of a phase that covers its whole piece, and the least number.
const STEPS: f64 = 4.0;
const LEAST: usize = 2;

/// Phases that are measured before they are joined, in some 30 MB, and phases that a thread takes at a time.
const CHUNK: usize = 2048;
const BLOCK: usize = 256;

/// Joints that leave a joint at a smaller angle than this, in rad, pass without a corner.
const SMOOTH: f64 = 1e-6;

/// A phase at its places.
struct Measured<'a, const M: usize> {
    phase: usize,
    piece: Piece<'a, M>,
    places: Vec<Place<M>>,
    states: Vec<State<M>>,
}

impl<const M: usize> Measured<'_, M> {
    /// Places and states at both ends.
    fn ends(&self) -> [(&Place<M>, &State<M>); 2] {
        let last = self.places.len() - 1;
        [0, last].map(|i| (&self.places[i], &self.states[i]))
    }
}

/// What the end of a phase passes on to the next one.
struct End<'a, const M: usize> {
    phase: usize,
    piece: Piece<'a, M>,
    velocity: [f64; M],
    doubt: [f64; M],
    speed: f64,
}

/// Positions so far, angles continuous.
struct Reach<const M: usize> {
    /// Least and greatest, with time and source line.
    ends: [[(f64, f64, i32); 2]; M],
    /// Piece and positions at the end of the last phase: by the kinematics, and continuous.
    last: Option<(usize, [f64; M], [f64; M])>,
    /// Whole turns from the continuous angle to the joint's own, in degrees; not a number while no piece has told them.
    turns: [f64; M],
}

/// Velocity, acceleration and jumps of the joints, feed, chord error, times and order of the phases; where the limits say so
/// the jerk of the joints too, and the jumps of their accelerations.
pub(crate) fn audit_joint_profile<const M: usize>(audit: &JointAudit<M>, seen: Seen) -> Tally<M> {
    let mut tally = Tally::default();
    let good = order(audit, &mut tally);
    let phases: Vec<usize> = (0..audit.phases.len()).filter(|&phase| good[phase]).collect();
    let nowhere = [(f64::NAN, 0.0, 0); 2];
    let mut reach = Reach { ends: [nowhere; M], last: None, turns: [f64::NAN; M] };
    let mut before: Option<End<M>> = None;
    for chunk in phases.chunks(CHUNK) {
        let measured: Vec<(Vec<Measured<M>>, Tally<M>)> = chunk
            .par_chunks(BLOCK)
            .map(|phases| {
                let mut tally = Tally::default();
                let mut measurer = Measurer::new(audit);
                let measured = phases.iter().map(|&phase| {
                    let own = measurer.measure(phase, phase > 0 && good[phase - 1], &mut tally);
                    audit.phase(&own, &mut tally);
                    own
                });
                (measured.collect(), tally)
            })
            .collect();
        for (block, found) in measured {
            tally = tally.merge(found);
            for own in block {
                audit.follow(&mut reach, &own);
                before = Some(audit.joint(before, own, &mut tally));
            }
        }
        seen(chunk.len());
    }
    audit.travel(&reach, &mut tally);
    tally
}

/// Measures phases one after the other.
struct Measurer<'a, const M: usize> {
    audit: &'a JointAudit<'a, M>,
    work: Work,
    curves: Curves<'a, M>,
    /// The place at the end of the last phase, on its piece.
    last: Option<(usize, Place<M>, Station<M>)>,
}

impl<'a, const M: usize> Measurer<'a, M> {
    fn new(audit: &'a JointAudit<'a, M>) -> Self {
        Self { audit, work: audit.path.work(), curves: Curves::new(audit.path.path.pieces), last: None }
    }

    /// Offers the jerk, where that is judged; `follows` if the phase before can be measured too.
    fn measure(&mut self, phase: usize, follows: bool, tally: &mut Tally<M>) -> Measured<'a, M> {
        let Self { audit, work, .. } = self;
        let (audit, phases) = (*audit, &audit.phases);
        let number = phases.piece[phase] as usize;
        let piece: Piece<M> = audit.path.piece_on(number, self.curves.get(number).clone());
        let by_length = piece.by_length(phases, phase);
        let judges_jerk = audit.limits.judges_jerk;
        if judges_jerk {
            audit.accelerations(phase, &piece, follows, by_length.is_some(), work, tally);
        }
        let Some(motion) = by_length else {
            let places = PLACES.map(|x| piece.place(u_at(phases, phase, x), work)).to_vec();
            let states = motion(&piece, phases, phase, &places, places.len() - 1);
            return Measured { phase, piece, places, states };
        };
        let (u0, u1) = (phases.u0[phase], phases.u1[phase]);
        let covered = STEPS * piece.curve.turns() as f64 * (u1 - u0) / piece.width;
        let steps = (covered.ceil() as usize).max(LEAST);
        let (mut places, mut stations) = (Vec::with_capacity(steps + 1), Vec::with_capacity(steps + 1));
        for i in 0..=steps {
            let share = i as f64 / steps as f64;
            let u = u0 * (1.0 - share) + u1 * share;
            let known = self.last.filter(|(last, place, _)| *last == number && place.u == u);
            let (place, station) =
                known.map_or_else(|| piece.station(u, work), |(_, place, station)| (place, station));
            places.push(place);
            stations.push(station);
        }
        self.last = Some((number, places[steps], stations[steps]));
        if judges_jerk {
            audit.jerks(&piece, &motion, &stations, audit.starts[phase], work, tally);
        }
        let states = motion_by_length(&piece, &motion, &places);
        Measured { phase, piece, places, states }
    }
}

/// u at a place of a phase, by the variable in which √p is linear where p is.
fn u_at(phases: &Phases, phase: usize, x: f64) -> f64 {
    let (u0, u1) = (phases.u0[phase], phases.u1[phase]);
    let (near, both) = match (phases.p0[phase].sqrt(), phases.p0[phase].sqrt() + phases.p1[phase].sqrt()) {
        (near, both) if both > 0.0 => (near, both),
        _ => (1.0, 2.0),
    };
    let share = x * (2.0 * near + (both - 2.0 * near) * x) / both;
    if x == 1.0 {
        u1
    } else {
        u0 + (u1 - u0) * share.min(1.0)
    }
}

/// Offers wrong numbers and phases that do not cover the pieces in order; which phases can be measured.
fn order<const M: usize>(audit: &JointAudit<M>, tally: &mut Tally<M>) -> Vec<bool> {
    let (path, phases, starts) = (&audit.path.path, &audit.phases, audit.starts);
    PhaseOrder { path, phases, starts, axes: audit.path.joints }.audit(tally);
    let wrong = |good: bool| if good { 0.0 } else { f64::INFINITY };
    let measurable = |phase: usize| {
        let (piece, u0, u1) = (phases.piece[phase] as usize, phases.u0[phase], phases.u1[phase]);
        let line = path.line.get(piece).copied().unwrap_or(0);
        let has_numbers = phases.has_good_numbers(phase, audit.path.joints);
        tally.offer(Check::Numbers, 0, wrong(has_numbers), 0.0, starts[phase], line);
        let is_inside =
            has_numbers && u1 > u0 && u0 >= 0.0 && u1 <= path.width[piece] * (1.0 + ROUNDINGS * EPS);
        let off = wrong(is_inside || !has_numbers);
        tally.offer(Check::Order, 0, off, GAP_TOLERANCE, starts[phase], line);
        is_inside
    };
    (0..phases.len()).map(measurable).collect()
}

impl<const M: usize> JointAudit<'_, M> {
    /// What a method that limits jerk says of the acceleration along the way, and its jump from the phase before, if that `follows`.
    fn accelerations(
        &self,
        phase: usize,
        piece: &Piece<M>,
        follows: bool,
        is_by_length: bool,
        work: &mut Work,
        tally: &mut Tally<M>,
    ) {
        let (phases, line) = (&self.phases, piece.line);
        let jerks = Jerks { phases, limits: &self.limits, starts: self.starts, smooth: SMOOTH };
        let width_rounding = EPS * piece.width / (phases.u1[phase] - phases.u0[phase]);
        jerks.alone(phase, width_rounding, is_by_length, line, tally);
        let [start_speed, end_speed] = self.limits.end_speeds;
        let begins = self.is_first(phase);
        if begins && !(phase == 0 && start_speed > 0.0) {
            jerks.rest(phase, false, line, tally);
        }
        if self.is_first(phase + 1) && !(phase + 1 == phases.len() && end_speed > 0.0) {
            jerks.rest(phase, true, line, tally);
        }
        if follows && !begins && is_by_length && phases::is_by_length(phases.kind[phase - 1]) {
            let station = |number: usize, u: f64| {
                let (_, station) = match number == piece.number {
                    true => piece.station(u, work),
                    false => self.path.piece::<M>(number).station(u, work),
                };
                Some(station)
            };
            jerks.joint([phase - 1, phase], station, line, tally);
        }
    }

    /// A jump of a joint's velocity that is negligible: over that time it adds no more than the pass mark to the acceleration.
    fn negligible(&self, joint: usize, time: f64) -> f64 {
        PASS_EXCESS * self.limits.acceleration.least(joint) * time.max(self.limits.period)
    }

    /// Offers what a phase shows by itself.
    fn phase(&self, own: &Measured<M>, tally: &mut Tally<M>) {
        let Measured { phase, piece, places, states } = own;
        let phase = *phase;
        let (limits, line, joints) = (&self.limits, piece.line, self.path.joints);
        tally.samples += states.len() as u64;
        let mut clock = self.starts[phase];
        let size = places.iter().flat_map(|place| place.position).map(f64::abs).fold(0.0, f64::max);
        for (i, (state, place)) in states.iter().zip(places).enumerate() {
            if i > 0 {
                let before = &states[i - 1];
                let middle = 0.5 * (clock + (clock + state.time));
                clock += state.time;
                for k in 0..joints {
                    let change = state.velocity[k] - before.velocity[k];
                    let moved = state.way[k] - before.way[k];
                    let (mut acceleration, mut mean) = (0.0, 0.0);
                    // Two places may be the same after rounding.
                    if place.u != places[i - 1].u {
                        let doubt = state.velocity_error[k] + before.velocity_error[k];
                        acceleration = (change.abs() - doubt) / state.time;
                        acceleration -= acceleration.abs() * state.time_error;
                        mean = moved.abs() / state.time;
                        mean -= 2.0 * ROUNDING * size / state.time + mean * state.time_error;
                    }
                    let strongest = limits.acceleration.of(k, change);
                    tally.offer(Check::Velocity, k, mean, limits.velocity.of(k, moved), middle, line);
                    tally.offer(Check::Acceleration, k, acceleration, strongest, middle, line);
                }
            }
            for k in 0..joints {
                let speed = state.velocity[k].abs() - state.velocity_error[k];
                let limit = limits.velocity.of(k, state.velocity[k]);
                tally.offer(Check::Velocity, k, speed, limit, clock, line);
            }
            self.tip(piece, place, state, clock, tally);
        }
        let total: f64 = states.iter().map(|state| state.time).sum();
        let doubt = states.iter().map(|state| state.time * state.time_error).sum::<f64>() / total;
        let error = (self.phases.duration[phase] - total).abs() / total - doubt;
        tally.offer(Check::Duration, 0, error, PASS_EXCESS, self.starts[phase], line);
        self.ends(own, tally);
    }

    /// Feed and chord error of the tip.
    fn tip(&self, piece: &Piece<M>, place: &Place<M>, state: &State<M>, clock: f64, tally: &mut Tally<M>) {
        let share = length(&state.velocity_error) / length(&state.velocity);
        let share = if share.is_finite() { share } else { 0.0 };
        let speed = place.feed_slope * state.root_p * (1.0 - share - ROUNDING);
        tally.offer(Check::Feed, 0, speed, self.path.feed[piece.number], clock, piece.line);
        let tolerance = self.limits.chord_tolerance;
        if !tolerance.is_finite() {
            return;
        }
        let is_linear = piece.linear().iter().any(|&counts| counts != 0.0);
        let curvature = if is_linear { piece.curvature(place.u) } else { 0.0 };
        let error = chord_error(speed * self.limits.period, curvature);
        tally.offer(Check::Chord, 0, error, tolerance, clock, piece.line);
    }

    /// Velocities at both ends by the recorded p, with bounds of their errors, and the speeds of the tip.
    fn recorded(&self, own: &Measured<M>) -> [([f64; M], [f64; M], f64); 2] {
        let [(first, _), (last, _)] = own.ends();
        [(first, self.phases.p0[own.phase]), (last, self.phases.p1[own.phase])].map(|(place, p)| {
            let root = p.sqrt();
            let velocity = place.slope.map(|slope| slope * root);
            let doubt = std::array::from_fn(|k| place.slope_error[k] * root + ROUNDING * velocity[k].abs());
            (velocity, doubt, place.feed_slope * root)
        })
    }

    /// Offers the recorded p at both ends against that of the law, as a jump of velocities.
    fn ends(&self, own: &Measured<M>, tally: &mut Tally<M>) {
        let (phase, duration) = (own.phase, self.phases.duration[own.phase]);
        let roots = [self.phases.p0[phase].sqrt(), self.phases.p1[phase].sqrt()];
        for (side, (velocity, doubt, _)) in self.recorded(own).iter().enumerate() {
            let (_, state) = own.ends()[side];
            let time = self.starts[phase] + side as f64 * duration;
            for k in 0..self.path.joints {
                let mut away = (state.velocity[k] - velocity[k]).abs() - doubt[k] - state.velocity_error[k];
                // Where the joint that governs the phase stands, the law tells no other joint's velocity: p is the recorded one.
                if roots[side] == state.root_p {
                    away = 0.0;
                }
                tally.offer(Check::Jump, k, away, self.negligible(k, duration), time, own.piece.line);
            }
        }
    }

    /// Offers the jumps of velocities and of the tip's speed from the phase before; what this phase passes on.
    fn joint<'a>(
        &self,
        before: Option<End<'a, M>>,
        own: Measured<'a, M>,
        tally: &mut Tally<M>,
    ) -> End<'a, M> {
        let [(velocity, doubt, speed), (end_velocity, end_doubt, end_speed)] = self.recorded(&own);
        let slack = self.slow(self.phases.duration[own.phase], &own.places[0]);
        let Measured { phase, piece, .. } = own;
        let (duration, line, start) = (self.phases.duration[phase], piece.line, self.starts[phase]);
        let joined = before.filter(|before| before.phase + 1 == phase && !self.is_first(phase));
        let corner = joined.as_ref().is_some_and(|before| before.piece.number != piece.number);
        for k in 0..self.path.joints {
            let jump = joined
                .as_ref()
                .map_or(0.0, |before| (velocity[k] - before.velocity[k]).abs() - doubt[k] - before.doubt[k]);
            let allowed = if corner { self.limits.jump[k] } else { 0.0 };
            tally.offer(Check::Jump, k, jump, allowed + self.negligible(k, duration), start, line);
        }
        let (mut step, mut over) = (0.0, 0.0);
        if let Some(before) = joined.filter(|_| corner) {
            let rounding = ROUNDING * (speed + before.speed);
            // The speeds are of one kind only where the feed limits the same axes.
            if before.piece.counts == piece.counts {
                step = (speed - before.speed).abs() - rounding;
            }
            over = speed.max(before.speed) - rounding;
        }
        tally.offer(Check::Continuity, 0, step, slack, start, line);
        let most = self.path.junction_speed[piece.number] + slack;
        tally.offer(Check::Junction, 0, over, most, start, line);
        // Speeds at the ends of runs: at rest, but for the ends of the path.
        let last = self.phases.len() - 1;
        let wanted = [
            if phase == 0 { self.limits.end_speeds[0] } else { 0.0 },
            if phase == last { self.limits.end_speeds[1] } else { 0.0 },
        ];
        let ends = [self.is_first(phase) && phase < self.phases.len(), self.is_first(phase + 1)];
        for (side, speed) in [speed, end_speed].into_iter().enumerate() {
            let off = (speed - wanted[side]).abs();
            let off = if ends[side] { off } else { 0.0 } - ROUNDING * (speed + wanted[side]);
            tally.offer(Check::Junction, 0, off, slack, start + side as f64 * duration, line);
        }
        End { phase, piece, velocity: end_velocity, doubt: end_doubt, speed: end_speed }
    }

    /// A jump of the tip's speed that is negligible for every joint.
    fn slow(&self, duration: f64, place: &Place<M>) -> f64 {
        let mut least = f64::INFINITY;
        let mut weakest = f64::INFINITY;
        for k in 0..self.path.joints {
            let share = self.negligible(k, duration) / place.slope[k].abs() * place.feed_slope;
            if share.is_finite() {
                least = least.min(share);
            }
            weakest = weakest.min(self.limits.acceleration.least(k));
        }
        let period = PASS_EXCESS * weakest * self.limits.period;
        if least.is_finite() {
            least.max(period)
        } else {
            period
        }
    }

    /// Positions, angles continuous from phase to phase.
    fn follow(&self, reach: &mut Reach<M>, own: &Measured<M>) {
        let Measured { phase, piece, states, .. } = own;
        let [(first, _), (last, end)] = own.ends();
        let first = first.position;
        let begin: [f64; M] = match &reach.last {
            None => first,
            Some((number, position, seen)) => {
                let other = (*number != piece.number).then(|| self.path.piece(*number));
                let step = piece.between(position, &first, other.as_ref());
                std::array::from_fn(|k| seen[k] + step[k])
            }
        };
        let mut clock = self.starts[*phase];
        for k in 0..self.path.joints {
            // A piece on which the joint's angle is known tells its whole turns on all pieces.
            if !piece.turning(k) && reach.turns[k].is_nan() {
                reach.turns[k] = TURN * ((first[k] - begin[k]) / TURN).round();
            }
        }
        for state in states {
            clock += state.time;
            for k in 0..self.path.joints {
                let value = begin[k] + state.way[k];
                for (end, sign) in [(0, -1.0), (1, 1.0)] {
                    let is_no_farther = sign * value <= sign * reach.ends[k][end].0;
                    if !is_no_farther && !value.is_nan() {
                        reach.ends[k][end] = (value, clock, piece.line);
                    }
                }
            }
        }
        let seen = std::array::from_fn(|k| begin[k] + end.way[k]);
        reach.last = Some((piece.number, last.position, seen));
    }

    /// Offers the travel. An angle that is known up to whole turns on all pieces is taken on the turn that fits its travel best.
    fn travel(&self, reach: &Reach<M>, tally: &mut Tally<M>) {
        for k in 0..self.path.joints {
            let [lower, upper] = self.limits.travel[k];
            let [least, most] = reach.ends[k];
            if !((upper - lower).is_finite() && (most.0 - least.0).is_finite()) {
                continue;
            }
            let (middle, half) = (0.5 * (lower + upper), 0.5 * (upper - lower));
            let turns = match reach.turns[k] {
                turns if turns.is_nan() => TURN * ((middle - 0.5 * (least.0 + most.0)) / TURN).round(),
                turns => turns,
            };
            let is_upper = most.0 + turns - middle > middle - (least.0 + turns);
            let ((value, time, line), limit) = if is_upper { (most, upper) } else { (least, lower) };
            let value = value + turns;
            let ratio = ((value - middle).abs() - 2.0 * ROUNDING * value.abs()) / half;
            tally.offer_ratio(Check::Travel, k, Worst { value, limit, ratio, time, line });
        }
    }
}
