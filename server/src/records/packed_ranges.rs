//! Scans packed for the disk: readings come back exactly as sent, in about a byte each.
//!
//! Lasers report whole millimetres or centimetres, and neighbouring beams differ little. So each scan is written as
//! integer multiples of the coarsest unit that reproduces every reading bit for bit (1 cm, 1 mm, 0.1 mm), each as
//! the zigzag difference to its predecessor in a variable number of bytes. A scan that no unit reproduces is written
//! as plain 32-bit floats. A reading without a return has a code of its own; which of the ways the client wrote it
//! (null, NaN, infinity, a reading at or above the maximum) is not kept.
//!
//! ```text
//! [unit u8][per reading: varint, 0 = no return, else 1 + zigzag(multiple − previous multiple)]   unit 1, 2, 3
//! [0][per reading: f32, NaN = no return]                                                         unit 0
//! ```

/// Readings per metre of each unit; index 0 stands for plain floats.
const UNITS_PER_METER: [f64; 4] = [0.0, 100.0, 1000.0, 10_000.0];

/// Appends the packed form of one scan's readings; NaN means "no return".
pub fn pack_ranges(ranges_m: &[f32], out: &mut Vec<u8>) {
    let start = out.len();
    for unit in 1..UNITS_PER_METER.len() {
        if pack_in_unit(ranges_m, unit, out) {
            return;
        }
        out.truncate(start);
    }
    out.push(0);
    for range_m in ranges_m {
        out.extend(range_m.to_le_bytes());
    }
}

/// Takes `num_ranges` readings off the front of `bytes`; `None` when the bytes are not of this form.
pub fn unpack_ranges(bytes: &mut &[u8], num_ranges: usize) -> Option<Vec<f32>> {
    let (&unit, rest) = bytes.split_first()?;
    *bytes = rest;
    // Every reading takes at least one byte, so damaged counts cannot ask for absurd amounts of memory.
    if num_ranges > bytes.len() {
        return None;
    }
    if unit == 0 {
        let (floats, rest) = bytes.split_at_checked(num_ranges.checked_mul(4)?)?;
        *bytes = rest;
        return Some(floats.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect());
    }
    let per_meter = *UNITS_PER_METER.get(usize::from(unit))?;
    let mut ranges_m = Vec::with_capacity(num_ranges);
    let mut previous = 0i64;
    for _ in 0..num_ranges {
        let code = read_varint(bytes)?;
        if code == 0 {
            ranges_m.push(f32::NAN);
            continue;
        }
        previous = previous.wrapping_add(unzigzag(code - 1));
        ranges_m.push(multiple_to_meters(previous, per_meter));
    }
    Some(ranges_m)
}

/// False when some reading is not a multiple of the unit.
fn pack_in_unit(ranges_m: &[f32], unit: usize, out: &mut Vec<u8>) -> bool {
    let per_meter = UNITS_PER_METER[unit];
    out.push(unit as u8);
    let mut previous = 0i64;
    for &range_m in ranges_m {
        if range_m.is_nan() {
            out.push(0);
            continue;
        }
        // The cast saturates, and a saturated multiple does not reproduce the reading.
        let multiple = (f64::from(range_m) * per_meter).round() as i64;
        if multiple.unsigned_abs() > 1 << 40
            || multiple_to_meters(multiple, per_meter).to_bits() != range_m.to_bits()
        {
            return false;
        }
        write_varint(1 + zigzag(multiple - previous), out);
        previous = multiple;
    }
    true
}

/// The float that a decimal number of metres is read as.
fn multiple_to_meters(multiple: i64, per_meter: f64) -> f32 {
    (multiple as f64 / per_meter) as f32
}

fn zigzag(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

fn unzigzag(code: u64) -> i64 {
    (code >> 1) as i64 ^ -((code & 1) as i64)
}

fn write_varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn read_varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0u64;
    for shift in (0..63).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn there_and_back(ranges_m: &[f32]) -> (Vec<f32>, usize) {
        let mut bytes = Vec::new();
        pack_ranges(ranges_m, &mut bytes);
        let mut rest = bytes.as_slice();
        let back = unpack_ranges(&mut rest, ranges_m.len()).unwrap();
        assert!(rest.is_empty());
        (back, bytes.len())
    }

    fn bits(ranges_m: &[f32]) -> Vec<u32> {
        ranges_m.iter().map(|r| if r.is_nan() { f32::NAN.to_bits() } else { r.to_bits() }).collect()
    }

    #[test]
    fn centimeters_take_about_a_byte() {
        let ranges_m: Vec<f32> =
            (0..180).map(|i| format!("{:.2}", 2.0 + 0.01 * (i % 30) as f64).parse().unwrap()).collect();
        let (back, num_bytes) = there_and_back(&ranges_m);
        assert_eq!(bits(&back), bits(&ranges_m));
        assert!(num_bytes < 190, "{num_bytes}");
    }

    proptest! {
        #[test]
        fn any_floats_come_back_exactly(ranges_m in proptest::collection::vec(any::<f32>(), 0..200)) {
            prop_assert_eq!(bits(&there_and_back(&ranges_m).0), bits(&ranges_m));
        }

        #[test]
        fn decimals_come_back_exactly(millimeters in proptest::collection::vec(0..90_000u32, 0..200)) {
            let ranges_m: Vec<f32> =
                millimeters.iter().map(|mm| format!("{}.{:03}", mm / 1000, mm % 1000).parse().unwrap()).collect();
            let (back, num_bytes) = there_and_back(&ranges_m);
            prop_assert_eq!(bits(&back), bits(&ranges_m));
            prop_assert!(num_bytes <= 1 + 3 * ranges_m.len());
        }

        #[test]
        fn damaged_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..100), n in 0..1000usize) {
            let _ = unpack_ranges(&mut bytes.as_slice(), n);
        }
    }
}
