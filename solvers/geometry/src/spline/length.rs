//! The length of a curve of any degree, and the place at a given length, from one table (`arc_length`) per piece.
//!
//! Panels are halved towards cusps and near-cusps. The error bound of quadratic pieces is in closed form (`QuadraticSpeed`); that
//! of other pieces comes from `speed`.

use super::cusps::piece_cusps;
use super::speed::{Coefficients, Speed};
use super::{CompositeCurve, Piece};
use crate::arc_length::{quadrature, tabulate, Node, QuadraticSpeed, Table};
use crate::instances;
use crate::inverse_length;
use crate::parallel::map;
use crate::tolerance::CUSP;
use crate::watch::Watch;

instances! {
    /// Curves whose lengths can be measured.
    pub trait Measured for [3, 9] CompositeCurve<M> = {
        /// See `CurveLength::new`.
        fn lengths(&self, accuracy: f64, watch: Watch) -> CurveLength<M> = CurveLength::new;
    }
}

/// The integrand |C'| of a piece's table.
#[derive(Clone, Copy, Debug)]
enum PieceSpeed {
    Quadratic(QuadraticSpeed),
    /// The ranges of its coefficients in `h` and in `omega` of `CurveLength`.
    Curve([usize; 2], [usize; 2]),
}

/// The lengths along a curve, piece after piece.
#[derive(Clone, Debug)]
pub struct CurveLength<const M: usize> {
    speeds: Vec<PieceSpeed>,
    /// Coefficients of hodographs and of their denominators.
    h: Vec<[f64; M]>,
    omega: Vec<f64>,
    width: Vec<f64>,
    nodes: Vec<Node>,
    /// The first node of each piece; the last entry is the number of nodes.
    tables: Vec<usize>,
    /// Length up to the start of each piece, then the total length; in mm.
    starts: Vec<f64>,
    error: f64,
}

/// Evaluates an expression with the table of a piece, whose type depends on the piece.
macro_rules! on_table {
    ($lengths:expr, $piece:expr, $table:ident, $call:expr) => {{
        let nodes = &$lengths.nodes[$lengths.tables[$piece]..$lengths.tables[$piece + 1]];
        match $lengths.speeds[$piece] {
            PieceSpeed::Quadratic(f) => {
                let $table = Table { f, nodes };
                $call
            }
            PieceSpeed::Curve(h, omega) => {
                let f = $lengths.speed(h, omega, $piece);
                let $table = Table { f, nodes };
                $call
            }
        }
    }};
}

impl<const M: usize> CurveLength<M> {
    /// The tables of all pieces, of which there must be one at least; the error of each is `accuracy` times its length.
    pub fn new(curve: &CompositeCurve<M>, accuracy: f64, watch: Watch) -> Self {
        let count = curve.len();
        let mut lengths = Self {
            speeds: Vec::with_capacity(count),
            h: vec![],
            omega: vec![],
            width: curve.width.clone(),
            nodes: Vec::with_capacity(3 * count),
            tables: vec![0],
            starts: vec![0.0],
            error: 0.0,
        };
        for piece in curve.pieces() {
            lengths.speeds.push(match piece.quadratic() {
                Some(quadratic) => PieceSpeed::Quadratic(QuadraticSpeed::new(&quadratic)),
                None => {
                    let coefficients = Coefficients::new(&piece);
                    let (h, omega) = (lengths.h.len(), lengths.omega.len());
                    lengths.h.extend_from_slice(coefficients.hodograph());
                    lengths.omega.extend_from_slice(coefficients.denominator());
                    PieceSpeed::Curve([h, lengths.h.len()], [omega, lengths.omega.len()])
                }
            });
        }
        let tables = map(count, 64, |i| {
            watch.each(count).count(i);
            match lengths.speeds[i] {
                PieceSpeed::Quadratic(f) => {
                    let mut nodes = vec![];
                    let allowed = accuracy * quadrature(&f, 0.0, curve.width[i]);
                    let bound = tabulate(f, 0.0, curve.width[i], allowed, &mut nodes);
                    (nodes, bound)
                }
                PieceSpeed::Curve(h, omega) => table(lengths.speed(h, omega, i), &curve.piece(i), accuracy),
            }
        });
        // Neumaier's sum: the rounding errors of many additions are carried along.
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

    fn speed(&self, h: [usize; 2], omega: [usize; 2], piece: usize) -> Speed<'_, M> {
        Speed::new(&self.h[h[0]..h[1]], &self.omega[omega[0]..omega[1]], self.width[piece])
    }

