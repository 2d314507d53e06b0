//! Checks that the phases of a profile follow each other without gap over every piece of every run.

use super::curve::Followed;
use super::phases::Phases;
use super::{Check, Tally, EPS, GAP_TOLERANCE, ROUNDINGS};

/// A path and the phases on it, with their start times in s; `are_good` tells whether the numbers of a phase can be used.
pub struct PhaseOrder<'a> {
    pub path: &'a Followed<'a>,
    pub phases: &'a Phases<'a>,
    pub starts: &'a [f64],
    pub are_good: &'a [bool],
}

/// The place where the next phase has to begin.
struct Next {
    piece: usize,
    u: f64,
}

impl PhaseOrder<'_> {
    /// Offers the gaps to the tally. Returns whether the runs are those of the path and all numbers can be used, so that the ends
    /// of runs can be checked.
    pub fn audit<const M: usize>(&self, tally: &mut Tally<M>) -> bool {
        let Self { path, phases, starts, are_good } = *self;
        if phases.runs.len() != path.runs.len()
            || phases.runs.first().is_some_and(|&first| first != 0)
            || phases.runs.last().is_some_and(|&last| last != phases.len() as i64)
            || phases.runs.windows(2).any(|pair| pair[0] > pair[1])
        {
            tally.offer(Check::Order, 0, f64::INFINITY, GAP_TOLERANCE, 0.0, self.path.line_of(0));
            return false;
        }
        for (runs, pieces) in phases.runs.windows(2).zip(path.runs.windows(2)) {
            let [first, last] = [pieces[0], pieces[1]].map(|piece| piece as usize);
            let mut next = Next { piece: first, u: 0.0 };
            let here = runs[0] as usize..runs[1] as usize;
            for i in here.clone() {
                if !are_good[i] {
                    return false; // reported with the phase itself
                }
                let entered = phases.piece[i] as usize;
                if entered != next.piece {
                    self.finish_piece(&mut next, entered.min(last), starts[i], tally);
                }
                let gap = if entered == next.piece { (phases.u0[i] - next.u).abs() } else { f64::INFINITY };
                let slack = ROUNDINGS * EPS * path.width[entered];
                tally.offer(
                    Check::Order,
                    0,
                    gap - slack,
                    GAP_TOLERANCE,
                    starts[i],
                    self.path.line_of(entered),
                );
                next.u = phases.u1[i];
            }
            let time = here.end.checked_sub(1).map_or(0.0, |i| starts[i] + phases.duration[i]);
            self.finish_piece(&mut next, last, time, tally);
        }
        true
    }

    /// Moves on to `piece`; what phases have not covered of the pieces before it is offered as a gap.
    fn finish_piece<const M: usize>(&self, next: &mut Next, piece: usize, time: f64, tally: &mut Tally<M>) {
        while next.piece < piece {
            let left = self.path.width[next.piece] - next.u;
            if !self.path.is_motionless(next.piece) {
                let slack = ROUNDINGS * EPS * self.path.width[next.piece];
                tally.offer(
                    Check::Order,
                    0,
                    left - slack,
                    GAP_TOLERANCE,
                    time,
                    self.path.line_of(next.piece),
                );
            }
            *next = Next { piece: next.piece + 1, u: 0.0 };
        }
    }
}
