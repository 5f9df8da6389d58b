//! What a verb will hold at its peak, told before it begins and kept to while it runs.
//!
//! Sizes stand with the structures that have them; here they are added up and held against the limit. Nothing is
//! measured, so that what a limit decides is the same on every machine and at any number of threads.

use super::Context;
use super::exit::{ExitCode, Failure};
use super::memory::{Bytes, MemoryLimit, as_option};
use luxel_scenes::Scene;
use luxel_solver::adaptive;
use luxel_solver::bounces::Bounces;
use luxel_solver::patches::MAX_PATCHES;
use luxel_solver::world::World;

/// What the process holds besides: code, stacks, the batches of rays that threads work on, and what the allocator keeps
/// of what was freed. Measured at 9 to 12 MiB with two threads, in scenes of little else; a further thread adds about half
/// a MiB, which is not counted, so that what fits does not depend on their number.
pub(super) const PROCESS: usize = 16 << 20;

/// Memory by what needs it.
#[derive(Clone, Debug)]
pub(super) struct Footprint(Vec<(&'static str, usize)>);

impl Footprint {
    /// The process, and the scene while it is prepared.
    pub(super) fn to_prepare(scene: &Scene) -> Self {
        Self(vec![
            ("the command itself", PROCESS),
            ("scene and ray tree", World::bytes_to_build(scene)),
        ])
    }

    /// The process, and a scene with its ray tree. Of what that was built from the allocator keeps some: a quarter is
    /// more than was measured.
    pub(super) fn of(world: &World<'_>) -> Self {
        Self(vec![
            ("the command itself", PROCESS),
            (
                "scene and ray tree",
                world.bytes() + World::bytes_to_build(world.scene()) / 4,
            ),
        ])
    }

    /// Besides, `bytes` for `what`.
    #[must_use]
    pub(super) fn with(&self, what: &'static str, bytes: usize) -> Self {
        let mut parts = self.0.clone();
        parts.push((what, bytes));
        Self(parts)
    }

    /// All together, in bytes.
    pub(super) fn total(&self) -> usize {
        let parts = self.0.iter().map(|(_, bytes)| *bytes);
        parts.fold(0, usize::saturating_add)
    }

    /// Whether so much may be held.
    pub(super) fn fits(&self, limit: Option<MemoryLimit>) -> bool {
        limit.is_none_or(|limit| self.total() <= limit.0.get())
    }

    /// Patches of the finest mesh that a result with this footprint may be refined to after one of `first` patches, at
    /// least as many.
    pub(super) fn most_patches(
        &self,
        scene: &Scene,
        first: usize,
        bounces: Bounces,
        context: &Context<'_>,
    ) -> usize {
        let Some(limit) = context.common.max_memory else {
            return usize::MAX;
        };
        let fits = |patches| {
            self.with(
                "patches",
                adaptive::bytes_to_refine(patches, bounces, scene),
            )
            .fits(Some(limit))
        };
        largest(first, MAX_PATCHES, fits).unwrap_or(first)
    }

    /// Refuses work that would hold more than the limit. `remedy` tells what would fit, if anything less does.
    pub(super) fn require(
        &self,
        context: &Context<'_>,
        remedy: impl FnOnce() -> Option<String>,
    ) -> Result<(), Failure> {
        let total = self.total();
        context.reporter.detail(format_args!(
            "memory: at most {} are expected ({})",
            Bytes(total),
            self.in_words()
        ));
        let limit = match context.common.max_memory {
            Some(limit) if total > limit.0.get() => limit,
            _ => return Ok(()),
        };
        let raised = format!("--max-memory {}", as_option(total));
        let remedy = remedy().map_or(raised.clone(), |fits| format!("{fits} fits, or {raised}"));
        Err(Failure::new(
            ExitCode::MemoryLimit,
            format!(
                "this needs about {} of memory ({}), more than the {} of --max-memory; {remedy}",
                Bytes(total),
                self.in_words(),
                Bytes(limit.0.get()),
            ),
        ))
    }

    /// The parts, the largest first.
    fn in_words(&self) -> String {
        let mut parts = self.0.clone();
        parts.sort_by_key(|&(_, bytes)| std::cmp::Reverse(bytes));
        let parts = parts.iter();
        let words: Vec<_> = parts
            .map(|(what, bytes)| format!("{what} {}", Bytes(*bytes)))
            .collect();
        words.join(", ")
    }
}

/// The largest number of `lowest` to `highest` that `fits`, of which all smaller ones do; `None` without any.
pub(super) fn largest(
    lowest: usize,
    highest: usize,
    fits: impl Fn(usize) -> bool,
) -> Option<usize> {
    if lowest > highest || !fits(lowest) {
        return None;
    }
    let (mut low, mut high) = (lowest, highest);
    while low < high {
        let middle = low + (high - low).div_ceil(2);
        if fits(middle) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    Some(low)
}

/// The smallest error above `error`, in tenths of a percent, that `fits`, as an option.
pub(super) fn larger_error(error: f64, fits: impl Fn(f64) -> bool) -> Option<String> {
    const TENTHS: usize = 999;
    let of = |smaller: usize| (TENTHS - smaller) as f64 / 1000.0;
    let above = TENTHS.checked_sub((1000.0 * error).ceil() as usize)?;
    let found = largest(0, above, |smaller| fits(of(smaller)))?;
    Some(format!("--error {}%", (TENTHS - found) as f64 / 10.0))
}

/// What is said where an error was not reached for want of memory.
pub(super) fn held_back(context: &Context<'_>) {
    if let Some(limit) = context.common.max_memory {
        context.reporter.warning(format_args!(
            "more patches or rays would need more memory than the {} of --max-memory: the error is as small as it gets \
             within them",
            Bytes(limit.0.get())
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_number_that_fits_is_found() {
        for limit in 0..20 {
            let expected = (limit >= 3).then_some(limit.min(17));
            assert_eq!(largest(3, 17, |n| n <= limit), expected, "{limit}");
        }
        assert_eq!(largest(1, usize::MAX, |n| n < 1 << 40), Some((1 << 40) - 1));
        assert_eq!(largest(5, 4, |_| true), None);
    }

    #[test]
    fn sums_do_not_overflow() {
        let scene = Scene::default();
        let footprint = Footprint::to_prepare(&scene).with("everything", usize::MAX);
        assert_eq!(footprint.total(), usize::MAX);
        let limit = super::super::memory::parse_memory("8G").ok();
        assert!(!footprint.fits(limit) && footprint.fits(None));
    }
}
