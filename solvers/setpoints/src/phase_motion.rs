//! The motion on one phase of a speed profile: position, velocity, acceleration and jerk of every axis at a time or at a place,
//! computed from the law of the phase.
//!
//! All laws have one form: a measure m of the path has a known speed v = dm/dt, so p = u̇² = v²/m'(u)² with ' = d/du.
//!
//! | law | measure m | v |
//! |---|---|---|
//! | axis acceleration, axis velocity | displacement of axis k | linear in time |
//! | parameter acceleration | u | linear in time |
//! | feed | length that the feed counts | constant |
//! | speed line | length that the feed counts, without shares of axes | v² linear in u |
//! | path jerk | length of the path | quadratic in time |
//! | speed cubic | length of the path | v² cubic in m |
//!
//! `clock` computes v and the share of m that is done at a time; `axis_way` and `lengths` find the place at that share.
//! With a = v̇, j = ä and g = m': g u̇ = v, g ü = a − g' u̇², g u⃛ = j − 3 g' u̇ ü − g'' u̇³.
//! Then velocity is q' u̇, acceleration q' ü + q'' u̇², and jerk q' u⃛ + 3 q'' u̇ ü + q''' u̇³.
//!
//! These quotients are 0/0 at rest where m' vanishes, which happens only at the ends of a phase. Closer to such an end than
//! rounding allows, they are evaluated at a place a little farther off and extrapolated from there.
//!
//! `at_once` computes the motion at several times together, where v² is a cubic of the length.

pub mod at_once;
mod axis_way;
mod clock;
mod lengths;
mod pace;
mod part;
mod rate;

use std::rc::Rc;

use axis_way::AxisWay;
use clock::{Clock, Cubic, Even, Jerk, SpeedLine};
use feedplan_geometry::arc_length::Node;
use feedplan_geometry::inverse_length::Located;
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::speed::Coefficients;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::Phase;
use lengths::SLOW;
pub use lengths::{Counts, PiecePath};
use pace::Pace;
use part::Part;
pub use rate::{TipSpeed, MAX_TIP};

/// Allowed length error as a share of the step. 1e-6 would do for the length; four digits more keep rounding noise out of the
/// second difference quotients of the positions, which divide by the square of the period.
const STEP_ERROR: f64 = 1e-10;
/// Allowed length error as a share of the step where the jerk is limited, for the third difference quotients.
const JERK_STEP_ERROR: f64 = 1e-13;

/// Where an axis turns at an end of the phase, the quotients are evaluated at this distance from it, as a share of the phase. The
/// extrapolation error of ü is about its square; rounding errors grow by its inverse in ü, and by the square of that in u⃛.
const OFF_TURN: f64 = 3e-5;
/// This distance where C' vanishes at an end; the length grows at least with its square.
const OFF_CUSP: f64 = 1e-3;
/// Tangents of a straight line deviate from its direction by at most this share of the longest one (rounding).
const OFF_LINE: f64 = 1e-14;

/// Velocity, acceleration and jerk of every axis.
#[derive(Clone, Copy, Debug)]
pub struct Rates<const M: usize> {
    pub velocity: [f64; M],
    pub acceleration: [f64; M],
    pub jerk: [f64; M],
}

/// A place on the phase, and the motion of the measure there.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    pub u: f64,
    pub pace: Pace,
    /// Iterations of the inversion; 0 for closed forms.
    pub iterations: u32,
    /// Error bound of the place, as a share of the whole measure of the phase.
    pub error: f64,
}

/// The measure whose speed the law of a phase gives.
enum Measure {
    Parameter,
    Axis(Box<AxisWay>),
    /// The lengths up to both ends of the phase, and the length of the phase.
    Length {
        ends: [Node; 2],
        total: f64,
    },
}

/// A phase with everything that its evaluation needs.
pub struct PhaseMotion<'a, const M: usize> {
    path: Rc<PiecePath<'a, M>>,
    phase: Phase,
    measure: Measure,
    clock: Clock,
    /// The quotients are evaluated only between these u.
    safe: [f64; 2],
    /// The direction of travel, if the phase is straight and the quotients are 0/0 at an end.
    straight: Option<[f64; M]>,
}

