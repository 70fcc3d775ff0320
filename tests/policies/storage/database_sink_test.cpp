// Law: a family solved into a database and resumed after an interruption gives the same content as in one go and as
// with two jobs; every stored row replays against the contact map at its stored cost (1e-9).
#include "feeler/policies/storage/database_sink.h"

#include <gtest/gtest.h>

#include "feeler/planner/family/preprocess.h"
#include "feeler/policies/storage/verify.h"
#include "tests/policies/storage/database_fixture.h"

namespace feeler::policies {
namespace {

/// A closed block of 5 x 4 x 3 cells on a panel.
std::shared_ptr<const planner::ContactMap> BlockMap() {
  const CellBox domain{Cell(-24, -24, -16), Cell(24, 24, 24)};
  const auto blocked = [](const Cell& c) {
    return c.z() < -2 || (c.z() <= 0 && std::abs(c.x()) <= 2 && c.y() >= -1 && c.y() <= 2);
  };
  planner::ContactMap::Layer layer;
  for (auto& travel : layer.travel) travel.reserve(static_cast<std::size_t>(domain.Count()));
  for (int z = domain.min.z(); z <= domain.max.z(); ++z) {
    for (int y = domain.min.y(); y <= domain.max.y(); ++y) {
      for (int x = domain.min.x(); x <= domain.max.x(); ++x) {
        const Cell c(x, y, z);
        layer.blocked.push_back(blocked(c) ? 1 : 0);
        for (const Direction d : kDirections) {
          float travel = 0.0F;
          Cell next = c + UnitCell(d);
          while (!blocked(c) && domain.Contains(next) && !blocked(next)) travel += 1.0F, next += UnitCell(d);
          const bool free = !blocked(c) && !domain.Contains(next);
          layer.travel[IndexOf(d)].push_back(free         ? planner::ContactMap::kUnlimited
                                             : blocked(c) ? 0.0F
                                                          : travel + 0.5F);
        }
      }
    }
  }
  return std::make_shared<planner::ContactMap>(domain, std::vector{std::move(layer)}, Eigen::Vector3d::Zero(), 0.5);
}

class DatabaseSinkTest : public DatabaseFixture {
 protected:
  DatabaseSinkTest() {
    task_.name = "block";
    task_.start_offset_m = Eigen::Vector3d(0, 0, 0.016);
    task_.workspace_m = Eigen::Vector3d(0.04, 0.04, 0.03);
    options_.solver.solver = planner::SolverKind::kRtdpBel;
    options_.solver.epsilon = 1.5;
  }
  std::string Fill(const std::string& file, int jobs, const std::vector<std::string>& specs) {
    DatabaseIdentity identity = Identity();
    identity.task = task_.name;
    options_.jobs = Parallelism(jobs);
    for (const std::string& spec : specs) {
      Database database = Database::OpenOrCreate(folder() + file, identity);
      DatabaseSink sink(database, options_.solver);
      planner::Preprocess(task_, map_, planner::ParseProblemFamily(spec), options_, sink);
    }
    return Database::OpenReadOnly(folder() + file).ContentDigest();
  }

  Task task_;
  std::shared_ptr<const planner::ContactMap> map_ = BlockMap();
  planner::PreprocessOptions options_;
};

TEST_F(DatabaseSinkTest, ResumeAndJobsDoNotShow) {
  const std::string once = Fill("/once.db", 1, {"2..4x2..3x2..3"});
  EXPECT_EQ(Fill("/resumed.db", 1, {"2..3x2..3x2", "2..4x2..3x2..3"}), once);
  EXPECT_EQ(Fill("/jobs.db", 2, {"2..4x2..3x2..3"}), once);
  Database database = Database::OpenReadOnly(folder() + "/once.db");
  int rows = 0;
  database.ForEach([&](const StoredProblem& row) {
    const planner::Problem problem = planner::MakeCuboidProblem(task_, map_, row.extents);
    ASSERT_TRUE(row.policy) << row.status;
    const RowVerification verification = VerifyRow(row, problem);
    EXPECT_EQ(verification.fault, "");
    EXPECT_NEAR(verification.replayed_cost, row.expected_cost, 1e-9);
    ++rows;
  });
  EXPECT_EQ(rows, 12);
  EXPECT_EQ(database.Info().solved, 12);
}

}  // namespace
}  // namespace feeler::policies
