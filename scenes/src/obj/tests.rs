use super::*;
use crate::id::FaceId;
use crate::load::Warning;
use crate::radiometry::Reflectance;
use glam::{DVec3, Vec2};
use proptest::prelude::*;
use std::fs;
use tempfile::TempDir;

const MATERIALS: &str = "newmtl white\nKd 0.7 0.7 0.7\nnewmtl lamp\nKd 0 0 0\nKe 17 12 4\n";
/// Four corners of a unit square in z = 0.
const SQUARE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn write(obj: &[u8], mtl: &[u8]) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("a.obj"), obj).expect("the file is written");
    fs::write(folder.path().join("a.mtl"), mtl).expect("the file is written");
    folder
}

/// Reads `SQUARE` followed by these lines.
fn try_square(lines: &str) -> Result<Part, String> {
    let folder = write(format!("{SQUARE}{lines}").as_bytes(), MATERIALS.as_bytes());
    // Messages begin with the file's name alone, as if it was opened in its folder.
    let prefix = format!("{}/", folder.path().display());
    read(&folder.path().join("a.obj"), None).map_err(|e| e.to_string().replace(&prefix, ""))
}

fn square(lines: &str) -> Part {
    try_square(lines).expect("the lines are valid")
}

fn error(lines: &str) -> String {
    try_square(lines).expect_err("the lines are wrong")
}

fn corner_counts(part: &Part) -> Vec<u32> {
    part.scene
        .faces
        .iter()
        .map(|face| face.corner_count)
        .collect()
}

#[test]
fn polygons_stay_polygons() {
    let part = square("v 0.5 1.5 0\nusemtl white\nf 1 2 3 4\nf 1 2 3 5 4\nf 1 2 3\n");
    assert_eq!(corner_counts(&part), [4, 5, 3]);
    assert!(part.warnings.is_empty());
}

#[test]
fn coordinates_keep_f64() {
    let part = square("v 0.1 1e-17 0.12345678912345678\nusemtl white\nf 1 2 5\n");
    let last = part.scene.polygon(FaceId(0)).last();
    assert_eq!(last, Some(DVec3::new(0.1, 1e-17, 0.123_456_789_123_456_78)));
}

#[test]
fn objects_collect_faces_of_several_materials_and_continue() {
    let part = square(
        "o one\nusemtl white\nf 1 2 3\nusemtl lamp\nf 1 3 4\ng two\nf 1 2 4\no one\nf 2 3 4\n",
    );
    let scene = &part.scene;
    let names: Vec<&str> = scene.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["one", "two"]);
    let of_faces: Vec<(u32, &str)> = scene
        .face_ids()
        .map(|f| {
            (
                scene.faces[f.index()].object.0,
                scene.material(f).name.as_str(),
            )
        })
        .collect();
    assert_eq!(
        of_faces,
        [(0, "white"), (0, "lamp"), (1, "lamp"), (0, "lamp")]
    );
}

#[test]
fn indices_count_backwards_too() {
    let part = square("usemtl white\nf -4 -3 -2 -1\n");
    assert_eq!(part.scene.vector_area(FaceId(0)), DVec3::Z);
}

#[test]
fn normals_and_uvs_stay_with_their_corners() {
    let part = square(
        "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 2\nvn 0 1 0\nusemtl white\n\
         f 1 2 3\nf 1/1/1 2/2/2 3/3/1\nf 1//2 3 4\n",
    );
    let corners = &part.scene.corners;
    let z = glam::Vec3::Z;
    let y = glam::Vec3::Y;
    let zero = glam::Vec3::ZERO;
    // The parser makes up normals for corners without; they must come out as none.
    assert_eq!(corners.normal, [zero, zero, zero, z, y, z, y, zero, zero]);
    assert_eq!(corners.uv0[3..6], [Vec2::ZERO, Vec2::X, Vec2::ONE]);
    assert_eq!(corners.uv0[0], Vec2::ZERO);
}

#[test]
fn a_library_may_stand_behind_its_first_use_and_tabs_are_spaces() {
    let folder = write(
        b"\xef\xbb\xbfusemtl\twhite\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nmtllib a.mtl\n",
        MATERIALS.as_bytes(),
    );
    let part = read(&folder.path().join("a.obj"), None).expect("the file is valid");
    assert_eq!(part.scene.material(FaceId(0)).name, "white");
}

