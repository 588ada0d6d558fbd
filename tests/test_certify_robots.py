"""Robots of one's own against rod theory: closed forms, planted errors, and what is refused."""

import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

import tca_mj
from tca_mj import cli
from tca_mj.certify.cases import Case, at_rest, gap, theory
from tca_mj.certify.parts import Outside, Seen
from tca_mj.certify.rest import Load
from tca_mj.certify.robots import certify_robot
from tca_mj.certify.subjects import SUBJECTS, read, slack
from tca_mj.model.tendon import Pass, lay_tca
from tca_mj.modules.bending import silicone_cylinder
from tca_mj.modules.continuum_leg import LegSpec, continuum_leg
from tca_mj.modules.finger import finger_pair
from tca_mj.modules.morphing import morphing_module
from tca_mj.rod import Segment, solve_series
from tca_mj.tca import law_at, write_tca

ROOT = Path(__file__).parent.parent
LENGTH, RADIUS = 45e-3, 3.2e-3
SOFT = silicone_cylinder(LENGTH, 8e-3, 8e-3)
THIN = silicone_cylinder(LENGTH, 5e-3, 8e-3)
TIPS = ("body", "upper")


def robot(*phases, beam=SOFT, nodes=8):
    """A straight TCA in each of chains that stand on each other, at angles from x."""
    part = tca_mj.Part(tca_mj.new_spec("robot"))
    part.spec.option.gravity = [0.0, 0.0, 0.0]
    chain = None
    for name, phase in zip(TIPS, phases, strict=False):
        chain = tca_mj.add_chain(part, beam, nodes=nodes, name=name, on=chain)
        tca_mj.add_tca(part, chain, tca_mj.Helix(RADIUS, phase=phase), "free-stroke")
    return part


def case(part, *temperature, gravity=(0.0, 0.0, 0.0)):
    subject = read(part, what="robot")
    still = np.zeros((len(subject.tips), 3))
    load = Load(force=still, moment=still, gravity=np.array(gravity))
    return subject, Case(temperature=np.array(temperature), posture="as built", load=load)


def arc(tca, temperature, phase, beam=SOFT):
    """Motion over a body that one straight TCA bends: u = F a/EI, v = 1 - F/EA, F by its law."""
    law = law_at(tca, temperature)

    def shape(force):
        u, v = force * RADIUS / beam.bending[0], 1.0 - force / beam.stretching
        return u, v, LENGTH * (v - u * RADIUS)

    most = 0.6 / (RADIUS**2 / beam.bending[0] + 1.0 / beam.stretching)  # it is 0.4 as long then
    force = brentq(lambda force: law(shape(force)[2])[0] - force, 0.0, most, xtol=1e-14)
    u, v, length = shape(force)
    angle, (c, s) = u * LENGTH, (math.cos(phase), math.sin(phase))
    across, along = v / u * (1.0 - math.cos(angle)), v / u * math.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    bend = np.array([[math.cos(angle), 0.0, math.sin(angle)], [0.0, 1.0, 0.0],
                     [-math.sin(angle), 0.0, math.cos(angle)]])  # fmt: skip
    return turn @ [across, 0.0, along], turn @ bend @ turn.T, length, angle


def test_a_single_straight_tca_makes_an_arc():
    part = robot(0.7)
    subject, asked = case(part, 110.0)
    tip, rotation, length, angle = arc(part.tcas[0].spec, 110.0, 0.7)
    exact = theory(subject, asked)
    assert exact.position[0] == pytest.approx(tip, abs=1e-9 * LENGTH)
    assert exact.rotation[0] == pytest.approx(rotation, abs=1e-9)
    assert exact.length == pytest.approx([length], abs=1e-11)
    found = gap(subject, at_rest(subject, asked), exact)
    # A cell bends in its middle: ends that are θ²/12 of h closer, at 8 nodes.
    assert angle > 0.7 and found.position < (angle / 8.0) ** 2 / 8.0 and found.length < 1e-9


