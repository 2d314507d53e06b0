//! How fast a path may be travelled, roughly: the lower envelope of r = w^(3/4), in which constant jerk from rest is
//! linear, at stations dense enough to lay a grid over.

use super::interior_point::Bound;
use super::{rest, Fault, Geometry, Limits, Place, SpeedCap};
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::{greater, lesser, Both};

/// Parts of the limits that the caps of the envelope leave to a plan through them.
const SPEED: f64 = 0.9;
const ACCELERATION: f64 = 0.4;
const JERK: f64 = 0.25;
/// The slope of the envelope in parts of √(J/|q'|): constant jerk with 6/10 of the limit would be 0.447.
const SLOPE: f64 = 0.447;
/// What the slope may take of the acceleration.
const RISE: f64 = 1.5 * 0.6 * 0.79;
/// Stations of a piece: halved where the caps between them change by more than this in logarithm …
const CHANGE: f64 = 0.2;
/// … at least and at most so often.
const DEPTH: std::ops::Range<u32> = 2..30;
/// Stations are at most this part of r/K apart.
const SPACING: f64 = 0.25;

/// The slopes of the envelope: |r'| ≤ min(k, acceleration · r^(−1/3), r/shortest).
#[derive(Clone, Copy, Debug)]
pub struct Slopes {
    pub k: f64,
    /// Where it rises along the path, and where it falls.
    acceleration: [f64; 2],
    /// The least length over which r changes to its like, in mm: places on the path have no digits for shorter ones.
    shortest: f64,
}

/// Which way the envelope goes along the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    Rise,
    Fall,
}

/// A place of the survey.
#[derive(Clone, Copy, Debug)]
pub struct Station {
    pub s: f64,
    pub piece: u32,
    /// The greatest r here.
    pub cap: f64,
    /// 1/length over which the path turns or its curvature changes.
    pub turning: f64,
}

impl<const M: usize> Limits<M> {
    /// 1/w_max at a place.
    pub(super) fn per_speed_sq(&self, place: &Place<M>) -> f64 {
        let mut worst = 1.0 / (place.speed_cap * place.speed_cap);
        for k in 0..M {
            let first = place.first[k];
            worst = worst.max((first / self.velocity[usize::from(first < 0.0)][k]).powi(2));
        }
        worst
    }

    /// The greatest r at a place, where the envelope rises by k at most.
    pub(super) fn envelope_cap(&self, place: &Place<M>, k: f64) -> f64 {
        let tiny = f64::MIN_POSITIVE;
        let mut cap = (SPEED * SPEED / self.per_speed_sq(place).max(tiny)).powf(0.75);
        for axis in 0..M {
            let (second, third) = (place.second[axis].abs().max(tiny), place.third[axis].abs().max(tiny));
            let jerk = JERK * self.jerk[axis];
            let acceleration = self.acceleration[usize::from(place.second[axis] < 0.0)][axis];
            cap = cap
                .min((ACCELERATION * acceleration / second).powf(0.75))
                .min((jerk / third).sqrt())
                .min(jerk / (2.0 * second * k));
        }
        cap
    }
}

impl Slopes {
    /// From the greatest q' and −q' of each axis and the length of the path.
    pub fn new<const M: usize>(limits: &Limits<M>, greatest: &Both<M>, path: f64) -> Self {
        let least = |limit: &[f64; M], greatest: &[f64; M]| {
            (0..M).map(|k| limit[k] / greatest[k].max(f64::MIN_POSITIVE)).fold(f64::INFINITY, f64::min)
        };
        let [up, down] = &limits.acceleration;
        let [ahead, back] = greatest;
        Self {
            k: SLOPE * least(&limits.jerk, &greater(greatest)).sqrt(),
            acceleration: [
                RISE * least(up, ahead).min(least(down, back)),
                RISE * least(up, back).min(least(down, ahead)),
            ],
            shortest: rest::SHORTEST * path,
        }
    }

    /// The length over which r changes to its like at its greatest slope.
    #[inline]
    pub fn length(&self, r: f64) -> f64 {
        (r / self.k).max(self.shortest)
    }

    /// The greatest r a distance h further, up the envelope.
    #[inline]
    pub fn reach(&self, r: f64, h: f64, change: Change) -> f64 {
        r + h * self.k.min(self.acceleration[change as usize] / r.cbrt()).min(r / self.shortest)
    }

    /// The time to a speed from rest, or to rest from it if that is longer.
    pub fn stop_time(&self, speed: f64) -> f64 {
        let [rise, fall] = self.acceleration;
        let (a, j) = (rise.min(fall) / RISE, (self.k / SLOPE).powi(2));
        if speed * j > a * a {
            speed / a + a / j
        } else {
            2.0 * (speed / j).sqrt()
        }
    }

    /// The envelope at stations.
    pub fn envelope(&self, stations: &[Station], bounds: &[Bound; 2]) -> Vec<f64> {
        let s: Vec<f64> = stations.iter().map(|station| station.s).collect();
        let mut r: Vec<f64> = stations.iter().map(|station| station.cap).collect();
        self.end(&mut r, bounds);
        self.limit(&s, &mut r);
        r
    }

    /// Lowers r at the ends to what is known there.
    pub fn end(&self, r: &mut [f64], bounds: &[Bound; 2]) {
        for (bound, node) in bounds.iter().zip([0, r.len() - 1]) {
            r[node] = r[node].min(match *bound {
                Bound::Rest { ramp, .. } => self.k * ramp,
                Bound::Fixed { w, .. } => w.powf(0.75),
            });
        }
    }

