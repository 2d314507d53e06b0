//! The integrands along a phase: the length per u, which is |C'| of the axes or √D of the tool tip, divided by v, where v² is
//! linear in u. With v = 1 the integral is the length, otherwise the time.

use feedplan_geometry::arc_length::{Disc, Integrand};
use feedplan_geometry::polynomial::Polynomial;
use feedplan_geometry::spline::speed::{greatest_ratio, to_taylor, Speed};

/// Greatest number of coefficients of a tip speed.
pub const MAX_TIP: usize = 37;

/// D, the square of the tip's speed per u on one piece, and its derivatives D' and D'' by u, as polynomials in t = u / width.
#[derive(Clone, Debug)]
pub struct TipSpeed {
    pub derivatives: Box<[Polynomial<MAX_TIP>; 3]>,
}

impl TipSpeed {
    /// From the Bernstein coefficients of D on a piece of this width.
    pub fn new(coefficients: &[f64], width: f64) -> Self {
        let square = Polynomial::from_bernstein(coefficients.iter().copied());
        let slope = square.derivative().scale(1.0 / width);
        Self { derivatives: Box::new([square, slope, slope.derivative().scale(1.0 / width)]) }
    }
}

/// √D as an integrand.
#[derive(Clone, Copy, Debug)]
pub struct Tip<'a> {
    pub square: &'a Polynomial<MAX_TIP>,
    pub width: f64,
}

impl Tip<'_> {
    #[inline(always)]
    fn at(&self, u: f64) -> f64 {
        // A D that touches 0 may be negative by rounding.
        self.square.value(u / self.width).max(0.0).sqrt()
    }

    #[inline]
    fn at_each<const K: usize>(&self, u: [f64; K]) -> [f64; K] {
        self.square.values_in_vectors(u.map(|u| u / self.width)).map(|square| square.max(0.0).sqrt())
    }

    // As for |C'|: the disc contains no zero of D.
    fn disc(&self, a: f64, b: f64) -> Disc {
        let (middle, half) = (0.5 * (a + b) / self.width, 0.5 * (b - a) / self.width);
        let n = self.square.degree();
        let mut taylor = [[0.0]; MAX_TIP];
        for i in 0..=n {
            taylor[i] = [self.square.bernstein(i)];
        }
        to_taylor(&mut taylor[..=n], middle, half);
        let least = taylor[0][0];
        if least <= 0.0 {
            // Below rounding: counts as 0, whose integral has no error.
            return Disc { radius: f64::INFINITY, bound: 0.0 };
        }
        let ratio = greatest_ratio(|rho| {
            taylor[1..=n].iter().rev().fold(0.0, |sum, [s]| (sum + s.abs()) * rho) <= least
        });
        Disc { radius: (ratio - 1.0) * half * self.width, bound: (2.0 * least).sqrt() }
    }

    fn greatest(&self) -> f64 {
        self.square.range().1.max(0.0).sqrt()
    }

    // Bound of |D'| divided by twice that of √D; infinite where D may vanish.
    fn steepest(&self) -> f64 {
        let least = self.square.range().0;
        let (low, high) = self.square.derivative().range();
        match least > 0.0 {
            true => low.abs().max(high.abs()) / (2.0 * least.sqrt() * self.width),
            false => f64::INFINITY,
        }
    }
}

/// Whose speed is integrated.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a, const M: usize> {
    Own(Speed<'a, M>),
    Tip(Tip<'a>),
}

impl<const M: usize> Source<'_, M> {
    #[inline(always)]
    fn at(&self, u: f64) -> f64 {
        match self {
            Self::Own(speed) => speed.at(u),
            Self::Tip(tip) => tip.at(u),
        }
    }

    #[inline(always)]
    fn at_each<const K: usize>(&self, u: [f64; K]) -> [f64; K] {
        match self {
            Self::Own(speed) => speed.at_each(u),
            Self::Tip(tip) => tip.at_each(u),
        }
    }

    fn disc(&self, a: f64, b: f64) -> Disc {
        match self {
            Self::Own(speed) => speed.disc(a, b),
            Self::Tip(tip) => tip.disc(a, b),
        }
    }

    /// Upper bound of the derivative of the speed by u; infinite where none is known.
    pub fn steepest(&self) -> f64 {
        match self {
            Self::Own(speed) => speed.steepest(),
            Self::Tip(tip) => tip.steepest(),
        }
    }

    fn foot_error(&self, width: f64) -> f64 {
        match self {
            Self::Own(speed) => speed.foot_error(width),
            Self::Tip(tip) => tip.greatest() * width,
        }
    }
}

