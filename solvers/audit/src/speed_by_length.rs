//! The speed of a phase by the length of the path from its anchor, and the time to there.
//!
//! At constant jerk the time of a length is found by Newton's method in a bracket; where v² is a cubic polynomial of the length
//! it is integrated.

use super::phase_time::{kronrod, MOST_HALVINGS, RULES_AGREE};

/// Halvings of a bracket of the time until it is as narrow as its numbers.
const MOST_STEPS: u32 = 1100;

/// v, its change a and that one's change j, in s.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    pub v: f64,
    pub a: f64,
    pub j: f64,
}

/// The speed along a phase, counted from its anchor: where that is the end, time runs back.
#[derive(Clone, Copy, Debug)]
pub enum SpeedByLength {
    Constant {
        speed: f64,
    },
    /// The state at the anchor.
    Jerk {
        start: Pace,
        duration: f64,
    },
    /// v² by powers of the share of the length.
    Cubic {
        c: [f64; 4],
        length: f64,
    },
}

impl SpeedByLength {
    /// From v² and a at the anchor and at the other end.
    pub fn cubic(speed_sq: [f64; 2], a: [f64; 2], length: f64) -> Self {
        let [from, to] = speed_sq;
        let [slope, end_slope] = a.map(|a| 2.0 * a * length);
        let c =
            [from, slope, 3.0 * (to - from) - 2.0 * slope - end_slope, slope + end_slope - 2.0 * (to - from)];
        Self::Cubic { c, length }
    }

    /// The time from the anchor to a length; not a number where it cannot be integrated.
    pub fn time(&self, way: f64) -> f64 {
        match self {
            Self::Constant { speed } => way / speed,
            Self::Jerk { start, duration } => time_at_jerk(start, *duration, way),
            Self::Cubic { c, length } => {
                let slowness = |x: f64| length / square(c, x).sqrt();
                integral(&slowness, 0.0, way / length, &mut { MOST_HALVINGS })
            }
        }
    }

    /// The motion at a length from the anchor.
    pub fn pace(&self, way: f64) -> Pace {
        match self {
            Self::Constant { speed } => Pace { v: *speed, a: 0.0, j: 0.0 },
            Self::Jerk { start, .. } => start.after(self.time(way)),
            Self::Cubic { c, length } => {
                let x = way / length;
                let slope = c[1] + x * (2.0 * c[2] + x * 3.0 * c[3]);
                let bend = 2.0 * c[2] + 6.0 * c[3] * x;
                let v = square(c, x).sqrt();
                Pace { v, a: 0.5 * slope / length, j: 0.5 * v * bend / (length * length) }
            }
        }
    }

    /// The ranges of v, a and j between two places that are so long a way apart, in the order of travel.
    pub fn ranges(&self, [from, to]: [&Pace; 2], way: f64) -> [[f64; 2]; 3] {
        match self {
            Self::Constant { speed } => [[*speed; 2], [0.0; 2], [0.0; 2]],
            // v between its coefficients in Bernstein form by time, a linear.
            Self::Jerk { start: Pace { j, .. }, .. } => {
                let gained = 0.5 * from.a * (to.a - from.a) / j;
                let inner = from.v + if gained.is_finite() { gained } else { 0.0 };
                [range(&[from.v, inner, to.v]), range(&[from.a, to.a]), range(&[from.j, to.j])]
            }
            // The same of v² and a by the length; v″ of that is linear.
            Self::Cubic { .. } => {
                let third = 2.0 / 3.0 * way;
                let ends = [from.v * from.v, to.v * to.v];
                let square = [ends[0], ends[0] + third * from.a, ends[1] - third * to.a, ends[1]];
                let v = range(&square).map(|square| square.max(0.0).sqrt());
                let a = range(&[from.a, (square[2] - square[1]) / third, to.a]);
                let per_speed = range(&[from.j / from.v, to.j / to.v]);
                let j = range(&[
                    per_speed[0] * v[0],
                    per_speed[0] * v[1],
                    per_speed[1] * v[0],
                    per_speed[1] * v[1],
                ]);
                [v, a, j]
            }
        }
    }
}

/// The least and the greatest of some numbers.
fn range(numbers: &[f64]) -> [f64; 2] {
    numbers.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], x| [least.min(*x), most.max(*x)])
}

/// Time at constant jerk from the anchor to a length; beyond the phase's own at its mean speed.
fn time_at_jerk(start: &Pace, duration: f64, way: f64) -> f64 {
    let whole = start.way(duration);
    if way <= 0.0 {
        return 0.0;
    }
    if way >= whole {
        return duration * (way / whole);
    }
    let (mut low, mut high) = (0.0, duration);
    // From rest the time is as the cube root of the length.
    let mut t = duration * (way / whole).cbrt();
    for _ in 0..MOST_STEPS {
        let miss = start.way(t) - way;
        if miss > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let newton = t - miss / start.after(t).v;
        let next = if low < newton && newton < high { newton } else { 0.5 * (low + high) };
        if next == t || next <= low || next >= high {
            break;
        }
        t = next;
    }
    t
}

impl Pace {
    fn after(&self, t: f64) -> Self {
        Self { v: self.v + t * (self.a + 0.5 * t * self.j), a: self.a + t * self.j, j: self.j }
    }

    fn way(&self, t: f64) -> f64 {
        t * (self.v + t * (0.5 * self.a + t * self.j / 6.0))
    }
}

fn square(c: &[f64; 4], x: f64) -> f64 {
    c[0] + x * (c[1] + x * (c[2] + x * c[3]))
}

/// The integral from a to b, halved where the rules differ; not a number where that takes too long.
pub fn integral(f: &impl Fn(f64) -> f64, a: f64, b: f64, halvings: &mut u32) -> f64 {
    let [fine, doubt] = kronrod(f, a, b);
    let middle = 0.5 * (a + b);
    if doubt.abs() <= RULES_AGREE * fine.abs() || !(a < middle && middle < b) {
        return fine;
    }
    if *halvings == 0 || !fine.is_finite() {
        return f64::NAN;
    }
    *halvings -= 1;
    integral(f, a, middle, halvings) + integral(f, middle, b, halvings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_rest_at_constant_jerk_the_length_grows_with_the_cube_of_the_time() {
        let start = Pace { v: 0.0, a: 0.0, j: 6.0 };
        let speed = SpeedByLength::Jerk { start, duration: 2.0 };
        for t in [1e-9, 1e-3, 0.5, 1.9, 2.0] {
            let t: f64 = t;
            let (time, pace) = (speed.time(t.powi(3)), speed.pace(t.powi(3)));
            assert!((time / t - 1.0).abs() < 1e-15, "{t}");
            assert!((pace.v / (3.0 * t * t) - 1.0).abs() < 1e-14 && (pace.a / (6.0 * t) - 1.0).abs() < 1e-14);
        }
        // 1 % beyond the end takes 1 % more.
        assert!((speed.time(8.08) - 2.02).abs() < 1e-14);
    }

    #[test]
    fn a_square_linear_in_the_length_is_constant_acceleration() {
        // v² = 25 + 60 s over 5 mm: v = 5 + 30 t.
        let speed = SpeedByLength::cubic([25.0, 325.0], [30.0, 30.0], 5.0);
        for t in [0.01, 0.2, 0.4] {
            let way = 5.0 * t + 15.0 * t * t;
            let (time, Pace { v, a, j }) = (speed.time(way), speed.pace(way));
            assert!((time - t).abs() < 1e-12);
            assert!((v - 5.0 - 30.0 * t).abs() < 1e-13 && (a - 30.0).abs() < 1e-13 && j.abs() < 1e-12);
        }
    }
}
