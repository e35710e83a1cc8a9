//! A web server for one page on this machine: as little as it takes.
//!
//! It listens on 127.0.0.1 and nowhere else, answers `GET` for the paths that a function knows, and closes. Heads are
//! limited in size and time, connections in number. A request must name this machine as its host, so that a foreign
//! page cannot reach it by a name that resolves to 127.0.0.1; answers allow nothing but what comes from here.
//!
//! Heads are parsed by the crate `httparse`. The crate `tiny_http`, which would be the whole server, has had no release
//! since 2022 and knows no limit of time, of connections, or of a head's size.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Largest head of a request in bytes.
const MOST_HEAD: usize = 8 << 10;

/// Most header lines.
const MOST_LINES: usize = 64;

/// Time for a head to arrive.
const PATIENCE: Duration = Duration::from_secs(5);

/// Time for a part of an answer to be taken.
const WRITE_PATIENCE: Duration = Duration::from_secs(10);

/// Connections at the same time; more are closed at once.
const MOST_CONNECTIONS: usize = 16;

/// What belongs to a path.
pub struct Answer {
    /// Its type, say `text/html; charset=utf-8`.
    pub kind: &'static str,
    /// Its bytes.
    pub body: Arc<[u8]>,
    /// Called when all of it is sent.
    pub on_sent: Option<Box<dyn FnOnce() + Send>>,
}

/// Finds the answer for a path; `None` if there is no such thing.
pub type Answers = dyn Fn(&str) -> Option<Answer> + Send + Sync;

/// Listens on a port of 127.0.0.1, 0 being any that is free, and answers until the program ends. Gives the address.
///
/// # Errors
/// If the port cannot be had.
pub fn serve(port: u16, answers: Arc<Answers>) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
    let address = listener.local_addr()?;
    let open = Arc::new(AtomicUsize::new(0));
    std::thread::Builder::new().name("page".to_owned()).spawn(move || {
        for stream in listener.incoming() {
            let Ok(stream) = stream else {
                // Too many open files, say: it may pass.
                std::thread::sleep(Duration::from_millis(100));
                continue;
            };
            let slot = Slot::take(&open);
            let answers = answers.clone();
            if let Some(slot) = slot {
                let run = move || {
                    let _slot = slot;
                    // Whoever asked is gone; there is no one to tell.
                    let _ = answer(stream, address.port(), &*answers);
                };
                let _ = std::thread::Builder::new().spawn(run);
            }
        }
    })?;
    Ok(address)
}

/// One of the connections that may be open.
struct Slot(Arc<AtomicUsize>);

