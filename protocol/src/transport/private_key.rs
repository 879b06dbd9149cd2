//! The private key of a master or a worker, with a self-signed certificate, in memory and in a file.

use std::fmt;
use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rcgen::{CertificateParams, KeyPair, PKCS_ECDSA_P256_SHA256};
use rustls::ServerConfig;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, PrivatePkcs8KeyDer};

use super::{certificate, tls};
use crate::KeyHash;

/// Largest file that is read as a key, in bytes.
const MAX_FILE_BYTES: u64 = 16 << 10;

/// Name in every certificate. It has no meaning: only the key is compared.
const CERTIFICATE_NAME: &str = "rayfarm";

/// ECDSA key on the curve P-256 and a self-signed certificate, which TLS needs as a container of the public key.
///
/// The certificate is made anew at every load. No end reads its names or its dates.
pub struct PrivateKey {
    pem: String,
    pkcs8: Vec<u8>,
    certificate: CertificateDer<'static>,
    /// Configuration of the connections that this end accepts.
    server_config: Arc<ServerConfig>,
    hash: KeyHash,
}

/// Error of a private key.
#[derive(Debug, thiserror::Error)]
pub enum PrivateKeyError {
    /// The file or its folder cannot be read or written.
    #[error("cannot {doing} {}: {source}", .path.display())]
    File {
        /// The operation that failed.
        doing: &'static str,
        /// The file or the folder.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// Other users can read or write the file.
    #[error(
        "other users can access the private key {path} (mode {mode:04o}); \
         run `chmod 600 {path}` if it was never exposed, or delete it so that a new key is made",
        path = .path.display()
    )]
    Exposed {
        /// The file.
        path: PathBuf,
        /// Permission bits of the file.
        mode: u32,
    },
    /// The file holds no key of the expected kind.
    #[error("{} holds no P-256 private key in PKCS#8 PEM; delete it so that a new key is made", .path.display())]
    Content {
        /// The file.
        path: PathBuf,
    },
    /// The key or its certificate could not be made.
    #[error("cannot make a key: {0}")]
    Make(String),
}

impl PrivateKey {
    /// Makes a key of the system's random numbers.
    ///
    /// # Errors
    /// A system without random numbers.
    pub fn generate() -> Result<Self, PrivateKeyError> {
        let pair = KeyPair::generate_for(&PKCS_ECDSA_P256_SHA256).map_err(make_error)?;
        Self::of_pair(&pair)
    }

