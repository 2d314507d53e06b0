//! Look-ahead over whole runs as controllers do it: how fast the ends of segments may be passed, each segment having one
//! greatest acceleration of speeding up and one of slowing down.
//!
//! Between the speeds v and w at its ends a segment of length L changes v² by at most 2 a L, less what it holds the
//! speed at an end: for the time T after v and S before w, so that w² − v² = 2 a (L − v T − w S), or with h = a T and
//! k = a S
//!
//! ```text
//! (w + k)² = (v − h)² + 2 a L + k² − h²
//! ```
//!
//! and where it slows down the same from its end back.
//!
//! One pass backward and one forward find the greatest speeds; without holds they are those of grbl and Klipper.

/// Segments in the order of the path, and the speeds at their ends.
pub struct Segments<'a> {
    pub up: &'a [Change],
    pub down: &'a [Change],
}

/// What speeding up, or slowing down, can do on a segment.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// 2 a L: what v² can change by, in mm²/s².
    pub gain: f64,
    /// a T and a S of the start and the end, in mm/s; 0 where the speed need not be held.
    pub hold: [f64; 2],
}

impl Segments<'_> {
    /// Lowers the greatest speeds at the ends of the segments, in mm/s, one more than segments, to those from which
    /// and to which the segments lead. The lower of two speeds that are held must leave a segment room for both.
    pub fn lower(&self, speed: &mut [f64]) {
        // Backward: no end faster than full braking to the one after.
        for (i, down) in self.down.iter().enumerate().rev() {
            let [start, end] = down.hold;
            speed[i] = speed[i].min(reached(speed[i + 1], end, down.gain, start));
        }
        // Forward: none faster than full acceleration from the one before.
        for (i, up) in self.up.iter().enumerate() {
            let [start, end] = up.hold;
            speed[i + 1] = speed[i + 1].min(reached(speed[i], start, up.gain, end));
        }
    }
}

/// The greatest speed over a segment from `speed`, held there by `here` and at the other end by `there`.
fn reached(speed: f64, here: f64, gain: f64, there: f64) -> f64 {
    if here == 0.0 && there == 0.0 {
        return (speed * speed + gain).sqrt();
    }
    // The held speed of the other end is at least this one's, which the room for both allows.
    let square = (speed - here) * (speed - here) + gain + (there - here) * (there + here);
    (square.max(0.0).sqrt() - there).max(speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lowers speeds over segments that can speed up and slow down alike.
    fn lower(change: &[Change], speed: &mut [f64]) {
        Segments { up: change, down: change }.lower(speed);
    }

    #[test]
    fn speeds_fall_to_full_braking_and_full_acceleration() {
        // Three segments of 1 mm at 8 mm/s², from rest over a fast and a slow joint to rest.
        let mut speed = [0.0, 100.0, 1.0, 0.0];
        let change = [Change { gain: 16.0, hold: [0.0; 2] }; 3];
        lower(&change, &mut speed);
        assert_eq!(speed, [0.0, 4.0, 1.0, 0.0]);
        let mut slow_end = [100.0, 100.0, 100.0, 3.0];
        lower(&change, &mut slow_end);
        assert_eq!(slow_end, [57f64.sqrt(), 41f64.sqrt(), 5.0, 3.0]);
        // Slowing down half as hard: 8 mm²/s² a segment.
        let mut weak = [0.0, 100.0, 100.0, 1.0];
        Segments { up: &change, down: &change.map(|up| Change { gain: 8.0, ..up }) }.lower(&mut weak);
        assert_eq!(weak, [0.0, 4.0, 3.0, 1.0]);
    }

    #[test]
    fn a_held_speed_takes_its_way_from_the_ramp() {
        // From rest over 10 mm at 2 mm/s², the speed at the end held for 1.5 s: 8 mm of way remain for
        // v² = 4 (10 − 1.5 v), so v = 4 and 4 mm of ramp.
        let mut speed = [0.0, 100.0];
        lower(&[Change { gain: 40.0, hold: [0.0, 3.0] }], &mut speed);
        assert!((speed[1] - 4.0).abs() < 1e-15);
        let mut back = [100.0, 0.0];
        lower(&[Change { gain: 40.0, hold: [3.0, 0.0] }], &mut back);
        assert!((back[0] - 4.0).abs() < 1e-15);
        // Held at both ends for 1 s: 16 = 1 + 4 (10 − 1.25 · 5).
        let mut both = [1.0, 100.0];
        lower(&[Change { gain: 40.0, hold: [2.5, 2.5] }], &mut both);
        assert!((both[1] - 4.0).abs() < 1e-14);
        // Just long enough for the same speed all along.
        let mut same = [4.0, 4.0];
        lower(&[Change { gain: 40.0, hold: [2.5, 2.5] }], &mut same);
        assert_eq!(same, [4.0, 4.0]);
    }
}
