//! The lengths of one piece that laws refer to, as tables shared by all phases on it: of the axes, of what the feed counts, and
//! of the path. `feedplan_geometry::inverse_length` finds the place at a length.

use std::cell::{Cell, OnceCell};

use super::rate::{Line, Rate, Source, Tip, TipSpeed, MAX_TIP};
use feedplan_geometry::arc_length::{quadrature, tabulate, Integrand, Node, Table};
use feedplan_geometry::inverse_length::{self, Located};
use feedplan_geometry::newton;
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::speed::{Coefficients, Speed};
use feedplan_geometry::spline::Piece;
use feedplan_geometry::tolerance;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;

/// C' counts as 0 at an end where |C'|² is below this share of that in the middle of the phase.
pub const SLOW: f64 = 1e-8;
/// Allowed error of a table of lengths, as a share of the length of the piece; a phase may be a small part of the piece.
pub const ERROR: f64 = 0.125 * tolerance::TABLE;

/// Whose length a law refers to.
#[derive(Clone, Debug)]
pub enum Counts<const M: usize> {
    /// All axes of the piece.
    Axes,
    /// The axes, each multiplied by its share.
    Shares([f64; M]),
    /// The tool tip; the axes of the piece are joints that move it.
    Tip(TipSpeed),
}

/// A piece with its lengths, which are tabulated when they are first needed.
pub struct PiecePath<'a, const M: usize> {
    piece: Piece<'a, M>,
    feed: Counts<M>,
    way: Counts<M>,
    /// Lengths of the axes, of what the feed counts, and of the path.
    lengths: [OnceCell<Lengths<'a, M>>; 3],
    /// The last u, and the square of the length per u there; one pair for each length.
    last_square: [Cell<[f64; 2]>; 3],
}

const AXES: usize = 0;

impl<'a, const M: usize> PiecePath<'a, M> {
    /// `feed` is what the feed counts, `way` what the laws along the path count. Speed lines ignore shares.
    pub fn new(piece: Piece<'a, M>, feed: Counts<M>, way: Counts<M>) -> Self {
        let last_square = [const { Cell::new([f64::NAN; 2]) }; 3];
        Self { piece, feed, way, lengths: Default::default(), last_square }
    }

