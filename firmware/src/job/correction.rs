//! Preview correction: from what the sensor saw ahead to where the nozzle goes when it gets there (paper 003, 6.4–6.10).
//!
//! A sighting is put into Σ_B with the joint angles of its exposure, and kept as the seam's deviation from the taught path at that
//! *distance along the path*: so it holds on curves, at any speed, and through stops. What the sightings about a place say together
//! ([`super::witness`]) becomes a correction there; between corrections the chosen hold ([`crate::servo::hold`]) leads from one to
//! the next. A sensor with two slits sees each place twice, 21 mm apart: its sightings are witnesses like any others.
//!
//! Round a tight bend a part's shift becomes another deviation within millimetres (what was lateral is then along the path). So no
//! stretch that is judged together reaches into such a bend from outside, within it they are short, and corrections stand as much closer.

use crate::geometry::Pose;
use crate::geometry::trig::atan2;
use crate::job::mount::SensorMount;
use crate::job::path::{Place, TaughtPath};
use crate::job::witness::{WINDOW, Witness, Witnesses};
use crate::servo::hold::{CHANNELS, Hold, HoldKind, Knot, KnotRefused};
use hal::process::Sighting;
use hal::wire::Wire;
use hal::wire_enum;
use nalgebra::Vector3;

/// Furthest that a correction may reach, m: half the sensor's 30 mm view, less the margin that the slit needs at its edge.
pub const REACH: f32 = 0.012;

/// Furthest that a sheet may be rolled against the taught path, rad: 10°, twice a start pose's error and a bent plate's slope together.
const ROLL_REACH: f32 = 0.17;

/// Distance from one correction to the next, m: half that between two bursts at 0.3 m/s and 100 ms.
const PITCH: f32 = 0.015;

/// Least distance between corrections, m: what the hold takes, a third of [`ANSWER`].
const PITCH_MIN: f32 = 0.007;

/// Half the stretch that is judged together round a tight bend, m: on R5 a shift of the part by 1 mm is then met to 0.01 mm.
const TIGHT_WINDOW: f32 = 0.005;

/// [`ANSWER`] while corrections follow each other as closely as that: the hold takes those that are a third of it apart.
const TIGHT_ANSWER: f32 = 0.008;

/// Furthest along the path that a sighting may lie from its place there, m: on R5 the path turns by 2 mrad over that.
const BESIDE: f32 = 1e-5;

/// Channel of the roll.
const ROLL: usize = 2;

/// Corrections kept until the hold takes them: over [`crate::job::path::corner::UNSEEN`] with a bend of 10 mm.
const AHEAD: usize = 24;

/// Distance in which a correction that came late is answered, m: two thirds of the distance between two bursts.
const ANSWER: f32 = 0.020;

/// A correction is made this far ahead of the nozzle, m, or earlier if all that can be said of its place is known: the hold passes a
/// knot best when it knows two more behind it.
const DUE: f32 = 0.045;

/// Furthest from what was seen that a correction is made, m.
const GUESS: f32 = 0.020;

/// Sightings that must agree before the first correction: a burst.
const FIRST_HEARD: usize = 3;

/// With nothing seen behind the newest correction when the nozzle is this near to it, m, the next is made of how the seam went on until then.
const LAST_CALL: f32 = 0.025;

/// What became of a sighting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Use {
    /// None came.
    #[default]
    None,
    /// Another agrees with it: both count.
    Used,
    /// It waits for another that agrees with it.
    Waiting,
    /// The sensor refused the frame; the refusal's number came with it.
    Refused,
    /// Its exposure is no longer in the ring of past cycles, or never was.
    Stale,
    /// It lies off the stretch that is to be sealed, or too far behind what is already corrected.
    OffPath,
    /// It lies further from the taught path than a correction may reach.
    Outlier,
}

wire_enum!(Use {
    None,
    Used,
    Waiting,
    Refused,
    Stale,
    OffPath,
    Outlier
});

