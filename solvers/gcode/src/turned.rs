//! Places that are not written along the machine's axes: polar words, and work coordinates that are turned about Z.

use super::block::{Block, Group};
use super::execute::Interpreter;
use super::fault::{fault, Outcome};
use super::moves::Point;

impl Interpreter<'_> {
    /// The end of a move from a place to the block's axis words or polar words.
    #[cold]
    pub(super) fn turned_target(&mut self, block: &Block, machine: bool, from: &Point) -> Outcome<Point> {
        let mut target = *from;
        if machine {
            self.places(block, |axis, value| target[axis] = value)?;
            self.check_reach(&target)?;
            return Ok(target);
        }
        let offsets = self.state.offsets.clone();
        let mut place = offsets.to_program(&target);
        let before = place;
        let absolute = block.code(Group::Distance).map_or(self.state.absolute, |code| code == 900);
        let mut named = [false; 9];
        self.places(block, |axis, value| {
            named[axis] = true;
            place[axis] = value + if absolute { 0.0 } else { before[axis] };
        })?;
        if block.is_polar() {
            self.polar_words(block, absolute, &before, &mut place)?;
        } else if self.state.polar {
            let (u, v) = self.state.plane();
            if !absolute && (named[u] || named[v]) {
                return fault("G16 and G91 stand together: give polar coordinates in G90");
            }
            let (radius, angle) = (before[u].hypot(before[v]), before[v].atan2(before[u]));
            let radius = if named[u] { place[u] } else { radius };
            // A word of the second axis is an angle, whatever the units of length.
            let angle = if named[v] { (place[v] / self.state.unit()).to_radians() } else { angle };
            if named[u] || named[v] {
                (place[u], place[v]) = (radius * angle.cos(), radius * angle.sin());
            }
        }
        let moved = offsets.to_machine(&place);
        let turned = [0, 1].into_iter().any(|axis| place[axis] != before[axis]);
        for axis in 0..9 {
            // Axes that the block does not move stay, without rounding.
            if place[axis] != before[axis] || (axis < 2 && turned) {
                target[axis] = moved[axis];
            }
        }
        self.check_reach(&target)?;
        Ok(target)
    }

    /// `@` and `^`: radius and angle about the program's zero, added to those of the place before in G91.
    fn polar_words(&self, block: &Block, absolute: bool, before: &Point, place: &mut Point) -> Outcome<()> {
        if block.has(b'X') || block.has(b'Y') {
            return fault("polar words @ and ^ stand beside X or Y: give one of both");
        }
        let (mut radius, mut angle) = (before[0].hypot(before[1]), before[1].atan2(before[0]));
        if radius == 0.0 && !(absolute && block.angle.is_some()) {
            return fault("the place before is the origin, which has no angle: give @ and ^ in G90");
        }
        if let Some(word) = block.radius {
            radius = word * self.state.unit() + if absolute { 0.0 } else { radius };
        }
        if let Some(word) = block.angle {
            angle = word.to_radians() + if absolute { 0.0 } else { angle };
        }
        (place[0], place[1]) = (radius * angle.cos(), radius * angle.sin());
        Ok(())
    }
}
