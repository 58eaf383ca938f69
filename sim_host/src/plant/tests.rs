//! The plant against Pinocchio, RK4, energy, and what dry friction must do.

use super::*;
use crate::model::Model;
use nalgebra::Vector6;
use rand::SeedableRng;
use rand_pcg::Pcg64;

const DT: f64 = 0.25e-3;

/// Figures of `scripts/dynamics_oracle.py` (Pinocchio 4.1): (q, dq, mass matrix, bias), joint coordinates.
type Oracle = ([f64; 6], [f64; 6], [[f64; 6]; 6], [f64; 6]);
const PINOCCHIO: [Oracle; 2] = [
    (
        [0.3, -1.7, 0.2, 0.4, -1.3, 0.9],
        [0.5, -0.4, 0.3, 0.6, -0.7, 1.1],
        [
            [
                1.6230264745,
                -0.0201361303249,
                0.00369044928737,
                0.10740026021,
                -0.0239140694772,
                -0.0162043881546,
            ],
            [
                -0.0201361303249,
                4.85987060581,
                -1.51985500471,
                -0.0213302185671,
                0.0194962553541,
                0.000613674488725,
            ],
            [
                0.00369044928737,
                -1.51985500471,
                1.09943940361,
                0.0180355040509,
                0.0537543454786,
                -0.0143330102504,
            ],
            [
                0.10740026021,
                -0.0213302185671,
                0.0180355040509,
                0.0304062153599,
                -0.00272968256798,
                -0.00177213721622,
            ],
            [
                -0.0239140694772,
                0.0194962553541,
                0.0537543454786,
                -0.00272968256798,
                0.0302057965961,
                -0.00450412973036,
            ],
            [
                -0.0162043881546,
                0.000613674488725,
                -0.0143330102504,
                -0.00177213721622,
                -0.00450412973036,
                0.00625,
            ],
        ],
        [
            -0.98228647622,
            -17.8945115063,
            26.2992216632,
            0.311338226608,
            1.26953309111,
            -0.302139089286,
        ],
    ),
    (
        [-0.8, -1.1, -0.6, -1.2, -2.0, 3.1],
        [-1.5, 1.2, 0.9, -2.0, 1.7, -3.0],
        [
            [
                3.40882773853,
                0.0105243239053,
                0.0491222694678,
                0.0105675909361,
                -0.055170797862,
                0.00678769891131,
            ],
            [
                0.0105243239053,
                2.90058777727,
                -0.446476095504,
                0.0194952884025,
                0.0652593438243,
                0.000730588956092,
            ],
            [
                0.0491222694678,
                -0.446476095504,
                0.911964413736,
                -0.0572855957104,
                -0.0176871608572,
                -0.0123536397279,
            ],
            [
                0.0105675909361,
                0.0194952884025,
                -0.0572855957104,
                0.0238488284189,
                0.000222269644306,
                0.00262302064345,
            ],
            [
                -0.055170797862,
                0.0652593438243,
                -0.0176871608572,
                0.000222269644306,
                0.0321943809077,
                -0.000239088808991,
            ],
            [
                0.00678769891131,
                0.000730588956092,
                -0.0123536397279,
                0.00262302064345,
                -0.000239088808991,
                0.00625,
            ],
        ],
        [
            -8.69645807431,
            -52.9191554326,
            13.8005070224,
            -0.596210234138,
            -1.50534548035,
            -0.171457665261,
        ],
    ),
];

fn frictionless() -> PlantModel {
    let mut model = Model::k3s().plant();
    model.friction = [Friction {
        coulomb: 0.0,
        viscous: 0.0,
    }; AXES];
    model
}

fn energy(plant: &Plant) -> f64 {
    let (q, v) = (plant.joints(), Vector6::from(plant.actuator_velocities()));
    let kinetic = 0.5 * (plant.model.mass_matrix(&q) * v).dot(&v);
    // Height of every centre of mass, by the chain cut after its link.
    let mut potential = 0.0;
    for (i, link) in plant.model.chain.links().iter().enumerate() {
        let mut links = *plant.model.chain.links();
        for outer in &mut links[i + 1..] {
            (outer.a, outer.d, outer.twist) = (0.0, 0.0, 0.0);
        }
        let mut q = q;
        q[i + 1..].fill(0.0);
        let centre = Chain::new(links, Isometry3::identity()).tip(&q) * nalgebra::Point3::from(link.centre);
        potential += link.mass * chain::GRAVITY * centre.z;
    }
    kinetic + potential
}

