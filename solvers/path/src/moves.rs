//! A program as columns of moves, and the reasons why a move has no path.

use std::ops::Range;

use crate::arc::{arc_extent, arc_pieces, Arc, ArcError};
use crate::corner::Rounding;
use crate::path_piece::Spline;
use feedplan_geometry::conic::Conic;
use feedplan_geometry::quadratic::{norm, sub};
use feedplan_geometry::spline::CompositeCurve;

/// The kind of a move, numbered like the Python `MoveKind`.
pub const RAPID: u8 = 0;
pub const LINE: u8 = 1;
pub const ARC: u8 = 2;
pub const SPLINE: u8 = 3;

/// A program in columns, one row per move, at most 2³² of them; lengths in mm, speeds in mm/s.
pub struct Moves<'a, const M: usize> {
    pub start: [f64; M],
    pub kind: &'a [u8],
    pub target: &'a [[f64; M]],
    pub feed: &'a [f64],
    /// Allowed distance between path and program in mm; 0 asks for the exact path.
    pub tolerance: &'a [f64],
    /// The part of that tolerance that the fit of chains may use, in mm; with 0 lines are not fitted.
    pub fit_tolerance: &'a [f64],
    /// Whether the tool stops at the end of the move.
    pub halt: &'a [bool],
    /// Arcs with the index of their move, ascending; their start and end come from the moves.
    pub arcs: &'a [(usize, ArcShape)],
    /// Spline moves, ascending, with the range of the pieces of `splines` that they follow, from the start to the target.
    pub spline_moves: &'a [(usize, Range<usize>)],
    /// Moves that do not begin where the one before ends, ascending, with their starts: the meaning of the axis words changes
    /// there.
    pub changes: &'a [(usize, [f64; M])],
    pub splines: &'a CompositeCurve<M>,
    /// Whether the coordinates are positions of joints, which have a travel.
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
pub struct PathOptions {
    /// Allowed distance from helices, and from arcs that are not exactly circles, in mm; also the tolerance of exact moves.
    pub exact_tolerance: f64,
    /// Chords longer than this stay lines, in mm.
    pub max_chord: f64,
    /// α a_max in mm/s²: a chain is broken where its curvature exceeds this divided by the square of the feed.
    pub corner_acceleration: f64,
    /// No chain is followed faster than this, whatever its feed, in mm/s.
    pub max_speed: f64,
    /// Chains stay smooth where they turn by less than this angle, in rad.
    pub corner_angle: f64,
    /// What corners between two lines become.
    pub rounding: Rounding,
}

/// A move that has no path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MoveError {
    pub index: usize,
    pub fault: MoveFault,
}

/// What is wrong with a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MoveFault {
    /// The move has no length, or a coordinate is not finite.
    Length,
    /// The feed is not positive.
    Feed,
    Arc(ArcError),
    /// There is no spline for the move.
    Spline,
}

/// The value for move `i` in a list that is sorted by moves.
pub fn of_move<T>(list: &[(usize, T)], i: usize) -> Option<&T> {
    list.binary_search_by_key(&i, |row| row.0).ok().map(|row| &list[row].1)
}

impl<const M: usize> Moves<'_, M> {
    /// Where move `i` begins.
    pub fn origin(&self, i: usize) -> [f64; M] {
        match (of_move(self.changes, i), i) {
            (Some(start), _) => *start,
            (None, 0) => self.start,
            (None, _) => self.target[i - 1],
        }
    }

    /// Checks that move `i` has a feed and, if it is a line, a length.
    pub fn check(&self, i: usize) -> Result<(), MoveError> {
        let length = norm(&sub(&self.target[i], &self.origin(i)));
        let straight = self.kind[i] != ARC && self.kind[i] != SPLINE;
        if straight && !(length > 0.0 && length.is_finite()) {
            return Err(MoveError { index: i, fault: MoveFault::Length });
        }
        // NaN is no feed either.
        let has_feed = self.kind[i] == RAPID || self.feed[i] > 0.0;
        has_feed.then_some(()).ok_or(MoveError { index: i, fault: MoveFault::Feed })
    }

    /// The feed of move `i` in mm/s; infinite for rapids.
    pub fn feed_of(&self, i: usize) -> f64 {
        if self.kind[i] == RAPID {
            f64::INFINITY
        } else {
            self.feed[i]
        }
    }

    /// Whether move `i` asks for the exact path, and the allowed distance from it in mm.
    pub fn allowed(&self, i: usize, options: &PathOptions) -> (bool, f64) {
        let exact = self.tolerance[i] <= 0.0;
        (exact, if exact { options.exact_tolerance } else { self.tolerance[i] })
    }

    /// The arc of move `i` as pieces within `tolerance`, and the bound of their distance from it, in mm.
    pub fn arc_pieces(&self, i: usize, tolerance: f64) -> Result<(Vec<Conic<M>>, f64), MoveError> {
        arc_pieces(&self.arc(i)?, tolerance)
            .map_err(|error| MoveError { index: i, fault: MoveFault::Arc(error) })
    }

    /// The arc of move `i`.
    fn arc(&self, i: usize) -> Result<Arc<M>, MoveError> {
        let none = MoveError { index: i, fault: MoveFault::Arc(ArcError::Sweep) };
        let ArcShape { plane, centre, sweep } = *of_move(self.arcs, i).ok_or(none)?;
        Ok(Arc { start: self.origin(i), end: self.target[i], centre, plane, sweep })
    }

    /// The pieces of spline move `i` that have a length, their widths scaled so that the sum is about the length of the spline.
    pub fn spline(&self, i: usize) -> Result<impl Iterator<Item = Spline<M>> + '_, MoveError> {
        let none = MoveError { index: i, fault: MoveFault::Spline };
        let range = of_move(self.spline_moves, i).ok_or(none)?.clone();
        let sum = |length: f64, width: f64, piece: usize| {
            let piece = self.splines.piece(piece);
            let polygon = piece.control.windows(2).map(|pair| norm(&sub(&pair[1], &pair[0]))).sum::<f64>();
            (length + polygon, width + piece.width)
        };
        let (length, width) = range.clone().fold((0.0, 0.0), |(a, b), piece| sum(a, b, piece));
        if !(length > 0.0 && length.is_finite()) {
            return Err(MoveError { index: i, fault: MoveFault::Length });
        }
        // One factor for all pieces keeps the derivatives continuous.
        let scale = length / width;
        Ok(range.filter_map(move |piece| Spline::new(self.splines, piece, scale)))
    }

    /// Least and greatest value of axis `k` on the arc of move `i`.
    pub fn arc_extent(&self, i: usize, k: usize) -> Option<(f64, f64)> {
        let arc = self.arc(i).ok()?;
        arc_extent(&arc, arc.plane.iter().position(|&axis| axis == k)?).ok()
    }
}
