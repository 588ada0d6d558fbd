"""The certificate: small, held, and not to be held by a chain that is wrong."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tca_mj import cli
from tca_mj.certify import claims, outcomes, report
from tca_mj.certify.cable import cable
from tca_mj.certify.cases import Case, at_rest, draw, gap, theory
from tca_mj.certify.outcomes import Effort, Outcome, judge
from tca_mj.certify.report import within
from tca_mj.certify.rest import Load
from tca_mj.certify.subjects import SUBJECTS
from tca_mj.model import chain
from tca_mj.model.smooth import SmoothBody

G = 9.81
# A hot case of each module: temperatures [°C] and force on the tip [N].
HOT = {
    "bending": ([115.0, 80.0, 25.0], [0.0, 1e-3, 0.0]),
    "twisting": ([120.0], [5e-3, 0.0, 0.0]),
    "twisting-single": ([120.0], [5e-3, 0.0, 0.0]),
    "innervated": ([105.0, 100.0, 25.0], [0.0, 1e-3, 0.0]),
    "finger": ([110.0], [0.0, 0.0, 4e-3]),
    "arm": ([105.0, 60.0, 60.0, 90.0], [0.0, 5e-4, 0.0]),
    "soft-finger": ([140.0], [0.0, 2e-2, 0.0]),
    "bistable-1": ([80.0, 90.0], [1e-2, 0.0, 0.0]),
    "bistable-2": ([25.0, 120.0], [-2e-2, 0.0, 0.0]),
    "morphing": ([110.0], [2e-3, 0.0, 0.0]),
    "morphing-twist": ([130.0], [5e-3, 0.0, 0.0]),
    "morphing-3d": ([120.0, 90.0, 25.0], [0.0, 2e-3, 0.0]),
    "grid-member": ([120.0, 25.0], [0.0, 5e-3, 0.0]),
}


def hot(name):
    subject = SUBJECTS[name]()
    temperature, force = HOT[name]
    sides = [np.ones(3), [-1.0, 1.0, 1.0]] if subject.mirrored else [np.ones(3)]
    load = Load(
        force=np.array([np.multiply(side, force) for side in sides]),
        moment=np.zeros((len(sides), 3)),
        gravity=G * np.array(subject.down),
    )
    return subject, Case(temperature=np.array(temperature), posture="hanging", load=load)


def judged(name, effort=Effort(finer=0, runs=0, solvers=0)):  # noqa: B008
    return judge(*hot(name), number=0, effort=effort)


@pytest.mark.parametrize("name", HOT)
def test_every_module_is_within_a_hundredth_and_two_degrees(name):
    row = judged(name)
    assert within([row]) and row.failure is None and not row.elsewhere
    assert row.gap.strain < 1e-3 and row.gap.position > 1e-6
    assert row.bend > np.radians(1.0)


@pytest.mark.parametrize("name", ["bending", "twisting", "finger"])
def test_twice_the_nodes_leave_a_quarter_of_the_error(name):
    subject, case = hot(name)
    exact = theory(subject, case)
    coarse, fine = (gap(subject, at_rest(subject, case, times), exact) for times in (1, 2))
    assert 3.3 < coarse.position / fine.position < 4.7
    assert 3.3 < coarse.rotation / fine.rotation < 4.7


def test_a_simulation_from_the_cold_ends_at_the_rest_that_was_judged():
    row = judged("bending", Effort(finer=0, runs=1, solvers=1))
    assert row.run.position < 1e-4 and row.velocity < 1e-2
    assert row.solvers < 1e-7


def test_the_chain_that_starts_as_theory_says_ends_where_it_ends_alone():
    for name in ("bending", "finger"):
        subject, case = hot(name)
        apart = gap(subject, at_rest(subject, case, near="shooting"), at_rest(subject, case))
        assert apart.position < 1e-7


def test_without_its_correction_the_chain_is_not_certified(monkeypatch):
    """MuJoCo's own springs and straight tendons: too soft by F h²/4 EI, some per cent."""

    def plain(self, data, strained, tension):
        self._model.jnt_stiffness[self._joint] = self.stiffness.reshape(-1)[self._where]

    monkeypatch.setattr(SmoothBody, "support", plain)
    assert not within([judged("bending")])


