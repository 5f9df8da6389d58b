//! The ray kernel for x86-64 with AVX2, chosen when the program runs.
//!
//! This module is the only one of the workspace with `unsafe` code, for three reasons: functions
//! that need instructions the processor was found to have, memory without a check of bounds, and
//! prefetches. All memory goes through [`memory`]. What the kernel must answer is what the portable
//! traversal answers, bit by bit: `super::tests` compares them.
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
        unsafe { wave::trace::<false>(wide, rays, &mut answers) };
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
        unsafe { wave::trace::<true>(wide, rays, &mut answers) };
    }
    *SUPPORTED
}
