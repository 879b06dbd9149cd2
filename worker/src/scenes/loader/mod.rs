//! Loading of a scene, from the hash of its body to a compiled scene: request the body, decode it, request the meshes and
//! textures that it names (its *parts*), compile. Assets of the disk cache are not requested.
//!
//! The loader performs no I/O: it returns [`Step`]s and takes their results.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use super::asset_store::AssetStore;
use crate::cancel::CancelGuard;
use crate::renderer::Renderer;

mod arrivals;
mod step;

use arrivals::Arrival;
pub(crate) use step::{AssetRequest, SceneResult, SceneWork, Step};

/// Most assets in transfer at a time. More than one, so that the next asset arrives while one is decoded.
const MAX_REQUESTS: usize = 4;

/// Most compiled scenes in memory beyond those in use. A scene that is edited becomes another one with each change, and a
/// compiled scene takes more memory than its body, with which it counts.
const MAX_SCENES: usize = 16;

/// Most failed scenes that are remembered. A remembered scene is not requested again for every frame.
const MAX_FAILED: usize = 64;

/// Value of the asset store.
enum Stored<R: Renderer> {
    Part(Arc<R::Part>),
    Scene { scene: Arc<R::Scene>, parts: BTreeSet<AssetId> },
}

/// State of an asset that is needed and not yet in the store.
enum Incoming {
    /// Queued: too many assets are in transfer.
    Queued,
    /// Being looked for on the disk.
    Searching,
    /// Being read from the disk.
    Reading,
    /// Requested from the master.
    Requested,
    /// In transfer.
    Arriving(Arrival),
    /// Complete, being decoded.
    Decoding,
}

/// A scene that is being loaded.
struct Load<R: Renderer> {
    body_bytes: u64,
    draft: Option<R::Draft>,
    parts: BTreeSet<AssetId>,
    /// Cancels the compilation when the load is dropped.
    cancel: CancelGuard,
}

/// Loader and in-memory cache of scenes. The cache persists across sessions; the other state is per session.
pub(crate) struct SceneLoader<R: Renderer> {
    store: AssetStore<Stored<R>>,
    /// Each asset with the number of bytes reserved for it.
    incoming: BTreeMap<AssetId, (Incoming, u64)>,
    /// The scene bodies among them, also those whose loads were dropped.
    bodies: BTreeSet<AssetId>,
    queue: VecDeque<AssetId>,
    loads: BTreeMap<AssetId, Load<R>>,
    /// Scenes that cannot be loaded, with the reason.
    failed: BTreeMap<AssetId, String>,
    /// Those of them for which the master did not have an asset.
    absent: BTreeSet<AssetId>,
    /// Scenes of the announced frames.
    current: BTreeSet<AssetId>,
    steps: VecDeque<Step<R>>,
    /// Whether assets are looked for on the disk first.
    has_disk: bool,
    /// Whether large assets are served to other workers.
    serves_peers: bool,
}

impl<R: Renderer> SceneLoader<R> {
    /// Makes a loader whose in-memory cache has at most `cache_bytes`.
    pub(crate) fn new(cache_bytes: u64) -> Self {
        Self {
            store: AssetStore::new(cache_bytes),
            incoming: BTreeMap::new(),
            bodies: BTreeSet::new(),
            queue: VecDeque::new(),
            loads: BTreeMap::new(),
            failed: BTreeMap::new(),
            absent: BTreeSet::new(),
            current: BTreeSet::new(),
            steps: VecDeque::new(),
            has_disk: false,
            serves_peers: false,
        }
    }

    /// Drops all loads, transfers and failures, at the beginning and at the end of a session.
    pub(crate) fn reset(&mut self, has_disk: bool, serves_peers: bool) {
        (self.has_disk, self.serves_peers) = (has_disk, serves_peers);
        self.incoming.clear();
        self.bodies.clear();
        self.queue.clear();
        self.loads.clear();
        self.failed.clear();
        self.absent.clear();
        self.steps.clear();
    }

    /// Returns the next step. Must be called until it returns `None` after every other method.
    pub(crate) fn poll_step(&mut self) -> Option<Step<R>> {
        self.steps.pop_front()
    }

    /// Sets the scenes in use, whose assets are not evicted. Loads of other scenes are dropped, which cancels their
    /// compilation.
    pub(crate) fn set_current(&mut self, scenes: BTreeSet<AssetId>) {
        self.loads.retain(|id, _| scenes.contains(id));
        // The master may have the assets of a scene again that it shows again, when a change of the scene was undone.
        for scene in self.absent.extract_if(.., |id| !scenes.contains(id)) {
            self.failed.remove(&scene);
        }
        self.current = scenes;
        let needed = self.in_use();
        self.queue.retain(|id| needed.contains(id));
        self.incoming.retain(|id, (state, _)| !matches!(state, Incoming::Queued) || needed.contains(id));
        self.bodies.retain(|id| self.incoming.contains_key(id));
    }

