//! Audits the jerk of every axis along the phases, and the jumps of the acceleration where phases meet, for methods that
//! limit jerk.
//!
//! With u̇ = v/|C'| and ü = (a − T·C'' u̇²)/|C'|, T the direction, the acceleration is A = C' ü + C'' u̇² and the jerk
//! C' u⃛ + 3 C'' u̇ ü + C''' u̇³. Its part along T is j less what the turning direction takes of A: j − Ṫ·A, which tells u⃛.
//! C and its derivatives come from the control points, v, a and j from what the phase's kind makes of its columns.
//!
//! Where the path's curvature jumps A does so too, however smooth v is. A third difference of setpoints that lies half-way
//! over such a step shows 3/4 of it over the period as a jerk: with more than the limit of that alone, setpoints break it.

use super::curve::{distance, inner, length, Curve, Followed};
use super::phase_motion::PhaseMotion;
use super::phases::Phases;
use super::speed_by_length::Pace;
use super::{Check, Limits, Tally, EPS, PASS_EXCESS, ROUNDINGS};

/// Places of a phase, and those of a long one: one a servo period.
const PLACES: usize = 10;
const MOST_PLACES: usize = 1000;

/// Pieces that meet at a smaller angle than this, in rad, meet without a corner.
const SMOOTH: f64 = 1e-9;

/// The greatest part of a step of the acceleration over a period that a third difference of setpoints shows.
const MOST_SHOWN: f64 = 0.75;

/// Where |C'| is below this share of its size the piece has no direction to speak of.
const STILL: f64 = 1e-6;

/// A path and the profile on it.
#[derive(Clone, Copy)]
pub struct Jerks<'a, const M: usize> {
    pub path: &'a Followed<'a>,
    pub phases: &'a Phases<'a>,
    pub limits: &'a Limits<M>,
    pub starts: &'a [f64],
}

/// A vector, and what of it may be rounding.
struct Rounded<const M: usize> {
    value: [f64; M],
    rounding: [f64; M],
}

