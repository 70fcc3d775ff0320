// Laws of the way from CAD files to convex pieces.
// - A slide of one box against another is as long as the gap between them (analytic oracle).
// - Convex polygons of a section cover it: areas add up, none turns clockwise at a corner.
// - The pieces of a part deviate from it by no more than the tolerance; a sampled judge never finds more than the exact
// one.
// - Parts drawn with a known clearance are found to have it, in STEP and in STL, however their CAD frames lie.
// - Surfaces that are no solid are mended or refused with the place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <regex>
#include <utility>

#include "feeler/cad/align/alignment.h"
#include "feeler/cad/folder/drawing.h"
#include "feeler/cad/folder/task_folder.h"
#include "feeler/cad/measure/deviation.h"
#include "feeler/cad/measure/mating.h"
#include "feeler/cad/measure/sliding.h"
#include "feeler/cad/mesh/flat_points.h"
#include "feeler/cad/mesh/mesh_check.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/cad/pieces/decompose.h"
#include "feeler/cad/readers/read_part.h"
#include "feeler/cad/section/convex_partition.h"
#include "feeler/cad/step/read_step.h"
#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "tests/cad/kinds/part_shapes.h"
#include "tests/cad/part_folder.h"

namespace feeler::cad {
namespace {

namespace fs = std::filesystem;

TriangleMesh BoxMesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::vector<Eigen::Vector3d> corners;
  for (int c = 0; c < 8; ++c)
    corners.emplace_back((c & 1) != 0 ? high.x() : low.x(), (c & 2) != 0 ? high.y() : low.y(),
                         (c & 4) != 0 ? high.z() : low.z());
  return HullOf(corners)->surface;
}

CheckedPart Read(const std::string& source) {
  const RawPart raw = ReadPart(ParseSource(source), [](const fs::path& file) { return ReadStep(file); });
  return CheckPart(InMetres(raw, GuessUnit(raw).unit), source);
}

class CadParts : public PartFolder {};

TEST(MeshSlide, IsAsLongAsTheGap) {
  const TriangleMesh tool = BoxMesh({-0.004, -0.003, 0}, {0.004, 0.003, 0.02});
  const TriangleMesh wall = BoxMesh({0.01, -0.05, -0.01}, {0.02, 0.05, 0.01});
  const MeshTree tree(wall);
  const MeshSlide slide(tool, tree);
  EXPECT_NEAR(slide.Travel({0, 0, 0}, {1, 0, 0}, 1), 0.006, 1e-12);
  EXPECT_NEAR(slide.Travel({0.0021, 0.001, 0}, {1, 0, 0}, 1), 0.0039, 1e-12);
  EXPECT_EQ(slide.Travel({0, 0, 0}, {-1, 0, 0}, 0.3), 0.3);
  EXPECT_EQ(slide.Travel({0, 0, 0.02}, {1, 0, 0}, 0.3), 0.3);  // passes over it
  EXPECT_FALSE(slide.Overlap({0.0059, 0, 0}));
  EXPECT_TRUE(slide.Overlap({0.0061, 0, 0}));
}

SlabPoint Upright(double x, double y) { return {{x, y}, {x, y}, {x, y}}; }

SlabLoop Square(double half) {
  return {Upright(-half, -half), Upright(half, -half), Upright(half, half), Upright(-half, half)};
}

/// The polygons are convex and have the area of the section.
void ExpectCovered(const std::vector<SlabLoop>& loops, const std::vector<SlabLoop>& polygons) {
  double area = 0;
  for (const SlabLoop& loop : loops) area -= SignedArea(loop);
  for (const SlabLoop& polygon : polygons) {
    area += SignedArea(polygon);
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d a = polygon[(i + 1) % polygon.size()].middle - polygon[i].middle;
      const Eigen::Vector2d b = polygon[(i + 2) % polygon.size()].middle - polygon[(i + 1) % polygon.size()].middle;
      EXPECT_GT(a.x() * b.y() - a.y() * b.x(), -1e-12);
    }
  }
  EXPECT_NEAR(area, 0, 1e-12);
}

