//! A subrun by its arc length: the parameter at a length, the axes' derivatives by the length, and the speed cap.
//!
//! The arc length s [mm] is that of all axes of the path together, so that it grows wherever an axis moves. The feed
//! may count fewer axes; it then limits the speed along s by the quotient of both speeds. With D(u) = |C'(u)|², s' = √D
//! and
//!
//!   u' = D^(−1/2),   u'' = −D_u / (2 D²),   u''' = D^(−1/2) (D_u² / D³ − D_uu / (2 D²))
//!
//! A part has a table once something inside it is asked for: between two rows u(s) is the quintic with their u, u' and
//! u''. The stations of a profile are located to rounding, by Newton's method on the quadrature of √D.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::curvature_jumps::{passages, Jump, Passage};
use crate::path_limits::chord_speed;
use crate::path_problem::{Geometry, PathPoint, SpeedCap};
use feedplan_geometry::arc_length::{W, X};
use feedplan_geometry::quadratic::{dot, norm};
use feedplan_geometry::spline::bezier::{self, derivatives};
use feedplan_geometry::spline::rational::Hodograph;
use feedplan_geometry::spline::Piece;
use feedplan_geometry::tolerance::CUSP;
use feedplan_planner::problem::{self, Both, Problem};

/// Accuracy of the quadrature of a panel, as a part of its length …
const QUADRATURE: f64 = 1e-12;
/// … and of the quintic half-way; the halves that are kept are 64 times as accurate. Near a sharp turn panels are as
/// short as the turn, and the third derivatives need digits of that length.
const QUINTIC: f64 = 1e-9;
/// Greatest error of a quintic that is right half-way, over that of its rate half-way: by (t − ½)(t(1 − t))³.
const ODD: f64 = 0.12;
/// Panels shorter than this part of their piece are not halved.
const SHORTEST: f64 = 1e-14;
/// Relative rounding of tangents and parameters.
const ROUNDING: f64 = 4e-15;
/// Tables get about this many rows at most; beside a turn of 1e-10 of its piece some 700 are used.
const MOST_ROWS: usize = 20_000;
/// Panels are halved at most this often.
const DEPTH: u32 = 48;
/// Parts of a piece between the samples of its speed.
const SAMPLES: usize = 8;
/// Most steps to locate a length: one or two of Newton's, or next to a cusp, where they stray, as many bisections as u
/// has bits.
const STEPS: usize = 64;
/// Tangents of a straight piece leave its direction by at most this part of their length and this many roundings.
const OFF_LINE: f64 = 1e-12;
const ROUNDINGS: f64 = 16.0;
/// Derivatives are evaluated at least this far from a point where D vanishes, as a part of the length.
const INSET: f64 = 1e-9;
/// Most coefficients of D.
pub const MAX_RATE: usize = 40;

/// The part of a piece between two parameters, without a cusp inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    pub piece: usize,
    pub u: [f64; 2],
}

/// Where two parts meet.
#[derive(Clone, Copy, Debug)]
pub struct Junction {
    /// The speed cap by a corner or a jump of q'', and the tighter limits of jerk around the jump.
    pub cap: SpeedCap,
    /// Whether the jump sets the cap.
    pub jumps: bool,
}

/// One row of a table: u, u' and u'' at a length s from the start of the part.
#[derive(Clone, Copy, Debug)]
struct Row {
    s: f64,
    u: f64,
    rate: f64,
    bend: f64,
}

/// What is known of a part without its table.
#[derive(Clone, Debug)]
struct Measures<const M: usize> {
    length: f64,
    /// The direction of motion and the speed by the feed, where the direction is constant and s that of the axes.
    straight: Option<([f64; M], f64)>,
    /// Lengths between which derivatives are evaluated.
    inside: [f64; 2],
}

/// The parts of a subrun, by arc length.
#[derive(Clone)]
pub struct ArcLengthPath<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    pub parts: &'a [Part],
    measures: Vec<Measures<M>>,
    tables: Vec<OnceLock<Box<[Row]>>>,
    knots: Vec<f64>,
}

