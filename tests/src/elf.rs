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
