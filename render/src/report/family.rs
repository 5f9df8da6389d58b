//! The methods that are compared, by family.

use serde::Serialize;

/// Methods that differ in their size only. The first four solve classical radiosity on a mesh of patches
/// and differ in how form factors are estimated and stored; each is run with every solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Analytic form factors, dense matrix.
    Analytic,
    /// Hemicubes, dense matrix.
    Hemicube,
    /// Ray-cast form factors, dense matrix.
    RayCast,
    /// Ray-cast rows of hit ids.
    RayCastRows,
    /// luxel's coarse solution itself: four classes of distance a patch, direct light apart.
    Radiosity,
    /// Direct light exact, indirect light gathered from the coarse solution.
    Gather,
    /// Unbiased path tracing.
    Path,
}

impl Family {
    /// All families.
    pub const ALL: [Self; 7] = [
        Self::Analytic,
        Self::Hemicube,
        Self::RayCast,
        Self::RayCastRows,
        Self::Radiosity,
        Self::Gather,
        Self::Path,
    ];

    /// Those of classical radiosity.
    pub const CLASSICAL: [Self; 4] = [
        Self::Analytic,
        Self::Hemicube,
        Self::RayCast,
        Self::RayCastRows,
    ];

    /// Its name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Analytic => "analytic",
            Self::Hemicube => "hemicube",
            Self::RayCast => "raycast",
            Self::RayCastRows => "raycast-rows",
            Self::Radiosity => "radiosity",
            Self::Gather => "gather",
            Self::Path => "path",
        }
    }

    /// Its name in legends.
    pub fn title(self) -> &'static str {
        match self {
            Self::Analytic => "analytic × dense",
            Self::Hemicube => "hemicube × dense",
            Self::RayCast => "ray-cast × dense",
            Self::RayCastRows => "ray-cast × sparse rows",
            Self::Radiosity => "luxel’s coarse solution",
            Self::Gather => "final gather",
            Self::Path => "path tracer",
        }
    }

    /// What it does, in a sentence.
    pub fn description(self) -> &'static str {
        match self {
            Self::Analytic => {
                "Form factors by Lambert’s formula, exact where nothing occludes; every pair stored."
            }
            Self::Hemicube => {
                "Form factors by hemicubes of 64 pixels along an edge, 16 or more on a patch; every pair \
                 stored."
            }
            Self::RayCast => {
                "Form factors as fractions of the rays of each patch, 256 or as many as there are patches, in \
                 four independent solutions; every pair stored."
            }
            Self::RayCastRows => {
                "The patches that the rays of each patch meet, 64 or a quarter as many as there are patches, in \
                 four independent solutions; hits stored, not pairs."
            }
            Self::Radiosity => {
                "Rows of 64 rays with four classes of distance a patch, direct light computed apart, \
                 in four independent solutions."
            }
            Self::Gather => {
                "Direct light exact up to its visibility, indirect light by rays into the coarse \
                 solution, in four independent randomisations."
            }
            Self::Path => {
                "Unbiased paths with connections to the lights, in four independent replicates."
            }
        }
    }

    /// Factor by which a size takes longer than the one before it, cautiously.
    pub(super) fn growth(self) -> f64 {
        match self {
            // Twice the patches: four times the pairs, and more than half of them get occluders.
            Self::Analytic => 4.5,
            Self::Hemicube | Self::Radiosity => 2.2,
            // Rays grow along with patches.
            Self::RayCast | Self::RayCastRows | Self::Gather | Self::Path => 4.0,
        }
    }

    /// Its share of the time.
    pub(super) fn weight(self) -> f64 {
        match self {
            Self::Analytic | Self::Hemicube | Self::Gather | Self::Path => 1.0,
            Self::RayCast | Self::RayCastRows | Self::Radiosity => 0.8,
        }
    }

    /// Patches of the mesh of a size, when there is one.
    pub(super) fn patches(self, step: u32) -> Option<usize> {
        match self {
            Self::Path => None,
            Self::Gather => Some(750 << step),
            Self::Analytic | Self::Hemicube | Self::RayCast | Self::RayCastRows => Some(64 << step),
            Self::Radiosity => Some(250 << step),
        }
    }

    /// Most sizes that are tried: 64·2¹⁰ patches, 4⁹ paths a receiver.
    pub(super) fn max_steps(self) -> u32 {
        match self {
            Self::Gather => 6,
            Self::Path => 8,
            Self::Radiosity => 9,
            Self::Analytic | Self::Hemicube | Self::RayCast | Self::RayCastRows => 11,
        }
    }
}
