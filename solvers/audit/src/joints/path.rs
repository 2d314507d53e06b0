//! Positions of the joints and their derivatives at places of the path of the tool's tip, by the formula of the kinematics.

use std::rc::Rc;

use super::formula::{Formula, Jet};
use crate::curve::{Curve, Followed};
use crate::station::{Place, Rounded, Roundings, Station};
use crate::vectors::{curvature, length, times};
use crate::{EPS, ROUNDINGS};

pub const TURN: f64 = 360.0;
/// Error of a coordinate of the tip in the formula, in roundings of the greatest coordinate of its piece.
pub const TIP_ROUNDINGS: f64 = 2.0 * ROUNDINGS;

/// What the words of runs mean.
pub struct Words {
    pub formula: Formula,
    /// Which joints are known up to whole turns only.
    pub turning: Vec<bool>,
    /// For each coordinate of the tip the axis of the path; one without stays at 0.
    pub column: Vec<Option<usize>>,
    /// Whether the tip's coordinates end with a direction I, J, K.
    pub directed: bool,
}

/// The joints of a problem whose path is that of the tool's tip.
///
/// Some angles are known up to whole turns only: between two places that are compared such a joint turns by less than half a
/// turn.
pub struct JointPath<'a> {
    pub path: Followed<'a>,
    /// Number of joints.
    pub joints: usize,
    pub words: &'a [Words],
    /// The words of each run.
    pub words_of: &'a [usize],
    /// Axes X, Y, Z and I, J, K of the path.
    pub xyz: &'a [bool],
    pub ijk: &'a [bool],
    /// What each axis of the path counts in its length.
    pub way_scale: &'a [f64],
    /// The greatest speed of each piece.
    pub feed: &'a [f64],
}

/// A piece ready to be measured.
pub struct Piece<'a, const M: usize> {
    pub number: usize,
    pub width: f64,
    pub curve: Rc<Curve<M>>,
    words: &'a Words,
    /// The axes whose motion the feed limits, 1 or 0: X, Y, Z where these move, else the others.
    pub counts: [f64; M],
    /// Whether only the direction of the tool turns: then the feed limits the degrees that it turns.
    turns: bool,
    /// What each axis of the path counts in its length.
    way_scale: [f64; M],
    xyz: [f64; M],
    ijk: [usize; 3],
    size: f64,
    slope_size: [f64; M],
    start_size: f64,
}

/// Room for the results of a formula, used again at every place.
pub struct Work {
    positions: Vec<Jet<1, false>>,
    slopes: Vec<Jet<2, false>>,
    bends: Vec<Jet<4, false>>,
    rounded_slopes: Vec<Jet<2, true>>,
    rounded_bends: Vec<Jet<4, true>>,
}

/// Positions of the joints and their first three derivatives by u, and |C'| with two of its own.
type Bends<const M: usize, const ROUNDED: bool> = ([Rounded<M>; 4], Jet<3, ROUNDED>);

