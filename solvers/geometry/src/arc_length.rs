//! The integral S(u) of a positive function f along a curve, as a table of Gauss–Legendre quadratures with a proven error.
//!
//! f is |C'|, whose integral is the length, or the time per parameter, 1/√p, of a profile. Source: Cheatham 2007, section 3.2,
//! after Guenter & Parent and Yang & Red, with K_n and the table size corrected. With n = 8 nodes on a panel of width w
//!
//!   |∫f − Σ| = w^(2n+1) K_n |f^(2n)(ξ)|,   K_n = (n!)⁴ / ((2n+1) ((2n)!)³)
//!
//! and the error of N equal panels on [a, b] is at most ε if N ≥ ((b−a)^(2n+1) K_n M / ε)^(1/(2n)), M ≥ |f^(2n)|. M is Cauchy's
//! estimate on a disc without singularities of f. Near a singularity too many equal panels would be needed, so panels are halved
//! towards it, and each has a bound of its own.

use crate::elementary::Elementary;
use crate::quadratic::{dot, Quadratic};
use crate::tolerance::NO_CURVATURE;

/// The number of nodes of the quadrature.
const N: usize = 8;
/// The positive nodes of Gauss–Legendre quadrature on [−1, 1], and the weights of each pair.
pub const X: [f64; 4] =
    [0.183_434_642_495_649_8, 0.525_532_409_916_329, 0.796_666_477_413_626_7, 0.960_289_856_497_536_3];
pub const W: [f64; 4] =
    [0.362_683_783_378_362, 0.313_706_645_877_887_3, 0.222_381_034_453_374_5, 0.101_228_536_290_376_3];

/// K_n (2n)!, because `Disc` bounds f^(2n)/(2n)!.
const K: f64 = {
    let (mut ratio, mut k) = (1.0, 1);
    while k <= N {
        ratio *= (k * k) as f64 / (((2 * k) * (2 * k - 1)) as f64);
        k += 1;
    }
    ratio * ratio / (2 * N + 1) as f64
};

/// On up to these parts of a panel, rules of two, three and seven nodes are as accurate as eight nodes on a whole panel whose
/// error is 1e-13.
const TWO_NODES: f64 = 2e-3;
const THREE_NODES: f64 = 3e-2;
pub const SEVEN_NODES: f64 = 0.5;
/// The positive nodes of the rule of seven, and the weights of each pair and of the middle node.
const X7: [f64; 3] = [0.405_845_151_377_397_2, 0.741_531_185_599_394_4, 0.949_107_912_342_758_5];
const W7: [f64; 4] =
    [0.381_830_050_505_118_9, 0.279_705_391_489_276_7, 0.129_484_966_168_869_7, 0.417_959_183_673_469_4];

/// An interval that needs more equal panels than this is halved.
const UNIFORM: f64 = 4.0;

/// |f^(2n)| ≤ (2n)! · bound / radius^(2n) on an interval.
pub struct Disc {
    pub radius: f64,
    pub bound: f64,
}

/// A positive function to integrate.
pub trait Integrand: Copy {
    /// f(u).
    fn at(&self, u: f64) -> f64;
    /// f at several u.
    #[inline(always)]
    fn at_each<const K: usize>(&self, u: [f64; K]) -> [f64; K] {
        u.map(|u| self.at(u))
    }

    /// Cauchy's estimate of f^(2n), valid for all of [a, b].
    fn disc(&self, a: f64, b: f64) -> Disc;

    /// The parameter nearest to the singularities of f: panels end there.
    fn foot(&self) -> f64;

    /// Bound of the quadrature error on a panel that ends at the foot, where the disc is too small.
    fn foot_error(&self, width: f64) -> f64;
}

/// |C'| of a quadratic piece, |C'(u)|² = E²(u − foot)² + d²; E = |C''|, d the least |C'|.
#[derive(Clone, Copy, Debug)]
pub struct QuadraticSpeed {
    e: f64,
    e_sq: f64,
    foot: f64,
    d_sq: f64,
}

