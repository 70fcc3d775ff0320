// Settings that change where contact occurs. Laws: each is refused, by name of element and attribute, whether it stands
// at a geom or in a default; written out with the default's value it adds nothing to the fingerprint; numbers that are
// none, or that no simulation means, are refused by name; a flat mesh is one line; an OBJ of several objects is
// refused.

#include "feeler/env/model/contact_settings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <locale>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/geometry_findings.h"
#include "feeler/env/model/mesh_check.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

using Change = std::function<void(TaskText&)>;

std::string RefusalOf(const Change& change) {
  TaskText text;
  change(text);
  try {
    LoadTaskFromText(text.Mjcf(), "peg.xml");
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).ends_with(')')) << "says not how to mend it: " << error.what();
    return error.what();
  }
  return "";
}

Change Insert(const char* after, const char* what) {
  return [=](TaskText& t) {
    for (std::string* part : {&t.tool, &t.target}) {
      const auto at = part->find(after);
      if (at != std::string::npos) part->insert(at + std::string(after).size(), what);
    }
  };
}

void ExpectParts(const std::string& message, const std::vector<std::string>& parts) {
  EXPECT_FALSE(message.empty());
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  for (const std::string& part : parts) EXPECT_NE(message.find(part), std::string::npos) << part << " in: " << message;
}

TEST(ContactSettings, WhatMovesContactIsRefusedByName) {
  const std::vector<std::pair<Change, std::vector<std::string>>> cases = {
      {Insert("name=\"west\"", " margin=\"0.001\""), {"<geom name=\"west\">", "margin", "1 mm"}},
      {Insert("name=\"peg\"", " gap=\"0.0005\""), {"<geom name=\"peg\">", "gap"}},
      {[](TaskText& t) { t.extra = "<default><geom margin=\"0.002\"/></default>"; }, {"margin", "<default>"}},
      {Insert("name=\"peg\"", " contype=\"2\" conaffinity=\"2\""), {"<geom name=\"peg\">", "contype 2", "4 of the 4"}},
      {Insert("name=\"north\"", " contype=\"2\" conaffinity=\"2\""), {"<geom name=\"peg\">", "1 of the 4"}},
      {[](TaskText& t) { t.extra = R"(<contact><pair geom1="peg" geom2="west"/></contact>)"; }, {"<contact><pair>"}},
      {[](TaskText& t) { t.extra = R"(<contact><exclude body1="tool" body2="target"/></contact>)"; }, {"<exclude>"}},
      {[](TaskText& t) { t.extra = R"(<equality><weld body1="tool" body2="target"/></equality>)"; }, {"<equality>"}},
  };
  for (const auto& [change, parts] : cases) ExpectParts(RefusalOf(change), parts);
}

TEST(ContactSettings, DefaultsWrittenOutAddNothing) {
  const std::string base = Fingerprint(LoadTaskFromText(TaskText().Mjcf(), "peg.xml"), Opening::kClosed);
  const std::vector<Change> changes = {
      Insert("name=\"west\"", " margin=\"0\" gap=\"0\" contype=\"1\" conaffinity=\"1\""),
      Insert("name=\"peg\"", " contype=\"1\" conaffinity=\"0\" solref=\"0.02 1\" friction=\"0.5 0.005 0.0001\""),
  };
  for (const Change& change : changes) {
    TaskText text;
    change(text);
    EXPECT_EQ(Fingerprint(LoadTaskFromText(text.Mjcf(), "peg.xml"), Opening::kClosed), base);
  }
}

