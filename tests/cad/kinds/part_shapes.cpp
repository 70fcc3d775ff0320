#include "tests/cad/kinds/part_shapes.h"

#include <BRepBuilderAPI_Transform.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Writer.hxx>
#include <TopExp_Explorer.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "feeler/core/random.h"
#include "tests/cad/kinds/mesh_files.h"
#include "tests/cad/kinds/part_drawings.h"

namespace feeler::cad {
namespace {

using Shape = TopoDS_Shape;

Shape Scaled(const Shape& shape, double factor) {
  if (factor == 1.0) return shape;
  gp_Trsf scale;
  scale.SetScale(gp_Pnt(0, 0, 0), factor);
  return BRepBuilderAPI_Transform(shape, scale, true).Shape();
}

Shape Placed(const Shape& shape, const Eigen::Isometry3d& pose) {
  if (pose.isApprox(Eigen::Isometry3d::Identity(), 1e-15)) return shape;
  const Eigen::Matrix3d r = pose.linear();
  const Eigen::Vector3d t = pose.translation();
  gp_Trsf place;
  place.SetValues(r(0, 0), r(0, 1), r(0, 2), t.x(), r(1, 0), r(1, 1), r(1, 2), t.y(), r(2, 0), r(2, 1), r(2, 2), t.z());
  return BRepBuilderAPI_Transform(shape, place, true).Shape();
}

TriangleMesh Triangles(const Shape& shape, double facet_mm, double facet_rad) {
  BRepMesh_IncrementalMesh(shape, facet_mm, Standard_False, facet_rad, Standard_False);
  TriangleMesh mesh;
  for (TopExp_Explorer faces(shape, TopAbs_FACE); faces.More(); faces.Next()) {
    const TopoDS_Face& face = TopoDS::Face(faces.Current());
    TopLoc_Location location;
    const Handle(Poly_Triangulation) part = BRep_Tool::Triangulation(face, location);
    const int offset = static_cast<int>(mesh.points.size());
    for (int i = 1; i <= part->NbNodes(); ++i) {
      const gp_Pnt p = part->Node(i).Transformed(location.Transformation());
      mesh.points.emplace_back(p.X(), p.Y(), p.Z());
    }
    for (int i = 1; i <= part->NbTriangles(); ++i) {
      int a = 0;
      int b = 0;
      int c = 0;
      part->Triangle(i).Get(a, b, c);
      if (face.Orientation() == TopAbs_REVERSED) std::swap(b, c);
      mesh.triangles.push_back({offset + a - 1, offset + b - 1, offset + c - 1});
    }
  }
  return mesh;
}

void WriteStep(const Shape& shape, const std::filesystem::path& file) {
  Message::DefaultMessenger()->ChangePrinters().Clear();
  STEPControl_Writer writer;
  writer.Transfer(shape, STEPControl_AsIs);
  if (writer.Write(file.c_str()) != IFSelect_RetDone) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace

PartPlacement RolledBy(double degrees) {
  PartPlacement placement;
  placement.tool.linear() =
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return placement;
}

PartPlacement Anyhow(std::uint64_t seed) {
  RandomStream random(seed, 0, "parts that lie anyhow");
  const auto draw = [&] {
    Eigen::Quaterniond q;
    do {
      for (int k = 0; k < 4; ++k) q.coeffs()[k] = random.Uniform(-1.0, 1.0);
    } while (q.norm() > 1 || q.norm() < 0.1);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = q.normalized().toRotationMatrix();
    for (int k = 0; k < 3; ++k) pose.translation()[k] = random.Uniform(-50.0, 50.0);
    return pose;
  };
  PartPlacement placement;
  placement.tool = draw();
  placement.target = draw();
  return placement;
}

std::vector<PartKind> PartKinds() {
  std::vector<PartKind> kinds = {{"keyed", 0.15, 0.15, 12.0},
                                 {"d-plug", 0.12, 0.12, 10.0},
                                 {"usb-a", 0.2, 0.2, 12.0},
                                 {"rj45", 0.13, 0.13, 14.0},
                                 {"two-pin", 0.2, 0.2, 19.0},
                                 {"three-pin", 0.2, 0.2, 22.0},
                                 {"gear", 0.1, 0.1, 18.0, true},
                                 {"hex-socket", 0.1, 0.1, 8.0, true},
                                 {"taper", 0.0, 0.0, 0.0},
                                 {"tilted", 0.1, 0.1, 9.0},
                                 {"chamfered", 0.2, 0.2, 12.0},
                                 {"chamfered-tee", 0.2, 0.2, 12.0},
                                 {"shell", 0.2, 0.2, 11.9},
                                 {"assembly", 0.15, 0.15, 12.0, false, true},
                                 {"keyed-shaft", 0.1, 0.1, 12.0},
                                 {"short-key", 0.1, 0.1, 12.0},
                                 {"thin-plate", 0.1, 0.1, 11.0},
                                 {"keyed-gear", 0.1, 0.1, 18.0, true},
                                 {"set-screw", 0.1, 0.1, 18.0, true},
                                 {"ring-gear", 0.0, 0.0, 10.0},
                                 {"hexagon", 0.1, 0.1, 11.0},
                                 {"round-pins", 0.15, 0.15, 12.0},
                                 {"ellipse", 0.15, 0.15, 10.0},
                                 {"domed", 0.12, 0.12, 15.0, false, false, true},
                                 {"filleted", 0.12, 0.12, 12.0, false, false, true},
                                 {"filleted-bore", 0.1, 0.1, 12.0, false, false, true},
                                 {"oblique-bore", 0.1, 0.1, 0.0},
                                 {"oblique-slot", 0.15, 0.15, 0.0}};
  const std::vector<std::string> scalable = {"keyed",     "d-plug",     "rj45",          "two-pin",   "three-pin",
                                             "tilted",    "chamfered",  "chamfered-tee", "assembly",  "keyed-shaft",
                                             "short-key", "thin-plate", "keyed-gear",    "set-screw", "ring-gear",
                                             "ellipse",   "filleted"};
  for (PartKind& kind : kinds)
    kind.scalable_clearance = std::find(scalable.begin(), scalable.end(), kind.name) != scalable.end();
  return kinds;
}

PartFiles WriteParts(const std::string& kind, const std::filesystem::path& folder, const std::string& format,
                     const PartPlacement& placement) {
  PartPair pair = DrawParts(kind, placement.looser);
  pair.tool = Placed(Scaled(pair.tool, placement.scale), placement.tool);
  pair.target = Placed(Scaled(pair.target, placement.scale), placement.target);
  std::filesystem::create_directories(folder);
  if (format == "assembly") {
    BRep_Builder builder;
    TopoDS_Compound both;
    builder.MakeCompound(both);
    builder.Add(both, pair.tool);
    builder.Add(both, pair.target);
    const std::string file = (folder / (kind + ".step")).string();
    WriteStep(both, file);
    return {file + "#1", file + "#2"};
  }
  const std::string extension = "." + format.substr(0, format.find('-'));
  const std::filesystem::path tool = folder / (kind + "_tool" + extension);
  const std::filesystem::path target = folder / (kind + "_target" + extension);
  for (const auto& [shape, file] : {std::pair{pair.tool, tool}, {pair.target, target}}) {
    if (format == "step") {
      WriteStep(shape, file);
    } else {
      WriteMesh(Triangles(shape, placement.facet_mm, placement.facet_rad), file, format);
    }
  }
  return {tool.string(), target.string()};
}

}  // namespace feeler::cad
