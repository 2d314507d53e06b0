//! The motion on a phase whose speed is given by the length of the path: constant, at constant jerk, or with v² a cubic of the
//! length.
//!
//! Speed v, acceleration a and jerk j along the path follow from the length (`speed_by_length`), the length from Kronrod's rule
//! over |C'|. With the derivatives by the length (`station`) these give the rates of the axes.

use super::number::inner;
use std::rc::Rc;

use super::bulge::{bulge, Bulge, Known};
use super::curve::Curve;
use super::quadrature::{gauss, kronrod_halves, MOST_HALVINGS, RULES_AGREE};
use super::speed_by_length::{Pace, SpeedByLength};
use super::station::Station;
use super::{EPS, ROUNDINGS};

/// An interval on which the rule is accurate. `start` is the distance of its start from the anchor in u, and the length from the
/// anchor up to there; `middle` is the same for its middle.
#[derive(Clone, Copy)]
struct Measured {
    start: [f64; 2],
    middle: [f64; 2],
}

/// A place of a phase: u, the length from the anchor, and the motion along the path; and the time from the anchor, if the motion
/// was computed from it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub u: f64,
    pub way: f64,
    pub pace: Pace,
    time: Option<f64>,
}

/// A phase ready to be evaluated at any u.
#[derive(Clone)]
pub struct PhaseByLength<const M: usize> {
    curve: Rc<Curve<M>>,
    /// The factor of each axis in the length.
    scale: [f64; M],
    u: [f64; 2],
    anchored_at_end: bool,
    duration: f64,
    speed: SpeedByLength,
    /// Intervals on which the rule is accurate, in order; mostly there is only the first one. `whole` is the distance of the end
    /// of the last one from the anchor in u, and the length up to there.
    first: Option<Measured>,
    others: Vec<Measured>,
    whole: [f64; 2],
}

impl<const M: usize> PhaseByLength<M> {
    /// The phase between two parameters; `speed` makes its speed from its length. Lengths and times count from the anchor.
    pub fn new(
        curve: Rc<Curve<M>>,
        scale: [f64; M],
        u: [f64; 2],
        anchored_at_end: bool,
        duration: f64,
        speed: impl FnOnce(f64) -> SpeedByLength,
    ) -> Self {
        let nothing = SpeedByLength::Constant { speed: 0.0 };
        let (first, others, whole) = (None, Vec::new(), [0.0; 2]);
        let mut phase =
            Self { curve, scale, u, anchored_at_end, duration, speed: nothing, first, others, whole };
        phase.measure(0.0, u[1] - u[0], &mut { MOST_HALVINGS });
        phase.speed = speed(phase.whole[1]);
        phase
    }

    /// |C'| at distances from the anchor, as the axes count.
    #[inline(always)]
    fn slopes<const K: usize>(&self, mut at: [f64; K]) -> [f64; K] {
        for d in &mut at {
            *d = if self.anchored_at_end { self.u[1] - *d } else { self.u[0] + *d };
        }
        self.curve.speeds(at, &self.scale)
    }

    /// Adds the intervals between two distances from the anchor, which are halved until the rule is accurate.
    fn measure(&mut self, from: f64, to: f64, halvings: &mut u32) {
        let ([fine, doubt], half) = kronrod_halves(|d| self.slopes(d), from, to);
        let middle = 0.5 * (from + to);
        let good = doubt.abs() <= RULES_AGREE * fine;
        if good || *halvings == 0 || !(from < middle && middle < to) {
            let before = self.whole[1];
            let measured = Measured { start: [from, before], middle: [middle, before + half] };
            match self.first {
                None => self.first = Some(measured),
                Some(_) => self.others.push(measured),
            }
            self.whole = [to, before + fine];
            return;
        }
        *halvings -= 1;
        self.measure(from, middle, halvings);
        self.measure(middle, to, halvings);
    }

    /// The place at u.
    pub fn place(&self, u: f64) -> Place {
        let d = if self.anchored_at_end { self.u[1] - u } else { u - self.u[0] };
        let passed = self.others.partition_point(|interval| interval.start[0] <= d);
        let [from, before] = match passed.checked_sub(1).map_or(self.first, |row| Some(self.others[row])) {
            Some(Measured { start, middle }) if d < middle[0] - EPS * self.u[1] => start,
            Some(Measured { middle, .. }) => middle,
            None => [0.0; 2],
        };
        let way = if d >= self.whole[0] {
            self.whole[1]
        } else if d > from + EPS * self.u[1] {
            // On half of an interval Gauss's rule is more accurate than it was on the whole one.
            before + gauss(|d| self.slopes(d), from, d)
        } else {
            before
        };
        let (mut pace, time) = self.speed.pace(way);
        if self.anchored_at_end {
            pace.a = -pace.a;
        }
        Place { u, way, pace, time }
    }

    /// Time from the start of the phase to a place, in s.
    pub fn since(&self, place: &Place) -> f64 {
        let time = place.time.unwrap_or_else(|| self.speed.time(place.way));
        if self.anchored_at_end {
            self.duration - time
        } else {
            time
        }
    }

