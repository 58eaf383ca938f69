//! TMP
use sim_host::camera::detection::{Detection, Method};
use sim_host::camera::scene::JointKind;
use sim_host::cell::panel::{Side, Surface};
fn main() {
    let n: u64 = std::env::args().nth(1).map_or(500, |t| t.parse().unwrap());
    let seed: u64 = std::env::args().nth(2).map_or(2, |t| t.parse().unwrap());
    let which = std::env::args().nth(3).unwrap_or("cp".into());
    let mut kinds = vec![];
    if which.contains('c') { kinds.push(JointKind::Crank(Side::Left)); }
    if which.contains('r') { kinds.push(JointKind::Crank(Side::Right)); }
    if which.contains('v') { kinds.push(JointKind::Vee); }
    if which.contains('l') { kinds.push(JointKind::Lip(Side::Left)); }
    if which.contains('k') { kinds.push(JointKind::Lip(Side::Right)); }
    if which.contains('p') { kinds.push(JointKind::Plain); }
    for kind in kinds {
        for s in [Surface::Clean, Surface::Moderate, Surface::Harsh] {
            if s == Surface::Clean && !which.contains('0') { continue }
            let r = Detection::measure(Method::Sensor, s, kind, seed, n);
            let bad: Vec<_> = r.found.iter().filter(|f| f.1.abs() > 0.0005).map(|f| (f.0, (f.1*1e5).round()/100.0, (f.2*1e5).round()/100.)).collect();
            println!("{kind:?} {s:?}: {:.1} / {:.1} / {:.1}, rms {:.3} {:.3}, refused {:?}, bad {} wrong {:?} {:?}", 100.*r.within(0.00025), 100.*r.within(0.0005), 100.*r.within(0.001), r.rms().0*1e3, r.rms().1*1e3, r.refused, bad.len(), r.unflagged(0.001), &bad[..bad.len().min(12)]);
        }
    }
}
