//! The input of the reader besides the program: the machine's data and the user's choices.

use super::coordinates::{Point, TipControl};

/// A tool of the table: its number, its pocket, its offset in mm and degrees, its diameter in mm, and the cutting side of
/// a lathe tool (1 to 9; 0 for mills).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    pub number: u32,
    pub pocket: u32,
    pub offset: Point,
    pub diameter: f64,
    pub orientation: u32,
}

/// Finds a subprogram by its name: returns the name and the bytes of its file, None if there is no such file, or a sentence why
/// it cannot be read.
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
    /// Returns the machines that have the axis of a letter, as a part of a sentence.
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
