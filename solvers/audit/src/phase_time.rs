//! The time of a phase, or of part of it, by numerical integration.
//!
//! Times are ∫ du/√p in the variable y in [0, 1] in which √p is linear where p is linear in u: du/√p is then finite at rest,
//! and constant where p is linear in u. Source of the rule: Kronrod 1965.

use super::phase_motion::{Law, PhaseMotion, State, STEPPED_OVER};
use super::{EPS, ROUNDINGS};

/// Nodes and weights of Kronrod's 7-point rule on [−1, 1], the middle one last; the weights of two rules inside it, Gauss's
/// of 3 points, which is good to degree 5, and that of the outermost two and the middle, good to degree 3.
const NODES: [f64; 3] = [0.960_491_268_708_020_3, 0.774_596_669_241_483_4, 0.434_243_749_346_802_55];
const WEIGHTS: [f64; 4] =
    [0.104_656_226_026_467_27, 0.268_488_089_868_333_44, 0.401_397_414_775_962_2, 0.450_916_538_658_474_14];
const INNER_WEIGHTS: [f64; 2] = [5.0 / 9.0, 8.0 / 9.0];
const OUTER_WEIGHTS: [f64; 2] = [0.361_326_288_494_254_1, 1.277_347_423_011_491_7];

/// What the differences of the values at each pair of nodes add to half of the integral in the first half.
const ODD_WEIGHTS: [f64; 3] = [0.057_380_543_663_243_626, 0.117_373_057_543_216_43, 0.239_427_071_874_871_92];

/// The same by the outermost and the innermost pair alone, good to degree 3.
const OUTER_ODD_WEIGHTS: [f64; 2] = [0.110_440_551_354_077, 0.331_433_244_415_378_86];

/// Gauss's rule can agree with Kronrod's by chance, so the error of the other rule counts as well, by this share: on smooth
/// functions it is then about as large as that of Gauss's rule.
const CHANCE: f64 = 3e-3;

/// Where Gauss's rule is off by no more than this part, Kronrod's is good to about the square of that where the function
/// is smooth, and to this part at a layer that both rules step over: next to a crawl the speed may change so.
pub(super) const RULES_AGREE: f64 = 3e-8;

/// A boundary layer that takes less than this share of an interval's time is left out.
const THIN: f64 = 1e-12;

/// Halvings of an interval before it counts as one that cannot be integrated; right phases need some forty.
pub(super) const MOST_HALVINGS: u32 = 400;

/// The integral of f from a to b by Kronrod's rule, and how far the others are from it.
#[inline(always)]
pub fn kronrod(f: impl Fn(f64) -> f64, a: f64, b: f64) -> [f64; 2] {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let pairs = NODES.map(|node| f(middle - half * node) + f(middle + half * node));
    by_rules(pairs, f(middle), half)
}

/// The integral of f from a to b by Gauss's rule of 3 points.
#[inline(always)]
pub(super) fn gauss(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let both = f(middle - half * NODES[1]) + f(middle + half * NODES[1]);
    half * (INNER_WEIGHTS[1] * f(middle) + INNER_WEIGHTS[0] * both)
}

/// The same as `kronrod`, and the integral of the first half, by the polynomial through the values at all nodes. Whatever is odd
/// about the middle adds nothing to the whole by any rule, but to the half: its doubt counts by the same share.
#[inline(always)]
pub(super) fn kronrod_halves(f: impl Fn(f64) -> f64, a: f64, b: f64) -> ([f64; 2], f64) {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let values = NODES.map(|node| [f(middle - half * node), f(middle + half * node)]);
    let whole = by_rules(values.map(|[before, after]| before + after), f(middle), half);
    let [outer, gauss, inner] = values.map(|[before, after]| before - after);
    let odd = ODD_WEIGHTS[0] * outer + ODD_WEIGHTS[1] * gauss + ODD_WEIGHTS[2] * inner;
    let rough = OUTER_ODD_WEIGHTS[0] * outer + OUTER_ODD_WEIGHTS[1] * inner;
    let [fine, doubt] = whole;
    ([fine, doubt.max(half * CHANCE * (rough - odd).abs())], 0.5 * fine + half * odd)
}

/// The integral and its doubt from the sums of the values at each pair of nodes and the value in the middle.
#[inline(always)]
fn by_rules(pairs: [f64; 3], centre: f64, half: f64) -> [f64; 2] {
    let [outer, gauss, inner] = pairs;
    let fine = WEIGHTS[0] * outer + WEIGHTS[1] * gauss + WEIGHTS[2] * inner + WEIGHTS[3] * centre;
    let miss = (INNER_WEIGHTS[0] * gauss + INNER_WEIGHTS[1] * centre - fine).abs();
    let rough = (OUTER_WEIGHTS[0] * outer + OUTER_WEIGHTS[1] * centre - fine).abs();
    [half * fine, half * miss.max(CHANCE * rough)]
}

