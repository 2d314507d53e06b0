//! A block of points between two given tangents, interpolated again and again with more features until the
//! certificate holds on every step.
//!
//! A step that fails gets its worst point as a feature (both ends of the chord, where it is the curve that
//! leaves the polygon). A step of a single chord that fails although the next points on both sides are
//! features as well cannot be helped by more of them. Then the spline gives way, in this order: it is broken
//! at the sharper end of the chord if that turns like a corner; it passes the ends of the chord at an offset,
//! so that its bulge is shared between points and chords; a tangent at its end is given up, be it prescribed
//! or free; and at last the chord becomes a line. Every change is for good, and their number is bounded, so
//! this ends; the rounds are bounded as well, against chains made to need many.

use super::breaking::turn_cosine;
use super::certificate::{Fault, Step, Verdict};
use super::pieces::{line, Pen};
use super::spline::{interpolate, End};
use super::{Chain, FittedPiece};
use feedplan_geometry::quadratic::{norm, sub};

/// From this round on, a step that fails is halved as well.
const HALVE: usize = 4;
/// From this round on, a single chord that fails becomes a line at once.
const LINES: usize = 24;
/// In this round, every spline that still fails becomes lines.
const LAST: usize = 40;
/// An offset makes a bulge of up to twice the tolerance fit; beyond that and some allowance none does.
const HOPELESS: f64 = 2.25;
/// Deviations up to this ratio are alike.
const LIKE: f64 = 1.1;
/// Largest offset of the curve from a feature, of the tolerance.
const SHIFT: f64 = 0.75;

/// A group, or a part of a long one.
pub struct Block<const M: usize> {
    features: Vec<usize>,
    ends: [End<M>; 2],
    line: bool,
    /// Starts within the group of the block before.
    pub continues: bool,
}

/// The pieces of a block, their splines numbered from 0, and whether its end tangents were kept.
pub struct FittedBlock<const M: usize> {
    pub pieces: Vec<FittedPiece<M>>,
    pub starts_smooth: bool,
    pub ends_smooth: bool,
}

impl<const M: usize> Block<M> {
    pub fn line(a: usize, b: usize) -> Self {
        Self { features: vec![a, b], ends: [End::Free; 2], line: true, continues: false }
    }

    pub fn curve(features: Vec<usize>, start: End<M>, finish: End<M>, continues: bool) -> Self {
        Self { features, ends: [start, finish], line: false, continues }
    }

    pub fn fit(&self, chain: &Chain<M>) -> FittedBlock<M> {
        if self.line {
            let pieces = vec![line(chain, self.features[0], self.features[1], 0)];
            return FittedBlock { pieces, starts_smooth: false, ends_smooth: false };
        }
        let mut refinement = Refinement::new(chain, &self.features, self.ends);
        for round in 0..=LAST {
            refinement.interpolate();
            if !refinement.improve(round) {
                break;
            }
        }
        let (first, last) = (&refinement.steps[0], &refinement.steps[refinement.steps.len() - 1]);
        FittedBlock {
            starts_smooth: !first.line && first.joints[0] == Joint::Smooth,
            ends_smooth: !last.line && last.joints[1] == Joint::Smooth,
            pieces: refinement.pieces(),
        }
    }
}

/// The tangent of a spline at one side of a feature.
#[derive(Clone, Copy, PartialEq)]
enum Joint {
    /// As the other side of the feature has it.
    Smooth,
    Free,
    /// Along the chord, where a free one makes too much of a bulge.
    Along,
}

/// From one feature to the next.
#[derive(Clone, Copy)]
struct State<const M: usize> {
    from: usize,
    to: usize,
    /// A chord that stays a line.
    line: bool,
    /// What becomes of the tangent at the start and at the end.
    joints: [Joint; 2],
    /// From the first feature to where the spline passes it, once passing through it was of no use.
    offset: Option<[f64; M]>,
    /// Filled in by `interpolate`; a step that is new or has a new neighbour has none.
    fitted: Option<(Step<M>, Verdict)>,
}