/// Piece `i` of the path; with equal weights it is polynomial.
pub fn piece<'a, const M: usize>(problem: &Problem<'a, M>, i: usize) -> Piece<'a, M> {
    plain(problem.control, problem.weight, problem.offset, problem.width, i)
}

/// Piece `i` of the tool's path, where the axes are not those of the tool.
pub fn tip_piece<'a, const M: usize>(problem: &Problem<'a, M>, i: usize) -> Option<Piece<'a, 3>> {
    problem.tip.map(|tip| plain(tip.control, tip.weight, tip.offset, problem.width, i))
}

fn plain<'a, const M: usize>(
    control: &'a [[f64; M]],
    weight: &'a [f64],
    offset: &[usize],
    width: &[f64],
    i: usize,
) -> Piece<'a, M> {
    let range = offset[i]..offset[i + 1];
    let weights = weight.get(range.clone()).unwrap_or(&[]);
    let weights = if weights.windows(2).all(|pair| pair[0] == pair[1]) { &[] } else { weights };
    Piece { control: &control[range], weights, width: width[i] }
}

/// The direction of a straight piece at u; None for other pieces. A tangent much shorter than the longest may leave the
/// line by a small part of the longest and still turn sharply.
pub fn straight<const M: usize>(piece: &Piece<M>, u: f64) -> Option<[f64; M]> {
    let hodograph = Hodograph::new(piece);
    let tangents = hodograph.coefficients();
    let longest = tangents.iter().max_by(|a, b| norm(a).total_cmp(&norm(b)))?;
    let length = norm(longest);
    let mut direction = longest.map(|x| x / length);
    let edge = |pair: &[[f64; M]]| norm::<M>(&std::array::from_fn(|k| pair[1][k] - pair[0][k]));
    let edge = piece.control.windows(2).map(edge).fold(0.0, f64::max);
    let coordinate = piece.control.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let rounding = ROUNDINGS * f64::EPSILON * coordinate / edge * length;
    let on_line = tangents.iter().all(|tangent| {
        let along = dot(tangent, &direction);
        let off: [f64; M] = std::array::from_fn(|k| tangent[k] - along * direction[k]);
        norm(&off) <= (OFF_LINE * length).min(OFF_LINE * along.abs() + rounding)
    });
    if dot(&derivatives(piece, u)[1], &direction) < 0.0 {
        direction = direction.map(|x| -x);
    }
    on_line.then_some(direction)
}

/// D, D_u and D_uu at u of piece `i`, from the derivatives of its axes.
#[inline]
fn rate<const M: usize>(problem: &Problem<M>, i: usize, u: f64, [_, c1, c2, c3]: &[[f64; M]; 4]) -> [f64; 3] {
    match problem.way {
        Some(way) => polynomial(way.of(i), problem.width[i], u),
        None => [dot(c1, c1), 2.0 * dot(c1, c2), 2.0 * (dot(c2, c2) + dot(c1, c3))],
    }
}

/// A squared speed and its first two derivatives at u, from its Bernstein coefficients.
#[inline]
fn polynomial(coefficients: &[f64], width: f64, u: f64) -> [f64; 3] {
    let n = coefficients.len() - 1;
    let t = u / width;
    let mut b = [0.0; MAX_RATE];
    b[..=n].copy_from_slice(coefficients);
    let mut out = [0.0; 3];
    // De Casteljau's triangle: its last three rows hold the value and the derivatives.
    for left in (0..=n).rev() {
        let degree = n as f64;
        match left {
            2 => out[2] = degree * (degree - 1.0) * ((b[2] - b[1]) - (b[1] - b[0])) / (width * width),
            1 => out[1] = degree * (b[1] - b[0]) / width,
            0 => out[0] = b[0],
            _ => {}
        }
        for j in 0..left {
            b[j] = (1.0 - t) * b[j] + t * b[j + 1];
        }
    }
    // A D that touches 0 may be rounded below it.
    out[0] = out[0].max(0.0);
    out
}

