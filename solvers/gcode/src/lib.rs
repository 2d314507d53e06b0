//! G-code (RS-274/NGC) to moves in machine coordinates.
//!
//! `words` cuts lines into blocks, `intent` says what a block asks for, `execute` runs it in LinuxCNC's order with the
//! modes of `modal` and the offsets of `places`; `motion`, `arc`, `spline` and `cycle` make moves, `tip` says what their
//! words mean, `moves` holds them as columns. What is not understood is an error with its line
//! and word; nothing is skipped silently.

mod arc;
mod arithmetic;
mod block;
mod cycle;
mod dialect;
mod execute;
mod expression;
mod fault;
mod intent;
mod modal;
mod motion;
mod moves;
mod number;
mod places;
mod spline;
mod tip;
mod words;

pub use moves::{Columns, Direction, Point};
pub use tip::{Meaning, Place, TipControl};

use block::Block;
use execute::Interpreter;
use fault::Fault;
use words::{Lexer, Line};

/// Rows that room is made for at once, at most; beyond, the columns grow.
const MOST_EXPECTED: usize = 1 << 24;

/// What the reader must know about the machine and the user's choices.
pub struct Options {
    /// Work offsets G54 to G59.3, in mm and degrees.
    pub offsets: [Point; 9],
    /// Where G28 and G30 go, in mm and degrees.
    pub home: Point,
    /// Where the program begins, in mm and degrees.
    pub start: Point,
    /// Letters of the machine's axes; empty where no machine is given.
    pub machine_axes: Vec<u8>,
    /// What the machine makes of G43.4 and G43.5; None where there is no machine.
    pub tip_control: Option<Box<dyn TipControl + Send + Sync>>,
    /// Leave out blocks after `/`.
    pub block_delete: bool,
    /// A program with more moves is an error.
    pub max_moves: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            offsets: [[0.0; 9]; 9],
            home: [0.0; 9],
            start: [0.0; 9],
            machine_axes: Vec::new(),
            tip_control: None,
            block_delete: true,
            max_moves: 50_000_000,
        }
    }
}

/// Why a program is not read: a sentence, and the 1-based line it is about; None for the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadError {
    pub line: Option<u32>,
    pub message: String,
}

/// Lines between two times that the reader tells how far it is.
const TOLD: u32 = 1024;

/// The moves of a program. `seen` is told every so often of how many more lines have been read; it may unwind.
pub fn read(source: &[u8], options: &Options, seen: &dyn Fn(usize)) -> Result<Columns, ReadError> {
    let whole = |message: &str| ReadError { line: None, message: message.into() };
    if source.contains(&0) {
        return Err(whole("the file is binary or UTF-16, not a text of single bytes: give a G-code program"));
    }
    if source.len() > i32::MAX as usize {
        return Err(whole("the program is larger than 2 GiB: split it"));
    }
    let lines = source.iter().filter(|&&byte| byte == b'\n').count() + 1;
    let mut lexer = Lexer::new(source, options.block_delete);
    let mut interpreter = Interpreter::new(options, lines.min(MOST_EXPECTED));
    let ended =
        run(&mut lexer, &mut interpreter, seen).map_err(|fault| locate(*fault, lexer.line, source))?;
    let (moves, mut warnings) = interpreter.into_parts();
    if moves.is_empty() {
        return Err(whole("the program moves nothing: give one with G0, G1, G2 or G3 and axis words"));
    }
    warnings.extend(ended);
    Ok(moves.finish(warnings))
}

/// Runs the program to its end; sentences about how it ends, and what was left out.
fn run(
    lexer: &mut Lexer,
    interpreter: &mut Interpreter,
    seen: &dyn Fn(usize),
) -> Result<Vec<String>, Box<Fault>> {
    let mut block = Block::new();
    let mut warnings = Vec::new();
    let mut deleted = 0u32;
    let mut opened = false;
    let mut told = 0;
    let end = loop {
        if lexer.line - told >= TOLD {
            seen((lexer.line - told) as usize);
            told = lexer.line;
        }
        match lexer.next_line(&mut block)? {
            Some(Line::Block) => {
                if interpreter.run(&block, lexer.line)? {
                    break Some("M2 or M30");
                }
            }
            Some(Line::Deleted) => deleted += 1,
            // The first % opens the program, unless blocks stand before it.
            Some(Line::Percent) if !opened && !lexer.begun => opened = true,
            Some(Line::Percent) => break Some("%"),
            None => break None,
        }
    };
    interpreter.check_end()?;
    if deleted > 0 {
        warnings.push(format!("{deleted} blocks that start with / are left out (block delete)"));
    }
    match end {
        Some(word) if !lexer.is_spent() => {
            warnings.push(format!("line {}: {word} ends the program: what follows is not read", lexer.line));
        }
        None if lexer.ends_within_a_line() => warnings.push(
            "the program does not end with M2, M30 or %, and its last line has no line end: it may be truncated".into(),
        ),
        None => warnings.push("the program does not end with M2, M30 or %: it may be truncated".into()),
        _ => {}
    }
    Ok(warnings)
}

#[cold]
fn locate(fault: Fault, line: u32, source: &[u8]) -> ReadError {
    let mut message = fault.message;
    if fault.foreign {
        if let Some(language) = dialect::guess(source) {
            message += &format!("; the file looks like {language} code, and only RS-274 (G-code) is read");
        }
    }
    ReadError { line: Some(line), message }
}
