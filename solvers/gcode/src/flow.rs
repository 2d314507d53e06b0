//! The lines of a text that decide which line is next: O words (sub, call, if, while, do, repeat), Fanuc's program numbers and
//! its statements (IF, WHILE, GOTO). One pass over the text finds them, when the first of them is run, and links each to its
//! partner.

use std::cell::OnceCell;
use std::collections::HashMap;

use super::expression::{excerpt, name_in_brackets};
use super::fault::Outcome;
use super::number::{decimal, integer, spaces};
use super::statement::{
    after_line, end_of_line, keyword, loop_label, number_label, statement, Kind, Label, KEYWORDS,
};

/// A line of program flow.
#[derive(Clone, Debug)]
pub struct Step {
    /// Byte positions in the text: of its first letter, of its arguments, of the next line.
    pub at: usize,
    pub arguments: usize,
    pub next: usize,
    /// 1-based.
    pub line: u32,
    pub kind: Kind,
    pub label: Label,
    /// The next branch of an `if`, `elseif` or `else`; the end of a `while`, `repeat`, `do` or `sub`, and its start for
    /// that end; the loop of a `break` or `continue`.
    pub partner: usize,
    /// The end of the block; for an `if` and its branches, the `endif`.
    pub end: usize,
}

/// The steps of one text in order.
#[derive(Debug)]
pub struct Flow {
    pub steps: Vec<Step>,
    /// Steps where subroutines begin, by label.
    subs: HashMap<Vec<u8>, usize>,
    numbered: OnceCell<Numbered>,
}

/// The targets of GOTO.
#[derive(Debug)]
struct Numbered {
    /// Lines with block numbers, in their order: the number, the place of the line, and the 1-based line before.
    lines: Vec<(i64, usize, u32)>,
    /// Places of the O numbers that begin programs.
    programs: Vec<usize>,
}

impl Flow {
    /// The steps of a text; with `delete`, lines that begin with `/` are left out.
    pub fn new(source: &[u8], delete: bool) -> Outcome<Self> {
        let mut flow = Self { steps: Vec::new(), subs: HashMap::new(), numbered: OnceCell::new() };
        let (mut at, mut line) = (0, 0);
        while at < source.len() {
            line += 1;
            let next = after_line(source, at);
            if let Some(first) = first_letter(source, at, delete) {
                if let Some(step) = step_at(source, first, next, line)? {
                    flow.steps.push(step);
                }
            }
            at = next;
        }
        flow.tie()?;
        Ok(flow)
    }

    /// The step whose first letter is at a place.
    pub fn at(&self, at: usize) -> Option<usize> {
        self.steps.binary_search_by_key(&at, |step| step.at).ok()
    }

    /// The step where a subroutine begins.
    pub fn sub(&self, label: &[u8]) -> Option<usize> {
        self.subs.get(label).copied()
    }

    /// The byte position of the line with a block number, and the 1-based number of the line before it. Searches the program that
    /// contains the byte `from`, from its O number to the next one: first from `from` on, then from its start.
    pub fn numbered(&self, source: &[u8], number: i64, from: usize) -> Option<(usize, u32)> {
        let Numbered { lines, programs } = self.numbered.get_or_init(|| Numbered {
            lines: numbered_lines(source),
            programs: self
                .steps
                .iter()
                .filter(|step| step.kind == Kind::Number)
                .map(|step| step.at)
                .collect(),
        });
        let next = programs.partition_point(|&at| at < from);
        let first = next.checked_sub(1).map_or(0, |before| programs[before]);
        let end = programs.get(next).copied().unwrap_or(source.len());
        let first_from = |place: usize| {
            let next = lines.partition_point(|&(known, at, _)| (known, at) < (number, place));
            lines.get(next).filter(|(known, at, _)| *known == number && *at < end)
        };
        let (_, at, line) = first_from(from).or_else(|| first_from(first))?;
        Some((*at, *line))
    }

