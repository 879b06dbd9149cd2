//! The oracle: the shading equations in `f64`, every ray against every primitive, no tree, no SIMD, no shortcuts.
//!
//! Of a frame's quality it knows what to leave out (shadows, highlights) and the filter; it is exact where a knob trades precision.
//!
//! It shares with the fast path only the scene, the cleaned triangles and the sRGB encoding: whatever
//! else it computes, it computes from the equations of the model of light, to be read against them.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, DVec4, Vec2, Vec3};

use crate::image::RgbImage;
use crate::intersect::{self, RayHit};
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::{
    Attenuation, Background, Filter, FrameView, Light, LightKind, Material, NormalMode, Scene, Shading,
    TextureMap, Wrap,
};
use crate::srgb;
use crate::texture::Texture;

/// Nothing nearer than this share of the scene's size is in a shadow ray's way: it is where the ray starts.
const NEAR: f64 = 1e-11;

/// Half a step of an `f32`, relative to the number: corners of meshes are rounded to it, and lie within [-1, 1].
const HALF_STEP: f64 = 1.0 / (1 << 24) as f64;

/// What the digits of an `f64` are good for after a handful of operations.
const DIGITS: f64 = 1.0 / (1_u64 << 50) as f64;

/// Nothing at the last 10^-9 of the way to a light is in its way: a surface that holds a light does not hide it.
const BEFORE_LIGHT: f64 = 1.0 - 1e-9;

/// A scene, flattened to world space relative to the camera.
pub struct Oracle {
    scene: Scene,
    view: FrameView,
    textures: Vec<Arc<Texture>>,
    primitives: Vec<Primitive>,
    size: f64,
}

struct Primitive {
    shape: Shape,
    material: u32,
    /// Its place in the scene.
    name: intersect::Primitive,
    /// How far rounding may have carried it, across itself.
    off: f64,
    /// Whether its front is seen from where its corners go round clockwise: a mirrored mesh.
    mirrored: bool,
}

#[allow(clippy::large_enum_variant, reason = "nearly all are triangles")]
enum Shape {
    Triangle { corners: [DVec3; 3], normals: Option<[DVec3; 3]>, skin: Skin },
    Sphere { center: DVec3, radius: f64 },
    Plane { point: DVec3, normal: DVec3 },
}

/// What the corners of a triangle carry beside normals.
#[derive(Clone, Copy)]
struct Skin {
    /// Texture coordinates; zero where there are none.
    uvs: [DVec2; 3],
    /// Linear RGB; white where there are none.
    colors: [DVec3; 3],
    /// The front is the side that looks along (b - a) x (c - a), or the other one: the instance is mirrored.
    mirrored: bool,
}

impl Skin {
    fn new(uvs: Option<[Vec2; 3]>) -> Self {
        let uvs = uvs.unwrap_or_default().map(Vec2::as_dvec2);
        Self { uvs, colors: [DVec3::ONE; 3], mirrored: false }
    }
}

/// Where a ray meets a shape.
struct Crossing {
    t: f64,
    normal: DVec3,
    shading_normal: DVec3,
    /// Texture coordinates; zero where there are none.
    uv: DVec2,
    /// Between the colours of vertices.
    color: DVec3,
    /// `normal` looks to the back.
    mirrored: bool,
}

impl Crossing {
    /// With something that has one normal and neither texture coordinates nor colours.
    fn plain(t: f64, normal: DVec3) -> Self {
        Self { t, normal, shading_normal: normal, uv: DVec2::ZERO, color: DVec3::ONE, mirrored: false }
    }
}