    /// The length of the curve in mm.
    pub fn total(&self) -> f64 {
        self.starts[self.starts.len() - 1]
    }

    /// The bound of the error of each length on the curve, in mm: it is proven for the quadrature, and includes eight roundings
    /// for the evaluation.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Length from the start of the curve to parameter u of a piece, in mm.
    pub fn length(&self, piece: usize, u: f64) -> f64 {
        self.starts[piece] + on_table!(self, piece, table, table.integral(u))
    }

    /// The piece and the parameter at a length, within `tolerance` mm; for a length beyond an end that end.
    pub fn locate(&self, length: f64, tolerance: f64) -> (usize, f64) {
        let last = self.width.len() - 1;
        let piece = self.starts[1..=last].partition_point(|&start| start <= length);
        let rest = length - self.starts[piece];
        (
            piece,
            on_table!(
                self,
                piece,
                table,
                inverse_length::locate(&table, rest, tolerance, &[], f64::INFINITY)
            )
            .u,
        )
    }

    /// Lengths up to many places, in mm, computed in parallel.
    pub fn lengths(&self, pieces: &[u32], u: &[f64]) -> Vec<f64> {
        map(pieces.len(), 1024, |i| self.length(pieces[i] as usize, u[i]))
    }

    /// The places at many lengths, computed in parallel.
    pub fn locate_all(&self, lengths: &[f64], tolerance: f64) -> Vec<(usize, f64)> {
        map(lengths.len(), 1024, |i| self.locate(lengths[i], tolerance))
    }
}

