#include "feeler/cad/pipe_parts.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "feeler/core/error.h"

namespace feeler::cad {
namespace {

constexpr double kPi = std::numbers::pi;

/// Tenths of a micrometre, as people write them.
std::string Number(double value) {
  std::string text = fmt::format("{:.7f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string Vector(double x, double y, double z) { return Number(x) + " " + Number(y) + " " + Number(z); }

double BoreRadius(const PipeParameters& p) { return 0.5 * p.pipe_diameter_m + p.clearance_m; }

std::string File(const std::string& model, const std::string& comment, const std::string& content) {
  return fmt::format(
      "<mujoco model=\"{}\">\n  <!-- {}\n       Made by `feeler task make-pipe-parts`. -->\n{}</mujoco>\n", model,
      comment, content);
}

/// A wedge of the ring around a bore: mouth at z = 0, the bore towards -z.
std::string WedgeVertices(const PipeParameters& p) {
  const double half = kPi / p.bore_sides;
  const double inner = BoreRadius(p) / std::cos(half);
  const double rim = (BoreRadius(p) + p.chamfer_m) / std::cos(half);
  const double outer = 0.5 * p.elbow_diameter_m;
  std::string text;
  const auto add = [&](double radius, double angle, double z) {
    text += (text.empty() ? "" : "  ") + Vector(radius * std::cos(angle), radius * std::sin(angle), z);
  };
  for (const double angle : {-half, half}) {
    add(rim, angle, 0.0);
    add(inner, angle, -p.chamfer_m);
    add(inner, angle, -p.bore_depth_m);
  }
  text += "\n             ";
  for (const double z : {0.0, -p.bore_depth_m}) {
    for (int k = 0; k <= p.outer_facets; ++k) add(outer, half * (2.0 * k / p.outer_facets - 1.0), z);
  }
  return text;
}

/// The ring of wedges; `held`: mouth down, bore towards +z.
std::string Ring(const PipeParameters& p, const std::string& material, bool held) {
  std::string text;
  for (int k = 0; k < p.bore_sides; ++k) {
    const double half_angle = kPi * k / p.bore_sides;
    const double c = std::cos(half_angle);
    const double s = std::sin(half_angle);
    // Turned about z, and for a held one upside down about x first: (c, 0, 0, s) * (0, 1, 0, 0).
    const std::string quaternion = held ? "0 " + Vector(c, s, 0) : Number(c) + " " + Vector(0, 0, s);
    text += fmt::format("  <geom class=\"part\" type=\"mesh\" mesh=\"elbow_wedge\" quat=\"{}\" material=\"{}\"{}/>\n",
                        quaternion, material, held ? " mass=\"0.01\"" : "");
  }
  return text;
}

std::string Cylinder(const std::string& attributes, const std::string& from, const std::string& to, double radius,
                     const std::string& material) {
  return fmt::format("  <geom {} type=\"cylinder\" fromto=\"{} {}\" size=\"{}\" material=\"{}\"/>\n", attributes, from,
                     to, Number(radius), material);
}

std::string Assets(const PipeParameters& p) {
  return File(
      "pipe_assets",
      fmt::format("Meshes and materials of pipes and elbows; include at top level. The bore of an elbow is a "
                  "regular polygon of {} sides,\n       {} mm across its flats, its rim opened by {} mm at 45 "
                  "degrees.",
                  p.bore_sides, Number(2000 * BoreRadius(p)), Number(1000 * p.chamfer_m)),
      fmt::format("  <asset>\n"
                  "    <material name=\"pipe_metal\" rgba=\"0.74 0.76 0.78 1\" specular=\"0.9\" shininess=\"0.8\"/>\n"
                  "    <material name=\"pipe_mark\" rgba=\"0.16 0.30 0.52 1\" specular=\"0.4\" shininess=\"0.4\"/>\n"
                  "    <material name=\"pipe_inside\" rgba=\"0.12 0.12 0.13 1\" specular=\"0.1\" shininess=\"0.1\"/>\n"
                  "    <material name=\"elbow_brass\" rgba=\"0.76 0.60 0.30 1\" specular=\"0.7\" shininess=\"0.6\"/>\n"
                  "    <material name=\"pipe_stand\" rgba=\"0.25 0.26 0.28 1\" specular=\"0.3\" shininess=\"0.3\"/>\n"
                  "    <material name=\"pipe_lid\" rgba=\"0.9 0.3 0.1 0.25\"/>\n"
                  "    <mesh name=\"elbow_wedge\"\n      vertex=\"{}\"/>\n"
                  "  </asset>\n",
                  WedgeVertices(p)));
}

std::string HeldPipe(const PipeParameters& p) {
  const double radius = 0.5 * p.pipe_diameter_m;
  std::string text =
      Cylinder("name=\"pipe\" class=\"part\" mass=\"0.2\"", "0 0 0", Vector(0, 0, p.held_pipe_m), radius, "pipe_metal");
  text += "  <!-- For the eye: the bore of the pipe, and how deep it goes in. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, -0.0001), Vector(0, 0, 0.001), radius - 0.003, "pipe_inside");
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, p.bore_depth_m - 0.0025),
                   Vector(0, 0, p.bore_depth_m - 0.0015), radius + 0.0001, "pipe_mark");
  return File("pipe_geoms",
              fmt::format("Pipe of {} mm across, {} mm long. Origin at the centre of the tip face, +z upwards.",
                          Number(1000 * p.pipe_diameter_m), Number(1000 * p.held_pipe_m)),
              text);
}

/// The ring of an arm along +x that ends at (`end_m`, 0, `height_m`): wedges turned by 90 degrees about y.
std::string SideRing(const PipeParameters& p, const std::string& material, double end_m, double height_m) {
  const double quarter = std::sqrt(0.5);
  std::string text;
  for (int k = 0; k < p.bore_sides; ++k) {
    const double c = quarter * std::cos(kPi * k / p.bore_sides);
    const double s = quarter * std::sin(kPi * k / p.bore_sides);
    text += fmt::format(
        "  <geom class=\"part\" type=\"mesh\" mesh=\"elbow_wedge\" pos=\"{}\" quat=\"{} {}\" material=\"{}\" "
        "mass=\"0.01\"/>\n",
        Vector(end_m, 0, height_m), Number(c), Vector(s, c, s), material);
  }
  return text;
}

/// What an elbow is made of below its mouth, without stand: ring, body, side arm, and for the eye the arm's mouth.
std::string ElbowBody(const PipeParameters& p) {
  const double radius = 0.5 * p.elbow_diameter_m;
  std::string text = Ring(p, "elbow_brass", false);
  text += Cylinder("name=\"elbow_body\" class=\"part\"", Vector(0, 0, -p.bore_depth_m),
                   Vector(0, 0, -p.socket_to_arm_m - radius), radius, "elbow_brass");
  text += "  <!-- Begins outside the bore. -->\n";
  text += Cylinder("name=\"elbow_arm\" class=\"part\"", Vector(BoreRadius(p) + 0.002, 0, -p.socket_to_arm_m),
                   Vector(p.side_arm_m, 0, -p.socket_to_arm_m), radius, "elbow_brass");
  return text;
}

std::string BaseElbow(const PipeParameters& p) {
  const double radius = 0.5 * p.elbow_diameter_m;
  const double bottom = -p.socket_to_arm_m - radius;
  std::string text = ElbowBody(p);
  text += "  <!-- The foot. -->\n";
  text += Cylinder("class=\"part\"", Vector(0, 0, bottom), Vector(0, 0, 0.008 - p.base_height_m), 0.018, "pipe_stand");
  text += Cylinder("class=\"part\"", Vector(0, 0, 0.008 - p.base_height_m), Vector(0, 0, -p.base_height_m), 0.055,
                   "pipe_stand");
  text += "  <!-- For the eye: the end of the side arm. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(p.side_arm_m - 0.001, 0, -p.socket_to_arm_m),
                   Vector(p.side_arm_m + 0.0001, 0, -p.socket_to_arm_m), BoreRadius(p), "pipe_inside");
  return File("base_elbow_geoms",
              fmt::format("Elbow on a foot, mouth up, {} mm over the table: what a structure begins with.\n       "
                          "Origin at the centre of the mouth, +z out of it, side arm along +x.",
                          Number(1000 * p.base_height_m)),
              text);
}

std::string BranchPipe(const PipeParameters& p) {
  const double radius = 0.5 * p.pipe_diameter_m;
  const double length = p.joint_pipe_m;
  const double branch = length - p.branch_depth_m;
  std::string text =
      Cylinder("name=\"pipe\" class=\"part\" mass=\"0.22\"", "0 0 0", Vector(0, 0, length), radius, "pipe_metal");
  text += Cylinder("name=\"branch\" class=\"part\" mass=\"0.12\"", Vector(0, 0, branch),
                   Vector(p.side_arm_m, 0, branch), radius, "pipe_metal");
  text += "  <!-- For the eye: the bores, and how deep both ends go in. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, -0.0001), Vector(0, 0, 0.001), radius - 0.003, "pipe_inside");
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, length - 0.001), Vector(0, 0, length + 0.0001), radius - 0.003,
                   "pipe_inside");
  text += Cylinder("class=\"part_visual\"", Vector(p.side_arm_m - 0.001, 0, branch),
                   Vector(p.side_arm_m + 0.0001, 0, branch), radius - 0.003, "pipe_inside");
  for (const double z : {p.bore_depth_m - 0.0025, length - p.bore_depth_m + 0.0015}) {
    text += Cylinder("class=\"part_visual\"", Vector(0, 0, z), Vector(0, 0, z + 0.001), radius + 0.0001, "pipe_mark");
  }
  return File("branch_pipe_geoms",
              fmt::format("Pipe of {} mm across, {} mm long, with a side branch of {} mm along +x by which the turn of "
                          "its upper\n       end is felt. Origin at the centre of the tip face, +z upwards.",
                          Number(1000 * p.pipe_diameter_m), Number(1000 * length), Number(1000 * p.side_arm_m)),
              text);
}