impl<'a, const M: usize> PhaseMotion<'a, M> {
    /// Prepares a phase on its piece.
    pub fn new(path: Rc<PiecePath<'a, M>>, phase: &Phase) -> Self {
        let (u0, u1) = (phase.u0, phase.u1);
        let width = u1 - u0;
        let mean_pace = || (Measure::Parameter, Clock::Even(Even::constant(width / phase.duration)));
        let ends = match phase.law {
            PhaseLaw::Feed | PhaseLaw::PathJerk | PhaseLaw::SpeedCubic => {
                Some([u0, u1].map(|u| path.row(phase.law, u)))
            }
            _ => None,
        };
        let squares = match (phase.law, &ends) {
            (_, Some(ends)) => [ends[0].rate.powi(2), ends[1].rate.powi(2)],
            (PhaseLaw::SpeedLine, _) => path.end_squares(phase),
            _ => [1.0; 2],
        };
        let by_length = |clock: &dyn Fn(f64) -> Clock| {
            let ends = ends.expect("laws of the length have both");
            let total = ends[1].sum - ends[0].sum;
            (Measure::Length { ends, total }, clock(total))
        };
        let speeds = || phase.end_speeds(squares);
        let (measure, clock) = match phase.law {
            PhaseLaw::AxisAcceleration | PhaseLaw::AxisVelocity => match AxisWay::new(path.piece(), phase) {
                Some((way, even)) => (Measure::Axis(Box::new(way)), Clock::Even(even)),
                // As short as a rounding error: the axis shows no motion, so the speed is the mean over the duration.
                None => mean_pace(),
            },
            PhaseLaw::ParameterAcceleration if phase.p0 + phase.p1 > 0.0 => {
                let even = Even { v: [phase.p0.sqrt(), phase.p1.sqrt()], a: phase.value };
                (Measure::Parameter, Clock::Even(even))
            }
            PhaseLaw::ParameterAcceleration => mean_pace(),
            PhaseLaw::Feed => by_length(&|_| Clock::Even(Even::constant(phase.value.sqrt()))),
            PhaseLaw::SpeedLine => {
                let line = SpeedLine::new(&path, phase, speeds());
                (Measure::Parameter, Clock::Line(Box::new(line)))
            }
            PhaseLaw::PathJerk => by_length(&|_| Clock::Jerk(Jerk::new(phase, speeds()))),
            PhaseLaw::SpeedCubic => by_length(&|length| Clock::Cubic(Cubic::new(phase, speeds(), length))),
        };
        let mut motion = Self { path, phase: *phase, measure, clock, safe: [u0, u1], straight: None };
        let off = motion.off_ends(squares);
        if off != [0.0; 2] {
            motion.safe = [u0 + off[0], u1 - off[1]];
            motion.straight = motion.direction();
        }
        motion
    }

    /// Distance in u from both ends at which the quotients must be evaluated; `squares` are the squares of the length per u at
    /// the ends.
    fn off_ends(&self, squares: [f64; 2]) -> [f64; 2] {
        let Phase { law, u0, u1, .. } = self.phase;
        let of_length = || {
            let middle = match self.measure {
                Measure::Length { total, .. } => (total / (u1 - u0)).powi(2),
                _ => self.path.square(law, 0.5 * (u0 + u1)),
            };
            squares.map(|square| if square <= SLOW * middle { OFF_CUSP * (u1 - u0) } else { 0.0 })
        };
        match (&self.measure, &self.clock) {
            (Measure::Axis(way), _) => way.turns.map(|turns| if turns { OFF_TURN * (u1 - u0) } else { 0.0 }),
            (Measure::Parameter, Clock::Even(_)) => [0.0; 2],
            _ => of_length(),
        }
    }

    /// The common direction of all tangents on the phase, if they agree up to rounding and the measure is proportional to the
    /// displacement in that direction.
    fn direction(&self) -> Option<[f64; M]> {
        if self.path.is_tip(self.phase.law) && !matches!(self.measure, Measure::Axis(_)) {
            return None;
        }
        let piece = self.path.piece();
        let [from, to] = [self.phase.u0, self.phase.u1].map(|u| derivatives(piece, u)[0]);
        let way: [f64; M] = std::array::from_fn(|k| to[k] - from[k]);
        let direction = way.map(|x| x / norm(&way));
        let coefficients = Coefficients::new(piece);
        let rows = coefficients.hodograph();
        let longest = rows.iter().map(norm).fold(0.0, f64::max);
        let straight = rows.iter().all(|row| {
            let along = dot(row, &direction);
            (0..M).all(|k| (row[k] - along * direction[k]).abs() <= OFF_LINE * longest)
        });
        straight.then_some(direction)
    }

