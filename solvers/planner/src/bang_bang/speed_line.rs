//! An upper limit of the speed that is linear over t, as v².

/// An upper limit of v² [mm²/s²] on [from, to] of a piece, linear in t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLine {
    pub from: f64,
    pub to: f64,
    pub speed_sq: [f64; 2],
}

impl SpeedLine {
    /// v² at t, extrapolated beyond the ends.
    pub fn at(&self, t: f64) -> f64 {
        let [f0, f1] = self.speed_sq;
        if f0 == f1 {
            return f0;
        }
        f0 + (f1 - f0) * ((t - self.from) / (self.to - self.from))
    }
}