    /// Loads a scene, unless it is being loaded. Leads to a [`Step::Ready`] or a [`Step::Failed`].
    pub(crate) fn load(&mut self, scene: AssetId) {
        if let Some(found) = self.cached(scene) {
            self.steps.push_back(Step::Ready(scene, found));
        } else if let Some(reason) = self.failed.get(&scene) {
            self.steps.push_back(Step::Failed(scene, reason.clone()));
        } else if let Entry::Vacant(entry) = self.loads.entry(scene) {
            entry.insert(Load {
                body_bytes: 0,
                draft: None,
                parts: BTreeSet::new(),
                cancel: CancelGuard::default(),
            });
            self.bodies.insert(scene);
            self.enqueue(scene);
        }
    }

    /// Looks up a compiled scene and marks it and all its parts as used, so that no part is evicted before its scene.
    fn cached(&mut self, id: AssetId) -> Option<Arc<R::Scene>> {
        let Some(Stored::Scene { scene, parts }) = self.store.get(id) else { return None };
        let (scene, parts) = (Arc::clone(scene), parts.clone());
        for part in parts {
            self.store.get(part);
        }
        Some(scene)
    }

    fn enqueue(&mut self, id: AssetId) {
        if let Entry::Vacant(entry) = self.incoming.entry(id) {
            entry.insert((Incoming::Queued, 0));
            self.queue.push_back(id);
        }
        self.start_requests();
    }

    /// Starts transfers of queued assets, up to [`MAX_REQUESTS`] at a time.
    fn start_requests(&mut self) {
        let is_active = |state: &Incoming| !matches!(state, Incoming::Queued | Incoming::Decoding);
        let mut active = self.incoming.values().filter(|(state, _)| is_active(state)).count();
        while active < MAX_REQUESTS
            && let Some(id) = self.queue.pop_front()
        {
            if self.has_disk {
                self.incoming.insert(id, (Incoming::Searching, 0));
                self.steps.push_back(Step::Work(SceneWork::Find { id }));
            } else {
                self.request_from_master(id);
            }
            active += 1;
        }
    }

    fn request_from_master(&mut self, id: AssetId) {
        self.incoming.insert(id, (Incoming::Requested, 0));
        self.steps.push_back(Step::Request(AssetRequest { id, offset: 0, again: false }));
    }

    /// Handles the size of an asset's file. A file that does not fit into memory may be damaged, so the master is requested
    /// to announce the size.
    fn handle_found(&mut self, id: AssetId, size: Option<u64>) {
        if !matches!(self.incoming.get(&id), Some((Incoming::Searching, _))) {
            return;
        }
        match size.filter(|size| self.reserve(id, *size).is_ok()) {
            Some(size) => {
                self.incoming.insert(id, (Incoming::Reading, size));
                self.steps.push_back(Step::Work(SceneWork::Read { id, size }));
            }
            None => self.request_from_master(id),
        }
    }

    fn handle_read(&mut self, id: AssetId, bytes: Option<Vec<u8>>) {
        if !matches!(self.incoming.get(&id), Some((Incoming::Reading, _))) {
            return;
        }
        match bytes {
            Some(bytes) => self.decode(id, bytes.into()),
            None => self.request_from_master(id),
        }
        self.start_requests();
    }

    /// Starts to decode the bytes of an asset.
    fn decode(&mut self, id: AssetId, bytes: Bytes) {
        if let Some((state, _)) = self.incoming.get_mut(&id) {
            *state = Incoming::Decoding;
        }
        let work = match self.bodies.contains(&id) {
            true => SceneWork::DecodeScene { id, body: bytes },
            false => SceneWork::DecodePart { id, bytes },
        };
        self.steps.push_back(Step::Work(work));
    }

    /// Handles the result of a [`Step::Work`].
    pub(crate) fn handle_result(&mut self, result: SceneResult<R>) {
        match result {
            SceneResult::Found { id, size } => self.handle_found(id, size),
            SceneResult::Read { id, bytes } => self.handle_read(id, bytes),
            SceneResult::SceneDecoded { id, result } => match (self.release(id), result) {
                (bytes, Ok((draft, parts))) => self.scene_decoded(id, bytes, draft, parts),
                (_, Err(reason)) => self.fail(id, &reason),
            },
            SceneResult::PartDecoded { id, result } => match (self.release(id), result) {
                (bytes, Ok(part)) => self.part_decoded(id, bytes, part),
                (_, Err(reason)) => self.fail(id, &reason),
            },
            SceneResult::Compiled { id, result } => match result {
                Ok(scene) => self.compiled(id, scene),
                Err(reason) => self.fail(id, &reason),
            },
        }
    }