    pub(super) fn piece(&self) -> &Piece<'a, M> {
        &self.piece
    }

    fn counts(&self, law: PhaseLaw) -> (usize, &Counts<M>) {
        match (law, &self.feed, &self.way) {
            (PhaseLaw::PathJerk | PhaseLaw::SpeedCubic, _, way @ Counts::Tip(_)) => (2, way),
            (PhaseLaw::Feed, feed @ (Counts::Tip(_) | Counts::Shares(_)), _) => (1, feed),
            (PhaseLaw::SpeedLine, feed @ Counts::Tip(_), _) => (1, feed),
            _ => (AXES, &Counts::Axes),
        }
    }

    pub(super) fn is_tip(&self, law: PhaseLaw) -> bool {
        matches!(self.counts(law).1, Counts::Tip(_))
    }

    fn lengths(&self, number: usize, counts: &Counts<M>) -> &Lengths<'a, M> {
        self.lengths[number].get_or_init(|| Lengths::new(self.piece, counts))
    }

    /// The length that a law refers to.
    fn of(&self, law: PhaseLaw) -> &Lengths<'a, M> {
        let (number, counts) = self.counts(law);
        self.lengths(number, counts)
    }

    /// The length from the start of the piece to u, and the length per u there.
    pub(super) fn row(&self, law: PhaseLaw, u: f64) -> Node {
        let lengths = self.of(law);
        lengths.even.map_or_else(|| lengths.row(u), |even| Node { u, sum: even * u, rate: even })
    }

    /// The place at a length between two known places. `miss` includes the proven error of the table.
    pub(super) fn locate(&self, law: PhaseLaw, length: f64, tolerance: f64, ends: &[Node; 2]) -> Located {
        let lengths = self.of(law);
        if let Some(even) = lengths.even {
            return Located { u: length / even, ..Located::default() };
        }
        let table = lengths.table();
        let Filled { error, steepest, .. } = *lengths.filled();
        let found = inverse_length::locate(&table, length, tolerance.max(table.rounding()), ends, steepest);
        Located { miss: found.miss + error, ..found }
    }

    /// The length that a law refers to, where the square of its speed is a polynomial and the piece has no weights; else None.
    pub(super) fn polynomial_lengths(&self, law: PhaseLaw) -> Option<PolynomialLengths<'_, M>> {
        if self.piece.is_rational() {
            return None;
        }
        let (lengths, per_width) = (self.of(law), 1.0 / self.piece.width);
        let square = match (&lengths.speeds, self.counts(law).1) {
            (Speeds::Axes { coefficients, .. }, _) => Square::Axes(coefficients.hodograph()),
            (_, Counts::Tip(tip)) => Square::Tip(tip),
            _ => return None,
        };
        if lengths.even.is_some() {
            return Some(PolynomialLengths {
                square,
                per_width,
                nodes: &[],
                error: 0.0,
                steepest: 0.0,
                rounding: 0.0,
            });
        }
        let Filled { nodes, error, steepest } = lengths.filled();
        let rounding = lengths.table().rounding();
        Some(PolynomialLengths { square, per_width, nodes, error: *error, steepest: *steepest, rounding })
    }

    /// The length of a phase by a single quadrature.
    pub(super) fn rough_length(&self, phase: &Phase) -> f64 {
        quadrature(&self.rate(phase.law, Line::ONE), phase.u0, phase.u1)
    }

    /// The integrand of the time on a speed line: the time per u.
    pub(super) fn rate(&self, law: PhaseLaw, line: Line) -> Rate<'_, M> {
        self.of(law).rate(line)
    }

    /// The time per u on a speed line, with the bounds needed to build a table of its integral.
    pub(super) fn bounded(&self, law: PhaseLaw, line: Line) -> Rate<'_, M> {
        self.of(law).bounded(line)
    }

    /// Square of the length per u.
    pub(super) fn square(&self, law: PhaseLaw, u: f64) -> f64 {
        self.rate(law, Line::ONE).at(u).powi(2)
    }

    /// The length per u and its first two derivatives, from q and its first three derivatives.
    pub(super) fn slopes(&self, law: PhaseLaw, u: f64, q: &[[f64; M]; 4]) -> [f64; 3] {
        let of_axes = |q: &[[f64; M]; 4]| {
            let bend = 2.0 * (dot(&q[2], &q[2]) + dot(&q[1], &q[3]));
            [dot(&q[1], &q[1]), 2.0 * dot(&q[1], &q[2]), bend]
        };
        let [square, slope, bend] = match self.counts(law).1 {
            Counts::Axes => of_axes(q),
            Counts::Shares(share) => of_axes(&q.map(|q| times(share, &q))),
            Counts::Tip(tip) => tip.derivatives.each_ref().map(|d| d.value(u / self.piece.width)),
        };
        // A square that touches 0 may be negative by rounding.
        let g = square.max(0.0).sqrt();
        let dg = 0.5 * slope / g;
        [g, dg, (0.5 * bend - dg * dg) / g]
    }

    /// Length that a law counts of a unit displacement in this direction.
    pub(super) fn share_of(&self, law: PhaseLaw, direction: &[f64; M]) -> f64 {
        match self.counts(law).1 {
            Counts::Shares(share) => norm(&times(share, direction)),
            _ => 1.0,
        }
    }

    /// Squares of the length per u at both ends of a phase.
    pub(super) fn end_squares(&self, phase: &Phase) -> [f64; 2] {
        let (number, _) = self.counts(phase.law);
        // Most phases begin at the end of the phase before.
        let [u, known] = self.last_square[number].get();
        let first = if u == phase.u0 { known } else { self.square(phase.law, phase.u0) };
        let last = self.square(phase.law, phase.u1);
        self.last_square[number].set([phase.u1, last]);
        [first, last]
    }

    /// The place at a distance of `step` from u along the length of the axes, within `tolerance` mm, by Newton–Raphson.
    pub fn advance(&self, u: f64, step: f64, tolerance: f64) -> Located {
        let lengths = self.lengths(AXES, &Counts::Axes);
        if let Some(even) = lengths.even {
            return Located { u: u + step / even, ..Located::default() };
        }
        let table = lengths.table();
        newton::advance(&table, (u, table.integral(u)), step, tolerance).0
    }

    /// The error bound by rounding of lengths of the axes, and the proven error of their table, in mm.
    pub fn length_errors(&self) -> [f64; 2] {
        let lengths = self.lengths(AXES, &Counts::Axes);
        let rounding = match lengths.even {
            Some(even) => 4.0 * f64::EPSILON * even * self.piece.width,
            None => lengths.table().rounding(),
        };
        [rounding, lengths.error()]
    }
}

fn times<const M: usize>(a: &[f64; M], b: &[f64; M]) -> [f64; M] {
    std::array::from_fn(|k| a[k] * b[k])
}

/// The speed of a length, in mm per u.
enum Speeds<const M: usize> {
    Axes { coefficients: Coefficients<M>, width: f64 },
    Tip { square: Box<Polynomial<MAX_TIP>>, width: f64 },
}

impl<const M: usize> Speeds<M> {
    fn new(piece: &Piece<M>, counts: &Counts<M>) -> Self {
        let width = piece.width;
        let coefficients = Coefficients::new(piece);
        match counts {
            Counts::Axes => Self::Axes { coefficients, width },
            Counts::Shares(share) => Self::Axes { coefficients: coefficients.scaled(share), width },
            Counts::Tip(tip) => Self::Tip { square: Box::new(tip.derivatives[0]), width },
        }
    }

