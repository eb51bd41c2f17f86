//! Harness of the tests through the front door: a server of one's own, a robot to drive, requests by hand.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::path::PathBuf;

use locution_server::config::ServerConfig;
use locution_server::{RunningServer, StartError, start_server};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A server on a port of its own over a directory of its own.
pub struct TestServer {
    server: RunningServer,
    directory: TempDir,
    config: ServerConfig,
    /// Speaks to it.
    pub api: Api,
}

impl TestServer {
    /// Starts one with the defaults, but no automatic builds.
    pub async fn start() -> Self {
        Self::start_with(|_| {}).await
    }

    /// Starts one after `adjust` had its say.
    pub async fn start_with(adjust: impl FnOnce(&mut ServerConfig)) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut config = ServerConfig { address: "127.0.0.1:0".parse().unwrap(), ..Default::default() };
        config.builds.is_automatic = false;
        adjust(&mut config);
        config.data_directory = directory.path().to_owned();
        let server = start_server(config.clone()).await.unwrap();
        let api = Api::new(server.url());
        Self { server, directory, config, api }
    }

    /// Where its data is.
    pub fn directory(&self) -> &std::path::Path {
        self.directory.path()
    }

    /// Stops it in order and starts it again over the same directory.
    pub async fn restart(self) -> Self {
        self.restart_after(|| {}).await
    }

    /// The same, with something done to the directory in between.
    pub async fn restart_after(self, meanwhile: impl FnOnce()) -> Self {
        self.server.shutdown().await.unwrap();
        meanwhile();
        let server = start_server(self.config.clone()).await.unwrap();
        let api = Api { base: server.url(), ..self.api };
        Self { server, directory: self.directory, config: self.config, api }
    }

    /// Reads keys and certificates again after `adjust` had its say, as SIGHUP does.
    pub fn reload(&self, adjust: impl FnOnce(&mut ServerConfig)) -> Result<(), StartError> {
        let mut config = self.config.clone();
        adjust(&mut config);
        self.server.reload(&config)
    }

    /// Stops it in order.
    pub async fn stop(self) {
        self.server.shutdown().await.unwrap();
    }
}

/// The binary named by `LOCUTION_BIN`, else built here in the profile of the tests.
pub fn locution_binary() -> PathBuf {
    if let Some(path) = std::env::var_os("LOCUTION_BIN") {
        return path.into();
    }
    let build = escargot::CargoBuild::new().package("locution-cli").bin("locution");
    let is_release = std::env::current_exe().unwrap().iter().any(|folder| folder == "release");
    let build = if is_release { build.release() } else { build };
    // What cargo tells a test of its package would have build scripts run anew, and all that needs them compiled again.
    let of_this_test = std::env::vars_os().map(|(name, _)| name).filter(|name| {
        let name = name.to_string_lossy();
        ["CARGO_PKG_", "CARGO_MANIFEST_", "CARGO_BIN_", "CARGO_CRATE_"]
            .iter()
            .any(|start| name.starts_with(start))
    });
    let build = of_this_test.fold(build, |build, name| build.env_remove(name));
    build.run().unwrap().path().to_owned()
}

/// Requests by hand, so that tests see what any client would see.
#[derive(Clone)]
pub struct Api {
    /// `http://address`.
    pub base: String,
    /// Sent as bearer token when set.
    pub key: Option<String>,
    http: reqwest::Client,
}

/// Status, headers and body of an answer.
#[derive(Debug)]
pub struct Answer {
    /// The status.
    pub status: StatusCode,
    /// The headers.
    pub headers: reqwest::header::HeaderMap,
    /// The body as sent.
    pub bytes: Vec<u8>,
}

impl Answer {
    /// The body as JSON; null when it is not.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.bytes).unwrap_or(Value::Null)
    }

    /// The body as text.
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.bytes).into_owned()
    }

    /// The body as JSON after checking that all went well.
    #[track_caller]
    pub fn ok(&self) -> Value {
        assert!(self.status.is_success(), "{}: {}", self.status, self.text());
        self.json()
    }

    /// Checks that this is a problem of a status and type, and gives its body.
    #[track_caller]
    pub fn problem(&self, status: u16, slug: &str) -> Value {
        let body = self.json();
        assert_eq!(self.status.as_u16(), status, "{}", self.text());
        assert_eq!(self.headers["content-type"], "application/problem+json");
        assert_eq!(body["status"], status);
        assert_eq!(body["type"], format!("https://locution.dev/problems/{slug}"), "{}", self.text());
        assert!(body["title"].is_string() && body["detail"].is_string());
        body
    }
}

