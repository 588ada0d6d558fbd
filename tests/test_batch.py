"""Simulations in a batch: bit for bit what each is alone, whatever happens to the others."""

from dataclasses import fields, is_dataclass, replace

import mujoco
import numpy as np
import pytest

from tca_mj.batch import SimulationBatch
from tca_mj.drive import Drive, SimulationDiverged
from tca_mj.model.part import Part, new_spec
from tca_mj.modules.bending import bending_module
from tca_mj.modules.morphing import MorphingSpec, morphing_module
from tca_mj.sim import Simulation
from tca_mj.variation import Nominal, Variation

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
WRITTEN = ("jnt_stiffness", "qpos_spring", "dof_damping", "actuator_biasprm", "body_mass")
SIZES = (1, 2, 3, 8)


def bending() -> Simulation:
    part = bending_module()
    part.spec.option.gravity = [0.0, 0.0, 9.81]  # hanging
    return Simulation(part)


def morphing() -> Simulation:
    spec = new_spec("bench")
    spec.worldbody.add_site(name="clamp", quat=[0.0, 1.0, 0.0, 0.0])
    robot = Part(spec)
    robot.attach(morphing_module(MorphingSpec()), to="clamp", prefix="module")
    return Simulation(robot, timestep=5e-3, tca_period=0.05)


def everything(sim: Simulation) -> dict[str, bytes]:
    """All that a simulation carries on, and what is derived from it, as bytes."""
    model, data = sim.model, sim.data
    row = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, row, STATE)
    found = {"state": row, "power": sim.power, "damaged": sim.spines.damaged,
             "voltage": sim.spines.voltage}  # fmt: skip
    found |= {name: getattr(model, name) for name in WRITTEN}
    found |= {name: getattr(data, name) for name in ("xpos", "ten_J", "actuator_force", "qacc")}
    found |= {"warning": data.warning.number, "contact": data.contact.dist}

    def add(name, value):
        if is_dataclass(value):
            for field in fields(value):
                add(f"{name}.{field.name}", getattr(value, field.name))
        elif hasattr(value, "_asdict"):
            for part, each in value._asdict().items():
                add(f"{name}.{part}", each)
        else:
            found[name] = value

    for name in ("tca", "pull", "strained"):
        add(name, getattr(sim, name))
    add("spines", sim.spines.state if sim.spines.n else np.zeros(0))
    for name in ("stiffness", "rest", "damping"):
        add(f"body.{name}", getattr(sim.body, name))
    found |= {"length": sim.length, "tension": sim.tension}
    return {name: np.ascontiguousarray(value).tobytes() for name, value in found.items()}


def differing(one: Simulation, other: Simulation) -> list[str]:
    a, b = everything(one), everything(other)
    return [name for name in a if a[name] != b[name]]


def drives(sim: Simulation, random: np.random.Generator) -> Drive:
    return Drive(
        command=random.uniform(0.0, 1.0, sim.n),
        voltage=random.uniform(0.0, 25.0, sim.spines.n),
        fan=random.random(sim.spines.n) < 0.3,
    )


def alone(sim: Simulation, drive: Drive, duration: float) -> str | None:
    try:
        sim.step(drive.command, duration, voltage=drive.voltage, fan=drive.fan)
    except SimulationDiverged as error:
        return str(error)
    return None


@pytest.mark.parametrize("build", [bending, morphing])
@pytest.mark.parametrize("m", SIZES)
def test_a_batch_is_bit_for_bit_what_its_simulations_are_alone(build, m):
    """With friction, mass, gain, heat loss and surroundings of their own, and with resets."""
    random = np.random.default_rng(m)
    singles, sims = [build() for _ in range(m)], [build() for _ in range(m)]
    for pair in zip(singles, sims, strict=True):
        varied = Variation.drawn(random.uniform(-1.0, 1.0, 5).tolist(), 0.2)
        for sim in pair:
            Nominal(sim).apply(varied)
            sim.reset()
    batch = SimulationBatch(sims, threads=2)
    duration = 0.1
    for k in range(12):
        if k in (5, 9):  # one begins anew, the others go on
            for group in (singles, sims):
                group[k % m].reset(lambda data: data.qpos.__iadd__(1e-3))
        given = [drives(sim, random) for sim in sims]
        assert batch.step(given, duration) == [None] * m
        for single, sim, drive in zip(singles, sims, given, strict=True):
            assert alone(single, drive, duration) is None
            assert differing(single, sim) == []


