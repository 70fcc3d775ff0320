"""Laws of the single environment, over every id:

- Gymnasium's checker has nothing to say.
- Same seed and options, same episode, bit for bit, whatever ran before; a reset erases the past.
- Every observation lies in the space, whose bounds are all finite.
- `terminated` and `truncated` are independent; after either, a step is refused until the reset.
- What was returned never changes afterwards; copies and pickles go on bit for bit.
- Bad input is an exception of one sentence and changes nothing.
"""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import feeler
from feeler import registration

IDS = registration.ids()
QUICK = ["feeler/Plug-v0", "feeler/PlugMacro-v0", "feeler/PlugMacroDiscrete-v0"]


def play(env, seed, steps=8, options=None):
    """Observations, rewards and flags of an episode of seeded actions, as far as it goes."""
    observation, _ = env.reset(seed=seed, options=options)
    trace = [observation]
    env.action_space.seed(seed)
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        trace += [observation, reward, terminated, truncated, info["sim_time_s"], info["peak_force_n"]]
        if terminated or truncated:
            break
    return trace


def same(a, b):
    return len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def test_every_shipped_task_has_its_ids():
    assert "feeler/Plug-v0" in IDS and "feeler/PlugMacro-v0" in IDS and "feeler/Insertion-v0" in IDS
    assert len(IDS) == 1 + 3 * len(feeler.list_tasks())


@pytest.mark.parametrize("name", IDS)
def test_checker_is_content(name):
    env = gymnasium.make(name).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.parametrize("name", IDS)
def test_observations_lie_in_a_finite_space(name):
    env = gymnasium.make(name)
    assert np.isfinite(env.observation_space.low).all() and np.isfinite(env.observation_space.high).all()
    assert env.observation_space.dtype == np.float64
    trace = play(env, seed=3, steps=4)
    assert all(env.observation_space.contains(o) for o in trace if isinstance(o, np.ndarray))
    env.close()


@pytest.mark.parametrize("name", QUICK)
def test_a_reset_erases_the_past(name):
    env, fresh = gymnasium.make(name), gymnasium.make(name)
    first = play(env, seed=5)
    play(env, seed=6, steps=3)
    assert same(first, play(env, seed=5))
    assert same(first, play(fresh, seed=5))
    assert not same(first, play(env, seed=6))


def test_reset_without_seed_goes_on_to_the_next_episode():
    env, other = gymnasium.make("feeler/Plug-v0").unwrapped, gymnasium.make("feeler/Plug-v0").unwrapped
    _, first = env.reset(seed=4)
    _, second = env.reset()
    _, jumped = other.reset(seed=4, options={"episode": 1})
    assert np.array_equal(second["world_T_target"], jumped["world_T_target"])
    assert not np.array_equal(first["world_T_target"], second["world_T_target"])


@pytest.mark.parametrize("name", QUICK)
def test_copies_and_pickles_go_on_bit_for_bit(name):
    env = gymnasium.make(name).unwrapped
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(6)]
    env.reset(seed=9)
    for action in actions[:3]:
        env.step(action)
    twins = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    for action in actions[3:]:
        expected = env.step(action)
        for twin in twins:
            got = twin.step(action)
            assert np.array_equal(expected[0], got[0]) and expected[1:4] == got[1:4]
    for twin in twins:
        expected_reset, got_reset = env.reset(), twin.reset()
        assert np.array_equal(expected_reset[0], got_reset[0])
        env.restore(twin.save())


def test_save_and_restore():
    env = gymnasium.make("feeler/Plug-v0").unwrapped
    env.reset(seed=2)
    env.step(np.full(6, 0.5, dtype=np.float32))
    state = env.save()
    action = np.array([0, 0, -1, 0, 0, 0.5], dtype=np.float32)
    ahead = [env.step(action)[0] for _ in range(3)]
    env.restore(state)
    assert same(ahead, [env.step(action)[0] for _ in range(3)])
    other = gymnasium.make("feeler/RoundPeg-v0").unwrapped
    other.reset(seed=1)
    with pytest.raises(feeler.InputError, match="model"):
        other.restore(state)


def test_what_was_returned_stays():
    env = gymnasium.make("feeler/Plug-v0", observations="dict").unwrapped
    observation, _ = env.reset(seed=1)
    kept = copy.deepcopy(observation)
    env.step(np.ones(6, dtype=np.float32))
    assert all(np.array_equal(kept[key], observation[key]) for key in kept)


