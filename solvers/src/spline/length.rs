//! The length of a curve of any degree and the place at a given length, by the tables of `arc_length`.
//!
//! The integrand is |C'| = |h|/ω², h the hodograph numerator. The bound of its derivatives that the table needs
//! is Cauchy's on a disc about the middle m of a panel: with S = h·h = s₀ + s₁z + … about m and
//! Σ_{k>0} |s_k| ρᵏ ≤ s₀, S has no zero in |z| < ρ, so that √S is analytic there and below √(2 s₀); in the same
//! way ω stays above half of ω(m). Panels are halved where the disc is small: towards cusps and near-cusps.

use rayon::prelude::*;

use super::cusps::{piece_cusps, CUSP};
use super::rational::Hodograph;
use super::{binomial, CompositeCurve, Piece, MAX_DEGREE, MAX_HODOGRAPH, MAX_SQUARE};
use crate::arc_length::{quadrature, tabulate, Disc, Integrand, Node, Place, Table};
use crate::quadratic::dot;
use crate::sarfraz;

/// No disc need be greater than so many half panels: one panel then has no error left.
const MAX_RATIO: f64 = 64.0;
/// Steps in which the radius of a disc is bisected, geometrically: to 4 %.
const BISECTIONS: u32 = 7;

/// |C'(u)| of one piece.
#[derive(Clone, Copy, Debug)]
pub struct Speed<'a, const M: usize> {
    /// Bernstein coefficients of h by t = u / width, times binomials.
    h: &'a [[f64; M]],
    /// Those of ω; empty for polynomial pieces.
    omega: &'a [f64],
    width: f64,
    /// The cusp in this part of the piece; not a number without one.
    foot: f64,
    /// |C'| at most `at_foot + slope |u − foot|`.
    at_foot: f64,
    slope: f64,
}

impl<'a, const M: usize> Speed<'a, M> {
    fn new(h: &'a [[f64; M]], omega: &'a [f64], width: f64) -> Self {
        let mut speed = Self { h, omega, width, foot: f64::NAN, at_foot: 0.0, slope: 0.0 };
        speed.at_foot = speed.greatest(|i| speed.plain(i)) * speed.inverse_square();
        speed
    }

    /// The same with a cusp at u.
    fn with_foot(mut self, u: f64) -> Self {
        let n = self.h.len() - 1;
        let growth = self.greatest(|i| {
            let (low, high) = (self.plain(i), self.plain((i + 1).min(n)));
            std::array::from_fn(|k| n as f64 * (high[k] - low[k]))
        });
        let value = self.numerator(u / self.width).0;
        self.foot = u;
        self.at_foot = dot(&value, &value).sqrt() * self.inverse_square();
        self.slope = growth * self.inverse_square() / self.width;
        self
    }

    fn plain(&self, i: usize) -> [f64; M] {
        self.h[i].map(|value| value / binomial(self.h.len() - 1, i))
    }

    fn greatest(&self, vector: impl Fn(usize) -> [f64; M]) -> f64 {
        (0..self.h.len()).fold(0.0, |most: f64, i| most.max(dot(&vector(i), &vector(i)))).sqrt()
    }

    /// 1/(ω² width) at most.
    fn inverse_square(&self) -> f64 {
        let degree = self.omega.len().saturating_sub(1);
        let least = (0..self.omega.len())
            .fold(f64::INFINITY, |least, i| least.min(self.omega[i] / binomial(degree, i)));
        if self.omega.is_empty() {
            1.0 / self.width
        } else {
            1.0 / (least * least * self.width)
        }
    }

    /// h(t), and ω(t), by Horner's scheme from the nearer end.
    #[inline(always)]
    fn numerator(&self, t: f64) -> ([f64; M], f64) {
        let s = 1.0 - t;
        let n = self.h.len() - 1;
        let (mut h, mut omega);
        if t <= 0.5 {
            let ratio = t / s;
            h = self.h[n];
            for row in self.h[..n].iter().rev() {
                for k in 0..M {
                    h[k] = h[k] * ratio + row[k];
                }
            }
            omega = 0.0;
            for value in self.omega.iter().rev() {
                omega = omega * ratio + value;
            }
        } else {
            let ratio = s / t;
            h = self.h[0];
            for row in &self.h[1..] {
                for k in 0..M {
                    h[k] = h[k] * ratio + row[k];
                }
            }
            omega = 0.0;
            for value in self.omega {
                omega = omega * ratio + value;
            }
        }
        let base = t.max(s);
        if self.omega.is_empty() {
            omega = 1.0;
        } else {
            omega *= base.powi(self.omega.len() as i32 - 1);
        }
        let scale = base.powi(n as i32);
        (h.map(|value| value * scale), omega)
    }
}

