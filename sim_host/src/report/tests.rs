use super::*;
use crate::whole_file::tests::folder;

/// A run made of sines: nothing in it is simulated.
fn run() -> RunReport {
    let cycle = |at: usize| {
        let t = at as f64 * 0.005;
        let station = (0.3 * (t - 1.0)).clamp(0.0, 1.1);
        let joint = |axis: usize| (0.3 + 0.1 * axis as f64) * (1.5 * t + axis as f64).sin();
        let lag = |axis: usize| 4e-4 * (9.0 * t + axis as f64).sin() + 2e-4 * (61.0 * t).sin();
        let sealing = station > 0.0 && station < 1.1;
        CycleTrace {
            t_s: t,
            station_m: station,
            speed_m_per_s: if sealing {
                0.3 + 0.004 * (40.0 * t).sin()
            } else {
                0.08 * (3.0 * t).sin().abs()
            },
            q_ref: std::array::from_fn(joint),
            q: std::array::from_fn(|axis| joint(axis) - lag(axis)),
            torque_permille: std::array::from_fn(|axis| {
                (500.0 * (1.5 * t + axis as f64).cos() + 40.0 * (90.0 * t).sin()) as i16
            }),
            lateral_mm: 0.16 * (6.0 * t).sin() + 0.09 * (31.0 * t).sin(),
            height_mm: 0.2 * (4.0 * t + 1.0).sin() + 0.05 * (47.0 * t).sin(),
            dispensing: sealing,
            bus_load_percent: 38.2 + if at % 20 == 3 { 2.1 } else { 0.0 } + 0.3 * (200.0 * t).sin(),
            correction_mm: [3.1 * (1.1 * t).sin(), -2.0 * (0.7 * t).cos()],
        }
    };
    let frame = |number: usize| {
        let column = |y: usize| 120.0 + if y < 130 { 14.0 } else { 0.0 } + 0.08 * y as f64 - number as f64;
        let pixel = |at: usize| {
            let (x, y) = ((at % 250) as f64, at / 250);
            let speckle = ((at * 2_654_435_761) >> 7) % 41;
            (20.0 + speckle as f64 + 200.0 * (-(x - column(y)).powi(2) / 8.0).exp()).min(255.0) as u8
        };
        let refused = number % 9 == 4;
        FrameTrace {
            look: Look::Seam,
            cycle: 180 + 20 * number,
            image: GreyImage {
                width: 250,
                height: 250,
                pixels: (0..62_500).map(pixel).collect(),
            },
            found_px: if refused {
                vec![]
            } else {
                vec![(column(130) + 7.0, 130.0)]
            },
            line_px: if refused {
                vec![]
            } else {
                (60..200).step_by(4).map(|y| (column(y), y as f64)).collect()
            },
            verdict: if refused {
                "refused: two lines".into()
            } else {
                format!("sure, quality {}", 200 + number)
            },
        }
    };
    let figure = |name: &str, value: &str, unit: &str, bar: &str| Figure {
        name: name.into(),
        value: value.into(),
        unit: unit.into(),
        bar: bar.into(),
        paper: String::new(),
    };
    RunReport {
        title: "Sealing of the panel at 0.3 m/s".into(),
        succeeded: true,
        summary: "1.10 m sealed in 4.9 s. Every cycle while the dispenser was on stayed within 0.6 mm of the seam."
            .into(),
        facts: [
            ("seed", "1"),
            ("path", "panel"),
            ("joint", "crank"),
            ("surface", "moderate"),
            ("log hash", "9f0c22d1b7a4e35c"),
        ]
        .map(|(name, value)| (name.into(), value.into()))
        .into(),
        figures: vec![
            figure("lateral error, rms", "0.13", "mm", "≤ 0.15"),
            figure("lateral error, 99.9 %", "0.25", "mm", "≤ 0.4"),
            figure("lateral error, greatest", "0.26", "mm", "≤ 0.6"),
            figure("height error, greatest", "0.25", "mm", "≤ 0.6"),
            figure("bus load, greatest", "40.6", "%", "≤ 45"),
        ],
        cycles: (0..1200).map(cycle).collect(),
        frames: (0..38).map(frame).collect(),
    }
}

#[test]
fn the_report_is_one_file_that_refers_to_nothing_outside_it() {
    let folder = folder("report");
    let path = write(&run(), &folder.join("out")).expect("written");
    let html = std::fs::read_to_string(&path).expect("readable");
    assert_eq!(path, folder.join("out/report.html"));
    let links = html.replace("http://www.w3.org/2000/svg", "");
    assert!(!links.contains("http") && !links.contains("<script") && !links.contains("<link"));
    assert_eq!(html.matches("<image ").count(), 24, "frames");
    assert_eq!(
        html.matches("href=\"data:image/png;base64,iVBORw0KGgo").count(),
        24,
        "PNG data"
    );
    assert_eq!(
        html.matches("</svg>").count(),
        24 + 2 + 1 + 1 + 12 + 1 + 1 + 1,
        "frames and charts"
    );
    assert!(html.len() < 4_000_000, "{} bytes", html.len());
}

#[test]
fn a_run_that_failed_before_its_first_cycle_has_a_report_too() {
    let report = RunReport {
        summary: "axis 3: <following error> & stop".into(),
        ..RunReport::default()
    };
    let html = page::html(&report).expect("drawn");
    assert!(html.contains("axis 3: &lt;following error&gt; &amp; stop") && html.contains("0 of 0 exposures"));
    assert!(html.contains("failed") && !html.contains("NaN"));
}
