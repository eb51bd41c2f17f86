//! What holds for every operation: the names in its path, the problems that any request can meet, the bounds of
//! numbers, the order of media types.

use super::node::{Members, Node, node};

/// Paths below need a key, once any is configured, and pass through the bounded queues.
const GUARDED: [&str; 2] = ["/v1/", "/metrics"];

/// Names that stand in paths: what they name, their form and longest length.
const PATH_PARAMETERS: [(&str, &str, &str, usize); 6] = [
    ("site", "Name of the site, chosen by the client", r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$", 64),
    ("run", "Name of the run in its site, chosen by the client", r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$", 64),
    ("channel", "Name of the channel, chosen by the client", r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$", 64),
    ("robot", "Name of the robot, chosen by the client", r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$", 64),
    ("key", "Name of the key, chosen when it was made", r"^[A-Za-z0-9_-][A-Za-z0-9._-]*$", 64),
    ("id", "Its name, chosen by the server", r"^[0-9]+$", 19),
];

/// Problems by status: what they are called, and what they mean unless the handler says more.
const PROBLEMS: [(&str, &str, &str); 13] = [
    ("400", "BadRequest", "The query or the body cannot be read, or has unknown members"),
    ("401", "Unauthorized", "A key is needed"),
    ("403", "Forbidden", "The key does not allow this"),
    ("404", "NotFound", "Nothing of this name exists"),
    ("408", "RequestTimeout", "The body came too slowly, or the request took longer than the server allows"),
    ("409", "Conflict", "The request does not fit what stands"),
    ("410", "Gone", "It is not kept any more"),
    ("413", "PayloadTooLarge", "The body is larger than the server's limit"),
    ("415", "UnsupportedMediaType", "The body's type or encoding is not understood"),
    ("422", "UnprocessableContent", "A value is well formed and invalid; `field` names it"),
    (
        "429",
        "TooManyRequests",
        "A queue is full or a key asks too often; `Retry-After` says when to ask again",
    ),
    ("500", "InternalServerError", "A fault of the server"),
    ("503", "ServiceUnavailable", "The server or its storage is busy; `Retry-After` says when to ask again"),
];

/// Applies all rules to a document whose schemas have their final names.
pub(super) fn apply(document: &mut Node) {
    let Some(paths) = document.get_mut("paths").and_then(Node::members) else { return };
    for (path, item) in paths {
        let Some(operations) = item.members() else { continue };
        for (method, operation) in operations {
            name_path_parameters(path, operation);
            json_first(operation);
            add_refusals(path, method, operation);
            type_answers(operation);
        }
    }
    document.for_each_object(&mut bound_integer);
    document.for_each_object(&mut bound_size);
    document.for_each_object(&mut size_covariance);
    let responses =
        PROBLEMS.iter().map(|(status, name, meaning)| ((*name).to_owned(), problem(status, meaning)));
    let responses = Node::Object(responses.collect());
    if let Some(components) = document.get_mut("components").and_then(Node::members) {
        components.insert("responses".into(), responses);
        let key = node!({"key": {"type": "http", "scheme": "bearer", "description": "An API key"}});
        components.insert("securitySchemes".into(), key);
    }
    if let Some(members) = document.members() {
        members.insert("security".into(), node!([{}, {"key": []}]));
    }
}

/// A problem document with its headers.
fn problem(status: &str, meaning: &str) -> Node {
    let problem = node!({"$ref": "#/components/schemas/Problem"});
    let content = node!({"application/problem+json": {"schema": problem}});
    if status != "429" && status != "503" {
        return node!({"description": meaning, "content": content});
    }
    let retry_after = node!({
        "description": "Seconds until it is worth asking again",
        "schema": {"type": "integer", "minimum": 0},
    });
    node!({"description": meaning, "headers": {"Retry-After": retry_after}, "content": content})
}

fn name_path_parameters(path: &str, operation: &mut Node) {
    let named = PATH_PARAMETERS.iter().filter(|(name, ..)| path.contains(&format!("{{{name}}}")));
    let mut parameters: Vec<Node> = named
        .map(|(name, meaning, pattern, length_max)| {
            let schema =
                node!({"type": "string", "minLength": 1, "maxLength": length_max, "pattern": pattern});
            node!({"name": name, "in": "path", "required": true, "description": meaning, "schema": schema})
        })
        .collect();
    let is_in_path = |parameter: &Node| parameter.get("in").and_then(Node::as_str) == Some("path");
    if let Some(own) = operation.get_mut("parameters").and_then(Node::list) {
        parameters.extend(std::mem::take(own).into_iter().filter(|parameter| !is_in_path(parameter)));
    }
    if !parameters.is_empty()
        && let Some(members) = operation.members()
    {
        members.insert("parameters".into(), Node::List(parameters));
    }
}

/// Generators take the first of several media types.
fn json_first(operation: &mut Node) {
    let content = operation.get_mut("requestBody").and_then(|body| body.get_mut("content"));
    if let Some(content) = content.and_then(Node::members)
        && let Some(idx) = content.get_index_of("application/json")
    {
        content.move_index(idx, 0);
    }
}

/// The problems that any request of this kind can meet, beside those that the handler names.
fn add_refusals(path: &str, method: &str, operation: &mut Node) {
    let has_body = operation.get("requestBody").is_some();
    let parameters = match operation.get("parameters") {
        Some(Node::List(parameters)) => parameters.as_slice(),
        _ => &[],
    };
    let has_query =
        parameters.iter().any(|parameter| parameter.get("in").and_then(Node::as_str) == Some("query"));
    let is_guarded = GUARDED.iter().any(|prefix| path.starts_with(prefix));
    let has_names = path.contains('{');
    let mut statuses = vec!["408", "500", "503"];
    if is_guarded {
        statuses.extend(["401", "403", "429"]);
    }
    if has_names {
        statuses.extend(["404", "422"]);
    }
    if has_body || has_query {
        statuses.extend(["400", "422"]);
    }
    if has_body {
        statuses.extend(["413", "415"]);
    }
    // Work waits in bounded queues.
    if method == "post" {
        statuses.push("429");
    }
    let Some(responses) = operation.member("responses", Node::Object(Members::new())) else { return };
    let Some(responses) = responses.members() else { return };
    for (status, name, _) in PROBLEMS {
        let reference = || node!({"$ref": format!("#/components/responses/{name}")});
        match responses.get(status) {
            Some(own) => {
                let meaning = own.get("description").and_then(Node::as_str).unwrap_or_default().to_owned();
                responses.insert(
                    status.into(),
                    if meaning.is_empty() { reference() } else { problem(status, &meaning) },
                );
            }
            None if statuses.contains(&status) => {
                responses.insert(status.into(), reference());
            }
            None => {}
        }
    }
    responses.sort_keys();
}

/// Answers that are no text are bytes.
fn type_answers(operation: &mut Node) {
    let responses = operation.get_mut("responses").and_then(Node::members);
    for response in responses.into_iter().flat_map(|responses| responses.values_mut()) {
        let content = response.get_mut("content").and_then(Node::members);
        for (media_type, body) in content.into_iter().flatten() {
            let is_binary = media_type == "application/octet-stream"
                || media_type.starts_with("image/") && media_type != "image/svg+xml";
            let Some(body) = body.members() else { continue };
            if is_binary {
                body.insert("schema".into(), node!({"type": "string", "format": "binary"}));
            } else if media_type == "application/yaml" {
                // A schema speaks of what the YAML says, not of its text.
                body.insert("schema".into(), node!({"type": "object"}));
            }
        }
    }
}

/// Formats of Rust's integers become those that generators know, with their bounds.
fn bound_integer(schema: &mut Members) {
    let Some(format) = schema.get("format").and_then(Node::as_str) else { return };
    // utoipa writes `u-int32` for an unsigned integer.
    let (format, minimum, maximum) = match format.replace('-', "").as_str() {
        "int8" => ("int32", i64::from(i8::MIN), i64::from(i8::MAX)),
        "uint8" => ("int32", 0, i64::from(u8::MAX)),
        "uint16" => ("int32", 0, i64::from(u16::MAX)),
        "uint32" => ("int64", 0, i64::from(u32::MAX)),
        "int32" => ("int32", i64::from(i32::MIN), i64::from(i32::MAX)),
        "int64" => ("int64", i64::MIN, i64::MAX),
        // The highest bit is not used, so that every language can hold the number.
        "uint64" => ("int64", 0, i64::MAX),
        _ => return,
    };
    schema.insert("format".into(), node!(format));
    schema.entry("minimum".into()).or_insert(node!(minimum));
    schema.entry("maximum".into()).or_insert(node!(maximum));
}

/// Sizes and numbers of things, which have no format: nothing uses the highest bit.
fn bound_size(schema: &mut Members) {
    let kind = schema.get("type");
    let is_integer = match kind {
        Some(Node::List(kinds)) => kinds.iter().any(|kind| kind.as_str() == Some("integer")),
        Some(kind) => kind.as_str() == Some("integer"),
        None => false,
    };
    if is_integer && schema.get("format").is_none() {
        schema.entry("maximum".into()).or_insert(node!(i64::MAX));
    }
}

/// A covariance of (x, y, θ) has three rows of three.
fn size_covariance(members: &mut Members) {
    let mut level = members.get_mut("covariance");
    while let Some(Node::Object(array)) = level.take_if(|level| level.get("items").is_some()) {
        array.insert("minItems".into(), node!(3));
        array.insert("maxItems".into(), node!(3));
        level = array.get_mut("items");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_gets_what_holds_for_all() {
        let mut document = node!({
            "paths": {"/v1/sites/{site}": {"put": {
                "requestBody": {"content": {"application/cbor": {}, "application/json": {}}},
                "responses": {"201": {"description": "made"}, "409": {"description": "other"}},
            }}},
            "components": {"schemas": {"Pose": {"properties": {
                "covariance": {"type": "array", "items": {"type": "array", "items": {"type": "number"}}},
                "count": {"type": "integer", "format": "u-int8"},
                "size": {"type": ["integer", "null"], "minimum": 0},
            }}}},
        });
        apply(&mut document);
        let json = serde_json::to_value(&document).unwrap();
        let put = &json["paths"]["/v1/sites/{site}"]["put"];
        assert_eq!(put["parameters"][0]["name"], "site");
        let statuses: Vec<&String> = put["responses"].as_object().unwrap().keys().collect();
        let expected =
            ["201", "400", "401", "403", "404", "408", "409", "413", "415", "422", "429", "500", "503"];
        assert_eq!(statuses.len(), expected.len(), "{statuses:?}");
        assert!(statuses.iter().all(|status| expected.contains(&status.as_str())), "{statuses:?}");
        assert_eq!(put["responses"]["409"]["description"], "other");
        assert!(put["responses"]["409"]["content"]["application/problem+json"].is_object());
        assert_eq!(put["responses"]["404"]["$ref"], "#/components/responses/NotFound");
        let text = serde_json::to_string(&document).unwrap();
        assert!(text.find("application/json").unwrap() < text.find("application/cbor").unwrap());
        let members = &json["components"]["schemas"]["Pose"]["properties"];
        assert_eq!(
            (&members["count"]["format"], &members["count"]["maximum"]),
            (&"int32".into(), &255.into())
        );
        assert_eq!(members["size"]["maximum"], i64::MAX);
        assert_eq!(members["covariance"]["items"]["minItems"], 3);
    }
}
