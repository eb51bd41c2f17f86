//! Maps as ROS map_server keeps them: a grey picture and a page of YAML beside it.

use super::FormatError;
use super::fields::{Fields, content_lines};
use crate::geometry::Pose2;

/// Grey values row by row from the top left, one byte each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GrayImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width × height` values; 255 is white.
    pub pixels: Vec<u8>,
}

/// What the YAML says of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct MapServerYaml {
    /// File name of the picture, relative to the YAML file.
    pub image: String,
    /// Edge of a pixel in metres.
    pub resolution_m: f64,
    /// Pose of the lower left corner of the picture.
    pub map_from_image: Pose2,
    /// Whether white means occupied.
    pub is_negated: bool,
    /// A pixel more likely occupied than this is a wall.
    pub occupied_threshold: f64,
    /// A pixel less likely occupied than this is free.
    pub free_threshold: f64,
}

impl MapServerYaml {
    /// Probability that a pixel of this grey value is occupied.
    pub fn occupancy(&self, pixel: u8) -> f64 {
        let brightness = f64::from(pixel) / 255.0;
        if self.is_negated { brightness } else { 1.0 - brightness }
    }
}

/// Reads the `key: value` lines that map_server writes.
///
/// # Errors
/// The first line that cannot be read; a missing `image` or `resolution`.
pub fn parse_map_server_yaml(text: &str) -> Result<MapServerYaml, FormatError> {
    let (mut image, mut resolution_m) = (None, None);
    let mut yaml = MapServerYaml {
        image: String::new(),
        resolution_m: 0.0,
        map_from_image: Pose2::identity(),
        is_negated: false,
        occupied_threshold: 0.65,
        free_threshold: 0.196,
    };
    for (line_number, line) in content_lines(text) {
        let Some((key, value)) = line.split_once(':') else {
            return Err(FormatError::new(line_number, "not of the form 'key: value'"));
        };
        let value = value.split(" #").next().unwrap_or("").trim();
        let numbers = value.replace(['[', ']', ','], " ");
        let mut fields = Fields::new(&numbers, line_number);
        match key.trim() {
            "image" => image = Some(value.trim_matches(['"', '\'']).to_owned()),
            "resolution" => resolution_m = Some(fields.number("resolution")?),
            "origin" => yaml.map_from_image = fields.pose("origin")?,
            "negate" => yaml.is_negated = fields.number("negate")? != 0.0,
            "occupied_thresh" => yaml.occupied_threshold = fields.number("occupied_thresh")?,
            "free_thresh" => yaml.free_threshold = fields.number("free_thresh")?,
            _ => {}
        }
    }
    let missing = |key: &str| FormatError::new(text.lines().count(), format!("'{key}' is missing"));
    yaml.image = image.ok_or_else(|| missing("image"))?;
    yaml.resolution_m = resolution_m.ok_or_else(|| missing("resolution"))?;
    if yaml.resolution_m <= 0.0 {
        return Err(FormatError::new(1, format!("a resolution of {} m", yaml.resolution_m)));
    }
    Ok(yaml)
}

/// Decodes a portable graymap, binary (`P5`) or plain (`P2`), of at most 255 grey levels.
///
/// # Errors
/// What is wrong with the bytes; line 1 stands for the header.
pub fn parse_pgm(bytes: &[u8]) -> Result<GrayImage, FormatError> {
    let error = |problem: &str| FormatError::new(1, problem);
    let mut position = 0;
    let is_binary = match header_word(bytes, &mut position) {
        Some(b"P5") => true,
        Some(b"P2") => false,
        _ => return Err(error("neither a P5 nor a P2 graymap")),
    };
    let mut number =
        || -> Option<usize> { std::str::from_utf8(header_word(bytes, &mut position)?).ok()?.parse().ok() };
    let (width, height, levels) = (number(), number(), number());
    let (Some(width), Some(height), Some(levels @ 1..=255)) = (width, height, levels) else {
        return Err(error("the header does not give width, height and at most 255 grey levels"));
    };
    let num_pixels = width.checked_mul(height).ok_or_else(|| error("the picture is too large"))?;
    let scale = |value: usize| (value.min(levels) * 255 / levels) as u8;
    let pixels: Vec<u8> = if is_binary {
        let body = bytes.get(position + 1..).unwrap_or_default();
        body.iter().take(num_pixels).map(|&value| scale(usize::from(value))).collect()
    } else {
        std::iter::from_fn(number).take(num_pixels).map(scale).collect()
    };
    if pixels.len() < num_pixels {
        return Err(error(&format!("{} of {num_pixels} pixels are there", pixels.len())));
    }
    Ok(GrayImage { width, height, pixels })
}

/// The next word of a PGM header, past white space and comments; `position` ends right behind it.
fn header_word<'a>(bytes: &'a [u8], position: &mut usize) -> Option<&'a [u8]> {
    loop {
        match bytes.get(*position)? {
            b'#' => *position += bytes[*position..].iter().position(|&byte| byte == b'\n')?,
            byte if byte.is_ascii_whitespace() => *position += 1,
            _ => break,
        }
    }
    let rest = &bytes[*position..];
    let length = rest.iter().position(|byte| byte.is_ascii_whitespace()).unwrap_or(rest.len());
    *position += length;
    Some(&rest[..length])
}

/// Encodes a binary graymap (`P5`).
pub fn write_pgm(image: &GrayImage) -> Vec<u8> {
    let mut bytes = format!("P5\n{} {}\n255\n", image.width, image.height).into_bytes();
    bytes.extend_from_slice(&image.pixels);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_map_server_writes() {
        let text = "image: floor.png # ours\nresolution: 0.05\norigin: [-26.0, -11.0, 0.0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";
        let yaml = parse_map_server_yaml(text).unwrap();
        assert_eq!(yaml.image, "floor.png");
        assert_eq!(yaml.resolution_m, 0.05);
        assert_eq!(yaml.map_from_image, Pose2::new(-26.0, -11.0, 0.0));
        assert!(yaml.occupancy(254) < yaml.free_threshold && yaml.occupancy(0) > yaml.occupied_threshold);
        assert!(yaml.occupancy(205) > yaml.free_threshold, "205 is unknown");
    }

    #[test]
    fn misses_what_is_not_there() {
        assert_eq!(parse_map_server_yaml("image: a.pgm").unwrap_err().problem, "'resolution' is missing");
        assert_eq!(parse_map_server_yaml("image: a.pgm\nresolution: -1").unwrap_err().line, 1);
        assert_eq!(parse_map_server_yaml("image: a.pgm\norigin: [1, 2]").unwrap_err().line, 2);
    }

    #[test]
    fn graymaps_survive_a_round_trip() {
        let image = GrayImage { width: 3, height: 2, pixels: vec![0, 10, 32, 205, 254, 255] };
        assert_eq!(parse_pgm(&write_pgm(&image)), Ok(image.clone()));
        assert_eq!(parse_pgm(b"P2 # plain\n3 2\n255\n0 10 32 205\n254 255"), Ok(image));
    }

    #[test]
    fn broken_graymaps_are_errors() {
        for bytes in [&b""[..], b"P6 1 1 255 abc", b"P5 2 2 255\nab", b"P5 2 2 65535\nabcdefgh", b"P2 1 1"] {
            assert!(parse_pgm(bytes).is_err());
        }
        assert!(parse_pgm(format!("P5 {} {} 255\n", usize::MAX, usize::MAX).as_bytes()).is_err());
    }
}