def test_dict_observations_are_the_flat_ones():
    flat = gymnasium.make("feeler/Plug-v0").unwrapped.reset(seed=1)[0]
    env = gymnasium.make("feeler/Plug-v0", observations="dict").unwrapped
    parts = env.reset(seed=1)[0]
    assert np.array_equal(flat, np.concatenate(list(parts.values()))) and env.observation_space.contains(parts)


def test_insertion_pays_and_ends_the_episode():
    env = gymnasium.make("feeler/PlugMacro-v0", reward_progress=1.0).unwrapped
    env.reset(seed=0)
    _, info = env.reset(seed=0, options={"target": env.core.world_T_estimate})
    half_extents = feeler.load_task("plug").start_offset_m
    insert = np.array([0, 0, 1, 0, 0, 0, 1, 0], dtype=np.float32)
    down = np.array([1, 0, 0, 0, 0, -1, 2 * (half_extents[2] - 0.004 - 0.0005) / 0.0995 - 1, 1], dtype=np.float32)
    _, reward, terminated, truncated, info = env.step(down)
    assert not terminated and not truncated and info["stop_reason"] == "reached" and 0 < reward < 1
    _, reward, terminated, truncated, info = env.step(insert)
    assert info["inserted"] and terminated and not truncated and reward > 1
    with pytest.raises(feeler.InputError, match="no episode"):
        env.step(insert)
    env.reset()
    env.step(insert)


def test_time_limit_truncates_and_does_not_terminate():
    env = gymnasium.make("feeler/Plug-v0", control_steps=100, time_limit_s=2.0).unwrapped
    env.reset(seed=1)
    still = np.zeros(6, dtype=np.float32)
    for _ in range(21):
        _, reward, terminated, truncated, info = env.step(still)
        if truncated:
            break
    assert truncated and not terminated and reward == 0 and info["sim_time_s"] >= env.core.time_limit_s


def test_options_of_the_reset():
    env = gymnasium.make("feeler/Plug-v0").unwrapped
    estimate = env.core.world_T_estimate if env.reset(seed=1) else None
    moved = estimate.copy()
    moved[0, 3] += 0.01
    _, info = env.reset(seed=1, options={"estimate": moved, "target": moved, "start": "home"})
    assert np.array_equal(info["world_T_estimate"], moved) and np.array_equal(info["world_T_target"], moved)
    _, info = env.reset(seed=1, options={"withhold_true_pose": True})
    assert "world_T_target" not in info
    _, info = env.reset(seed=1, options={"extents": [1, 1, 1]})
    assert np.abs(info["world_T_target"][:3, 3] - estimate[:3, 3]).max() <= 0.001 + 1e-12
    _, info = env.reset(seed=1, options={"hypotheses": [moved]})
    assert np.allclose(info["world_T_target"], moved)
    a = env.reset(seed=1, options={"noise": {"encoder_noise_rad": 1e-3}})[0]
    b = env.reset(seed=1)[0]
    assert not np.array_equal(a[:6], b[:6])


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"nonsense": 1}, "unknown key"),
        ({"estimate": np.eye(3)}, "wrong type"),
        ({"estimate": np.full((4, 4), np.nan)}, "rigid"),
        ({"extents": [1, 1]}, "extents"),
        ({"extents": "many"}, "wrong type"),
        ({"extents": [None, 1, 1]}, "wrong type"),
        ({"episode": "first"}, "episode"),
        ({"episode": -1}, "episode"),
        ({"noise": "loud"}, "loud"),
        ({"noise": {"force_noise_n": -1.0}}, "force_noise"),
        ({"noise": {"volume": 1.0}}, "unknown key"),
        ({"start": "nowhere"}, "unknown place"),
        ({"hypotheses": [np.zeros((4, 4))]}, "rigid"),
        ("none", "dict"),
    ],
)
def test_bad_options_are_refused(options, what):
    env = gymnasium.make("feeler/Plug-v0").unwrapped
    with pytest.raises(feeler.InputError, match=what):
        env.reset(seed=1, options=options)
    env.reset(seed=1)


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        ({"task": None}, "task: is of type NoneType"),
        ({"control_steps": None}, "control_steps: is None"),
        ({"control_steps": 2.5}, "control_steps: is 2.5"),
        ({"control_steps": 0}, "control_steps"),
        ({"width": "wide"}, "width: is 'wide'"),
        ({"cameras": 3}, "cameras: are of type int"),
        ({"max_displacement_m": float("nan")}, "max_displacement_m: is nan"),
        ({"time_limit_s": "long"}, "time_limit_s"),
    ],
)
def test_bad_arguments_are_one_sentence(arguments, what):
    for make in (feeler.InsertionEnv, feeler.VectorInsertionEnv):
        with pytest.raises(feeler.InputError, match=what) as caught:
            make(**arguments)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("seed", [-1, 2**64, 1.5, "one", True])
