//! What stays constant on an arc of a profile; the numbers are those of the profile's arrays.

/// The law of an arc: s and p = u'² are speed and its square along the parameter u, C' and q'_k derivatives by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArcKind {
    /// q'_k s + q''_k p = value in mm/s², signed.
    AxisAcceleration = 0,
    /// s = value in mm/s²: p is linear in u.
    ParameterAcceleration = 1,
    /// |C'|² p = value in mm²/s².
    Feed = 2,
    /// q'_k² p = value in mm²/s².
    AxisVelocity = 3,
    /// p = value · |C'|.
    Chord = 4,
    /// |C'|² p is linear in u between its ends.
    SpeedLine = 5,
    /// The jerk along the path is value in mm/s³.
    PathJerk = 6,
    /// |C'|² p is a cubic of the length, of which both ends and their accelerations tell the coefficients.
    SpeedCubic = 7,
}

impl ArcKind {
    /// Whether the law is about the way along the path: that of all axes, where the feed is about some of them.
    pub fn is_along(self) -> bool {
        matches!(self, Self::PathJerk | Self::SpeedCubic)
    }

    /// The kind with a number.
    pub fn from_number(number: u8) -> Option<Self> {
        [
            Self::AxisAcceleration,
            Self::ParameterAcceleration,
            Self::Feed,
            Self::AxisVelocity,
            Self::Chord,
            Self::SpeedLine,
            Self::PathJerk,
            Self::SpeedCubic,
        ]
        .into_iter()
        .find(|&kind| kind as u8 == number)
    }
}
