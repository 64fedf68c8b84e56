//! Sections of a chip's image: where they lie and how long they are.

/// A section that takes memory of the chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Name, with its dot.
    pub name: String,
    /// First address.
    pub address: u32,
    /// Length, bytes.
    pub length: u32,
    /// It takes flash: code, constants, and what memory begins with.
    pub is_loaded: bool,
}

/// Sections that take memory, of a little-endian 32-bit ELF file; `None` when it is none.
pub fn sections(file: &[u8]) -> Option<Vec<Section>> {
    const ALLOCATED: u32 = 2;
    const NO_BITS: u32 = 8;
    if file.get(..6)? != [0x7f, b'E', b'L', b'F', 1, 1] {
        return None;
    }
    let half = |at: usize| Some(u16::from_le_bytes(file.get(at..at + 2)?.try_into().ok()?));
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?));
    let (table, size) = (word(0x20)? as usize, usize::from(half(0x2e)?));
    let header = |index: usize| table + index * size;
    let names = word(header(usize::from(half(0x32)?)) + 0x10)? as usize;
    let mut sections = Vec::new();
    for index in 0..usize::from(half(0x30)?) {
        let at = header(index);
        let (length, address) = (word(at + 0x14)?, word(at + 0x0c)?);
        if word(at + 8)? & ALLOCATED == 0 || length == 0 {
            continue;
        }
        let name = file
            .get(names + word(at)? as usize..)?
            .split(|byte| *byte == 0)
            .next()?;
        sections.push(Section {
            name: String::from_utf8_lossy(name).into_owned(),
            address,
            length,
            is_loaded: word(at + 4)? != NO_BITS,
        });
    }
    Some(sections)
}

/// The code of the function whose name contains `name`, of the same kind of file.
pub fn code<'a>(file: &'a [u8], name: &str) -> Option<&'a [u8]> {
    const SYMBOLS: u32 = 2;
    const CODE: u32 = 1;
    let half = |at: usize| Some(u16::from_le_bytes(file.get(at..at + 2)?.try_into().ok()?));
    let word = |at: usize| Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?));
    let (table, size) = (word(0x20)? as usize, usize::from(half(0x2e)?));
    let header = |index: usize| table + index * size;
    let count = usize::from(half(0x30)?);
    let symbols = (0..count).find(|index| word(header(*index) + 4) == Some(SYMBOLS))?;
    let names = word(header(word(header(symbols) + 0x18)? as usize) + 0x10)? as usize;
    let (first, length) = (
        word(header(symbols) + 0x10)? as usize,
        word(header(symbols) + 0x14)? as usize,
    );
    for symbol in (first..first + length).step_by(16) {
        let rest = file.get(names + word(symbol)? as usize..)?;
        let found = rest.split(|byte| *byte == 0).next()?;
        let is_function = file.get(symbol + 12)? & 15 == 2;
        if !is_function || !String::from_utf8_lossy(found).contains(name) {
            continue;
        }
        // The lowest bit says that it is Thumb code.
        let (address, bytes) = (word(symbol + 4)? & !1, word(symbol + 8)? as usize);
        let holds = |index: &usize| -> Option<bool> {
            let (start, length) = (word(header(*index) + 0x0c)?, word(header(*index) + 0x14)?);
            let is_code = word(header(*index) + 4)? == CODE;
            Some(is_code && address >= start && address - start < length)
        };
        let section = (0..count).find(|index| holds(index) == Some(true))?;
        let at = word(header(section) + 0x10)? + (address - word(header(section) + 0x0c)?);
        return file.get(at as usize..at as usize + bytes);
    }
    None
}

/// Bytes by which a function lowers the stack pointer at its beginning (Armv7-M manual, SUB (SP minus immediate)), pushed
/// registers not counted.
pub fn frame(code: &[u8]) -> u32 {
    let (halves, _odd) = code.as_chunks::<2>();
    let halves: Vec<u32> = halves
        .iter()
        .take(48)
        .map(|half| u16::from_le_bytes(*half).into())
        .collect();
    let mut bytes = 0;
    let mut at = 0;
    while let Some(&first) = halves.get(at) {
        let second = halves.get(at + 1).copied().unwrap_or(0);
        let immediate = (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xff;
        let is_sp = second & 0x8f00 == 0x0d00;
        bytes += match first {
            _ if first & 0xff80 == 0xb080 => (first & 0x7f) * 4,
            0xf1ad | 0xf5ad if is_sp && immediate >> 10 != 0 => {
                (0x80 | immediate & 0x7f).rotate_right(immediate >> 7)
            }
            0xf1ad | 0xf5ad if is_sp => immediate & 0xff,
            0xf2ad | 0xf6ad if is_sp => immediate,
            _ => 0,
        };
        // 32-bit instructions begin with 0b11101, 0b11110 or 0b11111.
        at += if first >> 11 >= 0b11101 { 2 } else { 1 };
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_read_off_every_form_of_the_instruction() {
        // push {r4, lr}; sub sp, #16; sub.w sp, sp, #1024; sub.w sp, sp, #139264; subw sp, sp, #1001; bx lr.
        let code: [u16; 9] = [
            0xb510, 0xb084, 0xf5ad, 0x6d80, 0xf5ad, 0x3d08, 0xf2ad, 0x3de9, 0x4770,
        ];
        let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
        assert_eq!(frame(&bytes), 16 + 1024 + 139_264 + 1001);
    }
}
