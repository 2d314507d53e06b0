//! The motion on a phase whose p = u̇² is known by the parameter u: velocities of all columns and times, each with a bound of
//! its error.
//!
//! | law | what it says |
//! |---|---|
//! | acceleration of column k | v_k² = v_k(anchor)² + 2 a Δq_k, u̇ = v_k / q'_k |
//! | velocity of column k | v_k constant, u̇ = v_k / q'_k |
//! | parameter acceleration | p = p(anchor) + 2 s Δu |
//! | feed with axis shares, speed line | v² linear in u, u̇ = v over the derivative by u of the length in these shares |
//!
//! The anchor of a phase is its slower end: counted from there both terms have one sign, so no digits cancel. At a constant
//! acceleration of column k the time for Δq_k is 2 Δq_k over the sum of its speeds at both ends. Where p is linear in u the
//! time for Δu is 2 Δu over the sum of √p. Where v² is linear in u the derivative of the length by u is integrated over the
//! variable in which v is linear.

use super::columns::Columns;
use super::phases::{Phases, AXIS_ACCELERATION, AXIS_VELOCITY, FEED, PARAMETER_ACCELERATION, SPEED_LINE};
use super::quadrature::{integral, MOST_HALVINGS};
use super::station::{Place, Rounded};
use super::vectors::{from_to, length, vector_of};
use super::{EPS, ROUNDINGS};

/// Relative rounding of a speed or time after a few operations.
pub const ROUNDING: f64 = 2.0 * ROUNDINGS * EPS;

/// If the relative error of a speed is above this, the speed is taken from the recorded p at the ends of the phase.
pub const HIDDEN: f64 = 1e-3;

/// Half the interval in u over which the acceleration near a place is taken: inside the phase as a part of its width, near a turn
/// as a part of the distance to it, and at the ends of the phase as a part of its width.
const NEAR: f64 = 5e-4;
const OF_TURN: f64 = 0.01;
const AT_END: f64 = 1e-6;

#[derive(Clone, Copy, Debug)]
enum Law {
    /// The square of the velocity of column k at the anchor with its error, and 2 a.
    Column { k: usize, start_sq: f64, error: f64, twice: f64 },
    /// dp/du.
    Parameter { slope: f64 },
    /// v² at both ends of the phase.
    Speed { speed_sq: [f64; 2] },
}

/// A phase ready to be evaluated at any u.
#[derive(Clone, Copy, Debug)]
pub struct PhaseMotion<const M: usize> {
    law: Law,
    u: [f64; 2],
    /// Recorded p at both ends.
    p: [f64; 2],
    /// Width of its piece.
    whole: f64,
    pub anchored_at_end: bool,
    anchor: State<M>,
    /// The factor of each path axis in the speed that is held.
    share: [f64; M],
}

/// The motion at a place.
#[derive(Clone, Copy, Debug)]
pub struct State<const M: usize> {
    pub place: Place<M>,
    /// u̇, and its relative error.
    pub root_p: f64,
    pub doubt: f64,
    /// The speed that the law determines, and its error, in mm/s.
    speed: [f64; 2],
    pub velocity: Rounded<M>,
}

impl<const M: usize> State<M> {
    /// From u̇ = √p and its relative error.
    pub fn new(place: Place<M>, root_p: f64, doubt: f64) -> Self {
        let value: [f64; M] = vector_of(|k| place.slope.value[k] * root_p);
        let of = |k: usize| if value[k] == 0.0 { 0.0 } else { value[k].abs() * (doubt + ROUNDING) };
        // At rest the velocity is 0, also where nothing is known of a slope.
        let by_slope = |k: usize| if root_p == 0.0 { 0.0 } else { place.slope.rounding[k] * root_p };
        let rounding = vector_of(|k| by_slope(k) + of(k));
        Self { place, root_p, doubt, speed: [0.0; 2], velocity: Rounded { value, rounding } }
    }

