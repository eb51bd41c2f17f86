//! What every handler can reach.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;

use crate::app::App;
use crate::auth::Keys;

/// Shared by all requests.
#[derive(Clone)]
pub struct AppState {
    /// The use cases.
    pub app: Arc<App>,
    /// Who may do what.
    pub keys: Arc<Keys>,
    /// What `/metrics` prints.
    pub metrics: PrometheusHandle,
}
