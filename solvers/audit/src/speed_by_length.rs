//! Speed, acceleration and jerk along the path as functions of the length from the anchor of a phase (the end from which lengths
//! and times are counted), and the time from there.
//!
//! At constant jerk the time is found by Newton's method within a bracket; where v² is a cubic polynomial of the length, it is
//! the integral of 1/v.

use fearless_simd::{dispatch, Level};

use super::number::Number;
use super::quadrature::{integral, MOST_HALVINGS};
use super::{EPS, ROUNDINGS};

/// Most steps of a bisection: a bracket of floating-point numbers cannot be halved more often.
const MOST_STEPS: u32 = 1100;

/// Speed, acceleration and jerk along the path, in mm and s.
#[derive(Clone, Copy, Debug)]
pub struct Pace<T = f64> {
    pub v: T,
    pub a: T,
    pub j: T,
}

/// The speed along a phase, counted from its anchor; if that is the end of the phase, time runs back.
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
    /// v² by powers of the share of the length, `c`.
    Cubic {
        c: [f64; 4],
        length: f64,
    },
}

impl SpeedByLength {
    /// With a cubic v², from v² and a at the anchor and at the other end.
    pub fn cubic(speed_sq: [f64; 2], a: [f64; 2], length: f64) -> Self {
        Self::Cubic { c: cubic(speed_sq, a, length), length }
    }

    /// The time from the anchor to a length, in s; NaN if it cannot be integrated.
    pub fn time(&self, way: f64) -> f64 {
        match self {
            Self::Constant { speed } => way / speed,
            Self::Jerk { start, duration } => time_at_jerk(start, *duration, way),
            Self::Cubic { c, length } => {
                integral(&mut |x| slowness(c, *length, x), 0.0, way / length, &mut { MOST_HALVINGS })
            }
        }
    }

    /// The motion at a length from the anchor; and the time to there, if the motion was computed from it.
    pub fn pace(&self, way: f64) -> (Pace, Option<f64>) {
        match self {
            Self::Constant { speed } => (Pace { v: *speed, a: 0.0, j: 0.0 }, None),
            Self::Jerk { start, .. } => {
                let time = self.time(way);
                (start.after(time), Some(time))
            }
            Self::Cubic { c, length } => {
                let x = way / length;
                let (v, a) = (square(c, x).sqrt(), cubic_acceleration(c, *length, x));
                let bend = 2.0 * c[2] + 6.0 * c[3] * x;
                (Pace { v, a, j: 0.5 * v * bend / (length * length) }, None)
            }
        }
    }

    /// Bounds between two places, in the order of travel, of v, a and j and of their first two derivatives by the length: v' =
    /// a/v, a' = j/v. `way` is the length between the places.
    pub fn bounds(&self, [from, to]: [&Pace; 2], way: f64) -> [Bounds<f64>; 3] {
        match self {
            Self::Constant { speed } => [[*speed, 0.0, 0.0], [0.0; 3], [0.0; 3]].map(Bounds),
            // v lies between its Bernstein coefficients by time, and a is linear in time.
            Self::Jerk { start: Pace { j: constant, .. }, .. } => {
                let gained = 0.5 * from.a * (to.a - from.a) / constant;
                let inner = from.v + if gained.is_finite() { gained } else { 0.0 };
                let (slowest, v) = (from.v.min(inner).min(to.v), from.v.max(inner).max(to.v));
                let a = from.a.abs().max(to.a.abs());
                bounds_from(slowest, [v, a], [constant.abs(), 0.0, 0.0])
            }
            Self::Cubic { .. } => cubic_bounds([from, to], way),
        }
    }
}

/// v² by powers of the share of the length, from v² and a at both ends.
#[inline(always)]
pub fn cubic<T: Number>([from, to]: [T; 2], a: [T; 2], length: T) -> [T; 4] {
    let (rise, slope, end_slope) = (to - from, a[0] * 2.0 * length, a[1] * 2.0 * length);
    [from, slope, rise * 3.0 - slope * 2.0 - end_slope, slope + end_slope - rise * 2.0]
}

/// a at a share x of the length.
#[inline(always)]
pub fn cubic_acceleration<T: Number>(c: &[T; 4], length: T, x: T) -> T {
    (c[1] + x * (c[2] * 2.0 + x * 3.0 * c[3])) * 0.5 / length
}

