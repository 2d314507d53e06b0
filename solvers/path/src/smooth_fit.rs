//! Fits a C4 quintic B-spline to a run of lines: the curve of least energy in the tolerance tube, with certified distances both
//! ways. The method is our own.
//!
//! | file | what it computes |
//! |---|---|
//! | `curve` | the curve as pieces, and the chords that each piece follows |
//! | `polyline` | what the curve follows: vertices, stations, directions, tolerances |
//! | `bends` | the weights that pull the curve to vertices, so that bends keep their size |
//! | `pace` | the energy of the curve at the speed of a motion |
//! | `size` | the greatest length of an interval at each place of the polyline, and the knots |
//! | `spline`, `bezier` | the spline, its basis and derivatives; its Bézier pieces and their bounds |
//! | `rows` | the tolerance tube as linear rows |
//! | `problem`, `band`, `interior_point` | the solution of the convex problem in a window |
//! | `quads` | the rows of four neighbouring intervals in SIMD vectors |
//! | `windows` | all windows of a run in parallel, then the seams between them |
//! | `certificate` | a proof of the distances both ways, and that the curve never stops |
//! | `offsets` | on which side of the polyline the curve lies |
//! | `refine` | halves intervals where the certificate fails |
//! | `corner` | a curve of its own for each corner, where refinement does not help |
//!
//! The parameter u of the curve is the length of the chords in mm, so that a station leads to the line of the program and its
//! feed. D is the number of axes that move, ε the tolerance. Time and memory are linear in the number of vertices.

mod band;
mod bends;
mod bezier;
mod certificate;
mod corner;
mod curve;
mod interior_point;
mod offsets;
pub mod pace;
pub mod polyline;
mod problem;
mod quads;
mod refine;
mod rows;
mod size;
mod spline;
mod windows;

use bezier::split;
use certificate::Certificate;
use corner::append_corners;
pub use curve::{Covered, Smooth};
use feedplan_geometry::instances;
use feedplan_geometry::quadratic::{dot, norm, sub};
use feedplan_geometry::watch::Watch;
pub use offsets::Offsets;
use polyline::Polyline;
use spline::DEGREE;
use std::ops::Range;
use windows::{Fit, FREE};

/// Intervals are halved at most this many times.
const REFINEMENTS: usize = 3;
/// A run that cannot be fitted is split at most this many times; after that all its corners are rounded one by one.
const PARTINGS: usize = 3;
/// A run whose vertices are all within this distance of a line, in tolerances, becomes that line.
const STRAIGHT: f64 = 1e-3;
/// The rounding error of the third derivative of a quintic, times its width cubed, in parts of the greatest coordinate.
const ROUNDING: f64 = 240.0 * f64::EPSILON;
/// The rounding error of the third derivative that a part of an interval may have, times the square of the interval's width.
const KNOWN: f64 = 1e-3;

/// How a run is fitted.
#[derive(Clone, Copy, Debug)]
pub struct SmoothOptions<const D: usize> {
    /// Chords longer than this, in mm, become straight in their middle.
    pub long: f64,
    /// Least and greatest position of each axis. Where no curve stays between them, corners are rounded one by one.
    pub bounds: [[f64; 2]; D],
}

instances! {
    /// The fit of a polyline, for other crates.
    pub trait SmoothFit for [2, 3, 6] Polyline<M> = {
        /// The curve along this polyline; see `smooth_fit`.
        fn fit(&self, cut: &[bool], options: &SmoothOptions<M>, watch: Watch) -> Smooth<M> = smooth_fit;
    }
}

/// The curve along a polyline of one chord or more. It is cut into pieces near the vertices for which `cut` is true.
///
/// The polyline must be split beforehand where it turns back: no curve passes such a vertex without a stop.
pub(crate) fn smooth_fit<const D: usize>(
    line: &Polyline<D>,
    cut: &[bool],
    options: &SmoothOptions<D>,
    watch: Watch,
) -> Smooth<D> {
    let mut out = Smooth::default();
    // A polyline whose length is infinite or NaN cannot be fitted.
    let partings = if line.length().is_finite() { PARTINGS } else { 0 };
    Run { line, cut, options, watch: watch.each(line.chords()) }.fit(0..line.chords(), partings, &mut out);
    out
}

struct Run<'a, const D: usize> {
    line: &'a Polyline<D>,
    cut: &'a [bool],
    options: &'a SmoothOptions<D>,
    /// Counts chords.
    watch: Watch<'a>,
}

