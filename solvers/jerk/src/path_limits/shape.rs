//! Computes bounds on |q_S|, |q_SS| and |q_SSS| of each axis over a segment of path in Bernstein form, sampled or proven.
//!
//! `sampled` is the method of the thesis (Cheatham 2007, 5.3) and no bound: the derivatives may be greater between its
//! samples, which is how the thesis's own jerk exceeds the limit by up to 40 %. `bounded` encloses the polynomials of
//! `chain_rule` by their Bernstein coefficients and the derivatives by interval arithmetic, and halves the segment
//! until the enclosure is close to the values at samples.

use super::chain_rule::{Number, Shared, Terms};
use feedplan_geometry::interval::Interval;
use feedplan_geometry::polynomial::Polynomial;
use feedplan_planner::problem::{greater, Both};

/// Greatest number of coefficients: N of a rational segment of degree 9 has degree 46.
const MOST: usize = 48;
/// A segment is halved at most this often; bounds that are still wide after that stay wide.
const MAX_DEPTH: u32 = 12;
/// Bounds below this fraction of 1, 1/length and 1/length² (for q_S, q_SS and q_SSS) need not be close.
const FLAT: f64 = 0.1;
/// The error of the coefficients of N, divided by the terms that they are sums of; other coefficients have less.
const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

type Function = Polynomial<MOST>;

/// A segment in Bernstein form, of degree 9 at most.
#[derive(Clone, Copy, Debug)]
pub struct Curve<'a, const M: usize> {
    /// Control points of the joints.
    pub joints: &'a [[f64; M]],
    /// Control points of the tool; None where the axes are those of the tool.
    pub tip: Option<&'a [[f64; 3]]>,
    /// Weights of both; empty where the segment is polynomial.
    pub weight: &'a [f64],
}

/// Bounds on the derivatives of the joints by arc length over a segment; q_S and q_SS have one bound for positive values and one
/// for the absolute value of negative values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape<const M: usize> {
    /// q_S, in 1 or degrees/mm.
    pub first: Both<M>,
    /// q_SS, in 1/mm or degrees/mm².
    pub second: Both<M>,
    /// |q_SSS|, in 1/mm² or degrees/mm³.
    pub third: [f64; M],
    /// Curvature of the tool's path, in 1/mm.
    pub curvature: f64,
}

/// The greatest derivatives at `samples` ≥ 2 equally spaced parameters.
pub fn sampled<const M: usize>(curve: &Curve<M>, samples: usize) -> Shape<M> {
    let part = Part::new(curve);
    let mut shape = Shape::nothing();
    for i in 0..samples {
        shape.include(&part.at(i as f64 / (samples - 1) as f64));
    }
    shape
}

/// Proven bounds that exceed the greatest derivatives by a fraction of about `accuracy`, or by more if the path nearly has a
/// cusp; infinite if it has a cusp.
pub fn bounded<const M: usize>(curve: &Curve<M>, accuracy: f64) -> Shape<M> {
    bounded_until(curve, accuracy, |_| false)
}

/// `bounded`, but with looser bounds on those parts of the segment where they are good `enough`.
pub fn bounded_until<const M: usize>(
    curve: &Curve<M>,
    accuracy: f64,
    enough: impl Fn(&Shape<M>) -> bool,
) -> Shape<M> {
    let part = Part::new(curve);
    let mut seen = part.at(0.0);
    seen.include(&part.at(1.0));
    let length = curve.tip.map_or_else(|| polygon(curve.joints), polygon);
    let mut bound = Shape::nothing();
    let is_met = |all: &Shape<M>, seen: &Shape<M>| enough(all) || all.close(seen, accuracy, 1.0 / length);
    part.enclose(&is_met, 0, &mut seen, &mut bound);
    bound
}

impl<const M: usize> Shape<M> {
    fn nothing() -> Self {
        Self { first: [[0.0; M]; 2], second: [[0.0; M]; 2], third: [0.0; M], curvature: 0.0 }
    }

    /// The absolute values of given derivatives at one point, with curvature 0.
    pub fn of(first: &[f64; M], second: &[f64; M], third: &[f64; M]) -> Self {
        let [first, second] = [first, second].map(|q| {
            let (mut high, mut low) = ([0.0; M], [0.0; M]);
            for k in 0..M {
                [high[k], low[k]] = sizes(Interval::exactly(q[k]));
            }
            [high, low]
        });
        Self { first, second, third: third.map(f64::abs), curvature: 0.0 }
    }

