"""Policies as files: what was searched or learned acts without the code that made it.

A file holds a header in JSON (format, kind, task, origin, and what the kind needs) and, where there
is a network, its arrays. Kinds:

* ``gait``: a ``.json`` file that is the header; a gait and its steering.
* ``network``: a ``.npz`` file; ``header`` is the JSON text, ``mean`` and ``var`` normalise the
  observation, ``weight0``, ``bias0``, ``weight1``, ... are the layers; ``units`` and ``bounds``
  are there if the network has them (see ``Network``).
* ``residual``: a ``.npz`` file with both; the network sees the observation and the gait's phase,
  and corrects the temperatures of the gait within a bound.

No file is unpickled, and none needs torch or Stable-Baselines3.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from tca_mj.agents.output import write_json
from tca_mj.agents.policies.archives import LONGEST, arrays, content_of, why
from tca_mj.agents.policies.contracts import digest
from tca_mj.agents.policies.gait import GaitPolicy
from tca_mj.agents.policies.network import Network
from tca_mj.agents.policies.onnx import onnx_model
from tca_mj.checks import Checked, NotNegative, door, row, shown
from tca_mj.control import Gait
from tca_mj.files import write_whole

FORMAT = 1
KINDS = {"gait": ".json", "network": ".npz", "residual": ".npz"}


def _steering(name: str, value: Any) -> tuple[float, ...]:
    empty = isinstance(value, tuple | list) and not value
    return () if empty else row(name, value)


class Policy(Protocol):
    """Who acts: an observation in, an action out."""

    @property
    def phase(self) -> str:
        """What it is doing, in a word, for recordings and progress bars."""

    def reset(self) -> None:
        """Called before every episode."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Origin(Checked):
    """Where a policy comes from.

    Attributes:
        algorithm: What made it, as ``cma`` or ``ppo``.
        seed: Seed of the run; None if it had none.
        steps: Steps of the environment that the run had made by then.
        command: The command that made it.
        source: What it started from, or what else is to be known.
        versions: Of Python and the packages, by name.
    """

    algorithm: str
    seed: int | None
    steps: int
    command: str = ""
    source: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, slots=True)
class SavedPolicy(Checked):
    """The contents of a policy's file; see the module for the kinds.

    Attributes:
        task: Gymnasium id of the task that it is for.
        origin: Where it comes from.
        gait: The gait, of the kinds ``gait`` and ``residual``.
        steering: As in ``GaitPolicy``, one number per leg [K/rad].
        network: The network, of the kinds ``network`` and ``residual``.
        bound: Largest correction of a temperature, of the kind ``residual`` [K].
        arguments: What the task was made with: ``action``, ``control_period``.
        made_for: The contract of the task that it was made in, see ``contract``; empty if that is
            not known, and then nothing but sizes is compared.
        evaluation: How good it was: settings, and figures with their intervals; empty if it was
            not measured.

    Raises:
        ValueError: If there is neither gait nor network, or the bound is missing or negative.
    """

    task: str
    origin: Origin
    gait: Gait | None = None
    steering: Annotated[tuple[float, ...], _steering] = ()
    network: Network | None = None
    bound: NotNegative = 0.0
    arguments: Mapping[str, Any] = field(default_factory=lambda: {"action": "power"})
    made_for: Mapping[str, Any] = field(default_factory=dict)
    evaluation: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        Checked.__post_init__(self)
        if self.gait is None and self.network is None:
            raise ValueError("gait or network must be there, got neither")
        if self.gait is not None and len(self.steering) != self.gait.legs:
            raise ValueError(
                f"steering must have {self.gait.legs} numbers, got {shown(self.steering)}"
            )
        if (self.bound > 0.0) != (self.kind == "residual"):
            raise ValueError(
                f"bound must be above 0 K with gait and network, else 0, got {self.bound}"
            )

    @property
    def kind(self) -> str:
        """``gait``, ``network`` or ``residual``."""
        if self.gait is None:
            return "network"
        return "gait" if self.network is None else "residual"

    @door
    def save(self, path: str | Path) -> Path:
        """Writes the file in one go: whoever reads it finds the old or the new one.

        Raises:
            ValueError: If the ending is not that of the kind.
        """
        path = Path(path)
        if path.suffix != KINDS[self.kind]:
            raise ValueError(f"path must end in {KINDS[self.kind]} for a {self.kind}, got {path}")
        header: dict[str, Any] = {
            "format": FORMAT, "kind": self.kind, "task": self.task, "origin": asdict(self.origin),
            "arguments": dict(self.arguments),
        }  # fmt: skip
        if self.made_for:
            header |= {"made_for": dict(self.made_for), "contract": digest(self.made_for)}
        if self.evaluation:
            header["evaluation"] = dict(self.evaluation)
        if self.gait is not None:
            header |= {"gait": asdict(self.gait), "steering": self.steering}
        if self.network is None:
            return write_json(path, header)
        network = self.network
        names = ["clip", "epsilon", "activation", "squash"]
        names += ["limit"] * (network.limit is not None)
        header |= {"network": {name: getattr(network, name) for name in names}}
        header |= {"bound": self.bound} if self.kind == "residual" else {}
        rows: dict[str, Any] = {"mean": network.mean, "var": network.var}
        for i, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
            rows |= {f"weight{i}": weight, f"bias{i}": bias}
        more = {"units": network.units, "bounds": network.bounds}
        rows |= {name: array for name, array in more.items() if array is not None}
        memory = io.BytesIO()
        np.savez(memory, header=np.array(json.dumps(header)), **rows)
        return write_whole(path, memory.getvalue())

    @door
    def to_onnx(self, path: str | Path) -> Path:
        """Writes the network as an ONNX file, see ``onnx.onnx_model``, in one go.

        Task, arguments and origin are in the model's metadata.

        Raises:
            ImportError: If ``onnx`` is not installed (the extra ``onnx``).
            ValueError: If the policy is or has a gait, which is no network, or the ending is not
                ``.onnx``.
        """
        if self.network is None or self.kind == "residual":
            raise ValueError(
                f"policy must be a network to become ONNX, got a {self.kind}: what its gait does"
                " depends on time and on the TCAs' heat"
            )
        if Path(path).suffix != ".onnx":
            raise ValueError(f"path must end in .onnx, got {path}")
        about = {"arguments": dict(self.arguments), "origin": asdict(self.origin)}
        noted = {"task": self.task} | {name: json.dumps(value) for name, value in about.items()}
        return write_whole(Path(path), onnx_model(self.network, noted))

    @classmethod
    @door
    def read(cls, path: str | Path) -> SavedPolicy:
        """Reads a file.

        Raises:
            FileNotFoundError: If there is none.
            ValueError: If it is not a policy's, or of a newer format.
        """
        try:
            content, found = content_of(path), {}
            if Path(path).suffix == ".zip":
                raise ValueError("a model is read together with its task, by read_zip")
            if Path(path).suffix == ".npz":
                found = arrays(content)
                content = str(found.pop("header")).encode()
            if len(content) > LONGEST:
                raise ValueError(f"header must have at most {LONGEST} bytes, got {len(content)}")
            header = json.loads(content)
            if header["format"] != FORMAT:
                raise ValueError(f"format must be {FORMAT}, got {header['format']}")
            if header["kind"] not in KINDS:
                raise ValueError(f"kind must be one of {list(KINDS)}, got {header['kind']!r}")
            return cls(
                task=header["task"],
                origin=Origin(**header["origin"]),
                gait=_gait(header["gait"]) if header["kind"] != "network" else None,
                steering=tuple(header.get("steering", ())),
                network=_network(header, found) if header["kind"] != "gait" else None,
                bound=header.get("bound", 0.0),
                arguments=header.get("arguments", {"action": "power"}),
                made_for=_parts(header.get("made_for", {})),
                evaluation=header.get("evaluation", {}),
            )
        except FileNotFoundError:
            raise
        except Exception as error:
            raise ValueError(f"{path} is no policy: {why(error)}") from error

    @door
    def make(self, env: gym.Env[Any, Any]) -> Policy:
        """The policy, ready for an episode in an environment; errors as ``GaitPolicy.in_task``."""
        if self.gait is None:
            assert self.network is not None
            return NetworkPolicy(self.network)
        walker = GaitPolicy.in_task(env, self.gait, self.steering)
        return walker if self.network is None else ResidualPolicy(walker, self.network, self.bound)


