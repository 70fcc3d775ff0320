// One environment: feeler.env.InsertionEnv rests on it.
#include "simulation.h"

#include <map>
#include <mutex>

#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene_cameras.h"
#include "feeler/env/vision/renderer.h"

namespace feeler::python {
namespace {

void RequireKnown(const nb::dict& options, std::initializer_list<const char*> known) {
  for (const auto& [key, value] : options) {
    const std::string name = nb::str(key).c_str();
    bool found = false;
    std::string list;
    for (const char* k : known) {
      found = found || name == k;
      list += (list.empty() ? "" : ", ") + std::string(k);
    }
    if (!found) throw InputError("options", "unknown key \"" + name + "\"", "choose from " + list);
  }
}

/// An environment with what Gymnasium adds: flat actions, the reward by progress, and the calls since the reset, which
/// say it all again to another process.
class Environment {
 public:
  Environment(std::shared_ptr<const env::Scene> scene, const CodecOptions& codec, const env::EnvOptions& options)
      : scene_(std::move(scene)), codec_(codec), env_(scene_, options) {
    codec_.Validate(options.bounds);
  }

  struct Answer {
    std::vector<double> observation;
    double reward;
    bool terminated;
    bool truncated;
    env::Info info;
  };

  Answer Reset(std::uint64_t seed, const env::ResetOptions& options) {
    history_.clear();
    replayable_ = true;
    Answer answer = ToAnswer(env_.Reset(seed, options));
    distance_m_ = Distance(answer);
    return answer;
  }

  Answer Step(std::span<const double> values) {
    Answer answer = ToAnswer(env_.Step(Decode(codec_, values, env_)));
    history_.insert(history_.end(), values.begin(), values.end());
    if (codec_.reward_progress != 0.0) {
      const double distance_m = Distance(answer);
      answer.reward += codec_.reward_progress * (distance_m_ - distance_m);
      distance_m_ = distance_m;
    }
    return answer;
  }

  struct Saved {
    env::EnvState state;
    double distance_m;
    std::vector<double> history;
    bool replayable;
  };
  Saved Save() const { return {env_.Save(), distance_m_, history_, replayable_}; }
  void Restore(const Saved& saved) {
    env_.Restore(saved.state);
    distance_m_ = saved.distance_m;
    history_ = saved.history;
    replayable_ = saved.replayable;
  }

  env::InsertionEnv& env() { return env_; }
  const std::shared_ptr<const env::Scene>& scene() const { return scene_; }
  const std::vector<double>& history() const { return history_; }
  bool replayable() const { return replayable_; }
  env::SimulatedRobot& Robot() {
    replayable_ = false;  // what is done with it is in no history
    return env_.robot();
  }

 private:
  double Distance(const Answer& answer) const {
    return DistanceToGoal(env_, answer.observation, env_.robot().world().TargetPose());
  }
  static Answer ToAnswer(const env::StepResult& result) {
    Answer answer{std::vector<double>(env::kObservationSize), result.reward, result.terminated, result.truncated,
                  result.info};
    env::Flatten(result.observation, answer.observation);
    Saturate(answer.observation);
    return answer;
  }

