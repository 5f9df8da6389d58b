//! One page by HTTP, to the browser on this machine alone.
//!
//! Source: R. Fielding et al., "HTTP/1.1", RFC 9112, 2022, of which this is the part that a browser needs to see one page: a request line,
//! header fields that are read over but for `Host`, an answer with its length, and the end of the connection. The socket is bound to
//! 127.0.0.1, and a request that names another host than this is refused: else a page from elsewhere could have its own name resolved
//! to 127.0.0.1 and read the answer (DNS rebinding).
//!
//! Every connection has a thread, because browsers open some that they may never use; there are at most 16, and none is waited for
//! longer than two seconds at a time.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Connections at a time.
const MOST_CONNECTIONS: usize = 16;

/// How long a connection may be silent.
const PATIENCE: Duration = Duration::from_secs(2);

/// Bytes of a request at most.
const LONGEST_REQUEST: u64 = 16 * 1024;

/// How often is looked whether to go on.
const PAUSE: Duration = Duration::from_millis(20);

/// A page that can be asked for.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    page: Arc<[u8]>,
}

/// Why no page can be asked for.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The port is taken, or not for everybody.
    #[error(
        "cannot listen at 127.0.0.1:{0}; choose another --port, or leave it out for one that is free"
    )]
    Port(u16, #[source] std::io::Error),
    /// The system takes no further connections.
    #[error("cannot take connections any more; start again")]
    Accept(#[source] std::io::Error),
}

impl Server {
    /// Listens at a port of this machine; at one that is free for port 0.
    ///
    /// # Errors
    /// When the port cannot be had.
    pub fn new(port: u16, page: impl Into<Arc<[u8]>>) -> Result<Self, ServeError> {
        let refused = |error| ServeError::Port(port, error);
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        Ok(Self {
            address: listener.local_addr().map_err(refused)?,
            listener,
            page: page.into(),
        })
    }

    /// Where the page is.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Answers until told to stop.
    ///
    /// # Errors
    /// When the system takes no further connections.
    pub fn run(&self, stop: impl Fn() -> bool) -> Result<(), ServeError> {
        use std::io::ErrorKind::{ConnectionAborted, ConnectionReset, Interrupted, WouldBlock};
        let open = Arc::new(AtomicUsize::new(0));
        while !stop() {
            if open.load(Ordering::Relaxed) >= MOST_CONNECTIONS {
                std::thread::sleep(PAUSE);
                continue;
            }
            match self.listener.accept() {
                Ok((stream, _)) => {
                    let (page, port) = (Arc::clone(&self.page), self.address.port());
                    let guard = Open::new(&open);
                    std::thread::spawn(move || {
                        let _guard = guard;
                        // Whoever went away wants no answer.
                        let _ = answer(stream, port, &page);
                    });
                }
                Err(error) if error.kind() == WouldBlock => std::thread::sleep(PAUSE),
                Err(error)
                    if matches!(
                        error.kind(),
                        Interrupted | ConnectionAborted | ConnectionReset
                    ) => {}
                Err(error) => return Err(ServeError::Accept(error)),
            }
        }
        Ok(())
    }
}

/// A connection that counts while this lives.
struct Open(Arc<AtomicUsize>);

impl Open {
    fn new(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(Arc::clone(count))
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Reads a request and answers it.
fn answer(mut stream: TcpStream, port: u16, page: &[u8]) -> std::io::Result<()> {
    stream.set_nonblocking(false)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut lines = BufReader::new(stream.try_clone()?.take(LONGEST_REQUEST)).lines();
    let request = lines.next().transpose()?.unwrap_or_default();
    let mut host = None;
    // A request that is cut off ends without the empty line, and is not answered as if it were whole.
    let mut is_whole = false;
    for line in lines {
        let line = line?;
        if line.is_empty() {
            is_whole = true;
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("host")
        {
            host = Some(value.trim().to_ascii_lowercase());
        }
    }
    let is_ours = ["127.0.0.1", "localhost"].iter().any(|name| {
        let own = host.as_deref();
        own == Some(&format!("{name}:{port}")) || port == 80 && own == Some(name)
    });
    let mut words = request.split(' ');
    let (method, target) = (words.next().unwrap_or_default(), words.next());
    let path = target.map(|target| target.split('?').next().unwrap_or_default());
    let (status, kind, body): (_, _, &[u8]) = if !is_whole {
        ("400 Bad Request", "text/plain", b"no whole request\n")
    } else if !is_ours {
        ("421 Misdirected Request", "text/plain", b"another host\n")
    } else if !matches!(method, "GET" | "HEAD") {
        ("405 Method Not Allowed", "text/plain", b"GET it\n")
    } else if path == Some("/") {
        ("200 OK", "text/html", page)
    } else {
        ("404 Not Found", "text/plain", b"there is one page, /\n")
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}; charset=utf-8\r\nContent-Length: {}\r\nAllow: GET, HEAD\r\n\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    if method != "HEAD" {
        stream.write_all(body)?;
    }
    stream.shutdown(std::net::Shutdown::Write)?;
    // Closing with something unread would reset the connection before the answer is read.
    let mut rest = [0; 1024];
    while stream.read(&mut rest)? > 0 {}
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    /// Sends a request and returns all that comes back.
    fn ask(address: SocketAddr, request: &str) -> String {
        let mut stream = TcpStream::connect(address).expect("somebody listens");
        stream.write_all(request.as_bytes()).expect("sent");
        stream
            .shutdown(std::net::Shutdown::Write)
            .expect("all is said");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    }

    /// Serves while some work is done.
    fn while_served(page: &str, work: impl FnOnce(SocketAddr)) {
        let server = Server::new(0, page.as_bytes()).expect("a free port");
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let running = scope.spawn(|| server.run(|| stop.load(Ordering::Relaxed)));
            let worked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                work(server.address);
            }));
            stop.store(true, Ordering::Relaxed);
            running.join().expect("it ends").expect("it served");
            worked.expect("the work");
        });
    }

    #[test]
    fn a_browser_gets_the_page_and_nothing_else() {
        while_served("<p>ü</p>", |address| {
            assert!(address.ip().is_loopback());
            let get = |line: &str, host: &str| {
                ask(address, &format!("{line} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
            };
            let own = address.to_string();
            let answer = get("GET /", &own);
            assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
            assert!(answer.contains("Content-Length: 9\r\n"), "{answer}");
            assert!(answer.ends_with("\r\n\r\n<p>ü</p>"), "{answer}");
            let name = format!("LOCALHOST:{}", address.port());
            assert!(get("GET /?mode=albedo", &name).ends_with("<p>ü</p>"));
            let head = get("HEAD /", &own);
            assert!(head.contains("Content-Length: 9") && head.ends_with("\r\n\r\n"));
            for (line, host, status) in [
                ("GET /../etc/passwd", own.as_str(), "404"),
                ("GET", &own, "404"),
                ("POST /", &own, "405"),
                ("GET /", "example.org", "421"),
                ("GET /", "127.0.0.1:1", "421"),
            ] {
                let answer = get(line, host);
                assert!(
                    answer.starts_with(&format!("HTTP/1.1 {status} ")),
                    "{answer}"
                );
                assert!(!answer.contains("<p>"));
            }
            for broken in ["", "\r\n", "GET / HTTP/1.1\r\nHost: x", "\0\u{1}\n\n\n"] {
                let answer = ask(address, broken);
                assert!(!answer.contains("200 OK"), "{broken:?}: {answer}");
            }
            let endless = format!("GET / HTTP/1.1\r\nX: {}", "x".repeat(40_000));
            let mut stream = TcpStream::connect(address).expect("somebody listens");
            // The other side may hang up in the middle of it.
            let _ = stream.write_all(endless.as_bytes());
            let mut answer = Vec::new();
            let _ = stream.read_to_end(&mut answer);
            assert!(!answer.starts_with(b"HTTP/1.1 200"));
        });
    }

    #[test]
    fn silent_connections_keep_nobody_waiting() {
        while_served("page", |address| {
            let _silent: Vec<TcpStream> = (0..MOST_CONNECTIONS / 2)
                .map(|_| TcpStream::connect(address).expect("somebody listens"))
                .collect();
            let request = format!("GET / HTTP/1.1\r\nHost: {address}\r\n\r\n");
            assert!(ask(address, &request).ends_with("page"));
        });
    }

    #[test]
    fn a_port_that_is_taken_is_named() {
        let first = Server::new(0, &b"page"[..]).expect("a free port");
        let port = first.address.port();
        let error = Server::new(port, &b"page"[..])
            .expect_err("taken")
            .to_string();
        assert!(
            error.contains(&port.to_string()) && error.contains("--port"),
            "{error}"
        );
    }
}