/// The seam's deviation from the taught path, by station: corrections at even distances, each made, when it is due, of what the
/// sightings about its place say together.
#[derive(Clone, Debug)]
pub struct Corrections {
    hold: Hold,
    witnesses: Witnesses,
    /// The newest correction.
    newest: Option<Knot>,
    /// Its station, or the furthest that was seen, if it is a guess beyond that, m.
    seen: f32,
    /// Slopes of the corrections at the newest, lateral and in height, m/m.
    trend: [f32; 2],
    /// Station of the next, m, and how far beyond it must have been seen before it is made early, m.
    next: f32,
    reach: f32,
    /// A sighting came in this cycle: making a correction can wait for the next.
    busy: bool,
    /// Corrections for the hold: so many are kept, and so many of these it has taken.
    ahead: [Knot; AHEAD],
    kept: u8,
    taken: u8,
    /// Sightings count up to here, m.
    horizon: f32,
    /// With the nozzle beyond this station (m) the hold answers as ever.
    tight_until: f32,
}

impl Corrections {
    /// Of no path yet.
    pub const EMPTY: Self = Self {
        hold: Hold::EMPTY,
        witnesses: Witnesses::EMPTY,
        newest: None,
        seen: f32::MIN,
        trend: [0.0; 2],
        next: 0.0,
        reach: 0.0,
        busy: false,
        ahead: [Knot {
            station: 0.0,
            value: [0.0; CHANNELS],
        }; AHEAD],
        kept: 0,
        taken: 0,
        horizon: 0.0,
        tight_until: 0.0,
    };

    /// None yet; the path begins at station `first`, and sightings count up to `horizon` (m).
    pub fn reset(&mut self, kind: HoldKind, first: f32, horizon: f32) {
        let start = Knot {
            station: first,
            value: [0.0; 3],
        };
        *self = Self::EMPTY;
        self.hold = Hold::new(kind, start, ANSWER);
        self.horizon = horizon;
        self.tight_until = f32::INFINITY;
    }

    /// From now on sightings count up to `horizon`, m: before a corner that has not been looked round, no further than that.
    pub fn look_to(&mut self, horizon: f32) {
        self.horizon = horizon;
    }

    /// The seam's start as it was measured, `start` (Σ_B; x along the seam, z out of the sheet), is the first correction: where the part ends
    /// there, no sighting says what lies before it.
    pub fn begin(&mut self, path: &TaughtPath, to_part: &Pose, start: &Pose) {
        let back = to_part.inverse() * *start;
        let (s, place) = path.project(&back.p, 0.0);
        let deviation = deviation(&place, &back.p, back.r.column(1).into_owned());
        let witness = Witness::new(s, deviation, 0.0);
        for _ in 0..2 {
            // Measured twice: they confirm each other.
            self.witnesses.hear(witness, self.trend);
        }
        self.push(path, s);
    }

    /// Station of the newest correction, m.
    pub fn newest(&self) -> Option<f32> {
        self.newest.map(|knot| knot.station)
    }

    /// How far the path is corrected by what was seen, m: beyond is a guess. [`f32::MIN`] for nowhere.
    pub fn seen(&self) -> f32 {
        self.seen
    }

    /// The newest correction.
    pub fn newest_knot(&self) -> Option<Knot> {
        self.newest
    }

    /// Deviation to apply with the nozzle at `station` of `path`: lateral m, height m, roll rad.
    pub fn at(&mut self, path: &TaughtPath, station: f32) -> [f32; 3] {
        self.settle(path, station);
        if station > self.tight_until {
            self.tight_until = f32::INFINITY;
            self.hold.set_answer(ANSWER);
        }
        self.hold.value(station)
    }

    /// One cycle's work on the corrections with the nozzle at `nozzle` (m), as far as their being due is concerned; true if there was none.
    pub fn settle(&mut self, path: &TaughtPath, nozzle: f32) -> bool {
        let busy = core::mem::take(&mut self.busy);
        // A correction is made in one cycle and handed on in the next, since the hold then plans anew.
        if self.hand_on() || busy {
            return false;
        }
        let due = self.due(path, nozzle);
        if let Some(station) = due {
            self.push(path, station);
        }
        due.is_none()
    }

