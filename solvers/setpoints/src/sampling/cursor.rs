//! Finds the phase at a time of a run, for times that mostly ascend.

use std::ops::Range;
use std::rc::Rc;

use super::path_data::PathData;
use crate::phase_motion::{PhaseMotion, PiecePath};
use feedplan_planner::phases::Phases;

/// The current phase and the motion on it, and the current piece: kept as long as setpoints stay on them.
pub struct Cursor<'a, const M: usize> {
    path: &'a PathData<M>,
    phases: &'a Phases,
    /// Start of each phase, from the start of its run, in s.
    starts: &'a [f64],
    phase: usize,
    piece: Option<(u32, Rc<PiecePath<'a, M>>)>,
    motion: Option<(usize, PhaseMotion<'a, M>)>,
}

impl<'a, const M: usize> Cursor<'a, M> {
    pub fn new(path: &'a PathData<M>, phases: &'a Phases, starts: &'a [f64]) -> Self {
        Self { path, phases, starts, phase: usize::MAX, piece: None, motion: None }
    }

    /// Sets the phase at which the next search begins.
    pub fn begin_at(&mut self, phase: usize) {
        self.phase = phase;
    }

    /// Goes to the phase of a run that contains the time, and prepares its motion.
    pub fn seek(&mut self, run: &Range<usize>, time: f64) -> usize {
        self.find(run, time);
        self.enter(self.phase);
        self.phase
    }

    /// Goes to the phase of a run that contains the time.
    pub fn find(&mut self, run: &Range<usize>, time: f64) -> usize {
        let starts = self.starts;
        if !run.contains(&self.phase) || starts[self.phase] > time {
            self.phase = run.start + starts[run.clone()].partition_point(|&start| start <= time) - 1;
        }
        while self.phase + 1 < run.end && starts[self.phase + 1] <= time {
            self.phase += 1;
        }
        self.phase
    }

    /// Prepares the motion on a phase.
    pub fn enter(&mut self, number: usize) {
        if self.motion.as_ref().is_none_or(|(phase, _)| *phase != number) {
            let phase = self.phases.get(number).expect("all laws are known");
            let piece = self.piece(phase.piece);
            self.motion = Some((number, PhaseMotion::new(piece, &phase)));
        }
    }

    /// A piece with its lengths.
    pub fn piece(&mut self, number: u32) -> Rc<PiecePath<'a, M>> {
        let piece = match self.piece.take() {
            Some((last, piece)) if last == number => piece,
            _ => Rc::new(self.path.piece(number as usize)),
        };
        self.piece = Some((number, piece.clone()));
        piece
    }

    pub fn motion(&self) -> &PhaseMotion<'a, M> {
        &self.motion.as_ref().expect("seek comes first").1
    }
}
