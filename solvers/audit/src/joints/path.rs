//! Positions of the joints and their derivatives at places of the path of the tool's tip, by the formula of the kinematics.

use std::rc::Rc;

use fearless_simd::{dispatch, f64x8, Level, SimdBase};

use super::formula::{Argument, Formula, Jet, JET};
use crate::curve::{Curve, Followed};
use crate::number::{in_wide_vectors, inner, kept, Lanes, Number};
use crate::station::{Place, Rounded, Roundings, Station};
use crate::vectors::{curvature, length, times, vector_of};
use crate::{EPS, ROUNDINGS};

pub const TURN: f64 = 360.0;
/// An angle of 1 rad in degrees.
const DEGREE: f64 = 180.0 / std::f64::consts::PI;
/// Rounding error of a tip coordinate in the formula, in roundings of the greatest coordinate of its piece.
pub const TIP_ROUNDINGS: f64 = 2.0 * ROUNDINGS;

/// The kinematics of a run: how its axis words determine the joints.
pub struct Words {
    pub formula: Formula,
    /// Whether the angle of a joint is known up to whole turns only.
    pub turning: Vec<bool>,
    /// For each coordinate of the tip its axis of the path; None if the coordinate stays at 0.
    pub column: Vec<Option<usize>>,
    /// Whether the tip's coordinates end with a direction I, J, K.
    pub directed: bool,
}

/// The joints of a problem whose path is that of the tool's tip.
///
/// Some angles are known up to whole turns only: between two places that are compared such a joint is taken to turn by less than
/// half a turn.
pub struct JointPath<'a> {
    pub path: Followed<'a>,
    /// Number of joints.
    pub joints: usize,
    pub words: &'a [Words],
    /// Index of the words of each run.
    pub words_of: &'a [usize],
    /// Which axes of the path are X, Y, Z, and which are I, J, K.
    pub xyz: &'a [bool],
    pub ijk: &'a [bool],
    /// The factor of each path axis in the length of the path.
    pub way_scale: &'a [f64],
    /// Feed of each piece, in mm/s or degrees/s.
    pub feed: &'a [f64],
}

/// A piece ready to be evaluated.
pub struct Piece<'a, const M: usize> {
    pub number: usize,
    pub width: f64,
    pub curve: Rc<Curve<M>>,
    words: &'a Words,
    /// 1 for the axes whose motion the feed limits, else 0: X, Y, Z where these move, else the others.
    pub counts: [f64; M],
    /// Whether only the direction of the tool turns: then the feed limits its angular speed in degrees/s.
    turns: bool,
    /// The factor of each path axis in the length of the path.
    way_scale: [f64; M],
    xyz: [f64; M],
    ijk: [usize; 3],
    /// The magnitudes to which the roundings of the tip's coordinates and of their first three derivatives are relative.
    sizes: [[f64; M]; 4],
    start_size: f64,
}

/// Positions of the joints and their first three derivatives by u, and |C'| with its first two derivatives.
type Bends<const M: usize, const W: usize, T> = ([Rounded<M, T>; 4], Jet<3, W, T>);

#[cfg(test)]
impl Words {
    /// Radius and angle of X and Y, the angle in degrees and known up to whole turns only.
    pub fn polar() -> Self {
        let rows = [[8, 0, 0], [8, 1, 0], [2, 2, 3], [9, 4, 0], [12, 1, 0], [14, 6, 0]];
        let formula = Formula::new(2, &rows, &[0.0; 6], &[5, 7]).expect("a list in order");
        Self { formula, turning: vec![false, true], column: vec![Some(0), Some(1)], directed: false }
    }
}

#[cfg(test)]
impl<'a> JointPath<'a> {
    /// Two joints of a path of two axes that is one run; the second axis counts twice in its length.
    pub fn of_one(path: Followed<'a>, words: &'a Words, feed: &'a [f64]) -> Self {
        let (xyz, ijk, way_scale) = (&[true; 2], &[false; 2], &[1.0, 2.0]);
        Self {
            path,
            joints: 2,
            words: std::slice::from_ref(words),
            words_of: &[0],
            xyz,
            ijk,
            way_scale,
            feed,
        }
    }
}

