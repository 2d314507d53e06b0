//! What is known at an end of a window.

use super::rest_ramp::Ramp;

/// The known values at an end of a window.
#[derive(Clone, Copy, Debug)]
pub enum WindowEnd {
    /// The path begins or ends at rest with a ramp; w at the end of the ramp is at most `greatest`.
    Rest { ramp: Ramp, greatest: f64 },
    /// w and w' are given.
    Fixed { w: f64, slope: f64 },
    /// w and w' may have any values within the limits.
    Free,
}

impl WindowEnd {
    /// The ramp at this end; of length 0 if the path is not at rest there.
    pub fn ramp(&self) -> Ramp {
        match *self {
            Self::Rest { ramp, .. } => ramp,
            Self::Fixed { .. } | Self::Free => Ramp { length: 0.0, power: Ramp::JERK },
        }
    }

    /// Whether a spline that ends with these values meets this end.
    pub fn is_met(&self, end_w: f64, end_slope: f64) -> bool {
        match *self {
            Self::Rest { .. } | Self::Free => true,
            Self::Fixed { w, slope } => (end_w, end_slope) == (w, slope),
        }
    }
}
