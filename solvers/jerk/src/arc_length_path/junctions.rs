//! Computes the speed caps where parts of a subrun meet, from the corner and the jump of q'' there (`curvature_jumps`).

use crate::curvature_jumps::{passages, Jump, Passage};
use crate::path_problem::{PathPoint, SpeedCap};
use feedplan_geometry::quadratic::dot;
use feedplan_planner::problem::{self, Both, Problem};

/// A place where two parts meet.
pub struct Meeting<const M: usize> {
    /// Arc length, in mm.
    pub s: f64,
    /// The greatest speed by the corner, in mm/s; None inside a piece, which is smooth.
    pub corner: Option<f64>,
    /// Derivatives and speed cap on the part before and on the part after the place.
    pub sides: [PathPoint<M>; 2],
}

/// The speed cap and the limits of jerk where two parts meet.
#[derive(Clone, Copy, Debug)]
pub struct Junction {
    /// The speed cap by a corner or a jump of q'', and the tighter limits of jerk around the jump.
    pub cap: SpeedCap,
    /// Whether the jump sets the cap.
    pub jumps: bool,
}

/// The junctions where these parts meet, under the problem's limits and those of jerk.
pub fn junctions<const M: usize>(
    problem: &Problem<M>,
    meetings: &[Meeting<M>],
    jerk: &[f64; M],
) -> Vec<Junction> {
    let jumps: Vec<Jump<M>> = meetings.iter().map(|meeting| meeting.jump(problem, jerk)).collect();
    let passages = passages(&jumps, problem.period);
    let junction = |((meeting, jump), passage): ((&Meeting<M>, &Jump<M>), &Passage)| {
        // A corner above the speed by other limits needs no cap.
        let corner = meeting.corner.filter(|corner| *corner <= jump.speed);
        let Passage { speed, reach, share } = *passage;
        let cap = SpeedCap { s: jump.s, speed: corner.unwrap_or(f64::INFINITY).min(speed), reach, share };
        Junction { cap, jumps: speed < f64::INFINITY }
    };
    meetings.iter().zip(&jumps).zip(&passages).map(junction).collect()
}

impl<const M: usize> Meeting<M> {
    /// The jump of q'', with the greatest speed and the greatest acceleration along the path by all other limits.
    fn jump(&self, problem: &Problem<M>, jerk: &[f64; M]) -> Jump<M> {
        let mut speed = self.corner.unwrap_or(f64::INFINITY);
        for path_point in &self.sides {
            speed = speed
                .min(problem::along(&problem.max_velocity, &path_point.first))
                .min(path_point.speed_cap)
                .min(turning_speed(path_point, &problem.max_acceleration));
        }
        let (mut up, mut down) = (f64::INFINITY, f64::INFINITY);
        for PathPoint { first, second, .. } in &self.sides {
            let room = problem
                .max_acceleration
                .map(|most| std::array::from_fn(|k| most[k] + second[k].abs() * speed * speed));
            up = up.min(problem::along(&room, first));
            down = down.min(problem::along(&room, &first.map(|first| -first)));
        }
        let change = self.corner.map_or([0.0; M], |_| {
            let [before, after] = &self.sides;
            std::array::from_fn(|k| (after.second[k] - before.second[k]).abs() / jerk[k])
        });
        Jump { s: self.s, change, speed, acceleration: up.max(down) }
    }
}

/// The speed caps at junctions of a subrun of length `total` in mm, and caps with infinite speed at places where tighter limits
/// of jerk begin or end away from a junction.
pub fn caps(junctions: &[Junction], total: f64) -> Vec<SpeedCap> {
    let asks = |junction: &&Junction| junction.cap.speed < f64::INFINITY || junction.cap.share > 0.0;
    let own: Vec<SpeedCap> = junctions.iter().filter(asks).map(|junction| junction.cap).collect();
    let mut out = Vec::with_capacity(3 * own.len());
    for (i, cap) in own.iter().enumerate() {
        let before = if i == 0 { 0.0 } else { own[i - 1].s + own[i - 1].reach };
        let after = own.get(i + 1).map_or(total, |next| next.s - next.reach);
        let [from, to] = [cap.s - cap.reach, cap.s + cap.reach];
        if cap.share > 0.0 && before < from && from < cap.s {
            out.push(SpeedCap::new(from, f64::INFINITY));
        }
        out.push(*cap);
        if cap.share > 0.0 && cap.s < to && to < after {
            out.push(SpeedCap::new(to, f64::INFINITY));
        }
    }
    out
}

/// An upper bound in mm/s on the speed by the acceleration limits: by the acceleration across the direction of motion, which no
/// acceleration along it can reduce. NaN if there is no such acceleration.
fn turning_speed<const M: usize>(path_point: &PathPoint<M>, limits: &Both<M>) -> f64 {
    let PathPoint { first, second, .. } = path_point;
    let along = dot(second, first) / dot(first, first);
    let across: [f64; M] = std::array::from_fn(|k| second[k] - along * first[k]);
    let limit = |k: usize| limits[usize::from(across[k] < 0.0)][k];
    let most = (0..M).map(|k| across[k].abs() * limit(k)).sum::<f64>();
    (most / dot(&across, &across)).sqrt()
}
