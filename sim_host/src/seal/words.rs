//! Sealing in words: its figures against the bars and what the paper says, and the sensor's refusals.

use super::score::{Bars, SealScore};
use crate::campaign::words::{Figure, UNPUBLISHED, figure, head, most, page, tail};
use firmware::job::start_pose::StartRefusal;
use firmware::vision::sensor::Refusal;
use firmware::vision::start::GreyRefusal;
use hal::camera::NO_IMAGE;

/// The figures of a score.
pub fn figures(score: &SealScore) -> Vec<Figure> {
    let bars = Bars::at(score.tally.speed_m_per_s);
    let mm = |name: &str, value: f64, bar: Option<f64>, paper: &str| {
        figure(name, format!("{value:.3}"), "mm", most(bar), paper)
    };
    let taught = "±1 (taught path at 0.02 m/s)";
    let accel = format!("{:.1}", score.joint_accel_max_rad_per_s2);
    let lost = format!("{:.2}", score.time_lost_max_s);
    let mut rows = head(&score.tally, "0.3 (straight seam)").to_vec();
    rows.extend([
        mm(
            "lateral error, rms",
            score.lateral_rms_mm,
            bars.lateral_rms,
            UNPUBLISHED,
        ),
        mm(
            "lateral error, 99.9 %",
            score.lateral_p999_mm,
            bars.lateral_p999,
            UNPUBLISHED,
        ),
        mm(
            "lateral error, max",
            score.lateral_max_mm,
            Some(bars.lateral_max),
            taught,
        ),
        mm("height error, max", score.height_max_mm, bars.height_max, UNPUBLISHED),
        figure(
            "sightings of the seam, by each slit",
            score.seam_frames,
            "",
            "",
            "one in 100 ms",
        ),
        figure("  of these refused", score.seam_refused, "", "", UNPUBLISHED),
        figure(
            "corrections wrong by > 0.5 mm, and used",
            score.seam_wrong_unflagged,
            "",
            "0",
            UNPUBLISHED,
        ),
        figure("joint acceleration, max", accel, "rad/s²", "", UNPUBLISHED),
        figure("time lost to bends and corners, max", lost, "s", "", UNPUBLISHED),
    ]);
    if let Some(off) = score.second_arm_max_mm {
        rows.push(mm("second arm's tip off its reference, max", off, None, ""));
    }
    rows.extend(tail(&score.tally, score.bus_load_bar));
    if let Some(camera) = &score.camera {
        let count = |name: &str, value: u64, bar: &str| figure(name, value, "instructions", bar, "");
        rows.extend([
            count(
                "camera: vision of one image, median",
                camera.vision_median_instructions,
                "",
            ),
            count(
                "  vision of one image, max",
                camera.vision_max_instructions,
                &format!("≤ {}", score.vision_bar),
            ),
            figure("  stack, deepest", camera.stack_painted_bytes, "bytes", "", ""),
        ]);
    }
    rows
}

/// The table of a campaign, its failures and its hash.
pub fn score_table(score: &SealScore) -> String {
    let SealScore {
        path,
        joint,
        surface,
        hold,
        ..
    } = score;
    let title = format!("{path} path, {joint} joint, {surface} surface, {hold} hold");
    page(
        &title,
        figures(score),
        &score.tally,
        &score.shortfalls(),
        score.passed(),
    )
}

/// Why there is no start pose, in words.
pub fn start_refusal(refusal: StartRefusal) -> &'static str {
    match refusal {
        StartRefusal::Unseen => "the camera refused an image",
        StartRefusal::Incomplete => "a grey image and two light sections are needed",
        StartRefusal::TooMany => "more light sections than there is room for",
        StartRefusal::TooNear => "the light sections are too near to each other",
        StartRefusal::OffSeam => "a light section's seam does not lie on the grey image's",
        StartRefusal::Uneven => "the light sections do not lie in one plane",
        StartRefusal::TooFlat => "the sheet is seen at too flat an angle",
    }
}

/// A refusal of the camera node, by its number, in words.
pub fn refusal(number: u8) -> &'static str {
    const LINES: [(u8, &str); 11] = [
        (Refusal::NoLine as u8, "no line runs through the image"),
        (
            Refusal::TwoLines as u8,
            "two lines, and no telling which is a reflection",
        ),
        (Refusal::Glare as u8, "too much of the line is saturated"),
        (Refusal::NoStep as u8, "the line is whole, but shows no joint"),
        (
            Refusal::Unclear as u8,
            "there may be a joint, but where is not clear enough",
        ),
        (
            Refusal::AtEdge as u8,
            "the joint lies too near to the end of the line or of the image",
        ),
        (GreyRefusal::NoSeam as u8, "no straight edge in the seam's direction"),
        (GreyRefusal::NoEnd as u8, "no straight edge across the seam"),
        (GreyRefusal::NoCorner as u8, "no edges that meet as seam and end do"),
        (GreyRefusal::Unclear as u8, "two places look like the seam's end"),
        (
            GreyRefusal::AtBorder as u8,
            "the seam's end lies too near to the image's border",
        ),
    ];
    match LINES.iter().find(|(refusal, _)| *refusal == number) {
        Some((_, line)) => line,
        None if number == NO_IMAGE => "no image came",
        None => "refused for a reason without a name",
    }
}