impl<const M: usize> Integrand for Speed<'_, M> {
    #[inline(always)]
    fn at(&self, u: f64) -> f64 {
        let (h, omega) = self.numerator(u / self.width);
        dot(&h, &h).sqrt() / (omega * omega * self.width)
    }

    fn disc(&self, a: f64, b: f64) -> Disc {
        let (middle, half) = (0.5 * (a + b) / self.width, 0.5 * (b - a) / self.width);
        let n = self.h.len() - 1;
        let mut taylor = [[0.0; M]; MAX_HODOGRAPH];
        for i in 0..=n {
            taylor[i] = self.plain(i);
        }
        to_taylor(&mut taylor[..=n], middle, half);
        let mut square = [0.0; MAX_SQUARE];
        for i in 0..=n {
            for j in 0..=n {
                square[i + j] += dot(&taylor[i], &taylor[j]);
            }
        }
        let square = &square[..2 * n + 1];

        let mut omega = [[0.0]; MAX_DEGREE + 1];
        let degree = self.omega.len().saturating_sub(1);
        for i in 0..self.omega.len() {
            omega[i] = [self.omega[i] / binomial(degree, i)];
        }
        if !self.omega.is_empty() {
            to_taylor(&mut omega[..=degree], middle, half);
        }
        let clear = |rho: f64| {
            let tail = square[1..].iter().rev().fold(0.0, |sum, s| (sum + s.abs()) * rho);
            let omega_tail = omega[1..].iter().rev().fold(0.0, |sum, w| (sum + w[0].abs()) * rho);
            tail <= square[0] && omega_tail <= 0.5 * omega[0][0]
        };
        let (mut low, mut high) = (1.0, MAX_RATIO);
        if clear(high) {
            low = high;
        } else if clear(low) {
            for _ in 0..BISECTIONS {
                let rho = (low * high).sqrt();
                if clear(rho) {
                    low = rho;
                } else {
                    high = rho;
                }
            }
        }
        let denominator = if self.omega.is_empty() { 1.0 } else { 0.25 * omega[0][0] * omega[0][0] };
        Disc {
            radius: (low - 1.0) * half * self.width,
            bound: (2.0 * square[0]).sqrt() / (denominator * self.width),
        }
    }

    fn foot(&self) -> f64 {
        self.foot
    }

    // The length of such a panel and its quadrature are both positive and below its width times the bound.
    fn foot_error(&self, width: f64) -> f64 {
        width * (self.at_foot + self.slope * width)
    }
}

/// Bernstein coefficients on [0, 1] to those of powers of z = (t − middle)/half, up to the sign of z: the part
/// from the middle to the farther end, and its forward differences.
fn to_taylor<const M: usize>(b: &mut [[f64; M]], middle: f64, half: f64) {
    let n = b.len() - 1;
    let t = if middle > 0.5 {
        b.reverse();
        1.0 - middle
    } else {
        middle
    };
    for row in 1..=n {
        for i in 0..=n - row {
            for k in 0..M {
                b[i][k] += t * (b[i + 1][k] - b[i][k]);
            }
        }
    }
    for row in 1..=n {
        for i in (row..=n).rev() {
            for k in 0..M {
                b[i][k] -= b[i - 1][k];
            }
        }
    }
    let (ratio, mut power) = (half / (1.0 - t), 1.0);
    for k in 0..=n {
        b[k] = b[k].map(|value| value * (binomial(n, k) * power));
        power *= ratio;
    }
}

/// The lengths along a curve, piece after piece.
#[derive(Clone, Debug)]
pub struct CurveLength<const M: usize> {
    h: Vec<[f64; M]>,
    omega: Vec<f64>,
    /// First coefficient of each piece in `h` and `omega`, and the ends.
    offsets: Vec<[usize; 2]>,
    width: Vec<f64>,
    nodes: Vec<Node>,
    /// First node of each piece, and the end.
    tables: Vec<usize>,
    /// Length up to the start of each piece, and the whole; in mm.
    starts: Vec<f64>,
    error: f64,
}

