//! The moves of a program as pieces, corners still sharp: lines, arcs and fitted chains of lines.
//!
//! A chain is a maximal sequence of feed moves along lines that may be fitted together: one tolerance, no
//! halt in between. A change of feed inside a chain leaves the curve whole; the piece is cut where it passes
//! the programmed point, so that every piece has one feed and none is faster than a block it covers.

use rayon::prelude::*;

use crate::arc::{arc_extent, arc_pieces, Arc, ArcError};
use crate::fit::{fit_points, FitOptions, FittedPiece};
use crate::quadratic::{dot, norm, sub, Quadratic};

/// What a move is, in the numbers of the Python `MoveKind`.
pub const RAPID: u8 = 0;
pub const LINE: u8 = 1;
pub const ARC: u8 = 2;

/// Moves in plain sequence that one task takes at most.
const TASK: usize = 4096;
/// Parts of a piece that are shorter than this share of it are not cut off.
const SLIVER: f64 = 1e-6;

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
    /// Distance from arcs that are to be followed exactly, in mm.
    pub exact_tolerance: f64,
    /// Chords longer than this stay lines, in mm.
    pub max_chord: f64,
    /// α a_max in mm/s²: where the curvature of a chain exceeds this over F² it is broken.
    pub corner_acceleration: f64,
    /// No chain is faster than this, whatever its feed, in mm/s.
    pub max_speed: f64,
    /// Chains are smooth where they turn less than this, in rad.
    pub corner_angle: f64,
}

/// A piece and the moves it follows.
#[derive(Clone, Copy, Debug)]
pub struct Followed<const M: usize> {
    pub piece: Quadratic<M>,
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
    /// Start or end of an arc is its centre.
    Radius,
    /// The sweep of an arc is missing or does not lead to its end.
    Sweep,
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
        if i == 0 {
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
        if self.kind[i] != ARC && !(length > 0.0 && length.is_finite()) {
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
            _ => Err(FollowError { index: i, fault: Fault::Sweep }),
        }
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
) -> Result<FollowedProgram<M>, FollowError> {
    let parts: Vec<_> = moves
        .spans()
        .into_par_iter()
        .map(|span| match span {
            Span::Plain(first, end) => plain(moves, options, first, end),
            Span::Chain(first, end) => chain(moves, options, first, end),
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
        let piece = Quadratic::line(moves.origin(i), moves.target[i]);
        let index = i as u32;
        let line =
            Followed { piece, first: index, last: index, feed, deviation: 0.0, tolerance, exact, arc: false };
        if moves.kind[i] != ARC {
            pieces.push(line);
            continue;
        }
        // Arcs take half of what there is, so that joints with their neighbours can be smoothed as well.
        let budget = 0.5 * tolerance.min(options.exact_tolerance);
        let (arc, deviation) = arc_pieces(&moves.arc(i)?, budget).map_err(|error| FollowError {
            index: i,
            fault: if error == ArcError::Radius { Fault::Radius } else { Fault::Sweep },
        })?;
        pieces.extend(arc.into_iter().map(|piece| Followed { piece, deviation, arc: true, ..line }));
    }
    Ok(FollowedProgram { pieces, points: 0, splines: 0, polynomials: 0 })
}

/// A chain of lines, fitted, with one feed for each piece.
fn chain<const M: usize>(
    moves: &Moves<M>,
    options: &FollowOptions,
    first: usize,
    end: usize,
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
    );
    let mut pieces = Vec::with_capacity(fitted.len());
    for fit in &fitted {
        cut_at_feeds(fit, &points, &moves.feed[first..end], |piece, chords, feed| {
            pieces.push(Followed {
                piece,
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

/// Cuts a piece where it passes the points at which the feed changes; `emit` gets part, chords and feed.
fn cut_at_feeds<const M: usize>(
    fit: &FittedPiece<M>,
    points: &[[f64; M]],
    feed: &[f64],
    mut emit: impl FnMut(Quadratic<M>, (usize, usize), f64),
) {
    let width = fit.piece.width;
    let (mut begin, mut chord, mut slowest) = (0.0, fit.first, feed[fit.first]);
    for k in fit.first + 1..=fit.last {
        if feed[k] != feed[k - 1] {
            let u = nearest(&fit.piece, &points[k]);
            if u - begin > SLIVER * width && width - u > SLIVER * width {
                emit(fit.piece.part(begin, u), (chord, k - 1), slowest);
                (begin, chord, slowest) = (u, k, f64::INFINITY);
            }
        }
        slowest = slowest.min(feed[k]);
    }
    let rest = if begin == 0.0 { fit.piece } else { fit.piece.part(begin, width) };
    emit(rest, (chord, fit.last), slowest);
}

/// The parameter at which a piece comes nearest to a point: the best of a few samples, then bisection of the
/// derivative of the distance around it.
fn nearest<const M: usize>(piece: &Quadratic<M>, point: &[f64; M]) -> f64 {
    const SAMPLES: usize = 8;
    let (start, end) = piece.end_tangents();
    let away = |u: f64| {
        let t = u / piece.width;
        let tangent: [f64; M] = std::array::from_fn(|k| start[k] + t * (end[k] - start[k]));
        dot(&tangent, &sub(&piece.point(u), point))
    };
    let step = piece.width / SAMPLES as f64;
    let distance = |i: usize| norm(&sub(&piece.point(i as f64 * step), point));
    let best = (0..=SAMPLES).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    let mut low = step * best.saturating_sub(1) as f64;
    let mut high = (step * (best + 1) as f64).min(piece.width);
    if away(low) >= 0.0 {
        return low;
    }
    if away(high) <= 0.0 {
        return high;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if away(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}
