//! Jerk of joints that are not the path's axes, and how far their accelerations jump where phases meet.
//!
//! With g the slope of the way along the path by u: g u̇ = v, g ü = a − g' u̇², g u⃛ = j − 3 g' u̇ ü − g'' u̇³, and a joint's jerk
//! is q' u⃛ + 3 q'' u̇ ü + q''' u̇³. How far the derivatives of q and g may be wrong is allowed for.

use rayon::prelude::*;

use super::path::{Bends, Piece, Work};
use super::phase_motion::ROUNDING;
use super::plan::JointAudit;
use crate::curve::Curves;
use crate::peak::peak;
use crate::phase_by_length::PhaseByLength;
use crate::phases::{is_by_length, PATH_JERK};
use crate::speed_by_length::Pace;
use crate::vectors::length;
use crate::{Check, Seen, Tally, PASS_EXCESS};

/// Steps of a phase that covers its whole piece, for each degree, and at least.
const STEPS: f64 = 4.0;
const LEAST: usize = 2;

/// Joints that leave a joint at a smaller angle than this, in rad, pass without a corner.
const SMOOTH: f64 = 1e-6;

/// Shares of the limits of acceleration and jerk that a place uses.
type Use<const M: usize> = [[f64; M]; 2];

/// A rate of each joint, and how wrong it may be.
type Rate<const M: usize> = ([f64; M], [f64; M]);

/// Acceleration and jerk of the joints at a pace.
struct Rates<const M: usize> {
    direction: [f64; M],
    acceleration: Rate<M>,
    jerk: Rate<M>,
}

fn rates<const M: usize>(piece: &Piece<M>, u: f64, pace: impl Fn(f64) -> Pace, work: &mut Work) -> Rates<M> {
    let Bends { joints: [(q1, e1), (q2, e2), (q3, e3)], way } = piece.bends(u, work);
    let [(g, _), (dg, dg_error), (ddg, ddg_error)] = way;
    let Pace { v, a, j } = pace(g);
    let du = v / g;
    let ddu = (a - dg * du * du) / g;
    let ddu_error = dg_error * du * du / g;
    let dddu = (j - du * (3.0 * dg * ddu + ddg * du * du)) / g;
    let dddu_error = du * (3.0 * (dg_error * ddu.abs() + dg.abs() * ddu_error) + ddg_error * du * du) / g;
    let (mut acceleration, mut jerk) = (([0.0; M], [0.0; M]), ([0.0; M], [0.0; M]));
    for k in 0..piece.joints() {
        let (q1, q2, q3, e1, e2, e3) = (q1[k], q2[k], q3[k], e1[k], e2[k], e3[k]);
        acceleration.0[k] = q1 * ddu + q2 * du * du;
        acceleration.1[k] = e1 * ddu.abs()
            + q1.abs() * ddu_error
            + e2 * du * du
            + ROUNDING * ((q1 * ddu).abs() + q2.abs() * du * du);
        jerk.0[k] = q1 * dddu + du * (3.0 * q2 * ddu + q3 * du * du);
        let bent = 3.0 * (e2 * ddu.abs() + q2.abs() * ddu_error) + e3 * du * du;
        let size = (q1 * dddu).abs() + du * (3.0 * (q2 * ddu).abs() + q3.abs() * du * du);
        jerk.1[k] = e1 * dddu.abs() + q1.abs() * dddu_error + du * bent + ROUNDING * size;
    }
    let size = length(&q1);
    Rates { direction: q1.map(|slope| slope / size), acceleration, jerk }
}

/// The jerk on phases whose numbers are `good`, and the jumps of the acceleration where they begin.
pub fn audit_jerk<const M: usize>(audit: &JointAudit<M>, good: &[bool], seen: Seen) -> Tally<M> {
    (0..audit.phases.len())
        .into_par_iter()
        .filter(|&phase| good[phase])
        .map_init(
            || (audit.path.work(), Curves::new(audit.path.path.pieces)),
            |(work, curves), phase| {
                let mut tally = Tally::default();
                let number = audit.phases.piece[phase] as usize;
                let piece = audit.path.piece_on(number, curves.get(number).clone());
                audit.jerks(phase, &piece, work, &mut tally);
                audit.alone(phase, piece.line, &mut tally);
                if phase > 0 && good[phase - 1] && !audit.is_first(phase) {
                    audit.jumps(phase, &piece, work, &mut tally);
                }
                seen(1);
                tally
            },
        )
        .reduce(Tally::default, Tally::merge)
}