impl<const M: usize> CurveLength<M> {
    /// Tabulates every piece to the error `accuracy`, a part of its length; the curve has at least one piece.
    pub fn new(curve: &CompositeCurve<M>, accuracy: f64) -> Self {
        let count = curve.len();
        let mut lengths = Self {
            h: Vec::with_capacity(curve.control.len()),
            omega: vec![],
            offsets: vec![[0, 0]],
            width: curve.width.clone(),
            nodes: Vec::with_capacity(3 * count),
            tables: vec![0],
            starts: vec![0.0],
            error: 0.0,
        };
        for piece in curve.pieces() {
            let hodograph = Hodograph::new(&piece);
            let n = hodograph.coefficients().len() - 1;
            for (i, row) in hodograph.coefficients().iter().enumerate() {
                lengths.h.push(row.map(|value| value * binomial(n, i)));
            }
            for (i, weight) in piece.weights.iter().enumerate() {
                lengths.omega.push(weight * binomial(piece.degree(), i));
            }
            lengths.offsets.push([lengths.h.len(), lengths.omega.len()]);
        }
        let tables: Vec<(Vec<Node>, f64)> = (0..count)
            .into_par_iter()
            .with_min_len(64)
            .map(|i| table(lengths.speed(i), &curve.piece(i), accuracy))
            .collect();
        // Neumaier's sum: the starts of a long path are as good as its pieces.
        let (mut sum, mut lost) = (0.0_f64, 0.0_f64);
        for (nodes, bound) in tables {
            let length = nodes[nodes.len() - 1].sum;
            let next = sum + length;
            lost += if sum >= length { (sum - next) + length } else { (length - next) + sum };
            sum = next;
            lengths.error += bound + 8.0 * f64::EPSILON * length;
            lengths.nodes.extend(nodes);
            lengths.tables.push(lengths.nodes.len());
            lengths.starts.push(sum + lost);
        }
        lengths
    }

    fn speed(&self, i: usize) -> Speed<'_, M> {
        let ([h0, w0], [h1, w1]) = (self.offsets[i], self.offsets[i + 1]);
        let (h, omega) = (&self.h[h0..h1], &self.omega[w0..w1]);
        Speed { h, omega, width: self.width[i], foot: f64::NAN, at_foot: 0.0, slope: 0.0 }
    }

    fn table(&self, i: usize) -> Table<'_, Speed<'_, M>> {
        Table { f: self.speed(i), nodes: &self.nodes[self.tables[i]..self.tables[i + 1]] }
    }

    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        self.width.len()
    }

    /// Rows of all tables.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }

    /// The length of the curve in mm.
    pub fn total(&self) -> f64 {
        self.starts[self.starts.len() - 1]
    }

    /// The bound of the error of every length on the curve in mm: proven for the quadrature, with an allowance
    /// of eight roundings for its evaluation.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Length from the start of the curve to parameter u of a piece in mm.
    pub fn length(&self, piece: usize, u: f64) -> f64 {
        self.starts[piece] + self.table(piece).integral(u)
    }

    /// The place at a length, within `tolerance` mm; a length beyond either end gives that end.
    pub fn locate(&self, length: f64, tolerance: f64) -> Place {
        let last = self.pieces() - 1;
        let piece = self.starts[1..=last].partition_point(|&start| start <= length);
        Place { piece, located: sarfraz::locate(&self.table(piece), length - self.starts[piece], tolerance) }
    }

    /// Lengths up to many places, in parallel.
    pub fn lengths(&self, pieces: &[u32], u: &[f64]) -> Vec<f64> {
        pieces
            .par_iter()
            .zip(u)
            .with_min_len(1024)
            .map(|(&piece, &u)| self.length(piece as usize, u))
            .collect()
    }

    /// The places at many lengths, in parallel.
    pub fn locate_all(&self, lengths: &[f64], tolerance: f64) -> Vec<Place> {
        lengths.par_iter().with_min_len(1024).map(|&length| self.locate(length, tolerance)).collect()
    }
}

