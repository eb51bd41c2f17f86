//! Lists come in pages.

use reqwest::Method;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::client::{Body, Client};
use crate::error::ClientError;

#[derive(Deserialize)]
struct Page<T> {
    items: Vec<T>,
    next_cursor: Option<String>,
}

impl Client {
    /// All items of a list; `path` may have a query of its own.
    pub(crate) async fn all_pages<T: DeserializeOwned>(&self, path: &str) -> Result<Vec<T>, ClientError> {
        let separator = if path.contains('?') { '&' } else { '?' };
        let first = format!("{path}{separator}limit=1000");
        let mut items = Vec::new();
        let mut next = first.clone();
        loop {
            let page: Page<T> = self.json(Method::GET, &next, Body::Empty).await?;
            items.extend(page.items);
            match page.next_cursor {
                Some(cursor) => next = format!("{first}&cursor={}", percent_encoded(&cursor)),
                None => return Ok(items),
            }
        }
    }
}

/// Cursors are opaque, so every byte that is not plainly safe in a query is escaped.
pub(crate) fn percent_encoded(text: &str) -> String {
    text.bytes()
        .map(|byte| match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                char::from(byte).to_string()
            }
            _ => format!("%{byte:02X}"),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes_what_means_something_in_a_query() {
        assert_eq!(percent_encoded("a=b&c d+é"), "a%3Db%26c%20d%2B%C3%A9");
    }
}
