//! Finds where a subrun can hold its feed, before the solver runs, at the cost of a few sums for each part.
//!
//! A part can be passed at its feed v if |q'| v ≤ V, |q''| v² ≤ A and |q'''| v³ ≤ J for every axis, with bounds on the
//! derivatives that are proven over the whole piece. The speed envelope r = w^(3/4) (`speed_envelope`) over all parts gives the
//! distance from slower places within which v is certainly reached: it rises more slowly than the optimum. Beyond these distances
//! v is the optimum, and there is nothing to solve. The remaining stretches lead from one held feed to the next and are
//! independent of one another.

use feedplan_geometry::elementary::Elementary;

use super::speed_envelope::{Change, Slopes, ROUNDING};
use crate::arc_length_path::{path_point, piece, ArcLengthPath, Junction};
use crate::path_limits::{bounded_until, Curve, Shape};
use crate::path_problem::{End, Geometry, Limits, PathPoint, PathPoints, SpeedCap};
use feedplan_geometry::parallel::map;
use feedplan_geometry::quadratic::norm;
use feedplan_geometry::spline::Piece;
use feedplan_planner::problem::Problem;

/// Closely computed bounds exceed the derivatives by about this fraction.
const ACCURACY: f64 = 0.2;
/// Looser bounds are accepted if they leave this fraction of acceleration and jerk for changes of speed.
const EASY: f64 = 0.8;
/// A planned stretch continues at the held feed for this many lengths over which r doubles at its greatest slope: the optimum may
/// slow down to gain acceleration before the feed rises, and the first plan is smoothed over such a length.
const MARGIN: f64 = 1.5;
/// A stretch ends at a knot if there is one within this fraction of the margin.
const NEAR: f64 = 0.5;
/// It also ends at a knot on the other side within this fraction of that distance, to avoid very short intervals.
const HARDLY: f64 = 0.05;
/// Least number of parts that one thread takes at a time.
const TOGETHER: usize = 64;

/// A stretch between two arc lengths of a subrun in mm, with the states at its ends.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    pub ends: [f64; 2],
    pub states: [End; 2],
    /// The feed in mm/s, if the whole stretch is passed at it; None if the stretch is to be planned.
    pub held: Option<f64>,
}

/// A stretch as a path of its own, by the arc length from the start of its first part. It owns the tables that its plan needs.
pub struct Between<'a, 'b, const M: usize> {
    pub path: ArcLengthPath<'a, M>,
    knots: Vec<f64>,
    /// The knots of the subrun that correspond to the knots of `path`.
    outer: &'b [f64],
}

impl<'a, 'b, const M: usize> Between<'a, 'b, M> {
    pub fn new(subrun: &'b ArcLengthPath<'a, M>, ends: [f64; 2]) -> Self {
        let (path, first) = subrun.between(ends);
        let outer = &subrun.knots()[first..=first + path.parts.len()];
        let mut own = Self { path, knots: vec![], outer };
        let inner = &own.path.knots()[1..own.path.parts.len()];
        own.knots = [&[own.within(ends[0])], inner, &[own.within(ends[1])]].concat();
        own
    }

    /// Converts an arc length of the subrun to one of the stretch.
    pub fn within(&self, s: f64) -> f64 {
        moved(self.outer, self.path.knots(), s)
    }

    /// Converts an arc length of the stretch to one of the subrun.
    pub fn outside(&self, s: f64) -> f64 {
        moved(self.path.knots(), self.outer, s)
    }
}

/// Converts the arc length s between corresponding knots: the result is as far from its knot in `to` as s from the last knot of
/// `from` before it.
fn moved(from: &[f64], to: &[f64], s: f64) -> f64 {
    let knot = from.partition_point(|&knot| knot <= s).max(1) - 1;
    to[knot] + (s - from[knot])
}

impl<const M: usize> Geometry<M> for Between<'_, '_, M> {
    fn knots(&self) -> &[f64] {
        &self.knots
    }

