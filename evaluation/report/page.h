#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "feeler/evaluation/report/results_folder.h"

namespace feeler::evaluation {

/// The JavaScript that the page carries, as Debian's packages libjs-three and node-d3 have it. An installed feeler has
/// copies of the three in its share/feeler and takes those.
struct ReportLibraries {
  std::string three = "/usr/share/javascript/three/three.min.js";
  std::string orbit_controls = "/usr/share/javascript/three/examples/js/controls/OrbitControls.js";
  std::string d3 = "/usr/share/nodejs/d3/dist/d3.min.js";
};

struct ReportOptions {
  ReportLibraries libraries;
  /// Bytes of replays that a page may hold. What does not fit is left out: first come episodes that failed, then those
  /// that needed a fallback, then the others in turn over all files, so that every run has some.
  std::int64_t replay_bytes = 12'000'000;
};

/// Which episodes get their replay into the page: per records file, per episode.
std::vector<std::vector<bool>> ChooseReplays(const std::vector<ReportedRecords>& records, std::int64_t bytes);

/// One self-contained page of HTML (docs/report.md). The same results give the same page. Scenes that the folder does
/// not hold are taken from models/tasks/. Throws InputError if a library is not installed.
std::string ReportPage(const Results& results, const std::string& folder, const ReportOptions& options = {});

}  // namespace feeler::evaluation
