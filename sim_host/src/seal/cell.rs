//! The emulated sealing cell: arm, drives, camera, dispenser and operator around one bus.

use super::scenario::{Options, Stream, stream};
use super::second::{ALL, SecondBody};
use super::setup::{Setup, drives, encoders, isometry, mount};
use crate::bus::{Bus, Delivery};
use crate::calibration::sensor::SensorGeometry;
use crate::calibration::simulated;
use crate::camera::effects::Effects;
use crate::camera::eye::{Eye, Pixel};
use crate::camera::optics::Optics;
use crate::camera::start::GreyView;
use crate::camera::start::light::SpotLight;
use crate::camera::{Camera, Motion};
use crate::cell::panel::Panel;
use crate::image_file::GreyImage;
use crate::model::{AXES, Model};
use crate::node::Nodes;
use crate::node::camera::{CameraNode, CameraTiming, Exposure};
use crate::node::drive::{Encoder, EncoderReading, MotorCommand};
use crate::node::io::IoNode;
use crate::plant::Plant;
use crate::target::camera::TargetCamera;
use crate::target::image;
use crate::target::node::{Node, On};
use firmware::camera::Params;
use firmware::camera::sight::Sensors;
use firmware::safety::State;
use firmware::vision::camera::Pinhole;
use firmware::vision::start::Workspace;
use hal::can::Frame;
use hal::canopen::cob::{SYNC, rpdo};
use hal::cia402::PowerState;
use hal::process::{Look, Sighting, digital};
use nalgebra::{Isometry3, Point3};
use rand::RngExt;
use rand_pcg::Pcg32;
use std::cell::Cell as Remembered;

/// Ticks of the plant in one cycle.
pub const TICKS: u32 = 20;
/// One tick, ns.
const TICK_NS: u64 = 250_000;
/// Cycles for which the operator keeps a button pressed: 50 ms.
const PRESS: u64 = 10;
/// Cycles between two presses of one who waits for the lamp: 0.5 s.
const PATIENCE: u64 = 100;

/// What the camera took: for scoring and for the report.
pub struct Shot {
    /// Cycle of its exposure.
    pub cycle: u64,
    /// SYNC count of its exposure.
    pub stamp: u8,
    /// What it was to look at.
    pub look: Look,
    /// The image.
    pub image: GreyImage,
    /// What vision made of it, by slit.
    pub seen: Vec<Seen>,
}

/// What vision made of an image by one slit.
pub struct Seen {
    /// What it said.
    pub sighting: Sighting,
    /// How far off the true seam the point lies that it reports, m; `None` if it reports none.
    pub off: Option<f64>,
}

/// The cell.
pub struct Cell {
    /// The bus.
    pub bus: Bus,
    /// The arm.
    pub plant: Plant,
    /// The true part.
    pub panel: Panel,
    /// Share of the last whole cycle in which the bus was busy.
    pub last_load: f64,
    /// Joint angles at the beginning of this cycle, rad: what the drives latch, but for quantisation.
    pub joints_at_sync: [f64; AXES],
    /// Everything the camera took.
    pub shots: Vec<Shot>,
    /// Drives, camera and I/O node.
    pub nodes: Nodes<AXES>,
    /// The second arm, if there is one.
    pub second: Option<SecondBody>,
    /// The E-stop chain is open.
    pub estop_open: bool,
    /// The stop button is held down.
    pub stop_held: bool,
    /// The operator acknowledges whatever stopped the arm, and starts again and again; else there is one start.
    pub restarts: bool,
    /// The node (as [`Nodes`] counts them) whose frames no longer reach the controller.
    pub cut: Option<usize>,
    /// The slit falls on nothing: the part is gone.
    pub part_gone: bool,
    camera: Camera,
    start_camera: Camera,
    grey_view: GreyView,
    eye: Eye,
    start_pinhole: Pinhole,
    sensors: Sensors,
    workspace: Box<Workspace>,
    mount: Isometry3<f64>,
    encoders: [Encoder; AXES],
    commands: [MotorCommand; AXES],
    now_ns: u64,
    cycle: u64,
    /// From the SYNC of an exposure to its middle, ns.
    exposure_delay_ns: u64,
    /// The exposure whose middle is to come, and when that is, ns.
    exposing: Option<(u64, Exposure)>,
    /// Where on the seam the tip was last: the search for it starts there.
    last_s: Remembered<f64>,
    /// Least height of the tip over a sheet beside the seam so far, m.
    clearance: Option<f64>,
    operator: Operator,
    /// Frames of the controller's cyclic exchange that must be through before the next SYNC.
    awaited: u32,
    late: u64,
}

