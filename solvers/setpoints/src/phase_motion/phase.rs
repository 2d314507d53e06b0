//! The phases of a profile as columns, one of them, and parts of it.

use feedplan_planner::phase_law::PhaseLaw;

/// C' vanishes at an end where |C'|² is below this part of that in the middle of the phase.
pub const SLOW: f64 = 1e-8;

/// One phase of a profile: `value` is the constant of its law, u0 < u1 local parameters, p at both ends, and where the jerk
/// is limited the acceleration along the path.
#[derive(Clone, Copy, Debug)]
pub struct Phase {
    pub piece: u32,
    pub law: PhaseLaw,
    pub axis: u8,
    pub value: f64,
    pub u0: f64,
    pub u1: f64,
    pub p0: f64,
    pub p1: f64,
    pub duration: f64,
    pub a0: f64,
    pub a1: f64,
}

/// All phases of a profile, a column for each quantity, in the order of the path.
#[derive(Clone, Debug, Default)]
pub struct Phases {
    pub piece: Vec<u32>,
    /// The number of the law.
    pub kind: Vec<u8>,
    pub axis: Vec<u8>,
    pub value: Vec<f64>,
    pub u0: Vec<f64>,
    pub u1: Vec<f64>,
    pub p0: Vec<f64>,
    pub p1: Vec<f64>,
    pub duration: Vec<f64>,
    pub a0: Vec<f64>,
    pub a1: Vec<f64>,
}

impl Phases {
    pub fn len(&self) -> usize {
        self.piece.len()
    }

    pub fn is_empty(&self) -> bool {
        self.piece.is_empty()
    }

    /// Phase i, if the number of its law is known.
    pub fn get(&self, i: usize) -> Option<Phase> {
        Some(Phase {
            piece: self.piece[i],
            law: PhaseLaw::from_number(self.kind[i])?,
            axis: self.axis[i],
            value: self.value[i],
            u0: self.u0[i],
            u1: self.u1[i],
            p0: self.p0[i],
            p1: self.p1[i],
            duration: self.duration[i],
            a0: self.a0[i],
            a1: self.a1[i],
        })
    }

    /// The first phase that ends at or behind u of a piece; their number if none does.
    pub fn up_to(&self, piece: u32, u: f64) -> usize {
        let first = self.piece.partition_point(|&own| own < piece);
        let own = self.piece[first..].partition_point(|&own| own == piece);
        first + self.u1[first..first + own].partition_point(|&end| end < u)
    }
}

impl FromIterator<Phase> for Phases {
    fn from_iter<I: IntoIterator<Item = Phase>>(phases: I) -> Self {
        let mut all = Self::default();
        for phase in phases {
            all.piece.push(phase.piece);
            all.kind.push(phase.law as u8);
            all.axis.push(phase.axis);
            all.value.push(phase.value);
            all.u0.push(phase.u0);
            all.u1.push(phase.u1);
            all.p0.push(phase.p0);
            all.p1.push(phase.p1);
            all.duration.push(phase.duration);
            all.a0.push(phase.a0);
            all.a1.push(phase.a1);
        }
        all
    }
}

impl Phase {
    /// The speeds that p makes of the squares of a length per u at both ends.
    pub fn end_speeds(&self, squares: [f64; 2]) -> [f64; 2] {
        [(squares[0] * self.p0).sqrt(), (squares[1] * self.p1).sqrt()]
    }
}

/// A share of the whole measure of a phase, counted from its start or from its end.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub from_start: bool,
    pub share: f64,
}

impl Part {
    /// The same from the end that is nearer.
    pub fn nearer_end(self) -> Self {
        if self.share <= 0.5 {
            self
        } else {
            Self { from_start: !self.from_start, share: 1.0 - self.share }
        }
    }
}
