#include "feeler/cad/mesh/mesh_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "feeler/cad/mesh/flat_points.h"
#include "feeler/cad/mesh/mesh_tree.h"
#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

/// Files hold coordinates to a micrometre (OBJ in metres with six digits) or better; what is nearer is one point.
constexpr double kWeld_m = 2e-6;
/// Surfaces that come this near to enclosing nothing enclose nothing.
constexpr double kLeastThickness_m = 2e-5;

std::string Place(const Eigen::Vector3d& p) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) mm", 1000 * p.x(), 1000 * p.y(), 1000 * p.z());
}

using Edge = std::pair<int, int>;

/// How often an edge is walked low to high, less how often high to low; edges that cancel are not listed.
std::map<Edge, int> Unmatched(const TriangleMesh& mesh) {
  std::map<Edge, int> count;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      count[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  std::erase_if(count, [](const auto& entry) { return entry.second == 0; });
  return count;
}

/// Splits the unmatched edges at the points that lie on them and cancels what then is met from both sides.
std::map<Edge, int> UnmatchedAfterSplitting(const TriangleMesh& mesh, const std::map<Edge, int>& unmatched) {
  std::set<int> ends;
  for (const auto& [edge, count] : unmatched) {
    ends.insert(edge.first);
    ends.insert(edge.second);
  }
  std::vector<int> by_x(ends.begin(), ends.end());
  const auto point = [&](int i) -> const Eigen::Vector3d& { return mesh.points[static_cast<std::size_t>(i)]; };
  std::sort(by_x.begin(), by_x.end(),
            [&](int a, int b) { return std::pair(point(a).x(), a) < std::pair(point(b).x(), b); });
  std::map<Edge, int> rest;
  for (const auto& [edge, count] : unmatched) {
    const Eigen::Vector3d& a = point(edge.first);
    const Eigen::Vector3d along = point(edge.second) - a;
    const double length = along.norm();
    std::vector<std::pair<double, int>> on{{0.0, edge.first}, {1.0, edge.second}};
    const double low = std::min(a.x(), a.x() + along.x()) - 2 * kWeld_m;
    const double high = std::max(a.x(), a.x() + along.x()) + 2 * kWeld_m;
    auto it = std::lower_bound(by_x.begin(), by_x.end(), low, [&](int i, double x) { return point(i).x() < x; });
    for (; it != by_x.end() && point(*it).x() <= high; ++it) {
      if (*it == edge.first || *it == edge.second) continue;
      const double s = (point(*it) - a).dot(along) / (length * length);
      if (s <= 0 || s >= 1 || (a + s * along - point(*it)).norm() > 2 * kWeld_m) continue;
      on.emplace_back(s, *it);
    }
    std::sort(on.begin(), on.end());
    for (std::size_t i = 0; i + 1 < on.size(); ++i) {
      const int p = on[i].second;
      const int q = on[i + 1].second;
      rest[{std::min(p, q), std::max(p, q)}] += p < q ? count : -count;
    }
  }
  std::erase_if(rest, [](const auto& entry) { return entry.second == 0; });
  return rest;
}

/// Removes triangles that are there twice: the same way round one of them, opposite ways both (a sheet).
int DropDuplicates(TriangleMesh& mesh) {
  std::map<std::array<int, 3>, std::vector<int>> same;
  for (int t = 0; t < mesh.size(); ++t) {
    std::array<int, 3> corners = mesh.triangles[static_cast<std::size_t>(t)];
    std::sort(corners.begin(), corners.end());
    same[corners].push_back(t);
  }
  const auto even = [&](int t) {
    const auto& c = mesh.triangles[static_cast<std::size_t>(t)];
    return (c[0] < c[1]) == ((c[1] < c[2]) == (c[0] < c[2]));
  };
  std::vector<bool> drop(mesh.triangles.size(), false);
  int dropped = 0;
  for (const auto& [corners, copies] : same) {
    if (copies.size() < 2) continue;
    std::vector<int> kept;
    for (const int t : copies) {
      const bool again = std::any_of(kept.begin(), kept.end(), [&](int k) { return even(k) == even(t); });
      if (again) {
        drop[static_cast<std::size_t>(t)] = true;
        ++dropped;
      } else {
        kept.push_back(t);
      }
    }
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!drop[t]) mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  return dropped;
}

/// Turns triangles so that neighbours agree, as far as edges shared by two go. Returns how many were turned.
int MakeConsistent(TriangleMesh& mesh) {
  std::map<Edge, std::vector<int>> users;
  for (int t = 0; t < mesh.size(); ++t) {
    const auto& c = mesh.triangles[static_cast<std::size_t>(t)];
    for (std::size_t k = 0; k < 3; ++k) {
      users[{std::min(c[k], c[(k + 1) % 3]), std::max(c[k], c[(k + 1) % 3])}].push_back(t);
    }
  }
  const auto walks_up = [&](int t, const Edge& edge) {
    const auto& c = mesh.triangles[static_cast<std::size_t>(t)];
    for (std::size_t k = 0; k < 3; ++k) {
      if (c[k] == edge.first && c[(k + 1) % 3] == edge.second) return true;
    }
    return false;
  };
  std::vector<int> state(mesh.triangles.size(), 0);  // 0 unseen, 1 as it is, 2 turned
  int turned = 0;
  for (int start = 0; start < mesh.size(); ++start) {
    if (state[static_cast<std::size_t>(start)] != 0) continue;
    state[static_cast<std::size_t>(start)] = 1;
    std::vector<int> patch{start};
    int turned_here = 0;
    for (std::size_t next = 0; next < patch.size(); ++next) {
      const int t = patch[next];
      const auto corners = mesh.triangles[static_cast<std::size_t>(t)];
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge edge{std::min(corners[k], corners[(k + 1) % 3]), std::max(corners[k], corners[(k + 1) % 3])};
        const std::vector<int>& both = users[edge];
        if (both.size() != 2) continue;
        const int other = both[0] == t ? both[1] : both[0];
        int& seen = state[static_cast<std::size_t>(other)];
        if (seen != 0) continue;
        seen = 1;
        patch.push_back(other);
        if (walks_up(t, edge) != walks_up(other, edge)) continue;
        auto& c = mesh.triangles[static_cast<std::size_t>(other)];
        std::swap(c[1], c[2]);
        seen = 2;
        ++turned_here;
      }
    }
    // The majority of a patch is taken to be right.
    if (2 * turned_here > static_cast<int>(patch.size())) {
      for (const int t : patch) {
        auto& c = mesh.triangles[static_cast<std::size_t>(t)];
        std::swap(c[1], c[2]);
      }
      turned_here = static_cast<int>(patch.size()) - turned_here;
    }
    turned += turned_here;
  }
  return turned;
}

