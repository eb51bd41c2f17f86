//! A power cut at a random moment loses nothing that was acknowledged.
//!
//! The data directory stands on a file system of its own on a loop device. Right after an acknowledgement the file behind
//! the device is copied: that is the disk as a power cut would leave it, without what the system still held in memory.
//! The copy is mounted, a server is started on it, and everything acknowledged must be there.
//!
//! ```text
//! LOCUTION_POWER_CUTS=100 cargo test -p locution-tests --test it power_cut -- --nocapture      as root, on Linux
//! ```

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use locution_tests::{Api, drive, locution_binary};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::crash::Process;

const DEVICE_BYTES: u64 = 256 << 20;
const NUM_SCANS_PER_BATCH: usize = 20;
const NUM_CUTS_IN_SHORT: usize = 5;

/// What goes on while the power fails.
#[derive(Clone, Copy, Debug)]
enum Scene {
    FreshSite,
    OldSite,
    Build,
    NewTexts,
    Deletion,
}

const SCENES: [Scene; 5] = [Scene::FreshSite, Scene::OldSite, Scene::Build, Scene::NewTexts, Scene::Deletion];

/// What the clients were told.
#[derive(Default)]
struct Told {
    num_scans: AtomicUsize,
    num_maps: AtomicUsize,
    is_finished: Mutex<bool>,
    /// Sites by whether they were last made or deleted; not while a request is under way.
    sites: Mutex<Vec<(String, bool)>>,
}

/// A file system in a file.
pub(crate) struct Disk {
    mounted_at: PathBuf,
}

impl Disk {
    fn mount(image: &Path, at: &Path) -> Option<Self> {
        std::fs::create_dir_all(at).unwrap();
        // The journal is left alone for as long as the system lets it, so that what was not synced is not there.
        let status =
            Command::new("mount").args(["-o", "loop,commit=300"]).arg(image).arg(at).status().ok()?;
        status.success().then(|| Self { mounted_at: at.to_owned() })
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(&self.mounted_at).status();
    }
}

/// An empty file system; `None` when this machine or user cannot have one.
pub(crate) fn make_disk(directory: &Path, num_bytes: u64) -> Option<(PathBuf, Disk)> {
    let image = directory.join("disk.img");
    std::fs::File::create(&image).ok()?.set_len(num_bytes).ok()?;
    let made = Command::new("mkfs.ext4").args(["-q", "-F"]).arg(&image).status().ok()?;
    let disk = made.success().then(|| Disk::mount(&image, &directory.join("disk")))??;
    Some((image, disk))
}

fn signal(process: u32, name: &str) {
    assert!(Command::new("kill").args([name, &process.to_string()]).status().unwrap().success());
}

/// Copies the image as it stands. The server is halted, and a copy during which the system wrote is made again.
fn cut(server: u32, image: &Path, copy: &Path) {
    signal(server, "-STOP");
    loop {
        let before = std::fs::metadata(image).unwrap().modified().unwrap();
        let copied = Command::new("cp").arg("--sparse=always").arg(image).arg(copy).status().unwrap();
        assert!(copied.success());
        if std::fs::metadata(image).unwrap().modified().unwrap() == before {
            break;
        }
    }
    signal(server, "-CONT");
}

/// Posts scans until told to stop; notes what was acknowledged.
async fn post(api: Api, scans: Arc<Vec<Value>>, told: Arc<Told>, pause: Duration) {
    let first = told.num_scans.load(Ordering::Acquire);
    for (idx, batch) in scans[first..].chunks(NUM_SCANS_PER_BATCH).enumerate() {
        let number = first + idx * NUM_SCANS_PER_BATCH;
        api.post_batch("a", "r", number, batch).await.ok();
        told.num_scans.store(number + batch.len(), Ordering::Release);
        tokio::time::sleep(pause).await;
    }
    api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    *told.is_finished.lock().unwrap() = true;
}

/// Builds maps one after the other.
async fn build(api: Api, told: Arc<Told>) {
    loop {
        let job = api.post("/v1/sites/a/builds?wait=true", &json!({})).await.ok();
        assert_eq!(job["state"], "done", "{job}");
        told.num_maps.fetch_add(1, Ordering::AcqRel);
    }
}

/// Makes and deletes sites.
async fn make_and_delete(api: Api, told: Arc<Told>) {
    for round in 0.. {
        for number in 0..3 {
            let name = format!("d{number}");
            let is_made = (round + number) % 2 == 0;
            told.sites.lock().unwrap().retain(|(known, _)| *known != name);
            let path = format!("/v1/sites/{name}");
            if is_made {
                api.put(&path, &json!({})).await.ok();
            } else {
                api.delete(&path).await;
            }
            told.sites.lock().unwrap().push((name, is_made));
        }
    }
}

