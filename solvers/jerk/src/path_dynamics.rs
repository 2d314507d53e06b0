//! Allowable speed, acceleration and jerk along the path, segment by segment, from the limits of the axes, the feed and
//! the chord error (Cheatham 2007, chapter 5).
//!
//! Symbols: q an axis, S arc length, V, A, J speed, acceleration and jerk along the path. By 5.18–5.20 every axis keeps its
//! limits anywhere on a segment, whatever the profile does within V, A, J, if
//!
//! ```text
//! |q_S| V ≤ v_max,   |q_SS| V² + |q_S| A ≤ a_max,   |q_SSS| V³ + 3 |q_SS| V A + |q_S| J ≤ j_max
//! ```
//!
//! with bounds of the derivatives over the segment. The thesis's 5.21–5.26 solve the same rows for V, A and J one after
//! the other, which leaves nothing to A where V takes all, and divide by q_S, which may be 0. Here the three are chosen
//! together: they minimise the time from rest to rest over a length L that reaches V, L/V + V/A + A/J. So where an axis has
//! to share its acceleration between turning and speeding up, long stretches give more to speed, short ones to
//! acceleration.
//!
//! | file | idea |
//! |---|---|
//! | `interval` | interval arithmetic, and what numbers and intervals share |
//! | `chain` | derivatives by arc length from those by the parameter |
//! | `shape` | bounds of them over a segment, sampled or proven |

mod chain;
mod interval;
mod shape;

use crate::s_curve::Limits;
use feedplan_planner::bang_bang_quadratic::Fault;
pub use shape::{bounded, sampled, Curve, Shape};

/// Golden-section steps: the bracket shrinks to 1e-5 of itself; the minimum is flat.
const STEPS: usize = 24;
/// Parts of the greatest V and A that are tried: none leaves nothing to what comes after.
const RANGE: (f64, f64) = (1e-3, 1.0 - 1e-6);

/// Limits of every axis, in mm (or degrees) and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisLimits<const M: usize> {
    pub velocity: [f64; M],
    pub acceleration: [f64; M],
    pub jerk: [f64; M],
}

impl<const M: usize> AxisLimits<M> {
    /// The same with limits of jerk lower by a part.
    pub fn with_jerk_less(&self, part: f64) -> Self {
        Self { jerk: self.jerk.map(|jerk| (1.0 - part) * jerk), ..*self }
    }

    /// The greatest speed along a segment by the limits of velocity alone.
    pub fn fastest(&self, shape: &Shape<M>) -> f64 {
        (0..M).map(|k| self.velocity[k] / shape.first[k]).fold(f64::INFINITY, f64::min)
    }
}

/// What is allowed along a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowable {
    /// V, in mm/s.
    pub speed: f64,
    /// A and J.
    pub limits: Limits,
}

/// The greatest speed whose chords between setpoints keep within `tolerance` of a path of a curvature: that on
/// the circle, V² = (8 δ/κ − 4 δ²)/T², with δ the tolerance, κ the curvature and T the servo period.
pub fn chord_speed(curvature: f64, tolerance: f64, period: f64) -> f64 {
    // Where 1/κ < δ no part of the path shorter than 2 δ leaves its chord by δ.
    let chord_sq = if curvature * tolerance < 1.0 {
        8.0 * tolerance / curvature - 4.0 * tolerance * tolerance
    } else {
        4.0 * tolerance * tolerance
    };
    chord_sq.sqrt() / period
}

