//! The film: what every pixel sees, and how wrong it is.
//!
//! A pixel holds the means of a few independent replicates, each a low-discrepancy set with a
//! scramble of its own (and, where light is looked up in a mesh, with a solution of its own): the
//! scatter s² = Σ (x_r − x̄)² / (R (R − 1)) is the variance of their mean, which the samples of a set
//! among themselves would not tell. It is moderated by the neighbours' ([`moderate`]). Films take
//! further samples, of the same sequences, until the error suits. Cost: 144 bytes a pixel.
//!
//! [`Moments`] are Welford's recurrences for a single receiver: mean μ and m₂ = Σ (x − μ)². Source:
//! B. P. Welford, "Note on a method for calculating corrected sums of squares and products",
//! Technometrics 4(3), 1962.

use crate::image::Image;
use crate::integrators::Seen;
use glam::Vec3;
use luxel_scenes::Rgb;
use luxel_solver::error::{discretisation, moderate};
use luxel_solver::gather::MAX_REPLICATES;
use rayon::prelude::*;

/// Pixels that one task computes together: enough rays for a batch, few enough that a small
/// picture still feeds every thread.
const PIXELS_PER_TASK: usize = 512;

/// Receivers of a film of one row that one task computes together: they get many samples each.
const RECEIVERS_PER_TASK: usize = 16;

/// Running mean and variance of independent values, per channel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Moments {
    count: u32,
    mean: Rgb,
    squares: Rgb,
}

impl Moments {
    /// Takes in one more value.
    pub fn add(&mut self, value: Rgb) {
        self.count += 1;
        let delta = value - self.mean;
        self.mean += delta / f64::from(self.count);
        self.squares += delta * (value - self.mean);
    }

    /// How many values there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Their mean, in the unit of the values; zero without any.
    pub fn mean(&self) -> Rgb {
        self.mean
    }

    /// Their unbiased sample variance, in the unit of the values squared; `None` for fewer than
    /// two values.
    pub fn variance(&self) -> Option<Rgb> {
        (self.count > 1).then(|| self.squares / f64::from(self.count - 1))
    }

    /// The standard error of the mean, in the unit of the values; `None` for fewer than two.
    pub fn standard_error(&self) -> Option<Rgb> {
        let variance = self.variance()? / f64::from(self.count);
        Some(Rgb::new(
            variance.x.sqrt(),
            variance.y.sqrt(),
            variance.z.sqrt(),
        ))
    }
}

/// The replicates of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pixel {
    /// Mean of the samples of each replicate.
    means: [Rgb; MAX_REPLICATES],
    /// Mean differences from a coarser mesh. Single precision: they are estimates of an error.
    differences: [Vec3; MAX_REPLICATES],
}

/// Sums over new samples of a pixel, by replicate.
#[derive(Clone, Copy, Debug, Default)]
pub struct Exposure {
    sums: [Seen; MAX_REPLICATES],
}

impl Exposure {
    /// Takes in one more sample of a replicate.
    ///
    /// # Panics
    /// When `replicate` is not below [`MAX_REPLICATES`].
    pub fn add(&mut self, replicate: u32, seen: Seen) {
        self.sums[replicate as usize] += seen;
    }
}

/// Pixels in row-major order, row 0 at the top: or any other receivers, in one row.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: [usize; 2],
    replicates: u32,
    /// Samples of each replicate of every pixel.
    samples: u32,
    pixels: Vec<Pixel>,
}

/// Relative error of a film, rms over mean.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct FilmError {
    /// Noise.
    pub sampling: f64,
    /// What the size of patches leaves.
    pub discretisation: f64,
}

impl FilmError {
    /// Both together.
    pub fn total(self) -> f64 {
        self.sampling.hypot(self.discretisation)
    }
}

/// How the noise of a pixel can be guessed from other pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alike {
    /// Neighbours are about equally noisy.
    Neighbours,
    /// All are about equally noisy relative to their values.
    Values,
    /// The values are the fractions of this many rays that are unblocked: binomial, and uncertain even
    /// where all rays agree, (p n + 1)/(n + 2) of them (P.-S. Laplace's rule of succession, 1774).
    Fractions {
        /// Rays of a receiver.
        rays: u32,
    },
}

