//! The reason why a program cannot be read: one sentence without its line, which the reader adds.

/// A sentence for the user.
#[derive(Debug)]
pub struct Fault {
    pub message: String,
    /// True where the text is not understood: the file may be in another language than RS-274.
    pub foreign: bool,
    /// The 1-based line that it is about; None for the line that is read.
    pub line: Option<u32>,
}

/// A result whose error is boxed, so that the results of hot functions fit into a register.
pub type Outcome<T> = Result<T, Box<Fault>>;

/// A program that is understood and cannot be followed.
#[cold]
pub fn fault<T>(message: impl Into<String>) -> Outcome<T> {
    Err(Box::new(Fault { message: message.into(), foreign: false, line: None }))
}

/// A text that is not understood.
#[cold]
pub fn foreign<T>(message: impl Into<String>) -> Outcome<T> {
    Err(Box::new(Fault { message: message.into(), foreign: true, line: None }))
}

/// A program that cannot be followed because of another line than the one that is read.
#[cold]
pub fn fault_in<T>(line: u32, message: impl Into<String>) -> Outcome<T> {
    Err(Box::new(Fault { message: message.into(), foreign: false, line: Some(line) }))
}
