// Laws: of a table the widest rule of each axis of position is taken, axes that its task knows are certain, turns are
// left out and named; a table without positions, and a file that is no table, are refused.
#include "feeler/evaluation/cad_import/table_uncertainty.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"
#include "feeler/perception/uncertainty_table.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

class TableUncertaintyTest : public testing::Test {
 protected:
  ~TableUncertaintyTest() override { fs::remove(file_); }

  std::string Written(const std::vector<AxisKind>& axes, const std::vector<Eigen::VectorXd>& halves) {
    perception::UncertaintyTable table;
    table.task = "some-task";
    table.fingerprint = "abc";
    for (const AxisKind kind : axes) table.axes.push_back({kind, 0.002, 1, 20});
    for (const Eigen::VectorXd& half : halves) {
      const auto near_m = static_cast<double>(table.rules.size());
      table.rules.push_back({near_m, near_m + 1.0, Eigen::Vector3d::Zero(), half, 0.5 * half, 20});
    }
    table.plain_rules = table.rules;
    std::ofstream(file_) << perception::ToJson(table);
    return file_;
  }
  std::string file_ = (fs::path(testing::TempDir()) / "table_uncertainty.json").string();
};

TEST_F(TableUncertaintyTest, IsTheWidestRuleOfEachAxis) {
  const StatedUncertainty stated =
      UncertaintyOfTable(Written({AxisKind::kX, AxisKind::kY, AxisKind::kZ},
                                 {Eigen::Vector3d(0.004, 0.006, 0.002), Eigen::Vector3d(0.005, 0.0031234, 0.002)}));
  EXPECT_TRUE(stated.half_m.isApprox(Eigen::Vector3d(0.005, 0.006, 0.002), 1e-12));
  EXPECT_NE(stated.source.find("2 rules"), std::string::npos) << stated.source;
  EXPECT_NE(stated.source.find("some-task"), std::string::npos) << stated.source;
  EXPECT_EQ(stated.note, "");
}

TEST_F(TableUncertaintyTest, TurnsAreNamedAndKnownAxesAreCertain) {
  const StatedUncertainty stated = UncertaintyOfTable(
      Written({AxisKind::kX, AxisKind::kY, AxisKind::kYaw}, {Eigen::Vector3d(0.004, 0.0060001, 0.02)}));
  EXPECT_TRUE(stated.half_m.isApprox(Eigen::Vector3d(0.004, 0.006001, 0.0), 1e-12)) << "rounded up, to a micrometre";
  EXPECT_NE(stated.note.find("yaw of 0.020 rad"), std::string::npos) << stated.note;
}

TEST_F(TableUncertaintyTest, WhatHoldsNoPositionsIsRefused) {
  EXPECT_THROW(UncertaintyOfTable(Written({AxisKind::kYaw}, {Eigen::VectorXd::Constant(1, 0.02)})), InputError);
  std::ofstream(file_) << "{}";
  EXPECT_THROW(UncertaintyOfTable(file_), InputError);
  EXPECT_THROW(UncertaintyOfTable(file_ + ".missing"), InputError);
}

}  // namespace
}  // namespace feeler::evaluation
