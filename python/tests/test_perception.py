"""Laws of perception: what is found lies where the target is; a cloud that is the picture's says the same; readings that are
none (0, NaN, infinity) are left out; bad input is an exception of one sentence.
"""

from __future__ import annotations

import numpy as np
import pytest

import feeler


@pytest.fixture(scope="module")
def finder():
    return feeler.PosePerception("plug")


@pytest.fixture(scope="module")
def seen(finder):
    return finder.look(seed=3)


def cloud_of(seen):
    """The points of the target in the world, by the pinhole camera."""
    v, u = np.nonzero((seen.depth > 0) & (np.abs(seen.depth - seen.background) > 0.003))
    z, c = seen.depth[v, u].astype(float), seen.camera
    points = np.stack([(u - c["cx"]) / c["fx"] * z, (v - c["cy"]) / c["fy"] * z, z], axis=1)
    pose = c["world_T_camera"]
    return points @ pose[:3, :3].T + pose[:3, 3], pose[:3, 3]


def test_the_target_is_found_where_it_is(finder, seen):
    found = finder.depth(seen.depth, seen.camera, seen.background)
    assert found.found and np.abs(found.world_T_target - seen.world_T_target)[:3, 3].max() < 0.01
    again = feeler.perceive("plug", depth=seen.depth, camera=seen.camera, background=seen.background)
    assert np.array_equal(again.world_T_target, found.world_T_target)
    assert found.covariance.shape[0] == found.covariance.shape[1] and np.isfinite(found.covariance).all()


def test_a_cloud_says_what_its_picture_says(finder, seen):
    points, eye_m = cloud_of(seen)
    found = finder.cloud(points, eye_m)
    assert found.found and np.abs(found.world_T_target - seen.world_T_target)[:3, 3].max() < 0.01


def test_looks_are_seeded(finder, seen):
    assert np.array_equal(finder.look(seed=3).depth, seen.depth)
    assert not np.array_equal(finder.look(seed=3, episode=1).depth, seen.depth)


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -1.0])
def test_readings_that_are_none_are_left_out(finder, seen, nothing):
    mask = np.random.default_rng(1).random(seen.depth.shape) < 0.1
    zero, odd = seen.depth.copy(), seen.depth.copy()
    zero[mask], odd[mask] = 0.0, nothing
    expected = finder.depth(zero, seen.camera, seen.background)
    assert expected.found
    assert np.array_equal(finder.depth(odd, seen.camera, seen.background).world_T_target, expected.world_T_target)


def test_nothing_to_see_is_said(finder, seen):
    found = finder.depth(seen.background, seen.camera, seen.background)
    assert not found.found and found.reason
    assert not finder.cloud(np.zeros((0, 3)), [0, 0, 1]).found


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda f, s: f.depth(s.depth[None], s.camera), "shape"),
        (lambda f, s: f.depth(s.depth.astype(complex), s.camera), "complex"),
        (lambda f, s: f.depth(s.depth, {}), "fx"),
        (lambda f, s: f.depth(s.depth, None), "camera: NoneType"),
        (lambda f, s: f.depth(s.depth, {**s.camera, "fy": 0.0}), "fy"),
        (lambda f, s: f.depth(s.depth, {**s.camera, "cx": float("nan")}), "cx"),
        (lambda f, s: f.depth(s.depth, {**s.camera, "world_T_camera": np.zeros((4, 4))}), "rigid"),
        (lambda f, s: f.depth(s.depth, s.camera, s.background[:10]), "background|size"),
        (lambda f, s: f.cloud(np.zeros((5, 2)), [0, 0, 1]), "shape"),
        (lambda f, s: f.cloud(np.zeros((5, 3)), [0, 0]), "eye_m"),
        (lambda f, s: f.cloud(np.zeros((5, 3)), [0, 0, np.nan]), "eye_m"),
        (lambda f, s: f.look(seed=-1), "seed: int"),
        (lambda f, s: feeler.PosePerception("plug", "no-such-table.json"), "no-such-table"),
        (lambda f, s: feeler.perceive("plug"), "either"),
        (lambda f, s: feeler.perceive("plug", depth=s.depth), "camera"),
        (lambda f, s: feeler.perceive("plug", cloud=np.zeros((5, 3))), "eye_m"),
    ],
)
def test_bad_input_is_one_sentence(finder, seen, call, what):
    with pytest.raises(feeler.InputError, match=what) as caught:
        call(finder, seen)
    assert "\n" not in str(caught.value)
