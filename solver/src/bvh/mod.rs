//! Ray casting in batches over the scene's own faces.
//!
//! [`Bvh`] is the only place that knows obvhs. Callers hand over batches of rays (64 or more; a
//! whole patch, a tile of pixels), because what bounds incoherent rays is latency, which a kernel
//! can hide only across rays.
//!
//! **Tree.** `build`: a binary tree by obvhs, improved by `reinsertion`; `collapse`: nodes of eight
//! boxes over blocks of four triangles (`node`), of least expected cost.
//!
//! **Tests.** `slabs`: a ray against boxes; `triangle`: a ray against triangles, watertight.
//!
//! **Traversal.** `traverse` is portable and takes one ray at a time. `kernel`, with AVX2 where the
//! processor has it, keeps 32 rays in flight, or tests eight rays at once where there are few triangles.
//! Both give the same bits: they do the same operations, none of them fused, and the answer does not
//! depend on the order of visits (see `traverse`).
//!
//! Packets of eight coherent rays (one box against eight rays) were built and measured on camera
//! rays: 0.95 to 1.15 times the wave, not worth a second kernel.

mod build;
mod collapse;
#[cfg(target_arch = "x86_64")]
mod kernel;
mod node;
mod ray;
mod reinsertion;
mod slabs;
mod traverse;
mod triangle;

pub use ray::{Hit, Ray};

use crate::geometry::{Geometry, TriangleId};
use collapse::Wide;

/// A bounding volume hierarchy over the triangles of a [`Geometry`].
pub struct Bvh {
    /// `None` without triangles: every ray misses.
    wide: Option<Wide>,
}

impl Bvh {
    /// Builds the hierarchy: the same bytes at any thread count.
    pub fn build(geometry: &Geometry) -> Self {
        let wide = build::Binary::build(geometry).map(|tree| collapse::collapse(&tree, geometry));
        Self { wide }
    }

    /// Memory that it holds, in bytes.
    pub fn bytes(&self) -> usize {
        self.wide.as_ref().map_or(0, Wide::bytes)
    }

    /// Memory that the tree of so many triangles takes while it is built, in bytes: the tree itself, the binary
    /// one that it is made from, and that of obvhs.
    pub fn bytes_to_build(triangles: usize) -> usize {
        triangles * (build::BYTES_A_TRIANGLE + collapse::BYTES_A_TRIANGLE)
    }

    /// The first hit of each ray, or [`Hit::MISS`]. Both sides of faces are hit; of faces at the
    /// same distance the triangle of lowest id counts.
    ///
    /// # Panics
    /// When `hits` is not as long as `rays`.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "one hit for each ray");
        let Some(wide) = &self.wide else {
            return hits.fill(Hit::MISS);
        };
        #[cfg(target_arch = "x86_64")]
        if kernel::closest(wide, rays, hits) {
            return;
        }
        traverse::closest_hits(wide, rays, hits);
    }

    /// What [`Self::closest_hits`] answers, bit by bit, without the kernel of the processor: for
    /// tests and comparisons.
    ///
    /// # Panics
    /// When `hits` is not as long as `rays`.
    pub fn closest_hits_portable(&self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "one hit for each ray");
        match &self.wide {
            Some(wide) => traverse::closest_hits(wide, rays, hits),
            None => hits.fill(Hit::MISS),
        }
    }

    /// Whether anything lies on each ray between its `tmin` and `tmax`; stops at the first hit.
    ///
    /// # Panics
    /// When `blocked` is not as long as `rays`.
    pub fn occluded(&self, rays: &[Ray], blocked: &mut [bool]) {
        assert_eq!(rays.len(), blocked.len(), "one answer for each ray");
        let Some(wide) = &self.wide else {
            return blocked.fill(false);
        };
        #[cfg(target_arch = "x86_64")]
        if kernel::any(wide, rays, blocked) {
            return;
        }
        traverse::occluded(wide, rays, blocked);
    }

    /// What [`Self::occluded`] answers, without the kernel of the processor: for tests and
    /// comparisons.
    ///
    /// # Panics
    /// When `blocked` is not as long as `rays`.
    pub fn occluded_portable(&self, rays: &[Ray], blocked: &mut [bool]) {
        assert_eq!(rays.len(), blocked.len(), "one answer for each ray");
        match &self.wide {
            Some(wide) => traverse::occluded(wide, rays, blocked),
            None => blocked.fill(false),
        }
    }

    /// The triangles in the order of the leaves: neighbours in this order are neighbours in space.
    pub fn leaf_order(&self) -> &[TriangleId] {
        self.wide.as_ref().map_or(&[], |wide| &wide.leaf_order)
    }
}

#[cfg(test)]
mod tests;