/// The error of a pixel, one standard deviation each, in the unit of the values.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PixelError {
    /// Noise.
    pub sampling: Rgb,
    /// What the size of patches leaves.
    pub discretisation: Rgb,
}

impl PixelError {
    /// Both together.
    pub fn total(&self) -> Rgb {
        (self.sampling * self.sampling + self.discretisation * self.discretisation).map(f64::sqrt)
    }
}

impl Film {
    /// An empty film of `size` (width, height) pixels.
    ///
    /// # Panics
    /// When there is not at least one replicate or more than [`MAX_REPLICATES`].
    pub fn new(size: [usize; 2], replicates: u32) -> Self {
        assert!(
            (1..=MAX_REPLICATES as u32).contains(&replicates),
            "one to {MAX_REPLICATES} replicates"
        );
        Self {
            size,
            replicates,
            samples: 0,
            pixels: vec![Pixel::default(); size[0] * size[1]],
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Independent replicates of each pixel.
    pub fn replicates(&self) -> u32 {
        self.replicates
    }

    /// Samples of each replicate of every pixel so far.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Lets `expose` add `samples` samples to every replicate of all pixels, in parallel,
    /// some consecutive pixels a call: it gets the index of the first one and their
    /// exposures. Every pixel belongs to one call, so that the result does not depend on the number
    /// of threads when `expose` is a function of its arguments.
    pub fn expose(&mut self, samples: u32, expose: impl Fn(usize, &mut [Exposure]) + Sync) {
        let total = f64::from(self.samples + samples);
        let (old, new) = (f64::from(self.samples) / total, 1.0 / total);
        let task_size = if self.size[1] == 1 {
            RECEIVERS_PER_TASK
        } else {
            PIXELS_PER_TASK
        };
        self.pixels
            .par_chunks_mut(task_size)
            .enumerate()
            .for_each(|(task, pixels)| {
                let mut exposures = vec![Exposure::default(); pixels.len()];
                expose(task * task_size, &mut exposures);
                for (pixel, exposure) in pixels.iter_mut().zip(&exposures) {
                    for (r, seen) in exposure.sums.iter().enumerate() {
                        pixel.means[r] = pixel.means[r] * old + seen.value * new;
                        let difference = seen.mesh_difference * new;
                        pixel.differences[r] =
                            pixel.differences[r] * old as f32 + difference.as_vec3();
                    }
                }
            });
        self.samples += samples;
    }

    /// The value of each pixel.
    pub fn values(&self) -> impl Iterator<Item = Rgb> {
        let share = 1.0 / f64::from(self.replicates);
        self.pixels
            .iter()
            .map(move |pixel| self.used(&pixel.means).sum::<Rgb>() * share)
    }

    /// The values, as an image.
    pub fn mean(&self) -> Image {
        image(self.size, self.values())
    }

    /// The errors of all pixels; `None` for a film of one replicate, which does not know them.
    /// Noise is [moderated](moderate) by what is `alike`.
    pub fn errors(&self, alike: Alike) -> Option<Vec<PixelError>> {
        if self.replicates < 2 {
            return None;
        }
        let values: Vec<Rgb> = self.values().collect();
        let mut errors = vec![PixelError::default(); values.len()];
        for channel in 0..3 {
            let scatters = self.scatters(channel);
            let levels: Vec<f64> = values.iter().map(|value| value[channel].powi(2)).collect();
            let expected = match alike {
                Alike::Values => levels.clone(),
                Alike::Fractions { rays } => fractions(&values, channel, rays),
                Alike::Neighbours => self.neighbourhood(&scatters),
            };
            let sampling = moderate(&scatters, &expected, self.replicates - 1);
            let discretisation = discretisation(&self.differences(channel), &levels);
            for (index, error) in errors.iter_mut().enumerate() {
                error.sampling[channel] = sampling[index].sqrt();
                error.discretisation[channel] = discretisation[index].sqrt();
            }
        }
        Some(errors)
    }

    /// Relative errors of all pixels together, rms over mean; zero for a film of one replicate. The
    /// scatters are averaged as they are: their mean is unbiased.
    pub fn relative_error(&self) -> FilmError {
        if self.replicates < 2 {
            return FilmError::default();
        }
        let (mut level, mut noise, mut mesh) = (0.0, 0.0, 0.0);
        for channel in 0..3 {
            let values: Vec<f64> = self.values().map(|value| value[channel]).collect();
            let levels: Vec<f64> = values.iter().map(|value| value * value).collect();
            level += values.iter().sum::<f64>();
            noise += self.scatters(channel).iter().sum::<f64>();
            mesh += discretisation(&self.differences(channel), &levels)
                .iter()
                .sum::<f64>();
        }
        let count = 3.0 * self.pixels.len() as f64;
        let relative = |square: f64| {
            if square > 0.0 {
                (square / count).sqrt() / (level / count)
            } else {
                0.0
            }
        };
        FilmError {
            sampling: relative(noise),
            discretisation: relative(mesh),
        }
    }

    /// Variance of each pixel's mean, as its replicates scatter.
    fn scatters(&self, channel: usize) -> Vec<f64> {
        self.pixels
            .iter()
            .map(|pixel| self.scatter(self.used(&pixel.means).map(|x| x[channel])))
            .collect()
    }

    /// Each pixel's difference between meshes, with the variance of its noise.
    fn differences(&self, channel: usize) -> Vec<(f64, f64)> {
        let share = 1.0 / f64::from(self.replicates);
        self.pixels
            .iter()
            .map(|pixel| {
                let own = || self.used(&pixel.differences).map(|d| f64::from(d[channel]));
                (own().sum::<f64>() * share, self.scatter(own()))
            })
            .collect()
    }

    /// An image of the film's size from one value a pixel.
    pub fn image(&self, values: impl Iterator<Item = Rgb>) -> Image {
        image(self.size, values)
    }

    fn used<'a, T: Copy>(
        &self,
        replicates: &'a [T; MAX_REPLICATES],
    ) -> impl Iterator<Item = T> + Clone + 'a {
        replicates.iter().copied().take(self.replicates as usize)
    }

