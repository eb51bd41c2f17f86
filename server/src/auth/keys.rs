//! Keys by their hashes: those of the configuration, and those issued by the API.
//!
//! Keys are 256 random bits, so one SHA-256 is enough; hashes are compared in constant time. A key is shown once, when it
//! is issued; only its hash is kept.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use rand::TryRng;
use rand::rngs::SysRng;
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

use super::issued::{IssuedKey, KeyFile, PreviousSecret};
use crate::app::AppError;
use crate::config::{ApiKeyConfig, Scope};

/// What keys begin with, so that one that got into a text by mistake can be found.
const TOKEN_PREFIX: &str = "loc_";

/// All keys that open this server.
pub struct Keys {
    table: RwLock<Table>,
    file: KeyFile,
    /// Held while issued keys are changed and written.
    changing: Mutex<()>,
}

#[derive(Default)]
struct Table {
    configured: Vec<Key>,
    issued: Vec<Key>,
}

struct Key {
    record: IssuedKey,
    hash: Vec<u8>,
    previous: Option<(Vec<u8>, u64)>,
    identity: Identity,
    budget: Arc<Mutex<Budget>>,
}

/// Requests that a key may still send now.
#[derive(Debug)]
struct Budget {
    num: f64,
    since: Instant,
}

/// Who is asking; an extension of every request.
#[derive(Clone, Debug)]
pub struct Identity {
    name: Arc<str>,
    is_local: bool,
    scope: Scope,
    sites: Arc<[String]>,
    num_localizations_max: Option<usize>,
}

/// Why nobody was identified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotIdentified {
    /// No key, or none that is known.
    Unknown,
    /// The key was valid until some time ago.
    Expired,
    /// The key asks more often than it may; it may ask again after so many seconds.
    TooOften(u64),
}

impl Identity {
    /// A sender by the parts of its key.
    pub(super) fn new(name: &str, scope: Scope, sites: &[&str]) -> Self {
        let sites = sites.iter().map(|site| (*site).to_owned()).collect();
        Self { name: Arc::from(name), is_local: false, scope, sites, num_localizations_max: None }
    }

    /// Whoever asks a server without keys, which is somebody on the same machine.
    pub(super) fn local() -> Self {
        Self { is_local: true, ..Self::new("local", Scope::Admin, &["*"]) }
    }

    fn of(config: &ApiKeyConfig) -> Self {
        Self {
            name: Arc::from(config.name.as_str()),
            is_local: false,
            scope: config.scope,
            sites: config.sites.iter().cloned().collect(),
            num_localizations_max: config.num_localizations_max,
        }
    }

    /// What the key is called.
    pub fn name(&self) -> &Arc<str> {
        &self.name
    }

    /// Whether this is nobody's key, but somebody on the machine of a server without keys.
    pub fn is_local(&self) -> bool {
        self.is_local
    }

    /// What it may do.
    pub fn scope(&self) -> Scope {
        self.scope
    }

    /// Whether a site may be touched at all.
    pub fn may_see(&self, site: &str) -> bool {
        self.sites.iter().any(|allowed| allowed == "*" || allowed == site)
    }

    /// Whether it may touch all that another list of sites allows.
    fn covers(&self, sites: &[String]) -> bool {
        sites.iter().all(|site| self.may_see(site))
    }

    /// Most localizations that it may have at once, when it has a limit of its own.
    pub fn num_localizations_max(&self) -> Option<usize> {
        self.num_localizations_max
    }
}

impl Budget {
    /// Spends one request, or says after how many seconds there is one to spend. Up to one second's worth is saved.
    fn spend(&mut self, per_s: f64) -> Result<(), u64> {
        let now = Instant::now();
        let saved = self.num + per_s * now.duration_since(self.since).as_secs_f64();
        self.num = saved.min(per_s.max(1.0));
        self.since = now;
        if self.num < 1.0 {
            return Err(((1.0 - self.num) / per_s).ceil().max(1.0) as u64);
        }
        self.num -= 1.0;
        Ok(())
    }
}

impl Key {
    fn new(record: IssuedKey) -> Self {
        let previous = record.previous.as_ref();
        Self {
            hash: decode_hex(&record.key.sha256),
            previous: previous.map(|previous| (decode_hex(&previous.sha256), previous.until_s)),
            identity: Identity::of(&record.key),
            budget: Arc::new(Mutex::new(Budget { num: f64::INFINITY, since: Instant::now() })),
            record,
        }
    }

