//! Computes the parameter of a subrun at an arc length, and the axes' derivatives by the arc length.
//!
//! The arc length s [mm] is that of all axes of the path together, so that it grows wherever an axis moves. The feed may count
//! fewer axes; it is converted to a limit of the speed along s by the quotient of both speeds.
//!
//! The `table` of u(s) of a part is computed when a place inside the part is first asked for. The stations of a profile are
//! located to rounding, by Newton's method on the quadrature of s. `derivatives` computes values at one parameter, `junctions`
//! the speed caps between two parts.

mod derivatives;
mod junctions;
mod table;

use std::sync::OnceLock;

use self::derivatives::{chord_limit, path_points, rate, OFF_LINE};
pub use self::derivatives::{path_point, per_feed, piece, speed_sq, straight, tool_curvature, MAX_RATE};
use crate::path_problem::{Geometry, PathPoint, PathPoints, SpeedCap};
use feedplan_geometry::parallel::map;
use feedplan_geometry::spline::bezier::derivatives;
use feedplan_geometry::tolerance::CUSP;
use feedplan_planner::problem::Problem;
pub use junctions::Junction;
use junctions::Meeting;
use table::{around, panel_of, Halving, Row};
pub use table::{panel, Part};

/// Greatest number of steps to locate an arc length: mostly one or two Newton steps; next to a cusp, where these go astray, as
/// many bisections as u has bits.
const STEPS: usize = 64;
/// Parameters are located to this fraction of the greatest one on their part, a few rounding errors.
const LOCATED: f64 = 1e-15;
/// Derivatives are evaluated at least this far from a point where D vanishes, as a fraction of the part's length.
const INSET: f64 = 1e-9;

/// What is known of a part without its table.
#[derive(Clone, Debug)]
struct Measures<const M: usize> {
    length: f64,
    /// The direction of motion and the speed cap by the feed in mm/s, if the direction is constant and s is the arc length of the
    /// axes' path.
    straight: Option<([f64; M], f64)>,
    /// The least and the greatest distance from the start of the part at which derivatives are evaluated, in mm.
    inside: [f64; 2],
}

/// The parts of a subrun, by arc length.
#[derive(Clone)]
pub struct ArcLengthPath<'a, const M: usize> {
    pub problem: &'a Problem<'a, M>,
    pub parts: &'a [Part],
    measures: Vec<Measures<M>>,
    tables: Vec<OnceLock<Box<[Row]>>>,
    knots: Vec<f64>,
}

