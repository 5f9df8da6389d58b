//! Where the faces of a scene lie in the pages of a lightmap.
//!
//! Coordinates are in texels from the upper left corner of the page's first texel, x to the right and y down the rows:
//! the centre of texel (i, j) is (i + ½, j + ½). [`Atlas::uv`] turns them into texture coordinates.

use glam::DVec2;
use luxel_scenes::{FaceId, ObjectId, Scene};
use luxel_solver::geometry::{Geometry, TriangleId};

/// Index of a chart in [`Atlas::charts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ChartId(pub u32);

impl ChartId {
    /// The position in [`Atlas::charts`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Faces of one object that lie together in a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chart {
    /// The page, from zero.
    pub page: u32,
    /// The object that its faces belong to.
    pub object: ObjectId,
}

/// The pages of a lightmap, and where each face lies in them.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Width and height of every page in texels.
    pub size: [usize; 2],
    /// Number of pages.
    pub pages: usize,
    /// Place of each corner of the scene, in texels of its face's page.
    pub corners: Vec<DVec2>,
    /// Chart of each face; `None` for faces that get no light of their own.
    pub face_chart: Vec<Option<ChartId>>,
    /// All charts.
    pub charts: Vec<Chart>,
    /// Texels between charts are at least twice as many, and so many lie at the edges of a page.
    pub padding: usize,
}

/// A rectangle of texels: first column and row, and those behind the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Rectangle {
    /// The page, from zero.
    pub page: u32,
    /// First column and row.
    pub min: [usize; 2],
    /// Column and row behind the last.
    pub max: [usize; 2],
}

impl Atlas {
    /// Texels of all pages.
    pub fn texels(&self) -> usize {
        self.size[0] * self.size[1] * self.pages
    }

    /// Position of a texel: page by page, row by row.
    pub fn texel(&self, page: u32, column: usize, row: usize) -> usize {
        (page as usize * self.size[1] + row) * self.size[0] + column
    }

    /// The chart of a face with its id; `None` where it has none.
    pub fn chart(&self, face: FaceId) -> Option<(ChartId, Chart)> {
        let id = self.face_chart[face.index()]?;
        Some((id, self.charts[id.index()]))
    }

    /// Texture coordinates of a place in texels, v down from the page's upper edge.
    pub fn uv(&self, texels: DVec2) -> DVec2 {
        texels / DVec2::new(self.size[0] as f64, self.size[1] as f64)
    }

    /// The corners of a triangle in texels.
    pub fn triangle(&self, scene: &Scene, geometry: &Geometry, triangle: TriangleId) -> [DVec2; 3] {
        let first = scene.faces[geometry.face(triangle).index()].first_corner as usize;
        let fan = geometry.fan_index(triangle);
        [first, first + fan + 1, first + fan + 2].map(|corner| self.corners[corner])
    }

    /// The texels of an object by page, their rectangles without anything around; in the order of the pages.
    pub fn rectangles(&self, scene: &Scene) -> Vec<Vec<Rectangle>> {
        let mut found: Vec<Vec<Rectangle>> = vec![Vec::new(); scene.objects.len()];
        for face in scene.face_ids() {
            let Some((_, chart)) = self.chart(face) else {
                continue;
            };
            let own = &mut found[chart.object.index()];
            let index = own.iter().position(|r| r.page == chart.page);
            let rectangle = if let Some(index) = index {
                &mut own[index]
            } else {
                own.push(Rectangle {
                    page: chart.page,
                    min: self.size,
                    max: [0; 2],
                });
                own.last_mut()
                    .unwrap_or_else(|| unreachable!("one was pushed"))
            };
            for corner in scene.faces[face.index()].corners() {
                let place = self.corners[corner].to_array();
                let low = place.map(|x| x.floor().max(0.0) as usize);
                let high = place.map(|x| x.ceil().max(0.0) as usize);
                for axis in [0, 1] {
                    rectangle.min[axis] = rectangle.min[axis].min(low[axis]);
                    let most = high[axis].min(self.size[axis]);
                    rectangle.max[axis] = rectangle.max[axis].max(most);
                }
            }
        }
        for rectangles in &mut found {
            rectangles.sort_by_key(|rectangle| rectangle.page);
        }
        found
    }

    /// Area of each object's faces in texels.
    pub fn object_texels(&self, scene: &Scene) -> Vec<f64> {
        let mut areas = vec![0.0; scene.objects.len()];
        for face in scene.face_ids() {
            if self.face_chart[face.index()].is_some() {
                let ring = &self.corners[scene.faces[face.index()].corners()];
                areas[scene.faces[face.index()].object.index()] += polygon_area(ring).abs();
            }
        }
        areas
    }

    /// Share of all texels that faces lie on.
    pub fn utilisation(&self, scene: &Scene) -> f64 {
        self.object_texels(scene).iter().sum::<f64>() / self.texels().max(1) as f64
    }
}

/// Signed area of a polygon: positive where it turns from x to y.
pub(crate) fn polygon_area(ring: &[DVec2]) -> f64 {
    let Some(&origin) = ring.first() else {
        return 0.0;
    };
    let pairs = ring[1..].windows(2);
    pairs
        .map(|pair| 0.5 * (pair[0] - origin).perp_dot(pair[1] - origin))
        .sum()
}
