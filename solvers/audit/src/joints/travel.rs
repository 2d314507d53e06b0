//! Audits the positions of joints that are not the path's axes against their travel, along the whole path.
//!
//! Some angles are known up to whole turns only. They are continued from place to place; a piece on which such an angle is known
//! absolutely gives the number of whole turns on all pieces.

use std::rc::Rc;

use super::path::{JointPath, Piece, TURN};
use crate::columns::Columns;
use crate::nearest::Place;
use crate::phase_motion::ROUNDING;
use crate::phases::Phases;
use crate::profile_clock::ProfileClock;
use crate::profile_reader::Reader;
use crate::{Check, Limits, Tally, Worst};

/// Number of equal intervals of a piece, for each of its degrees.
const INTERVALS: usize = 4;

/// Least and greatest position of a joint, and where these are.
type Span = [(f64, Place); 2];

/// Audits the travel of every joint; the times are those of the profile, if its numbers can be used.
pub fn audit_travel<const M: usize>(
    of: &JointPath,
    phases: Phases,
    starts: &[f64],
    limits: &Limits<M>,
) -> Tally<M> {
    let (mut tally, mut room, path) = (Tally::default(), of.room([0.0; 8]), &of.path);
    let nowhere = (f64::NAN, Place { piece: 0, u: 0.0 });
    let mut spans: [Span; M] = [[nowhere; 2]; M];
    let mut turns = [f64::NAN; M];
    // The last piece with the positions at its last place: as the kinematics gives them, and continued without jumps.
    let mut last: Option<(Rc<Piece<M>>, [f64; M], [f64; M])> = None;
    for number in 0..path.len() {
        let piece = Rc::new(of.piece(number));
        let intervals = INTERVALS * piece.curve.turns();
        let place = |i: usize| piece.width * (i as f64 / intervals as f64);
        let mut positions = [[0.0; 8]; M];
        for i in 0..=intervals {
            let (u, lane) = (place(i), i % 8);
            if lane == 0 {
                positions =
                    piece.at_each(&std::array::from_fn(|lane| place(intervals.min(i + lane))), &mut room);
            }
            let position = std::array::from_fn(|k| positions[k][lane]);
            let reached = match &last {
                None => position,
                Some((before, own, seen)) => {
                    let step = piece.way_from(before, own, &position);
                    std::array::from_fn(|k| seen[k] + step[k])
                }
            };
            for k in 0..of.joints {
                if turns[k].is_nan() && !piece.turning(k) {
                    turns[k] = TURN * ((position[k] - reached[k]) / TURN).round();
                }
                let [least, most] = &mut spans[k];
                let (is_above, is_below) = (least.0 <= reached[k], reached[k] <= most.0);
                let here = (reached[k], Place { piece: number, u });
                if !is_above && !reached[k].is_nan() {
                    *least = here;
                }
                if !is_below && !reached[k].is_nan() {
                    *most = here;
                }
            }
            last = Some((piece.clone(), position, reached));
        }
    }
    let clock = ProfileClock { phases, starts, run_starts: &[] };
    let mut reader =
        phases.fits(path, of.joints).then(|| Reader::new(&clock, Columns::new(path, limits, Some(of))));
    for k in 0..of.joints {
        let [lower, upper] = limits.travel[k];
        let [least, most] = spans[k];
        if !((upper - lower).is_finite() && (most.0 - least.0).is_finite()) {
            continue;
        }
        let (middle, half) = (0.5 * (lower + upper), 0.5 * (upper - lower));
        // If an angle is known up to whole turns on all pieces, it is shifted by the whole turns that fit its travel best.
        let turns = match turns[k] {
            turns if turns.is_nan() => TURN * ((middle - 0.5 * (least.0 + most.0)) / TURN).round(),
            turns => turns,
        };
        let is_upper = most.0 + turns - middle > middle - (least.0 + turns);
        let ((value, place), limit) = if is_upper { (most, upper) } else { (least, lower) };
        let (value, line) = (value + turns, path.line_of(place.piece));
        let ratio = ((value - middle).abs() - 2.0 * ROUNDING * value.abs()) / half;
        let time = reader.as_mut().map_or(0.0, |reader| reader.time_of(place));
        tally.offer_ratio(Check::Travel, k, Worst { value, limit, ratio, time, line });
    }
    tally
}
