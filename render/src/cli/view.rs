//! `luxel view`: a page that shows a bake.

use super::Session;
use super::exit::{ExitCode, Failure};
use crate::files::Output;
use crate::lightmap::page::{Content, page};
use crate::serve::Server;
use std::path::PathBuf;

/// Write a page that shows a bake in a browser
///
/// One HTML file that needs neither a server nor a network: the scene with its lightmaps, the light alone, albedo, normals, charts,
/// which texels are lit, and their error. With --serve no file is written, and a browser on this machine can ask for the page.
#[derive(clap::Args)]
pub(super) struct View {
    /// Folder that `luxel bake` wrote
    folder: PathBuf,

    /// Page to write [default: view.html in the folder]
    #[arg(short, long, value_name = "OUT.html")]
    output: Option<PathBuf>,

    /// Show the page to browsers on this machine until Ctrl-C, and print where it is
    #[arg(long, conflicts_with = "output")]
    serve: bool,

    /// Port to serve at [default: one that is free]
    #[arg(long, value_name = "N", requires = "serve", value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
}

impl View {
    pub(super) fn run(self, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let content = Content::read(&self.folder)?;
        if self.serve {
            return self.serve(&content, session);
        }
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

    /// Shows the page until the user ends it, which is no interruption: there is nothing else that could end it.
    fn serve(&self, content: &Content, session: &mut Session<'_>) -> Result<ExitCode, Failure> {
        let server = Server::new(self.port.unwrap_or(0), page(content)?.into_bytes())?;
        let interrupt = session.context.interrupt.clone();
        let _listening = interrupt.listen();
        let result = if session.context.common.json {
            serde_json::to_string_pretty(&serde_json::json!({"url": server.url()}))?
        } else {
            server.url()
        };
        session.print(&result)?;
        session
            .context
            .reporter
            .note("open it in a browser on this machine; Ctrl-C ends it");
        server.run(|| interrupt.is_set())?;
        Ok(ExitCode::Ok)
    }
}
