//! Lists come in pages.

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::client::Client;
use crate::error::ClientError;
use crate::routes::{Query, Route};

const NUM_ITEMS_PER_PAGE: u32 = 1_000;

#[derive(Deserialize)]
struct Page<T> {
    items: Vec<T>,
    next_cursor: Option<String>,
}

impl Client {
    /// All items of a list, page after page.
    pub(crate) async fn all<T: DeserializeOwned>(
        &self,
        route: &Route,
        names: &[&str],
        query: Query,
    ) -> Result<Vec<T>, ClientError> {
        let query = query.and("limit", Some(NUM_ITEMS_PER_PAGE));
        let mut items = Vec::new();
        let mut cursor = None;
        loop {
            let page: Page<T> = self.get(route, names, &query.clone().and("cursor", cursor)).await?;
            items.extend(page.items);
            if page.next_cursor.is_none() {
                return Ok(items);
            }
            cursor = page.next_cursor;
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
