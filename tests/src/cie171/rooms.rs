//! The rooms of CIE 171:2006. Openings are holes, masks are wide enough that no ray through an
//! opening passes their ends, and percent are irradiances under a level illuminance of 100.

use super::{REFLECTION_RAYS, SKY_RAYS};
use crate::builder::{Part, Polygon, flipped, parallelogram, polygon, room, scene, solid_box};
use glam::DVec3;
use luxel_scenes::{Exitance, Scene};

/// A scene with what the command is told.
#[derive(Clone, Debug)]
pub(super) struct Room {
    pub(super) scene: Scene,
    pub(super) toml: String,
    pub(super) arguments: Vec<String>,
}

/// On which surfaces of a room the points of a case lie.
#[derive(Clone, Copy, Debug)]
pub(super) enum Points {
    Floor,
    /// On y = 0 and z = 0.
    WallAndFloor,
    /// On y = 4 and z = 0.
    BackWallAndFloor,
    /// On y = 0 and z = 3.
    WallAndCeiling,
}

impl Points {
    /// The normal at a point.
    #[expect(clippy::float_cmp, reason = "points lie on the planes as written")]
    pub(super) fn normal(self, p: DVec3) -> DVec3 {
        match self {
            Self::WallAndFloor | Self::WallAndCeiling if p.y == 0.0 => DVec3::Y,
            Self::BackWallAndFloor if p.y == 4.0 => DVec3::NEG_Y,
            Self::WallAndCeiling => DVec3::NEG_Z,
            _ => DVec3::Z,
        }
    }
}

/// A point of a face, with the area that it stands for.
pub(super) struct Node {
    pub(super) place: (DVec3, DVec3),
    pub(super) area: f64,
}

const SIZE: DVec3 = DVec3::new(4.0, 4.0, 3.0);

/// Where the sun stands, as the azimuth from +y over +x.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sun {
    TowardsPlusY,
    TowardsMinusY,
}

impl Room {
    fn new(parts: Vec<Part>, toml: &str, arguments: &[&str]) -> Self {
        Self {
            scene: scene("room", parts),
            toml: toml.to_owned(),
            arguments: arguments.iter().map(|&a| a.to_owned()).collect(),
        }
    }

    /// The room under one of the fifteen general skies, or, as the sixteenth, the traditional overcast one.
    /// `toml` holds the rest of the light.
    pub(super) fn under(&self, number: u32) -> Self {
        let model = if number == 16 {
            "model = \"cie-overcast\"\n".to_owned()
        } else {
            format!("model = \"cie-general\"\ntype = {number}\n{}", self.toml)
        };
        Self {
            toml: format!(
                "[scene]\nunits = \"photometric\"\n[[light]]\nkind = \"sky\"\nup = [0, 0, 1]\nlux = 100\nground_reflectance = 0.3\n{model}"
            ),
            ..self.clone()
        }
    }

    fn below_sky(parts: Vec<Part>, sun: Sun) -> Self {
        let azimuth = if sun == Sun::TowardsPlusY { 0 } else { 180 };
        let toml = format!("sun_elevation = 60\nsun_azimuth = {azimuth}\n");
        let rays = SKY_RAYS.to_string();
        Self::new(parts, &toml, &["--components", "direct", "--rays", &rays])
    }
}

fn black(faces: Vec<Polygon>) -> Part {
    Part::grey("black", 0.0, faces)
}

/// The six faces of the room, in the order x−, x+, y−, y+, z−, z+, without those listed.
fn walls_without(missing: &[usize]) -> Vec<Polygon> {
    let mut faces = room(DVec3::ZERO, SIZE);
    let mut index = 0;
    faces.retain(|_| {
        index += 1;
        !missing.contains(&(index - 1))
    });
    faces
}

/// A parallelogram without the middle one of its nine pieces, cut at the given fractions. Pieces
/// share their edges, so that no ray passes between them.
fn holed(corner: DVec3, sides: [DVec3; 2], cuts: [[f64; 2]; 2]) -> Vec<Polygon> {
    let [across, up] = cuts.map(|[a, b]| [0.0, a, b, 1.0]);
    let at = |i: usize, j: usize| corner + sides[0] * across[i] + sides[1] * up[j];
    (0..9)
        .filter(|&piece| piece != 4)
        .map(|piece| {
            let (i, j) = (piece % 3, piece / 3);
            vec![at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]
        })
        .collect()
}

