//! Motion along phases and the time grid, against hand calculation, their own derivatives and each other.

use feedplan_geometry::quadratic::{norm, sub, Quadratic};
use feedplan_geometry::spline::bezier::elevate;
use feedplan_geometry::spline::{CompositeCurve, Piece};
use feedplan_geometry::watch::Watch;
use feedplan_planner::phase_law::PhaseLaw;
use feedplan_planner::phases::{Phase, Phases};
use feedplan_setpoints::phase_motion::{Counts, PhaseMotion, PiecePath, State};
use feedplan_setpoints::sampling::{Interpolator, PathData, Sampler};
use proptest::prelude::*;

/// A curve of one piece with its degree elevated, for which the general formulas must give the same motion as the closed forms.
fn raised<const M: usize>(piece: &Quadratic<M>, by: usize) -> CompositeCurve<M> {
    let mut curve = CompositeCurve::default();
    elevate(&Piece { control: &piece.control, weights: &[], width: piece.width }, by, &mut curve);
    curve
}

fn motion<'a, const M: usize>(curve: &'a CompositeCurve<M>, phase: &Phase) -> PhaseMotion<'a, M> {
    PhaseMotion::new(PiecePath::new(curve.piece(0), Counts::Axes, Counts::Axes).into(), phase)
}

fn phase(law: PhaseLaw, value: f64, u: (f64, f64), p: (f64, f64), duration: f64) -> Phase {
    let ((u0, u1), (p0, p1)) = (u, p);
    Phase { piece: 0, law, axis: 0, value, u0, u1, p0, p1, duration, a0: 0.0, a1: 0.0 }
}

/// A line of 10 mm from rest to rest at 1000 mm/s²: up for 0.1 s to 100 mm/s, and down.
fn triangle() -> (Quadratic<2>, [Phase; 2]) {
    let line = Quadratic::line([0.0, 5.0], [10.0, 5.0]);
    let up = phase(PhaseLaw::AxisAcceleration, 1000.0, (0.0, 5.0), (0.0, 1e4), 0.1);
    let down = phase(PhaseLaw::AxisAcceleration, -1000.0, (5.0, 10.0), (1e4, 0.0), 0.1);
    (line, [up, down])
}

fn path_of(piece: &Quadratic<2>) -> PathData<2> {
    PathData {
        curve: raised(piece, 0).into(),
        axes: 2,
        tip_speed: None,
        way_speed: None,
        feed_share: vec![],
        lines: vec![7],
        runs: vec![0, 1],
        start_dwell: 0.0,
        dwell: vec![0.0],
    }
}

fn sampler(period: f64) -> Sampler<2> {
    let (line, phases) = triangle();
    let path = path_of(&line);
    Sampler::on(&path.into(), &Phases::from_iter(phases).into(), &[0, 2], period, Watch::default()).unwrap()
}

#[test]
fn a_triangle_is_half_a_t_squared() {
    for by in [0, 1, 7] {
        let (line, [up, down]) = triangle();
        let curve = raised(&line, by);
        let (up, down) = (motion(&curve, &up), motion(&curve, &down));
        for t in [0.0, 0.01, 0.05, 0.1] {
            let way = 500.0 * t * t;
            let state = up.at_time(t, 0.001);
            assert!((state.u - way).abs() < 1e-14, "{t}");
            assert!((up.rates(&state).velocity[0] - 1000.0 * t).abs() < 1e-12);
            assert_eq!((up.rates(&state).acceleration[0], up.rates(&state).jerk[0]), (1000.0, 0.0));
            assert!((down.at_time(0.1 - t, 0.001).u - (10.0 - way)).abs() < 1e-14);
        }
        assert_eq!(up.rates(&up.at(0.0)).velocity, [0.0; 2]);
        assert_eq!(down.rates(&down.at(10.0)).velocity, [0.0; 2]);
    }
}

#[test]
fn a_run_of_a_whole_number_of_periods_ends_on_the_grid() {
    // 0.2 s are 200 periods of 1 ms, whichever way the quotient rounds; 199 and a bit of 1.0001 ms.
    let below = 0.001 * (1.0 - 1e-13);
    for (period, count) in
        [(0.001, 201), (below, 201), (0.2 / 3.0, 4), (0.2 / 7.0, 8), (0.001_000_1, 201), (1.0, 2)]
    {
        for interpolator in [Interpolator::Sarfraz, Interpolator::Newton] {
            let sampler = sampler(period);
            assert_eq!(sampler.count(), count, "{period}");
            let chunk = sampler.chunk(0..count, interpolator, &mut None, Watch::default());
            assert_eq!(chunk.position[count - 1], [10.0, 5.0]);
            assert_eq!((chunk.velocity[count - 1], chunk.acceleration[count - 1]), ([0.0; 2], [0.0; 2]));
            assert_eq!(sampler.duration(), (count - 1) as f64 * period);
        }
    }
}

