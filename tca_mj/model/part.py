"""A built piece of a robot: a MuJoCo specification, and the TCAs and spines in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import mujoco
from numpy.typing import ArrayLike

from tca_mj.checks import Checked, door
from tca_mj.model.chain import Member
from tca_mj.model.spine import RoutedSpine
from tca_mj.model.tendon import RoutedTca


@dataclass(slots=True)
class Part(Checked):
    """A module, a robot or a whole scene; parts are attached to parts.

    Attributes:
        spec: The MuJoCo specification. Its frame is the part's base.
        tcas: The TCAs in it, in the order of a simulation's actuator axis.
        sites: Names of sites with a meaning, for example ``tip``.
        spines: The shape-memory spines in it, in the order of a simulation's heater axis.
        chains: What it remembers of its chains; those that TCAs run through may be left out.

    Raises:
        ValueError: If a field is something else.

    Example:
        >>> import tca_mj
        >>> arm = tca_mj.arm()
        >>> [tca.name for tca in arm.tcas][-2:], arm.sites["gripper.grasp"]
        (['wrist.tca', 'gripper.tca'], 'gripper.grasp')
    """

    spec: mujoco.MjSpec
    tcas: tuple[RoutedTca, ...] = ()
    sites: dict[str, str] = field(default_factory=dict)
    spines: tuple[RoutedSpine, ...] = ()
    chains: tuple[Member, ...] = ()

    @property
    def members(self) -> dict[str, Member]:
        """All chains by name: those in ``chains``, and those that its TCAs run through."""
        laid = (run.chain for tca in self.tcas for run in tca.runs)
        return {member.name: member for member in (*self.chains, *laid)}

    def copy(self) -> Part:
        """A part like this one, with a specification of its own."""
        return replace(self, spec=self.spec.copy(), sites=dict(self.sites))

    @door
    def export(
        self, path: str | Path | None = None, *, temperatures: ArrayLike | None = None
    ) -> str:
        """The part as MJCF for plain MuJoCo, its TCAs' law frozen: ``tca_mj.export`` of it.

        The shape there is found by a simulation. That stands above this floor, and so it is not
        imported but fetched by its name from the package's door, which knows what stands where.

        Args:
            path: The file; None to return the text only.
            temperatures: Temperatures of the n TCAs, shape (n,), or one for all; None for those of
                the surroundings [°C].

        Returns:
            The text of the file.

        Raises:
            ValueError, OSError, SimulationDiverged: As ``tca_mj.export``.
        """
        import tca_mj

        text: str = tca_mj.export(self, path, temperatures=temperatures)
        return text

    @door
    def attach(
        self, child: Part, *, to: str, prefix: str, names: Sequence[str] | None = None
    ) -> None:
        """Attaches ``child`` rigidly to the site ``to`` of this part; the child is used up.

        All names of the child get ``prefix`` and a dot in front.

        Args:
            child: The part to attach.
            to: Name of one of this specification's sites.
            prefix: Name of the child in this part.
            names: Which of the child's named sites to keep, by default all.

        Raises:
            ValueError: If there is no such site, or a TCA or spine of that name exists already.
        """
        site = self.spec.site(to)
        if site is None:
            known = [s.name for s in self.spec.sites if ".leg" not in s.name]
            raise ValueError(f"to must be a site of this part, one of {known}, got {to!r}")
        tcas = tuple(tca.renamed(f"{prefix}.") for tca in child.tcas)
        spines = tuple(spine.renamed(f"{prefix}.") for spine in child.spines)
        mine = {tca.name for tca in self.tcas} | {spine.name for spine in self.spines}
        clash = sorted(mine & ({tca.name for tca in tcas} | {spine.name for spine in spines}))
        if clash:
            raise ValueError(f"prefix must make new names, got {prefix!r}: {clash} exist already")
        self.spec.attach(child.spec, site=site, prefix=f"{prefix}.")
        self.tcas += tcas
        self.spines += spines
        self.chains += tuple(chain.renamed(f"{prefix}.") for chain in child.chains)
        for key, value in child.sites.items():
            if names is None or key in names:
                self.sites[f"{prefix}.{key}"] = f"{prefix}.{value}"


@door
def new_spec(name: str) -> mujoco.MjSpec:
    """An empty specification with the solver settings of all models of this package.

    The ``discrete`` integrator takes springs, dampers and affine actuators implicitly and is
    stable at any time step; see the page on soft bodies in the documentation.

    Args:
        name: Name of the model.

    Example:
        >>> from tca_mj import new_spec
        >>> spec = new_spec("robot")
        >>> spec.modelname, spec.option.timestep
        ('robot', 0.002)
    """
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.compiler.autolimits = True
    set_options(spec)
    return spec


@door
def set_options(spec: mujoco.MjSpec) -> None:
    """Gives a specification the solver settings of ``new_spec``, and radians.

    Args:
        spec: The specification, which is changed.
    """
    spec.compiler.degree = False
    option = spec.option
    # A diverged state stays as it is, for the one who asks what happened.
    option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.timestep = 2e-3
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    # Pyramidal cones cost half of elliptic ones in a grasp. The high impedance of friction keeps
    # what is held from creeping: 7 um/s for a board of 0.9 g between soft fingers, 65 um/s at 10.
    option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    option.impratio = 100.0