impl<const M: usize> Jerks<'_, M> {
    /// The jerk along phase `i`, whose numbers are good, and its recorded accelerations.
    pub fn phase(
        &self,
        i: usize,
        motion: &PhaseMotion<M>,
        curve: &Curve<M>,
        line: i32,
        tally: &mut Tally<M>,
    ) {
        let (phases, limits) = (self.phases, self.limits);
        let (start, duration) = (self.starts[i], phases.duration[i]);
        let error = phases.acceleration_error(i, motion.width_rounding());
        // An error that builds up over the phase is that much jerk.
        let negligible = self.negligible(duration);
        tally.offer(Check::AccelerationContinuity, 0, error, negligible, start, line);
        let places = PLACES + ((duration / limits.period).min((MOST_PLACES - PLACES) as f64) as usize);
        for place in 0..=places {
            let y = place as f64 / places as f64;
            let Some(pace) = motion.pace(y) else {
                // Nothing limits the jerk on a phase of another kind.
                for k in (0..limits.axes).filter(|&k| limits.jerk[k].is_finite()) {
                    tally.offer(Check::Jerk, k, f64::INFINITY, limits.jerk[k], start, line);
                }
                return;
            };
            let u = motion.parameter(y, [phases.u0[i], phases.u1[i]]);
            let Some([_, jerk]) = rates(curve, u, pace) else { continue };
            tally.samples += 1;
            let passed = motion.time_from_anchor(y);
            let time = start + if motion.anchored_at_end { duration - passed } else { passed };
            for k in 0..limits.axes {
                let value = jerk.value[k].abs() - jerk.rounding[k];
                tally.offer(Check::Jerk, k, value, limits.jerk[k], time, line);
            }
        }
    }

    /// The acceleration at the start or the end of a run at rest.
    pub fn rest(&self, i: usize, at_end: bool, line: i32, tally: &mut Tally<M>) {
        let a = self.phases.end_acceleration(i, at_end).map_or(0.0, f64::abs);
        let time = self.starts[i] + if at_end { self.phases.duration[i] } else { 0.0 };
        tally.offer(Check::AccelerationContinuity, 0, a, self.negligible(0.0), time, line);
    }

    /// The step of the acceleration from phase `i` to phase `j`, the next one in its run.
    pub fn joint(&self, i: usize, j: usize, line: i32, tally: &mut Tally<M>) {
        let (phases, time) = (self.phases, self.starts[j]);
        let (Some(before), Some(after)) =
            (phases.end_acceleration(i, true), phases.end_acceleration(j, false))
        else {
            return; // said of the phase itself
        };
        if phases.p1[i] == 0.0 && phases.p0[j] == 0.0 {
            self.at_rest([i, j], [before, after], line, tally);
            return;
        }
        let change = (after - before).abs() - ROUNDINGS * EPS * (after.abs() + before.abs());
        tally.offer(Check::AccelerationContinuity, 0, change, self.negligible(0.0), time, line);
        if let Some(step) = self.step(i, j) {
            for k in 0..self.limits.axes {
                let limit = self.limits.jerk[k] * self.limits.period / MOST_SHOWN;
                tally.offer(Check::AccelerationJump, k, step[k], limit, time, line);
            }
        }
    }

    /// The step of the acceleration where the tool rests between two phases. It goes on only where the path turns back along
    /// the line that it came on.
    fn at_rest(&self, [i, j]: [usize; 2], along: [f64; 2], line: i32, tally: &mut Tally<M>) {
        let (phases, time) = (self.phases, self.starts[j]);
        let ends = [(i, phases.u1[i]), (j, phases.u0[j])];
        let axes = [0, 1].map(|side| {
            let (phase, u) = ends[side];
            let (tangent, a) =
                (self.path.curve::<M>(phases.piece[phase] as usize).derivative(u), along[side]);
            let size = length(&tangent);
            tangent.map(|x| if a == 0.0 { 0.0 } else { x / size * a })
        });
        for k in 0..self.limits.axes {
            let step = (axes[1][k] - axes[0][k]).abs();
            let rounding = ROUNDINGS * EPS * (axes[1][k].abs() + axes[0][k].abs());
            let step = if step.is_nan() { f64::INFINITY } else { step - rounding };
            let negligible = PASS_EXCESS * self.limits.jerk[k] * self.limits.period;
            tally.offer(Check::AccelerationContinuity, 0, step, negligible, time, line);
        }
    }

    /// By how much the acceleration of each axis jumps from phase `i` to phase `j`, less what may be rounding. None within a
    /// piece, at corners, where the velocities jump, and where the path has no direction.
    fn step(&self, i: usize, j: usize) -> Option<[f64; M]> {
        let phases = self.phases;
        let pieces = [i, j].map(|phase| phases.piece[phase] as usize);
        if pieces[0] == pieces[1] {
            return None;
        }
        let curves = pieces.map(|piece| self.path.curve::<M>(piece));
        let u = [phases.u1[i], phases.u0[j]];
        let directions = [0, 1].map(|side| {
            let tangent = curves[side].derivative(u[side]);
            let size = length(&tangent);
            tangent.map(|x| x / size)
        });
        if distance(&directions[0], &directions[1]).is_nan()
            || distance(&directions[0], &directions[1]) > SMOOTH
        {
            return None;
        }
        let side = |side: usize| {
            let (phase, at_end, p) =
                if side == 0 { (i, true, phases.p1[i]) } else { (j, false, phases.p0[j]) };
            let v = length(&curves[side].derivative(u[side])) * p.sqrt();
            let pace = Pace { v, a: phases.end_acceleration(phase, at_end)?, j: 0.0 };
            rates(&curves[side], u[side], pace).map(|[acceleration, _]| acceleration)
        };
        let (before, after) = (side(0)?, side(1)?);
        Some(std::array::from_fn(|k| {
            (after.value[k] - before.value[k]).abs() - after.rounding[k] - before.rounding[k]
        }))
    }

    /// A change of the acceleration over a time that means nothing to any axis: in that time, or in a servo period if that
    /// is longer, it adds no more than the pass mark to the jerk.
    pub fn negligible(&self, time: f64) -> f64 {
        let least = self.limits.jerk[..self.limits.axes].iter().fold(f64::INFINITY, |least, &j| least.min(j));
        PASS_EXCESS * least * time.max(self.limits.period)
    }
}

