// Laws of the readers of part files: what a file holds is read however it is written; what is damaged or of another
// form is refused, with the place and the cause.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "feeler/cad/readers/read_part.h"
#include "feeler/cad/readers/zip_model.h"
#include "feeler/cad/step/read_step.h"
#include "tests/cad/kinds/part_shapes.h"
#include "tests/cad/part_folder.h"

namespace feeler::cad {
namespace {

namespace fs = std::filesystem;

class Files : public PartFolder {
 protected:
  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  static RawPart Raw(const std::string& source) {
    return ReadPart(ParseSource(source), [](const fs::path& file) { return ReadStep(file); });
  }
};

constexpr char kFacet[] =
    "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

TEST_F(Files, OfAnStlTheCauseIsNamed) {
  std::string binary(84, '\0');
  binary[80] = 2;
  const std::string facet(50, '\1');
  EXPECT_EQ(Raw(Write("whole.stl", binary + facet + facet)).bodies.front().mesh.size(), 2);
  EXPECT_THAT(MessageOf([&] { Raw(Write("cut.stl", binary + facet)); }),
              testing::HasSubstr("cut short: 1 of its 2 triangles are there"));
  EXPECT_THAT(Raw(Write("more.stl", binary + facet + facet + "xyz")).notes,
              testing::Contains(testing::HasSubstr("3 bytes after the 2 triangles")));
  EXPECT_THAT(MessageOf([&] { Raw(Write("empty.stl", "")); }), testing::HasSubstr("is empty"));
  EXPECT_THAT(MessageOf([&] { Raw(Write("text.stl", "solid a\nendsolid\n")); }),
              testing::HasSubstr("without one facet"));
  EXPECT_THAT(MessageOf([&] { Raw(Write("half.stl", "solid a\nfacet\nouter loop\nvertex 0 0 0\n")); }),
              testing::HasSubstr("within a facet"));
}

// No reader makes room for what a header promises and no file holds.
TEST_F(Files, APlyHoldsWhatItsHeaderSpeaksOf) {
  const auto ply = [](const std::string& vertices, const std::string& faces) {
    return "ply\nformat ascii 1.0\nelement vertex " + vertices +
           "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
           "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  };
  EXPECT_EQ(Raw(Write("sound.ply", ply("3", "1"))).bodies.front().mesh.size(), 1);
  for (const std::string many : {"4294967295", "999999999999", "1e308", "-1", "many", ""}) {
    EXPECT_THAT(MessageOf([&] { Raw(Write("bad.ply", ply(many, "1"))); }),
                testing::HasSubstr("bad.ply: line 3: the header speaks of more elements \"vertex\""))
        << many;
    EXPECT_THAT(MessageOf([&] { Raw(Write("bad.ply", ply("3", many))); }), testing::HasSubstr("line 7")) << many;
  }
}

/// The bytes of a number, least first or last.
template <typename T>
std::string BytesOf(T value, bool big) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  if (big) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

// A square (one face of four corners) with normals, colours and edges beside it, in all three formats.
TEST_F(Files, APlyIsReadInAllItsFormats) {
  const std::string header =
      "comment of a square\nelement vertex 4\nproperty double x\nproperty float nx\nproperty double y\n"
      "property double z\nproperty uchar red\nelement edge 1\nproperty int vertex1\nelement face 1\n"
      "property short flags\nproperty list ushort uint vertex_index\nend_header\n";
  const double corners[4][3] = {{0, 0, 0.5}, {2, 0, 0.5}, {2, 1, 0.5}, {0, 1, 0.5}};
  std::string ascii = "ply\r\nformat ascii 1.0\n" + header;
  for (const auto& c : corners) ascii += fmt::format("{} 0.25 {} {} 255\n\n", c[0], c[1], c[2]);
  ascii += "7\n-3 4 0 1 2 3\n";
  std::vector<std::string> files{ascii};
  for (const bool big : {false, true}) {
    std::string text = fmt::format("ply\nformat binary_{}_endian 1.0\n{}", big ? "big" : "little", header);
    for (const auto& c : corners) {
      text += BytesOf(c[0], big) + BytesOf(0.25F, big) + BytesOf(c[1], big) + BytesOf(c[2], big) + '\xff';
    }
    text += BytesOf(std::int32_t{7}, big) + BytesOf(std::int16_t{-3}, big) + BytesOf(std::uint16_t{4}, big);
    for (std::uint32_t k = 0; k < 4; ++k) text += BytesOf(k, big);
    files.push_back(text);
  }
  for (const std::string& text : files) {
    const RawPart part = Raw(Write("square.ply", text));
    ASSERT_EQ(part.bodies.size(), 1u) << part.format;
    const TriangleMesh& mesh = part.bodies.front().mesh;
    ASSERT_EQ(mesh.points.size(), 4u) << part.format;
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(mesh.points[k], Eigen::Vector3d(corners[k][0], corners[k][1], corners[k][2])) << part.format;
    }
    double area = 0.0;
    for (const auto& t : mesh.triangles) {
      const auto at = [&](int k) { return mesh.points[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])]; };
      area += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).z();
    }
    EXPECT_DOUBLE_EQ(area, 2.0) << part.format;
    EXPECT_THAT(part.notes, testing::Contains(testing::HasSubstr("1 elements \"edge\""))) << part.format;
  }
  // Cut short anywhere behind the header: said, never read as less.
  for (const std::string& text : files) {
    for (const std::size_t less : {std::size_t{3}, std::size_t{20}, std::size_t{60}}) {
      EXPECT_NE(MessageOf([&] { Raw(Write("short.ply", text.substr(0, text.size() - less))); }), "") << less;
    }
  }
}

