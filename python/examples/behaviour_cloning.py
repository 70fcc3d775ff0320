"""A small learner beside the planner: behaviour cloning in numpy, and PPO where Stable-Baselines3 is installed.

    v/bin/python python/examples/behaviour_cloning.py [--quick] [--episodes 200] [--test 50] [--ppo STEPS]

An expert (the database policy) is recorded at control rate; a network of two hidden layers learns its actions from what is
observed. Then all of them meet the same episodes: same seed, same truth, same limits, judged by the same environment.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from pathlib import Path

import numpy as np

import feeler

CONTROL = {"control_steps": 20, "max_displacement_m": 0.002, "max_turn_rad": 0.01}
EXTENTS = (3, 3, 3)


class Network:
    """Two hidden layers of tanh, trained by Adam (Kingma and Ba 2015) on squared errors; inputs are standardised."""

    def __init__(self, inputs: np.ndarray, outputs: np.ndarray, hidden: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.mean, self.scale = inputs.mean(axis=0), inputs.std(axis=0) + 1e-6
        sizes = [inputs.shape[1], hidden, hidden, outputs.shape[1]]
        self.weights = [rng.normal(0, 1 / np.sqrt(a), (a, b)) for a, b in itertools.pairwise(sizes)]
        self.offsets = [np.zeros(b) for b in sizes[1:]]

    def _layers(self, inputs: np.ndarray) -> list[np.ndarray]:
        layers = [np.clip((inputs - self.mean) / self.scale, -5, 5)]
        for k, (w, b) in enumerate(zip(self.weights, self.offsets, strict=True)):
            values = layers[-1] @ w + b
            layers.append(values if k + 1 == len(self.weights) else np.tanh(values))
        return layers

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        return self._layers(inputs)[-1]

    def train(self, inputs: np.ndarray, outputs: np.ndarray, steps: int, seed: int, rate: float = 2e-3) -> float:
        """The mean squared error of the last tenth of the steps."""
        rng = np.random.default_rng(seed)
        parameters = self.weights + self.offsets
        first = [np.zeros_like(p) for p in parameters]
        second = [np.zeros_like(p) for p in parameters]
        errors = []
        for step in range(1, steps + 1):
            rows = rng.integers(len(inputs), size=256)
            layers = self._layers(inputs[rows])
            error = layers[-1] - outputs[rows]
            errors.append(float(np.mean(error**2)))
            back = 2 * error / len(rows)
            slopes_w, slopes_b = [], []
            for k in reversed(range(len(self.weights))):
                slopes_w.insert(0, layers[k].T @ back)
                slopes_b.insert(0, back.sum(axis=0))
                if k:
                    back = (back @ self.weights[k].T) * (1 - layers[k] ** 2)
            for p, slope, m, v in zip(parameters, slopes_w + slopes_b, first, second, strict=True):
                m += 0.1 * (slope - m)
                v += 0.001 * (slope**2 - v)
                p -= rate * (1 - step / steps) * (m / (1 - 0.9**step)) / (np.sqrt(v / (1 - 0.999**step)) + 1e-8)
        return float(np.mean(errors[-max(1, steps // 10) :]))


def play(act, episodes: int, seed: int) -> dict[str, float]:
    """What a learner does on the episodes of a seed, started at the start pose: inserted, median seconds, largest force."""
    env = feeler.InsertionEnv("plug", **CONTROL)
    inserted, seconds, force = 0, [], []
    for episode in range(episodes):
        observation, info = env.reset(seed=seed, options={"episode": episode, "extents": list(EXTENTS)})
        while info["sim_time_s"] < 20.0:
            observation, _, terminated, truncated, info = env.step(act(observation))
            if terminated or truncated:
                break
        inserted += info["inserted"]
        force.append(info["peak_force_n"])
        if info["inserted"]:
            seconds.append(info["sim_time_s"])
    return {
        "inserted": inserted,
        "seconds": float(np.median(seconds)) if seconds else float("nan"),
        "force": float(np.median(force)),
    }


def row(name: str, episodes: int, result: dict[str, float], training_s: float) -> str:
    return f"{name:20s} {result['inserted']:3.0f} of {episodes}   {result['seconds']:6.2f} s   {result['force']:6.1f} N   {training_s:7.1f} s"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few episodes, little training")
    parser.add_argument("--episodes", type=int, default=200, help="of the expert")
    parser.add_argument("--test", type=int, default=50, help="episodes to be judged by")
    parser.add_argument("--steps", type=int, default=20000, help="of training")
    parser.add_argument("--ppo", type=int, default=0, help="environment steps of PPO (needs feeler[learn])")
    a = parser.parse_args()
    if a.quick:
        a.episodes, a.test, a.steps = 3, 2, 200
    print(f"{'':20s} inserted    median s   median N   training (CPU)")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plug.db"
        start = time.process_time()
        feeler.preprocess("plug", path, [EXTENTS])
        planning_s = time.process_time() - start
        expert = feeler.run("plug", database=path, extents=EXTENTS, episodes=a.test, seed=99)
        result = {"inserted": expert.inserted, "seconds": expert.sim_time_median_s,
                  "force": float(np.median([r.peak_force_n for r in expert.records]))}  # fmt: skip
        print(row("database (planner)", a.test, result, planning_s))
        start = time.process_time()
        data = feeler.export_episodes(
            Path(folder) / "expert.npz", "plug", database=path, extents=EXTENTS, episodes=a.episodes, seed=1
        )
        network = Network(data.observations, data.actions, hidden=128, seed=0)
        error = network.train(data.observations, data.actions.astype(float), a.steps, seed=0)
        training_s = time.process_time() - start
        print(
            row(
                "behaviour cloning",
                a.test,
                play(lambda o: np.clip(network(o[None])[0], -1, 1).astype(np.float32), a.test, 99),
                training_s,
            )
        )
        print(f"  ({a.episodes} expert episodes, {len(data.observations)} rows, mean squared error {error:.4f})")
    if a.ppo:
        from stable_baselines3 import PPO

        env = feeler.InsertionEnv("plug", reward_progress=20.0, reward_per_second=-0.01, **CONTROL)
        start = time.process_time()
        model = PPO("MlpPolicy", env, seed=0, device="cpu").learn(a.ppo)
        training_s = time.process_time() - start
        print(
            row(
                f"PPO, {a.ppo} steps",
                a.test,
                play(lambda o: model.predict(o, deterministic=True)[0], a.test, 99),
                training_s,
            )
        )


if __name__ == "__main__":
    main()
