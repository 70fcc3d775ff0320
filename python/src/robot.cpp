// Robots and policies that are written in Python, and the simulated robot for Python.
#include "robot.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "feeler/env/model/task_pieces.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/execution/executor.h"
#include "feeler/policies/database_policy.h"
#include "planner.h"

namespace feeler::python {
namespace {

StopReason ParseReason(const std::string& name) {
  for (const auto reason : {StopReason::kReached, StopReason::kContact, StopReason::kForceLimit, StopReason::kTimeLimit,
                            StopReason::kUnplanned, StopReason::kAborted}) {
    if (ToString(reason) == name) return reason;
  }
  throw InputError("reason", "unknown name \"" + name + "\"",
                   "choose reached, contact, force limit, time limit, unplanned or aborted");
}

/// Calls Python with the lock held. What it raises is kept; the library is told by an InputError, which it passes on.
template <class Call>
auto Ask(const std::shared_ptr<Raised>& raised, const char* who, const char* method, Call&& call) {
  if (raised->stop != nullptr && raised->stop->cancelled()) throw InputError(who, "was stopped");
  const nb::gil_scoped_acquire acquired;
  try {
    return call();
  } catch (const nb::cast_error&) {
    try {
      throw InputError(std::string(who) + "." + method, "returned something else than it promises",
                       "see its documentation");
    } catch (...) {
      raised->Keep();
      throw;
    }
  } catch (...) {
    raised->Keep();
    throw InputError(std::string(who) + "." + method, "raised an exception");
  }
}

MotionResult Checked(MotionResult result) {
  if (!std::isfinite(result.travelled_m) || !std::isfinite(result.peak_force_n) ||
      !result.world_T_tool.matrix().allFinite()) {
    throw InputError("robot", "a motion returned numbers that are not finite", "give finite travel, force and pose");
  }
  ToPose(result.world_T_tool.matrix(), "robot");
  return result;
}

Eigen::Matrix4d M(const Pose& pose) { return pose.matrix(); }

class PythonRobot final : public Robot {
 public:
  PythonRobot(nb::object object, std::shared_ptr<Raised> raised)
      : object_(std::move(object)), raised_(std::move(raised)) {}

  Pose ToolPose() const override {
    return Ask(raised_, "robot", "tool_pose",
               [&] { return ToPose(nb::cast<Eigen::Matrix4d>(Attr("tool_pose")()), "robot.tool_pose"); });
  }
  Wrench ContactWrench() const override {
    return Ask(raised_, "robot", "contact_wrench", [&] {
      const auto w = nb::cast<Eigen::Matrix<double, 6, 1>>(Attr("contact_wrench")());
      if (!w.allFinite()) throw InputError("robot.contact_wrench", "is not finite", "give 6 finite numbers");
      return Wrench{w.head<3>(), w.tail<3>()};
    });
  }
  void ZeroWrench() override {
    Ask(raised_, "robot", "zero_wrench", [&] { Attr("zero_wrench")(); });
  }
  double Time() const override {
    return Ask(raised_, "robot", "time", [&] {
      const double time_s = nb::cast<double>(Attr("time")());
      if (!std::isfinite(time_s)) throw InputError("robot.time", "is not finite", "give seconds");
      return time_s;
    });
  }
  MotionResult Transfer(const Pose& pose) override {
    return Move("transfer", [&] { return Attr("transfer")(M(pose)); });
  }
  MotionResult LinearMove(const Pose& pose, double speed_m_s, double contact_force_n) override {
    return Move("linear_move", [&] { return Attr("linear_move")(M(pose), speed_m_s, contact_force_n); });
  }
  MotionResult Guarded(const GuardedMotion& m) override {
    return Move("guarded", [&] { return Attr("guarded")(m.direction, m.distance_m, m.speed_m_s, m.contact_force_n); });
  }
  MotionResult Compliant(const CompliantMotion& m) override {
    return Move("compliant", [&] {
      nb::list way;
      for (const Pose& pose : m.world_T_tool) way.append(M(pose));
      return Attr("compliant")(way, m.speed_m_s, m.force_limit_n, m.time_limit_s, m.stiffness_n_m,
                               m.rotational_stiffness_nm_rad, m.rest_time_s);
    });
  }
  ContactResponse Contact(const Eigen::Vector3d& direction) const override {
    return Ask(raised_, "robot", "contact", [&] {
      const nb::object told = Attr("contact")(direction);
      if (told.is_none()) return Robot::Contact(direction);
      const auto v = nb::cast<Eigen::VectorXd>(told);
      if (v.size() < 6 || v.size() > 7 || !v.allFinite() || (v.array() < 0.0).any()) {
        throw InputError("robot.contact", "is not six or seven finite numbers, none below zero",
                         "give held mass, free mass, stiffness, damping ratio, reaction time, force noise and, where "
                         "the drive pushes against friction, that force; or None");
      }
      return ContactResponse{v[0], v[1], v[2], v[3], v[4], v[5], v.size() > 6 ? v[6] : 0.0};
    });
  }
  CameraView Look() override {
    return Ask(raised_, "robot", "look", [&] { return nb::cast<CameraView>(Attr("look")()); });
  }
  MotionResult FollowTwist(const TwistMotion& m) override {
    return Move("follow_twist", [&] {
      return Attr("follow_twist")(M(m.tool_T_frame), m.linear_m_s, m.angular_rad_s, m.duration_s, m.contact_force_n);
    });
  }

