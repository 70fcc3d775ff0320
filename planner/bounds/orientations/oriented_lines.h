#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/arrays/shared_array.h"
#include "feeler/planner/belief/problem.h"
#include "feeler/planner/bounds/certificates/certificate_grid.h"
#include "feeler/planner/bounds/orientations/difference_rows.h"
#include "feeler/planner/bounds/orientations/oriented_certificates.h"
#include "feeler/planner/contact/step_flags_grid.h"

namespace feeler::planner {

/// What it costs to localize hypotheses at one place that differ in yaw alone, or in pitch alone: for each line of
/// orientations, subset S of its hypotheses and displacement x of the tool, |S| V*(x, S), by single steps (see
/// StepCosts) and a uniform prior. A step that splits S leads to its parts, so the planes of smaller subsets come
/// first. Unlike certificates, which let a hypothesis walk as if it were known to be the true one, these know that all
/// of S share a walk until something splits them.
class OrientedLines {
 public:
  static constexpr int kLongest = 6;              ///< longer lines are cut
  static constexpr std::uint16_t kNone = 0xFFFF;  ///< some two cannot be told apart
  enum Axis : std::uint8_t { kYaw = 0, kPitch = 1 };
  static constexpr int kAxes = 2;

  struct Place {
    int line = -1;  ///< -1: on none
    int bit = 0;    ///< of the orientation in subsets of its line
  };

  /// For the orientations that the hypotheses of `problem` have. Unusable after a cancellation. From the store, or made
  /// and kept there; its key stands for all other arguments.
  OrientedLines(const Problem& problem, const StepFlagsGrid& flags, const StepCosts& costs, Parallelism jobs,
                const ProgressCallback& progress, const CancellationToken* cancellation = nullptr,
                const ArrayStore* store = nullptr);

  /// Units of the tables per free step.
  std::uint32_t units_per_step() const { return units_per_step_; }
  Place PlaceOf(Axis axis, int orientation) const { return places_[axis][static_cast<std::size_t>(orientation)]; }
  const OrientedBox& box(int line) const { return lines_[static_cast<std::size_t>(line)].box; }
  using Plane = DifferenceRows<std::uint16_t>::Lane;
  /// The values of a subset of two or more of a line, by box(line).Index; of one: no lane (it costs nothing).
  Plane PlaneOf(int line, unsigned subset) const;
  std::size_t bytes() const;

 private:
  struct Line {
    std::vector<int> orientations;
    OrientedBox box;
    DifferenceRows<std::uint16_t> values;  ///< a lane a subset
  };
  void AddLines(Axis axis, const Problem& problem, const StepFlagsGrid& flags, const std::vector<char>& used);
  struct LineBits;
  static LineBits BitsOf(const StepFlagsGrid& flags, const Line& line);
  void Fill(const StepFlagsGrid& flags, std::uint32_t contact_units, Line& line) const;
  /// Lowers `cost` where one step splits the subset of the line, and lists these places.
  void SplittingSteps(const OrientedBox& box, const std::vector<std::uint16_t>& values, const LineBits& bits,
                      std::uint32_t subset, std::uint32_t contact_units, std::vector<std::uint32_t>& cost,
                      std::vector<std::pair<std::uint32_t, std::uint32_t>>& seeds) const;

  std::uint32_t units_per_step_ = 1;
  std::array<std::vector<Place>, kAxes> places_;  ///< by orientation
  std::vector<Line> lines_;
};

}  // namespace feeler::planner
