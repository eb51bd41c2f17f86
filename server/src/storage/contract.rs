//! The contract that every implementation of the storage trait passes.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    Batch, MemoryStorage, Precondition, Reader, SiteStore, SledConfig, SledStorage, Storage, StorageError,
    VALUE_BYTES_MAX,
};

fn sled_in(directory: &std::path::Path) -> SledStorage {
    SledStorage::new(SledConfig { directory: directory.to_owned(), cache_bytes_per_site: 1 << 20 }).unwrap()
}

/// Runs one law against every implementation.
async fn check<F: AsyncFn(&dyn Storage)>(law: F) {
    law(&MemoryStorage::default()).await;
    let directory = tempfile::tempdir().unwrap();
    law(&sled_in(directory.path())).await;
    #[cfg(feature = "object-store")]
    for storage in super::object::tests::storages().await {
        law(&storage).await;
        storage.close().await.unwrap();
    }
}

fn batch_of(pairs: &[(&str, Option<&str>)]) -> Batch {
    let mut batch = Batch::default();
    for (key, value) in pairs {
        match value {
            Some(value) => batch.put(key.as_bytes().to_vec(), Bytes::copy_from_slice(value.as_bytes())),
            None => batch.delete(key.as_bytes().to_vec()),
        }
    }
    batch
}

