//! Maps to look at: walls, one colour per run, matches across; as SVG text and as PNG from the same drawing.
//!
//! Components stand side by side, because nothing is known of how they lie to one another.

use std::fmt::Write;

use locution_engine::geometry::Point2;
use locution_engine::occupancy::{CellState, GridMap};
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform};

/// Longest edge of a picture, pixels.
const EDGE_MAX_PX: f64 = 2_400.0;
/// Most pixels that a metre takes.
const PIXELS_PER_METER_MAX: f64 = 20.0;
/// Empty space around and between components, metres.
const MARGIN_M: f64 = 2.0;

const PAPER: [u8; 3] = [236, 234, 228];
const FLOOR: [u8; 3] = [255, 255, 255];
const WALL: [u8; 3] = [44, 48, 58];
const MATCH: [u8; 3] = [232, 163, 23];
/// Colours of runs, told apart also without red and green (after Okabe and Ito).
const RUNS: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [117, 76, 36],
    [120, 94, 240],
];

/// A line in one component.
#[derive(Clone, Debug)]
pub struct Line {
    /// Number of the run that drove it; matches have their own colour.
    pub run: Option<usize>,
    /// Where it goes, metres.
    pub points: Vec<Point2>,
}

/// One component to draw.
pub struct Panel<'a> {
    /// Walls and floor.
    pub grid: &'a GridMap,
    /// Trajectories and matches.
    pub lines: Vec<Line>,
}

/// Where everything goes on the paper.
struct Layout {
    scale: f64,
    width_px: u32,
    height_px: u32,
    /// Left and bottom of each panel's grid, in pixels from the left and from the top.
    corners: Vec<(f64, f64)>,
}

impl Layout {
    fn of(panels: &[Panel<'_>]) -> Self {
        let size = |panel: &Panel<'_>| {
            let cell = panel.grid.resolution_m();
            (panel.grid.width() as f64 * cell, panel.grid.height() as f64 * cell)
        };
        let width_m = panels.iter().map(|panel| size(panel).0 + MARGIN_M).sum::<f64>() + MARGIN_M;
        let height_m = panels.iter().map(|panel| size(panel).1).fold(0.0, f64::max) + 2.0 * MARGIN_M;
        let scale = (EDGE_MAX_PX / width_m.max(height_m)).min(PIXELS_PER_METER_MAX);
        let mut left_m = MARGIN_M;
        let mut corners = Vec::new();
        for panel in panels {
            corners.push((left_m * scale, (height_m - MARGIN_M) * scale));
            left_m += size(panel).0 + MARGIN_M;
        }
        let pixels = |meters: f64| ((meters * scale).ceil() as u32).clamp(16, EDGE_MAX_PX as u32 + 16);
        Self { scale, width_px: pixels(width_m), height_px: pixels(height_m), corners }
    }

    /// Pixels of a point of a panel.
    fn place(&self, panel_idx: usize, grid: &GridMap, point: &Point2) -> (f64, f64) {
        let (left, bottom) = self.corners[panel_idx];
        let origin = grid.origin();
        (left + (point.x - origin.x) * self.scale, bottom - (point.y - origin.y) * self.scale)
    }
}

/// Runs of equal cells in a row: first column, one past the last, row.
fn spans(grid: &GridMap, state: CellState) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    grid.cells().chunks(grid.width()).enumerate().flat_map(move |(row, cells)| {
        let mut column = 0;
        std::iter::from_fn(move || {
            let first = column + cells[column..].iter().position(|cell| *cell == state)?;
            let length = cells[first..].iter().take_while(|cell| **cell == state).count();
            column = first + length;
            Some((first, column, row))
        })
    })
}

