//! The checks pass on correct scenes and detect faults.

use glam::DVec3;

use super::leaks::{Tally, pieces, shoot, shot};
use super::oracle::{Comparison, chosen, compare, is_between};
use super::replay::leak_message;
use super::scenes::torus;
use super::seams::Seams;
use super::*;

const LITTLE: Effort = Effort { rays: 20_000, side: 64, oracle_work: 200_000, pixels: None };

fn tori() -> Subject {
    built_in().unwrap().pop().unwrap()
}

#[test]
fn the_built_in_scenes_pass() {
    for subject in built_in().unwrap() {
        let outcomes = run(&subject, &LITTLE).unwrap();
        let broken: Vec<&Outcome> = outcomes.iter().filter(|outcome| !outcome.holds()).collect();
        assert!(broken.is_empty(), "{}: {broken:#?}", subject.name);
        let has_models = !subject.scene.models.is_empty();
        for check in [Check::Leaks, Check::Acne, Check::Scale, Check::Offset] {
            let tested: u64 =
                outcomes.iter().filter(|outcome| outcome.check == check).map(|o| o.tested).sum();
            assert_eq!(tested > 0, has_models || check != Check::Leaks, "{}: {check}", subject.name);
        }
    }
}

#[test]
fn a_torus_has_the_seams_that_euler_counts() {
    let (mesh, _) = CompiledMesh::compile(&torus(12, 8)).unwrap();
    let seams = Seams::of(&mesh);
    let (vertices, edges) = (seams.vertices.len(), seams.edges.len());
    assert_eq!((vertices, edges, mesh.triangle_count()), (96, 288, 192));
    assert!(seams.edges.iter().all(|edge| seams.opposite(edge).len() == 2));
    for vertex in 0..vertices as u32 {
        assert_eq!(seams.edges_at(vertex).len(), 6);
        assert!(seams.edges_at(vertex).iter().all(|&edge| seams.edges[edge as usize].ends.contains(&vertex)));
    }
}

/// With one of 3072 triangles missing, rays aimed at its edges leak.
#[test]
fn a_missing_triangle_leaks() {
    let whole = tori();
    let mut mesh = torus(48, 32);
    mesh.triangles.remove(700);
    mesh.triangle_materials.pop();
    let broken_mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let mut broken = whole.with(whole.scene.clone());
    broken.scene.models.iter_mut().for_each(|model| model.mesh = broken_mesh.id());
    let broken_id = broken_mesh.id();
    broken.meshes = vec![broken_mesh];

    let seams = [Seams::of(&whole.meshes[0])];
    let frame_of = |subject: &Subject| subject.prepared(8).unwrap();
    let count = |frame: &PreparedFrame| shoot(frame, &pieces(&whole, frame, &seams), 100_000);
    let Tally { at_edges, wrong, .. } = count(&frame_of(&whole));
    assert_eq!(wrong, 0);
    assert!((1_000..50_000).contains(&at_edges), "{at_edges} of 100,000 at outlines");
    let frame = frame_of(&broken);
    let Tally { wrong, leaked, .. } = count(&frame);
    assert!((5..1_000).contains(&wrong), "{wrong} of 100,000 leaked through one hole of 3,072");
    assert_eq!(leaked.len(), wrong.min(8) as usize);
    // Each failure names its ray, mesh and triangles.
    let message = leak_message(&frame, &pieces(&whole, &frame, &seams), leaked[0], 7 * leaked[0]);
    let [number, id] = [(7 * leaked[0]).to_string(), broken_id.to_string()];
    for word in [format!("ray {number} leaks through model "), id[..8].to_owned(), format!("--ray {number}")]
    {
        assert!(message.contains(&word), "{word}: {message}");
    }
    assert!(message.contains(" triangle ") && message.contains("it hits "), "{message}");
}

