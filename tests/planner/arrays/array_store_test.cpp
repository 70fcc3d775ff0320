// Laws of arrays that processes of a host share:
//   - what is taken is what was kept, bit for bit; under another name, key or number of arrays, or after any damage,
//     nothing is;
//   - of several who need the same tables at once one makes them, and all have the values of tables made alone;
//   - a folder that cannot be written costs nothing but time, and is told; the oldest files make room;
//   - a lock has one holder, goes with it, and leaves no file.
#include "feeler/planner/arrays/array_store.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <numeric>
#include <thread>

#include "feeler/core/random.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/planner/family/problem_family.h"
#include "tests/planner/synthetic_pipe.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::planner {
namespace {

namespace fs = std::filesystem;

class ArrayStoreTest : public ::testing::Test {
 protected:
  ArrayStoreTest() {
    std::string name = (fs::temp_directory_path() / "feeler-arrays-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~ArrayStoreTest() override { fs::remove_all(folder_); }
  std::vector<fs::path> Files() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_)) files.push_back(entry.path());
    return files;
  }
  fs::path folder_;
};

std::vector<std::uint16_t> Numbers(std::size_t count, std::uint16_t first) {
  std::vector<std::uint16_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), first);
  return numbers;
}

std::vector<std::uint16_t> ValuesOf(const SharedArray<std::uint16_t>& array) { return {array.begin(), array.end()}; }

TEST_F(ArrayStoreTest, WhatIsTakenIsWhatWasKept) {
  const ArrayStore store(folder_, "key");
  SharedArray<std::uint16_t> one = Numbers(1000, 3), none = Numbers(0, 0), other = Numbers(77, 9);
  store.Keep<std::uint16_t>("numbers", {&one, &none, &other});
  SharedArray<std::uint16_t> a, b, c;
  ASSERT_TRUE(store.Take<std::uint16_t>("numbers", {&a, &b, &c}));
  EXPECT_EQ(ValuesOf(a), Numbers(1000, 3));
  EXPECT_TRUE(b.empty());
  EXPECT_EQ(ValuesOf(c), Numbers(77, 9));
  EXPECT_EQ(ValuesOf(one), Numbers(1000, 3));
  EXPECT_EQ(a.data(), SharedArray<std::uint16_t>(a).data());  // copies share
  // A mapping outlives its file.
  fs::remove(Files().at(0));
  EXPECT_EQ(ValuesOf(c), Numbers(77, 9));
  EXPECT_FALSE(store.Take<std::uint16_t>("numbers", {&a, &b, &c}));
}