TEST(Numbers, AreFiniteAndMeanSomethingByName) {
  ExpectParts(RefusalOf(Insert("name=\"peg\"", " mass=\"nan\"")), {"<geom name=\"peg\">", "mass", "nan"});
  ExpectParts(RefusalOf(Insert("name=\"west\"", " friction=\"1e999 0 0\"")),
              {"<geom name=\"west\">", "friction", "1e999"});
  ExpectParts(RefusalOf([](TaskText& t) { t.target_body = R"(<body name="target" pos="0.6 -inf 0.2">)"; }),
              {"<body name=\"target\">", "pos", "-inf"});
  ExpectParts(RefusalOf(Insert("name=\"east\"", " friction=\"-0.3 0.005 0.0001\"")),
              {"<geom name=\"east\">", "friction -0.3"});
  ExpectParts(RefusalOf(Insert("name=\"east\"", " solref=\"0.01 -1\"")), {"<geom name=\"east\">", "solref"});
  ExpectParts(RefusalOf(Insert("name=\"east\"", " solimp=\"0.9 0.95 0.001 7 2\"")), {"<geom name=\"east\">", "7"});
  ExpectParts(RefusalOf(Insert("name=\"east\"", " solmix=\"-1\"")), {"<geom name=\"east\">", "solmix -1"});
  ExpectParts(RefusalOf([](TaskText& t) { t.target_body = R"(<body name="target" pos="0.6 0 1e300">)"; }),
              {"<body name=\"target\">", "pos", "1e300", "1000 m"});
  // A body may be called anything.
  TaskText text;
  text.target += R"(<body name="nan"><geom name="infinity" size="0.001" contype="0" conaffinity="0"/></body>)";
  EXPECT_NO_THROW(LoadTaskFromText(text.Mjcf(), "peg.xml"));
}

TEST(Numbers, OfAnIncludedFileAreNamedWithThatFileAndItsLine) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "included_numbers";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "part.xml") << "<mujoco>\n\n<geom name=\"stop\" size=\"0.01\" mass=\"nan\"/>\n</mujoco>\n";
  TaskText text;
  text.target += R"(<include file="part.xml"/>)";
  try {
    LoadTaskFromText(text.Mjcf(), "peg.xml", folder);
    ADD_FAILURE() << "no error";
  } catch (const InputError& error) {
    ExpectParts(error.what(), {"part.xml: <geom name=\"stop\"> in line 3", "mass", "nan"});
  }
  std::filesystem::remove_all(folder);
}

TEST(ContactParameters, TellModelsThatFeelDifferent) {
  const auto of = [](const std::function<void(TaskText&)>& change) {
    TaskText text;
    change(text);
    const TaskModel m = LoadTaskFromText(text.Mjcf(), "peg.xml");
    return ContactParameters(*m.model, m.tool_geoms, m.target_geoms, m.tool_body, m.target_body);
  };
  const auto plain = of([](TaskText&) {});
  EXPECT_EQ(plain, of([](TaskText& t) { t.numbers["feeler_cost"] = "2 0 0"; })) << "costs are not felt";
  const auto rough = of(Insert("name=\"east\"", " friction=\"0.4 0.005 0.0001\""));
  EXPECT_EQ(rough.at("friction_least"), 0.4);
  EXPECT_GT(rough.at("friction_most"), 0.4);
  for (const std::string& change : {std::string(" friction=\"0.4 0.005 0.0001\""), std::string(" solref=\"0.03 1\""),
                                    std::string(" solimp=\"0.8 0.9 0.001\""), std::string(" condim=\"6\"")}) {
    EXPECT_NE(of(Insert("name=\"east\"", change.c_str())).at("digest"), plain.at("digest")) << change;
  }
  const auto heavy = of(Insert("name=\"peg\"", " mass=\"0.7\""));
  EXPECT_EQ(heavy.at("tool_mass_kg"), 0.7);
  EXPECT_NE(heavy.at("digest"), plain.at("digest"));
}

TEST(Meshes, FlatIsOneLineWithItsName) {
  testing::internal::CaptureStderr();
  const std::string message = RefusalOf([](TaskText& t) {
    t.extra = R"(<asset><mesh name="sheet" vertex="0 0 0  1 0 0  0 1 0  1 1 0  0.5 0.5 0"/></asset>)";
    t.target += R"(<geom type="mesh" mesh="sheet" contype="0" conaffinity="0"/>)";
  });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  ExpectParts(message, {"<mesh name=\"sheet\">", "plane"});
}

TEST(Meshes, ADeviceOrAPipeIsNotRead) {
  const std::filesystem::path link = std::filesystem::path(testing::TempDir()) / "endless.stl";
  std::filesystem::remove(link);
  std::filesystem::create_symlink("/dev/zero", link);
  for (const char* asset : {R"(<mesh name="m" file=")", R"(<texture name="m" type="2d" file=")"}) {
    const std::string message =
        RefusalOf([&](TaskText& t) { t.extra = std::string("<asset>") + asset + link.string() + "\"/></asset>"; });
    ExpectParts(message, {"in line ", "endless.stl is not a regular file"});
  }
  std::filesystem::remove(link);
}

