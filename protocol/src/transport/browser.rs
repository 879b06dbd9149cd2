//! TLS for web browsers, which have no key of their own.

use std::fmt;
use std::io;

use tokio::io::{AsyncRead, AsyncWrite};
use tokio_rustls::TlsAcceptor;

use super::{PrivateKey, tls};
use crate::ProtocolError;

/// Stream of a browser after the handshake.
pub type BrowserStream<S> = tokio_rustls::server::TlsStream<S>;

/// Acceptor of TLS 1.3 connections of browsers, with the key of a master.
///
/// A browser warns before it uses a self-signed certificate. Its user can compare the hash of the public key with
/// [`PrivateKey::hash`].
#[derive(Clone)]
pub struct BrowserAcceptor(TlsAcceptor);

impl BrowserAcceptor {
    /// An acceptor with this key.
    ///
    /// # Errors
    /// A key that does not fit its certificate.
    pub fn new(key: &PrivateKey) -> Result<Self, ProtocolError> {
        let (chain, private) = key.tls_parts();
        let config = tls::browser_config(chain, private).map_err(|error| tls::tls_error(&error))?;
        Ok(Self(TlsAcceptor::from(config)))
    }

    /// Performs the handshake of one connection. The caller bounds its time.
    ///
    /// # Errors
    /// A peer without TLS 1.3, or a failed transport.
    pub async fn accept<S>(&self, stream: S) -> io::Result<BrowserStream<S>>
    where
        S: AsyncRead + AsyncWrite + Unpin,
    {
        self.0.accept(stream).await
    }
}

impl fmt::Debug for BrowserAcceptor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("BrowserAcceptor(..)")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rustls::client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier};
    use rustls::crypto::ring;
    use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
    use rustls::{ClientConfig, DigitallySignedStruct, Error, SignatureScheme};
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio_rustls::TlsConnector;

    use super::super::certificate;
    use super::*;

    /// Accepts every certificate, as a user who continues after the browser's warning.
    #[derive(Debug)]
    struct AnyCertificate;

    impl ServerCertVerifier for AnyCertificate {
        fn verify_server_cert(
            &self,
            _: &CertificateDer<'_>,
            _: &[CertificateDer<'_>],
            _: &ServerName<'_>,
            _: &[u8],
            _: UnixTime,
        ) -> Result<ServerCertVerified, Error> {
            Ok(ServerCertVerified::assertion())
        }

        fn verify_tls12_signature(
            &self,
            _: &[u8],
            _: &CertificateDer<'_>,
            _: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            Err(Error::General("only TLS 1.3".to_owned()))
        }

        fn verify_tls13_signature(
            &self,
            message: &[u8],
            certificate: &CertificateDer<'_>,
            signature: &DigitallySignedStruct,
        ) -> Result<HandshakeSignatureValid, Error> {
            let algorithms = ring::default_provider().signature_verification_algorithms;
            rustls::crypto::verify_tls13_signature(message, certificate, signature, &algorithms)
        }

        fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
            vec![SignatureScheme::ECDSA_NISTP256_SHA256]
        }
    }

    #[tokio::test]
    async fn a_client_without_a_key_is_accepted_and_receives_the_masters_key() {
        let key = PrivateKey::generate().unwrap();
        let acceptor = BrowserAcceptor::new(&key).unwrap();
        let (near, far) = tokio::io::duplex(1 << 14);
        let server = tokio::spawn(async move {
            let mut stream = acceptor.accept(far).await.unwrap();
            stream.write_all(b"page").await.unwrap();
            stream.shutdown().await.unwrap();
        });
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_protocol_versions(&[&rustls::version::TLS13])
            .unwrap()
            .dangerous()
            .with_custom_certificate_verifier(Arc::new(AnyCertificate))
            .with_no_client_auth();
        let connector = TlsConnector::from(Arc::new(config));
        let name = ServerName::try_from("localhost").unwrap();
        let mut stream = connector.connect(name, near).await.unwrap();
        let mut page = Vec::new();
        stream.read_to_end(&mut page).await.unwrap();
        assert_eq!(page, b"page");
        let shown = &stream.get_ref().1.peer_certificates().unwrap()[0];
        assert_eq!(certificate::key_hash(shown).unwrap(), key.hash());
        server.await.unwrap();
    }
}
