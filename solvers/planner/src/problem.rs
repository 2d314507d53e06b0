//! The planning problem: a path with its limits, and the checks of all its numbers.

use feedplan_geometry::watch::Watch;

/// Number of axes in which the tip moves.
pub const TIP_AXES: usize = 3;

/// Limits of the axes for positive and for negative values, both as absolute values.
pub type Both<const M: usize> = [[f64; M]; 2];

/// The greater one of both limits of each axis.
pub fn greater<const M: usize>(limits: &Both<M>) -> [f64; M] {
    std::array::from_fn(|k| limits[0][k].max(limits[1][k]))
}

/// The lesser one of both limits of each axis.
pub fn lesser<const M: usize>(limits: &Both<M>) -> [f64; M] {
    std::array::from_fn(|k| limits[0][k].min(limits[1][k]))
}

/// The greatest factor by which `direction` can be multiplied within the limits; infinite if all its components are 0.
pub fn along<const M: usize>(limits: &Both<M>, direction: &[f64; M]) -> f64 {
    let of_axis = |k: usize| limits[usize::from(direction[k] < 0.0)][k] / direction[k].abs();
    (0..M).map(of_axis).fold(f64::INFINITY, f64::min)
}

/// The square of a speed divided by (du/dt)², where t is the time: a polynomial in u on each piece.
#[derive(Clone, Copy)]
pub struct SpeedSquare<'a> {
    /// Bernstein coefficients; piece i has coefficients[offset[i]..offset[i + 1]].
    pub coefficients: &'a [f64],
    pub offset: &'a [usize],
}

impl<'a> SpeedSquare<'a> {
    pub fn of(&self, i: usize) -> &'a [f64] {
        &self.coefficients[self.offset[i]..self.offset[i + 1]]
    }

    /// Whether each of `count` pieces has coefficients, all finite.
    fn fits(&self, count: usize) -> bool {
        is_rising(self.offset, count, self.coefficients.len(), 1)
            && self.coefficients.iter().all(|value| value.is_finite())
    }
}

/// Whether the offsets divide `total` rows among `count` pieces, with `least` rows or more for each.
fn is_rising(offset: &[usize], count: usize, total: usize, least: usize) -> bool {
    offset.len() == count + 1
        && offset[0] == 0
        && offset[count] == total
        && offset.windows(2).all(|pair| pair[1] >= pair[0] + least)
}

/// The path of the tip that belongs to the path of the joints, with the same pieces and parameters.
#[derive(Clone, Copy)]
pub struct Tip<'a> {
    /// The speed that the feed limits: |C'(u)|².
    pub speed: SpeedSquare<'a>,
    /// Control points, weights and offsets of the tip's path, for the chord error.
    pub control: &'a [[f64; TIP_AXES]],
    pub weight: &'a [f64],
    pub offset: &'a [usize],
}

/// A path of polynomial and rational pieces of any degree with its limits.
#[derive(Clone, Copy)]
pub struct Problem<'a, const M: usize> {
    /// Control points of all pieces; piece i has control[offset[i]..offset[i + 1]].
    pub control: &'a [[f64; M]],
    /// Their weights; empty where all pieces are polynomial.
    pub weight: &'a [f64],
    pub offset: &'a [usize],
    /// Width of each piece's parameter interval.
    pub width: &'a [f64],
    /// The tip, where the axes are joints.
    pub tip: Option<Tip<'a>>,
    /// The speed along the path to which the laws `PathJerk` and `SpeedCubic` refer; None if it is that of the axes. It is 0 only
    /// where all axes rest.
    pub way: Option<SpeedSquare<'a>>,
    /// For each piece: the factor of each axis's velocity in the speed that the feed limits, |(share_k q_k')| du/dt. Empty if all
    /// factors are 1, and where `tip` is given.
    pub feed_share: &'a [[f64; M]],
    /// Run i has the pieces runs[i]..runs[i + 1]. Runs begin and end at rest, except at the two ends of the path.
    pub runs: &'a [usize],
    /// Greatest speed of each piece [mm/s].
    pub feed: &'a [f64],
    /// Greatest speed at the start of each piece and at the end of the path [mm/s]; infinite for no limit. Ignored
    /// where a run begins or ends.
    pub junction_speed: &'a [f64],
    /// Limits of the axes [mm/s] and [mm/s²].
    pub max_velocity: Both<M>,
    pub max_acceleration: Both<M>,
    /// Greatest chord error [mm], infinite for no limit; and the servo period [s].
    pub chord_tolerance: f64,
    pub period: f64,
    /// Speeds at both ends of the path [mm/s].
    pub start_speed: f64,
    pub end_speed: f64,
    /// Receives the progress, and can stop the computation.
    pub watch: Watch<'a>,
}