    /// The speed of the tool that feeds limit, and its error, in mm/s.
    pub fn tip(&self) -> [f64; 2] {
        let speed = self.place.tip_slope * self.root_p;
        [speed, speed * (self.doubt + ROUNDING)]
    }
}

impl<const M: usize> PhaseMotion<M> {
    /// Phase `i`, whose numbers must be usable (`Phases::have_good_numbers`).
    pub fn new(phases: &Phases, i: usize, columns: &mut Columns<M>) -> Self {
        let (piece, kind, k) = (phases.piece[i] as usize, phases.kind[i], phases.axis[i] as usize);
        let (u, p, value) = ([phases.u0[i], phases.u1[i]], [phases.p0[i], phases.p1[i]], phases.value[i]);
        let share = if kind == FEED { phases.counted(i) } else { [1.0; M] };
        let ends = u.map(|u| columns.place(piece, u));
        let by_slope = |end: usize, slope: f64| slope * slope * p[end];
        let speed_sq: [f64; 2] = match kind {
            AXIS_ACCELERATION | AXIS_VELOCITY => [0, 1].map(|end| by_slope(end, ends[end].slope.value[k])),
            PARAMETER_ACCELERATION => p,
            _ => [0, 1].map(|end| by_slope(end, columns.held_slope(piece, u[end], &share)[0])),
        };
        let is_free = matches!(kind, AXIS_ACCELERATION | PARAMETER_ACCELERATION | SPEED_LINE);
        let anchored_at_end = is_free && (speed_sq[1] < speed_sq[0] || !speed_sq[0].is_finite());
        let side = usize::from(anchored_at_end);
        let (place, root_p) = (ends[side], p[side].sqrt());
        let law = match kind {
            AXIS_ACCELERATION => {
                let (start_sq, twice) = (speed_sq[side], 2.0 * value);
                Law::Column {
                    k,
                    start_sq,
                    error: 2.0 * start_sq.sqrt() * place.slope.rounding[k] * root_p,
                    twice,
                }
            }
            AXIS_VELOCITY => Law::Column { k, start_sq: value, error: 0.0, twice: 0.0 },
            PARAMETER_ACCELERATION => Law::Parameter { slope: 2.0 * value },
            SPEED_LINE => Law::Speed { speed_sq },
            _ => Law::Speed { speed_sq: [value; 2] },
        };
        let whole = columns.path.width[piece];
        let anchor = State::new(place, root_p, ROUNDING);
        let mut motion = Self { law, u, p, whole, anchored_at_end, anchor, share };
        let by_law = motion.state(place, columns);
        // At the anchor a phase at constant axis acceleration keeps its recorded p: if the column is at rest there, the law does
        // not give p.
        motion.anchor =
            if kind == AXIS_ACCELERATION { State { speed: by_law.speed, ..anchor } } else { by_law };
        motion
    }

    fn width(&self) -> f64 {
        self.u[1] - self.u[0]
    }

    /// Relative rounding error of a time or a displacement from the anchor: mostly that of the ends of the phase.
    fn rounding(&self) -> f64 {
        ROUNDING * (1.0 + self.whole / self.width())
    }

    /// √p at the anchor and at the other end, or 1 where both are 0.
    fn roots(&self) -> [f64; 2] {
        let mut roots = self.p.map(f64::sqrt);
        if self.anchored_at_end {
            roots.reverse();
        }
        if roots == [0.0; 2] {
            [1.0; 2]
        } else {
            roots
        }
    }

    /// u at a share y of the phase: y is 0 at the anchor, 1 at the other end, and √p is linear in y if p is linear in u.
    pub fn parameter(&self, y: f64) -> f64 {
        let [near, far] = self.roots();
        let share = y * (2.0 * near + (far - near) * y) / (near + far);
        match (self.anchored_at_end, y >= 1.0) {
            (false, true) => self.u[1],
            (true, true) => self.u[0],
            (false, _) => self.u[0] + self.width() * share,
            (true, _) => self.u[1] - self.width() * share,
        }
    }

