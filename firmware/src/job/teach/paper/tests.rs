//! The published limits of the paper's loop, on an ideal arm and an ideal sensor: the spec's table, chapter 4.

use super::*;
use crate::geometry::trig::sin_cos;
use core::f32::consts::PI;

/// Cycles to a frame, and the period: 100 ms.
const M: u8 = 20;
const PERIOD: f32 = 0.005;
const RADIUS: f32 = 0.150;
const STRAIGHT: f32 = 0.280;
/// Half of the sensor's view across the seam, m (chapter 3: 50 × 30 mm).
const VIEW: f32 = 0.015;

/// The paper's path up to its half circle: 280 mm straight, then R150.
fn seam(s: f32) -> Vector3<f32> {
    let (sin, cos) = sin_cos((s - STRAIGHT).max(0.0) / RADIUS);
    Vector3::new(s.min(STRAIGHT) + RADIUS * sin, RADIUS * (1.0 - cos), 0.0)
}

/// Point of the seam in Σ_S where a slit at `x` lights it, searched from the distance `guess`.
fn lit(sensor: &Pose, x: f32, guess: f32) -> (f32, Vector3<f32>) {
    let into = sensor.inverse();
    let mut s = guess;
    for _ in 0..30 {
        let (here, next) = (into * seam(s), into * seam(s + 1e-3));
        s -= (here.x - x) / ((next.x - here.x) * 1e3);
    }
    (s, into * seam(s))
}

/// Heading lag (°) and lateral lag (mm) at the end of a third of the circle, or the distance (mm) at which the seam left the view.
fn run(speed: f32) -> Result<(f32, f32), f32> {
    let start = Pose::identity();
    let mut law = PaperLaw::new(start);
    let (mut sensor, mut s) = (start, 0.0);
    let frames = ((STRAIGHT + RADIUS * PI * 0.6) / (speed * PERIOD * f32::from(M))) as usize;
    for _ in 0..frames {
        let (ahead_s, ahead) = lit(&sensor, 0.5 * PAIR, s + 0.5 * PAIR);
        let (_, behind) = lit(&sensor, -0.5 * PAIR, s - 0.5 * PAIR);
        s = ahead_s - 0.5 * PAIR;
        if ahead.y.abs() > VIEW || behind.y.abs() > VIEW {
            return Err(s * 1e3);
        }
        law.frame();
        let across = Vector3::new(0.0, 1.0, 0.0);
        if let Some(deviation) = Deviation::of(&ahead, &behind, &across) {
            law.measured(deviation);
        }
        for _ in 0..M {
            sensor = law.advance(speed * PERIOD, M);
        }
    }
    let across = Vector3::new(0.0, 1.0, 0.0);
    let (_, ahead) = lit(&sensor, 0.5 * PAIR, s + 0.5 * PAIR);
    let (_, behind) = lit(&sensor, -0.5 * PAIR, s - 0.5 * PAIR);
    let heading = Deviation::of(&ahead, &behind, &across).map_or(f32::NAN, |deviation| deviation.turn.z);
    // The seam itself, not the chord of the two points: the lag as the nozzle would have it.
    let (_, middle) = lit(&sensor, 0.0, s);
    Ok((heading.to_degrees(), middle.y * 1e3))
}

#[test]
fn the_loop_lags_on_r150_as_published() {
    // Speed, heading lag by simulation, lateral lag by simulation: the spec's table.
    for (speed, heading, lateral) in [(0.02, 3.05, 0.05), (0.04, 6.08, 1.32), (0.10, 14.8, 9.57)] {
        let (theta, off) = run(speed).unwrap_or((f32::NAN, f32::NAN));
        assert!((theta - heading).abs() < 0.15, "{theta}° for {heading}° at {speed} m/s");
        assert!((off - lateral).abs() < 0.15, "{off} mm for {lateral} mm at {speed} m/s");
    }
}

#[test]
fn at_0_2_m_per_s_the_seam_leaves_the_view_after_the_arc_has_begun() {
    let lost = run(0.2).expect_err("the seam is lost");
    assert!((lost - 342.0).abs() < 25.0, "lost at {lost} mm");
}

#[test]
fn the_limit_on_r150_is_reached_between_0_10_and_0_13_m_per_s() {
    assert!(run(0.10).is_ok() && run(0.13).is_err());
}

#[test]
fn the_deviation_has_the_right_sign_on_every_axis() {
    use crate::geometry::rotation::{rot_x, rot_y, rot_z};
    for (turn, axis) in [(rot_x(0.03), 0), (rot_y(0.03), 1), (rot_z(0.03), 2)] {
        let frame = Pose {
            r: turn,
            p: Vector3::new(0.0, 0.002, -0.001),
        };
        let (ahead, behind) = (
            frame * Vector3::new(0.011, 0.0, 0.0),
            frame * Vector3::new(-0.010, 0.0, 0.0),
        );
        let across = frame.r * Vector3::new(0.0, 1.0, 0.0);
        let deviation = Deviation::of(&ahead, &behind, &across).expect("the points follow each other");
        let mut expected = Vector3::zeros();
        expected[axis] = 0.03;
        assert!(
            (deviation.turn - expected).iter().all(|e| e.abs() < 1e-5),
            "{deviation:?}"
        );
        assert!(
            (deviation.shift - frame.p).iter().all(|e| e.abs() < 1e-6),
            "{deviation:?}"
        );
    }
}
