//! Computes the centre and the sweep of a G2 or G3 arc from its centre offsets or its radius.
//!
//! Tolerances are LinuxCNC's defaults, so that every program that runs there is accepted here. Points are in the plane of the
//! arc, in the order that makes it right-handed: (X, Y), (Z, X), (Y, Z).

use std::f64::consts::TAU;

use super::fault::Outcome;
use super::plane::{distance, minus, Point2};
use super::tolerance::{
    HALF_CHORD, RADIUS_SLACK, SAME_ANGLE, SAME_POINT, SPIRAL_INCH, SPIRAL_MM, SPIRAL_MOST, SPIRAL_RELATIVE,
};

/// How an arc is programmed.
#[derive(Clone, Copy, Debug)]
pub enum Form {
    /// The centre, and whether the program is in inches.
    Centre { centre: Point2, inches: bool },
    /// The R word: negative for more than a half turn.
    Radius(f64),
}

/// The centre of an arc and its signed sweep in radians, positive counter-clockwise.
///
/// `clockwise` is true for G2. `turns` is the P word: turns - 1 full turns are added. Where the radii at both ends
/// differ within the tolerance, the arc is a spiral about the centre.
pub fn arc(start: Point2, end: Point2, form: Form, clockwise: bool, turns: u32) -> Outcome<(Point2, f64)> {
    let centre = match form {
        Form::Centre { centre, inches } => {
            check_radii(start, end, centre, inches)?;
            centre
        }
        Form::Radius(radius) => centre_of(start, end, radius, clockwise)?,
    };
    let (a, b) = (minus(start, centre), minus(end, centre));
    let mut sweep = (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1]);
    if clockwise {
        sweep = -sweep;
    }
    if sweep < 0.0 {
        sweep += TAU;
    }
    if sweep <= SAME_ANGLE && distance(start, end) <= SAME_POINT {
        sweep += TAU;
    }
    sweep += TAU * f64::from(turns - 1);
    Ok((centre, if clockwise { -sweep } else { sweep }))
}

fn check_radii(start: Point2, end: Point2, centre: Point2, inches: bool) -> Outcome<()> {
    let (first, last) = (distance(start, centre), distance(end, centre));
    if first < RADIUS_SLACK || last < RADIUS_SLACK {
        return fault!(
            "the arc has no radius ({first:.4} mm at its start, {last:.4} mm at its end): check I, J, K and the plane"
        );
    }
    let spread = (first - last).abs();
    let allowed = if inches { SPIRAL_INCH } else { SPIRAL_MM };
    if spread > SPIRAL_MOST * allowed || (spread > allowed && spread > SPIRAL_RELATIVE * first.max(last)) {
        return fault!(
            "the radius of the arc is {first:.4} mm at its start and {last:.4} mm at its end, more than {allowed:.3} mm \
             apart: check I, J, K, the plane and G90.1/G91.1, or post more decimals"
        );
    }
    Ok(())
}

/// The centre of an arc with an R word: the direction and the sign of the radius determine on which side of the chord it is.
fn centre_of(start: Point2, end: Point2, radius: f64, clockwise: bool) -> Outcome<Point2> {
    let chord = minus(end, start);
    let length = distance(start, end);
    let half = 0.5 * length;
    if half <= f64::EPSILON * start[0].abs().max(start[1].abs()).max(1.0) {
        return fault!("an arc with R ends where it starts, so its centre is anywhere: program full circles with I, J, K");
    }
    if half - radius.abs() > RADIUS_SLACK || radius == 0.0 {
        return fault!(
            "the radius {:.4} mm of the arc is too small to reach its end {length:.4} mm away: check R",
            radius.abs()
        );
    }
    // A radius that exceeds half the chord by no more than the rounding of coordinates is taken as half the chord: the square
    // root would turn that rounding into a visible height.
    let largest = [start[0], start[1], end[0], end[1]].iter().fold(half, |most, value| most.max(value.abs()));
    let rounding = HALF_CHORD * largest;
    let excess = if radius.abs() - half > rounding { radius.abs() - half } else { 0.0 };
    let height = (excess * (radius.abs() + half)).sqrt();
    // The centre is left of the chord for a short counter-clockwise or a long clockwise arc.
    let side = if clockwise == (radius > 0.0) { -height } else { height };
    Ok([
        0.5 * (start[0] + end[0]) - side * chord[1] / length,
        0.5 * (start[1] + end[1]) + side * chord[0] / length,
    ])
}

