//! Computes the allowable speed, acceleration and jerk along a segment of path, from the limits of the axes, the feed and the
//! chord error (Cheatham 2007, chapter 5).
//!
//! Symbols: q an axis, S arc length [mm], V, A, J speed, acceleration and jerk along the path [mm, s]. By 5.18–5.20
//! every axis keeps its limits anywhere on a segment, whatever the profile does within V, A, J, if
//!
//! ```text
//! |q_S| V ≤ v_max,   |q_SS| V² + |q_S| A ≤ a_max,   |q_SSS| V³ + 3 |q_SS| V A + |q_S| J ≤ j_max
//! ```
//!
//! with bounds on the derivatives over the segment. Where the limits of an axis differ by direction, q_S and q_SS have one bound
//! for each sign; A is the lesser of the values for speeding up and slowing down. The thesis's 5.21–5.26 solve the same rows for
//! V, A and J one after the other; this leaves no A where V uses the whole limit, and they divide by q_S, which may be 0. Here V,
//! A and J minimise the time from rest to rest over a reference length L on which V is reached, L/V + V/A + A/J. Where an axis
//! shares its acceleration between turning and speeding up, a long L favours the speed, a short L the acceleration.
//!
//! | module | what it computes |
//! |---|---|
//! | `chain_rule` | derivatives by arc length from those by the parameter |
//! | `shape` | bounds on these derivatives over a segment, sampled or proven |

mod chain_rule;
mod shape;

pub use crate::path_problem::Limits as AxisLimits;
use crate::s_curve::Limits;
use feedplan_planner::problem::{greater, Fault};
pub use shape::{bounded, bounded_until, sampled, Curve, Shape};

/// Golden-section steps: the bracket shrinks to 1e-5 of its width; more is not needed, because the minimum is flat.
const STEPS: usize = 24;
/// Fractions of the greatest V and A that are tried: a V below its greatest leaves some A, and an A below its greatest some J.
const RANGE: (f64, f64) = (1e-3, 1.0 - 1e-6);

impl<const M: usize> AxisLimits<M> {
    /// These limits, with the limits of jerk lower by the fraction `part`.
    pub fn with_jerk_less(&self, part: f64) -> Self {
        Self { jerk: self.jerk.map(|jerk| (1.0 - part) * jerk), ..*self }
    }

    /// The greatest speed along a segment in mm/s by the limits of velocity alone.
    pub fn fastest(&self, shape: &Shape<M>) -> f64 {
        of_both::<M>(|sign, k| self.velocity[sign][k] / shape.first[sign][k])
    }
}

/// The limits along a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowable {
    /// V, in mm/s.
    pub speed: f64,
    /// A and J.
    pub limits: Limits,
}

/// The greatest speed, in mm/s, at which the chords between setpoints stay within `tolerance` of a path: V² = (8 δ/κ −
/// 4 δ²)/T² on a circle, with the tolerance δ [mm], the curvature κ [1/mm] and the servo period T [s].
pub fn chord_speed(curvature: f64, tolerance: f64, period: f64) -> f64 {
    // Where 1/κ < δ, no part of the path shorter than 2 δ leaves its chord by δ.
    let least = 4.0 * tolerance * tolerance;
    (8.0 * tolerance / curvature - least).max(least).sqrt() / period
}

/// V, A and J for a segment, with V at most `speed` (feed and chord error). `reference_length` is the L of the head, in
/// mm: the length between places where the motion is slow.
pub fn allowable<const M: usize>(
    shape: &Shape<M>,
    axes: &AxisLimits<M>,
    speed: f64,
    reference_length: f64,
) -> Result<Allowable, Fault> {
    let rows = Inequalities::new(shape, axes);
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
        (acceleration, reference_length / speed + time(acceleration))
    };
    let speed = most_speed * golden_section(|part| with(part * most_speed).1);
    let acceleration = with(speed).0;
    let jerk = rows.most_jerk(speed, acceleration);
    Ok(Allowable { speed, limits: Limits { acceleration, jerk } })
}

/// The greatest V, at most `speed`, and the greatest A and J, each as if the others were 0; on lines these are V, A, J.
pub fn greatest<const M: usize>(shape: &Shape<M>, axes: &AxisLimits<M>, speed: f64) -> Allowable {
    let rows = Inequalities::new(shape, axes);
    let limits = Limits { acceleration: rows.most_acceleration(0.0), jerk: rows.most_jerk(0.0, 0.0) };
    Allowable { speed: rows.most_speed().min(speed), limits }
}

