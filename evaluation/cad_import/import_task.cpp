#include "feeler/evaluation/cad_import/import_task.h"

#define XXH_INLINE_ALL  // header only
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <system_error>
#include <utility>

#include "feeler/cad/align/alignment.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/numbers/walls.h"
#include "feeler/cad/pieces/decompose.h"
#include "feeler/cad/readers/read_part.h"
#include "feeler/cad/step/read_step.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/json_depth.h"
#include "feeler/env/model/task_xml.h"
#include "feeler/evaluation/cad_import/import_json.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

/// Parts larger than this are in another unit than was thought.
constexpr double kLargestPart_m = 1.0;
constexpr double kSmallestPart_m = 2e-4;
constexpr std::size_t kMostPieces = 64;
constexpr std::size_t kMostPiecesOfBore = 512;
constexpr std::size_t kMostBodiesOfPiece = 64;  ///< for each piece that there may be
constexpr std::size_t kMostBodies = 12000;      ///< before they are united: some seconds
constexpr double kLargestFarDeviation_m = 5e-4;
constexpr int kSamples = 100'000;

void Stage(const ImportOptions& options, const std::string& what) {
  if (options.on_stage) options.on_stage(what);
}

std::string HashOf(const fs::path& file) {
  const std::string bytes = env::ReadTextFile(file);
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

ImportedPart ReadAndCheck(const std::string& source_text, const std::string& role, const ImportOptions& options) {
  Stage(options, fmt::format("reading {}", source_text));
  const cad::PartSource source = cad::ParseSource(source_text);
  const cad::RawPart raw = cad::ReadPart(source, [](const fs::path& file) { return cad::ReadStep(file); });
  ImportedPart part;
  part.file = source.file.filename().string();
  part.body = source.body;
  part.hash = HashOf(source.file);
  part.format = raw.format;
  const cad::UnitGuess guess = cad::GuessUnit(raw);
  const bool given = !options.unit.empty() && !raw.unit_is_stated;
  const cad::Unit unit = given ? cad::ParseUnit(options.unit) : guess.unit;
  part.unit = unit.name;
  part.unit_reason = given ? "given (--unit)" : guess.reason;
  const std::string where = fmt::format("{} ({})", role, part.file);
  const cad::TriangleMesh mesh = cad::InMetres(raw, unit);
  const double size = cad::BoundsOf(cad::Welded(mesh, 1e-9)).diagonal().norm();
  if (size > kLargestPart_m || size < kSmallestPart_m) {
    throw InputError(where, fmt::format("is {:.4g} mm across if the file is in {}", 1000 * size, unit.name),
                     "say the unit: --unit mm, cm, m, in or um");
  }
  part.checked = cad::CheckPart(mesh, where);
  for (const std::string& note : raw.notes) part.checked.noted.push_back(note);
  return part;
}

/// Parts of one insertion are of one order of size.
void RequireAlikeUnits(const ImportedPart& tool, const ImportedPart& target, const ImportOptions& options) {
  if (tool.unit == target.unit || !options.unit.empty()) return;
  const double a = cad::BoundsOf(tool.checked.mesh).diagonal().norm();
  const double b = cad::BoundsOf(target.checked.mesh).diagonal().norm();
  if (std::max(a, b) / std::min(a, b) < 30) return;
  throw InputError("tool and target",
                   fmt::format("the tool seems to be in {} ({:.4g} mm across), the target in {} ({:.4g} mm)", tool.unit,
                               1000 * a, target.unit, 1000 * b),
                   "say the unit of both with --unit");
}

cad::Alignment Align(const ImportedPart& tool, const ImportedPart& target, const ImportOptions& options) {
  const cad::TriangleMesh& tool_mesh = tool.checked.mesh;
  const cad::TriangleMesh& target_mesh = target.checked.mesh;
  if (options.aligned) return cad::AlignAssembled(tool_mesh, target_mesh);
  if (options.frame_T_tool || options.frame_T_target) {
    const Pose tool_pose = options.frame_T_tool.value_or(Pose::Identity());
    const Pose target_pose = options.frame_T_target.value_or(Pose::Identity());
    cad::Alignment alignment =
        cad::AlignAssembled(cad::Transformed(tool_mesh, tool_pose), cad::Transformed(target_mesh, target_pose));
    alignment.frame_T_tool = alignment.frame_T_tool * tool_pose;
    alignment.frame_T_target = alignment.frame_T_target * target_pose;
    return alignment;
  }
  cad::AlignOptions align;
  align.mouth = options.mouth_m;
  return cad::FindAlignment(tool_mesh, target_mesh, align);
}

std::string Place(const Eigen::Vector3d& p) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) mm from the mouth", 1000 * p.x(), 1000 * p.y(), 1000 * p.z());
}

