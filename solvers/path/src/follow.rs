//! The moves of a program as pieces, corners still sharp: lines, arcs, splines and fitted chains of lines.
//!
//! A chain is a maximal sequence of feed moves along lines that may be fitted together: one tolerance, no
//! halt in between. A change of feed inside a chain leaves the curve whole; `feed_cuts` cuts its pieces.

mod chords;
mod feed_cuts;
mod shape;

use std::ops::Range;

use rayon::prelude::*;

use crate::arc::{arc_extent, arc_pieces, Arc, ArcError};
use crate::corner::Rounding;
use crate::fit::{fit_points, FitOptions};
pub use chords::{Chord, Chords};
use feed_cuts::cut_at_feeds;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::{norm, sub};
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;
pub use shape::{Shape, Spline};

/// What a move is, in the numbers of the Python `MoveKind`.
pub const RAPID: u8 = 0;
pub const LINE: u8 = 1;
pub const ARC: u8 = 2;
pub const SPLINE: u8 = 3;

/// Moves in plain sequence that one task takes at most.
const TASK: usize = 4096;

/// A program in columns, one row per move, at most 2³² of them; lengths in mm, speeds in mm/s.
pub struct Moves<'a, const M: usize> {
    pub start: [f64; M],
    pub kind: &'a [u8],
    pub target: &'a [[f64; M]],
    pub feed: &'a [f64],
    /// Distance allowed between path and program; 0 asks for the exact path.
    pub tolerance: &'a [f64],
    /// The share of it that the fit may use; 0 keeps lines lines.
    pub fit_tolerance: &'a [f64],
    /// The tool stands still after the move.
    pub halt: &'a [bool],
    /// Arcs with the index of their move, ascending; start and end are taken from the moves.
    pub arcs: &'a [(usize, ArcShape)],
    /// Spline moves, ascending, with the pieces of `splines` that they take, from the start to the target.
    pub spline_moves: &'a [(usize, Range<usize>)],
    /// Moves that begin elsewhere than the one before ends, ascending, and where: there the axes mean something else.
    pub changes: &'a [(usize, [f64; M])],
    pub splines: &'a CompositeCurve<M>,
    /// The coordinates are positions of joints, which have a travel.
    pub joints: &'a [bool],
}

/// The arc of an arc move: plane, centre and sweep as in `arc::Arc`.
#[derive(Clone, Copy, Debug)]
pub struct ArcShape {
    pub plane: [usize; 2],
    pub centre: [f64; 2],
    pub sweep: f64,
}

/// How moves become pieces.
#[derive(Clone, Copy, Debug)]
pub struct FollowOptions {
    /// Distance from arcs that no circle meets and from helices, in mm.
    pub exact_tolerance: f64,
    /// Chords longer than this stay lines, in mm.
    pub max_chord: f64,
    /// α a_max in mm/s²: where the curvature of a chain exceeds this over F² it is broken.
    pub corner_acceleration: f64,
    /// No chain is faster than this, whatever its feed, in mm/s.
    pub max_speed: f64,
    /// Chains are smooth where they turn less than this, in rad.
    pub corner_angle: f64,
    /// What corners between two lines become.
    pub rounding: Rounding,
}

/// A piece and the moves it follows.
#[derive(Clone, Copy, Debug)]
pub struct Followed<const M: usize> {
    pub piece: Shape<M>,
    /// First and last move.
    pub first: u32,
    pub last: u32,
    pub feed: f64,
    /// Upper bound of the distance from the moves, both ways.
    pub deviation: f64,
    /// Allowed distance.
    pub tolerance: f64,
    /// The moves ask for the exact path.
    pub exact: bool,
    /// The piece stands for an arc: it may lie as far outside the box around it as it deviates.
    pub arc: bool,
}

/// A move that cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowError {
    pub index: usize,
    pub fault: Fault,
}

/// What is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The move has no length, or a coordinate is not finite.
    Length,
    /// The feed is not positive.
    Feed,
    Arc(ArcError),
    /// There is no spline for the move.
    Spline,
}

/// The pieces of a program and what was fitted.
pub struct FollowedProgram<const M: usize> {
    pub pieces: Vec<Followed<M>>,
    /// Chords that were given to the fit, splines and polynomials that came back.
    pub points: usize,
    pub splines: usize,
    pub polynomials: usize,
}

/// Consecutive moves that one task turns into pieces.
enum Span {
    Plain(usize, usize),
    Chain(usize, usize),
}

