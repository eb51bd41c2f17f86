//! Bags made here, byte by byte, and what is read of them.

use std::path::Path;

use locution_engine::geometry::Pose2;

use super::frames::{Frames, Mounting, Rotation, StampedTransform};
use super::messages::{Layout, Message};
use super::*;

const SECOND_NS: i64 = 1_000_000_000;

/// Writes messages as either ROS does.
struct Writer {
    bytes: Vec<u8>,
    layout: Layout,
}

impl Writer {
    fn new(layout: Layout) -> Self {
        Self { bytes: Vec::new(), layout }
    }

    fn number<const N: usize>(&mut self, number: [u8; N]) -> &mut Self {
        if self.layout == Layout::Cdr {
            self.bytes.resize(self.bytes.len().next_multiple_of(N), 0);
        }
        self.bytes.extend(number);
        self
    }

    fn u32(&mut self, number: u32) -> &mut Self {
        self.number(number.to_le_bytes())
    }

    fn f32s(&mut self, numbers: &[f32]) -> &mut Self {
        numbers.iter().for_each(|number| {
            self.number(number.to_le_bytes());
        });
        self
    }

    fn f64s(&mut self, numbers: &[f64]) -> &mut Self {
        numbers.iter().for_each(|number| {
            self.number(number.to_le_bytes());
        });
        self
    }

    fn string(&mut self, text: &str) -> &mut Self {
        let end: &[u8] = if self.layout == Layout::Cdr { &[0] } else { &[] };
        self.u32((text.len() + end.len()) as u32);
        self.bytes.extend(text.bytes().chain(end.iter().copied()));
        self
    }

    fn header(&mut self, timestamp_ns: i64, frame: &str) -> &mut Self {
        if self.layout == Layout::Ros1 {
            self.u32(77);
        }
        self.u32((timestamp_ns / SECOND_NS) as u32).u32((timestamp_ns % SECOND_NS) as u32).string(frame)
    }

    fn finish(&mut self) -> Vec<u8> {
        let head: &[u8] = if self.layout == Layout::Cdr { &[0, 1, 0, 0] } else { &[] };
        [head, self.bytes.as_slice()].concat()
    }
}

fn laser(layout: Layout, timestamp_ns: i64, angles: (f32, f32), ranges: &[f32]) -> Vec<u8> {
    let mut writer = Writer::new(layout);
    writer.header(timestamp_ns, "laser").f32s(&[angles.0, 9.0, angles.1, 0.0, 0.1, 0.1, 10.0]);
    writer.u32(ranges.len() as u32).f32s(ranges).u32(0).finish()
}

fn odometry(layout: Layout, timestamp_ns: i64, x: f64) -> Vec<u8> {
    let mut writer = Writer::new(layout);
    writer.header(timestamp_ns, "odom").string("base_link").f64s(&[x, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    writer.f64s(&[0.0; 36 + 6 + 36]).finish()
}

fn transform(layout: Layout, (parent, child): (&str, &str), quaternion: [f64; 4]) -> Vec<u8> {
    let mut writer = Writer::new(layout);
    writer.u32(1).header(0, parent).string(child).f64s(&[0.3, 0.1, 0.2]).f64s(&quaternion).finish()
}

/// Topics with their type and messages.
type Topics<'a> = [(&'a str, &'a str, Vec<Vec<u8>>)];

/// Length and bytes of a text.
fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

fn record(opcode: u8, content: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(content.len() as u64).to_le_bytes()[..], content].concat()
}

/// The records of an MCAP file: schemas, channels and messages.
fn mcap_records(topics: &Topics<'_>) -> Vec<u8> {
    let mut records = Vec::new();
    for (id, (topic, kind, messages)) in (1u16..).zip(topics) {
        let id = id.to_le_bytes();
        records.extend(record(3, &[&id[..], &text(kind), &text("ros2msg"), &text("")].concat()));
        records.extend(record(4, &[&id[..], &id, &text(topic), &text("cdr"), &[0; 4]].concat()));
        for message in messages {
            records.extend(record(5, &[&id[..], &[0; 20], message].concat()));
        }
    }
    records
}

fn mcap_chunk(topics: &Topics<'_>, compression: &str) -> Vec<u8> {
    let records = mcap_records(topics);
    let packed = match compression {
        "zstd" => zstd::encode_all(records.as_slice(), 1).unwrap(),
        "lz4" => lz4_packed(&records),
        _ => records.clone(),
    };
    let head =
        [&[0; 16][..], &(records.len() as u64).to_le_bytes(), &crc32fast::hash(&records).to_le_bytes()];
    record(
        6,
        &[&head.concat(), &text(compression), &(packed.len() as u64).to_le_bytes()[..], &packed].concat(),
    )
}

fn lz4_packed(plain: &[u8]) -> Vec<u8> {
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    std::io::Write::write_all(&mut encoder, plain).unwrap();
    encoder.finish().unwrap()
}

fn mcap_file(content: &[u8]) -> Vec<u8> {
    let magic = b"\x89MCAP0\r\n";
    [&magic[..], &record(1, &[text("ros2"), text("")].concat()), content, &record(15, &[0; 4]), magic]
        .concat()
}

fn write_mcap(path: &Path, topics: &Topics<'_>) {
    std::fs::write(path, mcap_file(&mcap_records(topics))).unwrap();
}

/// A record of a ROS 1 bag.
fn bag_record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let header: Vec<u8> = fields.iter().flat_map(|(name, value)| bag_field(name, value)).collect();
    let lengths = [header.len(), data.len()].map(|length| (length as u32).to_le_bytes());
    [&lengths[0][..], &header, &lengths[1], data].concat()
}

