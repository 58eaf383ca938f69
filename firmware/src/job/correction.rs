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
use hal::{wire_enum, wire_struct};
use nalgebra::Vector3;

/// Furthest that a correction may reach, m: half the sensor's 30 mm view, less the margin that the slit needs at its edge.
pub const REACH: f32 = 0.012;

/// Furthest that a sighting may lie from what its neighbours let expect, m. A plate that bends ±2 mm within 150 mm moves by 3.2 mm
/// against a straight line through two sightings 30 mm apart; nothing on a plate moves faster.
const SURPRISE: f32 = 0.0035;

/// Distance in which a sighting that came late is answered, m: two thirds of the distance between two at 0.3 m/s and 100 ms. The
/// hold takes none that come nearer together than a third of it.
const ANSWER: f32 = 0.020;

/// Steps of the search for the station of a sighting: each divides the error by ten or more on R150.
const STATION_STEPS: usize = 3;

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
    /// It became a correction.
    Used,
    /// The sensor refused the frame; the refusal's number came with it.
    Refused,
    /// Its exposure is no longer in the ring of past cycles, or never was.
    Stale,
    /// It lies off the stretch that is to be sealed, or behind one that is already known.
    OffPath,
    /// It contradicts its neighbours, or lies out of reach.
    Outlier,
}

wire_enum!(Use {
    None,
    Used,
    Refused,
    Stale,
    OffPath,
    Outlier
});

/// The seam's deviation from the taught path, by station.
#[derive(Clone, Debug)]
pub struct Corrections {
    hold: Hold,
    newest: Option<(f32, [f32; 3])>,
    before: Option<(f32, [f32; 3])>,
    /// A surprising sighting waits here: a second one that agrees with it makes both believable.
    surprise: Option<(f32, [f32; 3])>,
}

impl Corrections {
    /// None yet; the path begins at station `first` (m).
    pub fn new(kind: HoldKind, first: f32) -> Self {
        let hold = Hold::new(
            kind,
            Knot {
                station: first,
                value: [0.0; 3],
            },
            ANSWER,
        );
        Self {
            hold,
            newest: None,
            before: None,
            surprise: None,
        }
    }

    /// Station of the newest correction, m.
    pub fn newest(&self) -> Option<f32> {
        self.newest.map(|(station, _)| station)
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
        let mut s = station + mount.pose.p.x;
        let mut place = path.place(s);
        for _ in 0..STATION_STEPS {
            s += place.tangent.dot(&(point - place.point));
            place = path.place(s);
        }
        // One spacing beyond the ends still serves to lead the hold in and out.
        if s < path.first() || s > path.last() || self.newest.is_some_and(|(newest, _)| s <= newest) {
            return Use::OffPath;
        }
        let away = point - place.point;
        let slit = to_taught.r * slit_direction(seen, sighting.angle_e4 as f32 * 1e-4, mount);
        let deviation = [away.dot(&place.lateral()), away.dot(&place.normal), roll(&place, slit)];
        if deviation[0].abs() > REACH || deviation[1].abs() > REACH {
            return Use::Outlier;
        }
        if !self.believable(s, deviation) {
            self.surprise = Some((s, deviation));
            return Use::Outlier;
        }
        self.surprise = None;
        match self.hold.push(Knot {
            station: s,
            value: deviation,
        }) {
            Ok(()) => {
                self.before = self.newest;
                self.newest = Some((s, deviation));
                Use::Used
            }
            Err(_) => Use::OffPath,
        }
    }

    /// Near enough to the newest deviation, to the line through the two newest, or to a surprise that came before it.
    fn believable(&self, s: f32, deviation: [f32; 3]) -> bool {
        let Some((s1, newest)) = self.newest else { return true };
        let near = |from: [f32; 3]| {
            deviation
                .iter()
                .zip(from)
                .take(2)
                .all(|(d, f)| (d - f).abs() <= SURPRISE)
        };
        let along = self.before.is_some_and(|(s0, before)| {
            let u = (s - s1) / (s1 - s0);
            near([0, 1, 2].map(|i: usize| match (newest.get(i), before.get(i)) {
                (Some(b), Some(a)) => b + (b - a) * u,
                _ => 0.0,
            }))
        });
        near(newest) || along || self.surprise.is_some_and(|(_, surprise)| near(surprise))
    }
}

/// Direction of the lit line on the sheet at `seen`, Σ_S, from its inclination in the image: the derivative along an image row of the
/// exact pinhole triangulation (sealing.md, chapter 3). Not normalised.
fn slit_direction(seen: Vector3<f32>, angle: f32, mount: &SensorMount) -> Vector3<f32> {
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
fn roll(place: &Place, slit: Vector3<f32>) -> f32 {
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
        let used = corrections.take(&sighting, &mount(), &path, &Pose::identity(), &t_b_n, 0.102);
        assert_eq!(used, Use::Used);
        let (station, [lateral, height, roll]) = corrections.newest.unwrap();
        assert!((station - 0.182).abs() < 4e-3, "seen about a lead ahead: {station} m");
        assert!((lateral - 0.0021).abs() < 3e-6, "{lateral} m");
        assert!((height + 0.0013).abs() < 3e-6, "{height} m");
        assert!((roll - 0.04).abs() < 1e-3, "{roll} rad");
    }

    #[test]
    fn a_deviation_that_no_plate_can_have_is_an_outlier_until_another_agrees_with_it() {
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
        assert_eq!(take(0.00, 0.000), Use::Used);
        assert_eq!(take(0.03, 0.006), Use::Outlier);
        assert_eq!(take(0.06, 0.001), Use::Used, "the plate is where it was");
        assert_eq!(take(0.09, 0.007), Use::Outlier);
        assert_eq!(take(0.12, 0.007), Use::Used, "two in a row are believed");
        assert_eq!(take(0.12, 0.007), Use::OffPath, "no news from behind the newest");
        assert_eq!(take(0.15, 0.013), Use::Outlier, "out of reach");
    }
}
