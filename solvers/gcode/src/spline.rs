//! Converts splines to Bézier pieces: LinuxCNC's G5 and G5.1 (Bézier curves of one block) and G5.2 to G5.3 (NURBS with uniform
//! knots), and Fanuc's G6.2 (NURBS with knots). A NURBS of several blocks is one move, in the line of its first block.

use super::block::{bit, bits, g_name, Block, Group, AXES, AXIS_WORDS};
use super::coordinates::Point;
use super::fault::Outcome;
use super::interpreter::{Interpreter, Topic};
use super::modal::{Feed, FeedMode};
use super::nurbs::{check_order, Nurbs};
use super::tolerance::SAME_PLACE;
use feedplan_geometry::spline::CompositeCurve;

/// The order of a NURBS without L in G5.2, or P in G6.2.
const ORDER: usize = 3;
const FANUC_ORDER: usize = 4;

impl Interpreter<'_> {
    /// Executes a block with G5, G5.1, G5.2, G5.3 or G6.2 outside of an open spline.
    pub fn spline(&mut self, block: &Block, motion: u16) -> Outcome<()> {
        if motion == 53 {
            return fault!("word G5.3 ends a NURBS that no G5.2 began: remove it");
        }
        self.check_beside(&g_name(motion))?;
        self.check_corner()?;
        if motion != 62 {
            self.check_plane(block, motion)?;
        }
        if self.state.feed_mode == FeedMode::Inverse {
            return fault!("{} does not work with inverse time (G93): give G94 and F", g_name(motion));
        }
        let feed = self.feed()?;
        match motion {
            50 => self.cubic(block, feed),
            51 => self.quadratic(block, feed),
            _ => self.open(block, motion, feed),
        }
    }

    /// Refuses G5 to G5.2 outside of X and Y.
    fn check_plane(&self, block: &Block, motion: u16) -> Outcome<()> {
        let name = g_name(motion);
        if self.state.normal != 2 {
            return fault!("{name} works in the plane G17 only: give G17, or post lines");
        }
        match AXES.iter().find(|&&letter| block.has(letter) && !b"XY".contains(&letter)) {
            Some(&letter) => fault!(
                "word {} stands in {name}, which moves X and Y only: put it in a block before",
                block.word(letter)
            ),
            None => Ok(()),
        }
    }

    /// Adds a cubic Bézier curve: I J is the vector from its start to the first inner control point, P Q from its end to the
    /// second.
    fn cubic(&mut self, block: &Block, feed: Feed) -> Outcome<()> {
        let start = self.moves.position;
        let first = match (self.offset(block, *b"IJ")?, self.mirror) {
            (Some(first), _) => first,
            (None, Some((row, mirror))) if row == self.moves.len() => mirror,
            _ => return fault!("the first G5 of a series has no I and J: give both"),
        };
        let Some(second) = self.offset(block, *b"PQ")? else {
            return fault!("G5 has no P and Q: give both");
        };
        let end = self.target(block, false)?;
        self.bezier(&[start, beside(&start, first), beside(&end, second), end], feed)?;
        self.mirror = Some((self.moves.len(), second.map(|value| -value)));
        Ok(())
    }

    /// Adds a quadratic Bézier curve: I J is the vector from its start to the inner control point; a missing one is 0.
    fn quadratic(&mut self, block: &Block, feed: Feed) -> Outcome<()> {
        if let Some(letter) = b"PQ".iter().find(|&&letter| block.has(letter)) {
            return fault!(
                "word {} has no meaning here: G5.1 takes X, Y, I and J; remove it",
                block.word(*letter)
            );
        }
        if block.words & bits(b"IJ") == 0 {
            return fault!("G5.1 has no control point: give I and J");
        }
        let unit = self.state.unit();
        let offset = [b'I', b'J'].map(|letter| block.get(letter).unwrap_or(0.0) * unit);
        let start = self.moves.position;
        let end = self.target(block, false)?;
        self.bezier(&[start, beside(&start, offset), end], feed)
    }

    /// A vector of two words, in mm; None where both are missing.
    fn offset(&self, block: &Block, letters: [u8; 2]) -> Outcome<Option<[f64; 2]>> {
        let unit = self.state.unit();
        match letters.map(|letter| block.get(letter)) {
            [Some(x), Some(y)] => Ok(Some([x * unit, y * unit])),
            [None, None] => Ok(None),
            [first, _] => {
                let [given, missing] = if first.is_some() { letters } else { [letters[1], letters[0]] };
                fault!("word {} of G5 stands without {}: give both", block.word(given), missing as char)
            }
        }
    }

    fn bezier(&mut self, points: &[Point], feed: Feed) -> Outcome<()> {
        for point in points {
            self.check_reach(point)?;
        }
        let mut curve = CompositeCurve::default();
        curve.push(points, &[], 1.0);
        self.moves.spline(&curve, feed.linear, &self.state.control, self.line)
    }

    /// Begins a NURBS with its first block.
    fn open(&mut self, block: &Block, code: u16, feed: Feed) -> Outcome<()> {
        let start = self.moves.position;
        let order = if code == 62 { block.count(b'P', 2, "order")? } else { None };
        let order = order.map_or(if code == 62 { FANUC_ORDER } else { ORDER }, |order| order as usize);
        check_order(block, b'P', order)?;
        let mut nurbs =
            Nurbs { code, line: self.line, feed, order, points: vec![], weights: vec![], knots: vec![] };
        let axes = block.words & AXIS_WORDS != 0;
        if code == 62 {
            let point = self.control_point(block, start)?;
            if let Some(axis) = (0..9).find(|&axis| (point[axis] - start[axis]).abs() > SAME_PLACE) {
                return fault!(
                    "the first control point of G6.2 has {} {} off from where the tool is: move there before",
                    AXES[axis] as char,
                    point[axis] - start[axis],
                );
            }
            nurbs.points.push(start);
            nurbs.weights.push(block.get(b'R').unwrap_or(1.0));
            nurbs.knots.push(block.get(b'K').unwrap_or(f64::NAN));
        } else {
            nurbs.points.push(start);
            nurbs.weights.push(block.get(b'P').filter(|_| !axes).unwrap_or(1.0));
            nurbs.set_order(block)?;
            if axes {
                self.add_point(&mut nurbs, block)?;
            }
        }
        self.open = Some(Box::new(nurbs));
        Ok(())
    }

    /// Executes a further block of the open NURBS.
    #[cold]
    pub fn continue_spline(&mut self, block: &Block, mut nurbs: Box<Nurbs>) -> Outcome<()> {
        if block.is_empty() {
            self.open = Some(nurbs);
            return Ok(());
        }
        let code = nurbs.code;
        let motion = block.code(Group::Motion);
        let ends = code == 52 && motion == Some(53);
        let own = if code == 62 { AXIS_WORDS | bits(b"KRQ") } else { bits(b"XYPL") };
        let own = if ends { 0 } else { own };
        if !block.only_motion()
            || !(ends || motion.is_none_or(|motion| motion == code))
            || block.words & !own != 0
        {
            return interrupted(block, &nurbs, motion, own);
        }
        if ends {
            return self.close(&nurbs);
        }
        if code == 52 {
            nurbs.set_order(block)?;
            self.add_point(&mut nurbs, block)?;
        } else if self.add_knot(&mut nurbs, block)? {
            return self.close(&nurbs);
        }
        self.open = Some(nurbs);
        Ok(())
    }

    /// Adds a control point of G5.2: X and Y, with G91 from the start of the spline, and its weight P.
    fn add_point(&mut self, nurbs: &mut Nurbs, block: &Block) -> Outcome<()> {
        self.check_plane(block, 52)?;
        let has = b"XYP".map(|letter| block.has(letter));
        if let Some(missing) = has.iter().position(|has| !has) {
            return fault!(
                "a control point of G5.2 has no {}: give X, Y and the weight P",
                b"XYP"[missing] as char
            );
        }
        let point = self.target(block, false)?;
        nurbs.points.push(point);
        nurbs.weights.push(block.value(b'P'));
        Ok(())
    }

    /// Adds a block of G6.2 after the first: a control point with a knot, or one of the last knots; returns true for the last
    /// block.
    fn add_knot(&mut self, nurbs: &mut Nurbs, block: &Block) -> Outcome<bool> {
        let Some(knot) = block.get(b'K') else {
            return fault!("a block of the spline G6.2 of line {} has no knot: give K", nurbs.line);
        };
        // A first knot that is missing equals the second.
        if nurbs.knots.len() == 1 && nurbs.knots[0].is_nan() {
            nurbs.knots[0] = knot;
        }
        let alone = nurbs.knots.len() > nurbs.points.len();
        if block.words & AXIS_WORDS != 0 {
            if alone {
                return fault!(
                    "a control point stands after the last knots of the spline G6.2 of line {}: put it before, or \
                     give G6.2 for another spline",
                    nurbs.line
                );
            }
            let last = nurbs.points[nurbs.points.len() - 1];
            nurbs.points.push(self.control_point(block, last)?);
            nurbs.weights.push(block.get(b'R').unwrap_or(1.0));
        } else if block.has(b'R') {
            return fault!("word {} weighs no control point: give axis words", block.word(b'R'));
        } else if nurbs.points.len() < nurbs.order {
            return fault!(
                "the spline G6.2 of line {} has {} control points and its order is {}: give at least so many, or a \
                 lower P",
                nurbs.line,
                nurbs.points.len(),
                nurbs.order
            );
        }
        nurbs.knots.push(knot);
        Ok(nurbs.knots.len() == nurbs.points.len() + nurbs.order)
    }

    /// A control point of G6.2, with G91 from the one before.
    fn control_point(&mut self, block: &Block, before: Point) -> Outcome<Point> {
        let zero = *self.state.offsets.sum();
        self.place(block, before, &zero)
    }

    /// Adds the move along a NURBS that is complete.
    fn close(&mut self, nurbs: &Nurbs) -> Outcome<()> {
        let curve = nurbs.curve()?;
        self.state.motion = 800;
        self.moves.spline(&curve, nurbs.feed_along(), &self.state.control, nurbs.line)
    }

    /// Refuses a program that ends inside a spline.
    pub fn check_end(&self) -> Outcome<()> {
        match &self.open {
            None => self.check_corner(),
            Some(nurbs) => fault!(
                "the program ends inside the spline {} of line {}: it may be truncated",
                g_name(nurbs.code),
                nurbs.line
            ),
        }
    }

    /// True for Fanuc's G5 P or G5.1 Q alone in a block, which switches its look-ahead.
    pub fn switches_look_ahead(&mut self, block: &Block, motion: Option<u16>) -> bool {
        let switch = match motion {
            Some(50) => bit(b'P'),
            Some(51) => bit(b'Q'),
            _ => return false,
        };
        let switches = block.words == switch;
        if switches {
            self.warn_once(Topic::LookAhead, || {
                "Fanuc's G5 P and G5.1 Q switch its look-ahead, which has no effect on the path".into()
            });
        }
        switches
    }
}

