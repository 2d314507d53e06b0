//! Computes the stations of the spline, from the samples of the speed envelope and the speed caps: about equally spaced in travel
//! time where the speed changes, closer where the path turns and an axis may limit the speed, far apart elsewhere, and on every
//! knot of the path.

use super::speed_envelope::{Change, EnvelopeSample, Slopes, ROUNDING};
use std::ops::Range;

use super::constraints::Constraints;
use super::window_end::WindowEnd;
use crate::path_problem::{Problem, SpeedCap};

/// r counts as changing where its slope is more than this fraction of its greatest slope.
const CHANGING: f64 = 0.02;
/// A path that turns by less than this (in radians) over the length r/K counts as straight.
const TURNING: f64 = 0.02;
/// The length of intervals, times the resolution, grows by at most this multiple of the distance along the path: where one feed
/// sets the speed, and elsewhere.
const GROWTH: [f64; 2] = [3.0, 0.5];
/// The longest interval, as a fraction of the length over which the path turns: about one radian of a circle. No interval is
/// longer than the path.
const LONGEST: f64 = 0.5;
/// An interval that overlaps the reach of a cap by less than this fraction of the reach counts as outside (rounding).
const CLOSE: f64 = 1e-6;
/// For each end at rest, the grid has at least this many intervals times the resolution.
const FEWEST: f64 = 13.0;

/// Arc lengths of the stations, the piece of each interval, and the speed caps at stations.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    pub stations: Vec<f64>,
    pub pieces: Vec<u32>,
    /// The index of the station (rising) and the speed in mm/s of each cap.
    caps: Vec<(usize, f64)>,
    /// Factor by which the limits of jerk on each interval are tighter than the machine's: 1 or more.
    jerk_factor: Vec<f64>,
}

impl Grid {
    /// `resolution` is about the number of intervals while r doubles at its greatest slope.
    pub fn new(
        samples: &[EnvelopeSample],
        slopes: Slopes,
        caps: &[SpeedCap],
        ends: &[WindowEnd; 2],
        resolution: f64,
    ) -> Self {
        let density = density(samples, slopes, ends, resolution);
        let mut grid = Self { stations: vec![samples[0].s], ..Self::default() };
        let mut next = caps.iter().skip_while(|cap| cap.s <= samples[0].s).peekable();
        let mut whole = 0.0;
        for i in 1..samples.len() {
            whole += 0.5 * (density[i - 1] + density[i]) * (samples[i].s - samples[i - 1].s);
        }
        let rests = ends.iter().filter(|kind| matches!(kind, WindowEnd::Rest { .. })).count();
        let more = (FEWEST * rests as f64 * resolution / whole).max(1.0);
        let mut first = 0;
        for i in 1..samples.len() {
            let cap = next.next_if(|cap| cap.s <= samples[i].s);
            let knot = i + 1 == samples.len() || samples[i + 1].piece != samples[i].piece;
            if cap.is_some() || knot {
                if samples[i].s > samples[first].s {
                    grid.fill(&samples[first..=i], &density[first..=i], more);
                }
                first = if knot { (i + 1).min(samples.len() - 1) } else { i };
            }
            if let Some(cap) = cap {
                grid.caps.push((grid.stations.len() - 1, cap.speed));
            }
        }
        grid.jerk_factor = jerk_factor(&grid.stations, caps);
        grid
    }