    /// Loads the key of a file, or makes a key and saves it there. A new file has mode 0600, a new folder 0700. A
    /// process that creates the file at the same time wins, and its key is loaded.
    ///
    /// # Errors
    /// A file that other users can access, that holds no key, or that cannot be read or written.
    pub fn load_or_create(path: &Path) -> Result<Self, PrivateKeyError> {
        match fs::symlink_metadata(path) {
            Ok(_) => Self::load(path),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let key = Self::generate()?;
                if key.save_new(path)? { Ok(key) } else { Self::load(path) }
            }
            Err(source) => Err(file_error("read", path, source)),
        }
    }

    /// Loads the key of a file.
    ///
    /// # Errors
    /// A file that other users can access, that holds no key, or that cannot be read.
    pub fn load(path: &Path) -> Result<Self, PrivateKeyError> {
        let file = fs::File::open(path).map_err(|source| file_error("read", path, source))?;
        check_private(path, &file)?;
        let mut pem = String::new();
        match file.take(MAX_FILE_BYTES).read_to_string(&mut pem) {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                return Err(PrivateKeyError::Content { path: path.to_owned() });
            }
            Err(source) => return Err(file_error("read", path, source)),
        }
        let pair = KeyPair::from_pkcs8_pem_and_sign_algo(&pem, &PKCS_ECDSA_P256_SHA256)
            .map_err(|_| PrivateKeyError::Content { path: path.to_owned() })?;
        Self::of_pair(&pair)
    }

    /// Hash of the public key: the identity of this end.
    pub fn hash(&self) -> KeyHash {
        self.hash
    }

    /// Certificate and key as TLS takes them.
    pub(super) fn tls_parts(&self) -> (Vec<CertificateDer<'static>>, PrivateKeyDer<'static>) {
        tls_parts(&self.certificate, &self.pkcs8)
    }

    /// Configuration of the connections that this end accepts, made once.
    pub(super) fn server_config(&self) -> &Arc<ServerConfig> {
        &self.server_config
    }

    fn of_pair(pair: &KeyPair) -> Result<Self, PrivateKeyError> {
        let mut params = CertificateParams::new(vec![CERTIFICATE_NAME.to_owned()]).map_err(make_error)?;
        params.not_before = rcgen::date_time_ymd(1975, 1, 1);
        params.not_after = rcgen::date_time_ymd(4096, 1, 1);
        let certificate = params.self_signed(pair).map_err(make_error)?.der().clone();
        let hash = certificate::key_hash(&certificate).map_err(make_error)?;
        let pkcs8 = pair.serialize_der();
        let (chain, private) = tls_parts(&certificate, &pkcs8);
        let server_config = tls::server_config(chain, private).map_err(make_error)?;
        Ok(Self { pem: pair.serialize_pem(), pkcs8, certificate, server_config, hash })
    }

    /// Writes the key to a new file: first to a temporary file of the same folder, which then gets the name. Returns
    /// false where the name exists by then.
    fn save_new(&self, path: &Path) -> Result<bool, PrivateKeyError> {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        create_folder(folder).map_err(|source| file_error("create", folder, source))?;
        let mut suffix = [0; 8];
        getrandom::fill(&mut suffix).map_err(make_error)?;
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{:016x}.tmp", u64::from_le_bytes(suffix)));
        let temporary = folder.join(name);
        let written = create_private(&temporary).and_then(|mut file| {
            file.write_all(self.pem.as_bytes())?;
            file.sync_all()
        });
        // A hard link, unlike a rename, does not replace a key that another process has saved.
        let linked = written.and_then(|()| match fs::hard_link(&temporary, path) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
            // A file system without hard links.
            Err(_) => fs::rename(&temporary, path).map(|()| true),
        });
        let _ = fs::remove_file(&temporary);
        linked.map_err(|source| file_error("write", path, source))
    }
}

fn tls_parts(
    certificate: &CertificateDer<'static>,
    pkcs8: &[u8],
) -> (Vec<CertificateDer<'static>>, PrivateKeyDer<'static>) {
    let key = PrivatePkcs8KeyDer::from(pkcs8.to_vec());
    (vec![certificate.clone()], PrivateKeyDer::Pkcs8(key))
}

fn make_error(error: impl fmt::Display) -> PrivateKeyError {
    PrivateKeyError::Make(error.to_string())
}

fn file_error(doing: &'static str, path: &Path, source: io::Error) -> PrivateKeyError {
    PrivateKeyError::File { doing, path: path.to_owned(), source }
}

pub(super) fn create_folder(folder: &Path) -> io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

pub(super) fn create_private(path: &Path) -> io::Result<fs::File> {
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)
}

/// Checks that only the owner can access an open file, where the system has such permissions.
fn check_private(path: &Path, file: &fs::File) -> Result<(), PrivateKeyError> {
    #[cfg(unix)]
    {
        let metadata = file.metadata().map_err(|source| file_error("read", path, source))?;
        let mode = std::os::unix::fs::PermissionsExt::mode(&metadata.permissions()) & 0o7777;
        if mode & 0o077 != 0 {
            return Err(PrivateKeyError::Exposed { path: path.to_owned(), mode });
        }
    }
    #[cfg(not(unix))]
    let _ = (path, file);
    Ok(())
}

impl PartialEq for PrivateKey {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash
    }
}

impl Eq for PrivateKey {}

impl fmt::Debug for PrivateKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PrivateKey({:?})", self.hash)
    }
}