impl<const M: usize> Measures<M> {
    fn new(problem: &Problem<M>, part: &Part) -> Self {
        let ([a, b], i) = (part.u, part.piece);
        let length = Halving::new(problem, part).total();
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
        let measures = map(parts.len(), 16, |part| {
            problem.watch.check();
            Measures::new(problem, &parts[part])
        });
        Self::measured(problem, parts, measures)
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

    /// The parts between two arc lengths as a path of their own, with their own tables and with arc lengths from the start of the
    /// first part; and the index of that part. These shorter arc lengths have smaller rounding errors than those of a long path.
    pub fn between(&self, [from, to]: [f64; 2]) -> (Self, usize) {
        let first = self.part(from);
        let end = first + 1 + self.knots[first + 1..].partition_point(|&knot| knot < to);
        (Self::measured(self.problem, &self.parts[first..end], self.measures[first..end].to_vec()), first)
    }

    fn table(&self, part: usize) -> &[Row] {
        self.tables[part].get_or_init(|| {
            let mut rows = Halving::new(self.problem, &self.parts[part]).table();
            let last = rows.len() - 1;
            // The difference of both lengths is spread over all rows: the last panel alone may be too short to take it.
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

    /// The parameter at an arc length on a part by its table, kept away from points where D vanishes.
    fn parameter(&self, part: usize, s: f64) -> f64 {
        let x = self.inside(part, s);
        let [from, to] = around(self.table(part), x);
        from.parameter_at(to, x)
    }

    /// `parameter` at four arc lengths, which are mostly on one panel of the table or on neighbouring ones.
    fn parameters(&self, part: usize, s: [f64; 4]) -> [f64; 4] {
        let rows = self.table(part);
        let x = s.map(|s| self.inside(part, s));
        let mut panel = panel_of(rows, x[0]);
        x.map(|x| {
            while panel > 0 && rows[panel].s > x {
                panel -= 1;
            }
            while panel + 2 < rows.len() && rows[panel + 1].s <= x {
                panel += 1;
            }
            rows[panel].parameter_at(&rows[panel + 1], x)
        })
    }

    /// The distance of an arc length from the start of its part in mm, kept away from points where D vanishes.
    fn inside(&self, part: usize, s: f64) -> f64 {
        let [first, last] = self.measures[part].inside;
        (s - self.knots[part]).max(first).min(last)
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
        // The length is measured from the nearer row: next to an end of the part this keeps the rounding error small.
        let ahead = to.s - x < x - from.s;
        let miss = |u: f64| {
            if ahead {
                to.s - panel(self.problem, at.piece, u, to.u) - x
            } else {
                from.s + panel(self.problem, at.piece, from.u, u) - x
            }
        };
        self.newton(part, [from.u, to.u], from.parameter_at(to, x), miss)
    }

    /// The parameter at a signed distance in mm from the parameter `from`, with a small error relative to that distance. Its arc
    /// length is about s, where the search starts.
    pub fn parameter_beside(&self, part: usize, from: f64, distance: f64, s: f64) -> f64 {
        let at = &self.parts[part];
        let [low, high] = if distance > 0.0 { [from, at.u[1]] } else { [at.u[0], from] };
        let miss = |u: f64| self.length_between(part, from.min(u), from.max(u)).copysign(u - from) - distance;
        self.newton(part, [low, high], self.parameter(part, s).clamp(low, high), miss)
    }

    /// The parameter of a part between `low` and `high` where `miss`, a length in mm that rises with u, is 0. A Newton step
    /// leaves an error of less than step² (|D_u| + |D_uu step|)/D, mostly less than rounding, but not next to a cusp.
    fn newton(
        &self,
        part: usize,
        [mut low, mut high]: [f64; 2],
        mut u: f64,
        miss: impl Fn(f64) -> f64,
    ) -> f64 {
        let at = &self.parts[part];
        for _ in 0..STEPS {
            let miss = miss(u);
            if miss > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let c = derivatives(&piece(self.problem, at.piece), u);
            let [d, d1, d2] = rate(self.problem, at.piece, u, &c);
            let step = miss / d.sqrt();
            let next = u - step;
            let is_inside = next >= low && next <= high;
            u = if is_inside { next } else { 0.5 * (low + high) };
            let left =
                if is_inside { step * step * (d1.abs() + (d2 * step).abs()) / d } else { f64::INFINITY };
            if left.min(step.abs()) <= LOCATED * at.u[1] {
                break;
            }
        }
        u
    }

    /// The length between two parameters of a part, in mm; short lengths have a small relative error as well.
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
        let inside: f64 = rows[i + 1..j].iter().map(|row| row.length).sum();
        panel(self.problem, at, a, rows[i + 1].u) + inside + panel(self.problem, at, rows[j].u, b)
    }

    /// The direction of all parts and the speed cap by their feed in mm/s, if both are the same on all parts.
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
        let meeting = |part: usize| {
            self.problem.watch.check_at(part);
            let [before, after] = [part - 1, part].map(|part| self.parts[part].piece);
            Meeting {
                s: self.knots[part],
                corner: (before != after).then(|| self.problem.junction_speed[after]),
                sides: [self.end(part - 1, 1), self.end(part, 0)],
            }
        };
        let meetings: Vec<Meeting<M>> = (1..self.parts.len()).map(meeting).collect();
        junctions::junctions(self.problem, &meetings, jerk)
    }

    /// The speed caps at junctions, and caps with infinite speed at places where tighter limits of jerk begin or end away from a
    /// junction.
    pub fn caps(&self, junctions: &[Junction]) -> Vec<SpeedCap> {
        junctions::caps(junctions, self.total())
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

    /// The direction of motion on a part where it is constant.
    pub fn direction(&self, part: usize) -> Option<[f64; M]> {
        self.measures[part].straight.map(|(direction, _)| direction)
    }

    /// The greatest speed by the chord error at a curvature, in mm/s.
    pub fn chord_speed(&self, curvature: f64) -> f64 {
        chord_limit(self.problem, curvature)
    }
}

impl<const M: usize> Geometry<M> for ArcLengthPath<'_, M> {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, part: usize, s: f64) -> PathPoint<M> {
        match self.measures[part].straight {
            Some((direction, speed_cap)) => {
                PathPoint { first: direction, second: [0.0; M], third: [0.0; M], speed_cap }
            }
            None => path_point(self.problem, self.parts[part].piece, self.parameter(part, s)),
        }
    }

    fn at_four(&self, part: usize, s: [f64; 4]) -> PathPoints<M> {
        match self.measures[part].straight {
            Some(_) => PathPoints::new([self.at(part, s[0]); 4]),
            None => path_points(self.problem, self.parts[part].piece, self.parameters(part, s)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::one_piece::one_piece;

    #[test]
    fn parameters_on_a_part_that_is_symmetric_about_its_middle() {
        // A slight bend of degree 7, as smooth paths have; the quintic of the whole part is right half-way.
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
        let problem = one_piece(&control, &[0, 8], &[0.003027860538125467]);
        let parts = [Part { piece: 0, u: [0.21, 0.79].map(|share| share * problem.width[0]) }];
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

    #[test]
    fn a_located_parameter_has_its_length_and_four_points_are_those_of_each() {
        // From a slow start, where |C'| is 1e-3 of its greatest, and round a bend.
        let control = [[0.0, 0.0], [1e-3, 0.0], [1.0, 0.1], [2.0, 2.0], [1.5, 3.0], [3.0, 5.0]];
        let parts = [Part { piece: 0, u: [0.0, 1.0] }];
        let problem = one_piece(&control, &[0, 6], &[1.0]);
        let path = ArcLengthPath::new(&problem, &parts);
        let length = |i: usize| path.total() * i as f64 / 400.0;
        for i in 1..400 {
            let off = path.length_between(0, 0.0, path.locate(0, length(i))) - length(i);
            assert!(off.abs() < 2e-15 * path.total(), "{i}: {off:e}");
        }
        for s in [[0, 1, 2, 3], [5, 90, 200, 400], [300, 7, 299, 8]].map(|four| four.map(length)) {
            assert_eq!(path.at_four(0, s), PathPoints::new(s.map(|s| path.at(0, s))));
        }
    }
}
