//! What a bake holds.

use super::{Bake, Directional, Include};
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::footprint::{Footprint, larger_error};
use crate::cli::goal::Goal;
use crate::cli::steering::first_error;
use crate::image::exr::Picture;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::directional;
use crate::lightmap::luxels::{self, Luxel};
use crate::lightmap::map::Lightmap;
use luxel_solver::adaptive;
use luxel_solver::gather::{Components, Gathered};
use luxel_solver::world::{Receiver, World};

impl Bake {
    /// Patches of the mesh that is begun with.
    pub(super) fn first_patches(&self, error: f64) -> usize {
        let has_indirect = |include: &Include| {
            matches!(
                include.components(),
                Some(Components::All | Components::Indirect)
            )
        };
        if self.include.iter().any(has_indirect) {
            adaptive::first_patches(error)
        } else {
            0
        }
    }

    /// Refuses what would not fit into memory with so many luxels, and says what would. Returns what else is held when patches
    /// are solved.
    pub(super) fn require_memory(
        &self,
        world: &World<'_>,
        atlas: &Atlas,
        luxels: usize,
        goal: &Goal,
        context: &Context<'_>,
    ) -> Result<Footprint, Failure> {
        let texels = atlas.texels();
        let page = atlas.size[0] * atlas.size[1];
        let found = luxels * (size_of::<Luxel>() + size_of::<Receiver>() + size_of::<Gathered>());
        let has_directions = self.directional != Directional::None;
        let directions = if has_directions {
            directional::bytes_to_gather(luxels) + directional::bytes_for(texels)
        } else {
            0
        };
        let grid = self.volume.grid(world.scene())?;
        let volume = grid.map_or(0, |grid| self.volume.bytes(&grid));
        let held = Footprint::of(world)
            .with("luxels", found.max(luxels::bytes_to_find(texels)))
            .with(
                "what is gathered at them",
                adaptive::bytes_to_gather(luxels).max(directions),
            )
            .with("the irradiance volume", volume)
            .with(
                "maps",
                2 * self.include.len() * Lightmap::bytes_for(texels)
                    + 2 * Picture::bytes_for(page, 1),
            );
        let with_mesh = |error: f64| {
            let patches = self.first_patches(error);
            let solving = adaptive::bytes_to_solve(patches, world.scene());
            held.with(
                "patches and their solutions",
                if patches > 0 { solving } else { 0 },
            )
        };
        let error = first_error(Some(goal));
        with_mesh(error).require(context, || {
            let limit = context.common.max_memory;
            larger_error(error, |error| with_mesh(error).fits(limit)).or_else(|| {
                let fits = limit.map_or(0, |limit| limit.0.get()) as f64;
                let share = (fits / with_mesh(error).total() as f64).sqrt();
                let side = (atlas.size[0] as f64 * share) as usize / 4 * 4;
                (side >= 16 && atlas.pages == 1).then(|| format!("about --size {side}"))
            })
        })?;
        Ok(held)
    }
}
