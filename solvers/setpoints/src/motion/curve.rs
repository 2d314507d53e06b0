//! Motion along an arc on a piece of any degree, polynomial or rational; the speed may be that of a tool tip
//! whose joints the piece moves.
//!
//! With D = |C'|² of the path or of the tip, v² = D p is constant (`Feed`) or linear in u (`SpeedLine`), so that
//! s = ((v²)' − p D')/(2D) and s' = −(4 s D' + p D'')/(2D). Where axis k governs, with acceleration a,
//! s = (a − q''_k p)/q'_k and s' = −(q'''_k p + 3 q''_k s)/q'_k. Where the parameter has a constant acceleration
//! it is s itself (`even`). Where v, its change a and that one's change j are known along the path (`along`),
//! √D du/dt = v and its derivatives give those of u.
//!
//! These quotients are 0/0 where axis k turns round and at cusps, always at an end of the arc. Nearer to it than
//! rounding allows they are taken at a place a little farther off, and continued from there where p is finite.

use super::along::{Along, CubicLaw, JerkLaw};
use super::axis::{AxisLaw, End};
use super::even::EvenLaw;
use super::rate::{FromRest, Line, Rate, Source, Tip, TipSpeed, MAX_TIP};
use super::{fill, invert, parts, ProfileArc, Rates, State, JERK_STEP_ERROR};
use feedplan_geometry::arc_length::{quadrature, Node, Table};
use feedplan_geometry::inverse_length;
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::spline::speed::{Coefficients, Speed};
use feedplan_geometry::spline::Piece;
use feedplan_planner::phase_law::PhaseLaw;

/// How far from the end, in parts of the arc, where an axis turns round at a finite p. Continued from there s is
/// off by the square of this part; s and s' lose as many digits as it and its square have.
const OFF_TURN: f64 = 3e-5;
/// The same at a cusp that is passed, where p is infinite; the way grows with its square at least.
const OFF_CUSP: f64 = 1e-3;
/// An end is a cusp where D is below this part of that in the middle of the arc.
const SLOW: f64 = 1e-8;
/// A tangent is off a straight line by no more than this part of the longest one, which is rounding.
const OFF_LINE: f64 = 1e-14;
/// v² at a cusp is within this factor of v² at the other end, and is bisected so often, geometrically.
const LINE_RANGE: f64 = 1e12;
const LINE_ROUNDS: u32 = 60;

enum Law {
    Even(EvenLaw),
    Axis(Box<AxisLaw>),
    /// v² of the path or the tip.
    Speed(Line),
    Jerk(JerkLaw),
    Cubic(Box<CubicLaw>),
}

/// An arc with everything that its evaluation needs.
pub struct CurveMotion<'a, const M: usize> {
    piece: Piece<'a, M>,
    own: Coefficients<M>,
    /// D of the tip and its two derivatives.
    tip: Option<[Polynomial<MAX_TIP>; 3]>,
    /// What the axes count in D, and the hodograph of what counts, where the law is about their shares.
    counted: Option<Box<([f64; M], Coefficients<M>)>>,
    pub(super) arc: ProfileArc,
    law: Law,
    /// Derivatives are taken between these places.
    safe: [f64; 2],
    /// The end of the arc where C' vanishes, for tables; not a number where it does not.
    foot: f64,
    /// The direction of travel, where the arc is straight and begins or ends where the quotients are 0/0.
    straight: Option<[f64; M]>,
    lengths: Vec<Node>,
    /// By u; from rest, by the root of the way from there.
    times: Vec<Node>,
    /// The way of the path or the tip, for laws about it.
    ways: Vec<Node>,
    pub(super) length_error: f64,
    time_error: f64,
    way_error: f64,
}

/// Why nothing can follow an arc, whose numbers are finite, if its law is about the way along the path.
pub fn flaw<const M: usize>(
    piece: Piece<M>,
    tip: Option<TipSpeed>,
    arc: &ProfileArc,
) -> Option<&'static str> {
    if !arc.kind.is_along() {
        return None;
    }
    let motion = CurveMotion::bare(piece, tip, None, arc);
    let length = quadrature(&motion.time_rate(Line::ONE), arc.u0, arc.u1);
    if arc.kind == PhaseLaw::PathJerk {
        JerkLaw::new(arc, motion.end_speeds(), length).flaw()
    } else {
        CubicLaw::flaw(arc, motion.end_speeds(), length)
    }
}

