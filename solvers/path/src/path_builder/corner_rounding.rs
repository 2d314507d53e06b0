//! Rounds the corners of a path within the tolerance: each blend replaces the ends of the pieces on both sides of it.
//!
//! A corner is a place between two pieces that do not meet smoothly, a halt, or an end of the path. Span k consists of the pieces
//! between corner k and corner k + 1; its stations are sums of widths. Each step is done for many corners in parallel, with the
//! results in order, so the path does not depend on the number of threads:
//!
//! 1. the greatest length that the blend of each corner can use, from feed, accelerations and tolerance;
//! 2. the lengths of blends that share the spans between them (`share_lengths`);
//! 3. shorter lengths where needed, until the deviation of each blend is within the tolerance;
//! 4. the path: blends, and the rest of the spans between them. The tool stops at a corner without a blend, unless the machine
//!    allows a velocity jump.

use super::built_path::Axes;
use super::chunk::Chunk;
use crate::corner::{share_lengths, Rounding, Sides, TangentJump};
use crate::path_piece::{PathPiece, Shape};
use crate::tolerance;
use feedplan_geometry::parallel::{map, map_with};
use feedplan_geometry::spline::CompositeCurve;
use feedplan_geometry::watch::Watch;

/// The greatest number of corners or spans in a task.
const TASK: usize = 1024;

/// Where one span ends and the next begins.
struct Corner<const M: usize> {
    /// The first piece after it.
    at: usize,
    /// None at a halt, in a cusp, at the ends of the path and where there is no tangent: the tool stops there.
    jump: Option<TangentJump<M>>,
}

/// The pieces of a path with their corners still sharp.
struct CornerRounding<'a, const M: usize> {
    pieces: &'a [PathPiece<M>],
    /// The splines of the program.
    splines: &'a CompositeCurve<M>,
    corners: Vec<Corner<M>>,
    /// The station of each piece in its span.
    station: Vec<f64>,
    /// The length of each span.
    length: Vec<f64>,
    rounding: Rounding,
}

/// The station where a blend begins in the span before the corner, and the one where it ends in the span after it.
type Cuts = [f64; 2];

/// The pieces with rounded corners, and the index of the first piece of each run followed by the number of pieces.
pub fn round_corners<const M: usize>(
    pieces: &[PathPiece<M>],
    splines: &CompositeCurve<M>,
    halt: &[bool],
    rounding: Rounding,
    axes: &Axes<M>,
    watch: Watch,
) -> (Vec<Chunk<M>>, Vec<usize>) {
    if pieces.is_empty() {
        return (vec![], vec![0]);
    }
    let whole = CornerRounding::new(pieces, splines, halt, rounding);
    let count = whole.corners.len();
    let each = watch.part(0.75).each(count);
    let wanted = map(count, TASK, |k| {
        watch.check_at(k);
        whole.wanted_length(k, axes)
    });
    let length = share_lengths(&wanted, &whole.length);
    let cuts = map_with(count, TASK, Sides::default, |sides, k| {
        each.count(k);
        whole.fitting_cuts(k, &length, sides)
    });
    whole.assemble(&cuts, axes.jump, watch.part(0.25))
}

impl<'a, const M: usize> CornerRounding<'a, M> {
    fn new(
        pieces: &'a [PathPiece<M>],
        splines: &'a CompositeCurve<M>,
        halt: &[bool],
        rounding: Rounding,
    ) -> Self {
        let stop = |at| Corner { at, jump: None };
        let inner = map(pieces.len() - 1, TASK, |before| {
            let at = before + 1;
            let (before, after) = (&pieces[at - 1], &pieces[at]);
            let halts = after.first > before.last && halt[before.last as usize];
            if halts || before.shape.rests()[1] || after.shape.rests()[0] {
                return Some(stop(at));
            }
            let jump = TangentJump::new(&before.shape, &after.shape);
            match jump {
                Some(jump) if jump.is_smooth(&before.shape, &after.shape) => None,
                _ => Some(Corner { at, jump }),
            }
        });
        let mut corners = vec![stop(0)];
        corners.extend(inner.into_iter().flatten());
        corners.push(stop(pieces.len()));

        let mut station = Vec::with_capacity(pieces.len());
        let mut length = Vec::with_capacity(corners.len());
        for pair in corners.windows(2) {
            let mut sum = 0.0;
            for piece in &pieces[pair[0].at..pair[1].at] {
                station.push(sum);
                sum += piece.shape.width();
            }
            length.push(sum);
        }
        Self { pieces, splines, corners, station, length, rounding }
    }

    /// The pieces of the span before corner `k`, from the corner backwards, and those of the span after it.
    fn sides(&self, k: usize) -> (impl Iterator<Item = &PathPiece<M>>, impl Iterator<Item = &PathPiece<M>>) {
        let at = self.corners[k].at;
        let before = &self.pieces[self.corners[k - 1].at..at];
        let after = &self.pieces[at..self.corners[k + 1].at];
        (before.iter().rev(), after.iter())
    }

