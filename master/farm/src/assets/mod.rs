//! The assets of a scene, which workers fetch once and keep: the scene body, its meshes and its textures, each under the
//! hash of its bytes. And their routing and transfers.

pub(crate) mod peer_endpoint;
pub(crate) mod routing;
pub(crate) mod scene_table;
pub(crate) mod transfers;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;
use rayfarm_protocol::codec::{self, CodecError};
use rayfarm_protocol::limits::{MAX_ASSET_BYTES, MAX_DECODE_BYTES};
use rayfarm_tracer::mesh::{CompiledMesh, MeshId};
use rayfarm_tracer::texture::{Texture, TextureId};

use crate::farm_scene::FarmScene;

pub use transfers::TransferStatus;

/// An error that keeps a scene from being sent.
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    /// Encoding the scene failed.
    #[error("cannot encode the scene for the workers: {0}")]
    Encode(#[from] CodecError),

    /// The scene body is longer than workers accept.
    #[error(
        "the scene without its meshes takes {bytes} bytes, workers accept at most {limit}; \
         move single [[triangle]]s into an OBJ file"
    )]
    SceneTooLong {
        /// Its length in bytes.
        bytes: usize,
        /// The bound in bytes.
        limit: usize,
    },

    /// A mesh is longer than an asset may be.
    #[error(
        "a compiled mesh takes {bytes} bytes, an asset at most {limit}; split the model into several files"
    )]
    MeshTooLong {
        /// Its length in bytes.
        bytes: usize,
        /// The bound in bytes.
        limit: u64,
    },

    /// The scene refers to a mesh that is not among the given ones.
    #[error("the scene refers to the mesh {0}, which is not loaded")]
    MissingMesh(AssetId),

    /// The scene refers to a texture that is not among the given ones.
    #[error("the scene refers to the texture {0}, which is not loaded")]
    MissingTexture(AssetId),
}

/// The assets of one scene. Their bytes are shared with the senders, never copied.
#[derive(Debug)]
pub struct Assets {
    scene: AssetId,
    drawn: Arc<FarmScene>,
    blobs: BTreeMap<AssetId, Bytes>,
}

/// A compiled mesh as the owner of its bytes: all transfers share one copy in memory.
struct MeshBytes(Arc<CompiledMesh>);

impl AsRef<[u8]> for MeshBytes {
    fn as_ref(&self) -> &[u8] {
        self.0.bytes()
    }
}

/// A texture as the owner of its bytes.
struct TextureBytes(Arc<Texture>);

impl AsRef<[u8]> for TextureBytes {
    fn as_ref(&self) -> &[u8] {
        self.0.bytes()
    }
}

impl Assets {
    /// The scene's body, and those of its meshes and textures that it refers to.
    ///
    /// # Errors
    /// The scene or a mesh is too long, or one that it refers to is missing.
    pub fn new(drawn: FarmScene) -> Result<Self, AssetError> {
        let FarmScene { scene, meshes, textures } = &drawn;
        let body = codec::encode(scene)?;
        if body.len() > MAX_DECODE_BYTES {
            return Err(AssetError::SceneTooLong { bytes: body.len(), limit: MAX_DECODE_BYTES });
        }
        let scene_id = AssetId::of(&body);
        let mut blobs = BTreeMap::from([(scene_id, Bytes::from(body))]);
        let mut missing: BTreeSet<MeshId> = scene.mesh_ids();
        for mesh in meshes.iter().filter(|mesh| missing.remove(&mesh.id())) {
            let (id, bytes) = (AssetId(mesh.id().0), mesh.bytes().len());
            if bytes as u64 > MAX_ASSET_BYTES {
                return Err(AssetError::MeshTooLong { bytes, limit: MAX_ASSET_BYTES });
            }
            blobs.insert(id, Bytes::from_owner(MeshBytes(mesh.clone())));
        }
        if let Some(id) = missing.first() {
            return Err(AssetError::MissingMesh(AssetId(id.0)));
        }
        let mut missing: BTreeSet<TextureId> = scene.texture_ids();
        // The tracer's own bound on textures is far below that on assets.
        for texture in textures.iter().filter(|texture| missing.remove(&texture.id())) {
            blobs.insert(AssetId(texture.id().0), Bytes::from_owner(TextureBytes(texture.clone())));
        }
        match missing.first() {
            Some(id) => Err(AssetError::MissingTexture(AssetId(id.0))),
            None => Ok(Self { scene: scene_id, blobs, drawn: Arc::new(drawn) }),
        }
    }

