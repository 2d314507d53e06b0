//! When a speed profile reaches a place of its path, on the clock of the setpoints.
//!
//! The clock starts every run anew: setpoints may wait at a stop for their next period.

use super::arcs::Arcs;
use super::curve::{length, Followed};
use super::motion::Motion;
use super::place::Place;
use super::{Limits, EPS, ROUNDINGS};

/// A profile of good numbers on the clock of the setpoints.
#[derive(Clone, Copy)]
pub struct Timed<'a> {
    pub arcs: Arcs<'a>,
    /// When every arc begins and the last one ends, pauses included; see `Arcs::starts`.
    pub starts: &'a [f64],
    /// When every run begins, as far as the setpoints have shown: a stream may wait at a stop for its next period.
    pub clock: &'a [f64],
}

/// A place on the profile.
pub struct Passage<const M: usize> {
    pub arc: usize,
    pub run: usize,
    pub motion: Motion<M>,
    /// Local parameter, and the same as the arc's integration variable.
    u: f64,
    pub y: f64,
}

impl Timed<'_> {
    pub fn arcs_of(&self, run: usize) -> std::ops::Range<usize> {
        self.arcs.runs[run] as usize..self.arcs.runs[run + 1] as usize
    }

    /// Time in motion of a run, in s.
    pub fn motion_time(&self, run: usize) -> f64 {
        self.arcs_of(run).last().map_or(0.0, |last| {
            self.starts[last] + self.arcs.duration[last] - self.starts[self.arcs_of(run).start]
        })
    }

    /// What has to be added to the profile's times in a run; without a clock for it, the run is never reached.
    pub fn shift(&self, run: usize) -> f64 {
        self.clock.get(run).map_or(f64::INFINITY, |clock| clock - self.starts[self.arcs_of(run).start])
    }

    /// The start of the arc that `time` falls into.
    pub fn place_before(&self, path: &Followed, time: f64) -> Place {
        let run = self.clock.partition_point(|&clock| clock <= time).saturating_sub(1);
        let arcs = self.arcs_of(run);
        if arcs.is_empty() {
            return Place { piece: (path.runs[run] as usize).min(path.len() - 1), u: 0.0 };
        }
        let time = time - self.shift(run);
        let passed = self.starts[arcs.clone()].partition_point(|&start| start <= time);
        let arc = arcs.start + passed.saturating_sub(1);
        Place { piece: self.arcs.piece[arc] as usize, u: self.arcs.u0[arc] }
    }

    pub fn passage<const M: usize>(&self, path: &Followed, place: Place) -> Passage<M> {
        let arcs = &self.arcs;
        let last = arcs.len() - 1;
        let mut arc = arcs.piece.partition_point(|&piece| (piece as usize) < place.piece).min(last);
        while arc < last && arcs.piece[arc + 1] as usize == place.piece && arcs.u1[arc] < place.u {
            arc += 1;
        }
        let run = arcs.runs.partition_point(|&first| first <= arc as i64) - 1;
        let motion = arcs.motion::<M>(arc, &path.curve(arcs.piece[arc] as usize));
        // A place on a motionless piece is the start of what comes next.
        let u = if arcs.piece[arc] as usize == place.piece { place.u } else { arcs.u0[arc] };
        let y = motion.y_at(if motion.anchored_at_end { arcs.u1[arc] - u } else { u - arcs.u0[arc] });
        Passage { arc, run, motion, u, y }
    }

    /// When the profile arrives at a place and when it leaves, in s: at stops it pauses, and the setpoints may wait
    /// for their next period.
    fn times<const M: usize>(&self, path: &Followed, here: &Passage<M>, period: f64) -> [f64; 2] {
        let (arcs, &Passage { arc, run, u, .. }) = (&self.arcs, here);
        let start = self.starts[arc] + self.shift(run);
        let end = start + arcs.duration[arc];
        let from_anchor = here.motion.time_from_anchor(here.y);
        let time = if here.motion.anchored_at_end { end - from_anchor } else { start + from_anchor };
        let (mut from, mut until) = (time, time);
        if u <= arcs.u0[arc] && arc == self.arcs_of(run).start && run > 0 {
            from = self.clock.get(run - 1).map_or(time, |clock| clock + self.motion_time(run - 1));
        }
        if u >= arcs.u1[arc] && arc + 1 == self.arcs_of(run).end {
            until = self.clock.get(run + 1).copied().unwrap_or(end + path.dwell[run] + period);
        }
        [from, until]
    }

    /// At most how far the profile gets between `time` and being at `place`, in mm, less what may be rounding.
    pub fn late<const M: usize>(&self, path: &Followed, place: Place, time: f64, limits: &Limits<M>) -> f64 {
        let here = self.passage::<M>(path, place);
        let [from, until] = self.times(path, &here, limits.period);
        let wait = (from - time).max(time - until).max(0.0);
        let speed = length(&here.motion.state(here.y).velocity);
        let reach = |wait: f64| wait * (speed + 0.5 * wait * length(&limits.acceleration));
        // Summing the durations of all arcs before has rounded once for each.
        reach(wait) - reach(EPS * time.abs() * (here.arc as f64 + ROUNDINGS))
    }
}