struct Refinement<'a, const M: usize> {
    chain: &'a Chain<'a, M>,
    ends: [End<M>; 2],
    steps: Vec<State<M>>,
}

impl<'a, const M: usize> Refinement<'a, M> {
    fn new(chain: &'a Chain<M>, features: &[usize], ends: [End<M>; 2]) -> Self {
        let steps = features
            .windows(2)
            .map(|f| State {
                from: f[0],
                to: f[1],
                line: false,
                joints: [Joint::Smooth; 2],
                offset: None,
                fitted: None,
            })
            .collect();
        Self { chain, ends, steps }
    }

    /// Steps `[first, end)` of every spline.
    fn splines(&self) -> Vec<(usize, usize)> {
        let mut splines = Vec::new();
        let mut first = 0;
        for j in 0..=self.steps.len() {
            let stop =
                j == self.steps.len() || self.steps[j].line || self.steps[j].joints[0] != Joint::Smooth;
            if stop && first < j {
                splines.push((first, j));
                first = j;
            }
            if j < self.steps.len() && self.steps[j].line {
                first = j + 1;
            }
        }
        splines
    }

    /// What holds at the start (`side` 0) or at the end (1) of step `j`, where a spline starts or ends.
    fn end(&self, j: usize, side: usize) -> End<M> {
        let step = &self.steps[j];
        let neighbour = match step.joints[side] {
            Joint::Free => return End::Free,
            Joint::Along => return End::Tangent(self.chain.direction(step.from, step.to)),
            Joint::Smooth if side == 0 && j == 0 => return self.ends[0],
            Joint::Smooth if side == 1 && j + 1 == self.steps.len() => return self.ends[1],
            Joint::Smooth => &self.steps[j + 2 * side - 1],
        };
        match neighbour.line && !self.chain.is_corner([step.from, step.to][side]) {
            true => End::Tangent(self.chain.direction(neighbour.from, neighbour.to)),
            false => End::Free,
        }
    }

    /// Where the spline passes the feature at the start of step `j`.
    fn passage(&self, j: usize) -> [f64; M] {
        let step = &self.steps[j];
        let point = &self.chain.points[step.from];
        step.offset.map_or(*point, |offset| std::array::from_fn(|k| point[k] + offset[k]))
    }

    /// Half of what a smooth curve through the points bulges over the chords at point `at`, towards their
    /// inside: by so much the curve can cut the corner to share its deviation between points and chords.
    fn inward(&self, at: usize) -> [f64; M] {
        let points = self.chain.points;
        let (before, after) = (sub(&points[at], &points[at - 1]), sub(&points[at + 1], &points[at]));
        let (a, b) = (norm(&before), norm(&after));
        let inside: [f64; M] = std::array::from_fn(|k| (a * after[k] - b * before[k]) / (a + b));
        let share = (a + b) * (a + b) / (32.0 * a * b);
        let length = share * norm(&inside);
        let share = share * (SHIFT * self.chain.tolerance / length).min(1.0);
        inside.map(|value| share * value)
    }

    /// Solves and certifies every spline that has changed.
    fn interpolate(&mut self) {
        let chain = self.chain;
        let mut features = Vec::new();
        for (first, end) in self.splines() {
            if self.steps[first..end].iter().all(|step| step.fitted.is_some()) {
                continue;
            }
            features.clear();
            features.push(chain.points[self.steps[first].from]);
            features.extend((first + 1..end).map(|j| self.passage(j)));
            features.push(chain.points[self.steps[end - 1].to]);
            let spline = interpolate(&features, self.end(first, 0), self.end(end - 1, 1));
            for (i, state) in self.steps[first..end].iter_mut().enumerate() {
                let step = Step {
                    start: features[i],
                    end: features[i + 1],
                    width: spline.step[i],
                    tangent: [spline.tangent[i], spline.slope[i], spline.tangent[i + 1]],
                };
                let verdict = step.certify(chain.points, chain.along, state.from, state.to, chain.tolerance);
                state.fitted = Some((step, verdict));
            }
        }
    }