 private:
  nb::object Attr(const char* name) const { return (*object_).attr(name); }
  template <class Call>
  MotionResult Move(const char* method, Call&& call) {
    return Ask(raised_, "robot", method, [&] { return Checked(nb::cast<MotionResult>(nb::object(call()))); });
  }

  Held object_;
  std::shared_ptr<Raised> raised_;
};

class PythonPolicy final : public policies::Policy {
 public:
  PythonPolicy(nb::object object, std::shared_ptr<Raised> raised) : raised_(std::move(raised)) {
    name_ = nb::cast<std::string>(nb::str(object.attr("name")));
    object_ = Held(std::move(object));
  }

  std::string_view name() const override { return name_; }
  void Begin(const planner::Problem& problem) override {
    auto kept = std::make_shared<const planner::Problem>(problem);
    Ask(raised_, "policy", "begin", [&] { (*object_).attr("begin")(kept); });
  }
  policies::Decision Next(const policies::Belief& belief) override {
    return Ask(raised_, "policy", "next", [&] {
      std::vector<std::int32_t> rows;
      std::vector<double> weights;
      for (const planner::Hypothesis& h : belief.hypotheses) {
        for (int axis = 0; axis < 3; ++axis) rows.push_back(h.offset[axis]);
        rows.push_back(h.orientation);
        weights.push_back(h.weight);
      }
      const std::size_t n = belief.hypotheses.size();
      const nb::object seen = (*object_).attr("_belief")(
          Eigen::Vector3i(belief.robot), NewArray(std::move(rows), {n, 4}), NewArray(std::move(weights), {n}));
      return ToDecision((*object_).attr("next")(seen));
    });
  }
  bool Observe(const Outcome& outcome) override {
    return Ask(raised_, "policy", "observe",
               [&] { return nb::cast<bool>((*object_).attr("observe")(outcome.cells, outcome.contact)); });
  }