impl<const M: usize> Moves<'_, M> {
    /// Where move `i` begins.
    fn origin(&self, i: usize) -> [f64; M] {
        if let Ok(row) = self.changes.binary_search_by_key(&i, |change| change.0) {
            self.changes[row].1
        } else if i == 0 {
            self.start
        } else {
            self.target[i - 1]
        }
    }

    /// Move `i` may be fitted together with the move before.
    fn chained(&self, i: usize) -> bool {
        let fitted =
            |k: usize| self.kind[k] == LINE && self.fit_tolerance[k] > 0.0 && self.tolerance[k] > 0.0;
        fitted(i - 1)
            && fitted(i)
            && !self.halt[i - 1]
            && self.tolerance[i - 1] == self.tolerance[i]
            && self.fit_tolerance[i - 1] == self.fit_tolerance[i]
    }

    fn spans(&self) -> Vec<Span> {
        let count = self.kind.len();
        let mut spans = Vec::new();
        let (mut plain, mut i) = (0, 0);
        while i < count {
            let mut end = i + 1;
            while end < count && self.chained(end) {
                end += 1;
            }
            let chain = end - i > 1;
            if (chain || i - plain == TASK) && plain < i {
                spans.push(Span::Plain(plain, i));
                plain = i;
            }
            if chain {
                spans.push(Span::Chain(i, end));
                plain = end;
            }
            i = end;
        }
        if plain < count {
            spans.push(Span::Plain(plain, count));
        }
        spans
    }

    fn check(&self, i: usize) -> Result<(), FollowError> {
        let length = norm(&sub(&self.target[i], &self.origin(i)));
        let open = self.kind[i] != ARC && self.kind[i] != SPLINE;
        if open && !(length > 0.0 && length.is_finite()) {
            return Err(FollowError { index: i, fault: Fault::Length });
        }
        // A NaN must not pass, so the comparison asks for what is right.
        let good = self.kind[i] == RAPID || self.feed[i] > 0.0;
        if good {
            Ok(())
        } else {
            Err(FollowError { index: i, fault: Fault::Feed })
        }
    }

    /// The arc of move `i`.
    fn arc(&self, i: usize) -> Result<Arc<M>, FollowError> {
        let row = self.arcs.partition_point(|(index, _)| *index < i);
        match self.arcs.get(row) {
            Some((index, ArcShape { plane, centre, sweep })) if *index == i => Ok(Arc {
                start: self.origin(i),
                end: self.target[i],
                centre: *centre,
                plane: *plane,
                sweep: *sweep,
            }),
            _ => Err(FollowError { index: i, fault: Fault::Arc(ArcError::Sweep) }),
        }
    }

    /// The pieces of spline move `i` that have a length, with widths that together are about the length.
    fn spline(&self, i: usize) -> Result<impl Iterator<Item = Spline<M>> + '_, FollowError> {
        let row = self.spline_moves.partition_point(|(index, _)| *index < i);
        let range = match self.spline_moves.get(row) {
            Some((index, range)) if *index == i => range.clone(),
            _ => return Err(FollowError { index: i, fault: Fault::Spline }),
        };
        let sum = |length: f64, width: f64, piece: usize| {
            let piece = self.splines.piece(piece);
            let polygon = piece.control.windows(2).map(|pair| norm(&sub(&pair[1], &pair[0]))).sum::<f64>();
            (length + polygon, width + piece.width)
        };
        let (length, width) = range.clone().fold((0.0, 0.0), |(a, b), piece| sum(a, b, piece));
        if !(length > 0.0 && length.is_finite()) {
            return Err(FollowError { index: i, fault: Fault::Length });
        }
        // One factor for all keeps the derivatives continuous.
        let scale = length / width;
        Ok(range.filter_map(move |piece| Spline::new(self.splines, piece, scale)))
    }

    /// Least and greatest value of axis `k` on the arc of move `i`.
    pub fn arc_extent(&self, i: usize, k: usize) -> Option<(f64, f64)> {
        let arc = self.arc(i).ok()?;
        arc_extent(&arc, arc.plane.iter().position(|&axis| axis == k)?).ok()
    }
}

/// Every move as pieces, in order.
pub fn follow<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    watch: Watch,
) -> Result<FollowedProgram<M>, FollowError> {
    let each = watch.each(moves.kind.len());
    let parts: Vec<_> = moves
        .spans()
        .into_par_iter()
        .map(|span| match span {
            Span::Plain(first, end) => {
                each.advance(end - first);
                plain(moves, options, first, end)
            }
            Span::Chain(first, end) => chain(moves, options, first, end, each.part((end - first) as f64)),
        })
        .collect::<Result<_, _>>()?;
    let total = parts.iter().map(|part| part.pieces.len()).sum();
    let mut whole =
        FollowedProgram { pieces: Vec::with_capacity(total), points: 0, splines: 0, polynomials: 0 };
    for part in parts {
        whole.pieces.extend_from_slice(&part.pieces);
        whole.points += part.points;
        whole.splines += part.splines;
        whole.polynomials += part.polynomials;
    }
    Ok(whole)
}