std::size_t SidesOf(const std::vector<cad::SlabLoop>& loops) {
  std::size_t sides = 0;
  for (const cad::SlabLoop& loop : loops) {
    sides += cad::Simplified(loop, [](const cad::SlabPoint&) { return 1e-6; }).size();
  }
  return sides;
}

/// Sides of the opening, where each may need a piece of its own. A slanting rim has no line: then those of the holes
/// below it, of the part in its place.
std::size_t BoreFacets(const cad::Mating& mating, const std::string& role, const cad::TriangleMesh& placed) {
  if (!mating.openings.empty()) return SidesOf(mating.openings);
  std::size_t most = 0;
  for (const double share : {0.25, 0.5, 0.75, 0.95}) {
    std::vector<cad::SlabLoop> holes = cad::SectionAt(placed, (role == "tool" ? 1 : -1) * share * mating.depth_m);
    std::erase_if(holes, [](const cad::SlabLoop& loop) { return cad::SignedArea(loop) > 0; });
    most = std::max(most, SidesOf(holes));
  }
  return most;
}

/// Domes and fillets have more corners than contact needs: those go that leave the surface where it is within what is
/// left of the deviation that is allowed.
void FewerCorners(const cad::Mating& mating, double budget, ImportedPart& part) {
  constexpr std::size_t kMany = 128;
  constexpr double kFar_m = 2e-5;
  const double near_m = std::clamp(0.9 * (budget - part.tolerance_near_m), 1e-7, 0.4 * budget);
  for (cad::ConvexPiece& piece : part.pieces) {
    if (piece.surface.points.size() <= kMany) continue;
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& point : piece.surface.points) box.extend(point);
    // A corner beyond the mating surfaces carries faces that reach into them.
    const double tolerance_m = mating.mating_box.intersects(box) ? near_m : std::max(kFar_m, near_m);
    piece = cad::WithFewerCorners(piece, [&](const Eigen::Vector3d&) { return tolerance_m; });
  }
}

