//! The nodes of the spline: about equal in travel time where the speed changes, finer where the path turns, wide
//! where neither happens, and on every knot of the path.

use super::survey::{Change, Slopes, Station};
use std::ops::Range;

use super::interior_point::Bound;
use super::rows::Rows;
use super::{Geometry, Problem, Profile, SpeedCap};
use feedplan_geometry::watch::Watch;

/// r counts as changing where it uses more than this part of the greatest slope.
const CHANGING: f64 = 0.02;
/// A path that turns less than this over the length r/K is straight.
const TURNING: f64 = 0.02;
/// Lengths of intervals grow by at most this part of the distance.
const GROWTH: f64 = 0.5;
/// The longest interval, in parts of the length over which the path turns: about one radian of a circle. No interval is
/// planned longer than the path.
const LONGEST: f64 = 0.5;
/// An interval that reaches into the surroundings of a cap by no more than this part of them is outside: rounding.
const CLOSE: f64 = 1e-6;
/// Every path has at least so many intervals, in parts of the resolution.
const FEWEST: f64 = 26.0;

/// Nodes, the piece of each interval, and the caps at nodes.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    pub nodes: Vec<f64>,
    pub pieces: Vec<u32>,
    /// Node and speed, rising.
    caps: Vec<(usize, f64)>,
    /// How much tighter the limits of jerk are on each interval: 1 or more.
    calm: Vec<f64>,
}

impl Grid {
    /// `resolution` is the number of intervals while r doubles at its greatest slope, nearly.
    pub fn new(
        stations: &[Station],
        slopes: Slopes,
        caps: &[SpeedCap],
        bounds: &[Bound; 2],
        resolution: f64,
    ) -> Self {
        let density = density(stations, slopes, bounds, resolution);
        let mut grid = Self { nodes: vec![stations[0].s], ..Self::default() };
        let mut next = caps.iter().skip_while(|cap| cap.s <= stations[0].s).peekable();
        let mut whole = 0.0;
        for i in 1..stations.len() {
            whole += 0.5 * (density[i - 1] + density[i]) * (stations[i].s - stations[i - 1].s);
        }
        let more = (FEWEST * resolution / whole).max(1.0);
        let mut first = 0;
        for i in 1..stations.len() {
            let cap = next.next_if(|cap| cap.s <= stations[i].s);
            let knot = i + 1 == stations.len() || stations[i + 1].piece != stations[i].piece;
            if cap.is_some() || knot {
                if stations[i].s > stations[first].s {
                    grid.fill(&stations[first..=i], &density[first..=i], more);
                }
                first = if knot { (i + 1).min(stations.len() - 1) } else { i };
            }
            if let Some(cap) = cap {
                grid.caps.push((grid.nodes.len() - 1, cap.speed));
            }
        }
        grid.calm = calm(&grid.nodes, caps);
        grid
    }

    /// Nodes from the last one to the end of stations of one piece.
    fn fill(&mut self, stations: &[Station], density: &[f64], more: f64) {
        let mut sum = Vec::with_capacity(stations.len());
        let mut total = 0.0;
        sum.push(0.0);
        for i in 1..stations.len() {
            total += 0.5 * (density[i - 1] + density[i]) * (stations[i].s - stations[i - 1].s) * more;
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
            self.nodes.push(stations[i - 1].s + part * (stations[i].s - stations[i - 1].s));
        }
        self.nodes.push(stations[stations.len() - 1].s);
        self.pieces.resize(self.nodes.len() - 1, stations[0].piece);
    }

    /// The grid of a profile on a path with these knots and caps.
    pub fn of(profile: &Profile, knots: &[f64], caps: &[SpeedCap], watch: Watch) -> Self {
        let nodes = profile.s.clone();
        let piece = |(n, pair): (usize, &[f64])| {
            watch.check_at(n);
            knots.partition_point(|&knot| knot <= 0.5 * (pair[0] + pair[1])) as u32 - 1
        };
        let pieces = nodes.windows(2).enumerate().map(piece).collect();
        let node = |s: f64| nodes.binary_search_by(|node| node.total_cmp(&s)).ok();
        let speeds = caps.iter().filter_map(|cap| Some((node(cap.s)?, cap.speed))).collect();
        let calm = calm(&nodes, caps);
        Self { nodes, pieces, caps: speeds, calm }
    }

    /// The limits on a range of intervals.
    pub fn rows<G: Geometry<M>, const M: usize>(
        &self,
        problem: &Problem<G, M>,
        range: Range<usize>,
    ) -> Rows<M> {
        let nodes = &self.nodes[range.start..=range.end];
        let (pieces, calm) = (&self.pieces[range.clone()], &self.calm[range.clone()]);
        let cap = |node| self.cap(range.start + node);
        Rows::sample(problem.geometry, &problem.limits, nodes, pieces, calm, cap)
    }

