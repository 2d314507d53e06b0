//! Runs a program: its lines in the order that O words and calls determine, in the texts of the program and of the subprograms
//! that it calls. A line is read again each time that it is run.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::rc::Rc;

use super::block::Block;
use super::fault::{Fault, Outcome};
use super::flow::Flow;
use super::interpreter::Interpreter;
use super::options::Options;
use super::parameters::Scope;
use super::tolerance::{LINES_PER_MOVE, SPARE_LINES};
use super::words::{Lexer, Line};

/// Number of lines that are run between two reports of progress.
const REPORTED: u32 = 1024;

/// The text of the program or of a subprogram's file.
struct Text<'a> {
    name: String,
    bytes: Cow<'a, [u8]>,
    flow: OnceCell<Flow>,
}

impl<'a> Text<'a> {
    fn new(name: String, bytes: Cow<'a, [u8]>) -> Rc<Self> {
        Rc::new(Self { name, bytes, flow: OnceCell::new() })
    }

    fn flow(&self, delete: bool) -> Outcome<&Flow> {
        match self.flow.get() {
            Some(flow) => Ok(flow),
            None => {
                let flow = Flow::new(&self.bytes, delete)?;
                Ok(self.flow.get_or_init(|| flow))
            }
        }
    }
}

/// Where to read the next line: the index of its text, its byte position in the text, and the 1-based number of the line before.
#[derive(Clone, Copy)]
struct Cursor {
    text: usize,
    at: usize,
    line: u32,
}

/// The progress of the program or of a call.
struct Frame {
    cursor: Cursor,
    /// The line of the program that is reported for moves of a subprogram in another file.
    reported: Option<u32>,
    /// Open `repeat` steps, each with the number of times that it is run again.
    repeats: Vec<(usize, u64)>,
    /// The start of the subprogram, the call of it, and the number of times that it is run again.
    start: Cursor,
    call: Call,
    left: u32,
}

impl Frame {
    fn new(start: Cursor, reported: Option<u32>, call: Call) -> Self {
        let left = call.times.saturating_sub(1);
        Self { cursor: start, reported, repeats: Vec::new(), start, call, left }
    }
}

/// The target of a call.
pub enum Target {
    Label(Vec<u8>),
    /// The line with a block number, by M97.
    Line(i64),
}

/// The arguments and the scope of a call, and how many `times` in succession the target is run.
pub struct Call {
    pub arguments: Vec<f64>,
    pub scope: Scope,
    pub times: u32,
}

/// The reason why a program does not continue with the following line.
pub enum Exit {
    /// The program ends by this word; None: the text ends.
    End(Option<&'static str>),
    Call(Target, Call),
    Return(Option<f64>),
    /// M99 with the number of a line.
    Back(i64),
}

pub struct Runner<'a> {
    options: &'a Options,
    pub interpreter: Interpreter<'a>,
    seen: &'a dyn Fn(usize),
    texts: Vec<Rc<Text<'a>>>,
    main: Frame,
    /// The calls that are open.
    calls: Vec<Frame>,
    pub block: Block,
    /// Number of blocks left out after `/`.
    deleted: u32,
    /// Number of lines that may still be run.
    left: u64,
    /// The last line reported as progress, and the lines run since.
    reported: u32,
    since_report: u32,
    /// True after the % that opens the program.
    opened: bool,
    /// True after the first call.
    called: bool,
    /// True where the program defines subroutines.
    pub defines: bool,
}

impl<'a> Runner<'a> {
    pub fn new(source: &'a [u8], options: &'a Options, lines: usize, seen: &'a dyn Fn(usize)) -> Self {
        let start = Cursor { text: 0, at: 0, line: 0 };
        let call = Call { arguments: Vec::new(), scope: Scope::Own, times: 1 };
        Self {
            options,
            interpreter: Interpreter::new(options, lines),
            seen,
            texts: vec![Text::new(String::new(), Cow::Borrowed(source))],
            main: Frame::new(start, None, call),
            calls: Vec::new(),
            block: Block::default(),
            deleted: 0,
            left: lines as u64 + SPARE_LINES + LINES_PER_MOVE * options.max_moves as u64,
            reported: 0,
            since_report: 0,
            opened: false,
            called: false,
            defines: false,
        }
    }

    /// The frame of the call that is being run, or that of the program.
    fn frame(&self) -> &Frame {
        self.calls.last().unwrap_or(&self.main)
    }

    fn frame_mut(&mut self) -> &mut Frame {
        self.calls.last_mut().unwrap_or(&mut self.main)
    }

