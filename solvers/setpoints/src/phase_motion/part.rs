//! A place on a phase as a share of its whole measure: of its length, of its parameter interval or of the displacement of an
//! axis.

/// A share of the whole measure of a phase, counted from its start or from its end.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from_start: bool,
    pub share: f64,
}

impl Part {
    /// The same place, counted from the nearer end.
    pub fn nearer_end(self) -> Self {
        if self.share <= 0.5 {
            self
        } else {
            Self { from_start: !self.from_start, share: 1.0 - self.share }
        }
    }
}
