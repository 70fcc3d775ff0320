#pragma once

#include <tinyxml2.h>

#include <string>
#include <vector>

namespace feeler::env {

struct UrdfToMjcfOptions {
  double armature_kg_m2 = 0.1;
  std::vector<double> joint_friction_nm;  ///< per moving joint in tree order; missing ones take the URDF's value
  bool angles_in_degrees = false;         ///< what the <compiler> of the receiving MJCF says; only joint ranges need it
  int visual_group = 2;                   ///< geom group of visual shapes (drawn, never collide)
  int collision_group = 3;                ///< geom group of collision shapes (collide, not drawn)
};

/// A moving joint of the robot, as the URDF has it.
struct RobotJoint {
  std::string name;
  double lower_rad = 0.0;
  double upper_rad = 0.0;
  double effort_nm = 0.0;
  double velocity_rad_s = 0.0;
};

struct RobotMjcf {
  std::vector<RobotJoint> joints;      ///< depth first from the root; actuator i drives joint i
  tinyxml2::XMLElement* root_body;     ///< body of the root link, inside `worldbody`
  std::vector<std::string> materials;  ///< names of the emitted materials, prefixed with "ROBOT_"
};

/// Reads a robot description with urdfdom and emits it into an MJCF document: the tree of bodies under its
/// <worldbody>, materials, one torque motor per revolute joint (`motor_JOINT`, gear 1, control range = effort limit),
/// and the exclusion of contact between each link and its neighbours. Fixed joints become bodies of their own, so that
/// every link of the URDF is a body of the same name. Collision cylinders that are at least about as long as wide
/// become spheres or capsules (round ends). Every physical attribute is written out: the defaults of the receiving
/// document do not reach the robot. Throws InputError for what urdfdom rejects, for joints that are neither fixed nor
/// revolute with limits about an axis, for shapes that are meshes, and for moving links without inertia.
RobotMjcf EmitRobot(const std::string& urdf_file, const UrdfToMjcfOptions& options, tinyxml2::XMLElement& mujoco);

}  // namespace feeler::env
