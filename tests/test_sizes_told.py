"""Sizes, defaults and bounds that pages tell in tables are those of specifications and scenes.

Each row of a page is found by its first cell and must have the figures that stand beside it here,
as they are computed; what they mean and where they were printed is text.
"""

import inspect
import math
import re

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from test_docs import ROOT
from test_tetrapod import extent

import tca_mj
from tca_mj.assets import mjcf
from tca_mj.envs.gaits import TASKS
from tca_mj.envs.vector import TaskVector
from tca_mj.modules import continuum_leg as carbon
from tca_mj.modules.bistable import BistableSpec
from tca_mj.modules.innervated import InnervatedFingerSpec
from tca_mj.modules.morphing import MorphingSpec
from tca_mj.registry import TASKS as TASK_ROWS
from tca_mj.robots.adaptive_gripper import AdaptiveGripperSpec
from tca_mj.robots.arm import ArmSpec
from tca_mj.robots.tetrapod import LEGS, TetrapodSpec, rigid_tetrapod, tetrapod
from tca_mj.sim import Simulation
from tca_mj.tca import CATALOGUE, CoilRods
from tca_mj.tca.embedding import (
    BODY_TO_AIR,
    CHANNEL_CONTACT,
    SILICONE_CONDUCTIVITY,
    SILICONE_SPECIFIC_HEAT,
)
from tca_mj.tca.sensing.observer import ObserverSpec

TETRAPOD, ARM, BISTABLE = TetrapodSpec(), ArmSpec(), BistableSpec()
GRIPPER, MORPHING, FINGER = AdaptiveGripperSpec(), MorphingSpec(), InnervatedFingerSpec()
BEND = {"20°, as memorised": TETRAPOD.memory_angle, "95°": math.radians(95.0),
        "215°": math.radians(215.0)}  # fmt: skip


def rows(page, head):
    """Rows of the table with that head by their first cells, which lose backticks and links."""
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    table = text[text.index(f"\n{head}") :].partition("\n\n")[0]
    found = re.findall(r"^\| ([^|]*?) \|(.*)\|$", table, re.MULTILINE)
    return {re.sub(r"\[([^]]*)\]\([^)]*\)|`", r"\1", cell): rest for cell, rest in found}


def lacking(page, head, told):
    """Figures that rows are to have and have not."""
    there = rows(page, head)
    found = {name: [figure for figure in figures
                    if not re.search(rf"(?<![\d.]){re.escape(figure)}(?!\d)", there[name])]
             for name, figures in told.items()}  # fmt: skip
    return {name: figures for name, figures in found.items() if figures}


def mm(*lengths):
    return [f"{1e3 * length:.4g} mm" for length in lengths]


def grams(mass, digits=2):
    return f"{1e3 * mass:.{digits}f} g"


def masses(part, *beginnings):
    model = part.spec.compile()
    return sum(float(model.body(i).mass[0]) for i in range(model.nbody)
               if model.body(i).name.startswith(beginnings))  # fmt: skip


def scene(name):
    return mujoco.MjModel.from_xml_path(str(mjcf(f"{name}.xml")))


def test_the_arm():
    bending, wrist, ring = ARM.bending, ARM.twisting, ARM.gripper
    part = tca_mj.arm()
    assert wrist.double
    told = {
        "bending module": [*mm(bending.length, bending.offset), grams(masses(part, "bending."))],
        "wrist": [*mm(wrist.length), f"{wrist.turns / 2.0:g} turns",
                  grams(masses(part, "wrist."))],
        "gripper": [*mm(ring.length), grams(masses(part, "gripper."))],
    }  # fmt: skip
    assert lacking("arm", "| part | what | mass", told) == {}


