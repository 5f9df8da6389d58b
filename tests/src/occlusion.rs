//! The scenes of the ambient-occlusion cases: closed forms of openness, as geometry.

use crate::builder::{
    Part, Polygon, disk, flipped, parallelogram, polygon, room, scene, solid_box, sphere,
};
use crate::cases::{AmbientOcclusionCase, Receiver};
use glam::DVec3;
use luxel_scenes::Scene;

/// Half the length of what is infinite in a case, metres. What lies beyond covers (1/300)² of the
/// hemisphere at most, and the unit in the last place of a ray's coordinates is 4e-5 m.
const FAR: f64 = 300.0;

/// Height of what is infinitely high. Seen from a distance d, what lies above covers d/(2 · 3000)
/// of the hemisphere: 3e-4 for d = 2.
const HIGH: f64 = 3000.0;

/// Segments around spheres and cylinders. A regular polygon of as many sides differs from its
/// circle by (π/256)²/2 = 8e-5 of the radius.
const SEGMENTS: usize = 256;

/// Error of AO that the replacements above may cause. AO changes by at most 1 per radian by which a
/// silhouette moves; all are below 4e-4 rad. One and a half times that.
pub const TOLERANCE: f64 = 6e-4;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// The strip x = const from z = 0 to `height`, |y| < FAR.
fn wall_at_x(x: f64, height: f64) -> Polygon {
    parallelogram(v(x, -FAR, 0.0), DVec3::Y * (2.0 * FAR), DVec3::Z * height)
}

fn floor() -> Polygon {
    parallelogram(
        v(-FAR, -FAR, 0.0),
        DVec3::X * (2.0 * FAR),
        DVec3::Y * (2.0 * FAR),
    )
}

/// The occluders of a case; `point` matters where each point has its own scene.
fn occluders(case: &AmbientOcclusionCase, point: &Receiver) -> Vec<Polygon> {
    if let Some(list) = case.scene.get("occluders") {
        let list: Vec<Vec<[f64; 3]>> = serde_json::from_value(list.clone()).expect("polygons");
        return list.iter().map(|vertices| polygon(vertices)).collect();
    }
    match case.id.as_str() {
        "AO-01" => vec![floor(), wall_at_x(0.0, 1.0)],
        "AO-05" => vec![
            parallelogram(DVec3::ZERO, DVec3::X * HIGH, DVec3::Y * HIGH),
            parallelogram(DVec3::ZERO, DVec3::Y * HIGH, DVec3::Z * HIGH),
            parallelogram(DVec3::ZERO, DVec3::Z * HIGH, DVec3::X * HIGH),
        ],
        "AO-07" => vec![wall_at_x(0.0, 2.0), flipped(wall_at_x(1.0, 2.0))],
        "AO-09" => sphere(DVec3::Z, 0.5, SEGMENTS),
        "AO-11" => sphere(DVec3::ZERO, 0.8, SEGMENTS),
        "AO-12" => {
            let depth = DVec3::Z * point.depth.expect("a depth");
            let rim = disk(DVec3::ZERO, 1.0, SEGMENTS);
            let next = rim.iter().cycle().skip(1);
            let mut faces: Vec<Polygon> = rim
                .iter()
                .zip(next)
                .map(|(&a, &b)| vec![b, a, a + depth, b + depth])
                .collect();
            faces.push(rim);
            faces
        }
        // Facets outside the sphere, so that points of the sphere lie before them.
        "AO-14" => sphere(DVec3::ZERO, 1.0002, SEGMENTS)
            .into_iter()
            .filter(|face| face.iter().all(|corner| corner.z < 1e-9))
            .map(flipped)
            .collect(),
        "AO-15" => vec![wall_at_x(0.0, FAR)],
        "AO-17" if point.scene.as_deref() == Some("empty") => {
            // A convex body has nothing above its top.
            solid_box(v(-1.0, -1.0, -1.0), v(1.0, 1.0, 0.0))
        }
        "AO-17" => room(DVec3::ZERO, DVec3::ONE),
        "AO-18" => {
            let right = parallelogram(v(0.1, -FAR, 1.0), DVec3::Y * (2.0 * FAR), DVec3::X * FAR);
            let left = parallelogram(
                v(-0.1 - FAR, -FAR, 1.0),
                DVec3::Y * (2.0 * FAR),
                DVec3::X * FAR,
            );
            vec![right, left]
        }
        other => panic!("no geometry for case {other}"),
    }
}

/// The scene of a case as one point sees it.
fn occlusion_scene(case: &AmbientOcclusionCase, point: &Receiver) -> Scene {
    scene(
        "occluders",
        [Part::grey("grey", 0.5, occluders(case, point))],
    )
}

/// Points of a case that share a scene and arguments.
#[derive(Clone, Debug)]
pub struct Group {
    /// The occluders.
    pub scene: Scene,
    /// Positions (metres) and unit normals.
    pub points: Vec<(DVec3, DVec3)>,
    /// Exact values, one per point.
    pub values: Vec<f64>,
    /// Arguments of the command: the quantity and the length of rays.
    pub arguments: Vec<String>,
}

/// What has to be probed for a case: points that have their own scene or length are probed one by
/// one, others together.
///
/// # Panics
/// When the case is not known or does not hold what it should.
pub fn groups(case: &AmbientOcclusionCase) -> Vec<Group> {
    let own = case
        .points
        .iter()
        .any(|p| p.depth.is_some() || p.max_distance.is_some() || p.scene.is_some());
    let size = if own { 1 } else { case.points.len() };
    let group = |(points, values): (&[Receiver], &[f64])| {
        let first = &points[0];
        let mut arguments = ["--quantity", "ao"].map(str::to_owned).to_vec();
        if let Some(length) = first.max_distance {
            arguments.extend(["--max-distance".to_owned(), length.to_string()]);
        }
        Group {
            scene: occlusion_scene(case, first),
            points: points.iter().map(|p| (p.position(), p.normal())).collect(),
            values: values.to_vec(),
            arguments,
        }
    };
    let chunks = case.points.chunks(size).zip(case.values.chunks(size));
    chunks.map(group).collect()
}