/// The person at the panel: presses reset and start when the lamp asks for it, once.
#[derive(Default)]
struct Operator {
    waited: u64,
    has_started: bool,
}

impl Operator {
    /// Inputs of the I/O node in this cycle: presses for [`PRESS`] cycles, then waits for [`PATIENCE`].
    fn hands(&mut self, state: State, restarts: bool) -> u8 {
        self.waited = (self.waited + 1) % (PRESS + PATIENCE);
        let button = match state {
            State::EStop => digital::RESET,
            State::Faulted if restarts => digital::RESET,
            State::NotArmed if restarts || !self.has_started => digital::START,
            State::NotArmed => 0,
            _ => {
                self.has_started = true;
                0
            }
        };
        digital::ESTOP_CLOSED | if self.waited < PRESS { button } else { 0 }
    }
}

impl Cell {
    /// A cell at power-up, the arm at home.
    pub fn new(options: &Options, model: &Model, setup: &Setup, seed: u64) -> Self {
        let timing = camera_timing(options);
        let losses = Pcg32::new(stream(seed, Stream::Frames).random(), 1);
        let mut nodes = Nodes {
            drives: drives(model, 1),
            camera: CameraNode::new(setup.master.camera_node, timing, losses),
            io: IoNode::new(setup.master.io_node),
        };
        let mut bus = Bus::new(u64::from(TICKS) * TICK_NS);
        nodes.power_on(&mut bus);
        let second = setup.second.is_some();
        let second = second.then(|| SecondBody::new(options, seed, &mut bus));
        let real = model
            .plant()
            .disturbed(options.model_error, &mut stream(seed, Stream::Plant));
        let plant = Plant::at_rest(real, &model.home());
        let params = camera_params(options, setup);
        let eye = Eye::new(params.slits, params.pinholes, params.joint);
        let truth = options
            .camera_seed
            .map(|seed| SensorGeometry::of_truth(&simulated::truth(seed), options.slits));
        let start_optics = truth.map_or(Optics::START, |sensor| sensor.start_optics());
        Self {
            bus,
            last_load: 0.0,
            joints_at_sync: plant.joints(),
            plant,
            panel: setup.panel.clone(),
            shots: Vec::new(),
            nodes,
            estop_open: false,
            stop_held: false,
            restarts: false,
            cut: None,
            part_gone: false,
            camera: Camera::behind(
                truth.map_or(eye.optics(), |sensor| sensor.seam_optics()),
                Effects::of(options.surface.state()),
                stream(seed, Stream::Images).random(),
            ),
            start_camera: Camera::behind(
                start_optics,
                Effects::of(options.surface.state()),
                stream(seed, Stream::Images).random(),
            ),
            grey_view: GreyView::new(
                start_optics,
                SpotLight::of(options.surface.state()),
                stream(seed, Stream::Images).random(),
            ),
            eye,
            start_pinhole: params.start,
            sensors: Sensors::new(&params),
            workspace: Box::default(),
            mount: truth.map_or_else(|| isometry(&mount(model).pose), |sensor| sensor.t_n_s),
            encoders: encoders(model),
            second,
            commands: [MotorCommand {
                brake_closed: true,
                ..MotorCommand::default()
            }; AXES],
            now_ns: 0,
            exposure_delay_ns: (options.exposure_delay * 1e9).round() as u64,
            exposing: None,
            cycle: 0,
            last_s: Remembered::new(0.0),
            clearance: None,
            operator: Operator::default(),
            awaited: 0,
            late: 0,
        }
    }