impl QuadraticSpeed {
    pub fn new<const M: usize>(piece: &Quadratic<M>) -> Self {
        let (g, end) = piece.end_tangents();
        let c: [f64; M] = std::array::from_fn(|k| (end[k] - g[k]) / piece.width);
        let (e_sq, g_sq) = (dot(&c, &c), dot(&g, &g));
        if e_sq.is_nan()
            || e_sq * piece.width * piece.width <= NO_CURVATURE * g_sq
            || e_sq < f64::MIN_POSITIVE
        {
            return Self { e: 0.0, e_sq: 0.0, foot: 0.0, d_sq: g_sq };
        }
        let mut wedge_sq = 0.0;
        for k in 0..M {
            for l in k + 1..M {
                let w = g[k] * c[l] - g[l] * c[k];
                wedge_sq += w * w;
            }
        }
        Self { e: e_sq.sqrt(), e_sq, foot: -dot(&g, &c) / e_sq, d_sq: wedge_sq / e_sq }
    }

    /// |C'(u)|².
    #[inline(always)]
    fn squared(&self, u: f64) -> f64 {
        let x = u - self.foot;
        self.e_sq * x * x + self.d_sq
    }

    /// The least |C'| on [a, b], and the distance δ of that place from the branch points: |C'| = E δ.
    fn least(&self, a: f64, b: f64) -> (f64, f64) {
        let speed = self.squared(self.foot.clamp(a, b)).sqrt();
        (speed, if self.e > 0.0 { speed / self.e } else { f64::INFINITY })
    }
}

impl Integrand for QuadraticSpeed {
    #[inline(always)]
    fn at(&self, u: f64) -> f64 {
        self.squared(u).sqrt()
    }

    // |f| ≤ 2 E δ on the disc of radius δ(ξ) about ξ, and δ(ξ)^(1−2n) is greatest where δ is least.
    fn disc(&self, a: f64, b: f64) -> Disc {
        let (speed, radius) = self.least(a, b);
        Disc { radius, bound: 2.0 * speed }
    }

    fn foot(&self) -> f64 {
        self.foot
    }

    // f = E|x| + r with 0 ≤ r ≤ d; the quadrature of the linear part is exact.
    fn foot_error(&self, width: f64) -> f64 {
        self.d_sq.sqrt() * width
    }
}

/// One row of the table: the parameter, the integral up to it, and f there.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    pub u: f64,
    pub sum: f64,
    pub rate: f64,
}

/// A table of the integral of f over [first node, last node].
#[derive(Clone, Copy)]
pub struct Table<'a, F> {
    pub f: F,
    pub nodes: &'a [Node],
}

impl<F: Integrand> Table<'_, F> {
    /// The whole integral.
    #[inline]
    pub fn total(&self) -> f64 {
        self.nodes[self.nodes.len() - 1].sum
    }

    /// The rounding error of the integral, from the sum and from u itself. No u can be located more closely.
    #[inline]
    pub fn rounding(&self) -> f64 {
        let (first, last) = (&self.nodes[0], &self.nodes[self.nodes.len() - 1]);
        f64::EPSILON * (4.0 * last.sum + last.u * first.rate.max(last.rate))
    }

    /// The integral from the first node to u.
    pub fn integral(&self, u: f64) -> f64 {
        let node = &self.nodes[self.panel(|node| node.u <= u)];
        node.sum + quadrature(&self.f, node.u, u)
    }

    /// A row at u, computed from the nearer end of its panel.
    pub fn row(&self, u: f64) -> Node {
        let first = self.panel(|node| node.u <= u);
        let (start, end) = (self.nodes[first], self.nodes[first + 1]);
        let near = if u - start.u <= end.u - u { start } else { end };
        let [way, rate] = quadrature_of_part(&self.f, near.u, u, end.u - start.u);
        Node { u, sum: near.sum + way, rate }
    }

    /// The last panel whose first node satisfies `before`, which must hold up to some node and not after it.
    #[inline]
    pub fn panel(&self, before: impl Fn(&Node) -> bool) -> usize {
        let inner = &self.nodes[1..self.nodes.len() - 1];
        if inner.is_empty() {
            0
        } else {
            inner.partition_point(before)
        }
    }
}