    /// Adds features or breaks splines where steps fail; false if none does.
    fn improve(&mut self, round: usize) -> bool {
        let mut added: Vec<usize> = Vec::new();
        let mut changed = false;
        for (first, end) in self.splines() {
            for j in first..end {
                let Some((_, Verdict { fault: Some(fault), .. })) = self.steps[j].fitted else {
                    continue;
                };
                changed = true;
                if round == LAST {
                    self.give_up(first, end, &mut added);
                    break;
                }
                let State { from, to, .. } = self.steps[j];
                if to - from > 1 {
                    match fault {
                        Fault::Point(k) => added.push(k),
                        Fault::Chord(k) => added.extend([k, k + 1].iter().filter(|&&k| from < k && k < to)),
                        Fault::Direction => added.push(from + (to - from) / 2),
                    }
                    if round >= HALVE {
                        added.push(from + (to - from) / 2);
                    }
                    continue;
                }
                if self.is_hopeless(j) {
                    self.steps[j].line = true;
                    self.refit(j);
                    continue;
                }
                let count = added.len();
                if round < LINES {
                    if j > first && self.steps[j - 1].to - self.steps[j - 1].from > 1 {
                        added.push(from - 1);
                    }
                    if j + 1 < end && self.steps[j + 1].to - self.steps[j + 1].from > 1 {
                        added.push(to + 1);
                    }
                }
                // Of neighbours that fail together the worst is broken first: it may have spoilt the others.
                let enough = LIKE * self.excess(j);
                let worst = (j.saturating_sub(2)..(j + 3).min(end)).all(|i| self.excess(i) <= enough);
                if added.len() == count && (worst || round >= LINES) {
                    self.break_at(first, j, end, round);
                }
            }
        }
        if changed {
            self.insert(added);
        }
        changed
    }

    /// The deviation of a step that fails, else 0.
    fn excess(&self, j: usize) -> f64 {
        match self.steps[j].fitted {
            Some((_, Verdict { fault: Some(_), deviation: [a, b], .. })) => a.max(b),
            _ => 0.0,
        }
    }

    /// Whether any smooth curve would bulge over the chord of step `j` by more than an offset can share out.
    fn is_hopeless(&self, j: usize) -> bool {
        let State { from, to, .. } = self.steps[j];
        let points = self.chain.points;
        if from == 0 || to + 1 == points.len() || self.chain.is_corner(from) || self.chain.is_corner(to) {
            return false;
        }
        let turn =
            |at: usize| turn_cosine(&points[at - 1], &points[at], &points[at + 1]).clamp(-1.0, 1.0).acos();
        let length = self.chain.along[to] - self.chain.along[from];
        let bulge = length * (turn(from) + turn(to)) / 16.0;
        bulge.min(self.excess(j)) > HOPELESS * self.chain.tolerance
    }

    /// No feature helps the chord of step `j` of the spline `[first, end)`.
    fn break_at(&mut self, first: usize, j: usize, end: usize, round: usize) {
        let State { from, to, .. } = self.steps[j];
        let points = self.chain.points;
        // Ends of the chord where the spline could be broken at a corner.
        let corner = |at: usize, inside: bool| match inside && self.chain.is_corner(at) {
            true => turn_cosine(&points[at - 1], &points[at], &points[at + 1]),
            false => 1.0,
        };
        let (left, right) = (corner(from, j > first), corner(to, j + 1 < end));
        let shifts = [j, j + 1].map(|k| first < k && k < end && self.steps[k].offset.is_none());
        let outer = [j == first, j + 1 == end];
        let joints = self.steps[j].joints;
        let given =
            |&side: &usize| outer[side] && joints[side] == Joint::Smooth && self.end(j, side) != End::Free;
        // A chord with two free ends is a line anyway.
        let loose = |&side: &usize| outer[side] && !outer[1 - side] && joints[side] != Joint::Along;
        if round >= LINES {
            self.steps[j].line = true;
        } else if left < 1.0 && left <= right {
            self.break_between(j);
        } else if right < 1.0 {
            self.break_between(j + 1);
        } else if shifts != [false; 2] {
            for k in (j..j + 2).filter(|k| shifts[k - j]) {
                self.steps[k].offset = Some(self.inward(self.steps[k].from));
            }
        } else if let Some(side) = (0..2).find(given) {
            self.steps[j].joints[side] = Joint::Free;
        } else if let Some(side) = (0..2).find(loose) {
            self.steps[j].joints[side] = Joint::Along;
        } else {
            self.steps[j].line = true;
        }
        self.refit(j);
    }