std::string JointElbow(const PipeParameters& p) {
  const double radius = 0.5 * p.elbow_diameter_m;
  const double height = p.held_socket_to_arm_m;
  const double top = height + radius;
  const double stub = p.side_arm_m - p.socket_to_arm_m;
  std::string text = Ring(p, "elbow_brass", true);
  text += SideRing(p, "elbow_brass", p.side_arm_m, height);
  text += Cylinder("name=\"elbow_body\" class=\"part\" mass=\"0.12\"", Vector(0, 0, p.bore_depth_m), Vector(0, 0, top),
                   radius, "elbow_brass");
  text += Cylinder("name=\"elbow_arm\" class=\"part\" mass=\"0.06\"", Vector(0, 0, height),
                   Vector(p.side_arm_m - p.bore_depth_m, 0, height), radius, "elbow_brass");
  text += "  <!-- By which the turn of the second mouth is felt; begins outside its bore. -->\n";
  text += Cylinder("name=\"elbow_stub\" class=\"part\" mass=\"0.06\"", Vector(stub, BoreRadius(p) + 0.002, height),
                   Vector(stub, p.side_arm_m, height), radius, "elbow_brass");
  text += Cylinder("name=\"elbow_handle\" class=\"part\" mass=\"0.03\"", Vector(0, 0, top),
                   Vector(0, 0, top + p.handle_m), 0.5 * p.pipe_diameter_m, "pipe_metal");
  text += "  <!-- For the eye: the end of the stub. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(stub, p.side_arm_m - 0.001, height),
                   Vector(stub, p.side_arm_m + 0.0001, height), BoreRadius(p), "pipe_inside");
  return File("joint_elbow_geoms",
              fmt::format("Elbow of {} mm across with two mouths, one down, one at the end of the arm of {} mm along "
                          "+x, a stub along +y\n       and a handle on top. Origin at the centre of the lower mouth, "
                          "+z into it.",
                          Number(1000 * p.elbow_diameter_m), Number(1000 * p.side_arm_m)),
              text);
}

