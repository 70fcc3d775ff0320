// Law: whatever the bytes, a reader returns finite data of the promised size or throws InputError with a message of one
// line; nothing else. 120,000 inputs: a seeded corpus of small sound files of every kind, mutated by flips, cuts,
// copied and deleted stretches, numbers at their limits; checksums of PNG chunks are mended in half of the cases, so
// that the damage reaches the decoder.
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/perception/cloud_file.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/uncertainty_table.h"
#include "tests/perception/sample_files.h"

namespace feeler::perception {
namespace {

std::string SampleTable() {
  UncertaintyTable table;
  table.task = "plug";
  table.fingerprint = "0123456789abcdef0123456789abcdef";
  table.axes = {{AxisKind::kX}, {AxisKind::kYaw, 0.05, 1, 5}};
  UncertaintyRule rule;
  rule.farthest_m = 1.0;
  rule.half = Eigen::Vector2d(0.01, 0.05);
  table.rules = table.plain_rules = {rule};
  return ToJson(table);
}

std::uint32_t Crc(const std::string& bytes, std::size_t from, std::size_t size) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = from; i < from + size; ++i) {
    crc ^= static_cast<unsigned char>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? 0xEDB88320U ^ (crc >> 1) : crc >> 1;
  }
  return crc ^ 0xFFFFFFFFU;
}

void MendChecksums(std::string& png) {
  for (std::size_t at = 8; at + 12 <= png.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(png[at + i]);
    if (length > png.size() - at - 12) return;
    const std::uint32_t crc = Crc(png, at + 4, length + 4);
    for (std::size_t i = 0; i < 4; ++i) png[at + 8 + length + i] = static_cast<char>(crc >> (24 - 8 * i));
    at += 12 + length;
  }
}

constexpr std::array<std::string_view, 14> kTexts = {
    "0",   "-1", "nan",          "1e999",       "99999999999999999999",
    "inf", "\n", "4294967295",   "element",     "property list uchar int x",
    " ",   "x",  "end_header\n", "DATA ascii\n"};

void Mutate(RandomStream& random, std::string& bytes) {
  const std::size_t rounds = 1 + random.Index(4);
  for (std::size_t round = 0; round < rounds && !bytes.empty(); ++round) {
    const std::size_t at = random.Index(bytes.size());
    const std::size_t length = random.Index(std::min<std::size_t>(32, bytes.size() - at) + 1);
    switch (random.Index(6)) {
      case 0: bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.Index(8))); break;
      case 1: bytes.resize(at); break;
      case 2: bytes.erase(at, length); break;
      case 3: bytes.insert(random.Index(bytes.size()), bytes.substr(at, length)); break;
      case 4: bytes.insert(at, kTexts[random.Index(kTexts.size())]); break;
      default:
        for (std::size_t i = at; i < std::min(bytes.size(), at + 4); ++i)
          bytes[i] = static_cast<char>(random.Index(2) == 0 ? 0xFF : 0);
    }
  }
}

TEST(ReadersFuzz, NothingCrashesThem) {
  const CameraIntrinsics camera = SampleCamera(9, 7);
  DepthFrame frame{9, 7, {}};
  for (int i = 0; i < 63; ++i) frame.depth_m.push_back(0.5F + 0.1F * static_cast<float>(i % 7));
  const Points points = SamplePoints();
  const std::vector<std::string> clouds = {AsciiPly(points), BinaryPly(points, false), BinaryPly(points, true),
                                           AsciiPcd(points), BinaryPcd(points)};
  const std::string png = EncodeDepthPng(frame, 0.001);
  const std::string intrinsics = ToJson(camera);
  const std::string table = SampleTable();

  int accepted = 0;
  int refused = 0;
  const auto tolerate = [&](const std::string& bytes, const auto& read) {
    try {
      read();
      ++accepted;
    } catch (const InputError& error) {
      ++refused;
      const std::string_view what = error.what();
      ASSERT_EQ(what.find('\n'), std::string_view::npos) << bytes;
    }
  };
  constexpr int kInputs = 120000;
  for (int i = 0; i < kInputs; ++i) {
    RandomStream random(7, static_cast<std::uint64_t>(i), "reader fuzz");
    const std::size_t kind = random.Index(clouds.size() + 3);
    if (kind < clouds.size()) {
      std::string bytes = clouds[kind];
      Mutate(random, bytes);
      tolerate(bytes, [&] {
        for (const Eigen::Vector3d& p : ParseCloud(bytes, "fuzz")) ASSERT_TRUE(p.allFinite());
      });
    } else if (kind == clouds.size()) {
      std::string bytes = png;
      Mutate(random, bytes);
      if (random.Index(2) == 0) MendChecksums(bytes);
      tolerate(bytes, [&] { ASSERT_EQ(ParseDepthPng(bytes, camera, "fuzz").depth_m.size(), 63U); });
    } else if (kind == clouds.size() + 1) {
      std::string bytes = intrinsics;
      Mutate(random, bytes);
      tolerate(bytes, [&] { ASSERT_GT(ParseIntrinsics(bytes, "fuzz").fx, 0.0); });
    } else {
      std::string bytes = table;
      Mutate(random, bytes);
      tolerate(bytes, [&] { ASSERT_FALSE(ParseTable(bytes, "fuzz").rules.empty()); });
    }
  }
  // The corpus is neither all rejected at the door nor left as it was.
  EXPECT_GT(accepted, kInputs / 100);
  EXPECT_GT(refused, kInputs / 4);
}

}  // namespace
}  // namespace feeler::perception
