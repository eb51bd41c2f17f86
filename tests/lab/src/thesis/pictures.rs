//! The pictures of chapters 4 and 5.

use std::path::Path;

use crate::evaluation::CurvePoint;
use anyhow::{Context, Result};

use super::text_sweep::at_threshold;
use crate::plot::{Line, Plot};

/// Something drawn in one colour under one name.
pub(super) type Named<T> = (String, [u8; 3], T);
/// A single (precision, recall).
pub(super) type NamedPoint = Named<(f64, f64)>;
/// Points by threshold.
pub(super) type NamedCurve = Named<Vec<CurvePoint>>;
/// Points by the share of the recording.
pub(super) type NamedHistory = Named<Vec<(f64, CurvePoint)>>;

/// Reads off what a picture shows.
type Value = fn(&CurvePoint) -> f64;

/// What a picture shows of a point, and its name.
const PRECISION_AND_RECALL: [(&str, Value); 2] =
    [("precision", |point| point.precision), ("recall", |point| point.recall_same)];

/// Two pictures: precision and recall over the number of words.
pub(super) fn plot_over_n(
    out: &Path,
    file: &str,
    title: &str,
    curves: &[NamedCurve],
    largest_n: u32,
) -> Result<()> {
    for (what, value) in PRECISION_AND_RECALL {
        let lines = curves
            .iter()
            .map(|(name, color, curve)| {
                let points = (1..=largest_n)
                    .filter_map(|n| Some((f64::from(n), value(&at_threshold(curve, f64::from(n))?))));
                Line { name: name.clone(), color: *color, points: points.collect(), has_markers: true }
            })
            .collect();
        let plot = Plot {
            title: title.to_owned(),
            x_label: "words of a match (n)".into(),
            y_label: what.into(),
            x_range: (0.0, f64::from(largest_n)),
            y_range: (0.0, 1.0),
            lines,
        };
        write_picture(out, &format!("{file}_{what}"), &plot)?;
    }
    Ok(())
}

/// Two pictures: precision and recall while the recording grows.
pub(super) fn plot_over_time(out: &Path, file: &str, title: &str, lines: &[NamedHistory]) -> Result<()> {
    for (what, value) in PRECISION_AND_RECALL {
        let line = |(name, color, points): &NamedHistory| Line {
            name: name.clone(),
            color: *color,
            points: points.iter().map(|(share, point)| (*share, value(point))).collect(),
            has_markers: false,
        };
        let plot = Plot {
            title: title.to_owned(),
            x_label: "share of the recording".into(),
            y_label: what.into(),
            x_range: (0.0, 1.0),
            y_range: (0.0, 1.0),
            lines: lines.iter().map(line).collect(),
        };
        write_picture(out, &format!("{file}_{what}"), &plot)?;
    }
    Ok(())
}

/// Precision over recall; `published` are single points.
pub(super) fn plot_precision_over_recall(
    out: &Path,
    file: &str,
    title: &str,
    (curves, published): (&[NamedCurve], &[NamedPoint]),
) -> Result<()> {
    let ours = curves.iter().map(|(name, color, curve)| Line {
        name: name.clone(),
        color: *color,
        points: curve.iter().map(|point| (point.recall_same, point.precision)).collect(),
        has_markers: curve.len() < 40,
    });
    let theirs = published.iter().map(|(name, color, (precision, recall))| Line {
        name: name.clone(),
        color: *color,
        points: vec![(*recall, *precision)],
        has_markers: true,
    });
    let plot = Plot {
        title: title.to_owned(),
        x_label: "recall".into(),
        y_label: "precision".into(),
        x_range: (0.0, 1.0),
        y_range: (0.0, 1.0),
        lines: ours.chain(theirs).collect(),
    };
    write_picture(out, file, &plot)
}

pub(super) fn write_picture(out: &Path, name: &str, plot: &Plot) -> Result<()> {
    let path = out.join(format!("{name}.png"));
    std::fs::write(&path, plot.to_png()?).with_context(|| format!("cannot write {}", path.display()))
}
