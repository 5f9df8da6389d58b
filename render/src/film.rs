//! The film: what every pixel sees, and how wrong it is.
//!
//! A pixel holds the means of a few independent replicates, each a low-discrepancy set with a
//! scramble of its own (and, where light is looked up in a mesh, with a solution of its own): the
//! scatter s² = Σ (x_r − x̄)² / (R (R − 1)) is the variance of their mean, which the samples of a set
//! among themselves would not tell. What the neighbours say of it stands in `noise`. Films take
//! further samples, of the same sequences, each pixel as many as it needs (`allocation`), until the
//! error suits. Cost: 148 bytes a pixel.

mod allocation;
mod moments;
mod noise;

pub use moments::Moments;

use crate::image::Image;
use crate::integrators::{SampleKey, Seen};
use glam::Vec3;
use luxel_scenes::Rgb;
use luxel_solver::error::{discretisation, moderate};
use luxel_solver::gather::MAX_REPLICATES;
use rayon::prelude::*;

/// Samples of a replicate that one call computes together: enough rays for a batch, few enough that a
/// small picture still feeds every thread.
const BATCH: usize = 512;

/// The replicates of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
struct Pixel {
    /// Samples of each replicate.
    samples: u32,
    /// Mean of the samples of each replicate.
    means: [Rgb; MAX_REPLICATES],
    /// Mean differences from a coarser mesh. Single precision: they are estimates of an error.
    differences: [Vec3; MAX_REPLICATES],
}

impl Pixel {
    /// Takes in the sums of `further` samples of each replicate.
    fn add(&mut self, sums: &[Seen; MAX_REPLICATES], further: u32) {
        let total = f64::from(self.samples + further);
        let (old, new) = (f64::from(self.samples) / total, 1.0 / total);
        for (r, seen) in sums.iter().enumerate() {
            self.means[r] = self.means[r] * old + seen.value * new;
            let difference = seen.mesh_difference * new;
            self.differences[r] = self.differences[r] * old as f32 + difference.as_vec3();
        }
        self.samples += further;
    }
}

/// A sample to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Index of the pixel.
    pub pixel: usize,
    /// Where its random numbers come from.
    pub key: SampleKey,
}

/// Pixels in row-major order, row 0 at the top: or any other receivers, in one row.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Film {
    size: [usize; 2],
    replicates: u32,
    pixels: Vec<Pixel>,
}