    /// Inverse of `parameter`: y where this share of the width has been covered from the anchor.
    pub fn variable(&self, share: f64) -> f64 {
        let [near, far] = self.roots();
        let c = (near + far) * share;
        c / (near + (near * near + (far - near) * c).max(0.0).sqrt())
    }

    /// The motion at u.
    pub fn at(&self, u: f64, columns: &mut Columns<M>) -> State<M> {
        if u == self.anchor.place.u {
            return self.anchor;
        }
        let place = columns.place(self.anchor.place.piece, u);
        self.state(place, columns)
    }

    fn state(&self, place: Place<M>, columns: &mut Columns<M>) -> State<M> {
        match self.law {
            Law::Column { k, start_sq, error, twice } => {
                let (mut speed_sq, mut error_sq) = (start_sq, 0.0);
                if twice != 0.0 {
                    let way = columns.way(&self.anchor.place, &place);
                    let gained = twice * way.value[k];
                    speed_sq += gained;
                    error_sq = error + twice.abs() * way.rounding[k] + self.rounding() * gained.abs();
                }
                if -error_sq <= speed_sq && speed_sq < 0.0 {
                    speed_sq = 0.0;
                }
                let speed = speed_sq.sqrt();
                let hidden = if error_sq > 0.0 { error_sq / (speed + error_sq.sqrt()) } else { 0.0 };
                let (slope, unknown) = (place.slope.value[k], hidden + ROUNDING * speed);
                let [root_p, doubt] = self.known(
                    place.u,
                    [speed / slope.abs(), unknown / speed + place.slope.rounding[k] / slope.abs()],
                );
                let mut state = State::new(place, root_p, doubt);
                state.speed = [speed, unknown];
                // The law gives this velocity more accurately than the slope does.
                let sign = if slope == 0.0 { 0.0 } else { slope.signum() };
                (state.velocity.value[k], state.velocity.rounding[k]) = (sign * speed, unknown);
                state
            }
            Law::Parameter { slope } => {
                let start = self.anchor.root_p * self.anchor.root_p;
                let p = start + slope * (place.u - self.anchor.place.u);
                let gained = (1.0 - start / p).max(0.0);
                State::new(place, p.sqrt(), ROUNDING + 0.5 * gained * self.rounding())
            }
            Law::Speed { .. } => {
                let [slope, error] = columns.held_slope(place.piece, place.u, &self.share);
                let speed = self.held(place.u);
                let mut state = State::new(place, speed / slope, ROUNDING + error / slope);
                state.speed = [speed, ROUNDING * speed];
                state
            }
        }
    }

    /// The speed at u by a law that holds v² or makes it linear in u.
    fn held(&self, u: f64) -> f64 {
        let Law::Speed { speed_sq: [from, to] } = self.law else { return f64::NAN };
        let share = ((u - self.u[0]) / self.width()).clamp(0.0, 1.0);
        (from + (to - from) * share).sqrt()
    }

    /// √p and its relative error. Where rounding hides the velocity of the column, p is interpolated between the recorded ends
    /// of the phase, if it is nearly constant.
    fn known(&self, u: f64, by_law: [f64; 2]) -> [f64; 2] {
        let [from, to] = self.p;
        let other = 0.5 * (to - from).abs() / from.max(to) + ROUNDING;
        if by_law[1] <= HIDDEN || other.is_nan() || other >= HIDDEN {
            return by_law;
        }
        [(from + (to - from) * ((u - self.u[0]) / self.width())).sqrt(), other]
    }

