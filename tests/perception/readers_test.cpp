// Laws: every encoding of the same points reads as the same points (oracle: the points that were written), those that
// are not finite left out; a depth image read back gives the depths to half a unit; what is cut off, damaged, of
// wrong units or of another size than its camera is refused with words that say so.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "feeler/core/error.h"
#include "feeler/perception/cloud_file.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/input_file.h"
#include "tests/perception/sample_files.h"

namespace feeler::perception {
namespace {

using testing::HasSubstr;

template <class Call>
std::string Complaint(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

void ExpectSame(const Points& read, const Points& written) {
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i], written[i]) << i;
}

TEST(CloudFile, EveryEncodingHoldsTheSamePoints) {
  const Points points = SamplePoints();  // exact in floats
  ExpectSame(ParseCloud(AsciiPly(points), "a.ply"), points);
  ExpectSame(ParseCloud(BinaryPly(points, false), "l.ply"), points);
  ExpectSame(ParseCloud(BinaryPly(points, true), "b.ply"), points);
  ExpectSame(ParseCloud(AsciiPcd(points), "a.pcd"), points);
  ExpectSame(ParseCloud(BinaryPcd(points), "b.pcd"), points);
}

TEST(CloudFile, WhatIsCutOffIsRefused) {
  const Points points = SamplePoints();
  for (const std::string& whole : {BinaryPly(points, false), BinaryPly(points, true), BinaryPcd(points)}) {
    for (std::size_t size = 1; size < whole.size(); size += 7) {
      EXPECT_NE(Complaint([&] { ParseCloud(whole.substr(0, size), "cut"); }), "") << size;
    }
  }
  const std::string text = AsciiPcd(points);
  EXPECT_THAT(Complaint([&] { ParseCloud(text.substr(0, text.size() - 20), "cut.pcd"); }), HasSubstr("cut off"));
}

// A text is read line by line: a number too few or too many in one line does not shift what follows.
TEST(CloudFile, ALineOfAnotherLengthIsNamed) {
  const std::string head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 3\nHEIGHT 1\nDATA ascii\n";
  const auto complaint = [&](const std::string& body) { return Complaint([&] { ParseCloud(head + body, "t.pcd"); }); };
  EXPECT_EQ(complaint("1 2 3\n4 5 6\n7 8 9\n"), "");
  EXPECT_THAT(complaint("1 2 3\n4 5\n6 7 8\n9 9 9\n"), HasSubstr("line 8"));
  EXPECT_THAT(complaint("1 2 3 1\n4 5 6 1\n7 8 9 1\n"), HasSubstr("line 7"));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2\n3 4 5 6\n";
  EXPECT_THAT(Complaint([&] { ParseCloud(ply, "t.ply"); }), HasSubstr("line 8"));
}

TEST(CloudFile, OddHeadersAreRead) {
  const Points points = SamplePoints();
  const std::string text = AsciiPcd(points);
  ExpectSame(ParseCloud("\xEF\xBB\xBF" + text, "bom.pcd"), points);
  ExpectSame(ParseCloud("\n  \n# note\n" + text, "blank.pcd"), points);
  std::string carriage = text;
  for (char& c : carriage) c = c == '\n' ? '\r' : c;
  ExpectSame(ParseCloud(carriage, "cr.pcd"), points);
  const std::string odd =
      "points 1\nheight 1\nwidth 1 \ncount 1 1 1\ntype F F F\nsize 4 4 4\nfields x y z\ndata ascii \n";
  ExpectSame(ParseCloud(odd + "1 2 3 \n", "odd.pcd"), {Eigen::Vector3d(1.0, 2.0, 3.0)});
}

TEST(CloudFile, AViewpointIsSaidToBeIgnored) {
  const std::string head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\n";
  std::vector<std::string> notes;
  ParseCloud(head + "VIEWPOINT 0 0 0 1 0 0 0\nDATA ascii\n1 2 3\n", "v.pcd", &notes);
  EXPECT_THAT(notes, testing::IsEmpty());
  ParseCloud(head + "VIEWPOINT 0 0 1.5 1 0 0 0\nDATA ascii\n1 2 3\n", "v.pcd", &notes);
  EXPECT_THAT(notes, testing::ElementsAre(HasSubstr("VIEWPOINT")));
}

// 24 bytes, field after field: x = (1, 1), y = (1, 1), z = (1, 2). After the literal 1.0F, a copy of 16 bytes from 4
// back, which overlaps with itself, then literals.
TEST(CloudFile, CompressedPointsAreRead) {
  const std::string head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA binary_compressed\n";
  const std::string block("\x03\x00\x00\x80\x3f\xe0\x07\x03\x03\x00\x00\x00\x40", 13);
  const std::string sizes("\x0d\x00\x00\x00\x18\x00\x00\x00", 8);
  ExpectSame(ParseCloud(head + sizes + block, "c.pcd"), {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, 1, 2)});
  for (std::size_t cut = 1; cut <= block.size(); ++cut) {
    EXPECT_NE(Complaint([&] { ParseCloud(head + sizes + block.substr(0, block.size() - cut), "c.pcd"); }), "") << cut;
  }
  std::string far = block;
  far[7] = '\x7f';  // a copy from before the start
  EXPECT_THAT(Complaint([&] { ParseCloud(head + sizes + far, "c.pcd"); }), HasSubstr("damaged"));
}

