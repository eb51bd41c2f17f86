//! Which servers live and who serves which site, agreed through one small object for each server.
//!
//! Every server writes its object anew at each beat and lists those of the others. One whose object has not changed for
//! a lease is gone; one that could not renew its own for three quarters of it takes itself for gone and serves nothing.
//! Only changes and durations are looked at, never a clock of another machine.
//!
//! An object also says which servers its writer acts upon, its view. Whoever changes its view first lets go of the
//! sites that it loses, then says so, then reads what the others say. It serves a site that it has gained only when no
//! other one still claims it; one that it had before and after, all along. Of two servers that claim one site at the
//! least one has read the other's claim, since both wrote before they read. So no site is served twice, and an answer
//! never lags behind what another server acknowledged.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use futures::TryStreamExt;
use futures::future::{BoxFuture, try_join_all};
use object_store::path::Path;
use object_store::{Error, ObjectMeta, ObjectStore, ObjectStoreExt};
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

use super::placement;

/// What a server that is gone left behind is cleared away after this many leases.
const FORGOTTEN_AFTER_LEASES: u32 = 20;

/// More changes in a row than this, and no site counts as served without a break.
const NUM_VIEWS_HELD_MAX: usize = 8;

/// What a server says of itself.
#[derive(Serialize, Deserialize)]
struct Statement {
    /// Where others reach it.
    url: String,
    /// Makes every beat another object.
    beat: u64,
    /// The servers that it takes for living, itself included.
    view: BTreeSet<String>,
}

/// Another server, as seen from here.
struct Other {
    object: ObjectMeta,
    changed_at: Instant,
    url: Option<String>,
    /// Its view, read after this server last stated its own.
    view: Option<BTreeSet<String>>,
}

#[derive(Default)]
struct State {
    others: HashMap<String, Other>,
    view: BTreeSet<String>,
    /// Views acted upon since all servers last agreed, the oldest first: a site that every one of them gives to this
    /// server was served by it without a break.
    held: Vec<BTreeSet<String>>,
    num_beats: u64,
    /// When the last round began that went well.
    renewed_at: Option<Instant>,
}

/// The servers of one store, seen from one of them.
pub struct Members {
    store: Arc<dyn ObjectStore>,
    directory: Path,
    me: String,
    url: String,
    lease: Duration,
    state: Mutex<State>,
}

/// Who serves a site.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Owner {
    /// This server.
    Me,
    /// Another one, at this address.
    Other(String),
    /// Nobody just now: it is on its way from one server to another, or this one does not reach the store.
    Nobody,
}

impl Members {
    /// A server that others reach at an address. `me` is drawn at its start: a server that starts again is another one.
    pub fn new(store: Arc<dyn ObjectStore>, prefix: &Path, me: String, url: String, lease: Duration) -> Self {
        let directory = prefix.clone().join("servers");
        Self { store, directory, me, url, lease, state: Mutex::default() }
    }

    /// How long the others wait for a server that falls silent.
    pub fn lease(&self) -> Duration {
        self.lease
    }

    /// How long to wait until the next round: shorter while servers do not agree.
    pub fn interval(&self) -> Duration {
        if self.is_settled() { self.lease / 4 } else { self.lease / 12 }
    }

    /// Whether every server that lives is known to act upon the same view.
    pub fn is_settled(&self) -> bool {
        self.state().is_settled()
    }