    /// The greatest length that the blend of corner `k` can use, in mm: a longer one would not be faster at the feed, or would
    /// exceed the tolerance or a side. 0 where the corner is not rounded.
    fn wanted_length(&self, k: usize, axes: &Axes<M>) -> f64 {
        let Some(jump) = &self.corners[k].jump else { return 0.0 };
        let at = self.corners[k].at;
        let (before, after) = (&self.pieces[at - 1], &self.pieces[at]);
        let exact = before.exact || after.exact;
        let curved = |side: &PathPiece<M>| side.arc || matches!(side.shape, Shape::Spline(_));
        let tangent = (curved(before) || curved(after)) && jump.size <= tolerance::ROUNDED_TANGENT;
        if jump.reverses() || exact && !tangent {
            return 0.0;
        }
        let mut wanted = jump
            .length_for(
                [&before.shape, &after.shape],
                before.feed.min(after.feed),
                &axes.max_velocity,
                &axes.max_acceleration,
            )
            .max(tolerance::SHORTEST_BLEND * before.tolerance.min(after.tolerance));
        // A circle needs a single line on each side; other pieces are bent.
        let lines = [before, after].map(|side| side.shape.conic().filter(|conic| conic.is_line()));
        let mut rounding = Rounding::Parabola;
        if let (Rounding::Circle, [Some(first), Some(second)]) = (self.rounding, lines) {
            (wanted, rounding) = (wanted.min(first.width).min(second.width), Rounding::Circle);
        }
        let (backwards, forwards) = self.sides(k);
        let length = allowed_length(backwards, jump, exact, rounding, wanted);
        allowed_length(forwards, jump, exact, rounding, length)
    }

    /// The station where piece `i` of span `k` ends.
    fn end_station(&self, k: usize, i: usize) -> f64 {
        if i + 1 < self.corners[k + 1].at {
            self.station[i + 1]
        } else {
            self.length[k]
        }
    }

    /// The piece of span `k` that contains a station.
    fn piece_at(&self, k: usize, station: f64) -> usize {
        let (start, end) = (self.corners[k].at, self.corners[k + 1].at);
        start + self.station[start..end].partition_point(|&other| other <= station).max(1) - 1
    }

    /// A cut at a station of span `k`, moved to the end of a piece if that is so near that a sliver would be left. Two blends
    /// that touch there move their common cut alike, and each keeps its side.
    fn snapped(&self, k: usize, station: f64) -> f64 {
        let i = self.piece_at(k, station);
        let (from, to) = (self.station[i], self.end_station(k, i));
        let to_corner = station.min(self.length[k] - station);
        let near = (tolerance::AT_PIECE_END * (to - from)).min(tolerance::MOVED_CUT * to_corner);
        if station - from <= near {
            from
        } else if to - station <= near {
            to
        } else {
            station
        }
    }

    /// Appends span `k` between two stations. Spline pieces that are cut are copied to `made`; if `bent`, all spline pieces are,
    /// since they will be bent.
    fn append_span(
        &self,
        k: usize,
        [from, to]: [f64; 2],
        bent: bool,
        pieces: &mut Vec<PathPiece<M>>,
        made: &mut CompositeCurve<M>,
    ) {
        for i in self.piece_at(k, from)..self.corners[k + 1].at {
            let (start, end) = (self.station[i], self.end_station(k, i));
            if start >= to {
                break;
            }
            let whole = &self.pieces[i].shape;
            let low = if from <= start { 0.0 } else { from - start };
            let high = if to >= end { whole.width() } else { to - start };
            if from >= end || low >= high {
                continue;
            }
            let shape = match whole {
                Shape::Conic(conic) => Some(Shape::Conic(conic.part(low, high))),
                Shape::Spline(spline) if low == 0.0 && high == spline.width && !bent => Some(*whole),
                Shape::Spline(spline) => spline.part(self.splines, low, high, made).map(Shape::Spline),
            };
            pieces.extend(shape.map(|shape| PathPiece { shape, ..self.pieces[i] }));
        }
    }

    /// Fills `sides` with the pieces on both sides of corner `k` between its cuts.
    fn cut_sides(&self, k: usize, [begin, end]: Cuts, sides: &mut Sides<M>) {
        let Sides { before, after, made } = sides;
        before.clear();
        after.clear();
        made.clear();
        self.append_span(k - 1, [begin, f64::INFINITY], true, before, made);
        self.append_span(k, [0.0, end], true, after, made);
    }

