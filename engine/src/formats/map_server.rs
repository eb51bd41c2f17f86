//! Maps as ROS map_server keeps them: a grey picture and a page of YAML beside it.

use serde::Deserialize;
use serde_saphyr::{Spanned, UserMessageFormatter};

use super::FormatError;
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

/// A picture of a map: grey values and, where the file has it, how opaque each pixel is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MapPicture {
    /// The grey values; colors by their mean.
    pub gray: GrayImage,
    /// One byte a pixel, 255 is opaque; `None` where all are.
    pub opacity: Option<Vec<u8>>,
}

impl From<GrayImage> for MapPicture {
    fn from(gray: GrayImage) -> Self {
        Self { gray, opacity: None }
    }
}

impl MapPicture {
    /// Grey value and opacity row by row from the top left.
    pub fn pixels(&self) -> impl Iterator<Item = (u8, u8)> + '_ {
        let opacity = |idx: usize| self.opacity.as_ref().and_then(|all| all.get(idx).copied()).unwrap_or(255);
        self.gray.pixels.iter().enumerate().map(move |(idx, &gray)| (gray, opacity(idx)))
    }
}

/// How a pixel becomes an occupancy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MapMode {
    /// Free, occupied or unknown, by the two thresholds.
    #[default]
    Trinary,
    /// Between the thresholds occupancy rises with darkness.
    Scale,
    /// The pixel's value is the occupancy itself, 0 to 100; above that it is unknown.
    Raw,
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
    /// How pixels are read.
    pub mode: MapMode,
}

impl MapServerYaml {
    /// Occupancy of a pixel as ROS states it, 0 (free) to 100 (occupied); `None` is unknown.
    ///
    /// A pixel that is not opaque is unknown, but for `raw`, which looks at the value alone.
    pub fn occupancy(&self, gray: u8, opacity: u8) -> Option<u8> {
        if self.mode == MapMode::Raw {
            return Some(gray).filter(|&gray| gray <= 100);
        }
        if opacity < 255 {
            return None;
        }
        let brightness = f64::from(gray) / 255.0;
        let darkness = if self.is_negated { brightness } else { 1.0 - brightness };
        let (free, occupied) = (self.free_threshold, self.occupied_threshold);
        if darkness > occupied {
            Some(100)
        } else if darkness < free {
            Some(0)
        } else if self.mode == MapMode::Scale && occupied > free {
            // What lies between the thresholds is neither free nor occupied.
            Some(1 + (98.0 * (darkness - free) / (occupied - free)).round() as u8)
        } else {
            None
        }
    }

    /// Whether a pixel is free floor: known, and less likely occupied than the threshold of free pixels.
    pub fn is_free(&self, gray: u8, opacity: u8) -> bool {
        let is_below = |occupancy: u8| match self.mode {
            MapMode::Raw => f64::from(occupancy) < 100.0 * self.free_threshold,
            MapMode::Trinary | MapMode::Scale => occupancy == 0,
        };
        self.occupancy(gray, opacity).is_some_and(is_below)
    }
}

/// The page as it stands, with the places of its values for errors.
#[derive(Deserialize)]
struct Page {
    image: String,
    resolution: Spanned<f64>,
    origin: Option<Spanned<Vec<f64>>>,
    negate: Option<Spanned<String>>,
    occupied_thresh: Option<Spanned<f64>>,
    free_thresh: Option<Spanned<f64>>,
    #[serde(default)]
    mode: MapMode,
}

/// Reads a page of map_server. Keys that it does not know are passed over.
///
/// # Errors
/// What is no YAML, a missing `image` or `resolution`, a value that cannot be, with its line.
pub fn parse_map_server_yaml(text: &str) -> Result<MapServerYaml, FormatError> {
    let page: Page = serde_saphyr::from_str(text).map_err(|error| yaml_error(&error))?;
    let resolution_m = page.resolution.value;
    if !(resolution_m > 0.0 && resolution_m.is_finite()) {
        return Err(at(&page.resolution, format!("a resolution of {resolution_m} m")));
    }
    let threshold = |value: Option<Spanned<f64>>, default: f64| match value {
        Some(value) if !(0.0..=1.0).contains(&value.value) => {
            Err(at(&value, format!("a threshold of {}, not between 0 and 1", value.value)))
        }
        value => Ok(value.map_or(default, |value| value.value)),
    };
    let is_negated = match &page.negate {
        None => false,
        Some(negate) => match negate.value.to_ascii_lowercase().as_str() {
            "0" | "false" | "no" => false,
            "1" | "true" | "yes" => true,
            other => return Err(at(negate, format!("negate is '{other}', neither 0 nor 1"))),
        },
    };
    if let Some(negate) = page.negate.as_ref().filter(|_| is_negated && page.mode == MapMode::Raw) {
        // One map_server turns the values round, another does not.
        return Err(at(
            negate,
            "negate together with mode raw is not supported, as map servers disagree on it",
        ));
    }
    let map_from_image = match &page.origin {
        None => Pose2::identity(),
        Some(origin) => match origin.value[..] {
            [x, y, yaw_rad] if [x, y, yaw_rad].iter().all(|number| number.is_finite()) => {
                Pose2::new(x, y, yaw_rad)
            }
            _ => return Err(at(origin, "the origin must be three finite numbers: x, y and yaw")),
        },
    };
    Ok(MapServerYaml {
        image: page.image,
        resolution_m,
        map_from_image,
        is_negated,
        occupied_threshold: threshold(page.occupied_thresh, 0.65)?,
        free_threshold: threshold(page.free_thresh, 0.196)?,
        mode: page.mode,
    })
}