/// The picture as PNG bytes.
///
/// # Errors
/// A message when the picture is too large for memory.
pub fn draw_png(panels: &[Panel<'_>]) -> Result<Vec<u8>, String> {
    let layout = Layout::of(panels);
    let mut pixmap = Pixmap::new(layout.width_px, layout.height_px).ok_or("the picture has no size")?;
    pixmap.fill(color(PAPER, 255));
    for (panel_idx, panel) in panels.iter().enumerate() {
        for (state, rgb) in [(CellState::Free, FLOOR), (CellState::Occupied, WALL)] {
            fill_cells(&mut pixmap, &layout, panel_idx, panel.grid, state, rgb);
        }
        for line in &panel.lines {
            stroke_line(&mut pixmap, &layout, panel_idx, panel.grid, line);
        }
    }
    pixmap.encode_png().map_err(|error| error.to_string())
}

fn fill_cells(
    pixmap: &mut Pixmap,
    layout: &Layout,
    panel_idx: usize,
    grid: &GridMap,
    state: CellState,
    rgb: [u8; 3],
) {
    let cell = grid.resolution_m() * layout.scale;
    let (left, bottom) = layout.corners[panel_idx];
    let mut path = PathBuilder::new();
    for (first, end, row) in spans(grid, state) {
        // Walls thinner than a pixel would fade away.
        let height = if state == CellState::Occupied { cell.max(1.2) } else { cell };
        let (x, y) = (left + first as f64 * cell, bottom - (row as f64 + 1.0) * cell);
        let width = ((end - first) as f64 * cell).max(height);
        if let Some(rect) = Rect::from_xywh(x as f32, y as f32, width as f32, height as f32) {
            path.push_rect(rect);
        }
    }
    if let Some(path) = path.finish() {
        pixmap.fill_path(&path, &paint(rgb, 255), FillRule::Winding, Transform::identity(), None);
    }
}

fn stroke_line(pixmap: &mut Pixmap, layout: &Layout, panel_idx: usize, grid: &GridMap, line: &Line) {
    let mut path = PathBuilder::new();
    for (idx, point) in line.points.iter().enumerate() {
        let (x, y) = layout.place(panel_idx, grid, point);
        if idx == 0 { path.move_to(x as f32, y as f32) } else { path.line_to(x as f32, y as f32) }
    }
    let Some(path) = path.finish() else { return };
    let stroke = Stroke { width: if line.run.is_some() { 2.0 } else { 1.0 }, ..Stroke::default() };
    let alpha = if line.run.is_some() { 230 } else { 110 };
    pixmap.stroke_path(&path, &paint(color_of(line), alpha), &stroke, Transform::identity(), None);
}

/// The picture as SVG.
pub fn draw_svg(panels: &[Panel<'_>]) -> String {
    let layout = Layout::of(panels);
    let (width, height) = (layout.width_px, layout.height_px);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\">\n<rect width=\"100%\" height=\"100%\" fill=\"{}\"/>\n",
        hex(PAPER)
    );
    for (panel_idx, panel) in panels.iter().enumerate() {
        let cell = panel.grid.resolution_m() * layout.scale;
        let (left, bottom) = layout.corners[panel_idx];
        for (state, rgb) in [(CellState::Free, FLOOR), (CellState::Occupied, WALL)] {
            let _ = write!(svg, "<path fill=\"{}\" d=\"", hex(rgb));
            for (first, end, row) in spans(panel.grid, state) {
                let (x, y) = (left + first as f64 * cell, bottom - (row as f64 + 1.0) * cell);
                let width = (end - first) as f64 * cell;
                let _ = write!(svg, "M{x:.1} {y:.1}h{width:.1}v{cell:.1}h-{width:.1}z");
            }
            svg.push_str("\"/>\n");
        }
        for line in &panel.lines {
            let (stroke, opacity) = if line.run.is_some() { (2.0, 0.9) } else { (1.0, 0.43) };
            let _ = write!(
                svg,
                "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{stroke}\" stroke-opacity=\"{opacity}\" \
                 points=\"",
                hex(color_of(line))
            );
            for point in &line.points {
                let (x, y) = layout.place(panel_idx, panel.grid, point);
                let _ = write!(svg, "{x:.1},{y:.1} ");
            }
            svg.push_str("\"/>\n");
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn color_of(line: &Line) -> [u8; 3] {
    line.run.map_or(MATCH, |run| RUNS[run % RUNS.len()])
}

fn hex([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn color([red, green, blue]: [u8; 3], alpha: u8) -> Color {
    Color::from_rgba8(red, green, blue, alpha)
}

fn paint(rgb: [u8; 3], alpha: u8) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(color(rgb, alpha));
    paint
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_becomes_a_picture_in_both_forms() {
        let mut grid = GridMap::unknown(40, 30, 0.1, Point2::new(-1.0, -1.0));
        for column in 0..40 {
            grid.set(column, 0, CellState::Occupied);
            grid.set(column, 1, CellState::Free);
        }
        let line = Line { run: Some(0), points: vec![Point2::new(0.0, 0.0), Point2::new(1.0, 0.5)] };
        let panels = [Panel { grid: &grid, lines: vec![line] }];
        let png = draw_png(&panels).unwrap();
        assert!(png.starts_with(b"\x89PNG"));
        let svg = draw_svg(&panels);
        assert!(svg.contains("polyline") && svg.ends_with("</svg>\n"));
        assert_eq!(spans(&grid, CellState::Occupied).collect::<Vec<_>>(), [(0, 40, 0)]);
    }
}