TEST(ConvexPartition, CoversARingOfManySides) {
  SlabLoop hole;
  const int sides = 97;
  for (int k = 0; k < sides; ++k) {
    const double angle = -2 * std::numbers::pi * k / sides;
    hole.push_back(Upright(0.006 * std::cos(angle), 0.006 * std::sin(angle)));
  }
  const std::vector<SlabLoop> loops{Square(0.01), hole};
  const std::vector<SlabLoop> polygons = ConvexPartition(loops, 1e-7, true).value();
  ExpectCovered(loops, polygons);
  EXPECT_LE(static_cast<int>(polygons.size()), sides + 1);
}

// Of so many corners none stands in by as much as the tolerance: together they must not, either.
TEST(ConvexPartition, OfAFineRingNoPolygonReachesIntoTheHole) {
  SlabLoop hole;
  const int sides = 3000;
  const double radius_m = 0.006;
  for (int k = 0; k < sides; ++k) {
    const double angle = -2 * std::numbers::pi * k / sides;
    hole.push_back(Upright(radius_m * std::cos(angle), radius_m * std::sin(angle)));
  }
  const double tolerance_m = 2.5e-6;
  const std::vector<SlabLoop> polygons = ConvexPartition({Square(0.01), hole}, tolerance_m, false).value();
  double deepest_m = 0.0;
  for (const SlabLoop& polygon : polygons) {
    for (const SlabPoint& a : polygon) {
      for (const SlabPoint& b : polygon) deepest_m = std::max(deepest_m, radius_m - 0.5 * (a.middle + b.middle).norm());
    }
  }
  EXPECT_LE(deepest_m, tolerance_m + radius_m * (1 - std::cos(std::numbers::pi / sides)) + 1e-9);
  EXPECT_LE(polygons.size(), 150U);  // chords of that sagitta: 108
}

TEST(ConvexPartition, AHoleStaysOpenWhereASliverIsCutFromItsRim) {
  // A shaft with six teeth; beside each the rim comes back by 0.07 mm.
  const std::vector<Eigen::Vector2d> tooth{
      {5.8491936, 1.9005182},  {6.0158091, 1.2786998},  {6.0045161, 1.35},       {7.65, 1.35},
      {7.65, -1.35},           {6.0045161, -1.35},      {6.0158091, -1.2786998}, {5.8491936, -1.9005182},
      {5.6184926, -2.5015142}, {5.3262343, -3.0751030}, {4.9756212, -3.6150002}};
  SlabLoop hole;
  for (int k = 0; k < 6; ++k) {
    const Eigen::Rotation2Dd turn(-k * std::numbers::pi / 3);
    for (const Eigen::Vector2d& p : tooth) {
      const Eigen::Vector2d at = turn * p / 1000;
      hole.push_back(Upright(at.x(), at.y()));
    }
  }
  const std::vector<SlabLoop> loops{Square(0.02), hole};
  ExpectCovered(loops, ConvexPartition(loops, 5e-7, true).value());
}

TEST(ConvexPartition, OfAFlareThePolygonsAreConvexAtBothEnds) {
  SlabLoop hole = Square(0.005);
  std::reverse(hole.begin(), hole.end());
  for (SlabPoint& p : hole) {
    p.low *= 0.8;
    p.high *= 1.2;
  }
  const std::vector<SlabLoop> polygons = ConvexPartition({Square(0.02), hole}, 1e-7, true).value();
  for (const SlabLoop& polygon : polygons) {
    for (const auto end : {&SlabPoint::low, &SlabPoint::high}) {
      SlabLoop section = polygon;
      for (SlabPoint& p : section) p.middle = p.*end;
      ExpectCovered({section}, {section});
    }
  }
}

