//! Cuts the runs of a path into subruns where the tool must rest (stops, and cusps, whose curvature has no bound), and each
//! subrun into parts without such a place and without a kink of the speed cap. Where the path turns back, the tool is at rest
//! only for an instant, and its acceleration need not vanish: such subruns follow each other in a chain.
//!
//! Input: the pieces and limits of a problem. Lengths in mm, speeds in mm/s, parameters u in [0, width] of a piece.

use std::cmp::Reverse;

use crate::arc_length_path::{
    panel, path_point, per_feed, piece, speed_sq, straight, tool_curvature, Part, MAX_RATE,
};
use crate::jerk_profile::JerkProfile;
use crate::path_problem::{shortest_part, Limits};
use feedplan_geometry::bisection::boundary;
use feedplan_geometry::parallel::{map, try_map};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::dot;
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::cusps::piece_cusps;
use feedplan_geometry::spline::rational::Hodograph;
use feedplan_geometry::tolerance::CUSP;
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{along, lesser, Fault, Problem};

/// Cusps closer to the end of a piece than this fraction of it count as its end.
const AT_END: f64 = 1e-9;
/// The speed at a sharp turn, in units of the speed that the axes gain in a moment: below `CREEP` the tool would creep,
/// so that it rests there; below `TIGHT_TURN` the piece is cut there.
pub const CREEP: f64 = 0.02;
const TIGHT_TURN: f64 = 10.0;
/// A moment is a servo period, but at most this fraction of the time to full speed.
pub const MOMENT: f64 = 0.1;
/// A point is slow if |C'(u)|² is below this fraction of its maximum on the piece.
const SLOW: f64 = 0.25;
/// A piece is cut where |C'(u)|² is one of these fractions of its maximum, each 1/64 of the one before. Beside a slow point a
/// millionth of the length may have half of the range of u; samples at equal distances on the whole piece miss the turns there.
const LEVELS: [f64; 4] = [1e-3, 1.6e-5, 2.4e-7, 3.8e-9];
/// A turn beside a slow point is searched for at this many distances, each half the one before, and then by this many rounds of
/// ternary search. It counts if its curvature exceeds that of the slow point by this factor.
const REACHES: i32 = 40;
const ROUNDS: usize = 20;
const SHARPER: f64 = 2.0;
/// To both sides of a slow point |C'(u)|² must rise by more than this fraction: less may be the rounding of a constant speed,
/// whose minimum may be anywhere.
const RISE: f64 = 1e-6;
/// Numbers of equal parts of a piece between which its curvature is sampled: the first, …
const SAMPLES: [usize; 2] = [4, 64];
/// … or the second, if at a sample the radius is less than this multiple of the chord tolerance.
const TIGHT: f64 = 10.0;
/// Distance from a point of a line at which its direction is compared, as a fraction of the piece.
const BESIDE: f64 = 1e-4;
/// A jump of the acceleration that third differences of setpoints show as less than this fraction of the limit of jerk counts as
/// rounding: half of what an audit can resolve.
const UNSEEN: f64 = 5e-7;
/// Greatest number of chains of a run that are planned together.
const TOGETHER: usize = 64;
/// Number of pieces that a thread cuts at a time.
const CUT_AT_ONCE: usize = 64;
/// The fraction of a plan's progress that this cutting takes.
const CUTTING: f64 = 0.1;

/// Parts of pieces between two places of rest or ends of the path.
#[derive(Clone, Debug)]
pub struct Subrun {
    pub number: usize,
    run: usize,
    pub parts: Vec<Part>,
    /// Speeds along the axes' path at its ends, in mm/s.
    pub ends: [f64; 2],
}

/// A sequence of subruns between which the path turns back.
pub struct Chain<'a> {
    pub subruns: &'a [Subrun],
    /// The greatest acceleration along the path, in mm/s², with which the tool can turn back after each subrun but the last.
    pub turns: &'a [f64],
}

/// The profile of a path within these jerk limits in mm/s³; `plan` plans each subrun alone and reports its progress. A run with
/// an unplanned subrun has no phases.
pub fn over_subruns<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    plan: impl Fn(&Subrun, &Limits<M>, Watch) -> Result<JerkProfile, Fault> + Sync,
) -> Result<JerkProfile, Fault> {
    over_chains(problem, jerk, |chains, limits, watch| {
        let subruns: Vec<&Subrun> = chains.iter().flat_map(|chain| chain.subruns).collect();
        try_map(subruns.len(), 1, |i| plan(subruns[i], limits, watch.part(subruns[i].parts.len() as f64)))
    })
}