TEST_F(ArrayStoreTest, NothingElseIsTaken) {
  const ArrayStore store(folder_, "key");
  SharedArray<std::uint16_t> kept = Numbers(200, 1);
  store.Keep<std::uint16_t>("numbers", {&kept});
  SharedArray<std::uint16_t> a, b;
  EXPECT_FALSE(store.Take<std::uint16_t>("number", {&a}));
  EXPECT_FALSE(store.WithKey("other").Take<std::uint16_t>("numbers", {&a}));
  EXPECT_FALSE(store.Take<std::uint16_t>("numbers", {&a, &b}));
  const fs::path file = Files().at(0);
  std::ifstream in(file, std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  std::vector<std::string> damaged = {"", good.substr(0, good.size() / 2), good + "x"};
  for (std::size_t at = 0; at < good.size(); ++at) {
    damaged.push_back(good);
    damaged.back()[at] = static_cast<char>(good[at] ^ 0x04);
  }
  for (const std::string& bytes : damaged) {
    fs::remove(file);
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_FALSE(store.Take<std::uint16_t>("numbers", {&a}));
  }
  // It is made anew in its place.
  store.Keep<std::uint16_t>("numbers", {&kept});
  EXPECT_TRUE(store.Take<std::uint16_t>("numbers", {&a}));
}

TEST_F(ArrayStoreTest, TheOldestFilesMakeRoom) {
  const ArrayStore store(folder_, "key", nullptr, 5000);
  for (const char* name : {"a", "b", "c"}) {
    SharedArray<std::uint16_t> array = Numbers(1000, 1);
    store.Keep<std::uint16_t>(name, {&array});
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // files are told apart by their times
    if (std::string(name) == "b") {
      SharedArray<std::uint16_t> used;
      EXPECT_TRUE(store.Take<std::uint16_t>("a", {&used}));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  SharedArray<std::uint16_t> array;
  EXPECT_TRUE(store.Take<std::uint16_t>("a", {&array}));
  EXPECT_FALSE(store.Take<std::uint16_t>("b", {&array}));
  EXPECT_TRUE(store.Take<std::uint16_t>("c", {&array}));
}

/// The bounds of a belief from many places.
std::vector<double> BoundsOf(const Problem& problem, const PlanningTables& tables) {
  HypothesisSets sets(problem, false);
  const auto set = sets.Find(problem.hypotheses);
  const auto heuristic = tables.MakeHeuristic(problem, sets);
  std::vector<double> bounds;
  ForEachCell({problem.start - Cell::Constant(4), problem.start + Cell::Constant(4)},
              [&](const Cell& robot) { bounds.push_back(heuristic->Weighted(*set, robot)); });
  return bounds;
}

/// Problems with tables of every kind.
std::vector<std::pair<Problem, HeuristicKind>> Cases() {
  const Task plug = testing::MakePlugTask();
  Problem flat = MakeCuboidProblem(plug, testing::MakePlugMap(false, {6, 5, 4}), {4, 3, 3});
  Problem moves = flat;
  moves.cost.per_action = 0.5;
  const Problem open = MakeCuboidProblem(plug, testing::MakePlugMap(true, {6, 5, 4}), {4, 3, 3});
  const Task pipe = testing::MakePipeTask(2, 2);
  const Problem oriented = MakeCuboidProblem(pipe, testing::MakePipeMap(pipe, 0.25), {2, 2, 1, 2, 2});
  return {{open, HeuristicKind::kCertificate},     {flat, HeuristicKind::kCertificate},
          {flat, HeuristicKind::kCuboids},         {moves, HeuristicKind::kCuboids},
          {flat, HeuristicKind::kLines},           {moves, HeuristicKind::kCertificate},
          {oriented, HeuristicKind::kCertificate}, {oriented, HeuristicKind::kLines}};
}

TEST_F(ArrayStoreTest, TablesThatAreSharedAreThoseMadeAlone) {
  const auto cases = Cases();
  for (std::size_t i = 0; i < cases.size(); ++i) {
    SCOPED_TRACE(i);
    const auto& [problem, heuristic] = cases[i];
    SolverOptions options;
    options.heuristic = heuristic;
    const auto alone = BuildPlanningTables(problem, options, Parallelism(1));
    const ArrayStore store(folder_, "");
    const auto made = BuildPlanningTables(problem, options, Parallelism(1), &store);
    const std::size_t files = Files().size();
    const auto mapped = BuildPlanningTables(problem, options, Parallelism(1), &store);
    EXPECT_GT(files, 0U);
    EXPECT_EQ(Files().size(), files);
    EXPECT_EQ(BoundsOf(problem, *made), BoundsOf(problem, *alone));
    EXPECT_EQ(BoundsOf(problem, *mapped), BoundsOf(problem, *alone));
    EXPECT_EQ(mapped->bytes(), alone->bytes());
  }
}

TEST_F(ArrayStoreTest, OfSeveralAtOnceOneMakesTables) {
  const Task task = testing::MakePipeTask(2, 2);
  const Problem problem = MakeCuboidProblem(task, testing::MakePipeMap(task, 0.25), {2, 2, 1, 2, 2});
  std::atomic<int> makers{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      SolverOptions options;
      bool made = false;
      options.on_tables = [&](std::int64_t, std::int64_t) { made = true; };
      const ArrayStore store(folder_, "");
      BuildPlanningTables(problem, options, Parallelism(1), &store);
      if (made) ++makers;
    });
  }
  threads.clear();
  EXPECT_EQ(makers, 1);
}

TEST_F(ArrayStoreTest, AFolderThatCannotBeWrittenIsTold) {
  const Problem problem = Cases().front().first;
  const fs::path file = folder_ / "file";
  std::ofstream(file) << "no folder";
  std::string told;
  const ArrayStore store(file, "", [&](const std::string& reason) { told = reason; });
  SolverOptions options;
  const auto tables = BuildPlanningTables(problem, options, Parallelism(1), &store);
  EXPECT_NE(told.find(file.string()), std::string::npos) << told;
  EXPECT_EQ(BoundsOf(problem, *tables), BoundsOf(problem, *BuildPlanningTables(problem, options, Parallelism(1))));
}

TEST_F(ArrayStoreTest, ALockHasOneHolderAndGoesWithIt) {
  const fs::path file = folder_ / "work.lock";
  int pipe_of_child[2];
  ASSERT_EQ(pipe(pipe_of_child), 0);
  const pid_t child = fork();
  if (child == 0) {
    const auto lock = HostLock::Acquire(file, [] { return true; });
    const char held = lock ? '1' : '0';
    if (write(pipe_of_child[1], &held, 1) != 1) _exit(1);
    while (true) pause();
  }
  char held = '0';
  ASSERT_EQ(read(pipe_of_child[0], &held, 1), 1);
  ASSERT_EQ(held, '1');
  int asked = 0;
  EXPECT_EQ(HostLock::Acquire(file, [&] { return ++asked < 3; }), nullptr);
  EXPECT_EQ(asked, 3);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_NE(HostLock::Acquire(file, [] { return false; }), nullptr);
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace
}  // namespace feeler::planner
