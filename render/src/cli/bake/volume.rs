//! `--volume`: probes for what moves through the scene.

use super::Bake;
use super::directional::Pass;
use crate::cli::exit::{ExitCode, Failure};
use crate::cli::parse_length;
use crate::cli::stated::StatedError;
use crate::cli::steering::Steering;
use crate::files::OutputFolder;
use crate::volume::file::{self, About, Header};
use crate::volume::grid::{Grid, GridError, Resolution};
use crate::volume::{self, validity};
use glam::DVec3;
use luxel_scenes::Scene;

/// Options of volumes.
#[derive(clap::Args, serde::Serialize)]
pub(super) struct VolumeOptions {
    /// Besides, an irradiance volume for what moves: probes at most so many metres apart, in the middle of the cells that the box around
    /// the scene is cut into (volume.json describes them)
    #[arg(long, value_name = "SPACING", value_parser = parse_length)]
    volume: Option<f64>,

    /// The same with so many probes along x, y and z
    #[arg(long, value_name = "NXxNYxNZ", conflicts_with = "volume", value_parser = parse_probes)]
    volume_probes: Option<[usize; 3]>,

    /// Of a volume: the box that it fills in place of the scene's, two opposite corners in metres
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true, value_parser = parse_box)]
    volume_box: Option<[DVec3; 2]>,

    /// Of a volume: degree of the spherical harmonics [default: 2]
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u8).range(1..=2))]
    volume_order: Option<u8>,
}

/// A finished volume, as it is written.
#[derive(serde::Serialize, serde::Deserialize)]
pub(super) struct BakedVolume {
    header: Header,
    data: Vec<u8>,
    errors: Vec<u8>,
    validity: Vec<u8>,
    pub(super) stated: StatedError,
}

impl VolumeOptions {
    /// How many probes are wanted, if any.
    pub(super) fn resolution(&self) -> Option<Resolution> {
        let spacing = self.volume.map(Resolution::Spacing);
        spacing.or(self.volume_probes.map(Resolution::Probes))
    }

    /// What is wrong with them.
    pub(super) fn problem(&self) -> Option<&'static str> {
        if self.resolution().is_some() {
            None
        } else if self.volume_box.is_some() {
            Some("--volume-box belongs to --volume or --volume-probes")
        } else if self.volume_order.is_some() {
            Some("--volume-order belongs to --volume or --volume-probes")
        } else {
            None
        }
    }

    /// Where probes stand; `None` where none are wanted.
    pub(super) fn grid(&self, scene: &Scene) -> Result<Option<Grid>, Failure> {
        let Some(resolution) = self.resolution() else {
            return Ok(None);
        };
        let [lower, upper] = self.volume_box.unwrap_or_else(|| {
            let (lower, upper) = scene.bounds().unwrap_or_default();
            [lower, upper]
        });
        let grid = Grid::new(lower, upper, resolution);
        grid.map(Some).map_err(|error| {
            let exit = match error {
                GridError::Flat(_) => ExitCode::NothingToDo,
                GridError::TooMany(..) => ExitCode::Usage,
            };
            Failure::new(exit, format!("{}: {error}", scene.name))
        })
    }

    fn order(&self) -> u8 {
        self.volume_order.unwrap_or(2)
    }

    /// Memory while so many probes are baked, in bytes.
    pub(super) fn bytes(&self, grid: &Grid) -> usize {
        match self.order() {
            1 => volume::bytes_to_bake::<4>(grid.count()),
            _ => volume::bytes_to_bake::<9>(grid.count()),
        }
    }
}

impl Bake {
    /// A volume of the light that a pass is of, `include` being its name; `Ok(None)` when it was stopped before there was any.
    pub(super) fn volume(
        &self,
        pass: &Pass<'_, '_, '_>,
        grid: Grid,
        include: &str,
    ) -> Result<Option<BakedVolume>, Failure> {
        match self.volume.order() {
            1 => self.volume_of::<4>(pass, grid, include),
            _ => self.volume_of::<9>(pass, grid, include),
        }
    }

