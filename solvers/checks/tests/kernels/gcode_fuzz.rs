//! For any bytes, the G-code reader returns columns that fit together, or one sentence with a line of the program.

use feedplan_gcode::{read, Columns, CoordinateMode, Options, Place, Point, ReadError, TipControl};
use proptest::prelude::*;
use proptest::string::string_regex;

/// A machine whose tool always points down, below the joints.
struct Upright;

impl TipControl for Upright {
    fn check(&self, _: CoordinateMode) -> Result<(), String> {
        Ok(())
    }

    fn joints(&self, _: CoordinateMode, length: f64, _: &Point, path: &[Place]) -> Result<Point, String> {
        let mut joints = path.last().ok_or("a path has no position")?.0;
        joints[2] += if length.is_nan() { 100.0 } else { length };
        Ok(joints)
    }

    fn place(&self, mode: CoordinateMode, length: f64, joints: &Point) -> Result<Place, String> {
        let mut tip = *joints;
        if mode != CoordinateMode::Joints {
            tip[2] -= if length.is_nan() { 100.0 } else { length };
        }
        Ok((tip, [0.0, 0.0, 1.0]))
    }
}

fn limited() -> Options {
    let machine_axes = b"XYZABCUVW".to_vec();
    Options { max_moves: 10_000, machine_axes, tip_control: Some(Box::new(Upright)), ..Options::default() }
}