/// 5.2: a diffuse point source above a floor.
pub(super) fn point_source() -> Room {
    let floor = parallelogram(DVec3::new(-2.0, -2.0, 0.0), DVec3::X * 4.0, DVec3::Y * 4.0);
    let toml = "[[light]]\nkind = \"point\"\ndistribution = \"lambertian\"\nposition = [0, 0, 3]\n\
                direction = [0, 0, -1]\ncandela = 1000\n";
    Room::new(vec![black(vec![floor])], toml, &["--components", "direct"])
}

/// 5.3: a luminous square in the ceiling.
pub(super) fn area_source() -> Room {
    let mut faces = walls_without(&[5]);
    let third = [[0.375, 0.625]; 2];
    faces.extend(holed(
        DVec3::Z * 3.0,
        [DVec3::Y * 4.0, DVec3::X * 4.0],
        third,
    ));
    let lamp = polygon(&[
        [1.5, 1.5, 3.0],
        [1.5, 2.5, 3.0],
        [2.5, 2.5, 3.0],
        [2.5, 1.5, 3.0],
    ]);
    let parts = vec![black(faces), Part::lamp("lamp", 1000.0, vec![lamp])];
    Room::new(parts, "", &["--components", "direct"])
}

/// 5.4 and 5.8: an isotropic source of 10 000 lm in the middle of a box.
pub(super) fn isotropic_source(size: DVec3, reflectance: f64) -> Room {
    let middle = (size / 2.0).to_array();
    let toml = format!("[[light]]\nkind = \"point\"\nposition = {middle:?}\nlumens = 10000\n");
    let walls = Part::grey("walls", reflectance, room(DVec3::ZERO, size));
    Room::new(vec![walls], &toml, &["--components", "direct"])
}

/// Points of Gauss's rule on the six faces of a box, `order`² on each, in the order x−, x+, y−, y+,
/// z−, z+.
pub(super) fn faces(size: DVec3, order: usize) -> Vec<Vec<Node>> {
    let rule = gauss(order);
    room(DVec3::ZERO, size)
        .iter()
        .map(|face| {
            let (across, up) = (face[1] - face[0], face[3] - face[0]);
            let vector_area = across.cross(up);
            let (normal, area) = (vector_area.normalize(), vector_area.length());
            let node = |&(x, a): &(f64, f64), &(y, b): &(f64, f64)| Node {
                place: (face[0] + across * x + up * y, normal),
                area: area * a * b,
            };
            let row = |x| rule.iter().map(move |y| node(x, y));
            rule.iter().flat_map(row).collect()
        })
        .collect()
}

