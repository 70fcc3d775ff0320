#include "feeler/env/gym/vector_env.h"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::env {

/// One environment with what it was asked to do.
struct VectorEnv::Slot {
  enum class State : std::uint8_t { kIdle, kBusy, kDone };
  Slot(int number, std::shared_ptr<const Scene> scene, const EnvOptions& options)
      : index(number), env(std::move(scene), options) {}

  void Fail(const char* what, bool input) {
    failure = what;
    input_error = input;
  }

  int index;
  InsertionEnv env;
  std::uint64_t episodes = 0;
  std::uint64_t seed = 0;
  std::uint64_t first = 0, stride = 1;  ///< which episodes of the seed
  bool over = false;                    ///< the episode; next-step mode then resets at the next action
  Action action;
  Info info, final_info;
  std::string failure;         ///< of the last step; names the environment
  bool input_error = true;     ///< what kind of error it was
  State state = State::kIdle;  ///< guarded by the pool's mutex
};

/// Threads that work off a queue of slots. With one thread the caller does the work itself.
class VectorEnv::Pool {
 public:
  Pool(int threads, std::function<void(Slot&)> run) : run_(std::move(run)) {
    for (int i = 0; i < threads; ++i) {
      threads_.emplace_back([this](const std::stop_token& stop) { Work(stop); });
    }
  }

  void Post(std::span<Slot* const> slots) {
    {
      const std::lock_guard lock(mutex_);
      for (Slot* slot : slots) {
        slot->state = Slot::State::kBusy;
        queue_.push_back(slot);
      }
      pending_ += slots.size();
    }
    if (slots.size() == 1) {
      posted_.notify_one();
    } else {
      posted_.notify_all();
    }
  }

  /// Helps with the work until `count` slots are done, or all that were posted.
  void Wait(std::size_t count) {
    std::unique_lock lock(mutex_);
    const std::size_t goal = pending_ - std::min(count, pending_);
    while (pending_ > goal) {
      if (queue_.empty()) {
        finished_.wait(lock);
      } else {
        RunNext(lock);
      }
    }
  }

  /// Takes one slot that is done and failed, if there is one.
  Slot* CollectFailed(const std::vector<std::unique_ptr<Slot>>& slots) {
    const std::lock_guard lock(mutex_);
    for (const auto& slot : slots) {
      if (slot->state != Slot::State::kDone || slot->failure.empty()) continue;
      slot->state = Slot::State::kIdle;
      return slot.get();
    }
    return nullptr;
  }

  /// Takes the slots that are done, in the order of their numbers.
  std::vector<Slot*> Collect(const std::vector<std::unique_ptr<Slot>>& slots) {
    const std::lock_guard lock(mutex_);
    std::vector<Slot*> done;
    for (const auto& slot : slots) {
      if (slot->state != Slot::State::kDone) continue;
      slot->state = Slot::State::kIdle;
      done.push_back(slot.get());
    }
    return done;
  }

  bool IsIdle(const Slot& slot) {
    const std::lock_guard lock(mutex_);
    return slot.state == Slot::State::kIdle;
  }

  bool AnySent(const std::vector<std::unique_ptr<Slot>>& slots) {
    const std::lock_guard lock(mutex_);
    return std::any_of(slots.begin(), slots.end(), [](const auto& slot) { return slot->state != Slot::State::kIdle; });
  }

  /// How many of those sent have not been collected, whether done or not.
  std::size_t Finished(const std::vector<std::unique_ptr<Slot>>& slots) {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(
        std::count_if(slots.begin(), slots.end(), [](const auto& slot) { return slot->state == Slot::State::kDone; }));
  }

 private:
  void RunNext(std::unique_lock<std::mutex>& lock) {
    Slot* slot = queue_.front();
    queue_.pop_front();
    lock.unlock();
    run_(*slot);
    lock.lock();
    slot->state = Slot::State::kDone;
    --pending_;
    finished_.notify_one();
  }

  void Work(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (posted_.wait(lock, stop, [this] { return !queue_.empty(); })) RunNext(lock);
  }

  std::function<void(Slot&)> run_;
  std::mutex mutex_;
  std::condition_variable_any posted_;
  std::condition_variable finished_;
  std::deque<Slot*> queue_;
  std::size_t pending_ = 0;  ///< posted and not finished
  std::vector<std::jthread> threads_;
};

namespace {

std::span<const double> Row(const std::vector<double>& buffer, int row) {
  return std::span(buffer).subspan(static_cast<std::size_t>(row) * kObservationSize, kObservationSize);
}

std::span<double> Row(std::vector<double>& buffer, int row) {
  return std::span(buffer).subspan(static_cast<std::size_t>(row) * kObservationSize, kObservationSize);
}

}  // namespace

