//! Golden scripts: `tests/scripts/*.txt` say what is sent and asked, and behind `> ` what is answered.
//!
//! Each script begins with one sentence that says what it proves, and a drawing of the building. It runs over both
//! storages, through the use cases. With `LOCUTION_REWRITE_SCRIPTS` set the answers are written anew, to be read before
//! they are believed. The commands are those of [`Stage::obey`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use locution_engine::config::EngineConfig;
use locution_engine::geometry::Pose2;
use locution_engine::index::WordPattern;
use locution_engine::mapping::Direction;
use locution_engine::scan::{Scan, ScanGeometry};
use locution_engine::semantics::{LabelPattern, PlaceLabel};

use super::ask::find_words;
use super::maps::{MatchFilter, MatchOrder, decide, find_labels, matches, undecide};
use super::runs::{Frame, NewBatch, NewRun, RunPiece, pieces, trajectory};
use super::site::Site;
use super::{App, AppError, Name};
use crate::config::ServerConfig;
use crate::records::{JobKind, ReadingRules, Run};
use crate::storage::{MemoryStorage, SledConfig, SledStorage, Storage};

/// A drawn building: `#` is a square metre of wall, the last line lies at y = 0.
#[derive(Default)]
struct Building {
    rows: Vec<Vec<u8>>,
}

impl Building {
    fn is_wall(&self, x: f64, y: f64) -> bool {
        let row = self.rows.len() as i64 - 1 - y.floor() as i64;
        let cell = usize::try_from(row).ok().and_then(|row| self.rows.get(row));
        let cell = cell.and_then(|cells| cells.get(usize::try_from(x.floor() as i64).ok()?));
        cell.is_none_or(|cell| *cell == b'#')
    }

    /// Metres to the first wall, in steps of a centimetre as lasers report them; NaN beyond their reach.
    fn range_m(&self, from: &Pose2, angle_rad: f64, range_max_m: f64) -> f32 {
        let (sin, cos) = (from.theta + angle_rad).sin_cos();
        let reached = (1..(range_max_m * 100.0) as u32).map(|step| f64::from(step) / 100.0);
        let mut reached =
            reached.filter(|range_m| self.is_wall(from.x + range_m * cos, from.y + range_m * sin));
        reached.next().map_or(f32::NAN, |range_m| range_m as f32)
    }
}

fn geometry() -> ScanGeometry {
    ScanGeometry {
        num_ranges: 91,
        angle_min_rad: (-90f64).to_radians(),
        angle_increment_rad: 2f64.to_radians(),
        range_max_m: 10.0,
        robot_from_laser: Pose2::identity(),
    }
}

/// Where scripts keep what they store.
enum Disk {
    Memory(Arc<MemoryStorage>),
    Sled(tempfile::TempDir),
}

impl Disk {
    fn storage(&self) -> Arc<dyn Storage> {
        match self {
            Disk::Memory(storage) => Arc::clone(storage) as Arc<dyn Storage>,
            Disk::Sled(directory) => {
                let directory = directory.path().to_owned();
                Arc::new(SledStorage::new(SledConfig { directory, cache_bytes_per_site: 1 << 20 }).unwrap())
            }
        }
    }
}

/// What a script plays on.
struct Stage {
    disk: Disk,
    app: Arc<App>,
    building: Building,
    drives: BTreeMap<String, Vec<Scan>>,
}

fn open_app(disk: &Disk) -> Arc<App> {
    let mut config = ServerConfig::default();
    config.builds.is_automatic = false;
    config.storage.num_scans_per_checkpoint = 50;
    Arc::new(App::new(config, disk.storage()))
}

impl Stage {
    fn new(disk: Disk) -> Self {
        let app = open_app(&disk);
        Self { disk, app, building: Building::default(), drives: BTreeMap::new() }
    }

    /// Carries out one line and says what came of it; a refusal is an answer.
    async fn obey(&mut self, line: &str) -> String {
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match words.as_slice() {
            ["drive", name, waypoints @ ..] => Ok(self.drive(name, waypoints)),
            ["reopen"] => self.reopen().await,
            ["site", config @ ..] => self.make_site(&config.join(" ")).await,
            ["run", name] => self.make_run(name).await,
            ["send", run, drive, range] => self.send(run, drive, range).await,
            ["finish", run] => self.finish(run).await,
            ["words", run, level] => self.words(run, level.parse().unwrap()).await,
            ["pieces", run] => self.pieces(run).await,
            ["poses", run, frame, seqs @ ..] => self.poses(run, frame, seqs).await,
            ["ask", "words", patterns @ ..] => self.ask_words(patterns).await,
            ["ask", "labels", patterns @ ..] => self.ask_labels(patterns).await,
            ["build"] => self.build().await,
            ["matches"] => self.matches().await,
            ["decide", id, word] => self.decide(id.parse().unwrap(), word).await,
            _ => panic!("no such command: {line}"),
        };
        answer.unwrap_or_else(|error| format!("refused: {error}\n"))
    }

