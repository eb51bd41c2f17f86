//! Line plots as PNG pictures.

use anyhow::{Context, Result};
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Stroke, Transform};

use super::stroke_font::{ADVANCE, strokes};

const WIDTH: f32 = 720.0;
const HEIGHT: f32 = 520.0;
const LEFT: f32 = 84.0;
const RIGHT: f32 = 24.0;
const TOP: f32 = 52.0;
const BOTTOM: f32 = 72.0;
/// Size of one unit of the font's grid, pixels.
const TEXT_SCALE: f32 = 1.7;

/// One line of a plot.
pub struct Line {
    /// Its name in the legend.
    pub name: String,
    /// Red, green, blue.
    pub color: [u8; 3],
    /// In plot coordinates, joined in this order; what is not finite is left out.
    pub points: Vec<(f64, f64)>,
    /// Whether the points are marked.
    pub has_markers: bool,
}

/// A plot with linear axes.
pub struct Plot {
    /// Above it.
    pub title: String,
    /// Below the horizontal axis.
    pub x_label: String,
    /// Above the vertical axis.
    pub y_label: String,
    /// Left and right end.
    pub x_range: (f64, f64),
    /// Lower and upper end.
    pub y_range: (f64, f64),
    /// Drawn in this order.
    pub lines: Vec<Line>,
}

impl Plot {
    /// The picture.
    ///
    /// # Errors
    /// None that a plot of this size can meet; the drawing library asks.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        let mut canvas = Pixmap::new(WIDTH as u32, HEIGHT as u32).context("no room for a picture")?;
        canvas.fill(Color::WHITE);
        self.draw_axes(&mut canvas);
        for line in &self.lines {
            self.draw_line(&mut canvas, line);
        }
        self.draw_legend(&mut canvas);
        Ok(canvas.encode_png()?)
    }

    fn place(&self, (x, y): (f64, f64)) -> (f32, f32) {
        let share = |value: f64, (from, to): (f64, f64)| ((value - from) / (to - from)) as f32;
        (
            LEFT + share(x, self.x_range) * (WIDTH - LEFT - RIGHT),
            HEIGHT - BOTTOM - share(y, self.y_range) * (HEIGHT - TOP - BOTTOM),
        )
    }

    fn draw_axes(&self, canvas: &mut Pixmap) {
        let (grid, ink) = ([222, 222, 222], [60, 60, 60]);
        for x in ticks(self.x_range) {
            let (from, to) = (self.place((x, self.y_range.0)), self.place((x, self.y_range.1)));
            draw_polyline(canvas, &[from, to], grid, 1.0);
            draw_text(canvas, &tick_label(x, self.x_range), (from.0, from.1 + 10.0), Anchor::Middle, ink);
        }
        for y in ticks(self.y_range) {
            let (from, to) = (self.place((self.x_range.0, y)), self.place((self.x_range.1, y)));
            draw_polyline(canvas, &[from, to], grid, 1.0);
            draw_text(canvas, &tick_label(y, self.y_range), (from.0 - 8.0, from.1 - 5.0), Anchor::End, ink);
        }
        let corner = self.place((self.x_range.0, self.y_range.0));
        let (top, right) =
            (self.place((self.x_range.0, self.y_range.1)), self.place((self.x_range.1, self.y_range.0)));
        draw_polyline(canvas, &[top, corner, right], ink, 1.5);
        let middle = LEFT + (WIDTH - LEFT - RIGHT) / 2.0;
        draw_text(canvas, &self.title, (middle, 12.0), Anchor::Middle, ink);
        draw_text(canvas, &self.x_label, (middle, HEIGHT - 38.0), Anchor::Middle, ink);
        draw_text(canvas, &self.y_label, (14.0, TOP - 24.0), Anchor::Start, ink);
    }

    fn draw_line(&self, canvas: &mut Pixmap, line: &Line) {
        let finite = line.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        let inside = |(x, y): (f64, f64)| {
            (x.clamp(self.x_range.0, self.x_range.1), y.clamp(self.y_range.0, self.y_range.1))
        };
        let places: Vec<(f32, f32)> = finite.map(|&point| self.place(inside(point))).collect();
        draw_polyline(canvas, &places, line.color, 2.2);
        if line.has_markers || places.len() == 1 {
            for &place in &places {
                draw_marker(canvas, place, line.color);
            }
        }
    }

    fn draw_legend(&self, canvas: &mut Pixmap) {
        let mut left = LEFT;
        for line in &self.lines {
            let y = HEIGHT - 12.0;
            draw_polyline(canvas, &[(left, y), (left + 18.0, y)], line.color, 3.0);
            draw_text(canvas, &line.name, (left + 24.0, y - 6.0), Anchor::Start, [60, 60, 60]);
            left += 24.0 + text_width(&line.name) + 22.0;
        }
    }
}

