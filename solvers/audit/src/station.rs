//! A place of a path by the length s along it: dq/ds, d²q/ds² and d³q/ds³ of all axes, and from them their velocities,
//! accelerations and jerks at a speed v, an acceleration a and a jerk j along the path.
//!
//! q̇ = q_s v, q̈ = q_s a + q_ss v², q⃛ = q_s j + 3 q_ss v a + q_sss v³. On a curve C(u) with g = |C'|, the unit tangent
//! T = C'/g and ₜ for the part along T: q_s = T, q_ss = (C'' − C''ₜ T)/g², and
//! q_sss = (C''' − 3 C''ₜ/g (C'' − C''ₜ T) − (C'''ₜ + |C'' − C''ₜ T|²/g) T)/g³.

use super::curve::Curve;
use super::joints::formula::Jet;
use super::number::{inner, kept, scaled, Lanes, Number};
use super::speed_by_length::Pace;
use super::vectors::vector_of;
use super::{EPS, ROUNDINGS};

/// If |C'| is not above this share of its magnitude (`Curve::size_length`), the piece has no usable direction.
pub const STILL: f64 = 1e-6;

/// A vector, and bounds of the rounding errors of its numbers.
#[derive(Clone, Copy, Debug)]
pub struct Rounded<const M: usize, T = f64> {
    pub value: [T; M],
    pub rounding: [T; M],
}

/// A place of a piece, or several in lanes: positions of the columns and their derivatives by u, each with an error bound. That
/// of a position comes on top of the rounding of the greatest coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Place<const M: usize, T = f64> {
    pub piece: usize,
    pub u: T,
    /// Position of the tool, in axes of the path.
    pub tip: [T; M],
    pub position: Rounded<M, T>,
    pub slope: Rounded<M, T>,
    /// Derivatives by u of the length of the path, and of the length that the feed of the tool limits.
    pub way_slope: T,
    pub tip_slope: T,
}

impl<const M: usize, T: Number> Place<M, T> {
    #[inline(always)]
    pub fn kept(self) -> Place<M, T::Kept> {
        Place {
            piece: self.piece,
            u: self.u.kept(),
            tip: kept(self.tip),
            position: self.position.kept(),
            slope: self.slope.kept(),
            way_slope: self.way_slope.kept(),
            tip_slope: self.tip_slope.kept(),
        }
    }
}

impl<const M: usize> Station<M, Lanes> {
    /// The station in one lane.
    pub fn of_lane(&self, lane: usize) -> Station<M> {
        Station {
            u: self.u[lane],
            slope: self.slope[lane],
            first: self.first.map(|of| of[lane]),
            second: self.second.map(|of| of[lane]),
            third: self.third.map(|of| of[lane]),
            tip: self.tip[lane],
            curvature: self.curvature[lane],
        }
    }
}

impl<const M: usize> Roundings<M, Lanes> {
    /// The bounds in one lane.
    pub fn of_lane(&self, lane: usize) -> Roundings<M> {
        let [first, second, third] =
            [&self.first, &self.second, &self.third].map(|row| row.map(|of| of[lane]));
        Roundings { first, second, third }
    }
}

impl<const M: usize> Place<M, Lanes> {
    /// The place in one lane.
    pub fn of_lane(&self, lane: usize) -> Place<M> {
        Place {
            piece: self.piece,
            u: self.u[lane],
            tip: self.tip.map(|of| of[lane]),
            position: self.position.of_lane(lane),
            slope: self.slope.of_lane(lane),
            way_slope: self.way_slope[lane],
            tip_slope: self.tip_slope[lane],
        }
    }
}

impl<const M: usize> Rounded<M, Lanes> {
    /// The vector in one lane.
    pub fn of_lane(&self, lane: usize) -> Rounded<M> {
        Rounded { value: self.value.map(|of| of[lane]), rounding: self.rounding.map(|of| of[lane]) }
    }
}

impl<const M: usize, T: Number> Rounded<M, T> {
    #[inline(always)]
    pub fn kept(self) -> Rounded<M, T::Kept> {
        Rounded { value: kept(self.value), rounding: kept(self.rounding) }
    }
}