fn bag_field(name: &str, value: &[u8]) -> Vec<u8> {
    [&((name.len() + 1 + value.len()) as u32).to_le_bytes()[..], name.as_bytes(), b"=", value].concat()
}

fn drive(upside_down: bool) -> Vec<(&'static str, &'static str, Vec<Vec<u8>>)> {
    let cdr = Layout::Cdr;
    let quaternion = if upside_down { [1.0, 0.0, 0.0, 0.0] } else { [0.0, 0.0, 0.0, 1.0] };
    let scans =
        [1, 2, 3].map(|half| laser(cdr, half * SECOND_NS / 2, (-0.5, 0.5), &[1.0, f32::INFINITY, 3.0]));
    let poses = [0, 1, 2].map(|second| odometry(cdr, second * SECOND_NS, second as f64));
    vec![
        ("/scan", "sensor_msgs/msg/LaserScan", scans.to_vec()),
        ("/odom", "nav_msgs/msg/Odometry", poses.to_vec()),
        ("/tf_static", "tf2_msgs/msg/TFMessage", vec![transform(cdr, ("base_link", "laser"), quaternion)]),
    ]
}

fn read(topics: &Topics<'_>, options: &BagOptions) -> anyhow::Result<BagRecording> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("monday.mcap");
    write_mcap(&path, topics);
    assert!(is_bag(&path).unwrap());
    read_bag(&path, options)
}

#[test]
fn an_mcap_file_becomes_scans_with_odometry_between_its_messages() {
    let read = read(&drive(false), &BagOptions::default()).unwrap();
    let log = &read.recording.log;
    assert_eq!(read.recording.name, "monday");
    assert_eq!(read.notes, ["/scan with odometry of /odom"]);
    assert_eq!(log.geometry.robot_from_laser, Pose2::new(0.3, 0.1, 0.0));
    assert_eq!((log.geometry.num_ranges, log.geometry.range_max_m), (3, 10.0));
    assert_eq!(log.scans.iter().map(|scan| scan.odom_from_robot.x).collect::<Vec<_>>(), [0.5, 1.0, 1.5]);
    assert_eq!(log.scans[0].ranges_m, [1.0, f32::INFINITY, 3.0]);
}

#[test]
fn a_laser_that_hangs_upside_down_is_turned_over() {
    let read = read(&drive(true), &BagOptions::default()).unwrap();
    let log = &read.recording.log;
    assert_eq!(log.scans[0].ranges_m, [3.0, f32::INFINITY, 1.0]);
    assert!((log.geometry.angle_min_rad + 0.5).abs() < 1e-6 && log.geometry.angle_increment_rad > 0.0);
    assert!(read.notes.contains(&"laser hangs upside down".to_owned()), "{:?}", read.notes);
}

#[test]
fn both_layouts_say_the_same_and_no_prefix_of_either_is_taken_for_the_whole() {
    let of = |layout| {
        [
            ("sensor_msgs/LaserScan", laser(layout, 3_500_000_007, (-0.25, 0.5), &[1.5, 2.5])),
            ("nav_msgs/Odometry", odometry(layout, 7, 4.0)),
            ("tf2_msgs/TFMessage", transform(layout, ("/base", "/laser"), [0.0, 0.0, 1.0, 0.0])),
        ]
    };
    for ((kind, ros1), (_, cdr)) in of(Layout::Ros1).iter().zip(&of(Layout::Cdr)) {
        let message = Message::read(kind, ros1, Layout::Ros1).unwrap().unwrap();
        assert_eq!(Message::read(kind, cdr, Layout::Cdr).unwrap().unwrap(), message);
        for length in 0..cdr.len().min(60) {
            assert!(Message::read(kind, &cdr[..length], Layout::Cdr).is_err(), "{kind} of {length} bytes");
        }
    }
    assert_eq!(Message::read("std_msgs/String", &[], Layout::Cdr).unwrap(), None);
}

