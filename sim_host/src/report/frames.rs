//! Camera frames with what was found drawn over them.
//!
//! The frame is a PNG of its own pixels; line centres and seam cross are vectors above it, because what was found is
//! finer than a pixel.

use std::fmt::Write;

use anyhow::Result;

use hal::process::Look;

use super::escape::escape;
use super::{FrameTrace, RunReport, data_uri};

/// Frames shown at most; a page of all frames of a long run would be slow to open.
const MOST: usize = 24;
/// And of these in grey: most starts take two or three.
const MOST_GREY: usize = 4;
/// Half the length of the seam cross, px.
const CROSS_PX: f64 = 12.0;

/// Indices of the frames to show: the start in grey, all refused ones as far as they fit, and of the others an even choice.
pub fn chosen(frames: &[FrameTrace]) -> Vec<usize> {
    let (grey, others): (Vec<usize>, Vec<usize>) =
        (0..frames.len()).partition(|at| frames[*at].look == Look::StartGrey);
    let (refused, found): (Vec<usize>, Vec<usize>) = others.into_iter().partition(|at| frames[*at].found_px.is_empty());
    let mut chosen = evenly(&grey, MOST_GREY);
    let places = MOST - chosen.len();
    // A third of the places is kept for the others, so that a run with many refusals shows both.
    chosen.extend(evenly(&refused, places - found.len().min(places / 3)));
    chosen.extend(evenly(&found, MOST - chosen.len()));
    chosen.sort_unstable();
    chosen
}

/// At most `most` of `items`, evenly spread.
fn evenly(items: &[usize], most: usize) -> Vec<usize> {
    let count = items.len().min(most);
    (0..count).map(|at| items[at * items.len() / count]).collect()
}

/// A frame as an HTML figure.
pub fn figure(report: &RunReport, frame: &FrameTrace) -> Result<String> {
    let (width, height) = (frame.image.width, frame.image.height);
    let mut html = String::from("<figure class=\"frame\">");
    // Pixel (0, 0) has its centre at the origin, so the image begins half a pixel before it.
    write!(html, "<svg viewBox=\"-0.5 -0.5 {width} {height}\" role=\"img\">")?;
    let uri = data_uri::png(&frame.image.to_png()?);
    write!(
        html,
        "<image x=\"-0.5\" y=\"-0.5\" width=\"{width}\" height=\"{height}\" href=\"{uri}\"/>"
    )?;
    for (x, y) in &frame.line_px {
        write!(html, "<circle class=\"line\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"1.1\"/>")?;
    }
    for (x, y) in &frame.found_px {
        let (left, right, top, bottom) = (x - CROSS_PX, x + CROSS_PX, y - CROSS_PX, y + CROSS_PX);
        let path = format!("M{left:.2} {y:.2}H{right:.2}M{x:.2} {top:.2}V{bottom:.2}");
        write!(
            html,
            "<path class=\"halo\" d=\"{path}\"/><path class=\"seam\" d=\"{path}\"/>"
        )?;
    }
    write!(html, "</svg><figcaption>")?;
    match report.cycles.get(frame.cycle) {
        Some(cycle) => write!(html, "<b>{:.3} s, {:.3} m</b>", cycle.t_s, cycle.station_m)?,
        None => write!(html, "<b>cycle {}</b>", frame.cycle)?,
    }
    let class = if frame.found_px.is_empty() { "refused" } else { "found" };
    write!(
        html,
        "<span class=\"{class}\">{}</span></figcaption></figure>",
        escape(&frame.verdict)
    )?;
    Ok(html)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::GreyImage;

    fn frames(found: usize, refused: usize) -> Vec<FrameTrace> {
        let frame = |at: usize| FrameTrace {
            look: Look::Seam,
            cycle: at,
            image: GreyImage {
                width: 1,
                height: 1,
                pixels: vec![0],
            },
            found_px: if at < refused { vec![] } else { vec![(0.0, 0.0)] },
            line_px: vec![],
            verdict: String::new(),
        };
        (0..found + refused).map(frame).collect()
    }

    #[test]
    fn few_frames_are_all_shown() {
        assert_eq!(chosen(&frames(4, 2)), [0, 1, 2, 3, 4, 5]);
        assert!(chosen(&[]).is_empty());
    }

    #[test]
    fn the_start_in_grey_is_shown_however_many_other_frames_there_are() {
        let mut frames = frames(60, 40);
        for at in [47, 48, 70] {
            frames[at].look = Look::StartGrey;
        }
        let chosen = chosen(&frames);
        assert_eq!(chosen.len(), 24);
        assert!([47, 48, 70].iter().all(|at| chosen.contains(at)), "{chosen:?}");
    }

    #[test]
    fn of_many_frames_24_are_shown_the_refused_ones_first_but_never_alone() {
        let some = chosen(&frames(97, 3));
        assert_eq!((some.len(), &some[..4]), (24, &[0, 1, 2, 3][..]));
        let many = chosen(&frames(50, 50));
        assert_eq!((many.len(), many.iter().filter(|at| **at < 50).count()), (24, 16));
    }
}
