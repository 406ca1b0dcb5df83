#!/usr/bin/env python3
"""Weights written by gapscope, in PyTorch and onnxruntime: the same outputs to 1e-6.

    python check.py           (PyPI: torch, safetensors, onnxruntime, onnx, numpy)

Runs the example `write_weights`, which writes networks as safetensors, JSON and ONNX with some inputs and outputs.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import onnx
import onnxruntime
import torch
from safetensors import safe_open
from safetensors.torch import load_file

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MODULE = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "sigmoid": torch.nn.Sigmoid, "identity": torch.nn.Identity}
NUMPY = {"tanh": np.tanh, "relu": lambda z: np.maximum(z, 0), "sigmoid": lambda z: 1 / (1 + np.exp(-z)), "identity": lambda z: z}

with tempfile.TemporaryDirectory() as folder:
    command = ["cargo", "run", "-q", "-p", "gapscope-network", "--example", "write_weights", "--", folder]
    subprocess.run(command, check=True, cwd=ROOT)
    worst = 0.0
    for case in sorted(pathlib.Path(folder).glob("*.case.json")):
        stem = str(case).removesuffix(".case.json")
        data = json.loads(case.read_text())
        tensors = load_file(stem + ".safetensors")
        kind = tensors["0.weight"].dtype
        with safe_open(stem + ".safetensors", "pt") as file:
            activation = file.metadata()["activation"]
        x, y = np.array(data["x"]), np.array(data["y"])
        modules = []
        for layer in range(len(tensors) // 2):
            outputs, inputs = tensors[f"{2 * layer}.weight"].shape
            modules += [torch.nn.Linear(inputs, outputs, dtype=kind), MODULE[activation]()]
        network = torch.nn.Sequential(*modules[:-1])
        network.load_state_dict(tensors)
        results = {"PyTorch": network(torch.from_numpy(x).to(kind)).detach().double().numpy()}

        onnx.checker.check_model(onnx.load(stem + ".onnx"), full_check=True)
        session = onnxruntime.InferenceSession(stem + ".onnx", providers=["CPUExecutionProvider"])
        single = {torch.float32: np.float32, torch.float64: np.float64}[kind]
        results["onnxruntime"] = session.run(["y"], {"x": x.astype(single)})[0].astype(float)

        weights = json.loads(pathlib.Path(stem + ".json").read_text())
        z, layers = x, len(tensors) // 2
        for layer in range(1, layers + 1):
            z = z @ np.array(weights[f"W{layer}"]).T + np.array(weights[f"b{layer}"])
            z = NUMPY[weights["activation"]](z) if layer < layers else z
        results["JSON in NumPy"] = z
        for name, result in results.items():
            error = float(np.abs(result - y).max() / max(1.0, np.abs(y).max()))
            worst = max(worst, error)
            print(f"{pathlib.Path(stem).name:24} {name:14} {error:.1e}")
    if not 0 < worst < 1e-6:
        sys.exit(f"largest difference {worst:.1e}, 1e-6 allowed")
    print(f"largest difference {worst:.1e}")
