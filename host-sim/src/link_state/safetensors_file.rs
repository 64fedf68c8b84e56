//! Float models as safetensors files, so that a model trained elsewhere can be quantised and flown.
//!
//! Tensors `f1.weight` [out, in], `f1.bias` [out], `f2.weight`, ... in f32. Metadata, all strings: `kind` ("paper" or
//! "geometric"), `k` (paper only), `inputs` (names, comma-separated), `input_offset` and `input_scale` (numbers,
//! comma-separated; normalised = (x - offset) * scale), `temperature` (1 when absent).
//!
//! Reading is the library's, which checks the file's structure. Writing is ours: the library keeps metadata in a hash
//! map, whose order changes from run to run, and the same model must give the same bytes.

use std::collections::BTreeMap;
use std::path::Path;

use safetensors::{Dtype, SafeTensors};
use serde::Serialize;

use super::float_model::{FloatModel, Kind, Layer};
use crate::input::{InputError, limits::FLOAT_MODEL, read_bytes};

/// Keys that the metadata may hold; PyTorch writes `format`.
const KEYS: [&str; 7] = [
    "kind",
    "k",
    "inputs",
    "input_offset",
    "input_scale",
    "temperature",
    "format",
];

impl FloatModel {
    /// Reads a model from a safetensors file.
    ///
    /// # Errors
    /// [`InputError`] naming the file and the tensor or metadata key, and what was expected.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        Self::from_bytes(&read_bytes(file, &FLOAT_MODEL)?)
            .map_err(|message| InputError::in_file(file, message))
    }

    /// Reads a model from the bytes of a safetensors file.
    ///
    /// # Errors
    /// The tensor or metadata key that is wrong and what was expected, in words.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        decode(bytes)
    }

    /// The bytes of a safetensors file. The same model gives the same bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        encode(self)
    }
}

fn decode(bytes: &[u8]) -> Result<FloatModel, String> {
    let not_safetensors = |e| format!("is no safetensors file: {e}");
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(not_safetensors)?;
    let file = SafeTensors::deserialize(bytes).map_err(not_safetensors)?;
    let find = |key: &str| {
        header
            .metadata()
            .as_ref()
            .and_then(|all| all.get(key))
            .map(String::as_str)
    };
    let known = |key: &&String| KEYS.contains(&key.as_str());
    if let Some(key) = header
        .metadata()
        .iter()
        .flat_map(|all| all.keys())
        .filter(|key| !known(key))
        .min()
    {
        return Err(format!(
            "metadata: unknown key {key}, expected one of {}",
            KEYS.join(", ")
        ));
    }
    let text = |key: &str| find(key).ok_or_else(|| format!("metadata: expected the key {key}"));
    let kind = match text("kind")? {
        "paper" => Kind::Paper {
            k: text("k")?
                .trim()
                .parse()
                .map_err(|_| "metadata k: expected a whole number".to_owned())?,
        },
        "geometric" => Kind::Geometric,
        other => return Err(format!("metadata kind: expected paper or geometric, not {other}")),
    };
    let inputs = text("inputs")?
        .split(',')
        .map(|name| name.trim().to_owned())
        .collect();
    let numbers = |key: &str| -> Result<Vec<f32>, String> {
        let number = |word: &str| word.trim().parse().ok().filter(|x: &f32| x.is_finite());
        let all = text(key)?.split(',').map(number).collect::<Option<Vec<f32>>>();
        all.ok_or_else(|| format!("metadata {key}: expected numbers separated by commas"))
    };
    let temperature = match find("temperature")
        .map(|_| numbers("temperature"))
        .transpose()?
        .as_deref()
    {
        None => 1.0,
        Some(&[temperature]) => temperature,
        Some(_) => return Err("metadata temperature: expected one number".into()),
    };
    let mut layers = Vec::new();
    while file.tensor(&format!("f{}.weight", layers.len() + 1)).is_ok() {
        layers.push(layer(&file, layers.len() + 1)?);
    }
    if layers.is_empty() {
        return Err("expected the tensors f1.weight, f1.bias, f2.weight, ...".into());
    }
    if file.len() != 2 * layers.len() {
        return Err(format!(
            "expected f1 to f{} with weight and bias and nothing else, found {} tensors",
            layers.len(),
            file.len()
        ));
    }
    FloatModel::new(
        kind,
        inputs,
        numbers("input_offset")?,
        numbers("input_scale")?,
        temperature,
        layers,
    )
}

