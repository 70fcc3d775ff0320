// Many environments: feeler.vector.VectorInsertionEnv rests on it.
#include <algorithm>

#include "common.h"
#include "feeler/core/clock.h"
#include "feeler/env/gym/vector_env.h"
#include "simulation.h"

namespace feeler::python {
namespace {

env::AutoResetMode ParseMode(const std::string& name) {
  for (const auto mode :
       {env::AutoResetMode::kNextStep, env::AutoResetMode::kSameStep, env::AutoResetMode::kDisabled}) {
    if (name == env::ToString(mode)) return mode;
  }
  throw InputError("autoreset_mode", "unknown mode \"" + name + "\"", "choose next-step, same-step or disabled");
}

/// env::VectorEnv with flat actions, bounded observations and rewards by progress, as Environment has them.
class Vector {
 public:
  Vector(std::shared_ptr<const env::Scene> scene, const CodecOptions& codec, const env::VectorEnvOptions& options)
      : scene_(std::move(scene)),
        codec_(codec),
        mode_(options.auto_reset),
        vector_(scene_, options),
        n_(static_cast<std::size_t>(options.environments)),
        over_(n_),
        distance_m_(n_),
        target_(n_, Pose::Identity()),
        observations_(n_ * env::kObservationSize),
        rewards_(n_) {
    codec_.Validate(options.env.bounds);
  }

  void Reset(const std::vector<std::uint64_t>& seeds) {
    vector_.Reset(seeds);
    for (std::size_t i = 0; i < n_; ++i) Begun(i);
  }
  void ResetOne(int i, std::optional<std::uint64_t> seed) {
    if (seed) {
      vector_.ResetOne(i, *seed);
    } else {
      vector_.ResetOne(i);
    }
    Begun(static_cast<std::size_t>(i));
  }

  void Step(std::span<const double> values) {
    const std::size_t size = SizeOf(codec_.format);
    if (values.size() != n_ * size) {
      throw InputError("actions",
                       std::to_string(values.size()) + " numbers for " + std::to_string(n_) + " environments",
                       "give " + std::to_string(size) + " each");
    }
    actions_.resize(n_);
    for (std::size_t i = 0; i < n_; ++i) actions_[i] = DecodeFor(i, values.subspan(i * size, size));
    try {
      vector_.Step(actions_);
    } catch (const Error&) {
      if (AnyFailed()) TakeWhatFollowed();
      throw;
    }
    for (std::size_t i = 0; i < n_; ++i) Take(i);
  }

  void Send(const std::vector<int>& environments, std::span<const double> values) {
    const std::size_t size = SizeOf(codec_.format);
    if (values.size() != environments.size() * size) {
      throw InputError(
          "send",
          std::to_string(values.size()) + " numbers for " + std::to_string(environments.size()) + " environments",
          "give " + std::to_string(size) + " each");
    }
    std::vector<env::Action> actions;
    for (std::size_t k = 0; k < environments.size(); ++k) {
      const int i = environments[k];
      if (i < 0 || i >= vector_.size()) {
        throw InputError("send", "no environment " + std::to_string(i), "there are " + std::to_string(n_));
      }
      actions.push_back(DecodeFor(static_cast<std::size_t>(i), values.subspan(k * size, size)));
    }
    for (std::size_t k = 0; k < environments.size(); ++k) vector_.Send(environments[k], actions[k]);
  }
  std::vector<int> Receive(int count) {
    std::vector<int> done = vector_.Receive(count);
    for (const int i : done) Take(static_cast<std::size_t>(i));
    return done;
  }

  bool ended(std::size_t i) const { return vector_.terminated()[i] != 0 || vector_.truncated()[i] != 0; }
  std::size_t size() const { return n_; }
  env::VectorEnv& vector() { return vector_; }
  std::vector<double>& observations() { return observations_; }
  std::vector<double>& rewards() { return rewards_; }
  const std::shared_ptr<const env::Scene>& scene() const { return scene_; }
  env::AutoResetMode mode() const { return mode_; }

