//! The reason why a program cannot be read: one sentence without its line, which the reader adds.

use std::fmt::Arguments;

/// A sentence for the user.
#[derive(Debug)]
pub struct Fault {
    pub message: String,
    /// True where the reader does not understand the text: the file may be in another language than RS-274.
    pub foreign: bool,
    /// The 1-based line to which it refers; None for the line that is being read.
    pub line: Option<u32>,
}

/// A result whose error is boxed, so that the results of hot functions fit into a register.
pub type Outcome<T> = Result<T, Box<Fault>>;

/// An error with a message as for `format!`: the program is understood but cannot be executed.
macro_rules! fault {
    ($($message:tt)+) => { $crate::fault::Fault::error(None, false, format_args!($($message)+)) };
}

/// An error with a message as for `format!`: the text is not understood.
macro_rules! foreign {
    ($($message:tt)+) => { $crate::fault::Fault::error(None, true, format_args!($($message)+)) };
}

/// An error with a message as for `format!`: the program cannot be executed because of line `$line`, not of the line that is
/// read.
macro_rules! fault_in {
    ($line:expr, $($message:tt)+) => { $crate::fault::Fault::error(Some($line), false, format_args!($($message)+)) };
}

impl Fault {
    #[cold]
    pub fn error<T>(line: Option<u32>, foreign: bool, message: Arguments) -> Outcome<T> {
        Err(Box::new(Self { message: message.to_string(), foreign, line }))
    }
}
