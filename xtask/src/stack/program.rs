//! An image's functions: where they stand, what they call, and the frame of each.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};
use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

use super::thumb;

/// One function.
#[derive(Clone, Debug)]
pub struct Function {
    /// Its names; functions with the same code are one.
    pub names: Vec<String>,
    /// Its stack frame, bytes.
    pub frame: u32,
    /// The functions that it calls or goes on to, by address.
    pub calls: Vec<u32>,
}

/// An image.
pub struct Program {
    /// By address.
    pub functions: BTreeMap<u32, Function>,
    /// Entries of the vector table behind the stack pointer; zero is none.
    pub vectors: Vec<u32>,
    /// Functions whose frame the compiler did not say: assembly and what was compiled elsewhere. Theirs is read from their code.
    pub read_from_code: Vec<String>,
}

impl Program {
    /// Reads an ELF file with `.stack_sizes`.
    pub fn read(file: &[u8]) -> Result<Self> {
        let elf: ElfFile32 = ElfFile32::parse(file)?;
        let section = |name: &str| {
            let section = elf
                .section_by_name(name)
                .with_context(|| format!("no section {name}"))?;
            Ok::<_, anyhow::Error>((section.address() as u32, section.data()?))
        };
        let frames = stack_sizes(section(".stack_sizes")?.1).context("section .stack_sizes")?;
        let (base, text) = section(".text")?;

        // Names and ends of functions, and where data lies between them.
        let mut names: BTreeMap<u32, (Vec<String>, u32)> = BTreeMap::new();
        let mut kinds: BTreeMap<u32, bool> = BTreeMap::new();
        for symbol in elf.symbols() {
            let (address, name) = (symbol.address() as u32, symbol.name()?);
            match name.as_bytes() {
                [b'$', b't' | b'd', ..] => {
                    kinds.insert(address, name.starts_with("$t"));
                }
                _ if symbol.kind() == SymbolKind::Text && symbol.is_definition() => {
                    let (all, size) = names.entry(address & !1).or_default();
                    all.push(name.to_string());
                    *size = (*size).max(symbol.size() as u32);
                }
                _ => {}
            }
        }
        let is_code = |at: u32| kinds.range(..=at).next_back().is_none_or(|(_, code)| *code);

        let mut functions = BTreeMap::new();
        let mut read_from_code = Vec::new();
        let starts: Vec<u32> = names.keys().copied().collect();
        for (at, (start, (names, size))) in names.into_iter().enumerate() {
            let next = starts.get(at + 1).copied().unwrap_or(base + text.len() as u32);
            let end = if size == 0 { next } else { start + size };
            let Some(bytes) = start
                .checked_sub(base)
                .and_then(|from| text.get(from as usize..(end - base) as usize))
            else {
                continue; // a linker's symbol, not of a function
            };
            let code: Vec<(u32, u16)> = (start..)
                .step_by(2)
                .zip(bytes.chunks_exact(2).map(|half| u16::from_le_bytes([half[0], half[1]])))
                .filter(|(address, _)| is_code(*address))
                .collect();
            let body = thumb::read(start, end, &code).with_context(|| format!("in {}", names.join(", ")))?;
            let frame = match frames.get(&start) {
                Some(&said) => {
                    ensure!(
                        body.lowered >= said,
                        "{}: the compiler says {said} bytes of stack, its code shows {}: an instruction is not understood",
                        names.join(", "),
                        body.lowered
                    );
                    said
                }
                None => {
                    read_from_code.push(names.join(", "));
                    body.lowered
                }
            };
            let calls = body.targets;
            functions.insert(start, Function { names, frame, calls });
        }
        let (_, table) = section(".vector_table")?;
        let words = table.chunks_exact(4).skip(1);
        Ok(Self {
            functions,
            vectors: words
                .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
                .collect(),
            read_from_code,
        })
    }

    /// The function called `name`, by address.
    pub fn find(&self, name: &str) -> Result<u32> {
        let mut all = self.functions.iter();
        let found = all.find(|(_, function)| function.names.iter().any(|other| other == name));
        found
            .map(|(address, _)| *address)
            .with_context(|| format!("no function {name}"))
    }