    /// Bounds over this segment and the other one.
    pub fn with(mut self, other: &Self) -> Self {
        self.include(other);
        self
    }

    fn include(&mut self, other: &Self) {
        for k in 0..M {
            for sign in 0..2 {
                self.first[sign][k] = self.first[sign][k].max(other.first[sign][k]);
                self.second[sign][k] = self.second[sign][k].max(other.second[sign][k]);
            }
            self.third[k] = self.third[k].max(other.third[k]);
        }
        self.curvature = self.curvature.max(other.curvature);
    }

    /// Whether these bounds exceed `other` by no more than the fraction `accuracy`. `scale` is 1/length: curvatures that are
    /// small relative to it need not be close.
    fn close(&self, other: &Self, accuracy: f64, scale: f64) -> bool {
        let near = |a: f64, b: f64, unit: f64| a <= b + accuracy * (b + FLAT * unit);
        let [first, second] = [&self.first, &self.second].map(greater);
        let [other_first, other_second] = [&other.first, &other.second].map(greater);
        near(self.curvature, other.curvature, scale)
            && (0..M).all(|k| {
                near(first[k], other_first[k], 1.0)
                    && near(second[k], other_second[k], scale)
                    && near(self.third[k], other.third[k], scale * scale)
            })
    }
}

/// The greatest absolute values of the positive and of the negative values in a range.
fn sizes(range: Interval) -> [f64; 2] {
    [range.hi, -range.lo].map(|size| if size > 0.0 { size } else { 0.0 })
}

/// A polynomial, and the error of its coefficients.
#[derive(Clone, Copy)]
struct Rounded {
    function: Function,
    error: f64,
}

impl Rounded {
    fn derivative(&self) -> Self {
        let degree = self.function.degree() as f64;
        Self { function: self.function.derivative(), error: 2.0 * degree * self.error }
    }

    fn half(&self, right: bool) -> Self {
        let (left, other) = self.function.split(0.5);
        Self { function: if right { other } else { left }, ..*self }
    }

    /// Contains the values on the whole part.
    fn range(&self) -> Interval {
        let (low, high) = self.function.range();
        self.around(low, high)
    }

    /// Contains the value in the middle of the part.
    fn middle(&self) -> Interval {
        let value = self.function.value(0.5);
        self.around(value, value)
    }

    fn around(&self, low: f64, high: f64) -> Interval {
        let error = self.error + f64::MIN_POSITIVE;
        Interval { lo: low - error, hi: high + error }
    }
}

/// The polynomials of `chain_rule` on a segment or a part of it; rates are by the parameter of the whole segment.
#[derive(Clone, Copy)]
struct Part<const M: usize> {
    joints: [Terms<Rounded>; M],
    /// N of the tool's coordinates, for the curvature.
    tip: Option<[Rounded; 3]>,
    shared: Shared<Rounded>,
}

impl<const M: usize> Part<M> {
    fn new(curve: &Curve<M>) -> Self {
        let d = (!curve.weight.is_empty()).then(|| Function::from_bernstein(curve.weight.iter().copied()));
        let joints = velocities(curve.joints, curve.weight, d.as_ref());
        let tip = curve.tip.map(|tip| velocities(tip, curve.weight, d.as_ref()));
        let path: &[Velocity] = tip.as_ref().map_or(&joints, |tip| tip);
        let (mut q, mut error) = (Function::constant(0.0), 0.0);
        for v in path {
            q = q.combine(1.0, &v.g.multiply(&v.g), 1.0);
            error += ROUNDINGS * v.size().powi(2) + v.error * (2.0 * v.size() + v.error);
        }
        let q = Rounded { function: q, error };
        let weight = d.map(|function| Rounded { function, error: ROUNDINGS * function.range().1 });
        Self {
            joints: joints.map(|v| {
                let n = v.bend(path);
                let x = Rounded { function: v.g, error: v.rounding() };
                Terms { x, n, n_rate: n.derivative() }
            }),
            tip: tip.map(|tip| tip.map(|v| v.bend(path))),
            shared: Shared { q, q_rate: q.derivative(), weight: weight.map(|d| [d, d.derivative()]) },
        }
    }

