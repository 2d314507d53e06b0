//! The fit as a whole: every property of `fit_points` on chains by hand, at random (proptest) and adversarial, checked
//! by dense sampling that is independent of the certificate.

use feedplan_geometry::quadratic::{dot, lerp, norm, sub};
use feedplan_geometry::watch::Watch;
use feedplan_path::fit::{fit_points, FitOptions, FittedPiece};
use proptest::prelude::*;
use std::f64::consts::TAU;

const TOLERANCE: f64 = 0.01;
const OPTIONS: FitOptions = FitOptions {
    tolerance: TOLERANCE,
    max_chord: f64::INFINITY,
    max_curvature: f64::INFINITY,
    corner_angle: std::f64::consts::FRAC_PI_6,
};
/// The number of chords into which a piece is divided for sampling.
const SAMPLES: usize = 64;

fn to_segment<const M: usize>(p: &[f64; M], a: &[f64; M], b: &[f64; M]) -> f64 {
    let (w, v) = (sub(p, a), sub(b, a));
    let length_sq = dot(&v, &v);
    let t = if length_sq > 0.0 { (dot(&w, &v) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    norm(&sub(p, &lerp(a, b, t)))
}

fn to_polyline<const M: usize>(p: &[f64; M], polyline: &[[f64; M]]) -> f64 {
    polyline.windows(2).map(|pair| to_segment(p, &pair[0], &pair[1])).fold(f64::INFINITY, f64::min)
}

fn unit<const M: usize>(v: [f64; M]) -> [f64; M] {
    let length = norm(&v);
    v.map(|value| value / length)
}

/// Checks all properties of a fit.
fn check<const M: usize>(points: &[[f64; M]], pieces: &[FittedPiece<M>], options: &FitOptions) {
    let tolerance = options.tolerance;
    let last = points.len() - 1;
    assert_eq!((pieces[0].first, pieces[pieces.len() - 1].last), (0, last - 1));
    assert_eq!(pieces[0].spline, 0);
    assert_eq!(pieces[0].piece.control[0], points[0]);
    assert_eq!(pieces[pieces.len() - 1].piece.control[2], points[last]);
    let size = points.iter().flatten().fold(0.0_f64, |size, value| size.max(value.abs()));
    for pair in pieces.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        assert_eq!(a.piece.control[2], b.piece.control[0], "pieces join");
        assert!(b.first == a.last || b.first == a.last + 1, "chords without gaps: {} {}", a.last, b.first);
        let (before, after) = (a.piece.end_tangents().1, b.piece.end_tangents().0);
        if a.spline == b.spline {
            let rounding = 1e-12 + 8.0 * f64::EPSILON * size / a.piece.width.min(b.piece.width);
            assert!(norm(&sub(&before, &after)) <= rounding, "C1 within a spline: {before:?} {after:?}");
        } else {
            assert_eq!(b.spline, a.spline + 1);
            assert!(points[b.first] == b.piece.control[0], "splines meet at a point of the chain");
        }
    }
    for piece in pieces {
        assert!(piece.first <= piece.last && piece.deviation <= tolerance);
        let (start, end) = piece.piece.end_tangents();
        let chord = sub(&piece.piece.control[2], &piece.piece.control[0]);
        assert!(dot(&start, &chord) > 0.0 || dot(&end, &chord) > 0.0);
        assert!(dot(&start, &end) > -norm(&start) * norm(&end) && norm(&start).min(norm(&end)) > 0.05);
        let chords = &points[piece.first..=piece.last + 1];
        for i in 0..=SAMPLES {
            let p = piece.piece.point(piece.piece.width * i as f64 / SAMPLES as f64);
            let off = to_polyline(&p, chords);
            assert!(off <= piece.deviation + 1e-12 * (1.0 + size), "curve {off} beyond {}", piece.deviation);
        }
    }
    let mut from = 0;
    for (i, chord) in points.windows(2).enumerate() {
        while pieces[from].last < i {
            from += 1;
        }
        let near: Vec<_> = pieces[from..].iter().take_while(|piece| piece.first <= i).collect();
        let bound = near.iter().fold(0.0_f64, |bound, piece| bound.max(piece.deviation));
        let curve: Vec<[f64; M]> = near
            .iter()
            .flat_map(|piece| {
                (0..=SAMPLES).map(|k| piece.piece.point(piece.piece.width * k as f64 / SAMPLES as f64))
            })
            .collect();
        for k in 0..=8 {
            let off = to_polyline(&lerp(&chord[0], &chord[1], k as f64 / 8.0), &curve);
            // The greatest distance of the chords between samples from the curve.
            let bow = near.iter().fold(0.0_f64, |bow, piece| {
                let [a, b, c] = &piece.piece.control;
                let bend: [f64; M] = std::array::from_fn(|k| a[k] - 2.0 * b[k] + c[k]);
                bow.max(norm(&bend) / (4 * SAMPLES * SAMPLES) as f64)
            });
            assert!(off <= bound + bow + 1e-12 * (1.0 + size), "chord {i}: {off} beyond {bound}");
        }
    }
}

fn fitted<const M: usize>(points: &[[f64; M]], options: &FitOptions) -> Vec<FittedPiece<M>> {
    let pieces = fit_points(points, options, Watch::default());
    check(points, &pieces, options);
    pieces
}

/// The cosines of the corners between splines.
fn joints<const M: usize>(pieces: &[FittedPiece<M>]) -> Vec<f64> {
    pieces
        .windows(2)
        .filter(|pair| pair[0].spline != pair[1].spline)
        .map(|pair| dot(&unit(pair[0].piece.end_tangents().1), &unit(pair[1].piece.end_tangents().0)))
        .collect()
}

fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

#[test]
fn two_points_are_one_line() {
    let pieces = fitted(&[[1.0, 2.0, 3.0], [4.0, 6.0, 3.0]], &OPTIONS);
    assert_eq!(pieces.len(), 1);
    assert_eq!(pieces[0].piece.width, 5.0);
    assert_eq!(pieces[0].deviation, 0.0);
}

#[test]
fn a_square_is_four_lines() {
    let pieces = fitted(&[[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [0.0, 0.0]], &OPTIONS);
    assert_eq!(
        pieces.iter().map(|piece| (piece.first, piece.spline)).collect::<Vec<_>>(),
        [(0, 0), (1, 1), (2, 2), (3, 3)]
    );
}

#[test]
fn colinear_points_are_one_line() {
    let points: Vec<[f64; 2]> = (0..1000).map(|i| [0.3 * f64::from(i), 0.1 * f64::from(i)]).collect();
    let pieces = fitted(&points, &OPTIONS);
    assert_eq!((pieces.len(), pieces[0].first, pieces[0].last), (1, 0, 998));
}

#[test]
fn a_run_that_bends_by_less_than_rounding_at_a_time_still_holds_the_tolerance() {
    let points: Vec<[f64; 2]> =
        (0..1000).map(f64::from).map(|x| [x, 1e-15 * (x - 500.0) * (x - 500.0)]).collect();
    let options = FitOptions { tolerance: 1e-10, ..OPTIONS };
    assert!(fit_points(&points, &options, Watch::default())
        .iter()
        .all(|piece| piece.deviation <= options.tolerance));
}

#[test]
fn a_parabola_collapses() {
    let points: Vec<[f64; 2]> =
        (-100..=100).map(|i| f64::from(i) / 20.0).map(|x| [x, 0.05 * x * x]).collect();
    assert!(fitted(&points, &OPTIONS).len() <= 6);
}

#[test]
fn a_line_runs_into_an_arc_without_a_jump() {
    let mut points: Vec<[f64; 2]> = (0..=10).map(|i| [f64::from(i) - 10.0, 0.0]).collect();
    points.extend((1..=90).map(|i| f64::from(i).to_radians()).map(|t| [5.0 * t.sin(), 5.0 - 5.0 * t.cos()]));
    points.push([5.0, 25.0]);
    let pieces = fitted(&points, &FitOptions { max_chord: 8.0, ..OPTIONS });
    assert_eq!((pieces[0].last, pieces[0].deviation < 1e-12), (9, true));
    assert_eq!((pieces[pieces.len() - 1].first, pieces[pieces.len() - 1].deviation), (100, 0.0));
    let joints = joints(&pieces);
    assert_eq!(joints.len(), 2);
    assert!(joints.iter().all(|&cosine| 1.0 - cosine < 1e-14), "{joints:?}");
}

#[test]
fn curvature_breaks_below_the_corner_angle_do_not_jump() {
    let points: Vec<[f64; 2]> = (0..400).map(|i| 0.05 * f64::from(i)).map(|x| [x, (1.3 * x).sin()]).collect();
    let pieces = fitted(&points, &FitOptions { max_curvature: 1.0, ..OPTIONS });
    let joints = joints(&pieces);
    assert!(joints.len() >= 7, "{}", joints.len());
    assert!(joints.iter().all(|&cosine| 1.0 - cosine < 1e-14), "{joints:?}");
}

#[test]
fn a_corner_between_curves_jumps_once() {
    let mut points: Vec<[f64; 2]> =
        (0..=60).map(|i| 0.1 * f64::from(i)).map(|x| [x, 0.2 * x.sin()]).collect();
    let [x, y] = points[60];
    points.extend((1..=60).map(|i| 0.1 * f64::from(i)).map(|t| [x + 0.2 * t.sin(), y + t]));
    let pieces = fitted(&points, &FitOptions { max_curvature: 0.9, ..OPTIONS });
    assert!(pieces.iter().any(|piece| piece.piece.control[2] == points[60]));
    let joints_there = joints(&pieces);
    // The curves arrive along (1, 0.192) and leave along (0.2, 1), a cosine of 0.377. Within the tolerance, the direction of a
    // free end may differ from these.
    assert!(joints_there.len() == 1 && (joints_there[0] - 0.377).abs() < 0.06, "{joints_there:?}");
    assert_eq!(pieces.len(), 12);
    // Without a threshold, the corner is rounded as far as the tolerance allows.
    assert!(joints(&fitted(&points, &OPTIONS)).is_empty());
}

#[test]
fn chords_too_coarse_for_the_tolerance_stay() {
    let hexagon: Vec<[f64; 2]> =
        (0..=6).map(|i| f64::from(60 * i).to_radians()).map(|t| [10.0 * t.cos(), 10.0 * t.sin()]).collect();
    let pieces = fitted(&hexagon, &FitOptions { corner_angle: 2.0, ..OPTIONS });
    assert_eq!(pieces.len(), 6);
    assert!(pieces.iter().all(|piece| piece.deviation == 0.0));
}

#[test]
fn a_bulge_between_one_and_two_tolerances_is_shared_and_stays_smooth() {
    // Chords of 1 mm on a radius of 8 mm have a sagitta of 0.0157 mm.
    let points: Vec<[f64; 2]> =
        (0..=50).map(|i| f64::from(i) / 8.0).map(|t| [8.0 * t.cos(), 8.0 * t.sin()]).collect();
    let pieces = fitted(&points, &OPTIONS);
    assert!(pieces.iter().all(|piece| piece.spline == 0), "{}", pieces[pieces.len() - 1].spline);
    assert!(pieces.iter().any(|piece| piece.deviation > 0.75 * TOLERANCE));
}

/// A profile with waves, and beads in its creases, as 486 points on a grid of 1 µm.
fn vase_pass() -> Vec<[f64; 2]> {
    let beads = [8.0, 15.0, 95.0, 102.0, 109.0];
    let profile: Vec<[f64; 2]> = (0..=20_000)
        .map(|i| 0.006 * f64::from(i))
        .map(|y| {
            let waves = 25.0 + 8.0 * (TAU * y / 90.0).sin();
            let wave = 2.5 * (TAU * y / 17.0 + 0.5).sin() * (-((y - 60.0) / 30.0).powi(2)).exp();
            let bead = |centre: f64| 2.0 * (1.0 - ((y - centre) / 3.2).powi(2)).max(0.0).sqrt();
            [y, beads.iter().fold(waves + wave, |z, &centre| z.max(z - 0.8 + bead(centre)))]
        })
        .collect();
    let mut length = vec![0.0];
    for pair in profile.windows(2) {
        length.push(length[length.len() - 1] + norm(&sub(&pair[1], &pair[0])));
    }
    let micrometre = |value: f64| (1000.0 * value).round() / 1000.0;
    (0..486)
        .map(|i| {
            let at = length[20_000] * f64::from(i) / 485.0;
            let next = length.partition_point(|&before| before < at).clamp(1, 20_000);
            let t = (at - length[next - 1]) / (length[next] - length[next - 1]);
            lerp(&profile[next - 1], &profile[next], t).map(micrometre)
        })
        .collect()
}

/// Zhang et al. 2010 report 14.3 chords per spline and 2.8 per polynomial for 486 points.
#[test]
fn a_vase_pass_compresses_as_in_the_paper() {
    let max_curvature = 4.0 * 3000.0_f64.hypot(1000.0) / 100.0_f64.powi(2);
    let pieces = fitted(&vase_pass(), &FitOptions { max_curvature, ..OPTIONS });
    let splines = pieces[pieces.len() - 1].spline + 1;
    assert!((10.0..50.0).contains(&(485.0 / f64::from(splines))), "{splines} splines");
    assert!((2.5..4.5).contains(&(485.0 / pieces.len() as f64)), "{} polynomials", pieces.len());
}

#[test]
fn no_tolerance_and_no_numbers_keep_every_chord() {
    let points: Vec<[f64; 2]> = (0..50).map(|i| [f64::from(i), f64::from(i * i) * 0.01]).collect();
    for tolerance in [0.0, -1.0, f64::NAN] {
        assert_eq!(fit_points(&points, &FitOptions { tolerance, ..OPTIONS }, Watch::default()).len(), 49);
    }
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mut points = points.clone();
        points[20][1] = bad;
        assert_eq!(fit_points(&points, &OPTIONS, Watch::default()).len(), 49);
    }
    assert!(fit_points(&points[..1], &OPTIONS, Watch::default()).is_empty());
    let odd = FitOptions { max_chord: f64::NAN, max_curvature: f64::NAN, corner_angle: f64::NAN, ..OPTIONS };
    fitted(&points, &odd);
}

#[test]
fn the_unit_does_not_matter() {
    let mut state = 5;
    let points: Vec<[f64; 3]> = (0..3000)
        .map(|i| 0.05 * f64::from(i))
        .map(|t| [20.0 * t.cos() + 0.002 * random(&mut state), t * t.sin(), (3.0 * t).sin().abs()])
        .collect();
    let options = FitOptions { max_chord: 2.0, max_curvature: 0.9, ..OPTIONS };
    let pieces = fit_points(&points, &options, Watch::default());
    // A factor that is a power of two scales without rounding.
    for scale in [1024.0, 1.0 / 1024.0] {
        let scaled: Vec<[f64; 3]> = points.iter().map(|p| p.map(|value| scale * value)).collect();
        let options = FitOptions {
            tolerance: scale * options.tolerance,
            max_chord: scale * options.max_chord,
            max_curvature: options.max_curvature / scale,
            ..options
        };
        let again = fit_points(&scaled, &options, Watch::default());
        assert_eq!(pieces.len(), again.len());
        for (piece, other) in pieces.iter().zip(&again) {
            assert_eq!((piece.first, piece.last, piece.spline), (other.first, other.last, other.spline));
            assert_eq!(piece.piece.control.map(|c| c.map(|value| scale * value)), other.piece.control);
        }
    }
}

#[test]
fn threads_do_not_matter() {
    let mut state = 7;
    let points: Vec<[f64; 2]> = (0..30_000)
        .map(|i| 0.01 * f64::from(i))
        .map(|t| [t, (t * (1.0 + 0.01 * t)).sin() + 0.004 * random(&mut state)])
        .collect();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit_points(&points, &FitOptions { max_curvature: 4.0, ..OPTIONS }, Watch::default()))
    };
    assert!(with(1) == with(4));
}

