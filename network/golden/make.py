#!/usr/bin/env python3
"""Networks trained in PyTorch, as files, with their outputs: `torch_*.safetensors` and `torch_*.json` beside this script.

    python make.py            (PyPI: torch, safetensors, numpy)

`tests/all/weights.rs` loads the files and holds the outputs to 1e-6.
"""

import json
import pathlib

import numpy as np
import torch
from safetensors.torch import save_file

HERE = pathlib.Path(__file__).resolve().parent
ACTIVATION = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "sigmoid": torch.nn.Sigmoid}

for name, sizes, kind in [("tanh", [3, 16, 12, 4], torch.float32), ("relu", [2, 9, 3], torch.float64), ("sigmoid", [5, 7, 1], torch.float32)]:
    torch.manual_seed(len(sizes))
    modules = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        modules += [torch.nn.Linear(inputs, outputs, dtype=kind), ACTIVATION[name]()]
    network = torch.nn.Sequential(*modules[:-1])
    x = torch.from_numpy(np.random.default_rng(0).uniform(-2, 2, (20, sizes[0]))).to(kind)
    # A few steps, so that no bias is at its start.
    adam = torch.optim.Adam(network.parameters(), lr=1e-2)
    for _ in range(200):
        adam.zero_grad()
        ((network(x) - torch.sin(x.sum(1, keepdim=True))) ** 2).mean().backward()
        adam.step()
    save_file(network.state_dict(), HERE / f"torch_{name}.safetensors", metadata={"activation": name})
    y = network(x).detach()
    (HERE / f"torch_{name}.json").write_text(json.dumps({"x": x.double().tolist(), "y": y.double().tolist()}))
