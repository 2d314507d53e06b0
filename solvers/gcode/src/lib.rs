//! The reader of G-code: from the text of a program to its moves in machine coordinates.
//!
//! Sources: the NIST interpreter for RS-274/NGC (NIST IR 6556), the documentation of LinuxCNC, and the manuals of Fanuc
//! for its macros and codes. Text that is not understood is an error with its line and word.
//!
//! 1. `run` takes the lines in the order of the program flow, which `flow` finds, `steps` follows, and `macros` extends by
//!    Fanuc's statements.
//! 2. `words` reads a line into a `block`, with the arithmetic of `expression` on `parameters` and `readings`.
//! 3. `intent` finds the motion of the block and checks that each of its words has a use.
//! 4. `execute` runs the block in LinuxCNC's order, with the modes of `modal` and `modes` and the zero of `offsets`.
//! 5. `motion`, `arc`, `spline`, `cycle`, `thread` and `corner` make moves; `compensate` and `beside` offset them by the
//!    tool's radius; `tip` converts between joints and the tool's tip.
//! 6. `moves` holds the moves and gives them as columns.

mod arc;
mod arithmetic;
mod beside;
mod block;
mod compensate;
mod corner;
mod cycle;
mod dialect;
mod execute;
mod expression;
mod fault;
mod flow;
mod intent;
mod macros;
mod modal;
mod modes;
mod motion;
mod moves;
mod number;
mod offsets;
mod parameters;
mod readings;
mod run;
mod spline;
mod steps;
mod thread;
mod tip;
mod tolerance;
mod tools;
mod turned;
mod words;

pub use moves::{Columns, Direction, Point};
pub use tip::{CoordinateMode, Place, TipControl};

use fault::Fault;
use run::Runner;
pub use tools::Tool;

/// Finds a subprogram by its name: its file and the bytes of it, None where there is no such file, or a sentence why it
/// cannot be read.
pub type Subprograms = dyn Fn(&str) -> Result<Option<(String, Vec<u8>)>, String> + Send + Sync;

/// Names the machines that have the axis of a letter.
pub type MachinesWith = dyn Fn(char) -> String + Send + Sync;

/// The machine's data and the user's choices that the reader needs.
pub struct Options {
    /// Work offsets G54 to G59.3 and G54.1 P1 on, in mm and degrees; missing ones are 0.
    pub offsets: Vec<Point>,
    /// The position that G28 and G30 go to, in mm and degrees.
    pub home: Point,
    /// The position where the program begins, in mm and degrees.
    pub start: Point,
    /// Letters of the machine's axes; empty where no machine is given.
    pub machine_axes: Vec<u8>,
    /// The machines that have the axis of a letter, as a part of a sentence.
    pub machines_with: Option<Box<MachinesWith>>,
    /// The kinematics for G43.4 and G43.5; None where no machine is given.
    pub tip_control: Option<Box<dyn TipControl + Send + Sync>>,
    /// Finds subprograms in files; None where the program has no folder for them.
    pub subprograms: Option<Box<Subprograms>>,
    /// The tool table; None where it is not known.
    pub tools: Option<Vec<Tool>>,
    /// The feed in mm/s of moves before the first F; None where such moves are an error.
    pub feed: Option<f64>,
    /// The unit of axis words without a decimal point, in units of the program: 1, or 0.001 on some controls.
    pub whole_step: f64,
    /// True to leave out blocks after `/`.
    pub block_delete: bool,
    /// The greatest number of moves; a program with more is an error.
    pub max_moves: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            offsets: Vec::new(),
            home: [0.0; 9],
            start: [0.0; 9],
            machine_axes: Vec::new(),
            machines_with: None,
            tip_control: None,
            subprograms: None,
            tools: None,
            feed: None,
            whole_step: 1.0,
            block_delete: true,
            max_moves: 50_000_000,
        }
    }
}

/// Why a program is not read: a sentence, and the 1-based line that it is about; None for the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadError {
    pub line: Option<u32>,
    pub message: String,
}

/// The moves of a program. `seen` is called now and then with the number of lines read since its last call; it may unwind.
pub fn read(source: &[u8], options: &Options, seen: &dyn Fn(usize)) -> Result<Columns, ReadError> {
    let whole = |message: &str| ReadError { line: None, message: message.into() };
    if source.contains(&0) {
        return Err(whole("the file is binary or UTF-16, not a text of single bytes: give a G-code program"));
    }
    if source.len() > i32::MAX as usize {
        return Err(whole("the program is larger than 2 GiB: split it"));
    }
    // A sum of 255 bytes that are 0 or 1 fits into a byte, so the compiler uses vector instructions.
    let ends = |part: &[u8]| part.iter().map(|&byte| u8::from(byte == b'\n')).sum::<u8>();
    let lines = source.chunks(255).map(|part| usize::from(ends(part))).sum::<usize>() + 1;
    let mut runner = Runner::new(source, options, lines, seen);
    let ended = match runner.run() {
        Ok(ended) => ended,
        Err(fault) => return Err(locate(&runner, &fault, source)),
    };
    let defines = runner.defines;
    let (moves, mut warnings) = runner.interpreter.into_parts();
    if moves.is_empty() {
        return Err(whole(match defines {
            true => "the program defines subroutines and moves nothing: give the program that calls them",
            false => "the program moves nothing: give one with G0, G1, G2 or G3 and axis words",
        }));
    }
    warnings.extend(ended);
    Ok(moves.finish(warnings))
}

#[cold]
fn locate(runner: &Runner, fault: &Fault, source: &[u8]) -> ReadError {
    let (line, mut message) = runner.place(fault);
    if fault.foreign {
        if let Some(language) = dialect::guess(source) {
            message += &format!("; the file looks like {language} code, and only RS-274 (G-code) is read");
        }
    }
    ReadError { line: Some(line), message }
}
