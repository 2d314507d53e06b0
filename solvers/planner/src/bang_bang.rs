//! Computes the exact time-optimal speed along a path of lines, polynomial and rational pieces from the limits of feed, axis
//! velocity, axis acceleration and chord error, by a backward and a forward pass over every run. Method: Zhang et al. 2010 after
//! Timar et al. 2005, extended by the speed limits.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u, t, x | curve parameter: u of a piece; t = u/width in [0, 1]; x of a sub-piece, in the direction of travel | 1 |
//! | τ | time | s |
//! | C, q_k | the curve; the position of axis k | mm, deg |
//! | ω, g | weight and tangent, C' = g/ω²; on polynomial pieces ω = 1 and g_k = q'_k | 1, mm |
//! | c | g'; on polynomial pieces c_k = q''_k | mm |
//! | p, s | p = (dx/dτ)², the state of the motion; s = p'/2 = d²x/dτ² (toppra's x and u) | 1/s² |
//! | π | p/ω⁴: v_k = g_k √π, a_k = ω² (g_k π'/2 + c_k π); on polynomial pieces π = p, a_k = g_k s + c_k p | 1/s² |
//! | D | v² = D π is the square of the tool's speed: D = \|g\|², or a given polynomial where the axes are joints | mm² |
//! | W_jk | c_j g_k − c_k g_j, the Wronskian of two tangents; constant on a quadratic piece | mm² |
//! | V_k, A_k, A_k⁻ | limits of velocity, acceleration, deceleration of axis k | mm/s, mm/s² |
//! | K | the largest p from which the end of the run can be reached | 1/s² |
//!
//! | word | meaning |
//! |---|---|
//! | turn, cusp | a zero of one g_k, where axis k reverses; a common zero of all g_k, where all axes rest |
//! | part | a piece between two cuts: on it no axis turns, and one cap is the lowest |
//! | sub-piece | a part as a pass travels it: x grows, and axes are reflected so that every g_k ≥ 0 |
//! | cap | the greatest p by feed, axis velocity and chord error |
//! | limit curve | the greatest p at which some s keeps every axis within its acceleration limits |
//! | ceiling | the curve that p stays under in a pass: backward the cap, forward K |
//! | phase | an interval of x under one law: an axis at its acceleration limit, along the cap, along the limit curve |
//! | switch | where one phase gives way to the next |
//! | tip | the tool's point, where the axes are joints |
//!
//! If a profile p is feasible, so is λ p for every λ in [0, 1], since v_k and a_k are scaled down. So the values of p
//! from which the end of a run can be reached form an interval [0, K(u)], and two greedy passes are exact:
//!
//! 1. backward, under the cap and the limit curve: the greatest p is K;
//! 2. forward, under K: the greatest p is the fastest profile. It needs no test against the limit curve.
//!
//! A pass does not search for switches. At (x, p) axis k allows s ≤ s_k = (A_k − c_k p)/g_k. The *control axis* has
//! the least s_k, and the pass follows its full acceleration up to the first of these switches, each a root of a
//! polynomial:
//!
//! * another axis reaches +A (a *transition*): it becomes the control axis;
//! * another axis reaches −A (backward only): the pass follows the limit curve until a phase leaves it downward;
//! * p reaches the ceiling: the pass *slides* along the cap while no axis needs more than its acceleration, or,
//!   forward, copies a phase of K to its end;
//! * the end of the sub-piece. Between pieces v² is continuous and at most the square of the junction speed.
//!
//! A piece is planned by one of three kernels:
//!
//! | kernel | pieces | phases and switches |
//! |---|---|---|
//! | `line` | straight ones | v² is linear in the length: the trapezoid |
//! | `quadratic` | polynomials of degree 2 in the tool's own axes | closed forms, and roots of quartics |
//! | `curve` | all others: any degree, rational, joints | roots of Bernstein polynomials |
//!
//! `curve` could plan the other pieces too, but takes three times as long as `quadratic` on the same pieces. Where axes turn so
//! close to a cusp that rounding leaves no correct digit in the tangents, `curve` treats the turns as one point; `quadratic`
//! keeps every limit there, since its W is exact.
//!
//! | file | content |
//! |---|---|
//! | `run` | both passes over a run, from piece to piece |
//! | `speed_line` | an upper limit of v² that is linear in t, made by the chord error |
//! | `time` | the time of a phase along the cap |
//! | `tolerance` | every tolerance, with its reason |

mod curve;
mod line;
mod quadratic;
mod run;
mod speed_line;
mod time;
mod tolerance;

use std::cell::RefCell;

use crate::problem::{greater, ChordLimit, Fault, Problem};
use crate::profile::Profile;
use crate::runs::over_runs;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::watch::Watch;

/// The problem, with its limits prepared for the kernels.
struct Task<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    /// Limits of the axes in the form for `curve`, and in the form for `line` and `quadratic`.
    axes: curve::Axes<M>,
    plain_axes: quadratic::Axes<M>,
    chord: Option<ChordLimit>,
    /// Whether `line` and `quadratic` may be used: the axes are those of the tool, with equal limits in both directions.
    plain: bool,
    /// Receives the progress, counted in pieces.
    watch: Watch<'a>,
}

/// The state of a pass between two pieces.
#[derive(Clone, Copy)]
pub struct Junction {
    /// The sum of the squared axis velocities [mm²/s²]; this is v² where the axes are those of the tool.
    pub speed_sq: f64,
    /// v² of the tip [mm²/s²] at the end of the piece just left; before the next piece is entered, the square of the junction
    /// speed.
    pub tip_sq: f64,
}

impl Junction {
    fn at_end_of_run(tip_sq: f64) -> Self {
        Self { speed_sq: f64::INFINITY, tip_sq }
    }

    /// Sets the state at the end of a piece whose axes are those of the tool, so that both squares are equal.
    fn leave(&mut self, speed_sq: f64) {
        (self.speed_sq, self.tip_sq) = (speed_sq, speed_sq);
    }
}

thread_local! {
    static SPACE: RefCell<run::Workspace> = RefCell::default();
}

/// The fastest profile.
pub fn plan<const M: usize>(problem: &Problem<M>) -> Result<Profile, Fault> {
    problem.check()?;
    let (velocity, acceleration) = (&problem.max_velocity, &problem.max_acceleration);
    // With joints, the greatest acceleration of the tip is not known.
    let most = if problem.tip.is_some() { f64::INFINITY } else { norm(&greater(acceleration)) };
    let task = Task {
        problem,
        axes: curve::Axes {
            acceleration: *acceleration,
            velocity_sq: velocity.map(|side| side.map(|v| v * v)),
        },
        plain_axes: quadratic::Axes::new(acceleration[0], velocity[0]),
        chord: ChordLimit::new(problem.chord_tolerance, problem.period, most),
        plain: problem.tip.is_none() && velocity[0] == velocity[1] && acceleration[0] == acceleration[1],
        watch: problem.watch.each(problem.len()),
    };
    over_runs(problem, &SPACE, |pieces, speeds_sq, space, profile| {
        run::plan_run(&task, pieces, speeds_sq, space, profile)
    })
}