def test_the_tetrapod_weighs_what_the_page_says():
    part, leg = tetrapod(), TETRAPOD.leg
    model = part.spec.compile()
    tcas = [tca.spec for tca in part.tcas]
    legs = sum(float(model.body(i).mass[0]) for i in range(model.nbody)
               if ".rod." in model.body(i).name)  # fmt: skip
    rod = carbon.CARBON_DENSITY * math.pi / 4.0 * leg.rod_diameter**2 * leg.length
    of_a_leg = sum(tca.mass for tca in tcas[:12]) / 4.0
    plates = legs / 4.0 - rod - leg.foot_mass - of_a_leg
    parts = {"rod": rod, "four plates": plates, "foot": leg.foot_mass, "three TCAs": of_a_leg}
    said = ", ".join(f"{name} {grams(mass)}" for name, mass in parts.items())
    told = {
        "spine with silicone tube, wires and protrusions": [grams(3 * TETRAPOD.module_mass)],
        f"TCA of a spine, {1e3 * tcas[12].rest_length:.0f} mm":
            [grams(sum(tca.mass for tca in tcas[12:]))],
        "rail with the sockets of its legs": [grams(2 * TETRAPOD.rail_mass)],
        f"leg: {said}": [grams(legs)],
        "robot": [grams(float(model.body_mass.sum()))],
    }  # fmt: skip
    assert lacking("tetrapod-model", "| part", told) == {}


@pytest.mark.parametrize("shape", BEND)
def test_the_tetrapod_is_as_large_as_the_page_says(shape):
    sim = Simulation(rigid_tetrapod(bend=BEND[shape]), timestep=5e-3)
    mujoco.mj_forward(sim.model, sim.data)
    length, width, height = 1e3 * extent(sim, lambda body: True)
    narrow = 1e3 * extent(sim, lambda body: not body.startswith(LEGS))[1]
    high = f"{height:.1f}" if shape.startswith("20") else f"{height:.0f}"
    told = f" {length:.0f} mm | {high} mm | {width:.0f} mm | {narrow:.0f} mm "
    assert rows("tetrapod-model", "| body angle")[shape] == told


def test_the_numbers_of_the_tetrapod():
    spec, leg, spine = TETRAPOD, TETRAPOD.leg, TETRAPOD.spine
    size = " x ".join(f"{1e3 * x:g}" for x in (spine.length, spine.width, spine.module_height))
    told = {
        "spines, their size": [f"{size} mm"],
        "rail, length": mm(spec.rail_length), "rail, section": mm(spec.rail_width),
        "rail, mass": [grams(spec.rail_mass, 0)], "spacing of the spines": mm(spec.spacing),
        "memorised bend": [f"{math.degrees(spec.memory_angle):.0f}°"],
        "leg's root from the middle": mm(spec.leg_station),
        "leg's root above the spines": mm(spec.leg_height),
        "mass of a module": [grams(spec.module_mass, 1)],
        "friction of body and plates": [f"{spec.belly_friction:g}"],
        "rod of a leg, length": mm(leg.length), "rod of a leg, diameter": mm(leg.rod_diameter),
        "carbon fibre": [f"{1e-9 * carbon.CARBON_YOUNG:g} GPa",
                         f"{1e-9 * carbon.CARBON_SHEAR:g} GPa in shear",
                         f"{carbon.CARBON_DENSITY:g} kg/m³"],
        "TCAs from the rod": mm(leg.offset),
        "plates": [*mm(leg.plate_radius, leg.plate_thickness), f"{carbon.PRINTED_DENSITY:g} kg/m³"],
        "foot": [*mm(leg.foot_radius), grams(leg.foot_mass)],
        "friction of a foot": [f"{leg.friction:g}"],
        "damping of a leg": [f"{1e3 * leg.damping_time:g} ms"],
        "angle of the U, width of the beam": [
            f"{math.degrees(TASKS['shimmy'].bend):.0f}°",
            *mm(2.0 * scene("beam").geom("beam").size[1])],
    }  # fmt: skip
    assert lacking("tetrapod-model", "| number", told) == {}
    told = {f"TCA/Tetrapod{gait.capitalize()}-v0": [
        f"{math.degrees(task.bend):.0f}°", f"{1e3 * task.speed:g} mm/s"
    ] for gait, task in TASKS.items()}  # fmt: skip
    assert lacking("tetrapod", "| task | shape", told) == {}
    high = f"{1e3 * TASKS['shimmy'].beam:g} mm high"
    assert high in rows("tetrapod", "| task")["TCA/TetrapodShimmy-v0"]


