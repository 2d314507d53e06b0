//! The moves of a program as pieces with sharp corners: lines, arcs, splines, and splines fitted to chains of lines.
//!
//! A chain is a maximal sequence of G1 lines with one tolerance and without a halt. A change of feed does not end it: the fitted
//! curve is the same, and a piece is cut where the feed changes (`feed_cuts`).

mod feed_cuts;

use std::ops::{AddAssign, Range};

use crate::fit::{fit_points, FitOptions};
use crate::moves::{MoveError, Moves, PathOptions, ARC, LINE, SPLINE};
use crate::path_piece::{PathPiece, Shape};
use feed_cuts::cut_at_feeds;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::parallel::try_map;
use feedplan_geometry::watch::Watch;

/// The greatest number of moves outside of chains in a task.
const TASK: usize = 4096;

/// The pieces of a program, and the counts of what was fitted.
#[derive(Default)]
pub struct ProgramPieces<const M: usize> {
    pub pieces: Vec<PathPiece<M>>,
    pub fit: FitCounts,
}

/// The numbers of fitted chords, of splines fitted to them, and of the polynomials of these splines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitCounts {
    pub chords: usize,
    pub splines: usize,
    pub polynomials: usize,
}

impl AddAssign for FitCounts {
    fn add_assign(&mut self, other: Self) {
        self.chords += other.chords;
        self.splines += other.splines;
        self.polynomials += other.polynomials;
    }
}

impl<const M: usize> Moves<'_, M> {
    /// Whether move `i` and the move before it belong to one chain.
    fn chained(&self, i: usize) -> bool {
        let fitted =
            |k: usize| self.kind[k] == LINE && self.fit_tolerance[k] > 0.0 && self.tolerance[k] > 0.0;
        fitted(i - 1)
            && fitted(i)
            && !self.halt[i - 1]
            && self.tolerance[i - 1] == self.tolerance[i]
            && self.fit_tolerance[i - 1] == self.fit_tolerance[i]
    }

    /// Whether consecutive moves, either all of one chain or all outside of chains, are a chain.
    fn is_chain(&self, moves: &Range<usize>) -> bool {
        moves.len() > 1 && self.chained(moves.start + 1)
    }

    /// All moves in order, cut into chains and into ranges of moves outside of chains.
    fn tasks(&self) -> Vec<Range<usize>> {
        let mut tasks: Vec<Range<usize>> = Vec::new();
        let mut i = 0;
        while i < self.kind.len() {
            let mut end = i + 1;
            while end < self.kind.len() && self.chained(end) {
                end += 1;
            }
            let grows = |last: &&mut Range<usize>| end - i == 1 && last.len() < TASK && !self.is_chain(last);
            match tasks.last_mut().filter(grows) {
                Some(last) => last.end = end,
                None => tasks.push(i..end),
            }
            i = end;
        }
        tasks
    }
}

/// The pieces of all moves, in order.
pub fn program_pieces<const M: usize>(
    moves: &Moves<M>,
    options: &PathOptions,
    watch: Watch,
) -> Result<ProgramPieces<M>, MoveError> {
    let each = watch.each(moves.kind.len());
    let tasks = moves.tasks();
    let parts = try_map(tasks.len(), 1, |i| {
        let range = tasks[i].clone();
        if moves.is_chain(&range) {
            let watch = each.part(range.len() as f64);
            return chain(moves, options, range, watch);
        }
        each.advance(range.len());
        one_by_one(moves, options, range)
    })?;
    let total = parts.iter().map(|part| part.pieces.len()).sum();
    let mut whole = ProgramPieces { pieces: Vec::with_capacity(total), ..ProgramPieces::default() };
    for part in parts {
        whole.pieces.extend_from_slice(&part.pieces);
        whole.fit += part.fit;
    }
    Ok(whole)
}

/// The pieces of moves that are not fitted.
fn one_by_one<const M: usize>(
    moves: &Moves<M>,
    options: &PathOptions,
    range: Range<usize>,
) -> Result<ProgramPieces<M>, MoveError> {
    let mut pieces = Vec::with_capacity(range.len());
    for i in range {
        moves.check(i)?;
        let (exact, tolerance) = moves.allowed(i, options);
        let shape = Shape::Conic(Conic::line(moves.origin(i), moves.target[i]));
        let index = i as u32;
        let line = PathPiece {
            shape,
            first: index,
            last: index,
            feed: moves.feed_of(i),
            deviation: 0.0,
            tolerance,
            exact,
            arc: false,
        };
        if moves.kind[i] == SPLINE {
            pieces.extend(moves.spline(i)?.map(|spline| PathPiece { shape: Shape::Spline(spline), ..line }));
            continue;
        }
        if moves.kind[i] != ARC {
            pieces.push(line);
            continue;
        }
        // One half of the tolerance; the other is left for blends with the neighbours.
        let budget = 0.5 * tolerance.min(options.exact_tolerance);
        let (arc, deviation) = moves.arc_pieces(i, budget)?;
        pieces.extend(arc.into_iter().map(|piece| PathPiece {
            shape: Shape::Conic(piece),
            deviation,
            arc: true,
            ..line
        }));
    }
    Ok(ProgramPieces { pieces, fit: FitCounts::default() })
}

