//! The cutter compensation that is on: its side and radius, and the last element of the tool's path.

use super::coordinates::Point;
use super::moves::Arc;
use super::plane::{minus, Point2, Shape};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// After G41 or G42, before the first move.
    Entering,
    Following,
    /// After G40, before the next move.
    Leaving,
}

/// The last element of the tool's path in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Last {
    /// Row of its first move.
    pub row: usize,
    pub start: Point2,
    pub shape: Shape,
    /// True for the element that brings the tool beside the path: its direction may change.
    pub entry: bool,
    /// The number of turns of the programmed arc, rounded up.
    pub turns: f64,
}

/// The compensation that is on.
#[derive(Clone, Debug)]
pub struct Compensation {
    pub code: u16,
    /// 1 for left, -1 for right.
    pub side: f64,
    pub radius: f64,
    pub phase: Phase,
    /// The axes of the plane, and the axis that arcs turn about.
    pub plane: (usize, usize),
    pub normal: usize,
    /// The vector from the centre of a lathe tool's tip to the point that is programmed without compensation; 0 for mills.
    pub origin: Point2,
    /// The current point of the programmed path.
    pub programmed: Point,
    pub last: Last,
}

impl Compensation {
    /// A point projected onto the plane.
    pub fn flat(&self, point: &Point) -> Point2 {
        [point[self.plane.0], point[self.plane.1]]
    }

    /// The tool's centre in the plane, where the machine is at a position.
    pub fn centre(&self, machine: &Point) -> Point2 {
        match self.phase {
            Phase::Following => minus(self.flat(machine), self.origin),
            _ => self.flat(machine),
        }
    }

    /// Moves the machine in the plane so that the tool's centre is at a point.
    pub fn put(&self, machine: &mut Point, centre: Point2) {
        machine[self.plane.0] = centre[0] + self.origin[0];
        machine[self.plane.1] = centre[1] + self.origin[1];
    }

    /// An arc of the machine for an arc of the tool's centre about a point of the plane, at the height of `at`.
    pub fn arc(&self, centre: Point2, angle: f64, at: &Point) -> Arc {
        let mut place = *at;
        self.put(&mut place, centre);
        Arc { centre: [place[0], place[1], place[2]], normal: self.normal, angle }
    }
}
