//! Velocities of the joints at places of a phase and the times between them, from the law of the phase and the positions of the
//! joints there.
//!
//! On a phase of constant acceleration of joint k: v_k² = v_k(slower end)² + 2 a Δq_k, u̇ = |v_k| / |dq_k/du|, and a way Δq_k
//! takes the time 2 Δq_k over the sum of the speeds at its ends. Where a joint has a constant speed, the time is its way over that
//! speed; where p is linear in u, Δu over the mean √p; at the feed, ∫ |C'| du over the speed, by Kronrod's rule; where jerk is
//! limited, speed and time follow from the length of the way of the tool.

use super::path::{Piece, Place};
use crate::phase_by_length::PhaseByLength;
use crate::phase_time::MOST_HALVINGS;
use crate::phases::{Phases, AXIS_ACCELERATION, AXIS_VELOCITY, FEED, PARAMETER_ACCELERATION};
use crate::speed_by_length::integral;
use crate::{EPS, ROUNDINGS};

/// Relative rounding of a speed or time after a few operations.
pub const ROUNDING: f64 = 2.0 * ROUNDINGS * EPS;

/// Where a greater part of a speed is uncertain, it is taken from the recorded p at the ends of the phase.
const HIDDEN: f64 = 1e-3;

/// The motion at a place of a phase.
#[derive(Clone, Copy, Debug)]
pub struct State<const M: usize> {
    /// Way of the joints from the start of the phase.
    pub way: [f64; M],
    pub root_p: f64,
    /// Relative error of √p.
    relative: f64,
    /// Speed of the joint that governs the phase, and a bound of its error.
    speed: f64,
    speed_error: f64,
    pub velocity: [f64; M],
    pub velocity_error: [f64; M],
    /// Time from the place before, and its relative error.
    pub time: f64,
    pub time_error: f64,
}

/// States at places with their ways alone, all speeds and times 0.
fn at_rest<const M: usize>(piece: &Piece<M>, places: &[Place<M>]) -> Vec<State<M>> {
    let mut states = vec![State::STILL; places.len()];
    for i in 1..states.len() {
        let step = piece.between(&places[i - 1].position, &places[i].position, None);
        states[i].way = std::array::from_fn(|k| states[i - 1].way[k] + step[k]);
    }
    states
}

/// The joints at places of a phase whose speed is known by the length of the way.
pub fn motion_by_length<const M: usize>(
    piece: &Piece<M>,
    motion: &PhaseByLength<M>,
    places: &[Place<M>],
) -> Vec<State<M>> {
    let mut states = at_rest(piece, places);
    let mut before = 0.0;
    for (i, (state, place)) in states.iter_mut().zip(places).enumerate() {
        let here = motion.place(place.u);
        state.root_p = here.pace.v / place.way_slope;
        for k in 0..M {
            state.velocity[k] = place.slope[k] * state.root_p;
            let rounding =
                if state.velocity[k] == 0.0 { 0.0 } else { 2.0 * ROUNDING * state.velocity[k].abs() };
            state.velocity_error[k] = place.slope_error[k] * state.root_p + rounding;
        }
        let since = motion.since(&here);
        if i > 0 && place.u != places[i - 1].u {
            state.time = since - before;
            // Both times since the start are rounded.
            state.time_error = if state.time > 0.0 {
                ROUNDING * (1.0 + since.abs().max(before.abs()) / state.time)
            } else {
                ROUNDING * (1.0 + piece.width / (place.u - places[i - 1].u))
            };
        }
        before = since;
    }
    states
}