    /// Station of the correction that is to be made now, if any, with the nozzle at `nozzle` (m).
    fn due(&self, path: &TaughtPath, nozzle: f32) -> Option<f32> {
        let (first, furthest) = self.witnesses.span()?;
        let Some(newest) = self.newest else {
            // The first is made of the first that is known, as soon as it is well known: the nozzle waits for it at rest.
            return (self.witnesses.heard() >= FIRST_HEARD).then_some(first);
        };
        if furthest < self.next {
            let end = if self.horizon < path.length() {
                self.horizon
            } else {
                path.length()
            };
            let station = if self.next < end { self.next } else { end };
            let within = station > newest.station + PITCH_MIN && station < furthest + GUESS;
            return (within && newest.station < nozzle + LAST_CALL).then_some(station);
        }
        (self.next < nozzle + DUE || self.next + self.reach < furthest).then_some(self.next)
    }

    /// Makes a correction at `station` of what was seen about it; if that is too little, the next is tried a little further on.
    fn push(&mut self, path: &TaughtPath, station: f32) {
        let clear = path.from_bend(station);
        let within = window(clear);
        let scale = within / WINDOW;
        let (seen, said) = match self.witnesses.span() {
            Some((_, furthest)) if furthest < station => {
                let window = window(path.from_bend(furthest));
                (furthest, Some(self.witnesses.guess(furthest, station, window)))
            }
            _ => (station, self.witnesses.say(station, within)),
        };
        let knot = said.map(|mut value| {
            // About a tight bend's tangent, which turns at 25 rad/s, a roll of 5° would swing the tool at 2 rad/s: there it is left out.
            value[ROLL] *= if clear < WINDOW { clear / WINDOW } else { 1.0 };
            Knot { station, value }
        });
        let pitch = PITCH * scale;
        let made = knot.filter(|knot| self.keep(*knot, pitch));
        if let Some((knot, last)) = made.and_then(|knot| Some((knot, self.newest.replace(knot)?))) {
            let way = 1.0 / (station - last.station);
            let ([y0, z0, _], [y1, z1, _]) = (last.value, knot.value);
            self.trend = [(y1 - y0) * way, (z1 - z0) * way];
        }
        if made.is_some() {
            self.seen = seen;
        }
        self.next = station + if made.is_some() { pitch } else { PITCH_MIN * scale };
        self.reach = window(path.from_bend(self.next));
    }

    /// Keeps a correction for the hold, if there is room; `pitch` (m) is the distance to the next.
    fn keep(&mut self, knot: Knot, pitch: f32) -> bool {
        if pitch < PITCH_MIN {
            self.hold.set_answer(TIGHT_ANSWER);
            self.tight_until = knot.station + pitch;
        }
        if self.taken == self.kept {
            (self.taken, self.kept) = (0, 0);
        }
        match self.ahead.get_mut(self.kept as usize) {
            Some(place) => {
                *place = knot;
                self.kept += 1;
                true
            }
            None => false,
        }
    }

    /// Gives the hold the next of the corrections that are kept for it, if there is one and it has room for it.
    fn hand_on(&mut self) -> bool {
        let next = self.ahead.get(self.taken as usize);
        let taken = self.taken < self.kept && next.is_some_and(|knot| self.hold.push(*knot) != Err(KnotRefused::Full));
        self.taken += u8::from(taken);
        taken
    }

