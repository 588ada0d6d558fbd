"""A muscle of another kind: springs of shape-memory wire, beside two TCAs in one soft module.

A NiTi spring is stiffer hot than cold, because austenite has the larger shear modulus; on cooling
it turns back at lower temperatures than on heating, which its state remembers (Liang and Rogers, J.
Intell. Mater. Syst. Struct. 1(2), 1990). Temperatures and moduli are typical ones: estimates.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from tca_mj.checks import require_positive, within
from tca_mj.model.chain import add_chain
from tca_mj.model.part import Part, new_spec
from tca_mj.model.tendon import lay_tca, route_passes
from tca_mj.modules.bending import BendingSpec
from tca_mj.routes import parallel
from tca_mj.tca import HeatSpec, HeatStep, Pull
from tca_mj.tca.arrays import column
from tca_mj.tca.bank import Signal


@dataclass(frozen=True, kw_only=True, slots=True)
class SmaSpring:
    """A close-wound spring of NiTi wire, pre-stretched by its route."""

    rest_length: float = 45e-3  # of the route in the unloaded body [m]
    prestretch: float = 3e-3  # by which the spring is longer there than wound [m]
    wire: float = 0.15e-3  # diameter of the wire [m]
    coil: float = 1.5e-3  # mean diameter of the coils [m]
    turns: int = 20
    soft: float = 8e9  # shear modulus of martensite [Pa]
    stiff: float = 18e9  # shear modulus of austenite [Pa]
    capacity: float = 0.04  # [J/K]
    loss: float = 4e-3  # to the air [W/K]
    breaking_force: float = 5.0  # [N]

    def __post_init__(self):
        require_positive(**{name: getattr(self, name) for name in self.__dataclass_fields__})

    @property
    def mass(self):
        return 6450.0 * math.pi**2 * self.coil * self.turns * self.wire**2 / 4.0

    @property
    def outer_radius(self):
        return (self.coil + self.wire) / 2.0

    def of_length(self, length):
        return replace(self, rest_length=length)

    @classmethod
    def bank(cls, specs):
        return SmaBank(specs)


@dataclass(frozen=True, slots=True, eq=False)
class SmaState:
    temperature: np.ndarray
    austenite: np.ndarray  # its share
    energy_in: np.ndarray


class SmaBank:
    kind, channels = "SMA spring", {"power": "W"}
    heating, cooling = (68.0, 78.0), (42.0, 52.0)  # transformation begins and ends [°C]

    def __init__(self, specs):
        self.specs = tuple(specs)
        names = ("rest_length", "breaking_force", "prestretch", "soft", "stiff")
        self.rest_length, self.breaking_force, self._stretch, self._soft, self._stiff = (
            column(specs, name) for name in names
        )
        wire, coil, turns = (column(specs, name) for name in ("wire", "coil", "turns"))
        self._shape = wire**4 / (8.0 * coil**3 * turns)  # stiffness over shear modulus [m]
        self.heat = HeatSpec(
            capacity=column(specs, "capacity"), loss=column(specs, "loss"),
            ambient=np.full(len(specs), 25.0),
        )  # fmt: skip
        self.shortest, self.longest = 0.2 * self.rest_length, 2.0 * self.rest_length

    def rest(self, batch_shape=()):
        cold = np.broadcast_to(self.heat.ambient, (*batch_shape, len(self.specs))).copy()
        return SmaState(cold, np.zeros_like(cold), np.zeros_like(cold))

    def checked(self, command):
        return within("command", command, at_least=0.0, unit="W", shape=(len(self.specs),))

    def advance(self, state, command, length, dt):
        warm = state.temperature
        hot, _, _ = HeatStep.of(self.heat, dt).advance(warm, warm, command)
        up = np.interp(hot, self.heating, (0.0, 1.0))  # at least so much on heating
        down = np.interp(hot, self.cooling, (0.0, 1.0))  # at most so much on cooling
        share = np.clip(state.austenite, up, down)
        later = SmaState(hot, share, state.energy_in + command * dt)
        return later, self.pull(later, length)

    def pull(self, state, length):
        modulus = self._soft + (self._stiff - self._soft) * state.austenite
        stiffness = modulus * self._shape
        tension = stiffness * (length - self.rest_length + self._stretch)
        return Pull(tension, stiffness, np.asarray(length))

    def signals(self, state, length):
        return {"temperature": Signal("°C", state.temperature),
                "austenite": Signal("-", state.austenite)}  # fmt: skip


def sma_module(spec=None):
    """A bending module whose first muscle is an SMA spring; the other two are TCAs."""
    spec = spec or BendingSpec()
    mjspec = new_spec("bending")
    chain = add_chain(mjspec.worldbody, spec.body, nodes=spec.nodes, name="body")
    chain.mark_tip("tip")
    muscles = (SmaSpring(), spec.embedded, spec.embedded)
    laid = (
        lay_tca(mjspec, muscle, route_passes(chain, route), name=f"muscle{i}")
        for i, (muscle, route) in enumerate(zip(muscles, parallel(3, spec.offset), strict=True))
    )
    return Part(mjspec, tuple(laid), {"tip": "tip"})