impl<const M: usize> PhaseMotion<M> {
    /// dt/dy at `y` inside the phase, up to `time_scale`.
    #[inline(always)]
    fn integrand(&self, y: f64) -> f64 {
        let d = self.distance(y);
        match self.law {
            // The same as below with one axis evaluated and one division saved.
            Law::Axis { axis, value, start_sq } if !self.is_general() => {
                let tangent = self.tangent[axis] + d * self.bend[axis];
                let speed_sq = start_sq + value * d * (self.tangent[axis] + tangent);
                self.linear(y) * tangent.abs() / speed_sq.sqrt()
            }
            _ => self.linear(y) / self.root_p_at(d),
        }
    }

    /// Whether the integrand is smooth enough between two distances for the rule: no longer than they are far
    /// from where p has a pole or a kink. A boundary layer too thin to matter counts as smooth.
    #[inline]
    fn is_smooth(&self, d0: f64, d1: f64) -> bool {
        let Some(pole) = &self.pole else { return true };
        let along = (d0.min(d1) - pole.at).max(pole.at - d0.max(d1)).max(0.0);
        let (length, away) = ((d1 - d0).abs(), (along * along + pole.beside * pole.beside).sqrt());
        length <= away || pole.strength * away <= THIN * length
    }

    /// Whether the rules see nothing of a boundary layer at the anchor that matters.
    #[inline]
    fn steps_over_layer(&self, y0: f64, y1: f64) -> bool {
        let Some(layer) = &self.layer else { return false };
        let (length, away) = (y1 - y0, y0 + layer.thickness);
        away < STEPPED_OVER * length && layer.strength * away > THIN * length
    }

    /// Time from `y0` to `y1`, in s, and whether the rule could be trusted there.
    #[inline]
    fn rule(&self, y0: f64, y1: f64) -> (f64, bool) {
        let smooth = self.is_smooth(self.distance(y0), self.distance(y1)) && !self.steps_over_layer(y0, y1);
        let [time, doubt] = kronrod(|y| self.integrand(y), y0, y1).map(|sum| self.time_scale * sum);
        (time, smooth && doubt.abs() <= RULES_AGREE * time)
    }

    /// Walks from `from` to `to` and calls `step` for every interval whose time is known well enough; for what
    /// cannot be integrated the time is NaN.
    #[inline]
    pub fn walk(&self, from: &State<M>, to: &State<M>, step: &mut impl FnMut(&State<M>, &State<M>, f64)) {
        self.walk_halving(from, to, &mut { MOST_HALVINGS }, step);
    }

    fn walk_halving(
        &self,
        from: &State<M>,
        to: &State<M>,
        halvings: &mut u32,
        step: &mut impl FnMut(&State<M>, &State<M>, f64),
    ) {
        match self.integrate(from.y, to.y, halvings) {
            Ok(time) => step(from, to, time),
            Err(middle) => {
                let middle = self.state(middle);
                self.walk_halving(from, &middle, halvings, step);
                self.walk_halving(&middle, to, halvings, step);
            }
        }
    }

    /// Time from the anchor to `y`, in s; NaN where it cannot be integrated.
    pub fn time_from_anchor(&self, y: f64) -> f64 {
        if y <= 0.0 {
            return 0.0;
        }
        self.time_between(0.0, y, &mut { MOST_HALVINGS })
    }

    fn time_between(&self, y0: f64, y1: f64, halvings: &mut u32) -> f64 {
        match self.integrate(y0, y1, halvings) {
            Ok(time) => time,
            Err(middle) => self.time_between(y0, middle, halvings) + self.time_between(middle, y1, halvings),
        }
    }

    /// The time between two places, or the place between them at which the interval has to be halved.
    #[inline]
    fn integrate(&self, y0: f64, y1: f64, halvings: &mut u32) -> Result<f64, f64> {
        let (time, trusted) = self.rule(y0, y1);
        let middle = 0.5 * (y0 + y1);
        // From rest where C' vanishes the integrand is a power of y: the rules miss the same share of any part of it.
        let nothing = y0 == 0.0 && y1 <= THIN;
        if trusted || nothing || middle <= y0 || middle >= y1 {
            return Ok(time);
        }
        if *halvings == 0 || !time.is_finite() {
            return Ok(f64::NAN);
        }
        *halvings -= 1;
        Err(middle)
    }

