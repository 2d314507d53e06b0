//! Computes the trapezoidal plan of controllers: the greatest speeds at the ends of the segments of a run, from the greatest
//! acceleration and deceleration of each segment, by a backward and a forward pass. Without holds these are the speeds of grbl
//! and Klipper.
//!
//! A segment of length L [mm] between the speeds v and w [mm/s] changes v² by at most 2 a L, or less if it moves at constant
//! speed for a time: for T [s] at v and for S [s] at w. So w² − v² = 2 a (L − v T − w S), or with h = a T and k = a S
//!
//! ```text
//! (w + k)² = (v − h)² + 2 a L + k² − h²
//! ```
//!
//! Where the segment slows down, the same equation holds from its end to its start.

/// Segments in the order of the path.
pub struct Segments<'a> {
    pub up: &'a [Change],
    pub down: &'a [Change],
}

/// The greatest change of speed on a segment, up or down.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// 2 a L: the greatest change of v² [mm²/s²].
    pub gain: f64,
    /// a T and a S of the start and the end [mm/s]; 0 where the speed is not held.
    pub hold: [f64; 2],
}

impl Segments<'_> {
    /// Lowers the greatest speeds [mm/s] at the ends of the segments (one speed more than segments) to those that the segments
    /// before and after them allow. Between two held speeds the segment must be long enough to hold the lower one twice.
    pub fn lower(&self, speed: &mut [f64]) {
        // Backward: no end faster than full braking to the next one.
        for (i, down) in self.down.iter().enumerate().rev() {
            let [start, end] = down.hold;
            speed[i] = speed[i].min(reached(speed[i + 1], end, down.gain, start));
        }
        // Forward: no end faster than full acceleration from the one before.
        for (i, up) in self.up.iter().enumerate() {
            let [start, end] = up.hold;
            speed[i + 1] = speed[i + 1].min(reached(speed[i], start, up.gain, end));
        }
    }
}

/// The greatest speed at the other end of a segment from `speed` at this end, with the holds of both.
fn reached(speed: f64, here: f64, gain: f64, there: f64) -> f64 {
    if here == 0.0 && there == 0.0 {
        return (speed * speed + gain).sqrt();
    }
    // The other speed is at least this one, since the segment is long enough for both holds.
    let square = (speed - here) * (speed - here) + gain + (there - here) * (there + here);
    (square.max(0.0).sqrt() - there).max(speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same segments for speeding up and slowing down.
    fn lower(change: &[Change], speed: &mut [f64]) {
        Segments { up: change, down: change }.lower(speed);
    }

    #[test]
    fn speeds_fall_to_full_braking_and_full_acceleration() {
        // Three segments of 1 mm at 8 mm/s², from rest over a fast and a slow junction to rest.
        let mut speed = [0.0, 100.0, 1.0, 0.0];
        let change = [Change { gain: 16.0, hold: [0.0; 2] }; 3];
        lower(&change, &mut speed);
        assert_eq!(speed, [0.0, 4.0, 1.0, 0.0]);
        let mut slow_end = [100.0, 100.0, 100.0, 3.0];
        lower(&change, &mut slow_end);
        assert_eq!(slow_end, [57f64.sqrt(), 41f64.sqrt(), 5.0, 3.0]);
        // Braking at half the acceleration: 8 mm²/s² a segment.
        let mut weak = [0.0, 100.0, 100.0, 1.0];
        Segments { up: &change, down: &change.map(|up| Change { gain: 8.0, ..up }) }.lower(&mut weak);
        assert_eq!(weak, [0.0, 4.0, 3.0, 1.0]);
    }

    #[test]
    fn a_held_speed_takes_its_way_from_the_ramp() {
        // From rest over 10 mm at 2 mm/s², with the end speed held for 1.5 s: v² = 4 (10 − 1.5 v), so v = 4 after a
        // ramp of 4 mm.
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
        // Just long enough for a constant speed.
        let mut same = [4.0, 4.0];
        lower(&[Change { gain: 40.0, hold: [2.5, 2.5] }], &mut same);
        assert_eq!(same, [4.0, 4.0]);
    }
}
