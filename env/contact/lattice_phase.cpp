#include "feeler/env/contact/lattice_phase.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace feeler::env {
namespace {

constexpr double kAlike_cells = 1e-4;
/// Ends of neighbouring lines that differ by less than this belong to one slanted surface.
constexpr double kSlant_cells = 4;

enum class Match { kNone, kAlike, kSlanted };

/// How the surface at `end` goes on to a neighbouring line: on at the same coordinate, at a slant, or not at all.
Match MatchOf(const LineEnds& neighbour, const LineEnd& end) {
  Match match = Match::kNone;
  for (const LineEnd& other : neighbour) {
    if (other.rising != end.rising) continue;
    const double difference = std::abs(other.cells - end.cells);
    if (difference < kAlike_cells) return Match::kAlike;
    if (difference < kSlant_cells) match = Match::kSlanted;
  }
  return match;
}

/// Wrapped into (-0.5, 0.5].
double Wrap(double phase) {
  const double wrapped = phase - std::round(phase);
  return wrapped <= -0.5 + 1e-9 ? 0.5 : wrapped;
}

}  // namespace

void WallCensus::Add(const std::vector<LineEnds>& ends_of_lines) {
  const auto row = static_cast<std::size_t>(row_);
  const std::size_t count = ends_of_lines.size();
  for (std::size_t line = 0; line < count; ++line) {
    for (const LineEnd& end : ends_of_lines[line]) {
      std::vector<Match> matches;
      if (line % row != 0) matches.push_back(MatchOf(ends_of_lines[line - 1], end));
      if ((line + 1) % row != 0) matches.push_back(MatchOf(ends_of_lines[line + 1], end));
      if (line >= row) matches.push_back(MatchOf(ends_of_lines[line - row], end));
      if (line + row < count) matches.push_back(MatchOf(ends_of_lines[line + row], end));
      const bool alike = std::count(matches.begin(), matches.end(), Match::kAlike) > 0;
      const bool slanted = std::count(matches.begin(), matches.end(), Match::kSlanted) > 0;
      if (alike && !slanted) alike_.push_back(end.cells);
    }
  }
}

std::vector<double> WallCensus::Walls() const {
  std::vector<double> sorted = alike_;
  std::sort(sorted.begin(), sorted.end());
  struct Group {
    double cells;
    std::size_t count;
  };
  std::vector<Group> groups;
  std::size_t largest = 0;
  for (std::size_t begin = 0; begin < sorted.size();) {
    std::size_t end = begin;
    while (end < sorted.size() && sorted[end] - sorted[begin] < kAlike_cells) ++end;
    groups.push_back({sorted[(begin + end - 1) / 2], end - begin});
    largest = std::max(largest, end - begin);
    begin = end;
  }
  std::vector<double> walls;
  for (const Group& group : groups) {
    if (group.count >= 4 && group.count * 100 >= largest) walls.push_back(group.cells);
  }
  return walls;
}

LatticePhase ChoosePhase(const std::vector<double>& walls_cells) {
  if (walls_cells.empty()) return {};
  std::vector<double> residues;
  for (const double wall : walls_cells) residues.push_back(wall - std::floor(wall));
  std::sort(residues.begin(), residues.end());
  residues.push_back(residues.front() + 1);
  LatticePhase best{0.0, -1.0};
  for (std::size_t i = 0; i + 1 < residues.size(); ++i) {
    const double margin = 0.5 * (residues[i + 1] - residues[i]);
    // Rounded, so that noise in the last bits of the geometry does not move the lattice.
    const double phase = Wrap(std::round(0.5 * (residues[i] + residues[i + 1]) * 1e6) / 1e6);
    const bool better = margin > best.margin + 1e-6;
    const bool as_good = margin > best.margin - 1e-6 && std::abs(phase) < std::abs(best.phase) - 1e-9;
    if (better || as_good) best = {phase, margin};
  }
  return best;
}

}  // namespace feeler::env