/// The derivatives of the columns by the length at a place, which do not depend on the speed; or at several places in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Station<const M: usize, T = f64> {
    pub u: T,
    /// ds/du.
    pub slope: T,
    pub first: [T; M],
    pub second: [T; M],
    pub third: [T; M],
    /// The speed of the tool that feeds limit, over the speed along the path; and the curvature of the tool's path in 1/mm.
    pub tip: T,
    pub curvature: T,
}

/// Bounds of the rounding errors of the derivatives at a station. They take as long to compute as the derivatives, and are
/// computed only where these come near a limit.
#[derive(Clone, Copy, Debug)]
pub struct Roundings<const M: usize, T = f64> {
    first: [T; M],
    second: [T; M],
    third: [T; M],
}

impl<const M: usize> Station<M> {
    /// The place u of a piece; None where the piece has no direction.
    pub fn new(curve: &Curve<M>, u: f64) -> Option<Self> {
        Self::by(curve, u, &curve.derivatives(u))
    }

    /// The place u, from derivatives by u that are known already; None where the piece has no direction.
    #[inline(always)]
    pub fn by(curve: &Curve<M>, u: f64, derivatives: &[[f64; M]; 3]) -> Option<Self> {
        let station = Self::anywhere(u, derivatives);
        (station.slope > STILL * curve.size_length()).then_some(station)
    }

    pub fn jerk(&self, Pace { v, a, j }: Pace) -> [f64; M] {
        let (mixed, cube) = (3.0 * v * a, v * v * v);
        vector_of(|k| self.first[k] * j + self.second[k] * mixed + self.third[k] * cube)
    }
}

impl<const M: usize, T: Number> Station<M, T> {
    /// For joints, from their first three derivatives by u, and g with its first two:
    /// q_s = q_u/g, q_ss = (q_uu − q_u g_u/g)/g², q_sss = (q_uuu − 3 q_uu g_u/g + q_u (3 g_u²/g² − g_uu/g))/g³.
    #[inline(always)]
    pub fn of_joints(
        u: T,
        [q1, q2, q3]: [&[T; M]; 3],
        [g, dg, ddg]: [T; 3],
        [tip, curvature]: [T; 2],
    ) -> Self {
        let per = u.filled(1.0) / g;
        let turn = dg * per;
        let bend = turn * 3.0 * turn - ddg * per;
        let (per2, per3) = (per * per, per * per * per);
        let mut station = Self { u, slope: g, tip, curvature, first: *q1, second: *q2, third: *q3 };
        for k in 0..M {
            station.first[k] = per * q1[k];
            station.second[k] = per2 * (q2[k] - q1[k] * turn);
            station.third[k] = per3 * (q3[k] - q2[k] * 3.0 * turn + q1[k] * bend);
        }
        station
    }

    /// From the first three derivatives of C by u, whether or not the piece has a direction there.
    #[inline(always)]
    pub fn anywhere(u: T, [c1, c2, c3]: &[[T; M]; 3]) -> Self {
        let (g, one) = (inner(c1, c1).root(), u.filled(1.0));
        let per = one / g;
        let (per2, per3) = (per * per, per * per * per);
        let (mut direction, mut across, mut second, mut third) = (*c1, *c1, *c1, *c1);
        for k in 0..M {
            direction[k] = c1[k] * per;
        }
        let (along2, along3) = (inner(&direction, c2), inner(&direction, c3));
        for k in 0..M {
            across[k] = c2[k] - along2 * direction[k];
        }
        let turned = inner(&across, &across) * per;
        let bent = along2 * 3.0 * per;
        for k in 0..M {
            second[k] = across[k] * per2;
            third[k] = (c3[k] - bent * across[k] - (along3 + turned) * direction[k]) * per3;
        }
        let curvature = inner(&across, &across).root() * per2;
        Self { u, slope: g, tip: one, curvature, first: direction, second, third }
    }

    #[inline(always)]
    pub fn kept(self) -> Station<M, T::Kept> {
        Station {
            u: self.u.kept(),
            slope: self.slope.kept(),
            first: kept(self.first),
            second: kept(self.second),
            third: kept(self.third),
            tip: self.tip.kept(),
            curvature: self.curvature.kept(),
        }
    }