/// `over_subruns` with a `plan` that plans all subruns of some chains of a run. Its watch counts parts of pieces.
pub fn over_chains<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    plan: impl Fn(&[Chain], &Limits<M>, Watch) -> Result<Vec<JerkProfile>, Fault> + Sync,
) -> Result<JerkProfile, Fault> {
    let limits = checked(problem, jerk)?;
    let subruns = subruns(problem);
    let turns = turns(problem, &limits, &subruns);
    let watch = problem.watch.part(1.0 - CUTTING).each(problem.width.len());
    let chains = chains(&subruns, &turns);
    // Each run is planned alone, so that its result is the same to the bit whatever other runs there are.
    let runs = chains.chunk_by(|a, b| a.subruns[0].run == b.subruns[0].run);
    let together: Vec<&[Chain]> = runs.flat_map(|run| run.chunks(TOGETHER)).collect();
    let order = longest_first(&together);
    let mut planned = vec![vec![]; together.len()];
    let results = try_map(order.len(), 1, |n| plan(together[order[n]], &limits, watch))?;
    for (i, result) in order.into_iter().zip(results) {
        planned[i] = result;
    }
    let mut planned = planned.into_iter().flatten();
    let (mut kept, mut runs, mut lower_bound) = (vec![], vec![0], vec![]);
    for run in subruns.chunk_by(|a, b| a.run == b.run) {
        let mut own: Vec<JerkProfile> = planned.by_ref().take(run.len()).collect();
        if own.iter().any(JerkProfile::is_unplanned) {
            own = vec![JerkProfile::unplanned()];
        }
        let count: usize = own.iter().map(|part| part.phases.len()).sum();
        runs.push(runs[runs.len() - 1] + count as i64);
        lower_bound.push(own.iter().flat_map(|part| &part.lower_bound).sum());
        kept.extend(own);
    }
    let mut all = JerkProfile::joined(kept);
    (all.runs, all.lower_bound) = (runs, lower_bound);
    Ok(all)
}

/// The indices of groups of chains, those with the most parts of pieces first: no thread is left with a long group at the end.
fn longest_first(groups: &[&[Chain]]) -> Vec<usize> {
    let parts = |i: &usize| -> usize {
        groups[*i].iter().flat_map(|chain| chain.subruns).map(|subrun| subrun.parts.len()).sum()
    };
    let mut order: Vec<usize> = (0..groups.len()).collect();
    order.sort_by_cached_key(|i| Reverse(parts(i)));
    order
}

/// The limits of the axes, after a check of all numbers of the problem.
pub fn checked<const M: usize>(problem: &Problem<M>, jerk: &[f64; M]) -> Result<Limits<M>, Fault> {
    problem.check()?;
    for (axis, &limit) in jerk.iter().enumerate() {
        if !(limit > 0.0 && limit.is_finite()) {
            let what = format!("the jerk limit of axis {axis} is {limit} mm/s³: give a positive number");
            return Err(Fault::Input { piece: None, what });
        }
    }
    Ok(Limits { velocity: problem.max_velocity, acceleration: problem.max_acceleration, jerk: *jerk })
}

/// The greatest accelerations along the path, in mm/s², with which the tool can turn back between subruns.
pub fn turns<const M: usize>(problem: &Problem<M>, limits: &Limits<M>, subruns: &[Subrun]) -> Vec<f64> {
    subruns.windows(2).map(|pair| turn(problem, limits, &pair[0], &pair[1])).collect()
}

/// Groups the subruns into chains: a chain ends where the acceleration of a turn is 0.
pub fn chains<'a>(subruns: &'a [Subrun], turns: &'a [f64]) -> Vec<Chain<'a>> {
    let mut out = vec![];
    let mut first = 0;
    for end in 1..=subruns.len() {
        if end == subruns.len() || turns[end - 1] == 0.0 {
            out.push(Chain { subruns: &subruns[first..end], turns: &turns[first..end - 1] });
            first = end;
        }
    }
    out
}

