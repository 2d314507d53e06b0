//! Audits a profile against all limits, only from the control points and the columns of the profile.

use feedplan_planner::phases::Phases;

use super::cases::Case;

/// The worst figures of a profile; for the limits these are value/limit − 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Audit {
    pub acceleration: f64,
    pub velocity: f64,
    pub feed: f64,
    pub chord: f64,
    /// The greatest distance from the nearest limit, |value/limit − 1|, over all samples: everywhere some limit should be
    /// reached.
    pub idle: f64,
    /// The greatest jump of v², relative to the greatest v² nearby.
    pub jump: f64,
    /// The greatest deviation of p at the end of a phase from the law of the phase, relative to p.
    pub ends: f64,
    /// The greatest deviation of a duration from that computed from the law of the phase, relative to the whole time.
    pub duration: f64,
}

impl Audit {
    /// The greatest excess of a limit.
    pub fn excess(&self) -> f64 {
        self.acceleration.max(self.velocity).max(self.feed).max(self.chord)
    }

    pub fn worst(&self, other: &Self) -> Self {
        Self {
            acceleration: self.acceleration.max(other.acceleration),
            velocity: self.velocity.max(other.velocity),
            feed: self.feed.max(other.feed),
            chord: self.chord.max(other.chord),
            idle: self.idle.max(other.idle),
            jump: self.jump.max(other.jump),
            ends: self.ends.max(other.ends),
            duration: self.duration.max(other.duration),
        }
    }
}

/// Checks the profile at `samples` points of each phase; panics if the phases do not cover the path in order.
pub fn audit<const M: usize>(case: &Case<M>, phases: &Phases, samples: usize) -> Audit {
    let mut worst = Audit::default();
    let mut last: Option<(usize, f64, f64)> = None;
    for row in 0..phases.len() {
        let i = phases.piece[row] as usize;
        let (u0, u1) = (phases.u0[row], phases.u1[row]);
        assert!(u0 < u1 && phases.duration[row] >= 0.0, "arc {row}: {u0} to {u1}");
        let arc = ArcLaw::new(case, phases, row);
        let ends = [arc.at(u0), arc.at(u1)];
        // The phases cover every piece from 0 to its width, and v² is continuous.
        let v_sq = [phases.p0[row], phases.p1[row]].map(|p| p.max(0.0));
        let v_sq = [v_sq[0] * ends[0].d, v_sq[1] * ends[1].d];
        match last {
            None => assert!(i == 0 && u0 == 0.0),
            Some((before, u, _)) if before == i => assert_eq!(u, u0, "arc {row}"),
            Some((before, u, _)) => {
                assert!(before + 1 == i && u == case.pieces[before].width && u0 == 0.0, "arc {row}");
            }
        }
        if let Some((_, _, before)) = last {
            if before.is_finite() && v_sq[0].is_finite() {
                let size = before.max(v_sq[0]).max(1e-9 * case.feed[i] * case.feed[i]);
                worst.jump = worst.jump.max((before - v_sq[0]).abs() / size);
            }
        }
        last = Some((i, u1, v_sq[1]));
        for (end, p) in ends.iter().zip([phases.p0[row], phases.p1[row]]) {
            if p.is_finite() && end.p.is_finite() {
                worst.ends = worst.ends.max((end.p - p).abs() / p.max(end.p).max(f64::MIN_POSITIVE));
            }
        }
        // The part of the figures that comes from the rounding of u: large on a short phase, near a cusp, and where the axis of
        // the phase hardly moves.
        let longest = arc.left.iter().chain(&arc.right).fold(0.0, |most: f64, g| most.max(g.abs()));
        let shortest = ends[0].d.min(ends[1].d).sqrt();
        let axis = match phases.kind[row] {
            0 | 3 => {
                let k = phases.axis[row] as usize;
                let least = ends[0].g[k].abs().min(ends[1].g[k].abs());
                if least > 0.0 {
                    arc.left[k].abs().max(arc.right[k].abs()) / least
                } else {
                    1.0
                }
            }
            _ => 1.0,
        };
        let grain = 1e-14 * (case.pieces[i].width / (u1 - u0)).max(longest / shortest).max(axis);
        for sample in 0..=samples {
            let u = if sample == samples { u1 } else { u0 + (u1 - u0) * (sample as f64 / samples as f64) };
            let here = arc.at(u);
            if !(here.p.is_finite() && here.d > 0.0) {
                continue;
            }
            let mut nearest = f64::INFINITY;
            let mut meet = |worst: &mut f64, ratio: f64| {
                *worst = worst.max(ratio - 1.0 - grain);
                nearest = nearest.min((ratio - 1.0).abs());
            };
            for k in 0..M {
                meet(&mut worst.acceleration, here.acceleration[k].abs() / case.acceleration[k]);
                meet(&mut worst.velocity, here.g[k].abs() * here.p.sqrt() / case.velocity[k]);
            }
            let v_sq = here.p * here.d;
            meet(&mut worst.feed, v_sq.sqrt() / case.feed[i]);
            if case.chord_tolerance.is_finite() {
                let delta = case.chord_tolerance;
                let radius = here.d * here.d.sqrt() / arc.twist;
                let speed = 2.0 / case.period;
                let limit = if radius > delta { 2.0 * radius * delta - delta * delta } else { delta * delta };
                let ratio = v_sq / (speed * speed * limit);
                worst.chord = worst.chord.max(ratio - 1.0 - grain);
                // The planner keeps v² below a straight line, which is below the limit by up to this fraction.
                if ratio > 1.0 - 2e-3 {
                    nearest = 0.0;
                }
            }
            worst.idle = worst.idle.max(nearest - grain);
        }
        worst.duration = worst.duration.max((arc.duration() - phases.duration[row]).abs());
    }
    let (i, u, _) = last.expect("arcs");
    assert!(i + 1 == case.pieces.len() && u == case.pieces[i].width, "the profile stops early");
    worst.duration /= phases.time();
    worst
}