@dataclass(slots=True)
class NetworkPolicy:
    """A network that acts on what it sees.

    Attributes:
        network: The network.
    """

    network: Network
    phase = "network"

    def reset(self) -> None:
        """Nothing is remembered."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period."""
        return self.network(observation)


@dataclass(slots=True)
class ResidualPolicy:
    """A gait, corrected by a network that sees the observation and the gait's phase.

    Attributes:
        walker: The gait on feedback.
        network: Its output times ``bound`` is added to the gait's temperatures.
        bound: Largest correction [K].
    """

    walker: GaitPolicy
    network: Network
    bound: float
    phase = "residual"

    def reset(self) -> None:
        """Starts the gait anew."""
        self.walker.reset()

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The action for the next control period."""
        correction = self.network(with_clock(observation, self.walker))
        return self.walker.act(observation, self.bound * correction.astype(np.float64))


def with_clock(observation: NDArray[np.float32], walker: GaitPolicy) -> NDArray[np.float32]:
    """The observation, and sine and cosine of the gait's phase behind it.

    Args:
        observation: What is seen, shape (n,).
        walker: The gait.

    Returns:
        Shape (n + 2,) [1].
    """
    angle = 2.0 * np.pi * walker.cycle
    return np.append(observation, np.array([np.sin(angle), np.cos(angle)], dtype=np.float32))


def _parts(made_for: Any) -> dict[str, Any]:
    if not isinstance(made_for, dict) or not all(isinstance(p, dict) for p in made_for.values()):
        raise ValueError(f"made_for must be the parts of a contract, got {shown(made_for)}")
    return made_for


def _gait(row: Mapping[str, Any]) -> Gait:
    def rows(value: Any) -> Any:
        return tuple(rows(x) for x in value) if isinstance(value, list) else value

    return Gait(**{name: rows(value) for name, value in row.items()})


def _network(header: Mapping[str, Any], found: Mapping[str, NDArray[Any]]) -> Network:
    rest: dict[str, Any] = dict(found)
    layers = range(sum(name.startswith("weight") for name in found))
    return Network(
        weights=tuple(rest.pop(f"weight{i}").astype(np.float32) for i in layers),
        biases=tuple(rest.pop(f"bias{i}").astype(np.float32) for i in layers),
        **rest,
        **header["network"],
    )
