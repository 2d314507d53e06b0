//! Motion along an arc on a quadratic piece. c = C'' is constant: acceleration is q's + c p, and because q''' = 0
//! jerk is √p (q's' + 3 c s).
//!
//! When one axis k moves at constant acceleration or constant speed its way is a known quadratic of time, and
//! Δq_k = (q'_k(u0) + q'_k(u)) Δu / 2 is one quadratic equation for Δu. It is solved from the end of the arc
//! where |q'_k| is smaller: there every term is positive and no digit is lost, not even where q'_k vanishes.

use super::even::EvenLaw;
use super::{fill, invert, parts, ProfileArc, Rates, State};
use feedplan_geometry::arc_length::{ChordTime, Length, Node, QuadraticSpeed, Table};
use feedplan_geometry::quadratic::{dot, Quadratic};
use feedplan_planner::phase_law::PhaseLaw;

/// q'_k and the speed of the axis vanish at an end where they are this part of those at the other one.
const TURN: f64 = 1e-10;

enum Law {
    Even(EvenLaw),
    Axis(AxisLaw),
    Feed { speed_sq: f64 },
    Chord { value: f64 },
}

/// Axis k reflected so that q'_k ≥ 0: speed v linear in time from v0 to v1, q'_k linear in u from g0 to g1.
struct AxisLaw {
    k: usize,
    sign: f64,
    acceleration: f64,
    v0: f64,
    v1: f64,
    g0: f64,
    g1: f64,
    /// p at both ends is infinite or not; where it is, the piece is straight and ends in a cusp.
    cusp: bool,
    p_end: f64,
}

/// An arc with everything that its evaluation needs.
pub struct QuadraticMotion<const M: usize> {
    piece: Quadratic<M>,
    tangents: ([f64; M], [f64; M]),
    second: [f64; M],
    hodograph: QuadraticSpeed,
    pub(super) arc: ProfileArc,
    law: Law,
    lengths: Vec<Node>,
    times: Vec<Node>,
    pub(super) length_error: f64,
    time_error: f64,
}

impl<const M: usize> QuadraticMotion<M> {
    /// Prepares an arc; `with_lengths` tabulates its length whatever its kind.
    pub fn new(piece: &Quadratic<M>, arc: &ProfileArc, with_lengths: bool) -> Self {
        let tangents = piece.end_tangents();
        let mut motion = Self {
            piece: *piece,
            tangents,
            second: std::array::from_fn(|k| (tangents.1[k] - tangents.0[k]) / piece.width),
            hodograph: QuadraticSpeed::new(piece),
            arc: *arc,
            law: Law::Even(EvenLaw::new(arc)),
            lengths: Vec::new(),
            times: Vec::new(),
            length_error: 0.0,
            time_error: 0.0,
        };
        let infinite = arc.p0 == f64::INFINITY || arc.p1 == f64::INFINITY;
        motion.law = match arc.kind {
            PhaseLaw::AxisAcceleration => motion.axis_law(arc.axis as usize, arc.value, None),
            PhaseLaw::AxisVelocity => motion.axis_law(arc.axis as usize, 0.0, Some(arc.value.sqrt())),
            // Through a cusp the piece is straight, and constant speed is constant speed of its longest axis.
            PhaseLaw::Feed if infinite => {
                let c = &motion.second;
                let k = (0..M).fold(0, |best, k| if c[k].abs() > c[best].abs() { k } else { best });
                let speed = arc.value.sqrt() * c[k].abs() / dot(c, c).sqrt();
                motion.axis_law(k, 0.0, Some(speed))
            }
            PhaseLaw::Feed => Law::Feed { speed_sq: arc.value },
            PhaseLaw::Chord => Law::Chord { value: arc.value },
            // `Motion` takes the general form for the last three.
            PhaseLaw::ParameterAcceleration
            | PhaseLaw::SpeedLine
            | PhaseLaw::PathJerk
            | PhaseLaw::SpeedCubic => Law::Even(EvenLaw::new(arc)),
        };
        if with_lengths || matches!(motion.law, Law::Feed { .. }) {
            motion.length_error = fill(Length(motion.hodograph), (arc.u0, arc.u1), &mut motion.lengths);
        }
        if matches!(motion.law, Law::Chord { .. }) {
            motion.time_error = fill(ChordTime(motion.hodograph), (arc.u0, arc.u1), &mut motion.times);
        }
        motion
    }

