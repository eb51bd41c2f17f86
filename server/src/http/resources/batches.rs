//! Scans in, scans out.

use axum::Json;
use axum::extract::State;
use locution_engine::scan::Scan;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

use super::texts::FrameDto;
use crate::app::runs::{FrameOf, NewBatch, scans_in};
use crate::error::ApiError;
use crate::extract::{Body, Paged, RunName, SiteOf};
use crate::http::nanoseconds;
use crate::http::ranges::RangesDto;
use crate::http::values::{Page, PageParams, PoseDto, window};
use crate::records::Receipt;
use crate::state::AppState;

/// One sweep with the odometry at its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanDto {
    /// As the robot's clock said, nanoseconds; stored and served, never used to sort.
    #[serde(with = "nanoseconds")]
    #[schema(value_type = i64, example = 1763800000000000000i64)]
    pub timestamp_ns: i64,
    /// Raw odometry of the robot. A robot without odometry leaves it out of all scans of a run; it is then driven by
    /// its laser alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odom_from_robot: Option<PoseDto>,
    /// How fast the robot turned then by a gyroscope, counter-clockwise; it helps where odometry and laser are in doubt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(example = 0.35, minimum = -100, maximum = 100)]
    pub angular_velocity_rad_per_s: Option<f64>,
    /// Readings in metres, in the order of the geometry's beams.
    pub ranges_m: RangesDto,
}

impl ScanDto {
    /// The engine's scan.
    ///
    /// # Errors
    /// 422 naming the scan, the field and the reading.
    pub fn check(self, scan_idx: usize) -> Result<Scan, ApiError> {
        let odom_from_robot =
            self.odom_from_robot.unwrap_or_default().check().map_err(|(name, problem)| {
                let detail = format!("the odometry of scan {scan_idx} cannot be: {problem}");
                ApiError::invalid_scan(format!("scans[{scan_idx}].odom_from_robot.{name}"), detail)
            })?;
        let angular_velocity_rad_per_s = self.angular_velocity_rad_per_s;
        if angular_velocity_rad_per_s
            .is_some_and(|rate| rate.is_nan() || rate.abs() > TURN_RATE_MAX_RAD_PER_S)
        {
            let detail = format!("scan {scan_idx} cannot turn so fast: radians per second, not degrees");
            let field = format!("scans[{scan_idx}].angular_velocity_rad_per_s");
            return Err(ApiError::invalid_scan(field, detail));
        }
        // Minus infinity is how sensors say "too near".
        let is_negative = |range_m: &f32| *range_m < 0.0 && range_m.is_finite();
        let negative = self.ranges_m.0.iter().position(is_negative);
        if let Some(range_idx) = negative {
            let range_m = self.ranges_m.0[range_idx];
            let detail =
                format!("range {range_idx} of scan {scan_idx} is {range_m} m; ranges are not negative");
            return Err(ApiError::invalid_scan(format!("scans[{scan_idx}].ranges_m[{range_idx}]"), detail));
        }
        Ok(Scan {
            timestamp_ns: self.timestamp_ns,
            odom_from_robot,
            angular_velocity_rad_per_s,
            ranges_m: self.ranges_m.0,
        })
    }
}

/// No robot turns faster.
const TURN_RATE_MAX_RAD_PER_S: f64 = 100.0;

/// Scans in order, checked one by one, all of which have odometry or none.
///
/// # Errors
/// 422 naming the first scan that cannot be, with the field.
pub fn checked_batch(first_sequence: u64, scans: Vec<ScanDto>) -> Result<NewBatch, ApiError> {
    let has_odometry = scans.first().is_none_or(|scan| scan.odom_from_robot.is_some());
    if let Some(scan_idx) = scans.iter().position(|scan| scan.odom_from_robot.is_some() != has_odometry) {
        let detail = format!(
            "scan {scan_idx} differs from scan 0: the scans of a run have odometry all of them or none"
        );
        return Err(ApiError::invalid_scan(format!("scans[{scan_idx}].odom_from_robot"), detail));
    }
    let scans = scans.into_iter().enumerate().map(|(idx, scan)| scan.check(idx));
    Ok(NewBatch { first_sequence, scans: scans.collect::<Result<_, _>>()?, has_odometry })
}

/// Scans to append to a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BatchDto {
    /// Sequence number of the first scan; the first scan of a run has 0.
    #[schema(example = 0)]
    pub first_sequence: u64,
    /// In order.
    pub scans: Vec<ScanDto>,
}