/// An upper bound on the speed by the acceleration limits: the acceleration of turning across the direction of motion,
/// which no acceleration along it can reduce. NaN without such acceleration.
fn turning_speed<const M: usize>(path_point: &PathPoint<M>, limits: &Both<M>) -> f64 {
    let PathPoint { first, second, .. } = path_point;
    let along = dot(second, first) / dot(first, first);
    let across: [f64; M] = std::array::from_fn(|k| second[k] - along * first[k]);
    let limit = |k: usize| limits[usize::from(across[k] < 0.0)][k];
    let most = (0..M).map(|k| across[k].abs() * limit(k)).sum::<f64>();
    (most / dot(&across, &across)).sqrt()
}

/// The speed along s over that which the feed limits, at u of piece `i` with this D; infinite without a limit.
pub fn per_feed<const M: usize>(problem: &Problem<M>, i: usize, u: f64, d: f64) -> f64 {
    let square = match (problem.tip, problem.share(i)) {
        (Some(tip), _) => polynomial(tip.speed.of(i), problem.width[i], u)[0],
        (None, None) => return 1.0,
        (None, Some(share)) => {
            let tangent = derivatives(&piece(problem, i), u)[1];
            (0..M).map(|k| (share[k] * tangent[k]).powi(2)).sum()
        }
    };
    (d / square).sqrt()
}

pub fn speed_sq<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> f64 {
    match problem.way {
        Some(way) => polynomial(way.of(i), problem.width[i], u)[0],
        None => {
            let tangent = derivatives(&piece(problem, i), u)[1];
            dot(&tangent, &tangent)
        }
    }
}

/// D at four u of piece `i`.
fn speeds_sq<const M: usize>(problem: &Problem<M>, i: usize, u: [f64; 4]) -> [f64; 4] {
    if problem.way.is_some() {
        u.map(|u| speed_sq(problem, i, u))
    } else {
        bezier::speeds_sq(&piece(problem, i), u)
    }
}

/// The length between two parameters of piece `i`, by one Gauss rule of eight points.
fn panel<const M: usize>(problem: &Problem<M>, i: usize, a: f64, b: f64) -> f64 {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let below = speeds_sq(problem, i, X.map(|x| middle - x * half));
    let above = speeds_sq(problem, i, X.map(|x| middle + x * half));
    let [f0, f1, f2, f3] = std::array::from_fn(|lane| W[lane] * (below[lane].sqrt() + above[lane].sqrt()));
    half * ((f0 + f2) + (f1 + f3))
}

impl Row {
    fn new<const M: usize>(problem: &Problem<M>, i: usize, u: f64, s: f64) -> Self {
        let [d, d1, _] = rate(problem, i, u, &derivatives(&piece(problem, i), u));
        Self { s, u, rate: 1.0 / d.sqrt(), bend: -0.5 * d1 / (d * d) }
    }

    /// du/ds of the quintic at s.
    fn rate_between(&self, next: &Self, s: f64) -> f64 {
        let h = next.s - self.s;
        let t = (s - self.s) / h;
        let r = 1.0 - t;
        30.0 * t * t * r * r * (next.u - self.u) / h
            + self.rate * r * r * (1.0 + 2.0 * t - 15.0 * t * t)
            + next.rate * t * t * (1.0 + 2.0 * r - 15.0 * r * r)
            + 0.5
                * h
                * (self.bend * t * r * r * (2.0 * r - 3.0 * t) + next.bend * t * t * r * (3.0 * r - 2.0 * t))
    }

    /// u of the quintic at s between two rows.
    #[inline]
    fn parameter_at(&self, next: &Self, s: f64) -> f64 {
        let h = next.s - self.s;
        let t = if h > 0.0 { (s - self.s) / h } else { 0.0 };
        let (r, t2) = (1.0 - t, t * t);
        let r2 = r * r;
        let left = self.u * (1.0 + 3.0 * t + 6.0 * t2)
            + self.rate * h * t * (1.0 + 3.0 * t)
            + 0.5 * self.bend * h * h * t2;
        let right = next.u * (1.0 + 3.0 * r + 6.0 * r2) - next.rate * h * r * (1.0 + 3.0 * r)
            + 0.5 * next.bend * h * h * r2;
        let u = left * r2 * r + right * t2 * t;
        // Next to a cusp the quintic may leave its range.
        if u >= self.u && u <= next.u {
            u
        } else {
            self.u + t * (next.u - self.u)
        }
    }
}

