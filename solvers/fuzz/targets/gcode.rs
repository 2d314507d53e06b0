//! Any bytes give moves of finite numbers, or an error.

#![no_main]

use feedplan_gcode::{read, Options};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|source: &[u8]| {
    let options = Options { machine_axes: b"XYZABC".to_vec(), max_moves: 100_000, ..Options::default() };
    if let Ok(columns) = read(source, &options, &|_| ()) {
        assert!(columns.target.iter().chain(&columns.start).all(|place| place.is_finite()));
    }
});