    fn opens(&self, hash: &[u8], now_s: u64) -> bool {
        let is_current = bool::from(self.hash.as_slice().ct_eq(hash));
        let is_previous = self.previous.as_ref().is_some_and(|(previous, until_s)| {
            bool::from(previous.as_slice().ct_eq(hash)) && now_s < *until_s
        });
        is_current | is_previous
    }

    /// Whether it can do everything, now and for good.
    fn is_master(&self) -> bool {
        self.identity.scope == Scope::Admin
            && self.identity.may_see("*")
            && self.record.key.expires_at_s.is_none()
    }
}

impl Keys {
    /// The keys of a checked configuration, and those issued before.
    ///
    /// # Errors
    /// A file of issued keys that cannot be read.
    pub fn open(configs: &[ApiKeyConfig], data_directory: &Path) -> Result<Self, AppError> {
        let file = KeyFile::in_directory(data_directory);
        let issued = file.read()?.into_iter().map(Key::new).collect();
        let keys = Self {
            table: RwLock::new(Table { configured: Vec::new(), issued }),
            file,
            changing: Mutex::default(),
        };
        keys.configure(configs);
        Ok(keys)
    }

    /// Takes other keys of the configuration instead of those before.
    pub fn configure(&self, configs: &[ApiKeyConfig]) {
        let record =
            |config: &ApiKeyConfig| IssuedKey { key: config.clone(), created_at_s: 0, previous: None };
        let configured = configs.iter().map(record).map(Key::new).collect();
        self.table.write().unwrap_or_else(PoisonError::into_inner).configured = configured;
    }

    fn table(&self) -> RwLockReadGuard<'_, Table> {
        self.table.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether there are none, so that whoever is on this machine is let in.
    pub fn is_empty(&self) -> bool {
        let table = self.table();
        table.configured.is_empty() && table.issued.is_empty()
    }

    /// Whose key an `Authorization` header holds.
    ///
    /// # Errors
    /// Why it is nobody's.
    pub fn identify(&self, authorization: Option<&str>) -> Result<Identity, NotIdentified> {
        let (scheme, token) =
            authorization.and_then(|text| text.split_once(' ')).ok_or(NotIdentified::Unknown)?;
        if !scheme.eq_ignore_ascii_case("bearer") {
            return Err(NotIdentified::Unknown);
        }
        let (hash, now_s) = (Sha256::digest(token.trim().as_bytes()), now_s());
        let table = self.table();
        // Every key is compared, so that the time does not tell which one was near.
        let mut found = None;
        for key in table.configured.iter().chain(&table.issued) {
            if key.opens(&hash, now_s) {
                found = Some(key);
            }
        }
        let key = found.ok_or(NotIdentified::Unknown)?;
        if key.record.key.expires_at_s.is_some_and(|expires_at_s| expires_at_s <= now_s) {
            return Err(NotIdentified::Expired);
        }
        if let Some(per_s) = key.record.key.requests_per_s_max {
            let mut budget = key.budget.lock().unwrap_or_else(PoisonError::into_inner);
            budget.spend(per_s).map_err(NotIdentified::TooOften)?;
        }
        Ok(key.identity.clone())
    }

    /// The keys that somebody may manage, with whether each is of the configuration.
    pub fn list(&self, by: &Identity) -> Vec<(IssuedKey, bool)> {
        let table = self.table();
        let configured = table.configured.iter().map(|key| (key, true));
        let all = configured.chain(table.issued.iter().map(|key| (key, false)));
        all.filter(|(key, _)| by.covers(&key.record.key.sites))
            .map(|(key, own)| (key.record.clone(), own))
            .collect()
    }

    /// Issues a key that can do no more than who asks for it; `key.sha256` is filled in here.
    ///
    /// # Errors
    /// [`AppError::Exists`] for a name that is taken, [`AppError::Invalid`] for rights that are not had.
    pub fn issue(&self, by: &Identity, mut key: ApiKeyConfig) -> Result<(IssuedKey, String), AppError> {
        if !by.covers(&key.sites) {
            return Err(AppError::invalid(
                "sites",
                "a key cannot be given more sites than the key that makes it",
            ));
        }
        let (token, sha256) = new_token()?;
        key.sha256 = sha256;
        let record = IssuedKey { key, created_at_s: now_s(), previous: None };
        self.change(|configured, issued| {
            let is_first = configured.is_empty() && issued.is_empty();
            if is_first && !Key::new(record.clone()).is_master() {
                let problem =
                    "the first key must be of scope admin for all sites, or nobody could make others";
                return Err(AppError::invalid("scope", problem));
            }
            let mut known = configured.iter().map(|key| &key.record).chain(issued.iter());
            if known.any(|known| known.key.name == record.key.name) {
                return Err(AppError::Exists {
                    detail: format!("there is a key `{}` already", record.key.name),
                });
            }
            issued.push(record.clone());
            Ok(())
        })?;
        Ok((record, token))
    }