fn at<T>(value: &Spanned<T>, problem: impl Into<String>) -> FormatError {
    FormatError::new(usize::try_from(value.referenced.line()).unwrap_or(0), problem)
}

fn yaml_error(error: &serde_saphyr::Error) -> FormatError {
    let error = error.without_snippet();
    let line = error.location().map_or(1, |location| usize::try_from(location.line()).unwrap_or(1));
    let message = error.render_with_formatter(&UserMessageFormatter);
    // The line is said once, before the message.
    let problem = message.split(" at line ").next().unwrap_or_default();
    FormatError::new(line, problem)
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
        assert_eq!([254, 205, 0].map(|gray| yaml.occupancy(gray, 255)), [Some(0), None, Some(100)]);
        assert_eq!((yaml.mode, yaml.is_negated), (MapMode::Trinary, false));
    }

    #[test]
    fn says_the_same_in_every_way_that_yaml_has() {
        let plain =
            "image: a.pgm\nresolution: 0.1\norigin: [-1.0, -2.0, 0.5]\nnegate: 0\noccupied_thresh: 0.65\n";
        let expected = parse_map_server_yaml(plain).unwrap();
        for text in [
            plain.replace("[-1.0, -2.0, 0.5]", "\n- -1.0\n- -2\n- 5e-1"),
            format!("---\n{plain}...\n"),
            format!("%YAML 1.2\n---\n{plain}"),
            plain.replace("0.1", "\"0.100000\"").replace("a.pgm", "'a.pgm' # ours"),
            format!("\u{feff}{}", plain.replace('\n', "\r\n")),
            "{image: a.pgm, resolution: 0.1, origin: [-1, -2, 0.5], negate: no, mode: trinary, more: {a: 1}}"
                .into(),
        ] {
            assert_eq!(parse_map_server_yaml(&text).as_ref(), Ok(&expected), "{text}");
        }
    }

    #[test]
    fn errors_say_line_and_cause() {
        let whole = "image: a.pgm\nresolution: 0.1\n";
        for (text, line, problem) in [
            ("image: a.pgm", 1, "missing field `resolution`"),
            ("image: a.pgm\nresolution: -1", 2, "a resolution of -1 m"),
            ("image: a.pgm\nresolution: fine", 2, "invalid floating point"),
            (&format!("{whole}origin: [1, 2]"), 3, "the origin must be three finite numbers: x, y and yaw"),
            (
                &format!("{whole}origin: [1, 2, .nan]"),
                3,
                "the origin must be three finite numbers: x, y and yaw",
            ),
            (&format!("{whole}negate: 2"), 3, "negate is '2', neither 0 nor 1"),
            (&format!("{whole}free_thresh: 19"), 3, "a threshold of 19, not between 0 and 1"),
            (&format!("{whole}mode: raw\nnegate: 1"), 4, "negate together with mode raw"),
            (&format!("{whole}mode: float"), 3, "unknown variant `float`"),
            (&format!("{whole}x: ["), 3, "unclosed bracket"),
        ] {
            let error = parse_map_server_yaml(text).unwrap_err();
            assert!(error.line == line && error.problem.starts_with(problem), "{text}: {error}");
        }
    }

    #[test]
    fn modes_read_pixels_as_defined() {
        let with = |more: &str| parse_map_server_yaml(&format!("image: a\nresolution: 1\n{more}")).unwrap();
        let scale = with("mode: scale");
        let read = |yaml: &MapServerYaml, pixels: [(u8, u8); 4]| pixels.map(|(g, o)| yaml.occupancy(g, o));
        let pixels = [(254, 255), (254, 0), (150, 255), (0, 255)];
        assert_eq!(read(&scale, pixels), [Some(0), None, Some(48), Some(100)]);
        assert_eq!(read(&with("mode: trinary"), pixels), [Some(0), None, None, Some(100)]);
        assert_eq!(read(&with("negate: true"), pixels), [Some(100), None, None, Some(0)]);
        let raw = with("mode: raw");
        assert_eq!(
            read(&raw, [(0, 255), (19, 255), (100, 0), (255, 255)]),
            [Some(0), Some(19), Some(100), None]
        );
        assert_eq!(
            [0, 19, 20, 100, 255].map(|gray| raw.is_free(gray, 255)),
            [true, true, false, false, false]
        );
        assert_eq!([254, 205, 150].map(|gray| scale.is_free(gray, 255)), [true, false, false]);
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