/// Gauss–Legendre quadrature of f over [a, b] with eight nodes.
#[inline]
pub fn quadrature<F: Integrand>(f: &F, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let mut nodes = [middle; N];
    for i in 0..N / 2 {
        nodes[i] -= half * X[i];
        nodes[N / 2 + i] += half * X[i];
    }
    let (values, mut sum) = (f.at_each(nodes), 0.0);
    for i in 0..N / 2 {
        sum += W[i] * (values[i] + values[N / 2 + i]);
    }
    half * sum
}

/// The integral over [a, b], a part of a panel of width `panel`, and f(b). Short parts need fewer nodes, because the error of a
/// rule of m nodes shrinks with the power 2 m + 1 of the part.
#[inline]
pub fn quadrature_of_part<F: Integrand>(f: &F, a: f64, b: f64, panel: f64) -> [f64; 2] {
    let (middle, half, part) = (0.5 * (a + b), 0.5 * (b - a), ((b - a) / panel).abs());
    // Four or eight values fill a SIMD vector.
    if part < TWO_NODES {
        let x = half * 0.577_350_269_189_625_8;
        let [before, after, end, _] = f.at_each([middle - x, middle + x, b, b]);
        return [half * (before + after), end];
    }
    if part < THREE_NODES {
        let x = half * 0.774_596_669_241_483_4;
        let [before, centre, after, end] = f.at_each([middle - x, middle, middle + x, b]);
        return [half * (5.0 * (before + after) + 8.0 * centre) / 9.0, end];
    }
    if part <= SEVEN_NODES {
        let (x, m) = (X7.map(|x| half * x), middle);
        let [a0, b0, c0, centre, a1, b1, c1, end] =
            f.at_each([m - x[0], m - x[1], m - x[2], m, m + x[0], m + x[1], m + x[2], b]);
        let sum = W7[0] * (a0 + a1) + W7[1] * (b0 + b1) + W7[2] * (c0 + c1) + W7[3] * centre;
        return [half * sum, end];
    }
    [quadrature(f, a, b), f.at(b)]
}

/// N_table: the number of equal panels whose quadrature over `width` has an error of at most `error`; not rounded, at least 1.
pub fn table_size(width: f64, disc: &Disc, error: f64) -> f64 {
    if width <= 0.0 || disc.radius == f64::INFINITY {
        return 1.0;
    }
    if disc.radius == 0.0 {
        return f64::INFINITY;
    }
    let exponent = 1.0 / (2 * N) as f64;
    (width / disc.radius * (K * width * disc.bound / error).power(exponent)).max(1.0)
}

/// Appends the table of f over [a, b] to `nodes`, with an error of at most `error` at each u. Returns the proven bound. This
/// exceeds `error` only next to a cusp, where panels are as narrow as the rounding of u.
pub fn tabulate<F: Integrand>(f: F, a: f64, b: f64, error: f64, nodes: &mut Vec<Node>) -> f64 {
    nodes.push(Node { u: a, sum: 0.0, rate: f.at(a) });
    let mut builder =
        Builder { f, share: 0.5 * error / (b - a), foot_error: 0.25 * error, bound: 0.0, nodes };
    let foot = f.foot();
    if a < foot && foot < b {
        builder.grade(a, foot);
        builder.grade(foot, b);
    } else {
        builder.grade(a, b);
    }
    builder.bound
}

/// Appends panels from left to right. Half of the allowed error is distributed in proportion to width; each of the two panels at
/// the foot gets a quarter.
struct Builder<'a, F> {
    f: F,
    share: f64,
    foot_error: f64,
    bound: f64,
    nodes: &'a mut Vec<Node>,
}