impl JointPath<'_> {
    fn run_of(&self, piece: usize) -> usize {
        self.path.runs.partition_point(|&first| first <= piece as i64) - 1
    }

    /// The factor of each path axis in the length of the path.
    pub fn scale<const M: usize>(&self) -> [f64; M] {
        std::array::from_fn(|k| self.way_scale.get(k).copied().unwrap_or(0.0))
    }

    /// Memory for the results of any of the formulas, used again at every place.
    pub fn room<K: Copy>(&self, nothing: K) -> Vec<K> {
        let most = self.words.iter().map(|words| words.formula.places()).max().unwrap_or(0);
        vec![nothing; JET * most]
    }

    /// A piece ready to be evaluated.
    pub fn piece<const M: usize>(&self, number: usize) -> Piece<'_, M> {
        self.piece_on(number, Rc::new(self.path.curve::<M>(number)))
    }

    /// The piece, from its curve.
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
        let [first_size, second_size, third_size] = *curve.derivative_sizes();
        Piece {
            number,
            width: curve.width(),
            words,
            counts: std::array::from_fn(|k| number_of(k < axes && flag(self.xyz, k) == linear)),
            turns: words.directed && !linear,
            way_scale: self.scale(),
            xyz: std::array::from_fn(|k| number_of(flag(self.xyz, k))),
            ijk: std::array::from_fn(|_| ijk.next().unwrap_or(0)),
            sizes: [[curve.magnitude(); M], first_size, second_size, third_size],
            start_size: first.iter().fold(0.0, |most, x| most.max(x.abs())),
            curve,
        }
    }
}

#[inline(always)]
fn cross<T: Number>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector with each axis multiplied by its factor.
#[inline(always)]
fn counted<const M: usize, T: Number>(of: &[T; M], counts: &[f64; M]) -> [T; M] {
    let mut counted = *of;
    for k in 0..M {
        counted[k] = of[k] * counts[k];
    }
    counted
}

