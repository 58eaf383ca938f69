//! Controller's master and all nodes on one bus, without arm: each drive turns a rotor of its own.

mod bring_up;
mod camera;
mod faults;
mod motion;
mod timing;

use crate::bus::{Bus, Delivery};
use crate::node::Nodes;
use crate::node::camera::{CameraNode, CameraTiming, Exposure};
use crate::node::drive::{Drive, DriveData, Encoder, EncoderReading, MotorCommand, VENDOR_PRODUCT};
use crate::node::io::IoNode;
use hal::cia402::{Mode, PowerState};
use hal::master::{DriveConfig, Master, MasterConfig};
use hal::process::{Inputs, Look, Outputs, PowerRequest, Sighting, digital};
use rand_pcg::Pcg32;

const AXES: usize = 6;
const CYCLE_NS: u64 = 5_000_000;
const STEP_NS: u64 = 2_500_000;
const TICK_NS: u64 = 250_000;
const INERTIA: f64 = 3e-4;

/// The cell without its arm.
struct Cell {
    bus: Bus,
    nodes: Nodes<AXES>,
    master: Master<AXES>,
    /// Angle, rad, and speed, rad/s.
    rotors: [(f64, f64); AXES],
    commands: [MotorCommand; AXES],
    peak_torque: [f64; AXES],
    t_ns: u64,
    trace: Vec<Delivery>,
    exposures: Vec<Exposure>,
    /// The controller runs; when it does not, neither SYNC nor anything else of it is sent.
    alive: bool,
    /// Slits of the camera.
    slits: u8,
}

fn data(k: usize) -> DriveData {
    if k < 3 {
        DriveData::main(INERTIA)
    } else {
        DriveData::wrist(INERTIA / 10.0)
    }
}

fn config(mode: Mode) -> MasterConfig<AXES> {
    MasterConfig::new(
        mode,
        std::array::from_fn(|k| {
            let data = data(k);
            DriveConfig {
                vendor_product: VENDOR_PRODUCT,
                rated_torque_mnm: data.rated_torque_mnm(),
                encoder_counts: data.encoder_counts,
                gear: [1, 1],
                max_torque: 2900,
                max_speed_rpm: 3600,
                position_limits: [-100_000_000, 100_000_000],
                quick_stop: 20_000_000,
                following_window: 100_000,
                following_time_ms: 20,
            }
        }),
    )
}

impl Cell {
    fn new(mode: Mode) -> Self {
        Self::with(
            config(mode),
            CameraTiming {
                loss: 0.0,
                ..CameraTiming::default()
            },
        )
    }

    fn with(config: MasterConfig<AXES>, timing: CameraTiming) -> Self {
        let mut cell = Self {
            bus: Bus::new(CYCLE_NS),
            nodes: Nodes {
                drives: std::array::from_fn(|k| Drive::new(k as u8 + 1, data(k))),
                camera: CameraNode::new(config.camera_node, timing, Pcg32::new(1, 2)),
                io: IoNode::new(config.io_node),
            },
            master: Master::new(&config).unwrap(),
            rotors: [(0.0, 0.0); AXES],
            commands: [MotorCommand::default(); AXES],
            peak_torque: [0.0; AXES],
            t_ns: 0,
            trace: Vec::new(),
            exposures: Vec::new(),
            alive: true,
            slits: 1,
        };
        cell.nodes.io.set_inputs(digital::ESTOP_CLOSED);
        cell.nodes.power_on(&mut cell.bus);
        cell
    }

    /// Bus and rotors up to `t_ns`.
    fn run_until(&mut self, t_ns: u64) {
        while self.t_ns < t_ns {
            self.t_ns += TICK_NS;
            let Self {
                bus,
                nodes,
                master,
                trace,
                exposures,
                slits,
                ..
            } = self;
            bus.run_until(self.t_ns, |delivery, mailboxes| {
                trace.push(*delivery);
                if let Some(exposure) = nodes.deliver(delivery, mailboxes) {
                    exposures.push(exposure);
                    for slit in 0..*slits {
                        nodes.camera.hand_back(seen(exposure.stamp, slit));
                    }
                }
                if delivery.sender != Nodes::<AXES>::CONTROLLER {
                    master.receive(&delivery.frame);
                }
            });
            let dt = TICK_NS as f64 * 1e-9;
            for (k, command) in self.commands.iter().enumerate() {
                let (angle, speed) = &mut self.rotors[k];
                *speed += command.torque_n_m / data(k).total_inertia_kg_m2 * dt;
                if command.brake_closed {
                    *speed = 0.0;
                }
                *angle += *speed * dt;
                self.peak_torque[k] = self.peak_torque[k].max(command.torque_n_m.abs());
            }
            let readings: [EncoderReading; AXES] = std::array::from_fn(|k| {
                Encoder {
                    counts_per_revolution: data(k).encoder_counts,
                }
                .read(self.rotors[k].0)
            });
            self.commands = self.nodes.tick(self.t_ns, dt, &readings, &mut self.bus);
        }
    }

    /// One cycle: SYNC, half a cycle of bus, the controller's step, the other half.
    fn cycle(&mut self, step: impl FnOnce(&Inputs<AXES>) -> Outputs<AXES>) -> Inputs<AXES> {
        let start = self.t_ns;
        let Self { bus, master, alive, .. } = self;
        if *alive {
            master.sync(&mut |frame| bus.send(Nodes::<AXES>::CONTROLLER, frame));
        }
        self.run_until(start + STEP_NS);
        let inputs = *self.master.inputs(0);
        let outputs = step(&inputs);
        if self.alive {
            let Self { bus, master, .. } = self;
            master.outputs(&outputs, &mut |frame| bus.send(Nodes::<AXES>::CONTROLLER, frame));
        }
        self.run_until(start + CYCLE_NS);
        inputs
    }

    fn cycles(&mut self, count: u32, outputs: &Outputs<AXES>) -> Inputs<AXES> {
        let mut inputs = Inputs::default();
        for _ in 0..count {
            inputs = self.cycle(|_| *outputs);
        }
        inputs
    }

    /// Brings the bus up and all axes to operation enabled; the cycles that both took.
    fn arm(&mut self) -> (u32, u32) {
        let mut up = 0;
        while !self.cycle(|_| Outputs::default()).bus_ready {
            up += 1;
            assert!(up < 400, "not ready after 2 s: {:?}", self.master.last_failure());
        }
        let mut armed = 0;
        while !enabled(&self.cycle(|_| all(PowerRequest::Enable, 0))) {
            armed += 1;
            assert!(armed < 40);
        }
        (up, armed)
    }

    fn states(&self) -> [PowerState; AXES] {
        self.nodes.drives.each_ref().map(Drive::state)
    }
}

fn all(request: PowerRequest, velocity: i32) -> Outputs<AXES> {
    let mut outputs = Outputs::default();
    for axis in &mut outputs.axes {
        axis.request = request;
        axis.velocity = velocity;
    }
    outputs
}

fn enabled(inputs: &Inputs<AXES>) -> bool {
    inputs
        .axes
        .iter()
        .all(|axis| PowerState::of(axis.statusword) == Some(PowerState::OperationEnabled))
}

/// What the rig's vision sees: something different for each stamp and slit.
fn seen(stamp: u8, slit: u8) -> Sighting {
    Sighting {
        stamp,
        look: Look::Seam,
        slit,
        refusal: 0,
        point_um: [stamp as i16, -100, slit as i16],
        angle_e4: -(stamp as i16),
        quality: 200,
        sigma_um: 30,
    }
}