#[test]
fn any_part_of_the_stream_has_the_same_digits() {
    for interpolator in [Interpolator::Sarfraz, Interpolator::Newton] {
        let sampler = sampler(1e-5);
        let whole = sampler.chunk(0..sampler.count(), interpolator, &mut None, Watch::default());
        assert!(whole.t.len() > 20_000);
        // Forward, with gaps, and backward; with the state of the part before and without it.
        let mut state = None;
        for range in [0..1, 1..2, 4095..4097, 4097..4200, 12_345..20_001, 9_999..10_002] {
            for resume in [&mut None, &mut state] {
                let part = sampler.chunk(range.clone(), interpolator, resume, Watch::default());
                assert_eq!(part.position, whole.position[range.clone()]);
                assert_eq!(part.velocity, whole.velocity[range.clone()]);
                assert_eq!(part.t, whole.t[range.clone()]);
            }
        }
    }
}

#[test]
fn the_speed_next_to_a_standstill_keeps_its_digits() {
    // x' grows from 1 to 4 on [0, 3]: 7.5 mm from 15 mm/s down to rest in 1 s at 15 mm/s².
    let piece = Quadratic { control: [[0.0], [1.5], [7.5]], width: 3.0 };
    let down = phase(PhaseLaw::AxisAcceleration, -15.0, (0.0, 3.0), (225.0, 0.0), 1.0);
    for by in [0, 1, 7] {
        let curve = raised(&piece, by);
        let motion = motion(&curve, &down);
        for i in 0..50 {
            let u = 3.0 - 1e-12 * f64::from(i) * 1.7;
            let expected = (2.0 * 15.0 * 4.0 * (3.0 - u)).sqrt();
            let [speed] = motion.rates(&motion.at(u)).velocity;
            assert!((speed - expected).abs() <= 1e-9 * expected, "{speed} {expected}");
        }
    }
}

#[test]
fn a_start_at_rest_in_a_cusp_keeps_p_and_speeds_up() {
    // C' = u, p = 9: u = 3t, x = u²/2 at the constant acceleration 9.
    let piece = Quadratic { control: [[0.0], [0.0], [2.0]], width: 2.0 };
    let phase = phase(PhaseLaw::AxisAcceleration, 9.0, (0.0, 2.0), (9.0, 9.0), 2.0 / 3.0);
    for by in [0, 1, 7] {
        let curve = raised(&piece, by);
        let motion = motion(&curve, &phase);
        for t in [0.0, 1e-8, 0.1, 0.5] {
            let state = motion.at_time(t, 0.001);
            assert!((state.u - 3.0 * t).abs() <= 1e-15);
            assert!((motion.rates(&state).velocity[0] - 9.0 * t).abs() < 1e-14);
        }
    }
}

#[test]
fn nonsense_is_refused_with_a_sentence() {
    let build = |change: &dyn Fn(&mut Phase), period: f64| {
        let (line, mut phases) = triangle();
        change(&mut phases[1]);
        let path = path_of(&line);
        Sampler::on(&path.into(), &Phases::from_iter(phases).into(), &[0, 2], period, Watch::default()).err()
    };
    assert!(build(&|_| (), 0.001).is_none());
    for period in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-12, 5e-324] {
        assert!(build(&|_| (), period).unwrap().contains("period"), "{period}");
    }
    let changes: [&dyn Fn(&mut Phase); 10] = [
        &|phase| phase.piece = 1,
        &|phase| phase.u1 = 11.0,
        &|phase| phase.u0 = phase.u1,
        &|phase| phase.duration = f64::NAN,
        &|phase| phase.p0 = -1.0,
        &|phase| phase.p1 = f64::NAN,
        &|phase| phase.axis = 2,
        &|phase| phase.value = f64::INFINITY,
        &|phase| phase.a0 = 1.0,
        &|phase| phase.a1 = f64::NAN,
    ];
    for (i, change) in changes.iter().enumerate() {
        assert!(build(change, 0.001).unwrap().starts_with("phase 1 of the profile"), "{i}");
    }
}