/// The greatest acceleration along the path, in mm/s², with which the tool can turn back from the end of a subrun to the
/// next one; 0 where the path does not turn back, or a run ends.
///
/// Both directions count as opposite if setpoints do not show the jump between the accelerations before and after the turn.
fn turn<const M: usize>(problem: &Problem<M>, limits: &Limits<M>, before: &Subrun, after: &Subrun) -> f64 {
    let (end, start) = (before.parts[before.parts.len() - 1], after.parts[0]);
    if before.run != after.run {
        return 0.0;
    }
    let back = path_point(problem, end.piece, end.u[1]).first;
    let first = path_point(problem, start.piece, start.u[0]).first;
    let acceleration = along(&limits.acceleration, &first);
    let unseen =
        |k: usize| acceleration * (first[k] + back[k]).abs() <= UNSEEN * limits.jerk[k] * problem.period;
    if (0..M).all(unseen) {
        acceleration
    } else {
        0.0
    }
}

pub fn subruns<const M: usize>(problem: &Problem<M>) -> Vec<Subrun> {
    let watch = problem.watch.part(CUTTING).each(problem.width.len());
    let shortest = shortest_part(extent(problem));
    let places = |i: usize| {
        watch.count(i);
        cuts(problem, i, shortest)
    };
    let mut all: Vec<Cuts> = map(problem.width.len(), CUT_AT_ONCE, places);
    let mut out: Vec<Subrun> = vec![];
    for (run, pair) in problem.runs.windows(2).enumerate() {
        let mut rests = true;
        for i in pair[0]..pair[1] {
            let Cuts { inside, cusped } = std::mem::take(&mut all[i]);
            rests |= i > pair[0] && problem.junction_speed[i] == 0.0;
            let (mut from, mut rest) = (0.0, rests || cusped[0]);
            for (to, then) in inside.into_iter().chain([(problem.width[i], false)]) {
                if rest {
                    out.push(Subrun { number: out.len(), run, parts: vec![], ends: [0.0; 2] });
                }
                let last = out.len() - 1;
                out[last].parts.push(Part { piece: i, u: [from, to] });
                (from, rest) = (to, then);
            }
            rests = cusped[1];
        }
    }
    // Given end speeds are the tool's; convert them to the axes' path.
    let on_path = |speed: f64, i: usize, u: f64| {
        if speed > 0.0 {
            speed * per_feed(problem, i, u, speed_sq(problem, i, u))
        } else {
            0.0
        }
    };
    let (last, end) = (out.len() - 1, problem.width.len() - 1);
    out[0].ends[0] = on_path(problem.start_speed, 0, 0.0);
    out[last].ends[1] = on_path(problem.end_speed, end, problem.width[end]);
    out
}

/// Where a piece is cut.
#[derive(Default)]
struct Cuts {
    /// Rising parameters inside it, and whether the tool must rest there.
    inside: Vec<(f64, bool)>,
    /// Whether the tool must rest at the start and at the end of the piece.
    cusped: [bool; 2],
}

/// The diagonal of the box around all control points, in mm.
fn extent<const M: usize>(problem: &Problem<M>) -> f64 {
    let diagonal: [f64; M] = std::array::from_fn(|k| {
        let axis = || problem.control.iter().map(|point| point[k]);
        axis().fold(f64::NEG_INFINITY, f64::max) - axis().fold(f64::INFINITY, f64::min)
    });
    dot(&diagonal, &diagonal).sqrt()
}

/// Where piece `i` is cut: no part is shorter than `shortest`, in mm.
fn cuts<const M: usize>(problem: &Problem<M>, i: usize, shortest: f64) -> Cuts {
    let (cusps, mut cusped) = cusps(problem, i);
    let mut cuts: Vec<(f64, bool)> = cusps.into_iter().map(|u| (u, true)).collect();
    let at_cusp = |u: f64| cusped[0] && u == 0.0 || cusped[1] && u == problem.width[i];
    let slow = SlowPlaces::new(&slope_sq(problem, i), problem.width[i]);
    for u in slow.points.into_iter().filter(|&u| !at_cusp(u)) {
        cuts.push((u, turn_speed(problem, i, u) < CREEP));
        let turns = turns_beside(problem, i, u).into_iter().map(|u| (u, turn_speed(problem, i, u)));
        cuts.extend(turns.filter(|turn| turn.1 < TIGHT_TURN).map(|(u, speed)| (u, speed < CREEP)));
    }
    // A line does not turn. Beside a place of rest the ramp is computed from many points; on shorter parts the tool would creep.
    let rests = cusped != [false; 2] || cuts.iter().any(|(_, rests)| *rests);
    if !slow.levels.is_empty() && !rests && !is_line(problem, i) {
        cuts.extend(slow.levels.into_iter().map(|u| (u, false)));
    }
    cuts.extend(chord_kinks(problem, i).into_iter().map(|u| (u, false)));
    let inside = AT_END * problem.width[i]..=(1.0 - AT_END) * problem.width[i];
    cuts.retain(|(u, _)| inside.contains(u));
    let is_short = |from: f64, to: f64| panel(problem, i, from, to) < shortest;
    cuts.retain(|&(u, rests)| {
        let at_end = [is_short(0.0, u), is_short(u, problem.width[i])];
        for end in 0..2 {
            cusped[end] |= rests && at_end[end];
        }
        at_end == [false; 2]
    });
    cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
    cuts.dedup_by(|b, a| {
        let same = b.0 - a.0 <= AT_END * problem.width[i] || is_short(a.0, b.0);
        a.1 |= same && b.1;
        same
    });
    Cuts { inside: cuts, cusped }
}

