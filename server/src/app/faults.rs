//! Whichever commit goes wrong and however: who asks again gets on, and what comes out is what would have come out.

use std::sync::Arc;

use locution_engine::geometry::Pose2;
use locution_engine::scan::{Scan, ScanGeometry};

use super::runs::{NewBatch, NewRun};
use super::site::Site;
use super::{App, AppError, Name};
use crate::config::ServerConfig;
use crate::records::{JobKind, JobState, ReadingRules};
use crate::storage::faulty::{Fault, FaultyStorage};
use crate::storage::{MemoryStorage, Storage};

const NUM_RANGES: usize = 31;
const NUM_SCANS: usize = 240;
const NUM_SCANS_PER_BATCH: usize = 40;
const NUM_ATTEMPTS: usize = 20;

fn geometry() -> ScanGeometry {
    ScanGeometry {
        num_ranges: NUM_RANGES,
        angle_min_rad: -1.5,
        angle_increment_rad: 0.1,
        range_max_m: 10.0,
        robot_from_laser: Pose2::identity(),
    }
}

/// A robot that drives along a corridor with alcoves.
fn scans() -> Vec<Scan> {
    let at = |idx: usize| {
        let x = 0.1 * idx as f64;
        let side_m = if (x / 3.0) as usize & 1 == 0 { 1.0 } else { 2.5 };
        let range = |beam: usize| {
            let angle = -1.5 + 0.1 * beam as f64;
            (side_m / angle.sin().abs().max(0.05)).min(9.0) as f32
        };
        Scan {
            timestamp_ns: idx as i64 * 100_000_000,
            odom_from_robot: Pose2::new(x, 0.0, 0.0),
            angular_velocity_rad_per_s: None,
            ranges_m: (0..NUM_RANGES).map(range).collect(),
        }
    };
    (0..NUM_SCANS).map(at).collect()
}

/// Asks again until it works, as clients do.
async fn insist<T>(what: &str, mut ask: impl AsyncFnMut() -> Result<T, AppError>) -> T {
    for _ in 0..NUM_ATTEMPTS {
        match ask().await {
            Ok(answer) => return answer,
            Err(AppError::Storage(_) | AppError::Internal { .. }) => {}
            Err(error) => panic!("{what}: {error}"),
        }
    }
    panic!("{what}: failed {NUM_ATTEMPTS} times")
}

/// A run of so many scans, finished.
pub(super) async fn drive(app: &Arc<App>, site: &Arc<Site>, run: &Name, num_scans: usize) {
    let geometry = geometry();
    let new = NewRun { robot: None, readings: ReadingRules::of(&geometry), geometry, area: None };
    app.make_run(site, run, new).await.unwrap();
    let batch = NewBatch { first_sequence: 0, scans: scans()[..num_scans].to_vec(), has_odometry: true };
    app.append_batch(Arc::clone(site), run, batch).await.unwrap();
    app.finish_run(Arc::clone(site), run).await.unwrap();
}

/// One recording, one map; everything that can be read afterwards.
async fn work(storage: Arc<dyn Storage>) -> String {
    let mut config = ServerConfig::default();
    config.builds.is_automatic = false;
    config.storage.num_scans_per_checkpoint = 100;
    let app = Arc::new(App::new(config, storage));
    let (site_name, run_name) = (Name::new("s", "site").unwrap(), Name::new("r", "run").unwrap());
    let geometry = geometry();
    let new = NewRun { robot: None, readings: ReadingRules::of(&geometry), geometry, area: None };
    insist("site", async || app.make_site(&site_name, None).await.map(|_| ())).await;
    let site = insist("open", async || app.site(&site_name).await).await;
    insist("run", async || app.make_run(&site, &run_name, new.clone()).await.map(|_| ())).await;
    for (idx, scans) in scans().chunks(NUM_SCANS_PER_BATCH).enumerate() {
        let first_sequence = (idx * NUM_SCANS_PER_BATCH) as u64;
        let receipt = insist("batch", async || {
            let batch = NewBatch { first_sequence, scans: scans.to_vec(), has_odometry: true };
            app.append_batch(Arc::clone(&site), &run_name, batch).await
        })
        .await;
        assert_eq!(receipt.next_sequence, first_sequence + scans.len() as u64);
    }
    insist("finish", async || app.finish_run(Arc::clone(&site), &run_name).await.map(|_| ())).await;
    let mut is_built = false;
    for _ in 0..NUM_ATTEMPTS {
        let job = insist("job", async || app.queue_job(&site, JobKind::Build).await).await;
        let ended = tokio::time::timeout(std::time::Duration::from_secs(3), site.jobs().ended(job.record.id));
        is_built = matches!(ended.await, Ok(Ok(job)) if job.record.state == JobState::Done);
        if is_built {
            break;
        }
    }
    assert!(is_built, "no map was built");
    // As a process sees it that starts anew.
    let run = site.run(&run_name).await.unwrap();
    let map = site.map(None).await.unwrap();
    let words = run.words(0, 0, usize::MAX).await.unwrap();
    let observations = run.observations(0, usize::MAX).await.unwrap();
    let scans = run.scans(0..run.head.next_sequence).await.unwrap();
    format!("{words:?} {observations:?} {scans:?} {:?}", map.record.runs)
}

#[tokio::test(flavor = "multi_thread")]
async fn whichever_commit_goes_wrong_the_same_comes_out() {
    let counting = Arc::new(FaultyStorage::new(Arc::new(MemoryStorage::default()), u64::MAX, Fault::Refused));
    let undisturbed = work(Arc::clone(&counting) as Arc<dyn Storage>).await;
    let num_commits = counting.num_commits();
    assert!(num_commits > 10, "{num_commits}");
    for at in 0..num_commits {
        for fault in [Fault::Refused, Fault::Full, Fault::CutOff, Fault::Slow] {
            let storage = FaultyStorage::new(Arc::new(MemoryStorage::default()), at, fault);
            let disturbed = work(Arc::new(storage)).await;
            assert!(disturbed == undisturbed, "{fault:?} at commit {at} of {num_commits}");
        }
    }
}

/// A client that hangs up ends its request wherever it is.
#[tokio::test]
async fn a_change_that_nobody_waits_for_any_more_is_made_whole_and_hinders_no_other() {
    let name = Name::new("s", "site").unwrap();
    for fault in [Fault::Slow, Fault::Late] {
        let config = ServerConfig::default();
        let counting = Arc::new(FaultyStorage::new(Arc::new(MemoryStorage::default()), u64::MAX, fault));
        let app = Arc::new(App::new(config.clone(), Arc::clone(&counting) as Arc<dyn Storage>));
        app.make_site(&name, None).await.unwrap();
        let at = counting.num_commits();
        let storage = FaultyStorage::new(Arc::new(MemoryStorage::default()), at, fault);
        let app = Arc::new(App::new(config, Arc::new(storage)));
        app.make_site(&name, None).await.unwrap();
        let site = app.site(&name).await.unwrap();
        let number = site.state().record.next_decision;
        let next = async || {
            site.change(|record, _| {
                record.next_decision += 1;
                Ok(())
            })
            .await
        };
        let patience = std::time::Duration::from_millis(50);
        assert!(tokio::time::timeout(patience, next()).await.is_err(), "{fault:?}: it was quick");
        next().await.unwrap();
        assert_eq!(site.state().record.next_decision, number + 2, "{fault:?}");
    }
}
