#include "feeler/env/arm/urdf_to_mjcf.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <set>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/planner/motion/robot_description.h"

namespace feeler::env {
namespace {

using tinyxml2::XMLElement;

Eigen::Matrix3d Rotation(const urdf::Rotation& r) {
  return Eigen::Quaterniond(r.w, r.x, r.y, r.z).normalized().toRotationMatrix();
}

void SetPose(const urdf::Pose& pose, XMLElement& element) {
  element.SetAttribute("pos", MjcfVector(Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z)).c_str());
  element.SetAttribute("quat", MjcfQuaternion(Rotation(pose.rotation)).c_str());
}

class Emitter {
 public:
  Emitter(const std::string& file, const urdf::ModelInterface& model, const UrdfToMjcfOptions& options,
          XMLElement& mujoco)
      : file_(file),
        model_(model),
        options_(options),
        asset_(*mujoco.InsertNewChildElement("asset")),
        contact_(*mujoco.InsertNewChildElement("contact")),
        actuator_(*mujoco.InsertNewChildElement("actuator")) {}

  RobotMjcf Emit(XMLElement& worldbody) {
    result_.root_body = worldbody.InsertNewChildElement("body");
    EmitLink(*model_.getRoot(), nullptr, *result_.root_body);
    ExcludeNeighbours(*model_.getRoot(), {});
    return std::move(result_);
  }

 private:
  [[noreturn]] void Fail(const std::string& what, const std::string& mend) const {
    throw InputError(file_, what, mend);
  }

  void RequireFinite(const urdf::Pose& pose, const char* element, const std::string& name) const {
    const auto& p = pose.position;
    const auto& r = pose.rotation;
    for (const double value : {p.x, p.y, p.z, r.x, r.y, r.z, r.w}) {
      if (std::isfinite(value)) continue;
      throw InputError(fmt::format("{}: <{} name=\"{}\">", file_, element, name), "its <origin> is not finite",
                       "give finite numbers");
    }
  }

  /// A mass and moments of inertia that a body can have.
  void RequireSane(const urdf::Inertial& inertial, const Eigen::Matrix3d& inertia, const std::string& link) const {
    const std::string where = fmt::format("{}: <link name=\"{}\"><inertial>", file_, link);
    if (!(inertial.mass > 0 && inertial.mass < 1e4)) {
      throw InputError(where, fmt::format("mass {} is not in 0 to 10000 kg", inertial.mass), "give the mass in kg");
    }
    if (!inertia.allFinite()) throw InputError(where, "the inertia is not finite", "give finite numbers");
    const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues();
    if (moments[0] <= 0 || moments[0] + moments[1] < moments[2] * (1 - 1e-6)) {
      throw InputError(where,
                       fmt::format("no body has the principal moments of inertia {:.3g}, {:.3g}, {:.3g} kg m^2",
                                   moments[0], moments[1], moments[2]),
                       "all are positive, and none exceeds the sum of the others");
    }
  }

  void RequireSane(const urdf::Joint& joint) const {
    const std::string where = fmt::format("{}: <joint name=\"{}\">", file_, joint.name);
    const auto& a = joint.axis;
    const double length = std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
    if (!(std::abs(length - 1) < 1e-3))
      throw InputError(where, fmt::format("its <axis> has length {}", length), "give a unit vector");
    const auto& limits = *joint.limits;
    if (!std::isfinite(limits.lower) || !std::isfinite(limits.upper) || !(limits.lower < limits.upper)) {
      throw InputError(where, fmt::format("its limits are {} to {} rad", limits.lower, limits.upper),
                       "the lower is less than the upper");
    }
    if (!std::isfinite(limits.effort) || !std::isfinite(limits.velocity)) {
      throw InputError(where, "its effort or velocity is not finite", "give the torque in Nm and rad/s");
    }
    if (joint.dynamics && !(joint.dynamics->damping >= 0 && joint.dynamics->friction >= 0)) {
      throw InputError(where, "its <dynamics> are negative or not finite", "give 0 or more");
    }
  }

