//! The result of the planner: w = v² [mm²/s²] over the arc length [mm], a C¹ cubic spline between ramps of constant jerk or of
//! constant acceleration.

use super::hermite;
use super::rest_ramp::Ramp;
use feedplan_geometry::elementary::Elementary;

/// w at the stations. A ramp joins an end of the path that is at rest to the nearest station.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    /// Arc lengths of the stations, in mm.
    pub s: Vec<f64>,
    /// v² at the stations, in mm²/s².
    pub speed_sq: Vec<f64>,
    /// w' at the stations, the derivative of v² along the path: twice the acceleration, in mm/s².
    pub slope: Vec<f64>,
    /// Arc lengths of the ends of the path; without a ramp they are the first and the last station.
    pub ends: [f64; 2],
    /// The powers of the distance from rest to which w is proportional on the ramps.
    pub powers: [f64; 2],
}

impl Profile {
    /// w, w' and w'' at an arc length in mm. At a station w'' is that of the interval after it, at the last station that of the
    /// interval before it.
    pub fn at(&self, s: f64) -> [f64; 3] {
        let last = self.s.len() - 1;
        if s < self.s[0] {
            return on_ramp(s - self.ends[0], self.ramp(0), self.speed_sq[0], 1.0);
        }
        if s > self.s[last] {
            return on_ramp(self.ends[1] - s, self.ramp(1), self.speed_sq[last], -1.0);
        }
        let n = self.s.partition_point(|&station| station <= s).clamp(1, last) - 1;
        let h = self.s[n + 1] - self.s[n];
        let u = [self.speed_sq[n], self.slope[n] * h, self.speed_sq[n + 1], self.slope[n + 1] * h];
        let basis = hermite::at((s - self.s[n]) / h);
        let of = |order: usize| (0..4).map(|k| u[k] * basis[order][k]).sum::<f64>();
        [of(0), of(1) / h, of(2) / (h * h)]
    }

    /// The time from end to end, in s.
    pub fn time(&self) -> f64 {
        let last = self.s.len() - 1;
        let x: Vec<f64> = self.speed_sq.iter().zip(&self.slope).flat_map(|(w, slope)| [*w, *slope]).collect();
        let inside: f64 = (0..last).map(|n| hermite::duration(&x, n, self.s[n + 1] - self.s[n])).sum();
        let ramp = |end: usize, w: f64| {
            if self.ramp(end).length > 0.0 {
                self.ramp(end).way() / w.sqrt()
            } else {
                0.0
            }
        };
        inside + ramp(0, self.speed_sq[0]) + ramp(1, self.speed_sq[last])
    }

    /// The ramp at the start or at the end.
    pub fn ramp(&self, end: usize) -> Ramp {
        let lengths = [self.s[0] - self.ends[0], self.ends[1] - self.s[self.s.len() - 1]];
        Ramp { length: lengths[end], power: self.powers[end] }
    }
}

/// w, w', w'' at a distance from rest on a ramp with w = `greatest` at its end; `sign` is −1 at the end of the path.
fn on_ramp(distance: f64, ramp: Ramp, greatest: f64, sign: f64) -> [f64; 3] {
    let part = distance / ramp.length;
    let w = greatest * part.power(ramp.power);
    let slope = ramp.power * greatest / ramp.length * part.power(ramp.power - 1.0);
    let bend = (ramp.power - 1.0) * ramp.slope() / ramp.length * greatest * part.power(ramp.power - 2.0);
    [w, sign * slope, bend]
}

#[derive(Clone, Debug)]
pub struct Plan {
    pub profile: Profile,
    /// In s.
    pub time: f64,
    /// A lower bound on the time, in s, as `lower_bound` proves it; NaN without proof.
    pub lower_bound: f64,
    /// Whether every window reached its optimum.
    pub converged: bool,
    /// Estimate of the time above the least time on the grid, in s, from the complementarity gap. It is no bound, and it has no
    /// meaning if the deadline stopped the iterations.
    pub excess: f64,
    /// Newton steps, averaged over the intervals.
    pub iterations: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramps_are_of_constant_jerk() {
        // From rest with J = 6 mm/s³: s = t³, v = 3 t², w = 9 s^(4/3).
        let profile = Profile {
            s: vec![1.0, 2.0],
            speed_sq: vec![9.0, 9.0],
            slope: vec![12.0, -12.0],
            ends: [0.0, 3.0],
            powers: [Ramp::JERK; 2],
        };
        let [w, w1, w2] = profile.at(0.125);
        assert!((w - 9.0 / 16.0).abs() < 1e-14 && (w1 - 6.0).abs() < 1e-14);
        assert!((0.5 * w.sqrt() * w2 - 6.0).abs() < 1e-13, "jerk is v w''/2 on a line");
        let [w, w1, _] = profile.at(2.875);
        assert!((w - 9.0 / 16.0).abs() < 1e-14 && (w1 + 6.0).abs() < 1e-14);
        // 1 s on each ramp.
        let inside = hermite::duration(&[9.0, 12.0, 9.0, -12.0], 0, 1.0);
        assert!((profile.time() - 2.0 - inside).abs() < 1e-14);
    }

    #[test]
    fn ramps_where_the_path_turns_back_are_of_constant_acceleration() {
        // From rest at 4 mm/s²: s = 2 t², w = 8 s.
        let profile = Profile {
            s: vec![0.5, 1.0],
            speed_sq: vec![4.0, 4.0],
            slope: vec![8.0, -8.0],
            ends: [0.0, 1.5],
            powers: [Ramp::ACCELERATION; 2],
        };
        assert_eq!((profile.at(0.125), profile.at(1.375)), ([1.0, 8.0, 0.0], [1.0, -8.0, 0.0]));
        let inside = hermite::duration(&[4.0, 8.0, 4.0, -8.0], 0, 0.5);
        assert!((profile.time() - 1.0 - inside).abs() < 1e-14);
    }
}
