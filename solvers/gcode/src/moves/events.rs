//! What happens between moves: spindle, coolant, tools, outputs, dwells, stops, messages and comments, in order.

use std::collections::HashMap;

use super::Moves;

/// The letters of a message and of a comment.
pub const MESSAGE: u8 = b'(';
pub const COMMENT: u8 = b';';

/// Words that switch something, in order, as columns: how many moves come before each, its line, its letter and number,
/// and the words P and Q that go with it, NaN where there is none. M6 has its tool's number as P, G4 its seconds. A message
/// is `(` and a comment `;`, with the place of its text in `texts`, which do not grow with repeats.
#[derive(Clone, Debug, Default)]
pub struct Events {
    pub moves: Vec<i64>,
    pub line: Vec<i32>,
    pub letter: Vec<u8>,
    pub number: Vec<f64>,
    pub p: Vec<f64>,
    pub q: Vec<f64>,
    pub texts: Vec<String>,
    /// Places of texts that come again, as those of loops and subprograms do.
    repeated: HashMap<String, usize>,
    /// The last line that had a text: those of later lines are new.
    furthest: i32,
}

impl Moves {
    /// Something happens after the moves so far.
    pub fn event(&mut self, line: u32, letter: u8, number: f64, p: Option<f64>, q: Option<f64>) {
        let events = &mut self.events;
        events.moves.push(self.kind.len() as i64);
        events.line.push(line as i32);
        events.letter.push(letter);
        events.number.push(number);
        events.p.push(p.unwrap_or(f64::NAN));
        events.q.push(q.unwrap_or(f64::NAN));
    }

    /// A message to the operator, or a comment.
    pub fn remark(&mut self, line: u32, letter: u8, text: String) {
        let Events { texts, repeated, furthest, .. } = &mut self.events;
        let next = texts.len();
        let place = if line as i32 > *furthest {
            *furthest = line as i32;
            next
        } else {
            *repeated.entry(text.clone()).or_insert(next)
        };
        if place == next {
            texts.push(text);
        }
        self.event(line, letter, place as f64, None, None);
    }
}