/// `SpeedByLength::bounds` where v² is a cubic of the length: v² and a lie between their Bernstein coefficients by the length,
/// and j/v is linear in it.
#[inline(always)]
pub fn cubic_bounds<T: Number>([from, to]: [&Pace<T>; 2], way: T) -> [Bounds<T>; 3] {
    let third = way * (2.0 / 3.0);
    let ends = [from.v * from.v, to.v * to.v];
    let inner = [ends[0] + third * from.a, ends[1] - third * to.a];
    let least = ends[0].smaller(inner[0]).smaller(inner[1].smaller(ends[1]));
    let most = ends[0].greater(inner[0]).greater(inner[1].greater(ends[1]));
    let (slowest, v) = (least.greater(way.filled(0.0)).root(), most.root());
    let a = from.a.size().greater(((inner[1] - inner[0]) / third).size()).greater(to.a.size());
    let rates = [from.j / from.v, to.j / to.v];
    let (rate, slope) = (rates[0].size().greater(rates[1].size()), (rates[1] - rates[0]).size() / way);
    let per = way.filled(1.0) / slowest;
    let gained = a * per;
    let j1 = rate * gained + slope * v;
    let j2 = rate * (rate + gained * gained) * per + slope * gained * 2.0;
    bounds_from(slowest, [v, a], [rate * v, j1, j2])
}

/// Bounds from the least speed, the greatest speed and acceleration, and the greatest jerk with its first two derivatives by the
/// length.
#[inline(always)]
fn bounds_from<T: Number>(slowest: T, [v, a]: [T; 2], [j, j1, j2]: [T; 3]) -> [Bounds<T>; 3] {
    let per = slowest.filled(1.0) / slowest;
    let v = Bounds([v, a * per, (j + a * a * per) * per * per]);
    let a = Bounds([a, j * per, (j1 + j * a * per * per) * per]);
    [v, a, Bounds([j, j1, j2])]
}

/// Whether a recorded speed equals another one up to rounding: the rounding error bound of the velocities is at least twice what
/// is allowed here.
pub fn is_same_speed(speed: f64, recorded: f64) -> bool {
    (recorded - speed).abs() <= 0.5 * ROUNDINGS * EPS * speed
}

/// Bounds of the absolute values of a function and of its first two derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<T>(pub [T; 3]);

impl<T: Number> Bounds<T> {
    /// Bounds for the product of two functions.
    #[inline(always)]
    pub fn times(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[0] * b[2] + a[1] * b[1] * 2.0 + a[2] * b[0]])
    }

    /// Bounds with derivatives by another variable: `first` and `second` bound the first two derivatives of the present variable
    /// by that one.
    #[inline(always)]
    pub fn at(self, first: T, second: T) -> Self {
        let Self([f, f1, f2]) = self;
        Self([f, f1 * first, f2 * first * first + f1 * second])
    }
}

/// Time in s at constant jerk from the anchor to a length; beyond the phase it goes on at the mean speed of the phase.
fn time_at_jerk(start: &Pace, duration: f64, way: f64) -> f64 {
    let whole = start.way(duration);
    if way <= 0.0 {
        return 0.0;
    }
    if way >= whole {
        return duration * (way / whole);
    }
    let (mut low, mut high) = (0.0, duration);
    // First guess: if the speed changes little, the time is proportional to the length; from rest, to its cube root.
    let share = way / whole;
    let mut t = match 2.0 * start.v * duration > whole {
        true => duration * share,
        false => (duration * share.cbrt()).min(way / start.v),
    };
    for _ in 0..MOST_STEPS {
        let miss = start.way(t) - way;
        if miss > 0.0 {
            high = t;
        } else {
            low = t;
        }
        let newton = t - miss / start.after(t).v;
        // A step of this size is only rounding, and may well lead out of the bracket.
        if (newton - t).abs() <= EPS * t {
            break;
        }
        let next = if low < newton && newton < high { newton } else { 0.5 * (low + high) };
        if next <= low || next >= high {
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

/// `length` over v at several shares x of the length, in SIMD vectors.
fn slowness(c: &[f64; 4], length: f64, x: [f64; 8]) -> [f64; 8] {
    dispatch!(Level::new(), _simd => {
        let mut slowness = [length; 8];
        for i in 0..8 {
            slowness[i] /= square(c, x[i]).sqrt();
        }
        slowness
    })
}

/// v² at a share x of the length.
#[inline(always)]
pub fn square<T: Number>(c: &[T; 4], x: T) -> T {
    c[0] + x * (c[1] + x * (c[2] + x * c[3]))
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
            let (time, (pace, _)) = (speed.time(t.powi(3)), speed.pace(t.powi(3)));
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
            let (time, (Pace { v, a, j }, _)) = (speed.time(way), speed.pace(way));
            assert!((time - t).abs() < 1e-12);
            assert!((v - 5.0 - 30.0 * t).abs() < 1e-13 && (a - 30.0).abs() < 1e-13 && j.abs() < 1e-12);
        }
    }
}
