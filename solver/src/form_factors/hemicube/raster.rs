//! Rasterising polygons onto the five faces of a hemicube.
//!
//! A pixel with direction d lies in a polygon when d is inside the cone of its edges: the sign of
//! (a × b)·d for each edge from a to b, all vectors relative to the eye. This is rasterisation in
//! homogeneous coordinates; polygons that reach behind the eye need no special case, and no vertex is
//! ever divided by its w. Clipping to the view only bounds the pixels that are tried. Two polygons
//! that share an edge see values that are equal up to their sign, to the bit; a value of zero goes to
//! the side that a top-left rule names, so that no pixel is lost or taken twice. 1/w is linear in the
//! picture, which makes the depth perspective-correct and exact to rounding.
//!
//! Source: M. Olano, T. Greer, "Triangle scan conversion using 2D homogeneous coordinates", Graphics
//! Hardware 1997; J. F. Blinn, M. E. Newell, "Clipping using homogeneous coordinates", SIGGRAPH 1978.
//! Valid for planar convex polygons; those whose plane holds the eye have no picture. Cost: O(rows)
//! per polygon and face, then one comparison a pixel. f64 throughout.

use super::super::clip::crossing;
use super::pixels::Pixels;
use glam::DVec3;

/// What a side of a polygon does with light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FacetSide {
    /// It is counted at this index.
    Counted(u32),
    /// It is lost: the side is black.
    Black,
    /// It passes: the side is not there, or another facet stands for it.
    Open,
}

/// A polygon as the hemicube sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet<'a> {
    /// Vertices in metres of a planar convex polygon, counter-clockwise from the front.
    pub vertices: &'a [DVec3],
    /// Its normal, of any length.
    pub normal: DVec3,
    /// Its front.
    pub front: FacetSide,
    /// Its back; [`FacetSide::Black`] for one-sided polygons.
    pub back: FacetSide,
}

/// A hemicube of a resolution, with its buffers.
#[derive(Clone, Debug)]
pub struct Hemicube {
    resolution: usize,
    pixels: Pixels,
    /// 1/w of what is nearest in each pixel of the face at hand, zero for nothing.
    inverse_depth: Vec<f64>,
    /// What it is, plus one; zero for black or nothing.
    items: Vec<u32>,
}

/// One face: its axes, right × up = forward, and its pixels.
struct Face {
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Rows of pixels, from `bottom` up.
    rows: usize,
    /// The place of the lowest border: −1 on top, 0 on a side.
    bottom: f64,
}

impl Hemicube {
    /// A hemicube with `resolution` pixels along an edge, rounded up to an even number.
    pub fn new(resolution: usize) -> Self {
        let resolution = resolution.max(2).next_multiple_of(2);
        Self {
            resolution,
            pixels: Pixels::new(resolution),
            inverse_depth: Vec::new(),
            items: Vec::new(),
        }
    }

    /// Memory of a hemicube of a resolution, in bytes: the pixels of top and side, and the buffers of a face.
    pub fn bytes_for(resolution: usize) -> usize {
        let face = resolution * resolution;
        face * size_of::<f64>()
            + face / 2 * size_of::<f64>()
            + face * (size_of::<f64>() + size_of::<u32>())
    }

    /// Adds `weight` times the form factor from a surface element to each facet that it sees to
    /// `factors`, at the index that the facet names. `angle` in radians turns the cube about the
    /// unit `normal`. What is not added up to `weight` escapes or meets black.
    ///
    /// Biased by aliasing (see the module).
    ///
    /// # Panics
    /// When a facet names an index that `factors` does not have.
    pub fn add(
        &mut self,
        origin: DVec3,
        normal: DVec3,
        angle: f64,
        facets: &[Facet],
        weight: f64,
        factors: &mut [f64],
    ) {
        let n = self.resolution;
        for (k, face) in faces(normal, angle, n).iter().enumerate() {
            self.inverse_depth.clear();
            self.inverse_depth.resize(n * face.rows, 0.0);
            self.items.clear();
            self.items.resize(n * face.rows, 0);
            for facet in facets {
                self.draw(origin, face, facet);
            }
            let pixels = if k == 0 {
                &self.pixels.top
            } else {
                &self.pixels.side
            };
            for (&item, &pixel) in self.items.iter().zip(pixels) {
                if item > 0 {
                    factors[item as usize - 1] += weight * pixel;
                }
            }
        }
    }

