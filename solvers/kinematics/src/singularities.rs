//! Joint positions along a whole tip path, with continuous angles, singular places, and the places where joints leave their
//! travel.
//!
//! Pieces are halved until interval arithmetic proves on each part that K is differentiable and that no angle changes by half a
//! turn or more. Then the angle at any point of the part is known up to one number of turns, which is found by joining the ends
//! of the parts. A part of 2⁻³⁰ of a piece on which this is not proven is a singular place: K is singular within that distance. A
//! joint leaves its travel where its whole range on a part is outside.

use std::ops::Range;

use super::path_derivatives::{turns_between, Machine, PartWork, PointWork, BLOCK, TURN};
use super::tip::Tips;
use super::tolerance::{DEEPEST, INTERVAL_DEPTH, INTERVAL_PARTS, TRAVEL};
use feedplan_geometry::interval::Interval;
use feedplan_geometry::parallel::map_with;

/// The order of the series over parts: second derivatives make the bounds of positions and slopes narrow.
const ORDER: usize = 2;

/// The first place in a piece where a joint leaves its travel, its farthest position in the piece, and the limit that it passes.
#[derive(Clone, Copy, Debug)]
pub struct Overrun {
    pub piece: usize,
    pub fraction: f64,
    pub joint: usize,
    pub value: f64,
    pub limit: f64,
}

/// All parts of a path in order, each with smooth joints or else singular; the singular places; and the overruns of travel.
#[derive(Debug, Default)]
pub struct JointPath {
    pub piece: Vec<usize>,
    /// Fractions of the pieces.
    pub part: Vec<[f64; 2]>,
    /// The range of each joint on each part, angles with their whole turns: part by part, joint by joint.
    pub range: Vec<Interval>,
    /// Piece and fraction of the singular places, one for each group of neighbouring parts.
    pub singular: Vec<(usize, f64)>,
    pub overruns: Vec<Overrun>,
}

/// A part of a piece with the ranges of the joints.
struct Part {
    part: [f64; 2],
    range: Vec<Interval>,
}

/// Both halves of a part.
pub fn halves([a, b]: [f64; 2]) -> [[f64; 2]; 2] {
    let middle = 0.5 * (a + b);
    [[a, middle], [middle, b]]
}

/// The joints along pieces joined end to end.
///
/// Angles begin on the turn nearest to `start`, the joint positions before the path. Without `start` they begin on a turn that
/// keeps the whole path within `travel`, the least and the greatest position of each joint; if there is none, with the angle that
/// K gives.
pub fn joint_path(
    machine: Machine,
    tips: Tips,
    travel: Option<&[[f64; 2]]>,
    start: Option<&[f64]>,
) -> JointPath {
    let joints = machine.joints.outputs();
    let space = || PartWork::new(machine, tips, ORDER);
    let found = map_with(tips.len(), BLOCK, space, |work, piece| smooth_parts(machine, work, piece));
    let mut path = JointPath::default();
    for (piece, (parts, singular)) in found.into_iter().enumerate() {
        for part in parts {
            path.piece.push(piece);
            path.part.push(part.part);
            path.range.extend(part.range);
        }
        path.singular.extend(singular.into_iter().map(|fraction| (piece, fraction)));
    }
    path.join(machine, tips);
    path.begin_on_turn(machine, travel, start);
    if let Some(travel) = travel {
        // The rows of a piece are consecutive.
        let rows: Vec<Range<usize>> = path
            .piece
            .chunk_by(|a, b| a == b)
            .scan(0, |end, rows| Some(std::mem::replace(end, *end + rows.len())..*end))
            .collect();
        let space = || (PartWork::new(machine, tips, ORDER), PointWork::new(machine, tips, 0));
        let overruns = map_with(rows.len(), BLOCK, space, |(work, points), n| {
            let piece = path.piece[rows[n].start];
            let parts = rows[n]
                .clone()
                .map(|i| Part { part: path.part[i], range: path.range[i * joints..][..joints].to_vec() })
                .collect();
            overruns(machine, work, points, piece, parts, travel)
        });
        path.overruns = overruns.into_iter().flatten().collect();
    }
    path
}