#[test]
fn chains_made_to_hurt_hold_the_tolerance() {
    let count = 3000;
    let mut state = 11;
    let mut walk = |step: f64| {
        let mut at = [0.0; 2];
        (0..count)
            .map(|_| {
                at = at.map(|value| value + step * random(&mut state));
                at
            })
            .collect::<Vec<_>>()
    };
    let mut chains: Vec<Vec<[f64; 2]>> = [1e-4, 2e-3, 2e-2, 0.5, 10.0].map(&mut walk).to_vec();
    let along = |step: f64, y: &dyn Fn(usize) -> f64| (0..count).map(|i| [step * i as f64, y(i)]).collect();
    chains.push(along(0.01, &|i| (i % 2) as f64));
    chains.push(along(0.01, &|i| 0.05 * (i % 7) as f64));
    chains.push(along(0.01, &|i| f64::from(u8::from(i % 500 == 250))));
    chains.push(along(0.01, &|i| (1e-4 * (i * i) as f64).sin()));
    chains.push(along(1e-9, &|i| 3e-10 * (i % 3) as f64));
    // Back and forth on one line, pausing for less than 1e-9, and a spiral whose chords grow beyond the
    // tolerance.
    chains.push((0..count).map(|i| [(i % 2) as f64, 0.0]).collect());
    chains.push((0..count).map(|i| [(0.003 * (i / 2) as f64).sin() * 9.0, 1e-10 * i as f64]).collect());
    chains.push(
        (0..count)
            .map(|i| (0.02 * i as f64, 0.01 * i as f64))
            .map(|(r, t)| [r * t.cos(), r * t.sin()])
            .collect(),
    );
    for (i, points) in chains.iter().enumerate() {
        for max_curvature in [0.9, f64::INFINITY] {
            println!("chain {i} max_curvature {max_curvature}");
            fitted(points, &FitOptions { max_curvature, ..OPTIONS });
        }
    }
}

