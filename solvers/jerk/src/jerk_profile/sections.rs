//! Appends sections of constant jerk to a profile as phases: of the S-curve, of lines, and of ramps at a place where the path
//! turns back.

use super::{JerkProfile, Movement, State};
use crate::arc_length_path::ArcLengthPath;
use crate::path_problem::Geometry;
use crate::s_curve::{Section, SegmentEnd};
use feedplan_geometry::bisection::boundary;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phases;

/// A section of constant jerk; after `cut` it lies on one part.
struct Span {
    part: usize,
    ends: [State; 2],
    jerk: f64,
    duration: f64,
}

impl Span {
    /// The length in mm that follows from its speed, acceleration, jerk and duration.
    fn length(&self) -> f64 {
        State { s: 0.0, ..self.ends[0] }.after(self.duration, self.jerk).s
    }

    fn cut<const M: usize>(self, path: &ArcLengthPath<M>, out: &mut Vec<Self>) {
        let Self { ends: [from, to], jerk, duration, .. } = self;
        let mut part = path.part(from.s);
        let (mut start, mut left) = (from, duration);
        while part + 1 < path.parts.len() && path.knots()[part + 1] < to.s {
            let knot = path.knots()[part + 1];
            let [_, time] = boundary(0.0, left, |time| start.after(time, jerk).s < knot);
            let end = State { s: knot, ..start.after(time, jerk) };
            out.push(Self { part, ends: [start, end], jerk, duration: time });
            (start, left) = (end, left - time);
            part += 1;
        }
        out.push(Self { part, ends: [start, to], jerk, duration: left });
    }
}

impl JerkProfile {
    /// Appends a section of constant jerk between two states; `duration` in s.
    pub fn push_jerk<const M: usize>(
        &mut self,
        path: &ArcLengthPath<M>,
        ends: [State; 2],
        jerk: f64,
        duration: f64,
    ) {
        let mut spans = vec![];
        Span { part: 0, ends, jerk, duration }.cut(path, &mut spans);
        self.push_spans(path, &spans);
    }

    /// Appends sections of constant jerk along a whole subrun, up to the state `end`.
    pub fn push_sections<const M: usize>(
        &mut self,
        path: &ArcLengthPath<M>,
        sections: &[Section],
        end: SegmentEnd,
    ) {
        let mut spans = vec![];
        for (i, section) in sections.iter().enumerate() {
            path.problem.watch.check_at(i);
            let from = State { s: section.position, v: section.speed, a: section.acceleration };
            let to = match sections.get(i + 1) {
                Some(next) => State { s: next.position, v: next.speed, a: next.acceleration },
                None => State { s: path.total(), v: end.speed, a: -end.acceleration },
            };
            let Section { jerk, duration, .. } = *section;
            Span { part: 0, ends: [from, to], jerk, duration }.cut(path, &mut spans);
        }
        self.push_spans(path, &spans);
    }

    /// Lowers the acceleration at the rest where the path turns back from that of the ramp there to `acceleration`, in mm/s².
    ///
    /// With the change d, the acceleration is linear over each third of the ramp's time: at the rest it is lower than that of the
    /// ramp by d, after one third higher by 5/6 d, after two thirds lower by 1/3 d, and at the end that of the ramp. Time, length
    /// and end speed stay the same. The jerk is at most 5.5 d divided by the time.
    pub fn turn_with<const M: usize>(&mut self, path: &ArcLengthPath<M>, end: usize, acceleration: f64) {
        let change = self.end_acceleration(end) - acceleration;
        let own = &mut self.phases;
        let at = if end == 0 { 0 } else { own.len() - 1 };
        let time = own.duration[at];
        let mut from = State { s: 0.0, v: 0.0, a: acceleration };
        let mut spans = vec![];
        for jerk in [5.5, -3.5, 1.0].map(|part| part * change / time) {
            let duration = time / 3.0;
            let to = from.after(duration, jerk);
            let part = if end == 0 { 0 } else { path.parts.len() - 1 };
            let back = |state: State| State { s: path.total() - state.s, v: state.v, a: -state.a };
            let ends = if end == 0 { [from, to] } else { [back(to), back(from)] };
            spans.push(Span { part, ends, jerk, duration });
            from = to;
        }
        if end == 1 {
            spans.reverse();
        }
        let mut ramp = Self::default();
        ramp.push_spans(path, &spans);
        let mut ramp = ramp.phases;
        let last = ramp.len() - 1;
        (ramp.u0[0], ramp.p0[0], ramp.u1[last], ramp.p1[last]) =
            (own.u0[at], own.p0[at], own.u1[at], own.p1[at]);
        own.remove(at);
        let rest = std::mem::take(own);
        *own = Phases::joined(if end == 0 { vec![ramp, rest] } else { vec![rest, ramp] });
    }

    /// Appends sections that are cut at the knots. Arc lengths far along a path have too great rounding errors for sections of
    /// some nanometres. The sections of a part are therefore placed one after another by their own lengths, from both ends of the
    /// part, and the longest section absorbs the rounding. The duration of each is corrected for the length between its
    /// parameters.
    fn push_spans<const M: usize>(&mut self, path: &ArcLengthPath<M>, spans: &[Span]) {
        for spans in spans.chunk_by(|a, b| a.part == b.part) {
            path.problem.watch.check_at(spans[0].part);
            let (part, last) = (spans[0].part, spans.len());
            let longest =
                (0..last).fold(0, |most, i| if spans[i].length() > spans[most].length() { i } else { most });
            let mut u = vec![path.locate(part, spans[0].ends[0].s); last + 1];
            u[last] = path.locate(part, spans[last - 1].ends[1].s);
            for i in 0..longest {
                u[i + 1] = path.parameter_beside(part, u[i], spans[i].length(), spans[i].ends[1].s);
            }
            for i in (longest + 1..last).rev() {
                u[i] = path.parameter_beside(part, u[i + 1], -spans[i].length(), spans[i].ends[0].s);
            }
            for (i, span) in spans.iter().enumerate() {
                let (u, length) = ([u[i], u[i + 1]], span.length());
                let moved = path.length_between(part, u[0], u[1]) - length;
                // The difference in length is passed at the speed of the faster end: next to rest a small length takes much time.
                // Where the path turns back, the duration stays, because the speed follows from the acceleration and the time.
                let fastest = span.ends[0].v.max(span.ends[1].v);
                let keeps = fastest == 0.0 || span.ends.iter().any(State::turns);
                let duration = span.duration + if keeps { 0.0 } else { moved / fastest };
                let movement =
                    Movement { law: PhaseLaw::PathJerk, value: span.jerk, ends: span.ends, duration };
                self.push(path, part, u, &movement);
            }
        }
    }
}
