//! Options of ambient occlusion, the same wherever it is computed.

use super::exit::{ExitCode, Failure};
use crate::integrators::ao::{Config, Falloff};

/// How far occlusion reaches.
#[derive(clap::Args, Clone, Copy, Debug, serde::Serialize)]
pub(super) struct Reach {
    /// Of ambient occlusion: metres beyond which nothing occludes
    #[arg(long, value_name = "D", value_parser = super::parse_length)]
    max_distance: Option<f64>,

    /// With --max-distance: how nearer blockers count
    #[arg(
        long,
        value_name = "HOW",
        requires = "max_distance",
        default_value = "sharp"
    )]
    falloff: Falloff,
}

impl Reach {
    /// Whether occlusion has an end.
    pub(super) fn is_limited(&self) -> bool {
        self.max_distance.is_some()
    }

    /// Refuses a limit where there is no occlusion, which `option` would ask for.
    pub(super) fn require(&self, occlusion: bool, option: &str) -> Result<(), Failure> {
        if self.is_limited() && !occlusion {
            let problem = format!("--max-distance belongs to {option}");
            return Err(Failure::new(ExitCode::Usage, problem));
        }
        Ok(())
    }

    /// Occlusion by so many rays of each sample.
    pub(super) fn config(&self, rays: u32, seed: u64) -> Config {
        Config {
            rays,
            max_distance: self.max_distance,
            falloff: self.falloff,
            seed,
        }
    }
}