    /// The time between two states in s, and its relative error.
    pub fn time(&self, [a, b]: [&State<M>; 2], columns: &mut Columns<M>) -> [f64; 2] {
        let step = (b.place.u - a.place.u).abs();
        if step == 0.0 {
            return [0.0; 2];
        }
        let (rounding, both) = (self.rounding(), a.root_p + b.root_p);
        match self.law {
            Law::Column { k, twice, .. } => {
                let way = columns.way(&a.place, &b.place);
                let errors = a.speed[1] + b.speed[1];
                let (mut sum, mut change) = (a.speed[0] + b.speed[0], (b.speed[0] - a.speed[0]).abs());
                // If the phase begins at a turn of the column, rounding may put the turn behind its first place: the velocities
                // at both states then have opposite signs.
                if a.place.slope.value[k] * b.place.slope.value[k] < 0.0 {
                    (sum, change) = (change, sum);
                }
                let by_way = way.value[k].abs();
                let mut found = [2.0 * by_way / sum, rounding + way.rounding[k] / by_way + errors / sum];
                // The change of velocity over the acceleration, if that has the smaller error.
                if twice != 0.0 && errors / change < found[1] {
                    found = [2.0 * change / twice.abs(), errors / change];
                }
                // Where the displacement is mostly rounding: the step of the parameter over the mean √p.
                let uneven = rounding + (b.root_p - a.root_p).abs() / both + 0.5 * (a.doubt + b.doubt);
                if found[1].is_nan() || (found[1] > HIDDEN && uneven < found[1]) {
                    found = [2.0 * step / both, uneven];
                }
                found
            }
            Law::Parameter { .. } => [2.0 * step / both, rounding],
            Law::Speed { .. } => {
                let [near, far] = [a, b].map(|state| self.held(state.place.u));
                let (u, way) = (a.place.u, b.place.u - a.place.u);
                let place = |y: f64| u + way * y * (2.0 * near + (far - near) * y) / (near + far);
                let mut slopes = |y: [f64; 8]| columns.held_slopes(a.place.piece, y.map(place), &self.share);
                let whole = integral(&mut slopes, 0.0, 1.0, &mut { MOST_HALVINGS });
                [2.0 * step / (near + far) * whole, rounding]
            }
        }
    }

    /// Time since the start of the phase, and its error, in s. The phase takes `duration`.
    pub fn since(&self, here: &State<M>, duration: f64, columns: &mut Columns<M>) -> [f64; 2] {
        let [time, doubt] = self.time([&self.anchor, here], columns);
        [if self.anchored_at_end { duration - time } else { time }, time * doubt]
    }

    /// Accelerations near u, as difference quotients over a small part of the phase; over a smaller one where p changes fast.
    pub fn acceleration_near(&self, u: f64, columns: &mut Columns<M>) -> Rounded<M> {
        let beside = (u - self.u[0]).min(self.u[1] - u);
        let half = f64::min(NEAR * self.width(), OF_TURN * self.way_to_turn(u, columns));
        let half = half.min(beside.max(AT_END * self.width()));
        let [from, to] = [(u - half).max(self.u[0]), (u + half).min(self.u[1])].map(|u| self.at(u, columns));
        let [time, doubt] = self.time([&from, &to], columns);
        let change = from_to(&from.velocity.value, &to.velocity.value);
        Rounded {
            value: vector_of(|k| change[k] / time),
            rounding: vector_of(|k| {
                (from.velocity.rounding[k] + to.velocity.rounding[k] + change[k].abs() * doubt) / time
            }),
        }
    }

    /// Estimates the distance in u to where the column of the law turns round, or to where C' vanishes if the law is about the
    /// speed along the path: p changes fast there.
    fn way_to_turn(&self, u: f64, columns: &mut Columns<M>) -> f64 {
        let inwards = if u < 0.5 * (self.u[0] + self.u[1]) { AT_END } else { -AT_END };
        let step = inwards * self.width();
        let [here, there] = [u, u + step].map(|u| columns.place(self.anchor.place.piece, u).slope.value);
        let change = from_to(&here, &there);
        let share = match self.law {
            Law::Column { k, .. } => here[k] / change[k],
            Law::Parameter { .. } => f64::INFINITY,
            Law::Speed { .. } => length(&here) / length(&change),
        };
        (share * step).abs()
    }

    /// The column whose acceleration or velocity the law holds.
    pub fn held_column(&self) -> Option<usize> {
        match self.law {
            Law::Column { k, .. } => Some(k),
            _ => None,
        }
    }

