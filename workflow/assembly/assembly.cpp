#include "feeler/workflow/assembly/assembly.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "feeler/core/error.h"
#include "feeler/perception/input_file.h"

namespace feeler::workflow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kFarthest_m = 2.0;  ///< of a part from the robot; nothing beyond is in reach
constexpr double kDegree = std::numbers::pi / 180.0;

/// A value with its place in a file, for messages.
struct Node {
  const json* value;
  std::string where;

  [[noreturn]] void Fail(const std::string& what, const std::string& mend) const {
    throw InputError(where, what, mend);
  }
  const json& Object(std::initializer_list<std::string_view> keys) const {
    if (!value->is_object()) Fail("is not an object", "write { ... }");
    std::string known;
    for (const std::string_view key : keys) known += (known.empty() ? "" : ", ") + std::string(key);
    for (const auto& item : value->items()) {
      if (std::find(keys.begin(), keys.end(), item.key()) == keys.end()) {
        Fail(fmt::format("unknown field '{}'", item.key()), "the fields are " + known);
      }
    }
    return *value;
  }
  bool Has(const char* key) const { return value->contains(key); }
  Node At(const char* key) const {
    const auto found = value->find(key);
    if (found == value->end()) Fail(fmt::format("'{}' is missing", key), "see docs/assembly.md");
    return {&*found, fmt::format("{}{}{}", where, where.ends_with(": ") ? "" : ".", key)};
  }
  Node At(std::size_t index) const { return {&(*value)[index], fmt::format("{}[{}]", where, index)}; }
  std::size_t Size(bool may_be_empty) const {
    if (!value->is_array()) Fail("is not a list", "write [ ... ]");
    if (value->empty() && !may_be_empty) Fail("is empty", "name at least one");
    return value->size();
  }
  std::string Text() const {
    if (!value->is_string() || value->get<std::string>().empty()) Fail("is not a text", "write \"...\"");
    return value->get<std::string>();
  }
  double Number(double most) const {
    if (!value->is_number()) Fail("is not a number", fmt::format("give a number from {} to {}", -most, most));
    const double number = value->get<double>();
    if (!(std::abs(number) <= most)) {
      Fail(fmt::format("{} is out of range", number), fmt::format("give a number from {} to {}", -most, most));
    }
    return number;
  }
  Eigen::Vector3d Position() const {
    if (!value->is_array() || value->size() != 3) Fail("is not a position", "give [x, y, z] in metres");
    Eigen::Vector3d position;
    for (std::size_t i = 0; i < 3; ++i) position[static_cast<int>(i)] = At(i).Number(kFarthest_m);
    return position;
  }
  Eigen::Quaterniond Quaternion() const {
    if (!value->is_array() || value->size() != 4) Fail("is not a quaternion", "give [w, x, y, z] of length 1");
    std::array<double, 4> q{};
    for (std::size_t i = 0; i < 4; ++i) q[i] = At(i).Number(1.0);
    const Eigen::Quaterniond quaternion(q[0], q[1], q[2], q[3]);
    if (std::abs(quaternion.norm() - 1.0) > 1e-3) {
      Fail(fmt::format("has length {:.4f}", quaternion.norm()), "give [w, x, y, z] of length 1");
    }
    return quaternion.normalized();
  }
};

Pose PoseFrom(const Node& node, const char* position, const char* quaternion) {
  return MakePose(node.At(position).Position(), node.At(quaternion).Quaternion());
}

