//! `luxel export`: a finished bake made ready for somebody else.

use super::Session;
use super::bake::deliver::{each_page, tell_losses, write_manifest, write_page};
use super::exit::{ExitCode, Failure};
use crate::files::OutputFolder;
use crate::lightmap::encoding::Format;
use crate::lightmap::export::glb::renamed;
use crate::lightmap::folder::{BakedFolder, FolderError};
use crate::lightmap::handover::{Common, Handover, Of};
use crate::lightmap::manifest::{Layer, Manifest, Page};
use crate::lightmap::target::Target;
use crate::volume::file as volume;
use luxel_scenes::UnitSystem;
use std::path::{Path, PathBuf};

/// Make a finished bake ready for another program, without baking
///
/// Writes the folder that luxel bake would have written with the same --for and --format, from the maps of E that every bake keeps:
/// the maps in the unit and the kind of file that is wanted, the scene that names them, the snippet and the manifest.
#[derive(clap::Args)]
pub(super) struct Export {
    /// Folder that luxel bake or luxel export wrote
    folder: PathBuf,

    /// Folder to write to; it is made when it does not exist
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,

    /// Who is to show the maps [default: whom they were made for]
    #[arg(long = "for", value_enum, value_name = "WHOM")]
    target: Option<Target>,

    /// Kind of file of the maps [default: what --for loads best: ktx2 for bevy, else exr]
    #[arg(long, value_enum, value_name = "FORMAT")]
    format: Option<Format>,
}

impl Export {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let source = BakedFolder::open(&self.folder)?;
        require_whole(&source)?;
        let made_for = source.manifest().units.target;
        let handover = Handover::new(self.target.unwrap_or(made_for), self.format)?;
        let units = self.units(source.manifest())?;
        if is_same(&self.folder, &self.output) {
            return Err(Failure::new(
                ExitCode::Usage,
                format!(
                    "{}: cannot be exported to itself; name another folder: -o OUT",
                    self.folder.display()
                ),
            ));
        }
        let folder = OutputFolder::prepare(&self.output)?;
        let context = &session.context;
        let export = Exporting {
            source: &source,
            folder: &folder,
            handover,
            units,
        };
        let manifest = context.common.install(|| export.write())??;
        tell_losses(&manifest, &context.reporter);
        let text = if context.common.json {
            serde_json::to_string_pretty(&manifest)?
        } else {
            self.output.join("manifest.json").display().to_string()
        };
        session.print(&text)?;
        Ok(ExitCode::Ok)
    }

    /// What the light of a bake is counted in. Names of maps become names of files, and are looked at here too.
    fn units(&self, manifest: &Manifest) -> Result<UnitSystem, Failure> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
        let mut layers = std::iter::once(&manifest.lightmap).chain(&manifest.others);
        let unknown = layers.find(|layer| !layer.include.chars().all(plain));
        let what = match (manifest.units.unit.as_str(), unknown) {
            ("W/m2", None) => return Ok(UnitSystem::Radiometric),
            ("lx", None) => return Ok(UnitSystem::Photometric),
            (_, Some(layer)) => format!("maps of `{}`", layer.include),
            (unit, None) => format!("the unit `{unit}`"),
        };
        Err(Failure::new(
            ExitCode::InvalidInput,
            format!(
                "{}: {what} are not known to this luxel; bake again: luxel bake SCENE -o DIR",
                self.folder.join("manifest.json").display()
            ),
        ))
    }
}

/// Refuses folders in which a file is missing before anything is written.
fn require_whole(source: &BakedFolder) -> Result<(), FolderError> {
    let manifest = source.manifest();
    let layers = std::iter::once(&manifest.lightmap).chain(&manifest.others);
    for page in layers.flat_map(|layer| &layer.pages) {
        let Page {
            master,
            error,
            luxels,
            validity,
            charts,
            ..
        } = page;
        for name in [master, error, luxels, validity, charts] {
            source.require(name)?;
        }
    }
    for name in as_they_are(manifest) {
        source.require(name)?;
    }
    let files = &manifest.files;
    let names = [
        &files.glb,
        &files.obj,
        &materials(&files.obj),
        &files.preview,
    ];
    names.into_iter().try_for_each(|name| source.require(name))
}