    fn axis_law(&self, k: usize, acceleration: f64, speed: Option<f64>) -> Law {
        let arc = &self.arc;
        let (q0, q1) = (self.tangent(arc.u0)[k], self.tangent(arc.u1)[k]);
        let sign = if q0 + q1 >= 0.0 { 1.0 } else { -1.0 };
        // A q'_k that the profile's cuts put to 0 comes out as a rounding error of either sign.
        let reflected = |q: f64, p: f64| if p.is_finite() { (sign * q).max(0.0) } else { 0.0 };
        let (g0, g1) = (reflected(q0, arc.p0), reflected(q1, arc.p1));
        let gain = sign * acceleration * (g0 + g1) * (arc.u1 - arc.u0);
        let (w0, w1) = (g0 * arc.p0.sqrt(), g1 * arc.p1.sqrt());
        let (v0, v1) = match speed {
            Some(speed) => (speed, speed),
            None if !arc.p0.is_finite() => ((w1 * w1 - gain).max(0.0).sqrt(), w1),
            None if !arc.p1.is_finite() => (w0, (w0 * w0 + gain).max(0.0).sqrt()),
            None => (w0, w1),
        };
        let (cusp, p_end) =
            (!(arc.p0.is_finite() && arc.p1.is_finite()), if g0 <= g1 { arc.p0 } else { arc.p1 });
        if g0 + g1 <= 0.0 || v0 + v1 <= 0.0 {
            // As short as a rounding error: the axis shows no motion. Its duration still tells the pace.
            return Law::Even(EvenLaw::pace(arc));
        }
        let (near, far) = if g0 <= g1 { ((g0, v0), (g1, v1)) } else { ((g1, v1), (g0, v0)) };
        if near.0 <= TURN * far.0 && near.1 <= TURN * far.1 {
            // The axis turns round at an end: v_k² = 2 a Δq_k and q'_k² = 2 c_k Δq_k, and p is the same everywhere.
            return Law::Even(EvenLaw::pace(arc));
        }
        Law::Axis(AxisLaw { k, sign, acceleration, v0, v1, g0, g1, cusp, p_end })
    }

    /// C'(u), from the nearer end.
    fn tangent(&self, u: f64) -> [f64; M] {
        let (from, to) = &self.tangents;
        if 2.0 * u <= self.piece.width {
            std::array::from_fn(|k| from[k] + self.second[k] * u)
        } else {
            std::array::from_fn(|k| to[k] - self.second[k] * (self.piece.width - u))
        }
    }

    /// Position, and velocity, acceleration and jerk at a place.
    #[inline]
    pub fn sample(&self, state: &State) -> ([f64; M], Rates<M>) {
        (self.piece.point(state.u), self.rates(state))
    }

    /// The table of the arc's length; `with_lengths` must have been asked for.
    pub fn lengths(&self) -> Table<'_, Length> {
        Table { f: Length(self.hodograph), nodes: &self.lengths }
    }

    fn times(&self) -> Table<'_, ChordTime> {
        Table { f: ChordTime(self.hodograph), nodes: &self.times }
    }

    /// The place `t` seconds after the start of the arc. `period` is the step whose length is to be met.
    pub fn at_time(&self, t: f64, period: f64) -> State {
        let (done, left) = match parts(&self.arc, t) {
            Ok(parts) => parts,
            Err(end) => return self.at(end),
        };
        match &self.law {
            Law::Even(law) => self.at(law.place(&self.arc, done, left)),
            Law::Axis(law) => law.at_time(&self.arc, done, left),
            Law::Feed { .. } => invert(&self.lengths(), self.length_error, &self.arc, done, period),
            Law::Chord { .. } => invert(&self.times(), self.time_error, &self.arc, done, period),
        }
    }

    /// The place with parameter u.
    pub fn at(&self, u: f64) -> State {
        match &self.law {
            Law::Axis(law) => law.at(&self.arc, u),
            _ => State { u, ..State::default() },
        }
    }

    /// Seconds from the start of the arc to a place.
    pub fn time(&self, state: &State) -> f64 {
        let done = match &self.law {
            Law::Even(law) => law.done(&self.arc, state.u),
            Law::Axis(law) => law.done(&self.arc, state),
            Law::Feed { .. } => self.lengths().integral(state.u) / self.lengths().total(),
            Law::Chord { .. } => self.times().integral(state.u) / self.times().total(),
        };
        self.arc.duration * done
    }

    fn rates(&self, state: &State) -> Rates<M> {
        let (q, c) = (self.tangent(state.u), &self.second);
        let (root, s, ds) = match &self.law {
            Law::Axis(law) if law.cusp => return law.straight(c, state),
            Law::Axis(law) => law.rates(c[law.k], state),
            Law::Even(law) => (law.root(&self.arc, state.u), law.s, 0.0),
            // p = F²/D with D = |q'|²: p' = −2F² B/D², p''/2 = F² (4B²/D³ − E²/D²).
            Law::Feed { speed_sq } => {
                let (d, b, e_sq) = (dot(&q, &q), dot(&q, c), dot(c, c));
                let p = speed_sq / d;
                (p.sqrt(), -p * b / d, p / d * (4.0 * b * b / d - e_sq))
            }
            // p = κ √D: p' = κ B/√D, p''/2 = κ (E² − B²/D)/(2 √D).
            Law::Chord { value } => {
                let (d, b, e_sq) = (dot(&q, &q), dot(&q, c), dot(c, c));
                let scale = value / d.sqrt();
                ((scale * d).sqrt(), 0.5 * scale * b, 0.5 * scale * (e_sq - b * b / d))
            }
        };
        let p = root * root;
        let mut rates = Rates {
            velocity: std::array::from_fn(|k| q[k] * root),
            acceleration: std::array::from_fn(|k| q[k] * s + c[k] * p),
            jerk: std::array::from_fn(|k| root * (q[k] * ds + 3.0 * c[k] * s)),
        };
        if let Law::Axis(law) = &self.law {
            rates.velocity[law.k] = law.sign * state.v;
            rates.acceleration[law.k] = law.acceleration;
            rates.jerk[law.k] = 0.0;
        }
        rates
    }
}

