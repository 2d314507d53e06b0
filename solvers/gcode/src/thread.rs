//! Adds moves that are synchronous with the spindle: G33 (one pass of a thread), G33.1 (a tap) and G76 (a whole thread).

use super::block::Block;
use super::coordinates::Point;
use super::execute::Spindle;
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::moves::Kind;
use super::tolerance::MOST_PASSES;

/// The heights of a thread along X and its ends along Z, in mm. Depths are from the drive line towards the workpiece.
struct Thread {
    /// The start of the passes.
    start: Point,
    /// 1 for an inner thread, whose workpiece is at greater X; -1 for an outer thread.
    inward: f64,
    full: f64,
    end_depth: f64,
    target: f64,
    compound: f64,
    taper: f64,
    at_entry: bool,
    at_exit: bool,
    feed: f64,
    taper_feed: f64,
}

impl Interpreter<'_> {
    /// The feed in mm/s that advances by the pitch of a word in each turn of the spindle.
    fn synchronous_feed(&self, block: &Block, letter: u8, code: &str) -> Outcome<f64> {
        let Some(pitch) = block.get(letter).filter(|&pitch| pitch > 0.0) else {
            return fault!("{code} has no pitch: give a positive {}", letter as char);
        };
        match self.spindle_speed() {
            Some(speed) => Ok(pitch * self.state.unit() * speed / 60.0),
            None => fault!("{code} follows the spindle and its speed is not known: give S and M3 before"),
        }
    }

    /// G33, and G33.1, which returns with the spindle reversed.
    pub fn thread_once(&mut self, block: &Block, motion: u16) -> Outcome<()> {
        let code = if motion == 330 { "G33" } else { "G33.1" };
        self.check_beside(code)?;
        let feed = self.synchronous_feed(block, b'K', code)?;
        let start = self.position();
        let target = self.target(block, false)?;
        self.go(Kind::Line, &target, feed)?;
        if motion == 331 {
            self.turn_spindle(Spindle::Reversed);
            self.go(Kind::Line, &start, feed)?;
            self.turn_spindle(Spindle::AsBefore);
        }
        Ok(())
    }

    /// G76: passes of growing depth up to the depth of the thread, and spring passes at that depth.
    pub fn thread(&mut self, block: &Block) -> Outcome<()> {
        self.check_beside("G76")?;
        if let Some(letter) = b"XYABCUVW".iter().find(|&&letter| block.has(letter)) {
            return fault!("word {} stands in G76, which goes along Z: remove it", block.word(*letter));
        }
        let feed = self.synchronous_feed(block, b'P', "G76")?;
        let unit = self.state.unit() * if self.state.diameters { 0.5 } else { 1.0 };
        let word = |letter: u8| block.get(letter).map(|value| value * unit);
        let [Some(peak), Some(first), Some(height)] = [word(b'I'), word(b'J'), word(b'K')] else {
            return fault!("G76 takes I, J and K (thread peak, first depth, full depth): give all three");
        };
        if peak == 0.0 || first <= 0.0 || height <= first {
            return fault!("G76 takes an I that is not 0, and a K above J, which is above 0: check them");
        }
        let springs = block.count(b'H', 0, "number of spring passes")?.unwrap_or(0);
        let tapers = block.count(b'L', 0, "choice of tapers")?.unwrap_or(0);
        let degression = block.get(b'R').filter(|value| *value >= 1.0).unwrap_or(1.0);
        let start = self.position();
        let end = self.target(block, false)?;
        let rising = end[2] > start[2];
        let compound = block.get(b'Q').unwrap_or(0.0).to_radians() * if rising { -1.0 } else { 1.0 };
        let length = block.get(b'E').map_or(0.0, |value| (value * self.state.unit()).max(0.0));
        let taper_feed = if length > 0.0 { feed * length.hypot(height) / length } else { feed };
        let thread = Thread {
            start,
            inward: peak.signum(),
            full: height,
            end_depth: height + peak.abs(),
            target: end[2] + height * compound.tan(),
            compound,
            taper: if rising { -length } else { length },
            at_entry: tapers & 1 != 0,
            at_exit: tapers & 2 != 0,
            feed,
            taper_feed,
        };
        let mut passes = 1;
        let mut depth = peak.abs() + first;
        while depth < thread.end_depth {
            self.pass(&thread, depth)?;
            passes += 1;
            depth = peak.abs() + first * f64::from(passes).powf(1.0 / degression);
            if passes > MOST_PASSES {
                return fault!("G76 takes more than {MOST_PASSES} passes: check J, K and R");
            }
        }
        if springs > MOST_PASSES {
            return fault!("word {} is more than {MOST_PASSES} passes: check H", block.word(b'H'));
        }
        for _ in 0..=springs {
            self.pass(&thread, thread.end_depth)?;
        }
        self.rapid(&end)
    }

    /// One pass at a depth from the drive line.
    fn pass(&mut self, thread: &Thread, depth: f64) -> Outcome<()> {
        let shift = (depth - (thread.end_depth - thread.full)) * thread.compound.tan();
        let (begin, end) = (thread.start[2] - shift, thread.target - shift);
        let at = |depth: f64, z: f64| {
            let mut place = thread.start;
            (place[0], place[2]) = (place[0] + thread.inward * depth, z);
            place
        };
        let clear = depth - thread.end_depth;
        self.rapid(&at(clear, begin))?;
        let tapered = thread.taper != 0.0;
        if tapered && thread.at_entry {
            self.go(Kind::Line, &at(depth - thread.full, begin), thread.taper_feed)?;
            self.go(Kind::Line, &at(depth, begin - thread.taper), thread.taper_feed)?;
        } else {
            self.rapid(&at(depth, begin))?;
        }
        if tapered && thread.at_exit {
            self.go(Kind::Line, &at(depth, end + thread.taper), thread.feed)?;
            self.go(Kind::Line, &at(depth - thread.full, end), thread.taper_feed)?;
        } else {
            self.go(Kind::Line, &at(depth, end), thread.feed)?;
        }
        self.rapid(&at(clear, end))
    }
}
