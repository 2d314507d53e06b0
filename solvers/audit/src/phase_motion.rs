//! The motion on one phase of a speed profile by its law p = N/D (`law`): velocities, and how well they are known.
//!
//! Distances `d` are counted from the phase's *anchor*. Where an axis accelerates that is the end where the axis is slower:
//! from there v_k² = v_k(anchor)² + 2 a (q_k − q_k(anchor)) adds two terms of one sign and loses no digits. In the other laws
//! it is the end where p, or the speed, is smaller.

mod law;

pub use law::{Law, Pole};

use super::polygon::Polygon;
use super::vectors::{from_to, inner, length};
use super::EPS;

/// Slopes of tangents are taken over this part of the phase.
const BESIDE: f64 = 1e-6;
/// Within this part of a phase of its anchor the slope of a tangent is that at the anchor.
const NEXT_TO: f64 = 1e-3;

/// No rule has a node nearer to the ends of its interval than this part of it.
pub(super) const STEPPED_OVER: f64 = 0.02;

/// One phase, ready to be evaluated at any distance from its anchor.
#[derive(Clone, Debug)]
pub struct PhaseMotion<const M: usize> {
    /// C' at the anchor, and C'' where it is the same everywhere.
    pub(super) tangent: [f64; M],
    pub(super) bend: [f64; M],
    /// Of a piece that is not of degree 2.
    general: Option<General<M>>,
    pub(super) law: Law,
    /// +1 where u grows from the anchor, −1 where it falls.
    pub(super) direction: f64,
    /// Length of the phase in u.
    pub width: f64,
    /// How many times as long its piece is. One rounding of an end of the phase is this many of its length.
    grain: f64,
    /// Recorded √p at the anchor and at the other end.
    pub root_anchor: f64,
    pub root_far: f64,
    /// The same, or 1 where both are 0: what the integration variable is made for.
    near: f64,
    far: f64,
    /// The distance at y is y (first_order + second_order y), and dt/dy the integrand times `time_scale`.
    first_order: f64,
    second_order: f64,
    pub(super) time_scale: f64,
    /// Whether the anchor is the end of the phase.
    pub anchored_at_end: bool,
    pub(super) pole: Option<Pole>,
    pub(super) layer: Option<Layer>,
    /// What the axes count in the speed that is constant at the feed.
    share: [f64; M],
}

/// Next to a slow anchor √p turns from its slope there to that of the whole phase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    /// About how far it reaches, in y.
    pub thickness: f64,
    /// Share of √p that changes in it.
    pub strength: f64,
}

#[derive(Clone, Debug)]
struct General<const M: usize> {
    whole: Box<Polygon<M>>,
    ends: [f64; 2],
    part: Box<Polygon<M>>,
    size: [f64; M],
}

impl<const M: usize> General<M> {
    /// Where the axis at its limit turns next to the anchor of a phase of this width (negative: backward), if it does.
    fn pole(&self, law: &Law, tangent: &[f64; M], p_anchor: f64, width: f64) -> Option<Pole> {
        let Law::Axis { .. } = law else { return None };
        let beside = self.part.local(BESIDE).slope;
        let bend = std::array::from_fn(|k| (beside[k] / width - tangent[k]) / (BESIDE * width));
        law.pole(tangent, &bend, p_anchor).filter(|pole| pole.at.abs() < NEXT_TO * width.abs())
    }
}

/// The piece under a phase.
#[derive(Clone, Debug)]
pub enum Shape<const M: usize> {
    /// Degree 2: C' at the anchor, and C''.
    Quadratic { tangent: [f64; M], bend: [f64; M] },
    /// Any other: itself, with t at the anchor and at the other end; the part of it between them, from the anchor; and
    /// what the rounding of C' is relative to.
    General {
        whole: Box<Polygon<M>>,
        ends: [f64; 2],
        part: Box<Polygon<M>>,
        tangent: [f64; M],
        size: [f64; M],
    },
}

