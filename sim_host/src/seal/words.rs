//! The figures in words: tables for the terminal and for the report, against the bars and what the paper says.

use super::score::{BUS_LOAD_MAX, Bars, SealScore};
use crate::table::Table;
use firmware::job::start_pose::StartRefusal;
use firmware::vision::sensor::Refusal;
use firmware::vision::start::GreyRefusal;
use hal::camera::NO_IMAGE;

/// One figure: what, value, unit, bar (empty for none), the paper's (empty where it prints none).
pub type Figure = [String; 5];

/// The figures of a score.
pub fn figures(score: &SealScore) -> Vec<Figure> {
    let bars = Bars::at(score.speed_m_per_s);
    let row = |name: &str, value: String, unit: &str, bar: String, paper: &str| {
        [name.into(), value, unit.into(), bar, paper.into()]
    };
    let most = |bar: f64| format!("≤ {bar}");
    let if_any = |bar: Option<f64>| bar.map_or_else(String::new, most);
    let mut rows = vec![
        row(
            "trials succeeded",
            format!("{} of {}", score.succeeded, score.trials),
            "",
            "all".into(),
            "not published",
        ),
        row(
            "speed along the seam",
            format!("{:.2}", score.speed_m_per_s),
            "m/s",
            String::new(),
            "0.3 (straight seam)",
        ),
        row(
            "lateral error, rms",
            format!("{:.3}", score.lateral_rms_mm),
            "mm",
            if_any(bars.lateral_rms),
            "not published",
        ),
        row(
            "lateral error, 99.9 %",
            format!("{:.3}", score.lateral_p999_mm),
            "mm",
            if_any(bars.lateral_p999),
            "not published",
        ),
        row(
            "lateral error, max",
            format!("{:.3}", score.lateral_max_mm),
            "mm",
            most(bars.lateral_max),
            "±1 (taught path at 0.02 m/s)",
        ),
        row(
            "height error, max",
            format!("{:.3}", score.height_max_mm),
            "mm",
            if_any(bars.height_max),
            "not published",
        ),
        row(
            "frames of the seam",
            score.seam_frames.to_string(),
            "",
            String::new(),
            "one in 100 ms",
        ),
        row(
            "  of these refused",
            score.seam_refused.to_string(),
            "",
            String::new(),
            "not published",
        ),
        row(
            "  wrong and used",
            score.seam_wrong_unflagged.to_string(),
            "",
            "0".into(),
            "not published",
        ),
        row(
            "joint acceleration, max",
            format!("{:.1}", score.joint_accel_max_rad_per_s2),
            "rad/s²",
            String::new(),
            "not published",
        ),
        row(
            "control cycles of 5 ms",
            score.cycles.to_string(),
            "",
            String::new(),
            "5 ms",
        ),
        row(
            "deadlines missed",
            score.deadline_misses.to_string(),
            "",
            "0".into(),
            "not published",
        ),
        row(
            "bus load, busiest cycle",
            format!("{:.1}", score.bus_load_max_percent),
            "%",
            if score.errors_injected {
                String::new()
            } else {
                most(BUS_LOAD_MAX)
            },
            "no bus",
        ),
        row(
            "simulated over real time",
            format!("{:.0}", score.sim_speed_x),
            "×",
            if score.target.is_some() { "≥ 1" } else { "≥ 20" }.into(),
            "",
        ),
    ];
    if let Some(target) = &score.target {
        let count = |name: &str, value: u64, bar: &str| row(name, value.to_string(), "instructions", bar.into(), "");
        rows.extend([
            count(
                "Cortex-M4F: control cycle, median",
                target.cycle_median_instructions,
                "≤ 6000",
            ),
            count("  control cycle, max", target.cycle_max_instructions, "≤ 10000"),
            count("  SYNC event, max", target.sync_max_instructions, ""),
            count("  timer to task, max", target.latency_max_instructions, ""),
            row(
                "  start to start, error, max",
                format!("{:.2}", target.start_error_max_us),
                "µs",
                "0".into(),
                "",
            ),
            row(
                "  stack, deepest in a cycle",
                target.stack_painted_bytes.to_string(),
                "bytes",
                String::new(),
                "",
            ),
            row(
                "  stack, deepest at boot",
                target.stack_boot_bytes.to_string(),
                "bytes",
                String::new(),
                "",
            ),
        ]);
    }
    if let Some(camera) = &score.camera {
        let count = |name: &str, value: u64, unit, bar: &str| row(name, value.to_string(), unit, bar.into(), "");
        rows.extend([
            count(
                "camera: vision of one image, median",
                camera.vision_median_instructions,
                "instructions",
                "",
            ),
            count(
                "  vision of one image, max",
                camera.vision_max_instructions,
                "instructions",
                "≤ 600000",
            ),
            count("  stack, deepest", camera.stack_painted_bytes.into(), "bytes", ""),
        ]);
    }
    rows
}

/// The table of a campaign, its failures and its hash.
pub fn score_table(score: &SealScore) -> String {
    let mut table = Table::new(["figure", "value", "unit", "bar", "paper 003"]);
    for figure in figures(score) {
        table.row(figure);
    }
    let mut text = format!(
        "seal: {} path, {} joint, {} surface, {} hold, seed {}\n{table}",
        score.path, score.joint, score.surface, score.hold, score.seed
    );
    for failure in &score.failures {
        text += &format!("failed: seed {}: {}\n", failure.seed, failure.reason);
    }
    for shortfall in score.shortfalls() {
        text += &format!("over its bar: {shortfall}\n");
    }
    text += &format!(
        "{}, hash {}\n",
        if score.passed() { "passed" } else { "did not pass" },
        score.log_hash
    );
    text
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
        StartRefusal::Unsteady => "two measurements in succession differ",
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