/// The joints on a phase, whose numbers must be good and whose speed is not known by the length, at places from end to end; the
/// first `timed` steps have times.
pub fn motion<const M: usize>(
    piece: &Piece<M>,
    phases: &Phases,
    phase: usize,
    places: &[Place<M>],
    timed: usize,
) -> Vec<State<M>> {
    let (kind, value, last) = (phases.kind[phase], phases.value[phase], places.len() - 1);
    let p = [phases.p0[phase], phases.p1[phase]];
    let own = Some(phases.axis[phase] as usize).filter(|&axis| axis < piece.joints()).unwrap_or(0);
    let mut states = at_rest(piece, places);
    let own_slope = |i: usize| places[i].slope[own].abs();
    let unknown = places.iter().map(|place| place.unknown[own]).fold(0.0, f64::max);
    // The speed of the joint that governs the phase, from the end where that is slower.
    let ends = [own_slope(0).powi(2) * p[0], own_slope(last).powi(2) * p[1]];
    let from_end = !ends[0].is_finite() || ends[1] < ends[0];
    let (slower, slower_p) = if from_end { (last, p[1]) } else { (0, p[0]) };
    let start_sq = ends[usize::from(from_end)];
    let accelerates = kind == AXIS_ACCELERATION;
    let governs = accelerates || kind == AXIS_VELOCITY;
    let slower_way = states[slower].way[own];
    let sq_error = if accelerates {
        4.0 * value.abs() * unknown
            + 2.0 * start_sq.sqrt() * places[slower].slope_error[own] * slower_p.sqrt()
    } else {
        0.0
    };
    let (u0, u1) = (places[0].u, places[last].u);
    let feed_sq = [places[0].feed_slope.powi(2) * p[0], places[last].feed_slope.powi(2) * p[1]];
    let line = |u: f64| (feed_sq[0] + (feed_sq[1] - feed_sq[0]) * ((u - u0) / (u1 - u0))).sqrt();
    let (p_slow, u_slow) = if p[0] <= p[1] { (p[0], u0) } else { (p[1], u1) };
    for (i, (state, place)) in states.iter_mut().zip(places).enumerate() {
        let is_start = i == slower;
        let mut speed_sq = value;
        if accelerates {
            speed_sq = start_sq + 2.0 * value * (state.way[own] - slower_way);
        }
        if speed_sq < 0.0 && speed_sq >= -sq_error {
            speed_sq = 0.0;
        }
        let speed = speed_sq.sqrt();
        let hidden = if sq_error > 0.0 { sq_error / (speed + sq_error.sqrt()) } else { 0.0 };
        (state.speed, state.speed_error) = (speed, hidden + ROUNDING * speed);
        let slope = own_slope(i);
        let (mut root_p, mut relative) = match kind {
            AXIS_ACCELERATION if is_start => (slower_p.sqrt(), ROUNDING),
            AXIS_ACCELERATION | AXIS_VELOCITY => {
                (speed / slope, state.speed_error / speed + place.slope_error[own] / slope)
            }
            PARAMETER_ACCELERATION => ((p_slow + 2.0 * value * (place.u - u_slow)).sqrt(), ROUNDING),
            FEED => (value.sqrt() / place.feed_slope, ROUNDING),
            _ => (line(place.u) / place.feed_slope, ROUNDING),
        };
        // Where rounding hides the motion of that joint, p is nearly constant: it is taken from the recorded ends.
        let known = 0.5 * (p[1] - p[0]).abs() / p[0].max(p[1]) + ROUNDING;
        let is_known = relative <= HIDDEN;
        if !is_known && known < HIDDEN {
            root_p = (p[0] + (p[1] - p[0]) * ((place.u - u0) / (u1 - u0))).sqrt();
            relative = known;
        }
        (state.root_p, state.relative) = (root_p, relative);
        for k in 0..M {
            let velocity = place.slope[k] * root_p;
            let mut error = place.slope_error[k] * root_p;
            if velocity != 0.0 {
                error += velocity.abs() * (relative + ROUNDING);
            }
            (state.velocity[k], state.velocity_error[k]) = (velocity, error);
        }
        if governs && !is_start {
            state.velocity[own] = sign(place.slope[own]) * speed;
            state.velocity_error[own] = state.speed_error;
        }
    }
    let feed_line = |u: f64| piece.feed_slope(u) / line(u);
    let feed_rate = |u: f64| piece.feed_slope(u) / value.sqrt();
    for i in 1..=timed {
        let (a, b) = (&states[i - 1], &states[i]);
        let (from, to) = (places[i - 1].u, places[i].u);
        let step = to - from;
        if step == 0.0 {
            continue;
        }
        let rounding = ROUNDING * (1.0 + piece.width / step);
        let (time, error) = match kind {
            PARAMETER_ACCELERATION => (2.0 * step / (a.root_p + b.root_p), rounding),
            FEED => (integral(&feed_rate, from, to, &mut { MOST_HALVINGS }), rounding),
            _ if !governs => (integral(&feed_line, from, to, &mut { MOST_HALVINGS }), rounding),
            _ => {
                let way = (b.way[own] - a.way[own]).abs();
                by_joint([a, b], step, way, unknown, accelerates.then_some(value.abs()), rounding)
            }
        };
        (states[i].time, states[i].time_error) = (time, error);
    }
    states
}

impl<const M: usize> State<M> {
    const STILL: Self = State {
        way: [0.0; M],
        root_p: 0.0,
        relative: 0.0,
        speed: 0.0,
        speed_error: 0.0,
        velocity: [0.0; M],
        velocity_error: [0.0; M],
        time: 0.0,
        time_error: 0.0,
    };
}

fn sign(x: f64) -> f64 {
    if x == 0.0 {
        0.0
    } else {
        x.signum()
    }
}

/// The time of a step by the way of the joint that governs the phase, which may have a constant acceleration, and its relative
/// error.
fn by_joint<const M: usize>(
    [a, b]: [&State<M>; 2],
    step: f64,
    way: f64,
    unknown: f64,
    acceleration: Option<f64>,
    rounding: f64,
) -> (f64, f64) {
    let (both, errors) = (a.speed + b.speed, a.speed_error + b.speed_error);
    let (mut time, mut error) = (2.0 * way / both, 2.0 * unknown / way + errors / both);
    // The change of the speed over the acceleration, where that has the smaller error.
    if let Some(acceleration) = acceleration {
        let by_change = (b.speed - a.speed).abs() / acceleration;
        let change_error = errors / acceleration / by_change;
        if change_error < error {
            (time, error) = (by_change, change_error);
        }
    }
    // On phases whose ways are all rounding, the step of the parameter over the mean √p.
    let sides = a.root_p + b.root_p;
    let place_error = rounding + (b.root_p - a.root_p).abs() / sides + 0.5 * (a.relative + b.relative);
    let is_known = error <= HIDDEN;
    let is_better = place_error >= error;
    if !is_known && !is_better {
        (time, error) = (2.0 * step / sides, place_error);
    }
    (time, error)
}