impl JointPath<'_> {
    fn run_of(&self, piece: usize) -> usize {
        self.path.runs.partition_point(|&first| first <= piece as i64) - 1
    }

    /// What each axis of the path counts in its length.
    pub fn scale<const M: usize>(&self) -> [f64; M] {
        std::array::from_fn(|k| self.way_scale.get(k).copied().unwrap_or(0.0))
    }

    /// Room for results of all formulas.
    pub fn work(&self) -> Work {
        let most = self.words.iter().map(|words| words.formula.places()).max().unwrap_or(0);
        Work {
            positions: vec![Jet::constant(0.0); most],
            slopes: vec![Jet::constant(0.0); most],
            bends: vec![Jet::constant(0.0); most],
            rounded_slopes: vec![Jet::constant(0.0); most],
            rounded_bends: vec![Jet::constant(0.0); most],
        }
    }

    /// A piece ready to be measured.
    pub fn piece<const M: usize>(&self, number: usize) -> Piece<'_, M> {
        self.piece_on(number, Rc::new(self.path.curve::<M>(number)))
    }

    /// The same where its curve is at hand.
    pub(super) fn piece_on<const M: usize>(&self, number: usize, curve: Rc<Curve<M>>) -> Piece<'_, M> {
        let run = self.run_of(number);
        let words = &self.words[self.words_of[run]];
        let flag = |flags: &[bool], k: usize| flags.get(k).copied().unwrap_or(false);
        let rows = self.path.rows(number);
        let axes = self.path.axes;
        let point = |row: usize| &self.path.control[row * self.path.stride..][..axes];
        let first = point(rows.start);
        let moves = |k: usize| rows.clone().any(|row| point(row)[k] != first[k]);
        let linear = (0..axes).any(|k| self.xyz[k] && moves(k));
        let mut ijk = (0..axes).filter(|&k| self.ijk[k]);
        let number_of = |k: bool| if k { 1.0 } else { 0.0 };
        Piece {
            number,
            width: curve.width(),
            words,
            counts: std::array::from_fn(|k| number_of(k < axes && flag(self.xyz, k) == linear)),
            turns: words.directed && !linear,
            way_scale: self.scale(),
            xyz: std::array::from_fn(|k| number_of(flag(self.xyz, k))),
            ijk: std::array::from_fn(|_| ijk.next().unwrap_or(0)),
            size: curve.magnitude(),
            slope_size: curve.derivative_size(),
            start_size: first.iter().fold(0.0, |most, x| most.max(x.abs())),
            curve,
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl<const M: usize> Piece<'_, M> {
    /// The axes of X, Y, Z whose motion the feed limits, 1 or 0.
    pub fn linear(&self) -> [f64; M] {
        times(&self.counts, &self.xyz)
    }

    fn direction(&self, of: &[f64; M]) -> [f64; 3] {
        self.ijk.map(|k| of[k])
    }

    /// Whether a joint is known up to whole turns only.
    pub fn turning(&self, joint: usize) -> bool {
        self.words.turning.get(joint).copied().unwrap_or(false)
    }

    /// C'(u) along the axes whose motion the feed limits.
    fn counted_slope(&self, u: f64) -> [f64; M] {
        times(&self.counts, &self.curve.derivative(u))
    }

    /// Curvature of the path in the axes whose motion the feed limits, if X, Y, Z are among these.
    pub fn curvature(&self, u: f64) -> f64 {
        self.curvature_by(&self.curve.derivatives(u))
    }

    fn curvature_by(&self, [tangent, bend, _]: &[[f64; M]; 3]) -> f64 {
        if self.linear() == [0.0; M] {
            return 0.0;
        }
        curvature(&times(&self.counts, tangent), &times(&self.counts, bend))
    }

    /// Derivative by u of the way that the feed limits.
    pub fn feed_slope(&self, u: f64) -> f64 {
        if self.turns {
            self.feed_slope_of(&self.curve.at(u), &self.curve.derivative(u))
        } else {
            length(&self.counted_slope(u))
        }
    }

    fn feed_slope_of(&self, tip: &[f64; M], slope: &[f64; M]) -> f64 {
        if !self.turns {
            return length(&times(&self.counts, slope));
        }
        let direction = self.direction(tip);
        let across = length(&cross(direction, self.direction(slope)));
        (across / direction.iter().map(|x| x * x).sum::<f64>()).to_degrees()
    }

    /// The way that the feed limits, straight from one point of the piece to another.
    pub fn feed_way(&self, start: &[f64; M], end: &[f64; M]) -> f64 {
        if !self.turns {
            let way: [f64; M] = std::array::from_fn(|k| self.counts[k] * (end[k] - start[k]));
            return length(&way);
        }
        let (first, last) = (self.direction(start), self.direction(end));
        let across = length(&cross(first, last));
        across.atan2((0..3).map(|k| first[k] * last[k]).sum()).to_degrees()
    }

    fn fill<const N: usize, const ROUNDED: bool>(
        &self,
        table: &mut [Jet<N, ROUNDED>],
        jet: impl Fn(usize) -> Jet<N, ROUNDED>,
    ) {
        for (entry, column) in table.iter_mut().zip(&self.words.column) {
            *entry = column.map_or(Jet::constant(0.0), &jet);
        }
        self.words.formula.evaluate(table);
    }

    fn joint_rows<const N: usize, const ROUNDED: bool>(
        &self,
        table: &[Jet<N, ROUNDED>],
        order: usize,
    ) -> Rounded<M> {
        let (mut value, mut error) = ([0.0; M], [0.0; M]);
        for (joint, &place) in self.words.formula.outputs.iter().enumerate() {
            let jet = &table[place];
            (value[joint], error[joint]) = (jet.value[order], EPS * jet.error[order]);
            // At a singular place nothing is known of a derivative.
            if order > 0 && !(value[joint] + error[joint]).is_finite() {
                (value[joint], error[joint]) = (0.0, f64::INFINITY);
            }
        }
        Rounded { value, rounding: error }
    }

    /// Positions of the joints, angles as the kinematics gives them.
    pub fn at(&self, u: f64, work: &mut Work) -> [f64; M] {
        let tip = self.curve.at(u);
        self.fill(&mut work.positions, |k| Jet { value: [tip[k]], error: [0.0] });
        self.joint_rows(&work.positions, 0).value
    }

    /// Positions and slopes of the joints at u.
    pub fn position_and_slope(&self, u: f64, work: &mut Work) -> [[f64; M]; 2] {
        let [tip, slope] = self.curve.place(u);
        self.fill(&mut work.slopes, |k| Jet { value: [tip[k], slope[k]], error: [0.0; 2] });
        [0, 1].map(|order| self.joint_rows(&work.slopes, order).value)
    }

    /// The place at u.
    pub fn place(&self, u: f64, work: &mut Work) -> Place<M> {
        let (tip, slope) = (self.curve.at(u), self.curve.derivative(u));
        self.fill(&mut work.rounded_slopes, |k| Jet {
            value: [tip[k], slope[k]],
            error: [TIP_ROUNDINGS * self.size, TIP_ROUNDINGS * self.slope_size[k]],
        });
        let joints = [0, 1].map(|order| self.joint_rows(&work.rounded_slopes, order));
        self.place_of(u, tip, slope, joints)
    }

    fn place_of(&self, u: f64, tip: [f64; M], tip_slope: [f64; M], joints: [Rounded<M>; 2]) -> Place<M> {
        let [position, slope] = joints;
        let (way_slope, feed_slope) =
            (length(&times(&self.way_scale, &tip_slope)), self.feed_slope_of(&tip, &tip_slope));
        Place { piece: self.number, u, tip, position, slope, way_slope, tip_slope: feed_slope }
    }

    /// The first three derivatives of the joints by the length of the way at u.
    pub fn station(&self, u: f64, work: &mut Work) -> Station<M> {
        let (tip, slopes) = (self.curve.at(u), self.curve.derivatives(u));
        let bends = self.bends(&mut work.bends, &tip, &slopes);
        self.station_of(u, &tip, &slopes, &bends)
    }

    /// The same with the place, and what of it may be rounding.
    pub fn rounded_station(&self, u: f64, work: &mut Work) -> (Place<M>, Station<M>, Roundings<M>) {
        let (tip, slopes) = (self.curve.at(u), self.curve.derivatives(u));
        let bends = self.bends(&mut work.rounded_bends, &tip, &slopes);
        let ([position, q1, q2, q3], way) = &bends;
        let way = std::array::from_fn(|order| (way.value[order], EPS * way.error[order]));
        (
            self.place_of(u, tip, slopes[0], [*position, *q1]),
            self.station_of(u, &tip, &slopes, &bends),
            Roundings::of_joints([q1, q2, q3], way),
        )
    }

    fn station_of<const ROUNDED: bool>(
        &self,
        u: f64,
        tip: &[f64; M],
        slopes: &[[f64; M]; 3],
        ([_, q1, q2, q3], way): &Bends<M, ROUNDED>,
    ) -> Station<M> {
        let tool = [self.feed_slope_of(tip, &slopes[0]) / way.value[0], self.curvature_by(slopes)];
        Station::of_joints(u, [&q1.value, &q2.value, &q3.value], way.value, tool)
    }

    /// Positions of the joints and their first three derivatives by u, and |C'| with two of its own.
    fn bends<const ROUNDED: bool>(
        &self,
        table: &mut [Jet<4, ROUNDED>],
        tip: &[f64; M],
        slopes: &[[f64; M]; 3],
    ) -> Bends<M, ROUNDED> {
        let (size, sizes) = match ROUNDED {
            true => (self.size, *self.curve.derivative_sizes()),
            false => (0.0, [[0.0; M]; 3]),
        };
        self.fill(table, |k| {
            let term = |order: usize| match order {
                0 => (tip[k], size),
                order => (slopes[order - 1][k], sizes[order - 1][k]),
            };
            Jet {
                value: std::array::from_fn(|order| term(order).0),
                error: std::array::from_fn(|order| TIP_ROUNDINGS * term(order).1),
            }
        });
        // |C'|² by its axes.
        let mut square = Jet::<3, ROUNDED>::constant(0.0);
        for k in (0..M).filter(|&k| self.way_scale[k] != 0.0) {
            let scale = self.way_scale[k];
            let axis = Jet::<3, ROUNDED> {
                value: std::array::from_fn(|order| scale * slopes[order][k]),
                error: std::array::from_fn(|order| TIP_ROUNDINGS * scale * sizes[order][k]),
            };
            let own = axis.times(&axis);
            for order in 0..3 {
                square.value[order] += own.value[order];
                if ROUNDED {
                    square.error[order] += own.error[order] + own.value[order].abs();
                }
            }
        }
        ([0, 1, 2, 3].map(|order| self.joint_rows(table, order)), square.root())
    }

    /// From one position to another, both of this piece, or the first of an `other` one: joints known up to whole turns on one
    /// of them turn by the smaller angle.
    pub fn between(&self, before: &[f64; M], after: &[f64; M], other: Option<&Piece<M>>) -> [f64; M] {
        std::array::from_fn(|k| {
            let way = after[k] - before[k];
            if self.turning(k) || other.is_some_and(|other| other.turning(k)) {
                way - TURN * (way / TURN).round()
            } else {
                way
            }
        })
    }

    /// The greatest coordinate of the first control point.
    pub fn start_size(&self) -> f64 {
        self.start_size
    }
}