    /// Where the blend of corner `k` begins and ends; None if the tolerance leaves no room for it.
    fn fitting_cuts(&self, k: usize, length: &[f64], sides: &mut Sides<M>) -> Option<Cuts> {
        const TRIALS: usize = 40;
        let jump = self.corners[k].jump.as_ref().filter(|jump| !jump.vanishes(length[k]))?;
        let (mut before, mut after) = (length[k], length[k]);
        for _ in 0..TRIALS {
            let mut begin = self.length[k - 1] - before;
            // Blends that touch must cut at the same place.
            if begin - length[k - 1] <= tolerance::TOUCHING * self.length[k - 1] {
                begin = length[k - 1];
            }
            let cuts = [self.snapped(k - 1, begin), self.snapped(k, after)];
            self.cut_sides(k, cuts, sides);
            let excess = match sides.between_lines(jump, self.rounding) {
                Some(corner) => corner.deviation / corner.tolerance,
                None => sides.bend(jump)?,
            };
            if excess <= 1.0 + tolerance::EXCESS {
                return Some(cuts);
            }
            // The deviation is proportional to the length on lines, but not on curved sides.
            let shorter = (1.0 - tolerance::SHORTER) / excess;
            (before, after) = (shorter * before, shorter * after);
            if jump.vanishes(after) {
                return None;
            }
        }
        None
    }

    /// Joins the blends and the rest of the spans between them, in order. Returns the chunks and the first piece of each run.
    fn assemble(&self, cuts: &[Option<Cuts>], jump: bool, watch: Watch) -> (Vec<Chunk<M>>, Vec<usize>) {
        let count = self.length.len();
        let tasks = map(count.div_ceil(TASK), 1, |task| {
            let spans = task * TASK..count.min((task + 1) * TASK);
            watch.each(count).advance(spans.len());
            let inside = self.corners[spans.end].at - self.corners[spans.start].at;
            let mut chunk = Chunk::default();
            chunk.pieces.reserve(inside + 2 * spans.len());
            let (mut runs, mut sides) = (Vec::new(), Sides::default());
            for k in spans {
                let start = match (cuts[k], &self.corners[k].jump) {
                    (Some(cuts), Some(turn)) => {
                        self.cut_sides(k, cuts, &mut sides);
                        if let Some(corner) = sides.between_lines(turn, self.rounding) {
                            chunk.pieces.push(corner);
                        } else {
                            sides.bend(turn);
                            chunk.append(&sides);
                        }
                        cuts[1]
                    }
                    (_, turn) => {
                        if !(jump && turn.is_some()) {
                            runs.push(chunk.pieces.len());
                        }
                        0.0
                    }
                };
                let end = cuts[k + 1].map_or(f64::INFINITY, |cuts| cuts[0]);
                self.append_span(k, [start, end], false, &mut chunk.pieces, &mut chunk.made);
            }
            (chunk, runs)
        });
        let (mut chunks, mut runs, mut total) = (Vec::with_capacity(tasks.len()), Vec::new(), 0);
        for (chunk, starts) in tasks {
            runs.extend(starts.iter().map(|start| start + total));
            total += chunk.pieces.len();
            chunks.push(chunk);
        }
        runs.push(total);
        (chunks, runs)
    }
}

/// The length of a blend, at most `wanted`, that one side of a corner allows: by its own length, and by the part of the tolerance
/// that its pieces have left.
fn allowed_length<'a, const M: usize>(
    side: impl Iterator<Item = &'a PathPiece<M>>,
    jump: &TangentJump<M>,
    exact: bool,
    rounding: Rounding,
    wanted: f64,
) -> f64 {
    let (mut length, mut station) = (wanted, 0.0);
    for piece in side {
        if piece.exact && !exact {
            break;
        }
        let room = jump.length_within(piece.tolerance - piece.deviation, rounding);
        length = length.min(room.max(station));
        station += piece.shape.width();
        if station >= length {
            return length;
        }
    }
    length.min(station)
}

#[cfg(test)]
mod tests {
    use super::*;
    use feedplan_geometry::conic::Conic;

    #[test]
    fn cuts_next_to_the_end_of_a_piece_leave_no_sliver() {
        // A line of 10 mm in two pieces.
        let points = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]];
        let whole = Conic::line(points[0], points[1]);
        let side = [whole.part(0.0, 4.0), whole.part(4.0, 10.0), Conic::line(points[1], points[2])]
            .map(PathPiece::from);
        let splines = CompositeCurve::default();
        let spans = CornerRounding::new(&side, &splines, &[false; 2], Rounding::Parabola);
        assert_eq!(spans.length, [10.0, 10.0]);
        for (station, moved) in [(4.0 + 1e-9, 4.0), (4.0 - 1e-9, 4.0), (4.1, 4.1), (1e-9, 1e-9)] {
            assert_eq!(spans.snapped(0, station), moved);
            let (mut before, mut after, mut made) = (Vec::new(), Vec::new(), CompositeCurve::default());
            spans.append_span(0, [0.0, moved], false, &mut before, &mut made);
            spans.append_span(0, [moved, f64::INFINITY], false, &mut after, &mut made);
            let end = before.last().unwrap().shape.conic().unwrap().control[2];
            assert_eq!(end, *after[0].shape.start());
            assert_eq!(before.len() + after.len(), if moved == 4.0 { 2 } else { 3 });
        }
    }
}
