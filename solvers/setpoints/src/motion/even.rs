//! Motion of the parameter at constant acceleration s: √p is linear in time, p linear in u.
//!
//! Everything is counted from the nearer end, so that nothing is lost where the motion begins or ends at rest.

use super::ProfileArc;

/// √p at both ends, and s.
#[derive(Clone, Copy)]
pub struct EvenLaw {
    roots: [f64; 2],
    pub s: f64,
}

impl EvenLaw {
    /// The arc with its own p and s.
    pub fn new(arc: &ProfileArc) -> Self {
        let roots = [arc.p0.sqrt(), arc.p1.sqrt()];
        if roots[0] + roots[1] > 0.0 {
            Self { roots, s: arc.value }
        } else {
            Self::pace(arc)
        }
    }

    /// The mean pace that the arc's duration tells, all along it.
    pub fn pace(arc: &ProfileArc) -> Self {
        Self { roots: [(arc.u1 - arc.u0) / arc.duration; 2], s: 0.0 }
    }

    /// u when these parts of the duration are done and left.
    pub fn place(&self, arc: &ProfileArc, done: f64, left: f64) -> f64 {
        let [from, to] = self.roots;
        let root = from * left + to * done;
        let width = arc.u1 - arc.u0;
        if done <= 0.5 {
            arc.u0 + width * (done * ((from + root) / (from + to)))
        } else {
            arc.u1 - width * (left * ((to + root) / (from + to)))
        }
    }

    /// √p at u.
    pub fn root(&self, arc: &ProfileArc, u: f64) -> f64 {
        let [from, to] = self.roots;
        let change = (to - from) * (to + from) / (arc.u1 - arc.u0);
        let p =
            if from <= to { from * from + change * (u - arc.u0) } else { to * to - change * (arc.u1 - u) };
        p.max(0.0).sqrt()
    }

    /// The part of the duration that has passed at u.
    pub fn done(&self, arc: &ProfileArc, u: f64) -> f64 {
        let [from, to] = self.roots;
        let (root, width) = (self.root(arc, u), arc.u1 - arc.u0);
        let part = |way: f64, end: f64| {
            if way > 0.0 {
                way / width * ((from + to) / (end + root))
            } else {
                0.0
            }
        };
        let done = if from <= to { part(u - arc.u0, from) } else { 1.0 - part(arc.u1 - u, to) };
        done.clamp(0.0, 1.0)
    }
}