    /// Variance of the mean of the replicates.
    fn scatter(&self, values: impl Iterator<Item = f64> + Clone) -> f64 {
        let count = f64::from(self.replicates);
        let mean = values.clone().sum::<f64>() / count;
        let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
        squares / (count * (count - 1.0))
    }

    /// The mean over the up to eight neighbours of each pixel.
    fn neighbourhood(&self, scatters: &[f64]) -> Vec<f64> {
        let [width, height] = self.size;
        (0..scatters.len())
            .into_par_iter()
            .map(|index| {
                let (x, y) = (index % width, index / width);
                let (mut sum, mut count) = (0.0, 0.0);
                for row in y.saturating_sub(1)..(y + 2).min(height) {
                    for column in x.saturating_sub(1)..(x + 2).min(width) {
                        if (column, row) != (x, y) {
                            sum += scatters[row * width + column];
                            count += 1.0;
                        }
                    }
                }
                if count > 0.0 {
                    sum / count
                } else {
                    scatters[index]
                }
            })
            .collect()
    }
}

/// Variances of the fractions of `rays` independent rays.
fn fractions(values: &[Rgb], channel: usize, rays: u32) -> Vec<f64> {
    let rays = f64::from(rays);
    let variance = |value: &Rgb| {
        let p = (value[channel] * rays + 1.0) / (rays + 2.0);
        p * (1.0 - p) / rays
    };
    values.iter().map(variance).collect()
}

