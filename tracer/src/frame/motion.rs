//! Objects that move while the shutter is open.
//!
//! The structures of a frame have the poses when the shutter opens, the *rest*. At a time from 0 to 1 an object is where a map takes its
//! rest, and what a ray hits there is what the ray hits at rest after the inverse map, at the same t. For the position p of a model's
//! origin, its rotation R and the transforms W of its groups:
//!
//! ```text
//! x(t) = W Q(t) W^-1 (x - p(0)) + p(t)      Q(t) = R(t) R(0)^-1      p(t) = p(0) + t (p(1) - p(0))
//! ```
//!
//! The angles of R(t) change evenly. Of a sphere only the position changes.

use glam::{DMat3, DVec3};

use super::BOX_PADDING;
use super::instance::ToEye;
use crate::bvh::{self, BuildQuality, WideNode};
use crate::cancel::{Cancelled, IsCancelled};
use crate::compile::{CompiledScene, Items, moving_item, orientation, transformed_bounds};
use crate::rotation;
use crate::scene::{FrameView, Model, Motion};

/// Factor of the reach of models that rotate, for the rounding of their rotation.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1 << 30) as f64;

/// The way of an item in world space.
pub(super) struct Sweep {
    item: u32,
    /// Bounds of all its poses.
    pub bounds: (DVec3, DVec3),
    /// Position at rest, and when the shutter closes.
    from: DVec3,
    to: DVec3,
    turn: Option<Turn>,
}

/// The rotation of a model.
#[derive(Clone, Copy, Debug)]
struct Turn {
    /// Degrees at rest.
    start: DVec3,
    /// Degrees until the shutter closes.
    by: DVec3,
    /// The inverse of the rotation at rest.
    to_start: DMat3,
    /// W and its inverse.
    around: DMat3,
    back: DMat3,
}

/// The items of a frame that move, with a tree over the boxes of all their poses.
#[derive(Debug)]
pub(crate) struct Motions {
    /// In the order of the items.
    pub items: Vec<MovingItem>,
    pub nodes: Vec<WideNode>,
    /// Indices of `items`.
    pub blocks: Vec<Vec<u32>>,
}

/// An item that moves, in eye space.
#[derive(Debug)]
pub(crate) struct MovingItem {
    pub item: u32,
    from: DVec3,
    way: DVec3,
    turn: Option<Turn>,
}

/// The map from the rest of an item to its pose at a time.
pub(crate) struct Pose {
    from: DVec3,
    to: DVec3,
    /// Linear part and its inverse, unless these are the identity.
    turn: Option<[DMat3; 2]>,
}

/// The items that move in the frames of a view, in their order; none if the view does not show their motion.
pub(super) fn sweeps(scene: &CompiledScene, view: &FrameView) -> Vec<Sweep> {
    if !(scene.features().motion && view.shows_motion()) {
        return Vec::new();
    }
    let source = scene.scene();
    let items = Items::of(source);
    let moving = source.motions.iter().filter(|motion| motion.moves(source));
    let mut sweeps: Vec<Sweep> = moving
        .map(|motion| {
            let item = moving_item(&items, motion);
            match *motion {
                Motion::Sphere { sphere, center: to } => {
                    let sphere = &source.spheres[sphere as usize];
                    let (from, reach) = (sphere.center, sphere.radius);
                    Sweep { item, bounds: (from.min(to) - reach, from.max(to) + reach), from, to, turn: None }
                }
                Motion::Model { model, translate, rotate } => {
                    let index = model as usize;
                    let (model, bounds) = (&source.models[index], scene.meshes()[index].bounds());
                    of_model((item, model), bounds, (translate, rotate), view.spin)
                }
            }
        })
        .collect();
    sweeps.sort_unstable_by_key(|sweep| sweep.item);
    sweeps
}

/// The way of a model to a position and a rotation; `mesh` are the bounds in its file.
fn of_model(
    (item, model): (u32, &Model),
    mesh: (DVec3, DVec3),
    (to, rotate): (DVec3, DVec3),
    spin: f64,
) -> Sweep {
    let (from, linear) = (model.translate, orientation(model, spin));
    if rotate == model.rotate {
        let (lo, hi) = transformed_bounds(mesh, linear, from);
        let way = to - from;
        let bounds = (lo.min(lo + way), hi.max(hi + way));
        return Sweep { item, bounds, from, to, turn: None };
    }
    let corner = |index: usize| {
        let pick = |axis: usize| if index >> axis & 1 == 0 { mesh.0[axis] } else { mesh.1[axis] };
        (linear * DVec3::new(pick(0), pick(1), pick(2))).length()
    };
    let reach = (0..8).map(corner).fold(0.0, f64::max) * ROUNDED_UP;
    let around = rotation::about_y(spin) * model.group;
    let turn = Turn {
        start: model.rotate,
        by: rotate - model.rotate,
        to_start: rotation::of_model(model.rotate).transpose(),
        around,
        back: around.inverse(),
    };
    Sweep { item, bounds: (from.min(to) - reach, from.max(to) + reach), from, to, turn: Some(turn) }
}

