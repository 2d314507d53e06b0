//! Measures how far the followed path and the programmed path are from each other, and whether the followed path is connected and
//! within the travel of the axes.
//!
//! From the program: ends and inner places of every move against the pieces that follow it and one more piece on each side. From
//! the path: places of every piece against the moves that it follows and one more move on each side. Pieces along a straight move
//! are skipped where the distances of its ends bound those between. Distances are exact: from segments, circles, helices and
//! splines. Where a piece comes near its tolerance, it is sampled again at a finer spacing.

use std::cmp::Ordering::Equal;
use std::sync::{Mutex, PoisonError};

use super::close_places::ClosePlaces;
use super::curve::Followed;
use super::moves::{Move, Programmed};
use super::nearest::{nearest_on_piece, outwards, Place};
use super::neighbours::{Followers, Neighbours};
use super::parallel;
use super::phases::Phases;
use super::vectors::distance;
use super::{tell, Check, Limits, Seen, Tally, Worst, EPS, GAP_TOLERANCE, ROUNDINGS};

/// Intervals between the equally spaced places of a piece of degree 2, and subdivisions of an interval where the piece comes near
/// its tolerance. Pieces of higher degree get more places, in proportion to the degree.
const PLACES: usize = 8;

/// From this share of the tolerance on, a piece is sampled again at a finer spacing: eight intervals on a parabola miss at most
/// 1.6 % of its greatest distance from a line.
const NEAR: f64 = 0.95;

/// Up to this share of the tolerance, the distance from the nearest place of a few Newton steps is used: it is an upper bound.
const FAR_BELOW: f64 = 0.5;

/// If at most this many pieces follow a move, all are measured; of more, only those whose bounding boxes are near enough.
const FEW: usize = 8;

/// Pieces or moves that a thread takes at a time.
const BLOCK: usize = 2048;

/// Audits the path on its own: finite numbers, no gaps between pieces, positions within the travel of the axes.
pub(crate) fn audit_path<const M: usize>(
    path: &Followed,
    phases: Option<&Phases>,
    limits: &Limits<M>,
    seen: Seen,
) -> Tally<M> {
    let times = entry_times(path, phases);
    parallel::tally(&Tally::default(), path.len(), BLOCK, &|block, tally| {
        for i in block {
            tell(seen, i);
            let (time, line) = (times[i], path.line[i]);
            let (rows, width) = (path.rows(i), path.width[i]);
            let control = &path.control[rows.start * path.stride..rows.end * path.stride];
            let weights = if path.weights.is_empty() { &[][..] } else { &path.weights[rows] };
            let finite = control.iter().all(|q| q.is_finite())
                && weights.iter().all(|w| w.is_finite() && *w > 0.0)
                && width.is_finite();
            if !finite || width < 0.0 || (width == 0.0 && !path.is_motionless(i)) {
                tally.offer(Check::Numbers, 0, f64::INFINITY, 0.0, time, line);
                continue;
            }
            tally.offer(Check::Numbers, 0, 0.0, 0.0, time, line);
            if i > 0 {
                let start = path.start::<M>(i);
                let rounding = ROUNDINGS * EPS * magnitude(&start);
                let gap = distance(&path.end(i - 1), &start) - rounding;
                if gap <= 0.0 || !path.begins_elsewhere(i) {
                    tally.offer(Check::Gap, 0, gap, GAP_TOLERANCE, time, line);
                }
            }
            for k in 0..path.axes {
                for q in [path.start::<M>(i)[k], path.end::<M>(i)[k]] {
                    offer_travel(tally, limits, k, q, time, line);
                }
                // The control points enclose the piece: its extremes are needed only if a control point exceeds the worst share
                // so far.
                let reach = control.iter().skip(k).step_by(path.stride);
                let worst = tally.get(Check::Travel, k).ratio;
                if reach.copied().any(|q| travel_share(limits, k, q) > worst) {
                    for q in path.curve::<M>(i).extremes(k) {
                        offer_travel(tally, limits, k, q, time, line);
                    }
                }
            }
            tally.samples += 1;
        }
    })
}

