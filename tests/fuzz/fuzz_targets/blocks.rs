//! Pixels in blocks of LZ4: arbitrary bytes unpacked into rows of any size, and packed rows unpacked to themselves.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfarm_protocol::pixels::{Packer, unpack, unpack_planes};

fuzz_target!(|data: &[u8]| {
    let Some(([low, high], rest)) = data.split_first_chunk() else { return };
    let mut rows = vec![0; usize::from(u16::from_le_bytes([*low, *high]))];
    let _ = unpack(rest, &mut rows);
    let mut planes = rows.clone();
    let _ = unpack_planes(rest, &mut rows, 24, &mut planes);

    let mut packer = Packer::new();
    let cut = rest.len().min(rows.len());
    let packed: Vec<u8> =
        [&rest[..cut], &rest[cut..]].into_iter().filter_map(|part| packer.block(part)).flatten().collect();
    let mut unpacked = vec![0; rest.len()];
    unpack(&packed, &mut unpacked).expect("packed rows unpack");
    assert_eq!(unpacked, rest);
});