 private:
  /// An environment that resets at the next step takes any action.
  env::Action DecodeFor(std::size_t i, std::span<const double> values) {
    if (over_[i] != 0 && mode_ == env::AutoResetMode::kNextStep) return env::LowLevelAction{};
    try {
      return Decode(codec_, values, vector_.environment(static_cast<int>(i)));
    } catch (const InputError& error) {
      throw InputError("environment " + std::to_string(i), error.what());
    }
  }

  bool AnyFailed() const {
    for (std::size_t i = 0; i < n_; ++i) {
      if (!vector_.failure(static_cast<int>(i)).empty()) return true;
    }
    return false;
  }
  /// One environment that does not follow does not keep the others from theirs.
  void TakeWhatFollowed() {
    for (std::size_t i = 0; i < n_; ++i) {
      if (vector_.failure(static_cast<int>(i)).empty()) Take(i);
    }
  }

  void Observe(std::size_t i) {
    const auto row = vector_.observation(static_cast<int>(i));
    const std::span<double> mine(&observations_[i * env::kObservationSize], env::kObservationSize);
    std::copy(row.begin(), row.end(), mine.begin());
    Saturate(mine);
  }
  double Distance(std::size_t i, std::span<const double> observation) {
    return DistanceToGoal(vector_.environment(static_cast<int>(i)), observation, target_[i]);
  }
  /// The environment stands at the start of an episode.
  void Begun(std::size_t i) {
    Observe(i);
    over_[i] = 0;
    rewards_[i] = 0.0;
    target_[i] = vector_.environment(static_cast<int>(i)).robot().world().TargetPose();
    distance_m_[i] = Distance(i, {&observations_[i * env::kObservationSize], env::kObservationSize});
  }
  /// What a step of it gave.
  void Take(std::size_t i) {
    if (over_[i] != 0 && mode_ == env::AutoResetMode::kNextStep) return Begun(i);
    const bool begun = ended(i) && mode_ == env::AutoResetMode::kSameStep;
    double reward = vector_.rewards()[i];
    Observe(i);
    if (codec_.reward_progress != 0.0) {
      std::array<double, env::kObservationSize> last{};
      const auto source =
          begun ? vector_.final_observation(static_cast<int>(i))
                : std::span<const double>(&observations_[i * env::kObservationSize], env::kObservationSize);
      std::copy(source.begin(), source.end(), last.begin());
      Saturate(last);
      const double distance_m = Distance(i, last);
      reward += codec_.reward_progress * (distance_m_[i] - distance_m);
      distance_m_[i] = distance_m;
    }
    if (begun) Begun(i);
    rewards_[i] = reward;
    over_[i] = ended(i) ? 1 : 0;
    if (begun) over_[i] = 0;
  }

  std::shared_ptr<const env::Scene> scene_;
  CodecOptions codec_;
  env::AutoResetMode mode_;
  env::VectorEnv vector_;
  std::size_t n_;
  std::vector<std::uint8_t> over_;  ///< the episode of it is over and has not been followed by another
  std::vector<double> distance_m_;
  std::vector<Pose> target_;
  std::vector<double> observations_, rewards_;
  std::vector<env::Action> actions_;
};

void CopyRows(const Pose& pose, double* to) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) to[4 * row + column] = pose.matrix()(row, column);
  }
}