/// Distance of a position from the middle of the travel, as a share of half the travel.
fn travel_share<const M: usize>(limits: &Limits<M>, axis: usize, q: f64) -> f64 {
    let [least, most] = limits.travel[axis];
    let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
    if half.is_finite() {
        ((q - middle).abs() - ROUNDINGS * EPS * q.abs()) / half
    } else if q >= least && q <= most {
        0.0
    } else {
        f64::INFINITY
    }
}

/// Checks one position of an axis against its travel; the ratio is its distance from the middle as a share of half the travel.
pub fn offer_travel<const M: usize>(
    tally: &mut Tally<M>,
    limits: &Limits<M>,
    axis: usize,
    q: f64,
    time: f64,
    line: i32,
) {
    let [least, most] = limits.travel[axis];
    // Most positions do not raise the worst, which a product shows faster than a quotient.
    let (middle, half, known) =
        (0.5 * (least + most), 0.5 * (most - least), tally.get(Check::Travel, axis).ratio);
    let is_passed = (q - middle).abs() < known * half || (half == f64::INFINITY && q >= least && q <= most);
    if known >= 0.0 && is_passed {
        return;
    }
    let bound = if q < 0.5 * (least + most) { least } else { most };
    let ratio = travel_share(limits, axis, q);
    tally.offer_ratio(Check::Travel, axis, Worst { value: q, limit: bound, ratio, time, line });
}

/// Audits the distance between path and program.
pub(crate) fn audit_deviation<const M: usize>(
    path: &Followed,
    program: &Programmed,
    phases: Option<&Phases>,
    seen: Seen,
) -> Tally<M> {
    let times = entry_times(path, phases);
    let (followers, close) = (followers(path, program.len()), Mutex::new(Vec::new()));
    let from_program = parallel::tally(&Tally::default(), program.len(), BLOCK, &|block, tally| {
        let mut follow =
            Follow { path, places: ClosePlaces::new(path.pieces), last: None, close: Vec::new() };
        for m in block {
            tell(seen, m);
            let (programmed, line) = (program.get(m), program.line[m]);
            if !programmed.is_motion() {
                continue;
            }
            let (first, last) = followers[m];
            match path.len().checked_sub(1) {
                None => tally.offer(Check::Deviation, 0, f64::INFINITY, GAP_TOLERANCE, 0.0, line),
                Some(end) => {
                    let pieces = (first.min(end), last.min(end));
                    follow.measure((m, &programmed, line), pieces, times[pieces.0], tally);
                }
            }
        }
        close.lock().unwrap_or_else(PoisonError::into_inner).extend(follow.close);
    });
    let mut close = close.into_inner().unwrap_or_else(PoisonError::into_inner);
    close.sort_by(|[a, _]: &Part, [b, _]| a.partial_cmp(b).unwrap_or(Equal));
    let from_path = parallel::tally(&from_program, path.len(), BLOCK, &|block, tally| {
        let mut near = Neighbours::default();
        for i in block {
            tell(seen, i);
            let [start, end] = [0.0, path.width[i]].map(|u| Place { piece: i, u });
            let begun = close.partition_point(|[from, _]| *from <= start);
            let is_close = close[..begun].last().is_some_and(|[_, to]| *to >= end);
            if !is_close {
                piece_to_moves(path, program, (&followers, &mut near), (i, times[i]), tally);
            }
        }
    });
    let mut ends = Tally::default();
    if !path.is_empty() && !program.is_empty() {
        let last = path.len() - 1;
        let meetings = [
            (path.start::<M>(0), program.end(None), times[0], path.line[0]),
            (path.end::<M>(last), program.end(Some(program.len() - 1)), times[last + 1], path.line[last]),
        ];
        for (followed, programmed, time, line) in meetings {
            let gap = distance(&followed, &programmed) - ROUNDINGS * EPS * magnitude(&programmed);
            ends.offer(Check::Gap, 0, gap, GAP_TOLERANCE, time, line);
        }
    }
    from_path.merge(from_program).merge(ends)
}

/// The moves that a piece is compared with: those it follows, then one more on each side.
pub fn window(path: &Followed, piece: usize, moves: usize) -> impl Iterator<Item = usize> {
    let [first, last] = [path.moves[2 * piece], path.moves[2 * piece + 1]];
    let first = first.clamp(0, moves as i64) as usize;
    let last = last.saturating_add(1).clamp(first as i64, moves as i64) as usize;
    (first..last).chain(first.checked_sub(1)).chain(Some(last).filter(|&m| m < moves))
}

