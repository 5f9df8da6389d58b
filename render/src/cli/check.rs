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
/// find (backs of faces in the light, cameras and lights inside solids, gaps that light leaks
/// through, openings), one line each, named by object and face. A warning is hardly ever meant; a
/// note often is. With --json, what rays find has a kind, objects, a position in metres and a
/// fraction besides its message.
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
        let mut findings: Vec<Line> = corrected
            .map(|text| Line::new(Severity::Warning, text))
            .chain(
                suspicious
                    .iter()
                    .map(|f| Line::new(f.severity(), f.to_string())),
            )
            .chain(session.context.common.install(|| seen(&loaded.scene))?)
            .collect();
        findings.sort_by_key(|line| std::cmp::Reverse(line.severity));
        let count = |severity| findings.iter().filter(|f| f.severity == severity).count();
        let (warnings, notes) = (count(Severity::Warning), count(Severity::Note));

        let scene = &loaded.scene;
        let text = if session.context.common.json {
            serde_json::to_string_pretty(&serde_json::json!({
                "scene": scene.name,
                "faces": scene.faces.len(),
                "objects": scene.objects.len(),
                "lights": scene.lights.len(),
                "warnings": warnings,
                "notes": notes,
                "findings": findings.iter().map(Line::to_json).collect::<Vec<_>>(),
            }))?
        } else if findings.is_empty() {
            "nothing suspicious".to_owned()
        } else {
            let lines: Vec<String> = findings.iter().map(Line::to_string).collect();
            lines.join("\n")
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

/// A finding as it is printed.
struct Line {
    severity: Severity,
    message: String,
    /// What rays found, for programs.
    found: Option<audit::Finding>,
}

impl Line {
    fn new(severity: Severity, message: String) -> Self {
        Self {
            severity,
            message,
            found: None,
        }
    }

    fn to_json(&self) -> serde_json::Value {
        let mut value = serde_json::json!({
            "severity": name(self.severity),
            "message": self.message,
        });
        if let Some(found) = &self.found {
            value["kind"] = found.kind().into();
            value["objects"] = found.objects().into();
            value["position"] = serde_json::json!(found.position().map(|p| p.to_array()));
            value["fraction"] = serde_json::json!(found.fraction());
        }
        value
    }
}

impl std::fmt::Display for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", name(self.severity), self.message)
    }
}

/// What rays find, and cameras that make no rays.
fn seen(scene: &Scene) -> Vec<Line> {
    let world = World::new(scene);
    let mut findings = Vec::new();
    let mut views = Vec::new();
    for camera in &scene.cameras {
        match CameraFrame::new(camera, camera.size) {
            Ok(frame) => views.push(view(&world, &camera.name, &frame)),
            Err(error) => findings.push(Line::new(Severity::Warning, error.to_string())),
        }
    }
    let by_rays = audit::report(&world, &views).into_iter();
    findings.extend(by_rays.map(|found| Line {
        severity: found.severity(),
        message: found.to_string(),
        found: Some(found),
    }));
    findings
}

fn name(severity: Severity) -> &'static str {
    match severity {
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}
