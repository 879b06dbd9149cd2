//! From the hash of a scene to a scene that can be rendered: ask for its body, decode it, ask for the meshes and
//! textures it names (its *parts*), compile. What the disk still has from an earlier run is not asked for. Pure: what has
//! to be done comes out as [`Step`]s, and what became of it goes in again.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use bytes::Bytes;
use rayfarm_protocol::AssetId;

use crate::asset_store::AssetStore;
use crate::renderer::Renderer;
use crate::wanted::Claim;

mod arrivals;
mod step;

use arrivals::Arrival;
pub(crate) use step::{SceneDone, SceneWork, Step, Wish};

/// Assets that are asked for at a time: the next one is on its way while one is decoded.
const MAX_ASKED: usize = 4;

/// Failed scenes that are remembered, so that they are not fetched again for every frame.
const MAX_REFUSED: usize = 64;

enum Stored<R: Renderer> {
    Part(Arc<R::Part>),
    Scene { scene: Arc<R::Scene>, parts: BTreeSet<AssetId> },
}

/// An asset between the wish for it and its place in the store.
enum Incoming {
    Wished,
    /// Looked for on the disk.
    Sought,
    /// Read from there.
    Reading,
    Asked,
    Arriving(Arrival),
    Decoding,
}

/// A scene that is being put together.
struct Load<R: Renderer> {
    body_bytes: u64,
    draft: Option<R::Draft>,
    parts: BTreeSet<AssetId>,
    /// On the compiled scene.
    claim: Claim,
}

/// Fetches scenes and keeps them. The store outlives sessions; the rest begins anew with each.
pub(crate) struct SceneLoader<R: Renderer> {
    store: AssetStore<Stored<R>>,
    /// With the bytes reserved for each.
    incoming: BTreeMap<AssetId, (Incoming, u64)>,
    wishes: VecDeque<AssetId>,
    loads: BTreeMap<AssetId, Load<R>>,
    refused: BTreeMap<AssetId, String>,
    current: BTreeSet<AssetId>,
    steps: VecDeque<Step<R>>,
    /// Whether there is a disk to look at first.
    has_disk: bool,
    /// Whether what comes in may be passed on.
    shares: bool,
}

impl<R: Renderer> SceneLoader<R> {
    pub(crate) fn new(cache_bytes: u64) -> Self {
        Self {
            store: AssetStore::new(cache_bytes),
            incoming: BTreeMap::new(),
            wishes: VecDeque::new(),
            loads: BTreeMap::new(),
            refused: BTreeMap::new(),
            current: BTreeSet::new(),
            steps: VecDeque::new(),
            has_disk: false,
            shares: false,
        }
    }

    /// A new session, or the end of one: nothing is on its way any more, and what failed may succeed.
    pub(crate) fn reset(&mut self, has_disk: bool, shares: bool) {
        (self.has_disk, self.shares) = (has_disk, shares);
        self.incoming.clear();
        self.wishes.clear();
        self.loads.clear();
        self.refused.clear();
        self.steps.clear();
    }

    pub(crate) fn poll_step(&mut self) -> Option<Step<R>> {
        self.steps.pop_front()
    }

    /// These scenes are in use, and nothing of theirs may be evicted; loads of others are dropped, also while they compile.
    pub(crate) fn set_current(&mut self, scenes: BTreeSet<AssetId>) {
        self.loads.retain(|id, _| scenes.contains(id));
        self.current = scenes;
        let needed = self.in_use();
        self.wishes.retain(|id| needed.contains(id));
        self.incoming.retain(|id, (state, _)| !matches!(state, Incoming::Wished) || needed.contains(id));
    }

    /// Begins to load a scene unless that is under way. Ends in a [`Step::Ready`] or [`Step::Failed`], soon or at once.
    pub(crate) fn want(&mut self, scene: AssetId) {
        if let Some(found) = self.cached(scene) {
            self.steps.push_back(Step::Ready(scene, found));
        } else if let Some(reason) = self.refused.get(&scene) {
            self.steps.push_back(Step::Failed(scene, reason.clone()));
        } else if let Entry::Vacant(entry) = self.loads.entry(scene) {
            entry.insert(Load {
                body_bytes: 0,
                draft: None,
                parts: BTreeSet::new(),
                claim: Claim::default(),
            });
            self.wish(scene);
        }
    }

    /// Marks the scene and all its parts as just used: a scene never outlives its parts in the store.
    fn cached(&mut self, id: AssetId) -> Option<Arc<R::Scene>> {
        let Some(Stored::Scene { scene, parts }) = self.store.get(id) else { return None };
        let (scene, parts) = (Arc::clone(scene), parts.clone());
        for part in parts {
            self.store.get(part);
        }
        Some(scene)
    }

    fn wish(&mut self, id: AssetId) {
        if let Entry::Vacant(entry) = self.incoming.entry(id) {
            entry.insert((Incoming::Wished, 0));
            self.wishes.push_back(id);
        }
        self.ask();
    }