impl<'a, const M: usize> CurveMotion<'a, M> {
    /// Without a law and its tables.
    fn bare(piece: Piece<'a, M>, tip: Option<TipSpeed>, share: Option<&[f64; M]>, arc: &ProfileArc) -> Self {
        let mut motion = Self {
            piece,
            own: Coefficients::new(&piece),
            tip: tip.map(|tip| tip.derivatives()),
            counted: share.map(|share| Box::new((*share, Coefficients::new(&piece).scaled(share)))),
            arc: *arc,
            law: Law::Even(EvenLaw::new(arc)),
            safe: [arc.u0, arc.u1],
            foot: f64::NAN,
            straight: None,
            lengths: vec![],
            times: vec![],
            ways: vec![],
            length_error: 0.0,
            time_error: 0.0,
            way_error: 0.0,
        };
        motion.foot = motion.cusp();
        motion
    }

    /// Prepares an arc; `with_lengths` tabulates its length whatever its kind.
    pub fn new(
        piece: Piece<'a, M>,
        tip: Option<TipSpeed>,
        share: Option<&[f64; M]>,
        arc: &ProfileArc,
        with_lengths: bool,
    ) -> Self {
        let mut motion = Self::bare(piece, tip, share, arc);
        if arc.kind.is_along() {
            let mut nodes = vec![];
            motion.way_error = fill(motion.time_rate(Line::ONE), (arc.u0, arc.u1), &mut nodes);
            motion.ways = nodes;
        }
        let axis = |acceleration: f64, speed: Option<f64>| {
            // Its duration tells the pace where the axis shows no motion.
            AxisLaw::new(&piece, arc, arc.axis as usize, acceleration, speed)
                .map_or(Law::Even(EvenLaw::pace(arc)), |law| Law::Axis(Box::new(law)))
        };
        motion.law = match arc.kind {
            PhaseLaw::AxisAcceleration => axis(arc.value, None),
            PhaseLaw::AxisVelocity => axis(0.0, Some(arc.value.sqrt())),
            PhaseLaw::Feed => Law::Speed(Line { start: arc.value, ..Line::ONE }),
            PhaseLaw::SpeedLine => Law::Speed(motion.speed_line()),
            PhaseLaw::PathJerk => Law::Jerk(JerkLaw::new(arc, motion.end_speeds(), motion.ways().total())),
            PhaseLaw::SpeedCubic => {
                Law::Cubic(Box::new(CubicLaw::new(arc, motion.end_speeds(), motion.ways().total())))
            }
            // `check` has refused chord limits here.
            PhaseLaw::ParameterAcceleration | PhaseLaw::Chord => Law::Even(EvenLaw::new(arc)),
        };
        motion.keep_off();
        if with_lengths {
            let mut nodes = vec![];
            motion.length_error = fill(motion.length_rate(), (arc.u0, arc.u1), &mut nodes);
            motion.lengths = nodes;
        }
        if let Law::Speed(line) = motion.law {
            let mut nodes = vec![];
            let (u0, u1) = (arc.u0, arc.u1);
            motion.time_error = match motion.rest_at_an_end(&line) {
                Some(rate) => fill(rate, (0.0, (u1 - u0).sqrt()), &mut nodes),
                None => fill(motion.time_rate(line), (u0, u1), &mut nodes),
            };
            motion.times = nodes;
        }
        motion
    }

    /// Where the derivatives cannot be taken at the ends.
    fn keep_off(&mut self) {
        let arc = self.arc;
        let ends = match &self.law {
            Law::Axis(law) => law.ends,
            Law::Speed(_) | Law::Jerk(_) | Law::Cubic(_) => {
                let middle = self.square(0.5 * (arc.u0 + arc.u1));
                [(arc.u0, arc.p0), (arc.u1, arc.p1)].map(|(u, p)| {
                    if p == f64::INFINITY || self.square(u) <= SLOW * middle {
                        End::Cusp
                    } else {
                        End::Regular
                    }
                })
            }
            Law::Even(_) => [End::Regular; 2],
        };
        let off = ends.map(|end| match end {
            End::Regular => 0.0,
            End::Turn => OFF_TURN * (arc.u1 - arc.u0),
            End::Cusp => OFF_CUSP * (arc.u1 - arc.u0),
        });
        self.safe = [arc.u0 + off[0], arc.u1 - off[1]];
        if off != [0.0; 2] && (self.tip.is_none() || matches!(self.law, Law::Axis(_))) {
            self.straight = self.direction();
        }
    }