#[test]
fn continued_lines_are_one_line() {
    assert_eq!(corner_counts(&square("usemtl white\nf 1 2 \\\n3 4\n")), [4]);
}

#[test]
fn concave_and_bent_faces_are_cut_and_counted() {
    let part = square("v 1 1 0.5\no x\nusemtl white\nf 1 2 3 4\nf 4 3 2\nf 1 2 5 4\n");
    assert_eq!(corner_counts(&part), [4, 3, 3, 3]);
    let texts: Vec<String> = part.warnings.iter().map(ToString::to_string).collect();
    assert!(
        texts[0].contains(":11: 1 face(s) that are not flat"),
        "{texts:?}"
    );
    assert!(texts[0].contains("face 3 of object `x`"), "{texts:?}");
    let part = square("v 0.2 0.3 0\nusemtl white\nf 1 2 5 4\n");
    assert!(matches!(
        part.warnings[..],
        [Warning::ConcaveFaces { count: 1, .. }]
    ));
}

#[test]
fn faces_without_area_are_dropped_and_counted() {
    let part =
        square("v 0.5 0 0\no x\nusemtl white\nf 1 2 3 4\nf 1 2 5\nf 1 1 2\nf 1 2 2 1\nf 1 2 3\n");
    assert_eq!(part.scene.faces.len(), 2);
    let [Warning::DegenerateFaces { count: 3, first }] = &part.warnings[..] else {
        panic!("one warning, not {:?}", part.warnings);
    };
    assert_eq!(
        (first.place.line, first.object.as_str(), first.number),
        (Some(10), "x", 2)
    );
}

#[test]
fn empty_objects_lines_and_points_are_left_out_with_a_warning() {
    let part = square("o empty\no full\nusemtl white\nf 1 2 3\nl 1 2 3 4\np 1\no last\n");
    assert_eq!(part.scene.objects.len(), 1);
    assert_eq!(corner_counts(&part), [3], "a polyline is no face");
    let texts: Vec<String> = part.warnings.iter().map(ToString::to_string).collect();
    assert!(
        texts[0].contains("a.obj:6: 2 object(s) without faces"),
        "{texts:?}"
    );
    assert!(
        texts[1].contains("a.obj:10: 2 line(s) or point(s)"),
        "{texts:?}"
    );
}

#[test]
fn a_file_without_faces_is_empty() {
    assert_eq!(square("").scene.faces.len(), 0);
    assert_eq!(square("f\nf 1\nf 1 2\n").scene.faces.len(), 0);
}

#[test]
fn faces_without_a_material_are_grey_with_a_warning() {
    let part = square("f 1 2 3\n");
    assert_eq!(
        part.scene.material(FaceId(0)).reflectance,
        Reflectance::splat(0.5)
    );
    assert!(matches!(
        part.warnings[..],
        [Warning::NoMaterial { count: 1, .. }]
    ));
}

#[test]
fn errors_name_file_line_object_and_remedy() {
    for (lines, start, remedy) in [
        (
            "o t\nv 0 nan 0\nf 1 2 5\n",
            "a.obj:7: `v 0 nan 0` (object `t`) is not finite",
            "export",
        ),
        ("v 0 inf 0\nf 1 2 5\n", "a.obj:6: `v 0 inf 0`", "export"),
        ("v 1e999 0 0\nf 1 2 5\n", "a.obj:6: `v 1e999 0 0`", "export"),
        ("v 0 x 0\n", "a.obj:6: `v 0 x 0`", "`v x y z`; correct"),
        ("v 0 0\n", "a.obj:6: `v 0 0`", "`v x y z`; correct"),
        ("vn 0 0\n", "a.obj:6: `vn 0 0`", "correct"),
        (
            "o t\nf 1 2 9\n",
            "a.obj:7: a face of object `t` names vertex 9, but there are 4",
            "count",
        ),
        (
            "f 1 2 0\n",
            "a.obj:6: a face of object `unnamed_object` names vertex 0",
            "count from 1",
        ),
        (
            "f -5 1 2\n",
            "a.obj:6: a face of object `unnamed_object` names vertex -5",
            "backwards",
        ),
        (
            "vt 0 0\nf 1/2 2/1 3/1\n",
            "a.obj:7: a face",
            "texture coordinate 2, but there are 1",
        ),
        (
            "vn 0 0 1\nf 1//-9 2//1 3//1\n",
            "a.obj:7: a face",
            "normal -9, but there are 1",
        ),
        (
            "f 1 2 three\n",
            "a.obj:6: `f 1 2 three`",
            "v/vt/vn`; correct",
        ),
        ("f 1/2/3/4 2 3\n", "a.obj:6: `f 1/2/3/4 2 3`", "correct"),
        (
            "usemtl whit\nf 1 2 3\n",
            "a.obj:6: no material `whit`; did you mean `white`?",
            "newmtl",
        ),
        ("usemtl\n", "a.obj:6: `usemtl` without a name", "write"),
        (
            "mtllib b.mtl\n",
            "a.obj:6: no such material library: b.mtl",
            "correct",
        ),
    ] {
        let text = error(lines);
        assert!(text.starts_with(start), "{lines}: {text}");
        assert!(text.contains(remedy), "{lines}: {text}");
    }
}