/// The motion at one place of a phase.
#[derive(Clone, Copy, Debug)]
pub struct State<const M: usize> {
    /// Integration variable, 0 at the anchor and 1 at the other end.
    pub y: f64,
    /// C'.
    pub tangent: [f64; M],
    /// √p in mm/s (of parameter).
    pub root_p: f64,
    /// Axis velocities in mm/s.
    pub velocity: [f64; M],
    /// What the rounding of each axis velocity is relative to, in mm/s.
    pub magnitude: [f64; M],
}

impl<const M: usize> PhaseMotion<M> {
    /// `widths` are those of the phase and of its piece; `p` the recorded values at the anchor and at the other end; `share` is
    /// what the axes count in a feed.
    pub fn new(
        law: Law,
        shape: Shape<M>,
        widths: [f64; 2],
        p: [f64; 2],
        anchored_at_end: bool,
        share: &[f64; M],
    ) -> Self {
        let [width, whole] = widths;
        let direction = if anchored_at_end { -1.0 } else { 1.0 };
        let (tangent, bend, general) = match shape {
            Shape::Quadratic { tangent, bend } => (tangent, bend, None),
            Shape::General { whole, ends, part, tangent, size } => {
                (tangent, [0.0; M], Some(General { whole, ends, part, size }))
            }
        };
        let [root_anchor, root_far] = p.map(f64::sqrt);
        // Where both are 0 the ramps at both ends are too short to be phases, and the law alone tells the speed.
        let rests = root_anchor + root_far == 0.0;
        let [near, far] = if rests { [1.0; 2] } else { [root_anchor, root_far] };
        let part = width / (near + far);
        let share = if matches!(law, Law::Speed { .. }) { *share } else { [1.0; M] };
        let counted = |of: &[f64; M]| std::array::from_fn(|k| share[k] * of[k]);
        Self {
            tangent,
            bend,
            law,
            pole: match &general {
                None => law.pole::<M>(&counted(&tangent), &counted(&bend), p[0]),
                Some(general) => general.pole(&law, &tangent, p[0], direction * width),
            },
            layer: Layer::new(&law, &tangent, [near, far], width),
            general,
            direction,
            width,
            grain: whole / width,
            root_anchor,
            root_far,
            near,
            far,
            first_order: direction * part * 2.0 * near,
            second_order: direction * part * (far - near),
            time_scale: 2.0 * part,
            anchored_at_end,
            share,
        }
    }

    /// Distance from the anchor, with its sign, at `y`.
    #[inline(always)]
    pub(super) fn distance(&self, y: f64) -> f64 {
        y * (self.first_order + self.second_order * y)
    }

    /// The `y` of a distance `from_anchor` ≥ 0.
    pub fn y_at(&self, from_anchor: f64) -> f64 {
        if from_anchor <= 0.0 {
            return 0.0;
        }
        let change = self.far - self.near;
        let c = (self.near + self.far) * (from_anchor / self.width).min(1.0);
        (c / (self.near + (self.near * self.near + change * c).max(0.0).sqrt())).min(1.0)
    }

    /// √p at `y` if p were linear.
    #[inline(always)]
    pub(super) fn linear(&self, y: f64) -> f64 {
        self.near + (self.far - self.near) * y
    }

    /// Whether the piece is not of degree 2.
    #[inline(always)]
    pub(super) fn is_general(&self) -> bool {
        self.general.is_some()
    }

    /// What of C' counts in the speed that the law is about.
    #[inline(always)]
    fn counted(&self, tangent: &[f64; M]) -> [f64; M] {
        std::array::from_fn(|k| self.share[k] * tangent[k])
    }

    /// √p at the signed distance `d` from the anchor, where C' is `tangent`, on a piece of degree 2.
    #[inline(always)]
    pub(super) fn root_p(&self, d: f64, tangent: &[f64; M]) -> f64 {
        match self.law {
            Law::Axis { axis, value, start_sq } => {
                // 2 (q_k − q_k(anchor)) = d (q'_k(anchor) + q'_k), the trapezoid.
                let speed_sq = start_sq + value * d * (self.tangent[axis] + tangent[axis]);
                speed_sq.sqrt() / tangent[axis].abs()
            }
            _ => self.root_p_by_speed(d, tangent),
        }
    }

