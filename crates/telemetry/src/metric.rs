//! Definitions of metrics, and their values in Prometheus' text format.

use std::collections::BTreeMap;

use prometheus::{
    Histogram, HistogramOpts, TextEncoder,
    core::Collector as _,
    proto::{Counter, Gauge, LabelPair, Metric as Series, MetricFamily, MetricType},
};

/// The definition of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metric {
    /// Unique, with its unit, and with `_total` for a counter.
    pub name: &'static str,
    /// The kind of its values.
    pub kind: Kind,
    /// Names of the labels that distinguish its series.
    pub labels: &'static [&'static str],
    /// Its meaning, for people.
    pub help: &'static str,
}

/// The kind of values of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A present value.
    Gauge,
    /// A sum since the program's start.
    Counter,
    /// Numbers of measurements up to each bound, since the program's start.
    Histogram,
}

/// Defines a program's metrics, and the list `METRICS` of all of them.
#[macro_export]
macro_rules! metrics {
    ($($id:ident = $kind:ident $name:literal [$($label:literal),*] $help:literal;)*) => {
        $(const $id: $crate::Metric = $crate::Metric {
            name: $name,
            kind: $crate::Kind::$kind,
            labels: &[$($label),*],
            help: $help,
        };)*
        /// All metrics of this program.
        pub const METRICS: &[$crate::Metric] = &[$($id),*];
    };
}

impl Kind {
    /// Its name in the text format.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gauge => "gauge",
            Self::Counter => "counter",
            Self::Histogram => "histogram",
        }
    }
}

impl Metric {
    /// An empty histogram, for a metric of that kind without labels. `bounds`: upper bounds of
    /// the buckets, ascending.
    pub fn histogram(&self, bounds: &[f64]) -> Histogram {
        let options = HistogramOpts::new(self.name, self.help).buckets(bounds.to_vec());
        Histogram::with_opts(options).expect("the definition is valid")
    }
}

/// The values at one moment. Metrics without a value have no series.
#[derive(Debug, Default)]
pub struct Scrape {
    families: BTreeMap<&'static str, MetricFamily>,
}

impl Scrape {
    /// Adds the value of a gauge or counter; `labels`: in the order of their names.
    pub fn put(&mut self, metric: &Metric, labels: &[&str], value: f64) {
        debug_assert_eq!(labels.len(), metric.labels.len(), "{}", metric.name);
        let pairs = metric.labels.iter().zip(labels).map(|(name, value)| {
            let mut pair = LabelPair::default();
            pair.set_name((*name).to_owned());
            pair.set_value((*value).to_owned());
            pair
        });
        let mut series = Series::from_label(pairs.collect());
        let kind = match metric.kind {
            Kind::Gauge => {
                let mut gauge = Gauge::default();
                gauge.set_value(value);
                series.set_gauge(gauge);
                MetricType::GAUGE
            }
            Kind::Counter => {
                let mut counter = Counter::default();
                counter.set_value(value);
                series.set_counter(counter);
                MetricType::COUNTER
            }
            Kind::Histogram => unreachable!("histograms are put in as a whole"),
        };
        let family = self.families.entry(metric.name).or_insert_with(|| {
            let mut family = MetricFamily::default();
            family.set_name(metric.name.to_owned());
            family.set_help(metric.help.to_owned());
            family.set_field_type(kind);
            family
        });
        family.mut_metric().push(series);
    }

    /// Adds a histogram.
    pub fn put_histogram(&mut self, metric: &Metric, histogram: &Histogram) {
        self.families.extend(histogram.collect().into_iter().map(|family| (metric.name, family)));
    }

    /// All values in Prometheus' text format, sorted by name.
    pub fn into_text(self) -> String {
        let families: Vec<MetricFamily> = self.families.into_values().collect();
        TextEncoder::new().encode_to_string(&families).expect("every family has a series")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    metrics! {
        SLOTS = Gauge "slots" ["name"] "How many.";
        ITEMS = Counter "items_total" [] "Done.";
        WAITS = Histogram "wait_seconds" [] "How long.";
    }

    #[test]
    fn values_are_written_in_the_text_format_and_labels_cannot_break_it() {
        let mut scrape = Scrape::default();
        scrape.put(&SLOTS, &["a\"b\\c\nd"], 1.5);
        scrape.put(&SLOTS, &["größe"], f64::NAN);
        scrape.put(&ITEMS, &[], 3.0);
        let waits = WAITS.histogram(&[0.1, 1.0]);
        waits.observe(0.5);
        scrape.put_histogram(&WAITS, &waits);
        let expected = r#"# HELP items_total Done.
# TYPE items_total counter
items_total 3
# HELP slots How many.
# TYPE slots gauge
slots{name="a\"b\\c\nd"} 1.5
slots{name="größe"} NaN
# HELP wait_seconds How long.
# TYPE wait_seconds histogram
wait_seconds_bucket{le="0.1"} 0
wait_seconds_bucket{le="1"} 1
wait_seconds_bucket{le="+Inf"} 1
wait_seconds_sum 0.5
wait_seconds_count 1
"#;
        assert_eq!(scrape.into_text(), expected);
        assert_eq!(METRICS, [SLOTS, ITEMS, WAITS]);
    }

    #[test]
    fn a_metric_without_series_is_left_out() {
        assert_eq!(Scrape::default().into_text(), "");
    }
}
