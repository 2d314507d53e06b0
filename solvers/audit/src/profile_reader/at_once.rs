//! Evaluates phases of a piece on which v² is a cubic of the length, at eight places at once in SIMD vectors.
//!
//! The results equal those of `motion` bit for bit: they use the same formulas in the same order. A place is left to `motion`
//! where the quadrature would have to halve its interval, and where the piece has no direction.

use fearless_simd::{f64x8, Select, Simd, SimdBase, SimdFloat};

use crate::motion::Passage;
use crate::nearest::Place;
use crate::number::{in_wide_vectors, Lanes};
use crate::phase_motion::ROUNDING;
use crate::phases::Phases;
use crate::quadrature::{by_gauss, by_rules, gauss_nodes, halves_by_rules, nodes, RULES_AGREE};
use crate::speed_by_length::{cubic, cubic_acceleration, square, Pace};
use crate::station::Rounded;
use crate::together::Together;
use crate::EPS;

/// Number of places evaluated at once.
pub const PLACES: usize = 8;

/// Numbers per place: seven of its phase, and u.
const NUMBERS: usize = 8;

/// The results at eight places; `since`, the time since the start of the phase in s, is NaN where a place is left to `motion`.
struct Found<const M: usize> {
    since: Lanes,
    velocity: Rounded<M, Lanes>,
    acceleration: Rounded<M, Lanes>,
}

/// Fills in the passages at places of a piece without weights, each on its own phase, on which v² is a cubic of the length.
/// Removes the places that are left to `motion`.
pub fn read<const M: usize>(
    on: &Together<M>,
    phases: &Phases,
    places: &mut Vec<(Place, usize, Passage<M>)>,
    room: &mut [Lanes],
) {
    for part in places.chunks_mut(PLACES) {
        let mut numbers = [[0.0; PLACES]; NUMBERS];
        for lane in 0..PLACES {
            let (place, i, _) = part[lane.min(part.len() - 1)];
            let [u, p] = [[phases.u0[i], phases.u1[i]], [phases.p0[i], phases.p1[i]]];
            let of_lane = [u[0], u[1], p[0], p[1], phases.a0[i], phases.a1[i], phases.duration[i], place.u];
            for (row, number) in numbers.iter_mut().zip(of_lane) {
                row[lane] = number;
            }
        }
        let found = in_wide_vectors!(simd => look(simd, on, &numbers, room));
        for (lane, (_, _, passage)) in part.iter_mut().enumerate() {
            let since = found.since[lane];
            passage.since = since;
            passage.doubt = ROUNDING * since.abs();
            passage.velocity = found.velocity.of_lane(lane);
            passage.acceleration = Some(found.acceleration.of_lane(lane));
        }
    }
    places.retain(|(.., passage)| !passage.since.is_nan());
}