    /// Takes in a sighting made with the nozzle frame at `t_b_n`, asked for only if something was seen, and its reference at `station`.
    /// `to_part` moves the taught path onto the part as the start pose says.
    pub fn take(
        &mut self,
        sighting: &Sighting,
        mount: &SensorMount,
        path: &TaughtPath,
        to_part: &Pose,
        t_b_n: impl FnOnce() -> Pose,
        station: f32,
    ) -> Use {
        self.busy = true; // whatever becomes of it
        if sighting.refusal != 0 {
            return Use::Refused;
        }
        let seen = Vector3::from(sighting.point());
        let t_b_s = t_b_n() * mount.pose;
        // Everything below is done in the frame of the taught path: the part's displacement is undone once.
        let to_taught = to_part.inverse() * t_b_s;
        let point = to_taught * seen;
        let (mut s, mut place) = path.project(&point, station + mount.pose.p.x);
        if (point - place.point).dot(&place.tangent).abs() > BESIDE {
            // Beside a tight bend the search gains less on each step.
            (s, place) = path.project(&point, s);
        }
        if s < path.first() || s > self.horizon || self.newest().is_some_and(|newest| s <= newest - WINDOW) {
            return Use::OffPath;
        }
        let slit = to_taught.r * mount.slit_direction(seen, sighting);
        let deviation = deviation(&place, &point, slit);
        let within = |value: f32, reach: f32| value.abs() <= reach; // false for what is no number
        if !within(deviation[0], REACH) || !within(deviation[1], REACH) || !within(deviation[2], ROLL_REACH) {
            return Use::Outlier;
        }
        let witness = Witness::new(s, deviation, sighting.sigma());
        if self.witnesses.hear(witness, self.trend) {
            Use::Used
        } else {
            Use::Waiting
        }
    }
}

/// Half the stretch that is judged together about a place that is `clear` (m) of any tight bend, m.
fn window(clear: f32) -> f32 {
    let widest = if clear < WINDOW { clear } else { WINDOW };
    if widest > TIGHT_WINDOW { widest } else { TIGHT_WINDOW }
}

/// How the seam deviates from the path at `place`, lateral m, height m, roll rad: it goes through `point` (m), and `across` (of any length) lies in the
/// sheet, to the left.
fn deviation(place: &Place, point: &Vector3<f32>, across: Vector3<f32>) -> [f32; CHANNELS] {
    let away = point - place.point;
    [away.dot(&place.lateral()), away.dot(&place.normal), roll(place, across)]
}