    /// The constant length per u of a line whose control points are equally spaced; else None.
    fn even(&self) -> Option<f64> {
        match self {
            Self::Axes { coefficients, width } => {
                let line = coefficients.hodograph().len() == 1 && coefficients.denominator().is_empty();
                line.then(|| norm(&coefficients.hodograph()[0]) / width)
            }
            Self::Tip { .. } => None,
        }
    }

    fn source(&self) -> Source<'_, M> {
        match self {
            Self::Tip { square, width } => Source::Tip(Tip { square, width: *width }),
            Self::Axes { coefficients, width } => {
                Source::Own(Speed::new(coefficients.hodograph(), coefficients.denominator(), *width))
            }
        }
    }
}

/// The square of the speed of a length on a piece without weights.
pub(super) enum Square<'a, const M: usize> {
    /// Of the axes: Bernstein coefficients of the hodograph times binomial coefficients.
    Axes(&'a [[f64; M]]),
    Tip(&'a TipSpeed),
}

/// A length whose squared speed is a polynomial.
pub(super) struct PolynomialLengths<'a, const M: usize> {
    pub square: Square<'a, M>,
    pub per_width: f64,
    /// The table; empty for a line.
    nodes: &'a [Node],
    /// The proven error of the table, an upper bound of the derivative of the length per u, and the rounding error bound of
    /// lengths.
    pub error: f64,
    pub steepest: f64,
    pub rounding: f64,
}

impl<const M: usize> PolynomialLengths<'_, M> {
    /// Whether the quadrature rule of the table is as accurate between these places as on the panels of the table: it is if the
    /// interval is not longer than any panel that it overlaps, since the derivative bound that gives the width of a panel holds
    /// on the whole panel.
    pub fn is_rule_good(&self, from: f64, to: f64) -> bool {
        let first = self.nodes.partition_point(|node| node.u <= from).saturating_sub(1);
        let panels = self.nodes[first.min(self.nodes.len())..].windows(2);
        panels.take_while(|ends| ends[0].u < to).all(|ends| to - from <= ends[1].u - ends[0].u)
    }
}

/// A table of a length, its proven error, and an upper bound of the derivative of the length per u.
struct Filled {
    nodes: Vec<Node>,
    error: f64,
    steepest: f64,
}

/// A length of a piece, with a table that is filled when it is first needed.
struct Lengths<'a, const M: usize> {
    piece: Piece<'a, M>,
    speeds: Speeds<M>,
    /// The length per u where it is constant, on lines.
    even: Option<f64>,
    table: OnceCell<Filled>,
    /// The last result: most phases begin at the end of the phase before.
    last: Cell<Node>,
}

impl<'a, const M: usize> Lengths<'a, M> {
    fn new(piece: Piece<'a, M>, counts: &Counts<M>) -> Self {
        let (speeds, none) = (Speeds::new(&piece, counts), Node { u: f64::NAN, sum: 0.0, rate: 0.0 });
        Self { piece, even: speeds.even(), speeds, table: OnceCell::new(), last: Cell::new(none) }
    }

    /// The length up to u, and the length per u there.
    fn row(&self, u: f64) -> Node {
        let last = self.last.get();
        if u == last.u {
            return last;
        }
        let row = self.table().row(u);
        self.last.set(row);
        row
    }

    /// The length per u divided by the square root of v².
    fn rate(&self, line: Line) -> Rate<'_, M> {
        Rate { source: self.speeds.source(), line, foot: f64::NAN }
    }

    /// The length per u divided by the square root of v², with the bounds needed to build a table, and the end of the piece where
    /// C' vanishes.
    fn bounded(&self, line: Line) -> Rate<'_, M> {
        let square = |u: f64| self.rate(Line::ONE).at(u).powi(2);
        let least = SLOW * square(0.5 * self.piece.width);
        let foot = [0.0, self.piece.width].into_iter().find(|&u| square(u) <= least).unwrap_or(f64::NAN);
        let source = match self.speeds.source() {
            Source::Own(speed) if foot.is_nan() => Source::Own(speed.without_foot()),
            Source::Own(speed) => Source::Own(speed.with_foot(foot)),
            tip => tip,
        };
        Rate { source, line, foot }
    }

    fn filled(&self) -> &Filled {
        self.table.get_or_init(|| {
            let rate = self.bounded(Line::ONE);
            let (nodes, error) = fill(rate, (0.0, self.piece.width));
            Filled { nodes, error, steepest: rate.source.steepest() }
        })
    }

    fn table(&self) -> Table<'_, Rate<'_, M>> {
        Table { f: self.rate(Line::ONE), nodes: &self.filled().nodes }
    }

    fn error(&self) -> f64 {
        self.even.map_or_else(|| self.filled().error, |_| 0.0)
    }
}

/// A table of the integral of f between two ends, and its proven error.
pub(super) fn fill<F: Integrand>(f: F, ends: (f64, f64)) -> (Vec<Node>, f64) {
    let (estimate, mut nodes) = (quadrature(&f, ends.0, ends.1), Vec::new());
    let error = tabulate(f, ends.0, ends.1, ERROR * estimate, &mut nodes);
    (nodes, error)
}
