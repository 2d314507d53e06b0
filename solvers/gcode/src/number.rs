//! Reads a decimal number of a part program, to the nearest f64.
//!
//! The grammar is that of RS-274: a sign, digits with at most one point, no exponent. Blanks may stand before the number
//! and after its sign, since posts pad columns with them, but not inside: `X1 2` is not X12.

use super::tolerance::NEAR_INTEGER;

/// Powers of ten, which an f64 holds exactly.
const POWERS: [f64; 16] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// The greatest number of digits that always make an integer below 2^53.
const EXACT_DIGITS: usize = 15;

/// The number at `at`, after blanks, and the place after it; None where no number begins.
///
/// It is correctly rounded: with up to 15 digits the mantissa and the power of ten are exact, and one division rounds
/// once. The standard library reads longer numbers.
#[inline(always)]
pub fn decimal(source: &[u8], at: usize) -> Option<(f64, usize)> {
    let mut at = spaces(source, at);
    let mut negative = false;
    if let Some(b'-' | b'+') = source.get(at) {
        negative = source[at] == b'-';
        at = spaces(source, at + 1);
    }
    let first = at;
    let mut mantissa = 0u64;
    let whole = digits(source, &mut at, &mut mantissa);
    let mut fraction = 0;
    if source.get(at) == Some(&b'.') {
        at += 1;
        fraction = digits(source, &mut at, &mut mantissa);
    }
    let size = match whole + fraction {
        0 => return None,
        count if count <= EXACT_DIGITS => mantissa as f64 / POWERS[fraction],
        _ => parse(&source[first..at]),
    };
    Some((if negative { -size } else { size }, at))
}

/// The integer that a number stands for; None if it is not within `NEAR_INTEGER` of one.
pub fn integer(value: f64) -> Option<i64> {
    let nearest = value.round();
    ((value - nearest).abs() <= NEAR_INTEGER && nearest.abs() < 1e15).then_some(nearest as i64)
}

/// The first place at or after `at` that is neither a space nor a tab.
#[inline(always)]
pub fn spaces(source: &[u8], mut at: usize) -> usize {
    while let Some(b' ' | b'\t') = source.get(at) {
        at += 1;
    }
    at
}

/// The place after a word that stands at `at` in capital or small letters; None where another text does.
pub fn behind_word(source: &[u8], at: usize, word: &str) -> Option<usize> {
    let text = source.get(at..at + word.len())?;
    text.eq_ignore_ascii_case(word.as_bytes()).then_some(at + word.len())
}

/// Reads digits into the mantissa and counts them; a mantissa that overflows is not used.
#[inline(always)]
fn digits(source: &[u8], at: &mut usize, mantissa: &mut u64) -> usize {
    let first = *at;
    while let Some(digit) = source.get(*at).map(|byte| byte.wrapping_sub(b'0')).filter(|&digit| digit < 10) {
        *mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        *at += 1;
    }
    *at - first
}

/// The value of digits with at most one point, which the standard library reads without error.
#[cold]
fn parse(text: &[u8]) -> f64 {
    std::str::from_utf8(text).ok().and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(text: &str) -> Option<(f64, usize)> {
        decimal(text.as_bytes(), 0)
    }

    #[test]
    fn the_forms_that_posts_write_are_read() {
        for (text, value, end) in [
            ("1", 1.0, 1),
            (".5", 0.5, 2),
            ("5.", 5.0, 2),
            ("+1", 1.0, 2),
            ("-.25Y", -0.25, 4),
            ("0012.50 ", 12.5, 7),
            ("  -25.409", -25.409, 9),
            ("-  5", -5.0, 4),
            ("1e3", 1.0, 1),
            ("1.2.3", 1.2, 3),
            ("1 2", 1.0, 1),
        ] {
            assert_eq!(read(text), Some((value, end)), "{text}");
        }
    }

    #[test]
    fn what_has_no_digit_is_no_number() {
        for text in ["", ".", "-", "+.", "--1", "X1", "[1]", "\n1"] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn long_numbers_are_rounded_once() {
        for text in ["0.1234567890123456789", "9007199254740993", "123456789012345678901234567890.5"] {
            assert_eq!(read(text).unwrap().0, text.parse::<f64>().unwrap());
        }
    }

    proptest! {
        #[test]
        fn every_decimal_is_the_nearest_double(text in "[0-9]{0,12}\\.[0-9]{1,12}") {
            prop_assert_eq!(read(&text), Some((text.parse().unwrap(), text.len())));
        }
    }
}