    /// Whether accelerations can have a maximum inside the phase: on slides, where an axis velocity is constant or v² is linear
    /// in u.
    pub fn is_slide(&self) -> bool {
        match self.law {
            Law::Column { twice, .. } => twice == 0.0,
            Law::Parameter { .. } => false,
            Law::Speed { .. } => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{Curve, Followed, Pieces};
    use crate::polygon::Polygon;
    use crate::Limits;

    /// A phase on a piece in X and Y, and the columns of its path.
    struct Phase<'a> {
        columns: Columns<'a, 2>,
        motion: PhaseMotion<2>,
        u: [f64; 2],
    }

    impl Phase<'_> {
        /// Calls `check` with a phase of this kind, axis and value between two u with these p, on a piece.
        fn check(
            (kind, axis, value): (u8, u8, f64),
            [u, p]: [[f64; 2]; 2],
            (points, weights, width): (&[[f64; 2]], &[f64], f64),
            check: impl FnOnce(&mut Phase),
        ) {
            let (control, offsets, width) = (points.concat(), [0, points.len()], [width]);
            let pieces =
                Pieces { axes: 2, stride: 2, control: &control, weights, offsets: &offsets, width: &width };
            let path = Followed::of_one(pieces);
            let (kind, axis, value) = ([kind], [axis], [value]);
            let phases = Phases::of_one(&kind, &axis, &value, &u, &p);
            let limits = Limits::none();
            let mut columns = Columns::new(&path, &limits, None);
            let motion = PhaseMotion::new(&phases, 0, &mut columns);
            check(&mut Phase { columns, motion, u });
        }

        fn at(&mut self, u: f64) -> State<2> {
            self.motion.at(u, &mut self.columns)
        }

        fn time(&mut self, from: f64, to: f64) -> f64 {
            let [a, b] = [from, to].map(|u| self.at(u));
            self.motion.time([&a, &b], &mut self.columns)[0]
        }

        fn total(&mut self) -> f64 {
            let [from, to] = self.u;
            self.time(from, to)
        }
    }

    type Piece = (&'static [[f64; 2]], &'static [f64], f64);

    const LINE: Piece = (&[[0.0, 0.0], [4.0, 3.0], [8.0, 6.0]], &[], 10.0);

    #[test]
    fn from_rest_along_a_line_takes_the_schoolbook_time() {
        // X at 8 mm/s² over 8 mm: t = √(2 · 8 / 8).
        Phase::check((0, 0, 8.0), [[0.0, 10.0], [0.0, 200.0]], LINE, |phase| {
            assert!((phase.total() - 2.0_f64.sqrt()).abs() < 1e-14);
            assert!((phase.at(10.0).velocity.value[0] - 128.0_f64.sqrt()).abs() < 1e-13);
            assert!((phase.time(0.0, 2.5) - 0.5 * 2.0_f64.sqrt()).abs() < 1e-14);
            assert_eq!([0.0, 1.0].map(|y| phase.motion.parameter(y)), [0.0, 10.0]);
            assert!((phase.motion.parameter(0.5) - 2.5).abs() < 1e-14);
            assert!((phase.motion.variable(0.25) - 0.5).abs() < 1e-14);
        });
        Phase::check((0, 0, -8.0), [[0.0, 10.0], [200.0, 0.0]], LINE, |phase| {
            assert!(phase.motion.anchored_at_end);
            assert!((phase.total() - 2.0_f64.sqrt()).abs() < 1e-14);
        });
    }

    #[test]
    fn a_turn_behind_the_first_place_takes_the_time_there_and_back() {
        // x = 2tu − u² turns at t = 1e-6; at −8 mm/s² p is 4 all the way.
        let rows = [[0.0, 0.0], [1e-6, 0.5], [2e-6 - 1.0, 1.0]];
        Phase::check((0, 0, -8.0), [[0.0, 1.0], [4.0, 4.0]], (&rows, &[], 1.0), |phase| {
            for to in [1.5e-6, 4e-6, 1e-3, 1.0] {
                assert!((phase.time(0.0, to) / (0.5 * to) - 1.0).abs() < 1e-9, "{to}");
            }
        });
    }

