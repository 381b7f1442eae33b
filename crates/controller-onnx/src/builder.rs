//! Graphs, operation by operation.

use std::mem;

use crate::proto::{
    AttributeProto, BOOL, Dimension, Extent, FLOAT, GraphProto, INT64, NodeProto, TensorProto,
    TensorShapeProto, TensorType, TypeProto, ValueInfoProto,
};

/// The dimension of all tensors that have a row per robot.
const ROBOTS: &str = "robots";

/// The operations so far, and the numbers that they use.
#[derive(Debug, Default)]
pub struct Builder {
    nodes: Vec<NodeProto>,
    constants: Vec<TensorProto>,
    n_names: usize,
}

impl Builder {
    /// A name that no other value has.
    fn name(&mut self) -> String {
        self.n_names += 1;
        format!("value_{}", self.n_names)
    }

    fn tensor(&mut self, data_type: i32, dims: &[usize], raw_data: Vec<u8>) -> String {
        let name = self.name();
        self.add_tensor(name.clone(), data_type, dims, raw_data);
        name
    }

    fn add_tensor(&mut self, name: String, data_type: i32, dims: &[usize], raw_data: Vec<u8>) {
        let dims = dims.iter().map(|&n| n as i64).collect();
        self.constants.push(TensorProto { dims, data_type, name, raw_data });
    }

    /// Constant numbers, row by row.
    pub fn floats(&mut self, dims: &[usize], values: &[f32]) -> String {
        let raw = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.tensor(FLOAT, dims, raw)
    }

    /// A list of whole numbers.
    pub fn numbers(&mut self, values: &[i64]) -> String {
        let raw = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.tensor(INT64, &[values.len()], raw)
    }

    /// The values of an input that the caller leaves out: a row.
    pub fn default_row(&mut self, name: &str, values: &[f32]) {
        let raw = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add_tensor(name.to_owned(), FLOAT, &[1, values.len()], raw);
    }

    /// Adds an operation, whose result has the name `output`.
    pub fn put(&mut self, op_type: &str, inputs: &[&str], axis: Option<i64>, output: &str) {
        let attribute = axis.map(|axis| AttributeProto {
            name: "axis".to_owned(),
            i: Some(axis),
            g: None,
            r#type: 2,
        });
        self.push(op_type, inputs, vec![output.to_owned()], attribute.into_iter().collect());
    }

    fn push(
        &mut self,
        op_type: &str,
        inputs: &[&str],
        output: Vec<String>,
        attribute: Vec<AttributeProto>,
    ) {
        self.nodes.push(NodeProto {
            input: inputs.iter().map(|&input| input.to_owned()).collect(),
            name: output.join(" "),
            output,
            op_type: op_type.to_owned(),
            attribute,
        });
    }

    /// Adds an operation; returns the name of its result.
    pub fn op(&mut self, op_type: &str, inputs: &[&str]) -> String {
        let output = self.name();
        self.put(op_type, inputs, None, &output);
        output
    }

    /// The same for an operation along an axis.
    pub fn along(&mut self, op_type: &str, axis: i64, inputs: &[&str]) -> String {
        let output = self.name();
        self.put(op_type, inputs, Some(axis), &output);
        output
    }

    /// Columns of a table.
    pub fn columns(&mut self, table: &str, columns: impl IntoIterator<Item = usize>) -> String {
        let columns: Vec<i64> = columns.into_iter().map(|column| column as i64).collect();
        let columns = self.numbers(&columns);
        self.along("Gather", 1, &[table, &columns])
    }

    /// Values that a function changes `n` times, in a loop if this is more than once. `widths`:
    /// their columns.
    pub fn repeat<const N: usize>(
        &mut self,
        n: u32,
        values: [String; N],
        widths: [usize; N],
        step: impl FnOnce(&mut Self, [String; N]) -> [String; N],
    ) -> [String; N] {
        if n == 1 {
            return step(self, values);
        }
        let outer = mem::take(&mut self.nodes);
        let (iteration, goes_on) = (self.name(), self.name());
        let inside = [(); N].map(|()| self.name());
        let results = step(self, inside.clone());
        let still = self.op("Identity", &[&goes_on]);
        let body = GraphProto {
            node: mem::replace(&mut self.nodes, outer),
            name: "substep".to_owned(),
            initializer: Vec::new(),
            input: [single(iteration, INT64), single(goes_on, BOOL)]
                .into_iter()
                .chain(inside.into_iter().zip(widths).map(|(name, width)| table(name, width, "")))
                .collect(),
            output: std::iter::once(single(still, BOOL))
                .chain(results.into_iter().zip(widths).map(|(name, width)| table(name, width, "")))
                .collect(),
        };
        let count = self.tensor(INT64, &[], i64::from(n).to_le_bytes().into());
        let after = [(); N].map(|()| self.name());
        let mut inputs = vec![count.as_str(), ""];
        inputs.extend(values.iter().map(String::as_str));
        let attribute =
            AttributeProto { name: "body".to_owned(), i: None, g: Some(body), r#type: 5 };
        self.push("Loop", &inputs, after.to_vec(), vec![attribute]);
        after
    }

    /// The whole graph.
    pub fn finish(self, input: Vec<ValueInfoProto>, output: Vec<ValueInfoProto>) -> GraphProto {
        let name = "controller".to_owned();
        GraphProto { node: self.nodes, name, initializer: self.constants, input, output }
    }
}

/// A table of floats with a row per robot.
pub fn table(name: String, width: usize, doc: &str) -> ValueInfoProto {
    value(name, FLOAT, vec![Extent::DimParam(ROBOTS.into()), Extent::DimValue(width as i64)], doc)
}

/// A single value.
fn single(name: String, elem_type: i32) -> ValueInfoProto {
    value(name, elem_type, Vec::new(), "")
}

fn value(name: String, elem_type: i32, shape: Vec<Extent>, doc: &str) -> ValueInfoProto {
    let dim = shape.into_iter().map(|extent| Dimension { value: Some(extent) }).collect();
    let tensor_type = Some(TensorType { elem_type, shape: Some(TensorShapeProto { dim }) });
    ValueInfoProto { name, r#type: Some(TypeProto { tensor_type }), doc_string: doc.to_owned() }
}
