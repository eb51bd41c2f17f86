//! A component of the map as an MCAP file that Foxglove shows: its grid, the way of every run, and where each run was when.

use std::collections::BTreeMap;
use std::io::Cursor;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use locution_engine::geometry::Pose2;
use locution_engine::occupancy::{CellState, GridMap};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use serde_json::{Value, json};

use crate::app::runs::StampedPose;

/// `frame_id` of everything in the file.
const FRAME: &str = "map";

/// The file. Schemas are Foxglove's, messages are JSON.
///
/// # Errors
/// Those of the writer, which writes into memory.
pub fn map_as_mcap(grid: &GridMap, runs: &[(String, Vec<StampedPose>)]) -> Result<Vec<u8>, McapError> {
    let options = WriteOptions::new().compression(None).library("locution");
    let mut file = File { writer: options.create(Cursor::new(Vec::new()))? };
    let begin_ns = runs.iter().flat_map(|(_, poses)| poses).map(|pose| pose.timestamp_ns).min().unwrap_or(0);
    let grid_channel = file.channel("foxglove.Grid", &grid_schema(), "/map")?;
    file.message(grid_channel, begin_ns, &grid_message(grid, begin_ns))?;
    for (run, poses) in runs {
        let path = file.channel("foxglove.PosesInFrame", &path_schema(), &format!("/runs/{run}/path"))?;
        let way: Vec<Value> = poses.iter().map(|pose| pose_of(&pose.frame_from_robot)).collect();
        let way = json!({"timestamp": time_of(begin_ns), "frame_id": FRAME, "poses": way});
        file.message(path, begin_ns, &way)?;
        let channel = file.channel("foxglove.PoseInFrame", &pose_schema(), &format!("/runs/{run}/pose"))?;
        for pose in poses {
            let at = time_of(pose.timestamp_ns);
            let message =
                json!({"timestamp": at, "frame_id": FRAME, "pose": pose_of(&pose.frame_from_robot)});
            file.message(channel, pose.timestamp_ns, &message)?;
        }
    }
    file.writer.finish()?;
    Ok(file.writer.into_inner().into_inner())
}

struct File {
    writer: Writer<Cursor<Vec<u8>>>,
}

impl File {
    fn channel(&mut self, name: &str, schema: &Value, topic: &str) -> Result<u16, McapError> {
        let schema = self.writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
        self.writer.add_channel(schema, topic, "json", &BTreeMap::new())
    }

    fn message(&mut self, channel_id: u16, at_ns: i64, message: &Value) -> Result<(), McapError> {
        // MCAP counts from 1970; clocks that stood before it are shown there.
        let at_ns = u64::try_from(at_ns).unwrap_or(0);
        let header = MessageHeader { channel_id, sequence: 0, log_time: at_ns, publish_time: at_ns };
        self.writer.write_to_known_channel(&header, message.to_string().as_bytes())
    }
}

fn time_of(at_ns: i64) -> Value {
    let at_ns = at_ns.max(0);
    json!({"sec": at_ns / 1_000_000_000, "nsec": at_ns % 1_000_000_000})
}

fn pose_of(pose: &Pose2) -> Value {
    let (z, w) = (0.5 * pose.theta).sin_cos();
    json!({
        "position": {"x": pose.x, "y": pose.y, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": z, "w": w},
    })
}

fn grid_message(grid: &GridMap, at_ns: i64) -> Value {
    let byte = |cell: &CellState| match cell {
        CellState::Free => 0,
        CellState::Unknown => 127,
        CellState::Occupied => 255,
    };
    let cells: Vec<u8> = grid.cells().iter().map(byte).collect();
    let origin = grid.origin();
    json!({
        "timestamp": time_of(at_ns),
        "frame_id": FRAME,
        "pose": pose_of(&Pose2::new(origin.x, origin.y, 0.0)),
        "column_count": grid.width(),
        "cell_size": {"x": grid.resolution_m(), "y": grid.resolution_m()},
        "row_stride": grid.width(),
        "cell_stride": 1,
        // Foxglove's number for an unsigned byte.
        "fields": [{"name": "occupancy", "offset": 0, "type": 1}],
        "data": STANDARD.encode(cells),
    })
}

fn object(members: Value) -> Value {
    json!({"type": "object", "properties": members})
}

fn numbers(names: &[&str]) -> Value {
    object(names.iter().map(|name| ((*name).to_owned(), json!({"type": "number"}))).collect())
}

fn time_schema() -> Value {
    json!({
        "type": "object",
        "title": "time",
        "properties": {"sec": {"type": "integer", "minimum": 0}, "nsec": {"type": "integer", "minimum": 0}},
    })
}

fn posed_schema() -> Value {
    object(json!({"position": numbers(&["x", "y", "z"]), "orientation": numbers(&["x", "y", "z", "w"])}))
}

fn schema(title: &str, more: Value) -> Value {
    let mut members = json!({"timestamp": time_schema(), "frame_id": {"type": "string"}});
    if let (Some(members), Value::Object(more)) = (members.as_object_mut(), more) {
        members.extend(more);
    }
    json!({"title": title, "type": "object", "properties": members})
}

fn pose_schema() -> Value {
    schema("foxglove.PoseInFrame", json!({"pose": posed_schema()}))
}

fn path_schema() -> Value {
    schema("foxglove.PosesInFrame", json!({"poses": {"type": "array", "items": posed_schema()}}))
}

fn grid_schema() -> Value {
    let whole = json!({"type": "integer", "minimum": 0});
    let field = object(json!({"name": {"type": "string"}, "offset": whole, "type": whole}));
    schema(
        "foxglove.Grid",
        json!({
            "pose": posed_schema(),
            "column_count": whole,
            "cell_size": numbers(&["x", "y"]),
            "row_stride": whole,
            "cell_stride": whole,
            "fields": {"type": "array", "items": field},
            "data": {"type": "string", "contentEncoding": "base64"},
        }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_of_others_finds_grid_way_and_poses() {
        let grid = GridMap::drawn(&["#.", "? "], 0.5);
        let pose = |at_s: i64, x: f64| StampedPose {
            scan_seq: 0,
            timestamp_ns: at_s * 1_000_000_000 + 5,
            frame_from_robot: Pose2::new(x, 0.0, 0.0),
        };
        let bytes = map_as_mcap(&grid, &[("r".into(), vec![pose(7, 1.0), pose(8, 2.0)])]).unwrap();
        let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().collect::<Result<_, _>>().unwrap();
        let told: Vec<_> = messages
            .iter()
            .map(|message| {
                let schema = message.channel.schema.as_ref().unwrap().name.clone();
                (message.channel.topic.clone(), schema, message.log_time)
            })
            .collect();
        let row = |topic: &str, schema: &str, at: u64| (topic.to_owned(), schema.to_owned(), at);
        assert_eq!(
            told,
            [
                row("/map", "foxglove.Grid", 7_000_000_005),
                row("/runs/r/path", "foxglove.PosesInFrame", 7_000_000_005),
                row("/runs/r/pose", "foxglove.PoseInFrame", 7_000_000_005),
                row("/runs/r/pose", "foxglove.PoseInFrame", 8_000_000_005),
            ]
        );
        let shown: Value = serde_json::from_slice(&messages[0].data).unwrap();
        assert_eq!(STANDARD.decode(shown["data"].as_str().unwrap()).unwrap(), [127, 127, 255, 0]);
        let way: Value = serde_json::from_slice(&messages[1].data).unwrap();
        assert_eq!(way["poses"][1]["position"]["x"], 2.0);
    }
}
