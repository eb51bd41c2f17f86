//! Letters as a few strokes each, for the labels of plots; small enough to read here and free of font files.
//!
//! A glyph is drawn on a grid of 5 columns (0 to 4) and 9 rows (0 is the top of capitals, 6 the base line, 8 the
//! lowest descender). Each stroke is a chain of points, two digits each: column, then row.

/// Width of a glyph with the gap behind it, in grid units.
pub(super) const ADVANCE: f32 = 5.6;

/// The strokes of a character; capitals look like small letters, what is unknown is blank.
pub(super) fn strokes(character: char) -> Vec<Vec<(f32, f32)>> {
    let chains = match character.to_ascii_lowercase() {
        '0' => "10 01 05 16 36 45 41 30 10",
        '1' => "11 20 26,16 36",
        '2' => "01 10 30 41 42 06 46",
        '3' => "00 40 23 33 44 45 36 16 05",
        '4' => "36 30 04 44",
        '5' => "40 00 03 33 44 45 36 06",
        '6' => "30 10 02 05 16 36 45 44 33 03",
        '7' => "00 40 16",
        '8' => "13 02 01 10 30 41 42 33 13 04 05 16 36 45 44 33",
        '9' => "16 36 44 41 30 10 01 02 13 43",
        'a' => "12 32 43 46,44 14 05 16 36 45",
        'b' => "00 06 36 45 43 32 02",
        'c' => "42 12 03 05 16 46",
        'd' => "40 46 16 05 03 12 42",
        'e' => "04 44 43 32 12 03 05 16 46",
        'f' => "40 30 21 26,12 32",
        'g' => "42 12 03 05 16 46,42 47 38 18",
        'h' => "00 06,03 12 32 43 46",
        'i' => "22 26,20 20",
        'j' => "32 37 28 18,30 30",
        'k' => "00 06,42 04,13 46",
        'l' => "10 20 26,16 36",
        'm' => "06 02,03 12 23 26,23 32 43 46",
        'n' => "02 06,03 12 32 43 46",
        'o' => "12 03 05 16 36 45 43 32 12",
        'p' => "08 02 32 43 45 36 06",
        'q' => "48 42 12 03 05 16 46",
        'r' => "02 06,03 12 32",
        's' => "42 12 03 14 34 45 36 06",
        't' => "20 25 36,12 32",
        'u' => "02 05 16 36 45 42,45 46",
        'v' => "02 26 42",
        'w' => "02 16 23 36 42",
        'x' => "02 46,42 06",
        'y' => "02 25,42 18",
        'z' => "02 42 06 46",
        '.' => "25 26",
        ',' => "25 26 17",
        '-' => "13 33",
        '+' => "13 33,22 24",
        '/' => "06 40",
        ':' => "22 22,25 25",
        '%' => "06 40,00 11,35 46",
        '(' => "30 21 25 36",
        ')' => "10 21 25 16",
        '=' => "12 42,14 44",
        '<' => "41 13 45",
        '>' => "01 33 05",
        _ => "",
    };
    let point = |digits: &str| {
        let mut digits = digits.bytes().map(|byte| f32::from(byte - b'0'));
        (digits.next().unwrap_or(0.0), digits.next().unwrap_or(0.0))
    };
    chains
        .split(',')
        .filter(|chain| !chain.is_empty())
        .map(|chain| chain.split(' ').map(point).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_glyph_lies_on_its_grid() {
        for character in ('!'..='~').filter(|&character| !strokes(character).is_empty()) {
            for stroke in strokes(character) {
                assert!(stroke.len() >= 2, "{character}");
                assert!(stroke.iter().all(|&(x, y)| x <= 4.0 && y <= 8.0), "{character}");
            }
        }
        assert!(strokes(' ').is_empty());
        assert_eq!(strokes('L'), strokes('l'));
    }
}