#[inline(always)]
fn look<const M: usize, S: Simd>(
    simd: S,
    on: &Together<M>,
    numbers: &[Lanes; NUMBERS],
    room: &mut [Lanes],
) -> Found<M> {
    let nothing = f64x8::splat(simd, 0.0);
    let mut of = [nothing; NUMBERS];
    for row in 0..NUMBERS {
        of[row] = f64x8::from_slice(simd, &numbers[row]);
    }
    let [u0, u1, p0, p1, a0, a1, duration, u] = of;
    // Motion from the slower end, as in `Phases::by_length`.
    let (first, last) = (on.speed(u0) * p0.sqrt(), on.speed(u1) * p1.sqrt());
    let is_back = last.simd_lt(first);
    let speeds = [is_back.select(last, first), is_back.select(first, last)];
    let a = [is_back.select(a1 * -1.0, a0), is_back.select(a0 * -1.0, a1)];
    // Lengths of the phase, of its first half, and up to the place, as in `PhaseByLength`.
    let width = u1 - u0;
    let half = width * 0.5;
    let mut slopes = nodes(half, half);
    for i in 0..7 {
        slopes[i] = on.speed(is_back.select(u1 - slopes[i], u0 + slopes[i]));
    }
    let ([length, doubt], first_half) = halves_by_rules(&slopes, half);
    let are_lengths_good = doubt.abs().simd_le(length * RULES_AGREE);
    let d = is_back.select(u1 - u, u - u0);
    let nudge = u1 * EPS;
    let is_early = d.simd_lt(half - nudge);
    let (from, before) = (is_early.select(nothing, half), is_early.select(nothing, first_half));
    let reach = (d - from) * 0.5;
    let mut slopes = gauss_nodes((from + d) * 0.5, reach);
    for i in 0..3 {
        slopes[i] = on.speed(is_back.select(u1 - slopes[i], u0 + slopes[i]));
    }
    let way = d.simd_gt(from + nudge).select(before + by_gauss(slopes, reach), before);
    let way = d.simd_ge(width).select(length, way);
    // Speed and acceleration along the path, and the time, as in `SpeedByLength`.
    let (c, x) = (cubic([speeds[0] * speeds[0], speeds[1] * speeds[1]], a, length), way / length);
    let (v, a) = (square(&c, x).sqrt(), cubic_acceleration(&c, length, x));
    let half = x * 0.5;
    let mut slowness = nodes(half, half);
    for i in 0..7 {
        slowness[i] = length / square(&c, slowness[i]).sqrt();
    }
    let [time, doubt] = by_rules(&slowness, half);
    let are_times_good = doubt.abs().simd_le(time.abs() * RULES_AGREE);
    let pace = Pace { v, a: is_back.select(a * -1.0, a), j: nothing };
    // Velocities and accelerations of the columns, as in `Motion`.
    let (station, roundings) = on.rounded_station(u, room);
    let is_directed = station.slope.simd_gt(f64x8::splat(simd, on.still()));
    let (velocity, acceleration) = (station.velocity(v), station.acceleration(pace));
    let [mut unsure, unsure_acceleration] = [roundings.velocity(v), roundings.acceleration(pace)];
    for k in 0..M {
        unsure[k] += velocity[k].abs() * ROUNDING;
    }
    let is_known = are_lengths_good & are_times_good & is_directed;
    let since = is_back.select(duration - time, time);
    Found {
        since: is_known.select(since, f64x8::splat(simd, f64::NAN)).into(),
        velocity: Rounded { value: velocity, rounding: unsure }.kept(),
        acceleration: Rounded { value: acceleration, rounding: unsure_acceleration }.kept(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Columns;
    use crate::curve::{Followed, Pieces};
    use crate::joints::path::{JointPath, Words};
    use crate::motion::Motion;
    use crate::phases::SPEED_CUBIC;
    use crate::Limits;
    use proptest::prelude::*;

    /// Passages by `read` and by `Motion` at shares of a phase; places that `read` removes are left out.
    fn passages(
        control: &[f64],
        [u, speeds, a]: [[f64; 2]; 3],
        shares: &[f64],
        has_joints: bool,
    ) -> Vec<(Passage<2>, Passage<2>)> {
        let degree = control.len() / 2 - 1;
        let (offsets, width) = ([0, degree + 1], [degree as f64]);
        let pieces = Pieces { axes: 2, stride: 2, control, weights: &[], offsets: &offsets, width: &width };
        let (path, free) = (Followed::of_one(pieces), Limits::none());
        let words = Words::polar();
        let joints = JointPath::of_one(path, &words, &[1.0]);
        let mut columns = Columns::new(&path, &free, has_joints.then_some(&joints));
        let p = speeds.map(|v| v * v);
        let phases =
            Phases { a0: &a[..1], a1: &a[1..], ..Phases::of_one(&[SPEED_CUBIC], &[255], &[0.0], &u, &p) };
        let motion = Motion::new(&phases, 0, &mut columns);
        let at = |share: f64| Place { piece: 0, u: u[0] + share * (u[1] - u[0]) };
        let mut places: Vec<_> =
            shares.iter().map(|&share| (at(share), 0, Passage::unknown(at(share).u))).collect();
        let on = columns.together(0).expect("a piece without weights, in wide vectors");
        read(&on, &phases, &mut places, &mut columns.room());
        places.iter().map(|(place, _, found)| (*found, motion.passage(place.u, &mut columns))).collect()
    }

    fn bits(passage: &Passage<2>) -> Vec<u64> {
        let Passage { u, since, doubt, velocity, acceleration } = *passage;
        let acceleration = acceleration.expect("a phase by length has it");
        let vectors = [velocity.value, velocity.rounding, acceleration.value, acceleration.rounding];
        [u, since, doubt].into_iter().chain(vectors.into_iter().flatten()).map(f64::to_bits).collect()
    }

    const SHARES: [f64; 11] = [0.0, 1e-15, 0.1, 0.3, 0.499, 0.5, 0.6, 0.9, 0.99, 1.0 - 1e-15, 1.0];

    #[test]
    fn a_place_where_a_rule_is_not_enough_or_nothing_has_a_direction_is_left_out() {
        let wavy = [0.0, 0.0, 1.0, 3.0, 2.0, -3.0, 3.0, 3.0, 4.0, 0.0];
        assert!(passages(&wavy, [[0.0, 4.0], [1.0; 2], [0.0; 2]], &SHARES, false).is_empty());
        let line = [0.0, 0.0, 1.0, 0.0, 2.0, 0.0];
        let crawling = passages(&line, [[0.0, 2.0], [1e-6, 1.0], [0.0, 0.5]], &SHARES, false);
        assert!(crawling.len() < SHARES.len(), "{}", crawling.len());
        let from_a_cusp = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
        assert!(passages(&from_a_cusp, [[0.0, 1.0], [1.0; 2], [0.0; 2]], &[0.0], false).is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn a_place_that_is_read_beside_others_has_the_same_numbers_as_alone(
            bends in prop::array::uniform10(-1.0..1.0_f64),
            degree in 1..=9_usize,
            cut in 0.0..0.8_f64,
            part in -4.0..-0.7_f64,
            speed in 0.9..1.1_f64,
            a in prop::array::uniform2(-0.1..0.1_f64),
            has_joints: bool,
        ) {
            // Away from the origin, where joints have no direction.
            let control: Vec<f64> = (0..=degree).flat_map(|i| [-4.0 + i as f64, 2.0 + 0.3 * bends[i]]).collect();
            let (degree, part) = (degree as f64, 10.0_f64.powf(part));
            let u = [degree * cut, degree * (cut + part)];
            let speeds = [speed, speed + 0.5 * (a[0] + a[1]) * (u[1] - u[0]) / speed];
            let found = passages(&control, [u, speeds, a], &SHARES, has_joints);
            prop_assert!(part > 1e-3 || found.len() == SHARES.len(), "{} at {part}", found.len());
            for (beside, alone) in &found {
                prop_assert_eq!(bits(beside), bits(alone), "{:?} {:?}", beside, alone);
            }
        }
    }
}