/// Why there is no profile.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// The start speed is too high; `reachable` is the greatest possible one [mm/s].
    Start { piece: usize, reachable: f64 },
    /// The end speed is too high; `reachable` is the greatest possible one [mm/s].
    End { piece: usize, reachable: f64 },
    /// An invalid argument; `piece` is given if it belongs to one piece.
    Input { piece: Option<usize>, what: String },
    /// Rounding stopped a pass at u on the piece: a fault of the planner.
    Stuck { piece: usize, u: f64 },
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Start { reachable, .. } => {
                write!(f, "the start speed is too high: at most {reachable} mm/s is possible")
            }
            Self::End { reachable, .. } => {
                write!(f, "the end speed is too high: at most {reachable} mm/s can be reached")
            }
            Self::Input { what, .. } => write!(f, "{what}"),
            Self::Stuck { u, .. } => write!(f, "the planner makes no headway at u = {u}"),
        }
    }
}

impl std::error::Error for Fault {}

fn wrong<T>(what: String) -> Result<T, Fault> {
    Err(Fault::Input { piece: None, what })
}

fn wrong_piece<T>(piece: usize, what: String) -> Result<T, Fault> {
    Err(Fault::Input { piece: Some(piece), what })
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

impl<'a, const M: usize> Problem<'a, M> {
    /// Number of pieces.
    pub fn len(&self) -> usize {
        self.width.len()
    }

    pub fn is_empty(&self) -> bool {
        self.width.is_empty()
    }

    pub fn points(&self, i: usize) -> &'a [[f64; M]] {
        &self.control[self.offset[i]..self.offset[i + 1]]
    }

    /// Weights of piece `i`; empty where all pieces are polynomial.
    pub fn weights(&self, i: usize) -> &'a [f64] {
        weights_of(self.weight, self.offset, i)
    }

    /// The factors of the axes in the feed on piece `i`, or None if all are 1.
    pub fn share(&self, i: usize) -> Option<&'a [f64; M]> {
        self.feed_share.get(i).filter(|share| **share != [1.0; M])
    }

    /// Checks lengths, ranges and finiteness of every array, number and limit.
    pub fn check(&self) -> Result<(), Fault> {
        self.check_runs()?;
        self.check_limits()?;
        self.check_speeds()?;
        self.check_pieces()?;
        self.check_tip()
    }

    fn check_runs(&self) -> Result<(), Fault> {
        let (runs, count) = (self.runs, self.len());
        for (name, length, expected) in
            [("feeds", self.feed.len(), count), ("junction speeds", self.junction_speed.len(), count + 1)]
        {
            if length != expected {
                return wrong(format!("{length} {name} for {count} pieces: {expected} are needed"));
            }
        }
        if runs.len() < 2
            || runs[0] != 0
            || runs[runs.len() - 1] != count
            || runs.windows(2).any(|run| run[0] >= run[1])
        {
            return wrong(format!(
                "the runs do not divide the {count} pieces: give rising offsets from 0 to {count}"
            ));
        }
        Ok(())
    }

    fn check_limits(&self) -> Result<(), Fault> {
        for (side, k) in (0..2).flat_map(|side| (0..M).map(move |k| (side, k))) {
            let (v, a) = (self.max_velocity[side][k], self.max_acceleration[side][k]);
            if !is_positive(v) {
                return wrong(format!("the velocity limit of axis {k} is {v} mm/s: give a positive number"));
            }
            if !is_positive(a) {
                return wrong(format!(
                    "the acceleration limit of axis {k} is {a} mm/s²: give a positive number"
                ));
            }
        }
        let tolerance = self.chord_tolerance;
        if tolerance.is_nan() || tolerance <= 0.0 {
            return wrong(format!("the chord tolerance is {tolerance} mm: give a positive number"));
        }
        if tolerance.is_finite() && !is_positive(self.period) {
            return wrong(format!("the servo period is {} s: give a positive number", self.period));
        }
        Ok(())
    }

    fn check_speeds(&self) -> Result<(), Fault> {
        for (name, speed) in [("start", self.start_speed), ("end", self.end_speed)] {
            if !(speed >= 0.0 && speed.is_finite()) {
                return wrong(format!("the {name} speed is {speed} mm/s: give a finite number, 0 or more"));
            }
        }
        for (i, &feed) in self.feed.iter().enumerate() {
            if !is_positive(feed) {
                return wrong_piece(i, format!("the feed is {feed} mm/s: give a positive finite number"));
            }
        }
        for (i, &speed) in self.junction_speed.iter().enumerate() {
            if speed.is_nan() || speed < 0.0 {
                let piece = i.min(self.len() - 1);
                return wrong_piece(piece, format!("the junction speed is {speed} mm/s: give 0 or more"));
            }
        }
        Ok(())
    }

    fn check_pieces(&self) -> Result<(), Fault> {
        let count = self.len();
        if !is_rising(self.offset, count, self.control.len(), 2)
            || !(self.weight.is_empty() || self.weight.len() == self.control.len())
        {
            return wrong(format!(
                "offsets and weights do not fit {count} pieces: give two control points or more for each"
            ));
        }
        for i in 0..count {
            let points = self.points(i);
            if !points.iter().flatten().all(|value| value.is_finite()) {
                return wrong_piece(i, "a control point is not a finite number".into());
            }
            if points.iter().all(|point| *point == points[0]) {
                return wrong_piece(i, "the piece has no length: leave it out".into());
            }
            if !is_positive(self.width[i]) {
                let width = self.width[i];
                return wrong_piece(i, format!("the parameter width is {width}: give a positive number"));
            }
            if !self.weights(i).iter().all(|&weight| is_positive(weight)) {
                return wrong_piece(i, "a weight is not a positive number".into());
            }
        }
        let shares = self.feed_share;
        if !(shares.is_empty() || shares.len() == count)
            || !shares.iter().flatten().all(|share| share.is_finite() && *share >= 0.0)
        {
            return wrong(format!("the shares of the axes in the feed do not fit {count} pieces"));
        }
        Ok(())
    }

    fn check_tip(&self) -> Result<(), Fault> {
        let count = self.len();
        let tip_fits = self.tip.is_none_or(|tip| {
            is_rising(tip.offset, count, tip.control.len(), 2)
                && tip.speed.fits(count)
                && (tip.weight.is_empty() || tip.weight.len() == tip.control.len())
                && tip.control.iter().flatten().chain(tip.weight).all(|value| value.is_finite())
        });
        if !(tip_fits && self.way.is_none_or(|way| way.fits(count))) {
            return wrong(format!("the tool's path does not fit the {count} pieces of the joints"));
        }
        Ok(())
    }
}