impl<F: Integrand> Builder<'_, F> {
    fn grade(&mut self, a: f64, b: f64) {
        let (width, disc) = (b - a, self.f.disc(a, b));
        let size = table_size(width, &disc, self.share * width).ceil();
        if size <= UNIFORM {
            let panel = width / size;
            for i in 1..size as usize {
                self.push(a + i as f64 * panel);
            }
            self.push(b);
            let ratio = (panel / disc.radius).powi(2 * N as i32);
            self.bound += K * width * disc.bound * if disc.radius == f64::INFINITY { 0.0 } else { ratio };
            return;
        }
        let middle = 0.5 * (a + b);
        let at_foot = a == self.f.foot() || b == self.f.foot();
        let indivisible = !(a < middle && middle < b) || size.is_nan();
        let remainder = self.f.foot_error(width);
        if indivisible || (at_foot && remainder <= self.foot_error) {
            self.push(b);
            self.bound += remainder;
        } else {
            self.grade(a, middle);
            self.grade(middle, b);
        }
    }

    fn push(&mut self, u: f64) {
        let last = self.nodes[self.nodes.len() - 1];
        let sum = last.sum + quadrature(&self.f, last.u, u);
        self.nodes.push(Node { u, sum, rate: self.f.at(u) });
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The closed form on [0, u]: with r = |C'| at the ends, R = r0 + r1, t = E (u − foot) and x = E u / R,
    /// (u/R) [(R² + (t0 + t1)²)/4 + d² atanh(x)/x].
    fn exact_length<const M: usize>(piece: &Quadratic<M>, u: f64) -> f64 {
        let h = QuadraticSpeed::new(piece);
        if h.e == 0.0 || u == 0.0 {
            return u * h.d_sq.sqrt();
        }
        let sum = h.squared(0.0).sqrt() + h.squared(u).sqrt();
        let (x, t) = (h.e * u / sum, h.e * (u - 2.0 * h.foot));
        let curved = match x {
            _ if x < 0.01 => 1.0 + x * x / 3.0 + x.powi(4) / 5.0 + x.powi(6) / 7.0,
            _ if x < 1.0 => x.atanh() / x,
            _ => 0.0,
        };
        u / sum * (0.25 * (sum * sum + t * t) + h.d_sq * curved)
    }

    fn table_of<F: Integrand>(f: F, a: f64, b: f64, error: f64) -> (Vec<Node>, f64) {
        let mut nodes = Vec::new();
        let bound = tabulate(f, a, b, error, &mut nodes);
        (nodes, bound)
    }

    /// x = u, y = u²/2: |C'| = √(1 + u²).
    fn parabola() -> Quadratic<2> {
        Quadratic { control: [[0.0, 0.0], [0.5, 0.0], [1.0, 0.5]], width: 1.0 }
    }

    #[test]
    fn a_straight_piece_takes_one_panel_and_no_error() {
        let line = Quadratic::line([1.0, 2.0], [4.0, 6.0]);
        let (nodes, bound) = table_of(QuadraticSpeed::new(&line), 0.0, 5.0, 1e-12);
        assert_eq!((nodes.len(), bound), (2, 0.0));
        assert!((nodes[1].sum - 5.0).abs() < 1e-15);
    }

    #[test]
    fn the_unit_parabola_has_its_known_length() {
        let (nodes, bound) = table_of(QuadraticSpeed::new(&parabola()), 0.0, 1.0, 1e-13);
        let expected = 0.5 * (2f64.sqrt() + 1f64.asinh());
        assert!((nodes[nodes.len() - 1].sum - expected).abs() < 1e-15 && bound <= 1e-13);
    }

    #[test]
    fn the_corrected_error_constant_is_the_textbook_one() {
        // K_8 (16)! with K_n = (n!)⁴ / ((2n+1) ((2n)!)³).
        let factorial = |n: u64| (1..=n).map(|k| k as f64).product::<f64>();
        let expected = factorial(8).powi(4) / (17.0 * factorial(16).powi(2));
        assert!((K / expected - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_part_of_a_panel_has_its_integral_and_its_rate() {
        let f = QuadraticSpeed::new(&parabola());
        let panel = 1.0 / table_size(1.0, &f.disc(0.0, 1.0), 1e-13).ceil();
        let (nodes, _) = table_of(f, 0.0, 1.0, 1e-13);
        for part in [1e-3, 2e-2, 0.1, 0.3, 0.5, 0.7] {
            let row = Table { f, nodes: &nodes }.row(part);
            assert!((row.sum - exact_length(&parabola(), part)).abs() < 1e-15 && row.rate == f.at(part));
            for [a, b] in [[0.0, part * panel], [panel, (1.0 - part) * panel]] {
                let [way, rate] = quadrature_of_part(&f, a, b, panel);
                let exact = exact_length(&parabola(), b) - exact_length(&parabola(), a);
                assert!((way - exact).abs() < 1e-15 && rate == f.at(b), "{part}: {way} instead of {exact}");
            }
        }
    }

    #[test]
    fn a_uniform_table_of_the_stated_size_holds_its_error() {
        let f = QuadraticSpeed::new(&parabola());
        for error in [1e-6, 1e-9, 1e-12] {
            let disc = f.disc(0.0, 1.0);
            let size = table_size(1.0, &disc, error).ceil() as usize;
            let panel = 1.0 / size as f64;
            let sum: f64 = (0..size).map(|i| quadrature(&f, i as f64 * panel, (i + 1) as f64 * panel)).sum();
            assert!((sum - exact_length(&parabola(), 1.0)).abs() <= error);
        }
    }

    #[test]
    fn a_full_cusp_is_split_there_and_exact() {
        // C' goes from (−1, −2) through 0 to (1, 2): length 2 · √5/2.
        let piece = Quadratic { control: [[0.0, 0.0], [-1.0, -2.0], [0.0, 0.0]], width: 2.0 };
        let (nodes, bound) = table_of(QuadraticSpeed::new(&piece), 0.0, 2.0, 1e-13);
        assert_eq!((nodes.len(), nodes[1].u, bound), (3, 1.0, 0.0));
        assert!((nodes[2].sum - 5f64.sqrt()).abs() < 1e-15);
    }

    prop_compose! {
        /// Quadratics from ordinary ones to almost a cusp: the middle point is pulled towards a fold.
        fn quadratic()(
            a in prop::array::uniform3(-5.0..5.0), b in prop::array::uniform3(-5.0..5.0),
            c in prop::array::uniform3(-5.0..5.0), fold in 0.0..1.0f64, exponent in -14.0..0.0f64,
            width in 0.01..10.0,
        ) -> Quadratic<3> {
            let off = 10f64.powf(exponent);
            let along = 3.0 * fold - 1.0;
            let middle = std::array::from_fn(|k| a[k] + along * (c[k] - a[k]) + off * b[k]);
            Quadratic { control: [a, middle, c], width }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn the_proven_bound_holds_everywhere_near_cusps_too(
            piece in quadratic(), at in 0.0..1.0f64, digits in 3.0..13.0f64
        ) {
            let u = at * piece.width;
            let f = QuadraticSpeed::new(&piece);
            let whole = exact_length(&piece, piece.width);
            let (nodes, bound) = table_of(f, 0.0, piece.width, 10f64.powf(-digits) * whole);
            prop_assert!(bound <= 10f64.powf(-digits) * whole * (1.0 + 1e-12));
            let error = (Table { f, nodes: &nodes }.integral(u) - exact_length(&piece, u)).abs();
            prop_assert!(error <= bound + 4e-15 * whole, "{error:e} > {bound:e}");
            prop_assert!(nodes.len() < 300);
        }
    }
}
