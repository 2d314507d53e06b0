//! The motion on a phase whose speed is known by the length of the path: at the feed, at constant jerk, v² a cubic of it.
//!
//! Speed v, acceleration a and jerk j along the path come from the length (`speed_by_length`), the length from Kronrod's rule
//! over |C'|. With g = |C'|: g u̇ = v, g ü = a − g' u̇², g u⃛ = j − 3 g' u̇ ü − g'' u̇³; then the velocity is C' u̇, the acceleration
//! C' ü + C'' u̇², and the jerk C' u⃛ + 3 C'' u̇ ü + C''' u̇³.

use std::rc::Rc;

use super::curve::{inner, length, vector_of, Curve};
use super::phase_time::{kronrod, MOST_HALVINGS, RULES_AGREE};
use super::speed_by_length::{Pace, SpeedByLength};
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
    /// Curvature in 1/mm, and |C'|.
    pub curvature: f64,
    pub slope: f64,
}

/// A phase ready to be evaluated at any u.
#[derive(Clone)]
pub struct PhaseByLength<const M: usize> {
    curve: Rc<Curve<M>>,
    u: [f64; 2],
    anchored_at_end: bool,
    duration: f64,
    speed: SpeedByLength,
    /// Distances of u from the anchor, and lengths up to there, between which the rule is good.
    lengths: Vec<[f64; 2]>,
}

impl<const M: usize> PhaseByLength<M> {
    /// Between two parameters, with the speed that `speed` makes of the whole length; lengths and times count from the anchor.
    pub fn new(
        curve: Rc<Curve<M>>,
        u: [f64; 2],
        anchored_at_end: bool,
        duration: f64,
        speed: impl FnOnce(f64) -> SpeedByLength,
    ) -> Self {
        let nothing = SpeedByLength::Constant { speed: 0.0 };
        let mut phase = Self { curve, u, anchored_at_end, duration, speed: nothing, lengths: vec![[0.0; 2]] };
        phase.measure(0.0, u[1] - u[0], &mut { MOST_HALVINGS });
        phase.speed = speed(phase.length());
        phase
    }

    fn length(&self) -> f64 {
        self.lengths[self.lengths.len() - 1][1]
    }

    /// The length between two distances from the anchor, and its doubt.
    fn length_between(&self, from: f64, to: f64) -> [f64; 2] {
        let [u0, u1] = self.u;
        let at = |d: f64| if self.anchored_at_end { u1 - d } else { u0 + d };
        kronrod(|d| length(&self.curve.derivative(at(d))), from, to)
    }

    /// Adds the lengths of parts between two distances from the anchor.
    fn measure(&mut self, from: f64, to: f64, halvings: &mut u32) {
        let [fine, doubt] = self.length_between(from, to);
        let middle = 0.5 * (from + to);
        let good = doubt.abs() <= RULES_AGREE * fine;
        if good || *halvings == 0 || !(from < middle && middle < to) {
            self.lengths.push([to, self.length() + fine]);
            return;
        }
        *halvings -= 1;
        self.measure(from, middle, halvings);
        self.measure(middle, to, halvings);
    }

    /// Time since the start of the phase at u, and the motion along the path there.
    pub fn passage(&self, u: f64) -> (f64, Pace) {
        let d = if self.anchored_at_end { self.u[1] - u } else { u - self.u[0] };
        let last = self.lengths.len() - 1;
        let row = self.lengths[..last].partition_point(|row| row[0] <= d).max(1) - 1;
        let [from, way] = self.lengths[row];
        let way = if d >= self.lengths[last][0] {
            self.length()
        } else if d > from {
            way + self.length_between(from, d)[0]
        } else {
            way
        };
        let (time, pace) = self.speed.after(way);
        if self.anchored_at_end {
            (self.duration - time, Pace { a: -pace.a, ..pace })
        } else {
            (time, pace)
        }
    }

    /// C' at u.
    pub fn tangent(&self, u: f64) -> [f64; M] {
        self.curve.derivative(u)
    }

    /// Time of the whole phase by its law.
    pub fn time(&self) -> f64 {
        self.speed.after(self.length()).0
    }