/// Checks that a server over the copy has everything that was told before the cut.
async fn check(api: &Api, scans: &[Value], told: &Told) {
    let num_told = told.num_scans.load(Ordering::Acquire);
    let run = api.get("/v1/sites/a/runs/r").await.ok();
    let num_stored = run["num_scans"].as_u64().unwrap() as usize;
    assert!(num_stored >= num_told, "{num_told} scans were acknowledged, {num_stored} are there");
    assert!(num_stored <= num_told + NUM_SCANS_PER_BATCH);
    let stored = api.all("/v1/sites/a/runs/r/scans").await;
    assert_eq!(stored.len(), num_stored);
    for (stored, sent) in stored.iter().zip(scans) {
        assert_eq!(stored["timestamp_ns"], sent["timestamp_ns"]);
    }
    assert!(!*told.is_finished.lock().unwrap() || run["state"] == "finished", "{run}");
    if told.num_maps.load(Ordering::Acquire) > 0 {
        api.get("/v1/sites/a/map").await.ok();
    }
    let listed: Vec<String> =
        api.all("/v1/sites").await.iter().map(|site| site["site"].as_str().unwrap().to_owned()).collect();
    for (name, is_made) in told.sites.lock().unwrap().iter() {
        assert_eq!(listed.contains(name), *is_made, "{name}: {listed:?}");
    }
    // What is stored can be gone on with.
    if run["state"] == "open" && num_stored < scans.len() {
        let end = scans.len().min(num_stored + NUM_SCANS_PER_BATCH);
        api.post_batch("a", "r", num_stored, &scans[num_stored..end]).await.ok();
    }
}

/// One disk, one server, one cut. Answers false when this machine cannot do it.
async fn round(binary: &Path, scene: Scene, rng: &mut ChaCha8Rng) -> bool {
    // In memory when there is such a file system, so that copies take no time.
    let memory = Path::new("/dev/shm");
    let directory = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
    let Some((image, _disk)) = make_disk(directory.path(), DEVICE_BYTES) else { return false };
    let scans = Arc::new(drive(6_000, 5));
    let told = Arc::new(Told::default());
    let mut server = Process::start(binary, &directory.path().join("disk/data"));
    let api = server.api().clone();
    if matches!(scene, Scene::NewTexts) {
        let config = json!({"config": {"translator": {"quantizer": {"mean_shift": {
            "num_initial_classes": 8, "bandwidth": 0.03, "min_share": 0.01, "max_moved_share": 0.01}}}}});
        api.put("/v1/sites/a", &config).await.ok();
    }
    api.make_run("a", "r").await;
    if !matches!(scene, Scene::FreshSite) {
        for first in (0..1_000).step_by(500) {
            api.post_batch("a", "r", first, &scans[first..first + 500]).await.ok();
        }
        told.num_scans.store(1_000, Ordering::Release);
    }
    if matches!(scene, Scene::OldSite | Scene::Build) {
        server.kill();
        server = Process::start(binary, &directory.path().join("disk/data"));
    }
    let api = server.api().clone();
    let pause = Duration::from_millis(rng.random_range(0..100));
    let mut clients = vec![tokio::spawn(post(api.clone(), Arc::clone(&scans), Arc::clone(&told), pause))];
    if matches!(scene, Scene::Build | Scene::NewTexts) {
        clients.push(tokio::spawn(build(api.clone(), Arc::clone(&told))));
    }
    if matches!(scene, Scene::Deletion) {
        clients.push(tokio::spawn(make_and_delete(api.clone(), Arc::clone(&told))));
    }
    tokio::time::sleep(Duration::from_millis(rng.random_range(20..6_000))).await;
    // Right after an acknowledgement.
    let before = told.num_scans.load(Ordering::Acquire);
    while told.num_scans.load(Ordering::Acquire) == before && before < scans.len() {
        tokio::time::sleep(Duration::from_micros(100)).await;
    }
    clients.iter().for_each(tokio::task::JoinHandle::abort);
    let copy = directory.path().join("copy.img");
    cut(server.id(), &image, &copy);
    server.kill();
    let Some(_copy_disk) = Disk::mount(&copy, &directory.path().join("copy")) else { return false };
    let revived = Process::start(binary, &directory.path().join("copy/data"));
    println!(
        "{scene:?}: cut after {} scans, {pause:?} between batches",
        told.num_scans.load(Ordering::Acquire)
    );
    check(revived.api(), &scans, &told).await;
    true
}

#[tokio::test(flavor = "multi_thread")]
async fn a_power_cut_loses_nothing_that_was_acknowledged() {
    let num_cuts = std::env::var("LOCUTION_POWER_CUTS").ok().and_then(|number| number.parse().ok());
    let binary = locution_binary();
    let mut rng = ChaCha8Rng::seed_from_u64(17);
    for number in 0..num_cuts.unwrap_or(NUM_CUTS_IN_SHORT) {
        if !round(&binary, SCENES[number % SCENES.len()], &mut rng).await {
            println!("skipped: a loop device needs Linux, root, mkfs.ext4 and mount");
            return;
        }
    }
}
