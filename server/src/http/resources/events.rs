//! What happens in a site, as server-sent events.

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::{FromRequestParts, State};
use axum::http::request::Parts;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::jobs::JobDto;
use super::localizations::LocalizationStateDto;
use crate::app::site::{EventId, RunChange, SiteEvent, Watched};
use crate::error::ApiError;
use crate::extract::SiteOf;
use crate::state::AppState;

/// A stream without events says that it lives this often.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunChangeDto {
    /// It was made.
    Made,
    /// It takes no more scans.
    Finished,
    /// It was forgotten.
    Deleted,
}

/// Something that happened in a site.
#[derive(Clone, Debug, Serialize, Deserialize, ToSchema)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum EventDto {
    /// A run was made, finished or deleted.
    Run {
        /// Its name.
        run: String,
        /// What became of it.
        change: RunChangeDto,
    },
    /// Scans were stored and became text.
    Words {
        /// The run.
        run: String,
        /// The sequence number that it expects next.
        next_sequence: u64,
        /// Observations of the run.
        num_observations: u64,
        /// Words of all levels of the run.
        num_words: u64,
    },
    /// A job was queued, begun or ended.
    Job {
        /// As it stood.
        job: JobDto,
    },
    /// Another version of the map serves.
    Version {
        /// Its number.
        version: u64,
        /// Parts that nothing connects.
        num_components: u32,
    },
    /// What matches the version has that serves now.
    Matches {
        /// Its number.
        version: u64,
        /// Matches, whatever became of them.
        num_matches: u64,
        /// Matches that hold the map together.
        num_verified: u64,
    },
    /// A robot that localises was found or lost.
    Localization {
        /// Name of the localisation.
        id: String,
        /// How sure it is now.
        state: LocalizationStateDto,
    },
    /// Events have gone that were not read; look at the lists.
    Missed {},
}

impl EventDto {
    fn name(&self) -> &'static str {
        match self {
            Self::Run { .. } => "run",
            Self::Words { .. } => "words",
            Self::Job { .. } => "job",
            Self::Version { .. } => "version",
            Self::Matches { .. } => "matches",
            Self::Localization { .. } => "localization",
            Self::Missed {} => "missed",
        }
    }
}

impl From<&SiteEvent> for EventDto {
    fn from(event: &SiteEvent) -> Self {
        match event {
            SiteEvent::Run { run, change } => Self::Run {
                run: run.clone(),
                change: match change {
                    RunChange::Made => RunChangeDto::Made,
                    RunChange::Finished => RunChangeDto::Finished,
                    RunChange::Deleted => RunChangeDto::Deleted,
                },
            },
            SiteEvent::Words { run, receipt } => Self::Words {
                run: run.clone(),
                next_sequence: receipt.next_sequence,
                num_observations: receipt.num_observations,
                num_words: receipt.num_words,
            },
            SiteEvent::Job(job) => Self::Job { job: job.clone().into() },
            &SiteEvent::Version { version, num_components } => Self::Version { version, num_components },
            &SiteEvent::Matches { version, num_matches, num_verified } => {
                Self::Matches { version, num_matches, num_verified }
            }
            SiteEvent::Localization { id, state } => {
                Self::Localization { id: id.to_string(), state: (*state).into() }
            }
        }
    }
}

/// The event that a client has read last.
pub struct LastEvent(Option<EventId>);

impl FromRequestParts<AppState> for LastEvent {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _: &AppState) -> Result<Self, ApiError> {
        let Some(value) = parts.headers.get("last-event-id") else { return Ok(Self(None)) };
        let id = value.to_str().ok().and_then(|text| {
            let (epoch, number) = text.split_once('-')?;
            Some(EventId { epoch: u64::from_str_radix(epoch, 16).ok()?, number: number.parse().ok()? })
        });
        // Whatever else it is, it is none of ours: what came before is missed.
        Ok(Self(Some(id.unwrap_or(EventId { epoch: 0, number: 0 }))))
    }
}

fn as_sse(watched: &Watched) -> Event {
    let (id, event) = match watched {
        Watched::Event(id, event) => (id, EventDto::from(&**event)),
        Watched::Missed(id) => (id, EventDto::Missed {}),
    };
    let data = serde_json::to_string(&event).unwrap_or_default();
    Event::default().id(format!("{:x}-{}", id.epoch, id.number)).event(event.name()).data(data)
}

/// What happens in the site from now on, as server-sent events: runs, words, jobs, map versions, matches, robots found
/// and lost. Each has an `id`; with the last one as `Last-Event-ID` a stream goes on behind it while the latest 1,000
/// events are kept, and begins with `missed` when some have gone or the server was started anew. The stream ends when
/// the site is deleted or the server stops.
#[utoipa::path(get, path = "/v1/sites/{site}/events", operation_id = "watch_site", tag = "sites",
    params(("Last-Event-ID" = Option<String>, Header, description = "The `id` of the event that was read last")),
    responses((status = 200, description = "Events, as long as the client reads", body = EventDto,
            content_type = "text/event-stream"),
        (status = 429, description = "As many streams as the server allows are open")))]
pub async fn watch_site(
    State(state): State<AppState>,
    SiteOf(site): SiteOf,
    LastEvent(last): LastEvent,
) -> Result<Response, ApiError> {
    let slot = state.app.event_slot()?;
    let watcher = site.events().watch(last);
    let events = futures::stream::unfold((watcher, slot), async |(mut watcher, slot)| {
        let watched = watcher.next().await?;
        Some((Ok::<_, Infallible>(as_sse(&watched)), (watcher, slot)))
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)).into_response())
}
