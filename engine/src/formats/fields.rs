//! Words of one line, with errors that say where.

use thiserror::Error;

use crate::geometry::Pose2;

/// A text that does not follow its format.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: {problem}")]
pub struct FormatError {
    /// Line of the text, from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: String,
}

impl FormatError {
    /// An error in `line`, counted from 1.
    pub fn new(line: usize, problem: impl Into<String>) -> Self {
        Self { line, problem: problem.into() }
    }
}

/// The words of a line, taken from the left.
pub(super) struct Fields<'a> {
    words: std::str::SplitAsciiWhitespace<'a>,
    line: usize,
}

impl<'a> Fields<'a> {
    pub(super) fn new(text: &'a str, line: usize) -> Self {
        Self { words: text.split_ascii_whitespace(), line }
    }

    pub(super) fn error(&self, problem: impl Into<String>) -> FormatError {
        FormatError::new(self.line, problem)
    }

    pub(super) fn next_word(&mut self) -> Option<&'a str> {
        self.words.next()
    }

    pub(super) fn word_or(&mut self, name: &str, idx: usize) -> Result<&'a str, FormatError> {
        self.words.next().ok_or_else(|| self.error(format!("the line ends before {name} {idx}")))
    }

    /// A finite number; `name` says in errors what it was to be.
    pub(super) fn number(&mut self, name: &str) -> Result<f64, FormatError> {
        let word = self.words.next().ok_or_else(|| self.error(format!("the line ends before the {name}")))?;
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(format!("{name} is '{word}', not a finite number"))),
        }
    }

    pub(super) fn count(&mut self, name: &str) -> Result<usize, FormatError> {
        let word = self.words.next().ok_or_else(|| self.error(format!("the line ends before the {name}")))?;
        word.parse().map_err(|_| self.error(format!("{name} is '{word}', not a count")))
    }

    pub(super) fn pose(&mut self, name: &str) -> Result<Pose2, FormatError> {
        Ok(Pose2::new(self.number(name)?, self.number(name)?, self.number(name)?))
    }
}

/// A text without the byte order mark that some editors put before its first character.
pub(super) fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// Lines that hold something, with their number from 1: neither empty nor a `#` comment.
pub(super) fn content_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    without_mark(text)
        .lines()
        .enumerate()
        .map(|(idx, line)| (idx + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}
