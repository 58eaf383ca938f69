//! The drive as a device: its power state, its faults, and which demand they make on the motion.

use super::MotorCommand;
use super::data::{DriveData, rad_s};
use super::encoder::EncoderReading;
use super::motion::{Demand, Limits, Motion};
use super::objects::Settings;
use super::tracking::Tracking;
use hal::canopen::emcy::code;
use hal::canopen::nmt::NmtState;
use hal::canopen::object::{Address, Device, Event, Number, Value};
use hal::canopen::sdo::Abort;
use hal::cia402::machine::{Condition, Machine};
use hal::cia402::{Mode, PowerState, control, status};

/// Over-speed is a fault at this multiple of the maximum motor speed 0x6080 (assumed; drives allow 1.1 to 1.3).
const OVER_SPEED: f64 = 1.2;
/// A motor stands, at the end of a stop, below this part of its highest speed.
const STANDSTILL: f64 = 0.002;

/// The drive but for its bus.
#[derive(Clone, Debug)]
pub struct Servo {
    data: DriveData,
    pub(super) settings: Settings,
    pub(super) machine: Machine,
    pub(super) mode: Option<Mode>,
    pub(super) controlword: u16,
    pub(super) target_velocity: i32,
    pub(super) target_torque: i16,
    pub(super) torque_offset: i16,
    /// Velocity target of the SYNC before the last, for interpolation.
    pub(super) previous_velocity: f64,
    pub(super) tracking: Tracking,
    pub(super) motion: Motion,
    /// Speed on the way to a stand, rad/s, while a stop is under way.
    ramp: Option<f64>,
    /// Time since torque came on, s.
    enabled_s: f64,
    reading: EncoderReading,
    /// Time of the reading, ns.
    read_ns: u64,
    pub(super) position: i32,
    sync_ns: u64,
    sync_period_ns: u64,
    pub(super) error_code: u16,
    emergency: Option<u16>,
    /// Cause of a fault that is present and holds it, zero for none.
    cause: u16,
    voltage: bool,
    pub(super) now_ns: u64,
}

impl Servo {
    pub(super) fn new(data: DriveData) -> Self {
        let settings = Settings::new(&data);
        let mut machine = Machine::default();
        machine.ready();
        Self {
            data,
            settings,
            machine,
            mode: None,
            controlword: 0,
            target_velocity: 0,
            target_torque: 0,
            torque_offset: 0,
            previous_velocity: 0.0,
            tracking: Tracking::default(),
            motion: Motion::default(),
            ramp: None,
            enabled_s: 0.0,
            reading: EncoderReading::default(),
            read_ns: 0,
            position: 0,
            sync_ns: 0,
            sync_period_ns: 0,
            error_code: code::NONE,
            emergency: None,
            cause: code::NONE,
            voltage: true,
            now_ns: 0,
        }
    }

    /// Ratings and constants.
    pub fn data(&self) -> &DriveData {
        &self.data
    }

    /// Power state.
    pub fn state(&self) -> PowerState {
        self.machine.state()
    }

    /// Speed as tracked, rad/s at the motor.
    pub fn speed_rad_s(&self) -> f64 {
        self.tracking.velocity() / self.data.counts_per_rad()
    }

    /// Motor power (the DC link) comes on or is cut. The logic stays alive, as behind a safety contactor.
    pub fn set_voltage(&mut self, on: bool) {
        self.voltage = on;
    }

    /// Injects the cause of a fault, one of [`code`]; it stays until [`Self::clear`].
    pub fn fail(&mut self, cause: u16) {
        self.cause = cause;
        self.fault(cause);
    }

    /// Takes the cause of an injected fault away. The fault itself stays latched until it is reset.
    pub fn clear(&mut self) {
        self.cause = code::NONE;
    }

    pub(super) fn take_emergency(&mut self) -> Option<u16> {
        self.emergency.take()
    }

    fn fault(&mut self, cause: u16) {
        if matches!(self.state(), PowerState::Fault | PowerState::FaultReaction) {
            return;
        }
        // Without current, voltage or speed there is nothing to stop with.
        let helpless = matches!(cause, code::OVER_CURRENT | code::UNDER_VOLTAGE | code::SENSOR);
        self.machine.fail(self.settings.fault_option != 0 && !helpless);
        self.error_code = cause;
        self.emergency = Some(cause);
    }

    /// The connection to the master is gone or unusable: 0x6007.
    fn disconnect(&mut self, cause: u16) {
        if !self.state().has_torque() {
            return;
        }
        match self.settings.abort_connection {
            1 => self.fault(cause),
            2 => self.machine.disable(),
            3 => self.machine.quick_stop(),
            _ => return,
        }
        self.error_code = cause;
    }

    pub(super) fn tick(&mut self, dt_s: f64, reading: EncoderReading) -> MotorCommand {
        self.reading = reading;
        self.read_ns = self.now_ns;
        self.position = reading.counts;
        self.tracking.update(dt_s, reading.counts);
        let speed = self.speed_rad_s();
        self.watch(speed);
        let demand = self.demand(speed, dt_s);
        let limits = Limits {
            torque_n_m: self.settings.max_torque as f64 / 1000.0 * self.data.rated_torque_n_m,
            speed_rad_s: rad_s(self.settings.max_speed_rpm).min(self.data.max_speed_rad_s()),
        };
        self.motion.step(&self.data, limits, demand, speed, dt_s);
        self.enabled_s = if demand == Demand::Off {
            0.0
        } else {
            self.enabled_s + dt_s
        };
        MotorCommand {
            torque_n_m: self.motion.torque(),
            brake_closed: self.enabled_s < self.data.brake_open_s,
        }
    }

