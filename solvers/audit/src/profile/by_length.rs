//! Audits one phase whose speed is known by the length of the path, at as many places as its motion needs.
//!
//! Velocity, acceleration and jerk are taken at a few places, more where the phase covers more of its piece. Between two of
//! them:
//! * at constant speed the derivatives of the curve bound how much each rate can change (`PhaseByLength::change_at_most`): where
//!   the bound stays below all limits nothing else is measured, where it is wide the interval is halved;
//! * elsewhere a parabola through three places tells where a rate near its limit is greatest, and it is measured there.

use super::chord_error;
use crate::peak::peaks;
use crate::phase_by_length::PhaseByLength;
use crate::{curve, Check, Limits, Tally, FEEDS};

/// Places of a phase that covers its whole piece, for each degree; of a phase from rest; and at least.
const PLACES: f64 = 5.0;
const SPEEDS: f64 = 10.0;
const LEAST: usize = 4;

/// The next places are this part of the distance beside a vertex, and are taken so often at most.
const CLOSER: f64 = 0.5;
const MOST_REFINED: u32 = 3;

/// Bounds wider than this share of a limit are not trusted to a parabola; an interval is halved so often at most.
const WIDE: f64 = 0.1;
const MOST_HALVINGS: u32 = 6;

/// Shares of the limits that a place uses: velocity, acceleration and jerk of each axis with their signs, then feeds and chord
/// error.
#[derive(Clone, Copy)]
struct Use<const M: usize> {
    u: f64,
    rates: [[f64; M]; 3],
    tip: [f64; FEEDS + 1],
    curvature: f64,
}

impl<const M: usize> Use<M> {
    fn all(&self) -> impl Iterator<Item = f64> + '_ {
        self.rates.iter().flatten().chain(&self.tip).copied()
    }
}

/// Where and when a phase is, and the limits that hold there.
pub struct Looker<'a, const M: usize> {
    pub motion: &'a PhaseByLength<M>,
    pub limits: &'a Limits<M>,
    pub feeds: [f64; FEEDS],
    pub start: f64,
    pub line: i32,
}