    /// Links steps to their partners; fails if a step has none.
    fn tie(&mut self) -> Outcome<()> {
        // Open blocks: for each the step that begins it, followed by the branches of an `if` so far.
        let mut open: Vec<Vec<usize>> = Vec::new();
        for i in 0..self.steps.len() {
            match self.steps[i].kind {
                Kind::While if open.last().is_some_and(|top| self.opens(top, Kind::Do, i)) => {
                    self.steps[i].kind = Kind::DoWhile;
                    self.close(&mut open, i, Kind::Do)?;
                }
                Kind::Sub if !open.is_empty() => {
                    let outer = &self.steps[open[0][0]];
                    return self.refuse(i, &format!(
                        "stands inside the block that begins in line {}: define subroutines outside of others",
                        outer.line
                    ));
                }
                Kind::Sub => {
                    self.begin_sub(i)?;
                    open.push(vec![i]);
                }
                Kind::If | Kind::While | Kind::Do | Kind::Repeat => open.push(vec![i]),
                Kind::ElseIf | Kind::Else => match open.last_mut() {
                    Some(top) if self.opens(top, Kind::If, i) => {
                        let before = top[top.len() - 1];
                        if self.steps[before].kind == Kind::Else {
                            return self.refuse(i, "follows the else of its block: put it before");
                        }
                        self.steps[before].partner = i;
                        top.push(i);
                    }
                    _ => return self.refuse(i, "has no if before it that is open"),
                },
                Kind::EndSub => self.close(&mut open, i, Kind::Sub)?,
                Kind::EndIf => self.close(&mut open, i, Kind::If)?,
                Kind::EndWhile => self.close(&mut open, i, Kind::While)?,
                Kind::EndRepeat => self.close(&mut open, i, Kind::Repeat)?,
                Kind::Break | Kind::Continue => {
                    let looped = |top: &&Vec<usize>| {
                        let step = &self.steps[top[0]];
                        matches!(step.kind, Kind::While | Kind::Do | Kind::Repeat)
                            && step.label == self.steps[i].label
                    };
                    match open.iter().rev().find(looped).map(|top| top[0]) {
                        Some(start) => self.steps[i].partner = start,
                        None => return self.refuse(i, "stands in no loop of that label"),
                    }
                }
                Kind::Return | Kind::Call | Kind::DoWhile | Kind::When | Kind::GoTo => {}
                Kind::Number => self.begin_sub(i)?,
            }
        }
        match open.last() {
            Some(top) => self.refuse(top[0], "is not ended: the file may be truncated"),
            None => Ok(()),
        }
    }

    fn begin_sub(&mut self, i: usize) -> Outcome<()> {
        let Some(label) = self.steps[i].label.clone() else {
            return self.refuse(i, "has a label that is computed: name subroutines by numbers or <names>");
        };
        if let Some(first) = self.subs.insert(label, i) {
            let line = self.steps[first].line;
            return self
                .refuse(i, &format!("begins a subroutine that begins in line {line} too: rename one"));
        }
        Ok(())
    }

    /// Whether a block that is open begins with a step of a kind and with the label of step `i`.
    fn opens(&self, block: &[usize], kind: Kind, i: usize) -> bool {
        let start = &self.steps[block[0]];
        start.kind == kind && start.label == self.steps[i].label
    }

    fn close(&mut self, open: &mut Vec<Vec<usize>>, i: usize, kind: Kind) -> Outcome<()> {
        match open.pop() {
            Some(top) if self.opens(&top, kind, i) => {
                self.steps[top[top.len() - 1]].partner = i;
                for step in &top {
                    self.steps[*step].end = i;
                }
                self.steps[i].partner = top[0];
                self.steps[i].end = i;
                Ok(())
            }
            Some(top) => {
                let line = self.steps[top[0]].line;
                self.refuse(i, &format!("ends another block than the one of line {line}, which is open"))
            }
            None => self.refuse(i, "ends no block that is open"),
        }
    }

    fn refuse<T>(&self, i: usize, why: &str) -> Outcome<T> {
        let step = &self.steps[i];
        let label = step.label.as_deref().map(String::from_utf8_lossy).unwrap_or_default();
        let name = KEYWORDS.iter().find(|(_, kind)| *kind == step.kind).map_or("", |(name, _)| name);
        fault_in!(step.line, "word o<{label}> {} {why}", name.to_lowercase())
    }
}

/// The place of the first letter of a line of program flow, after blanks, `/` and a block number.
fn first_letter(source: &[u8], at: usize, delete: bool) -> Option<usize> {
    let mut at = spaces(source, at);
    if source.get(at) == Some(&b'/') {
        if delete {
            return None;
        }
        at = spaces(source, at + 1);
    }
    if matches!(source.get(at), Some(b'N' | b'n')) {
        at = spaces(source, decimal(source, at + 1)?.1);
    }
    (matches!(source.get(at), Some(b'O' | b'o' | b':')) || statement(source, at).is_some()).then_some(at)
}

/// The step whose first letter is at a place; None for an O without a label.
fn step_at(source: &[u8], at: usize, next: usize, line: u32) -> Outcome<Option<Step>> {
    let step =
        |kind, label, arguments| Some(Step { at, arguments, next, line, kind, label, partner: 0, end: 0 });
    if let Some((kind, label, arguments)) = statement(source, at) {
        return Ok(step(kind, label, arguments));
    }
    let Some((label, end)) = label(source, at + 1)? else { return Ok(None) };
    Ok(match keyword(source, end) {
        Some((kind, arguments)) => step(kind, label, arguments),
        None if label.is_some() => step(Kind::Number, label, end),
        None => None,
    })
}