template <class Things>
std::string NamesOf(const Things& things) {
  std::vector<std::string> names;
  names.reserve(things.size());
  for (const auto& thing : things) names.push_back(thing.name);
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

template <class Things>
int Find(const Things& things, const std::string& name) {
  for (std::size_t i = 0; i < things.size(); ++i) {
    if (things[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

class Loader {
 public:
  explicit Loader(Assembly& assembly) : assembly_(assembly) {}

  void Load(const fs::path& file) {
    const json document = perception::ParseJson(perception::ReadFile(file.string()), file.string());
    const Node root{&document, file.string() + ": "};
    root.Object({"about", "kit", "fixtures", "parts", "insertions"});
    if (root.Has("about")) assembly_.about = root.At("about").Text();
    LoadKit(root.At("kit"), file.parent_path());
    const Node fixtures = root.At("fixtures");
    for (std::size_t i = 0; i < fixtures.Size(false); ++i) AddPart(fixtures.At(i), true);
    const Node parts = root.At("parts");
    for (std::size_t i = 0; i < parts.Size(false); ++i) AddPart(parts.At(i), false);
    const Node insertions = root.At("insertions");
    for (std::size_t i = 0; i < insertions.Size(false); ++i) AddInsertion(insertions.At(i));
    CheckOrder(insertions);
    for (std::size_t part = 0; part < assembly_.parts.size(); ++part) {
      if (!assembly_.parts[part].fixed && StepOf(static_cast<int>(part)) == assembly_.insertions.size()) {
        parts.Fail(fmt::format("'{}' is never inserted", assembly_.parts[part].name),
                   "add an insertion for it or leave it out");
      }
    }
  }

 private:
  void RequireTask(const Node& node, const std::string& task) {
    if (assembly_.tasks.contains(task)) return;
    const std::vector<std::string> known = env::ListTasks();
    std::error_code error;
    if (std::find(known.begin(), known.end(), task) == known.end() && !fs::exists(task, error)) {
      node.Fail(fmt::format("no task is named '{}'", task), fmt::format("one of {}", fmt::join(known, ", ")));
    }
    assembly_.tasks.emplace(task, std::make_shared<const env::TaskModel>(env::LoadTask(task)));
  }

  void LoadKit(const Node& node, const fs::path& folder) {
    const std::string name = node.Text();
    const bool is_path = name.find('/') != std::string::npos || name.ends_with(".json");
    const fs::path file = is_path ? folder / name : env::ModelsFolder() / "parts" / (name + ".json");
    std::error_code error;
    if (!fs::is_regular_file(file, error)) node.Fail("there is no kit " + file.string(), "name one that exists");
    const json document = perception::ParseJson(perception::ReadFile(file.string()), file.string());
    const Node root{&document, file.string() + ": "};
    root.Object({"about", "assets", "parts"});
    const Node assets = root.At("assets");
    for (std::size_t i = 0; i < assets.Size(true); ++i) {
      assembly_.assets.push_back(ExistingFile(assets.At(i), file.parent_path()));
    }
    const Node kinds = root.At("parts");
    if (!kinds.value->is_object() || kinds.value->empty()) kinds.Fail("names no part", "describe at least one");
    for (const auto& item : kinds.value->items()) AddKind(kinds.At(item.key().c_str()), item.key(), file.parent_path());
  }

  static fs::path ExistingFile(const Node& node, const fs::path& folder) {
    std::error_code error;
    fs::path file = fs::absolute(folder / node.Text(), error).lexically_normal();
    if (error || !fs::is_regular_file(file, error))
      node.Fail("there is no file " + file.string(), "name one that exists");
    return file;
  }

  void AddKind(const Node& node, const std::string& name, const fs::path& folder) {
    node.Object({"geoms", "tool", "ports"});
    AssemblyKind kind;
    kind.name = name;
    kind.geoms = ExistingFile(node.At("geoms"), folder);
    if (node.Has("tool")) {
      const Node tool = node.At("tool");
      tool.Object({"task", "position_m", "quaternion_wxyz", "flange_position_m", "flange_quaternion_wxyz"});
      kind.task = tool.At("task").Text();
      RequireTask(tool.At("task"), kind.task);
      kind.part_T_tool = PoseFrom(tool, "position_m", "quaternion_wxyz");
      kind.flange_T_tool = PoseFrom(tool, "flange_position_m", "flange_quaternion_wxyz");
    }
    if (node.Has("ports")) {
      const Node ports = node.At("ports");
      if (!ports.value->is_object()) ports.Fail("is not an object", "write { ... }");
      for (const auto& item : ports.value->items()) {
        const Node port = ports.At(item.key().c_str());
        port.Object({"task", "position_m", "quaternion_wxyz"});
        RequireTask(port.At("task"), port.At("task").Text());
        kind.ports.push_back({item.key(), port.At("task").Text(), PoseFrom(port, "position_m", "quaternion_wxyz")});
      }
    }
    assembly_.kinds.push_back(std::move(kind));
  }

  void AddPart(const Node& node, bool fixed) {
    node.Object({"name", "part", "position_m", "yaw_deg"});
    AssemblyPart part;
    part.name = node.At("name").Text();
    part.fixed = fixed;
    if (Find(assembly_.parts, part.name) >= 0) {
      node.At("name").Fail(fmt::format("two parts are named '{}'", part.name), "give each a name of its own");
    }
    const std::string kind = node.At("part").Text();
    part.kind = Find(assembly_.kinds, kind);
    if (part.kind < 0) {
      node.At("part").Fail(fmt::format("the kit has no part '{}'", kind), "one of " + NamesOf(assembly_.kinds));
    }
    const AssemblyKind& what = assembly_.kinds[static_cast<std::size_t>(part.kind)];
    if (!fixed && what.task.empty()) {
      node.At("part").Fail(fmt::format("'{}' cannot be held", kind), "make it a fixture, or give it a tool in the kit");
    }
    const double yaw_deg = node.Has("yaw_deg") ? node.At("yaw_deg").Number(360.0) : 0.0;
    part.world_T_part = MakePose(node.At("position_m").Position(), yaw_deg * kDegree);
    assembly_.parts.push_back(std::move(part));
  }

  int PartNamed(const Node& node) {
    const int part = Find(assembly_.parts, node.Text());
    if (part < 0) {
      node.Fail(fmt::format("no part is named '{}'", node.Text()), "one of " + NamesOf(assembly_.parts));
    }
    return part;
  }

  std::size_t StepOf(int part) const {
    std::size_t step = 0;
    while (step < assembly_.insertions.size() && assembly_.insertions[step].part != part) ++step;
    return step;
  }

  void AddInsertion(const Node& node) {
    node.Object({"part", "task", "into", "port", "turn_deg"});
    AssemblyInsertion insertion;
    insertion.part = PartNamed(node.At("part"));
    const AssemblyPart& part = assembly_.Part(insertion.part);
    if (part.fixed) node.At("part").Fail(fmt::format("'{}' is a fixture", part.name), "insert one of the parts");
    const std::size_t before = StepOf(insertion.part);
    if (before < assembly_.insertions.size()) {
      node.At("part").Fail(fmt::format("'{}' is inserted already, by insertions[{}]", part.name, before),
                           "insert each part once");
    }
    insertion.task = node.At("task").Text();
    RequireTask(node.At("task"), insertion.task);
    if (assembly_.KindOf(insertion.part).task != insertion.task) {
      node.At("task").Fail(fmt::format("'{}' is no tool of task '{}'", part.name, insertion.task),
                           "its task is " + assembly_.KindOf(insertion.part).task);
    }
    insertion.into = PartNamed(node.At("into"));
    const AssemblyKind& owner = assembly_.KindOf(insertion.into);
    const std::string port = node.At("port").Text();
    insertion.port = Find(owner.ports, port);
    if (insertion.port < 0) {
      node.At("port").Fail(fmt::format("'{}' has no port '{}'", assembly_.Part(insertion.into).name, port),
                           "one of " + NamesOf(owner.ports));
    }
    const AssemblyPort& taken = owner.ports[static_cast<std::size_t>(insertion.port)];
    if (taken.task != insertion.task) {
      node.At("port").Fail(fmt::format("port '{}' of '{}' takes task '{}', not '{}'", port,
                                       assembly_.Part(insertion.into).name, taken.task, insertion.task),
                           "choose a part and a port of one task");
    }
    for (std::size_t i = 0; i < assembly_.insertions.size(); ++i) {
      const AssemblyInsertion& other = assembly_.insertions[i];
      if (other.into == insertion.into && other.port == insertion.port) {
        node.At("port").Fail(fmt::format("port '{}' of '{}' is used already, by insertions[{}]", port,
                                         assembly_.Part(insertion.into).name, i),
                             "each port takes one part");
      }
    }
    if (node.Has("turn_deg")) insertion.turn_rad = node.At("turn_deg").Number(360.0) * kDegree;
    assembly_.insertions.push_back(insertion);
  }

  /// Every part goes into one that stands by then.
  void CheckOrder(const Node& insertions) const {
    for (std::size_t i = 0; i < assembly_.insertions.size(); ++i) {
      const int into = assembly_.insertions[i].into;
      if (assembly_.Part(into).fixed || StepOf(into) < i) continue;
      const Node node = insertions.At(i).At("into");
      // Follow what it hangs on: back at a part seen before there is no beginning.
      std::string chain = assembly_.Part(assembly_.insertions[i].part).name;
      std::set<int> seen{assembly_.insertions[i].part};
      for (int part = into;;) {
        chain += " -> " + assembly_.Part(part).name;
        if (!seen.insert(part).second) {
          node.Fail("the insertions form a cycle: " + chain, "begin at a fixture");
        }
        const std::size_t step = StepOf(part);
        if (assembly_.Part(part).fixed || step == assembly_.insertions.size()) break;
        part = assembly_.insertions[step].into;
      }
      node.Fail(fmt::format("'{}' does not stand yet", assembly_.Part(into).name), "insert it earlier");
    }
  }

  Assembly& assembly_;
};

}  // namespace

std::string Assembly::Describe(std::size_t insertion) const {
  const AssemblyInsertion& step = insertions[insertion];
  return fmt::format("insertions[{}] ({} into {}.{})", insertion, Part(step.part).name, Part(step.into).name,
                     PortOf(step).name);
}

Assembly LoadAssembly(const std::string& name) {
  const bool is_path = name.find('/') != std::string::npos || name.ends_with(".json");
  const fs::path file = is_path ? fs::path(name) : env::ModelsFolder() / "assemblies" / (name + ".json");
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    throw InputError("--assembly", fmt::format("no assembly is named '{}' and no file is", name),
                     fmt::format("one of {}, or a path", fmt::join(ListAssemblies(), ", ")));
  }
  Assembly assembly;
  assembly.name = file.stem().string();
  assembly.file = file.string();
  Loader(assembly).Load(file);
  return assembly;
}

std::vector<std::string> ListAssemblies() {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(env::ModelsFolder() / "assemblies", ignored)) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Pose PartTTool(const Assembly& assembly, const AssemblyInsertion& insertion) {
  const Eigen::Vector3d outward = -UnitVector(assembly.TaskOf(insertion).insertion);
  return assembly.KindOf(insertion.part).part_T_tool * Eigen::AngleAxisd(-insertion.turn_rad, outward);
}

Pose TargetPoseOf(const Assembly& assembly, const AssemblyInsertion& insertion, const Pose& world_T_into) {
  return world_T_into * assembly.PortOf(insertion).part_T_target;
}

Pose InsertedPartPose(const Assembly& assembly, const AssemblyInsertion& insertion, const Pose& world_T_target) {
  const Task& task = assembly.TaskOf(insertion);
  const Eigen::Vector3d inward = task.insertion_depth_m * UnitVector(task.insertion);
  return world_T_target * Eigen::Translation3d(inward) * PartTTool(assembly, insertion).inverse();
}

std::vector<Pose> NominalPoses(const Assembly& assembly) {
  std::vector<Pose> poses;
  for (const AssemblyPart& part : assembly.parts) poses.push_back(part.world_T_part);
  for (const AssemblyInsertion& insertion : assembly.insertions) {
    const Pose& into = poses[static_cast<std::size_t>(insertion.into)];
    poses[static_cast<std::size_t>(insertion.part)] =
        InsertedPartPose(assembly, insertion, TargetPoseOf(assembly, insertion, into));
  }
  return poses;
}

}  // namespace feeler::workflow