def test_two_chains_make_two_arcs_one_on_the_other():
    part = robot(0.3, 2.5)
    subject, asked = case(part, 110.0, 95.0)
    (one, turn, first, _), (two, more, second, _) = (
        arc(tca.spec, temperature, phase)
        for tca, temperature, phase in zip(part.tcas, (110.0, 95.0), (0.3, 2.5), strict=True)
    )
    exact = theory(subject, asked)
    assert exact.position == pytest.approx(np.array([one, one + turn @ two]), abs=1e-9 * LENGTH)
    assert exact.rotation[1] == pytest.approx(turn @ more, abs=1e-9)
    assert exact.length == pytest.approx([first, second], abs=1e-11)
    assert gap(subject, at_rest(subject, asked), exact).position < 2e-3


def test_a_tca_through_two_chains_is_one_through_a_chain_of_twice_the_length():
    """A helix and a U, with gravity: theory to rounding, MuJoCo at as many nodes too."""
    parts = []
    for lengths in ((LENGTH, LENGTH), (2.0 * LENGTH,)):
        part, chains = tca_mj.Part(tca_mj.new_spec("robot")), []
        for name, length in zip(TIPS, lengths, strict=False):
            soft, on = silicone_cylinder(length, 8e-3, 8e-3), chains[-1] if chains else None
            nodes = round(length / LENGTH * 6)
            chains.append(tca_mj.add_chain(part, soft, nodes=nodes, name=name, on=on))
        for route in (tca_mj.Helix(RADIUS, turns=0.5), tca_mj.UTurn.parallel(2.5e-3, 1e-3, 1.0)):
            tca_mj.add_tca(part, chains, route, "free-stroke")
        parts.append(part)
    answers = []
    for part in parts:
        subject, asked = case(part, 100.0, 80.0, gravity=(0.0, 0.0, 9.81))
        answers.append((theory(subject, asked), at_rest(subject, asked)))
    for one, other in zip(*answers, strict=True):
        assert one.position[-1] == pytest.approx(other.position[-1], abs=1e-8)
        assert one.length == pytest.approx(other.length, abs=1e-9)
    masses = [sum(geom.mass for geom in part.spec.geoms) for part in parts]
    assert masses[0] == pytest.approx(masses[1], rel=1e-12)


def test_two_fingers_with_one_tca_are_a_tree_and_by_their_mirror_a_row():
    """The least energy of both fingers at once, and each alone by shooting with half of the TCA."""
    mirrored = SUBJECTS["finger"]()
    whole = read(finger_pair(), what="hand", tips={"finger0": "tip0", "finger1": "tip1"})
    still = np.zeros((2, 3))
    load = Load(force=still, moment=still, gravity=np.array([0.0, 0.0, 9.81]))
    asked = Case(temperature=np.array([120.0]), posture="hanging", load=load)
    assert (whole.solver, mirrored.solver) == ("energy", "shooting")
    one, other = theory(mirrored, asked), theory(whole, asked)
    assert one.position == pytest.approx(other.position, abs=1e-11)
    assert one.rotation == pytest.approx(other.rotation, abs=1e-10)
    assert one.length == pytest.approx(other.length, abs=1e-12)


def test_a_tree_stands_in_the_balance_of_its_branches():
    """Clamped as they stand, two branches have the same shapes and load the trunk with the rest."""
    frame = np.diag([1.0, -1.0, -1.0])
    down = (0.0, 0.5, 1.5)
    trunk = Segment(SOFT, [tca_mj.Helix(RADIUS)], [0.02], mass=2e-4, centre=(0.0, 1e-3, 0.0))
    left = Segment(THIN, [tca_mj.Helix(RADIUS, 0.4)], [0.01], base=0, offset=(5e-3, 0.0, 0.0))
    right = Segment(THIN, [tca_mj.Helix(RADIUS, phase=2.0)], [0.005], base=0, rotation=frame)
    with pytest.raises(ValueError, match="solver must be 'energy' where segments branch"):
        solve_series([trunk, left, right])
    below, *above = solve_series([trunk, left, right], gravity=down, solver="energy")
    force, moment = 2e-4 * np.array(down), np.zeros(3)
    moment += np.cross(below.rotation[-1] @ [0.0, 1e-3, 0.0], force)
    for shape, segment in zip(above, (left, right), strict=True):
        alone = Segment(THIN, segment.routes, segment.tensions, rotation=shape.rotation[0],
                        offset=shape.position[0])  # fmt: skip
        (same,) = solve_series([alone], gravity=down)
        assert same.position == pytest.approx(shape.position, abs=1e-10)
        assert same.base_moment == pytest.approx(shape.base_moment, abs=1e-12)
        force = force - shape.base_force
        moment -= shape.base_moment + np.cross(-below.tip, shape.base_force)
    (held,) = solve_series([Segment(SOFT, trunk.routes, trunk.tensions)], gravity=down,
                           tip_force=force, tip_moment=moment)  # fmt: skip
    assert held.position == pytest.approx(below.position, abs=1e-10)
    assert held.base_force == pytest.approx(below.base_force, rel=1e-10)
    assert held.base_moment == pytest.approx(below.base_moment, abs=1e-12)