/// Whether the piece follows move `number` or one next to it.
fn follows(path: &Followed, piece: usize, number: usize) -> bool {
    let [first, last] = [path.moves[2 * piece], path.moves[2 * piece + 1]];
    (first.saturating_sub(1)..=last.saturating_add(1)).contains(&(number as i64))
}

/// The greatest share of the tolerance found so far. A place within this share of its tolerance cannot change the tally, so the
/// first move or piece found within it ends the search for that place.
pub fn settled<const M: usize>(tally: &Tally<M>) -> f64 {
    tally.get(Check::Deviation, 0).ratio.max(0.0)
}

/// Allowed distance of a piece from the program, in mm.
pub fn allowed(path: &Followed, piece: usize) -> f64 {
    path.tolerance[piece].max(GAP_TOLERANCE)
}

/// The two distances that end a search (see `ClosePlaces::find`), in mm, where the distance `allowed` is allowed: for the first
/// place found, and for the nearest place of a few steps.
pub fn enough(settled: f64, allowed: f64, rounding: f64) -> [f64; 2] {
    [settled, settled.max(FAR_BELOW)].map(|share| share * allowed + rounding)
}

fn piece_to_moves<'a, const M: usize>(
    path: &Followed,
    program: &Programmed<'a>,
    (followers, near): (&[Followers], &mut Neighbours<'a, M>),
    (piece, time): (usize, f64),
    tally: &mut Tally<M>,
) {
    let (line, tolerance) = (path.line[piece], allowed(path, piece));
    near.replace(program, window(path, piece, program.len()));
    let curve = path.curve::<M>(piece);
    let (width, turns) = (curve.width(), curve.turns());
    let places = PLACES * turns;
    let rounding = ROUNDINGS * EPS * curve.magnitude();
    near.start_at(followers, piece);
    let off = |t: f64, most: f64, near: &mut Neighbours<M>, tally: &mut Tally<M>| {
        let [first, nearest] = enough(settled(tally), tolerance, rounding);
        let value = near.distance(&curve.at(t * width), [first.min(most), nearest]) - rounding;
        tally.offer(Check::Deviation, 0, value, tolerance, time, line);
        tally.samples += 1;
        (value, near.here())
    };
    let (mut worst, mut worst_t) = (0.0_f64, 0.0);
    let mut look = |i: usize, near: &mut Neighbours<M>, tally: &mut Tally<M>| {
        let t = i as f64 / places as f64;
        // The search for the nearest move does not end above `NEAR` of the tolerance, from which the piece is sampled again.
        let found = off(t, NEAR * tolerance, near, tally);
        if found.0 > worst {
            (worst, worst_t) = (found.0, t);
        }
        found
    };
    // Between two places, piece and move are at most as far apart as at the farther of the two places, plus the sagittas of both.
    let sagitta = curve.sagitta(width / PLACES as f64);
    let mut before = look(0, near, tally);
    for i in (0..places).step_by(turns) {
        let here = look(i + turns, near, tally);
        let most = before.0.max(here.0) + sagitta + near.sagitta(before.1, here.1);
        let is_settled = most <= settled(tally) * tolerance;
        if !is_settled {
            (i + 1..i + turns).for_each(|i| _ = look(i, near, tally));
        }
        before = here;
    }
    if worst >= NEAR * tolerance {
        let step = 1.0 / (places * PLACES) as f64;
        for i in 0..=2 * PLACES {
            let t = (worst_t + (i as f64 - PLACES as f64) * step).clamp(0.0, 1.0);
            off(t, f64::INFINITY, near, tally);
        }
    }
}