    /// The direction of all tangents on the arc, if they have one but for rounding.
    fn direction(&self) -> Option<[f64; M]> {
        let [from, to] = [self.arc.u0, self.arc.u1].map(|u| derivatives(&self.piece, u)[0]);
        let way: [f64; M] = std::array::from_fn(|k| to[k] - from[k]);
        let direction = way.map(|x| x / norm(&way));
        let rows = self.own.hodograph();
        let longest = rows.iter().map(norm).fold(0.0, f64::max);
        let straight = rows.iter().all(|row| {
            let along = dot(row, &direction);
            (0..M).all(|k| (row[k] - along * direction[k]).abs() <= OFF_LINE * longest)
        });
        straight.then_some(direction)
    }

    /// v² at both ends. Where p is infinite the duration tells it.
    fn speed_line(&self) -> Line {
        let arc = &self.arc;
        let line =
            |from: f64, to: f64| Line { start: from, slope: (to - from) / (arc.u1 - arc.u0), u0: arc.u0 };
        let speed_sq = |u: f64, p: f64| self.square(u) * p;
        let solve = |known: f64, with: &dyn Fn(f64) -> Line| {
            let (mut low, mut high) = (known / LINE_RANGE, known * LINE_RANGE);
            for _ in 0..LINE_ROUNDS {
                let middle = (low * high).sqrt();
                let mut nodes = vec![];
                fill(self.time_rate(with(middle)), (arc.u0, arc.u1), &mut nodes);
                if nodes[nodes.len() - 1].sum > arc.duration {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            with((low * high).sqrt())
        };
        match (arc.p0.is_finite(), arc.p1.is_finite()) {
            (false, _) => {
                let to = speed_sq(arc.u1, arc.p1);
                solve(to, &|from| line(from, to))
            }
            (true, false) => {
                let from = speed_sq(arc.u0, arc.p0);
                solve(from, &|to| line(from, to))
            }
            (true, true) => line(speed_sq(arc.u0, arc.p0), speed_sq(arc.u1, arc.p1)),
        }
    }

    /// D at u.
    fn square(&self, u: f64) -> f64 {
        match &self.tip {
            Some([square, ..]) => square.value(u / self.piece.width),
            None => {
                let q = self.counts(&derivatives(&self.piece, u)[1]);
                dot(&q, &q)
            }
        }
    }

    /// What of a derivative counts in D.
    fn counts(&self, q: &[f64; M]) -> [f64; M] {
        match &self.counted {
            Some(counted) => std::array::from_fn(|k| counted.0[k] * q[k]),
            None => *q,
        }
    }

    /// v at both ends; not finite or not a number where p is infinite.
    fn end_speeds(&self) -> [f64; 2] {
        let arc = &self.arc;
        [(arc.u0, arc.p0), (arc.u1, arc.p1)].map(|(u, p)| (self.square(u) * p).sqrt())
    }

    fn cusp(&self) -> f64 {
        let own = |u: f64| {
            let q = derivatives(&self.piece, u)[1];
            dot(&q, &q)
        };
        let arc = &self.arc;
        let middle = own(0.5 * (arc.u0 + arc.u1));
        let at = |u: f64, p: f64| p == f64::INFINITY || own(u) <= SLOW * middle;
        if at(arc.u0, arc.p0) {
            arc.u0
        } else if at(arc.u1, arc.p1) {
            arc.u1
        } else {
            f64::NAN
        }
    }

    fn own(&self) -> Source<'_, M> {
        self.speed_of(&self.own)
    }

    fn speed_of<'b>(&'b self, coefficients: &'b Coefficients<M>) -> Source<'b, M> {
        let foot = self.foot;
        let speed = Speed::new(coefficients.hodograph(), coefficients.denominator(), self.piece.width);
        Source::Own(if foot.is_nan() { speed.without_foot() } else { speed.with_foot(foot) })
    }

    fn length_rate(&self) -> Rate<'_, M> {
        Rate { source: self.own(), line: Line::ONE, foot: self.foot }
    }

