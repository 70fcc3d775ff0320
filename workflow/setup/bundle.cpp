#include "feeler/workflow/setup/bundle.h"

#include "feeler/core/error.h"
#include "feeler/env/model/task_pieces.h"

namespace feeler::workflow {

policies::TaskBundle BundleOf(const PlanningSetup& setup) {
  const env::TaskPieces open = env::PiecesOf(setup.model, env::Opening::kOpen);
  const env::TaskPieces closed = env::PiecesOf(setup.model, env::Opening::kClosed);
  policies::TaskBundle bundle;
  bundle.task = setup.task();
  bundle.fingerprint = setup.fingerprint;
  bundle.opening = env::ToString(setup.opening);
  bundle.map = setup.map;
  bundle.tool = open.tool;
  bundle.target = open.target;
  // The lids stand behind the geoms of the open target.
  bundle.lids.assign(closed.target.begin() + static_cast<std::ptrdiff_t>(open.target.size()), closed.target.end());
  return bundle;
}

void KeepBundle(const PlanningSetup& setup, const std::string& database) {
  const std::string path = policies::BundlePathOf(database);
  try {
    const policies::TaskBundle there = policies::ReadBundle(path);
    if (there.fingerprint == setup.fingerprint && there.opening == env::ToString(setup.opening)) return;
  } catch (const InputError&) {
    // Missing, damaged or of another version: written anew.
  }
  policies::WriteBundle(path, BundleOf(setup));
}

}  // namespace feeler::workflow
