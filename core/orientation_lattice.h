#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "feeler/core/task.h"

namespace feeler {

/// The lattice of target orientations of a task. One lattice serves even and odd numbers of angles: an angular axis of
/// at most N hypotheses has the N angles (i - (N-1)/2) * resolution, and n of them are the contiguous, most central
/// ones first..first+n-1. Orientations are numbered yaw_index * N_pitch + pitch_index; orientation (i, j) is Rz(yaw_i)
/// Ry(pitch_j), relative to the *lattice frame*, in whose axes the tool stands and moves.
///
/// The estimated pose of the target is the centre of the chosen angles, which lies up to half a step beside the lattice
/// frame: world_R_estimate = world_R_frame * Rz(c_yaw) Ry(c_pitch), with c the mean of the chosen angles (zero where N
/// and n are both even or both odd). Positions are not affected.

/// Number of angles of the lattice along kYaw or kPitch: the axis' max_cells; 1 if it is certain.
int LatticeAngles(const Task& task, AxisKind kind);
/// Number of orientations of the lattice, the layers of a contact map.
int LatticeOrientations(const Task& task);
/// Index of the first of `count` chosen angles of `most`.
constexpr int FirstAngle(int count, int most) { return (most - count) / 2; }
/// Angle of an index of the lattice, in radians from the lattice frame; 0 for a certain axis.
double LatticeAngle(const Task& task, AxisKind kind, int index);
/// Rotation of a target of orientation `orientation`: world_R_target = world_R_frame * this.
Eigen::Quaterniond LatticeOrientation(const Task& task, int orientation);
/// frame_R_estimate of a problem: world_R_frame = world_R_estimate * this^-1. `extents`: counts per axis of the task,
/// in its order.
Eigen::Quaterniond FrameREstimate(const Task& task, const std::vector<int>& extents);

}  // namespace feeler
