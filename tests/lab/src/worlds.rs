//! Worlds from ROS map_server files: YAML beside a PGM or PNG.

use std::io::Cursor;
use std::path::Path;

use crate::simulation::World;
use anyhow::{Context, Result, bail};
use locution_engine::formats::{GrayImage, parse_map_server_yaml, parse_pgm};

use super::recordings::read_text;

/// Reads a world from its YAML file and the picture that it names.
///
/// # Errors
/// Files that cannot be read or understood.
pub fn read_world(yaml_path: &Path) -> Result<World> {
    let in_yaml = || yaml_path.display().to_string();
    let yaml = parse_map_server_yaml(&read_text(yaml_path)?).with_context(in_yaml)?;
    let image_path = yaml_path.parent().unwrap_or(Path::new(".")).join(&yaml.image);
    let bytes =
        std::fs::read(&image_path).with_context(|| format!("cannot open {}", image_path.display()))?;
    let image = decode_picture(&bytes).with_context(|| image_path.display().to_string())?;
    World::from_map_server(&image, &yaml).with_context(in_yaml)
}

/// Decodes a picture to grey values; colours by their mean, as map_server does.
///
/// # Errors
/// Bytes that are neither PNG nor PGM.
pub fn decode_picture(bytes: &[u8]) -> Result<GrayImage> {
    if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
        return Ok(parse_pgm(bytes)?);
    }
    if !bytes.starts_with(b"\x89PNG") {
        bail!("neither a PNG nor a PGM picture");
    }
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    let mut reader = decoder.read_info()?;
    let num_bytes = reader.output_buffer_size().context("the picture is too large")?;
    let mut buffer = vec![0; num_bytes];
    let frame = reader.next_frame(&mut buffer)?;
    let samples = frame.color_type.samples();
    // A last sample beside grey or colour is opacity and says nothing about walls.
    let num_colors = if samples > 2 { 3 } else { 1 };
    let gray = |pixel: &[u8]| {
        (pixel[..num_colors].iter().map(|&value| u32::from(value)).sum::<u32>() / num_colors as u32) as u8
    };
    let pixels = buffer[..frame.buffer_size()].chunks_exact(samples).map(gray).collect();
    Ok(GrayImage { width: frame.width as usize, height: frame.height as usize, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_decode_to_gray() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(png::ColorType::Rgba);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[30, 60, 90, 255, 254, 254, 254, 0]).unwrap();
        writer.finish().unwrap();
        let image = decode_picture(&bytes).unwrap();
        assert_eq!(image, GrayImage { width: 2, height: 1, pixels: vec![60, 254] });
        assert!(decode_picture(b"GIF89a").is_err());
    }
}
