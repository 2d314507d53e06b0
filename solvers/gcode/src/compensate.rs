//! Cutter compensation, G41 and G42: the tool's centre moves parallel to the programmed path, at the distance of the tool's
//! radius.
//!
//! As in LinuxCNC, the first move ends at this distance from its programmed end. At a corner that turns away from the tool, an
//! arc about the corner joins the offsets. At a corner that turns towards the tool, each offset ends where it meets the other. A
//! corner of less than `NO_CORNER` changes nothing. After G40 the tool stays beside the path until the next straight move, which
//! ends on the programmed path.

use std::f64::consts::{PI, TAU};

use super::block::{g_name, Block};
use super::compensation::{Compensation, Last, Phase};
use super::coordinates::Point;
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::moves::Kind;
use super::plane::{crossing, direction, distance, minus, sweep_between, wrapped, Point2, Shape};
use super::tolerance::{ENTRY_BEND, NO_CORNER, WHOLE_TURNS};

/// The vector from the centre of a lathe tool's tip to its programmed point, in radii along Z and X, for each cutting side 0 to
/// 9.
const ORIGINS: [Point2; 10] = [
    [0.0, 0.0],
    [1.0, -1.0],
    [-1.0, -1.0],
    [-1.0, 1.0],
    [1.0, 1.0],
    [1.0, 0.0],
    [0.0, -1.0],
    [-1.0, 0.0],
    [0.0, 1.0],
    [0.0, 0.0],
];

/// How the tool's path continues at a corner.
struct Corner {
    /// The start of the next element.
    start: Point2,
    /// True where an arc about the corner leads there.
    rounded: bool,
}

