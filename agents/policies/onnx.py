"""A network as an ONNX file: for runtimes that know neither Python nor this package."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tca_mj.agents.policies.network import Network

OPSET, IR_VERSION = 17, 8  # of 2022: what runtimes since then read

# An activation as nodes: operator, attributes, and whether it is a factor of its input.
_ACTIVATIONS: dict[str, tuple[str, dict[str, Any], bool]] = {
    "tanh": ("Tanh", {}, False),
    "relu": ("Relu", {}, False),
    "elu": ("Elu", {"alpha": 1.0}, False),
    "leaky_relu": ("LeakyRelu", {"alpha": 0.01}, False),
    "silu": ("Sigmoid", {}, True),
}


def onnx_model(network: Network, about: Mapping[str, str]) -> bytes:
    """A network as an ONNX model, with all that it does.

    Its input is ``observation``, float32 of shape (batch, inputs), in the units of the task, its
    output ``action``, float32 of shape (batch, outputs). Normalisation is done in float64, as the
    network does it.

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
    value = "observation"

    def then(operator: str, *arrays: Any, name: str = "", **attributes: Any) -> None:
        """The next operator on the value, with arrays as its other inputs."""
        nonlocal value
        inputs = [value]
        for array in arrays:
            inputs.append(f"constant_{len(constants)}")
            constants.append(numpy_helper.from_array(np.asarray(array), inputs[-1]))
        value = name or f"value_{len(nodes)}"
        nodes.append(helper.make_node(operator, inputs, [value], **attributes))

    single, double = np.float32, np.float64
    if network.units is not None:
        then("Sub", network.units[0].astype(single))
        then("Div", network.units[1].astype(single))
    deviation = np.sqrt(network.var + network.epsilon).astype(double)
    if network.mean.any() or (deviation != 1.0).any() or network.clip is not None:
        then("Cast", to=TensorProto.DOUBLE)
        then("Sub", network.mean.astype(double))
        then("Div", deviation)
        if network.clip is not None:
            then("Clip", double(-network.clip), double(network.clip))
        then("Cast", to=TensorProto.FLOAT)
    operator, attributes, factor = _ACTIVATIONS[network.activation]
    for i, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        if i:
            before = value
            then(operator, **attributes)
            if factor:
                nodes.append(helper.make_node("Mul", [before, value], [f"product_{i}"]))
                value = f"product_{i}"
        then("Gemm", weight, bias, transB=1)
    if network.limit is not None:
        then("Clip", single(-network.limit), single(network.limit))
    row = np.ones(network.outputs, single)
    low, high = np.array([-row, row] if network.bounds is None else network.bounds, single)
    if network.squash == "clip":
        then("Max", low)
        then("Min", high)
    else:
        then("Tanh")
        if network.bounds is not None:
            then("Add", single(1.0))
            then("Mul", single(0.5))
            then("Mul", high - low)
            then("Add", low)
    then("Identity", name="action")
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
