//! Motion along one arc of a speed profile: the place at a time, and velocity, acceleration and jerk there.
//!
//! Symbols: q' = C'(u), p = (du/dt)², s = d²u/dt² = p'/2 with ' = d/du. Then velocity is q'√p, acceleration
//! q's + q''p, and jerk √p (q's' + 3 q''s + q'''p). What stays constant on an arc gives p, s and s' at a place,
//! and the place at a time.
//!
//! `quadratic` has closed forms for pieces whose q'' is constant, `curve` is for pieces of any degree, polynomial
//! and rational, and for joints that the speed limits of the tool tip hold for; `axis` is the motion of one axis
//! at constant acceleration on those, `along` that of laws about the way, `rate` what is integrated there. `even` is the motion of the parameter at
//! constant acceleration, on pieces of both.

mod along;
mod axis;
mod curve;
mod even;
mod quadratic;
mod rate;

use along::Along;
pub use curve::flaw;
use curve::CurveMotion;
use feedplan_geometry::arc_length::{quadrature, tabulate};
use feedplan_geometry::arc_length::{Integrand, Node, Table};
use feedplan_geometry::inverse_length::{self, Located};
use feedplan_geometry::quadratic::Quadratic;
use feedplan_geometry::spline::Piece;
use feedplan_geometry::tolerance;
use feedplan_planner::phase_law::PhaseLaw;
use quadratic::QuadraticMotion;
pub use rate::{TipSpeed, MAX_TIP};

/// A step's length is met this closely, in parts of the step. 1e-6 would do for the length; four digits more
/// keep the second differences of the positions quiet, which divide by the period squared.
const STEP_ERROR: f64 = 1e-10;
/// The same on arcs whose jerk is limited, for the third differences.
const JERK_STEP_ERROR: f64 = 1e-13;

/// One arc of a profile: `value` is the constant of its kind, u0 < u1 local parameters, p at both ends, and on arcs of
/// limited jerk the acceleration along the path.
#[derive(Clone, Copy, Debug)]
pub struct ProfileArc {
    pub piece: u32,
    pub kind: PhaseLaw,
    pub axis: u8,
    pub value: f64,
    pub u0: f64,
    pub u1: f64,
    pub p0: f64,
    pub p1: f64,
    pub duration: f64,
    pub a0: f64,
    pub a1: f64,
}

/// Velocity, acceleration and jerk of every axis.
#[derive(Clone, Copy, Debug)]
pub struct Rates<const M: usize> {
    pub velocity: [f64; M],
    pub acceleration: [f64; M],
    pub jerk: [f64; M],
}

/// A place on the arc.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    pub u: f64,
    /// Speed and |q'_k| of the governing axis; unused by the other laws.
    v: f64,
    g: f64,
    /// The motion along the path, of laws about its way.
    along: Along,
    /// Rounds that an inversion took, 0 for closed forms.
    pub iterations: u32,
    /// Bound of its error in parts of the arc's whole integral.
    pub error: f64,
}

/// An arc with everything that its evaluation needs.
pub enum Motion<'a, const M: usize> {
    Quadratic(Box<QuadraticMotion<M>>),
    Curve(Box<CurveMotion<'a, M>>),
}

macro_rules! each {
    ($motion:expr, $inner:ident, $call:expr) => {
        match $motion {
            Motion::Quadratic($inner) => $call,
            Motion::Curve($inner) => $call,
        }
    };
}

impl<'a, const M: usize> Motion<'a, M> {
    /// Prepares an arc; `tip` is the speed that its law is about where it is not that of the piece, `share` what the axes
    /// count in the feed. `with_lengths` tabulates the length of the arc whatever its kind.
    pub fn new(
        piece: Piece<'a, M>,
        tip: Option<TipSpeed<'a>>,
        share: Option<&[f64; M]>,
        arc: &ProfileArc,
        with_lengths: bool,
    ) -> Self {
        let share = share.filter(|_| arc.kind == PhaseLaw::Feed);
        match Quadratic::from_piece(&piece) {
            Some(quadratic) if tip.is_none() && share.is_none() && !needs_curve(arc.kind) => {
                Self::Quadratic(Box::new(QuadraticMotion::new(&quadratic, arc, with_lengths)))
            }
            _ => Self::Curve(Box::new(CurveMotion::new(piece, tip, share, arc, with_lengths))),
        }
    }