def test_plates_cut_a_chain_and_weigh():
    spec = LegSpec()
    segments = Seen(continuum_leg()).limb([slack] * 3).segments
    assert [each.beam.length for each in segments] == pytest.approx([spec.length / 3.0] * 3)
    plates = [spec.plate_mass, spec.plate_mass, spec.plate_mass + spec.foot_mass]
    assert [each.mass for each in segments] == pytest.approx(plates)
    foot = spec.foot_radius * spec.foot_mass / plates[2]
    assert segments[2].centre == pytest.approx([0.0, 0.0, foot], abs=1e-12)
    assert [each.strands for each in segments] == [(0, 1, 2)] * 3
    weight = sum(each.beam.mass + each.mass for each in segments)
    built = continuum_leg().spec.compile().body_subtreemass[0]
    assert weight == pytest.approx(built - spec.plate_mass, rel=1e-12)  # one is on the base


def test_a_chain_that_curls_by_more_than_half_a_turn_is_said_to():
    part = robot(0.0, beam=THIN, nodes=16)
    result = certify_robot(part, hot=150.0)
    _, _, _, angle = arc(part.tcas[0].spec, 150.0, 0.0, beam=THIN)
    cold, hot = result["cases"]
    assert 200.0 < math.degrees(angle) < 300.0
    assert hot["bend"] == pytest.approx(angle, rel=1e-9) and cold["bend"] == 0.0
    assert f"| tca0 | 0 0 0 | {math.degrees(angle):.1f} |" in result["text"]


def test_a_passive_chain_counts_too():
    """A tail without TCAs bends by its weight and loads what it hangs on."""
    part = robot(0.0)
    body, lies = part.spec.body("body.piece8"), (0.0, 9.81, 0.0)
    tca_mj.add_chain(part, THIN, nodes=12, name="tail", on=body, pos=(0.0, 0.0, LENGTH / 16.0))
    subject, asked = case(part, 90.0, gravity=lies)
    assert subject.nodes == (8, 12)
    exact = theory(subject, asked)
    assert gap(subject, at_rest(subject, asked), exact).position < 5e-3
    alone, short = case(robot(0.0), 90.0, gravity=lies)
    assert np.linalg.norm(theory(alone, short).position[0] - exact.position[0]) > 1e-3


def stiffer(part):
    for joint in part.spec.joints:
        joint.stiffness *= 1.05


def heavier(part):
    for geom in part.spec.geoms:
        geom.mass *= 1.3


def further_out(part):
    (tca,) = part.tcas
    crossings = [replace(each, leg=tca_mj.Helix(1.15 * RADIUS)) for each in tca.crossings]
    part.tcas = (replace(tca, crossings=tuple(crossings)),)


@pytest.mark.parametrize("error", [stiffer, heavier, further_out])
def test_a_planted_error_is_not_certified(error):
    """In MuJoCo joints 5 % too stiff, masses 30 % too large, a TCA 15 % too far from the axis."""
    part = robot(0.0)
    options = {"gravity": (3.0, 0.0, 9.0), "hot": 110.0}
    assert certify_robot(part, **options)["within"]
    error(part)
    result = certify_robot(part, **options)
    assert not result["within"] and "cases are not** within 1 % of L and 2°" in result["text"]


def test_a_simulation_that_ends_elsewhere_is_not_certified(monkeypatch):
    """The chain at rest is right, but in what users run the TCAs pull harder."""
    part, right = robot(0.0), tca_mj.Simulation.__init__

    def stronger(self, *arguments, **options):
        right(self, *arguments, **options)
        self.gain = 1.1

    monkeypatch.setattr(tca_mj.Simulation, "__init__", stronger)
    result = certify_robot(part)
    assert not result["within"] and result["cases"][1]["gap"]["position"] < 2e-3


