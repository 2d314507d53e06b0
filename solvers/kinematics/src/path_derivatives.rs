//! Joint motion along the pieces of a tip path: exact derivatives at points, proven bounds over parts.
//!
//! The series over a part bounds each coefficient t_k alone. Taylor's theorem about the middle u_m of the part makes the bounds
//! of all orders below the highest, m, nearly as narrow as the true range:
//! ```text
//! t_k(u) ∈ Σ_{j<m−k} C(k+j, j) t_{k+j}(u_m) [−r, r]^j + C(m, k) T_m [−r, r]^{m−k},   T_m ∋ t_m, r half the width
//! ```

use super::expression::{Expression, Table};
use super::number::Number;
use super::series::MOST_ORDER;
use super::tip::{binomial, Polygons, Tips};
use feedplan_geometry::interval::Interval;
use feedplan_geometry::parallel::each_part;

pub const TURN: f64 = 360.0;
const HALF_TURN: f64 = 180.0;
/// Number of points or pieces that a thread takes at a time.
pub const BLOCK: usize = 64;

/// A machine: its joints as functions of tip coordinates, and for each joint whether it is an angle, known up to whole turns.
#[derive(Clone, Copy)]
pub struct Machine<'a> {
    pub joints: &'a Expression,
    pub turning: &'a [bool],
}

/// Derivatives of joints at points of pieces.
pub struct PointWork<'a> {
    machine: Machine<'a>,
    tips: Tips<'a>,
    polygons: Polygons<f64>,
    table: Table<f64>,
}

impl<'a> PointWork<'a> {
    pub fn new(machine: Machine<'a>, tips: Tips<'a>, order: usize) -> Self {
        let table = machine.joints.table(order);
        Self { machine, tips, polygons: Polygons::new(&tips, order), table }
    }

    /// The length of the parameter interval of a piece.
    pub fn width(&self, piece: usize) -> f64 {
        self.tips.width[piece]
    }

    /// Evaluates the joints at a fraction of a piece.
    pub fn at(&mut self, piece: usize, fraction: f64) {
        self.tips.at_point(piece, fraction, &mut self.polygons, &mut self.table);
        self.machine.joints.evaluate(&mut self.table);
    }

    /// A derivative q^(order) of a joint at the point evaluated last.
    pub fn derivative(&self, joint: usize, order: usize) -> f64 {
        let factorial: f64 = (1..=order).map(|k| k as f64).product();
        self.machine.joints.output(&self.table, joint)[order] * factorial
    }
}

/// q, q', …, q^(order) at a fraction of each piece: piece by piece, order by order, joint by joint.
///
/// Exact to rounding; not finite where K is singular.
pub fn derivatives(machine: Machine, tips: Tips, fraction: &[f64], order: usize) -> Vec<f64> {
    let joints = machine.joints.outputs();
    let row = joints * (order + 1);
    let mut result = vec![0.0; fraction.len() * row];
    each_part(&mut result, BLOCK * row, &|first, rows| {
        let mut work = PointWork::new(machine, tips, order);
        for (i, row) in (first / row..).zip(rows.chunks_exact_mut(row)) {
            work.at(i, fraction[i]);
            for (k, row) in row.chunks_exact_mut(joints).enumerate() {
                for (joint, value) in row.iter_mut().enumerate() {
                    *value = work.derivative(joint, k);
                }
            }
        }
    });
    result
}

/// Joint positions at tips of shape (n, axes): tip by tip, joint by joint.
pub fn positions(joints: &Expression, tips: &[f64]) -> Vec<f64> {
    let (axes, outputs) = (joints.inputs(), joints.outputs());
    let mut result = vec![0.0; tips.len() / axes * outputs];
    each_part(&mut result, BLOCK * outputs, &|first, rows| {
        let mut table = joints.table(0);
        let tips = tips[first / outputs * axes..].chunks_exact(axes);
        for (row, tip) in rows.chunks_exact_mut(outputs).zip(tips) {
            for (axis, &value) in tip.iter().enumerate() {
                table.input(axis)[0] = value;
            }
            joints.evaluate(&mut table);
            for (joint, value) in row.iter_mut().enumerate() {
                *value = joints.output(&table, joint)[0];
            }
        }
    });
    result
}

/// Bounds of joint derivatives over parts of pieces.
pub struct PartWork<'a> {
    machine: Machine<'a>,
    tips: Tips<'a>,
    polygons: Polygons<Interval>,
    whole: Table<Interval>,
    middle: Table<Interval>,
    order: usize,
}

impl<'a> PartWork<'a> {
    pub fn new(machine: Machine<'a>, tips: Tips<'a>, order: usize) -> Self {
        let [whole, middle] = [(); 2].map(|()| machine.joints.table(order));
        Self { machine, tips, polygons: Polygons::new(&tips, order), whole, middle, order }
    }

