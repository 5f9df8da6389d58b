//! The loop, on a scene with a known answer and under a control that stops it anywhere.

use super::*;
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
