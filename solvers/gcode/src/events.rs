//! The events between moves: spindle, coolant, tools, outputs, dwells, stops, messages and comments, in order.

use std::collections::HashMap;

/// The letters of a message and of a comment.
pub const MESSAGE: u8 = b'(';
pub const COMMENT: u8 = b';';

/// The events in order, as columns: the number of moves before each, its line, its letter and number, and its words P and Q, NaN
/// where they are missing. M6 has the number of its tool as P, G4 its seconds. A message has the letter `(`, a comment `;`, and
/// the index of its text in `texts` as number; a text that is repeated in a loop is stored once.
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

impl Events {
    /// Adds an event after `moves` moves.
    pub fn push(&mut self, moves: usize, line: u32, letter: u8, number: f64, [p, q]: [Option<f64>; 2]) {
        self.moves.push(moves as i64);
        self.line.push(line as i32);
        self.letter.push(letter);
        self.number.push(number);
        self.p.push(p.unwrap_or(f64::NAN));
        self.q.push(q.unwrap_or(f64::NAN));
    }

    /// The index in `texts` of the text of a line; a text of a line that is run again is stored once.
    pub fn index_of(&mut self, text: String, line: u32) -> usize {
        let next = self.texts.len();
        let index = if line as i32 > self.furthest {
            self.furthest = line as i32;
            next
        } else {
            *self.repeated.entry(text.clone()).or_insert(next)
        };
        if index == next {
            self.texts.push(text);
        }
        index
    }
}