/// Halves the panels of a part until its quadrature is accurate, for its length, or its quintics too, for its table.
struct Halving<'a, const M: usize> {
    problem: &'a Problem<'a, M>,
    part: &'a Part,
    /// The length by one panel, and the greatest of some tangents.
    whole: f64,
    fastest: f64,
}

impl<'a, const M: usize> Halving<'a, M> {
    fn new(problem: &'a Problem<'a, M>, part: &'a Part) -> Self {
        let ([a, b], i) = (part.u, part.piece);
        let at = |n: usize| a + (b - a) * n as f64 / SAMPLES as f64;
        let inside = [[1, 2, 3, 4], [5, 6, 7, 8]].map(|some| speeds_sq(problem, i, some.map(at)));
        let fastest = inside.into_iter().flatten().fold(speed_sq(problem, i, a), f64::max).sqrt();
        Self { problem, part, whole: panel(problem, i, a, b), fastest }
    }

    /// The rounding of a length up to u: that of tangents is relative to the longest tangent, that of u to itself.
    fn noise(&self, [a, b]: [f64; 2], rate: f64) -> f64 {
        ROUNDING * ((b - a) * self.fastest + b / rate)
    }

    /// Whether the length of a panel by its halves is that by the whole, or too short to tell.
    fn is_met(&self, length: f64, whole: f64, noise: f64) -> bool {
        (length - whole).abs() <= QUADRATURE * length + noise || length <= SHORTEST * self.whole
    }

    /// The length between two parameters, with that of one panel.
    fn length(&self, [a, b]: [f64; 2], whole: f64, depth: u32) -> f64 {
        let middle = 0.5 * (a + b);
        let halves = [[a, middle], [middle, b]];
        let [left, right] = halves.map(|[a, b]| panel(self.problem, self.part.piece, a, b));
        let length = left + right;
        if depth == DEPTH || self.is_met(length, whole, self.noise([a, b], (b - a) / length)) {
            return length;
        }
        self.length(halves[0], left, depth + 1) + self.length(halves[1], right, depth + 1)
    }

    fn table(&self) -> Vec<Row> {
        let mut rows = vec![Row::new(self.problem, self.part.piece, self.part.u[0], 0.0)];
        self.halve(&mut rows, self.part.u[1], self.whole, 0);
        rows
    }

    /// Appends rows for the panel from the last row to b.
    fn halve(&self, rows: &mut Vec<Row>, b: f64, whole: f64, depth: u32) {
        let from = rows[rows.len() - 1];
        let middle = 0.5 * (from.u + b);
        let [left, right] =
            [(from.u, middle), (middle, b)].map(|(a, b)| panel(self.problem, self.part.piece, a, b));
        let half = Row::new(self.problem, self.part.piece, middle, from.s + left);
        let end = Row::new(self.problem, self.part.piece, b, from.s + left + right);
        // On a symmetric part the quintic is right half-way and wrong on both sides; only its rate shows this.
        let odd = ODD * (end.s - from.s) * (from.rate_between(&end, half.s) - half.rate);
        let mut miss = (from.parameter_at(&end, half.s) - middle).abs().max(odd.abs()) / half.rate;
        let length = left + right;
        if !(from.rate.is_finite() && end.rate.is_finite() && miss.is_finite()) {
            miss = length;
        }
        let noise = self.noise([from.u, b], half.rate) + f64::EPSILON * end.s;
        let met = self.is_met(length, whole, noise)
            && (miss <= QUINTIC * length + noise || length <= SHORTEST * self.whole);
        if met || rows.len() > MOST_ROWS || depth == DEPTH {
            rows.extend([half, end]);
        } else {
            self.halve(rows, middle, left, depth + 1);
            self.halve(rows, b, right, depth + 1);
        }
    }
}

