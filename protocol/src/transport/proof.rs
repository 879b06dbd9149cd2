//! Proof of a farm's token, bound to one TLS session.

use hmac::{Hmac, Mac};
use sha2::Sha256;
use tokio_rustls::TlsStream;

use super::JoinToken;
use crate::limits::PROOF_BYTES;
use crate::{KeyHash, ProtocolError};

/// Label of the exported key and of the proof. It changes with the bytes that are hashed.
const LABEL: &[u8] = b"rayfarm join 1";

/// The public values of one handshake that a proof covers.
///
/// A proof is HMAC-SHA-256 with the token as its key over: label, key exported from the TLS session (RFC 8446, 7.5),
/// preambles of the worker and of the master, hashes of the keys of the worker and of the master. A relay that ends the
/// TLS session and begins another has another exported key at each side, so a proof of one is wrong at the other.
pub(crate) struct Proof {
    exported: [u8; 32],
    preambles: [[u8; 12]; 2],
    worker: KeyHash,
    master: KeyHash,
}

impl Proof {
    /// Collects the values of a session.
    ///
    /// # Errors
    /// A TLS session that exports no key.
    pub(crate) fn of<S>(
        stream: &TlsStream<S>,
        preambles: [[u8; 12]; 2],
        worker: KeyHash,
        master: KeyHash,
    ) -> Result<Self, ProtocolError> {
        let exported = match stream {
            TlsStream::Client(stream) => stream.get_ref().1.export_keying_material([0; 32], LABEL, None),
            TlsStream::Server(stream) => stream.get_ref().1.export_keying_material([0; 32], LABEL, None),
        };
        let exported = exported.map_err(|error| ProtocolError::Tls { why: error.to_string() })?;
        Ok(Self { exported, preambles, worker, master })
    }

    /// Computes the proof.
    pub(crate) fn bytes(&self, token: &JoinToken) -> Result<[u8; PROOF_BYTES], ProtocolError> {
        Ok(self.mac(token)?.finalize().into_bytes().into())
    }

    /// Compares a proof in constant time.
    pub(crate) fn verify(&self, token: &JoinToken, proof: &[u8]) -> Result<(), ProtocolError> {
        self.mac(token)?.verify_slice(proof).map_err(|_| ProtocolError::WrongToken)
    }

    fn mac(&self, token: &JoinToken) -> Result<Hmac<Sha256>, ProtocolError> {
        let mut mac = Hmac::<Sha256>::new_from_slice(&token.0).map_err(|_| ProtocolError::WrongToken)?;
        let [worker_preamble, master_preamble] = &self.preambles;
        let parts: [&[u8]; 6] =
            [LABEL, &self.exported, worker_preamble, master_preamble, &self.worker.0, &self.master.0];
        parts.into_iter().for_each(|part| mac.update(part));
        Ok(mac)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proof() -> Proof {
        Proof {
            exported: [1; 32],
            preambles: [[2; 12], [3; 12]],
            worker: KeyHash([4; 32]),
            master: KeyHash([5; 32]),
        }
    }

    #[test]
    fn a_proof_is_valid_for_its_own_session_keys_and_token_only() {
        let token = JoinToken([9; 16]);
        let bytes = proof().bytes(&token).unwrap();
        proof().verify(&token, &bytes).unwrap();
        let others = [
            Proof { exported: [0; 32], ..proof() },
            Proof { preambles: [[3; 12], [2; 12]], ..proof() },
            Proof { worker: KeyHash([0; 32]), ..proof() },
            Proof { master: KeyHash([0; 32]), ..proof() },
        ];
        for other in others {
            assert!(matches!(other.verify(&token, &bytes), Err(ProtocolError::WrongToken)));
        }
        assert!(proof().verify(&JoinToken([8; 16]), &bytes).is_err());
        for length in 0..PROOF_BYTES {
            assert!(proof().verify(&token, &bytes[..length]).is_err());
        }
    }
}
