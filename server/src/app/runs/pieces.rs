//! The pieces that a run falls in where its way could not be followed.

use locution_engine::registration::CutReason;

use crate::app::AppError;
use crate::app::site::Site;
use crate::records::{MapVersion, Run};

/// A piece of a run: what was recorded from one cut to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct RunPiece {
    /// Sequence number of its first scan.
    pub from_scan: u64,
    /// Sequence number of its last scan.
    pub to_scan: u64,
    /// Why it does not go on from the piece before; none of the first.
    pub reason: Option<CutReason>,
    /// Where it lies in the map: component and metres driven; none when it is in no map.
    pub in_map: Option<(u32, f64)>,
}

/// The pieces of a run with their places in a version of the map, the serving one unless said; a run that was followed all
/// the way is one piece.
///
/// # Errors
/// [`AppError::NotFound`] for a version that is not kept; those of the storage.
pub async fn pieces(site: &Site, run: &Run, version: Option<MapVersion>) -> Result<Vec<RunPiece>, AppError> {
    let map = match site.map(version).await {
        Err(AppError::NotReady { .. }) if version.is_none() => None,
        map => Some(map?),
    };
    let cuts = run.cuts().await?;
    let starts = std::iter::once((0, None)).chain(cuts.iter().map(|cut| (cut.scan_seq, Some(cut.reason))));
    let ends = cuts.iter().map(|cut| cut.scan_seq).chain(std::iter::once(run.text.num_scans));
    let piece = |((from_scan, reason), end): ((u64, Option<CutReason>), u64)| {
        let placed = map
            .as_ref()
            .and_then(|map| map.record.pieces_of(run.idx).find(|piece| piece.scans().contains(&from_scan)));
        Some(RunPiece {
            from_scan,
            to_scan: end.checked_sub(1)?,
            reason,
            in_map: placed.map(|piece| (piece.component, piece.length_m)),
        })
    };
    Ok(starts.zip(ends).filter_map(piece).collect())
}
