//! One pass over one sub-piece, in the sense of travel: the greatest p that stays under a bound. Backward the bound is the
//! velocity cap and the limit curve, forward it is K.

use crate::bang_bang::tolerance::{CROSSES, ON_BOUND, ON_LIMIT_CURVE, SLACK};
use std::cell::OnceCell;

use super::bang::{bang, Event};
use super::limit_curve::limit_curve;
use super::phase::{Kind, Phase};
use super::quotient::Quotient;
use super::slide::slide;
use super::subpiece::{Axes, SubPiece};

/// More events than this on one sub-piece cannot be: at most M − 1 transitions lie between two slides, and a
/// slide ends at one of few roots.
const MAX_EVENTS: u32 = 300;

/// A pass made no headway at this place; never seen.
#[derive(Clone, Copy, Debug)]
pub struct Stuck(pub f64);

/// Backward over the reversed sub-piece from p: appends the phases of K and returns K at the far end.
#[inline(always)]
pub fn backward<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    mut p: f64,
    out: &mut Vec<Phase>,
) -> Result<f64, Stuck> {
    if p > sub.flat {
        p = p.min(axes.limit_at_turns(&sub.start, &sub.bend));
    }
    let cap =
        [Phase { x0: 0.0, x1: sub.length, p0: sub.cap_at(0.0), p1: sub.cap_at(sub.length), kind: Kind::Cap }];
    p = Pass::<M, true> { sub, axes, bounds: &cap, out, x: 0.0, p: p.min(cap[0].p0), line: OnceCell::new() }
        .run()?;
    // The phase that led here stays as it is: forward, p begins below it.
    if p > sub.flat {
        p = p.min(axes.limit_at_turns(&sub.end, &sub.bend));
    }
    Ok(p)
}

/// Forward over the sub-piece from p, under the phases of K as the backward pass left them: appends the phases of
/// the profile and returns p at the far end.
#[inline(always)]
pub fn forward<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    p: f64,
    bounds: &[Phase],
    out: &mut Vec<Phase>,
) -> Result<f64, Stuck> {
    Pass::<M, false> { sub, axes, bounds, out, x: 0.0, p, line: OnceCell::new() }.run()
}

struct Pass<'a, const M: usize, const BACKWARD: bool> {
    sub: &'a SubPiece<'a, M>,
    axes: &'a Axes<M>,
    /// What p stays under. Forward: K, from the far end to the near one and reversed.
    bounds: &'a [Phase],
    out: &'a mut Vec<Phase>,
    x: f64,
    p: f64,
    /// The limit curve at both ends of the sub-piece, once it is needed.
    line: OnceCell<Option<[f64; 2]>>,
}

