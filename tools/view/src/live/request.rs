//! Reads a request, and decides who gets an answer: the page itself, in a browser on an address of
//! this server.
//!
//! A page of another site can make a browser send requests here, and can give this machine a name
//! of its own. `Host` must therefore be the address that the connection has come to, `Origin`, which
//! a browser adds for a foreign page, the same, and the path must begin with the token.

use std::net::{IpAddr, SocketAddr};

/// Most fields of a request's head.
const FIELDS_MOST: usize = 64;

/// The port that browsers leave out of `Host` and `Origin`.
const HTTP: u16 = 80;

/// A request without a body.
#[derive(Debug)]
pub(super) struct Request {
    method: String,
    path: String,
    hosts: Vec<Vec<u8>>,
    origins: Vec<Vec<u8>>,
}

/// The answer to a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Answer {
    Page,
    Frames,
    /// The code of the refusal, and its reason for people.
    Refused(u16, &'static str),
}

impl Request {
    /// Parses the head of a request; none if it is no HTTP.
    pub(super) fn parse(head: &[u8]) -> Option<Self> {
        let mut fields = [httparse::EMPTY_HEADER; FIELDS_MOST];
        let mut request = httparse::Request::new(&mut fields);
        let status = request.parse(head).ok()?;
        let of = |name: &str| {
            let named = |field: &&httparse::Header<'_>| field.name.eq_ignore_ascii_case(name);
            request.headers.iter().filter(named).map(|field| field.value.to_vec()).collect()
        };
        let (hosts, origins) = (of("host"), of("origin"));
        let (method, path) = (request.method?.to_owned(), request.path?.to_owned());
        status.is_complete().then_some(Self { method, path, hosts, origins })
    }

    /// Decides about a request that has come to a local address.
    pub(super) fn answer(&self, local: SocketAddr, token: &str) -> Answer {
        let [host] = self.hosts.as_slice() else {
            return Answer::Refused(400, "expected one Host");
        };
        if !is_own(host, local) {
            return Answer::Refused(403, "expected the address of this server as Host");
        }
        let origin = [b"http://", host.as_slice()].concat();
        if self.origins.iter().any(|found| *found != origin) {
            return Answer::Refused(403, "expected no other Origin than this server");
        }
        if self.method != "GET" {
            return Answer::Refused(405, "expected GET");
        }
        let mut parts = self.path.splitn(3, '/');
        let (before, found) = (parts.next(), parts.next().unwrap_or_default());
        if before != Some("") || !is_same(found.as_bytes(), token.as_bytes()) {
            return Answer::Refused(404, "expected the address that the run has printed");
        }
        match parts.next() {
            Some("") => Answer::Page,
            Some("frames") => Answer::Frames,
            _ => Answer::Refused(404, "expected the page, or its frames"),
        }
    }
}

/// Whether a field names a local address, in any text of it, or `localhost` for a loopback.
fn is_own(host: &[u8], local: SocketAddr) -> bool {
    let Ok(host) = str::from_utf8(host) else { return false };
    let name = match host.strip_suffix(&format!(":{}", local.port())) {
        Some(name) => name,
        None if local.port() == HTTP => host,
        None => return false,
    };
    let known = local.ip().to_canonical();
    let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
    let is_known = bare.parse().is_ok_and(|found: IpAddr| found.to_canonical() == known);
    is_known || known.is_loopback() && name == "localhost"
}

/// Compares texts in a time that does not tell where they differ.
fn is_same(one: &[u8], other: &[u8]) -> bool {
    let differing = one.iter().zip(other).fold(0, |all, (one, other)| all | (one ^ other));
    one.len() == other.len() && differing == 0
}

/// The head of a response; without a length it ends with the connection.
pub(super) fn head(code: u16, kind: &str, length: Option<usize>) -> String {
    let length = length.map_or(String::new(), |length| format!("Content-Length: {length}\r\n"));
    format!(
        "HTTP/1.1 {code} {code}\r\nContent-Type: {kind}\r\n{length}Connection: close\r\n\
         Cache-Control: no-store\r\nReferrer-Policy: no-referrer\r\n\
         X-Content-Type-Options: nosniff\r\nContent-Security-Policy: default-src 'none'; \
         script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; \
         connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n\r\n"
    )
}