/// Divides a piece into parts on which K and K' are bounded and angles change by less than half a turn, and smallest parts for
/// which this is not proven. Returns all parts in order, and the middles of the unproven ones, one for each group of neighbours.
fn smooth_parts(machine: Machine, work: &mut PartWork, piece: usize) -> (Vec<Part>, Vec<f64>) {
    let joints = machine.joints.outputs();
    let mut bounds = vec![Interval::WHOLE; (ORDER + 1) * joints];
    let (mut parts, mut singular) = (Vec::new(), Vec::new());
    let mut open = vec![[0.0, 1.0]];
    for depth in 0..=DEEPEST {
        let mut left = Vec::new();
        for part in open {
            work.enclose(piece, part, &mut bounds);
            let (range, slope) = bounds.split_at(joints);
            let known = |joint: usize| {
                let narrow = !machine.turning[joint] || range[joint].width() < TURN / 2.0;
                range[joint].is_bounded() && slope[joint].is_bounded() && narrow
            };
            let own = Part { part, range: range.to_vec() };
            if (0..joints).all(known) {
                parts.push(own);
            } else {
                left.push(own);
            }
        }
        let is_interval = depth >= INTERVAL_DEPTH && left.len() > INTERVAL_PARTS;
        if is_interval || depth == DEEPEST {
            singular.extend(left.iter().map(|own| 0.5 * (own.part[0] + own.part[1])));
            parts.extend(left);
            break;
        }
        open = left.iter().flat_map(|own| halves(own.part)).collect();
        if open.is_empty() {
            break;
        }
    }
    parts.sort_by(|a, b| a.part[0].total_cmp(&b.part[0]));
    singular.sort_by(f64::total_cmp);
    let mut last = f64::NEG_INFINITY;
    singular.retain(|&fraction| {
        let is_first = fraction - last > 0.5f64.powi(INTERVAL_DEPTH as i32);
        last = fraction;
        is_first
    });
    (parts, singular)
}

impl JointPath {
    /// Moves angles by whole turns so that each part begins where the part before ends.
    fn join(&mut self, machine: Machine, tips: Tips) {
        let joints = machine.joints.outputs();
        let mut points = PointWork::new(machine, tips, 0);
        // The end of the part before, without the turns of joining; and these turns so far.
        let mut ended = vec![f64::NAN; joints];
        let mut turns = vec![0.0; joints];
        for (row, (&piece, part)) in self.piece.iter().zip(&self.part).enumerate() {
            let range = &mut self.range[row * joints..][..joints];
            let mut ends = [vec![0.0; joints], vec![0.0; joints]];
            for (end, &fraction) in ends.iter_mut().zip(part) {
                points.at(piece, fraction);
                for joint in 0..joints {
                    let principal = points.derivative(joint, 0);
                    // The range of a singular part may be unbounded and have no middle: its ends are the angles of K.
                    let is_moved = machine.turning[joint] && range[joint].is_bounded();
                    let away = if is_moved { range[joint].middle() - principal } else { 0.0 };
                    end[joint] = principal + turns_between(away) * TURN;
                }
            }
            for joint in (0..joints).filter(|&joint| machine.turning[joint]) {
                if row > 0 {
                    turns[joint] += turns_between(ended[joint] - ends[0][joint]);
                }
                range[joint] = moved(range[joint], turns[joint]);
            }
            let [_, end] = ends;
            ended = end;
        }
    }

    /// Moves all angles of a joint by the same number of turns: near `start`, or else into the travel.
    fn begin_on_turn(&mut self, machine: Machine, travel: Option<&[[f64; 2]]>, start: Option<&[f64]>) {
        let joints = machine.joints.outputs();
        for joint in (0..joints).filter(|&joint| machine.turning[joint]) {
            let own = self.range.iter().skip(joint).step_by(joints);
            let turns = match (start, travel) {
                (Some(start), _) => {
                    own.take(1).map(|first| turns_between(start[joint] - first.middle())).sum()
                }
                (None, Some(travel)) => turns_into(travel[joint], own),
                (None, None) => 0.0,
            };
            for range in self.range.iter_mut().skip(joint).step_by(joints) {
                *range = moved(*range, turns);
            }
        }
    }
}

fn moved(range: Interval, turns: f64) -> Interval {
    range + Interval::exactly(turns * TURN)
}

/// The number of turns nearest to 0 that brings all bounded ranges into the travel; 0 if there is none.
fn turns_into<'a>([lo, hi]: [f64; 2], ranges: impl Iterator<Item = &'a Interval>) -> f64 {
    let known = ranges.filter(|range| range.is_bounded()).copied().reduce(Interval::hull);
    let Some(Interval { lo: least, hi: most }) = known else { return 0.0 };
    let slack = TRAVEL / TURN;
    let (first, last) = ((lo - least) / TURN - slack, (hi - most) / TURN + slack);
    // 0, or the nearest number of turns that fits.
    let nearest = 0.0f64.max(first.ceil()).min(last.floor());
    if nearest.is_finite() && first <= nearest && nearest <= last {
        nearest
    } else {
        0.0
    }
}

