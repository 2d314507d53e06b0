//! The kernel `quadratic`: computes K and the fastest profile of polynomial pieces of degree 2 in the tool's own axes in closed
//! form, from the control points, the feed and the limits of the axes. Zhang et al. 2010, section 4, extended by the speed
//! limits.
//!
//! C' is linear in the parameter, so every W_jk is constant along a piece (symbols: `bang_bang`). Consequences:
//!
//! * While one axis is at its limit, the accelerations of all others are linear in one growing quantity; a cube root
//!   gives the x where the next axis reaches its limit.
//! * The limit curve is a straight line in p.
//! * A phase and its ceiling cross at the roots of a quartic.
//! * W gives the tangents at turns to full precision, also next to a cusp.
//!
//! | file | content |
//! |---|---|
//! | `piece`, `turns` | tangents and W of a piece; where its axes turn |
//! | `split` | the parts of a piece |
//! | `subpiece` | a part as a pass travels it |
//! | `phase`, `quotient` | p(x) of a phase, and where one p(x) rises above another |
//! | `bang` | the phase of greatest acceleration and the switch that ends it |
//! | `slide` | how far a cap can be followed |
//! | `limit_curve` | the limit curve |
//! | `pass` | one pass over one sub-piece |

mod bang;
mod limit_curve;
mod pass;
mod phase;
mod piece;
mod quotient;
mod slide;
mod split;
mod subpiece;
mod turns;

use super::time::integral;
use crate::phase_law::PhaseLaw;
use crate::phases::NO_AXIS;
use crate::problem::ChordLimit;
use crate::profile::{Profile, Row};
use feedplan_geometry::quadratic::norm;
pub use pass::Stuck;
use phase::{Law, Phase};
pub use piece::Piece;
use split::{Located, Part, Splitter};
pub use subpiece::Axes;
use subpiece::{Cap, SubPiece};

/// The results of the backward pass, which goes from the end of a run to its start, for the forward pass; and working memory of
/// both.
#[derive(Default)]
pub struct Space {
    splitter: Splitter,
    /// Parts from right to left, each with the index of its first phase of K in `controllable`.
    parts: Vec<(Part, usize)>,
    controllable: Vec<Phase>,
    phases: Vec<Phase>,
}

impl Space {
    pub fn clear(&mut self) {
        self.parts.clear();
        self.controllable.clear();
    }
}

/// Backward pass over a piece, from v² at its end: returns v² at its start [mm²/s²] and the number of its parts.
#[inline(always)]
pub fn backward<const M: usize>(
    piece: &Piece<M>,
    axes: &Axes<M>,
    (feed, chord): (f64, Option<&ChordLimit>),
    speed_sq: f64,
    space: &mut Space,
) -> Result<(f64, usize), Stuck> {
    space.splitter.split(piece, axes, feed * feed, chord);
    let mut p = speed_sq / piece.speed[2];
    for part in space.splitter.parts.iter().rev() {
        space.parts.push((*part, space.controllable.len()));
        let located = part.locate(piece, axes, true);
        p = pass::backward(&located.sub, axes, p, &mut space.controllable)
            .map_err(|Stuck(x)| Stuck(located.to - x))?;
    }
    Ok((p * piece.speed[0], space.splitter.parts.len()))
}

/// Forward pass over a piece, whose parts are the last `parts` ones stored by `backward`, from v² at its start: appends the
/// phases, with the piece's number and parameter width, and returns v² at its end [mm²/s²].
#[inline(always)]
pub fn forward<const M: usize>(
    piece: &Piece<M>,
    axes: &Axes<M>,
    speed_sq: f64,
    parts: usize,
    space: &mut Space,
    (number, width): (u32, f64),
    out: &mut Profile,
) -> Result<f64, Stuck> {
    let mut p = speed_sq / piece.speed[0];
    for _ in 0..parts {
        let Some((part, controllable)) = space.parts.pop() else { break };
        let located = part.locate(piece, axes, false);
        space.phases.clear();
        p = pass::forward(&located.sub, axes, p, &space.controllable[controllable..], &mut space.phases)
            .map_err(|Stuck(x)| Stuck(located.from + x))?;
        space.controllable.truncate(controllable);
        for phase in &space.phases {
            out.push(number, width, row(phase, &part, &located, axes));
        }
    }
    Ok(p * piece.speed[2])
}

/// A phase of the forward pass as a row of the profile.
#[inline(always)]
fn row<const M: usize>(phase: &Phase, part: &Part, located: &Located<M>, axes: &Axes<M>) -> Row {
    let sub = &located.sub;
    let t = if phase.x1 == sub.length { located.to } else { (located.from + phase.x1).min(located.to) };
    let step = phase.x1 - phase.x0;
    let mut joins = true;
    // The acceleration of the control axis is constant, so the duration is its distance divided by its mean speed.
    let mut by_axis = |k: usize| {
        let (ga, gb) = (sub.axis_tangent(k, phase.x0), sub.axis_tangent(k, phase.x1));
        // A phase that begins where its axis turns is not joined to the phase before it, even if phases between them were too
        // short to be kept.
        joins = sub.axis_tangent(k, 0.0) > 0.0;
        step * (ga + gb) / (ga * phase.p0.sqrt() + gb * phase.p1.sqrt())
    };
    let signed = |k: usize| {
        let a = axes.acceleration[k];
        if part.negative >> k & 1 == 1 {
            -a
        } else {
            a
        }
    };
    let (law, axis, value, duration) = match phase.law {
        Law::Accelerating(k) => (PhaseLaw::AxisAcceleration, k, signed(k as usize), by_axis(k as usize)),
        Law::Braking(k) => (PhaseLaw::AxisAcceleration, k, -signed(k as usize), by_axis(k as usize)),
        Law::Flat(k) => (PhaseLaw::ParameterAcceleration, k, 0.0, step / phase.p0.sqrt()),
        // Not expected: the forward pass does not follow the limit curve.
        Law::LimitCurve => (PhaseLaw::ParameterAcceleration, NO_AXIS, 0.0, step / phase.p0.sqrt()),
        Law::Cap => match part.cap {
            Cap::Speed([f0, f1]) if f0 == f1 => {
                (PhaseLaw::Feed, NO_AXIS, f0, sub.arc_length(phase.x0, phase.x1) / f0.sqrt())
            }
            Cap::Speed(_) => (PhaseLaw::SpeedLine, NO_AXIS, 0.0, time_at_speed(sub, phase)),
            Cap::Axis(k, speed_sq) => (PhaseLaw::AxisVelocity, k as u8, speed_sq, by_axis(k)),
        },
    };
    let joins = joins && !matches!(law, PhaseLaw::SpeedLine);
    Row { law, axis, value, t, p: [phase.p0, phase.p1], duration, joins }
}

/// The time [s] of a phase along a cap whose v² is linear in x.
#[cold]
fn time_at_speed<const M: usize>(sub: &SubPiece<M>, phase: &Phase) -> f64 {
    let rate = |x: f64| norm(&sub.tangent(x)) / sub.speed_sq_of_cap(x).sqrt();
    integral(&|x| x.map(rate), phase.x0, phase.x1)
}
