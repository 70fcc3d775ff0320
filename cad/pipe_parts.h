#pragma once

#include <string>
#include <vector>

namespace feeler::cad {

/// Sizes of a family of pipes and elbows, metres. The defaults are those of the parts that ship (docs/pipes.md).
struct PipeParameters {
  double pipe_diameter_m = 0.040;
  double elbow_diameter_m = 0.052;      ///< outside, of the socket and of the side arm
  double clearance_m = 0.001;           ///< between pipe and bore, on each side
  double chamfer_m = 0.0015;            ///< of the rim of the bore, at 45 degrees
  double bore_depth_m = 0.027;          ///< of a socket; an insertion ends a little before its floor
  double side_arm_m = 0.100;            ///< from the axis of the socket to the end of the side arm
  double socket_to_arm_m = 0.044;       ///< from the mouth of a fixed elbow down to the axis of its side arm
  double held_socket_to_arm_m = 0.075;  ///< the same of the elbow in the gripper, with room for what it goes over
  double held_pipe_m = 0.120;           ///< length of the pipe in the gripper
  double handle_m = 0.030;              ///< stub of the held elbow that the gripper holds
  double branch_depth_m = 0.050;        ///< from the top of a post down to the axis of its side branch
  double joint_pipe_m = 0.160;          ///< length of the pipe with a branch that structures are built of
  double base_height_m = 0.120;         ///< of the mouth of the base elbow over its foot
  /// How far below the rim the lid lies. A pipe of other tilt than the socket dips into the mouth before it touches the
  /// rim; with the lid below that, policies are planned on what will be felt.
  double lid_recess_m = 0.004;
  int bore_sides = 16;   ///< the bore is a regular polygon, its flats clearance away from the pipe
  int outer_facets = 3;  ///< of the outside, per side of the bore

  /// True if these sizes make parts; else `error` says what does not.
  bool IsValid(std::string* error = nullptr) const;
};

struct PartFile {
  std::string name;  ///< of the file
  std::string text;  ///< MJCF, for <include>
};

/// The part files of pipes and elbows: `pipe_assets.xml` (meshes and materials), `pipe_geoms.xml` (a pipe as tool),
/// `elbow_geoms.xml` (an elbow as target), `elbow_held_geoms.xml` (an elbow as tool, mouth down), `pipe_post_geoms.xml`
/// (an upright pipe with a side branch as target). And what structures are built of (docs/assembly.md):
/// `base_elbow_geoms.xml` (an elbow on a foot), `branch_pipe_geoms.xml` (a pipe with a branch), `joint_elbow_geoms.xml`
/// (an elbow whose arm ends in a second mouth), with the contact geometry of the former at every end and mouth. Origins
/// at tip or mouth, the side arms along +x. A bore is a ring of convex wedges. Throws InputError if the parameters are
/// not valid.
std::vector<PartFile> GeneratePipeParts(const PipeParameters& parameters);

}  // namespace feeler::cad
