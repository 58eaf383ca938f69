//! The parameter region: where an image finds what it is to be, and how it knows that all of it is there.
//!
//! A head of [`HEAD`] bytes (mark, length, hash), then the byte form ([`crate::wire`]) of whatever the image reads. On
//! silicon it is a flash sector, in the emulator RAM that is loaded before the start.

use crate::wire::{Fnv64, Sink, Wire};

/// First word of a region that holds parameters: "TSK1".
const MARK: u32 = u32::from_le_bytes(*b"TSK1");

/// Bytes of the head: mark, length, hash.
pub const HEAD: usize = 4 + 4 + 8;

/// Why a region is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegionError {
    /// The mark is missing: nothing was ever stored here.
    Empty,
    /// The length in the head is over the region's.
    Length(u32),
    /// The bytes do not have the hash that the head says.
    Hash,
    /// The bytes are sound but are no legal value of what the image reads: written by another version.
    Value,
}

/// The head of a region that is to hold `body`.
pub fn head(body: &[u8]) -> [u8; HEAD] {
    let mut head = [0; HEAD];
    let mut writer = Writer {
        rest: head.as_mut_slice(),
    };
    MARK.write(&mut writer);
    (body.len() as u32).write(&mut writer);
    hash(body).write(&mut writer);
    head
}

/// The bytes that a region holds.
pub fn open(region: &[u8]) -> Result<&[u8], RegionError> {
    let mut rest = region;
    if u32::read(&mut rest) != Some(MARK) {
        return Err(RegionError::Empty);
    }
    let (Some(length), Some(stored)) = (u32::read(&mut rest), u64::read(&mut rest)) else {
        return Err(RegionError::Empty);
    };
    let body = rest.get(..length as usize).ok_or(RegionError::Length(length))?;
    if hash(body) == stored {
        Ok(body)
    } else {
        Err(RegionError::Hash)
    }
}

/// Fills a value from a region's bytes.
pub fn fill_one<T: Wire>(region: &[u8], value: &mut T) -> Result<(), RegionError> {
    let mut body = open(region)?;
    match value.fill(&mut body) {
        Some(()) if body.is_empty() => Ok(()),
        _ => Err(RegionError::Value),
    }
}

/// Fills two values, one after the other, from a region's bytes.
pub fn fill<A: Wire, B: Wire>(region: &[u8], a: &mut A, b: &mut B) -> Result<(), RegionError> {
    let mut body = open(region)?;
    match a.fill(&mut body).and_then(|()| b.fill(&mut body)) {
        Some(()) if body.is_empty() => Ok(()),
        _ => Err(RegionError::Value),
    }
}

fn hash(body: &[u8]) -> u64 {
    let mut hash = Fnv64::default();
    hash.put(body);
    hash.0
}

/// Writes into what is left of a slice.
struct Writer<'a> {
    rest: &'a mut [u8],
}

impl Sink for Writer<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let rest = core::mem::take(&mut self.rest);
        if let Some((head, tail)) = rest.split_at_mut_checked(bytes.len()) {
            head.copy_from_slice(bytes);
            self.rest = tail;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn region() -> Vec<u8> {
        let mut body = Vec::new();
        body.extend_from_slice(&7u32.to_le_bytes());
        body.extend_from_slice(&2.5f32.to_le_bytes());
        let mut region = head(&body).to_vec();
        region.extend(body);
        region.extend([0xFF; 32]); // flash beyond what was written
        region
    }

    fn read<A: Wire, B: Wire>(region: &[u8]) -> Result<(A, B), RegionError> {
        let (mut a, mut b) = (A::EMPTY, B::EMPTY);
        fill(region, &mut a, &mut b).map(|()| (a, b))
    }

    #[test]
    fn what_was_stored_is_read() {
        assert_eq!(read::<u32, f32>(&region()), Ok((7, 2.5)));
        let mut pair = (0_u32, 0.0_f32);
        assert_eq!(fill_one(&region(), &mut pair).map(|()| pair), Ok((7, 2.5)));
        assert_eq!(fill_one(&region(), &mut 0_u32), Err(RegionError::Value));
    }

    #[test]
    fn erased_flash_a_flipped_bit_a_wild_length_and_another_version_are_told_apart() {
        assert_eq!(read::<u32, f32>(&[0xFF; 64]), Err(RegionError::Empty));
        let mut flipped = region();
        flipped[HEAD + 2] ^= 0x10;
        assert_eq!(read::<u32, f32>(&flipped), Err(RegionError::Hash));
        let mut wild = region();
        wild[5] = 0x7F;
        assert_eq!(read::<u32, f32>(&wild), Err(RegionError::Length(0x7F08)));
        assert_eq!(read::<u32, u64>(&region()), Err(RegionError::Value));
        assert_eq!(read::<u32, u8>(&region()), Err(RegionError::Value));
    }
}