  void EmitLink(const urdf::Link& link, const urdf::Joint* joint, XMLElement& body) {
    body.SetAttribute("name", link.name.c_str());
    if (joint != nullptr) {
      RequireFinite(joint->parent_to_joint_origin_transform, "joint", joint->name);
      SetPose(joint->parent_to_joint_origin_transform, body);
    }
    if (link.inertial) {
      EmitInertial(*link.inertial, link.name, body);
    } else if (joint != nullptr && joint->type != urdf::Joint::FIXED) {
      Fail("moving link '" + link.name + "' has no <inertial>", "give its mass and inertia");
    }
    if (joint != nullptr && joint->type != urdf::Joint::FIXED) EmitJoint(*joint, body);
    for (const auto& visual : link.visual_array) {
      XMLElement& geom = EmitGeom(visual->geometry, visual->origin, link.name, body);
      geom.SetAttribute("contype", 0);
      geom.SetAttribute("conaffinity", 0);
      geom.SetAttribute("group", options_.visual_group);
      if (visual->material) geom.SetAttribute("material", Material(*visual->material).c_str());
    }
    for (const auto& collision : link.collision_array) {
      XMLElement& geom = EmitGeom(collision->geometry, collision->origin, link.name, body);
      RoundEnds(collision->geometry, geom);
      geom.SetAttribute("contype", 1);
      geom.SetAttribute("conaffinity", 1);
      geom.SetAttribute("group", options_.collision_group);
    }
    for (const auto& child_joint : link.child_joints) {
      const urdf::LinkConstSharedPtr child = model_.getLink(child_joint->child_link_name);
      EmitLink(*child, child_joint.get(), *body.InsertNewChildElement("body"));
    }
  }

  void EmitInertial(const urdf::Inertial& inertial, const std::string& link, XMLElement& body) {
    RequireFinite(inertial.origin, "link", link);
    XMLElement& element = *body.InsertNewChildElement("inertial");
    // MJCF takes either a full inertia in the axes of the body or a diagonal one with an orientation: turn the tensor.
    const Eigen::Matrix3d axes = Rotation(inertial.origin.rotation);
    Eigen::Matrix3d inertia;
    inertia << inertial.ixx, inertial.ixy, inertial.ixz, inertial.ixy, inertial.iyy, inertial.iyz, inertial.ixz,
        inertial.iyz, inertial.izz;
    RequireSane(inertial, inertia, link);
    inertia = axes * inertia * axes.transpose();
    const auto& p = inertial.origin.position;
    element.SetAttribute("pos", MjcfVector(Eigen::Vector3d(p.x, p.y, p.z)).c_str());
    element.SetAttribute("mass", inertial.mass);
    Eigen::Matrix<double, 6, 1> full;
    full << inertia(0, 0), inertia(1, 1), inertia(2, 2), inertia(0, 1), inertia(0, 2), inertia(1, 2);
    element.SetAttribute("fullinertia", MjcfVector(full).c_str());
  }

  void EmitJoint(const urdf::Joint& joint, XMLElement& body) {
    if (joint.type != urdf::Joint::REVOLUTE || !joint.limits || joint.limits->effort <= 0.0 ||
        joint.limits->velocity <= 0.0) {
      Fail("joint '" + joint.name + "' is not revolute with limits of position, effort and velocity",
           "use type=\"revolute\" with a complete <limit>, or type=\"fixed\"");
    }
    RequireSane(joint);
    const std::size_t index = result_.joints.size();
    const double unit = options_.angles_in_degrees ? 180.0 / std::numbers::pi : 1.0;
    const double friction = index < options_.joint_friction_nm.size()
                                ? options_.joint_friction_nm[index]
                                : (joint.dynamics ? joint.dynamics->friction : 0.0);
    XMLElement& element = *body.InsertNewChildElement("joint");
    element.SetAttribute("name", joint.name.c_str());
    element.SetAttribute("type", "hinge");
    element.SetAttribute("pos", "0 0 0");
    element.SetAttribute("axis", MjcfVector(Eigen::Vector3d(joint.axis.x, joint.axis.y, joint.axis.z)).c_str());
    element.SetAttribute("limited", "true");
    element.SetAttribute("range",
                         MjcfVector(Eigen::Vector2d(joint.limits->lower * unit, joint.limits->upper * unit)).c_str());
    element.SetAttribute("stiffness", 0);
    element.SetAttribute("damping", joint.dynamics ? joint.dynamics->damping : 0.0);
    element.SetAttribute("armature", options_.armature_kg_m2);
    element.SetAttribute("frictionloss", friction);
    element.SetAttribute("ref", 0);

    XMLElement& motor = *actuator_.InsertNewChildElement("motor");
    motor.SetAttribute("name", ("motor_" + joint.name).c_str());
    motor.SetAttribute("joint", joint.name.c_str());
    motor.SetAttribute("gear", "1");
    motor.SetAttribute("ctrllimited", "true");
    motor.SetAttribute("ctrlrange", MjcfVector(Eigen::Vector2d(-joint.limits->effort, joint.limits->effort)).c_str());
    result_.joints.push_back(
        {joint.name, joint.limits->lower, joint.limits->upper, joint.limits->effort, joint.limits->velocity});
  }

