//! Readers of a run, by plain sockets.

use std::io::{BufRead as _, BufReader};
use std::sync::mpsc::channel;

use serde_json::Value;
use zynq_pgs::{Pose, Velocity};

use super::*;
use crate::recording::fixture;

const LOOPBACK: &str = "127.0.0.1:0";
/// A test that waits longer has failed.
const MOST: Duration = Duration::from_secs(60);

fn bodies(recording: &Recording) -> Vec<Body> {
    // The ground is body 0.
    let poses = &recording.frames()[0].poses;
    let body = |pose: &Pose| Body { pose: *pose, velocity: Velocity::default(), shape: 0 };
    poses[..1].iter().chain(poses).map(body).collect()
}

fn live(limits: Limits) -> (Live, Vec<Body>) {
    let recording = fixture(1);
    let address = LOOPBACK.parse().expect("an address");
    let live = Live::within(limits, address, &recording, "a run", &[]).expect("a free port");
    (live, bodies(&recording))
}

fn unpaced() -> Limits {
    Limits { interval: Duration::ZERO, ..LIMITS }
}

/// Asks for a path of the run, with further lines.
fn ask(live: &Live, path: &str, lines: &str) -> BufReader<TcpStream> {
    let mut stream = TcpStream::connect(live.address).expect("a connection");
    stream.set_read_timeout(Some(MOST)).expect("a time");
    let (address, token) = (live.address, &live.hub.token);
    let head = format!("GET /{token}/{path} HTTP/1.1\r\nHost: {address}\r\n{lines}\r\n");
    stream.write_all(head.as_bytes()).expect("sent");
    BufReader::new(stream)
}

fn line(reader: &mut impl std::io::BufRead) -> String {
    let mut line = String::new();
    reader.read_line(&mut line).expect("a line");
    line.trim_end().to_owned()
}

/// A reader of frames behind the head of its answer.
fn reader(live: &Live) -> BufReader<TcpStream> {
    let mut reader = ask(live, "frames", "");
    assert_eq!(line(&mut reader), "HTTP/1.1 200 200");
    while !line(&mut reader).is_empty() {}
    reader
}

/// Waits for a number of readers.
fn wait_for(live: &Live, readers: usize) {
    let begin = Instant::now();
    while live.hub.readers().len() != readers {
        assert!(begin.elapsed() < MOST, "{} readers", live.hub.readers().len());
        thread::yield_now();
    }
}

fn frame(reader: &mut impl std::io::BufRead) -> Value {
    let text = line(reader);
    assert_eq!(line(reader), "");
    serde_json::from_str(text.strip_prefix("data: ").expect("data")).expect("JSON")
}

#[test]
fn frames_arrive_while_the_run_goes_on_and_the_last_one_says_so() {
    let (mut live, bodies) = live(unpaced());
    let mut reader = reader(&live);
    wait_for(&live, 1);
    for step in 1..=3 {
        live.show((step, 0.5), || "7 ms".to_owned(), &bodies);
        let found = frame(&mut reader);
        assert_eq!((&found["step"], &found["note"]), (&step.into(), &"7 ms".into()));
        assert_eq!(found["ended"], false);
        let poses = BASE64_STANDARD.decode(found["poses"].as_str().expect("text"));
        assert_eq!(poses.expect("base64").len(), 13 * 18);
    }
    live.end((4, 1.0), "done", &bodies);
    assert_eq!(frame(&mut reader)["ended"], true);
    assert_eq!(line(&mut reader), "", "the connection is closed");
}

#[test]
fn the_page_is_served_with_a_policy_that_keeps_others_out() {
    let (live, _) = live(LIMITS);
    let mut answer = String::new();
    ask(&live, "", "").read_to_string(&mut answer).expect("a page");
    let (head, page) = answer.split_once("\r\n\r\n").expect("a head");
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("default-src 'none'"), "{head}");
    assert!(page.contains("EventSource(\"frames\")") && page.contains("\"live\":true"));
    assert!(live.url().ends_with(&format!("/{}/", live.hub.token)));
    assert_eq!(live.hub.token.len(), 32);
}

#[test]
fn a_wrong_token_host_or_origin_gets_no_frame() {
    let (live, _) = live(LIMITS);
    let refused = |mut answer: BufReader<TcpStream>| line(&mut answer);
    assert_eq!(refused(ask(&live, "other", "")), "HTTP/1.1 404 404");
    assert_eq!(refused(ask(&live, "frames", "Host: evil.example\r\n")), "HTTP/1.1 400 400");
    let foreign = "Origin: http://evil.example\r\n";
    assert_eq!(refused(ask(&live, "frames", foreign)), "HTTP/1.1 403 403");
    let mut stream = TcpStream::connect(live.address).expect("a connection");
    let head = format!("GET /frames HTTP/1.1\r\nHost: {}\r\n\r\n", live.address);
    stream.write_all(head.as_bytes()).expect("sent");
    assert_eq!(line(&mut BufReader::new(stream)), "HTTP/1.1 404 404");
    assert!(live.hub.readers().is_empty());
}