/// Refuses a block that is not one of the spline; `own` are the words of its blocks.
#[cold]
fn interrupted(block: &Block, nurbs: &Nurbs, motion: Option<u16>, own: u32) -> Outcome<()> {
    let (name, line) = (g_name(nurbs.code), nurbs.line);
    let takes = if nurbs.code == 62 { "axis words, K and R" } else { "X, Y, P and L" };
    let end = if nurbs.code == 62 { "its last knots" } else { "G5.3" };
    let foreign = motion.filter(|&motion| motion != nurbs.code && motion != 53);
    let letter = (b'A'..=b'Z').find(|&letter| block.words & !own & bit(letter) != 0);
    let what = match (foreign, letter) {
        (Some(code), _) => format!("word {}", g_name(code)),
        (None, Some(letter)) => format!("word {}", block.word(letter)),
        (None, None) => "this block".into(),
    };
    fault!(
        "{what} stands inside the spline {name} of line {line}, which takes {takes} until {end}: end it before"
    )
}

/// A point moved in X and Y.
fn beside(point: &Point, offset: [f64; 2]) -> Point {
    let mut moved = *point;
    moved[0] += offset[0];
    moved[1] += offset[1];
    moved
}

#[cfg(test)]
mod tests {
    use crate::{read, Columns, Options};

