//! Recordings of ROS: MCAP files, folders of them as ROS 2 records, and bags of ROS 1. No ROS is needed.

mod beams;
mod containers;
mod frames;
mod messages;
mod odometry;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use locution_engine::formats::CarmenLog;
use locution_engine::scan::Scan;
use locution_lab::recordings::{Recording, run_name};

use beams::BeamLayout;
use containers::{Channel, is_bag_file, visit_messages};
use frames::{Frames, Mounting};
use messages::{LaserMessage, Message, OdometryMessage};
use odometry::OdometryTrack;

/// Topics that are taken where a bag has several of a kind.
const USUAL_SCANS: [&str; 5] = ["scan", "base_scan", "scan_front", "front/scan", "laser/scan"];
const USUAL_ODOMETRY: [&str; 4] = ["odom", "wheel_odom", "odometry", "odom/wheel"];

/// What the reader is told about a bag; what is `None` is found.
#[derive(Clone, Debug, Default)]
pub struct BagOptions {
    /// Topic of `sensor_msgs/LaserScan`.
    pub scan_topic: Option<String>,
    /// Topic of `nav_msgs/Odometry`; where a bag has none, odometry is read from `/tf`.
    pub odometry_topic: Option<String>,
    /// Readings at or above this many metres met nothing.
    pub range_max_m: Option<f64>,
    /// Take what comes before the place where a file is cut off or damaged.
    pub skip_malformed: bool,
}

/// A recording, and what the reader chose, assumed or left out.
pub struct BagRecording {
    /// The scans.
    pub recording: Recording,
    /// For people.
    pub notes: Vec<String>,
}

/// Whether a path is a bag rather than a text log, by its content.
///
/// # Errors
/// A file that cannot be read.
pub fn is_bag(path: &Path) -> Result<bool> {
    if path.is_dir() {
        return Ok(true);
    }
    is_bag_file(path).with_context(|| path.display().to_string())
}

/// Reads a bag.
///
/// # Errors
/// A file that is cut off or damaged; no laser, no odometry, several of them of which none is the usual one; a laser that
/// is not level.
pub fn read_bag(path: &Path, options: &BagOptions) -> Result<BagRecording> {
    let in_file = || path.display().to_string();
    let mut gathered = Gathered::default();
    let mut damage = None;
    for file in files_of(path).with_context(in_file)? {
        match gathered.read(&file).with_context(|| file.display().to_string()) {
            Err(error) if options.skip_malformed => {
                damage = Some(format!("{error:#}; what follows is left out"))
            }
            Err(error) => return Err(error.context("--skip-malformed takes what comes before")),
            Ok(()) => continue,
        }
        break;
    }
    let mut read = gathered.into_recording(path, options).with_context(in_file)?;
    read.notes.extend(damage);
    Ok(read)
}

/// The files of a bag in the order in which they were recorded.
fn files_of(path: &Path) -> Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut files = Vec::new();
    let mut has_sqlite = false;
    for entry in std::fs::read_dir(path)? {
        let file = entry?.path();
        match file.extension().and_then(|ending| ending.to_str()) {
            Some("mcap") => files.push(file),
            Some("db3") => has_sqlite = true,
            _ => {}
        }
    }
    ensure!(
        !(files.is_empty() && has_sqlite),
        "bags that ROS 2 keeps in SQLite are read by the Python client (clients/python), or as MCAP after `ros2 bag convert`"
    );
    ensure!(!files.is_empty(), "the folder holds no .mcap file");
    // bag_2 comes before bag_10.
    files.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    Ok(files)
}

/// All that a bag says of lasers and motion.
#[derive(Default)]
struct Gathered {
    kinds: BTreeMap<String, String>,
    scans: BTreeMap<String, Vec<LaserMessage>>,
    odometry: BTreeMap<String, Vec<OdometryMessage>>,
    /// Odometry that is told as a transform.
    moving: Vec<OdometryMessage>,
    frames: Frames,
}

impl Gathered {
    fn read(&mut self, file: &Path) -> Result<()> {
        visit_messages(file, &mut |channel, bytes| self.take(channel, bytes))
    }

