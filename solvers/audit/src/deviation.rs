//! How far the followed path is from the programmed one, both ways, and whether it holds together.
//!
//! From the path: places of every piece against the moves it says it follows, one move more on each side. From
//! the program: ends and inner places of every move against the pieces that follow it, one piece more on each
//! side. Distances are those from true segments, circles, helices and parabolas. Where a piece comes near its
//! tolerance it is looked at again, closer.

use super::close_places::ClosePlaces;
use super::curve::Followed;
use super::moves::{Move, Programmed};
use super::nearest::{nearest_on_piece, outwards, Place};
use super::neighbours::{Followers, Neighbours};
use super::parallel;
use super::phases::Phases;
use super::vectors::distance;
use super::{tell, Check, Limits, Seen, Tally, Worst, EPS, GAP_TOLERANCE, ROUNDINGS};

/// Even places of a piece of degree 2, and as many again between two of them where it comes near its tolerance.
/// Others have more: each degree is another turn.
const PLACES: usize = 8;

/// Share of the tolerance from which a piece is looked at more closely: eight places of a parabola miss at most
/// 1.6 % of its greatest distance from a line.
const NEAR: f64 = 0.95;

/// Where no more pieces follow a move they are all measured; of more, those whose boxes come near enough.
const FEW: usize = 8;

/// Pieces or moves a thread takes at a time.
const BLOCK: usize = 2048;