/// Gauss's rule on [0, 1]: the zeros of the Legendre polynomial by Newton's iteration.
fn gauss(order: usize) -> Vec<(f64, f64)> {
    let n = order as f64;
    let node = |k: usize| {
        let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..8 {
            let (mut before, mut value) = (1.0, x);
            for degree in 2..=order {
                let d = degree as f64;
                let next = ((2.0 * d - 1.0) * x * value - (d - 1.0) * before) / d;
                (before, value) = (value, next);
            }
            slope = n * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        let weight = 1.0 / ((1.0 - x * x) * slope * slope);
        (f64::midpoint(1.0, x), weight)
    };
    (0..order).map(node).collect()
}

/// 5.5: a bright plane behind a pane of index 1.52, seen at an angle to the pane's normal.
pub(super) fn pane(degrees: f64) -> (Scene, String) {
    // Wide enough that light which the pane reflects inside does not reach its rims.
    let half = DVec3::new(500.0, 500.0, 0.5);
    let pane = Part::grey("glass", 0.0, solid_box(-half, half));
    let plane = parallelogram(
        DVec3::new(-500.0, -500.0, -1.0),
        DVec3::X * 1000.0,
        DVec3::Y * 1000.0,
    );
    let plane = Part::lamp("plane", 1.0, vec![plane]);
    let (sin, cos) = degrees.to_radians().sin_cos();
    let position = [20.0 * sin, 0.0, 20.0 * cos];
    let toml = format!(
        "[scene]\nup = \"z\"\n[material.glass]\nglass = 1.52\n[[camera]]\nposition = {position:?}\n\
         look_at = [0, 0, 0]\nup = [0, 1, 0]\nheight = 1\nsize = [32, 32]\n"
    );
    (scene("pane", [pane, plane]), toml)
}

/// A sun that does not count itself, so that what it lights has an irradiance of 100 over its
/// reflectance: the reflected light is then in percent.
fn reflecting(parts: Vec<Part>, towards: DVec3, facing: DVec3) -> Room {
    let towards = towards.normalize();
    let level = 100.0 / (REFLECTANCE * towards.dot(facing));
    let direction = (-towards).to_array();
    let toml =
        format!("[[light]]\nkind = \"directional\"\ndirection = {direction:?}\nlux = {level}\n");
    let rays = REFLECTION_RAYS.to_string();
    Room::new(parts, &toml, &["--components", "indirect", "--rays", &rays])
}

/// Reflectance of what reflects in a black room.
const REFLECTANCE: f64 = 0.5;

/// 5.6: a reflecting square in the middle of the floor. The sun shines in through the missing
/// wall y = 4, 30° above the horizon: below the ceiling, and onto all of the floor.
pub(super) fn bright_floor(side: f64) -> Room {
    let half = 2.0;
    let low = half - side / 2.0;
    let square = parallelogram(DVec3::new(low, low, 0.0), DVec3::X * side, DVec3::Y * side);
    let mut faces = walls_without(&[3, 4]);
    if side < 4.0 {
        let cuts = [[low / 4.0, (low + side) / 4.0]; 2];
        faces.extend(holed(DVec3::ZERO, [DVec3::X * 4.0, DVec3::Y * 4.0], cuts));
    }
    let parts = vec![
        black(faces),
        Part::grey("square", REFLECTANCE, vec![square]),
    ];
    let (sin, cos) = 30f64.to_radians().sin_cos();
    reflecting(parts, DVec3::new(0.0, cos, sin), DVec3::Z)
}

/// 5.7: a reflecting wall behind a black box as wide as the room. The sun shines in through the
/// missing ceiling, 60° above the horizon: over the opposite wall and the box.
pub(super) fn bright_wall() -> Room {
    let wall = room(DVec3::ZERO, SIZE).swap_remove(3);
    let mut faces = walls_without(&[3, 5]);
    faces.extend(solid_box(
        DVec3::new(0.0, 2.5, 0.0),
        DVec3::new(4.0, 2.7, 1.0),
    ));
    let parts = vec![black(faces), Part::grey("wall", REFLECTANCE, vec![wall])];
    let (sin, cos) = 60f64.to_radians().sin_cos();
    reflecting(parts, DVec3::new(0.0, -cos, sin), DVec3::NEG_Y)
}

/// 5.9: a room without ceiling.
pub(super) fn roof_opening() -> Room {
    Room::below_sky(vec![black(walls_without(&[5]))], Sun::TowardsPlusY)
}

/// The room with an opening of 2 × 1 m in the wall y = 0.
fn with_window() -> Vec<Polygon> {
    let mut faces = walls_without(&[2]);
    let cuts = [[1.0 / 3.0, 2.0 / 3.0], [0.25, 0.75]];
    faces.extend(holed(DVec3::ZERO, [DVec3::Z * 3.0, DVec3::X * 4.0], cuts));
    faces
}

/// 5.11: an opening in the facade.
pub(super) fn facade() -> Room {
    Room::below_sky(vec![black(with_window())], Sun::TowardsMinusY)
}

/// 5.13: the same below a canopy of the given depth and exitance (in percent of the level
/// illuminance).
pub(super) fn canopy(depth: f64, exitance: f64) -> Room {
    let corner = DVec3::new(-8.0, -depth, 3.0);
    let mask = flipped(parallelogram(corner, DVec3::X * 20.0, DVec3::Y * depth));
    let radiance = Exitance::splat(exitance).to_radiance().0.x;
    let parts = vec![
        black(with_window()),
        Part::lamp("mask", radiance, vec![mask]),
    ];
    Room::below_sky(parts, Sun::TowardsMinusY)
}

/// 5.14: the same opposite a wall of the given height.
pub(super) fn opposite(height: f64) -> Room {
    let corner = DVec3::new(-28.0, -6.0, 0.0);
    let mask = parallelogram(corner, DVec3::Z * height, DVec3::X * 60.0);
    let parts = vec![black(with_window()), Part::grey("mask", 0.0, vec![mask])];
    Room::below_sky(parts, Sun::TowardsMinusY)
}
