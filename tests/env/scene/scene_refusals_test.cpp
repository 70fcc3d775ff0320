// What a scene and its state refuse. Laws: an arm whose URDF is not the one of the kinematics is refused by joint;
// faults of the URDF are named by file, link or joint; a tool too heavy or too near to the flange is refused as such
// before anything moves; the state of another model, or with numbers that are none, is not restored; the locale of a
// host program does not reach the model.

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <locale>
#include <memory>
#include <sstream>
#include <string>

#include "feeler/core/error.h"
#include "feeler/env/scene/world.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;

TaskModel Load(const std::function<void(TaskText&)>& change = {}) {
  TaskText text;
  text.numbers["feeler_flange_position"] = "0 0 0.15";
  if (change) change(text);
  return LoadTaskFromText(text.Mjcf(), "peg.xml");
}

std::string SceneErrorOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// The refusal of a scene whose robot is the shipped one with one text replaced.
std::string UrdfError(const std::string& from, const std::string& to) {
  std::ifstream in(ModelsFolder() / "robots" / "ur10e.urdf");
  std::stringstream bytes;
  bytes << in.rdbuf();
  std::string urdf = bytes.str();
  const std::size_t at = urdf.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at == std::string::npos) return "";
  urdf.replace(at, from.size(), to);
  const fs::path folder = fs::path(testing::TempDir()) / "scene_refusals";
  fs::create_directories(folder / "robots");
  std::ofstream(folder / "robots" / "ur10e.urdf") << urdf;
  const TaskModel task = Load();
  const std::string error = SceneErrorOf([&] { BuildScene(task.task, task.xml, folder.string()); });
  fs::remove_all(folder);
  return error;
}

void ExpectNamed(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
}

TEST(SceneRefusals, AnotherArmThanTheKinematics) {
  const std::string shoulder = UrdfError("0.1807", "0.1907");
  ExpectNamed(shoulder, {"ur10e.urdf", "shoulder_lift_joint", "10 mm"});
}

TEST(SceneRefusals, AToolTooHeavyOrTooLong) {
  const auto heavy = [](TaskText& t) { t.tool.insert(t.tool.find("name=\"peg\""), "mass=\"50\" "); };
  ExpectNamed(SceneErrorOf([&] { BuildScene(Load(heavy)); }), {"<body name=\"tool\">", "50 kg", "12.5 kg"});
  const auto near = [](TaskText& t) { t.numbers["feeler_flange_position"] = "0 0 0.03"; };
  ExpectNamed(SceneErrorOf([&] { BuildScene(Load(near)); }), {"feeler_flange_position", "palm", "z = "});
}

TEST(SceneRefusals, AStateOfAnotherModelOrOfNoNumbers) {
  World world(std::make_shared<const Scene>(BuildScene(Load())));
  for (int i = 0; i < 5; ++i) world.Step(world.BiasTorque());
  const WorldState state = world.Save();
  EXPECT_NO_THROW(World(std::make_shared<const Scene>(BuildScene(Load()))).Restore(state));  // compiled anew: the same
  const std::function<void(TaskText&)> others[] = {
      [](TaskText& t) { t.tool.insert(t.tool.find("name=\"peg\""), "friction=\"0.4 0.005 0.0001\" "); },
      [](TaskText& t) { t.tool.insert(t.tool.find("name=\"peg\""), "solref=\"0.02 1\" "); },
      [](TaskText& t) { t.numbers["feeler_flange_position"] = "0 0 0.151"; },
      [](TaskText& t) { t.target.insert(t.target.find("name=\"west\""), "euler=\"0 0 0.2\" "); },
  };
  for (const auto& other : others) {
    World another(std::make_shared<const Scene>(BuildScene(Load(other))));
    EXPECT_THROW(another.Restore(state), InputError);
  }
  const std::function<void(WorldState&)> faults[] = {
      [](WorldState& s) { s.time_s = std::nan(""); },
      [](WorldState& s) { s.warmstart[0] = HUGE_VAL; },
      [](WorldState& s) { s.mocap_pos[1] = std::nan(""); },
      [](WorldState& s) { s.applied_torque_nm[2] = std::nan(""); },
      [](WorldState& s) { s.contacts.emplace_back().force_n.x() = std::nan(""); },
      [](WorldState& s) { s.tool_at_contact.translation().z() = std::nan(""); },
  };
  for (const auto& fault : faults) {
    WorldState bad = state;
    fault(bad);
    EXPECT_THROW(world.Restore(bad), InputError);
  }
  EXPECT_NO_THROW(world.Restore(state));
}

TEST(SceneRefusals, FaultsOfTheUrdfAreNamed) {
  ExpectNamed(UrdfError("<mass value=\"7.369\"/>", "<mass value=\"nan\"/>"), {"ur10e.urdf", "shoulder_link", "mass"});
  ExpectNamed(UrdfError("<mass value=\"7.369\"/>", "<mass value=\"heavy\"/>"), {"shoulder_link", "mass", "heavy"});
  for (const char* bad : {"nan", "strong", "1e999"}) {
    ExpectNamed(UrdfError("effort=\"330\"", std::string("effort=\"") + bad + "\""),
                {"ur10e.urdf: <joint name=\"shoulder_pan_joint\"><limit>", "effort", bad});
  }
}

/// A host program's locale, as a German one: decimal commas and grouping, for streams and for C.
class GermanHost {
 public:
  GermanHost() : before_(std::locale::global(std::locale(std::locale::classic(), new Comma))) {
    c_before_ = std::setlocale(LC_NUMERIC, nullptr);
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "de_DE"}) {
      if (std::setlocale(LC_NUMERIC, name) != nullptr) break;  // where it is installed
    }
  }
  ~GermanHost() {
    std::setlocale(LC_NUMERIC, c_before_.c_str());
    std::locale::global(before_);
  }
  GermanHost(const GermanHost&) = delete;
  GermanHost& operator=(const GermanHost&) = delete;

 private:
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  std::locale before_;
  std::string c_before_;
};

TEST(Locale, OfTheHostDoesNotReachTheScene) {
  const Scene plain = BuildScene(LoadTask("plug"));
  const GermanHost host;
  const Scene scene = BuildScene(LoadTask("plug"));
  ASSERT_EQ(scene.model->ngeom, plain.model->ngeom);
  ASSERT_EQ(scene.model->nbody, plain.model->nbody);
  for (int i = 0; i < 3 * plain.model->ngeom; ++i) EXPECT_EQ(scene.model->geom_size[i], plain.model->geom_size[i]);
  for (int i = 0; i < 3 * plain.model->nbody; ++i) EXPECT_EQ(scene.model->body_pos[i], plain.model->body_pos[i]);
  for (int i = 0; i < plain.model->nbody; ++i) EXPECT_EQ(scene.model->body_mass[i], plain.model->body_mass[i]);
}

}  // namespace
}  // namespace feeler::env
