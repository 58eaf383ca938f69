//! As much of the Thumb-2 instruction set as says where a function goes and what it takes of the stack (Arm DDI 0403, A7.7).

use anyhow::{Result, bail};

/// What one function does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Body {
    /// Addresses outside the function that it calls or goes on to.
    pub targets: Vec<u32>,
    /// Bytes by which all its instructions together lower the stack pointer: its frame, or more.
    pub lowered: u32,
}

/// Reads the function at `start`, whose instructions are the halfwords `code` with their addresses. An error names the
/// instruction that goes or lowers the stack where the code alone does not tell.
pub fn read(start: u32, end: u32, code: &[(u32, u16)]) -> Result<Body> {
    let mut body = Body::default();
    let mut at = 0;
    while let Some(&(address, first)) = code.get(at) {
        let second = code.get(at + 1).map_or(0, |(_, second)| *second);
        let wide = matches!(first >> 11, 0b11101..=0b11111);
        at += if wide { 2 } else { 1 };
        let unknown = || format!("{address:#x}: {first:#06x} {second:#06x}");
        if let Some(target) = branch(address, first, second, wide) {
            if !(start..end).contains(&target) {
                body.targets.push(target);
            }
        } else if goes_anywhere(first, second, wide) {
            bail!(
                "{}: a call or jump to an address in a register cannot be followed",
                unknown()
            );
        } else if moves_stack_by_register(first, second, wide) {
            bail!("{}: the stack is lowered by a register", unknown());
        } else {
            body.lowered += lowers(first, second, wide);
        }
    }
    Ok(body)
}

/// Where a direct branch or call goes.
fn branch(address: u32, first: u16, second: u16, wide: bool) -> Option<u32> {
    let (a, b) = (u32::from(first), u32::from(second));
    let offset = if !wide {
        match first >> 12 {
            0b1101 if (first >> 8) & 0xF < 0xE => sign(a & 0xFF, 8) << 1, // B<c>, not UDF or SVC
            0b1110 => sign(a & 0x7FF, 11) << 1,                           // B
            _ => return None,
        }
    } else if a >> 11 == 0b11110 && b & 0x8000 != 0 {
        let (s, j1, j2) = (a >> 10 & 1, b >> 13 & 1, b >> 11 & 1);
        if b & 0x1000 != 0 {
            // BL with bit 14, B.W without.
            let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
            sign(s << 23 | i1 << 22 | i2 << 21 | (a & 0x3FF) << 11 | b & 0x7FF, 24) << 1
        } else if b & 0x4000 == 0 && (a >> 6) & 0xF < 0xE {
            sign(s << 19 | j2 << 18 | j1 << 17 | (a & 0x3F) << 11 | b & 0x7FF, 20) << 1 // B<c>.W
        } else {
            return None; // hints, barriers, special registers
        }
    } else {
        return None;
    };
    Some(address.wrapping_add(4).wrapping_add(offset as u32))
}

/// A number of so many bits as a signed one.
fn sign(value: u32, bits: u32) -> i32 {
    ((value << (32 - bits)) as i32) >> (32 - bits)
}

/// BLX and BX but for the return, and loads and moves into PC but for the return: an address in a register. Table branches stay in their function.
fn goes_anywhere(first: u16, second: u16, wide: bool) -> bool {
    if wide {
        let loads_pc = first & 0xFF70 == 0xF850 && second >> 12 == 0xF;
        let pops_pc = first == 0xF85D && second == 0xFB04;
        loads_pc && !pops_pc
    } else {
        let exchange = first & 0xFF00 == 0x4700 && first & 0xFF != 0x70; // BX LR is the return
        let moves_pc = first & 0xFF87 == 0x4687;
        exchange || moves_pc
    }
}

/// SUB SP, SP, Rm.
fn moves_stack_by_register(first: u16, second: u16, wide: bool) -> bool {
    wide && first & 0xFFEF == 0xEBAD && second >> 8 & 0xF == 13
}

