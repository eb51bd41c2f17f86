//! Whatever is damaged in the files of a site is told: nothing is lost without a word, nothing is written over it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use bytes::Bytes;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Batch, SledConfig, SledStorage, Storage, StorageError, upkeep};

type Model = BTreeMap<Vec<u8>, Bytes>;

fn storage_in(directory: &Path) -> SledStorage {
    SledStorage::new(SledConfig { directory: directory.to_owned(), cache_bytes_per_site: 1 << 20 }).unwrap()
}

/// A site as a run of batches leaves it: a head that is overwritten, chunks of all sizes, some deleted again.
async fn fill(directory: &Path, sessions: usize, num_commits: usize) -> Model {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut model = Model::new();
    for _ in 0..sessions {
        let storage = storage_in(directory);
        let site = storage.open("s").await.unwrap();
        for number in 0..num_commits {
            let mut batch = Batch::default();
            batch.put(b"head".to_vec(), vec![number as u8; 40]);
            let name = format!("chunk{:05}", model.len()).into_bytes();
            let num_bytes = if number % 40 == 7 { 300_000 } else { rng.random_range(0..6_000) };
            batch.put(name, (0..num_bytes).map(|_| rng.random()).collect::<Vec<u8>>());
            if number % 5 == 4 {
                let victim = model.keys().nth(rng.random_range(0..model.len())).unwrap().clone();
                batch.delete(victim);
            }
            for (key, value) in &batch.writes {
                match value {
                    Some(value) => model.insert(key.clone(), value.clone()),
                    None => model.remove(key),
                };
            }
            site.commit(batch, vec![]).await.unwrap();
        }
        drop(site);
        storage.close().await.unwrap();
    }
    model
}

fn copy(from: &Path, to: &Path) {
    super::files::copy_tree(from, to).unwrap();
}

fn contents(path: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(path).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(contents(&path));
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap());
        }
    }
    found
}

#[derive(Debug)]
enum Damage {
    Byte,
    Zeros,
    Truncated,
    Missing,
}

/// Damages one file of the site; says which and how.
fn damage(site: &Path, rng: &mut ChaCha8Rng) -> String {
    let files: Vec<_> = contents(site).into_iter().filter(|(_, bytes)| !bytes.is_empty()).collect();
    // Most of what is stored is in `db`, so most of the damage is there too.
    let db = files.iter().position(|(path, _)| path.ends_with("db")).unwrap();
    let chosen = if rng.random_bool(0.7) { db } else { rng.random_range(0..files.len()) };
    let (path, mut bytes) = files[chosen].clone();
    let at = rng.random_range(0..bytes.len());
    let kind = match rng.random_range(0..8) {
        0..=3 => Damage::Byte,
        4..=5 => Damage::Zeros,
        6 => Damage::Truncated,
        _ => Damage::Missing,
    };
    match kind {
        Damage::Byte => bytes[at] ^= 1 << rng.random_range(0..8),
        Damage::Zeros => {
            let end = bytes.len().min(at + 4096);
            bytes[at..end].fill(0);
        }
        Damage::Truncated => bytes.truncate(at),
        Damage::Missing => fs::remove_file(&path).unwrap(),
    }
    if !matches!(kind, Damage::Missing) {
        fs::write(&path, bytes).unwrap();
    }
    format!("{kind:?} at {at} of {}", path.display())
}

/// Opens the site and reads everything: all of it must be there, or an error that says so.
async fn read_all(storage: &SledStorage, model: &Model, what: &str) -> Result<(), StorageError> {
    let site = storage.open("s").await?;
    let mut outcome = Ok(());
    for (key, value) in model {
        match site.get(key).await {
            Ok(found) => assert_eq!(found.as_ref(), Some(value), "{what}: {}", String::from_utf8_lossy(key)),
            Err(error) => outcome = Err(error),
        }
    }
    match site.scan(b"", b"", usize::MAX).await {
        Ok(entries) => assert_eq!(entries.len(), model.len(), "{what}"),
        Err(error) => outcome = Err(error),
    }
    outcome
}

#[tokio::test(flavor = "multi_thread")]
async fn damage_is_told_and_nothing_is_written_over_it() {
    let original = tempfile::tempdir().unwrap();
    let model = fill(original.path(), 2, 150).await;
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut num_told, mut num_refused, mut num_harmless) = (0, 0, 0);
    for _ in 0..60 {
        let directory = tempfile::tempdir().unwrap();
        copy(original.path(), directory.path());
        let site = directory.path().join("sites/s");
        let what = damage(&site, &mut rng);
        let before = contents(&site);
        let storage = storage_in(directory.path());
        match storage.open("s").await {
            Err(StorageError::Corrupt { what: told }) => {
                assert!(told.contains("site `s`") && told.contains("locution repair"), "{told}");
                assert!(contents(&site) == before, "{what}: written over, {told}");
                // A damaged site can be deleted, others serve on.
                storage.open("other").await.unwrap();
                assert_eq!(storage.list().await.unwrap(), ["other", "s"]);
                storage.delete("s").await.unwrap();
                num_refused += 1;
            }
            Err(error) => panic!("{what}: {error}"),
            Ok(_) => match read_all(&storage, &model, &what).await {
                Ok(()) => num_harmless += 1,
                Err(StorageError::Corrupt { .. }) => num_told += 1,
                Err(error) => panic!("{what}: {error}"),
            },
        }
    }
    println!(
        "of 60 damages {num_refused} were refused at opening, {num_told} told while reading, {num_harmless} hit nothing"
    );
    assert!(num_refused + num_told > 30);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_repaired_site_serves_what_could_be_read() {
    let original = tempfile::tempdir().unwrap();
    let model = fill(original.path(), 2, 150).await;
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let mut num_whole = 0;
    for _ in 0..12 {
        let directory = tempfile::tempdir().unwrap();
        copy(original.path(), directory.path());
        let what = damage(&directory.path().join("sites/s"), &mut rng);
        let (report, kept) = match upkeep::repair(directory.path(), "s") {
            Ok(repaired) => repaired,
            // Without its main file there is nothing to repair.
            Err(StorageError::Corrupt { .. } | StorageError::Unavailable { .. }) => continue,
            Err(error) => panic!("{what}: {error}"),
        };
        assert!(kept.exists());
        let storage = storage_in(directory.path());
        let site = storage.open("s").await.unwrap();
        let entries = site.scan(b"", b"", usize::MAX).await.unwrap();
        assert_eq!(entries.len() as u64, report.num_records, "{what}");
        // What is there was written once.
        let num_right = entries.iter().filter(|(key, value)| model.get(&key[..]) == Some(value)).count();
        if report.problems.is_empty() {
            assert_eq!(num_right, model.len(), "{what}");
            num_whole += 1;
        }
        println!("{what}: {num_right} of {} records, {:?}", model.len(), report.problems);
        site.commit(batch_of_one(), vec![]).await.unwrap();
    }
    assert!(num_whole > 0);
}