    /// The place `t` seconds after the start of the arc. `period` is the step whose length is to be met.
    pub fn at_time(&self, t: f64, period: f64) -> State {
        each!(self, motion, motion.at_time(t, period))
    }

    /// The place with parameter u.
    pub fn at(&self, u: f64) -> State {
        each!(self, motion, motion.at(u))
    }

    /// Seconds from the start of the arc to a place.
    pub fn time(&self, state: &State) -> f64 {
        each!(self, motion, motion.time(state))
    }

    /// Position, and velocity, acceleration and jerk at a place.
    #[inline]
    pub fn sample(&self, state: &State) -> ([f64; M], Rates<M>) {
        each!(self, motion, motion.sample(state))
    }

    /// C at a place.
    pub fn point(&self, state: &State) -> [f64; M] {
        self.sample(state).0
    }

    /// Velocity, acceleration and jerk at a place.
    pub fn rates(&self, state: &State) -> Rates<M> {
        self.sample(state).1
    }

    /// Both ends of the arc.
    pub fn span(&self) -> (f64, f64) {
        each!(self, motion, (motion.arc.u0, motion.arc.u1))
    }

    /// How closely a step's length is to be met, in parts of the step.
    pub fn step_error(&self) -> f64 {
        if each!(self, motion, motion.arc.kind).is_along() {
            JERK_STEP_ERROR
        } else {
            STEP_ERROR
        }
    }

    /// No length is found more closely than this; `with_lengths` must have been asked for.
    pub fn length_rounding(&self) -> f64 {
        each!(self, motion, motion.lengths().rounding())
    }

    /// The proven error of the table of lengths.
    pub fn length_error(&self) -> f64 {
        each!(self, motion, motion.length_error)
    }

    /// The place a way along the path ahead of u, within `tolerance` mm, by Newton–Raphson.
    pub fn advance(&self, u: f64, step: f64, tolerance: f64) -> Located {
        each!(self, motion, {
            let table = motion.lengths();
            feedplan_geometry::newton::advance(&table, (u, table.integral(u)), step, tolerance).0
        })
    }
}

/// Whether the general form follows such an arc on quadratic pieces too.
fn needs_curve(kind: PhaseLaw) -> bool {
    kind == PhaseLaw::SpeedLine || kind.is_along()
}

/// Tabulates f from one end to another.
fn fill<F: Integrand>(f: F, ends: (f64, f64), nodes: &mut Vec<Node>) -> f64 {
    let estimate = quadrature(&f, ends.0, ends.1);
    tabulate(f, ends.0, ends.1, tolerance::TABLE * estimate, nodes)
}

/// The place where a part of the whole integral is done, which grows evenly with time.
fn invert<F: Integrand>(
    table: &Table<F>,
    table_error: f64,
    arc: &ProfileArc,
    done: f64,
    period: f64,
) -> State {
    let total = table.total();
    let tolerance = (STEP_ERROR * total * period / arc.duration).max(table.rounding());
    let located = inverse_length::locate(table, done * total, tolerance);
    let error = (located.miss + table_error) / total;
    State { u: located.u, iterations: located.iterations, error, ..State::default() }
}

/// The parts of the duration that are done and left, from the end that is nearer; None before the start and
/// beyond the end, which come as Err with the parameter there. 0/0 on an arc without duration.
fn parts(arc: &ProfileArc, t: f64) -> Result<(f64, f64), f64> {
    let (done, left) = (t / arc.duration, (arc.duration - t) / arc.duration);
    if t <= 0.0 || done.is_nan() {
        Err(arc.u0)
    } else if left <= 0.0 {
        Err(arc.u1)
    } else {
        Ok((done, left))
    }
}