fn image([width, height]: [usize; 2], values: impl Iterator<Item = Rgb>) -> Image {
    Image {
        width,
        height,
        pixels: values.map(|value| value.as_vec3().to_array()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use luxel_solver::sampling::Stage;
    use luxel_solver::sampling::hash::uniform;

    /// A uniform integer in 0..n from Weyl's sequence: equidistributed, so that the moments of
    /// many of them approach those of the uniform distribution.
    fn weyl(i: u32) -> f64 {
        (f64::from(i) * 0.618_033_988_749_894_9).fract()
    }

    #[test]
    fn moments_of_the_uniform_distribution() {
        let n = 100_000;
        let mut moments = Moments::default();
        for i in 0..n {
            // A large offset: the naive sum of squares would lose six of its digits here.
            moments.add(Rgb::splat(1e5 + weyl(i)));
        }
        let variance = moments.variance().expect("many values").x;
        // Weyl's discrepancy is O(log n / n), about 1e-4 here; variance of [0, 1) is 1/12.
        assert!((moments.mean().x - 1e5 - 0.5).abs() < 2e-4, "mean");
        assert!((variance - 1.0 / 12.0).abs() < 2e-4, "variance");
        let error = moments.standard_error().expect("many values").x;
        assert!((error - (variance / f64::from(n)).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn few_values_have_no_variance() {
        let mut moments = Moments::default();
        assert_eq!((moments.mean(), moments.variance()), (Rgb::ZERO, None));
        moments.add(Rgb::ONE);
        assert_eq!((moments.mean(), moments.variance()), (Rgb::ONE, None));
        moments.add(Rgb::splat(3.0));
        assert_eq!(moments.variance(), Some(Rgb::splat(2.0)));
        assert_eq!(moments.standard_error(), Some(Rgb::ONE));
    }

    #[test]
    fn every_pixel_is_exposed_once_whatever_the_threads() {
        let expose = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool of threads");
            let mut film = Film::new([37, 41], 2);
            pool.install(|| {
                film.expose(1, |first, pixels| {
                    for (i, pixel) in pixels.iter_mut().enumerate() {
                        pixel.add(0, Rgb::splat((first + i) as f64).into());
                        pixel.add(1, Rgb::splat(weyl((first + i) as u32)).into());
                    }
                });
            });
            film
        };
        let film = expose(1);
        assert_eq!(film, expose(3));
        for (i, value) in film.values().enumerate() {
            let expected = f64::midpoint(i as f64, weyl(i as u32));
            assert!((value.x - expected).abs() < 1e-12, "pixel {i}");
        }
    }

    #[test]
    fn further_samples_weigh_as_much_as_the_first() {
        let mut film = Film::new([1, 1], 1);
        let add = |film: &mut Film, samples: u32, value: f64| {
            film.expose(samples, |_, pixels| {
                for _ in 0..samples {
                    pixels[0].add(0, Rgb::splat(value).into());
                }
            });
        };
        add(&mut film, 1, 4.0);
        add(&mut film, 3, 8.0);
        assert_eq!(film.values().next(), Some(Rgb::splat(7.0)));
        assert_eq!((film.samples(), film.errors(Alike::Neighbours)), (4, None));
    }

    /// Independent uniform noise of standard deviation σ = 1/√12 in each of four replicates: the
    /// stated error is that of their mean, σ/2, and the mean over pixels of z² is one.
    #[test]
    fn noise_is_stated_as_it_is() {
        let mut film = Film::new([64, 64], 4);
        film.expose(1, |first, pixels| {
            for (i, pixel) in pixels.iter_mut().enumerate() {
                for replicate in 0..4 {
                    let item = (first + i) as u64;
                    let noise = uniform(1, Stage::CAMERA, item, u64::from(replicate));
                    pixel.add(replicate, Rgb::splat(noise).into());
                }
            }
        });
        let errors = film.errors(Alike::Neighbours).expect("four replicates");
        let z_squares: f64 = film
            .values()
            .zip(&errors)
            .map(|(value, error)| ((value.x - 0.5) / error.sampling.x).powi(2))
            .sum();
        // Of 4096 values of z², whose standard deviation is about √2, the mean is known to 0.022.
        let mean = z_squares / 4096.0;
        assert!((mean - 1.0).abs() < 0.1, "{mean}");
        assert!(errors.iter().all(|error| error.discretisation == Rgb::ZERO));
    }
}