/// Whether piece `i` is straight, and the feed counts the length of the axes' path.
fn is_line<const M: usize>(problem: &Problem<M>, i: usize) -> bool {
    let own = piece(problem, i);
    problem.way.is_none() && straight(&own, 0.5 * own.width).is_some()
}

/// Parameters inside piece `i` at which the tool must rest, and whether it must rest at the start and at the end.
fn cusps<const M: usize>(problem: &Problem<M>, i: usize) -> (Vec<f64>, [bool; 2]) {
    let own = piece(problem, i);
    let mut points = piece_cusps(&own, CUSP);
    if points.is_empty() {
        return (points, [false; 2]);
    }
    let ends =
        [points.first().is_some_and(|&t| t < AT_END), points.last().is_some_and(|&t| t > 1.0 - AT_END)];
    if is_line(problem, i) {
        // A line that does not turn back has no cusp inside. At its ends a speed above 0 would need an infinite u̇².
        let tangent = |t: f64| derivatives(&own, t * own.width)[1];
        points.retain(|&t| dot(&tangent(t - BESIDE), &tangent(t + BESIDE)) < 0.0);
    }
    points.retain(|&t| (AT_END..=1.0 - AT_END).contains(&t));
    (points.iter().map(|t| t * own.width).collect(), ends)
}

/// |C'|² of the axes' path on piece `i` by t in [0, 1], times a factor.
fn slope_sq<const M: usize>(problem: &Problem<M>, i: usize) -> Polynomial<MAX_RATE> {
    if let Some(way) = problem.way {
        return Polynomial::from_bernstein(way.of(i).iter().copied());
    }
    let hodograph = Hodograph::new(&piece(problem, i));
    let axis = |k: usize| -> Polynomial<MAX_RATE> {
        Polynomial::from_bernstein(hodograph.coefficients().iter().map(|row| row[k]))
    };
    (0..M).map(axis).fold(Polynomial::constant(0.0), |sum, g| sum.combine(1.0, &g.multiply(&g), 1.0))
}

/// Parameters of a piece with C'(u) much smaller than elsewhere on it.
#[derive(Default)]
struct SlowPlaces {
    /// Where |C'|² has a low minimum: the path may turn sharply there, or beside it.
    points: Vec<f64>,
    /// Where |C'|² is at one of the `LEVELS`.
    levels: Vec<f64>,
}

impl SlowPlaces {
    /// By |C'|² as a polynomial of t in [0, 1], times any factor.
    fn new(square: &Polynomial<MAX_RATE>, width: f64) -> Self {
        let (least, greatest) = square.range();
        if least >= SLOW * greatest {
            return Self::default();
        }
        let mut levels = vec![];
        for level in LEVELS.map(|level| level * greatest).into_iter().take_while(|&level| level > least) {
            let above = square.combine(1.0, &Polynomial::constant(1.0), -level);
            above.sign_changes(&mut |t| levels.push(t * width));
        }
        let mut turns = vec![0.0];
        square.derivative().sign_changes(&mut |t| turns.push(t));
        turns.push(1.0);
        let speeds: Vec<f64> = turns.iter().map(|&t| square.value(t)).collect();
        let is_low = |n: usize| {
            let least = speeds[n];
            least < SLOW * greatest
                && (n == 0 || rises(least, speeds[..n].iter().rev()))
                && (n + 1 == speeds.len() || rises(least, speeds[n + 1..].iter()))
        };
        let points = (0..turns.len()).filter(|&n| is_low(n)).map(|n| turns[n] * width).collect();
        Self { points, levels }
    }
}