    /// The place `t` seconds after the start of the phase. Tolerances are shares of the step in one `period`.
    pub fn at_time(&self, t: f64, period: f64) -> State {
        let phase = &self.phase;
        // 0/0 on a phase without duration.
        let (done, left) = (t / phase.duration, (phase.duration - t) / phase.duration);
        if t <= 0.0 || done.is_nan() {
            return self.at(phase.u0);
        }
        if left <= 0.0 {
            return self.at(phase.u1);
        }
        let step = period / phase.duration;
        let (part, error) = match &self.clock {
            Clock::Even(even) => (even.part(self.counts_from_start(done), done, left), 0.0),
            Clock::Jerk(jerk) => (jerk.part(done, left), 0.0),
            Clock::Cubic(cubic) => cubic.part(done, left),
            Clock::Line(line) => {
                let found = line.place(&self.path, done, left, STEP_ERROR * step);
                return State { pace: self.pace_of_line(line, found.u, t), ..state_of(found) };
            }
        };
        let found = self.place(part, step);
        let pace = match &self.clock {
            Clock::Even(even) => even.pace(done, left, t),
            Clock::Jerk(jerk) => jerk.pace(done, left),
            Clock::Cubic(cubic) => cubic.pace(part, t),
            Clock::Line(_) => unreachable!("a speed line has returned"),
        };
        State { pace, error: found.miss + error, ..state_of(found) }
    }

    /// Whether the share of the measure is counted from the start: for the displacement of an axis the end with the smaller
    /// |q'_k| is used, for other measures the end that is nearer in time.
    fn counts_from_start(&self, done: f64) -> bool {
        match &self.measure {
            Measure::Axis(way) => way.from_start,
            _ => done <= 0.5,
        }
    }

    /// The place at a share of the measure; `step` is the period as a share of the duration.
    fn place(&self, part: Part, step: f64) -> Located {
        let Phase { law, u0, u1, .. } = self.phase;
        match &self.measure {
            Measure::Parameter => {
                let way = (u1 - u0) * part.share;
                let u = if part.from_start { u0 + way } else { u1 - way };
                Located { u: u.clamp(u0, u1), ..Located::default() }
            }
            Measure::Axis(way) => way.place(&self.phase, part),
            Measure::Length { ends, total } => {
                let way = if part.from_start { total * part.share } else { total * (1.0 - part.share) };
                let found = self.path.locate(law, ends[0].sum + way, self.step_error() * total * step, ends);
                Located { u: found.u.clamp(u0, u1), miss: found.miss / total, ..found }
            }
        }
    }

    /// The share of the measure at u, counted from the nearer end.
    fn part(&self, u: f64) -> Part {
        let Phase { law, u0, u1, .. } = self.phase;
        match &self.measure {
            Measure::Axis(way) => way.part(&self.phase, u),
            Measure::Length { ends, total } => {
                let share = (self.path.row(law, u).sum - ends[0].sum) / total;
                Part { from_start: true, share: share.clamp(0.0, 1.0) }.nearer_end()
            }
            Measure::Parameter if u - u0 <= u1 - u => Part { from_start: true, share: (u - u0) / (u1 - u0) },
            Measure::Parameter => Part { from_start: false, share: (u1 - u) / (u1 - u0) },
        }
    }

    /// The place with parameter u.
    pub fn at(&self, u: f64) -> State {
        let duration = self.phase.duration;
        let pace = match &self.clock {
            Clock::Even(even) => even.at_part(self.part(u), duration),
            Clock::Jerk(jerk) => jerk.at_part(self.part(u)),
            Clock::Cubic(cubic) => cubic.at_part(self.part(u), duration),
            Clock::Line(line) => self.pace_of_line(line, u, duration * line.done(&self.path, u)),
        };
        State { u, pace, ..State::default() }
    }

    /// v, a and j where v² is linear in u.
    fn pace_of_line(&self, line: &SpeedLine, u: f64, t: f64) -> Pace {
        let at = u.clamp(self.safe[0], self.safe[1]);
        let [g, dg, _] = self.path.slopes(self.phase.law, at, &derivatives(self.path.piece(), at));
        line.pace(u, at, g, dg, t)
    }