    fn at(&self, piece: usize, s: f64) -> PathPoint<M> {
        self.path.at(piece, s)
    }

    fn at_four(&self, piece: usize, s: [f64; 4]) -> PathPoints<M> {
        self.path.at_four(piece, s)
    }
}

/// What is known of a part before the solver runs.
#[derive(Clone, Copy, Debug)]
struct Look {
    length: f64,
    /// The greatest r; that of the feed if it can be held.
    cap: f64,
    /// The feed that can be held, in mm/s; 0 if there is none.
    feed: f64,
    /// The fraction of the limits of acceleration and jerk that holding the feed leaves for changes of speed.
    ease: f64,
    /// Whether the cap of the envelope reaches the feed as well.
    easy: bool,
}

/// Divides a subrun into stretches, in order: those that hold a feed and those that are to be planned.
pub fn stretches<const M: usize>(
    problem: &Problem<M>,
    path: &ArcLengthPath<M>,
    limits: &Limits<M>,
    junctions: &[Junction],
    ends: [End; 2],
) -> Vec<Stretch> {
    let knots = path.knots();
    let moving = moving(problem, path, [0.0, path.total()]);
    let slopes = Slopes::new(limits, &[directions(&moving); 2], path.total());
    let steepest = Slopes::steepest(limits, &moving);
    let shares = shares(path, junctions);
    let look = |part: usize| {
        problem.watch.check_at(part);
        look(problem, path, limits, steepest, (part, shares[part]))
    };
    let looks: Vec<Look> = map(path.parts.len(), TOGETHER, look);
    let r = envelope(&looks, junctions, slopes, ends.map(|end| end.speed()));
    let mut out: Vec<Stretch> = vec![];
    let (mut from, mut state) = (0.0, ends[0]);
    let mut first = 0;
    while first < looks.len() {
        let feed = looks[first].feed;
        let mut end = first + 1;
        while end < looks.len() && looks[end].feed == feed && junctions[end - 1].cap.speed >= feed {
            end += 1;
        }
        if feed > 0.0 {
            let most = feed.power(1.5);
            let own = &looks[first..end];
            let left = reached(own.iter(), slopes, [r[first], most], Change::Rise);
            let right = reached(own.iter().rev(), slopes, [r[end], most], Change::Fall);
            let near = NEAR * MARGIN * slopes.length(most);
            if let (Some(left), Some(right)) = (left, right) {
                let at = [(knots[first] + left, near), (knots[end] - right, -near)];
                let [start, stop] = at.map(|(s, near)| to_knot(&knots[first..=end], s, near));
                if stop - start > near {
                    let even = End::Held { speed: feed };
                    out.push(Stretch { ends: [from, start], states: [state, even], held: None });
                    out.push(Stretch { ends: [start, stop], states: [even; 2], held: Some(feed) });
                    (from, state) = (stop, even);
                }
            }
        }
        first = end;
    }
    out.push(Stretch { ends: [from, path.total()], states: [state, ends[1]], held: None });
    out
}

/// Whether each axis moves between two arc lengths of a path.
pub fn moving<const M: usize>(
    problem: &Problem<M>,
    path: &ArcLengthPath<M>,
    [from, to]: [f64; 2],
) -> [bool; M] {
    let mut moving = [false; M];
    for part in &path.parts[path.part(from)..=path.part(to)] {
        for (all, own) in moving.iter_mut().zip(moves(&piece(problem, part.piece))) {
            *all |= own;
        }
    }
    moving
}

/// The speed caps of a path between two arc lengths, and those before and after that reach into this range.
pub fn caps_between(caps: &[SpeedCap], [from, to]: [f64; 2]) -> &[SpeedCap] {
    let reaches = |cap: &SpeedCap| cap.s + cap.reach > from && cap.s - cap.reach < to;
    let mut first = caps.partition_point(|cap| cap.s < from);
    while first > 0 && reaches(&caps[first - 1]) {
        first -= 1;
    }
    let mut end = caps.partition_point(|cap| cap.s <= to);
    while end < caps.len() && reaches(&caps[end]) {
        end += 1;
    }
    &caps[first..end]
}