    /// Time of an interval so short that the 3-point rule is enough, in s.
    #[inline]
    fn short_time(&self, y0: f64, y1: f64) -> f64 {
        self.time_scale * gauss(|y| self.integrand(y), y0, y1)
    }

    /// Axis accelerations near `y` as a difference quotient over a thousandth of the phase, or less where p changes
    /// fast, in mm/s², and how much of each may be rounding.
    pub fn acceleration_near(&self, y: f64) -> ([f64; M], [f64; M]) {
        let d = self.distance(y);
        let away = match self.pole {
            Some(pole) => ((d - pole.at) * (d - pole.at) + pole.beside * pole.beside).sqrt(),
            None => self.way_to_turn(y),
        };
        // Around y, so that the mean is that at y to second order; at an end one-sided and very short.
        let half = f64::min(5e-4, 0.01 * away / self.width).min(y.min(1.0 - y).max(1e-6));
        let (from, to) = (self.state((y - half).max(0.0)), self.state((y + half).min(1.0)));
        let per_time = self.direction / self.short_time(from.y, to.y);
        let rounding = ROUNDINGS * EPS * per_time.abs();
        (
            std::array::from_fn(|k| (to.velocity[k] - from.velocity[k]) * per_time),
            std::array::from_fn(|k| (from.magnitude[k] + to.magnitude[k]) * rounding),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Curve, Quadratic};
    use crate::phases::Phases;
    use crate::polygon::Polygon;
    use crate::vectors::inner;

    /// One phase on one piece.
    fn one_phase(
        kind: u8,
        axis: u8,
        value: f64,
        u: [f64; 2],
        p: [f64; 2],
        curve: &Curve<2>,
    ) -> PhaseMotion<2> {
        Phases {
            piece: &[0],
            kind: &[kind],
            axis: &[axis],
            value: &[value],
            u0: &[u[0]],
            u1: &[u[1]],
            p0: &[p[0]],
            p1: &[p[1]],
            duration: &[1.0],
            a0: &[0.0],
            a1: &[0.0],
            share: &[],
            pieces: 1,
            runs: &[0, 1],
        }
        .by_parameter(0, curve)
    }

    fn quadratic(points: &[[f64; 2]; 3], width: f64) -> Curve<2> {
        Curve::Quadratic(Quadratic::new(points, width))
    }

    fn line() -> Curve<2> {
        quadratic(&[[0.0, 0.0], [4.0, 3.0], [8.0, 6.0]], 10.0)
    }

    fn total(motion: &PhaseMotion<2>) -> f64 {
        let mut sum = 0.0;
        motion.walk(&motion.state(0.0), &motion.state(1.0), &mut |_, _, time| sum += time);
        sum
    }

    #[test]
    fn the_rule_integrates_degree_eleven_exactly() {
        for degree in 0..=11 {
            let mut sum = WEIGHTS[3] * if degree == 0 { 1.0 } else { 0.0 };
            for i in 0..3 {
                sum += WEIGHTS[i] * (NODES[i].powi(degree) + (-NODES[i]).powi(degree));
            }
            let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 1e-15, "degree {degree}: {sum} instead of {exact}");
        }
    }

    #[test]
    fn the_first_half_of_the_rule_is_that_of_a_polynomial() {
        for degree in 0..=6 {
            let ([whole, _], half) = kronrod_halves(|x| (x - 0.3_f64).powi(degree), 1.0, 4.0);
            let exact = |x: f64| (x - 0.3).powi(degree + 1) / f64::from(degree + 1);
            assert!((whole / (exact(4.0) - exact(1.0)) - 1.0).abs() < 1e-14, "{degree}");
            assert!((half / (exact(2.5) - exact(1.0)) - 1.0).abs() < 1e-14, "{degree}");
        }
    }

