//! Exact Euclidean distance transform (Felzenszwalb and Huttenlocher 2012), columns then rows, O(cells).

/// Distance in cells from the centre of each cell to the centre of the nearest one that is not free; what lies
/// outside the grid is not free.
pub fn distance_to_blocked(width: usize, height: usize, is_free: &[bool]) -> Vec<f32> {
    // One ring of blocked cells around the grid stands for everything outside.
    let (padded_width, padded_height) = (width + 2, height + 2);
    let far = ((padded_width * padded_width + padded_height * padded_height) * 4) as f64;
    let mut squared = vec![0.0f64; padded_width * padded_height];
    for row in 0..height {
        for column in 0..width {
            if is_free[row * width + column] {
                squared[(row + 1) * padded_width + column + 1] = far;
            }
        }
    }
    let mut envelope = Envelope::default();
    for column in 0..padded_width {
        let line: Vec<f64> = (0..padded_height).map(|row| squared[row * padded_width + column]).collect();
        for (row, value) in envelope.transform(&line).iter().enumerate() {
            squared[row * padded_width + column] = *value;
        }
    }
    for row in squared.chunks_exact_mut(padded_width) {
        let line = row.to_vec();
        row.copy_from_slice(envelope.transform(&line));
    }
    let inner = |row: usize| &squared[(row + 1) * padded_width + 1..(row + 1) * padded_width + 1 + width];
    (0..height).flat_map(|row| inner(row).iter().map(|value| value.sqrt() as f32)).collect()
}

/// The lower envelope of parabolas rooted at each sample, with its buffers kept between lines.
#[derive(Default)]
struct Envelope {
    roots: Vec<usize>,
    starts: Vec<f64>,
    values: Vec<f64>,
}

impl Envelope {
    /// min over q of (p − q)² + line[q], for every p.
    fn transform(&mut self, line: &[f64]) -> &[f64] {
        self.roots.clear();
        self.starts.clear();
        for q in 0..line.len() {
            let mut start = f64::NEG_INFINITY;
            while let Some(&root) = self.roots.last() {
                let rise = (line[q] + (q * q) as f64) - (line[root] + (root * root) as f64);
                start = rise / (2.0 * (q as f64 - root as f64));
                if self.starts.last().is_some_and(|&last| start <= last) {
                    self.roots.pop();
                    self.starts.pop();
                    start = f64::NEG_INFINITY;
                } else {
                    break;
                }
            }
            self.roots.push(q);
            self.starts.push(start);
        }
        self.values.clear();
        let mut piece = 0;
        for p in 0..line.len() {
            while piece + 1 < self.roots.len() && self.starts[piece + 1] < p as f64 {
                piece += 1;
            }
            let root = self.roots[piece];
            let offset = p as f64 - root as f64;
            self.values.push(offset * offset + line[root]);
        }
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The definition: every blocked cell, and the ring outside, looked at for every cell.
    fn by_definition(width: usize, height: usize, is_free: &[bool]) -> Vec<f32> {
        let blocked: Vec<(i64, i64)> = (-1..=height as i64)
            .flat_map(|row| (-1..=width as i64).map(move |column| (column, row)))
            .filter(|&(column, row)| {
                let is_inside = column >= 0 && row >= 0 && column < width as i64 && row < height as i64;
                !is_inside || !is_free[row as usize * width + column as usize]
            })
            .collect();
        let nearest = |column: i64, row: i64| {
            blocked.iter().map(|(c, r)| (c - column).pow(2) + (r - row).pow(2)).min().unwrap_or(0)
        };
        (0..height as i64)
            .flat_map(|row| (0..width as i64).map(move |column| (column, row)))
            .map(|(column, row)| (nearest(column, row) as f64).sqrt() as f32)
            .collect()
    }

    proptest! {
        #[test]
        fn agrees_with_the_definition(
            (width, height, cells) in (1usize..14, 1usize..14).prop_flat_map(|(width, height)| {
                (Just(width), Just(height), prop::collection::vec(prop::bool::weighted(0.85), width * height))
            })
        ) {
            let fast = distance_to_blocked(width, height, &cells);
            let slow = by_definition(width, height, &cells);
            for (fast, slow) in fast.iter().zip(&slow) {
                prop_assert!((fast - slow).abs() < 1e-4, "{} is not {}", fast, slow);
            }
        }
    }
}
