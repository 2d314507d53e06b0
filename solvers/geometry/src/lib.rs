//! Geometry of curves: polynomials, Bézier pieces, splines, circles, lengths and their inverse. Lengths are in mm.

pub mod arc_length;
pub mod bisection;
pub mod conic;
pub mod elementary;
mod instances;
pub mod interval;
pub mod inverse_length;
pub mod lanes;
pub mod newton;
pub mod parallel;
pub mod polynomial;
pub mod quadratic;
pub mod spline;
pub mod tolerance;
pub mod watch;
