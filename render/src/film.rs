//! The film: mean and variance of every pixel.
//!
//! For n values x of a pixel, Welford's recurrences keep mean μ and m₂ = Σ (x − μ)², so that the
//! sample variance is s² = m₂/(n − 1) and the standard error of the mean s/√n. Source: B. P.
//! Welford, "Note on a method for calculating corrected sums of squares and products",
//! Technometrics 4(3), 1962. The standard error is honest only when the values are *independent*:
//! what is added is therefore the mean of one whole replicate (a low-discrepancy set with a
//! scramble of its own), never a single point of a set. Cost: 56 bytes a pixel.

use crate::image::Image;
use luxel_scenes::Rgb;
use rayon::prelude::*;

/// Pixels that one task computes together: enough rays for a batch, few enough that a small
/// picture still feeds every thread.
pub const PIXELS_PER_TASK: usize = 512;

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

/// Pixels in row-major order, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    size: [usize; 2],
    pixels: Vec<Moments>,
}

impl Film {
    /// An empty film of `size` (width, height) pixels.
    pub fn new(size: [usize; 2]) -> Self {
        Self {
            size,
            pixels: vec![Moments::default(); size[0] * size[1]],
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The moments of all pixels, row-major, row 0 at the top.
    pub fn pixels(&self) -> &[Moments] {
        &self.pixels
    }

    /// Lets `expose` add values to all pixels, in parallel, [`PIXELS_PER_TASK`] consecutive pixels
    /// a call: it gets the index of the first one and their moments. Every pixel belongs to one
    /// call, so that the result does not depend on the number of threads when `expose` is a
    /// function of its arguments.
    pub fn expose(&mut self, expose: impl Fn(usize, &mut [Moments]) + Sync) {
        self.pixels
            .par_chunks_mut(PIXELS_PER_TASK)
            .enumerate()
            .for_each(|(task, pixels)| expose(task * PIXELS_PER_TASK, pixels));
    }

    /// The means, as an image in the unit of the values.
    pub fn mean(&self) -> Image {
        self.image(Moments::mean)
    }

    /// The standard errors of the means, as an image; `None` when a pixel holds fewer than two
    /// values.
    pub fn standard_error(&self) -> Option<Image> {
        self.pixels
            .iter()
            .all(|pixel| pixel.count > 1)
            .then(|| self.image(|pixel| pixel.standard_error().unwrap_or_default()))
    }

    fn image(&self, value: impl Fn(&Moments) -> Rgb) -> Image {
        let pixels = self
            .pixels
            .iter()
            .map(|pixel| value(pixel).as_vec3().to_array());
        Image {
            width: self.size[0],
            height: self.size[1],
            pixels: pixels.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                .expect("a thread pool");
            let mut film = Film::new([37, 41]);
            pool.install(|| {
                film.expose(|first, pixels| {
                    for (i, pixel) in pixels.iter_mut().enumerate() {
                        pixel.add(Rgb::splat((first + i) as f64));
                        pixel.add(Rgb::splat(weyl((first + i) as u32)));
                    }
                });
            });
            film
        };
        let film = expose(1);
        assert!(film.pixels().iter().all(|pixel| pixel.count() == 2));
        assert_eq!(film, expose(3));
        assert_eq!(film.mean().pixels.len(), 37 * 41);
        assert!(film.standard_error().is_some());
    }
}
