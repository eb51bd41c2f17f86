//! JSON whose members keep their order, so that readers and generators meet them as they were written.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// The members of an object, in order.
pub(super) type Members = IndexMap<String, Node>;

/// Any JSON value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Node {
    Null,
    Bool(bool),
    Number(serde_json::Number),
    Text(String),
    List(Vec<Node>),
    Object(Members),
}

impl Node {
    /// A member of an object.
    pub(super) fn get(&self, name: &str) -> Option<&Node> {
        match self {
            Self::Object(members) => members.get(name),
            _ => None,
        }
    }

    /// A member of an object, to be changed.
    pub(super) fn get_mut(&mut self, name: &str) -> Option<&mut Node> {
        self.members()?.get_mut(name)
    }

    /// The members of an object.
    pub(super) fn members(&mut self) -> Option<&mut Members> {
        match self {
            Self::Object(members) => Some(members),
            _ => None,
        }
    }

    /// A member of an object that is made when it is missing.
    pub(super) fn member(&mut self, name: &str, default: Node) -> Option<&mut Node> {
        Some(self.members()?.entry(name.to_owned()).or_insert(default))
    }

    pub(super) fn as_str(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    pub(super) fn list(&mut self) -> Option<&mut Vec<Node>> {
        match self {
            Self::List(items) => Some(items),
            _ => None,
        }
    }

    /// Calls a function on every object below, parents first.
    pub(super) fn for_each_object(&mut self, change: &mut impl FnMut(&mut Members)) {
        match self {
            Self::Object(members) => {
                change(members);
                members.values_mut().for_each(|value| value.for_each_object(change));
            }
            Self::List(items) => items.iter_mut().for_each(|item| item.for_each_object(change)),
            _ => {}
        }
    }
}

impl From<serde_json::Value> for Node {
    fn from(value: serde_json::Value) -> Self {
        use serde_json::Value;
        match value {
            Value::Null => Self::Null,
            Value::Bool(value) => Self::Bool(value),
            Value::Number(value) => Self::Number(value),
            Value::String(value) => Self::Text(value),
            Value::Array(items) => Self::List(items.into_iter().map(Self::from).collect()),
            Value::Object(members) => {
                Self::Object(members.into_iter().map(|(name, value)| (name, Self::from(value))).collect())
            }
        }
    }
}

/// A node written as JSON.
macro_rules! node {
    ($($json:tt)+) => {
        $crate::http::openapi::node::Node::from(serde_json::json!($($json)+))
    };
}
pub(super) use node;
