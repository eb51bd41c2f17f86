//! What every handler can reach.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;

use crate::app::App;
use crate::auth::Gate;
use crate::intake::Places;

/// Shared by all requests.
#[derive(Clone)]
pub struct AppState {
    /// The use cases.
    pub app: Arc<App>,
    /// Who may come in.
    pub gate: Arc<Gate>,
    /// Room for requests.
    pub places: Arc<Places>,
    /// What `/metrics` prints.
    pub metrics: PrometheusHandle,
}