    /// Gives a key another secret; the one before opens for some seconds more.
    ///
    /// # Errors
    /// [`AppError::NotFound`], also for keys of the configuration and for keys that are not the asker's to manage.
    pub fn rotate(&self, by: &Identity, name: &str, grace_s: u64) -> Result<(IssuedKey, String), AppError> {
        let (token, sha256) = new_token()?;
        let record = self.change(|_, issued| {
            let known = find(by, issued, name)?;
            let until_s = now_s().saturating_add(grace_s);
            let previous = std::mem::replace(&mut known.key.sha256, sha256);
            known.previous = (grace_s > 0).then_some(PreviousSecret { sha256: previous, until_s });
            Ok(known.clone())
        })?;
        Ok((record, token))
    }

    /// Forgets a key; from now on it opens nothing.
    ///
    /// # Errors
    /// [`AppError::NotFound`] as for [`Self::rotate`]; [`AppError::Exists`] for the last key that can make others.
    pub fn revoke(&self, by: &Identity, name: &str) -> Result<(), AppError> {
        self.change(|configured, issued| {
            find(by, issued, name)?;
            issued.retain(|known| known.key.name != name);
            let is_master = |record: &IssuedKey| Key::new(record.clone()).is_master();
            if !configured.iter().any(Key::is_master) && !issued.iter().any(is_master) {
                let detail = "this is the last key that can make others; make another one first".to_owned();
                return Err(AppError::Exists { detail });
            }
            Ok(())
        })
    }

    /// Changes the issued keys, on disk and then here.
    fn change<T>(
        &self,
        change: impl FnOnce(&[Key], &mut Vec<IssuedKey>) -> Result<T, AppError>,
    ) -> Result<T, AppError> {
        let _turn = self.changing.lock().unwrap_or_else(PoisonError::into_inner);
        let mut issued: Vec<IssuedKey>;
        let answer = {
            let table = self.table();
            issued = table.issued.iter().map(|key| key.record.clone()).collect();
            change(&table.configured, &mut issued)?
        };
        self.file.write(&issued)?;
        let issued = issued.into_iter().map(Key::new).collect();
        self.table.write().unwrap_or_else(PoisonError::into_inner).issued = issued;
        Ok(answer)
    }
}

fn find<'a>(by: &Identity, issued: &'a mut [IssuedKey], name: &str) -> Result<&'a mut IssuedKey, AppError> {
    let is_meant = |known: &&mut IssuedKey| known.key.name == name && by.covers(&known.key.sites);
    issued.iter_mut().find(is_meant).ok_or_else(|| AppError::not_found("issued key", name))
}

/// A new key and its hash.
fn new_token() -> Result<(String, String), AppError> {
    let mut secret = [0; 32];
    SysRng.try_fill_bytes(&mut secret).map_err(AppError::internal)?;
    let token = format!("{TOKEN_PREFIX}{}", hex(&secret));
    let sha256 = hex(&Sha256::digest(token.as_bytes()));
    Ok((token, sha256))
}