/// Cuts a part into pieces, exactly if that takes few, else within larger and larger tolerances.
void MakePieces(const cad::Mating& mating, const Pose& frame_T_cad, const std::string& role,
                const ImportOptions& options, ImportedPart& part) {
  Stage(options, fmt::format("convex pieces of the {}", role));
  part.placed = cad::Transformed(part.checked.mesh, frame_T_cad);
  const double clearance = mating.clearance_m.minCoeff();
  const double budget = options.deviation_share * clearance;
  const std::size_t facets = BoreFacets(mating, role, part.placed);
  // A tapered bore has the sides of both its ends.
  const std::size_t most = facets > 24 ? std::min(kMostPiecesOfBore, 2 * facets + kMostPieces) : kMostPieces;
  struct Tolerances {
    double near_m;
    double far_m;
  };
  std::vector<Tolerances> ladder{{1e-6, 1e-6}};
  for (const auto& [share, far_m] : {std::pair{0.2, 1e-5}, {0.5, 5e-5}, {0.7, 1e-4}, {0.9, 2e-4}, {0.9, 4e-4}}) {
    ladder.push_back({std::max(1e-6, share * budget), std::max(1e-6, far_m)});
  }
  struct Cut {
    std::vector<cad::ConvexPiece> pieces;
    Tolerances within;
  };
  std::vector<cad::TriangleMesh> solids;
  for (const cad::TriangleMesh& solid : part.checked.solids) solids.push_back(cad::Transformed(solid, frame_T_cad));
  const auto cut = [&](const Tolerances& within, bool rough, std::size_t most_pieces) -> std::optional<Cut> {
    cad::DecomposeOptions decompose;
    decompose.mating = mating.mating_box;
    decompose.tolerance_near_m = within.near_m;
    decompose.tolerance_far_m = within.far_m;
    decompose.rough = rough;
    // Slices of so many bodies seldom unite to few enough, and it takes long to see that.
    const std::size_t most_bodies = std::min(kMostBodies, kMostBodiesOfPiece * most_pieces);
    Cut whole{{}, within};
    for (const cad::TriangleMesh& solid : solids) {
      auto pieces = cad::DecomposeIfFew(solid, decompose, most_bodies, most_pieces);
      if (!pieces) return std::nullopt;
      for (cad::ConvexPiece& piece : *pieces) whole.pieces.push_back(std::move(piece));
    }
    return whole.pieces.size() <= most_pieces ? std::optional(std::move(whole)) : std::nullopt;
  };
  // What takes too many pieces within some tolerances takes too many within finer ones.
  const auto finest = [&](bool rough, std::size_t most_pieces) {
    std::optional<Cut> best = cut(ladder.front(), rough, most_pieces);
    std::size_t low = 1;
    std::size_t high = best ? low : ladder.size();
    while (low < high) {
      const std::size_t step = low + (high - low) / 2;
      if (auto coarser = cut(ladder[step], rough, most_pieces)) {
        best = std::move(coarser);
        high = step;
      } else {
        low = step + 1;
      }
    }
    return best;
  };
  // Rather more pieces than some that leave the tolerances; but those may do.
  std::optional<Cut> found = finest(false, most);
  if (!found && most < kMostPiecesOfBore) found = finest(false, kMostPiecesOfBore);
  if (!found) found = finest(true, most);
  if (!found) found = cut(ladder.back(), true, kMostPiecesOfBore);
  if (!found) {
    throw InputError(fmt::format("{} ({})", role, part.file),
                     fmt::format("needs more than {} convex pieces", kMostPiecesOfBore),
                     "leave out what does not mate: threads, engravings, small fillets");
  }
  part.pieces = std::move(found->pieces);
  part.tolerance_near_m = found->within.near_m;
  part.tolerance_far_m = found->within.far_m;
  FewerCorners(mating, budget, part);
  if (part.pieces.empty()) throw InputError(role, "no convex piece has a volume", "is the part thinner than 2 um?");
}

void MeasureDeviation(const cad::Mating& mating, const std::string& role, const ImportOptions& options,
                      ImportedPart& part) {
  Stage(options, fmt::format("the {}'s pieces against its surface", role));
  const cad::MeshTree tree(part.placed);
  part.anywhere = cad::DeviationOf(tree, part.pieces);
  part.mating = cad::DeviationOf(tree, part.pieces, mating.mating_box);
  part.sampled = cad::SampledDeviation(tree, part.pieces, kSamples, 1);
  const double allowed = options.deviation_share * mating.clearance_m.minCoeff() + 1e-6;
  const std::string where = fmt::format("{} ({})", role, part.file);
  if (part.mating.largest_m() > allowed) {
    const bool added = part.mating.added_m >= part.mating.lost_m;
    throw InputError(
        where,
        fmt::format(
            "its convex pieces deviate by {:.4f} mm where the parts mate, at {}: more than {:.0f} % of the clearance",
            1000 * part.mating.largest_m(), Place(added ? part.mating.added_at : part.mating.lost_at),
            100 * options.deviation_share),
        "allow more with --deviation, or simplify the part there");
  }
  if (part.anywhere.largest_m() > kLargestFarDeviation_m) {
    const bool added = part.anywhere.added_m >= part.anywhere.lost_m;
    throw InputError(where,
                     fmt::format("its convex pieces deviate by {:.3f} mm at {}", 1000 * part.anywhere.largest_m(),
                                 Place(added ? part.anywhere.added_at : part.anywhere.lost_at)),
                     "simplify the part there");
  }
}

