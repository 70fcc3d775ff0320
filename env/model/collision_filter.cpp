#include "feeler/env/model/collision_filter.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace feeler::env {
namespace {

// More than the tolerance of MuJoCo's iterative collision functions, which report a touch a little early.
constexpr double kSlack_m = 1e-5;

// Half extents of the box around a geom in its own frame, which is centred on the geom's position.
std::array<double, 3> HalfExtents(const mjModel& model, int geom) {
  const mjtNum* size = model.geom_size + 3 * geom;
  switch (model.geom_type[geom]) {
    case mjGEOM_SPHERE: return {size[0], size[0], size[0]};
    case mjGEOM_CAPSULE: return {size[0], size[0], size[1] + size[0]};
    case mjGEOM_CYLINDER: return {size[0], size[0], size[1]};
    case mjGEOM_BOX:
    case mjGEOM_ELLIPSOID:
    case mjGEOM_MESH: return {size[0], size[1], size[2]};
    default: {
      const double r = model.geom_rbound[geom];
      return {r, r, r};
    }
  }
}

// A filter of one's own replaces MuJoCo's, so its rules come first: bit masks, and neither bodies that are welded
// together nor neighbours in the tree.
bool BuiltInSkips(const mjModel& m, int geom1, int geom2) {
  if ((m.geom_contype[geom1] & m.geom_conaffinity[geom2]) == 0 &&
      (m.geom_contype[geom2] & m.geom_conaffinity[geom1]) == 0) {
    return true;
  }
  const int weld1 = m.body_weldid[m.geom_bodyid[geom1]];
  const int weld2 = m.body_weldid[m.geom_bodyid[geom2]];
  if (weld1 == weld2) return true;
  if ((m.opt.disableflags & mjDSBL_FILTERPARENT) != 0 || weld1 == 0 || weld2 == 0) return false;
  return weld1 == m.body_weldid[m.body_parentid[weld2]] || weld2 == m.body_weldid[m.body_parentid[weld1]];
}

int Skip(const mjModel* m, mjData* d, int geom1, int geom2) {
  return BuiltInSkips(*m, geom1, geom2) || SurelyApart(*m, *d, geom1, geom2) ? 1 : 0;
}

}  // namespace

bool SurelyApart(const mjModel& model, const mjData& data, int geom1, int geom2) {
  // Planes and height fields have no bounding sphere.
  const double r1 = model.geom_rbound[geom1];
  const double r2 = model.geom_rbound[geom2];
  if (!(r1 > 0 && r2 > 0)) return false;
  const double margin = std::max(model.geom_margin[geom1], model.geom_margin[geom2]) + kSlack_m;
  const mjtNum* p1 = data.geom_xpos + 3 * geom1;
  const mjtNum* p2 = data.geom_xpos + 3 * geom2;
  const std::array<double, 3> between = {p2[0] - p1[0], p2[1] - p1[1], p2[2] - p1[2]};
  const double squared = between[0] * between[0] + between[1] * between[1] + between[2] * between[2];
  const double reach = r1 + r2 + margin;
  if (squared > reach * reach) return true;

  const std::array<double, 3> h1 = HalfExtents(model, geom1);
  const std::array<double, 3> h2 = HalfExtents(model, geom2);
  const mjtNum* a = data.geom_xmat + 9 * geom1;  // row-major; column i is axis i in the world
  const mjtNum* b = data.geom_xmat + 9 * geom2;
  std::array<std::array<double, 3>, 3> cosine;  // |axis i of 1 . axis j of 2|
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      cosine[i][j] = std::abs(a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j]);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const double distance = std::abs(between[0] * a[i] + between[1] * a[3 + i] + between[2] * a[6 + i]);
    const double other = cosine[i][0] * h2[0] + cosine[i][1] * h2[1] + cosine[i][2] * h2[2];
    if (distance > h1[i] + std::min(other, r2) + margin) return true;
  }
  for (std::size_t j = 0; j < 3; ++j) {
    const double distance = std::abs(between[0] * b[j] + between[1] * b[3 + j] + between[2] * b[6 + j]);
    const double other = cosine[0][j] * h1[0] + cosine[1][j] * h1[1] + cosine[2][j] * h1[2];
    if (distance > h2[j] + std::min(other, r1) + margin) return true;
  }
  return false;
}

void InstallCollisionFilter() {
  static const bool installed = [] {
    mjcb_contactfilter = Skip;
    return true;
  }();
  (void)installed;
}

}  // namespace feeler::env