impl<const M: usize> Measures<M> {
    fn new(problem: &Problem<M>, part: &Part) -> Self {
        let ([a, b], i) = (part.u, part.piece);
        let halving = Halving::new(problem, part);
        let length = halving.length(part.u, halving.whole, 0);
        let slowest = (b - a) / length / CUSP;
        let inset =
            |u: f64| if speed_sq(problem, i, u).sqrt() * slowest > 1.0 { 0.0 } else { INSET * length };
        let straight = match problem.way {
            Some(_) => None,
            None => {
                let u = 0.5 * (a + b);
                straight(&piece(problem, i), u).map(|direction| {
                    (direction, problem.feed[i] * per_feed(problem, i, u, speed_sq(problem, i, u)))
                })
            }
        };
        Self { length, straight, inside: [inset(a), length - inset(b)] }
    }
}

impl<'a, const M: usize> ArcLengthPath<'a, M> {
    pub fn new(problem: &'a Problem<'a, M>, parts: &'a [Part]) -> Self {
        let measures = |part| {
            problem.watch.check();
            Measures::new(problem, part)
        };
        Self::measured(problem, parts, parts.par_iter().with_min_len(16).map(measures).collect())
    }

    fn measured(problem: &'a Problem<'a, M>, parts: &'a [Part], measures: Vec<Measures<M>>) -> Self {
        let mut knots = vec![0.0];
        let mut total = 0.0;
        for own in &measures {
            total += own.length;
            knots.push(total);
        }
        Self { problem, parts, measures, tables: vec![OnceLock::new(); parts.len()], knots }
    }

    /// The parts that two lengths have between them, with tables and lengths of their own, and the index of the first. Lengths
    /// from there keep digits that those of a path of half a kilometre do not have.
    pub fn between(&self, [from, to]: [f64; 2]) -> (Self, usize) {
        let first = self.part(from);
        let end = first + 1 + self.knots[first + 1..].partition_point(|&knot| knot < to);
        (Self::measured(self.problem, &self.parts[first..end], self.measures[first..end].to_vec()), first)
    }

    fn table(&self, part: usize) -> &[Row] {
        self.tables[part].get_or_init(|| {
            let mut rows = Halving::new(self.problem, &self.parts[part]).table();
            let last = rows.len() - 1;
            // All rows share what the lengths differ by: the last panel alone may be shorter than a turn.
            let (length, sum) = (self.measures[part].length, rows[last].s);
            rows.iter_mut().for_each(|row| row.s *= length / sum);
            rows[last].s = length;
            rows.into()
        })
    }

