#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/policies/storage/database.h"
#include "tests/policies/random_policy.h"

namespace feeler::policies {

inline DatabaseIdentity Identity() {
  return {"plug", "a1b2c3", "closed", "singleton", {1.0, 0.0, 0.25}, R"({"solver": "rtdp-bel", "epsilon": 1.2})",
          "0.1.0"};
}

inline StoredProblem RandomProblem(const planner::Extents& extents, std::uint64_t seed) {
  RandomStream random(seed, static_cast<std::uint64_t>(extents.Count()), "stored problem");
  StoredProblem problem;
  problem.extents = extents;
  problem.status = "converged";
  if (random.Index(3) == 0) {
    problem.solver = "certified";
    problem.gap = 1.15;
  } else {
    problem.solver = "rtdp-bel";
    problem.epsilon = 1.2;
  }
  problem.policy = RandomPolicy(random, 20 + random.Index(100), random.Index(3) != 0);
  problem.expected_cost = problem.policy->expected_cost;
  problem.lower_bound = problem.policy->lower_bound;
  problem.expansions = static_cast<std::int64_t>(random.Index(1'000'000));
  problem.seed = random.Next();
  problem.version = "0.1.0";
  problem.cpu_s = random.Uniform();
  problem.wall_s = random.Uniform();
  return problem;
}

/// Distinct extents in random order; every seventh without a policy.
inline std::vector<StoredProblem> RandomProblems(int count, std::uint64_t seed) {
  std::vector<StoredProblem> problems;
  for (int i = 0; i < count; ++i) {
    const planner::Extents extents{2 + i % 14, 2 + i / 14 % 14, 2 + i / 196};
    problems.push_back(RandomProblem(extents, seed));
    if (i % 7 != 6) continue;
    problems.back().policy.reset();
    problems.back().status = "time_limit";
    problems.back().expected_cost = std::numeric_limits<double>::infinity();
  }
  RandomStream random(seed, 0, "order");
  for (std::size_t k = problems.size(); k > 1; --k) std::swap(problems[k - 1], problems[random.Index(k)]);
  return problems;
}

inline bool Same(const StoredProblem& a, const StoredProblem& b) {
  return a.extents == b.extents && a.status == b.status && a.solver == b.solver && SameBits(a.Promise(), b.Promise()) &&
         SameBits(a.expected_cost, b.expected_cost) && SameBits(a.lower_bound, b.lower_bound) &&
         a.expansions == b.expansions && a.seed == b.seed && a.version == b.version && a.cpu_s == b.cpu_s &&
         a.wall_s == b.wall_s && a.policy.has_value() == b.policy.has_value() &&
         (!a.policy || Identical(*a.policy, *b.policy));
}
inline bool operator==(const StoredProblem& a, const StoredProblem& b) { return Same(a, b); }

inline void ExpectSame(const std::optional<StoredProblem>& a, const StoredProblem& b) {
  ASSERT_TRUE(a.has_value());
  EXPECT_TRUE(Same(*a, b));
}

/// The message of the InputError that `body` must throw.
inline std::string ErrorOf(const std::function<void()>& body) {
  try {
    body();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

inline std::string ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

/// A folder of its own for each test, removed at the end.
class DatabaseFixture : public testing::Test {
 protected:
  void SetUp() override {
    // In memory where there is such a place: these tests write thousands of files.
    const bool in_memory = access("/dev/shm", W_OK) == 0;
    std::string name = (in_memory ? "/dev/shm" : std::filesystem::temp_directory_path().string()) + "/feeler_db_XXXXXX";
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::string& folder() const { return folder_; }
  std::string path() const { return folder_ + "/test.db"; }
  std::vector<std::string> FilesInFolder() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }

 private:
  std::string folder_;
};

}  // namespace feeler::policies
