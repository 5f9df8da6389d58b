//! Who draws: stages keep the samples of one part of the program independent of every other's.

/// A part of the program that draws samples. Two stages never share a sequence, whatever their
/// items and samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stage(pub u32);

impl Stage {
    /// Origins and directions of the rays of a form-factor row.
    pub const ROWS: Self = Self(1);
    /// Points on lights, from receivers.
    pub const DIRECT: Self = Self(2);
    /// Directions of the final gather.
    pub const GATHER: Self = Self(3);
    /// Paths of the path tracer.
    pub const PATH: Self = Self(4);
    /// Directions of ambient occlusion.
    pub const AO: Self = Self(5);
    /// Positions on the film.
    pub const CAMERA: Self = Self(6);
    /// Points and directions of form factors between objects.
    pub const FORM_FACTORS: Self = Self(7);
    /// Points in luxels.
    pub const LIGHTMAP: Self = Self(8);
    /// Points on lights, from patches.
    pub const PATCH_DIRECT: Self = Self(9);
    /// Continuation of gather rays whose hit is too near to be looked up.
    pub const NEAR_CHAIN: Self = Self(10);
    /// Points on lights, from the links of near chains.
    pub const NEAR_DIRECT: Self = Self(14);
    /// Choices by chance: Russian roulette, Fresnel.
    pub const CHOICE: Self = Self(11);
    /// Jitter of bounding boxes while a BVH is built.
    pub const BVH: Self = Self(12);
    /// Points in patches.
    pub const PATCHES: Self = Self(13);
    /// Points, eyes and lights that look for backs of faces.
    pub const AUDIT: Self = Self(15);
    /// Directions to the sky.
    pub const SKY: Self = Self(16);
    /// Signs that test operators for reciprocity.
    pub const RECIPROCITY: Self = Self(17);
    /// Points on surfaces at which methods are compared.
    pub const COMPARISON: Self = Self(20);
    /// Points on lights, from the patches that may be divided.
    pub const SUBDIVISION: Self = Self(22);
    /// Directions and lights from points whose incident radiance is projected.
    pub const INCIDENT: Self = Self(31);
    /// Rays that tell whether a probe lies inside a solid.
    pub const PROBES: Self = Self(32);
}