/// V, A, J for a segment, at most a `speed` (feed and chord error). `stretch` is the length in mm between places where the
/// motion is slow, over which a speed has to pay.
pub fn allowable<const M: usize>(
    shape: &Shape<M>,
    axes: &AxisLimits<M>,
    speed: f64,
    stretch: f64,
) -> Result<Allowable, Fault> {
    let rows = Rows { shape, axes };
    let Allowable { speed: most_speed, limits: most } = greatest(shape, axes, speed);
    if !(most_speed > 0.0 && most_speed.is_finite()) {
        return Err(Fault::Input {
            piece: None,
            what: format!(
                "the path has a cusp or no axis moves: curvature {} per mm leaves no speed; stop there",
                shape.curvature
            ),
        });
    }
    if rows.most_acceleration(most_speed) == most.acceleration
        && rows.most_jerk(most_speed, most.acceleration) == most.jerk
    {
        return Ok(Allowable { speed: most_speed, limits: most });
    }
    let with = |speed: f64| {
        let most = rows.most_acceleration(speed);
        let time = |acceleration: f64| {
            let limits = Limits { acceleration, jerk: rows.most_jerk(speed, acceleration) };
            let moves = acceleration > 0.0 && limits.jerk > 0.0;
            if moves {
                limits.duration(speed)
            } else {
                f64::INFINITY
            }
        };
        let acceleration = most * golden_section(|part| time(part * most));
        (acceleration, stretch / speed + time(acceleration))
    };
    let speed = most_speed * golden_section(|part| with(part * most_speed).1);
    let acceleration = with(speed).0;
    let jerk = rows.most_jerk(speed, acceleration);
    Ok(Allowable { speed, limits: Limits { acceleration, jerk } })
}

/// The greatest V, at most a `speed`, and the greatest A and J, each where the others take nothing: on lines V, A, J.
pub fn greatest<const M: usize>(shape: &Shape<M>, axes: &AxisLimits<M>, speed: f64) -> Allowable {
    let rows = Rows { shape, axes };
    let limits = Limits { acceleration: rows.most_acceleration(0.0), jerk: rows.most_jerk(0.0, 0.0) };
    Allowable { speed: rows.most_speed().min(speed), limits }
}

/// The inequalities at the head.
struct Rows<'a, const M: usize> {
    shape: &'a Shape<M>,
    axes: &'a AxisLimits<M>,
}

