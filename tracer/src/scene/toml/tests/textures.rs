//! Textures of materials and texture coordinates of triangles.

use super::*;

const WOODEN: &str = "[material.wood]\ndiffuse = { texture = \"maps/wood.png\" }\n";
const CORNERS: &str = "vertices = [[0,0,0],[1,0,0],[0,1,0]]\n";

#[test]
fn textures_and_texture_coordinates_are_read() {
    let text = format!(
        "{WOODEN}[material.pixels]\ndiffuse = {{ texture = \"a.png\", filter = \"nearest\" }}\n\
         [material.red]\ndiffuse = [1, 0, 0]\n\
         [[triangle]]\n{CORNERS}uvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"wood\"\n\
         [[triangle]]\n{CORNERS}uvs = [[0, 0], [1, 0], [0, 1]]\nmaterial = \"red\"\n\
         [[model]]\nfile = \"a.obj\"\nmaterial = \"wood\"\n"
    );
    let scene = read(&text).unwrap();
    let wood = scene.triangles[0].material;
    let texture = scene.textures[&wood].diffuse.as_ref().unwrap();
    assert_eq!((texture.file.to_str(), texture.filter), (Some("maps/wood.png"), Filter::Bilinear));
    assert_eq!(place(&text, texture.at), (2, 23));
    assert_eq!(
        scene
            .textures
            .values()
            .filter_map(|texts| texts.diffuse.as_ref())
            .filter(|text| text.filter == Filter::Nearest)
            .count(),
        1
    );
    assert_eq!(scene.textures.len(), 2);
    assert_eq!(scene.materials[wood as usize].diffuse, Vec3::ONE);
    let uvs = [Vec2::new(0.75, 0.0), Vec2::new(9.0, 1.5), Vec2::new(1.0, 2.0)];
    assert_eq!(scene.triangles[0].uvs, Some(uvs));
    // Texture coordinates without a texture are dropped.
    assert_eq!(scene.triangles[1].uvs, None);
    assert_eq!(place(&text, scene.models[0].material_at), (17, 12));
}

#[test]
fn emission_and_tiling_are_read() {
    let text = format!(
        "[material.lamp]\nemission = [1, 0.5, 0]\nemission_strength = 4\n\
         [material.screen]\nemission = {{ texture = \"a.png\" }}\nemission_strength = 2\n\
         [material.tiles]\ndiffuse = {{ texture = \"b.png\", wrap = \"mirror\", scale = [3, -0.5], offset = [0.5, 1] }}\n\
         [[sphere]]\ncenter = [0,0,0]\nradius = 1\nmaterial = \"lamp\"\n\
         [[triangle]]\n{CORNERS}uvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"tiles\"\n\
         [[triangle]]\n{CORNERS}uvs = [[-7.25, 3], [1, 4.5], [-7, 5]]\nmaterial = \"screen\"\n"
    );
    let scene = read(&text).unwrap();
    let material = |index: u32| scene.materials[index as usize];
    assert_eq!(material(scene.spheres[0].material).emission, Vec3::new(4.0, 2.0, 0.0));
    let [tiles, screen] = [0, 1].map(|triangle: usize| scene.triangles[triangle].material);
    assert_eq!(material(screen).emission, Vec3::splat(2.0));
    assert!(scene.textures[&screen].diffuse.is_none() && scene.textures[&screen].emission.is_some());
    let tiling = scene.textures[&tiles].diffuse.as_ref().unwrap().tiling;
    let expected = Tiling { wrap: Wrap::Mirror, scale: Vec2::new(3.0, -0.5), offset: Vec2::new(0.5, 1.0) };
    assert_eq!(tiling, expected);
    // A mirrored picture distinguishes whole repeats.
    assert_eq!(scene.triangles[0].uvs.unwrap()[0], Vec2::new(-7.25, 3.0));
    assert_eq!(scene.triangles[1].uvs.unwrap()[0], Vec2::new(0.75, 0.0));
}

