//! Preview correction: from what the sensor saw ahead to where the nozzle goes when it gets there (paper 003, 6.4–6.10).
//!
//! A sighting is put into Σ_B with the joint angles of its exposure, and kept as the seam's deviation from the taught path at that
//! *distance along the path*: so it holds on curves, at any speed, and through stops. Between sightings the chosen hold
//! ([`crate::servo::hold`]) leads from one deviation to the next.

use crate::geometry::Pose;
use crate::geometry::trig::atan2;
use crate::job::path::{Place, TaughtPath};
use crate::servo::hold::{Hold, HoldKind, Knot};
use hal::process::Sighting;
use hal::wire::Wire;
use hal::{wire_enum, wire_struct};
use nalgebra::Vector3;

/// Furthest that a correction may reach, m: half the sensor's 30 mm view, less the margin that the slit needs at its edge.
pub const REACH: f32 = 0.012;

/// Furthest that a sheet may be rolled against the taught path, rad: 10°, twice a start pose's error and a bent plate's slope together.
const ROLL_REACH: f32 = 0.17;

/// Two sightings agree if their deviations differ by no more than this from what the seam's course lets expect, m: four standard deviations
/// of their difference on an ordinary surface. A wrong one, drawn to a glint or a ghost, is alone with its error.
const AGREEMENT: f32 = 0.3e-3;

/// And by this much more per distance between them: how much the seam may bend between corrections, m/m.
const TURNING: f32 = 0.04;

/// Furthest that two sightings may lie apart to speak of the same place, m: the first and last of a burst at 0.4 m/s, and a retake.
const SAME_PLACE: f32 = 0.0135;

/// Distance in which a sighting that came late is answered, m: two thirds of the distance between two at 0.3 m/s and 100 ms. The
/// hold takes none that come nearer together than a third of it.
const ANSWER: f32 = 0.020;

/// Geometry of the sensor on the nozzle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorMount {
    /// Pose of the sensor in the nozzle frame: T_n_s.
    pub pose: Pose,
    /// Height of the camera's centre over Σ_S, m.
    pub camera_height: f32,
    /// Tangent of the slit plane's angle φ: the plane is x = −z·tan φ in Σ_S.
    pub slit_tangent: f32,
}

wire_struct!(SensorMount {
    pose: Pose,
    camera_height: f32,
    slit_tangent: f32
});

/// What became of a sighting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Use {
    /// None came.
    #[default]
    None,
    /// With the one before it became a correction.
    Used,
    /// It says again what a correction near by says already.
    Known,
    /// It waits for another that agrees with it.
    Waiting,
    /// The sensor refused the frame; the refusal's number came with it.
    Refused,
    /// Its exposure is no longer in the ring of past cycles, or never was.
    Stale,
    /// It lies off the stretch that is to be sealed, or behind one that is already known.
    OffPath,
    /// It lies further from the taught path than a correction may reach.
    Outlier,
}

wire_enum!(Use {
    None,
    Used,
    Known,
    Waiting,
    Refused,
    Stale,
    OffPath,
    Outlier
});

/// The seam's deviation from the taught path, by station.
///
/// No sighting is believed alone: it waits until a second, exposed a few millimetres on, agrees with it; their mean becomes the
/// correction. A wrong one is outvoted by a third.
#[derive(Clone, Debug)]
pub struct Corrections {
    hold: Hold,
    /// The newest correction.
    newest: Option<Knot>,
    /// The sighting that waits for confirmation.
    waiting: Option<Knot>,
}

impl Corrections {
    /// Of no path yet.
    pub const EMPTY: Self = Self {
        hold: Hold::EMPTY,
        newest: None,
        waiting: None,
    };

    /// None yet; the path begins at station `first` (m).
    pub fn new(kind: HoldKind, first: f32) -> Self {
        let start = Knot {
            station: first,
            value: [0.0; 3],
        };
        Self {
            hold: Hold::new(kind, start, ANSWER),
            newest: None,
            waiting: None,
        }
    }

    /// Station of the newest correction, m.
    pub fn newest(&self) -> Option<f32> {
        self.newest.map(|knot| knot.station)
    }