    /// Draws one polygon onto one face.
    fn draw(&mut self, origin: DVec3, face: &Face, facet: &Facet) {
        let Some(&first) = facet.vertices.first() else {
            return;
        };
        let offset = first - origin;
        let height = facet.normal.dot(offset);
        // Both positions are rounded relative to their own size, however near they are to each other.
        let size = offset.abs() + origin.abs() + first.abs();
        let noise = 8.0 * f64::EPSILON * facet.normal.abs().dot(size);
        if height.abs() <= noise {
            return;
        }
        // Seen from the front, the triple product of a polygon's vertices is negative.
        let (side, sign) = if height < 0.0 {
            (facet.front, -1.0)
        } else {
            (facet.back, 1.0)
        };
        let item = match side {
            FacetSide::Counted(id) => id + 1,
            FacetSide::Black => 0,
            FacetSide::Open => return,
        };
        let view = |v: DVec3| {
            let r = v - origin;
            DVec3::new(r.dot(face.right), r.dot(face.up), r.dot(face.forward))
        };
        let vertices: Vec<DVec3> = facet.vertices.iter().map(|&v| view(v)).collect();
        let Some(bounds) = self.bounds(&vertices, face) else {
            return;
        };
        let last = vertices[vertices.len() - 1];
        let mut edges = Vec::with_capacity(vertices.len());
        let mut a = last;
        for &b in &vertices {
            edges.push(a.cross(b) * sign);
            a = b;
        }
        let plane = DVec3::new(
            facet.normal.dot(face.right),
            facet.normal.dot(face.up),
            facet.normal.dot(face.forward),
        ) / height;
        let n = self.resolution;
        for row in bounds.rows.0..bounds.rows.1 {
            let y = face.row(row, n);
            let is_inside = |column: usize| {
                let x = place(column, n);
                edges.iter().all(|e| {
                    let value = e.x * x + (e.y * y + e.z);
                    value > 0.0 || (value == 0.0 && (e.x > 0.0 || (e.x == 0.0 && e.y > 0.0)))
                })
            };
            // Rounding is monotonic, so that the pixels inside are a run: its ends are searched.
            let (low, high) = run(&edges, y, n, bounds.columns);
            let Some(start) = (low..high).find(|&c| is_inside(c)) else {
                continue;
            };
            let end = (start..high).rfind(|&c| is_inside(c)).unwrap_or(start);
            let base = row * n;
            for column in start..=end {
                let inverse = plane.x * place(column, n) + (plane.y * y + plane.z);
                let at = base + column;
                if inverse > self.inverse_depth[at] {
                    self.inverse_depth[at] = inverse;
                    self.items[at] = item;
                }
            }
        }
    }