    /// The open `repeat` steps of the frame, each with the number of times that it is run again.
    pub fn repeats(&mut self) -> &mut Vec<(usize, u64)> {
        &mut self.frame_mut().repeats
    }

    /// True outside of calls.
    pub fn in_main(&self) -> bool {
        self.calls.is_empty()
    }

    /// Runs the program to its end; returns warnings about its end and about blocks that were left out.
    pub fn run(&mut self) -> Outcome<Vec<String>> {
        let end = loop {
            let Cursor { text, at, line } = self.frame().cursor;
            let text = self.texts[text].clone();
            let mut lexer = Lexer::new(&text.bytes, self.options.block_delete, self.options.whole_step);
            if line > 0 || at > 0 {
                lexer.jump(at, line);
            }
            let exit = self.run_lines(&mut lexer, &text);
            let cursor = &mut self.frame_mut().cursor;
            (cursor.at, cursor.line) = (lexer.at, lexer.line);
            match exit? {
                Exit::End(word) if self.in_main() || word.is_some() => break self.ending(&lexer, word),
                Exit::End(_) => {
                    return fault!("the subprogram does not end with M99 or endsub: it may be truncated")
                }
                Exit::Call(target, call) => self.call(&target, call)?,
                Exit::Back(number) => self.go_back(number)?,
                Exit::Return(_) if self.in_main() => break self.ending(&lexer, Some("M99")),
                Exit::Return(value) => self.leave(value),
            }
        };
        self.interpreter.check_end()?;
        Ok(end)
    }