    #[test]
    fn a_rule_that_agrees_by_chance_is_not_believed() {
        // Of 2 + cos kx Gauss's rule and Kronrod's are the same at some k, and both are wrong.
        let rules = |k: f64| {
            let f = |x: f64| 2.0 + (k * x).cos();
            let gauss = INNER_WEIGHTS[0] * 2.0 * f(NODES[1]) + INNER_WEIGHTS[1] * f(0.0);
            let [fine, doubt] = kronrod(f, -1.0, 1.0);
            (gauss - fine, doubt, (fine - 4.0 - 2.0 * k.sin() / k).abs())
        };
        let mut met = 0;
        for step in 10..400 {
            let (mut low, mut high) = (0.05 * f64::from(step), 0.05 * f64::from(step + 1));
            if rules(low).0 * rules(high).0 > 0.0 {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if rules(low).0 * rules(middle).0 > 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let (_, doubt, error) = rules(low);
            met += i32::from(error > 1e-6);
            assert!(
                error <= 1e-10 || doubt > 4.0 * RULES_AGREE,
                "off by {error} at {low}, in doubt by {doubt}"
            );
        }
        assert!(met > 0);
    }

    #[test]
    fn what_is_odd_about_the_middle_is_not_missed_in_half_of_it() {
        // Of the whole, which is 4.
        let (mut met, agree) = (0, 4.0 * RULES_AGREE);
        for step in 1..400 {
            let k = 0.05 * f64::from(step);
            let ([_, doubt], half) = kronrod_halves(|x| 2.0 + (k * x).sin(), -1.0, 1.0);
            let error = (half - 2.0 + (1.0 - k.cos()) / k).abs();
            met += i32::from(error > 1e-6);
            assert!(error <= agree || doubt > agree, "off by {error} at {k}, in doubt by {doubt}");
        }
        assert!(met > 0);
    }

    #[test]
    fn from_rest_along_a_line_takes_the_schoolbook_time() {
        // X at 8 mm/s² over 8 mm: t = √(2 · 8 / 8).
        let motion = one_phase(0, 0, 8.0, [0.0, 10.0], [0.0, 200.0], &line());
        assert!((total(&motion) - 2.0_f64.sqrt()).abs() < 1e-14);
        assert!((motion.state(1.0).velocity[0] - 128.0_f64.sqrt()).abs() < 1e-13);
        let braking = one_phase(0, 0, -8.0, [0.0, 10.0], [200.0, 0.0], &line());
        assert!(braking.anchored_at_end);
        assert!((total(&braking) - 2.0_f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn an_axis_at_constant_acceleration_takes_its_change_of_velocity_over_it() {
        // A bend from 45 degrees to nearly straight up: q'_x falls by a factor of 100.
        let curve = quadratic(&[[0.0, 0.0], [1.0, 1.0], [1.01, 2.0]], 2.0);
        let (g0, g1) = (curve.derivative(0.0)[0], curve.derivative(2.0)[0]);
        let (p0, value) = (9.0, 3.0);
        let p1 = (g0 * g0 * p0 + 2.0 * value * 1.01) / (g1 * g1);
        let motion = one_phase(0, 0, value, [0.0, 2.0], [p0, p1], &curve);
        let exact = (g1 * p1.sqrt() - g0 * p0.sqrt()) / value;
        assert!((total(&motion) / exact - 1.0).abs() < 1e-10);
    }

    #[test]
    fn next_to_a_turn_of_its_axis_on_a_conic_the_acceleration_is_that_of_the_place() {
        // Y turns 6e-4 mm before the phase begins; the acceleration of X there by exact arithmetic.
        let points = [[3.33400833, -245.33330009], [4.66993226, -245.33369929], [5.18118385, -246.56792565]];
        let weights = [1.0, 0.831_556_127_752_042_9, 1.0];
        let curve = Curve::general(Polygon::new(points.into_iter(), &weights), 2.22179155091747);
        let p = [1000.311668347934, 1001.67845];
        let motion = one_phase(0, 1, -500.0, [0.0, 1.47142088], p, &curve);
        let y = motion.y_at(0.000787988);
        let (acceleration, rounding) = motion.acceleration_near(y);
        assert!((acceleration[0] + 40.3678).abs() < 0.05, "{acceleration:?} ± {rounding:?}");
        assert!((acceleration[1] + 500.0).abs() < 1e-3, "{acceleration:?}");
    }

    #[test]
    fn part_of_an_arc_takes_the_time_of_that_part() {
        let motion = one_phase(0, 0, 8.0, [0.0, 10.0], [0.0, 200.0], &line());
        let y = motion.y_at(2.5);
        assert!((motion.time_from_anchor(y) - 0.5 * 2.0_f64.sqrt()).abs() < 1e-14);
        assert_eq!(motion.y_at(0.0), 0.0);
        assert_eq!(motion.y_at(10.0), 1.0);
    }

    #[test]
    fn a_slide_at_constant_speed_takes_length_over_speed() {
        let curve = quadratic(&[[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]], 2.0);
        let d = |u| inner(&curve.derivative(u), &curve.derivative(u));
        let motion = one_phase(2, 255, 9.0, [0.0, 2.0], [9.0 / d(0.0), 9.0 / d(2.0)], &curve);
        let arc_length = 2.0_f64.sqrt() + 1.0_f64.asinh();
        assert!((total(&motion) - arc_length / 3.0).abs() < 1e-11);
    }
}