#[test]
fn a_file_without_library_says_so() {
    let folder = write(b"v 0 0 0\nusemtl red\nf 1 1 1\n", b"");
    let error = read(&folder.path().join("a.obj"), None).expect_err("there is no library");
    assert!(error.to_string().contains("no `mtllib` line"), "{error}");
}

#[test]
fn a_library_that_is_no_file_is_an_io_failure() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("a.obj");
    fs::write(&file, "mtllib b.mtl\n").expect("the file is written");
    fs::create_dir(folder.path().join("b.mtl")).expect("the folder is made");
    let error = read(&file, None).expect_err("a folder is no library");
    assert_eq!(error.kind(), crate::load::FailureKind::Io);
}

#[test]
fn textures_are_found_beside_the_library_and_named_when_missing() {
    let folder = write(
        b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n",
        b"newmtl a\nKd 1 1 1\nmap_Kd wood.png\nmap_Ke wood.png\n",
    );
    let file = folder.path().join("a.obj");
    let error = read(&file, None).expect_err("there is no image");
    assert!(
        error.to_string().contains("a.mtl:1: no such image"),
        "{error}"
    );
    image::RgbImage::from_pixel(1, 1, image::Rgb([255; 3]))
        .save(folder.path().join("wood.png"))
        .expect("the image is written");
    let part = read(&file, None).expect("the image is there");
    assert_eq!(part.scene.textures.len(), 1, "the image is loaded once");
    assert!(part.scene.materials[0].reflectance_texture.is_some());
    assert!(
        part.scene.materials[0].is_emissive(),
        "an image of emission needs no Ke"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Whatever bytes stand in the files, reading ends in a scene or an error.
    #[test]
    fn no_bytes_make_the_reader_panic(
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 1..12),
    ) {
        const WORDS: [&str; 12] = [
            "-", "/", " nan ", "\nf ", "-9223372036854775808", "1e308", "\n", "\nKd ", "\nl ", "\\\n",
            "\u{feff}", "99999999999",
        ];
        let mut obj = format!(
            "{SQUARE}vt 0 0\nvn 0 0 1\no x\nusemtl white\nf 1 2 3 4\nf 1/1/1 2/1/1 -2/-1/-1\nusemtl lamp\n\
             f 4//1 3//1 2//1\n"
        ).into_bytes();
        let mut mtl = b"newmtl white\nKd 0.7 0.7 0.7\nNs 3\nillum 2\nnewmtl lamp\nKe 17 12 4\n".to_vec();
        for (at, byte, kind) in edits {
            let file = if kind % 2 == 0 { &mut obj } else { &mut mtl };
            let at = at.index(file.len());
            if kind < 2 {
                file[at] = byte;
            } else {
                let word = WORDS[usize::from(byte) % WORDS.len()];
                file.splice(at..at, word.bytes());
            }
        }
        let folder = write(&obj, &mtl);
        if let Ok(part) = read(&folder.path().join("a.obj"), None) {
            for face in part.scene.face_ids() {
                prop_assert!(part.scene.polygon(face).len() >= 3);
            }
        }
    }
}
