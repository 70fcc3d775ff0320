#include "env/pipe_parts.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace feeler::env {
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

std::string FixedElbow(const PipeParameters& p) {
  const double radius = 0.5 * p.elbow_diameter_m;
  const double bottom = -p.socket_to_arm_m - radius;
  std::string text = Ring(p, "elbow_brass", false);
  text += Cylinder("name=\"elbow_body\" class=\"part\"", Vector(0, 0, -p.bore_depth_m), Vector(0, 0, bottom), radius,
                   "elbow_brass");
  text += "  <!-- Begins outside the bore. -->\n";
  text += Cylinder("name=\"elbow_arm\" class=\"part\"", Vector(BoreRadius(p) + 0.002, 0, -p.socket_to_arm_m),
                   Vector(p.side_arm_m, 0, -p.socket_to_arm_m), radius, "elbow_brass");
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
                            held_socket_to_arm_m, held_pipe_m, handle_m, branch_depth_m}) {
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
  return true;
}

std::vector<PartFile> GeneratePipeParts(const PipeParameters& parameters) {
  std::string error;
  if (!parameters.IsValid(&error)) throw InputError("pipe parts", error, "see docs/pipes.md for the sizes");
  return {{"pipe_assets.xml", Assets(parameters)},
          {"pipe_geoms.xml", HeldPipe(parameters)},
          {"elbow_geoms.xml", FixedElbow(parameters)},
          {"elbow_held_geoms.xml", HeldElbow(parameters)},
          {"pipe_post_geoms.xml", Post(parameters)}};
}

}  // namespace feeler::env
