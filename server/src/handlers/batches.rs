//! Scans in, scans out.

use axum::Json;
use axum::extract::State;

use crate::dto::batches::{BatchDto, ReceiptDto, StoredScanDto};
use crate::dto::common::{Page, PageParams};
use crate::error::{ApiError, Problem};
use crate::extract::{BatchSlot, Body, Params, RunName, SiteOf};
use crate::state::AppState;

/// Append scans to a run; 200 means that they are translated and on disk.
///
/// Idempotent by sequence number: repeating an accepted batch answers as before and changes nothing. A gap, or an
/// overlap that differs from what is stored, answers 409 with `expected_sequence`.
#[utoipa::path(post, path = "/v1/sites/{site}/runs/{run}/batches", operation_id = "append_batch", tag = "runs",
    params(("site" = String, Path), ("run" = String, Path)),
    request_body(content((BatchDto = "application/json"), (BatchDto = "application/cbor"))),
    responses((status = 200, body = ReceiptDto), (status = 400, body = Problem), (status = 404, body = Problem),
        (status = 409, body = Problem), (status = 413, body = Problem), (status = 422, body = Problem),
        (status = 429, body = Problem)))]
pub async fn append_batch(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    BatchSlot(_slot): BatchSlot,
    Body(batch): Body<BatchDto>,
) -> Result<Json<ReceiptDto>, ApiError> {
    let receipt = state.app.append_batch(site, &name, batch.try_into()?).await?;
    Ok(Json(receipt.into()))
}

/// Stored scans, in order.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/scans", operation_id = "list_scans", tag = "runs",
    params(("site" = String, Path), ("run" = String, Path), PageParams),
    responses((status = 200, body = Page<StoredScanDto>), (status = 404, body = Problem)))]
pub async fn list_scans(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Params(page): Params<PageParams>,
) -> Result<Json<Page<StoredScanDto>>, ApiError> {
    let (first, limit) = (page.first()?, page.limit()?);
    let run = site.run(&name).await?;
    let scans = run.scans(first..first.saturating_add(limit as u64)).await?;
    let items = (first..).zip(scans).map(|(scan_seq, scan)| StoredScanDto::new(scan_seq, scan)).collect();
    Ok(Json(Page::of(items, first, run.head.next_sequence)))
}
