//! One pass over one sub-piece: the greatest p(x) under a ceiling, from p at the start. Backward the ceiling is the
//! cap, and the limit curve is followed where it falls; forward the ceiling is K.

use crate::bang_bang::tolerance::{CROSSES, ON_CEILING, ON_LIMIT_CURVE, SLACK};
use std::cell::OnceCell;

use super::bang::{bang, Switch};
use super::limit_curve::limit_curve;
use super::phase::{Law, Phase};
use super::quotient::Quotient;
use super::slide::slide;
use super::subpiece::{Axes, SubPiece};
use feedplan_geometry::bisection::boundary;

/// Greatest number of switches, more than any sub-piece has: at most M − 1 transitions lie between two slides, and a slide ends
/// at one of few roots.
const MAX_SWITCHES: u32 = 300;

/// The pass makes no headway at this x; this has not been observed.
#[derive(Clone, Copy, Debug)]
pub struct Stuck(pub f64);

/// Backward pass over the reversed sub-piece, from p at its start: appends the phases of K and returns K at its end.
#[inline(always)]
pub fn backward<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    mut p: f64,
    out: &mut Vec<Phase>,
) -> Result<f64, Stuck> {
    if p > sub.flat {
        p = p.min(axes.limit_at_turns(&sub.start, &sub.c));
    }
    let cap =
        [Phase { x0: 0.0, x1: sub.length, p0: sub.cap_at(0.0), p1: sub.cap_at(sub.length), law: Law::Cap }];
    p = Pass::<M, true> {
        sub,
        axes,
        ceilings: &cap,
        out,
        x: 0.0,
        p: p.min(cap[0].p0),
        line: OnceCell::new(),
    }
    .travel()?;
    // Only the returned p is lowered, not the end of the last phase: the forward pass begins below it.
    if p > sub.flat {
        p = p.min(axes.limit_at_turns(&sub.end, &sub.c));
    }
    Ok(p)
}

/// Forward pass over the sub-piece under the phases of K, from p at its start: appends the phases of the profile and returns p at
/// its end.
#[inline(always)]
pub fn forward<const M: usize>(
    sub: &SubPiece<M>,
    axes: &Axes<M>,
    p: f64,
    ceilings: &[Phase],
    out: &mut Vec<Phase>,
) -> Result<f64, Stuck> {
    Pass::<M, false> { sub, axes, ceilings, out, x: 0.0, p, line: OnceCell::new() }.travel()
}

struct Pass<'a, const M: usize, const BACKWARD: bool> {
    sub: &'a SubPiece<'a, M>,
    axes: &'a Axes<M>,
    /// The ceiling. Forward: the phases of K as the backward pass saw them, the last one first.
    ceilings: &'a [Phase],
    out: &'a mut Vec<Phase>,
    x: f64,
    p: f64,
    /// The limit curve at both ends of the sub-piece, computed when it is needed.
    line: OnceCell<Option<[f64; 2]>>,
}

