//! The profile as columns, one row per arc, in the order of the path and in the parameter of its pieces.

use crate::arc_kind::ArcKind;

/// No axis belongs to the arc.
pub const NO_AXIS: u8 = 255;

/// Columns of the arcs; see `feedplan.profile.SpeedProfile`.
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
    /// Offsets of the runs in the arcs.
    pub runs: Vec<i64>,
    /// Pieces on which the plan is slower than it could be, for rounding hides the way; each as often as that happens.
    pub slowed: Vec<u32>,
    left_out: f64,
}

/// One row.
pub(crate) struct Row {
    pub kind: ArcKind,
    pub axis: u8,
    pub value: f64,
    /// t at the end; at the start it is that of the row before.
    pub t: f64,
    pub p: [f64; 2],
    pub duration: f64,
    /// The arc goes on from the one before it if that has the same kind, axis and value.
    pub joins: bool,
}

impl Profile {
    /// No arcs, with space for some.
    pub(crate) fn with_capacity(arcs: usize) -> Self {
        Self {
            piece: Vec::with_capacity(arcs),
            kind: Vec::with_capacity(arcs),
            axis: Vec::with_capacity(arcs),
            value: Vec::with_capacity(arcs),
            u0: Vec::with_capacity(arcs),
            u1: Vec::with_capacity(arcs),
            p0: Vec::with_capacity(arcs),
            p1: Vec::with_capacity(arcs),
            duration: Vec::with_capacity(arcs),
            ..Self::default()
        }
    }

    /// Number of arcs.
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// The time of all arcs, in seconds.
    pub fn time(&self) -> f64 {
        self.duration.iter().sum()
    }

    /// One profile of several, in the order of the path.
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

    /// Closes a run.
    pub(crate) fn end_run(&mut self) {
        let left_out = std::mem::take(&mut self.left_out);
        if let Some(last) = self.duration.last_mut() {
            *last += left_out;
        }
    }

    /// Drops all but the first rows.
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

    /// Appends an arc of piece number `piece`; t and p belong to the parameter t = u/width. An arc too short for u
    /// to show it is left out, its time goes to the next one.
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
            && self.kind[last] == row.kind as u8
            && self.axis[last] == row.axis
            && self.value[last] == row.value
        {
            self.u1[last] = u1;
            self.p1[last] = p1;
            self.duration[last] += duration;
            return;
        }
        self.piece.push(piece);
        self.kind.push(row.kind as u8);
        self.axis.push(row.axis);
        self.value.push(row.value);
        self.u0.push(u0);
        self.u1.push(u1);
        self.p0.push(p0);
        self.p1.push(p1);
        self.duration.push(duration);
    }
}