/// Bytes by which an instruction lowers the stack pointer.
fn lowers(first: u16, second: u16, wide: bool) -> u32 {
    let imm8 = u32::from(second & 0xFF);
    if !wide {
        return match first {
            push if push & 0xFE00 == 0xB400 => 4 * (push & 0x1FF).count_ones(),
            sub if sub & 0xFF80 == 0xB080 => 4 * u32::from(sub & 0x7F),
            _ => 0,
        };
    }
    match first {
        0xE92D => 4 * second.count_ones(),                      // PUSH.W
        0xF84D if second & 0x0F00 == 0x0D00 => imm8,            // STR Rt, [SP, #-imm]!
        0xE96D => 4 * imm8,                                     // STRD Rt, Rt2, [SP, #-imm]!
        0xED2D | 0xED6D => 4 * imm8,                            // VPUSH
        _ if second >> 8 & 0xF != 13 => 0,                      // the rest writes SP, or does not count
        sub if sub & 0xFBEF == 0xF1AD => expanded(sub, second), // SUB.W SP, SP, #
        sub if sub & 0xFBFF == 0xF2AD => twelve(sub, second),   // SUBW SP, SP, #
        _ => 0,
    }
}

/// The twelve bits i:imm3:imm8.
fn twelve(first: u16, second: u16) -> u32 {
    u32::from(first >> 10 & 1) << 11 | u32::from(second >> 12 & 7) << 8 | u32::from(second & 0xFF)
}

/// ThumbExpandImm.
fn expanded(first: u16, second: u16) -> u32 {
    let bits = twelve(first, second);
    let byte = bits & 0xFF;
    match bits >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | bits & 0x7F).rotate_right(bits >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(address: u32, halves: &[u16]) -> Result<Body> {
        let code: Vec<_> = (address..).step_by(2).zip(halves.iter().copied()).collect();
        read(address, address + 2 * halves.len() as u32, &code)
    }

    /// Encodings and targets as an assembler gave them.
    #[test]
    fn calls_and_branches_out_of_a_function_are_followed_both_ways() {
        for (address, halves, target) in [
            (0x4ee2, vec![0xF7FF, 0xFB2A], 0x453A), // bl
            (0x4ee6, vec![0xF7FF, 0xFEB2], 0x4C4E), // bl
            (0x1000, vec![0xF000, 0xB800], 0x1004), // b.w to what follows
            (0x1000, vec![0xE7FD], 0x0FFE),         // b
            (0x1000, vec![0xD0FC], 0x0FFC),         // beq
            (0x1000, vec![0xF43F, 0xAFFE], 0x1000), // beq.w to itself
        ] {
            let targets = one(address, &halves).unwrap().targets;
            let inside = (address..address + 2 * halves.len() as u32).contains(&target);
            assert_eq!(targets, if inside { vec![] } else { vec![target] }, "{halves:x?}");
        }
    }

    #[test]
    fn what_lowers_the_stack_is_added_up_and_what_raises_it_is_not() {
        for (halves, bytes) in [
            (vec![0xB580], 8),            // push {r7, lr}
            (vec![0xB084], 16),           // sub sp, #16
            (vec![0xE92D, 0x4FF0], 36),   // push.w {r4-r11, lr}
            (vec![0xED2D, 0x8B10], 64),   // vpush {d8-d15}
            (vec![0xF84D, 0x8D04], 4),    // str r8, [sp, #-4]!
            (vec![0xF5AD, 0x5D84], 4224), // sub.w sp, sp, #4224
            (vec![0xF6AD, 0x0D3C], 2108), // subw sp, sp, #2108
            (vec![0xB004], 0),            // add sp, #16
            (vec![0xBD80], 0),            // pop {r7, pc}
        ] {
            assert_eq!(one(0, &halves).unwrap().lowered, bytes, "{halves:x?}");
        }
    }

    #[test]
    fn what_cannot_be_followed_is_refused_and_returns_are_not() {
        for halves in [
            vec![0x4780],
            vec![0x4718],
            vec![0x46A7],
            vec![0xF8DF, 0xF004],
            vec![0xEBAD, 0x0D00],
        ] {
            assert!(one(0, &halves).is_err(), "{halves:x?}");
        }
        for halves in [vec![0x4770], vec![0xF85D, 0xFB04], vec![0xE8DF, 0xF003]] {
            assert!(one(0, &halves).is_ok(), "{halves:x?}");
        }
    }
}
