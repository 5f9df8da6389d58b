//! Images, reports and the command line of luxel.
//!
//! This crate turns what the solver knows into something to look at or to read: camera rays and
//! a [`film`], image files, tables of probes and form factors, and the `luxel` command ([`cli`]).
//! It holds no transport algorithm of its own besides the image integrators.

#![cfg_attr(
    test,
    allow(
        clippy::float_cmp,
        reason = "tests compare values that pass through unchanged"
    )
)]

pub mod accuracy;
pub mod camera;
pub mod cli;
pub mod diff;
pub mod display;
pub mod files;
pub mod film;
pub mod image;
pub mod integrators;
pub mod lightmap;
pub mod matrix;
pub mod ply;
pub mod points;
pub mod progress;
pub mod report;
pub mod serve;
pub mod solution;
pub mod tone_map;
pub mod view;
pub mod volume;