  std::shared_ptr<const env::Scene> scene_;
  CodecOptions codec_;
  env::InsertionEnv env_;
  double distance_m_ = 0.0;
  std::vector<double> history_;  ///< actions since the reset, one after the other
  bool replayable_ = false;
};

nb::tuple ToTuple(Environment::Answer&& answer) {
  return nb::make_tuple(NewArray(std::move(answer.observation), {env::kObservationSize}), answer.reward,
                        answer.terminated, answer.truncated, InfoDict(answer.info));
}

}  // namespace

CodecOptions CodecFrom(const nb::dict& options) {
  CodecOptions codec;
  codec.format = ParseFormat(Take<std::string>(options, "actions").value_or("control"));
  if (const auto v = Take<int>(options, "control_steps")) codec.control_steps = *v;
  if (const auto v = Take<double>(options, "max_displacement_m")) codec.max_displacement_m = *v;
  if (const auto v = Take<double>(options, "max_turn_rad")) codec.max_turn_rad = *v;
  if (const auto v = Take<double>(options, "reward_progress")) codec.reward_progress = *v;
  return codec;
}

nb::dict InfoDict(const env::Info& info) {
  nb::dict pairs;
  for (int i = 0; i < env::kContactPairCount; ++i) {
    const std::string_view name = env::ToString(static_cast<env::ContactPair>(i));
    pairs[nb::str(name.data(), name.size())] = info.contact_pairs[static_cast<std::size_t>(i)];
  }
  const auto text = [](std::string_view t) { return nb::str(t.data(), t.size()); };
  nb::dict dict;
  dict["contact_pairs"] = pairs;
  dict["stop_reason"] = text(ToString(info.stop_reason));
  dict["detail"] = text(info.detail);
  dict["action_peak_force_n"] = info.action_peak_force_n;
  dict["peak_force_n"] = info.peak_force_n;
  dict["sim_time_s"] = info.sim_time_s;
  dict["path_length_m"] = info.path_length_m;
  dict["world_T_estimate"] = Eigen::Matrix4d(info.world_T_estimate.matrix());
  if (info.world_T_target) dict["world_T_target"] = Eigen::Matrix4d(info.world_T_target->matrix());
  dict["inserted"] = info.inserted;
  dict["is_success"] = info.inserted;
  dict["insertion_reason"] = text(env::ToString(info.insertion_reason));
  return dict;
}

env::EnvOptions ToEnvOptions(const nb::dict& options, const env::Scene& scene) {
  env::EnvOptions result;
  if (const auto v = Take<double>(options, "time_limit_s")) {
    if (!(*v > 0.0 && *v <= 1e6)) throw InputError("time_limit_s", "is " + std::to_string(*v), "give more than 0");
    result.limits = env::LimitsOf(scene);
    result.limits->time_s = *v;
  }
  if (const auto v = Take<double>(options, "reward_per_second")) result.reward_per_second = *v;
  result.renderer.width = Take<int>(options, "width").value_or(640);
  result.renderer.height = Take<int>(options, "height").value_or(480);
  result.renderer.samples = Take<int>(options, "samples").value_or(0);
  result.renderer.shadows = Take<bool>(options, "shadows").value_or(false);
  if (result.renderer.width < 1 || result.renderer.height < 1 || result.renderer.width > 8192 ||
      result.renderer.height > 8192) {
    throw InputError("width, height", "not a size of a picture", "give 1 to 8192 pixels");
  }
  return result;
}

env::ResetOptions ToResetOptions(const nb::dict& options) {
  RequireKnown(options, {"episode", "estimate", "target", "extents", "hypotheses", "noise", "start",
                         "withhold_true_pose", "randomize"});
  env::ResetOptions reset;
  if (const auto v = Take<std::uint64_t>(options, "episode")) reset.episode = *v;
  if (const auto v = Take<Eigen::Matrix4d>(options, "estimate")) reset.world_T_estimate = ToPose(*v, "estimate");
  if (const auto v = Take<Eigen::Matrix4d>(options, "target")) reset.world_T_target = ToPose(*v, "target");
  if (const auto v = Take<std::vector<int>>(options, "extents")) reset.extents = *v;
  if (const auto v = Take<std::vector<Eigen::Matrix4d>>(options, "hypotheses")) {
    for (const Eigen::Matrix4d& pose : *v) reset.hypotheses.push_back(ToPose(pose, "hypotheses"));
  }
  if (const auto start = Take<std::string>(options, "start")) {
    if (*start != "start" && *start != "home")
      throw InputError("start", "unknown place \"" + *start + "\"", "choose start or home");
    reset.start = *start == "home" ? env::StartPlace::kHome : env::StartPlace::kStartPose;
  }
  if (const auto v = Take<bool>(options, "withhold_true_pose")) reset.withhold_true_pose = *v;
  if (const auto v = Take<bool>(options, "randomize")) reset.randomize = *v;
  if (!options.contains("noise") || options["noise"].is_none()) return reset;
  std::string preset;
  if (nb::try_cast(options["noise"], preset)) {
    reset.noise = env::NoisePreset(preset);
    return reset;
  }
  nb::dict noise;
  if (!nb::try_cast(options["noise"], noise)) throw InputError("noise", "has the wrong type", "give a name or a dict");
  RequireKnown(noise, {"joint_friction_nm", "force_noise_n", "torque_noise_nm", "force_bias_n", "force_delay_s",
                       "force_quantum_n", "force_offset_n", "payload_error_kg", "false_stops_per_m", "missed_contact",
                       "spent_step", "step_m", "encoder_noise_rad", "encoder_jitter_rad", "joint_stiffness_nm_rad",
                       "contact_threshold_n"});
  env::NoiseOptions& n = reset.noise;
  n.name = "custom";
  if (const auto v = Take<env::JointVector>(noise, "joint_friction_nm")) n.joint_friction_nm = *v;
  if (const auto v = Take<Eigen::Vector3d>(noise, "force_offset_n")) n.force_offset_n = *v;
  for (const auto& [key, field] :
       std::initializer_list<std::pair<const char*, double*>>{{"force_noise_n", &n.force_noise_n},
                                                              {"torque_noise_nm", &n.torque_noise_nm},
                                                              {"force_bias_n", &n.force_bias_n},
                                                              {"force_delay_s", &n.force_delay_s},
                                                              {"force_quantum_n", &n.force_quantum_n},
                                                              {"payload_error_kg", &n.payload_error_kg},
                                                              {"false_stops_per_m", &n.false_stops_per_m},
                                                              {"missed_contact", &n.missed_contact},
                                                              {"spent_step", &n.spent_step},
                                                              {"step_m", &n.step_m},
                                                              {"encoder_noise_rad", &n.encoder_noise_rad},
                                                              {"encoder_jitter_rad", &n.encoder_jitter_rad},
                                                              {"joint_stiffness_nm_rad", &n.joint_stiffness_nm_rad},
                                                              {"contact_threshold_n", &n.contact_threshold_n}}) {
    if (const auto v = Take<double>(noise, key)) *field = *v;
  }
  return reset;
}

nb::object ToArray(const env::Image& image) {
  return nb::cast(NewArray(std::vector<std::uint8_t>(image.rgb),
                           {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width), 3}));
}
nb::object ToArray(const env::DepthImage& image) {
  return nb::cast(NewArray(std::vector<float>(image.depth_m),
                           {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width)}));
}

