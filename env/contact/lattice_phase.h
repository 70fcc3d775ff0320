#pragma once

#include <vector>

namespace feeler::env {

/// An end of a blocked stretch on a lattice line.
struct LineEnd {
  double cells = 0.0;   ///< coordinate along the line
  bool rising = false;  ///< free below, blocked above
};
using LineEnds = std::vector<LineEnd>;

/// Finds the walls across an axis: coordinates at which neighbouring lattice lines end alike. Ends that move from line
/// to line belong to slanted or curved surfaces; no phase suits all of those.
class WallCensus {
 public:
  /// `row`: lines i and i + row are neighbours, and so are i and i + 1 within a row.
  explicit WallCensus(int row) : row_(row) {}
  void Add(const std::vector<LineEnds>& ends_of_lines);
  /// Coordinates of the walls, in cells, increasing; walls of less than a hundredth of the largest do not count.
  std::vector<double> Walls() const;

 private:
  int row_;
  std::vector<double> alike_;
};

struct LatticePhase {
  double phase = 0.0;   ///< in (-0.5, 0.5]: lattice planes at k + phase
  double margin = 0.5;  ///< smallest distance from a wall to a lattice plane, in cells
};

/// The phase that maximises the smallest distance from a wall to a lattice plane; the one nearest zero where several
/// do.
LatticePhase ChoosePhase(const std::vector<double>& walls_cells);

}  // namespace feeler::env