    /// Position, velocity, acceleration and jerk at a place.
    pub fn sample(&self, state: &State) -> ([f64; M], Rates<M>) {
        let q = derivatives(self.path.piece(), state.u);
        let Pace { v, a, j, .. } = state.pace;
        if let Some(direction) = &self.straight {
            // All axes move in proportion.
            let share = match &self.measure {
                Measure::Axis(way) => way.sign * direction[way.k],
                _ => self.path.share_of(self.phase.law, direction),
            };
            let along = |size: f64| direction.map(|x| x * size / share);
            let mut rates = Rates { velocity: along(v), acceleration: along(a), jerk: along(j) };
            self.set_own(&mut rates, &state.pace);
            return (q[0], rates);
        }
        let at = state.u.clamp(self.safe[0], self.safe[1]);
        let turns = at != state.u && matches!(self.measure, Measure::Axis(_));
        let there = if at == state.u { q } else { derivatives(self.path.piece(), at) };
        let near = if turns { self.at(at).pace } else { state.pace };
        let [g, dg, ddg] = match &self.measure {
            Measure::Parameter if !matches!(self.clock, Clock::Line(_)) => [1.0, 0.0, 0.0],
            Measure::Axis(way) => [1, 2, 3].map(|order: usize| way.sign * there[order][way.k]),
            _ => self.path.slopes(self.phase.law, at, &there),
        };
        let du = near.v / g;
        let ddu = (near.a - dg * du * du) / g;
        let dddu = (near.j - du * (3.0 * dg * ddu + ddg * du * du)) / g;
        let mut rates = if turns {
            // p is extrapolated by its derivatives 2 ü and 2 u⃛/u̇ by u; the derivatives of q are those at the place itself.
            let (off, ds) = (state.u - at, dddu / du);
            let root = (du * du + off * (2.0 * ddu + off * ds)).max(0.0).sqrt();
            rates_of(&q, root, ddu + off * ds, root * ds)
        } else {
            rates_of(&there, du, ddu, dddu)
        };
        self.set_own(&mut rates, &state.pace);
        (q[0], rates)
    }

    /// The axis that the law is about moves exactly by the law.
    fn set_own(&self, rates: &mut Rates<M>, pace: &Pace) {
        if let Measure::Axis(way) = &self.measure {
            rates.velocity[way.k] = way.sign * pace.v;
            rates.acceleration[way.k] = way.sign * pace.a;
            rates.jerk[way.k] = 0.0;
        }
    }

    /// Velocity, acceleration and jerk at a place.
    pub fn rates(&self, state: &State) -> Rates<M> {
        self.sample(state).1
    }

    /// Both ends of the phase.
    pub fn span(&self) -> (f64, f64) {
        (self.phase.u0, self.phase.u1)
    }

    /// Allowed length error, as a share of the step.
    pub fn step_error(&self) -> f64 {
        if self.phase.law.is_along() {
            JERK_STEP_ERROR
        } else {
            STEP_ERROR
        }
    }

    /// The piece of the phase with its tables of lengths.
    pub fn path(&self) -> &PiecePath<'a, M> {
        &self.path
    }
}

fn state_of(found: Located) -> State {
    State { u: found.u, iterations: found.iterations, error: found.miss, ..State::default() }
}

/// Velocity, acceleration and jerk from q and its derivatives by u, and from the time derivatives of u.
#[inline(always)]
fn rates_of<const M: usize>(q: &[[f64; M]; 4], du: f64, ddu: f64, dddu: f64) -> Rates<M> {
    let p = du * du;
    let mut rates = Rates { velocity: [0.0; M], acceleration: [0.0; M], jerk: [0.0; M] };
    for k in 0..M {
        rates.velocity[k] = q[1][k] * du;
        rates.acceleration[k] = q[1][k] * ddu + q[2][k] * p;
        rates.jerk[k] = q[1][k] * dddu + du * (3.0 * q[2][k] * ddu + q[3][k] * p);
    }
    rates
}

/// Why a phase with finite numbers cannot be followed; None if it can.
pub fn flaw<const M: usize>(path: &PiecePath<M>, phase: &Phase) -> Option<&'static str> {
    let speeds = || phase.end_speeds(path.end_squares(phase));
    match phase.law {
        PhaseLaw::PathJerk => Jerk::new(phase, speeds()).flaw(),
        PhaseLaw::SpeedCubic => Cubic::flaw(phase, speeds(), path.rough_length(phase)),
        _ => None,
    }
}
