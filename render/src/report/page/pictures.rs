//! Where in the picture the error is.

use super::{percent, signed};
use crate::report::false_colour::Gallery;
use crate::report::html::{base64, escape};
use crate::report::study::{Quantity, Study};

pub(super) fn section(study: &Study) -> String {
    let gallery = &study.pictures;
    if let Some(reason) = &gallery.absent {
        return format!("<p class=\"absent\">No pictures. {}</p>\n", escape(reason));
    }
    let what = match study.quantity {
        Quantity::Irradiance => "Irradiance at what the pixel centres of the camera see",
        Quantity::Radiance { .. } => "Radiance of the pixels",
    };
    let title = "the reference, tone-mapped";
    let mut figures = figure(gallery.size, &gallery.reference, title, title);
    for shown in &gallery.shown {
        let title = shown.family.title();
        let error = shown.error.map_or(String::new(), |error| {
            format!(
                ": nRMSE {}, relRMSE {}, bias {}",
                percent(error.nrmse),
                percent(error.rel_rmse),
                signed(error.bias)
            )
        });
        let caption = format!("<strong>{title}</strong>, {}{error}", escape(&shown.budget));
        let alt = format!("error of {title}");
        figures.push_str(&figure(gallery.size, &shown.png, &alt, &caption));
    }
    let limit = percent(gallery.limit);
    format!(
        "<p>{what}: the signed error over the mean of the reference, the same scale in all pictures.{}</p>\n\
         <div class=\"scale\"><span>too dark, −{limit}</span><img src=\"data:image/png;base64,{}\" \
         width=\"201\" height=\"1\" alt=\"scale from blue over white to orange\"><span>+{limit}, too \
         bright</span></div>\n<div class=\"gallery\">\n{figures}</div>\n",
        noise(gallery),
        base64(&gallery.scale),
    )
}

fn figure([width, height]: [usize; 2], png: &[u8], alt: &str, caption: &str) -> String {
    format!(
        "<figure><img src=\"data:image/png;base64,{}\" width=\"{width}\" height=\"{height}\" alt=\"{alt}\">\
         <figcaption>{caption}</figcaption></figure>\n",
        base64(png)
    )
}

/// What of the grain is the reference's.
fn noise(gallery: &Gallery) -> String {
    match (gallery.noise, gallery.own_paths) {
        (Some(noise), Some(paths)) if noise > 0.0 => format!(
            " The pictures have a reference of their own, {paths} paths a pixel; its noise, {}, shows as grain \
             in all of them and is subtracted from the figures.",
            percent(noise)
        ),
        (Some(noise), None) if noise > 0.0 => format!(
            " The noise of the reference, {}, shows as grain in all of them.",
            percent(noise)
        ),
        (None, _) => {
            " The noise of the reference, which its file does not state, shows in all of them."
                .to_owned()
        }
        _ => String::new(),
    }
}