/// The number of a failure repeats the same ray, for every total of rays.
#[test]
fn a_ray_is_replayed() {
    let subject = tori();
    let seams = [Seams::of(&subject.meshes[0])];
    let frame = subject.prepared(8).unwrap();
    let pieces = pieces(&subject, &frame, &seams);
    let number = 7 * 5_003;
    let shot = shot(&pieces, 5_003);
    let text = replay(&subject, &LITTLE, number).unwrap().unwrap();
    let from = format!("from {:?} along {:?}", shot.origin, shot.direction);
    assert!(text.starts_with("ray 35021: scale 1e0, 0e0 extents away, ray 5003 there\n"), "{text}");
    for word in [from.as_str(), "aimed at the ", " met at t = ", "the fast path hits ", "the oracle hits "] {
        assert!(text.contains(word), "{word}: {text}");
    }
    // Both hits are the same, and the report interprets them.
    let after = |what: &str| text.split(what).nth(1).and_then(|rest| rest.lines().next()).unwrap().trim();
    let thing = |seen: &str| seen.split(" at t = ").next().unwrap().to_owned();
    assert!(text.contains("is stopped") || text.contains("may pass"), "{text}");
    assert!(text.contains("aimed at the edge") || text.contains("aimed at the vertex"), "{text}");
    assert_eq!(after("fast path hits") == "nothing", after("oracle hits") == "nothing", "{text}");
    assert!(!thing(after("fast path hits")).is_empty());
    assert_eq!(replay(&built_in().unwrap()[0], &LITTLE, 1).unwrap(), None, "a plane has no edges");
}

#[test]
fn the_oracle_detects_a_wrong_pixel() {
    let subject = tori();
    let mut picture = subject.rendered(64).unwrap();
    let view = subject.view(64);
    let pixels = chosen(&[], picture.len() / 3, 40);
    let fine = compare(&subject, &view, &picture, &pixels);
    assert_eq!((fine.tested, fine.wrong), (40, 0));
    for &pixel in &pixels[..3] {
        picture[pixel * 3 + 1] ^= 0x20;
    }
    let broken = compare(&subject, &view, &picture, &pixels);
    let message = broken.failures[0].to_string();
    let (x, y) = (pixels[0] as u32 % view.width, pixels[0] as u32 / view.width);
    assert!(message.starts_with(&format!("pixel ({x}, {y}) is [")), "{message}");
    assert_eq!(broken, Comparison { wrong: 3, failures: broken.failures.clone(), ..fine });
}

#[test]
fn specks_are_isolated_shadows() {
    let (width, height) = (8, 6);
    let lit = vec![200; width * height * 3];
    let mut picture = lit.clone();
    // A block of shadow, a speck at the border, two in a row.
    for (x, y) in [(4, 2), (5, 2), (6, 2), (4, 3), (5, 3), (6, 3), (0, 0), (1, 4), (1, 5)] {
        picture[(y * width + x) * 3] = 10;
    }
    assert_eq!(acne::specks(&picture, &lit, width), [0, 4 * width + 1, 5 * width + 1]);
}

#[test]
fn pixels_are_chosen_evenly_and_from_the_first_ones() {
    assert_eq!(chosen(&[], 100, 4), [12, 37, 62, 87]);
    assert_eq!(chosen(&[5, 6], 100, 4), [5, 6, 25, 75]);
    let many: Vec<usize> = (0..1000).collect();
    let chosen = chosen(&many, 1000, 20);
    assert!(chosen.len() <= 20 && chosen.iter().all(|&pixel| pixel < 1000), "{chosen:?}");
}

#[test]
fn a_scene_is_placed_with_all_its_objects() {
    let subject = tori();
    let moved = placed::placed(&subject.scene, 2.0, DVec3::new(10.0, 0.0, 0.0));
    assert_eq!(moved.models[1].translate, DVec3::new(11.6, 1.2, 0.0));
    assert_eq!(moved.models[1].scale, DVec3::splat(1.2));
    assert_eq!(moved.camera.position, DVec3::new(10.6, 2.2, 7.0));
    assert_ne!(moved.planes[0].point, subject.scene.planes[0].point);
}

#[test]
fn colours_are_compared_channel_by_channel() {
    let mut around = [[100, 50, 0]; 8];
    around[3] = [140, 10, 0];
    let is = |found| is_between(found, around, [100, 50, 0]);
    for found in [[100, 50, 0], [140, 10, 1], [120, 30, 0], [141, 9, 0]] {
        assert!(is(found), "{found:?}");
    }
    for found in [[98, 50, 0], [142, 30, 0], [120, 52, 0], [120, 30, 2]] {
        assert!(!is(found), "{found:?}");
    }
}