TEST(InputFile, ADeviceWithoutEndIsRefused) {
  EXPECT_THAT(Complaint([] { ReadFile("/dev/zero"); }), HasSubstr("does not end"));
}

TEST(CloudFile, MeshesMillimetresAndEmptyAreSaid) {
  Points millimetres = SamplePoints();
  for (Eigen::Vector3d& p : millimetres) p *= 1000.0;
  EXPECT_THAT(Complaint([&] { ParseCloud(AsciiPly(millimetres), "mm.ply"); }), HasSubstr("millimetres"));
  EXPECT_THAT(Complaint([&] { ParseCloud(AsciiPcd({}), "none.pcd"); }), HasSubstr("no point"));
  EXPECT_THAT(Complaint([&] { ParseCloud("", "empty"); }), HasSubstr("empty"));
  EXPECT_THAT(Complaint([&] { ParseCloud("solid stl", "x.stl"); }), HasSubstr("STL"));
  EXPECT_THAT(Complaint([&] { ParseCloud("# a\nv 1 2 3\n", "x.obj"); }), HasSubstr("OBJ"));
  EXPECT_THAT(Complaint([&] { ParseCloud("\n{}", "x"); }), HasSubstr("neither"));
}

TEST(DepthFile, ReadsWhatWasWritten) {
  const CameraIntrinsics camera = SampleCamera(9, 7);
  DepthFrame frame{9, 7, {}};
  for (int i = 0; i < 63; ++i) frame.depth_m.push_back(i % 5 == 0 ? 0.0F : 0.5F + 0.01234F * static_cast<float>(i));
  const std::string png = EncodeDepthPng(frame, camera.depth_scale_m);
  const DepthFrame read = ParseDepthPng(png, camera, "d.png");
  ASSERT_EQ(read.depth_m.size(), frame.depth_m.size());
  for (std::size_t i = 0; i < read.depth_m.size(); ++i) EXPECT_NEAR(read.depth_m[i], frame.depth_m[i], 0.000501);

  const CameraIntrinsics again = ParseIntrinsics(ToJson(camera), "c.json");
  EXPECT_EQ(again.width, camera.width);
  EXPECT_EQ(again.fx, camera.fx);
  EXPECT_TRUE(again.world_T_camera.isApprox(camera.world_T_camera, 1e-12));
}

TEST(DepthFile, RefusesWhatDoesNotFit) {
  const CameraIntrinsics camera = SampleCamera(9, 7);
  const DepthFrame frame{9, 7, std::vector<float>(63, 1.0F)};
  const std::string png = EncodeDepthPng(frame, 0.001);
  EXPECT_THAT(Complaint([&] { ParseDepthPng(png, SampleCamera(9, 8), "d.png"); }), HasSubstr("9 x 7"));
  CameraIntrinsics metres = camera;
  metres.depth_scale_m = 1.0;  // the image counts millimetres
  EXPECT_THAT(Complaint([&] { ParseDepthPng(png, metres, "d.png"); }), HasSubstr("depth_scale_m"));
  for (std::size_t size = 0; size < png.size(); ++size) {
    EXPECT_NE(Complaint([&] { ParseDepthPng(png.substr(0, size), camera, "d.png"); }), "") << size;
  }
  std::string flipped = png;
  flipped[png.size() / 2] = static_cast<char>(flipped[png.size() / 2] ^ 4);
  EXPECT_THAT(Complaint([&] { ParseDepthPng(flipped, camera, "d.png"); }), HasSubstr("d.png"));
  EXPECT_THROW(ToPoints(frame, SampleCamera(7, 9)), InputError);
  EXPECT_THROW(ParseIntrinsics("{\"width\": 640}", "c.json"), InputError);
  EXPECT_THROW(ParseIntrinsics("[1, 2", "c.json"), InputError);
}

// A plane seen squarely comes back as that plane, in the world.
TEST(DepthFile, PointsOfAPlaneLieInIt) {
  CameraIntrinsics camera = SampleCamera(40, 30);
  const Points points = ToPoints({40, 30, std::vector<float>(1200, 1.5F)}, camera);
  ASSERT_EQ(points.size(), 38U * 28U);
  for (const Eigen::Vector3d& p : points) EXPECT_NEAR((camera.world_T_camera.inverse() * p).z(), 1.5, 1e-6);
  const DepthFrame background{40, 30, std::vector<float>(1200, 1.505F)};
  EXPECT_TRUE(ToPoints({40, 30, std::vector<float>(1200, 1.5F)}, camera, {}, &background).empty());
}

}  // namespace
}  // namespace feeler::perception