/// Arrays over all environments, from `info`.
template <class InfoOf>
nb::dict InfoArrays(std::size_t n, const InfoOf& info_of) {
  std::vector<double> sim_time(n), peak(n), action_peak(n), path(n), estimate(16 * n), target(16 * n);
  std::unique_ptr<bool[]> inserted(new bool[n]);
  nb::list stop;
  nb::list reason;
  nb::list detail;
  std::unique_ptr<bool[]> pairs(new bool[n * env::kContactPairCount]);
  bool truth = true;
  for (std::size_t i = 0; i < n; ++i) {
    const env::Info& info = info_of(i);
    sim_time[i] = info.sim_time_s;
    peak[i] = info.peak_force_n;
    action_peak[i] = info.action_peak_force_n;
    path[i] = info.path_length_m;
    inserted[i] = info.inserted;
    for (std::size_t p = 0; p < env::kContactPairCount; ++p)
      pairs[i * env::kContactPairCount + p] = info.contact_pairs[p];
    CopyRows(info.world_T_estimate, estimate.data() + 16 * i);
    if (info.world_T_target) {
      CopyRows(*info.world_T_target, target.data() + 16 * i);
    } else {
      truth = false;
    }
    const auto text = [](std::string_view t) { return nb::str(t.data(), t.size()); };
    stop.append(text(ToString(info.stop_reason)));
    reason.append(text(env::ToString(info.insertion_reason)));
    detail.append(text(info.detail));
  }
  const auto flags = [](std::unique_ptr<bool[]> values, std::vector<std::size_t> shape) {
    bool* data = values.release();
    nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
    return nb::ndarray<nb::numpy, bool>(data, shape.size(), shape.data(), owner);
  };
  nb::dict dict;
  dict["sim_time_s"] = NewArray(std::move(sim_time), {n});
  dict["peak_force_n"] = NewArray(std::move(peak), {n});
  dict["action_peak_force_n"] = NewArray(std::move(action_peak), {n});
  dict["path_length_m"] = NewArray(std::move(path), {n});
  dict["inserted"] = flags(std::move(inserted), {n});
  dict["contact_pairs"] = flags(std::move(pairs), {n, env::kContactPairCount});
  dict["world_T_estimate"] = NewArray(std::move(estimate), {n, 4, 4});
  if (truth) dict["world_T_target"] = NewArray(std::move(target), {n, 4, 4});
  dict["stop_reason"] = stop;
  dict["insertion_reason"] = reason;
  dict["detail"] = detail;
  return dict;
}

template <class T>
nb::ndarray<nb::numpy, T> ViewOf(T* data, std::vector<std::size_t> shape, nb::handle owner) {
  return nb::ndarray<nb::numpy, T>(data, shape.size(), shape.data(), owner);
}

/// CPU seconds of this thread that env::VectorEnv itself takes for `actions` (steps x environments x 6, control
/// format), on one thread, without Python: what the package is measured against.
double TimeVector(std::shared_ptr<const env::Scene> scene, int environments, const nb::dict& options,
                  const DoubleArray& actions, std::uint64_t seed) {
  const CodecOptions codec = CodecFrom(options);
  const std::size_t size = SizeOf(codec.format);
  const std::size_t row = size * static_cast<std::size_t>(environments);
  if (environments < 1 || actions.size() % row != 0) {
    throw InputError("actions", "do not fit the environments", "give (steps, environments, size)");
  }
  env::VectorEnvOptions v;
  v.environments = environments;
  v.env = ToEnvOptions(options, *scene);
  const nb::gil_scoped_release released;
  env::VectorEnv vector(std::move(scene), v);
  std::vector<std::uint64_t> seeds;
  for (int i = 0; i < environments; ++i) seeds.push_back(seed + static_cast<std::uint64_t>(i));
  vector.Reset(seeds);
  std::vector<env::Action> step(static_cast<std::size_t>(environments));
  const double start_s = ThreadCpuSeconds();
  for (std::size_t at = 0; at < actions.size(); at += row) {
    for (std::size_t i = 0; i < step.size(); ++i) {
      step[i] = Decode(codec, {actions.data() + at + i * size, size}, vector.environment(static_cast<int>(i)));
    }
    vector.Step(step);
  }
  return ThreadCpuSeconds() - start_s;
}

}  // namespace

