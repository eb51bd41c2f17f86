//! What an object store adds to the contract: several servers, a store that stalls, one that keeps no preconditions.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt};
use rand::TryRng;
use rand::rngs::SysRng;

use super::testing::{TestStore, s3_server};
use super::{ObjectConfig, ObjectStorage, store_at};
use crate::config::StorageConfig;
use crate::storage::{Batch, Precondition, Storage, StorageError};

fn config() -> ObjectConfig {
    ObjectConfig {
        flush_interval: Duration::from_millis(5),
        patience: Duration::from_secs(20),
        cache_bytes: 1 << 20,
    }
}

async fn server(store: &Arc<TestStore>, config: ObjectConfig) -> ObjectStorage {
    let store = Arc::clone(store) as Arc<dyn ObjectStore>;
    ObjectStorage::connect(store, Path::from("fleet"), config).await.unwrap()
}

/// Storages that must keep the contract: over a store in memory, over one that is reached by S3, and over the one that
/// `LOCUTION_TEST_STORE` names, such as that of `tests/seaweedfs.sh`.
pub(crate) async fn storages() -> Vec<ObjectStorage> {
    let by_s3 = ObjectStorage::connect(s3_server().await, Path::from("fleet"), config()).await.unwrap();
    let mut storages = vec![server(&TestStore::new(), config()).await, by_s3];
    if let Ok(address) = std::env::var("LOCUTION_TEST_STORE") {
        let address = Some(format!("{address}/{:016x}", SysRng.try_next_u64().unwrap()));
        let named = StorageConfig { address, ..StorageConfig::default() };
        let (bucket, prefix) = named.bucket().expect("LOCUTION_TEST_STORE is like s3://BUCKET/PREFIX");
        let (store, prefix) = store_at(bucket, prefix).unwrap();
        storages.push(ObjectStorage::connect(store, prefix, config()).await.unwrap());
    }
    storages
}

fn one(key: &str, value: &'static str) -> Batch {
    let mut batch = Batch::default();
    batch.put(key.into(), value);
    batch
}

