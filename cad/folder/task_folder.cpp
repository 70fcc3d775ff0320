#include "feeler/cad/folder/task_folder.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <numbers>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"

namespace feeler::cad {
namespace {

namespace fs = std::filesystem;

/// More triangles than this are not drawn: the pieces are.
constexpr int kMostDrawn = 150'000;

std::string Text(double v) {
  std::string text = fmt::format("{:.9f}", v);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}
std::string Text(const Eigen::Vector3d& v) { return Text(v.x()) + " " + Text(v.y()) + " " + Text(v.z()); }

/// Comments must not hold two hyphens.
std::string Comment(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at)) text.replace(at, 2, "- ");
  for (std::size_t at = text.find("- set"); at != std::string::npos; at = text.find("- set", at + 1))
    text.replace(at, 5, "set");
  return text;
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      default: escaped += c;
    }
  }
  return escaped;
}

std::string PieceName(const std::string& kind, std::size_t number) { return fmt::format("{}_{:03}", kind, number); }

std::string MeshAssets(const std::string& kind, const std::vector<ConvexPiece>& pieces) {
  std::string text;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (IsAlignedBox(pieces[i])) continue;
    text += fmt::format("    <mesh name=\"{0}\" file=\"{0}.stl\"/>\n", PieceName(kind, i));
  }
  return text;
}

std::string Geoms(const std::string& kind, const std::string& attributes, const std::vector<ConvexPiece>& pieces,
                  double density) {
  std::string text;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const std::string name = PieceName(kind, i);
    const std::string mass = density > 0 ? fmt::format(" mass=\"{:.9g}\"", pieces[i].volume * density) : "";
    if (IsAlignedBox(pieces[i])) {
      text += fmt::format("      <geom name=\"{}\" {} type=\"box\" pos=\"{}\" size=\"{}\"{}/>\n", name, attributes,
                          Text(pieces[i].bounds.center()), Text(0.5 * pieces[i].bounds.sizes()), mass);
    } else {
      text += fmt::format("      <geom name=\"{0}\" {1} type=\"mesh\" mesh=\"{0}\"{2}/>\n", name, attributes, mass);
    }
  }
  return text;
}

std::string Custom(const DerivedNumbers& numbers) {
  std::string text;
  for (const TaskNumber& number : numbers.fields) {
    text += fmt::format("    <!-- {}. -->\n    <{} name=\"{}\" data=\"{}\"/>\n", Comment(number.reason),
                        number.text ? "text" : "numeric", number.field, Escaped(number.value));
  }
  return text;
}

std::string Defaults(const Material& material) {
  return fmt::format(
      "  <compiler angle=\"radian\" autolimits=\"true\"/>\n"
      "  <option timestep=\"0.001\" integrator=\"Euler\" solver=\"Newton\" cone=\"elliptic\" impratio=\"10\"/>\n"
      "  <default>\n"
      "    <!-- Contacts of {0}: friction and stiffness (time in which an overlap is undone). -->\n"
      "    <default class=\"part\">\n"
      "      <geom condim=\"4\" group=\"3\" friction=\"{1} 0.005 0.0001\" solref=\"{2} 1\" solimp=\"0.95 0.99 "
      "0.0005\"/>\n"
      "    </default>\n"
      "    <default class=\"part_lid\">\n"
      "      <geom contype=\"0\" conaffinity=\"0\" group=\"4\" mass=\"0\" rgba=\"0.9 0.3 0.1 0.35\"/>\n"
      "    </default>\n"
      "    <default class=\"part_visual\">\n"
      "      <geom contype=\"0\" conaffinity=\"0\" group=\"2\" mass=\"0\"/>\n"
      "    </default>\n"
      "  </default>\n"
      "  <visual>\n"
      "    <headlight ambient=\"0.35 0.35 0.35\" diffuse=\"0.35 0.35 0.35\" specular=\"0.1 0.1 0.1\"/>\n"
      "    <map znear=\"0.002\" zfar=\"20\"/>\n"
      "    <quality shadowsize=\"4096\"/>\n"
      "  </visual>\n",
      material.name, Text(material.friction), Text(material.contact_time_s));
}

std::string Drawn(const std::string& kind, const TriangleMesh& surface) {
  if (surface.size() > kMostDrawn) return "";
  return fmt::format(
      "      <geom class=\"part_visual\" type=\"mesh\" mesh=\"{0}_surface\" material=\"{0}_material\"/>\n", kind);
}