/// The label at a place, a number or a `<name>`, and the place after it; a computed label is skipped.
fn label(source: &[u8], at: usize) -> Outcome<Option<(Label, usize)>> {
    let at = spaces(source, at);
    if source.get(at) == Some(&b'<') {
        let (name, end) = name_in_brackets(source, at)?;
        return Ok(Some((Some(name), end)));
    }
    if let Some((value, end)) = decimal(source, at) {
        return Ok(number_label(value).map(|label| (Some(label), end)));
    }
    if !matches!(source.get(at), Some(b'#' | b'[')) {
        return Ok(None);
    }
    // A computed label ends at the first keyword outside of brackets.
    let mut depth = 0usize;
    for place in at..end_of_line(source, at) {
        match source[place] {
            b'[' | b'<' => depth += 1,
            b']' | b'>' => depth = depth.saturating_sub(1),
            _ if depth == 0 && keyword(source, place).is_some() => return Ok(Some((None, place))),
            _ => {}
        }
    }
    Ok(None)
}

/// `Numbered::lines` of a text.
fn numbered_lines(source: &[u8]) -> Vec<(i64, usize, u32)> {
    let mut lines = Vec::new();
    let (mut at, mut line) = (0, 0);
    while at < source.len() {
        let word = spaces(source, at);
        if matches!(source.get(word), Some(b'N' | b'n')) {
            if let Some(number) = decimal(source, word + 1).and_then(|(value, _)| integer(value)) {
                lines.push((number, at, line));
            }
        }
        at = after_line(source, at);
        line += 1;
    }
    lines.sort_unstable();
    lines
}

/// The place after blanks and comments.
pub fn behind_comments(source: &[u8], at: usize) -> usize {
    let mut at = spaces(source, at);
    while source.get(at) == Some(&b'(') {
        let Some(length) = source[at..].iter().position(|byte| matches!(byte, b')' | b'\n' | b'\r')) else {
            break;
        };
        at = spaces(source, at + length + usize::from(source[at + length] == b')'));
    }
    at
}

/// Refuses text after the arguments of a step, except for comments and the DO of Fanuc's WHILE.
pub fn check_rest(source: &[u8], at: usize) -> Outcome<()> {
    let at = loop_label(source, at).map_or(at, |(_, end)| end);
    let at = behind_comments(source, at);
    match source.get(at) {
        None | Some(b'\n' | b'\r' | b';' | b'(' | 0x1a) => Ok(()),
        _ => {
            fault!("{} is not understood behind an O word: put it in a line of its own", excerpt(source, at))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<(Kind, usize)> {
        Flow::new(text.as_bytes(), true).unwrap().steps.iter().map(|step| (step.kind, step.partner)).collect()
    }

    #[test]
    fn steps_know_their_partners() {
        use Kind::*;
        assert_eq!(
            kinds("o1 if [1]\nG0\n o1 elseif [2]\nN5 O1 else\no1endif\n"),
            [(If, 1), (ElseIf, 2), (Else, 3), (EndIf, 0)]
        );
        assert_eq!(
            kinds("o<a b> do\no2 while [1]\no<ab> break\no2 endwhile\nO<AB> while [0]"),
            [(Do, 4), (While, 3), (Break, 0), (EndWhile, 1), (DoWhile, 0)]
        );
        assert_eq!(
            kinds("o1 sub\no1 return\no1 endsub\no#1 call [2]\n(o3 if)\n; o3 if\n/o4 if"),
            [(Sub, 2), (Return, 0), (EndSub, 0), (Call, 0)]
        );
        assert_eq!(kinds("O0100 (name)\nM98 P100\n"), [(Number, 0)]);
    }

    #[test]
    fn steps_without_partner_are_refused_with_their_line() {
        for (text, part) in [
            ("G0\no1 if [1]\n", "o<1> if is not ended"),
            ("o1 endif\n", "ends no block"),
            ("o1 if [1]\no2 endif\n", "another block than the one of line 1"),
            ("o1 else\n", "no if before"),
            ("o1 if [1]\no1 else\no1 else\no1 endif", "follows the else"),
            ("o1 break\n", "in no loop"),
            ("o1 sub\no2 sub\n", "inside the block that begins in line 1"),
            ("o1 sub\no1 endsub\no1 sub\no1 endsub\n", "begins in line 1 too"),
            ("o<open sub\n", "no closing >"),
        ] {
            let message = Flow::new(text.as_bytes(), true).unwrap_err().message;
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
