//! Why a program cannot be read: one sentence without its place, which the reader adds.

/// A sentence for the user; `foreign` where the text itself is not understood, so that the whole file may be
/// in another language than RS-274.
#[derive(Debug)]
pub struct Fault {
    pub message: String,
    pub foreign: bool,
    /// The 1-based line it is about; None for the one that is read.
    pub line: Option<u32>,
}

/// Boxed, so that the outcome of the hot functions fits a register.
pub type Outcome<T> = Result<T, Box<Fault>>;

/// The program is understood and cannot be followed.
#[cold]
pub fn fault<T>(message: impl Into<String>) -> Outcome<T> {
    Err(Box::new(Fault { message: message.into(), foreign: false, line: None }))
}

/// The text is not understood.
#[cold]
pub fn foreign<T>(message: impl Into<String>) -> Outcome<T> {
    Err(Box::new(Fault { message: message.into(), foreign: true, line: None }))
}

/// The program is understood and cannot be followed, because of another line than the one that is read.
#[cold]
pub fn fault_in<T>(line: u32, message: impl Into<String>) -> Outcome<T> {
    Err(Box::new(Fault { message: message.into(), foreign: false, line: Some(line) }))
}