    /// Lowers r at places s until no slope is exceeded.
    pub fn limit(&self, s: &[f64], r: &mut [f64]) {
        // Forward, then backward.
        for i in 1..s.len() {
            r[i] = r[i].min(self.reach(r[i - 1], s[i] - s[i - 1], Change::Rise));
        }
        for i in (1..s.len()).rev() {
            r[i - 1] = r[i - 1].min(self.reach(r[i], s[i] - s[i - 1], Change::Fall));
        }
    }
}

/// Stations on the pieces from s = `from` to `to`, and the slopes of their envelope; a fault where no speed is possible.
pub fn survey<const M: usize>(
    geometry: &impl Geometry<M>,
    limits: &Limits<M>,
    caps: &[SpeedCap],
    [from, to]: [f64; 2],
    bounds: &[Bound; 2],
    watch: Watch,
) -> Result<(Vec<Station>, Slopes), Fault> {
    let knots = geometry.knots();
    let pieces: Vec<(u32, f64, f64)> = (0..knots.len() - 1)
        .map(|piece| (piece as u32, knots[piece].max(from), knots[piece + 1].min(to)))
        .filter(|(_, start, end)| end > start)
        .collect();
    let mut greatest = [[0.0f64; M]; 2];
    for &(piece, start, end) in &pieces {
        watch.check_at(piece as usize);
        for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let place = geometry.at(piece as usize, start + part * (end - start));
            for k in 0..M {
                greatest[0][k] = greatest[0][k].max(place.first[k]);
                greatest[1][k] = greatest[1][k].max(-place.first[k]);
            }
        }
    }
    let slopes = Slopes::new(limits, &greatest, knots[knots.len() - 1]);
    let station = |piece: u32, s: f64| {
        let place = geometry.at(piece as usize, s);
        Station { s, piece, cap: limits.envelope_cap(&place, slopes.k), turning: turning(limits, &place) }
    };
    let mut stations = vec![];
    let mut next_cap = caps.partition_point(|cap| cap.s <= from);
    let each = watch.each(pieces.len());
    for &(piece, start, end) in &pieces {
        each.count(piece as usize);
        let mut last = station(piece, start);
        stations.push(last);
        while last.s < end {
            // Places with a cap are stations.
            let cap = caps.get(next_cap).filter(|cap| cap.s <= end);
            let mut there = station(piece, cap.map_or(end, |cap| cap.s));
            if let Some(cap) = cap {
                there.cap = there.cap.min((SPEED * cap.speed).powf(1.5));
                next_cap += 1;
            }
            halve(&station, last, there, 0, &mut stations);
            stations.push(there);
            last = there;
        }
    }
    // Also what is not a number is no speed; and no grid resolves a turn that is shorter than places are known.
    let is_bad = |station: &&Station| {
        let (cap, turns) = (station.cap, station.turning * slopes.shortest);
        cap.is_nan() || cap <= 0.0 || turns.is_nan() || turns > 1.0
    };
    if let Some(station) = stations.iter().find(is_bad) {
        return Err(Fault::NoPlan { s: station.s });
    }
    Ok((densify(&stations, slopes, bounds, watch), slopes))
}

/// Stations between two others of a piece.
fn halve(
    station: &impl Fn(u32, f64) -> Station,
    a: Station,
    b: Station,
    depth: u32,
    stations: &mut Vec<Station>,
) {
    let middle = station(a.piece, 0.5 * (a.s + b.s));
    let turning = (middle.turning - 0.5 * (a.turning + b.turning)).abs();
    let changes = (middle.cap * middle.cap / (a.cap * b.cap)).ln().abs() > CHANGE
        || turning > CHANGE * a.turning.max(b.turning);
    let deeper = depth < DEPTH.start || (changes && depth < DEPTH.end && b.s - a.s > 1e-9 * b.s);
    if deeper {
        halve(station, a, middle, depth + 1, stations);
    }
    stations.push(middle);
    if deeper {
        halve(station, middle, b, depth + 1, stations);
    }
}

/// Stations between the surveyed ones, dense where the envelope rises to the caps or falls from them, and the sparser the
/// farther from there; caps between them are interpolated.
fn densify(stations: &[Station], slopes: Slopes, bounds: &[Bound; 2], watch: Watch) -> Vec<Station> {
    let r = slopes.envelope(stations, bounds);
    let last = r.len() - 1;
    let mut out = Vec::with_capacity(2 * stations.len());
    for (i, pair) in stations.windows(2).enumerate() {
        watch.check_at(i);
        let [a, b] = [pair[0], pair[1]];
        out.push(a);
        let mut at = a.s;
        loop {
            let top = a.cap.max(b.cap);
            let near = |r: f64| if r < 2.0 * top { r.min(top) } else { r - top };
            let [rise, fall] = [r[i] + slopes.k * (at - a.s), r[i + 1] + slopes.k * (b.s - at)];
            let step = SPACING * slopes.length(near(rise).min(near(fall)));
            if at + 1.5 * step >= b.s {
                break;
            }
            at += step;
            let part = (at - a.s) / (b.s - a.s);
            out.push(Station {
                s: at,
                piece: a.piece,
                cap: a.cap + part * (b.cap - a.cap),
                turning: a.turning + part * (b.turning - a.turning),
            });
        }
    }
    out.push(stations[last]);
    out
}

/// |q''|/|q'| and √(|q'''|/|q'|), axes in parts of their velocities.
fn turning<const M: usize>(limits: &Limits<M>, place: &Place<M>) -> f64 {
    let velocity = lesser(&limits.velocity);
    let norm = |q: &[f64; M]| (0..M).map(|k| (q[k] / velocity[k]).powi(2)).sum::<f64>().sqrt();
    let first = norm(&place.first).max(f64::MIN_POSITIVE);
    0.3 * norm(&place.second) / first + 0.2 * (norm(&place.third) / first).sqrt()
}