fn check(source: &[u8]) -> Result<(), TestCaseError> {
    for block_delete in [true, false] {
        match read(source, &Options { block_delete, ..limited() }, &|_| ()) {
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
    prop_assert!(columns.line.iter().all(|&line| 0 < line && line as usize <= lines(source)));
    prop_assert_eq!(columns.stop[count - 1], true);
    let arcs: Vec<i64> = (0..count).filter(|&row| columns.kind[row] == 2).map(|row| row as i64).collect();
    prop_assert_eq!(&columns.arc_move, &arcs);
    prop_assert!(columns.arc_angle.iter().all(|angle| *angle != 0.0 && angle.is_finite()));
    check_splines(columns)?;
    check_changes(columns)?;
    prop_assert!(columns.arc_centre.iter().all(|value| value.is_finite()));
    Ok(())
}

/// Every spline has pieces, from its start to its target.
fn check_splines(columns: &Columns) -> Result<(), TestCaseError> {
    let width = columns.axes.len();
    let rows: Vec<i64> =
        (0..columns.kind.len()).filter(|&row| columns.kind[row] == 3).map(|row| row as i64).collect();
    prop_assert_eq!(&columns.spline_move, &rows);
    prop_assert_eq!(columns.spline_pieces.len(), rows.len() + 1);
    prop_assert!(columns.spline_pieces.windows(2).all(|pair| pair[0] < pair[1]));
    prop_assert_eq!(columns.spline_pieces[rows.len()] as usize, columns.spline_width.len());
    prop_assert_eq!(columns.spline_offsets.len(), columns.spline_width.len() + 1);
    prop_assert!(columns.spline_control.iter().all(|value| value.abs() <= 1e8));
    prop_assert!(columns.spline_width.iter().all(|&width| width > 0.0 && width.is_finite()));
    prop_assert!(columns.spline_weights.iter().all(|&weight| weight > 0.0 && weight.is_finite()));
    for (i, &row) in rows.iter().enumerate() {
        let end = columns.spline_offsets[columns.spline_pieces[i + 1] as usize];
        let last = &columns.spline_control[(end - 1) * width..end * width];
        let target = &columns.target[row as usize * width..(row as usize + 1) * width];
        // Splines are not read where tool directions are programmed.
        let linear = columns.axes.iter().filter(|letter| !b"IJK".contains(letter)).count();
        prop_assert_eq!(&last[..linear], &target[..linear]);
    }
    Ok(())
}

/// The coordinate mode changes in the rows of its changes, and directions are unit vectors.
fn check_changes(columns: &Columns) -> Result<(), TestCaseError> {
    let (count, width) = (columns.kind.len(), columns.axes.len());
    prop_assert_eq!((columns.coordinate_mode.len(), columns.tool_length.len()), (count, count));
    prop_assert_eq!(columns.change_start.len(), columns.change_move.len() * width);
    prop_assert!(columns.change_start.iter().all(|value| value.abs() <= 1e8));
    prop_assert!(columns.change_move.windows(2).all(|pair| pair[0] < pair[1]));
    for row in 1..count {
        let same = columns.coordinate_mode[row] == columns.coordinate_mode[row - 1];
        prop_assert!(same || columns.change_move.contains(&(row as i64)));
    }
    prop_assert_eq!(columns.axes.ends_with(b"IJK"), columns.coordinate_mode.contains(&2));
    if columns.axes.ends_with(b"IJK") {
        for row in columns.target.chunks_exact(width) {
            let size = row[width - 3..].iter().map(|value| value * value).sum::<f64>();
            prop_assert!((size - 1.0).abs() < 1e-12);
        }
    }
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

/// Words that often enough fit together, so that the reader gets beyond the first line.
fn word() -> impl Strategy<Value = String> {
    let codes = "G0|G1|G2|G3|G4|G5|G5\\.1|G5\\.2|G5\\.3|G6\\.2|G43\\.4|G43\\.5|G10|G17|G18|G19|G20|G21|G28|G30|G40|G43|G43\\.1|G49|G52|G53|G54|G59\\.3|G61|G64|G73|G80|\
                 G81|G82|G83|G85|G89|G90|G91|G90\\.1|G91\\.1|G92|G92\\.1|G92\\.2|G92\\.3|G93|G94|G95|G98|G99|M0|M3|M5|M6|M30|L2|L20";
    // Regular expressions are parsed here once, not for each word.
    let text = |expression: &str| string_regex(expression).expect("an expression");
    prop_oneof![
        4 => text("[XYZIJKRPQFSLABCUVWHDTN]-?[0-9]{1,3}(\\.[0-9]{0,3})?"),
        4 => text(codes),
        1 => text("[XYZF](\\[[0-9+*/ -]{1,6}\\]|#[1-3]|SIN\\[3\\]|#<a>)"),
        1 => text("#[1-3]=[0-9]"),
        1 => text("[()/%;:O#=,.]{1,2}"),
    ]
}

const SPLINES: [&str; 20] = [
    "G5 I0 J3 P0 Q-3 X2 Y2",
    "P1 Q1 X3 Y4",
    "G5.1 X5 Y3 I1 J1",
    "G5.2 P1 L3",
    "X0 Y1 P1",
    "X2 Y2 P2",
    "X2 Y0 P1",
    "G5.3",
    "G6.2 P2 K0",
    "K0 X1 Y1 Z1 R2",
    "K1 X2 Y2 A5",
    "K2",
    "K2",
    "G43.4 H1",
    "G43.1 Z50",
    "G43.5",
    "G1 X2 I1 J1 K5",
    "I1 K-1",
    "G49",
    "G1 X5 A5",
];

/// Lines of program flow, compensation, cycles, corners and tools.
const FLOW: [&str; 40] = [
    "o1 sub",
    "o1 endsub [#1]",
    "o1 call [1] [#2]",
    "o1 return",
    "o2 if [#1 LT 3]",
    "o2 elseif [#<a>]",
    "o2 else",
    "o2 endif",
    "o3 while [#3 LT 4]",
    "o3 endwhile",
    "o3 break",
    "o3 continue",
    "o4 repeat [3]",
    "o4 endrepeat",
    "o5 do",
    "o5 while [0]",
    "#1=[#1+1] #3=[#3+1]",
    "#<a>=[#5420+1]",
    "#5221=5 #5230=30",
    "M98 P7 L2",
    "O7",
    "M99",
    "M97 P5",
    "N5 G0 X[#3]",
    "G41.1 D2",
    "G42.1 D-1",
    "G40 G0 X0",
    "G1 X[5*#1] Y3",
    "G3 X9 Y9 R20",
    "G2 I5 J5",
    "G1 X5 Y5 ,R1",
    "G1 Y9 ,C1",
    "G10 L2 P1 X1 R30",
    "G92 X3",
    "G0 @5 ^[30*#1]",
    "G91 G81 X1 Z-1 R2 L3",
    "M70",
    "M72",
    "G18 G76 P1 Z-9 I-1 J.1 K.5 L3 E1",
    "G10 L1 P1 R3 Z5",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Lines of program flow and of compensated paths in any order; few of them are a valid program.
    #[test]
    fn any_blocks_of_flow(blocks in proptest::collection::vec(0..FLOW.len(), 1..40)) {
        let mut source = String::from("G21 G90 F100 S100 M3 G0 X1 Y2 Z5\n");
        for block in blocks {
            source += FLOW[block];
            source.push('\n');
        }
        check(source.as_bytes())?;
    }

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

    /// Reads each block by itself, so that an error does not hide the blocks after it.
    #[test]
    fn any_block_after_a_good_start(words in proptest::collection::vec(word(), 1..7)) {
        let source = format!("G21 G90 F100 S100 M3 G1 X10 Y0 Z5\n{}\nX1 Y1\n", words.join(" "));
        check(source.as_bytes())?;
    }

    /// Splines, tips and directions with blocks that are lost, repeated or extended.
    #[test]
    fn any_blocks_of_splines(
        blocks in proptest::collection::vec((0..SPLINES.len(), proptest::option::of(word())), 1..30),
    ) {
        let mut source = String::from("G21 G90 F100 G17 G1 X10 Y0 Z5\n");
        for (block, more) in blocks {
            source += SPLINES[block];
            source += &more.filter(|word| word.len() % 4 == 0).unwrap_or_default();
            source.push('\n');
        }
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
