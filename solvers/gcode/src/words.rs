//! The words of each block, from the bytes of the program.
//!
//! One pass, byte by byte, without allocation: letters with their numbers go straight into a `Block`. Line ends
//! are LF, CR LF or CR. Blanks may stand between words, before a number and after its sign.

use super::block::{g_name, g_remedy, m_group, m_remedy, Block};
use super::expression::{excerpt, integer, Parameters};
use super::fault::{fault, foreign, Outcome};
use super::number::{decimal, spaces};

/// What a line holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// A block, perhaps without words.
    Block,
    /// `%`, which opens or ends the program.
    Percent,
    /// A block after `/`, left out.
    Deleted,
}

/// Where the reader stands in the program.
pub struct Lexer<'a> {
    source: &'a [u8],
    at: usize,
    /// 1-based line of the block that was read last.
    pub line: u32,
    parameters: Parameters,
    delete: bool,
    /// Set once a block with words was read: what opens a program may not stand after it.
    pub begun: bool,
}

/// Some old editors end a file with this byte.
const END_OF_FILE: u8 = 0x1a;

/// Words of program flow after an O number.
const FLOW: [&str; 14] = [
    "SUB", "ENDSUB", "RETURN", "CALL", "DO", "WHILE", "ENDWHILE", "IF", "ELSEIF", "ELSE", "ENDIF", "REPEAT",
    "BREAK", "CONTINUE",
];

impl<'a> Lexer<'a> {
    /// `delete`: blocks after `/` are left out.
    pub fn new(source: &'a [u8], delete: bool) -> Self {
        let at = if source.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { source, at, line: 0, parameters: Parameters::default(), delete, begun: false }
    }

