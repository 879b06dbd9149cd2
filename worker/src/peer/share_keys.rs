//! Keys of the tokens that give other workers access to this worker's assets.

use rayfarm_protocol::KeyHash;
use rayfarm_protocol::peer::{PeerRequest, ShareKey, Token};

/// The master's last two keys. A token of an older key is invalid, so tokens end without a clock.
#[derive(Debug, Default)]
pub(super) struct ShareKeys {
    current: Option<(u64, ShareKey)>,
    previous: Option<(u64, ShareKey)>,
}

impl ShareKeys {
    /// Sets the key of a generation. The key before it stays valid where its generation is the previous one.
    ///
    /// # Errors
    /// A generation that is not greater than the current one. The keys do not change then.
    pub(super) fn set(&mut self, generation: u64, key: ShareKey) -> Result<(), String> {
        if let Some((current, _)) = self.current.filter(|(current, _)| generation <= *current) {
            return Err(format!("it has generation {generation}, the current one has {current}"));
        }
        let last = self.current.replace((generation, key));
        self.previous = last.filter(|(last, _)| last.checked_add(1) == Some(generation));
        Ok(())
    }

    /// Whether a token is made of one of the keys, for the requested asset and for the worker with the key `client`.
    pub(super) fn allow(&self, request: &PeerRequest, client: Option<KeyHash>) -> bool {
        let is_of = |(generation, key): (u64, ShareKey)| {
            Token::new(&key, request.id, client, generation) == request.token
        };
        self.current.is_some_and(is_of) || self.previous.is_some_and(is_of)
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::AssetId;

    use super::*;

    const ID: AssetId = AssetId([1; 32]);

    fn key(generation: u64) -> ShareKey {
        ShareKey([generation as u8; 32])
    }

    /// A request with a token for the worker with the key `of`.
    fn request(generation: u64, of: Option<KeyHash>) -> PeerRequest {
        PeerRequest { id: ID, token: Token::new(&key(generation), ID, of, generation), offset: 0 }
    }

    fn keys(generations: &[u64]) -> ShareKeys {
        let mut keys = ShareKeys::default();
        generations.iter().for_each(|&generation| keys.set(generation, key(generation)).unwrap());
        keys
    }

    #[test]
    fn a_token_is_valid_in_its_own_generation_and_in_the_next() {
        assert!(!keys(&[]).allow(&request(0, None), None));
        assert!(keys(&[0]).allow(&request(0, None), None));
        assert!(keys(&[0, 1]).allow(&request(0, None), None) && keys(&[0, 1]).allow(&request(1, None), None));
        assert!(!keys(&[0, 1, 2]).allow(&request(0, None), None), "an old generation");
        assert!(!keys(&[0]).allow(&request(1, None), None), "a generation to come");
        assert!(!keys(&[0, 2]).allow(&request(0, None), None), "a skipped generation ends older ones too");
    }

    #[test]
    fn a_token_is_valid_for_its_own_worker_only() {
        let (owner, thief) = (Some(KeyHash([1; 32])), Some(KeyHash([2; 32])));
        let keys = keys(&[4, 5]);
        for generation in [4, 5] {
            let request = request(generation, owner);
            assert!(keys.allow(&request, owner));
            assert!(!keys.allow(&request, thief) && !keys.allow(&request, None));
        }
        assert!(!keys.allow(&request(5, None), owner), "a token of a plain farm");
    }

    #[test]
    fn a_generation_does_not_return() {
        let mut keys = keys(&[3, 4]);
        for old in [3, 4] {
            assert!(keys.set(old, ShareKey([9; 32])).is_err());
        }
        assert!(keys.allow(&request(3, None), None) && keys.allow(&request(4, None), None));
        keys.set(u64::MAX, key(255)).unwrap();
        assert!(keys.set(u64::MAX, key(255)).is_err());
    }
}