TEST_F(Files, APlyOfAnotherFormIsRefusedWhereItIs) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string points = "end_header\n0 0 0\n1 0 0\n0 1 0\n";
  const auto message = [&](const std::string& text) { return MessageOf([&] { Raw(Write("bad.ply", text)); }); };
  const std::pair<std::string, std::string> bad[] = {
      {head + "end_header\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", "line 11: fewer numbers than a vertex has"},
      {head + points + "3 0 1 2 9\n", "line 13: more numbers than a face has"},
      {head + points + "3 0 1 3\n", "line 13: a face names vertex 3, of 3"},
      {head + points + "3 0 1 -1\n", "line 13: a face names vertex -1"},
      {head + points + "-3 0 1 2\n", "line 13: a list of no sound length"},
      {head + points + "1e9 0 1 2\n", "line 13: a list of no sound length"},
      {head + points + "2 0 1\n", "line 13: a face of fewer than three corners"},
      {head + points, "the file ends after 0 of 1 face"},
      {head, "the header has no end"},
      {"ply\nelement vertex 0\nend_header\n", "the header names no format"},
      {"ply\nformat binary_middle_endian 1.0\nend_header\n", "line 2: the format is none of"},
      {"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3: a property before the first element"},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty text x\nend_header\n", "line 4: a property of no known type"},
      {"PLY\n", "does not begin with \"ply\""},
      {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "no x, y and z"},
      {head + "end_header\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", "line 10: a vertex that is not finite"},
  };
  for (const auto& [text, wanted] : bad) EXPECT_THAT(message(text), testing::HasSubstr(wanted)) << text;
}

TEST_F(Files, AsciiStlIsReadHoweverItIsWritten) {
  std::string shouted = std::string("solid a\n") + kFacet + "endsolid a\nsolid b\n" + kFacet + kFacet + "endsolid b\n";
  for (char& c : shouted) c = static_cast<char>(std::toupper(c));
  std::string old = shouted;
  std::replace(old.begin(), old.end(), '\n', '\r');
  for (const std::string& text : {shouted, old}) {
    const std::string file = Write("a.stl", text);
    EXPECT_EQ(Raw(file).bodies.size(), 2U);
    EXPECT_EQ(Raw(file + "#B").bodies.front().mesh.size(), 2);
    EXPECT_EQ(Raw(file + "#1").bodies.front().mesh.size(), 1);
  }
}

TEST_F(Files, ObjTabsLinesThatGoOnBodiesAndFacesThatAreNotConvex) {
  const std::string file = Write("a.obj",
                                 "v\t0 0 0\nv 2 0 0\nv 2 2 0\nv 1 \\\n 0.5 0\nv 0 2 0\n"
                                 "o first\ng left\nf\t1 2 3 \\\n4 5\no second\nf 1/1/1 2//2 3\n");
  const RawPart part = Raw(file);
  ASSERT_EQ(part.bodies.size(), 2U);
  const TriangleMesh& arrow = part.bodies.front().mesh;
  ASSERT_EQ(arrow.size(), 3);
  EXPECT_NEAR(AreaOf(arrow), 2.5, 1e-12);  // a fan would cover more
  for (int t = 0; t < arrow.size(); ++t) EXPECT_GT(AreaVector(arrow, t).z(), 0);
  EXPECT_EQ(Raw(file + "#left").bodies.front().mesh.size(), 3);
  EXPECT_EQ(Raw(file + "#second").bodies.front().mesh.size(), 1);
}

TEST_F(Files, A3mfFileSaysItsUnit) {
  const std::string file = WriteParts("rectangle", folder_, "3mf").tool;
  EXPECT_EQ(GuessUnit(Raw(file)).unit.name, "millimeter");
  std::ifstream in(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::size_t at = bytes.find("unit=\"millimeter\"");
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 17, "unit=\"inch\"      ");
  EXPECT_EQ(UnitOfModel(bytes).value().metres, 0.0254);
}

}  // namespace
}  // namespace feeler::cad
