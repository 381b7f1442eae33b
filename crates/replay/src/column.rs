//! A value of an episode over its steps, rounded to a visible precision.

use serde::Serialize;

/// The representation of the values of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// Multiples of 0.01 in 32 bits, each step as the difference from the previous one,
    /// which compresses better.
    Position,
    /// Multiples of a number in 16 bits.
    Short(f64),
    /// Multiples of a number in 8 bits.
    Byte(f64),
    /// Shares of the column's greatest value in 8 bits; multiples of 0.01 if all values lie in
    /// \[-1, 1\].
    Reading,
    /// 32-bit floating point; NaN for missing values.
    Real,
}

/// Values `[row][step]`.
#[derive(Debug)]
pub struct Column {
    name: &'static str,
    form: Form,
    n_steps: usize,
    values: Values,
}

#[derive(Debug)]
enum Values {
    /// Multiples of the form's number.
    Whole(Vec<i32>),
    Real(Vec<f32>),
}

/// The place of a column, and the scale of its numbers.
#[derive(Debug, Serialize)]
pub struct Place {
    name: &'static str,
    /// Type of the array: `i8`, `i16`, `i32` or `f32`.
    #[serde(rename = "type")]
    kind: &'static str,
    /// Bytes from the end of the header.
    offset: usize,
    n_rows: usize,
    /// The value of the stored number 1.
    scale: f64,
    /// Whether steps are differences from the previous step.
    is_difference: bool,
}

impl Form {
    /// The value of the stored number 1, if it does not depend on the values.
    fn scale(self) -> f64 {
        match self {
            Self::Position => 0.01,
            Self::Short(scale) | Self::Byte(scale) => scale,
            Self::Reading | Self::Real => 1.0,
        }
    }

    /// The range of the packed type.
    fn range(self) -> [f64; 2] {
        match self {
            Self::Short(_) => [i16::MIN.into(), i16::MAX.into()],
            Self::Byte(_) | Self::Reading => [i8::MIN.into(), i8::MAX.into()],
            Self::Position | Self::Real => [i32::MIN.into(), i32::MAX.into()],
        }
    }
}

impl Column {
    /// A column of zeros.
    pub fn new(name: &'static str, form: Form, n_rows: usize, n_steps: usize) -> Self {
        let n = n_rows * n_steps;
        let values = match form {
            Form::Position | Form::Short(_) | Form::Byte(_) => Values::Whole(vec![0; n]),
            Form::Reading | Form::Real => Values::Real(vec![0.0; n]),
        };
        Self { name, form, n_steps, values }
    }

    /// Sets a value.
    pub fn set(&mut self, row: usize, step: usize, value: f64) {
        let at = row * self.n_steps + step;
        match &mut self.values {
            Values::Whole(values) => {
                let [low, high] = self.form.range();
                values[at] = (value / self.form.scale()).round().clamp(low, high) as i32;
            }
            Values::Real(values) => values[at] = value as f32,
        }
    }

    /// Appends the array to a body.
    pub fn write(&self, body: &mut Vec<u8>) -> Place {
        body.resize(body.len().next_multiple_of(4), 0);
        let offset = body.len();
        let (mut scale, mut n_values) = (self.form.scale(), 0);
        let kind = match (&self.values, self.form) {
            (Values::Whole(values), form) => {
                n_values += values.len();
                for steps in values.chunks(self.n_steps.max(1)) {
                    let mut before = 0;
                    for &value in steps {
                        match form {
                            Form::Position => {
                                body.extend((value - before).to_le_bytes());
                                before = value;
                            }
                            Form::Short(_) => body.extend((value as i16).to_le_bytes()),
                            _ => body.extend((value as i8).to_le_bytes()),
                        }
                    }
                }
                match form {
                    Form::Position => "i32",
                    Form::Short(_) => "i16",
                    _ => "i8",
                }
            }
            (Values::Real(values), Form::Reading) => {
                n_values += values.len();
                let greatest = values.iter().fold(1.0, |greatest: f32, v| greatest.max(v.abs()));
                scale = f64::from(greatest) / 100.0;
                let byte = |value: &f32| (f64::from(*value) / scale).round() as i8;
                body.extend(values.iter().map(|value| byte(value).cast_unsigned()));
                "i8"
            }
            (Values::Real(values), _) => {
                n_values += values.len();
                body.extend(values.iter().flat_map(|value| value.to_le_bytes()));
                "f32"
            }
        };
        Place {
            name: self.name,
            kind,
            offset,
            n_rows: n_values / self.n_steps.max(1),
            scale,
            is_difference: self.form == Form::Position,
        }
    }
}