/// Moves one by one: lines and arcs.
fn plain<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    first: usize,
    end: usize,
) -> Result<FollowedProgram<M>, FollowError> {
    let mut pieces = Vec::with_capacity(end - first);
    for i in first..end {
        moves.check(i)?;
        let exact = moves.tolerance[i] <= 0.0;
        let tolerance = if exact { options.exact_tolerance } else { moves.tolerance[i] };
        let feed = if moves.kind[i] == RAPID { f64::INFINITY } else { moves.feed[i] };
        let piece = Shape::Conic(Conic::line(moves.origin(i), moves.target[i]));
        let index = i as u32;
        let line =
            Followed { piece, first: index, last: index, feed, deviation: 0.0, tolerance, exact, arc: false };
        if moves.kind[i] == SPLINE {
            pieces.extend(moves.spline(i)?.map(|spline| Followed { piece: Shape::Spline(spline), ..line }));
            continue;
        }
        if moves.kind[i] != ARC {
            pieces.push(line);
            continue;
        }
        // Arcs take half of what there is, so that joints with their neighbours can be smoothed as well.
        let budget = 0.5 * tolerance.min(options.exact_tolerance);
        let (arc, deviation) = arc_pieces(&moves.arc(i)?, budget)
            .map_err(|error| FollowError { index: i, fault: Fault::Arc(error) })?;
        pieces.extend(arc.into_iter().map(|piece| Followed {
            piece: Shape::Conic(piece),
            deviation,
            arc: true,
            ..line
        }));
    }
    Ok(FollowedProgram { pieces, points: 0, splines: 0, polynomials: 0 })
}

