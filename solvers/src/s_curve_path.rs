//! The two-pass profiler on a path of the package: segments with limits along the path, and what they become.
//!
//! Neighbouring straight pieces of one direction are one segment. A curved piece is cut into parts of equal length,
//! and parts whose limits differ little are one segment again: the acceleration is 0 where segments meet, so that
//! each more costs time, and each less lets the tightest place of more of the path hold all of it.

use crate::bang_bang::Problem;
use crate::bang_bang_quadratic::Fault;
use crate::by_length::{piece, ByLength};
use crate::jerk_arcs::Arcs;
use crate::jerk_limited::{Effort, Geometry, Limits, Place};
use crate::jerk_limited_path::Task;
use crate::path_dynamics::{allowable, bounded, AxisLimits, Curve, Shape};
use crate::s_curve::{self, Section, Segment};
use crate::spline::bezier::split;
use crate::spline::CompositeCurve;
use crate::stretches::{checked, over_stretches, stretches};

/// Bounds of derivatives are greater than these by this part.
const ACCURACY: f64 = 0.05;
/// Places of a segment looked at where no bound is proven.
const PLACES: usize = 33;
/// A joint holds the speed where it is passed within this part of its cap.
const HELD: f64 = 0.998;

/// Lengths this near to one another, as parts of them, are the same.
const CLOSE: f64 = 1e-9;

/// How to cut a path into segments.
#[derive(Clone, Copy, Debug)]
pub struct Cutting {
    /// Parts of a curved piece.
    pub parts: usize,
    /// The length in mm over which a speed has to pay: short ones give more to acceleration.
    pub stretch: f64,
    /// Parts are joined where that lowers the speed on none of them by more than this part of it.
    pub alike: f64,
}

/// The profile of a path, planned with so many segments of look-ahead. Where a segment has no speed, next to a
/// cusp, and where the path begins or ends in motion, the jerk-limited planner plans the stretch with this effort.
pub fn plan<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    cutting: &Cutting,
    look_ahead: usize,
    effort: &Effort,
) -> Result<Arcs, Fault> {
    over_stretches(problem, jerk, |stretch, limits| {
        let path = ByLength::new(problem, &stretch.parts);
        let segments =
            if stretch.ends == [0.0; 2] { segments(problem, &path, limits, cutting) } else { None };
        match segments {
            Some(segments) => Ok(along(problem, &path, limits, &s_curve::plan(&segments, look_ahead)?)),
            None => Task { problem, limits: *limits, effort }.stretch(stretch),
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

/// Cuts all stretches into segments.
pub fn cut<const M: usize>(
    problem: &Problem<M>,
    jerk: &[f64; M],
    cutting: &Cutting,
) -> Result<Segmented, Fault> {
    let limits = checked(problem, jerk)?;
    let mut all = Segmented { stretches: vec![0], ..Segmented::default() };
    for stretch in stretches(problem) {
        let path = ByLength::new(problem, &stretch.parts);
        let own = if stretch.ends == [0.0; 2] { segments(problem, &path, &limits, cutting) } else { None };
        let mut s = 0.0;
        for segment in own.unwrap_or_default() {
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
    over_stretches(problem, jerk, |stretch, limits| {
        let own = offsets.get(stretch.number).zip(offsets.get(stretch.number + 1));
        match own.and_then(|(&from, &to)| sections.get(from..to)).filter(|own| !own.is_empty()) {
            Some(own) => Ok(along(problem, &ByLength::new(problem, &stretch.parts), limits, own)),
            None => Task { problem, limits: *limits, effort: &Effort::default() }.stretch(stretch),
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
    arcs.push_sections(problem, path, sections);
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

/// A part of the path on its way to a segment.
struct Cut<const M: usize> {
    shape: Shape<M>,
    segment: Segment,
    /// The greatest speed by feed and chord error.
    cap: f64,
    /// The greatest speed that one of its parts has alone.
    highest: f64,
}

/// The segments of a stretch from rest to rest; None where one has no speed.
pub fn segments<const M: usize>(
    problem: &Problem<M>,
    path: &ByLength<M>,
    limits: &Limits<M>,
    cutting: &Cutting,
) -> Option<Vec<Segment>> {
    let axes = AxisLimits { velocity: limits.velocity, acceleration: limits.acceleration, jerk: limits.jerk };
    let caps = path.caps(&limits.jerk);
    let mut out: Vec<Cut<M>> = vec![];
    let mut caps = caps.iter().map(|(cap, _)| cap).peekable();
    for part in 0..path.parts.len() {
        let (start, end) = (path.knots()[part], path.knots()[part + 1]);
        let straight = path.direction(part);
        let count = if straight.is_some() { 1 } else { cutting.parts };
        let place = |i: usize| if i == count { end } else { start + (end - start) * i as f64 / count as f64 };
        for i in 0..count {
            let (from, to) = (place(i), place(i + 1));
            let (shape, cap) = match straight {
                Some(direction) => {
                    let first = direction.map(f64::abs);
                    let shape = Shape { first, second: [0.0; M], third: [0.0; M], curvature: 0.0 };
                    (shape, path.at(part, from).speed_cap)
                }
                None => shape(problem, path, part, [from, to]),
            };
            let make = |shape: &Shape<M>, cap: f64, length: f64| -> Option<Segment> {
                let allowed = allowable(shape, &axes, cap, cutting.stretch).ok()?;
                Some(Segment {
                    length,
                    allowable: allowed.speed,
                    // The cap has no end where the feed is about axes that stand still.
                    desired: cap.min(allowed.speed),
                    limits: allowed.limits,
                    junction: f64::INFINITY,
                })
            };
            let segment = make(&shape, cap, to - from)?;
            let cut = Cut { shape, segment, cap, highest: segment.speed() };
            // One with the segment before, where that costs no part of it much.
            let joined = out.last().filter(|last| last.segment.junction == f64::INFINITY).and_then(|last| {
                let shape = last.shape.with(&cut.shape);
                let cap = last.cap.min(cut.cap);
                let segment = make(&shape, cap, last.segment.length + cut.segment.length)?;
                let highest = last.highest.max(cut.highest);
                (segment.speed() >= (1.0 - cutting.alike) * highest).then_some(Cut {
                    shape,
                    segment,
                    cap,
                    highest,
                })
            });
            match (joined, out.last_mut()) {
                (Some(joined), Some(last)) => *last = joined,
                _ => out.push(cut),
            }
        }
        if let (Some(cap), Some(last)) = (caps.next_if(|cap| cap.s <= end), out.last_mut()) {
            last.segment.junction = cap.speed;
        }
    }
    Some(out.into_iter().map(|cut| cut.segment).collect())
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
        return (shape, problem.feed[i].min(path.chord_speed(shape.curvature)));
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
