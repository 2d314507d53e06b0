//! What a speed profile claims: p(u) on each arc from its definition, and its time by numerical integration.
//!
//! p = (du/dt)² on an arc follows from what the arc holds constant (`feedplan.profile.ArcKind`). Distances `d` are
//! counted from the arc's *anchor*. On an arc of constant axis acceleration that is the end where the axis is
//! slower: from there v_k² = v_k(anchor)² + 2 a (q_k − q_k(anchor)) adds two terms of one sign and loses nothing.
//!
//! Times are ∫ du/√p in the variable y in [0, 1] in which √p would be linear if p were: du/√p is then finite at
//! a standstill, and constant where p is linear in u.

use super::curve::{inner, length, Curve, Followed};
use super::{EPS, ROUNDINGS};

/// The profile's arrays, one entry an arc; see `feedplan.profile.SpeedProfile`.
#[derive(Clone, Copy)]
pub struct Arcs<'a> {
    pub piece: &'a [u32],
    pub kind: &'a [u8],
    pub axis: &'a [u8],
    pub value: &'a [f64],
    /// Local parameter at both ends, in mm, and p there, in mm²/s².
    pub u0: &'a [f64],
    pub u1: &'a [f64],
    pub p0: &'a [f64],
    pub p1: &'a [f64],
    /// In s.
    pub duration: &'a [f64],
    /// Arc offsets of the runs.
    pub runs: &'a [i64],
}

const AXIS_ACCELERATION: u8 = 0;
const FLAT: u8 = 1;
const FEED: u8 = 2;
const AXIS_VELOCITY: u8 = 3;
const CHORD: u8 = 4;

impl Arcs<'_> {
    /// Number of arcs.
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// When each arc begins, and when the last one ends, in s; pauses before and between the runs included.
    pub fn starts(&self, path: &Followed) -> Vec<f64> {
        let mut starts = Vec::with_capacity(self.len() + 1);
        let (mut time, mut run) = (path.start_dwell, 0);
        for (i, duration) in self.duration.iter().enumerate() {
            while run + 1 < self.runs.len() && self.runs[run + 1] <= i as i64 {
                time += path.dwell.get(run).copied().unwrap_or(0.0);
                run += 1;
            }
            starts.push(time);
            time += duration;
        }
        starts.push(time);
        starts
    }

    /// What is wrong with the numbers of arc `i` taken alone, if anything.
    pub fn has_bad_numbers<const M: usize>(&self, i: usize, path: &Followed) -> bool {
        let piece = self.piece[i] as usize;
        if piece >= path.len() || self.kind[i] > CHORD {
            return true;
        }
        let needs_axis = matches!(self.kind[i], AXIS_ACCELERATION | AXIS_VELOCITY);
        let numbers = [self.value[i], self.u0[i], self.u1[i], self.p0[i], self.p1[i], self.duration[i]];
        (needs_axis && self.axis[i] as usize >= M)
            || numbers.iter().any(|number| !number.is_finite())
            || self.p0[i] < 0.0
            || self.p1[i] < 0.0
            || self.duration[i] < 0.0
    }

    /// Arc `i` ready to be evaluated; its numbers must be good.
    pub fn motion<const M: usize>(&self, i: usize, curve: &Curve<M>) -> Motion<M> {
        let (p0, p1) = (self.p0[i], self.p1[i]);
        let ends = [curve.derivative(self.u0[i]), curve.derivative(self.u1[i])];
        let axis = self.axis[i] as usize;
        let anchored_at_end =
            self.kind[i] == AXIS_ACCELERATION && (ends[1][axis].powi(2) * p1 < ends[0][axis].powi(2) * p0);
        let (tangent, p_anchor, p_far) = if anchored_at_end { (ends[1], p1, p0) } else { (ends[0], p0, p1) };
        let law = match self.kind[i] {
            AXIS_ACCELERATION => Law::AxisAcceleration {
                axis,
                value: self.value[i],
                start_sq: tangent[axis].powi(2) * p_anchor,
            },
            FLAT => Law::Flat { root_p: p_anchor.sqrt() },
            FEED => Law::Feed { speed: self.value[i].sqrt() },
            AXIS_VELOCITY => Law::AxisVelocity { axis, speed: self.value[i].sqrt() },
            _ => Law::Chord { value: self.value[i] },
        };
        let bend = curve.second_derivative();
        let width = self.u1[i] - self.u0[i];
        let direction = if anchored_at_end { -1.0 } else { 1.0 };
        let (root_anchor, root_far) = (p_anchor.sqrt(), p_far.sqrt());
        let share = width / (root_anchor + root_far);
        Motion {
            tangent,
            bend,
            law,
            pole: law.pole(&tangent, &bend, p_anchor),
            direction,
            width,
            root_anchor,
            root_far,
            first_order: direction * share * 2.0 * root_anchor,
            second_order: direction * share * (root_far - root_anchor),
            time_scale: 2.0 * share,
            anchored_at_end,
        }
    }
}