def test_the_course():
    model = scene("course")

    def side(name, axis, sign):
        geom = model.geom(name)
        return float(geom.pos[axis] + sign * geom.size[axis])

    top, ground = side("beam", 2, 1), side("desk2", 2, 1)
    sill = side("sill", 2, 1) - ground, side("sill", 0, 1) - side("sill", 0, -1)
    told = {
        "gap": mm(side("desk2", 0, -1) - side("desk1", 0, 1)),
        "beam": [f"{1e3 * (side('beam', 1, 1) - side('beam', 1, -1)):.0f} mm wide"],
        "its top over the first desk": mm(top - side("desk1", 2, 1)),
        "its top over the second desk": mm(top - ground),
        "its lower end, over the second desk": [f"{1e3 * sill[0]:.0f} mm high",
                                                f"{1e3 * sill[1]:.0f} mm long"],
    }  # fmt: skip
    assert lacking("course", "| what | estimate", told) == {}


def test_the_adaptive_gripper():
    base, strip = GRIPPER.base.spine, GRIPPER.fingers
    size = " x ".join(f"{1e3 * x:g}" for x in (strip.length, strip.width, strip.thickness))
    told = {
        "base": mm(base.length / 2.0),
        "finger": [f"{size} mm", f"{1e-6 * strip.young:g} MPa", *mm(strip.offset)],
        "pad": [f"{1e3 * strip.pad:g} x {1e3 * strip.pad_width:g} mm", *mm(strip.pad_height)],
        "friction": [f"{strip.friction:g}"],
    }
    assert lacking("adaptive-grasp", "| part", told) == {}


def test_objects_of_the_adaptive_gripper():
    told = {}
    for name, key in (("sponge", "sponge"), ("can", "can"), ("ping-pong ball", "ball"),
                      ("glove", "glove")):  # fmt: skip
        model = scene(key)
        told[name] = [f"{1e3 * float(model.body_mass.sum()):.1f}".removesuffix(".0") + " g"]
        if key in ("sponge", "glove"):
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            half = data.geom("side1").xpos[0] + model.geom("side1").size[0]
            # Both sides give way, each on a spring of its own: half of its stiffness.
            yields = f"{model.joint('side0').stiffness[0] / 2.0:g} mN"
            told[name] += [f"{2e3 * half:g}", yields]
    told["can"].append(f"{2e3 * scene('can').geom('wall').size[0]:g} x"
                       f" {2e3 * scene('can').geom('wall').size[1]:g} mm")  # fmt: skip
    told["ping-pong ball"] += mm(2.0 * scene("ball").geom("shell").size[0])
    assert lacking("adaptive-grasp", "| object", told) == {}


def test_the_bistable_module():
    gripper = masses(tca_mj.bistable_gripper(), "hand.")
    told = {
        "silicone": [f"{100.0 * BISTABLE.fill:g} %", f"{1e3 * gripper:.1f} g then"],
        "spine": [f"{1e-9 * BISTABLE.spine_young:g} GPa", f"{100.0 * BISTABLE.window:g} %"],
        "bending stiffness k_b": [f"{1e3 * BISTABLE.stiffness:.2f} mN m/rad"],
        "lever h": mm(BISTABLE.offset), "band": [f"{BISTABLE.band:.0f} N/m"],
        "slack": mm(BISTABLE.slack),
    }
    assert lacking("bistable", "| what | value", told) == {}


def test_morphing_module_and_finger():
    spine, cylinder = MORPHING.spine, FINGER.cylinder
    size = " x ".join(f"{1e3 * x:g}" for x in (spine.length, spine.width, spine.module_height))
    told = {
        "length, width, height": [f"{size} mm"],
        "spine's thickness, offset of the TCA": mm(spine.thickness, spine.tca_offset),
        "TCA": [f"twice {1e3 * spine.length:g} mm", *mm(2.0 * MORPHING.half_width)],
        "mass without TCA": [grams(MORPHING.mass, 1)],
        "loss: Kelvin-Voigt time": [f"{1e3 * MORPHING.damping_time:g} ms"],
    }
    assert lacking("morphing", "| what | value", told) == {}
    told = {
        "length": mm(cylinder.length), "TCAs": mm(FINGER.tca_length, cylinder.offset),
        "section": mm(cylinder.diameter, cylinder.outer_diameter),
        "resistance at rest": [f"{FINGER.leads:g} ohm of leads"],
    }
    assert lacking("finger", "| what | figure | where", told) == {}