/// The table of one piece and the bound of its error. Each cusp of the piece has its own part of the table.
fn table<const M: usize>(speed: Speed<M>, piece: &Piece<M>, accuracy: f64) -> (Vec<Node>, f64) {
    let mut nodes: Vec<Node> = vec![];
    let width = piece.width;
    let estimate = quadrature(&speed, 0.0, width);
    if speed.is_zero() {
        return (vec![Node { u: 0.0, sum: 0.0, rate: 0.0 }, Node { u: width, sum: 0.0, rate: 0.0 }], 0.0);
    }
    let feet = piece_cusps(piece, CUSP);
    let mut bound = 0.0;
    for (i, foot) in feet.iter().map(|t| t * width).chain(feet.is_empty().then_some(f64::NAN)).enumerate() {
        let start = nodes.last().map_or(0.0, |node| node.u);
        let end = feet.get(i + 1).map_or(width, |next| 0.5 * (foot + next * width));
        let part = if foot.is_nan() { speed.without_foot() } else { speed.with_foot(foot) };
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
    use crate::spline::MAX_DEGREE;
    use proptest::prelude::*;

    fn curve_of<const M: usize>(control: &[[f64; M]], weights: &[f64], width: f64) -> CompositeCurve<M> {
        let mut curve = CompositeCurve::default();
        curve.push(control, weights, width);
        curve
    }

    #[test]
    fn a_line_is_as_long_as_its_ends_are_apart() {
        let length =
            CurveLength::new(&curve_of(&[[1.0, 2.0], [4.0, 6.0]], &[], 7.0), 1e-14, Watch::default());
        assert!((length.total() - 5.0).abs() < 1e-15 && length.nodes.len() == 2);
        assert!((length.locate(2.0, 1e-15).1 - 2.8).abs() < 1e-15);
    }

    #[test]
    fn the_unit_parabola_has_its_known_length() {
        let length = CurveLength::new(
            &curve_of(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.5]], &[], 1.0),
            1e-14,
            Watch::default(),
        );
        let expected = 0.5 * (2f64.sqrt() + 1f64.asinh());
        assert!((length.total() - expected).abs() < 4e-16, "{:e}", length.total() - expected);
        assert!(length.error() < 1e-13);
    }

    #[test]
    fn a_quarter_circle_has_its_known_length_at_every_place() {
        let quarter = curve_of(&[[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], &[1.0, FRAC_1_SQRT_2, 1.0], 1.0);
        let length = CurveLength::new(&quarter, 1e-14, Watch::default());
        assert!((length.total() - FRAC_PI_2).abs() < 1e-15);
        for i in 0..=40 {
            let (_, u) = length.locate(FRAC_PI_2 * i as f64 / 40.0, 1e-15);
            let [x, y] = derivatives(&quarter.piece(0), u)[0];
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
                let length = CurveLength::new(&curve, accuracy, Watch::default());
                assert!(length.error() <= (accuracy + 1e-14) * length.total(), "{c} {accuracy:e}");
                for i in 0..=100 {
                    let t = i as f64 / 100.0;
                    let miss = (length.length(0, t) - exact(t)).abs();
                    assert!(miss <= length.error(), "{c} {accuracy:e} {t}: {miss:e} {:e}", length.error());
                }
                for i in 0..=20 {
                    let s = length.total() * i as f64 / 20.0;
                    let (_, u) = length.locate(s, accuracy);
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
                let length = CurveLength::new(&curve, accuracy, Watch::default());
                assert!((length.total() - exact).abs() <= length.error(), "{d:e} {accuracy:e}");
                assert!(length.error() <= 2.0 * (accuracy + 1e-14) * exact);
                assert!(length.nodes.len() < 400, "{}", length.nodes.len());
            }
        }
    }

    #[test]
    fn a_curve_that_turns_back_twice_is_measured_there_and_back() {
        // x' = 8 (t − ¼)(t − ¾): x = 8 (t³/3 − t²/2 + 3t/16).
        let x = |t: f64| 8.0 * (t * t * t / 3.0 - t * t / 2.0 + 3.0 * t / 16.0);
        let curve = curve_of(&[[0.0], [0.5], [-1.0 / 3.0], [1.0 / 6.0]], &[], 1.0);
        assert!((derivatives(&curve.piece(0), 0.3)[0][0] - x(0.3)).abs() < 1e-15);
        let length = CurveLength::new(&curve, 1e-14, Watch::default());
        let exact = 2.0 * x(0.25) - 2.0 * x(0.75) + x(1.0);
        assert!((length.total() - exact).abs() <= length.error(), "{:e}", length.total() - exact);
    }

    #[test]
    fn pieces_of_length_zero_have_no_length() {
        let mut curve = curve_of(&[[1.0, 1.0], [1.0, 1.0]], &[], 1.0);
        curve.push(&[[1.0, 1.0], [2.0, 1.0]], &[], 1.0);
        let length = CurveLength::new(&curve, 1e-13, Watch::default());
        assert_eq!((length.total(), length.length(0, 0.5)), (1.0, 0.0));
        assert_eq!(length.locate(0.25, 1e-12).0, 1);
    }

    fn pieces() -> impl Strategy<Value = (Vec<[f64; 3]>, Vec<f64>)> {
        (1..=MAX_DEGREE, any::<bool>()).prop_flat_map(|(degree, rational)| {
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
            let fine = CurveLength::new(&curve, 1e-14, Watch::default());
            for accuracy in [1e-3, 1e-6, 1e-10] {
                let coarse = CurveLength::new(&curve, accuracy, Watch::default());
                prop_assert!((coarse.total() - fine.total()).abs() <= coarse.error() + fine.error());
                prop_assert!(coarse.error() <= 1.5 * accuracy * coarse.total() + fine.error());
            }
        }

        #[test]
        fn parts_are_together_as_long_as_the_whole((control, weights) in pieces(), cut in 0.1..1.9f64) {
            let whole = curve_of(&control, &weights, 2.0);
            let mut parts = CompositeCurve::default();
            split(&whole.piece(0), &[cut], &mut parts);
            let (a, b) = (CurveLength::new(&whole, 1e-13, Watch::default()), CurveLength::new(&parts, 1e-13, Watch::default()));
            prop_assert!((a.total() - b.total()).abs() <= 1e-12 * a.total());
            prop_assert!((a.length(0, cut) - b.length(1, 0.0)).abs() <= 1e-12 * a.total());
        }

        #[test]
        fn the_place_at_a_length_has_that_length((control, weights) in pieces(), part in 0.0..1.0f64) {
            let length = CurveLength::new(&curve_of(&control, &weights, 2.0), 1e-13, Watch::default());
            let s = part * length.total();
            let (piece, u) = length.locate(s, 1e-11);
            prop_assert!((length.length(piece, u) - s).abs() <= 1e-11);
        }
    }
}