    fn source(&self) -> Source<'_, M> {
        match &self.tip {
            Some([square, ..]) => Source::Tip(Tip { square, width: self.piece.width }),
            None => self.speed_of(self.counted.as_ref().map_or(&self.own, |counted| &counted.1)),
        }
    }

    fn time_rate(&self, line: Line) -> Rate<'_, M> {
        Rate { source: self.source(), line, foot: self.foot }
    }

    /// Where the arc begins or ends at rest on a path with a direction there.
    fn rest_at_an_end(&self, line: &Line) -> Option<FromRest<'_, M>> {
        let ProfileArc { u0, u1, p0, p1, .. } = self.arc;
        let (place, sign) = match (p0 == 0.0, p1 == 0.0) {
            (true, false) => (u0, 1.0),
            (false, true) => (u1, -1.0),
            _ => return None,
        };
        let moves = line.slope != 0.0 && self.foot.is_nan();
        moves.then(|| FromRest { source: self.source(), place, sign, slope: line.slope.abs() })
    }

    /// The table of the arc's length; `with_lengths` must have been asked for.
    pub fn lengths(&self) -> Table<'_, Rate<'_, M>> {
        Table { f: self.length_rate(), nodes: &self.lengths }
    }

    fn times(&self, line: Line) -> Table<'_, Rate<'_, M>> {
        Table { f: self.time_rate(line), nodes: &self.times }
    }

    /// The way that a law is about.
    fn ways(&self) -> Table<'_, Rate<'_, M>> {
        Table { f: self.time_rate(Line::ONE), nodes: &self.ways }
    }

    /// Where a part of the way is done.
    fn at_part(&self, part: f64, along: Along, period: f64) -> State {
        let ways = self.ways();
        let total = ways.total();
        let tolerance = (JERK_STEP_ERROR * total * period / self.arc.duration).max(ways.rounding());
        let located = inverse_length::locate(&ways, part * total, tolerance);
        let error = (located.miss + self.way_error) / total;
        State { u: located.u, iterations: located.iterations, error, along, ..State::default() }
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
            Law::Speed(line) => match self.rest_at_an_end(line) {
                Some(f) => {
                    let table = Table { f, nodes: &self.times };
                    let done = if f.sign > 0.0 { done } else { left };
                    let state = invert(&table, self.time_error, &self.arc, done, period);
                    State { u: f.u(state.u), ..state }
                }
                None => invert(&self.times(*line), self.time_error, &self.arc, done, period),
            },
            Law::Jerk(law) => {
                let (part, along) = law.at_time(done, left);
                self.at_part(part, along, period)
            }
            Law::Cubic(law) => {
                let (found, along) = law.at_time(done, period);
                let state = self.at_part(found.u, along, period);
                let iterations = state.iterations.max(found.iterations);
                State { iterations, error: state.error + found.miss, ..state }
            }
        }
    }

    /// The place with parameter u.
    pub fn at(&self, u: f64) -> State {
        let part = || {
            let ways = self.ways();
            ways.integral(u) / ways.total()
        };
        match &self.law {
            Law::Axis(law) => law.at(&self.arc, u),
            Law::Jerk(law) => State { u, along: law.at_part(part()), ..State::default() },
            Law::Cubic(law) => State { u, along: law.at_part(part()), ..State::default() },
            _ => State { u, ..State::default() },
        }
    }

    /// Seconds from the start of the arc to a place.
    pub fn time(&self, state: &State) -> f64 {
        let done = match &self.law {
            Law::Jerk(_) | Law::Cubic(_) => return state.along.t,
            Law::Even(law) => law.done(&self.arc, state.u),
            Law::Axis(law) => law.done(&self.arc, state),
            Law::Speed(line) => match self.rest_at_an_end(line) {
                Some(f) => {
                    let table = Table { f, nodes: &self.times };
                    let done = table.integral((state.u - f.place).abs().sqrt()) / table.total();
                    if f.sign > 0.0 {
                        done
                    } else {
                        1.0 - done
                    }
                }
                None => {
                    let times = self.times(*line);
                    times.integral(state.u) / times.total()
                }
            },
        };
        self.arc.duration * done
    }

    /// Position, and velocity, acceleration and jerk at a place.
    pub fn sample(&self, state: &State) -> ([f64; M], Rates<M>) {
        let q = derivatives(&self.piece, state.u);
        if let Some(direction) = &self.straight {
            return (q[0], self.on_line(direction, state));
        }
        let at = state.u.clamp(self.safe[0], self.safe[1]);
        let there = if at == state.u { q } else { derivatives(&self.piece, at) };
        let rates = match &self.law {
            Law::Even(law) => rates(&q, law.root(&self.arc, state.u), law.s, 0.0),
            Law::Speed(line) => self.at_speed(line, at, &there),
            Law::Axis(law) => self.by_axis(law, state, &q, at, &there),
            Law::Jerk(_) | Law::Cubic(_) => self.by_way(&state.along, at, &there),
        };
        (q[0], rates)
    }

    /// Along a straight line all axes move in proportion.
    fn on_line(&self, direction: &[f64; M], state: &State) -> Rates<M> {
        let [v, a, j] = match &self.law {
            Law::Axis(law) => {
                let scale = 1.0 / direction[law.k];
                [scale * law.sign * state.v, scale * law.acceleration, 0.0]
            }
            Law::Speed(line) => {
                // v dv/ds with ds = √D du, and its change with time.
                let u = state.u.clamp(self.safe[0], self.safe[1]);
                let q = derivatives(&self.piece, u);
                let (square, slope) = (dot(&q[1], &q[1]), 2.0 * dot(&q[1], &q[2]));
                let a = 0.5 * line.slope / square.sqrt();
                // A law about shares has one speed, of what counts.
                let speed = line.at(state.u).sqrt() / norm(&self.counts(direction));
                [speed, a, -0.5 * a * slope / square * (line.at(u) / square).sqrt()]
            }
            Law::Jerk(_) | Law::Cubic(_) => [state.along.v, state.along.a, state.along.j],
            // Such an arc has no end where the quotients are 0/0.
            Law::Even(_) => [0.0; 3],
        };
        let along = |size: f64| direction.map(|x| x * size);
        Rates { velocity: along(v), acceleration: along(a), jerk: along(j) }
    }

    /// D and its derivatives at u.
    fn squares(&self, u: f64, q: &[[f64; M]; 4]) -> [f64; 3] {
        match &self.tip {
            Some(tip) => [0, 1, 2].map(|order| tip[order].value(u / self.piece.width)),
            None => {
                let q = q.each_ref().map(|q| self.counts(q));
                let bend = 2.0 * (dot(&q[2], &q[2]) + dot(&q[1], &q[3]));
                [dot(&q[1], &q[1]), 2.0 * dot(&q[1], &q[2]), bend]
            }
        }
    }

    /// With g = √D: g u̇ = v, g ü + g' u̇² = a, g u⃛ + 3 g' u̇ ü + g'' u̇³ = j, all finite at a standstill.
    fn by_way(&self, along: &Along, u: f64, q: &[[f64; M]; 4]) -> Rates<M> {
        let [square, slope, bend] = self.squares(u, q);
        let g = square.sqrt();
        let dg = 0.5 * slope / g;
        let ddg = (0.5 * bend - dg * dg) / g;
        let first = along.v / g;
        let second = (along.a - dg * first * first) / g;
        let third = (along.j - first * (3.0 * dg * second + ddg * first * first)) / g;
        Rates {
            velocity: q[1].map(|q| q * first),
            acceleration: std::array::from_fn(|l| q[1][l] * second + q[2][l] * first * first),
            jerk: std::array::from_fn(|l| {
                q[1][l] * third + first * (3.0 * q[2][l] * second + q[3][l] * first * first)
            }),
        }
    }

    fn at_speed(&self, line: &Line, u: f64, q: &[[f64; M]; 4]) -> Rates<M> {
        let [square, slope, bend] = self.squares(u, q);
        let p = line.at(u) / square;
        let s = (line.slope - p * slope) / (2.0 * square);
        rates(q, p.sqrt(), s, -(4.0 * s * slope + p * bend) / (2.0 * square))
    }

    /// From the derivatives q at the place itself and those `there`, at a place where all quotients have digits.
    fn by_axis(
        &self,
        law: &AxisLaw,
        state: &State,
        q: &[[f64; M]; 4],
        at: f64,
        there: &[[f64; M]; 4],
    ) -> Rates<M> {
        let k = law.k;
        let near = if at == state.u { *state } else { law.at(&self.arc, at) };
        let (root, g) = (near.v / near.g, law.sign * near.g);
        let p = root * root;
        let s = (law.acceleration - there[2][k] * p) / g;
        let ds = -(there[3][k] * p + 3.0 * there[2][k] * s) / g;
        let mut rates = if at == state.u {
            rates(q, root, s, ds)
        } else if law.ends[usize::from(at < state.u)] == End::Cusp {
            // All axes move in proportion there.
            Rates { velocity: there[1].map(|q| q / near.g * state.v), ..rates(there, root, s, ds) }
        } else {
            let off = state.u - at;
            rates(q, (p + off * (2.0 * s + off * ds)).max(0.0).sqrt(), s + off * ds, ds)
        };
        rates.velocity[k] = law.sign * state.v;
        rates.acceleration[k] = law.acceleration;
        rates.jerk[k] = 0.0;
        rates
    }
}

/// Velocity, acceleration and jerk from q and its derivatives by u, and √p, s and s'.
#[inline(always)]
fn rates<const M: usize>(q: &[[f64; M]; 4], root: f64, s: f64, ds: f64) -> Rates<M> {
    let p = root * root;
    Rates {
        velocity: q[1].map(|q| q * root),
        acceleration: std::array::from_fn(|l| q[1][l] * s + q[2][l] * p),
        jerk: std::array::from_fn(|l| root * (q[1][l] * ds + 3.0 * q[2][l] * s + q[3][l] * p)),
    }
}
