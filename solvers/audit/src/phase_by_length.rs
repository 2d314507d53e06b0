//! The motion on a phase whose speed is known by the length of the path: at the feed, at constant jerk, v² a cubic of it.
//!
//! Speed v, acceleration a and jerk j along the path come from the length (`speed_by_length`), the length from Kronrod's rule
//! over |C'|. With g = |C'|: g u̇ = v, g ü = a − g' u̇², g u⃛ = j − 3 g' u̇ ü − g'' u̇³; then the velocity is C' u̇, the acceleration
//! C' ü + C'' u̇², and the jerk C' u⃛ + 3 C'' u̇ ü + C''' u̇³.

use std::sync::Arc;

use super::curve::Curve;
use super::phase_time::{gauss, kronrod_halves, MOST_HALVINGS, RULES_AGREE};
use super::speed_by_length::{Pace, SpeedByLength};
use super::vectors::{inner, length, vector_of};
use super::{EPS, ROUNDINGS};

/// Where |C'| is below this share of its size the piece has no direction to speak of.
const STILL: f64 = 1e-6;

/// Halvings until a time is known as closely as its numbers.
const MOST_STEPS: u32 = 53;

/// A vector, and what of it may be rounding.
#[derive(Clone, Copy, Debug)]
pub struct Rounded<const M: usize> {
    pub value: [f64; M],
    pub rounding: [f64; M],
}

/// Velocity, acceleration and jerk of every axis.
#[derive(Clone, Copy, Debug)]
pub struct Rates<const M: usize> {
    pub velocity: Rounded<M>,
    pub acceleration: Rounded<M>,
    pub jerk: Rounded<M>,
    /// Of the path, with its curvature |K| in 1/mm, |dK/ds| in 1/mm², and |C'|.
    pub direction: [f64; M],
    pub curvature: f64,
    pub change_of_curvature: f64,
    pub slope: f64,
}

/// An interval on which the rule is good: the distance of its start from the anchor and the length up to there, and the same of
/// its middle.
#[derive(Clone, Copy)]
struct Measured {
    start: [f64; 2],
    middle: [f64; 2],
}

/// A place of a phase: u, the length from the anchor, and the motion along the path.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub u: f64,
    pub way: f64,
    pub pace: Pace,
}

/// By how much, at most, rates between two places may differ as vectors from those at the nearer one, and the curvature too;
/// and the greatest speed along the path.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    pub velocity: f64,
    pub acceleration: f64,
    pub jerk: f64,
    pub curvature: f64,
    pub most_speed: f64,
}

/// A phase ready to be evaluated at any u.
#[derive(Clone)]
pub struct PhaseByLength<const M: usize> {
    curve: Arc<Curve<M>>,
    /// What each axis counts in the length.
    scale: [f64; M],
    u: [f64; 2],
    anchored_at_end: bool,
    duration: f64,
    speed: SpeedByLength,
    /// Where the rule is good, in order, and the distance of the last end from the anchor and the length up to there.
    measured: Vec<Measured>,
    whole: [f64; 2],
}

impl<const M: usize> PhaseByLength<M> {
    /// Between two parameters, with the speed that `speed` makes of the whole length; lengths and times count from the anchor.
    pub fn new(
        curve: Arc<Curve<M>>,
        scale: [f64; M],
        u: [f64; 2],
        anchored_at_end: bool,
        duration: f64,
        speed: impl FnOnce(f64) -> SpeedByLength,
    ) -> Self {
        let nothing = SpeedByLength::Constant { speed: 0.0 };
        let (measured, whole) = (Vec::with_capacity(1), [0.0; 2]);
        let mut phase = Self { curve, scale, u, anchored_at_end, duration, speed: nothing, measured, whole };
        phase.measure(0.0, u[1] - u[0], &mut { MOST_HALVINGS });
        phase.speed = speed(phase.whole[1]);
        phase
    }

    /// |C'| at a distance from the anchor, as the axes count.
    fn slope(&self, d: f64) -> f64 {
        let tangent = self.curve.derivative(if self.anchored_at_end { self.u[1] - d } else { self.u[0] + d });
        length(&vector_of::<M>(|k| self.scale[k] * tangent[k]))
    }

