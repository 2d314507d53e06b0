//! Computes positions from polar words, and in coordinates that are rotated about Z by a work offset or by G68.

use super::block::{bits, g_name, Block, Group, AXIS_WORDS};
use super::coordinates::Point;
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::modal::turn;

impl Interpreter<'_> {
    /// The end of a move to the axis words or polar words of a block.
    #[cold]
    pub fn turned_target(&mut self, block: &Block, machine: bool, from: &Point) -> Outcome<Point> {
        let mut target = *from;
        if machine {
            self.axis_values(block, |axis, value| target[axis] = value)?;
            self.check_reach(&target)?;
            return Ok(target);
        }
        let offsets = self.state.offsets.clone();
        let before = offsets.to_program(&target);
        let mut end = before;
        let absolute = block.code(Group::Distance).map_or(self.state.absolute, |code| code == 900);
        let mut named = [false; 9];
        self.axis_values(block, |axis, value| {
            named[axis] = true;
            end[axis] = value + if absolute { 0.0 } else { before[axis] };
        })?;
        if block.is_polar() {
            self.polar_words(block, absolute, &before, &mut end)?;
        } else if self.state.polar {
            let (u, v) = self.state.plane();
            if !absolute && (named[u] || named[v]) {
                return fault!("G16 and G91 stand together: give polar coordinates in G90");
            }
            let (radius, angle) = (before[u].hypot(before[v]), before[v].atan2(before[u]));
            let radius = if named[u] { end[u] } else { radius };
            // The word of the second axis is an angle, whatever the unit of length.
            let angle = if named[v] { (end[v] / self.state.unit()).to_radians() } else { angle };
            if named[u] || named[v] {
                (end[u], end[v]) = (radius * angle.cos(), radius * angle.sin());
            }
        }
        let moved = offsets.to_machine(&end);
        let turned = end[..2] != before[..2];
        for axis in 0..9 {
            // Axes that the block does not move keep their position without rounding.
            if end[axis] != before[axis] || (axis < 2 && turned) {
                target[axis] = moved[axis];
            }
        }
        self.check_reach(&target)?;
        Ok(target)
    }

    /// `@` and `^`: radius and angle about the program's zero; with G91 they are added to those of `before`.
    fn polar_words(&self, block: &Block, absolute: bool, before: &Point, end: &mut Point) -> Outcome<()> {
        if block.has(b'X') || block.has(b'Y') {
            return fault!("polar words @ and ^ stand beside X or Y: give one of both");
        }
        let (mut radius, mut angle) = (before[0].hypot(before[1]), before[1].atan2(before[0]));
        let [radius_word, angle_word] = block.polar;
        if radius == 0.0 && !(absolute && angle_word.is_some()) {
            return fault!("the place before is the origin, which has no angle: give @ and ^ in G90");
        }
        if let Some(word) = radius_word {
            radius = word * self.state.unit() + if absolute { 0.0 } else { radius };
        }
        if let Some(word) = angle_word {
            angle = word.to_radians() + if absolute { 0.0 } else { angle };
        }
        (end[0], end[1]) = (radius * angle.cos(), radius * angle.sin());
        Ok(())
    }

    /// G68: rotates the program's coordinates by R about X and Y, or about the position of the tool.
    pub fn begin_turn(&mut self, block: &Block) -> Outcome<()> {
        if self.state.normal != 2 {
            return fault!("G68 is read in the plane G17: give G17, or post the coordinates as they are cut");
        }
        if !self.state.absolute {
            return fault!(
                "G68 stands in G91, where controls differ in what it means: give G90 in its block"
            );
        }
        let Some(angle) = block.get(b'R') else {
            return fault!("G68 has no angle: give it as R in degrees");
        };
        if block.words & AXIS_WORDS & !bits(b"XY") != 0 {
            return fault!("G68 turns about Z: give X and Y of its centre alone");
        }
        self.end_turn();
        let mut centre = self.state.offsets.to_program(&self.position());
        self.axis_values(block, |axis, value| centre[axis] = value)?;
        let offsets = &mut self.state.offsets;
        offsets.unturned = Some((offsets.shift, offsets.rotation));
        // c + turn(p - c) is turn(p + s) for the shift s = turn(c - turn(c), back).
        let mut turned = centre;
        turn(&mut turned, angle);
        for axis in 0..2 {
            offsets.shift[axis] += centre[axis] - turned[axis];
        }
        turn(&mut offsets.shift, -angle);
        offsets.rotation += angle;
        offsets.update();
        Ok(())
    }

    /// G69.
    pub fn end_turn(&mut self) {
        let offsets = &mut self.state.offsets;
        if let Some(before) = offsets.unturned.take() {
            (offsets.shift, offsets.rotation) = before;
            offsets.update();
        }
    }

    /// Refuses codes that change the offsets while G68 is on, as controls do.
    pub fn check_turned(&self, block: &Block) -> Outcome<()> {
        if self.state.offsets.unturned.is_none() {
            return Ok(());
        }
        let once = block.code(Group::Once).filter(|code| matches!(code, 100 | 520 | 920));
        match once.or(block.code(Group::Shift)).or(block.code(Group::System)) {
            Some(code) => {
                fault!("{} stands where G68 turns the coordinates: give G69 before", g_name(code))
            }
            None => Ok(()),
        }
    }
}
