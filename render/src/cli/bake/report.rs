//! What a bake says of itself: how wrong everything is, and where it lies.

use super::masks::Masked;
use super::{Bake, Baked, Include, deliver};
use crate::cli::Session;
use crate::cli::exit::Failure;
use crate::cli::goal::Goal;
use crate::cli::memory;
use crate::cli::stated::StatedError;
use crate::lightmap::manifest::Manifest;

/// How wrong something is that was baked.
pub(super) struct Stated {
    pub(super) what: String,
    pub(super) error: StatedError,
    /// What bilinear filtering leaves between texels.
    pub(super) filtering: Option<f64>,
}

impl Baked {
    /// How wrong everything is. Of masks the noisiest speaks for all.
    pub(super) fn stated(&self) -> Vec<Stated> {
        let layers = self.layers.iter().flat_map(|layer| {
            let name = crate::cli::name(&layer.include);
            let directions = layer.directional.as_ref().map(|maps| Stated {
                what: format!("directions of {name}"),
                error: maps.stated.clone(),
                filtering: None,
            });
            let light = Stated {
                what: name,
                error: layer.stated.clone(),
                filtering: Some(layer.error.filtering),
            };
            std::iter::once(light).chain(directions)
        });
        let noisiest = |a: &&Masked, b: &&Masked| a.stated.total().total_cmp(&b.stated.total());
        let masks = self.masks.iter().max_by(noisiest).map(|masked| Stated {
            what: crate::cli::name(&Include::Masks),
            error: masked.stated.clone(),
            filtering: Some(masked.error.filtering),
        });
        let volume = self.volume.as_ref().map(|volume| Stated {
            what: "volume".into(),
            error: volume.stated.clone(),
            filtering: None,
        });
        layers.chain(masks).chain(volume).collect()
    }
}

impl Bake {
    /// Tells what was delivered, and how right it is.
    pub(super) fn report(
        &self,
        manifest: &Manifest,
        stated: &[Stated],
        goal: &Goal,
        session: &mut Session<'_>,
    ) -> Result<(), Failure> {
        let context = &session.context;
        let seconds = context.started.elapsed().as_secs_f64();
        for stated in stated {
            let filtering = stated.filtering.map_or(String::new(), |filtering| {
                format!(
                    "; between texels filtering leaves {:.2} %",
                    100.0 * filtering
                )
            });
            context.reporter.note(format_args!(
                "{}: {}{filtering}",
                stated.what,
                stated.error.summary(Some(goal)),
            ));
        }
        context.reporter.note(format_args!(
            "{} luxels on {} page(s) of {} × {}, {:.1} texels a metre, {seconds:.2} s{}",
            manifest.atlas.lit,
            manifest.lightmap.pages.len(),
            manifest.atlas.width,
            manifest.atlas.height,
            manifest.atlas.texels_per_metre,
            memory::peak_in_words(),
        ));
        deliver::tell_losses(manifest, &context.reporter);
        for object in &manifest.objects {
            context.reporter.detail(format_args!(
                "{}: {:.3} m², {:.1} texels a metre",
                object.name, object.area, object.texels_per_metre
            ));
        }
        let text = if context.common.json {
            let mut json = serde_json::to_value(manifest)?;
            json["seconds"] = seconds.into();
            json["stated"] = stated
                .iter()
                .map(|stated| (stated.what.clone(), stated.error.to_json(Some(goal))))
                .collect::<serde_json::Map<_, _>>()
                .into();
            memory::add_peak(&mut json);
            serde_json::to_string_pretty(&json)?
        } else {
            self.output.join("manifest.json").display().to_string()
        };
        session.print(&text)
    }
}
