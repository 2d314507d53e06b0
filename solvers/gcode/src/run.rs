//! Runs a program: its lines in the order that O words, M98 and M99 say, over the texts of the program and of the
//! subprograms that it calls. Every line is read anew each time that it is run.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::rc::Rc;

use super::block::Block;
use super::execute::Interpreter;
use super::fault::{fault, Fault, Outcome};
use super::flow::Flow;
use super::parameters::Scope;
use super::words::{Lexer, Line};
use super::Options;

/// Lines between two times that the reader tells how far it is.
const TOLD: u32 = 1024;

/// Lines that a program may run beyond those of its text, and more of them for each move that it may have.
const SPARE_LINES: u64 = 1_000_000;
const LINES_OF_A_MOVE: u64 = 4;

/// A file of the program.
struct Text<'a> {
    name: String,
    bytes: Cow<'a, [u8]>,
    flow: OnceCell<Flow>,
}

impl Text<'_> {
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

/// Where the program or a call of a subprogram stands.
pub(super) struct Frame {
    /// Place in `texts`.
    text: usize,
    at: usize,
    /// 1-based, of the line that was run last.
    line: u32,
    /// Of subprograms in other files, the line of the program that moves are told of.
    shown: Option<u32>,
    /// Open repetitions: the step, and how often it is run again.
    pub(super) repeats: Vec<(usize, u64)>,
    /// M98 and G65: how it is run again.
    again: Option<Again>,
}

/// Where a subprogram begins, the line before, how often it is run again, and the arguments of a macro.
struct Again {
    at: usize,
    line: u32,
    left: u32,
    arguments: Option<Vec<f64>>,
}

/// What ends a stretch of lines in one text.
pub(super) enum Exit {
    /// The program ends, by that word; None where the text does.
    End(Option<&'static str>),
    Call {
        label: Vec<u8>,
        arguments: Vec<f64>,
    },
    /// M98, G65 with its arguments, or M97, which is local; and how often.
    Fanuc {
        number: i64,
        local: bool,
        times: u32,
        arguments: Option<Vec<f64>>,
    },
    Return(Option<f64>),
    /// M99 that goes back to a line of that block number.
    Back(i64),
}

pub struct Runner<'a> {
    options: &'a Options,
    pub interpreter: Interpreter<'a>,
    seen: &'a dyn Fn(usize),
    texts: Vec<Rc<Text<'a>>>,
    /// The program, and the calls that are open.
    pub(super) frames: Vec<Frame>,
    pub(super) block: Block,
    deleted: u32,
    /// Lines that may still be run.
    left: u64,
    told: u32,
    since_told: u32,
    opened: bool,
    called: bool,
    /// The program defines subroutines.
    pub defines: bool,
}

impl<'a> Runner<'a> {
    pub fn new(source: &'a [u8], options: &'a Options, lines: usize, seen: &'a dyn Fn(usize)) -> Self {
        let main = Text { name: String::new(), bytes: Cow::Borrowed(source), flow: OnceCell::new() };
        let start = Frame { text: 0, at: 0, line: 0, shown: None, repeats: Vec::new(), again: None };
        Self {
            options,
            interpreter: Interpreter::new(options, lines),
            seen,
            texts: vec![Rc::new(main)],
            frames: vec![start],
            block: Block::new(),
            deleted: 0,
            left: lines as u64 + SPARE_LINES + LINES_OF_A_MOVE * options.max_moves as u64,
            told: 0,
            since_told: 0,
            opened: false,
            called: false,
            defines: false,
        }
    }

    /// Runs the program to its end; sentences about how it ends, and what was left out.
    pub fn run(&mut self) -> Outcome<Vec<String>> {
        let end = loop {
            let Some(mut frame) = self.frames.pop() else { break None };
            let text = self.texts[frame.text].clone();
            let mut lexer = Lexer::new(&text.bytes, self.options.block_delete, self.options.whole_step);
            if frame.line > 0 || frame.at > 0 {
                lexer.jump(frame.at, frame.line);
            }
            let exit = self.stretch(&mut lexer, &text, &mut frame);
            (frame.at, frame.line) = (lexer.at, lexer.line);
            let main = self.frames.is_empty();
            self.frames.push(frame);
            match exit? {
                Exit::End(word) if main || word.is_some() => {
                    break Some(self.ending(&lexer, word));
                }
                Exit::End(_) => {
                    return fault("the subprogram does not end with M99 or endsub: it may be truncated")
                }
                Exit::Call { label, arguments } => self.call(&label, &arguments)?,
                Exit::Fanuc { number, local, times, arguments } => {
                    self.call_fanuc(number, local, times, arguments)?
                }
                Exit::Back(number) => self.go_back(number)?,
                Exit::Return(_) if main => break Some(self.ending(&lexer, Some("M99"))),
                Exit::Return(value) => self.leave(value),
            }
        };
        self.interpreter.check_end()?;
        Ok(end.unwrap_or_default())
    }