def test_bounds_and_pairs():
    """Three TCAs have three pairs, all shown; what is asked for is what is judged by."""
    part = tca_mj.bending_module()
    wide = certify_robot(part, hot=[90.0, 70.0, 60.0], gravity=(0.0, 0.0, 0.0))
    assert [case["hot"] for case in wide["cases"]][4:] == [
        ("tca0", "tca1"), ("tca0", "tca2"), ("tca1", "tca2"), ("tca0", "tca1", "tca2")
    ]  # fmt: skip
    assert wide["cases"][-1]["temperature"] == (90.0, 70.0, 60.0) and wide["within"]
    assert wide["text"].count("| yes |") == 8 and "| all | 0 0 0 |" in wide["text"]
    assert not certify_robot(robot(0.0), hot=100.0, position=1e-5)["within"]


def hinged(part):
    body = part.spec.body("body.piece8").add_body(name="lid", pos=[0.0, 0.0, 5e-3])
    body.add_geom(name="lid", size=[1e-3, 0.0, 0.0])
    body.add_joint(name="hinge")


def floating(part):
    part.spec.worldbody.first_body().add_freejoint(name="root")


def looped(part):
    part.spec.add_equality(
        name="pin", type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1="body.piece8", name2="body.piece3", data=[0.0] * 12,
    )  # fmt: skip


def wired(part):
    tendon = part.spec.add_tendon(name="wire")
    for piece in ("body.piece0", "body.piece8"):
        part.spec.body(piece).add_site(name=f"{piece}.eye")
        tendon.wrap_site(f"{piece}.eye")


def hooked(part):
    """A spring that is fixed in the middle of a chain."""
    tendon = part.spec.add_tendon(name="hook", stiffness=[5.0, 0, 0], springlength=[0.0, 1e-2])
    for piece in ("body.piece0", "body.piece3"):
        part.spec.body(piece).add_site(name=f"{piece}.eye")
        tendon.wrap_site(f"{piece}.eye")


def driven(part):
    part.spec.add_actuator(
        name="motor", trntype=mujoco.mjtTrn.mjTRN_JOINT, target="body.bend_x0"
    )


def limited(part):
    part.spec.joint("body.bend_x2").range = [-0.1, 0.1]
    part.spec.joint("body.bend_x2").limited = 1


def stiff(part):
    part.spec.delete(part.spec.joint("body.twist4"))


def spanned(part):
    other = tca_mj.add_chain(part, SOFT, nodes=4, name="other", pos=(0.05, 0.0, 0.0))
    chain = tca_mj.add_chain(part, SOFT, nodes=4, name="third", pos=(0.1, 0.0, 0.0))
    passes = [Pass(chain, tca_mj.Helix(RADIUS)), Pass(other, tca_mj.Helix(RADIUS), down=True)]
    laid = lay_tca(part.spec, tca_mj.CATALOGUE["free-stroke"], passes, name="bow")
    part.tcas = (*part.tcas, laid)


def forgotten(part):
    """A chain on a bare body, which no TCA runs through."""
    tca_mj.add_chain(part.spec.worldbody, SOFT, nodes=3, name="tail", pos=(0.1, 0.0, 0.0))


def on_the_floor(part):
    part.spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1],
        pos=[0.0, 0.0, 0.04], quat=[0.0, 1.0, 0.0, 0.0],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (hinged, "has the joint 'hinge' in the body 'lid', which is of no chain that it remembers"),
        (floating, "has the free joint 'root' in the body 'body.piece0', which is of no chain"),
        (looped, "has the equality 'pin' of the body 'body.piece8' and the body 'body.piece3'"),
        (wired, "has the tendon 'wire', which is no TCA's"),
        (hooked, "has the spring 'hook', which is not from what stands still to the end of a"),
        (driven, "has the actuator 'motor' on the body 'body.piece1', which is no TCA's"),
        (limited, "limits or dry friction in the joint 'body.bend_x2' of the body 'body.piece3'"),
        (stiff, "has lost the joint 'body.twist4' of the body 'body.piece5'"),
        (spanned, "has the TCA 'bow' span freely from the body 'third.piece4' to 'other.piece4'"),
        (forgotten, "has the joint 'tail.bend_x0' in the body 'tail.piece1', which is of no chain"),
        (on_the_floor, "'robot' has the geom .* of the body .* on the geom .*body"),
    ],
)
def test_what_theory_does_not_cover_is_refused_in_words(change, said):
    part = robot(0.0)
    change(part)
    with pytest.raises(ValueError, match="^part must .*'robot' ") as refused:
        certify_robot(part)
    assert re.search(said, str(refused.value))