    /// Records a drive along waypoints `x,y`, a scan every 0.1 m and every 10 degrees of a turn on the spot.
    fn drive(&mut self, name: &str, waypoints: &[&str]) -> String {
        let waypoints: Vec<(f64, f64)> = waypoints
            .iter()
            .map(|point| {
                point.split_once(',').map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).unwrap()
            })
            .collect();
        let mut poses: Vec<Pose2> = Vec::new();
        for leg in waypoints.windows(2) {
            let ((x, y), (to_x, to_y)) = (leg[0], leg[1]);
            let (length_m, theta) = ((to_x - x).hypot(to_y - y), (to_y - y).atan2(to_x - x));
            if let Some(last) = poses.last().copied() {
                let turn_rad = locution_engine::geometry::wrap_angle(theta - last.theta);
                let num_steps = (turn_rad.abs() / 10f64.to_radians()).round() as usize;
                let at = |step: usize| last.theta + turn_rad * step as f64 / num_steps as f64;
                poses.extend((1..num_steps).map(|step| Pose2::new(x, y, at(step))));
            }
            let num_steps = (length_m / 0.1).round() as usize;
            let share = |step: usize| step as f64 / num_steps as f64;
            let at = |step| Pose2::new(x + share(step) * (to_x - x), y + share(step) * (to_y - y), theta);
            poses.extend((usize::from(!poses.is_empty())..=num_steps).map(at));
        }
        let geometry = geometry();
        let scan = |(idx, pose): (usize, &Pose2)| Scan {
            timestamp_ns: idx as i64 * 100_000_000,
            odom_from_robot: poses[0].between(pose),
            angular_velocity_rad_per_s: None,
            ranges_m: (0..geometry.num_ranges)
                .map(|beam| self.building.range_m(pose, geometry.beam_angle_rad(beam), geometry.range_max_m))
                .collect(),
        };
        let scans: Vec<Scan> = poses.iter().enumerate().map(scan).collect();
        let answer = format!("{} scans\n", scans.len());
        self.drives.insert(name.to_owned(), scans);
        answer
    }

    /// The server stops and starts again over what it stored.
    async fn reopen(&mut self) -> Result<String, AppError> {
        if let Disk::Sled(_) = self.disk {
            self.app.close().await?;
        }
        self.app = open_app(&self.disk);
        self.app.resume().await?;
        Ok(String::new())
    }

    async fn make_site(&self, config: &str) -> Result<String, AppError> {
        let config: Option<EngineConfig> =
            (!config.is_empty()).then(|| serde_json::from_str(config).expect("a configuration in JSON"));
        let (_, is_new) = self.app.make_site(&name("site"), config).await?;
        Ok(if is_new { "made\n" } else { "was there\n" }.to_owned())
    }

    async fn site(&self) -> Result<Arc<Site>, AppError> {
        self.app.site(&name("site")).await
    }

    async fn make_run(&self, run: &str) -> Result<String, AppError> {
        let geometry = geometry();
        let new = NewRun { robot: None, readings: ReadingRules::of(&geometry), geometry, area: None };
        let (run, is_new) = self.app.make_run(&*self.site().await?, &name(run), new).await?;
        Ok(format!("{}, run {}\n", if is_new { "made" } else { "was there" }, run.idx))
    }

    /// `from..to` of a drive; `from..to@first` claims another sequence number for the first.
    async fn send(&self, run: &str, drive: &str, range: &str) -> Result<String, AppError> {
        let (range, claimed) =
            range.split_once('@').map_or((range, None), |(range, first)| (range, Some(first)));
        let (from, to) = range.split_once("..").expect("a range from..to");
        let (from, to): (usize, usize) = (from.parse().unwrap(), to.parse().unwrap());
        let first_sequence = claimed.map_or(from as u64, |first| first.parse().unwrap());
        let batch =
            NewBatch { first_sequence, scans: self.drives[drive][from..to].to_vec(), has_odometry: true };
        let receipt = self.app.append_batch(self.site().await?, &name(run), batch).await?;
        Ok(format!(
            "next {}, {} observations, {} words\n",
            receipt.next_sequence, receipt.num_observations, receipt.num_words
        ))
    }

    async fn finish(&self, run: &str) -> Result<String, AppError> {
        let run = self.app.finish_run(self.site().await?, &name(run)).await?;
        Ok(told(&run))
    }

    /// Words of one level, a line each: class, size, turn in degrees, observations.
    async fn words(&self, run: &str, level: u8) -> Result<String, AppError> {
        let words = self.site().await?.run(&name(run)).await?.words(level, 0, usize::MAX).await?;
        let line = |word: &locution_engine::text::Word| {
            let turn_deg = whole(f64::from(word.turn_rad).to_degrees());
            let (first, last) = word.observations;
            format!("{} {} {turn_deg}°  {first}–{last}\n", word.class, word.size)
        };
        Ok(words.iter().map(line).collect())
    }

    /// Scans of each piece of a run, why it is one, and its component.
    async fn pieces(&self, run: &str) -> Result<String, AppError> {
        let site = self.site().await?;
        let found = pieces(&site, &site.run(&name(run)).await?, None).await?;
        let line = |piece: &RunPiece| {
            let reason = piece.reason.map_or(String::new(), |reason| format!(", {reason:?}"));
            let place = piece.in_map.map_or(String::new(), |(component, length_m)| {
                format!(", {length_m:.0} m in component {component}")
            });
            format!("scans {} to {}{reason}{place}\n", piece.from_scan, piece.to_scan)
        };
        Ok(found.iter().map(line).collect())
    }

    async fn poses(&self, run: &str, frame: &str, seqs: &[&str]) -> Result<String, AppError> {
        let frame = match frame {
            "map" => Frame::Map,
            "run" => Frame::Run,
            _ => Frame::Odom,
        };
        let site = self.site().await?;
        let found = trajectory(&site, &site.run(&name(run)).await?, frame, None, None).await?;
        let line = |seq: &&str| {
            let pose = found.poses[seq.parse::<usize>().unwrap()].frame_from_robot;
            let decimeters = |meters: f64| f64::from(whole(meters * 10.0)) / 10.0;
            let heading_deg = whole(pose.theta.to_degrees());
            format!("{:.1} {:.1} {heading_deg}°\n", decimeters(pose.x), decimeters(pose.y))
        };
        Ok(seqs.iter().map(line).collect())
    }

    /// Words `class/size/turn in degrees`; `*` may be anything.
    async fn ask_words(&self, patterns: &[&str]) -> Result<String, AppError> {
        let pattern = |text: &&str| {
            let parts: Vec<Option<f64>> = text.split('/').map(|part| part.parse().ok()).collect();
            WordPattern {
                class: parts[0].map(|class| class as u8),
                size: parts[1].map(|size| size as u32),
                size_tolerance: 0.25,
                turn_rad: parts[2].map(f64::to_radians),
                turn_tolerance_rad: 30f64.to_radians(),
            }
        };
        let patterns: Vec<WordPattern> = patterns.iter().map(pattern).collect();
        let answers = find_words(&*self.site().await?, &patterns, 5).await?;
        let lines = answers.iter().map(|answer| {
            let way = if answer.direction == Direction::Same { "forwards" } else { "backwards" };
            let ((first, last), fit) = (answer.words, answer.fit);
            let place = answer.in_map.map_or(String::new(), |(component, pose)| {
                format!(" at {},{} of component {component}", whole(pose.x), whole(pose.y))
            });
            format!("{} words {first}–{last} {way}, fit {fit:.2}{place}\n", answer.run)
        });
        Ok(some_or_nothing(lines))
    }

    /// Labels, with `>metres` for the least length and `:left` or `:right`.
    async fn ask_labels(&self, patterns: &[&str]) -> Result<String, AppError> {
        let pattern = |text: &&str| {
            let (text, side) =
                text.split_once(':').map_or((*text, None), |(text, side)| (text, Some(side == "left")));
            let (label, length_min_m) = text.split_once('>').unwrap_or((text, "0"));
            LabelPattern {
                label: PlaceLabel::from_name(label).expect("a label"),
                length_min_m: length_min_m.parse().unwrap(),
                length_max_m: f64::INFINITY,
                is_left: side,
            }
        };
        let patterns: Vec<LabelPattern> = patterns.iter().map(pattern).collect();
        let map = self.site().await?.map(None).await?;
        let answers = find_labels(&map, &patterns, 5).await?;
        let lines = answers.iter().map(|answer| {
            let way = if answer.is_reversed { "backwards" } else { "forwards" };
            let lengths: Vec<String> =
                answer.stretches.iter().map(|there| format!("{:.0} m", there.stretch.length_m)).collect();
            format!("{} {way}: {}\n", answer.stretches[0].run, lengths.join(", "))
        });
        Ok(some_or_nothing(lines))
    }

    /// Builds the map and tells what it holds.
    async fn build(&self) -> Result<String, AppError> {
        let site = self.site().await?;
        let job = self.app.queue_job(&site, JobKind::Build).await?;
        let job = site.jobs().ended(job.record.id).await?;
        if let Some(error) = job.record.error {
            return Ok(format!("failed: {error}\n"));
        }
        let map = site.map(None).await?.record;
        let generation = site.generation();
        let mut told =
            format!("version {}, generation {generation}, {} components\n", map.version, map.num_components);
        for run in &map.runs {
            told += &format!("{} in {}: {:.0} m\n", run.name, run.component, run.length_m);
        }
        Ok(told)
    }

    /// Verified matches, and those that a person spoke of.
    async fn matches(&self) -> Result<String, AppError> {
        let map = self.site().await?.map(None).await?;
        let (found, _) = matches(&map, &MatchFilter::default(), MatchOrder::Number, 0, usize::MAX).await?;
        let verified =
            found.iter().filter(|numbered| MatchFilter::verified().accepts(&numbered.found)).count();
        let decided: Vec<bool> = found.iter().filter_map(|numbered| numbered.decision).collect();
        let vetoed = decided.iter().filter(|is_same| !**is_same).count();
        let some = |num: usize| if num == 0 { "no" } else { "some" };
        Ok(format!("{} verified, {} vetoed\n", some(verified), some(vetoed)))
    }

    /// Says of the `id`-th verified match that it is one, is none, or nothing any more; of all with `every`.
    async fn decide(&self, id: usize, word: &str) -> Result<String, AppError> {
        let site = self.site().await?;
        let map = site.map(None).await?;
        let (verified, _) =
            matches(&map, &MatchFilter::verified(), MatchOrder::Number, 0, usize::MAX).await?;
        let found = &verified.get(id).ok_or_else(|| AppError::not_found("match", id))?.found;
        match word {
            "veto" => decide(&site, found, false).await?,
            "confirm" => decide(&site, found, true).await?,
            _ => undecide(&site, found).await?,
        }
        Ok(String::new())
    }
}

