//! Runs the two-pass profiler on a path of the package: cuts subruns into segments with limits along the path, and plans their
//! profile.
//!
//! Neighbouring straight pieces of one direction are one segment. A curved piece is halved where the limits of its
//! halves differ and the axes can use the difference; parts whose limits differ little are joined again. The
//! acceleration is 0 where segments meet, so that each segment costs time, but on a long segment the tightest point
//! limits all of it. Several cuttings (`Cutting`) are tried, and each subrun takes the quickest.

use crate::arc_length_path::{piece, ArcLengthPath, Junction};
use crate::curvature_jumps::HALF;
use crate::feed;
use crate::jerk_limited::on_path::Task;
use crate::jerk_profile::JerkProfile;
use crate::path_limits::{allowable, bounded, greatest, Allowable, Curve, Shape};
use crate::path_problem::{shortest_part, Effort, Geometry, Limits, PathPoint, SpeedCap};
use crate::s_curve::{self, Section, Segment, SegmentEnd};
use crate::subruns::{checked, over_subruns, subruns, Subrun, CREEP, MOMENT};
use feedplan_geometry::quadratic::sub;
use feedplan_geometry::spline::bezier::split;
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{greater, Fault, Problem};

/// Bounds on derivatives exceed them by about this fraction.
const ACCURACY: f64 = 0.05;
/// Samples of a segment where no bound is proven.
const SAMPLES: usize = 33;
/// A junction counts as limiting the speed if it is passed at this fraction of its cap or faster.
const HELD: f64 = 0.998;

/// A jump of the curvature that lowers the limits of jerk by at most this fraction does so on the whole of the parts beside it;
/// around greater jumps the path is cut.
const LITTLE: f64 = 0.05;

/// A part is halved up to `DEPTH` times where, by `LOOKED` samples, one half may be faster than the whole by more than the
/// fraction `WORTH`. Next to a tight turn the bounds of one half may allow far more than those of the whole, by more than the
/// fraction `WELL_WORTH`; there it is halved up to `MOST_DEPTH` times.
const WORTH: f64 = 0.05;
const LOOKED: usize = 9;
const DEPTH: u32 = 5;
const WELL_WORTH: f64 = 1.0;
const MOST_DEPTH: u32 = 40;

/// Parameters of cutting a subrun into segments.
#[derive(Clone, Copy, Debug)]
pub struct Cutting {
    /// The reference length of `path_limits`, in units of the length from rest to rest that just reaches the greatest speed. With
    /// 1 or more, a line uses its full speed. Short reference lengths favour the acceleration.
    pub lengths: f64,
    /// Parts are joined if that lowers the speed of each by at most this fraction.
    pub alike: f64,
}

/// The profile of a path, with the fastest of the cuttings for each subrun and this look-ahead in segments. The jerk-limited
/// planner plans, with this effort, the subruns that begin or end in motion and those that have a segment next to a cusp with no
/// speed or hardly any.
pub fn plan<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    cuttings: &[Cutting],
    look_ahead: usize,
    effort: &Effort,
) -> Result<JerkProfile, Fault> {
    over_subruns(problem, jerk, |subrun, limits, watch| {
        let path = ArcLengthPath::new(problem, &subrun.parts);
        match quickest(problem, &path, subrun, limits, (cuttings, look_ahead), watch)? {
            Some(own) => Ok(along(&path, limits, &own.sections)),
            None => Task::new(problem, limits, &Effort { watch, ..*effort }).subrun(subrun),
        }
    })
}

/// The segments of each subrun that `plan` uses; empty for a subrun that the jerk-limited planner plans.
pub fn cut<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    cuttings: &[Cutting],
    look_ahead: usize,
) -> Result<Vec<Vec<Segment>>, Fault> {
    let limits = checked(problem, jerk)?;
    let each = problem.watch.each(problem.width.len());
    let segments = |subrun: &Subrun| {
        let path = ArcLengthPath::new(problem, &subrun.parts);
        let watch = each.part(subrun.parts.len() as f64);
        let own = quickest(problem, &path, subrun, &limits, (cuttings, look_ahead), watch)?;
        Ok(own.map(|own| own.segments).unwrap_or_default())
    };
    subruns(problem).iter().map(segments).collect()
}

/// The profile of given sections: subrun i has those from `offsets[i]` to `offsets[i + 1]`. A subrun without sections gets the
/// jerk-limited profile.
pub fn of_sections<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    offsets: &[usize],
    sections: &[Section],
) -> Result<JerkProfile, Fault> {
    over_subruns(problem, jerk, |subrun, limits, watch| {
        let own = offsets.get(subrun.number).zip(offsets.get(subrun.number + 1));
        match own.and_then(|(&from, &to)| sections.get(from..to)).filter(|own| !own.is_empty()) {
            Some(own) => {
                watch.advance(1);
                Ok(along(&ArcLengthPath::new(problem, &subrun.parts), limits, own))
            }
            None => {
                let effort = Effort { watch, ..Effort::default() };
                Task::new(problem, limits, &effort).subrun(subrun)
            }
        }
    })
}

