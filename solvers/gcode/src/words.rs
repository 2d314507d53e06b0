//! Reads the words of each block from the bytes of a text.
//!
//! One pass over the bytes, without allocation, writes letters with their numbers into a `Block`. Line ends are LF, CR LF
//! or CR. Blanks may stand between words, before a number and after its sign.

use super::block::{g_name, g_remedy, m_group, Block, MGroup};
use super::events::{COMMENT, MESSAGE};
use super::expression::{assignment, excerpt, expression, number};
use super::fault::Outcome;
use super::interpreter::Interpreter;
use super::number::{behind_word, decimal, spaces};
use super::parameters::Name;
use super::statement::{after_line, end_of_line, keyword, statement};

/// The content of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A block, with or without words.
    Block,
    /// `%`, which opens or ends the program.
    Percent,
    /// A block after `/` that is left out.
    Deleted,
    /// A line of program flow whose first letter is at that place.
    Flow(usize),
}

/// A text, and the byte position up to which it has been read.
pub struct Lexer<'a> {
    pub source: &'a [u8],
    pub at: usize,
    /// 1-based line of the block that was read last.
    pub line: u32,
    /// The assignments of that block.
    pub assigned: Vec<(Name, f64)>,
    /// The messages and comments of that block, with their letters.
    pub remarks: Vec<(u8, String)>,
    /// Blocks after `/` are left out.
    delete: bool,
    /// The unit of lengths and angles without a decimal point, in units of the program.
    whole_step: f64,
    /// True after the first block with words: after it, no word may open a program.
    pub begun: bool,
}

/// The last byte of a file of some old editors.
const END_OF_FILE: u8 = 0x1a;

/// M codes of 3-D printers after which the rest of the line is a text for the operator.
const TEXT_CODES: [f64; 2] = [117.0, 118.0];

impl<'a> Lexer<'a> {
    /// A lexer at the start of a text.
    pub fn new(source: &'a [u8], delete: bool, whole_step: f64) -> Self {
        let at = if source.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self {
            source,
            at,
            line: 0,
            assigned: Vec::new(),
            remarks: Vec::new(),
            delete,
            whole_step,
            begun: false,
        }
    }

    /// Goes to a place in the line after `line`.
    pub fn jump(&mut self, at: usize, line: u32) {
        (self.at, self.line, self.begun) = (at, line, true);
    }

    /// True where only blanks, comments and `%` are left.
    pub fn is_spent(&self) -> bool {
        let mut at = self.at;
        while let Some(&byte) = self.source.get(at) {
            match byte {
                b'(' => match self.comment(at) {
                    Ok(end) => at = end,
                    Err(_) => return false,
                },
                b';' => at = end_of_line(self.source, at),
                b' ' | b'\t' | b'\r' | b'\n' | b'%' | END_OF_FILE => at += 1,
                _ => return false,
            }
        }
        true
    }

    /// True where the source ends inside its last line.
    pub fn ends_within_a_line(&self) -> bool {
        !matches!(self.source.last(), None | Some(b'\n' | b'\r'))
    }