/// Roll of the sheet about the path's tangent, rad, from the direction of the lit line across it.
pub(super) fn roll(place: &Place, slit: Vector3<f32>) -> f32 {
    let normal = place.tangent.cross(&slit); // t × b = n: the lit line runs to the left, along +b
    let (up, side) = (normal.dot(&place.normal), normal.dot(&place.lateral()));
    atan2(-side, up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation::{rot_x, rot_z};
    use crate::geometry::trig::sin_cos;
    use crate::job::mount::tests::MOUNT;
    use crate::job::path::tests::TRAVEL;
    use nalgebra::Matrix3;

    fn straight(s: f32) -> ([f32; 3], [f32; 3], [f32; 3]) {
        ([0.4 + s, -0.1, 0.2], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    }

    /// What an ideal sensor on a nozzle at `t_b_n` says of a seam through `origin` along x whose sheet is rolled by `roll`.
    fn sight(t_b_n: &Pose, origin: Vector3<f32>, roll: f32) -> Sighting {
        let t_s_b = (*t_b_n * MOUNT.pose).inverse();
        let (o, t) = (t_s_b * origin, t_s_b.r * Vector3::new(1.0, 0.0, 0.0));
        let across = t_s_b.r * (rot_x(roll) * Vector3::new(0.0, 1.0, 0.0));
        // The slit plane x + z = 0 (φ = 45°) cuts the seam at o + u t, and the sheet along t·a + across.
        let u = -(o.x + o.z) / (t.x + t.z);
        let p = o + t * u;
        let slit = across - t * ((across.x + across.z) / (t.x + t.z));
        let image = |p: Vector3<f32>| {
            let scale = 1.0 / (1.0 - p.z / 0.150);
            (p.x * scale, -p.y * scale)
        };
        let ((x0, y0), (x1, y1)) = (image(p), image(p + slit * 1e-3));
        let angle = atan2((x1 - x0) / (y1 - y0), 1.0);
        Sighting {
            point_um: [p.x, p.y, p.z].map(|m| (m * 1e6) as i16),
            angle_e4: (angle * 1e4) as i16,
            ..Sighting::default()
        }
    }

    #[test]
    fn a_sighting_becomes_the_seams_deviation_at_its_own_station() {
        let path = TaughtPath::new(0.5, &TRAVEL, straight).unwrap();
        let mut corrections = Corrections::EMPTY;
        corrections.reset(HoldKind::First, path.first(), path.last());
        // The hand is turned, tilted and displaced: none of it may matter.
        let t_b_n = Pose {
            r: rot_z(0.05) * rot_x(0.03),
            p: Vector3::new(0.502, -0.099, 0.201),
        };
        let seam = Vector3::new(0.4, -0.1 + 0.0021, 0.2 - 0.0013);
        let sighting = sight(&t_b_n, seam, 0.04);
        let mut take = |station| corrections.take(&sighting, &MOUNT, &path, &Pose::identity(), || t_b_n, station);
        assert_eq!([(); 3].map(|()| take(0.102)), [Use::Waiting, Use::Used, Use::Used]);
        for _ in 0..2 {
            // In the cycle of a sighting no correction is made.
            corrections.at(&path, 0.102);
        }
        let station = corrections.newest().unwrap();
        let [lateral, height, roll] = corrections.at(&path, station);
        assert!((station - 0.182).abs() < 4e-3, "seen about a lead ahead: {station} m");
        assert!((lateral - 0.0021).abs() < 3e-6, "{lateral} m");
        assert!((height + 0.0013).abs() < 3e-6, "{height} m");
        assert!((roll - 0.04).abs() < 1e-3, "{roll} rad");
    }

    #[test]
    fn a_start_that_was_measured_is_the_first_correction() {
        let path = TaughtPath::new(0.5, &TRAVEL, straight).unwrap();
        let mut corrections = Corrections::EMPTY;
        corrections.reset(HoldKind::First, path.first(), path.last());
        // The part lies elsewhere, and its start 1.5 mm to the left of, and 0.7 mm under, where that puts it.
        let to_part = Pose {
            r: rot_z(0.05) * rot_x(0.03),
            p: Vector3::new(0.010, -0.006, 0.008),
        };
        let start = Pose {
            r: Matrix3::identity(),
            p: Vector3::new(0.4, -0.1 + 0.0015, 0.2 - 0.0007),
        };
        corrections.begin(&path, &to_part, &(to_part * start));
        assert!(corrections.newest().unwrap().abs() < 1e-5, "{:?}", corrections.newest());
        let [lateral, height, roll] = corrections.at(&path, 0.0);
        assert!((lateral - 0.0015).abs() < 2e-6, "{lateral} m");
        assert!((height + 0.0007).abs() < 2e-6, "{height} m");
        assert!(roll.abs() < 1e-4, "{roll} rad");
    }

    /// Drives along a straight seam with a bend of 1.2 mm over 0.5 m, taking what `see` makes of the true deviation at each exposure of
    /// a burst, by each of two slits 21 mm apart; the largest error of the applied lateral correction after 0.1 m.
    fn drive(see: impl Fn(usize, f32) -> Option<f32>) -> f32 {
        let path = TaughtPath::new(0.5, &TRAVEL, straight).unwrap();
        let truth = |s: f32| 0.0012 * sin_cos(s * 4.0).0;
        let mut corrections = Corrections::EMPTY;
        corrections.reset(HoldKind::Smooth, path.first(), path.last());
        let (mut worst, mut exposure) = (0.0_f32, 0);
        let mut nozzle = -0.078_f32;
        for cycle in 0_u32..350 {
            let in_period = cycle % 20;
            if in_period < 9 && in_period.is_multiple_of(3) {
                for (slit, ahead) in [(0, 0.0694), (1, 0.0906_f32)] {
                    let Some(lateral) = see(exposure, truth(nozzle + ahead)) else {
                        continue;
                    };
                    let t_b_n = Pose {
                        r: Matrix3::identity(),
                        p: Vector3::new(0.4 + nozzle + ahead - 0.080, -0.1, 0.2),
                    };
                    let mut sighting = sight(&t_b_n, Vector3::new(0.4, -0.1 + lateral, 0.2), 0.0);
                    sighting.slit = slit;
                    corrections.take(&sighting, &MOUNT, &path, &Pose::identity(), || t_b_n, nozzle);
                }
                exposure += 1;
            }
            let [lateral, ..] = corrections.at(&path, nozzle);
            if nozzle > 0.1 && nozzle < 0.4 {
                worst = worst.max((lateral - truth(nozzle)).abs());
            }
            if corrections.newest().is_some() {
                nozzle += 0.0015;
            }
        }
        worst
    }

    #[test]
    fn a_bent_seam_is_followed_between_its_sightings() {
        let error = drive(|_, lateral| Some(lateral));
        assert!(error < 1.5e-5, "{error} m");
    }

    #[test]
    fn wrong_and_lost_sightings_move_the_nozzle_little() {
        let error = drive(|exposure, lateral| match exposure % 7 {
            3 => None,
            5 => Some(lateral + 0.0015), // drawn to a glint
            _ => Some(lateral),
        });
        assert!(error < 4e-5, "{error} m");
    }

    #[test]
    fn the_nozzle_goes_on_along_the_seam_to_an_end_that_was_not_seen() {
        let path = TaughtPath::new(0.2, &TRAVEL, straight).unwrap();
        let truth = |s: f32| 0.0012 * sin_cos(s * 16.0).0; // 1.2 mm over 196 mm
        let mut corrections = Corrections::EMPTY;
        corrections.reset(HoldKind::Smooth, path.first(), path.last());
        let (mut nozzle, mut worst) = (-0.078_f32, 0.0_f32);
        while nozzle < 0.2 {
            let seen = nozzle + 0.080;
            // The last 15 mm show nothing any more.
            if seen < 0.185 && (nozzle * 250.0) as i32 % 2 == 0 {
                let t_b_n = Pose {
                    r: Matrix3::identity(),
                    p: Vector3::new(0.4 + nozzle, -0.1, 0.2),
                };
                let sighting = sight(&t_b_n, Vector3::new(0.4, -0.1 + truth(seen), 0.2), 0.0);
                corrections.take(&sighting, &MOUNT, &path, &Pose::identity(), || t_b_n, nozzle);
            }
            let [lateral, ..] = corrections.at(&path, nozzle);
            if nozzle > 0.1 {
                worst = worst.max((lateral - truth(nozzle)).abs());
            }
            nozzle += 0.0015;
        }
        assert!(worst < 0.13e-3, "{worst} m");
    }

    #[test]
    fn what_was_refused_or_lies_out_of_reach_is_not_heard() {
        let path = TaughtPath::new(0.5, &TRAVEL, straight).unwrap();
        let mut corrections = Corrections::EMPTY;
        corrections.reset(HoldKind::First, path.first(), path.last());
        let mut take = |station: f32, lateral: f32, refusal: u8| {
            let t_b_n = Pose {
                r: Matrix3::identity(),
                p: Vector3::new(0.4 + station, -0.1, 0.2),
            };
            let mut sighting = sight(&t_b_n, Vector3::new(0.4, -0.1 + lateral, 0.2), 0.0);
            sighting.refusal = refusal;
            corrections.take(&sighting, &MOUNT, &path, &Pose::identity(), || t_b_n, station)
        };
        assert_eq!(take(0.000, 0.0, 4), Use::Refused);
        assert_eq!(take(0.000, 0.0130, 0), Use::Outlier);
        assert_eq!(take(0.600, 0.0, 0), Use::OffPath);
        assert_eq!(take(0.000, 0.0, 0), Use::Waiting);
        assert_eq!(
            take(0.030, 0.0, 0),
            Use::Waiting,
            "too far on to speak of the same place"
        );
        assert_eq!(take(0.033, 0.0, 0), Use::Used);
    }
}
