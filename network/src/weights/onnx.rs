//! ONNX out: Gemm, activation, Gemm, … in opset 13, written as protobuf by hand: a model of this kind needs some twenty
//! fields of it. Field numbers are those of `onnx.proto` (github.com/onnx/onnx).

use crate::activation::Activation;
use crate::mlp::Mlp;
use crate::real::Real;

/// Version of the format and of the operators.
const IR_VERSION: u64 = 7;
const OPSET: u64 = 13;

/// The network as an ONNX model with input `x` `[rows, inputs]` and output `y` `[rows, outputs]`, in the network's own
/// kind of number.
pub fn to_onnx<T: Real>(network: &Mlp<T>) -> Vec<u8> {
    let layers = network.to_layers();
    let mut graph = Message::default();
    let mut input = "x".to_owned();
    for l in 1..=layers.len() {
        let sum = if l == layers.len() { "y".to_owned() } else { format!("z{l}") };
        let weights = [format!("W{l}"), format!("b{l}")];
        let mut node = operator("Gemm", &[&input, &weights[0], &weights[1]], &sum);
        // y = x Wᵀ + b.
        let mut transposed = Message::default();
        transposed.text(1, "transB");
        transposed.number(3, 1);
        transposed.number(20, 2);
        node.message(5, &transposed);
        graph.message(1, &node);
        input = sum;
        if l < layers.len() {
            let name = match network.activation() {
                Activation::Tanh => "Tanh",
                Activation::Relu => "Relu",
                Activation::Sigmoid => "Sigmoid",
                Activation::Identity => "Identity",
            };
            let output = format!("a{l}");
            graph.message(1, &operator(name, &[&input], &output));
            input = output;
        }
    }
    graph.text(2, "network");
    for (l, layer) in layers.iter().enumerate() {
        let weight: Vec<T> = layer.weight.iter().flatten().copied().collect();
        graph.message(5, &tensor(&format!("W{}", l + 1), &[layer.bias.len(), layer.weight[0].len()], &weight));
        graph.message(5, &tensor(&format!("b{}", l + 1), &[layer.bias.len()], &layer.bias));
    }
    graph.message(11, &value::<T>("x", network.inputs()));
    graph.message(12, &value::<T>("y", network.outputs()));

    let mut model = Message::default();
    model.number(1, IR_VERSION);
    model.text(2, "gapscope");
    model.message(7, &graph);
    let mut opset = Message::default();
    opset.text(1, "");
    opset.number(2, OPSET);
    model.message(8, &opset);
    model.0
}

fn operator(kind: &str, inputs: &[&str], output: &str) -> Message {
    let mut node = Message::default();
    inputs.iter().for_each(|input| node.text(1, input));
    node.text(2, output);
    node.text(4, kind);
    node
}

fn tensor<T: Real>(name: &str, shape: &[usize], values: &[T]) -> Message {
    let mut bytes = Vec::new();
    values.iter().for_each(|v| v.write(&mut bytes));
    let mut tensor = Message::default();
    shape.iter().for_each(|d| tensor.number(1, *d as u64));
    tensor.number(2, T::ONNX);
    tensor.text(8, name);
    tensor.bytes(9, &bytes);
    tensor
}

/// Name and type of a graph's input or output: rows of `width` numbers.
fn value<T: Real>(name: &str, width: usize) -> Message {
    let [mut rows, mut columns, mut shape, mut of, mut kind, mut value] = [const { Message(Vec::new()) }; 6];
    rows.text(2, "rows");
    columns.number(1, width as u64);
    shape.message(1, &rows);
    shape.message(1, &columns);
    of.number(1, T::ONNX);
    of.message(2, &shape);
    kind.message(1, &of);
    value.text(1, name);
    value.message(2, &kind);
    value
}

/// A protobuf message under construction.
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
    fn number(&mut self, field: u64, value: u64) {
        self.varint(field << 3);
        self.varint(value);
    }
    fn bytes(&mut self, field: u64, bytes: &[u8]) {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
    }
    fn text(&mut self, field: u64, text: &str) {
        self.bytes(field, text.as_bytes());
    }
    fn message(&mut self, field: u64, message: &Message) {
        self.bytes(field, &message.0);
    }
}
