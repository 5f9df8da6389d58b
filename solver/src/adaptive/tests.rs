//! The loop, on a scene with a known answer and under a control that stops it anywhere.

use super::*;
use crate::gather::{
    GatherConfig, Gathered, Key, MAX_REPLICATES, SkyRays, Solutions, finish, gather,
};
use luxel_scenes::generate;

/// Allows everything until `left` calls were made; is satisfied with an error.
struct Counted {
    left: usize,
    error: f64,
    rounds: usize,
}

impl Counted {
    fn tick(&mut self) -> bool {
        let goes_on = self.left > 0;
        self.left = self.left.saturating_sub(1);
        goes_on
    }
}

impl Control for Counted {
    fn begin(&mut self, _what: Stage, _cost: f64, _parts: usize) -> f64 {
        f64::from(u8::from(self.tick()))
    }

    fn advance(&mut self) -> bool {
        self.tick()
    }

    fn suits(&mut self, parts: &ErrorParts) -> bool {
        self.rounds += 1;
        parts.total() <= self.error
    }
}

fn run(error: f64, left: usize) -> (Adaptive, usize) {
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    let positions: Vec<_> = (1..40)
        .map(|i| glam::DVec3::new(0.013 * f64::from(i), 0.0, 0.2))
        .collect();
    let normals = vec![glam::DVec3::Y; positions.len()];
    let receivers = world.receivers(&positions, &normals);
    let config = AdaptiveConfig {
        error,
        components: Components::All,
        bounces: Bounces::All,
        most_patches: usize::MAX,
        seed: 1,
    };
    let mut control = Counted {
        left,
        error,
        rounds: 0,
    };
    let result = irradiance(&world, &receivers, &config, &mut control).expect("a valid scene");
    (result, control.rounds)
}

#[test]
fn it_goes_on_until_the_error_suits() {
    let (rough, _) = run(0.1, usize::MAX);
    let (fine, _) = run(0.003, usize::MAX);
    assert_eq!(
        (rough.ending, fine.ending),
        (Ending::Reached, Ending::Reached)
    );
    assert!(fine.parts.total() <= 0.003 && fine.parts.total() < rough.parts.total());
    assert!(fine.budget.rays > rough.budget.rays);
}

/// Reflected light alone needs no shadow rays: that none are cast does not end the work.
#[test]
fn reflected_light_alone_reaches_its_error() {
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    for side in [7, 65] {
        let receivers = on_the_floor(&world, side);
        let config = AdaptiveConfig {
            error: 0.008,
            components: Components::Indirect,
            bounces: Bounces::All,
            most_patches: usize::MAX,
            seed: 1,
        };
        let result = irradiance(&world, &receivers, &config, &mut unlimited(0.008));
        let result = result.expect("a scene");
        assert_eq!(result.ending, Ending::Reached, "{:?}", result.parts);
        assert_eq!(result.budget.shadow_rays, 0);
    }
}

#[test]
fn it_may_be_stopped_anywhere_and_keeps_the_last_complete_state() {
    let (complete, rounds) = run(0.02, usize::MAX);
    assert!(rounds > 0);
    // The pilot, the first solution, its gather, and into later rounds.
    for left in [0, 1, 2, 5, 6, 7, 8, 11, 12, 13, 14, 15] {
        let (stopped, rounds) = run(0.02, left);
        assert!(stopped.tallies.is_empty() == (rounds == 0), "after {left}");
        if stopped.ending == Ending::Reached {
            assert_eq!(stopped.tallies, complete.tallies);
        }
    }
}

/// Receivers on a grid on the floor of the Cornell box, some of them below the boxes' shadows, none below a box.
pub(super) fn on_the_floor(world: &World, side: usize) -> Vec<Receiver> {
    let at = |i: usize| (i as f64 + 0.5) / side as f64;
    let positions: Vec<_> = (0..side * side)
        .map(|i| glam::DVec3::new(0.02 + 0.51 * at(i % side), 0.0, 0.01 + 0.04 * at(i / side)))
        .collect();
    world.receivers(&positions, &vec![glam::DVec3::Y; side * side])
}

fn unlimited(error: f64) -> Counted {
    Counted {
        left: usize::MAX,
        error,
        rounds: 0,
    }
}

/// The root mean square, over some receivers, of differences over what they are stated to be.
fn over_stated(some: &[Gathered], exact: &[Gathered]) -> f64 {
    let squares = some.iter().zip(exact).map(|(a, b)| {
        let difference = (a.irradiance().0 - b.irradiance().0).element_sum();
        let stated = [a, b].map(|g| g.standard_error().0.element_sum().powi(2));
        difference * difference / (stated[0] + stated[1])
    });
    (squares.sum::<f64>() / some.len() as f64).sqrt()
}