pub(crate) fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn decode_hex(text: &str) -> Vec<u8> {
    let digit = |byte: u8| (byte as char).to_digit(16).unwrap_or(0) as u8;
    text.as_bytes()
        .chunks(2)
        .map(|pair| digit(pair[0]) << 4 | pair.get(1).map_or(0, |low| digit(*low)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn config(token: &str, scope: Scope, sites: &[&str]) -> ApiKeyConfig {
        let sites = sites.iter().map(|site| (*site).to_owned()).collect();
        let sha256 = hex(&Sha256::digest(token.as_bytes()));
        ApiKeyConfig { name: token.into(), sha256, scope, sites, ..ApiKeyConfig::default() }
    }

    fn opened(configs: &[ApiKeyConfig]) -> (tempfile::TempDir, Keys) {
        let directory = tempfile::tempdir().unwrap();
        let keys = Keys::open(configs, directory.path()).unwrap();
        (directory, keys)
    }

    #[test]
    fn keys_are_told_apart() {
        let (_directory, keys) =
            opened(&[config("one", Scope::Read, &["a"]), config("two", Scope::Admin, &["*"])]);
        let one = keys.identify(Some("Bearer one")).unwrap();
        assert!(one.may_see("a") && !one.may_see("b") && one.scope == Scope::Read);
        assert!(keys.identify(Some("Bearer two")).unwrap().may_see("b"));
        assert!(keys.identify(Some("bearer one")).is_ok() && keys.identify(Some("BEARER  one")).is_ok());
        for wrong in [None, Some("Bearer three"), Some("one"), Some("Bearer "), Some("Basic one")] {
            assert_eq!(keys.identify(wrong).unwrap_err(), NotIdentified::Unknown);
        }
    }

    #[test]
    fn an_issued_key_opens_until_it_is_revoked_also_after_a_restart() {
        let master = config("master", Scope::Admin, &["*"]);
        let (directory, keys) = opened(std::slice::from_ref(&master));
        let by = keys.identify(Some("Bearer master")).unwrap();
        let (record, token) = keys
            .issue(&by, ApiKeyConfig { sha256: String::new(), ..config("robot", Scope::Write, &["a"]) })
            .unwrap();
        assert!(token.starts_with(TOKEN_PREFIX) && !record.key.sha256.contains(&token));
        let header = format!("Bearer {token}");
        drop(keys);
        let keys = Keys::open(&[master], directory.path()).unwrap();
        assert_eq!(&**keys.identify(Some(&header)).unwrap().name(), "robot");
        keys.revoke(&by, "robot").unwrap();
        assert_eq!(keys.identify(Some(&header)).unwrap_err(), NotIdentified::Unknown);
        assert!(matches!(keys.revoke(&by, "robot"), Err(AppError::NotFound { .. })));
    }

    #[test]
    fn a_rotated_key_keeps_its_old_secret_only_as_long_as_asked() {
        let (_directory, keys) = opened(&[config("master", Scope::Admin, &["*"])]);
        let by = keys.identify(Some("Bearer master")).unwrap();
        let (_, first) = keys.issue(&by, config("robot", Scope::Read, &["*"])).unwrap();
        let (_, second) = keys.rotate(&by, "robot", 60).unwrap();
        let opens = |token: &str| keys.identify(Some(&format!("Bearer {token}"))).is_ok();
        assert!(opens(&first) && opens(&second));
        let (_, third) = keys.rotate(&by, "robot", 0).unwrap();
        assert!(!opens(&first) && !opens(&second) && opens(&third));
    }

    #[test]
    fn nobody_gives_away_more_than_he_has_and_nobody_locks_all_out() {
        let (_directory, keys) = opened(&[]);
        let local = Identity::local();
        assert!(keys.issue(&local, config("robot", Scope::Write, &["*"])).is_err());
        keys.issue(&local, config("boss", Scope::Admin, &["*"])).unwrap();
        keys.issue(&local, config("caretaker", Scope::Admin, &["a"])).unwrap();
        assert!(keys.issue(&local, config("boss", Scope::Read, &["a"])).is_err());
        let caretaker = Identity::new("caretaker", Scope::Admin, &["a"]);
        assert!(keys.issue(&caretaker, config("spy", Scope::Read, &["b"])).is_err());
        assert!(keys.issue(&caretaker, config("spy", Scope::Read, &["*"])).is_err());
        keys.issue(&caretaker, config("robot", Scope::Write, &["a"])).unwrap();
        assert!(keys.revoke(&caretaker, "boss").is_err() && keys.rotate(&caretaker, "boss", 0).is_err());
        assert_eq!(keys.list(&caretaker).len(), 2);
        assert!(keys.revoke(&local, "boss").is_err());
        keys.revoke(&caretaker, "robot").unwrap();
    }

    #[test]
    fn keys_expire_and_are_held_to_their_rate() {
        let expired = ApiKeyConfig { expires_at_s: Some(1), ..config("old", Scope::Read, &["*"]) };
        let slow = ApiKeyConfig { requests_per_s_max: Some(2.0), ..config("slow", Scope::Read, &["*"]) };
        let (_directory, keys) = opened(&[expired, slow]);
        assert_eq!(keys.identify(Some("Bearer old")).unwrap_err(), NotIdentified::Expired);
        let answers: Vec<_> = (0..4).map(|_| keys.identify(Some("Bearer slow"))).collect();
        assert!(answers[0].is_ok() && answers[1].is_ok());
        assert_eq!(*answers[3].as_ref().unwrap_err(), NotIdentified::TooOften(1));
    }

    proptest! {
        #[test]
        fn no_header_but_the_key_itself_opens(header in ".{0,80}") {
            let (_directory, keys) = opened(&[config("one", Scope::Read, &["a"])]);
            let is_key = header.split_once(' ').is_some_and(|(scheme, token)| {
                scheme.eq_ignore_ascii_case("bearer") && token.trim() == "one"
            });
            prop_assert_eq!(keys.identify(Some(&header)).is_ok(), is_key);
        }
    }
}
