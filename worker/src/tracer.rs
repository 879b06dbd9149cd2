//! The renderer of `rayfarm_tracer`.

use std::ops::Range;
use std::sync::Arc;

use rayfarm_protocol::limits::{MAX_DECODE_BYTES, MAX_VIEW_BYTES};
use rayfarm_protocol::{AssetId, FrameAnnounce, PixelFormat, codec};
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{ColorDepth, FrameView, Scene};
use rayfarm_tracer::texture::{self, Texture};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

use crate::renderer::{Cancelled, RayCounts, Renderer};

/// Renderer of `rayfarm_tracer`. Scene bodies and views are [`Scene`] and [`FrameView`] as the codec encodes them, meshes
/// are [`CompiledMesh::bytes`], textures are [`Texture::bytes`].
#[derive(Clone, Copy, Debug, Default)]
pub struct TracerRenderer;

/// Decoded asset that a scene names by hash.
#[derive(Debug)]
pub enum Part {
    /// A compiled mesh.
    Mesh(Arc<CompiledMesh>),
    /// A texture.
    Texture(Arc<Texture>),
}

impl Renderer for TracerRenderer {
    type Draft = Scene;
    type Part = Part;
    type Scene = CompiledScene;
    type Frame = PreparedFrame;

    fn simd(&self) -> String {
        rayfarm_tracer::simd_level().to_owned()
    }

    fn band_rows(&self, frame: &PreparedFrame) -> u32 {
        frame.tile_rows()
    }

    fn decode_scene(&self, body: &[u8]) -> Result<(Scene, Vec<AssetId>), String> {
        let scene: Scene = codec::decode(body, MAX_DECODE_BYTES)
            .map_err(|error| format!("the scene does not decode: {error}"))?;
        scene.validate().map_err(|error| format!("the scene is not valid: {error}"))?;
        let meshes = scene.mesh_ids().into_iter().map(|id| AssetId(id.0));
        let textures = scene.texture_ids().into_iter().map(|id| AssetId(id.0));
        let parts = meshes.chain(textures).collect();
        Ok((scene, parts))
    }

    fn decode_part(&self, bytes: &[u8]) -> Result<Part, String> {
        if bytes.starts_with(&texture::MAGIC) {
            let texture =
                Texture::from_bytes(bytes).map_err(|error| format!("a texture is not valid: {error}"))?;
            return Ok(Part::Texture(Arc::new(texture)));
        }
        let mesh =
            CompiledMesh::from_bytes(bytes).map_err(|error| format!("a mesh is not valid: {error}"))?;
        Ok(Part::Mesh(Arc::new(mesh)))
    }

    fn compile(
        &self,
        scene: Scene,
        parts: Vec<Arc<Part>>,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<CompiledScene, String> {
        let (mut meshes, mut textures) = (Vec::new(), Vec::new());
        for part in parts {
            match part.as_ref() {
                Part::Mesh(mesh) => meshes.push(Arc::clone(mesh)),
                Part::Texture(texture) => textures.push(Arc::clone(texture)),
            }
        }
        CompiledScene::new_unless(scene, meshes, textures, cancelled)
            .map_err(|error| format!("the scene does not compile: {error}"))
    }

    fn prepare(
        &self,
        scene: Arc<CompiledScene>,
        announce: &FrameAnnounce,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<PreparedFrame, String> {
        let view: FrameView = codec::decode(&announce.view, MAX_VIEW_BYTES)
            .map_err(|error| format!("the frame's view does not decode: {error}"))?;
        let (width, height) = (announce.width, announce.height);
        if (view.width, view.height) != (width, height) {
            let (w, h) = (view.width, view.height);
            return Err(format!("the frame is announced as {width} x {height}, its view has {w} x {h}"));
        }
        let format = format_of(view.format);
        if format != announce.format {
            return Err(format!(
                "the frame is announced with {:?} pixels, its view has {format:?}",
                announce.format
            ));
        }
        PreparedFrame::new_unless(scene, &view, cancelled)
            .map_err(|error| format!("the frame cannot be prepared: {error}"))
    }

    fn is_rgb565(&self, frame: &PreparedFrame) -> bool {
        frame.view().quality.colors == ColorDepth::Reduced
    }

    fn render(
        &self,
        frame: &PreparedFrame,
        rows: Range<u32>,
        out: &mut [u8],
        cancelled: &dyn Fn() -> bool,
    ) -> Result<RayCounts, Cancelled> {
        let counts = render_rows(frame, rows, out, cancelled).map_err(|_| Cancelled)?;
        Ok(RayCounts { primary: counts.primary, shadow: counts.shadow, secondary: counts.secondary })
    }
}

/// The format of the protocol for one of the tracer.
fn format_of(format: rayfarm_tracer::PixelFormat) -> PixelFormat {
    match format {
        rayfarm_tracer::PixelFormat::Rgb8 => PixelFormat::Rgb8,
        rayfarm_tracer::PixelFormat::Linear => PixelFormat::Linear,
        rayfarm_tracer::PixelFormat::Sums => PixelFormat::Sums,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_have_the_same_bytes_in_tracer_and_protocol() {
        use rayfarm_tracer::PixelFormat as Tracer;
        for format in [Tracer::Rgb8, Tracer::Linear, Tracer::Sums] {
            assert_eq!(format_of(format).row_bytes(9), format.row_bytes(9), "{format:?}");
        }
    }
}
