//! The spline through a block of points between two given tangents, refined until every step is within the tolerance.
//!
//! A step is the part of the spline from one feature to the next. In each round a step out of tolerance gets new features: its
//! worst point, or both ends of its worst chord. More features do not help a step of a single chord if the next points on both
//! sides are features already. Such a step is mended by the first of these that is possible:
//!
//! 1. the spline is broken at the sharper end of the chord, if that is a corner;
//! 2. it passes the ends of the chord at an offset, so that its bulge is shared between points and chords;
//! 3. the tangent at its end is given up: a given tangent becomes free, a free one gets the direction of the chord;
//! 4. the chord becomes a line.
//!
//! No change is taken back, so the number of changes is bounded. The number of rounds is bounded as well.

use super::certificate::{Defect, Step, StepBound};
use super::chain::{turn_cosine, Chain};
use super::piece_builder::{line, FittedPiece, PieceBuilder};
use super::spline::{interpolate, EndCondition};
use crate::tolerance;
use feedplan_geometry::quadratic::{norm, sub};

/// From this round on, a step out of tolerance also gets its middle point as a feature.
const HALVE: usize = 4;
/// From this round on, a single chord out of tolerance becomes a line at once.
const LINES: usize = 24;
/// In this round, each spline that is still out of tolerance becomes lines.
const LAST: usize = 40;
/// The deviation of a step is among the worst if it is at least the greatest one nearby divided by this.
const LIKE: f64 = 1.1;

/// A group, or a part of a long one.
pub struct Block<const M: usize> {
    features: Vec<usize>,
    ends: [EndCondition<M>; 2],
    line: bool,
    /// Whether it starts within the group of the block before.
    pub continues: bool,
}

/// The pieces of a block, with splines numbered from 0, and whether the given tangents were kept at both ends.
pub struct FittedBlock<const M: usize> {
    pub pieces: Vec<FittedPiece<M>>,
    pub starts_smooth: bool,
    pub ends_smooth: bool,
}

impl<const M: usize> Block<M> {
    pub fn line(a: usize, b: usize) -> Self {
        Self { features: vec![a, b], ends: [EndCondition::Free; 2], line: true, continues: false }
    }

    pub fn curve(
        features: Vec<usize>,
        start: EndCondition<M>,
        finish: EndCondition<M>,
        continues: bool,
    ) -> Self {
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
            starts_smooth: !first.line && first.tangents[0] == SideTangent::Smooth,
            ends_smooth: !last.line && last.tangents[1] == SideTangent::Smooth,
            pieces: refinement.pieces(),
        }
    }
}

/// The tangent of a step at one of its features.
#[derive(Clone, Copy, PartialEq)]
enum SideTangent {
    /// The same as on the other side of the feature.
    Smooth,
    Free,
    /// Along the chord; set where a free tangent bulges too far.
    Along,
}

/// A step of the refinement, from one feature to the next.
#[derive(Clone, Copy)]
struct StepState<const M: usize> {
    from: usize,
    to: usize,
    /// Whether it is a chord that stays a line.
    line: bool,
    /// The tangents at the start and at the end.
    tangents: [SideTangent; 2],
    /// The offset of the spline from the feature at the start of the step, if it does not pass through it.
    offset: Option<[f64; M]>,
    /// The step and its bound by `interpolate`; None for a step that is new or has a new neighbour.
    fitted: Option<(Step<M>, StepBound)>,
}

struct Refinement<'a, const M: usize> {
    chain: &'a Chain<'a, M>,
    ends: [EndCondition<M>; 2],
    steps: Vec<StepState<M>>,
}

impl<'a, const M: usize> Refinement<'a, M> {
    fn new(chain: &'a Chain<M>, features: &[usize], ends: [EndCondition<M>; 2]) -> Self {
        let steps = features
            .windows(2)
            .map(|f| StepState {
                from: f[0],
                to: f[1],
                line: false,
                tangents: [SideTangent::Smooth; 2],
                offset: None,
                fitted: None,
            })
            .collect();
        Self { chain, ends, steps }
    }

