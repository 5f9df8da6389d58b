//! A large hall: tessellated walls, columns, and clutter of boxes and spheres, with normals and
//! texture coordinates, in objects and groups of several materials.

use std::f64::consts::{PI, TAU};

/// Materials by number: name and grey reflectance.
pub(crate) const MATERIALS: [(&str, f64); 5] = [
    ("wall", 0.7),
    ("column", 0.5),
    ("wood", 0.3),
    ("plastic", 0.6),
    ("lamp", 0.1),
];

/// Bodies of one object of the clutter.
const BODIES: u32 = 400;
/// Rings and sectors of a sphere, sectors of a column.
const ROUND: u32 = 12;
/// Triangles of a body on average: a box has 12, a sphere of [`ROUND`] rings 2 · 12 · 11.
const BODY_TRIANGLES: u32 = 6 + ROUND * (ROUND - 1);
/// The hall in metres.
const SIZE: [f64; 3] = [60.0, 12.0, 40.0];

/// A named mesh of one material; each vertex has all attributes.
pub(crate) struct Mesh {
    pub(crate) name: String,
    pub(crate) material: usize,
    pub(crate) positions: Vec<[f64; 3]>,
    pub(crate) normals: Vec<[f64; 3]>,
    pub(crate) uvs: Vec<[f64; 2]>,
    /// Triangles and quads, counter-clockwise from the front.
    pub(crate) faces: Vec<Vec<u32>>,
}

/// The hall of about `triangles` triangles: a quarter in walls, a tenth in columns.
pub(crate) fn hall(triangles: u32) -> Vec<Mesh> {
    let mut meshes = Vec::new();
    let tiles = f64::from(triangles / 4 / 12).sqrt() as u32;
    let mut walls = Mesh::new("walls", 0);
    walls.cuboid([0.0; 3], SIZE, tiles, true);
    meshes.push(walls);
    let mut lamp = Mesh::new("lamp", 4);
    lamp.cuboid([20.0, 11.0, 15.0], [40.0, 11.5, 25.0], 1, false);
    meshes.push(lamp);
    let slices = triangles / 10 / (40 * 2 * ROUND);
    for column in 0..40 {
        let mut mesh = Mesh::new(&format!("column_{column}"), 1);
        let foot = [
            f64::from(column / 4) * 6.0 + 3.0,
            0.0,
            f64::from(column % 4) * 10.0 + 5.0,
        ];
        mesh.cylinder(foot, 0.4, SIZE[1], slices.max(1));
        meshes.push(mesh);
    }
    let bodies = (triangles / 20 * 13) / BODY_TRIANGLES;
    for first in (0..bodies).step_by(BODIES as usize) {
        let number = first / BODIES;
        let material = 2 + (number % 2) as usize;
        let mut mesh = Mesh::new(&format!("clutter_{number}"), material);
        for body in first..bodies.min(first + BODIES) {
            let random = |k: u32| random(body * 8 + k);
            let radius = 0.02 + 0.15 * random(0);
            let at = |axis: usize| 1.0 + random(1 + axis as u32) * (SIZE[axis] - 2.0);
            let centre = [at(0), at(1), at(2)];
            if body % 2 == 0 {
                mesh.cuboid(
                    centre.map(|x| x - radius),
                    centre.map(|x| x + radius),
                    1,
                    false,
                );
            } else {
                mesh.sphere(centre, radius);
            }
        }
        meshes.push(mesh);
    }
    meshes
}

/// Triangles of all meshes, quads counted as two.
pub(crate) fn triangle_count(meshes: &[Mesh]) -> usize {
    let faces = meshes.iter().flat_map(|mesh| &mesh.faces);
    faces.map(|face| face.len() - 2).sum()
}

/// Between 0 and 1; the same at each run.
fn random(index: u32) -> f64 {
    let mut x = index.wrapping_mul(0x9E37_79B9) ^ 0x85EB_CA6B;
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    f64::from(x ^ (x >> 16)) / f64::from(u32::MAX)
}

impl Mesh {
    fn new(name: &str, material: usize) -> Self {
        Self {
            name: name.to_owned(),
            material,
            positions: Vec::new(),
            normals: Vec::new(),
            uvs: Vec::new(),
            faces: Vec::new(),
        }
    }

    fn vertex(&mut self, position: [f64; 3], normal: [f64; 3], uv: [f64; 2]) {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
    }

    /// A grid of vertices by `at(i, j)`, row after row, and the quads between them.
    fn grid(
        &mut self,
        (columns, rows): (u32, u32),
        at: impl Fn(f64, f64) -> ([f64; 3], [f64; 3]),
        turned: bool,
        mut add: impl FnMut(&mut Self, [u32; 4], u32),
    ) {
        let first = self.positions.len() as u32;
        for j in 0..=rows {
            for i in 0..=columns {
                let uv = [
                    f64::from(i) / f64::from(columns),
                    f64::from(j) / f64::from(rows),
                ];
                let (position, normal) = at(uv[0], uv[1]);
                self.vertex(position, normal, uv);
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let corner = |di: u32, dj: u32| first + (j + dj) * (columns + 1) + i + di;
                let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if turned {
                    quad.reverse();
                }
                add(self, quad, j);
            }
        }
    }

    fn push_quad(&mut self, quad: [u32; 4], _row: u32) {
        self.faces.push(quad.to_vec());
    }

    fn push_two(&mut self, [a, b, c, d]: [u32; 4], _row: u32) {
        self.faces.extend([vec![a, b, c], vec![a, c, d]]);
    }

    fn cuboid(&mut self, lower: [f64; 3], upper: [f64; 3], tiles: u32, inwards: bool) {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for high in [false, true] {
                let at = |s: f64, t: f64| {
                    let mut position = lower;
                    position[axis] = if high { upper[axis] } else { lower[axis] };
                    position[u] += (upper[u] - lower[u]) * s;
                    position[v] += (upper[v] - lower[v]) * t;
                    let mut normal = [0.0; 3];
                    normal[axis] = if high == inwards { -1.0 } else { 1.0 };
                    (position, normal)
                };
                let add = if tiles > 1 {
                    Self::push_quad
                } else {
                    Self::push_two
                };
                self.grid((tiles, tiles), at, high == inwards, add);
            }
        }
    }

    fn cylinder(&mut self, foot: [f64; 3], radius: f64, height: f64, slices: u32) {
        let at = |s: f64, t: f64| {
            let (sin, cos) = (s * TAU).sin_cos();
            let position = [
                foot[0] + radius * cos,
                foot[1] + height * t,
                foot[2] + radius * sin,
            ];
            (position, [cos, 0.0, sin])
        };
        self.grid((ROUND, slices), at, true, Self::push_two);
    }

    fn sphere(&mut self, centre: [f64; 3], radius: f64) {
        let at = |s: f64, t: f64| {
            let ((sin, cos), (ring, height)) = ((s * TAU).sin_cos(), (t * PI).sin_cos());
            let normal = [ring * cos, -height, ring * sin];
            let along = |axis: usize| centre[axis] + radius * normal[axis];
            ([along(0), along(1), along(2)], normal)
        };
        self.grid((ROUND, ROUND), at, true, |mesh, [a, b, c, d], row| {
            // Turned: a and b are on the upper ring, c and d on the lower; at a pole they coincide.
            if row + 1 < ROUND {
                mesh.faces.push(vec![a, b, c]);
            }
            if row > 0 {
                mesh.faces.push(vec![a, c, d]);
            }
        });
    }
}