def test_defaults_of_the_observer():
    spec = ObserverSpec()
    told = {
        "resistance_noise": [f"{1e3 * spec.resistance_noise:g} mohm"],
        "current_noise": [f"{spec.current_noise:g}"],
        "tension_rate": [f"{spec.tension_rate:g} N/s^0.5"],
        "temperature_rate": [f"{spec.temperature_rate:g} K/s^0.5"],
        "loss_error, loss_rate": [f"{spec.loss_error:g}"],
    }
    assert spec.loss_error == spec.loss_rate
    assert lacking("bench", "| noise", told) == {}


def test_estimates_of_tcas():
    """Those that are fields or constants; the others are said in words."""
    free, coiled = CATALOGUE["free-stroke"], CATALOGUE["self-coiled"]
    made, two = CATALOGUE["free-stroke-made"], CATALOGUE["type-2-180"]
    square, line, one = free.fibre.load_softening
    told = {
        "contact: 50 times the cold stiffness, over 0.5 % of the length": [],
        "contact at close packing, 9.43° and 17.13°": [f"{100.0 * free.free_stroke:.1f} %"],
        "contact of types 1 and 2 at 70 mm": [],
        "λ(τ) = 3.24e-4 τ² - 0.027 τ + 1": [],
        f"{coiled.fibre.untwist_scale:g} times the untwist": [],
        f"self-coiled TCA breaks at {coiled.breaking_force:g} N": [],
        f"the others break at {two.breaking_force:g} N": [],
        f"{1e3 * two.heat_loss:.0f} mW/(m K) of heat lost in Chapter 2": [],
        f"{free.contraction_resistance:.2f} of resistance per contraction": [],
        f"{1e3 * free.heat_loss:.1f} mW/(m K) of heat lost": [],
        f"{CHANNEL_CONTACT:g} W/(m K) from a TCA to the wall of a straight channel": [],
        f"silicone: {1e-3 * SILICONE_SPECIFIC_HEAT:g} kJ/(kg K), {SILICONE_CONDUCTIVITY:g} W/(m K),"
        f" {BODY_TO_AIR:g} W/(m² K) to the air": [],
        f"nylon melts at {free.fibre.melting_temperature:g} °C: no model goes there": [],
    }
    assert (free.contact_ratio, free.contact_smoothing) == (50.0, 0.005)
    assert [f"{math.degrees(tca.minimum_pitch_angle):.2f}°" for tca in (made, coiled)] == [
        "9.43°", "17.13°"]  # fmt: skip
    assert two.minimum_length == pytest.approx(70e-3, abs=0.05e-3)
    assert (square, line, one) == (3.24e-4, -0.027, 1.0)
    assert lacking("tca", "| number | kind", told) == {}


def test_the_control_period():
    told = rows("tasks", "| argument | values")["control_period"].rpartition("|")[2].strip()
    assert told.startswith("0.1 s, for ") and told.endswith(" 20 ms")
    named = dict.fromkeys(re.findall(r"`(TCA/\w+-v0)`", told), 0.02)
    for id in (task.id for task in TASK_ROWS):
        env = gym.make(id, disable_env_checker=True).unwrapped
        assert env.control_period == pytest.approx(named.get(id, 0.1)), id
        env.close()


def test_the_vector_environment_has_the_arguments_of_its_page():
    told = rows("vector", "| argument of `make_vec`")
    parameters = inspect.signature(TaskVector.__init__).parameters
    named = [name for name in parameters if name not in ("self", "task", "kwargs")]
    assert [*told][1:-1] == named
    assert told["num_envs"].startswith(f" {parameters['num_envs'].default} |")
    mode = parameters["autoreset_mode"].default.value
    assert told["autoreset_mode"].startswith(f" `{mode}` |")


