#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include "feeler/core/lattice.h"
#include "feeler/planner/bounds/openings/mate_certificates.h"

namespace feeler::planner {

/// One layer Q of a belief, as the open bound sees it (docs/planner.md, "The open socket"): its members, the tool, and
/// what does not depend on the place of the first split. In free steps throughout.
struct OpenLayer {
  struct Member {
    Cell h = Cell::Zero();
    int mask = 0;                    ///< which of the neighbours +x, -x, +y, -y are members
    std::array<int, 4> neighbour{};  ///< their indices
    std::array<int, 2> mates{};      ///< members of its row, of its column, within reach
    /// off(h) of (O3): least cost of looking into an opening off the main path, from the start and from the place where
    /// the member leaves it.
    double off_path = std::numeric_limits<double>::infinity();
    double off_rest = std::numeric_limits<double>::infinity();
  };
  std::vector<Member> members;
  std::array<int, 256> index{};  ///< of a bit of the window: the member
  int orientation = 0;
  int each = 1;         ///< openings that can be looked into from one place
  bool single = false;  ///< what neighbours one step apart are spared can be given back, see (O7)
  CellBox mouths;       ///< of all members
  const MateCertificates::Table* mates = nullptr;
  std::array<int, 2> alone_by_one{1, 1};  ///< to how many members without a mate left one opening can have contributed
  double first = 0.0;                     ///< no opening is looked into before
  std::vector<double> slots;         ///< (O1): the k-th opening of the main path is looked into at this time or later
  std::vector<double> slots_before;  ///< sums of the first k of them
  double outside =
      std::numeric_limits<double>::infinity();  ///< places of splits at least so far away are not looked at

  /// Steps that looking into so many openings takes at least.
  double StepsOf(std::size_t looks) const {
    const int whole = static_cast<int>(looks) / each;
    return whole;
  }
};

inline int Distance(const Cell& a, const Cell& b) { return (a - b).cwiseAbs().sum(); }
inline int Distance(const Cell& a, const CellBox& box) { return Distance(a, box.Clamp(a)); }

/// A place s from which some step tells members apart on the filled map, and the bound if that is the first split.
struct OpenPlace {
  Cell place = Cell::Zero();
  int distance = 0;  ///< from the tool
  double bound = 0.0;
  bool operator>(const OpenPlace& o) const { return bound > o.bound; }
};

/// Certificates of the filled map by subset of the neighbours along x and y, see OpenBound.
struct OpenCertificates {
  const CertificateGrid& grid;
  const std::vector<float>& planes;
  double At(int orientation, int mask, std::size_t cell) const {
    return planes[static_cast<std::size_t>(orientation * 16 + mask) * grid.cells + cell];
  }
};

/// The least, over the numbers m1 and m of openings looked into, of what the layer costs if members are first told
/// apart at the place. Roughly: all openings are taken to save as much as the best one does. Refined: by rank.
double RoughBound(const OpenCertificates& certificates, const OpenLayer& layer, const OpenPlace& place);
double RefinedBound(const OpenCertificates& certificates, const OpenLayer& layer, const OpenPlace& place);

}  // namespace feeler::planner
