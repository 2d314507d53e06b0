//! Reads a program: from its text to the columns of its moves.

use super::dialect;
use super::fault::Fault;
use super::moves::columns::Columns;
use super::options::Options;
use super::run::Runner;

/// Why a program cannot be read: a sentence, and the 1-based line to which it refers; None for the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReadError {
    pub line: Option<u32>,
    pub message: String,
}

/// The moves of a program. `seen` is called now and then with the number of lines read since its last call; it may stop the
/// reading by a panic.
pub fn read(source: &[u8], options: &Options, seen: &dyn Fn(usize)) -> Result<Columns, ReadError> {
    let whole = |message: &str| ReadError { line: None, message: message.into() };
    if source.contains(&0) {
        return Err(whole("the file is binary or UTF-16, not a text of single bytes: save it as UTF-8, or give a G-code program"));
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
