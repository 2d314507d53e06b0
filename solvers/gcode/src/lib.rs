//! Reads G-code: from the text of a program to its moves in machine coordinates.
//!
//! Sources: the NIST interpreter for RS-274/NGC (NIST IR 6556), the documentation of LinuxCNC, and the manuals of Fanuc
//! for its macros and codes. Text that is not understood is an error with its line and word.
//!
//! 1. `read` starts `run`, which takes the lines in the order of the program flow: `statement` reads its keywords, `flow` links
//!    them, and `steps` executes them.
//! 2. `words` reads a line into a `block`, with the arithmetic of `expression` on `parameters` and `readings`.
//! 3. `intent` finds the motion of the block and checks that each of its words has a use.
//! 4. `execute` runs the block on the state of the `interpreter` in LinuxCNC's order, with the modes of `modal` and `modes`
//!    and the zero of `offsets`.
//! 5. `motion`, `arc`, `spline`, `cycle`, `thread` and `corner` make moves; `compensate` offsets them by the tool's
//!    radius; `tip` converts between joints and the tool's tip.
//! 6. `moves` holds the moves, `events` what happens between them; `moves/columns` gives both as columns.

// Its macros are for the modules below.
#[macro_use]
mod fault;

mod arc;
mod arithmetic;
mod block;
mod compensate;
mod compensation;
mod coordinates;
mod corner;
mod cycle;
mod dialect;
mod events;
mod execute;
mod expression;
mod flow;
mod intent;
mod interpreter;
mod modal;
mod modes;
mod motion;
mod moves;
mod number;
mod nurbs;
mod offsets;
mod options;
mod parameters;
mod plane;
mod read;
mod readings;
mod run;
mod spline;
mod statement;
mod steps;
mod thread;
mod tip;
mod tolerance;
mod tools;
mod turned;
mod words;

pub use coordinates::{CoordinateMode, Direction, Place, Point, TipControl};
pub use moves::columns::Columns;
pub use options::{MachinesWith, Options, Subprograms, Tool};
pub use read::{read, ReadError};
