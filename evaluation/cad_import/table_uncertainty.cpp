#include "feeler/evaluation/cad_import/table_uncertainty.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "feeler/core/error.h"
#include "feeler/perception/input_file.h"
#include "feeler/perception/uncertainty_table.h"

namespace feeler::evaluation {

StatedUncertainty UncertaintyOfTable(const std::string& path) {
  const perception::UncertaintyTable table = perception::ParseTable(perception::ReadFile(path), path);
  StatedUncertainty stated;
  for (std::size_t i = 0; i < table.axes.size(); ++i) {
    double half = 0.0;
    for (const perception::UncertaintyRule& rule : table.rules) {
      half = std::max(half, rule.half[static_cast<Eigen::Index>(i)]);
    }
    const AxisKind kind = table.axes[i].kind;
    if (table.axes[i].angular()) {
      stated.note += fmt::format("{}the table's {} of {:.3f} rad to each side is left out: add the axis by hand",
                                 stated.note.empty() ? "" : "; ", ToString(kind), half);
      continue;
    }
    constexpr double kMicrometre = 1e-6;  // more is not known
    stated.half_m[kind == AxisKind::kX   ? 0
                  : kind == AxisKind::kY ? 1
                                         : 2] = kMicrometre * std::ceil(half / kMicrometre - 1e-9);
  }
  if (stated.half_m.isZero()) {
    throw InputError(path, "leaves no position open", "give half widths instead, e.g. 6mm,6mm,4mm");
  }
  stated.source = fmt::format("the widest of {} rules of {}, made for {}", table.rules.size(),
                              std::filesystem::path(path).filename().string(), table.task);
  return stated;
}

}  // namespace feeler::evaluation
