//! Where the faces of a scene get their places in the pages.

use super::Bake;
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::lightmap::atlas::Atlas;
use crate::lightmap::given::given;
use crate::lightmap::unwrap::{Density, UnwrapConfig, Unwrapper, UvUnwrap};
use crate::progress::Progress;
use clap::ValueEnum;
use luxel_scenes::Scene;
use luxel_solver::world::World;
use serde::Serialize;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Texels a metre that are aimed at where nothing else is said, and the sides of the pages that this may lead to.
const USUAL_DENSITY: f64 = 16.0;
const USUAL_SIDES: [usize; 2] = [256, 1024];

/// Share of a page that charts cover, roughly.
const USUAL_UTILISATION: f64 = 0.7;

/// Side of a page where a density is asked for.
const SIDE_OF_PAGES: usize = 2048;

/// Where texture coordinates come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Whence {
    /// The scene's own second set where it has one that can be used, else as `unwrap`
    Auto,
    /// The scene's own second set; an error where it cannot be used
    Keep,
    /// Surfaces are cut, flattened and packed anew
    Unwrap,
}

/// Whose charts an atlas has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Charts {
    /// The scene's.
    Given,
    /// Those of luxel, which may be cut.
    Own,
}

impl Bake {
    /// The atlas of a scene, and whether its charts may still be cut. Edges for which `cuts` is true separate charts.
    pub(super) fn places(
        &self,
        world: &World<'_>,
        cuts: &[bool],
        context: &Context<'_>,
    ) -> Result<(Atlas, Charts), Failure> {
        let scene = world.scene();
        let side = self.size.unwrap_or_else(|| self.usual_side(scene));
        let config = UnwrapConfig {
            density: match self.texels_per_metre {
                Some(texels_per_metre) => Density::Fixed {
                    texels_per_metre,
                    page: side,
                },
                None => Density::Page(side),
            },
            padding: usize::from(self.padding),
            block_align: self.block_align,
        };
        let has_given = !scene.corners.uv1.is_empty() && cuts.is_empty();
        if self.uv == Whence::Keep || self.uv == Whence::Auto && has_given {
            let geometry = world.surfaces().geometry();
            match given(scene, geometry, side) {
                Ok(atlas) => return Ok((atlas, Charts::Given)),
                Err(error) if self.uv == Whence::Keep => return Err(error.into()),
                Err(error) => context
                    .reporter
                    .note(format_args!("surfaces are unwrapped anew: {error}")),
            }
        }
        let reporter = &context.reporter;
        reporter.start("unwrapping", 0);
        let done_before = AtomicUsize::new(0);
        let atlas = UvUnwrap.unwrap(scene, cuts, &config, &|done, _| {
            let before = done_before.swap(done, Ordering::Relaxed);
            reporter.advance(done.saturating_sub(before) as u64);
            !context.interrupt.is_set()
        });
        reporter.finish();
        match atlas {
            Err(_) if context.interrupt.is_set() => Err(Failure::interrupted()),
            Err(error) => Err(error.into()),
            Ok(atlas) => Ok((atlas, Charts::Own)),
        }
    }

    /// The side of a page that suits a scene.
    fn usual_side(&self, scene: &Scene) -> usize {
        if self.texels_per_metre.is_some() {
            return SIDE_OF_PAGES;
        }
        let area: f64 = scene.face_ids().map(|face| scene.area(face)).sum();
        let texels = area * USUAL_DENSITY * USUAL_DENSITY / USUAL_UTILISATION;
        let [least, most] = USUAL_SIDES;
        (texels.sqrt().min(most as f64) as usize)
            .next_power_of_two()
            .clamp(least, most)
    }
}

/// Side of a page: a multiple of 4, which block compression wants.
pub(super) fn parse_side(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(side) if (16..=16384).contains(&side) && side % 4 == 0 => Ok(side),
        _ => Err("a multiple of 4 from 16 to 16384 is needed, such as 1024".into()),
    }
}

/// Texels a metre.
pub(super) fn parse_density(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(density) if density.is_finite() && density > 0.0 => Ok(density),
        _ => Err("texels a metre above 0 are needed, such as 16".into()),
    }
}

/// A share from 0 to 1.
pub(super) fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("a share from 0 to 1 is needed, such as 0.5".into()),
    }
}
