//! What every handler can reach.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;

use crate::app::App;
use crate::auth::Gate;
use crate::elsewhere::Elsewhere;
use crate::intake::Places;

/// Shared by all requests.
#[derive(Clone)]
pub struct AppState {
    /// The use cases.
    pub app: Arc<App>,
    /// Who may come in.
    pub gate: Arc<Gate>,
    /// The other servers, when several share a store.
    pub elsewhere: Option<Arc<dyn Elsewhere>>,
    /// Room for requests.
    pub places: Arc<Places>,
    /// What `/metrics` prints.
    pub metrics: PrometheusHandle,
}
