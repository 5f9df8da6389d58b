//! What a picture holds in memory.

use super::prepare::{GATHER_PATCHES, receivers};
use super::{Method, Render};
use crate::camera::CameraFrame;
use crate::cli::Context;
use crate::cli::exit::Failure;
use crate::cli::footprint::{Footprint, held_back, larger_error, largest};
use crate::cli::goal::Goal;
use crate::cli::steering::first_error;
use crate::cli::transport::{Transport, VIEW_PATCHES};
use crate::film::Film;
use crate::image::exr::Picture;
use crate::integrators::Vertex;
use luxel_scenes::Rgb;
use luxel_solver::adaptive;
use luxel_solver::gather::{IndirectField, Tally};
use luxel_solver::world::{Receiver, World};

/// Layers of a picture besides its values.
const LAYERS: usize = 3;

impl Render {
    /// Refuses a picture that would not fit into memory and says what would.
    pub(super) fn require_memory(
        &self,
        world: &World<'_>,
        frame: &CameraFrame,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> Result<(), Failure> {
        let [width, height] = frame.size();
        let limit = context.common.max_memory;
        let error = first_error(goal);
        let with_mesh = |size: [usize; 2], error: f64| {
            let patches = self.first_patches(error, goal);
            self.footprint(world, size, goal).with(
                "patches and their solutions",
                self.bytes_to_solve(patches, world),
            )
        };
        with_mesh([width, height], error).require(context, || {
            let size = |width_of: usize| {
                let height_of = (height * width_of + width / 2) / width;
                [width_of, height_of.max(1)]
            };
            let fits = |width: usize| with_mesh(size(width), error).fits(limit);
            if let Some(narrower) = largest(1, width - 1, fits) {
                let [width, height] = size(narrower);
                return Some(format!("--size {width}x{height}"));
            }
            let is_chosen = matches!(self.integrator, Method::Gather | Method::Whitted);
            goal.filter(|_| is_chosen)?;
            larger_error(error, |error| with_mesh([width, height], error).fits(limit))
        })
    }

    /// Patches of the finest mesh of a gather that fits.
    pub(super) fn most_patches(
        &self,
        world: &World<'_>,
        frame: &CameraFrame,
        goal: Option<&Goal>,
        context: &Context<'_>,
    ) -> usize {
        let first = self.first_patches(first_error(goal), goal);
        let held = self.footprint(world, frame.size(), goal);
        held.most_patches(world.scene(), first, self.reflections.bounces(), context)
    }

    /// Whether a view of so many patches fits; says so where not.
    pub(super) fn may_be_finer(
        &self,
        world: &World<'_>,
        frame: &CameraFrame,
        goal: Option<&Goal>,
        patches: usize,
        context: &Context<'_>,
    ) -> bool {
        let held = self.footprint(world, frame.size(), goal);
        let finer = held.with("patches", self.bytes_to_solve(patches, world));
        let fits = finer.fits(context.common.max_memory);
        if !fits {
            held_back(context);
        }
        fits
    }

    /// Scene and film, and the field of indirect light where one is made. What is gathered for the field is gone before
    /// there is a film.
    fn footprint(&self, world: &World<'_>, size: [usize; 2], goal: Option<&Goal>) -> Footprint {
        let pixels = size[0] * size[1];
        let written = Film::bytes_for(pixels) + Picture::bytes_for(pixels, LAYERS);
        let film = written.max(goal.map_or(0, |_| Film::bytes_to_refine(pixels)));
        let held = Footprint::of(world);
        let has_field = matches!(self.integrator, Method::Gather | Method::Whitted)
            && self.reflections.bounces().reflect();
        if goal.is_none() || !has_field {
            return held.with("film and picture", film);
        }
        let [columns, rows] = receivers(size);
        let receivers = columns * rows;
        let seen = receivers * (size_of::<(Vertex<'_>, Receiver, Rgb)>() + size_of::<Tally>());
        held.with(
            "film and picture, or before what is gathered",
            film.max(seen),
        )
        .with(
            "indirect light of pixels",
            IndirectField::bytes_for(receivers),
        )
    }

    /// Patches of the first mesh; zero without one.
    fn first_patches(&self, error: f64, goal: Option<&Goal>) -> usize {
        match self.integrator {
            Method::Radiosity => VIEW_PATCHES,
            Method::Path | Method::Ao => 0,
            _ if !self.reflections.bounces().reflect() => 0,
            Method::Gather | Method::Whitted if goal.is_none() => GATHER_PATCHES,
            Method::Gather | Method::Whitted => adaptive::first_patches(error),
        }
    }

    /// Memory while so many patches are solved.
    fn bytes_to_solve(&self, patches: usize, world: &World<'_>) -> usize {
        match self.integrator {
            _ if patches == 0 => 0,
            Method::Radiosity => Transport::bytes_to_view(patches, world.scene()),
            _ => adaptive::bytes_to_solve(patches, self.reflections.bounces(), world.scene()),
        }
    }
}
