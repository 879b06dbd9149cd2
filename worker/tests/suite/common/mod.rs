//! A master on 127.0.0.1 that a test controls, and a scene for its worker.
#![allow(clippy::unwrap_used, clippy::panic, reason = "these are tests")]

use std::ops::Range;
use std::sync::Arc;

use bytes::Bytes;
use glam::{DMat3, DVec3, Vec2, Vec3};
use rayfarm_protocol::pixels::unpack;
use rayfarm_protocol::session::{self, Receiver, Sender};
use rayfarm_protocol::{
    AssetId, Encoding, FrameAnnounce, FrameId, Hello, Lease, PixelFormat, ToMaster, ToWorker, Welcome, codec,
    handshake,
};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::{CompiledMesh, Mesh, NamedMaterial};
use rayfarm_tracer::scene::{
    Attenuation, Background, Camera, CameraKind, Filter, FrameView, Light, LightKind, Material, Model,
    NormalMode, Plane, RenderSettings, Scene, Sphere, TextureMap,
};
use rayfarm_tracer::texture::Texture;
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};
use tokio::net::{TcpListener, TcpStream};

/// A scene with an asset of each kind: a textured mesh, a sphere, a plane, a light with shadows.
pub(crate) struct Stage {
    pub(crate) body: Bytes,
    pub(crate) mesh: Bytes,
    pub(crate) texture: Bytes,
    compiled: Arc<CompiledScene>,
    view: FrameView,
}

impl Stage {
    pub(crate) fn new() -> Self {
        let mesh = pyramid();
        let texture = stripes();
        let scene = Scene {
            ambient: Vec3::splat(0.1),
            render: RenderSettings { width: 61, height: 45, samples: 4, ..RenderSettings::default() },
            camera: Camera {
                position: DVec3::new(0.5, 1.5, 5.0),
                look_at: DVec3::ZERO,
                up: DVec3::Y,
                fov: 45.0,
                zoom: 1.0,
                kind: CameraKind::PINHOLE,
            },
            background: Background::Gradient { bottom: Vec3::ZERO, top: Vec3::new(0.3, 0.5, 0.9) },
            lights: vec![Light {
                kind: LightKind::Point { position: DVec3::new(2.0, 4.0, 3.0) },
                color: Vec3::ONE,
                attenuation: Attenuation::None,
                shadows: true,
                radius: 0.0,
                shadow_samples: None,
            }],
            materials: vec![Material::NEUTRAL, Material { texture: Some(0), ..Material::NEUTRAL }],
            models: vec![Model {
                mesh: mesh.id(),
                materials: vec![1],
                normals: NormalMode::Flat,
                translate: DVec3::new(-0.8, 0.0, 0.0),
                rotate: DVec3::new(0.0, 30.0, 0.0),
                scale: DVec3::ONE,
                group: DMat3::IDENTITY,
            }],
            spheres: vec![Sphere {
                center: DVec3::new(1.0, 0.0, 0.0),
                radius: 0.7,
                material: 0,
                inside_out: false,
                uv_rotate: DVec3::ZERO,
            }],
            planes: vec![Plane {
                point: DVec3::new(0.0, -1.0, 0.0),
                normal: DVec3::Y,
                material: 0,
                size: 1.0,
            }],
            textures: vec![TextureMap::new(texture.id(), Filter::Bilinear)],
            triangles: vec![],
            background_visible: true,
            disks: Vec::new(),
            ..Scene::default()
        };
        let view = FrameView::of(&scene);
        let body = codec::encode(&scene).unwrap().into();
        let mesh_bytes = Bytes::copy_from_slice(mesh.bytes());
        let texture_bytes = Bytes::copy_from_slice(texture.bytes());
        let compiled = Arc::new(CompiledScene::new(scene, [Arc::new(mesh)], [Arc::new(texture)]).unwrap());
        Self { body, mesh: mesh_bytes, texture: texture_bytes, compiled, view }
    }

    pub(crate) fn height(&self) -> u32 {
        self.view.height
    }

    pub(crate) fn view(&self, spin: f64) -> FrameView {
        FrameView { spin, ..self.view }
    }

    pub(crate) fn announce(&self, frame: u64, spin: f64) -> ToWorker {
        ToWorker::Frame(FrameAnnounce {
            frame: FrameId(frame),
            scene: AssetId::of(&self.body),
            width: self.view.width,
            height: self.view.height,
            format: PixelFormat::Rgb8,
            view: codec::encode(&self.view(spin)).unwrap().into(),
        })
    }

