//! `luxel view`: a page that shows a bake.

use super::Session;
use super::exit::{ExitCode, Failure};
use crate::files::Output;
use crate::lightmap::page::{Content, page};
use std::path::PathBuf;

/// Write a page that shows a bake in a browser
///
/// One HTML file that needs neither a server nor a network: the scene with its lightmaps, the light alone, albedo, normals, charts,
/// which texels are lit, and their error.
#[derive(clap::Args)]
pub(super) struct View {
    /// Folder that `luxel bake` wrote
    folder: PathBuf,

    /// Page to write [default: view.html in the folder]
    #[arg(short, long, value_name = "OUT.html")]
    output: Option<PathBuf>,
}

impl View {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let content = Content::read(&self.folder)?;
        let path = self.output.unwrap_or_else(|| self.folder.join("view.html"));
        let output = Output::prepare(&path)?;
        let text = page(&content)?;
        output.write(text.as_bytes())?;
        session.context.reporter.note(format_args!(
            "{} page(s) of lightmaps, {:.1} MB; open it in a browser",
            content.pages.len(),
            text.len() as f64 / 1e6
        ));
        let shown = path.display().to_string();
        let result = if session.context.common.json {
            serde_json::to_string_pretty(&serde_json::json!({"file": shown, "bytes": text.len()}))?
        } else {
            shown
        };
        session.print(&result)?;
        Ok(ExitCode::Ok)
    }
}
