//! The moves of canned drilling and boring cycles, G73, G74 and G81 to G89.
//!
//! As in LinuxCNC: a rapid up to R where the series begins below it, across to the hole, down to R, the moves of the cycle,
//! and back to R (G99), or to the height where the series began if that is higher (G98). The path between holes is exact.

use super::block::{g_name, Block, AXES};
use super::coordinates::Point;
use super::execute::Spindle;
use super::fault::Outcome;
use super::interpreter::{Interpreter, Topic};
use super::modal::FeedMode;
use super::moves::{Control, Kind, Mode};
use super::tolerance::MOST_REPEATS;

/// The height above the last depth to which G73 retracts, and at which the rapid down of G83 ends, unless D gives it, in mm:
/// 0.010 inch.
const PECK_CLEARANCE: f64 = 0.254;

/// One hole: its cycle, the tool axis, and heights along it in machine coordinates.
struct Hole {
    motion: u16,
    normal: usize,
    feed: f64,
    initial: f64,
    /// Retract height and bottom in the coordinates and units of the program; `peck` is in these units too.
    own: [f64; 2],
    retract: f64,
    bottom: f64,
    clear: f64,
    dwell: f64,
    peck: f64,
    clearance: f64,
}

impl Interpreter<'_> {
    /// Drills at the axis words of the block, L times.
    pub fn cycle(&mut self, block: &Block, motion: u16) -> Outcome<()> {
        if self.state.feed_mode == FeedMode::Inverse {
            return fault!("{} does not work with inverse time (G93): give G94 and F", g_name(motion));
        }
        let feed = self.feed()?.linear;
        if let Some(letter) = AXES[3..].iter().find(|&&letter| block.has(letter)) {
            return fault!(
                "word {} stands in the cycle {}: cycles move X, Y and Z only",
                block.word(*letter),
                g_name(motion)
            );
        }
        let repeats = block.count(b'L', 1, "number of repetitions")?.unwrap_or(1);
        if repeats > MOST_REPEATS {
            return fault!("word {} is more than {MOST_REPEATS} repetitions: check L", block.word(b'L'));
        }
        self.check_beside(&g_name(motion))?;
        let hole = self.hole(block, motion, feed)?;
        if block.has(b'P') && matches!(motion, 730 | 810 | 830 | 850) {
            self.warn_once(Topic::CycleDwell, || {
                format!(
                    "the dwell {} of {} is left out: this cycle has none",
                    block.word(b'P'),
                    g_name(motion)
                )
            });
        }

        let (u, v) = self.state.plane();
        let normal = self.state.normal;
        if !self.state.retract_given && hole.clear < self.position()[normal] {
            self.warn_once(Topic::Retract, || {
                "neither G98 nor G99 is given: cycles go back to R (G99), as LinuxCNC does".into()
            });
        }
        // In absolute mode the axis words are the hole, in incremental mode a step before each repetition.
        let here = self.position();
        let mut place = here;
        let goal = self.target(block, false)?;
        let step = [goal[u] - here[u], goal[v] - here[v]];
        let absolute = self.state.absolute;
        if absolute {
            (place[u], place[v]) = (goal[u], goal[v]);
        }
        let before = self.state.control;
        if before.mode != Mode::ExactStop {
            self.state.control = Control::new(Mode::ExactPath);
        }
        let mut up = here;
        // A series that begins below R rises to R before it crosses.
        if hole.initial < hole.retract {
            up[normal] = hole.retract;
        }
        place[normal] = if up[normal] > hole.retract { up[normal] } else { hole.clear };
        for height in [hole.bottom, hole.clear, place[normal]] {
            let mut reached = up;
            reached[normal] = height;
            self.check_reach(&reached)?;
        }
        self.rapid(&up)?;
        for _ in 0..repeats {
            if !absolute && block.is_polar() {
                let next = self.turned_target(block, false, &place)?;
                (place[u], place[v]) = (next[u], next[v]);
            } else if !absolute {
                (place[u], place[v]) = (place[u] + step[0], place[v] + step[1]);
            }
            self.check_reach(&place)?;
            self.rapid(&place)?;
            self.drill(block, &hole, place)?;
            place[normal] = hole.clear;
        }
        self.state.control = before;
        Ok(())
    }

    /// Heights and words of the cycle; missing ones are as in the block before, if that had the same cycle.
    fn hole(&mut self, block: &Block, motion: u16, feed: f64) -> Outcome<Hole> {
        let normal = self.state.normal;
        let unit = self.state.unit();
        let again = self.state.motion == motion;
        let current = self.position()[normal];
        let zero = self.state.offsets.sum()[normal];
        let absolute = self.state.absolute;
        let sticky = &mut self.state.sticky;
        for (letter, kept) in [(b'R', &mut sticky.retract), (AXES[normal], &mut sticky.bottom)] {
            match block.get(letter) {
                Some(value) => *kept = value,
                None if again => {}
                None => {
                    return fault!(
                        "the cycle {} has no {}: give R (retract height) and {} (bottom)",
                        g_name(motion),
                        letter as char,
                        AXES[normal] as char
                    )
                }
            }
        }
        sticky.peck = block.get(b'Q').or(sticky.peck.filter(|_| again));
        // Taps keep the dwell of the last cycle that had one, whichever it was.
        let taps = matches!(motion, 740 | 840);
        if taps || matches!(motion, 820 | 860 | 890) {
            sticky.dwell = block.get(b'P').or(sticky.dwell.filter(|_| again || taps));
        }
        let initial = *sticky.initial.get_or_insert(current);
        // The heights in the coordinates of the program, then in machine coordinates.
        let own = if absolute {
            [sticky.retract, sticky.bottom]
        } else {
            let retract = sticky.retract + (initial - zero) / unit;
            [retract, retract + sticky.bottom]
        };
        let [retract, bottom] = own.map(|height| height * unit + zero);
        if bottom > retract {
            return fault!(
                "the cycle {} has its bottom {:.4} mm above its retract height R: check R and {}",
                g_name(motion),
                bottom - retract,
                AXES[normal] as char
            );
        }
        let clearance = match block.get(b'D') {
            Some(value) if matches!(motion, 730 | 830) => value * unit,
            _ => PECK_CLEARANCE,
        };
        let dwell = match (sticky.dwell, motion) {
            (None, 820 | 860 | 890) => {
                return fault!("the cycle {} has no dwell: give P in seconds", g_name(motion))
            }
            (dwell, _) => dwell.unwrap_or(0.0),
        };
        let peck = match (sticky.peck, motion) {
            (Some(peck), 730 | 830) if peck > 0.0 => peck,
            (_, 730 | 830) => {
                return fault!("the cycle {} has no depth of one peck: give a positive Q", g_name(motion))
            }
            _ => f64::INFINITY,
        };
        let clear = if self.state.retract_to_initial { retract.max(initial) } else { retract };
        Ok(Hole { motion, normal, feed, initial, own, retract, bottom, clear, dwell, peck, clearance })
    }

    /// From above the hole down to R, through the cycle and up again.
    fn drill(&mut self, block: &Block, hole: &Hole, mut place: Point) -> Outcome<()> {
        let Hole { normal, retract, bottom, clear, .. } = *hole;
        let mut go = |reader: &mut Self, kind: Kind, height: f64| {
            place[normal] = height;
            reader.go(kind, &place, if kind == Kind::Rapid { f64::INFINITY } else { hole.feed })
        };
        go(self, Kind::Rapid, retract)?;
        let pecks = ((hole.own[0] - hole.own[1]) / hole.peck).ceil();
        if pecks > f64::from(MOST_REPEATS) {
            return fault!("the cycle {} takes {pecks} pecks: check Q", g_name(hole.motion));
        }
        // Depths are summed in the units of the program, so that rounding gives the same number of pecks as on a control.
        let (unit, zero) = (self.state.unit(), self.state.offsets.sum()[normal]);
        let mut reached = hole.own[0] - hole.peck;
        while reached > hole.own[1] {
            let depth = reached * unit + zero;
            go(self, Kind::Line, depth)?;
            if hole.motion == 830 {
                go(self, Kind::Rapid, retract)?;
            }
            go(self, Kind::Rapid, (depth + hole.clearance).min(retract))?;
            reached -= hole.peck;
        }
        go(self, Kind::Line, bottom)?;
        if matches!(hole.motion, 740 | 820 | 840 | 860 | 890) {
            self.dwell(block, b'P', hole.dwell)?;
        }
        match hole.motion {
            850 => go(self, Kind::Line, retract)?,
            // The spindle stands still on the way up.
            860 => {
                self.turn_spindle(Spindle::Off);
                go(self, Kind::Rapid, clear)?;
                self.turn_spindle(Spindle::AsBefore);
            }
            890 => go(self, Kind::Line, clear)?,
            // A tap reverses the spindle at the bottom and again at the top.
            740 | 840 => {
                self.turn_spindle(Spindle::Reversed);
                go(self, Kind::Line, clear)?;
                self.turn_spindle(Spindle::AsBefore);
            }
            _ => {}
        }
        go(self, Kind::Rapid, clear)
    }
}
