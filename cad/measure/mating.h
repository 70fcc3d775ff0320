#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "feeler/cad/mesh/triangle_mesh.h"
#include "feeler/cad/section/section.h"
#include "feeler/core/pose.h"

namespace feeler::cad {

/// Play across the insertion at a depth: how far the tool slides to each side before it touches, halved. m
struct Play {
  double depth_m = 0.0;  ///< of the tool below the mouth
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();
};

/// How two parts mate, measured on their surfaces. The frame: origin in the middle of the mouth at the height of its
/// rim, +z out of it; the tool's frame is the same when it is about to enter, and goes down by depth_m.
struct Mating {
  Pose frame_T_tool = Pose::Identity();    ///< CAD frame of the tool, about to enter
  Pose frame_T_target = Pose::Identity();  ///< CAD frame of the target
  bool tool_has_opening = false;
  double depth_m = 0.0;  ///< from the mouth to fully in
  bool through = false;  ///< nothing stops the tool at this depth: the hole goes through
  Eigen::Vector2d clearance_m = Eigen::Vector2d::Zero();  ///< a side, the least of all depths but the mouth
  Eigen::Vector2d lead_in_m = Eigen::Vector2d::Zero();    ///< what the mouth allows beyond the clearance
  /// The tool displaced by this along x and y at once, either way, still enters.
  Eigen::Vector2d mouth_play_m = Eigen::Vector2d::Zero();
  bool round = false;          ///< every turn about the axis fits
  std::vector<int> turns_deg;  ///< other turns that fit, of 60, 90, 120 ... degrees; empty: there is one way
  std::vector<Play> profile;   ///< from the mouth to the end
  Box mating_box;              ///< of the surfaces that meet, target at rest, with a margin
  /// What lids have to close, in the frame of the part that has the opening: loops at the mouth.
  std::vector<SlabLoop> openings;
  double opening_low_m = 0.0;  ///< heights between which they do, in that frame
  double opening_high_m = 0.0;
};

/// Parts in a frame whose -z is the way in, the tool fully in (as cad/align/ leaves them). `engaged_m` says how deep a
/// through hole counts, 0: unknown. Throws InputError when the play cannot be measured.
Mating MeasureMating(const TriangleMesh& tool, const TriangleMesh& target, const Pose& frame_T_tool,
                     const Pose& frame_T_target, bool tool_has_opening_hint);

}  // namespace feeler::cad