impl<const M: usize, const BACKWARD: bool> Pass<'_, M, BACKWARD> {
    #[inline(always)]
    fn run(mut self) -> Result<f64, Stuck> {
        let length = self.sub.length;
        let mut index = 0;
        let mut bound = self.bound(index);
        let mut on_limit_curve = BACKWARD && self.meets_falling_limit_curve();
        // The axis that has just saturated, and the roots at x that the phase and the bound are known to share.
        let mut control = None;
        let mut leaving = None;
        let mut slack = 0;
        // The same for the limit curve and the cap.
        let mut line_contact = 0;
        for _ in 0..MAX_EVENTS {
            if self.x == length {
                return Ok(self.p);
            }
            while bound.x1 <= self.x {
                index += 1;
                bound = self.bound(index);
            }
            if on_limit_curve {
                let moved = self.follow_limit_curve(&bound, line_contact);
                line_contact = if moved { 1 } else { line_contact + 1 };
                on_limit_curve = false;
                continue;
            }
            let at_bound = bound.at(self.sub, self.axes, self.x);
            let on_bound = self.p >= at_bound * (1.0 - ON_BOUND);
            if on_bound {
                self.p = at_bound;
            }
            let mut contact = 0;
            if on_bound && leaving.is_none() {
                match bound.kind {
                    // Any other motion under a phase of K meets it again later.
                    Kind::Accelerating(_) | Kind::Braking(_) | Kind::Flat(_) => {
                        self.push(bound.x1, bound.p1, bound.kind);
                        control = None;
                        continue;
                    }
                    Kind::LimitCurve => contact = 1,
                    Kind::Cap => {
                        let (end, saturated, meets_limit_curve) =
                            self.slide(&bound, SLACK[slack], line_contact);
                        let moved = end > self.x;
                        on_limit_curve = meets_limit_curve;
                        if meets_limit_curve {
                            line_contact = if moved { 1 } else { line_contact + 1 };
                        }
                        if moved {
                            self.push(end, bound.at(self.sub, self.axes, end), Kind::Cap);
                            (control, leaving) = (saturated, saturated.map(|_| 2));
                        }
                        if moved || meets_limit_curve {
                            continue;
                        }
                        contact = 1;
                    }
                }
            }
            let contact = leaving.take().unwrap_or(contact);
            let phase = bang(self.sub, self.axes, self.x, self.p, control.take(), BACKWARD);
            if phase.x1 > self.x {
                let whole = Phase { x0: self.x, x1: phase.x1, p0: self.p, p1: phase.p1, kind: phase.kind };
                match self.crossing(&whole, index, contact) {
                    None => {
                        self.push(phase.x1, phase.p1, phase.kind);
                        (slack, line_contact) = (0, 0);
                    }
                    Some((x, p)) if x > self.x => {
                        self.push(x, p, phase.kind);
                        (slack, line_contact) = (0, 0);
                        continue;
                    }
                    // Not above the bound by more than rounding: follow the bound a little further.
                    Some(_) if on_bound => {
                        slack += 1;
                        if slack == SLACK.len() {
                            return Err(Stuck(self.x));
                        }
                        continue;
                    }
                    Some((_, p)) => {
                        self.p = p;
                        continue;
                    }
                }
            }
            match phase.event {
                Event::EndOfPhase => {}
                Event::Transition(axis) => control = Some(axis),
                Event::LimitCurve => on_limit_curve = BACKWARD && self.x < length,
            }
        }
        Err(Stuck(self.x))
    }

    /// The bound number `index` along the sub-piece; the last one beyond its end.
    #[inline(always)]
    fn bound(&self, index: usize) -> Phase {
        if BACKWARD {
            self.bounds[0]
        } else {
            self.bounds[self.bounds.len() - 1 - index.min(self.bounds.len() - 1)].reversed(self.sub.length)
        }
    }

    #[inline(always)]
    fn push(&mut self, x1: f64, p1: f64, kind: Kind) {
        self.out.push(Phase { x0: self.x, x1, p0: self.p, p1, kind });
        (self.x, self.p) = (x1, p1);
    }

    /// The end of the slide along the cap, the axis that ends it, and whether the limit curve ends it instead.
    #[inline(always)]
    fn slide(&self, bound: &Phase, slack: f64, contact: usize) -> (f64, Option<usize>, bool) {
        let found = slide(self.sub, self.axes, self.x, bound.x1, slack);
        if BACKWARD && found.low && found.end > self.x {
            if let Some(line) = self.limit_curve() {
                let cap = self.sub.cap_quotient(self.x, found.end);
                let line = self.line_curve(line, self.x, found.end);
                if let Some(t) = cap.rises_above(&line, contact) {
                    return (self.x + (found.end - self.x) * t, None, true);
                }
            }
        }
        (found.end, found.saturated, false)
    }

    /// Where `phase` rises above the bounds from number `index` on, and the bound there.
    #[inline(always)]
    fn crossing(&self, phase: &Phase, mut index: usize, mut contact: usize) -> Option<(f64, f64)> {
        let (sub, axes) = (self.sub, self.axes);
        let (mut a, mut at_a) = (phase.x0, phase.p0);
        loop {
            let bound = self.bound(index);
            let b = bound.x1.min(phase.x1);
            let (at_b, bound_b) = (phase.at(sub, axes, b), bound.at(sub, axes, b));
            let bound_a = bound.at(sub, axes, a);
            // p is monotone on a phase.
            let lowest = match bound.kind {
                Kind::Cap => sub.lowest_cap(bound_a, bound_b),
                _ => bound_a.min(bound_b),
            };
            if at_a.max(at_b) > lowest {
                let curve = phase.quotient(sub, axes, (a, at_a), (b, at_b));
                let limit = bound.quotient(sub, axes, (a, bound_a), (b, bound_b));
                if let Some(t) = curve.rises_above(&limit, contact) {
                    let x = a + (b - a) * t;
                    let limit = bound.at(sub, axes, x);
                    if (phase.at(sub, axes, x) - limit).abs() <= CROSSES * limit {
                        return Some((x, limit));
                    }
                    if let Some(found) = self.search(phase, &bound, a, b) {
                        return Some(found);
                    }
                }
            }
            if b == phase.x1 {
                return None;
            }
            (a, at_a) = (b, at_b);
            contact = 0;
            index += 1;
        }
    }

    /// The same where the root has lost its digits, because an axis that hardly moves at a makes the curves too
    /// uneven for one polynomial: by doubling steps from a, then by halving.
    #[cold]
    fn search(&self, phase: &Phase, bound: &Phase, a: f64, b: f64) -> Option<(f64, f64)> {
        let above = |x: f64| phase.at(self.sub, self.axes, x) > bound.at(self.sub, self.axes, x);
        let (mut below, mut step) = (a, (b - a) * f64::EPSILON);
        let mut beyond = (a + step).min(b);
        while !above(beyond) {
            if beyond == b {
                return None;
            }
            below = beyond;
            step += step;
            beyond = (a + step).min(b);
        }
        loop {
            let middle = 0.5 * (below + beyond);
            if middle <= below || middle >= beyond {
                return Some((below, bound.at(self.sub, self.axes, below)));
            }
            if above(middle) {
                beyond = middle;
            } else {
                below = middle;
            }
        }
    }

    /// Puts p on or under the limit curve at the start; says whether it has to be followed.
    #[inline(always)]
    fn meets_falling_limit_curve(&mut self) -> bool {
        if self.p <= self.sub.flat * (1.0 - ON_LIMIT_CURVE) {
            return false;
        }
        match self.limit_curve() {
            Some([start, end]) if self.p >= start * (1.0 - ON_LIMIT_CURVE) => {
                self.p = self.p.min(start);
                if end < start * (1.0 - ON_LIMIT_CURVE) {
                    return true;
                }
                self.p = self.p.min(end);
                false
            }
            _ => false,
        }
    }

    /// Follows the limit curve to the end of the sub-piece or to where the cap is lower; says whether it moved.
    #[cold]
    fn follow_limit_curve(&mut self, cap: &Phase, contact: usize) -> bool {
        let Some(line) = self.limit_curve() else { return false };
        let length = self.sub.length;
        let curve = self.line_curve(line, self.x, length);
        let crossing = curve.rises_above(&self.sub.cap_quotient(self.x, length), contact);
        let Some(t) = crossing else {
            self.push(length, line[1], Kind::LimitCurve);
            return true;
        };
        let x = self.x + (length - self.x) * t;
        let p = cap.at(self.sub, self.axes, x);
        let moved = x > self.x;
        if moved {
            self.push(x, p, Kind::LimitCurve);
        } else {
            self.p = p;
        }
        moved
    }

    #[inline(always)]
    fn limit_curve(&self) -> Option<[f64; 2]> {
        let sub = self.sub;
        *self.line.get_or_init(|| {
            limit_curve(&sub.start, &sub.end, &sub.bend, &self.axes.acceleration, |j| sub.twists(j))
        })
    }

    fn line_curve(&self, line: [f64; 2], a: f64, b: f64) -> Quotient {
        let at = |x: f64| {
            if x == self.sub.length {
                line[1]
            } else {
                line[0] + (line[1] - line[0]) * (x / self.sub.length)
            }
        };
        Quotient::line(at(a), at(b))
    }
}
