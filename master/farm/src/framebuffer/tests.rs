//! Segments in any order, damaged segments, and rejected workers.

use proptest::collection::vec;
use proptest::prelude::*;
use rayfarm_protocol::pixels::{Packer, planes_block};

use super::*;

const FRAME: FrameId = FrameId(3);
const A: WorkerId = WorkerId(1);
const B: WorkerId = WorkerId(2);

fn lease(first_row: u32, row_count: u32) -> Lease {
    Lease { frame: FRAME, segment: 0, attempt: 0, first_row, row_count }
}

fn opened(width: u32, height: u32) -> Arc<Framebuffers> {
    let framebuffers = Arc::new(Framebuffers::default());
    framebuffers.open(FRAME, width, height, PixelFormat::Rgb8);
    framebuffers
}

/// Writes pixels of a worker and recycles the decoded rows. Returns whether the pixels were kept.
fn write_as(
    framebuffers: &Framebuffers,
    worker: WorkerId,
    lease: Lease,
    encoding: Encoding,
    bytes: &[u8],
) -> Result<bool, Misfit> {
    let bytes = Bytes::copy_from_slice(bytes);
    Ok(match framebuffers.write(worker, lease, encoding, &bytes)? {
        Written::Kept { rows, .. } => {
            framebuffers.recycle(rows);
            true
        }
        Written::Superseded => false,
    })
}

/// Writes raw pixels of worker A. Returns whether they were kept.
fn write(framebuffers: &Framebuffers, lease: Lease, bytes: &[u8]) -> Result<bool, Misfit> {
    write_as(framebuffers, A, lease, Encoding::Raw, bytes)
}

fn packed(bytes: &[u8], block_bytes: usize) -> Vec<u8> {
    let mut packer = Packer::new();
    bytes.chunks(block_bytes).flat_map(|part| packer.block(part).unwrap()).collect()
}

