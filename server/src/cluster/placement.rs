//! Which server serves a site: rendezvous hashing, so that a server that comes or goes moves only its own share.

use sha2::{Digest, Sha256};

/// The server that a site belongs to, `None` without servers.
pub(super) fn owner<'a>(site: &str, servers: impl IntoIterator<Item = &'a String>) -> Option<&'a str> {
    let weight = |server: &str| {
        let mut hash = Sha256::new();
        hash.update(site.as_bytes());
        // No name of a site holds a zero byte, so no two pairs read the same.
        hash.update([0]);
        hash.update(server.as_bytes());
        <[u8; 32]>::from(hash.finalize())
    };
    servers.into_iter().map(String::as_str).max_by_key(|server| weight(server))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owners(servers: &[&str]) -> Vec<String> {
        let servers: Vec<String> = servers.iter().map(|server| (*server).to_owned()).collect();
        (0..3_000).map(|site| owner(&format!("site-{site}"), &servers).unwrap().to_owned()).collect()
    }

    #[test]
    fn sites_are_shared_evenly() {
        let servers = ["a", "b", "c"];
        for server in servers {
            let num_sites = owners(&servers).iter().filter(|owner| *owner == server).count();
            assert!((850..1_150).contains(&num_sites), "{server} has {num_sites} of 3000");
        }
        assert_eq!(owner("site", &[]), None);
    }

    #[test]
    fn the_order_of_servers_does_not_matter_and_only_sites_of_a_lost_one_move() {
        let (all, turned) = (owners(&["a", "b", "c"]), owners(&["c", "a", "b"]));
        assert_eq!(all, turned);
        for (before, after) in all.iter().zip(owners(&["a", "c"])) {
            assert!(*before == after || before == "b");
        }
    }
}
