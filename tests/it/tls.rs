//! TLS: both protocols, certificates renewed without a restart.

use std::path::Path;
use std::sync::Arc;

use locution_server::config::TlsConfig;
use locution_tests::TestServer;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::{CertificateDer, ServerName};
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

/// Writes a new certificate for this machine and its key.
fn renew(directory: &Path) -> CertificateDer<'static> {
    let issued = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    std::fs::write(directory.join("chain.pem"), issued.cert.pem()).unwrap();
    std::fs::write(directory.join("key.pem"), issued.signing_key.serialize_pem()).unwrap();
    issued.cert.der().clone()
}

/// The protocol agreed on and the answer of `/healthz` over HTTP/1.1, for a client that trusts one certificate.
async fn ask(
    server: &TestServer,
    trusted: &CertificateDer<'static>,
    protocols: &[&str],
) -> std::io::Result<(String, String)> {
    let mut roots = RootCertStore::empty();
    roots.add(trusted.clone()).unwrap();
    let builder = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()));
    let mut config = builder
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    config.alpn_protocols = protocols.iter().map(|name| name.as_bytes().to_vec()).collect();
    let stream = TcpStream::connect(server.api.base.trim_start_matches("https://")).await?;
    let name = ServerName::try_from("localhost").unwrap();
    let mut stream = TlsConnector::from(Arc::new(config)).connect(name, stream).await?;
    let protocol =
        String::from_utf8_lossy(stream.get_ref().1.alpn_protocol().unwrap_or_default()).into_owned();
    if protocol == "h2" {
        return Ok((protocol, String::new()));
    }
    stream.write_all(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").await?;
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes).await;
    Ok((protocol, String::from_utf8_lossy(&bytes).into_owned()))
}

#[tokio::test(flavor = "multi_thread")]
async fn both_protocols_are_spoken_and_certificates_are_renewed_while_serving() {
    let directory = tempfile::tempdir().unwrap();
    let first = renew(directory.path());
    let (certificate, key) = (directory.path().join("chain.pem"), directory.path().join("key.pem"));
    let server = TestServer::start_with(|config| config.tls = Some(TlsConfig { certificate, key })).await;
    assert!(server.api.base.starts_with("https://"));
    let (protocol, answer) = ask(&server, &first, &["http/1.1"]).await.unwrap();
    assert_eq!(protocol, "http/1.1");
    assert!(answer.starts_with("HTTP/1.1 200") && answer.ends_with("ok\n"), "{answer}");
    assert_eq!(ask(&server, &first, &["h2", "http/1.1"]).await.unwrap().0, "h2");

    let second = renew(directory.path());
    assert!(ask(&server, &second, &["http/1.1"]).await.is_err());
    server.reload(|_| {}).unwrap();
    assert!(ask(&server, &second, &["http/1.1"]).await.unwrap().1.starts_with("HTTP/1.1 200"));
    assert!(ask(&server, &first, &["http/1.1"]).await.is_err());

    std::fs::write(directory.path().join("key.pem"), "no key").unwrap();
    assert!(server.reload(|_| {}).is_err());
    assert!(ask(&server, &second, &["http/1.1"]).await.is_ok());
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn both_protocols_are_spoken_without_tls_too() {
    let server = TestServer::start().await;
    let mut stream = TcpStream::connect(server.api.base.trim_start_matches("http://")).await.unwrap();
    // The preface and empty settings of HTTP/2; the server answers with its own settings, a frame of type 4.
    stream.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0").await.unwrap();
    let mut frame = [0; 9];
    stream.read_exact(&mut frame).await.unwrap();
    assert_eq!(frame[3], 4, "{frame:?}");
    server.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_of_the_configuration_are_read_again_while_serving() {
    use locution_server::config::{ApiKeyConfig, Scope};
    let key = |sha256: &str| ApiKeyConfig {
        name: "reader".into(),
        sha256: sha256.into(),
        scope: Scope::Read,
        sites: vec!["*".into()],
        ..ApiKeyConfig::default()
    };
    // Of `reader` and `writer`.
    let first = key("3d0941964aa3ebdcb00ccef58b1bb399f9f898465e9886d5aec7f31090a0fb30");
    let second = key("b93006774cbdd4b299389a03ac3d88c3a76b460d538795bc12718011a909fba5");
    let server = TestServer::start_with(|config| config.keys = vec![first]).await;
    server.api.with_key("reader").get("/v1/sites").await.ok();
    server.reload(|config| config.keys = vec![second]).unwrap();
    server.api.with_key("reader").get("/v1/sites").await.problem(401, "unauthorized");
    server.api.with_key("writer").get("/v1/sites").await.ok();
    server.stop().await;
}
