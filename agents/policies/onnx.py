"""A network as an ONNX file: for runtimes that know neither Python nor this package."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from tca_mj.agents.policies.network import Network

OPSET, IR_VERSION = 17, 8  # of 2022: what runtimes since then read

Node: TypeAlias = Callable[..., str]
"""Adds an operator on values (by name) and constants, and returns the name of what it gives."""

# Of operators that runtimes have in float64.
_ACTIVATIONS: dict[str, Callable[[Node, str], str]] = {
    "tanh": lambda node, x: node("Tanh", x),
    "relu": lambda node, x: node("Max", x, 0.0),
    "elu": lambda node, x: node(
        "Add", node("Max", x, 0.0), node("Sub", node("Exp", node("Min", x, 0.0)), 1.0)
    ),
    "leaky_relu": lambda node, x: node("Max", x, node("Mul", x, 0.01)),
    "silu": lambda node, x: node("Mul", x, node("Sigmoid", x)),
}


def onnx_model(network: Network, about: Mapping[str, str]) -> bytes:
    """A network as an ONNX model, with all that it does.

    Its input is ``observation``, float32 of shape (batch, inputs), in the units of the task, its
    output ``action``, float32 of shape (batch, outputs). It computes in float64 what the network
    does, so that both are the same to the last digit or two of float32.

    Args:
        network: The network.
        about: What is noted in the model's metadata.

    Returns:
        The content of the file.

    Raises:
        ImportError: If ``onnx`` is not installed.
    """
    from onnx import TensorProto, checker, helper, numpy_helper

    nodes: list[Any] = []
    constants: list[Any] = []

    def node(operator: str, *inputs: Any, name: str = "", **attributes: Any) -> str:
        names = []
        for each in inputs:
            if not isinstance(each, str):
                constants.append(numpy_helper.from_array(np.asarray(each), f"c{len(constants)}"))
            names.append(each if isinstance(each, str) else constants[-1].name)
        name = name or f"x{len(nodes)}"
        nodes.append(helper.make_node(operator, names, [name], **attributes))
        return name

    def double(array: Any) -> Any:
        return np.asarray(array, np.float64)

    x = "observation"
    if network.units is not None:
        centre, scale = network.units.astype(np.float32)
        x = node("Div", node("Sub", x, centre), scale)
    x = node("Cast", x, to=TensorProto.DOUBLE)
    x = node("Sub", x, double(network.mean))
    x = node("Div", x, np.sqrt(double(network.var) + network.epsilon))
    if network.clip is not None:
        x = node("Clip", x, double(-network.clip), double(network.clip))
    x = node("Cast", node("Cast", x, to=TensorProto.FLOAT), to=TensorProto.DOUBLE)
    for i, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        x = _ACTIVATIONS[network.activation](node, x) if i else x
        x = node("Gemm", x, double(weight), double(bias), transB=1)
    if network.limit is not None:
        x = node("Clip", x, double(-network.limit), double(network.limit))
    row = np.ones(network.outputs)
    low, high = double([-row, row] if network.bounds is None else network.bounds)
    if network.squash == "tanh":
        x = node("Add", node("Mul", node("Add", node("Tanh", x), 1.0), 0.5 * (high - low)), low)
    node("Cast", node("Min", node("Max", x, low), high), name="action", to=TensorProto.FLOAT)
    ends = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width])
        for name, width in (("observation", network.inputs), ("action", network.outputs))
    ]
    graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], initializer=constants)
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION,
        producer_name="tca-mj",
    )  # fmt: skip
    helper.set_model_props(model, dict(about))
    checker.check_model(model, full_check=True)
    content: bytes = model.SerializeToString(deterministic=True)
    return content