impl Api {
    /// Speaks to a server.
    pub fn new(base: String) -> Self {
        locution_client::choose_ciphers();
        Self { base, key: None, http: reqwest::Client::new() }
    }

    /// The same server with another key.
    pub fn with_key(&self, key: &str) -> Self {
        Self { key: Some(key.to_owned()), ..self.clone() }
    }

    /// A request with everything chosen by hand; an error means that no answer came.
    pub async fn send(
        &self,
        method: Method,
        path: &str,
        headers: &[(&str, &str)],
        body: Vec<u8>,
    ) -> reqwest::Result<Answer> {
        let mut request = self.http.request(method, format!("{}{path}", self.base)).body(body);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        if let Some(key) = &self.key {
            request = request.bearer_auth(key);
        }
        let response = request.send().await?;
        let (status, headers) = (response.status(), response.headers().clone());
        Ok(Answer { status, headers, bytes: response.bytes().await?.to_vec() })
    }

    /// GET.
    pub async fn get(&self, path: &str) -> Answer {
        self.send(Method::GET, path, &[], Vec::new()).await.unwrap()
    }

    /// GET as plain text.
    pub async fn get_text(&self, path: &str) -> String {
        let answer = self.send(Method::GET, path, &[("accept", "text/plain")], Vec::new()).await.unwrap();
        assert!(answer.status.is_success(), "{}", answer.text());
        answer.text()
    }

    /// PUT of JSON.
    pub async fn put(&self, path: &str, body: &Value) -> Answer {
        let body = serde_json::to_vec(body).unwrap();
        self.send(Method::PUT, path, &[("content-type", "application/json")], body).await.unwrap()
    }

    /// POST of JSON.
    pub async fn post(&self, path: &str, body: &Value) -> Answer {
        let body = serde_json::to_vec(body).unwrap();
        self.send(Method::POST, path, &[("content-type", "application/json")], body).await.unwrap()
    }

    /// DELETE.
    pub async fn delete(&self, path: &str) -> Answer {
        self.send(Method::DELETE, path, &[], Vec::new()).await.unwrap()
    }

    /// Makes a site and a run with the geometry of [`drive`].
    pub async fn make_run(&self, site: &str, run: &str) {
        self.put(&format!("/v1/sites/{site}"), &json!({})).await.ok();
        self.put(&format!("/v1/sites/{site}/runs/{run}"), &json!({"geometry": geometry()})).await.ok();
    }

    /// Posts a batch.
    pub async fn post_batch(&self, site: &str, run: &str, first: usize, scans: &[Value]) -> Answer {
        let body = json!({"first_sequence": first, "scans": scans});
        self.post(&format!("/v1/sites/{site}/runs/{run}/batches"), &body).await
    }

    /// Posts all scans in batches of `size` and checks each answer.
    pub async fn post_all(&self, site: &str, run: &str, scans: &[Value], size: usize) {
        for (idx, chunk) in scans.chunks(size).enumerate() {
            let receipt = self.post_batch(site, run, idx * size, chunk).await.ok();
            assert_eq!(receipt["next_sequence"], idx * size + chunk.len());
        }
    }

    /// All items of a paged list.
    pub async fn all(&self, path: &str) -> Vec<Value> {
        let mut items = Vec::new();
        let mut cursor = String::new();
        loop {
            let join = if path.contains('?') { '&' } else { '?' };
            let page = self.get(&format!("{path}{join}limit=1000{cursor}")).await.ok();
            items.extend(page["items"].as_array().unwrap().iter().cloned());
            match page["next_cursor"].as_str() {
                Some(next) => cursor = format!("&cursor={next}"),
                None => return items,
            }
        }
    }
}

const NUM_RANGES: usize = 90;
const RANGE_MAX_M: f64 = 20.0;

/// The laser of the robot that [`drive`] simulates.
pub fn geometry() -> Value {
    geometry_with(NUM_RANGES)
}

