//! Frames made by hand: unsigned, so that a body is not stopped by its authentication code.

/// The frame of a packet of UAV 1 with this second byte of the header and this body.
pub fn frame(what: u8, body: &[u8]) -> Vec<u8> {
    let mut packet = vec![cslam_core::telemetry::VERSION, what, 1, 0, 0, 0, 0];
    packet.extend(body);
    packet.extend(crc32(&packet).to_be_bytes());
    stuff(&packet)
}

/// CRC-32/ISO-HDLC, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 {
                crc >> 1 ^ 0xedb8_8320
            } else {
                crc >> 1
            };
        }
    }
    !crc
}

/// COBS, block by block, with the closing zero.
fn stuff(packet: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    for block in packet.split(|byte| *byte == 0) {
        let mut rest = block;
        while rest.len() >= 254 {
            let (full, after) = rest.split_at(254);
            frame.push(255);
            frame.extend(full);
            rest = after;
        }
        frame.push(rest.len() as u8 + 1);
        frame.extend(rest);
    }
    frame.push(0);
    frame
}
