//! What an image was linked from, read off its symbols.

/// Names of all functions in a 32-bit little-endian ELF file.
pub fn names(elf: &[u8]) -> Option<Vec<String>> {
    const SYMBOLS: u32 = 2;
    const FUNCTION: u8 = 2;
    let word = |at: usize| Some(u32::from_le_bytes(*elf.get(at..)?.first_chunk()?));
    let half = |at: usize| Some(usize::from(u16::from_le_bytes(*elf.get(at..)?.first_chunk()?)));
    let (table, entry, count) = (word(0x20)? as usize, half(0x2E)?, half(0x30)?);
    let header = |k: usize| table + k * entry;
    // Offset and size of a section's contents.
    let contents = |k: usize| Some((word(header(k) + 16)? as usize, word(header(k) + 20)? as usize));
    let symbols = (0..count).find(|k| word(header(*k) + 4) == Some(SYMBOLS))?;
    let (first, bytes) = contents(symbols)?;
    let (strings, _) = contents(word(header(symbols) + 24)? as usize)?;
    let mut names = Vec::new();
    for symbol in (first..first + bytes).step_by(16) {
        if elf.get(symbol + 12)? & 0xF == FUNCTION {
            let name = elf.get(strings + word(symbol)? as usize..)?;
            let length = name.iter().position(|byte| *byte == 0)?;
            names.push(String::from_utf8_lossy(&name[..length]).into_owned());
        }
    }
    Some(names)
}

/// How many of `names` belong to core's panic machinery.
pub fn panics(names: &[String]) -> usize {
    names.iter().filter(|name| name.contains("panic")).count()
}

/// Those of `names` that compute in double precision, which the Cortex-M4F does in software: the run-time routines of the Arm EABI (RTABI,
/// section 4.1.2: double arithmetic, comparison and conversion) and LLVM's names for them. All double routines of `libm` call one of them.
pub fn doubles(names: &[String]) -> Vec<&str> {
    let is_double = |name: &&str| {
        let routine = name.trim_start_matches('_');
        let arm = [
            "aeabi_d",
            "aeabi_cd",
            "aeabi_f2d",
            "aeabi_i2d",
            "aeabi_ui2d",
            "aeabi_l2d",
            "aeabi_ul2d",
        ];
        let other = [
            "adddf",
            "subdf",
            "muldf",
            "divdf",
            "negdf",
            "extendsfdf",
            "truncdfsf",
            "powidf",
            "unorddf",
        ];
        arm.iter().chain(&other).any(|start| routine.starts_with(start))
            || (routine.starts_with("fix") && routine.contains("df"))
            || (routine.starts_with("float") && routine.contains("df"))
            || (routine.len() == 5 && routine.ends_with("df2"))
    };
    names.iter().map(String::as_str).filter(is_double).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| name.to_string()).collect()
    }

    #[test]
    fn double_arithmetic_is_told_from_integers_and_floats() {
        let names = [
            "__aeabi_dmul",
            "__aeabi_d2f",
            "__adddf3",
            "__floatsidf",
            "__fixdfsi",
            "__ltdf2",
            "__aeabi_cdcmple",
        ];
        assert_eq!(doubles(&owned(&names)), names);
        let others = [
            "__aeabi_memcpy",
            "__aeabi_uldivmod",
            "__aeabi_fmul",
            "__floatsisf",
            "__udivdi3",
            "main",
        ];
        assert!(doubles(&owned(&others)).is_empty());
    }

    #[test]
    fn panics_are_counted_by_name() {
        let names = [
            "_ZN4core9panicking5panic17h0E",
            "rust_begin_unwind",
            "_ZN4core9panicking9panic_fmt17h1E",
        ];
        assert_eq!(panics(&owned(&names)), 2);
    }

    #[test]
    fn names_are_those_of_functions_and_of_nothing_else() {
        // Section headers at 0x34: nothing, symbols, strings.
        let mut elf = vec![0; 0x34 + 3 * 40];
        let symbols = elf.len();
        for (name, kind) in [(1u32, 2u8), (6, 1)] {
            let mut symbol = [0; 16];
            symbol[..4].copy_from_slice(&name.to_le_bytes());
            symbol[12] = kind;
            elf.extend(symbol);
        }
        let strings = elf.len();
        elf.extend(b"\0main\0data\0");
        elf[0x20] = 0x34;
        elf[0x2E] = 40;
        elf[0x30] = 3;
        let mut put = |section: usize, field: usize, value: u32| {
            let at = 0x34 + section * 40 + field;
            elf[at..at + 4].copy_from_slice(&value.to_le_bytes());
        };
        put(1, 4, 2);
        put(1, 16, symbols as u32);
        put(1, 20, 32);
        put(1, 24, 2);
        put(2, 16, strings as u32);
        assert_eq!(names(&elf), Some(owned(&["main"])));
        assert_eq!(names(&elf[..0x60]), None);
    }
}