    /// The length of each interval, in mm.
    pub fn lengths(&self) -> Vec<f64> {
        self.stations.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    /// The grid with interval n split into `parts[n]` equal parts.
    pub fn refined(&self, parts: &[u32]) -> Self {
        let mut grid = Self { stations: vec![self.stations[0]], ..Self::default() };
        let mut caps = self.caps.iter().peekable();
        for (n, &count) in parts.iter().enumerate() {
            if let Some(&(_, speed)) = caps.next_if(|cap| cap.0 == n) {
                grid.caps.push((grid.stations.len() - 1, speed));
            }
            let [start, end] = [self.stations[n], self.stations[n + 1]];
            let h = (end - start) / f64::from(count);
            grid.stations.extend((1..count).map(|i| start + f64::from(i) * h));
            grid.stations.push(end);
            grid.pieces.resize(grid.stations.len() - 1, self.pieces[n]);
            grid.jerk_factor.resize(grid.stations.len() - 1, self.jerk_factor[n]);
        }
        grid.caps.extend(caps.map(|cap| (grid.stations.len() - 1, cap.1)));
        grid
    }

    /// Appends stations up to the last of these samples, which are all on one piece, so that `density` has the same integral over
    /// each new interval, at most 1/`more`.
    fn fill(&mut self, samples: &[EnvelopeSample], density: &[f64], more: f64) {
        let mut sum = Vec::with_capacity(samples.len());
        let mut total = 0.0;
        sum.push(0.0);
        for i in 1..samples.len() {
            total += 0.5 * (density[i - 1] + density[i]) * (samples[i].s - samples[i - 1].s) * more;
            sum.push(total);
        }
        let count = total.ceil().max(1.0) as usize;
        let mut i = 1;
        for n in 1..count {
            let wanted = total * n as f64 / count as f64;
            while sum[i] < wanted {
                i += 1;
            }
            let part = (wanted - sum[i - 1]) / (sum[i] - sum[i - 1]);
            self.stations.push(samples[i - 1].s + part * (samples[i].s - samples[i - 1].s));
        }
        self.stations.push(samples[samples.len() - 1].s);
        self.pieces.resize(self.stations.len() - 1, samples[0].piece);
    }

    /// Sets `rows` to the constraints on a range of intervals.
    pub fn sample<const M: usize>(&self, problem: &Problem<M>, range: Range<usize>, rows: &mut Constraints) {
        let stations = &self.stations[range.start..=range.end];
        let (pieces, jerk_factor) = (&self.pieces[range.clone()], &self.jerk_factor[range.clone()]);
        let cap = |station| self.cap(range.start + station);
        rows.sample(problem.geometry, &problem.limits, stations, pieces, jerk_factor, cap);
    }

    /// The speed cap at a station in mm/s; infinite if it has none.
    pub fn cap(&self, station: usize) -> f64 {
        match self.caps.binary_search_by_key(&station, |cap| cap.0) {
            Ok(at) => self.caps[at].1,
            Err(_) => f64::INFINITY,
        }
    }
}

/// The factor by which the speed caps tighten the limits of jerk on each interval.
fn jerk_factor(stations: &[f64], caps: &[SpeedCap]) -> Vec<f64> {
    let mut jerk_factor = vec![1.0_f64; stations.len() - 1];
    for cap in caps.iter().filter(|cap| cap.share > 0.0) {
        let within = (1.0 - CLOSE) * cap.reach;
        let first = stations.partition_point(|&station| station <= cap.s - within).saturating_sub(1);
        let last = stations.partition_point(|&station| station < cap.s + within).min(jerk_factor.len());
        for jerk_factor in &mut jerk_factor[first.min(last)..last] {
            *jerk_factor = jerk_factor.max(1.0 / (1.0 - cap.share));
        }
    }
    jerk_factor
}

/// Intervals per mm at each sample.
fn density(samples: &[EnvelopeSample], slopes: Slopes, ends: &[WindowEnd; 2], resolution: f64) -> Vec<f64> {
    let s: Vec<f64> = samples.iter().map(|sample| sample.s).collect();
    let r = slopes.envelope(samples, ends);
    let last = s.len() - 1;
    let changing = |i: usize| {
        let h = s[i + 1] - s[i];
        let change = if r[i + 1] < r[i] { Change::Fall } else { Change::Rise };
        (r[i + 1] - r[i]).abs() > CHANGING * (slopes.reach(r[i], h, change) - r[i])
    };
    // Where one feed sets the speed, the speed is constant however the path turns.
    let even: Vec<bool> = (0..=last)
        .map(|i| {
            let near = &samples[i.saturating_sub(1)..=(i + 1).min(last)];
            near.iter().all(|near| near.fed && (near.cap / samples[i].cap - 1.0).abs() < ROUNDING)
        })
        .collect();
    let growth = |i: usize, j: usize| if even[i] && even[j] { GROWTH[0] } else { GROWTH[1] };
    let mut length: Vec<f64> = (0..=last)
        .map(|i| {
            let turning = samples[i].turning;
            let active = (i < last && changing(i)) || (i > 0 && changing(i - 1));
            if even[i] {
                if active {
                    slopes.length(r[i])
                } else {
                    f64::INFINITY
                }
            } else if active || turning * r[i] > TURNING * slopes.k {
                1.0 / (1.0 / slopes.length(r[i]) + turning)
            } else {
                f64::INFINITY
            }
        })
        .collect();
    // The first interval, times the resolution, is at most as long as the ramp before it; likewise the last interval and the ramp
    // after it.
    for (kind, i) in ends.iter().zip([0, last]) {
        if let WindowEnd::Rest { ramp, .. } = *kind {
            length[i] = length[i].min(1.0 / (1.0 / ramp.length + samples[i].turning));
        }
    }
    for i in 1..=last {
        length[i] = length[i].min(length[i - 1] + growth(i, i - 1) * (s[i] - s[i - 1]));
    }
    for i in (1..=last).rev() {
        length[i - 1] = length[i - 1].min(length[i] + growth(i, i - 1) * (s[i] - s[i - 1]));
    }
    (0..=last)
        .map(|i| {
            let longest = (LONGEST / samples[i].turning).min(s[last] - s[0]);
            if length[i].is_finite() { resolution / length[i] } else { 0.0 }.max(1.0 / longest)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::rest_ramp::Ramp;
    use super::super::speed_envelope::sample_envelope;
    use super::*;
    use crate::path_problem::{Geometry, Limits, PathPoint};
    use feedplan_geometry::watch::Watch;

    struct Line;

    impl Geometry<1> for Line {
        fn knots(&self) -> &[f64] {
            &[0.0, 3.0, 3.001, 50.0]
        }

        fn at(&self, _: usize, _: f64) -> PathPoint<1> {
            PathPoint { first: [1.0], second: [0.0], third: [0.0], speed_cap: 200.0 }
        }
    }

    #[test]
    fn knots_and_capped_places_are_stations() {
        let limits = Limits { velocity: [[250.0]; 2], acceleration: [[3000.0]; 2], jerk: [50_000.0] };
        let caps = [SpeedCap::new(3.0, 20.0), SpeedCap::new(30.0, 5.0)];
        let ramp = Ramp { length: 0.01, power: Ramp::JERK };
        let ends = [WindowEnd::Rest { ramp, greatest: 1.0 }; 2];
        let (samples, slopes) =
            sample_envelope(&Line, &limits, &caps, [0.01, 49.99], &ends, Watch::default()).expect("speeds");
        let grid = Grid::new(&samples, slopes, &caps, &ends, 16.0);
        let station =
            |s: f64| grid.stations.binary_search_by(|station| station.total_cmp(&s)).expect("a station");
        assert_eq!((grid.cap(station(3.0)), grid.cap(station(30.0))), (20.0, 5.0));
        assert_eq!(grid.cap(station(3.001)), f64::INFINITY);
        assert_eq!(grid.pieces[station(3.0)], 1);
        assert_eq!(grid.pieces[station(3.001)], 2);
        assert_eq!((grid.stations[0], grid.stations[grid.stations.len() - 1]), (0.01, 49.99));
        assert!(grid.stations.windows(2).all(|pair| pair[0] < pair[1]));

        let parts: Vec<u32> = (0..grid.pieces.len() as u32).map(|n| 1 + n % 3).collect();
        let fine = grid.refined(&parts);
        let mut first = 0;
        for (n, &parts) in parts.iter().enumerate() {
            let end = first + parts as usize;
            assert_eq!(
                (fine.stations[first], fine.stations[end], fine.cap(first)),
                (grid.stations[n], grid.stations[n + 1], grid.cap(n))
            );
            assert!(fine.pieces[first..end].iter().all(|&piece| piece == grid.pieces[n]));
            assert!(fine.jerk_factor[first..end].iter().all(|&factor| factor == grid.jerk_factor[n]));
            let h = (fine.stations[end] - fine.stations[first]) / f64::from(parts);
            let own = &fine.stations[first..=end];
            assert!(own.windows(2).all(|pair| (pair[1] - pair[0] - h).abs() < 1e-13));
            first = end;
        }
        assert_eq!(fine.pieces.len(), first);
    }
}