/// What an arc holds constant.
#[derive(Clone, Copy, Debug)]
enum Law {
    /// `start_sq` is the square of the axis velocity at the anchor.
    AxisAcceleration {
        axis: usize,
        value: f64,
        start_sq: f64,
    },
    Flat {
        root_p: f64,
    },
    Feed {
        speed: f64,
    },
    AxisVelocity {
        axis: usize,
        speed: f64,
    },
    Chord {
        value: f64,
    },
}

impl Law {
    fn pole<const M: usize>(&self, tangent: &[f64; M], bend: &[f64; M], p_anchor: f64) -> Option<Pole> {
        match *self {
            // p − a/q''_k falls off as (q'_k(anchor) / q'_k)².
            Law::AxisAcceleration { axis, value, .. } if bend[axis] != 0.0 => Some(Pole {
                at: -tangent[axis] / bend[axis],
                beside: 0.0,
                strength: (1.0 - bend[axis] * p_anchor / value).abs(),
            }),
            Law::Feed { .. } | Law::Chord { .. } if bend.iter().any(|&c| c != 0.0) => {
                let square = inner(bend, bend);
                let at = -inner(tangent, bend) / square;
                let nearest: [f64; M] = std::array::from_fn(|k| tangent[k] + at * bend[k]);
                Some(Pole { at, beside: length(&nearest) / square.sqrt(), strength: 1.0 })
            }
            _ => None,
        }
    }
}

/// One arc, ready to be evaluated at any distance from its anchor.
#[derive(Clone, Copy, Debug)]
pub struct Motion<const M: usize> {
    /// C' at the anchor, and C''.
    tangent: [f64; M],
    bend: [f64; M],
    law: Law,
    /// +1 where u grows from the anchor, −1 where it falls.
    direction: f64,
    /// Length of the arc in u.
    pub width: f64,
    /// Recorded √p at the anchor and at the other end.
    pub root_anchor: f64,
    pub root_far: f64,
    /// The distance at y is y (first_order + second_order y), and dt/dy the integrand times `time_scale`.
    first_order: f64,
    second_order: f64,
    time_scale: f64,
    /// Whether the anchor is the end of the arc.
    pub anchored_at_end: bool,
    pole: Option<Pole>,
}

/// Where p would grow without bound, or turn sharply: the zero of what it is divided by.
#[derive(Clone, Copy, Debug)]
struct Pole {
    /// Signed distance from the anchor, and how far the pole lies beside the real line.
    at: f64,
    beside: f64,
    /// Share of p that changes in its neighbourhood.
    strength: f64,
}

/// The motion at one place of an arc.
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

/// Nodes and weights of Kronrod's 7-point rule on [−1, 1], the middle one last, and the weights of the 3-point Gauss rule inside it.
const NODES: [f64; 3] = [0.960_491_268_708_020_3, 0.774_596_669_241_483_4, 0.434_243_749_346_802_55];
const WEIGHTS: [f64; 4] =
    [0.104_656_226_026_467_27, 0.268_488_089_868_333_44, 0.401_397_414_775_962_2, 0.450_916_538_658_474_14];
const INNER_WEIGHTS: [f64; 2] = [5.0 / 9.0, 8.0 / 9.0];

/// Where the two rules differ by no more than this, the better one is good to about its square, 1e-11.
const RULES_AGREE: f64 = 3e-6;

/// A boundary layer that takes less than this share of an interval's time is left out.
const THIN: f64 = 1e-12;

/// Halvings of an interval before its integral is taken as it is.
const MOST_HALVINGS: u32 = 40;

impl<const M: usize> Motion<M> {
    /// Distance from the anchor, with its sign, at `y`.
    #[inline(always)]
    fn distance(&self, y: f64) -> f64 {
        y * (self.first_order + self.second_order * y)
    }