/// For each part of the path, the greatest fraction by which the limits of jerk are lowered somewhere on it.
fn shares<const M: usize>(path: &ArcLengthPath<M>, junctions: &[Junction]) -> Vec<f64> {
    let mut shares = vec![0.0_f64; path.parts.len()];
    for Junction { cap, .. } in junctions.iter().filter(|junction| junction.cap.share > 0.0) {
        let [first, last] = [cap.s - cap.reach, cap.s + cap.reach].map(|s| path.part(s));
        for share in &mut shares[first..=last] {
            *share = share.max(cap.share);
        }
    }
    shares
}

fn look<const M: usize>(
    problem: &Problem<M>,
    path: &ArcLengthPath<M>,
    limits: &Limits<M>,
    k: f64,
    (part, share): (usize, f64),
) -> Look {
    let (at, length) = (&path.parts[part], path.knots()[part + 1] - path.knots()[part]);
    let i = at.piece;
    let feed = problem.feed[i];
    let own = piece(problem, i);
    // The cap of r by those fractions of the limits that the envelope uses.
    let cap_of = |shape: &Shape<M>| {
        let point = |sign: usize| PathPoint {
            first: shape.first[sign],
            second: shape.second[sign].map(|bend| if sign == 0 { bend } else { -bend }),
            third: shape.third,
            speed_cap: feed,
        };
        limits.envelope_cap(&point(0), k).min(limits.envelope_cap(&point(1), k))
    };
    let most = feed.power(1.5);
    let is_easy = |shape: &Shape<M>| share == 0.0 && cap_of(shape) >= (1.0 - ROUNDING) * most;
    let points = || {
        let samples = [0.0, 0.5, 1.0].map(|part| at.u[0] + part * (at.u[1] - at.u[0]));
        samples.map(|u| path_point(problem, i, u))
    };
    let held = |shape: &Shape<M>| {
        let [a, j] = uses(limits, shape, feed)?;
        let j = j / (1.0 - share);
        let fits = a <= 1.0 && j <= 1.0 && path.chord_speed(shape.curvature) >= feed;
        fits.then(|| Look { length, cap: most, feed, ease: 1.0 - a.max(j), easy: is_easy(shape) })
    };
    let plain = feed.is_finite() && problem.tip.is_none() && problem.way.is_none();
    if plain && problem.share(i).is_none() {
        let rough = match path.direction(part) {
            Some(direction) => Some(Shape::of(&direction, &[0.0; M], &[0.0; M])),
            None => rough(&own),
        };
        let leaves_enough = |look: &Look| look.easy || look.ease >= EASY;
        if let Some(look) = rough.and_then(|shape| held(&shape)).filter(leaves_enough) {
            return look;
        }
        let is_held =
            |point: &PathPoint<M>| held(&Shape::of(&point.first, &point.second, &point.third)).is_some();
        if path.direction(part).is_none() && points().iter().all(is_held) {
            let curve = Curve { joints: own.control, tip: None, weight: own.weights };
            let enough = |shape: &Shape<M>| held(shape).is_some_and(|look| leaves_enough(&look));
            if let Some(look) = held(&bounded_until(&curve, ACCURACY, enough)) {
                return look;
            }
        }
    }
    let caps = points().map(|point| limits.envelope_cap(&point, k));
    let cap = caps.iter().fold(f64::INFINITY, |least, &cap| if cap >= 0.0 { least.min(cap) } else { 0.0 });
    Look { length, cap, feed: 0.0, ease: 1.0, easy: false }
}