impl Oracle {
    /// Flattens a scene. Meshes and textures that it names must be among those given; a model whose mesh is missing is not
    /// drawn, a texture that is missing is white.
    pub fn new(
        scene: &Scene,
        meshes: &[Arc<CompiledMesh>],
        textures: &[Arc<Texture>],
        view: &FrameView,
    ) -> Self {
        let eye = view.camera.position;
        let mut primitives = Vec::new();
        for (index, model) in scene.models.iter().enumerate() {
            let find = |id: MeshId| meshes.iter().find(|mesh| mesh.id() == id);
            let Some(mesh) = find(model.mesh) else { continue };
            let turn = rotation([0.0, view.spin, 0.0]) * rotation(model.rotate.to_array());
            let linear = turn * DMat3::from_diagonal(model.scale);
            let scale = libm::exp2(f64::from(mesh.exponent()));
            let place = |p: Vec3| linear * (p.as_dvec3() * scale + mesh.center()) + (model.translate - eye);
            let placed =
                digits(&[model.translate, linear * mesh.center(), linear * DVec3::splat(scale), eye]);
            let turn_normal = |n: Vec3| linear.inverse().transpose() * n.as_dvec3();
            let mut triangles: Vec<u32> = mesh.triangles().collect();
            triangles.sort_unstable_by_key(|&i| mesh.source(i));
            for i in triangles {
                let smooth = model.normals == NormalMode::Smooth;
                let normals = mesh.corner_normals(i).filter(|_| smooth).map(|n| n.map(turn_normal));
                let corners = mesh.corners(i).map(place);
                let mut skin = Skin::new(mesh.corner_uvs(i));
                skin.uvs = skin.uvs.map(|uv| uv + mesh.whole_repeats(i).as_dvec2());
                if let Some(colors) = mesh.corner_colors(i) {
                    skin.colors = colors.map(|color| DVec3::from_array(color.map(srgb::decode)));
                }
                let mirrored = linear.determinant() < 0.0;
                skin.mirrored = mirrored;
                let shape = Shape::Triangle { corners, normals, skin };
                let off = mesh_off(mesh.corners(i), linear * scale, corners) + placed;
                let material = model.materials[mesh.slot(i) as usize];
                let name = intersect::Primitive::Model { model: index, triangle: i };
                primitives.push(Primitive { shape, material, name, off, mirrored });
            }
        }
        for (index, sphere) in scene.spheres.iter().enumerate() {
            let shape = Shape::Sphere { center: sphere.center - eye, radius: sphere.radius };
            let name = intersect::Primitive::Sphere(index);
            primitives.push(Primitive { shape, material: sphere.material, name, off: 0.0, mirrored: false });
        }
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let corners = triangle.vertices.map(|v| v - eye);
            let shape = Shape::Triangle { corners, normals: None, skin: Skin::new(triangle.uvs) };
            let off = digits(&triangle.vertices) + digits(&corners);
            let name = intersect::Primitive::Triangle(index);
            primitives.push(Primitive { shape, material: triangle.material, name, off, mirrored: false });
        }
        for (index, plane) in scene.planes.iter().enumerate() {
            let shape = Shape::Plane { point: plane.point - eye, normal: plane.normal.normalize() };
            let off = digits(&[plane.point, plane.point - eye]);
            let name = intersect::Primitive::Plane(index);
            primitives.push(Primitive { shape, material: plane.material, name, off, mirrored: false });
        }
        let size = primitives.iter().map(|p| p.shape.size()).fold(0.0, f64::max);
        Self { scene: scene.clone(), view: *view, textures: textures.to_vec(), primitives, size }
    }

    /// Linear RGB of a pixel: the mean over its samples.
    pub fn pixel(&self, x: u32, y: u32) -> DVec3 {
        let n = self.view.samples.isqrt();
        let mut sum = DVec3::ZERO;
        for j in 0..n {
            for i in 0..n {
                let sx = f64::from(x) + (f64::from(i) + 0.5) / f64::from(n);
                let sy = f64::from(y) + (f64::from(j) + 0.5) / f64::from(n);
                sum += self.radiance(self.direction(sx, sy));
            }
        }
        sum / f64::from(n * n)
    }

    /// A pixel as it is stored: 8-bit sRGB.
    pub fn encoded_pixel(&self, x: u32, y: u32) -> [u8; 3] {
        srgb::encode(self.pixel(x, y).as_vec3())
    }

    /// What one ray sees through a point of the picture, in pixels from its top left corner, as it is stored: 8-bit sRGB.
    pub fn encoded_at(&self, x: f64, y: f64) -> [u8; 3] {
        srgb::encode(self.radiance(self.direction(x, y)).as_vec3())
    }

    /// The whole picture. The time grows with pixels times primitives: for small ones.
    pub fn render(&self) -> RgbImage {
        let (width, height) = (self.view.width, self.view.height);
        let pixels =
            (0..height).flat_map(|y| (0..width).flat_map(move |x| self.encoded_pixel(x, y))).collect();
        RgbImage { width, height, pixels }
    }

    /// What a ray from the camera sees, of any direction; the point is the camera + t * direction.
    pub fn closest_hit(&self, direction: DVec3) -> Option<RayHit> {
        let (index, hit) = self.closest(direction)?;
        Some(RayHit { t: hit.t, primitive: self.primitives[index].name })
    }

    /// Direction through a point of the picture, in pixels from its top left corner.
    fn direction(&self, sx: f64, sy: f64) -> DVec3 {
        let camera = &self.view.camera;
        let (width, height) = (f64::from(self.view.width), f64::from(self.view.height));
        let forward = (camera.look_at - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let half_height = libm::tan(camera.fov.to_radians() / 2.0) / camera.zoom;
        let across = (2.0 * sx / width - 1.0) * half_height * width / height;
        let along = (1.0 - 2.0 * sy / height) * half_height;
        (forward + right * across + up * along).normalize()
    }

    fn radiance(&self, direction: DVec3) -> DVec3 {
        let Some((primitive, hit)) = self.closest(direction) else {
            return match self.scene.background {
                Background::Color(color) => color.as_dvec3(),
                Background::Gradient { bottom, top } => {
                    bottom.as_dvec3().lerp(top.as_dvec3(), (direction.y + 1.0) / 2.0)
                }
            };
        };
        let mut material = self.scene.materials[self.primitives[primitive].material as usize];
        if let Some(index) = material.texture {
            material.diffuse *= self.texel(self.scene.textures[index as usize], hit.uv).truncate().as_vec3();
        }
        if material.vertex_colors {
            material.diffuse *= hit.color.as_vec3();
        }
        let point = direction * hit.t;
        let ng = if hit.normal.dot(direction) > 0.0 { -hit.normal } else { hit.normal };
        let n = if hit.shading_normal.dot(ng) < 0.0 { -hit.shading_normal } else { hit.shading_normal };
        let mut emission = DVec3::ZERO;
        if (hit.normal.dot(direction) < 0.0) != hit.mirrored {
            emission = material.emission.as_dvec3();
            if let Some(index) = material.emission_texture {
                emission *= self.texel(self.scene.textures[index as usize], hit.uv).truncate();
            }
        }
        if material.unlit {
            return material.diffuse.as_dvec3() + emission;
        }
        let mut sum = material.diffuse.as_dvec3() * self.scene.ambient.as_dvec3() + emission;
        for light in &self.scene.lights {
            sum += self.light_term(light, &material, point, n, -direction, primitive);
        }
        sum
    }

    /// Linear RGB and alpha of a texture at texture coordinates. Texel (i, j), counted from the bottom left, has its centre at
    /// ((i + 1/2) / width, (j + 1/2) / height).
    fn texel(&self, map: TextureMap, uv: DVec2) -> DVec4 {
        let Some(texture) = self.textures.iter().find(|texture| texture.id() == map.texture) else {
            return DVec4::ONE;
        };
        let (width, height) = (f64::from(texture.width()), f64::from(texture.height()));
        let color_of = |i: f64, j: f64| {
            let (i, j) = (wrapped(i, width, map.tiling.wrap), wrapped(j, height, map.tiling.wrap));
            let [r, g, b] = texture.texel(i, j).map(srgb::decode);
            DVec4::new(r, g, b, f64::from(texture.alpha(i, j)) / 255.0)
        };
        let uv = uv * map.tiling.scale.as_dvec2() + map.tiling.offset.as_dvec2();
        let (x, y) = (uv.x * width, uv.y * height);
        match self.view.quality.filter.unwrap_or(map.filter) {
            Filter::Nearest => color_of(x.floor(), y.floor()),
            Filter::Bilinear => {
                let (left, bottom) = ((x - 0.5).floor(), (y - 0.5).floor());
                let mut sum = DVec4::ZERO;
                for (i, j) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                    let (i, j) = (left + i, bottom + j);
                    let weight = (1.0 - (x - 0.5 - i).abs()) * (1.0 - (y - 0.5 - j).abs());
                    sum += color_of(i, j) * weight;
                }
                sum
            }
        }
    }

    /// S A B I ( c_d N.L + c_s (N.H)^p ) of one light.
    fn light_term(
        &self,
        light: &Light,
        material: &Material,
        point: DVec3,
        n: DVec3,
        v: DVec3,
        primitive: usize,
    ) -> DVec3 {
        let eye = self.view.camera.position;
        let (to_light, reach) = match light.kind {
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                (position - eye - point, BEFORE_LIGHT)
            }
            LightKind::Directional { direction } => (-direction, f64::INFINITY),
        };
        let r = to_light.length();
        let l = to_light / r;
        if !(n.dot(l) > 0.0) {
            return DVec3::ZERO;
        }
        let attenuation = match (light.kind, light.attenuation) {
            (LightKind::Directional { .. }, _) | (_, Attenuation::None) => 1.0,
            (_, Attenuation::InverseSquare) => 1.0 / (r * r),
            (_, Attenuation::Polynomial { constant, linear, quadratic }) => {
                1.0 / (constant + linear * r + quadratic * r * r)
            }
        };
        let strength = attenuation * beam(&light.kind, l);
        let shadows = light.shadows && self.view.quality.shadows;
        if strength == 0.0 || (shadows && self.occluded(point, to_light, reach, primitive)) {
            return DVec3::ZERO;
        }
        let h = (l + v).normalize();
        let highlight = libm::pow(n.dot(h).max(0.0), f64::from(material.exponent));
        let mut reflected = material.diffuse.as_dvec3() * n.dot(l);
        if self.view.quality.shading == Shading::Full {
            reflected += material.specular.as_dvec3() * highlight;
        }
        light.color.as_dvec3() * reflected * strength
    }

    /// What a ray from the camera sees, with its primitive: of all hits that coincide with the nearest one that of an item before
    /// that of an infinite plane, then that of a front before that of a back, then the first.
    fn closest(&self, direction: DVec3) -> Option<(usize, Crossing)> {
        let hits = self.primitives.iter().enumerate().filter_map(|(index, primitive)| {
            let hit = primitive.shape.hit(DVec3::ZERO, direction, 0.0)?;
            self.is_there(primitive, &hit).then_some((index, hit))
        });
        let mut hits: Vec<(usize, Crossing)> = hits.collect();
        let nearest = (0..hits.len()).min_by(|&a, &b| hits[a].1.t.total_cmp(&hits[b].1.t))?;
        let key = |(index, hit): &(usize, Crossing)| {
            let primitive = &self.primitives[*index];
            let behind = (hit.normal.dot(direction) < 0.0) == primitive.mirrored;
            (matches!(primitive.shape, Shape::Plane { .. }), behind, *index)
        };
        let seen = (0..hits.len())
            .filter(|&other| self.coincide(direction, &hits[nearest], &hits[other]))
            .min_by_key(|&hit| key(&hits[hit]))
            .unwrap_or(nearest);
        Some(hits.swap_remove(seen))
    }

    /// Whether two hits are as near to each other, across the surface that the ray goes through faster, as rounding may have
    /// carried the surfaces apart.
    fn coincide(
        &self,
        direction: DVec3,
        (a, at_a): &(usize, Crossing),
        (b, at_b): &(usize, Crossing),
    ) -> bool {
        let speed = [at_a, at_b].map(|hit| hit.normal.dot(direction).abs());
        let off =
            self.primitives[*a].off + self.primitives[*b].off + 2.0 * DIGITS * at_a.t * direction.length();
        (at_a.t - at_b.t).abs() * speed[0].max(speed[1]) <= off
    }

    /// Whether a point of the primitive `starts_on` is one of a flat primitive as well, but for rounding: it is not in its own way.
    fn lies_on(&self, point: DVec3, primitive: &Primitive, starts_on: usize) -> bool {
        let (on, normal) = match primitive.shape {
            Shape::Triangle { corners: [a, b, c], .. } => (a, (b - a).cross(c - a).normalize_or_zero()),
            Shape::Plane { point, normal } => (point, normal),
            Shape::Sphere { .. } => return false,
        };
        let off = primitive.off + self.primitives[starts_on].off + 2.0 * DIGITS * point.length();
        (point - on).dot(normal).abs() <= off
    }

    fn occluded(&self, point: DVec3, to_light: DVec3, reach: f64, starts_on: usize) -> bool {
        let near = NEAR * (self.size + point.length()) / to_light.length();
        self.primitives.iter().enumerate().any(|(index, primitive)| {
            let flat = !matches!(primitive.shape, Shape::Sphere { .. });
            if flat && (index == starts_on || self.lies_on(point, primitive, starts_on)) {
                return false;
            }
            let hit = primitive.shape.hit(point, to_light, near);
            hit.is_some_and(|hit| hit.t < reach && self.is_there(primitive, &hit))
        })
    }

    /// Whether alpha leaves anything there.
    fn is_there(&self, primitive: &Primitive, hit: &Crossing) -> bool {
        let cutout = self.scene.materials[primitive.material as usize].cutout;
        // Half of 255 lies between two bytes.
        cutout.is_none_or(|index| self.texel(self.scene.textures[index as usize], hit.uv).w >= 0.5)
    }
}