fn chain() -> impl Strategy<Value = Vec<[f64; 3]>> {
    // Mostly small turns and mostly similar steps, as in real programs, and some others.
    let turn = prop_oneof![6 => -0.05..0.05, 2 => -0.5..0.5, 1 => -3.1..3.1_f64];
    let step = prop_oneof![6 => 0.2..0.4, 2 => 0.01..2.0, 1 => 1e-6..20.0_f64];
    (proptest::collection::vec((turn, step, -0.02..0.02_f64), 1..120)).prop_map(|steps| {
        let (mut at, mut angle) = ([10.0, -20.0, 5.0], 0.0_f64);
        let mut points = vec![at];
        for (turn, step, climb) in steps {
            angle += turn;
            at = [at[0] + step * angle.cos(), at[1] + step * angle.sin(), at[2] + step * climb];
            points.push(at);
        }
        points
    })
}

proptest! {
    #[test]
    fn every_promise_holds_of_random_chains(
        points in chain(),
        tolerance in prop_oneof![Just(0.001), Just(0.01), Just(0.1), Just(1.0)],
        max_chord in prop_oneof![Just(1.0), Just(f64::INFINITY)],
        max_curvature in prop_oneof![Just(0.3), Just(f64::INFINITY)],
    ) {
        fitted(&points, &FitOptions { tolerance, max_chord, max_curvature, ..OPTIONS });
    }
}