    /// The same of the laws that need no way.
    #[inline(always)]
    fn root_p_by_speed(&self, d: f64, tangent: &[f64; M]) -> f64 {
        match self.law {
            Law::Axis { .. } => f64::NAN,
            Law::Parameter { start, slope } => (start + slope * d).sqrt(),
            Law::Speed { start_sq, change_sq } => {
                (start_sq + change_sq * (d / self.width).abs()).sqrt() / length(&self.counted(tangent))
            }
        }
    }

    /// C' and √p at the signed distance `d` on a piece of any degree.
    #[inline(never)]
    fn on_general(&self, general: &General<M>, d: f64) -> ([f64; M], f64) {
        let local = general.part.local((d / self.width).abs().min(1.0));
        let scale = self.direction / self.width;
        let tangent = local.slope.map(|slope| scale * slope);
        let root_p = match self.law {
            Law::Axis { axis, value, start_sq } => {
                (start_sq + 2.0 * value * local.way[axis]).sqrt() / tangent[axis].abs()
            }
            _ => self.root_p_by_speed(d, &tangent),
        };
        (tangent, root_p)
    }

    /// C' and √p at the signed distance `d` from the anchor.
    #[inline(always)]
    fn at(&self, d: f64) -> ([f64; M], f64) {
        match &self.general {
            None => {
                let tangent = std::array::from_fn(|k| self.tangent[k] + d * self.bend[k]);
                (tangent, self.root_p(d, &tangent))
            }
            Some(general) => self.on_general(general, d),
        }
    }

    /// √p at the signed distance `d` from the anchor.
    #[inline(always)]
    pub(super) fn root_p_at(&self, d: f64) -> f64 {
        self.at(d).1
    }

    /// Distance from the anchor, C' and √p at `y`.
    #[inline(always)]
    fn place(&self, y: f64) -> (f64, [f64; M], f64) {
        let d = self.distance(y);
        let (tangent, root_p) = self.at(d);
        (d, tangent, if self.keeps_recorded(y) { self.root_anchor } else { root_p })
    }

    /// At the anchor of an accelerating phase the recorded p stands for itself, also where C'_k is 0.
    #[inline(always)]
    fn keeps_recorded(&self, y: f64) -> bool {
        y == 0.0 && matches!(self.law, Law::Axis { .. })
    }

    /// Axis velocities at `y` in mm/s.
    #[inline]
    pub fn velocity(&self, y: f64) -> [f64; M] {
        let (_, tangent, root_p) = self.place(y);
        tangent.map(|g| g * root_p)
    }

    /// About how far from `y` the phase's axis turns round, or the path where the speed along it is given: p changes fast
    /// there, on a piece that has no pole. By the tangent and its slope.
    pub(super) fn way_to_turn(&self, y: f64) -> f64 {
        if self.general.is_none() {
            return f64::INFINITY;
        }
        let beside = if y < 0.5 { y + BESIDE } else { y - BESIDE };
        let [here, there] = [y, beside].map(|y| self.distance(y));
        let (tangent, next) = (self.at(here).0, self.at(there).0);
        let change = from_to(&tangent, &next);
        let share = match self.law {
            Law::Axis { axis, .. } => tangent[axis] / change[axis],
            _ => length(&tangent) / length(&change),
        };
        (share * (there - here)).abs()
    }