def test_threads_change_nothing():
    results = []
    for threads in (1, 2):
        sims, random = [bending() for _ in range(4)], np.random.default_rng(0)
        batch = SimulationBatch(sims, threads=threads)
        for _ in range(3):
            batch.step([drives(sim, random) for sim in sims], 0.1)
        results.append([everything(sim) for sim in sims])
    assert results[0] == results[1]


def too_long(sim: Simulation) -> None:
    sim.data.qpos[sim.model.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)] = 0.1


def no_number(sim: Simulation) -> None:
    sim.data.qpos[0] = np.nan


def too_fast(sim: Simulation) -> None:
    sim.data.qvel[:] = 1e12


def too_hot(sim: Simulation) -> None:
    sim.tca = replace(sim.tca, temperature=np.full(sim.n, 5000.0))


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid")
@pytest.mark.parametrize(
    ("build", "harm"),
    [
        *((bending, harm) for harm in (too_long, no_number, too_fast, too_hot)),
        *((morphing, harm) for harm in (no_number, too_fast, too_hot)),  # it has no slides
    ],
)
def test_one_that_diverges_breaks_off_as_alone_and_touches_no_other(build, harm):
    random = np.random.default_rng(0)
    singles, sims = [build() for _ in range(3)], [build() for _ in range(3)]
    batch = SimulationBatch(sims, threads=2)
    for group in (singles, sims):
        harm(group[1])
    for k in range(3):
        given = [drives(sim, random) for sim in sims]
        errors = batch.step(given, 0.1)
        for i, (single, sim, drive) in enumerate(zip(singles, sims, given, strict=True)):
            error = alone(single, drive, 0.1)
            assert (error is not None) == (i == 1 and k == 0)
            assert (None if errors[i] is None else str(errors[i])) == error
            assert differing(single, sim) == []
        if k == 0:
            for group in (singles, sims):
                group[1].reset()


def test_who_is_not_driven_stands_still_and_can_be_stepped_alone():
    sims, single = [bending() for _ in range(3)], bending()
    batch = SimulationBatch(sims)
    drive = Drive(command=np.full(sims[0].n, 0.5))
    before = everything(sims[1])
    assert batch.step([drive, None, drive], 0.1) == [None] * 3
    assert everything(sims[1]) == before
    assert batch.step([None] * 3, 0.1) == [None] * 3
    sims[1].step(drive.command, 0.1)
    batch.step([None, drive, None], 0.1)
    for _ in range(2):
        single.step(drive.command, 0.1)
    assert differing(single, sims[1]) == []


def test_what_is_refused_moves_nobody():
    sims = [bending(), bending()]
    batch = SimulationBatch(sims)
    good = Drive(command=np.zeros(sims[0].n))
    before = [everything(sim) for sim in sims]
    for given, duration, complaint in (
        ([good], 0.1, "drives must be a list of 2"),
        ([good, good], 0.03, "multiple of tca_period"),
        ([good, Drive(command=np.full(sims[0].n, -1.0))], 0.1, "at least 0 W"),
        ([good, Drive(command=np.zeros(1))], 0.1, "shape"),
        ([good, replace(good, voltage=np.nan)], 0.1, "voltage"),
    ):
        with pytest.raises(ValueError, match=complaint):
            batch.step(given, duration)
    assert [everything(sim) for sim in sims] == before


def test_a_batch_wants_simulations_built_alike():
    sim = bending()
    for sims, threads, complaint in (
        ([], 1, "at least 1 simulation"),
        ([sim], 0, "threads must be at least 1"),
        ([sim, sim], 1, "different objects"),
        ([sim, morphing()], 1, "number 1 is not as the first"),
        ([sim, Simulation(bending_module(), timestep=1e-3)], 1, "number 1 is not as the first"),
    ):
        with pytest.raises(ValueError, match=complaint):
            SimulationBatch(sims, threads=threads)