/// Overrides that an earlier import into the folder was given.
void KeepOverrides(const fs::path& folder, std::map<std::string, std::string>& overrides) {
  const fs::path file = folder / "import.json";
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return;
  const auto json = ParseJsonText<nlohmann::json>(env::ReadTextFile(file));
  if (!json.is_object() || !json.contains("overrides") || !json["overrides"].is_object()) return;
  for (const auto& [field, value] : json["overrides"].items()) {
    if (value.is_string()) overrides.try_emplace(field, value.get<std::string>());
  }
}

/// So that an import that is killed leaves a folder which the next one knows as its own.
void MarkFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) throw InputError(folder.string(), "cannot be made", "give another --out");
  if (fs::exists(folder / "import.json", error)) return;
  WriteFileAtomically((folder / "import.json").string(), nlohmann::json{{"format", "feeler-import"}}.dump(2) + "\n");
}

void RequireClearanceKept(const ImportOptions& options, ImportedTask& task, const env::TaskModel& model) {
  const cad::Mating& mating = task.mating;
  task.pieces_clearance_m = Eigen::Vector2d::Constant(1.0);
  for (const cad::Play& play : mating.profile) {
    const Eigen::Vector2d half = cad::PlayOfPieces(model, play.depth_m, 1e-2);
    task.pieces_play.push_back({play.depth_m, half});
    if (2 * play.depth_m >= mating.depth_m || mating.depth_m < 2e-3)
      task.pieces_clearance_m = task.pieces_clearance_m.cwiseMin(half);
  }
  for (int axis = 0; axis < 2; ++axis) {
    const double off = std::abs(task.pieces_clearance_m[axis] - mating.clearance_m[axis]);
    if (off <= options.deviation_share * mating.clearance_m[axis] + 1e-6) continue;
    throw InputError(
        "tool and target",
        fmt::format("the pieces have {:.4f} mm of clearance along {} where the CAD parts have {:.4f}",
                    1000 * task.pieces_clearance_m[axis], axis == 0 ? "x" : "y", 1000 * mating.clearance_m[axis]),
        "allow more with --deviation, or export the parts finer");
  }
}

/// Sides across x and y that can be felt from outside of the opening.
void FindFlush(const std::array<bool, 3>& any_side, ImportedTask& task) {
  task.flush_x = !any_side[0];
  task.flush_y = !any_side[1];
  if (!task.flush_x && !task.flush_y) return;
  const char* axes = task.flush_x && task.flush_y ? "x and y" : task.flush_x ? "x" : "y";
  task.notes.push_back(
      fmt::format("no side of the target across {} is met from outside: it is flush there, and touch from the side "
                  "tells nothing about {}; "
                  "what remains is the spiral search, or features that stand out",
                  axes, axes));
}

/// Parts whose play goes on shrinking all the way in.
void DescribeTaper(const cad::Mating& mating, std::vector<std::string>& notes) {
  const auto play_m = [&](double share) {
    const auto at = std::min_element(mating.profile.begin(), mating.profile.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.depth_m - share * mating.depth_m) < std::abs(b.depth_m - share * mating.depth_m);
    });
    return at == mating.profile.end() ? 0.0 : at->half_m.minCoeff();
  };
  constexpr double kLess_m = 3e-6;
  const double early_m = play_m(0.3);
  const double middle_m = play_m(0.6);
  const double late_m = play_m(0.9);
  if (early_m - middle_m < kLess_m || middle_m - late_m < kLess_m) return;
  notes.push_back(fmt::format(
      "the parts taper: play a side falls from {:.3f} mm at 0.3 of the depth to {:.3f} at 0.6 and {:.3f} at "
      "0.9; a weak spot: a tool that is tilted or aside wedges before the end, and how deep it goes depends "
      "on force and friction",
      1000 * early_m, 1000 * middle_m, 1000 * late_m));
}

