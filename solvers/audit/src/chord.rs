//! The chord error: how far the path leaves the straight line between two setpoints, from speed and curvature.

use super::number::Number;

/// Distance of a circle of this curvature from its chord of length `step`. A circle has no chord longer than its diameter: the
/// result is then half of `step`, as a path of that length stays within half of it of one of its ends.
#[inline(always)]
pub fn chord_error<T: Number>(step: T, curvature: T) -> T {
    let (half, one) = (step * 0.5, step.filled(1.0));
    let reach = (half * curvature).smaller(one);
    // ρ − √(ρ² − half²), without the cancellation.
    half * reach / (one + (one - reach * reach).root())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chord_error_is_the_sagitta() {
        // A 3-4-5 triangle: chord 6 on radius 5 leaves the circle by 1.
        assert!((chord_error(6.0, 0.2) - 1.0).abs() < 1e-15);
        assert_eq!(chord_error(6.0, 0.0), 0.0);
        assert_eq!(chord_error(10.0, 0.2), 5.0);
        assert_eq!(chord_error(12.0, 0.2), 6.0);
    }
}
