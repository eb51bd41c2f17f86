//! Reports and tables.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

/// Writes a report as indented JSON.
///
/// # Errors
/// The file cannot be written.
pub fn write_json<T: Serialize>(path: &Path, report: &T) -> Result<()> {
    let text = serde_json::to_string_pretty(report)?;
    std::fs::write(path, text + "\n").with_context(|| format!("cannot write {}", path.display()))?;
    println!("wrote {}", path.display());
    Ok(())
}

/// A table whose columns are as wide as they must be: the first to the left, the others to the right.
pub fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let num_columns = header.len();
    let width_of = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count());
        cells.chain([header[column].chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..num_columns).map(width_of).collect();
    let line = |cells: Vec<&str>| {
        let padded = cells.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            if column == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        format!("  {}\n", padded.collect::<Vec<_>>().join("  ").trim_end())
    };
    let rule =
        format!("  {}\n", "─".repeat(widths.iter().sum::<usize>() + 2 * num_columns.saturating_sub(1)));
    let body: String = rows.iter().map(|row| line(row.iter().map(String::as_str).collect())).collect();
    format!("{}{rule}{body}", line(header.to_vec()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = vec![vec!["aces".into(), "7374".into()], vec!["mit-killian".into(), "5".into()]];
        let expected =
            "  name         scans\n  ──────────────────\n  aces          7374\n  mit-killian      5\n";
        assert_eq!(table(&["name", "scans"], &rows), expected);
    }
}