/// The texel of a picture that is seen at an index, inside of it or not.
fn wrapped(index: f64, size: f64, wrap: Wrap) -> u32 {
    let inside = match wrap {
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::Clamp => index.clamp(0.0, size - 1.0),
        Wrap::Mirror => {
            let pair = index.rem_euclid(2.0 * size);
            pair.min(2.0 * size - 1.0 - pair)
        }
    };
    inside as u32
}

/// What the digits of points are good for.
fn digits(points: &[DVec3]) -> f64 {
    DIGITS * points.iter().map(|point| point.abs().max_element()).sum::<f64>()
}

/// How far the rounding of its corners to `f32`, each on three axes of its mesh, may have carried a triangle across itself; `linear`
/// takes these to the world.
fn mesh_off(corners: [Vec3; 3], linear: DMat3, [a, b, c]: [DVec3; 3]) -> f64 {
    let largest = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f32::max);
    let step = (f64::from(largest) * HALF_STEP).min(HALF_STEP / 2.0);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let across = linear.transpose() * normal;
    step * across.abs().element_sum()
}

/// B_j for the unit vector to the light.
fn beam(kind: &LightKind, l: DVec3) -> f64 {
    let LightKind::Spot { direction, beam_angle, penumbra, .. } = *kind else { return 1.0 };
    let outer = libm::cos((beam_angle / 2.0).to_radians());
    let inner = libm::cos((beam_angle / 2.0 - penumbra).max(0.0).to_radians());
    let cosine = -l.dot(direction.normalize());
    if cosine <= outer {
        0.0
    } else if cosine >= inner {
        1.0
    } else {
        let s = (cosine - outer) / (inner - outer);
        s * s * (3.0 - 2.0 * s)
    }
}