    fn break_between(&mut self, j: usize) {
        self.steps[j - 1].joints[1] = Joint::Free;
        self.steps[j].joints[0] = Joint::Free;
        self.refit(j - 1);
    }

    /// Step `j` or one of its ends has changed.
    fn refit(&mut self, j: usize) {
        for k in j.saturating_sub(1)..(j + 2).min(self.steps.len()) {
            self.steps[k].fitted = None;
        }
    }

    /// Every chord of the spline `[first, end)` becomes a line.
    fn give_up(&mut self, first: usize, end: usize, added: &mut Vec<usize>) {
        for step in &mut self.steps[first..end] {
            added.extend(step.from + 1..step.to);
            step.line = true;
        }
    }

    /// Splits steps at the points `added`.
    fn insert(&mut self, mut added: Vec<usize>) {
        added.sort_unstable();
        added.dedup();
        let mut steps = Vec::with_capacity(self.steps.len() + added.len());
        let mut next = 0;
        for step in &self.steps {
            let mut rest = *step;
            while next < added.len() && added[next] <= rest.from {
                next += 1;
            }
            while next < added.len() && added[next] < rest.to {
                let [start, finish] = rest.joints;
                steps.push(State { to: added[next], joints: [start, Joint::Smooth], fitted: None, ..rest });
                let joints = [Joint::Smooth, finish];
                rest = State { from: added[next], joints, offset: None, fitted: None, ..rest };
                next += 1;
            }
            steps.push(rest);
        }
        self.steps = steps;
    }

    /// The quadratics from knot to knot.
    fn pieces(&self) -> Vec<FittedPiece<M>> {
        let mut pieces = Vec::with_capacity(self.steps.len() + 2);
        let mut spline = 0;
        let mut splines = self.splines().into_iter().peekable();
        let mut j = 0;
        while j < self.steps.len() {
            match splines.next_if(|&(first, _)| first == j) {
                Some((first, end)) => {
                    self.knots_to_pieces(first, end, spline, &mut pieces);
                    j = end;
                }
                None => {
                    pieces.push(line(self.chain, self.steps[j].from, self.steps[j].to, spline));
                    j += 1;
                }
            }
            spline += 1;
        }
        pieces
    }

    fn knots_to_pieces(&self, first: usize, end: usize, spline: u32, pieces: &mut Vec<FittedPiece<M>>) {
        let [free_start, free_end] = [self.end(first, 0), self.end(end - 1, 1)].map(|end| end == End::Free);
        if end - first == 1 && free_start && free_end {
            pieces.push(line(self.chain, self.steps[first].from, self.steps[first].to, spline));
            return;
        }
        let fitted = |j: usize| self.steps[j].fitted.as_ref().expect("the last round has fitted all");
        let Step { start: point, tangent: [tangent, ..], .. } = fitted(first).0;
        let chord = self.steps[first].from;
        let mut pen = Pen { point, tangent, chord, spline, width: 0.0, deviation: 0.0 };
        for j in first..end {
            let (step, verdict) = fitted(j);
            pen.pass(0.5 * step.width, verdict.deviation[0]);
            // A knot next to a free end is none: both sides are the same quadratic.
            if !((j == first && free_start) || (j + 1 == end && free_end)) {
                let chord = verdict.knot_chord;
                pieces.push(pen.piece(step.knot(), step.tangent[1], chord, chord));
            }
            pen.pass(0.5 * step.width, verdict.deviation[1]);
        }
        let (step, to) = (&fitted(end - 1).0, self.steps[end - 1].to);
        pieces.push(pen.piece(step.end, step.tangent[2], to - 1, to));
    }
}
