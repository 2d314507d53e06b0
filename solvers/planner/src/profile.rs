//! The profile: speed along the path as columns with one row per phase, in the order of the path.

use crate::phase_law::PhaseLaw;

/// The axis of a phase without one.
pub const NO_AXIS: u8 = 255;

/// Columns of the phases; see `feedplan.profile.SpeedProfile`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Profile {
    pub piece: Vec<u32>,
    pub kind: Vec<u8>,
    pub axis: Vec<u8>,
    pub value: Vec<f64>,
    pub u0: Vec<f64>,
    pub u1: Vec<f64>,
    pub p0: Vec<f64>,
    pub p1: Vec<f64>,
    pub duration: Vec<f64>,
    /// Index of the first phase of each run, and the number of phases.
    pub runs: Vec<i64>,
    /// Pieces where a remedy against rounding slowed the plan, one entry per remedy.
    pub slowed: Vec<u32>,
    left_out: f64,
}

pub(crate) struct Row {
    pub law: PhaseLaw,
    pub axis: u8,
    pub value: f64,
    /// t at the end; the row before gives t at the start.
    pub t: f64,
    pub p: [f64; 2],
    pub duration: f64,
    /// The phase continues the one before it if that has the same law, axis and value.
    pub joins: bool,
}

impl Profile {
    /// Without phases, with memory for this many.
    pub(crate) fn with_capacity(phases: usize) -> Self {
        Self {
            piece: Vec::with_capacity(phases),
            kind: Vec::with_capacity(phases),
            axis: Vec::with_capacity(phases),
            value: Vec::with_capacity(phases),
            u0: Vec::with_capacity(phases),
            u1: Vec::with_capacity(phases),
            p0: Vec::with_capacity(phases),
            p1: Vec::with_capacity(phases),
            duration: Vec::with_capacity(phases),
            ..Self::default()
        }
    }

    /// Number of phases.
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// The time of all phases [s].
    pub fn time(&self) -> f64 {
        self.duration.iter().sum()
    }

    /// Joins profiles in the order of the path.
    pub(crate) fn join(parts: Vec<Self>) -> Self {
        let mut parts = parts.into_iter();
        let mut all = parts.next().unwrap_or_default();
        for part in parts {
            let offset = all.len() as i64;
            all.runs.extend(part.runs.iter().map(|start| start + offset));
            all.append(part);
        }
        all.runs.push(all.len() as i64);
        all
    }

    /// Closes a run; its last phase gets the time of those too short to keep.
    pub(crate) fn end_run(&mut self) {
        let left_out = std::mem::take(&mut self.left_out);
        if let Some(last) = self.duration.last_mut() {
            *last += left_out;
        }
    }

    /// Keeps the first rows only.
    pub(crate) fn truncate(&mut self, rows: usize) {
        self.piece.truncate(rows);
        self.kind.truncate(rows);
        self.axis.truncate(rows);
        self.value.truncate(rows);
        self.u0.truncate(rows);
        self.u1.truncate(rows);
        self.p0.truncate(rows);
        self.p1.truncate(rows);
        self.duration.truncate(rows);
        self.left_out = 0.0;
    }

    /// Appends the rows of another profile.
    fn append(&mut self, mut other: Self) {
        self.piece.append(&mut other.piece);
        self.kind.append(&mut other.kind);
        self.axis.append(&mut other.axis);
        self.value.append(&mut other.value);
        self.u0.append(&mut other.u0);
        self.u1.append(&mut other.u1);
        self.p0.append(&mut other.p0);
        self.p1.append(&mut other.p1);
        self.duration.append(&mut other.duration);
        self.slowed.append(&mut other.slowed);
    }

    /// Appends a phase of piece `piece`; t and p are over t = u/width. A phase too short for u to show is left out,
    /// and the next one gets its time.
    #[inline(always)]
    pub(crate) fn push(&mut self, piece: u32, width: f64, row: Row) {
        let last = self.piece.len().wrapping_sub(1);
        let goes_on = last < self.piece.len() && self.piece[last] == piece;
        let (u0, u1) = (if goes_on { self.u1[last] } else { 0.0 }, row.t * width);
        let duration = row.duration + std::mem::take(&mut self.left_out);
        let scale = width * width;
        let (p0, p1) = (row.p[0] * scale, row.p[1] * scale);
        if u1 <= u0 {
            self.left_out = duration;
            if goes_on {
                self.p1[last] = p1;
            }
            return;
        }
        if row.joins
            && goes_on
            && self.kind[last] == row.law as u8
            && self.axis[last] == row.axis
            && self.value[last] == row.value
        {
            self.u1[last] = u1;
            self.p1[last] = p1;
            self.duration[last] += duration;
            return;
        }
        self.piece.push(piece);
        self.kind.push(row.law as u8);
        self.axis.push(row.axis);
        self.value.push(row.value);
        self.u0.push(u0);
        self.u1.push(u1);
        self.p0.push(p0);
        self.p1.push(p1);
        self.duration.push(duration);
    }
}