/// The phases of sections from rest to rest, and the junctions that limit the speed.
fn along<const M: usize>(path: &ArcLengthPath<M>, limits: &Limits<M>, sections: &[Section]) -> JerkProfile {
    let mut phases = JerkProfile::default();
    phases.push_sections(path, sections, SegmentEnd::moving(0.0));
    let mut next = 0;
    for Junction { cap, jumps } in path.junctions(&limits.jerk) {
        while next + 1 < sections.len() && sections[next + 1].position <= cap.s {
            next += 1;
        }
        // Around the junction the speed is at most the junction's cap.
        if jumps && sections[next].speed >= HELD * cap.speed {
            phases.kinks.push(path.parts[path.part(cap.s)].piece as u32);
        }
    }
    phases
}

struct Planned {
    segments: Vec<Segment>,
    sections: Vec<Section>,
}

/// A subrun from rest to rest with the fastest of the cuttings; None if a segment has no speed or hardly any, or if an end is in
/// motion.
fn quickest<const M: usize>(
    problem: &Problem<M>,
    path: &ArcLengthPath<M>,
    subrun: &Subrun,
    limits: &Limits<M>,
    (cuttings, look_ahead): (&[Cutting], usize),
    watch: Watch,
) -> Result<Option<Planned>, Fault> {
    if subrun.ends != [0.0; 2] {
        return Ok(None);
    }
    let parts = Parts::new(problem, path, limits, watch.part(0.5));
    let each = watch.part(0.25).each(cuttings.len());
    let mut best: Option<Planned> = None;
    let mut least = f64::INFINITY;
    for cutting in cuttings {
        let Some(segments) = parts.joined(cutting, each) else { return Ok(None) };
        if best.as_ref().is_some_and(|best| best.segments == segments) {
            continue;
        }
        let sections = s_curve::plan(&segments, look_ahead, each)?;
        let time = sections.iter().map(|section| section.duration).sum();
        if time < least {
            (least, best) = (time, Some(Planned { segments, sections }));
        }
    }
    Ok(best)
}

/// A part of a subrun, before parts are joined to segments.
#[derive(Clone, Copy)]
struct Cut<const M: usize> {
    shape: Shape<M>,
    /// The speed cap by feed and chord error, in mm/s.
    cap: f64,
    length: f64,
    /// The fraction by which the limits of jerk are lower, near a jump of the curvature.
    share: f64,
    /// The speed limit where this part meets the next one, in mm/s.
    junction: f64,
}

/// The limits around a junction, or between junctions.
#[derive(Clone, Copy)]
struct Around {
    /// The greatest speed, in mm/s.
    speed: f64,
    /// The fraction by which the limits of jerk are lower.
    share: f64,
}

/// A subrun from rest to rest, cut into parts whose limits vary little.
struct Parts<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    path: &'a ArcLengthPath<'a, M>,
    axes: Limits<M>,
    cuts: Vec<Cut<M>>,
}

impl<'a, const M: usize> Parts<'a, M> {
    fn new(
        problem: &'a Problem<'a, M>,
        path: &'a ArcLengthPath<'a, M>,
        limits: &Limits<M>,
        watch: Watch,
    ) -> Self {
        let mut parts = Self { problem, path, axes: *limits, cuts: vec![] };
        let free = SpeedCap::new(0.0, f64::INFINITY);
        let mut before = free;
        let junctions = path.junctions(&limits.jerk);
        for part in 0..path.parts.len() {
            watch.each(path.parts.len()).advance(1);
            let ends = [path.knots()[part], path.knots()[part + 1]];
            let after = junctions.get(part).map_or(free, |junction| junction.cap);
            parts.between(part, ends, [before, after]);
            // Parts that were cut around a junction already have its speed cap.
            if let Some(last) = parts.cuts.last_mut().filter(|_| after.share <= LITTLE) {
                last.junction = last.junction.min(after.speed);
            }
            before = after;
        }
        parts
    }