/// The pieces of a chain, each with one feed.
fn chain<const M: usize>(
    moves: &Moves<M>,
    options: &PathOptions,
    range: Range<usize>,
    watch: Watch,
) -> Result<ProgramPieces<M>, MoveError> {
    let Range { start: first, end } = range;
    for i in range.clone() {
        moves.check(i)?;
    }
    let points: Vec<[f64; M]> =
        std::iter::once(moves.origin(first)).chain(moves.target[range.clone()].iter().copied()).collect();
    // The greatest feed decides which curvature the chain may have without slowing the tool down.
    let feed = moves.feed[range.clone()].iter().fold(0.0, |a: f64, &b| a.max(b)).min(options.max_speed);
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
            pieces.push(PathPiece {
                shape: Shape::Conic(piece.into()),
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
    let fit = FitCounts { chords: end - first, splines: splines.len(), polynomials: fitted.len() };
    Ok(ProgramPieces { pieces, fit })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arc::ArcError;
    use crate::corner::Rounding;
    use crate::moves::MoveFault;
    use feedplan_geometry::quadratic::{norm, sub};
    use feedplan_geometry::spline::CompositeCurve;

    const OPTIONS: PathOptions = PathOptions {
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

    fn pieces_of_lines(
        target: &[[f64; 2]],
        feed: &[f64],
        fit_tolerance: &[f64],
        halt: &[bool],
    ) -> ProgramPieces<2> {
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
        program_pieces(&moves, &OPTIONS, Watch::default()).unwrap()
    }

    #[test]
    fn a_change_of_feed_cuts_the_curve_at_the_vertex_and_leaves_it_whole() {
        let target = circle(100);
        let (even, halt, fit) = (vec![10.0; 100], vec![false; 100], vec![0.005; 100]);
        let whole = pieces_of_lines(&target, &even, &fit, &halt).pieces;
        let mut feed = even;
        feed[37..].fill(20.0);
        let cut = pieces_of_lines(&target, &feed, &fit, &halt).pieces;
        assert!(cut.len() <= whole.len() + 1 && cut.len() < 40);
        let fast = cut.iter().position(|piece| piece.feed == 20.0).unwrap();
        assert!(cut[..fast].iter().all(|piece| piece.feed == 10.0 && piece.last <= 37));
        assert!(cut[fast..].iter().all(|piece| piece.feed == 20.0 && piece.first >= 37));
        assert!(norm(&sub(cut[fast].shape.start(), &target[36])) < 0.005);
        // Both halves lie on one curve and have the same tangent where they meet.
        let unit = |edge: [f64; 2]| edge.map(|value| value / norm(&edge));
        let (out, into) = (unit(cut[fast - 1].shape.end_edge()), unit(cut[fast].shape.start_edge()));
        assert!(norm(&sub(&out, &into)) < 1e-12);
        assert_eq!(cut[fast - 1].shape.conic().unwrap().control[2], *cut[fast].shape.start());
    }

    #[test]
    fn no_piece_is_faster_than_a_block_it_covers() {
        let target = circle(200);
        let feed: Vec<f64> = (0..200).map(|i| [30.0, 10.0, 20.0][i * i % 3] + (i / 50) as f64).collect();
        let pieces = pieces_of_lines(&target, &feed, &[0.005; 200], &[false; 200]).pieces;
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
        let pieces = pieces_of_lines(&target, &feed, &fit, &halt).pieces;
        for end in [30, 60] {
            assert!(pieces.iter().all(|piece| piece.last < end || piece.first >= end));
        }
        fit.fill(0.0);
        let lines = pieces_of_lines(&target, &feed, &fit, &halt);
        assert_eq!((lines.pieces.len(), lines.fit.chords), (100, 0));
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
        let error = |moves: &Moves<2>| program_pieces(moves, &OPTIONS, Watch::default()).err().unwrap();
        assert_eq!(error(&moves), MoveError { index: 3, fault: MoveFault::Length });
        let target = circle(5);
        let sound = Moves { target: &target, ..moves };
        assert!(program_pieces(&sound, &OPTIONS, Watch::default()).is_ok());
        let no_feed = Moves { feed: &[1.0, 1.0, f64::NAN, 0.0, 1.0], ..sound };
        assert_eq!(error(&no_feed), MoveError { index: 2, fault: MoveFault::Feed });
        let no_arc = Moves { kind: &[LINE, ARC, LINE, LINE, LINE], feed: &[1.0; 5], ..no_feed };
        assert_eq!(error(&no_arc), MoveError { index: 1, fault: MoveFault::Arc(ArcError::Sweep) });
    }
}