/// The same with another number of beams.
pub fn geometry_with(num_ranges: usize) -> Value {
    json!({
        "num_ranges": num_ranges,
        "angle_min_rad": -PI / 2.0,
        "angle_increment_rad": PI / (num_ranges - 1) as f64,
        "range_max_m": RANGE_MAX_M,
        "robot_from_laser": {"x": 0.1, "y": 0.0, "theta": 0.0},
    })
}

/// Scans of a robot that circles through a ring of corridors with alcoves, with noise from a seed.
pub fn drive(num_scans: usize, seed: u64) -> Vec<Value> {
    drive_with(num_scans, seed, NUM_RANGES)
}

/// The same with another number of beams.
pub fn drive_with(num_scans: usize, seed: u64, num_ranges: usize) -> Vec<Value> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let walls = walls();
    let mut scans = Vec::with_capacity(num_scans);
    let (mut x, mut y, mut theta) = (2.0f64, 1.0f64, 0.0f64);
    for idx in 0..num_scans {
        let laser = (x + 0.1 * theta.cos(), y + 0.1 * theta.sin());
        let ranges: Vec<Value> = (0..num_ranges)
            .map(|beam| {
                let angle = theta - PI / 2.0 + PI * beam as f64 / (num_ranges - 1) as f64;
                let range_m = cast(&walls, laser, angle) + rng.random_range(-0.01..0.01);
                if range_m < RANGE_MAX_M { json!((range_m * 1000.0).round() / 1000.0) } else { Value::Null }
            })
            .collect();
        scans.push(json!({
            "timestamp_ns": 1_000_000_000i64 + idx as i64 * 100_000_000 + rng.random_range(-40_000_000..40_000_000),
            "odom_from_robot": {"x": x, "y": y, "theta": theta},
            "ranges_m": ranges,
        }));
        (x, y, theta) = step(x, y, theta);
    }
    scans
}

/// One step along the ring, turning on the spot at its corners.
fn step(x: f64, y: f64, theta: f64) -> (f64, f64, f64) {
    let targets = [(18.0, 1.0, 0.0), (18.0, 9.0, PI / 2.0), (2.0, 9.0, PI), (2.0, 1.0, -PI / 2.0)];
    let side = targets.iter().position(|target| (target.2 - theta).abs() < 0.4).unwrap_or(0);
    let (to_x, to_y, heading) = targets[side];
    let distance = f64::hypot(to_x - x, to_y - y);
    if distance > 0.08 {
        let pull = (0.5 * (f64::atan2(to_y - y, to_x - x) - heading)).clamp(-0.05, 0.05);
        let theta = heading + pull;
        return (x + 0.08 * theta.cos(), y + 0.08 * theta.sin(), heading);
    }
    let next = targets[(side + 1) % 4].2;
    (x, y, next)
}

type Wall = ((f64, f64), (f64, f64));

fn walls() -> Vec<Wall> {
    let mut walls = Vec::new();
    let mut rectangle = |x0: f64, y0: f64, x1: f64, y1: f64| {
        let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
        walls.extend((0..4).map(|idx| (corners[idx], corners[(idx + 1) % 4])));
    };
    rectangle(0.0, 0.0, 20.0, 10.0);
    rectangle(4.0, 2.5, 9.0, 7.5);
    rectangle(11.0, 2.0, 16.0, 8.0);
    rectangle(6.0, 0.0, 7.0, 0.3);
    rectangle(13.0, 9.6, 15.0, 10.0);
    walls
}

/// Distance along a ray to the nearest wall, metres; infinite when it meets none.
fn cast(walls: &[Wall], from: (f64, f64), angle_rad: f64) -> f64 {
    let (dy, dx) = angle_rad.sin_cos();
    let hit = |((ax, ay), (bx, by)): &Wall| {
        let (ex, ey) = (bx - ax, by - ay);
        let cross = dx * ey - dy * ex;
        let along = ((ax - from.0) * ey - (ay - from.1) * ex) / cross;
        let share = ((ax - from.0) * dy - (ay - from.1) * dx) / cross;
        (cross.abs() > 1e-12 && along > 0.0 && (0.0..=1.0).contains(&share)).then_some(along)
    };
    walls.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
}