    /// Whether the speed is constant.
    pub fn is_steady(&self) -> bool {
        matches!(self.speed, SpeedByLength::Constant { .. })
    }

    /// Time of the whole phase by its law, in s.
    pub fn time(&self) -> f64 {
        self.speed.time(self.whole[1])
    }

    /// Bound of the error in v, in mm/s, that comes from the rounding of the length: v² changes by 2 a times that.
    pub fn speed_rounding(&self, Pace { v, a, .. }: Pace, slope: f64) -> f64 {
        let gained = a.abs() * EPS * self.curve.width() * slope;
        ROUNDINGS * if gained < v * v { gained / v } else { gained.sqrt() }
    }

    /// Bounds between two places, in the order of travel; None if |C'| has no positive lower bound.
    pub fn bulge(&self, [from, to]: [&Place; 2], [near, far]: [&Station<M>; 2]) -> Option<Bulge<f64>> {
        let most = |a: &[f64; M], b: &[f64; M]| inner(a, a).max(inner(b, b)).sqrt();
        let known = Known {
            interval: to.u - from.u,
            slopes: [near.slope.min(far.slope), near.slope.max(far.slope)],
            second: most(&near.second, &far.second),
            third: most(&near.third, &far.third),
            paces: self.speed.bounds([&from.pace, &to.pace], (to.way - from.way).abs()),
        };
        let bulge = bulge(self.curve.bounds(), &known);
        (bulge.slope > 0.0).then_some(bulge)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vectors::{distance, length, vector_of};

    #[test]
    fn at_rest_where_the_tangent_vanishes_the_length_starts_with_the_cube_of_the_time() {
        // x = u³ by s = t³: u̇ = 1, but at u = 0 both v and C' vanish.
        let points = [[0.0; 2], [0.0; 2], [0.0; 2], [1.0, 0.0]];
        let curve = Rc::new(Curve::new(crate::polygon::Polygon::new(points.into_iter(), &[]), 1.0));
        let start = Pace { v: 0.0, a: 0.0, j: 6.0 };
        let speed = |_| SpeedByLength::Jerk { start, duration: 1.0 };
        let phase = PhaseByLength::new(curve, [1.0; 2], [0.0, 1.0], false, 1.0, speed);
        for u in [0.01, 0.5, 1.0] {
            let place = phase.place(u);
            let (time, v) = (phase.since(&place), place.pace.v);
            assert!((time - u).abs() < 1e-14 && (v - 3.0 * u * u).abs() < 1e-13, "{u}");
        }
        assert_eq!(phase.place(0.0).pace.v, 0.0);
    }

    #[test]
    fn nothing_between_two_places_is_farther_from_the_straight_line_than_its_bound() {
        let points = [[0.0, 0.0], [1.0, 0.3], [2.0, 0.9], [3.2, 0.8], [4.0, 0.1], [5.0, 0.4]];
        let curve = Rc::new(Curve::new(crate::polygon::Polygon::new(points.into_iter(), &[]), 5.0));
        let speeds: [fn(f64) -> SpeedByLength; 4] = [
            |_| SpeedByLength::Constant { speed: 3.0 },
            |length| SpeedByLength::cubic([9.0, 4.0], [1.0, 2.0], length),
            |length| SpeedByLength::cubic([1.0, 9.0], [3.0, -1.0], length),
            |_| SpeedByLength::Jerk { start: Pace { v: 3.0, a: -2.0, j: 1.0 }, duration: 2.5 },
        ];
        let mut met = 0.0_f64;
        for (speed, anchored_at_end) in speeds.into_iter().flat_map(|speed| [(speed, false), (speed, true)]) {
            let phase = PhaseByLength::new(curve.clone(), [1.0; 2], [0.0, 5.0], anchored_at_end, 2.5, speed);
            let at = |u: f64| (phase.place(u), Station::new(&curve, u).unwrap());
            for i in 0..20 {
                let [from, to] = [i, i + 1].map(|i| 0.25 * f64::from(i));
                let ((first, near), (last, far)) = (at(from), at(to));
                let bulge = phase.bulge([&first, &last], [&near, &far]).unwrap();
                let rates = |Place { pace, .. }: &Place, station: &Station<2>| {
                    [
                        station.velocity(pace.v),
                        station.acceleration(*pace),
                        station.jerk(*pace),
                        station.second,
                    ]
                };
                let (before, after) = (rates(&first, &near), rates(&last, &far));
                for share in [0.1, 0.3, 0.5, 0.8] {
                    let (place, station) = at(from + share * (to - from));
                    assert!(place.pace.v <= bulge.most_speed * (1.0 + 1e-12));
                    for (row, there) in rates(&place, &station).iter().enumerate() {
                        let [a, b] = [before[row], after[row]];
                        let straight = vector_of(|k| a[k] + share * (b[k] - a[k]));
                        let most = *bulge.rates.get(row).unwrap_or(&bulge.curvature);
                        let off = distance(&straight, there);
                        assert!(off <= most + 1e-12 * (1.0 + length(there)), "{row}: {off} > {most}");
                        met = met.max(off / (most + 1e-6));
                    }
                }
            }
        }
        assert!(met > 0.1, "no bound is near what it bounds: {met}");
    }
}