#[test]
fn faults_of_textures_name_their_place() {
    let plain = "there are no texture coordinates";
    let with = |rest: &str| format!("{WOODEN}{rest}");
    let uvs = |uvs: &str| format!("[[triangle]]\n{CORNERS}uvs = {uvs}\n");
    for (text, place, words) in [
        (
            "[material.a]\ndiffuse = { filter = \"nearest\" }".to_owned(),
            "2:11",
            &["`texture` is missing"][..],
        ),
        ("[material.a]\ndiffuse = { texture = 3 }".to_owned(), "2:23", &["`texture`", "a text in quotes"]),
        ("[material.a]\ndiffuse = { texture = \"\" }".to_owned(), "2:23", &["the name of a picture"]),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", filter = \"linear\" }".to_owned(),
            "2:41",
            &["unknown word `linear`", "`filter` in `diffuse` in [material.a]", "bilinear"],
        ),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", filters = 2 }".to_owned(),
            "2:32",
            &["unknown key `filters`", "`filter`"],
        ),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", scale = 2 }".to_owned(),
            "2:40",
            &["`scale` in `diffuse` in [material.a]", "an array of two finite numbers up to 1000000", "is 2"],
        ),
        (
            "[material.a]\nemission = { texture = \"a.png\", offset = [0, 1e7] }".to_owned(),
            "2:42",
            &["`offset` in `emission` in [material.a]", "up to 1000000"],
        ),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", wrap = \"once\" }".to_owned(),
            "2:39",
            &["unknown word `once`", "`repeat`, `clamp`, `mirror`"],
        ),
        (
            "[material.a]\nemission = [1e29, 0, 0]\nemission_strength = 100".to_owned(),
            "3:21",
            &["`emission_strength` in [material.a]", "up to 1e30"],
        ),
        (
            with("[[disk]]\ncenter=[0,0,0]\nnormal=[0,1,0]\nradius=1\nmaterial=\"wood\""),
            "7:10",
            &["`material` in [[disk]] has a texture", plain, "with a colour, or a rectangle"],
        ),
        (
            "[material.a]\nnormal_map = { strength = 1 }".to_owned(),
            "2:14",
            &["`texture` is missing in `normal_map` in [material.a]"],
        ),
        (
            "[material.a]\nnormal_map = { texture = \"a.png\", strength = 101 }".to_owned(),
            "2:46",
            &["`strength` in `normal_map` in [material.a]", "from 0 to 100"],
        ),
        ("[material.a]\nnormal_map = \"a.png\"".to_owned(), "2:14", &["must be a table"]),
        (
            "[material.a]\ndiffuse = { texture = \"a.png\", strength = 1 }".to_owned(),
            "2:32",
            &["unknown key `strength`"],
        ),
        (
            with(&format!("[[triangle]]\n{CORNERS}material=\"wood\"")),
            "5:10",
            &["[[triangle]]", plain, "`uvs`"],
        ),
        (uvs("[[0,0],[1,0]]"), "3:7", &["three pairs"]),
        (uvs("[[0,0],[1,0],[0,1,2]]"), "3:7", &["three pairs"]),
        (uvs("[[0,0],[1,0],[0,nan]]"), "3:7", &["finite numbers up to 1e6"]),
        (uvs("[[0,0],[1,0],[0,2e6]]"), "3:7", &["finite numbers up to 1e6"]),
        (uvs("7"), "3:7", &["three pairs", "but is 7"]),
    ] {
        assert_faults(&[(&text, place, words)]);
    }
}

#[test]
fn spheres_planes_and_boxes_may_have_textures() {
    let text = format!(
        "{WOODEN}[[sphere]]\ncenter=[0,0,0]\nradius=1\nmaterial=\"wood\"\nuv_rotate=[0,90,0]\n\
         [[plane]]\npoint=[0,0,0]\nnormal=[0,1,0]\nmaterial=\"wood\"\nsize=2.5\n\
         [[rectangle]]\naxis=\"y\"\nat=0\nranges=[[0,1],[0,1]]\nmaterial=\"wood\"\n\
         [[box]]\nmin=[0,0,0]\nmax=[1,1,1]\nmaterial=\"wood\"\n"
    );
    let scene = read(&text).unwrap();
    assert_eq!(scene.warnings, []);
    assert_eq!(scene.spheres[0].uv_rotate, DVec3::Y * 90.0);
    assert_eq!(scene.planes[0].size, 2.5);
    assert!(scene.triangles.len() == 14 && scene.triangles.iter().all(|triangle| triangle.uvs.is_some()));
    let plain = "[[sphere]]\ncenter=[0,0,0]\nradius=1\nuv_rotate=[0,90,0]\n[[plane]]\npoint=[0,0,0]\nnormal=[0,1,0]\nsize=2\n";
    assert_eq!(
        warnings(plain),
        [
            "4:11 `uv_rotate` in [[sphere]] has no effect without a texture",
            "8:6 `size` in [[plane]] has no effect without a texture",
        ]
    );
}

#[test]
fn normal_maps_are_read() {
    let text = "[material.a]\nnormal_map = { texture = \"n.png\", strength = 0.5, wrap = \"mirror\", scale = [2, 2] }\n\
                [material.b]\nnormal_map = { texture = \"n.png\" }\n";
    let scene = read(text).unwrap();
    let [a, b] = [0, 1].map(|index: u32| scene.textures[&index].normal_map.clone().unwrap());
    assert_eq!((a.strength, b.strength), (0.5, 1.0));
    assert_eq!((a.texture.tiling.wrap, a.texture.tiling.scale), (Wrap::Mirror, Vec2::splat(2.0)));
    assert_eq!((a.texture.filter, place(text, a.texture.at)), (Filter::Bilinear, (2, 26)));
    // The tiling of a normal map counts as that of any texture.
    assert!(scene.textures[&0].distinguish_repeats() && !scene.textures[&1].distinguish_repeats());
}