/// How many samples the pixels of a film hold, all replicates together.
#[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct SampleCounts {
    /// Mean over the pixels.
    pub mean: f64,
    /// Of the pixel with the fewest.
    pub min: u32,
    /// Of the pixel with the most.
    pub max: u32,
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
    /// Neighbours are about equally noisy, but for edges between them.
    Neighbours,
    /// All are about equally noisy relative to their values. Pixels hold equally many samples.
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
            pixels: vec![Pixel::default(); size[0] * size[1]],
        }
    }

    /// Memory of a film of so many pixels, in bytes.
    pub fn bytes_for(pixels: usize) -> usize {
        pixels * size_of::<Pixel>()
    }

    /// The same while it is exposed, in bytes: beside each pixel, what it is to take.
    pub fn bytes_to_expose(pixels: usize) -> usize {
        Self::bytes_for(pixels) + pixels * (size_of::<Exposure<'_>>() + size_of::<u32>())
    }

    /// The same while it is judged and exposed further: of each channel values, levels and scatters, and what is made
    /// of them.
    pub fn bytes_to_refine(pixels: usize) -> usize {
        const CHANNEL: usize = size_of::<[f64; 9]>();
        Self::bytes_for(pixels) + 3 * pixels * CHANNEL
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Independent replicates of each pixel.
    pub fn replicates(&self) -> u32 {
        self.replicates
    }

    /// Samples of every pixel so far, all replicates together.
    pub fn samples(&self) -> impl Iterator<Item = u32> {
        let replicates = self.replicates;
        self.pixels
            .iter()
            .map(move |pixel| pixel.samples * replicates)
    }

    /// Mean and range of [`Film::samples`]; zero for a film without pixels.
    pub fn sample_counts(&self) -> SampleCounts {
        let total: u64 = self.samples().map(u64::from).sum();
        SampleCounts {
            mean: total as f64 / self.pixels.len().max(1) as f64,
            min: self.samples().min().unwrap_or(0),
            max: self.samples().max().unwrap_or(0),
        }
    }

    /// Samples of all replicates together when each takes `further`.
    pub fn cost(&self, further: &[u32]) -> u64 {
        let sum: u64 = further.iter().copied().map(u64::from).sum();
        sum * u64::from(self.replicates)
    }

    /// As many samples for each replicate of every pixel.
    pub fn evenly(&self, samples: u32) -> Vec<u32> {
        vec![samples; self.pixels.len()]
    }

    /// Samples for each replicate of every pixel that divide the variance of the whole film by
    /// `reduction`, at least cost, as far as its noise is known. No pixel's are more than quadrupled.
    pub fn where_noisy(&self, reduction: f64) -> Vec<u32> {
        let noise: Vec<Vec<f64>> = (0..3)
            .into_par_iter()
            .map(|channel| self.channel(channel).variances())
            .collect();
        let of_pixel = |pixel| noise.iter().map(|channel| channel[pixel]).sum();
        let variances: Vec<f64> = (0..self.pixels.len()).map(of_pixel).collect();
        let samples: Vec<u32> = self.pixels.iter().map(|pixel| pixel.samples).collect();
        allocation::further(&variances, &samples, reduction)
    }

    /// Takes `further` samples for each replicate of every pixel, in parallel. `see` writes what is
    /// seen by some samples, all of one replicate. The result does not depend on the number of threads
    /// when what a sample sees depends on the sample alone: every pixel belongs to one task.
    ///
    /// # Panics
    /// When `further` has not one number for each pixel.
    pub fn expose(&mut self, further: &[u32], see: impl Fn(&[Due], &mut [Seen]) + Sync) {
        assert_eq!(further.len(), self.pixels.len(), "a number a pixel");
        let replicates = self.replicates;
        let mut due: Vec<Exposure<'_>> = self
            .pixels
            .iter_mut()
            .zip(further)
            .enumerate()
            .filter(|(_, (_, further))| **further > 0)
            .map(|(index, (pixel, &further))| Exposure {
                index,
                pixel,
                further,
            })
            .collect();
        let mut tasks = Vec::new();
        let mut rest = due.as_mut_slice();
        while !rest.is_empty() {
            let mut samples = 0;
            let mut fits = |exposure: &Exposure<'_>| {
                let room = samples < BATCH;
                samples += exposure.further as usize;
                room
            };
            let end = rest.iter().take_while(|e| fits(e)).count();
            let (task, others) = rest.split_at_mut(end);
            tasks.push(task);
            rest = others;
        }
        tasks.into_par_iter().for_each(|exposures| {
            let mut sums = vec![[Seen::default(); MAX_REPLICATES]; exposures.len()];
            for replicate in 0..replicates {
                let due = exposures.iter().enumerate().flat_map(|(slot, exposure)| {
                    let before = exposure.pixel.samples;
                    let item = exposure.index as u64 * u64::from(replicates);
                    let due = move |index| Due {
                        pixel: exposure.index,
                        key: SampleKey {
                            item: item + u64::from(replicate),
                            replicate,
                            index,
                        },
                    };
                    let indices = before..before + exposure.further;
                    indices.map(move |index| (slot, due(index)))
                });
                take(due, &see, |slot, seen| {
                    sums[slot][replicate as usize] += seen;
                });
            }
            for (exposure, sums) in exposures.iter_mut().zip(&sums) {
                exposure.pixel.add(sums, exposure.further);
            }
        });
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
    /// Noise is told by what is `alike`.
    pub fn errors(&self, alike: Alike) -> Option<Vec<PixelError>> {
        if self.replicates < 2 {
            return None;
        }
        let values: Vec<Rgb> = self.values().collect();
        let mut errors = vec![PixelError::default(); values.len()];
        for channel in 0..3 {
            let levels: Vec<f64> = values.iter().map(|value| value[channel].powi(2)).collect();
            let moderated =
                |expected: &[f64]| moderate(&self.scatters(channel), expected, self.replicates - 1);
            let sampling = match alike {
                Alike::Neighbours => self.channel(channel).variances(),
                Alike::Fractions { rays } => moderated(&fractions(&values, channel, rays)),
                Alike::Values => moderated(&levels),
            };
            let discretisation = discretisation(&self.differences(channel), &levels);
            for (index, error) in errors.iter_mut().enumerate() {
                error.sampling[channel] = sampling[index].sqrt();
                error.discretisation[channel] = discretisation[index].sqrt();
            }
        }
        Some(errors)
    }

    /// Relative errors of all pixels together, rms over mean; zero for a film of one replicate.
    pub fn relative_error(&self, alike: Alike) -> FilmError {
        if self.replicates < 2 {
            return FilmError::default();
        }
        let of_channel = |channel: usize| {
            let values: Vec<f64> = self.values().map(|value| value[channel]).collect();
            let levels: Vec<f64> = values.iter().map(|value| value * value).collect();
            let noise = match alike {
                Alike::Neighbours => self.channel(channel).total(),
                // Where pixels hold equally many samples, the mean of their scatters is unbiased.
                _ => self.scatters(channel).iter().sum::<f64>(),
            };
            let mesh = discretisation(&self.differences(channel), &levels);
            [values.iter().sum(), noise, mesh.iter().sum()]
        };
        let of_channels: Vec<[f64; 3]> = (0..3).into_par_iter().map(of_channel).collect();
        let [level, noise, mesh] =
            [0, 1, 2].map(|part| of_channels.iter().map(|parts| parts[part]).sum::<f64>());
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

    /// A channel, for what pixels and their neighbours tell of its noise.
    fn channel(&self, channel: usize) -> noise::Channel {
        noise::Channel {
            size: self.size,
            samples: self.samples().collect(),
            values: self.values().map(|value| value[channel]).collect(),
            scatters: self.scatters(channel),
            degrees: self.replicates - 1,
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
}

/// A pixel that takes further samples.
struct Exposure<'a> {
    index: usize,
    pixel: &'a mut Pixel,
    further: u32,
}

/// Lets `see` take samples, a batch at a time, and hands what each saw to `add` with its slot, in order.
fn take(
    mut due: impl Iterator<Item = (usize, Due)>,
    see: impl Fn(&[Due], &mut [Seen]),
    mut add: impl FnMut(usize, Seen),
) {
    let mut slots = Vec::with_capacity(BATCH);
    let mut batch = Vec::with_capacity(BATCH);
    let mut seen = Vec::with_capacity(BATCH);
    loop {
        slots.clear();
        batch.clear();
        for (slot, due) in due.by_ref().take(BATCH) {
            slots.push(slot);
            batch.push(due);
        }
        if batch.is_empty() {
            return;
        }
        seen.clear();
        seen.resize(batch.len(), Seen::default());
        see(&batch, &mut seen);
        for (&slot, &seen) in slots.iter().zip(&seen) {
            add(slot, seen);
        }
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
mod tests;
