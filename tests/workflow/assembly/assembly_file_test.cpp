// Assembly files. Laws:
//   a structure's poses follow from its ports: the same as an independent product of the transforms in the files;  a
//   fixture that is moved moves all that hangs on it, rigidly;  each bad input is refused with its place in the file
//   and what to mend: not JSON, fields missing, unknown or out of range, unknown parts, ports and tasks, a part
//   inserted twice or never, into nothing, into one that does not stand yet, a port used twice, a cycle;  the
//   assemblies that ship are sound, the structures have 4 and 8 to 12 insertions, down and sideways.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <string>

#include "feeler/core/error.h"
#include "feeler/env/model/task_file.h"
#include "feeler/workflow/assembly/assembly.h"
#include "tests/workflow/assembly/assembly_document.h"

namespace feeler::workflow {
namespace {

using nlohmann::json;

/// The one line that loading this ends with.
std::string ErrorOf(const std::string& text) {
  try {
    LoadAssemblyText(text);
  } catch (const InputError& error) {
    const std::string line = error.what();
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    EXPECT_NE(line.find("assembly_under_test.json"), std::string::npos) << line;
    EXPECT_TRUE(line.ends_with(")")) << "says not how to mend it: " << line;
    return line;
  }
  return "accepted";
}

/// The shipped crane with a value changed; null: removed.
std::string ErrorWith(const char* pointer, const json& value) {
  json crane = ShippedAssembly("crane");
  const json::json_pointer place(pointer);
  if (value.is_null()) {
    crane[place.parent_pointer()].erase(place.back());
  } else {
    crane[place] = value;
  }
  return ErrorOf(crane.dump());
}

void ExpectNamed(const std::string& error, const std::string& where, const std::string& what) {
  EXPECT_NE(error.find(where), std::string::npos) << error;
  EXPECT_NE(error.find(what), std::string::npos) << error;
}

TEST(AssemblyFile, EveryFaultIsNamedWithItsPlace) {
  EXPECT_EQ(ErrorOf(ShippedAssembly("crane").dump()), "accepted");
  EXPECT_NE(ErrorOf("{ \"kit\": "), "accepted");
  EXPECT_NE(ErrorOf("[1, 2]"), "accepted");
  ExpectNamed(ErrorWith("/kit", json()), "'kit'", "missing");
  ExpectNamed(ErrorWith("/kit", "no-such-kit"), "kit", "no-such-kit");
  ExpectNamed(ErrorWith("/glue", 1), "unknown field", "glue");
  ExpectNamed(ErrorWith("/insertions", json::array()), "insertions", "empty");
  ExpectNamed(ErrorWith("/insertions", 3), "insertions", "not a list");
  ExpectNamed(ErrorWith("/parts/1/part", "flange"), "parts[1].part", "flange");
  ExpectNamed(ErrorWith("/parts/1/part", "base"), "parts[1].part", "cannot be held");
  ExpectNamed(ErrorWith("/parts/1/name", "mast"), "parts[1].name", "two parts");
  ExpectNamed(ErrorWith("/parts/1/position_m", json::array({0.5, 0.1})), "parts[1].position_m", "position");
  ExpectNamed(ErrorWith("/parts/1/position_m/0", 7.5), "parts[1].position_m[0]", "out of range");
  ExpectNamed(ErrorWith("/parts/1/position_m/2", "low"), "parts[1].position_m[2]", "not a number");
  ExpectNamed(ErrorWith("/parts/1/yaw_deg", 361), "parts[1].yaw_deg", "out of range");
  ExpectNamed(ErrorWith("/insertions/2/turn_deg", -1e9), "insertions[2].turn_deg", "out of range");
  ExpectNamed(ErrorWith("/insertions/2/part", "gib"), "insertions[2].part", "gib");
  ExpectNamed(ErrorWith("/insertions/2/part", "base"), "insertions[2].part", "fixture");
  ExpectNamed(ErrorWith("/insertions/2/part", "mast"), "insertions[2].part", "already");
  ExpectNamed(ErrorWith("/insertions/2/task", "weld"), "insertions[2].task", "weld");
  ExpectNamed(ErrorWith("/insertions/2/task", "plug"), "insertions[2].task", "plug");
  ExpectNamed(ErrorWith("/insertions/2/into", "nothing"), "insertions[2].into", "nothing");
  ExpectNamed(ErrorWith("/insertions/2/into", json()), "insertions[2]", "'into'");
  ExpectNamed(ErrorWith("/insertions/2/port", "top"), "insertions[2].port", "top");
  json early = ShippedAssembly("crane");
  early["insertions"][1]["into"] = "jib";
  early["insertions"][3]["into"] = "mast";
  ExpectNamed(ErrorOf(early.dump()), "insertions[1].into", "cycle");
  early["insertions"][2]["into"] = "base";
  early["insertions"][2]["port"] = "mouth";
  early["insertions"][0]["into"] = "tip";
  early["insertions"][0]["port"] = "side";
  ExpectNamed(ErrorOf(early.dump()), "insertions[0].into", "cycle");
  json late = ShippedAssembly("crane");
  std::swap(late["insertions"][1], late["insertions"][2]);
  ExpectNamed(ErrorOf(late.dump()), "insertions[1].into", "'head' does not stand yet");
  json twice = ShippedAssembly("crane");
  twice["insertions"][2]["into"] = "base";
  twice["insertions"][2]["port"] = "mouth";
  ExpectNamed(ErrorOf(twice.dump()), "insertions[2].port", "used already");
  json wrong_port = ShippedAssembly("crane");
  wrong_port["insertions"][2]["into"] = "mast";
  wrong_port["insertions"][2]["port"] = "end";
  ExpectNamed(ErrorOf(wrong_port.dump()), "insertions[2].port", "elbow-onto-pipe");
  json never = ShippedAssembly("crane");
  never["insertions"].erase(3);
  ExpectNamed(ErrorOf(never.dump()), "parts", "'tip' is never inserted");
  json cycle = ShippedAssembly("crane");
  cycle["insertions"][0]["into"] = "tip";
  cycle["insertions"][0]["port"] = "side";
  ExpectNamed(ErrorOf(cycle.dump()), "insertions[0].into", "cycle");
  EXPECT_THROW(LoadAssembly("no-such-assembly"), InputError);
}

TEST(AssemblyFile, PosesFollowFromThePorts) {
  const Assembly crane = LoadAssembly("crane");
  const std::vector<Pose> poses = NominalPoses(crane);
  // By hand: transforms as in the files, joined at 25 mm of depth.
  const auto turn = [](double degrees) {
    return Pose(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ()));
  };
  const Pose depth(Eigen::Translation3d(0, 0, -0.025));
  const Pose end(Eigen::Translation3d(0, 0, 0.16));
  Pose side(Eigen::Translation3d(0.1, 0, 0.075));
  side.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  const Pose base(Eigen::Translation3d(0.65, 0.2, 0.12));
  const Pose mast = base * turn(90) * depth;
  const Pose head = mast * end * turn(180) * depth;
  const Pose jib = head * side * turn(90) * depth;
  const Pose tip = jib * end * depth;
  const std::vector<Pose> expected = {base, mast, head, jib, tip};
  ASSERT_EQ(poses.size(), expected.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_TRUE(poses[i].isApprox(expected[i], 1e-9)) << crane.parts[i].name;
  }
}

TEST(AssemblyFile, AFixtureMovesAllThatHangsOnIt) {
  json moved = ShippedAssembly("crane");
  moved["fixtures"][0]["position_m"] = {0.55, -0.1, 0.2};
  moved["fixtures"][0]["yaw_deg"] = 30;
  const std::vector<Pose> before = NominalPoses(LoadAssembly("crane"));
  const std::vector<Pose> after = NominalPoses(LoadAssemblyText(moved.dump()));
  const Pose motion = after[0] * before[0].inverse();
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_TRUE(after[i].isApprox(motion * before[i], 1e-9)) << i;
}

TEST(AssemblyFile, ThoseThatShipAreStructuresOfTheirSize) {
  const auto directions = [](const Assembly& assembly) {
    const std::vector<Pose> poses = NominalPoses(assembly);
    std::set<std::array<int, 3>> found;
    for (const AssemblyInsertion& step : assembly.insertions) {
      const Pose target = TargetPoseOf(assembly, step, poses[static_cast<std::size_t>(step.into)]);
      const Eigen::Vector3d way = target.linear() * UnitVector(assembly.TaskOf(step).insertion);
      found.insert({static_cast<int>(std::lround(way.x())), static_cast<int>(std::lround(way.y())),
                    static_cast<int>(std::lround(way.z()))});
    }
    return found;
  };
  EXPECT_EQ(LoadAssembly("crane").insertions.size(), 4U);
  const Assembly frame = LoadAssembly("frame");
  EXPECT_GE(frame.insertions.size(), 8U);
  EXPECT_LE(frame.insertions.size(), 12U);
  const auto of_frame = directions(frame);
  EXPECT_GE(of_frame.size(), 3U);
  EXPECT_TRUE(of_frame.contains({0, 0, -1}));
}

}  // namespace
}  // namespace feeler::workflow
