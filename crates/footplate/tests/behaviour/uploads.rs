//! A recording that was made to be large is refused, and neither the program nor its train notices.
#![cfg(unix)]

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int32Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::guardian::{memory_kb, running};

/// What the program itself may need for what it passes on and refuses (kB).
const PASSED_ON_KB: u64 = 40_000;
/// Longer than a clerk may take.
const PATIENCE: Duration = Duration::from_secs(120);

/// One row, the name of whose run is hundreds of megabytes long: some kilobytes as a file.
fn expanding() -> Vec<u8> {
    const NAME: usize = 300 << 20;
    let schema = "message recording { required double t_s; required int32 pulses_1; required int32 pulses_2; \
                  required binary run_id (UTF8); }";
    let schema = Arc::new(parse_message_type(schema).expect("a schema"));
    let level = ZstdLevel::try_new(3).expect("a level");
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(level))
        .set_dictionary_enabled(false)
        .set_statistics_enabled(parquet::file::properties::EnabledStatistics::None)
        .build();
    let mut file = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut file, schema, Arc::new(properties)).expect("a writer");
    let mut group = writer.next_row_group().expect("a group");
    let mut column = group.next_column().expect("a column").expect("one more");
    column.typed::<DoubleType>().write_batch(&[0.05], None, None).expect("written");
    column.close().expect("written");
    for _ in 0..2 {
        let mut column = group.next_column().expect("a column").expect("one more");
        column.typed::<Int32Type>().write_batch(&[1], None, None).expect("written");
        column.close().expect("written");
    }
    let mut column = group.next_column().expect("a column").expect("one more");
    let name = ByteArray::from(vec![b'a'; NAME]);
    column.typed::<ByteArrayType>().write_batch(&[name], None, None).expect("written");
    column.close().expect("written");
    group.close().expect("written");
    writer.close().expect("written");
    file
}

/// Runs of one row each.
fn short_runs() -> Vec<u8> {
    const RUNS: usize = 65_000;
    let mut text = String::from("run_id,t_s,pulses_1,pulses_2\n");
    for run in 0..RUNS {
        writeln!(text, "r{run},0.05,10,10").expect("text");
    }
    text.into_bytes()
}

fn send(host: &str, name: &str, recording: &[u8]) -> String {
    upload(host, name, recording).expect("sent")
}

/// Uploads a recording; returns the answer.
pub(crate) fn upload(host: &str, name: &str, recording: &[u8]) -> std::io::Result<String> {
    post(host, &format!("/api/odometry/{name}"), recording)
}

fn post(host: &str, path: &str, body: &[u8]) -> std::io::Result<String> {
    let mut stream = TcpStream::connect(host)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let length = body.len();
    write!(
        stream,
        "POST {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\nContent-Type: application/octet-stream\r\nContent-Length: {length}\r\n\r\n"
    )?;
    // A server that refuses need not read to the end.
    let _ = stream.write_all(body);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    Ok(String::from_utf8_lossy(&answer).into_owned())
}

#[test]
fn a_recording_that_grows_without_end_is_refused_and_the_program_lives_on() {
    let (_board, line, driven, _) = running("uploads");
    let host = driven.host();
    let since = line.now();
    // A recording that is in order is answered with its page.
    let small = "t_s,pulses_1,pulses_2\n0.05,10,10\n0.10,10,10\n0.15,10,10\n";
    let answer = send(&host, "small.csv", small.as_bytes());
    assert!(answer.contains("200 OK") && answer.contains("/api/odometry/pages/0"), "{answer}");
    let answer = send(&host, "wrong.csv", b"t_s,pulses_1\n1,2\n");
    assert!(answer.contains("422") && answer.contains("pulses_2"), "{answer}");
    let before = memory_kb(driven.child(), "VmHWM:");
    // The sizes in the headers of a Parquet file tell; a CSV of too many runs is found out at the first too many.
    let too_large = "column run_id: its 1 values would unpack to 314572827 bytes; at most 1049600 are read";
    for (name, recording, status, why) in [
        ("expanding.parquet", expanding(), "422", too_large),
        ("runs.csv", short_runs(), "422", "one of at most 3000 runs"),
    ] {
        let began = line.now();
        let answer = send(&host, name, &recording);
        println!("{name}, {} bytes: {:.1?}, {answer}", recording.len(), line.now() - began);
        assert!(answer.contains(status) && answer.contains(why), "{name}: {answer}");
    }
    let after = memory_kb(driven.child(), "VmHWM:");
    println!("the program: {before} kB at most before, {after} kB after");
    assert!(after < before + PASSED_ON_KB, "{before} kB, then {after} kB");
    // A layout of 45 000 tables, which takes 190 MB to read.
    let tables: String = (0..45_000).map(|nth| format!("a{nth}.b.c.d=1\n")).collect();
    let layout = serde_json::json!({ "toml": tables }).to_string();
    let answer = post(&host, "/api/layout/check", layout.as_bytes()).expect("sent");
    assert!(answer.contains("422") && answer.contains("the drawn layout"), "{answer}");
    let after = memory_kb(driven.child(), "VmHWM:");
    println!("the program after a layout: {after} kB");
    assert!(after < before + PASSED_ON_KB, "{before} kB, then {after} kB");
    // Many at once wait, or are sent away.
    let runs = Arc::new(short_runs());
    let many: Vec<_> = (0..12)
        .map(|_| {
            let (host, runs) = (host.clone(), Arc::clone(&runs));
            std::thread::spawn(move || send(&host, "runs.csv", &runs))
        })
        .collect();
    for one in many {
        let answer = one.join().expect("no panic");
        assert!(answer.contains("422") || answer.contains("429"), "{answer}");
    }
    let after = memory_kb(driven.child(), "VmHWM:");
    assert!(after < before + PASSED_ON_KB, "{before} kB, then {after} kB");
    // The train may have come to the end of what it may run on; the power goes off only where the program dies.
    let power_off: Option<Instant> = line.time_of(b"<0", since);
    assert!(power_off.is_none(), "{}", line.said());
}
