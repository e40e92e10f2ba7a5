//! The section "Data and model in pictures": recorded and simulated positions over frames of a video, or a photograph.
//!
//! Input: the overlays of the plot data, whose places are pixels of their picture. Overlays of one recording are one
//! figure; radio buttons (CSS, no script) select the picture, and boxes show and hide data and model. Pictures are
//! embedded as data URIs, up to [`MOST_BYTES`] in total on a page; further ones are left out with a note. So are
//! pictures that the report does not have, as one that was read from JSON. Output: HTML.

use crate::fit::{ImageOverlay, MOST_IMAGE_BYTES as MOST_BYTES};
use crate::page::html::{escaped, note, subsection};
use crate::page::number::{quantity, three_digits};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::path::Path;

/// Most pictures of one recording: `page.css` has a rule for each.
const MOST_PICTURES: usize = 8;
/// Radius of a marker over the longer side of the picture.
const RADIUS: f64 = 0.007;

/// The content of the section, HTML; empty without overlays.
pub(super) fn overlays(all: &[ImageOverlay]) -> String {
    let is_same = |a: &ImageOverlay, b: &ImageOverlay| {
        let is_one_place = a.pattern == b.pattern && a.size == b.size && a.pixel == b.pixel;
        a.experiment == b.experiment && is_one_place && a.held_out == b.held_out
    };
    let mut rest = MOST_BYTES;
    let groups = all.chunk_by(is_same).enumerate();
    groups.map(|(k, group)| recording(k, group, &mut rest)).collect()
}

/// The figure of one recording, number `index` on the page, HTML. `rest` is the number of bytes of pictures that the
/// page may still embed.
fn recording(index: usize, group: &[ImageOverlay], rest: &mut u64) -> String {
    let mut shown: Vec<(&ImageOverlay, String)> = Vec::new();
    for overlay in group.iter().take(MOST_PICTURES) {
        let Some(image) = &overlay.image else { continue };
        let size = image.bytes.len() as u64;
        if size <= *rest {
            *rest -= size;
            let encoded = STANDARD.encode(&image.bytes);
            shown.push((overlay, format!("data:{};base64,{encoded}", image.media_type)));
        }
    }
    // The picture with the largest distance is shown first.
    let first = shown.iter().position(|(own, _)| own.is_worst).unwrap_or(0);
    let mut choice = String::new();
    for (k, (overlay, _)) in shown.iter().enumerate().filter(|_| shown.len() > 1) {
        let checked = if k == first { " checked" } else { "" };
        let id = format!("overlay-{index}-{k}");
        choice += &format!(
            "<input type=\"radio\" name=\"overlay-{index}\" id=\"{id}\"{checked}><label for=\"{id}\">{}</label>\n",
            picture_name(overlay)
        );
    }
    let boxes = match shown.is_empty() {
        true => String::new(),
        false => format!(
            "<span class=\"layers\"><input type=\"checkbox\" class=\"data\" id=\"overlay-{index}-data\" checked>\
             <label for=\"overlay-{index}-data\">recorded</label><input type=\"checkbox\" class=\"simulation\" \
             id=\"overlay-{index}-model\" checked><label for=\"overlay-{index}-model\">simulated</label></span>\n"
        ),
    };
    let class = if shown.len() > 1 { "overlay" } else { "overlay single" };
    let figures: String = shown.iter().map(|(overlay, uri)| picture(overlay, uri)).collect();
    let left_out = match group.len() - shown.len() {
        0 => String::new(),
        count => note(&format!(
            "{count} of {} pictures are not shown: a page has pictures of at most {} MB in total, none that cannot be \
             read or have another size, and none if the report was read from JSON.",
            group.len(),
            MOST_BYTES / 1_000_000
        )),
    };
    let Some(overlay) = group.first() else { return String::new() };
    let validation = if overlay.held_out { ", validation" } else { "" };
    let experiment = match overlay.experiment.is_empty() {
        true => String::new(),
        false => format!("{}: ", overlay.experiment),
    };
    let title = format!("{experiment}{}{validation}", overlay.pattern);
    let figures = format!("<div class=\"{class}\">\n{choice}{boxes}{figures}</div>\n");
    subsection(&title, &((if shown.is_empty() { String::new() } else { figures }) + &left_out))
}

/// The label of a picture among those of its recording: its time, with a remark if it has the largest distance. HTML.
fn picture_name(overlay: &ImageOverlay) -> String {
    let time = overlay.time.map_or("at rest".into(), |time| format!("{} s", three_digits(time)));
    if overlay.is_worst { format!("{time} (largest residual)") } else { time }
}

