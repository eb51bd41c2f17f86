//! A full disk loses nothing: writes are refused with a clear word, reads go on, and so do writes once there is room.

use std::path::Path;

use locution_tests::{drive, locution_binary};
use serde_json::json;

use super::crash::Process;
use super::power_cut::make_disk;

const DEVICE_BYTES: u64 = 40 << 20;
const NUM_SCANS_PER_BATCH: usize = 100;

#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_refuses_writes_and_keeps_what_it_has() {
    let memory = Path::new("/dev/shm");
    let directory = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.unwrap();
    let Some((_, _disk)) = make_disk(directory.path(), DEVICE_BYTES) else {
        println!("skipped: a loop device needs Linux, root, mkfs.ext4 and mount");
        return;
    };
    let mount = directory.path().join("disk");
    let (binary, scans) = (locution_binary(), drive(20_000, 9));
    let ballast = mount.join("ballast");
    std::fs::write(&ballast, vec![1; 20 << 20]).unwrap();
    let mut server = Process::start(&binary, &mount.join("data"));
    server.api().make_run("a", "r").await;
    let mut next = 0;
    let mut num_refusals = 0;
    // Twice: filled by the server itself, then by somebody else while batches arrive.
    for round in 0..2 {
        let refusal = loop {
            let end = scans.len().min(next + NUM_SCANS_PER_BATCH);
            let answer = server.api().post_batch("a", "r", next, &scans[next..end]).await;
            if !answer.status.is_success() {
                break answer;
            }
            next = end;
            assert!(next < scans.len(), "the disk was not filled");
            if round == 1 && num_refusals == 1 {
                let filler = std::thread::spawn({
                    let path = mount.join("filler");
                    move || while_there_is_room(&path)
                });
                num_refusals += 1;
                drop(filler);
            }
        };
        assert!(matches!(refusal.status.as_u16(), 503 | 507), "{}", refusal.text());
        assert!(refusal.headers.contains_key("retry-after"), "{refusal:?}");
        num_refusals = num_refusals.max(1);
        let run = server.api().get("/v1/sites/a/runs/r").await.ok();
        assert_eq!(run["num_scans"], next, "reads go on");
        assert_eq!(server.api().all("/v1/sites/a/runs/r/scans").await.len(), next);
        for file in [&ballast, &mount.join("filler")] {
            let _ = std::fs::remove_file(file);
        }
        let end = next + NUM_SCANS_PER_BATCH;
        let mut answer = server.api().post_batch("a", "r", next, &scans[next..end]).await;
        for _ in 0..50 {
            if answer.status.is_success() {
                break;
            }
            tokio::time::sleep(std::time::Duration::from_millis(200)).await;
            answer = server.api().post_batch("a", "r", next, &scans[next..end]).await;
        }
        answer.ok();
        next = end;
        server.kill();
        server = Process::start(&binary, &mount.join("data"));
        let run = server.api().get("/v1/sites/a/runs/r").await.ok();
        assert_eq!(run["num_scans"], next, "after a restart");
    }
    server.api().put("/v1/sites/b", &json!({})).await.ok();
}

/// Writes until the disk takes no more.
fn while_there_is_room(path: &Path) {
    use std::io::Write;
    let mut file = std::fs::File::create(path).unwrap();
    let block = vec![7; 1 << 16];
    while file.write_all(&block).is_ok() {}
}
