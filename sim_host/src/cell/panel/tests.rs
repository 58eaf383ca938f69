use super::*;
use nalgebra::UnitQuaternion;
use proptest::prelude::*;

fn part(path: SeamPath, joint: Joint, seed: u64) -> Panel {
    let lie = Isometry3::from_parts(
        Vector3::new(0.4, -0.1, 0.2).into(),
        UnitQuaternion::from_euler_angles(0.02, 0.35, -0.5),
    );
    let mut rng = Pcg64::new(u128::from(seed), 7);
    Panel::new(path, joint, Surface::Moderate, 0.002, lie, &mut rng)
}

/// A bent part of harsh surface along an arc, lying in Σ_B as drawn.
pub(crate) fn harsh_arc(joint: Joint, seed: u64) -> Panel {
    let mut rng = Pcg64::new(u128::from(seed), 1);
    let lie = Isometry3::identity();
    Panel::new(SeamPath::arc(), joint, Surface::Harsh, 0.002, lie, &mut rng)
}

/// Attitude of a sensor that looks straight down on the seam here, along it.
pub(crate) fn level(seam: &SeamFrame) -> UnitQuaternion<f64> {
    UnitQuaternion::from_matrix(&nalgebra::Matrix3::from_columns(&[seam.t, seam.b, seam.n]))
}

#[test]
fn a_deformed_seam_leaves_the_nominal_one_by_its_stated_peak() {
    for seed in 0..20 {
        let panel = part(SeamPath::panel(), Joint::crank(Side::Left), seed);
        let steps = 2000;
        let sideways = (0..=steps)
            .map(|step| {
                panel
                    .form
                    .sideways(panel.path.length() * f64::from(step) / f64::from(steps))
                    .0
            })
            .fold(0.0_f64, |peak, value| peak.max(value.abs()));
        assert!((sideways - 0.002).abs() < 2e-5, "peak {sideways} m with seed {seed}");
    }
}

#[test]
fn the_seam_point_lies_on_the_base_sheet_at_zero_distance() {
    for joint in [Joint::crank(Side::Right), Joint::vee(), Joint::lip(Side::Left)] {
        let panel = part(SeamPath::arc(), joint, 3);
        for step in 0..50 {
            let point = panel.seam(0.01 * f64::from(step)).p;
            let in_w = panel.t_b_w.inverse_transform_point(&point.into()).coords;
            let clearance = panel.around(&in_w, 0.02).clearance(&in_w);
            assert!(clearance.left.abs() < 1e-5, "{clearance:?}");
            // A flank of 15° lifts by 0.27 of what the seam's obliqueness moves the nearest station.
            assert!(clearance.above[0].abs() < 3e-6, "{clearance:?}");
        }
    }
}

#[test]
fn a_lap_joint_steps_up_by_the_sheet_and_its_gap_on_the_stated_side() {
    for (side, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
        let panel = part(SeamPath::straight(), Joint::crank(side), 5);
        let frame = panel.seam(0.2);
        for (offset, here, there) in [(-0.001, Sheet::Base, Sheet::Other), (0.001, Sheet::Other, Sheet::Base)] {
            let point = frame.p + frame.b * (sign * offset);
            let in_w = panel.t_b_w.inverse_transform_point(&point.into()).coords;
            let patch = panel.around(&in_w, 0.02);
            let clearance = patch.clearance(&in_w);
            assert!(patch.covers(here, clearance.left) && !patch.covers(there, clearance.left));
            let step = clearance.above[0] - clearance.above[1];
            assert!((0.00055..0.00085).contains(&step), "step {step} m");
        }
    }
}

#[test]
fn a_tip_beside_a_bend_is_as_high_as_it_is_over_the_flank_and_at_the_seam_at_its_work() {
    let panel = part(SeamPath::straight(), Joint::vee(), 5).ending_at_end();
    let over = |s: f64, left: f64, up: f64| {
        let frame = panel.seam(s);
        panel.clearance_beside_seam(&(panel.base_sheet(s, left) + frame.n * up))
    };
    let flank = 15_f64.to_radians();
    for left in [-0.045, 0.045] {
        let up = 0.045 * flank.tan() - 0.001;
        let height = over(0.2, left, up).expect("over a flank");
        // The plane between the flanks is tilted by a few degrees where the part is bent.
        assert!((height + 0.001).abs() < 2e-4, "{height} m");
    }
    assert_eq!(over(0.2, 0.002, -0.001), None);
    assert_eq!(over(0.2, 0.070, 0.0), None);
    assert_eq!(over(0.52, 0.045, 0.0), None, "past the end");
}

proptest! {
    #[test]
    fn the_nearest_station_of_a_point_beside_the_seam_is_found(
        seed in 0_u64..5, s in 0.0_f64..0.6, guess in -0.02_f64..0.02,
        left in -0.003_f64..0.003, up in -0.003_f64..0.003,
    ) {
        let panel = part(SeamPath::panel(), Joint::crank(Side::Left), seed);
        let frame = panel.seam(s);
        let point = frame.p + frame.b * left + frame.n * up;
        let found = panel.nearest(&point, s + guess);
        prop_assert!((found - s).abs() < 1e-6, "{} m for {} m", found, s);
    }

    #[test]
    fn frames_of_the_true_seam_are_orthonormal_and_follow_it(seed in 0_u64..5, s in 0.0_f64..0.75) {
        let panel = part(SeamPath::arc(), Joint::vee(), seed);
        let (here, next) = (panel.seam(s), panel.seam(s + 1e-6));
        prop_assert!(here.t.dot(&here.n).abs() < 1e-12 && (here.b.norm() - 1.0).abs() < 1e-12);
        prop_assert!(((next.p - here.p).normalize() - here.t).norm() < 1e-4);
    }
}