/// v² = `start` + `slope` (u − u0).
#[derive(Clone, Copy, Debug)]
pub struct Line {
    pub start: f64,
    pub slope: f64,
    pub u0: f64,
}

impl Line {
    /// v² = 1: the integral is the length.
    pub const ONE: Self = Self { start: 1.0, slope: 0.0, u0: 0.0 };

    #[inline(always)]
    pub fn at(&self, u: f64) -> f64 {
        (self.start + self.slope * (u - self.u0)).max(0.0)
    }
}

/// From rest at `place`, v² is `slope` times the distance in u from there. With y, the square root of that distance, the time is
/// the integral of 2 √D / √slope over y, which is smooth at rest.
#[derive(Clone, Copy, Debug)]
pub struct FromRest<'a, const M: usize> {
    pub source: Source<'a, M>,
    pub place: f64,
    /// 1 from the start of a phase, −1 backwards from its end.
    pub sign: f64,
    pub slope: f64,
}

impl<const M: usize> FromRest<'_, M> {
    /// The parameter of the piece at y.
    pub fn u(&self, y: f64) -> f64 {
        self.place + self.sign * y * y
    }
}

impl<const M: usize> Integrand for FromRest<'_, M> {
    #[inline(always)]
    fn at(&self, y: f64) -> f64 {
        2.0 * self.source.at(self.u(y)) / self.slope.sqrt()
    }

    // The disc of radius r about y is mapped into the disc of radius R about u if r (2 b + r) = R.
    fn disc(&self, a: f64, b: f64) -> Disc {
        let (from, to) = (self.u(a), self.u(b));
        let disc = self.source.disc(from.min(to), from.max(to));
        Disc {
            radius: disc.radius / ((b * b + disc.radius).sqrt() + b),
            bound: 2.0 * disc.bound / self.slope.sqrt(),
        }
    }

    fn foot(&self) -> f64 {
        f64::NAN
    }

    fn foot_error(&self, width: f64) -> f64 {
        2.0 * self.source.foot_error(width) / self.slope.sqrt()
    }
}

/// √D / √v².
#[derive(Clone, Copy, Debug)]
pub struct Rate<'a, const M: usize> {
    pub source: Source<'a, M>,
    pub line: Line,
    /// Where D or v² is 0; NaN if neither is.
    pub foot: f64,
}

impl<const M: usize> Integrand for Rate<'_, M> {
    #[inline(always)]
    fn at(&self, u: f64) -> f64 {
        let speed = self.source.at(u);
        if self.line.slope == 0.0 {
            speed / self.line.start.sqrt()
        } else {
            speed / self.line.at(u).sqrt()
        }
    }

    #[inline(always)]
    fn at_each<const K: usize>(&self, u: [f64; K]) -> [f64; K] {
        let mut rates = self.source.at_each(u);
        // A division by 1 can be left out.
        if self.line.slope != 0.0 || self.line.start != 1.0 {
            for (rate, u) in rates.iter_mut().zip(u) {
                let square = if self.line.slope == 0.0 { self.line.start } else { self.line.at(u) };
                *rate /= square.sqrt();
            }
        }
        rates
    }

    // Within the disc v² falls to no less than half of its least value on [a, b].
    fn disc(&self, a: f64, b: f64) -> Disc {
        let disc = self.source.disc(a, b);
        let least = self.line.at(a).min(self.line.at(b));
        if self.line.slope == 0.0 {
            return Disc { bound: disc.bound / least.sqrt(), ..disc };
        }
        Disc {
            radius: disc.radius.min(0.5 * least / self.line.slope.abs()),
            bound: disc.bound * (2.0 / least).sqrt(),
        }
    }

    fn foot(&self) -> f64 {
        self.foot
    }

    // The bound of the speed over √v²: in the worst case v² is `slope` times the distance from the foot.
    fn foot_error(&self, width: f64) -> f64 {
        let speed = self.source.foot_error(width);
        if self.line.slope == 0.0 {
            speed / self.line.start.sqrt()
        } else {
            2.0 * speed / (self.line.slope.abs() * width).sqrt()
        }
    }
}
