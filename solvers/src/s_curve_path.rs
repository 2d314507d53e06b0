//! The two-pass profiler on a path of the package: segments with limits along the path, and what they become.
//!
//! Neighbouring straight pieces of one direction are one segment. A curved piece is halved where the limits of its halves
//! differ and the axes can make use of that, and parts whose limits differ little are one segment again: the
//! acceleration is 0 where segments meet, so that each more costs time, and each less lets the tightest place of more of
//! the path hold all of it. What is little, and how much of the limits turning may take, is tried in some ways, of which
//! each stretch takes the quickest.

use crate::bang_bang::Problem;
use crate::bang_bang_quadratic::Fault;
use crate::by_length::{piece, ByLength};
use crate::feed;
use crate::jerk_arcs::Arcs;
use crate::jerk_limited::{Effort, Geometry, Limits, Place};
use crate::jerk_limited_path::Task;
use crate::path_dynamics::{allowable, bounded, greatest, Allowable, AxisLimits, Curve, Shape};
use crate::s_curve::{self, Section, Segment};
use crate::spline::bezier::split;
use crate::spline::CompositeCurve;
use crate::stretches::{checked, over_stretches, stretches, Stretch, CREEP};
use crate::watch::Watch;

/// Bounds of derivatives are greater than these by this part.
const ACCURACY: f64 = 0.05;
/// Places of a segment looked at where no bound is proven.
const PLACES: usize = 33;
/// A joint holds the speed where it is passed within this part of its cap.
const HELD: f64 = 0.998;

/// Lengths this near to one another, as parts of them, are the same.
const CLOSE: f64 = 1e-9;

/// Halves of a part are parts of their own where one may be passed faster than both together by more than this part of
/// the speed, at some places of them; and halvings of a piece. More of them where the bounds of one half allow so much
/// more speed than those of both, which is next to a tight turn.
const WORTH: f64 = 0.05;
const LOOKED: usize = 9;
const DEPTH: u32 = 5;
const WELL_WORTH: f64 = 1.0;
const MOST_DEPTH: u32 = 40;

/// A way to join parts to segments.
#[derive(Clone, Copy, Debug)]
pub struct Cutting {
    /// The length over which a speed has to pay, in lengths from rest to rest that just reach the greatest speed; from 1
    /// on a line takes all of it. Short ones give more to acceleration.
    pub lengths: f64,
    /// Parts are joined where that lowers the speed on none of them by more than this part of it.
    pub alike: f64,
}

/// The profile of a path, each stretch by the quickest of some cuttings, planned with so many segments of look-ahead.
/// Where a segment has no speed or hardly one, next to a cusp, and where the path begins or ends in motion, the
/// jerk-limited planner plans the stretch with this effort.
pub fn plan<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    cuttings: &[Cutting],
    look_ahead: usize,
    effort: &Effort,
) -> Result<Arcs, Fault> {
    over_stretches(problem, jerk, |stretch, limits, watch| {
        let path = ByLength::new(problem, &stretch.parts);
        match quickest(problem, &path, stretch, limits, (cuttings, look_ahead), watch)? {
            Some(own) => Ok(along(problem, &path, limits, &own.sections)),
            None => Task { problem, limits: *limits, effort: &Effort { watch, ..*effort } }.stretch(stretch),
        }
    })
}

/// The segments of all stretches.
#[derive(Clone, Debug, Default)]
pub struct Segmented {
    /// Offsets of the stretches in the segments; a stretch that has none is not for profilers of segments.
    pub stretches: Vec<i64>,
    pub segments: Vec<Segment>,
    /// The place where each begins.
    pub piece: Vec<u32>,
    pub u: Vec<f64>,
}

/// Cuts all stretches into the segments that `plan` plans on.
pub fn cut<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    cuttings: &[Cutting],
    look_ahead: usize,
) -> Result<Segmented, Fault> {
    let limits = checked(problem, jerk)?;
    let mut all = Segmented { stretches: vec![0], ..Segmented::default() };
    let each = problem.watch.each(problem.width.len());
    for stretch in stretches(problem) {
        let path = ByLength::new(problem, &stretch.parts);
        let watch = each.part(stretch.parts.len() as f64);
        let own = quickest(problem, &path, &stretch, &limits, (cuttings, look_ahead), watch)?;
        let mut s = 0.0;
        for segment in own.map(|own| own.segments).unwrap_or_default() {
            let part = path.part(s);
            all.piece.push(path.parts[part].piece as u32);
            all.u.push(path.locate(part, s));
            s += segment.length;
            all.segments.push(segment);
        }
        all.stretches.push(all.segments.len() as i64);
    }
    Ok(all)
}

