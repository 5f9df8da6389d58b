use super::*;
use luxel_solver::sampling::Stage;
use luxel_solver::sampling::hash::uniform;

/// A number that looks random.
fn scatter(pixel: usize, replicate: u32, index: u32) -> f64 {
    uniform(
        1,
        Stage::CAMERA,
        pixel as u64,
        u64::from(4 * index + replicate),
    )
}

#[test]
fn every_sample_is_taken_once_whatever_the_threads() {
    let further = |pixel: usize, round: usize| (pixel * 7919 + round) as u32 % 5;
    let expose = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads");
        let mut film = Film::new([37, 41], 2);
        pool.install(|| {
            for round in 0..3 {
                let plan: Vec<u32> = (0..37 * 41).map(|pixel| further(pixel, round)).collect();
                film.expose(&plan, |due, seen| {
                    for (due, seen) in due.iter().zip(seen) {
                        let SampleKey {
                            replicate,
                            index,
                            item,
                        } = due.key;
                        assert_eq!(item, 2 * due.pixel as u64 + u64::from(replicate));
                        *seen = Rgb::splat(scatter(due.pixel, replicate, index)).into();
                    }
                });
            }
        });
        film
    };
    let film = expose(1);
    assert_eq!(film, expose(3));
    for (pixel, (value, samples)) in film.values().zip(film.samples()).enumerate() {
        let each: u32 = (0..3).map(|round| further(pixel, round)).sum();
        assert_eq!(samples, 2 * each);
        let all = (0..each).flat_map(|index| [0, 1].map(|r| scatter(pixel, r, index)));
        let expected = all.sum::<f64>() / f64::from(samples);
        assert!((value.x - expected).abs() < 1e-12, "pixel {pixel}");
    }
}

/// Lets every sample of `film` see what `value` makes of pixel, replicate and index.
fn expose(film: &mut Film, further: &[u32], value: impl Fn(usize, u32, u32) -> f64 + Sync) {
    film.expose(further, |due, seen| {
        for (due, seen) in due.iter().zip(seen) {
            let SampleKey {
                replicate, index, ..
            } = due.key;
            *seen = Rgb::splat(value(due.pixel, replicate, index)).into();
        }
    });
}

#[test]
fn further_samples_weigh_as_much_as_the_first() {
    let mut film = Film::new([2, 1], 1);
    expose(&mut film, &[1, 1], |_, _, _| 4.0);
    expose(&mut film, &[3, 0], |_, _, _| 8.0);
    let values: Vec<f64> = film.values().map(|value| value.x).collect();
    assert_eq!(values, [7.0, 4.0]);
    let counts = SampleCounts {
        mean: 2.5,
        min: 1,
        max: 4,
    };
    assert_eq!(film.sample_counts(), counts);
    assert_eq!(film.errors(Alike::Neighbours), None);
}

/// Independent uniform noise of standard deviation σ = 1/√12 in each of four replicates: the
/// stated error is that of their mean, σ/2, and the mean over pixels of z² is one.
#[test]
fn noise_is_stated_as_it_is() {
    let mut film = Film::new([64, 64], 4);
    let once = film.evenly(1);
    expose(&mut film, &once, scatter);
    let errors = film.errors(Alike::Neighbours).expect("four replicates");
    let z_squares: f64 = film
        .values()
        .zip(&errors)
        .map(|(value, error)| ((value.x - 0.5) / error.sampling.x).powi(2))
        .sum();
    // Of 4096 values of z², whose standard deviation is about √2, the mean is known to 0.022. Four
    // samples cannot tell noise from edges: the range of nine values is 3σ of them, and what they
    // may have missed 0.07 · 3²/4² = 0.04 of their variance.
    let mean = z_squares / 4096.0;
    assert!((0.85..1.05).contains(&mean), "{mean}");
    assert!(errors.iter().all(|error| error.discretisation == Rgb::ZERO));
    let stated = film.relative_error(Alike::Neighbours).sampling;
    let exact = (1.0_f64 / 48.0).sqrt() / 0.5;
    assert!(
        (0.98..1.08).contains(&(stated / exact)),
        "{stated}, {exact}"
    );
}

/// The left half is ten times as noisy as the right one: it gets ten times as many samples, and the
/// error that all say together is the true one.
#[test]
fn samples_go_where_the_noise_is() {
    let value = |pixel: usize, replicate: u32, index: u32| {
        let noise = scatter(pixel, replicate, index) - 0.5;
        1.0 + if pixel % 64 < 32 { noise } else { 0.1 * noise }
    };
    let mut film = Film::new([64, 64], 4);
    let first = film.evenly(4);
    expose(&mut film, &first, value);
    for _ in 0..3 {
        let further = film.where_noisy(4.0);
        expose(&mut film, &further, value);
    }
    let samples: Vec<u32> = film.samples().collect();
    let half = |left: bool| {
        let own = samples.iter().enumerate();
        let own = own.filter(|(pixel, _)| (pixel % 64 < 32) == left);
        own.map(|(_, &n)| f64::from(n)).sum::<f64>() / 2048.0
    };
    // Both sides of the border are alike to their neighbours: two of 64 columns.
    let ratio = half(true) / half(false);
    assert!((7.0..13.0).contains(&ratio), "{ratio}");
    let squares = film.values().map(|value| (value.x - 1.0).powi(2));
    let error = (squares.sum::<f64>() / 4096.0).sqrt();
    let stated = film.relative_error(Alike::Neighbours).sampling;
    // 4096 squares know the error to 1/√(2 · 2048), 1.6 %: three of these and the doubt of edges.
    assert!((0.93..1.1).contains(&(stated / error)), "{stated}, {error}");
}