#[tokio::test(flavor = "multi_thread")]
async fn a_site_has_one_writer_and_the_one_that_lost_it_says_so() {
    let store = TestStore::new();
    let (first, second) = (server(&store, config()).await, server(&store, config()).await);
    let before = first.open("a").await.unwrap();
    before.commit(one("k", "first"), vec![]).await.unwrap();
    let after = second.open("a").await.unwrap();
    assert_eq!(after.get(b"k").await.unwrap().as_deref(), Some(&b"first"[..]));
    let outcome = before.commit(one("k", "late"), vec![]).await;
    assert!(matches!(outcome, Err(StorageError::Fenced)), "{outcome:?}");
    assert!(before.is_over() && !after.is_over());
    assert!(matches!(before.get(b"k").await, Err(StorageError::Fenced)));
    assert_eq!(after.get(b"k").await.unwrap().as_deref(), Some(&b"first"[..]));
    // Asked again, the first takes it back.
    let again = first.open("a").await.unwrap();
    again.commit(one("k", "back"), vec![]).await.unwrap();
    assert_eq!(again.get(b"k").await.unwrap().as_deref(), Some(&b"back"[..]));
    first.close().await.unwrap();
    second.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn of_writers_that_take_a_site_from_each_other_nothing_acknowledged_is_lost() {
    let store = TestStore::new();
    let servers =
        [server(&store, config()).await, server(&store, config()).await, server(&store, config()).await];
    let mut acknowledged = Vec::new();
    for round in 0..30u32 {
        let site = servers[round as usize % 3].open("a").await.unwrap();
        let commits = (0..4u32).map(|idx| {
            let key = format!("{round}/{idx}");
            let site = Arc::clone(&site);
            tokio::spawn(async move { site.commit(one(&key, "x"), vec![]).await.is_ok().then_some(key) })
        });
        let commits: Vec<_> = commits.collect();
        if round % 2 == 0 {
            // While they are under way another server takes the site.
            servers[(round as usize + 1) % 3].open("a").await.unwrap();
        }
        for commit in commits {
            acknowledged.extend(commit.await.unwrap());
        }
    }
    assert!(acknowledged.len() >= 60, "every second round is undisturbed: {}", acknowledged.len());
    let site = server(&store, config()).await.open("a").await.unwrap();
    for key in acknowledged {
        assert!(site.get(key.as_bytes()).await.unwrap().is_some(), "{key} was acknowledged");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_not_durable_is_neither_read_nor_acknowledged_and_the_handle_ends() {
    let store = TestStore::new();
    let impatient = ObjectConfig { patience: Duration::from_secs(1), ..config() };
    let storage = server(&store, impatient).await;
    let site = storage.open("a").await.unwrap();
    site.commit(one("k", "old"), vec![]).await.unwrap();
    store.stall(true);
    let waiting = tokio::spawn({
        let site = Arc::clone(&site);
        async move { site.commit(one("k", "new"), vec![]).await }
    });
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(site.get(b"k").await.unwrap().as_deref(), Some(&b"old"[..]));
    assert_eq!(site.scan(b"", b"", 9).await.unwrap()[0].1.as_ref(), b"old");
    let expected = Some(Bytes::from_static(b"old"));
    let stale = Precondition { key: b"k".to_vec(), expected };
    let outcome = site.commit(one("k", "other"), vec![stale]).await;
    assert!(matches!(outcome, Err(StorageError::Conflict)), "the batch that waits came first: {outcome:?}");
    let outcome = waiting.await.unwrap();
    assert!(matches!(outcome, Err(StorageError::Unavailable { .. })), "{outcome:?}");
    assert!(site.is_over());
    assert!(matches!(storage.open("a").await.map(|_| ()), Err(StorageError::Unavailable { .. })));
    store.stall(false);
    let again = storage.open("a").await.unwrap();
    let value = again.get(b"k").await.unwrap().unwrap();
    again
        .commit(one("k", "newest"), vec![Precondition { key: b"k".to_vec(), expected: Some(value) }])
        .await
        .unwrap();
    storage.close().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn closing_ends_though_the_store_is_away() {
    let store = TestStore::new();
    let storage = server(&store, ObjectConfig { patience: Duration::from_secs(1), ..config() }).await;
    let site = storage.open("a").await.unwrap();
    store.stall(true);
    let waiting = tokio::spawn(async move { site.commit(one("k", "new"), vec![]).await });
    tokio::time::sleep(Duration::from_millis(50)).await;
    tokio::time::timeout(Duration::from_secs(10), storage.close()).await.expect("it ends").unwrap();
    assert!(waiting.await.unwrap().is_err());
    assert!(matches!(storage.open("a").await.map(|_| ()), Err(StorageError::Unavailable { .. })));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_site_that_another_server_deleted_is_lost_and_made_again_it_is_another() {
    let store = TestStore::new();
    let (first, second) = (server(&store, config()).await, server(&store, config()).await);
    let before = first.open("a").await.unwrap();
    before.commit(one("k", "first"), vec![]).await.unwrap();
    second.delete("a").await.unwrap();
    assert!(matches!(before.commit(one("k", "late"), vec![]).await, Err(StorageError::Fenced)));
    let again = second.open("a").await.unwrap();
    assert_eq!(again.get(b"k").await.unwrap(), None);
    again.commit(one("k", "second"), vec![]).await.unwrap();
    assert!(matches!(before.commit(one("k", "late"), vec![]).await, Err(StorageError::Fenced)));
    let taken = first.open("a").await.unwrap();
    assert_eq!(taken.get(b"k").await.unwrap().as_deref(), Some(&b"second"[..]));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_store_that_keeps_no_preconditions_and_a_prefix_of_something_else_are_refused() {
    let store = TestStore::new();
    store.is_careless.store(true, Ordering::Relaxed);
    let connect = async || {
        let store = Arc::clone(&store) as Arc<dyn ObjectStore>;
        ObjectStorage::connect(store, Path::from("fleet"), config()).await.map(|_| ())
    };
    let outcome = connect().await;
    assert!(
        matches!(&outcome, Err(StorageError::Unavailable { reason, .. }) if reason.contains("If-None-Match"))
    );
    store.is_careless.store(false, Ordering::Relaxed);
    connect().await.unwrap();
    store.put(&Path::from("fleet/format"), "LOCUTION OBJECT STORE 2\n".into()).await.unwrap();
    assert!(matches!(connect().await, Err(StorageError::Corrupt { .. })));
}

#[tokio::test(flavor = "multi_thread")]
async fn batches_that_come_together_share_a_write() {
    const NUM_BATCHES: u64 = 200;
    let store = TestStore::new();
    let storage =
        server(&store, ObjectConfig { flush_interval: Duration::from_millis(200), ..config() }).await;
    let site = storage.open("a").await.unwrap();
    let before = store.num_writes.load(Ordering::Relaxed);
    let commits = (0..NUM_BATCHES).map(|idx| {
        let site = Arc::clone(&site);
        tokio::spawn(async move { site.commit(one(&format!("{idx}"), "x"), vec![]).await.unwrap() })
    });
    for commit in commits.collect::<Vec<_>>() {
        commit.await.unwrap();
    }
    let num_writes = store.num_writes.load(Ordering::Relaxed) - before;
    assert!(num_writes < NUM_BATCHES / 10, "{num_writes} writes for {NUM_BATCHES} batches");
    storage.close().await.unwrap();
}

/// How often an open site in which nothing happens asks the store; `docs/object-store.md` says what that costs.
#[tokio::test(start_paused = true)]
async fn an_idle_site_asks_the_store_a_few_times_a_minute() {
    const NUM_MINUTES: u64 = 20;
    let store = TestStore::new();
    let storage = server(&store, config()).await;
    let site = storage.open("a").await.unwrap();
    site.commit(one("k", "x"), vec![]).await.unwrap();
    let count = || {
        let counters = [&store.num_writes, &store.num_lists, &store.num_reads];
        counters.map(|counter| counter.load(Ordering::Relaxed))
    };
    let before = count();
    tokio::time::sleep(Duration::from_secs(60 * NUM_MINUTES)).await;
    let after = count();
    let [num_writes, num_lists, num_reads] = [0, 1, 2].map(|idx| after[idx] - before[idx]);
    println!("in {NUM_MINUTES} min: {num_writes} writes, {num_lists} lists, {num_reads} reads");
    assert!(num_writes + num_lists < 10 * NUM_MINUTES && num_reads < 20 * NUM_MINUTES);
    assert!(num_lists > 0, "the clock of the engine did not move");
    storage.close().await.unwrap();
}
