//! Fixed-size little-endian byte form of plain values.
//!
//! One encoding serves the run log, its hash, and the channel to an emulated target, so that "the same bits" means the
//! same thing everywhere. No lengths and no tags: a type's size is [`Wire::BYTES`], always.

/// Takes bytes in order: a slice writer, a hash, a file.
pub trait Sink {
    /// Appends `bytes`.
    fn put(&mut self, bytes: &[u8]);
}

/// A value with a fixed-size byte form.
pub trait Wire: Sized {
    /// Length of the byte form.
    const BYTES: usize;
    /// Writes exactly [`Self::BYTES`] bytes.
    fn write(&self, sink: &mut impl Sink);
    /// Takes [`Self::BYTES`] bytes off the front of `source`; `None` if it is too short or holds no legal value.
    fn read(source: &mut &[u8]) -> Option<Self>;
}

macro_rules! wire_number {
    ($($number:ty),*) => {$(
        impl Wire for $number {
            const BYTES: usize = size_of::<$number>();
            fn write(&self, sink: &mut impl Sink) {
                sink.put(&self.to_le_bytes());
            }
            fn read(source: &mut &[u8]) -> Option<Self> {
                let (head, tail) = source.split_first_chunk()?;
                *source = tail;
                Some(Self::from_le_bytes(*head))
            }
        }
    )*};
}
wire_number!(u8, i8, u16, i16, u32, i32, u64, f32);

impl Wire for bool {
    const BYTES: usize = 1;
    fn write(&self, sink: &mut impl Sink) {
        sink.put(&[*self as u8]);
    }
    fn read(source: &mut &[u8]) -> Option<Self> {
        match u8::read(source)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl<T: Wire + Copy + Default, const N: usize> Wire for [T; N] {
    const BYTES: usize = N * T::BYTES;
    fn write(&self, sink: &mut impl Sink) {
        for item in self {
            item.write(sink);
        }
    }
    fn read(source: &mut &[u8]) -> Option<Self> {
        let mut items = [T::default(); N];
        for item in &mut items {
            *item = T::read(source)?;
        }
        Some(items)
    }
}

impl<T: Wire + Default> Wire for Option<T> {
    const BYTES: usize = 1 + T::BYTES;
    fn write(&self, sink: &mut impl Sink) {
        self.is_some().write(sink);
        match self {
            Some(value) => value.write(sink),
            None => T::default().write(sink),
        }
    }
    fn read(source: &mut &[u8]) -> Option<Self> {
        let some = bool::read(source)?;
        let value = T::read(source)?;
        Some(some.then_some(value))
    }
}

/// Implements [`Wire`] for a struct, field by field in the order given.
#[macro_export]
macro_rules! wire_struct {
    ($name:ident $(<const $n:ident: usize>)? { $($field:ident: $kind:ty),* $(,)? }) => {
        impl $(<const $n: usize>)? $crate::wire::Wire for $name $(<$n>)? {
            const BYTES: usize = 0 $(+ <$kind as $crate::wire::Wire>::BYTES)*;
            fn write(&self, sink: &mut impl $crate::wire::Sink) {
                $($crate::wire::Wire::write(&self.$field, sink);)*
            }
            fn read(source: &mut &[u8]) -> Option<Self> {
                Some(Self { $($field: <$kind as $crate::wire::Wire>::read(source)?),* })
            }
        }
    };
}

/// Implements [`Wire`] for a field-less enum as its `u8` code; a code that is not listed reads as `None`.
#[macro_export]
macro_rules! wire_enum {
    ($name:ident { $($variant:ident),* $(,)? }) => {
        impl $crate::wire::Wire for $name {
            const BYTES: usize = 1;
            fn write(&self, sink: &mut impl $crate::wire::Sink) {
                sink.put(&[*self as u8]);
            }
            fn read(source: &mut &[u8]) -> Option<Self> {
                let code = <u8 as $crate::wire::Wire>::read(source)?;
                $(if code == Self::$variant as u8 { return Some(Self::$variant); })*
                None
            }
        }
    };
}

/// 64-bit FNV-1a (Fowler, Noll, Vo), the hash of logs and outputs: byte-serial, so it is the same on every machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv64(pub u64);

impl Default for Fnv64 {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325) // the offset basis
    }
}

impl Sink for Fnv64 {
    fn put(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}