/// The profile of given sections: stretch i takes those from `offsets[i]` to `offsets[i + 1]`; where there are none the
/// jerk-limited planner plans it.
pub fn follow<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    offsets: &[usize],
    sections: &[Section],
) -> Result<Arcs, Fault> {
    over_stretches(problem, jerk, |stretch, limits, watch| {
        let own = offsets.get(stretch.number).zip(offsets.get(stretch.number + 1));
        match own.and_then(|(&from, &to)| sections.get(from..to)).filter(|own| !own.is_empty()) {
            Some(own) => {
                watch.advance(1);
                Ok(along(problem, &ByLength::new(problem, &stretch.parts), limits, own))
            }
            None => {
                let effort = Effort { watch, ..Effort::default() };
                Task { problem, limits: *limits, effort: &effort }.stretch(stretch)
            }
        }
    })
}

/// The arcs of sections from rest to rest, with the joints that hold the speed.
fn along<const M: usize>(
    problem: &Problem<M>,
    path: &ByLength<M>,
    limits: &Limits<M>,
    sections: &[Section],
) -> Arcs {
    let mut arcs = Arcs::default();
    arcs.push_sections(problem, path, sections, 0.0);
    let mut next = 0;
    for (cap, jumps) in path.caps(&limits.jerk) {
        while next + 1 < sections.len() && sections[next + 1].position <= cap.s * (1.0 + CLOSE) {
            next += 1;
        }
        let section = &sections[next];
        if jumps && cap.s - section.position <= CLOSE * cap.s && section.speed >= HELD * cap.speed {
            arcs.kinks.push(path.parts[path.part(cap.s)].piece as u32);
        }
    }
    arcs
}

/// A stretch: what it was planned on, and its profile.
struct Planned {
    segments: Vec<Segment>,
    sections: Vec<Section>,
}

