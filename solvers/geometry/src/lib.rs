//! Geometry of curves: polynomials, splines, circles, lengths and their inverse. Lengths are millimetres.

pub mod arc_length;
pub mod conic;
mod instances;
pub mod newton;
pub mod polynomial;
pub mod quadratic;
pub mod sarfraz;
pub mod spline;
pub mod watch;