/// A point of a phase.
struct Place<const M: usize> {
    g: [f64; M],
    d: f64,
    p: f64,
    acceleration: [f64; M],
}

/// The law of one phase.
struct ArcLaw<'a, const M: usize> {
    phases: &'a Phases,
    row: usize,
    width: f64,
    left: [f64; M],
    right: [f64; M],
    bend: [f64; M],
    twist: f64,
    /// The end of the phase where v_k² is smaller, from which p is computed: u and v_k² there.
    anchor: (f64, f64),
}

impl<'a, const M: usize> ArcLaw<'a, M> {
    fn new(case: &Case<M>, phases: &'a Phases, row: usize) -> Self {
        let piece = &case.pieces[phases.piece[row] as usize];
        let (left, right) = piece.tangents();
        let [left, right] = [left, right].map(|tangent| tangent.map(|x| x / piece.width));
        let bend: [f64; M] = std::array::from_fn(|k| (right[k] - left[k]) / piece.width);
        let mut twist: f64 = 0.0;
        for j in 0..M {
            for k in 0..j {
                twist = twist.hypot((left[j] * right[k] - left[k] * right[j]) / piece.width);
            }
        }
        let mut law = Self { phases, row, width: piece.width, left, right, bend, twist, anchor: (0.0, 0.0) };
        if phases.kind[row] == 0 {
            let k = phases.axis[row] as usize;
            let (u0, u1) = (phases.u0[row], phases.u1[row]);
            let axis_sq = |u: f64, p: f64| {
                let g = law.tangent(u)[k];
                if p.is_finite() {
                    g * g * p
                } else {
                    f64::INFINITY
                }
            };
            let (start, end) = (axis_sq(u0, phases.p0[row]), axis_sq(u1, phases.p1[row]));
            law.anchor = if start <= end { (u0, start) } else { (u1, end) };
        }
        law
    }

    fn tangent(&self, u: f64) -> [f64; M] {
        if u <= 0.5 * self.width {
            std::array::from_fn(|k| self.left[k] + self.bend[k] * u)
        } else {
            std::array::from_fn(|k| self.right[k] - self.bend[k] * (self.width - u))
        }
    }

    fn at(&self, u: f64) -> Place<M> {
        let (g, c, row) = (self.tangent(u), &self.bend, self.row);
        let value = self.phases.value[row];
        let d: f64 = g.iter().map(|x| x * x).sum();
        let e: f64 = g.iter().zip(c).map(|(x, y)| x * y).sum();
        let k = self.phases.axis[row] as usize;
        let (p, s) = match self.phases.kind[row] {
            0 => {
                let from = self.tangent(self.anchor.0)[k];
                let p = (self.anchor.1 + value * (from + g[k]) * (u - self.anchor.0)) / (g[k] * g[k]);
                // In a form without the difference value − c p, which loses digits by cancellation.
                let acceleration = std::array::from_fn(|l| {
                    let twist = c[k] * g[l] - c[l] * g[k];
                    (g[l] * value - twist * p) / g[k]
                });
                return Place { g, d, p, acceleration };
            }
            1 => (self.phases.p0[row], 0.0),
            2 => (value / d, -value * e / (d * d)),
            3 => (value / (g[k] * g[k]), -value * c[k] / (g[k] * g[k] * g[k])),
            _ => {
                let phases = self.phases;
                let (u0, u1) = (phases.u0[row], phases.u1[row]);
                let speed_sq = |u: f64, p: f64| self.tangent(u).iter().map(|x| x * x).sum::<f64>() * p;
                let (start, end) = (speed_sq(u0, phases.p0[row]), speed_sq(u1, phases.p1[row]));
                let slope = (end - start) / (u1 - u0);
                let p = (start + slope * (u - u0)) / d;
                (p, (0.5 * slope - e * p) / d)
            }
        };
        let acceleration = match self.phases.kind[row] {
            2 => std::array::from_fn(|k| {
                (0..M).map(|l| g[l] * (c[k] * g[l] - c[l] * g[k])).sum::<f64>() * p / d
            }),
            3 => std::array::from_fn(|l| (c[l] * g[k] - c[k] * g[l]) * p / g[k]),
            _ => std::array::from_fn(|k| g[k] * s + c[k] * p),
        };
        Place { g, d, p, acceleration }
    }

    /// The duration [s]: change of the axis's speed divided by its acceleration, or the integral of du/√p.
    fn duration(&self) -> f64 {
        let row = self.row;
        let (u0, u1) = (self.phases.u0[row], self.phases.u1[row]);
        if self.phases.kind[row] == 0 {
            let k = self.phases.axis[row] as usize;
            let speed = |u: f64| {
                let g = self.tangent(u)[k];
                let from = self.tangent(self.anchor.0)[k];
                let gain = self.phases.value[row] * (from + g) * (u - self.anchor.0);
                (self.anchor.1 + gain).max(0.0).sqrt()
            };
            return (speed(u1) - speed(u0)).abs() / self.phases.value[row].abs();
        }
        // Simpson's rule, refined towards both ends where a tangent may nearly vanish.
        let count = 400;
        let place = |i: usize| {
            let x = i as f64 / count as f64;
            let (t, slope) = (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x));
            let here = self.at(u0 + (u1 - u0) * t);
            if slope == 0.0 {
                0.0
            } else {
                (u1 - u0) * slope / here.p.sqrt()
            }
        };
        let sum: f64 = (0..=count)
            .map(|i| place(i) * if i == 0 || i == count { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 })
            .sum();
        sum / (3.0 * count as f64)
    }
}