impl<const M: usize> Piece<'_, M> {
    /// 1 for X, Y, Z if the feed limits their motion, else 0.
    pub fn linear(&self) -> [f64; M] {
        times(&self.counts, &self.xyz)
    }

    #[inline(always)]
    fn direction<T: Number>(&self, of: &[T; M]) -> [T; 3] {
        let [i, j, k] = self.ijk;
        [of[i], of[j], of[k]]
    }

    /// 1 for the axes whose motion the feed limits, else 0; None where the feed limits an angular speed.
    pub fn fed_axes(&self) -> Option<[f64; M]> {
        (!self.turns).then_some(self.counts)
    }

    /// Whether a joint is known up to whole turns only.
    pub fn turning(&self, joint: usize) -> bool {
        self.words.turning.get(joint).copied().unwrap_or(false)
    }

    /// C'(u) along the axes whose motion the feed limits.
    fn counted_slope(&self, u: f64) -> [f64; M] {
        times(&self.counts, &self.curve.derivative(u))
    }

    /// Curvature in 1/mm of the path in the axes whose motion the feed limits; 0 if X, Y, Z are not among these.
    pub fn curvature(&self, u: f64) -> f64 {
        self.curvature_by(&self.curve.derivatives(u))
    }

    #[inline(always)]
    fn curvature_by<T: Number>(&self, [tangent, bend, _]: &[[T; M]; 3]) -> T {
        if self.linear() == [0.0; M] {
            return tangent[0].filled(0.0);
        }
        curvature(&counted(tangent, &self.counts), &counted(bend, &self.counts))
    }

    /// Derivative by u of the length (or angle in degrees) that the feed limits.
    pub fn feed_slope(&self, u: f64) -> f64 {
        if self.turns {
            self.feed_slope_of(&self.curve.at(u), &self.curve.derivative(u))
        } else {
            length(&self.counted_slope(u))
        }
    }

    #[inline(always)]
    fn feed_slope_of<T: Number>(&self, tip: &[T; M], slope: &[T; M]) -> T {
        if !self.turns {
            let slope = counted(slope, &self.counts);
            return inner(&slope, &slope).root();
        }
        let direction = self.direction(tip);
        let across = cross(direction, self.direction(slope));
        inner(&across, &across).root() / inner(&direction, &direction) * DEGREE
    }

    /// Straight distance of two points of the piece in the axes whose motion the feed limits, in mm; where the feed limits an
    /// angular speed, the angle between both directions in degrees.
    pub fn feed_way(&self, start: &[f64; M], end: &[f64; M]) -> f64 {
        if !self.turns {
            let way: [f64; M] = std::array::from_fn(|k| self.counts[k] * (end[k] - start[k]));
            return length(&way);
        }
        let (first, last) = (self.direction(start), self.direction(end));
        let across = length(&cross(first, last));
        across.atan2((0..3).map(|k| first[k] * last[k]).sum()).to_degrees()
    }

    /// Evaluates the formula into the table of results, from the position of the tip and its first derivatives; their rounding
    /// errors are relative to `sizes`.
    #[inline(always)]
    fn fill<const N: usize, const E: usize, T: Argument>(
        &self,
        table: &mut [T::Kept],
        tip: &[[T; M]; N],
        sizes: &[[T; M]; E],
    ) {
        let nothing = tip[0][0].filled(0.0);
        for (input, column) in self.words.column.iter().enumerate() {
            let mut jet = Jet { value: [nothing; N], error: [nothing; E] };
            if let Some(column) = *column {
                for order in 0..N {
                    jet.value[order] = tip[order][column];
                }
                for order in 0..E {
                    jet.error[order] = sizes[order][column] * TIP_ROUNDINGS;
                }
            }
            jet.keep(table, input);
        }
        T::evaluate::<N, E>(&self.words.formula, table);
    }

    /// Derivative `order` of all joints, 0 for positions, from the table of results; `like` only gives the type of number.
    #[inline(always)]
    fn joint_rows<const N: usize, const E: usize, T: Argument>(
        &self,
        table: &[T::Kept],
        order: usize,
        like: T,
    ) -> Rounded<M, T> {
        let nothing = like.filled(0.0);
        let (mut value, mut rounding) = ([nothing; M], [nothing; M]);
        for (joint, &place) in self.words.formula.outputs.iter().enumerate() {
            let jet = Jet::<N, E, T>::taken(like, table, place);
            value[joint] = jet.value[order];
            if E > 0 {
                rounding[joint] = jet.error[order] * EPS;
            }
            // At a singular place a derivative is not finite: it is unknown then.
            if order > 0 {
                let both = value[joint] + rounding[joint];
                value[joint] = value[joint].where_finite(both, 0.0);
                rounding[joint] = rounding[joint].where_finite(both, f64::INFINITY);
            }
        }
        Rounded { value, rounding }
    }

    /// Positions of the joints at eight places; angles are not continued over whole turns.
    pub fn at_each(&self, u: &Lanes, room: &mut [Lanes]) -> [Lanes; M] {
        let mut tips = [[0.0; 8]; M];
        if self.curve.polygon.is_rational() {
            for i in 0..8 {
                let tip = self.curve.at(u[i]);
                for k in 0..M {
                    tips[k][i] = tip[k];
                }
            }
        }
        dispatch!(Level::new(), simd => self.look_at_each(f64x8::from_slice(simd, u), &tips, room))
    }

    /// Positions of the joints for numbers of one type; on rational pieces the positions of the tip are given.
    #[inline(always)]
    fn look_at_each<T: Argument<Kept = Lanes>>(
        &self,
        u: T,
        tips: &[Lanes; M],
        room: &mut [Lanes],
    ) -> [Lanes; M] {
        let mut tip = [u; M];
        if self.curve.polygon.is_rational() {
            for k in 0..M {
                tip[k] = u.taken(&tips[k]);
            }
        } else {
            tip = self.curve.polynomial_point(u);
        }
        self.fill(room, &[tip], &[]);
        kept(self.joint_rows::<1, 0, T>(room, 0, u).value)
    }

    /// Positions of the joints and their derivatives by u, from those of the tip.
    #[inline(always)]
    pub fn position_and_slope<T: Argument>(&self, tip: &[[T; M]; 2], room: &mut [T::Kept]) -> [[T; M]; 2] {
        self.fill(room, tip, &[]);
        let like = tip[0][0];
        [self.joint_rows::<2, 0, T>(room, 0, like).value, self.joint_rows::<2, 0, T>(room, 1, like).value]
    }

    /// The place at u.
    pub fn place(&self, u: f64, room: &mut [f64]) -> Place<M> {
        self.place_by(u, &[self.curve.at(u), self.curve.derivative(u)], room)
    }

    /// The places at each u of a piece without weights.
    pub fn places(&self, u: &Lanes, room: &mut [Lanes]) -> Place<M, Lanes> {
        in_wide_vectors!(simd => self.look_at_places(f64x8::from_slice(simd, u), room))
    }

    #[inline(always)]
    fn look_at_places<T: Argument<Kept = Lanes>>(&self, u: T, room: &mut [Lanes]) -> Place<M, Lanes> {
        self.place_by(u, &self.curve.polynomial_place(u), room).kept()
    }

    /// The place, from the position and the slope of the tip.
    #[inline(always)]
    fn place_by<T: Argument>(&self, u: T, tip: &[[T; M]; 2], room: &mut [T::Kept]) -> Place<M, T> {
        let [point_sizes, slope_sizes, ..] = self.sizes_like(u);
        self.fill(room, tip, &[point_sizes, slope_sizes]);
        let joints = [self.joint_rows::<2, 2, T>(room, 0, u), self.joint_rows::<2, 2, T>(room, 1, u)];
        self.place_of(u, tip, joints)
    }

    #[inline(always)]
    fn place_of<T: Argument>(
        &self,
        u: T,
        [tip, tip_slope]: &[[T; M]; 2],
        joints: [Rounded<M, T>; 2],
    ) -> Place<M, T> {
        let ([position, slope], way) = (joints, counted(tip_slope, &self.way_scale));
        let (way_slope, feed_slope) = (inner(&way, &way).root(), self.feed_slope_of(tip, tip_slope));
        Place { piece: self.number, u, tip: *tip, position, slope, way_slope, tip_slope: feed_slope }
    }

    /// The station at u, with the derivatives of the joints by the length of the path, from the tip and its derivatives by u.
    #[inline(always)]
    pub fn station<T: Argument>(&self, u: T, tip: &[[T; M]; 4], room: &mut [T::Kept]) -> Station<M, T> {
        self.station_of(u, tip, &self.bends::<0, 0, T>(room, tip, &[]))
    }

    /// The place and the station at u, with bounds of the rounding errors.
    pub fn rounded_station(&self, u: f64, room: &mut [f64]) -> (Place<M>, Station<M>, Roundings<M>) {
        self.rounded_by(u, &self.curve.jet(u), &self.sizes, room)
    }

    /// Stations at several places of a piece without weights, with bounds of their rounding errors.
    #[inline(always)]
    pub fn rounded_stations<T: Argument<Kept = Lanes>>(
        &self,
        u: T,
        room: &mut [Lanes],
    ) -> (Station<M, T>, Roundings<M, T>) {
        let (_, station, roundings) =
            self.rounded_by(u, &self.curve.polynomial_jet(u), &self.sizes_like(u), room);
        (station, roundings)
    }

    /// A place and a station in each lane, with bounds of their rounding errors; each is on this piece or on one that `is_like`
    /// it.
    pub fn rounded_on_each(
        &self,
        on: [(&Self, f64); 8],
        room: &mut [Lanes],
    ) -> (Place<M, Lanes>, Station<M, Lanes>, Roundings<M, Lanes>) {
        let (mut tip, mut sizes) = ([[[0.0; 8]; M]; 4], [[[0.0; 8]; M]; 4]);
        for (lane, (piece, u)) in on.iter().enumerate() {
            let jet = piece.curve.jet(*u);
            for order in 0..4 {
                for k in 0..M {
                    tip[order][k][lane] = jet[order][k];
                    sizes[order][k][lane] = piece.sizes[order][k];
                }
            }
        }
        let u = on.map(|(_, u)| u);
        in_wide_vectors!(simd => self.look_on_each(f64x8::from_slice(simd, &u), &tip, &sizes, room))
    }

    #[inline(always)]
    fn look_on_each<T: Argument<Kept = Lanes>>(
        &self,
        u: T,
        tip: &[[Lanes; M]; 4],
        sizes: &[[Lanes; M]; 4],
        room: &mut [Lanes],
    ) -> (Place<M, Lanes>, Station<M, Lanes>, Roundings<M, Lanes>) {
        let (mut tips, mut of_tips) = ([[u; M]; 4], [[u; M]; 4]);
        for order in 0..4 {
            for k in 0..M {
                tips[order][k] = u.taken(&tip[order][k]);
                of_tips[order][k] = u.taken(&sizes[order][k]);
            }
        }
        let (place, station, roundings) = self.rounded_by(u, &tips, &of_tips, room);
        (place.kept(), station.kept(), roundings.kept())
    }

    /// Whether the joints and the feed are the same functions of the tool's path as on another piece.
    pub fn is_like(&self, other: &Self) -> bool {
        std::ptr::eq(self.words, other.words) && self.counts == other.counts && self.turns == other.turns
    }

    /// The magnitudes to which the roundings of the tip are relative, as numbers of the type of `like`.
    #[inline(always)]
    fn sizes_like<T: Number>(&self, like: T) -> [[T; M]; 4] {
        let mut sizes = [[like; M]; 4];
        for order in 0..4 {
            for k in 0..M {
                sizes[order][k] = like.filled(self.sizes[order][k]);
            }
        }
        sizes
    }

    #[inline(always)]
    fn rounded_by<T: Argument>(
        &self,
        u: T,
        tip: &[[T; M]; 4],
        sizes: &[[T; M]; 4],
        room: &mut [T::Kept],
    ) -> (Place<M, T>, Station<M, T>, Roundings<M, T>) {
        let bends = self.bends::<4, 3, T>(room, tip, sizes);
        let ([position, q1, ..], way) = &bends;
        (
            self.place_of(u, &[tip[0], tip[1]], [*position, *q1]),
            self.station_of(u, tip, &bends),
            Roundings::of_joints(&bends.0, way),
        )
    }

    #[inline(always)]
    fn station_of<const W: usize, T: Argument>(
        &self,
        u: T,
        [tip, slopes @ ..]: &[[T; M]; 4],
        ([_, q1, q2, q3], way): &Bends<M, W, T>,
    ) -> Station<M, T> {
        let tool = [self.feed_slope_of(tip, &slopes[0]) / way.value[0], self.curvature_by(slopes)];
        Station::of_joints(u, [&q1.value, &q2.value, &q3.value], way.value, tool)
    }

    /// Positions of the joints and their first three derivatives by u, and |C'| with its first two derivatives.
    #[inline(always)]
    fn bends<const E: usize, const W: usize, T: Argument>(
        &self,
        table: &mut [T::Kept],
        tip: &[[T; M]; 4],
        sizes: &[[T; M]; E],
    ) -> Bends<M, W, T> {
        self.fill(table, tip, sizes);
        let like = tip[0][0];
        // |C'|² as a sum over the axes.
        let mut square = Jet::<3, W, T>::constant(like.filled(0.0));
        for k in 0..M {
            let scale = self.way_scale[k];
            if scale == 0.0 {
                continue;
            }
            let mut axis = square;
            for order in 0..3 {
                axis.value[order] = tip[order + 1][k] * scale;
            }
            for order in 0..W {
                axis.error[order] = sizes[order + 1][k] * (TIP_ROUNDINGS * scale);
            }
            let own = axis.times(&axis);
            for order in 0..3 {
                square.value[order] = square.value[order] + own.value[order];
            }
            for order in 0..W {
                square.error[order] = square.error[order] + (own.error[order] + own.value[order].size());
            }
        }
        let joints = [
            self.joint_rows::<4, E, T>(table, 0, like),
            self.joint_rows::<4, E, T>(table, 1, like),
            self.joint_rows::<4, E, T>(table, 2, like),
            self.joint_rows::<4, E, T>(table, 3, like),
        ];
        (joints, square.root())
    }

    /// Displacement from one position to another one, both on this piece: joints known up to whole turns turn by the smaller
    /// angle.
    #[inline(always)]
    pub fn way<T: Number>(&self, before: &[T; M], after: &[T; M]) -> [T; M] {
        let mut way = *after;
        for k in 0..M {
            way[k] = after[k] - before[k];
            if self.turning(k) {
                way[k] = way[k] - (way[k] / way[k].filled(TURN)).rounded() * TURN;
            }
        }
        way
    }

    /// Displacement from a position on another piece to one on this piece: joints known up to whole turns on one of them turn by
    /// the smaller angle.
    pub fn way_from(&self, other: &Piece<M>, before: &[f64; M], after: &[f64; M]) -> [f64; M] {
        let way = self.way(before, after);
        let turns = |k: usize| other.turning(k) && !self.turning(k);
        vector_of(|k| if turns(k) { way[k] - TURN * (way[k] / TURN).round() } else { way[k] })
    }

    /// The greatest coordinate of the first control point, as an absolute value in mm.
    pub fn start_size(&self) -> f64 {
        self.start_size
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Pieces;
    use crate::number::are_vectors_wide;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn stations_on_several_pieces_at_once_have_the_same_numbers_as_alone(
            bends in prop::array::uniform6(-1.0..1.0_f64),
            shares in prop::array::uniform8(0.0..1.0_f64),
            is_rational: bool,
        ) {
            let control: Vec<f64> = (0..6).flat_map(|i| [-2.5 + f64::from(i), 2.0 + bends[i as usize]]).collect();
            let weights: &[f64] = if is_rational { &[1.0, 2.0, 1.5, 1.0, 0.7, 1.0] } else { &[] };
            let (offsets, width) = (&[0, 2, 6], &[1.0, 3.0]);
            let pieces = Pieces { axes: 2, stride: 2, control: &control, weights, offsets, width };
            let words = Words::polar();
            let path = Followed { runs: &[0, 2], ..Followed::of_one(pieces) };
            let joints = JointPath::of_one(path, &words, &[1.0; 2]);
            let (first, second) = (joints.piece::<2>(0), joints.piece::<2>(1));
            let (mut room, mut lanes) = (joints.room(0.0), joints.room([0.0; 8]));
            let mut on = shares.map(|share| (&second, 3.0 * share));
            (on[0], on[3]) = ((&first, shares[0]), (&first, shares[3]));
            prop_assert!(first.is_like(&second));
            if !are_vectors_wide() {
                return Ok(());
            }
            let (place, station, roundings) = first.rounded_on_each(on, &mut lanes);
            for (lane, (piece, u)) in on.into_iter().enumerate() {
                let alone = piece.rounded_station(u, &mut room);
                let place = Place { piece: piece.number, ..place.of_lane(lane) };
                let found = (place, station.of_lane(lane), roundings.of_lane(lane));
                // All digits, of numbers and of the bounds of their errors.
                prop_assert_eq!(format!("{found:?}"), format!("{alone:?}"));
                // A place that is asked for alone has the same numbers.
                prop_assert_eq!(format!("{:?}", piece.place(u, &mut room)), format!("{:?}", alone.0));
            }
        }

        #[test]
        fn places_that_are_looked_at_at_once_have_the_same_numbers_as_alone(
            bends in prop::array::uniform6(-1.0..1.0_f64),
            shares in prop::array::uniform8(0.0..1.0_f64),
            is_rational: bool,
        ) {
            let control: Vec<f64> = (0..6).flat_map(|i| [-2.5 + f64::from(i), 2.0 + bends[i as usize]]).collect();
            let weights: &[f64] = if is_rational { &[1.0, 2.0, 1.5, 1.0, 0.7, 1.0] } else { &[] };
            let pieces = Pieces { axes: 2, stride: 2, control: &control, weights, offsets: &[0, 6], width: &[5.0] };
            let words = Words::polar();
            let joints = JointPath::of_one(Followed::of_one(pieces), &words, &[1.0]);
            let (piece, u) = (joints.piece::<2>(0), shares.map(|share| 5.0 * share));
            let (mut room, mut lanes) = (joints.room(0.0), joints.room([0.0; 8]));
            let positions = piece.at_each(&u, &mut lanes);
            let is_at_once = !is_rational && are_vectors_wide();
            let places = is_at_once.then(|| piece.places(&u, &mut lanes));
            for (lane, &u) in u.iter().enumerate() {
                let alone = piece.place(u, &mut room);
                prop_assert_eq!(positions.map(|position| position[lane]), alone.position.value);
                if let Some(places) = &places {
                    // All digits, of numbers and of the bounds of their errors.
                    prop_assert_eq!(format!("{:?}", places.of_lane(lane)), format!("{alone:?}"));
                }
            }
        }
    }
}