impl Motions {
    /// Places items that move in eye space; `None` if there are none.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub(super) fn new(
        sweeps: &[Sweep],
        to_eye: &ToEye,
        cancelled: &IsCancelled<'_>,
    ) -> Result<Option<Box<Self>>, Cancelled> {
        if sweeps.is_empty() {
            return Ok(None);
        }
        let boxes: Vec<_> = sweeps
            .iter()
            .map(|Sweep { bounds: (lo, hi), .. }| {
                let (lo, hi) = (to_eye.point(*lo), to_eye.point(*hi));
                ((lo - BOX_PADDING).as_vec3(), (hi + BOX_PADDING).as_vec3())
            })
            .collect();
        let tree = bvh::build_wide(&boxes, 1, BuildQuality::Default, cancelled)?;
        let place = |sweep: &Sweep| MovingItem {
            item: sweep.item,
            from: to_eye.point(sweep.from),
            way: (sweep.to - sweep.from) / to_eye.unit,
            turn: sweep.turn,
        };
        let items = sweeps.iter().map(place).collect();
        Ok(Some(Box::new(Self { items, nodes: tree.nodes, blocks: tree.blocks })))
    }

    /// An item, if it moves.
    pub(crate) fn of(&self, item: u32) -> Option<&MovingItem> {
        let place = self.items.binary_search_by_key(&item, |moving| moving.item).ok()?;
        self.items.get(place)
    }
}

impl MovingItem {
    /// The pose at a time from 0, when the shutter opens, to 1, when it closes.
    pub(crate) fn pose(&self, time: f64) -> Pose {
        let turn = self.turn.map(|turn| turn.at(time));
        Pose { from: self.from, to: self.from + self.way * time, turn }
    }
}

impl Turn {
    /// W Q W^-1, and its inverse.
    fn at(&self, time: f64) -> [DMat3; 2] {
        let turned = rotation::of_model(self.start + self.by * time) * self.to_start;
        [self.around * turned * self.back, self.around * turned.transpose() * self.back]
    }
}

impl Pose {
    /// A direction as seen from the object at rest.
    pub(crate) fn direction_to_rest(&self, direction: DVec3) -> DVec3 {
        match &self.turn {
            Some([_, inverse]) => *inverse * direction,
            None => direction,
        }
    }

    /// The point of the object at rest that is at a point in this pose.
    pub(crate) fn point_to_rest(&self, point: DVec3) -> DVec3 {
        match &self.turn {
            Some([_, inverse]) => *inverse * (point - self.to) + self.from,
            None => point - (self.to - self.from),
        }
    }

    /// Where a point of the object at rest is in this pose.
    pub(crate) fn point_from_rest(&self, point: DVec3) -> DVec3 {
        match &self.turn {
            Some([linear, _]) => *linear * (point - self.from) + self.to,
            None => point + (self.to - self.from),
        }
    }

    /// A unit normal of the object at rest in this pose.
    pub(crate) fn normal_from_rest(&self, normal: DVec3) -> DVec3 {
        match &self.turn {
            Some([_, inverse]) => (inverse.transpose() * normal).normalize_or_zero(),
            None => normal,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::MeshId;
    use crate::scene::NormalMode;

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-2.0..2.0_f64).prop_map(DVec3::from_array)
    }

    proptest! {
        #[test]
        fn models_go_from_pose_to_pose_within_their_bounds(
            places in [vector(), vector()], angles in [vector(), vector()], point in vector(),
            group in vector(), size in 0.1..3.0_f64, mirrored: bool, spin in -360.0..360.0_f64, time in 0.0..=1.0_f64,
        ) {
            let axes = DVec3::new(if mirrored { -size } else { size }, size, size);
            let model = |translate, angles| Model {
                mesh: MeshId([0; 32]),
                materials: Vec::new(),
                normals: NormalMode::Flat,
                translate,
                rotate: angles * 180.0,
                scale: DVec3::new(1.0, -2.0, 0.5),
                group: rotation::of_model(group * 90.0) * DMat3::from_diagonal(axes),
            };
            let pose_at = |time: f64| model(places[0].lerp(places[1], time), angles[0].lerp(angles[1], time));
            let (opening, closing) = (pose_at(0.0), pose_at(1.0));
            let mesh = (point.min(DVec3::ZERO), point.max(DVec3::ONE));
            let sweep = of_model((0, &opening), mesh, (closing.translate, closing.rotate), spin);
            let place = |model: &Model| orientation(model, spin) * point + model.translate;
            let then = place(&pose_at(time));
            let (lo, hi) = sweep.bounds;
            prop_assert!((then - lo).min_element() > -1e-9 && (hi - then).min_element() > -1e-9);
            let to_eye = ToEye { eye: DVec3::new(0.3, -0.7, 1.1), unit: 8.0 };
            let motions = Motions::new(&[sweep], &to_eye, &crate::cancel::never).unwrap().unwrap();
            let pose = motions.of(0).unwrap().pose(time);
            let rest = to_eye.point(place(&opening));
            let error = (pose.point_from_rest(rest) - to_eye.point(then)).length();
            prop_assert!(error < 1e-12, "{}", error);
            prop_assert!((pose.point_to_rest(to_eye.point(then)) - rest).length() < 1e-12);
            let direction = pose.direction_to_rest(DVec3::Y);
            prop_assert!((direction.length() - 1.0).abs() < 1e-12);
            prop_assert!((pose.normal_from_rest(direction) - DVec3::Y).length() < 1e-12);
        }
    }

    #[test]
    fn poses_at_the_opening_are_the_rest() {
        let to_eye = ToEye { eye: DVec3::ZERO, unit: 1.0 };
        let (from, to) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(7.0, 8.0, 9.0));
        let sweep = Sweep { item: 3, bounds: (from.min(to), from.max(to)), from, to, turn: None };
        let motions = Motions::new(&[sweep], &to_eye, &crate::cancel::never).unwrap().unwrap();
        assert!(motions.of(2).is_none());
        let pose = motions.of(3).unwrap().pose(0.0);
        assert_eq!(pose.point_to_rest(DVec3::ONE), DVec3::ONE);
        assert_eq!(pose.point_from_rest(DVec3::ONE), DVec3::ONE);
    }
}