impl TryFrom<BatchDto> for NewBatch {
    type Error = ApiError;

    fn try_from(batch: BatchDto) -> Result<Self, ApiError> {
        checked_batch(batch.first_sequence, batch.scans)
    }
}

/// The answer to an accepted batch, also when it is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReceiptDto {
    /// The sequence number to send next.
    pub next_sequence: u64,
    /// Observations of the run after this batch.
    pub num_observations: u64,
    /// Words of all levels of the run after this batch.
    pub num_words: u64,
}

impl From<Receipt> for ReceiptDto {
    fn from(receipt: Receipt) -> Self {
        Self {
            next_sequence: receipt.next_sequence,
            num_observations: receipt.num_observations,
            num_words: receipt.num_words,
        }
    }
}

/// A stored scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StoredScanDto {
    /// Sequence number.
    pub scan_seq: u64,
    /// As sent.
    pub timestamp_ns: i64,
    /// As sent; all zero for a robot without odometry.
    pub odom_from_robot: PoseDto,
    /// As sent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angular_velocity_rad_per_s: Option<f64>,
    /// As sent; readings without a return are null, those too near or missing at the end are 0.
    pub ranges_m: RangesDto,
}

impl StoredScanDto {
    /// A scan with its number.
    pub fn new(scan_seq: u64, scan: Scan) -> Self {
        Self {
            scan_seq,
            timestamp_ns: scan.timestamp_ns,
            odom_from_robot: scan.odom_from_robot.into(),
            angular_velocity_rad_per_s: scan.angular_velocity_rad_per_s,
            ranges_m: RangesDto(scan.ranges_m),
        }
    }
}

/// Append scans to a run; 200 means that they are translated and on disk.
///
/// Idempotent by sequence number: repeating an accepted batch answers as before and changes nothing. A gap, or an
/// overlap that differs from what is stored, answers 409 with `expected_sequence`.
#[utoipa::path(post, path = "/v1/sites/{site}/runs/{run}/batches", operation_id = "append_batch", tag = "runs",
    request_body(content((BatchDto = "application/json"), (BatchDto = "application/cbor"))),
    responses((status = 200, description = "The scans are translated and on disk", body = ReceiptDto),
        (status = 409, description = "The batch does not continue the run; `expected_sequence` says what does")))]
pub async fn append_batch(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Body(batch): Body<BatchDto>,
) -> Result<Json<ReceiptDto>, ApiError> {
    let receipt = state.app.append_batch(site, &name, batch.try_into()?).await?;
    Ok(Json(receipt.into()))
}

/// Which scans to list.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ScanParams {
    /// Not before, nanoseconds.
    pub from_ns: Option<i64>,
    /// Before, nanoseconds.
    pub to_ns: Option<i64>,
    /// Within this rectangle: `x,y,x,y` of two opposite corners, metres in `frame`.
    #[param(pattern = "^-?[0-9.eE+-]+(,-?[0-9.eE+-]+){3}$", max_length = 200, example = "0,0,12.5,8")]
    pub area: Option<String>,
    /// In whose coordinates the area is; `odom` unless said.
    #[param(inline)]
    pub frame: Option<FrameDto>,
    /// Version of the map, when the frame is `map`; the serving one unless said.
    #[serde(default, deserialize_with = "crate::http::values::in_query")]
    pub version: Option<u64>,
}

/// Stored scans, in order; all of them, or those of a time and an area.
#[utoipa::path(get, path = "/v1/sites/{site}/runs/{run}/scans", operation_id = "list_scans", tag = "runs",
    params(ScanParams, PageParams),
    responses((status = 200, description = "A page of scans", body = Page<StoredScanDto>)))]
pub async fn list_scans(
    SiteOf(site): SiteOf,
    RunName(name): RunName,
    Paged(params, page): Paged<ScanParams>,
) -> Result<Json<Page<StoredScanDto>>, ApiError> {
    let run = site.run(&name).await?;
    let window = window(params.from_ns, params.to_ns, params.area.as_deref())?;
    let of = FrameOf { frame: params.frame.unwrap_or(FrameDto::Odom).into(), version: params.version };
    let (scans, next) = scans_in(&site, &run, &window, of, page.first, page.limit).await?;
    let items = scans.into_iter().map(|(scan_seq, scan)| StoredScanDto::new(scan_seq, scan)).collect();
    Ok(Json(Page { items, next_cursor: next.map(|next| next.to_string()) }))
}