/// The path on its own: finite numbers, piece on piece, within the travel of the axes.
pub(crate) fn audit_path<const M: usize>(
    path: &Followed,
    phases: Option<&Phases>,
    limits: &Limits<M>,
    seen: Seen,
) -> Tally<M> {
    let times = entry_times(path, phases);
    parallel::tally(path.len(), BLOCK, &|block, tally| {
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
                // The control points enclose the piece: where they are fine it is.
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

/// The share of half the travel that a position is away from the middle.
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

/// One position of an axis against its travel; the ratio is its share of half the travel, from the middle.
pub fn offer_travel<const M: usize>(
    tally: &mut Tally<M>,
    limits: &Limits<M>,
    axis: usize,
    q: f64,
    time: f64,
    line: i32,
) {
    let [least, most] = limits.travel[axis];
    // Most positions change nothing, and a product is had sooner than a share.
    let (middle, half, known) =
        (0.5 * (least + most), 0.5 * (most - least), tally.get(Check::Travel, axis).ratio);
    if known >= 0.0 && (q - middle).abs() < known * half {
        return;
    }
    let bound = if q < 0.5 * (least + most) { least } else { most };
    let ratio = travel_share(limits, axis, q);
    tally.offer_ratio(Check::Travel, axis, Worst { value: q, limit: bound, ratio, time, line });
}

/// The path against the program.
pub(crate) fn audit_deviation<const M: usize>(
    path: &Followed,
    program: &Programmed,
    phases: Option<&Phases>,
    seen: Seen,
) -> Tally<M> {
    let times = entry_times(path, phases);
    let followers = followers(path, program.len());
    let from_path = parallel::tally(path.len(), BLOCK, &|block, tally| {
        let mut near = Neighbours::default();
        for i in block {
            tell(seen, i);
            piece_to_moves(path, program, (&followers, &mut near), (i, times[i]), tally);
        }
    });
    let from_program = parallel::tally(program.len(), BLOCK, &|block, tally| {
        let mut close = ClosePlaces::new(path.pieces);
        for m in block {
            tell(seen, m);
            move_to_pieces(path, program, (m, followers[m]), &times, &mut close, tally);
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

/// The moves that a piece may be compared with: those it follows, then one more on each side.
pub fn window(path: &Followed, piece: usize, moves: usize) -> impl Iterator<Item = usize> {
    let [first, last] = [path.moves[2 * piece], path.moves[2 * piece + 1]];
    let first = first.clamp(0, moves as i64) as usize;
    let last = last.saturating_add(1).clamp(first as i64, moves as i64) as usize;
    (first..last).chain(first.checked_sub(1)).chain(Some(last).filter(|&m| m < moves))
}

/// What a place may be off its nearest neighbour without changing the tally: no more than its worst so far. The first neighbour
/// within it settles the place.
pub fn settled<const M: usize>(tally: &Tally<M>) -> f64 {
    tally.get(Check::Deviation, 0).ratio.max(0.0)
}

fn piece_to_moves<'a, const M: usize>(
    path: &Followed,
    program: &Programmed<'a>,
    (followers, near): (&[Followers], &mut Neighbours<'a, M>),
    (piece, time): (usize, f64),
    tally: &mut Tally<M>,
) {
    let (line, tolerance) = (path.line[piece], path.tolerance[piece].max(GAP_TOLERANCE));
    near.replace(program, window(path, piece, program.len()));
    // A piece is within the convex hull of its control points: where these lie along one move, its places change nothing.
    let points = path.rows(piece).map(|row| path.point::<M>(row));
    if let Some(most) = near.straight_beside(points, settled(tally) * tolerance) {
        tally.offer(Check::Deviation, 0, most, tolerance, time, line);
        tally.samples += path.rows(piece).len() as u64;
        return;
    }
    let curve = path.curve::<M>(piece);
    let (width, places) = (curve.width(), PLACES * curve.turns());
    let rounding = ROUNDINGS * EPS * curve.magnitude();
    near.start_at(followers, piece);
    let mut off = |t: f64, shares: [f64; 2]| {
        near.distance(&curve.at(t * width), shares.map(|share| share * tolerance + rounding)) - rounding
    };
    let (mut worst, mut worst_t) = (0.0_f64, 0.0);
    for i in 0..=places {
        let t = i as f64 / places as f64;
        // Where it comes near its tolerance the piece is looked at again.
        let value = off(t, [settled(tally).min(NEAR), settled(tally)]);
        tally.offer(Check::Deviation, 0, value, tolerance, time, line);
        if value > worst {
            (worst, worst_t) = (value, t);
        }
    }
    tally.samples += places as u64 + 1;
    if worst >= NEAR * tolerance {
        let step = 1.0 / (places * PLACES) as f64;
        for i in 0..=2 * PLACES {
            let t = (worst_t + (i as f64 - PLACES as f64) * step).clamp(0.0, 1.0);
            tally.offer(Check::Deviation, 0, off(t, [settled(tally); 2]), tolerance, time, line);
        }
    }
}

/// The pieces near every move. A move that no piece names lies between those of the moves around it.
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

fn move_to_pieces<const M: usize>(
    path: &Followed,
    program: &Programmed,
    (m, (first, last)): (usize, Followers),
    times: &[f64],
    close: &mut ClosePlaces<M>,
    tally: &mut Tally<M>,
) {
    let programmed: Move<M> = program.get(m);
    if !programmed.is_motion() {
        return;
    }
    let line = program.line[m];
    if path.is_empty() {
        tally.offer(Check::Deviation, 0, f64::INFINITY, GAP_TOLERANCE, 0.0, line);
        return;
    }
    let (first, last) = (first.min(path.len() - 1), last.min(path.len() - 1));
    let (least, most) = (first.saturating_sub(1), (last + 1).min(path.len() - 1));
    let places = programmed.places();
    let rounding = ROUNDINGS * EPS * magnitude(&programmed.to);
    let mut expected = first;
    for i in 0..=places {
        let q = programmed.at(i as f64 / places as f64);
        // The nearest piece counts, measured by its own tolerance.
        let mut nearest = (f64::INFINITY, f64::INFINITY, GAP_TOLERANCE);
        let (enough, tolerance_of) =
            (settled(tally), |piece: usize| path.tolerance[piece].max(GAP_TOLERANCE));
        if let Some((piece, away)) =
            close.find(&q, [least, most], |piece| [enough * tolerance_of(piece) + rounding; 2])
        {
            tally.offer(Check::Deviation, 0, away - rounding, tolerance_of(piece), times[first], line);
            expected = piece;
            continue;
        }
        for piece in outwards(expected, least, most) {
            let tolerance = tolerance_of(piece);
            let beyond = nearest.0 * tolerance + rounding;
            if most - least > FEW && beyond.is_finite() && path.distance_at_least(piece, &q) > beyond {
                continue;
            }
            let (u, distance) = nearest_on_piece(close.curves.get(piece), &q);
            let away = distance - rounding;
            if away / tolerance < nearest.0 {
                nearest = (away / tolerance, away, tolerance);
                close.start_at(Place { piece, u });
                expected = piece;
            }
            if nearest.0 <= enough {
                break;
            }
        }
        tally.offer(Check::Deviation, 0, nearest.1, nearest.2, times[first], line);
    }
    tally.samples += places as u64 + 1;
}

/// When the tool enters each piece, and when it leaves the last one, in s.
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
    use crate::FEEDS;

    /// Two pieces of degree 2 along X, with numbers that may be none.
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