#[test]
fn many_receivers_share_few_rays_and_are_right() {
    const SEEDS: u64 = 4;
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    let receivers = on_the_floor(&world, 70);
    let stride = 49;
    let some: Vec<Receiver> = receivers.iter().copied().step_by(stride).collect();
    let at_some = |error: f64, seed: u64, receivers: &[Receiver]| {
        let config = AdaptiveConfig {
            error,
            components: Components::All,
            bounces: Bounces::All,
            most_patches: usize::MAX,
            seed,
        };
        let found = irradiance(&world, receivers, &config, &mut unlimited(error));
        let found = found.expect("a scene");
        assert_eq!(found.ending, Ending::Reached);
        found
    };
    let exact = finish(&at_some(0.003, 99, &some).tallies);
    let mut square = 0.0;
    for seed in 0..SEEDS {
        let joined = at_some(0.02, seed, &receivers);
        // Alone, a receiver needs some 300 gather rays for 2 %.
        assert!(joined.budget.rays <= 100, "{:?}", joined.budget);
        let all = finish(&joined.tallies);
        let ours: Vec<Gathered> = all.into_iter().step_by(stride).collect();
        square += over_stated(&ours, &exact).powi(2) / SEEDS as f64;
    }
    // Errors of neighbours are alike: the hundred are worth about the twenty cells that they lie in, and four times
    // as many know the rms to a tenth; channels share their rays, so that their sum is stated on the safe side.
    assert!((0.6..1.25).contains(&square.sqrt()), "{}", square.sqrt());
}

#[test]
fn a_field_is_as_exact_as_it_says() {
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    let receivers = on_the_floor(&world, 64);
    let adapted = Adapted::new(&world, &[], Bounces::All, 1).expect("a scene");
    let lookup = adapted.solve(2000, &mut unlimited(0.0)).expect("a scene");
    let lookup = lookup.expect("nothing stops it");
    let weights = vec![luxel_scenes::Rgb::ONE; receivers.len()];
    let error = 0.004;
    let field = FieldGather::new(&world, &lookup, &receivers, 5)
        .until(error, &weights, &mut unlimited(0.0))
        .expect("nothing stops it");
    assert!(field.gather_noise(&receivers, &weights) <= 1.1 * error);

    let some: Vec<Receiver> = receivers.iter().copied().step_by(41).collect();
    let keys: Vec<Key> = (0..some.len() as u64).map(Key::of).collect();
    let config = GatherConfig {
        rays: 8192,
        rays_before: 0,
        shadow_rays: 0,
        sky: SkyRays::Gather,
        gathers: MAX_REPLICATES,
        solutions: Solutions::All,
        components: Components::All,
        seed: 9,
    };
    let exact = gather(&world, Some(&lookup), &some, &keys, &config);
    let mut squares = 0.0;
    for (receiver, tally) in some.iter().zip(&exact) {
        let replicate = |r| field.at(receiver.position, receiver.normal, r);
        let light = (0..MAX_REPLICATES).map(|r| replicate(r).expect("known")[0].0);
        let mean = light.sum::<luxel_scenes::Rgb>() / MAX_REPLICATES as f64;
        squares += (mean - tally.irradiance().0).length_squared() / 3.0;
    }
    let made = (squares / some.len() as f64).sqrt();
    // About ten cells, which share their noise: known to a quarter; half of it more for 95 %.
    assert!(
        (0.4 * error..1.5 * error).contains(&made),
        "{made} of {error}"
    );
    // Between the receivers, too, but not apart from them.
    let between = receivers[0].position + glam::DVec3::new(1e-4, 0.0, 1e-4);
    assert!(field.at(between, receivers[0].normal, 0).is_some());
    assert!(field.at(between, -receivers[0].normal, 0).is_none());
}

/// Decisions follow from values alone.
#[test]
fn joined_receivers_are_the_same_at_any_number_of_threads() {
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    let receivers = on_the_floor(&world, 66);
    let config = AdaptiveConfig {
        error: 0.1,
        components: Components::All,
        bounces: Bounces::All,
        most_patches: usize::MAX,
        seed: 4,
    };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("a few threads");
        let run = || irradiance(&world, &receivers, &config, &mut unlimited(0.1));
        pool.install(run).expect("a scene").tallies
    };
    let (one, three) = (with(1), with(3));
    assert!(!one.is_empty() && one == three);
}

/// A mesh that may not be refined is told apart from what no budget reaches: the mesh alone leaves more than 0.05 %, and
/// no ray is cast in vain.
#[test]
fn a_mesh_that_may_not_grow_is_the_reason() {
    let scene = generate::cornell_box();
    let world = World::new(&scene);
    let receivers = on_the_floor(&world, 6);
    let config = AdaptiveConfig {
        error: 0.0005,
        components: Components::All,
        bounces: Bounces::All,
        most_patches: 400,
        seed: 1,
    };
    let result = irradiance(&world, &receivers, &config, &mut unlimited(0.0005)).expect("a scene");
    assert_eq!(result.ending, Ending::TooManyPatches);
    // The mesher stops within a tenth of the number asked for, where faces allow.
    assert!(result.budget.patches <= 400 && result.patches <= 480);
    assert_eq!(result.tallies.len(), receivers.len());
}