impl Slot {
    fn take(open: &Arc<AtomicUsize>) -> Option<Self> {
        let before = open.fetch_add(1, Ordering::Relaxed);
        let slot = Slot(open.clone());
        (before < MOST_CONNECTIONS).then_some(slot)
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

fn answer(mut stream: TcpStream, port: u16, answers: &Answers) -> io::Result<()> {
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
    let (status, answer) = match read_head(&mut stream)? {
        Head::Get(path, host) if is_own(&host, port) => match answers(&path) {
            Some(answer) => ("200 OK", answer),
            None => ("404 Not Found", text("there is no such page\n")),
        },
        Head::Get(..) => ("403 Forbidden", text("ask for 127.0.0.1\n")),
        Head::Other => ("405 Method Not Allowed", text("GET only\n")),
        Head::Broken => ("400 Bad Request", text("this is no request\n")),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nX-Frame-Options: SAMEORIGIN\r\nReferrer-Policy: no-referrer\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
         img-src 'self' data:\r\n\r\n",
        answer.kind,
        answer.body.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(&answer.body)?;
    stream.shutdown(std::net::Shutdown::Write)?;
    if let Some(on_sent) = answer.on_sent {
        on_sent();
    }
    Ok(())
}

fn text(body: &'static str) -> Answer {
    Answer { kind: "text/plain; charset=utf-8", body: body.as_bytes().into(), on_sent: None }
}

/// Whether a request was meant for this machine.
fn is_own(host: &str, port: u16) -> bool {
    let name = host.strip_suffix(&format!(":{port}")).unwrap_or(host);
    ["127.0.0.1", "localhost"].contains(&name)
}

/// What was asked.
enum Head {
    /// Path without what follows a `?`, and host.
    Get(String, String),
    Other,
    Broken,
}

fn read_head(stream: &mut TcpStream) -> io::Result<Head> {
    let started = Instant::now();
    let (mut bytes, mut part) = (Vec::new(), [0; 1024]);
    while bytes.len() < MOST_HEAD {
        let left = PATIENCE.checked_sub(started.elapsed()).filter(|left| !left.is_zero());
        let Some(left) = left else { return Ok(Head::Broken) };
        stream.set_read_timeout(Some(left))?;
        let count = stream.read(&mut part)?;
        bytes.extend(&part[..count]);
        let mut lines = [httparse::EMPTY_HEADER; MOST_LINES];
        let mut request = httparse::Request::new(&mut lines);
        match request.parse(&bytes) {
            Err(_) => return Ok(Head::Broken),
            Ok(httparse::Status::Partial) if count > 0 => {}
            Ok(httparse::Status::Partial) => return Ok(Head::Broken),
            Ok(httparse::Status::Complete(_)) => return Ok(head(&request)),
        }
    }
    Ok(Head::Broken)
}

fn head(request: &httparse::Request<'_, '_>) -> Head {
    let (Some(method), Some(path)) = (request.method, request.path) else { return Head::Broken };
    if method != "GET" {
        return Head::Other;
    }
    let mut hosts = request.headers.iter().filter(|line| line.name.eq_ignore_ascii_case("host"));
    let host = hosts.next().and_then(|line| std::str::from_utf8(line.value).ok());
    let path = path.split('?').next().unwrap_or_default();
    match (host, hosts.next()) {
        (Some(host), None) => Head::Get(path.to_owned(), host.trim().to_owned()),
        _ => Head::Broken,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends bytes and reads all that comes back.
    fn ask(address: SocketAddr, request: &[u8]) -> String {
        let mut stream = TcpStream::connect(address).unwrap();
        let mut answer = Vec::new();
        // Whoever has heard enough may answer and close before all is sent; what he has not read resets the connection.
        let _ = stream.write_all(request).and_then(|()| stream.shutdown(std::net::Shutdown::Write));
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8(answer).unwrap()
    }

    #[test]
    fn only_what_is_known_is_given() {
        let known = |path: &str| (path == "/").then(|| text("here"));
        let address = serve(0, Arc::new(known)).unwrap();
        assert!(address.ip().is_loopback() && address.port() > 0);
        let port = address.port();
        let get =
            |path: &str, host: &str| ask(address, format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").as_bytes());
        for host in [format!("127.0.0.1:{port}"), format!("localhost:{port}"), "localhost".to_owned()] {
            let answer = get("/?frame=1", &host);
            assert!(answer.starts_with("HTTP/1.1 200 OK\r\n") && answer.ends_with("\r\n\r\nhere"), "{answer}");
        }
        for path in ["/../Cargo.toml", "/%2e%2e/Cargo.toml", "//", "/etc/passwd", "/index.html"] {
            assert!(get(path, "localhost").starts_with("HTTP/1.1 404 "), "{path}");
        }
        for host in ["example.org", "127.0.0.1.example.org", "localhost:1", ""] {
            assert!(get("/", host).starts_with("HTTP/1.1 403 "), "{host}");
        }
        let method = |method: &str| ask(address, format!("{method} / HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes());
        for name in ["POST", "HEAD", "PUT", "OPTIONS", "get"] {
            assert!(method(name).starts_with("HTTP/1.1 405 "), "{name}");
        }
        let two_hosts = b"GET / HTTP/1.1\r\nHost: localhost\r\nHost: example.org\r\n\r\n";
        let long = format!("GET / HTTP/1.1\r\nHost: localhost\r\nX: {}\r\n\r\n", "x".repeat(9000));
        for bytes in [&b"\x16\x03\x01"[..], b"GET", b"GET /\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n", two_hosts] {
            assert!(ask(address, bytes).starts_with("HTTP/1.1 400 "), "{bytes:?}");
        }
        assert!(!ask(address, long.as_bytes()).contains("here"));
    }

    /// Connections that say nothing take no more than their share, and what comes after them is refused, not queued.
    #[test]
    fn connections_are_limited() {
        let address = serve(0, Arc::new(|_: &str| Some(text("here")))).unwrap();
        let silent: Vec<TcpStream> = (0..MOST_CONNECTIONS).map(|_| TcpStream::connect(address).unwrap()).collect();
        let mut refused = TcpStream::connect(address).unwrap();
        let mut bytes = Vec::new();
        // Closed at once, or reset.
        let _ = refused.read_to_end(&mut bytes);
        assert_eq!(bytes, b"");
        drop(silent);
        // Soon they are free again.
        let request = b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
        assert!((0..1000).any(|_| {
            std::thread::sleep(Duration::from_millis(5));
            ask_once(address, request).ends_with("here")
        }));
    }

    fn ask_once(address: SocketAddr, request: &[u8]) -> String {
        let Ok(mut stream) = TcpStream::connect(address) else { return String::new() };
        let mut answer = String::new();
        let _ = stream.write_all(request).and_then(|()| stream.read_to_string(&mut answer).map(drop));
        answer
    }
}
