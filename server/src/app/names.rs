//! Names that clients choose for sites and runs.

use std::fmt;

use super::AppError;

/// A checked name: 1 to 64 of `A–Z a–z 0–9 . _ -`, not beginning with a dot.
///
/// The rule keeps names safe as path segments of URLs and of the data directory, and free of zero bytes in keys.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Name(String);

impl Name {
    /// Checks a name; `field` says in errors where it stood.
    ///
    /// # Errors
    /// [`AppError::Invalid`] with the rule.
    pub fn new(text: &str, field: &str) -> Result<Self, AppError> {
        let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || b"._-".contains(&byte);
        if text.is_empty() || text.len() > 64 || text.starts_with('.') || !text.bytes().all(is_allowed) {
            let rule = "a name is 1 to 64 of the characters A–Z a–z 0–9 . _ - and does not begin with a dot";
            return Err(AppError::invalid(field, rule));
        }
        Ok(Self(text.to_owned()))
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_harmless_names_pass() {
        for good in ["a", "Floor-2_b.v1", &"x".repeat(64)] {
            assert!(Name::new(good, "site").is_ok(), "{good}");
        }
        for bad in ["", ".hidden", "..", "a/b", "a b", "ä", "a\0", &"x".repeat(65)] {
            assert!(Name::new(bad, "site").is_err(), "{bad}");
        }
    }
}