    /// One round: sees who lives, says so, and reads what the others say. `let_go` is called before a changed view is
    /// stated, and after a lapse; when it returns this server must have closed every site that is not its own by
    /// [`Members::owner`].
    ///
    /// # Errors
    /// Those of the store. What was known stands until three quarters of the lease are over.
    pub async fn renew<'a>(&self, let_go: impl Fn() -> BoxFuture<'a, ()>) -> Result<(), Error> {
        let started = Instant::now();
        let objects: Vec<ObjectMeta> = self.store.list(Some(&self.directory)).try_collect().await?;
        let forgotten = self.see(&objects, started);
        if self.change_view(started) {
            let_go().await;
        }
        self.state_view().await?;
        if self.begin_anew_after_lapse() {
            let_go().await;
        }
        self.read_views().await?;
        {
            let mut state = self.state();
            state.renewed_at = Some(started);
            if state.is_settled() {
                state.held.clear();
            }
        }
        for object in forgotten {
            if let Err(error) = self.store.delete(&object).await {
                tracing::debug!(%error, %object, "what a lost server left could not be removed");
            }
        }
        Ok(())
    }

    /// Says that this server is gone, so that the others need not wait for its lease to end.
    pub async fn leave(&self) {
        *self.state() = State::default();
        if let Err(error) = self.store.delete(&self.path(&self.me)).await {
            tracing::warn!(%error, "the others will notice only by the lease that this server has left");
        }
    }

    /// Who serves a site.
    pub fn owner(&self, site: &str) -> Owner {
        let state = self.state();
        // A lease runs from when the others saw the last beat, which was later than its round began.
        if state.renewed_at.is_none_or(|renewed_at| self.is_over(renewed_at)) {
            return Owner::Nobody;
        }
        match placement::owner(site, &state.view) {
            Some(id) if id == self.me => {
                let is_mine = |view| placement::owner(site, view) == Some(id);
                if !state.held.is_empty() && state.held.iter().all(is_mine) {
                    return Owner::Me;
                }
                let claims = |(id, other): (&str, &Other)| match &other.view {
                    Some(view) => *view != state.view && placement::owner(site, view) == Some(id),
                    None => true,
                };
                if state.living().any(claims) { Owner::Nobody } else { Owner::Me }
            }
            Some(id) => {
                let url = state.others.get(id).and_then(|other| other.url.clone());
                url.map_or(Owner::Nobody, Owner::Other)
            }
            None => Owner::Nobody,
        }
    }

    /// Takes in a listing; answers what is so old that nobody needs it.
    fn see(&self, objects: &[ObjectMeta], now: Instant) -> Vec<Path> {
        let mut state = self.state();
        let mut seen = HashMap::new();
        let mut forgotten = Vec::new();
        for object in objects {
            let Some(id) = object.location.filename().filter(|id| *id != self.me) else { continue };
            let (before, object) = (state.others.remove(id), object.clone());
            let other = match before {
                Some(other) if other.object == object => other,
                Some(other) => Other { object, changed_at: now, ..other },
                None => Other { object, changed_at: now, url: None, view: None },
            };
            if now - other.changed_at > self.lease * FORGOTTEN_AFTER_LEASES {
                forgotten.push(other.object.location.clone());
            }
            seen.insert(id.to_owned(), other);
        }
        state.others = seen;
        forgotten
    }

    /// Acts upon those who live from now on; true when that is another set than before.
    fn change_view(&self, now: Instant) -> bool {
        let mut state = self.state();
        let lives = |other: &Other| now - other.changed_at <= self.lease;
        let living = state.others.iter().filter(|(_, other)| lives(other)).map(|(id, _)| id.clone());
        let view: BTreeSet<String> = living.chain([self.me.clone()]).collect();
        if view == state.view {
            return false;
        }
        tracing::info!(num_servers = view.len(), "the servers of the store have changed");
        let is_settled = state.is_settled();
        let before = std::mem::replace(&mut state.view, view);
        if is_settled {
            state.held = vec![before];
        } else if !state.held.is_empty() {
            state.held.push(before);
            if state.held.len() > NUM_VIEWS_HELD_MAX {
                state.held.clear();
            }
        }
        for other in state.others.values_mut() {
            other.view = None;
        }
        true
    }

    /// Whether a lease that was renewed then is over for this server.
    fn is_over(&self, renewed_at: Instant) -> bool {
        renewed_at.elapsed() > self.lease * 3 / 4
    }

    /// When this server has just come back after the others may have taken it for gone, what it knew of their claims is
    /// from before; true then. It asks only once it has said that it lives, since a round may take long.
    fn begin_anew_after_lapse(&self) -> bool {
        let mut state = self.state();
        let has_lapsed = state.renewed_at.is_some_and(|renewed_at| self.is_over(renewed_at));
        if has_lapsed {
            tracing::warn!("the others may have taken this server for gone");
            state.renewed_at = None;
            state.held.clear();
            for other in state.others.values_mut() {
                other.view = None;
            }
        }
        has_lapsed
    }

    async fn state_view(&self) -> Result<(), Error> {
        let statement = {
            let mut state = self.state();
            state.num_beats += 1;
            Statement { url: self.url.clone(), beat: state.num_beats, view: state.view.clone() }
        };
        let bytes = serde_json::to_vec(&statement)
            .map_err(|error| Error::Generic { store: "servers", source: Box::new(error) })?;
        self.store.put(&self.path(&self.me), bytes.into()).await.map(|_| ())
    }

    /// Reads what those say who are not known to act upon the same view.
    async fn read_views(&self) -> Result<(), Error> {
        let unsure: Vec<String> = {
            let state = self.state();
            let differs = |other: &Other| other.view.as_ref() != Some(&state.view);
            state.living().filter(|(_, other)| differs(other)).map(|(id, _)| id.to_owned()).collect()
        };
        let read = try_join_all(unsure.iter().map(|id| self.read(id))).await?;
        let mut state = self.state();
        for (id, statement) in unsure.iter().zip(read) {
            if let (Some(other), Some(statement)) = (state.others.get_mut(id), statement) {
                other.url = Some(statement.url);
                other.view = Some(statement.view);
            }
        }
        Ok(())
    }

    /// What a server says; `None` when it left in this moment or wrote what is no statement.
    async fn read(&self, id: &str) -> Result<Option<Statement>, Error> {
        let bytes = match self.store.get(&self.path(id)).await {
            Ok(found) => found.bytes().await?,
            Err(Error::NotFound { .. }) => return Ok(None),
            Err(error) => return Err(error),
        };
        Ok(serde_json::from_slice(&bytes).ok())
    }

    fn path(&self, id: &str) -> Path {
        self.directory.clone().join(id)
    }

    /// Each statement under this lock leaves the state whole.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn is_settled(&self) -> bool {
        self.renewed_at.is_some() && self.living().all(|(_, other)| other.view.as_ref() == Some(&self.view))
    }

    /// The other servers of the view.
    fn living(&self) -> impl Iterator<Item = (&str, &Other)> {
        self.others.iter().filter(|(id, _)| self.view.contains(*id)).map(|(id, other)| (id.as_str(), other))
    }
}