    /// The hash of the scene body.
    pub fn scene(&self) -> AssetId {
        self.scene
    }

    /// The scene with its meshes and textures.
    pub(crate) fn drawn(&self) -> &Arc<FarmScene> {
        &self.drawn
    }

    /// The size of all assets together, in bytes.
    pub fn total_bytes(&self) -> usize {
        self.blobs.values().map(Bytes::len).sum()
    }

    /// The bytes of an asset; `None` if it is no asset of this scene.
    pub fn get(&self, id: AssetId) -> Option<Bytes> {
        self.blobs.get(&id).cloned()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use rayfarm_tracer::image::RgbImage;
    use rayfarm_tracer::mesh::{Mesh, NamedMaterial};
    use rayfarm_tracer::scene::{Filter, Material, Model, NormalMode, Scene, TextureMap};

    use super::*;
    use crate::testing::test_scene;

    fn assets(
        scene: &Scene,
        meshes: Vec<Arc<CompiledMesh>>,
        textures: Vec<Arc<Texture>>,
    ) -> Result<Assets, AssetError> {
        Assets::new(FarmScene { scene: scene.clone(), meshes, textures })
    }

    fn triangle() -> Arc<CompiledMesh> {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            materials: vec![NamedMaterial::plain("plain", Material::NEUTRAL)],
            ..Mesh::default()
        };
        Arc::new(CompiledMesh::compile(&mesh).unwrap().0)
    }

    fn scene_with(mesh: MeshId) -> Scene {
        let model = Model {
            mesh,
            materials: vec![0],
            normals: NormalMode::Flat,
            translate: DVec3::ZERO,
            rotate: DVec3::ZERO,
            scale: DVec3::ONE,
            group: DMat3::IDENTITY,
        };
        Scene { models: vec![model], ..test_scene::scene() }
    }

    #[test]
    fn assets_are_named_by_their_hash_and_share_the_mesh() {
        let mesh = triangle();
        let scene = scene_with(mesh.id());
        let found = assets(&scene, vec![mesh.clone(), mesh.clone()], Vec::new()).unwrap();
        let bytes = found.get(AssetId(mesh.id().0)).unwrap();
        assert_eq!(bytes.as_ptr(), mesh.bytes().as_ptr());
        assert_eq!(AssetId::of(&bytes).0, mesh.id().0);
        let body = found.get(found.scene()).unwrap();
        assert_eq!(codec::decode::<Scene>(&body, MAX_DECODE_BYTES).unwrap(), scene);
    }

    #[test]
    fn unused_meshes_are_left_out() {
        let mesh = triangle();
        let found = assets(&test_scene::scene(), vec![mesh.clone()], Vec::new()).unwrap();
        assert_eq!(found.get(AssetId(mesh.id().0)), None);
    }

    #[test]
    fn textures_are_shared_and_missing_ones_reported() {
        let texture = |red| {
            let picture = RgbImage { width: 1, height: 1, pixels: vec![red, 0, 0] };
            Arc::new(Texture::new(&picture).unwrap())
        };
        let (named, other) = (texture(1), texture(2));
        let maps = vec![TextureMap::new(named.id(), Filter::Nearest)];
        let scene = Scene { textures: maps, ..test_scene::scene() };
        let found = assets(&scene, Vec::new(), vec![named.clone(), other.clone()]).unwrap();
        let bytes = found.get(AssetId(named.id().0)).unwrap();
        assert_eq!(bytes.as_ptr(), named.bytes().as_ptr());
        assert_eq!(AssetId::of(&bytes).0, named.id().0);
        assert_eq!(found.get(AssetId(other.id().0)), None);
        let error = assets(&scene, Vec::new(), vec![other]).unwrap_err();
        assert!(error.to_string().contains(&named.id().to_string()), "{error}");
    }

    #[test]
    fn a_missing_mesh_is_reported() {
        let error = assets(&scene_with(MeshId([0xab; 32])), Vec::new(), Vec::new()).unwrap_err();
        assert!(error.to_string().contains("abababab"), "{error}");
    }
}