void Reverse(TriangleMesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

void RequireClosed(const TriangleMesh& mesh, const std::string& where, CheckedPart& part) {
  const std::map<Edge, int> unmatched = Unmatched(mesh);
  if (unmatched.empty()) return;
  const std::map<Edge, int> open = UnmatchedAfterSplitting(mesh, unmatched);
  double length = 0;
  double longest = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (const auto& [edge, count] : open) {
    const Eigen::Vector3d& a = mesh.points[static_cast<std::size_t>(edge.first)];
    const Eigen::Vector3d& b = mesh.points[static_cast<std::size_t>(edge.second)];
    const double l = (a - b).norm();
    length += l;
    if (l > longest) {
      longest = l;
      place = 0.5 * (a + b);
    }
  }
  if (longest > 4 * kWeld_m) {
    throw InputError(
        where,
        fmt::format("the surface is open: {:.2f} mm of edges have a triangle on one side only, the longest at {}",
                    1000 * length, Place(place)),
        "close it in your CAD program, or export it as a solid");
  }
  part.mended.push_back(fmt::format("{} long edges meet several short ones: taken for closed", unmatched.size()));
}

/// Whether two triangles without a common point cut through each other, by more than grazing.
bool CutEachOther(const TriangleMesh& mesh, int s, int t, Eigen::Vector3d& place) {
  const auto pierces = [&](const Eigen::Vector3d& p, const Eigen::Vector3d& q, int triangle) {
    const Eigen::Vector3d& a = mesh.Corner(triangle, 0);
    const Eigen::Vector3d normal = AreaVector(mesh, triangle).normalized();
    const double hp = normal.dot(p - a);
    const double hq = normal.dot(q - a);
    const double graze = 4 * kWeld_m;
    if (!((hp > graze && hq < -graze) || (hp < -graze && hq > graze))) return false;
    const Eigen::Vector3d x = p + (q - p) * (hp / (hp - hq));
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& from = mesh.Corner(triangle, k);
      const Eigen::Vector3d edge = (mesh.Corner(triangle, (k + 1) % 3) - from).normalized();
      if (normal.cross(edge).dot(x - from) < graze) return false;
    }
    place = x;
    return true;
  };
  for (int k = 0; k < 3; ++k) {
    if (pierces(mesh.Corner(s, k), mesh.Corner(s, (k + 1) % 3), t)) return true;
    if (pierces(mesh.Corner(t, k), mesh.Corner(t, (k + 1) % 3), s)) return true;
  }
  return false;
}

