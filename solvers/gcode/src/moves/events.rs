//! What happens between moves: spindle, coolant, tools, outputs, dwells, stops and messages, in order.

use super::Moves;

/// Words that switch something, in order, as columns: how many moves come before each, its line, its letter and number,
/// and the words P and Q that go with it, NaN where there is none. M6 has its tool's number as P, G4 its seconds. A message
/// is `(` with the place of its text in `texts`.
#[derive(Clone, Debug, Default)]
pub struct Events {
    pub moves: Vec<i64>,
    pub line: Vec<i32>,
    pub letter: Vec<u8>,
    pub number: Vec<f64>,
    pub p: Vec<f64>,
    pub q: Vec<f64>,
    pub texts: Vec<String>,
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

    /// A message to the operator.
    pub fn message(&mut self, line: u32, text: String) {
        self.event(line, b'(', self.events.texts.len() as f64, None, None);
        self.events.texts.push(text);
    }
}