    /// Appends the part between two junctions. Around a junction that lowers the limits of jerk by more than `LITTLE`, a range of
    /// its own has the limits of the junction; where the junction limits the speed, half a third difference spans no more than
    /// that speed travels.
    fn between(&mut self, part: usize, [from, to]: [f64; 2], junctions: [SpeedCap; 2]) {
        let time = HALF * self.problem.period;
        let reach =
            junctions.map(|cap| if cap.share > LITTLE { cap.reach.min(time * cap.speed) } else { 0.0 });
        let around = junctions.map(|cap| Around {
            speed: if cap.share > LITTLE { cap.speed } else { f64::INFINITY },
            share: cap.share,
        });
        if reach[0] + reach[1] >= to - from {
            let [a, b] = around;
            let both = Around { speed: a.speed.min(b.speed), share: a.share.max(b.share) };
            self.append(part, [from, to], &both);
            return;
        }
        let little = around.map(|Around { share, .. }| if share > LITTLE { 0.0 } else { share });
        let inner = [from + reach[0], to - reach[1]];
        if reach[0] > 0.0 {
            self.append(part, [from, inner[0]], &around[0]);
        }
        self.append(part, inner, &Around { speed: f64::INFINITY, share: little[0].max(little[1]) });
        if reach[1] > 0.0 {
            self.append(part, [inner[1], to], &around[1]);
        }
    }

    /// Appends the range between two arc lengths on a part, halved where that is worth it.
    fn append(&mut self, part: usize, ends: [f64; 2], around: &Around) {
        let path = self.path;
        match path.direction(part) {
            Some(direction) => {
                let line = Shape::of(&direction, &[0.0; M], &[0.0; M]);
                self.push(ends, (line, around.speed.min(path.at(part, ends[0]).speed_cap)), around.share);
            }
            None => {
                let (shape, cap) = shape(self.problem, path, part, ends);
                self.halve(part, ends, (shape, around.speed.min(cap)), around, 0);
            }
        }
    }

    fn push(&mut self, [from, to]: [f64; 2], (shape, cap): (Shape<M>, f64), share: f64) {
        if to > from {
            self.cuts.push(Cut { shape, cap, length: to - from, share, junction: f64::INFINITY });
        }
    }

    /// Appends a range, or its halves if one of these may be much faster.
    fn halve(
        &mut self,
        part: usize,
        [from, to]: [f64; 2],
        whole: (Shape<M>, f64),
        around: &Around,
        depth: u32,
    ) {
        if to - from < 2.0 * shortest_part(self.path.total()) {
            return self.push([from, to], whole, around.share);
        }
        let middle = 0.5 * (from + to);
        let halves = [[from, middle], [middle, to]].map(|ends| {
            let (shape, cap) = shape(self.problem, self.path, part, ends);
            (ends, (shape, around.speed.min(cap)))
        });
        let by_places = depth < DEPTH && self.is_worth(part, [from, to], around);
        if by_places || depth < MOST_DEPTH && self.is_well_worth(&whole, &halves, around.share) {
            for (ends, half) in halves {
                self.halve(part, ends, half, around, depth + 1);
            }
        } else {
            self.push([from, to], whole, around.share);
        }
    }

    /// Whether the bounds allow a far greater speed on one half than on the whole range, and the axes can reach such a speed
    /// there.
    fn is_well_worth(
        &self,
        whole: &(Shape<M>, f64),
        halves: &[([f64; 2], (Shape<M>, f64)); 2],
        share: f64,
    ) -> bool {
        let axes = self.axes.with_jerk_less(share);
        let most = |(shape, cap): &(Shape<M>, f64)| greatest(shape, &axes, *cap);
        let [([from, middle], left), (_, right)] = halves;
        let slow = most(whole);
        let reached = slow.limits.highest(slow.speed, middle - from);
        most(left).speed.max(most(right).speed).min(reached) > (1.0 + WELL_WORTH) * slow.speed
    }