/// A stretch from rest to rest by the quickest of some cuttings; None where a segment has no speed, or hardly one.
fn quickest<const M: usize>(
    problem: &Problem<M>,
    path: &ByLength<M>,
    stretch: &Stretch,
    limits: &Limits<M>,
    (cuttings, look_ahead): (&[Cutting], usize),
    watch: Watch,
) -> Result<Option<Planned>, Fault> {
    if stretch.ends != [0.0; 2] {
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

/// A part of the path on its way to a segment.
struct Cut<const M: usize> {
    shape: Shape<M>,
    /// The greatest speed by feed and chord error.
    cap: f64,
    length: f64,
    /// The limit where it meets the next one.
    junction: f64,
}

/// A stretch from rest to rest in parts whose limits differ little.
struct Parts<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    path: &'a ByLength<'a, M>,
    axes: AxisLimits<M>,
    cuts: Vec<Cut<M>>,
}

impl<'a, const M: usize> Parts<'a, M> {
    fn new(problem: &'a Problem<'a, M>, path: &'a ByLength<'a, M>, limits: &Limits<M>, watch: Watch) -> Self {
        let Limits { velocity, acceleration, jerk } = *limits;
        let axes = AxisLimits { velocity, acceleration, jerk };
        let mut parts = Self { problem, path, axes, cuts: vec![] };
        let caps = path.caps(&limits.jerk);
        let mut caps = caps.iter().map(|(cap, _)| cap).peekable();
        for part in 0..path.parts.len() {
            watch.each(path.parts.len()).advance(1);
            let ends = [path.knots()[part], path.knots()[part + 1]];
            match path.direction(part) {
                Some(direction) => {
                    let (first, none) = (direction.map(f64::abs), [0.0; M]);
                    let line = Shape { first, second: none, third: none, curvature: 0.0 };
                    parts.push(ends, (line, path.at(part, ends[0]).speed_cap));
                }
                None => parts.halve(part, ends, shape(problem, path, part, ends), 0),
            }
            if let (Some(cap), Some(last)) = (caps.next_if(|cap| cap.s <= ends[1]), parts.cuts.last_mut()) {
                last.junction = last.junction.min(cap.speed);
            }
        }
        parts
    }

    fn push(&mut self, [from, to]: [f64; 2], (shape, cap): (Shape<M>, f64)) {
        if to > from {
            self.cuts.push(Cut { shape, cap, length: to - from, junction: f64::INFINITY });
        }
    }

    /// Appends a part, or its halves where that is worth it.
    fn halve(&mut self, part: usize, [from, to]: [f64; 2], whole: (Shape<M>, f64), depth: u32) {
        let middle = 0.5 * (from + to);
        let halves =
            [[from, middle], [middle, to]].map(|ends| (ends, shape(self.problem, self.path, part, ends)));
        let by_places = depth < DEPTH && self.is_worth(part, [from, to]);
        if by_places || depth < MOST_DEPTH && self.is_well_worth(&whole, &halves) {
            for (ends, half) in halves {
                self.halve(part, ends, half, depth + 1);
            }
        } else {
            self.push([from, to], whole);
        }
    }

    /// Whether, by the bounds of both, one half may be passed far faster than both together, as far as the axes reach.
    fn is_well_worth(&self, whole: &(Shape<M>, f64), halves: &[([f64; 2], (Shape<M>, f64)); 2]) -> bool {
        let most = |(shape, cap): &(Shape<M>, f64)| greatest(shape, &self.axes, *cap);
        let [([from, middle], left), (_, right)] = halves;
        let slow = most(whole);
        let reached = slow.limits.highest(slow.speed, middle - from);
        most(left).speed.max(most(right).speed).min(reached) > (1.0 + WELL_WORTH) * slow.speed
    }

    /// Whether, by some of their places, one half may be passed faster than both together, as far as the axes reach.
    fn is_worth(&self, part: usize, [from, to]: [f64; 2]) -> bool {
        let looked: [Allowable; LOOKED] = std::array::from_fn(|i| {
            let place = self.path.at(part, from + (to - from) * i as f64 / (LOOKED - 1) as f64);
            let [first, second, third] = [place.first, place.second, place.third].map(|q| q.map(f64::abs));
            greatest(&Shape { first, second, third, curvature: 0.0 }, &self.axes, place.speed_cap)
        });
        let least = |places: &[Allowable], of: fn(&Allowable) -> f64| {
            places.iter().map(of).fold(f64::INFINITY, f64::min)
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

    /// The segments; None where one has no speed, or one that the axes creep at.
    fn joined(&self, cutting: &Cutting, watch: Watch) -> Option<Vec<Segment>> {
        let make = |shape: &Shape<M>, cap: f64, length: f64, junction: f64| -> Option<Segment> {
            let most = greatest(shape, &self.axes, cap);
            let stretch = cutting.lengths * most.speed * most.limits.duration(most.speed);
            let allowed = allowable(shape, &self.axes, cap, stretch).ok()?;
            let crept = CREEP * allowed.limits.acceleration * self.problem.period;
            if allowed.speed < crept && allowed.speed < CREEP * cap {
                return None;
            }
            // The cap has no end where the feed is about axes that stand still.
            let desired = cap.min(allowed.speed);
            Some(Segment { length, allowable: allowed.speed, desired, limits: allowed.limits, junction })
        };
        // Each with its bounds, its cap, and the greatest speed that one of its parts has alone.
        let mut out: Vec<(Segment, Shape<M>, f64, f64)> = vec![];
        for (i, cut) in self.cuts.iter().enumerate() {
            watch.each(self.cuts.len()).count(i);
            let own = make(&cut.shape, cut.cap, cut.length, cut.junction)?;
            // One with the segment before, where that costs no part of it much.
            let joined = out.last().filter(|last| last.0.junction == f64::INFINITY).and_then(|last| {
                let (shape, cap) = (last.1.with(&cut.shape), last.2.min(cut.cap));
                let both = make(&shape, cap, last.0.length + cut.length, cut.junction)?;
                let highest = last.3.max(own.speed());
                (both.speed() >= (1.0 - cutting.alike) * highest).then_some((both, shape, cap, highest))
            });
            match (joined, out.last_mut()) {
                (Some(joined), Some(last)) => *last = joined,
                _ => out.push((own, cut.shape, cut.cap, own.speed())),
            }
        }
        Some(out.into_iter().map(|(segment, ..)| segment).collect())
    }
}

/// Bounds of the derivatives between two lengths of a part, and the greatest speed by feed and chord error: proven where
/// the axes are those of the tool.
fn shape<const M: usize>(
    problem: &Problem<M>,
    path: &ByLength<M>,
    part: usize,
    [from, to]: [f64; 2],
) -> (Shape<M>, f64) {
    if problem.tip.is_none() {
        let i = path.parts[part].piece;
        let own = piece(problem, i);
        let (a, b) = (path.locate(part, from), path.locate(part, to));
        let mut pieces = CompositeCurve::default();
        split(&own, &[a, b], &mut pieces);
        let middle = pieces.piece(1);
        let shape = bounded(&Curve { joints: middle.control, tip: None, weight: middle.weights }, ACCURACY);
        return (shape, feed::on(problem, i, &middle).min(path.chord_speed(shape.curvature)));
    }
    let length = |i: usize| from + (to - from) * i as f64 / (PLACES - 1) as f64;
    let places: Vec<Place<M>> = (0..PLACES).map(|i| path.at(part, length(i))).collect();
    let most = |of: &dyn Fn(&Place<M>) -> f64| {
        let mut greatest: f64 = places.iter().map(|place| of(place).abs()).fold(0.0, f64::max);
        // A peak between places is above them by no more than an eighth of the second difference there.
        for three in places.windows(3) {
            let bend = (of(&three[0]) - 2.0 * of(&three[1]) + of(&three[2])).abs();
            greatest = greatest.max(of(&three[1]).abs() + bend);
        }
        greatest
    };
    let shape = Shape {
        first: std::array::from_fn(|k| most(&|place| place.first[k])),
        second: std::array::from_fn(|k| most(&|place| place.second[k])),
        third: std::array::from_fn(|k| most(&|place| place.third[k])),
        curvature: 0.0,
    };
    (shape, 1.0 / most(&|place| 1.0 / place.speed_cap))
}