    fn ask(&mut self) {
        let is_asked = |state: &Incoming| !matches!(state, Incoming::Wished | Incoming::Decoding);
        let mut asked = self.incoming.values().filter(|(state, _)| is_asked(state)).count();
        while asked < MAX_ASKED
            && let Some(id) = self.wishes.pop_front()
        {
            if self.has_disk {
                self.incoming.insert(id, (Incoming::Sought, 0));
                self.steps.push_back(Step::Work(SceneWork::Find { id }));
            } else {
                self.ask_master(id);
            }
            asked += 1;
        }
    }

    fn ask_master(&mut self, id: AssetId) {
        self.incoming.insert(id, (Incoming::Asked, 0));
        self.steps.push_back(Step::Ask(Wish { id, offset: 0, again: false }));
    }

    /// What the disk has of an asset. One that does not fit is the master's to announce: only its size is to be believed.
    fn found(&mut self, id: AssetId, size: Option<u64>) {
        if !matches!(self.incoming.get(&id), Some((Incoming::Sought, _))) {
            return;
        }
        match size.filter(|size| self.admit(id, *size).is_ok()) {
            Some(size) => {
                self.incoming.insert(id, (Incoming::Reading, size));
                self.steps.push_back(Step::Work(SceneWork::Read { id, size }));
            }
            None => self.ask_master(id),
        }
    }

    fn read(&mut self, id: AssetId, bytes: Option<Vec<u8>>) {
        if !matches!(self.incoming.get(&id), Some((Incoming::Reading, _))) {
            return;
        }
        match bytes {
            Some(bytes) => self.decode(id, bytes.into()),
            None => self.ask_master(id),
        }
        self.ask();
    }

    /// Has the bytes decoded that bear this name.
    fn decode(&mut self, id: AssetId, bytes: Bytes) {
        if let Some((state, _)) = self.incoming.get_mut(&id) {
            *state = Incoming::Decoding;
        }
        let work = match self.loads.contains_key(&id) {
            true => SceneWork::DecodeScene { id, body: bytes },
            false => SceneWork::DecodePart { id, bytes },
        };
        self.steps.push_back(Step::Work(work));
    }

    /// Takes the result of a [`Step::Work`].
    pub(crate) fn done(&mut self, done: SceneDone<R>) {
        match done {
            SceneDone::Found { id, size } => self.found(id, size),
            SceneDone::Read { id, bytes } => self.read(id, bytes),
            SceneDone::SceneDecoded { id, result } => match (self.arrived(id), result) {
                (bytes, Ok((draft, parts))) => self.scene_decoded(id, bytes, draft, parts),
                (_, Err(reason)) => self.fail(id, &reason),
            },
            SceneDone::PartDecoded { id, result } => match (self.arrived(id), result) {
                (bytes, Ok(part)) => self.part_decoded(id, bytes, part),
                (_, Err(reason)) => self.fail(id, &reason),
            },
            SceneDone::Compiled { id, result } => match result {
                Ok(scene) => self.compiled(id, scene),
                Err(reason) => self.fail(id, &reason),
            },
        }
    }

    fn arrived(&mut self, id: AssetId) -> u64 {
        self.incoming.remove(&id).map_or(0, |(_, bytes)| bytes)
    }

    fn scene_decoded(&mut self, id: AssetId, body_bytes: u64, draft: R::Draft, parts: Vec<AssetId>) {
        let Some(load) = self.loads.get_mut(&id) else { return };
        let parts: BTreeSet<AssetId> = parts.into_iter().collect();
        (load.body_bytes, load.draft, load.parts) = (body_bytes, Some(draft), parts.clone());
        for part in parts {
            if self.store.get(part).is_none() {
                self.wish(part);
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
            let wanted = load.claim.wanted();
            self.steps.push_back(Step::Work(SceneWork::Compile { id, draft, parts, wanted }));
        }
    }

    fn compiled(&mut self, id: AssetId, scene: R::Scene) {
        let Some(Load { body_bytes, parts, .. }) = self.loads.remove(&id) else { return };
        let scene = Arc::new(scene);
        let reserved: u64 = self.incoming.values().map(|(_, bytes)| bytes).sum();
        let mut needed = self.in_use();
        needed.extend(&parts);
        // Without room it is used all the same, and only not kept.
        if self.store.make_room(body_bytes, reserved, &needed) {
            self.store.insert(id, Stored::Scene { scene: Arc::clone(&scene), parts }, body_bytes);
        }
        self.steps.push_back(Step::Ready(id, scene));
    }

    /// The asset will not come, or is worth nothing: neither are the scenes that need it.
    fn fail(&mut self, asset: AssetId, reason: &str) {
        self.incoming.remove(&asset);
        self.wishes.retain(|wish| *wish != asset);
        let hit = self.loads.iter().filter(|(id, load)| **id == asset || load.parts.contains(&asset));
        for scene in hit.map(|(id, _)| *id).collect::<Vec<_>>() {
            self.loads.remove(&scene);
            if self.refused.len() >= MAX_REFUSED {
                self.refused.clear();
            }
            self.refused.insert(scene, reason.to_owned());
            self.steps.push_back(Step::Failed(scene, reason.to_owned()));
        }
        self.ask();
    }

    /// Current scenes, scenes being loaded, and the parts of both.
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