/// About x, then y, then z, in degrees.
fn rotation(degrees: [f64; 3]) -> DMat3 {
    let [(sx, cx), (sy, cy), (sz, cz)] =
        degrees.map(|d| (libm::sin(d.to_radians()), libm::cos(d.to_radians())));
    let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
    let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
    let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
    z * y * x
}

impl Shape {
    /// Largest coordinate, for what "near" means.
    fn size(&self) -> f64 {
        match self {
            Shape::Triangle { corners, .. } => {
                corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max)
            }
            Shape::Sphere { center, radius } => center.abs().max_element() + radius,
            Shape::Plane { point, normal } => point.dot(*normal).abs(),
        }
    }

    /// The nearest hit with t > `near`.
    fn hit(&self, origin: DVec3, direction: DVec3, near: f64) -> Option<Crossing> {
        match *self {
            Shape::Triangle { corners: [a, b, c], normals, skin } => {
                let (ab, ac) = (b - a, c - a);
                let p = direction.cross(ac);
                let determinant = ab.dot(p);
                let from_a = origin - a;
                let u = from_a.dot(p) / determinant;
                let q = from_a.cross(ab);
                let v = direction.dot(q) / determinant;
                let t = ac.dot(q) / determinant;
                let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
                let ng = ab.cross(ac).normalize_or_zero();
                let ns =
                    normals.and_then(|[na, nb, nc]| (na * (1.0 - u - v) + nb * u + nc * v).try_normalize());
                let [a, b, c] = skin.uvs;
                let uv = a + (b - a) * u + (c - a) * v;
                let [a, b, c] = skin.colors;
                let color = a + (b - a) * u + (c - a) * v;
                let (shading_normal, mirrored) = (ns.unwrap_or(ng), skin.mirrored);
                (inside && t > near).then_some(Crossing {
                    t,
                    normal: ng,
                    shading_normal,
                    uv,
                    color,
                    mirrored,
                })
            }
            Shape::Sphere { center, radius } => {
                let from_center = origin - center;
                let unit = direction.normalize();
                let middle = -from_center.dot(unit);
                let closest = (from_center + unit * middle).length();
                let half_chord = (radius * radius - closest * closest).sqrt();
                let [t0, t1] = [-half_chord, half_chord].map(|half| (middle + half) / direction.length());
                let t = if t0 > near { t0 } else { t1 };
                let normal = (origin + direction * t - center).normalize_or_zero();
                (t > near).then_some(Crossing::plain(t, normal))
            }
            Shape::Plane { point, normal } => {
                let t = (point - origin).dot(normal) / direction.dot(normal);
                (t > near && t.is_finite()).then_some(Crossing::plain(t, normal))
            }
        }
    }
}