    /// The `y` of a distance `from_anchor` ≥ 0.
    pub fn y_at(&self, from_anchor: f64) -> f64 {
        if from_anchor <= 0.0 {
            return 0.0;
        }
        let change = self.root_far - self.root_anchor;
        let c = (self.root_anchor + self.root_far) * (from_anchor / self.width).min(1.0);
        (c / (self.root_anchor + (self.root_anchor * self.root_anchor + change * c).max(0.0).sqrt())).min(1.0)
    }

    /// √p at the signed distance `d` from the anchor, where C' is `tangent`.
    #[inline(always)]
    fn root_p(&self, d: f64, tangent: &[f64; M]) -> f64 {
        match self.law {
            Law::AxisAcceleration { axis, value, start_sq } => {
                // 2 (q_k − q_k(anchor)) = d (q'_k(anchor) + q'_k), the trapezoid.
                let speed_sq = start_sq + value * d * (self.tangent[axis] + tangent[axis]);
                speed_sq.sqrt() / tangent[axis].abs()
            }
            Law::Flat { root_p } => root_p,
            Law::Feed { speed } => speed / length(tangent),
            Law::AxisVelocity { axis, speed } => speed / tangent[axis].abs(),
            Law::Chord { value } => (value * length(tangent)).sqrt(),
        }
    }

    /// The motion at `y`.
    #[inline]
    pub fn state(&self, y: f64) -> State<M> {
        let d = self.distance(y);
        let tangent: [f64; M] = std::array::from_fn(|k| self.tangent[k] + d * self.bend[k]);
        let terms: [f64; M] = std::array::from_fn(|k| self.tangent[k].abs() + (d * self.bend[k]).abs());
        // At the anchor of an accelerating arc the recorded p stands for itself, also where C'_k is 0.
        let at_anchor = y == 0.0 && matches!(self.law, Law::AxisAcceleration { .. });
        let root_p = if at_anchor { self.root_anchor } else { self.root_p(d, &tangent) };
        let velocity: [f64; M] = std::array::from_fn(|k| tangent[k] * root_p);
        // How much the rounding of C' is enlarged in p.
        let enlarged = match self.law {
            Law::AxisAcceleration { axis, .. } | Law::AxisVelocity { axis, .. } if !at_anchor => {
                terms[axis] / tangent[axis].abs()
            }
            Law::Feed { .. } | Law::Chord { .. } => length(&terms) / length(&tangent),
            _ => 1.0,
        };
        let magnitude = std::array::from_fn(|k| {
            terms[k] * root_p + if velocity[k] == 0.0 { 0.0 } else { velocity[k].abs() * enlarged }
        });
        State { y, tangent, root_p, velocity, magnitude }
    }

    /// dt/dy at `y` inside the arc, up to `time_scale`.
    #[inline(always)]
    fn integrand(&self, y: f64) -> f64 {
        let d = self.distance(y);
        let linear = self.root_anchor + (self.root_far - self.root_anchor) * y;
        match self.law {
            // The same as below with one axis evaluated and one division saved.
            Law::AxisAcceleration { axis, value, start_sq } => {
                let tangent = self.tangent[axis] + d * self.bend[axis];
                let speed_sq = start_sq + value * d * (self.tangent[axis] + tangent);
                linear * tangent.abs() / speed_sq.sqrt()
            }
            _ => {
                let tangent = std::array::from_fn(|k| self.tangent[k] + d * self.bend[k]);
                linear / self.root_p(d, &tangent)
            }
        }
    }

    /// Whether the integrand is smooth enough between two distances for the rule: no longer than they are far
    /// from where p has a pole or a kink. A boundary layer too thin to matter counts as smooth.
    #[inline]
    fn is_smooth(&self, d0: f64, d1: f64) -> bool {
        let Some(pole) = &self.pole else { return true };
        let along = (d0.min(d1) - pole.at).max(pole.at - d0.max(d1)).max(0.0);
        let (length, away) = ((d1 - d0).abs(), (along * along + pole.beside * pole.beside).sqrt());
        length <= away || pole.strength * away <= THIN * length
    }

