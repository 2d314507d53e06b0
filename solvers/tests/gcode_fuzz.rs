//! Whatever the bytes, the G-code reader returns columns that fit together, or one sentence with a line that exists.

use feedplan_solvers::gcode::{read, Columns, Options, ReadError};
use proptest::prelude::*;

fn limited() -> Options {
    Options { max_moves: 10_000, ..Options::default() }
}

fn check(source: &[u8]) -> Result<(), TestCaseError> {
    for block_delete in [true, false] {
        match read(source, &Options { block_delete, ..limited() }) {
            Ok(columns) => check_columns(source, &columns)?,
            Err(error) => check_error(source, &error)?,
        }
    }
    Ok(())
}

fn check_columns(source: &[u8], columns: &Columns) -> Result<(), TestCaseError> {
    let count = columns.kind.len();
    let rows = [columns.feed.len(), columns.line.len(), columns.control.len(), columns.blend_tolerance.len()];
    prop_assert!(count > 0 && rows.iter().all(|&rows| rows == count));
    prop_assert_eq!(
        (columns.fit_tolerance.len(), columns.stop.len(), columns.dwell.len(), columns.target.len()),
        (count, count, count, count * columns.axes.len())
    );
    prop_assert!(columns.target.iter().all(|value| value.abs() <= 1e8));
    prop_assert!(columns
        .kind
        .iter()
        .zip(&columns.feed)
        .all(|(&kind, &feed)| (kind == 0) == feed.is_infinite()));
    prop_assert!(columns.feed.iter().all(|&feed| feed > 0.0));
    prop_assert!(columns.dwell.iter().all(|&dwell| dwell >= 0.0 && dwell.is_finite()));
    prop_assert!(columns.line.windows(2).all(|pair| 0 < pair[0] && pair[0] <= pair[1]));
    prop_assert!(columns.line[count - 1] as usize <= lines(source));
    prop_assert_eq!(columns.stop[count - 1], true);
    let arcs: Vec<i64> = (0..count).filter(|&row| columns.kind[row] == 2).map(|row| row as i64).collect();
    prop_assert_eq!(&columns.arc_move, &arcs);
    prop_assert!(columns.arc_angle.iter().all(|angle| *angle != 0.0 && angle.is_finite()));
    prop_assert!(columns.arc_centre.as_flattened().iter().all(|value| value.is_finite()));
    Ok(())
}

fn check_error(source: &[u8], error: &ReadError) -> Result<(), TestCaseError> {
    prop_assert!(error.line.is_none_or(|line| 1 <= line && line as usize <= lines(source)), "{error:?}");
    prop_assert!(!error.message.is_empty() && !error.message.contains(['\n', '\r', '\0']), "{error:?}");
    prop_assert!(error.message.len() < 1000, "{error:?}");
    Ok(())
}

fn lines(source: &[u8]) -> usize {
    1 + source.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count()
}

/// Words that go together often enough to get past the first line.
fn word() -> impl Strategy<Value = String> {
    let codes = "G0|G1|G2|G3|G4|G10|G17|G18|G19|G20|G21|G28|G30|G40|G43|G43\\.1|G49|G52|G53|G54|G59\\.3|G61|G64|G73|G80|\
                 G81|G82|G83|G85|G89|G90|G91|G90\\.1|G91\\.1|G92|G92\\.1|G92\\.2|G92\\.3|G93|G94|G95|G98|G99|M0|M3|M5|M6|M30|L2|L20";
    prop_oneof![
        4 => "[XYZIJKRPQFSLABCUVWHDTN]-?[0-9]{1,3}(\\.[0-9]{0,3})?",
        4 => codes,
        1 => "[XYZF](\\[[0-9+*/ -]{1,6}\\]|#[1-3]|SIN\\[3\\]|#<a>)",
        1 => "#[1-3]=[0-9]",
        1 => "[()/%;:O#=,.]{1,2}",
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_bytes(source in proptest::collection::vec(any::<u8>(), 0..200)) {
        check(&source)?;
    }

    #[test]
    fn any_text_of_the_alphabet(source in "[GMXYZIJKRFPQLNOTSEgx0-9.+\\-#<>=*/%();:\\[\\] \\t\\r\\n]{0,200}") {
        check(source.as_bytes())?;
    }

    #[test]
    fn any_words(words in proptest::collection::vec(word(), 0..60), ends in "[ \\n]{60}") {
        let mut source = String::from("G21 G90 F100 G1 X0 Y0 Z0\n");
        for (word, end) in words.iter().zip(ends.chars()) {
            source += word;
            source.push(end);
        }
        check(source.as_bytes())?;
    }

    /// One block after the other by itself, so that errors do not hide what follows.
    #[test]
    fn any_block_after_a_good_start(words in proptest::collection::vec(word(), 1..7)) {
        let source = format!("G21 G90 F100 S100 M3 G1 X10 Y0 Z5\n{}\nX1 Y1\n", words.join(" "));
        check(source.as_bytes())?;
    }

    #[test]
    fn a_good_program_cut_anywhere(cut in 0usize..400) {
        let source = "%\nO0001 (CUT)\nN10 G21 G90 G17 G54\nT1 M6\nG43 H1 Z10.\nG0 X0. Y0.\n#1=[2*3]\nG1 Z-1. F#1\n\
                      G2 X10. Y10. I10. J0.\nG3 X0. R10.\nG98 G83 X5. Y5. Z-10. R2. Q3.\nX6.\nG80\nG91 G28 Z0.\nG93 G1 X5 F2\n\
                      M30\n%\n";
        check(&source.as_bytes()[..cut.min(source.len())])?;
    }
}