    /// The steps `[first, end)` of each spline.
    fn splines(&self) -> Vec<(usize, usize)> {
        let mut splines = Vec::new();
        let mut first = 0;
        for j in 0..=self.steps.len() {
            let stop = j == self.steps.len()
                || self.steps[j].line
                || self.steps[j].tangents[0] != SideTangent::Smooth;
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

    /// The end condition of a spline that starts (`side` 0) or ends (1) with step `j`.
    fn end(&self, j: usize, side: usize) -> EndCondition<M> {
        let step = &self.steps[j];
        let neighbour = match step.tangents[side] {
            SideTangent::Free => return EndCondition::Free,
            SideTangent::Along => return EndCondition::Tangent(self.chain.direction(step.from, step.to)),
            SideTangent::Smooth if side == 0 && j == 0 => return self.ends[0],
            SideTangent::Smooth if side == 1 && j + 1 == self.steps.len() => return self.ends[1],
            SideTangent::Smooth => &self.steps[j + 2 * side - 1],
        };
        match neighbour.line && !self.chain.is_corner([step.from, step.to][side]) {
            true => EndCondition::Tangent(self.chain.direction(neighbour.from, neighbour.to)),
            false => EndCondition::Free,
        }
    }

    /// The point at which the spline passes the feature at the start of step `j`.
    fn passage(&self, j: usize) -> [f64; M] {
        let step = &self.steps[j];
        let point = &self.chain.points[step.from];
        step.offset.map_or(*point, |offset| std::array::from_fn(|k| point[k] + offset[k]))
    }

    /// The offset at point `at`, towards the inside of the turn. It is half of the bulge that a smooth curve through the points
    /// has over their chords, so that the deviation is shared between points and chords.
    fn inward(&self, at: usize) -> [f64; M] {
        let points = self.chain.points;
        let (before, after) = (sub(&points[at], &points[at - 1]), sub(&points[at + 1], &points[at]));
        let (a, b) = (norm(&before), norm(&after));
        let inside: [f64; M] = std::array::from_fn(|k| (a * after[k] - b * before[k]) / (a + b));
        let share = (a + b) * (a + b) / (32.0 * a * b);
        let length = share * norm(&inside);
        let share = share * (tolerance::OFFSET * self.chain.tolerance / length).min(1.0);
        inside.map(|value| share * value)
    }

    /// Computes each spline that has changed, and the bounds of its steps.
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
                let bound = step.certify(chain.points, chain.along, state.from, state.to, chain.tolerance);
                state.fitted = Some((step, bound));
            }
        }
    }

    /// Adds features or breaks splines where steps are out of tolerance. Returns false if no step is.
    fn improve(&mut self, round: usize) -> bool {
        let mut added: Vec<usize> = Vec::new();
        let mut changed = false;
        for (first, end) in self.splines() {
            for j in first..end {
                let Some((_, StepBound { defect: Some(defect), .. })) = self.steps[j].fitted else {
                    continue;
                };
                changed = true;
                if round == LAST {
                    for step in &mut self.steps[first..end] {
                        added.extend(step.from + 1..step.to);
                        step.line = true;
                    }
                    break;
                }
                let StepState { from, to, .. } = self.steps[j];
                if to - from > 1 {
                    match defect {
                        Defect::Point(k) => added.push(k),
                        Defect::Chord(k) => added.extend([k, k + 1].iter().filter(|&&k| from < k && k < to)),
                        Defect::Direction => added.push(from + (to - from) / 2),
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
                // Among neighbours out of tolerance the worst is broken first: it may be the cause of the others.
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

    /// The deviation in mm of a step that is out of tolerance, otherwise 0.
    fn excess(&self, j: usize) -> f64 {
        match self.steps[j].fitted {
            Some((_, StepBound { defect: Some(_), deviation: [a, b], .. })) => a.max(b),
            _ => 0.0,
        }
    }

    /// Whether every smooth curve would bulge over the chord of step `j` by more than an offset can compensate.
    fn is_hopeless(&self, j: usize) -> bool {
        let StepState { from, to, .. } = self.steps[j];
        let points = self.chain.points;
        if from == 0 || to + 1 == points.len() || self.chain.is_corner(from) || self.chain.is_corner(to) {
            return false;
        }
        let turn =
            |at: usize| turn_cosine(&points[at - 1], &points[at], &points[at + 1]).clamp(-1.0, 1.0).acos();
        let length = self.chain.along[to] - self.chain.along[from];
        let bulge = length * (turn(from) + turn(to)) / 16.0;
        bulge.min(self.excess(j)) > tolerance::HOPELESS * self.chain.tolerance
    }

    /// Mends step `j` of the spline `[first, end)`, a single chord that more features do not help.
    fn break_at(&mut self, first: usize, j: usize, end: usize, round: usize) {
        let StepState { from, to, .. } = self.steps[j];
        let points = self.chain.points;
        // The cosine of the turn at a corner where the spline can be broken; 1 elsewhere.
        let corner = |at: usize, inside: bool| match inside && self.chain.is_corner(at) {
            true => turn_cosine(&points[at - 1], &points[at], &points[at + 1]),
            false => 1.0,
        };
        let (left, right) = (corner(from, j > first), corner(to, j + 1 < end));
        let shifts = [j, j + 1].map(|k| first < k && k < end && self.steps[k].offset.is_none());
        let outer = [j == first, j + 1 == end];
        let tangents = self.steps[j].tangents;
        let given = |&side: &usize| {
            outer[side] && tangents[side] == SideTangent::Smooth && self.end(j, side) != EndCondition::Free
        };
        // A chord with two free ends is a line already.
        let loose = |&side: &usize| outer[side] && !outer[1 - side] && tangents[side] != SideTangent::Along;
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
            self.steps[j].tangents[side] = SideTangent::Free;
        } else if let Some(side) = (0..2).find(loose) {
            self.steps[j].tangents[side] = SideTangent::Along;
        } else {
            self.steps[j].line = true;
        }
        self.refit(j);
    }

    fn break_between(&mut self, j: usize) {
        self.steps[j - 1].tangents[1] = SideTangent::Free;
        self.steps[j].tangents[0] = SideTangent::Free;
        self.refit(j - 1);
    }

    /// Marks step `j` and its neighbours to be computed again.
    fn refit(&mut self, j: usize) {
        for k in j.saturating_sub(1)..(j + 2).min(self.steps.len()) {
            self.steps[k].fitted = None;
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
                let [start, finish] = rest.tangents;
                steps.push(StepState {
                    to: added[next],
                    tangents: [start, SideTangent::Smooth],
                    fitted: None,
                    ..rest
                });
                let tangents = [SideTangent::Smooth, finish];
                rest = StepState { from: added[next], tangents, offset: None, fitted: None, ..rest };
                next += 1;
            }
            steps.push(rest);
        }
        self.steps = steps;
    }

    /// The pieces from knot to knot.
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
        let [free_start, free_end] =
            [self.end(first, 0), self.end(end - 1, 1)].map(|end| end == EndCondition::Free);
        if end - first == 1 && free_start && free_end {
            pieces.push(line(self.chain, self.steps[first].from, self.steps[first].to, spline));
            return;
        }
        let fitted = |j: usize| self.steps[j].fitted.as_ref().expect("the last round has fitted all");
        let Step { start: point, tangent: [tangent, ..], .. } = fitted(first).0;
        let chord = self.steps[first].from;
        let mut builder = PieceBuilder { point, tangent, chord, spline, width: 0.0, deviation: 0.0 };
        for j in first..end {
            let (step, bound) = fitted(j);
            builder.pass(0.5 * step.width, bound.deviation[0]);
            // Next to a free end there is no knot: both sides are the same quadratic.
            if !((j == first && free_start) || (j + 1 == end && free_end)) {
                let chord = bound.knot_chord;
                pieces.push(builder.piece(step.knot(), step.tangent[1], chord, chord));
            }
            builder.pass(0.5 * step.width, bound.deviation[1]);
        }
        let (step, to) = (&fitted(end - 1).0, self.steps[end - 1].to);
        pieces.push(builder.piece(step.end, step.tangent[2], to - 1, to));
    }
}