    /// Deviation to apply with the nozzle at `station`: lateral m, height m, roll rad.
    pub fn at(&mut self, station: f32) -> [f32; 3] {
        self.hold.evaluate(station).value
    }

    /// Takes in a sighting made with the nozzle frame at `t_b_n` and its reference at `station`.
    /// `to_part` moves the taught path onto the part as the start pose says.
    pub fn take(
        &mut self,
        sighting: &Sighting,
        mount: &SensorMount,
        path: &TaughtPath,
        to_part: &Pose,
        t_b_n: &Pose,
        station: f32,
    ) -> Use {
        if sighting.refusal != 0 {
            return Use::Refused;
        }
        let [x, y, z] = sighting.point_um.map(|um| um as f32 * 1e-6);
        let seen = Vector3::new(x, y, z);
        let t_b_s = *t_b_n * mount.pose;
        // Everything below is done in the frame of the taught path: the part's displacement is undone once.
        let to_taught = to_part.inverse() * t_b_s;
        let point = to_taught * seen;
        let (s, place) = path.project(&point, station + mount.pose.p.x);
        if s < path.first() || s > path.last() || self.newest().is_some_and(|newest| s <= newest) {
            return Use::OffPath;
        }
        let away = point - place.point;
        let slit = to_taught.r * slit_direction(seen, sighting.angle_e4 as f32 * 1e-4, mount);
        let deviation = [away.dot(&place.lateral()), away.dot(&place.normal), roll(&place, slit)];
        let within = |value: f32, reach: f32| value.abs() <= reach; // false for what is no number
        if !within(deviation[0], REACH) || !within(deviation[1], REACH) || !within(deviation[2], ROLL_REACH) {
            return Use::Outlier;
        }
        let knot = Knot {
            station: s,
            value: deviation,
        };
        if self.newest.is_some_and(|newest| agree(None, &newest, &knot)) {
            // Nothing new: the place is known already.
            return Use::Known;
        }
        let waiting = self.waiting.replace(knot);
        let Some(first) = waiting.filter(|first| agree(self.newest.as_ref(), first, &knot)) else {
            return Use::Waiting;
        };
        self.waiting = None;
        let knot = middle(&first, &knot);
        match self.hold.push(knot) {
            Ok(()) => {
                self.newest = Some(knot);
                Use::Used
            }
            Err(_) => Use::OffPath,
        }
    }
}

/// Two sightings, the earlier first, speak of the same place and say the same of it: level with each other, or on the line that leads from
/// the newest correction through the first. Roll, measured over a few millimetres of sheet only, follows and does not decide.
fn agree(newest: Option<&Knot>, one: &Knot, other: &Knot) -> bool {
    let apart = other.station - one.station;
    let allowed = AGREEMENT + TURNING * apart.abs();
    let along = |slopes: [f32; 2]| {
        let near = |((a, b), slope): ((&f32, &f32), f32)| (b - a - slope * apart).abs() <= allowed;
        one.value.iter().zip(&other.value).zip(slopes).all(near)
    };
    let leads_on = newest.is_some_and(|newest| {
        let way = 1.0 / (one.station - newest.station);
        let [[y0, z0, _], [y1, z1, _]] = [newest.value, one.value];
        along([(y1 - y0) * way, (z1 - z0) * way])
    });
    apart.abs() <= SAME_PLACE && (leads_on || along([0.0; 2]))
}

/// What two sightings that agree say together.
fn middle(one: &Knot, other: &Knot) -> Knot {
    let mut both = *one;
    both.station = 0.5 * (one.station + other.station);
    both.value
        .iter_mut()
        .zip(other.value)
        .for_each(|(a, b)| *a = 0.5 * (*a + b));
    both
}

