"""Laws that hold for every id, single and vector: environment i of a vector does what a single one does with seed s + i; a
reset with a seed erases the past; every observation lies in the space; flags are booleans that say when to reset; what
was returned stays; threads of Python change nothing.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np
import pytest

from feeler import registration

NATIVE = {"vectorization_mode": "vector_entry_point"}


@pytest.mark.parametrize("name", registration.ids())
def test_vector_and_single_are_the_same_bits(name):
    vector = gymnasium.make_vec(name, num_envs=2, threads=2, **NATIVE)
    singles = [gymnasium.make(name).unwrapped for _ in range(2)]
    assert vector.single_observation_space == singles[0].observation_space
    assert vector.single_action_space == singles[0].action_space
    first, _ = vector.reset(seed=7)
    kept = first.copy()
    for i, env in enumerate(singles):
        assert np.array_equal(first[i], env.reset(seed=7 + i)[0])
    vector.action_space.seed(7)
    over = np.zeros(2, dtype=bool)
    for _ in range(3):
        actions = vector.action_space.sample()
        got = vector.step(actions)
        assert vector.observation_space.contains(got[0])
        assert got[2].dtype == got[3].dtype == np.bool_
        for i, env in enumerate(singles):
            if over[i]:
                expected = (env.reset()[0], 0.0, False, False)
            else:
                expected = env.step(actions[i])[:4]
            assert np.array_equal(got[0][i], expected[0])
            assert (got[1][i], bool(got[2][i]), bool(got[3][i])) == tuple(expected[1:])
        over = got[2] | got[3]
    assert np.array_equal(first, kept)
    assert np.array_equal(vector.reset(seed=7)[0], kept)
    vector.close()


def test_threads_of_python_change_nothing():
    def play(seed):
        env = gymnasium.make("feeler/PlugMacro-v0").unwrapped
        env.action_space.seed(seed)
        trace = [env.reset(seed=seed)[0]]
        for _ in range(4):
            observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
            trace.append(observation)
            if terminated or truncated:
                break
        return trace

    alone = [play(seed) for seed in range(4)]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(play, range(4)))
    for a, b in zip(alone, together, strict=True):
        assert len(a) == len(b) and all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