std::string_view ToString(AutoResetMode mode) {
  switch (mode) {
    case AutoResetMode::kNextStep: return "next-step";
    case AutoResetMode::kSameStep: return "same-step";
    case AutoResetMode::kDisabled: return "disabled";
  }
  return "";
}

VectorEnv::VectorEnv(std::shared_ptr<const Scene> scene, const VectorEnvOptions& options) : options_(options) {
  if (options.environments < 1) {
    throw InputError("vector environment", fmt::format("{} environments", options.environments), "give one or more");
  }
  const auto n = static_cast<std::size_t>(options.environments);
  for (int i = 0; i < options.environments; ++i) slots_.push_back(std::make_unique<Slot>(i, scene, options.env));
  observations_.resize(n * kObservationSize);
  final_observations_.resize(n * kObservationSize);
  rewards_.resize(n);
  terminated_.resize(n);
  truncated_.resize(n);
  // The caller is one of the threads.
  pool_ = std::make_unique<Pool>(std::min(options.threads.threads(), options.environments) - 1,
                                 [this](Slot& slot) { Run(slot); });
}

VectorEnv::~VectorEnv() {
  if (pool_) pool_->Wait(slots_.size());
}

void VectorEnv::Begin(Slot& slot, StepResult& result) {
  ResetOptions episode = options_.episode;
  episode.episode = slot.first + slot.episodes * slot.stride;
  ++slot.episodes;
  slot.over = true;  // until there is an episode: after a reset that failed the next one is tried
  result = slot.env.Reset(slot.seed, episode);
  slot.over = false;
}

void VectorEnv::Publish(Slot& slot, const StepResult& result) {
  const auto i = static_cast<std::size_t>(slot.index);
  Flatten(result.observation, Row(observations_, slot.index));
  rewards_[i] = result.reward;
  terminated_[i] = result.terminated;
  truncated_[i] = result.truncated;
  slot.info = result.info;
}

// On a thread of the pool. Touches nothing but the slot and its rows.
void VectorEnv::Run(Slot& slot) {
  slot.failure.clear();
  try {
    StepResult result;
    if (slot.over && options_.auto_reset == AutoResetMode::kNextStep) {
      Begin(slot, result);
      Publish(slot, result);
      return;
    }
    result = slot.env.Step(slot.action);
    slot.over = result.terminated || result.truncated;
    Publish(slot, result);  // whatever becomes of the reset
    if (!slot.over) return;
    Flatten(result.observation, Row(final_observations_, slot.index));
    slot.final_info = result.info;
    if (options_.auto_reset != AutoResetMode::kSameStep) return;
    StepResult first;
    Begin(slot, first);
    result.observation = first.observation;
    result.info = first.info;
    Publish(slot, result);
  } catch (const InputError& error) {
    slot.Fail(error.what(), true);
  } catch (const std::exception& error) {
    slot.Fail(error.what(), false);
  }
}

void VectorEnv::ThrowFailure(const Slot& slot, std::size_t others) const {
  const std::string what = slot.failure + (others == 0 ? "" : fmt::format("; and {} more environments failed", others));
  const std::string where = fmt::format("environment {}", slot.index);
  if (slot.input_error) throw InputError(where, what, "mend that one: the others go on");
  throw WorldError(where, what, "reset that one: the others go on");
}

void VectorEnv::BeginAll() {
  reset_ = true;
  std::vector<const Slot*> failed;
  for (const auto& slot : slots_) {
    slot->episodes = 0;
    slot->failure.clear();
    try {
      StepResult result;
      Begin(*slot, result);
      Publish(*slot, result);
    } catch (const InputError& error) {
      slot->Fail(error.what(), true);
      failed.push_back(slot.get());
    } catch (const std::exception& error) {
      slot->Fail(error.what(), false);
      failed.push_back(slot.get());
    }
  }
  if (!failed.empty()) ThrowFailure(*failed.front(), failed.size() - 1);
}

void VectorEnv::Reset(std::uint64_t seed) {
  pool_->Wait(slots_.size());
  pool_->Collect(slots_);
  for (const auto& slot : slots_) {
    slot->seed = seed;
    slot->first = static_cast<std::uint64_t>(slot->index);
    slot->stride = slots_.size();
  }
  BeginAll();
}

void VectorEnv::Reset(std::span<const std::uint64_t> seeds) {
  if (seeds.size() != slots_.size()) {
    throw InputError("vector environment", fmt::format("{} seeds for {} environments", seeds.size(), slots_.size()),
                     "give one each");
  }
  pool_->Wait(slots_.size());
  pool_->Collect(slots_);
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    slots_[i]->seed = seeds[i];
    slots_[i]->first = 0;
    slots_[i]->stride = 1;
  }
  BeginAll();
}

