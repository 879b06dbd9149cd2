//! Public keys in certificates.

use rustls::pki_types::CertificateDer;
use rustls::server::ParsedCertificate;
use rustls::{CertificateError, Error};
use sha2::{Digest, Sha256};

use crate::KeyHash;

/// Largest certificate of a peer, in bytes. A self-signed certificate of a P-256 key has about 400.
const MAX_CERTIFICATE_BYTES: usize = 2 << 10;

/// The DER bytes of a SubjectPublicKeyInfo of a P-256 key in front of the 65 bytes of the uncompressed point.
const P256_PREFIX: [u8; 26] = [
    0x30, 0x59, 0x30, 0x13, 0x06, 0x07, 0x2a, 0x86, 0x48, 0xce, 0x3d, 0x02, 0x01, 0x06, 0x08, 0x2a, 0x86,
    0x48, 0xce, 0x3d, 0x03, 0x01, 0x07, 0x03, 0x42, 0x00,
];

/// Number of bytes of an uncompressed point on P-256.
const POINT_BYTES: usize = 65;

/// Hash of the public key in a certificate.
///
/// # Errors
/// A certificate that is too large, is malformed, or holds a key that is not on P-256.
pub(super) fn key_hash(certificate: &CertificateDer<'_>) -> Result<KeyHash, Error> {
    if certificate.len() > MAX_CERTIFICATE_BYTES {
        return Err(CertificateError::BadEncoding.into());
    }
    let info = ParsedCertificate::try_from(certificate)?.subject_public_key_info();
    if info.len() != P256_PREFIX.len() + POINT_BYTES || !info.starts_with(&P256_PREFIX) {
        return Err(CertificateError::BadEncoding.into());
    }
    Ok(KeyHash(Sha256::digest(&info).into()))
}
