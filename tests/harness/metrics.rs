//! Metrics of the programs under test, as Prometheus sees them.

use std::{
    io::{Read as _, Write as _},
    net::TcpStream,
};

use crate::LoggingProcess;

/// A scrape, parsed.
#[derive(Debug)]
pub struct Samples {
    /// The original text.
    pub text: String,
    samples: Vec<Sample>,
}

#[derive(Debug)]
struct Sample {
    name: String,
    labels: Vec<(String, String)>,
    value: f64,
}

/// The address at which a process started with `--metrics-listen 127.0.0.1:0` serves metrics.
pub fn metrics_address(process: &LoggingProcess) -> String {
    let line = process.wait_for("metrics' address", |line| line["message"] == "metrics served");
    line["address"].as_str().expect("text").to_owned()
}

impl Samples {
    /// Scrapes.
    pub fn scrape(address: &str) -> Self {
        let (status, text) = http_get(address, "/metrics");
        assert_eq!(status, 200, "{text}");
        let samples = text.lines().filter(|line| !line.starts_with('#')).map(parse).collect();
        Self { text, samples }
    }

    /// The value of the only series of a metric that has these labels, if there is one.
    pub fn find(&self, name: &str, labels: &[(&str, &str)]) -> Option<f64> {
        let is_it = |sample: &&Sample| {
            let has = |&(name, value): &(&str, &str)| {
                sample.labels.iter().any(|(n, v)| n == name && v == value)
            };
            sample.name == name && labels.iter().all(has)
        };
        let mut found = self.samples.iter().filter(is_it);
        let value = found.next().map(|sample| sample.value);
        assert!(found.next().is_none(), "{name} {labels:?} is several series: {}", self.text);
        value
    }

    /// The value of [`Self::find`], which must exist.
    pub fn value(&self, name: &str, labels: &[(&str, &str)]) -> f64 {
        self.find(name, labels).unwrap_or_else(|| panic!("no {name} {labels:?}: {}", self.text))
    }
}

/// `name{label="value",...} 1.5`; no value here has a quotation mark or a comma.
fn parse(line: &str) -> Sample {
    let (series, value) = line.rsplit_once(' ').expect("a value");
    let (name, labels) = match series.strip_suffix('}') {
        Some(series) => series.split_once('{').expect("labels in braces"),
        None => (series, ""),
    };
    let pair = |pair: &str| {
        let (name, value) = pair.split_once('=').expect("a label's value");
        (name.to_owned(), value.trim_matches('"').to_owned())
    };
    let labels = labels.split(',').filter(|pair| !pair.is_empty()).map(pair).collect();
    Sample { name: name.to_owned(), labels, value: value.parse().expect("a number") }
}

/// The status and the content at a path.
pub fn http_get(address: &str, path: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).expect("somebody listens");
    // HTTP/1.0, in which answers are not chunked.
    write!(stream, "GET {path} HTTP/1.0\r\nHost: {address}\r\n\r\n").expect("it can be written");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer in UTF-8");
    let (head, body) = answer.split_once("\r\n\r\n").expect("headers");
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    (status.expect("a status"), body.to_owned())
}