def test_bad_seeds_are_refused(seed):
    with pytest.raises(feeler.InputError, match="seed"):
        gymnasium.make("feeler/Plug-v0").unwrapped.reset(seed=seed)


BAD_ACTIONS = [
    np.zeros(5),
    np.zeros((1, 6)),
    np.array([np.nan, 0, 0, 0, 0, 0]),
    np.array([1.5, 0, 0, 0, 0, 0]),
    np.array([np.inf, 0, 0, 0, 0, 0]),
    np.array(["0"] * 6),
    np.zeros(6, dtype=complex),
    None,
    "down",
    [[0, 1], [2]],
]


@pytest.mark.parametrize("action", BAD_ACTIONS, ids=range(len(BAD_ACTIONS)))
def test_bad_actions_are_refused_and_change_nothing(action):
    env, clean = gymnasium.make("feeler/Plug-v0").unwrapped, gymnasium.make("feeler/Plug-v0").unwrapped
    env.reset(seed=1), clean.reset(seed=1)
    with pytest.raises(feeler.InputError) as caught:
        env.step(action)
    assert "\n" not in str(caught.value)
    good = np.full(6, 0.1, dtype=np.float32)
    assert np.array_equal(env.step(good)[0], clean.step(good)[0])


@pytest.mark.parametrize("action", [[8, 0, 0], [0, 5, 0], [0, 0, -1], [0.5, 0, 0]])
def test_bad_discrete_actions_are_refused(action):
    env = gymnasium.make("feeler/PlugMacroDiscrete-v0").unwrapped
    env.reset(seed=1)
    with pytest.raises(feeler.InputError, match="action"):
        env.step(np.array(action))


def test_life_before_reset_and_after_close():
    env = gymnasium.make("feeler/Plug-v0").unwrapped
    with pytest.raises(feeler.InputError, match="reset"):
        env.step(np.zeros(6))
    env.close()
    env.close()
    for call in (env.reset, lambda: env.step(np.zeros(6)), env.save):
        with pytest.raises(feeler.InputError, match="closed"):
            call()


@pytest.mark.parametrize(
    ("kwargs", "what"),
    [
        ({"task": "no-such-task"}, "no-such-task"),
        ({"task": 3}, "type int"),
        ({"actions": "jump"}, "jump"),
        ({"observations": "nothing"}, "nothing"),
        ({"cameras": "third"}, "third"),
        ({"control_steps": 0}, "control_steps"),
        ({"max_displacement_m": 1.0}, "max_displacement_m"),
        ({"max_turn_rad": float("nan")}, "max_turn_rad"),
        ({"render_mode": "ascii"}, "ascii"),
        ({"time_limit_s": -1.0}, "time_limit_s"),
        ({"width": 0}, "size of a picture"),
    ],
)
def test_bad_arguments_are_refused(kwargs, what):
    with pytest.raises(feeler.InputError, match=what):
        feeler.InsertionEnv(**kwargs)


def test_a_task_file_with_an_error_names_it(tmp_path):
    path = tmp_path / "broken.xml"
    path.write_text("<mujoco><worldbody></worldbody></mujoco>")
    with pytest.raises(feeler.InputError, match=r"broken\.xml"):
        feeler.InsertionEnv(task=path)


def test_pictures():
    env = gymnasium.make("feeler/Plug-v0", render_mode="rgb_array", width=96, height=64, cameras="wrist").unwrapped
    observation, _ = env.reset(seed=1)
    assert observation["image_wrist"].shape == (64, 96, 3) and env.observation_space.contains(observation)
    picture = env.render()
    assert picture.shape == (64, 96, 3) and picture.dtype == np.uint8 and picture.std() > 1
    depth = feeler.InsertionEnv("plug", render_mode="depth_array", width=96, height=64)
    depth.reset(seed=1)
    assert depth.render().shape == (64, 96) and depth.render().dtype == np.float32 and depth.render().min() > 0


def test_a_window_needs_a_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    env = gymnasium.make("feeler/Plug-v0", render_mode="human", width=96, height=64).unwrapped
    with pytest.raises(feeler.InputError, match="display"):
        env.reset(seed=1)


@pytest.mark.parametrize("name", IDS)
def test_checker_of_learners(name):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gymnasium.make(name).unwrapped, skip_render_check=True)


def test_import_loads_little():
    code = "import sys, feeler; print([m for m in ('pandas', 'torch', 'feeler.vector', 'feeler._evaluation') if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
