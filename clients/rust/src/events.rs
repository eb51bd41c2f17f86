//! What happens in a site, as it happens.

use reqwest::Response;

use crate::client::{Body, Client};
use crate::error::ClientError;
use crate::routes;
use crate::types::Event;

/// Events of a site, as long as the server sends them.
pub struct Events {
    response: Response,
    path: String,
    /// What has come and is no whole line yet.
    pending: Vec<u8>,
    /// Data of the event that is being read.
    data: String,
}

impl Client {
    /// Watches a site from now on. The stream ends when the site is deleted or the server stops.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub async fn events(&self, site: &str) -> Result<Events, ClientError> {
        let path = routes::WATCH_SITE.with(&[site]);
        let method = routes::WATCH_SITE.method.clone();
        let response = self.send(method, &path, "text/event-stream", Body::Empty).await?;
        Ok(Events { response, path, pending: Vec::new(), data: String::new() })
    }
}

impl Events {
    /// The next event; `None` at the end of the stream.
    ///
    /// # Errors
    /// [`ClientError::Transport`] when the connection is lost, [`ClientError::Answer`] for an event that cannot be read.
    pub async fn next(&mut self) -> Result<Option<Event>, ClientError> {
        loop {
            while let Some(end) = self.pending.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.pending.drain(..=end).collect();
                if let Some(event) = self.read_line(String::from_utf8_lossy(&line).trim_end())? {
                    return Ok(Some(event));
                }
            }
            match self.response.chunk().await.map_err(ClientError::Transport)? {
                Some(bytes) => self.pending.extend_from_slice(&bytes),
                None => return Ok(None),
            }
        }
    }

    /// Takes a line in; an empty one ends an event.
    fn read_line(&mut self, line: &str) -> Result<Option<Event>, ClientError> {
        if let Some(data) = line.strip_prefix("data:") {
            self.data.push_str(data.trim_start());
        }
        if !line.is_empty() || self.data.is_empty() {
            return Ok(None);
        }
        let data = std::mem::take(&mut self.data);
        serde_json::from_str(&data)
            .map(Some)
            .map_err(|error| ClientError::Answer { path: self.path.clone(), problem: error.to_string() })
    }
}
