//! From the address in the configuration to an object store.

use std::sync::Arc;
use std::time::Duration;

use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey, S3ConditionalPut};
use object_store::path::Path;
use object_store::{BackoffConfig, ClientOptions, ObjectStore, RetryConfig};
use tokio_rustls::rustls::crypto::ring;

use super::super::{StorageError, unavailable};

/// No single request to the store may take longer; one that fails is sent again.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// A request is sent again for so long.
const RETRY_TIMEOUT: Duration = Duration::from_secs(20);

/// A bucket of a store that speaks S3, and the prefix in it. Credentials, region and endpoint come from the usual
/// variables `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT_URL`. Nothing is sent yet.
///
/// # Errors
/// [`StorageError::Unavailable`] that says which part of the address or of the environment cannot be used.
pub fn store_at(bucket: &str, prefix: &str) -> Result<(Arc<dyn ObjectStore>, Path), StorageError> {
    let builder = AmazonS3Builder::from_env().with_bucket_name(bucket);
    let has_key = builder.get_config_value(&AmazonS3ConfigKey::AccessKeyId).is_some();
    let has_secret = builder.get_config_value(&AmazonS3ConfigKey::SecretAccessKey).is_some();
    if has_key != has_secret {
        let missing = if has_key { "AWS_SECRET_ACCESS_KEY" } else { "AWS_ACCESS_KEY_ID" };
        return Err(unavailable(&format!("{missing} is not set, though its other half is")));
    }
    let prefix = Path::parse(prefix).map_err(|error| unavailable(&error))?;
    Ok((finish(builder)?, prefix))
}

/// A store as it must be used: with preconditions, and never waited for without bound.
pub(super) fn finish(builder: AmazonS3Builder) -> Result<Arc<dyn ObjectStore>, StorageError> {
    // The client takes the provider of the process; whoever set one before has chosen the same.
    let _ = ring::default_provider().install_default();
    let client = ClientOptions::new()
        .with_timeout(REQUEST_TIMEOUT)
        .with_connect_timeout(REQUEST_TIMEOUT / 2)
        .with_allow_http(true);
    let retry =
        RetryConfig { backoff: BackoffConfig::default(), max_retries: 10, retry_timeout: RETRY_TIMEOUT };
    let builder = builder
        .with_conditional_put(S3ConditionalPut::ETagMatch)
        .with_client_options(client)
        .with_retry(retry);
    Ok(Arc::new(builder.build().map_err(|error| unavailable(&error))?))
}
