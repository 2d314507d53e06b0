//! The events between moves: spindle, coolant, tools, outputs, dwells, stops, messages and comments, in order.

use std::collections::HashMap;

use super::Moves;

/// The letters of a message and of a comment.
pub const MESSAGE: u8 = b'(';
pub const COMMENT: u8 = b';';

/// The events in order, as columns: the number of moves before each, its line, its letter and number, and its words P and
/// Q, NaN where they are missing. M6 has the number of its tool as P, G4 its seconds. A message has the letter `(`, a
/// comment `;`, and the index of its text in `texts` as number; a text that comes again is kept once.
#[derive(Clone, Debug, Default)]
pub struct Events {
    pub moves: Vec<i64>,
    pub line: Vec<i32>,
    pub letter: Vec<u8>,
    pub number: Vec<f64>,
    pub p: Vec<f64>,
    pub q: Vec<f64>,
    pub texts: Vec<String>,
    /// Indices of texts that may come again, in loops and subprograms.
    repeated: HashMap<String, usize>,
    /// The last line with a text; texts of later lines are new.
    furthest: i32,
}

impl Moves {
    /// Adds an event after the moves so far.
    pub fn event(&mut self, line: u32, letter: u8, number: f64, p: Option<f64>, q: Option<f64>) {
        let events = &mut self.events;
        events.moves.push(self.kind.len() as i64);
        events.line.push(line as i32);
        events.letter.push(letter);
        events.number.push(number);
        events.p.push(p.unwrap_or(f64::NAN));
        events.q.push(q.unwrap_or(f64::NAN));
    }

    /// Adds a message to the operator, or a comment.
    pub fn remark(&mut self, line: u32, letter: u8, text: String) {
        let Events { texts, repeated, furthest, .. } = &mut self.events;
        let next = texts.len();
        let index = if line as i32 > *furthest {
            *furthest = line as i32;
            next
        } else {
            *repeated.entry(text.clone()).or_insert(next)
        };
        if index == next {
            texts.push(text);
        }
        self.event(line, letter, index as f64, None, None);
    }
}