#[cfg(test)]
mod tests {
    use object_store::memory::InMemory;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const LEASE: Duration = Duration::from_secs(8);
    const NUM_SITES: usize = 40;

    fn server(store: &Arc<dyn ObjectStore>, id: &str) -> Members {
        let (prefix, url) = (Path::from("fleet"), format!("http://{id}"));
        Members::new(Arc::clone(store), &prefix, id.to_owned(), url, LEASE)
    }

    fn sites() -> impl Iterator<Item = String> {
        (0..NUM_SITES).map(|site| format!("site-{site}"))
    }

    async fn renew(servers: &[&Members]) {
        for server in servers {
            server.renew(|| Box::pin(async {})).await.unwrap();
        }
    }

    fn num_served(server: &Members) -> usize {
        sites().filter(|site| server.owner(site) == Owner::Me).count()
    }

    #[tokio::test(start_paused = true)]
    async fn servers_come_to_agree_and_share_all_sites() {
        let store: Arc<dyn ObjectStore> = Arc::new(InMemory::new());
        let (a, b) = (server(&store, "a"), server(&store, "b"));
        assert_eq!(a.owner("site-1"), Owner::Nobody);
        renew(&[&a]).await;
        assert_eq!(num_served(&a), NUM_SITES);
        renew(&[&b]).await;
        assert_eq!(num_served(&b), 0, "the first one still claims them");
        renew(&[&a]).await;
        assert!(num_served(&a) > 5, "what stays with it is served all along");
        renew(&[&b, &a]).await;
        assert!(a.is_settled() && b.is_settled());
        assert!(num_served(&a) > 5 && num_served(&a) + num_served(&b) == NUM_SITES);
        for site in sites().filter(|site| a.owner(site) != Owner::Me) {
            assert_eq!(a.owner(&site), Owner::Other("http://b".into()));
        }
        b.leave().await;
        assert_eq!(num_served(&b), 0);
        renew(&[&a]).await;
        assert_eq!(num_served(&a), NUM_SITES);
    }

    #[tokio::test(start_paused = true)]
    async fn one_that_falls_silent_is_gone_first_for_itself_and_then_for_the_others() {
        let store: Arc<dyn ObjectStore> = Arc::new(InMemory::new());
        let (a, b) = (server(&store, "a"), server(&store, "b"));
        renew(&[&a, &b, &a, &b]).await;
        let is_shared = |server: &Members| (1..NUM_SITES).contains(&num_served(server));
        assert!(is_shared(&a) && is_shared(&b));
        for _ in 0..6 {
            tokio::time::advance(LEASE / 8).await;
            renew(&[&a]).await;
        }
        tokio::time::advance(LEASE / 100).await;
        assert!(num_served(&b) == 0 && is_shared(&a), "nobody serves what was its own");
        tokio::time::advance(LEASE * 3 / 8).await;
        renew(&[&a]).await;
        assert_eq!(num_served(&a), NUM_SITES);
        tokio::time::advance(LEASE / 8).await;
        renew(&[&b]).await;
        assert_eq!(num_served(&b), 0, "it comes back and finds its sites claimed");
        for _ in 0..FORGOTTEN_AFTER_LEASES + 2 {
            tokio::time::advance(LEASE).await;
            renew(&[&a]).await;
        }
        renew(&[&a]).await;
        assert_eq!(store.list(None).try_collect::<Vec<_>>().await.unwrap().len(), 1, "nothing of it is left");
    }

    /// Rounds of several servers in any order, some falling silent, some new: never is a site served twice.
    #[tokio::test(start_paused = true)]
    async fn no_site_is_ever_served_by_two() {
        for seed in 0..30 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let store: Arc<dyn ObjectStore> = Arc::new(InMemory::new());
            let servers: Vec<Members> = (0..4).map(|id| server(&store, &format!("server-{id}"))).collect();
            let mut is_silent = [false; 4];
            let mut num_moments_served = 0;
            for _ in 0..150 {
                let idx = rng.random_range(0..servers.len());
                match rng.random_range(0..20) {
                    0 => is_silent[idx] = !is_silent[idx],
                    1 => servers[idx].leave().await,
                    _ if is_silent[idx] => {}
                    _ => renew(&[&servers[idx]]).await,
                }
                tokio::time::advance(LEASE.mul_f64(rng.random_range(0.0..0.1))).await;
                for site in sites().take(8) {
                    let num_owners = servers.iter().filter(|server| server.owner(&site) == Owner::Me).count();
                    assert!(num_owners <= 1, "{site} is served by {num_owners} servers, seed {seed}");
                    num_moments_served += num_owners;
                }
            }
            assert!(num_moments_served > 100, "hardly anything was served: {num_moments_served}");
        }
    }
}
