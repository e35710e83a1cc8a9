//! The options of `render` that show it while it runs, and end it at a given error.

use super::Failure;
use clap::Args;
use lucerna_core::interfaces::Sampler;
use lucerna_core::math::UVec2;
use std::path::{Path, PathBuf};

use crate::view::tev::{self, Tev};
use crate::view::{Facts, Page, Reference, Views, Wanted};

/// Most samples per pixel of a run that ends at an error and has no other limit.
pub const MOST_SPP: u32 = 1 << 20;

/// Options of `render` that look at the picture between passes.
#[derive(Args)]
pub struct ViewArguments {
    /// Print the error against this picture at 1, 2, 4, … samples per pixel and at the end
    #[arg(long, value_name = "FILE", conflicts_with = "pixel")]
    error_vs: Option<PathBuf>,

    /// End when the estimated relative mean squared error is so small; never before 16 samples per pixel. --spp or
    /// --seconds then are the most
    #[arg(long, value_name = "X", value_parser = error, conflicts_with = "pixel")]
    pub target_relmse: Option<f64>,

    /// Send the picture to the viewer tev as it forms
    #[arg(long, value_name = "HOST:PORT", value_parser = address, conflicts_with = "pixel")]
    tev: Option<String>,

    /// Show the picture as it forms, on a page of this port of 127.0.0.1; 0 takes a free one
    #[arg(long, value_name = "PORT", conflicts_with = "pixel")]
    serve: Option<u16>,

    /// Keep the page when the render is over, until Ctrl-C
    #[arg(long, requires = "serve")]
    pub serve_keep: bool,
}

fn error(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}

fn address(text: &str) -> Result<String, String> {
    tev::check(text).map(|()| text.to_owned())
}

/// What is rendered, for those who show it.
pub struct Rendered<'a> {
    /// Name of the scene.
    pub scene: String,
    /// Name of the integrator.
    pub integrator: &'a str,
    /// Where random numbers come from.
    pub sampler: &'a dyn Sampler,
    /// Size of the whole film in pixels.
    pub film: UVec2,
    /// Offset and size of the part that is rendered.
    pub window: (UVec2, UVec2),
    /// Where the picture goes.
    pub output: &'a Path,
    /// No bar and no table.
    pub quiet: bool,
}

impl ViewArguments {
    /// Opens all that is asked for.
    pub fn open(&self, of: &Rendered<'_>) -> Result<Views, Failure> {
        let size = of.window.1.to_array();
        let reference = match &self.error_vs {
            Some(path) => Some(Reference::read(path, of.film, of.window).map_err(Failure::new)?),
            None => None,
        };
        let page = match self.serve {
            Some(port) => Some(self.page(port, of, size)?),
            None => None,
        };
        let name = of.output.display().to_string();
        let tev = match &self.tev {
            Some(address) => {
                Some(Tev::connect(address, &name, |warning| eprintln!("{warning}")).map_err(Failure::new)?)
            }
            None => None,
        };
        let points = of.sampler.point_set(0, of.sampler.round_spp(1), of.window.1);
        let wanted =
            Wanted { reference, target: self.target_relmse, tev, page, independent: points.is_none(), quiet: of.quiet };
        Ok(Views::new(wanted, size))
    }

    fn page(&self, port: u16, of: &Rendered<'_>, size: [u32; 2]) -> Result<Page, Failure> {
        let facts = Facts {
            scene: of.scene.clone(),
            integrator: of.integrator.to_owned(),
            size,
            target: self.target_relmse,
            reference: self.error_vs.as_ref().map(|path| path.display().to_string()),
            output: of.output.display().to_string(),
        };
        let page = Page::serve(port, facts).map_err(|e| Failure::new(format!("--serve: {e}")))?;
        // Told under --quiet too: a port that was chosen here is known from nowhere else.
        eprintln!("the picture forms at {}", page.url());
        Ok(page)
    }
}
