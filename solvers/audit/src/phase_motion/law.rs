//! The law of a phase whose speed is by the parameter.
//!
//! All laws are one: p = u̇² = N/D. Distances d of the parameter are counted from the anchor of the phase.
//!
//! | law | N | D |
//! |---|---|---|
//! | axis acceleration, axis velocity | v_k² + 2 a Δq_k | q'_k² |
//! | parameter acceleration | p + 2 s d | 1 |
//! | feed of shares, speed line | v² linear in d | the square of what counts of C' |
//!
//! Where v is by the length of the path see `phase_by_length`.

/// N and D, with the values at the anchor.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    /// N = `start_sq` + 2 `value` Δq_k, the square of the velocity of axis k.
    Axis { axis: usize, value: f64, start_sq: f64 },
    /// N = `start` + `slope` d, and D = 1.
    Parameter { start: f64, slope: f64 },
    /// N changes by `change_sq` to the other end, evenly with d.
    Speed { start_sq: f64, change_sq: f64 },
}