/// The use of the limits of acceleration and jerk at the constant speed v. None if v exceeds a velocity limit or a use is not
/// finite.
fn uses<const M: usize>(limits: &Limits<M>, shape: &Shape<M>, v: f64) -> Option<[f64; 2]> {
    let [mut a, mut j] = [0.0_f64; 2];
    for k in 0..M {
        for sign in 0..2 {
            if shape.first[sign][k] * v > limits.velocity[sign][k] {
                return None;
            }
            a = a.max(shape.second[sign][k] * v * v / limits.acceleration[sign][k]);
        }
        j = j.max(shape.third[k] * v * v * v / limits.jerk[k]);
    }
    (a.is_finite() && j.is_finite()).then_some([a, j])
}

/// Bounds on the derivatives of a polynomial piece, the same for all axes that move, from the lengths of the
/// coefficients of C', C'' and C'''. With these at most a, b, c and C' at least d along the chord,
///
///   |q''| ≤ b/d²,   |q'''| ≤ c/d³ + 3 a b²/d⁵ + a² (5 a b² + a² c)/d⁷
///
/// by the formulas in the head of `arc_length_path`. None for rational pieces and where C' may vanish.
fn rough<const M: usize>(piece: &Piece<M>) -> Option<Shape<M>> {
    if piece.is_rational() {
        return None;
    }
    let degree = piece.degree();
    let mut coefficients = [[0.0; M]; feedplan_geometry::spline::MAX_DEGREE + 1];
    coefficients[..=degree].copy_from_slice(piece.control);
    let chord: [f64; M] = std::array::from_fn(|k| piece.control[degree][k] - piece.control[0][k]);
    let length = norm(&chord);
    let mut least = f64::INFINITY;
    let mut most = [0.0_f64; 3];
    for order in 0..degree.min(3) {
        let rate = (degree - order) as f64 / piece.width;
        for n in 0..degree - order {
            for k in 0..M {
                coefficients[n][k] = rate * (coefficients[n + 1][k] - coefficients[n][k]);
            }
            if order == 0 {
                let along: f64 = (0..M).map(|k| coefficients[n][k] * chord[k]).sum();
                least = least.min(along / length);
            }
            most[order] = most[order].max(norm(&coefficients[n]));
        }
    }
    let ([a, b, c], d) = (most, least);
    if d.is_nan() || d <= 0.0 {
        return None;
    }
    let second = b / (d * d);
    let third =
        c / d.powi(3) + 3.0 * a * b * b / d.powi(5) + a * a * (5.0 * a * b * b + a * a * c) / d.powi(7);
    let first = directions(&moves(piece));
    let all = |most: f64| first.map(|moves| most * moves);
    Some(Shape { first: [first; 2], second: [all(second); 2], third: all(third), curvature: second })
}

/// Whether each axis moves on a piece.
fn moves<const M: usize>(piece: &Piece<M>) -> [bool; M] {
    std::array::from_fn(|k| piece.control.iter().any(|point| point[k] != piece.control[0][k]))
}

/// An upper bound of |q'| of each axis: 1 if it moves.
fn directions<const M: usize>(moves: &[bool; M]) -> [f64; M] {
    moves.map(|moves| if moves { 1.0 } else { 0.0 })
}

/// r at the knots: at most what the parts and junctions allow, and what can be reached from the neighbouring knots.
fn envelope(looks: &[Look], junctions: &[Junction], slopes: Slopes, speeds: [f64; 2]) -> Vec<f64> {
    let count = looks.len();
    let mut r = vec![0.0; count + 1];
    for (i, r) in r.iter_mut().enumerate() {
        let junction = if i == 0 {
            speeds[0]
        } else if i == count {
            speeds[1]
        } else {
            junctions[i - 1].cap.speed
        };
        let beside = looks[i.saturating_sub(1)].cap.min(looks[i.min(count - 1)].cap);
        *r = beside.min(junction.power(1.5));
    }
    for i in 0..count {
        r[i + 1] = r[i + 1].min(slopes.far(r[i], looks[i].ease * looks[i].length, Change::Rise));
    }
    for i in (0..count).rev() {
        r[i] = r[i].min(slopes.far(r[i + 1], looks[i].ease * looks[i].length, Change::Fall));
    }
    r
}