impl<const M: usize> Rows<'_, M> {
    /// The V that leaves nothing to A and J.
    fn most_speed(&self) -> f64 {
        let Shape { first, second, third, .. } = self.shape;
        let AxisLimits { velocity, acceleration, jerk } = self.axes;
        (0..M)
            .map(|k| {
                (velocity[k] / first[k])
                    .min((acceleration[k] / second[k]).sqrt())
                    .min((jerk[k] / third[k]).cbrt())
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// The A that leaves nothing to J.
    fn most_acceleration(&self, speed: f64) -> f64 {
        let Shape { first, second, third, .. } = self.shape;
        (0..M)
            .map(|k| {
                let by_acceleration = (self.axes.acceleration[k] - second[k] * speed.powi(2)) / first[k];
                let by_jerk = (self.axes.jerk[k] - third[k] * speed.powi(3)) / (3.0 * second[k] * speed);
                by_acceleration.min(by_jerk)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// J.
    fn most_jerk(&self, speed: f64, acceleration: f64) -> f64 {
        let Shape { first, second, third, .. } = self.shape;
        let taken = |k: usize| third[k] * speed.powi(3) + 3.0 * second[k] * speed * acceleration;
        (0..M).map(|k| (self.axes.jerk[k] - taken(k)) / first[k]).fold(f64::INFINITY, f64::min)
    }
}

/// Where in `RANGE`, or at 1, a function is least. It is convex in A; in V any place gives a valid choice.
fn golden_section(f: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = RANGE;
    let (mut left, mut right) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 0..STEPS {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - ratio * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + ratio * (high - low);
            at_right = f(right);
        }
    }
    let middle = 0.5 * (low + high);
    if f(1.0) <= f(middle) {
        1.0
    } else {
        middle
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const AXES: AxisLimits<2> =
        AxisLimits { velocity: [250.0, 200.0], acceleration: [3000.0; 2], jerk: [50_000.0; 2] };

    /// A circle of a radius, in every direction.
    fn circle(radius: f64) -> Shape<2> {
        let all = |value: f64| [value; 2];
        let curvature = 1.0 / radius;
        Shape { first: all(1.0), second: all(curvature), third: all(curvature * curvature), curvature }
    }

    fn time(stretch: f64, found: &Allowable) -> f64 {
        stretch / found.speed + found.limits.duration(found.speed)
    }

    #[test]
    fn a_straight_line_takes_the_limits_of_its_slowest_axis() {
        // Along (3, 4)/5: 200/0.8 and 3000/0.8.
        let line = Shape { first: [0.6, 0.8], second: [0.0; 2], third: [0.0; 2], curvature: 0.0 };
        let found = allowable(&line, &AXES, f64::INFINITY, 1000.0).unwrap();
        assert_eq!(found.speed, 250.0);
        assert_eq!(found.limits, Limits { acceleration: 3750.0, jerk: 62_500.0 });
        // Over any length: neither takes of the other.
        let slow = allowable(&line, &AXES, 80.0, 1e-6).unwrap();
        assert_eq!(slow, Allowable { speed: 80.0, ..found });
    }

    #[test]
    fn every_row_holds_and_one_of_jerk_is_used_up() {
        let found = allowable(&circle(5.0), &AXES, f64::INFINITY, 20.0).unwrap();
        let (v, Limits { acceleration: a, jerk: j }) = (found.speed, found.limits);
        assert!(v <= 200.0 && v * v / 5.0 + a <= 3000.0);
        assert!(((v.powi(3) / 25.0 + 3.0 * v * a / 5.0 + j) / 50_000.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn longer_stretches_give_more_to_speed() {
        let speed = |stretch: f64| allowable(&circle(5.0), &AXES, f64::INFINITY, stretch).unwrap().speed;
        assert!(speed(1.0) < speed(10.0) && speed(10.0) < speed(100.0));
        // At most what the jerk of turning alone allows: (50 000·25)^(1/3) mm/s.
        assert!(speed(1e6) > 0.99 * 1.25e6_f64.cbrt() && speed(1e6) < 1.25e6_f64.cbrt());
    }

    #[test]
    fn a_cusp_leaves_no_speed() {
        let cusp = Shape { second: [f64::INFINITY; 2], curvature: f64::INFINITY, ..circle(1.0) };
        let message = allowable(&cusp, &AXES, 100.0, 1.0).unwrap_err().to_string();
        assert!(message.contains("cusp"), "{message}");
    }

    #[test]
    fn chords_of_a_circle_keep_their_tolerance() {
        // Chord of 2 mm on a circle of radius 5/4·… : sagitta δ = R − √(R² − 1).
        let (radius, period) = (5.0_f64, 0.01);
        let sagitta = radius - (radius * radius - 1.0).sqrt();
        assert!((chord_speed(1.0 / radius, sagitta, period) - 2.0 / period).abs() < 1e-9);
        assert_eq!(chord_speed(10.0, 0.5, 0.01), 100.0);
        assert_eq!(chord_speed(0.0, 0.5, 0.01), f64::INFINITY);
    }

    proptest! {
        #[test]
        fn the_choice_is_feasible_and_no_other_is_much_quicker(
            bounds in prop::array::uniform6((-3.0..1.0f64).prop_map(|e| 10f64.powf(e))),
            stretch in (-2.0..3.0f64).prop_map(|e| 10f64.powf(e)),
        ) {
            let [a, b, c, d, e, f] = bounds;
            let shape = Shape { first: [a.min(1.0), b.min(1.0)], second: [c, d], third: [e, f], curvature: c.hypot(d) };
            let found = allowable(&shape, &AXES, 400.0, stretch).unwrap();
            let rows = Rows { shape: &shape, axes: &AXES };
            let (v, Limits { acceleration, jerk }) = (found.speed, found.limits);
            prop_assert!(v > 0.0 && acceleration > 0.0 && jerk > 0.0, "{found:?} {shape:?}");
            for k in 0..2 {
                let (q1, q2, q3) = (shape.first[k], shape.second[k], shape.third[k]);
                prop_assert!(q1 * v <= AXES.velocity[k] * (1.0 + 1e-12));
                prop_assert!(q2 * v * v + q1 * acceleration <= AXES.acceleration[k] * (1.0 + 1e-12));
                prop_assert!(q3 * v.powi(3) + 3.0 * q2 * v * acceleration + q1 * jerk <= AXES.jerk[k] * (1.0 + 1e-12));
            }
            // A scan of V and A.
            let best = time(stretch, &found);
            for i in 1..40 {
                let speed = rows.most_speed().min(400.0) * f64::from(i) / 40.0;
                for j in 1..40 {
                    let acceleration = rows.most_acceleration(speed) * f64::from(j) / 40.0;
                    let jerk = rows.most_jerk(speed, acceleration);
                    let other = Allowable { speed, limits: Limits { acceleration, jerk } };
                    prop_assert!(time(stretch, &other) > best * (1.0 - 1e-3), "{found:?} {other:?}");
                }
            }
        }
    }
}
