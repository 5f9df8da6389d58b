//! What goes on from a checkpoint ends as what was never interrupted.

use super::*;
use crate::world::World;
use luxel_scenes::{Scene, generate};

/// Satisfied with an error; writes down every checkpoint.
struct Keeper {
    error: f64,
    kept: Vec<Vec<u8>>,
}

impl Control for Keeper {
    fn begin(&mut self, _what: Stage, _cost: f64, _parts: usize) -> f64 {
        1.0
    }

    fn advance(&mut self) -> bool {
        true
    }

    fn suits(&mut self, parts: &ErrorParts) -> bool {
        parts.upper() <= self.error
    }

    fn keep(&mut self, checkpoint: Checkpoint<'_>) {
        self.kept
            .push(postcard::to_stdvec(&checkpoint).expect("plain data"));
    }
}

/// Resumes at about `tries` of the checkpoints of a run and compares the results bit by bit.
fn check(scene: &Scene, side: usize, components: Components, error: f64, tries: usize) {
    let world = World::new(scene);
    let receivers = tests::on_the_floor(&world, side);
    let config = AdaptiveConfig {
        error,
        components,
        bounces: Bounces::All,
        most_patches: usize::MAX,
        seed: 3,
    };
    let mut keeper = Keeper {
        error,
        kept: Vec::new(),
    };
    let whole = irradiance(&world, &receivers, &config, &mut keeper).expect("a scene");
    assert!(!whole.tallies.is_empty());
    let stride = keeper.kept.len().div_ceil(tries);
    let last = keeper.kept.last().cloned();
    for bytes in keeper.kept.iter().step_by(stride).chain(&last) {
        let checkpoint: Checkpoint<'_> = postcard::from_bytes(bytes).expect("as written");
        assert!(checkpoint.is_of(receivers.len()) && !checkpoint.is_of(receivers.len() + 1));
        let mut control = Keeper {
            error,
            kept: Vec::new(),
        };
        let resumed = resume(&world, &receivers, &config, checkpoint, &mut control);
        let resumed = resumed.expect("a scene");
        assert!(resumed.tallies == whole.tallies);
        assert_eq!(resumed.budget, whole.budget);
        assert_eq!(resumed.ending, whole.ending);
        assert_eq!(resumed.parts, whole.parts);
    }
}

#[test]
fn few_receivers_go_on_to_the_same_bits() {
    check(&generate::cornell_box(), 7, Components::All, 0.004, 8);
    check(&generate::cornell_box(), 7, Components::Direct, 0.002, 8);
}

#[test]
fn joined_receivers_go_on_to_the_same_bits() {
    check(&generate::cornell_box(), 66, Components::All, 0.02, 5);
}

/// A mesh that a later round refines is the one that is solved again.
#[test]
fn a_finer_mesh_is_made_anew() {
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    let receivers = tests::on_the_floor(&world, 8);
    let config = AdaptiveConfig {
        error: 0.05,
        components: Components::All,
        bounces: Bounces::All,
        most_patches: usize::MAX,
        seed: 3,
    };
    // Planned for a large error, judged by a small one: the first mesh is too coarse for it.
    let error = 0.004;
    let mut keeper = Keeper {
        error,
        kept: Vec::new(),
    };
    let whole = irradiance(&world, &receivers, &config, &mut keeper).expect("a scene");
    let read = |bytes: &Vec<u8>| -> Checkpoint<'static> {
        postcard::from_bytes(bytes).expect("as written")
    };
    let first = read(&keeper.kept[0]);
    let last = read(keeper.kept.last().expect("some"));
    assert!(first.spent.patches < last.spent.patches, "{:?}", last.spent);
    let mut control = Keeper {
        error,
        kept: Vec::new(),
    };
    for checkpoint in [first, last] {
        let resumed = resume(&world, &receivers, &config, checkpoint, &mut control);
        assert!(resumed.expect("a scene").tallies == whole.tallies);
    }
}

#[test]
fn a_checkpoint_of_other_receivers_is_told() {
    let checkpoint = |done, receivers: Vec<u32>| Checkpoint {
        round: checkpoint::Round::default(),
        spent: Budget::default(),
        steps: vec![checkpoint::Step {
            rays: checkpoint::Rays::Gather(4),
            receivers,
        }]
        .into(),
        done,
        tallies: vec![Tally::default(); 2].into(),
    };
    assert!(checkpoint(2, vec![0, 1]).is_of(2));
    assert!(!checkpoint(2, vec![0, 1]).is_of(3));
    assert!(!checkpoint(0, vec![0, 2]).is_of(2));
    assert!(!checkpoint(3, vec![0, 1]).is_of(2));
}