fn batch_of_one() -> Batch {
    let mut batch = Batch::default();
    batch.put(b"later".to_vec(), vec![1]);
    batch
}

#[tokio::test(flavor = "multi_thread")]
async fn check_finds_what_is_damaged_and_changes_nothing() {
    let original = tempfile::tempdir().unwrap();
    let model = fill(original.path(), 2, 100).await;
    let sound = upkeep::check(original.path(), None, &|_, _| None).unwrap();
    assert_eq!(sound.len(), 1);
    assert!(sound[0].problems.is_empty(), "{:?}", sound[0].problems);
    assert_eq!((sound[0].num_records, sound[0].num_commits), (model.len() as u64, 200));
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    for _ in 0..10 {
        let directory = tempfile::tempdir().unwrap();
        copy(original.path(), directory.path());
        let what = damage(&directory.path().join("sites/s"), &mut rng);
        let before = contents(&directory.path().join("sites/s"));
        let report = &upkeep::check(directory.path(), Some("s"), &|_, _| None).unwrap()[0];
        assert!(contents(&directory.path().join("sites/s")) == before, "{what}");
        let storage = storage_in(directory.path());
        let served = match storage.open("s").await {
            Ok(_) => read_all(&storage, &model, &what).await,
            Err(error) => Err(error),
        };
        assert!(served.is_ok() || !report.problems.is_empty(), "{what}: served {served:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_compacted_site_holds_the_same_in_less_room() {
    let directory = tempfile::tempdir().unwrap();
    let storage = storage_in(directory.path());
    let site = storage.open("s").await.unwrap();
    for round in 0..60u8 {
        let mut batch = Batch::default();
        for key in 0..20u8 {
            batch.put(vec![key], vec![round ^ key; 20_000]);
        }
        site.commit(batch, vec![]).await.unwrap();
    }
    let before = site.scan(b"", b"", usize::MAX).await.unwrap();
    drop(site);
    storage.close().await.unwrap();
    drop(storage);
    let report = upkeep::compact(directory.path(), "s").unwrap();
    assert!(report.num_bytes_after < report.num_bytes_before, "{report:?}");
    assert_eq!(report.num_commits, 60);
    let storage = storage_in(directory.path());
    let site = storage.open("s").await.unwrap();
    assert_eq!(site.scan(b"", b"", usize::MAX).await.unwrap(), before);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_site_of_the_first_format_is_brought_up_to_date() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("sites/s");
    let db = sled::open(&path).unwrap();
    db.insert(b"k", b"v").unwrap();
    db.flush().unwrap();
    drop(db);
    let storage = storage_in(directory.path());
    let site = storage.open("s").await.unwrap();
    assert_eq!(site.get(b"k").await.unwrap().as_deref(), Some(&b"v"[..]));
    assert_eq!(site.scan(b"", b"", 9).await.unwrap().len(), 1);
    site.commit(batch_of_one(), vec![]).await.unwrap();
    drop(site);
    storage.close().await.unwrap();
    drop(storage);
    let report = &upkeep::check(directory.path(), None, &|_, _| None).unwrap()[0];
    assert_eq!((report.num_acknowledged, report.num_commits, report.num_records), (1, 1, 2));
    assert!(report.problems.is_empty(), "{:?}", report.problems);
}

#[tokio::test(flavor = "multi_thread")]
async fn files_copied_while_commits_go_on_open_with_all_that_was_acknowledged() {
    // As a killed process leaves them: everything written is there, nothing was closed.
    let directory = tempfile::tempdir().unwrap();
    let storage = storage_in(directory.path());
    let site = storage.open("s").await.unwrap();
    for number in 0..40u32 {
        let mut batch = Batch::default();
        batch.put(number.to_be_bytes().to_vec(), vec![number as u8; 30_000]);
        site.commit(batch, vec![]).await.unwrap();
        if number % 8 == 7 {
            // A snapshot of the database may be replaced while it is copied; then the copy is made again.
            let whole_copy = |_| {
                let copied = tempfile::tempdir().unwrap();
                super::files::copy_tree(directory.path(), copied.path()).ok().map(|()| copied)
            };
            let copied = (0..20).find_map(whole_copy).unwrap();
            let killed = storage_in(copied.path());
            let reopened = killed.open("s").await.unwrap();
            assert_eq!(reopened.scan(b"", b"", 99).await.unwrap().len(), number as usize + 1);
        }
    }
}