    /// Bounds of q^(k)/k! of all joints over a part: order by order, joint by joint.
    ///
    /// A coefficient is unbounded where K is singular on the part, or where the part is too long to exclude it. Angles are
    /// continuous over the part, on any turn.
    pub fn enclose(&mut self, piece: usize, part: [f64; 2], result: &mut [Interval]) {
        let expression = self.machine.joints;
        for (middle, table) in [(false, &mut self.whole), (true, &mut self.middle)] {
            self.tips.over_part(piece, part, middle, &mut self.polygons, table);
            expression.evaluate(table);
        }
        let width = (Interval::exactly(part[1]) - Interval::exactly(part[0]))
            * Interval::exactly(self.tips.width[piece]);
        let powers = powers(width.hi / 2.0, self.order);
        let joints = expression.outputs();
        for joint in 0..joints {
            let (whole, middle) =
                (expression.output(&self.whole, joint), expression.output(&self.middle, joint));
            for k in 0..=self.order {
                result[k * joints + joint] = narrowed(whole, middle, &powers, k, self.machine.turning[joint]);
            }
        }
    }

    /// c ≥ |q^(n+2)|/(n + 1)! of all joints over a part, where n + 2 is the order; infinite where K may be singular on the
    /// part.
    ///
    /// From the series over the part alone: using Taylor's theorem would need higher orders, at twice the cost, for a third fewer
    /// parts.
    pub fn constants(&mut self, piece: usize, part: [f64; 2], result: &mut [f64]) {
        let expression = self.machine.joints;
        self.tips.over_part(piece, part, false, &mut self.polygons, &mut self.whole);
        expression.evaluate(&mut self.whole);
        for (joint, result) in result.iter_mut().enumerate() {
            let top = expression.output(&self.whole, joint)[self.order].magnitude();
            *result = (top * self.order as f64).next_up();
        }
    }
}

const WHOLE: [f64; 2] = [0.0, 1.0];

/// Bounds of q^(k)/k! over each piece, or a part of it: piece by piece, order by order, joint by joint.
pub fn enclosures(machine: Machine, tips: Tips, parts: Option<&[[f64; 2]]>, order: usize) -> Vec<Interval> {
    let row = machine.joints.outputs() * (order + 1);
    let mut result = vec![Interval::WHOLE; tips.len() * row];
    each_part(&mut result, BLOCK * row, &|first, rows| {
        let mut work = PartWork::new(machine, tips, order);
        for (piece, row) in (first / row..).zip(rows.chunks_exact_mut(row)) {
            work.enclose(piece, parts.map_or(WHOLE, |parts| parts[piece]), row);
        }
    });
    result
}

/// [−r, r]^j.
fn powers(radius: f64, order: usize) -> [Interval; MOST_ORDER + 1] {
    let mut powers = [Interval::exactly(1.0); MOST_ORDER + 1];
    for j in 1..=order {
        powers[j] = match j {
            1 => Interval { lo: -radius, hi: radius },
            j if j % 2 == 0 => powers[j / 2].square(),
            j => powers[j - 1] * powers[1],
        };
    }
    powers
}

/// The bound of coefficient k: the intersection of those by the series over the part and by Taylor's theorem about its middle.
fn narrowed(
    whole: &[Interval],
    middle: &[Interval],
    powers: &[Interval],
    k: usize,
    turning: bool,
) -> Interval {
    let order = whole.len() - 1;
    if k == order {
        return whole[k];
    }
    let ahead = |j: usize| powers[j] * Interval::exactly(binomial(k + j, j));
    let value = Interval::dot((0..order - k).map(|j| (middle[k + j], ahead(j))));
    let value = value + whole[order] * powers[order - k] * Interval::exactly(binomial(order, k));
    let value = if k == 0 && turning { on_turn_of(value, whole[0]) } else { value };
    whole[k].meet(value)
}

/// Moves an angle by whole turns to the turn of `like`; unbounded where the widths do not determine the turn.
fn on_turn_of(value: Interval, like: Interval) -> Interval {
    if value.width() + like.width() >= 2.0 * HALF_TURN {
        return Interval::WHOLE;
    }
    value + Interval::exactly(turns_between(like.middle() - value.middle()) * TURN)
}

/// The number of whole turns in a difference of angles; 0 where it is not finite.
pub fn turns_between(difference: f64) -> f64 {
    let turns = (difference / TURN).round();
    if turns.is_finite() {
        turns
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 220 degrees is in [100, 250] and, as −140, in [−150, 150]: the intersection of these ranges would lose it.
    #[test]
    fn two_wide_ranges_of_an_angle_are_not_put_on_one_turn() {
        let range = |lo, hi| Interval { lo, hi };
        assert_eq!(on_turn_of(range(-150.0, 150.0), range(100.0, 250.0)), Interval::WHOLE);
        let moved = on_turn_of(range(-150.0, -100.0), range(200.0, 250.0));
        assert!((moved.lo - 210.0).abs() < 1e-9 && (moved.hi - 260.0).abs() < 1e-9);
    }
}
