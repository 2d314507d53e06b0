//! Writes rows of numbers as comma-separated text, with as few digits as are needed to read back the same number.

use std::fmt::Write;

use feedplan_geometry::parallel::map;

/// Rows that a thread takes at a time: enough to hide the cost of the hand-over, few enough to share evenly.
const BLOCK: usize = 4096;

/// One line for each row of `width` values, with the integer of the row as the last field.
///
/// Numbers that are not finite become `nan`, `inf` and `-inf`, which numpy and pandas read.
pub fn rows(values: &[f64], width: usize, last: &[i32]) -> Vec<u8> {
    assert_eq!(values.len(), width * last.len(), "every row has its values");
    let blocks = map(last.len().div_ceil(BLOCK), 1, |block| {
        let rows = block * BLOCK..last.len().min((block + 1) * BLOCK);
        let mut text = String::with_capacity(rows.len() * (width * 20 + 8));
        for i in rows {
            for &value in &values[i * width..(i + 1) * width] {
                push(&mut text, value);
                text.push(',');
            }
            writeln!(text, "{}", last[i]).expect("a string takes all text");
        }
        text
    });
    blocks.concat().into_bytes()
}

/// Uses Debug instead of Display: it writes exponents where Display would write hundreds of zeros.
fn push(text: &mut String, value: f64) {
    if value == 0.0 {
        text.push('0');
    } else if value.is_nan() {
        text.push_str("nan");
    } else {
        write!(text, "{value:?}").expect("a string takes all text");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn two_rows_of_two_values() {
        let text = rows(&[0.0, -1.5, 1e-9, 0.1], 2, &[7, -8]);
        assert_eq!(String::from_utf8(text).unwrap(), "0,-1.5,7\n1e-9,0.1,-8\n");
    }

    #[test]
    fn what_is_not_finite_has_the_names_other_readers_know() {
        let text = rows(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY], 3, &[1]);
        assert_eq!(String::from_utf8(text).unwrap(), "nan,inf,-inf,1\n");
    }

    #[test]
    fn no_rows_are_no_text() {
        assert!(rows(&[], 3, &[]).is_empty());
    }

    proptest! {
        #[test]
        fn every_number_reads_back_the_same(values in prop::collection::vec(any::<f64>(), 1..200)) {
            let last = vec![1; values.len()];
            let text = String::from_utf8(rows(&values, 1, &last)).unwrap();
            for (line, value) in text.lines().zip(&values) {
                let read: f64 = line.strip_suffix(",1").unwrap().parse().unwrap();
                prop_assert!(read == *value || (read.is_nan() && value.is_nan()));
            }
        }

        #[test]
        fn rows_keep_their_order_across_blocks(count in 1usize..3 * BLOCK) {
            let values: Vec<f64> = (0..count).map(|i| i as f64).collect();
            let last: Vec<i32> = (0..count as i32).collect();
            let text = String::from_utf8(rows(&values, 1, &last)).unwrap();
            prop_assert_eq!(text.lines().count(), count);
            for (i, line) in text.lines().enumerate() {
                let (value, integer) = line.split_once(',').unwrap();
                prop_assert_eq!(value.parse::<f64>().unwrap(), i as f64);
                prop_assert_eq!(integer.parse::<usize>().unwrap(), i);
            }
        }
    }
}