    fn map<N: Number>(&self, of: impl Fn(&Rounded) -> N) -> Shape<M> {
        let shared = Shared {
            q: of(&self.shared.q),
            q_rate: of(&self.shared.q_rate),
            weight: self.shared.weight.as_ref().map(|d| d.each_ref().map(&of)),
        };
        let mut shape = Shape::nothing();
        for (k, axis) in self.joints.iter().enumerate() {
            let terms = Terms { x: of(&axis.x), n: of(&axis.n), n_rate: of(&axis.n_rate) };
            let [first, second, third] = shared.by_length(&terms);
            [shape.first[0][k], shape.first[1][k]] = sizes(first.range());
            [shape.second[0][k], shape.second[1][k]] = sizes(second.range());
            shape.third[k] = third.range().magnitude();
        }
        let bends = match &self.tip {
            // |q_S| ≤ 1 where the axes are those of the tool.
            None => {
                shape.first = shape.first.map(|first| first.map(|first| first.min(1.0)));
                greater(&shape.second).iter().map(|bend| bend * bend).sum::<f64>()
            }
            Some(tip) => {
                let bend = |n: &Rounded| {
                    let n = of(n);
                    shared.by_length(&Terms { x: n, n, n_rate: n })[1].range().magnitude().powi(2)
                };
                tip.iter().map(bend).sum()
            }
        };
        shape.curvature = bends.sqrt();
        shape
    }

    /// The derivatives at u.
    fn at(&self, u: f64) -> Shape<M> {
        self.map(|p| p.function.value(u))
    }

    fn half(&self, right: bool) -> Self {
        let half = |p: Rounded| p.half(right);
        let Shared { q, q_rate, weight } = self.shared;
        Self {
            joints: self.joints.map(|t| Terms { x: half(t.x), n: half(t.n), n_rate: half(t.n_rate) }),
            tip: self.tip.map(|tip| tip.map(half)),
            shared: Shared { q: half(q), q_rate: half(q_rate), weight: weight.map(|d| d.map(half)) },
        }
    }

    /// Includes the derivatives at the middle of this part in `seen`, and bounds on the part in `bound`: those of the whole part
    /// if `is_met` accepts them in view of `seen`, else those of both halves.
    fn enclose(
        &self,
        is_met: &impl Fn(&Shape<M>, &Shape<M>) -> bool,
        depth: u32,
        seen: &mut Shape<M>,
        bound: &mut Shape<M>,
    ) {
        let all = self.map(Rounded::range);
        // The values at the middle include their errors: if an error dominates a bound, halving the part cannot tighten it.
        seen.include(&self.map(Rounded::middle));
        if depth == MAX_DEPTH || is_met(&all, seen) {
            bound.include(&all);
            return;
        }
        for right in [false, true] {
            self.half(right).enclose(is_met, depth + 1, seen, bound);
        }
    }
}

/// G of a coordinate.
#[derive(Clone, Copy)]
struct Velocity {
    g: Function,
    /// The sums of the absolute values of the terms of each coefficient.
    terms: Function,
    /// The error of the coefficients because the coordinates were moved.
    error: f64,
}

impl Velocity {
    /// The greatest coefficient of `terms`.
    fn size(&self) -> f64 {
        self.terms.range().1
    }

    /// The error of X.
    fn rounding(&self) -> f64 {
        ROUNDINGS * self.size() + self.error
    }

    /// N of this coordinate, for a tool path with these velocities.
    fn bend(&self, path: &[Self]) -> Rounded {
        let (mut n, mut terms) = (Function::constant(0.0), Function::constant(0.0));
        let mut error = 0.0;
        for other in path {
            let degree = self.g.degree().max(other.g.degree());
            let lift = |p: &Function| p.elevate(degree);
            n = n.combine(1.0, &other.g.multiply(&lift(&self.g).wronskian(&lift(&other.g))), 1.0);
            let size = lift(&self.terms).wronskian_magnitude(&lift(&other.terms));
            terms = terms.combine(1.0, &other.terms.multiply(&size), 1.0);
            // |W(a, b)| ≤ 4 · degree · |a| |b| for a Wronskian W. The factor below is (a + δa) (b + δb)² − a b².
            let [(a, da), (b, db)] = [self, other].map(|v| (v.size(), v.error));
            error += 4.0 * degree as f64 * ((a + da) * (2.0 * b + db) * db + b * b * da);
        }
        Rounded { function: n, error: ROUNDINGS * terms.range().1 + error }
    }
}