impl<const D: usize> Run<'_, D> {
    /// Appends the curve along some chords. Where the fit fails, corners are rounded one by one, and the chords between these
    /// places are fitted again, up to `partings` times.
    fn fit(&self, chords: Range<usize>, partings: usize, out: &mut Smooth<D>) {
        if chords.is_empty() {
            return;
        }
        if let Some(deviation) = self.straight(&chords) {
            return out.after_stop(|out| self.append_line(&chords, deviation, out));
        }
        if partings == 0 {
            return self.leave_corners(chords, out);
        }
        let part = self.line.part(chords.start, chords.end);
        let (fit, pieces, certificate) = self.refined(&part);
        if certificate.good.iter().all(|&good| good) {
            out.offsets.merge(&Offsets::of(&part, &fit.spline.knots, &pieces, &certificate.foot, self.watch));
            return out.after_stop(|out| self.append_spline(&chords, &fit, &pieces, &certificate, out));
        }
        let mut next = chords.start;
        for zone in zones(&part, &fit.spline.knots, &certificate) {
            let zone = zone.start + chords.start..zone.end + chords.start;
            self.fit(next..zone.start, partings - 1, out);
            next = zone.end;
            self.leave_corners(zone, out);
        }
        self.fit(next..chords.end, partings - 1, out);
    }

    /// The fit of a part, its Bézier pieces and its certificate; refined until that holds, at most REFINEMENTS times.
    fn refined<'b>(&self, part: &'b Polyline<D>) -> (Fit<'b, D>, Vec<bezier::Control<D>>, Certificate) {
        let long = self.options.long;
        // How many refinements follow is unknown, so each one counts as half of the remaining work.
        let mut watch = self.watch.part(0.5 * part.chords() as f64);
        let mut fit = Fit::new(part, size::knots(part, long), long);
        let all = 0..fit.spline.intervals();
        fit.solve(std::slice::from_ref(&all), watch);
        let mut refinement = 0;
        loop {
            let pieces = fit.spline.pieces();
            let certificate = Certificate::new(part, &fit.spline.knots, &pieces, &self.options.bounds, watch);
            if refinement == REFINEMENTS {
                return (fit, pieces, certificate);
            }
            let mut bad = bends::missed(part, &fit.spline.knots, &pieces, &certificate.foot, watch);
            for (bad, good) in bad.iter_mut().zip(&certificate.good) {
                *bad |= !good;
            }
            if !bad.contains(&true) {
                return (fit, pieces, certificate);
            }
            let (mut next, ranges) = refine::halved(&fit, &bad, long);
            watch = watch.part(0.5);
            next.solve(&ranges, watch);
            fit = next;
            refinement += 1;
        }
    }

    /// The greatest distance in mm of the vertices from the line between the ends; None if it is above STRAIGHT tolerances at a
    /// vertex, or if a chord turns back.
    fn straight(&self, chords: &Range<usize>) -> Option<f64> {
        let line = self.line;
        let (start, end) = (line.vertex[chords.start], line.vertex[chords.end]);
        if chords.len() == 1 {
            return Some(0.0);
        }
        let way = sub(&end, &start);
        let length = norm(&way);
        let mut worst = 0.0f64;
        for i in chords.clone() {
            let away = sub(&line.vertex[i], &start);
            let along = dot(&away, &way) / (length * length);
            let off = norm(&std::array::from_fn::<f64, D, _>(|k| away[k] - along * way[k]));
            if !(dot(&line.direction[i], &way) > 0.0 && off <= STRAIGHT * line.tolerance_at(i)) {
                return None;
            }
            worst = worst.max(off);
        }
        Some(worst)
    }

    /// Appends a line, cut near the vertices for which `cut` is true.
    fn append_line(&self, chords: &Range<usize>, deviation: f64, out: &mut Smooth<D>) {
        let (start, end) = (self.line.vertex[chords.start], self.line.vertex[chords.end]);
        out.splines += 1;
        out.polynomials += 1;
        let way = sub(&end, &start);
        let length = norm(&way);
        let (mut from, mut first) = (start, chords.start);
        for i in chords.start + 1..=chords.end {
            if i < chords.end && !self.cut[i] {
                continue;
            }
            let along = dot(&sub(&self.line.vertex[i], &start), &way) / (length * length);
            let to = if i == chords.end { end } else { std::array::from_fn(|k| start[k] + along * way[k]) };
            let width = norm(&sub(&to, &from));
            if width > 0.0 {
                out.push(&[from, to], width, Covered::new(first, i - 1, deviation));
                (from, first) = (to, i);
            }
        }
    }

    fn leave_corners(&self, chords: Range<usize>, out: &mut Smooth<D>) {
        let before = out.covered.len();
        out.after_stop(|out| append_corners(self.line, chords.start, chords.end, out));
        out.splines += chords.len();
        out.polynomials += out.covered.len() - before;
        // The curve of a corner lies on its inner side, between its legs.
        for covered in &out.covered[before..] {
            out.offsets.offer(-covered.deviation);
        }
        out.corners.push(chords);
    }

    /// Appends the pieces of a spline, cut at the foot points of the vertices to cut at; neighbouring pieces that lie exactly on
    /// one long chord become one line.
    fn append_spline(
        &self,
        chords: &Range<usize>,
        fit: &Fit<D>,
        pieces: &[bezier::Control<D>],
        certificate: &Certificate,
        out: &mut Smooth<D>,
    ) {
        let knots = &fit.spline.knots;
        let Certificate { foot, deviation, .. } = certificate;
        out.splines += 1;
        // The long chord on which interval j lies exactly.
        let lies = |j: usize| {
            let pins = &fit.pin[j..=j + DEGREE];
            (pins[0] != FREE && pins.iter().all(|&pin| pin == pins[0])).then_some(pins[0] as usize)
        };
        // `chord` contains the end of what is appended; `next` is the first chord that no piece follows yet. Every chord gets a
        // piece that follows it, also a chord whose two foot points coincide.
        let last = chords.len() - 1;
        let (mut chord, mut next) = (0, 0);
        let mut push = |control: &[[f64; D]], width: f64, [first, end]: [usize; 2], j: usize| {
            let end = if j + 1 == pieces.len() && foot[end + 1] >= knots[j + 1] { last } else { end };
            let first = chords.start + first.min(next);
            out.push(control, width, Covered::new(first, chords.start + end, deviation[j]));
            next = end + 1;
        };
        let (mut j, mut polynomials) = (0, 0);
        while j < pieces.len() {
            polynomials += 1;
            let (first, start) = (j, knots[j]);
            if let Some(pinned) = lies(j) {
                while j + 1 < pieces.len() && lies(j + 1) == Some(pinned) {
                    j += 1;
                }
                push(&[pieces[first][0], pieces[j][DEGREE]], knots[j + 1] - start, [pinned; 2], j);
                (chord, j) = (pinned, j + 1);
                continue;
            }
            let (end, width) = (knots[j + 1], knots[j + 1] - start);
            let (mut from, mut rest) = (start, pieces[j]);
            let sliver = sliver(&rest, width);
            while chord < last && foot[chord + 1] <= from {
                chord += 1;
            }
            let mut begun = chord;
            while chord < last && foot[chord + 1] < end {
                let u = foot[chord + 1];
                let cut = self.cut[chords.start + chord + 1];
                if cut && u - from > sliver && end - u > sliver {
                    let (part, after) = split(&rest, (u - from) / (end - from));
                    push(&part, u - from, [begun, chord], j);
                    (from, rest, begun) = (u, after, chord + 1);
                }
                chord += 1;
            }
            push(&rest, end - from, [begun, chord], j);
            j += 1;
        }
        out.polynomials += polynomials;
    }
}

/// The least width of a part of an interval: the rounding of the control points of a shorter part would spoil its jerk.
fn sliver<const D: usize>(control: &bezier::Control<D>, width: f64) -> f64 {
    let coordinate = control.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    width * (ROUNDING * coordinate / (KNOWN * width)).cbrt()
}

/// The chords along the intervals that fail their certificate, and along one more interval on each side.
fn zones<const D: usize>(line: &Polyline<D>, knots: &[f64], certificate: &Certificate) -> Vec<Range<usize>> {
    let last = knots.len() - 1;
    let mut zones: Vec<Range<usize>> = Vec::new();
    for (j, _) in certificate.good.iter().enumerate().filter(|(_, good)| !**good) {
        let (low, high) = (knots[j.saturating_sub(1)], knots[(j + 2).min(last)]);
        let start = line.chord_at(low);
        let end = line.chord_at(high) + 1;
        match zones.last_mut() {
            Some(zone) if start <= zone.end => zone.end = end.max(zone.end),
            _ => zones.push(start..end),
        }
    }
    zones
}