void RequireNoSelfCut(const TriangleMesh& shell, const std::string& where) {
  const MeshTree tree(shell);
  for (int s = 0; s < shell.size(); ++s) {
    tree.Visit(BoundsOf(shell, s), [&](int t) {
      if (t <= s) return true;
      Eigen::Vector3d place;
      if (CutEachOther(shell, s, t, place)) {
        throw InputError(where, fmt::format("the surface cuts through itself at {}", Place(place)),
                         "unite the bodies, or mend the mesh, in your CAD program");
      }
      return true;
    });
  }
}

/// Shells that enclose nothing, hollows put to the solids around them, solids seen from inside turned.
void SortShells(std::vector<TriangleMesh> shells, const std::string& where, CheckedPart& part) {
  std::vector<TriangleMesh> hollows;
  int reversed = 0;
  for (std::size_t i = 0; i < shells.size(); ++i) {
    TriangleMesh& shell = shells[i];
    const double volume = VolumeOf(shell);
    const double thickness = 2 * std::abs(volume) / std::max(AreaOf(shell), 1e-12);
    if (thickness < kLeastThickness_m) {
      throw InputError(where,
                       fmt::format("a body of no thickness ({:.2g} mm) at {}: it encloses nothing", 1000 * thickness,
                                   Place(BoundsOf(shell).center())),
                       "export a solid");
    }
    if (volume > 0) continue;
    bool hollow = false;
    for (std::size_t j = 0; j < shells.size() && !hollow; ++j) {
      if (j == i || !BoundsOf(shells[j]).contains(BoundsOf(shell))) continue;
      TriangleMesh around = shells[j];
      if (VolumeOf(around) < 0) Reverse(around);
      hollow = MeshTree(around).Inside(shell.points.front());
    }
    if (hollow) continue;
    Reverse(shell);
    ++reversed;
  }
  if (reversed > 0) {
    part.mended.push_back(fmt::format("{} of {} bodies were seen from inside: turned", reversed, shells.size()));
  }
  for (TriangleMesh& shell : shells) {
    if (VolumeOf(shell) > 0) part.solids.push_back(shell);
  }
  for (TriangleMesh& shell : shells) {
    if (VolumeOf(shell) > 0) continue;
    for (TriangleMesh& solid : part.solids) {
      if (!BoundsOf(solid).contains(BoundsOf(shell)) || !MeshTree(solid).Inside(shell.points.front())) continue;
      Append(shell, solid);
      part.noted.push_back("a hollow without an entrance is kept");
      break;
    }
  }
}

}  // namespace

CheckedPart CheckPart(const TriangleMesh& mesh, const std::string& where) {
  CheckedPart part;
  if (mesh.triangles.empty()) throw InputError(where, "holds no triangles", "export a solid or a closed mesh");
  for (const Eigen::Vector3d& point : mesh.points) {
    if (!point.allFinite()) throw InputError(where, "has a point that is not a finite number", "export it again");
  }
  TriangleMesh welded = Welded(mesh, kWeld_m);
  if (const int lost = mesh.size() - welded.size(); lost > 0) {
    part.mended.push_back(fmt::format("{} triangles without area are left out", lost));
  }
  if (const int dropped = DropDuplicates(welded); dropped > 0) {
    part.mended.push_back(fmt::format("{} triangles were there twice: one of each is kept", dropped));
  }
  if (welded.triangles.empty()) throw InputError(where, "is a point", "is the unit right? Give --unit");
  const double thickness = 2 * std::abs(VolumeOf(welded)) / std::max(AreaOf(welded), 1e-12);
  if (const int turned = MakeConsistent(welded); turned > 0) {
    part.mended.push_back(fmt::format("{} triangles faced the other way than their neighbours: turned", turned));
  } else if (thickness < kLeastThickness_m) {
    throw InputError(where, fmt::format("has no thickness ({:.2g} mm): it encloses nothing", 1000 * thickness),
                     "export a solid");
  }
  RequireClosed(welded, where, part);
  std::vector<TriangleMesh> shells = ShellsOf(welded);
  for (const TriangleMesh& shell : shells) RequireNoSelfCut(shell, where);
  SortShells(std::move(shells), where, part);
  for (TriangleMesh& solid : part.solids) solid = WithoutFlatPoints(solid);
  for (const TriangleMesh& solid : part.solids) Append(solid, part.mesh);
  if (part.solids.size() > 1) part.noted.push_back(fmt::format("{} solids", part.solids.size()));
  return part;
}

}  // namespace feeler::cad