    /// Faults that the drive finds itself.
    fn watch(&mut self, speed: f64) {
        let powered = self.state().has_torque() || self.state() == PowerState::SwitchedOn;
        if !self.voltage && powered {
            self.fault(code::UNDER_VOLTAGE);
        }
        if speed.abs() > OVER_SPEED * rad_s(self.settings.max_speed_rpm) {
            self.fault(code::OVER_SPEED);
        }
        // In CSV the demand already stops short of the limits; in CST only a fault can stop the motor.
        let [low, high] = self.settings.position_limits;
        let outward = (self.position > high && speed > 0.0) || (self.position < low && speed < 0.0);
        if outward && self.state() == PowerState::OperationEnabled && self.mode == Some(Mode::Torque) {
            self.fault(code::POSITION_LIMIT);
        }
    }

    fn demand(&mut self, speed: f64, dt_s: f64) -> Demand {
        let stops = match self.state() {
            PowerState::OperationEnabled => self.controlword & control::HALT != 0,
            PowerState::QuickStopActive | PowerState::FaultReaction => true,
            _ => {
                self.ramp = None;
                return Demand::Off;
            }
        };
        if stops {
            return self.stop(speed, dt_s);
        }
        self.ramp = None;
        let torque = |per_mille: i16| per_mille as f64 / 1000.0 * self.data.rated_torque_n_m;
        match self.mode {
            Some(Mode::Torque) => Demand::Torque(torque(self.target_torque) + torque(self.torque_offset)),
            Some(Mode::Velocity) => Demand::Velocity(self.velocity(), torque(self.torque_offset)),
            None => Demand::Off,
        }
    }

    /// The way to a stand on the quick-stop ramp, and what follows it.
    fn stop(&mut self, speed: f64, dt_s: f64) -> Demand {
        let step = self.settings.quick_stop as f64 / self.data.counts_per_rad() * dt_s;
        let from = self.ramp.unwrap_or(speed);
        let ramp = from - from.clamp(-step, step);
        self.ramp = Some(ramp);
        if ramp == 0.0 && speed.abs() < STANDSTILL * self.data.max_speed_rad_s() {
            self.machine.stopped();
        }
        // The torque offset is kept: it is the weight of the arm, and that does not stop.
        let offset = self.torque_offset as f64 / 1000.0 * self.data.rated_torque_n_m;
        if self.state().has_torque() {
            Demand::Velocity(ramp, offset)
        } else {
            Demand::Off
        }
    }

    /// Velocity demand in CSV, rad/s: held or interpolated, and never so fast towards a position limit that the
    /// quick-stop ramp could not stop before it.
    fn velocity(&self) -> f64 {
        let target = self.target_velocity as f64;
        let counts_s = if self.data.interpolate && self.sync_period_ns != 0 {
            let part = (self.now_ns - self.sync_ns) as f64 / self.sync_period_ns as f64;
            self.previous_velocity + (target - self.previous_velocity) * part.min(1.0)
        } else {
            target
        };
        let reach = |limit: i32, sign: f64| {
            let distance = sign * (limit as f64 - self.position as f64);
            (2.0 * self.settings.quick_stop as f64 * distance.max(0.0)).sqrt()
        };
        let [low, high] = self.settings.position_limits;
        counts_s.min(reach(high, 1.0)).max(-reach(low, -1.0)) / self.data.counts_per_rad()
    }

    pub(super) fn statusword(&self) -> u16 {
        let state = self.state();
        let at_limit = {
            let [low, high] = self.settings.position_limits;
            state == PowerState::OperationEnabled && (self.position >= high || self.position <= low)
        };
        let flag = |bit, set: bool| if set { bit } else { 0 };
        state.bits()
            | status::REMOTE
            | flag(status::VOLTAGE, self.voltage)
            | flag(status::LIMIT, self.motion.is_limited() || at_limit)
            | flag(
                status::FOLLOWS,
                state == PowerState::OperationEnabled && self.ramp.is_none(),
            )
    }

    pub(super) fn control(&mut self, word: u16) {
        self.controlword = word;
        let condition = Condition {
            voltage: self.voltage && self.mode.is_some(),
            healthy: self.cause == code::NONE && self.voltage,
        };
        if self.machine.control(word, condition) {
            self.error_code = code::NONE;
            self.emergency = Some(code::NONE);
        }
    }
}

impl Device for Servo {
    fn read(&self, at: Address) -> Result<Value, Abort> {
        self.read_object(at)
    }

    fn write(&mut self, at: Address, number: Number) -> Result<(), Abort> {
        self.write_object(at, number)
    }

    fn sync(&mut self, _count: u8) {
        if self.sync_ns != 0 {
            self.sync_period_ns = self.now_ns - self.sync_ns;
        }
        self.sync_ns = self.now_ns;
        // The shaft has moved on since the last tick.
        let since_s = (self.now_ns - self.read_ns) as f64 * 1e-9;
        let moved = (self.tracking.velocity() * since_s).round() as i32;
        self.position = self.reading.counts.wrapping_add(moved);
    }

    fn event(&mut self, event: Event) {
        match event {
            Event::State(NmtState::Operational) => {}
            Event::State(_) | Event::MasterLost => self.disconnect(code::HEARTBEAT),
            Event::RpdoLate(_) => self.disconnect(code::RPDO_TIMEOUT),
            Event::Reset => {
                // Motor power and the cause of a fault are the world's, not the node's.
                let (voltage, cause, now_ns) = (self.voltage, self.cause, self.now_ns);
                *self = Self {
                    voltage,
                    cause,
                    now_ns,
                    ..Self::new(self.data)
                };
            }
        }
    }
}