TEST(Meshes, AnObjOfSeveralObjectsIsRefused) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "two_objects.obj";
  std::ofstream(file) << "o core\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\no shell\nf 2 3 4\n";
  const std::string xml = "<mujoco><asset><mesh name=\"m\" file=\"" + file.string() + "\"/></asset></mujoco>";
  const TaskFindings findings = MeshFindings(xml, "peg.xml");
  ASSERT_EQ(findings.size(), 1U);
  ExpectParts(findings[0].what, {"2 objects", "core, shell", "1 would be lost"});
  std::filesystem::remove(file);
}

TEST(Geometry, ToleranceNamesTheLargestThatWorks) {
  const std::string message = RefusalOf([](TaskText& t) { t.numbers["feeler_tolerance_lateral"] = "0.0013"; });
  ExpectParts(message, {"feeler_tolerance_lateral", "x -1.000 +1.000 mm", "at most 0.001 m"});
}

TEST(Geometry, SizesInMillimetresAreNamed) {
  ExpectParts(RefusalOf([](TaskText& t) { t.tool = R"(<geom name="peg" type="box" size="4 4 15" pos="0 0 15"/>)"; }),
              {"<body name=\"tool\">", "30 m long", "millimetres"});
}

TEST(Geometry, AKeyUpsideDownNamesTheTurnAndTheGeoms) {
  const std::string message = RefusalOf([](TaskText& t) {
    t.tool += R"(<geom name="key" type="box" size="0.0005 0.0004 0.015" pos="0 0.0044 0.015"/>)";
    t.target += R"(<geom name="stop" type="box" size="0.005 0.0004 0.01" pos="0 0.0046 -0.01"/>)";
  });
  ExpectParts(message, {"\"key\" of tool", "\"stop\" of target", "turned by 180 degrees"});
}

TEST(Geometry, OriginsThatAreElsewhereAreMeasured) {
  ExpectParts(RefusalOf([](TaskText& t) {
                t.tool = R"(<geom name="peg" type="box" size="0.004 0.004 0.015" pos="0.003 0 0.015"/>)";
              }),
              {"displaced by (-", "origin of the tool"});
}

TEST(Geometry, AHoleThatIsOneMeshIsNamedAsSuch) {
  // A frame: an outer square with a square hole, as one closed mesh.
  const std::string message = RefusalOf([](TaskText& t) {
    t.extra = FrameMesh(0.03);
    t.target = R"(<geom name="frame" type="mesh" mesh="frame"/>
      <geom name="lid" type="box" size="0.005 0.005 0.01" pos="0 0 -0.01" contype="0" conaffinity="0"/>)";
  });
  ExpectParts(message, {"\"frame\" is one mesh", "convex hull", "three ways"});
}

TEST(Lid, MissingMisnamedAndUselessAreFound) {
  const auto findings = [](const Change& change) {
    TaskText text;
    change(text);
    return LidFindings(LoadTaskFromText(text.Mjcf(), "peg.xml"), "peg.xml");
  };
  const auto rename = [](TaskText& t) { t.target.replace(t.target.find("\"lid\""), 5, "\"cover\""); };
  EXPECT_TRUE(findings([](TaskText&) {}).empty());
  const TaskFindings misnamed = findings(rename);
  ASSERT_EQ(misnamed.size(), 1U);
  ExpectParts(misnamed[0].where, {"cover"});
  const TaskFindings missing = findings([](TaskText& t) { t.target.erase(t.target.find("<geom name=\"lid\"")); });
  ASSERT_EQ(missing.size(), 1U);
  ExpectParts(missing[0].what, {"no lid"});
}

TEST(Locale, OfTheHostDoesNotReachTheNumbers) {
  class Comma : public std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::string mjcf = TaskText().Mjcf();
  const std::string plain = Fingerprint(LoadTaskFromText(mjcf, "peg.xml"), Opening::kClosed);
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
  std::string fingerprint;
  try {
    fingerprint = Fingerprint(LoadTaskFromText(mjcf, "peg.xml"), Opening::kClosed);
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what();
  }
  const bool kept = std::locale() != std::locale::classic();
  std::locale::global(before);
  EXPECT_TRUE(kept);  // the host's own is put back
  EXPECT_EQ(fingerprint, plain);
}

}  // namespace
}  // namespace feeler::env