    /// Warnings about the end of the program and about blocks that were left out.
    fn ending(&self, lexer: &Lexer, word: Option<&str>) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.deleted > 0 {
            let blocks = if self.deleted == 1 {
                "block that starts with / is"
            } else {
                "blocks that start with / are"
            };
            warnings.push(format!("{} {blocks} left out (block delete)", self.deleted));
        }
        match word {
            Some("M99") => warnings.push(format!(
                "line {}: M99 ends the program, which a control would run again and again",
                lexer.line
            )),
            Some(word) if !self.called && !lexer.is_spent() => {
                warnings.push(format!("line {}: {word} ends the program: what follows is not read", lexer.line));
            }
            None if lexer.ends_within_a_line() => warnings.push(
                "the program does not end with M2, M30 or %, and its last line has no line end: it may be truncated"
                    .into(),
            ),
            None => warnings.push("the program does not end with M2, M30 or %: it may be truncated".into()),
            _ => {}
        }
        warnings
    }

    /// Runs lines of one text up to an exit.
    fn run_lines(&mut self, lexer: &mut Lexer, text: &Text) -> Outcome<Exit> {
        let Frame { cursor, reported, .. } = *self.frame();
        loop {
            let line = lexer.next_line(&mut self.block, &self.interpreter)?;
            self.count(lexer.line, cursor.text)?;
            match line {
                Some(Line::Block) => {
                    if !lexer.assigned.is_empty() {
                        self.interpreter.assign(&mut lexer.assigned)?;
                    }
                    let line = reported.unwrap_or(lexer.line);
                    for (letter, text) in lexer.remarks.drain(..) {
                        self.interpreter.moves.remark(line, letter, text);
                    }
                    if self.interpreter.run(&self.block, line)? {
                        return Ok(Exit::End(Some("M2 or M30")));
                    }
                    if self.block.calls() {
                        return self.fanuc();
                    }
                }
                Some(Line::Deleted) => self.deleted += 1,
                // The first % opens the program, if no block is before it.
                Some(Line::Percent) if !self.opened && !lexer.begun => self.opened = true,
                Some(Line::Percent) => return Ok(Exit::End(Some("%"))),
                Some(Line::Flow(at)) => {
                    let flow = text.flow(self.options.block_delete)?;
                    let Some(step) = flow.at(at) else {
                        return fault!("an O word has no number and no <name>: give one");
                    };
                    if let Some(exit) = self.step(lexer, flow, step)? {
                        return Ok(exit);
                    }
                }
                None => return Ok(Exit::End(None)),
            }
        }
    }

    /// Counts the lines that are run, and reports how many lines of the program have been read.
    #[inline(always)]
    fn count(&mut self, line: u32, text: usize) -> Outcome<()> {
        self.since_report += 1;
        if self.since_report < REPORTED {
            return Ok(());
        }
        self.since_report = 0;
        let more = if text == 0 { line.saturating_sub(self.reported) } else { 0 };
        self.reported += more;
        (self.seen)(more as usize);
        match self.left.checked_sub(u64::from(REPORTED)) {
            Some(left) => self.left = left,
            None => return fault!(
                "the loops and calls of the program run more lines than {} moves take: check their conditions, or \
                 split it",
                self.options.max_moves
            ),
        }
        Ok(())
    }

    fn call(&mut self, target: &Target, call: Call) -> Outcome<()> {
        if call.times == 0 {
            return Ok(());
        }
        let start = match target {
            Target::Label(label) => self.find(label)?,
            Target::Line(number) => self.find_line(*number, "M97 calls")?,
        };
        self.interpreter.parameters.enter(&call.arguments, call.scope)?;
        let caller = self.frame();
        let reported = (start.text != 0).then(|| caller.reported.unwrap_or(caller.cursor.line));
        self.called = true;
        self.calls.push(Frame::new(start, reported, call));
        Ok(())
    }

    /// Ends the last call, if there is one, and goes to the line with a block number.
    fn go_back(&mut self, number: i64) -> Outcome<()> {
        if self.calls.pop().is_some() {
            self.interpreter.leave_call();
        }
        let cursor = self.find_line(number, "M99 goes to")?;
        let frame = self.frame_mut();
        frame.cursor = cursor;
        frame.repeats.clear();
        Ok(())
    }

    /// Ends the last call, or runs its subprogram again.
    fn leave(&mut self, value: Option<f64>) {
        let Some(frame) = self.calls.last_mut() else { return };
        let scope = frame.call.scope;
        if frame.left > 0 {
            frame.left -= 1;
            frame.cursor = frame.start;
            frame.repeats.clear();
            if scope == Scope::Macro {
                self.interpreter.parameters.take(&frame.call.arguments);
            }
            return;
        }
        self.calls.pop();
        self.interpreter.leave_call();
        if scope == Scope::Own {
            self.interpreter.parameters.set_named(b"_value", value.unwrap_or(0.0));
            self.interpreter.parameters.set_named(b"_value_returned", f64::from(value.is_some()));
        }
    }

    /// The first line of a subprogram: in the text that calls it, in one that has been read, or in a file of its name.
    fn find(&mut self, label: &[u8]) -> Outcome<Cursor> {
        let here = self.frame().cursor.text;
        for text in std::iter::once(here).chain(0..self.texts.len()) {
            if let Some(start) = self.sub_in(text, label)? {
                return Ok(start);
            }
        }
        let name = String::from_utf8_lossy(label).into_owned();
        let found = match &self.options.subprograms {
            Some(files) if name.bytes().all(|byte| !matches!(byte, b'/' | b'\\' | b'\0')) => {
                files(&name).or_else(|message| fault!("{message}"))?
            }
            _ => None,
        };
        let Some((file, bytes)) = found else {
            return fault!(
                "the subprogram {name} is neither in the program nor in a file {name}.ngc beside it: give its folder \
                 (--subprograms), or put it into the program"
            );
        };
        self.texts.push(Text::new(file.clone(), Cow::Owned(bytes)));
        match self.sub_in(self.texts.len() - 1, label) {
            Ok(Some(start)) => Ok(start),
            Ok(None) => {
                fault!("the file {file} has no subprogram {name}: name it O<{name}> sub there")
            }
            Err(error) => Err(Box::new(Fault { message: format!("in {file}: {}", error.message), ..*error })),
        }
    }

    fn sub_in(&self, text: usize, label: &[u8]) -> Outcome<Option<Cursor>> {
        let flow = self.texts[text].flow(self.options.block_delete)?;
        Ok(flow.sub(label).map(|i| Cursor { text, at: flow.steps[i].next, line: flow.steps[i].line }))
    }

    /// The line with a block number, in the program that is run.
    fn find_line(&self, number: i64, what: &str) -> Outcome<Cursor> {
        let here = self.frame().cursor;
        let text = &self.texts[here.text];
        match text.flow(self.options.block_delete)?.numbered(&text.bytes, number, here.at) {
            Some((at, line)) => Ok(Cursor { at, line, ..here }),
            None => fault!("{what} line N{number}, which the program does not have"),
        }
    }

    /// The line of the program to which a fault refers, and its message, which names file and line if the fault is in another
    /// file.
    #[cold]
    pub fn place(&self, fault: &Fault) -> (u32, String) {
        let Frame { cursor, reported, .. } = *self.frame();
        let line = fault.line.unwrap_or(cursor.line).max(1);
        let within = || format!("in {} line {line}: {}", self.texts[cursor.text].name, fault.message);
        reported.map_or_else(|| (line, fault.message.clone()), |reported| (reported, within()))
    }
}
