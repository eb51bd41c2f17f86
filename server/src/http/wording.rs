//! Errors of parsers in words that a reader of the API knows, rather than those of the language it is written in.

/// Whole messages of number parsers, and what they mean.
const MESSAGES: [(&str, &str); 6] = [
    ("invalid digit found in string", "not a whole number"),
    ("cannot parse integer from empty string", "a whole number is missing"),
    ("number too large to fit in target type", "the number is too large"),
    ("number too small to fit in target type", "the number is too small"),
    ("invalid float literal", "not a number"),
    ("cannot parse float from empty string", "a number is missing"),
];

/// A parser's message without names of types.
pub(crate) fn plain(message: &str) -> String {
    let message = message.trim_start_matches("Failed to deserialize query string: ");
    let mut message = message.to_owned();
    for (theirs, ours) in MESSAGES {
        message = message.replace(theirs, ours);
    }
    let mut plain: Vec<&str> = Vec::new();
    let mut words = message.split(' ').peekable();
    while let Some(word) = words.next() {
        let bare = word.trim_end_matches([',', '.', ';']);
        let said = match bare {
            "usize" | "u64" | "u32" | "u16" | "u8" => "a whole number that is not negative",
            "isize" | "i64" | "i32" | "i16" | "i8" => "a whole number",
            "f64" | "f32" => "a number",
            "struct" | "enum" if words.peek().is_some() => {
                let name = words.next().unwrap_or_default();
                plain.push(if word == "struct" { "an object" } else { "one of its values" });
                if let Some(end) = name.chars().last().filter(|end| ",.;".contains(*end)) {
                    plain.push(if end == ',' { "," } else { ";" });
                }
                continue;
            }
            "sequence" => "list",
            "map" => "object",
            "variant" => "value",
            "floating" if words.peek() == Some(&"point") => {
                words.next();
                "number"
            }
            _ => {
                plain.push(word);
                continue;
            }
        };
        plain.push(said);
        if bare.len() < word.len() {
            plain.push(&word[bare.len()..]);
        }
    }
    plain.join(" ").replace(" ,", ",").replace(" ;", ";").replace(" .", ".")
}

/// What a CBOR reader says, taken out of the wrapping that it prints.
pub(crate) fn of_cbor(message: &str) -> String {
    if message.starts_with("Io(") {
        return "the body ends before its CBOR does".to_owned();
    }
    if message.starts_with("Syntax(") {
        return "the body is not CBOR".to_owned();
    }
    let inside = message.strip_prefix("Semantic(").and_then(|rest| rest.split_once(", \""));
    match inside.and_then(|(_, said)| said.strip_suffix("\")")) {
        Some(said) => said.replace("\\\"", "\""),
        None => message.to_owned(),
    }
}

/// Parts a message such as `scans[3].theta: not a number` into the path and the problem.
pub(crate) fn located(message: &str) -> (Option<&str>, &str) {
    match message.split_once(": ") {
        Some((path, problem)) if !path.is_empty() && path.bytes().all(is_of_path) => (Some(path), problem),
        _ => (None, message),
    }
}

fn is_of_path(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || b"_.[]".contains(&byte)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_type_of_the_language_is_named() {
        for (theirs, ours) in [
            (
                "invalid type: string \"x\", expected usize at line 1 column 9",
                "invalid type: string \"x\", expected a whole number that is not negative at line 1 column 9",
            ),
            ("invalid type: map, expected a sequence", "invalid type: object, expected a list"),
            (
                "invalid type: integer `3`, expected struct BatchDto",
                "invalid type: integer `3`, expected an object",
            ),
            ("invalid length 2, expected struct PoseDto, x", "invalid length 2, expected an object, x"),
            (
                "invalid type: floating point `1.5`, expected u8",
                "invalid type: number `1.5`, expected a whole number that is not negative",
            ),
            (
                "Failed to deserialize query string: limit: invalid digit found in string",
                "limit: not a whole number",
            ),
            ("unknown variant `x`, expected `a` or `b`", "unknown value `x`, expected `a` or `b`"),
            ("missing field `geometry`", "missing field `geometry`"),
        ] {
            assert_eq!(plain(theirs), ours);
        }
    }

    #[test]
    fn cbor_is_unwrapped() {
        let wrapped = r#"Semantic(None, "invalid type: string \"x\", expected u8")"#;
        assert_eq!(of_cbor(wrapped), "invalid type: string \"x\", expected u8");
        assert_eq!(of_cbor("Semantic(Some(7), \"too long\")"), "too long");
        assert_eq!(of_cbor("Io(Error { kind: UnexpectedEof })"), "the body ends before its CBOR does");
        assert_eq!(of_cbor("missing field `scans`"), "missing field `scans`");
    }

    #[test]
    fn paths_are_parted_from_problems() {
        assert_eq!(located("scans[3].theta: not a number"), (Some("scans[3].theta"), "not a number"));
        assert_eq!(located("missing field `x`: y"), (None, "missing field `x`: y"));
    }
}
