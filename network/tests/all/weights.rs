//! Weights in and out: round trips to the bit, PyTorch's own files, broken and mismatched files, random bytes.

use gapscope_network::{
    Activation, Init, Mlp, Pass, ShapeError, WeightsError, from_json, from_safetensors, to_json, to_onnx,
    to_safetensors,
};
use proptest::prelude::*;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, serialize};

const ACTIVATIONS: [Activation; 4] = [Activation::Tanh, Activation::Relu, Activation::Sigmoid, Activation::Identity];

#[test]
fn every_format_that_comes_back_comes_back_the_same_to_the_bit() {
    for (i, sizes) in [&[3, 2][..], &[21, 32, 16, 14], &[1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2]].iter().enumerate() {
        for activation in ACTIVATIONS {
            let wide = Mlp::<f64>::new(sizes, activation, Init::He, i as u64).unwrap();
            assert_eq!(from_safetensors::<f64>(&to_safetensors(&wide).unwrap()).unwrap(), wide);
            assert_eq!(from_json::<f64>(&to_json(&wide).unwrap()).unwrap(), wide);
            let narrow: Mlp<f32> = wide.cast();
            assert_eq!(from_safetensors::<f32>(&to_safetensors(&narrow).unwrap()).unwrap(), narrow);
            assert_eq!(from_json::<f32>(&to_json(&narrow).unwrap()).unwrap(), narrow);
            assert_eq!(from_safetensors::<f64>(&to_safetensors(&narrow).unwrap()).unwrap(), narrow.cast());
        }
    }
}

#[test]
fn a_network_trained_in_pytorch_gives_the_same_outputs() {
    for (bytes, cases) in [
        (&include_bytes!("../../golden/torch_tanh.safetensors")[..], include_str!("../../golden/torch_tanh.json")),
        (&include_bytes!("../../golden/torch_relu.safetensors")[..], include_str!("../../golden/torch_relu.json")),
        (
            &include_bytes!("../../golden/torch_sigmoid.safetensors")[..],
            include_str!("../../golden/torch_sigmoid.json"),
        ),
    ] {
        let cases: serde_json::Value = serde_json::from_str(cases).unwrap();
        let rows = |name: &str| -> Vec<Vec<f64>> { serde_json::from_value(cases[name].clone()).unwrap() };
        let (wide, narrow) = (from_safetensors::<f64>(bytes).unwrap(), from_safetensors::<f32>(bytes).unwrap());
        for (x, expected) in rows("x").iter().zip(rows("y")) {
            let mut y = vec![0.0; expected.len()];
            wide.forward(&mut Pass::new(), x, &mut y);
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs().max(1.0);
            assert!(y.iter().zip(&expected).all(|(a, b)| close(*a, *b)), "{y:?} {expected:?}");
            let (x, mut y): (Vec<f32>, _) = (x.iter().map(|v| *v as f32).collect(), vec![0.0f32; expected.len()]);
            narrow.forward(&mut Pass::new(), &x, &mut y);
            assert!(y.iter().zip(&expected).all(|(a, b)| close(f64::from(*a), *b)), "{y:?} {expected:?}");
        }
    }
}