void BindVector(nb::module_& m) {
  m.def("time_vector", &TimeVector, "scene"_a, "environments"_a, "options"_a, "actions"_a, "seed"_a,
        "CPU seconds that the library takes for these steps without Python, on one thread.");
  nb::class_<Vector>(m, "Vector")
      .def(
          "__init__",
          [](Vector* self, std::shared_ptr<const env::Scene> scene, int environments, int threads,
             const std::string& autoreset_mode, const nb::dict& options) {
            env::VectorEnvOptions v;
            v.environments = environments;
            v.threads = Threads(threads, "threads");
            v.auto_reset = ParseMode(autoreset_mode);
            v.env = ToEnvOptions(options, *scene);
            new (self) Vector(std::move(scene), CodecFrom(options), v);
          },
          "scene"_a, "environments"_a, "threads"_a, "autoreset_mode"_a, "options"_a)
      .def("set_options",
           [](Vector& self, const nb::dict& options) { self.vector().SetEpisodeOptions(ToResetOptions(options)); })
      .def("reset", &Vector::Reset, "seeds"_a, nb::call_guard<nb::gil_scoped_release>())
      .def("reset_one", &Vector::ResetOne, "environment"_a, "seed"_a.none(), nb::call_guard<nb::gil_scoped_release>())
      .def(
          "step",
          [](Vector& self, const DoubleArray& actions) {
            const std::span<const double> values(actions.data(), actions.size());
            const nb::gil_scoped_release released;
            self.Step(values);
          },
          "actions"_a)
      .def(
          "send",
          [](Vector& self, const std::vector<int>& environments, const DoubleArray& actions) {
            const std::span<const double> values(actions.data(), actions.size());
            const nb::gil_scoped_release released;
            self.Send(environments, values);
          },
          "environments"_a, "actions"_a)
      .def("receive", &Vector::Receive, "count"_a, nb::call_guard<nb::gil_scoped_release>())
      .def(
          "views",
          [](nb::handle_t<Vector> handle) {
            auto& self = nb::cast<Vector&>(handle);
            const std::size_t n = self.size();
            auto& v = self.vector();
            static_assert(sizeof(bool) == sizeof(std::uint8_t));
            return nb::make_tuple(
                ViewOf(self.observations().data(), {n, env::kObservationSize}, handle),
                ViewOf(self.rewards().data(), {n}, handle),
                ViewOf(reinterpret_cast<bool*>(const_cast<std::uint8_t*>(v.terminated().data())), {n}, handle),
                ViewOf(reinterpret_cast<bool*>(const_cast<std::uint8_t*>(v.truncated().data())), {n}, handle));
          },
          nb::sig("def views(self) -> tuple"),
          "Observations, rewards, terminated, truncated: the buffers themselves, overwritten by the next call.")
      .def("infos",
           [](Vector& self) {
             return InfoArrays(self.size(), [&](std::size_t i) -> const env::Info& {
               return self.vector().info(static_cast<int>(i));
             });
           })
      .def("final_infos",
           [](Vector& self) {
             return InfoArrays(self.size(), [&](std::size_t i) -> const env::Info& {
               return self.vector().final_info(static_cast<int>(i));
             });
           })
      .def(
          "final_observation",
          [](Vector& self, int i) {
            if (i < 0 || i >= self.vector().size())
              throw InputError("final_observation", "no such environment", "count from 0");
            const auto row = self.vector().final_observation(i);
            std::vector<double> values(row.begin(), row.end());
            Saturate(values);
            return NewArray(std::move(values), {env::kObservationSize});
          },
          "environment"_a)
      .def(
          "render",
          [](Vector& self, int i, const std::string& camera) {
            if (i < 0 || i >= self.vector().size()) throw InputError("render", "no such environment", "count from 0");
            env::Image image;
            {
              const nb::gil_scoped_release released;
              image = self.vector().environment(i).Render(ToCamera(camera, *self.scene()));
            }
            return ToArray(image);
          },
          "environment"_a, "camera"_a)
      .def(
          "render_depth",
          [](Vector& self, int i, const std::string& camera) {
            if (i < 0 || i >= self.vector().size()) throw InputError("render", "no such environment", "count from 0");
            env::DepthImage image;
            {
              const nb::gil_scoped_release released;
              image = self.vector().environment(i).RenderDepth(ToCamera(camera, *self.scene()));
            }
            return ToArray(image);
          },
          "environment"_a, "camera"_a)
      .def(
          "episodes",
          [](Vector& self, int i) {
            if (i < 0 || i >= self.vector().size()) throw InputError("episodes", "no such environment", "count from 0");
            return self.vector().episodes(i);
          },
          "environment"_a, "Episodes that it has begun since the last seed.");
}

}  // namespace feeler::python
