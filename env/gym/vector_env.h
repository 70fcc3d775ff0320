#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/gym/spaces.h"

namespace feeler::env {

/// What happens to an environment whose episode is over (Gymnasium's AutoresetMode).
enum class AutoResetMode {
  kNextStep,  ///< the next step of it ignores its action and resets: reward 0, the first observation of the new episode
  kSameStep,  ///< the step that ends the episode resets as well: its observation is the first of the new episode
  kDisabled,  ///< nothing: Reset of it is the caller's business, until then its steps are refused
};
std::string_view ToString(AutoResetMode mode);

struct VectorEnvOptions {
  int environments = 1;
  Parallelism threads;
  AutoResetMode auto_reset = AutoResetMode::kNextStep;
  EnvOptions env;
  /// Of every reset; the episode number in it is set by the vector: environment i plays the episodes i, i + n, i + 2n,
  /// ... of n environments, each with streams of its own.
  ResetOptions episode;
};

/// N environments over one shared scene, stepped by a pool of threads, results in contiguous buffers.
///
/// Two ways to step: `Step` runs an action on every environment and waits for all; `Send` starts an action on one
/// environment and `Receive` waits for some to be done, so that macro actions of different length do not wait for each
/// other. Buffers of an environment are valid while it is idle.
///
/// Laws: environment i does what an InsertionEnv does with the same seeds, bit for bit, whatever the number of threads,
/// the other environments and the order of completion. An action that is not valid throws InputError naming the
/// environment and changes nothing in it, and does not keep the others from theirs; everything stays usable.
///
/// One caller at a time.
class VectorEnv {
 public:
  /// Throws InputError when the options make no sense.
  VectorEnv(std::shared_ptr<const Scene> scene, const VectorEnvOptions& options);
  ~VectorEnv();
  VectorEnv(const VectorEnv&) = delete;
  VectorEnv& operator=(const VectorEnv&) = delete;

  /// Begins with the first episode of each environment. Waits for all that was sent.
  void Reset(std::uint64_t seed);
  /// The same with a seed for each environment: environment i plays the episodes 0, 1, 2, ... of seeds[i], as an
  /// InsertionEnv of its own would. Throws InputError when there are not as many seeds as environments.
  void Reset(std::span<const std::uint64_t> seeds);
  /// Begins the next episode of one idle environment.
  void ResetOne(int environment);
  /// Begins the first episode of a seed of its own in one idle environment; its next are 1, 2, ... of that seed.
  void ResetOne(int environment, std::uint64_t seed);

  /// Of every reset from now on; the episode number in it is ignored. Waits for all that was sent.
  void SetEpisodeOptions(const ResetOptions& episode);

  /// One action per environment, in order. Throws InputError, with nothing done, when one is busy or the number of
  /// actions is wrong. Actions that are refused, and resets that fail, do not block the others: those are carried out
  /// and published, then InputError names the environments that did not follow (`failure`).
  void Step(std::span<const Action> actions);

  /// Starts an action on an idle environment and returns at once.
  void Send(int environment, const Action& action);
  /// Waits until at least `count` sent actions are done, or all of them; the environments that are done, ascending,
  /// each reported once. Throws InputError when nothing was sent, and for the first one that failed (its reset, for
  /// example), naming it: it counts as reported by that; the others that are done are reported by the next call. The
  /// step that ended an episode is published even where the reset after it fails.
  std::vector<int> Receive(int count = 1);

  /// What the last Step was refused or failed with, by environment; empty where it followed.
  const std::string& failure(int environment) const;

  int size() const;
  AutoResetMode auto_reset() const;
  /// size() x kObservationSize, row by row.
  std::span<const double> observations() const;
  std::span<const double> observation(int environment) const;
  std::span<const double> rewards() const;
  std::span<const std::uint8_t> terminated() const;
  std::span<const std::uint8_t> truncated() const;
  const Info& info(int environment) const;
  /// Of the last step that ended an episode of this environment, where the mode replaced it (kSameStep), and in the
  /// other modes as well: size() x kObservationSize.
  std::span<const double> final_observations() const;
  std::span<const double> final_observation(int environment) const;
  const Info& final_info(int environment) const;
  /// Episodes begun by this environment since Reset.
  std::uint64_t episodes(int environment) const;
  /// For rendering and saving; leave it alone while it is busy.
  InsertionEnv& environment(int environment);

 private:
  class Pool;
  struct Slot;
  void Begin(Slot& slot, StepResult& result);
  void BeginAll();
  void Run(Slot& slot);
  void Publish(Slot& slot, const StepResult& result);
  Slot& Idle(int environment);
  [[noreturn]] void ThrowFailure(const Slot& slot, std::size_t others) const;
  void RequireWelcome(const Slot& slot, const Action& action) const;

  VectorEnvOptions options_;
  bool reset_ = false;
  std::vector<std::unique_ptr<Slot>> slots_;
  std::vector<double> observations_, final_observations_, rewards_;
  std::vector<std::uint8_t> terminated_, truncated_;
  std::unique_ptr<Pool> pool_;  ///< last, so that its threads end first
};

}  // namespace feeler::env