/// Files that are the same for everybody: shadow masks, whose shares have no unit, directions and volumes, which are of E.
fn as_they_are(manifest: &Manifest) -> Vec<&str> {
    let masks = manifest.masks.iter().flat_map(|masks| &masks.pages);
    let masks = masks.flat_map(|page| [&page.file, &page.error, &page.luxels]);
    let layers = std::iter::once(&manifest.lightmap).chain(&manifest.others);
    let directions = layers.filter_map(|layer| layer.directional.as_ref());
    let directions = directions
        .flat_map(|directional| &directional.pages)
        .flat_map(|page| page.files.iter().chain(&page.error));
    let mut names: Vec<&str> = masks.chain(directions).map(String::as_str).collect();
    if let Some(header) = &manifest.volume {
        names.extend([volume::DATA, volume::ERRORS, volume::VALIDITY, header]);
    }
    names
}

/// The material library of an OBJ file.
fn materials(obj: &str) -> String {
    let path = Path::new(obj).with_extension("mtl");
    path.to_string_lossy().into_owned()
}

/// Whether two paths are one folder.
fn is_same(one: &Path, other: &Path) -> bool {
    match (std::fs::canonicalize(one), std::fs::canonicalize(other)) {
        (Ok(one), Ok(other)) => one == other,
        _ => false,
    }
}

/// An export on its way.
struct Exporting<'a> {
    source: &'a BakedFolder,
    folder: &'a OutputFolder,
    handover: Handover,
    units: UnitSystem,
}

impl Exporting<'_> {
    /// Writes everything, the manifest last. Returns it.
    fn write(&self) -> Result<Manifest, Failure> {
        // An older manifest does not speak of what is written now.
        self.folder.remove("manifest.json")?;
        let old = self.source.manifest();
        let lightmap = self.layer(&old.lightmap, true)?;
        let others = old.others.iter().map(|layer| self.layer(layer, false));
        let others = others.collect::<Result<_, _>>()?;
        let maps: Vec<String> = lightmap.pages.iter().map(|p| p.file.clone()).collect();
        let glb = renamed(&self.source.bytes(&old.files.glb)?, &maps)?;
        self.folder.write(&old.files.glb, &glb)?;
        for name in [
            &materials(&old.files.obj),
            &old.files.obj,
            &old.files.preview,
        ] {
            self.copy(name, name)?;
        }
        for name in as_they_are(old) {
            self.copy(name, name)?;
        }
        let manifest = Manifest {
            units: self.handover.units(self.units),
            lightmap,
            others,
            bevy: self.handover.bevy(self.units, old.exposure),
            ..old.clone()
        };
        write_manifest(self.folder, self.handover, &manifest)?;
        Ok(manifest)
    }

    fn layer(&self, layer: &Layer, is_first: bool) -> Result<Layer, Failure> {
        let old = self.source.manifest();
        let of = Of {
            common: Common {
                software: &old.software,
                scene: &old.scene,
                units: self.units,
                seed: old.seed,
            },
            include: &layer.include,
            is_first,
            error: layer.error.luxels,
        };
        let pages = each_page(layer.pages.len(), |index| {
            self.page(&layer.pages[index], &of, index)
        })?;
        Ok(Layer {
            pages,
            ..layer.clone()
        })
    }

    fn page(&self, old: &Page, of: &Of, index: usize) -> Result<Page, Failure> {
        let size = [old.width, old.height];
        let master = self.source.map(&old.master, size)?;
        let files = self.handover.files(&master, of, index)?;
        let page = write_page(self.folder, &files, &of.stem(index), size)?;
        for (from, to) in [
            (&old.error, &page.error),
            (&old.luxels, &page.luxels),
            (&old.validity, &page.validity),
            (&old.charts, &page.charts),
        ] {
            self.copy(from, to)?;
        }
        Ok(page)
    }

    /// Takes a file over as it is.
    fn copy(&self, from: &str, to: &str) -> Result<(), Failure> {
        Ok(self.folder.write(to, &self.source.bytes(from)?)?)
    }
}