#[test]
fn a_claim_of_very_many_readings_reserves_nothing() {
    let mut bytes = laser(Layout::Ros1, 0, (0.0, 0.1), &[1.0, 2.0]);
    let count_at = bytes.len() - 4 - 2 * 4 - 4;
    bytes[count_at..count_at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(Message::read("sensor_msgs/LaserScan", &bytes, Layout::Ros1).is_err());
}

#[test]
fn topics_are_chosen_or_asked_for() {
    let mut topics = drive(false);
    topics.push(("/rear", topics[0].1, topics[0].2.clone()));
    assert!(read(&topics, &BagOptions::default()).unwrap().notes[0].starts_with("/scan "));
    topics[0].0 = "/front";
    let error = |options: &BagOptions| format!("{:#}", read(&topics, options).err().unwrap());
    assert!(error(&BagOptions::default()).contains("/front, /rear; choose one with --scan-topic"));
    let nose = BagOptions { scan_topic: Some("/nose".into()), ..BagOptions::default() };
    assert!(error(&nose).contains("no laser topic /nose; the bag has /front, /rear"));
    let rear = BagOptions { scan_topic: Some("/rear".into()), ..BagOptions::default() };
    assert_eq!(read(&topics, &rear).unwrap().recording.log.scans.len(), 3);
    let message = format!("{:#}", read(&topics[1..3], &BagOptions::default()).err().unwrap());
    assert!(
        message.contains("no topic of sensor_msgs/LaserScan; the bag holds /odom (nav_msgs/Odometry)"),
        "{message}"
    );
}

#[test]
fn odometry_may_be_told_as_a_transform() {
    let cdr = Layout::Cdr;
    let mut topics = drive(false);
    topics[1] =
        ("/tf", "tf2_msgs/msg/TFMessage", vec![transform(cdr, ("odom", "base_link"), [0.0, 0.0, 0.0, 1.0])]);
    let read = read(&topics, &BagOptions::default()).unwrap();
    assert_eq!(read.notes, ["/scan with odometry of tf", "1 scans without odometry near them are left out"]);
    assert_eq!(read.recording.log.scans[0].odom_from_robot, Pose2::new(0.3, 0.1, 0.0));
}

/// Reads a file of these bytes.
fn read_file(name: &str, bytes: &[u8], options: &BagOptions) -> anyhow::Result<BagRecording> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read_bag(&path, options)
}

#[test]
fn a_file_that_is_cut_off_is_read_as_far_as_it_goes_if_that_is_asked_for() {
    let mut topics = drive(false);
    // The scans come last.
    topics.rotate_left(1);
    let whole = mcap_file(&mcap_records(&topics));
    let cut = &whole[..whole.len() - 100];
    let error = format!("{:#}", read_file("cut.mcap", cut, &BagOptions::default()).err().unwrap());
    assert!(
        error.contains("cut.mcap") && error.contains("cut off") && error.contains("--skip-malformed"),
        "{error}"
    );
    let read =
        read_file("cut.mcap", cut, &BagOptions { skip_malformed: true, ..BagOptions::default() }).unwrap();
    assert_eq!(read.recording.log.scans.len(), 2);
    assert!(read.notes.last().unwrap().contains("cut off"), "{:?}", read.notes);
}

#[test]
fn packed_chunks_are_unpacked_and_their_checksums_compared() {
    let plain = read(&drive(false), &BagOptions::default()).unwrap().recording.log;
    for compression in ["", "lz4", "zstd"] {
        let mut file = mcap_file(&mcap_chunk(&drive(false), compression));
        let read = read_file("monday.mcap", &file, &BagOptions::default()).unwrap();
        assert_eq!(read.recording.log, plain, "{compression}");
        let middle = file.len() / 2;
        file[middle] ^= 1;
        assert!(read_file("monday.mcap", &file, &BagOptions::default()).is_err(), "{compression}");
    }
    let unknown = mcap_file(&mcap_chunk(&drive(false), "brotli"));
    let error = format!("{:#}", read_file("monday.mcap", &unknown, &BagOptions::default()).err().unwrap());
    assert!(error.contains("packed with 'brotli'"), "{error}");
}