/// G of every coordinate. The coordinates are moved to begin at 0, which keeps their differences nearly exact.
fn velocities<const K: usize>(control: &[[f64; K]], weight: &[f64], d: Option<&Function>) -> [Velocity; K] {
    std::array::from_fn(|k| {
        let moved = |i: usize| control[i][k] - control[0][k];
        let weighted = |i: usize| moved(i) * weight.get(i).copied().unwrap_or(1.0);
        let n = Function::from_bernstein((0..control.len()).map(weighted));
        let lost = |i: usize| rounding_of_difference(control[i][k], control[0][k]);
        let lost = (0..control.len()).map(lost).fold(0.0, f64::max);
        let degree = n.degree() as f64;
        match d {
            None => {
                let g = n.derivative();
                Velocity { g, terms: g.magnitude(), error: 2.0 * degree * lost }
            }
            Some(d) => {
                let most = d.range().1;
                let error = 4.0 * degree * most * most * lost;
                Velocity { g: n.wronskian(d), terms: n.wronskian_magnitude(d), error }
            }
        }
    })
}

/// The absolute value of the rounding error of a − b, computed exactly (Dekker 1971).
fn rounding_of_difference(a: f64, b: f64) -> f64 {
    let difference = a - b;
    let back = difference - a;
    ((a - (difference - back)) - (b + back)).abs()
}