async fn keys_of(reader: &dyn Reader, prefix: &str, from: &str, limit: usize) -> Vec<String> {
    let entries = reader.scan(prefix.as_bytes(), from.as_bytes(), limit).await.unwrap();
    entries.into_iter().map(|(key, _)| String::from_utf8(key.to_vec()).unwrap()).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn reads_what_was_committed() {
    check(async |storage| {
        let site = storage.open("a").await.unwrap();
        site.commit(batch_of(&[("k1", Some("one")), ("k2", Some("two"))]), vec![]).await.unwrap();
        assert_eq!(site.get(b"k1").await.unwrap().as_deref(), Some(&b"one"[..]));
        assert_eq!(site.get(b"k3").await.unwrap(), None);
        let several = site.multi_get(&[b"k2".to_vec(), b"k9".to_vec(), b"k1".to_vec()]).await.unwrap();
        assert_eq!(several, vec![Some(Bytes::from_static(b"two")), None, Some(Bytes::from_static(b"one"))]);
        assert!(site.num_bytes_on_disk().await.unwrap() > 0);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn scans_are_ordered_bounded_and_keep_to_the_prefix() {
    check(async |storage| {
        let site = storage.open("a").await.unwrap();
        let all = [("b2", Some("")), ("a9", Some("")), ("b1", Some("")), ("b10", Some("")), ("c", Some(""))];
        site.commit(batch_of(&all), vec![]).await.unwrap();
        assert_eq!(keys_of(&*site, "b", "", 9).await, ["b1", "b10", "b2"]);
        assert_eq!(keys_of(&*site, "b", "b10", 9).await, ["b10", "b2"]);
        assert_eq!(keys_of(&*site, "b", "b10", 1).await, ["b10"]);
        assert_eq!(keys_of(&*site, "", "", 9).await, ["a9", "b1", "b10", "b2", "c"]);
        assert_eq!(keys_of(&*site, "b", "c", 9).await, Vec::<String>::new());
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failed_precondition_writes_nothing() {
    check(async |storage| {
        let site = storage.open("a").await.unwrap();
        let absent = |key: &str| Precondition { key: key.into(), expected: None };
        let equals = |key: &str, value: &'static str| Precondition {
            key: key.into(),
            expected: Some(Bytes::from_static(value.as_bytes())),
        };
        site.commit(batch_of(&[("head", Some("1"))]), vec![absent("head")]).await.unwrap();
        for wrong in [absent("head"), equals("head", "2"), equals("other", "1")] {
            let outcome = site.commit(batch_of(&[("head", Some("9")), ("x", Some("9"))]), vec![wrong]).await;
            assert!(matches!(outcome, Err(StorageError::Conflict)));
        }
        assert_eq!(keys_of(&*site, "", "", 9).await, ["head"]);
        site.commit(batch_of(&[("head", None), ("x", Some("2"))]), vec![equals("head", "1")]).await.unwrap();
        assert_eq!(keys_of(&*site, "", "", 9).await, ["x"]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_snapshot_does_not_move() {
    check(async |storage| {
        let site = storage.open("a").await.unwrap();
        site.commit(batch_of(&[("a", Some("1")), ("b", Some("1")), ("d", Some("1"))]), vec![]).await.unwrap();
        let snapshot = site.snapshot().await.unwrap();
        site.commit(batch_of(&[("a", Some("2")), ("b", None), ("c", Some("2"))]), vec![]).await.unwrap();
        site.commit(batch_of(&[("a", Some("3")), ("b", Some("3"))]), vec![]).await.unwrap();
        assert_eq!(keys_of(&*snapshot, "", "", 9).await, ["a", "b", "d"]);
        assert_eq!(keys_of(&*snapshot, "", "", 2).await, ["a", "b"]);
        assert_eq!(snapshot.get(b"a").await.unwrap().as_deref(), Some(&b"1"[..]));
        assert_eq!(snapshot.get(b"c").await.unwrap(), None);
        assert_eq!(snapshot.multi_get(&[b"b".to_vec()]).await.unwrap()[0].as_deref(), Some(&b"1"[..]));
        assert_eq!(keys_of(&*site, "", "", 9).await, ["a", "b", "c", "d"]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn random_histories_agree_with_a_plain_map() {
    check(async |storage| {
        let site = storage.open("a").await.unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let mut model: BTreeMap<Vec<u8>, Bytes> = BTreeMap::new();
        let mut frozen = None;
        for round in 0..60 {
            let mut batch = Batch::default();
            for _ in 0..rng.random_range(1..8) {
                let key = vec![rng.random_range(0..4u8), rng.random_range(0..6u8)];
                let value =
                    rng.random_bool(0.7).then(|| Bytes::from(vec![round as u8; rng.random_range(0..5)]));
                match &value {
                    Some(value) => model.insert(key.clone(), value.clone()),
                    None => model.remove(&key),
                };
                batch.writes.push((key, value));
            }
            site.commit(batch, vec![]).await.unwrap();
            if round % 20 == 5 {
                frozen = Some((site.snapshot().await.unwrap(), model.clone()));
            }
            let prefix = [rng.random_range(0..4u8)];
            let from = [prefix[0], rng.random_range(0..6u8)];
            let limit = rng.random_range(0..8);
            let expected = |map: &BTreeMap<Vec<u8>, Bytes>| -> Vec<(Bytes, Bytes)> {
                map.range(from.to_vec()..)
                    .filter(|(key, _)| key.starts_with(&prefix))
                    .take(limit)
                    .map(|(key, value)| (Bytes::from(key.clone()), value.clone()))
                    .collect()
            };
            assert_eq!(site.scan(&prefix, &from, limit).await.unwrap(), expected(&model));
            if let Some((snapshot, map)) = &frozen {
                assert_eq!(snapshot.scan(&prefix, &from, limit).await.unwrap(), expected(map));
            }
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_concurrent_writers_exactly_one_wins() {
    check(async |storage| {
        let site: Arc<dyn SiteStore> = storage.open("a").await.unwrap();
        let mut writers = Vec::new();
        for writer in 0..16u8 {
            let site = Arc::clone(&site);
            writers.push(tokio::spawn(async move {
                let mut batch = Batch::default();
                batch.put(b"owner".to_vec(), vec![writer]);
                site.commit(batch, vec![Precondition { key: b"owner".to_vec(), expected: None }])
                    .await
                    .is_ok()
            }));
        }
        let mut num_winners = 0;
        for writer in writers {
            num_winners += usize::from(writer.await.unwrap());
        }
        assert_eq!(num_winners, 1);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn sites_are_apart_and_a_deleted_one_is_fenced() {
    check(async |storage| {
        let a = storage.open("a").await.unwrap();
        let b = storage.open("b").await.unwrap();
        a.commit(batch_of(&[("k", Some("a"))]), vec![]).await.unwrap();
        assert_eq!(b.get(b"k").await.unwrap(), None);
        assert_eq!(storage.list().await.unwrap(), ["a", "b"]);
        storage.delete("a").await.unwrap();
        storage.delete("never").await.unwrap();
        assert_eq!(storage.list().await.unwrap(), ["b"]);
        assert!(matches!(a.get(b"k").await, Err(StorageError::Fenced)));
        let outcome = a.commit(batch_of(&[("k", Some("late"))]), vec![]).await;
        assert!(matches!(outcome, Err(StorageError::Fenced)));
        let fresh = storage.open("a").await.unwrap();
        assert_eq!(fresh.get(b"k").await.unwrap(), None);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_released_site_ends_its_handles_and_is_opened_again_as_it_was() {
    check(async |storage| {
        let before = storage.open("a").await.unwrap();
        before.commit(batch_of(&[("k", Some("kept"))]), vec![]).await.unwrap();
        assert!(!before.is_over());
        storage.release("a").await.unwrap();
        storage.release("never").await.unwrap();
        assert!(before.is_over());
        assert!(matches!(before.get(b"k").await, Err(StorageError::Fenced)));
        assert_eq!(storage.list().await.unwrap(), ["a"]);
        assert!(storage.contains("a").await.unwrap() && !storage.contains("never").await.unwrap());
        let after = storage.open("a").await.unwrap();
        assert_eq!(after.get(b"k").await.unwrap().as_deref(), Some(&b"kept"[..]));
        after.commit(batch_of(&[("k", Some("again"))]), vec![]).await.unwrap();
        assert_eq!(after.get(b"k").await.unwrap().as_deref(), Some(&b"again"[..]));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn values_are_bounded() {
    check(async |storage| {
        let site = storage.open("a").await.unwrap();
        let mut batch = Batch::default();
        batch.put(b"small".to_vec(), vec![0; VALUE_BYTES_MAX]);
        site.commit(batch.clone(), vec![]).await.unwrap();
        batch.put(b"large".to_vec(), vec![0; VALUE_BYTES_MAX + 1]);
        let outcome = site.commit(batch, vec![]).await;
        assert!(matches!(outcome, Err(StorageError::ValueTooLarge { .. })));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn sled_keeps_what_was_committed_and_refuses_a_second_holder() {
    let directory = tempfile::tempdir().unwrap();
    let first = sled_in(directory.path());
    let site = first.open("a").await.unwrap();
    site.commit(batch_of(&[("k", Some("kept"))]), vec![]).await.unwrap();
    let config = SledConfig { directory: directory.path().to_owned(), cache_bytes_per_site: 1 << 20 };
    assert!(matches!(SledStorage::new(config), Err(StorageError::Held { .. })));
    first.close().await.unwrap();
    drop((site, first));
    let second = sled_in(directory.path());
    let site = second.open("a").await.unwrap();
    assert_eq!(site.get(b"k").await.unwrap().as_deref(), Some(&b"kept"[..]));
}