/// Acceleration and jerk of every axis at a place of a piece; none where that has no direction.
fn rates<const M: usize>(curve: &Curve<M>, u: f64, pace: Pace) -> Option<[Rounded<M>; 2]> {
    let [(first, size1), (second, size2), (third, size3)] = curve.derivatives(u);
    let g = length(&first);
    if g.is_nan() || g <= STILL * length(&size1) {
        return None;
    }
    let direction = first.map(|x| x / g);
    let (along2, along3) = (inner(&direction, &second), inner(&direction, &third));
    let across: [f64; M] = std::array::from_fn(|k| second[k] - along2 * direction[k]);
    let du = pace.v / g;
    let ddu = (pace.a - along2 * du * du) / g;
    let taken = inner(&across, &across) / g * du.powi(3);
    let dddu = (pace.j - taken - du * (3.0 * along2 * ddu + along3 * du * du)) / g;
    // What is rounded in C', C'' and C''' is felt in ü and u⃛ as well.
    let [most1, most2, most3] = [&size1, &size2, &size3].map(length);
    let felt = most1 / g;
    let most_ddu = felt * (pace.a.abs() + most2 * du * du) / g;
    let most_dddu = felt
        * (pace.j.abs()
            + felt * most2 * most2 / g * du.powi(3)
            + du * (3.0 * most2 * most_ddu + most3 * du * du))
        / g;
    let acceleration = Rounded {
        value: std::array::from_fn(|k| first[k] * ddu + second[k] * du * du),
        rounding: std::array::from_fn(|k| {
            ROUNDINGS * EPS * (size1[k] * ddu.abs() + first[k].abs() * most_ddu + size2[k] * felt * du * du)
        }),
    };
    let jerk = Rounded {
        value: std::array::from_fn(|k| first[k] * dddu + du * (3.0 * second[k] * ddu + third[k] * du * du)),
        rounding: std::array::from_fn(|k| {
            let inside =
                3.0 * (size2[k] * ddu.abs() + second[k].abs() * most_ddu) + size3[k] * felt * du * du;
            ROUNDINGS * EPS * (size1[k] * dddu.abs() + first[k].abs() * most_dddu + du * inside)
        }),
    };
    Some([acceleration, jerk])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Quadratic;

    #[test]
    fn on_a_parabola_acceleration_and_jerk_are_those_of_its_parameter() {
        // C = (x, x²/2) with x = 1 + 2 t + 3 t² + 4 t³ at t = 0, where ẋ = 2, ẍ = 6, x⃛ = 24: v = √2 ẋ at x = 1.
        let curve = Curve::Quadratic(Quadratic::new(&[[0.0, 0.0], [1.0, 0.0], [2.0, 2.0]], 2.0));
        let [dx, ddx, dddx] = [2.0, 6.0, 24.0];
        let velocity: [f64; 2] = [dx, dx];
        let acceleration: [f64; 2] = [ddx, ddx + dx * dx];
        let jerk: [f64; 2] = [dddx, dddx + 3.0 * dx * ddx];
        // v² = q̇·q̇, v a = q̇·q̈, a² + v j = q̈·q̈ + q̇·q⃛.
        let v = length(&velocity);
        let a = inner(&velocity, &acceleration) / v;
        let j = (inner(&acceleration, &acceleration) + inner(&velocity, &jerk) - a * a) / v;
        let [found_a, found_j] = rates(&curve, 1.0, Pace { v, a, j }).unwrap();
        assert!(distance(&found_a.value, &acceleration) < 1e-13, "{:?}", found_a.value);
        assert!(distance(&found_j.value, &jerk) < 1e-13, "{:?}", found_j.value);
        assert!(length(&found_j.rounding) < 1e-11, "{:?}", found_j.rounding);
    }
}
