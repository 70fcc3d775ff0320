#include "feeler/evaluation/acceptance/acceptance_contact_maps.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <ctime>

#include "feeler/env/contact/axis_visibility.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/contact/contact_map_check.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 2> kTasks = {"pipe-into-elbow", "elbow-onto-pipe"};
constexpr double kGrazing_m = 5e-5;

json MeasureMap(const std::string& name, std::int64_t probes, const ExperimentRequest& request) {
  const env::TaskModel task_model = env::LoadTask(name);
  const std::clock_t cpu_start = std::clock();
  const auto start = std::chrono::steady_clock::now();
  const planner::ContactMap map =
      env::BuildContactMap(task_model, env::Opening::kClosed, request.jobs, request.map_progress);
  const double cpu_s = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const env::ContactMapCheck check =
      env::CheckContactMap(task_model, env::Opening::kClosed, map, probes, request.seed, kGrazing_m, request.jobs);
  return {{"orientations", map.orientations()},
          {"displacements", map.domain().Count()},
          {"margin_cells", map.margin_cells()},
          {"walls_within_tenth", env::ShareOfWallsNear(map, 0.1)},
          {"cpu_s", cpu_s},
          {"wall_s", wall_s},
          {"probes", check.probes},
          {"blocked", check.blocked},
          {"grazing", check.grazing},
          {"disagreements", check.disagreements},
          {"agreement", check.agreement()}};
}

}  // namespace

ExperimentResult RunAcceptanceContactMaps(const ExperimentRequest& request) {
  const std::int64_t probes = request.quick ? 5000 : 100000;
  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {{"experiment", kAcceptanceContactMapsName},
                     {"version", FEELER_VERSION},
                     {"tasks", kTasks},
                     {"probes", probes},
                     {"grazing_m", kGrazing_m},
                     {"seed", request.seed}};
  CellStore cells(PartialFile(request, kAcceptanceContactMapsName), result.settings);
  std::int64_t done = 0;
  for (const char* task : kTasks) {
    if (request.cancellation != nullptr && request.cancellation->cancelled()) return result;
    if (cells.Find(task) == nullptr) cells.Put(task, MeasureMap(task, probes, request));
    if (request.progress) request.progress(++done, kTasks.size());
  }

  result.complete = true;
  result.table.columns = {"task",   "orientations", "displacements", "cpu_s",
                          "wall_s", "probes",       "disagreements", "agreement"};
  result.text = fmt::format(
      "Contact maps built anew, and places on and between lattice points on which MuJoCo disagrees ({:g} mm about a "
      "wall "
      "left out).\n\n{:<20} {:>12} {:>13} {:>7} {:>7} {:>8} {:>13} {:>11}\n",
      1e3 * kGrazing_m, "task", "orientations", "displacements", "CPU s", "wall s", "probes", "disagreements",
      "agreement %");
  for (const char* task : kTasks) {
    const json& cell = *cells.Find(task);
    std::vector<json> row = {task};
    for (std::size_t i = 1; i < result.table.columns.size(); ++i) row.push_back(cell.at(result.table.columns[i]));
    result.table.rows.push_back(std::move(row));
    result.details[task] = cell;
    result.text +=
        fmt::format("{:<20} {:>12} {:>13} {:>7.1f} {:>7.1f} {:>8} {:>13} {:>11.4f}\n", task,
                    cell["orientations"].get<int>(), cell["displacements"].get<std::int64_t>(),
                    cell["cpu_s"].get<double>(), cell["wall_s"].get<double>(), cell["probes"].get<std::int64_t>(),
                    cell["disagreements"].get<std::int64_t>(), 100 * cell["agreement"].get<double>());
  }
  return result;
}

}  // namespace feeler::evaluation