std::string Stand(const TaskContent& content) {
  const Box box = BoundsOf(content.target_surface);
  const double height = content.numbers.target_height_m;
  const double top = box.min().z();
  const double half_height = 0.5 * (height + top);
  const Eigen::Vector3d half(0.3 * box.sizes().x(), 0.3 * box.sizes().y(), half_height);
  return fmt::format(
      "      <!-- For the eye: what it stands on. -->\n"
      "      <geom class=\"part_visual\" type=\"box\" pos=\"{}\" size=\"{}\" material=\"stand_material\"/>\n",
      Text(Eigen::Vector3d(box.center().x(), box.center().y(), top - half_height)), Text(half));
}

}  // namespace

std::vector<ConvexPiece> MakeLids(const Mating& mating) {
  std::vector<ConvexPiece> lids;
  for (const SlabLoop& loop : mating.openings) {
    std::vector<Eigen::Vector3d> corners;
    for (const SlabPoint& p : loop) {
      corners.emplace_back(p.middle.x(), p.middle.y(), mating.opening_low_m);
      corners.emplace_back(p.middle.x(), p.middle.y(), mating.opening_high_m);
    }
    if (auto lid = HullOf(corners)) lids.push_back(std::move(*lid));
  }
  return lids;
}

std::string TaskXml(const TaskContent& content) {
  double pieces_volume = 0;
  for (const ConvexPiece& piece : content.tool) pieces_volume += piece.volume;
  // Pieces may overlap: the tool weighs what its volume weighs.
  const double density = content.material.density_kg_m3 * content.tool_volume / pieces_volume;
  std::string handle;
  if (content.numbers.handle) {
    handle = fmt::format(
        "      <!-- Stands for what your gripper holds the tool by. -->\n"
        "      <geom name=\"handle\" class=\"part\" group=\"0\" type=\"box\" pos=\"{}\" size=\"{}\" mass=\"0.02\" "
        "material=\"stand_material\"/>\n",
        Text(content.numbers.handle->center_m), Text(content.numbers.handle->half_m));
  }
  const std::string lids = Geoms("lid", "class=\"part_lid\"", content.lids, 0);
  const double height = content.numbers.target_height_m;
  const auto surface = [](const std::string& kind, const TriangleMesh& mesh) {
    return mesh.size() > kMostDrawn ? ""
                                    : fmt::format("    <mesh name=\"{0}_surface\" file=\"{0}_surface.stl\"/>\n", kind);
  };
  std::string text = fmt::format(
      "<mujoco model=\"{}\">\n  <!-- {}\n       Written by `feeler task import`; docs/task-file.md explains the "
      "fields. -->\n",
      Escaped(content.name), Comment(content.source));
  text += Defaults(content.material);
  text += "  <custom>\n" + Custom(content.numbers) + "  </custom>\n";
  text +=
      "  <asset>\n"
      "    <texture name=\"task_sky\" type=\"skybox\" builtin=\"gradient\" rgb1=\"0.82 0.87 0.92\" rgb2=\"0.45 0.52 "
      "0.60\" width=\"256\" height=\"256\"/>\n"
      "    <material name=\"task_table\" rgba=\"0.55 0.50 0.44 1\" specular=\"0.1\" shininess=\"0.1\"/>\n"
      "    <material name=\"tool_material\" rgba=\"0.82 0.60 0.28 1\" specular=\"0.5\" shininess=\"0.5\"/>\n"
      "    <material name=\"target_material\" rgba=\"0.45 0.55 0.66 1\" specular=\"0.4\" shininess=\"0.4\"/>\n"
      "    <material name=\"stand_material\" rgba=\"0.25 0.26 0.28 1\" specular=\"0.3\" shininess=\"0.3\"/>\n";
  text += surface("tool", content.tool_surface) + surface("target", content.target_surface);
  text += MeshAssets("tool", content.tool) + MeshAssets("target", content.target) + MeshAssets("lid", content.lids);
  text +=
      "  </asset>\n  <worldbody>\n"
      "    <light name=\"task_light\" pos=\"0.2 -0.6 1.6\" dir=\"0.28 0.37 -0.88\" diffuse=\"0.55 0.55 0.55\" "
      "specular=\"0.2 0.2 0.2\" directional=\"true\"/>\n"
      "    <geom name=\"table\" type=\"box\" pos=\"0.45 0 -0.02\" size=\"0.75 0.6 0.02\" material=\"task_table\" "
      "friction=\"0.3 0.005 0.0001\"/>\n";
  text += fmt::format("    <body name=\"target\" pos=\"0.65 0 {}\">\n", Text(height));
  text += Drawn("target", content.target_surface) +
          Geoms("target", "class=\"part\" material=\"target_material\"", content.target, 0);
  if (!content.lids_on_tool) text += lids;
  text += Stand(content) + "    </body>\n";
  double start = 0;
  for (const TaskNumber& number : content.numbers.fields) {
    if (number.field == "feeler_start_offset")
      start = std::strtod(number.value.substr(number.value.rfind(' ')).c_str(), nullptr);
  }
  text += fmt::format(
      "    <!-- Placed for the eye; the robot holds it at feeler_flange_*. -->\n    <body name=\"tool\" pos=\"0.65 0 "
      "{}\">\n",
      Text(height + start));
  text += Drawn("tool", content.tool_surface) +
          Geoms("tool", "class=\"part\" material=\"tool_material\"", content.tool, density);
  if (content.lids_on_tool) text += lids;
  text += handle + "    </body>\n  </worldbody>\n</mujoco>\n";
  return text;
}