impl<const M: usize> Looker<'_, M> {
    /// `share` is that of the phase in its piece, of so many `turns`.
    pub fn phase(&self, [u0, u1]: [f64; 2], share: f64, turns: usize, tally: &mut Tally<M>) {
        let [from, to] = [u0, u1].map(|u| self.motion.passage(u).1.v);
        // At most 1, as speeds are positive; a profile of rubbish has any numbers.
        let change = ((to - from).abs() / from.max(to)).min(1.0);
        let wanted = (PLACES * turns as f64 * share).max(SPEEDS * change);
        let count = (wanted.ceil() as usize).max(LEAST);
        let mut last: [Option<Use<M>>; 2] = [None; 2];
        for i in 0..=count {
            let x = i as f64 / count as f64;
            let here = self.look(u0 * (1.0 - x) + u1 * x, tally);
            if let (Some(before), Some(here), Some(speed)) = (last[1], here, self.motion.constant_speed()) {
                self.between(speed, &before, &here, 0, tally);
            }
            if let ([Some(first), Some(middle)], Some(here)) = (last, here) {
                self.refine([&first, &middle, &here], 0, tally);
            }
            last = [last[1], here];
        }
    }

    /// Looks where parabolas through three even places say that a rate is greater than any so far, and beside it: one rate
    /// after the other.
    fn refine(&self, places: [&Use<M>; 3], depth: u32, tally: &mut Tally<M>) {
        let [first, middle, last] = places;
        for x in peaks(places.map(Use::all), worst(tally)) {
            let half = 0.5 * (last.u - first.u);
            let centre = middle.u + x * half;
            let side = CLOSER * half.min(centre - first.u).min(last.u - centre);
            let around = [centre - side, centre, centre + side].map(|u| self.look(u, tally));
            if let ([Some(a), Some(b), Some(c)], true) = (around, depth < MOST_REFINED) {
                self.refine([&a, &b, &c], depth + 1, tally);
            }
        }
    }

    /// Offers what a place shows.
    fn look(&self, u: f64, tally: &mut Tally<M>) -> Option<Use<M>> {
        let (limits, line) = (self.limits, self.line);
        let (since, pace) = self.motion.passage(u);
        let rates = self.motion.rates(u, pace)?;
        let time = self.start + since;
        tally.samples += 1;
        let mut used = Use { u, rates: [[0.0; M]; 3], tip: [0.0; FEEDS + 1], curvature: rates.curvature };
        for k in 0..M {
            let of = [
                (Check::Velocity, &rates.velocity, limits.velocity.of(k, rates.velocity.value[k])),
                (
                    Check::Acceleration,
                    &rates.acceleration,
                    limits.acceleration.of(k, rates.acceleration.value[k]),
                ),
                (Check::Jerk, &rates.jerk, limits.jerk[k]),
            ];
            for (row, (check, rate, limit)) in of.into_iter().enumerate() {
                let value = rate.value[k].abs() - rate.rounding[k];
                used.rates[row][k] = value.max(0.0).copysign(rate.value[k]) / limit;
                if check != Check::Jerk || limits.judges_jerk {
                    tally.offer(check, k, value, limit, time, line);
                } else {
                    used.rates[row][k] = 0.0;
                }
            }
        }
        for (feed, limit) in self.feeds.into_iter().enumerate().filter(|(_, limit)| *limit != f64::INFINITY) {
            let speed = curve::length(&limits.counted(feed, &rates.velocity.value))
                - curve::length(&limits.counted(feed, &rates.velocity.rounding));
            used.tip[feed] = speed / limit;
            tally.offer(Check::Feed, 0, speed, limit, time, line);
        }
        if limits.chord_tolerance.is_finite() {
            let speed = curve::length(&rates.velocity.value) - curve::length(&rates.velocity.rounding);
            let error = chord_error(speed * limits.period, rates.curvature);
            used.tip[FEEDS] = error / limits.chord_tolerance;
            tally.offer(Check::Chord, 0, error, limits.chord_tolerance, time, line);
        }
        Some(used)
    }

    /// At constant speed: looks at the middle of two places as long as a bound leaves open what lies between them.
    fn between(&self, speed: f64, from: &Use<M>, to: &Use<M>, halvings: u32, tally: &mut Tally<M>) {
        let limits = self.limits;
        let [velocity, acceleration, jerk, curvature] = self.motion.change_at_most(speed, from.u, to.u);
        let (mut most, mut widest) = (0.0_f64, 0.0_f64);
        for k in 0..limits.axes {
            let least = [limits.velocity.least(k), limits.acceleration.least(k), limits.jerk[k]];
            let judged = if limits.judges_jerk { 3 } else { 2 };
            for (row, change) in [velocity, acceleration, jerk].into_iter().enumerate().take(judged) {
                let change = change / least[row];
                most = most.max(from.rates[row][k].abs().max(to.rates[row][k].abs()) + change);
                widest = widest.max(change);
            }
        }
        if limits.chord_tolerance.is_finite() {
            let curved = from.curvature.max(to.curvature) + curvature;
            let error = chord_error(speed * limits.period, curved) / limits.chord_tolerance;
            most = most.max(error);
            widest = widest.max(error - from.tip[FEEDS].max(to.tip[FEEDS]));
        }
        let certain = most <= 1.0 || widest <= WIDE;
        // Pieces with weights have no bounds.
        if certain || widest == f64::INFINITY && velocity == f64::INFINITY || halvings == MOST_HALVINGS {
            return;
        }
        let Some(middle) = self.look(0.5 * (from.u + to.u), tally) else { return };
        self.between(speed, from, &middle, halvings + 1, tally);
        self.between(speed, &middle, to, halvings + 1, tally);
    }
}