    /// Reads the next line into `block`; None at the end of the source.
    #[inline]
    pub fn next_line(&mut self, block: &mut Block, values: &Interpreter) -> Outcome<Option<Line>> {
        if self.at >= self.source.len() {
            return Ok(None);
        }
        self.line += 1;
        block.clear();
        let mut at = self.at;
        let mut first = true;
        // The M code of unknown meaning that begins the block: the words after it belong to it.
        let mut owner = 0;
        loop {
            let byte = self.byte(at);
            let upper = byte & 0xdf;
            if upper.wrapping_sub(b'A') < 26 {
                let (value, end) = match decimal(self.source, at + 1) {
                    Some((value, end)) if self.whole_step != 1.0 => (self.stepped(value, at, end), end),
                    Some(number) => number,
                    None if upper == b'O' || statement(self.source, at).is_some() => {
                        return self.flow(at, first)
                    }
                    None => match self.value(at, values)? {
                        (value, end) if value.is_nan() => {
                            (at, first) = (end, false);
                            continue;
                        }
                        number => number,
                    },
                };
                match upper {
                    b'G' => self.g_word(value, at, end, block)?,
                    b'M' => {
                        self.m_word(value, at, end, block)?;
                        if first && m_group(value as u16) == MGroup::Other {
                            owner = value as u16;
                        }
                        if TEXT_CODES.contains(&value) {
                            at = end_of_line(self.source, end);
                            self.remarks.push((MESSAGE, text_of(&self.source[end..at])));
                            continue;
                        }
                    }
                    b'N' => self.number_word(value, at, end, first)?,
                    b'O' if keyword(self.source, end).is_some() => return self.flow(at, first),
                    b'O' => self.program_number(at, end, first)?,
                    // The E word of an extruder follows a blank; after a digit, E would be an exponent, which is refused.
                    b'E' if at > 0 && self.source[at - 1].is_ascii_digit() => return self.exponent(at, end),
                    _ if block.set(upper, value) => {}
                    _ => return self.twice(at, end),
                }
                first = first && upper == b'N';
                at = end;
                continue;
            }
            match byte {
                b' ' | b'\t' => at += 1,
                b'\n' => {
                    at += 1;
                    break;
                }
                b'\r' => {
                    at += 1 + usize::from(self.byte(at + 1) == b'\n' && at + 1 < self.source.len());
                    break;
                }
                b'(' => {
                    let end = self.comment(at)?;
                    let text = &self.source[at + 1..end - 1];
                    match message(text) {
                        Some(message) => self.remarks.push((MESSAGE, message)),
                        None => self.remark(text),
                    }
                    at = end;
                }
                b';' => {
                    let end = end_of_line(self.source, at);
                    self.remark(&self.source[at + 1..end]);
                    at = end;
                }
                b'#' => {
                    let (name, value, end) = assignment(self.source, at, values)?;
                    self.assigned.push((name, value));
                    at = end;
                    first = false;
                    self.begun = true;
                }
                b'/' if first => {
                    at += 1;
                    if self.delete {
                        self.at = after_line(self.source, at);
                        return Ok(Some(Line::Deleted));
                    }
                    // Controls number their switches /1 to /9.
                    if matches!(self.byte(at), b'1'..=b'9') {
                        at += 1;
                    }
                }
                // Text after it is a comment, as on controls.
                b'%' if first && !self.source[at..].starts_with(b"%_N_") => {
                    self.at = after_line(self.source, at);
                    return Ok(Some(Line::Percent));
                }
                b'@' | b'^' if block.polar[usize::from(byte == b'^')].is_none() => {
                    let Some((value, end)) = number(self.source, at + 1, values)? else {
                        return self.stray(at);
                    };
                    block.polar[usize::from(byte == b'^')] = Some(value);
                    (at, first) = (end, false);
                }
                b',' if block.corner.is_none() && matches!(self.byte(at + 1) & 0xdf, b'C' | b'R') => {
                    let Some((value, end)) = number(self.source, at + 2, values)? else {
                        return self.stray(at);
                    };
                    block.corner = Some((self.byte(at + 1) & 0xdf, value));
                    (at, first) = (end, false);
                }
                b':' if first && !self.begun => match decimal(self.source, at + 1) {
                    Some((_, end)) => at = end,
                    None => return self.stray(at),
                },
                _ => return self.stray(at),
            }
        }
        self.at = at;
        if owner != 0 {
            block.leave_to(owner);
        }
        self.begun |= !block.is_empty();
        Ok(Some(Line::Block))
    }

    /// Stores a comment that is not empty.
    #[cold]
    fn remark(&mut self, text: &[u8]) {
        let text = text_of(text);
        if !text.is_empty() {
            self.remarks.push((COMMENT, text));
        }
    }

    /// The value of a word from `at` to `end`, on a control where a number without a point has the unit `whole_step`.
    #[cold]
    fn stepped(&self, value: f64, at: usize, end: usize) -> f64 {
        let whole = !self.source[at..end].contains(&b'.');
        let length = b"XYZABCUVWIJKRQ".contains(&self.source[at].to_ascii_uppercase());
        value * if whole && length { self.whole_step } else { 1.0 }
    }