void VectorEnv::ResetOne(int environment) {
  Slot& slot = Idle(environment);
  if (!reset_) throw InputError("vector environment", "no seed", "call Reset first");
  StepResult result;
  Begin(slot, result);
  Publish(slot, result);
}

void VectorEnv::ResetOne(int environment, std::uint64_t seed) {
  Slot& slot = Idle(environment);
  slot.seed = seed;
  slot.first = 0;
  slot.stride = 1;
  slot.episodes = 0;
  reset_ = true;
  StepResult result;
  Begin(slot, result);
  Publish(slot, result);
}

void VectorEnv::SetEpisodeOptions(const ResetOptions& episode) {
  pool_->Wait(slots_.size());
  options_.episode = episode;
}

VectorEnv::Slot& VectorEnv::Idle(int environment) {
  if (environment < 0 || environment >= size()) {
    throw InputError("vector environment", fmt::format("no environment {}", environment),
                     fmt::format("there are {}", size()));
  }
  Slot& slot = *slots_[static_cast<std::size_t>(environment)];
  if (!pool_->IsIdle(slot)) {
    throw InputError("vector environment", fmt::format("environment {} is busy", environment), "receive it first");
  }
  return slot;
}

void VectorEnv::RequireWelcome(const Slot& slot, const Action& action) const {
  if (slot.over && options_.auto_reset == AutoResetMode::kNextStep) return;
  slot.env.RequireWelcome(action);
}

void VectorEnv::Step(std::span<const Action> actions) {
  if (actions.size() != slots_.size()) {
    throw InputError("vector environment", fmt::format("{} actions for {} environments", actions.size(), slots_.size()),
                     "give one each");
  }
  for (int i = 0; i < size(); ++i) Idle(i);
  std::vector<Slot*> welcome;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    Slot& slot = *slots_[i];
    slot.failure.clear();
    try {
      RequireWelcome(slot, actions[i]);
      slot.action = actions[i];
      welcome.push_back(&slot);
    } catch (const InputError& error) {
      slot.Fail(error.what(), true);
    }
  }
  if (!welcome.empty()) {
    pool_->Post(welcome);
    pool_->Wait(welcome.size());
    pool_->Collect(slots_);
  }
  std::vector<const Slot*> failed;
  for (const auto& slot : slots_) {
    if (!slot->failure.empty()) failed.push_back(slot.get());
  }
  if (!failed.empty()) ThrowFailure(*failed.front(), failed.size() - 1);
}

void VectorEnv::Send(int environment, const Action& action) {
  Slot& slot = Idle(environment);
  try {
    RequireWelcome(slot, action);
  } catch (const InputError& error) {
    throw InputError(fmt::format("environment {}", environment), error.what(), "see the message of the environment");
  }
  slot.action = action;
  Slot* one = &slot;
  pool_->Post({&one, 1});
}

std::vector<int> VectorEnv::Receive(int count) {
  if (!pool_->AnySent(slots_)) throw InputError("vector environment", "nothing was sent", "call Send first");
  const std::size_t done = pool_->Finished(slots_);
  const auto wanted = static_cast<std::size_t>(std::max(count, 1));
  if (wanted > done) pool_->Wait(wanted - done);
  if (const Slot* failed = pool_->CollectFailed(slots_)) ThrowFailure(*failed, 0);
  std::vector<int> environments;
  for (const Slot* slot : pool_->Collect(slots_)) environments.push_back(slot->index);
  return environments;
}

const std::string& VectorEnv::failure(int environment) const {
  return slots_.at(static_cast<std::size_t>(environment))->failure;
}

int VectorEnv::size() const { return static_cast<int>(slots_.size()); }
AutoResetMode VectorEnv::auto_reset() const { return options_.auto_reset; }
std::span<const double> VectorEnv::observations() const { return observations_; }
std::span<const double> VectorEnv::observation(int environment) const { return Row(observations_, environment); }
std::span<const double> VectorEnv::rewards() const { return rewards_; }
std::span<const std::uint8_t> VectorEnv::terminated() const { return terminated_; }
std::span<const std::uint8_t> VectorEnv::truncated() const { return truncated_; }
const Info& VectorEnv::info(int environment) const { return slots_.at(static_cast<std::size_t>(environment))->info; }
std::span<const double> VectorEnv::final_observations() const { return final_observations_; }
std::span<const double> VectorEnv::final_observation(int environment) const {
  return Row(final_observations_, environment);
}
const Info& VectorEnv::final_info(int environment) const {
  return slots_.at(static_cast<std::size_t>(environment))->final_info;
}
std::uint64_t VectorEnv::episodes(int environment) const {
  return slots_.at(static_cast<std::size_t>(environment))->episodes;
}
InsertionEnv& VectorEnv::environment(int environment) { return slots_.at(static_cast<std::size_t>(environment))->env; }

}  // namespace feeler::env