    /// Puts the camera's processor where the controller's is: on an emulated board of its own, if that is on one.
    pub fn wire(&mut self, options: &Options, setup: &Setup) -> anyhow::Result<()> {
        if options.on == On::Qemu {
            let board = TargetCamera::start(&image::find("camera")?, &camera_params(options, setup))?;
            self.nodes.camera.move_to(board)?;
        }
        Ok(())
    }

    /// The operator's hands at this cycle: what the lamp says, here by the controller's state.
    pub fn press(&mut self, state: State) {
        let mut bits = self.operator.hands(state, self.restarts);
        if self.estop_open {
            bits &= !digital::ESTOP_CLOSED;
        }
        if self.stop_held {
            bits |= digital::STOP;
        }
        self.nodes.io.set_inputs(bits);
    }

    /// A cycle begins; `disturbances` of its frames are destroyed.
    pub fn start_cycle(&mut self, disturbances: u8) {
        self.bus.disturb(u32::from(disturbances));
        self.joints_at_sync = self.plant.joints();
        if let Some(second) = &mut self.second {
            second.start_cycle();
        }
        self.last_load = self.bus.load().cycle();
    }

    /// A frame from the controller.
    pub fn send(&mut self, frame: Frame) {
        if is_target(&frame) {
            self.awaited += 1;
        }
        self.bus.send(Nodes::<AXES>::CONTROLLER, frame);
    }

    /// One tick: what the bus delivers in it, which `listen` hears too, then drives and arm.
    pub fn run_tick(&mut self, controller: &mut Node, listen: &mut dyn FnMut(&Delivery)) {
        let end = self.now_ns + TICK_NS;
        let (nodes, awaited, late, cut) = (&mut self.nodes, &mut self.awaited, &mut self.late, &self.cut);
        let (exposing, delay_ns) = (&mut self.exposing, self.exposure_delay_ns);
        let second = &mut self.second;
        self.bus.run_until(end, |delivery, mailboxes| {
            listen(delivery);
            if delivery.sender != Nodes::<AXES>::CONTROLLER {
                if *cut != Some(delivery.sender) {
                    controller.receive(&delivery.frame, delivery.t_ns);
                }
            } else if delivery.frame.cob() == SYNC {
                // Targets of the last cycle that are still under way come too late for this SYNC.
                *late += u64::from(*awaited > 0);
                *awaited = 0;
            } else if is_target(&delivery.frame) {
                *awaited = awaited.saturating_sub(1);
            }
            if let Some(second) = second {
                second.deliver(delivery, mailboxes);
            }
            if let Some(exposure) = nodes.deliver(delivery, mailboxes) {
                *exposing = Some((delivery.t_ns + delay_ns, exposure));
            }
        });
        if let Some((t_ns, exposure)) = self.exposing.take_if(|(t_ns, _)| *t_ns <= end) {
            self.take_image(t_ns, exposure);
        }
        // The arm moves under what the drives last said; then they see where it came to.
        let dt = TICK_NS as f64 * 1e-9;
        let readings = follow_drives(&mut self.plant, &self.commands, &self.encoders, dt);
        self.commands = self.nodes.tick(end, dt, &readings, &mut self.bus);
        if let Some(second) = &mut self.second {
            second.tick(end, dt, &mut self.bus);
        }
        self.now_ns = end;
        if end.is_multiple_of(u64::from(TICKS) * TICK_NS) {
            self.cycle += 1;
            let tip = self.plant.T_b_n().translation.vector;
            let now = self.panel.clearance_beside_seam(&tip);
            self.clearance = [self.clearance, now].into_iter().flatten().reduce(f64::min);
        }
    }

