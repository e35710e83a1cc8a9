//! `--tev`: sends the picture to the viewer [tev](https://github.com/Tom94/tev) as it forms.
//!
//! The viewer listens on a TCP port (14158 unless told otherwise) and answers nothing. All numbers are little-endian,
//! texts end with a zero byte. A packet is its length in bytes, these four included, as `u32`, its kind as `u8`, and:
//!
//! | packet | kind | fields |
//! |---|---|---|
//! | close | 2 | name |
//! | create | 4 | `u8` whether to show it, name, `i32` width and height, `i32` number of channels, their names |
//! | update | 6 | `u8` whether to show it, name, `i32` number of channels, their names, `i32` x, y, width and height of the part, `i64` offset of each channel, `i64` stride of each channel, `f32` values |
//!
//! Offsets and strides count values: channels lie interleaved here. A thread of its own sends, so that a slow viewer
//! delays nothing; what comes while it is busy is left out, but for the finished picture. A viewer that is not there, or goes
//! away, is told once, and the render goes on.

use lucerna_core::image::Image;
use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Shortest time between two pictures.
const PAUSE: Duration = Duration::from_millis(250);

/// How long the viewer may take to accept, and to take a part of the picture.
const PATIENCE: Duration = Duration::from_secs(4);

/// How long it may take for a whole picture.
const MOST: Duration = Duration::from_secs(20);

/// Bytes of values in a packet, about.
const PART: usize = 1 << 20;

/// A viewer.
pub struct Tev {
    pictures: Mutex<Option<SyncSender<Image>>>,
    thread: Mutex<Option<JoinHandle<()>>>,
    /// Whether it waits for a picture.
    idle: Arc<AtomicBool>,
    sent: Mutex<Option<Instant>>,
}

impl Tev {
    /// Connects in the background; `warn` is told if that fails, or later the connection. `name` is what the viewer calls
    /// the picture.
    ///
    /// # Errors
    /// If the address is not of the form HOST:PORT.
    pub fn connect(address: &str, name: &str, warn: impl Fn(String) + Send + 'static) -> Result<Self, String> {
        check(address)?;
        let (address, name) = (address.to_owned(), name.replace('\0', ""));
        let (sender, receiver) = sync_channel(1);
        let idle = Arc::new(AtomicBool::new(false));
        let is_idle = idle.clone();
        let thread = std::thread::spawn(move || {
            if let Err(e) = serve(&address, &name, &receiver, &is_idle) {
                warn(format!("warning: tev at {address}: {e}; the render goes on without"));
            }
        });
        Ok(Tev { pictures: Mutex::new(Some(sender)), thread: Mutex::new(Some(thread)), idle, sent: Mutex::new(None) })
    }

    /// Whether a picture may be sent: the viewer is there and has taken the last one, some time ago.
    pub fn is_ready(&self) -> bool {
        let sent = *self.sent.lock().unwrap_or_else(PoisonError::into_inner);
        self.idle.load(Ordering::Acquire) && sent.is_none_or(|sent| sent.elapsed() >= PAUSE)
    }

    /// Hands a picture over; if the viewer is busy or gone, it is dropped.
    pub fn send(&self, picture: Image) {
        *self.sent.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
        self.idle.store(false, Ordering::Release);
        if let Some(pictures) = &*self.pictures.lock().unwrap_or_else(PoisonError::into_inner) {
            let _ = pictures.try_send(picture);
        }
    }

    /// Hands the last picture over and waits until it is sent, or could not be.
    pub fn finish(&self, picture: Image) {
        if let Some(pictures) = self.pictures.lock().unwrap_or_else(PoisonError::into_inner).take() {
            // Fails if the viewer is gone, which was told.
            let _ = pictures.send(picture);
        }
        if let Some(thread) = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take() {
            let _ = thread.join();
        }
    }
}

/// Whether an address has the form HOST:PORT.
///
/// # Errors
/// If not.
pub fn check(address: &str) -> Result<(), String> {
    let port = address.rsplit_once(':').filter(|(host, _)| !host.is_empty()).map(|(_, port)| port.parse::<u16>());
    match port {
        Some(Ok(port)) if port > 0 => Ok(()),
        _ => Err("expected HOST:PORT, say 127.0.0.1:14158".to_owned()),
    }
}