/// About five round values within the range.
fn ticks((from, to): (f64, f64)) -> Vec<f64> {
    let step = tick_step((from, to));
    let first = (from / step - 1e-9).ceil() as i64;
    (0..20).map(|idx| (first + idx) as f64 * step).take_while(|&value| value <= to + 1e-9 * step).collect()
}

fn tick_step((from, to): (f64, f64)) -> f64 {
    let rough = ((to - from) / 5.0).max(1e-12);
    let power = 10f64.powf(rough.log10().floor());
    let round = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= rough * 0.999).unwrap_or(10.0);
    round * power
}

fn tick_label(value: f64, range: (f64, f64)) -> String {
    let num_decimals = (-tick_step(range).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{:.num_decimals$}", value + 0.0)
}

#[derive(Clone, Copy, PartialEq)]
enum Anchor {
    Start,
    Middle,
    End,
}

fn text_width(text: &str) -> f32 {
    text.chars().count() as f32 * ADVANCE * TEXT_SCALE
}

fn draw_text(canvas: &mut Pixmap, text: &str, (x, y): (f32, f32), anchor: Anchor, color: [u8; 3]) {
    let mut left = match anchor {
        Anchor::Start => x,
        Anchor::Middle => x - text_width(text) / 2.0,
        Anchor::End => x - text_width(text),
    };
    for character in text.chars() {
        for stroke in strokes(character) {
            let places: Vec<(f32, f32)> = stroke
                .iter()
                .map(|(column, row)| (left + column * TEXT_SCALE, y + row * TEXT_SCALE))
                .collect();
            draw_polyline(canvas, &places, color, 1.3);
        }
        left += ADVANCE * TEXT_SCALE;
    }
}

fn paint([red, green, blue]: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(red, green, blue, 255);
    paint
}

fn draw_polyline(canvas: &mut Pixmap, places: &[(f32, f32)], color: [u8; 3], width: f32) {
    let Some((first, rest)) = places.split_first() else { return };
    let mut builder = PathBuilder::new();
    builder.move_to(first.0, first.1);
    for place in rest {
        // A stroke of no length would not be drawn; dots are strokes of hardly any.
        builder.line_to(place.0 + if place == first { 0.01 } else { 0.0 }, place.1);
    }
    let Some(path) = builder.finish() else { return };
    let stroke = Stroke { width, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
    canvas.stroke_path(&path, &paint(color), &stroke, Transform::identity(), None);
}

fn draw_marker(canvas: &mut Pixmap, (x, y): (f32, f32), color: [u8; 3]) {
    if let Some(path) = PathBuilder::from_circle(x, y, 4.0) {
        canvas.fill_path(&path, &paint(color), FillRule::Winding, Transform::identity(), None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks((0.0, 1.0)).len(), 6);
        assert_eq!(tick_label(0.2, (0.0, 1.0)), "0.2");
        assert_eq!(ticks((0.0, 30.0)), [0.0, 10.0, 20.0, 30.0]);
        assert_eq!(tick_label(20.0, (0.0, 30.0)), "20");
    }

    #[test]
    fn an_empty_plot_and_a_full_one_are_pictures() {
        let mut plot = Plot {
            title: "test".into(),
            x_label: "x".into(),
            y_label: "y".into(),
            x_range: (0.0, 1.0),
            y_range: (0.0, 1.0),
            lines: Vec::new(),
        };
        let empty = plot.to_png().unwrap();
        let points = vec![(0.0, 0.0), (f64::NAN, 1.0), (0.5, 7.0)];
        plot.lines.push(Line { name: "line".into(), color: [200, 0, 0], points, has_markers: true });
        assert_ne!(plot.to_png().unwrap(), empty);
    }
}