    /// The middle of an exposure is at `t_ns`: renders what is before it, and lets its processor look.
    fn take_image(&mut self, t_ns: u64, exposure: Exposure) {
        let (linear, angular) = self.plant.tip_velocity();
        let t_b_n = self.plant.T_b_n();
        let lever = t_b_n.rotation * self.mount.translation.vector;
        let motion = Motion {
            linear: linear + angular.cross(&lever),
            angular,
        };
        let since = (t_ns - self.now_ns) as f64 * 1e-9;
        let t_b_s = motion.carry(&(t_b_n * self.mount), since);
        let frame = self.shots.len() as u64;
        let lit = (exposure.look != Look::Dark && !self.part_gone).then_some(&self.panel);
        let (optics, pixels) = match (exposure.look, lit) {
            (Look::StartGrey, Some(panel)) => (Optics::START, self.grey_view.expose(frame, panel, &t_b_s)),
            (Look::StartGrey | Look::StartSlit, _) => {
                (Optics::START, self.start_camera.expose(frame, lit, &t_b_s, &motion))
            }
            (Look::Seam | Look::Dark, _) => (self.eye.optics(), self.camera.expose(frame, lit, &t_b_s, &motion)),
        };
        let size = [optics.width as u16, optics.height as u16];
        self.nodes.camera.show(&pixels, size);
        let mut seen = Vec::new();
        for sighting in self
            .sensors
            .see(&exposure, &pixels, size, &mut self.workspace)
            .into_iter()
            .flatten()
        {
            self.nodes.camera.hand_back(sighting);
            // How far off the true seam the reported point is: truth, for the report alone.
            let found = exposure.look == Look::Seam && sighting.refusal == 0;
            let off = found.then(|| {
                let point = t_b_s * Point3::from(sighting.point().map(f64::from));
                let nearest = self.panel.nearest(&point.coords, self.nearest_to_tip());
                (point.coords - self.panel.seam(nearest).p).norm()
            });
            seen.push(Seen { sighting, off });
        }
        self.shots.push(Shot {
            cycle: self.cycle,
            stamp: exposure.stamp,
            look: exposure.look,
            image: GreyImage {
                width: optics.width,
                height: optics.height,
                pixels,
            },
            seen,
        });
    }

    /// Nominal arc length of the seam point nearest to where the sensor looks; only a guess to start from.
    fn nearest_to_tip(&self) -> f64 {
        self.deviation().0 + self.mount.translation.x
    }

    /// The nozzle tip against the true seam: nominal arc length m, lateral m, height m.
    pub fn deviation(&self) -> (f64, f64, f64) {
        let tip = self.plant.T_b_n().translation.vector;
        let s = self.panel.nearest(&tip, self.last_s.get());
        self.last_s.set(s);
        let seam = self.panel.seam(s);
        let away = tip - seam.p;
        (s, away.dot(&seam.b), away.dot(&seam.n))
    }

    /// The least height at which the nozzle tip has been over a sheet beside the seam, m; below zero it was in it.
    pub fn clearance(&self) -> Option<f64> {
        self.clearance
    }

    /// What vision saw in a shot, once more and in pixels: for the report. Line centres, but of the start view, and the seam's pixels.
    pub fn look_again(&self, shot: &Shot) -> (Vec<Pixel>, Vec<Pixel>) {
        match shot.look {
            Look::Seam => self.eye.trace(&shot.image.pixels),
            Look::StartGrey | Look::StartSlit => {
                let found = shot.seen.iter().filter(|seen| seen.sighting.refusal == 0);
                let pixel = |seen: &Seen| {
                    let [x, y] = self.start_pinhole.pixel(&seen.sighting.point().into());
                    (f64::from(x), f64::from(y))
                };
                (Vec::new(), found.map(pixel).collect())
            }
            Look::Dark => Default::default(),
        }
    }

    /// Dispenser flow as the pump has it, per mille.
    pub fn flow(&self) -> i16 {
        self.nodes.io.flow()
    }

    /// Every drive is off.
    pub fn powered_down(&self) -> bool {
        self.nodes
            .drives
            .iter()
            .all(|drive| drive.state() == PowerState::SwitchOnDisabled)
            && self.second.as_ref().is_none_or(SecondBody::powered_down)
    }

    /// The arm stands still: every actuator under 1 mrad/s.
    pub fn at_rest(&self) -> bool {
        self.plant
            .actuator_velocities()
            .iter()
            .all(|velocity| velocity.abs() < 1e-3)
    }