std::string FixedElbow(const PipeParameters& p) {
  const double radius = 0.5 * p.elbow_diameter_m;
  const double bottom = -p.socket_to_arm_m - radius;
  std::string text = ElbowBody(p);
  text += "  <!-- Closes the bore while the target is localized: in the contact map, not in physics. -->\n";
  text += Cylinder("name=\"lid\" class=\"part_lid\"", Vector(0, 0, -p.lid_recess_m), Vector(0, 0, -p.bore_depth_m),
                   BoreRadius(p) + 0.001, "pipe_lid");
  text += "  <!-- For the eye: the mouth of the side arm, and a stand. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(p.side_arm_m - 0.001, 0, -p.socket_to_arm_m),
                   Vector(p.side_arm_m + 0.0001, 0, -p.socket_to_arm_m), BoreRadius(p), "pipe_inside");
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, bottom), Vector(0, 0, bottom - 0.2), 0.018, "pipe_stand");
  return File("elbow_geoms",
              fmt::format("Elbow of {} mm across: a socket for a pipe of {} mm with {} mm of clearance a side, and a "
                          "side arm of {} mm along +x.\n       Origin at the centre of the mouth, +z out of it.",
                          Number(1000 * p.elbow_diameter_m), Number(1000 * p.pipe_diameter_m),
                          Number(1000 * p.clearance_m), Number(1000 * p.side_arm_m)),
              text);
}