/// One picture with recorded markers as open circles, the simulated rod as a line and simulated markers as crosses,
/// HTML. `uri` is the data URI of the picture.
fn picture(overlay: &ImageOverlay, uri: &str) -> String {
    let [width, height] = overlay.size;
    let radius = RADIUS * f64::from(width.max(height));
    let file = Path::new(&overlay.file).file_name().unwrap_or_default().to_string_lossy();
    let line = |points: &Vec<[f64; 2]>| {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        let points = points.join(" ");
        format!(
            "<polyline class=\"halo\" points=\"{points}\"/><polyline class=\"rod\" points=\"{points}\"/>"
        )
    };
    let circles = |class: &str| {
        let circle = |[x, y]: [f64; 2]| {
            format!("<circle class=\"{class}\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\"/>")
        };
        overlay.markers.iter().map(|marker| circle(marker.recorded)).collect::<String>()
    };
    let arm = 0.8 * radius;
    let crosses = |class: &str| {
        let cross = |[x, y]: [f64; 2]| {
            format!(
                "<path class=\"{class}\" d=\"M{:.2} {y:.2}H{:.2}M{x:.2} {:.2}V{:.2}\"/>",
                x - arm,
                x + arm,
                y - arm,
                y + arm
            )
        };
        overlay.markers.iter().filter_map(|marker| marker.simulated).map(cross).collect::<String>()
    };
    let distance = overlay.rms.map(|rms| {
        let meters = quantity(rms * overlay.pixel, "m");
        format!(" \u{2013} RMS distance of the markers {} px, {meters}", three_digits(rms))
    });
    let crossed = match overlay.rms {
        Some(_) => " <i class=\"cross\">+</i>markers, simulated",
        None => "",
    };
    let label = format!("data and model in {file}");
    // A picture is not higher than the window.
    let ratio = f64::from(width) / f64::from(height.max(1));
    format!(
        "<figure style=\"max-width:calc({ratio:.4}*85vh)\"><svg viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-label=\"{}\"><image href=\"{uri}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\"/>\
         <g class=\"model\">{}{}{}</g><g class=\"recorded\">{}{}</g></svg>\
         <figcaption><i class=\"ring\"></i>markers, recorded <i class=\"stroke model\"></i>rod, simulated{crossed} \
         \u{2013} {}, {}{}</figcaption></figure>\n",
        escaped(&label),
        overlay.rods.iter().filter(|rod| rod.len() > 1).map(line).collect::<String>(),
        crosses("halo"),
        crosses("cross"),
        circles("halo"),
        circles("ring"),
        escaped(&file),
        picture_name(overlay),
        distance.unwrap_or_default(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{ImageFile, OverlayMarker};

    /// An overlay at a time, s, with a picture of this number of bytes.
    fn overlay(time: f64, bytes: usize) -> ImageOverlay {
        let size = [640, 480];
        let marker = OverlayMarker { recorded: [100.0, 50.0], simulated: Some([103.0, 54.0]) };
        let markers = vec![marker];
        ImageOverlay {
            experiment: "<a>".into(),
            pattern: "f{}.png".into(),
            file: "folder/f1.png".into(),
            time: Some(time),
            size,
            pixel: 1e-3,
            rods: vec![vec![[0.0, 0.0], [100.0, 50.0]]],
            rms: ImageOverlay::rms_distance(&markers),
            markers,
            is_worst: time == 0.2,
            held_out: false,
            image: Some(ImageFile { media_type: "image/png", size, bytes: vec![0; bytes] }),
        }
    }

    #[test]
    fn pictures_of_a_page_have_a_limited_size() {
        let all: Vec<ImageOverlay> =
            (0..4).map(|k| overlay(0.1 * f64::from(k), 4_000_000)).collect();
        let html = overlays(&all);
        assert_eq!(html.matches("<image href=\"data:image/png;base64,").count(), 2);
        assert!(html.len() < 11_000_000 && html.contains("2 of 4 pictures are not shown"));
    }

    #[test]
    fn distance_is_that_between_recorded_and_simulated_markers() {
        let html = overlays(&[overlay(0.1, 10), overlay(0.2, 10)]);
        assert!(html.contains("5.00 px, 5.00 mm"), "{html}");
        assert!(html.contains("cx=\"100.00\" cy=\"50.00\"") && html.contains("&lt;a&gt;: f{}.png"));
        assert_eq!(html.matches(" checked>").count(), 3);
        assert!(overlays(&[]).is_empty());
    }

    #[test]
    fn style_has_a_rule_for_each_picture() {
        let rule = |k: usize| format!("input:nth-of-type({k}):checked~figure:nth-of-type({k})");
        let style = include_str!("page.css");
        assert!((1..=MOST_PICTURES).all(|k| style.contains(&rule(k))));
    }
}