/// The least value over both signs of all axes.
fn of_both<const M: usize>(of: impl Fn(usize, usize) -> f64) -> f64 {
    (0..2 * M).map(|i| of(i / M, i % M)).fold(f64::INFINITY, f64::min)
}

struct Inequalities<'a, const M: usize> {
    shape: &'a Shape<M>,
    axes: &'a AxisLimits<M>,
    /// |q_S| and |q_SS|.
    first: [f64; M],
    second: [f64; M],
}

impl<'a, const M: usize> Inequalities<'a, M> {
    fn new(shape: &'a Shape<M>, axes: &'a AxisLimits<M>) -> Self {
        Self { shape, axes, first: greater(&shape.first), second: greater(&shape.second) }
    }

    /// The greatest V: with A = 0 and J = 0 every limit holds.
    fn most_speed(&self) -> f64 {
        let AxisLimits { acceleration, jerk, .. } = self.axes;
        let by_acceleration =
            of_both::<M>(|sign, k| (acceleration[sign][k] / self.shape.second[sign][k]).sqrt());
        let by_jerk = (0..M).map(|k| (jerk[k] / self.shape.third[k]).cbrt()).fold(f64::INFINITY, f64::min);
        self.axes.fastest(self.shape).min(by_acceleration).min(by_jerk)
    }

