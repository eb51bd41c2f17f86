//! Stored records that hold something else: a site of such records is refused or serves what can be read, and harms no
//! other.

use std::sync::LazyLock;

use bolero::check;
use locution_fuzz::{Edit, Pair, TEST_TIME, edited, pairs_of, sealed, written};
use locution_tests::{Answer, TestServer, drive};
use reqwest::{Method, StatusCode};
use serde_json::json;
use tokio::runtime::Runtime;

/// What is asked of a site whose records are changed.
const QUESTIONS: [&str; 12] = [
    "",
    "/runs",
    "/runs/drive",
    "/runs/drive/scans?limit=5",
    "/runs/drive/observations?limit=5",
    "/runs/drive/words",
    "/runs/drive/trajectory?frame=map",
    "/map",
    "/map/grid.pgm",
    "/matches",
    "/labels",
    "/rooms",
];

/// One change: of which record, whether of its key, whether its checksum is made right again, and what.
type Change = (u16, bool, bool, Vec<Edit>);

fn changed(pairs: &[Pair], changes: &[Change]) -> Vec<Pair> {
    let mut pairs = pairs.to_vec();
    for (which, is_key, is_sealed, edits) in changes {
        let idx = usize::from(*which) % pairs.len();
        let pair = &mut pairs[idx];
        if *is_key {
            pair.key = edited(&pair.key, edits);
        } else {
            let value = edited(&pair.value, edits);
            pair.value = if *is_sealed { sealed(value) } else { value };
        }
    }
    pairs
}

/// A server with a site, and what that site holds.
struct Stored {
    runtime: Runtime,
    server: TestServer,
    pairs: Vec<Pair>,
}

impl Stored {
    fn filled() -> Self {
        let runtime = Runtime::new().expect("a runtime starts");
        let (server, pairs) = runtime.block_on(async {
            let server = TestServer::start().await;
            let api = &server.api;
            api.make_run("site", "drive").await;
            api.post_all("site", "drive", &drive(150, 3), 50).await;
            api.post("/v1/sites/site/runs/drive/finish", &json!({})).await.ok();
            api.post("/v1/sites/site/builds?wait=true", &json!({})).await.ok();
            let backup = api.get("/v1/sites/site/backup").await;
            assert!(backup.status.is_success());
            (server, pairs_of(&backup.bytes))
        });
        Self { runtime, server, pairs }
    }

    fn restore(&self, pairs: Vec<Pair>) -> Answer {
        let sent = self.server.api.send(Method::PUT, "/v1/sites/copy/backup", &[], written(pairs));
        self.runtime.block_on(sent).expect("an answer")
    }

    fn ask(&self, path: &str) -> Answer {
        self.runtime.block_on(self.server.api.get(path))
    }

    fn delete(&self) -> Answer {
        self.runtime.block_on(self.server.api.delete("/v1/sites/copy"))
    }
}

static STORED: LazyLock<Stored> = LazyLock::new(Stored::filled);

#[test]
fn changed_records_are_told_and_harm_no_other_site() {
    let restored = STORED.restore(STORED.pairs.clone());
    assert!(restored.status.is_success(), "the seed is refused: {}", restored.text());
    for question in QUESTIONS {
        let answer = STORED.ask(&format!("/v1/sites/copy{question}"));
        assert!(answer.status.is_success(), "{question}: {}", answer.text());
    }
    STORED.delete();
    check!().with_type::<Vec<Change>>().with_test_time(TEST_TIME * 3).for_each(|changes| {
        let changes = &changes[..changes.len().min(4)];
        if STORED.restore(changed(&STORED.pairs, changes)).status.is_success() {
            for question in QUESTIONS {
                let answer = STORED.ask(&format!("/v1/sites/copy{question}"));
                if answer.status == StatusCode::INTERNAL_SERVER_ERROR {
                    answer.problem(500, "corrupt");
                }
            }
        }
        let deleted = STORED.delete();
        assert!([204, 404].contains(&deleted.status.as_u16()), "{}", deleted.text());
        assert_eq!(STORED.ask("/v1/sites/site/runs/drive").ok()["num_scans"], 150);
    });
}
