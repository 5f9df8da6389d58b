//! What a bake holds.

use super::deliver::{PAGES_AT_A_TIME, bytes_to_preview};
use super::{Bake, Directional, Include};
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::footprint::{Footprint, larger_error, largest};
use crate::cli::goal::Goal;
use crate::cli::steering::first_error;
use crate::film::Film;
use crate::image::exr::Picture;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::directional;
use crate::lightmap::luxels::{self, Luxel};
use crate::lightmap::map::Lightmap;
use crate::lightmap::masks::Mask;
use luxel_solver::adaptive;
use luxel_solver::gather::{Components, Gathered, Tally};
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
        if self.include.iter().any(has_indirect)
            && !self.is_traced()
            && self.reflections.bounces().reflect()
        {
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
        masks: usize,
        goal: &Goal,
        context: &Context<'_>,
    ) -> Result<Footprint, Failure> {
        let page = atlas.size[0] * atlas.size[1];
        let held = self.held(world, [atlas.texels(), page, luxels], masks)?;
        let with_mesh = |held: &Footprint, error: f64| {
            let patches = self.first_patches(error);
            let solving =
                adaptive::bytes_to_solve(patches, self.reflections.bounces(), world.scene());
            held.with(
                "patches and their solutions",
                if patches > 0 { solving } else { 0 },
            )
        };
        let error = first_error(Some(goal));
        with_mesh(&held, error).require(context, || {
            let limit = context.common.max_memory;
            larger_error(error, |error| with_mesh(&held, error).fits(limit)).or_else(|| {
                // On a smaller page charts cover more of the texels: at most all.
                let fits = |quarter: usize| {
                    let texels = (4 * quarter).pow(2);
                    let held = self.held(world, [texels; 3], masks);
                    held.is_ok_and(|held| with_mesh(&held, error).fits(limit))
                };
                let quarter = largest(4, atlas.size[0] / 4 - 1, fits)?;
                (atlas.pages == 1).then(|| format!("--size {}", 4 * quarter))
            })
        })?;
        Ok(held)
    }

    /// What is held besides patches, with so many texels in all, texels of a page, and luxels.
    fn held(
        &self,
        world: &World<'_>,
        [texels, page, luxels]: [usize; 3],
        masks: usize,
    ) -> Result<Footprint, Failure> {
        let gathers = |include: &Include| match include {
            Include::Ao => false,
            Include::Sky | Include::Masks => true,
            Include::All | Include::Direct | Include::Indirect => !self.is_traced(),
        };
        let gathered = if self.include.iter().any(gathers) {
            adaptive::bytes_to_gather(luxels)
        } else {
            0
        };
        let sampled = if self.include.iter().all(gathers) {
            0
        } else {
            Film::bytes_to_refine(luxels)
        };
        let found = luxels * (size_of::<Luxel>() + size_of::<Receiver>() + size_of::<Gathered>());
        let maps = 2 * Lightmap::bytes_for(texels);
        let layers = self.include.len() - usize::from(masks > 0);
        let [directions, of_directions] = match self.directional {
            Directional::None => [0; 2],
            Directional::Sh1 | Directional::Dominant => [
                directional::bytes_to_gather(luxels),
                directional::bytes_for(texels),
            ],
        };
        let grid = self.volume.grid(world.scene())?;
        let volume = grid.map_or(0, |grid| self.volume.bytes(&grid));
        // While the last is gathered all others are there; masks and volumes come after maps.
        let comes_after = masks > 0 || volume > 0;
        let others = if comes_after { layers } else { layers - 1 };
        // What a gather has freed the allocator keeps, in part, when the next begins: so much was measured, whatever their number.
        let gathers = self
            .include
            .iter()
            .filter(|include| gathers(include))
            .count()
            + masks;
        let kept = if gathers > 1 {
            luxels * (size_of::<Tally>() + size_of::<Gathered>())
        } else {
            0
        };
        let pages = PAGES_AT_A_TIME * Picture::bytes_for(page, 1);
        let delivered = pages.max(bytes_to_preview(world.scene()));
        let last = gathered
            .max(sampled)
            .max(maps + directions + of_directions)
            .max(maps + delivered);
        Ok(Footprint::of(world)
            .with("luxels", found.max(luxels::bytes_to_find(texels)))
            .with("what is gathered at them, or maps and preview", last)
            .with("other maps", others * (maps + of_directions))
            .with("what is left of earlier gathers", kept)
            .with("the irradiance volume", volume)
            .with("masks", Mask::bytes_for(texels, masks)))
    }
}