/// First and last piece that follow each move. A move that no piece names lies between the pieces of the moves around it.
fn followers(path: &Followed, moves: usize) -> Vec<Followers> {
    let mut named: Vec<Option<Followers>> = vec![None; moves];
    for (piece, pair) in path.moves.chunks_exact(2).enumerate() {
        let first = pair[0].clamp(0, moves as i64) as usize;
        let last = pair[1].saturating_add(1).clamp(0, moves as i64) as usize;
        for range in &mut named[first..last.max(first)] {
            let (low, high) = range.unwrap_or((piece, piece));
            *range = Some((low.min(piece), high.max(piece)));
        }
    }
    let mut ranges = vec![(0, path.len().saturating_sub(1)); moves];
    let mut before = 0;
    for (range, named) in ranges.iter_mut().zip(&named) {
        range.0 = named.map_or(before, |(low, _)| low);
        before = named.map_or(before, |(_, high)| high);
    }
    let mut after = path.len().saturating_sub(1);
    for (range, named) in ranges.iter_mut().zip(&named).rev() {
        range.1 = named.map_or(after, |(_, high)| high);
        after = named.map_or(after, |(low, _)| low);
    }
    ranges
}

/// A part of the path, from one place to another.
type Part = [Place; 2];

/// Measures moves, one after the other, against the pieces that follow them.
struct Follow<'a, const M: usize> {
    path: &'a Followed<'a>,
    places: ClosePlaces<'a, M>,
    /// The point measured last, the place found near it, and the distance between them less rounding, in mm.
    last: Option<([f64; M], Place, f64)>,
    /// Parts of the path whose distance from the program cannot raise the worst.
    close: Vec<Part>,
}

impl<const M: usize> Follow<'_, M> {
    /// Measures a move that the pieces from `first` to `last` follow.
    fn measure(
        &mut self,
        (number, programmed, line): (usize, &Move<M>, i32),
        (first, last): Followers,
        time: f64,
        tally: &mut Tally<M>,
    ) {
        let pieces = [first.saturating_sub(1), (last + 1).min(self.path.len() - 1)];
        let places = programmed.places();
        let rounding = ROUNDINGS * EPS * magnitude(&programmed.to);
        let at = |own: &mut Self, i: usize, tally: &mut Tally<M>| {
            let q = programmed.at(i as f64 / places as f64);
            own.place(q, pieces, (time, line, rounding), tally)
        };
        let from = at(self, 0, tally);
        if programmed.is_straight() {
            // The parameter of every piece is in mm.
            let way = distance(&programmed.from, &programmed.to);
            self.places.start_at(from.0.moved(way, self.path.width, pieces));
            let to = at(self, places, tally);
            if self.is_close((number, programmed), [from, to], settled(tally)) {
                match self.close.last_mut() {
                    Some([_, end]) if *end == from.0 => *end = to.0,
                    _ => self.close.push([from.0, to.0]),
                }
                tally.samples += 2;
                return;
            }
            self.places.start_at(from.0);
        }
        for i in 1..=places {
            at(self, i, tally);
        }
        tally.samples += places as u64 + 1;
    }

    /// Whether a straight move and the path between the places `from` and `to` near its ends are within the given share of the
    /// allowed distance, and each piece there names this move or one next to it. On each piece the bound is the greater distance
    /// of its two ends from the move plus its sagitta.
    fn is_close(
        &mut self,
        (number, programmed): (usize, &Move<M>),
        [from, to]: [(Place, f64); 2],
        share: f64,
    ) -> bool {
        let (path, curves) = (self.path, &mut self.places.curves);
        from.0 <= to.0
            && (from.0.piece..=to.0.piece).all(|piece| {
                let end = |(place, away): (Place, f64), u: f64, q: [f64; M]| match place.piece == piece {
                    true => (place.u, away),
                    false => (u, programmed.distance(&q, 0.0)),
                };
                let (start, before) = end(from, 0.0, path.start(piece));
                let (end, after) = end(to, path.width[piece], path.end(piece));
                let most = before.max(after) + curves.get(piece).sagitta(end - start);
                most <= share * allowed(path, piece) && follows(path, piece, number)
            })
    }

    /// A place near the point `q` of a move, and its distance less rounding, in mm; adds the distance to the tally.
    fn place(
        &mut self,
        q: [f64; M],
        [least, most]: [usize; 2],
        (time, line, rounding): (f64, i32, f64),
        tally: &mut Tally<M>,
    ) -> (Place, f64) {
        // Most moves begin at the end of the move before.
        let known =
            self.last.filter(|(point, place, _)| *point == q && (least..=most).contains(&place.piece));
        if let Some((_, place, away)) = known {
            return (place, away);
        }
        let most_so_far = settled(tally);
        let (path, expected) = (self.path, self.places.place().piece);
        let close = |piece: usize| enough(most_so_far, allowed(path, piece), rounding);
        let (place, away) = match self.places.find(&q, [least, most], close) {
            Some((place, distance)) => (place, distance - rounding),
            None => {
                // The piece with the least distance relative to its own tolerance counts.
                let mut nearest = (f64::INFINITY, Place { piece: least, u: 0.0 }, f64::INFINITY);
                for piece in outwards(expected.clamp(least, most), least, most) {
                    let tolerance = allowed(path, piece);
                    let beyond = nearest.0 * tolerance + rounding;
                    if most - least > FEW && beyond.is_finite() && path.distance_at_least(piece, &q) > beyond
                    {
                        continue;
                    }
                    let (u, distance) = nearest_on_piece(self.places.curves.get(piece), &q);
                    let away = distance - rounding;
                    if away / tolerance < nearest.0 {
                        nearest = (away / tolerance, Place { piece, u }, away);
                    }
                    if nearest.0 <= most_so_far {
                        break;
                    }
                }
                self.places.start_at(nearest.1);
                (nearest.1, nearest.2)
            }
        };
        tally.offer(Check::Deviation, 0, away, allowed(path, place.piece), time, line);
        self.last = Some((q, place, away));
        (place, away)
    }
}