 private:
  static policies::Decision ToDecision(const nb::object& answer) {
    std::string kind;
    if (!nb::hasattr(answer, "kind") || !nb::try_cast(answer.attr("kind"), kind)) {
      throw InputError("policy.next", "returned no decision", "return feeler.Move, Insert, GiveUp or Spiral");
    }
    if (kind == "move") {
      const auto direction = ParseDirection(nb::cast<std::string>(answer.attr("direction")));
      const int cells = nb::cast<int>(answer.attr("cells"));
      if (!direction || cells < 1) {
        throw InputError("policy.next", "returned a move that is none",
                         "give a direction, +x to -z, and 1 cell or more");
      }
      return GuardedMove{*direction, cells};
    }
    if (kind == "insert") return policies::Insert{nb::cast<bool>(answer.attr("confirm"))};
    if (kind == "give_up") return policies::GiveUp{nb::cast<std::string>(answer.attr("reason"))};
    policies::SpiralSearch spiral;
    spiral.radius_m = nb::cast<double>(answer.attr("radius_m"));
    spiral.pitch_m = nb::cast<double>(answer.attr("pitch_m"));
    spiral.speed_m_s = nb::cast<double>(answer.attr("speed_m_s"));
    spiral.press_n = nb::cast<double>(answer.attr("press_n"));
    if (!(spiral.radius_m > 0.0 && spiral.pitch_m > 0.0 && spiral.speed_m_s > 0.0 && spiral.press_n > 0.0)) {
      throw InputError("policy.next", "returned a spiral that is none", "give numbers above zero");
    }
    return spiral;
  }