fn layer(file: &SafeTensors<'_>, number: usize) -> Result<Layer, String> {
    let read = |name: String, dimensions: usize| {
        let tensor = file
            .tensor(&name)
            .map_err(|_| format!("expected the tensor {name}"))?;
        if tensor.dtype() != Dtype::F32 || tensor.shape().len() != dimensions {
            return Err(format!(
                "{name}: expected f32 with {dimensions} dimensions, not {:?} {:?}",
                tensor.dtype(),
                tensor.shape()
            ));
        }
        let words = tensor.data().chunks_exact(4);
        let values: Vec<f32> = words
            .map(|w| f32::from_le_bytes([w[0], w[1], w[2], w[3]]))
            .collect();
        Ok((tensor.shape().to_vec(), values))
    };
    let (shape, weight) = read(format!("f{number}.weight"), 2)?;
    let (outputs, bias) = read(format!("f{number}.bias"), 1)?;
    if shape[0] != outputs[0] {
        return Err(format!(
            "f{number}.bias: expected {} values, one for each row of the weight, not {}",
            shape[0], outputs[0]
        ));
    }
    Ok(Layer {
        inputs: shape[1],
        weight,
        bias,
    })
}

#[derive(Serialize)]
struct TensorInfo {
    dtype: &'static str,
    shape: Vec<usize>,
    data_offsets: [usize; 2],
}

#[derive(Serialize)]
struct Header {
    #[serde(rename = "__metadata__")]
    metadata: BTreeMap<&'static str, String>,
    #[serde(flatten)]
    tensors: BTreeMap<String, TensorInfo>,
}

fn encode(model: &FloatModel) -> Vec<u8> {
    let numbers = |values: &[f32]| values.iter().map(f32::to_string).collect::<Vec<_>>().join(",");
    let mut metadata = BTreeMap::from([
        ("inputs", model.inputs().join(",")),
        ("input_offset", numbers(model.input_offset())),
        ("input_scale", numbers(model.input_scale())),
        ("temperature", model.temperature().to_string()),
    ]);
    match model.kind() {
        Kind::Paper { k } => {
            metadata.insert("kind", "paper".into());
            metadata.insert("k", k.to_string());
        }
        Kind::Geometric => {
            metadata.insert("kind", "geometric".into());
        }
    }
    let mut data: Vec<u8> = Vec::new();
    let mut tensors = BTreeMap::new();
    for (index, layer) in model.layers().iter().enumerate() {
        let shapes = [vec![layer.outputs(), layer.inputs], vec![layer.outputs()]];
        for ((part, values), shape) in [("weight", &layer.weight), ("bias", &layer.bias)]
            .into_iter()
            .zip(shapes)
        {
            let start = data.len();
            data.extend(values.iter().flat_map(|x| x.to_le_bytes()));
            let info = TensorInfo {
                dtype: "F32",
                shape,
                data_offsets: [start, data.len()],
            };
            tensors.insert(format!("f{}.{part}", index + 1), info);
        }
    }
    // Neither strings nor whole numbers can fail to serialise.
    let mut header = serde_json::to_vec(&Header { metadata, tensors }).unwrap_or_default();
    // The data start at a multiple of 8, as the format advises.
    header.resize(header.len().next_multiple_of(8), b' ');
    let mut bytes = (header.len() as u64).to_le_bytes().to_vec();
    bytes.append(&mut header);
    bytes.append(&mut data);
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::float_model::tests::{geometric, paper};
    use super::*;

    #[test]
    fn a_model_survives_the_file() {
        for model in [geometric(), paper(1), paper(15)] {
            let bytes = encode(&model);
            assert_eq!(decode(&bytes).expect("sound"), model);
            assert_eq!(encode(&model), bytes);
        }
    }

    #[test]
    fn what_is_wrong_is_named() {
        let bytes = encode(&paper(3));
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let header = text.find('}').expect("a header");
        let broken = |from: &str, to: &str| {
            assert_eq!(from.len(), to.len(), "offsets stay");
            assert!(
                text[..header + 4000.min(text.len() - header)].contains(from),
                "{from}"
            );
            let mut changed = bytes.clone();
            let at = bytes
                .windows(from.len())
                .position(|w| w == from.as_bytes())
                .expect("there");
            changed[at..at + from.len()].copy_from_slice(to.as_bytes());
            decode(&changed).expect_err(to)
        };
        assert!(broken("\"paper\"", "\"peper\"").contains("expected paper or geometric"));
        assert!(broken("\"k\":\"3\"", "\"k\":\"4\"").contains("3 k inputs"));
        assert!(broken("\"k\":\"3\"", "\"k\":\"x\"").contains("metadata k"));
        assert!(
            broken("input_offset", "input_offsat").contains("unknown key input_offsat, expected one of kind")
        );
        assert!(broken("\"kind\":", "\"\u{e9}nd\":").contains("unknown key \u{e9}nd"));
        assert!(broken("f1.weight", "g1.weight").contains("f1.weight"));
        assert!(broken("f3.weight", "f9.weight").contains("nothing else"));
        assert!(broken("\"shape\":[4,3]", "\"shape\":[3,4]").contains("f1.bias"));
        assert!(
            decode(&bytes[..bytes.len() - 1])
                .expect_err("cut")
                .contains("safetensors")
        );
        assert!(decode(b"").is_err());
    }
}