/// The times at which the tool enters each piece and leaves the last one, in s.
fn entry_times(path: &Followed, phases: Option<&Phases>) -> Vec<f64> {
    let mut times = vec![0.0; path.len() + 1];
    let Some(phases) = phases else { return times };
    let starts = phases.starts(path);
    let mut piece = 0;
    for (i, &entered) in phases.piece.iter().enumerate() {
        while piece <= (entered as usize).min(path.len()) {
            times[piece] = starts[i];
            piece += 1;
        }
    }
    times[piece..].fill(starts[phases.len()]);
    times
}

fn magnitude<const M: usize>(q: &[f64; M]) -> f64 {
    q.iter().fold(0.0, |most, q| q.abs().max(most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Pieces;
    use crate::moves::Shape;
    use crate::FEEDS;

    /// Two pieces of degree 2 along X, one of whose numbers may not be finite.
    fn numbers(x: f64, weights: &[f64], width: f64) -> f64 {
        let path = Followed {
            pieces: Pieces {
                axes: 1,
                stride: 1,
                control: &[0.0, 1.0, 2.0, 2.0, x, 4.0],
                weights,
                offsets: &[0, 3, 6],
                width: &[2.0, width],
            },
            feed: &[1.0; 2 * FEEDS],
            line: &[1, 2],
            moves: &[0, 0, 1, 1],
            tolerance: &[0.0; 2],
            runs: &[0, 2],
            new_words: &[false],
            start_dwell: 0.0,
            dwell: &[0.0],
        };
        audit_path(&path, None, &Limits::<1>::none(), &|_| ()).get(Check::Numbers, 0).ratio
    }

    #[test]
    fn numbers_that_are_none_are_found() {
        assert_eq!(numbers(3.0, &[], 2.0), 0.0);
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(numbers(bad, &[], 2.0) > 1.0 && numbers(3.0, &[], bad) > 1.0);
            assert!(numbers(3.0, &[1.0, 1.0, 1.0, 1.0, bad, 1.0], 2.0) > 1.0);
        }
        assert!(numbers(3.0, &[1.0, 1.0, 1.0, 1.0, -1.0, 1.0], 2.0) > 1.0);
    }

    #[test]
    fn where_a_piece_is_off_a_straight_move_between_its_ends_is_measured() {
        // From (0, 0) to (4, 0), half-way 0.5 beside the move.
        let pieces = Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 2.0, 1.0, 4.0, 0.0],
            weights: &[],
            offsets: &[0, 3],
            width: &[4.0],
        };
        let path = Followed { tolerance: &[1.0], ..Followed::of_one(pieces) };
        let programmed = Move { from: [0.0, 0.0], to: [4.0, 0.0], shape: Shape::Line };
        for (known, found) in [(0.3, 0.5), (0.7, 0.7)] {
            let mut tally = Tally::<2>::default();
            tally.offer(Check::Deviation, 0, known, 1.0, 0.0, 0);
            let places = ClosePlaces::new(pieces);
            let mut follow = Follow { path: &path, places, last: None, close: Vec::new() };
            follow.measure((0, &programmed, 1), (0, 0), 0.0, &mut tally);
            let ratio = tally.get(Check::Deviation, 0).ratio;
            assert!((ratio - found).abs() < 1e-12, "{known}: {ratio}");
        }
    }

    #[test]
    fn pieces_along_straight_moves_that_they_follow_are_measured_by_the_ends_of_these_alone() {
        // Two pieces of 1 mm along X, 0.1 mm beside the program at its start, then mostly 0.08 mm beside it.
        let samples = |middle: [f64; 2], bend: f64, follows: &[i64; 4]| {
            let [before, after] = middle;
            let control = [0.0, 0.08, 0.5, 0.08, 1.0, before, 1.0, after, 1.5, bend, 2.0, 0.08];
            let (offsets, width) = (&[0, 3, 6], &[1.0; 2]);
            let pieces = Pieces { axes: 2, stride: 2, control: &control, weights: &[], offsets, width };
            let path =
                Followed { tolerance: &[1.0; 2], line: &[1, 2], moves: follows, ..Followed::of_one(pieces) };
            let program = Programmed::of_lines(&[0.0, -0.02], &[1.0, 0.0, 2.0, 0.0], &[1, 2]);
            audit_deviation::<2>(&path, &program, None, &|_| ()).samples
        };
        assert_eq!(samples([0.08; 2], 0.08, &[0, 0, 1, 1]), 4);
        // The ends do not bound these cases: a bend, a gap, and a piece that is said to follow another move.
        assert!(samples([0.08; 2], 0.3, &[0, 0, 1, 1]) > 8);
        assert!(samples([0.08, 0.2], 0.08, &[0, 0, 1, 1]) > 8);
        assert!(samples([0.08; 2], 0.08, &[0, 0, 7, 7]) > 8);
    }

    #[test]
    fn places_between_others_are_measured_where_a_bound_leaves_open_what_is_there() {
        // A path along a straight move, up to 0.276 mm beside it; its control points are up to 0.8 mm beside it.
        let pieces = Pieces {
            axes: 2,
            stride: 2,
            control: &[0.0, 0.0, 1.0, 0.8, 2.0, 0.0, 3.0, 0.0, 4.0, 0.0, 5.0, 0.0],
            weights: &[],
            offsets: &[0, 6],
            width: &[5.0],
        };
        let path = Followed { tolerance: &[1.0], ..Followed::of_one(pieces) };
        let program = Programmed::of_lines(&[0.0, 0.0], &[5.0, 0.0], &[1]);
        let most =
            (0..=1000).map(|i| pieces.curve::<2>(0).at(5.0 * f64::from(i) / 1000.0)[1]).fold(0.0, f64::max);
        for (known, found, places) in [(0.27, most, 9..41), (0.5, 0.5, 9..10)] {
            let mut tally = Tally::<2>::default();
            tally.offer(Check::Deviation, 0, known, 1.0, 0.0, 0);
            piece_to_moves(&path, &program, (&[(0, 0)], &mut Neighbours::default()), (0, 0.0), &mut tally);
            let ratio = tally.get(Check::Deviation, 0).ratio;
            assert!((ratio - found).abs() < 1e-4, "{known}: {ratio} instead of {found}");
            assert!(places.contains(&(tally.samples as usize)), "{known}: {}", tally.samples);
        }
    }

    #[test]
    fn a_move_without_a_piece_lies_between_its_neighbours() {
        let path = Followed {
            pieces: Pieces { axes: 2, stride: 2, control: &[], weights: &[], offsets: &[], width: &[1.0; 3] },
            feed: &[],
            line: &[],
            moves: &[0, 1, 1, 1, 4, 5],
            tolerance: &[],
            runs: &[],
            new_words: &[],
            start_dwell: 0.0,
            dwell: &[],
        };
        assert_eq!(followers(&path, 7), [(0, 0), (0, 1), (1, 2), (1, 2), (2, 2), (2, 2), (2, 2)]);
        assert_eq!(window(&path, 0, 7).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(window(&path, 1, 7).collect::<Vec<_>>(), [1, 0, 2]);
        assert_eq!(window(&path, 2, 6).collect::<Vec<_>>(), [4, 5, 3]);
    }
}