    /// u at a time since the start of the phase.
    pub fn place_at(&self, time: f64) -> f64 {
        let [mut low, mut high] = self.u;
        for _ in 0..MOST_STEPS {
            let middle = 0.5 * (low + high);
            if self.passage(middle).0 < time {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }

    /// The speed, where it is constant.
    pub fn constant_speed(&self) -> Option<f64> {
        match self.speed {
            SpeedByLength::Constant { speed } => Some(speed),
            _ => None,
        }
    }

    /// Velocity, acceleration and jerk at u; none where the piece has no direction.
    pub fn rates(&self, u: f64, pace: Pace) -> Option<Rates<M>> {
        rates(&self.curve, u, pace).map(|mut rates| {
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

    /// By how much velocity, acceleration and jerk at constant speed may differ, as vectors, from those at the nearer one of
    /// two places, and the curvature too.
    ///
    /// K = dT/ds and its derivatives from bounds of those of C: C'' = g² K + g' T, C''' = g³ K' + 3 g g' K + g'' T,
    /// C'''' = g⁴ K'' + 6 g² g' K' + (4 g g'' + 3 g'²) K + g''' T, |g'| ≤ |C''|, and so on.
    pub fn change_at_most(&self, speed: f64, from: f64, to: f64) -> [f64; 4] {
        let [m2, m3, m4] = self.curve.bounds();
        let half = 0.5 * (to - from);
        let ends = [from, to].map(|u| length(&self.curve.derivative(u)));
        let g = ends[0].min(ends[1]) - m2 * half;
        if g.is_nan() || g <= 0.0 {
            return [f64::INFINITY; 4];
        }
        let k = m2 / (g * g);
        let dg2 = m3 + m2 * m2 / g;
        let dk = (m3 + 3.0 * g * m2 * k + dg2) / g.powi(3);
        let dg3 = m4 + 3.0 * m2 * m3 / g + 3.0 * m2.powi(3) / (g * g);
        let ddk = (m4 + 6.0 * g * g * m2 * dk + (4.0 * g * dg2 + 3.0 * m2 * m2) * k + dg3) / g.powi(4);
        let way = half * (ends[0].max(ends[1]) + m2 * half);
        [k * speed * way, dk * speed.powi(2) * way, ddk * speed.powi(3) * way, dk * way]
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
    let taken = inner(&across, &across) / g * du.powi(3);
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
    Some(Rates { velocity, acceleration, jerk, curvature: length(&across) / (g * g), slope: g })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{distance, Quadratic};

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
        let curve = Rc::new(Curve::general(crate::polygon::Polygon::new(points.into_iter(), &[]), 1.0));
        let start = Pace { v: 0.0, a: 0.0, j: 6.0 };
        let speed = |_| SpeedByLength::Jerk { start, duration: 1.0 };
        let phase = PhaseByLength::new(curve, [0.0, 1.0], false, 1.0, speed);
        for u in [0.01, 0.5, 1.0] {
            let (time, pace) = phase.passage(u);
            assert!((time - u).abs() < 1e-14 && (pace.v - 3.0 * u * u).abs() < 1e-13, "{u}");
        }
        assert_eq!(phase.passage(0.0).1.v, 0.0);
        assert!((phase.place_at(0.3) - 0.3).abs() < 1e-14);
    }

    #[test]
    fn nothing_between_two_places_changes_more_than_its_bound() {
        let points = [[0.0, 0.0], [1.0, 0.3], [2.0, 0.9], [3.2, 0.8], [4.0, 0.1], [5.0, 0.4]];
        let curve = Rc::new(Curve::general(crate::polygon::Polygon::new(points.into_iter(), &[]), 5.0));
        let speed = 3.0;
        let steady = |_| SpeedByLength::Constant { speed };
        let phase = PhaseByLength::new(curve, [0.0, 5.0], false, 1.0, steady);
        let at = |u: f64| phase.rates(u, Pace { v: speed, a: 0.0, j: 0.0 }).unwrap();
        for i in 0..20 {
            let [from, to] = [i, i + 1].map(|i| 0.25 * f64::from(i));
            let [velocity, acceleration, jerk, curvature] = phase.change_at_most(speed, from, to);
            let (near, middle) = (at(from), at(0.5 * (from + to)));
            assert!(distance(&near.velocity.value, &middle.velocity.value) <= velocity);
            assert!(distance(&near.acceleration.value, &middle.acceleration.value) <= acceleration);
            assert!(distance(&near.jerk.value, &middle.jerk.value) <= jerk);
            assert!((near.curvature - middle.curvature).abs() <= curvature);
        }
    }
}
