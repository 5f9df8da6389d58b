//! Which options of a bake go together.

use super::{Bake, Directional, Include};
use crate::cli::exit::{ExitCode, Failure};
use crate::cli::reflections::Reflected;
use luxel_solver::direct::NamedLight;
use luxel_solver::gather::Components;
use luxel_solver::world::World;

impl Bake {
    /// Whether any map is one of light that directions and volumes can be of.
    fn bakes_light(&self) -> bool {
        let mut include = self.include.iter();
        include.any(|include| include.components().is_some())
    }

    /// Refuses options that would have no effect.
    pub(super) fn check_options(&self) -> Result<(), Failure> {
        let mut kinds = self.include.clone();
        kinds.sort();
        kinds.dedup();
        let of_sources = self
            .include
            .iter()
            .filter_map(|include| include.components());
        let components: Vec<Components> = of_sources.collect();
        let problem = if kinds.len() < self.include.len() {
            "--include names the same twice"
        } else if kinds == [Include::Masks] {
            "masks are delivered beside a lightmap: --include direct,masks for example"
        } else if self.integrator.is_some() && components.is_empty() {
            "--integrator belongs to --include all, direct or indirect"
        } else if !self.bakes_light() && self.directional != Directional::None {
            "--directional belongs to --include all, direct or indirect"
        } else if !self.bakes_light() && self.volume.resolution().is_some() {
            "volumes hold the light of the first of the maps all, direct and indirect: --include names none of them"
        } else if let Some(problem) = self.volume.problem() {
            problem
        } else {
            self.reach
                .require(self.include.contains(&Include::Ao), "--include ao")?;
            return self
                .reflections
                .require(if components.contains(&Components::Indirect) {
                    Reflected::Alone
                } else if components.contains(&Components::All) {
                    Reflected::Some
                } else {
                    Reflected::None("--include all or indirect")
                });
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }

    /// Refuses maps that would hold nothing of the scene.
    pub(super) fn check_lights(
        &self,
        world: &World<'_>,
        masked: &[NamedLight],
    ) -> Result<(), Failure> {
        let includes = |what| self.include.contains(&what);
        let problem = if includes(Include::Sky) && !world.lights().has_sky() {
            "the scene has no sky and no environment: leave sky out of --include, or add one to the scene file ([[light]] \
             with kind = \"sky\")"
        } else if includes(Include::Masks) && masked.is_empty() {
            "no light has a place or a direction of which a mask could be made (a sky has none): leave masks out of --include"
        } else {
            return Ok(());
        };
        let problem = format!("{}: {problem}", world.scene().name);
        Err(Failure::new(ExitCode::NothingToDo, problem))
    }
}
