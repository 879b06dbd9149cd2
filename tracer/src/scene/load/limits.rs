//! Bounds of what one scene may take.

/// Bounds of what one scene may take, beyond those of [`Scene::validate`](crate::scene::Scene::validate).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of all textures, in the memory of the master and of every worker. A picture file of a few kilobytes may decode to
    /// 192 MiB.
    pub texture_bytes: u64,
    /// Material slots of all instances. Each instance has its own list of them.
    pub material_slots: usize,
}

impl Default for LoadLimits {
    /// 4 GiB of textures, 4,194,304 material slots.
    fn default() -> Self {
        Self { texture_bytes: 4 << 30, material_slots: 1 << 22 }
    }
}
