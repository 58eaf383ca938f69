//! The server's side of a segmented upload: which part of which string comes next.

use super::{Abort, Response};
use crate::canopen::object::Address;

/// An upload in segments under way, if any.
#[derive(Clone, Copy, Debug, Default)]
pub struct Server {
    address: Address,
    rest: &'static [u8],
    toggle: bool,
    active: bool,
}

impl Server {
    /// Begins to send `text`.
    pub fn start(&mut self, address: Address, text: &'static str) -> Response {
        *self = Self {
            address,
            rest: text.as_bytes(),
            toggle: false,
            active: true,
        };
        Response::UploadStarted(address, text.len() as u32)
    }

    /// The next segment, for a request with this toggle.
    pub fn segment(&mut self, toggle: bool) -> Response {
        if !self.active {
            return Response::Abort(self.address, Abort::COMMAND);
        }
        if toggle != self.toggle {
            self.stop();
            return Response::Abort(self.address, Abort::TOGGLE);
        }
        let mut data = [0; 7];
        let mut len = 0;
        for (to, from) in data.iter_mut().zip(self.rest) {
            *to = *from;
            len += 1;
        }
        self.rest = self.rest.get(len as usize..).unwrap_or(&[]);
        self.toggle = !toggle;
        self.active = !self.rest.is_empty();
        Response::Segment {
            toggle,
            data,
            len,
            last: !self.active,
        }
    }

    /// Forgets the upload.
    pub fn stop(&mut self) {
        self.active = false;
    }
}