/// A chain of lines, fitted, with one feed for each piece.
fn chain<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    first: usize,
    end: usize,
    watch: Watch,
) -> Result<FollowedProgram<M>, FollowError> {
    for i in first..end {
        moves.check(i)?;
    }
    let points: Vec<[f64; M]> =
        std::iter::once(moves.origin(first)).chain(moves.target[first..end].iter().copied()).collect();
    // The fastest block decides which curvature the chain can have without slowing the tool.
    let feed = moves.feed[first..end].iter().fold(0.0, |a: f64, &b| a.max(b)).min(options.max_speed);
    let fitted = fit_points(
        &points,
        &FitOptions {
            tolerance: moves.fit_tolerance[first],
            max_chord: options.max_chord,
            max_curvature: options.corner_acceleration / (feed * feed),
            corner_angle: options.corner_angle,
        },
        watch,
    );
    let mut pieces = Vec::with_capacity(fitted.len());
    for fit in &fitted {
        cut_at_feeds(fit, &points, &moves.feed[first..end], |piece, chords, feed| {
            pieces.push(Followed {
                piece: Shape::Conic(piece.into()),
                first: (first + chords.0) as u32,
                last: (first + chords.1) as u32,
                feed,
                deviation: fit.deviation,
                tolerance: moves.tolerance[first],
                exact: false,
                arc: false,
            });
        });
    }
    let mut splines: Vec<u32> = fitted.iter().map(|fit| fit.spline).collect();
    splines.dedup();
    Ok(FollowedProgram {
        pieces,
        points: points.len() - 1,
        splines: splines.len(),
        polynomials: fitted.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: FollowOptions = FollowOptions {
        exact_tolerance: 1e-3,
        max_chord: 5.0,
        corner_acceleration: f64::INFINITY,
        max_speed: 1e3,
        corner_angle: 0.5,
        rounding: Rounding::Parabola,
    };

    /// Moves on a circle of radius 10 in chords of 0.02 rad.
    fn circle(count: usize) -> Vec<[f64; 2]> {
        (1..=count).map(|i| (0.02 * i as f64).sin_cos()).map(|(sin, cos)| [10.0 * cos, 10.0 * sin]).collect()
    }

    fn follow_lines(
        target: &[[f64; 2]],
        feed: &[f64],
        fit_tolerance: &[f64],
        halt: &[bool],
    ) -> FollowedProgram<2> {
        let moves = Moves {
            start: [10.0, 0.0],
            kind: &vec![LINE; target.len()],
            target,
            feed,
            tolerance: &vec![0.01; target.len()],
            fit_tolerance,
            halt,
            arcs: &[],
            spline_moves: &[],
            changes: &[],
            splines: &CompositeCurve::default(),
            joints: &vec![true; target.len()],
        };
        follow(&moves, &OPTIONS, Watch::default()).unwrap()
    }

    #[test]
    fn a_change_of_feed_cuts_the_curve_at_the_vertex_and_leaves_it_whole() {
        let target = circle(100);
        let (even, halt, fit) = (vec![10.0; 100], vec![false; 100], vec![0.005; 100]);
        let whole = follow_lines(&target, &even, &fit, &halt).pieces;
        let mut feed = even;
        feed[37..].fill(20.0);
        let cut = follow_lines(&target, &feed, &fit, &halt).pieces;
        assert!(cut.len() <= whole.len() + 1 && cut.len() < 40);
        let fast = cut.iter().position(|piece| piece.feed == 20.0).unwrap();
        assert!(cut[..fast].iter().all(|piece| piece.feed == 10.0 && piece.last <= 37));
        assert!(cut[fast..].iter().all(|piece| piece.feed == 20.0 && piece.first >= 37));
        assert!(norm(&sub(cut[fast].piece.start(), &target[36])) < 0.005);
        // Both halves lie on the one curve, with one tangent.
        let unit = |edge: [f64; 2]| edge.map(|value| value / norm(&edge));
        let (out, into) = (unit(cut[fast - 1].piece.end_edge()), unit(cut[fast].piece.start_edge()));
        assert!(norm(&sub(&out, &into)) < 1e-12);
        assert_eq!(cut[fast - 1].piece.conic().unwrap().control[2], *cut[fast].piece.start());
    }

    #[test]
    fn no_piece_is_faster_than_a_block_it_covers() {
        let target = circle(200);
        let feed: Vec<f64> = (0..200).map(|i| [30.0, 10.0, 20.0][i * i % 3] + (i / 50) as f64).collect();
        let pieces = follow_lines(&target, &feed, &[0.005; 200], &[false; 200]).pieces;
        for piece in &pieces {
            let slowest =
                feed[piece.first as usize..=piece.last as usize].iter().fold(f64::MAX, |a, &b| a.min(b));
            assert_eq!(piece.feed, slowest);
        }
        for pair in pieces.windows(2) {
            assert!(pair[1].first <= pair[0].last + 1 && pair[1].last >= pair[0].last);
        }
    }

    #[test]
    fn halts_and_changes_of_tolerance_end_a_chain() {
        let target = circle(100);
        let (feed, mut halt, mut fit) = (vec![10.0; 100], vec![false; 100], vec![0.005; 100]);
        halt[29] = true;
        fit[60..].fill(0.004);
        let pieces = follow_lines(&target, &feed, &fit, &halt).pieces;
        for end in [30, 60] {
            assert!(pieces.iter().all(|piece| piece.last < end || piece.first >= end));
        }
        fit.fill(0.0);
        let lines = follow_lines(&target, &feed, &fit, &halt);
        assert_eq!((lines.pieces.len(), lines.points), (100, 0));
    }

    #[test]
    fn faults_name_their_move() {
        let mut target = circle(5);
        target[3] = target[2];
        let moves = Moves {
            start: [10.0, 0.0],
            kind: &[LINE; 5],
            target: &target,
            feed: &[1.0; 5],
            tolerance: &[0.0; 5],
            fit_tolerance: &[0.0; 5],
            halt: &[false; 5],
            arcs: &[],
            spline_moves: &[],
            changes: &[],
            splines: &CompositeCurve::default(),
            joints: &[true; 5],
        };
        let error = |moves: &Moves<2>| follow(moves, &OPTIONS, Watch::default()).err().unwrap();
        assert_eq!(error(&moves), FollowError { index: 3, fault: Fault::Length });
        let target = circle(5);
        let sound = Moves { target: &target, ..moves };
        assert!(follow(&sound, &OPTIONS, Watch::default()).is_ok());
        let no_feed = Moves { feed: &[1.0, 1.0, f64::NAN, 0.0, 1.0], ..sound };
        assert_eq!(error(&no_feed), FollowError { index: 2, fault: Fault::Feed });
        let no_arc = Moves { kind: &[LINE, ARC, LINE, LINE, LINE], feed: &[1.0; 5], ..no_feed };
        assert_eq!(error(&no_arc), FollowError { index: 1, fault: Fault::Arc(ArcError::Sweep) });
    }
}
