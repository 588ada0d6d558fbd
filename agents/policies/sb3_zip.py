"""Models that plain Stable-Baselines3 or sb3-contrib has saved, brought in without running them.

``model.save("x.zip")`` writes a zip. Of its ``data`` the plain JSON is read and never what is
serialised there, of its ``policy.pth`` the numbers (see ``archives``). Layers are told from names
and shapes of tensors, and what cannot be known so is refused.

A zip says neither what the task was made with nor how its observations were treated on their way:
whoever brings it in says so.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.policies.archives import LONGEST, Archive, content_of, tensors, why
from tca_mj.agents.policies.files import Origin
from tca_mj.agents.policies.network import Floats, Network
from tca_mj.agents.policies.preprocessing import Statistics
from tca_mj.checks import door, require_one_of, within

Doubles: TypeAlias = NDArray[np.float64]

# By the module of the policy's class: where the tensors of its actor are, hidden layers first, its
# activation if none is named, and whether tanh squashes its output.
_SAC: tuple[tuple[str, ...], str, bool] = (("actor.latent_pi", "actor.mu"), "ReLU", True)
_ACTORS: dict[str, tuple[tuple[str, ...], str, bool]] = {
    "stable_baselines3.common.policies":
        (("mlp_extractor.policy_net", "action_net"), "Tanh", False),
    "stable_baselines3.sac.policies": _SAC,
    "stable_baselines3.td3.policies": (("actor.mu",), "ReLU", True),
    "sb3_contrib.tqc.policies": _SAC,
    "sb3_contrib.crossq.policies": _SAC,
    "sb3_contrib.ars.policies": (("action_net",), "ReLU", True),
}  # fmt: skip
# Tensors that have no part in an action without noise.
_OTHERS = (
    "mlp_extractor.value_net.", "value_net.", "critic.", "critic_target.", "actor_target.",
    "log_std", "actor.log_std",
)  # fmt: skip
_ACTIVATIONS = {
    "Tanh": "tanh", "ReLU": "relu", "ELU": "elu", "LeakyReLU": "leaky_relu", "SiLU": "silu",
}  # fmt: skip
_TORCH = "<class 'torch.nn.modules.activation.{}'>"
_FLATTEN = "<class 'stable_baselines3.common.torch_layers.FlattenExtractor'>"
_BATCH_NORM = {"scale", "bias", "ra_mean", "ra_var", "steps"}
_CLIP_MEAN, _BATCH_NORM_EPS = 2.0, 0.001  # what Stable-Baselines3 takes if nothing is said
_MEMBERS = ("data", "_stable_baselines3_version", "system_info.txt")  # besides the .pth files


@dataclass(frozen=True, kw_only=True, slots=True)
class Model:
    """What the zip of a model says.

    Attributes:
        network: Its actor without noise, on observations as the model saw them.
        seen: Least and most of each number of them, shape (2, n); None if that cannot be read.
        origin: Where it comes from.
    """

    network: Network
    seen: Doubles | None
    origin: Origin

    @classmethod
    @door
    def read(cls, path: str | Path) -> Model:
        """Reads a zip.

        Raises:
            FileNotFoundError: If there is none.
            ValueError: If it is no zip of a model, or the model's actor is no plain network from
                a row of numbers to a row of numbers.
        """
        try:
            with np.errstate(all="ignore"):  # what overflows is refused as not finite
                return _model(content_of(path), Path(path).name)
        except FileNotFoundError:
            raise
        except Exception as error:
            raise ValueError(
                f"{path} is no model of Stable-Baselines3 that can be read: {why(error)}"
            ) from error

    @classmethod
    @door
    def parsed(cls, content: bytes, name: str) -> Model:
        """What a zip says, from its bytes.

        Args:
            content: The bytes.
            name: What to note as its name.

        Raises:
            ValueError: As ``read``.
        """
        try:
            with np.errstate(all="ignore"):
                return _model(content, name)
        except Exception as error:
            raise ValueError(
                f"content must be a model of Stable-Baselines3, got {name:.80}: {why(error)}"
            ) from error

    @door
    def preprocessed(self, units: Floats | None, statistics: Statistics | None) -> Network:
        """The network on observations in the units of the task.

        Args:
            units: As in ``Network``.
            statistics: By what the model's observations were then normalised; None for nothing.

        Raises:
            ValueError: If there are not as many of them as the network has inputs.
        """
        network = self.network
        if statistics is None:
            return replace(network, units=units)
        if len(statistics.mean) != network.inputs:
            raise ValueError(
                f"statistics must be of {network.inputs} numbers, got {len(statistics.mean)}"
            )
        # What the network has of its own, a batch normalisation, moves into its first layer.
        weight, bias = _folded(network.mean, network.var, network.weights[0], network.biases[0])
        return replace(
            network, units=units, weights=(weight, *network.weights[1:]),
            biases=(bias, *network.biases[1:]), mean=np.array(statistics.mean),
            var=np.array(statistics.var), clip=statistics.clip, epsilon=statistics.epsilon,
        )  # fmt: skip


def _model(content: bytes, name: str) -> Model:
    archive = Archive(content)
    for member in archive.names:
        if member not in _MEMBERS and not member.endswith(".pth"):
            raise ValueError(f"Stable-Baselines3 writes no member {member!r:.80}")
    data: Any = json.loads(archive.read("data", LONGEST))
    module = data["policy_class"]["__module__"]
    if module not in _ACTORS:
        raise ValueError(
            f"policy's class must be of one of {sorted(_ACTORS)}, got {module!r:.80}: those of"
            " one's own and those that remember cannot be known from a zip"
        )
    prefixes, activation, squashed = _ACTORS[module]
    settings = data["policy_kwargs"]
    if settings.get("features_extractor_class", _FLATTEN) != _FLATTEN:
        raise ValueError("policy must have no extractor of features of its own")
    seen, acts = (_bounds(data[space], space) for space in ("observation_space", "action_space"))
    if acts is None:
        raise ValueError("action_space must have bounds that can be read")
    names, found = tensors(archive.read("policy.pth"), tuple(f"{each}." for each in prefixes))
    for tensor in names:
        if tensor not in found and not tensor.startswith(_OTHERS):
            raise ValueError(
                f"policy must be a plain network, got the tensor {tensor!r:.80}: pictures,"
                " dictionaries, memory and shared layers are not read"
            )
    layers = list(_layers(found, prefixes, _number(settings, "batch_norm_eps", _BATCH_NORM_EPS)))
    if not layers:
        raise ValueError(f"policy must have layers at {' and '.join(prefixes)}, got none")
    (mean, var, *first), *others = layers
    linear = [first, *(_folded(*layer) for layer in others)]
    if module.endswith("ars.policies") and not others and "net_arch" not in settings:
        squashed = False  # ARSLinearPolicy
    squashed = settings.get("squash_output", squashed)
    require_one_of("squash_output", squashed, (True, False))
    kept = f"{prefixes[-1]}.0.weight" in found and len(prefixes) == 2  # of gSDE
    limit = _number(settings, "clip_mean", _CLIP_MEAN) if kept else None
    return Model(
        network=Network(
            weights=tuple(weight for weight, _ in linear),
            biases=tuple(bias for _, bias in linear),
            mean=mean, var=var, clip=None, epsilon=0.0, limit=limit,
            activation=_activation(settings.get("activation_fn", _TORCH.format(activation))),
            squash="tanh" if squashed else "clip",
            bounds=None if (acts == [[-1.0], [1.0]]).all() else acts.astype(np.float32),
        ),
        seen=seen,
        origin=Origin(
            algorithm=module.removesuffix(".policies"), source=name,
            seed=None if data["seed"] is None else int(data["seed"]),
            steps=int(data["num_timesteps"]),
            versions={"stable_baselines3": _version(archive)},
        ),
    )  # fmt: skip


def _layers(
    found: Mapping[str, Floats], prefixes: tuple[str, ...], epsilon: float
) -> Iterator[tuple[Doubles, Doubles, Floats, Floats]]:
    """For each linear layer what is taken off before it and the square of what is divided by,
    of a batch normalisation or 0 and 1, then weights and biases."""
    modules: dict[tuple[int, int], dict[str, Floats]] = {}
    for name, value in found.items():
        part = next(i for i, prefix in enumerate(prefixes) if name.startswith(f"{prefix}."))
        said = re.fullmatch(r"\.(?:(\d{1,4})\.)?(\w+)", name.removeprefix(prefixes[part]))
        if said is None:
            raise ValueError(f"policy must be a plain network, got the tensor {name!r:.80}")
        modules.setdefault((part, int(said[1] or 0)), {})[said[2]] = value
    norm: dict[str, Floats] = {}
    here, following = 0, 0
    for (part, place), values in sorted(modules.items()):
        here, following = part, following if part == here else 0
        weight = values.get("weight", np.zeros(0))
        if place == following and values.keys() == _BATCH_NORM and not norm:
            norm, following = values, place + 1
        elif place == following and values.keys() <= {"weight", "bias"} and weight.ndim == 2:
            inputs, bias = weight.shape[1], values.get("bias", np.zeros(weight.shape[0]))
            mean, var = norm.get("ra_mean", np.zeros(inputs)), np.ones(inputs)
            if norm:
                var = within("ra_var", norm["ra_var"] + epsilon, above=0.0, shape=(inputs,))
                bias = bias + weight.astype(np.float64) @ norm["bias"]
                weight = weight.astype(np.float64) * norm["scale"]
            yield mean.astype(np.float64), var, _single(weight), _single(bias)
            norm, following = {}, place + 2  # an activation stands between
        else:
            raise ValueError(
                f"policy must have linear layers with an activation between them, got"
                f" {sorted(values)} at {prefixes[part]}.{place}"
            )
    if norm:
        raise ValueError("policy must end in a linear layer")


def _folded(mean: Doubles, var: Doubles, weight: Floats, bias: Floats) -> tuple[Floats, Floats]:
    """A layer that does by itself what was taken off and divided by before it."""
    wide = weight / np.sqrt(var)
    return _single(wide), _single(bias - wide @ mean)


def _single(values: NDArray[Any]) -> Floats:
    return values.astype(np.float32)


def _bounds(space: Any, name: str) -> Doubles | None:
    """Least and most of each number of a space; None if they are not printed in full."""
    if not space[":type:"].endswith(".spaces.box.Box'>") or len(space["_shape"]) != 1:
        raise ValueError(f"{name} must be a Box of one row, got {space[':type:']!r:.80}")
    try:
        rows = [[float(x) for x in space[end].strip("[]").split()] for end in ("low", "high")]
        return np.array(rows).reshape(2, *space["_shape"])
    except ValueError:
        return None


def _number(settings: Mapping[str, Any], name: str, usual: float) -> float:
    value = settings.get(name, usual)
    if not isinstance(value, int | float):
        raise ValueError(f"{name} must be a number, got {value!r:.80}")
    return float(value)


def _activation(said: str) -> str:
    for name, ours in _ACTIVATIONS.items():
        if said == _TORCH.format(name):
            return ours
    raise ValueError(f"activation_fn must be one of {list(_ACTIVATIONS)}, got {said!r:.80}")


def _version(archive: Archive) -> str:
    name = "_stable_baselines3_version"
    return archive.read(name, 100).decode().strip() if name in archive.names else "unknown"
