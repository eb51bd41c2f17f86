//! Questions by words, while runs grow, after they finish and after a restart.

use locution_tests::{Api, TestServer, drive};
use serde_json::{Value, json};

/// Asks for words as they stand in a text.
async fn ask(api: &Api, path: &str, words: &[Value]) -> Value {
    let words: Vec<Value> = words
        .iter()
        .map(|word| json!({"class": word["class"], "size": word["size"], "turn_rad": word["turn_rad"]}))
        .collect();
    api.post(path, &json!({"words": words, "limit": 100})).await.ok()
}

fn is_there(answers: &Value, run: &str, words: [usize; 2]) -> bool {
    answers.as_array().unwrap().iter().any(|answer| answer["run"] == run && answer["words"] == json!(words))
}

#[tokio::test(flavor = "multi_thread")]
async fn words_are_found_as_soon_as_they_are_written() {
    const IN_SITE: &str = "/v1/sites/a/queries/words";
    let server = TestServer::start().await;
    let api = &server.api;
    let scans = drive(900, 1);
    api.make_run("a", "r").await;
    assert_eq!(ask(api, IN_SITE, &[json!({})]).await, json!([]), "no words yet");
    for (idx, batch) in scans.chunks(150).enumerate() {
        api.post_batch("a", "r", idx * 150, batch).await.ok();
        let text = api.all("/v1/sites/a/runs/r/words").await;
        let Some(first) = text.len().checked_sub(3) else { continue };
        let answers = ask(api, IN_SITE, &text[first..]).await;
        assert!(is_there(&answers, "r", [first, first + 2]), "{first}: {answers}");
    }
    api.post("/v1/sites/a/runs/r/finish", &json!({})).await.ok();
    for (run, seed) in [("s", 2), ("t", 3)] {
        api.make_run("a", run).await;
        api.post_all("a", run, &drive(500, seed), 250).await;
        api.post(&format!("/v1/sites/a/runs/{run}/finish"), &json!({})).await.ok();
        // A question between the two makes the index take them up one by one.
        ask(api, IN_SITE, &[json!({}), json!({})]).await;
    }
    let text = api.all("/v1/sites/a/runs/s/words").await;
    let last = text.len() - 1;
    let before = ask(api, IN_SITE, &text[last - 2..]).await;
    assert!(
        is_there(&before, "s", [last - 2, last]),
        "the last word comes with the end of the run: {before}"
    );
    let anything = vec![json!({}); 3];
    let runs_before = ask(api, IN_SITE, &anything).await;
    let server = server.restart().await;
    assert_eq!(ask(&server.api, IN_SITE, &text[last - 2..]).await, before);
    assert_eq!(ask(&server.api, IN_SITE, &anything).await, runs_before);
    let everywhere = ask(&server.api, "/v1/queries/words", &text[last - 2..]).await;
    assert_eq!(everywhere, before);
    assert_eq!(everywhere[0]["site"], "a");
    server.stop().await;
}