    /// Renders these rows in this process.
    pub(crate) fn expected(&self, spin: f64, rows: Range<u32>) -> Vec<u8> {
        let frame = PreparedFrame::new(Arc::clone(&self.compiled), &self.view(spin)).unwrap();
        let mut out = vec![0; rows.len() * PixelFormat::Rgb8.row_bytes(self.view.width)];
        render_rows(&frame, rows, &mut out, &|| false).unwrap();
        out
    }
}

fn pyramid() -> CompiledMesh {
    let mesh = Mesh {
        positions: vec![DVec3::Y, DVec3::X, DVec3::NEG_X, DVec3::Z],
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
        triangle_materials: vec![0; 4],
        uvs: vec![[Vec2::ZERO, Vec2::new(3.0, 0.5), Vec2::new(0.5, 2.0)]; 4],
        materials: vec![NamedMaterial::plain("plain", Material::NEUTRAL)],
        ..Mesh::default()
    };
    CompiledMesh::compile(&mesh).unwrap().0
}

fn stripes() -> Texture {
    let pixels = (0..4 * 3 * 3).map(|i: u32| (i * 37 % 256) as u8).collect();
    Texture::new(&RgbImage { width: 4, height: 3, pixels }).unwrap()
}

pub(crate) fn lease(frame: u64, rows: Range<u32>) -> Lease {
    let (first_row, row_count) = (rows.start, rows.end - rows.start);
    Lease { frame: FrameId(frame), segment: first_row, attempt: 0, first_row, row_count }
}

pub(crate) async fn listen() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    (listener, address)
}

/// A session with a worker that has connected.
pub(crate) struct Link {
    pub(crate) hello: Hello,
    pub(crate) out: Sender<ToWorker>,
    pub(crate) inbox: Receiver<ToMaster>,
    /// Number of requested assets.
    pub(crate) requests: usize,
    /// Number of segments that arrived compressed.
    pub(crate) compressed: usize,
}

impl Link {
    pub(crate) async fn accept(listener: &TcpListener) -> Self {
        let mut stream: TcpStream = listener.accept().await.unwrap().0;
        let (_, hello) =
            handshake::as_master(&mut stream, &rayfarm_protocol::transport::MasterSecurity::Plain, |_, _| {
                Ok(Welcome { worker: 1 })
            })
            .await
            .unwrap();
        let (out, inbox, _) = session::spawn(stream);
        Self { hello, out, inbox, requests: 0, compressed: 0 }
    }

    /// Receives the next message that is no request for an asset. Serves requests before it.
    pub(crate) async fn receive(&mut self, stage: &Stage) -> Option<ToMaster> {
        loop {
            let id = match self.inbox.recv().await?.unwrap() {
                ToMaster::NeedAsset { id, .. } => id,
                message => return Some(message),
            };
            self.requests += 1;
            let assets = [&stage.body, &stage.mesh, &stage.texture];
            let bytes = assets.into_iter().find(|bytes| AssetId::of(bytes) == id).unwrap().clone();
            self.out.send(ToWorker::AssetBegin { id, size: bytes.len() as u64 }).await.unwrap();
            self.out.send(ToWorker::AssetChunk { id, offset: 0, bytes }).await.unwrap();
        }
    }

    /// Renders a whole frame on the worker and compares it with the same frame rendered in this process.
    pub(crate) async fn check_frame(&mut self, stage: &Stage, frame: u64, spin: f64) {
        self.out.send(stage.announce(frame, spin)).await.unwrap();
        let height = stage.height();
        let segments: Vec<_> = (0..height).step_by(11).map(|first| first..(first + 11).min(height)).collect();
        for rows in &segments {
            self.out.send(ToWorker::Segment(lease(frame, rows.clone()))).await.unwrap();
        }
        for _ in &segments {
            match self.receive(stage).await {
                Some(ToMaster::Pixels { header, bytes }) => {
                    let expected = stage.expected(spin, header.lease.rows().unwrap());
                    match header.encoding {
                        Encoding::Raw => assert_eq!(bytes, expected),
                        Encoding::PlanesLz4 => panic!("planes of RGB8"),
                        Encoding::Rgb565 | Encoding::Rgb565Lz4 => panic!("fewer colours were not requested"),
                        Encoding::Lz4 => {
                            let mut rows = vec![0; expected.len()];
                            unpack(&bytes, &mut rows).unwrap();
                            assert!(rows == expected && bytes.len() < rows.len());
                            self.compressed += 1;
                        }
                    }
                    let cost = header.cost;
                    assert!(cost.primary > 0 && cost.span_ns > 0 && cost.trace_ns > 0);
                    assert_eq!(cost.encode_ns > 0, self.compressed > 0, "raw pixels take no time to encode");
                }
                other => panic!("expected pixels, not {other:?}"),
            }
        }
    }
}
