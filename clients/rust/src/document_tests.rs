//! The client against the API's document: every route, and every member of every body.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

use crate::{error, routes, types};

fn document() -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../openapi/openapi.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn every_route_of_the_document_is_known_and_no_other() {
    let document = document();
    let mut documented = BTreeSet::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            let name = operation["operationId"].as_str().unwrap().to_owned();
            documented.insert((name, method.to_uppercase(), path.clone()));
        }
    }
    let known =
        |route: &routes::Route| (route.operation.to_owned(), route.method.to_string(), route.path.to_owned());
    assert_eq!(routes::ALL.iter().map(known).collect::<BTreeSet<_>>(), documented);
}

/// A value with every member that a schema knows.
fn sample(document: &Value, schema: &Value) -> Value {
    if let Some(name) = schema["$ref"].as_str() {
        return sample(document, document.pointer(name.trim_start_matches('#')).unwrap());
    }
    if let Some(choices) = schema["oneOf"].as_array() {
        let choice = choices.iter().find(|choice| choice["type"] != "null").unwrap();
        return sample(document, choice);
    }
    if let Some(values) = schema["enum"].as_array() {
        return values[0].clone();
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds.iter().find(|kind| *kind != "null").unwrap(),
        kind => kind,
    };
    match kind.as_str().unwrap() {
        "object" => match schema["properties"].as_object() {
            Some(members) => {
                let member = |(name, schema): (&String, &Value)| (name.clone(), sample(document, schema));
                Value::Object(members.iter().map(member).collect::<Map<_, _>>())
            }
            None => json!({"a": 1}),
        },
        "array" => {
            let num_items = schema["minItems"].as_u64().unwrap_or(2) as usize;
            Value::Array(vec![sample(document, &schema["items"]); num_items])
        }
        "integer" => json!(7),
        "number" => json!(0.5),
        "boolean" => json!(true),
        _ => json!("text"),
    }
}

/// Reading and writing a body loses nothing that its schema knows.
#[track_caller]
fn assert_complete<T: Serialize + DeserializeOwned>(document: &Value, name: &str) {
    let sample = sample(document, &document["components"]["schemas"][name]);
    let read: T = serde_json::from_value(sample.clone()).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(serde_json::to_value(read).unwrap(), sample, "{name}");
}

#[test]
fn bodies_have_every_member_of_the_document() {
    let document = document();
    let mut checked = BTreeSet::new();
    macro_rules! check {
        ($($name:ident)*) => {$(
            assert_complete::<types::$name>(&document, stringify!($name));
            checked.insert(stringify!($name).to_owned());
        )*};
    }
    check! {
        Annotation Change ChangeKind ChangeVisit ChangedSite Channel ChannelMove ChannelRobot ChannelTarget Component Connection ConnectionKind CutReason DecisionKind Direction Door Event
        Evidence ExampleAnswer ExampleEvidence ExamplePlace Geometry Grid GridHeader GridInfo Hypothesis Interval IssuedKey Job JobKind
        JobState Key Keys KeyframePose Label LabelAnswer LabelPattern LabelQuery Localization LocalizationState Map
        MapChannel MapRun MapStatistics Match MatchState Missing NewAnnotation NewKey NewLocalization NewRun Observation Place PlaceLabel Point
        Pose PosePrior Receipt Region Registration RejectionReason Retention Room RoomLabel Route RouteStep RouteTurn Run
        RunChange RunPiece RunState Scan Shape Site SiteChange SiteState SiteSummary StampedPose StoredScan Trajectory Turn Word
        RobotReport RosPoint RosPose RosQuaternion RosTime Scope VdaMap WordAnswer WordId WordPattern WordQuery
    }
    assert_complete::<error::Problem>(&document, "Problem");
    // Bodies that only this crate writes, and the wrappers of lists.
    // Forms of the map are bytes to this crate.
    let inside = [
        "Batch",
        "CollectionType",
        "Decision",
        "ExampleQuery",
        "Feature",
        "FeatureCollection",
        "FeatureKind",
        "FeatureProperties",
        "FeatureType",
        "NewSite",
        "Position",
        "Problem",
        "Ranges",
    ];
    let unchecked: Vec<&String> = document["components"]["schemas"]
        .as_object()
        .unwrap()
        .keys()
        .filter(|name| {
            !checked.contains(*name) && !name.ends_with("Page") && !inside.contains(&name.as_str())
        })
        .collect();
    assert!(unchecked.is_empty(), "{unchecked:?}");
}
