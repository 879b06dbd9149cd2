//! The oracle: the shading equations in `f64`, every ray against every primitive, no tree, no SIMD, no shortcuts.
//!
//! Of a frame's quality it knows what to leave out (shadows, highlights) and the filter; it is exact where a knob trades precision.
//!
//! It shares with the fast path only the scene, the cleaned triangles and the sRGB encoding: whatever
//! else it computes, it computes from the equations of the model of light, to be read against them.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};

use crate::image::RgbImage;
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::{
    Attenuation, Background, Filter, FrameView, Light, LightKind, Material, NormalMode, Scene, Shading,
    TextureMap,
};
use crate::srgb;
use crate::texture::Texture;

/// Nothing nearer than this share of the scene's size is in a shadow ray's way: it is where the ray starts.
const NEAR: f64 = 1e-11;

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
}

enum Shape {
    Triangle { corners: [DVec3; 3], normals: Option<[DVec3; 3]>, uvs: Option<[Vec2; 3]> },
    Sphere { center: DVec3, radius: f64 },
    Plane { point: DVec3, normal: DVec3 },
}

/// Where a ray meets a shape.
struct Crossing {
    t: f64,
    normal: DVec3,
    shading_normal: DVec3,
    /// Texture coordinates; zero where there are none.
    uv: DVec2,
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
        for model in &scene.models {
            let find = |id: MeshId| meshes.iter().find(|mesh| mesh.id() == id);
            let Some(mesh) = find(model.mesh) else { continue };
            let turn = rotation([0.0, view.spin, 0.0]) * rotation(model.rotate.to_array());
            let linear = turn * DMat3::from_diagonal(model.scale);
            let scale = libm::exp2(f64::from(mesh.exponent()));
            let place = |p: Vec3| linear * (p.as_dvec3() * scale + mesh.center()) + (model.translate - eye);
            let turn_normal = |n: Vec3| linear.inverse().transpose() * n.as_dvec3();
            for i in mesh.triangles() {
                let smooth = model.normals == NormalMode::Smooth;
                let normals = mesh.corner_normals(i).filter(|_| smooth).map(|n| n.map(turn_normal));
                let (corners, uvs) = (mesh.corners(i).map(place), mesh.corner_uvs(i));
                let shape = Shape::Triangle { corners, normals, uvs };
                primitives.push(Primitive { shape, material: model.materials[mesh.slot(i) as usize] });
            }
        }
        for sphere in &scene.spheres {
            let shape = Shape::Sphere { center: sphere.center - eye, radius: sphere.radius };
            primitives.push(Primitive { shape, material: sphere.material });
        }
        for triangle in &scene.triangles {
            let corners = triangle.vertices.map(|v| v - eye);
            let shape = Shape::Triangle { corners, normals: None, uvs: triangle.uvs };
            primitives.push(Primitive { shape, material: triangle.material });
        }
        for plane in &scene.planes {
            let shape = Shape::Plane { point: plane.point - eye, normal: plane.normal.normalize() };
            primitives.push(Primitive { shape, material: plane.material });
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
            material.diffuse *= self.texel(self.scene.textures[index as usize], hit.uv).as_vec3();
        }
        let point = direction * hit.t;
        let ng = if hit.normal.dot(direction) > 0.0 { -hit.normal } else { hit.normal };
        let n = if hit.shading_normal.dot(ng) < 0.0 { -hit.shading_normal } else { hit.shading_normal };
        let mut sum = material.diffuse.as_dvec3() * self.scene.ambient.as_dvec3();
        for light in &self.scene.lights {
            sum += self.light_term(light, &material, point, n, -direction, primitive);
        }
        sum
    }

    /// Linear RGB of a texture at texture coordinates. The picture repeats; texel (i, j), counted from the bottom left, has
    /// its centre at ((i + 1/2) / width, (j + 1/2) / height).
    fn texel(&self, map: TextureMap, uv: DVec2) -> DVec3 {
        let Some(texture) = self.textures.iter().find(|texture| texture.id() == map.texture) else {
            return DVec3::ONE;
        };
        let (width, height) = (f64::from(texture.width()), f64::from(texture.height()));
        let color_of = |i: f64, j: f64| {
            let bytes = texture.texel(i.rem_euclid(width) as u32, j.rem_euclid(height) as u32);
            DVec3::from_array(bytes.map(srgb::decode))
        };
        let (x, y) = (uv.x * width, uv.y * height);
        match self.view.quality.filter.unwrap_or(map.filter) {
            Filter::Nearest => color_of(x.floor(), y.floor()),
            Filter::Bilinear => {
                let (left, bottom) = ((x - 0.5).floor(), (y - 0.5).floor());
                let mut sum = DVec3::ZERO;
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

    /// The nearest hit of a ray from the camera, with its primitive; of equal ones the first.
    fn closest(&self, direction: DVec3) -> Option<(usize, Crossing)> {
        let mut best: Option<(usize, Crossing)> = None;
        for (index, primitive) in self.primitives.iter().enumerate() {
            if let Some(hit) = primitive.shape.hit(DVec3::ZERO, direction, 0.0)
                && best.as_ref().is_none_or(|(_, best)| hit.t < best.t)
            {
                best = Some((index, hit));
            }
        }
        best
    }

    fn occluded(&self, point: DVec3, to_light: DVec3, reach: f64, leaving: usize) -> bool {
        let near = NEAR * (self.size + point.length()) / to_light.length();
        self.primitives.iter().enumerate().any(|(index, primitive)| {
            let flat = !matches!(primitive.shape, Shape::Sphere { .. });
            if index == leaving && flat {
                return false;
            }
            primitive.shape.hit(point, to_light, near).is_some_and(|hit| hit.t < reach)
        })
    }
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
            Shape::Triangle { corners: [a, b, c], normals, uvs } => {
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
                let [a, b, c] = uvs.unwrap_or_default().map(Vec2::as_dvec2);
                let uv = a + (b - a) * u + (c - a) * v;
                (inside && t > near).then(|| Crossing { t, normal: ng, shading_normal: ns.unwrap_or(ng), uv })
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
                (t > near).then_some(Crossing { t, normal, shading_normal: normal, uv: DVec2::ZERO })
            }
            Shape::Plane { point, normal } => {
                let t = (point - origin).dot(normal) / direction.dot(normal);
                let crossing = Crossing { t, normal, shading_normal: normal, uv: DVec2::ZERO };
                (t > near && t.is_finite()).then_some(crossing)
            }
        }
    }
}