env::Camera ToCamera(const std::string& name, const env::Scene& scene) {
  if (name == "overview") return env::OverviewCamera(scene);
  if (name == "close-up") return env::CloseUpCamera(scene);
  return env::NamedCamera{name};
}

std::shared_ptr<const env::Scene> MakeScene(const std::string& task) {
  return std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask(task)));
}

void BindSimulation(nb::module_& m) {
  m.def("list_tasks", &env::ListTasks, "Names of the shipped tasks, sorted.");
  m.def("noise_presets", &env::NoisePresetNames, "Names that the reset option `noise` takes.");
  m.def(
      "observation_space",
      [] {
        nb::list list;
        const auto& components = env::ObservationSpace().components;
        for (std::size_t i = 0; i < components.size(); ++i) {
          list.append(
              nb::make_tuple(components[i].name, components[i].unit, ObservationLow()[i], ObservationHigh()[i]));
        }
        return list;
      },
      "Name, unit, low and high of each number of an observation.");
  m.def(
      "action_size", [](const std::string& format) { return SizeOf(ParseFormat(format)); }, "actions"_a);

  nb::class_<env::Scene>(m, "Scene", "The compiled world of a task; immutable, shared by environments.")
      .def_prop_ro(
          "xml", [](const env::Scene& s) { return s.xml; }, "The assembled MJCF.")
      .def_prop_ro("task_name", [](const env::Scene& s) { return s.task.name; })
      .def_prop_ro("time_step_s", [](const env::Scene& s) { return s.model->opt.timestep; });
  m.def("make_scene", &MakeScene, "task"_a, nb::call_guard<nb::gil_scoped_release>(),
        "Compiles the scene of a task (a name or a path). Raises InputError naming file, element and field.");

  nb::class_<Environment::Saved>(m, "EnvironmentState", "The whole state of an environment between steps.");
  nb::class_<Environment>(m, "Environment")
      .def(
          "__init__",
          [](Environment* self, std::shared_ptr<const env::Scene> scene, const nb::dict& options) {
            const env::EnvOptions env_options = ToEnvOptions(options, *scene);
            new (self) Environment(std::move(scene), CodecFrom(options), env_options);
          },
          "scene"_a, "options"_a)
      .def(
          "reset",
          [](Environment& self, std::uint64_t seed, std::uint64_t episode, const nb::dict& options) {
            env::ResetOptions reset = ToResetOptions(options);
            if (!options.contains("episode")) reset.episode = episode;
            Environment::Answer answer;
            {
              const nb::gil_scoped_release released;
              answer = self.Reset(seed, reset);
            }
            return ToTuple(std::move(answer));
          },
          "seed"_a, "episode"_a, "options"_a)
      .def(
          "step",
          [](Environment& self, const DoubleArray& action) {
            const std::span<const double> values(action.data(), action.size());
            Environment::Answer answer;
            {
              const nb::gil_scoped_release released;
              answer = self.Step(values);
            }
            return ToTuple(std::move(answer));
          },
          "action"_a)
      .def("save", &Environment::Save)
      .def("restore", &Environment::Restore, "state"_a)
      .def(
          "render",
          [](Environment& self, const std::string& camera) {
            env::Image image;
            {
              const nb::gil_scoped_release released;
              image = self.env().Render(ToCamera(camera, *self.scene()));
            }
            return ToArray(image);
          },
          "camera"_a)
      .def(
          "render_depth",
          [](Environment& self, const std::string& camera) {
            env::DepthImage image;
            {
              const nb::gil_scoped_release released;
              image = self.env().RenderDepth(ToCamera(camera, *self.scene()));
            }
            return ToArray(image);
          },
          "camera"_a)
      .def_prop_ro(
          "history",
          [](const Environment& self) {
            return NewArray(std::vector<double>(self.history()), {self.history().size()});
          },
          "The actions since the reset, one after the other.")
      .def_prop_ro("replayable", &Environment::replayable)
      .def_prop_ro("running", [](Environment& self) { return self.env().running(); })
      .def_prop_ro("world_T_estimate",
                   [](Environment& self) { return Eigen::Matrix4d(self.env().world_T_estimate().matrix()); })
      .def_prop_ro("time_limit_s", [](Environment& self) { return self.env().limits().time_s; })
      .def_prop_ro(
          "robot", [](Environment& self) -> env::SimulatedRobot& { return self.Robot(); },
          nb::rv_policy::reference_internal, "The arm itself; what it does is part of no history.")
      .def(
          "judge",
          [](Environment& self) {
            const env::InsertionVerdict v = self.env().Judge();
            nb::dict dict;
            dict["inserted"] = v.inserted;
            const std::string_view reason = env::ToString(v.reason);
            dict["reason"] = nb::str(reason.data(), reason.size());
            dict["depth_m"] = v.depth_m;
            dict["lateral_m"] = v.lateral_m;
            dict["angle_rad"] = v.angle_rad;
            return dict;
          },
          "The truth of the present instant.");
}

}  // namespace feeler::python