/// The table of one piece and the bound of its error. A piece with several cusps is tabulated in parts that hold
/// one each.
fn table<const M: usize>(speed: Speed<M>, piece: &Piece<M>, accuracy: f64) -> (Vec<Node>, f64) {
    let mut nodes: Vec<Node> = vec![];
    let (speed, width) = (Speed::new(speed.h, speed.omega, speed.width), piece.width);
    let estimate = quadrature(&speed, 0.0, width);
    if estimate == 0.0 && speed.at_foot == 0.0 {
        return (vec![Node { u: 0.0, sum: 0.0, rate: 0.0 }, Node { u: width, sum: 0.0, rate: 0.0 }], 0.0);
    }
    let feet = piece_cusps(piece, CUSP);
    let mut bound = 0.0;
    for (i, foot) in feet.iter().map(|t| t * width).chain(feet.is_empty().then_some(f64::NAN)).enumerate() {
        let start = nodes.last().map_or(0.0, |node| node.u);
        let end = feet.get(i + 1).map_or(width, |next| 0.5 * (foot + next * width));
        let part = if foot.is_nan() { speed } else { speed.with_foot(foot) };
        let (before, done) = (nodes.pop().map_or(0.0, |node| node.sum), nodes.len());
        bound += tabulate(part, start, end, accuracy * estimate / feet.len().max(1) as f64, &mut nodes);
        for node in &mut nodes[done..] {
            node.sum += before;
        }
    }
    (nodes, bound)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

    use super::*;
    use crate::spline::bezier::{derivatives, elevate, split};
    use proptest::prelude::*;

    fn curve_of<const M: usize>(control: &[[f64; M]], weights: &[f64], width: f64) -> CompositeCurve<M> {
        let mut curve = CompositeCurve::default();
        curve.push(control, weights, width);
        curve
    }

    #[test]
    fn a_line_is_as_long_as_its_ends_are_apart() {
        let length = CurveLength::new(&curve_of(&[[1.0, 2.0], [4.0, 6.0]], &[], 7.0), 1e-14);
        assert!((length.total() - 5.0).abs() < 1e-15 && length.nodes() == 2);
        assert!((length.locate(2.0, 1e-15).located.u - 2.8).abs() < 1e-15);
    }

    #[test]
    fn the_unit_parabola_has_its_known_length() {
        let length = CurveLength::new(&curve_of(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.5]], &[], 1.0), 1e-14);
        let expected = 0.5 * (2f64.sqrt() + 1f64.asinh());
        assert!((length.total() - expected).abs() < 4e-16, "{:e}", length.total() - expected);
        assert!(length.error() < 1e-13);
    }

    #[test]
    fn a_quarter_circle_has_its_known_length_at_every_place() {
        let quarter = curve_of(&[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], &[1.0, FRAC_1_SQRT_2, 1.0], 1.0);
        let length = CurveLength::new(&quarter, 1e-14);
        assert!((length.total() - FRAC_PI_2).abs() < 1e-15);
        for i in 0..=40 {
            let place = length.locate(FRAC_PI_2 * i as f64 / 40.0, 1e-15);
            let [x, y] = derivatives(&quarter.piece(0), place.located.u)[0];
            assert!((y.atan2(x) - FRAC_PI_2 * i as f64 / 40.0).abs() < 2e-15);
        }
    }

    /// (s², s³) from s = −c to 1 − c: its length is |(4 + 9 s²)^1.5 − 8|/27 from the cusp.
    fn semicubical(c: f64) -> (CompositeCurve<2>, impl Fn(f64) -> f64) {
        let square =
            |a: f64, b: f64, e: f64| (a * b + a * e + b * e) / 3.0 - 2.0 * c * (a + b + e) / 3.0 + c * c;
        let control = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
            .map(|[a, b, e]| [square(a, b, e), (a - c) * (b - c) * (e - c)]);
        // With x = 9 s²/4: 8 ((1 + x)^1.5 − 1)/27, without cancellation.
        let from_cusp = |s: f64| {
            let x = 2.25 * s * s;
            8.0 / 27.0 * (1.5 * x.ln_1p()).exp_m1()
        };
        (curve_of(&control, &[], 1.0), move |t: f64| {
            let signed = |s: f64| from_cusp(s).copysign(s);
            signed(t - c) - signed(-c)
        })
    }

    #[test]
    fn lengths_through_a_cusp_are_those_of_the_closed_form() {
        for c in [0.0, 0.3, 0.5, 0.77, 1.0] {
            let (curve, exact) = semicubical(c);
            for accuracy in [1e-6, 1e-9, 1e-12, 1e-14] {
                let length = CurveLength::new(&curve, accuracy);
                assert!(length.error() <= (accuracy + 1e-14) * length.total(), "{c} {accuracy:e}");
                for i in 0..=100 {
                    let t = i as f64 / 100.0;
                    let miss = (length.length(0, t) - exact(t)).abs();
                    assert!(miss <= length.error(), "{c} {accuracy:e} {t}: {miss:e} {:e}", length.error());
                }
                for i in 0..=20 {
                    let s = length.total() * i as f64 / 20.0;
                    let u = length.locate(s, accuracy).located.u;
                    assert!((exact(u) - s).abs() <= length.error() + accuracy);
                }
            }
        }
    }

    #[test]
    fn the_proven_error_holds_near_cusps_of_any_sharpness() {
        // (t − ½)² + d²: the parabola's closed form, as a cubic by elevation.
        for d in [0.1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
            // C' = (2 s, 2 d): x = s², y = 2 d s, s = t − ½.
            let parabola = curve_of(&[[0.25, -d], [-0.25, 0.0], [0.25, d]], &[], 1.0);
            let mut curve = CompositeCurve::default();
            elevate(&parabola.piece(0), 3, &mut curve);
            let half = 0.25f64.hypot(0.5 * d);
            // ∫ 2 √(s² + d²) = s √(s² + d²) + d² asinh(s/d), twice from 0 to ½.
            let exact = 2.0 * (half + d * d * (0.5 / d).asinh());
            for accuracy in [1e-5, 1e-10, 1e-13] {
                let length = CurveLength::new(&curve, accuracy);
                assert!((length.total() - exact).abs() <= length.error(), "{d:e} {accuracy:e}");
                assert!(length.error() <= 2.0 * (accuracy + 1e-14) * exact);
                assert!(length.nodes() < 400, "{}", length.nodes());
            }
        }
    }

    #[test]
    fn a_curve_that_turns_back_twice_is_measured_there_and_back() {
        // x' = 8 (t − ¼)(t − ¾): x = 8 (t³/3 − t²/2 + 3t/16).
        let x = |t: f64| 8.0 * (t * t * t / 3.0 - t * t / 2.0 + 3.0 * t / 16.0);
        let curve = curve_of(&[[0.0], [0.5], [-1.0 / 3.0], [1.0 / 6.0]], &[], 1.0);
        assert!((derivatives(&curve.piece(0), 0.3)[0][0] - x(0.3)).abs() < 1e-15);
        let length = CurveLength::new(&curve, 1e-14);
        let exact = 2.0 * x(0.25) - 2.0 * x(0.75) + x(1.0);
        assert!((length.total() - exact).abs() <= length.error(), "{:e}", length.total() - exact);
    }

    #[test]
    fn pieces_of_length_zero_have_no_length() {
        let mut curve = curve_of(&[[1.0, 1.0], [1.0, 1.0]], &[], 1.0);
        curve.push(&[[1.0, 1.0], [2.0, 1.0]], &[], 1.0);
        let length = CurveLength::new(&curve, 1e-13);
        assert_eq!((length.total(), length.length(0, 0.5)), (1.0, 0.0));
        assert_eq!(length.locate(0.25, 1e-12).piece, 1);
    }

    fn pieces() -> impl Strategy<Value = (Vec<[f64; 3]>, Vec<f64>)> {
        (1..=9usize, any::<bool>()).prop_flat_map(|(degree, rational)| {
            let weights = if rational { degree + 1 } else { 0 };
            (
                prop::collection::vec(prop::array::uniform3(-10.0..10.0f64), degree + 1),
                prop::collection::vec(0.1..10.0f64, weights),
            )
        })
    }

    proptest! {
        #[test]
        fn coarse_tables_agree_with_fine_ones_within_their_bounds((control, weights) in pieces()) {
            let curve = curve_of(&control, &weights, 2.0);
            let fine = CurveLength::new(&curve, 1e-14);
            for accuracy in [1e-3, 1e-6, 1e-10] {
                let coarse = CurveLength::new(&curve, accuracy);
                prop_assert!((coarse.total() - fine.total()).abs() <= coarse.error() + fine.error());
                prop_assert!(coarse.error() <= 1.5 * accuracy * coarse.total() + fine.error());
            }
        }

        #[test]
        fn parts_are_together_as_long_as_the_whole((control, weights) in pieces(), cut in 0.1..1.9f64) {
            let whole = curve_of(&control, &weights, 2.0);
            let mut parts = CompositeCurve::default();
            split(&whole.piece(0), &[cut], &mut parts);
            let (a, b) = (CurveLength::new(&whole, 1e-13), CurveLength::new(&parts, 1e-13));
            prop_assert!((a.total() - b.total()).abs() <= 1e-12 * a.total());
            prop_assert!((a.length(0, cut) - b.length(1, 0.0)).abs() <= 1e-12 * a.total());
        }

        #[test]
        fn the_place_at_a_length_has_that_length((control, weights) in pieces(), part in 0.0..1.0f64) {
            let length = CurveLength::new(&curve_of(&control, &weights, 2.0), 1e-13);
            let s = part * length.total();
            let place = length.locate(s, 1e-11);
            prop_assert!((length.length(place.piece, place.located.u) - s).abs() <= 1e-11);
        }
    }
}