#[test]
fn mass_matrix_and_bias_agree_with_pinocchio() {
    let chain = Model::k3s().plant().chain;
    for (q, dq, mass, bias) in PINOCCHIO {
        let (got_mass, got_bias) = chain.dynamics(&q, &dq);
        for i in 0..AXES {
            assert!(
                (got_bias[i] - bias[i]).abs() < 1e-9,
                "bias {i}: {} {}",
                got_bias[i],
                bias[i]
            );
            for j in 0..AXES {
                assert!(
                    (got_mass[i][j] - mass[i][j]).abs() < 1e-10,
                    "{i}, {j}: {} {}",
                    got_mass[i][j],
                    mass[i][j]
                );
            }
        }
    }
}

#[test]
fn the_tip_is_where_the_controllers_geometry_says() {
    let model = Model::k3s();
    let (plant, arm) = (Plant::at_rest(model.plant(), &PINOCCHIO[1].0), model.arm());
    let (truth, got) = (plant.T_b_n(), arm.forward(&PINOCCHIO[1].0.map(|q| q as f32)));
    assert!((truth.translation.vector - got.p.map(f64::from)).norm() < 5e-7);
    assert!(
        (truth.rotation.to_rotation_matrix().matrix() - got.r.map(f64::from))
            .abs()
            .max()
            < 1e-6
    );
}

#[test]
fn the_tips_velocity_is_its_poses_derivative() {
    let (q, dq, ..) = PINOCCHIO[1];
    let chain = Model::k3s().plant().chain;
    let at = |t: f64| chain.tip(&std::array::from_fn(|i| q[i] + dq[i] * t));
    let (before, after) = (at(-1e-5), at(1e-5));
    let (v, w) = chain.tip_velocity(&q, &dq);
    assert!(((after.translation.vector - before.translation.vector) / 2e-5 - v).norm() < 1e-8);
    assert!(((after.rotation * before.rotation.inverse()).scaled_axis() / 2e-5 - w).norm() < 1e-8);
}

/// Free swing of 2 s from the home pose. The scheme's energy error does not grow, it only ripples with the motion.
#[test]
fn a_frictionless_free_swing_keeps_its_energy() {
    let mut plant = Plant::at_rest(frictionless(), &Model::k3s().home());
    let start = energy(&plant);
    let (mut worst, mut most_kinetic) = (0.0_f64, 0.0_f64);
    for step in 0..8000 {
        plant.tick(DT, &[0.0; AXES]);
        if step % 20 == 0 {
            worst = worst.max((energy(&plant) - start).abs());
            let v = Vector6::from(plant.actuator_velocities());
            most_kinetic = most_kinetic.max(0.5 * (plant.model.mass_matrix(&plant.joints()) * v).dot(&v));
        }
    }
    assert!(most_kinetic > 30.0, "it swings: {most_kinetic} J");
    assert!(worst < 2e-4 * most_kinetic, "{worst} J of {most_kinetic} J");
}

