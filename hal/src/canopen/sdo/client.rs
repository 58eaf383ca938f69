//! The client's side: one transfer at a time, from request to outcome.

use super::{Abort, Request, Response};
use crate::canopen::object::{Address, Number};
use heapless::Vec;

/// Longest string the client takes, bytes.
pub const TEXT_MAX: usize = 32;

/// How a transfer ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The object was written.
    Written,
    /// The object's value.
    Number(Number),
    /// The object's value, a string.
    Text(Vec<u8, TEXT_MAX>),
    /// Refused by the server, or by us ([`Abort::TIMEOUT`], [`Abort::TOGGLE`], [`Abort::MEMORY`]).
    Aborted(Abort),
}

/// A transfer with one server. Time is counted in the owner's cycles.
#[derive(Clone, Debug)]
pub struct Client {
    /// What goes out next, if anything.
    outbox: Option<Request>,
    /// The transfer under way: its object.
    pending: Option<Address>,
    toggle: bool,
    text: Vec<u8, TEXT_MAX>,
    waited: u32,
    timeout: u32,
}

impl Client {
    /// A client that waits `timeout` cycles for each answer.
    pub const fn new(timeout: u32) -> Self {
        Self {
            outbox: None,
            pending: None,
            toggle: false,
            text: Vec::new(),
            waited: 0,
            timeout,
        }
    }

    /// Whether a transfer is under way.
    pub fn is_busy(&self) -> bool {
        self.pending.is_some()
    }

    /// Begins to read an object. A transfer under way is forgotten.
    pub fn read(&mut self, address: Address) {
        self.begin(address, Request::Upload(address));
    }

    /// Begins to write an object. A transfer under way is forgotten.
    pub fn write(&mut self, address: Address, number: Number) {
        self.begin(address, Request::Download(address, number));
    }

    fn begin(&mut self, address: Address, request: Request) {
        self.outbox = Some(request);
        self.pending = Some(address);
        self.toggle = false;
        self.text.clear();
        self.waited = 0;
    }

    /// The message to send now, if any; its time to answer starts here.
    pub fn transmit(&mut self) -> Option<[u8; 8]> {
        let request = self.outbox.take()?;
        self.waited = 0;
        Some(request.encode())
    }

    /// Takes the server's message; an outcome ends the transfer. Messages about other objects are not ours.
    pub fn receive(&mut self, bytes: &[u8; 8]) -> Option<Outcome> {
        let address = self.pending?;
        if self.outbox.is_some() {
            return None; // nothing has been asked yet: this answers an older, forgotten transfer
        }
        let outcome = match Response::decode(bytes)? {
            Response::Downloaded(of) if of == address => Outcome::Written,
            Response::Uploaded(of, number) if of == address => Outcome::Number(number),
            Response::Abort(of, abort) if of == address => Outcome::Aborted(abort),
            Response::UploadStarted(of, _) if of == address => {
                self.outbox = Some(Request::Segment { toggle: false });
                return None;
            }
            Response::Segment {
                toggle,
                data,
                len,
                last,
            } => {
                if toggle != self.toggle {
                    self.give_up(address, Abort::TOGGLE)
                } else if self.text.extend_from_slice(data.get(..len as usize)?).is_err() {
                    self.give_up(address, Abort::MEMORY)
                } else if last {
                    Outcome::Text(self.text.clone())
                } else {
                    self.toggle = !toggle;
                    self.outbox = Some(Request::Segment { toggle: self.toggle });
                    return None;
                }
            }
            _ => return None,
        };
        self.pending = None;
        Some(outcome)
    }

    /// Lets one cycle pass; an answer that is overdue ends the transfer.
    pub fn cycle(&mut self) -> Option<Outcome> {
        let address = self.pending?;
        if self.outbox.is_some() {
            return None;
        }
        self.waited = self.waited.saturating_add(1);
        if self.waited <= self.timeout {
            return None;
        }
        self.pending = None;
        Some(self.give_up(address, Abort::TIMEOUT))
    }

    fn give_up(&mut self, address: Address, abort: Abort) -> Outcome {
        self.outbox = Some(Request::Abort(address, abort));
        Outcome::Aborted(abort)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Server;
    use super::*;
    use crate::canopen::object::at;

    #[test]
    fn a_string_of_any_length_up_to_32_comes_whole_through_both_ends() {
        const TEXT: &str = "emulated servo drive, 300 W main";
        for len in 1..=TEXT.len() {
            let (mut client, mut server) = (Client::new(10), Server::default());
            client.read(at(0x1008, 0));
            let outcome = loop {
                let request = Request::decode(&client.transmit().unwrap()).unwrap();
                let response = match request {
                    Request::Upload(address) => server.start(address, &TEXT[..len]),
                    Request::Segment { toggle } => server.segment(toggle),
                    other => panic!("{other:?}"),
                };
                if let Some(outcome) = client.receive(&response.encode()) {
                    break outcome;
                }
            };
            assert_eq!(
                outcome,
                Outcome::Text(Vec::from_slice(&TEXT.as_bytes()[..len]).unwrap())
            );
        }
    }

    #[test]
    fn silence_of_three_cycles_ends_a_transfer_and_tells_the_server() {
        let mut client = Client::new(3);
        client.read(at(0x1000, 0));
        assert_eq!(client.cycle(), None, "not sent yet: its time has not started");
        client.transmit();
        assert!((0..3).all(|_| client.cycle().is_none()));
        assert_eq!(client.cycle(), Some(Outcome::Aborted(Abort::TIMEOUT)));
        assert!(!client.is_busy());
        assert_eq!(client.transmit().map(|bytes| bytes[0]), Some(0x80));
    }

    #[test]
    fn a_wrong_toggle_is_refused_by_either_end() {
        let mut server = Server::default();
        server.start(at(0x1008, 0), "longer than one segment");
        assert_eq!(server.segment(true), Response::Abort(at(0x1008, 0), Abort::TOGGLE));
        let mut client = Client::new(3);
        client.read(at(0x1008, 0));
        client.transmit();
        client.receive(&Response::UploadStarted(at(0x1008, 0), 9).encode());
        client.transmit();
        let wrong = Response::Segment {
            toggle: true,
            data: [0; 7],
            len: 7,
            last: false,
        };
        assert_eq!(client.receive(&wrong.encode()), Some(Outcome::Aborted(Abort::TOGGLE)));
    }
}