prop_compose! {
    /// A piece whose x does not turn, and a phase of any law on part of it.
    fn any_phase()(
        control in prop::array::uniform3(prop::array::uniform2(-5.0..5.0)),
        slopes in prop::array::uniform2(prop_oneof![1 => Just(0.0), 4 => 0.0..5.0]),
        width in 0.1..5.0f64, cut in prop::array::uniform2(0.0..1.0f64), law in 0u8..7,
        speeds in prop::array::uniform2(prop_oneof![1 => Just(0.0), 4 => 0.01..100.0]),
        inner in prop::array::uniform2(prop_oneof![1 => Just(0.0), 4 => 0.0..2.0]), flip in any::<bool>(),
    ) -> (Quadratic<2>, Phase) {
        let slopes = if slopes[0] + slopes[1] < 0.1 { [1.0, 2.0] } else { slopes };
        let speeds: [f64; 2] = if speeds[0] + speeds[1] == 0.0 { [0.0, 10.0] } else { speeds };
        let sign = if flip { -1.0 } else { 1.0 };
        let x = [0.0, 0.5 * width * slopes[0], 0.5 * width * (slopes[0] + slopes[1])];
        let piece: Quadratic<2> =
            Quadratic { control: std::array::from_fn(|i| [sign * x[i], control[i][1]]), width };
        let (u0, u1) = (width * cut[0].min(cut[1]) * 0.8, width * (0.8 * cut[0].max(cut[1]) + 0.1));
        let tangent = |u: f64| {
            let (from, to) = piece.end_tangents();
            [0, 1].map(|k| from[k] + (to[k] - from[k]) * u / width)
        };
        let (g0, g1) = (tangent(u0), tangent(u1));
        let (x0, x1) = (g0[0].abs(), g1[0].abs());
        let law = PhaseLaw::from_number(law).unwrap();
        let way = 0.5 * (x0 + x1) * (u1 - u0);
        let v = 10.0 * speeds[0].max(0.5);
        let p = |speed: f64, g: f64| (speed / g).powi(2);
        let mut phase = phase(law, 0.0, (u0, u1), (v * v, v * v), (u1 - u0) / v);
        match law {
            PhaseLaw::AxisAcceleration => {
                // Where x' = 0, X has no speed at any finite p.
                let (v0, v1) = (speeds[0] * f64::from(x0 > 1e-6), speeds[1] * f64::from(x1 > 1e-6));
                let v1 = if v0 + v1 == 0.0 { 0.01 } else { v1 };
                phase.duration = 2.0 * way / (v0 + v1);
                phase.value = sign * (v1 - v0) / phase.duration;
                (phase.p0, phase.p1) = (p(v0, x0.max(1e-6)), p(v1, x1.max(1e-6)));
            }
            PhaseLaw::AxisVelocity => (phase.value, phase.duration) = (v * v, way / v),
            PhaseLaw::Feed => (phase.value, phase.duration) = (v * v, length(&piece, u0, u1) / v),
            PhaseLaw::ParameterAcceleration => {
                (phase.p0, phase.p1) = (v * v, speeds[1] * speeds[1]);
                phase.value = 0.5 * (phase.p1 - phase.p0) / (u1 - u0);
                phase.duration = 2.0 * (u1 - u0) / (v + speeds[1]);
            }
            PhaseLaw::SpeedLine => {
                let line = speeds.map(|speed| (10.0 * speed.max(10.0)).powi(2));
                let square = |u: f64| norm(&tangent(u)).powi(2);
                (phase.p0, phase.p1) = (line[0] / square(u0), line[1] / square(u1));
                let at = |u: f64| line[0] + (line[1] - line[0]) * (u - u0) / (u1 - u0);
                phase.duration = simpson(|u| (square(u) / at(u)).sqrt(), u0, u1);
            }
            PhaseLaw::PathJerk => {
                // v is a quadratic polynomial of time with these Bernstein coefficients; from rest also without a pull.
                let b = [speeds[0], 0.5 * inner[0] * (speeds[0] + speeds[1]), speeds[1]];
                phase.duration = 3.0 * length(&piece, u0, u1) / (b[0] + b[1] + b[2]);
                (phase.p0, phase.p1) = (p(b[0], norm(&g0)), p(b[2], norm(&g1)));
                (phase.a0, phase.a1) = (2.0 * (b[1] - b[0]) / phase.duration, 2.0 * (b[2] - b[1]) / phase.duration);
                phase.value = (phase.a1 - phase.a0) / phase.duration;
            }
            PhaseLaw::SpeedCubic => {
                let b = [speeds[0], 10.0 * inner[0], 10.0 * inner[1], speeds[1]].map(|v| (1.0 + v).powi(2));
                let way = length(&piece, u0, u1);
                (phase.p0, phase.p1) = (p(b[0].sqrt(), norm(&g0)), p(b[3].sqrt(), norm(&g1)));
                (phase.a0, phase.a1) = (1.5 * (b[1] - b[0]) / way, 1.5 * (b[3] - b[2]) / way);
                let at = |x: f64| {
                    let y = 1.0 - x;
                    y * y * (y * b[0] + 3.0 * x * b[1]) + x * x * (3.0 * y * b[2] + x * b[3])
                };
                phase.duration = simpson(|x| way / at(x).sqrt(), 0.0, 1.0);
            }
        }
        (piece, phase)
    }
}