    /// Adds the lengths of parts between two distances from the anchor.
    fn measure(&mut self, from: f64, to: f64, halvings: &mut u32) {
        let ([fine, doubt], half) = kronrod_halves(|d| self.slope(d), from, to);
        let middle = 0.5 * (from + to);
        let good = doubt.abs() <= RULES_AGREE * fine;
        if good || *halvings == 0 || !(from < middle && middle < to) {
            let before = self.whole[1];
            self.measured.push(Measured { start: [from, before], middle: [middle, before + half] });
            self.whole = [to, before + fine];
            return;
        }
        *halvings -= 1;
        self.measure(from, middle, halvings);
        self.measure(middle, to, halvings);
    }

    /// The place at u.
    pub fn place(&self, u: f64) -> Place {
        let d = if self.anchored_at_end { self.u[1] - u } else { u - self.u[0] };
        let row = self.measured.partition_point(|interval| interval.start[0] <= d).max(1) - 1;
        let Measured { start, middle } = self.measured[row];
        let [from, before] = if d < middle[0] - EPS * self.u[1] { start } else { middle };
        let way = if d >= self.whole[0] {
            self.whole[1]
        } else if d > from + EPS * self.u[1] {
            // On half of an interval Gauss's rule is closer than it was on the whole one.
            before + gauss(|d| self.slope(d), from, d)
        } else {
            before
        };
        let mut pace = self.speed.pace(way);
        if self.anchored_at_end {
            pace.a = -pace.a;
        }
        Place { u, way, pace }
    }

    /// Time since the start of the phase at a place.
    pub fn since(&self, place: &Place) -> f64 {
        let time = self.speed.time(place.way);
        if self.anchored_at_end {
            self.duration - time
        } else {
            time
        }
    }

    /// Whether an axis moves anywhere on the piece.
    pub fn moves(&self, axis: usize) -> bool {
        self.curve.derivative_size()[axis] > 0.0
    }

    /// Whether the speed is constant.
    pub fn is_steady(&self) -> bool {
        matches!(self.speed, SpeedByLength::Constant { .. })
    }

    /// Velocity of every axis at a place.
    pub fn velocity(&self, place: &Place) -> [f64; M] {
        let tangent = self.curve.derivative(place.u);
        let size = length(&tangent);
        vector_of(|k| if size > 0.0 { tangent[k] / size * place.pace.v } else { 0.0 })
    }

    /// Time of the whole phase by its law.
    pub fn time(&self) -> f64 {
        self.speed.time(self.whole[1])
    }