/// A whole response.
pub(super) fn response(code: u16, kind: &str, body: &str) -> String {
    head(code, kind, Some(body.len())) + body
}

/// A refusal with its reason.
pub(super) fn refusal(code: u16, reason: &str) -> String {
    response(code, "text/plain", &format!("{reason}\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(head: &str) -> Answer {
        let local = "127.0.0.1:8000".parse().expect("an address");
        let request = Request::parse(head.replace('\n', "\r\n").as_bytes()).expect("a request");
        request.answer(local, "secret")
    }

    fn code(head: &str) -> u16 {
        match answer(head) {
            Answer::Refused(code, _) => code,
            _ => 200,
        }
    }

    #[test]
    fn the_page_and_its_frames_have_their_own_address_only() {
        let with = |path: &str| answer(&format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:8000\n\n"));
        assert_eq!(with("/secret/"), Answer::Page);
        assert_eq!(with("/secret/frames"), Answer::Frames);
        for path in ["/", "/secret", "/secre/", "/secrets/", "/Secret/", "//secret/", "/secret/x"] {
            assert!(matches!(with(path), Answer::Refused(404, _)), "{path}");
        }
    }

    #[test]
    fn another_host_origin_or_method_is_refused() {
        let with = |lines: &str| code(&format!("GET /secret/frames HTTP/1.1\n{lines}\n\n"));
        assert_eq!(with("Host: localhost:8000\nOrigin: http://localhost:8000"), 200);
        assert_eq!(with("host: 127.0.0.1:8000\norigin: http://127.0.0.1:8000"), 200);
        assert_eq!(with("Accept: */*"), 400);
        assert_eq!(with("Host: 127.0.0.1:8000\nHost: 127.0.0.1:8000"), 400);
        for host in ["evil.example:8000", "127.0.0.1", "127.0.0.1:800001", "127.0.0.2:8000", ""] {
            assert_eq!(with(&format!("Host: {host}")), 403, "{host}");
        }
        for origin in
            ["http://evil.example", "null", "https://127.0.0.1:8000", "http://localhost:8000"]
        {
            assert_eq!(with(&format!("Host: 127.0.0.1:8000\nOrigin: {origin}")), 403, "{origin}");
        }
        assert_eq!(code("POST /secret/ HTTP/1.1\nHost: 127.0.0.1:8000\n\n"), 405);
        assert!(Request::parse(b"nonsense\r\n\r\n").is_none());
    }

    fn at(local: &str, lines: &str) -> Answer {
        let head = format!("GET /secret/ HTTP/1.1\r\n{lines}\r\n\r\n");
        let request = Request::parse(head.as_bytes()).expect("a request");
        request.answer(local.parse().expect("an address"), "secret")
    }

    #[test]
    fn an_address_of_the_network_is_no_localhost() {
        assert_eq!(at("192.0.2.7:8000", "Host: 192.0.2.7:8000"), Answer::Page);
        let refused = at("192.0.2.7:8000", "Host: localhost:8000");
        assert!(matches!(refused, Answer::Refused(403, _)));
    }

    #[test]
    fn the_port_of_http_may_be_left_out() {
        for host in ["127.0.0.1", "127.0.0.1:80", "localhost", "localhost:80"] {
            let lines = format!("Host: {host}\r\nOrigin: http://{host}");
            assert_eq!(at("127.0.0.1:80", &lines), Answer::Page, "{host}");
        }
        for lines in ["Host: evil.example", "Host: 127.0.0.1:8000", "Host: 127.0.0.1:"] {
            assert!(matches!(at("127.0.0.1:80", lines), Answer::Refused(403, _)), "{lines}");
        }
        assert_eq!(at("[::1]:80", "Host: [::1]"), Answer::Page);
    }

    /// Browsers write the last 32 bits of an address in hexadecimal.
    #[test]
    fn an_address_of_version_4_within_version_6_is_known_in_every_text() {
        let local = "[::ffff:127.0.0.1]:8000";
        for host in ["[::ffff:127.0.0.1]:8000", "[::ffff:7f00:1]:8000", "localhost:8000"] {
            assert_eq!(at(local, &format!("Host: {host}")), Answer::Page, "{host}");
        }
        let refused = at(local, "Host: [::ffff:7f00:2]:8000");
        assert!(matches!(refused, Answer::Refused(403, _)));
    }
}
