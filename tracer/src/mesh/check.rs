//! Checks of a compiled mesh, whose bytes may come from a file or a peer: everything that tracing relies on, in O(n).

use glam::{DVec3, Vec3};

use super::blob::{NO_TRIANGLE, TriangleBlock};
use super::{CompiledMesh, MAX_COORDINATE, MAX_TRIANGLES, MeshError};
use crate::bvh::{self, WIDTH};
use crate::texture;

impl CompiledMesh {
    /// Checks tree, indices and numbers.
    pub(super) fn check(&self) -> Result<(), MeshError> {
        let broken = |what: String| Err(MeshError::Format(what));
        if self.header().triangle_count == 0 || self.triangle_count() > MAX_TRIANGLES {
            return broken(format!("it announces {} triangles", self.header().triangle_count));
        }
        let depth = bvh::validate_wide(self.nodes(), self.header().block_count)
            .map_err(|error| MeshError::Format(error.to_string()))?;
        if depth != self.header().depth {
            return broken(format!("its tree is {depth} deep, its header says {}", self.header().depth));
        }
        if self.triangles().count() != self.triangle_count() {
            return broken("its blocks do not hold as many triangles as it announces".into());
        }
        self.check_placement()?;
        let sources = self.sources().chunks_exact(WIDTH);
        if !self.blocks().iter().zip(sources).all(|(block, sources)| corners_are_within_one(block, sources)) {
            return broken("a corner is outside [-1, 1]".into());
        }
        if let Some(slot) = self.slots().iter().find(|&&slot| slot as usize >= self.material_count()) {
            return broken(format!("a triangle names material slot {slot} of {}", self.material_count()));
        }
        let normals = self.normals();
        if self.indices().iter().flatten().any(|&index| index as usize >= normals.len()) {
            return broken("a triangle names a normal that is not there".into());
        }
        if !normals.iter().copied().all(is_within_one) {
            return broken("a normal is longer than 1".into());
        }
        if !self.uvs().iter().flatten().copied().all(texture::is_usable) {
            return broken("a texture coordinate is not finite or too large".into());
        }
        if !self.uv_repeats().iter().copied().all(texture::is_usable) {
            return broken("a number of whole repeats is not finite or too large".into());
        }
        Ok(())
    }

    /// Checks bounds and centre, over which the tree of the scene is built.
    fn check_placement(&self) -> Result<(), MeshError> {
        let (center, (lo, hi)) = (self.center(), self.bounds());
        let reach = DVec3::splat(libm::exp2(f64::from(self.exponent())));
        let inside = center.abs().cmple(DVec3::splat(MAX_COORDINATE)).all()
            && lo.cmple(hi).all()
            && (center - lo).cmple(reach).all()
            && (hi - center).cmple(reach).all();
        if inside {
            Ok(())
        } else {
            Err(MeshError::Format("its bounds do not fit its centre and scale".into()))
        }
    }
}

/// Whether all components are within [-1, 1]. Compared one by one: a maximum would ignore NaN.
fn is_within_one(point: Vec3) -> bool {
    point.abs().cmple(Vec3::ONE).all()
}

/// Whether all triangles of a block are within [-1, 1]. Without branches, because there may be millions.
fn corners_are_within_one(block: &TriangleBlock, sources: &[u32]) -> bool {
    let mut outside = 0;
    for coordinate in block.0.iter().flatten() {
        for (number, &source) in coordinate.0.iter().zip(sources) {
            // False for NaN.
            outside |= u32::from(!(number.abs() <= 1.0)) & u32::from(source != NO_TRIANGLE);
        }
    }
    outside == 0
}