    /// Deepest stack of the function at `start` and all that it calls, but for what is in `without`, and the way there.
    pub fn depth(&self, start: u32, without: &[u32]) -> Result<(u32, Vec<&str>)> {
        self.deepest(start, without, &mut Vec::new(), &mut BTreeMap::new())
    }

    fn deepest<'a>(
        &'a self,
        at: u32,
        without: &[u32],
        above: &mut Vec<u32>,
        known: &mut BTreeMap<u32, (u32, Vec<&'a str>)>,
    ) -> Result<(u32, Vec<&'a str>)> {
        if let Some(known) = known.get(&at) {
            return Ok(known.clone());
        }
        let function = self
            .functions
            .get(&at)
            .with_context(|| format!("a call to {at:#x}, which is the beginning of no function"))?;
        let name = function.names.first().map_or("", String::as_str);
        if above.contains(&at) {
            bail!("{name} calls itself, directly or through others: its stack has no bound");
        }
        above.push(at);
        let mut deepest = (0, Vec::new());
        for call in function.calls.iter().filter(|call| !without.contains(call)) {
            let below = self.deepest(*call, without, above, known)?;
            if below.0 > deepest.0 {
                deepest = below;
            }
        }
        above.pop();
        let (below, mut way) = deepest;
        way.insert(0, name);
        known.insert(at, (below + function.frame, way.clone()));
        Ok((below + function.frame, way))
    }
}

/// Reads `.stack_sizes`: an address and a size in LEB128, again and again.
fn stack_sizes(mut bytes: &[u8]) -> Result<BTreeMap<u32, u32>> {
    let mut sizes = BTreeMap::new();
    while let Some((address, rest)) = bytes.split_first_chunk::<4>() {
        bytes = rest;
        let (mut size, mut shift) = (0u32, 0);
        loop {
            let Some((byte, rest)) = bytes.split_first() else {
                bail!("ends within a number");
            };
            bytes = rest;
            ensure!(shift < 28, "a frame of 256 MiB or more");
            size |= u32::from(byte & 0x7F) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                break;
            }
        }
        let frame = sizes.entry(u32::from_le_bytes(*address) & !1).or_insert(0);
        *frame = size.max(*frame); // one code for functions with several names
    }
    ensure!(bytes.is_empty(), "ends within an address");
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(functions: &[(u32, u32, &[u32])]) -> Program {
        let function = |(at, frame, calls): &(u32, u32, &[u32])| {
            let names = vec![format!("f{at}")];
            let calls = calls.to_vec();
            (
                *at,
                Function {
                    names,
                    frame: *frame,
                    calls,
                },
            )
        };
        Program {
            functions: functions.iter().map(function).collect(),
            vectors: Vec::new(),
            read_from_code: Vec::new(),
        }
    }

    #[test]
    fn the_deepest_way_counts_and_not_the_longest_one() {
        let program = program(&[(1, 8, &[2, 3]), (2, 8, &[4]), (3, 100, &[]), (4, 16, &[])]);
        assert_eq!(program.depth(1, &[]).unwrap(), (108, vec!["f1", "f3"]));
        assert_eq!(program.depth(1, &[3]).unwrap(), (32, vec!["f1", "f2", "f4"]));
    }

    #[test]
    fn recursion_and_a_call_into_nothing_are_refused_by_name() {
        let round = program(&[(1, 8, &[2]), (2, 8, &[1])]);
        assert!(
            round
                .depth(1, &[])
                .unwrap_err()
                .to_string()
                .starts_with("f1 calls itself")
        );
        let lost = program(&[(1, 8, &[0x40])]);
        assert!(lost.depth(1, &[]).unwrap_err().to_string().contains("0x40"));
    }

    #[test]
    fn sizes_of_one_and_two_bytes_are_read_and_half_a_one_is_refused() {
        let bytes = [0x01, 0x10, 0, 0, 0x18, 0x00, 0x20, 0, 0, 0xF0, 0x02];
        assert_eq!(
            stack_sizes(&bytes).unwrap(),
            BTreeMap::from([(0x1000, 24), (0x2000, 368)])
        );
        assert!(stack_sizes(&bytes[..10]).is_err());
        assert!(stack_sizes(&bytes[..8]).is_err());
    }
}
