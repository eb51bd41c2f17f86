//! Headers as other programs spell them, and bodies packed as they pack them.

use std::io::Write;

use flate2::Compression;
use flate2::write::GzEncoder;
use locution_tests::{Answer, TestServer, drive};
use reqwest::Method;
use serde_json::json;

const JSON: (&str, &str) = ("content-type", "application/json");

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(bytes).unwrap();
    gzip.finish().unwrap()
}

async fn put_site(server: &TestServer, headers: &[(&str, &str)], body: Vec<u8>) -> Answer {
    server.api.send(Method::PUT, "/v1/sites/t", headers, body).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn media_types_and_codings_do_not_depend_on_case() {
    let server = TestServer::start().await;
    for media_type in ["Application/JSON", "application/json; charset=utf-8", "APPLICATION/JSON ;v=1"] {
        put_site(&server, &[("content-type", media_type)], b"{}".to_vec()).await.ok();
    }
    for coding in ["gzip", "GZIP", "x-gzip", "X-Gzip"] {
        put_site(&server, &[JSON, ("content-encoding", coding)], gzip(b"{}")).await.ok();
    }
    put_site(&server, &[JSON, ("content-encoding", "Identity")], b"{}".to_vec()).await.ok();
    let problem =
        put_site(&server, &[JSON, ("content-encoding", "br")], b"{}".to_vec()).await.problem(415, "coding");
    let detail = problem["detail"].as_str().unwrap();
    assert!(["`br`", "gzip", "zstd"].iter().all(|word| detail.contains(word)), "{detail}");
    let problem =
        put_site(&server, &[("content-type", "text/csv")], b"{}".to_vec()).await.problem(415, "media-type");
    let detail = problem["detail"].as_str().unwrap();
    assert!(["`text/csv`", "application/json", "application/cbor"].iter().all(|word| detail.contains(word)));
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn gzip_bodies_of_several_members_are_read_whole() {
    let server = TestServer::start().await;
    server.api.make_run("a", "r").await;
    let body = json!({"first_sequence": 0, "scans": drive(20, 1)}).to_string().into_bytes();
    let packed = body.chunks(body.len() / 3).map(gzip).collect::<Vec<_>>();
    assert!(packed.len() >= 3);
    let headers = [JSON, ("content-encoding", "gzip")];
    let path = "/v1/sites/a/runs/r/batches";
    let receipt = server.api.send(Method::POST, path, &headers, packed.concat()).await.unwrap();
    assert_eq!(receipt.ok()["next_sequence"], 20);
    let cut_off = packed.concat()[..packed[0].len() + packed[1].len() / 2].to_vec();
    server.api.send(Method::POST, path, &headers, cut_off).await.unwrap().problem(400, "malformed-body");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_follows_a_document_of_cbor_is_refused() {
    let server = TestServer::start().await;
    server.api.make_run("a", "r").await;
    let batch = |first: usize| {
        let body = json!({"first_sequence": first, "scans": drive(20, 1)[first..first + 10]});
        let mut bytes = Vec::new();
        ciborium::into_writer(&body, &mut bytes).unwrap();
        bytes
    };
    let post = async |body: Vec<u8>| {
        let headers = [("content-type", "application/CBOR")];
        server.api.send(Method::POST, "/v1/sites/a/runs/r/batches", &headers, body).await.unwrap()
    };
    let problem = post([batch(0), batch(10)].concat()).await.problem(400, "malformed-body");
    assert!(problem["detail"].as_str().unwrap().contains("trailing"), "{problem}");
    post([batch(0), vec![0]].concat()).await.problem(400, "malformed-body");
    assert_eq!(post(batch(0)).await.ok()["next_sequence"], 10);
    server.stop().await;
}
