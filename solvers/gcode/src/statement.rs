//! Reads the keywords and labels of a line of program flow: those of O words, and the statements of Fanuc's macros.

use super::number::{behind_word, decimal, integer, spaces};

/// The kind of a line of program flow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Sub,
    EndSub,
    Return,
    Call,
    If,
    ElseIf,
    Else,
    EndIf,
    While,
    EndWhile,
    Do,
    /// The `while` that ends a `do`.
    DoWhile,
    Repeat,
    EndRepeat,
    Break,
    Continue,
    /// Fanuc's IF with GOTO or THEN.
    When,
    GoTo,
    /// An O number alone, which begins a program or subprogram.
    Number,
}

/// The keywords; where one begins another, the longer one comes first.
pub const KEYWORDS: [(&str, Kind); 15] = [
    ("ENDSUB", Kind::EndSub),
    ("ENDIF", Kind::EndIf),
    ("ENDWHILE", Kind::EndWhile),
    ("ENDREPEAT", Kind::EndRepeat),
    ("ELSEIF", Kind::ElseIf),
    ("ELSE", Kind::Else),
    ("SUB", Kind::Sub),
    ("RETURN", Kind::Return),
    ("CALL", Kind::Call),
    ("IF", Kind::If),
    ("WHILE", Kind::While),
    ("DO", Kind::Do),
    ("REPEAT", Kind::Repeat),
    ("BREAK", Kind::Break),
    ("CONTINUE", Kind::Continue),
];

/// The label of a line; None where it is computed when the line is run.
pub type Label = Option<Vec<u8>>;

/// A number as a label: O0100 is O100.
pub fn number_label(value: f64) -> Option<Vec<u8>> {
    integer(value).filter(|number| *number >= 0).map(|number| number.to_string().into_bytes())
}

/// The keyword at a place, and the place after it.
pub fn keyword(source: &[u8], at: usize) -> Option<(Kind, usize)> {
    let at = spaces(source, at);
    KEYWORDS.iter().find_map(|(name, kind)| Some((*kind, behind_word(source, at, name)?)))
}

/// The place of the line end at or after a place.
pub fn end_of_line(source: &[u8], at: usize) -> usize {
    let rest = source.get(at..).unwrap_or_default();
    at + rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len())
}

/// The place after the line that a place is in.
pub fn after_line(source: &[u8], at: usize) -> usize {
    let end = end_of_line(source, at);
    end + if source.get(end..).is_some_and(|rest| rest.starts_with(b"\r\n")) { 2 } else { 1 }
}

/// The statement whose first letter is at a place: its kind, its label, and the place of its arguments.
pub fn statement(source: &[u8], at: usize) -> Option<(Kind, Label, usize)> {
    let begins = |word| behind_word(source, at, word).map(|end| spaces(source, end));
    let open = |place: &usize| source.get(*place) == Some(&b'[');
    match source.get(at)? {
        b'I' | b'i' => begins("IF").filter(open).map(|place| (Kind::When, None, place)),
        b'G' | b'g' => begins("GOTO").map(|place| (Kind::GoTo, None, place)),
        b'W' | b'w' => {
            let place = begins("WHILE").filter(open)?;
            Some((Kind::While, loop_label(source, behind_bracket(source, place)?)?.0, place))
        }
        b'E' | b'e' => {
            let (number, end) = decimal(source, begins("END")?)?;
            Some((Kind::EndWhile, Some(number_label(number)?), end))
        }
        _ => None,
    }
}

/// The label of `DO 1` at a place, and the place after it.
pub fn loop_label(source: &[u8], at: usize) -> Option<(Label, usize)> {
    let (number, end) = decimal(source, behind_word(source, spaces(source, at), "DO")?)?;
    Some((Some(number_label(number)?), end))
}

/// The place after the bracket that opens at a place.
fn behind_bracket(source: &[u8], at: usize) -> Option<usize> {
    let mut depth = 0usize;
    for (place, byte) in source.iter().enumerate().skip(at) {
        match byte {
            b'[' => depth += 1,
            b']' if depth == 1 => return Some(place + 1),
            b']' => depth -= 1,
            b'\n' | b'\r' => return None,
            _ => {}
        }
    }
    None
}
