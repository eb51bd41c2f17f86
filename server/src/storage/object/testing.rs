//! Doubles of an object store for tests: one in memory that can be made to misbehave, and one that speaks S3 over HTTP.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use async_trait::async_trait;
use axum::Router;
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{HeaderMap, Method, StatusCode, Uri, header};
use axum::response::Response;
use bytes::Bytes;
use futures::stream::BoxStream;
use futures::{StreamExt, TryStreamExt, stream};
use object_store::aws::AmazonS3Builder;
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{
    Attribute, Attributes, CopyOptions, Error, GetOptions, GetRange, GetResult, ListResult, MultipartUpload,
    ObjectMeta, ObjectStore, ObjectStoreExt, PutMode, PutMultipartOptions, PutOptions, PutPayload, PutResult,
    Result, UpdateVersion,
};
use tokio::sync::watch;

/// A store in memory that counts what it is asked, and can stall writes or ignore preconditions.
#[derive(Debug)]
pub(crate) struct TestStore {
    inner: InMemory,
    is_stalled: watch::Sender<bool>,
    pub(crate) is_careless: AtomicBool,
    pub(crate) num_writes: AtomicU64,
    pub(crate) num_written_bytes: AtomicU64,
    pub(crate) num_lists: AtomicU64,
    pub(crate) num_reads: AtomicU64,
}

impl TestStore {
    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self {
            inner: InMemory::new(),
            is_stalled: watch::channel(false).0,
            is_careless: AtomicBool::new(false),
            num_writes: AtomicU64::new(0),
            num_written_bytes: AtomicU64::new(0),
            num_lists: AtomicU64::new(0),
            num_reads: AtomicU64::new(0),
        })
    }

    /// While it stalls no write is answered or done.
    pub(crate) fn stall(&self, is_stalled: bool) {
        self.is_stalled.send_replace(is_stalled);
    }

    async fn passes(&self) {
        let mut is_stalled = self.is_stalled.subscribe();
        is_stalled.wait_for(|is_stalled| !is_stalled).await.expect("the sender lives as long as the store");
    }
}

impl fmt::Display for TestStore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a store for tests")
    }
}

#[async_trait]
impl ObjectStore for TestStore {
    async fn put_opts(&self, at: &Path, payload: PutPayload, mut opts: PutOptions) -> Result<PutResult> {
        self.num_writes.fetch_add(1, Ordering::Relaxed);
        self.num_written_bytes.fetch_add(payload.content_length() as u64, Ordering::Relaxed);
        self.passes().await;
        if self.is_careless.load(Ordering::Relaxed) {
            opts.mode = PutMode::Overwrite;
        }
        self.inner.put_opts(at, payload, opts).await
    }

    async fn put_multipart_opts(
        &self,
        at: &Path,
        opts: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        self.num_writes.fetch_add(3, Ordering::Relaxed);
        self.passes().await;
        self.inner.put_multipart_opts(at, opts).await
    }

    async fn get_opts(&self, at: &Path, options: GetOptions) -> Result<GetResult> {
        self.num_reads.fetch_add(1, Ordering::Relaxed);
        self.inner.get_opts(at, options).await
    }

    async fn get_ranges(&self, at: &Path, ranges: &[Range<u64>]) -> Result<Vec<Bytes>> {
        self.num_reads.fetch_add(1, Ordering::Relaxed);
        self.inner.get_ranges(at, ranges).await
    }

    fn delete_stream(&self, at: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        self.inner.delete_stream(at)
    }

    fn list(&self, prefix: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.num_lists.fetch_add(1, Ordering::Relaxed);
        self.inner.list(prefix)
    }

    async fn list_with_delimiter(&self, prefix: Option<&Path>) -> Result<ListResult> {
        self.num_lists.fetch_add(1, Ordering::Relaxed);
        self.inner.list_with_delimiter(prefix).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.inner.copy_opts(from, to, options).await
    }
}

/// The bucket of [`s3_server`].
const BUCKET: &str = "bucket";

/// A server that speaks as much S3 as an object store needs, over a store in memory; a client of it.
pub(crate) async fn s3_server() -> Arc<dyn ObjectStore> {
    let router = Router::new().fallback(serve).with_state(Arc::new(InMemory::new()));
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = format!("http://{}", listener.local_addr().unwrap());
    tokio::spawn(async move { axum::serve(listener, router).await });
    let builder = AmazonS3Builder::new()
        .with_endpoint(endpoint)
        .with_region("local")
        .with_access_key_id("key")
        .with_secret_access_key("secret");
    super::address::finish(builder.with_bucket_name(BUCKET)).unwrap()
}

type Parameters = std::collections::HashMap<String, String>;

/// One request; what goes wrong becomes the status that S3 has for it.
async fn serve(
    State(store): State<Arc<InMemory>>,
    method: Method,
    uri: Uri,
    Query(parameters): Query<Parameters>,
    headers: HeaderMap,
    body: Bytes,
) -> Response {
    let outcome = answer(&store, &method, &uri, &parameters, &headers, body).await;
    outcome.unwrap_or_else(|error| {
        let status = match error {
            Error::NotFound { .. } => StatusCode::NOT_FOUND,
            Error::AlreadyExists { .. } | Error::Precondition { .. } => StatusCode::PRECONDITION_FAILED,
            _ => StatusCode::NOT_IMPLEMENTED,
        };
        Response::builder().status(status).body(Body::from(error.to_string())).unwrap()
    })
}

