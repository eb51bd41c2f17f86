//! Seconds in decimal text to integer nanoseconds and back, without a detour through floating point.
//!
//! A recording's timestamps join scans with truth and relations, so `976052857.337284` must become the same
//! integer wherever it is read; a 64-bit float already rounds such a number to about a tenth of a microsecond.

/// Parses seconds such as `976052857.337284`, `-0.5` or `1.5e3` into nanoseconds.
///
/// Digits beyond the ninth decimal are rounded half away from zero. `None` when the text is not a decimal number
/// or does not fit 64 bits (about ±292 years).
pub fn parse_seconds_ns(text: &str) -> Option<i64> {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let (is_negative, digits) = match mantissa.as_bytes().first()? {
        b'-' => (true, &mantissa[1..]),
        b'+' => (false, &mantissa[1..]),
        _ => (false, mantissa),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = whole.bytes().chain(fraction.bytes());
    if whole.len() + fraction.len() == 0 || !all_digits.clone().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let num_kept = i64::try_from(whole.len()).ok()? + i64::from(exponent) + 9;
    let magnitude = leading_digits(all_digits, num_kept)?;
    i64::try_from(if is_negative { -magnitude } else { magnitude }).ok()
}

/// The number made of the first `num_kept` digits, zeros where the text has ended, rounded by the next digit.
fn leading_digits(digits: impl Iterator<Item = u8>, num_kept: i64) -> Option<i128> {
    if num_kept < 0 {
        return Some(0);
    }
    let mut value = 0i128;
    let mut digits = digits.map(|byte| i128::from(byte - b'0'));
    for position in 0..num_kept {
        // Nothing above 64 bits is ever an answer, and stopping here bounds the loop for any exponent.
        let digit = digits.next();
        if digit.is_none() && value == 0 {
            return Some(0);
        }
        value = value * 10 + digit.unwrap_or(0);
        if value > i128::from(i64::MAX) + 1 || position > 4096 {
            return None;
        }
    }
    Some(value + i128::from(digits.next().is_some_and(|digit| digit >= 5)))
}

/// Writes nanoseconds as seconds with six decimals where that is exact and nine where it is not.
pub fn format_seconds(timestamp_ns: i64) -> String {
    let sign = if timestamp_ns < 0 { "-" } else { "" };
    let magnitude = timestamp_ns.unsigned_abs();
    let (seconds, nanoseconds) = (magnitude / 1_000_000_000, magnitude % 1_000_000_000);
    if nanoseconds.is_multiple_of(1000) {
        format!("{sign}{seconds}.{:06}", nanoseconds / 1000)
    } else {
        format!("{sign}{seconds}.{nanoseconds:09}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn reads_decimal_seconds_exactly() {
        assert_eq!(parse_seconds_ns("976052857.337284"), Some(976_052_857_337_284_000));
        assert_eq!(parse_seconds_ns("0.025466"), Some(25_466_000));
        assert_eq!(parse_seconds_ns("-0.5"), Some(-500_000_000));
        assert_eq!(parse_seconds_ns("12"), Some(12_000_000_000));
        assert_eq!(parse_seconds_ns(".25"), Some(250_000_000));
        assert_eq!(parse_seconds_ns("1.089804841e9"), Some(1_089_804_841_000_000_000));
        assert_eq!(parse_seconds_ns("8e-06"), Some(8000));
        assert_eq!(parse_seconds_ns("5e-10"), Some(1));
        assert_eq!(parse_seconds_ns("1e-999999"), Some(0));
        assert_eq!(parse_seconds_ns("0e999999"), Some(0));
    }

    #[test]
    fn refuses_what_is_not_a_time() {
        for text in ["", ".", "-", "nohost", "1.2.3", "0x10", "nan", "1e400000", "99999999999999", "1e"] {
            assert_eq!(parse_seconds_ns(text), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn writing_and_reading_gives_the_same_nanoseconds(timestamp_ns in any::<i64>()) {
            prop_assert_eq!(parse_seconds_ns(&format_seconds(timestamp_ns)), Some(timestamp_ns));
        }
    }
}
