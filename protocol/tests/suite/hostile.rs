//! Announced sizes allocate nothing before they are checked: measured at the allocator. Malformed headers and bodies.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use bytes::Bytes;
use rayfarm_protocol::envelope::{HEADER_BYTES, Header, Kind, read_header};
use rayfarm_protocol::message::Message;
use rayfarm_protocol::session::spawn;
use rayfarm_protocol::{
    AssetId, FrameAnnounce, FrameId, Lease, PixelFormat, ProtocolError, ToMaster, ToWorker, limits,
};
use tokio::io::{AsyncWriteExt, duplex};

thread_local! {
    static LARGEST_ALLOCATION: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, with a record of each thread's largest allocation.
struct RecordingAllocator;

// SAFETY: every call is passed to the system allocator unchanged; the thread-local cell is const-initialised and has
// no destructor, so touching it allocates nothing.
unsafe impl GlobalAlloc for RecordingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST_ALLOCATION.with(|largest| largest.set(largest.get().max(layout.size())));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on; the pointer came from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: RecordingAllocator = RecordingAllocator;

fn header(announced: u32, kind: u8) -> [u8; HEADER_BYTES] {
    let [a, b, c, d] = announced.to_le_bytes();
    [a, b, c, d, kind, 0, 0, 0]
}

/// Receives these bytes in a session. Returns the session's error and the largest allocation.
async fn receive<In: Message, Out: Message>(bytes: &[u8]) -> (Option<ProtocolError>, usize) {
    let (ours, mut theirs) = duplex(1 << 16);
    let (_out, mut received, _) = spawn::<_, Out, In>(ours);
    LARGEST_ALLOCATION.with(|largest| largest.set(0));
    theirs.write_all(bytes).await.unwrap();
    drop(theirs);
    let result = received.recv().await;
    (result.and_then(Result::err), LARGEST_ALLOCATION.with(Cell::get))
}

#[tokio::test]
async fn four_gibibytes_are_refused_before_any_allocation() {
    for kind in Kind::ALL.into_iter().filter(|kind| *kind != Kind::PeerRequest) {
        for announced in [u32::MAX, 1 << 31, kind.limit_bytes() as u32 + 1] {
            let (error, largest) = if ToWorker::carries(kind) {
                receive::<ToWorker, ToMaster>(&header(announced, kind as u8)).await
            } else {
                receive::<ToMaster, ToWorker>(&header(announced, kind as u8)).await
            };
            let error = error.unwrap();
            assert!(matches!(error, ProtocolError::TooLong { .. }), "{error}");
            assert!(error.to_string().contains(&announced.to_string()), "{error}");
            assert!(largest < 64 << 10, "{kind} of {announced} bytes allocated {largest} bytes");
        }
    }
}

#[tokio::test]
async fn bulk_in_the_wrong_direction_is_refused_before_any_allocation() {
    let bytes = header(limits::MAX_PIXELS_BYTES as u32, Kind::Pixels as u8);
    let (error, largest) = receive::<ToWorker, ToMaster>(&bytes).await;
    assert!(matches!(error, Some(ProtocolError::Unexpected { kind: Kind::Pixels, .. })));
    assert!(largest < 64 << 10, "{largest}");
}

#[tokio::test]
async fn a_body_allocates_exactly_its_announced_size() {
    let announced = Kind::Pixels.limit_bytes();
    let (error, largest) = receive::<ToMaster, ToWorker>(&header(announced as u32, Kind::Pixels as u8)).await;
    assert!(matches!(error, Some(ProtocolError::Closed { .. })));
    assert_eq!(largest, announced);
}

#[test]
fn unknown_types_flags_and_streams_are_refused() {
    for kind in 0..=u8::MAX {
        let known = Kind::ALL.into_iter().any(|known| known as u8 == kind);
        match Header::parse(header(0, kind)) {
            Ok(header) => assert!(known && header.kind as u8 == kind),
            Err(ProtocolError::UnknownKind { kind: named }) => assert!(!known && named == kind),
            Err(other) => panic!("{other}"),
        }
    }
    for (at, value) in [(5, 1), (6, 1), (7, 0x80)] {
        let mut bytes = header(0, Kind::Drain as u8);
        bytes[at] = value;
        assert!(matches!(Header::parse(bytes), Err(ProtocolError::Malformed { kind: Kind::Drain, .. })));
    }
}

#[tokio::test]
async fn http_in_place_of_an_envelope_is_an_error() {
    let error = read_header(&mut b"GET / HTTP/1.1\r\n".as_slice()).await.unwrap_err();
    assert!(error.to_string().contains("0x2f"), "{error}");
}

/// Decodes a malformed body and returns the error's text.
fn malformed(kind: Kind, body: &[u8]) -> String {
    let body = Bytes::copy_from_slice(body);
    let result = if ToWorker::carries(kind) {
        ToWorker::from_body(kind, body).map(|_| ())
    } else {
        ToMaster::from_body(kind, body).map(|_| ())
    };
    match result.unwrap_err() {
        error @ (ProtocolError::Malformed { .. } | ProtocolError::Codec { .. }) => error.to_string(),
        other => panic!("{other}"),
    }
}

#[test]
fn malformed_bodies_are_refused_with_the_rule() {
    let short: &[u8] = &[0; 7];
    for kind in [Kind::Frame, Kind::Segment, Kind::Cancel, Kind::AssetBegin, Kind::AssetChunk, Kind::Ping] {
        malformed(kind, short);
    }
    for kind in [Kind::AssetFrom, Kind::ShareKey, Kind::Sharing, Kind::HaveAsset] {
        malformed(kind, &[0; 1]);
    }
    for kind in [Kind::NeedAsset, Kind::Pixels, Kind::Pong, Kind::Failed] {
        malformed(kind, short);
    }
    assert!(malformed(Kind::Drain, &[0]).contains("1 bytes"));

    let mut frame = vec![0; 52];
    assert!(malformed(Kind::Frame, &frame).contains("0 x 0"));
    frame[40..48].copy_from_slice(&[1, 0, 0, 0, 1, 0, 1, 0]);
    assert!(malformed(Kind::Frame, &frame).contains("65537"));
    frame[46] = 0;
    frame[48] = 3;
    assert!(malformed(Kind::Frame, &frame).contains("pixel format 3 is not known"));
    frame[48] = 2;
    frame.extend([0; limits::MAX_VIEW_BYTES + 1]);
    assert!(malformed(Kind::Frame, &frame).contains("4097"));

    let mut segment = vec![0; 24];
    malformed(Kind::Segment, &segment);
    segment[20] = 1;
    assert!(ToWorker::from_body(Kind::Segment, Bytes::copy_from_slice(&segment)).is_ok(), "one row");
    segment[16..24].copy_from_slice(&[0xff; 8]);
    malformed(Kind::Segment, &segment);
    assert!(malformed(Kind::Segment, &[0; 25]).contains("1 bytes"));

    let mut need = vec![0; 41];
    need[39] = 1;
    malformed(Kind::NeedAsset, &need);
    need[39..].copy_from_slice(&[0, 2]);
    malformed(Kind::NeedAsset, &need);
    assert!(malformed(Kind::Sharing, &[0, 0]).contains("port 0"));
    let mut from = vec![0; 83];
    from[39] = 1;
    assert!(malformed(Kind::AssetFrom, &from).contains("72057594037927936"));
    from[39] = 0;
    from[40] = 9;
    malformed(Kind::AssetFrom, &from);
    from[40] = 0;
    assert!(ToWorker::from_body(Kind::AssetFrom, Bytes::copy_from_slice(&from)).is_ok());
    // Neither a plain peer nor one with a key.
    from[50] = 2;
    malformed(Kind::AssetFrom, &from);

    let mut begin = vec![0; 40];
    begin[39] = 1;
    assert!(malformed(Kind::AssetBegin, &begin).contains("72057594037927936"));

    assert!(malformed(Kind::AssetChunk, &[0; 40]).contains("0 bytes"));
    let mut chunk = vec![0; 41];
    chunk[32..40].copy_from_slice(&u64::MAX.to_le_bytes());
    malformed(Kind::AssetChunk, &chunk);
    chunk[32..40].copy_from_slice(&0_u64.to_le_bytes());
    assert!(
        ToWorker::from_body(Kind::AssetChunk, Bytes::copy_from_slice(&chunk)).is_ok(),
        "one byte at the start"
    );

    let disconnect = ToWorker::from_body(Kind::Disconnect, Bytes::from_static(&[3])).unwrap_err();
    assert!(disconnect.to_string().contains("3"), "{disconnect}");

    let mut pixels = vec![0; 88];
    malformed(Kind::Pixels, &pixels);
    pixels[20] = 1;
    pixels[24] = 9;
    assert!(malformed(Kind::Pixels, &pixels).contains("9"));
}

#[test]
fn malformed_messages_are_not_sent() {
    let view = Bytes::from(vec![0; limits::MAX_VIEW_BYTES + 1]);
    let (frame, scene, format) = (FrameId(1), AssetId([0; 32]), PixelFormat::Rgb8);
    let announce = FrameAnnounce { frame, scene, width: 1, height: 1, format, view };
    let none = Lease { frame: FrameId(1), segment: 0, attempt: 0, first_row: 0, row_count: 0 };
    for message in [
        ToWorker::Frame(announce.clone()),
        ToWorker::Frame(FrameAnnounce { width: 0, view: Bytes::new(), ..announce }),
        ToWorker::Segment(none),
        ToWorker::AssetBegin { id: AssetId([0; 32]), size: limits::MAX_ASSET_BYTES + 1 },
        ToWorker::AssetChunk { id: AssetId([0; 32]), offset: 0, bytes: Bytes::new() },
    ] {
        assert!(message.to_envelope().is_err());
    }
}