def test_a_body_too_stiff_by_a_twentieth_is_seen(monkeypatch):
    """Not by its size, but more nodes do not help."""
    right = chain._add_joint

    def stiff(body, name, motion, stiffness, *rest):
        right(body, name, motion, stiffness * (1.05 if "bend" in motion else 1.0), *rest)

    monkeypatch.setattr(chain, "_add_joint", stiff)
    subject, case = hot("bending")
    exact = theory(subject, case)
    coarse, fine = (gap(subject, at_rest(subject, case, times), exact) for times in (1, 2))
    assert coarse.position / fine.position < 2.0


def test_tcas_that_weigh_nothing_are_seen(monkeypatch):
    """Seven per cent of the bending module's mass; the tip of the lying module tells."""
    subject, case = hot("bending")
    lying = replace(case, load=replace(case.load, gravity=np.array([0.0, -G, 0.0])))
    before = gap(subject, at_rest(subject, lying), theory(subject, lying)).position
    monkeypatch.setattr("tca_mj.model.tendon._add_mass", lambda item, mass: None)
    after = gap(subject, at_rest(subject, lying), theory(subject, lying)).position
    assert after > 2.0 * before


def test_cases_are_those_of_their_seed():
    subject = SUBJECTS["finger"]()
    short, long = draw(subject, "finger", 3, 0), draw(subject, "finger", 5, 0)
    other = draw(subject, "finger", 3, 1)
    for one, same, different in zip(short, long, other, strict=False):
        assert one.temperature == pytest.approx(same.temperature)
        assert one.load.force == pytest.approx(same.load.force)
        assert one.temperature != pytest.approx(different.temperature)
        # Mirrored, so that both fingers have the same share of the TCA.
        assert one.load.force[1] == pytest.approx(one.load.force[0] * [-1.0, 1.0, 1.0])
        assert one.load.moment[1] == pytest.approx(one.load.moment[0] * [1.0, -1.0, -1.0])
        assert np.linalg.norm(one.load.gravity) == pytest.approx(G)
        assert (one.temperature >= 25.0).all() and (one.temperature <= 160.0).all()


def test_a_case_without_an_answer_is_no_pass():
    lost = Outcome(temperature=(25.0,), posture="hanging", force=0.0, moment=0.0, failure="lost")
    assert not within([judged("twisting"), lost])


@pytest.mark.parametrize("group", ["known", "bends", "orders", "helices", "scaling"])
def test_single_claims(group):
    found = list(getattr(claims, group)())
    assert found and [claim for claim in found if claim.held is False] == []


def test_mujocos_own_cable_agrees():
    """Where this MuJoCo has one; its own error is of first order."""
    if cable(4, timestep=1e-3, damping=1e-6) is None:
        pytest.skip("no plugin mujoco.elasticity.cable")
    assert all(claim.held for claim in claims.cables())


def test_the_command_writes_the_certificate(monkeypatch, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(report.certify, "__kwdefaults__", report.certify.__kwdefaults__
                        | {"effort": Effort(2, 1, 0, 1), "workers": 1})  # fmt: skip
    out = tmp_path / "deep"
    assert cli.main(["certify", "twisting", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "## Modules at their default nodes" in said and str(out / "report.md") in said
    assert "![" not in said
    written = (out / "report.md").read_text(encoding="utf-8")
    assert "](accuracy_bend.png)" in written and "Single claims" not in written
    result = json.loads((out / "report.json").read_text(encoding="utf-8"))
    (rows,) = result["modules"].values()
    assert len(rows) == 2 and rows[0]["gap"]["position"] < 0.01 and len(rows[0]["finer"]) == 3
    assert all((out / f"accuracy_{name}.png").stat().st_size > 5000 for name in ("bend", "nodes"))


def test_unknown_modules_are_refused(capsys):
    assert cli.main(["certify", "elbow"]) == 2
    assert "bending, twisting" in capsys.readouterr().err


def test_workers_have_no_influence():
    effort = Effort(cases=2, finer=0, runs=0, solvers=0)
    one, two = (
        outcomes.outcomes(["twisting"], effort=effort, workers=workers)["twisting"]
        for workers in (1, 2)
    )
    assert [replace(row, seconds=0.0) for row in one] == [replace(row, seconds=0.0) for row in two]