    /// Cycles in which targets came after the SYNC that they were for.
    pub fn late(&self) -> u64 {
        self.late
    }

    /// Simulated time, s.
    pub fn now(&self) -> f64 {
        self.now_ns as f64 * 1e-9
    }
}

fn camera_timing(options: &Options) -> CameraTiming {
    CameraTiming {
        latency_cycles: options.vision_latency,
        grey_latency_cycles: options.grey_latency,
        loss: options.frame_loss,
        retries: options.retakes,
        ..CameraTiming::default()
    }
}

/// Longest delay of an exposure's middle that the cell's camera can have, s: it is over before the image is read out, and that by the
/// camera's own clock.
pub fn longest_exposure_delay(options: &Options) -> f64 {
    const MARGIN: f64 = 0.5e-3;
    camera_timing(options).read_out() - MARGIN
}

/// What the camera is told before it is switched on.
pub fn camera_params(options: &Options, setup: &Setup) -> Params {
    Params {
        node: setup.master.camera_node,
        timing: camera_timing(options).of_node(),
        slits: options.slits,
        pinholes: match options.calibration {
            Some(sensor) => sensor.pinholes(),
            None if options.slits == 1 => [Pinhole::TRACKING; 2],
            None => Pinhole::TWO_SLITS,
        },
        start: options
            .calibration
            .map_or(Pinhole::START, |sensor| sensor.start_optics().pinhole(0)),
        joint: options.joint.pattern(),
    }
}

/// An arm moves on by `dt` (s) under what its drives last said; what their encoders then read.
pub fn follow_drives<const N: usize>(
    plant: &mut Plant<N>,
    commands: &[MotorCommand; N],
    encoders: &[Encoder; N],
    dt: f64,
) -> [EncoderReading; N] {
    for (axis, command) in commands.iter().enumerate() {
        plant.set_brake(axis, command.brake_closed);
    }
    plant.tick(dt, &commands.map(|command| command.torque_n_m));
    let (gears, angles) = (&plant.model().gear, plant.actuators());
    std::array::from_fn(|axis| encoders[axis].read(angles[axis] * gears[axis]))
}

/// Whether it is a drive's RPDO1: the frames whose deadline is the next SYNC.
pub fn is_target(frame: &Frame) -> bool {
    (rpdo(1, 1)..=rpdo(1, ALL as u8)).contains(&frame.cob())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Company;
    use crate::seal::scenario::PathName;
    use crate::seal::trial;

    #[test]
    fn the_crosses_on_the_frames_of_a_calibrated_sensor_are_what_it_saw_and_not_what_one_as_drawn_would_have_seen() {
        for (slits, drawn) in [(1, [Pinhole::TRACKING; 2]), (2, Pinhole::TWO_SLITS)] {
            let sensor = SensorGeometry::of_truth(&simulated::truth(1), slits);
            let options = Options {
                slits,
                path: PathName::Straight,
                camera_seed: Some(1),
                calibration: Some(sensor),
                ..Options::told()
            };
            let [calibrated, drawn] = [sensor.pinholes(), drawn].map(|of| Eye::new(slits, of, options.joint.pattern()));
            let (mut shots, mut others) = (0, 0);
            let mut look = |_, _, cell: &mut Cell| {
                for shot in cell.shots.iter().skip(shots) {
                    let (_, crosses) = cell.look_again(shot);
                    let seen = shot.seen.iter().filter(|seen| seen.sighting.refusal == 0);
                    assert_eq!(crosses.len(), seen.count(), "{slits} slits");
                    let [calibrated, drawn] = [calibrated, drawn].map(|eye| eye.trace(&shot.image.pixels).1);
                    assert_eq!(crosses, calibrated, "{slits} slits");
                    others += usize::from(crosses != drawn);
                }
                shots = cell.shots.len();
            };
            let company = Company {
                recording: None,
                progress: &|_| (),
                upset: &mut look,
            };
            trial::run(&options, &Model::k3s(), 1, company).unwrap();
            assert!(others > 30, "{others} frames");
        }
    }
}