impl Interpreter<'_> {
    /// The compensation after G41 or G42; None after G40.
    fn compensating(&self) -> Option<&Compensation> {
        self.compensation.as_deref().filter(|on| on.phase != Phase::Leaving)
    }

    /// The code in force, G40, G41 or G42, in tenths.
    pub fn compensation_code(&self) -> u16 {
        self.compensating().map_or(400, |on| 415 - (5.0 * on.side) as u16)
    }

    /// Executes G40, G41, G42, G41.1 and G42.1.
    pub fn set_compensation(&mut self, block: &Block, code: u16) -> Outcome<()> {
        if code == 400 {
            if let Some(mut on) = self.compensation.take().filter(|on| on.phase != Phase::Entering) {
                if on.phase == Phase::Following {
                    self.settle(&on);
                }
                on.phase = Phase::Leaving;
                self.compensation = Some(on);
            }
            return Ok(());
        }
        let name = g_name(code);
        if self.compensating().is_some() {
            return fault!("{name} stands where the compensation is on already: give G40 before");
        }
        let normal = self.state.normal;
        if normal == 0 {
            return fault!("{name} is read in the planes G17 and G18: post the compensated path");
        }
        let (diameter, orientation) = match (code % 10, block.get(b'D')) {
            (1, Some(diameter)) => {
                (diameter * self.state.unit(), block.count(b'L', 0, "side of a lathe tool")?.unwrap_or(0))
            }
            (1, None) => return fault!("{name} has no diameter: give it as D"),
            _ => self.tip_of_tool(block, &name)?,
        };
        let orientation = orientation as usize;
        if orientation >= ORIGINS.len() || (normal == 2 && ORIGINS[orientation] != [0.0; 2]) {
            return fault!(
                "{name} in the plane G{} takes a tool of the side {orientation}: lathe tools have 1 to 9 and work in G18",
                19 - normal
            );
        }
        let left = if code < 420 { 1.0 } else { -1.0 };
        // A negative diameter stands for a tool smaller than the one which the path is made for.
        let (side, radius) = (left * diameter.signum(), 0.5 * diameter.abs());
        if radius == 0.0 {
            self.compensation = None;
            return Ok(());
        }
        let origin = ORIGINS[orientation].map(|share| share * radius);
        let plane = self.state.plane();
        let programmed = self.position();
        let last = Last { row: 0, start: [0.0; 2], shape: Shape::Line([0.0; 2]), entry: true, turns: 0.0 };
        self.compensation = Some(Box::new(Compensation {
            code,
            side,
            radius,
            phase: Phase::Entering,
            plane,
            normal,
            origin,
            programmed,
            last,
        }));
        Ok(())
    }

    /// At a tool change, ends a compensation that G40 has cancelled: from then on the position of the machine is the programmed
    /// one.
    pub fn forget_compensation(&mut self) {
        if self.compensation.as_ref().is_some_and(|on| on.phase == Phase::Leaving) {
            self.compensation = None;
        }
    }

    /// The diameter in mm and the cutting side of the tool that D or H names, or of the tool in the spindle.
    fn tip_of_tool(&mut self, block: &Block, name: &str) -> Outcome<(f64, u32)> {
        let letter = if block.has(b'D') { b'D' } else { b'H' };
        let number = block.count(letter, 0, "tool number")?;
        if self.tools.is_none() {
            return fault!(
                "{name} takes a diameter from the tool table: give one (--tool-table), or G41.1 and G42.1 with D"
            );
        }
        let tool = match number {
            Some(number @ 1..) => self.needed_tool(number)?,
            _ => self.tool,
        };
        Ok(tool.map_or((0.0, 0), |tool| (tool.diameter, tool.orientation)))
    }

    /// Refuses a code or word that cannot be offset while the compensation is on.
    pub fn check_beside(&self, what: &str) -> Outcome<()> {
        match self.compensating() {
            Some(on) => fault!("{what} stands where {} is on: give G40 before", g_name(on.code)),
            None => Ok(()),
        }
    }

    /// Adds the tool's path for a straight move of the programmed path to `target`.
    #[cold]
    pub fn go_beside(&mut self, kind: Kind, target: &Point, feed: f64) -> Outcome<()> {
        let Some(mut on) = self.compensation.take() else { return Ok(()) };
        let (control, line) = (self.state.control, self.line);
        if on.phase == Phase::Leaving {
            return self.moves.straight(kind, target, feed, &control, line);
        }
        let here = on.centre(&self.moves.position);
        let end = on.flat(target);
        let entering = on.phase == Phase::Entering;
        let from = if entering { here } else { on.flat(&on.programmed) };
        let mut beside = *target;
        let way = minus(end, from);
        let length = way[0].hypot(way[1]);
        if entering && length <= on.radius {
            return fault!(
                "the first move after {} is {length:.4} mm long and the tool's radius is {:.4} mm: begin farther away",
                g_name(on.code),
                on.radius
            );
        }
        if length == 0.0 {
            on.put(&mut beside, here);
        } else {
            let along = [way[0] / length, way[1] / length];
            let mut start = here;
            if !entering {
                let corner = self.corner(&on, from, along, Shape::Line(along))?;
                self.turn_corner(&on, &corner, kind, target, feed)?;
                start = corner.start;
            }
            let offset = [-on.side * on.radius * along[1], on.side * on.radius * along[0]];
            let centre = [end[0] + offset[0], end[1] + offset[1]];
            let moved = minus(centre, start);
            if !entering && moved[0] * along[0] + moved[1] * along[1] < 0.0 {
                return no_room(&on);
            }
            on.put(&mut beside, centre);
            on.last =
                Last { row: self.moves.len(), start, shape: Shape::Line(along), entry: entering, turns: 0.0 };
        }
        self.check_reach(&beside)?;
        self.moves.straight(kind, &beside, feed, &control, line)?;
        on.phase = Phase::Following;
        on.programmed = *target;
        self.compensation = Some(on);
        Ok(())
    }

    /// Adds the tool's path for an arc of the programmed path about `centre` with the signed sweep `angle` in radians.
    pub fn arc_beside(&mut self, target: &Point, centre: Point2, angle: f64, feed: f64) -> Outcome<()> {
        let Some(mut on) = self.compensation.take() else { return Ok(()) };
        if on.phase == Phase::Leaving {
            return fault!("the first move after G40 is an arc: give a straight move before");
        }
        let (control, line) = (self.state.control, self.line);
        let turn = angle.signum();
        let inside = turn == on.side;
        let end = on.flat(target);
        let nominal = distance(end, centre);
        if inside && nominal <= on.radius {
            return fault!(
                "the radius {nominal:.4} mm of the arc is not larger than the tool's, {:.4} mm: take a smaller tool",
                on.radius
            );
        }
        let outward = if inside { -on.radius } else { on.radius };
        let out = [(end[0] - centre[0]) / nominal, (end[1] - centre[1]) / nominal];
        let new_end = [end[0] + outward * out[0], end[1] + outward * out[1]];
        let here = on.centre(&self.moves.position);
        let entering = on.phase == Phase::Entering;
        let (start, middle, sweep) = if entering {
            let middle = self.entry_centre(&on, here, end, new_end, out)?;
            if on.origin != [0.0; 2] {
                // A lathe tool first moves its centre to where its programmed point is.
                let mut place = self.moves.position;
                on.put(&mut place, here);
                self.moves.straight(Kind::Line, &place, feed, &control, line)?;
            }
            (here, middle, sweep_between(here, new_end, middle, turn, angle))
        } else {
            let from = on.flat(&on.programmed);
            let first = distance(from, centre);
            let along = [-turn * (from[1] - centre[1]) / first, turn * (from[0] - centre[0]) / first];
            let radius = nominal + outward;
            let corner = self.corner(&on, from, along, Shape::Arc { centre, radius, turn })?;
            self.turn_corner(&on, &corner, Kind::Line, target, feed)?;
            // The programmed sweep without the part that the corner cuts off.
            let taken = wrapped(direction(centre, corner.start) - direction(centre, from));
            let sweep = angle - taken;
            if sweep * turn <= 0.0 {
                return no_room(&on);
            }
            (corner.start, centre, sweep)
        };
        let mut beside = *target;
        on.put(&mut beside, new_end);
        self.check_reach(&beside)?;
        let shape = Shape::Arc { centre: middle, radius: distance(new_end, middle), turn };
        let turns = (angle.abs() / TAU - WHOLE_TURNS).ceil();
        on.last = Last { row: self.moves.len(), start, shape, entry: entering, turns };
        let arc = on.arc(middle, sweep, &self.moves.position);
        self.moves.arc(arc, &beside, feed, &control, line)?;
        on.phase = Phase::Following;
        on.programmed = *target;
        self.compensation = Some(on);
        Ok(())
    }

    /// The centre of an entry arc: on the line through the programmed end and its centre, and equally far from the new end
    /// and from the start.
    fn entry_centre(
        &self,
        on: &Compensation,
        here: Point2,
        end: Point2,
        new_end: Point2,
        out: Point2,
    ) -> Outcome<Point2> {
        if distance(here, end) <= on.radius {
            return fault!(
                "the arc after {} is not longer than the tool's radius {:.4} mm: begin farther away",
                g_name(on.code),
                on.radius
            );
        }
        let chord = minus(here, new_end);
        let along = -(chord[0] * out[0] + chord[1] * out[1]);
        if along.abs() < ENTRY_BEND * chord[0].hypot(chord[1]) {
            return fault!(
                "the arc after {} has no centre that brings the tool beside its end: begin with a line",
                g_name(on.code)
            );
        }
        let radius = 0.5 * (chord[0] * chord[0] + chord[1] * chord[1]) / along;
        Ok([new_end[0] - radius * out[0], new_end[1] - radius * out[1]])
    }

    /// The corner at the programmed point `from`, after which the path goes along the unit vector `along` and the tool along
    /// `next`.
    fn corner(&self, on: &Compensation, from: Point2, along: Point2, next: Shape) -> Outcome<Corner> {
        let here = on.centre(&self.moves.position);
        let after = [-on.side * along[1], on.side * along[0]];
        let mut bend = on.side * wrapped(direction(from, here) - after[1].atan2(after[0]));
        if bend < NO_CORNER - PI {
            bend += TAU;
        }
        // At a half turn the tool goes round the corner, or cuts across it where an arc has the tool outside.
        let outside = |shape: &Shape| matches!(shape, Shape::Arc { turn, .. } if *turn != on.side);
        let across = (bend - PI).abs() < NO_CORNER
            && match next {
                Shape::Line(_) => outside(&on.last.shape),
                Shape::Arc { .. } => outside(&next),
            };
        let beside = [from[0] + on.radius * after[0], from[1] + on.radius * after[1]];
        if !(-NO_CORNER..=PI + NO_CORNER).contains(&bend) || across {
            match crossing(on.side, here, &on.last.shape, beside, &next) {
                Some(start) => Ok(Corner { start, rounded: false }),
                None => no_room(on),
            }
        } else if bend > NO_CORNER {
            Ok(Corner { start: beside, rounded: true })
        } else {
            Ok(Corner { start: here, rounded: false })
        }
    }

    /// Moves the end of the last element to the start of the next one, or adds the arc about the corner; for a rapid, a straight
    /// move.
    fn turn_corner(
        &mut self,
        on: &Compensation,
        corner: &Corner,
        kind: Kind,
        target: &Point,
        feed: f64,
    ) -> Outcome<()> {
        let (control, line) = (self.state.control, self.line);
        let here = on.centre(&self.moves.position);
        if !corner.rounded {
            if corner.start != here {
                self.shorten(on, here, corner.start)?;
            }
            self.settle(on);
            return Ok(());
        }
        self.settle(on);
        let mut place = self.moves.position;
        // Axes other than X, Y and Z move during the arc.
        place[3..].copy_from_slice(&target[3..]);
        on.put(&mut place, corner.start);
        if kind == Kind::Rapid {
            return self.moves.straight(kind, &place, feed, &control, line);
        }
        let about = on.flat(&on.programmed);
        let sweep = sweep_between(here, corner.start, about, -on.side, 0.0);
        let arc = on.arc(about, sweep, &self.moves.position);
        self.moves.arc(arc, &place, feed, &control, line)
    }

    /// Removes one turn from an arc that a corner has made longer than its programmed number of turns, as LinuxCNC does.
    fn settle(&mut self, on: &Compensation) {
        if self.moves.drop_turn(on.last.row, on.last.turns) {
            self.warn(
                "the circle before begins beside its end: its last turn is not made, as in LinuxCNC".into(),
            );
        }
    }

    /// Moves the end of the last element from `here` to `end`.
    fn shorten(&mut self, on: &Compensation, here: Point2, end: Point2) -> Outcome<()> {
        let last = on.last;
        let turned = match last.shape {
            Shape::Line(along) => {
                let left = minus(end, last.start);
                if left[0] * along[0] + left[1] * along[1] < 0.0 && !last.entry {
                    return no_room(on);
                }
                0.0
            }
            Shape::Arc { centre, .. } => wrapped(direction(centre, end) - direction(centre, here)),
        };
        let mut place = self.moves.position;
        on.put(&mut place, end);
        if self.moves.bend(last.row, on.plane, &place, turned) {
            Ok(())
        } else {
            no_room(on)
        }
    }
}

#[cold]
fn no_room<T>(on: &Compensation) -> Outcome<T> {
    fault!(
        "the tool of radius {:.4} mm does not fit into the corner before this move: take a smaller one, or remove {}",
        on.radius,
        g_name(on.code)
    )
}