    /// u at a time since the start of the phase.
    pub fn place_at(&self, time: f64) -> f64 {
        let [mut low, mut high] = self.u;
        for _ in 0..MOST_STEPS {
            let middle = 0.5 * (low + high);
            if self.since(&self.place(middle)) < time {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// Velocity, acceleration and jerk at a place, where all axes count as they are; none where the piece has no direction.
    pub fn rates(&self, place: &Place) -> Option<Rates<M>> {
        let pace = place.pace;
        rates(&self.curve, place.u, pace).map(|mut rates| {
            // Where the length is rounded v is another one.
            let way_rounding = EPS * self.curve.width() * rates.slope;
            let gained = pace.a.abs() * way_rounding;
            let speed_rounding = gained / (pace.v + gained.sqrt());
            if speed_rounding > 0.0 {
                for k in 0..M {
                    rates.velocity.rounding[k] +=
                        ROUNDINGS * speed_rounding * (rates.velocity.value[k] / pace.v).abs().min(1.0);
                }
            }
            rates
        })
    }

    /// What differs between two places in the order of travel, where |C'| is known.
    ///
    /// With T the direction and K = dT/ds the velocity is T v, the acceleration T a + K v², the jerk T j + 3 K v a + K' v³.
    /// K and its derivatives are bounded by those of C: C'' = g² K + g' T, C''' = g³ K' + 3 g g' K + g'' T,
    /// C'''' = g⁴ K'' + 6 g² g' K' + (4 g g'' + 3 g'²) K + g''' T, |g'| ≤ |C''|, and so on.
    pub fn change_at_most(&self, [from, to]: [&Place; 2], known: [&Rates<M>; 2]) -> Change {
        let [m2, m3, m4] = self.curve.bounds();
        let half = 0.5 * (to.u - from.u);
        let most_known = |of: fn(&Rates<M>) -> f64| of(known[0]).max(of(known[1]));
        let g = known[0].slope.min(known[1].slope) - m2 * half;
        let [v, a, j] = self.speed.ranges([&from.pace, &to.pace], (to.way - from.way).abs());
        if g.is_nan() || g <= 0.0 {
            let wide = f64::INFINITY;
            return Change {
                velocity: wide,
                acceleration: wide,
                jerk: wide,
                curvature: wide,
                most_speed: v[1],
            };
        }
        // Roughly from the bounds alone for the second derivative of K; by that from both places for the others.
        let k = m2 / (g * g);
        let dg2 = m3 + m2 * m2 / g;
        let dk = (m3 + 3.0 * g * m2 * k + dg2) / (g * g * g);
        let dg3 = m4 + 3.0 * m2 * m3 / g + 3.0 * m2 * m2 * m2 / (g * g);
        let ddk = (m4 + 6.0 * g * g * m2 * dk + (4.0 * g * dg2 + 3.0 * m2 * m2) * k + dg3) / (g * g * g * g);
        let way = half * (most_known(|rates| rates.slope) + m2 * half);
        let dk = dk.min(most_known(|rates| rates.change_of_curvature) + ddk * way);
        let k = k.min(most_known(|rates| rates.curvature) + dk * way);
        let [change_v, change_a, change_j] = [v, a, j].map(|[least, most]| most - least);
        let [most_a, most_j] = [a, j].map(|[least, most]| most.max(-least));
        let [least_v, most_v] = v;
        let (square, cube) = (most_v * most_v, most_v * most_v * most_v);
        Change {
            velocity: k * way * most_v + change_v,
            acceleration: way * (k * most_a + dk * square) + change_a + k * (square - least_v * least_v),
            jerk: way * (k * most_j + 3.0 * dk * most_v * most_a + ddk * cube)
                + change_j
                + 3.0 * k * (most_v * change_a + most_a * change_v)
                + dk * (cube - least_v * least_v * least_v),
            curvature: dk * way,
            most_speed: most_v,
        }
    }
}

/// The motion at a place of a piece; none where that has no direction.
pub fn rates<const M: usize>(curve: &Curve<M>, u: f64, pace: Pace) -> Option<Rates<M>> {
    let [first, second, third] = curve.derivatives(u);
    let [size1, size2, size3] = curve.derivative_sizes();
    let g = length(&first);
    if g.is_nan() || g <= STILL * length(&size1) {
        return None;
    }
    let direction = vector_of::<M>(|k| first[k] / g);
    let (along2, along3) = (inner(&direction, &second), inner(&direction, &third));
    let across: [f64; M] = vector_of(|k| second[k] - along2 * direction[k]);
    let du = pace.v / g;
    let ddu = (pace.a - along2 * du * du) / g;
    let turned = inner(&across, &across) / g;
    let taken = turned * du.powi(3);
    let dddu = (pace.j - taken - du * (3.0 * along2 * ddu + along3 * du * du)) / g;
    // What is rounded in C', C'' and C''' is felt in ü and u⃛ as well.
    let (most1, most2, most3) = (length(&size1), length(&size2), length(&size3));
    let felt = most1 / g;
    let most_ddu = felt * (pace.a.abs() + most2 * du * du) / g;
    let most_dddu = felt
        * (pace.j.abs()
            + felt * most2 * most2 / g * du.powi(3)
            + du * (3.0 * most2 * most_ddu + most3 * du * du))
        / g;
    let unit = ROUNDINGS * EPS;
    let velocity = Rounded {
        value: vector_of(|k| first[k] * du),
        rounding: vector_of(|k| unit * (size1[k] * du + first[k].abs() * felt * du)),
    };
    let acceleration = Rounded {
        value: vector_of(|k| first[k] * ddu + second[k] * du * du),
        rounding: vector_of(|k| {
            unit * (size1[k] * ddu.abs() + first[k].abs() * most_ddu + size2[k] * felt * du * du)
        }),
    };
    let jerk = Rounded {
        value: vector_of(|k| first[k] * dddu + du * (3.0 * second[k] * ddu + third[k] * du * du)),
        rounding: vector_of(|k| {
            let inside =
                3.0 * (size2[k] * ddu.abs() + second[k].abs() * most_ddu) + size3[k] * felt * du * du;
            unit * (size1[k] * dddu.abs() + first[k].abs() * most_dddu + du * inside)
        }),
    };
    let change: [f64; M] =
        vector_of(|k| third[k] - 3.0 * along2 / g * across[k] - (along3 + turned) * direction[k]);
    Some(Rates {
        velocity,
        acceleration,
        jerk,
        direction,
        curvature: length(&across) / (g * g),
        change_of_curvature: length(&change) / (g * g * g),
        slope: g,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Quadratic;
    use crate::vectors::distance;

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
        let found = rates(&curve, 1.0, Pace { v, a, j }).unwrap();
        assert!(distance(&found.velocity.value, &velocity) < 1e-14, "{:?}", found.velocity);
        assert!(distance(&found.acceleration.value, &acceleration) < 1e-13, "{:?}", found.acceleration);
        assert!(distance(&found.jerk.value, &jerk) < 1e-13, "{:?}", found.jerk);
        assert!(length(&found.jerk.rounding) < 1e-11, "{:?}", found.jerk);
    }

    #[test]
    fn at_rest_where_the_tangent_vanishes_the_length_starts_with_the_cube_of_the_time() {
        // x = u³ by s = t³: u̇ = 1, but at u = 0 both v and C' vanish.
        let points = [[0.0; 2], [0.0; 2], [0.0; 2], [1.0, 0.0]];
        let curve = Arc::new(Curve::general(crate::polygon::Polygon::new(points.into_iter(), &[]), 1.0));
        let start = Pace { v: 0.0, a: 0.0, j: 6.0 };
        let speed = |_| SpeedByLength::Jerk { start, duration: 1.0 };
        let phase = PhaseByLength::new(curve, [1.0; 2], [0.0, 1.0], false, 1.0, speed);
        for u in [0.01, 0.5, 1.0] {
            let place = phase.place(u);
            let (time, v) = (phase.since(&place), place.pace.v);
            assert!((time - u).abs() < 1e-14 && (v - 3.0 * u * u).abs() < 1e-13, "{u}");
        }
        assert_eq!(phase.place(0.0).pace.v, 0.0);
        assert!((phase.place_at(0.3) - 0.3).abs() < 1e-14);
    }

    #[test]
    fn nothing_between_two_places_changes_more_than_its_bound() {
        let points = [[0.0, 0.0], [1.0, 0.3], [2.0, 0.9], [3.2, 0.8], [4.0, 0.1], [5.0, 0.4]];
        let curve = Arc::new(Curve::general(crate::polygon::Polygon::new(points.into_iter(), &[]), 5.0));
        let speeds: [fn(f64) -> SpeedByLength; 4] = [
            |_| SpeedByLength::Constant { speed: 3.0 },
            |length| SpeedByLength::cubic([9.0, 4.0], [1.0, 2.0], length),
            |length| SpeedByLength::cubic([1.0, 9.0], [3.0, -1.0], length),
            |_| SpeedByLength::Jerk { start: Pace { v: 3.0, a: -2.0, j: 1.0 }, duration: 2.5 },
        ];
        for (speed, anchored_at_end) in speeds.into_iter().flat_map(|speed| [(speed, false), (speed, true)]) {
            let phase = PhaseByLength::new(curve.clone(), [1.0; 2], [0.0, 5.0], anchored_at_end, 2.5, speed);
            let at = |u: f64| {
                let place = phase.place(u);
                (place, phase.rates(&place).unwrap())
            };
            for i in 0..20 {
                let [from, to] = [i, i + 1].map(|i| 0.25 * f64::from(i));
                let ((first, near), (last, far)) = (at(from), at(to));
                let bound = phase.change_at_most([&first, &last], [&near, &far]);
                for share in [0.1, 0.3, 0.5] {
                    let (place, there) = at(from + share * (to - from));
                    assert!(place.pace.v <= bound.most_speed * (1.0 + 1e-12));
                    assert!(distance(&near.velocity.value, &there.velocity.value) <= bound.velocity);
                    assert!(
                        distance(&near.acceleration.value, &there.acceleration.value) <= bound.acceleration
                    );
                    assert!(distance(&near.jerk.value, &there.jerk.value) <= bound.jerk);
                    assert!((near.curvature - there.curvature).abs() <= bound.curvature);
                }
            }
        }
    }
}