/// Direction of the lit line on the sheet at `seen`, Σ_S, from its inclination in the image: the derivative along an image row of the
/// exact pinhole triangulation (sealing.md, chapter 3). Not normalised.
pub(super) fn slit_direction(seen: Vector3<f32>, angle: f32, mount: &SensorMount) -> Vector3<f32> {
    let h = mount.camera_height;
    let t = 1.0 - seen.z / h; // scale from the plane z = 0 to the point, along its ray
    let (x, y) = (seen.x / t, seen.y / t);
    // Small angles: a few degrees of θ_x and of heading against the seam; the cubic term is 0.4 % of tan at 0.25 rad.
    let slope = angle * (1.0 + angle * angle * (1.0 / 3.0));
    let (dx, dy) = (-slope, 1.0); // the image's y axis points down, Σ_S's up
    let dt = -t / (x - h * mount.slit_tangent) * dx;
    Vector3::new(dx * t + x * dt, dy * t + y * dt, -h * dt)
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
    use crate::job::path::Travel;
    use nalgebra::Matrix3;

    const TRAVEL: Travel = Travel {
        speed: 0.3,
        acceleration: 2.0,
        centripetal: 3.0,
        lead: 0.080,
    };

    fn straight(s: f32) -> ([f32; 3], [f32; 3], [f32; 3]) {
        ([0.4 + s, -0.1, 0.2], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    }

    fn mount() -> SensorMount {
        let pose = Pose {
            r: Matrix3::identity(),
            p: Vector3::new(0.080, 0.0, 0.0),
        };
        SensorMount {
            pose,
            camera_height: 0.150,
            slit_tangent: 1.0,
        }
    }

    /// What an ideal sensor on a nozzle at `t_b_n` says of a seam through `origin` along x whose sheet is rolled by `roll`.
    fn sight(t_b_n: &Pose, origin: Vector3<f32>, roll: f32) -> Sighting {
        let t_s_b = (*t_b_n * mount().pose).inverse();
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
        let mut corrections = Corrections::new(HoldKind::First, path.first());
        // The hand is turned, tilted and displaced: none of it may matter.
        let t_b_n = Pose {
            r: rot_z(0.05) * rot_x(0.03),
            p: Vector3::new(0.502, -0.099, 0.201),
        };
        let seam = Vector3::new(0.4, -0.1 + 0.0021, 0.2 - 0.0013);
        let sighting = sight(&t_b_n, seam, 0.04);
        let mut take = |station| corrections.take(&sighting, &mount(), &path, &Pose::identity(), &t_b_n, station);
        assert_eq!((take(0.102), take(0.102)), (Use::Waiting, Use::Used));
        let station = corrections.newest().unwrap();
        let [lateral, height, roll] = corrections.at(station);
        assert!((station - 0.182).abs() < 4e-3, "seen about a lead ahead: {station} m");
        assert!((lateral - 0.0021).abs() < 3e-6, "{lateral} m");
        assert!((height + 0.0013).abs() < 3e-6, "{height} m");
        assert!((roll - 0.04).abs() < 1e-3, "{roll} rad");
    }

    #[test]
    fn a_wrong_sighting_is_never_used_alone() {
        let path = TaughtPath::new(0.5, &TRAVEL, straight).unwrap();
        let mut corrections = Corrections::new(HoldKind::First, path.first());
        let mut take = |station: f32, lateral: f32| {
            let t_b_n = Pose {
                r: Matrix3::identity(),
                p: Vector3::new(0.4 + station, -0.1, 0.2),
            };
            let sighting = sight(&t_b_n, Vector3::new(0.4, -0.1 + lateral, 0.2), 0.0);
            corrections.take(&sighting, &mount(), &path, &Pose::identity(), &t_b_n, station)
        };
        assert_eq!(take(0.000, 0.0000), Use::Waiting);
        assert_eq!(take(0.003, 0.0002), Use::Used);
        assert_eq!(take(0.030, 0.0012), Use::Waiting, "drawn to a glint");
        assert_eq!(take(0.033, 0.0003), Use::Waiting, "contradicts it");
        assert_eq!(take(0.036, 0.0002), Use::Used, "the third settles it");
        assert_eq!(take(0.033, 0.0002), Use::OffPath, "no news from behind the newest");
        assert_eq!(take(0.042, 0.0002), Use::Known, "near the newest, and the same");
        assert_eq!(take(0.060, 0.0004), Use::Waiting);
        assert_eq!(
            take(0.090, 0.0004),
            Use::Waiting,
            "too far on to speak of the same place"
        );
        assert_eq!(take(0.120, 0.0130), Use::Outlier, "out of reach");
    }
}
