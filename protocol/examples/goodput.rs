//! Measures what a link carries in bulk between two hosts: payload bits per second.
//!
//! `goodput receive ADDRESS [certs=FOLDER] [link=RATE]` listens, takes one connection and prints megabits per second;
//! `goodput send ADDRESS bytes=N [certs=FOLDER] [link=RATE]` sends it N bytes. The first chunks are not counted:
//! buffers fill. Both ends link as the daemons do.

use protocol::frame::{Header, Kind};
use protocol::link::{Receiver, Sender, Settings, split, tune};
use protocol::shape::{Rate, Shape, Shaped, Wire};
use protocol::tls;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use tokio::net::{TcpListener, TcpStream};

type Fault = Box<dyn std::error::Error>;

/// Bytes of a message.
const MESSAGE: usize = 1 << 20;
/// Chunks that fill buffers on the way.
const UNCOUNTED: usize = 4;

struct Asked {
    address: String,
    certs: Option<PathBuf>,
    link: Option<Rate>,
    bytes: usize,
}

impl Asked {
    fn read(words: &[String]) -> Result<Self, Fault> {
        let mut asked =
            Self { address: words.first().ok_or("no address")?.clone(), certs: None, link: None, bytes: 0 };
        for word in &words[1..] {
            match word.split_once('=') {
                Some(("certs", folder)) => asked.certs = Some(folder.into()),
                Some(("link", rate)) => asked.link = Some(rate.parse()?),
                Some(("bytes", n)) => asked.bytes = n.parse()?,
                _ => return Err(format!("{word:?}: expected certs=FOLDER, link=RATE or bytes=N").into()),
            }
        }
        Ok(asked)
    }

    fn shape(&self, stream: TcpStream) -> Result<Shaped<TcpStream>, Fault> {
        tune(&stream)?;
        let port = self.link.map(|rate| Shape::port(Wire::ethernet(rate)));
        Ok(Shaped::new(stream, port.as_ref()))
    }

    fn paths(&self) -> Option<tls::Paths> {
        self.certs.as_deref().map(tls::Paths::in_folder)
    }
}

async fn accept(asked: &Asked) -> Result<(Sender, Receiver), Fault> {
    let (stream, _) = TcpListener::bind(&asked.address).await?.accept().await?;
    let stream = asked.shape(stream)?;
    Ok(match asked.paths() {
        None => split(stream, Settings::default()),
        Some(paths) => split(tls::accept(stream, &tls::server_config(&paths)?).await?.0, Settings::default()),
    })
}

async fn connect(asked: &Asked) -> Result<(Sender, Receiver), Fault> {
    let stream = asked.shape(TcpStream::connect(&asked.address).await?)?;
    Ok(match asked.paths() {
        None => split(stream, Settings::default()),
        Some(paths) => {
            let (host, _) = asked.address.rsplit_once(':').ok_or("no port")?;
            let config = tls::client_config(&paths)?;
            split(tls::connect(stream, host, &config, tls::Role::Master).await?.0, Settings::default())
        }
    })
}

async fn receive(asked: &Asked) -> Result<(), Fault> {
    let (_sender, mut receiver) = accept(asked).await?;
    let (mut start, mut end, mut chunks, mut bytes) = (None, Instant::now(), 0, 0);
    loop {
        let frame = match receiver.receive().await {
            Ok(frame) => frame,
            Err(protocol::Error::Closed) => break,
            Err(error) => return Err(error.into()),
        };
        end = Instant::now();
        chunks += 1;
        if chunks > UNCOUNTED {
            bytes += frame.payload.len();
        } else {
            start = Some(end);
        }
        receiver.recycle(frame.payload);
    }
    let start = start.ok_or("nothing came")?;
    println!("{:.4}", bytes as f64 * 8e-6 / (end - start).as_secs_f64());
    Ok(())
}

async fn send(asked: &Asked) -> Result<(), Fault> {
    let (sender, mut receiver) = connect(asked).await?;
    // A side that leaves with unread bytes resets the connection, and the last of what it sent is lost.
    let other = tokio::spawn(async move { while receiver.receive().await.is_ok() {} });
    let message = Arc::new(vec![1; MESSAGE]);
    for stream in 0..=asked.bytes.div_ceil(MESSAGE) as u64 {
        sender.send_bulk(Header::new(Kind::Bulk), stream, Arc::clone(&message))?;
    }
    sender.finish().await?;
    other.await?;
    Ok(())
}

fn main() -> Result<(), Fault> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        match words.first().map(String::as_str) {
            Some("receive") => receive(&Asked::read(&words[1..])?).await,
            Some("send") => send(&Asked::read(&words[1..])?).await,
            _ => Err("expected receive or send".into()),
        }
    })
}