    /// True where nothing but blanks, comments and `%` is left.
    pub fn is_spent(&self) -> bool {
        let mut at = self.at;
        while let Some(&byte) = self.source.get(at) {
            match byte {
                b'(' => match self.comment(at) {
                    Ok(end) => at = end,
                    Err(_) => return false,
                },
                b';' => at = self.end_of_line(at),
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
    pub fn next_line(&mut self, block: &mut Block) -> Outcome<Option<Line>> {
        if self.at >= self.source.len() {
            return Ok(None);
        }
        self.line += 1;
        block.clear();
        let mut at = self.at;
        let mut first = true;
        loop {
            let byte = self.byte(at);
            let upper = byte & 0xdf;
            if upper.wrapping_sub(b'A') < 26 {
                let (value, end) = match decimal(self.source, at + 1) {
                    Some(number) => number,
                    None if upper == b'O' => return self.flow(at),
                    None => self.value(at)?,
                };
                match upper {
                    b'G' => self.g_word(value, at, end, block)?,
                    b'M' => self.m_word(value, at, end, block)?,
                    b'N' => self.number_word(value, at, end, first)?,
                    b'O' => self.program_number(at, end, first)?,
                    b'E' => return self.e_word(at, end),
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
                b'(' => at = self.comment(at)?,
                b';' => at = self.end_of_line(at),
                b'#' => {
                    at = self.parameters.assign(self.source, at)?;
                    first = false;
                    self.begun = true;
                }
                b'/' if first => {
                    at += 1;
                    if self.delete {
                        self.at = self.end_of_line(at);
                        self.skip_line_end();
                        return Ok(Some(Line::Deleted));
                    }
                    // Controls number their switches /1 to /9.
                    if matches!(self.byte(at), b'1'..=b'9') {
                        at += 1;
                    }
                }
                b'%' if first => {
                    self.percent(at)?;
                    return Ok(Some(Line::Percent));
                }
                b':' if first && !self.begun => match decimal(self.source, at + 1) {
                    Some((_, end)) => at = end,
                    None => return self.stray(at),
                },
                _ => return self.stray(at),
            }
        }
        self.at = at;
        self.parameters.commit();
        self.begun |= !block.is_empty();
        Ok(Some(Line::Block))
    }

    /// The byte at `at`; past the end, a line end.
    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        self.source.get(at).copied().unwrap_or(b'\n')
    }

    #[inline(always)]
    fn g_word(&self, value: f64, at: usize, end: usize, block: &mut Block) -> Outcome<()> {
        let tenths = value * 10.0;
        // Negative and huge values saturate and are in no group.
        let code = (tenths + 0.5) as u16;
        if (tenths - f64::from(code)).abs() > 1e-3 {
            return self.unknown_word(at, end, None);
        }
        match block.set_code(code) {
            Ok(()) => Ok(()),
            Err(None) => self.unknown_word(at, end, g_remedy(code)),
            Err(Some(other)) => fault(format!(
                "words {} and {} belong to one modal group and exclude each other: put them in two blocks",
                g_name(other),
                g_name(code)
            )),
        }
    }

    fn m_word(&self, value: f64, at: usize, end: usize, block: &mut Block) -> Outcome<()> {
        let code = value as u16;
        if f64::from(code) != value {
            return self.unknown_word(at, end, None);
        }
        match m_group(code).map(|group| block.set_m_code(code, group)) {
            Some(Ok(())) => Ok(()),
            None => self.unknown_word(at, end, m_remedy(code)),
            Some(Err(other)) => fault(format!(
                "words M{other} and M{code} belong to one modal group and exclude each other: put them in two blocks"
            )),
        }
    }

    fn number_word(&self, value: f64, at: usize, end: usize, first: bool) -> Outcome<()> {
        if !first {
            return fault(format!(
                "word {} is not the first of its block: put the block number first",
                self.text(at, end)
            ));
        }
        if value < 0.0 {
            return fault(format!(
                "word {} is no block number: numbers are not negative",
                self.text(at, end)
            ));
        }
        Ok(())
    }

    /// `O1234` opens a program; with a word of program flow after it, it is something else.
    #[cold]
    fn program_number(&self, at: usize, end: usize, first: bool) -> Outcome<()> {
        let next = spaces(self.source, end);
        let letters =
            self.source[next.min(self.source.len())..].iter().take_while(|byte| byte.is_ascii_alphabetic());
        let word: Vec<u8> = letters.take(9).map(u8::to_ascii_uppercase).collect();
        if FLOW.iter().any(|flow| word.starts_with(flow.as_bytes())) {
            return self.flow(at).map(|_: Option<Line>| ());
        }
        if self.begun || !first {
            return fault(format!(
                "word {} opens a second program: give each program its own file",
                self.text(at, end)
            ));
        }
        Ok(())
    }

    #[cold]
    fn flow<T>(&self, at: usize) -> Outcome<T> {
        fault(format!(
            "word {} controls the flow of the program (subroutine, loop or branch), which is not read: post one \
             program of single moves",
            excerpt(self.source, at)
        ))
    }

    /// The value of a word that has no plain number.
    #[cold]
    fn value(&self, at: usize) -> Outcome<(f64, usize)> {
        if let Some(value) = self.parameters.value(self.source, at + 1)? {
            return Ok(value);
        }
        let rest = &self.source[at..];
        let letters = rest.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
        if letters > 1 {
            return self.unknown_word(at, at + letters, None);
        }
        let letter = rest[0] as char;
        if spaces(self.source, at + 1) >= self.source.len() {
            return fault(format!("word {letter} has no number: the file ends here and may be truncated"));
        }
        foreign(format!("word {letter} has no number: write one after the letter"))
    }

    #[cold]
    fn unknown_word<T>(&self, at: usize, end: usize, remedy: Option<&str>) -> Outcome<T> {
        let word = self.text(at, end);
        match remedy {
            Some(remedy) => fault(format!("word {word} is not read: {remedy}")),
            None => foreign(format!(
                "word {word} is not understood: remove it, or post the program for LinuxCNC (RS-274/NGC)"
            )),
        }
    }

    #[cold]
    fn e_word<T>(&self, at: usize, end: usize) -> Outcome<T> {
        foreign(format!(
            "word {} is not understood: E moves an extruder, and numbers have no exponents; remove it",
            self.text(at, end)
        ))
    }

    #[cold]
    fn twice<T>(&self, at: usize, end: usize) -> Outcome<T> {
        let letter = self.source[at].to_ascii_uppercase() as char;
        fault(format!(
            "word {} is the second {letter} of its block: put it in a block of its own",
            self.text(at, end)
        ))
    }

    /// A character that starts no word.
    #[cold]
    fn stray<T>(&self, at: usize) -> Outcome<T> {
        let remedy = match self.byte(at) {
            b')' => "the comment that it ends does not begin in this line",
            b',' => "numbers have a decimal point, and roundings and chamfers (,R ,C) are not read",
            b'=' => "only parameters are assigned, such as #1 = 2",
            b'0'..=b'9' | b'.' | b'+' | b'-' => "a letter is missing before it",
            b'/' => "a block is deleted by / at its start",
            b'%' => "% stands alone in its line",
            _ => "remove it",
        };
        foreign(format!("{} is not understood: {remedy}", excerpt(self.source, at)))
    }

    /// Past the comment that starts at `at`.
    fn comment(&self, at: usize) -> Outcome<usize> {
        let rest = &self.source[at + 1..];
        let end = rest.iter().position(|byte| matches!(byte, b'(' | b')' | b'\n' | b'\r'));
        match end.map(|end| (rest[end], at + 2 + end)) {
            Some((b')', end)) => Ok(end),
            Some((b'(', _)) => fault(format!(
                "comment {} has another ( inside: write one comment after the other",
                excerpt(self.source, at)
            )),
            _ => fault(format!(
                "comment {} is not closed: end it with ) in its line",
                excerpt(self.source, at)
            )),
        }
    }

    /// The place of the line end at or after `at`.
    fn end_of_line(&self, at: usize) -> usize {
        let rest = self.source.get(at..).unwrap_or_default();
        at + rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len())
    }

    fn skip_line_end(&mut self) {
        self.at += if self.source[self.at.min(self.source.len())..].starts_with(b"\r\n") { 2 } else { 1 };
    }

    /// A line of its own with `%`, blanks and comments.
    #[cold]
    fn percent(&mut self, start: usize) -> Outcome<()> {
        let mut at = start + 1;
        loop {
            match self.byte(at) {
                b' ' | b'\t' | b'%' => at += 1,
                b'(' => at = self.comment(at)?,
                b';' => at = self.end_of_line(at),
                b'\n' | b'\r' => break,
                _ => return self.stray(start),
            }
        }
        self.at = at;
        self.skip_line_end();
        Ok(())
    }

    fn text(&self, at: usize, end: usize) -> String {
        String::from_utf8_lossy(&self.source[at..end.min(at + 24)]).into_owned()
    }
}

/// The integer of a word that counts something, from `least` on.
pub fn count(block: &Block, letter: u8, least: i64, what: &str) -> Outcome<Option<u32>> {
    let Some(value) = block.get(letter) else { return Ok(None) };
    match integer(value) {
        Some(number) if number >= least && number <= i64::from(u32::MAX) => Ok(Some(number as u32)),
        _ => fault(format!("word {} is no {what}: give an integer from {least}", block.word(letter))),
    }
}