def test_other_muscles_spines_and_empty_parts_are_refused(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    import own_actuator

    with pytest.raises(Outside, match="'bending' has the muscle 'muscle0' in the body 'body.piece0"
                                      "', a SmaSpring and no TCA"):  # fmt: skip
        certify_robot(own_actuator.sma_module())
    with pytest.raises(Outside, match="'morphing' has the shape-memory spine 'spine' in the body"):
        certify_robot(morphing_module())
    with pytest.raises(Outside, match="'arm' has the actuator 'lift' on the body 'base', which"):
        certify_robot(tca_mj.arm())
    with pytest.raises(Outside, match="'none' has no chain that it remembers"):
        certify_robot(tca_mj.Part(tca_mj.new_spec("none")))
    bare = tca_mj.Part(tca_mj.new_spec("bare"))
    tca_mj.add_chain(bare, SOFT, nodes=2, name="body")
    with pytest.raises(Outside, match="'bare' has no TCA"):
        certify_robot(bare)


ROBOTS = """
import math
import tca_mj
from tca_mj.modules.bending import silicone_cylinder

def good(nodes=8, tca="free-stroke"):
    part = tca_mj.Part(tca_mj.new_spec("good"))
    soft = silicone_cylinder(45e-3, 8e-3, 8e-3)
    chain = tca_mj.add_chain(part, soft, nodes=nodes, name="body")
    tca_mj.add_tca(part, chain, tca_mj.Helix(3e-3), tca)
    return part

def wrong():
    part = good()
    for joint in part.spec.joints:
        joint.stiffness *= 1.1
    return part

def needy(size):
    return good()

NUMBER, nothing = 3, lambda: None
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder with a robot in it, in which one is."""
    (tmp_path / "robots_here.py").write_text(ROBOTS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    yield tmp_path
    sys.modules.pop("robots_here", None)


def test_the_command_prints_the_table_and_its_exit_code_is_the_verdict(folder, capsys):
    options = ["--hot", "110", "--gravity", "0", "0", "9.81"]
    command = ["certify", "robots_here:good", *options, "--workers", "2", "--out", "seen"]
    assert cli.main(command) == 0
    said = capsys.readouterr().out
    assert "| tca0 | 0 0 9.81 |" in said and "Verdict: all cases are within 1 % of L and 2°" in said
    written = json.loads((folder / "seen" / "report.json").read_text(encoding="utf-8"))
    assert written["within"] and len(written["cases"]) == 4
    assert (folder / "seen" / "report.md").read_text(encoding="utf-8").strip() in said
    assert cli.main(["certify", "robots_here:wrong", *options, "--workers", "1"]) == 1
    assert "**no**" in capsys.readouterr().out
    coarse = ["certify", "robots_here:good", *options, "--workers", "1", "--nodes", "4"]
    assert cli.main([*coarse, "--tolerance", "0.1", "--angle", "0.5"]) == 1
    assert "body of 4 nodes" in capsys.readouterr().out


def test_the_command_gives_the_robot_a_muscle(folder, capsys):
    """Softer sewing thread bends it less: the case is another one, and theory holds for both."""
    write_tca("mine.json", tca_mj.CATALOGUE["type-2-180"])
    bends = []
    for tca in ("mine.json", "self-coiled"):
        command = ["certify", "robots_here:good", "--tca", tca, "--hot", "90", "--out", tca[:4]]
        assert cli.main([*command, "--gravity", "0", "0", "0", "--workers", "1"]) == 0
        written = json.loads((folder / tca[:4] / "report.json").read_text(encoding="utf-8"))
        bends.append(max(case["bend"] for case in written["cases"]))
    assert abs(bends[0] - bends[1]) > 1e-2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere:good"], "robot must be module:function, got 'nowhere:good': No module named"),
        (["robots_here:bad"], "must be module:function, got 'robots_here:bad': module"),
        (["robots_here:needy"], "that is called without arguments, got 'robots_here:needy': needy"),
        (["robots_here:NUMBER"], "that is called without arguments, got 'robots_here:NUMBER': '"),
        (["robots_here:wrong", "--nodes", "9"], "is called with the argument nodes, got 'robots_"),
        (["robots_here:nothing"], "robot must build a Part, got None from 'robots_here:nothing'"),
        (["robots_here:good", "--hot", "10"], "hot must be finite and above 25 °C, got 10"),
        (["robots_here:good", "--hot", "90", "90"], "hot must be one temperature or 1, got"),
        (["robots_here:good", "bending"], "give modules or robots, got robots_here:good bending"),
        (["bending", "--hot", "100"], "--hot is for a robot, module:function"),
    ],
)
def test_what_cannot_be_certified_is_refused_in_words(folder, arguments, said, capsys):
    assert cli.main(["certify", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_robots_built_before_have_their_own_nodes():
    with pytest.raises(ValueError, match="nodes must be None where robot is a Part, got 4"):
        certify_robot(robot(0.0), nodes=4)


def test_strands_and_bases_are_checked():
    strand = {"routes": [tca_mj.Helix(RADIUS)], "strands": ["one"]}
    with pytest.raises(ValueError, match="strands must be 1 different names, one per route"):
        Segment(SOFT, [tca_mj.Helix(RADIUS)], [0.01], strands=["one", "two"])
    with pytest.raises(ValueError, match="strand 'one' must be one in all segments, got 0.01 and"):
        solve_series([Segment(SOFT, tensions=[0.01], **strand),
                      Segment(SOFT, tensions=[0.02], **strand)])  # fmt: skip
    with pytest.raises(ValueError, match=r"base of segments\[1\] must be None, or a whole number"):
        solve_series([Segment(SOFT, [], []), Segment(SOFT, [], [], base=1)], solver="energy")


def test_parts_remember_chains_when_they_are_attached():
    arm = tca_mj.Part(tca_mj.new_spec("arm"))
    arm.spec.worldbody.add_site(name="clamp")
    arm.attach(robot(0.0, 1.0), to="clamp", prefix="left")
    assert list(arm.members) == ["left.body", "left.upper"]
    assert [run.chain.name for tca in arm.tcas for run in tca.runs] == list(arm.members)
    assert certify_robot(arm, hot=90.0, gravity=(0.0, 0.0, 0.0))["within"]
    copied = arm.copy()
    tca_mj.add_chain(copied, SOFT, nodes=2, name="more")
    assert "more" not in arm.members and arm.spec.body("more.piece0") is None
    with pytest.raises(ValueError, match="name must be new among the part's chains"):
        tca_mj.add_chain(copied, SOFT, nodes=2, name="more")
    with pytest.raises(ValueError, match="on must be left out where parent is a body"):
        tca_mj.add_chain(copied.spec.worldbody, SOFT, nodes=2, name="new", on=copied.spec.worldbody)


def test_two_solvers_agree_on_shared_strands():
    """A helix through three bodies, rigid pieces between them, under a load."""
    bodies = [
        Segment(SOFT, [tca_mj.Helix(RADIUS, 0.3, phase), tca_mj.Helix(RADIUS)], [law, 0.01],
                strands=["helix", "own"] if i else ["helix", "first"], mass=1e-4)
        for law in [law_at(tca_mj.CATALOGUE["free-stroke"].of_length(0.14), 110.0)]
        for i, phase in enumerate((0.0, 2.0, 4.0))
    ]  # fmt: skip
    loads = {"tip_force": (1e-3, 2e-3, 0.0), "gravity": (0.0, 0.0, 9.81)}
    one, other = (solve_series(bodies, solver=name, **loads) for name in ("shooting", "energy"))
    for shot, least in zip(one, other, strict=True):
        assert shot.position == pytest.approx(least.position, abs=1e-9)
        assert shot.tca_length == pytest.approx(least.tca_length, abs=1e-10)