#[test]
fn segments_in_any_order_make_the_picture() {
    let framebuffers = opened(1, 3);
    assert_eq!(write(&framebuffers, lease(2, 1), &[7, 8, 9]), Ok(true));
    assert_eq!(write(&framebuffers, lease(0, 2), &[1, 2, 3, 4, 5, 6]), Ok(true));
    assert_eq!(framebuffers.finish(FRAME).unwrap().into_vec(), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
}

#[test]
fn pixels_of_numbers_arrive_raw_or_in_planes() {
    for format in [PixelFormat::Linear, PixelFormat::Sums] {
        let row: Vec<u8> = (0..format.row_bytes(5)).map(|byte| (byte * 7 % 23) as u8).collect();
        let framebuffers = Arc::new(Framebuffers::default());
        framebuffers.open(FRAME, 5, 3, format);
        let rows = [row.as_slice(), &row].concat();
        let mut packer = Packer::new();
        let blocks =
            [&rows[..row.len()], &row].map(|row| planes_block(&mut packer, row, format.bytes_per_pixel()));
        let planes = blocks.map(Option::unwrap).concat();
        assert_eq!(write_as(&framebuffers, A, lease(1, 2), Encoding::PlanesLz4, &planes), Ok(true));
        for encoding in [Encoding::Lz4, Encoding::Rgb565, Encoding::Rgb565Lz4] {
            let error = Misfit::Encoding { lease: lease(0, 1), format, encoding };
            assert_eq!(write_as(&framebuffers, A, lease(0, 1), encoding, &row), Err(error));
        }
        assert_eq!(write(&framebuffers, lease(0, 1), &row), Ok(true));
        assert_eq!(*framebuffers.finish(FRAME).unwrap(), [row.as_slice(), &row, &row].concat());
    }
    let refused = write_as(&opened(1, 1), A, lease(0, 1), Encoding::PlanesLz4, &[0; 3]);
    assert!(matches!(refused, Err(Misfit::Encoding { .. })), "{refused:?}");
}

#[test]
fn an_incomplete_picture_is_not_handed_out() {
    let framebuffers = opened(1, 2);
    write(&framebuffers, lease(0, 1), &[1; 3]).unwrap();
    write(&framebuffers, lease(0, 1), &[1; 3]).unwrap();
    assert!(framebuffers.finish(FRAME).is_none());
}

#[test]
fn the_first_pixels_of_a_row_stay() {
    let framebuffers = opened(1, 2);
    write(&framebuffers, lease(1, 1), &[1; 3]).unwrap();
    write(&framebuffers, lease(0, 2), &[2; 6]).unwrap();
    assert_eq!(*framebuffers.finish(FRAME).unwrap(), [2, 2, 2, 1, 1, 1]);
}

#[test]
fn pixels_that_do_not_fit_are_refused_and_write_nothing() {
    let framebuffers = opened(1, 2);
    let short = write(&framebuffers, lease(0, 2), &[9; 5]).unwrap_err();
    assert_eq!(short, Misfit::Bytes { lease: lease(0, 2), expected: 6, got: 5 });
    for outside in [lease(1, 2), lease(2, 1), lease(u32::MAX, u32::MAX)] {
        assert_eq!(write(&framebuffers, outside, &[9; 6]), Err(Misfit::Rows { lease: outside, rows: 2 }));
    }
    write(&framebuffers, lease(0, 2), &[1; 6]).unwrap();
    assert_eq!(*framebuffers.finish(FRAME).unwrap(), [1; 6]);
}

#[test]
fn a_closed_frame_takes_no_pixels() {
    let framebuffers = opened(1, 1);
    framebuffers.discard(FRAME);
    assert_eq!(write(&framebuffers, lease(0, 1), &[1; 3]), Ok(false));
    assert!(framebuffers.finish(FRAME).is_none());
}

#[test]
fn buffers_are_reused_and_their_number_is_bounded() {
    let framebuffers = opened(1, 1);
    let pictures: Vec<FramePixels> = (0..6)
        .map(|n| {
            framebuffers.open(FrameId(n), 1, 1, PixelFormat::Rgb8);
            write(&framebuffers, Lease { frame: FrameId(n), ..lease(0, 1) }, &[n as u8; 3]).unwrap();
            framebuffers.finish(FrameId(n)).unwrap()
        })
        .collect();
    let first = pictures[0].as_ptr();
    drop(pictures);
    assert_eq!(framebuffers.lock().spare.len(), SPARE_BUFFERS);
    assert!(framebuffers.lock().spare.iter().any(|spare| spare.as_ptr() == first));
    framebuffers.open(FRAME, 2, 2, PixelFormat::Rgb8);
    framebuffers.discard(FRAME);
    assert!(framebuffers.lock().spare.iter().all(|spare| spare.len() == 12));
}

#[test]
fn packed_pixels_are_unpacked_into_their_rows() {
    let framebuffers = opened(2, 4);
    let rows: Vec<u8> = (0..18).collect();
    write_as(&framebuffers, A, lease(1, 3), Encoding::Lz4, &packed(&rows, 7)).unwrap();
    write(&framebuffers, lease(0, 2), &[9; 12]).unwrap();
    assert_eq!(*framebuffers.finish(FRAME).unwrap(), [vec![9; 6], rows].concat());
}

#[test]
fn packed_pixels_do_not_replace_rows() {
    let framebuffers = opened(1, 3);
    write(&framebuffers, lease(1, 1), &[1; 3]).unwrap();
    write_as(&framebuffers, A, lease(0, 3), Encoding::Lz4, &packed(&[2; 9], 9)).unwrap();
    assert_eq!(*framebuffers.finish(FRAME).unwrap(), [2, 2, 2, 1, 1, 1, 2, 2, 2]);
}

#[test]
fn rows_of_a_rejected_worker_leave_the_picture_for_good() {
    let framebuffers = opened(1, 5);
    let write = |worker, lease, byte: u8| {
        write_as(&framebuffers, worker, lease, Encoding::Raw, &vec![byte; lease.row_count as usize * 3])
            .unwrap()
    };
    write(A, lease(0, 1), 1);
    write(B, lease(1, 2), 2);
    write(A, lease(2, 2), 3);
    write(B, lease(4, 1), 4);
    assert_eq!(framebuffers.reject(B), [(FRAME, 1..3), (FRAME, 4..5)]);
    assert!(!write(B, lease(1, 2), 5));
    assert!(framebuffers.reject(B).is_empty());
    write(A, lease(1, 4), 6);
    assert_eq!(*framebuffers.finish(FRAME).unwrap(), [1, 1, 1, 6, 6, 6, 6, 6, 6, 3, 3, 3, 6, 6, 6]);
}

#[test]
fn rows_are_attributed_to_the_worker_that_sent_them_first() {
    let framebuffers = opened(1, 3);
    write_as(&framebuffers, A, lease(0, 2), Encoding::Raw, &[1; 6]).unwrap();
    write_as(&framebuffers, B, lease(1, 2), Encoding::Raw, &[2; 6]).unwrap();
    assert!(framebuffers.is_all_of(A, lease(0, 2)) && framebuffers.is_all_of(B, lease(2, 1)));
    for other in [lease(0, 3), lease(1, 2), lease(2, 2), lease(u32::MAX, u32::MAX)] {
        assert!(!framebuffers.is_all_of(B, other));
    }
}

#[test]
fn a_copy_has_the_pixels_of_the_picture_and_not_of_the_last_reply() {
    let framebuffers = opened(1, 3);
    for (byte, expected) in [(1, true), (2, false)] {
        match framebuffers.write(A, lease(0, 2), Encoding::Raw, &Bytes::from(vec![byte; 6])).unwrap() {
            Written::Kept { all_new, .. } => assert_eq!(all_new, expected),
            Written::Superseded => panic!("the frame is open"),
        }
    }
    assert_eq!(framebuffers.copy_of(A, lease(0, 2)).unwrap(), [1; 6]);
    assert_eq!(framebuffers.copy_of(A, lease(1, 2)), None);
    assert_eq!(framebuffers.copy_of(B, lease(0, 2)), None);
}

#[test]
fn decoded_rows_share_the_received_bytes_or_a_recycled_buffer() {
    let framebuffers = opened(1, 1);
    let raw = Bytes::from(vec![1; 6]);
    let decode =
        |encoding, bytes: &Bytes| framebuffers.decode(lease(0, 2), PixelFormat::Rgb8, 6, encoding, bytes);
    assert_eq!(decode(Encoding::Raw, &raw).unwrap().as_ptr(), raw.as_ptr());
    let lz4 = Bytes::from(packed(&[1; 6], 4));
    let rows = decode(Encoding::Lz4, &lz4).unwrap();
    assert_eq!(*rows, *raw);
    let buffer = rows.as_ptr();
    framebuffers.recycle(rows);
    let again = decode(Encoding::Lz4, &lz4).unwrap();
    assert_eq!(again.as_ptr(), buffer);
    framebuffers.recycle(again.clone());
    assert_ne!(decode(Encoding::Lz4, &lz4).unwrap().as_ptr(), buffer, "a clone keeps its buffer");
    assert!(decode(Encoding::Raw, &raw.slice(..5)).is_err());
}

/// Three pixels of reduced colours, and what they take at two bytes each.
const FEW_COLORS: [u8; 9] = [0xff, 0x82, 0x08, 0, 0, 0, 0x10, 0xff, 0xff];
const NARROW: [u8; 6] = [0x01, 0xfc, 0, 0, 0xff, 0x17];

#[test]
fn narrow_pixels_are_widened_into_their_rows() {
    for (encoding, bytes) in [(Encoding::Rgb565, NARROW.to_vec()), (Encoding::Rgb565Lz4, packed(&NARROW, 4))]
    {
        let framebuffers = opened(1, 4);
        write(&framebuffers, lease(1, 1), &[1; 3]).unwrap();
        write_as(&framebuffers, B, lease(0, 3), encoding, &bytes).unwrap();
        write(&framebuffers, lease(3, 1), &[9; 3]).unwrap();
        let expected = [&FEW_COLORS[..3], &[1; 3], &FEW_COLORS[6..], &[9; 3]].concat();
        assert_eq!(*framebuffers.finish(FRAME).unwrap(), expected[..], "{encoding:?}");
        let decoded = framebuffers.decode(lease(0, 3), PixelFormat::Rgb8, 9, encoding, &Bytes::from(bytes));
        assert_eq!(*decoded.unwrap(), FEW_COLORS);
    }
}

#[test]
fn narrow_pixels_of_another_length_are_refused() {
    let framebuffers = opened(1, 3);
    for got in [0, 5, 7, 9] {
        let refused = write_as(&framebuffers, A, lease(0, 3), Encoding::Rgb565, &vec![0; got]).unwrap_err();
        assert_eq!(refused, Misfit::Bytes { lease: lease(0, 3), expected: 6, got });
    }
    for broken in [packed(&NARROW[..5], 6), packed(&FEW_COLORS, 9), vec![0xff; 40]] {
        let refused = write_as(&framebuffers, A, lease(0, 3), Encoding::Rgb565Lz4, &broken).unwrap_err();
        assert!(matches!(refused, Misfit::Blocks { .. }), "{refused}");
    }
    write(&framebuffers, lease(0, 3), &[7; 9]).unwrap();
    assert_eq!(*framebuffers.finish(FRAME).unwrap(), [7; 9]);
}

proptest! {
    #[test]
    fn broken_blocks_write_no_row(
        bytes in vec(any::<u8>(), 0..80),
        at in any::<prop::sample::Index>(),
        valid: bool,
    ) {
        let framebuffers = opened(4, 4);
        write(&framebuffers, lease(2, 1), &[3; 12]).unwrap();
        let mut broken = if valid { packed(&[5; 48], 20) } else { bytes };
        if valid {
            broken.truncate(at.index(broken.len()));
        }
        let refused = write_as(&framebuffers, A, lease(0, 4), Encoding::Lz4, &broken).is_err();
        prop_assert!(refused || !valid);
        if refused {
            write(&framebuffers, lease(0, 4), &[5; 48]).unwrap();
            let expected = [vec![5; 24], vec![3; 12], vec![5; 12]].concat();
            prop_assert_eq!(&*framebuffers.finish(FRAME).unwrap(), &expected[..]);
        }
    }
}