/// Torques of the size of work (0.5–1 of rated, changing) for 0.5 s: 0.25 ms against RK4 at 25 µs.
#[test]
fn the_step_agrees_with_a_finer_runge_kutta() {
    let mut model = frictionless();
    for (axis, friction) in Model::k3s().plant().friction.iter().enumerate() {
        model.friction[axis].viscous = friction.viscous;
    }
    let home = Model::k3s().home();
    let torque = |t: f64| -> [f64; AXES] {
        let wave = (12.0 * t).sin();
        [
            0.7 * wave,
            -0.3 - 0.5 * wave,
            0.2 + 0.3 * wave,
            0.1 * wave,
            -0.12 * wave,
            0.08 * wave,
        ]
    };
    let acceleration = |a: &[f64; AXES], v: &[f64; AXES], torque: &[f64; AXES]| -> [f64; AXES] {
        let (mass, bias) = model.dynamics(a, v);
        let inverse = Factor::of(&mass).inverse();
        let force: [f64; AXES] =
            std::array::from_fn(|i| torque[i] * model.gear[i] - bias[i] - model.friction[i].viscous * v[i]);
        std::array::from_fn(|i| (0..AXES).map(|k| inverse[i][k] * force[k]).sum())
    };
    let mut plant = Plant::at_rest(model.clone(), &home);
    let (mut a, mut v): ([f64; AXES], [f64; AXES]) = (plant.actuators(), [0.0; AXES]);
    let (mut worst, mut fastest) = (0.0_f64, 0.0_f64);
    for step in 0..2000 {
        let now = torque(step as f64 * DT);
        plant.tick(DT, &now);
        const FINE: usize = 10;
        for _ in 0..FINE {
            let h = DT / FINE as f64;
            let along =
                |x: &[f64; AXES], k: &[f64; AXES], h: f64| std::array::from_fn::<_, AXES, _>(|i| x[i] + h * k[i]);
            let k1 = acceleration(&a, &v, &now);
            let (v2, k2) = (
                along(&v, &k1, h / 2.0),
                acceleration(&along(&a, &v, h / 2.0), &along(&v, &k1, h / 2.0), &now),
            );
            let (v3, k3) = (
                along(&v, &k2, h / 2.0),
                acceleration(&along(&a, &v2, h / 2.0), &along(&v, &k2, h / 2.0), &now),
            );
            let (v4, k4) = (
                along(&v, &k3, h),
                acceleration(&along(&a, &v3, h), &along(&v, &k3, h), &now),
            );
            for i in 0..AXES {
                a[i] += h / 6.0 * (v[i] + 2.0 * v2[i] + 2.0 * v3[i] + v4[i]);
                v[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        for i in 0..AXES {
            worst = worst.max((a[i] - plant.actuators()[i]).abs());
            fastest = fastest.max(v[i].abs());
        }
    }
    assert!(fastest > 1.0, "it moves: {fastest} rad/s");
    assert!(worst < 1e-5, "{worst:e} rad");
}

#[test]
fn an_axis_within_its_dry_friction_stands_still() {
    let model = Model::k3s().plant();
    let home = Model::k3s().home();
    let gravity = model.bias(&home, &[0.0; AXES]);
    // Gravity carried but for 60 % of the friction, alternating.
    let torque = std::array::from_fn(|i| {
        let rest = 0.6 * model.friction[i].coulomb * if i % 2 == 0 { 1.0 } else { -1.0 };
        (gravity[i] + rest) / model.gear[i]
    });
    let mut plant = Plant::at_rest(model, &home);
    for _ in 0..4000 {
        plant.tick(DT, &torque);
        assert!(
            plant.actuator_velocities().iter().all(|v| v.abs() < 1e-6),
            "{:?}",
            plant.actuator_velocities()
        );
    }
    let moved = plant
        .joints()
        .iter()
        .zip(&home)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(moved < 1e-6, "{moved} rad in 1 s");
}

#[test]
fn brakes_hold_the_arm_and_without_them_it_falls() {
    let home = Model::k3s().home();
    let fall = |braked: bool| {
        let mut plant = Plant::at_rest(Model::k3s().plant(), &home);
        (0..AXES).for_each(|axis| plant.set_brake(axis, braked));
        (0..2000).for_each(|_| plant.tick(DT, &[0.0; AXES]));
        plant
            .joints()
            .iter()
            .zip(&home)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    };
    assert!(fall(true) < 1e-6, "{} rad", fall(true));
    assert!(fall(false) > 0.05, "{} rad", fall(false));
}

/// The base axis alone feels no gravity: v falls by (coulomb + viscous·v)/M per second, then stays at zero.
#[test]
fn a_sliding_axis_slows_as_coulomb_says_and_stops() {
    let model = Model::k3s().plant();
    let home = Model::k3s().home();
    let (friction, inertia) = (model.friction[0], model.mass_matrix(&home)[(0, 0)]);
    let mut plant = Plant::at_rest(model, &home);
    (1..AXES).for_each(|axis| plant.set_brake(axis, true));
    plant.velocity[0] = 0.8;
    let rate = friction.viscous / inertia;
    let stop = (1.0 + friction.viscous * 0.8 / friction.coulomb).ln() / rate;
    let steps = (stop / DT) as usize;
    (0..steps - 4).for_each(|_| plant.tick(DT, &[0.0; AXES]));
    assert!(
        plant.actuator_velocities()[0] > 0.0,
        "{:?}",
        plant.actuator_velocities()
    );
    (0..12).for_each(|_| plant.tick(DT, &[0.0; AXES]));
    assert!(
        plant.actuator_velocities()[0].abs() < 1e-6,
        "{} rad/s",
        plant.actuator_velocities()[0]
    );
}

#[test]
fn a_disturbed_model_is_wrong_by_at_most_its_fraction_and_the_same_for_a_seed() {
    let model = Model::k3s().plant();
    let disturbed = |seed: u64| model.disturbed(0.1, &mut Pcg64::seed_from_u64(seed));
    assert_eq!(disturbed(1), disturbed(1));
    assert_ne!(disturbed(1), disturbed(2));
    let mut spread = 0.0_f64;
    for seed in 0..20 {
        let wrong = disturbed(seed);
        for i in 0..AXES {
            let (a, b) = (wrong.chain.links()[i], model.chain.links()[i]);
            for ratio in [
                a.mass / b.mass,
                a.inertia[0] / b.inertia[0],
                wrong.rotor[i] / model.rotor[i],
                wrong.torque_constant[i],
            ] {
                assert!((0.9..=1.1).contains(&ratio), "{ratio}");
                spread = spread.max((ratio - 1.0).abs());
            }
        }
    }
    assert!(spread > 0.08, "{spread}");
    assert_eq!(model.disturbed(0.0, &mut Pcg64::seed_from_u64(3)), model);
}
