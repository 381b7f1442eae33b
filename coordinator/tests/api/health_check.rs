//! Health checks, of the right coordinator and of other servers.

use std::{fs, io::Write as _, net::SocketAddr};

use coordinator::{
    Access, Coordinator, CoordinatorConfig, StartError, Tls, Tokens, Unhealthy, health_check,
};
use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, IsCa, KeyPair};
use swarm_transport::{Identity, Token, certificates};
use tempfile::TempDir;
use tokio::net::TcpListener;

/// A coordinator's TLS, for a name that is not its address, so that ordinary clients would refuse
/// it. The argument: whether it requires certificates of its own authority.
fn tls(asks_for_certificates: bool) -> Tls {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    let mut params = CertificateParams::new([]).unwrap();
    params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let ca = CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap();
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new(["fleet.example".to_owned()]).unwrap();
    fs::write(path("ca.pem"), ca.pem()).unwrap();
    fs::write(path("own.pem"), params.signed_by(&key, &ca).unwrap().pem()).unwrap();
    fs::write(path("own.key"), key.serialize_pem()).unwrap();
    Tls {
        identity: Identity::read(&path("own.pem"), &path("own.key")).unwrap(),
        client_authorities: asks_for_certificates.then(|| certificates(&path("ca.pem")).unwrap()),
    }
}

async fn start(listen: &str, data: &TempDir, tls: Option<&Tls>) -> Result<Coordinator, StartError> {
    let token = |letter: &str| Token::parse(&letter.repeat(32)).unwrap();
    let tokens = Some(Tokens::new(token("c"), token("w")).unwrap());
    let access = Access { tokens, tls: tls.cloned(), plaintext: true };
    let config = super::config(listen.parse().unwrap(), data.path().into());
    Coordinator::start(CoordinatorConfig { access, ..config }).await
}

#[tokio::test]
async fn a_coordinator_is_healthy_wherever_it_listens_with_tls_and_without() {
    for listen in ["127.0.0.1:0", "0.0.0.0:0", "[::]:0"] {
        for tls in [None, Some(tls(false)), Some(tls(true))] {
            let data = tempfile::tempdir().unwrap();
            let coordinator = match start(listen, &data, tls.as_ref()).await {
                Err(StartError::Listen { .. }) if listen.starts_with('[') => {
                    // Bypasses the capture of a test's output, because `.ci/run` lists these
                    // lines.
                    let _ = std::io::stderr().write_all(b"\nSKIPPED: this machine has no IPv6\n");
                    continue;
                }
                started => started.unwrap(),
            };
            let address = coordinator.local_addr();
            health_check(address, tls.as_ref()).await.unwrap();
            coordinator.shutdown().await;
            let error = health_check(address, tls.as_ref()).await.unwrap_err();
            assert!(matches!(error, Unhealthy::Absent { .. }), "{error}");
        }
    }
}

#[tokio::test]
async fn a_check_with_other_tls_than_the_coordinators_fails() {
    let (own, other) = (tls(true), tls(false));
    let data = tempfile::tempdir().unwrap();
    let coordinator = start("127.0.0.1:0", &data, Some(&own)).await.unwrap();
    let error = health_check(coordinator.local_addr(), Some(&other)).await.unwrap_err();
    assert!(matches!(error, Unhealthy::Tls { .. }), "{error}");
    assert!(error.to_string().contains("another certificate"), "{error}");
    let error = health_check(coordinator.local_addr(), None).await.unwrap_err();
    assert!(matches!(error, Unhealthy::Call { .. }), "{error}");
    assert!(error.to_string().contains("--tls-cert"), "{error}");
    coordinator.shutdown().await;

    // It requires certificates of another authority than its own.
    let strict = Tls { client_authorities: own.client_authorities, ..other };
    let data = tempfile::tempdir().unwrap();
    let coordinator = start("127.0.0.1:0", &data, Some(&strict)).await.unwrap();
    let error = health_check(coordinator.local_addr(), Some(&strict)).await.unwrap_err();
    assert!(matches!(error, Unhealthy::Call { .. }), "{error}");
    assert!(error.to_string().contains("client certificates"), "{error}");
    coordinator.shutdown().await;

    let data = tempfile::tempdir().unwrap();
    let plain = start("127.0.0.1:0", &data, None).await.unwrap();
    let error = health_check(plain.local_addr(), Some(&strict)).await.unwrap_err();
    assert!(matches!(error, Unhealthy::Tls { .. }), "{error}");
    plain.shutdown().await;
}

#[tokio::test]
async fn a_coordinator_that_does_not_answer_is_not_healthy() {
    let silent = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let error = health_check(silent.local_addr().unwrap(), None).await.unwrap_err();
    assert!(matches!(error, Unhealthy::Silent { .. }), "{error}");
    let free: SocketAddr = "0.0.0.0:0".parse().unwrap();
    let error = health_check(free, None).await.unwrap_err();
    assert!(matches!(error, Unhealthy::UnknownPort(_)), "{error}");
}
