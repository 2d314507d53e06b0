//! What happens between moves: spindle, coolant, tools, outputs, dwells, stops and messages, in order.

use super::Moves;

/// A word that switches something: how many moves come before it, its line, its letter and number, and the words P and
/// Q that go with it, NaN where there is none. M6 has its tool's number as P, G4 its seconds. A message is `(` with the
/// place of its text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    pub moves: usize,
    pub line: u32,
    pub letter: u8,
    pub number: f64,
    pub p: f64,
    pub q: f64,
}

/// Events in order, as columns.
#[derive(Clone, Debug, Default)]
pub struct Events {
    pub moves: Vec<i64>,
    pub line: Vec<i32>,
    pub letter: Vec<u8>,
    pub number: Vec<f64>,
    pub p: Vec<f64>,
    pub q: Vec<f64>,
    /// Texts of messages.
    pub texts: Vec<String>,
}

impl Events {
    fn push(&mut self, event: Event) {
        self.moves.push(event.moves as i64);
        self.line.push(event.line as i32);
        self.letter.push(event.letter);
        self.number.push(event.number);
        self.p.push(event.p);
        self.q.push(event.q);
    }
}

impl Moves {
    /// Something happens after the moves so far.
    pub fn event(&mut self, line: u32, letter: u8, number: f64, p: Option<f64>, q: Option<f64>) {
        let [p, q] = [p, q].map(|word| word.unwrap_or(f64::NAN));
        self.events.push(Event { moves: self.kind.len(), line, letter, number, p, q });
    }

    /// A message to the operator.
    pub fn message(&mut self, line: u32, text: String) {
        self.event(line, b'(', self.events.texts.len() as f64, None, None);
        self.events.texts.push(text);
    }
}
