//! Plane geometry: where the offset lines and arcs of a path meet, and angles between points.

use std::f64::consts::{PI, TAU};

use super::tolerance::SAME_ANGLE;

/// A point in the plane of a path, in mm.
pub type Point2 = [f64; 2];

/// A line along a unit vector, or an arc about a centre with the sign of its sweep.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    Line(Point2),
    Arc { centre: Point2, radius: f64, turn: f64 },
}

/// The point where the offset `last`, which ends at `here`, meets the offset `next`, which passes through `beside`.
/// `side` is the side of the path that the tool is on: 1 for left, -1 for right.
pub fn crossing(side: f64, here: Point2, last: &Shape, beside: Point2, next: &Shape) -> Option<Point2> {
    let inside = |turn: f64| turn == side;
    match (*last, *next) {
        (Shape::Line(before), Shape::Line(after)) => {
            let cross = before[0] * after[1] - before[1] * after[0];
            let gap = minus(beside, here);
            let t = (gap[0] * after[1] - gap[1] * after[0]) / cross;
            let end = [here[0] + t * before[0], here[1] + t * before[1]];
            t.is_finite().then_some(end)
        }
        // A tool inside the arc follows the line to the far side of the circle, a tool outside to the near side.
        (Shape::Line(along), Shape::Arc { centre, radius, turn }) => {
            on_circle(here, along, centre, radius, if inside(turn) { 1.0 } else { -1.0 })
        }
        (Shape::Arc { centre, radius, turn }, Shape::Line(along)) => {
            on_circle(beside, along, centre, radius, if inside(turn) { -1.0 } else { 1.0 })
        }
        (Shape::Arc { centre: a, radius: r, turn: first }, Shape::Arc { centre: b, radius: s, turn }) => {
            let gap = distance(a, b);
            let cosine = (r * r + gap * gap - s * s) / (2.0 * r * gap);
            if !(-1.0..=1.0).contains(&cosine) {
                return None;
            }
            let sign = if inside(first) { turn } else { -turn };
            let angle = direction(a, b) + sign * cosine.acos();
            Some([a[0] + r * angle.cos(), a[1] + r * angle.sin()])
        }
    }
}

/// The point where the line through `point` along a unit vector meets a circle: the far one for 1, the near one for -1.
fn on_circle(point: Point2, along: Point2, centre: Point2, radius: f64, which: f64) -> Option<Point2> {
    let to = minus(centre, point);
    let foot = to[0] * along[0] + to[1] * along[1];
    let height = along[0] * to[1] - along[1] * to[0];
    let half = (radius - height.abs()) * (radius + height.abs());
    let t = foot + which * half.sqrt();
    (half >= 0.0).then(|| [point[0] + t * along[0], point[1] + t * along[1]])
}

/// The signed sweep in radians from a start to an end about a centre, with as many full turns as the sweep `like`.
pub fn sweep_between(start: Point2, end: Point2, centre: Point2, turn: f64, like: f64) -> f64 {
    let mut sweep = turn * (direction(centre, end) - direction(centre, start));
    sweep = sweep.rem_euclid(TAU);
    let turns = ((like.abs() - SAME_ANGLE) / TAU).floor().max(0.0);
    turn * (sweep + turns * TAU)
}

/// The angle of the vector from one point to another, in radians from the first axis.
pub fn direction(from: Point2, to: Point2) -> f64 {
    (to[1] - from[1]).atan2(to[0] - from[0])
}

/// The angle from -π to π that equals an angle up to full turns.
pub fn wrapped(angle: f64) -> f64 {
    PI - (PI - angle).rem_euclid(TAU)
}

pub fn minus(a: Point2, b: Point2) -> Point2 {
    [a[0] - b[0], a[1] - b[1]]
}

pub fn distance(a: Point2, b: Point2) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: Option<Point2>, wanted: Point2) {
        let found = found.unwrap();
        assert!(distance(found, wanted) < 1e-12, "{found:?} {wanted:?}");
    }

    #[test]
    fn offsets_meet_where_the_tool_touches_both() {
        let (east, north) = (Shape::Line([1.0, 0.0]), Shape::Line([0.0, 1.0]));
        near(crossing(1.0, [9.0, 1.0], &east, [4.0, 0.0], &north), [4.0, 1.0]);
        assert_eq!(crossing(1.0, [9.0, 1.0], &east, [4.0, 0.0], &east), None);
        // A tool inside the circle meets its far side, a tool outside its near side.
        let circle = |turn| Shape::Arc { centre: [5.0, 1.0], radius: 2.0, turn };
        near(crossing(1.0, [0.0, 1.0], &east, [0.0; 2], &circle(1.0)), [7.0, 1.0]);
        near(crossing(1.0, [0.0, 1.0], &east, [0.0; 2], &circle(-1.0)), [3.0, 1.0]);
        near(crossing(1.0, [0.0; 2], &circle(1.0), [0.0, 1.0], &east), [3.0, 1.0]);
        assert_eq!(crossing(1.0, [0.0, 4.0], &east, [0.0; 2], &circle(1.0)), None);
        let other = Shape::Arc { centre: [8.0, 1.0], radius: 2.0, turn: 1.0 };
        let height = (4.0f64 - 2.25).sqrt();
        near(crossing(1.0, [0.0; 2], &circle(1.0), [0.0; 2], &other), [6.5, 1.0 + height]);
        near(crossing(-1.0, [0.0; 2], &circle(1.0), [0.0; 2], &other), [6.5, 1.0 - height]);
    }

    #[test]
    fn sweeps_have_their_sign_and_turns() {
        let quarter = |turn, like| sweep_between([1.0, 0.0], [0.0, 1.0], [0.0; 2], turn, like);
        assert!((quarter(1.0, 0.0) - PI / 2.0).abs() < 1e-15);
        assert!((quarter(-1.0, 0.0) + 1.5 * PI).abs() < 1e-15);
        assert!((quarter(1.0, 2.2 * TAU) - 2.25 * TAU).abs() < 1e-12);
        assert!((wrapped(1.5 * PI) + PI / 2.0).abs() < 1e-15);
    }
}
