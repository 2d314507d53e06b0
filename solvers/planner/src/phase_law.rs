//! The laws of the phases of a profile, with their numbers in the column `kind`.

/// The law of a phase: u is the parameter of the piece, ' = d/du, p = (du/dτ)² and s = p'/2 with the time τ, C the
/// curve of the tool and q_k axis k. `value` is the phase's number in the column `value`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhaseLaw {
    /// q'_k s + q''_k p = value [mm/s²], with its sign.
    AxisAcceleration = 0,
    /// s = value [1/s² for u without a unit], so p is linear in u.
    ParameterAcceleration = 1,
    /// |C'|² p = value [mm²/s²].
    Feed = 2,
    /// q'_k² p = value [mm²/s²].
    AxisVelocity = 3,
    /// |C'|² p is linear in u.
    SpeedLine = 4,
    /// The jerk along the path is value [mm/s³].
    PathJerk = 5,
    /// |C'|² p is a cubic in the length, given by both ends and their accelerations.
    SpeedCubic = 6,
}

impl PhaseLaw {
    /// Whether the law refers to the length along the path, to which all axes contribute. The speed that the feed limits may
    /// depend on some axes only.
    pub fn is_along(self) -> bool {
        matches!(self, Self::PathJerk | Self::SpeedCubic)
    }

    pub fn from_number(number: u8) -> Option<Self> {
        [
            Self::AxisAcceleration,
            Self::ParameterAcceleration,
            Self::Feed,
            Self::AxisVelocity,
            Self::SpeedLine,
            Self::PathJerk,
            Self::SpeedCubic,
        ]
        .into_iter()
        .find(|&kind| kind as u8 == number)
    }
}