/// Sends what comes until nothing more can.
fn serve(address: &str, name: &str, pictures: &Receiver<Image>, idle: &AtomicBool) -> io::Result<()> {
    let mut stream = connect(address)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.set_nodelay(true)?;
    let mut created = false;
    loop {
        idle.store(true, Ordering::Release);
        let Ok(picture) = pictures.recv() else { return Ok(()) };
        let started = Instant::now();
        if !std::mem::replace(&mut created, true) {
            // One of this name may be left from the run before.
            stream.write_all(&close(name))?;
            stream.write_all(&create(name, &picture))?;
        }
        let row = picture.width as usize * picture.channels.len() * size_of::<f32>();
        let rows = (PART / row.max(1)).clamp(1, picture.height.max(1) as usize) as u32;
        for y in (0..picture.height).step_by(rows as usize) {
            stream.write_all(&update(name, &picture, y, rows.min(picture.height - y)))?;
            if started.elapsed() > MOST {
                return Err(io::Error::new(io::ErrorKind::TimedOut, "it is too slow"));
            }
        }
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut failed = io::Error::new(io::ErrorKind::NotFound, "there is no such host");
    for found in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&found, PATIENCE) {
            Ok(stream) => return Ok(stream),
            Err(e) => failed = e,
        }
    }
    Err(failed)
}

/// Closes the picture of this name, if there is one.
pub fn close(name: &str) -> Vec<u8> {
    Packet::new(2).text(name).finish()
}

/// Creates a picture, and shows it.
pub fn create(name: &str, picture: &Image) -> Vec<u8> {
    let mut packet = Packet::new(4);
    packet.0.push(1);
    packet.text(name).int(picture.width).int(picture.height).names(&picture.channels).finish()
}

/// Fills some rows of it.
pub fn update(name: &str, picture: &Image, y: u32, rows: u32) -> Vec<u8> {
    let mut packet = Packet::new(6);
    packet.0.push(0);
    let count = picture.channels.len();
    packet.text(name).names(&picture.channels);
    packet.int(0).int(y).int(picture.width).int(rows);
    for offset in 0..count as i64 {
        packet.0.extend(offset.to_le_bytes());
    }
    for _ in 0..count {
        packet.0.extend((count as i64).to_le_bytes());
    }
    let row = picture.width as usize * count;
    let values = &picture.data[y as usize * row..(y + rows) as usize * row];
    packet.0.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    packet.finish()
}

/// Bytes of a packet, its length still open.
struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Packet(vec![0, 0, 0, 0, kind])
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.0.extend(text.bytes().filter(|byte| *byte != 0));
        self.0.push(0);
        self
    }

    fn int(&mut self, value: u32) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn names(&mut self, names: &[String]) -> &mut Self {
        self.int(names.len() as u32);
        for name in names {
            self.text(name);
        }
        self
    }

    fn finish(&mut self) -> Vec<u8> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        std::mem::take(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tev_client::{PacketCloseImage, PacketCreateImage, PacketUpdateImage, TevClient};

    /// What another implementation of the protocol sends.
    fn theirs(send: impl FnOnce(&mut TevClient)) -> Vec<u8> {
        use std::io::Read;
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let mut client = TevClient::wrap(stream);
        send(&mut client);
        drop(client);
        let mut bytes = Vec::new();
        listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
        bytes
    }

    #[test]
    fn packets_are_those_of_another_implementation() {
        let names = ["R", "G", "B", "depth"];
        let mut picture = Image::new(3, 5, &names);
        picture.data.iter_mut().enumerate().for_each(|(i, v)| *v = i as f32 - 7.5);
        let image_name = "Lampe größer.exr";
        let ours = [close(image_name), create(image_name, &picture), update(image_name, &picture, 2, 3)].concat();
        let expected = theirs(|client| {
            client.send(PacketCloseImage { image_name }).unwrap();
            let (width, height) = (3, 5);
            client
                .send(PacketCreateImage { image_name, grab_focus: true, width, height, channel_names: &names })
                .unwrap();
            let update = PacketUpdateImage {
                image_name,
                grab_focus: false,
                channel_names: &names,
                channel_offsets: &[0, 1, 2, 3],
                channel_strides: &[4; 4],
                x: 0,
                y: 2,
                width: 3,
                height: 3,
                data: &picture.data[2 * 12..],
            };
            client.send(update).unwrap();
        });
        assert_eq!(ours, expected);
    }

    #[test]
    fn addresses() {
        for good in ["localhost:1", "127.0.0.1:14158", "[::1]:65535"] {
            assert_eq!(check(good), Ok(()), "{good}");
        }
        for bad in ["", "localhost", ":14158", "localhost:", "localhost:0", "localhost:65536", "localhost:port"] {
            assert!(check(bad).is_err(), "{bad}");
        }
    }
}
