//! The parameter region of an image: what the emulator loads before the start, and what `cargo xtask flash --params` writes to
//! a board ([`hal::board::parameters`]).

use crate::log::bytes_of;
use firmware::cycle::{Params, Second};
use hal::board::parameters;
use hal::master::MasterConfig;

/// The region that holds `body`.
pub fn with_head(body: &[u8]) -> Vec<u8> {
    let mut region = parameters::head(body).to_vec();
    region.extend_from_slice(body);
    region
}

/// What the controller's image reads, without head: the bus, then the core's parameters, then those of what moves beside the sealing arm.
pub fn of_controller<const N: usize>(master: &MasterConfig<N>, params: &Params, second: &impl Second) -> Vec<u8> {
    let mut body = bytes_of(master);
    body.extend(bytes_of(params));
    body.extend(bytes_of(second));
    body
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::seal::scenario::Options;
    use crate::seal::setup::Setup;
    use hal::wire::Wire;

    #[test]
    fn the_controller_finds_in_its_region_what_it_was_given() {
        let setup = Setup::new(&Options::told(), &Model::k3s(), 1).unwrap();
        let mut region = with_head(&of_controller(&setup.master, &setup.params, &()));
        region.resize(128 * 1024, 0xFF); // erased flash up to the end of the sector
        let (mut master, mut params) = (MasterConfig::EMPTY, Params::EMPTY);
        parameters::fill(&region, &mut master, &mut params).unwrap();
        assert_eq!(master, setup.master);
        assert_eq!(bytes_of(&params), bytes_of(&setup.params));
    }
}
