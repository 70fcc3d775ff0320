#include "tests/cad/kinds/mesh_files.h"

#include <cstdint>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

#include "feeler/cad/folder/task_folder.h"

namespace feeler::cad {
namespace {

void WriteStl(const TriangleMesh& mesh, const std::filesystem::path& file, bool ascii) {
  std::ofstream out(file, std::ios::binary);
  out.precision(9);
  if (!ascii) {
    out << StlBytes(mesh);
    return;
  }
  out << "solid part\n";
  for (int t = 0; t < mesh.size(); ++t) {
    out << "facet normal 0 0 0\n outer loop\n";
    for (int k = 0; k < 3; ++k)
      out << "  vertex " << mesh.Corner(t, k).x() << ' ' << mesh.Corner(t, k).y() << ' ' << mesh.Corner(t, k).z()
          << '\n';
    out << " endloop\nendfacet\n";
  }
  out << "endsolid part\n";
}

void WriteObj(const TriangleMesh& mesh, const std::filesystem::path& file) {
  std::ofstream out(file);
  out.precision(9);
  out << "# a part\no part\n";
  for (const Eigen::Vector3d& p : mesh.points) out << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& t : mesh.triangles) out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

void WritePly(const TriangleMesh& mesh, const std::filesystem::path& file, bool ascii) {
  std::ofstream out(file, std::ios::binary);
  out.precision(9);
  out << "ply\nformat " << (ascii ? "ascii" : "binary_little_endian") << " 1.0\nelement vertex " << mesh.points.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto bytes = [&](const auto& value) { out.write(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const Eigen::Vector3d& p : mesh.points) {
    if (ascii) out << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
    for (int axis = 0; axis < 3 && !ascii; ++axis) bytes(static_cast<float>(p[axis]));
  }
  for (const auto& t : mesh.triangles) {
    if (ascii) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
    if (!ascii) bytes(std::uint8_t{3});
    for (int k = 0; k < 3 && !ascii; ++k) bytes(static_cast<std::int32_t>(t[static_cast<std::size_t>(k)]));
  }
}

/// A 3MF package: a zip whose entries are stored, not compressed.
void Write3mf(const TriangleMesh& mesh, const std::filesystem::path& file) {
  std::ostringstream model;
  model.precision(9);
  model
      << R"(<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">)"
      << R"(<resources><object id="1" type="model"><mesh><vertices>)";
  for (const Eigen::Vector3d& p : mesh.points)
    model << "<vertex x=\"" << p.x() << "\" y=\"" << p.y() << "\" z=\"" << p.z() << "\"/>";
  model << "</vertices><triangles>";
  for (const auto& t : mesh.triangles)
    model << "<triangle v1=\"" << t[0] << "\" v2=\"" << t[1] << "\" v3=\"" << t[2] << "\"/>";
  model << "</triangles></mesh></object></resources><build><item objectid=\"1\"/></build></model>";
  const std::vector<std::pair<std::string, std::string>> entries = {
      {"[Content_Types].xml",
       R"(<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>)"},
      {"_rels/.rels",
       R"(<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>)"},
      {"3D/3dmodel.model", model.str()}};
  const auto number = [](std::string& to, std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to += static_cast<char>(value >> (8 * i) & 0xFFU);
  };
  const auto crc = [](const std::string& text) {
    std::uint32_t sum = ~0U;
    for (const unsigned char c : text) {
      sum ^= c;
      for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0U);
    }
    return ~sum;
  };
  std::string body;
  std::string index;
  for (const auto& [name, text] : entries) {
    std::string head;  // what local header and index have in common: version .. length of the extra field
    number(head, 20, 2);
    number(head, 0, 4);           // no flags, stored
    number(head, 0x00210000, 4);  // the first of January 1980
    number(head, crc(text), 4);
    number(head, static_cast<std::uint32_t>(text.size()), 4);
    number(head, static_cast<std::uint32_t>(text.size()), 4);
    number(head, static_cast<std::uint32_t>(name.size()), 2);
    number(head, 0, 2);
    const std::size_t at = body.size();
    body += "PK\3\4" + head + name + text;
    index += "PK\1\2";
    number(index, 20, 2);
    index += head;
    number(index, 0, 2);
    number(index, 0, 4);
    number(index, 0, 4);
    number(index, static_cast<std::uint32_t>(at), 4);
    index += name;
  }
  std::string end = "PK\5\6";
  number(end, 0, 4);
  number(end, static_cast<std::uint32_t>(entries.size()), 2);
  number(end, static_cast<std::uint32_t>(entries.size()), 2);
  number(end, static_cast<std::uint32_t>(index.size()), 4);
  number(end, static_cast<std::uint32_t>(body.size()), 4);
  number(end, 0, 2);
  std::ofstream(file, std::ios::binary) << body << index << end;
}

}  // namespace

void WriteMesh(const TriangleMesh& mesh, const std::filesystem::path& file, const std::string& format) {
  if (format == "obj") return WriteObj(mesh, file);
  if (format.starts_with("ply")) return WritePly(mesh, file, format == "ply-ascii");
  if (format == "3mf") return Write3mf(mesh, file);
  WriteStl(mesh, file, format == "stl-ascii");
}

}  // namespace feeler::cad