    /// The greatest A at this V: with J = 0 every limit holds.
    fn most_acceleration(&self, speed: f64) -> f64 {
        let Self { shape, axes, first, second } = self;
        (0..M)
            .map(|k| {
                let left = |sign: usize| axes.acceleration[sign][k] - shape.second[sign][k] * speed.powi(2);
                let by_acceleration = left(0).min(left(1)) / first[k];
                let by_jerk = (axes.jerk[k] - shape.third[k] * speed.powi(3)) / (3.0 * second[k] * speed);
                by_acceleration.min(by_jerk)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// The greatest J that V and A leave.
    fn most_jerk(&self, speed: f64, acceleration: f64) -> f64 {
        let Self { shape, axes, first, second } = self;
        let taken = |k: usize| shape.third[k] * speed.powi(3) + 3.0 * second[k] * speed * acceleration;
        (0..M).map(|k| (axes.jerk[k] - taken(k)) / first[k]).fold(f64::INFINITY, f64::min)
    }
}

/// The argument in `RANGE`, or 1, at which f is least. The time is convex in A; every V gives a valid choice.
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
        AxisLimits { velocity: [[250.0, 200.0]; 2], acceleration: [[3000.0; 2]; 2], jerk: [50_000.0; 2] };

    /// A circle of a radius, in every direction.
    fn circle(radius: f64) -> Shape<2> {
        let all = |value: f64| [[value; 2]; 2];
        let curvature = 1.0 / radius;
        Shape { first: all(1.0), second: all(curvature), third: [curvature * curvature; 2], curvature }
    }

    fn time(reference_length: f64, found: &Allowable) -> f64 {
        reference_length / found.speed + found.limits.duration(found.speed)
    }

    #[test]
    fn a_straight_line_takes_the_limits_of_its_slowest_axis() {
        // Along (3, 4)/5: 200/0.8 and 3000/0.8.
        let line = Shape::of(&[0.6, -0.8], &[0.0; 2], &[0.0; 2]);
        let found = allowable(&line, &AXES, f64::INFINITY, 1000.0).unwrap();
        assert_eq!(found.speed, 250.0);
        assert_eq!(found.limits, Limits { acceleration: 3750.0, jerk: 62_500.0 });
        // On a line V does not depend on L, as no limit is shared.
        let slow = allowable(&line, &AXES, 80.0, 1e-6).unwrap();
        assert_eq!(slow, Allowable { speed: 80.0, ..found });
    }

    #[test]
    fn a_straight_line_takes_the_limits_of_its_direction() {
        // 80/0.8 back along y; the lesser acceleration of both directions, 1500/0.8.
        let line = Shape::of(&[0.6, -0.8], &[0.0; 2], &[0.0; 2]);
        let velocity = [[250.0, 200.0], [1.0, 80.0]];
        let axes = AxisLimits { velocity, acceleration: [[3000.0; 2], [3000.0, 1500.0]], ..AXES };
        let found = allowable(&line, &axes, f64::INFINITY, 1000.0).unwrap();
        assert_eq!((found.speed, found.limits.acceleration), (100.0, 1875.0));
    }

    #[test]
    fn a_bend_takes_the_limit_of_the_side_that_it_turns_to() {
        let bend = Shape { second: [[0.2, 0.0], [0.0, 0.0]], ..circle(5.0) };
        let acceleration = [[500.0, 3000.0], [100.0, 3000.0]];
        let axes = AxisLimits { velocity: [[1e9; 2]; 2], acceleration, jerk: [1e12; 2] };
        assert!((greatest(&bend, &axes, f64::INFINITY).speed - 2500f64.sqrt()).abs() < 1e-9);
        let rows = Inequalities::new(&bend, &axes);
        assert_eq!((rows.most_acceleration(0.0), rows.most_acceleration(45.0)), (100.0, 95.0));
    }

    #[test]
    fn every_row_holds_and_one_of_jerk_is_used_up() {
        let found = allowable(&circle(5.0), &AXES, f64::INFINITY, 20.0).unwrap();
        let (v, Limits { acceleration: a, jerk: j }) = (found.speed, found.limits);
        assert!(v <= 200.0 && v * v / 5.0 + a <= 3000.0);
        assert!(((v.powi(3) / 25.0 + 3.0 * v * a / 5.0 + j) / 50_000.0 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn longer_reference_lengths_favour_the_speed() {
        let speed = |reference_length: f64| {
            allowable(&circle(5.0), &AXES, f64::INFINITY, reference_length).unwrap().speed
        };
        assert!(speed(1.0) < speed(10.0) && speed(10.0) < speed(100.0));
        // At most what the jerk of turning alone allows: (50 000·25)^(1/3) mm/s.
        assert!(speed(1e6) > 0.99 * 1.25e6_f64.cbrt() && speed(1e6) < 1.25e6_f64.cbrt());
    }

    #[test]
    fn a_cusp_leaves_no_speed() {
        let cusp = Shape { second: [[f64::INFINITY; 2]; 2], curvature: f64::INFINITY, ..circle(1.0) };
        let message = allowable(&cusp, &AXES, 100.0, 1.0).unwrap_err().to_string();
        assert!(message.contains("cusp"), "{message}");
    }

    #[test]
    fn chords_of_a_circle_keep_their_tolerance() {
        // A chord of 2 mm of a circle of radius R has the sagitta δ = R − √(R² − 1).
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
            reference_length in (-2.0..3.0f64).prop_map(|e| 10f64.powf(e)),
        ) {
            let [a, b, c, d, e, f] = bounds;
            let shape = Shape {
                first: [[a.min(1.0), b.min(1.0)]; 2],
                second: [[c, d]; 2],
                third: [e, f],
                curvature: c.hypot(d),
            };
            let found = allowable(&shape, &AXES, 400.0, reference_length).unwrap();
            let rows = Inequalities::new(&shape, &AXES);
            let (v, Limits { acceleration, jerk }) = (found.speed, found.limits);
            prop_assert!(v > 0.0 && acceleration > 0.0 && jerk > 0.0, "{found:?} {shape:?}");
            for k in 0..2 {
                let (q1, q2, q3) = (shape.first[0][k], shape.second[0][k], shape.third[k]);
                prop_assert!(q1 * v <= AXES.velocity[0][k] * (1.0 + 1e-12));
                prop_assert!(q2 * v * v + q1 * acceleration <= AXES.acceleration[0][k] * (1.0 + 1e-12));
                prop_assert!(q3 * v.powi(3) + 3.0 * q2 * v * acceleration + q1 * jerk <= AXES.jerk[k] * (1.0 + 1e-12));
            }
            // A scan of V and A.
            let best = time(reference_length, &found);
            for i in 1..40 {
                let speed = rows.most_speed().min(400.0) * f64::from(i) / 40.0;
                for j in 1..40 {
                    let acceleration = rows.most_acceleration(speed) * f64::from(j) / 40.0;
                    let jerk = rows.most_jerk(speed, acceleration);
                    let other = Allowable { speed, limits: Limits { acceleration, jerk } };
                    prop_assert!(time(reference_length, &other) > best * (1.0 - 1e-3), "{found:?} {other:?}");
                }
            }
        }
    }
}
