// Of parts that are drawn at random (kind, size, clearance, place in the CAD frames, turn about the way in, fineness of
// the triangles, file format) each is imported with the clearance that was drawn, or refused in words; nothing else
// ends an import. The short form draws a few; FEELER_IMPORT_SWEEP=N draws N of every kind, or of
// FEELER_IMPORT_SWEEP_KINDS
// ("keyed,usb-a"), by the seed FEELER_IMPORT_SWEEP_SEED (1), and prints a line for each.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/evaluation/cad_import/import_task.h"
#include "tests/cad/kinds/part_shapes.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

struct DrawnPart {
  cad::PartKind kind;
  std::string format;
  cad::PartPlacement placement;
  double roll_deg = 0.0;
  double clearance_mm = 0.0;  ///< a side; 0: not one number
};

DrawnPart Draw(const cad::PartKind& kind, std::uint64_t seed, int number) {
  RandomStream random(seed, static_cast<std::uint64_t>(number), "import sweep: " + kind.name);
  DrawnPart part{kind, "", {}, 0.0, 0.0};
  const std::vector<std::string> formats = {"step", "stl", "stl", "stl-ascii", "obj", "ply", "3mf"};
  part.format = kind.assembled ? "assembly" : formats[random.Index(formats.size())];
  part.placement =
      random.Uniform() < 0.5 && !kind.assembled ? cad::Anyhow(random.Index(1000000)) : cad::PartPlacement{};
  if (random.Uniform() < 0.5 && !kind.assembled) {
    part.roll_deg = random.Uniform(-180.0, 180.0);
    part.placement.tool = part.placement.tool * cad::RolledBy(part.roll_deg).tool;
  }
  part.placement.scale = std::exp(random.Uniform(std::log(0.5), std::log(2.0)));
  if (kind.scalable_clearance) part.placement.looser = random.Uniform(0.6, 1.6);
  part.placement.facet_mm = std::exp(random.Uniform(std::log(0.001), std::log(0.01)));
  part.placement.facet_rad = random.Uniform(0.1, 0.3);
  part.clearance_mm = part.placement.scale * part.placement.looser * std::min(kind.clearance_x_mm, kind.clearance_y_mm);
  return part;
}

/// Imports a part and says how that ended, in one line.
std::string Import(const DrawnPart& part, int number, const fs::path& folder) {
  fs::remove_all(folder);
  const cad::PartFiles files = cad::WriteParts(part.kind.name, folder / "parts", part.format, part.placement);
  ImportOptions options;
  options.tool = files.tool;
  options.target = files.target;
  options.out = folder / "task";
  options.unit = "mm";
  options.aligned = part.kind.assembled;
  options.uncertainty_m = {0.004, 0.004, 0.004};
  options.uncertainty_source = "as given";
  const std::clock_t begin = std::clock();
  std::string outcome;
  double measured_mm = 0.0;
  bool refused = false;
  try {
    const ImportedTask task = ImportTask(options);
    measured_mm = 1000 * task.mating.clearance_m.minCoeff();
    outcome =
        fmt::format("imported, {} and {} pieces, clearance {:.4f} x {:.4f} mm ({:+.4f})", task.tool.pieces.size(),
                    task.target.pieces.size(), 1000 * task.mating.clearance_m.x(), 1000 * task.mating.clearance_m.y(),
                    part.clearance_mm > 0 ? measured_mm - part.clearance_mm : 0.0);
  } catch (const InputError& error) {
    refused = true;
    outcome = fmt::format("refused: {}", error.what());
  } catch (const std::exception& error) {
    ADD_FAILURE() << part.kind.name << ' ' << number << ": " << error.what();
    outcome = fmt::format("ended by {}", error.what());
  }
  const std::string line = fmt::format(
      "{:<14} {:>2} {:<9} x {:.3f}, clearances x {:.3f}, roll {:>6.1f} deg{}, facets {:.4f} mm {:.2f} rad: {:.1f} s, "
      "{}",
      part.kind.name, number, part.format, part.placement.scale, part.placement.looser, part.roll_deg,
      part.placement.target.isApprox(Eigen::Isometry3d::Identity()) ? "" : ", anyhow", part.placement.facet_mm,
      part.placement.facet_rad, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, outcome);
  // Chords of a bore stand in it, those of a peg leave room: triangles change the clearance by that much.
  const double off_mm = 0.01 + 2 * part.placement.facet_mm;
  if (!refused && part.clearance_mm > 0) {
    EXPECT_NEAR(measured_mm, part.clearance_mm, off_mm) << line;
  }
  EXPECT_EQ(outcome.find('\n'), std::string::npos) << line;
  return line;
}

TEST(ImportSweep, EveryPartIsImportedAsDrawnOrRefusedInWords) {
  const char* wanted = std::getenv("FEELER_IMPORT_SWEEP");
  const char* seed_text = std::getenv("FEELER_IMPORT_SWEEP_SEED");
  const char* kinds_text = std::getenv("FEELER_IMPORT_SWEEP_KINDS");
  const int count = wanted != nullptr ? std::atoi(wanted) : 1;
  const std::uint64_t seed = seed_text != nullptr ? std::strtoull(seed_text, nullptr, 10) : 1;
  const std::string kinds = fmt::format(",{},", kinds_text != nullptr ? kinds_text
                                                : wanted != nullptr   ? ""
                                                                      : "keyed,tilted,hexagon");
  const fs::path folder = fs::path(testing::TempDir()) / "import_sweep";
  for (const cad::PartKind& kind : cad::PartKinds()) {
    if (kinds != ",," && kinds.find("," + kind.name + ",") == std::string::npos) continue;
    for (int number = 0; number < count; ++number) {
      const std::string line = Import(Draw(kind, seed, number), number, folder);
      if (wanted != nullptr) fmt::print("{}\n", line);
      std::fflush(stdout);
    }
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace feeler::evaluation
