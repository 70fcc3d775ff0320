"""Random actions in sixteen insertions at once, then one by macro actions.

v/bin/python python/examples/random_agent.py [TASK]
"""

from __future__ import annotations

import sys

import gymnasium

import feeler  # noqa: F401  (makes the ids known)


def main(task: str = "plug") -> None:
    vector = gymnasium.make_vec("feeler/Insertion-v0", num_envs=16, vectorization_mode="vector_entry_point", task=task)
    vector.reset(seed=1)
    vector.action_space.seed(1)
    ended = 0
    for _ in range(200):
        _, _, terminated, truncated, infos = vector.step(vector.action_space.sample())
        ended += int((terminated | truncated).sum())
    print(f"{task}: 16 x 200 control steps, {ended} episodes ended, largest force {infos['peak_force_n'].max():.0f} N")
    vector.close()

    env = gymnasium.make("feeler/Insertion-v0", task=task, actions="macro-discrete")
    observation, info = env.reset(seed=1)
    env.action_space.seed(1)
    for number in range(10):
        action = env.action_space.sample()
        observation, reward, terminated, truncated, info = env.step(action)
        print(
            f"{number}: {action} {info['stop_reason']:11s} "
            f"travelled {1000 * observation[32]:6.1f} mm, force {info['action_peak_force_n']:5.1f} N, reward {reward:.0f}"
        )
        if terminated or truncated:
            break
    env.close()


if __name__ == "__main__":
    main(*sys.argv[1:2])