async fn answer(
    store: &InMemory,
    method: &Method,
    uri: &Uri,
    parameters: &Parameters,
    headers: &HeaderMap,
    body: Bytes,
) -> Result<Response> {
    let key = uri.path().trim_start_matches('/').trim_start_matches(BUCKET).trim_start_matches('/');
    let key = Path::from_url_path(key)?;
    match (method.as_str(), parameters) {
        ("GET", parameters) if parameters.contains_key("list-type") => list(store, parameters).await,
        ("POST", parameters) if parameters.contains_key("delete") => {
            let text = String::from_utf8_lossy(&body).into_owned();
            let keys = text.split("<Key>").skip(1).filter_map(|rest| rest.split("</Key>").next());
            let keys: Vec<Result<Path>> = keys.map(|key| Ok(Path::from(key))).collect();
            let deleted = keys.iter().flatten().map(|key| format!("<Deleted><Key>{key}</Key></Deleted>"));
            let told = deleted.collect::<String>();
            let _ = store.delete_stream(stream::iter(keys).boxed()).collect::<Vec<_>>().await;
            Ok(xml(format!("<DeleteResult>{told}</DeleteResult>")))
        }
        ("GET" | "HEAD", _) => get(store, &key, method == Method::HEAD, headers).await,
        ("PUT", parameters) if !parameters.contains_key("uploadId") => {
            let text = |name| headers.get(name).and_then(|value: &header::HeaderValue| value.to_str().ok());
            let mode = match (text(header::IF_NONE_MATCH), text(header::IF_MATCH)) {
                (Some(_), _) => PutMode::Create,
                (None, Some(e_tag)) => PutMode::Update(UpdateVersion {
                    e_tag: Some(e_tag.trim_matches('"').into()),
                    version: None,
                }),
                (None, None) => PutMode::Overwrite,
            };
            let mut attributes = Attributes::new();
            for (name, value) in headers {
                if let Some(name) = name.as_str().strip_prefix("x-amz-meta-") {
                    let name = Attribute::Metadata(name.to_owned().into());
                    attributes.insert(name, value.to_str().unwrap().to_owned().into());
                }
            }
            let options = PutOptions { mode, attributes, ..PutOptions::default() };
            let put = store.put_opts(&key, body.into(), options).await?;
            let e_tag = format!("\"{}\"", put.e_tag.unwrap_or_default());
            Ok(Response::builder().header(header::ETAG, e_tag).body(Body::empty()).unwrap())
        }
        ("DELETE", _) => {
            let _ = store.delete(&key).await;
            Ok(Response::builder().status(StatusCode::NO_CONTENT).body(Body::empty()).unwrap())
        }
        _ => Err(Error::NotImplemented { operation: uri.to_string(), implementer: "the double".into() }),
    }
}

async fn get(store: &InMemory, key: &Path, is_head: bool, headers: &HeaderMap) -> Result<Response> {
    let range = headers.get(header::RANGE).and_then(|value| value.to_str().ok()?.strip_prefix("bytes="));
    let range = range.and_then(|range| {
        let (first, last) = range.split_once('-')?;
        match (first.parse().ok(), last.parse::<u64>().ok()) {
            (Some(first), Some(last)) => Some(GetRange::Bounded(first..last + 1)),
            (Some(first), None) => Some(GetRange::Offset(first)),
            (None, last) => last.map(GetRange::Suffix),
        }
    });
    let is_part = range.is_some();
    let found = store.get_opts(key, GetOptions { range, head: is_head, ..GetOptions::default() }).await?;
    let mut answer = Response::builder()
        .header(header::LAST_MODIFIED, found.meta.last_modified.to_rfc2822())
        .header(header::ETAG, format!("\"{}\"", found.meta.e_tag.clone().unwrap_or_default()));
    for (name, value) in &found.attributes {
        if let Attribute::Metadata(name) = name {
            answer = answer.header(format!("x-amz-meta-{name}"), value.as_ref());
        }
    }
    if is_part {
        let Range { start, end } = found.range;
        let range = format!("bytes {start}-{}/{}", end - 1, found.meta.size);
        answer = answer.status(StatusCode::PARTIAL_CONTENT).header(header::CONTENT_RANGE, range);
    }
    if is_head {
        return Ok(answer.header(header::CONTENT_LENGTH, found.meta.size).body(Body::empty()).unwrap());
    }
    Ok(answer.body(Body::from(found.bytes().await?)).unwrap())
}

async fn list(store: &InMemory, parameters: &Parameters) -> Result<Response> {
    let prefix = parameters.get("prefix").map(|prefix| Path::from(prefix.as_str()));
    let (objects, prefixes) = if parameters.contains_key("delimiter") {
        let found = store.list_with_delimiter(prefix.as_ref()).await?;
        (found.objects, found.common_prefixes)
    } else {
        (store.list(prefix.as_ref()).try_collect().await?, Vec::new())
    };
    let after = parameters.get("start-after").cloned().unwrap_or_default();
    let mut text = String::from("<ListBucketResult><IsTruncated>false</IsTruncated>");
    for object in objects.iter().filter(|object| object.location.as_ref() > after.as_str()) {
        text += &format!(
            "<Contents><Key>{}</Key><LastModified>{}</LastModified><ETag>\"{}\"</ETag><Size>{}</Size></Contents>",
            object.location,
            object.last_modified.to_rfc3339(),
            object.e_tag.clone().unwrap_or_default(),
            object.size
        );
    }
    for prefix in &prefixes {
        text += &format!("<CommonPrefixes><Prefix>{prefix}/</Prefix></CommonPrefixes>");
    }
    Ok(xml(text + "</ListBucketResult>"))
}

fn xml(text: String) -> Response {
    Response::builder().header(header::CONTENT_TYPE, "application/xml").body(Body::from(text)).unwrap()
}