    /// Sentences about the end of the program.
    fn ending(&self, lexer: &Lexer, word: Option<&str>) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.deleted > 0 {
            warnings.push(format!("{} blocks that start with / are left out (block delete)", self.deleted));
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

    /// Runs lines of one text until it is left.
    fn stretch(&mut self, lexer: &mut Lexer, text: &Text, frame: &mut Frame) -> Outcome<Exit> {
        loop {
            let line = lexer.next_line(&mut self.block, &self.interpreter)?;
            self.count(lexer.line, frame.text)?;
            match line {
                Some(Line::Block) => {
                    if !lexer.assigned.is_empty() {
                        self.interpreter.assign(&mut lexer.assigned)?;
                    }
                    let line = frame.shown.unwrap_or(lexer.line);
                    for (letter, text) in lexer.remarks.drain(..) {
                        self.interpreter.remark(line, letter, text);
                    }
                    if self.interpreter.run(&self.block, line)? {
                        return Ok(Exit::End(Some("M2 or M30")));
                    }
                    if self.block.calls() {
                        return self.fanuc();
                    }
                }
                Some(Line::Deleted) => self.deleted += 1,
                // The first % opens the program, unless blocks stand before it.
                Some(Line::Percent) if !self.opened && !lexer.begun => self.opened = true,
                Some(Line::Percent) => return Ok(Exit::End(Some("%"))),
                Some(Line::Flow(at)) => {
                    let flow = text.flow(self.options.block_delete)?;
                    let Some(step) = flow.at(at) else {
                        return fault("an O word has no number and no <name>: give one");
                    };
                    if let Some(exit) = self.step(lexer, &text.bytes, flow, step, frame)? {
                        return Ok(exit);
                    }
                }
                None => return Ok(Exit::End(None)),
            }
        }
    }

    /// Counts the lines that are run, and tells how many lines of the program have been read.
    #[inline(always)]
    fn count(&mut self, line: u32, text: usize) -> Outcome<()> {
        self.since_told += 1;
        if self.since_told < TOLD {
            return Ok(());
        }
        self.since_told = 0;
        let more = if text == 0 { line.saturating_sub(self.told) } else { 0 };
        self.told += more;
        (self.seen)(more as usize);
        match self.left.checked_sub(u64::from(TOLD)) {
            Some(left) => self.left = left,
            None => return fault(format!(
                "the loops and calls of the program run more lines than {} moves take: check their conditions, or raise \
                 max_moves",
                self.options.max_moves
            )),
        }
        Ok(())
    }

    fn call(&mut self, label: &[u8], arguments: &[f64]) -> Outcome<()> {
        let (text, at, line) = self.find(label)?;
        self.interpreter.parameters.enter(arguments, Scope::Own)?;
        self.push(text, at, line, None);
        Ok(())
    }

    fn call_fanuc(
        &mut self,
        number: i64,
        local: bool,
        times: u32,
        arguments: Option<Vec<f64>>,
    ) -> Outcome<()> {
        if times == 0 {
            return Ok(());
        }
        let (text, at, line) = match local {
            true => self.find_line(number, "M97 calls")?,
            false => self.find(number.to_string().as_bytes())?,
        };
        let scope = if arguments.is_some() { Scope::Macro } else { Scope::Shared };
        self.interpreter.parameters.enter(arguments.as_deref().unwrap_or_default(), scope)?;
        self.push(text, at, line, Some(Again { at, line, left: times - 1, arguments }));
        Ok(())
    }

    /// Ends the last call, if there is one, and goes on in the line of that block number.
    fn go_back(&mut self, number: i64) -> Outcome<()> {
        if self.frames.len() > 1 {
            self.frames.pop();
            self.interpreter.leave_call();
        }
        let (_, at, line) = self.find_line(number, "M99 goes to")?;
        if let Some(frame) = self.frames.last_mut() {
            (frame.at, frame.line) = (at, line);
            frame.repeats.clear();
        }
        Ok(())
    }

    fn push(&mut self, text: usize, at: usize, line: u32, again: Option<Again>) {
        let caller = &self.frames[self.frames.len() - 1];
        let shown = (text != 0).then(|| caller.shown.unwrap_or(caller.line));
        self.called = true;
        self.frames.push(Frame { text, at, line, shown, repeats: Vec::new(), again });
    }

    /// Ends the last call, or runs its subprogram again.
    fn leave(&mut self, value: Option<f64>) {
        if let Some(frame) = self.frames.last_mut() {
            if let Some(again) = frame.again.as_mut().filter(|again| again.left > 0) {
                again.left -= 1;
                (frame.at, frame.line) = (again.at, again.line);
                frame.repeats.clear();
                if let Some(arguments) = &again.arguments {
                    self.interpreter.parameters.take(arguments);
                }
                return;
            }
            let by_number = frame.again.is_some();
            self.frames.pop();
            self.interpreter.leave_call();
            if !by_number {
                self.interpreter.parameters.set_named(b"_value", value.unwrap_or(0.0));
                self.interpreter.parameters.set_named(b"_value_returned", f64::from(value.is_some()));
            }
        }
    }

    /// Where a subprogram begins: in the text that calls it, in one that is open, or in a file of its name.
    fn find(&mut self, label: &[u8]) -> Outcome<(usize, usize, u32)> {
        let here = self.frames.last().map_or(0, |frame| frame.text);
        for text in std::iter::once(here).chain(0..self.texts.len()) {
            if let Some(place) = self.sub_in(text, label)? {
                return Ok(place);
            }
        }
        let name = String::from_utf8_lossy(label).into_owned();
        let found = match &self.options.subprograms {
            Some(files) if name.bytes().all(|byte| !matches!(byte, b'/' | b'\\' | b'\0')) => {
                files(&name).or_else(fault)?
            }
            _ => None,
        };
        let Some((file, bytes)) = found else {
            return fault(format!(
                "the subprogram {name} is neither in the program nor in a file {name}.ngc beside it: give its folder \
                 (--subprograms), or put it into the program"
            ));
        };
        self.texts.push(Rc::new(Text {
            name: file.clone(),
            bytes: Cow::Owned(bytes),
            flow: OnceCell::new(),
        }));
        let text = self.texts.len() - 1;
        match self.sub_in(text, label) {
            Ok(Some(place)) => Ok(place),
            Ok(None) => {
                fault(format!("the file {file} has no subprogram {name}: name it O<{name}> sub there"))
            }
            Err(error) => Err(Box::new(Fault { message: format!("in {file}: {}", error.message), ..*error })),
        }
    }

    fn sub_in(&self, text: usize, label: &[u8]) -> Outcome<Option<(usize, usize, u32)>> {
        let flow = self.texts[text].flow(self.options.block_delete)?;
        Ok(flow.sub(label).map(|i| (text, flow.steps[i].next, flow.steps[i].line)))
    }

    /// Where the line of a block number begins, in the program that runs.
    fn find_line(&self, number: i64, what: &str) -> Outcome<(usize, usize, u32)> {
        let (here, from) = self.frames.last().map_or((0, 0), |frame| (frame.text, frame.at));
        let text = &self.texts[here];
        match text.flow(self.options.block_delete)?.numbered(&text.bytes, number, from) {
            Some((at, line)) => Ok((here, at, line)),
            None => fault(format!("{what} line N{number}, which the program does not have")),
        }
    }

    /// The line of the program that a fault is about, and its sentence with the place in other files.
    #[cold]
    pub fn place(&self, fault: &Fault) -> (u32, String) {
        let Some(frame) = self.frames.last() else { return (fault.line.unwrap_or(1), fault.message.clone()) };
        let line = fault.line.unwrap_or(frame.line).max(1);
        match frame.shown {
            None => (line, fault.message.clone()),
            Some(shown) => {
                (shown, format!("in {} line {line}: {}", self.texts[frame.text].name, fault.message))
            }
        }
    }
}