    #[inline(always)]
    pub fn velocity(&self, v: T) -> [T; M] {
        scaled(self.first, v)
    }

    #[inline(always)]
    pub fn acceleration(&self, Pace { v, a, .. }: Pace<T>) -> [T; M] {
        combined([&self.first, &self.second], [a, v * v])
    }
}

impl<const M: usize, T: Number> Roundings<M, T> {
    #[inline(always)]
    pub fn kept(self) -> Roundings<M, T::Kept> {
        Roundings { first: kept(self.first), second: kept(self.second), third: kept(self.third) }
    }

    /// For joints, from their first three derivatives by u, and g with its first two, each with an error bound. If a derivative
    /// is not known, its rounding is `f64::MAX`.
    #[inline(always)]
    pub fn of_joints([_, first, second, third]: &[Rounded<M, T>; 4], way: &Jet<3, 3, T>) -> Self {
        let ([g, dg, ddg], [_, dg_error, ddg_error]) = (way.value, way.error);
        let per = g.filled(1.0) / g;
        let (turn, turn_error) = (dg * per, dg_error * EPS * per);
        let size = turn * 3.0 * turn + ddg.size() * per;
        let bend_error = turn.size() * 6.0 * turn_error + ddg_error * EPS * per;
        let unit = 2.0 * ROUNDINGS * EPS;
        let turn_size = turn.size();
        let mut roundings = Self { first: first.value, second: second.value, third: third.value };
        for k in 0..M {
            let [q1, q2, q3] = [first.value[k].size(), second.value[k].size(), third.value[k].size()];
            let [e1, e2, e3] = [first.rounding[k], second.rounding[k], third.rounding[k]];
            let found = per * (e1 + q1 * unit);
            roundings.first[k] = found.where_finite(found, f64::MAX);
            let wrong = e2 + e1 * turn_size + q1 * turn_error;
            let found = per * per * (wrong + (q2 + q1 * turn_size) * unit);
            roundings.second[k] = found.where_finite(found, f64::MAX);
            let wrong = e3 + (e2 * turn_size + q2 * turn_error) * 3.0;
            let terms = q3 + q2 * 3.0 * turn_size + q1 * size;
            let found = per * per * per * (wrong + e1 * size + q1 * bend_error + terms * unit);
            roundings.third[k] = found.where_finite(found, f64::MAX);
        }
        roundings
    }

    /// At a station of a curve with these derivatives by u. Rounding errors of C', C'' and C''' also enter through g and its
    /// derivatives.
    #[inline(always)]
    pub fn new(curve: &Curve<M>, station: &Station<M, T>, [c1, c2, c3]: &[[T; M]; 3]) -> Self {
        let [size1, size2, size3] = &curve.derivative_sizes_at(station.u);
        let [most1, most2, most3] = [size1, size2, size3].map(|size| inner(size, size).root());
        let (per, direction) = (station.slope.filled(1.0) / station.slope, &station.first);
        let (per2, per3) = (per * per, per * per * per);
        let (along2, along3) = (inner(direction, c2), inner(direction, c3));
        let mut across = *c2;
        for k in 0..M {
            across[k] = c2[k] - along2 * direction[k];
        }
        let turned = inner(&across, &across) * per;
        let bent = along2 * 3.0 * per;
        let felt = per * most1;
        let felt2 = felt * felt;
        let along = along2.size() * per;
        let of_change = (turned + (bent * along2).size() + along3.size()) * per;
        let most_change = felt * (felt * most2 * most2 * 4.0 * per + most3);
        let unit = ROUNDINGS * EPS;
        let (unit1, unit2, unit3) = (per * unit, per2 * unit, per3 * unit);
        let mut roundings = Self { first: *c1, second: *c1, third: *c1 };
        for k in 0..M {
            roundings.first[k] = unit1 * (c1[k].size() * felt + size1[k]);
            let taken = along * size1[k] + felt2 * direction[k].size() * most2;
            roundings.second[k] = unit2 * (taken + felt * (c2[k].size() + size2[k]));
            let taken = of_change * size1[k] + direction[k].size() * most_change;
            let inside = along * size2[k] + c2[k].size() * felt * most2 * per;
            roundings.third[k] = unit3 * (taken + inside * 3.0 + felt * size3[k]);
        }
        roundings
    }