impl AxisLaw {
    /// The part of the axis's way that is done, measured from the end with the smaller q'_k, gives the place.
    fn place(&self, arc: &ProfileArc, part: f64, v: f64) -> State {
        let (low, high, width) = (self.g0.min(self.g1), self.g0.max(self.g1), arc.u1 - arc.u0);
        // With way R: y = 2R/(g + √(g² + 2cR)), and 2cR = part (high² − low²).
        let g = (low * low + part * (high - low) * (high + low)).sqrt();
        let y = if low + g > 0.0 { (width * part * ((low + high) / (low + g))).min(width) } else { 0.0 };
        let u = if self.g0 <= self.g1 { arc.u0 + y } else { arc.u1 - y };
        State { u: u.clamp(arc.u0, arc.u1), v, g, ..State::default() }
    }

    fn at_time(&self, arc: &ProfileArc, done: f64, left: f64) -> State {
        let v = self.v0 * left + self.v1 * done;
        let part = if self.g0 <= self.g1 { done * (self.v0 + v) } else { left * (self.v1 + v) };
        self.place(arc, part / (self.v0 + self.v1), v)
    }

    fn at(&self, arc: &ProfileArc, u: f64) -> State {
        let width = arc.u1 - arc.u0;
        let (before, after) = ((u - arc.u0) / width, (arc.u1 - u) / width);
        let g = if self.g0 <= self.g1 {
            self.g0 + (self.g1 - self.g0) * before
        } else {
            self.g1 + (self.g0 - self.g1) * after
        };
        // v² is linear in the way; from the nearer end, which may be at rest.
        let (part, near, far) = if before <= after {
            (before * (self.g0 + g), self.v0, self.v1)
        } else {
            (after * (self.g1 + g), self.v1, self.v0)
        };
        let part = part / (self.g0 + self.g1);
        let v = (near * near + part * (far - near) * (far + near)).max(0.0).sqrt();
        State { u, v, g, ..State::default() }
    }

    /// The part of the duration that has passed at a place.
    fn done(&self, arc: &ProfileArc, state: &State) -> f64 {
        let width = arc.u1 - arc.u0;
        let way = |y: f64, g: f64| y / width * (g + state.g) / (self.g0 + self.g1) * (self.v0 + self.v1);
        let done = if self.g0 <= self.g1 {
            way(state.u - arc.u0, self.g0) / (self.v0 + state.v)
        } else {
            1.0 - way(arc.u1 - state.u, self.g1) / (self.v1 + state.v)
        };
        // 0/0 at a standstill: only the end at rest has one.
        match done.is_nan() {
            false => done.clamp(0.0, 1.0),
            true => f64::from(self.g0 > self.g1),
        }
    }

    /// √p, s and s' where p is finite: s ∝ q'_k^(−3).
    fn rates(&self, c: f64, state: &State) -> (f64, f64, f64) {
        if state.g == 0.0 {
            // Axis k reverses here: the profile can only pass at the p that q''_k p = acceleration leaves.
            return (self.p_end.sqrt(), 0.0, 0.0);
        }
        let root = state.v / state.g;
        let s = self.sign * (self.acceleration - c * root * root) / state.g;
        (root, s, -3.0 * s * self.sign * c / state.g)
    }

    /// On a straight piece all axes move in proportion.
    fn straight<const M: usize>(&self, c: &[f64; M], state: &State) -> Rates<M> {
        let ratio: [f64; M] = std::array::from_fn(|l| c[l] / c[self.k]);
        Rates {
            velocity: ratio.map(|r| r * self.sign * state.v),
            acceleration: ratio.map(|r| r * self.acceleration),
            jerk: [0.0; M],
        }
    }
}