def test_infos_have_what_the_page_tells():
    """Each key is one of some task's infos after a step; those after a step only are said so."""
    told = rows("tasks", "| `info` | what")
    keys = {key.strip() for cell in [*told][1:] for key in cell.split(",")}
    seen = set()
    for id in (task.id for task in TASK_ROWS):
        env = gym.make(id, disable_env_checker=True).unwrapped
        env.reset(seed=0)
        *_, info = env.step(env.action_space.sample() * 0.0)
        seen |= {*info}
        env.close()
    assert keys <= seen and len(keys) > 10


def test_laws_of_a_tca_in_the_studies(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    studies = pytest.importorskip("studies")
    rod = CoilRods([CATALOGUE["free-stroke"]]).rest_stiffness[0]
    told = {
        "this package": [f"{rod:.1f} N/m, cold"],
        "printed (Sun, eq. (5.23))": [f"{studies.SHEAR / studies.COMPLIANCE:.1f} N/m"],
        "printed passive (Sun, Section 5.3.1)": [
            f"{1e-6 * studies._G2:g} F² + {1e-6 * studies._G1:g} F + {1e-6 * studies._G0:g} MPa",
            f"{studies._G0 / studies.COMPLIANCE:.3f} N/m at F = 0"],
    }  # fmt: skip
    assert lacking("studies", "| law |", told) == {}


@pytest.mark.parametrize(
    ("task", "page", "which"),
    [
        ("ArmPickPlace", "arm", {"0-2": 0, "3": 3, "4": 4}), ("Grasp", "grasp", {"0": 0}),
        ("AdaptiveGrasp", "adaptive-grasp", {"1": 0, "2, 3": 1}),
        ("BistableGrasp", "bistable-gripper", {"0-3": 0}), ("MorphModule", "morphing", {"1": 0}),
    ],
)  # fmt: skip
def test_bounds_of_actions(task, page, which):
    """Temperature and power that an action can ask for; other rows have speeds and volts."""
    env = gym.make(f"TCA/{task}-v0", disable_env_checker=True).unwrapped
    power = np.broadcast_to(env.max_power, env.sim.n if np.ndim(env.max_power) else 1)
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    table = text[text.index("| index | action |") :].partition("\n\n")[0]
    there = dict(re.findall(r"^\| ([\d, -]+) \|(.*)$", table, re.MULTILINE))
    for index, place in which.items():
        figures = f"{env.safe_temperature:g} °C", f"{power[place]:g} W |"
        assert all(figure in f"{there[index]} |" for figure in figures), (index, figures)
    env.close()


@pytest.mark.parametrize(
    ("task", "page"),
    [
        ("ArmPickPlace", "arm"), ("MorphModule", "morphing"), ("BendReach", "reach"),
        ("FingerSense", "finger"), ("Grasp", "grasp"), ("AdaptiveGrasp", "adaptive-grasp"),
        ("BistableGrasp", "bistable-gripper"), ("Jump", "jump"), ("TetrapodWalk", "tetrapod"),
    ],
)  # fmt: skip
def test_terms_and_prices_of_rewards(task, page):
    """Each term has a row; what a joule, a hot kelvin and a bad end cost is said there."""
    env = gym.make(f"TCA/{task}-v0", disable_env_checker=True).unwrapped
    told = rows(page, "| term | value")
    assert {*told} - {"term", "---"} == {*env.terms}
    period = env.control_period
    every = f"{period:g} s" if period >= 0.1 else f"{1e3 * period:g} ms"
    assert told["energy"].startswith(f" -{env.energy_price:g} per joule")
    if env.heat_price:
        hot = f"above {env.hot_temperature:g} °C, every {every}"
        assert told["heat"].startswith(f" -{env.heat_price:g} for each kelvin")
        assert hot in told["heat"]
    if env.end_price:
        assert told["end"].startswith(f" -{env.end_price:g} ")
    env.close()