    fn columns(text: &str) -> Columns {
        read(format!("G21 F600\n{text}\nM2\n").as_bytes(), &Options::default(), &|_| ()).unwrap()
    }

    fn message(text: &str) -> (Option<u32>, String) {
        let error = read(text.as_bytes(), &Options::default(), &|_| ()).unwrap_err();
        (error.line, error.message)
    }

    #[test]
    fn the_curves_of_one_block_by_hand() {
        let found = columns("G0 X1 Y1\nG5 I0 J3 P0 Q-3 X2 Y2\nP1 Q0 X4 Y2\nG5.1 X5 Y3 J1");
        let points: Vec<[f64; 2]> =
            found.spline_control.chunks(3).map(|point| [point[0], point[1]]).collect();
        assert_eq!(points[..4], [[1.0, 1.0], [1.0, 4.0], [2.0, -1.0], [2.0, 2.0]]);
        assert_eq!(points[4..8], [[2.0, 2.0], [2.0, 5.0], [5.0, 2.0], [4.0, 2.0]]);
        assert_eq!(points[8..], [[4.0, 2.0], [4.0, 3.0], [5.0, 3.0]]);
        assert_eq!((found.spline_pieces, found.spline_move), (vec![0, 1, 2, 3], vec![1, 2, 3]));
        assert!(found.spline_weights.is_empty());
    }

    #[test]
    fn a_quarter_circle_is_one_either_way() {
        // The weight of the corner is cos 45 degrees.
        let nurbs = "G5.2 P1\nX10 Y0 P[SQRT[0.5]]\nX10 Y10 P1\nG5.3";
        let fanuc = "G6.2 P3 K0\nK0 X10 R[SQRT[0.5]]\nK0 Y10\nK1\nK1\nK1";
        for text in [nurbs, fanuc] {
            let found = columns(text);
            assert_eq!(found.spline_control, [0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 10.0, 10.0, 0.0]);
            assert_eq!(found.spline_weights, [1.0, 0.5_f64.sqrt(), 1.0]);
            assert_eq!((found.kind, found.line, found.feed), (vec![3], vec![2], vec![10.0]));
        }
    }

    #[test]
    fn a_spline_names_the_line_it_begins_in() {
        let (line, text) = message("G21 F600\nG5.2 P1\nX1 Y1 P1\nG0 X1\n");
        assert_eq!(line, Some(4));
        assert!(text.starts_with(
            "word G0 stands inside the spline G5.2 of line 2, which takes X, Y, P and L until G5.3"
        ));
        let (line, text) = message("G21 F600\nG6.2 K0\nK0 X1\n");
        assert_eq!((line, text.ends_with("it may be truncated")), (Some(3), true));
    }
}