    /// The length of all parts, in mm.
    pub fn total(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// The part that holds an arc length.
    pub fn part(&self, s: f64) -> usize {
        self.knots[1..self.knots.len() - 1].partition_point(|&knot| knot <= s)
    }

    /// The parameter at the arc length s on a part, to rounding.
    pub fn locate(&self, part: usize, s: f64) -> f64 {
        let at = &self.parts[part];
        if s <= self.knots[part] {
            return at.u[0];
        }
        if s >= self.knots[part + 1] {
            return at.u[1];
        }
        let x = s - self.knots[part];
        let [from, to] = around(self.table(part), x);
        let (mut low, mut high) = (from.u, to.u);
        let mut u = from.parameter_at(to, x);
        // Lengths from the nearer row have the digits of a place next to an end of the part.
        let ahead = to.s - x < x - from.s;
        for _ in 0..STEPS {
            let miss = if ahead {
                to.s - panel(self.problem, at.piece, u, to.u) - x
            } else {
                from.s + panel(self.problem, at.piece, from.u, u) - x
            };
            if miss > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let step = miss / speed_sq(self.problem, at.piece, u).sqrt();
            let next = u - step;
            u = if next >= low && next <= high { next } else { 0.5 * (low + high) };
            if step.abs() <= 1e-15 * at.u[1] {
                break;
            }
        }
        u
    }

    /// The parameter at a distance in mm from another one, ahead or back, to its own digits; its arc length is about s.
    pub fn parameter_beside(&self, part: usize, from: f64, distance: f64, s: f64) -> f64 {
        let at = &self.parts[part];
        let [mut low, mut high] = if distance > 0.0 { [from, at.u[1]] } else { [at.u[0], from] };
        let mut u = self.locate(part, s).clamp(low, high);
        // Next to a cusp one step of Newton's method is not enough: |C'| changes within the digits of s.
        for _ in 0..STEPS {
            let miss = self.length_between(part, from.min(u), from.max(u)).copysign(u - from) - distance;
            if miss > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let step = miss / speed_sq(self.problem, at.piece, u).sqrt();
            let next = u - step;
            u = if next >= low && next <= high { next } else { 0.5 * (low + high) };
            if step.abs() <= 1e-15 * at.u[1] {
                break;
            }
        }
        u
    }

    /// The length between two parameters of a part; short lengths have all their digits.
    pub fn length_between(&self, part: usize, a: f64, b: f64) -> f64 {
        if [a, b] == self.parts[part].u {
            return self.measures[part].length;
        }
        let (rows, at) = (self.table(part), self.parts[part].piece);
        let row = |u: f64| rows[1..rows.len() - 1].partition_point(|row| row.u <= u);
        let (i, j) = (row(a), row(b));
        if i == j {
            return panel(self.problem, at, a, b);
        }
        let inside: f64 =
            rows[i + 1..=j].windows(2).map(|pair| panel(self.problem, at, pair[0].u, pair[1].u)).sum();
        panel(self.problem, at, a, rows[i + 1].u) + inside + panel(self.problem, at, rows[j].u, b)
    }

    /// The direction of all parts and the speed by their feed, if both are the same on all parts.
    pub fn line(&self) -> Option<([f64; M], f64)> {
        let (direction, feed) = self.measures[0].straight?;
        let alike = self.measures.iter().all(|own| {
            own.straight.is_some_and(|(other, speed)| {
                speed == feed && (0..M).all(|k| (other[k] - direction[k]).abs() <= OFF_LINE)
            })
        });
        alike.then_some((direction, feed))
    }

    /// The junctions between parts, in order: the first one is that of parts 0 and 1.
    pub fn junctions(&self, jerk: &[f64; M]) -> Vec<Junction> {
        let problem = self.problem;
        let jumps: Vec<Jump<M>> = (1..self.parts.len())
            .map(|i| {
                problem.watch.check_at(i);
                let s = self.knots[i];
                let (before, after) = (self.end(i - 1, 1), self.end(i, 0));
                let smooth = self.is_smooth(i);
                let jump = |k: usize| (after.second[k] - before.second[k]).abs() / jerk[k];
                let mut speed = self.corner(i);
                for path_point in [&before, &after] {
                    speed = speed
                        .min(problem::along(&problem.max_velocity, &path_point.first))
                        .min(path_point.speed_cap)
                        .min(turning_speed(path_point, &problem.max_acceleration));
                }
                // Up and down.
                let mut changes = [f64::INFINITY; 2];
                for PathPoint { first, second, .. } in [&before, &after] {
                    let room = problem
                        .max_acceleration
                        .map(|most| std::array::from_fn(|k| most[k] + second[k].abs() * speed * speed));
                    changes[0] = changes[0].min(problem::along(&room, first));
                    changes[1] = changes[1].min(problem::along(&room, &first.map(|first| -first)));
                }
                let acceleration = changes[0].max(changes[1]);
                let change = std::array::from_fn(|k| if smooth { 0.0 } else { jump(k) });
                Jump { s, change, speed, acceleration }
            })
            .collect();
        let passages = passages(&jumps, problem.period);
        let junction = |(i, (passage, jump)): (usize, (&Passage, &Jump<M>))| {
            // A corner above the speed by other limits needs no cap.
            let corner = Some(self.corner(i + 1)).filter(|corner| *corner <= jump.speed);
            let Passage { speed, reach, share } = *passage;
            let cap = SpeedCap { s: jump.s, speed: corner.unwrap_or(f64::INFINITY).min(speed), reach, share };
            Junction { cap, jumps: speed < f64::INFINITY }
        };
        passages.iter().zip(&jumps).enumerate().map(junction).collect()
    }

    /// Derivatives and speed cap at the start (0) or the end (1) of a part.
    pub fn end(&self, part: usize, end: usize) -> PathPoint<M> {
        let (own, at) = (&self.measures[part], &self.parts[part]);
        if own.straight.is_none() && own.inside[end] == [0.0, own.length][end] {
            path_point(self.problem, at.piece, at.u[end])
        } else {
            self.at(part, self.knots[part + end])
        }
    }

    /// Whether a part and the part before it belong to one piece, which is smooth where they meet.
    fn is_smooth(&self, part: usize) -> bool {
        self.parts[part].piece == self.parts[part - 1].piece
    }

    /// The greatest speed by the corner between a part and the part before it.
    fn corner(&self, part: usize) -> f64 {
        if self.is_smooth(part) {
            f64::INFINITY
        } else {
            self.problem.junction_speed[self.parts[part].piece]
        }
    }

    /// The caps at junctions, and those without speed where tighter limits of jerk begin or end alone.
    pub fn caps(&self, junctions: &[Junction]) -> Vec<SpeedCap> {
        let asks = |junction: &&Junction| junction.cap.speed < f64::INFINITY || junction.cap.share > 0.0;
        let own: Vec<SpeedCap> = junctions.iter().filter(asks).map(|junction| junction.cap).collect();
        let mut out = Vec::with_capacity(3 * own.len());
        for (i, cap) in own.iter().enumerate() {
            let before = if i == 0 { 0.0 } else { own[i - 1].s + own[i - 1].reach };
            let after = own.get(i + 1).map_or(self.total(), |next| next.s - next.reach);
            let [from, to] = [cap.s - cap.reach, cap.s + cap.reach];
            if cap.share > 0.0 && before < from && from < cap.s {
                out.push(SpeedCap::new(from, f64::INFINITY));
            }
            out.push(*cap);
            if cap.share > 0.0 && cap.s < to && to < after {
                out.push(SpeedCap::new(to, f64::INFINITY));
            }
        }
        out
    }

    /// The direction of motion on a part where it is constant.
    pub fn direction(&self, part: usize) -> Option<[f64; M]> {
        self.measures[part].straight.map(|(direction, _)| direction)
    }

    /// The greatest speed by the chord error at a curvature, in mm/s.
    pub fn chord_speed(&self, curvature: f64) -> f64 {
        chord_limit(self.problem, curvature)
    }
}

/// The rows of a table around a length.
fn around(rows: &[Row], s: f64) -> [&Row; 2] {
    let i = rows[1..rows.len() - 1].partition_point(|row| row.s <= s);
    [&rows[i], &rows[i + 1]]
}

/// Curvature of the tool's path at u of piece `i`, in 1/mm.
pub fn tool_curvature<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> f64 {
    match tip_piece(problem, i) {
        Some(tip) => curvature(&tip, u).0,
        None => curvature(&piece(problem, i), u).0,
    }
}

/// Derivatives and speed cap at u of piece `i`.
pub fn path_point<const M: usize>(problem: &Problem<M>, i: usize, u: f64) -> PathPoint<M> {
    let c = derivatives(&piece(problem, i), u);
    let [d, d1, d2] = rate(problem, i, u, &c);
    let [_, c1, c2, c3] = c;
    let (u1, per_d_sq) = (1.0 / d.sqrt(), 1.0 / (d * d));
    let u2 = -0.5 * d1 * per_d_sq;
    let u3 = u1 * per_d_sq * (d1 * d1 / d - 0.5 * d2);
    let (mut first, mut second, mut third) = ([0.0; M], [0.0; M], [0.0; M]);
    for k in 0..M {
        first[k] = c1[k] * u1;
        second[k] = c2[k] * u1 * u1 + c1[k] * u2;
        third[k] = c3[k] * u1 * u1 * u1 + 3.0 * c2[k] * u1 * u2 + c1[k] * u3;
    }
    let mut speed_cap = problem.feed[i] * per_feed(problem, i, u, d);
    if problem.chord_tolerance.is_finite() {
        let chord = match tip_piece(problem, i) {
            None => chord_limit(problem, norm(&second)),
            Some(tip) => {
                let (curvature, square) = curvature(&tip, u);
                chord_limit(problem, curvature) * (d / square).sqrt()
            }
        };
        speed_cap = speed_cap.min(chord);
    }
    PathPoint { first, second, third, speed_cap }
}

fn chord_limit<const M: usize>(problem: &Problem<M>, curvature: f64) -> f64 {
    if problem.chord_tolerance.is_finite() {
        chord_speed(curvature, problem.chord_tolerance, problem.period)
    } else {
        f64::INFINITY
    }
}

/// Curvature of a piece at u, 0 where C' = 0, and |C'(u)|².
fn curvature<const M: usize>(piece: &Piece<M>, u: f64) -> (f64, f64) {
    let [_, c1, c2, _] = derivatives(piece, u);
    let square = dot(&c1, &c1);
    let along = dot(&c1, &c2) / square;
    let off: [f64; M] = std::array::from_fn(|k| c2[k] - along * c1[k]);
    (if square > 0.0 { norm(&off) / square } else { 0.0 }, square)
}

impl<const M: usize> Geometry<M> for ArcLengthPath<'_, M> {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, part: usize, s: f64) -> PathPoint<M> {
        let own = &self.measures[part];
        if let Some((direction, speed_cap)) = own.straight {
            return PathPoint { first: direction, second: [0.0; M], third: [0.0; M], speed_cap };
        }
        let x = (s - self.knots[part]).clamp(own.inside[0], own.inside[1]);
        let [from, to] = around(self.table(part), x);
        path_point(self.problem, self.parts[part].piece, from.parameter_at(to, x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_tangent_beside_a_long_one_turns_by_its_own_angle() {
        // 1e-11 mm off a line turns an edge of 1e-5 mm by 1e-6 rad, and one of half a metre by nothing.
        let direction = |first: f64, off: f64| {
            let control = [[0.0, 0.0], [first, off], [1e3, 0.0]];
            straight(&Piece { control: &control, weights: &[], width: 1.0 }, 0.5)
        };
        assert_eq!(direction(1e-5, 0.0), Some([1.0, 0.0]));
        assert!(direction(500.0, 1e-11).is_some() && direction(500.0, 1e-8).is_none());
        assert!(direction(1e-5, 1e-13).is_some() && direction(1e-5, 1e-11).is_none());
    }

    #[test]
    fn parameters_on_a_part_that_is_symmetric_about_its_middle() {
        // A slight bend of degree 7, as smooth paths have: the quintic of the whole part is right half-way.
        let control = [
            [2.618383093684835, -3.103134081782292],
            [2.617980931741674, -3.1032933506629217],
            [2.617578769798513, -3.103452619543552],
            [2.617176607855352, -3.1036118884241817],
            [2.6158726545425224, -3.1041143539233813],
            [2.615467607292026, -3.104266135113684],
            [2.6150625600415305, -3.1044179163039876],
            [2.6146575127910343, -3.1045696974942905],
        ];
        let width = 0.003027860538125467;
        let parts = [Part { piece: 0, u: [0.21 * width, 0.79 * width] }];
        let problem = Problem {
            control: &control,
            weight: &[],
            offset: &[0, 8],
            width: &[width],
            tip: None,
            way: None,
            feed_share: &[],
            runs: &[0, 1],
            feed: &[100.0],
            junction_speed: &[0.0, 0.0],
            max_velocity: [[100.0; 2]; 2],
            max_acceleration: [[1e4; 2]; 2],
            chord_tolerance: f64::INFINITY,
            period: 0.001,
            start_speed: 0.0,
            end_speed: 0.0,
            watch: Default::default(),
        };
        let path = ArcLengthPath::new(&problem, &parts);
        for i in 1..100 {
            let s = path.total() * i as f64 / 100.0;
            let (found, truth) = (path.at(0, s), path_point(&problem, 0, path.locate(0, s)));
            for k in 0..2 {
                let off = (found.third[k] - truth.third[k]).abs();
                assert!(off < 1e-3, "{i}: {found:?} for {truth:?}");
            }
        }
    }
}
