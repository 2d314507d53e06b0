//! The motion q = K(P) of joints that follow the path P of the tool tip, from the recorded operations of K and the pieces of P.
//!
//! Sources: Griewank and Walther, Evaluating Derivatives (2008); Moore, Kearfott and Cloud, Introduction to Interval
//! Analysis (2009).
//!
//! | file | what it computes |
//! |---|---|
//! | `expression` | K on series of numbers or of intervals (`number`, `interval`, `series`) |
//! | `tip` | Taylor series of the tip's path, at a point or over a part of a piece |
//! | `path_derivatives` | joint positions and derivatives at points, and proven bounds of them over parts |
//! | `singularities` | the joints along a whole path, the singular places, the places where joints leave their travel |
//! | `joint_interpolants` | polynomials that approximate the joint motion, with a proven error (`accuracy`) |
//! | `tolerance` | every tolerance, with its reason |

pub mod accuracy;
pub mod expression;
mod interval;
pub mod joint_interpolants;
pub mod number;
pub mod path_derivatives;
pub mod series;
pub mod singularities;
pub mod tip;
mod tolerance;