    /// The speed allowed at a node, infinite where no cap is given.
    pub fn cap(&self, node: usize) -> f64 {
        match self.caps.binary_search_by_key(&node, |cap| cap.0) {
            Ok(at) => self.caps[at].1,
            Err(_) => f64::INFINITY,
        }
    }
}

/// How much tighter the caps make the limits of jerk on each interval.
fn calm(nodes: &[f64], caps: &[SpeedCap]) -> Vec<f64> {
    let mut calm = vec![1.0_f64; nodes.len() - 1];
    for cap in caps.iter().filter(|cap| cap.share > 0.0) {
        let within = (1.0 - CLOSE) * cap.reach;
        let first = nodes.partition_point(|&node| node <= cap.s - within).saturating_sub(1);
        let last = nodes.partition_point(|&node| node < cap.s + within).min(calm.len());
        for calm in &mut calm[first.min(last)..last] {
            *calm = calm.max(1.0 / (1.0 - cap.share));
        }
    }
    calm
}

/// Intervals per length at each station.
fn density(stations: &[Station], slopes: Slopes, bounds: &[Bound; 2], resolution: f64) -> Vec<f64> {
    let s: Vec<f64> = stations.iter().map(|station| station.s).collect();
    let r = slopes.envelope(stations, bounds);
    let last = s.len() - 1;
    let changing = |i: usize| {
        let h = s[i + 1] - s[i];
        let change = if r[i + 1] < r[i] { Change::Fall } else { Change::Rise };
        (r[i + 1] - r[i]).abs() > CHANGING * (slopes.reach(r[i], h, change) - r[i])
    };
    let mut length: Vec<f64> = (0..=last)
        .map(|i| {
            let turning = stations[i].turning;
            let active = (i < last && changing(i)) || (i > 0 && changing(i - 1));
            if active || turning * r[i] > TURNING * slopes.k {
                1.0 / (1.0 / slopes.length(r[i]) + turning)
            } else {
                f64::INFINITY
            }
        })
        .collect();
    // A ramp ends where its speed is that of the path at the latest.
    for (bound, i) in bounds.iter().zip([0, last]) {
        if let Bound::Rest { ramp, .. } = *bound {
            length[i] = length[i].min(1.0 / (1.0 / ramp + stations[i].turning));
        }
    }
    for i in 1..=last {
        length[i] = length[i].min(length[i - 1] + GROWTH * (s[i] - s[i - 1]));
    }
    for i in (1..=last).rev() {
        length[i - 1] = length[i - 1].min(length[i] + GROWTH * (s[i] - s[i - 1]));
    }
    (0..=last)
        .map(|i| {
            let longest = (LONGEST / stations[i].turning).min(s[last] - s[0]);
            if length[i].is_finite() { resolution / length[i] } else { 0.0 }.max(1.0 / longest)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::survey::survey;
    use super::super::{Limits, Place};
    use super::*;

    struct Line;

    impl Geometry<1> for Line {
        fn knots(&self) -> &[f64] {
            &[0.0, 3.0, 3.001, 50.0]
        }

        fn at(&self, _: usize, _: f64) -> Place<1> {
            Place { first: [1.0], second: [0.0], third: [0.0], speed_cap: 200.0 }
        }
    }

    #[test]
    fn knots_and_capped_places_are_nodes() {
        let limits = Limits { velocity: [[250.0]; 2], acceleration: [[3000.0]; 2], jerk: [50_000.0] };
        let caps = [SpeedCap::new(3.0, 20.0), SpeedCap::new(30.0, 5.0)];
        let bounds = [Bound::Rest { ramp: 0.01, greatest: 1.0 }; 2];
        let (stations, slopes) =
            survey(&Line, &limits, &caps, [0.01, 49.99], &bounds, Watch::default()).expect("speeds");
        let grid = Grid::new(&stations, slopes, &caps, &bounds, 16.0);
        let node = |s: f64| grid.nodes.binary_search_by(|node| node.total_cmp(&s)).expect("a node");
        assert_eq!((grid.cap(node(3.0)), grid.cap(node(30.0))), (20.0, 5.0));
        assert_eq!(grid.cap(node(3.001)), f64::INFINITY);
        assert_eq!(grid.pieces[node(3.0)], 1);
        assert_eq!(grid.pieces[node(3.001)], 2);
        assert_eq!((grid.nodes[0], grid.nodes[grid.nodes.len() - 1]), (0.01, 49.99));
        assert!(grid.nodes.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
