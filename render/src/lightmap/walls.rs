//! Thin walls that stand across a chart: planes at which it has to be cut ([`super::cut`]).
//!
//! Luxels of a chart that lie side by side, or with nothing but a buried texel between them, are read together by
//! bilinear filtering. Where a face stands between them, on the plane that both lie in, and more such pairs lie along the same line, the
//! chart is cut along it. Lines that few pairs lie at are those of legs and columns, of which light goes around.
//! Valid where the surface is plane; charts that are bent stay whole. Cost: two short rays a luxel.

use super::atlas::{Atlas, ChartId};
use super::bake::Luxels;
use super::cut::Plane;
use luxel_scenes::FaceId;
use luxel_solver::bvh::{Hit, Ray};
use luxel_solver::world::World;
use std::collections::BTreeMap;

/// Pairs that a wall must stand between: shorter ones are not worth a chart.
const PAIRS: usize = 6;

/// Least sine of the angle between a wall and the surface.
const STEEP: f64 = 0.05;

/// Lines agree when normals and offsets, relative to the scene, differ by no more.
const AGREEMENT: f64 = 1e-6;

/// The planes that are to cut faces, in metres. They are perpendicular to the faces.
pub fn cuts(world: &World<'_>, atlas: &Atlas, luxels: &Luxels) -> BTreeMap<FaceId, Vec<Plane>> {
    let pairs = pairs(atlas, luxels);
    let receivers = &luxels.lit.receivers;
    let segments: Vec<Ray> = pairs
        .iter()
        .map(|pair| {
            let [from, to] = pair.map(|luxel| receivers[luxel as usize].origin);
            Ray::segment(from, to)
        })
        .collect();
    let mut hits = vec![Hit::MISS; segments.len()];
    world.bvh().closest_hits(&segments, &mut hits);

    let geometry = world.surfaces().geometry();
    let mut lines: BTreeMap<ChartId, Vec<(Plane, usize)>> = BTreeMap::new();
    for (pair, hit) in pairs.iter().zip(&hits) {
        let Some(triangle) = hit.triangle() else {
            continue;
        };
        let wall = geometry.face(triangle);
        let luxel = &luxels.lit.luxels[pair[0] as usize];
        let surface = geometry.face(luxel.point.triangle);
        let Some(line) = line(world, surface, wall) else {
            continue;
        };
        let known = lines.entry(luxel.chart).or_default();
        match known.iter_mut().find(|(other, _)| agree(&line, other)) {
            Some((_, count)) => *count += 1,
            None => known.push((line, 1)),
        }
    }
    let in_metres = |line: &Plane| {
        let on_it = geometry.frame().to_world(line.normal * line.offset);
        Plane {
            normal: line.normal,
            offset: line.normal.dot(on_it),
        }
    };
    let mut found = BTreeMap::new();
    for face in world.scene().face_ids() {
        let chart = atlas.chart(face).and_then(|(chart, _)| lines.get(&chart));
        let polygon = geometry.polygon(face);
        // Others lie beside the face: there is nothing to cut and no edge to mark.
        let touches = |line: &Plane| {
            let mut distances = polygon.iter().map(|&corner| line.distance(corner));
            distances.clone().any(|d| d >= -AGREEMENT) && distances.any(|d| d <= AGREEMENT)
        };
        let planes: Vec<Plane> = chart
            .into_iter()
            .flatten()
            .filter(|(line, count)| *count >= PAIRS && touches(line))
            .map(|(line, _)| in_metres(line))
            .collect();
        if !planes.is_empty() {
            found.insert(face, planes);
        }
    }
    found
}

/// Luxels that are filtered together and lie in one plane: those of neighbouring texels of a chart, and of the next but one where
/// the texel between them is buried.
fn pairs(atlas: &Atlas, luxels: &Luxels) -> Vec<[u32; 2]> {
    const NONE: u32 = u32::MAX;
    let lit = &luxels.lit;
    let mut first = vec![NONE; atlas.texels()];
    for (number, luxel) in lit.luxels.iter().enumerate().rev() {
        first[luxel.texel as usize] = number as u32;
    }
    let [width, height] = atlas.size;
    let mut pairs = Vec::new();
    for (luxel, number) in lit.luxels.iter().zip(0_u32..) {
        let texel = luxel.texel as usize;
        let room = [
            width - 1 - texel % width,
            height - 1 - texel / width % height,
        ];
        for (room, step) in room.into_iter().zip([1, width]) {
            let is_buried = |texel: usize| lit.buried.binary_search(&(texel as u32)).is_ok();
            let steps = match room {
                2.. if is_buried(texel + step) => 2,
                1.. => 1,
                0 => continue,
            };
            let other = first[texel + steps * step];
            let Some(beside) = lit.luxels.get(other as usize) else {
                continue;
            };
            let [a, b] = [number, other].map(|l| &lit.receivers[l as usize]);
            let apart = b.position - a.position;
            let is_plane = a.normal.dot(b.normal) > 1.0 - AGREEMENT
                && apart.dot(a.normal).abs() <= AGREEMENT * apart.length();
            if beside.chart == luxel.chart && is_plane {
                pairs.push([number, other]);
            }
        }
    }
    pairs
}

/// The plane through the line in which two faces' planes meet, perpendicular to the first, in the unit frame; `None` where they
/// are nearly parallel.
fn line(world: &World<'_>, surface: FaceId, wall: FaceId) -> Option<Plane> {
    let geometry = world.surfaces().geometry();
    let plane = |face: FaceId| {
        let normal = geometry.normal(face);
        let corner = world.scene().polygon(face).next().unwrap_or_default();
        (normal, geometry.frame().to_unit(corner).dot(normal))
    };
    let ((normal, offset), (wall_normal, wall_offset)) = (plane(surface), plane(wall));
    let tilt = wall_normal.dot(normal);
    let across = wall_normal - normal * tilt;
    let length = across.length();
    if length < STEEP {
        return None;
    }
    // Of the two directions the one whose first component that is not zero is positive.
    let sign = across.to_array().into_iter().find(|x| x.abs() > AGREEMENT);
    let length = length * sign.unwrap_or(1.0).signum();
    Some(Plane {
        normal: across / length,
        offset: (wall_offset - tilt * offset) / length,
    })
}

fn agree(one: &Plane, other: &Plane) -> bool {
    (one.normal - other.normal).abs().max_element() <= AGREEMENT
        && (one.offset - other.offset).abs() <= AGREEMENT
}
