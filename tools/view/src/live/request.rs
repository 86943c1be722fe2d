//! Reads a request, and decides who gets an answer: the page itself, in a browser on an address of
//! this server.
//!
//! A page of another site can make a browser send requests here, and can give this machine a name
//! of its own. `Host` must therefore be the address that the connection has come to, `Origin`, which
//! a browser adds for a foreign page, the same, and the path must begin with the token.

use std::net::SocketAddr;

/// Most fields of a request's head.
const FIELDS_MOST: usize = 64;

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
        let name = format!("localhost:{}", local.port());
        let own = [local.to_string()].into_iter().chain(local.ip().is_loopback().then_some(name));
        let mut own = own.map(String::into_bytes);
        let [host] = self.hosts.as_slice() else {
            return Answer::Refused(400, "expected one Host");
        };
        if !own.any(|known| known == *host) {
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
        let local = "127.0.0.1:80".parse().expect("an address");
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
        let with = |path: &str| answer(&format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:80\n\n"));
        assert_eq!(with("/secret/"), Answer::Page);
        assert_eq!(with("/secret/frames"), Answer::Frames);
        for path in ["/", "/secret", "/secre/", "/secrets/", "/Secret/", "//secret/", "/secret/x"] {
            assert!(matches!(with(path), Answer::Refused(404, _)), "{path}");
        }
    }

    #[test]
    fn another_host_origin_or_method_is_refused() {
        let with = |lines: &str| code(&format!("GET /secret/frames HTTP/1.1\n{lines}\n\n"));
        assert_eq!(with("Host: localhost:80\nOrigin: http://localhost:80"), 200);
        assert_eq!(with("host: 127.0.0.1:80\norigin: http://127.0.0.1:80"), 200);
        assert_eq!(with("Accept: */*"), 400);
        assert_eq!(with("Host: 127.0.0.1:80\nHost: 127.0.0.1:80"), 400);
        for host in ["evil.example:80", "127.0.0.1", "127.0.0.1:81", "127.0.0.2:80", ""] {
            assert_eq!(with(&format!("Host: {host}")), 403, "{host}");
        }
        for origin in ["http://evil.example", "null", "https://127.0.0.1:80", "http://localhost:80"]
        {
            assert_eq!(with(&format!("Host: 127.0.0.1:80\nOrigin: {origin}")), 403, "{origin}");
        }
        assert_eq!(code("POST /secret/ HTTP/1.1\nHost: 127.0.0.1:80\n\n"), 405);
        assert!(Request::parse(b"nonsense\r\n\r\n").is_none());
    }

    #[test]
    fn an_address_of_the_network_is_no_localhost() {
        let local = "192.0.2.7:80".parse().expect("an address");
        let answer = |host: &str| {
            let head = format!("GET /secret/ HTTP/1.1\r\nHost: {host}\r\n\r\n");
            Request::parse(head.as_bytes()).expect("a request").answer(local, "secret")
        };
        assert_eq!(answer("192.0.2.7:80"), Answer::Page);
        assert!(matches!(answer("localhost:80"), Answer::Refused(403, _)));
    }
}
