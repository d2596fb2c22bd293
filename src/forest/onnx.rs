//! A forest as an ONNX model: one `TreeEnsembleRegressor` of `ai.onnx.ml`, opset 3.

use std::iter::repeat_n;

use super::forest::RegressionForest;
use super::params::ForestError;
use super::walk::Tree;

/// What the model says of itself.
#[derive(Clone, Copy, Debug)]
pub struct OnnxDescription<'a> {
    /// Name of the graph.
    pub name: &'a str,
    /// For a reader of the model.
    pub text: &'a str,
    /// Name of each feature, with its unit.
    pub features: &'a [&'a str],
    /// Name of the output, with its unit.
    pub target: &'a str,
}

/// Name of the model's input.
const INPUT: &str = "records";

impl RegressionForest<f64> {
    /// The forest as the bytes of an ONNX file.
    ///
    /// Input is `records`, double, N × features; output is named by the description, float,
    /// N × 1. Splits and sums are double, so records take the same ways as here; the output
    /// is rounded to float, by 6e-8 of its value at most, because the operator has no
    /// other. NaN goes right, as here. Metadata `features` and `target` hold the names.
    ///
    /// # Errors
    /// [`ForestError`] if features are not named one by one, or the file would be too large.
    pub fn to_onnx(&self, description: &OnnxDescription<'_>) -> Result<Vec<u8>, ForestError> {
        let features = self.features();
        if description.features.len() != features {
            let named = description.features.len();
            return Err(ForestError::FeatureNames { named, fitted: features });
        }
        let columns = description.features.join(",");
        let rows = Message::default().text(2, "N");
        let of_input = Message::default().int(1, features as u64);
        let of_output = Message::default().int(1, 1);
        let value = |name, kind, columns: Message| {
            let shape = Message::default().message(1, &rows).message(1, &columns);
            let tensor = Message::default().int(1, kind).message(2, &shape);
            Message::default().text(1, name).message(2, &Message::default().message(1, &tensor))
        };
        let graph = Message::default()
            .message(1, &self.node(description.target))
            .text(2, description.name)
            .text(10, description.text)
            .message(11, &value(INPUT, DOUBLE, of_input).text(3, &columns))
            .message(12, &value(description.target, FLOAT, of_output));
        let opset = |domain, version| Message::default().text(1, domain).int(2, version);
        let entry = |key, value| Message::default().text(1, key).text(2, value);
        let model = Message::default()
            .int(1, IR_VERSION)
            .text(2, env!("CARGO_PKG_NAME"))
            .text(3, env!("CARGO_PKG_VERSION"))
            .text(6, description.text)
            .message(7, &graph)
            .message(8, &opset("", 15))
            .message(8, &opset("ai.onnx.ml", 3))
            .message(14, &entry("features", &columns))
            .message(14, &entry("target", description.target));
        let bytes = model.0.len();
        if bytes > i32::MAX as usize {
            return Err(ForestError::OnnxTooLarge { bytes });
        }
        Ok(model.0)
    }

    /// The operator. Its mean is that of the leaves' doubles, as [`predict_one`]'s is.
    ///
    /// [`predict_one`]: Self::predict_one
    fn node(&self, output: &str) -> Message {
        let nodes =
            || self.trees().iter().flat_map(|tree| (0..tree.nodes()).map(move |n| (tree, n)));
        let splits = || nodes().map(|(tree, node)| tree.split_at(node));
        let leaves = || nodes().filter(|(tree, node)| tree.split_at(*node).is_none());
        let tree_of = |leaves_only: bool| {
            let count = move |tree: &Tree<f64>| {
                if leaves_only {
                    (0..tree.nodes()).filter(|&node| tree.split_at(node).is_none()).count()
                } else {
                    tree.nodes()
                }
            };
            (0u64..).zip(self.trees()).flat_map(move |(at, tree)| repeat_n(at, count(tree)))
        };
        let number = |(_, node): (&Tree<f64>, usize)| node as u64;
        let child = |right: u64| {
            splits().map(move |split| split.map_or(0, |(_, _, left)| u64::from(left) + right))
        };
        Message::default()
            .text(1, INPUT)
            .text(2, output)
            .text(4, "TreeEnsembleRegressor")
            .text(7, "ai.onnx.ml")
            .message(5, &text("aggregate_function", "AVERAGE"))
            .message(5, &Message::default().text(1, "n_targets").int(3, 1).int(20, INT))
            .message(5, &ints("nodes_treeids", tree_of(false)))
            .message(5, &ints("nodes_nodeids", nodes().map(number)))
            .message(
                5,
                &texts(
                    "nodes_modes",
                    splits().map(|split| if split.is_some() { "BRANCH_LT" } else { "LEAF" }),
                ),
            )
            .message(
                5,
                &ints(
                    "nodes_featureids",
                    splits().map(|s| s.map_or(0, |(feature, _, _)| feature.into())),
                ),
            )
            .message(
                5,
                &doubles(
                    "nodes_values_as_tensor",
                    splits().map(|s| s.map_or(0.0, |(_, threshold, _)| threshold)),
                ),
            )
            .message(5, &ints("nodes_truenodeids", child(0)))
            .message(5, &ints("nodes_falsenodeids", child(1)))
            .message(5, &ints("target_treeids", tree_of(true)))
            .message(5, &ints("target_nodeids", leaves().map(number)))
            .message(5, &ints("target_ids", leaves().map(|_| 0)))
            .message(5, &doubles("target_weights_as_tensor", leaves().map(|(t, n)| t.value(n))))
    }
}

// Numbers of onnx.proto: the file's version, kinds of elements, kinds of attributes.
const IR_VERSION: u64 = 8;
const FLOAT: u64 = 1;
const DOUBLE: u64 = 11;
const INT: u64 = 2;
const TEXT: u64 = 3;
const TENSOR: u64 = 4;
const INTS: u64 = 7;
const TEXTS: u64 = 8;

fn ints(name: &str, values: impl Iterator<Item = u64>) -> Message {
    let mut packed = Message::default();
    values.for_each(|value| packed.varint(value));
    Message::default().text(1, name).message(8, &packed).int(20, INTS)
}

fn texts(name: &str, values: impl Iterator<Item = &'static str>) -> Message {
    let named = Message::default().text(1, name);
    values.fold(named, |message, value| message.text(9, value)).int(20, TEXTS)
}

fn text(name: &str, value: &str) -> Message {
    Message::default().text(1, name).text(4, value).int(20, TEXT)
}

fn doubles(name: &str, values: impl Iterator<Item = f64>) -> Message {
    let raw: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    let count = raw.len() / size_of::<f64>();
    let tensor = Message::default().int(1, count as u64).int(2, DOUBLE).bytes(9, &raw);
    Message::default().text(1, name).message(5, &tensor).int(20, TENSOR)
}

/// A protobuf message being written, by the field numbers of onnx.proto.
///
/// Two of protobuf's wire types are all that ONNX needs to be written; a crate for it would
/// bring its derive macros, and every message would still be spelled out here.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn int(mut self, field: u64, value: u64) -> Self {
        self.varint(field << 3);
        self.varint(value);
        self
    }

    fn bytes(mut self, field: u64, bytes: &[u8]) -> Self {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
        self
    }

    fn text(self, field: u64, text: &str) -> Self {
        self.bytes(field, text.as_bytes())
    }

    fn message(self, field: u64, message: &Message) -> Self {
        self.bytes(field, &message.0)
    }
}
