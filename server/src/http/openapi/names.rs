//! Names that a generated client should carry.

use super::node::{Members, Node, node};

const SCHEMAS: &str = "#/components/schemas/";

/// `MatchDto` becomes `Match`, and `Page_MatchDto` with all that it repeats becomes `MatchPage` of `Match`.
pub(super) fn plain(document: &mut Node) {
    document.for_each_object(&mut |members| {
        if let Some(Node::Text(target)) = members.get_mut("$ref")
            && let Some(name) = target.strip_prefix(SCHEMAS)
        {
            *target = format!("{SCHEMAS}{}", plain_name(name));
        }
    });
    let schemas = document.get_mut("components").and_then(|components| components.get_mut("schemas"));
    let Some(schemas) = schemas.and_then(Node::members) else { return };
    let mut renamed = Members::new();
    for (name, mut schema) in std::mem::take(schemas) {
        if let Some(item) = name.strip_prefix("Page_") {
            let item = format!("{SCHEMAS}{}", plain_name(item));
            if let Some(items) = schema.get_mut("properties").and_then(|members| members.get_mut("items")) {
                items.members().map(|items| items.insert("items".into(), node!({"$ref": item})));
            }
        }
        renamed.insert(plain_name(&name), schema);
    }
    renamed.sort_keys();
    *schemas = renamed;
}

fn plain_name(name: &str) -> String {
    match name.strip_prefix("Page_") {
        Some(item) => format!("{}Page", plain_name(item)),
        None => name.strip_suffix("Dto").unwrap_or(name).to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_named_after_their_items() {
        let mut document = node!({
            "x": {"$ref": "#/components/schemas/Page_MatchDto"},
            "components": {"schemas": {
                "MatchDto": {"type": "object"},
                "Page_MatchDto": {"properties": {"items": {"type": "array", "items": {"type": "object"}}}},
                "Problem": {},
            }},
        });
        plain(&mut document);
        let expected = node!({
            "x": {"$ref": "#/components/schemas/MatchPage"},
            "components": {"schemas": {
                "Match": {"type": "object"},
                "MatchPage": {"properties": {"items": {"type": "array", "items": {
                    "$ref": "#/components/schemas/Match"
                }}}},
                "Problem": {},
            }},
        });
        assert_eq!(document, expected);
    }
}
