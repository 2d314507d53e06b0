//! Adds the straight move or the arc of one block, with its feed.

use super::arc::{arc, arc_length, Form};
use super::block::{bits, Block, AXES, AXIS_WORDS};
use super::coordinates::{CoordinateMode, Point};
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::modal::{Feed, FeedMode};
use super::moves::{only_turns, straight_length, Arc, Kind};
use super::tip::angle_between;
use super::tolerance::{FARTHEST_CENTRE, MOST_TURNS, RATES};

/// Words of the centre along X, Y, Z.
const CENTRE: [u8; 3] = *b"IJK";

impl Interpreter<'_> {
    /// G0 and G1 to the axis words of a block.
    #[inline(always)]
    pub fn straight(&mut self, block: &Block, rapid: bool, machine: bool) -> Outcome<()> {
        if self.state.coordinate_mode == CoordinateMode::Vector {
            return self.pointed(block, rapid);
        }
        let target = self.target(block, machine)?;
        if rapid {
            return self.rapid(&target);
        }
        // A G1 without axis words selects the motion only, and its feed may follow.
        if block.words & AXIS_WORDS == 0 && !block.is_polar() {
            return Ok(());
        }
        let feed = match self.state.feed_mode {
            FeedMode::Inverse => {
                let length = straight_length(&self.position(), &target);
                self.inverse_feed(block, length)?
            }
            _ => {
                let feed = self.feed()?;
                if block.words & bits(b"ABC") != 0 && only_turns(&self.position(), &target) {
                    feed.angular
                } else {
                    feed.linear
                }
            }
        };
        let start = self.moves.position;
        self.go(Kind::Line, &target, feed)?;
        if block.corner.is_some() {
            self.set_corner(block, &start, feed)?;
        }
        Ok(())
    }

    /// G0 and G1 to a position of the tip and a tool direction (G43.5).
    #[cold]
    fn pointed(&mut self, block: &Block, rapid: bool) -> Outcome<()> {
        let target = self.target(block, false)?;
        let direction = self.direction(block)?;
        let (kind, mut feed) = (if rapid { Kind::Rapid } else { Kind::Line }, f64::INFINITY);
        if !rapid {
            if block.words & (AXIS_WORDS | bits(b"IJK")) == 0 {
                return Ok(());
            }
            let length = straight_length(&self.moves.position, &target);
            feed = match self.state.feed_mode {
                FeedMode::Inverse if length > 0.0 => self.inverse_feed(block, length)?,
                FeedMode::Inverse => {
                    self.inverse_feed(block, angle_between(&self.moves.direction, &direction))?
                }
                _ if length > 0.0 => self.feed()?.linear,
                _ => self.feed()?.angular,
            };
        }
        self.moves.pointed(kind, &target, direction, feed, &self.state.control, self.line)
    }

    /// The feed in force, per second.
    #[inline(always)]
    pub fn feed(&self) -> Outcome<Feed> {
        let Some(feed) = self.state.feed else {
            return fault!(
                "a feed move has no feed: give F before or in this block, or a feed for such moves (--feed)",
            );
        };
        if feed.angular == 0.0 {
            return fault!("a feed move has the feed F0: give a positive F before or in this block");
        }
        if self.state.feed_mode == FeedMode::PerTurn {
            return self.feed_per_turn(feed);
        }
        Ok(feed)
    }

    #[cold]
    fn feed_per_turn(&self, feed: Feed) -> Outcome<Feed> {
        match self.spindle_speed() {
            Some(speed) => {
                let turns = speed / 60.0;
                Ok(Feed { linear: feed.linear * turns, angular: feed.angular * turns })
            }
            None if self.state.constant_surface_speed => fault!(
                "the feed is per turn (G95), and with a constant surface speed (G96) the spindle speed is not known: use G97 and S, or G94"
            ),
            None => fault!(
                "the feed is per turn (G95) and the spindle speed is not known: give S and M3 before, or use G94"
            ),
        }
    }

    /// The turns per minute of the spindle, where it is on and its speed is known.
    pub fn spindle_speed(&self) -> Option<f64> {
        self.state.spindle_speed.filter(|speed| self.state.spindle_on && RATES.contains(speed))
    }

    /// The feed in mm/s of a move of length `length` under G93, where F is 1/(duration in minutes).
    fn inverse_feed(&self, block: &Block, length: f64) -> Outcome<f64> {
        match block.get(b'F') {
            Some(rate) if rate > 0.0 => Ok(length * rate / 60.0),
            Some(_) => fault!("word {} is no inverse time: give a positive F", block.word(b'F')),
            None => {
                fault!("a feed move with inverse time (G93) has no F of its own: give F in each such block")
            }
        }
    }

    /// G2 (clockwise) and G3.
    pub fn arc(&mut self, block: &Block, clockwise: bool) -> Outcome<()> {
        let target = self.target(block, false)?;
        let normal = self.state.normal;
        let (u, v) = self.state.plane();
        self.check_corner()?;
        let position = self.position();
        if self.state.offsets.rotation != 0.0 && normal != 2 {
            return fault!(
                "an arc in G18 or G19 stands in work coordinates that are turned about Z: post lines",
            );
        }
        let form = self.arc_form(block, &position, u, v)?;
        let turns = block.count(b'P', 1, "number of turns")?.unwrap_or(1);
        if turns > MOST_TURNS {
            return fault!("word {} is more than {MOST_TURNS} turns: check P", block.word(b'P'));
        }
        let (start, end) = ([position[u], position[v]], [target[u], target[v]]);
        let (centre, angle) = arc(start, end, form, clockwise, turns)?;
        let feed = match self.state.feed_mode {
            FeedMode::Inverse => {
                let rise = target[normal] - position[normal];
                self.inverse_feed(block, arc_length(start, end, centre, angle, rise))?
            }
            _ => self.feed()?.linear,
        };
        if self.compensation.is_some() {
            return self.arc_beside(&target, centre, angle, feed);
        }
        let mut centre_point = [position[0], position[1], position[2]];
        (centre_point[u], centre_point[v]) = (centre[0], centre[1]);
        let arc = Arc { centre: centre_point, normal, angle };
        self.moves.arc(arc, &target, feed, &self.state.control, self.line)
    }

    /// The form of an arc: by R, or by the two centre words of the plane.
    fn arc_form(&self, block: &Block, position: &Point, u: usize, v: usize) -> Outcome<Form> {
        let unit = self.state.unit();
        let plane = 19 - self.state.normal;
        if let Some(radius) = block.get(b'R') {
            if block.words & bits(b"IJK") != 0 {
                return fault!("an arc has both R and a centre: give R, or I, J, K");
            }
            if !block.has(AXES[u]) && !block.has(AXES[v]) {
                return fault!(
                    "an arc with R has no end in the plane G{plane}: give {} or {}",
                    AXES[u] as char,
                    AXES[v] as char
                );
            }
            if radius.abs() > FARTHEST_CENTRE {
                return fault!("word {} is more than {FARTHEST_CENTRE:e}: check R", block.word(b'R'));
            }
            return Ok(Form::Radius(radius * unit));
        }
        let normal = CENTRE[self.state.normal];
        if block.has(normal) {
            return fault!(
                "word {} is no centre in the plane G{plane}: give {} and {}, or another plane",
                block.word(normal),
                CENTRE[u] as char,
                CENTRE[v] as char
            );
        }
        let words = [CENTRE[u], CENTRE[v]].map(|letter| block.get(letter).map(|value| value * unit));
        let missing = words.iter().filter(|word| word.is_none()).count();
        if missing == 2 || (missing == 1 && self.state.absolute_centres) {
            let both = if self.state.absolute_centres { "both " } else { "" };
            return fault!(
                "an arc in the plane G{plane} has no centre: give {both}{} and {}, or R",
                CENTRE[u] as char,
                CENTRE[v] as char
            );
        }
        let offsets = &self.state.offsets;
        let words = words.map(|word| word.unwrap_or(0.0));
        let centre = if offsets.rotation == 0.0 {
            // Computed in machine coordinates; the way through the coordinates of the program would add rounding.
            let from = if self.state.absolute_centres { offsets.sum() } else { position };
            [words[0] + from[u], words[1] + from[v]]
        } else {
            let mut centre =
                if self.state.absolute_centres { [0.0; 9] } else { offsets.to_program(position) };
            centre[u] += words[0];
            centre[v] += words[1];
            let centre = offsets.to_machine(&centre);
            [centre[u], centre[v]]
        };
        if !centre.iter().all(|value| value.abs() <= FARTHEST_CENTRE) {
            return fault!("the centre of an arc is more than {FARTHEST_CENTRE:e} mm away: check I, J, K");
        }
        Ok(Form::Centre { centre, inches: self.state.inches })
    }
}