/// The distance from one end of some parts that hold a feed to the place where the envelope has reached the feed and has
/// continued on easy parts for the margin; None if there is no such place.
fn reached<'a>(
    looks: impl Iterator<Item = &'a Look>,
    slopes: Slopes,
    [from, most]: [f64; 2],
    change: Change,
) -> Option<f64> {
    let margin = MARGIN * slopes.length(most);
    let mut missing = slopes.distance([from, most], change);
    let (mut at, mut even) = (0.0, 0.0);
    for look in looks {
        let mut left = look.length;
        if missing > look.ease * left {
            missing -= look.ease * left;
            at += left;
            continue;
        }
        if missing > 0.0 {
            let step = missing / look.ease;
            (missing, at, left) = (0.0, at + step, left - step);
        }
        if look.easy && even + left >= margin {
            return Some(at + margin - even);
        }
        (at, even) = (at + left, if look.easy { even + left } else { 0.0 });
    }
    None
}

/// The first knot up to `distance` ahead of s (behind it if negative), or up to the fraction `HARDLY` of that on the other side;
/// s if there is none.
fn to_knot(knots: &[f64], s: f64, distance: f64) -> f64 {
    let [a, b] = [s - HARDLY * distance, s + distance];
    let next = knots.partition_point(|&knot| knot < a.min(b));
    knots.get(next).copied().filter(|&knot| knot <= a.max(b)).unwrap_or(s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arc_length_path::Part;
    use crate::path_limits::bounded;
    use proptest::prelude::*;

    const LIMITS: Limits<2> =
        Limits { velocity: [[250.0; 2]; 2], acceleration: [[3000.0; 2]; 2], jerk: [50_000.0; 2] };

    fn looked(control: &[[f64; 2]], feed: &[f64]) -> Vec<Stretch> {
        on_path(control, feed, |problem, path| {
            stretches(problem, path, &LIMITS, &path.junctions(&LIMITS.jerk), [End::Rest; 2])
        })
    }

    /// Does `work` on one run from rest to rest, with a piece for each feed; the control points are divided equally among the
    /// pieces.
    fn on_path<T>(
        control: &[[f64; 2]],
        feed: &[f64],
        work: impl FnOnce(&Problem<2>, &ArcLengthPath<2>) -> T,
    ) -> T {
        let count = control.len() / feed.len();
        let offset: Vec<usize> = (0..=feed.len()).map(|i| i * count).collect();
        let problem = Problem {
            control,
            weight: &[],
            offset: &offset,
            width: &vec![1.0; feed.len()],
            tip: None,
            way: None,
            feed_share: &[],
            runs: &[0, feed.len()],
            feed,
            junction_speed: &vec![f64::INFINITY; feed.len() + 1],
            max_velocity: LIMITS.velocity,
            max_acceleration: LIMITS.acceleration,
            chord_tolerance: f64::INFINITY,
            period: 0.001,
            start_speed: 0.0,
            end_speed: 0.0,
            watch: Default::default(),
        };
        let parts: Vec<Part> = (0..feed.len()).map(|piece| Part { piece, u: [0.0, 1.0] }).collect();
        work(&problem, &ArcLengthPath::new(&problem, &parts))
    }

    #[test]
    fn a_stretch_after_a_long_way_has_the_digits_of_its_own_lengths() {
        // 600 m there and back, then three lines of a tenth of a micrometre.
        let mut control = vec![[0.0, 0.0], [3e5, 0.0], [3e5, 0.0], [0.0, 0.0]];
        for i in 0..3 {
            control.extend([i, i + 1].map(|end| [0.0, 1e-4 * f64::from(end)]));
        }
        on_path(&control, &[50.0; 5], |_, path| {
            let knots = path.knots();
            let off = |knots: &[f64]| ((knots[1] - knots[0]) / 1e-4 - 1.0).abs();
            assert!(off(&knots[2..]) > 1e-9);
            let own = Between::new(path, [knots[2], path.total()]);
            assert!(own.knots().windows(2).all(|pair| off(pair) < 1e-12), "{:?}", own.knots());
            assert_eq!((own.within(knots[3]), own.outside(own.knots()[2])), (own.knots()[1], knots[4]));
            // A stretch may also begin and end within parts.
            let own = Between::new(path, [knots[2] + 4e-5, knots[4] + 4e-5]);
            assert_eq!(own.knots().len(), 4);
            assert!((own.knots()[0] - 4e-5).abs() < 1e-9 && (own.knots()[3] - 2.4e-4).abs() < 1e-9);
        });
    }

    #[test]
    fn lines_hold_their_feeds_between_stretches_that_change_them() {
        let control = [[0.0, 0.0], [100.0, 0.0], [100.0, 0.0], [200.0, 0.0], [200.0, 0.0], [200.5, 0.0]];
        let found = looked(&control, &[50.0, 20.0, 80.0]);
        let held: Vec<Option<f64>> = found.iter().map(|stretch| stretch.held).collect();
        // The last line is too short for its feed.
        assert_eq!(held, [None, Some(50.0), None, Some(20.0), None]);
        assert!(found.windows(2).all(|pair| pair[0].ends[1] == pair[1].ends[0]));
        assert_eq!((found[0].ends[0], found[4].ends[1]), (0.0, 200.5));
        // From rest to 50 mm/s takes at least √(50³/50 000) = 1.58 mm; half the margin follows.
        let [_, at] = found[0].ends;
        assert!((1.6..15.0).contains(&at), "{at} mm to 50 mm/s");
    }

    #[test]
    fn a_bend_too_sharp_for_its_feed_is_planned() {
        // Lines of two pieces each, and a quarter of a turn of about a millimetre between. No feed is held beside the
        // bend, where the jump of the curvature lowers the limits of jerk.
        let line = |from: [f64; 2], step: [f64; 2]| {
            std::array::from_fn::<_, 4, _>(|i| [0, 1].map(|k| from[k] + i as f64 * step[k]))
        };
        let control = [
            line([0.0, 0.0], [10.0, 0.0]),
            line([30.0, 0.0], [10.0, 0.0]),
            [[60.0, 0.0], [60.55, 0.0], [61.0, 0.45], [61.0, 1.0]],
            line([61.0, 1.0], [0.0, 10.0]),
            line([61.0, 31.0], [0.0, 10.0]),
        ]
        .concat();
        let held: Vec<bool> = looked(&control, &[50.0; 5]).iter().map(|own| own.held.is_some()).collect();
        assert_eq!(held, [false, true, false, true, false]);
    }

    proptest! {
        #[test]
        fn rough_bounds_are_bounds(
            bends in prop::collection::vec(prop::array::uniform2(-0.3..0.3f64), 6),
            degree in 1..=5usize,
        ) {
            let mut control = vec![[0.0; 2]];
            for bend in &bends[..degree] {
                let last = control[control.len() - 1];
                control.push([last[0] + 1.0 + bend[0], last[1] + bend[1]]);
            }
            let piece = Piece { control: &control, weights: &[], width: 2.0 };
            let bound = rough(&piece).expect("a bound");
            let close = bounded(&Curve { joints: &control, tip: None, weight: &[] }, 0.01);
            for k in 0..2 {
                for sign in 0..2 {
                    prop_assert!(close.second[sign][k] <= 1.02 * bound.second[sign][k] + 1e-9);
                }
                prop_assert!(close.third[k] <= 1.02 * bound.third[k] + 1e-9);
            }
        }
    }
}
