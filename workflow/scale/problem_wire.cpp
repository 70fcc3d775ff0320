#include "feeler/workflow/scale/problem_wire.h"

#include <mutex>
#include <string_view>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/interrupted.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/io/policy_blob.h"

namespace feeler::workflow {
namespace {

constexpr const char* kWhere = "message between ranks";

void Put(policies::ByteWriter& out, const planner::Extents& extents) {
  for (int axis = 0; axis < planner::kAxisKinds; ++axis) out.Signed(extents[axis]);
}

planner::Extents ExtentsFrom(policies::ByteReader& in) {
  planner::Extents extents;
  for (int* count : {&extents.nx, &extents.ny, &extents.nz, &extents.n_yaw, &extents.n_pitch}) {
    *count = static_cast<int>(in.Signed());
  }
  return extents;
}

/// The policy that is the rest of a message, if there is one.
std::optional<planner::PolicyGraph> PolicyFrom(const policies::ByteReader& in) {
  if (in.failed()) throw Error(kWhere, "is damaged", "use one version of feeler on all ranks");
  if (in.rest().empty()) return std::nullopt;
  return policies::DecodePolicyBlob(in.rest(), kWhere);
}

}  // namespace

std::string ToBytes(const ProblemRequest& request) {
  policies::ByteWriter out;
  Put(out, request.extents);
  Put(out, request.similar ? request.similar->extents : planner::Extents{});
  std::string bytes = out.Take();
  if (request.similar) bytes += policies::EncodePolicyBlob(*request.similar->policy);
  return bytes;
}

ProblemRequest ProblemRequestFrom(const std::string& bytes) {
  policies::ByteReader in(bytes);
  ProblemRequest request;
  request.extents = ExtentsFrom(in);
  const planner::Extents similar = ExtentsFrom(in);
  if (auto policy = PolicyFrom(in)) {
    request.similar = {similar, std::make_shared<const planner::PolicyGraph>(std::move(*policy))};
  }
  return request;
}

std::string ToBytes(const planner::SolverResult& result) {
  policies::ByteWriter out;
  out.Varint(static_cast<std::uint64_t>(result.status));
  for (const double value : {result.expected_cost, result.lower_bound, result.cpu_s, result.wall_s}) out.Double(value);
  out.Signed(result.trials);
  out.Signed(result.expansions);
  std::string bytes = out.Take();
  if (result.policy) bytes += policies::EncodePolicyBlob(*result.policy);
  return bytes;
}

planner::SolverResult SolverResultFrom(const std::string& bytes) {
  policies::ByteReader in(bytes);
  planner::SolverResult result;
  const std::uint64_t status = in.Varint();
  if (status > static_cast<std::uint64_t>(planner::SolverStatus::kMemoryLimit)) {
    throw Error(kWhere, "is damaged", "use one version of feeler on all ranks");
  }
  result.status = static_cast<planner::SolverStatus>(status);
  for (double* value : {&result.expected_cost, &result.lower_bound, &result.cpu_s, &result.wall_s}) {
    *value = in.Double();
  }
  result.trials = in.Signed();
  result.expansions = in.Signed();
  result.policy = PolicyFrom(in);
  return result;
}

std::vector<planner::DistantSolver> DistantSolvers(Ranks& ranks, std::size_t problems) {
  std::vector<planner::DistantSolver> solvers;
  for (int lane = 0; lane < ranks.LanesFor(problems); ++lane) {
    solvers.push_back(
        [&ranks, lane](const planner::Extents& extents, const std::optional<planner::SimilarProblem>& similar) {
          try {
            return SolverResultFrom(ranks.Call(lane, ToBytes(ProblemRequest{extents, similar})));
          } catch (const Interrupted&) {
            planner::SolverResult given_up;
            given_up.status = planner::SolverStatus::kCancelled;
            return given_up;
          }
        });
  }
  return solvers;
}

void ServeProblems(Ranks& ranks, const std::string& identity, const Task& task,
                   std::shared_ptr<const planner::ContactMap> map, const planner::ProblemFamily& family,
                   const planner::PreprocessOptions& options) {
  std::once_flag once;
  std::optional<planner::FamilySolver> solver;
  ranks.Serve(identity, options.jobs.threads(), [&] {
    std::call_once(once, [&] { solver.emplace(task, map, family, options); });
    return [&solver](const std::string& request) {
      const ProblemRequest problem = ProblemRequestFrom(request);
      return ToBytes(solver->Solve(problem.extents, problem.similar));
    };
  });
}

}  // namespace feeler::workflow