    /// The pixels that the part of a polygon inside the view can cover.
    fn bounds(&self, vertices: &[DVec3], face: &Face) -> Option<Bounds> {
        // The four sides of the view; w > 0 follows from them.
        let left = |v: DVec3| v.z + v.x;
        let right = |v: DVec3| v.z - v.x;
        let bottom = |v: DVec3| v.y - face.bottom * v.z;
        let top = |v: DVec3| v.z - v.y;
        let planes: [&dyn Fn(DVec3) -> f64; 4] = [&left, &right, &bottom, &top];
        if planes
            .iter()
            .any(|height| vertices.iter().all(|&v| height(v) <= 0.0))
        {
            return None;
        }
        let mut inside = vertices.to_vec();
        for height in planes {
            let mut out = Vec::with_capacity(inside.len() + 1);
            for (k, &b) in inside.iter().enumerate() {
                let a = inside[(k + inside.len() - 1) % inside.len()];
                let (ha, hb) = (height(a), height(b));
                if (ha < 0.0) != (hb < 0.0) {
                    out.push(crossing(a, ha, b, hb));
                }
                if hb >= 0.0 {
                    out.push(b);
                }
            }
            inside = out;
        }
        let n = self.resolution as f64;
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for v in inside.iter().filter(|v| v.z > 0.0) {
            for (axis, place) in [(v.x / v.z + 1.0), (v.y / v.z - face.bottom)]
                .into_iter()
                .enumerate()
            {
                let pixel = place * n / 2.0;
                low[axis] = low[axis].min(pixel);
                high[axis] = high[axis].max(pixel);
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let range = |axis: usize, count: usize| {
            let start = (low[axis] - 1.0).max(0.0) as usize;
            let end = ((high[axis] + 1.0).ceil().max(0.0) as usize).min(count);
            (start, end)
        };
        Some(Bounds {
            columns: range(0, self.resolution),
            rows: range(1, face.rows),
        })
    }
}

/// Ranges of pixels.
struct Bounds {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Face {
    /// The place of the centre of a row.
    fn row(&self, row: usize, resolution: usize) -> f64 {
        (2 * row + 1) as f64 / resolution as f64 + self.bottom
    }
}

/// The place of the centre of a column, in (−1, 1).
fn place(column: usize, resolution: usize) -> f64 {
    (2 * column + 1) as f64 / resolution as f64 - 1.0
}

/// A range of columns that holds the run of a row inside all edges, with a pixel to spare.
fn run(edges: &[DVec3], y: f64, resolution: usize, columns: (usize, usize)) -> (usize, usize) {
    let n = resolution as f64;
    let (mut low, mut high) = (columns.0 as f64, columns.1 as f64);
    for e in edges {
        let pixel = (1.0 - (e.y * y + e.z) / e.x) * n / 2.0;
        if e.x > 0.0 && pixel.is_finite() {
            low = low.max(pixel - 2.0);
        } else if e.x < 0.0 && pixel.is_finite() {
            high = high.min(pixel + 2.0);
        }
    }
    (low.max(0.0) as usize, high.max(0.0) as usize)
}

/// The top and the four sides around a normal.
fn faces(normal: DVec3, angle: f64, resolution: usize) -> [Face; 5] {
    let (u, v) = normal.any_orthonormal_pair();
    let (sin, cos) = angle.sin_cos();
    let t = u * cos + v * sin;
    let b = normal.cross(t);
    let side = |forward: DVec3| Face {
        right: normal.cross(forward),
        up: normal,
        forward,
        rows: resolution / 2,
        bottom: 0.0,
    };
    [
        Face {
            right: t,
            up: b,
            forward: normal,
            rows: resolution,
            bottom: -1.0,
        },
        side(t),
        side(b),
        side(-t),
        side(-b),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::super::point_to_polygon;
    use super::*;

    fn facet(vertices: &[DVec3], id: u32) -> Facet<'_> {
        Facet {
            vertices,
            normal: (vertices[1] - vertices[0]).cross(vertices[2] - vertices[0]),
            front: FacetSide::Counted(id),
            back: FacetSide::Black,
        }
    }

    fn factors(resolution: usize, facets: &[Facet], count: usize) -> Vec<f64> {
        let mut factors = vec![0.0; count];
        let normal = DVec3::new(0.1, 0.2, 1.0).normalize();
        Hemicube::new(resolution).add(DVec3::ZERO, normal, 0.3, facets, 1.0, &mut factors);
        factors
    }

    #[test]
    fn a_triangulated_box_leaves_no_pixel_uncovered_and_takes_none_twice() {
        // Eight corners around the eye, turned so that no edge follows the grid.
        let turn = glam::DMat3::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 1.1);
        let corner = |k: usize| {
            let bit = |b: usize| if k & b == 0 { -0.8 } else { 1.1 };
            turn * DVec3::new(bit(1), bit(2), bit(4))
        };
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let triangles: Vec<[DVec3; 3]> = quads
            .iter()
            .flat_map(|q| [[q[2], q[1], q[0]], [q[3], q[2], q[0]]])
            .map(|t| t.map(corner))
            .collect();
        let mut facets: Vec<_> = triangles.iter().map(|t| facet(t, 0)).collect();
        for resolution in [16, 50, 128] {
            let sum = factors(resolution, &facets, 1)[0];
            // Sum of 3N² values of order N⁻².
            assert!((sum - 1.0).abs() < 1e-12, "{resolution}: {sum}");
        }
        // Each pixel is taken by one triangle: with ids of their own they still sum to one, and a
        // reversed order changes nothing.
        for (k, f) in facets.iter_mut().enumerate() {
            f.front = FacetSide::Counted(k as u32);
        }
        let forwards = factors(64, &facets, 12);
        facets.reverse();
        let backwards = factors(64, &facets, 12);
        assert_eq!(forwards, backwards, "no pixel is contested");
    }

    #[test]
    fn polygons_reaching_behind_the_eye_are_clipped_exactly() {
        // A ceiling that is huge and reaches below the horizon on one side.
        let ceiling = [
            DVec3::new(-100.0, 100.0, -30.0),
            DVec3::new(100.0, 100.0, 32.0),
            DVec3::new(100.0, -100.0, 32.0),
            DVec3::new(-100.0, -100.0, -30.0),
        ];
        let normal = DVec3::new(0.1, 0.2, 1.0).normalize();
        let exact = point_to_polygon(DVec3::ZERO, normal, &ceiling);
        let mut last = f64::INFINITY;
        for resolution in [32, 128, 512] {
            let error = (factors(resolution, &[facet(&ceiling, 0)], 1)[0] - exact).abs();
            // Boundary pixels: a perimeter of N pixels, each wrong by half of N^-2 at random.
            assert!(error < 2.0 / resolution as f64, "{resolution}: {error}");
            last = last.min(error);
        }
        assert!(last < 1e-3, "{last}");
    }

    #[test]
    fn the_nearer_polygon_hides_the_farther_and_backs_are_black() {
        let square = |z: f64, h: f64| {
            [
                DVec3::new(-h, h, z),
                DVec3::new(h, h, z),
                DVec3::new(h, -h, z),
                DVec3::new(-h, -h, z),
            ]
        };
        let (near, far) = (square(1.0, 1.0), square(2.0, 2.0));
        let mut reversed = near;
        reversed.reverse();
        let unhidden = factors(128, &[facet(&far, 1)], 2)[1];
        for order in [
            [facet(&near, 0), facet(&far, 1)],
            [facet(&far, 1), facet(&near, 0)],
        ] {
            let f = factors(128, &order, 2);
            // Seen from the centre both cover the same pixels up to those on the border.
            assert!((f[0] - unhidden).abs() < 1e-2 && f[1] < 1e-2, "{f:?}");
        }
        let f = factors(128, &[facet(&reversed, 0), facet(&far, 1)], 2);
        assert!(
            f[0] == 0.0 && f[1] < 1e-2,
            "a back is black and occludes: {f:?}"
        );
        let two_sided = Facet {
            back: FacetSide::Counted(0),
            ..facet(&reversed, 1)
        };
        assert!(
            factors(128, &[two_sided], 2)[0] > 0.5,
            "a back with an id counts"
        );
    }
}