  XMLElement& EmitGeom(const urdf::GeometrySharedPtr& shape, const urdf::Pose& origin, const std::string& link,
                       XMLElement& body) {
    if (!shape) Fail("a shape of link '" + link + "' has no geometry", "give it a box, cylinder or sphere");
    RequireFinite(origin, "link", link);
    XMLElement& geom = *body.InsertNewChildElement("geom");
    SetPose(origin, geom);
    geom.SetAttribute("mass", 0);
    if (const auto* box = dynamic_cast<const urdf::Box*>(shape.get())) {
      geom.SetAttribute("type", "box");
      geom.SetAttribute("size", MjcfVector(0.5 * Eigen::Vector3d(box->dim.x, box->dim.y, box->dim.z)).c_str());
    } else if (const auto* cylinder = dynamic_cast<const urdf::Cylinder*>(shape.get())) {
      geom.SetAttribute("type", "cylinder");
      geom.SetAttribute("size", MjcfVector(Eigen::Vector2d(cylinder->radius, 0.5 * cylinder->length)).c_str());
    } else if (const auto* sphere = dynamic_cast<const urdf::Sphere*>(shape.get())) {
      geom.SetAttribute("type", "sphere");
      geom.SetAttribute("size", sphere->radius);
    } else {
      Fail("link '" + link + "' has a shape that is neither box, cylinder nor sphere", "use primitive shapes");
    }
    return geom;
  }

  // A collision cylinder about as long as it is wide becomes a sphere, a longer one a capsule of the same length and
  // radius. MuJoCo tests those in closed form, cylinders iteratively and ten times slower; and the ends of the housings
  // they stand for are round.
  static void RoundEnds(const urdf::GeometrySharedPtr& shape, XMLElement& geom) {
    const auto* cylinder = dynamic_cast<const urdf::Cylinder*>(shape.get());
    if (cylinder == nullptr || cylinder->length < 1.8 * cylinder->radius) return;
    const double straight = 0.5 * cylinder->length - cylinder->radius;
    if (straight < 1e-4) {
      geom.SetAttribute("type", "sphere");
      geom.SetAttribute("size", cylinder->radius);
    } else {
      geom.SetAttribute("type", "capsule");
      geom.SetAttribute("size", MjcfVector(Eigen::Vector2d(cylinder->radius, straight)).c_str());
    }
  }

  // Emits the material at its first use.
  std::string Material(const urdf::Material& material) {
    std::string name = model_.getName() + "_" + material.name;
    if (!materials_.insert(name).second) return name;
    XMLElement& element = *asset_.InsertNewChildElement("material");
    const Eigen::Vector4d rgba(material.color.r, material.color.g, material.color.b, material.color.a);
    element.SetAttribute("name", name.c_str());
    element.SetAttribute("rgba", MjcfVector(rgba).c_str());
    element.SetAttribute("specular", 0.4);
    element.SetAttribute("shininess", 0.5);
    result_.materials.push_back(name);
    return name;
  }

  // A link never collides with the next one behind a moving joint, nor do links that are fixed to each other. MuJoCo
  // leaves out the first kind itself except where the parent is fixed to the world, so all pairs are written out.
  // `rigid` holds the links that are fixed to `link` on the way up to the last moving joint, and the ones before it.
  void ExcludeNeighbours(const urdf::Link& link, const std::vector<std::string>& rigid) {
    std::vector<std::string> group = rigid;
    group.push_back(link.name);
    for (const auto& joint : link.child_joints) {
      const urdf::LinkConstSharedPtr child = model_.getLink(joint->child_link_name);
      if (joint->type == urdf::Joint::FIXED) {
        ExcludeNeighbours(*child, group);
        continue;
      }
      for (const std::string& name : group) Exclude(name, child->name);
      ExcludeNeighbours(*child, {});
    }
  }

  void Exclude(const std::string& a, const std::string& b) {
    XMLElement& element = *contact_.InsertNewChildElement("exclude");
    element.SetAttribute("body1", a.c_str());
    element.SetAttribute("body2", b.c_str());
  }

  const std::string& file_;
  const urdf::ModelInterface& model_;
  const UrdfToMjcfOptions& options_;
  XMLElement& asset_;
  XMLElement& contact_;
  XMLElement& actuator_;
  std::set<std::string> materials_;
  RobotMjcf result_;
};

}  // namespace

RobotMjcf EmitRobot(const std::string& urdf_file, const UrdfToMjcfOptions& options, XMLElement& mujoco) {
  const urdf::ModelInterfaceSharedPtr model = planner::ReadRobotDescription(urdf_file);
  XMLElement* worldbody = mujoco.FirstChildElement("worldbody");
  if (worldbody == nullptr) worldbody = mujoco.InsertNewChildElement("worldbody");
  return Emitter(urdf_file, *model, options, mujoco).Emit(*worldbody);
}

}  // namespace feeler::env
