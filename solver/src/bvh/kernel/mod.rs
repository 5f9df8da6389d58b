//! The ray kernel for x86-64 with AVX2, chosen when the program runs.
//!
//! This module is the only one of the workspace with `unsafe` code, for three reasons: functions
//! that need instructions the processor was found to have, memory without a check of bounds, and
//! prefetches. All memory goes through [`memory`]. What the kernel must answer is what the portable
//! traversal answers, bit by bit: `super::tests` compares them.
//!
//! [`few`] is for scenes of few triangles, [`wave`] for all others.
//!
//! **What would come next, and where it fits.** *Faces with alpha* and *curved primitives* are leaf kinds
//! of their own: one more bit of a child reference, and one more queue in the wave beside those of nodes
//! and triangle blocks, so that triangles pay nothing. A hit of an alpha-tested face is a candidate, not
//! a hit: its ray leaves the wave for a list of deferred candidates, whose textures are looked up in
//! batches, and comes back with the hit as its nearest, or with the stack that it left when it is
//! transparent. Curved primitives are intersected in such batches, too, by steps of Newton's method that
//! the lanes take together.
//!
//! *NEON* has four lanes and the same operations. A node step becomes two halves: loads, `vsubq`,
//! `vmulq`, `vmaxq` and `vminq` (by `vcgtq` and `vbslq`, because their NaN and zero rules differ), a mask
//! by `vaddvq` of lane bits, order and compaction by `vqtbl2q` on bytes instead of `vpermd`, and the same
//! sorting network by `vrev64q`, `vextq`, `vminq` and `vmaxq`. The block step has four lanes already; its
//! f64 part becomes two pairs; [`few`] takes four rays at once. Memory, queues and stacks stay as they are.
//!
//! Miri knows the instructions. With tree borrows, which rayon needs, and small scenes:
//! `RUSTFLAGS="-C target-feature=+avx2,+bmi1,+bmi2,+lzcnt,+popcnt" RAYON_NUM_THREADS=1
//! MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-tree-borrows -Zmiri-ignore-leaks"
//! cargo +nightly miri test -p luxel-solver --lib bvh::tests::twins::rays_that`.

#![allow(
    unsafe_code,
    reason = "vector instructions chosen at run time, and memory without checks of bounds in the \
              inner loop of everything"
)]
#![allow(
    clippy::wildcard_imports,
    reason = "the names of intrinsics say where they come from"
)]

mod block;
mod few;
mod groups;
mod memory;
mod order;
mod setup;
mod wave;

use super::collapse::Wide;
use super::ray::{Hit, Ray};
use std::sync::LazyLock;
use wave::Answers;

static SUPPORTED: LazyLock<bool> = LazyLock::new(|| {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
});

/// The closest hits of a batch; false when the processor lacks the instructions.
pub(super) fn closest(wide: &Wide, rays: &[Ray], hits: &mut [Hit]) -> bool {
    let mut answers = Answers {
        hits,
        blocked: &mut [],
    };
    if *SUPPORTED {
        // SAFETY: the processor has the features.
        unsafe {
            if wide.is_few() {
                few::trace::<false>(wide, rays, &mut answers);
            } else {
                wave::trace::<false>(wide, rays, &mut answers);
            }
        }
    }
    *SUPPORTED
}

/// Whether each ray is blocked; false when the processor lacks the instructions.
pub(super) fn any(wide: &Wide, rays: &[Ray], blocked: &mut [bool]) -> bool {
    let mut answers = Answers {
        hits: &mut [],
        blocked,
    };
    if *SUPPORTED {
        // SAFETY: the processor has the features.
        unsafe {
            if wide.is_few() {
                few::trace::<true>(wide, rays, &mut answers);
            } else {
                wave::trace::<true>(wide, rays, &mut answers);
            }
        }
    }
    *SUPPORTED
}
