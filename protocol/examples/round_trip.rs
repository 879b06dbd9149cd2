//! Runs both ends of a session over a pipe in memory: a master leases a segment, a worker answers with its pixels.
//!
//! ```sh
//! cargo run -p rayfarm-protocol --example round_trip
//! ```

use std::error::Error;

use bytes::Bytes;
use rayfarm_protocol::pixels::PixelsHeader;
use rayfarm_protocol::{
    Cost, Encoding, FrameId, Hello, Lease, ToMaster, ToWorker, Welcome, handshake, session,
};
use tokio::io::DuplexStream;

const WIDTH: usize = 4;

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let (master_end, worker_end) = tokio::io::duplex(1 << 16);
    let worker = tokio::spawn(async { serve(worker_end).await.map_err(|error| error.to_string()) });
    let pixels = request(master_end).await?;
    println!("{} bytes of pixels", pixels.len());
    worker.await??;
    Ok(())
}

/// The master: leases two rows and returns their pixels.
async fn request(mut stream: DuplexStream) -> Result<Bytes, Box<dyn Error>> {
    let (_, hello) =
        handshake::as_master(&mut stream, &rayfarm_protocol::transport::MasterSecurity::Plain, |_, _| {
            Ok(Welcome { worker: 1 })
        })
        .await?;
    println!("worker '{}' with {} render threads", hello.name, hello.threads);

    let (sender, mut receiver, traffic) = session::spawn::<_, ToWorker, ToMaster>(stream);
    let lease = Lease { frame: FrameId(1), segment: 0, attempt: 0, first_row: 0, row_count: 2 };
    sender.send(ToWorker::Segment(lease)).await?;
    let Some(ToMaster::Pixels { header, bytes }) = receiver.recv().await.transpose()? else {
        return Err("the worker sent no pixels".into());
    };
    println!("{}: {traffic:?}", header.lease);
    Ok(bytes)
}

/// The worker: answers every lease with grey rows, until the master closes the session.
async fn serve(mut stream: DuplexStream) -> Result<(), Box<dyn Error>> {
    let hello = Hello {
        name: "example".into(),
        threads: 1,
        simd: "none".into(),
        software: "0".into(),
        tags: Vec::new(),
    };
    handshake::as_worker(&mut stream, &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello).await?;

    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    while let Some(message) = receiver.recv().await.transpose()? {
        let ToWorker::Segment(lease) = message else { continue };
        let header = PixelsHeader { lease, encoding: Encoding::Raw, cost: Cost::default() };
        let bytes = Bytes::from(vec![128; lease.row_count as usize * WIDTH * 3]);
        sender.send(ToMaster::Pixels { header, bytes }).await?;
    }
    Ok(())
}