/// Weights of piece `i` of a path; empty where there are none.
pub fn weights_of<'a>(weight: &'a [f64], offset: &[usize], i: usize) -> &'a [f64] {
    weight.get(offset[i]..offset[i + 1]).unwrap_or(&[])
}

/// The chord-error limit v² ≤ α ρ − 4 δ²/T² with the radius of curvature ρ, the tolerance δ and the servo period T.
#[derive(Clone, Copy)]
pub struct ChordLimit {
    /// α = 8 δ/T² [mm/s²].
    pub alpha: f64,
    /// 4 δ²/T² [mm²/s²].
    pub slow_sq: f64,
    /// δ [mm].
    pub tolerance: f64,
    /// The greatest acceleration of all axes together [mm/s²].
    pub acceleration: f64,
}

impl ChordLimit {
    /// None if the limit is never the lowest one: on any curve v²/ρ is at most `acceleration`, and this limit is nowhere below
    /// ρ α/2.
    pub fn new(tolerance: f64, period: f64, acceleration: f64) -> Option<Self> {
        let alpha = 8.0 * tolerance / (period * period);
        let slow_sq = 0.5 * alpha * tolerance;
        let binds = tolerance.is_finite() && alpha < 2.0 * acceleration;
        binds.then_some(Self { alpha, slow_sq, tolerance, acceleration })
    }
}