/// The nearest whole number, which has no minus zero.
fn whole(value: f64) -> i32 {
    value.round() as i32
}

fn told(run: &Run) -> String {
    let state = if run.head.is_finished { "finished" } else { "open" };
    let (num_scans, text) = (run.head.next_sequence, &run.text);
    format!(
        "{state}, {num_scans} scans, {} observations, words {:?}\n",
        text.num_observations, text.num_words
    )
}

fn some_or_nothing(lines: impl Iterator<Item = String>) -> String {
    let text: String = lines.collect();
    if text.is_empty() { "nothing\n".to_owned() } else { text }
}

fn name(text: &str) -> Name {
    Name::new(text, "name").unwrap()
}

/// The script with the answers as they are.
async fn play(script: &str, disk: Disk) -> String {
    let mut stage = Stage::new(disk);
    let mut played = String::new();
    let mut lines = script.lines().filter(|line| !line.starts_with("> ")).peekable();
    while let Some(line) = lines.next() {
        played += &format!("{line}\n");
        if line == "building" {
            while let Some(row) = lines.next_if(|line| !line.is_empty()) {
                played += &format!("{row}\n");
                stage.building.rows.push(row.bytes().collect());
            }
        } else if !line.is_empty() && !line.starts_with('#') {
            stage.obey(line).await.lines().for_each(|answer| played += &format!("> {answer}\n"));
        }
    }
    played
}

fn scripts() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/scripts");
    let entries = std::fs::read_dir(folder).expect("the scripts are part of the repository");
    let mut scripts: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    scripts.sort();
    scripts
}

#[tokio::test(flavor = "multi_thread")]
async fn scripts_are_answered_as_they_say_on_both_storages() {
    let scripts = scripts();
    assert!(scripts.len() >= 10, "scripts are missing");
    for path in scripts {
        let script = std::fs::read_to_string(&path).unwrap();
        assert!(script.starts_with("# "), "{} says nothing of what it proves", path.display());
        let in_memory = play(&script, Disk::Memory(Arc::default())).await;
        let on_disk = play(&script, Disk::Sled(tempfile::tempdir().unwrap())).await;
        assert_eq!(in_memory, on_disk, "{}: the storages differ", path.display());
        if std::env::var_os("LOCUTION_REWRITE_SCRIPTS").is_some() {
            std::fs::write(&path, in_memory).unwrap();
        } else {
            assert_eq!(script, in_memory, "{}", path.display());
        }
    }
}