/// Length of the control polygon.
fn polygon<const K: usize>(control: &[[f64; K]]) -> f64 {
    let edge = |pair: &[[f64; K]]| (0..K).map(|k| (pair[1][k] - pair[0][k]).powi(2)).sum::<f64>().sqrt();
    control.windows(2).map(edge).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A quarter of a circle of radius 2 about the origin.
    const QUARTER: ([[f64; 2]; 3], [f64; 3]) =
        ([[2.0, 0.0], [2.0, 2.0], [0.0, 2.0]], [1.0, std::f64::consts::FRAC_1_SQRT_2, 1.0]);

    fn plain<const M: usize>(joints: &[[f64; M]]) -> Curve<'_, M> {
        Curve { joints, tip: None, weight: &[] }
    }

    #[test]
    fn a_line_is_straight_with_any_parametrisation() {
        // Along (3, 4), at a speed that changes threefold.
        let line = [[0.0, 0.0], [3.0, 4.0], [12.0, 16.0]];
        let shape = bounded(&plain(&line), 0.01);
        let [first, none] = shape.first;
        assert!((first[0] - 0.6).abs() < 0.01 && (first[1] - 0.8).abs() < 0.01 && none == [0.0; 2]);
        assert!(shape.curvature < 1e-3 && shape.third[0] < 1e-3, "{shape:?}");
        let uniform = bounded(&plain(&[[1e3, 2.0], [1003.0, 6.0]]), 0.01);
        assert!((uniform.first[0][0] - 0.6).abs() < 1e-12 && uniform.curvature < 1e-12);
    }

    #[test]
    fn a_bend_that_rounding_hides_is_within_its_bound() {
        // The steps of the control polygon have the cross product 2⁶⁰ − (2⁶⁰ − 1) = 1, which is 0 in numbers of 53 bits.
        let large = 2f64.powi(30);
        let (from, to) = ([large, large - 1.0], [large + 1.0, large]);
        assert_eq!(from[0] * to[1] - from[1] * to[0], 0.0);
        let bend = [[0.0, 0.0], from, [from[0] + to[0], from[1] + to[1]]];
        // |C' × C''|/|C'|³ at the start.
        let curvature = 4.0 / (2.0 * from[0].hypot(from[1])).powi(3);
        let bound = bounded(&plain(&bend), 0.1).curvature;
        assert!(bound >= curvature && bound < 1e-12 / large, "{bound} for {curvature}");
    }

    #[test]
    fn a_circle_has_its_radius_in_every_derivative() {
        // x = R cos(S/R): at most 1, 1/R, 1/R².
        let curve = Curve { joints: &QUARTER.0, tip: None, weight: &QUARTER.1 };
        let shape = bounded(&curve, 0.01);
        let (first, second) = (greater(&shape.first), greater(&shape.second));
        for k in 0..2 {
            assert!(first[k] >= 1.0 - 1e-15 && first[k] <= 1.0);
            assert!(second[k] >= 0.5 && second[k] < 0.505);
            assert!(shape.third[k] >= 0.25 && shape.third[k] < 0.2526);
            // Back along x, ahead along y, about the origin.
            assert!(shape.first[k][k] < 0.05 && shape.second[0][k] < 0.05, "{shape:?}");
        }
        assert!(shape.curvature >= 0.5 && shape.curvature < 0.506);
        let seen = sampled(&curve, 11);
        assert!((seen.curvature - 0.5).abs() < 1e-14 && (seen.third[0] - 0.25).abs() < 1e-13);
    }

    #[test]
    fn ten_samples_miss_a_tight_bend_that_the_bounds_enclose() {
        // Two legs that meet in a narrow parabola of degree 6 between the places u = 0.4 and 0.5.
        let bend = [[0.0, 0.0], [9.0, 0.0], [10.0, 0.0], [10.0, 0.0], [10.0, 0.9], [10.0, 11.0]];
        let (seen, dense) = (sampled(&plain(&bend), 11), sampled(&plain(&bend), 10_001));
        let bound = bounded(&plain(&bend), 0.05);
        assert!(seen.third[0] < 0.8 * dense.third[0], "{seen:?} {dense:?}");
        assert!(
            bound.third[0] >= dense.third[0] && bound.third[0] < 1.06 * dense.third[0],
            "{bound:?} {dense:?}"
        );
    }

    #[test]
    fn a_cusp_has_no_bounds() {
        let cusp = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
        assert_eq!(bounded(&plain(&cusp), 0.05).curvature, f64::INFINITY);
    }

    #[test]
    fn joints_move_by_the_length_of_the_tool_path() {
        // A rotary axis by 90° along a quarter of radius 2: 90/π degrees per mm.
        let joints = [[0.0], [30.0], [60.0], [90.0]];
        let (c, r) = (0.551_915_024_494, 2.0);
        let tip = [[r, 0.0, 0.0], [r, c * r, 0.0], [c * r, r, 0.0], [0.0, r, 0.0]];
        let shape = bounded(&Curve { joints: &joints, tip: Some(&tip), weight: &[] }, 0.01);
        assert!((shape.first[0][0] / (90.0 / std::f64::consts::PI) - 1.0).abs() < 0.03, "{shape:?}");
        assert!((shape.curvature / 0.5 - 1.0).abs() < 0.05);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn bounds_hold_at_all_samples_and_are_close(
            control in prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), 2..6),
            weight in prop::collection::vec(0.5..2.0f64, 6),
            rational in any::<bool>(),
            size in (-3.0..3.0f64).prop_map(|e| 10f64.powf(e)),
        ) {
            // Onward along x, so that cusps are rare.
            let control: Vec<[f64; 3]> = control
                .iter()
                .enumerate()
                .map(|(i, p)| [size * (p[0] + 2.0 * i as f64), size * p[1], size * p[2]])
                .collect();
            let weight = if rational { &weight[..control.len()] } else { &[] };
            let curve = Curve { joints: &control, tip: None, weight };
            let (bound, seen) = (bounded(&curve, 0.1), sampled(&curve, 2001));
            let loose = bounded_until(&curve, 0.1, |shape| shape.curvature < 100.0 * seen.curvature);
            for bound in [&bound, &loose] {
                for k in 0..3 {
                    for sign in 0..2 {
                        prop_assert!(seen.first[sign][k] <= bound.first[sign][k] * (1.0 + 1e-12));
                        prop_assert!(seen.second[sign][k] <= bound.second[sign][k] * (1.0 + 1e-9));
                    }
                    prop_assert!(seen.third[k] <= bound.third[k] * (1.0 + 1e-9));
                }
                prop_assert!(seen.curvature <= bound.curvature * (1.0 + 1e-9));
            }
            prop_assume!(size * seen.curvature < 10.0);
            prop_assert!(bound.curvature <= 1.2 * seen.curvature + 0.02 / size, "{bound:?} {seen:?}");
        }
    }
}
