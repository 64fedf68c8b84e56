"""A float network for the link state, made and read with NumPy the way a PyTorch user would.

    float_model.py write FILE     writes a geometric network with random weights, and prints rows of inputs with its logits
    float_model.py read FILE      reads a network and prints the logits of the rows on standard input

One JSON object on standard output: {"rows": [[...]], "logits": [[...]]}.
"""

import json
import sys

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save_file


def forward(tensors, offset, scale, rows):
    x = np.clip((rows - offset) * scale, -1, 1)
    last = len(tensors) // 2
    for layer in range(1, last + 1):
        x = x @ tensors[f"f{layer}.weight"].T + tensors[f"f{layer}.bias"]
        if layer < last:
            x = np.maximum(x, 0)
    return x


def write(path):
    random = np.random.default_rng(7)
    tensors, widths = {}, [5, 16, 12, 3]
    for layer, (n, m) in enumerate(zip(widths, widths[1:]), start=1):
        tensors[f"f{layer}.weight"] = random.normal(0, (2 / n) ** 0.5, (m, n)).astype(np.float32)
        tensors[f"f{layer}.bias"] = random.normal(0, 0.1, m).astype(np.float32)
    offset, scale = np.arange(5, dtype=np.float32), np.full(5, 0.25, np.float32)
    numbers = lambda values: ",".join(repr(float(v)) for v in values)
    metadata = {
        "kind": "geometric",
        "inputs": "a,b,c,d,e",
        "input_offset": numbers(offset),
        "input_scale": numbers(scale),
        "temperature": "1.5",
    }
    save_file(tensors, path, metadata=metadata)
    rows = (offset + random.uniform(-5, 5, (40, 5))).astype(np.float32)
    return rows, forward(tensors, offset, scale, rows)


def read(path):
    with safe_open(path, framework="np") as file:
        metadata = file.metadata()
        tensors = {name: file.get_tensor(name) for name in file.keys()}
    numbers = lambda key: np.array([float(v) for v in metadata[key].split(",")], np.float32)
    rows = np.array(json.load(sys.stdin), np.float32)
    return rows, forward(tensors, numbers("input_offset"), numbers("input_scale"), rows)


rows, logits = {"write": write, "read": read}[sys.argv[1]](sys.argv[2])
print(json.dumps({"rows": rows.tolist(), "logits": logits.tolist()}))