    /// Time from `y0` to `y1`, in s, and whether the rule could be trusted there.
    #[inline]
    fn rule(&self, y0: f64, y1: f64) -> (f64, bool) {
        let smooth = self.is_smooth(self.distance(y0), self.distance(y1));
        let (middle, half) = (0.5 * (y0 + y1), 0.5 * (y1 - y0));
        let centre = self.integrand(middle);
        let mut fine = WEIGHTS[3] * centre;
        let mut coarse = INNER_WEIGHTS[1] * centre;
        for (i, node) in NODES.iter().enumerate() {
            let both = self.integrand(middle - half * node) + self.integrand(middle + half * node);
            fine += WEIGHTS[i] * both;
            if i == 1 {
                coarse += INNER_WEIGHTS[0] * both;
            }
        }
        let scale = self.time_scale * half;
        (fine * scale, smooth && (fine - coarse).abs() <= RULES_AGREE * fine)
    }

    /// Walks from `from` to `to` and calls `step` for every interval whose time is known well enough.
    #[inline]
    pub fn walk(&self, from: &State<M>, to: &State<M>, step: &mut impl FnMut(&State<M>, &State<M>, f64)) {
        self.walk_halving(from, to, MOST_HALVINGS, step);
    }

    fn walk_halving(
        &self,
        from: &State<M>,
        to: &State<M>,
        halvings: u32,
        step: &mut impl FnMut(&State<M>, &State<M>, f64),
    ) {
        let (time, trusted) = self.rule(from.y, to.y);
        let middle = 0.5 * (from.y + to.y);
        if trusted || halvings == 0 || time.is_nan() || middle <= from.y || middle >= to.y {
            step(from, to, time);
        } else {
            let middle = self.state(middle);
            self.walk_halving(from, &middle, halvings - 1, step);
            self.walk_halving(&middle, to, halvings - 1, step);
        }
    }

    /// Time from the anchor to `y`, in s.
    pub fn time_from_anchor(&self, y: f64) -> f64 {
        if y <= 0.0 {
            return 0.0;
        }
        self.time_between(0.0, y, MOST_HALVINGS)
    }

    fn time_between(&self, y0: f64, y1: f64, halvings: u32) -> f64 {
        let (time, trusted) = self.rule(y0, y1);
        let middle = 0.5 * (y0 + y1);
        if trusted || halvings == 0 || time.is_nan() || middle <= y0 || middle >= y1 {
            return time;
        }
        self.time_between(y0, middle, halvings - 1) + self.time_between(middle, y1, halvings - 1)
    }

    /// Axis accelerations near `y` as a difference quotient over a thousandth of the arc, or less where p changes
    /// fast, in mm/s², and how much of each may be rounding.
    pub fn acceleration_near(&self, y: f64) -> ([f64; M], [f64; M]) {
        let d = self.distance(y);
        let away = self.pole.map_or(f64::INFINITY, |pole| (d - pole.at).hypot(pole.beside));
        // Around y, so that the mean is that at y to second order; at an end one-sided and very short.
        let half = f64::min(5e-4, 0.01 * away / self.width).min(y.min(1.0 - y).max(1e-6));
        let (from, to) = (self.state((y - half).max(0.0)), self.state((y + half).min(1.0)));
        let time = self.direction * self.time_between(from.y, to.y, MOST_HALVINGS);
        (
            std::array::from_fn(|k| (to.velocity[k] - from.velocity[k]) / time),
            std::array::from_fn(|k| ROUNDINGS * EPS * (from.magnitude[k] + to.magnitude[k]) / time.abs()),
        )
    }

    /// Whether the arc's own axis is the one that its definition holds at constant acceleration.
    pub fn held_axis(&self) -> Option<usize> {
        match self.law {
            Law::AxisAcceleration { axis, .. } => Some(axis),
            _ => None,
        }
    }

    /// Whether the accelerations can have a maximum inside the arc: on slides along a velocity limit.
    pub fn is_slide(&self) -> bool {
        !matches!(self.law, Law::AxisAcceleration { .. } | Law::Flat { .. })
    }

    /// Curvature of the path in 1/mm where C' is `tangent`; 0 where the path has no direction.
    #[inline]
    pub fn curvature(&self, tangent: &[f64; M]) -> f64 {
        curvature(tangent, &self.bend)
    }