    #[inline(always)]
    pub fn velocity(&self, v: T) -> [T; M] {
        scaled(self.first, v)
    }

    #[inline(always)]
    pub fn acceleration(&self, Pace { v, a, .. }: Pace<T>) -> [T; M] {
        combined([&self.first, &self.second], [a.size(), v * v])
    }
}

impl<const M: usize> Roundings<M> {
    pub fn jerk(&self, Pace { v, a, j }: Pace) -> [f64; M] {
        let (size, mixed, cube) = (j.abs(), (3.0 * v * a).abs(), v * v * v);
        vector_of(|k| self.first[k] * size + self.second[k] * mixed + self.third[k] * cube)
    }
}

/// The sum of two vectors times their factors.
#[inline(always)]
fn combined<const M: usize, T: Number>([a, b]: [&[T; M]; 2], [by_a, by_b]: [T; 2]) -> [T; M] {
    let mut sum = *a;
    for k in 0..M {
        sum[k] = a[k] * by_a + b[k] * by_b;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::Polygon;
    use crate::vectors::{distance, length};

    #[test]
    fn on_a_parabola_acceleration_and_jerk_are_those_of_its_parameter() {
        // C = (x, x²/2) with x = 1 + 2 t + 3 t² + 4 t³ at t = 0, where ẋ = 2, ẍ = 6, x⃛ = 24: v = √2 ẋ at x = 1.
        let curve = Curve::new(Polygon::new([[0.0, 0.0], [1.0, 0.0], [2.0, 2.0]].into_iter(), &[]), 2.0);
        let [dx, ddx, dddx] = [2.0, 6.0, 24.0];
        let velocity: [f64; 2] = [dx, dx];
        let acceleration: [f64; 2] = [ddx, ddx + dx * dx];
        let jerk: [f64; 2] = [dddx, dddx + 3.0 * dx * ddx];
        // v² = q̇·q̇, v a = q̇·q̈, a² + v j = q̈·q̈ + q̇·q⃛.
        let v = length(&velocity);
        let a = inner(&velocity, &acceleration) / v;
        let j = (inner(&acceleration, &acceleration) + inner(&velocity, &jerk) - a * a) / v;
        let (pace, station) = (Pace { v, a, j }, Station::new(&curve, 1.0).unwrap());
        assert!(distance(&station.velocity(v), &velocity) < 1e-14);
        assert!(distance(&station.acceleration(pace), &acceleration) < 1e-13);
        assert!(distance(&station.jerk(pace), &jerk) < 1e-13, "{:?}", station.jerk(pace));
        let roundings = Roundings::new(&curve, &station, &curve.derivatives(1.0));
        let least = distance(&station.jerk(pace), &jerk).max(EPS * length(&jerk));
        assert!((least..1e-11).contains(&length(&roundings.jerk(pace))), "{roundings:?}");
    }

    #[test]
    fn roundings_of_a_turn_are_relative_to_the_steps_beside_it_and_not_to_the_longest_one() {
        // Beside the end the steps are 1e-5 of the first ones, and turn by 1e-4 rad.
        let steps = [[0.3, 0.2], [0.7, 0.5], [7e-6, 5.001e-6], [7e-6, 5.001e-6], [7e-6, 5.001e-6]];
        let mut points = vec![[0.0; 2]];
        for [x, y] in steps {
            let [from_x, from_y] = points[points.len() - 1];
            points.push([from_x + x, from_y + y]);
        }
        let curve = Curve::new(Polygon::new(points.into_iter(), &[]), 1.0);
        let derivatives = curve.derivatives(0.97);
        let station = Station::anywhere(0.97, &derivatives);
        let roundings = Roundings::new(&curve, &station, &derivatives);
        for (of, rounding) in [(station.second, roundings.second), (station.third, roundings.third)] {
            let share = length(&rounding) / length(&of);
            assert!((1e-14..1e-8).contains(&share), "{share}");
        }
    }
}
