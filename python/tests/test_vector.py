"""Laws of the vector environment: environment i does what a single one does with seed s + i, bit for bit, for any number
of threads and in every mode of resetting; arrays are fresh, or views where that was asked for; bad input changes nothing.
"""

from __future__ import annotations

import os

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import feeler

NATIVE = {"vectorization_mode": "vector_entry_point"}


def make(n=3, mode=AutoresetMode.NEXT_STEP, name="feeler/Plug-v0", **kwargs):
    return gymnasium.make_vec(name, num_envs=n, autoreset_mode=mode, **kwargs, **NATIVE)


def rows(seed, n, steps, size=6):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, n, size)).astype(np.float32)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("threads", [1, 3])
def test_same_bits_as_single_environments(mode, threads):
    kwargs = {"reward_progress": 2.0, "time_limit_s": 0.5}
    vector = make(3, mode, threads=threads, **kwargs)
    single = SyncVectorEnv([lambda: feeler.InsertionEnv("plug", **kwargs)] * 3, autoreset_mode=mode)
    a, b = vector.reset(seed=11)[0], single.reset(seed=11)[0]
    assert np.array_equal(a, b)
    actions = rows(1, 3, 60)
    actions[:, :, 2] = -np.abs(actions[:, :, 2])  # downwards, to where contact is
    ended = 0
    for action in actions:
        got, expected = vector.step(action), single.step(action)
        for x, y in zip(got[:4], expected[:4], strict=True):
            assert np.array_equal(x, y)
        over = got[2] | got[3]
        ended += int(over.sum())
        if mode == AutoresetMode.SAME_STEP and over.any():
            for i in np.flatnonzero(over):
                assert np.array_equal(got[4]["final_obs"][i], expected[4]["final_obs"][i])
            assert np.array_equal(got[4]["_final_obs"], over)
            assert np.array_equal(
                got[4]["final_info"]["peak_force_n"][over], expected[4]["final_info"]["peak_force_n"][over]
            )
    assert ended > 0


def test_disabled_mode_resets_by_mask():
    vector = make(3, AutoresetMode.DISABLED, control_steps=100, time_limit_s=0.3)
    vector.reset(seed=1)
    still = np.zeros((3, 6), dtype=np.float32)
    while True:
        _, _, terminated, truncated, _ = vector.step(still)
        if (terminated | truncated).all():
            break
    with pytest.raises(feeler.InputError, match="reset"):
        vector.step(still)
    mask = np.array([True, False, True])
    before = vector._views[0][1].copy()
    observation, _ = vector.reset(options={"reset_mask": mask})
    assert np.array_equal(observation[1], before)
    one = feeler.InsertionEnv("plug")
    assert np.array_equal(observation[2], one.reset(seed=3, options={"episode": 1})[0])
    vector.reset(options={"reset_mask": ~mask})
    vector.step(still)


def test_seeds_of_a_sequence_and_options():
    vector = make(2)
    a = vector.reset(seed=[5, 9], options={"extents": [2, 2, 2]})[0]
    one = feeler.InsertionEnv("plug")
    for row, seed in zip(a, (5, 9), strict=True):
        assert np.array_equal(row, one.reset(seed=seed, options={"extents": [2, 2, 2]})[0])


def test_arrays_are_fresh_or_views_as_declared():
    fresh, views = make(2), make(2, copy=False)
    for vector, same in ((fresh, False), (views, True)):
        vector.reset(seed=1)
        first = vector.step(rows(0, 2, 1)[0])
        kept = first[0].copy()
        second = vector.step(rows(1, 2, 1)[0])
        assert np.shares_memory(first[0], second[0]) is same
        assert np.array_equal(first[0], kept) is not same
        assert second[0].flags.c_contiguous


def test_macro_actions_do_not_wait_for_each_other():
    vector = make(4, name="feeler/PlugMacro-v0", threads=2)
    vector.reset(seed=2)
    actions = rows(3, 4, 1, 8)[0]
    vector.send(actions)
    seen = {}
    while len(seen) < 4:
        done, observations, rewards, terminated, _truncated = vector.recv(1)
        assert set(done).isdisjoint(seen) and len(observations) == len(rewards) == len(done) == len(terminated)
        seen.update(zip(done.tolist(), observations, strict=True))
    for i in range(4):
        one = feeler.InsertionEnv("plug", actions="macro")
        one.reset(seed=2 + i)
        assert np.array_equal(seen[i], one.step(actions[i])[0])
    with pytest.raises(feeler.InputError, match="nothing was sent"):
        vector.recv()
    vector.send(actions[:1], [2])
    with pytest.raises(feeler.InputError, match="busy"):
        vector.send(actions[:1], [2])
    vector.recv()


def test_spaces_contain_what_comes():
    vector = make(2)
    assert vector.observation_space.contains(vector.reset(seed=1)[0])
    dictionary = make(2, observations="dict")
    assert dictionary.observation_space.contains(dictionary.reset(seed=1)[0])
    discrete = make(2, name="feeler/PlugMacroDiscrete-v0")
    discrete.reset(seed=1)
    discrete.action_space.seed(1)
    assert discrete.observation_space.contains(discrete.step(discrete.action_space.sample())[0])


@pytest.mark.parametrize(
    "actions",
    [np.zeros((3, 6)), np.zeros((2, 5)), np.full((2, 6), np.nan), np.full((2, 6), 2.0), None, "x"],
    ids=range(6),
)
def test_bad_actions_change_nothing(actions):
    vector, clean = make(2), make(2)
    vector.reset(seed=1), clean.reset(seed=1)
    with pytest.raises(feeler.InputError):
        vector.step(actions)
    good = rows(0, 2, 1)[0]
    assert np.array_equal(vector.step(good)[0], clean.step(good)[0])


def test_bad_arguments_and_life_after_close():
    for kwargs, what in [
        ({"threads": 1, "autoreset_mode": "later"}, "later"),
        ({"render_mode": "human"}, "one environment"),
        ({"threads": 0}, "threads"),
    ]:
        with pytest.raises(feeler.InputError, match=what):
            feeler.VectorInsertionEnv(2, **kwargs)
    with pytest.raises(feeler.InputError, match="num_envs"):
        feeler.VectorInsertionEnv(0)
    vector = make(2)
    with pytest.raises(feeler.InputError, match="reset"):
        vector.step(np.zeros((2, 6)))
    with pytest.raises(feeler.InputError, match="seed"):
        vector.reset(seed=[1])
    with pytest.raises(feeler.InputError, match="reset_mask"):
        vector.reset(seed=1, options={"reset_mask": np.array([1, 0])})
    vector.close()
    vector.close()
    with pytest.raises(feeler.InputError, match="closed"):
        vector.core.infos()


def test_a_fork_is_refused_and_the_parent_lives():
    vector = make(2, threads=2)
    vector.reset(seed=1)
    pid = os.fork()
    if pid == 0:
        try:
            vector.step(np.zeros((2, 6)))
        except feeler.InputError as error:
            os._exit(0 if "fork" in str(error) else 1)
        os._exit(2)
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
    vector.step(np.zeros((2, 6)))