    /// What one rounding of the parameter does to the recorded p: the relative error of the arc's width.
    pub fn width_rounding(&self, piece_width: f64) -> f64 {
        EPS * piece_width / self.width
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

    /// One arc on one piece.
    fn one_arc(kind: u8, axis: u8, value: f64, u: [f64; 2], p: [f64; 2], curve: &Curve<2>) -> Motion<2> {
        Arcs {
            piece: &[0],
            kind: &[kind],
            axis: &[axis],
            value: &[value],
            u0: &[u[0]],
            u1: &[u[1]],
            p0: &[p[0]],
            p1: &[p[1]],
            duration: &[1.0],
            runs: &[0, 1],
        }
        .motion(0, curve)
    }

    fn line() -> Curve<2> {
        Curve::new(&[[0.0, 0.0], [4.0, 3.0], [8.0, 6.0]], 10.0)
    }

    fn total(motion: &Motion<2>) -> f64 {
        let mut sum = 0.0;
        motion.walk(&motion.state(0.0), &motion.state(1.0), &mut |_, _, time| sum += time);
        sum
    }

    #[test]
    fn the_rule_integrates_degree_eleven_exactly() {
        for degree in 0..=11 {
            let mut sum = WEIGHTS[3] * if degree == 0 { 1.0 } else { 0.0 };
            for i in 0..3 {
                sum += WEIGHTS[i] * (NODES[i].powi(degree) + (-NODES[i]).powi(degree));
            }
            let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 1e-15, "degree {degree}: {sum} instead of {exact}");
        }
    }

    #[test]
    fn from_rest_along_a_line_takes_the_schoolbook_time() {
        // X at 8 mm/s² over 8 mm: t = √(2 · 8 / 8).
        let motion = one_arc(0, 0, 8.0, [0.0, 10.0], [0.0, 200.0], &line());
        assert!((total(&motion) - 2.0_f64.sqrt()).abs() < 1e-14);
        assert!((motion.state(1.0).velocity[0] - 128.0_f64.sqrt()).abs() < 1e-13);
        let braking = one_arc(0, 0, -8.0, [0.0, 10.0], [200.0, 0.0], &line());
        assert!(braking.anchored_at_end);
        assert!((total(&braking) - 2.0_f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn an_axis_at_constant_acceleration_takes_its_change_of_velocity_over_it() {
        // A bend from 45 degrees to nearly straight up: q'_x falls by a factor of 100.
        let curve = Curve::new(&[[0.0, 0.0], [1.0, 1.0], [1.01, 2.0]], 2.0);
        let (g0, g1) = (curve.derivative(0.0)[0], curve.derivative(2.0)[0]);
        let (p0, value) = (9.0, 3.0);
        let p1 = (g0 * g0 * p0 + 2.0 * value * 1.01) / (g1 * g1);
        let motion = one_arc(0, 0, value, [0.0, 2.0], [p0, p1], &curve);
        let exact = (g1 * p1.sqrt() - g0 * p0.sqrt()) / value;
        assert!((total(&motion) / exact - 1.0).abs() < 1e-10);
    }

    #[test]
    fn part_of_an_arc_takes_the_time_of_that_part() {
        let motion = one_arc(0, 0, 8.0, [0.0, 10.0], [0.0, 200.0], &line());
        let y = motion.y_at(2.5);
        assert!((motion.time_from_anchor(y) - 0.5 * 2.0_f64.sqrt()).abs() < 1e-14);
        assert_eq!(motion.y_at(0.0), 0.0);
        assert_eq!(motion.y_at(10.0), 1.0);
    }

    #[test]
    fn a_parabola_is_most_curved_at_its_tip() {
        // y = x²/2 has curvature 1 at x = 0 and 1/√8 at x = 1.
        let curve = Curve::new(&[[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]], 2.0);
        let bend = curve.second_derivative();
        assert!((curvature(&curve.derivative(1.0), &bend) - 1.0).abs() < 1e-15);
        assert!((curvature(&curve.derivative(2.0), &bend) - 8.0_f64.sqrt().recip()).abs() < 1e-15);
        assert_eq!(curvature(&[0.0, 0.0], &bend), 0.0);
    }

    #[test]
    fn a_slide_at_constant_speed_takes_length_over_speed() {
        let curve = Curve::new(&[[-1.0, 0.5], [0.0, -0.5], [1.0, 0.5]], 2.0);
        let d = |u| inner(&curve.derivative(u), &curve.derivative(u));
        let motion = one_arc(2, 255, 9.0, [0.0, 2.0], [9.0 / d(0.0), 9.0 / d(2.0)], &curve);
        let arc_length = 2.0_f64.sqrt() + 1.0_f64.asinh();
        assert!((total(&motion) - arc_length / 3.0).abs() < 1e-11);
    }
}