#[test]
fn one_hidden_layer_is_given_as_four_matrices() {
    let network =
        from_json::<f64>(r#"{"W1": [[1, 2], [0, -1], [3, 1]], "b1": [0.5, 0, 0], "W2": [[1, 2, 3]], "b2": [-1]}"#);
    let (x, mut y) = ([0.3, -0.2], [0.0]);
    network.unwrap().forward(&mut Pass::new(), &x, &mut y);
    let expected = (0.3_f64 - 0.4 + 0.5).tanh() + 2.0 * 0.2_f64.tanh() + 3.0 * (0.9_f64 - 0.2).tanh() - 1.0;
    assert!((y[0] - expected).abs() < 1e-14);
}

/// A safetensors file of tensors of zeros.
fn file(tensors: &[(&str, Dtype, &[usize])]) -> Vec<u8> {
    let zeros = vec![0; 4096];
    let size = |dtype: Dtype| if dtype == Dtype::F64 || dtype == Dtype::I64 { 8 } else { 4 };
    let views = tensors.iter().map(|(name, dtype, shape)| {
        let length = shape.iter().product::<usize>() * size(*dtype);
        (*name, TensorView::new(*dtype, shape.to_vec(), &zeros[..length]).unwrap())
    });
    serialize(views, None).unwrap()
}

fn refused(bytes: &[u8]) -> String {
    from_safetensors::<f64>(bytes).unwrap_err().to_string()
}

#[test]
fn a_mismatch_is_refused_with_both_shapes() {
    let f = Dtype::F32;
    let text = refused(&file(&[("0.weight", f, &[5, 3]), ("0.bias", f, &[5]), ("2.weight", f, &[2, 4])]));
    assert!(text.contains("[2, 4]") && text.contains("[outputs, 5]"), "{text}");
    let text = refused(&file(&[("0.weight", f, &[5, 3]), ("0.bias", f, &[4])]));
    assert!(text.contains("[4]") && text.contains("[5, 3]"), "{text}");
    let text = refused(&file(&[("0.weight", f, &[5, 3, 1])]));
    assert!(text.contains("[5, 3, 1]") && text.contains("matrix"), "{text}");
    let text = refused(&file(&[("0.weight", Dtype::I64, &[5, 3])]));
    assert!(text.contains("I64") && text.contains("F32 or F64"), "{text}");
    let text = refused(&file(&[("0.bias", f, &[5])]));
    assert!(text.contains("0.weight") && text.contains("0.bias"), "{text}");
    let network = from_safetensors::<f64>(&file(&[("0.weight", f, &[5, 3]), ("2.weight", f, &[2, 5])])).unwrap();
    assert_eq!(network.sizes(), [3, 5, 2], "biases that are not there are zero");
    let text = network.expect(21, 14).unwrap_err().to_string();
    assert!(text.contains("3 numbers to 2") && text.contains("21 to 14"), "{text}");

    let bad = |text: &str| from_json::<f64>(text).unwrap_err();
    let error = bad(r#"{"W1": [[1, 2]], "b1": [0, 1]}"#);
    assert!(error.to_string().contains("2 numbers") && error.to_string().contains("1 × 2"), "{error}");
    let WeightsError::Shape(error) = bad(r#"{"W1": [[1, 2]], "b1": [0], "W2": [[1, 2]], "b2": [0]}"#) else {
        unreachable!()
    };
    assert_eq!(error, ShapeError::Row { layer: 2, row: 1, expected: 1, found: 2 });
    for (text, what) in [
        (r#"{"W1": [[1, 2], [1]], "b1": [0, 0]}"#, "row 2"),
        (r#"{"W1": [[1]], "W2": [[1]], "b2": [0]}"#, "b1"),
        (r#"{"W1": [["1"]], "b1": [0]}"#, "list of numbers"),
        (r#"{"W1": [], "b1": []}"#, "make no network"),
        (r#"{"W1": [[1]], "b1": [0], "W3": [[1]]}"#, "W3"),
        (r#"{"W1": [[1]], "b1": [0], "activation": "gelu"}"#, "gelu"),
        ("{", "EOF"),
    ] {
        assert!(bad(text).to_string().contains(what), "{text}: {}", bad(text));
    }
}

#[test]
fn a_truncated_or_corrupted_file_is_refused() {
    let network = Mlp::<f32>::new(&[3, 4, 2], Activation::Tanh, Init::Xavier, 1).unwrap();
    let bytes = to_safetensors(&network).unwrap();
    for length in 0..bytes.len() {
        assert!(from_safetensors::<f32>(&bytes[..length]).is_err(), "cut at {length}");
    }
    let mut bytes = bytes;
    let last = bytes.len() - 4;
    bytes[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(matches!(from_safetensors::<f32>(&bytes), Err(WeightsError::NotFinite { .. })));
}

proptest! {
    #[test]
    fn no_bytes_make_a_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = from_safetensors::<f64>(&bytes);
        let _ = from_json::<f64>(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn no_change_of_a_good_file_makes_a_reader_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let network = Mlp::<f64>::new(&[2, 3, 1], Activation::Relu, Init::Xavier, 1).unwrap();
        let (mut bytes, mut text) = (to_safetensors(&network).unwrap(), to_json(&network).unwrap().into_bytes());
        for (at, value) in changes {
            let (i, j) = (at.index(bytes.len()), at.index(text.len()));
            bytes[i] = value;
            text[j] = value;
        }
        let _ = from_safetensors::<f64>(&bytes);
        let _ = from_json::<f32>(&String::from_utf8_lossy(&text));
    }

    #[test]
    fn no_header_makes_the_reader_panic(
        name in "[a-zA-Z0-9._]{0,12}", shape in proptest::collection::vec(0u64..u64::MAX, 0..4), end in any::<u64>(),
    ) {
        let header = format!(r#"{{"{name}weight":{{"dtype":"F32","shape":{shape:?},"data_offsets":[0,{end}]}}}}"#);
        let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
        bytes.extend_from_slice(header.as_bytes());
        bytes.extend_from_slice(&[0; 16]);
        let _ = from_safetensors::<f64>(&bytes);
    }
}

#[test]
fn onnx_is_the_same_bytes_for_the_same_network() {
    // That onnxruntime reads it and agrees is checked by golden/check.py.
    let network = Mlp::<f32>::new(&[2, 3, 1], Activation::Tanh, Init::Xavier, 1).unwrap();
    let bytes = to_onnx(&network);
    assert_eq!(bytes, to_onnx(&network));
    for name in ["Gemm", "Tanh", "transB", "W2", "gapscope"] {
        assert!(bytes.windows(name.len()).any(|w| w == name.as_bytes()), "{name}");
    }
}