impl<const M: usize> JointAudit<'_, M> {
    /// The jerk at even steps of a phase.
    fn jerks(&self, phase: usize, piece: &Piece<M>, work: &mut Work, tally: &mut Tally<M>) {
        let (phases, joints, start) = (&self.phases, self.path.joints, self.starts[phase]);
        let is_silent = !is_by_length(phases.kind[phase]);
        for k in 0..joints {
            let limit = self.limits.jerk[k];
            // Nothing limits the jerk on phases of other kinds.
            let unlimited = is_silent && limit.is_finite();
            let value = if unlimited { f64::INFINITY } else { 0.0 };
            tally.offer(Check::Jerk, k, value, limit, start, piece.line);
        }
        if is_silent {
            return;
        }
        let (u0, u1) = (phases.u0[phase], phases.u1[phase]);
        let covered = STEPS * piece.curve.turns() as f64 * (u1 - u0) / piece.width;
        let steps = (covered.ceil() as usize).max(LEAST);
        let share = |i: usize| i as f64 / steps as f64;
        let u: Vec<f64> = (0..=steps).map(|i| u0 * (1.0 - share(i)) + u1 * share(i)).collect();
        let Some(motion) = piece.by_length(phases, phase) else { return };
        let mut look = |u: f64, tally: &mut Tally<M>| self.look(piece, &motion, u, start, work, tally);
        let used: Vec<Use<M>> = u.iter().map(|&u| look(u, tally)).collect();
        for i in 1..steps {
            for (row, check) in [Check::Acceleration, Check::Jerk].into_iter().enumerate() {
                for k in 0..joints {
                    let uses = [i - 1, i, i + 1].map(|i| used[i][row][k]);
                    if let Some(x) = peak(uses, tally.get(check, k).ratio) {
                        look(u[i] + 0.5 * x * (u[i + 1] - u[i - 1]), tally);
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
        u: f64,
        start: f64,
        work: &mut Work,
        tally: &mut Tally<M>,
    ) -> Use<M> {
        let (limits, place) = (&self.limits, motion.place(u));
        let time = || start + motion.since(&place);
        let Rates { acceleration, jerk, .. } = rates(piece, u, |_| place.pace, work);
        tally.samples += 1;
        let mut used = [[0.0; M]; 2];
        for k in 0..self.path.joints {
            let strongest = limits.acceleration.of(k, acceleration.0[k]);
            let of = [(Check::Acceleration, &acceleration, strongest), (Check::Jerk, &jerk, limits.jerk[k])];
            for (row, (check, rate, limit)) in of.into_iter().enumerate() {
                let value = rate.0[k].abs() - rate.1[k];
                used[row][k] = value.max(0.0).copysign(rate.0[k]) / limit;
                tally.offer_at(check, k, value, limit, piece.line, time);
            }
        }
        used
    }

    /// A change of the acceleration along the path over a time that means nothing to any joint: in that time, or in a servo
    /// period if that is longer, it adds no more than the pass mark to the jerk.
    fn negligible_pull(&self, time: f64) -> f64 {
        let least = self.limits.jerk[..self.path.joints].iter().copied().fold(f64::INFINITY, f64::min);
        PASS_EXCESS * least * time.max(self.limits.period)
    }

    /// The recorded accelerations of a phase against its jerk, and at rest against 0.
    fn alone(&self, phase: usize, line: i32, tally: &mut Tally<M>) {
        let (phases, time) = (&self.phases, self.starts[phase]);
        let (a0, a1) = (phases.a0[phase], phases.a1[phase]);
        let change = phases.value[phase] * phases.duration[phase];
        let mut off = (a1 - a0 - change).abs() - ROUNDING * (a0.abs() + a1.abs() + change.abs());
        if phases.kind[phase] != PATH_JERK {
            off = 0.0;
        }
        let [start_speed, end_speed] = self.limits.end_speeds;
        let begins = self.is_first(phase) && !(phase == 0 && start_speed > 0.0);
        let ends = self.is_first(phase + 1) && !(phase + 1 == phases.len() && end_speed > 0.0);
        let rests = [(begins, a0), (ends, a1)].map(|(here, a)| if here { a.abs() } else { 0.0 });
        // An error that builds up over the phase is that much jerk.
        let slack = [self.negligible_pull(phases.duration[phase]), self.negligible_pull(0.0)];
        for (value, slack) in [(off, slack[0]), (rests[0], slack[1]), (rests[1], slack[1])] {
            tally.offer(Check::AccelerationContinuity, 0, value, slack, time, line);
        }
    }

    /// From the phase before: no jump along the path, and of a joint only where the curvature jumps. At rest between two
    /// pieces no joint's acceleration jumps: it goes on where the path turns back along the line that it came on.
    fn jumps(&self, phase: usize, piece: &Piece<M>, work: &mut Work, tally: &mut Tally<M>) {
        let phases = &self.phases;
        if !is_by_length(phases.kind[phase]) || !is_by_length(phases.kind[phase - 1]) {
            return;
        }
        let (time, line) = (self.starts[phase], piece.line);
        let (from, to) = (phases.a1[phase - 1], phases.a0[phase]);
        let number = phases.piece[phase - 1] as usize;
        let rests = number != piece.number && phases.p1[phase - 1] == 0.0 && phases.p0[phase] == 0.0;
        if !rests {
            let off = (to - from).abs() - ROUNDING * (to.abs() + from.abs());
            tally.offer(Check::AccelerationContinuity, 0, off, self.negligible_pull(0.0), time, line);
        }
        if number == piece.number || rests && from == 0.0 && to == 0.0 {
            return;
        }
        let before: Piece<M> = self.path.piece(number);
        let pace = |p: f64, a: f64| move |g: f64| Pace { v: g * p.sqrt(), a, j: 0.0 };
        let into = rates(&before, phases.u1[phase - 1], pace(phases.p1[phase - 1], from), work);
        let out = rates(piece, phases.u0[phase], pace(phases.p0[phase], to), work);
        let turn = length::<M>(&std::array::from_fn(|k| out.direction[k] - into.direction[k]));
        for k in 0..self.path.joints {
            let doubt = into.acceleration.1[k] + out.acceleration.1[k];
            let step = (out.acceleration.0[k] - into.acceleration.0[k]).abs() - doubt;
            if rests {
                let negligible = PASS_EXCESS * self.limits.jerk[k] * self.limits.period;
                tally.offer(Check::AccelerationContinuity, 0, step, negligible, time, line);
                continue;
            }
            let step = if turn <= SMOOTH { step } else { 0.0 };
            // Of a step over the period a third difference of setpoints shows at most three quarters as a jerk.
            let limit = self.limits.jerk[k] * self.limits.period / 0.75;
            tally.offer(Check::AccelerationJump, k, step, limit, time, line);
        }
    }
}
