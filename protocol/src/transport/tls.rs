//! TLS 1.3 between ends that know each other by the hash of a key, without tickets, resumption, early data and clocks.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rustls::client::Resumption;
use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
use rustls::crypto::{CryptoProvider, ring, verify_tls13_signature};
use rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime};
use rustls::server::NoServerSessionStorage;
use rustls::server::danger::{ClientCertVerified, ClientCertVerifier};
use rustls::time_provider::TimeProvider;
use rustls::{
    CertificateError, ClientConfig, DigitallySignedStruct, DistinguishedName, Error, PeerIncompatible,
    ServerConfig, SignatureScheme,
};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::{TlsAcceptor, TlsConnector, TlsStream};

use super::{Bounded, PrivateKey, certificate};
use crate::limits::MAX_UNAUTHENTICATED_BYTES;
use crate::{KeyHash, ProtocolError};

/// Name for the TLS library. It is not sent.
const SERVER_NAME: &str = "rayfarm";

/// Connects as the end that knows the other's key. The configuration is made for each connection, because it contains the
/// expected key.
///
/// # Errors
/// Another key, a wrong signature, a peer without TLS 1.3, too many bytes, a failed transport.
pub(crate) async fn connect<S>(
    stream: S,
    key: &PrivateKey,
    expected: KeyHash,
) -> Result<TlsStream<Bounded<S>>, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let verifier = Arc::new(KnownKey { expected, other: Mutex::new(None), provider: provider() });
    let (chain, private) = key.tls_parts();
    let config = ClientConfig::builder_with_details(provider(), Arc::new(NoClock))
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(|error| tls_error(&error))?
        .dangerous()
        .with_custom_certificate_verifier(Arc::clone(&verifier) as Arc<dyn ServerCertVerifier>)
        .with_client_auth_cert(chain, private);
    let mut config = config.map_err(|error| tls_error(&error))?;
    config.resumption = Resumption::disabled();
    config.enable_sni = false;
    let name = ServerName::try_from(SERVER_NAME).map_err(|error| tls_error(&error))?;
    let bounded = Bounded::new(stream, MAX_UNAUTHENTICATED_BYTES);
    match TlsConnector::from(Arc::new(config)).connect(name, bounded).await {
        Ok(stream) => Ok(stream.into()),
        Err(error) => match *verifier.other.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(theirs) => Err(ProtocolError::WrongKey { theirs, expected }),
            None => Err(tls_error(&error)),
        },
    }
}

/// Accepts an end with any P-256 key, whose hash the result has.
///
/// # Errors
/// No certificate, a wrong signature, a peer without TLS 1.3, too many bytes, a failed transport.
pub(crate) async fn accept<S>(
    stream: S,
    key: &PrivateKey,
) -> Result<(TlsStream<Bounded<S>>, KeyHash), ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let bounded = Bounded::new(stream, MAX_UNAUTHENTICATED_BYTES);
    let acceptor = TlsAcceptor::from(Arc::clone(key.server_config()));
    let stream = acceptor.accept(bounded).await.map_err(|error| tls_error(&error))?;
    let (_, session) = stream.get_ref();
    let certificates = session.peer_certificates().unwrap_or_default();
    let first = certificates.first().ok_or_else(|| tls_error(&Error::NoCertificatesPresented))?;
    let hash = certificate::key_hash(first).map_err(|error| tls_error(&error))?;
    Ok((stream.into(), hash))
}

/// Configuration of all connections that an end with this certificate and this key accepts.
///
/// # Errors
/// A key that does not fit the certificate.
pub(super) fn server_config(
    chain: Vec<CertificateDer<'static>>,
    private: PrivateKeyDer<'static>,
) -> Result<Arc<ServerConfig>, Error> {
    let mut config = ServerConfig::builder_with_details(provider(), Arc::new(NoClock))
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_client_cert_verifier(Arc::new(AnyKey { provider: provider() }))
        .with_single_cert(chain, private)?;
    config.send_tls13_tickets = 0;
    config.session_storage = Arc::new(NoServerSessionStorage {});
    Ok(Arc::new(config))
}

/// Configuration of the connections of browsers, which have no certificate.
///
/// # Errors
/// A key that does not fit the certificate.
pub(super) fn browser_config(
    chain: Vec<CertificateDer<'static>>,
    private: PrivateKeyDer<'static>,
) -> Result<Arc<ServerConfig>, Error> {
    let mut config = ServerConfig::builder_with_details(provider(), Arc::new(NoClock))
        .with_protocol_versions(&[&rustls::version::TLS13])?
        .with_no_client_auth()
        .with_single_cert(chain, private)?;
    config.send_tls13_tickets = 0;
    config.session_storage = Arc::new(NoServerSessionStorage {});
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Arc::new(config))
}

pub(super) fn tls_error(error: &dyn std::fmt::Display) -> ProtocolError {
    ProtocolError::Tls { why: error.to_string() }
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// Time for the TLS library, which uses it for nothing that is enabled here.
#[derive(Debug)]
struct NoClock;

impl TimeProvider for NoClock {
    fn current_time(&self) -> Option<UnixTime> {
        Some(UnixTime::since_unix_epoch(Duration::ZERO))
    }
}

/// Accepts one key only.
#[derive(Debug)]
struct KnownKey {
    expected: KeyHash,
    /// Hash of a key that was not accepted.
    other: Mutex<Option<KeyHash>>,
    provider: Arc<CryptoProvider>,
}

impl ServerCertVerifier for KnownKey {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _server_name: &ServerName<'_>,
        _ocsp_response: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, Error> {
        let hash = certificate::key_hash(end_entity)?;
        if hash == self.expected {
            return Ok(ServerCertVerified::assertion());
        }
        *self.other.lock().unwrap_or_else(PoisonError::into_inner) = Some(hash);
        Err(CertificateError::ApplicationVerificationFailure.into())
    }

    fn verify_tls12_signature(
        &self,
        _message: &[u8],
        _cert: &CertificateDer<'_>,
        _dss: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(PeerIncompatible::ServerTlsVersionIsDisabledByOurConfig.into())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        cert: &CertificateDer<'_>,
        dss: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        verify_tls13_signature(message, cert, dss, &self.provider.signature_verification_algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        vec![SignatureScheme::ECDSA_NISTP256_SHA256]
    }
}

/// Accepts every P-256 key: its hash is an identity, and the token gives access.
#[derive(Debug)]
struct AnyKey {
    provider: Arc<CryptoProvider>,
}

impl ClientCertVerifier for AnyKey {
    fn root_hint_subjects(&self) -> &[DistinguishedName] {
        &[]
    }

    fn verify_client_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _now: UnixTime,
    ) -> Result<ClientCertVerified, Error> {
        certificate::key_hash(end_entity).map(|_| ClientCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        _message: &[u8],
        _cert: &CertificateDer<'_>,
        _dss: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        Err(PeerIncompatible::Tls12NotOffered.into())
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        cert: &CertificateDer<'_>,
        dss: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, Error> {
        verify_tls13_signature(message, cert, dss, &self.provider.signature_verification_algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        vec![SignatureScheme::ECDSA_NISTP256_SHA256]
    }
}