    fn take(&mut self, channel: &Channel, bytes: &[u8]) -> Result<()> {
        if !self.kinds.contains_key(&channel.topic) {
            self.kinds.insert(channel.topic.clone(), channel.kind.clone());
        }
        let message = Message::read(&channel.kind, bytes, channel.layout)
            .with_context(|| format!("a message of {} ({})", channel.topic, channel.kind))?;
        match message {
            Some(Message::Laser(scan)) => self.scans.entry(channel.topic.clone()).or_default().push(scan),
            Some(Message::Odometry(sample)) => {
                self.odometry.entry(channel.topic.clone()).or_default().push(sample);
            }
            Some(Message::Transforms(transforms)) => {
                for transform in transforms {
                    match transform.parent.rsplit('/').next() {
                        Some("odom") => self.moving.push(transform.as_odometry()),
                        Some("map") => {}
                        _ => self.frames.add(transform),
                    }
                }
            }
            None => {}
        }
        Ok(())
    }

    fn into_recording(mut self, path: &Path, options: &BagOptions) -> Result<BagRecording> {
        let scan_topic =
            choose("laser", &self.scans, options.scan_topic.as_deref(), &USUAL_SCANS, "--scan-topic")?;
        let Some(scan_topic) = scan_topic else {
            let held: Vec<String> =
                self.kinds.iter().map(|(topic, kind)| format!("{topic} ({kind})")).collect();
            bail!("no topic of sensor_msgs/LaserScan; the bag holds {}", held.join(", "));
        };
        let odometry_topic = choose(
            "odometry",
            &self.odometry,
            options.odometry_topic.as_deref(),
            &USUAL_ODOMETRY,
            "--odom-topic",
        )?;
        let scans = self.scans.remove(&scan_topic).unwrap_or_default();
        let mut notes =
            vec![format!("{scan_topic} with odometry of {}", odometry_topic.as_deref().unwrap_or("tf"))];
        let samples = match &odometry_topic {
            Some(topic) => self.odometry.remove(topic).unwrap_or_default(),
            None => std::mem::take(&mut self.moving),
        };
        ensure!(
            !samples.is_empty(),
            "neither nav_msgs/Odometry nor a frame that moves in odom on tf: without odometry a recording says nothing"
        );
        let first = scans.first().context("the laser's topic carries no scan")?;
        let mounting = self.mounting(&samples[0].robot_frame, &first.frame, &mut notes)?;
        let layout = BeamLayout::new(first, &mounting, options.range_max_m)?;
        let track = OdometryTrack::new(&samples);
        let num_scans = scans.len();
        let scans: Vec<Scan> = scans
            .iter()
            .filter_map(|scan| {
                let odom_from_robot = track.at(scan.timestamp_ns)?;
                Some(Scan {
                    timestamp_ns: scan.timestamp_ns,
                    odom_from_robot,
                    angular_velocity_rad_per_s: None,
                    ranges_m: layout.ranges_m(scan),
                })
            })
            .collect();
        ensure!(!scans.is_empty(), "no scan has odometry near its time");
        if scans.len() < num_scans {
            notes.push(format!("{} scans without odometry near them are left out", num_scans - scans.len()));
        }
        let log = CarmenLog { geometry: layout.geometry.clone(), scans, skipped: Vec::new() };
        Ok(BagRecording { recording: Recording { name: run_name(path), log }, notes })
    }

    fn mounting(&self, robot_frame: &str, laser_frame: &str, notes: &mut Vec<String>) -> Result<Mounting> {
        let Some(robot_from_laser) = self.frames.between(robot_frame, laser_frame) else {
            notes.push(format!(
                "nothing says where {laser_frame} sits on {robot_frame}; taken to be its centre"
            ));
            return Ok(Mounting::default());
        };
        let mounting = Mounting::new(&robot_from_laser)?;
        if mounting.is_upside_down {
            notes.push(format!("{laser_frame} hangs upside down"));
        }
        Ok(mounting)
    }
}

/// The topic that was said, the only one, or the usual one; `None` where there is none.
fn choose<T>(
    what: &str,
    found: &BTreeMap<String, Vec<T>>,
    said: Option<&str>,
    usual: &[&str],
    flag: &str,
) -> Result<Option<String>> {
    let names = || found.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    if let Some(said) = said {
        let has = if found.is_empty() { "none".to_owned() } else { names() };
        ensure!(found.contains_key(said), "no {what} topic {said}; the bag has {has}");
        return Ok(Some(said.to_owned()));
    }
    if found.len() <= 1 {
        return Ok(found.keys().next().cloned());
    }
    let known = usual.iter().find_map(|name| found.keys().find(|topic| topic.trim_matches('/') == *name));
    match known {
        Some(topic) => Ok(Some(topic.clone())),
        None => bail!("several {what} topics: {}; choose one with {flag}", names()),
    }
}
