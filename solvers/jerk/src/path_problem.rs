//! A path by its arc length s [mm], the limits of the motion along it, the states at its ends, and the effort of a plan: the
//! types that the planners of this crate share.

use std::time::Instant;

use feedplan_geometry::lanes::four::Lanes;
use feedplan_geometry::watch::Watch;
use feedplan_planner::problem::Both;

/// Derivatives of the axes by the arc length at a point of the path, and the speed cap there.
#[derive(Clone, Copy, Debug)]
pub struct PathPoint<const M: usize> {
    /// q', in mm (or degrees) per mm.
    pub first: [f64; M],
    /// q'', in mm (or degrees) per mm².
    pub second: [f64; M],
    /// q''', in mm (or degrees) per mm³.
    pub third: [f64; M],
    /// The greatest speed along the path by feed and chord error, in mm/s; infinite where neither limits it.
    pub speed_cap: f64,
}

/// Derivatives of the axes and speed caps at four points of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoints<const M: usize> {
    /// q', q'' and q''' of each axis.
    pub q: [[Lanes; 3]; M],
    pub speed_cap: Lanes,
}

impl<const M: usize> PathPoints<M> {
    pub fn new(points: [PathPoint<M>; 4]) -> Self {
        let q = std::array::from_fn(|k| {
            [
                Lanes::new(points.map(|point| point.first[k])),
                Lanes::new(points.map(|point| point.second[k])),
                Lanes::new(points.map(|point| point.third[k])),
            ]
        });
        Self { q, speed_cap: Lanes::new(points.map(|point| point.speed_cap)) }
    }

    /// The point in this lane.
    pub fn point(&self, lane: usize) -> PathPoint<M> {
        let [first, second, third] =
            [0, 1, 2].map(|order| std::array::from_fn(|k| self.q[k][order].values()[lane]));
        PathPoint { first, second, third, speed_cap: self.speed_cap.values()[lane] }
    }
}

/// A path of smooth pieces between knots.
pub trait Geometry<const M: usize>: Sync {
    /// Arc lengths of the ends of the pieces, in mm, strictly rising, from 0 where the path begins at rest. q' is
    /// continuous at all knots; q'' may jump where the problem caps the speed, q''' anywhere.
    fn knots(&self) -> &[f64];

    /// Derivatives at the arc length s on a piece, which may be one of its ends.
    fn at(&self, piece: usize, s: f64) -> PathPoint<M>;

    /// `at` for four arc lengths on a piece.
    fn at_four(&self, piece: usize, s: [f64; 4]) -> PathPoints<M> {
        PathPoints::new(s.map(|s| self.at(piece, s)))
    }
}

/// Lengths below this fraction of the path's length are spoiled by the rounding of arc lengths.
pub const SHORTEST: f64 = 1e-11;

/// The length, in mm, of the shortest part into which a path of this length is cut. Paths below 1 mm count as 1 mm, because a
/// segment of `s_curve` is at least 1e-12 mm long.
pub fn shortest_part(path: f64) -> f64 {
    SHORTEST * path.max(1.0)
}

/// Greatest number of axes of a path.
pub const MOST_AXES: usize = 9;

/// The limits of each axis as absolute values, in mm/s, mm/s² and mm/s³; velocity and acceleration have one limit for positive
/// and one for negative values.
#[derive(Clone, Copy, Debug)]
pub struct Limits<const M: usize> {
    pub velocity: Both<M>,
    pub acceleration: Both<M>,
    pub jerk: [f64; M],
}

/// A speed cap at a place, and tighter limits of jerk around it, because setpoints show a jump of q'' as jerk.
#[derive(Clone, Copy, Debug)]
pub struct SpeedCap {
    /// Arc length, in mm.
    pub s: f64,
    /// In mm/s; infinite for no cap.
    pub speed: f64,
    /// The limits of jerk are tighter up to this distance to both sides, in mm.
    pub reach: f64,
    /// The fraction, less than 1, by which the limits of jerk are lower there.
    pub share: f64,
}

impl SpeedCap {
    pub fn new(s: f64, speed: f64) -> Self {
        Self { s, speed, reach: 0.0, share: 0.0 }
    }
}

/// How a path begins or ends.
#[derive(Clone, Copy, Debug)]
pub enum End {
    Rest,
    /// At rest only for an instant, because the path turns back there. The acceleration away from the end is above 0 and at most
    /// this, in mm/s². The lower bound holds for all accelerations up to `greatest`.
    Turn {
        acceleration: f64,
        greatest: f64,
    },
    /// A speed above 0 in mm/s and an acceleration along the path in mm/s². There is no plan before some iterations.
    Moving {
        speed: f64,
        acceleration: f64,
    },
    /// The speed in mm/s, above 0, that is held beyond the end. The lower bound holds for every motion beyond it.
    Held {
        speed: f64,
    },
}

impl End {
    /// The speed at this end in mm/s; 0 at rest.
    pub fn speed(&self) -> f64 {
        match *self {
            Self::Moving { speed, .. } | Self::Held { speed } => speed,
            Self::Rest | Self::Turn { .. } => 0.0,
        }
    }
}

pub struct Problem<'a, const M: usize> {
    pub geometry: &'a dyn Geometry<M>,
    pub limits: Limits<M>,
    /// Whether each axis moves on the path. The others get no rows in the solver: most pieces of most programs move two axes of
    /// three, or three of five.
    pub moves: [bool; M],
    /// Strictly rising in s, with speeds above 0.
    pub caps: &'a [SpeedCap],
    pub ends: [End; 2],
}

/// Accuracy and effort of a plan.
#[derive(Clone, Copy, Debug)]
pub struct Effort<'a> {
    /// Number of intervals while r = w^(3/4) doubles at its greatest slope; a resolution of 16 costs less than 1e-4 of the time.
    pub resolution: f64,
    /// Complementarity gap at which iterations stop, as a fraction of the time.
    pub tolerance: f64,
    /// Greatest number of iterations for each window.
    pub max_iterations: usize,
    /// The time at which a plan must be ready, whatever its quality.
    pub deadline: Option<Instant>,
    /// Paths of more intervals than this are solved in overlapping windows of about this many intervals.
    pub window: usize,
    /// Whether a lower bound is computed too.
    pub proves: bool,
    /// Gets the progress and may cancel the work.
    pub watch: Watch<'a>,
}

impl Default for Effort<'_> {
    fn default() -> Self {
        Self {
            resolution: 16.0,
            tolerance: 1e-7,
            max_iterations: 400,
            deadline: None,
            window: 1500,
            proves: false,
            watch: Watch::default(),
        }
    }
}

impl Effort<'_> {
    /// Whether the deadline has passed.
    pub fn expired(&self) -> bool {
        self.deadline.is_some_and(|end| Instant::now() >= end)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// The input is wrong, as the sentence says.
    Input(String),
    /// No valid plan was found near this arc length, in mm: no speed is possible, or a moving end is out of reach.
    NoPlan { s: f64 },
}