#[test]
fn a_bag_of_ros_1_is_read_whether_its_chunks_are_packed_or_not() {
    let ros1 = Layout::Ros1;
    let topics = [
        ("/odom", "nav_msgs/Odometry", vec![odometry(ros1, 0, 0.0), odometry(ros1, SECOND_NS, 1.0)]),
        ("/scan", "sensor_msgs/LaserScan", vec![laser(ros1, SECOND_NS / 4, (-0.5, 0.5), &[1.0, 2.0])]),
    ];
    let mut records = Vec::new();
    for (id, (topic, kind, messages)) in (0u32..).zip(&topics) {
        let id = id.to_le_bytes();
        let about = bag_field("type", kind.as_bytes());
        records.extend(bag_record(&[("op", &[7]), ("conn", &id), ("topic", topic.as_bytes())], &about));
        for message in messages {
            records.extend(bag_record(&[("op", &[2]), ("conn", &id), ("time", &[0; 8])], message));
        }
    }
    let size = (records.len() as u32).to_le_bytes();
    for compression in ["none", "lz4", "bz2"] {
        let packed = if compression == "lz4" { lz4_packed(&records) } else { records.clone() };
        let chunk =
            bag_record(&[("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)], &packed);
        let file = [&b"#ROSBAG V2.0\n"[..], &bag_record(&[("op", &[3])], &[b' '; 50]), &chunk].concat();
        let read = read_file("monday.bag", &file, &BagOptions::default());
        if compression == "bz2" {
            assert!(format!("{:#}", read.err().unwrap()).contains("rosbag decompress"));
        } else {
            let log = read.unwrap().recording.log;
            assert_eq!((log.scans.len(), log.scans[0].odom_from_robot.x), (1, 0.25));
            let cut = read_file("monday.bag", &file[..file.len() - 9], &BagOptions::default());
            assert!(format!("{:#}", cut.err().unwrap()).contains("cut off"));
        }
    }
}

#[test]
fn a_folder_is_read_in_the_order_of_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let [mut early, mut late] = [drive(false), drive(false)];
    early[0].2.truncate(1);
    late[0].2.drain(..1);
    // Odometry and mounting stand in the first file only.
    late.truncate(1);
    write_mcap(&folder.path().join("bag_2.mcap"), &early);
    write_mcap(&folder.path().join("bag_10.mcap"), &late);
    let read = read_bag(folder.path(), &BagOptions::default()).unwrap();
    let times: Vec<i64> = read.recording.log.scans.iter().map(|scan| scan.timestamp_ns).collect();
    assert_eq!(times, [SECOND_NS / 2, SECOND_NS, 3 * SECOND_NS / 2]);
    let other = tempfile::tempdir().unwrap();
    std::fs::write(other.path().join("bag_0.db3"), b"").unwrap();
    let error = format!("{:#}", read_bag(other.path(), &BagOptions::default()).err().unwrap());
    assert!(error.contains("ros2 bag convert"), "{error}");
}

#[test]
fn a_scan_with_a_reading_more_is_read_at_the_beams_of_the_first() {
    let mut topics = drive(false);
    topics[0].2 = vec![
        laser(Layout::Cdr, 0, (0.0, 0.1), &[1.0, 2.0, 3.0]),
        laser(Layout::Cdr, 1, (-0.09, 0.1), &[9.0, 1.1, 2.1, 3.1]),
        laser(Layout::Cdr, 2, (0.01, 0.1), &[1.2, f32::NAN]),
        laser(Layout::Cdr, 3, (0.2, -0.1), &[3.3, 2.3, 1.3]),
    ];
    let log = read(&topics, &BagOptions::default()).unwrap().recording.log;
    let read: Vec<&[f32]> = log.scans.iter().map(|scan| scan.ranges_m.as_slice()).collect();
    assert_eq!(read, [&[1.0, 2.0, 3.0], &[1.1, 2.1, 3.1], &[1.2, 0.0, 0.0], &[1.3, 2.3, 3.3]]);
}

fn said(parent: &str, child: &str, translation_m: [f64; 3], quaternion: [f64; 4]) -> StampedTransform {
    let rotation = Rotation::of_quaternion(quaternion).unwrap();
    StampedTransform { timestamp_ns: 0, parent: parent.into(), child: child.into(), translation_m, rotation }
}

#[test]
fn frames_meet_at_their_common_ancestor_and_tilted_lasers_are_refused() {
    let mut frames = Frames::default();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    frames.add(said("footprint", "base", [0.0, 0.1, 0.0], [0.0, 0.0, 0.0, 1.0]));
    frames.add(said("footprint", "mast", [1.0, 0.0, 0.5], [0.0, 0.0, half, half]));
    frames.add(said("mast", "laser", [0.5, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]));
    let mounting = Mounting::new(&frames.between("base", "laser").unwrap()).unwrap();
    let expected = Pose2::new(1.0, 0.4, std::f64::consts::FRAC_PI_2);
    assert!(mounting.robot_from_laser.distance(&expected) < 1e-12 && !mounting.is_upside_down);
    assert!((mounting.robot_from_laser.theta - expected.theta).abs() < 1e-12);
    assert_eq!(frames.between("base", "camera"), None);
    frames.add(said("base", "tilted", [0.0; 3], [0.3, 0.0, 0.0, 0.954]));
    let error = Mounting::new(&frames.between("base", "tilted").unwrap()).unwrap_err();
    assert!(error.to_string().contains("tilted by 35 degrees"), "{error}");
}