#[test]
fn one_connection_more_than_the_most_is_refused() {
    let (live, _) = live(Limits { connections: 2, ..LIMITS });
    let both = [reader(&live), reader(&live)];
    assert_eq!(line(&mut ask(&live, "frames", "")), "HTTP/1.1 503 503");
    drop(both);
}

#[test]
fn a_connection_that_asks_for_nothing_is_closed_in_time() {
    let (live, _) = live(Limits { request: Duration::from_millis(20), ..LIMITS });
    let mut stream = TcpStream::connect(live.address).expect("a connection");
    stream.set_read_timeout(Some(MOST)).expect("a time");
    assert_eq!(stream.read(&mut [0; 1]).expect("closed"), 0);
}

/// The slow reader takes nothing: its frames fill the buffers of the system, then the channel.
#[test]
fn a_slow_reader_is_dropped_and_the_other_one_gets_each_frame() {
    let limits = Limits { write: Duration::from_millis(300), ..unpaced() };
    let (mut live, bodies) = live(limits);
    let slow = reader(&live);
    let mut good = reader(&live);
    wait_for(&live, 2);
    let (seen, frames) = channel();
    let other = thread::spawn(move || {
        let mut text = String::new();
        while good.read_line(&mut text).is_ok_and(|count| count > 0) {
            if text.contains("data:") && seen.send(()).is_err() {
                break;
            }
            text.clear();
        }
    });
    // A long note makes few frames fill the buffers.
    let note = "x".repeat(1 << 20);
    let begin = Instant::now();
    let mut step = 0;
    while live.hub.readers().len() > 1 {
        assert!(begin.elapsed() < MOST, "the slow reader is still there after {step} frames");
        step += 1;
        live.show((step, 0.1), || note.clone(), &bodies);
        // The good reader sets the pace.
        frames.recv_timeout(MOST).expect("the other reader gets each frame");
    }
    drop(slow);
    drop(frames);
    live.end((step, 0.1), "", &bodies);
    other.join().expect("it ends");
}

/// Their threads neither take a frame nor end.
#[test]
fn readers_without_room_hold_up_no_frame_and_the_end_waits_once_for_all() {
    const READERS: u32 = 200;
    let limits = Limits { write: Duration::from_millis(100), ..unpaced() };
    let (mut live, bodies) = live(limits);
    let mut held = Vec::new();
    for _ in 0..READERS {
        let ((events, frames), (here, gone)) = (mpsc::sync_channel(0), channel());
        held.push((frames, here));
        live.hub.readers().push(Reader { events, gone });
    }
    let (done, ended) = channel();
    let run = thread::spawn(move || {
        live.show((1, 0.1), String::new, &bodies);
        live.end((2, 0.2), "", &bodies);
        done.send(()).expect("the test waits");
    });
    let one_by_one = limits.write * READERS;
    ended.recv_timeout(one_by_one).expect("one time for all readers");
    run.join().expect("it ends");
}

#[test]
fn errors_of_the_listener_do_not_end_it() {
    let (live, _) = live(Limits { pause: Duration::ZERO, ..LIMITS });
    let other = TcpListener::bind(LOOPBACK).expect("a free port");
    let address = other.local_addr().expect("its address");
    let mut stream = TcpStream::connect(address).expect("a connection");
    let token = &live.hub.token;
    let head = format!("GET /{token}/ HTTP/1.1\r\nHost: {address}\r\n\r\n");
    stream.write_all(head.as_bytes()).expect("sent");
    let errors = (0..1000).map(|_| Err(io::ErrorKind::QuotaExceeded.into()));
    accept(errors.chain([Ok(other.accept().expect("it is there").0)]), &live.hub);
    assert_eq!(line(&mut BufReader::new(stream)), "HTTP/1.1 200 200");
}

#[test]
fn without_a_reader_no_frame_is_encoded_and_with_one_not_too_many() {
    let (mut live, bodies) = live(LIMITS);
    live.show((1, 0.1), String::new, &bodies);
    assert!(live.sent.is_none(), "nobody reads");
    let mut reader = reader(&live);
    wait_for(&live, 1);
    let begin = Instant::now();
    (2..1000).for_each(|step| live.show((step, 0.1), String::new, &bodies));
    let most = begin.elapsed().as_millis() / LIMITS.interval.as_millis() + 1;
    assert_eq!(frame(&mut reader)["ended"], false);
    let mut count = 1;
    live.end((1000, 0.2), "", &bodies);
    while frame(&mut reader)["ended"] == false {
        count += 1;
    }
    assert!((1..=most).contains(&count), "{count} frames, at most {most}");
}
