//! Positions, tool directions, and the meaning of axis words: joint positions, or positions of the tool's tip. The machine's
//! kinematics converts them into each other.

/// A point of the machine: X Y Z A B C U V W in mm and degrees.
pub type Point = [f64; 9];

/// A tool direction I, J, K: a unit vector from the tip to the spindle.
pub type Direction = [f64; 3];

/// The tool direction at the start of a program.
pub const UPRIGHT: Direction = [0.0, 0.0, 1.0];

/// The meaning of axis words, with the numbers of the Python package.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum CoordinateMode {
    /// Joint positions.
    #[default]
    Joints = 0,
    /// The tip and the angles of the rotary axes.
    Tip = 1,
    /// The tip and I, J, K as the tool direction.
    Vector = 2,
}

/// A position in the coordinates of a mode, X to W, and the tool direction.
pub type Place = (Point, Direction);

/// The kinematics of a machine. A tool length is in mm, NaN for that of the machine file.
pub trait TipControl {
    /// Fails, with the reason as a sentence, if the machine cannot be programmed in this mode.
    fn check(&self, mode: CoordinateMode) -> Result<(), String>;

    /// The joint positions at the end of a path in the coordinates of a mode, which begins at the joints `entry`.
    fn joints(
        &self,
        mode: CoordinateMode,
        tool_length: f64,
        entry: &Point,
        path: &[Place],
    ) -> Result<Point, String>;

    /// The position of joints in the coordinates of a mode.
    fn place(&self, mode: CoordinateMode, tool_length: f64, joints: &Point) -> Result<Place, String>;
}
