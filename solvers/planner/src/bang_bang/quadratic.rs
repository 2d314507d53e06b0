//! The kernel of polynomial pieces of degree 2 in the tool's own axes, by closed forms.
//!
//! C' is linear in the parameter, so that W_jk = c_j q'_k − c_k q'_j with c = q'' is constant along the piece. While one
//! axis is at its limit, the accelerations of all others are linear in one growing quantity, and a cube root tells where
//! the next one reaches its own; the limit curve is a straight line; two bounds of p cross at the roots of a quartic.
//! The tangents where axes turn round follow from W to the last digits, also next to a cusp.
//!
//! | file | content |
//! |---|---|
//! | `piece`, `turns` | tangents and W of a piece; where its axes turn round |
//! | `split` | parts on which no axis turns round and one velocity cap is the lowest |
//! | `subpiece` | a part as a pass travels it |
//! | `phase`, `quotient` | p(x) of a phase, and where one rises above another |
//! | `bang` | the phase of greatest acceleration and the event that ends it |
//! | `slide` | how far a velocity cap can be followed |
//! | `limit_curve` | the velocity limit curve |
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
use crate::arc_kind::ArcKind;
use crate::problem::ChordLimit;
use crate::profile::{Profile, Row, NO_AXIS};
use feedplan_geometry::quadratic::norm;
pub use pass::Stuck;
use phase::{Kind, Phase};
pub use piece::Piece;
use split::{Part, Placed, Splitter};
pub use subpiece::Axes;
use subpiece::{Cap, SubPiece};

/// What the backward pass leaves for the forward pass, piece by piece from the end of a run; and space.
#[derive(Default)]
pub struct Space {
    splitter: Splitter,
    /// Parts from right to left, and where their phases of K begin.
    parts: Vec<(Part, usize)>,
    bounds: Vec<Phase>,
    phases: Vec<Phase>,
}

impl Space {
    pub fn clear(&mut self) {
        self.parts.clear();
        self.bounds.clear();
    }
}

/// Backward over a piece under its feed: v² at its start from v² at its end, and the number of its parts.
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
        space.parts.push((*part, space.bounds.len()));
        let placed = part.place(piece, axes, true);
        p = pass::backward(&placed.sub, axes, p, &mut space.bounds)
            .map_err(|Stuck(x)| Stuck(placed.to - x))?;
    }
    Ok((p * piece.speed[0], space.splitter.parts.len()))
}

/// Forward over a piece of so many parts, the last that `backward` has left in the space: v² at its end. Appends the
/// phases of the piece of this number and width.
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
        let Some((part, bounds)) = space.parts.pop() else { break };
        let placed = part.place(piece, axes, false);
        space.phases.clear();
        p = pass::forward(&placed.sub, axes, p, &space.bounds[bounds..], &mut space.phases)
            .map_err(|Stuck(x)| Stuck(placed.from + x))?;
        space.bounds.truncate(bounds);
        for phase in &space.phases {
            out.push(number, width, row(phase, &part, &placed, axes));
        }
    }
    Ok(p * piece.speed[2])
}

/// A phase of the forward pass over a part as a row of the profile.
#[inline(always)]
fn row<const M: usize>(phase: &Phase, part: &Part, placed: &Placed<M>, axes: &Axes<M>) -> Row {
    let sub = &placed.sub;
    let t = if phase.x1 == sub.length { placed.to } else { (placed.from + phase.x1).min(placed.to) };
    let step = phase.x1 - phase.x0;
    let mut joins = true;
    // The control axis moves at constant acceleration: its way over its mean speed.
    let mut by_axis = |k: usize| {
        let (ga, gb) = (sub.axis_tangent(k, phase.x0), sub.axis_tangent(k, phase.x1));
        // Not with what comes before its axis turns, not even where phases too short to be kept lie in between.
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
    let (kind, axis, value, duration) = match phase.kind {
        Kind::Accelerating(k) => (ArcKind::AxisAcceleration, k, signed(k as usize), by_axis(k as usize)),
        Kind::Braking(k) => (ArcKind::AxisAcceleration, k, -signed(k as usize), by_axis(k as usize)),
        Kind::Flat(k) => (ArcKind::ParameterAcceleration, k, 0.0, step / phase.p0.sqrt()),
        // Followed only where it is level.
        Kind::LimitCurve => (ArcKind::ParameterAcceleration, NO_AXIS, 0.0, step / phase.p0.sqrt()),
        Kind::Cap => match part.cap {
            Cap::Speed([f0, f1]) if f0 == f1 => {
                (ArcKind::Feed, NO_AXIS, f0, sub.way(phase.x0, phase.x1) / f0.sqrt())
            }
            Cap::Speed(_) => (ArcKind::SpeedLine, NO_AXIS, 0.0, time_at_speed(sub, phase)),
            Cap::Axis(k, speed_sq) => (ArcKind::AxisVelocity, k as u8, speed_sq, by_axis(k)),
        },
    };
    let joins = joins && !matches!(kind, ArcKind::SpeedLine);
    Row { kind, axis, value, t, p: [phase.p0, phase.p1], duration, joins }
}

/// The time along a speed whose square is linear in x.
#[cold]
fn time_at_speed<const M: usize>(sub: &SubPiece<M>, phase: &Phase) -> f64 {
    let rate = |x: f64| norm(&sub.tangent(x)) / sub.speed_sq_of_cap(x).sqrt();
    integral(&|x| x.map(rate), phase.x0, phase.x1)
}