/// The length in mm of an arc that rises by `rise` along its axis; for a spiral, to second order in the difference of its
/// radii.
pub fn arc_length(start: Point2, end: Point2, centre: Point2, angle: f64, rise: f64) -> f64 {
    let (first, last) = (distance(start, centre), distance(end, centre));
    (0.5 * (first + last) * angle).hypot(last - first).hypot(rise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    use proptest::prelude::*;

    const MM: bool = false;

    fn about(centre: Point2) -> Form {
        Form::Centre { centre, inches: MM }
    }

    fn sweep(start: Point2, end: Point2, form: Form, clockwise: bool) -> f64 {
        arc(start, end, form, clockwise, 1).unwrap().1
    }

    #[test]
    fn quarter_turns_have_the_sign_of_their_direction() {
        let (east, north) = ([1.0, 0.0], [0.0, 1.0]);
        assert!((sweep(east, north, about([0.0, 0.0]), false) - PI / 2.0).abs() < 1e-15);
        assert!((sweep(east, north, about([0.0, 0.0]), true) + 1.5 * PI).abs() < 1e-15);
    }

    #[test]
    fn an_arc_back_to_its_start_is_a_full_turn() {
        let start = [2.0, 0.0];
        assert_eq!(sweep(start, start, about([1.0, 0.0]), false), TAU);
        assert_eq!(sweep(start, start, about([1.0, 0.0]), true), -TAU);
        assert_eq!(arc(start, start, about([1.0, 0.0]), true, 3).unwrap().1, -3.0 * TAU);
        assert!((sweep(start, [2.0, 1e-14], about([1.0, 0.0]), false) - TAU).abs() < 1e-12);
    }

    #[test]
    fn a_flat_arc_is_no_full_turn() {
        let found = sweep([0.0, 0.0], [0.05, 0.0], about([0.025, 1e5]), false);
        assert!((found - 5e-7).abs() < 1e-12, "{found}");
    }

    #[test]
    fn a_radius_gives_the_short_arc_and_a_negative_one_the_long_arc() {
        let (east, north) = ([1.0, 0.0], [0.0, 1.0]);
        let near = |form, clockwise, centre: Point2, angle: f64| {
            let (found, sweep) = arc(east, north, form, clockwise, 1).unwrap();
            assert!(distance(found, centre) < 1e-12 && (sweep - angle).abs() < 1e-12, "{found:?} {sweep}");
        };
        near(Form::Radius(1.0), false, [0.0, 0.0], PI / 2.0);
        near(Form::Radius(-1.0), false, [1.0, 1.0], 1.5 * PI);
        near(Form::Radius(1.0), true, [1.0, 1.0], -PI / 2.0);
        near(Form::Radius(-1.0), true, [0.0, 0.0], -1.5 * PI);
    }

    #[test]
    fn a_radius_may_miss_its_chord_by_rounding_only() {
        let (start, end) = ([0.0, 0.0], [2.0, 0.0]);
        let (centre, sweep) = arc(start, end, Form::Radius(0.9995), false, 1).unwrap();
        assert!(distance(centre, [1.0, 0.0]) < 1e-12 && (sweep - PI).abs() < 1e-12);
        assert!(arc(start, end, Form::Radius(0.99), false, 1).unwrap_err().message.contains("too small"));
        assert!(arc(start, end, Form::Radius(0.0), false, 1).unwrap_err().message.contains("too small"));
        assert!(arc(end, end, Form::Radius(5.0), false, 1).unwrap_err().message.contains("full circles"));
    }

    #[test]
    fn radii_at_both_ends_may_differ_as_linuxcnc_allows() {
        let differ = |radius: f64, spread: f64, inches| {
            arc([radius, 0.0], [0.0, radius + spread], Form::Centre { centre: [0.0, 0.0], inches }, false, 1)
                .is_ok()
        };
        assert!(differ(1.0, 0.028, false) && !differ(1.0, 0.029, false));
        assert!(differ(1.0, 0.071, true) && !differ(1.0, 0.072, true));
        assert!(differ(1000.0, 0.9, false) && !differ(1000.0, 1.1, false));
        assert!(differ(1e5, 2.8, false) && !differ(1e5, 2.9, false));
        assert!(!differ(0.001, 0.0, false));
    }

    #[test]
    fn lengths_follow_circle_helix_and_spiral() {
        assert_eq!(arc_length([2.0, 0.0], [0.0, 2.0], [0.0, 0.0], PI / 2.0, 0.0), PI);
        assert_eq!(arc_length([3.0, 0.0], [3.0, 0.0], [0.0, 0.0], 1.0, 4.0), 5.0);
        let steps = 100_000;
        let spiral = |i: usize| {
            let t = i as f64 / steps as f64;
            let (radius, angle) = (10.0 + 0.02 * t, PI * t);
            [radius * angle.cos(), radius * angle.sin()]
        };
        let chords: f64 = (0..steps).map(|i| distance(spiral(i), spiral(i + 1))).sum();
        let length = arc_length(spiral(0), spiral(steps), [0.0, 0.0], PI, 0.0);
        assert!((length - chords).abs() < 1e-6, "{length} {chords}");
    }

    proptest! {
        #[test]
        fn centre_and_radius_forms_agree(
            cx in -50.0..50.0f64, cy in -50.0..50.0f64, radius in 0.1..50.0f64,
            from in 0.0..TAU, by in 0.01..6.2f64, clockwise: bool,
        ) {
            prop_assume!((by - PI).abs() > 1e-3);
            let signed = if clockwise { -by } else { by };
            let at = |angle: f64| [cx + radius * angle.cos(), cy + radius * angle.sin()];
            let (start, end) = (at(from), at(from + signed));
            let r = if by > PI { -radius } else { radius };
            for form in [about([cx, cy]), Form::Radius(r)] {
                let (centre, sweep) = arc(start, end, form, clockwise, 1).unwrap();
                prop_assert!(distance(centre, [cx, cy]) < 1e-8, "{centre:?}");
                prop_assert!((sweep - signed).abs() < 1e-8, "{sweep} {signed}");
            }
        }
    }
}