  Held object_;
  std::shared_ptr<Raised> raised_;
  std::string name_;
};

template <class Call>
MotionResult Released(Call&& call) {
  const nb::gil_scoped_release released;
  return call();
}

void BindMotions(nb::module_& m) {
  nb::class_<MotionResult>(m, "MotionResult", "How and where a motion ended.")
      .def(
          "__init__",
          [](MotionResult* self, const std::string& reason, double travelled_m, bool contact, double peak_force_n,
             const Eigen::Matrix4d& world_T_tool, const std::string& detail) {
            new (self) MotionResult();
            self->reason = ParseReason(reason);
            self->travelled_m = travelled_m;
            self->contact = contact;
            self->peak_force_n = peak_force_n;
            self->world_T_tool.matrix() = world_T_tool;
            self->detail = detail;
          },
          "reason"_a, "travelled_m"_a, "contact"_a, "peak_force_n"_a, "world_T_tool"_a, "detail"_a = "",
          "reason: reached, contact, force limit, time limit, unplanned or aborted; travelled_m along the commanded "
          "direction "
          "or path, measured; world_T_tool: 4 x 4, where the motion ended (for a contact: at the contact).")
      .def_prop_ro("reason", [](const MotionResult& r) { return std::string(ToString(r.reason)); })
      .def_ro("travelled_m", &MotionResult::travelled_m)
      .def_ro("contact", &MotionResult::contact)
      .def_ro("peak_force_n", &MotionResult::peak_force_n)
      .def_prop_ro("world_T_tool", [](const MotionResult& r) { return M(r.world_T_tool); })
      .def_ro("detail", &MotionResult::detail)
      .def("__repr__", [](const MotionResult& r) {
        return fmt::format("MotionResult({}, travelled_m={:.5f}, contact={}, peak_force_n={:.1f})", ToString(r.reason),
                           r.travelled_m, r.contact, r.peak_force_n);
      });
  nb::class_<CameraView>(m, "CameraView", "What a calibrated camera on the robot sees.")
      .def(
          "__init__",
          [](CameraView* self, const nb::ndarray<const std::uint8_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>& rgb,
             double fx, double fy, double cx, double cy, const Eigen::Matrix4d& tool_T_camera) {
            if (rgb.shape(2) != 3) throw InputError("rgb", "has no three colours", "give (height, width, 3) uint8");
            const Pose pose = ToPose(tool_T_camera, "tool_T_camera");
            new (self) CameraView();
            self->height = static_cast<int>(rgb.shape(0));
            self->width = static_cast<int>(rgb.shape(1));
            self->rgb.assign(rgb.data(), rgb.data() + rgb.size());
            self->fx = fx;
            self->fy = fy;
            self->cx = cx;
            self->cy = cy;
            self->tool_T_camera = pose;
          },
          "rgb"_a, "fx"_a, "fy"_a, "cx"_a, "cy"_a, "tool_T_camera"_a)
      .def_static(
          "none", [] { return CameraView(); }, "Of a robot without a camera.")
      .def_prop_ro("rgb",
                   [](const CameraView& v) {
                     return NewArray(std::vector<std::uint8_t>(v.rgb),
                                     {static_cast<std::size_t>(v.height), static_cast<std::size_t>(v.width), 3});
                   })
      .def_ro("fx", &CameraView::fx)
      .def_ro("fy", &CameraView::fy)
      .def_ro("cx", &CameraView::cx)
      .def_ro("cy", &CameraView::cy)
      .def_prop_ro("tool_T_camera", [](const CameraView& v) { return M(v.tool_T_camera); });
}

void BindSimulatedRobot(nb::module_& m) {
  using env::SimulatedRobot;
  nb::class_<SimulatedRobot>(m, "SimulatedRobot", "The UR10e in MuJoCo; methods as feeler.Robot has them.")
      .def("tool_pose", [](const SimulatedRobot& r) { return M(r.ToolPose()); })
      .def("contact_wrench",
           [](const SimulatedRobot& r) {
             const Wrench w = r.ContactWrench();
             Eigen::Matrix<double, 6, 1> v;
             v << w.force_n, w.torque_nm;
             return v;
           })
      .def("zero_wrench", &SimulatedRobot::ZeroWrench, nb::call_guard<nb::gil_scoped_release>())
      .def("time", &SimulatedRobot::Time)
      .def(
          "transfer",
          [](SimulatedRobot& r, const Eigen::Matrix4d& pose) {
            const Pose goal = ToPose(pose, "transfer");
            return Released([&] { return r.Transfer(goal); });
          },
          "world_T_tool"_a)
      .def(
          "linear_move",
          [](SimulatedRobot& r, const Eigen::Matrix4d& pose, double speed_m_s, double contact_force_n) {
            const Pose goal = ToPose(pose, "linear_move");
            return Released([&] { return r.LinearMove(goal, speed_m_s, contact_force_n); });
          },
          "world_T_tool"_a, "speed_m_s"_a, "contact_force_n"_a)
      .def(
          "guarded",
          [](SimulatedRobot& r, const Eigen::Vector3d& direction, double distance_m, double speed_m_s,
             double contact_force_n) {
            return Released([&] { return r.Guarded({direction, distance_m, speed_m_s, contact_force_n}); });
          },
          "direction"_a, "distance_m"_a, "speed_m_s"_a = 0.05, "contact_force_n"_a = 5.0)
      .def(
          "compliant",
          [](SimulatedRobot& r, const std::vector<Eigen::Matrix4d>& way, double speed_m_s, double force_limit_n,
             double time_limit_s, const Eigen::Vector3d& stiffness_n_m, double rotational_stiffness_nm_rad,
             double rest_time_s) {
            CompliantMotion motion;
            for (const Eigen::Matrix4d& pose : way) motion.world_T_tool.push_back(ToPose(pose, "compliant"));
            motion.speed_m_s = speed_m_s;
            motion.force_limit_n = force_limit_n;
            motion.time_limit_s = time_limit_s;
            motion.stiffness_n_m = stiffness_n_m;
            motion.rotational_stiffness_nm_rad = rotational_stiffness_nm_rad;
            motion.rest_time_s = rest_time_s;
            return Released([&] { return r.Compliant(motion); });
          },
          "world_T_tool"_a, "speed_m_s"_a = 0.02, "force_limit_n"_a = 60.0, "time_limit_s"_a = 10.0,
          "stiffness_n_m"_a = Eigen::Vector3d(1000, 1000, 4000), "rotational_stiffness_nm_rad"_a = 200.0,
          "rest_time_s"_a = 0.05)
      .def(
          "contact",
          [](const SimulatedRobot& r, const Eigen::Vector3d& direction) {
            const ContactResponse c = r.Contact(direction);
            Eigen::Matrix<double, 7, 1> v;
            v << c.held_mass_kg, c.free_mass_kg, c.stiffness_n_m, c.damping_ratio, c.reaction_time_s, c.force_noise_n,
                c.push_n;
            return v;
          },
          "direction"_a)
      .def("look",
           [](SimulatedRobot& r) {
             const nb::gil_scoped_release released;
             return r.Look();
           })
      .def(
          "follow_twist",
          [](SimulatedRobot& r, const Eigen::Matrix4d& tool_T_frame, const Eigen::Vector3d& linear_m_s,
             const Eigen::Vector3d& angular_rad_s, double duration_s, double contact_force_n) {
            const TwistMotion motion{ToPose(tool_T_frame, "follow_twist"), linear_m_s, angular_rad_s, duration_s,
                                     contact_force_n};
            return Released([&] { return r.FollowTwist(motion); });
          },
          "tool_T_frame"_a, "linear_m_s"_a, "angular_rad_s"_a, "duration_s"_a, "contact_force_n"_a = 5.0);
}

/// A policy of a stored graph, or one of Python.
std::unique_ptr<policies::Policy> MakePolicy(const nb::object& policy, const std::shared_ptr<Raised>& raised) {
  if (nb::isinstance<BoundPolicy>(policy)) {
    return std::make_unique<policies::DatabasePolicy>(nb::cast<const BoundPolicy&>(policy).graph);
  }
  return PolicyFromPython(policy, raised);
}

nb::object Execute(PlanningTask& task, const nb::object& extents_given, const Eigen::Matrix4d& estimate,
                   const nb::object& policy_given, const nb::object& robot_given, bool ladder, double contact_force_n) {
  const auto setup = task.Setup(1, nb::none());
  const planner::Extents extents = ToExtents(extents_given, setup->task());
  const Pose world_T_estimate = ToPose(estimate, "estimate");
  const planner::Problem problem = planner::MakeCuboidProblem(setup->task(), setup->map, extents);
  auto raised = std::make_shared<Raised>();
  const std::unique_ptr<policies::Policy> policy = MakePolicy(policy_given, raised);
  const std::unique_ptr<Robot> robot = RobotFromPython(robot_given, raised);
  execution::ExecutorOptions options;
  options.ladder = ladder;
  options.contact_force_n = contact_force_n;
  if (setup->map->orientations() > 1) options.travel_model = env::MakeExactTravel(setup->model, env::Opening::kOpen);
  workflow::EpisodeRecord record;
  record.task = setup->task().name;
  record.policy = policy->name();
  record.extents = extents;
  record.world_T_estimate0 = world_T_estimate;
  CancellationToken token;
  raised->stop = &token;
  try {
    record.execution = RunInterruptibly(token, [&]() -> execution::ExecutionRecord {
      const MotionResult transfer =
          robot->Transfer(execution::LatticeStartPose(setup->task(), problem, world_T_estimate));
      if (transfer.reason != StopReason::kReached) {
        execution::ExecutionRecord failed;
        failed.reason = "transfer to the start pose: " + std::string(ToString(transfer.reason));
        return failed;
      }
      return execution::Execute(setup->task(), problem, world_T_estimate, *policy, *robot, options);
    });
  } catch (const InputError&) {
    raised->Rethrow();
    throw;
  }
  raised->Rethrow();
  record.localized = record.execution.believed_localized;
  record.inserted = record.execution.believed_inserted;
  record.reason = record.execution.reason;
  return ToPython(evaluation::ToJson(record));
}

}  // namespace

std::unique_ptr<Robot> RobotFromPython(nb::object object, std::shared_ptr<Raised> raised) {
  return std::make_unique<PythonRobot>(std::move(object), std::move(raised));
}
std::unique_ptr<policies::Policy> PolicyFromPython(nb::object object, std::shared_ptr<Raised> raised) {
  return std::make_unique<PythonPolicy>(std::move(object), std::move(raised));
}

void BindRobot(nb::module_& m) {
  BindMotions(m);
  BindSimulatedRobot(m);
  m.def("execute", &Execute, "task"_a, "extents"_a, "estimate"_a, "policy"_a, "robot"_a, "ladder"_a,
        "contact_force_n"_a);
}

}  // namespace feeler::python