    fn volume_of<const N: usize>(
        &self,
        pass: &Pass<'_, '_, '_>,
        grid: Grid,
        include: &str,
    ) -> Result<Option<BakedVolume>, Failure> {
        let (world, context) = (pass.world, pass.context);
        let scene = world.scene();
        let is_valid = validity::valid(world, &grid, self.backface_tolerance);
        if !is_valid.contains(&true) {
            return Err(Failure::new(
                ExitCode::NothingToDo,
                format!(
                    "{}: all {} probes of the volume see backs of faces and lie inside solids; a smaller --volume spacing or a --volume-box puts some into the open",
                    scene.name,
                    grid.count()
                ),
            ));
        }
        let mut steering = Steering::new(context, Some(pass.goal));
        let found = volume::bake::<N>(world, grid, is_valid, &pass.aim(), &mut steering)?;
        Ok(found.map(|volume| {
            context.reporter.detail(format_args!(
                "volume: {} probes, {} of them inside solids; {} gather and {} shadow rays a probe",
                volume.estimates.len(),
                volume.is_valid.iter().filter(|valid| !**valid).count(),
                volume.rays[0],
                volume.rays[1]
            ));
            let about = About {
                scene: &scene.name,
                include,
                units: scene.units,
                seed: context.common.seed,
            };
            BakedVolume {
                header: file::header(&volume, &about),
                data: file::bytes(&volume.estimates, |estimate| &estimate.coefficients),
                errors: file::bytes(&volume.estimates, |estimate| &estimate.standard_error),
                validity: file::validity(&volume),
                stated: StatedError::of_gather(&volume.parts, 0.0),
            }
        }))
    }
}

impl BakedVolume {
    /// Writes its files, the header last. Returns its name.
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<String, Failure> {
        folder.write(file::DATA, &self.data)?;
        folder.write(file::ERRORS, &self.errors)?;
        folder.write(file::VALIDITY, &self.validity)?;
        let mut text = serde_json::to_string_pretty(&self.header)?;
        text.push('\n');
        folder.write(file::HEADER, text.as_bytes())?;
        Ok(file::HEADER.into())
    }
}

/// Numbers of probes along three axes.
fn parse_probes(text: &str) -> Result<[usize; 3], String> {
    let help = || "three numbers from 1 to 65536 are needed, such as 8x4x8".to_owned();
    let numbers: Vec<usize> = text
        .split('x')
        .map(|part| part.parse().map_err(|_| help()))
        .collect::<Result<_, _>>()?;
    match numbers[..] {
        [x, y, z] if numbers.iter().all(|n| (1..=1 << 16).contains(n)) => Ok([x, y, z]),
        _ => Err(help()),
    }
}

/// Two corners of a box.
fn parse_box(text: &str) -> Result<[DVec3; 2], String> {
    let help = || {
        "six numbers are needed, two opposite corners with some space between them, such as -2,0,-2,2,3,2"
            .to_owned()
    };
    let numbers: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| help()))
        .collect::<Result<_, _>>()?;
    let [a, b, c, d, e, f] = numbers[..] else {
        return Err(help());
    };
    let [one, other] = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
    let size = (other - one).abs();
    if size.is_finite() && size.min_element() > 0.0 {
        Ok([one.min(other), one.max(other)])
    } else {
        Err(help())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_are_three_numbers() {
        assert_eq!(parse_probes("8x4x1"), Ok([8, 4, 1]));
        for bad in [
            "",
            "8",
            "8x4",
            "8x4x0",
            "8x4x-1",
            "8x4x2x2",
            "ax4x2",
            "8x4x65537",
        ] {
            assert!(parse_probes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn boxes_have_two_corners_apart() {
        let sorted = Ok([DVec3::new(-2.0, 0.0, -1.0), DVec3::new(2.0, 3.0, 1.0)]);
        assert_eq!(parse_box("2,0,-1, -2,3,1"), sorted);
        for bad in [
            "",
            "1,2,3",
            "0,0,0,1,1,0",
            "0,0,0,1,1,NaN",
            "0,0,0,1,1,inf",
            "0,0,0,1,1,1,1",
        ] {
            assert!(parse_box(bad).is_err(), "{bad}");
        }
    }
}
