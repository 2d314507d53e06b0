//! Setpoints as one array for each quantity, and their division into parts for parallel work.

/// The greatest number of iterations and the greatest length error of some setpoints.
#[derive(Clone, Copy, Debug, Default)]
pub struct Effort {
    pub iterations: u32,
    /// As a share of the step; includes the proven error of the table of lengths.
    pub length_error: f64,
}

impl Effort {
    pub(super) fn raise(&mut self, iterations: u32, length_error: f64) {
        self.iterations = self.iterations.max(iterations);
        self.length_error = self.length_error.max(length_error);
    }
}

/// Consecutive setpoints, one array for each quantity. `piece` and `u` are their places on the path.
#[derive(Clone, Debug, Default)]
pub struct Chunk<const M: usize> {
    pub t: Vec<f64>,
    pub position: Vec<[f64; M]>,
    pub velocity: Vec<[f64; M]>,
    pub acceleration: Vec<[f64; M]>,
    pub jerk: Vec<[f64; M]>,
    pub line: Vec<i32>,
    pub piece: Vec<u32>,
    pub u: Vec<f64>,
    pub effort: Effort,
}

/// Parts of the arrays of a chunk, from setpoint `start` on.
pub(super) struct Slices<'a, const M: usize> {
    pub start: usize,
    pub t: &'a mut [f64],
    pub position: &'a mut [[f64; M]],
    pub velocity: &'a mut [[f64; M]],
    pub acceleration: &'a mut [[f64; M]],
    pub jerk: &'a mut [[f64; M]],
    pub line: &'a mut [i32],
    pub piece: &'a mut [u32],
    pub u: &'a mut [f64],
}

impl<const M: usize> Chunk<M> {
    /// A chunk of `size` setpoints, all numbers 0.
    pub(super) fn with_size(size: usize) -> Self {
        Self {
            t: vec![0.0; size],
            position: vec![[0.0; M]; size],
            velocity: vec![[0.0; M]; size],
            acceleration: vec![[0.0; M]; size],
            jerk: vec![[0.0; M]; size],
            line: vec![0; size],
            piece: vec![0; size],
            u: vec![0.0; size],
            effort: Effort::default(),
        }
    }

    /// Slices of all arrays; their first setpoint has the index `start`.
    pub(super) fn slices(&mut self, start: usize) -> Slices<'_, M> {
        Slices {
            start,
            t: &mut self.t,
            position: &mut self.position,
            velocity: &mut self.velocity,
            acceleration: &mut self.acceleration,
            jerk: &mut self.jerk,
            line: &mut self.line,
            piece: &mut self.piece,
            u: &mut self.u,
        }
    }
}

impl<const M: usize> Slices<'_, M> {
    /// Splits before each of the given setpoints, which must be in ascending order.
    pub(super) fn split(self, cuts: &[usize]) -> Vec<Self> {
        let mut parts = Vec::with_capacity(cuts.len() + 1);
        let mut rest = self;
        for &cut in cuts {
            let at = cut - rest.start;
            let (t, t_rest) = rest.t.split_at_mut(at);
            let (position, position_rest) = rest.position.split_at_mut(at);
            let (velocity, velocity_rest) = rest.velocity.split_at_mut(at);
            let (acceleration, acceleration_rest) = rest.acceleration.split_at_mut(at);
            let (jerk, jerk_rest) = rest.jerk.split_at_mut(at);
            let (line, line_rest) = rest.line.split_at_mut(at);
            let (piece, piece_rest) = rest.piece.split_at_mut(at);
            let (u, u_rest) = rest.u.split_at_mut(at);
            parts.push(Slices {
                start: rest.start,
                t,
                position,
                velocity,
                acceleration,
                jerk,
                line,
                piece,
                u,
            });
            rest = Slices {
                start: cut,
                t: t_rest,
                position: position_rest,
                velocity: velocity_rest,
                acceleration: acceleration_rest,
                jerk: jerk_rest,
                line: line_rest,
                piece: piece_rest,
                u: u_rest,
            };
        }
        parts.push(rest);
        parts
    }
}