    /// The byte at `at`; a line end after the end of the text.
    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        self.source.get(at).copied().unwrap_or(b'\n')
    }

    #[inline(always)]
    fn g_word(&self, value: f64, at: usize, end: usize, block: &mut Block) -> Outcome<()> {
        let tenths = value * 10.0;
        // The conversion saturates negative and huge values, which are in no group.
        let code = (tenths + 0.5) as u16;
        if (tenths - f64::from(code)).abs() > 1e-3 {
            return self.unknown_word(at, end, None);
        }
        match block.set_code(code) {
            Ok(()) => Ok(()),
            Err(None) => self.unknown_word(at, end, g_remedy(code)),
            Err(Some(other)) => fault!(
                "words {} and {} belong to one modal group and exclude each other: put them in two blocks",
                g_name(other),
                g_name(code)
            ),
        }
    }

    fn m_word(&self, value: f64, at: usize, end: usize, block: &mut Block) -> Outcome<()> {
        let code = value as u16;
        if f64::from(code) != value || code == u16::MAX {
            return self.unknown_word(at, end, None);
        }
        match block.set_m_code(code, m_group(code)) {
            Ok(()) => Ok(()),
            Err(other) => fault!(
                "words M{other} and M{code} belong to one modal group and exclude each other: put them in two blocks"
            ),
        }
    }

    fn number_word(&self, value: f64, at: usize, end: usize, first: bool) -> Outcome<()> {
        if !first {
            return fault!(
                "word {} is not the first of its block: put the block number first",
                self.text(at, end)
            );
        }
        if value < 0.0 {
            return fault!("word {} is no block number: numbers are not negative", self.text(at, end));
        }
        Ok(())
    }

    /// `O1234` opens a program.
    #[cold]
    fn program_number(&self, at: usize, end: usize, first: bool) -> Outcome<()> {
        if self.begun || !first {
            return fault!(
                "word {} opens a second program: end the one before with M2, M30 or M99, or give each its own file",
                self.text(at, end)
            );
        }
        Ok(())
    }

    /// The line of program flow that begins at `at`.
    #[cold]
    fn flow(&mut self, at: usize, first: bool) -> Outcome<Option<Line>> {
        if !first {
            return fault!(
                "word {} is not the first of its block: put program flow in lines of its own",
                excerpt(self.source, at)
            );
        }
        self.begun = true;
        Ok(Some(Line::Flow(at)))
    }

    /// The value of a word without a plain number.
    #[cold]
    fn value(&self, at: usize, values: &Interpreter) -> Outcome<(f64, usize)> {
        if let Some(value) = expression(self.source, at + 1, values)? {
            return Ok(value);
        }
        let rest = &self.source[at..];
        let letters = rest.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
        if letters > 1 {
            return self.unknown_word(at, at + letters, None);
        }
        let letter = rest[0] as char;
        if spaces(self.source, at + 1) >= self.source.len() {
            return fault!("word {letter} has no number: the file ends here and may be truncated");
        }
        foreign!("word {letter} has no number: write one after the letter")
    }

    #[cold]
    fn unknown_word<T>(&self, at: usize, end: usize, remedy: Option<&str>) -> Outcome<T> {
        let word = self.text(at, end);
        match remedy {
            Some(remedy) => fault!("word {word} is not read: {remedy}"),
            None => foreign!(
                "word {word} is not understood: remove it, or post the program for LinuxCNC (RS-274/NGC)"
            ),
        }
    }

    #[cold]
    fn exponent<T>(&self, at: usize, end: usize) -> Outcome<T> {
        foreign!(
            "word {} is not understood: numbers have no exponents, and an extruder's word stands behind a blank",
            self.text(at, end)
        )
    }

    #[cold]
    fn twice<T>(&self, at: usize, end: usize) -> Outcome<T> {
        let letter = self.source[at].to_ascii_uppercase() as char;
        fault!(
            "word {} is the second {letter} of its block: put it in a block of its own",
            self.text(at, end)
        )
    }

    /// Refuses a character that begins no word.
    #[cold]
    fn stray<T>(&self, at: usize) -> Outcome<T> {
        let remedy = match self.byte(at) {
            b')' => "the comment that it ends does not begin in this line",
            b',' => "numbers have a decimal point, and a block has one ,C or ,R",
            b'=' => "only parameters are assigned, such as #1 = 2",
            b'0'..=b'9' | b'.' | b'+' | b'-' => "a letter is missing before it",
            b'/' => "a block is deleted by / at its start",
            b'@' | b'^' => "polar words stand once in a block, @ for the radius and ^ for the angle",
            b'%' => "% begins its line",
            _ => "remove it",
        };
        foreign!("{} is not understood: {remedy}", excerpt(self.source, at))
    }

    /// The place after the comment that begins at `at`.
    fn comment(&self, at: usize) -> Outcome<usize> {
        let rest = &self.source[at + 1..];
        let end = rest.iter().position(|byte| matches!(byte, b'(' | b')' | b'\n' | b'\r'));
        match end.map(|end| (rest[end], at + 2 + end)) {
            Some((b')', end)) => Ok(end),
            Some((b'(', _)) => fault!(
                "comment {} has another ( inside: write one comment after the other",
                excerpt(self.source, at)
            ),
            _ => fault!("comment {} is not closed: end it with ) in its line", excerpt(self.source, at)),
        }
    }

    fn text(&self, at: usize, end: usize) -> String {
        String::from_utf8_lossy(&self.source[at..end.min(at + 24)]).into_owned()
    }
}

/// The words that begin a comment which is a message, in LinuxCNC.
const MESSAGES: [&str; 4] = ["MSG", "DEBUG", "PRINT", "LOG"];

/// The text of a comment that is a message.
fn message(comment: &[u8]) -> Option<String> {
    let end = MESSAGES.iter().find_map(|name| behind_word(comment, spaces(comment, 0), name))?;
    let text = comment[spaces(comment, end)..].strip_prefix(b",")?;
    Some(text_of(text))
}

fn text_of(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim().to_string()
}