std::string StlBytes(const TriangleMesh& mesh) {
  std::string bytes(80, '\0');
  const auto append = [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  append(&count, 4);
  for (int t = 0; t < mesh.size(); ++t) {
    const Eigen::Vector3d area = AreaVector(mesh, t);
    const Eigen::Vector3f normal = (area.norm() > 0 ? area.normalized() : area).cast<float>();
    append(normal.data(), 12);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f corner = mesh.Corner(t, k).cast<float>();
      append(corner.data(), 12);
    }
    append("\0\0", 2);
  }
  return bytes;
}

namespace {

/// A file that an import writes, by its name.
bool IsImportName(const std::string& name) {
  if (name == "task.xml" || name == "import.json" || name == "report.html") return true;
  return name.ends_with(".stl") &&
         (name.starts_with("tool_") || name.starts_with("target_") || name.starts_with("lid_"));
}

}  // namespace

void RequireImportFolder(const fs::path& folder, const std::vector<std::string>& inputs) {
  std::error_code error;
  std::string known;
  if (fs::is_regular_file(folder / "import.json", error)) {
    std::ifstream in(folder / "import.json", std::ios::binary);
    known.assign(std::istreambuf_iterator<char>(in), {});
  }
  const bool ours = known.find("\"format\": \"feeler-import\"") != std::string::npos;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string path = it->path().string();
    if (!IsImportName(it->path().filename().string())) continue;
    for (const std::string& input : inputs) {
      if (IsSameFile(path, input)) {
        throw InputError("--out", path + " would be replaced, and is the input " + input, "choose another folder");
      }
    }
    if (!ours) {
      throw InputError("--out", path + " is there, and no earlier import wrote it: it is not overwritten",
                       "choose another folder, or move it away");
    }
  }
}

void WriteTaskFolder(const TaskContent& content, const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) throw InputError(folder.string(), "cannot be made", "give another --out");
  std::vector<fs::path> before;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.ends_with(".stl") && IsImportName(name)) before.push_back(it->path());
  }
  for (const fs::path& mesh : before) fs::remove(mesh, error);
  const auto write_pieces = [&](const std::string& kind, const std::vector<ConvexPiece>& pieces) {
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (!IsAlignedBox(pieces[i]))
        WriteFileAtomically((folder / (PieceName(kind, i) + ".stl")).string(), StlBytes(pieces[i].surface));
    }
  };
  write_pieces("tool", content.tool);
  write_pieces("target", content.target);
  write_pieces("lid", content.lids);
  if (content.tool_surface.size() <= kMostDrawn)
    WriteFileAtomically((folder / "tool_surface.stl").string(), StlBytes(content.tool_surface));
  if (content.target_surface.size() <= kMostDrawn)
    WriteFileAtomically((folder / "target_surface.stl").string(), StlBytes(content.target_surface));
  WriteFileAtomically((folder / "task.xml").string(), TaskXml(content));
}

}  // namespace feeler::cad