impl<const M: usize, const BACKWARD: bool> Pass<'_, M, BACKWARD> {
    #[inline(always)]
    fn travel(mut self) -> Result<f64, Stuck> {
        let length = self.sub.length;
        let mut index = 0;
        let mut ceiling = self.ceiling(index);
        let mut on_limit_curve = BACKWARD && self.meets_falling_limit_curve();
        // `control`: the axis that has just reached its limit. `leaving`: the number of roots at x that the next phase and the
        // ceiling share, where the pass leaves a cap.
        let mut control = None;
        let mut leaving = None;
        let mut slack = 0;
        // The number of roots at x that the limit curve and the cap share.
        let mut line_contact = 0;
        for _ in 0..MAX_SWITCHES {
            if self.x == length {
                return Ok(self.p);
            }
            while ceiling.x1 <= self.x {
                index += 1;
                ceiling = self.ceiling(index);
            }
            if on_limit_curve {
                let moved = self.follow_limit_curve(&ceiling, line_contact);
                line_contact = if moved { 1 } else { line_contact + 1 };
                on_limit_curve = false;
                continue;
            }
            let at_ceiling = ceiling.at(self.sub, self.axes, self.x);
            let on_ceiling = self.p >= at_ceiling * (1.0 - ON_CEILING);
            if on_ceiling {
                self.p = at_ceiling;
            }
            let mut contact = 0;
            if on_ceiling && leaving.is_none() {
                match ceiling.law {
                    // Any other motion under a phase of K meets it again later.
                    Law::Accelerating(_) | Law::Braking(_) | Law::Flat(_) => {
                        self.push(ceiling.x1, ceiling.p1, ceiling.law);
                        control = None;
                        continue;
                    }
                    Law::LimitCurve => contact = 1,
                    Law::Cap => {
                        let (end, saturated, meets_limit_curve) =
                            self.slide(&ceiling, SLACK[slack], line_contact);
                        let moved = end > self.x;
                        on_limit_curve = meets_limit_curve;
                        if meets_limit_curve {
                            line_contact = if moved { 1 } else { line_contact + 1 };
                        }
                        if moved {
                            self.push(end, ceiling.at(self.sub, self.axes, end), Law::Cap);
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
                let whole = Phase { x0: self.x, x1: phase.x1, p0: self.p, p1: phase.p1, law: phase.law };
                match self.crossing(&whole, index, contact) {
                    None => {
                        self.push(phase.x1, phase.p1, phase.law);
                        (slack, line_contact) = (0, 0);
                    }
                    Some((x, p)) if x > self.x => {
                        self.push(x, p, phase.law);
                        (slack, line_contact) = (0, 0);
                        continue;
                    }
                    // The phase rises above the ceiling by no more than rounding: follow the ceiling a little further, with more
                    // slack.
                    Some(_) if on_ceiling => {
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
            match phase.switch {
                Switch::EndOfPhase => {}
                Switch::Transition(axis) => control = Some(axis),
                Switch::LimitCurve => on_limit_curve = BACKWARD && self.x < length,
            }
        }
        Err(Stuck(self.x))
    }

    /// Phase `index` of the ceiling along the sub-piece; the last one for greater indices.
    #[inline(always)]
    fn ceiling(&self, index: usize) -> Phase {
        if BACKWARD {
            self.ceilings[0]
        } else {
            self.ceilings[self.ceilings.len() - 1 - index.min(self.ceilings.len() - 1)]
                .reversed(self.sub.length)
        }
    }

    #[inline(always)]
    fn push(&mut self, x1: f64, p1: f64, law: Law) {
        self.out.push(Phase { x0: self.x, x1, p0: self.p, p1, law });
        (self.x, self.p) = (x1, p1);
    }

    /// The end of the slide along the cap, the axis that ends it, and whether the limit curve ends it.
    #[inline(always)]
    fn slide(&self, ceiling: &Phase, slack: f64, contact: usize) -> (f64, Option<usize>, bool) {
        let found = slide(self.sub, self.axes, self.x, ceiling.x1, slack);
        if BACKWARD && found.low && found.end > self.x {
            if let Some(line) = self.limit_curve() {
                let cap = self.sub.cap_quotient(self.x, found.end);
                let line = self.line_quotient(line, self.x, found.end);
                if let Some(t) = cap.rises_above(&line, contact) {
                    return (self.x + (found.end - self.x) * t, None, true);
                }
            }
        }
        (found.end, found.saturated, false)
    }

    /// The first x at which `phase` rises above the ceiling, and p of the ceiling there; None if it does not. `index` is the
    /// phase of the ceiling with which the search begins.
    #[inline(always)]
    fn crossing(&self, phase: &Phase, mut index: usize, mut contact: usize) -> Option<(f64, f64)> {
        let (sub, axes) = (self.sub, self.axes);
        let (mut a, mut at_a) = (phase.x0, phase.p0);
        loop {
            let ceiling = self.ceiling(index);
            let b = ceiling.x1.min(phase.x1);
            let (at_b, ceiling_b) = (phase.at(sub, axes, b), ceiling.at(sub, axes, b));
            let ceiling_a = ceiling.at(sub, axes, a);
            // p is monotone on a phase.
            let lowest = match ceiling.law {
                Law::Cap => sub.lowest_cap(ceiling_a, ceiling_b),
                _ => ceiling_a.min(ceiling_b),
            };
            if at_a.max(at_b) > lowest {
                let curve = phase.quotient(sub, axes, (a, at_a), (b, at_b));
                let limit = ceiling.quotient(sub, axes, (a, ceiling_a), (b, ceiling_b));
                if let Some(t) = curve.rises_above(&limit, contact) {
                    let x = a + (b - a) * t;
                    let limit = ceiling.at(sub, axes, x);
                    if (phase.at(sub, axes, x) - limit).abs() <= CROSSES * limit {
                        return Some((x, limit));
                    }
                    if let Some(found) = self.search(phase, &ceiling, a, b) {
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

    /// Finds the x and p of `crossing` where its root is inaccurate, because g_k near 0 at `a` makes the curves too uneven for
    /// one polynomial: doubles a step from `a` until the phase is above the ceiling, then bisects.
    #[cold]
    fn search(&self, phase: &Phase, ceiling: &Phase, a: f64, b: f64) -> Option<(f64, f64)> {
        let above = |x: f64| phase.at(self.sub, self.axes, x) > ceiling.at(self.sub, self.axes, x);
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
        let [x, _] = boundary(below, beyond, |x| !above(x));
        Some((x, ceiling.at(self.sub, self.axes, x)))
    }

    /// Lowers p to the limit curve at the start; returns whether the limit curve has to be followed.
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

    /// Follows the limit curve to the end of the sub-piece or to where the cap becomes lower; returns whether the pass has moved.
    #[cold]
    fn follow_limit_curve(&mut self, cap: &Phase, contact: usize) -> bool {
        let Some(line) = self.limit_curve() else { return false };
        let length = self.sub.length;
        let curve = self.line_quotient(line, self.x, length);
        let crossing = curve.rises_above(&self.sub.cap_quotient(self.x, length), contact);
        let Some(t) = crossing else {
            self.push(length, line[1], Law::LimitCurve);
            return true;
        };
        let x = self.x + (length - self.x) * t;
        let p = cap.at(self.sub, self.axes, x);
        let moved = x > self.x;
        if moved {
            self.push(x, p, Law::LimitCurve);
        } else {
            self.p = p;
        }
        moved
    }

    #[inline(always)]
    fn limit_curve(&self) -> Option<[f64; 2]> {
        let sub = self.sub;
        *self.line.get_or_init(|| {
            limit_curve(&sub.start, &sub.end, &sub.c, &self.axes.acceleration, |j| sub.wronskians(j))
        })
    }

    fn line_quotient(&self, line: [f64; 2], a: f64, b: f64) -> Quotient {
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
