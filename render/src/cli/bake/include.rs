//! What is baked.

use clap::ValueEnum;
use luxel_solver::gather::Components;

/// What a set of maps holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Include {
    /// All light
    All,
    /// Light straight from a source, the sky among them
    Direct,
    /// Light after at least one reflection
    Indirect,
    /// Light straight from the sky or an environment, a part of direct
    Sky,
    /// Ambient occlusion, 1 = open
    Ao,
    /// Of each light that has a place or a direction the share that reaches a texel, 1 = wholly seen: four lights a picture
    Masks,
}

impl Include {
    /// Which light of all sources; `None` for what is computed otherwise.
    pub(super) fn components(self) -> Option<Components> {
        match self {
            Self::All => Some(Components::All),
            Self::Direct => Some(Components::Direct),
            Self::Indirect => Some(Components::Indirect),
            Self::Sky | Self::Ao | Self::Masks => None,
        }
    }
}
