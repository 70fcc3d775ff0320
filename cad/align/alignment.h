#pragma once

#include <optional>
#include <string>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/core/pose.h"

namespace feeler::cad {

/// Where tool and target stand when the tool is in: a common frame whose -z is the way in.
struct Alignment {
  Pose frame_T_tool = Pose::Identity();    ///< CAD frame of the tool
  Pose frame_T_target = Pose::Identity();  ///< CAD frame of the target
  bool tool_has_opening = false;           ///< the target goes into the tool (a gear on a post)
  double engaged_m = 0.0;                  ///< how deep they are in each other, about
  double slack_m = 0.0;                    ///< the larger play across
  std::vector<std::string> notes;          ///< choices that were made, a sentence each
};

struct AlignOptions {
  /// In CAD coordinates of the target, m: of several mouths the nearest one.
  std::optional<Eigen::Vector3d> mouth;
};

/// Finds how the parts go together: over directions of both parts, turns about them that make edges parallel, and
/// places where a line around material of one fits into a hole of the other, verified by exact sliding: the tool comes
/// in along the axis and has play, but little, to all sides. The tightest wins. Throws InputError where none fits (with
/// the nearest miss) or where several do in different places (naming them).
Alignment FindAlignment(const TriangleMesh& tool, const TriangleMesh& target, const AlignOptions& options = {});

/// The same for parts that stand as assembled: finds the direction in which the tool comes out. Throws InputError when
/// they overlap, or it does not come out along any axis.
Alignment AlignAssembled(const TriangleMesh& tool, const TriangleMesh& target);

}  // namespace feeler::cad