std::string HeldElbow(const PipeParameters& p) {
  const double radius = 0.5 * p.elbow_diameter_m;
  const double top = p.held_socket_to_arm_m + radius;
  std::string text = Ring(p, "elbow_brass", true);
  text += Cylinder("name=\"elbow_body\" class=\"part\" mass=\"0.15\"", Vector(0, 0, p.bore_depth_m), Vector(0, 0, top),
                   radius, "elbow_brass");
  text += Cylinder("name=\"elbow_arm\" class=\"part\" mass=\"0.1\"", Vector(0, 0, p.held_socket_to_arm_m),
                   Vector(p.side_arm_m, 0, p.held_socket_to_arm_m), radius, "elbow_brass");
  text += Cylinder("name=\"elbow_handle\" class=\"part\" mass=\"0.03\"", Vector(0, 0, top),
                   Vector(0, 0, top + p.handle_m), 0.5 * p.pipe_diameter_m, "pipe_metal");
  text += "  <!-- Closes the bore while the target is localized: in the contact map, not in physics. -->\n";
  text += Cylinder("name=\"lid\" class=\"part_lid\"", Vector(0, 0, p.lid_recess_m), Vector(0, 0, p.bore_depth_m),
                   BoreRadius(p) + 0.001, "pipe_lid");
  text += "  <!-- For the eye: the mouth of the side arm. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(p.side_arm_m - 0.001, 0, p.held_socket_to_arm_m),
                   Vector(p.side_arm_m + 0.0001, 0, p.held_socket_to_arm_m), BoreRadius(p), "pipe_inside");
  return File("elbow_held_geoms",
              fmt::format("Elbow of {} mm across in the gripper: mouth down, side arm of {} mm along +x, a stub on top "
                          "to hold it by.\n       Origin at the centre of the mouth, +z into it.",
                          Number(1000 * p.elbow_diameter_m), Number(1000 * p.side_arm_m)),
              text);
}

