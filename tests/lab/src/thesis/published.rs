//! The published numbers, where the file that lists them is at hand.

use std::path::{Path, PathBuf};

use serde_json::Value;

/// `thesis_results.json`, or nothing.
pub(super) struct Published(Option<Value>);

impl Published {
    /// From a file, or from where it usually lies.
    pub(super) fn load(path: Option<&Path>) -> Self {
        let folder =
            std::env::var_os("LOCUTION_GOLDEN").map_or(PathBuf::from("../shared/golden"), PathBuf::from);
        let path = path.map_or(folder.join("thesis_results.json"), Path::to_owned);
        let value = std::fs::read_to_string(&path).ok().and_then(|text| serde_json::from_str(&text).ok());
        if value.is_none() {
            println!("no published numbers at {}; their columns stay empty", path.display());
        }
        Self(value)
    }

    /// Precision and recall at a JSON pointer, written as a list or as an object.
    pub(super) fn pair(&self, pointer: &str) -> Option<(f64, f64)> {
        let value = self.0.as_ref()?.pointer(pointer)?;
        let number =
            |key: &str, idx: usize| value.get(key).or_else(|| value.get(idx)).and_then(Value::as_f64);
        Some((number("precision", 0)?, number("recall", 1)?))
    }
}