    /// Ends the arrival of an asset and returns the number of bytes that were reserved for it.
    fn release(&mut self, id: AssetId) -> u64 {
        self.bodies.remove(&id);
        self.incoming.remove(&id).map_or(0, |(_, bytes)| bytes)
    }

    fn scene_decoded(&mut self, id: AssetId, body_bytes: u64, draft: R::Draft, parts: Vec<AssetId>) {
        let Some(load) = self.loads.get_mut(&id) else { return };
        let parts: BTreeSet<AssetId> = parts.into_iter().collect();
        (load.body_bytes, load.draft, load.parts) = (body_bytes, Some(draft), parts.clone());
        for part in parts {
            if self.store.get(part).is_none() {
                self.enqueue(part);
            }
        }
        self.compile_if_complete(id);
    }

    fn part_decoded(&mut self, id: AssetId, bytes: u64, part: R::Part) {
        self.store.insert(id, Stored::Part(Arc::new(part)), bytes);
        let waiting = self.loads.iter().filter(|(_, load)| load.parts.contains(&id));
        for scene in waiting.map(|(scene, _)| *scene).collect::<Vec<_>>() {
            self.compile_if_complete(scene);
        }
    }

    fn compile_if_complete(&mut self, id: AssetId) {
        let Some(load) = self.loads.get_mut(&id) else { return };
        let part_of = |part: &AssetId| match self.store.get(*part) {
            Some(Stored::Part(part)) => Some(Arc::clone(part)),
            _ => None,
        };
        let Some(parts) = load.parts.iter().map(part_of).collect::<Option<Vec<_>>>() else { return };
        if let Some(draft) = load.draft.take() {
            let cancel = load.cancel.flag();
            self.steps.push_back(Step::Work(SceneWork::Compile { id, draft, parts, cancel }));
        }
    }

    fn compiled(&mut self, id: AssetId, scene: R::Scene) {
        let Some(Load { body_bytes, parts, .. }) = self.loads.remove(&id) else { return };
        let scene = Arc::new(scene);
        let reserved: u64 = self.incoming.values().map(|(_, bytes)| bytes).sum();
        let mut needed = self.in_use();
        needed.extend(&parts);
        // Where it does not fit, the scene is used and not kept.
        self.evict_scenes(&needed);
        if self.store.make_room(body_bytes, reserved, &needed) {
            self.store.insert(id, Stored::Scene { scene: Arc::clone(&scene), parts }, body_bytes);
        }
        self.steps.push_back(Step::Ready(id, scene));
    }

    /// Evicts the least recently used scenes beyond [`MAX_SCENES`], except those in `needed`.
    fn evict_scenes(&mut self, needed: &BTreeSet<AssetId>) {
        let is_scene = |stored: &Stored<R>| matches!(stored, Stored::Scene { .. });
        self.store.keep_most_recent(MAX_SCENES, is_scene, needed);
    }

    /// Fails all scenes that need an asset. They are not loaded again in this session.
    fn fail(&mut self, asset: AssetId, reason: &str) {
        self.failed_without(asset, reason);
    }

    /// [`Self::fail`], which returns the scenes.
    fn failed_without(&mut self, asset: AssetId, reason: &str) -> Vec<AssetId> {
        self.release(asset);
        self.queue.retain(|queued| *queued != asset);
        let affected = self.loads.iter().filter(|(id, load)| **id == asset || load.parts.contains(&asset));
        let affected: Vec<AssetId> = affected.map(|(id, _)| *id).collect();
        for &scene in &affected {
            self.loads.remove(&scene);
            if self.failed.len() >= MAX_FAILED {
                self.failed.clear();
            }
            self.failed.insert(scene, reason.to_owned());
            self.steps.push_back(Step::Failed(scene, reason.to_owned()));
        }
        self.start_requests();
        affected
    }

    /// Ids of the current scenes, of the scenes being loaded, and of the parts of both.
    fn in_use(&self) -> BTreeSet<AssetId> {
        let mut ids = self.current.clone();
        for (id, load) in &self.loads {
            ids.insert(*id);
            ids.extend(&load.parts);
        }
        for scene in &self.current {
            if let Some(Stored::Scene { parts, .. }) = self.store.peek(*scene) {
                ids.extend(parts);
            }
        }
        ids
    }
}
