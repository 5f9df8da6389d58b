//! The option that limits reflections, the same wherever light is computed.

use super::exit::{ExitCode, Failure};
use luxel_solver::bounces::Bounces;

/// Most bounces that can be asked for: at ρ = 0.999 what is left after them is 5·10⁻⁵ of all.
const MOST: i64 = 10_000;

/// How often light is reflected.
#[derive(clap::Args, Clone, Copy, Debug, serde::Serialize)]
pub(super) struct Reflections {
    /// Times that light may be reflected between surfaces, in pictures before it is reflected to the eye: 0 is direct light alone
    /// [default: as often as it is]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(0..=MOST))]
    bounces: Option<u32>,
}

/// What reflections are asked for along with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reflected {
    /// Light that holds some.
    Some,
    /// Reflected light and nothing else.
    Alone,
    /// Something that has none, and the option that would make it have some.
    None(&'static str),
}

impl Reflections {
    /// How often.
    pub(super) fn bounces(self) -> Bounces {
        self.bounces.map_or(Bounces::All, Bounces::AtMost)
    }

    /// Refuses bounces that would have no effect, and reflected light without any.
    pub(super) fn require(self, reflected: Reflected) -> Result<(), Failure> {
        let problem = match reflected {
            Reflected::None(option) if self.bounces.is_some() => {
                format!("--bounces belongs to {option}")
            }
            Reflected::Alone if !self.bounces().reflect() => {
                "--bounces 0 leaves no reflected light: ask for 1 or more, or for direct light"
                    .into()
            }
            _ => return Ok(()),
        };
        Err(Failure::new(ExitCode::Usage, problem))
    }
}