/// The worst shares so far, in the order of `Use::all`; all feeds are one check.
fn worst<const M: usize>(tally: &Tally<M>) -> impl Iterator<Item = f64> + '_ {
    let of_axes = [Check::Velocity, Check::Acceleration, Check::Jerk].into_iter();
    let of_tip = std::iter::repeat_n(Check::Feed, FEEDS).chain([Check::Chord]);
    of_axes
        .flat_map(|check| (0..M).map(move |k| (check, k)))
        .chain(of_tip.map(|check| (check, 0)))
        .map(|(check, k)| tally.get(check, k).ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{length, Curve};
    use crate::phases::Phases;
    use crate::polygon::Polygon;
    use crate::Sided;
    use proptest::prelude::*;
    use std::rc::Rc;

    /// A phase on part of a curve, with the speeds and the accelerations along the path at its ends.
    fn phase(
        curve: &Rc<Curve<2>>,
        kind: u8,
        [u0, u1]: [f64; 2],
        speeds: [f64; 2],
        pulls: [f64; 2],
    ) -> PhaseByLength<2> {
        let p: Vec<f64> =
            (0..2).map(|i| (speeds[i] / length(&curve.derivative([u0, u1][i]))).powi(2)).collect();
        Phases {
            piece: &[0],
            kind: &[kind],
            axis: &[255],
            value: &[speeds[0] * speeds[0]],
            u0: &[u0],
            u1: &[u1],
            p0: &p[..1],
            p1: &p[1..],
            duration: &[1.0],
            a0: &pulls[..1],
            a1: &pulls[1..],
            share: &[],
            pieces: 1,
            runs: &[0, 1],
        }
        .by_length(0, curve)
        .unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// A thousandth at constant speed, a hundredth where the jerk along the path swings from one sign to the other. On up to a
        /// fifth of a piece, at speeds up to a tenth apart: most phases of limited jerk have less of both.
        #[test]
        fn a_limit_a_little_below_the_greatest_use_is_broken_wherever_that_is(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 2..=9_usize,
            cut in prop::array::uniform2(0.0..1.0_f64),
            speeds in prop::array::uniform2(1.0..1.1_f64),
            flat: bool,
        ) {
            let points: Vec<[f64; 2]> = (0..=degree).map(|i| [i as f64, bends[i]]).collect();
            let curve = Rc::new(Curve::general(Polygon::new(points.into_iter(), &[]), degree as f64));
            let width = curve.width();
            let from = 0.8 * width * cut[0];
            let u = [from, from + 0.2 * width * (0.1 + 0.9 * cut[1])];
            let (kind, speeds) = if flat { (crate::phases::FEED, [speeds[0]; 2]) } else { (crate::phases::SPEED_CUBIC, speeds) };
            let motion = phase(&curve, kind, u, speeds, [0.0; 2]);
            let mut most = [[0.0_f64; 2]; 3];
            for i in 0..=2000 {
                let at = u[0] + (u[1] - u[0]) * f64::from(i) / 2000.0;
                let rates = motion.rates(at, motion.passage(at).1).unwrap();
                for (row, rate) in [rates.velocity, rates.acceleration, rates.jerk].iter().enumerate() {
                    for k in 0..2 {
                        most[row][k] = most[row][k].max(rate.value[k].abs());
                    }
                }
            }
            let below = if flat { 1.001 } else { 1.01 };
            let [velocity, acceleration, jerk] = most.map(|row| row.map(|most| most / below));
            let of = |limit: [f64; 2]| Sided { positive: limit, negative: limit };
            let limits = Limits {
                axes: 2,
                velocity: of(velocity),
                acceleration: of(acceleration),
                jerk,
                judges_jerk: true,
                jump: [0.0; 2],
                jump_beyond: [0.0; 2],
                travel: [[f64::NEG_INFINITY, f64::INFINITY]; 2],
                feed_axes: [[1.0; 2]; FEEDS],
                chord_tolerance: f64::INFINITY,
                period: 1e-3,
                end_speeds: [0.0; 2],
            };
            let mut tally = Tally::default();
            let looker = Looker { motion: &motion, limits: &limits, feeds: [f64::INFINITY; FEEDS], start: 0.0, line: 1 };
            looker.phase(u, (u[1] - u[0]) / width, curve.turns(), &mut tally);
            for (row, check) in [Check::Velocity, Check::Acceleration, Check::Jerk].into_iter().enumerate() {
                for k in (0..2).filter(|&k| most[row][k] > 1e-6) {
                    prop_assert!(tally.get(check, k).ratio > 1.0, "{check:?} {k}: {}", tally.get(check, k).ratio);
                }
            }
        }
    }
}
