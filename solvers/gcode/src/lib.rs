//! G-code (RS-274/NGC) to moves in machine coordinates.
//!
//! `run` takes lines in the order that `flow` and `steps` say; `words` cuts them into blocks, with the arithmetic of
//! `expression` on `parameters` and `readings`. `intent` says what a block asks for, `execute` runs it in LinuxCNC's
//! order with the modes of `modal` and the offsets of `places`; `macros` is Fanuc's. `motion`, `arc`, `spline`, `cycle`
//! and `thread` make moves, `compensate` puts the tool beside them, `tip` says what their words mean, `moves` holds them
//! as columns. What is not understood is an error with its line and word; nothing is skipped silently.

mod arc;
mod arithmetic;
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
mod offset;
mod parameters;
mod places;
mod readings;
mod run;
mod spline;
mod steps;
mod thread;
mod tip;
mod tools;
mod turned;
mod words;

pub use moves::{Columns, Direction, Point};
pub use tip::{CoordinateMode, Place, TipControl};

use fault::Fault;
use run::Runner;
pub use tools::Tool;

/// Finds a subprogram by its name: the file and its bytes, None where there is none, or why it cannot be read.
pub type Subprograms = dyn Fn(&str) -> Result<Option<(String, Vec<u8>)>, String> + Send + Sync;

/// Names the machines that have the axis of a letter.
pub type MachinesWith = dyn Fn(char) -> String + Send + Sync;

/// What the reader must know about the machine and the user's choices.
pub struct Options {
    /// Work offsets G54 to G59.3 and G54.1 P1 on, in mm and degrees; 0 where there are fewer.
    pub offsets: Vec<Point>,
    /// Where G28 and G30 go, in mm and degrees.
    pub home: Point,
    /// Where the program begins, in mm and degrees.
    pub start: Point,
    /// Letters of the machine's axes; empty where no machine is given.
    pub machine_axes: Vec<u8>,
    /// Which machines have the axis of a letter, as a part of a sentence.
    pub machines_with: Option<Box<MachinesWith>>,
    /// What the machine makes of G43.4 and G43.5; None where there is no machine.
    pub tip_control: Option<Box<dyn TipControl + Send + Sync>>,
    /// Finds subprograms in files; None where there are none.
    pub subprograms: Option<Box<Subprograms>>,
    /// The tool table; None where it is not known.
    pub tools: Option<Vec<Tool>>,
    /// The feed [mm/s] of moves before the first F; None where there is none.
    pub feed: Option<f64>,
    /// What axis words without a decimal point count, in units of the program: 1, or 0.001 on controls set so.
    pub whole_step: f64,
    /// Leave out blocks after `/`.
    pub block_delete: bool,
    /// A program with more moves is an error.
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

/// Why a program is not read: a sentence, and the 1-based line it is about; None for the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadError {
    pub line: Option<u32>,
    pub message: String,
}

/// The moves of a program. `seen` is told every so often of how many more lines have been read; it may unwind.
pub fn read(source: &[u8], options: &Options, seen: &dyn Fn(usize)) -> Result<Columns, ReadError> {
    let whole = |message: &str| ReadError { line: None, message: message.into() };
    if source.contains(&0) {
        return Err(whole("the file is binary or UTF-16, not a text of single bytes: give a G-code program"));
    }
    if source.len() > i32::MAX as usize {
        return Err(whole("the program is larger than 2 GiB: split it"));
    }
    // Sums of bytes, which do not overflow in 255 of them, are counted by vector instructions.
    let ends = |part: &[u8]| part.iter().map(|&byte| u8::from(byte == b'\n')).sum::<u8>();
    let lines = source.chunks(255).map(|part| usize::from(ends(part))).sum::<usize>() + 1;
    let mut runner = Runner::new(source, options, lines, seen);
    let ended = match runner.run() {
        Ok(ended) => ended,
        Err(fault) => return Err(locate(&runner, &fault, source)),
    };
    let defines = runner.defines;
    let (moves, mut warnings) = runner.interpreter.into_parts();
    if moves.is_empty() && defines {
        return Err(whole(
            "the program defines subroutines and moves nothing: give the program that calls them",
        ));
    }
    if moves.is_empty() {
        return Err(whole("the program moves nothing: give one with G0, G1, G2 or G3 and axis words"));
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