    /// The motion at `y`.
    #[inline]
    pub fn state(&self, y: f64) -> State<M> {
        let (d, tangent, root_p) = self.place(y);
        let velocity = tangent.map(|g| g * root_p);
        let terms: [f64; M] = match &self.general {
            None => std::array::from_fn(|k| self.tangent[k].abs() + (d * self.bend[k]).abs()),
            Some(general) => general.size,
        };
        // How much the rounding of C' is enlarged in p, and that of the way in the square of a speed that grows with it.
        let enlarged = match self.law {
            Law::Axis { axis, start_sq, .. } if !self.keeps_recorded(y) => {
                let gained = (1.0 - start_sq / velocity[axis].powi(2)).max(0.0);
                terms[axis] / tangent[axis].abs() + 0.5 * gained * self.grain
            }
            Law::Speed { start_sq, .. } => {
                let counted = self.counted(&velocity);
                let gained = (1.0 - start_sq / inner(&counted, &counted)).max(0.0);
                length(&self.counted(&terms)) / length(&self.counted(&tangent)) + 0.5 * gained * self.grain
            }
            Law::Parameter { start, .. } => 1.0 + 0.5 * (1.0 - start / root_p.powi(2)).max(0.0) * self.grain,
            _ => 1.0,
        };
        let magnitude = std::array::from_fn(|k| {
            terms[k] * root_p + if velocity[k] == 0.0 { 0.0 } else { velocity[k].abs() * enlarged }
        });
        State { y, tangent, root_p, velocity, magnitude }
    }

    /// The local parameter of the piece at `y` on a phase from `u0` to `u1`.
    pub fn parameter(&self, y: f64, [u0, u1]: [f64; 2]) -> f64 {
        let d = self.distance(y);
        (if self.anchored_at_end { u1 + d } else { u0 + d }).clamp(u0, u1)
    }

    /// The axis whose acceleration the law holds constant.
    pub fn held_axis(&self) -> Option<usize> {
        match self.law {
            Law::Axis { axis, .. } => Some(axis),
            _ => None,
        }
    }

    /// Whether the accelerations can have a maximum inside the phase: on slides along a velocity limit.
    pub fn is_slide(&self) -> bool {
        match self.law {
            Law::Axis { value, .. } => value == 0.0,
            Law::Parameter { .. } => false,
            Law::Speed { .. } => true,
        }
    }

    /// Curvature of the path in 1/mm at a state; 0 where the path has no direction.
    #[inline]
    pub fn curvature(&self, state: &State<M>) -> f64 {
        match &self.general {
            None => curvature(&state.tangent, &self.bend),
            // Of the whole piece: on a short part nothing is left of the turn from step to step.
            Some(General { whole, ends, .. }) => {
                let share = (self.distance(state.y) / self.width).abs().min(1.0);
                whole.curvature((ends[0] + share * (ends[1] - ends[0])).clamp(0.0, 1.0))
            }
        }
    }

    /// What one rounding of an end of the phase is of its width.
    pub fn width_rounding(&self) -> f64 {
        EPS * self.grain
    }
}

impl Layer {
    /// On a phase of constant axis acceleration that the rules could step over it, with √p at both ends.
    fn new<const M: usize>(law: &Law, tangent: &[f64; M], [near, far]: [f64; 2], width: f64) -> Option<Self> {
        let Law::Axis { axis, value, .. } = *law else { return None };
        if near <= 0.0 || near >= STEPPED_OVER * far {
            return None;
        }
        // p' at the anchor beside its mean.
        let steeper = 2.0 * value.abs() * width / (tangent[axis].abs() * far * far);
        Some(Self { thickness: near / far, strength: (1.0 - 1.0 / steeper.sqrt()).abs() })
    }
}

/// Curvature in 1/mm from C' and C'': the part of C'' across the path over |C'|².
#[inline]
pub fn curvature<const M: usize>(tangent: &[f64; M], bend: &[f64; M]) -> f64 {
    let square = inner(tangent, tangent);
    if square == 0.0 {
        return 0.0;
    }
    let along = inner(tangent, bend) / square;
    let across: [f64; M] = std::array::from_fn(|k| bend[k] - along * tangent[k]);
    length(&across) / square
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::Quadratic;

    #[test]
    fn a_parabola_is_most_curved_at_its_tip() {
        // y = x²/2 has curvature 1 at x = 0 and 1/√8 at x = 1.
        let curve = Quadratic::new(&[[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]], 2.0);
        let bend = curve.second_derivative();
        assert!((curvature(&curve.derivative(1.0), &bend) - 1.0).abs() < 1e-15);
        assert!((curvature(&curve.derivative(2.0), &bend) - 8.0_f64.sqrt().recip()).abs() < 1e-15);
        assert_eq!(curvature(&[0.0, 0.0], &bend), 0.0);
    }
}