    #[test]
    fn an_axis_at_constant_acceleration_takes_its_change_of_velocity_over_it() {
        // A bend from 45 degrees to nearly straight up, as a parabola and as the same piece of degree 3: q'_x falls by a factor of 100.
        const ROWS: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 1.0], [1.01, 2.0]];
        const CUBIC: [[f64; 2]; 4] =
            [[0.0, 0.0], [2.0 / 3.0, 2.0 / 3.0], [3.01 / 3.0, 4.0 / 3.0], [1.01, 2.0]];
        let curve = Curve::new(Polygon::new(ROWS.into_iter(), &[]), 2.0);
        let (g0, g1) = (curve.derivative(0.0)[0], curve.derivative(2.0)[0]);
        let (p0, value) = (9.0, 3.0);
        let p1 = (g0 * g0 * p0 + 2.0 * value * 1.01) / (g1 * g1);
        let exact = (g1 * p1.sqrt() - g0 * p0.sqrt()) / value;
        for rows in [&ROWS[..], &CUBIC] {
            Phase::check((0, 0, value), [[0.0, 2.0], [p0, p1]], (rows, &[], 2.0), |phase| {
                assert!((phase.total() / exact - 1.0).abs() < 1e-13);
                let velocity = phase.at(2.0).velocity;
                assert!((velocity.value[0] - g1 * p1.sqrt()).abs() < 1e-13);
                // The times of both halves are those of the whole.
                assert!((phase.time(0.0, 1.3) + phase.time(1.3, 2.0) - exact).abs() < 1e-13);
            });
        }
    }

    #[test]
    fn next_to_a_turn_of_its_axis_on_a_conic_the_acceleration_is_that_of_the_place() {
        // Y turns 6e-4 mm before the phase begins; the acceleration of X there by exact arithmetic.
        let points = [[3.33400833, -245.33330009], [4.66993226, -245.33369929], [5.18118385, -246.56792565]];
        let weights = [1.0, 0.831_556_127_752_042_9, 1.0];
        let p = [1000.311668347934, 1001.67845];
        let conic = (&points[..], &weights[..], 2.22179155091747);
        Phase::check((0, 1, -500.0), [[0.0, 1.47142088], p], conic, |phase| {
            let acceleration = phase.motion.acceleration_near(0.000787988, &mut phase.columns);
            assert!((acceleration.value[0] + 40.3678).abs() < 0.05, "{acceleration:?}");
            assert!((acceleration.value[1] + 500.0).abs() < 1e-3, "{acceleration:?}");
        });
    }

    #[test]
    fn a_slide_at_constant_speed_takes_length_over_speed() {
        // Along y = x²/2 from x = −1 to 1; from rest to 3 mm/s with v² linear in u it takes ∫ |C'| du / v.
        let parabola: Piece = (&[[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]], &[], 2.0);
        let arc_length = 2.0_f64.sqrt() + 1.0_f64.asinh();
        let p = [4.5; 2];
        Phase::check((2, 255, 9.0), [[0.0, 2.0], p], parabola, |phase| {
            assert!((phase.total() - arc_length / 3.0).abs() < 1e-11);
        });
        // u = 2 y², v = 3 y: the time is ∫ 4/3 √(1 + (2 y² − 1)²) dy.
        Phase::check((4, 255, 0.0), [[0.0, 2.0], [0.0, 4.5]], parabola, |phase| {
            let exact: f64 = (0..20_000)
                .map(|i| (f64::from(i) + 0.5) / 20_000.0)
                .map(|y| 4.0 / 3.0 * (1.0 + (2.0 * y * y - 1.0_f64).powi(2)).sqrt() / 20_000.0)
                .sum();
            assert!((phase.total() - exact).abs() < 1e-8, "{}", phase.total());
        });
    }
}