void Describe(const ImportOptions& options, const cad::Alignment& alignment, ImportedTask& task) {
  const cad::Mating& mating = task.mating;
  for (const auto& [role, part] : {std::pair{"tool", &task.tool}, {"target", &task.target}}) {
    for (const std::string& mended : part->checked.mended) {
      task.notes.push_back(fmt::format("{} ({}), mended: {}", role, part->file, mended));
    }
    for (const std::string& noted : part->checked.noted) {
      task.notes.push_back(fmt::format("{} ({}): {}", role, part->file, noted));
    }
  }
  for (const std::string& note : alignment.notes) task.notes.push_back(note);
  if (mating.tool_has_opening) {
    task.notes.push_back(
        "the tool has the opening: it goes over the target (if that is not meant, swap --tool and --target)");
  }
  if (mating.through)
    task.notes.push_back(fmt::format(
        "the hole goes through: nothing stops the tool; inserted is {:.3f} mm below the mouth", 1000 * mating.depth_m));
  DescribeTaper(mating, task.notes);
  if (mating.openings.empty())
    task.notes.push_back("no closed line around the opening was found at the mouth: there is no lid");
  for (const std::string& warning : task.content.numbers.warnings) task.notes.push_back(warning);
  if (task.content.numbers.margin_cells < 0.1) {
    task.notes.push_back(fmt::format(
        "walls come as near as {:.3f} cells to lattice planes for every cell from 0.5 to 2 mm: outcomes may be misread",
        task.content.numbers.margin_cells));
  }
  if (options.uncertainty_source.empty())
    task.notes.push_back("the uncertainty was not given: 5 mm to each side is assumed (--uncertainty)");
}

}  // namespace

ImportedTask ImportTask(const ImportOptions& given) {
  ImportOptions options = given;
  cad::RequireImportFolder(
      options.out, {cad::ParseSource(options.tool).file.string(), cad::ParseSource(options.target).file.string()});
  KeepOverrides(options.out, options.overrides);
  const cad::Material material = cad::ParseMaterial(options.material);
  ImportedTask task;
  task.tool = ReadAndCheck(options.tool, "tool", options);
  task.target = ReadAndCheck(options.target, "target", options);
  RequireAlikeUnits(task.tool, task.target, options);
  Stage(options, "how the parts go together");
  const cad::Alignment alignment = Align(task.tool, task.target, options);
  task.mating = cad::MeasureMating(task.tool.checked.mesh, task.target.checked.mesh, alignment.frame_T_tool,
                                   alignment.frame_T_target, alignment.tool_has_opening);
  MakePieces(task.mating, task.mating.frame_T_tool, "tool", options, task.tool);
  MakePieces(task.mating, task.mating.frame_T_target, "target", options, task.target);
  MeasureDeviation(task.mating, "tool", options, task.tool);
  MeasureDeviation(task.mating, "target", options, task.target);

  cad::TaskContent& content = task.content;
  std::error_code error;
  content.name = fs::weakly_canonical(options.out, error).filename().string();
  content.source = fmt::format("{} into {}", task.tool.file, task.target.file);
  content.tool = task.tool.pieces;
  content.target = task.target.pieces;
  content.lids = cad::MakeLids(task.mating);
  content.lids_on_tool = task.mating.tool_has_opening;
  content.tool_surface = task.tool.placed;
  content.target_surface = task.target.placed;
  content.tool_volume = cad::VolumeOf(task.tool.placed);
  content.material = material;
  const cad::NumberOptions numbers{options.uncertainty_m, options.uncertainty_source, material, options.overrides};
  Stage(options, "numbers");
  // First with a cell that is as good as any: the walls it is chosen by are found on the pieces as MuJoCo has them.
  content.numbers = cad::DeriveNumbers(task.mating, task.tool.placed, task.target.placed, {}, numbers);
  task.task_file = options.out / "task.xml";
  MarkFolder(options.out);
  cad::WriteTaskFolder(content, options.out);
  const cad::MetWalls met = cad::WallsOf(env::LoadTask(task.task_file.string()));
  task.walls = met.walls;
  content.numbers = cad::DeriveNumbers(task.mating, task.tool.placed, task.target.placed, task.walls, numbers);
  cad::WriteTaskFolder(content, options.out);
  const env::TaskModel model = env::LoadTask(task.task_file.string());
  RequireClearanceKept(options, task, model);
  FindFlush(met.any_side, task);
  Describe(options, alignment, task);
  task.json = ImportJson(options, task);
  WriteFileAtomically((options.out / "import.json").string(), task.json.dump(2) + "\n");
  return task;
}

}  // namespace feeler::evaluation