    /// Whether samples allow a greater speed on one half than on the whole range, and the axes can reach such a speed there.
    fn is_worth(&self, part: usize, [from, to]: [f64; 2], around: &Around) -> bool {
        let axes = self.axes.with_jerk_less(around.share);
        let looked: [Allowable; LOOKED] = std::array::from_fn(|i| {
            let point = self.path.at(part, from + (to - from) * i as f64 / (LOOKED - 1) as f64);
            let shape = Shape::of(&point.first, &point.second, &point.third);
            greatest(&shape, &axes, around.speed.min(point.speed_cap))
        });
        let least = |points: &[Allowable], of: fn(&Allowable) -> f64| {
            points.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let [left, right] =
            [&looked[..=LOOKED / 2], &looked[LOOKED / 2..]].map(|half| least(half, |at| at.speed));
        let limits = s_curve::Limits {
            acceleration: least(&looked, |at| at.limits.acceleration),
            jerk: least(&looked, |at| at.limits.jerk),
        };
        let slow = left.min(right);
        left.max(right).min(limits.highest(slow, 0.5 * (to - from))) > (1.0 + WORTH) * slow
    }

    /// The segments of a cutting; None if one has no speed, or only one at which the axes creep.
    fn joined(&self, cutting: &Cutting, watch: Watch) -> Option<Vec<Segment>> {
        let make = |cut: &Cut<M>| -> Option<Segment> {
            let axes = self.axes.with_jerk_less(cut.share);
            let most = greatest(&cut.shape, &axes, cut.cap);
            let reference_length = cutting.lengths * most.speed * most.limits.duration(most.speed);
            let allowed = allowable(&cut.shape, &axes, cut.cap, reference_length).ok()?;
            let gained = allowed.limits.acceleration * self.problem.period;
            let crept = CREEP * gained.min(MOMENT * axes.fastest(&cut.shape));
            if allowed.speed < crept && allowed.speed < CREEP * cut.cap {
                return None;
            }
            // The cap is infinite where the feed counts only axes that stand still.
            let desired = cut.cap.min(allowed.speed);
            let Cut { length, junction, .. } = *cut;
            Some(Segment { length, allowable: allowed.speed, desired, limits: allowed.limits, junction })
        };
        // Each segment, the part that it covers, and the greatest speed of its parts alone.
        let mut out: Vec<(Segment, Cut<M>, f64)> = vec![];
        for (i, cut) in self.cuts.iter().enumerate() {
            watch.each(self.cuts.len()).count(i);
            let own = make(cut)?;
            // Join it with the segment before, if that costs no part much speed.
            let joins =
                |last: &Cut<M>| last.junction == f64::INFINITY && (last.share - cut.share).abs() <= LITTLE;
            let joined = out.last().filter(|last| joins(&last.1)).and_then(|(_, last, highest)| {
                let both = Cut {
                    shape: last.shape.with(&cut.shape),
                    cap: last.cap.min(cut.cap),
                    length: last.length + cut.length,
                    share: last.share.max(cut.share),
                    junction: cut.junction,
                };
                let segment = make(&both)?;
                let highest = highest.max(own.speed());
                (segment.speed() >= (1.0 - cutting.alike) * highest).then_some((segment, both, highest))
            });
            match (joined, out.last_mut()) {
                (Some(joined), Some(last)) => *last = joined,
                _ => out.push((own, *cut, own.speed())),
            }
        }
        Some(out.into_iter().map(|(segment, ..)| segment).collect())
    }
}

/// Bounds on the derivatives between two arc lengths of a part, and the speed cap by feed and chord error. They are proven if the
/// axes are those of the tool, else estimated from samples.
fn shape<const M: usize>(
    problem: &Problem<M>,
    path: &ArcLengthPath<M>,
    part: usize,
    [from, to]: [f64; 2],
) -> (Shape<M>, f64) {
    if problem.tip.is_none() {
        let i = path.parts[part].piece;
        let own = piece(problem, i);
        let (a, b) = (path.locate(part, from), path.locate(part, to));
        let mut pieces = CompositeCurve::default();
        // Relative to the nearer end of the piece: far from the origin a short part would lose the digits of its derivatives.
        let end = if a + b <= own.width { 0 } else { own.degree() };
        let local: Vec<[f64; M]> = own.control.iter().map(|point| sub(point, &own.control[end])).collect();
        split(&Piece { control: &local, ..own }, &[a, b], &mut pieces);
        let middle = pieces.piece(1);
        let shape = bounded(&Curve { joints: middle.control, tip: None, weight: middle.weights }, ACCURACY);
        return (shape, feed::on(problem, i, &middle).min(path.chord_speed(shape.curvature)));
    }
    let length = |i: usize| from + (to - from) * i as f64 / (SAMPLES - 1) as f64;
    let points: Vec<PathPoint<M>> = (0..SAMPLES).map(|i| path.at(part, length(i))).collect();
    let most = |of: &dyn Fn(&PathPoint<M>) -> f64| {
        let mut greatest: f64 = points.iter().map(of).fold(0.0, f64::max);
        // A peak between samples exceeds them by about an eighth of the second difference; the whole difference is added.
        for three in points.windows(3) {
            let bend = (of(&three[0]) - 2.0 * of(&three[1]) + of(&three[2])).abs();
            greatest = greatest.max(of(&three[1]) + bend);
        }
        greatest
    };
    let both = |of: fn(&PathPoint<M>) -> &[f64; M]| {
        [1.0, -1.0].map(|sign| std::array::from_fn(|k| most(&|point| sign * of(point)[k])))
    };
    let third = both(|point| &point.third);
    let shape = Shape {
        first: both(|point| &point.first),
        second: both(|point| &point.second),
        third: greater(&third),
        curvature: 0.0,
    };
    (shape, 1.0 / most(&|point| 1.0 / point.speed_cap))
}