fn simpson(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let n = 2000;
    let h = (b - a) / n as f64;
    let weight = |i: usize| {
        if i == 0 || i == n {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    (0..=n).map(|i| weight(i) * f(a + i as f64 * h)).sum::<f64>() * h / 3.0
}

fn length(piece: &Quadratic<2>, a: f64, b: f64) -> f64 {
    let (from, to) = piece.end_tangents();
    simpson(|u| norm(&[0, 1].map(|k| from[k] + (to[k] - from[k]) * u / piece.width)), a, b)
}

/// Whether the phase is smooth enough for differences over a thousandth of it.
fn tame(piece: &Quadratic<2>, phase: &Phase) -> bool {
    let (from, to) = piece.end_tangents();
    let change = norm(&sub(&to, &from)) * (phase.u1 - phase.u0) / piece.width;
    (0..=50).all(|i| {
        let u = phase.u0 + (phase.u1 - phase.u0) * i as f64 / 50.0;
        (from[0] + (to[0] - from[0]) * u / piece.width).abs() > 0.1 * change + 1e-3
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn place_and_time_undo_each_other((piece, phase) in any_phase(), at in 0.0..1.0f64, by in 0..4usize) {
        let curve = raised(&piece, by);
        let motion = motion(&curve, &phase);
        let t = at * phase.duration;
        let state = motion.at_time(t, 1e-3 * phase.duration);
        prop_assert!((phase.u0..=phase.u1).contains(&state.u));
        prop_assert_eq!(motion.at_time(0.0, 1e-3).u, phase.u0);
        prop_assert_eq!(motion.at_time(phase.duration, 1e-3).u, phase.u1);
        prop_assert!(state.iterations <= 30 && state.error < 1e-12);
        if tame(&piece, &phase) {
            let again = motion.at(state.u).pace.t;
            // Next to a standstill, a rounding error of 1e-13 in the position is an error of √1e-13 in the time.
            let slack = if (1e-3..=1.0 - 1e-3).contains(&at) { 1e-9 } else { 1e-6 };
            prop_assert!((again - t).abs() <= slack * phase.duration, "{again} {t}");
        }
    }

    #[test]
    fn the_way_of_the_governing_axis_is_its_speed_in_time(
        (piece, phase) in any_phase(), at in 0.0..1.0f64, by in 0..4usize
    ) {
        if !matches!(phase.law, PhaseLaw::AxisAcceleration | PhaseLaw::AxisVelocity) {
            return Ok(());
        }
        let curve = raised(&piece, by);
        let motion = motion(&curve, &phase);
        let t = at * phase.duration;
        let [v0, v1] = [phase.u0, phase.u1].map(|u| motion.rates(&motion.at(u)).velocity[0]);
        if phase.law == PhaseLaw::AxisAcceleration {
            prop_assert!(v0 != 0.0 || phase.p0 == 0.0);
            prop_assert!(phase.p0 != 0.0 || v0 == 0.0, "{v0:e} from rest");
            prop_assert!(phase.p1 != 0.0 || v1 == 0.0, "{v1:e} at rest");
        }
        let a = if phase.law == PhaseLaw::AxisAcceleration { phase.value } else { 0.0 };
        let way = motion.sample(&motion.at_time(t, 1e-3)).0[0] - piece.point(phase.u0)[0];
        prop_assert!((way - (v0 * t + 0.5 * a * t * t)).abs() <= 2e-8 * (1.0 + way.abs()), "{way}");
    }

    #[test]
    fn every_rate_is_the_derivative_of_the_one_before(
        (piece, phase) in any_phase(), at in 0.1..0.9f64, by in 0..4usize
    ) {
        if !tame(&piece, &phase) {
            return Ok(());
        }
        let curve = raised(&piece, by);
        let motion = motion(&curve, &phase);
        let (t, h) = (at * phase.duration, 1e-4 * phase.duration);
        let [before, here, after]: [State; 3] = [t - h, t, t + h].map(|t| motion.at_time(t, h));
        let rates = [&before, &here, &after].map(|state| motion.rates(state));
        let slope = |a: [f64; 2], b: [f64; 2]| sub(&b, &a).map(|d| d / (2.0 * h));
        let close = |found: [f64; 2], expected: [f64; 2], scale: f64| {
            norm(&sub(&found, &expected)) <= 1e-3 * (norm(&expected) + scale)
        };
        let scale = norm(&rates[1].velocity) / phase.duration;
        prop_assert!(close(slope(motion.sample(&before).0, motion.sample(&after).0), rates[1].velocity, 0.0));
        prop_assert!(close(slope(rates[0].velocity, rates[2].velocity), rates[1].acceleration, scale));
        prop_assert!(close(slope(rates[0].acceleration, rates[2].acceleration), rates[1].jerk, scale / phase.duration));
    }
}