/// Parameters of piece `i` to either side of a slow point where the tool's path turns the most, if it turns more there than at
/// the slow point: the residual C' at the slow point has another direction than C' farther away, and the path turns where both
/// components are equal. A path that turns the most at an end of the piece has no such parameter.
fn turns_beside<const M: usize>(problem: &Problem<M>, i: usize, slow: f64) -> Vec<f64> {
    let width = problem.width[i];
    let curvature = |u: f64| {
        let curvature = tool_curvature(problem, i, u);
        if curvature.is_finite() {
            curvature
        } else {
            0.0
        }
    };
    let sharpest = |reach: f64| {
        let at = |n: i32| slow + reach * 0.5_f64.powi(n);
        let n = (1..REACHES).max_by(|&a, &b| curvature(at(a)).total_cmp(&curvature(at(b))))?;
        let (mut low, mut high) = (at(n + 1), at(n - 1));
        for _ in 0..ROUNDS {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if curvature(a) < curvature(b) {
                low = a;
            } else {
                high = b;
            }
        }
        let u = 0.5 * (low + high);
        (curvature(u) > SHARPER * curvature(slow) && curvature(u) > curvature(at(0))).then_some(u)
    };
    let both = [-slow, width - slow].into_iter().filter(|reach| reach.abs() > AT_END * width);
    both.filter_map(sharpest).collect()
}

/// Whether |C'(u)|² rises from a point to one side before it falls below its value at the point.
fn rises<'a>(least: f64, mut beside: impl Iterator<Item = &'a f64>) -> bool {
    beside.find(|&&speed| speed < least || speed > (1.0 + RISE) * least).is_some_and(|&speed| speed > least)
}

/// Parameters inside piece `i` where the radius of the tool's path is the chord tolerance. The speed cap by the chord
/// error has a kink there: on smaller circles every chord stays within the tolerance.
fn chord_kinks<const M: usize>(problem: &Problem<M>, i: usize) -> Vec<f64> {
    let (tolerance, width) = (problem.chord_tolerance, problem.width[i]);
    if !tolerance.is_finite() {
        return vec![];
    }
    // Tolerance over radius.
    let inverse_radius = |u: f64| tool_curvature(problem, i, u) * tolerance;
    let points = |count: usize| (0..=count).map(move |n| width * n as f64 / count as f64);
    if points(SAMPLES[0]).all(|u| TIGHT * inverse_radius(u) < 1.0) {
        return vec![];
    }
    let looked: Vec<(f64, bool)> = points(SAMPLES[1]).map(|u| (u, inverse_radius(u) > 1.0)).collect();
    let crossed = looked.windows(2).filter(|pair| pair[0].1 != pair[1].1);
    let kinks = crossed.map(|pair| {
        let [(from, tight), (to, _)] = [pair[0], pair[1]];
        let [low, high] = boundary(from, to, |u| (inverse_radius(u) > 1.0) == tight);
        0.5 * (low + high)
    });
    kinks.filter(|&u| u > AT_END * width && u < (1.0 - AT_END) * width).collect()
}

/// The greatest speed at u of piece `i` by the acceleration of turning, in units of the speed that the axes gain in a
/// moment. Where the tool would creep, setpoints cannot show the time of a stop.
fn turn_speed<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> f64 {
    let point = path_point(problem, i, u);
    let [velocity, acceleration] = [&problem.max_velocity, &problem.max_acceleration].map(lesser);
    let of_axis = |k: usize| {
        let gained = (acceleration[k] * problem.period).min(MOMENT * velocity[k]);
        (acceleration[k] / point.second[k].abs()).sqrt() / gained
    };
    (0..M).map(of_axis).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::one_piece::one_piece;

    #[test]
    fn a_path_that_turns_the_most_at_its_end_is_not_cut_beside_it() {
        // x = t + t², y = 0.03 t⁴: slow and straight at t = 0, with a curvature that rises to the end.
        let control = [[0.0, 0.0], [0.25, 0.0], [2.0 / 3.0, 0.0], [1.25, 0.0], [2.0, 0.03]];
        let slow = one_piece(&control, &[0, 5], &[1.0]);
        let problem = Problem { feed: &[1e3], max_velocity: [[1e3; 2]; 2], period: 0.01, ..slow };
        let found = subruns(&problem);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].parts, [Part { piece: 0, u: [0.0, 1.0] }]);
    }
}
