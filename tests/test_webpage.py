"""Pages that replay a rollout: they hold what was simulated, and nothing from elsewhere."""

import base64
import json
import math
import re

import gymnasium as gym
import mujoco
import numpy as np
import pytest

import tca_mj  # noqa: F401  (registers the ids)
from tca_mj import Simulation, bending_module
from tca_mj.record import WebPage
from tca_mj.record.webpage import _box, _round, _triangles


def facts(path):
    (text,) = re.findall(r'<script id="facts".*?>(.*?)</script>', path.read_text("utf-8"), re.S)
    return json.loads(text)


def numbers(text, kind="<i2"):
    return np.frombuffer(base64.b64decode(text), kind)


def test_poses_paths_and_heat_are_those_of_the_simulation(tmp_path):
    sim, path = Simulation(bending_module()), tmp_path / "bend.html"
    kept = []
    with WebPage(sim, path, title="A & B </script>", interval=0.08) as page:
        for _ in range(12):
            page.frame("cold" if sim.time == 0.0 else "heats")
            tips = sim.data.wrap_xpos.reshape(-1, 3)
            first = [tips[sim.data.ten_wrapadr[t]].copy() for t in sim.tendon]
            kept.append((sim.time, sim.data.xpos.copy(), sim.temperature.copy(), first))
            sim.step([1.5, 0.0, 0.0], 0.04)
    found = facts(path)
    kept = kept[::2]  # of every second call
    assert found["times"] == pytest.approx([time for time, *_ in kept])
    low, span = np.array(found["low"]), np.array(found["span"])
    places = low + (numbers(found["positions"]) / 32767.0 + 1.0).reshape(6, -1, 3) / 2.0 * span
    n = found["bodies"]
    assert places.shape == (6, n, 3)
    moving = [b for b in range(sim.model.nbody) if sim.model.body_weldid[b] != 0]
    expected = np.array([xpos[moving] for _, xpos, *_ in kept])
    assert np.abs(places[:, -len(moving) :] - expected).max() < span.max() / 60e3
    turns = numbers(found["turns"]).reshape(6, n, 4) / 32767.0
    assert np.linalg.norm(turns, axis=-1) == pytest.approx(1.0, abs=1e-4)
    heat = np.array([heat for _, _, heat, _ in kept])
    assert np.array(found["heat"]) == pytest.approx(heat, abs=0.06)
    ways = low + (numbers(found["ways"]) / 32767.0 + 1.0).reshape(-1, 3) / 2.0 * span
    at = 0
    for counts, (*_, first) in zip(found["counts"], kept, strict=True):
        for count, point in zip(counts, first, strict=True):
            assert np.abs(ways[at] - point).max() < span.max() / 60e3
            at += count
    assert at == len(ways) and found["labels"] == ["cold"] + ["heats"] * 5
    text = path.read_text("utf-8")
    assert "<h1>A &amp; B &lt;/script&gt;</h1>" in text
    assert not re.search(r"https?://|<link|src=|import\(|fetch\(", text)


def closed(points, faces):
    """Volume [m^3] that triangles enclose, and whether all of them look outward."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.einsum("ni,ni->", a, np.cross(b, c))) / 6.0


@pytest.mark.parametrize(
    ("made", "volume"),
    [
        (_box(np.array([1.0, 2.0, 3.0])), 48.0),
        (_round(0.5, 2.0, ends=False), 4.0 * math.pi * 0.25),
        (_round(0.5, 2.0, ends=True), 4.0 * math.pi * 0.25 + 4.0 / 3.0 * math.pi * 0.125),
    ],
    ids=["box", "cylinder", "capsule"],
)
def test_geoms_are_closed_and_look_outward(made, volume):
    """A round geom of 14 corners lacks 3.3 % of its section, and some of its caps."""
    points, normals, faces = made
    assert closed(points, faces) == pytest.approx(volume, rel=0.06)
    assert closed(points, faces) <= volume * (1.0 + 1e-12)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    middle = points[faces].mean(axis=1)
    a, b, c = (points[faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    size = np.linalg.norm(flat, axis=1)
    real = size > 1e-9
    mean = normals[faces].mean(axis=1)
    assert (np.einsum("ni,ni->n", flat, mean)[real] > 0.0).all()
    assert (np.einsum("ni,ni->n", flat, middle)[real] > 0.0).all()


def test_a_mesh_is_drawn_with_its_own_faces():
    vertices = "0 0 0  1 0 0  0 1 0  0 0 1"
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><asset><mesh name="m" vertex="{vertices}"/></asset>'
        '<worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>'
    )
    points, _, faces = _triangles(model, 0)
    assert closed(points, faces) == pytest.approx(1.0 / 6.0)


def test_what_has_diverged_is_shown_and_a_page_without_frames_is_not_written(tmp_path):
    sim = Simulation(bending_module())
    with WebPage(sim, tmp_path / "page.html") as page:
        page.frame()
        sim.data.xpos[:] = np.nan
        sim.data.time += 1.0
        page.frame()
    assert np.isfinite(facts(tmp_path / "page.html")["low"]).all()
    WebPage(sim, tmp_path / "empty.html").close()
    assert not (tmp_path / "empty.html").exists()
    with pytest.raises(RuntimeError, match="is closed"):
        page.frame()
    with pytest.raises(ValueError, match=r"path must end in .html"):
        WebPage(sim, tmp_path / "page.htm")
    with pytest.raises(ValueError, match="interval must be finite and above 0"):
        WebPage(sim, tmp_path / "page.html", interval=0.0)


@pytest.mark.parametrize("id", ["TCA/TetrapodWalk-v0", "TCA/Grasp-v0", "TCA/ArmPickPlace-v0"])
def test_robots_have_a_page(id, tmp_path):
    env = gym.make(id, disable_env_checker=True)
    env.reset(seed=0)
    with WebPage(env.unwrapped.sim, tmp_path / "page.html") as page:
        page.frame()
    found = facts(tmp_path / "page.html")
    assert sum(mesh["count"] for mesh in found["meshes"]) > 300
    assert len(found["heat"][0]) == env.unwrapped.sim.n
    assert (tmp_path / "page.html").stat().st_size < 3e6