/// The first overrun of each joint in a piece, with the farthest position found in the piece.
fn overruns(
    machine: Machine,
    work: &mut PartWork,
    points: &mut PointWork,
    piece: usize,
    mut parts: Vec<Part>,
    travel: &[[f64; 2]],
) -> Vec<Overrun> {
    let joints = machine.joints.outputs();
    let limits = |joint: usize| [travel[joint][0] - TRAVEL, travel[joint][1] + TRAVEL];
    let mut bounds = vec![Interval::WHOLE; (ORDER + 1) * joints];
    // For each joint the first place, the farthest position, and its distance beyond the travel.
    let mut found: Vec<Option<(f64, f64, f64)>> = vec![None; joints];
    for _ in 0..DEEPEST {
        let mut halved = Vec::new();
        for Part { part, range } in &parts {
            let is_out = |joint: usize| {
                let ([lo, hi], range) = (limits(joint), range[joint]);
                range.is_bounded() && (range.hi < lo || range.lo > hi)
            };
            let may_leave = |joint: usize| {
                let ([lo, hi], range) = (limits(joint), range[joint]);
                range.is_bounded() && (range.lo < lo || range.hi > hi)
            };
            if (0..joints).any(is_out) {
                for &fraction in part {
                    points.at(piece, fraction);
                    for joint in (0..joints).filter(|&joint| is_out(joint)) {
                        let principal = points.derivative(joint, 0);
                        let away = range[joint].middle() - principal;
                        let turns = if machine.turning[joint] { turns_between(away) } else { 0.0 };
                        let value = principal + turns * TURN;
                        let [lo, hi] = limits(joint);
                        let over = (lo - value).max(value - hi);
                        let (first, farthest, most) = found[joint].unwrap_or((1.0, 0.0, 0.0));
                        let (farthest, most) = if over > most { (value, over) } else { (farthest, most) };
                        found[joint] = Some((first.min(part[0]), farthest, most));
                    }
                }
            }
            if (0..joints).any(|joint| may_leave(joint) && !is_out(joint)) {
                for half in halves(*part) {
                    work.enclose(piece, half, &mut bounds);
                    let own = (0..joints).map(|joint| {
                        let away = range[joint].middle() - bounds[joint].middle();
                        let turns = if machine.turning[joint] { turns_between(away) } else { 0.0 };
                        moved(bounds[joint], turns)
                    });
                    halved.push(Part { part: half, range: own.collect() });
                }
            }
        }
        if halved.is_empty() {
            break;
        }
        parts = halved;
    }
    let places = found.into_iter().enumerate().filter_map(|(joint, found)| Some((joint, found?)));
    places
        .map(|(joint, (fraction, value, _))| {
            let limit = travel[joint][usize::from(value >= limits(joint)[0])];
            Overrun { piece, fraction, joint, value, limit }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::Expression;

    /// The angle of a point about the origin in degrees, and its distance from the origin.
    fn column() -> Expression {
        let rows = [[12, 1, 0], [14, 2, 0], [8, 0, 0], [8, 1, 0], [2, 4, 5], [9, 6, 0]];
        Expression::new(2, &rows, &[0.0; 6], &[3, 7]).expect("a list in order")
    }

    /// Straight pieces between points.
    fn lines(points: &[[f64; 2]]) -> (Vec<f64>, Vec<f64>) {
        let control = points.windows(2).flatten().flatten().copied().collect();
        (control, vec![1.0; points.len() - 1])
    }

    fn path(points: &[[f64; 2]], travel: Option<&[[f64; 2]]>) -> JointPath {
        let ((control, width), joints) = (lines(points), column());
        let tips = Tips { axes: 2, points: 2, control: &control, weights: &[], width: &width };
        joint_path(Machine { joints: &joints, turning: &[true, false] }, tips, travel, None)
    }

    #[test]
    fn an_angle_goes_on_turning() {
        let corner = |i: usize| (i as f64 * 45.0).to_radians();
        let points: Vec<[f64; 2]> = (0..=20).map(|i| [corner(i).cos(), corner(i).sin()]).collect();
        let found = path(&points, None);
        assert!(found.singular.is_empty());
        let last = found.range[found.range.len() - 2];
        assert!(last.lo <= 900.0 && 900.0 <= last.hi && last.width() < 46.0, "{last:?}");
    }

    #[test]
    fn a_line_through_the_column_is_singular_there_and_one_beside_it_is_not() {
        let found = path(&[[-60.0, 0.0], [-30.0, 0.0], [60.0, 0.0]], None);
        assert_eq!(found.singular.len(), 1);
        let (piece, fraction) = found.singular[0];
        assert!(piece == 1 && (fraction - 1.0 / 3.0).abs() < 1e-8);
        assert!(path(&[[-60.0, 1e-6], [60.0, 1e-6]], None).singular.is_empty());
    }

    #[test]
    fn a_travel_end_is_found_where_it_is_passed() {
        let found = path(&[[20.0, 0.0], [120.0, 0.0]], Some(&[[-400.0, 400.0], [10.0, 100.0]]));
        let [overrun] = found.overruns[..] else { panic!("{:?}", found.overruns) };
        assert_eq!((overrun.joint, overrun.limit), (1, 100.0));
        assert!((overrun.fraction - 0.8).abs() < 1e-6 && (overrun.value - 120.0).abs() < 0.1);
    }
}