/// Each triangle as four, by the middles of its sides.
TriangleMesh Subdivided(const TriangleMesh& mesh) {
  TriangleMesh fine;
  for (int t = 0; t < mesh.size(); ++t) {
    const int first = static_cast<int>(fine.points.size());
    for (int k = 0; k < 3; ++k) fine.points.push_back(mesh.Corner(t, k));
    for (int k = 0; k < 3; ++k) fine.points.emplace_back(0.5 * (mesh.Corner(t, k) + mesh.Corner(t, (k + 1) % 3)));
    for (const auto& corners : {std::array{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
      fine.triangles.push_back({first + corners[0], first + corners[1], first + corners[2]});
  }
  return Welded(fine, 1e-9);
}

TEST(FlatPoints, OfASubdividedPartTheCornersStay) {
  TriangleMesh prism = BoxMesh({-0.004, -0.003, 0}, {0.004, 0.003, 0.02});
  for (Eigen::Vector3d& p : prism.points) {
    if (p.z() > 0.01) p.head<2>() *= 0.7;  // a frustum: no side is square to an axis
  }
  const TriangleMesh fine = Subdivided(Subdivided(Subdivided(prism)));
  ASSERT_EQ(fine.size(), 12 * 64);
  const TriangleMesh pruned = WithoutFlatPoints(fine);
  EXPECT_EQ(pruned.points.size(), 8U);
  EXPECT_EQ(pruned.size(), 12);
  EXPECT_NEAR(VolumeOf(pruned), VolumeOf(prism), 1e-12 * VolumeOf(prism));
  EXPECT_NEAR(AreaOf(pruned), AreaOf(prism), 1e-9 * AreaOf(prism));
}

TEST(FlatPoints, SeveralShortEdgesBesideALongOneStay) {
  // One side of an edge is split in two, the other is not.
  TriangleMesh mesh = BoxMesh({0, 0, 0}, {0.01, 0.01, 0.01});
  const std::array<int, 3> split = mesh.triangles.front();
  const int middle = static_cast<int>(mesh.points.size());
  mesh.points.emplace_back(0.5 * (mesh.Corner(0, 0) + mesh.Corner(0, 1)));
  mesh.triangles.front() = {split[0], middle, split[2]};
  mesh.triangles.push_back({middle, split[1], split[2]});
  const TriangleMesh pruned = WithoutFlatPoints(mesh);
  EXPECT_EQ(pruned.points.size(), mesh.points.size());
  EXPECT_EQ(pruned.size(), mesh.size());
}

TEST_F(CadParts, PiecesAreTheSolid) {
  for (const char* kind : {"keyed", "d-plug", "usb-a", "long-taper", "chamfered", "chamfered-tee"}) {
    const PartFiles files = WriteParts(kind, folder_, "step");
    for (const std::string& file : {files.tool, files.target}) {
      const CheckedPart part = Read(file);
      ASSERT_EQ(part.solids.size(), 1U);
      DecomposeOptions options;
      options.mating = BoundsOf(part.mesh);
      const std::vector<ConvexPiece> pieces = Decompose(part.solids.front(), options);
      EXPECT_LE(pieces.size(), 512U) << file;
      double volume = 0;
      for (const ConvexPiece& piece : pieces) volume += piece.volume;
      EXPECT_GE(volume, VolumeOf(part.mesh) * (1 - 1e-4)) << file;
      // Pieces that are united reach into others.
      if (!std::string(kind).starts_with("chamfered")) {
        EXPECT_LE(volume, VolumeOf(part.mesh) * (1 + 1e-4)) << file;
      }
      const MeshTree tree(part.mesh);
      const Deviation exact = DeviationOf(tree, pieces);
      const Deviation sampled = SampledDeviation(tree, pieces, 20000, 7);
      EXPECT_LE(exact.largest_m(), 2e-6) << file;
      EXPECT_LE(sampled.added_m, exact.added_m + 2e-6) << file;
      EXPECT_LE(sampled.lost_m, exact.lost_m + 2e-6) << file;
    }
  }
}

TEST_F(CadParts, AMissingPieceAndAFilledHoleAreFound) {
  const CheckedPart part = Read(WriteParts("rectangle", folder_, "stl").target);
  DecomposeOptions options;
  options.mating = BoundsOf(part.mesh);
  std::vector<ConvexPiece> pieces = Decompose(part.solids.front(), options);
  const MeshTree tree(part.mesh);
  std::vector<ConvexPiece> fewer(pieces.begin() + 1, pieces.end());
  const Deviation lost = DeviationOf(tree, fewer);
  EXPECT_GT(lost.lost_m, 1e-3);
  EXPECT_NEAR(lost.lost_m, SampledDeviation(tree, fewer, 100000, 3).lost_m, 2e-4);
  // The hull of all fills the hole of 8.2 x 7.2 mm: its middle is 3.6 mm from the wall.
  const std::vector<ConvexPiece> filled{*HullOf(part.mesh.points)};
  const Deviation added = DeviationOf(tree, filled);
  EXPECT_NEAR(added.added_m, 0.0036, 5e-6);
}

TEST_F(CadParts, ClearancesAreThoseThatWereDrawn) {
  for (const PartKind& kind : PartKinds()) {
    if (kind.fine) continue;
    if (kind.clearance_x_mm == 0) continue;  // not one number
    for (const char* format : {"step", "stl"}) {
      const PartFiles files =
          kind.assembled ? WriteParts(kind.name, folder_, "assembly") : WriteParts(kind.name, folder_, format);
      const TriangleMesh tool = Read(files.tool).mesh;
      const TriangleMesh target = Read(files.target).mesh;
      const std::string where = kind.name + " " + format;
      ASSERT_NO_THROW({
        const Alignment alignment = kind.assembled ? AlignAssembled(tool, target) : FindAlignment(tool, target);
        const Mating mating =
            MeasureMating(tool, target, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
        EXPECT_NEAR(1000 * mating.clearance_m.minCoeff(), std::min(kind.clearance_x_mm, kind.clearance_y_mm), 0.01)
            << where;
        EXPECT_NEAR(1000 * mating.depth_m, kind.depth_mm > 0 ? kind.depth_mm : 1000 * mating.depth_m, 0.01) << where;
        EXPECT_EQ(mating.tool_has_opening, kind.tool_has_opening) << where;
        EXPECT_EQ(mating.openings.empty(), kind.depth_mm == 0) << where;  // a slanting rim has no line at one height
      }) << where;
    }
  }
}

// Whatever edges end within its faces: triangles from edge to edge across a hollow would add to it, or take away.
TEST_F(CadParts, TheTrianglesOfAStepFileHoldItsVolume) {
  for (const PartKind& kind : PartKinds()) {
    if (kind.assembled) continue;
    const PartFiles step = WriteParts(kind.name, folder_, "step");
    const PartFiles stl = WriteParts(kind.name, folder_, "stl");
    for (const auto& [read, drawn] : {std::pair{step.tool, stl.tool}, {step.target, stl.target}}) {
      const double volume = VolumeOf(Read(drawn).mesh);
      EXPECT_NEAR(VolumeOf(Read(read).mesh), volume, 1e-3 * volume) << read;
    }
  }
}

TEST_F(CadParts, ATurnAboutTheWayInIsFound) {
  for (const std::string kind :
       {"keyed-shaft", "keyed-gear", "ring-gear", "hexagon", "round-pins", "ellipse", "d-plug"}) {
    std::vector<double> clearances_mm;
    for (const double degrees : {0.0, 27.0}) {
      const PartFiles files = WriteParts(kind, folder_, "stl", RolledBy(degrees));
      const TriangleMesh tool = Read(files.tool).mesh;
      const TriangleMesh target = Read(files.target).mesh;
      ASSERT_NO_THROW({
        const Alignment alignment = FindAlignment(tool, target);
        const Mating mating =
            MeasureMating(tool, target, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
        clearances_mm.push_back(1000 * mating.clearance_m.minCoeff());
      }) << kind
         << ' ' << degrees;
    }
    EXPECT_NEAR(clearances_mm.front(), clearances_mm.back(), 0.01) << kind;
  }
}

// Whether a key ends where its plug goes on, whether both ends of a plug go into one hole, and whether a turn by a
// little is play or not depends on no turn and no size.
TEST_F(CadParts, AKeyIsFoundHoweverItIsTurnedAndHoweverLargeItIs) {
  struct Drawn {
    double roll_deg, scale, looser;
  };
  for (const Drawn& drawn : {Drawn{127.4, 0.94, 1.12}, {89.4, 1.2, 1.3}, {-68.6, 1.57, 1.07}, {0.0, 1.98, 1.47}}) {
    PartPlacement placement = RolledBy(drawn.roll_deg);
    placement.scale = drawn.scale;
    placement.looser = drawn.looser;
    for (const char* kind : {"keyed", "rectangle"}) {
      const PartFiles files = WriteParts(kind, folder_, "step", placement);
      const TriangleMesh tool = Read(files.tool).mesh;
      const TriangleMesh target = Read(files.target).mesh;
      ASSERT_NO_THROW({
        const Alignment alignment = FindAlignment(tool, target);
        const Mating mating =
            MeasureMating(tool, target, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
        const double drawn_mm = (kind == std::string("keyed") ? 0.15 : 0.1) * drawn.scale * drawn.looser;
        EXPECT_NEAR(1000 * mating.clearance_m.x(), drawn_mm, 0.002) << kind << ' ' << drawn.roll_deg;
        EXPECT_NEAR(1000 * mating.clearance_m.y(), drawn_mm, 0.002) << kind << ' ' << drawn.roll_deg;
      }) << kind
         << ' ' << drawn.roll_deg;
    }
  }
}

TEST_F(CadParts, TheGapThatIsDrawnIsAsWideAsTheClearance) {
  const std::regex gap("<line x1=\"([0-9.]+)\" y1=\"[0-9.]+\" x2=\"([0-9.]+)\" y2=\"[0-9.]+\" stroke=\"#c00\"");
  const std::regex width("viewBox=\"0 0 ([0-9]+)");
  // A tongue within a shell, a latch beside the plug, pins beside the middle.
  for (const std::string kind : {"usb-a", "rj45", "three-pin", "shell", "keyed"}) {
    const PartFiles files = WriteParts(kind, folder_, "step");
    const TriangleMesh tool = Read(files.tool).mesh;
    const TriangleMesh target = Read(files.target).mesh;
    const Alignment alignment = FindAlignment(tool, target);
    const Mating mating =
        MeasureMating(tool, target, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
    for (const int axis : {0, 1}) {
      const std::string svg = SectionSvg(mating, Transformed(tool, mating.frame_T_tool),
                                         Transformed(target, mating.frame_T_target), {axis, true, mating.depth_m});
      std::smatch line;
      std::smatch box;
      ASSERT_TRUE(std::regex_search(svg, line, gap)) << kind << ' ' << axis;
      ASSERT_TRUE(std::regex_search(svg, box, width));
      const double clearance_m = mating.clearance_m[1 - axis];
      const double span_m = std::max(12 * clearance_m, 5 * mating.lead_in_m[1 - axis]);
      const double drawn_m = std::abs(std::stod(line[2]) - std::stod(line[1])) / std::stod(box[1]) * span_m;
      EXPECT_NEAR(drawn_m, clearance_m, 0.02 * clearance_m + 2e-6) << kind << ' ' << axis;
    }
  }
}

TEST_F(CadParts, PartsThatLieAnyhowGoTogether) {
  for (const std::string kind : {"keyed-shaft", "hexagon", "three-pin", "keyed"}) {
    const PartFiles files = WriteParts(kind, folder_, "stl", Anyhow(1));
    const TriangleMesh tool = Read(files.tool).mesh;
    const TriangleMesh target = Read(files.target).mesh;
    ASSERT_NO_THROW({
      const Alignment alignment = FindAlignment(tool, target);
      const Mating mating =
          MeasureMating(tool, target, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
      EXPECT_GT(mating.clearance_m.minCoeff(), 9e-5) << kind;
    }) << kind;
  }
}

// Of any size and fineness: a free form is drawn together to fewer slices, and lines of slices are simplified, each by
// itself; neither may lose what stands out between slices, or take a bore for closed where its rim slants.
TEST_F(CadParts, AHoleThatLeansAgainstItsBlockIsFoundAndCut) {
  struct Drawn {
    const char* format;
    double scale, facet_mm, facet_rad;
  };
  for (const Drawn& drawn : {Drawn{"step", 1.0, 0.002, 0.1},
                             {"stl", 0.543, 0.0034, 0.104},
                             {"3mf", 0.848, 0.0044, 0.18},
                             {"step", 1.509, 0.0093, 0.246}}) {
    PartPlacement placement;
    placement.scale = drawn.scale;
    placement.facet_mm = drawn.facet_mm;
    placement.facet_rad = drawn.facet_rad;
    const PartFiles files = WriteParts("oblique-bore", folder_, drawn.format, placement);
    const TriangleMesh tool = Read(files.tool).mesh;
    const CheckedPart target = Read(files.target);
    const Alignment alignment = FindAlignment(tool, target.mesh);
    const Mating mating =
        MeasureMating(tool, target.mesh, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
    EXPECT_NEAR(1000 * mating.clearance_m.minCoeff(), 0.1 * drawn.scale, 0.01 + 2 * drawn.facet_mm);
    DecomposeOptions options;
    options.mating = mating.mating_box;
    options.tolerance_near_m = 7e-6 * drawn.scale;
    options.tolerance_far_m = 5e-5;
    options.rough = false;
    const TriangleMesh solid = Transformed(target.solids.front(), mating.frame_T_target);
    const auto pieces = DecomposeIfFew(solid, options, 4096, 512);
    ASSERT_TRUE(pieces.has_value()) << drawn.scale;
    const MeshTree tree(solid);
    const Deviation anywhere = SampledDeviation(tree, *pieces, 40000, 5);
    const Deviation near = SampledDeviation(tree, *pieces, 40000, 5, mating.mating_box);
    EXPECT_LE(anywhere.lost_m, options.tolerance_far_m + 1e-6) << drawn.scale;  // at its tips, too
    EXPECT_LE(near.lost_m, options.tolerance_near_m + 1e-6) << drawn.scale;
    EXPECT_LE(near.added_m, options.tolerance_near_m + 1e-6) << drawn.scale;
  }
}

TEST_F(CadParts, AnAssembledToolIsTakenToItsStopAndMayNotLean) {
  const PartFiles files = WriteParts("assembly", folder_, "assembly");
  const TriangleMesh tool = Read(files.tool).mesh;
  const TriangleMesh target = Read(files.target).mesh;
  const auto moved = [&](double lift_m, double lean_deg) {
    const Eigen::Vector3d middle = BoundsOf(tool).center();
    const Eigen::AngleAxisd lean(lean_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitX());
    return Transformed(
        tool, MakePose(middle + lift_m * Eigen::Vector3d::UnitZ()) * Pose(Eigen::Isometry3d(lean)) * MakePose(-middle));
  };
  const Alignment alignment = AlignAssembled(moved(0.003, 0), target);
  EXPECT_THAT(alignment.notes, testing::Contains(testing::HasSubstr("stands 3.000 mm above what stops it")));
  const Mating mating = MeasureMating(moved(0.003, 0), target, alignment.frame_T_tool, alignment.frame_T_target, false);
  EXPECT_FALSE(mating.through);
  EXPECT_NEAR(1000 * mating.depth_m, 12.0, 0.01);
  EXPECT_THAT(MessageOf([&] { AlignAssembled(moved(0.010, 0.3), target); }),
              testing::HasSubstr("leans by 0.30 degrees against the hole"));
}

TEST_F(CadParts, PartsWithoutPlayAreSaidToHaveNone) {
  const PartFiles files = WriteParts("exact", folder_, "stl");
  EXPECT_THAT(MessageOf([&] { FindAlignment(Read(files.tool).mesh, Read(files.target).mesh); }),
              testing::HasSubstr("have no clearance: 8.0000 x 7.0000 mm goes into a hole of 8.0000 x 7.0000 mm"));
}

TEST_F(CadParts, ADomeIsOneBodyWithFewCorners) {
  const PartFiles files = WriteParts("domed", folder_, "stl");
  const CheckedPart part = Read(files.tool);
  DecomposeOptions options;
  options.mating = BoundsOf(part.mesh);
  const std::vector<ConvexPiece> pieces = Decompose(part.solids.front(), options);
  ASSERT_EQ(pieces.size(), 1U);
  const double allowed_m = 1e-5;
  const ConvexPiece fewer = WithFewerCorners(pieces.front(), [&](const Eigen::Vector3d&) { return allowed_m; });
  EXPECT_LT(fewer.surface.points.size(), pieces.front().surface.points.size() / 4);
  for (const Eigen::Vector3d& p : pieces.front().surface.points) EXPECT_LE(DistanceTo(fewer, p), 1.5 * allowed_m);
}

TEST_F(CadParts, ATaperGoesAsDeepAsItWillWhateverItsLength) {
  const PartFiles files = WriteParts("long-taper", folder_, "step");
  const TriangleMesh tool = Read(files.tool).mesh;
  const TriangleMesh target = Read(files.target).mesh;
  const Alignment alignment = FindAlignment(tool, target);
  const Mating mating =
      MeasureMating(tool, target, alignment.frame_T_tool, alignment.frame_T_target, alignment.tool_has_opening);
  EXPECT_NEAR(1000 * mating.depth_m, 20.0, 0.05);
  EXPECT_FALSE(mating.tool_has_opening);
  ASSERT_GE(mating.profile.size(), 2U);
  EXPECT_GT(mating.profile.front().half_m.minCoeff(), mating.profile.back().half_m.minCoeff());
}

TEST_F(CadParts, WhatDoesNotFitOrFitsTwiceIsRefused) {
  const auto find = [&](const std::string& kind) {
    const PartFiles files = WriteParts(kind, folder_, "stl");
    return MessageOf([&] { FindAlignment(Read(files.tool).mesh, Read(files.target).mesh); });
  };
  EXPECT_THAT(find("too-large"), testing::HasSubstr("0.260 mm too wide"));
  EXPECT_THAT(find("two-mouths"),
              testing::HasSubstr("two mouths fit as well: at -15.00,0.00,0.00 and at 15.00,0.00,0.00 mm"));
}

TEST_F(CadParts, AMouthIsChosenByWhereItIs) {
  const PartFiles files = WriteParts("two-mouths", folder_, "stl");
  const TriangleMesh tool = Read(files.tool).mesh;
  const TriangleMesh target = Read(files.target).mesh;
  AlignOptions options;
  options.mouth = Eigen::Vector3d(0.013, 0, 0);
  const Alignment alignment = FindAlignment(tool, target, options);
  EXPECT_NEAR((alignment.frame_T_target.inverse() * alignment.frame_T_tool).translation().x(), 0.015, 2e-4);
  options.mouth = Eigen::Vector3d::Zero();
  EXPECT_THAT(MessageOf([&] { FindAlignment(tool, target, options); }),
              testing::HasSubstr("--mouth: no mouth near 0.00,0.00,0.00 mm (the tool fits at -15.00,0.00,0.00 and "
                                 "15.00,0.00,0.00 mm)"));
}

TEST_F(CadParts, EveryMeshFormatIsOnePart) {
  for (const std::string kind : {"keyed", "usb-a"}) {
    const TriangleMesh expected = Read(WriteParts(kind, folder_, "stl").tool).mesh;
    for (const std::string format : {"stl-ascii", "obj", "ply", "ply-ascii", "3mf"}) {
      const TriangleMesh mesh = Read(WriteParts(kind, folder_, format).tool).mesh;
      EXPECT_EQ(mesh.size(), expected.size()) << kind << ' ' << format;
      EXPECT_NEAR(VolumeOf(mesh), VolumeOf(expected), 1e-6 * VolumeOf(expected)) << kind << ' ' << format;
    }
  }
}

// Corners that go leave the piece where it is within the tolerance: at edges, too, where faces are nearer than the
// piece.
TEST(FewerCorners, StayWithinTheTolerance) {
  for (const double height : {0.002, 0.02, 0.2}) {
    std::vector<Eigen::Vector3d> points;
    for (int ring = 0; ring <= 16; ++ring) {  // a lens: two caps that meet in a sharp rim
      const double along = ring / 16.0;
      for (int k = 0; k < 48; ++k) {
        const double angle = 2 * M_PI * k / 48;
        for (const double side : {-1.0, 1.0}) {
          const double radius = 0.01 * along;
          points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), side * height * (1 - along * along));
        }
      }
    }
    const ConvexPiece piece = *HullOf(points);
    for (const double tolerance_m : {1e-6, 2e-5, 2e-4}) {
      const ConvexPiece fewer = WithFewerCorners(piece, [&](const Eigen::Vector3d&) { return tolerance_m; });
      double farthest_m = 0.0;
      for (const Eigen::Vector3d& point : piece.surface.points) {
        farthest_m = std::max(farthest_m, DistanceTo(fewer, point));
      }
      EXPECT_LE(farthest_m, 1.0001 * tolerance_m) << height;
      if (tolerance_m > 1e-5) {
        EXPECT_LT(fewer.surface.points.size(), piece.surface.points.size());
      }
    }
  }
}

// Against every triangle of the surface.
TEST(ConvexPieces, DistanceIsThatToTheNearestTriangle) {
  RandomStream random(5, 0, "points");
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 8 + trial; ++i) {
      corners.push_back(0.01 * Eigen::Vector3d(random.Normal(), random.Normal(), 0.3 * random.Normal()));
    }
    const ConvexPiece piece = *HullOf(corners);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d point = 0.02 * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
      double least = std::numeric_limits<double>::infinity();
      bool outside = false;
      for (const HalfSpace& plane : piece.planes) outside |= plane.normal.dot(point) > plane.offset_m;
      for (int t = 0; t < piece.surface.size(); ++t) {
        const Eigen::Vector3d q = ClosestOnTriangle(point, piece.surface.Corner(t, 0), piece.surface.Corner(t, 1),
                                                    piece.surface.Corner(t, 2));
        least = std::min(least, (point - q).norm());
      }
      EXPECT_NEAR(DistanceTo(piece, point), outside ? least : 0.0, 1e-12);
    }
    for (const Eigen::Vector3d& corner : piece.surface.points) EXPECT_LT(DistanceTo(piece, corner), 1e-8);
  }
}

TEST(CheckPart, MendsWhatIsSafeAndRefusesTheRest) {
  const TriangleMesh box = BoxMesh({0, 0, 0}, {0.01, 0.02, 0.03});
  TriangleMesh inside_out = box;
  for (auto& t : inside_out.triangles) std::swap(t[1], t[2]);
  EXPECT_NEAR(VolumeOf(CheckPart(inside_out, "part").mesh), 6e-6, 1e-12);
  TriangleMesh one_turned = box;
  std::swap(one_turned.triangles[3][0], one_turned.triangles[3][1]);
  EXPECT_NEAR(VolumeOf(CheckPart(one_turned, "part").mesh), 6e-6, 1e-12);
  TriangleMesh twice = box;
  twice.triangles.push_back(twice.triangles.front());
  EXPECT_THAT(CheckPart(twice, "part").mended, testing::Not(testing::IsEmpty()));

  TriangleMesh open = box;
  open.triangles.pop_back();
  EXPECT_THAT(MessageOf([&] { CheckPart(open, "part"); }), testing::HasSubstr("the surface is open"));
  TriangleMesh sheet;
  sheet.points = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_THAT(MessageOf([&] { CheckPart(sheet, "part"); }), testing::HasSubstr("thickness"));
}

}  // namespace
}  // namespace feeler::cad
