//! `luxel check`: what is suspicious about a scene.

use super::Session;
use super::exit::{ExitCode, Failure};
use crate::camera::CameraFrame;
use crate::view::view;
use luxel_scenes::check::{Severity, report};
use luxel_scenes::{Scene, load};
use luxel_solver::audit;
use luxel_solver::world::World;
use std::path::PathBuf;

/// Name everything suspicious about a scene
///
/// What the reader put right, what is odd about geometry, materials, lights and units, and what rays
/// find (backs of faces in the light, cameras and lights inside solids), one line each, named by
/// object and face. A warning is hardly ever meant; a note often is.
#[derive(clap::Args)]
pub(super) struct Check {
    /// Scene file (.toml), or geometry (.obj, .gltf, .glb)
    scene: PathBuf,

    /// Exit with code 5 when there is a warning
    #[arg(long)]
    strict: bool,
}

impl Check {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let loaded = load(&self.scene)?;
        let corrected = loaded.warnings.iter().map(ToString::to_string);
        let suspicious = report(&loaded.scene);
        let mut findings: Vec<(Severity, String)> = corrected
            .map(|text| (Severity::Warning, text))
            .chain(suspicious.iter().map(|f| (f.severity(), f.to_string())))
            .chain(session.context.common.install(|| seen(&loaded.scene))?)
            .collect();
        findings.sort_by_key(|(severity, _)| std::cmp::Reverse(*severity));
        let count = |severity| findings.iter().filter(|(s, _)| *s == severity).count();
        let (warnings, notes) = (count(Severity::Warning), count(Severity::Note));

        let scene = &loaded.scene;
        let text = if session.context.common.json {
            let finding = |(severity, message): &(Severity, String)| {
                serde_json::json!({
                    "severity": name(*severity),
                    "message": message,
                })
            };
            serde_json::to_string_pretty(&serde_json::json!({
                "scene": scene.name,
                "faces": scene.faces.len(),
                "objects": scene.objects.len(),
                "lights": scene.lights.len(),
                "warnings": warnings,
                "notes": notes,
                "findings": findings.iter().map(finding).collect::<Vec<_>>(),
            }))?
        } else if findings.is_empty() {
            "nothing suspicious".to_owned()
        } else {
            let line =
                |(severity, text): &(Severity, String)| format!("{}: {text}", name(*severity));
            findings.iter().map(line).collect::<Vec<_>>().join("\n")
        };
        session.print(&text)?;
        session.context.reporter.note(format_args!(
            "{}: {} faces, {warnings} warnings, {notes} notes",
            scene.name,
            scene.faces.len()
        ));
        if self.strict && warnings > 0 {
            return Ok(ExitCode::LimitExceeded);
        }
        Ok(ExitCode::Ok)
    }
}

/// What rays find, and cameras that make no rays.
fn seen(scene: &Scene) -> Vec<(Severity, String)> {
    let world = World::new(scene);
    let mut findings = Vec::new();
    let mut views = Vec::new();
    for camera in &scene.cameras {
        match CameraFrame::new(camera, camera.size) {
            Ok(frame) => views.push(view(&world, &camera.name, &frame)),
            Err(error) => findings.push((Severity::Warning, error.to_string())),
        }
    }
    let by_rays = audit::report(&world, &views);
    findings.extend(by_rays.iter().map(|f| (f.severity(), f.to_string())));
    findings
}

fn name(severity: Severity) -> &'static str {
    match severity {
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}