std::string Post(const PipeParameters& p) {
  const double radius = 0.5 * p.pipe_diameter_m;
  const double bottom = -p.branch_depth_m - radius;
  std::string text = Cylinder("name=\"post\" class=\"part\"", "0 0 0", Vector(0, 0, bottom), radius, "pipe_metal");
  text += Cylinder("name=\"post_branch\" class=\"part\"", Vector(0, 0, -p.branch_depth_m),
                   Vector(p.side_arm_m, 0, -p.branch_depth_m), radius, "pipe_metal");
  text += "  <!-- For the eye: the bores, how deep the post goes in, and a stand. -->\n";
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, -0.001), Vector(0, 0, 0.0001), radius - 0.003, "pipe_inside");
  text += Cylinder("class=\"part_visual\"", Vector(p.side_arm_m - 0.001, 0, -p.branch_depth_m),
                   Vector(p.side_arm_m + 0.0001, 0, -p.branch_depth_m), radius - 0.003, "pipe_inside");
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, 0.0015 - p.bore_depth_m),
                   Vector(0, 0, 0.0025 - p.bore_depth_m), radius + 0.0001, "pipe_mark");
  text += Cylinder("class=\"part_visual\"", Vector(0, 0, bottom), Vector(0, 0, bottom - 0.2), 0.018, "pipe_stand");
  return File("pipe_post_geoms",
              fmt::format("Upright pipe of {} mm across with a side branch of {} mm along +x, by which its yaw is "
                          "felt.\n       Origin at the centre of the upper end, +z upwards.",
                          Number(1000 * p.pipe_diameter_m), Number(1000 * p.side_arm_m)),
              text);
}

}  // namespace

bool PipeParameters::IsValid(std::string* error) const {
  const auto fail = [&](const std::string& what) {
    if (error != nullptr) *error = what;
    return false;
  };
  for (const double size : {pipe_diameter_m, elbow_diameter_m, clearance_m, bore_depth_m, side_arm_m, socket_to_arm_m,
                            held_socket_to_arm_m, held_pipe_m, handle_m, branch_depth_m, joint_pipe_m, base_height_m}) {
    if (!(size > 0.0 && size < 1.0)) return fail(fmt::format("a size of {} m", size));
  }
  if (bore_sides < 6 || bore_sides > 64) return fail(fmt::format("a bore of {} sides", bore_sides));
  if (outer_facets < 1 || outer_facets > 16) return fail(fmt::format("{} outer facets a side", outer_facets));
  if (!(chamfer_m > 0.0 && chamfer_m < bore_depth_m)) return fail("the chamfer is not within the bore");
  if (!(lid_recess_m >= 0.0 && lid_recess_m < bore_depth_m)) return fail("the lid is not within the bore");
  if ((BoreRadius(*this) + chamfer_m) / std::cos(kPi / bore_sides) >=
      0.5 * elbow_diameter_m * std::cos(kPi / bore_sides)) {
    return fail("the bore and its chamfer leave no wall of the elbow");
  }
  if (side_arm_m <= 0.5 * elbow_diameter_m) return fail("the side arm ends within the socket");
  if (socket_to_arm_m <= 0.5 * elbow_diameter_m) return fail("the side arm of the elbow rises above its mouth");
  if (held_socket_to_arm_m - 0.5 * elbow_diameter_m < bore_depth_m) return fail("the side arm closes the held bore");
  if (branch_depth_m - 0.5 * pipe_diameter_m < bore_depth_m) return fail("the branch of the post meets the elbow");
  if (joint_pipe_m - branch_depth_m - 0.5 * pipe_diameter_m < bore_depth_m) {
    return fail("the branch of the pipe meets the elbow below it");
  }
  if (side_arm_m - socket_to_arm_m - 0.5 * elbow_diameter_m < 0.0) return fail("the stub lies within the socket");
  if (base_height_m < socket_to_arm_m + 0.5 * elbow_diameter_m + 0.008)
    return fail("the base is too low for its elbow");
  return true;
}

std::vector<PartFile> GeneratePipeParts(const PipeParameters& parameters) {
  std::string error;
  if (!parameters.IsValid(&error)) throw InputError("pipe parts", error, "see docs/pipes.md for the sizes");
  return {{"pipe_assets.xml", Assets(parameters)},           {"pipe_geoms.xml", HeldPipe(parameters)},
          {"elbow_geoms.xml", FixedElbow(parameters)},       {"elbow_held_geoms.xml", HeldElbow(parameters)},
          {"pipe_post_geoms.xml", Post(parameters)},         {"base_elbow_geoms.xml", BaseElbow(parameters)},
          {"branch_pipe_geoms.xml", BranchPipe(parameters)}, {"joint_elbow_geoms.xml", JointElbow(parameters)}};
}

}  // namespace feeler::cad
